"""Commands on the surrogate, the fast stand-in for the finite elements: `info`, `validate`, `train`."""

from __future__ import annotations

from collections.abc import Callable, Collection
from concurrent.futures import Executor
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.cluster import Scheduler, executor_of
from calib.cli.common import Accuracy, Processes, counting, err, out, refusing_bad_input, say
from calib.cli.stopping import when_stopped
from calib.errors import Fault, InputError
from calib.files import require_folder, require_writable, whole_file
from models.surrogate import FAMILIES, Family

if TYPE_CHECKING:
    from models.sensor import FloatArray
    from models.surrogate.fitting import Kept
    from models.surrogate.surrogate import Surrogate
    from models.surrogate.training import TrainingSet

#: Steps of a training if none are asked for, those of `models.surrogate.fitting`, which takes too long to load for a help text.
STEPS = 120_000

# Curves from which the error alone is learnt, if no number is asked for.
_ERROR_POINTS = 1000


class FamilyName(StrEnum):
    """The families of surrogates by name, for the choice on the command line."""

    neo_hookean = "neo-hookean"
    gent = "gent"
    slippery = "slippery"
    friction = "friction"
    slippery_friction = "slippery-friction"
    rubbing_base = "rubbing-base"
    foam = "foam"


class KeptPart(StrEnum):
    """What of a surrogate may be kept while the rest is learnt anew: the networks of one part, of both, or its error."""

    mechanics = "mechanics"
    capacitance = "capacitance"
    both = "both"
    error = "error"


SurrogateFile = Annotated[Path | None, typer.Option("--surrogate", help="Surrogate file [default: the shipped one].")]
WhichFamily = Annotated[FamilyName, typer.Option("--family", help="Base, law, friction or padding that it is for.")]


def info(file: SurrogateFile = None, family: WhichFamily = FamilyName.neo_hookean) -> None:
    """Say where the surrogate comes from, how far off it is, and what it covers.

    Example: `calib surrogate info`

    Exit codes: 0 done; 2 no such surrogate.
    """
    with refusing_bad_input():
        from rich.markup import escape
        from rich.table import Table

        from calib.experiment import surrogate_from

        if file is not None:
            say(f"{file}:")
        shown = Table.grid(padding=(0, 2))
        for key, value in surrogate_from(file, FAMILIES[family]).info().items():
            shown.add_row(escape(key), escape(value))
        out().print(shown)


def validate(
    file: SurrogateFile = None,
    family: WhichFamily = FamilyName.neo_hookean,
    designs: Annotated[int, typer.Option(min=1, help="Fresh random designs to compare on.")] = 50,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the designs.")] = 1,
    accuracy: Accuracy = 1e-3,
    processes: Processes = None,
) -> None:
    """Compare the surrogate with finite elements on fresh random designs over its whole range.

    Takes about half a second per design and process, with friction one, and three times as long at an accuracy three times
    higher: near first touch what is found at 0.1 % is mostly the finite elements' own error. Prints the error of force and of
    capacitance change, and how often the truth lies inside the surrogate's own 90 % band: over all, and in sub-boxes of the
    range, the quarters of the points by each group that shapes the mechanics and by depth.

    Example: `calib surrogate validate --designs 50 --seed 2`

    Exit codes: 0 done; 2 no such surrogate.
    """
    with refusing_bad_input():
        from rich.table import Table

        from calib.experiment import surrogate_from
        from calib.workers import workers
        from models.surrogate.validation import random_designs
        from models.surrogate.validation import validate as compare

        fast = surrogate_from(file, FAMILIES[family])
        chosen = random_designs(designs, seed, fast.family)
        with workers(processes) as executor, counting() as told:
            found = compare(fast, chosen, executor, accuracy=accuracy, progress=partial(told, "designs"))
        columns = ("quantity", "points", "error, median", "95 %", "worst", "share", "inside own 90 % band")
        shown = Table(*columns)
        for row in found.table():
            shown.add_row(*row)
        out().print(shown)
        boxed = Table("sub-box", "force, 95 %", "change, 95 %", "force inside own 90 % band", "change inside")
        for box in found.boxes():
            boxed.add_row(*box)
        out().print(boxed)
        for failure in found.failures:
            say(f"no equilibrium: {failure}")


def train(
    output: Annotated[Path, typer.Option("-o", "--output", help="Surrogate file to write (npz).")],
    family: WhichFamily = FamilyName.neo_hookean,
    points: Annotated[
        int | None,
        typer.Option(
            min=1, help="Finite-element loading curves to train on, with those in the store already [default: the family's]."
        ),
    ] = None,
    coarse: Annotated[
        int | None,
        typer.Option(min=0, help="Coarse loading curves beside them, cheaper and farther off [default: the family's]."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the choice of designs and of the training.")] = 1,
    accuracy: Accuracy = 1e-3,
    steps: Annotated[
        int | None, typer.Option(min=1, help="Steps of the training of each network [default: the family's].")
    ] = None,
    improve: Annotated[
        Path | None,
        typer.Option(help="Surrogate file: new curves are run where it states the largest errors, not all over the range."),
    ] = None,
    start: Annotated[
        Path | None,
        typer.Option(help="Surrogate file whose networks go on learning, from the curves, instead of new ones."),
    ] = None,
    keep: Annotated[
        KeptPart | None,
        typer.Option(
            help="Part of --start that stays as it is, so that the other alone goes on. Of both: the error that it states "
            "is learnt anew, from curves of designs even over the range, which it has not seen. With error both go on and what "
            "it states stays, where the curves are too few to tell."
        ),
    ] = None,
    recall: Annotated[
        int,
        typer.Option(
            min=0,
            help="Designs all over the range at which --start learns its own curves beside the new ones, so that it does not "
            "forget them: where the new ones are few or of a part of the range. As many as it was trained on are enough.",
        ),
    ] = 0,
    processes: Processes = None,
    store: Annotated[
        Path | None,
        typer.Option(help="File that the curves are kept in as they come [default: OUTPUT with the ending .sqlite]."),
    ] = None,
    scheduler: Scheduler = None,
) -> None:
    """Train a surrogate on finite-element loading curves spread over the whole range of designs.

    Takes about half a second per curve and process (with friction one), then up to half an hour for the networks. A family
    other than neo-Hookean is learned as what it adds to the shipped neo-Hookean surrogate, and needs fewer curves, of which
    many may be coarse ones. Stop it with Ctrl-C whenever you like: the same command goes on with the curves it has, and one
    with more --points adds to them. The file is used with `--surrogate FILE` in the other commands; check it first with `calib
    surrogate validate --surrogate FILE`.

    With --scheduler the curves are computed by the workers of a Dask cluster, the networks here. Client, scheduler and workers
    send each other Python objects (pickles): each of them can run code on all others. Give no address but of a cluster of your
    own in a network that you trust, or one that all sides enter by certificates (tls://, set up in Dask's own configuration,
    `distributed.comm.tls`; see docs/surrogate.md). All must have the same versions of Python, Dask and this package.

    Example: `calib surrogate train -o mine.npz --points 4096 --processes 8`

    Writes: mine.npz, and mine.sqlite with the curves (coarse ones in mine.coarse.sqlite).

    Exit codes: 0 done; 2 too few points, no place to write, or no cluster (or one that was lost: the curves so far are kept);
    130 stopped from the keyboard, 143 by SIGTERM, the curves so far kept.
    """
    with refusing_bad_input():
        import numpy as np

        from calib.experiment import surrogate_from
        from models.surrogate.fitting import KEPT, LEAST_PATHS, PARTS, fit_surrogate
        from models.surrogate.points import design_points, random_groups, worst_points

        of = FAMILIES[family]
        usual = (_ERROR_POINTS, 0) if keep is KeptPart.both else (of.recipe.points, of.recipe.coarse_points)
        n_point, n_coarse = (given if given is not None else own for given, own in zip((points, coarse), usual, strict=True))
        # Better said before an hour of finite elements than after.
        if n_point < LEAST_PATHS:
            raise InputError(Fault(f"--points {n_point} are too few to train on", advice=f"Give at least {LEAST_PATHS}"))
        require_new(output)
        kept = store if store is not None else output.with_suffix(".sqlite")
        require_folder(kept, "Create it first")
        base = surrogate_from(family=FAMILIES[of.adds_to]) if of.adds_to else None
        if keep is not None and start is None:
            raise InputError(Fault(f"--keep {keep} has nothing to keep", advice="Give --start FILE"))
        if keep is KeptPart.both and (improve is not None or coarse):
            raise InputError(
                Fault("--keep both goes by fine curves all over the range", advice="Leave --improve and --coarse out")
            )
        if recall and (start is None or keep is KeptPart.both or n_coarse):
            advice = "Give it with --start FILE, without --keep both, and with --coarse 0 in a family of coarse curves"
            raise InputError(Fault(f"--recall {recall} has no networks to go on, or not from fine curves alone", advice=advice))
        begun = None if start is None else _of(start, family)
        if keep is KeptPart.both:
            sequence = random_groups(n_point, np.random.default_rng(seed), of)
        elif improve is not None:
            sequence = worst_points(_of(improve, family), n_point, seed)
        else:
            sequence = design_points(n_point, seed, of)
        with executor_of(processes, scheduler) as executor:
            data = _gathered(kept, executor, sequence, n_point, accuracy, of, these=keep is KeptPart.both)
            below = None
            if n_coarse:
                # At other points than the fine ones, so that together they say more.
                others, least = design_points(n_coarse, seed + 1, of), of.recipe.coarse_accuracy
                below = _gathered(kept.with_suffix(".coarse.sqlite"), executor, others, n_coarse, least, of)
        stays: Collection[Kept] = PARTS if keep is KeptPart.both else [part for part in KEPT if part == keep]
        fit = partial(fit_surrogate, coarse=below, recall=recall, start=begun, keep=stays)
        try:
            with when_stopped(lambda: f"Stopped while training, with the curves in {kept}. The same command goes on."):
                fitted = trained(fit, data, base, of.recipe.steps if steps is None else steps, seed)
        except ValueError as error:
            raise InputError(Fault(f"--points: {error}")) from None
        with whole_file(output) as part:
            fitted.save(part)
        stuck = sum(map(bool, data.failures))
        say(f"Written: {output} ({len(data.failures)} curves, {stuck} of them without equilibrium to their end)")


def _gathered(
    path: Path, executor: Executor, sequence: FloatArray, n: int, accuracy: float, family: Family, *, these: bool = False
) -> TrainingSet:
    """Bring the store at `path` to `n` curves of an accuracy, at the first points of the sequence that it does not hold.

    If `these`, the curves are those of the sequence and no others, whatever else the store holds.
    """
    from models.surrogate.store import StoreError, open_store
    from models.surrogate.training import points_wanted, run_training, store_settings, training_set

    try:
        with open_store(path, store_settings(accuracy, family)) as runs:
            with (
                when_stopped(lambda: f"Stopped with {len(runs)} curves in {path}. The same command goes on."),
                counting() as told,
            ):
                err().print(f"{path}: {len(runs):,} loading curves of {n:,} are there", markup=False, soft_wrap=True)
                wanted = sequence if these else points_wanted(runs, sequence, n)
                run_training(wanted, executor, runs, accuracy=accuracy, family=family, progress=partial(told, "loading curves"))
            data = training_set(runs, accuracy, family)
            return data.at(sequence) if these else data
    except StoreError as error:
        raise InputError(Fault(str(error), path, advice="Choose another --store")) from None


def trained(
    fit: Callable[..., Surrogate], data: TrainingSet, base: Surrogate | None, steps: int | None, seed: int
) -> Surrogate:
    """Fit a surrogate to loading curves, with progress on stderr.

    Parameters
    ----------
    fit : as `models.surrogate.fitting.fit_surrogate`.
    data : the loading curves.
    base : the surrogate to refine; None to train one from the beginning.
    steps : of the training; None for the usual number.
    seed : of the networks' first weights.
    """
    with counting() as told:
        return fit(data, base=base, steps=STEPS if steps is None else steps, seed=seed, progress=told)


def require_new(output: Path) -> None:
    """Refuse an output file that exists, or that cannot be written, before anything long is computed.

    Raises
    ------
    InputError, OSError
        If so.
    """
    if output.exists():
        raise InputError(Fault("the file exists and is not overwritten", output, advice="Choose another -o"))
    require_writable(output, "Create it first")


def _of(file: Path, family: FamilyName) -> Surrogate:
    """Load the surrogate in `file`, which must be of the `family`."""
    from calib.experiment import surrogate_from

    found = surrogate_from(file)
    if found.family.name != family:
        raise InputError(Fault(f"it is a surrogate of the family {found.family.name}", file, advice=f"Give one of {family}"))
    return found

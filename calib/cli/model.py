"""Commands on the model of the sensor: `simulate` one loading curve; describe, check, train and refine the fast `surrogate`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from enum import StrEnum
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from calib.cli.common import (
    INTERRUPTED,
    NOT_CONVERGED,
    FamilyName,
    ModelName,
    Processes,
    RunFolder,
    counting,
    err,
    load_forward,
    load_run,
    out,
    quantity,
    refusing_bad_input,
    say,
    workers,
    write_whole,
)
from calib.errors import Fault, InputError
from models.surrogate.domain import FAMILIES, NEO_HOOKEAN, family_of

if TYPE_CHECKING:
    from models.fem import FiniteElements, Solution
    from models.layers import LayeredDesign
    from models.response import Response
    from models.sensor import Design
    from models.surrogate.store import RunStore
    from models.surrogate.surrogate import Surrogate

surrogate = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="The fast stand-in for the finite elements: describe it, check it, train another, refine it.",
)


class Field(StrEnum):
    """What a picture of the deformed sensor shows."""

    pressure = "pressure"
    thickness_stretch = "thickness_stretch"
    largest_stretch = "largest_stretch"


#: Columns of a simulated curve.
CURVE_COLUMNS = ("displacement_m", "force_N", "contact_radius_m", "capacitance_F", "capacitance_change")


def simulate(
    design: Annotated[Path, typer.Argument(help="The design file (TOML): indenter, sensor, padding or layers.")],
    displacement: Annotated[str | None, typer.Option(help='Indentation to go to, with unit, e.g. "0.7 mm".')] = None,
    force: Annotated[str | None, typer.Option(help='Force to go to instead, e.g. "5 N".')] = None,
    steps: Annotated[int, typer.Option(min=1, max=100000, help="Equal steps up to there.")] = 14,
    model: Annotated[
        ModelName, typer.Option(help="fem is exact and slow, closed-form rough and instant.")
    ] = ModelName.surrogate,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="CSV file to write [default: the screen].")] = None,
    surrogate_file: Annotated[
        Path | None, typer.Option("--surrogate", help="Surrogate file to use instead of the shipped one.")
    ] = None,
    unload: Annotated[bool, typer.Option("--unload", help="Come back the same steps to the first (fem).")] = False,
    accuracy: Annotated[
        float | None, typer.Option(min=1e-5, max=0.1, help="Relative accuracy to mesh for (fem) [default: 0.001].")
    ] = None,
    check: Annotated[
        bool, typer.Option("--check", help="Solve again on a finer mesh and print the estimated error (fem).")
    ] = False,
    picture: Annotated[
        Path | None, typer.Option(help="Image file of the deformed section at the deepest step (fem): png, pdf, svg.")
    ] = None,
    view: Annotated[
        Path | None, typer.Option(help="Image file (png) of the sensor in 3-D, cut open (fem, with the extra `view`).")
    ] = None,
    field: Annotated[Field, typer.Option(help="What colours the picture.")] = Field.pressure,
    vtk: Annotated[Path | None, typer.Option(help="ParaView file (pvd) of all steps to write (fem).")] = None,
) -> None:
    """Simulate the loading curve of one design, up to an indentation or a force.

    Example: `calib simulate design.toml --displacement "0.7 mm" -o curve.csv`

    Another: `calib simulate design.toml --force "5 N" --steps 20 --model fem --check --picture deformed.png -o curve.csv`

    Writes: one row per step, the last one at the requested end, columns displacement_m, force_N, contact_radius_m,
    capacitance_F, capacitance_change (C/C0 - 1). With --unload the rows go on back to the first step.

    Exit codes: 0 done; 2 bad input or outside the model's range, nothing written; 3 no equilibrium found before the end, the
    rows up to there written.
    """
    with refusing_bad_input():
        from calib.checks.predictive import loading_curve
        from calib.experiment.design import read_design
        from models.sensor import Design

        if (displacement is None) == (force is None):
            raise InputError(Fault("give either --displacement or --force", advice='For example --displacement "0.7 mm"'))
        written = {"-o": output, "--picture": picture, "--view": view, "--vtk": vtk}
        _check_outputs(design, written)
        depth = quantity(displacement, "m", "--displacement") if displacement is not None else None
        load = quantity(force, "N", "--force") if force is not None else None
        for name, value in (("--displacement", depth), ("--force", load)):
            if value is not None and value <= 0:
                raise InputError(Fault(f"{name} must be positive, got {displacement or force}"))
        asked = {
            "--unload": unload,
            "--accuracy": accuracy,
            "--check": check,
            **{k: v for k, v in written.items() if k != "-o"},
        }
        for name, wanted in asked.items():
            if wanted and model is not ModelName.fem:
                raise InputError(Fault(f"{name} needs the finite elements", advice="Add --model fem"))
        pressed = read_design(design)
        if model is ModelName.fem:
            _simulate_fem(pressed, depth, load, steps, output, unload, accuracy, check, picture, view, field, vtk)
            return
        if not isinstance(pressed, Design):
            covered = "a ball on a sensor and padding of one law, neo-Hookean or Gent, on a bonded base"
            message = f"the {model} covers {covered}; the design is another"
            raise InputError(Fault(message, design, advice="Add --model fem"))
        family = family_of(stiffening=bool(pressed.sensor.stiffening), stick=math.isinf(pressed.indenter.friction_coefficient))
        forward = load_forward(model, surrogate_file, family)
        curve = loading_curve(forward, pressed, displacement=depth, force=load, steps=steps)
        _write_curve(curve, output, f"{steps} steps, {model}")


def _check_outputs(design: Path, written: dict[str, Path | None]) -> None:
    """Better said before the finite elements than after."""
    for name, path in written.items():
        if path is None:
            continue
        if path.exists() and design.exists() and path.samefile(design):
            raise InputError(Fault("the output would overwrite the design file itself", path, advice=f"Choose another {name}"))
        if not path.absolute().parent.is_dir():
            raise InputError(Fault(f"the folder {path.absolute().parent} does not exist", path, advice="Create it first"))
    kinds = {"--picture": (".png", ".pdf", ".svg"), "--view": (".png",), "--vtk": (".pvd",)}
    for name, endings in kinds.items():
        path = written[name]
        if path is not None and path.suffix not in endings:
            raise InputError(Fault(f"{name} must end in {' or '.join(endings)}", path))


def _simulate_fem(
    design: Design | LayeredDesign,
    depth: float | None,
    load: float | None,
    steps: int,
    output: Path | None,
    unload: bool,
    accuracy: float | None,
    check: bool,
    picture: Path | None,
    view: Path | None,
    field: Field,
    vtk: Path | None,
) -> None:
    """The finite elements' own options: path, check, pictures."""
    import numpy as np

    from models.fem import FiniteElements

    elements = FiniteElements() if accuracy is None else FiniteElements(accuracy)
    ramp = np.linspace(0.0, (depth if depth is not None else load) or 0.0, steps + 1)[1:]
    path = np.concatenate([ramp, ramp[-2::-1]]) if unload else ramp
    solution = elements.solve(design, path) if depth is not None else elements.solve_to_force(design, path)
    if not solution.states:
        solution.checked()
    deepest = int(np.argmax([s.depth for s in solution.states]))
    if picture is not None or view is not None or vtk is not None:
        from calib.report import cross_section_figure, revolved_picture, write_figure, write_vtk

        if picture is not None:
            write_figure(cross_section_figure(solution, deepest, field.value), picture)
            err().print(f"Written: {picture}", markup=False, soft_wrap=True)
        if view is not None:
            revolved_picture(solution, deepest, field.value, view)
            err().print(f"Written: {view}", markup=False, soft_wrap=True)
        if vtk is not None:
            write_vtk(solution, vtk)
            err().print(f"Written: {vtk}", markup=False, soft_wrap=True)
    # Last, since a picture that cannot be made is refused, and then nothing is to be written.
    _write_curve(solution.response, output, f"{len(solution.states)} of {path.size} steps, fem")
    if solution.failure is None and check:
        for line in _check_lines(elements, solution):
            err().print(line, markup=False, soft_wrap=True)
    if solution.failure is not None:
        reached, reason = solution.states[-1].depth * solution.units.length, solution.failure.reason
        message = f"Ended early: no equilibrium beyond an indentation of {reached * 1e3:.4g} mm: {reason}"
        err().print(message, style="red", markup=False, soft_wrap=True)
        raise typer.Exit(NOT_CONVERGED)


def _check_lines(elements: FiniteElements, solution: Solution) -> list[str]:
    """The errors of a solution in words."""
    import numpy as np

    from models.fem.check import check

    found = check(elements, solution)
    lines = ["Estimated error of the mesh (solved again on elements of half the size):"]
    for name, error in (("force", found.force_error), ("capacitance change", found.change_error)):
        worst = int(np.nanargmax(np.abs(error)))
        at = solution.states[worst].depth * solution.units.length * 1e3
        lines.append(
            f"  {name:<20}{np.sqrt(np.nanmean(error**2)):8.3%} (rms over the steps), worst {error[worst]:+.3%} at {at:.3g} mm, "
            f"last {error[-1]:+.3%}"
        )
    if not np.isnan(found.energy_error):
        lines.append(f"Work of the indenter against stored energy: {found.energy_error:+.1e}")
    lines.append(f"Largest penetration, between the nodes too: {found.penetration:.1e} of the indentation")
    return lines


def _write_curve(curve: Response, output: Path | None, what: str) -> None:
    text = curve_csv(curve)
    if output is None:
        typer.echo(text, nl=False)
    else:
        write_whole(output, text)
        say(f"Written: {output} ({what})")


def curve_csv(curve: Response) -> str:
    """A loading curve as CSV with the columns `CURVE_COLUMNS`, SI."""
    import numpy as np

    columns = (curve.depth, curve.force, curve.contact_radius, curve.capacitance, curve.capacitance_change)
    rows = np.stack([np.reshape(c, -1) for c in columns], axis=1)
    return "\n".join([",".join(CURVE_COLUMNS), *(",".join(f"{v:.10g}" for v in row) for row in rows)]) + "\n"


SurrogateFile = Annotated[Path | None, typer.Option("--surrogate", help="Surrogate file [default: the shipped one].")]
WhichFamily = Annotated[FamilyName, typer.Option("--family", help="Law of the layers, or contact, that it is for.")]


@surrogate.command()
def info(file: SurrogateFile = None, family: WhichFamily = FamilyName.neo_hookean) -> None:
    """Say where the surrogate comes from, how far off it is, and what it covers.

    Example: `calib surrogate info`

    Exit codes: 0 done; 2 no such surrogate.
    """
    with refusing_bad_input():
        from rich.markup import escape
        from rich.table import Table

        shown = Table.grid(padding=(0, 2))
        for key, value in _load(file, family).info().items():
            shown.add_row(escape(key), escape(value))
        out().print(shown)


@surrogate.command()
def validate(
    file: SurrogateFile = None,
    family: WhichFamily = FamilyName.neo_hookean,
    designs: Annotated[int, typer.Option(min=1, help="Fresh random designs to compare on.")] = 50,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the designs.")] = 1,
    processes: Processes = None,
) -> None:
    """Compare the surrogate with finite elements on fresh random designs over its whole range.

    Takes about half a second per design and process. Prints the error of force and of capacitance change, and how often the
    truth lies inside the surrogate's own 90 % band.

    Example: `calib surrogate validate --designs 50 --seed 2`

    Exit codes: 0 done; 2 no such surrogate.
    """
    with refusing_bad_input():
        from rich.table import Table

        from models.surrogate.validation import random_designs
        from models.surrogate.validation import validate as compare

        fast = _load(file, family)
        chosen = random_designs(designs, seed, fast.family)
        with workers(processes) as executor, counting() as told:
            found = compare(fast, chosen, executor, progress=partial(told, "designs"))
        columns = ("quantity", "points", "error, median", "95 %", "worst", "share", "inside own 90 % band")
        shown = Table(*columns)
        for row in found.table():
            shown.add_row(*row)
        out().print(shown)
        for failure in found.failures:
            say(f"no equilibrium: {failure}")


@surrogate.command()
def train(
    output: Annotated[Path, typer.Option("-o", "--output", help="Surrogate file to write (npz).")],
    family: WhichFamily = FamilyName.neo_hookean,
    points: Annotated[
        int, typer.Option(min=1, help="Finite-element loading curves to train on, with those that the store holds already.")
    ] = 8192,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the choice of designs and of the training.")] = 1,
    accuracy: Annotated[
        float, typer.Option(min=1e-5, max=0.1, help="Relative accuracy the finite elements are meshed for.")
    ] = 1e-3,
    steps: Annotated[int | None, typer.Option(min=1, help="Steps of the training of each network [default: 120000].")] = None,
    improve: Annotated[
        Path | None,
        typer.Option(help="Surrogate file: new curves are run where it states the largest errors, not all over the range."),
    ] = None,
    processes: Processes = None,
    store: Annotated[
        Path | None,
        typer.Option(help="File that the curves are kept in as they come [default: OUTPUT with the ending .sqlite]."),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(help='Address of a Dask scheduler to run on, e.g. "tcp://node1:8786" (with the extra `cluster`).'),
    ] = None,
) -> None:
    """Train a surrogate on finite-element loading curves spread over the whole range of designs.

    Takes about half a second per curve and process (with a ball that sticks two), then about half an hour for the networks. A
    family other than neo-Hookean is learned as what it adds to the shipped neo-Hookean surrogate, and needs fewer curves.
    Stop it with Ctrl-C whenever you like: the same command goes on with the curves it has, and one with more --points adds to
    them. The file is used with `--surrogate FILE` in the other commands; check it first with `calib surrogate validate
    --surrogate FILE`.

    Example: `calib surrogate train -o mine.npz --points 4096 --processes 8`

    Writes: mine.npz, and mine.sqlite with the curves.

    Exit codes: 0 done; 2 too few points, or no place to write; 130 stopped from the keyboard, the curves so far kept.
    """
    with refusing_bad_input():
        from models.surrogate.fitting import LEAST_PATHS, STEPS, fit_surrogate, worst_points
        from models.surrogate.store import StoreError, open_store
        from models.surrogate.training import design_points, points_wanted, run_training, store_settings, training_set

        # Better said before an hour of finite elements than after.
        if points < LEAST_PATHS:
            raise InputError(Fault(f"--points {points} are too few to train on", advice=f"Give at least {LEAST_PATHS}"))
        _require_new(output)
        kept = store if store is not None else output.with_suffix(".sqlite")
        _require_folder(kept)
        of = FAMILIES[family]
        base = _load(None, FamilyName.neo_hookean) if of is not NEO_HOOKEAN else None
        sequence = design_points(points, seed, of) if improve is None else worst_points(_of(improve, family), points, seed)
        try:
            with _executor(processes, scheduler) as executor, open_store(kept, store_settings(accuracy, of)) as runs:
                try:
                    with counting() as told:
                        wanted, counted = points_wanted(runs, sequence, points), partial(told, "loading curves")
                        run_training(wanted, executor, runs, accuracy=accuracy, family=of, progress=counted)
                except KeyboardInterrupt:
                    err().print(f"Stopped with {len(runs)} curves in {kept}. The same command goes on.", markup=False)
                    raise typer.Exit(INTERRUPTED) from None
                data = training_set(runs, accuracy, of)
        except StoreError as error:
            raise InputError(Fault(str(error), kept, advice="Choose another --store")) from None
        try:
            with counting() as told:
                fitted = fit_surrogate(data, base=base, steps=STEPS if steps is None else steps, seed=seed, progress=told)
        except ValueError as error:
            raise InputError(Fault(f"--points: {error}")) from None
        fitted.save(output)
        stuck = sum(map(bool, data.failures))
        say(f"Written: {output} ({len(data.failures)} curves, {stuck} of them without equilibrium to their end)")


@surrogate.command()
def refine(
    run: RunFolder,
    draws: Annotated[int, typer.Option(min=1, help="Draws to run and to compare at.")] = 32,
    reweight: Annotated[
        int, typer.Option(min=25, help="Draws to re-weight for the verdict; with fewer than 100 k-hat is a coarse judge.")
    ] = 100,
    store: Annotated[
        Path | None, typer.Option(help="File of loading curves that the new ones are added to [default: RUN/refine.sqlite].")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="NEW.npz", help="Surrogate file to write, trained on all curves of the store."),
    ] = None,
    steps: Annotated[int | None, typer.Option(min=1, help="Steps of that training [default: 120000].")] = None,
    accuracy: Annotated[
        float, typer.Option(min=1e-5, max=0.1, help="Relative accuracy the finite elements are meshed for.")
    ] = 1e-3,
    processes: Processes = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the choice of draws, and of the training.")] = 1,
) -> None:
    """Run the finite elements at draws of a posterior, say how far off the surrogate is there and whether the posterior stands.

    The posterior is re-weighted to the likelihood with finite elements (Pareto-smoothed importance sampling). It stands if the
    weights can be trusted (k-hat) and no parameter's mean shifts by more than 0.1 posterior standard deviations beyond twice
    its Monte Carlo error. The loading curves run at the draws are kept in the store and serve to train a better surrogate: give
    the store of a whole campaign (`calib surrogate train --store`), since one trained at these draws alone claims to cover the
    whole range and does not. The weights are of finite elements at an accuracy of 2.5e-4, if --accuracy is not finer: a
    surrogate can be nearer to the truth than coarser ones. Takes two to four seconds per draw, sweep and process.

    Example: `calib surrogate refine run1 --store mine.sqlite -o better.npz`

    Then: `calib calibrate experiment.toml -o run2 --surrogate better.npz`

    Writes: run1/refine.sqlite (or the store), and better.npz if asked for. The run stays as it is.

    Exit codes: 0 the posterior stands; 2 bad input, nothing written; 3 it should be run again, for the reason said; 130 stopped
    from the keyboard, the curves so far kept.
    """
    with refusing_bad_input():
        import numpy as np
        from rich.markup import escape
        from rich.table import Table

        from calib.checks.refine import error_rows, require_own_surrogate, shift_rows, stands, training_points, verdict
        from calib.checks.reweight import ACCURACY
        from calib.checks.reweight import reweight as weigh
        from calib.checks.spotcheck import compare_draws
        from calib.sampling.posterior import thin_draws
        from models.fem import FiniteElements
        from models.surrogate.store import StoreError, open_store
        from models.surrogate.training import run_training, store_settings

        posterior, forward = load_run(run)
        fast = require_own_surrogate(posterior, forward)
        kept = store if store is not None else run / "refine.sqlite"
        _require_folder(kept)
        of = fast.family
        exact, settings, rng = FiniteElements(accuracy), store_settings(accuracy, of), np.random.default_rng(seed)
        values = thin_draws(posterior, draws, rng)
        points = training_points(posterior, values)
        try:
            if output is not None:
                _check_retraining(output, kept, settings)
            with workers(processes) as executor, open_store(kept, settings) as runs:
                try:
                    with counting() as told:
                        before = len(runs)
                        counted = partial(told, "loading curves")
                        run_training(points, executor, runs, accuracy=accuracy, family=of, progress=counted)
                        say(f"Added to {kept}: {len(runs) - before} loading curves, now {len(runs)}")
                        compared = compare_draws(posterior, fast, exact, values, executor)
                        weighed = thin_draws(posterior, reweight, rng)
                        finer = FiniteElements(min(accuracy, ACCURACY))
                        found = weigh(posterior, fast, finer, weighed, executor, progress=partial(told, "draws re-weighted"))
                    errors = Table("sweep", "quantity", "error, median", "95 %", "worst", "rms of error / stated sd")
                    shifts = Table("parameter", "posterior", "re-weighted", "unit", "shift of the mean in sd")
                    for table, rows in ((errors, error_rows(compared)), (shifts, shift_rows(posterior, found))):
                        for row in rows:
                            table.add_row(*map(escape, row))
                        out().print(table)
                    for failure in (*(f"{c.sweep}: {why}" for c in compared for why in c.failures), *found.failures):
                        say(f"no equilibrium: {failure}")
                    say(verdict(posterior, found))
                    if output is not None:
                        _retrain(output, runs, accuracy, fast, steps, seed)
                except KeyboardInterrupt:
                    err().print(f"Stopped with {len(runs)} curves in {kept}. The same command goes on.", markup=False)
                    raise typer.Exit(INTERRUPTED) from None
        except StoreError as error:
            raise InputError(Fault(str(error), kept, advice="Choose another --store")) from None
    if not stands(posterior, found):
        raise typer.Exit(NOT_CONVERGED)


def _require_new(output: Path) -> None:
    """Refuse an output file that exists, or that has no folder to be in."""
    if output.exists():
        raise InputError(Fault("the file exists and is not overwritten", output, advice="Choose another -o"))
    _require_folder(output)


def _require_folder(path: Path) -> None:
    if not path.absolute().parent.is_dir():
        raise InputError(Fault(f"the folder {path.absolute().parent} does not exist", path, advice="Create it first"))


def _check_retraining(output: Path, kept: Path, settings: dict[str, object]) -> None:
    """Better said before the finite elements than after."""
    from models.surrogate.fitting import LEAST_PATHS
    from models.surrogate.store import open_store

    _require_new(output)
    held = 0
    if kept.exists():
        with open_store(kept, settings) as runs:
            held = len(runs)
    if held < LEAST_PATHS:
        advice = "Give the --store of `calib surrogate train`, or leave -o out"
        message = f"the store holds {held} loading curves, too few to train a surrogate (at least {LEAST_PATHS})"
        raise InputError(Fault(message, kept, advice=advice))


def _retrain(output: Path, runs: RunStore, accuracy: float, fast: Surrogate, steps: int | None, seed: int) -> None:
    from models.surrogate.fitting import STEPS, fit_surrogate
    from models.surrogate.training import training_set

    data = training_set(runs, accuracy, fast.family)
    try:
        with counting() as told:
            fitted = fit_surrogate(data, base=fast.base, steps=STEPS if steps is None else steps, seed=seed, progress=told)
    except ValueError as error:
        raise InputError(Fault(str(error), output, advice="Leave -o out, or give a --store with more curves")) from None
    fitted.save(output)
    say(f"Written: {output} ({len(data.failures)} curves)")


@contextmanager
def _executor(processes: int | None, scheduler: str | None) -> Iterator[Executor]:
    """Processes of this machine, or the workers of a Dask cluster."""
    if scheduler is None:
        with workers(processes) as executor:
            yield executor
        return
    try:
        distributed: Any = import_module("distributed")
    except ImportError:
        advice = 'Install it with: pip install "dielectric-elastomer-calibration[cluster]"'
        raise InputError(Fault("--scheduler needs the extra `cluster`, which is not installed", advice=advice)) from None
    try:
        client = distributed.Client(scheduler, timeout=10)
    except (OSError, ValueError) as error:
        raise InputError(Fault(f"--scheduler: no Dask scheduler answers at {scheduler} ({error})")) from None
    with client:
        yield client.get_executor()


def _load(file: Path | None, family: FamilyName) -> Surrogate:
    from models.surrogate.surrogate import Surrogate

    found = load_forward("surrogate", file, FAMILIES[family])
    assert isinstance(found, Surrogate)
    return found


def _of(file: Path, family: FamilyName) -> Surrogate:
    """The surrogate in `file`, which must be of the `family`."""
    found = _load(file, family)
    if found.family.name != family:
        raise InputError(Fault(f"it is a surrogate of the family {found.family.name}", file, advice=f"Give one of {family}"))
    return found

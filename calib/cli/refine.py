"""The command `surrogate refine`: finite elements at draws of a run, whether its posterior stands, a better surrogate."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import (
    Accuracy,
    Processes,
    RunFolder,
    counting,
    loaded,
    not_usable,
    out,
    refusing_bad_input,
    say,
)
from calib.cli.stopping import when_stopped
from calib.cli.surrogate import STEPS, require_new, trained
from calib.errors import Fault, InputError
from calib.files import require_folder, whole_file

if TYPE_CHECKING:
    from calib.runs import Refinement
    from calib.sampling import Posterior


def refine(
    ctx: typer.Context,
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
    steps: Annotated[int | None, typer.Option(min=1, help=f"Steps of that training [default: {STEPS}].")] = None,
    accuracy: Accuracy = 1e-3,
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
        from calib.checks import require_own_surrogate, stands
        from calib.runs import Means
        from calib.runs import refine as refine_at
        from models.surrogate.store import StoreError, open_store
        from models.surrogate.training import store_settings, training_set

        means = ctx.obj if ctx.obj is not None else Means()
        found = loaded(run)
        posterior, fast = found.posterior, require_own_surrogate(found.posterior, found.forward)
        kept = store if store is not None else run / "refine.sqlite"
        require_folder(kept, "Create it first")
        settings = store_settings(accuracy, fast.family)
        try:
            if output is not None:
                _check_retraining(output, kept, settings)
            with (
                open_store(kept, settings) as runs,
                means.workers(processes) as executor,
                when_stopped(lambda: f"Stopped with {len(runs)} curves in {kept}. The same command goes on."),
            ):
                with counting() as told:
                    refined = refine_at(
                        posterior,
                        fast,
                        runs,
                        executor,
                        n_draw=draws,
                        n_reweight=reweight,
                        accuracy=accuracy,
                        seed=seed,
                        exact=means.exact,
                        added=lambda new: say(f"Added to {kept}: {new} loading curves, now {len(runs)}"),
                        progress=told,
                    )
                _say(posterior, refined)
                if output is not None:
                    data = training_set(runs, accuracy, fast.family)
                    try:
                        fitted = trained(means.fit, data, fast.base, steps, seed)
                    except ValueError as error:
                        advice = "Leave -o out, or give a --store with more curves"
                        raise InputError(Fault(str(error), output, advice=advice)) from None
                    with whole_file(output) as part:
                        fitted.save(part)
                    say(f"Written: {output} ({len(data.failures)} curves)")
        except StoreError as error:
            raise InputError(Fault(str(error), kept, advice="Choose another --store")) from None
    if not stands(posterior, refined.reweighting):
        raise not_usable("the draws of this run must not be used: see the reasons above")


def _say(posterior: Posterior, refined: Refinement) -> None:
    from rich.markup import escape
    from rich.table import Table

    from calib.checks import error_rows, refinement_in_words, shift_rows

    compared, found = refined.comparisons, refined.reweighting
    errors = Table("sweep", "quantity", "error, median", "95 %", "worst", "rms of error / stated sd")
    shifts = Table("parameter", "posterior", "re-weighted", "unit", "shift of the mean in sd")
    for table, rows in ((errors, error_rows(compared)), (shifts, shift_rows(posterior, found))):
        for row in rows:
            table.add_row(*map(escape, row))
        out().print(table)
    for failure in (*(f"{c.sweep}: {why}" for c in compared for why in c.failures), *found.failures):
        say(f"no equilibrium: {failure}")
    say(refinement_in_words(posterior, found))


def _check_retraining(output: Path, kept: Path, settings: dict[str, object]) -> None:
    """Better said before the finite elements than after."""
    from models.surrogate.fitting import LEAST_PATHS
    from models.surrogate.store import open_store

    require_new(output)
    held = 0
    if kept.exists():
        with open_store(kept, settings) as runs:
            held = len(runs)
    if held < LEAST_PATHS:
        advice = "Give the --store of `calib surrogate train`, or leave -o out"
        message = f"the store holds {held} loading curves, too few to train a surrogate (at least {LEAST_PATHS})"
        raise InputError(Fault(message, kept, advice=advice))

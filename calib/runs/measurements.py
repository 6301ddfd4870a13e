"""A run in, what to measure next out, kept in its folder as next.json."""

from __future__ import annotations

from calib.decision import NextMeasurements, Requirement, next_measurements, next_to_json
from calib.errors import Fault, InputError
from calib.experiment import Bench
from calib.files import write_text
from calib.runs.folder import Run, fast_forward, load_recommendation, owned_run, require_own_forward
from calib.runs.listing import NEXT, writing


def next_for(run: Run, requirement: Requirement | None, bench: Bench | None = None, *, seed: int) -> NextMeasurements:
    """Say what to measure next after a run, and write nothing.

    Parameters
    ----------
    run, requirement, bench, seed : as of `next_in`.

    Raises
    ------
    InputError
        If nothing can be said, or the model is not the one that the run was calibrated with.
    """
    require_own_forward(run)
    return next_measurements(
        run.posterior,
        fast_forward(run),
        requirement,
        bench,
        seed=seed,
        posterior_sha256=run.posterior_sha256,
        verdict=run.verdict,
    )


def next_in(
    run: Run, requirement: Requirement | None, bench: Bench | None = None, *, seed: int, command: str = ""
) -> NextMeasurements:
    """Say what to measure next after a run, and keep that there: next.json.

    Parameters
    ----------
    run : the calibration.
    requirement : the load and the thicknesses of the padding whose signal is to be known better; None for the modulus.
    bench : what the lab can measure; usual values by default.
    seed : of the choice of draws.
    command : the command line, kept with the run.

    Raises
    ------
    InputError
        If nothing can be said, the model is not the one that the run was calibrated with, or another process writes into the
        folder; nothing is written then.
    """
    found = next_for(run, requirement, bench, seed=seed)
    command = command or "calib next"
    with owned_run(run, command) as listing, writing(run.folder, listing, (NEXT,), command):
        write_text(run.folder / NEXT, next_to_json(found, listing.fingerprint))
    return found


def asked_before(run: Run) -> Requirement:
    """What the recommendation of a run was asked for.

    Raises
    ------
    InputError
        If there is none, or it is for a specification.
    """
    kept = load_recommendation(run.folder)
    if kept is None or kept.conformity is not None:
        advice = 'Give --force "10 N" and --padding "0 mm:9 mm", or run `calib recommend` first'
        raise InputError(Fault("nothing says at which load the signal counts", run.folder, advice=advice))
    return kept.requirement

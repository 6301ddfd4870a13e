"""A run in, what to measure next out, kept in its folder as next.json."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import partial

from calib.decision import NextMeasurements, Requirement, next_measurements, next_to_json
from calib.errors import Fault, InputError
from calib.experiment import Bench, Specification
from calib.files import write_text
from calib.runs.folder import Run, fast_forward, load_recommendation, owned_run, require_own_forward
from calib.runs.listing import NEXT, PAGES, writing
from calib.runs.page import kept_page_drawings, page_of, write_page


def next_for(
    run: Run, requirement: Requirement | Specification | None, bench: Bench | None = None, *, seed: int
) -> NextMeasurements:
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
    requirement, advised_by = _as_advised(run, requirement)
    return next_measurements(
        run.posterior,
        fast_forward(run),
        requirement,
        bench,
        seed=seed,
        verdict=run.verdict,
        advised_by=advised_by,
    )


def _as_advised(
    run: Run, requirement: Requirement | Specification | None
) -> tuple[Requirement | Specification | None, int | None]:
    """What is asked, with the draws and the seed of the recommendation for the same, so that its very padding is meant."""
    kept = None
    with suppress(InputError):  # one that is damaged advises nothing
        kept = load_recommendation(run.folder)
    if requirement is None or kept is None or kept.draws_sha256 != run.posterior.draws_sha256:
        return requirement, None
    if isinstance(requirement, Requirement):
        asked, seed = (kept.requirement if kept.conformity is None else None), kept.seed
        same = asked is not None and replace(asked, n_draw=requirement.n_draw) == requirement
        return (asked, seed) if same else (requirement, None)
    if kept.conformity is None:
        return requirement, None
    specified = kept.conformity.specification
    same = replace(specified, n_draw=requirement.n_draw).to_plain() == requirement.to_plain()
    return (specified, kept.conformity.seed) if same else (requirement, None)


def next_in(
    run: Run, requirement: Requirement | Specification | None, bench: Bench | None = None, *, seed: int, command: str = ""
) -> NextMeasurements:
    """Say what to measure next after a run, and keep that there: next.json, and report.html anew.

    Parameters
    ----------
    run : the calibration.
    requirement : the load and the thicknesses of the padding whose signal is to be known better, or the specification to
        decide on; None for the modulus.
    bench : what the lab can measure; usual values by default.
    seed : of the choice of draws.
    command : the command line, kept with the run.

    Raises
    ------
    InputError
        If nothing can be said, the model is not the one that the run was calibrated with, or another process writes into the
        folder; nothing is written then.
    PageError
        If the page cannot be made; next.json is written then.
    """
    found = next_for(run, requirement, bench, seed=seed)
    command = command or "calib next"
    with owned_run(run, command) as listing:
        drawings = kept_page_drawings(run, listing)
        with writing(run.folder, listing, (NEXT, *PAGES), command):
            write_text(run.folder / NEXT, next_to_json(found, listing.fingerprint))
            failure = write_page(run, partial(page_of, drawings=drawings) if drawings else page_of)
    if failure is not None:
        raise failure
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


def specified_before(run: Run) -> Specification:
    """The specification that the recommendation of a run was asked for.

    Raises
    ------
    InputError
        If there is none.
    """
    kept = load_recommendation(run.folder)
    if kept is None or kept.conformity is None:
        advice = "Give --spec spec.toml, or run `calib recommend RUN --spec spec.toml` first"
        raise InputError(Fault("nothing says which specification is to be met", run.folder, advice=advice))
    return kept.conformity.specification

"""A finished run in, its report or its recommendation, with the page that shows it, written anew out."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from calib import report
from calib.decision import Recommendation, Requirement, recommend_for, recommendation_to_json
from calib.experiment import Specification
from calib.files import whole_file, write_text
from calib.runs.folder import Run, load_recommendation, owned_run, require_own_forward, unlisted
from calib.runs.listing import PAGES, PRINTED, RECOMMENDATION, SPECIFICATION, SUMMARIES, writing
from calib.runs.page import PageError, kept_page_drawings, page_of, write_page, write_summaries_and_page


def report_in(run: Run, browser: Path | None = None, *, command: str = "") -> None:
    """Write the report of a run anew, with the summary, from its posterior and its recommendation.

    A print of an earlier page is removed, as by all that writes the page anew.

    Parameters
    ----------
    run : whose report it is.
    browser : prints the page, too, as report.pdf, see `calib.report.find_browser`; None for the page alone.
    command : the command line, kept with the run.

    Raises
    ------
    InputError
        If another process writes into the folder, or the recommendation in it is not that of this run.
    PageError
        If the page cannot be made, or printed; it is there without its print then.
    """
    command = command or "calib report"
    with owned_run(run, command) as listing:
        load_recommendation(run.folder)
        names = (*SUMMARIES, *PAGES, *unlisted(run.folder, listing))
        with writing(run.folder, listing, names, command):
            failure = write_summaries_and_page(run, page_of)
            if failure is None and browser is not None:
                failure = _print(run, browser)
    if failure is not None:
        raise failure


def recommend_in(run: Run, wanted: Requirement | Specification, *, seed: int, command: str = "") -> Recommendation:
    """Recommend a padding from the posterior of a run and keep it there: recommendation.json, and report.html anew.

    For a specification specification.csv, too, thickness by thickness; for a requirement an earlier one is removed.

    Parameters
    ----------
    run : the calibration.
    wanted : of the padding, or the specification that it must meet.
    seed : of the choice of draws.
    command : the command line, kept with the run.

    Raises
    ------
    InputError
        If the model covers no thickness of the request, or is not the one that the run was calibrated with, or another process
        writes into the folder; nothing is written then.
    PageError
        If the page cannot be made; the recommendation is written then.
    """
    require_own_forward(run)
    found = recommend_for(
        run.posterior,
        run.forward,
        wanted,
        seed=seed,
        verdict=run.verdict,
        members=run.members,
    )
    command = command or "calib recommend"
    with owned_run(run, command) as listing:
        drawings = kept_page_drawings(run, listing)
        names = (RECOMMENDATION, SPECIFICATION, *PAGES, *unlisted(run.folder, listing))
        with writing(run.folder, listing, names, command):
            write_text(run.folder / RECOMMENDATION, recommendation_to_json(found, listing.fingerprint))
            table = run.folder / SPECIFICATION
            if found.conformity is None:
                table.unlink(missing_ok=True)
            else:
                write_text(table, found.conformity.to_dataframe().to_csv(index=False, lineterminator="\n"))
            failure = write_page(run, partial(page_of, drawings=drawings) if drawings else page_of)
    if failure is not None:
        raise failure
    return found


def _print(run: Run, browser: Path) -> PageError | None:
    """Print the page of a run; why not, if that fails."""
    try:
        with whole_file(run.printed) as whole:
            report.print_page(browser, run.report, whole)
        return None
    except report.PrintError as error:
        return PageError(run.folder, str(error), PRINTED)

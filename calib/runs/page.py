"""A run in, what people and programs read of it out: its summaries and its page, or why there is no page."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

from calib import report
from calib.decision import NextInShort, Recommendation, next_from_json, next_measurements
from calib.errors import InputError, in_shell_path
from calib.files import write_text
from calib.runs.folder import Run, load_recommendation
from calib.runs.listing import NEXT, POSTERIOR, PRINTED, REPORT, SUMMARIES, Listing

# With more unknowns what to measure next is not worked out for the page.
_MOST_UNKNOWNS = 40


class PageError(Exception):
    """The page of a run, or its print, could not be made, for the reason it says; all else that was to be written is there."""

    def __init__(self, folder: Path, reason: str, name: str = REPORT) -> None:
        again = f"calib report {in_shell_path(folder)}"
        if name == PRINTED:
            super().__init__(f"{REPORT} is written, but not {name} ({reason}). Print {folder / REPORT} from any browser")
        else:
            super().__init__(
                f"the report could not be written ({reason}). All results are kept in {folder}; write it with: {again}"
            )


def page_of(
    run: Run, recommendation: Recommendation | None = None, *, drawings: Mapping[str, Callable[[], str]] | None = None
) -> str:
    """Lay out the report's page of a run.

    Parameters
    ----------
    run : whose posterior it shows.
    recommendation : shown in a section of its own, if there is one.
    drawings : pictures that workers draw, or that an earlier page of this posterior has.
    """
    return report.report_page(
        run.posterior,
        run.predictions,
        recommendation,
        verdict=run.verdict,
        posterior_sha256=run.posterior_sha256,
        drawings=drawings,
        members=run.members,
        next_steps=next_steps_of(run),
    )


def next_steps_of(run: Run) -> NextInShort | None:
    """What to measure next after a run: what `calib next` has kept of its posterior, else for its modulus, where that is quick.

    Returns
    -------
    None where the verdict is red.
    """
    if run.verdict.colour == "red":
        return None
    path = run.folder / NEXT
    if path.is_file():
        with suppress(InputError, OSError):  # of an earlier version, or not as it was written: it is worked out anew
            text = path.read_bytes().decode("utf-8", errors="replace")
            kept = next_from_json(text, path, run.posterior.draws_sha256)
            if kept is not None:
                return kept
    if run.members or run.another_forward or run.posterior.experiment.model == "fem":
        return _nothing_next("it takes the runs of single models, with a surrogate that is as it was")
    if len(run.posterior.unknowns) > _MOST_UNKNOWNS:
        return _nothing_next(f"there are {len(run.posterior.unknowns)} unknowns, and it would take a while")
    try:
        return next_measurements(run.posterior, run.forward, seed=run.posterior.seed, verdict=run.verdict).in_short
    except InputError as error:
        return _nothing_next(error.faults[0].message)


def _nothing_next(why: str) -> NextInShort:
    return NextInShort("modulus", "", "", (), why)


def begin_page_drawings(run: Run, executor: Executor) -> Mapping[str, Callable[[], str]] | None:
    """Let workers draw the pictures of a run's page; None if that fails, as it will where the page is made, which tells.

    Parameters
    ----------
    run : whose page it is.
    executor : of the workers.
    """
    with suppress(Exception):
        return report.begin_drawing(run.posterior, run.predictions, load_recommendation(run.folder), executor)
    return None


def kept_page_drawings(run: Run, listing: Listing) -> Mapping[str, Callable[[], str]]:
    """The pictures that the page of a run has, if that is as it was written for the run's posterior.

    Parameters
    ----------
    run : whose page it is.
    listing : what its `run.json` says.
    """
    if not run.report.is_file() or listing.files.get(POSTERIOR) != run.posterior_sha256:
        return {}
    content = run.report.read_bytes()
    if sha256(content).hexdigest() != listing.files.get(REPORT):
        return {}
    with suppress(Exception):  # as it fails again where the page is made, which tells
        return report.kept_drawings(run.posterior, run.predictions, content.decode("utf-8"))
    return {}


def write_summaries_and_page(run: Run, page: Callable[[Run, Recommendation | None], str]) -> PageError | None:
    """Write what follows from a posterior: the summaries, and the page if that can be made; why not, if it cannot.

    Parameters
    ----------
    run : whose they are.
    page : lays the page out.
    """
    write_text(run.folder / SUMMARIES[0], report.summary_json(run.posterior, run.verdict))
    write_text(run.folder / SUMMARIES[1], report.summary_csv(run.posterior))
    return write_page(run, page)


def write_page(run: Run, page: Callable[[Run, Recommendation | None], str]) -> PageError | None:
    """Write the page; if that fails, for whatever reason, remove the earlier one, which is of other results, and say why.

    A print of the earlier one is removed in any case.

    Parameters
    ----------
    run : whose page it is.
    page : lays it out.
    """
    run.printed.unlink(missing_ok=True)
    try:
        write_text(run.report, page(run, load_recommendation(run.folder)))
        return None
    except Exception as error:
        with suppress(OSError):
            run.report.unlink(missing_ok=True)
        kind = "" if isinstance(error, InputError) else f"{type(error).__name__}: "
        return PageError(run.folder, f"{kind}{error}")

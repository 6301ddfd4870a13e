"""A posterior in, its run folder out: draws first, then summaries, page and `run.json`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from functools import partial
from pathlib import Path

from calib.checks import Member
from calib.decision import Recommendation
from calib.files import sha256_of
from calib.runs.folder import Run, unlisted
from calib.runs.listing import PAGES, POSTERIOR, SUMMARIES, Listing, checkpoint_names, writing
from calib.runs.members import write_members
from calib.runs.page import PageError, begin_page_drawings, page_of, write_summaries_and_page
from calib.sampling import Posterior, save_posterior
from models.response import Forward


def write_run(
    folder: Path,
    posterior: Posterior,
    forward: Forward,
    listing: Listing,
    command: str,
    page: Callable[[Run, Recommendation | None], str] = page_of,
    executor: Executor | None = None,
    *,
    members: tuple[Member, ...] = (),
    copies: Mapping[str, Path] | None = None,
) -> tuple[Run, PageError | None]:
    """Write what came of a calibration, draws first: posterior.nc, summary.json, summary.csv, report.html, run.json.

    Parameters
    ----------
    folder : owned by this process; a recommendation in it goes into the report.
    posterior : what was found.
    forward : the model it was sampled with.
    listing : what `run.json` is to say of the run.
    command : that made it.
    page : lays out the report.
    executor : draws the pictures of the usual page while the draws are written; None to draw them after that.
    members : the models that the posterior is an average of.
    copies : their posteriors: name in the folder -> file.

    Returns
    -------
    The run, and why it has no page, if that could not be made.
    """
    copies = copies or {}
    names = (*copies, POSTERIOR, *SUMMARIES, *PAGES, *unlisted(folder, listing), *checkpoint_names(folder))
    with writing(folder, listing, names, command):
        path = folder / POSTERIOR
        if executor is not None and page is page_of:
            page = partial(page_of, drawings=begin_page_drawings(Run(folder, posterior, forward, ""), executor))
        if copies:
            write_members(folder, copies)
        save_posterior(posterior, path, None if members else forward)
        run = Run(folder, posterior, forward, sha256_of(path), members=members)
        return run, write_summaries_and_page(run, page)

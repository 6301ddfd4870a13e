"""From a posterior to a run folder (posterior.nc, summary, report, recommendation), and from such a folder back."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from hashlib import sha256
from pathlib import Path

import numpy as np

from calib import report
from calib.checks import Member, Prediction, Reason, Verdict, judge_posterior, predict
from calib.decision import (
    NextInShort,
    Recommendation,
    Requirement,
    next_from_json,
    next_measurements,
    recommend_for,
    recommendation_from_json,
    recommendation_to_json,
)
from calib.errors import Fault, InputError, in_shell_path
from calib.experiment import Specification, forward_of_experiment
from calib.files import sha256_of, whole_file, write_text
from calib.runs.listing import (
    LISTING,
    NEXT,
    PAGES,
    POSTERIOR,
    PRINTED,
    RECOMMENDATION,
    REPORT,
    RESULTS,
    SPECIFICATION,
    SUMMARIES,
    Listing,
    checkpoint_names,
    inputs_of,
    read_listing,
    writing,
)
from calib.runs.members import SURROGATE_FILE, changed_forwards, forward_of, load_members, write_members
from calib.runs.ownership import owned
from calib.sampling import FINGERPRINT, Posterior, load_posterior, save_posterior
from models.response import Forward

_FORWARD = "forward model"
# With more unknowns what to measure next is not worked out for the page.
_MOST_UNKNOWNS = 40
_RESUME = "`calib calibrate EXPERIMENT -o RUN --resume`"


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


@dataclass(frozen=True, eq=False)
class Run:
    """A finished calibration in its folder.

    Attributes
    ----------
    folder : where it is.
    posterior : what was found.
    forward : the model to predict with, the one that the posterior was sampled with; of an average what refuses in its place.
    posterior_sha256 : hash of the posterior's file.
    another_forward : in words that the posterior was sampled with another model than is here now; empty if not.
    changed_inputs : in words which files the run was made from have changed since.
    members : the models that the posterior is an average of; none if it is of one model.
    gone : in words which files of the run are not there any more, though nothing rests on them.
    """

    folder: Path
    posterior: Posterior
    forward: Forward
    posterior_sha256: str
    another_forward: str = ""
    changed_inputs: tuple[str, ...] = ()
    members: tuple[Member, ...] = ()
    gone: tuple[str, ...] = ()

    @property
    def report(self) -> Path:
        """Path of the report's page."""
        return self.folder / REPORT

    @property
    def printed(self) -> Path:
        """Path of the print of that page, if there is one."""
        return self.folder / PRINTED

    @cached_property
    def predictions(self) -> tuple[Prediction, ...]:
        """What the posterior predicts for its sweeps, always the same."""
        return predict(self.posterior, self.forward, np.random.default_rng(self.posterior.seed), members=self.members)

    @cached_property
    def verdict(self) -> Verdict:
        """Whether the numbers of the calibration may be used."""
        again = "Calibrate again, or put back what has changed"
        more = [Reason("inputs", "amber", note.rstrip("."), again) for note in self.notes]
        return judge_posterior(self.posterior, self.predictions, more)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is no longer as it was when the run was made, in words."""
        return (*([self.another_forward] if self.another_forward else []), *self.changed_inputs)


def load_run(folder: Path | str) -> Run:
    """Load the posterior of a finished run and the forward model that it was sampled with.

    Raises
    ------
    InputError
        If there is no finished run, its posterior is not the one that it wrote, or the surrogate file it was made with is gone.
    """
    folder = Path(folder)
    path = folder / POSTERIOR
    if not path.is_file():
        advice = (
            "It was stopped before its end: continue it with --resume"
            if (folder / LISTING).exists()
            else "Run `calib calibrate` first"
        )
        raise InputError(Fault("there is no finished calibration in this folder (no posterior.nc)", folder, advice=advice))
    listing = read_listing(folder)
    sha256 = sha256_of(path)
    posterior = load_posterior(path)
    if listing is not None:
        _require_own(listing, posterior, sha256, path)
    forward = forward_of(posterior)
    members = load_members(folder, posterior)
    changed = changed_inputs(folder, listing) if listing is not None else ()
    another = " ".join(changed_forwards(posterior, members)) or _another_forward(forward, posterior, listing)
    return Run(folder, posterior, forward, sha256, another, changed, members, _gone(folder, listing))


def _gone(folder: Path, listing: Listing | None) -> tuple[str, ...]:
    """What a command on a finished run does without, in words."""
    if listing is None:
        return (f"{folder / LISTING} is not there: nothing tells whether the files of this run are as they were written.",)
    if RECOMMENDATION in listing.files and not (folder / RECOMMENDATION).is_file():
        return (f"{folder / RECOMMENDATION} is not there any more: make it again with `calib recommend`.",)
    return ()


def changed_inputs(folder: Path, listing: Listing) -> tuple[str, ...]:
    """Say which files a run was made from are no longer what they were; not those that are gone.

    Parameters
    ----------
    folder : of the run.
    listing : what `run.json` says.
    """
    there = [(entry, entry.found(folder)) for entry in listing.inputs]
    return tuple(
        f"The {entry.what} {path.name} has changed since this calibration, which is of what it was before."
        for entry, path in there
        if path is not None and sha256_of(path) != entry.sha256
    )


def load_recommendation(folder: Path) -> Recommendation | None:
    """Load the recommendation that was last made in a run folder; None if none was.

    Raises
    ------
    InputError
        If the file is not as it was written, or is of another run.
    """
    path = folder / RECOMMENDATION
    if not path.is_file():
        return None
    listing = read_listing(folder)
    # Bytes, as what was changed need not be text any more.
    text = path.read_bytes().decode("utf-8", errors="replace")
    return recommendation_from_json(text, path, None if listing is None else listing.fingerprint)


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
            kept = next_from_json(text, path, run.posterior_sha256)
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
            page = partial(page_of, drawings=_begin_drawing(Run(folder, posterior, forward, ""), executor))
        if copies:
            write_members(folder, copies)
        save_posterior(posterior, path, None if members else forward)
        run = Run(folder, posterior, forward, sha256_of(path), members=members)
        return run, _write_rest(run, page)


def _begin_drawing(run: Run, executor: Executor) -> Mapping[str, Callable[[], str]] | None:
    """Let workers draw the pictures of a run's page; None if that fails, as it will where the page is made, which tells."""
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
            failure = _write_rest(run, page_of)
            if failure is None and browser is not None:
                failure = _print(run, browser)
    if failure is not None:
        raise failure


def _print(run: Run, browser: Path) -> PageError | None:
    """Print the page of a run; why not, if that fails."""
    try:
        with whole_file(run.printed) as whole:
            report.print_page(browser, run.report, whole)
        return None
    except report.PrintError as error:
        return PageError(run.folder, str(error), PRINTED)


def require_own_forward(run: Run) -> None:
    """Refuse to predict from a run whose posterior was sampled with another model than is here now.

    Raises
    ------
    InputError
        If that is so.
    """
    if run.another_forward:
        advice = "Calibrate again, or put the surrogate back that it was calibrated with"
        raise InputError(Fault(run.another_forward.rstrip("."), run.folder / POSTERIOR, advice=advice))


def fast_forward(run: Run) -> Forward:
    """The forward model of a run; the surrogate in the place of the finite elements, which would take hours.

    Raises
    ------
    InputError
        If no surrogate could stand in for the finite elements.
    """
    experiment = run.posterior.experiment
    if experiment.model != "fem" or run.members:
        return run.forward
    if experiment.family is None:
        advice = "Train a surrogate of its family (`calib surrogate train --family`)"
        raise InputError(Fault("there is no surrogate that could stand in for the finite elements here", advice=advice))
    return forward_of_experiment(replace(experiment, model="surrogate"))


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
        posterior_sha256=run.posterior_sha256,
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


@contextmanager
def owned_run(run: Run, command: str) -> Iterator[Listing]:
    """Own the folder of a run that was loaded, if its posterior still is that; gives what its `run.json` says, or is to say.

    Parameters
    ----------
    run : as loaded.
    command : what owns it, to be told to others.

    Raises
    ------
    InputError
        If another process owns it, or has written another posterior.
    """
    with owned(run.folder, command):
        path = run.folder / POSTERIOR
        if not path.is_file() or sha256_of(path) != run.posterior_sha256:
            raise InputError(Fault("the posterior was written anew while it was read", path, advice="Run the command again"))
        yield read_listing(run.folder) or _listing_of(run)


def _listing_of(run: Run) -> Listing:
    """What `run.json` says of a run that has none: as much as its posterior knows."""
    posterior = run.posterior
    file = posterior.attrs.get(SURROGATE_FILE)
    attrs = {name: posterior.attrs[name] for name in ("command", SURROGATE_FILE) if name in posterior.attrs}
    inputs = inputs_of(run.folder, posterior.experiment, posterior.sweeps, Path(file) if file else None)
    return Listing(posterior.seed, attrs, {}, posterior.attrs.get(FINGERPRINT, ""), inputs, {}, "")


def unlisted(folder: Path, listing: Listing) -> list[str]:
    """Results that a command which was killed has written, but not listed any more; what reads them checks them.

    Parameters
    ----------
    folder : of the run.
    listing : what its `run.json` says.
    """
    return [name for name in RESULTS if name not in listing.files and (folder / name).is_file()]


def _write_rest(run: Run, page: Callable[[Run, Recommendation | None], str]) -> PageError | None:
    """Write what follows from a posterior: the summaries, and the page if that can be made."""
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


def _require_own(listing: Listing, posterior: Posterior, sha256: str, path: Path) -> None:
    """Refuse a posterior that is not the one that its run wrote."""
    listed = listing.files.get(POSTERIOR)
    advice = f"Put back the one that was here, or let {_RESUME} write it anew from its checkpoint"
    if listed is not None and listed != sha256:
        raise InputError(Fault("this posterior is not the one that the run wrote", path, advice=advice))
    found = posterior.attrs.get(FINGERPRINT, "")
    if listed is None and found != listing.fingerprint:
        raise InputError(Fault("this posterior is of another run", path, advice=advice))


def _another_forward(forward: Forward, posterior: Posterior, listing: Listing | None) -> str:
    if forward.name != posterior.forward_name:
        return f"calibrated with the {posterior.forward_name}, predicting with the {forward.name}."
    known = "" if listing is None else listing.identity.get(_FORWARD, "")
    if known and known != f"{forward.name}, {forward.identity}":
        return f"The {forward.name} is no longer the one that this run was calibrated with: its numbers have changed."
    return ""

"""A run folder in, the finished run in it out, with what is no longer as it was when the run was made."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from calib.checks import Member, Prediction, Reason, Verdict, judge_posterior, predict
from calib.decision import Recommendation, recommendation_from_json
from calib.errors import Fault, InputError
from calib.experiment import forward_of_experiment
from calib.files import sha256_of
from calib.runs.listing import (
    EXPERIMENT,
    LISTING,
    POSTERIOR,
    PRINTED,
    RECOMMENDATION,
    REPORT,
    RESULTS,
    Listing,
    inputs_of,
    read_listing,
)
from calib.runs.members import SURROGATE_FILE, changed_forwards, forward_of, load_members
from calib.runs.ownership import owned
from calib.sampling import FINGERPRINT, Posterior, load_posterior
from models.response import Forward

_FORWARD = "forward model"
_RESUME = "`calib calibrate EXPERIMENT -o RUN --resume`"


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
    gone : in words which files of the run, or that it was made from, are not there any more, though nothing rests on them.
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
        advice = "Run `calib calibrate` first"
        if (folder / LISTING).exists():
            advice = "It was stopped before its end: continue it with --resume"
        elif folder.name == "average":
            advice = "`calib compare EXPERIMENT -o FOLDER` makes FOLDER/average as the last thing, of the models that are left"
        elif not folder.exists():
            advice = f"There is no folder {folder}: give the one that `calib calibrate` has written"
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
    notes = []
    if RECOMMENDATION in listing.files and not (folder / RECOMMENDATION).is_file():
        notes.append(f"{folder / RECOMMENDATION} is not there any more: make it again with `calib recommend`.")
    if missing := [Path(entry.file).name for entry in listing.inputs if entry.found(folder) is None]:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        notes.append(
            f"Of the files that this calibration was made from {missing[0]}{more} cannot be found: whether they are still what "
            "they were is not known. The numbers are of what they were."
        )
    return tuple(notes)


def changed_inputs(folder: Path, listing: Listing, expected: Collection[str] = ()) -> tuple[str, ...]:
    """Say which files a run was made from are no longer what they were; not those that are gone.

    Parameters
    ----------
    folder : of the run.
    listing : what `run.json` says.
    expected : hashes that an experiment file may have by now: of other runs, which it was edited for.
    """
    found = []
    for entry in listing.inputs:
        path = entry.found(folder)
        now = entry.sha256 if path is None else sha256_of(path)
        if path is not None and now != entry.sha256 and not (entry.what == "experiment" and now in expected):
            kept = f" ({EXPERIMENT} in its folder)" if entry.what == "experiment" and (folder / EXPERIMENT).is_file() else ""
            found.append(
                f"The {entry.what} {path.name} has changed since this calibration, which is of what it was before{kept}."
            )
    return tuple(found)


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

"""A run folder in, its `run.json` out, and back: what the run is of, which files it was made from and which it has written.

`run.json` is there from a run's first second on. The hash of a file that is written anew is taken out of it before and put in
after, so that at every moment it holds the hashes of files that are complete, and says which command has not ended.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from calib.errors import Fault, InputError
from calib.experiment import Experiment
from calib.files import sha256_of, write_text
from calib.lab import Sweep
from calib.provenance import PROGRAM, version_of
from calib.records import exact_record_from_text, record_to_text
from calib.visible import visible

#: The file's name.
LISTING = "run.json"

#: The experiment file, to the byte, as it was calibrated: the one that it was read from goes on being edited.
EXPERIMENT = "as_calibrated.toml"
#: What commands write into a run folder, beside checkpoints.
POSTERIOR, RECOMMENDATION, REPORT = "posterior.nc", "recommendation.json", "report.html"
SPECIFICATION, NEXT = "specification.csv", "next.json"
SUMMARIES = ("summary.json", "summary.csv")
#: The report, and its print if that was asked for.
PRINTED = "report.pdf"
PAGES = (REPORT, PRINTED)
#: What `calib certificate` writes: the certificate, its page, PTB's XML, the RO-Crate, and the signature.
CERTIFICATE, PAGE_OF_IT, DCC = "certificate.json", "certificate.html", "certificate.xml"
CRATE, SIGNATURE = "ro-crate-metadata.json", "certificate.json.minisig"
CERTIFICATES = (PAGE_OF_IT, DCC, CRATE, CERTIFICATE, SIGNATURE)
RESULTS = (EXPERIMENT, POSTERIOR, *SUMMARIES, RECOMMENDATION, SPECIFICATION, *PAGES, NEXT, *CERTIFICATES)
CHECKPOINT = "checkpoint"
#: Folder in that of an average, with the posteriors of its models.
MEMBERS = "members"

#: The text of a run that is the number of the certificate issued last, which is of its hour and of all versions, too.
CERTIFIED = "certificate"

_KIND, _FORMAT = "run", 2


@dataclass(frozen=True)
class Input:
    """A file that a run was made from: what it is, where it was, and where as seen from the run's folder; and its SHA-256."""

    what: str
    file: str
    from_run: str
    sha256: str

    def found(self, folder: Path) -> Path | None:
        """Where it is now, for the run in a folder: both may have moved together; None if it is at neither place."""
        for path in (folder / self.from_run, Path(self.file)):
            if path.is_file():
                return path
        return None


@dataclass(frozen=True)
class Command:
    """A command that wrote into a run: as it was given, when it began to write [UTC, ISO 8601], and of which version it was."""

    text: str
    at: str
    version: str


@dataclass(frozen=True)
class Listing:
    """What `run.json` says.

    Attributes
    ----------
    seed : of the run.
    attrs : texts that belong to it: the command that began it, the surrogate file if it is not the shipped one, the number of
        its certificate.
    identity : what its draws depend on, see `calib.sampling.Identity`.
    fingerprint : of that.
    inputs : the files it was made from.
    files : name in the folder -> SHA-256, of all that is complete.
    unfinished : the command that is writing, or was ended while it was; empty if the last one came to its end.
    commands : all that wrote into it, in their order; one that was given several times in a row stands there once.
    """

    seed: int
    attrs: Mapping[str, str]
    identity: Mapping[str, str]
    fingerprint: str
    inputs: tuple[Input, ...]
    files: Mapping[str, str]
    unfinished: str
    commands: tuple[Command, ...] = ()


def with_command(listing: Listing, text: str) -> Listing:
    """A listing that knows of one more command that writes now.

    Parameters
    ----------
    listing : what `run.json` says.
    text : of the command, as it was given.
    """
    now = Command(visible(text), datetime.now(UTC).isoformat(timespec="seconds"), version_of(PROGRAM))
    known = listing.commands
    return replace(listing, commands=(*(known[:-1] if known and known[-1].text == now.text else known), now))


def read_listing(folder: Path) -> Listing | None:
    """Read the `run.json` of a folder; None if there is none.

    Raises
    ------
    InputError
        If it is not, to the last byte, what this version of the program wrote.
    """
    path = folder / LISTING
    try:
        record = exact_record_from_text(_KIND, _FORMAT, path.read_text(encoding="utf-8"))
        inputs = tuple(Input(**entry) for entry in record.pop("inputs"))
        # Folders of before commands were kept have none.
        commands = tuple(Command(**entry) for entry in record.pop("commands", ()))
        return Listing(inputs=inputs, commands=commands, **record)
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError) as error:
        advice = (
            "`calib calibrate EXPERIMENT -o RUN --resume` mends it; if you trust the other files of this folder as they are, "
            "delete it and run `calib report RUN`"
        )
        raise InputError(
            Fault(f"this list of what the run has written cannot be trusted ({error})", path, advice=advice)
        ) from None


def write_listing(folder: Path, listing: Listing) -> None:
    """Write `run.json`.

    Parameters
    ----------
    folder : of the run, owned by this process.
    listing : what it is to say.
    """
    write_text(folder / LISTING, record_to_text(_KIND, _FORMAT, asdict(listing)))


@contextmanager
def writing(folder: Path, listing: Listing, names: Sequence[str], command: str) -> Iterator[None]:
    """Write files of a run anew inside a `with` block, with their new hashes in `run.json` once all of them are complete.

    Parameters
    ----------
    folder : of the run, owned by this process.
    listing : what `run.json` says, or is to say of the run.
    names : of the files, in the folder; those that are not there in the end are not listed.
    command : that writes them, to be told if it does not come to its end.
    """
    listing = with_command(listing, command)
    others = {name: digest for name, digest in listing.files.items() if name not in names}
    write_listing(folder, replace(listing, files=others, unfinished=command))
    yield
    new = {name: sha256_of(folder / name) for name in names if (folder / name).is_file()}
    write_listing(folder, replace(listing, files=others | new, unfinished=""))


def checkpoint_names(folder: Path) -> list[str]:
    """Names in a run folder of the files of its checkpoint."""
    return [f"{CHECKPOINT}/{path.name}" for path in sorted((folder / CHECKPOINT).glob("[!.]*"))]


def inputs_of(folder: Path, experiment: Experiment, sweeps: Sequence[Sweep], surrogate: Path | None) -> tuple[Input, ...]:
    """List the files that a run is made from, with the hashes of what was read of them.

    Parameters
    ----------
    folder : of the run.
    experiment : its file and its lab files.
    sweeps : what was read of the lab files, in the order of the experiment.
    surrogate : file of the surrogate, if it is not the shipped one.
    """
    found: dict[Path, tuple[str, str]] = {}
    if experiment.path is not None:
        found[experiment.path] = ("experiment", experiment.sha256)
    files = [entry for specimen in experiment.specimens for entry in specimen.sweeps]
    for entry, sweep in zip(files, sweeps, strict=True):
        digests = dict(sweep.files)
        paths = [path for path in (entry.force, entry.capacitance) if path is not None]
        for path in paths:
            # Two files of one name in two folders share an entry there.
            alone = all(other == path or other.name != path.name for other in paths)
            digest = digests.get(path.name, "") if alone else sha256_of(path)
            if digest:
                found[path] = ("lab file", digest)
    if surrogate is not None:
        found[surrogate] = ("surrogate", sha256_of(surrogate))
    return tuple(Input(what, str(path), seen_from(folder, path), digest) for path, (what, digest) in found.items())


def seen_from(folder: Path, path: Path) -> str:
    """Where a file is as seen from a folder, which may move together with it.

    Parameters
    ----------
    folder : from which it is looked for.
    path : of the file.
    """
    try:
        return os.path.relpath(path, folder)
    except ValueError:  # another drive
        return str(path)

"""What a calibration that is under way tells of itself in, a hidden file of its run folder out, and back: how far a run is.

A page or another program looks there; nothing of a run rests on it. The file is gone when its calibration has ended; where that
was killed it stays until another one goes on.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Literal

from calib.errors import InputError
from calib.files import write_text
from calib.records import record_from_text, record_to_text
from calib.report import first_rows
from calib.runs.listing import CHECKPOINT, LISTING, POSTERIOR, read_listing
from calib.runs.ownership import owner_of
from calib.sampling import BLOCK_STEPS, FirstAnswer, Progress, kept_blocks

#: Name of the file, which is no result of a run.
PROGRESS = ".progress.json"
# Its kind and format.
_RECORD = "progress", 1


@dataclass(frozen=True)
class ConvergenceLook:
    """What one look at convergence found: steps of each walker, the largest R-hat, the least effective sample size."""

    steps: int
    r_hat: float
    ess: float


@dataclass(frozen=True)
class LastProgress:
    """What a calibration last told of how far it is.

    Attributes
    ----------
    stage : one of `calib.runs.STAGES`.
    done, wanted : of the start its pieces of work, of sampling steps of each walker, as far as is known; 0 for no number.
    seconds_left : that sampling will take, None as long as nothing tells [s].
    r_hat_parameter, ess_parameter : whose R-hat is the largest, whose effective sample size the least, at the last look.
    target : effective sample size wanted.
    looks : at convergence so far, one after the other.
    first : of the first answer, which is not the result: label, value with its uncertainty, unit.
    """

    stage: str
    done: int = 0
    wanted: int = 0
    seconds_left: float | None = None
    r_hat_parameter: str = ""
    ess_parameter: str = ""
    target: float = 0.0
    looks: tuple[ConvergenceLook, ...] = ()
    first: tuple[tuple[str, str, str], ...] = ()


#: What may be with a run: nothing was begun, a process works on it, it was ended before its end, it is finished.
Condition = Literal["none", "running", "stopped", "finished"]


@dataclass(frozen=True)
class RunState:
    """How far the run in a folder is.

    Attributes
    ----------
    condition : whether it is under way.
    owner : the process that works on it, in words; "" for none.
    steps : of each walker that are kept, so that they are not made again.
    last : what its calibration last told; None if it tells nothing any more.
    command : by which it was begun; "" where that is not known.
    experiment : the file that it is of, where that is now; None if it is not there any more, or was never a file.
    """

    condition: Condition
    owner: str = ""
    steps: int = 0
    last: LastProgress | None = None
    command: str = ""
    experiment: Path | None = None


def run_state(folder: Path | str) -> RunState:
    """Say how far the run in a folder is; needs no permission to write, and may be asked while another process writes.

    Parameters
    ----------
    folder : that `calib calibrate` was given; it need not exist yet.
    """
    folder = Path(folder)
    owner = owner_of(folder)
    command, whole, experiment = "", False, None
    with suppress(InputError):
        listing = read_listing(folder)
        if listing is not None:
            command, whole = listing.attrs.get("command", ""), not listing.unfinished
            experiment = next((one.found(folder) for one in listing.inputs if one.what == "experiment"), None)
    begun = (folder / LISTING).exists() or (folder / CHECKPOINT).is_dir()
    finished = whole and (folder / POSTERIOR).is_file()
    condition: Condition = "running" if owner else "finished" if finished else "stopped" if begun else "none"
    return RunState(condition, owner, BLOCK_STEPS * kept_blocks(folder / CHECKPOINT), _read(folder), command, experiment)


def _read(folder: Path) -> LastProgress | None:
    try:
        found = record_from_text(*_RECORD, (folder / PROGRESS).read_text(encoding="utf-8"))
        looks = tuple(ConvergenceLook(**look) for look in found.pop("looks"))
        return LastProgress(looks=looks, first=tuple(map(tuple, found.pop("first"))), **found)
    except (OSError, ValueError, KeyError, TypeError):
        return None


@dataclass
class Teller:
    """Writes the file, each time that there is something new; that it cannot be written is no reason not to calibrate.

    `last`, what was written last, is the one thing that changes.
    """

    folder: Path
    last: LastProgress = field(default_factory=lambda: LastProgress("reading"))

    def stage(self, name: str) -> None:
        """Say which stage begins."""
        self._write(replace(self.last, stage=name, done=0, wanted=0, seconds_left=None))

    def first_answer(self, first: FirstAnswer | None) -> None:
        """Say the first answer, of the sensor alone."""
        rows = () if first is None else tuple((r.name, r.value, r.unit) for r in first_rows(first, sensor_only=True))
        self._write(replace(self.last, first=rows))

    def sampling(self, p: Progress) -> None:
        """Say how far sampling is."""
        looks = self.last.looks
        if p.ess > 0 and (not looks or (looks[-1].r_hat, looks[-1].ess) != (p.r_hat, p.ess)):
            looks = (*looks, ConvergenceLook(p.steps, p.r_hat, p.ess))
        left = p.seconds_left if math.isfinite(p.seconds_left) and p.seconds_left > 0 else None
        # What one part of it does not know another has told: while it starts anew, of the run that it goes on with.
        names = (p.r_hat_parameter or self.last.r_hat_parameter, p.ess_parameter or self.last.ess_parameter)
        target = p.target or self.last.target
        self._write(LastProgress(p.stage, p.done, p.wanted, left, *names, target, looks, self.last.first))

    def _write(self, new: LastProgress) -> None:
        if new != self.last:
            self.last = new
            with suppress(OSError, InputError):
                write_text(self.folder / PROGRESS, record_to_text(*_RECORD, asdict(new), indent=None, exact=True))


@contextmanager
def telling(folder: Path) -> Iterator[Teller]:
    """Tell how far a calibration is inside a `with` block, to whoever looks into its folder.

    Parameters
    ----------
    folder : of the run, owned by this process.
    """
    _forget(folder)  # what a process told that was killed
    try:
        yield Teller(folder)
    finally:
        _forget(folder)


def _forget(folder: Path) -> None:
    with suppress(OSError):
        (folder / PROGRESS).unlink(missing_ok=True)

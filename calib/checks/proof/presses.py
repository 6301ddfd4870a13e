"""An experiment and its sweeps in, how each was pressed out: what the crosshead did, and when the meter read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib.experiment import Experiment
from calib.files import real_path
from calib.lab import Observations, Reading, Sweep, observe, read_lab_file
from calib.problem import nominal_zero
from models.sensor import FloatArray


@dataclass(frozen=True, eq=False)
class Log:
    """What one instrument wrote of a press beside what it measures, row by row.

    Attributes
    ----------
    time : [s], by its own clock; None if it has none.
    displacement : [m], crosshead reading, compression positive; None if it has none.
    force : [N], load in the same record, compression positive, not zeroed; None if it has none.
    """

    time: FloatArray | None
    displacement: FloatArray | None
    force: FloatArray | None


@dataclass(frozen=True, eq=False)
class SimulatedPress:
    """How one sweep was pressed: all that a simulated lab needs to press another sensor in the same way.

    Attributes
    ----------
    specimen, name : of the specimen and the sweep.
    tester, meter : its records, None for one that there is not; the same object where both are one file.
    clock_offset : [s], clock of the tester minus clock of the meter, as estimated; nan if they are not tied by the clock.
    contact : [m], crosshead reading where contact begins, as estimated; nan where no record has a displacement.
    load : [N], load before contact, as estimated.
    """

    specimen: str
    name: str
    tester: Log | None
    meter: Log | None
    clock_offset: float
    contact: float
    load: float


def presses_of(experiment: Experiment, sweeps: Sequence[Sweep]) -> tuple[SimulatedPress, ...]:
    """Read the lab files of an experiment once more, for what their presses were like.

    Parameters
    ----------
    experiment : as read.
    sweeps : prepared from the same files.

    Raises
    ------
    InputError
        If a file cannot be read any more.
    """
    found = []
    files = ((specimen.name, files) for specimen in experiment.specimens for files in specimen.sweeps)
    for sweep, (specimen, f) in zip(sweeps, files, strict=True):
        tester = None if f.force is None else _log(f.force, f.force_reading, "force")
        same = f.force is not None and f.capacitance is not None and real_path(f.force) == real_path(f.capacitance)
        meter = tester if same else None if f.capacitance is None else _log(f.capacitance, f.capacitance_reading, "capacitance")
        contact = sweep.contact
        found.append(SimulatedPress(specimen, f.name, tester, meter, sweep.clock_offset, contact, nominal_zero(sweep)[1]))
    return tuple(found)


def _log(path: Path, reading: Reading, channel: str) -> Log:
    """The rows of a file in which all that ties them is read, those of other faults left out."""
    seen = observe(read_lab_file(path, reading))
    columns = {"time": seen.time, "displacement": seen.displacement, "force": seen.force}
    held = [column for column in (*columns.values(), seen.channels.get(channel)) if column is not None]
    good = np.all(np.isfinite(held), axis=0) & _forward_in_time(seen)
    return Log(**{name: None if column is None else column[good] for name, column in columns.items()})


def _forward_in_time(seen: Observations) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    if seen.time is None:
        return np.ones(len(seen.reason), dtype=bool)
    latest = np.maximum.accumulate(np.where(np.isfinite(seen.time), seen.time, -np.inf))
    return np.asarray(seen.time >= latest)

"""From the observations of a lab file to what is judged of one channel: its loading branch, with range and noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calib.catalogue import CHANNELS
from calib.lab.instruments import IntArray, rounded_rows
from calib.lab.observations import Observations
from calib.lab.onset import flat_part
from calib.lab.quality.grade import Grade, Level
from calib.lab.signal import excursion, first_crest, reading_noise, resolution
from calib.lab.stretches import stretches
from models.sensor import BoolArray, FloatArray

#: Step, as a share of the largest reading, of what is written with more digits than a step shows in.
MANY_DIGITS = 1e-9
#: Share of the readings of a branch that are rounded more coarsely than the others, from which on their step is that of all.
ROUNDED_ROWS = 0.1


@dataclass(frozen=True, eq=False)
class LoadingBranch:
    """What the checks look at: one channel on the branch that is used, arrays of shape (n_row,) in the order of pressing.

    Attributes
    ----------
    file, name, unit : name of the lab file; "force" or "capacitance"; "N" or "F".
    rows : of the file; from the last to the first on an unloading branch, so that the channel rises.
    x : displacement [m], else time [s], else number of the reading, as `x_unit` says.
    y : readings [unit], turned so that they rise in contact (by `sign`).
    flat : rows before contact.
    span : range of y without single spikes.
    noise : sd of one reading.
    step : of the display. All in `unit`.
    """

    file: str
    name: str
    unit: str
    rows: IntArray
    x: FloatArray
    x_unit: str
    y: FloatArray
    sign: float
    flat: BoolArray
    span: float
    noise: float
    step: float

    @property
    def touch(self) -> float:
        """Where the flat part ends, or the branch begins if there is none. In `x_unit`."""
        return float(np.max(self.x[self.flat]) if np.any(self.flat) else self.x[0])

    @property
    def zero(self) -> float:
        """Level before contact, or the first reading if there is no flat part. In `unit`, of `y`."""
        return float(np.median(self.y[self.flat]) if np.any(self.flat) else self.y[0])

    def grade(self, check: str, level: Level, number: float, unit: str, finding: str, advice: str) -> Grade:
        """Say what a check found in this channel.

        Parameters
        ----------
        check, level, number, unit, finding : as in `Grade`.
        advice : left out of a grade that is good.
        """
        return Grade(check, level, float(number), unit, finding, "" if level == "good" else advice, self.name, self.file)

    def text(self, value: float) -> str:
        """Write a value of the channel for people, in N or pF."""
        row = CHANNELS[self.name]
        return f"{value:.3g} N" if self.name == "force" else f"{value * row.display_scale:.4g} {row.display_unit}".rstrip()


def loading_branch(obs: Observations, name: str) -> LoadingBranch | None:
    """Take the part of a file that is judged: one channel on its (first) branch, with flat part, range, noise and resolution.

    Parameters
    ----------
    obs : one lab file.
    name : "force" or "capacitance".

    Returns
    -------
    None if the file has no such channel, or fewer than five readings of it on the loading branch.
    """
    if name not in obs.channels:
        return None
    values = channel_values(obs, name)
    clock = np.arange(len(obs.used), dtype=float) if obs.time is None else obs.time
    x_all = clock if obs.displacement is None else obs.displacement
    x_unit = "m" if obs.displacement is not None else "s" if obs.time is not None else "readings"
    rows = np.flatnonzero(obs.used & np.isfinite(x_all) & np.isfinite(values))
    if obs.used_cycles:
        rows = rows[obs.cycle[rows] == obs.used_cycles[0]]
    if obs.use.branch == "unloading":
        rows = rows[::-1]
    if rows.size < 5:
        return None
    if obs.displacement is None and obs.force is None:
        rows = rows[: first_crest(values[rows])]
    y = values[rows]
    away = excursion(y)
    sign = 1.0 if float(away[np.argmax(np.abs(away))]) >= 0 else -1.0
    y = sign * y
    x = x_all[rows]
    written = obs.table.written.get(name, values)[rows]
    span = float(np.max(sign * away) - min(0.0, float(np.min(sign * away))))
    # In the unit of the file, where the last digit is seen, and of the series capacitance where that is what was read.
    shown = np.isfinite(written) & (written != 0) & np.isfinite(values[rows])
    factor = float(np.median(np.abs(values[rows][shown] / written[shown]))) if np.any(shown) else 1.0
    step = resolution(written) * factor or MANY_DIGITS * float(np.max(np.abs(y)))
    for part in rounded_rows(obs.table.written.get(name, values)):
        # A display or an export that changed within the record.
        if np.mean((rows >= part.first) & (rows < part.behind)) > ROUNDED_ROWS:
            step = max(step, part.step * factor)
    return LoadingBranch(
        file=obs.table.path.name,
        name=name,
        unit=CHANNELS[name].unit,
        rows=rows,
        x=x,
        x_unit=x_unit,
        y=y,
        sign=sign,
        flat=flat_part(x, y),
        span=span,
        noise=reading_noise(y),
        step=step,
    )


def channel_values(obs: Observations, name: str) -> FloatArray:
    """Look up the readings of a channel that the file has.

    Parameters
    ----------
    obs : one lab file.
    name : "force" or "capacitance".

    Returns
    -------
    [N] or [F], (n_row,).
    """
    return obs.channels[name]


def longest_run(mask: BoolArray) -> tuple[int, int]:
    """Find the longest run of True in a mask, as begin and end; equal where there is none."""
    return max(stretches(mask), key=lambda stretch: stretch[1] - stretch[0], default=(0, 0))

"""From the readings of a record to the blocks of rows in which one channel is off by an offset that begins and ends at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from calib.lab.instruments.explained import beside
from calib.lab.instruments.growing_noise import growing_noise
from calib.lab.instruments.spikes import last_step, noise_of
from models.sensor import FloatArray

# Channels of which a block is found, each beside those that would show what moves it.
_BESIDE: Mapping[str, tuple[str, ...]] = {
    "force": ("displacement", "capacitance", "capacitance_series"),
    "displacement": ("force", "capacitance", "capacitance_series"),
}
# A step begins or ends a block if it is so many noises, last digits, usual steps and such a share of the range, and off by as
# many but the usual steps.
_NOISES, _DIGITS, _STEPS, _SHARE = 12.0, 4.0, 2.5, 0.03
# Noise may grow with the reading: it is off by so many times what readings as large scatter.
_AS_LARGE = 8.0
# Where so many steps are as large, or of so many blocks, that is what the record is like.
_LARGE, _MOST = 0.1, 3
# Two steps undo each other that differ by such a share, or by what they may be off, but never by more than the larger share.
_ALIKE, _AT_MOST = 0.1, 0.25
# A block is a smaller share of the rows; fewer rows show nothing.
_OF_ROWS, _FEWEST = 1 / 3, 12
# A step is one of several if one beside it is off by such a share of what it is.
_AS_FAR = 0.5
# The ball turns within a block if it goes beyond its ends by such a share of its range, and so many noises.
_TURNS, _TURN_NOISES = 0.02, 6.0


def offset_blocks(values: Mapping[str, FloatArray]) -> dict[str, list[tuple[int, int, int]]]:
    """Find the blocks of rows in which a load or a place is off by one offset, as two steps show that undo each other.

    Neither is shown by the channel beside it, which goes on over both at the slope that the rows beside have. A snap and the
    pull-off have a turn of the ball between them; a slip does not come back at once and by as much.

    Parameters
    ----------
    values : quantity -> readings, nan where there is none or none that is used, (n_row,).

    Returns
    -------
    Quantity -> of each block the last row before it, its first row, and the first row behind it.
    """
    found: dict[str, list[tuple[int, int, int]]] = {}
    for quantity, others in _BESIDE.items():
        witnesses = [values[q] for q in others if q in values]
        if quantity in values and witnesses:
            blocks = _blocks(values[quantity], witnesses)
            if 0 < len(blocks) <= _MOST:
                found[quantity] = blocks
    return found


def _blocks(values: FloatArray, witnesses: Sequence[FloatArray]) -> list[tuple[int, int, int]]:
    rows = np.flatnonzero(np.all(np.isfinite([values, *witnesses]), axis=0))
    if rows.size < _FEWEST:
        return []
    y, others = values[rows], [v[rows] for v in witnesses]
    steps = np.abs(np.diff(y))
    noise = noise_of(y)
    least = max(_NOISES * noise, _DIGITS * last_step(y), _SHARE * float(np.ptp(y)))
    at = np.flatnonzero(steps > max(least, _STEPS * float(np.median(steps))))
    if not 1 < at.size <= max(2, _LARGE * rows.size):
        return []
    held = [beside(y, other, at, noise, noise_of(other)) for other in others]
    largest = np.maximum(least, _AS_LARGE * np.max(growing_noise(y, np.stack([y[at], y[at + 1]])), axis=0))
    odd = np.isfinite(held[0].off) & (np.abs(held[0].off) > largest) & ~np.any([h.explained for h in held], axis=0)
    if np.count_nonzero(odd) > 2 * _MOST:
        return []
    # On a slope that the ball does not make, such as those of a sticky sample's neck, the steps beside are off as well.
    several = np.zeros(at.size, dtype=bool)
    for step in (np.maximum(at - 1, 0), np.minimum(at + 1, steps.size - 1)):
        near = beside(y, others[0], step, noise, noise_of(others[0])).off
        several |= near * np.sign(held[0].off) > _AS_FAR * np.abs(held[0].off)
    at, off, room, several = at[odd], held[0].off[odd], held[0].room[odd], several[odd]
    found: list[tuple[int, int, int]] = []
    last = -1
    for a, b in pairwise(range(at.size)):
        larger = max(abs(off[a]), abs(off[b]))
        alike = abs(off[a] + off[b]) <= min(max(_ALIKE * larger, room[a] + room[b]), _AT_MOST * larger)
        i, k = int(at[a]), int(at[b])
        alike &= not (several[a] and several[b])
        if a > last and alike and k - i < _OF_ROWS * rows.size and not _turns(others[0][i : k + 2], others[0]):
            found.append((int(rows[i]), int(rows[i + 1]), int(rows[k + 1])))
            last = b
    return found


def _turns(part: FloatArray, whole: FloatArray) -> bool:
    """Whether a channel goes beyond the ends of a part of it."""
    beyond = max(min(part[0], part[-1]) - np.min(part), np.max(part) - max(part[0], part[-1]))
    return bool(beyond > max(_TURNS * float(np.ptp(whole)), _TURN_NOISES * noise_of(whole)))

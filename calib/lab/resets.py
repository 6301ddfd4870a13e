"""From the displacement of a record to where its zero was set anew in the middle of it, which no crosshead can move like."""

from __future__ import annotations

import numpy as np

from calib.lab.instruments import IntArray
from calib.lab.shape import calm
from calib.lab.signal import reading_noise
from models.sensor import BoolArray, FloatArray

# A step counts as a jump from so many times its neighbours on, if it is such a share of the range, too.
_STEPS, _SHARE = 10.0, 0.02
# Neighbours that are looked at on either side.
_NEAR = 5
# Change of force over its noise within which it goes on as before.
_NOISE = 6.0


def resets_of(x: FloatArray | None, force: FloatArray | None, time: FloatArray | None, good: BoolArray) -> IntArray:
    """Find the rows of a file from which on its displacement has another zero.

    Parameters
    ----------
    x, force, time : columns of the file, (n_row,), nan where there is no reading; None for what it does not have.
    good : rows that can be used.

    Returns
    -------
    Row numbers; none usually.
    """
    if x is None:
        return np.zeros(0, dtype=np.int64)
    beside = [c for c in (force, time) if c is not None]
    rows = np.flatnonzero(good & np.all([np.isfinite(c) for c in (x, *beside)], axis=0))
    anew = _zero_set_anew(x[rows], *(None if c is None else c[rows] for c in (force, time)))
    return rows[anew]


def without_jumps(x: FloatArray, anew: IntArray) -> FloatArray:
    """Give the displacement as it would read with one zero throughout, to see how the crosshead moved.

    Parameters
    ----------
    x : displacement, (n_row,).
    anew : rows from which on it has another zero.

    Returns
    -------
    (n_row,), in the unit of x.
    """
    moved = x.copy()
    for row in anew.tolist():
        before = x[:row][np.isfinite(x[:row])]
        moved[row:] -= x[row] - before[-1]
    return moved


def of_another_zero(chosen: BoolArray, anew: IntArray, driver: FloatArray | None) -> BoolArray:
    """Find the chosen rows that do not share the zero of the deepest of them.

    Parameters
    ----------
    chosen : rows, (n_row,).
    anew : rows from which on the displacement has another zero.
    driver : displacement without jumps, (n_row,), compression positive; None for a file without one.

    Returns
    -------
    (n_row,)
    """
    rows = np.flatnonzero(chosen)
    if anew.size == 0 or driver is None or rows.size == 0:
        return np.zeros(chosen.size, dtype=bool)
    part = np.searchsorted(anew, np.arange(chosen.size), side="right")
    return np.asarray(chosen & (part != part[rows[np.argmax(driver[rows])]]))


def _zero_set_anew(x: FloatArray, force: FloatArray | None, time: FloatArray | None) -> IntArray:
    """Jumps to zero within one row while force and clock go on as before: the first rows after them.

    A jump ahead out of contact is none, as rows without contact are as good there: a fast approach looks the same.
    """
    if x.size < 4 * _NEAR:
        return np.zeros(0, dtype=np.int64)
    steps = np.diff(x)
    moving = np.abs(steps[steps != 0])
    span = float(np.ptp(x))
    least = max(_SHARE * span, _STEPS * float(np.median(moving)) if moving.size else 0.0, 1e-300)
    candidates = np.flatnonzero(np.abs(steps) > least)
    if candidates.size > x.size // 20:
        return np.zeros(0, dtype=np.int64)
    return np.array([i + 1 for i in candidates.tolist() if _is_reset(int(i), x, force, time)], dtype=np.int64)


def _is_reset(i: int, x: FloatArray, force: FloatArray | None, time: FloatArray | None) -> bool:
    near = [k for k in range(max(0, i - _NEAR), min(x.size - 1, i + _NEAR + 1)) if k != i]
    step = float(x[i + 1] - x[i])
    usual = max(abs(float(x[k + 1] - x[k])) for k in near)
    before, after = x[max(0, i - _NEAR + 1) : i + 1], x[i + 1 : i + 1 + _NEAR]
    if (
        abs(step) <= _STEPS * usual
        or before.size < 2
        or after.size < 2
        or abs(float(x[i + 1])) > max(2 * usual, 0.02 * abs(step))
    ):
        return False
    if time is not None and time[i + 1] - time[i] > 3 * max(float(time[k + 1] - time[k]) for k in near):
        return False
    if force is None:
        return True
    noise = reading_noise(force)
    goes_on = max(2 * max(abs(float(force[k + 1] - force[k])) for k in near), _NOISE * noise, 0.01 * float(np.ptp(calm(force))))
    if abs(float(force[i + 1] - force[i])) > goes_on:
        return False
    later = x[i + 1 : i + 1 + max(20, x.size // 20)]
    ahead = float(later[np.argmax(np.abs(later - x[i + 1]))] - x[i + 1]) * step > 0
    level = float(np.median(force[: max(_NEAR, i // 4)]))
    touches = abs(float(np.median(force[max(0, i - _NEAR) : i + 1])) - level) > max(
        3 * noise, 0.01 * float(np.ptp(calm(force)))
    )
    return touches or not ahead

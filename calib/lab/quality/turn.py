"""From a channel over the displacement to whether both turn in the same row: a column that was pasted off does not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calib.lab.instruments import IntArray
from calib.lab.observations import Observations
from calib.lab.quality.grade import Grade
from calib.lab.quality.loading import LoadingBranch, channel_values
from models.sensor import FloatArray

#: Rows on either side of a turn through which the displacement is a line, and the channel a parabola.
LINE, PARABOLA = 5, 6
#: The turns are known if their places [rows] have no larger sd.
TURN_OF_PLACE, TURN_OF_CHANNEL = 0.1, 0.15
#: A channel turns rows behind the displacement, or before it, from and up to so many rows apart. A load cell's filter makes
#: it late by up to half a row; nothing makes it early.
LATE, EARLY, MOST = 0.75, 0.6, 5.6
#: The crest of the channel is looked for so many rows beside the turn.
NEAR = 7
#: A row that is on the wrong branch is off the right one by this share of what a row of shift makes, and this many sd.
ON_BRANCH, SURE = 0.5, 4.0
#: A row tells the branches apart if a shift by one row moves it by this share of a step, or more.
TELLS = 0.3


@dataclass(frozen=True, eq=False)
class _Course:
    """A polynomial through some rows: its coefficients about the row `about`, lowest first, and their covariance."""

    about: int
    coefficients: FloatArray
    covariance: FloatArray

    def at(self, row: float) -> tuple[float, float]:
        """Value and variance at a row."""
        powers = (row - self.about) ** np.arange(self.coefficients.size)
        return float(powers @ self.coefficients), float(powers @ self.covariance @ powers)

    def slope(self, row: float) -> float:
        """Change from row to row."""
        return float(np.polyval(np.polyder(self.coefficients[::-1]), row - self.about))


def check_turn(obs: Observations, c: LoadingBranch) -> Grade | None:
    """Does the channel turn in the row in which the displacement does?

    Where the ball turns, displacement and channel have a kink. Either is found between the rows, where what goes before and
    what goes behind meet. A material that relaxes, creeps or loses energy has its kink at the turn, too; a column that was
    pasted some rows off, or a channel that is read late, has it as many rows beside.

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.

    Returns
    -------
    None if they turn together, and where a turn is too round, too noisy, or held, to tell; bad where the column lacks as many
    readings at its end, as one that was pasted off does.
    """
    if obs.displacement is None or obs.use.branch == "unloading":
        return None
    rows = np.flatnonzero(np.isfinite(obs.displacement) & np.isfinite(channel_values(obs, c.name)))
    end = int(np.searchsorted(rows, np.flatnonzero(obs.loading)[-1])) if np.any(obs.loading) else 0
    near = slice(max(end - 4 * PARABOLA, 0), end + 4 * PARABOLA)
    if np.any(np.diff(rows[near]) > 1):
        return None  # rows that are left out beside a turn move what is seen of it
    x, y = obs.displacement[rows][near], c.sign * channel_values(obs, c.name)[rows][near]
    late = rows_late(x, y)
    if late is None or not (LATE <= late <= MOST or -MOST <= late <= -EARLY):
        return None
    way = "behind" if late > 0 else "before"
    line = int(obs.table.lines[rows[end]])
    finding = f"{c.name} turns {abs(late):.1f} rows {way} the displacement, near line {line}"
    advice = (
        "One of the two columns may have been pasted some rows off: compare them with the instrument's own record. If the "
        "channel is read late, press slower or log faster."
    )
    if short := _as_many_empty(obs, c.name, late):
        return c.grade("rows apart", "bad", late, "rows", f"{finding}, and {short}", advice)
    return c.grade("rows apart", "warning", late, "rows", finding, advice)


def _as_many_empty(obs: Observations, name: str, late: float) -> str:
    """Words for a column that lacks as many readings at its end as it turns early, or at its beginning as it is late; or ""."""
    rows = np.flatnonzero(np.isfinite(channel_values(obs, name)))
    outside = np.arange(rows[0]) if late > 0 else np.arange(rows[-1] + 1, len(obs.table.lines))
    # A row that lacks its only channel is left out with its displacement.
    lacking = np.isfinite(obs.table.columns["displacement"][outside])
    empty = [there or obs.table.reasons[row] == f"empty cell: {name}" for row, there in zip(outside, lacking, strict=True)]
    if not all(empty) or len(empty) != round(abs(late)):
        return ""
    return f"its {'first' if late > 0 else 'last'} {len(empty)} cells are empty: it stands that many rows off"


def rows_late(x: FloatArray, y: FloatArray) -> float | None:
    """Tell by how many rows a channel turns behind the displacement, near one turn.

    Parameters
    ----------
    x, y : displacement and channel, both rising before the turn, (n_row,).

    Returns
    -------
    [rows], negative if it turns before; None where that cannot be told. 0 where a drop at the turn explains an early kink.
    """
    top = int(np.argmax(x))
    place = _meeting(x, top, LINE, 1)
    if place is None or place[1] > TURN_OF_PLACE:
        return None
    turn = place[0]
    low = max(top - NEAR, 0)
    crest = low + int(np.argmax(y[low : top + NEAR + 1]))
    found = _meeting(y, crest, PARABOLA, 2)
    if found is None or found[1] > TURN_OF_CHANNEL:
        return None
    late = found[0] - turn
    # The row beside the turn that a shift by one row puts on the other branch; a turn next to a row is at it.
    at = int(np.floor(turn + TURN_OF_PLACE))
    row = at + 1 if late > 0 else at
    of_shift = row - turn if late > 0 else row - (turn - 1.0)
    if abs(late) > 1.0 + TELLS and of_shift < TELLS:  # of several rows the next one tells more
        row, of_shift = (row + 1 if late > 0 else row - 1), of_shift + 1.0
    first = last = row
    if abs(late) > 1.0 + TELLS:  # those on the wrong branch are beside neither course
        first, last = (row, max(row, int(np.ceil(found[0])))) if late > 0 else (min(row, int(np.floor(found[0])) + 1), row)
    if first - PARABOLA < 0 or last + 1 + PARABOLA > y.size or of_shift < TELLS:
        return None
    loading = _course(y, np.arange(first - PARABOLA, first), 2)
    behind = _course(y, np.arange(last + 1, last + 1 + PARABOLA), 2)
    bend = loading.slope(row) - behind.slope(row)
    value, variance = loading.at(row)
    below = value - float(y[row])
    if bend <= 0:
        return None
    off = below > ON_BRANCH * of_shift * bend
    sure = below > SURE * float(np.sqrt(variance))
    if late > 0:
        return late if not off else 0.0
    return late if off and sure else 0.0


def _meeting(y: FloatArray, top: int, n: int, degree: int) -> tuple[float, float] | None:
    """Where the courses before and behind a row meet, and the sd of that place [rows]; None if they do not nearby."""
    if top - n < 0 or top + n >= y.size:
        return None
    before, behind = _course(y, np.arange(top - n, top), degree), _course(y, np.arange(top + 1, top + 1 + n), degree)
    places = np.linspace(top - 2.0, top + 2.0, 161)
    apart = np.array([before.at(p)[0] - behind.at(p)[0] for p in places.tolist()])
    crossings = np.flatnonzero(apart[:-1] * apart[1:] <= 0)
    if not crossings.size:
        return None
    i = int(crossings[np.argmin(np.abs(places[crossings] - top))])
    place, steep = float(places[i]), abs(float(apart[i + 1] - apart[i])) / float(places[1] - places[0])
    if steep == 0.0:
        return None
    return place, float(np.sqrt(before.at(place)[1] + behind.at(place)[1])) / steep


def _course(y: FloatArray, rows: IntArray, degree: int) -> _Course:
    """A least-squares polynomial through some rows."""
    powers = np.vander((rows - rows[-1]).astype(np.float64), degree + 1, increasing=True)
    coefficients = np.asarray(np.linalg.lstsq(powers, y[rows], rcond=None)[0], dtype=np.float64)
    variance = float(np.sum((y[rows] - powers @ coefficients) ** 2)) / (rows.size - degree - 1)
    return _Course(int(rows[-1]), coefficients, variance * np.linalg.inv(powers.T @ powers))

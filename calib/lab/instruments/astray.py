"""From the readings of a record to the runs of rows in which one channel contradicts the others and agrees on both sides."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.growing_noise import growing_noise
from calib.lab.instruments.labtable import IntArray, Reading
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.spikes import SMOOTH, last_step, least_apart, noise_of, turns_of
from calib.lab.instruments.sticking import sticking
from calib.lab.instruments.unit_choice import is_confirmed, unit_in_words
from calib.lab.instruments.units import stands_for
from models.sensor import FloatArray

# A run begins and ends with a step of so many noises, and of such a share of the range; within it readings are off what the
# other channels let expect by as much. The step is so many times as large as those beside it that no other channel shows.
_NOISES, _SHARE, _STEPS = 8.0, 0.015, 2.0
# Noise may grow with the reading: they are off by so many times the scatter of readings as large.
_AS_LARGE = 6.0
# Readings on either side whose steps are looked at, and those that a record must have.
_BESIDE, _FEWEST = 3, 24
# Rows of a run: at least, and at most as a share of the record, or so many.
_LEAST, _MOST, _MOST_ROWS = 2, 0.2, 40
# Equal readings in so many times as many rows as usual are one of a slow meter, of which so many tell nothing.
_REPEATS, _FEW_READINGS = 1.5, 2
# Where more steps are as large, or ends of one run come into question, nothing is told; how often is looked once more.
_MOST_STEPS, _MOST_ENDS, _PASSES = 2000, 30, 12
# A channel goes with another one if more of its changes over such parts of the record do than do not, by such a share, and
# keeps within so many of its noises.
_GOES_WITH, _LAGS, _KEEPS = 0.35, 20, 4.0
# Between two readings a curve bends at most as this power of the way.
_BEND = 3.0
# A channel would show what another does if this share of its own change were so many times what it keeps within.
_WOULD_SHOW, _SHOWN = 0.2, 2.0
# It shows of a step so many times less than it does itself, both as shares of the ranges.
_SHOWS = 0.3
# Readings on either side of a run, while another channel rests, differ by such a share of its steps, as of a load that relaxes.
_ALIKE = 0.25
# Larger shares of a column that contradict the others are no single faults: it is refused.
_MOST_OF_ALL = 0.25
# A place is told by a load that is off rest by such a share of its range.
_IN_CONTACT = 0.1
# What a machine drives; two channels leave their course together if they share so much of their rows.
_DRIVEN, _SAME_ROWS = "displacement", 0.8
# A load that is so near to rest may be one of no contact.
_OUT_OF_CONTACT = 0.03


@dataclass(frozen=True)
class Astray:
    """Rows in succession in which a channel has not the readings of the press.

    Attributes
    ----------
    quantity, rows : which channel, and where, in order.
    near : what the readings on either side are, in the unit of the readings.
    beside : another channel that leaves its course in the same rows, both against the displacement; "" without one.
    """

    quantity: str
    rows: tuple[int, ...]
    near: tuple[float, float]
    beside: str = ""


@dataclass(frozen=True, eq=False)
class _Channel:
    """Readings of a channel, the rows in which they stand, and the least that is more than noise."""

    rows: IntArray
    y: FloatArray
    span: float
    unsure: float

    def at(self, rows: IntArray) -> FloatArray:
        """Its readings in other rows."""
        return np.asarray(np.interp(rows, self.rows, self.y), dtype=float)


def rows_astray(
    sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray], reading: Reading
) -> tuple[dict[str, dict[int, str]], set[int], list[Fault]]:
    """Why rows are not used in which a channel contradicts the others, and the faults of columns that do so too often.

    A unit that stands in the file and that the user says once more says that the readings are right.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    reading : what the user says of the file.

    Returns
    -------
    Quantity -> row from 0 -> why it is not usable; the rows in which load and capacitance both contradict the displacement; and
    the faults.
    """
    found = astray(values)
    lost: dict[str, dict[int, str]] = {}
    faults = []
    for column in columns:
        runs = [run for run in found if run.quantity == column.quantity]
        if not runs or is_confirmed(sheet, column.index, column.heading, column.factor, reading):
            continue
        names = dict.fromkeys(stands_for(q) for q in values if q in SMOOTH and stands_for(q) != stands_for(column.quantity))
        others = " and ".join(name for name in names if name != runs[0].beside)
        rows = {r: _in_words(sheet, column, run, reading, " and ".join(names)) for run in runs for r in run.rows}
        if len(rows) > _MOST_OF_ALL * np.count_nonzero(np.isfinite(values[column.quantity])):
            shown = sheet.columns[column.index][runs[0].rows[0]].strip()[:40]
            message = f'column "{sheet.names[column.index]}" contradicts {others} in {len(rows)} rows, first by "{shown}"'
            quantity = stands_for(column.quantity)
            advice = (
                f"Export the record again, or leave the column out: {Choice('columns', ('none',), quantity)}; if its readings "
                f"are right, let the header name the unit and say it once more: --units {quantity}=..."
            )
            line = int(sheet.lines[runs[0].rows[0]])
            faults.append(Fault(message, sheet.text.path, line, column.index + 1, advice=advice))
        lost[column.quantity] = rows
    return lost, {r for run in found if run.beside and run.quantity in lost for r in run.rows}, faults


def _in_words(sheet: Sheet, column: ReadColumn, run: Astray, reading: Reading, others: str) -> str:
    """Why the rows of a run are not used, for people."""
    cells, (first, last) = sheet.columns[column.index], (run.rows[0], run.rows[-1])
    unit = unit_in_words(sheet, column.index, column.heading, reading)
    near = " and ".join(f"{value / column.factor:.4g} {unit}".rstrip() for value in run.near)
    does = f", as {run.beside} does, contradicts {_DRIVEN}" if run.beside else f" contradicts {others}"
    return (
        f"{stands_for(column.quantity)}{does} in lines {int(sheet.lines[first])} to {int(sheet.lines[last])} "
        f'("{cells[first].strip()[:40]}" to "{cells[last].strip()[:40]}"): beside them it is {near}'
    )


def astray(values: Mapping[str, FloatArray]) -> list[Astray]:
    """Find runs of rows in which one channel leaves its course at once and is back at once, while the others go on.

    As a ball is pressed in, load, place and capacitance go up together: a reading at a place between two others of the same way
    is between theirs, and none beyond one of them falls below. A run of which every row contradicts all other channels in this,
    and that begins and ends with a step that none of them shows, was not measured: a load cell without its lead, a lost sign, a
    value of before. So were not, beside a displacement, load and capacitance that both do so together. A slip, a pull-off, a
    hold and a retreat are none of this: they do not come back at once, or are shown.

    Parameters
    ----------
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    """
    left = {q: np.array(values[q], dtype=float) for q in SMOOTH if q in values}
    found: list[Astray] = []
    for _ in range(_PASSES):
        channels = {q: c for q, v in left.items() if (c := _channel(v)) is not None}
        runs_of = ([r for r in _of_channel(q, channels) if q != "force" or not sticking(left, r.rows)] for q in channels)
        more = next((runs for runs in runs_of if runs), [])
        for run in more:
            left[run.quantity][list(run.rows)] = np.nan
        found += more
        if not more:
            break
    return sorted([*found, *_both_astray(left)], key=lambda run: run.rows)


def _both_astray(values: Mapping[str, FloatArray]) -> list[Astray]:
    """The runs in which load and capacitance leave their course together, and come back at once to where the ball goes on.

    Each is held against the displacement alone, as in a record that has nothing else. What a program read of both may be
    nothing, or of another time, where the machine's displacement is right.
    """
    found: list[Astray] = []
    turns = turns_of(values[_DRIVEN]) if _DRIVEN in values else np.zeros(0, dtype=np.int64)
    for capacitance in (q for q in SMOOTH[2:] if {_DRIVEN, "force"} <= values.keys() and q in values):
        runs: dict[str, list[Astray]] = {}
        for quantity in ("force", capacitance) if all(map(_leaps, (values["force"], values[capacitance]))) else ():
            pair = {q: _channel(values[q]) for q in (quantity, _DRIVEN)}
            channels = {q: c for q, c in pair.items() if c is not None}
            if len(channels) < len(pair) or not (runs_of := _of_channel(quantity, channels)):
                break
            runs[quantity] = [r for r in runs_of if quantity != "force" or not sticking(values, r.rows)]
        for one in runs["force"] if len(runs) > 1 else ():
            for other in runs[capacitance]:
                both = len({*one.rows} & {*other.rows})
                # Where the ball turns round, a ball that slipped and sticks again comes back to its course.
                turned = bool(np.any((turns >= one.rows[0] - 1) & (turns <= one.rows[-1] + 1)))
                if not turned and both > _SAME_ROWS * max(len(one.rows), len(other.rows)):
                    found += [replace(one, beside=stands_for(capacitance)), replace(other, beside="force")]
    return found


def _leaps(values: FloatArray) -> bool:
    """Whether readings step by the share of their range by which a run begins, which is told at once of most channels."""
    y = values[np.isfinite(values)]
    return y.size >= _FEWEST and bool(np.count_nonzero(np.abs(np.diff(y)) > _SHARE * np.ptp(y)) > 1)


def _channel(values: FloatArray) -> _Channel | None:
    rows = np.flatnonzero(np.isfinite(values))
    y = values[rows]
    if y.size < _FEWEST or np.ptp(y) == 0:
        return None
    noise = min(noise_of(y), noise_of(y, 3))
    # Of levels in which a ball was held the last digit is what they are not all apart.
    digit = min(least_apart(y), last_step(np.diff(y)) or np.inf)
    return _Channel(rows, y, float(np.ptp(y)), max(noise, digit / 2))


def _of_channel(quantity: str, channels: Mapping[str, _Channel]) -> list[Astray]:
    """The runs of a channel, none of which has a row of another."""
    own = channels[quantity]
    beside = [(q, c, _goes_with(own, c)) for q, c in channels.items() if q != quantity and not {q, quantity} <= set(SMOOTH[2:])]
    others = [_Channel(c.rows, c.y * sign, c.span, c.unsure) for q, c, sign in beside if sign]
    if not others or len(others) < len(beside):
        return []
    found, behind = [], 0
    # A slow meter's reading stands in as many rows as its others.
    usual = _REPEATS * float(np.median(np.diff(np.flatnonzero(np.append(np.diff(own.y, prepend=np.nan) != 0, True)))))
    for first, last, floor in _candidates(own, others):
        few = 1 + np.count_nonzero(np.diff(own.y[first : last + 1]))
        if usual > _FEW_READINGS and few <= _FEW_READINGS and last + 1 - first <= usual * few:
            continue
        least = max(floor, _AS_LARGE * float(np.max(growing_noise(own.y, own.y[[first - 1, last + 1]]))))
        if first >= behind and _contradicts(quantity, own, first, last, least, others):
            rows = tuple(own.rows[first : last + 1].tolist())
            found.append(Astray(quantity, rows, (float(own.y[first - 1]), float(own.y[last + 1]))))
            behind = last + 1 + _BESIDE
    return found


def _rest(channel: _Channel) -> float:
    """What a channel is at the beginning of a record."""
    return float(np.median(channel.y[: max(1, min(9, channel.y.size // 10))]))


def _candidates(own: _Channel, others: Sequence[_Channel]) -> list[tuple[int, int, float]]:
    """Runs of readings between two steps to and fro that no other channel shows: the first, the last, and the least step."""
    steps = np.diff(own.y)
    floor = max(_NOISES * own.unsure, _SHARE * own.span)
    if np.count_nonzero(np.abs(steps) > floor) > _MOST_STEPS:
        return []
    alone = np.abs(steps)
    for other in others:
        shown = np.diff(other.at(own.rows)) * np.sign(steps)
        shown[shown < _KEEPS * other.unsure] = 0.0
        alone = np.minimum(alone, np.abs(steps) - shown / other.span / _SHOWS * own.span)
    at = np.flatnonzero(alone > floor)
    at = at[(at >= _BESIDE) & (at < steps.size - _BESIDE)]
    begins = np.ones(at.size, dtype=bool)
    for other in others:
        # Where the ball turns, or goes back after a rest, a channel may fall at once with it, as by friction.
        there = other.at(own.rows)
        ahead, behind = there[at] - there[at - _BESIDE], there[at + 1 + _BESIDE] - there[at + 1]
        goes_on = (ahead * behind > 0) & (np.abs(ahead) > _KEEPS * other.unsure)
        inward = behind * (there[at] - _rest(other)) > 0
        begins &= goes_on | inward | (np.abs(behind) < _KEEPS * other.unsure) | (behind * steps[at] < 0)
    most = max(_MOST_ROWS, int(_MOST * own.y.size))
    found = []
    for k in np.flatnonzero(begins).tolist():
        a, ends = int(at[k]), at[k + 1 : k + 1 + _MOST_ENDS]
        ends = ends[(steps[ends] * steps[a] < 0) & (ends - a >= _LEAST) & (ends - a <= most)]
        for b in ends.tolist():
            # A load that relaxes or comes back behind a slip goes on in steps that are nearly as large.
            near = [np.delete(np.arange(e - _BESIDE, e + _BESIDE + 1), _BESIDE) for e in (a, b)]
            usual = max(float(np.sort(alone[n[(n != a) & (n != b)]])[-2]) for n in near)
            within = np.concatenate([alone[a + 1 : min(a + 1 + _BESIDE, b)], alone[max(b - _BESIDE, a + 1) : b]])
            if min(alone[a], alone[b]) > max(_STEPS * usual, float(np.max(within))):
                found.append((a + 1, b, floor))
    return found


def _goes_with(own: _Channel, other: _Channel) -> float:
    """Whether another channel rises with one, or falls, as 1 or -1; 0 if neither."""
    there = other.at(own.rows)
    lag = max(1, own.y.size // _LAGS)
    own_moves, moves = (c[lag:] - c[:-lag] for c in (own.y, there))
    told = (np.abs(own_moves) > _KEEPS * own.unsure) & (np.abs(moves) > _KEEPS * other.unsure)
    surplus = float(np.mean(np.sign(own_moves[told] * moves[told]))) if np.any(told) else 0.0
    return float(np.sign(surplus)) if abs(surplus) > _GOES_WITH else 0.0


def _contradicts(quantity: str, own: _Channel, first: int, last: int, floor: float, others: Sequence[_Channel]) -> bool:
    """Whether each reading of a run is off what all other channels let expect, and one of them would show what it does."""
    run, ends = np.arange(first, last + 1), np.array([first - 1, last + 1])
    y, (before, after) = own.y[run], own.y[ends].tolist()
    if quantity == "force" and _may_stick(own, y, before, after, floor):
        return False
    alike = max(floor, _ALIKE * min(abs(float(y[0]) - before), abs(float(y[-1]) - after)))
    off, told = np.full(run.size, np.inf), False
    for other in others:
        sure = _KEEPS * other.unsure
        there, (w0, w1) = other.at(own.rows[run]), other.at(own.rows[ends]).tolist()
        if not _agree(before, after, w0, w1, alike, sure):
            return False
        low, high = _expected(before, after, w0, w1, there, sure)
        off = np.minimum(off, np.maximum(low - y, y - high))
        told |= _is_told(quantity, other, min(w0, w1), float(np.min(off)) / own.span)
    return told and bool(np.min(off) > floor)


def _may_stick(own: _Channel, y: FloatArray, before: float, after: float, floor: float) -> bool:
    """Whether a load pulls, and does not press, beside an end out of contact, as of a ball that sticks and snaps off."""
    rest = _rest(own)
    # Where both sides are at rest the whole record tells which way the load presses.
    level = before + after - 2 * rest
    press = np.sign(level if abs(level) > floor else float(np.mean(own.y)) - rest) or 1.0
    pulls = float(np.max((y - rest) * press)) < -floor / 2
    return pulls and min(abs(before - rest), abs(after - rest)) < max(floor, _OUT_OF_CONTACT * own.span)


def _agree(before: float, after: float, w0: float, w1: float, least: float, sure: float) -> bool:
    """Whether the readings on either side of a run may both be right: they differ as those of another channel do."""
    way = w1 - w0
    return abs(after - before) <= least or (abs(way) > sure and way * (after - before) > 0)


def _is_told(quantity: str, other: _Channel, level: float, share: float) -> bool:
    """Whether another channel would show a change by a share of the range."""
    contact = quantity != "displacement" or abs(level - _rest(other)) > _IN_CONTACT * other.span
    return contact and _WOULD_SHOW * share * other.span > _SHOWN * other.unsure


def _expected(
    before: float, after: float, w0: float, w1: float, there: FloatArray, sure: float
) -> tuple[FloatArray, FloatArray]:
    """Between what readings may be, where those on either side and another channel in all these rows are known."""
    low, high = np.full(there.size, min(before, after)), np.full(there.size, max(before, after))
    way = abs(w1 - w0)
    if way > sure and (after - before) * (w1 - w0) > 0:
        lower = np.minimum(w0, w1)
        share = np.stack([np.clip((there + d - lower) / way, 0.0, 1.0) for d in (-sure, sure)])
        rise = high - low
        low, high = low + rise * share[0] ** _BEND, low + rise * (1 - (1 - share[1]) ** _BEND)
    # Beyond both, farther in or out, a channel is so, too.
    high = np.where(there > max(w0, w1) + sure, np.inf, high)
    low = np.where(there < min(w0, w1) - sure, -np.inf, low)
    return low, high

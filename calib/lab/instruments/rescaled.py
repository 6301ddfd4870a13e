"""From the readings of a record to the rows from which on they are in another unit or range than those above."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from calib.errors import Fault
from calib.lab.instruments.explained import beside as held_beside
from calib.lab.instruments.labtable import IntArray, Reading
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.spikes import noise_of
from calib.lab.instruments.unit_choice import is_confirmed
from calib.lab.instruments.units import stands_for, unit_ratios
from models.sensor import FloatArray

# Readings beside each other that differ by such a factor may be in two units.
_LEAST = 2.8
# Readings on either side that are looked at, and how large their steps may be beside what is read: next to the jump, and all.
_NEAR, _CALM, _CALM_ALL = 5, 0.3, 0.6
# A jump is so many times as large as a step on one side of it at least, of as many readings; noise about zero has others.
_STANDS_OUT, _SIDE = 6.0, 30
# Readings that must stand before a block of a few readings, and how near to the last of them those behind the block come.
_FEWEST, _BACK = 4, 0.2
# What a reading may miss the course of those above by once it is scaled back: in steps, where they only scatter about a level
# in so many (half of them if the factor is small), and as a share of it.
_MISS, _MISS_SCATTER, _MISS_SHARE = 1.0, 4.0, 0.015
# What they may scatter at most, in that measure, as a share of the level.
_LEVEL = 0.4
# Steps of a course behind a jump that tell it from noise about a rest, and how much they may differ then.
_COURSE, _COURSE_ALIKE, _TWO_ALIKE = 3, 3.0, 1.5
# A force may drop so much where a press turns round: told by a large factor if its steps are scaled without doubt.
_TURN, _MOVES, _ONE_WAY = 0.2, 0.01, 0.7
# By a factor that no force changes by within a row it may drop by more, and the steps next to the jump may be larger.
_MANY, _TURN_OF_MANY, _CALM_IF_MANY = 50.0, 0.45, 0.4
# That may be no larger than such a share of the reading, by the logarithm of the factor; of small ones
# a smaller share.
_SHARP, _SHARP_IF_SMALL, _SMALL = 0.17, 0.1, 7.0
# A force that falls misses the ratio of two units by more than this share if it was not switched.
_EXACT = 0.01
# Readings of less than this share of the range are near zero, and at rest within so many noises and last digits of it.
_NEAR_ZERO, _REST_NOISES, _REST_DIGITS = 0.1, 3.0, 2.5
# Of so many readings that scatter about zero so many are on either side of it at least, and none is so many medians off it.
_OF_REST, _ON_A_SIDE, _MEDIANS = 10, 2, 4.0
# Readings are too coarse to tell a level by from this share of them on that their last digit counts.
_COARSE = 0.05
# A step counts as scaled if it misses that by less than this factor, at most, or the root of the factor.
_MOST_MISSED = 4.0
# The step of another channel that is a jump, in its steps beside it, and as a share of its range.
_JUMP, _JUMP_SHARE = 4.0, 0.02
# The same share of a force or a capacitance, which drop where a press turns round.
_LARGE = 0.25
# What a channel that jumps, too, says of a jump; time says it where there is no other.
_BESIDE: Mapping[str, tuple[str, ...]] = {
    "force": ("displacement", "capacitance", "capacitance_series"),
    "displacement": ("force", "capacitance", "capacitance_series", "time"),
    "capacitance": (),
    "capacitance_series": (),
    "time": (),
}


@dataclass(frozen=True)
class _Switch:
    """A jump as of a change of units: its row and the last before it, the factor, whether it scales the steps, too.

    Where what moved a force seems to have ended, as a ball that comes off, it is one only if the ball turns there (`ended`).
    """

    row: int
    last: int
    factor: float
    words: str
    scaled: bool
    ended: bool


def rescaled(
    sheet: Sheet,
    columns: Sequence[ReadColumn],
    values: Mapping[str, FloatArray],
    decimals: Mapping[str, str],
    reading: Reading,
) -> tuple[list[str], list[Fault]]:
    """List the columns whose readings are, from a row on, in another unit or range than those above.

    They jump by the ratio of two units or by a power of ten, go on behind the jump as they went before it once they are scaled
    back, their steps are scaled with them, and no other channel jumps. So no snap-in, pull-off, slip or step to a hold is one.
    A unit that stands in the file and that the user says once more is believed, and the jump noted.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none, (n_row,).
    decimals : quantity -> decimal mark of its column.
    reading : what the user says of the file.
    """
    found: dict[str, list[_Switch]] = {}
    for column in columns:
        if column.quantity in _BESIDE and column.quantity in values and not column.clock:
            written = sheet.columns[column.index], decimals.get(column.quantity, ".")
            found[column.quantity] = _switches(column.quantity, values[column.quantity], column.factor, *written)
    notes: list[str] = []
    faults: list[Fault] = []
    for column in columns:
        kept = _unexplained(column.quantity, found, values)
        if not kept:
            continue
        message, advice = _in_words(sheet, column, kept)
        if is_confirmed(sheet, column.index, column.heading, column.factor, reading):
            notes.append(f"{message}; read in one unit, as asked")
            continue
        line = int(sheet.lines[kept[0].row])
        faults.append(Fault(message, sheet.text.path, line, column.index + 1, advice=advice))
    return notes, faults


# --- one channel -------------------------------------------------------------------------------------------------------------


def _switches(quantity: str, values: FloatArray, unit: float, cells: Sequence[str], mark: str) -> list[_Switch]:
    """The jumps of a channel that a change of units would make."""
    rows = np.flatnonzero(np.isfinite(values) & (values != 0))
    y = values[rows] / unit
    jumps = _jumps(y, _CALM_IF_MANY if quantity == "force" else _CALM)
    span = float(np.ptp(y)) if y.size else 0.0
    found = []
    for place, j in enumerate(jumps.tolist()):
        first = int(jumps[place - 1]) + 1 if place else 0
        last = int(jumps[place + 1]) if place + 1 < jumps.size else y.size - 1
        before, after = y[max(first, j + 1 - _NEAR) : j + 1], y[j + 1 : min(last, j + _NEAR) + 1]
        before = before[::-1][: _end_of_calm(before[::-1])][::-1]
        after = after[: _end_of_block(before, after)]
        after = after[: _end_of_calm(after)]
        if min(before.size, after.size) < 2:
            continue
        digits = max(_last_digit(cells[r], mark) for r in rows[j - 1 : j + 1].tolist())
        digits_after = max(_last_digit(cells[r], mark) for r in rows[j + 1 : j + 3].tolist())
        sides = y[max(0, j + 1 - _SIDE) : j + 1], y[j + 1 : j + 1 + _SIDE]
        ordinary = min(max(_usual(np.diff(side)), digit) for side, digit in zip(sides, (digits, digits_after), strict=True))
        switch = _switch(quantity, before, after, digits, digits_after)
        if switch is None or _is_about_zero(sides, (digits, digits_after), span):
            continue
        if abs(float(y[j + 1] - y[j])) > _STANDS_OUT * ordinary:
            found.append(_Switch(int(rows[j + 1]), int(rows[j]), *switch))
    return found


def _is_about_zero(sides: tuple[FloatArray, FloatArray], digits: tuple[float, float], span: float) -> bool:
    """Whether readings on both sides of a jump are near zero, and the smaller within noise and last digits of it: at rest."""
    ends = abs(float(sides[0][-1])), abs(float(sides[1][0]))
    small = int(np.argmin(ends))
    near = sides[0][::-1][:_NEAR], sides[1][:_NEAR]
    # Where the record begins, or ends, too few tell their noise: those on the other side have the same, if there was no switch.
    side = near[small] if near[small].size >= _FEWEST else near[1 - small]
    noise = noise_of(side) if side.size >= _FEWEST else 0.0
    # What scatters about zero has no level that another unit could have made of it.
    rest = (sides[0][::-1] if small == 0 else sides[1])[:_OF_REST]
    on_a_side = min(np.count_nonzero(rest > 0), np.count_nonzero(rest < 0))
    if on_a_side >= _ON_A_SIDE and ends[small] <= _MEDIANS * np.median(np.abs(rest)) and not _one_way(np.diff(rest)):
        return True
    return max(ends) < _NEAR_ZERO * span and ends[small] < max(_REST_NOISES * noise, _REST_DIGITS * digits[small])


def _jumps(y: FloatArray, calm_if_many: float) -> IntArray:
    """Places of readings that are much larger or smaller than the next one, where those on either side are calm enough."""
    if y.size < 4:
        return np.zeros(0, dtype=np.int64)
    size, steps = np.abs(y), np.abs(np.diff(y))
    ratio = size[1:] / size[:-1]
    wide = ((ratio > _LEAST) | (ratio < 1 / _LEAST)) & (np.sign(y[1:]) == np.sign(y[:-1]))
    at = np.flatnonzero(wide)
    at = at[(at > 0) & (at < wide.size - 1)]
    # Steps of a force at a turn are larger, and hide no jump by a factor of many.
    many = (ratio[at] > _MANY) | (ratio[at] < 1 / _MANY)
    calm = np.where(many, calm_if_many, _CALM)
    both = (steps[at - 1] <= calm * size[at]) & (steps[at + 1] <= calm * size[at + 1])
    return np.asarray(at[both], dtype=np.int64)


def _end_of_calm(readings: FloatArray) -> int:
    """How many readings next to a jump are calm, where the next are not, as of a touch: enough of them, or all."""
    wild = np.abs(np.diff(readings)) > _CALM_ALL * abs(readings[0])
    end = int(np.argmax(wild)) + 1 if np.any(wild) else readings.size
    return end if end >= _FEWEST - 1 else readings.size


def _end_of_block(before: FloatArray, after: FloatArray) -> int:
    """How many readings behind a jump belong together, where the next is on the level before the jump again."""
    back = np.abs(after / before[-1] - 1) < _BACK
    end = int(np.argmax(back)) if before.size >= _FEWEST and np.any(back) else after.size
    return end if end > 1 else after.size


def _switch(
    quantity: str, before: FloatArray, after: FloatArray, digit: float, digit_after: float
) -> tuple[float, str, bool, bool] | None:
    """Factor, its words, whether steps are scaled by it, or leave that open, and whether they end; None for another jump."""
    steps, steps_after = np.diff(before), np.diff(after)
    rough = max(np.max(np.abs(steps)) / abs(before[-1]), np.max(np.abs(steps_after)) / abs(after[0]))
    if rough > _CALM_ALL:
        return None
    rests = not _is_course(steps_after, digit_after)
    ended = quantity == "force" and _usual(steps_after) > digit_after and _is_course(steps[::-1], digit) and rests
    found = _goes_on_scaled(quantity, before, after, digit, digit_after)
    sure = found is not None
    if found is None and quantity == "force":
        found = _turns_scaled(quantity, before, after)
    if found is None:
        return None
    factor, words, missed = found
    ended &= factor < 1 and digit == digit_after
    usual, usual_after = _usual(steps), _usual(steps_after)
    wide = min(_MOST_MISSED, max(factor, 1 / factor) ** 0.5) * (1.0 if min(steps.size, steps_after.size) > 1 else 1.5)
    scaled = _alike(usual * factor, digit * factor, usual_after, digit_after, wide)
    same = _alike(usual, digit, usual_after, digit_after, wide)
    if not scaled and _one_way(steps) and _one_way(steps_after):
        # Of a course that bends only the steps next to the jump are alike.
        next_to = abs(float(steps[-1])), abs(float(steps_after[0]))
        scaled = _alike(next_to[0] * factor, digit * factor, next_to[1], digit_after, wide)
        same |= _alike(next_to[0], digit, next_to[1], digit_after, wide)
    if scaled and not same:
        return factor, words, True, ended
    # No capacitance jumps by a power of ten, whatever its noise does; no force rises so while the ball does not jump, is
    # written with other decimals from there on, or falls exactly so and goes on.
    large = max(factor, 1 / factor) > _SMALL
    told = _is_fine(before, after, digit, digit_after) and (digit != digit_after or missed <= _EXACT)
    held = quantity == "force" and ((large and (factor > 1 or digit != digit_after)) or told)
    if sure and (scaled or held or quantity in ("capacitance", "capacitance_series")):
        return factor, words, False, ended
    return None


def _goes_on_scaled(
    quantity: str, before: FloatArray, after: FloatArray, digit: float, digit_after: float
) -> tuple[float, str, float] | None:
    """The factor, its words, and by which share readings then miss the course on which they were before, once it is taken off.

    Readings that scatter about a level more than they go anywhere may also meet at their levels. Those of a smooth course meet
    at the mean of the steps on either side, which tells a factor where the steps are large.
    """
    steps, steps_after = np.diff(before), np.diff(after)
    best: tuple[float, float, str, float] | None = None
    fine = _is_fine(before, after, digit, digit_after)
    scatters = [fine and v.size >= _FEWEST - 1 and not _one_way(np.diff(v)) for v in (before, after)]
    smooth = min(steps.size, steps_after.size) > 1 and _is_course(steps[::-1], digit) and _is_course(steps_after, digit_after)
    levels = [float(np.median(v)) if s else float(v[k]) for v, s, k in zip((before, after), scatters, (-1, 0), strict=True)]
    for factor, words in _factors(quantity):
        large = max(factor, 1 / factor) > _SMALL
        size = max(_usual(steps), _usual(steps_after) / factor)
        rounding = (digit + digit_after / factor) / 2
        course = (0.0, float(steps[-1]), float(steps_after[0]) / factor)
        onwards = float(after[0]) / factor - float(before[-1]), min(course), max(course), _MISS
        level = levels[1] / factor - levels[0], 0.0, 0.0, _MISS_SCATTER if large else _MISS_SCATTER / 2
        ways = [(*onwards, size), (*level, size)] if any(scatters) else [(*onwards, size)]
        if smooth:
            ends = float(steps[-1]), float(steps_after[0]) / factor
            bends = float(steps[-1] - steps[-2]), float(steps_after[1] - steps_after[0]) / factor, ends[1] - ends[0]
            bend = max(map(abs, bends))
            ways.append((onwards[0], sum(ends) / 2, sum(ends) / 2, _MISS, bend))
        for gap, low, high, miss, step in ways:
            off = max(low - gap, gap - high, 0.0)
            slack = miss * step + _MISS_SHARE * abs(before[-1]) + rounding
            sharp = slack <= (_SHARP if large else _SHARP_IF_SMALL) * abs(np.log(factor) * before[-1])
            if miss != _MISS:  # readings that scatter about zero have no level
                sharp &= slack <= _LEVEL * min(abs(levels[0]), abs(levels[1] / factor))
            if off <= slack and sharp and (best is None or off / slack < best[0]):
                best = off / slack, factor, words, off / abs(before[-1]) if miss == _MISS else 1.0
    return best[1:] if best is not None else None


def _turns_scaled(quantity: str, before: FloatArray, after: FloatArray) -> tuple[float, str, float] | None:
    """The factor, as of `_goes_on_scaled`, by which a force goes on once it is taken off but for what it loses at a turn."""
    steps, steps_after = np.diff(before), np.diff(after)
    if _usual(steps_after) <= _MOVES * abs(after[0]) or not (_one_way(steps) and _one_way(steps_after)):
        return None
    # By a small factor a force also grows at the touch: there it must turn.
    turns = float(np.sum(steps)) * float(np.sum(steps_after)) < 0
    factors = [(f, words) for f, words in _factors(quantity) if turns or max(f, 1 / f) > _SMALL]
    # It turned within the step, so that the ball went back by as much as to the next row.
    first = [float(after[0]), float(after[0] - steps_after[0])] if turns else [float(after[0])]
    missed, factor, words = min((abs(y / f / float(before[-1]) - 1), f, words) for f, words in factors for y in first)
    return (factor, words, missed) if missed < (_TURN_OF_MANY if max(factor, 1 / factor) > _MANY else _TURN) else None


def _is_fine(before: FloatArray, after: FloatArray, digit: float, digit_after: float) -> bool:
    """Whether readings on both sides of a jump are of many counts of their last digit."""
    return bool(digit <= _COARSE * abs(before[-1]) and digit_after <= _COARSE * abs(after[0]))


def _usual(steps: FloatArray) -> float:
    """The size of most steps."""
    return float(np.median(np.abs(steps)))


def _one_way(steps: FloatArray) -> bool:
    """Whether steps are those of a course, and not of noise."""
    return abs(float(np.sum(steps))) >= _ONE_WAY * float(np.sum(np.abs(steps)))


def _is_course(steps: FloatArray, digit: float) -> bool:
    """Whether steps, or the first of them, are those of a course, which may turn behind: two that are alike, three roughly."""
    if _one_way(steps):
        return True
    for n, alike in ((2, _TWO_ALIKE), (_COURSE, _COURSE_ALIKE)):
        first = np.abs(steps[:n])
        one_sign = steps.size > n and abs(float(np.sum(np.sign(steps[:n])))) == n
        if one_sign and float(np.max(first)) <= alike * float(np.min(first)) and float(np.min(first)) > 2 * digit:
            return True
    return False


def _alike(step: float, digit: float, other: float, other_digit: float, wide: float) -> bool:
    """Whether two steps, each known to a digit, may be the same but for a factor."""
    return max(step - digit, 0.0) / wide <= other + other_digit and max(other - other_digit, 0.0) / wide <= step + digit


@cache
def _factors(quantity: str) -> tuple[tuple[float, str], ...]:
    """The factors by which readings jump where a unit or a range is switched, and what they are."""
    tens = [(10.0**k, f"{10**k:,}") for k in range(1, 13)] + [(10.0**-k, f"1/{10**k:,}") for k in range(1, 13)]
    return (*((f, words) for f, words in tens), *unit_ratios(quantity))


def _last_digit(cell: str, mark: str) -> float:
    """What the last digit of a number counts."""
    mantissa, _, exponent = cell.strip().lower().partition("e")
    behind = len(re.sub(r"\D", "", mantissa.partition(mark)[2])) if mark else 0
    power = int(exponent.replace("\u2212", "-")) if re.fullmatch(r"[-+\u2212]?\d{1,3}", exponent) else 0
    return float(10.0 ** min(power - behind, 300))  # 0.E874 is a number


# --- beside the others -------------------------------------------------------------------------------------------------------


def _unexplained(quantity: str, found: Mapping[str, list[_Switch]], values: Mapping[str, FloatArray]) -> list[_Switch]:
    """Those jumps of a channel that no other channel shares: nothing happened but a change of units."""
    kept = []
    switches = found.get(quantity, [])
    beside = [q for q in _BESIDE.get(quantity, ()) if q in values]
    beside = beside if [q for q in beside if q != "time"] or quantity != "force" or "time" not in values else ["time"]
    for switch in switches:
        shared = any(
            _jumps_there(values[q], switch, _JUMP_SHARE if q in ("displacement", "time") else _LARGE)
            and all(s.row != switch.row or not s.scaled for s in found.get(q, ()))
            for q in beside
        ) or any(_makes_it(values[q], values[quantity], switch) for q in beside[:1] if q != "time")
        # A displacement may stand still on two levels, time go on after a pause, and a force be held if nothing tells of it.
        enough = switch.scaled or quantity.startswith("capacitance") or (quantity == "force" and "displacement" in values)
        if enough and not shared and not (switch.ended and not _turns_there(values.get("displacement"), switch)):
            kept.append(switch)
    return kept


def _turns_there(ball: FloatArray | None, switch: _Switch) -> bool:
    """Whether the ball is on record, and goes one way before a jump and the other within a few readings behind it."""
    if ball is None:
        return False
    before, after = (
        part[np.isfinite(part)] for part in (ball[max(switch.last - _NEAR, 0) : switch.last + 1], ball[switch.row :])
    )
    steps, steps_after = np.diff(before), np.diff(after[: 2 * _NEAR])
    if not steps.size or not steps_after.size:
        return False
    return bool(steps[-1] * steps_after[-1] < 0 and _one_way(steps) and min(abs(steps[-1]), abs(steps_after[-1])) > 0)


def _jumps_there(values: FloatArray, switch: _Switch, share: float) -> bool:
    """Whether a channel makes a step there that its steps beside it are small against."""
    low, high = max(switch.last - _NEAR, 0), min(switch.row + _NEAR, values.size - 1)
    near = values[low : high + 1]
    own = values[[switch.last, switch.row]]
    if not np.all(np.isfinite(own)):
        return False
    step = abs(float(own[1] - own[0]))
    steps = np.abs(np.diff(near))
    steps[switch.last - low : switch.row - low] = np.nan
    there = steps[np.isfinite(steps)]
    usual = float(np.max(there)) if there.size else 0.0
    return step > _JUMP * usual and step > share * float(np.nanmax(values) - np.nanmin(values))


def _makes_it(other: FloatArray, values: FloatArray, switch: _Switch) -> bool:
    """Whether a step of another channel makes the jump at the slope of the rows beside, as of a stage that steps and waits."""
    rows = np.flatnonzero(np.isfinite(values) & np.isfinite(other))
    at = np.flatnonzero(rows == switch.last)
    if rows.size < _FEWEST or not at.size or at[0] + 1 >= rows.size or rows[at[0] + 1] != switch.row:
        return False
    # What scatters makes no jump, and steps of a stage look like scatter.
    return bool(held_beside(values[rows], other[rows], at, 0.0, 0.0).explained[0])


# --- words -------------------------------------------------------------------------------------------------------------------


# Switches of rows that come back.
_THERE_AND_BACK = 2


def _in_words(sheet: Sheet, column: ReadColumn, kept: Sequence[_Switch]) -> tuple[str, str]:
    cells = sheet.columns[column.index]
    first = kept[0]
    more = f" (and so in {len(kept) - 1} more places, such as line {int(sheet.lines[kept[1].row])})" if len(kept) > 1 else ""
    ratio = first.factor if first.factor > 1 else 1 / first.factor
    larger = "larger" if first.factor > 1 else "smaller"
    message = (
        f'column "{sheet.names[column.index]}": from this line on the readings are {ratio:.6g} times {larger} than those above '
        f'go on ("{cells[first.last].strip()}", then "{cells[first.row].strip()}": {first.words}){more}'
    )
    quantity = stands_for(column.quantity)
    back = ""
    if len(kept) == _THERE_AND_BACK:
        back = f"or remove lines {int(sheet.lines[first.row])} to {int(sheet.lines[kept[1].last])}, which are then missing; "
    advice = (
        "If a unit or a range was switched there, write all rows in one unit, or save the rows of each unit in a file of their "
        f"own; {back}if the jump is real, let the header name the one unit and say it once more: "
        f"--units {quantity}=..."
    )
    return message, advice

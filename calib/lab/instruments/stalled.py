"""From the readings of a record to those of a channel that stand still while others go on: a stalled logger, a range's end."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.labtable import IntArray, Reading
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.spikes import last_step, noise_of
from calib.lab.instruments.unit_choice import is_confirmed, unit_in_words
from calib.lab.instruments.units import stands_for
from models.sensor import FloatArray

_JUDGED = ("displacement", "force", "capacitance", "capacitance_series")
# Equal readings in succession that are looked at, so many times as long as runs usually are, of a column so long at least.
_RUN, _USUAL, _FEWEST = 4, 3.0, 16
# Steps on either side of a run that tell how the channel moved.
_BESIDE = 3
# Within a run the channel would have moved by so many noises and last digits.
_NOISES, _DIGITS = 6.0, 4.0
# What it moves by from reading to reading, in last digits.
_PACE = 2.5
# It has caught up if it jumps by such a share of what it would have moved, and by so many steps.
_CAUGHT_UP, _STEPS = 0.5, 2.0
# Another channel goes on if it moves by such a share of what it did before in as many rows.
_GOES_ON = 0.4
# A drive makes no halts if such a share of the runs shorter than `_RUN` is of one reading; cells that show the last digit.
_NO_HALTS, _CELLS = 0.95, 200
# The load goes on, not only its lag, if on the way to its peak it keeps such a share of its pace.
_KEEPS_PACE = 0.7
# A channel is asleep at the beginning for so many rows at least, and awakes by so many of the steps behind, of which most move.
_ASLEEP, _AWAKES, _STEPS_BEHIND = 8, 4.0, 7
# A channel that stands still to an end of the record goes on beside it at once if its first steps are such a share of the next.
_AT_ONCE = 0.5
# Readings scatter if their noise is so many times the last digit, and they bend the other way at such a share of the rows.
_SCATTERS, _BENDS = 3.0, 0.3
# Readings that are the same, and those of a channel at rest, as shares of the range.
_SAME, _AT_REST = 1e-9, 0.03
# The ball goes back by such a share of its travel behind the largest reading.
_BACK = 0.3
# A channel that is read anew less often: so many times at least, by more than so many last digits, mostly, at equal distances.
_HELD, _MORE, _MOSTLY_LARGE, _ALL_BUT = 8, 1.5, 0.3, 0.9
# Rows that are filled with one number: such a share of all at least, with so many others between them at equal distances.
_FILLED, _OTHERS = 0.45, 6


@dataclass(frozen=True)
class Stalled:
    """What is done about readings that stand still.

    Attributes
    ----------
    notes, faults : of which readings stay, and for which the record is refused.
    lost : quantity -> row from 0 -> why it is not usable.
    """

    notes: list[str] = field(default_factory=list)
    faults: list[Fault] = field(default_factory=list)
    lost: dict[str, dict[int, str]] = field(default_factory=dict)


def stalled(sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray], reading: Reading) -> Stalled:
    """Find readings that stand still, to the last digit, where they were moving and another channel goes on.

    Where they catch up behind, the logger wrote an old reading for a while: these rows are left out. Where they go on from
    where they stood, all behind may be late: refused. At an end of its range, as of a meter that saturates, it is noted; a
    displacement is left out there where the load goes on as on its way, which no hold shows. Readings that are one number from
    the beginning on and then begin with a jump are those of a channel below its threshold, or not on yet: left out. A slow
    meter, whose readings are all written several times, a display of few digits, a hold, and a load at rest are none of this.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    reading : what the user says of the file.
    """
    told = Stalled()
    both = _both_still(sheet, columns, values)
    for column, rows in judged_columns(sheet, columns, values, reading, _JUDGED, _FEWEST):
        y = values[column.quantity]
        filled = _filled(rows, y)
        if filled is not None:
            told.faults.append(_of_filled(sheet, column, *filled))
            continue
        if column.quantity != "displacement" and _holds_its_peak(y[rows], values.get("displacement", np.zeros(0)), rows):
            told.faults.append(_of_peak(sheet, column, int(rows[-1])))
            continue
        others = {q: v for q, v in values.items() if q in _JUDGED and stands_for(q) != stands_for(column.quantity)}
        held = _held(y, rows, others)
        if held:
            told.notes.append(
                f'column "{sheet.names[column.index]}" is read anew in about every {held}. row, and stands in those between '
                "while the other channels go on: a slower instrument, of which only the first row of each reading counts"
            )
        # A capacitance that awakes by a jump may have another offset: see `another_zero`.
        asleep = _asleep(rows, y, column.quantity, values) if column.quantity in ("displacement", "force") else None
        if asleep is not None:
            _tell_asleep(sheet, column, int(rows[0]), *asleep, reading, told)
        written = last_digit(sheet.columns[column.index], rows) * column.factor
        for order in (rows, rows[::-1]) if asleep is None else (rows[::-1],):
            inmost = _filled_from(order, y, column.quantity, others, written)
            if inmost is not None:
                _tell_filled(sheet, column, int(min(order[0], inmost)), int(max(order[0], inmost)), told)
        for first, last, kind in _runs(rows, y, others, written, driven=column.quantity == "displacement"):
            if first in told.lost.get(column.quantity, {}):
                continue
            if kind == "end" and last == rows[-1] and _goes_back(values.get("displacement"), first, last):
                _tell_filled(sheet, column, first + 1, last, told)  # no range ends for good
            else:
                _tell(sheet, column, first, last, kind, told)
        for first, last, kind in both.get(column.quantity, ()):
            _tell(sheet, column, first, last, kind, told, "only the ball goes on")
    return told


def _both_still(
    sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray]
) -> dict[str, list[tuple[int, int, str]]]:
    """Of load and capacitance the runs in which both stand still together while the ball goes on, as `_runs` gives them.

    What a program read of both was old there. One of them shows it beside the ball alone; the other, which may scatter by more
    than it moves, stands there for longer than it does elsewhere. A hold, in which nothing moves, is none of this.
    """
    both: dict[str, list[tuple[int, int, str]]] = {}
    own = [c for c in columns if c.quantity in _JUDGED[1:] and c.quantity in values]
    if "displacement" not in values or len({stands_for(c.quantity) for c in own}) < 2:
        return both
    ball = {"displacement": values["displacement"]}
    still = {c.quantity: _standing(values[c.quantity]) for c in own}
    for column in own if all(still.values()) else ():
        rows = np.flatnonzero(np.isfinite(values[column.quantity]))
        written = last_digit(sheet.columns[column.index], rows) * column.factor
        for run in _runs(rows, values[column.quantity], ball, written, driven=False):
            for other in (c.quantity for c in own if stands_for(c.quantity) != stands_for(column.quantity) and run[2] != "end"):
                with_it = [ends for ends in still[other] if max(abs(ends[0] - run[0]), abs(ends[1] - run[1])) <= 1]
                for ends, quantity in [(run[:2], column.quantity), *((ends, other) for ends in with_it[:1])]:
                    if with_it and not any(ends[0] == known[0] for known in both.get(quantity, ())):
                        both.setdefault(quantity, []).append((*ends, run[2]))
    return both


def _standing(values: FloatArray) -> list[tuple[int, int]]:
    """The first and the last row of runs in which readings stand still for longer than they do elsewhere."""
    rows = np.flatnonzero(np.isfinite(values))
    if rows.size < _FEWEST:
        return []
    starts = np.concatenate([[0], np.flatnonzero(np.diff(values[rows]) != 0) + 1])
    lengths = np.diff(np.append(starts, rows.size))
    usual = float(np.quantile(lengths[(lengths < _RUN) | (lengths <= np.median(lengths))], 0.9))
    long = np.flatnonzero((lengths >= _RUN) & (lengths >= _USUAL * usual))
    return [(int(rows[starts[k]]), int(rows[starts[k] + lengths[k] - 1])) for k in long.tolist()]


def _held(y: FloatArray, rows: IntArray, others: Mapping[str, FloatArray]) -> int:
    """In every how many rows a channel is read anew that repeats its readings between while others move; 0 if it does not."""
    v = y[rows]
    change = np.flatnonzero(np.diff(v) != 0)
    if change.size < _HELD or 2 * change.size > v.size:
        return 0
    # Steps of more than the last digit, each behind another: what a coarse display shows goes by one.
    large = np.abs(v[change + 1] - v[change]) > _MORE * last_step(v)
    apart = np.diff(change)[large[1:] & large[:-1]]
    if apart.size < _HELD or apart.size < _MOSTLY_LARGE * change.size:
        return 0
    every = int(np.median(apart))
    if every < 2 or np.mean(np.abs(apart - every) <= max(every // 4, every > 2)) < _ALL_BUT:
        return 0
    anew = np.isin(np.arange(v.size - 1), change)
    moves = [np.abs(np.diff(other[rows])) for other in others.values() if np.all(np.isfinite(other[rows]))]
    goes_on = any(0 < _GOES_ON * float(np.mean(m[anew])) < float(np.mean(m[~anew])) for m in moves)
    return every if goes_on else 0


def _tell(
    sheet: Sheet, column: ReadColumn, first: int, last: int, kind: str, told: Stalled, others: str = "the other channels go on"
) -> None:
    cells, name = sheet.columns[column.index], stands_for(column.quantity)
    lines = f"lines {int(sheet.lines[first])} to {int(sheet.lines[last])}"
    shown = f'"{cells[first].strip()[:40]}"'
    if kind == "end":
        cause = "a hold, or the end" if column.quantity == "displacement" else "the end"
        told.notes.append(
            f'column "{sheet.names[column.index]}": {shown} stands in {lines} while the other channels go on, as at {cause} of '
            "its range, behind which nothing would be measured"
        )
    elif kind == "late":
        message = (
            f'column "{sheet.names[column.index]}": {shown} stands in {lines} while {others}, and the readings '
            "behind go on from there: they may be late by as many rows"
        )
        advice = (
            "Save the rows before it in a file of their own, or export the record again; if the readings are right, let the "
            f"header name the unit and say it once more: --units {name}=..."
        )
        told.faults.append(Fault(message, sheet.text.path, int(sheet.lines[first]), column.index + 1, advice=advice))
    else:
        then = ", as at an end of its range" if kind == "beyond" else ", and catches up behind"
        why = f"{name} stands still in {lines} ({shown}) while {others}{then}"
        lost = range(first + (kind != "beyond"), last + 1)
        told.lost.setdefault(column.quantity, {}).update(dict.fromkeys(lost, why))


def _tell_asleep(
    sheet: Sheet, column: ReadColumn, first: int, last: int, jump: float, step: float, reading: Reading, told: Stalled
) -> None:
    cell, unit = sheet.columns[column.index][last].strip()[:40], unit_in_words(sheet, column.index, column.heading, reading)
    lines = f"lines {int(sheet.lines[first])} to {int(sheet.lines[last])}"
    why = (
        f'{stands_for(column.quantity)} is "{cell}" to the last digit in {lines} and then begins with a jump of '
        f"{jump / column.factor:.4g} {unit}, where it goes on by {step / column.factor:.2g} {unit} a row, as one "
        "below a threshold, or not on yet, would"
    )
    told.notes.append(f'column "{sheet.names[column.index]}": {why}; these rows are left out')
    told.lost.setdefault(column.quantity, {}).update(dict.fromkeys(range(first, last + 1), why))


def _asleep(rows: IntArray, y: FloatArray, quantity: str, values: Mapping[str, FloatArray]) -> tuple[int, float, float] | None:
    """One number from the beginning on, then a jump that the rows behind contradict: its last row, the jump, a step behind."""
    v = y[rows]
    change = np.flatnonzero(np.diff(v) != 0)
    if not change.size or int(change[0]) + 1 < _ASLEEP or v.size - int(change[0]) < _STEPS_BEHIND + 2:
        return None
    last = int(change[0])
    jump, steps = float(v[last + 1] - v[last]), np.diff(v[last + 1 : last + 2 + _STEPS_BEHIND])
    usual = float(np.max(np.abs(steps)))
    if 2 * np.count_nonzero(steps) < steps.size or jump * float(np.sum(steps)) <= 0:
        return None
    if quantity == "displacement" and not _moved(values.get("force"), rows[: last + 1]):
        return None  # at rest out of contact
    for beside in ("time",) if quantity == "displacement" else ("time", "displacement"):
        # A row that stands farther off, as behind rows that were not written, may differ by as much more.
        place = values[beside][rows[last : last + 2 + _STEPS_BEHIND]] if beside in values else np.arange(_STEPS_BEHIND + 2.0)
        apart = np.abs(np.diff(place))
        pace = float(np.median(apart[1:]))
        if not pace > 0 or not abs(jump) > _AWAKES * usual * max(1.0, float(apart[0]) / pace):
            return None
    return int(rows[last]), jump, float(np.mean(steps))


def _tell_filled(sheet: Sheet, column: ReadColumn, first: int, last: int, told: Stalled) -> None:
    cell = sheet.columns[column.index][last].strip()[:40]
    lines = f"lines {int(sheet.lines[first])} to {int(sheet.lines[last])}"
    why = (
        f'{stands_for(column.quantity)} is "{cell}" to the last digit in {lines}, at {"an end" if first else "the beginning"} '
        "of the record, while the other channels go on, as if not measured there, but filled from a neighbour"
    )
    told.notes.append(f'column "{sheet.names[column.index]}": {why}; these rows are left out')
    told.lost.setdefault(column.quantity, {}).update(dict.fromkeys(range(first, last + 1), why))


def _filled_from(order: IntArray, y: FloatArray, quantity: str, others: Mapping[str, FloatArray], written: float) -> int | None:
    """The last row of one number from an end of the record on, while the load goes on as beside it; None if there is none.

    `order` is the rows from that end on. What stands still out of contact, or within a last digit, is none, nor is a zero,
    below which nothing is shown. A load is none either whose readings do not scatter: the capacitance may feel the ball come.
    """
    v = y[order]
    change = np.flatnonzero(np.diff(v) != 0)
    if not change.size or int(change[0]) + 1 < _ASLEEP or v.size - int(change[0]) < 2 * _STEPS_BEHIND:
        return None
    last = int(change[0])
    lengths = np.diff(change)
    steps = np.diff(v[last : last + 1 + _STEPS_BEHIND])
    way, noise = float(np.sum(steps)), noise_of(v[last + 1 :])
    usual = float(np.quantile(lengths, 0.9)) if lengths.size else np.inf
    if last + 1 < _USUAL * usual or (v[0] == 0 and quantity in ("displacement", "force")):
        return None
    if quantity == "force" and (noise < _SCATTERS * written or not _scatters(v[last + 1 :])):
        return None
    if _GOES_ON * abs(way) < max(_NOISES * noise, _DIGITS * min(written, last_step(v))):
        return None
    if float(np.sum(steps[:2])) / way < _AT_ONCE * 2 / steps.size:
        return None  # it begins slowly, as one that comes to touch
    if float(np.max(np.abs(steps))) > _AT_ONCE * abs(way):
        return None  # a jump, or one digit of a coarse display
    for other, w in others.items():
        there, beside = w[order[last - _STEPS_BEHIND : last + 1]], w[order[last : last + 1 + _STEPS_BEHIND]]
        if other == "displacement" or not np.all(np.isfinite(there)) or not np.all(np.isfinite(beside)):
            continue
        moved, then = float(there[-1] - there[0]), float(beside[-1] - beside[0])
        if moved * then > 0 and abs(moved) > max(_GOES_ON * abs(then), _NOISES * noise_of(w[np.isfinite(w)])):
            return int(order[last])
    return None


def _scatters(v: FloatArray) -> bool:
    """Whether readings bend to and fro, as noise does and no smooth course."""
    bends = np.diff(v[np.isfinite(v)], 2)
    return bends.size > 1 and float(np.mean(bends[1:] * bends[:-1] < 0)) > _BENDS


def _moved(v: FloatArray | None, rows: IntArray) -> bool:
    """Whether readings have changed over rows by more than their noise."""
    there = v[rows][np.isfinite(v[rows])] if v is not None else np.zeros(0)
    if there.size < _ASLEEP:
        return False
    return abs(float(np.median(there[-3:]) - np.median(there[:3]))) > _NOISES * noise_of(there)


def judged_columns(
    sheet: Sheet,
    columns: Sequence[ReadColumn],
    values: Mapping[str, FloatArray],
    reading: Reading,
    quantities: Collection[str],
    fewest: int,
) -> Iterator[tuple[ReadColumn, IntArray]]:
    """The columns whose readings are to be judged, and their rows with a reading; none that the user has confirmed.

    Parameters
    ----------
    sheet : the record.
    columns : those that are read.
    values : quantity -> readings in SI, nan where there is none or none that is used, (n_row,).
    reading : what the user says of the file.
    quantities : that are judged.
    fewest : readings that a column has at least.
    """
    for column in columns:
        if column.quantity not in quantities or column.quantity not in values:
            continue
        rows = np.flatnonzero(np.isfinite(values[column.quantity]))
        if rows.size >= fewest and not is_confirmed(sheet, column.index, column.heading, column.factor, reading):
            yield column, rows


def last_digit(cells: Sequence[str], rows: IntArray) -> float:
    """The last digit of the numbers of a column as they are written; infinite where they are no plain numbers.

    Parameters
    ----------
    cells : of the column.
    rows : that have a reading.
    """
    powers: list[int] = []
    for row in rows[:: max(1, rows.size // _CELLS)].tolist():
        cell = cells[row].strip().replace(",", ".")
        whole, _, behind = cell.partition(".")
        if behind.isdecimal() and whole.lstrip("+-").isdecimal():
            powers.append(-len(behind))
            continue
        try:
            power = Decimal(cell).as_tuple().exponent
        except InvalidOperation:
            continue
        powers += [power] if isinstance(power, int) else []
    return 10.0 ** float(np.clip(np.median(powers), -300, 300)) if powers else np.inf  # 0.E874 is a number


def _runs(
    rows: IntArray, y: FloatArray, others: Mapping[str, FloatArray], written: float, *, driven: bool
) -> list[tuple[int, int, str]]:
    """Runs of equal readings that cannot be: first row, last row, and whether it is "end", "beyond", "late" or "lost".

    `written` is the last digit in which the channel is written; `driven` if it is where the drive goes.
    """
    v = y[rows]
    change = np.flatnonzero(np.diff(v) != 0) + 1
    starts = np.concatenate([[0], change])
    lengths = np.diff(np.append(starts, v.size))
    long = np.flatnonzero(lengths >= _RUN)
    if not long.size or lengths.size < 2 * _BESIDE:
        return []
    usual = float(np.quantile(lengths[(lengths < _RUN) | (lengths <= np.median(lengths))], 0.9))
    # What a motor drives has steps of many digits, which differ by few.
    coarse = digit = min(last_step(v), last_step(np.diff(v)))
    short = lengths[lengths < _RUN]
    if short.size and np.mean(short == 1) >= _NO_HALTS:
        digit = min(digit, written)  # it goes on by equal steps, which are those of no display
    floor = max(_NOISES * noise_of(v[starts]), _DIGITS * digit)
    low, high, rest = float(np.min(v)), float(np.max(v)), float(np.median(v[: max(1, min(9, v.size // 10))]))
    span = high - low
    found = []
    for k in long.tolist():
        first, last = int(starts[k]), int(starts[k] + lengths[k]) - 1
        before, after = v[max(first - _BESIDE, 0) : first + 1], v[last + 1 : last + 3]
        if lengths[k] < _USUAL * usual or before.size <= _BESIDE or abs(v[first] - rest) < _AT_REST * span:
            continue
        if float(np.min(np.abs(np.diff(before)))) < _PACE * digit:
            continue  # a digit that goes to and fro
        if not _one_way(before):
            continue
        # The least of the steps before: one of them may be a jump.
        pace, pace_after = float(np.min(np.abs(np.diff(before)))), _pace(after)
        way, way_after = (float(u[-1] - u[0]) if u.size else 0.0 for u in (before, after))
        would = pace * (lengths[k] - 1)
        at_end = min(high - v[first], v[first] - low) <= _SAME * span
        ends = int(rows[first]), int(rows[last])
        goes_on = not at_end and after.size > 0 and _go_on(others, *ends, ahead=True)
        jump = float(after[0] - v[last]) if after.size else 0.0
        if goes_on and jump * way > 0 and would > floor and abs(jump) > max(_CAUGHT_UP * would, _STEPS * pace):
            found.append((*ends, "lost"))
        elif driven and (at_end or way * way_after < 0) and would + pace > floor and _load_goes_on(others, *ends):
            found.append((*ends, "beyond"))
        elif not at_end and jump * way > floor * abs(way) and way_after * way < 0 and _go_on(others, *ends, ahead=False):
            found.append((*ends, "lost"))  # over a turn, behind which it is farther on, though it goes back
        elif at_end or (way_after * way < 0 and min(high - v[first], v[first] - low) <= floor):
            if would + pace > floor and pace >= _PACE * coarse and _go_on(others, *ends, ahead=False):
                found.append((*ends, "end"))
        elif goes_on and way * way_after > 0 and min(would, pace_after * (lengths[k] - 1)) > floor:
            found += [(*ends, "late")] if not driven or _load_goes_on(others, *ends) else []
    return found


def _pace(v: FloatArray) -> float:
    """By how much readings change from one to the next."""
    return abs(float(v[-1] - v[0])) / (v.size - 1) if v.size > 1 else 0.0


def _one_way(v: FloatArray) -> bool:
    steps = np.diff(v)
    return bool(np.all(steps > 0) or np.all(steps < 0))


def _go_on(others: Mapping[str, FloatArray], first: int, last: int, *, ahead: bool) -> bool:
    """Whether all other channels move between two rows as fast as before them; `ahead` if in the same direction, too."""
    moving = 0
    for v in others.values():
        rows = np.flatnonzero(np.isfinite(v))
        begin, end = np.searchsorted(rows, [first, last + 1])
        there, before = v[rows[begin:end]], v[rows[max(begin - _BESIDE, 0) : begin + 1]]
        if there.size < 3 or before.size < 2:
            continue
        moved = float(there[-1] - there[0]) * np.sign(float(before[-1] - before[0])) if ahead else float(np.ptp(there))
        if moved < _GOES_ON * _pace(before) * (there.size - 1) or np.all(there == there[0]):
            return False
        moving += _pace(before) > 0 and float(np.ptp(there)) > 3 * noise_of(v[rows])
    return moving > 0


def _load_goes_on(others: Mapping[str, FloatArray], first: int, last: int) -> bool:
    """Whether each other channel goes on as before for a good part of some rows, as where a ball goes on that should rest."""
    moving = 0
    for v in others.values():
        rows = np.flatnonzero(np.isfinite(v))
        begin, end = np.searchsorted(rows, [first, last + 1])
        there, before = v[rows[begin:end]], v[rows[max(begin - _BESIDE, 0) : begin + 1]]
        if there.size < _RUN or before.size < 2:
            continue
        ahead = (there - there[0]) * np.sign(float(before[-1] - before[0]))
        peak = int(np.argmax(ahead))
        if ahead[peak] < max(_GOES_ON * _pace(before) * (there.size - 1), _KEEPS_PACE * _pace(before) * peak):
            return False
        moving += float(ahead[peak]) > _NOISES * noise_of(v[rows])
    return moving > 0


def _filled(rows: IntArray, y: FloatArray) -> tuple[int, int, float] | None:
    """A number that stands in most rows, with others at equal distances between: its first row, the distance, the number."""
    v = y[rows]
    numbers, counts = np.unique(v[:2000], return_counts=True)
    number = float(numbers[int(np.argmax(counts))])
    own = v == number
    if not _FILLED <= np.mean(own) < 1:
        return None
    between = np.flatnonzero(~own)
    apart = np.diff(between)
    if between.size < _OTHERS or int(apart[0]) < 2:
        return None
    if np.mean(apart == np.median(apart)) < 0.8 or np.median(apart) < 2:
        return None
    return int(rows[np.flatnonzero(own)[0]]), int(np.median(apart)), number


def _holds_its_peak(v: FloatArray, place: FloatArray, rows: IntArray) -> bool:
    """Whether readings only ever go one way, and stay at the last while the ball goes back: the largest so far."""
    steps = np.diff(v)
    if not place.size or not (np.all(steps >= 0) or np.all(steps <= 0)) or np.count_nonzero(steps) < _FEWEST // 2:
        return False
    there, last = place[rows], int(np.flatnonzero(steps)[-1])
    before, behind = (part[np.isfinite(part)] for part in (there[: last + 1], there[last + 1 :]))
    if before.size < 2 or behind.size < _RUN:
        return False
    back = -float(behind[-1] - behind[0]) * float(np.sign(before[-1] - before[0]))
    return back > _BACK * float(np.ptp(there[np.isfinite(there)]))


def _goes_back(place: FloatArray | None, first: int, last: int) -> bool:
    """Whether the ball goes back, by a share of its travel, from where it is deepest within some rows to the last of them."""
    there = place[first : last + 1] if place is not None else np.zeros(0)
    there = there[np.isfinite(there)]
    if place is None or there.size < _RUN:
        return False
    onwards = float(np.sign(there[_RUN - 1] - there[0]))
    return float(np.max(onwards * there)) - onwards * float(there[-1]) > _BACK * float(np.nanmax(place) - np.nanmin(place))


def _of_peak(sheet: Sheet, column: ReadColumn, row: int) -> Fault:
    name, cell = sheet.names[column.index], sheet.columns[column.index][row].strip()[:40]
    message = (
        f'column "{name}" never goes back, and stands still at "{cell}" while the ball does, as a peak that is held '
        "does, and no reading of each row"
    )
    quantity = stands_for(column.quantity)
    advice = (
        f"Export the readings themselves, or leave it out: {Choice('columns', ('none',), quantity)}; if they are right, let "
        f"the header name the unit and say it once more: --units {quantity}=..."
    )
    return Fault(message, sheet.text.path, int(sheet.lines[row]), column.index + 1, advice=advice)


def _of_filled(sheet: Sheet, column: ReadColumn, row: int, apart: int, number: float) -> Fault:
    cell = sheet.columns[column.index][row].strip()[:40]
    message = (
        f'column "{sheet.names[column.index]}": "{cell}" stands in all rows but every {apart}th: cells without a reading seem '
        "to have been filled with it"
    )
    advice = f'Empty the cells with "{cell}", so that a row has a reading or none, or export them so'
    return Fault(message, sheet.text.path, int(sheet.lines[row]), column.index + 1, advice=advice)

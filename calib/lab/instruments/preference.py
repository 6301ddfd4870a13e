"""From the columns that may be one quantity to the one that is read, and why the others are not or what the user must say."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.lexicon import CORRECTED, MASSES
from calib.lab.instruments.meanings import PLAIN, TAKEN_OFF
from calib.lab.instruments.rivals import but_for_zero, difference, goes_back, holds_clock, moves_with, readings, stands_still
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.side_clocks import blocks_of_clocks, choice_of_clock
from calib.lab.instruments.unit_choice import unit_of_column
from calib.lab.instruments.units import is_unit_of, lab_factor, stands_for
from calib.lab.instruments.vocabulary import Heading, as_a_record, heading_as, why_unread, words
from models.sensor import FloatArray

# Quantities of which two columns that differ are a choice of the user.
_DECISIVE = ("time", "displacement", "force", "capacitance", "capacitance_series")
# A column that moves by less than this share of another of its quantity is not the one that was in use.
_NOISE = 0.05
# A time of day that drifts by this share of the span of a time in seconds is that of another clock; of so many rows at least.
_OTHER_CLOCK, _FEWEST = 0.05, 5
# A clock moves between such a share of the rows.
_MOSTLY = 0.8
# Largest difference, as a share of the span, that filtering leaves between a raw column and one of the plain name.
_SMOOTHED = 0.02
# Largest difference, as a share of the span, of columns that hold the same numbers, maybe in other units.
_EXACT = 1e-5
# Columns that differ by a constant but for more than this share of the span differ by their scale, too.
_CONSTANT = 1e-3
# A column whose smallest step is so many times that of another is coarser.
_COARSE = 5.0
# Largest difference of a reading from one that was rounded to a last digit, as a share of half of that.
_LITTLE = 1.02
# A column is the sum of others within such a share of the span.
_OF_A_SUM = 0.01
_WRITTEN = re.compile(r"[+\-\u2212]?\d+(?:[.,](?P<decimals>\d*))?")
_SAME = "the same readings"
_RAW = "the load as the cell read it is preferred, its zero is a parameter of the model"


@dataclass(frozen=True)
class PossibleColumn:
    """A column that may be read as a quantity: its readings in SI at some rows, None where its unit is not known."""

    index: int
    heading: Heading
    values: FloatArray | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Remarks:
    """What is to be said of columns that are not read: index -> why, notes on choices, and choices that are the user's."""

    unread: Mapping[int, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    faults: tuple[Fault, ...] = ()


def best_of(
    sheet: Sheet, quantity: str, candidates: Sequence[PossibleColumn], reading: Reading, asked_index: str
) -> tuple[PossibleColumn | None, Remarks]:
    """Choose the column that is read for a quantity.

    Parameters
    ----------
    sheet : the record.
    quantity, candidates : what is looked for, and the columns that may be it.
    reading : what the user says of the file.
    asked_index : the number or letter in the names that the user gave; "" if they have none.

    Returns
    -------
    The column, None if there is none, and what is to be said of the others.
    """
    unread: dict[int, str] = {}
    filled = [c for c in candidates if first_cell(sheet, c.index)]
    unread.update({c.index: "empty" for c in candidates if c not in filled})
    candidates = filled or candidates[:1]
    if not filled:
        unread.pop(candidates[0].index)
    rounded: tuple[str, ...] = ()
    if len(candidates) > 1 and quantity != "status":
        candidates = _with_values(sheet, candidates, reading)
        candidates = _that_move(sheet, quantity, candidates, unread)
        candidates, rounded = _but_rounded(sheet, quantity, candidates, reading, unread)
    else:
        heading = candidates[0].heading
        of_sample = (heading.letter and quantity == "displacement") or (quantity == "force" and heading.name in MASSES)
        if of_sample and filled and stands_still(_readings_alone(sheet, candidates[0].index)):
            what = "a dimension" if quantity == "displacement" else "the mass"
            unread[candidates[0].index] = f"stands still: {what} of the sample, no record"
            return None, Remarks(unread)
    plain = [c for c in candidates if not c.heading.name_doubt and not c.heading.unit_doubt and _fits(sheet, c)]
    if any(words(sheet.names[c.index]) == words(sheet.names[p.index]) for c in candidates if c not in plain for p in plain):
        plain = []  # of two columns of one name none is the plain one
    for c in candidates if plain else ():
        if c not in plain:
            unread[c.index] = c.heading.name_doubt or c.heading.unit_doubt or f"its unit is none of a {in_words(quantity)}"
    candidates = plain or candidates
    coarse = _coarse(candidates)
    candidates = sorted(candidates, key=lambda c: (*_preference(c, asked_index), c.index in coarse, c.index))
    best, others = candidates[0], candidates[1:]
    found = _beside(sheet, quantity, best, others, asked_index)
    faults = [*found.faults, *_less_than(sheet, quantity, best, unread, reading, asked_index)]
    if best.heading.name_doubt:
        this = Choice("columns", (sheet.name_for_asking(best.index),), quantity)
        rest = tuple(sheet.name_for_asking(i) for i in _also_in_its_unit(sheet, quantity, {c.index for c in candidates}))
        another = f"; if another is: {Choice('columns', rest, quantity)}" if rest else ""
        taken_off = TAKEN_OFF in best.heading.name_doubt
        first = "If nothing was taken off, so that its readings are all of it" if taken_off else "If it is the one"
        press = {"force", "displacement"} <= {h.quantity for h in sheet.headings.values()}
        if stands_for(quantity) == "capacitance" and press and not rest:
            another = f"; else leave it out: {Choice('columns', ('none',), 'capacitance')}"
        asked_again = heading_as(quantity, sheet.names[best.index], sheet.unit_below(best.index)).unit_doubt
        unit = (best.heading.unit or sheet.unit_below(best.index)) if asked_again else ""
        or_more = f" (10 {unit}, if its readings are to be multiplied by 10)" if "factor" in asked_again else ""
        with_unit = f" and --units {quantity}={unit}{or_more}" if unit else ""
        faults.append(
            Fault(
                f'column "{sheet.names[best.index]}" may be no {in_words(quantity)}: {best.heading.name_doubt}',
                sheet.text.path,
                sheet.named_at,
                best.index + 1,
                advice=f"{first}: {this}{with_unit}{another}",
                choice=this,
            )
        )
    faults += _in_parts(sheet, quantity, best, others) if not faults else []
    if best.heading.processed and quantity in _DECISIVE:
        found = replace(found, notes=(*found.notes, f'"{sheet.names[best.index]}" was worked on after the measurement'))
    return best, Remarks({**unread, **found.unread}, (*found.notes, *rounded), tuple(faults))


def _in_parts(sheet: Sheet, quantity: str, best: PossibleColumn, others: Sequence[PossibleColumn]) -> list[Fault]:
    """The fault of columns that agree, as cells that share a load do, where one that is not understood is their sum."""
    parts = {c.index: c.values for c in (best, *others) if c.values is not None}
    if quantity != "force" or len(parts) < 2 or best.index in sheet.assigned:
        return []
    total = np.sum(list(parts.values()), axis=0)
    for index in _also_in_its_unit(sheet, quantity, parts):
        factor = lab_factor(sheet.unit_written(index), quantity)
        (whole,) = readings([sheet.columns[index]], [factor], sheet.declared_decimal)
        there = np.isfinite(whole) & np.isfinite(total)
        if there.sum() < 3 or np.max(np.abs(whole - total)[there]) > _OF_A_SUM * np.ptp(total[there]):
            continue
        choice = Choice("columns", tuple(sheet.name_for_asking(i) for i in (index, *parts)), quantity)
        listed = ", ".join(f'"{sheet.names[i]}"' for i in parts)
        message = f'"{sheet.names[index]}" is the sum of {listed}: cells that share the load, or one that counts it twice'
        advice = f"Say which one is the load: {choice}"
        return [Fault(message, sheet.text.path, sheet.named_at, index + 1, advice=advice, choice=choice)]
    return []


def _less_than(
    sheet: Sheet, quantity: str, best: PossibleColumn, unread: Mapping[int, str], reading: Reading, asked_index: str
) -> list[Fault]:
    """The choice of a column that a number or a letter names, or that stands still, where one of the plain name is not read.

    That is so by a statistic or a factor in its brackets, or by a unit of another kind: which may be the mistake.
    """
    numbered = bool(best.heading.index) and best.heading.index != asked_index
    cells = sheet.columns[best.index]
    # Of most columns the ends alone show that they move.
    still = len(cells) > 2 and (not cells[-1].strip() or cells[0].strip() == cells[-1].strip())
    still = still and stands_still(_readings_alone(sheet, best.index))
    if quantity not in _DECISIVE or not (numbered or best.heading.letter or still):
        return []
    if quantity == "time" and (day := _time_of_day(sheet, best, reading)) is not None:
        choice = Choice("columns", (sheet.name_for_asking(day), sheet.name_for_asking(best.index)), quantity)
        return [
            Fault(
                f'"{sheet.names[best.index]}" could be the time, but "{sheet.names[day]}" has times of day that run otherwise',
                sheet.text.path,
                sheet.named_at,
                day + 1,
                advice=f"Say which one is meant: {choice}",
                choice=choice,
            )
        ]
    for index, name in enumerate(sheet.names):
        plain = as_a_record(name, sheet.unit_below(index))
        if index == best.index or plain is None or plain.quantity != quantity or plain.index or plain.letter:
            continue
        why = unread.get(index, "") or why_unread(name, sheet.unit_below(index))
        if why == "empty" or why.startswith(_SAME):
            continue
        if (why.startswith("stands still") and not numbered) or (still and stands_still(_readings_alone(sheet, index))):
            continue  # a column that was not in use
        # One that only its brackets put aside may be meant as it stands.
        either = [best.index, *([index] if _fits(sheet, PossibleColumn(index, plain)) else [])]
        choice = Choice("columns", tuple(sheet.name_for_asking(i) for i in either), quantity)
        cannot = "could be it as well" if why == "not used" else f"cannot be read ({why.removesuffix(': not used')})"
        named = f'"{name}", which bears the plain name, {cannot}'
        correct = "Correct the unit in the file, or say that the other one is meant"
        return [
            Fault(
                f'"{sheet.names[best.index]}" could be the {in_words(quantity)}, but {named}',
                sheet.text.path,
                sheet.named_at,
                index + 1,
                advice=f"{correct if len(either) == 1 else 'Say which one is meant'}: {choice}",
                choice=choice,
            )
        ]
    return []


def _time_of_day(sheet: Sheet, best: PossibleColumn, reading: Reading) -> int | None:
    """A column under a name that is not understood whose times of day are those of another clock than a time; None if none."""
    for index, name in enumerate(sheet.names):
        cells = sheet.columns[index]
        if not name or as_a_record(name, sheet.unit_below(index)) is not None or not holds_clock(cells):
            continue
        _, factor = unit_of_column(sheet, best.index, best.heading, reading)
        day, own = readings([cells, sheet.columns[best.index]], [1.0, factor], sheet.declared_decimal)
        if not stands_still(day) and _is_another_clock(replace(best, index=index, values=day), replace(best, values=own)):
            return index
    return None


def _readings_alone(sheet: Sheet, index: int) -> FloatArray:
    return readings([sheet.columns[index]], [1.0], sheet.declared_decimal)[0]


def in_words(quantity: str) -> str:
    """A quantity as people write it: "series capacitance"."""
    return quantity.replace("_", " ").replace("capacitance series", "series capacitance")


def first_cell(sheet: Sheet, index: int) -> str:
    """The first cell of a column that is not empty, "" if all are.

    Parameters
    ----------
    sheet, index : the record, and which of its columns.
    """
    return next(filter(str.strip, sheet.columns[index]), "").strip()


def _fits(sheet: Sheet, candidate: PossibleColumn) -> bool:
    """Whether the unit of a column, if it has one, is one of its quantity."""
    units = [u for u in (candidate.heading.unit or "", sheet.unit_below(candidate.index)) if u]
    return all(is_unit_of(u, candidate.heading.quantity) for u in units)


def _preference(candidate: PossibleColumn, asked_index: str) -> tuple[bool, bool, bool, int]:
    heading = candidate.heading
    other = bool(heading.index) and heading.index != asked_index
    return (bool(asked_index) and heading.index != asked_index, other, heading.processed, heading.rank)


def _coarse(candidates: Sequence[PossibleColumn]) -> set[int]:
    """The columns written in far larger steps than another of the same name, such as a load in pounds beside newtons."""
    if len({c.heading.name for c in candidates}) == len(candidates):
        return set()
    steps = {c.index: _smallest_step(c.values) for c in candidates}
    finest: dict[str, float] = {}
    for c in candidates:
        finest[c.heading.name] = min(steps[c.index], finest.get(c.heading.name, np.inf))
    return {c.index for c in candidates if _COARSE * finest[c.heading.name] < steps[c.index] < np.inf}


def _smallest_step(values: FloatArray | None) -> float:
    """The smallest difference of two readings; infinite where there are no two."""
    if values is None:
        return np.inf
    return float(np.min(np.diff(np.unique(values[np.isfinite(values)])), initial=np.inf))


def _with_values(sheet: Sheet, candidates: Sequence[PossibleColumn], reading: Reading) -> list[PossibleColumn]:
    factors = [unit_of_column(sheet, c.index, c.heading, reading) for c in candidates]
    # A decimal mark that the user gives or the file declares decides.
    decimal = reading.decimal or sheet.declared_decimal
    values = readings([sheet.columns[c.index] for c in candidates], [f for _, f in factors], decimal)
    known = [fault is None or holds_clock(sheet.columns[c.index]) for c, (fault, _) in zip(candidates, factors, strict=True)]
    return [replace(c, values=v if ok else None) for c, v, ok in zip(candidates, values, known, strict=True)]


def _that_move(sheet: Sheet, quantity: str, candidates: list[PossibleColumn], unread: dict[int, str]) -> list[PossibleColumn]:
    """The candidates without those that stand still while others move; of times also without times of day."""
    still = [c for c in candidates if c.values is not None and stands_still(c.values)]
    moving = [c for c in candidates if c not in still]
    if quantity in _DECISIVE and still and moving:
        unread.update({c.index: f'stands still while "{sheet.names[moving[0].index]}" moves' for c in still})
        candidates = moving
    if quantity == "time":
        # Seconds are finer than a time of day.
        plain = [c for c in candidates if not holds_clock(sheet.columns[c.index])]
        if plain:
            days = [c for c in candidates if c not in plain and not _is_another_clock(c, plain[0])]
            unread.update({c.index: f'a time of day: "{sheet.names[plain[0].index]}" is preferred' for c in days})
            candidates = [c for c in candidates if c not in days]
    return candidates


def _but_rounded(
    sheet: Sheet, quantity: str, candidates: list[PossibleColumn], reading: Reading, unread: dict[int, str]
) -> tuple[list[PossibleColumn], tuple[str, ...]]:
    """The candidates without those that are another one rounded more coarsely, and notes on these.

    Each reading is within half of the last written digit of both, which is more than what columns that are the same differ by.
    """
    if quantity not in _DECISIVE:
        return candidates, ()
    digits = {c.index: _last_digit(sheet, c, reading) for c in candidates}
    notes: list[str] = []
    for coarse in candidates:
        finer = [c for c in candidates if 0 < _COARSE * digits[c.index] < digits[coarse.index] and c.index not in unread]
        for fine in finer:
            if coarse.values is None or fine.values is None or difference(fine.values, coarse.values)[0] == "same":
                continue
            apart = np.abs(coarse.values - fine.values)
            both = np.isfinite(apart)
            half = 0.5 * _LITTLE * (digits[coarse.index] + digits[fine.index])
            if np.count_nonzero(both) < _FEWEST or np.any(apart[both] > half):
                continue
            name, other = sheet.names[fine.index], sheet.names[coarse.index]
            unread[coarse.index] = f'{_SAME} as "{name}", rounded more coarsely'
            notes.append(f'{in_words(quantity)} is taken from "{name}"; "{other}" is the same, rounded more coarsely')
            break
    return [c for c in candidates if c.index not in unread], tuple(notes)


def _last_digit(sheet: Sheet, candidate: PossibleColumn, reading: Reading) -> float:
    """What the last written digit of a column counts, in SI; 0 where that is not told, as of numbers with exponents."""
    fault, factor = unit_of_column(sheet, candidate.index, candidate.heading, reading)
    cells = [cell.strip() for cell in sheet.columns[candidate.index] if cell.strip()]
    decimals = [match["decimals"] for cell in cells if (match := _WRITTEN.fullmatch(cell)) is not None]
    if fault is not None or not decimals or 2 * len(decimals) < len(cells):
        return 0.0
    return float(abs(factor) * 10.0 ** -max(map(len, (part or "" for part in decimals))))


def _is_another_clock(day: PossibleColumn, plain: PossibleColumn) -> bool:
    """Whether a time of day runs otherwise than a time in seconds, by more than either is written to."""
    if day.values is None or plain.values is None:
        return False
    apart = day.values - plain.values
    there = np.isfinite(apart)
    if np.count_nonzero(there) < _FEWEST:
        return False
    steps = np.diff(day.values[there])
    coarse = float(np.min(steps[steps > 0], initial=np.inf))
    span = float(np.ptp(plain.values[there]))
    drift = float(np.ptp(apart[there]))
    return drift > _OTHER_CLOCK * span and (not np.isfinite(coarse) or drift > 1.5 * max(coarse, 1.0))


def _may_differ_by_zero(quantity: str, best: Heading, other: Heading) -> bool:
    """Whether two columns may be one reading with two zeros: no capacitance, two clocks, or two channels of one name."""
    if quantity.startswith("capacitance"):
        return False
    plain = quantity != "time" or (best.rank < PLAIN and other.rank < PLAIN)
    return plain and best.index == other.index and best.name != other.name


def _hardly_moves(one: PossibleColumn, other: PossibleColumn) -> bool:
    """Whether a column only has noise beside another: an instrument that was not used."""
    if one.values is None or other.values is None or not (np.isfinite(one.values).any() and np.isfinite(other.values).any()):
        return False
    spans = [float(np.nanmax(v) - np.nanmin(v)) for v in (one.values, other.values)]
    return spans[0] < _NOISE * spans[1]


def _is_worked_on(raw: PossibleColumn, other: PossibleColumn) -> bool:
    """Whether a column may be the raw one with another zero and without its noise, and is not called a second one."""
    if raw.values is None or other.values is None or other.heading.index or other.heading.name == raw.heading.name:
        return False
    return but_for_zero(raw.values, other.values) <= _SMOOTHED


def _is_corrected(quantity: str, raw: PossibleColumn, other: PossibleColumn, word: str) -> bool:
    """Whether a column is the raw one once corrected: of a capacitance by its level, of others by more than zero and noise."""
    if not any(w in CORRECTED for w in re.split(r"[^\w]+|_", other.heading.name)) or raw.values is None or other.values is None:
        return False
    if quantity.startswith("capacitance"):
        return True
    apart = word == "different" and but_for_zero(raw.values, other.values) > _SMOOTHED
    return apart and moves_with(raw.values, other.values)


def _begins_anew(candidate: PossibleColumn) -> bool:
    return candidate.values is not None and goes_back(candidate.values)


def _beside(sheet: Sheet, quantity: str, best: PossibleColumn, others: Sequence[PossibleColumn], asked_index: str) -> Remarks:
    """What is to be said of columns beside the one that is read: they are the same, they are less, or they are a choice."""
    name = sheet.names[best.index]
    unread: dict[int, str] = {}
    notes: list[str] = []
    rivals: list[PossibleColumn] = []
    shares: dict[int, float] = {}
    differences: dict[int, str] = {}
    for other in others:
        index, heading = other.index, other.heading
        word, share = ("different", 1.0)
        if other.values is not None and best.values is not None:
            word, share = difference(best.values, other.values)
        elif best.values is not None and not sheet.unit_written(index) and _same_cells(sheet, index, best.index):
            word, share = ("same", 0.0)  # the same numbers, once without a unit
        differences[index] = _apart(quantity, best, other, word, share)
        alike = sheet.names[index] == name and sheet.unit_below(index) == sheet.unit_below(best.index)
        if alike and share > 0.0:
            word = "different"  # two columns of one name and unit are the same or not
        shares[index] = share
        less = heading.processed > best.heading.processed and not _hardly_moves(best, other)
        less |= quantity == "force" and best.heading.name.startswith("raw") and _is_worked_on(best, other)
        numbered = bool(heading.index) and heading.index != best.heading.index and (not best.heading.index or asked_index)
        numbered = numbered and not _hardly_moves(best, other)
        # Of a second time that runs the columns may be of the other instrument; "T_C" in degrees hardly does.
        second = quantity == "time" and word == "different" and _of_two_instruments(sheet) and _runs(sheet, other)
        numbered = numbered and not second
        # Of two columns of one name and unit no difference is a matter of rounding.
        converted = sheet.unit_below(index) != sheet.unit_below(best.index)
        if word == "same" and (share <= _EXACT or converted or words(sheet.names[index]) != words(name)):
            within = f", within {100 * share:.1g} % of their span" if share > _EXACT else ""
            unread[index] = f'the same readings as "{name}"{within}'
        elif quantity not in _DECISIVE:
            unread[index] = f'another column of the {in_words(quantity)}: "{name}" is preferred'
        elif quantity == "time" and heading.name != best.heading.name and _begins_anew(other) and not _begins_anew(best):
            unread[index] = f'begins anew within the record: "{name}" is preferred'
            notes.append(f'time is taken from "{name}", not from "{sheet.names[index]}", which begins anew within the record')
        elif less and not _is_corrected(quantity, best, other, word):
            why = f"; {_RAW}" if quantity == "force" else ""
            unread[index] = f'worked on after the measurement: "{name}" is preferred{why}'
            notes.append(f'{in_words(quantity)} is taken from "{name}", not from "{sheet.names[index]}"{why}')
        elif word in ("zero", "sign") and _may_differ_by_zero(quantity, best.heading, heading):
            more = f", and by {100 * share:.1g} % of their span" if share > _CONSTANT else ""
            unread[index] = f'the same readings as "{name}" but for their {word}{more}: "{name}" is preferred'
            notes.append(
                f'{in_words(quantity)} is taken from "{name}", not from "{sheet.names[index]}", which differs by its '
                f"{word}{more}"
            )
        elif numbered:
            unread[index] = f'another {in_words(quantity)} column: "{name}" is preferred'
            notes.append(
                f'{in_words(quantity)} is taken from "{name}", not from "{sheet.names[index]}", which holds other readings: '
                f"{Choice('columns', (sheet.name_for_asking(index),), quantity)} if that is meant"
            )
        else:
            rivals.append(other)
    same = [i for i, why in unread.items() if why.startswith("the same readings") and "but for" not in why]
    if same:
        twins = [i for i in same if sheet.names[i] == name]
        if twins:
            notes.append(f'"{name}" stands {len(twins) + 1} times with the same values')
        listed = ", ".join(f'"{sheet.names[i]}"' for i in same if i not in twins)
        if listed:
            far = max(shares[i] for i in same if i not in twins)
            within = f" within {100 * far:.1g} % of their span" if far > _EXACT else ""
            notes.append(f'{in_words(quantity)} is taken from "{name}"; {listed} agrees with it{within}')
    return Remarks(unread, tuple(notes), tuple(_choice_of(sheet, quantity, best, rivals, differences)))


def _runs(sheet: Sheet, other: PossibleColumn) -> bool:
    """Whether the numbers of a column go up from row to row, as those of a clock do."""
    values = _readings_alone(sheet, other.index) if other.values is None else other.values
    steps = np.diff(values[np.isfinite(values)])
    return steps.size > 0 and not np.any(steps < 0) and float(np.mean(steps > 0)) >= _MOSTLY


def _same_cells(sheet: Sheet, one: int, other: int) -> bool:
    return list(sheet.columns[one]) == list(sheet.columns[other])


def _of_two_instruments(sheet: Sheet) -> bool:
    return _has(sheet, "capacitance") and (_has(sheet, "force") or _has(sheet, "displacement"))


def _has(sheet: Sheet, quantity: str) -> bool:
    return any(stands_for(h.quantity) == quantity for h in sheet.headings.values())


def other_clock(sheet: Sheet, asked: int, reading: Reading) -> Remarks:
    """What is to be said where the user names the time, and another instrument's time stands in the file too.

    Parameters
    ----------
    sheet : the record.
    asked : index of the column of the time that the user names.
    reading : what the user says of the file.
    """
    own = sheet.plain_heading(asked)
    said = {stands_for(q) for q in reading.columns}
    if own.quantity != "time" or not _of_two_instruments(sheet) or said >= {"force", "displacement"} or "capacitance" in said:
        return Remarks()
    for index in range(len(sheet.names)):
        heading = sheet.plain_heading(index)
        if index == asked or index in sheet.set_aside or heading.quantity != "time" or max(own.rank, heading.rank) < PLAIN:
            continue
        one, other = (
            c.values for c in _with_values(sheet, [PossibleColumn(asked, own), PossibleColumn(index, heading)], reading)
        )
        if one is None or other is None or difference(one, other)[0] != "different":
            continue
        without = Choice("columns", ("none",), "capacitance")
        message = f'"{sheet.names[asked]}" and "{sheet.names[index]}" are two clocks: what was read at the one is open'
        press = " ".join(str(Choice("columns", ("none",), q)) for q in ("displacement", "force"))
        advice = f"Leave out what was not: {without}, or {press}; or save the records of two instruments as two files"
        return Remarks(faults=(Fault(message, sheet.text.path, sheet.named_at, index + 1, advice=advice, choice=without),))
    return Remarks()


def _choice_of(
    sheet: Sheet, quantity: str, best: PossibleColumn, rivals: Sequence[PossibleColumn], differences: Mapping[int, str]
) -> list[Fault]:
    """The fault of columns of which the user must choose one."""
    if not rivals:
        return []
    all_of = [best, *rivals]
    more = _also_in_its_unit(sheet, quantity, {c.index for c in all_of})
    choice: Choice | None = Choice(
        "columns", tuple(sheet.name_for_asking(i) for i in (*(c.index for c in all_of), *more)), quantity
    )
    advice = f"Say which one is meant: {choice}"
    blocks = blocks_of_clocks(sheet, sheet.columns) if quantity == "time" else ()
    if blocks:
        advice, choice = choice_of_clock(sheet, blocks)
    elif quantity == "time" and _of_two_instruments(sheet) and not _has(sheet, "displacement"):
        # A load alone is no press: without the capacitance nothing is left.
        advice = f"If the rows of both are of one time, say which one is meant: {choice}"
    elif quantity == "time" and _of_two_instruments(sheet):
        advice = (
            "Save the records of two instruments as two files, or leave out what was not read at the time that is meant: "
            f"--columns capacitance=none, and {advice[0].lower()}{advice[1:]}"
        )
    line, first = sheet.named_at, rivals[0]
    twice = [c for c in rivals if sheet.names[c.index] == sheet.names[best.index]]
    if len(twice) == len(rivals):
        message = f'column "{sheet.names[best.index]}" appears twice (columns {best.index + 1} and {first.index + 1})'
    else:
        listed = ", ".join(f'"{sheet.names[c.index]}"' for c in all_of[:40])
        apart = differences[first.index] if len(rivals) == 1 else ""
        unknown = [f'"{sheet.names[c.index]}"' for c in all_of if c.values is None]
        differ = f"and {unknown[0]} has no unit that is known" if unknown else f"and they differ{apart}"
        message = f"{len(all_of)} columns may be the {in_words(quantity)}, {differ}: {listed}"
        message += f'; "{sheet.names[more[0]]}" moves, too, and is not understood' if more else ""
    return [Fault(message, sheet.text.path, line, first.index + 1, advice=advice, choice=choice)]


def _also_in_its_unit(sheet: Sheet, quantity: str, known: Collection[int]) -> list[int]:
    """The columns that are not understood, move, and are in a unit of a quantity: one may be the sum or mean of the others."""
    return [
        i
        for i, name in enumerate(sheet.names)
        if i not in known
        and i not in sheet.set_aside
        and is_unit_of(sheet.unit_written(i) or "?", quantity)
        and why_unread(name, sheet.unit_below(i)) == "not understood"
        and not stands_still(_readings_alone(sheet, i))
    ]


def _apart(quantity: str, best: PossibleColumn, other: PossibleColumn, word: str, share: float) -> str:
    """By what two columns differ, behind "they differ": their zero, their sign, or so much of their span beside these."""
    if best.values is None or other.values is None:
        return ""
    if word in ("zero", "sign"):
        # Clocks of different rates, and readings of which one is scaled by a little, are apart by more than a constant.
        more = f", but for {100 * share:.2g} % of their span" if share > _CONSTANT else ""
        return f" by a constant{more}" if word == "zero" else f" by their sign{more}"
    but = ""
    if not quantity.startswith("capacitance"):
        spans = [float(np.ptp(v[np.isfinite(v)])) if np.isfinite(v).any() else 0.0 for v in (best.values, other.values)]
        zeroed = min(but_for_zero(best.values, sign * other.values) for sign in (1, -1))
        zeroed *= max(spans) / spans[0] if spans[0] else np.inf
        but, share = (" but for their zero and sign", zeroed) if zeroed < 0.5 * share else ("", share)
    percent = 100 * min(share, 9.99)
    return f" by up to {f'{percent:.0f}' if percent >= 10 else f'{percent:.2g}'} % of their span{but}"

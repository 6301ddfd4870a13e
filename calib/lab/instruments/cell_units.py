"""From a `Sheet` to the same with plain numbers where its cells show the unit: "97.1 pF", times since 1970."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from calib.errors import Choice, Fault, InputError
from calib.lab.instruments.clock_cells import is_clock
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.numbers import SIGNS, SPACES, is_missing, is_numeric, is_over_range, not_numbers, to_numbers
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.together import unit_in
from calib.lab.instruments.unit_cells import same_word_behind, unit_behind_factor
from calib.lab.instruments.unit_choice import written_unit
from calib.lab.instruments.units import RECORDED, SI_UNIT, asked_factor, is_unit_of, lab_factor, stands_for
from calib.lab.instruments.vocabulary import Heading, heading_as, understand

# Cells that show whether a column is one of plain numbers.
_SEEN, _SEEN_OF_TIME = 50, 2000
# One way of writing has so many cells at least, and this share of all: fewer may be damaged.
_FEWEST, _SHARE = 3, 0.02
# A number, and letters or a sign behind it.
_WITH_UNIT = re.compile(
    rf"(?P<number>[{SIGNS}]?[\d.,{SPACES}]*\d[.,]?(?:[eE][{SIGNS}]?\d+)?) ?"
    r"(?P<unit>[^\W\d_]{1,12}|[%‰])(?P<good> (?:ok|OK|Ok|good|valid|stable))?"
)
# A number and how far it may be off: "97.000 ± 0.002"; and the name of its column before a number: "CP 9.7E-11".
_READING = rf"(?P<number>[{SIGNS}]?(?:\d[\d.,]*|[.,]\d+)(?:[eE][{SIGNS}]?\d+)?)"
_OFF_BY = re.compile(rf"{_READING}\s?(?:±|\+/-)\s?\d[\d.,]*(?:[eE][{SIGNS}]?\d+)?")
_NAMED = re.compile(rf"(?P<name>[^\W\d_]{{1,5}})\s*[ =:]\s*{_READING}")
# A net or gross weight as balances print it, "N +     0.07 g": its sign stands apart.
_OF_BALANCE = re.compile(
    r"\s*(?P<said>N|G|NET|Net|Gross|GROSS|NT|GS)?\s*(?P<sign>[-+])\s*(?P<number>\d[\d.,]*)(?P<unit>\s*[^\W\d_]{0,4})\s*"
)
# What a meter says of a reading that is good, where no unit stands before it.
_GOOD = ("ok", "good", "valid", "stable")
# Prefixes that stand alone behind a number, as engineers write it: "97.0p", of a capacitance and what has no unit but one.
_OF_FARAD, _OF_ONE_UNIT = "fpnuµμ", ("capacitance", "capacitance_series", "dissipation", "quality", "frequency")
_USUAL_MINUS = str.maketrans("\u2212\u2013", "--")
_PREFIXES = {"f": -15, "p": -12, "n": -9, "u": -6, "µ": -6, "μ": -6, "m": -3, "k": 3, "M": 6}
# Seconds since 1970 of the years 2010 to 2036, the units in which they are counted, and the steps of a press [s]: a counter
# of milliseconds since the logger was switched on would go in larger ones if it were seconds.
_NOW, _COUNTED, _LARGEST_STEP = (1.26e9, 2.1e9), {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}, 2.0


def with_plain_cells(sheet: Sheet, reading: Reading) -> Sheet:
    """Take units and prefixes off the numbers of columns that are understood, and say so.

    A cell is read by the unit that stands in it. Where a cell holds something else, or a unit that is none of the column's, the
    column stays as it is, as it does where few cells have one.

    Parameters
    ----------
    sheet : the record.
    reading : what the user says of the file.

    Returns
    -------
    The sheet with numbers, the units of cells and of times since 1970 as if they stood below the names, and notes.

    Raises
    ------
    InputError
        If a cell has no unit where nearly all others have one, or units are no powers of ten apart.
    """
    columns, units, notes = list(sheet.columns), dict(enumerate(sheet.units)), list(sheet.notes)
    for index, cells in enumerate(columns):
        name = sheet.names[index] if index < len(sheet.names) else ""
        if (plain := _without_beside(cells, name)) is not None:
            columns[index], what = plain
            notes.append(f'"{name}": {what} each number is passed by')
        if (weights := _of_balance(cells)) is not None:
            columns[index] = weights
            first = next(cell for cell in cells if cell.strip()).strip()
            notes.append(f'"{name}": the weights of a balance are read with the sign that stands apart, as in "{first}"')
    sheet = replace(sheet, columns=tuple(columns), notes=tuple(notes))
    for index, heading in {**sheet.headings, **_by_cells(sheet)}.items():
        if not 0 <= index < len(columns) or heading.quantity == "status":
            continue
        asked = reading.units.get(heading.quantity, reading.units.get(stands_for(heading.quantity), ""))
        written = written_unit(sheet, index, heading)
        name = sheet.names[index] or f"column {index + 1}"
        found = _without_units(columns[index], heading, asked or written, said=bool(asked))
        if found is not None and (fault := _refusal(sheet, index, heading, found, said=bool(asked))) is not None:
            raise InputError(fault)
        passed = same_word_behind(columns[index]) if found is None and asked else ""
        if passed and passed not in _PREFIXES and not is_unit_of(passed, heading.quantity):
            columns[index] = [cell.strip().removesuffix(passed).rstrip() for cell in columns[index]]
            notes.append(f'"{name}": "{passed}" behind its numbers is passed by, as their unit was said')
        if found is not None:
            columns[index] = found.cells
            units[index] = found.unit or units.get(index, "")
            if said := _says_good(sheet.columns[index]):
                notes.append(f'"{name}": "{said}" behind its readings says that they are good, and is passed by')
            if found.seen != ("none",):
                notes.append(f'"{name}": each number is read in the unit that stands behind it ({", ".join(found.seen)})')
        if heading.quantity == "time" and not (asked or written or heading.unit_doubt):
            unit = _since_1970(columns[index], sheet.declared_decimal)
            if unit:
                units[index] = unit
                notes.append(f'"{name}" has no unit: the time is taken as {_WORDS[unit]} since 1970, which its numbers count')
    below = tuple(units.get(index, "") for index in range(len(sheet.names))) if any(units.values()) else sheet.units
    return replace(sheet, columns=tuple(columns), units=below, notes=tuple(notes))


def _without_beside(cells: Sequence[str], name: str) -> tuple[list[str], str] | None:
    """The cells without how far each may be off, or without the name of the column before each, and what that is; else None."""
    first = next((cell.strip() for cell in cells[:_SEEN] if cell.strip()), "")
    form = next((form for form in (_OFF_BY, _NAMED) if form.fullmatch(first) is not None), None)
    if form is None:
        return None
    found = [form.fullmatch(cell.strip()) for cell in cells]
    others = [cell for cell, match in zip(cells, found, strict=True) if match is None]
    if not all(is_missing(cell) or is_over_range(cell) for cell in others):
        return None
    plain = [cell if match is None else match["number"] for cell, match in zip(cells, found, strict=True)]
    if form is _OFF_BY:
        return plain, "how far it may be off behind"
    words = {match["name"].lower() for match in found if match is not None}
    headings = [understand(word) for word in (*words, name)]
    alike = len(words) == 1 and None not in headings and len({h.quantity for h in headings if h is not None}) == 1
    return (plain, f'the name "{words.pop()}" before') if alike else None


def _of_balance(cells: Sequence[str]) -> list[str] | None:
    """The cells with each sign at its number, where all are weights as balances print them; None of any others."""
    first = next((match for cell in cells[:_SEEN] if cell.strip() and (match := _OF_BALANCE.fullmatch(cell)) is not None), None)
    if first is None or not (first["said"] or first["sign"] + first["number"] not in first[0]):
        return None
    found = [_OF_BALANCE.fullmatch(cell) if cell.strip() else None for cell in cells]
    if any(match is None or match["said"] != first["said"] for match, cell in zip(found, cells, strict=True) if cell.strip()):
        return None
    return [f"{match['sign']}{match['number']}{match['unit']}" if match is not None else "" for match in found]


def _by_cells(sheet: Sheet) -> dict[int, Heading]:
    """The columns whose names are understood by the unit that stands in their cells, or are a letter."""
    found: dict[int, Heading] = {}
    for index, name in enumerate(sheet.names[: len(sheet.columns)]):
        if not name or {index} & {*sheet.assigned, *sheet.set_aside} or sheet.unit_below(index):
            continue
        first = next((match for cell in sheet.columns[index][:_SEEN] if (match := _WITH_UNIT.fullmatch(cell.strip()))), None)
        unit = (
            first["unit"] if first is not None else unit_behind_factor(sheet.columns[index][0] if sheet.columns[index] else "")
        )
        of = next((quantity for quantity in RECORDED if unit and is_unit_of(unit, quantity)), "")
        heading = understand(name, unit) if of else None
        if unit in _OF_FARAD and understand(name) is None and (symbol := understand(name, "F")) is not None:
            found |= {index: symbol} if symbol.quantity == "capacitance" else {}
            continue
        # A word that is not understood may be a setting, "1 nF" of a range.
        if of and understand(name) is None and unit_in(name) in ("", name) and (heading is not None or len(name) == 1):
            found[index] = heading if heading is not None else heading_as(of, name, unit)
    return found


def _says_good(cells: Sequence[str]) -> str:
    """The word by which cells say that their readings are good; "" if they have none."""
    match = next((m for cell in cells[:_SEEN] if (m := _WITH_UNIT.fullmatch(cell.strip()))), None)
    if match is None:
        return ""
    return (match["good"] or "").strip() or (match["unit"] if match["unit"].lower() in _GOOD else "")


def _enough(n_cell: int) -> float:
    """How many cells must be written in a way that is no damage."""
    return max(_FEWEST, _SHARE * n_cell)


# What no unit is written with.
_NO_UNIT = b"0123456789.,;:+-*#/ \t"
_WORDS = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}


@dataclass(frozen=True)
class _Plain:
    """Cells as numbers in one unit, that unit, "" where it is the written one, the units that stand in cells, and what was odd.

    `bare` is the first cell without a unit among few that have none, beside others that have one; `apart` are two units in
    cells that differ by no power of ten; `against` is the unit that the header has or the user says, where all have another.
    """

    cells: Sequence[str]
    unit: str
    seen: tuple[str, ...]
    bare: str = ""
    apart: tuple[str, ...] = ()
    against: str = ""


def _without_units(cells: Sequence[str], heading: Heading, written: str, *, said: bool) -> _Plain | None:
    """The cells as numbers in one unit; None if all are plain numbers, or one cannot be told.

    Where most cells have a unit of the quantity, as of a meter that changes its range, so may few have another one; what else
    few cells hold is left as it stands, to be refused by itself.
    """
    first = list(islice((c for c in cells if c.strip() and not is_missing(c) and not is_over_range(c)), _SEEN))
    if all(is_numeric(cell) or is_clock(cell) for cell in first) and not _some_with_unit(cells):
        return None
    matches: dict[str, tuple[str, str]] = {}
    written_so: Counter[str] = Counter()
    n_cell = n_odd = 0
    for cell, count in Counter(cells).items():
        if not cell.strip() or is_missing(cell) or is_over_range(cell):
            continue
        n_cell += count
        match = _WITH_UNIT.fullmatch(cell.strip())
        if match is None and not is_numeric(cell):
            n_odd += count
            continue
        unit = "" if match is None or match["unit"].lower() in _GOOD else match["unit"]
        matches[cell] = (match["number"] if match is not None else cell, unit)
        written_so[matches[cell][1]] += count
    own = {word for word in written_so if word and _is_its_unit(word, heading.quantity, written_so)}
    most = 2 * sum(written_so[word] for word in own) > n_cell
    few = {word for word, count in written_so.items() if count < _enough(n_cell)}
    odd = {word for word in few - own if word}
    if (
        not written_so
        or (few and not most)
        or (n_odd + sum(written_so[word] for word in odd) >= (_enough(n_cell) if most else 1))
    ):
        return None
    seen = sorted(written_so.keys() - odd)
    if "" in few and not written:
        bare = next(cell for cell, (_, unit) in matches.items() if not unit)
        return _Plain(cells, "", (max(own, key=lambda word: written_so[word]),), bare=bare)
    powers = _powers(heading.quantity, seen, written, said=said)
    if powers is None:
        apart = _apart([word for word in seen if word in own], heading.quantity) if most else ()
        against = written if most and len(seen) == 1 and seen[0] not in _PREFIXES else ""
        return _Plain(cells, "", tuple(seen), apart=apart, against=against) if apart or against else None
    unit, power = powers
    plain = {cell: _times_ten(number, power[own]) for cell, (number, own) in matches.items() if own in power}
    return _Plain([plain.get(cell, cell) for cell in cells], unit, tuple(own or "none" for own in seen))


def _is_its_unit(word: str, quantity: str, words: Collection[str]) -> bool:
    """Whether a word behind numbers is a unit of their quantity, or a prefix as all others are, where there is but one."""
    prefixes = quantity in _OF_ONE_UNIT and all(not other or other in _PREFIXES for other in words)
    return prefixes or is_unit_of(word, quantity)


def _times_ten(number: str, power: int) -> str:
    """A number as written, with a power of ten behind it."""
    if not power:
        return number
    mantissa, _, exponent = number.lower().partition("e")
    return f"{mantissa}e{power + int(exponent.translate(_USUAL_MINUS) or 0)}"


def _apart(own: Sequence[str], quantity: str) -> tuple[str, ...]:
    """Two units that differ by no power of ten; none if all do."""
    for other in own[1:]:
        exponent = math.log10(lab_factor(other, quantity) / lab_factor(own[0], quantity))
        if not math.isclose(exponent, round(exponent), abs_tol=1e-9):
            return own[0], other
    return ()


def _refusal(sheet: Sheet, index: int, heading: Heading, plain: _Plain, *, said: bool) -> Fault | None:
    """The fault of cells without a unit among others that have one, or of units that contradict; None where there is none."""
    name, quantity = sheet.names[index] or f"column {index + 1}", stands_for(heading.quantity)
    choice: Choice | None = Choice("units", plain.seen[:1], quantity)
    if plain.bare:
        cell = plain.bare
        message = "has no unit behind it, as nearly all other cells have"
        advice = f"Write it there, or empty the cell to leave the row out; if it is in {plain.seen[0]}, say so: {choice}"
    elif plain.apart:
        one, other = plain.apart
        cell = next(c for c in sheet.columns[index] if (m := _WITH_UNIT.fullmatch(c.strip())) and m["unit"] == other)
        message, choice = f"is in {other}, and other cells are in {one}", None
        advice = "Write all of them in one unit, or empty the cells in the other one to leave their rows out"
    elif plain.against:
        cell = next(c for c in sheet.columns[index] if _WITH_UNIT.fullmatch(c.strip()))
        message = f"as all other cells is in {plain.seen[0]}, not in {plain.against} as {'asked' if said else 'its name says'}"
        advice = f"If the cells are right, say so: {choice}; else take the unit out of the cells"
    else:
        return None
    row = list(sheet.columns[index]).index(cell)
    message = f'"{cell.strip()}" in column "{name}" {message}'
    return Fault(message, sheet.text.path, int(sheet.lines[row]), index + 1, advice=advice, choice=choice)


def _some_with_unit(cells: Sequence[str]) -> bool:
    """Whether a unit stands in some cells of a column of numbers, behind the first."""
    joined = "".join(cells)
    if joined.isascii() and not joined.encode().translate(None, _NO_UNIT):
        return False  # as is told at once
    return any(_WITH_UNIT.fullmatch(cells[r].strip()) for r in (not_numbers(cells, len(cells)) or [])[:_SEEN])


def _powers(quantity: str, seen: Sequence[str], written: str, *, said: bool) -> tuple[str, dict[str, int]] | None:
    """The unit below the name, "" where one is written, and by which power of ten each unit in cells differs from it.

    Where the user said the unit, "m" behind all numbers is milli of mm, and the metre of m.
    """
    if not written and quantity in _OF_ONE_UNIT and any(seen) and all(not word or word in _PREFIXES for word in seen):
        return SI_UNIT[quantity], {word: _PREFIXES.get(word, 0) for word in seen}
    own = [unit for unit in seen if unit and is_unit_of(unit, quantity)]
    try:
        factor = asked_factor(written, quantity) if written else 0.0
    except ValueError:
        return None
    if not written and (len(own) < len(seen) or not own):
        return None
    # Of one unit in all cells that is not the written one, none is right.
    if said and own == ["m"] == list(seen) and factor in (1.0, 1e-3):
        return "", {"m": 0}
    if written and len(seen) == 1 and own and factor not in (1.0, lab_factor(own[0], quantity)):
        return None
    unit = "" if written else own[0] if len(own) == 1 else SI_UNIT[quantity]
    factor = factor or lab_factor(unit, quantity)
    power: dict[str, int] = {}
    for word in seen:
        if word in own and not (word in _PREFIXES and written):
            exponent = math.log10(lab_factor(word, quantity) / factor)
        elif word in _PREFIXES and word not in own and factor in (1.0, 10.0 ** _PREFIXES[word]) and SI_UNIT[quantity]:
            exponent = _PREFIXES[word] if factor == 1.0 else 0.0
        elif not word:
            exponent = 0.0
        else:
            return None
        if not math.isclose(exponent, round(exponent), abs_tol=1e-9):
            return None
        power[word] = round(exponent)
    return unit, power


def _since_1970(cells: Sequence[str], decimal: str) -> str:
    """The unit in which times are counted since 1970; "" if they are not, or go on in other steps than readings of a press."""
    numbers = to_numbers([c.strip() for c in cells[:_SEEN_OF_TIME]], decimal or ".").values
    there = numbers[np.isfinite(numbers)]
    steps = np.diff(there)
    if there.size < 2 or not np.any(steps > 0):
        return ""
    for unit, size in _COUNTED.items():
        pace = float(np.median(steps[steps > 0])) * size
        if _NOW[0] < float(there.min()) * size and float(there.max()) * size < _NOW[1] and pace <= _LARGEST_STEP:
            return unit
    return ""

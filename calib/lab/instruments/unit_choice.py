"""From a column of a `Sheet` to the factor that makes SI of it, wherever its unit stands, and to how people know the column."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.contrary import names_quantity, unit_against
from calib.lab.instruments.header import split_line
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.numbers import is_missing, is_numeric, parse_number
from calib.lab.instruments.rivals import readings
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.stated import what_is_stated
from calib.lab.instruments.units import (
    as_force,
    asked_factor,
    is_mass,
    is_unit_of,
    lab_factor,
    may_be_meant,
    stands_for,
    usual_units,
)
from calib.lab.instruments.vocabulary import EXAMPLE, NEEDS_UNIT, Heading, unit_of_normal_force

# Units in which labs have a quantity, the likeliest first: what a column without one may be in.
_USUAL = {
    "time": ("s", "ms", "min", "h"),
    "displacement": ("mm", "um", "m", "in"),
    "force": ("N", "mN", "kN", "kgf", "lbf"),
    "capacitance": ("pF", "nF", "fF", "F"),
}


# Cells of a time of which none is a number: no unit makes one of them.
_SEEN = 50


# A date and a time of day to the minute: "11.02.2026 14:03".
_TO_THE_MINUTE = re.compile(
    r"(?:\d{1,2}[-./]\d{1,2}[-./](?:\d{2}|\d{4})|\d{4}[-./]\d{1,2}[-./]\d{1,2})[ T]\d{1,2}:\d{2}(?:\s?[ap]m)?", re.IGNORECASE
)


# What a line states of readings -> what these may be, and how their unit settles it.
_STATED = {
    "a factor": ("may have been multiplied by it, or have to be", "with the factor that makes it right, or the unit alone"),
    "an offset": ("may hold it already, or not yet", "alone"),
    "counts": ("may be these, in no unit", "that one of them is worth, or the unit alone"),
}


def _asked_unit(quantity: str, reading: Reading) -> str | None:
    return reading.units.get(quantity, reading.units.get(stands_for(quantity)))


def unit_of_column(sheet: Sheet, index: int, heading: Heading, reading: Reading) -> tuple[Fault | None, float]:
    """The factor from a column's unit to SI, wherever the unit stands: said by the user, in the name, below it, or above.

    Parameters
    ----------
    sheet : the record.
    index, heading : which of its columns, and what it holds.
    reading : what the user says of the file.

    Returns
    -------
    The fault of a unit that is missing, unknown or contradicted, or None; and the factor, 1 with a fault.
    """
    quantity = heading.quantity
    name, below = sheet.names[index], sheet.unit_below(index)
    of_index = unit_in_index(sheet, index)
    inside = heading.unit or of_index
    declared, declared_line = sheet.declared_units.get(stands_for(quantity), ("", 0))
    line = sheet.units_line if below and sheet.units_line is not None else sheet.named_at
    asked = _asked_unit(quantity, reading)

    def fault(message: str, advice: str, choice: Choice | None = None) -> tuple[Fault, float]:
        return Fault(message, sheet.text.path, line or None, index + 1, advice, choice), 1.0

    shown = stands_for(quantity)
    any_usual = Choice("units", _USUAL[shown], shown) if shown in _USUAL else None
    listed = units_to_say(quantity)
    example = f'Write it into the header, for example "{EXAMPLE[quantity]}", or say it: {listed}'
    if asked is not None:
        try:
            return None, asked_factor(asked, quantity)
        except ValueError as error:
            return fault(f"the unit asked for: {error}", f"Say {listed}")
    if of_index and not below:
        others = f"two units, as other names end in theirs: {of_index} and {inside}"
        either = Choice("units", (inside, of_index), shown)
        return fault(f'column "{name}" may have {others}', f"Say which is right: {either}", either)
    if heading.unit_doubt:
        how = "the unit with the factor that makes it right" if "factor" in heading.unit_doubt else "the right one"
        return fault(f'column "{name}": {heading.unit_doubt}', f"Correct the header, or say {how}: {listed}")
    factor = _factor_beside(sheet, quantity)
    if factor is not None and not after_raw_counts(sheet, index, heading):
        words, line, what = " ".join(factor[0].split()), factor[1], what_is_stated(factor[0])
        may, way = _STATED[what]
        other = "; else write them as they have to be, and take the line out" if what == "an offset" else ""
        return fault(
            f'"{words}" states {what}: the readings of column "{name}" {may}',
            f"Say the unit {way} if they are right: {listed}{other}",
        )
    scaled = [s for s in sheet.scalings.get(index, ()) if s.value != (0 if s.kind == "offset" else 1)]
    if scaled:
        line = scaled[0].line
        stated = " and ".join(s.says for s in scaled)
        way = "Say the unit with the factor that makes it right, or the unit alone"
        if any(s.kind == "offset" for s in scaled):
            way = "Write the readings as they have to be, and empty the number, or say the unit alone"
        return fault(
            f'{stated}: the readings of column "{name}" may hold this already, or have to be changed by it yet',
            f"{way} if they are right: {listed}",
        )
    said = [unit for unit in (inside, below, declared) if unit]
    words = next((c.strip() for c in sheet.columns[index] if c.strip() and not is_missing(c)), "") if not said else ""
    if quantity == "time" and _TO_THE_MINUTE.fullmatch(words):
        return fault(
            f'column "{name}": "{words}" has no seconds: rows of one minute are not told apart',
            "Export the times with their seconds (a spreadsheet program: show them as yyyy-mm-dd hh:mm:ss.000, save again)"
            ", or leave the time out: --columns time=none",
        )
    if quantity == "time" and words and not any(map(is_numeric, sheet.columns[index][:_SEEN])):
        return fault(
            f'column "{name}" holds no times that are understood: "{words[:40]}"',
            'Write them as "2024-05-02 12:30:01.5" or in seconds, or leave the time out: --columns time=none',
        )
    if not said and (counted := counted_unit(name, quantity)):
        return fault(
            f'column "{name}": "{counted}" may be what one count stands for, or how far the instrument reaches',
            f'If one count is so much, say so: --units "{shown}={counted}"; else {listed}',
        )
    if not said:
        needed = quantity in (*NEEDS_UNIT, "frequency")
        # A letter alone may be anything, as C a cycle; a press is one without it.
        beside = {sheet.plain_heading(i).quantity for i in range(len(sheet.names))} if heading.letter else set()
        optional = shown == "capacitance" and "force" in beside
        without = f"; if it is none, leave it out: {Choice('columns', ('none',), shown)}" if optional else ""
        return fault(f'column "{name}" has no unit', f"{example}{without}", any_usual) if needed else (None, 1.0)
    try:
        factors = [lab_factor(unit, quantity) for unit in said]
    except ValueError as error:
        meant = next((m for unit in said if not is_unit_of(unit, quantity) and (m := may_be_meant(unit, quantity))), ())
        which = Choice("units", meant, shown) if meant else None
        return fault(f'column "{name}": {error}', f"If so, say it: {which}; else {listed}" if which else example, which)
    if len(set(factors)) > 1 and inside and below and factors[0] != factors[1]:
        above = sheet.units_line is not None and sheet.units_line < sheet.header_line
        where = f"above it, declared in line {sheet.units_line}" if above else "below it"
        both = Choice("units", (below, inside), shown) if of_index else None
        return fault(
            f'column "{name}" has the unit "{inside}" in its name and "{below}" {where}',
            f"Correct one of the two, or say: {both or listed}",
            both,
        )
    if len(set(factors)) > 1:
        own = dict(sheet.in_every_row).get(declared_line) or sheet.text.lines[declared_line - 1]
        shown_line = " ".join(own.split())[:60]
        return fault(
            f'column "{name}" has the unit "{said[0]}" and "{declared}" is declared in line {declared_line} ("{shown_line}")',
            f"Correct one of the two, or say which is right: {listed}",
        )
    contrary = words_against(sheet, index, quantity, factors[0])
    if contrary is not None:
        words, line, unit = contrary
        which = Choice("units", tuple(u for u in (unit, said[0]) if is_unit_of(u, quantity)), shown)
        return fault(
            f'"{words}" says that the unit of column "{name}" is {unit}, its own is {said[0]}',
            f"Correct one of the two, or say which is right: {which}",
            which,
        )
    return None, factors[0]


# A name that ends in its unit, as those of programs do: "t_s", "d_mm"; and in that of a force: "F_N".
_SUFFIXED, _SUFFIX_OF_FORCE = re.compile(r"[^()\[\]]*[^\W\d]_(?P<unit>[^\W\d_]{1,3})"), re.compile(r"[Ff]_[Nn](?!\w)")


def unit_in_index(sheet: Sheet, index: int) -> str:
    """The unit that "F_N" has in its name where others end in theirs, though it has another one, too; "" of any other name.

    Parameters
    ----------
    sheet, index : the record, and which of its columns.
    """
    name = sheet.names[index]
    unit = unit_of_normal_force(name, sheet.unit_below(index))
    if not unit or _SUFFIX_OF_FORCE.match(name) is None or lab_factor(unit, "force") == lab_factor("N", "force"):
        return ""
    for other, of_other in enumerate(sheet.names):
        match = _SUFFIXED.fullmatch(of_other) if other != index else None
        if match is not None and sheet.plain_heading(other).unit == match["unit"]:
            return "N"
    return ""


def counted_unit(name: str, quantity: str) -> str:
    """The number with a unit of a quantity in a bracket of a name: "10 mN" of "Force (10 mN)"; "" if there is none.

    Parameters
    ----------
    name, quantity : of a column, and what it is to hold.
    """
    for bracket in re.findall(r"[(\[]\s*(\d[\d.]*\s?[^\W\d]+)\s*[)\]]", name):
        unit = bracket.lstrip("0123456789. ")
        if is_unit_of(unit, quantity):
            return str(bracket)
    return ""


def words_against(sheet: Sheet, index: int, quantity: str, factor: float) -> tuple[str, int, str] | None:
    """The words beside a record by which a quantity has another unit than that by which it is read, their line, and that unit.

    Parameters
    ----------
    sheet : the record.
    index, quantity, factor : which of its columns, what is read from it, and by which factor it becomes SI.
    """
    against = _against(sheet, index, quantity, factor)
    return next((found for found in against if not _is_of_results(sheet, found[1], index, quantity, factor)), None)


def results_in_own_units(sheet: Sheet, index: int, quantity: str, factor: float) -> tuple[str, ...]:
    """The note on names of a table of results beside a record that have another unit than the record, that of the results.

    Parameters
    ----------
    sheet : the record.
    index, quantity, factor : which of its columns, what is read from it, and by which factor it becomes SI.
    """
    against = _against(sheet, index, quantity, factor)
    found = next((f for f in against if _is_of_results(sheet, f[1], index, quantity, factor)), None)
    return () if found is None else (f'"{found[0]}" in line {found[1]} are results, in units of their own ({found[2]})',)


def _against(sheet: Sheet, index: int, quantity: str, factor: float) -> Iterator[tuple[str, int, str]]:
    own = {line: (words, column) for line, column, words in sheet.text.of_columns}
    for line, words in sheet.beside:
        said, of = own.get(line, (words, -1))
        is_its_own, heading = of == index, sheet.headings.get(of)
        # What is said of a column needs no name of its quantity; of another one it must have it.
        alike = heading is not None and stands_for(heading.quantity) == stands_for(quantity)
        if line in own and not is_its_own and (alike or not names_quantity(said, quantity)):
            continue
        unit = unit_against(f"{quantity} {said}" if is_its_own else said, quantity, factor)
        if unit:
            yield " ".join(words.split()).strip(" ,;")[:80], line, unit


# A result of a column is no larger than its largest reading by more than this, and no smaller than this share of it.
_LARGEST_RESULT, _SMALLEST_RESULT = 1.1, 0.01


def _is_of_results(sheet: Sheet, line: int, index: int, quantity: str, factor: float) -> bool:
    """Whether a line names results that stand in the next one, and these are, in their own unit, within the readings."""
    lines = sheet.text.lines
    below = next((text for text in lines[line : line + 2] if text.strip()), "")
    names, results = (split_line(text, sheet.delimiter) for text in (lines[line - 1] if line > 0 else "", below))
    if len(names) != len(results) or len(names) < 2 or not any(map(is_numeric, results)):
        return False
    largest = float(np.nanmax(np.abs(readings([sheet.columns[index]], [factor], sheet.declared_decimal)[0]), initial=0.0))
    shown = False
    for name, cell in zip(names, results, strict=True):
        unit = next((u for u in re.findall(r"[(\[]([^()\[\]]+)[)\]]", name) if is_unit_of(u, quantity)), "")
        if not unit or np.isclose(lab_factor(unit, quantity), factor, rtol=1e-9):
            continue
        values = [parse_number(cell, mark) for mark in ([sheet.declared_decimal] if sheet.declared_decimal else [".", ","])]
        in_si = [abs(v) * lab_factor(unit, quantity) for v in values if v is not None]
        if not any(_SMALLEST_RESULT * largest <= v <= _LARGEST_RESULT * largest for v in in_si):
            return False
        shown = True
    return shown


def units_to_say(quantity: str) -> str:
    """The option by which the unit of a quantity is said, with all units that it may have, for advice.

    Parameters
    ----------
    quantity : of a column.

    >>> print(units_to_say("displacement"))
    --units displacement=..., one of m, dm, cm, mm, um, nm, Å, in, mil, uin, ft, with a factor if need be ("1e-5 mm")
    """
    shown = stands_for(quantity)
    units = usual_units(quantity)
    factor = f', with a factor if need be ("1e-5 {_USUAL[shown][0]}")' if shown in _USUAL else ""
    return f"--units {shown}=..., one of {', '.join(units)}{factor}"


def written_unit(sheet: Sheet, index: int, heading: Heading) -> str:
    """The unit that the file itself gives a column, in its name, below it, or above the table; "" if it gives none.

    Parameters
    ----------
    sheet : the record.
    index, heading : which of its columns, and what it holds.
    """
    declared = sheet.declared_units.get(stands_for(heading.quantity), ("", 0))[0]
    return heading.unit or sheet.unit_below(index) or declared


def contradicts(sheet: Sheet, index: int, heading: Heading, reading: Reading) -> str:
    """The unit that the file names of a column where the user says another one; "" where they agree or one of them says none.

    Parameters
    ----------
    sheet : the record.
    index, heading : which of its columns, and what it holds.
    reading : what the user says of the file.
    """
    quantity = heading.quantity
    asked, written = _asked_unit(quantity, reading), written_unit(sheet, index, heading)
    if asked is None or heading.unit_doubt:
        return ""
    if not written and (counted := counted_unit(sheet.names[index], quantity)):
        return "" if np.isclose(asked_factor(counted, quantity), asked_factor(asked, quantity), rtol=1e-9) else counted
    if not written:
        # A column that the user names may have a unit that is none as it stands, such as "?m".
        inside = (bracket.strip() for bracket in re.findall(r"[(\[]([^()\[\]]+)[)\]]", sheet.names[index]))
        meant = [(u, lab_factor(m, quantity)) for u in inside for m in may_be_meant(u, quantity)]
        agree = any(np.isclose(factor, asked_factor(asked, quantity), rtol=1e-9) for _, factor in meant)
        return "" if agree or not meant else meant[0][0]
    if not is_unit_of(written, quantity):
        return written
    return "" if np.isclose(lab_factor(written, quantity), asked_factor(asked, quantity), rtol=1e-9) else written


def weight_in_words(sheet: Sheet, index: int, heading: Heading, reading: Reading) -> tuple[str, ...]:
    """The note on a force in a unit of mass, which is read as the weight of so much; () of any other column.

    Parameters
    ----------
    sheet : the record.
    index, heading : which of its columns, and what it holds.
    reading : what the user says of the file.
    """
    unit = unit_in_words(sheet, index, heading, reading)
    if heading.quantity != "force" or not is_mass(unit):
        return ()
    return (f'"{sheet.names[index]}" is in {unit}, which is read as a weight, a force: {_FORCES[as_force(unit)]}',)


# What the forces are called that stand for masses.
_FORCES = {
    "gf": "grams-force (gf)",
    "kgf": "kilograms-force (kgf)",
    "mgf": "milligrams-force (mgf)",
    "lbf": "pounds-force (lbf)",
    "ozf": "ounces-force (ozf)",
}


# Directions that stand behind a force as "n" does behind that along the normal: "force_n" beside "force_t".
_DIRECTIONS = ("t", "s", "x", "y", "z", "r")


def of_a_direction(sheet: Sheet, index: int, unit: str) -> list[Fault]:
    """Ask for the unit of a force whose last small letter may be a direction, as another column's is.

    Parameters
    ----------
    sheet : the record.
    index : which of its columns.
    unit : that the letter may stand for.
    """
    name = sheet.names[index]
    of_force = name[: -len(unit)]
    directions = _DIRECTIONS if of_force.endswith("_") else tuple(map(str.upper, _DIRECTIONS))
    other = next((n for n in sheet.names if n[:-1] == of_force and n[-1:] in directions), None)
    if other is None:
        return []
    message = f'column "{name}" has no unit: "{name[-len(unit) :]}" may be the direction, as in "{other}"'
    return [Fault(message, sheet.text.path, sheet.named_at, index + 1, advice=units_to_say("force"))]


def is_confirmed(sheet: Sheet, index: int, heading: Heading, factor: float, reading: Reading) -> bool:
    """Whether the user says the unit that the file names, too: that the readings are right as they stand.

    Parameters
    ----------
    sheet : the record.
    index, heading, factor : which of its columns, what it holds, and by what it is multiplied.
    reading : what the user says of the file.
    """
    quantity = heading.quantity
    written = written_unit(sheet, index, heading)
    if _asked_unit(quantity, reading) is None or not written or not is_unit_of(written, quantity):
        return False
    return bool(np.isclose(lab_factor(written, quantity), factor, rtol=1e-12))


def _factor_beside(sheet: Sheet, quantity: str) -> tuple[str, int] | None:
    """The factor that a line beside the table states of a quantity; one of no quantity is the amplifier's or the meter's."""
    shown = stands_for(quantity)
    of_any = sheet.declared_factors.get("") if shown in ("force", "capacitance") else None
    return sheet.declared_factors.get(shown, of_any)


# How far from its zero a converter of 24 bits stands when a tare is taken, in whole counts, or the converter itself.
_IN_COUNTS = re.compile(
    r"(?<![^\W_])(?:offset|tare|tara|zero)(?![^\W_])[\s:=]*-?\d{4,}(?![.,]?\d)|hx ?71\d|ads12\d\d|nau7802|cs1237", re.IGNORECASE
)
_SCALE_OF_COUNTS = re.compile(
    r"(?<![^\W_])(?:scale|calibration|cal)[\s_-]*(?:factor)?[\s:=]*-?(?!10+(?![\d.,]))(?P<number>[2-9]\d|\d{3,})", re.IGNORECASE
)
# Lines beside the one with the factor that may name the converter.
_LINES_BESIDE = 3


def after_raw_counts(sheet: Sheet, index: int, heading: Heading) -> tuple[str, ...]:
    """The note on a factor beside the table that can only be one by which raw counts were divided; () of any other, or none.

    So is the scale of a converter whose offset stands beside it in whole counts, or that is named there, where the column has a
    unit of force and its readings have decimals, which counts have not.

    Parameters
    ----------
    sheet : the record.
    index, heading : which of its columns, and what it holds.
    """
    factor = _factor_beside(sheet, heading.quantity) if heading.quantity == "force" else None
    unit = written_unit(sheet, index, heading)
    if factor is None or not unit or not is_unit_of(unit, "force"):
        return ()
    at = factor[1] - 1
    beside = sheet.text.lines[max(at - _LINES_BESIDE, 0) : at + 1 + _LINES_BESIDE]
    decimals = sum("." in cell or "," in cell for cell in sheet.columns[index][:_SEEN])
    counts = any(map(_IN_COUNTS.search, beside)) and _SCALE_OF_COUNTS.search(sheet.text.lines[at])
    if not counts or 2 * decimals < min(len(sheet.columns[index]), _SEEN):
        return ()
    return (
        f'"{factor[0]}" in line {factor[1]} is taken for what the raw counts of a converter were divided by: '
        f'"{sheet.names[index]}" is in {unit}, and its readings have decimals, as counts have not',
    )


def unit_in_words(sheet: Sheet, index: int, heading: Heading, reading: Reading) -> str:
    """The unit in which the cells of a column are read, as it is written or said; "" if it has none.

    Parameters
    ----------
    sheet : the record.
    index, heading : which of its columns, and what it holds.
    reading : what the user says of the file.
    """
    return _asked_unit(heading.quantity, reading) or written_unit(sheet, index, heading)


def source_of_column(sheet: Sheet, index: int, heading: Heading, reading: Reading, *, clock: bool) -> str:
    """The column as people know it: its name in the file and where its unit was found.

    Parameters
    ----------
    sheet : the record.
    index, heading : which of its columns, and what it holds.
    reading : what the user says of the file.
    clock : whether its cells are times of day, which have no unit.
    """
    quantity, name = heading.quantity, sheet.names[index]
    if not sheet.header_line and name.isdecimal():
        name = f"column {name}"
    asked = _asked_unit(quantity, reading)
    if asked is not None:
        return f"{name} (read as {asked})"
    below = sheet.unit_below(index)
    if below:
        return f"{name} ({below})"
    declared = sheet.declared_units.get(stands_for(quantity), ("", 0))[0]
    return f"{name} ({declared}, declared above)" if declared and not heading.unit and not clock else name

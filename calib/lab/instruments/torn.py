"""From the cells of a table to numbers that its delimiter cut in two, as it is their decimal or thousands mark as well."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from calib.errors import Fault
from calib.lab.instruments.sheet import Sheet

# Cells at the beginning of a column that are looked at, and rows that are too wide.
_LOOKED_AT, _WIDE = 1000, 100
# Names of a last column that is empty in most rows.
_EMPTY = ("", "remark", "remarks", "comment", "comments", "note", "notes", "bemerkung", "kommentar")
# A number of three digits and more behind its thousands: by threes, or by twos and a three as in India.
_GROUPS = {
    mark: re.compile(
        rf"(?:^|(?<={mark}))[-+\u2212]?[1-9](?:\d{{0,2}}(?:{mark}\d{{3}}(?![\d]))+|\d?(?:{mark}\d\d)+{mark}\d{{3}}(?!\d))(?:[.,]\d+)?"
    )
    for mark in ", "
}
_THOUSANDS, _REST = re.compile(r"[-+\u2212]?[1-9]\d{0,2}"), re.compile(r"\d{3}(?:[.,]\d+)?")
_OTHERWISE = "export without marks between thousands, with semicolons or tabs between the columns, or with numbers in quotes"


def torn_decimals(sheet: Sheet) -> Fault | None:
    """The fault of decimal commas between commas, even where a wide header holds the cells: no point, and decimals like 084."""
    if sheet.delimiter != "," or any("." in c for column in sheet.columns for c in column[:_LOOKED_AT]):
        return None
    for index, column in enumerate(sheet.columns[1:], 1):
        cells = [c.strip() for c in column[:_LOOKED_AT] if c.strip()]
        torn = [c for c in cells if re.fullmatch(r"0\d+", c)]
        if torn and len(set(cells)) > 4 and all(c.isdecimal() and len(c) <= len(torn[0]) for c in cells):
            return Fault(
                f'"{torn[0]}" in column {index + 1} seems to be the decimals behind a decimal comma',
                sheet.text.path,
                int(sheet.lines[0]),
                index + 1,
                advice="Export with semicolons between the columns, or with a decimal point",
            )
    return None


def torn_thousands(sheet: Sheet) -> Fault | None:
    """The fault of numbers whose thousands stand in a cell of their own: a column of 1 to 999 beside one of three digits each.

    Some of these begin with a zero, as no program writes 28.7, or stand under no name beside thousands that never change.
    Seconds beside their milliseconds are none.
    """
    for index in range(len(sheet.columns) - 1):
        heading = sheet.headings.get(index)
        if sheet.delimiter not in _GROUPS or heading is None or heading.quantity == "time":
            continue
        if not all(_THOUSANDS.fullmatch(a) and _REST.fullmatch(b) for _, a, b in _filled(sheet, index)):
            continue
        rows = list(_filled(sheet, index))
        if len(rows) < 3:
            continue
        rests = {b for _, _, b in rows}
        name = sheet.names[index + 1] if index + 1 < len(sheet.names) else ""
        same = len({a for _, a, _ in rows}) == 1 and len(rests) > 1 and name.strip().lower() in _EMPTY
        shown = next(((r, a, b) for r, a, b in rows if b[0] == "0"), rows[0] if same else None)
        if len(rests) > 1 and shown is not None:
            row, thousands, rest = shown
            return Fault(
                f'"{thousands}{sheet.delimiter}{rest}" seems to be one number, whose thousands stand in the column '
                f'"{sheet.names[index]}" and the rest in the next',
                sheet.text.path,
                int(sheet.lines[row]),
                index + 1,
                advice=f"Write {thousands}{rest}, and so in all rows, or {_OTHERWISE}; if they are two numbers, write the "
                "second without zeros before it",
            )
    return None


def thousands_in(rows: Sequence[Sequence[str]], width: int, delimiter: str) -> str:
    """A number that the delimiter may have cut at its thousands, where all rows that are too wide would fit so; "" if not.

    Parameters
    ----------
    rows : cells of each row.
    width : how many the header has.
    delimiter : between them.

    >>> thousands_in([["0.1", "1", "028.7"], ["0.2", "990.1"]], 2, ","), thousands_in([["1", "0.1", "28.7"]], 2, ",")
    ('1,028.7', '')
    """
    pattern, example = _GROUPS.get(delimiter), ""
    wide = [[c.strip() for c in row] for row in rows if sum(map(bool, map(str.strip, row))) > width][:_WIDE]
    for row in wide if pattern is not None else ():
        found = [match[0] for match in pattern.finditer(delimiter.join(row))] if pattern is not None else []
        surplus = len([c for c in row if c]) - width
        if sum(number.count(delimiter) for number in found) < surplus:
            return ""
        example = example or next((n for n in found if n.count(delimiter) == surplus), "")
        example = example or delimiter.join(found[0].split(delimiter)[: surplus + 1])
    return example


def thousands_advice(number: str, delimiter: str) -> str:
    """What to do about a number that a delimiter may have cut at its thousands.

    Parameters
    ----------
    number : as it would be written, with its mark.
    delimiter : which is that mark.
    """
    return f'If "{number}" is one number, write {number.replace(delimiter, "")}, and so in all rows, or {_OTHERWISE}'


def _filled(sheet: Sheet, index: int) -> Iterator[tuple[int, str, str]]:
    """The cells of a column and of the next, with their row from 0, where both hold something."""
    for row, pair in enumerate(zip(*(column[:_LOOKED_AT] for column in sheet.columns[index : index + 2]), strict=True)):
        first, second = map(str.strip, pair)
        if first and second:
            yield row, first, second

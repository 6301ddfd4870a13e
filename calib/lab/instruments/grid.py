"""From the typed cells of a workbook's sheet to a `Part`: lines of text, number by number as stored, and what the types say."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date, datetime, time, timedelta
from pathlib import Path

from calib.errors import Fault, InputError
from calib.lab.instruments.characters import OF_NO_WIDTH
from calib.lab.instruments.numbers import is_numeric
from calib.lab.instruments.part import Cell, CellTypes, Part
from calib.lab.instruments.shown import shown_as
from calib.lab.instruments.text import LabText

#: A cell as a library gives it.
Value = str | float | int | bool | datetime | date | time | timedelta | None

#: More cells than any lab's sheet holds; each costs about a microsecond and a hundred bytes.
MOST_CELLS = 12_000_000
_MARKED = re.compile(r"[.,'’\s]")
_OF_TEXT = ("'", "’")
_UNSEEN = str.maketrans("", "", OF_NO_WIDTH)
# Comments that are quoted, and of each so many characters.
_MOST_COMMENTS, _QUOTED = 6, 80
_DELIMITED = re.compile(r"[;,\t]|\s{2,}")


@dataclass(frozen=True)
class SheetOf:
    """Where a sheet stands: its file with the hash of its bytes, the format's name and its own, and whether it is hidden."""

    path: Path
    sha256: str
    format: str
    name: str
    hidden: bool


def part_of(
    sheet: SheetOf,
    rows: Iterable[Sequence[tuple[Value, str]]],
    *,
    errors: Mapping[Cell, str],
    uncalculated: Mapping[Cell, str],
    formulas: Mapping[Cell, str],
    notes: Sequence[str],
) -> Part:
    """Write the cells of a sheet as lines of text, one per row from the first, so that a line's number is the row's.

    Parameters
    ----------
    sheet : which one it is.
    rows : of (value, number format), from row 1 and column A on; rows may be of different lengths.
    errors, uncalculated, formulas : see `CellTypes`; what stands there in `rows` is not read where it is an error or missing.
    notes : what is to be known of the sheet.

    Returns
    -------
    The part; without text if all cells are empty.

    Raises
    ------
    InputError
        If the sheet is larger than any lab's.
    """
    texts: dict[Cell, str] = {}
    dates: dict[Cell, str] = {}
    shown: dict[Cell, str] = {}
    written: list[list[str]] = []
    width = n_cell = n_typed = n_unseen = 0
    for row, cells in enumerate(rows, 1):
        line: list[str] = []
        n_cell += len(cells)
        if n_cell > MOST_CELLS:
            message = f'sheet "{sheet.name}" has more than {MOST_CELLS} cells'
            raise InputError(Fault(message, sheet.path, advice="Export the record as a CSV file"))
        for column, (value, number_format) in enumerate(cells):
            if value is None or (row, column) in errors or (row, column) in uncalculated:
                line.append("")
                continue
            if type(value) is str:
                plain = value if value.isascii() else value.translate(_UNSEEN)
                n_unseen += plain != value
                cell = _one_line(plain)
                if cell[:1] in _OF_TEXT and is_numeric(bare := cell.strip("'’")):
                    cell = bare  # the mark by which a spreadsheet program keeps a cell as text
                if _MARKED.search(cell) and is_numeric(cell):
                    texts[row, column] = cell
            else:
                cell = _as_text(value)
                n_typed += 1
                if isinstance(value, (date, time, timedelta)):
                    dates[row, column] = number_format
                elif number_format != "General" and shown_as(number_format) is not None:
                    shown[row, column] = number_format
            line.append(cell)
        while line and not line[-1]:
            line.pop()
        width = max(width, len(line))
        written.append(line)
    while written and not written[-1]:
        written.pop()
    if not written:
        return Part("sheet", sheet.name, None, "it is empty", sheet.hidden)
    if width * len(written) > MOST_CELLS:
        message = f'sheet "{sheet.name}" reaches to {address((len(written), width - 1))}, which no lab\'s record does'
        raise InputError(Fault(message, sheet.path, advice="Export the record as a CSV file"))
    unseen = [f"characters that nobody sees are left out of {n_unseen} cells"] if n_unseen else []
    # The lines of a text file, put into the first column as they are: to be cut as such.
    alone = width == 1 and any(_DELIMITED.search(line[0]) for line in written if line)
    if alone:
        lines = tuple(line[0] if line else "" for line in written)
        types, decimal = CellTypes(), ""
    else:
        lines = tuple("\t".join(map(_quoted, line + [""] * (width - len(line)))) if line else "" for line in written)
        types, decimal = CellTypes(texts, dates, shown, errors, uncalculated, formulas), "." if n_typed else ""
    text = LabText(
        sheet.path, sheet.sha256, f"{sheet.format}, sheet {sheet.name}", (*lines, ""), True, decimal, typed=bool(decimal)
    )
    return Part("sheet", sheet.name, text, "", sheet.hidden, types, (*notes, *unseen))


def with_comments(part: Part, comments: Iterable[tuple[Cell | None, str]]) -> Part:
    """The part with what is written on its cells and beside them, each told where it stands.

    Parameters
    ----------
    part : of a workbook.
    comments : the cell that each is on, None where it is on none, and its words.
    """
    there = [(cell, words) for cell, words in comments if words]
    if part.text is None or not there:
        return part
    kept = tuple((cell[0], cell[1], words) if cell is not None else (0, -1, words) for cell, words in there)
    shown = [f'"{words[:_QUOTED]}"{f" on cell {address(cell)}" if cell is not None else ""}' for cell, words in there]
    more = f" and {len(shown) - _MOST_COMMENTS} more" if len(shown) > _MOST_COMMENTS else ""
    what = "comments" if len(shown) > 1 else "a comment"
    note = f"{what} beside the cells, looked at for units and factors only: {', '.join(shown[:_MOST_COMMENTS])}{more}"
    return replace(part, text=replace(part.text, comments=kept), notes=(*part.notes, note))


def address(cell: Cell) -> str:
    """A cell as spreadsheet programs name it.

    >>> address((17, 1)), address((1, 27))
    ('B17', 'AB1')
    """
    row, column = cell
    return f"{column_letters(column)}{row}"


def column_letters(column: int) -> str:
    """A column, counted from 0, as spreadsheet programs name it."""
    letters, rest = "", column + 1
    while rest:
        rest, digit = divmod(rest - 1, 26)
        letters = chr(65 + digit) + letters
    return letters


def _one_line(text: str) -> str:
    return " ".join(text.split()) if text and (text[0].isspace() or text[-1].isspace() or not text.isprintable()) else text


def _quoted(cell: str) -> str:
    return '"' + cell.replace('"', '""') + '"' if '"' in cell else cell


def _as_text(value: Value) -> str:
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, datetime):
        return value.isoformat(sep=" ")
    if isinstance(value, timedelta):
        # To the microsecond, as more digits than that are the rounding of a fraction of a day.
        total = round(value.total_seconds() * 1e6)
        minutes, micro = divmod(abs(total), 60_000_000)
        fraction = f"{micro / 1e6:09.6f}"
        return f"{'-' if total < 0 else ''}{minutes // 60}:{minutes % 60:02d}:{fraction}"
    return value.isoformat() if isinstance(value, (date, time)) else str(value)

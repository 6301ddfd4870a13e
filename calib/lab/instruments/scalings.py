"""From the lines above, below and between a header and its rows to the factors and offsets that they state column by column."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain

from calib.lab.instruments.header import split_line, without_comment_mark
from calib.lab.instruments.numbers import is_numeric, parse_number
from calib.lab.instruments.sheet import Scaling, Sheet
from calib.lab.instruments.stated import OF_OTHERS, SCALE, quantity_of, stated_factors
from calib.lab.instruments.units import stands_for
from calib.lab.instruments.vocabulary import words

# Lines above a header and below a table that may speak of it, and rows at either end of it that are none.
_BESIDE = 200
_LONGEST = 40
# How many times longer than its neighbour a step of the clock may be where a reading goes on.
_EVEN = 3.0
_FACTOR = (
    rf"{SCALE}|skalierung(?:en)?|multiplicadore?s?|slopes?|pentes?|steigung(?:en)?|pendenz[ae]|pendientes?|helling|"
    r"nachylenie|斜率|傾き"
)
_OFFSET = r"(?:zero[ _-]?)?offsets?|intercepts?|achsenabschnitte?|versatz|décalages?|desfases?|偏移|オフセット|切片"
_SAYS = {
    kind: re.compile(rf"(?<![^\W_])(?:{pattern})(?![^\W_])", re.IGNORECASE)
    for kind, pattern in (("factor", _FACTOR), ("offset", _OFFSET))
}
# How far an instrument reaches is no factor, and words beside these may be of a table of their own.
_NO_FACTOR = re.compile(r"range|bereich|vertical|horizontal|/ ?div|messung|correct|korrektur|limit|date|datum", re.IGNORECASE)
_TIMES = re.compile(r"\s*(?:[x×*]\s?(?P<behind>\d+(?:[.,]\d+)?)|(?P<before>\d+(?:[.,]\d+)?)\s?[x×])\s*", re.IGNORECASE)
_OVER = re.compile(r"\s*(?:1\s?)?[/÷]\s?(?P<behind>\d+(?:[.,]\d+)?)\s*")
# "Scale factors: 1", "gain = 1" before more numbers.
_LABEL_AND_NUMBER = re.compile(r"(?P<label>[^\W\d][^\d:=]*?)\s*[:=]\s*(?P<number>[+-]?\d[\d.,eE+-]*)")


def with_scalings(sheet: Sheet, names_at: Sequence[int], start: int) -> Sheet:
    """The sheet with what lines state of its columns: a row of factors or offsets, or a table of channels with such a column.

    The readings may hold them already, or have to be multiplied by them yet. A row of factors among the rows is no reading.

    Parameters
    ----------
    sheet : one record, with its rows.
    names_at : index of the lines of its header.
    start : index of the first line that may be a row.
    """
    lines = sheet.text.lines
    row_of = {line: r for r, line in enumerate(sheet.lines[:_BESIDE].tolist())}
    n = len(sheet.lines)
    row_of |= {line: n - 1 - k for k, line in enumerate(sheet.lines[: -_BESIDE - 1 : -1].tolist())}
    found: dict[int, list[Scaling]] = {}
    rows: dict[int, str] = {}
    first, below, last = min(names_at, default=0), max(names_at, default=0) + 2, int(sheet.lines[-1])

    def take(numbers: Sequence[int], *, until_a_row: bool) -> None:
        for number in numbers:
            row = row_of.get(number)
            beside = row is not None and _is_beside(sheet, number, row)
            stated = dict(_beside(sheet, number) if beside else _of_row(sheet, number, alone=below <= number <= start))
            if until_a_row and row is not None and not stated and row not in sheet.reasons:
                return
            for index, scaling in stated.items():
                found.setdefault(index, []).append(scaling)
            if beside and until_a_row:
                return
            if stated and not beside and row is not None:
                rows[row] = f"no reading: {next(iter(stated.values())).words} states factors or offsets of the columns"

    owned = {line for line, _, _ in sheet.text.of_columns}
    above = [number for number in range(max(first - _BESIDE, 0) + 1, first + 1) if number not in owned]
    take(above, until_a_row=False)
    take(range(below, min(below + _BESIDE, last + 1)), until_a_row=True)
    take(range(min(last + _BESIDE, len(lines)), max(last - _BESIDE, below - 1), -1), until_a_row=True)
    for index, scaling in chain(_of_channels(sheet, above), _of_columns(sheet)):
        found.setdefault(index, []).append(scaling)
    return replace(
        sheet,
        scalings={index: tuple(dict.fromkeys(stated)) for index, stated in found.items()},
        reasons={**sheet.reasons, **rows},
    )


def _kind(cell: str) -> str:
    """What a label says that its numbers are, "factor" or "offset"; "" if neither."""
    if not cell or len(cell) > _LONGEST or any(map(str.isdigit, cell)) or OF_OTHERS.search(cell) or _NO_FACTOR.search(cell):
        return ""
    # Of both the last is what it says: "scaling offset".
    last = {kind: max((m.end() for m in pattern.finditer(cell)), default=-1) for kind, pattern in _SAYS.items()}
    return max(last, key=last.__getitem__) if max(last.values()) >= 0 else ""


def _of_row(sheet: Sheet, number: int, *, alone: bool) -> Iterator[tuple[int, Scaling]]:
    """What a row of numbers behind a label, or without one above the rows, states of the columns that it stands over."""
    line = without_comment_mark(sheet.text.lines[number - 1], sheet.delimiter)
    if len(line) > _LONGEST * max(len(sheet.names), 2):
        return
    cells = [c.strip() for c in split_line(line, sheet.delimiter)]
    together = _LABEL_AND_NUMBER.fullmatch(cells[0]) if cells and len(cells[0]) <= 2 * _LONGEST else None
    cells = [together["label"], together["number"], *cells[1:]] if together is not None else cells
    labels = [i for i, c in enumerate(cells) if c and _number(c) is None and c.strip("-–—")]
    products = False
    if len(labels) == 1 and (kind := _kind(cells[labels[0]])):
        shift = 1 if labels[0] == 0 and len(cells) == len(sheet.names) + 1 else 0
        shown = f'"{cells[labels[0]]}"'
    elif not labels and alone and _is_of_factors(sheet, cells):
        kind, shift, shown = "", 0, f'"{line.strip()[:_LONGEST]}"'
    elif products := not labels and len(cells) == len(sheet.names) and all(map(_is_product, filter(None, cells))):
        kind, shift, shown = "factor", 0, f'"{line.strip()[:_LONGEST]}"'
    else:
        return
    if shift + len(sheet.names) < len(cells) or (not products and sum(_number(c) is not None for c in cells) < 2):
        return
    for index in sheet.headings:
        value = _number(cells[index + shift]) if index + shift < len(cells) else None
        if value is not None:
            yield index, Scaling(number, shown, kind, value)


def _label_beside(sheet: Sheet, number: int) -> tuple[list[str], int] | None:
    """The cells of a line, and the first with words if it is to the right of all columns that are understood; else None."""
    cells = [c.strip() for c in split_line(sheet.text.lines[number - 1], sheet.delimiter)]
    label = next((i for i, c in enumerate(cells) if c and _number(c) is None), 0)
    return (cells, label) if label > max(sheet.headings, default=len(cells)) else None


def _is_beside(sheet: Sheet, number: int, row: int) -> bool:
    """Whether a row is a reading with words beside it, to the right of the table: its clock goes on as in the next rows."""
    clock = next((i for q in ("time", "displacement") for i, h in sheet.headings.items() if h.quantity == q), None)
    n = len(sheet.lines)
    if clock is None or n < 3 or _label_beside(sheet, number) is None:
        return False
    near = sheet.lines[min(row, n - 3) :][:3]
    rows = [split_line(sheet.text.lines[line - 1], sheet.delimiter) for line in near.tolist()]
    first, second, third = (_number(cells[clock].strip()) if clock < len(cells) else None for cells in rows)
    if first is None or second is None or third is None:
        return False
    steps = sorted((second - first, third - second))
    return steps[0] > 0 and steps[1] <= _EVEN * steps[0]


def _beside(sheet: Sheet, number: int) -> Iterator[tuple[int, Scaling]]:
    """What words to the right of a reading, and the number behind them, state of the columns: "force gain | 10"."""
    found = _label_beside(sheet, number)
    if found is None:
        return
    cells, label = found
    words_of, value = cells[label], next((v for c in cells[label + 1 :] if (v := _number(c)) is not None), None)
    kind = _kind(words_of)
    if value is None or not kind:
        return
    named = quantity_of(words_of)
    of = {named} if kind == "offset" and named is not None else set(stated_factors([f"{words_of}: {value:g}"]))
    for index, heading in sheet.headings.items():
        quantity = stands_for(heading.quantity)
        if quantity in of or ("" in of and quantity != "time"):
            yield index, Scaling(number, f'"{words_of}" beside the table', kind, value)


def _is_of_factors(sheet: Sheet, cells: Sequence[str]) -> bool:
    """Whether numbers that stand right below a header by themselves are 1 for the time, and something else for others."""
    time = next((i for i, h in sheet.headings.items() if h.quantity == "time"), None)
    values = [_number(c) for c in cells]
    if time is None or len(values) != len(sheet.names) or None in values:
        return False
    counted = any(values == [float(k + first) for k in range(len(values))] for first in (0, 1))
    return values[time] == 1 and not counted


def _of_channels(sheet: Sheet, above: Sequence[int]) -> Iterator[tuple[int, Scaling]]:
    """What a table of channels above the header states, of which one column is factors or offsets, row by row."""
    columns: dict[int, tuple[str, str]] = {}  # column of such a table -> kind and name
    for number in above:
        line = without_comment_mark(sheet.text.lines[number - 1], sheet.delimiter)
        cells = [c.strip() for c in split_line(line, sheet.delimiter)]
        named = {i: (kind, c) for i, c in enumerate(cells) if (kind := _kind(c)) and not any(map(is_numeric, cells))}
        if named and len([c for c in cells if c]) > len(named):
            columns = named
            continue
        numbers = {i: value for i in columns if i < len(cells) and (value := _number(cells[i])) is not None}
        if not numbers:
            columns = {}
        for index in _columns_of(sheet, [c for i, c in enumerate(cells) if i not in columns]) if numbers else ():
            for i, value in numbers.items():
                yield index, Scaling(number, f'"{columns[i][1]}"', columns[i][0], value)


def _of_columns(sheet: Sheet) -> Iterator[tuple[int, Scaling]]:
    """What is said of one column alone: a number behind the word of a factor or an offset, or words that state a factor."""
    on_names = (comment for comment in sheet.text.comments if comment[0] == sheet.header_line and comment[1] >= 0)
    for number, index, line in (*sheet.text.of_columns, *on_names):
        what, _, cell = line.rpartition("\t")
        kind, value = _kind(what), _number(cell)
        if kind and value is not None:
            yield index, Scaling(number, f'"{what}" of "{sheet.names[index]}"', kind, value)
        elif "" in stated_factors([line]) or (own := _quantity(sheet, index)) in stated_factors([f"{own} {line}"]):
            yield index, Scaling(number, f'"{" ".join(line.split())[:_LONGEST]}"', "factor", math.nan)


def _quantity(sheet: Sheet, index: int) -> str:
    """What a column is of, "-" if it is not understood."""
    heading = sheet.headings.get(index)
    return stands_for(heading.quantity) if heading is not None else "-"


def _columns_of(sheet: Sheet, cells: Sequence[str]) -> list[int]:
    """The columns that a row of a table of channels is of: by the name of one, else by its quantity."""
    texts = [c for c in cells if c and not is_numeric(c)]
    called = [i for i, name in enumerate(sheet.names) if name and words(name) in {words(c) for c in texts}]
    if called:
        return called
    of = {q for c in texts if (q := quantity_of(c)) is not None}
    own = {i: stands_for(h.quantity) for i, h in sheet.headings.items()}
    return [i for i, quantity in own.items() if of == {quantity}]


def _is_product(cell: str) -> bool:
    """Whether a cell is a number with a sign of multiplication or division, and nothing else: "x10", "/2"."""
    return (_TIMES.fullmatch(cell) or _OVER.fullmatch(cell)) is not None


def _number(cell: str) -> float | None:
    """The number of a cell with either decimal mark, behind or before a sign of multiplication, or one over a number."""
    if (over := _OVER.fullmatch(cell)) is not None and (below := _number(over["behind"])):
        return 1.0 / below
    times = _TIMES.fullmatch(cell)
    plain = (times["behind"] or times["before"]) if times is not None else cell
    return next((n for mark in ".," if (n := parse_number(plain, mark)) is not None), None)

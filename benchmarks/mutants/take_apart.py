"""A lab file in, its parts with what each of its numbers means out, so that they can be changed together.

Numbers are those of the text, units those of `UNITS`: the truth does not come from the reader. Only where the table is in the
file (delimiter, rows, which column was taken for what) is asked of it, and then held against the text.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from calib.lab import LabTable, Observations, observe, read_lab_file
from mutants.document import UNITS, Column, Document, Line, Row, number

#: Words of an unused column by which it may stand in for a quantity whose own column can no longer be read.
_STAND_IN = {
    "time": "time|zeit",
    "displacement": "extension|displacement|position|strain|compression",
    "force": "force|load",
    "capacitance": "^c[ps]?$|capacitance",
    "dissipation": "^d$",
    "cycle": "cycle",
}


def _cells(line: str, delimiter: str) -> list[str]:
    return next(csv.reader([line], delimiter=delimiter), [])


def _column(name: str, unit_cell: str | None) -> Column:
    text = name if unit_cell is None else unit_cell
    found = re.fullmatch(r"(.*?)(\s*)([(\[])([^()\[\]]*)([)\]])", text)
    if unit_cell is not None:
        return Column(name, "", f"{found[3]}{found[5]}" if found else "", found[4] if found else unit_cell)
    if found is None or not found[4]:
        return Column(name)
    return Column(found[1], found[2], found[3] + found[5], found[4])


def _meaning(column: Column, values: npt.NDArray[np.float64], table: LabTable) -> Column:
    """The column with what it was read as: the quantity of which it holds the numbers, in the unit that it states."""
    for quantity, units in UNITS.items():
        read = table.columns.get(quantity)
        if read is None or column.unit not in units or (column.name or "") not in table.sources[quantity]:
            continue
        factor = units[column.unit]
        if np.allclose(values * factor, read, rtol=1e-12, atol=0, equal_nan=True):
            return replace(column, quantity=quantity, factors=(factor,))
    return column


def take_apart(path: Path) -> Document | str:
    """The parts of a lab file, or why it cannot serve: it must be read as it is, in `UNITS` and with decimal points."""
    table = read_lab_file(path)
    data = path.read_bytes()
    text = data.decode("utf-8-sig")
    newline = "\r\n" if "\r\n" in text else "\n"
    lines = text.split(newline)
    end = lines[-1] == ""
    lines = lines[:-1] if end else lines
    if table.decimal == "," or len(table.delimiter) != 1:
        return f"{path.name}: decimal commas or no single delimiter"
    first, last = int(table.lines[0]) - 1, int(table.lines[-1]) - 1
    above, units_row = first - 1, False
    cells = _cells(lines[above], table.delimiter)
    if any(cells) and all(re.fullmatch(r"[(\[].*[)\]]|", c) for c in cells):
        above, units_row = above - 1, True
    header = _cells(lines[above], table.delimiter)
    units = [*cells, *[""] * len(header)] if units_row else None
    columns = [_column(name, units[j] if units else None) for j, name in enumerate(header)]
    read = set(table.lines.tolist())
    body: list[Row | Line] = []
    for i, line in enumerate(lines[first : last + 1], first + 1):
        found = _cells(line, table.delimiter)
        if i not in read:
            body.append(Line(line, named=False))
        elif len(found) != len(columns):
            return f"{path.name}: {len(found)} cells in line {i}, {len(columns)} in the header"
        else:
            body.append(Row(tuple(found), tuple(number(v, c) for v, c in zip(found, columns, strict=True)), len(body)))
    rows = [r for r in body if isinstance(r, Row)]
    values = np.array([r.values for r in rows])
    columns = [_meaning(c, values[:, j], table) for j, c in enumerate(columns)]
    taken = {c.quantity for c in columns} - {""}
    if taken != set(table.columns):
        return f"{path.name}: {', '.join(sorted(set(table.columns) - taken))} is not the number in the text times its unit"
    return Document(
        path,
        tuple(lines[:above]),
        tuple(_stand_in(c, taken) for c in columns),
        tuple(body),
        tuple(lines[last + 1 :]),
        units_row,
        table.delimiter,
        newline,
        "data" if lines[first].startswith('"') else "none",
        end=end,
        turned=_turned(table, observe(table)),
    )


def _turned(table: LabTable, seen: Observations) -> dict[str, float]:
    """Which way compression points in the file: what was made of it over what stands in it."""
    found = {}
    for quantity, values in (("displacement", seen.displacement), ("force", seen.force)):
        if values is not None:
            found[quantity] = float(np.sign(np.nansum(values * table.columns[quantity])))
    return found


def _stand_in(column: Column, taken: set[str]) -> Column:
    words = (column.name or "").replace("_", " ").lower()
    for quantity in taken:
        factor = UNITS[quantity].get(column.unit)
        if not column.quantity and factor is not None and re.search(_STAND_IN.get(quantity, "^$"), words):
            return replace(column, stands_in=quantity, factors=(factor,))
    return column


def thinned(doc: Document, rows: Mapping[str, int]) -> Document:
    """The document with fewer rows: `rows` says "step", which of them are kept, and "most", how many at the most."""
    kept = set(doc.rows()[:: rows["step"]][: rows["most"]])
    return replace(doc, body=tuple(v for i, v in enumerate(doc.body) if i in kept or isinstance(v, Line)))

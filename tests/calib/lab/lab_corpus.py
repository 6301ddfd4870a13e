"""Lab files as they are met in the wild: one true pressing in, nearly two hundred messy files with the SI values they hold out.

Nothing here knows the reader. What a file holds is computed twice, in exact decimal arithmetic: from the cells before they are
written (`Variant.truth`), and from the written text by somebody who was told its layout (`Oracle`), who can therefore judge a
file that was damaged afterwards too.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from itertools import pairwise
from typing import Any, Protocol

#: Values of one row in SI: canonical quantity -> exact value, or None where the cell holds no reading.
Row = Mapping[str, Decimal | None]

_TIMES: Mapping[str, int | str] = {"s": 1, "sec": 1, "Sec": 1, "ms": "0.001", "min": 60, "minutes": 60}
_LENGTHS: Mapping[str, int | str] = {
    "m": 1,
    "mm": "0.001",
    "um": "0.000001",
    "\u00b5m": "0.000001",
    "\u03bcm": "0.000001",
    "in": "0.0254",
    "inch": "0.0254",
}
_FORCES: Mapping[str, int | str] = {
    "N": 1,
    "kN": 1000,
    "mN": "0.001",
    "gf": "0.00980665",
    "g": "0.00980665",
    "kgf": "9.80665",
    "lbf": "4.4482216152605",
}
_CAPACITANCES: Mapping[str, int | str] = {"pF": "1e-12", "nF": "1e-9", "uF": "1e-6", "\u00b5F": "1e-6", "F": 1}

#: Quantity -> unit as written -> factor to SI.
FACTOR: Mapping[str, Mapping[str, Decimal]] = {
    "time": {u: Decimal(f) for u, f in _TIMES.items()},
    "displacement": {u: Decimal(f) for u, f in _LENGTHS.items()},
    "force": {u: Decimal(f) for u, f in _FORCES.items()},
    "capacitance": {u: Decimal(f) for u, f in _CAPACITANCES.items()},
    "capacitance_series": {"pF": Decimal("1e-12"), "F": Decimal(1)},
    "frequency": {"Hz": Decimal(1), "kHz": Decimal(1000)},
    "dissipation": {"": Decimal(1), "-": Decimal(1)},
    "cycle": {"": Decimal(1)},
    "status": {"": Decimal(1)},
}

#: The same cells under the other unit are another truth: what a unit is changed into by the mutations.
OTHER_UNIT: Mapping[str, str] = {
    "s": "ms", "sec": "ms", "Sec": "ms", "ms": "s", "min": "s", "minutes": "s", "m": "mm", "mm": "um", "um": "mm",
    "\u00b5m": "mm", "\u03bcm": "mm", "in": "mm", "inch": "mm", "N": "kN", "kN": "N", "mN": "N", "gf": "kgf", "kgf": "N",
    "g": "kgf", "lbf": "N", "pF": "nF", "nF": "pF", "uF": "nF", "\u00b5F": "nF", "F": "pF", "Hz": "kHz", "kHz": "Hz",
}  # fmt: skip

#: Quantities without which a row is of no use, if the file has the column.
ESSENTIAL = ("time", "displacement", "force", "capacitance")

# Digits after the decimal mark by which each unit is written: the resolution of the layout. None: with an exponent.
_DIGITS: Mapping[str, int | None] = {
    "s": 2, "sec": 2, "Sec": 2, "ms": 1, "min": 5, "minutes": 5, "m": 7, "mm": 4, "um": 1, "\u00b5m": 1, "\u03bcm": 1, "in": 6,
    "inch": 6, "N": 3, "kN": 4, "mN": 1, "gf": 2, "g": 2, "kgf": 5, "lbf": 5, "pF": 3, "nF": 6, "uF": 9, "\u00b5F": 9,
    "F": None, "Hz": 1, "kHz": 3, "": 5, "-": 5,
}  # fmt: skip

_SENTINEL = re.compile(r"^(?:over|ovld|ov\d+|ol|overload|overflow|-{2,}|\*+)$", re.IGNORECASE)
_GROUP_MARKS = "'\u2019 \u00a0\u202f\u2009"


def pressing(n_row: int) -> Mapping[str, tuple[Decimal, ...]]:
    """The true pressing in SI, n_row values per quantity: approach, loading to 0.6 mm, hold, unloading with hysteresis.

    It lasts 1240 s, so that thousands marks occur, and only late.
    """
    columns: dict[str, list[Decimal]] = {q: [] for q in FACTOR}
    for i in range(n_row):
        u = Decimal(i) / Decimal(max(n_row - 1, 1))
        if u < Decimal("0.2"):
            x = Decimal("-0.05") + u / 4
        elif u < Decimal("0.55"):
            x = (u - Decimal("0.2")) / Decimal("0.35") * Decimal("0.6")
        elif u < Decimal("0.65"):
            x = Decimal("0.6")
        else:
            x = Decimal("0.6") - (u - Decimal("0.65")) / Decimal("0.35") * Decimal("0.65")
        depth = max(x, Decimal(0))
        wiggle = Decimal((i * 37) % 11 - 5)
        branch = Decimal("0.85") if u > Decimal("0.65") else 1 - max(u - Decimal("0.55"), Decimal(0)) / 2
        force = 18 * depth * depth.sqrt() * branch - Decimal("0.043") + wiggle * Decimal("0.0007")
        columns["time"].append(u * 1240 + Decimal("0.02") * (i % 3))
        columns["displacement"].append((x + wiggle * Decimal("0.00013")) / 1000)
        columns["force"].append(force)
        columns["capacitance"].append((Decimal("97.301") + 20 * depth + wiggle * Decimal("0.0021")) * Decimal("1e-12"))
        columns["capacitance_series"].append(columns["capacitance"][-1])
        columns["dissipation"].append(Decimal("0.01234") + wiggle * Decimal("0.00007"))
        columns["frequency"].append(Decimal(1000))
        columns["cycle"].append(Decimal(1 if u < Decimal("0.65") else 2))
        columns["status"].append(Decimal(0))
    return {q: tuple(v) for q, v in columns.items()}


@dataclass(frozen=True)
class Column:
    """One column before it is written: the quantity ("" means nothing to the reader), the name, the unit, cells with points."""

    quantity: str
    name: str
    unit: str
    cells: tuple[str, ...]


def as_text(value: Decimal, unit: str, digits: int | None) -> str:
    """Number text of a value in its unit with this many digits after the point; None: with an exponent."""
    return f"{value:.5E}" if digits is None else f"{value:.{digits}f}"


def column(
    quantity: str, name: str, unit: str = "", n_row: int = 200, digits: int | None = -1, cells: Sequence[str] | None = None
) -> Column:
    """A column of the true pressing in a unit, at the resolution of the unit unless `digits` says another."""
    if cells is not None:
        return Column(quantity, name, unit, tuple(cells))
    if quantity in ("cycle", "status"):
        digits = 0
    elif digits == -1:
        digits = _DIGITS[unit]
    factor = FACTOR[quantity][unit]
    return Column(quantity, name, unit, tuple(as_text(v / factor, unit, digits) for v in pressing(n_row)[quantity]))


@dataclass(frozen=True)
class Oracle:
    """What every line of a file means to somebody who was told its layout.

    Attributes
    ----------
    delimiter : between cells; "" for runs of blanks.
    decimal : the decimal mark; the other mark, apostrophes and blanks may set full groups of three digits apart.
    columns : cell index -> quantity and factor to SI.
    width : cells in the header; a row with more is no row.
    first, last : 1-based lines between which rows can lie.
    stop : pattern of a line below which there are no rows, "" if none.
    suffix : unit that stands within the cells.
    """

    delimiter: str
    decimal: str
    columns: Mapping[int, tuple[str, Decimal]]
    width: int
    first: int
    last: int = 10**9
    stop: str = ""
    suffix: str = ""

    def interpret(self, lines: Sequence[str]) -> dict[int, Row]:
        """Line number -> values of every line that holds at least one number."""
        found: dict[int, Row] = {}
        for number, line in enumerate(lines, start=1):
            if number < self.first or number > self.last:
                continue
            if self.stop and re.search(self.stop, line):
                break
            cells = split_cells(line, self.delimiter)
            if not any(plain_number(c, self.decimal) is not None for c in cells):
                continue
            found[number] = self._row(cells)
        return found

    def _row(self, cells: list[str]) -> Row:
        quantities = {q for q, _ in self.columns.values()}
        row: dict[str, Decimal | None] = {q: None for q in quantities if q != "status"}
        if any(c for c in cells[self.width :]):
            return row
        for index, (quantity, factor) in self.columns.items():
            if quantity == "status":
                continue
            value = plain_number(cells[index].removesuffix(self.suffix), self.decimal) if index < len(cells) else None
            lcr = quantity in ("capacitance", "capacitance_series", "dissipation")
            if value is None or abs(value) >= Decimal("9.9e37") or (lcr and value == 999999):
                continue
            row[quantity] = value * factor
        if "capacitance_series" in row:
            series, d = row.pop("capacitance_series"), row.get("dissipation")
            if "capacitance" not in row:
                row["capacitance"] = None if series is None or d is None else series / (1 + d * d)
        return row


class Table(Protocol):
    """What is looked at of a `calib.lab.instruments.LabTable`."""

    @property
    def columns(self) -> Mapping[str, Any]:
        """Canonical name -> values in SI, shape (n_row,)."""

    @property
    def lines(self) -> Any:
        """Line of each row, shape (n_row,)."""

    @property
    def reasons(self) -> Sequence[str]:
        """Why a row is not usable."""

    @property
    def notes(self) -> Sequence[str]:
        """Choices made while reading."""


def disagreement(table: Table, rows: Mapping[int, Row], last_may_go: bool = False, optional: Sequence[str] = ()) -> str:
    """The first thing in which a table differs from what the lines of the file say, "" if there is none.

    A value must be the written one to 1e-12, or nan where the line holds none; a row with a reason may have nan anywhere; a
    row without an essential value must have a reason, unless most rows lack it; no complete row may be left out.

    Parameters
    ----------
    rows : line -> values that are legitimate.
    last_may_go : the last line of the file was cut, and may be left out if a note says something.
    optional : quantities whose column may be left out altogether.
    """
    quantities = {q for row in rows.values() for q in row} - {q for q in optional if q not in table.columns}
    lines = [int(line) for line in table.lines]
    if any(b <= a for a, b in pairwise(lines)):
        return f"lines are not in order: {lines}"
    for quantity, values in table.columns.items():
        if len(values) != len(lines) or len(table.reasons) != len(lines):
            return f"{quantity} has {len(values)} values and {len(table.reasons)} reasons for {len(lines)} rows"
        if quantity not in quantities and any(v == v for v in values):
            return f"{quantity} is read, and the file has none"
    for quantity in quantities & set(ESSENTIAL):
        if quantity not in table.columns and any(row.get(quantity) is not None for row in rows.values()):
            return f"{quantity} is not read"
    empty = {q: sum(1 for v in values if v != v) for q, values in table.columns.items()}
    for i, line in enumerate(lines):
        row, reason = rows.get(line), table.reasons[i]
        found = {q: float(values[i]) for q, values in table.columns.items()}
        if row is None or all(v is None for v in row.values()):
            if not reason:
                return f"line {line} is no row, and is used: {found}"
            continue
        for quantity, value in found.items():
            wanted = row.get(quantity)
            if value != value:
                if wanted is not None and not reason:
                    return f"line {line}: {quantity} is not read, and no reason is given"
                if not reason and quantity in ESSENTIAL and 2 * empty[quantity] <= len(lines):
                    return f"line {line}: {quantity} is missing, and no reason is given"
            elif wanted is None or abs(value - float(wanted)) > 1e-12 * abs(float(wanted)):
                return f"line {line}: {quantity} is {value!r}, written is {wanted}"
    needed = [q for q in ESSENTIAL if q in quantities]
    for line, row in rows.items():
        if line not in lines and all(row[q] is not None for q in needed):
            if last_may_go and line == max(rows) and table.notes:
                continue
            return f"line {line} holds a row, and is left out"
    return ""


def split_cells(line: str, delimiter: str) -> list[str]:
    """Cells of one line, unquoted and stripped; "" for a cell whose quotation mark is left open: it was cut."""
    if delimiter == "" and '"' not in line:
        return line.split()
    cells, cell, inside = [], "", False
    for character in line:
        if character == '"':
            inside = not inside
        elif character == delimiter and not inside:
            cells.append(cell.strip())
            cell = ""
        else:
            cell += character
    cells.append("" if inside else cell.strip())
    return cells


def plain_number(text: str, decimal: str) -> Decimal | None:
    """The exact number a cell holds with this decimal mark, None if it holds none.

    >>> plain_number("1,000.06", "."), plain_number("1.000,06", ","), plain_number("0,9966", "."), plain_number("1 e", ".")
    (Decimal('1000.06'), Decimal('1000.06'), None, None)
    """
    text = text.strip().replace("\u2212", "-")
    match = re.fullmatch(r"([+-]?)(.*?)(?:[eE]([+-]?[0-9]{1,9}))?", text, re.DOTALL)
    if match is None:
        return None
    sign, mantissa, exponent = match[1], match[2], match[3] or "0"
    whole, _, fraction = mantissa.partition(decimal)
    marks = set(whole) - set("0123456789")
    if marks:
        (mark, *more) = marks
        groups = whole.split(mark)
        allowed = _GROUP_MARKS + ("," if decimal == "." else ".")
        full = 1 <= len(groups[0]) <= 3 and all(len(g) == 3 for g in groups[1:])
        if more or mark not in allowed or not full or groups[0].startswith("0"):
            return None
        whole = "".join(groups)
    if not re.fullmatch("[0-9]*", fraction) or not re.fullmatch("[0-9]*", whole) or not whole + fraction:
        return None
    return Decimal(f"{sign}{whole or '0'}.{fraction or '0'}E{exponent}")


def with_marks(cell: str, decimal: str, thousands: str) -> str:
    """A number text with a point, rewritten with other marks; anything else as it is.

    >>> with_marks("-1234.5", ",", "."), with_marks("OVER", ",", ".")
    ('-1.234,5', 'OVER')
    """
    match = re.fullmatch(r"( *[+-]?)([0-9]+)(?:\.([0-9]*))?([eE][+-]?[0-9]+)?", cell)
    if match is None:
        return cell
    whole = match[2]
    if thousands:
        whole = f"{int(whole):,}".replace(",", thousands) if len(whole) > 3 else whole
    return match[1] + whole + (decimal + match[3] if match[3] is not None else "") + (match[4] or "")


@dataclass(frozen=True)
class Layout:
    """How columns become a file.

    Attributes
    ----------
    columns : in the order of the file.
    place : of the unit: "row", "row()", "row[]" (a units row), "()", "[]", ", ", "/", "_", " " (in the name), "none".
    delimiter : between cells; "" for runs of blanks.
    decimal, thousands : marks.
    quoted : "", "all", "data", "header".
    prelude, footer : lines above the header and below the rows.
    between : lines between the header (with its units) and the rows.
    declared : quantity -> unit that the prelude declares (the unit of the column, where `place` is "none").
    stop : as of `Oracle`.
    """

    columns: tuple[Column, ...]
    place: str = "row()"
    delimiter: str = ","
    decimal: str = "."
    thousands: str = ""
    quoted: str = ""
    newline: str = "\n"
    encoding: str = "utf-8"
    bom: bool = False
    prelude: tuple[str, ...] = ()
    footer: tuple[str, ...] = ()
    between: tuple[str, ...] = ()
    final_newline: bool = True
    stop: str = ""
    trailing: str = ""

    def joined(self, cells: Sequence[str], quoted: bool) -> str:
        """One line of cells."""
        if self.delimiter == "":
            return " ".join(f"{c:>12}" for c in cells)
        mark = '"' if quoted else ""
        written = [f'"{c}"' if not quoted and self.delimiter in c else f"{mark}{c}{mark}" for c in cells]
        return self.delimiter.join(written) + self.trailing

    def header(self) -> list[str]:
        """Header cells."""
        return [_named(c.name, c.unit, self.place) for c in self.columns]

    def header_line(self) -> int:
        """1-based."""
        return len(self.prelude) + 1

    def lines(self) -> tuple[list[str], int]:
        """The lines of the file and the 1-based line of the first row."""
        lines = [*self.prelude, self.joined(self.header(), self.quoted in ("all", "header"))]
        if self.place.startswith("row"):
            left, right = self.place[3:4], self.place[4:5]
            units = [f"{left}{c.unit}{right}" if c.unit else "" for c in self.columns]
            lines.append(self.joined(units, self.quoted in ("all", "header")))
        lines += self.between
        first = len(lines) + 1
        for cells in zip(*(c.cells for c in self.columns), strict=True):
            marked = [with_marks(cell, self.decimal, self.thousands) for cell in cells]
            if self.quoted in ("all", "data") or self.delimiter == "":
                lines.append(self.joined(marked, self.quoted in ("all", "data")))
            else:  # not quoted even where the mark is the delimiter: that is the mess
                lines.append(self.delimiter.join(marked) + self.trailing)
        return [*lines, *self.footer], first


def _named(name: str, unit: str, place: str) -> str:
    if not unit or place.startswith("row") or place == "none":
        return name
    if place in ("()", "[]"):
        return f"{name} {place[0]}{unit}{place[1]}"
    if place in ("tight()", "tight[]"):
        return f"{name}{place[-2]}{unit}{place[-1]}"
    return f"{name}{place}{unit}"


@dataclass(frozen=True)
class Refusal:
    """What an expected refusal says: one of the lines (any if empty) and every one of the words ("a|b": either)."""

    lines: tuple[int, ...] = ()
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class Variant:
    """One file of the corpus and what it holds.

    Attributes
    ----------
    name : of the variant.
    text, newline, encoding, bom : the file.
    outcome : "read" (must be read right), "refused" (must be refused), "either" (never wrong).
    oracle : interprets the text, None if it must be refused (which a unit of another quantity asks for, too).
    truth : line -> values of the rows, from the cells before they were written.
    unusable : lines of rows that must have a reason.
    refusal : what a refusal must say; None where nothing is asked.
    layout : what it was written from, None for files made by hand.
    reading : arguments of `Reading`.
    """

    name: str
    text: str
    encoding: str = "utf-8"
    bom: bytes = b""
    newline: str = "\n"
    outcome: str = "read"
    oracle: Oracle | None = None
    truth: Mapping[int, Row] = field(default_factory=dict)
    unusable: frozenset[int] = frozenset()
    refusal: Refusal | None = None
    layout: Layout | None = None
    reading: Mapping[str, Any] = field(default_factory=dict)
    raw: bytes | None = None

    @property
    def data(self) -> bytes:
        """The bytes of the file."""
        return self.raw if self.raw is not None else self.encoded(self.text)

    def encoded(self, text: str) -> bytes:
        """Another text in the encoding of this file."""
        return self.bom + text.encode(self.encoding)

    @property
    def lines(self) -> list[str]:
        """The lines of the file, without their ends."""
        return self.text.split(self.newline)


_BOMS = {"utf-8": codecs.BOM_UTF8, "utf-16-le": codecs.BOM_UTF16_LE, "utf-16-be": codecs.BOM_UTF16_BE}


def build(
    name: str,
    layout: Layout,
    outcome: str = "read",
    refusal: Refusal | None = None,
    finish: Callable[[list[str]], list[str]] | None = None,
    reading: Mapping[str, Any] | None = None,
    meant: Mapping[str, str] | None = None,
) -> Variant:
    """The file of a layout, its oracle and its truth.

    Parameters
    ----------
    finish : changes the finished lines (the truth then comes from the oracle).
    meant : quantity -> unit where that is not the unit of the column (declared elsewhere, or given by the reader's user).
    """
    lines, first = layout.lines()
    meant = meant or {}
    oracle: Oracle | None = None
    truth: dict[int, Row] = {}
    if outcome != "refused" and all(meant.get(c.quantity, c.unit) in FACTOR[c.quantity] for c in layout.columns if c.quantity):
        factors = {
            i: (c.quantity, FACTOR[c.quantity][meant.get(c.quantity, c.unit)])
            for i, c in enumerate(layout.columns)
            if c.quantity
        }
        width = len(layout.columns) + len(layout.trailing)
        oracle = Oracle(layout.delimiter, layout.decimal, factors, width, first, stop=layout.stop)
        if finish is None:
            truth = _truth_of_cells(layout, first, factors)
    if finish is not None:
        lines = finish(lines)
        truth = oracle.interpret(lines) if oracle is not None else {}
    unusable = {line for line, row in truth.items() if any(row.get(q) is None for q in ESSENTIAL if q in row)}
    status = [i for i, c in enumerate(layout.columns) if c.quantity == "status"]
    if status:
        for line in truth:
            cells = split_cells(lines[line - 1], layout.delimiter)
            if status[0] < len(cells) and cells[status[0]] not in ("0", "+0", ""):
                unusable.add(line)
    text = layout.newline.join(lines) + (layout.newline if layout.final_newline else "")
    return Variant(
        name,
        text,
        layout.encoding,
        _BOMS[layout.encoding] if layout.bom else b"",
        layout.newline,
        outcome,
        oracle,
        truth,
        frozenset(unusable),
        refusal,
        layout if finish is None else None,
        reading or {},
    )


def _truth_of_cells(layout: Layout, first: int, factors: Mapping[int, tuple[str, Decimal]]) -> dict[int, Row]:
    truth: dict[int, Row] = {}
    for r in range(len(layout.columns[0].cells)):
        row: dict[str, Decimal | None] = {}
        for i, (quantity, factor) in factors.items():
            cell = layout.columns[i].cells[r].strip()
            if quantity == "status":
                continue
            written = re.fullmatch(r"[+-]?[0-9]*\.?[0-9]+(?:[eE][+-]?[0-9]+)?", cell)
            value = Decimal(cell) if written else None
            lcr = quantity in ("capacitance", "capacitance_series", "dissipation")
            none = value is None or abs(value) >= Decimal("9.9e37") or (lcr and value == 999999)
            row[quantity] = None if none or value is None else value * factor
        if "capacitance_series" in row:
            series, d = row.pop("capacitance_series"), row.get("dissipation")
            if "capacitance" not in row:
                row["capacitance"] = None if series is None or d is None else series / (1 + d * d)
        truth[first + r] = row
    return truth


# ------------------------------------------------------------------------------------------------------------- variants


def corpus(n_row: int = 200) -> tuple[Variant, ...]:
    """All variants, of a pressing with n_row rows (at least 8)."""
    made = [*_machines(n_row), *_words(n_row), *_marks(n_row), *_unit_places(n_row), *_encodings(n_row), *_shapes(n_row)]
    made += [*_specimens(n_row), *_meters(n_row), *_traps(n_row), *_refusals(n_row)]
    names = [v.name for v in made]
    assert len(set(names)) == len(names), "two variants have one name"
    return tuple(made)


def _three(
    n: int,
    names: tuple[str, str, str] = ("Time", "Extension", "Load"),
    units: tuple[str, str, str] = ("s", "mm", "N"),
    digits: tuple[int | None, int | None, int | None] = (-1, -1, -1),
) -> tuple[Column, Column, Column]:
    t, x, f = (
        column(q, name, unit, n, d)
        for q, name, unit, d in zip(("time", "displacement", "force"), names, units, digits, strict=True)
    )
    return t, x, f


def _empty(name: str, n: int, cell: str = "") -> Column:
    return Column("", name, "", (cell,) * n)


def _other(name: str, unit: str, n: int, scale: str = "1.7") -> Column:
    return Column("", name, unit, tuple(f"{Decimal(i) * Decimal(scale) / 10:.4f}" for i in range(n)))


def _machines(n: int) -> list[Variant]:
    block = ('Text Inputs : Specimen label,"s 1"', "General : Start Date,13/11/2018 5:14 PM", "Dimension : Length,50,mm", "")
    segments = column("", "Segment ID", "", n, cells=["22476"] * n)
    cycle = column("cycle", "Total Cycle Count", "", n)
    raw = Layout((*_three(n, units=("sec", "mm", "N")), segments, cycle), prelude=block, newline="\r\n")
    blank = Column("", "1", "", ("",) * n)
    universal = Layout(
        (blank, *_three(n, ("Time", "Displacement", "Force"), ("s", "mm", "kN")), _other("AVE 2", "%", n)),
        thousands=",",
        quoted="data",
        newline="\r\n",
    )
    results = (
        '"Results Table 1"',
        '"","Maximum Load","Compressive extension at Maximum Load","Compressive stress at Maximum Load"',
        '"","(N)","(mm)","(MPa)"',
        '"1","8.366","0.6000","0.0266"',
        '"Mean","8.366","0.6000","0.0266"',
        '"Standard deviation","-----","-----","-----"',
        "",
        '"Raw Data"',
    )
    compressive = ("Time", "Compressive extension", "Compressive load")
    wave = (
        column("time", "Total Time", "s", n, 4),
        column("cycle", "Total Cycles", "", n),
        column("displacement", "Displacement", "mm", n, 6),
        column("force", "Load", "kN", n, 7),
        _other("Torque", "N\u00b7m", n),
    )
    linear = (
        column("time", "Total Time", "s", n, 4),
        column("displacement", "Position(Linear:Digital Position)", "mm", n, 6),
        column("force", "Load(Linear:Load)", "kN", n, 7),
    )
    zwick_results = (
        "Prüfprotokoll\tKompression",
        "Prüfer\tnicht bekannt",
        "Vorkraft\t0.05\tN",
        "Fmax\t8.366\tN",
        "dL bei Fmax\tnicht bekannt\tmm",
        "",
    )
    german = ("Prüfzeit", "Standardweg", "Standardkraft")
    zwick = Layout(
        _three(n, german, digits=(None, None, None)),
        place="row",
        delimiter="\t",
        prelude=zwick_results,
        newline="\r\n",
        encoding="latin-1",
    )
    small = replace(
        zwick,
        columns=tuple(replace(c, cells=tuple(_three_digit_exponent(x) for x in c.cells)) for c in zwick.columns),
        place="row",
    )
    padded = Layout(
        tuple(replace(c, name=f"  {c.name}   ", cells=tuple(f"   {x}" for x in c.cells)) for c in _three(n, german)),
        place="[]",
        delimiter=";",
        encoding="latin-1",
    )
    mts_names = ("Time", "Axial Displacement", "Axial Force")
    mts = Layout(
        _three(n, mts_names, ("Sec", "mm", "kN"), (4, 6, 7)),
        place="row",
        delimiter="\t",
        decimal=",",
        prelude=(
            "MTS793|MPT|DEU|1|2|,|.|:|1|0|0|A",
            "",
            "Data Acquisition: Timed\t\tTime:\t12,5\tSec\t13.11.2018 17:14:00",
        ),
        newline="\r\n",
    )
    weak = replace(mts, columns=_three(n, mts_names, ("Sec", "mm", "N"), (3, 3, 3)))
    shimadzu = Layout(
        _three(n, ("時間", "ストローク", "試験力"), ("sec", "mm", "N")),
        place="row",
        quoted="all",
        prelude=('"試験名","圧縮"', '"試験日","2018/11/13"', "", '"1 _ 1"'),
        newline="\r\n",
        encoding="shift_jis",
    )
    mark10 = Layout(
        (
            column("", "Reading", "", n, cells=[str(i + 1) for i in range(n)]),
            column("force", "Load", "N", n),
            _negative(column("displacement", "Travel", "mm", n)),
            column("time", "Time", "s", n),
        ),
        place="[]",
        delimiter="\t",
        newline="\r\n",
    )
    stable = Layout(
        (column("force", "Force", "g", n, cells=[f"{i * 3.7:.3f}" for i in range(n)]), *_two(n)),
        delimiter=",",
        place="()",
    )
    declared_block = ("Test: compression", "Units : Time,s", "Units : Extension,mm", "Units : Load,kN", "")
    declared = Layout(_three(n, units=("s", "mm", "kN")), place="none", prelude=declared_block)
    declared_de = Layout(
        _three(n, ("Zeit", "Weg", "Kraft"), ("s", "mm", "kN")),
        place="none",
        delimiter=";",
        decimal=",",
        prelude=("Prüfer;M", "Unit Zeit;s", "Unit Weg;mm", "Unit Kraft;kN"),
        encoding="latin-1",
    )
    return [
        build("bluehill raw data, header block", raw),
        build("bluehill raw data, no header block", replace(raw, prelude=())),
        build("bluehill universal", universal),
        build("bluehill universal, header quoted too", replace(universal, quoted="all")),
        build("bluehill universal, blank line first", replace(universal, prelude=("",))),
        build("bluehill results export", Layout(_three(n, compressive), quoted="all", prelude=results, newline="\r\n")),
        build(
            "bluehill results export, plain", Layout(_three(n, compressive), prelude=tuple(x.replace('"', "") for x in results))
        ),
        build("wavematrix", Layout(wave, place="()", bom=True, newline="\r\n")),
        build("wavematrix, channel names", Layout(linear, place="()", bom=True, newline="\r\n"), "either"),
        build("zwick, exponents", zwick),
        build("zwick, exponents of three digits", small),
        build("zwick, semicolons and padding", padded),
        build("mts, decimal comma declared", mts),
        build("mts, decimal comma declared and nothing else tells", weak, "either"),
        build(
            "mts, decimal point declared, thousands commas in tab cells",
            replace(
                mts, decimal=".", thousands=",", prelude=("MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A", "", "Data Acquisition: Timed")
            ),
        ),
        _mts_blocks("mts, blocks repeat the header, time goes on", mts, n, restart=False),
        _mts_blocks("mts, blocks repeat the header, the second is longer", mts, n, restart=False, part=3),
        _mts_blocks("mts, blocks repeat the header, time restarts", mts, n, restart=True),
        build("shimadzu shift-jis", shimadzu),
        build("mark-10", mark10),
        build(
            "ta.xt grams",
            stable,
        ),
        build(
            "ta.xt grams, told that they are gram-force",
            replace(stable, columns=(replace(stable.columns[0], unit="g"), *stable.columns[1:])),
            reading={"units": {"force": "gf"}},
            meant={"force": "gf"},
        ),
        build("units declared in the header block", declared),
        build("units declared in a german header block", declared_de),
    ]


def _two(n: int) -> tuple[Column, Column]:
    return column("displacement", "Distance", "mm", n), column("time", "Time", "s", n)


def _negative(c: Column) -> Column:
    return replace(c, cells=tuple(x[1:] if x.startswith("-") else f"-{x}" for x in c.cells))


def _three_digit_exponent(cell: str) -> str:
    mantissa, exponent = cell.split("E")
    return f"{mantissa}e{exponent[0]}{int(exponent[1:]):03d}"


def _mts_blocks(name: str, layout: Layout, n: int, restart: bool, part: int = 2) -> Variant:
    half = n // part
    head = [layout.joined(layout.header(), False), layout.joined([c.unit for c in layout.columns], False)]

    def finish(lines: list[str]) -> list[str]:
        start = len(lines) - n
        second = lines[start : start + half] if restart else lines[start + half :]
        return [*lines[: start + half], "", layout.prelude[-1], *head, *second]

    if restart:
        return build(name, layout, "refused", Refusal((), ("specimen|second header|time",)), finish)
    return build(name, layout, finish=finish)


def _words(n: int) -> list[Variant]:
    words = {
        "english": [("Time", "Displacement", "Force"), ("Elapsed time", "Crosshead", "Load"), ("TIME", "EXTENSION", "LOAD")],
        "german": [("Zeit", "Traversenweg", "Kraft"), ("Zeit", "Standardweg", "Standardkraft"), ("Prüfzeit", "Weg", "Last")],
        "french": [("Temps", "Déplacement", "Force"), ("Temps", "Déplacement", "Charge")],
        "spanish": [("Tiempo", "Desplazamiento", "Fuerza"), ("Tiempo", "Extensión", "Carga")],
        "chinese": [("时间", "位移", "载荷"), ("时间", "位移", "力")],
        "japanese": [("時間", "変位", "荷重"), ("時間", "ストローク", "試験力")],
    }
    codec = {"chinese": "gbk", "japanese": "shift_jis"}
    made = []
    for language, triples in words.items():
        for i, triple in enumerate(triples, start=1):
            layout = Layout(_three(n, triple), place="()", delimiter=";", decimal="." if language == "english" else ",")
            made.append(build(f"{language} names {i}, utf-8", layout))
            if language != "english":
                encoding = codec.get(language, "latin-1")
                made.append(build(f"{language} names {i}, {encoding}", replace(layout, encoding=encoding, place="row()")))
    return made


def _marks(n: int) -> list[Variant]:
    three = _three(n)
    point = Layout(three)
    made = []
    for label, delimiter in {"commas": ",", "semicolons": ";", "tabs": "\t"}.items():
        made.append(build(f"delimiter {label}, decimal point", replace(point, delimiter=delimiter)))
        made.append(
            build(f"delimiter {label}, everything quoted", replace(point, delimiter=delimiter, quoted="all", decimal=","))
        )
    made += [
        build("delimiter blanks", replace(point, delimiter="", place="row")),
        build("delimiter blanks, decimal comma", replace(point, delimiter="", decimal=",", place="row")),
        build("delimiter blanks, units in the names", replace(point, delimiter="", place="tight()")),
        build("delimiter semicolons, decimal comma", replace(point, delimiter=";", decimal=",")),
        build("delimiter tabs, decimal comma", replace(point, delimiter="\t", decimal=",")),
        build("rows end with a delimiter", replace(point, delimiter=";", trailing=";")),
        build("carriage returns only", replace(point, newline="\r")),
        build("no line end at the end", replace(point, newline="\r\n", final_newline=False)),
        build(
            "decimal comma between commas, unquoted", replace(point, decimal=","), "refused", Refusal((3,), ("cells|decimal",))
        ),
        build("three decimals everywhere, comma, nothing tells", _only_weak(n), "refused", Refusal((), ("decimal|thousands",))),
    ]
    ms = _three(n, units=("ms", "um", "mN"))
    for label, mark, decimal in (
        ("commas", ",", "."),
        ("points", ".", ","),
        ("blanks", " ", "."),
        ("apostrophes", "'", "."),
        ("typographic apostrophes", "’", ","),
        ("no-break spaces", "\u00a0", ","),
        ("narrow no-break spaces", "\u202f", ","),
    ):
        layout = Layout(three, delimiter=";", decimal=decimal, thousands=mark)
        made.append(build(f"thousands {label}, only late", layout, "either" if "typographic" in label else "read"))
        early = replace(layout, columns=ms, delimiter="\t")
        made.append(build(f"thousands {label}, everywhere", early, "either" if "typographic" in label else "read"))
    made.append(build("thousands commas, quoted between commas", Layout(ms, thousands=",", quoted="data")))
    made.append(
        build(
            "thousands commas, unquoted between commas",
            Layout(three, thousands=","),
            "refused",
            Refusal((), ("cells|thousands|decimal",)),
        )
    )
    return made


def _only_weak(n: int) -> Layout:
    columns = _three(n)
    cells = [tuple(f"{1 + (i * k) % 899}.{100 + (i * 7 * k) % 899}" for i in range(n)) for k in (1, 3, 5)]
    return Layout(
        tuple(replace(c, cells=x) for c, x in zip(columns, cells, strict=True)), delimiter=";", decimal=",", place="row()"
    )


def _unit_places(n: int) -> list[Variant]:
    made = []
    for label, place in {
        "row": "row",
        "row with parentheses": "row()",
        "row with brackets": "row[]",
        "parentheses": "()",
        "brackets": "[]",
        "tight parentheses": "tight()",
        "tight brackets": "tight[]",
        "comma": ", ",
        "slash": "/",
        "slash with blanks": " / ",
        "underscore": "_",
    }.items():
        made.append(build(f"unit in a {label}", Layout(_three(n, units=("s", "mm", "kN")), place=place, delimiter=";")))
    made.append(build("unit after a quoted comma", Layout(_three(n), place=", ", quoted="header")))
    for units in (
        ("ms", "um", "mN"),
        ("min", "\u00b5m", "gf"),
        ("minutes", "\u03bcm", "kgf"),
        ("sec", "in", "lbf"),
        ("s", "inch", "lbf"),
        ("s", "m", "N"),
    ):
        label = " ".join(units).replace("\u03bc", "greek mu ").replace("\u00b5", "micro sign ")
        made.append(build(f"units {label}", Layout(_three(n, units=units), place="()")))
    made.append(build("micro sign in latin-1", Layout(_three(n, units=("s", "\u00b5m", "N")), encoding="latin-1")))
    return made


def _encodings(n: int) -> list[Variant]:
    layout = Layout(
        _three(n, ("Zeit", "Traversenweg", "Kraft"), ("s", "\u00b5m", "N")), delimiter=";", decimal=",", newline="\r\n"
    )
    chinese = replace(layout, columns=_three(n, ("时间", "位移", "载荷")))
    return [
        build(
            f"encoding {encoding}{' with' if bom else ' without'} byte order mark", replace(layout, encoding=encoding, bom=bom)
        )
        for encoding in ("utf-8", "utf-16-le", "utf-16-be")
        for bom in (False, True)
    ] + [
        build("chinese in utf-16 without byte order mark", replace(chinese, encoding="utf-16-le")),
        build("chinese in utf-16-be with byte order mark", replace(chinese, encoding="utf-16-be", bom=True)),
        build("chinese in gb18030", replace(chinese, encoding="gb18030", prelude=("试样;硅胶",))),
        build("japanese in euc-jp", replace(layout, columns=_three(n, ("時間", "変位", "荷重")), encoding="euc_jp"), "either"),
        build("german in mac-roman", replace(layout, encoding="mac_roman", prelude=("Prüfer;M",)), "either"),
    ]


def _shapes(n: int) -> list[Variant]:
    t, x, f = _three(n)
    stress, strain, temperature = (
        _other("Compressive stress", "MPa", n),
        _other("Compressive strain", "mm/mm", n),
        _other("Temperature", "°C", n),
    )
    gaps = tuple(c if i % 9 else "" for i, c in enumerate(f.cells))
    statistics = ("", "Statistics", "n,Fmax,dL", "1,8.366,0.600", "2,8.401,0.600")
    return [
        build("columns in another order", Layout((f, t, x))),
        build("extra columns before and between", Layout((stress, t, strain, x, temperature, f))),
        build("empty columns", Layout((_empty("", n), t, _empty("", n), x, f, _empty("", n), _empty("", n)))),
        build("unnamed column with numbers", Layout((t, x, replace(stress, name="", unit=""), f))),
        build("repeated extra columns", Layout((t, stress, x, stress, f, stress), place="()")),
        build("the same force column twice", Layout((t, x, f, replace(f, quantity=""))), "either", Refusal((1,), ("Load",))),
        build("displacement and force without time", Layout((x, f))),
        build("footer", Layout((t, x, f), footer=("", "Total_Measurement_Time(s),65.677", "End of test"))),
        build("statistics below the rows", Layout((t, x, f), footer=statistics, stop="Statistics"), "either"),
        build("blank lines between header and rows", Layout((t, x, f), between=("", ""))),
        build("empty cells", Layout((t, x, replace(f, cells=gaps)))),
        build(
            "aborted run, fewer cells in the last row", Layout((t, x, f)), finish=lambda lines: [*lines[:-1], lines[-1][:11]]
        ),
        build("aborted run, cut after a minus", Layout((t, x, f)), "either", finish=lambda lines: [*lines[:-1], lines[-1][:9]]),
        build(
            "aborted run, semicolons and comma, crlf",
            Layout((t, x, f), delimiter=";", decimal=",", newline="\r\n", final_newline=False),
            finish=lambda lines: [*lines[:-1], lines[-1].split(";")[0]],
        ),
        build(
            "blank lines among the rows",
            Layout((t, x, f)),
            finish=lambda lines: [*lines[: n // 2], "", "", *lines[n // 2 :]],
        ),
        _units_within_the_cells(Layout((t, replace(x, cells=tuple(f"{c} mm" for c in x.cells)), f), place="()")),
        build(
            "line break within a header cell",
            Layout((t, x, f), place="none", prelude=()),
            "either",
            finish=lambda lines: ['"Time', '(s)","Extension', '(mm)","Load', '(N)"', *lines[1:]],
        ),
        build("typographic minus", Layout((t, x, f)), "either", finish=lambda lines: [i.replace("-", "\u2212") for i in lines]),
        build("plus signs", Layout((t, _plus(x), _plus(f)))),
        build("sep= line of a spreadsheet program", Layout((t, x, f), delimiter=";", prelude=("sep=;",))),
        build("comments above", Layout((t, x, f), place="()", prelude=("# made by a script", "# Time, Extension and Load"))),
        build("the program's own columns", _own_columns(n)),
        build("which column is told by its header", _two_loads(n), reading={"columns": {"force": "Load B (N)"}}),
        build("which column is told by its number", _two_loads(n), reading={"columns": {"force": "4"}}),
        build(
            "the unit is told",
            Layout((t, x, f), place="none"),
            reading={"units": {"time": "s", "displacement": "mm", "force": "N"}},
        ),
        build(
            "another unit is told than the file says",
            Layout((t, x, f)),
            reading={"units": {"force": "kN"}},
            meant={"force": "kN"},
        ),
    ]


def _units_within_the_cells(layout: Layout) -> Variant:
    variant = build("units within the cells", layout, "either")
    assert variant.oracle is not None
    oracle = replace(variant.oracle, suffix=" mm")
    return replace(variant, oracle=oracle, truth=oracle.interpret(variant.lines), unusable=frozenset(), layout=None)


def _plus(c: Column) -> Column:
    return replace(c, cells=tuple(x if x.startswith("-") else f"+{x}" for x in c.cells))


def _own_columns(n: int) -> Layout:
    columns = _three(n, ("time", "displacement", "force"), ("s", "m", "N"))
    return Layout((*columns, _empty("branch", n, "loading"), _empty("used", n, "True"), _empty("reason", n)), place="_")


def _two_loads(n: int) -> Layout:
    t, x, f = _three(n)
    other = replace(_other("Load A", "N", n), quantity="")
    return Layout((t, x, other, replace(f, name="Load B")), place="()")


def _specimens(n: int) -> list[Variant]:
    made = []
    for label, first in (("", n), ("the first cut short ", n // 2), ("the first of one row ", 1)):
        made += _specimen_blocks(f"specimens in blocks, {label}".rstrip(" ,"), first, n)
    lists = Refusal((), ("specimen", "1", "2"))
    minutes = tuple(
        column(q, w, u, n)
        for q, w, u in (("force", "Load", "N"), ("displacement", "Displacement", "mm"), ("time", "Time", "min"))
    )
    event = _empty("Event", n)
    doubled = (replace(minutes[0], cells=tuple(f"{Decimal(c) * 2:.3f}" for c in minutes[0].cells)), *minutes[1:])
    both = Layout(
        (*minutes, event, *doubled, event), place="()", delimiter="\t", prelude=("silicone 1\t\t\t\t\t\t\t",), newline="\r\n"
    )
    side = build("", replace(both, columns=tuple(replace(c, quantity="") for c in both.columns)))
    made.append(
        replace(side, name="mecmesin, side by side", outcome="refused", refusal=lists, layout=None, oracle=None, truth={})
    )
    for k in (1, 2):
        chosen = range(4) if k == 1 else range(4, 8)
        own = build(
            f"mecmesin, side by side, number {k}",
            replace(both, columns=tuple(c if i in chosen else replace(c, quantity="") for i, c in enumerate(both.columns))),
            reading={"specimen": k},
        )
        made.append(replace(own, layout=None))
    single = replace(both, columns=(*minutes, event), prelude=("silicone 1\t\t\t",))
    made.append(build("mecmesin, one specimen", single))
    return made


def _specimen_blocks(name: str, n_first: int, n: int) -> list[Variant]:
    # One header and one block of rows for each specimen, the second with twice the force.
    t, x, f = _three(n)
    second = Layout((t, x, replace(f, cells=tuple(f"{Decimal(c) * 2:.3f}" for c in f.cells))))
    first = Layout(tuple(replace(c, cells=c.cells[:n_first]) for c in (t, x, f)))
    above = first.lines()[0]
    text = "\n".join(["Specimen 1", *above, "", "Specimen 2", *second.lines()[0]]) + "\n"
    made = [Variant(name, text, outcome="refused", refusal=Refusal((), ("specimen", "1", "2")))]
    for k, (layout, shift) in enumerate(((first, 1), (second, len(above) + 3)), start=1):
        own = build("", layout)
        assert own.oracle is not None
        begin = own.oracle.first + shift
        made.append(
            replace(
                own,
                name=f"{name}, number {k}",
                text=text,
                oracle=replace(own.oracle, first=begin, last=begin + len(own.truth) - 1),
                truth={line + shift: row for line, row in own.truth.items()},
                layout=None,
                reading={"specimen": k},
            )
        )
    return made


def _meters(n: int) -> list[Variant]:
    t = column("time", "Time", "s", n)
    cp = column("capacitance", "Cp", "pF", n)
    d = column("dissipation", "D", "", n)
    status = replace(column("status", "Status", "", n), cells=tuple("2" if i == n // 2 else "0" for i in range(n)))
    farad = column("capacitance", "CP", "F", n)
    hz = column("frequency", "Frequency", "Hz", n)
    log = Layout((t, cp, d, status), place="()")
    made = [
        build("lcr log with status", log),
        build("lcr log in farads, tsv", Layout((t, farad, d), place="()", delimiter="\t")),
        build("lcr log with frequency", Layout((t, hz, farad, d), place="tight[]")),
        build(
            "lcr log, decimal comma and thousands points",
            Layout((t, cp, d), place="()", delimiter=";", decimal=",", thousands="."),
        ),
        build("lcr log over force", Layout((column("force", "Force", "N", n), cp, d), place="()")),
        build("everything in one table", Layout((*_three(n), cp, d), place="()")),
        build(
            "lcr log in german",
            Layout(
                (column("time", "Zeit", "s", n), column("capacitance", "Kapazität", "pF", n)),
                place="[]",
                delimiter=";",
                decimal=",",
                encoding="latin-1",
            ),
        ),
        build(
            "lcr log in french",
            Layout(
                (column("time", "Temps", "s", n), column("capacitance", "Capacité", "nF", n)),
                place="()",
                delimiter=";",
                decimal=",",
            ),
        ),
        build(
            "lcr log in spanish 1",
            Layout(
                (column("time", "Tiempo", "s", n), column("capacitance", "Capacitancia", "nF", n)),
                place="()",
                delimiter=";",
                decimal=",",
            ),
        ),
        build(
            "lcr log in spanish 2",
            Layout(
                (column("time", "Tiempo", "s", n), column("capacitance", "Capacidad", "pF", n)),
                place="()",
                delimiter=";",
                decimal=",",
            ),
        ),
        build("lcr log, series capacitance with D", Layout((t, column("capacitance_series", "Cs", "pF", n), d), place="()")),
        build(
            "lcr log, series capacitance without D",
            Layout((t, column("capacitance_series", "Cs", "pF", n)), place="()"),
            "refused",
            Refusal((1,), ("series",)),
        ),
        build("capacitance in uF", Layout((t, column("capacitance", "Cp", "uF", n), d), place="()")),
        build("capacitance in micro sign F", Layout((t, column("capacitance", "Cp", "\u00b5F", n), d), place="()")),
    ]
    for word in ("9.9E37", "9.90000E+37", "+9.90000E+37", "-9.9E37", "999999", "OVER", "OV01", "OL", "----", "*****"):
        cells = tuple(word if i in (1, n - 2) else c for i, c in enumerate(cp.cells))
        made.append(build(f"no reading written {word}", Layout((t, replace(cp, cells=cells), d), place="()")))
    signed = replace(status, cells=tuple("+1" if i == 1 else "-1" if i == 2 else "+0" for i in range(n)))
    keysight = (t, replace(farad, name="Cp"), d, signed)
    made.append(build("keysight with time and header", Layout(keysight, place="()")))
    bare = [f"{a},+{b},+0" for a, b in zip((f"+{c}" for c in farad.cells), d.cells, strict=True)]
    nothing_ties = Refusal((), ("time|header|force",))
    made.append(Variant("keysight replies without time", "\n".join(bare) + "\n", outcome="refused", refusal=nothing_ties))
    hioki = [f"0,CP {a},D {b},0" for a, b in zip(farad.cells, d.cells, strict=True)]
    made.append(
        Variant(
            "hioki replies without time", "\r\n".join(hioki) + "\r\n", newline="\r\n", outcome="refused", refusal=nothing_ties
        )
    )
    gw = [
        line
        for i, c in enumerate(cp.cells)
        for line in (("MAIN:PRIM OV01" if i == 1 else f"MAIN:PRIM {c}pF"), f"MAIN:SECO {d.cells[i]}")
    ]
    made.append(
        Variant(
            "gw instek text log without time", "\r\n".join(gw) + "\r\n", newline="\r\n", outcome="refused", refusal=nothing_ties
        )
    )
    analyser_block = (
        "IM3570", "Ver,2.00", "DATE,18-11-13", "TIME,17:14:00", "MODE,ANALYZER", "SWEEP PARAMETER,FREQUENCY", "TRIGGER,SEQ",
        "DELAY,0.0000", "SPEED,MED", "AVERAGE,OFF", "LEVEL,V", "VOLTAGE,1.000", "RANGE,AUTO", "LOW Z,OFF", "DC BIAS,OFF",
        "CABLE,1m", "OPEN,OFF", "",
    )  # fmt: skip
    number = column("", "No.", "", n, cells=[str(i + 1) for i in range(n)])
    swept = replace(hz, name="FREQ", cells=tuple(f"{100 * (i + 1)}" for i in range(n)))
    analyser = Layout((number, swept, farad, d), place="tight[]", prelude=analyser_block, newline="\r\n")
    made.append(build("impedance analyser sweep without time", analyser, "refused", Refusal((), ("time|force",))))
    timed = replace(analyser, columns=(number, replace(t, name="TIME"), farad, d))
    made.append(build("impedance analyser log with time", timed))
    return made


def _traps(n: int) -> list[Variant]:
    t, x, f = _three(n)
    layout = Layout((t, x, f))
    whole = tuple(
        replace(c, unit=u, cells=tuple(f"{Decimal(v).scaleb(3):.0f}" for v in c.cells))
        for c, u in zip((t, x, f), ("ms", "um", "mN"), strict=True)
    )
    same_names = ("Results", "Time,Extension,Load", "(s),(mm),(kN)", "676.36,0.5918,0.0082", "", "Raw data")
    two_results = (*same_names[:4], "676.40,0.5920,0.0083", *same_names[4:])
    resets = Column("", "Cycle Elapsed Time", "s", tuple(f"{Decimal(i % 5) / 10:.2f}" for i in range(n)))
    same = Column("", "Total Time", "s", t.cells)
    block = ("Load cell,10,kN", "Extension rate,1,mm/s", "Preload,0.05,N", "Time of test,17,s", "")
    declared = ("Units : Load,kN",)
    return [
        build("whole numbers with thousands points", Layout(whole, delimiter=";", decimal=",", thousands="."), "either"),
        build("whole numbers with thousands commas", Layout(whole, delimiter=";", thousands=","), "either"),
        build("whole numbers with thousands commas, quoted", Layout(whole, thousands=",", quoted="all"), "either"),
        build("one result under the same names in kN above the rows", replace(layout, prelude=same_names), "either"),
        build("two results under the same names in kN above the rows", replace(layout, prelude=two_results), "either"),
        build("time within the cycle beside the total time", Layout((resets, replace(t, name="Total Time"), x, f)), "either"),
        build("two equal time columns", Layout((same, t, x, f)), "either"),
        build("a load cell is no unit", replace(layout, place="none", prelude=block), "refused", Refusal((6,), ("unit",))),
        build("declared and written units contradict", replace(layout, prelude=declared), "either"),
        build("a unit in the name and a blank units row", replace(layout, place="()", between=(",,",)), "either"),
        build("stress beside the load in one unit row", Layout((t, x, _other("Load stress", "MPa", n), f))),
        build("percentages beside the lengths", Layout((t, _other("Extension strain", "%", n), x, f), place="()")),
        build("only a corrected force", Layout((t, x, replace(f, name="Corrected Force")), place="()")),
        build("a pre-load column before the load", Layout((t, x, _empty("Preload", n, "0.05"), f), place="()")),
        build("one word below the rows", Layout((t, x, f), place="()", footer=("EOF",))),
    ]


def _refusals(n: int) -> list[Variant]:
    t, x, f = _three(n)
    damaged = tuple(c.replace(".", ",") if i % 2 else c for i, c in enumerate(x.cells))
    bad_unit = Refusal((2,), ("furlongz",))
    layout = Layout((t, x, f))
    rows = "\n".join(layout.lines()[0][2:])
    return [
        build(
            "damaged by a spreadsheet program",
            Layout((t, replace(x, cells=damaged), f), delimiter=";"),
            "refused",
            Refusal((), ("decimal",)),
        ),
        build("no units anywhere", replace(layout, place="none"), "refused", Refusal((1,), ("unit",))),
        build(
            "one unit missing",
            replace(layout, columns=(t, x, replace(f, unit=""))),
            "refused",
            Refusal((1, 2), ("unit", "Load")),
        ),
        build("unknown unit", replace(layout, columns=(t, x, replace(f, unit="furlongz"))), "refused", bad_unit),
        build(
            "unit of another quantity",
            replace(layout, columns=(t, x, replace(f, unit="mm"))),
            "refused",
            Refusal((2,), ("mm",)),
        ),
        build(
            "two units that contradict",
            replace(layout, columns=(t, x, replace(f, name="Load (kN)"))),
            "refused",
            Refusal((2, 1), ("kN",)),
        ),
        build(
            "two time columns of one name",
            replace(layout, columns=(t, replace(t, cells=x.cells), x, f)),
            "refused",
            Refusal((1,), ("Time",)),
        ),
        build(
            "names that mean nothing",
            replace(layout, columns=tuple(replace(c, name=w) for c, w in zip((t, x, f), "abc", strict=True))),
            "refused",
            Refusal((), ("header|column|name",)),
        ),
        build("force column missing", replace(layout, columns=(t, x)), "refused", Refusal((1,), ("force",))),
        build(
            "text in a number cell",
            replace(layout, columns=(t, x, replace(f, cells=(*f.cells[:4], "abc", *f.cells[5:])))),
            "refused",
            Refusal((7,), ("abc",)),
        ),
        build(
            "number with a tail",
            replace(layout, columns=(t, x, replace(f, cells=(*f.cells[:4], "1.2x", *f.cells[5:])))),
            "refused",
            Refusal((7,), ("1.2x",)),
        ),
        build(
            "one row too wide", layout, "refused", Refusal((6,), ("cells",)), finish=lambda i: [*i[:5], i[5] + ",1.5", *i[6:]]
        ),
        Variant("header missing", rows + "\n", outcome="refused", refusal=Refusal((), ("header",))),
        Variant(
            "header but no rows", "\n".join(layout.lines()[0][:2]) + "\n", outcome="refused", refusal=Refusal((), ("row",))
        ),
        Variant("empty file", "", outcome="refused", refusal=Refusal((), ("empty",))),
        Variant("only line ends", "\r\n\r\n", outcome="refused", refusal=Refusal((), ("empty",))),
        Variant("only a byte order mark", "", bom=codecs.BOM_UTF8, outcome="refused", refusal=Refusal((), ("empty",))),
        Variant(
            "workbook",
            "",
            raw=b"PK\x03\x04\x14\x00\x06\x00\x08\x00\x00\x00!\x00" + bytes(range(256)) * 8,
            outcome="refused",
            refusal=Refusal((), ("text|workbook|xlsx",)),
        ),
        Variant(
            "old workbook",
            "",
            raw=b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(64) + bytes(range(256)) * 8,
            outcome="refused",
            refusal=Refusal((), ("text|workbook|xls",)),
        ),
        Variant(
            "zero bytes within",
            "",
            raw=layout.joined(["Time (s)", "Extension (mm)", "Load (N)"], False).encode()
            + b"\n0.0,0.1,1\n\x00\x00\x00\x00\n1.0,0.2,2\n",
            outcome="refused",
            refusal=Refusal((), ("text|zero|NUL|byte",)),
        ),
        Variant(
            "a web page",
            "<!DOCTYPE html>\n<html><body>\n<p>404, not found</p>\n</body></html>\n",
            outcome="refused",
            refusal=Refusal(),
        ),
        Variant(
            "prose", "This is a note, and nothing else.\nThe test, 3 of 5, was aborted.\n", outcome="refused", refusal=Refusal()
        ),
    ]

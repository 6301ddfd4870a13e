"""A random table in a random layout is read back to the written values, or refused where the layout tells nothing."""

from __future__ import annotations

import sys
from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from calib.errors import InputError
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.reader import read_lab_file

sys.path.insert(0, str(Path(__file__).parent))

from lab_corpus import FACTOR, Column, Layout, Variant, build, disagreement, plain_number, split_cells

#: Language -> names of time, displacement, force, and the encodings that can hold them.
NAMES = {
    "english": ("Time", ("Extension", "Displacement", "Compressive extension"), ("Load", "Force", "Compressive load")),
    "german": ("Zeit", ("Traversenweg", "Standardweg"), ("Kraft", "Standardkraft")),
    "french": ("Temps", ("Déplacement",), ("Force", "Charge")),
    "spanish": ("Tiempo", ("Desplazamiento", "Extensión"), ("Fuerza", "Carga")),
    "chinese": ("时间", ("位移",), ("载荷", "力")),
    "japanese": ("時間", ("変位", "ストローク"), ("荷重", "試験力")),
}
ENCODINGS = {
    "chinese": (("utf-8", False), ("utf-8", True), ("utf-16-le", True), ("gbk", False)),
    "japanese": (("utf-8", False), ("utf-8", True), ("utf-16-be", True), ("shift_jis", False)),
}
LATIN = (("utf-8", False), ("utf-8", True), ("utf-16-le", True), ("utf-16-le", False), ("utf-16-be", True), ("latin-1", False))
DELIMITERS = (",", ";", "\t", "")
PLACES = ("row", "row()", "row[]", "()", "[]", ", ", "/", "_", "tight()", "tight[]")
TIMES = ("s", "sec", "ms", "min")
LENGTHS = ("mm", "um", "\u00b5m", "m", "in", "inch")
FORCES = ("N", "kN", "mN", "gf", "kgf", "lbf")
CAPACITANCES = ("pF", "nF", "uF", "F")
THOUSANDS = {".": ("", "", ",", " ", "'", "\u00a0"), ",": ("", "", ".", " ", "\u00a0", "\u202f")}


#: What a test of a small sample reaches [SI]; a reader may refuse what is beyond.
LARGEST = {"displacement": Decimal("0.02"), "force": Decimal(400), "capacitance": Decimal("4e-10"), "": Decimal(5)}


@st.composite
def numbers(draw: st.DrawFn, n_row: int, quantity: str, unit: str, signed: bool = True) -> tuple[str, ...]:
    """Texts of n_row numbers up to the largest value of the quantity, all with one number of digits after the point."""
    largest = LARGEST[quantity] / FACTOR[quantity][unit] if quantity else LARGEST[""]
    digits = max(1, 2 - largest.adjusted()) + draw(st.integers(0, 3))
    top = int(largest.scaleb(digits))
    values = draw(st.lists(st.integers(-top if signed else 0, top), min_size=n_row - 1, max_size=n_row - 1))
    values.insert(draw(st.integers(0, n_row - 1)), draw(st.integers(top // 2, top)))
    return tuple(f"{Decimal(v).scaleb(-digits):.{digits}f}" for v in values)


@st.composite
def layouts(draw: st.DrawFn) -> Layout:
    """A table of a testing machine or an LCR meter of 3 to 9 rows in some layout."""
    language = draw(st.sampled_from(sorted(NAMES)))
    time_name, lengths, forces = NAMES[language]
    n = draw(st.integers(3, 9))
    start, step = draw(st.integers(0, 200_000)), draw(st.integers(1, 99_999))
    times = tuple(f"{Decimal(start + i * step) / 100:.2f}" for i in range(n))
    time = Column("time", time_name, draw(st.sampled_from(TIMES)), times)
    delimiter = draw(st.sampled_from(DELIMITERS))
    if draw(st.integers(0, 3)):
        length, load = draw(st.sampled_from(LENGTHS)), draw(st.sampled_from(FORCES))
        names = [x for x in lengths if delimiter or " " not in x], [x for x in forces if delimiter or " " not in x]
        columns = [
            time,
            Column("displacement", draw(st.sampled_from(names[0])), length, draw(numbers(n, "displacement", length))),
            Column("force", draw(st.sampled_from(names[1])), load, draw(numbers(n, "force", load))),
        ]
        if draw(st.booleans()) and delimiter:
            columns.append(Column("", "Compressive stress", "MPa", draw(numbers(n, "", ""))))
        if draw(st.booleans()) and delimiter:
            columns.append(Column("", "Segment ID", "", ("22476",) * n))
    else:
        farad = draw(st.sampled_from(CAPACITANCES))
        columns = [time, Column("capacitance", "Cp", farad, draw(numbers(n, "capacitance", farad, signed=False)))]
        if draw(st.booleans()):
            loss = draw(st.lists(st.integers(1, 9999), min_size=n, max_size=n))
            columns.append(Column("dissipation", "D", "", tuple(f"0.0{d:04d}" for d in loss)))
    columns = draw(st.permutations(columns))
    decimal = draw(st.sampled_from((".", ",")))
    thousands = draw(st.sampled_from(THOUSANDS[decimal]))
    place = draw(st.sampled_from(PLACES))
    quoted = draw(st.sampled_from(("", "", "all", "data", "header")))
    if delimiter == "":  # blanks part the cells: none within a cell, no empty cell, nothing quoted
        thousands = "" if thousands.isspace() else thousands
        place = "tight()" if place in ("()", "[]", ", ") or place.startswith("row") else place
        quoted = ""
    elif place == ", ":
        quoted = "header" if delimiter == "," and not quoted else quoted
    encoding, bom = draw(st.sampled_from(ENCODINGS.get(language, LATIN)))
    written = thousands + "".join(c.name + c.unit for c in columns)
    if written.encode(encoding, errors="replace").decode(encoding) != written:
        encoding, bom = "utf-8", False
    prelude = draw(
        st.sampled_from(((), (), ("Test 17",), ("Operator: M", ""), ("Specimen label: s 1", "Date: 13/11/2018", "")))
    )
    newline = draw(st.sampled_from(("\n", "\r\n", "\r")))
    return Layout(
        tuple(columns),
        place,
        delimiter,
        decimal,
        thousands,
        quoted,
        newline,
        encoding,
        bom,
        prelude,
        final_newline=draw(st.booleans()),
    )


def ambiguous(variant: Variant) -> bool:
    """Whether the text does not tell what its marks mean, or cannot be cut into cells."""
    layout = variant.layout
    assert layout is not None
    bare = layout.quoted not in ("all", "data")
    rows = [variant.lines[line - 1] for line in variant.truth]
    if (
        layout.delimiter == ","
        and bare
        and (layout.decimal == "," or any(len(r.split(",")) > len(layout.columns) for r in rows))
    ):
        return True
    cells = [c for r in rows for c in split_cells(r, layout.delimiter)]
    other = {".": ",", ",": "."}[layout.decimal]
    told = any(plain_number(c, layout.decimal) is not None and plain_number(c, other) is None for c in cells)
    marked = any("," in c or "." in c for c in cells)
    return marked and not told


@settings(max_examples=400, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(layout=layouts())
def test_a_random_table_in_a_random_layout_is_read_back(tmp_path: Path, layout: Layout) -> None:
    variant = build("random", layout, "either")
    assert variant.oracle is not None
    path = tmp_path / "lab.csv"
    path.unlink(missing_ok=True)  # a file that is written over waits for the disk
    path.write_bytes(variant.data)
    unclear = ambiguous(variant)
    try:
        table = read_lab_file(path)
    except InputError as error:
        if unclear:
            return
        # Numbers that jump by the factor between two units, as random ones may, are read once the unit is said again.
        jumping = {c.quantity: c.unit for c in layout.columns if f"--units {c.quantity}=..." in str(error)}
        if not jumping or "If a unit or a range was switched there" not in str(error):
            pytest.fail(f"refused: {error}\n{variant.text!r}")
        table = read_lab_file(path, Reading(units=jumping))
    cut_wrong = layout.delimiter == "," and layout.decimal == "," and layout.quoted not in ("all", "data")
    assert not cut_wrong, f"decimal commas between commas are read: {variant.text!r}"
    rows = variant.oracle.interpret(variant.lines) if unclear else variant.truth
    assert disagreement(table, rows) == "", variant.text


@settings(max_examples=150, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(layout=layouts(), which=st.integers(0, 9))
def test_without_a_unit_no_random_table_is_read(tmp_path: Path, layout: Layout, which: int) -> None:
    essential = [i for i, c in enumerate(layout.columns) if c.quantity in ("time", "displacement", "force", "capacitance")]
    bare = essential[which % len(essential)]
    columns = tuple(Column(c.quantity, c.name, "" if i == bare else c.unit, c.cells) for i, c in enumerate(layout.columns))
    shown = Layout(columns, layout.place, layout.delimiter, layout.decimal, layout.thousands, layout.quoted, layout.newline)
    path = tmp_path / "lab.csv"
    path.unlink(missing_ok=True)
    path.write_bytes(shown.newline.join(shown.lines()[0]).encode())
    with pytest.raises(InputError):
        read_lab_file(path)


@pytest.mark.parametrize("unit", sorted(set(FACTOR["force"]) | set(FACTOR["displacement"]) | set(FACTOR["time"])))
def test_every_unit_has_its_factor(tmp_path: Path, unit: str) -> None:
    quantity = next(q for q in ("force", "displacement", "time") if unit in FACTOR[q])
    units = {"time": "s", "displacement": "mm", "force": "N", quantity: unit}
    names = {"time": "Time", "displacement": "Extension", "force": "Load"}
    small = {"m": ("0.00125", "0.0025", "0.00475")}
    columns = tuple(Column(q, names[q], units[q], small.get(units[q], ("0.25", "0.5", "0.75"))) for q in names)
    variant = build(unit, Layout(columns))
    path = tmp_path / "lab.csv"
    path.write_bytes(variant.data)
    assert disagreement(read_lab_file(path), variant.truth) == ""

"""Every messy file of the corpus is read to the exact values or refused with the right line, and no damage is read silently."""

from __future__ import annotations

import random
import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from calib.errors import InputError
from calib.lab.instruments.labtable import LabTable
from calib.lab.instruments.reader import read_lab_file

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "benchmarks"))

from fuzz_readers import fuzz
from lab_corpus import (
    ESSENTIAL,
    FACTOR,
    OTHER_UNIT,
    Column,
    Layout,
    Oracle,
    Variant,
    build,
    corpus,
    disagreement,
    split_cells,
)

#: Variant -> a word of the family that should recognise it, in lower case.
FAMILY = {
    "bluehill raw data, header block": "bluehill",
    "bluehill universal": "bluehill",
    "bluehill results export": "bluehill",
    "wavematrix": "wavematrix",
    "zwick, exponents": "zwick",
    "mts, decimal comma declared": "mts",
    "mecmesin, one specimen": "mecmesin",
    "lcr log with status": "lcr",
}

LONG = corpus(200)
SHORT = tuple(v for v in corpus(12) if v.outcome != "refused")
WRITTEN = tuple(v for v in SHORT if v.layout is not None and not v.reading)

#: Every other one, for damage that goes by no family: `benchmarks/mutate_lab_files.py` does it to a hundred thousand files.
ODD, EVEN = SHORT[1::2], SHORT[::2]


def named(variants: tuple[Variant, ...]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("variant", variants, ids=lambda v: v.name)


def read(tmp_path: Path, data: bytes, variant: Variant) -> LabTable:
    path = tmp_path / "lab.csv"
    path.unlink(missing_ok=True)  # a file that is written over waits for the disk
    path.write_bytes(data)
    if not variant.reading:
        return read_lab_file(path)
    from calib.lab.instruments.labtable import Reading

    return read_lab_file(path, Reading(**variant.reading))


def silent_error(
    tmp_path: Path,
    data: bytes,
    variant: Variant,
    lines: list[str],
    oracle: Oracle,
    cut: bool = False,
    optional: tuple[str, ...] = (),
) -> str:
    """What is wrong with what was read of a damaged file, "" if it is right or refused."""
    try:
        table = read(tmp_path, data, variant)
    except InputError:
        return ""
    return disagreement(table, oracle.interpret(lines), last_may_go=cut, optional=optional)


def assert_refused(tmp_path: Path, changed: Variant, what: str) -> None:
    try:
        table = read(tmp_path, changed.data, changed)
    except InputError:
        return
    pytest.fail(f"{what}: read as { ({q: v[:2].tolist() for q, v in table.columns.items()}) }")


# ------------------------------------------------------------------------------------------------------- the corpus itself


@named(LONG)
def test_what_was_written_and_what_the_text_says_are_the_same(variant: Variant) -> None:
    if variant.oracle is None or variant.layout is None or variant.outcome == "refused":
        return
    said = variant.oracle.interpret(variant.lines)
    assert {line: row for line, row in said.items() if line in variant.truth} == variant.truth
    assert not [
        line for line, row in said.items() if line not in variant.truth and all(row.get(q) for q in ESSENTIAL if q in row)
    ]


def test_the_corpus_is_large() -> None:
    assert len(LONG) >= 60


# ----------------------------------------------------------------------------------------------------------- as it is met


@named(tuple(v for v in LONG if v.outcome != "refused"))
def test_every_file_is_read_to_the_values_written(tmp_path: Path, variant: Variant) -> None:
    try:
        table = read(tmp_path, variant.data, variant)
    except InputError as error:
        if variant.outcome == "either":
            return
        pytest.fail(f"refused: {str(error)[:600]}")
    assert variant.oracle is not None
    assert disagreement(table, {**variant.oracle.interpret(variant.lines), **variant.truth}) == ""
    used = {int(line) for line, reason in zip(table.lines, table.reasons, strict=True) if not reason}
    assert used == set(variant.truth) - variant.unusable
    assert FAMILY.get(variant.name, "") in table.recognised_as.lower()


@named(tuple(v for v in LONG if v.outcome == "refused"))
def test_every_file_that_cannot_be_read_is_refused_with_its_line(tmp_path: Path, variant: Variant) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, variant.data, variant)
    refusal, error = variant.refusal, caught.value
    assert refusal is not None
    assert all(fault.path == tmp_path / "lab.csv" for fault in error.faults)
    assert not refusal.lines or {fault.line for fault in error.faults} & set(refusal.lines), str(error)
    for words in refusal.words:
        assert any(word.lower() in str(error).lower() for word in words.split("|")), f"{words}: {error}"


# ---------------------------------------------------------------------------------------------------- changes of the header


def _renamed(columns: tuple[Column, ...], names: list[Column], in_row: bool) -> tuple[Column, ...]:
    """The columns with other header cells; a unit below the name stays where it is."""
    return tuple(
        replace(c, quantity=n.quantity, name=n.name, unit=c.unit if in_row else n.unit)
        for c, n in zip(columns, names, strict=True)
    )


def _usable_units(layout: Layout) -> bool:
    return all(c.unit in FACTOR[c.quantity] for c in layout.columns if c.quantity in ESSENTIAL)


@named(WRITTEN)
def test_another_unit_changes_its_column_by_its_factor_only(tmp_path: Path, variant: Variant) -> None:
    assert variant.layout is not None
    for i, column in enumerate(variant.layout.columns):
        if not column.quantity or column.unit not in OTHER_UNIT or OTHER_UNIT[column.unit] not in FACTOR[column.quantity]:
            continue
        other = OTHER_UNIT[column.unit]
        columns = list(variant.layout.columns)
        columns[i] = replace(column, unit=other)
        layout = replace(variant.layout, columns=tuple(columns))
        if layout.place == "none":  # declared above the header
            prelude = [line[: -len(column.unit)] + other if column.name in line else line for line in layout.prelude]
            layout = replace(layout, prelude=tuple(prelude))
        changed = build(variant.name, layout)
        assert changed.oracle is not None
        assert silent_error(tmp_path, changed.data, changed, changed.lines, changed.oracle) == "", f"{column.unit} to {other}"


@named(WRITTEN)
def test_two_header_cells_exchanged_move_the_columns_or_are_refused(tmp_path: Path, variant: Variant) -> None:
    assert variant.layout is not None
    columns = variant.layout.columns
    in_row = variant.layout.place.startswith("row")
    declared = variant.layout.place == "none"
    for i, j in {(k, k + 1) for k in range(len(columns) - 1)} | {(0, len(columns) - 1)}:
        names = list(columns)
        names[i], names[j] = names[j], names[i]
        changed = build("", replace(variant.layout, columns=_renamed(columns, names, in_row and not declared)), "either")
        assert changed.layout is not None
        what = f"cells {i + 1} and {j + 1}"
        if changed.oracle is None or not _usable_units(changed.layout):
            assert_refused(tmp_path, changed, what)
        else:
            assert silent_error(tmp_path, changed.data, changed, changed.lines, changed.oracle) == "", what


@named(tuple(v for v in WRITTEN if v.layout is not None and v.layout.place.startswith("row")))
def test_without_its_units_row_a_file_is_refused(tmp_path: Path, variant: Variant) -> None:
    assert variant.layout is not None
    if any(c.quantity and c.unit == "" and c.quantity in ESSENTIAL for c in variant.layout.columns):
        return
    assert_refused(tmp_path, build("", replace(variant.layout, place="none"), "either"), "no units row")


@named(WRITTEN)
def test_a_header_cell_dropped_is_never_read_into_the_wrong_column(tmp_path: Path, variant: Variant) -> None:
    layout = variant.layout
    assert layout is not None
    line = layout.header_line()
    in_row = layout.place.startswith("row")
    for k in range(len(layout.columns)):
        kept = [c for i, c in enumerate(layout.columns) if i != k]
        lines = variant.lines
        quoted = layout.quoted in ("all", "header")
        lines[line - 1] = layout.joined([c for i, c in enumerate(layout.header()) if i != k], quoted)
        if layout.newline.join(lines) == variant.text:
            continue
        units = [layout.columns[i].unit if in_row else c.unit for i, c in enumerate(kept)]
        factors = {
            i: (c.quantity, FACTOR[c.quantity][unit])
            for i, (c, unit) in enumerate(zip(kept, units, strict=True))
            if c.quantity and unit in FACTOR[c.quantity]
        }
        fits = all(c.unit == unit or i in factors for i, (c, unit) in enumerate(zip(kept, units, strict=True)) if c.quantity)
        assert variant.oracle is not None
        oracle = replace(variant.oracle, columns=factors, width=len(kept))
        changed = replace(variant, text=layout.newline.join(lines))
        what = f"without header cell {k + 1}"
        if fits:
            assert silent_error(tmp_path, changed.data, changed, lines, oracle) == "", what
        else:
            assert_refused(tmp_path, changed, what)


@named(tuple(v for v in WRITTEN if v.oracle is not None and v.oracle.delimiter))
def test_a_header_with_a_cell_too_many_shifts_no_column(tmp_path: Path, variant: Variant) -> None:
    layout = variant.layout
    assert layout is not None
    quoted = layout.quoted in ("all", "header")
    for k in range(len(layout.columns)):
        for extra in ("", "a"):
            cells = layout.header()
            cells.insert(k, extra)
            lines = variant.lines
            lines[layout.header_line() - 1] = layout.joined(cells, quoted)
            data = variant.encoded(layout.newline.join(lines))
            try:
                table = read(tmp_path, data, variant)
            except InputError:
                continue
            assert disagreement(table, variant.truth) == "", f"a cell {extra!r} before cell {k + 1} of the header"


@pytest.mark.parametrize("header", ["Time, s,Extension, mm,Load, N", "Time (s),Extension, total (mm),Load (N)"])
def test_an_unquoted_comma_in_a_name_shifts_no_column(tmp_path: Path, header: str) -> None:
    path = tmp_path / "lab.csv"
    path.write_text(f"{header}\n0.5,0.1,1.5\n1.5,0.2,2.5\n2.5,0.3,3.5\n", encoding="utf-8")
    try:
        table = read_lab_file(path)
    except InputError:
        return
    assert [table.columns[q].tolist() for q in ("time", "displacement", "force")] == [
        pytest.approx([0.5, 1.5, 2.5]),
        pytest.approx([1e-4, 2e-4, 3e-4]),
        pytest.approx([1.5, 2.5, 3.5]),
    ]


@named(tuple(v for v in SHORT if v.name.startswith("mecmesin, side by side")))
def test_a_name_not_understood_does_not_mix_specimens_side_by_side(tmp_path: Path, variant: Variant) -> None:
    assert variant.oracle is not None
    header = variant.lines[1].split("\t")
    for k in range(len(header)):
        lines = variant.lines
        lines[1] = "\t".join([*header[:k], "Channel", *header[k + 1 :]])
        data = variant.encoded(variant.newline.join(lines))
        error = silent_error(tmp_path, data, variant, lines, variant.oracle, optional=("time",))
        assert error == "", f"column {k + 1} is named Channel"


@named(tuple(v for v in SHORT if "blocks" in v.name and "one row" not in v.name))
def test_a_block_whose_header_is_not_understood_is_not_left_out_silently(tmp_path: Path, variant: Variant) -> None:
    lines = variant.lines
    headers = [i for i, line in enumerate(lines) if line.startswith("Time")]
    for k in headers:
        changed = [
            *lines[:k],
            lines[k].replace("Time", "Tme").replace("Extension", "Exten").replace("Axial", "Ax"),
            *lines[k + 1 :],
        ]
        try:
            table = read(tmp_path, variant.encoded(variant.newline.join(changed)), variant)
        except InputError:
            continue
        used = {int(line) for line, reason in zip(table.lines, table.reasons, strict=True) if not reason}
        assert used <= set(variant.truth), f"header in line {k + 1}: rows of another specimen are read"
        assert used == set(variant.truth) or table.notes, f"header in line {k + 1}: rows are left out, and no note says so"


# ------------------------------------------------------------------------------------------------------ changes of the rows


def _cells_of(variant: Variant) -> Iterator[tuple[int, int, int]]:
    """Line index, start and end of every run of a number in the rows."""
    for line in sorted(variant.truth):
        for match in re.finditer(r"[0-9][0-9.,]*[0-9]", variant.lines[line - 1]):
            yield line - 1, match.start(), match.end()


@named(ODD)
def test_a_cell_with_the_other_mark_is_refused_or_read_as_it_stands(tmp_path: Path, variant: Variant) -> None:
    assert variant.oracle is not None
    rng = random.Random(variant.name)
    places = [p for p in _cells_of(variant) if set(variant.lines[p[0]][p[1] : p[2]]) & set(".,")]
    for index, start, end in rng.sample(places, min(6, len(places))):
        lines = variant.lines
        cell = lines[index][start:end]
        lines[index] = lines[index][:start] + cell.translate(str.maketrans(".,", ",.")) + lines[index][end:]
        data = variant.encoded(variant.newline.join(lines))
        assert silent_error(tmp_path, data, variant, lines, variant.oracle) == "", f"{cell} in line {index + 1}"


@named(tuple(v for v in WRITTEN if "nothing else tells" not in v.name))
def test_a_file_with_the_other_decimal_mark_is_read_the_same_or_refused(tmp_path: Path, variant: Variant) -> None:
    assert variant.layout is not None
    layout = variant.layout
    other = {".": ",", ",": "."}[layout.decimal]
    thousands = layout.decimal if layout.thousands == other else layout.thousands
    changed = build("", replace(layout, decimal=other, thousands=thousands), "either")
    if other == layout.delimiter and layout.quoted not in ("all", "data"):
        assert_refused(tmp_path, changed, "decimal comma between commas")
        return
    assert changed.oracle is not None
    assert silent_error(tmp_path, changed.data, changed, changed.lines, changed.oracle) == ""


STRAY = (
    "Event: stop",
    "hello",
    "12.5",
    "1{0}2",
    "----------",
    "Specimen 2",
    "Mean{0}1.5",
    "{0}{0}",
    "Total{0}1{0}2{0}3{0}4{0}5{0}6{0}7",
)


@named(EVEN)
def test_a_stray_line_spoils_no_other_line(tmp_path: Path, variant: Variant) -> None:
    assert variant.oracle is not None
    rows = sorted(variant.truth)
    header = variant.lines[rows[0] - 2] if rows[0] > 1 else "Time"
    places = (rows[0], rows[len(rows) // 2], max(rows[-1] - 1, rows[0]), rows[-1])  # 0-based indices of the new line
    turn = EVEN.index(variant)  # so that each stray line stands at each place in some of the variants
    for k, stray in enumerate((*STRAY, header)):
        at = places[(k + turn) % len(places)]
        lines = variant.lines
        lines.insert(at, stray.format(variant.oracle.delimiter or " ") if "{0}" in stray else stray)
        oracle = replace(variant.oracle, last=variant.oracle.last + 1)
        data = variant.encoded(variant.newline.join(lines))
        error = silent_error(tmp_path, data, variant, lines, oracle)
        if at == rows[-1] and "holds a row" in error and f"line {at + 1} " in error:
            error = ""  # below the table it may be a footer
        assert error == "", f"{stray!r} as line {at + 1}"


@named(ODD)
def test_a_character_changed_among_the_rows_is_read_as_it_stands_or_refused(tmp_path: Path, variant: Variant) -> None:
    assert variant.oracle is not None
    rng = random.Random(variant.name)
    rows = sorted(variant.truth)
    for _ in range(4):
        lines = variant.lines
        index = rng.choice(rows) - 1
        line = lines[index]
        at = rng.randrange(len(line) + 1)
        new = rng.choice("0123456789.,;\t -+eE\"'xNmk%#")
        lines[index] = rng.choice((line[:at] + new + line[at + 1 :], line[:at] + new + line[at:], line[:at] + line[at + 1 :]))
        data = variant.encoded(variant.newline.join(lines))
        error = silent_error(tmp_path, data, variant, lines, variant.oracle)
        assert error == "", f"line {index + 1}, {line!r} became {lines[index]!r}"


TOKENS = (
    "1_000", "0x1F", "1e400", "-1e400", "inf", "-inf", "nan", "NaN", "1d3", "1,000,00", "--5", "+-5", "5-", "(5)", "1.2.3",
    "1 2", "5%", "1/2", "12:30", "12:30:00", "TRUE", "#REF!", "#DIV/0!", "1e", ".", "-", "", "9.9E37", "OVER", "1.0E+38",
    "\u00bd", "5\u00b2", "1.5 kN", "1.5kN", "1.5e3.2", "2018-11-13", "13.11.2018", "=A1", "NULL", "1'5", "0'123", "0.5.",
    "1..5", "n. b.",
)  # fmt: skip


@named(WRITTEN)
def test_a_cell_with_something_else_in_it_is_no_reading(tmp_path: Path, variant: Variant) -> None:
    assert variant.oracle is not None
    assert variant.layout is not None
    if variant.oracle.delimiter == "" or variant.name == "two equal time columns":
        return
    rng = random.Random(variant.name)
    places = [i for i, c in enumerate(variant.layout.columns) if c.quantity in ESSENTIAL]
    for token in rng.sample(TOKENS, 6):
        try:
            token.encode(variant.encoding)
        except UnicodeEncodeError:
            continue
        lines = variant.lines
        index = rng.choice(sorted(variant.truth)) - 1
        cells = split_cells(lines[index], variant.oracle.delimiter)
        cells[rng.choice(places)] = token
        lines[index] = variant.oracle.delimiter.join(f'"{c}"' if variant.oracle.delimiter in c else c for c in cells)
        data = variant.encoded(variant.newline.join(lines))
        assert silent_error(tmp_path, data, variant, lines, variant.oracle) == "", f"line {index + 1} is {lines[index]!r}"


@named(EVEN)
def test_a_row_repeated_dropped_or_moved_changes_that_row_only(tmp_path: Path, variant: Variant) -> None:
    assert variant.oracle is not None
    rng = random.Random(variant.name)
    rows = sorted(variant.truth)
    for _ in range(2):
        i, j = rng.choices(rows, k=2)
        for kind in ("drop", "exchange", "repeat"):
            lines = variant.lines
            oracle = variant.oracle
            if kind == "drop" and len(rows) > 1:
                del lines[i - 1]
                oracle = replace(oracle, last=oracle.last - 1)
            elif kind == "exchange":
                lines[i - 1], lines[j - 1] = lines[j - 1], lines[i - 1]
            else:
                lines.insert(i - 1, lines[i - 1])
                oracle = replace(oracle, last=oracle.last + 1)
            data = variant.encoded(variant.newline.join(lines))
            assert silent_error(tmp_path, data, variant, lines, oracle) == "", f"{kind} {i}, {j}"


# ------------------------------------------------------------------------------------------------------------ cuts, encodings


# Cut before the record, a table of results stands alone and is one; a few whole numbers with points tell nothing.
CUT = tuple(v for v in ODD if "under the same names" not in v.name and v.name != "whole numbers with thousands points")


@named(CUT)
def test_a_file_cut_anywhere_gives_the_rows_that_are_left(tmp_path: Path, variant: Variant) -> None:
    rng = random.Random(variant.name)
    _cut(tmp_path, variant, sorted(rng.sample(range(len(variant.data)), 5)))


@named(
    tuple(
        v
        for v in corpus(8)
        if v.name
        in (
            "bluehill raw data, header block",
            "bluehill universal",
            "zwick, exponents",
            "encoding utf-16-le without byte order mark",
            "chinese names 1, gbk",
            "mts, blocks repeat the header, time goes on",
            "lcr log with status",
        )
    )
)
def test_a_file_cut_at_every_third_byte_gives_the_rows_that_are_left(tmp_path: Path, variant: Variant) -> None:
    _cut(tmp_path, variant, range(0, len(variant.data), 3))


def _cut(tmp_path: Path, variant: Variant, places: list[int] | range) -> None:
    assert variant.oracle is not None
    for place in places:
        data = variant.data[:place]
        text = data[len(variant.bom) :].decode(variant.encoding, errors="ignore")
        lines = text.split(variant.newline)
        error = silent_error(tmp_path, data, variant, lines, variant.oracle, cut=True)
        assert error == "", f"cut at byte {place}, the last line is {lines[-1]!r}"


ENCODINGS = ("utf-8", "utf-8-sig", "utf-16", "utf-16-be", "latin-1", "cp1252", "gbk", "shift_jis", "big5", "cp437")


@named(ODD)
def test_the_same_text_in_another_encoding_gives_the_same_values_or_is_refused(tmp_path: Path, variant: Variant) -> None:
    assert variant.oracle is not None
    # Each variant in half of them, each of them in half of the variants.
    for encoding in ENCODINGS[SHORT.index(variant) % 2 :: 2]:
        try:
            data = variant.text.encode(encoding)
        except UnicodeEncodeError:
            continue
        # A name that became unreadable loses its column; displacement and force are needed, time is not.
        assert silent_error(tmp_path, data, variant, variant.lines, variant.oracle, optional=("time",)) == "", encoding


@named(EVEN)
def test_other_line_ends_give_the_same_values(tmp_path: Path, variant: Variant) -> None:
    assert variant.oracle is not None
    for newline in ("\n", "\r\n", "\r"):
        data = variant.encoded(newline.join(variant.lines))
        assert silent_error(tmp_path, data, variant, variant.lines, variant.oracle) == "", repr(newline)


# -------------------------------------------------------------------------------------- blocks, and what the user says


def _block(columns: str, units: str, rows: list[str]) -> str:
    return "\n".join(["Data Acquisition: Timed", columns, units, *rows, ""]) + "\n"


@pytest.mark.parametrize(
    ("columns", "units", "rows"),
    [
        ("Time\tExtension\tLoad", "s\tmm\tkN", ["3.0\t0.35\t0.0075", "4.0\t0.45\t0.0085", "5.0\t0.55\t0.0095"]),
        ("Time\tExtension\tLoad", "s\tum\tN", ["3.0\t350.1\t7.5", "4.0\t450.1\t8.5", "5.0\t550.1\t9.5"]),
        ("Time\tLoad\tExtension", "s\tN\tmm", ["3.0\t7.5\t0.35", "4.0\t8.5\t0.45", "5.0\t9.5\t0.55"]),
        ("Time\tLoad\tExtension\tCycle", "s\tN\tmm\t", [f"{i}.0\t{i + 4}.5\t0.{i}5\t1" for i in (3, 4, 5)]),
        ("Load\tTime\tExtension", "N\tms\tmm", ["7.5\t3000.5\t0.35", "8.5\t4000.5\t0.45", "9.5\t5000.5\t0.55"]),
    ],
)
@pytest.mark.parametrize("n_first", [1, 2, 3])
def test_a_second_block_with_other_units_or_order_is_not_read_by_the_first_header(
    tmp_path: Path, columns: str, units: str, rows: list[str], n_first: int
) -> None:
    first = ["0.0\t0.05\t4.5", "1.0\t0.15\t5.5", "2.0\t0.25\t6.5"][:n_first]
    above = _block("Time\tExtension\tLoad", "s\tmm\tN", first)
    path = tmp_path / "lab.csv"
    path.write_text(above + _block(columns, units, rows), encoding="utf-8")
    try:
        table = read_lab_file(path)
    except InputError:
        return
    truth = {i + 4: [float(c) for c in row.split("\t")] for i, row in enumerate(first)}
    for i, row in enumerate(rows):
        cells = dict(zip(columns.split("\t"), map(float, row.split("\t")), strict=True))
        factor = dict(zip(columns.split("\t"), units.split("\t"), strict=True))
        scale = {"kN": 1000.0, "um": 1e-3, "ms": 1e-3}
        line = above.count("\n") + 4 + i
        truth[line] = [cells[q] * scale.get(factor[q], 1.0) for q in ("Time", "Extension", "Load")]
    missing = sorted(set(truth) - {int(line) for line in table.lines})
    named_lines = "|".join(str(missing[0] - k) for k in range(4)) if missing else ""
    said = any("left out" in note and re.search(rf"\b({named_lines})\b", note) for note in table.notes)
    assert said or not missing, f"the block from line {missing[0]} is left out, and no note says so: {table.notes}"
    for i, line in enumerate(table.lines):
        assert int(line) in truth
        found = [float(table.columns[q][i]) for q in ("time", "displacement", "force")]
        wanted = [truth[int(line)][0], truth[int(line)][1] * 1e-3, truth[int(line)][2]]
        assert found == pytest.approx(wanted, rel=1e-12), f"line {line}"


@pytest.mark.parametrize(
    "said",
    [
        {"units": {"force": "mm"}},
        {"units": {"force": "furlongz"}},
        {"units": {"torque": "N"}},
        {"columns": {"force": "Lod"}},
        {"columns": {"force": "17"}},
        {"columns": {"force": "0"}},
        {"columns": {"force": "-1"}},
        {"columns": {"weight": "Load"}},
        {"specimen": 2},
        {"specimen": 0},
        {"specimen": -1},
    ],
    ids=str,
)
def test_what_the_user_says_wrongly_is_refused(tmp_path: Path, said: dict[str, object]) -> None:
    variant = next(v for v in SHORT if v.name == "bluehill raw data, no header block")
    with pytest.raises(InputError):
        read(tmp_path, variant.data, replace(variant, reading=said))


@pytest.mark.parametrize(
    "said",
    [{"units": {}}, {"units": {"force": "N"}}, {"columns": {"force": "Load"}}, {"columns": {"force": "3"}}, {"specimen": 1}],
    ids=str,
)
def test_what_the_user_says_besides_the_file_changes_nothing(tmp_path: Path, said: dict[str, object]) -> None:
    variant = next(v for v in SHORT if v.name == "bluehill raw data, no header block")
    assert disagreement(read(tmp_path, variant.data, replace(variant, reading=said)), variant.truth) == ""


# ----------------------------------------------------------------------------------------------------------------------- fuzz


def test_mutated_files_are_read_or_refused_and_nothing_else(tmp_path: Path) -> None:
    outcome = fuzz(600, seed=20240501, saved=tmp_path)
    assert not outcome.failures, "\n".join(outcome.failures[:5])
    assert outcome.read > 15
    assert outcome.refused > 30
    assert outcome.slowest < 2.0

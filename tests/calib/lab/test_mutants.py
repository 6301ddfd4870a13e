"""What the judge of mutants holds to be right: changes that it once took for more than they are."""

from __future__ import annotations

import random
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "benchmarks"))
from mutants import of_columns, of_names, of_numbers, of_rows, of_signs
from mutants.document import Column, Document, Row
from mutants.kind import Kind
from mutants.presses import pressed
from mutants.verdict import judge

N = 40
PRESS = (
    Column("Time", " ", "()", "s", "time", (1.0,)),
    Column("Extension", " ", "()", "mm", "displacement", (1e-3,)),
    Column("Load", " ", "()", "N", "force", (1.0,)),
)
METER = (
    Column("Time", " ", "()", "s", "time", (1.0,)),
    Column("Cp", " ", "()", "pF", "capacitance", (1e-12,)),
    Column("D", quantity="dissipation", factors=(1.0,)),
)


def document(columns: Sequence[Column], lines: Sequence[Sequence[float]], delimiter: str = ",") -> Document:
    cells = [tuple(f"{v:.4f}" for v in line) for line in lines]
    rows = tuple(Row(c, tuple(map(float, c)), i) for i, c in enumerate(cells))
    units = delimiter == " "
    columns = tuple(replace(c, gap="") if units else c for c in columns)
    return Document(Path("a.csv"), (), columns, rows, (), units, delimiter, "\n", turned={"displacement": 1.0, "force": 1.0})


def press(delimiter: str = ",", sign: float = 1.0) -> Document:
    return document(
        PRESS, [(i, sign * 0.02 * i, sign * (0.3 + 6.0 * max(i / N - 0.3, 0.0) ** 1.6)) for i in range(N)], delimiter
    )


def meter() -> Document:
    return document(METER, [(0.1 * i, 97.5 + 0.01 * i, 0.01) for i in range(N)])


def kind(module: object, name: str) -> Kind:
    kinds: tuple[Kind, ...] = vars(module)["KINDS"]
    return next(k for k in kinds if k.name == name)


@pytest.fixture
def verdict(tmp_path: Path) -> Callable[[Document, Document], str]:
    """Function that gives the verdict on a mutant and what it was made of."""
    return lambda made, plain: f"{(v := judge(made, plain, tmp_path)).verdict}: {v.what}"


@pytest.mark.parametrize("name", ["row shifted right", "row shifted left", "cell added", "cell missing", "row cut"])
@pytest.mark.parametrize("delimiter", [" ", ","])
def test_blanks_hold_no_empty_cell_between_them(
    name: str, delimiter: str, verdict: Callable[[Document, Document], str]
) -> None:
    plain = press(delimiter)
    for seed in range(5):
        made = kind(of_rows, name).change(plain, random.Random(seed))
        assert made is not None
        assert not verdict(made, plain).startswith(("SILENT", "CRASH")), seed


def test_a_series_capacitance_keeps_a_name_that_says_so() -> None:
    made = kind(of_names, "series capacitance").change(meter(), random.Random(1))
    assert made is not None
    other = kind(of_names, "name of another language")
    named = [other.change(made, random.Random(seed)) for seed in range(20)]
    assert {doc.columns[1].name for doc in named if doc is not None} == {made.columns[1].name}
    assert len({doc.columns[1].name for s in range(20) if (doc := other.change(meter(), random.Random(s)))}) > 1


def test_rows_that_are_left_out_with_either_sign_need_not_hold_the_same(verdict: Callable[[Document, Document], str]) -> None:
    plain = replace(press(sign=-1.0), turned={"displacement": -1.0, "force": -1.0})
    row = plain.row(14)
    shifted = replace(row, cells=("", *row.cells[:2]), values=(float("nan"),) * 3, doubtful=True)
    flipped = replace(plain, flipped=frozenset({"force"}), signs=True, body=(*plain.body[:14], shifted, *plain.body[15:]))
    assert verdict(flipped, plain).startswith("excluded: line 16: empty cell")
    # The direction of a row that is read is held to that of the file, as before.
    wrong = replace(flipped, turned={"displacement": -1.0, "force": 1.0})
    assert verdict(wrong, plain).startswith("SILENT: force after `observe` is negative")


@pytest.mark.parametrize("name", ["Time (min)", "Time [min]"])
@pytest.mark.parametrize("change", ["time unit deleted", "unit deleted"])
def test_a_unit_that_is_said_twice_is_not_said_to_be_deleted(name: str, change: str) -> None:
    plain = press()
    named = replace(plain, columns=(replace(plain.columns[0], name=name, factors=()), *plain.columns[1:]))
    made = [kind(of_names, change).change(named, random.Random(seed)) for seed in range(10)]
    assert not [doc for doc in made if doc is not None and not doc.columns[0].unit]
    assert kind(of_names, "time unit deleted").change(plain, random.Random(1)) is not None


@pytest.mark.parametrize("name", ["swap two headers", "swap two names, units stay"])
def test_the_key_of_two_records_keeps_its_name(name: str) -> None:
    made = kind(of_columns, "key column of two values").change(press(), random.Random(1))
    assert made is not None
    key = next(j for j, column in enumerate(made.columns) if column.added)
    swapped = [doc for s in range(20) if (doc := kind(of_names, name).change(made, random.Random(s))) is not None]
    assert swapped
    assert {doc.columns[key].name for doc in swapped} == {made.columns[key].name}


def test_a_unit_in_a_name_goes_where_the_name_goes() -> None:
    plain = press()
    twice = replace(plain, columns=(*plain.columns[:2], replace(plain.columns[2], name="Load (kN)", factors=())))
    swapped = [doc for s in range(20) if (doc := kind(of_names, "swap two names, units stay").change(twice, random.Random(s)))]
    assert swapped
    assert all(doc.columns[2].name == "Load (kN)" for doc in swapped)


def test_numbers_that_lost_their_marks_can_be_read_under_no_name() -> None:
    rows = press()
    lost = kind(of_numbers, "decimal marks lost in a column")
    made = next(doc for s in range(20) if (doc := lost.change(rows, random.Random(s))) is not None)
    at = next(j for j in range(3) if made.row(0).cells[j] != rows.row(0).cells[j])
    swapped = [kind(of_names, "swap two headers").change(made, random.Random(s)) for s in range(10)]
    for doc in (made, *(doc for doc in swapped if doc is not None)):
        assert all(doc.row(i).values[at] != doc.row(i).values[at] for i in doc.rows())
        assert all(column.factors for column in doc.columns)


def test_a_force_of_which_only_its_drift_is_left_shows_no_direction(verdict: Callable[[Document, Document], str]) -> None:
    plain = press()
    drifted = kind(of_signs, "force: drift").change(plain, random.Random(1))
    assert drifted is not None
    cut = [doc for s in range(16) if (doc := kind(of_rows, "file cut within a row").change(drifted, random.Random(s)))]
    assert {bool(doc.turned) for doc in cut} == {True, False}
    assert all(bool(doc.turned) == pressed(doc) for doc in cut)
    assert not [said for doc in cut if (said := verdict(doc, plain)).startswith("SILENT")]

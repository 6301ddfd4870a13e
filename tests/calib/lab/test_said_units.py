"""Sentences beside a table that say another unit than its header are asked about; zeros at an end that are not written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file
from calib.lab.instruments.cut_short import cut_short

ROWS = tuple(f"{0.1 * i:.1f},{0.01 * i:.3f},{5 * max(i - 10, 0) ** 1.5:.2f}" for i in range(60))
HEAD = "Time (s),Displacement (mm),Force (N)"


def _read(folder: Path, place: str, words: str, reading: Reading | None = None) -> LabTable:
    above, below = (words if place == where else "" for where in ("above", "below"))
    path = folder / "press.csv"
    path.write_text("\n".join([*([above] if above else []), HEAD, *ROWS, *(["", below] if below else [])]) + "\n", "utf-8")
    return read_lab_file(path, reading or Reading())


@pytest.mark.parametrize(
    ("words", "quantity", "unit"),
    [
        ("Force is in mN!,,", "force", "mN"),
        ("Achtung: Kraft in mN, nicht N", "force", "mN"),
        ("注意：力的单位是mN", "force", "mN"),
        ("# displacement is in inches, sorry", "displacement", "in"),
        ("# force column is in mN (header wrong)", "force", "mN"),
        ("NB force in mN", "force", "mN"),
    ],
)
@pytest.mark.parametrize("place", ["above", "below"])
def test_a_sentence_that_says_another_unit_than_the_header_is_asked_about(
    tmp_path: Path, words: str, quantity: str, unit: str, place: str
) -> None:
    with pytest.raises(InputError) as caught:
        _read(tmp_path, place, words)
    assert any("unit" in fault.message and fault.column for fault in caught.value.faults)
    table = _read(tmp_path, place, words, Reading(units={quantity: unit}))
    factor = {"mN": 1e-3, "in": 25.4e-3}[unit]
    own = {"force": 2, "displacement": 1}[quantity]
    assert np.allclose(table.columns[quantity], [factor * float(row.split(",")[own]) for row in ROWS])


@pytest.mark.parametrize(
    "words",
    [
        "# force in N, displacement in mm",
        "Load limit in kN (of the frame)",
        "# displacement at 5 mm/min",
        "max. force in mN: see the report",
        "# pressed in air",
        "# sample is in a petri dish",
        "Load cell is in place",
    ],
)
@pytest.mark.parametrize("place", ["above", "below"])
def test_a_sentence_that_agrees_or_speaks_of_something_else_is_no_contradiction(tmp_path: Path, words: str, place: str) -> None:
    assert np.isclose(_read(tmp_path, place, words).columns["force"][-1], float(ROWS[-1].split(",")[2]))


def test_numbers_with_fewer_decimals_prove_nothing_where_no_zero_stands_at_an_end() -> None:
    values = np.round(97 + 0.0037 * np.arange(80) ** 1.2, 4)
    values[33] = np.round(values[33] + 0.003, 2)
    cells = [f"{v:.4f}" for v in values]
    cells[33] = f"{values[33]:.2f}"
    assert list(cut_short(cells, values, ".")) == [33]
    assert cut_short([c if c == cells[33] else c.rstrip("0") for c in cells], values, ".") == {}

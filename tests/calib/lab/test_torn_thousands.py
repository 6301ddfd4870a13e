"""Thousands set apart by the mark that parts the cells: a number in two cells is told as what it is, and never read in two."""

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, read_lab_file

N = 60
WAY = np.round(np.concatenate([np.linspace(0.0, 0.6, N // 2), np.linspace(0.6, 0.0, N // 2)]), 4)
FORCE = np.round(8000.0 * np.maximum(WAY - 0.05, 0.0) ** 1.5, 1)
CAPACITANCE = np.round(995.0 + 60.0 * np.maximum(WAY - 0.05, 0.0), 1)


def indian(value: float) -> str:
    whole, _, rest = f"{value:.1f}".partition(".")
    head, last = whole[:-3], whole[-3:]
    groups = [head[max(k - 2, 0) : k] for k in range(len(head), 0, -2)][::-1]
    return ",".join([*groups, last]) + f".{rest}"


def read(tmp_path: Path, header: str, rows: list[str]) -> LabTable:
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path)


def rows_of(*columns: list[str], mark: str = ",") -> list[str]:
    return [mark.join(cells) for cells in zip(*columns, strict=True)]


TIME = [f"{0.1 * k:.2f}" for k in range(N)]
PLACE = [f"{x:.4f}" for x in WAY]
LOAD = [f"{f:,.1f}" for f in FORCE]
FARADS = [f"{c:,.1f}" for c in CAPACITANCE]
OVER = [f"{c + 20:,.1f}" for c in CAPACITANCE]
FORCE_IN_N = [f"{f / 1000:.4f}" for f in FORCE]

FILES = {
    "last column": ("Time (s),Displacement (mm),Force (N),Cp (pF)", rows_of(TIME, PLACE, FORCE_IN_N, FARADS)),
    "column within": ("Time (s),Force (mN),Displacement (mm)", rows_of(TIME, LOAD, PLACE)),
    "two columns": ("Time (s),Force (mN),Cp (pF)", rows_of(TIME, LOAD, FARADS)),
    "all rows": ("Time (s),Displacement (mm),Force (N),Cp (pF)", rows_of(TIME, PLACE, FORCE_IN_N, OVER)),
    "a name too many": ("Time (s),Displacement (mm),Force (N),Cp (pF),Remark", rows_of(TIME, PLACE, FORCE_IN_N, OVER)),
    "a name too many, some rows": ("Time (s),Travel (mm),Force (N),Cp (pF),Remark", rows_of(TIME, PLACE, FORCE_IN_N, FARADS)),
    "an empty name": ("Time (s),Displacement (mm),Force (N),Cp (pF),", rows_of(TIME, PLACE, FORCE_IN_N, OVER)),
    "between blanks": ("Time_s Displacement_mm Force_mN", [r.replace(",", " ") for r in rows_of(TIME, PLACE, LOAD)]),
    "as in India": ("Time (s),Displacement (mm),Force (uN)", rows_of(TIME, PLACE, [indian(400 * f) for f in FORCE])),
}  # fmt: skip


@pytest.mark.parametrize("what", FILES)
def test_a_number_that_the_delimiter_cuts_at_its_thousands_is_refused_as_such(tmp_path: Path, what: str) -> None:
    with pytest.raises(InputError, match=r"one number") as error:
        read(tmp_path, *FILES[what])
    fault = error.value.faults[0]
    assert fault.line is not None
    assert "without marks between thousands" in fault.advice
    assert "Other" not in fault.advice


def test_a_row_that_passes_a_thousand_alone_is_refused_as_such(tmp_path: Path) -> None:
    load = [f"{f:,.0f}" for f in FORCE * 0.31]
    assert sum("," in f for f in load) in (1, 2)
    with pytest.raises(InputError, match="may be one number"):
        read(tmp_path, "Time (s),Displacement (mm),Force (mN)", rows_of(TIME, PLACE, load))


def test_what_the_advice_says_is_read(tmp_path: Path) -> None:
    table = read(tmp_path, "Time (s),Displacement (mm),Force (mN)", rows_of(TIME, PLACE, [f"{f:.1f}" for f in FORCE]))
    np.testing.assert_allclose(table.columns["force"], FORCE / 1000, atol=1e-9)
    quoted = read(tmp_path, "Time (s),Displacement (mm),Force (mN)", rows_of(TIME, PLACE, [f'"{f}"' for f in LOAD]))
    np.testing.assert_allclose(quoted.columns["force"], FORCE / 1000, atol=1e-9)
    apart = read(tmp_path, "Time (s);Displacement (mm);Force (mN)", rows_of(TIME, PLACE, LOAD, mark=";"))
    np.testing.assert_allclose(apart.columns["force"], FORCE / 1000, atol=1e-9)


def test_whole_seconds_beside_their_milliseconds_are_no_such_number(tmp_path: Path) -> None:
    seconds, rest = [f"{k // 10 + 1}" for k in range(N)], [f"{100 * (k % 10):03d}" for k in range(N)]
    table = read(tmp_path, "Time (s),ms,Displacement (mm),Force (N)", rows_of(seconds, rest, PLACE, FORCE_IN_N))
    np.testing.assert_allclose(table.columns["force"], FORCE / 1000, atol=1e-9)


def test_a_cell_too_many_of_other_numbers_is_told_as_before(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="which name belongs to which cell") as error:
        read(tmp_path, "Time (s),Displacement (mm),Force (N)", rows_of([str(k) for k in range(N)], TIME, PLACE, FORCE_IN_N))
    assert "one number" not in error.value.faults[0].message

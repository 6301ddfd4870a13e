"""Columns that a user converted into another unit stand beside the raw ones: one quantity where they agree, and no specimen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
import xlsxwriter

from calib.errors import InputError
from calib.lab import LabTable, SeveralSpecimens, read_lab_file
from models.sensor import FloatArray

TIME = np.round(np.arange(150) * 0.1, 3)
DEPTH = np.round(TIME * 0.05, 4)  # [mm]
FORCE = np.round(0.013 + 4.7 * np.maximum(DEPTH - 0.1, 0) ** 1.5, 4)  # [N]
OTHER = np.round(0.013 + 6.1 * np.maximum(DEPTH - 0.12, 0) ** 1.5, 4)  # [N], of another specimen
METRES = np.round(DEPTH / 1e3, 7)
INCHES = np.round(DEPTH / 25.4, 6)
GRAMS = np.round(FORCE / 9.80665e-3, 1)
POUNDS = np.round(FORCE / 4.4482216, 6)


def in_csv(path: Path, header: Sequence[Sequence[str]], columns: Sequence[FloatArray]) -> Path:
    rows = [*header, *(map(str, row) for row in zip(*columns, strict=True))]
    path.write_text("\n".join(map(",".join, rows)) + "\n", encoding="utf-8")
    return path


def in_workbook(path: Path, header: Sequence[Sequence[str]], columns: Sequence[FloatArray]) -> Path:
    book = xlsxwriter.Workbook(str(path.with_suffix(".xlsx")))
    sheet = book.add_worksheet("Sheet1")
    for r, row in enumerate([*header, *zip(*columns, strict=True)]):
        sheet.write_row(r, 0, row)
    book.close()
    return path.with_suffix(".xlsx")


def assert_press(table: LabTable, within: float = 1e-3) -> None:
    np.testing.assert_allclose(table.columns["displacement"], DEPTH * 1e-3, atol=1e-7)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=within)
    assert sum("agrees with it" in note or "with the same values" in note for note in table.notes) >= 2


Writer = Callable[[Path, Sequence[Sequence[str]], Sequence[FloatArray]], Path]
NAMES = ("Time (s)", "Extension (mm)", "Load (N)")
LAYOUTS = {
    "metres and grams": ([[*NAMES, "Extension (m)", "Load (gf)"]], [TIME, DEPTH, FORCE, METRES, GRAMS]),
    "inches first": ([["Time (s)", "Extension (in)", "Load (lbf)", *NAMES[1:]]], [TIME, INCHES, POUNDS, DEPTH, FORCE]),
    "each beside its own": (
        [["Time (s)", "Extension (mm)", "Extension (m)", "Load (N)", "Load (gf)"]],
        [TIME, DEPTH, METRES, FORCE, GRAMS],
    ),
    "three units": (
        [[*NAMES, "Extension (m)", "Load (gf)", "Extension (in)", "Load (lbf)"]],
        [TIME, DEPTH, FORCE, METRES, GRAMS, INCHES, POUNDS],
    ),
    "with its time": ([[*NAMES, "Time (s)", "Extension (m)", "Load (gf)"]], [TIME, DEPTH, FORCE, TIME, METRES, GRAMS]),
    "units below": (
        [["Time", "Extension", "Load", "Extension", "Load"], ["s", "mm", "N", "m", "gf"]],
        [TIME, DEPTH, FORCE, METRES, GRAMS],
    ),
}


@pytest.mark.parametrize("write", [in_csv, in_workbook])
@pytest.mark.parametrize("layout", LAYOUTS)
def test_columns_that_agree_up_to_their_unit_are_one_quantity(tmp_path: Path, write: Writer, layout: str) -> None:
    header, columns = LAYOUTS[layout]
    assert_press(read_lab_file(write(tmp_path / "a.csv", header, columns)))


@pytest.mark.parametrize(
    ("depth", "force"),
    [(METRES, np.round(GRAMS / 1.3, 1)), (np.round(1.2 * METRES, 7), GRAMS)],
    ids=["force", "displacement"],
)
@pytest.mark.parametrize("below", [False, True])
def test_a_column_that_was_converted_wrongly_is_a_choice(
    tmp_path: Path, depth: FloatArray, force: FloatArray, below: bool
) -> None:
    header = LAYOUTS["units below" if below else "metres and grams"][0]
    with pytest.raises(InputError, match="Say which one is meant"):
        read_lab_file(in_csv(tmp_path / "a.csv", header, [TIME, DEPTH, FORCE, depth, force]))


@pytest.mark.parametrize("own_time", [False, True])
@pytest.mark.parametrize("below", [False, True])
def test_specimens_in_other_units_are_no_conversion(tmp_path: Path, own_time: bool, below: bool) -> None:
    again = ["Time (s)"] if own_time else []
    names = [*NAMES, *again, "Extension (m)", "Load (gf)"]
    header = [[n.split(" (")[0] for n in names], [n.split("(")[1][:-1] for n in names]] if below else [names]
    columns = [TIME, DEPTH, FORCE, *([TIME] if own_time else []), np.round(METRES * 0.93, 7), np.round(OTHER / 9.80665e-3, 1)]
    with pytest.raises(InputError, match="specimens"):
        read_lab_file(in_csv(tmp_path / "a.csv", header, columns))


def test_two_specimens_of_one_displacement_are_asked_for(tmp_path: Path) -> None:
    with pytest.raises(SeveralSpecimens):
        read_lab_file(in_csv(tmp_path / "a.csv", [[*NAMES, *NAMES[1:]]], [TIME, DEPTH, FORCE, DEPTH, OTHER]))


def test_columns_without_a_unit_beside_those_with_one_are_no_conversion(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        read_lab_file(in_csv(tmp_path / "a.csv", [[*NAMES, "Extension", "Load"]], [TIME, DEPTH, FORCE, METRES, GRAMS]))

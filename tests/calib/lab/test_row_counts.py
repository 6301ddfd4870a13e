"""A number of rows that a file says of itself: told and graded where there are fewer, and passed by where it counts others."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from calib.lab import Reading, observe, read_lab_file
from calib.lab.quality import judge

N = 120
X = 0.5 - 0.6 * np.cos(np.linspace(0, 2 * np.pi, N))
NAMES = "Time (s),Displacement (mm),Force (N)"
ROWS = [f"{0.1 * k:.2f},{X[k]:.4f},{3.0 * max(X[k], 0) ** 1.5:.4f}" for k in range(N)]


def written(tmp_path: Path, lines: Sequence[str], name: str = "press.csv") -> Path:
    path = tmp_path / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def graded(path: Path, reading: Reading | None = None) -> list[tuple[str, str]]:
    seen = observe(read_lab_file(path, reading or Reading()))
    return [(grade.level, grade.finding) for grade in judge(seen) if grade.check == "rows of the file"]


@pytest.mark.parametrize(
    "line",
    [
        "Number of points:,{}",
        "Samples,{}",
        "# No. of data: {}",
        "Datenpunkte: {}",
        "Messwerte;{}",
        "Anzahl Messwerte = {}",
        "Number of samples per channel,{}",
        "Data points: {} points",
        "# {} samples",
        "Nombre de points : {}",
        '"Number of rows","{}"',
        "n_points={}",
    ],
)
def test_more_rows_than_there_are_is_told_and_graded(tmp_path: Path, line: str) -> None:
    table = read_lab_file(written(tmp_path, [line.format(240), NAMES, *ROWS]))
    assert table.told_rows == (N, 240)
    assert any(f"stands in line 1, and there are {N} of 240 rows" in note for note in table.notes)
    assert graded(table.path) == [("warning", f"the file says that it has 240 rows, and has {N}")]
    for count in (N, N - 1, 3):
        table = read_lab_file(written(tmp_path, [line.format(count), NAMES, *ROWS]))
        assert table.told_rows is None
        assert not any("rows" in note for note in table.notes)
        assert not graded(table.path)


def test_a_count_of_one_row_more_is_told_and_no_warning(tmp_path: Path) -> None:
    assert graded(written(tmp_path, [f"Samples: {N + 1}", NAMES, *ROWS]))[0][0] == "good"


@pytest.mark.parametrize(
    "line",
    [
        "Sample: 2024",
        "Points per second: 500",
        "Max. samples: 100000",
        "Sampling rate: 240 Hz",
        "Points averaged: 1000",
        "Data: 2024",
        "Buffer size 4096 samples",
        "Sample number: 1234",
        "Test points: A, B",
        "Number of cycles: 500",
        "Samples: 240 mm",
    ],
)
def test_other_numbers_beside_a_table_are_no_count_of_its_rows(tmp_path: Path, line: str) -> None:
    assert read_lab_file(written(tmp_path, [line, NAMES, *ROWS])).told_rows is None


def test_a_count_of_all_specimens_of_a_file_is_none_of_one(tmp_path: Path) -> None:
    rows = [f"{name},{row}" for name in "AB" for row in ROWS]
    path = written(tmp_path, [f"Samples,{2 * N}", f"Specimen,{NAMES}", *rows])
    assert read_lab_file(path, Reading(where={"Specimen": "B"})).told_rows is None
    path = written(tmp_path, [f"Samples,{3 * N}", f"Specimen,{NAMES}", *rows])
    assert read_lab_file(path, Reading(where={"Specimen": "B"})).told_rows == (2 * N, 3 * N)


@pytest.mark.parametrize("said", ["240\t240", f"{N}\t{N}", ""])
def test_the_samples_of_a_segment_of_labview_are_its_rows(tmp_path: Path, said: str) -> None:
    head = ["LabVIEW Measurement", "Writer_Version\t2", "Separator\tTab", "Decimal_Separator\t.", "X_Columns\tOne"]
    head += ["***End_of_Header***", "", "Channels\t2", *([f"Samples\t{said}"] if said else []), "Y_Unit_Label\tmm\tN"]
    head += ["X_Dimension\tTime\tTime", "X0\t0\t0", "Delta_X\t0.1\t0.1", "***End_of_Header***", "X_Value\tDisplacement\tForce"]
    table = read_lab_file(written(tmp_path, [*head, *(row.replace(",", "\t") for row in ROWS)], "press.lvm"))
    assert table.told_rows == ((N, 240) if said.startswith("240") else None)
    assert any('"Samples 240" stands in line 9' in note for note in table.notes) == said.startswith("240")

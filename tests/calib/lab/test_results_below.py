"""Results below the rows, with a title or without, in several languages: left out with the reason, never read as readings."""

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, read_lab_file

N = 60
WAY = np.round(np.concatenate([np.linspace(0.0, 0.6, N // 2), np.linspace(0.6, 0.0, N // 2)]), 4)
FORCE = np.round(8.0 * np.maximum(WAY - 0.05, 0.0) ** 1.5, 4)
HEADER = "Time (s),Displacement (mm),Force (N)"
ROWS = [f"{0.1 * k:.2f},{x:.4f},{f:.4f}" for k, (x, f) in enumerate(zip(WAY, FORCE, strict=True))]


def read(tmp_path: Path, below: list[str], header: str = HEADER, rows: list[str] = ROWS) -> LabTable:
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([header, *rows, *below]) + "\n", encoding="utf-8")
    return read_lab_file(path)


STATISTICS = ["Max,5.9,0.6,3.26", "Min,0,0,0", "Mean,2.95,0.3,1.1", "SD,1.7,0.2,1.0", "n,60,60,60"]
BELOW = {
    "results": ["Results:", "Max force, 3.26 N", "Mean,2.95,0.30,1.1"],
    "a statistic a row": ["Statistics", *STATISTICS],
    "no title": ["End of test", *STATISTICS],
    "numbers alone": ["Results", "3.26,0.6,8.2"],
    "numbers far from the clock": ["Summary", "326,0.6,8.2"],
    "names and numbers": ["Summary", "Fmax (N),smax (mm),Slope (N/mm)", "3.26,0.6,8.2"],
    "names of statistics": ["Specimen,Fmax (N),smax (mm)", "1,3.26,0.6", "2,3.31,0.6"],
    "many points with a word each": ["Results", *(f"Point {k},{0.5 * k},{0.1 * k:.1f}" for k in range(12))],
    "German": ["Ergebnisse", "Maximalkraft,3.26,N", "Mittelwert,2.95,0.3,1.1"],
    "French": ["Résultats de l'essai", "Force maximale,3.26,N", "Moyenne,2.95,0.3,1.1"],
    "Italian": ["Risultati", "Forza massima: 3.26 N", "Media,2.95,0.3,1.1"],
    "Spanish": ["Resultados del ensayo", "Fuerza máxima = 3.26 N", "Promedio,2.95,0.3,1.1"],
    "Polish": ["Wyniki", "Siła maks.,3.26,N", "Średnia,2.95,0.3,1.1"],
    "Chinese": ["结果：", "最大力,3.26 N", "平均值,2.95,0.3,1.1"],
    "Japanese": ["測定結果", "最大荷重,3.26", "平均,2.95,0.3,1.1"],
    "n": ["n = 60"],
}


@pytest.mark.parametrize("blank", [[], [""]])
@pytest.mark.parametrize("what", BELOW)
def test_results_below_the_rows_are_left_out_and_named(tmp_path: Path, what: str, blank: list[str]) -> None:
    table = read(tmp_path, [*blank, *BELOW[what]])
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)
    assert not any(table.reasons)
    first = f'"{BELOW[what][0]}"' if "names" not in what else ""
    assert any("left out" in note and first in note for note in table.notes)
    assert any(part.what.startswith("line") for part in table.unread)


def test_rows_that_go_on_below_such_a_title_are_readings(tmp_path: Path) -> None:
    table = read(tmp_path, ["Results", *ROWS[-5:]], rows=ROWS[:-5])
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)
    assert any("taken for a remark" in note for note in table.notes)


def test_another_record_below_such_a_title_is_refused_as_before(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="stands among the rows"):
        read(tmp_path, ["Results of run 2", *ROWS[:20]])


def test_results_below_a_table_without_a_clock_are_left_out_by_their_words(tmp_path: Path) -> None:
    rows = [row.partition(",")[2] for row in ROWS]
    table = read(tmp_path, ["Results", "Mean,0.3,1.1", "SD,0.2,1.0"], HEADER.partition(",")[2], rows)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)
    assert not any(table.reasons)


def test_the_largest_of_all_columns_at_the_last_time_is_no_reading(tmp_path: Path) -> None:
    table = read(tmp_path, ["", f"5.90,0.6000,{FORCE.max():.4f}"])
    assert len(table.reasons) == N + 1
    assert not any(table.reasons[:N])
    assert "a row of results" in table.reasons[N]


def test_a_press_that_goes_on_behind_a_blank_line_is_one(tmp_path: Path) -> None:
    table = read(tmp_path, [], rows=[*ROWS[:29], "", ROWS[29]])
    assert not any(table.reasons)


@pytest.mark.parametrize(
    "label",
    ["Largest", "Highest value", "Größter Wert", "Kleinstwert", "Le plus grand", "El mayor", "Más alto", "Maggiore"],
)
def test_a_row_of_the_largest_or_the_smallest_is_one_of_results(tmp_path: Path, label: str) -> None:
    table = read(tmp_path, [f"{label},0.6,3.26"])
    used = [not reason for reason in table.reasons]
    np.testing.assert_allclose(table.columns["force"][used], FORCE, atol=1e-9)
    assert any(label in str(part) for part in table.unread) or any(label in reason for reason in table.reasons)


@pytest.mark.parametrize("name", ["Largest force (N)", "Höchste Kraft (N)", "Smallest force (N)", "Maggiore forza (N)"])
def test_the_largest_of_several_readings_is_no_record(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, [], header=f"{HEADER},{name}", rows=[f"{row},3.26" for row in ROWS])
    assert table.sources["force"] == "Force (N)"
    assert any(name in str(part) for part in table.unread)

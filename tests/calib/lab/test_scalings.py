"""Rows of factors and offsets beside a table, and tables of channels: asked about where they may change the readings."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import Reading, observe, read_lab_file

N = 80
X = 0.5 - 0.6 * np.cos(np.linspace(0, 2 * np.pi, N))
FORCE = 3.0 * np.maximum(X, 0) ** 1.5
ROWS = [f"{0.1 * k:.3f},{X[k]:.4f},{FORCE[k]:.4f}" for k in range(N)]
NAMED = ["Time (s),Displacement (mm),Force (N)"]
COUNTED = ["Channel,Time,Displacement,Force", "Unit,s,mm,N"]


def written(tmp_path: Path, lines: Sequence[str]) -> Path:
    path = tmp_path / "press.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def counted(rows: Sequence[str] = ROWS) -> list[str]:
    return [f"{k},{row}" for k, row in enumerate(rows, 1)]


LAYOUTS = {
    "Scale below units": [*COUNTED, "Offset,0,0,0", "Scale,1,1,{}", *counted()],
    "Gain above names": ["Gain,1,1,{}", *COUNTED, *counted()],
    "Faktor in an empty column": [*COUNTED, "Faktor,1,1,{}", *(f",{row}" for row in ROWS)],
    "Slope and Intercept": [*COUNTED, "Slope,1,1,{}", "Intercept,0,0,0", *counted()],
    "Gain with signs of multiplication": ["Gain,x1,x1,x{}", *COUNTED, *counted()],
    "behind the last row": [*COUNTED, *counted(), "Scale factor,1,1,{}"],
    "a cell more than names": ["Channel factors:,1,1,{}", *NAMED, *ROWS],
    "numbers alone": ["Time,Displacement,Force", "s,mm,N", "1,1,{}", *ROWS],
    "table of channels": ["Ch,Name,Unit,Scale", "1,Time,s,1", "2,Displacement,mm,1", "3,Force,N,{}", "", *NAMED, *ROWS],
    "label and numbers in words": ["Scale factors: 1, 1, {}", *NAMED, *ROWS],
    "two columns": ["Channel,Gain", "Displacement,1", "Force,{}", "", *NAMED, *ROWS],
    "factors and offsets": ["Kanal,Offset,Skalierung", "Weg,0,1", "Kraft,0,{}", "", *NAMED, *ROWS],
    "table of channels by name": ["Channel,Gain,Low pass", "A1,1,10", "A2,{},10", "", "Time (s),A1 [mm],A2 [N]", *ROWS],
}


@pytest.mark.parametrize("factor", ["0.1", "10"])
@pytest.mark.parametrize("layout", [name for name in LAYOUTS if not name.endswith("by name")])
def test_a_factor_that_is_stated_of_a_column_is_asked_about(tmp_path: Path, layout: str, factor: str) -> None:
    path = written(tmp_path, [line.format(factor) for line in LAYOUTS[layout]])
    with pytest.raises(InputError, match=f"states? a factor of {factor}: the readings of column") as error:
        read_lab_file(path)
    assert "--units force=" in error.value.faults[0].advice
    assert path.read_text().splitlines()[(error.value.faults[0].line or 0) - 1].rstrip().endswith(factor)
    for unit, by in (("N", 1.0), (f"{factor} N", float(factor))):
        seen = observe(read_lab_file(path, Reading(units={"force": unit})))
        good = np.array([not why.startswith("no reading") for why in seen.table.reasons])
        time, force = seen.table.columns["time"], seen.table.columns["force"]
        np.testing.assert_allclose(force[good & np.isfinite(time)], by * np.round(FORCE, 4), atol=1e-9)


def test_factors_in_a_comment_between_names_and_rows_are_asked_about(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"states a factor of 0\.1"):
        read_lab_file(written(tmp_path, [*NAMED, "# scale: 1, 1, 0.1", *ROWS]))
    rows = [line.replace(",", " ") for line in ("Time Displacement Force", "s mm N", "", *ROWS, "")]
    assert len(read_lab_file(written(tmp_path, rows)).lines) == N


@pytest.mark.parametrize("layout", list(LAYOUTS))
def test_a_factor_of_one_asks_nothing(tmp_path: Path, layout: str) -> None:
    path = written(tmp_path, [line.format("1") for line in LAYOUTS[layout]])
    if layout.endswith("by name"):
        table = read_lab_file(path, Reading(columns={"displacement": "A1 [mm]", "force": "A2 [N]"}))
    else:
        table = read_lab_file(path)
    np.testing.assert_allclose(table.columns["force"][np.isfinite(table.columns["force"])][-N:][:50], FORCE[:50], atol=1e-4)


@pytest.mark.parametrize("offset", ["0.5", "-0.2"])
@pytest.mark.parametrize("word", ["Offset", "Zero offset", "Intercept"])
def test_an_offset_that_is_stated_of_a_column_is_asked_about(tmp_path: Path, offset: str, word: str) -> None:
    path = written(tmp_path, [*COUNTED, f"{word},0,0,{offset}", "Scale,1,1,1", *counted()])
    with pytest.raises(InputError, match=f'"{word}" in line 3 states an offset of {offset}: the readings of column "Force"'):
        read_lab_file(path)
    table = read_lab_file(path, Reading(units={"force": "N"}))
    np.testing.assert_allclose(table.columns["force"][2:], FORCE, atol=1e-4)
    with pytest.raises(InputError, match=r"an offset of .* and .* a factor of 2"):
        read_lab_file(written(tmp_path, [*COUNTED, f"{word},0,0,{offset}", "Scale,1,1,2", *counted()]))


@pytest.mark.parametrize(
    "above",
    [
        ["Ch,Name,Unit,Scale", "1,Time,s,1", "2,Displacement,mm,1", "3,Force,N,1", "4,Temperature,C,0.1", ""],
        ["Ch,Name,Unit,Range", "1,Time,s,1", "2,Displacement,mm,10", "3,Force,N,50", ""],
        ["Ch,Name,Sensitivity", "1,Displacement,2.01", "2,Force,1.998", ""],
        ["Plot scale,1,2,3"],
        ["Vertical Scale,1,2,5", "Vertical Offset,0,0.5,1"],
        ["Range,1,10,50"],
        ["Max,9.0,1.1,4.0"],
    ],
)
def test_numbers_beside_a_table_that_are_no_factors_of_its_columns_ask_nothing(tmp_path: Path, above: list[str]) -> None:
    table = read_lab_file(written(tmp_path, [*above, *NAMED, *ROWS]))
    assert not any(table.reasons)


def test_a_factor_of_a_column_that_is_not_read_asks_nothing(tmp_path: Path) -> None:
    rows = [f"{row},{20 + k / 100:.2f}" for k, row in enumerate(ROWS)]
    lines = ["Channel,Time,Displacement,Force,Temperature", "Unit,s,mm,N,C", "Scale,1,1,1,0.1", *counted(rows)]
    table = read_lab_file(written(tmp_path, lines))
    np.testing.assert_allclose(table.columns["force"][-N:], FORCE, atol=1e-4)


def with_beside(label: str, number: str, row: int = 0) -> list[str]:
    return [f"{NAMED[0]},,,", *(f"{line},,{label},{number}" if k == row else f"{line},,," for k, line in enumerate(ROWS))]


@pytest.mark.parametrize("row", [0, N - 1])
@pytest.mark.parametrize("label", ["slope N/mm", "slope", "slope pF/N", "offset (N)", "scale bar"])
def test_a_result_to_the_right_of_the_table_is_no_factor_and_costs_no_row(tmp_path: Path, label: str, row: int) -> None:
    table = read_lab_file(written(tmp_path, with_beside(label, "4.2", row)))
    assert not any(table.reasons)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)
    assert any("column 5" in unread.what for unread in table.unread)


@pytest.mark.parametrize("label", ["gain", "force gain", "load scale factor", "force offset"])
def test_a_factor_to_the_right_of_the_table_is_asked_about_with_its_own_number(tmp_path: Path, label: str) -> None:
    with pytest.raises(InputError, match=rf"{label}") as error:
        read_lab_file(written(tmp_path, with_beside(label, "10")))
    assert not any(f.message.endswith("of 0") or "factor of 0:" in f.message for f in error.value.faults)


def test_factors_before_their_word_are_still_asked_about(tmp_path: Path) -> None:
    lines = [f"{NAMED[0]},,", "1,1,10,,Scale", *(f"{line},," for line in ROWS)]
    with pytest.raises(InputError, match="states a factor of 10"):
        read_lab_file(written(tmp_path, lines))


@pytest.mark.parametrize(
    "above",
    [
        "# gain x10 not corrected in force column",
        "# amplifier gain 10 not yet divided out of force",
        "Load cell gain 10 nicht korrigiert",
        "Calibration factor: 0.9812 (not applied)",
        "Kalibrierfaktor 0,9812 (nicht angewendet)",
        "Force calibration factor 1.02 was not applied",
        "Calibration factor to be applied: 0.9812",
        "Cal. constant = 0.9812, not yet applied",
        "Calibration coefficient 1.04 pending",
        "multiply force by calibration factor 0.98",
        "# data normalised to maximum",
        "Force normalized to peak",
    ],
)
def test_what_was_not_done_yet_to_readings_is_asked_about(tmp_path: Path, above: str) -> None:
    with pytest.raises(InputError, match='states a factor: the readings of column "Force'):
        read_lab_file(written(tmp_path, [above, *NAMED, *ROWS]))


@pytest.mark.parametrize(
    "above",
    [
        "# temperature not corrected",
        "# gain 1 not corrected",
        "Calibration factor: 0.9812",
        "Calibration factor: 0.9812 (applied)",
        "Calibration factor 1.000 (not applied)",
        "Temperature correction factor 1.2 not applied",
        "Calibration due 2026-12-01, not applied for",
        "# data not normalised",
        "Normalised: no",
        "# file names normalised",
    ],
)
def test_what_changes_no_reading_asks_nothing(tmp_path: Path, above: str) -> None:
    np.testing.assert_allclose(read_lab_file(written(tmp_path, [above, *NAMED, *ROWS])).columns["force"], FORCE, atol=1e-4)


@pytest.mark.parametrize(
    ("line", "name"),
    [
        ("Time unit: 100 ms", "Time"),
        ("Time in units of 100 ms", "Time"),
        ("Unit of time: 100 ms", "Time"),
        ("Time channel: counter x 0.1 = s", "Time"),
        ("Disp channel: displayed value / 100 = mm", "Disp"),
        ("Force: value * 10 = mN", "Force"),
        ("Force = reading * 0.01 N", "Force (N)"),
        ("Force scale factor: 0.01 N/unit", "Force (N)"),
        ("Kraft in 0,01 N", "Force (N)"),
    ],
)
def test_a_line_that_makes_a_unit_of_readings_and_a_number_is_asked_about(tmp_path: Path, line: str, name: str) -> None:
    names = {"Time": "Time (s)", "Disp": "Disp (mm)", "Force": "Force (N)"}
    heads = [name if name.startswith(short) else full for short, full in names.items()]
    rows = [f"{0.1 * i:.1f},{0.01 * i:.4f},{0.001 * i**1.5:.4f}" for i in range(60)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([line, ",".join(heads), *rows]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="states a factor") as refused:
        read_lab_file(path, Reading())
    assert refused.value.faults[0].line == 1
    assert "--units" in refused.value.faults[0].advice


@pytest.mark.parametrize(
    "line", ["Time: 10 s", "Test time 100 s", "Force reached 5 N in 10 s", "Hold in 5 s steps", "Sampled every 100 ms"]
)
def test_times_and_loads_that_are_no_units_ask_nothing(tmp_path: Path, line: str) -> None:
    rows = [f"{0.1 * i:.1f},{0.01 * i:.4f},{0.001 * i**1.5:.4f}" for i in range(60)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([line, "Time (s),Disp (mm),Force (N)", *rows]) + "\n", encoding="utf-8")
    assert read_lab_file(path, Reading()).columns["time"][1] == pytest.approx(0.1)

"""Lines and words among the rows that every program writes: passed over with a note, unless another record may begin there."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file
from calib.lab.instruments.numbers import is_missing, is_over_range

N = 100
WAY = np.round(np.concatenate([np.linspace(0.0, 1.0, N // 2), np.linspace(0.98, 0.0, N // 2)]), 4)


def as_it_is(row: list[float], _: int) -> list[float]:
    return row


def read(
    tmp_path: Path,
    line: str,
    *,
    mark: str = "",
    at: int = N // 2,
    changed: Callable[[list[float], int], list[float]] = as_it_is,
) -> LabTable:
    readings = [changed([0.1 * k, x, 4 * max(x - 0.15, 0.0) ** 1.5], k) for k, x in enumerate(WAY.tolist())]
    rows = [f"{t:.1f},{x:.4f},{force:.4f}" for t, x, force in readings]
    rows[at:at] = line.split("|")
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([f"{mark}Time (s),Displacement (mm),Force (N)", *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path)


@pytest.mark.parametrize(
    "line",
    [
        "# --- unloading ---",
        "# ===== unload =====",
        "--- unloading ---",
        "*** Loading stopped ***",
        "|Page 2|",
        "Seite 2 / 3",
        "- Page 2 of 4 -",
        "第 2 页",
        "# retract",
        "unloading",
        "Hold,,",
        "Entlastung",
    ],
)
def test_a_line_that_changes_nothing_is_left_out_with_a_note(tmp_path: Path, line: str) -> None:
    table = read(tmp_path, line)
    assert not any(table.reasons)
    assert any("line(s) of text left out" in note for note in table.notes)


@pytest.mark.parametrize(
    "line",
    [
        "--- Run 2 ---",
        "# Run 2",
        "# Versuch B",
        "Messung Nr. 3",
        "# --- test #2 ---",
        "=====",
        "%% 试验 2",
        "loading",
        "start",
        "unloading 2",
        "# sensor B7",
        "# S2",
        "# other electrode",
        "# electrode changed",
        "# moved to spot 2",
        "# ball 5 mm -> 10 mm",
        "# 14:32 next press",
    ],
)
def test_a_line_that_may_begin_another_record_is_refused_with_two_files_as_advice(tmp_path: Path, line: str) -> None:
    with pytest.raises(InputError, match="in a file of their own") as error:
        read(tmp_path, line)
    assert "stands among the rows" in str(error.value)
    assert error.value.faults[0].line == 2 + N // 2


@pytest.mark.parametrize("first", ["", "Sample: S1|"])
@pytest.mark.parametrize("line", ["Sensor: B7", "Test 2", "File: press_02.csv", "Sample: S2"])
def test_a_header_that_stands_again_below_another_name_begins_another_record(tmp_path: Path, line: str, first: str) -> None:
    header = "Time (s),Displacement (mm),Force (N)"
    rows = [f"{0.1 * k:.1f},{x:.4f},{4 * max(x - 0.15, 0.0) ** 1.5:.4f}" for k, x in enumerate([*WAY, *WAY])]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([*first.split("|")[:-1], header, *rows[:N], line, header, *rows[N:]]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="the file holds 2 specimens"):
        read_lab_file(path)
    assert read_lab_file(path, Reading(specimen=2)).columns["time"].size == N


@pytest.mark.parametrize("cell", ["1.#QNAN", "-1.#IND", "1.#QNAN0", "-1.#IND00", "NaN", "-nan(ind)", "-nan"])
def test_what_a_program_writes_for_no_number_is_missing(cell: str) -> None:
    assert is_missing(cell)
    assert not is_over_range(cell)


@pytest.mark.parametrize("cell", ["1.#INF", "-1.#INF", "1.#INF00", "Infinity", "-inf"])
def test_what_a_program_writes_for_an_infinite_number_is_over_range(cell: str) -> None:
    assert is_over_range(cell)
    assert not is_missing(cell)


@pytest.mark.parametrize("cell", ["1.#", "1.5", "#1", "ind", "nano", "1.#2"])
def test_other_cells_are_neither(cell: str) -> None:
    assert not is_missing(cell)
    assert not is_over_range(cell)


def putty(tmp_path: Path, first: int, *, point: str = ".") -> Path:
    rows = [f"{first + 200 * k};{int(1000 * x)};{int(4e3 * max(x - 0.15, 0.0) ** 1.5)};{97 + x:.3f}" for k, x in enumerate(WAY)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["time_ms;pos_um;force_mN;cap_pF", *rows]).replace(".", point) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("point", [".", ","])
def test_a_mark_is_decimal_beside_numbers_above_a_thousand_without_any(tmp_path: Path, point: str) -> None:
    table = read_lab_file(putty(tmp_path, 1021, point=point))
    assert table.columns["capacitance"][0] == pytest.approx(97e-12, rel=1e-3)
    assert any("numbers above a thousand in other columns have none" in note for note in table.notes)


@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize(("column", "quantity"), [(1, "displacement"), (2, "force"), (3, "capacitance")])
def test_a_mark_in_one_column_of_whole_numbers_may_set_thousands_apart(
    tmp_path: Path, column: int, quantity: str, mark: str
) -> None:
    rows = [[12000 + 125 * k, 11000 + 800 * x, 1000 + 5000 * x**1.5, 97012 + 2000 * x**2] for k, x in enumerate(WAY)]
    cells = [[f"{round(v):,}".replace(",", mark if i == column else "") for i, v in enumerate(row)] for row in rows]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["Zeit [ms];Weg [um];Kraft [mN];Cp [fF]", *map(";".join, cells)]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="may set thousands apart, as a spreadsheet does in some columns") as refused:
        read_lab_file(path)
    assert f'--decimal "{mark}"' in str(refused.value)
    written = read_lab_file(path, Reading(decimal="," if mark == "." else ".")).columns[quantity]
    unit = {"displacement": 1e-6, "force": 1e-3, "capacitance": 1e-15}[quantity]
    np.testing.assert_allclose(written, [round(row[column]) * unit for row in rows])


def test_a_mark_is_open_where_no_number_is_above_a_thousand(tmp_path: Path) -> None:
    path = putty(tmp_path, 0)
    lines = path.read_text(encoding="utf-8").splitlines()
    few = [lines[0], *(line.replace(line.split(";")[0], str(k), 1) for k, line in enumerate(lines[1:20]))]
    path.write_text("\n".join(few) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="the decimal mark cannot be told"):
        read_lab_file(path)


@pytest.mark.parametrize(
    "line",
    [
        "*** Marker 1: touch (operator KL) ***",
        "Marker: touch",
        "Pause 5 s",
        "Operator note: door closed",
        "10:22:13 contact detected",
        "Event,touch,",
        "接触",
        "*** pause: operator adjusted camera ***",
    ],
)
def test_words_across_which_clock_and_press_run_on_are_a_remark(tmp_path: Path, line: str) -> None:
    table = read(tmp_path, line, at=30)
    assert len(table.reasons) == N
    assert not any(table.reasons)
    assert any(f'"{line}" in line 32 is taken for a remark' in note for note in table.notes)
    assert any(u.what == "line 32" for u in table.unread)


@pytest.mark.parametrize(
    "line", ["Run 2", "specimen B", "=====", "range 2", "tare", "(s),(mm),(N)", "kN", "pad swapped", "Kugel gewechselt"]
)
def test_words_of_a_run_a_unit_or_a_zero_are_no_remark_for_all_that_the_press_runs_on(tmp_path: Path, line: str) -> None:
    with pytest.raises(InputError, match="stands among the rows"):
        read(tmp_path, line, at=30)


@pytest.mark.parametrize("k", [0, 1, 2])
@pytest.mark.parametrize("at", [10, 30, 70])
def test_words_where_clock_or_readings_leap_are_refused(tmp_path: Path, k: int, at: int) -> None:
    def leap(row: list[float], place: int) -> list[float]:
        return [v + (place >= at) * (i == k) * (5.0, 0.3, 1.0)[k] for i, v in enumerate(row)]

    with pytest.raises(InputError, match='"Marker: touch" stands among the rows'):
        read(tmp_path, "Marker: touch", at=at, changed=leap)


def test_words_where_the_ball_rests_out_of_contact_are_refused_as_another_may_be_there(tmp_path: Path) -> None:
    def rests(row: list[float], place: int) -> list[float]:
        return [row[0], 0.0, 0.0] if place < 12 else row

    with pytest.raises(InputError, match='"Marker: ball" stands among the rows'):
        read(tmp_path, "Marker: ball", at=6, changed=rests)


@pytest.mark.parametrize("delimiter", ["\t", ";", "|", " "])
@pytest.mark.parametrize("at", [15, 60, N - 12])
def test_rows_of_numbers_between_another_delimiter_are_no_text(tmp_path: Path, delimiter: str, at: int) -> None:
    path = tmp_path / "lab.csv"
    rows = [f"{0.1 * k:.1f},{x:.4f},{4 * max(x - 0.15, 0.0) ** 1.5:.4f}" for k, x in enumerate(WAY)]
    rows[at:] = [row.replace(",", delimiter) for row in rows[at:]]
    path.write_text("\n".join(["Time (s),Displacement (mm),Force (N)", *rows]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="parted otherwise") as error:
        read_lab_file(path)
    assert error.value.faults[0].line == at + 2


ERRORS = (
    *(
        "#REF!",
        "#NAME?",
        "#NUM!",
        "#NULL!",
        "#SPILL!",
        "#CALC!",
        "Err:502",
        "#BEZUG!",
        "#ZAHL!",
        "Fehler:502",
        "#NOMBRE?",
        "#NOM?",
    ),
    *("#¡DIV/0!", "#¡VALOR!", "#¿NOMBRE?", "#VALORE!", "#RIF!", "#ARG!", "#LICZBA!", "#DZIEL/0!", "#VÄRDEFEL!", "#DIVISION/0!"),
    *("#ЗНАЧ!", "#ДЕЛ/0!", "#Н/Д", "#DEĞER!", "#SAYI/0!", "#YOK", "#DEEL/0!", "#WAARDE!", "#N/D", "#N/D!", "#N/B", "#ÉRTÉK!"),
)


@pytest.mark.parametrize("cell", ERRORS)
@pytest.mark.parametrize("k", [0, 2])
def test_an_error_of_a_spreadsheet_in_any_language_leaves_out_its_row(tmp_path: Path, cell: str, k: int) -> None:
    rows = [[f"{0.1 * i:.1f}", f"{x:.4f}", f"{4 * max(x - 0.15, 0.0) ** 1.5:.4f}"] for i, x in enumerate(WAY)]
    for at in (20, 60):
        rows[at][k] = cell
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["Time (s);Displacement (mm);Force (N)", *map(";".join, rows)]) + "\n", encoding="utf-8")
    table = read_lab_file(path)
    column = table.columns[("time", "displacement", "force")[k]]
    assert np.flatnonzero(~np.isfinite(column)).tolist() == [20, 60]
    assert len(column) == N


@pytest.mark.parametrize("cell", ["#Note!", "# N!", "#1!", "#12", "REF!", "Err: 12", "#weiter", "check!"])
def test_other_words_behind_a_hash_are_no_error_of_a_spreadsheet(cell: str) -> None:
    assert not is_missing(cell)


TITLES = (
    "Test report 0815          Page {}",
    "Report 0815 of 3.2.2024 Seite {}",
    "Specimen 7 of 12     Page {} of 5",
    "Pad 3 - page {}",
)


def paged(tmp_path: Path, title: str, gap: str, *, back: bool = False) -> Path:
    lines = []
    for page in range(4):
        clock = 0.0 if back else 0.1 * 20 * page
        lines += [title.format(page + 1), "", gap.join(["Time", "Displacement", "Force"]), gap.join(["[s]", "[mm]", "[N]"])]
        rows = [(clock + 0.1 * k, x) for k, x in enumerate(WAY[20 * page : 20 * page + 20].tolist())]
        lines += [gap.join([f"{t:.1f}", f"{x:.4f}", f"{4 * max(x - 0.15, 0.0) ** 1.5:.4f}"]) for t, x in rows] + [""]
    path = tmp_path / "pages.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("title", TITLES)
@pytest.mark.parametrize("gap", ["   ", "\t", ";"])
def test_pages_with_a_title_above_each_header_are_one_record(tmp_path: Path, title: str, gap: str) -> None:
    table = read_lab_file(paged(tmp_path, title, gap))
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * WAY[:80], atol=1e-7)
    assert not any(table.reasons)
    assert any("the header stands 4 times" in note for note in table.notes)


@pytest.mark.parametrize("title", ["Specimen {} of 12", "Test report 0815   Specimen {}"])
def test_pages_of_several_specimens_are_asked_about(tmp_path: Path, title: str) -> None:
    with pytest.raises(InputError, match="the file holds 4 specimens"):
        read_lab_file(paged(tmp_path, title, "   "))


def test_pages_whose_time_begins_anew_are_asked_about(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the file holds 4 specimens"):
        read_lab_file(paged(tmp_path, TITLES[0], "   ", back=True))


@pytest.mark.parametrize("cell", ["#DIV/0!", "#WERT!", "#N/A", "#NV"])
def test_the_reason_of_a_row_shows_what_a_spreadsheet_has_in_place_of_a_number(tmp_path: Path, cell: str) -> None:
    path = tmp_path / "lab.csv"
    rows = [f"{i * 0.1:.1f},{i * 0.01:.2f},{cell if i == 20 else f'{i * i * 0.001:.3f}'}" for i in range(40)]
    path.write_text("\n".join(["Time (s),Displacement (mm),Force (N)", *rows]) + "\n", encoding="utf-8")
    assert read_lab_file(path).reasons[20] == f"no number, {cell}: force"


def marked(tmp_path: Path, delimiter: str, remarks: dict[int, str]) -> LabTable:
    """The press with these words behind some of its rows."""
    cells = [[f"{0.1 * k:.1f}", f"{x:.4f}", f"{4 * max(x - 0.15, 0.0) ** 1.5:.4f}"] for k, x in enumerate(WAY.tolist())]
    rows = [f"{delimiter.join(row)}{remarks.get(k, '')}" for k, row in enumerate(cells)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([delimiter.join(["time_s", "disp_mm", "force_N"]), *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " "])
@pytest.mark.parametrize("remark", [" # touch", "# touch, then on", " // Kontakt", " <- turn", " ; pause"])
def test_a_remark_behind_a_row_is_named_and_takes_no_reading(tmp_path: Path, delimiter: str, remark: str) -> None:
    if delimiter == ";" and ";" in remark:
        return
    table = marked(tmp_path, delimiter, {10: remark, 60: " # off"})
    np.testing.assert_allclose(table.columns["force"], 4 * np.maximum(WAY - 0.15, 0) ** 1.5, atol=1e-4)
    assert not any(table.reasons)
    assert any(f'the first is "{remark.strip()}" (line 12)' in note for note in table.notes)


def test_a_remark_behind_a_row_that_speaks_of_its_readings_is_obeyed(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="another unit or range"):
        marked(tmp_path, ",", {50: " # force now in mN"})
    assert any("a zero was set anew" in note for note in marked(tmp_path, ",", {50: " # tare"}).notes)


@pytest.mark.parametrize("remark", [" # 0.5", " 0.5", "#"])
def test_numbers_behind_a_row_are_no_remark(tmp_path: Path, remark: str) -> None:
    with pytest.raises(InputError):
        marked(tmp_path, ",", {50: remark})


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "  "])
@pytest.mark.parametrize("line", ["-----", "*******", "####", "~~~~~", "- - - - -", "ok", "OK"])
@pytest.mark.parametrize("at", [N, N // 2, 10])
def test_a_line_that_says_nothing_is_passed_over_and_is_no_row(tmp_path: Path, delimiter: str, line: str, at: int) -> None:
    rows = [f"{0.1 * k:.1f},{x:.4f},{4 * max(x - 0.15, 0.0) ** 1.5:.4f}" for k, x in enumerate(WAY.tolist())]
    rows.insert(at, line)
    path = tmp_path / "lab.txt"
    path.write_text("\n".join(["t/s,s/mm,F/N", *rows]).replace(",", delimiter) + "\n", encoding="utf-8")
    table = read_lab_file(path)
    assert len(table.lines) == N
    assert not any(table.reasons)
    assert any(f'the first is "{line}" in line {at + 2}' in note for note in table.notes)


def test_a_count_below_rows_between_blanks_is_left_out_as_a_row_without_cells(tmp_path: Path) -> None:
    rows = [f"{0.1 * k:.1f} {x:.4f} {4 * max(x - 0.15, 0.0) ** 1.5:.4f}" for k, x in enumerate(WAY.tolist())]
    path = tmp_path / "lab.txt"
    path.write_text("\n".join(["t/s s/mm F/N", *rows, f"{N}"]) + "\n", encoding="utf-8")
    table = read_lab_file(path)
    assert [k for k, why in enumerate(table.reasons) if why] == [N]
    path.write_text("\n".join(["t/s s/mm F/N", *rows[:50], *(row.rsplit(" ", 1)[0] for row in rows[50:])]), encoding="utf-8")
    with pytest.raises(InputError, match="2 cells between blanks") as caught:
        read_lab_file(path)
    assert "Remove the line if it is none of the readings" in caught.value.faults[0].advice


@pytest.mark.parametrize("line", ["======", "=======", "second pad"])
def test_a_line_that_may_part_two_versions_or_presses_is_still_refused(tmp_path: Path, line: str) -> None:
    with pytest.raises(InputError, match="stands among the rows"):
        read(tmp_path, line)

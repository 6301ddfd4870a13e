"""Files of ordinary instruments and scripts: clocks without zeros in front, signals named elsewhere, empty columns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, nothing_used, observe, read_lab_file

N = 161
PLACE = [0.006 * min(i, N - 1 - i) for i in range(N)]
LOAD = [3.0 * max(0.0, x - 0.06) ** 1.5 + 0.001 * (i % 3 - 1) for i, x in enumerate(PLACE)]


def lab_file(folder: Path, head: Sequence[str], row: Callable[[int], str], encoding: str = "utf-8") -> Path:
    path = folder / "press.csv"
    path.write_text("\n".join([*head, *(row(i) for i in range(N)), ""]), encoding=encoding)
    return path


def refusal(path: Path, reading: Reading | None = None) -> str:
    with pytest.raises(InputError) as caught:
        read_lab_file(path, reading or Reading())
    return str(caught.value)


def assert_right(table: LabTable, step: float | None = None) -> None:
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * np.round(PLACE, 4), atol=1e-12)
    np.testing.assert_allclose(table.columns["force"], np.round(LOAD, 4), atol=1e-12)
    assert not any(table.reasons)
    if step is not None:
        time = table.columns["time"]
        np.testing.assert_allclose(time - time[0], step * np.arange(N), atol=2e-5)


def pressed(i: int, sep: str = ",") -> str:
    return f"{PLACE[i]:.4f}{sep}{LOAD[i]:.4f}"


# --- clocks ------------------------------------------------------------------------------------------------------------


def unpadded(i: int) -> tuple[int, int, int]:
    hours, rest = divmod(9 * 3600 + 59 * 60 + 50 + i, 3600)
    return hours, *divmod(rest, 60)


@pytest.mark.parametrize(
    ("head", "clock"),
    [
        ("Time", "2024/3/5 {}:{}:{}"),
        ("Time", "{}:{}:{}"),
        ("Date,Time", "2024/3/5,{}:{}:{}"),
        ("Time", "5.3.2024 {}:{}:{}"),
        ("Time", "2024-03-05 {}:{:02d}:{}"),
        ("Time", "2024-03-05 {}:{}:{} AM"),
        ("Time", "2024-03-05T{}:{}:{}Z"),
    ],
)
def test_times_without_zeros_in_front_are_read(tmp_path: Path, head: str, clock: str) -> None:
    head = f"{head},Displacement (mm),Force (N)"
    assert_right(read_lab_file(lab_file(tmp_path, [head], lambda i: f"{clock.format(*unpadded(i))},{pressed(i)}")), 1.0)


def test_half_days_without_zeros_in_front_are_read(tmp_path: Path) -> None:
    def row(i: int) -> str:
        hours, rest = divmod(11 * 3600 + 59 * 60 + 50 + i, 3600)
        minutes, seconds = divmod(rest, 60)
        return f"{hours}:{minutes}:{seconds} {'PM' if hours > 11 else 'AM'},{pressed(i)}"

    assert_right(read_lab_file(lab_file(tmp_path, ["Time,Displacement (mm),Force (N)"], row)), 1.0)


def test_seconds_without_zeros_in_front_have_their_milliseconds_beside_them(tmp_path: Path) -> None:
    def row(i: int) -> str:
        seconds, ms = divmod(57_000 + 125 * i, 1000)
        return f"10:{seconds // 60}:{seconds % 60},{ms},{pressed(i)}"

    assert_right(read_lab_file(lab_file(tmp_path, ["Time,ms,Displacement (mm),Force (N)"], row)), 0.125)


def test_a_ratio_is_no_clock(tmp_path: Path) -> None:
    table = read_lab_file(lab_file(tmp_path, ["Mix,Displacement (mm),Force (N)"], lambda i: f"10:1,{pressed(i)}"))
    assert "time" not in table.columns


@pytest.mark.parametrize("start", [739_325.5856742475, 45_365.5856742475])
def test_days_of_a_calendar_under_a_unit_of_days_are_read(tmp_path: Path, start: float) -> None:
    table = read_lab_file(
        lab_file(tmp_path, ["Time [d],Disp [mm],Force [N]"], lambda i: f"{start + 0.4 * i / 86400:.10f},{pressed(i)}")
    )
    assert_right(table, 0.4)


def test_days_of_a_calendar_under_a_unit_of_seconds_are_refused(tmp_path: Path) -> None:
    path = lab_file(tmp_path, ["Time [s],Disp [mm],Force [N]"], lambda i: f"{739325.58 + 0.4 * i / 86400:.10f},{pressed(i)}")
    assert "days of a calendar" in refusal(path)


# --- sizes -------------------------------------------------------------------------------------------------------------


def test_a_travel_in_contact_of_micrometres_under_millimetres_is_refused(tmp_path: Path) -> None:
    path = lab_file(
        tmp_path, ["Time (s),Displacement (mm),Force (N)"], lambda i: f"{0.1 * i:.1f},{1e3 * PLACE[i]:.1f},{LOAD[i]:.4f}"
    )
    assert "--units displacement=..." in refusal(path)
    assert_right(read_lab_file(path, Reading(units={"displacement": "um"})), 0.1)
    assert read_lab_file(path, Reading(units={"displacement": "mm"})).columns["displacement"].max() > 0.1


@pytest.mark.parametrize(("force", "place"), [("N", 3e5), ("kN", 3e2)])
def test_a_load_of_a_hundred_tonnes_is_refused(tmp_path: Path, force: str, place: float) -> None:
    path = lab_file(
        tmp_path,
        [f"Time (s),Displacement (mm),Force ({force})"],
        lambda i: f"{0.1 * i:.1f},{PLACE[i]:.4f},{place * LOAD[i]:.1f}",
    )
    assert "--units force=..." in refusal(path)


@pytest.mark.parametrize("start", [0.0, 412.0])
def test_a_block_of_foam_that_is_pressed_by_sixty_millimetres_after_a_long_way_is_read(tmp_path: Path, start: float) -> None:
    def row(i: int) -> str:
        place = 2.0 * min(i, N - 1 - i)  # the last sixty of 160 mm in contact
        load = 200.0 * max(0.0, (place - 100) / 60) ** 1.5
        return f"{0.1 * i:.1f},{place + start:.3f},{load + 0.01 * (i % 3 - 1):.3f}"

    table = read_lab_file(lab_file(tmp_path, ["Time (s),Displacement (mm),Force (N)"], row))
    assert np.isclose(np.ptp(table.columns["displacement"]), 0.16)


# --- columns without a reading -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("cell", ["", "nan", "NaN", "#N/A"])
@pytest.mark.parametrize("name", ["C (pF)", "Cp (pF)", "Cs (pF)"])
def test_a_press_is_read_without_a_capacitance_that_no_row_has(tmp_path: Path, cell: str, name: str) -> None:
    head = f"Time (s),Displacement (mm),Force (N),{name},D"
    table = read_lab_file(lab_file(tmp_path, [head], lambda i: f"{0.1 * i:.1f},{pressed(i)},{cell},{cell}"))
    assert_right(table, 0.1)
    assert f'"{name}" has no reading in any row: the press is read without it' in table.notes
    assert set(table.columns) == {"time", "displacement", "force"}
    assert np.count_nonzero(observe(table).used) > 50


def test_a_capacitance_that_was_asked_for_and_is_empty_is_told_how_to_be_left_out(tmp_path: Path) -> None:
    path = lab_file(tmp_path, ["Time (s),Displacement (mm),Force (N),C (pF)"], lambda i: f"{0.1 * i:.1f},{pressed(i)},")
    obs = observe(read_lab_file(path, Reading(columns={"capacitance": "C (pF)"})))
    assert not np.any(obs.used)
    assert "leave it out: --columns capacitance=none" in nothing_used(obs).advice


def test_a_force_that_no_row_has_is_no_press(tmp_path: Path) -> None:
    path = lab_file(tmp_path, ["Time (s),Displacement (mm),Force (N),C (pF)"], lambda i: f"{0.1 * i:.1f},{PLACE[i]:.4f},,")
    obs = observe(read_lab_file(path))
    assert not np.any(obs.used)


# --- names elsewhere ---------------------------------------------------------------------------------------------------

Q800 = [
    *("CLOSED", "Version\tDMA Q800", "Instrument\tDMA Q800 V20.22", "Nsig\t4", "Sig1\tTime (min)"),
    *("Sig2\tTemperature (°C)", "Sig3\tDisplacement (mm)", "Sig4\tStatic Force (N)", "Time\t14:03:22", "StartOfData"),
]


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8"])
def test_signals_listed_by_number_name_the_columns(tmp_path: Path, encoding: str) -> None:
    path = lab_file(tmp_path, Q800, lambda i: f"{0.05 * i:.5f}\t24.98\t{pressed(i, chr(9))}", encoding)
    table = read_lab_file(path)
    assert_right(table, 3.0)
    assert any("list of signals" in note for note in table.notes)


def test_signals_that_are_not_all_listed_name_nothing(tmp_path: Path) -> None:
    head = [line for line in Q800 if not line.startswith("Sig2")]
    refusal(lab_file(tmp_path, head, lambda i: f"{0.05 * i:.5f}\t24.98\t{pressed(i, chr(9))}"))


@pytest.mark.parametrize("comments", ["\tInstron 5943\tInstron 5943", "\tmeasured\tE4980A", "Hioki 8450\t\tU9C"])
def test_comments_below_the_units_may_name_instruments(tmp_path: Path, comments: str) -> None:
    head = ["Time\tDisplacement\tForce", "s\tmm\tN", comments]
    assert_right(read_lab_file(lab_file(tmp_path, head, lambda i: f"{0.1 * i:.1f}\t{pressed(i, chr(9))}")), 0.1)


@pytest.mark.parametrize("comments", ["\tx1000\tInstron 5943", "\tRun 1\tRun 2", "\tForce\tDisplacement"])
def test_comments_below_the_units_that_say_more_are_refused(tmp_path: Path, comments: str) -> None:
    head = ["Time\tDisplacement\tForce", "s\tmm\tN", comments]
    refusal(lab_file(tmp_path, head, lambda i: f"{0.1 * i:.1f}\t{pressed(i, chr(9))}"))


HIOKI = ['"File name","AUTO0001.MEM"', '"CH","U1-1","U1-2"']


@pytest.mark.parametrize(
    ("names", "addresses"),
    [
        ('"Comment","Disp","Force"', '"Time(s)","U1-1[mm]","U1-2[N]"'),
        ("Comment,Displacement,Load", "Time (s),CH1[mm],CH2[N]"),
    ],
)
def test_a_line_of_comments_above_addresses_names_the_channels(tmp_path: Path, names: str, addresses: str) -> None:
    table = read_lab_file(lab_file(tmp_path, [*HIOKI, names, addresses], lambda i: f"{0.5 * i:.4E},{pressed(i)}"))
    assert_right(table, 0.5)
    assert any('the line "Comment"' in note for note in table.notes)


def test_a_line_of_comments_that_contradicts_the_units_below_is_refused(tmp_path: Path) -> None:
    head = [*HIOKI, '"Comment","Force","Disp"', '"Time(s)","U1-1[mm]","U1-2[N]"']
    refusal(lab_file(tmp_path, head, lambda i: f"{0.5 * i:.4E},{pressed(i)}"))


def test_a_line_of_comments_above_names_is_no_line_of_names(tmp_path: Path) -> None:
    head = ['"Comment","Setpoint","Tare"', '"Time (s)","Displacement (mm)","Force (N)"']
    table = read_lab_file(lab_file(tmp_path, head, lambda i: f"{0.5 * i:.2f},{pressed(i)}"))
    assert_right(table, 0.5)


# --- words -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "head", ["Time (s),Displacement (mm),Force (N)", "# compression negative\nTime (s),Extension (mm),Load (N)"]
)
def test_a_load_that_falls_to_zero_at_once_may_be_a_pull_off(tmp_path: Path, head: str) -> None:
    def row(i: int) -> str:
        time = 0.15 * i
        depth = 0.0577 * time if time < 10 else 0.577 - 0.0645 * (time - 10)
        load = -2.1 * max(0.0, depth) ** 1.5
        if time >= 10:
            load = 2.0 - 5.24 * max(0.0, depth + 0.1) ** 1.5 if depth > -0.27 else 0.0
        return f"{time:.2f},{-depth:.4f},{load + 0.002 * (7 * i % 5 - 2):.4f}"

    notes = read_lab_file(lab_file(tmp_path, [head], row)).notes
    assert any("a ball that came off the sample" in note for note in notes), notes


@pytest.mark.parametrize("word", ["Reference", "Trigger"])
def test_a_reference_is_not_said_to_be_commanded(tmp_path: Path, word: str) -> None:
    head = f"Time (s),Displacement (mm),Force (N),{word} force (N)"
    table = read_lab_file(lab_file(tmp_path, [head], lambda i: f"{0.1 * i:.1f},{pressed(i)},0.05"))
    assert any("what others are compared with" in part.reason for part in table.unread)


def test_rows_that_are_short_do_not_decide_on_the_decimal_mark(tmp_path: Path) -> None:
    def row(i: int) -> str:
        cells = [f"{0.1 * i:.2f}", f"{LOAD[i]:.3f}", f"{PLACE[i]:.4f}", f"{97 + PLACE[i]:.3f}"]
        return ";".join(cells if i not in (12, 13, 14) else [cells[0], *cells[2:]])

    table = read_lab_file(lab_file(tmp_path, ["t[s];F[N];z[mm];C[pF]"], row))
    assert [r for r, why in enumerate(table.reasons) if why] == [12, 13, 14]
    assert np.all(np.isnan(table.columns["displacement"][12:15]))
    assert any("3 row(s) with fewer cells than most" in note for note in table.notes)


def test_a_load_that_goes_on_in_whole_numbers_may_be_in_another_unit(tmp_path: Path) -> None:
    def row(i: int) -> str:
        return f"{0.1 * i:.1f},{PLACE[i]:.4f}," + (f"{LOAD[i]:.3f}" if i < 60 or LOAD[i] < 0.2 else f"{1e3 * LOAD[i]:.0f}")

    path = tmp_path / "press.csv"
    path.write_text("\n".join(["Time (s),Displacement (mm),Force (N)", *(row(i) for i in range(100)), ""]))
    said = refusal(path)
    assert "have no decimal mark, or are in another unit" in said
    assert "in one unit" in said


def test_of_a_letter_and_a_plain_name_both_may_be_meant(tmp_path: Path) -> None:
    def row(i: int) -> str:
        return f"{0.1 * i:.1f},{3 - PLACE[i]:.4f},{pressed(i)}"

    said = refusal(lab_file(tmp_path, ["Time (s),d (mm),Weg (mm),Kraft (N)"], row))
    assert '"Weg (mm)", which bears the plain name, could be it as well' in said


def test_a_load_alone_is_told_what_it_lacks(tmp_path: Path) -> None:
    path = lab_file(tmp_path, ["Time (s),Force (N)"], lambda i: f"{0.1 * i:.1f},{LOAD[i]:.4f}")
    for reading in (Reading(), Reading(columns={"displacement": "none"})):
        said = refusal(path, reading)
        assert "A load alone is no press, export the displacement" in said
        assert "--columns displacement" not in said


def test_a_load_beside_columns_of_other_names_is_told_both_ways(tmp_path: Path) -> None:
    path = lab_file(tmp_path, ["Time (s),Force (N),Wert"], lambda i: f"{0.1 * i:.1f},{LOAD[i]:.4f},{PLACE[i]:.4f}")
    said = refusal(path)
    assert "--columns displacement=..." in said
    assert "a load alone is no press" in said


def test_pairs_of_x_and_y_below_a_title_are_told_to_be_named(tmp_path: Path) -> None:
    head = ["Force vs displacement,,Capacitance vs displacement,", "X,Y,X,Y"]
    said = refusal(lab_file(tmp_path, head, lambda i: f"{PLACE[i]:.4f},{LOAD[i]:.3f},{PLACE[i]:.4f},{97 + PLACE[i]:.3f}"))
    assert "Write one line of names with units" in said
    assert "Remove the line" not in said
    named = ["Displacement (mm),Force (N),Displacement (mm),Capacitance (pF)"]
    read_lab_file(lab_file(tmp_path, named, lambda i: f"{PLACE[i]:.4f},{LOAD[i]:.3f},{PLACE[i]:.4f},{97 + PLACE[i]:.3f}"))


# --- names, units and counts as other programs write them ------------------------------------------------------------------

PRESS = [(0.1 * i, place, load) for i, (place, load) in enumerate(zip(PLACE, LOAD, strict=True))]


def read_written(folder: Path, lines: Sequence[str]) -> LabTable:
    path = folder / "written.csv"
    path.write_text("\n".join([*lines, ""]))
    return read_lab_file(path)


def test_names_of_a_graphtec_stand_again_among_its_units(tmp_path: Path) -> None:
    rows = [f"{i + 1},2026/11/20 10:00:{i // 10:02d},{100 * (i % 10)},{f:.4f},{d:.4f},LL" for i, (_, d, f) in enumerate(PRESS)]
    table = read_written(tmp_path, ["Number,Date&Time,ms,Force,Disp,Alarm", "NO.,Time,ms,N,mm,A12", *rows])
    np.testing.assert_allclose(table.columns["force"], [f for _, _, f in PRESS], atol=1e-4)
    np.testing.assert_allclose(np.diff(table.columns["time"]), 0.1, atol=1e-9)


def test_a_row_of_dashes_below_the_names_is_none(tmp_path: Path) -> None:
    rows = [f'"{t:.2f}","{f:.4f}","{d:.4f}"' for t, d, f in PRESS]
    table = read_written(tmp_path, ['"Time","Force","Stroke"', '"-","-","-"', '"sec","N","mm"', *rows])
    assert table.sources["force"].startswith("Force")
    assert any("dashes" in unread.reason for unread in table.unread)


@pytest.mark.parametrize(
    ("header", "factor"),
    [
        ("Zeit [s];Weg [1/100 mm];Kraft [N]", 1e-5),
        ("# Columns: Zeit [s];Weg [mm];Kraft [N]", 1e-3),
        ("Zeit|s;Weg|mm;Kraft|N", 1e-3),
        ("Zeit [s];WA2 Weg [mm];U9C_10N [N]", 1e-3),
    ],
)
def test_units_and_names_as_gauges_comments_and_loggers_write_them(tmp_path: Path, header: str, factor: float) -> None:
    table = read_written(tmp_path, [header, *(f"{t:.2f};{d:.4f};{f:.4f}" for t, d, f in PRESS)])
    np.testing.assert_allclose(table.columns["displacement"], [factor * d for _, d, _ in PRESS], atol=1e-4 * factor)
    assert any("numbers of 1/100 mm" in note for note in table.notes) == ("1/100" in header)
    np.testing.assert_allclose(table.columns["force"], [f for _, _, f in PRESS], atol=1e-4)


def test_a_table_as_pandas_prints_it_has_a_count_before_its_rows(tmp_path: Path) -> None:
    rows = [f"{i:<4}{t:9.3f}{d:10.4f}{f:10.4f}" for i, (t, d, f) in enumerate(PRESS)]
    table = read_written(tmp_path, ["       time_s   disp_mm   force_N", *rows])
    np.testing.assert_allclose(table.columns["displacement"], [1e-3 * d for _, d, _ in PRESS], atol=1e-7)


@pytest.mark.parametrize("factor", [1.0, 1e3])
def test_times_in_single_precision_are_refused(tmp_path: Path, factor: float) -> None:
    at = [float(np.float32((1709633500.0 + 2 * i) * factor)) for i in range(len(PRESS))]
    unit = "s" if factor == 1 else "ms"
    rows = [f"{t:.1f},{d:.4f},{f:.4f}" for t, (_, d, f) in zip(at, PRESS, strict=True)]
    with pytest.raises(InputError, match="single precision"):
        read_written(tmp_path, [f"Time ({unit}),Extension (mm),Load (N)", *rows])


def test_rows_of_two_clocks_in_one_table_are_to_be_read_twice(tmp_path: Path) -> None:
    def row(i: int) -> str:
        return f"{0.1 * i:.1f},{pressed(i)}," if i % 2 else f"{0.1 * i:.1f},,,{97 + 3 * PLACE[i]:.4f}"

    path = lab_file(tmp_path, ["Time (s),Displacement (mm),Force (N),Cp (pF)"], row)
    obs = observe(read_lab_file(path))
    assert not np.any(obs.used)
    advice = nothing_used(obs).advice
    assert "--columns capacitance=none" in advice
    assert "--columns force=none --columns displacement=none" in advice
    press = observe(read_lab_file(path, Reading(columns={"capacitance": "none"})))
    log = observe(read_lab_file(path, Reading(columns={"force": "none", "displacement": "none"})))
    assert np.count_nonzero(press.used) > 25
    assert np.count_nonzero(log.used) > 25

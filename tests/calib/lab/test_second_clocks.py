"""A press and a capacitance in one file, each at a time of its own: of names that are not all understood, too."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import AS_FOUND, LabTable, Reading, read_lab_file

N = 90


def read(folder: Path, press: str, meter: str, clock: Callable[[float], float], reading: Reading = AS_FOUND) -> LabTable:
    rows = [f"{press};disp (mm);force (N);{meter};Cp (pF)"]
    for i in range(N):
        t, x = 0.1 * i, 0.01 * min(i, N - 1 - i)
        load = 1.5 * max(0.0, x - 0.05) ** 1.5
        rows.append(f"{t:.2f};{x:.4f};{load:.4f};{clock(t):.2f};{98 + load:.4f}")
    path = folder / "lab.csv"
    path.write_text("\n".join(rows) + "\n")
    return read_lab_file(path, reading)


@pytest.mark.parametrize(
    ("press", "meter"),
    [
        ("t_press (s)", "t_lcr (s)"),
        ("Time press (s)", "Time LCR (s)"),
        ("time_utm (s)", "time_lcr (s)"),
        ("Time Instron (s)", "Time Hioki (s)"),
        ("t_mecmesin (s)", "t_C (s)"),
        ("Time machine (s)", "Time meter (s)"),
    ],
)
@pytest.mark.parametrize("clock", [lambda t: t + 1.37, lambda t: 1.01 * t + 1.37], ids=["begun later", "faster"])
def test_a_second_clock_of_any_name_is_asked_about(
    tmp_path: Path, press: str, meter: str, clock: Callable[[float], float]
) -> None:
    with pytest.raises(InputError, match="may be a time of its own beside") as raised:
        read(tmp_path, press, meter, clock)
    assert "--columns capacitance=none" in str(raised.value)
    press_left_out = "--columns displacement=none --columns force=none"
    both = f'"time={press}" --columns capacitance=none or --columns "time={meter}" {press_left_out}'
    assert both.replace('"', "") in str(raised.value).replace('"', "")
    for one in (press, meter):
        try:
            merged = {"force", "capacitance"} <= set(
                read(tmp_path, press, meter, clock, Reading(columns={"time": one})).columns
            )
        except InputError:
            merged = False
        assert not merged
    of_meter = Reading(columns={"time": meter, "displacement": "none", "force": "none"})
    assert set(read(tmp_path, press, meter, clock, of_meter).columns) == {"time", "capacitance"}
    alone = Reading(columns={"time": press, "capacitance": "none"})
    table = read(tmp_path, press, meter, clock, alone)
    assert table.columns["time"][[0, 10]] == pytest.approx([0.0, 1.0])


@pytest.mark.parametrize(
    ("name", "clock"),
    [
        ("Step Time lap (s)", lambda t: t % 3.0),  # begins anew
        ("Dwell (s)", lambda t: 5.0),
        ("Time left (s)", lambda t: 9.0 - t),
        ("Uptime box (s)", lambda t: t),  # the same
        ("Heater on (s)", lambda t: 0.1 * t),
        ("T_C", lambda t: 23.1),  # a temperature
        ("T_C", lambda t: 23.1 + 0.1 * round(t / 3)),
    ],
)
def test_another_column_in_seconds_that_is_no_clock_of_the_record_changes_nothing(
    tmp_path: Path, name: str, clock: Callable[[float], float]
) -> None:
    table = read(tmp_path, "Time (s)", name, clock)
    assert table.columns["time"][10] == pytest.approx(1.0)
    assert {"force", "capacitance"} <= set(table.columns)


TAILS = ["Time (s).1", "Time (s)_1", "Time (s)2", "Time (s)_duplicated_0", "Time (s) (2)", "Time (s):1", "Time (s) 2"]


@pytest.mark.parametrize("meter", ["Time (s)", *TAILS])
def test_a_second_time_that_a_program_renamed_is_asked_about_like_one_of_the_same_name(tmp_path: Path, meter: str) -> None:
    with pytest.raises(InputError, match=r"appears twice|may be the time") as raised:
        read(tmp_path, "Time (s)", meter, lambda t: 3.3 * t)
    assert '--columns time=4 to read "Cp (pF)"' in str(raised.value) or "--columns capacitance=none" in str(raised.value)
    press = read(tmp_path, "Time (s)", meter, lambda t: 3.3 * t, Reading(columns={"time": "1", "capacitance": "none"}))
    assert "capacitance" not in press.columns
    assert press.columns["time"][10] == pytest.approx(1.0)
    capacitance = Reading(columns={"time": "4", "force": "none", "displacement": "none"})
    table = read(tmp_path, "Time (s)", meter, lambda t: 3.3 * t, capacitance)
    assert set(table.columns) == {"time", "capacitance"}
    assert table.columns["time"][10] == pytest.approx(3.3)


@pytest.mark.parametrize(
    ("press", "meter"),
    [("Time_s", "Time_s_1"), ("Time_s_1", "Time_s_2"), ("Time (s)...1", "Time (s)...4"), ("Time..s.", "Time..s..1")],
)
def test_the_time_is_named_as_the_program_wrote_it(tmp_path: Path, press: str, meter: str) -> None:
    with pytest.raises(InputError, match="appears twice"):
        read(tmp_path, press, meter, lambda t: 3.3 * t)
    table = read(tmp_path, press, meter, lambda t: 3.3 * t, Reading(columns={"time": meter}))
    assert set(table.columns) == {"time", "capacitance"}
    assert table.columns["time"][10] == pytest.approx(3.3)


@pytest.mark.parametrize("meter", TAILS[:-1])
def test_a_second_time_of_the_same_instants_is_told(tmp_path: Path, meter: str) -> None:
    table = read(tmp_path, "Time (s)", meter, lambda t: t)
    assert {"force", "capacitance"} <= set(table.columns)
    assert any(meter in note for note in table.notes)
    assert any("same values" in note for note in table.notes)


@pytest.mark.parametrize("clock", [lambda t: 3.3 * t, lambda t: 0.3 * t], ids=["longer", "shorter"])
def test_a_time_of_unknown_name_between_press_and_capacitance_is_asked_about_however_long(
    tmp_path: Path, clock: Callable[[float], float]
) -> None:
    with pytest.raises(InputError, match="may be a time of its own beside"):
        read(tmp_path, "Time (s)", "LCR (s)", clock)
    with pytest.raises(InputError, match="may be a time of its own beside"):
        read(tmp_path, "Time (s)", "LCR_t", clock)
    alone = Reading(columns={"time": "LCR (s)", "displacement": "none", "force": "none"})
    assert read(tmp_path, "Time (s)", "LCR (s)", clock, alone).columns["time"][10] == pytest.approx(clock(1.0))


def side_by_side(folder: Path, header: str, twin: Callable[[float], float], reading: Reading = AS_FOUND) -> LabTable:
    rows = [header]
    for i in range(N):
        x = 0.01 * min(i, N - 1 - i)
        load = 1.5 * max(0.0, x - 0.05) ** 1.5
        rows.append(f"{0.1 * i:.2f},{x:.4f},{load:.4f},{twin(load):.4f}")
    path = folder / "lab.csv"
    path.write_text("\n".join(rows) + "\n")
    return read_lab_file(path, reading)


@pytest.mark.parametrize("tail", ["_1", ".1", "_duplicated_0", " (2)"])
def test_a_quantity_that_a_program_renamed_is_that_quantity_twice(tmp_path: Path, tail: str) -> None:
    header = f"Time_s,Extension_mm,Load_N,Load_N{tail}"
    with pytest.raises(InputError, match=r"appears twice \(columns 3 and 4\)"):
        side_by_side(tmp_path, header, lambda f: f + 0.3)
    table = side_by_side(tmp_path, header, lambda f: f + 0.3, Reading(columns={"force": f"Load_N{tail}"}))
    assert table.columns["force"][0] == pytest.approx(0.3)
    assert "force" in side_by_side(tmp_path, header, lambda f: f).columns


@pytest.mark.parametrize("other", ["Sample_1", "Load_N_max", "Load 2 (N)", "Temp_C_1"])
def test_a_name_with_a_number_that_is_not_another_twice_changes_nothing(tmp_path: Path, other: str) -> None:
    table = side_by_side(tmp_path, f"Time_s,Extension_mm,Load_N,{other}", lambda f: f + 0.3)
    assert table.columns["force"][0] == 0.0
    assert not any("second column" in note for note in table.notes)


@pytest.mark.parametrize(
    "header",
    [
        "Time_s,Extension_mm,Load_N,T_C,Time_s_1,Extension_mm_1,Load_N_1,T_C_1",
        "Time (s),Extension (mm),Load (N),Probe,Time (s).1,Extension (mm).1,Load (N).1,Probe.1",
        "Time (s),Extension (mm),Load (N),Cycle,Time (s)2,Extension (mm)3,Load (N)4,Cycle",
    ],
)
def test_specimens_side_by_side_are_told_apart_where_a_program_renamed_them(tmp_path: Path, header: str) -> None:
    both = ((0.1, 0.01, 0.002), (0.2, 0.012, 0.003))
    rows = [",".join(f"{t * i:.2f},{x * i:.4f},{f * i * i:.4f},1" for t, x, f in both) for i in range(N)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    with pytest.raises(InputError, match="2 specimens stand side by side"):
        read_lab_file(path)
    assert read_lab_file(path, Reading(specimen=2)).columns["time"][10] == pytest.approx(2.0)


def two_tables(
    folder: Path, header: str, left: list[list[str]], right: list[list[str]], reading: Reading = AS_FOUND
) -> LabTable:
    width = [len(left[0]), len(right[0])]
    rows = [
        ",".join((left[i] if i < len(left) else [""] * width[0]) + (right[i] if i < len(right) else [""] * width[1]))
        for i in range(max(len(left), len(right)))
    ]
    path = folder / "lab.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return read_lab_file(path, reading)


def press_of(n: int) -> list[list[str]]:
    return [[f"{0.004 * i:.4f}", f"{0.0006 * i**1.5:.4f}"] for i in range(n)]


def meter_of(n: int, gap: bool, clock: str) -> list[list[str]]:
    first = {"s": [f"{0.07 * i:.3f}" for i in range(n)], "No.": [str(i + 1) for i in range(n)]}[clock]
    return [[*[""] * gap, first[i], f"{97.2 + 0.00004 * i**1.5:.4f}"] for i in range(n)]


@pytest.mark.parametrize("gap", [True, False])
@pytest.mark.parametrize(("tester", "meter"), [(240, 180), (240, 228), (240, 300), (240, 246)])
def test_a_press_without_a_time_beside_a_meter_with_one_that_ends_elsewhere_is_two_tables(
    tmp_path: Path, gap: bool, tester: int, meter: int
) -> None:
    if not gap and meter > tester:
        return
    header = f"Displacement (mm),Force (N),{',' * gap}Time (s),Cp (pF)"
    with pytest.raises(InputError, match="seem to be two tables side by side") as raised:
        two_tables(tmp_path, header, press_of(tester), meter_of(meter, gap, "s"))
    assert "--columns time=none --columns capacitance=none" in str(raised.value)
    assert "--columns displacement=none --columns force=none" in str(raised.value)
    press = Reading(columns={"time": "none", "capacitance": "none"})
    table = two_tables(tmp_path, header, press_of(tester), meter_of(meter, gap, "s"), press)
    assert set(table.columns) == {"displacement", "force"}
    alone = Reading(columns={"displacement": "none", "force": "none"})
    assert set(two_tables(tmp_path, header, press_of(tester), meter_of(meter, gap, "s"), alone).columns) == {
        "time",
        "capacitance",
    }


@pytest.mark.parametrize("meter", [180, 228])
def test_a_capacitance_that_ends_with_a_count_of_its_rows_has_a_clock_of_its_own(tmp_path: Path, meter: int) -> None:
    header = "Displacement (mm),Force (N),,No.,Cp (pF)"
    with pytest.raises(InputError, match="a clock of its own"):
        two_tables(tmp_path, header, press_of(240), meter_of(meter, True, "No."))
    without = Reading(columns={"capacitance": "none"})
    assert "capacitance" not in two_tables(tmp_path, header, press_of(240), meter_of(meter, True, "No."), without).columns


def test_a_time_that_an_empty_column_parts_from_the_press_is_told(tmp_path: Path) -> None:
    table = two_tables(tmp_path, "Displacement (mm),Force (N),,Time (s),Cp (pF)", press_of(90), meter_of(90, True, "s"))
    assert any("stands apart from" in note for note in table.notes)


@pytest.mark.parametrize("lost", [1, 40])
def test_a_meter_that_was_switched_off_early_is_of_the_same_table_still(tmp_path: Path, lost: int) -> None:
    left = [[f"{0.05 * i:.2f}", *row] for i, row in enumerate(press_of(240))]
    right = [[row[1]] for row in meter_of(240 - lost, False, "s")]
    table = two_tables(tmp_path, "Time (s),Displacement (mm),Force (N),Cp (pF)", left, right)
    assert {"time", "displacement", "force", "capacitance"} <= set(table.columns)


def test_rows_that_are_left_out_for_a_cell_are_not_said_to_be_used(tmp_path: Path) -> None:
    table = two_tables(
        tmp_path, "Displacement (mm),Force (N),Cp (pF)", press_of(240), [[f"{97 + 0.01 * i}"] for i in range(180)]
    )
    (note,) = (note for note in table.notes if "has no value in lines" in note)
    assert "these rows are left out" in note


@pytest.mark.parametrize(
    "clock", [lambda t: 2.5 * t, lambda t: t + 1.37, lambda t: 0.4 * t], ids=["slower", "begun later", "faster"]
)
@pytest.mark.parametrize("press", ["Time_MTS (s)", "Zeit_Zwick (s)", "t_TA (s)", "Time_Mark10 (s)", "MTS Time (s)"])
def test_the_clock_of_the_meter_is_not_taken_for_the_press_beside_one_of_a_tester_that_is_not_known(
    tmp_path: Path, press: str, clock: Callable[[float], float]
) -> None:
    with pytest.raises(InputError, match="may be a time of its own beside"):
        read(tmp_path, press, "Time_LCR (s)", clock)


@pytest.mark.parametrize(
    ("press", "meter"),
    [
        ("Time_MTS (s)", "Time_FDC (s)"),
        ("Time_MTS (s)", "Time_E4980A (s)"),
        ("Zeit_Zwick [s]", "Zeit_FDC [s]"),
        ("MTS clock (s)", "FDC clock (ms)"),
    ],
)
@pytest.mark.parametrize(
    "clock", [lambda t: 2.5 * t, lambda t: t + 1.37, lambda t: 0.4 * t], ids=["slower", "begun later", "faster"]
)
@pytest.mark.parametrize("said", [{}, {"time": "none"}], ids=["as found", "without a time"])
def test_of_two_clocks_that_are_both_of_unknown_names_one_is_asked_for(
    tmp_path: Path, press: str, meter: str, clock: Callable[[float], float], said: dict[str, str]
) -> None:
    def as_written(t: float) -> float:
        return clock(t) * (1000 if "(ms)" in meter else 1)

    with pytest.raises(InputError, match="may be a time of its own beside") as raised:
        read(tmp_path, press, meter, as_written, Reading(columns=said))
    assert f'--columns "time={press}" --columns capacitance=none or --columns "time={meter}"' in str(raised.value)
    table = read(tmp_path, press, meter, as_written, Reading(columns={"time": press, "capacitance": "none"}))
    assert table.columns["time"][[0, 10]] == pytest.approx([0.0, 1.0])
    of_meter = Reading(columns={"time": meter, "displacement": "none", "force": "none"})
    assert read(tmp_path, press, meter, as_written, of_meter).columns["time"][10] == pytest.approx(clock(1.0))


def test_two_columns_of_unknown_names_that_are_one_clock_are_none_of_two(tmp_path: Path) -> None:
    table = read(tmp_path, "Time_MTS (s)", "Time_FDC (s)", lambda t: t)
    assert {"displacement", "force", "capacitance"} <= set(table.columns)
    assert any(note.startswith('no time is read; "Time_MTS (s)" rises') for note in table.notes)


@pytest.mark.parametrize(
    "pair", [("Time_MTS (s)", "Time_FDC (s)"), ("Time_Instron (s)", "Time_Hioki (s)"), ("t_TA_s", "t_LCR_s")]
)
@pytest.mark.parametrize("order", ["{0};{1};{2}", "{0};{2};{1}"], ids=["both in front", "one in front, one behind"])
def test_two_clocks_that_stand_anywhere_are_asked_about_by_their_names_alone(
    tmp_path: Path, pair: tuple[str, str], order: str
) -> None:
    rows = [order.format(*pair, "disp (mm);force (N);Cp (pF)")]
    for i in range(N):
        x = 0.01 * min(i, N - 1 - i)
        load = 1.5 * max(0.0, x - 0.05) ** 1.5
        rows.append(order.format(f"{0.1 * i:.2f}", f"{0.25 * i:.2f}", f"{x:.4f};{load:.4f};{98 + load:.4f}"))
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(rows) + "\n")
    with pytest.raises(InputError, match="may be a time of its own beside"):
        read_lab_file(path)


@pytest.mark.parametrize("names", [("X", "X"), ("X_Value", "X_Value"), ("X_Value (s)", "X_Value (s)")])
@pytest.mark.parametrize(("read", "way"), [("Cp (pF)", "--columns force=none"), ("Force (N)", "")])
def test_two_axes_of_one_name_that_are_not_understood_and_differ_are_asked_about(
    tmp_path: Path, names: tuple[str, str], read: str, way: str
) -> None:
    depth = 1 - np.abs(np.linspace(-1, 1, 80))
    of = {"Cp (pF)": 97 + depth, "Force (N)": 4 * depth**1.5, "Ext (mm)": depth}
    second = "Force (N)" if read == "Cp (pF)" else "Ext (mm)"
    for factor, refused in ((1.0, False), (2.0, True)):
        path = tmp_path / "twins.csv"
        rows = [
            f"{0.1 * i:.2f},{a:.4f},{0.1 * factor * i + 0.3 * refused:.2f},{b:.4f}"
            for i, (a, b) in enumerate(zip(of[read], of[second], strict=True))
        ]
        path.write_text("\n".join([f"{names[0]},{read},{names[1]},{second}", *rows]) + "\n", encoding="utf-8")
        if not refused:
            assert "force" in read_lab_file(path, Reading()).columns
            continue
        with pytest.raises(InputError, match=r"stands twice .*both rise and differ|may be a time of its own beside") as error:
            read_lab_file(path, Reading())
        assert (way or "one clock") in error.value.faults[0].advice

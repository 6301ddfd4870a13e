"""Which column of a lab file is read, which is named as not read and why, and what is left to the user to say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, SeveralSpecimens, read_lab_file
from calib.lab.instruments.unit_cells import unit_cell
from calib.lab.instruments.units import asked_factor, lab_factor
from calib.lab.instruments.vocabulary import understand, why_unread

N = 60
TIME = np.arange(N) * 0.1
DEPTH = np.concatenate([np.linspace(0.0, 1.0, 36), np.linspace(1.0, 0.02, 24)])
FORCE = 7.0 * np.clip(DEPTH - 0.1, 0.0, None) ** 1.7 + 0.003 * np.sin(37.0 * np.arange(N))
CAP = 97.4 + FORCE / 3.0


def cells(values: npt.NDArray[np.floating[Any]], digits: int = 4) -> list[str]:
    return [f"{v:.{digits}f}" for v in values]


T, D, F, C = cells(TIME, 2), cells(DEPTH), cells(FORCE), cells(CAP)
Columns = Sequence[tuple[str, Sequence[str]]]
TESTER: Columns = (("Time (s)", T), ("Extension (mm)", D), ("Load (N)", F))
METER: Columns = (("Time (s)", T), ("Cp (pF)", C))


def read(
    tmp_path: Path, table: Columns, above: Sequence[str] = (), below: Sequence[str] = (), sep: str = ",", **said: Any
) -> LabTable:
    """A table of columns, read."""
    path = tmp_path / "lab.csv"
    rows = [sep.join(row) for row in zip(*(c for _, c in table), strict=True)]
    head = [*above, sep.join(n for n, _ in table), *([sep.join(below)] if below else [])]
    path.write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path, Reading(**said))


def refused(tmp_path: Path, table: Columns, **more: Any) -> InputError:
    with pytest.raises(InputError) as caught:
        read(tmp_path, table, **more)
    assert all(f.advice for f in caught.value.faults)
    return caught.value


def reasons(table: LabTable) -> Mapping[str, str]:
    return {u.what: u.reason for u in table.unread}


@pytest.mark.parametrize(("name", "per_second"), [("t(ms)", 1e3), ("t(us)", 1e6), ("t (min)", 1 / 60)])
def test_times_of_day_that_run_as_a_time_in_another_unit_than_seconds_are_no_choice(
    tmp_path: Path, name: str, per_second: float
) -> None:
    passed = 0.7 * np.arange(N)
    days = [f"13:01:{s:05.2f}" for s in 2.0 + passed]
    table = (("received", days), (name, cells(per_second * (5.0 + passed), 3)), *TESTER[1:])
    assert read(tmp_path, table).sources["time"] == name
    other = (("received", days), (name, cells(per_second * 0.9 * passed, 3)), *TESTER[1:])
    assert "run otherwise" in refused(tmp_path, other).faults[0].message


@pytest.mark.parametrize(("name", "taken"), [("Time 2 (s)", False), ("Time (s)", True)])
@pytest.mark.parametrize("clock", ["Clock", "Time of day", "Stamp of the log"])
def test_times_of_day_under_an_unknown_name_are_no_reason_to_take_a_second_time(
    tmp_path: Path, clock: str, name: str, taken: bool
) -> None:
    days = [f"13:01:{s:05.2f}" for s in 2.0 + 0.7 * np.arange(N)]
    table = ((clock, days), (name, cells(0.91 * np.arange(N), 2)), *TESTER[1:])
    if taken:
        assert read(tmp_path, table).sources["time"] == name
        return
    fault = refused(tmp_path, table).faults[0]
    assert fault.message == f'"{name}" could be the time, but "{clock}" has times of day that run otherwise'
    assert read(tmp_path, table, columns={"time": name}).sources["time"] == name
    # The same clock twice is no choice.
    same = ((clock, days), (name, cells(0.7 * np.arange(N), 2)), *TESTER[1:])
    assert read(tmp_path, same).sources["time"] == name


def force_of(column: Sequence[str], factor: float = 1.0) -> npt.NDArray[np.floating[Any]]:
    return np.array([float(c) for c in column]) * factor


# ------------------------------------------------------------------------------------------------------- what is not read


def test_every_column_is_read_or_named_with_its_reason(tmp_path: Path) -> None:
    others = {
        "T (°C)": ("23.5", "a temperature"),
        "C (°C)": ("21.0", "a temperature"),
        "Compression (%)": ("1.5", "a share or strain"),
        "Charge (pC)": ("3.1", "an electric charge"),
        "Compressive stress (MPa)": ("0.1", "a stress"),
        "Load (setpoint) (N)": ("5.0", "commanded"),
        "Force (peak hold) (N)": ("7.5", "a statistic"),
        "Operator": ("M", "not understood"),
        "Status": ("Running", "the status of a tester"),
        "Remark": ("", "empty"),
    }
    table = read(tmp_path, [("", ["9"] * N), *TESTER, *((n, [c] * N) for n, (c, _) in others.items())])
    assert set(table.columns) == {"time", "displacement", "force"}
    assert not any(table.reasons)
    said = reasons(table)
    assert len(said) == 1 + len(others)
    for i, (name, (_, why)) in enumerate(others.items()):
        assert why in said[f'column {i + 5} "{name}"'], name
    assert said["column 1"] == "without a name"


def test_a_second_column_of_a_quantity_is_named_beside_the_first(tmp_path: Path) -> None:
    table = read(tmp_path, [*TESTER, ("Load 2 (N)", cells(FORCE / 3))])
    assert any('"Load 2 (N)"' in note and '--columns "force=Load 2 (N)"' in note for note in table.notes)
    assert 'column 4 "Load 2 (N)"' in reasons(table)
    other = read(tmp_path, [*TESTER, ("Load 2 (N)", cells(FORCE / 3))], columns={"force": "Load 2 (N)"})
    np.testing.assert_allclose(other.columns["force"], force_of(cells(FORCE / 3)))
    assert 'column 3 "Load (N)"' in reasons(other)


def test_a_column_that_is_not_understood_but_in_the_unit_of_one_that_is_read_is_noted(tmp_path: Path) -> None:
    table = read(tmp_path, [*TESTER, ("Messdose (N)", cells(FORCE * 1.1))])
    assert any('"Messdose (N)", in N too' in note for note in table.notes)
    still = [TESTER[0], TESTER[1], ("Load (N)", ["5.0"] * N), ("Messdose (N)", F)]
    assert "stands still" in str(refused(tmp_path, still))


@pytest.mark.parametrize("unit", ["mm", "um"])
@pytest.mark.parametrize(
    ("moves", "presses"),
    [
        ("Stage z", "Ball displacement"),
        ("Stroke", "Ball travel"),
        ("Crosshead", "Tip movement"),
        ("Traversenweg", "Kugelweg"),
        ("Stage z", "Blork"),
        ("Displacement", "Probe movement"),
    ],
)
def test_a_column_of_what_presses_beside_one_of_what_moves_it_is_a_choice(
    tmp_path: Path, moves: str, presses: str, unit: str
) -> None:
    ball = cells((DEPTH - 0.012 * FORCE) * (1.0 if unit == "mm" else 1000.0))
    columns = [TESTER[0], (f"{moves} (mm)", cells(40.0 - DEPTH)), (f"{presses} ({unit})", ball), TESTER[2]]
    said = str(refused(tmp_path, columns))
    assert f"displacement={presses} ({unit})" in said
    assert f"displacement={moves} (mm)" in said
    table = read(tmp_path, columns, columns={"displacement": f"{presses} ({unit})"})
    assert table.sources["displacement"] == f"{presses} ({unit})"


@pytest.mark.parametrize(
    ("name", "of_depth"),
    [
        ("Ball travel (mm)", DEPTH),  # the same readings
        ("Ball diameter (mm)", np.full(N, 4.0)),
        ("Ball run-out (mm)", 0.002 * np.sin(np.arange(N) * 1.7)),
        ("Feedback (mm)", 1.1 * DEPTH),  # says nothing of the ball
    ],
)
def test_a_column_of_the_ball_that_does_not_move_otherwise_is_no_choice(tmp_path: Path, name: str, of_depth: Any) -> None:
    table = read(tmp_path, [*TESTER, (name, cells(of_depth))])
    assert table.sources["displacement"] == TESTER[1][0]


@pytest.mark.parametrize("scale", [1.02, 1.035, 1.04, 0.97])
@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("zero", [0.0, 1.0, 240.2, 1e5])
def test_two_columns_of_one_quantity_whose_scales_differ_are_a_choice_wherever_their_zeros_are(
    tmp_path: Path, scale: float, sign: float, zero: float
) -> None:
    depth = ("Indentation (mm)", cells(DEPTH))
    crosshead = ("Crosshead position (mm)", cells(zero + sign * scale * DEPTH))
    said = str(refused(tmp_path, [TESTER[0], crosshead, depth, TESTER[2]]))
    assert "2 columns may be the displacement, and they differ" in said


@pytest.mark.parametrize(("scale", "said"), [(1.0, "differs by its sign"), (1.006, "differs by its sign, and by 0.6 % of")])
def test_a_column_that_mirrors_another_is_told_with_what_else_it_differs_by(tmp_path: Path, scale: float, said: str) -> None:
    crosshead = ("Crosshead position (mm)", cells(240.0 - scale * DEPTH))
    table = read(tmp_path, [TESTER[0], crosshead, ("Indentation (mm)", cells(DEPTH)), TESTER[2]])
    assert any(said in note for note in table.notes)


# ------------------------------------------------------------------------------------------------------------- brackets


@pytest.mark.parametrize(
    ("cell", "why"),
    [
        ("Load (max) (N)", "statistic"),
        ("Force (N) (peak)", "statistic"),
        ("Force (peak hold) (N)", "statistic"),
        ("Extension (mean) (mm)", "statistic"),
        ("Force (N) avg", "statistic"),
        ("Cp (std) (pF)", "statistic"),
        ("Load (setpoint) (N)", "commanded"),
        ("Target force (N)", "commanded"),
        ("Position command (mm)", "commanded"),
        ("Kraft Soll (N)", "commanded"),
        ("Extension (%)", "strain"),
        ("Load (MPa)", "stress"),
        ("Load (V)", "voltage"),
        ("T (°C)", "temperature"),
        ("z (Ohm)", "impedance"),
        ("Force x (N)", "axis x"),
        ("Load x10 (N)", "not understood"),
        ("Load (N", "not understood"),
    ],
)
def test_names_of_no_record_say_why(cell: str, why: str) -> None:
    assert understand(cell) is None
    assert why in why_unread(cell)


@pytest.mark.parametrize(
    "cell",
    [
        *("Load [x10] (N)", "Load (N) [*10^3]", "Load (1e-1) (N)", "Load (kN) (N)", "Load (N) [kgf]", "Load (V) (N)"),
        *("Load (gain 2) (N)", "Load (?) (N)", "Load (abs) (N)", "Load (N) [calc]", "Load offset (N)", "Load (N*10)"),
        *("Load (N) (1:10)", "Load (1 : 10) [N]", "Load [N] (Übersetzung 1:5)", "Load (amp 1:100) (N)", "Load (lever 2:1) (N)"),
    ],
)
def test_a_bracket_that_leaves_the_force_open_is_refused(tmp_path: Path, cell: str) -> None:
    error = refused(tmp_path, [*TESTER[:2], (cell, F)])
    assert (error.faults[0].line, error.faults[0].column) == (1, 3)
    assert "--units force=" in str(error) or "--columns" in str(error)


@pytest.mark.parametrize(
    "cell",
    [
        *(
            "Load (8800 (0,1):Load) (N)",
            "Load (500 N) (N)",
            "Load (load cell) (N)",
            "Load (N) (N)",
            "Load (raw) [N]",
            "Load{N}",
            "Load (N) (1:1)",
            "Load (Dev1:2) (N)",
        ),
        *("Primary load measurement (N)", "Tensile Force (N)", "Force (Fz), N", "C_1_Force[N]", "Force (F) / N", "Load (N, )"),
    ],
)
def test_brackets_and_words_that_change_nothing_are_read(tmp_path: Path, cell: str) -> None:
    sep = ";" if "," in cell else ","
    if cell == "Load (N, )":
        refused(tmp_path, [*TESTER[:2], (cell, F)], sep=sep)
        return
    table = read(tmp_path, [*TESTER[:2], (cell, F)], sep=sep)
    np.testing.assert_allclose(table.columns["force"], force_of(F), rtol=1e-12)


def test_a_factor_is_applied_as_the_user_says(tmp_path: Path) -> None:
    table = read(tmp_path, [*TESTER[:2], ("Load [x10] (N)", F)], units={"force": "10 N"})
    np.testing.assert_allclose(table.columns["force"], force_of(F, 10.0), rtol=1e-12)
    assert any('"x10"' in note for note in table.notes)


@pytest.mark.parametrize(
    ("unit", "factor"), [("10^-3 N", 1e-3), ("1e-3 N", 1e-3), ("x10^3 N", 1e3), ("E-3 N", 1e-3), ("µN", 1e-6)]
)
def test_a_power_of_ten_within_the_unit_is_applied(unit: str, factor: float) -> None:
    assert lab_factor(unit, "force") == pytest.approx(factor, rel=1e-15)


def test_a_plain_number_before_a_unit_is_taken_from_the_user_only() -> None:
    assert asked_factor("0.5 N", "force") == 0.5
    with pytest.raises(ValueError, match="unknown unit"):
        lab_factor("10 N", "force")


def test_a_remark_within_a_units_row_is_no_other_header(tmp_path: Path) -> None:
    columns = [("Time", T), ("Extension", D), ("Load", F)]
    table = read(tmp_path, columns, below=["(s)", "(mm) from touch", "(N) zeroed"])
    np.testing.assert_allclose(table.columns["force"], force_of(F))
    assert unit_cell("(N) peak") is None
    assert unit_cell("(pF) tared") is None


# --------------------------------------------------------------------------------------------------------- which column


@pytest.mark.parametrize("still", ["D (mm)", "d (mm)", "z (mm)", "Position (mm)", "Displacement (mm)"])
def test_a_column_that_stands_still_never_comes_before_one_that_moves(tmp_path: Path, still: str) -> None:
    table = read(tmp_path, [TESTER[0], (still, ["20.0"] * N), ("Weg (mm)", D), TESTER[2]])
    np.testing.assert_allclose(table.columns["displacement"], force_of(D, 1e-3))
    assert "stands still" in reasons(table)[f'column 2 "{still}"']


def test_a_letter_that_stands_still_is_no_displacement_by_itself(tmp_path: Path) -> None:
    assert "a dimension of the sample" in str(refused(tmp_path, [TESTER[0], ("D (mm)", ["20.0"] * N), TESTER[2]]))


@pytest.mark.parametrize("factor", [1.0, -1.0])
def test_columns_that_agree_but_for_zero_and_sign_are_decided_by_their_name(tmp_path: Path, factor: float) -> None:
    position = cells(factor * DEPTH + 33.0)
    table = read(tmp_path, [TESTER[0], ("Position (mm)", position), *TESTER[1:]])
    np.testing.assert_allclose(table.columns["displacement"], force_of(D, 1e-3))
    assert any('"Position (mm)"' in note for note in table.notes)


def test_columns_that_differ_are_a_choice(tmp_path: Path) -> None:
    columns = [TESTER[0], ("Position (mm)", cells(1.2 * DEPTH)), *TESTER[1:]]
    error = refused(tmp_path, columns)
    assert '--columns "displacement=Position (mm)"' in str(error)
    assert error.faults[0].choice is not None
    table = read(tmp_path, columns, columns={"displacement": "Position (mm)"})
    np.testing.assert_allclose(table.columns["displacement"], force_of(cells(1.2 * DEPTH), 1e-3))


@pytest.mark.parametrize("name", ["Fsum (N)", "Σ F (N)", "Resultant (N)"])
def test_a_sum_that_is_not_understood_is_offered_beside_the_cells_that_make_it(tmp_path: Path, name: str) -> None:
    parts = [(f"F{k + 1} (N)", cells(share * FORCE)) for k, share in enumerate((0.3, 0.33, 0.37))]
    columns = [*TESTER[:2], *parts, (name, F)]
    error = refused(tmp_path, columns)
    assert f'--columns "force={name}"' in str(error)
    table = read(tmp_path, columns, columns={"force": name})
    np.testing.assert_allclose(table.columns["force"], force_of(F))
    still = refused(tmp_path, [*TESTER[:2], *parts, (name, ["1.0000"] * N)])
    assert name not in str(still)


def test_two_units_of_one_force_must_agree(tmp_path: Path) -> None:
    pounds = cells(FORCE / 4.4482216152605, 6)
    table = read(tmp_path, [*TESTER, ("Load (lbf)", pounds)])
    np.testing.assert_allclose(table.columns["force"], force_of(F))
    assert "the same readings" in reasons(table)['column 4 "Load (lbf)"']
    assert "they differ" in str(refused(tmp_path, [*TESTER, ("Load (lbf)", F)]))
    units = ["s", "mm", "N", "lbf"]
    table = read(tmp_path, [("Time", T), ("Extension", D), ("Load", F), ("Load", pounds)], below=units)
    np.testing.assert_allclose(table.columns["force"], force_of(F))
    nearly = cells(FORCE + 0.004)
    assert "appears twice" in str(refused(tmp_path, [*TESTER, ("Load (N)", nearly)]))


def test_an_instrument_that_was_not_used_does_not_come_first_without_a_word(tmp_path: Path) -> None:
    noise = cells(0.002 * np.sin(37.0 * np.arange(N)))
    assert "they differ" in str(refused(tmp_path, [*TESTER[:2], ("Load (N)", noise), ("Load 2 (N)", F)]))


def test_two_clocks_are_a_choice(tmp_path: Path) -> None:
    late = cells(2.0 * TIME, 2)
    columns = [*TESTER, ("LCR time (s)", late), ("Cp (pF)", C)]
    assert "may be the time" in str(refused(tmp_path, columns))
    for more in ({}, {"capacitance": "none"}):
        table = read(tmp_path, columns, columns={"time": "Time (s)", **more})
        assert set(table.columns) == {"time", "displacement", "force"}
    table = read(tmp_path, columns, columns={"time": "LCR time (s)"})
    assert set(table.columns) == {"time", "capacitance"}
    last = [*columns[:3], columns[4], columns[3]]
    assert "two clocks" in str(refused(tmp_path, last, columns={"time": "Time (s)"}))


@pytest.mark.parametrize(
    "names", [("C1 (pF)", "C2 (pF)"), ("Cap1", "Cap2"), ("CH0_pF", "CH31_pF"), ("Cp@1kHz (pF)", "Cp@10kHz (pF)")]
)
def test_channels_of_a_capacitance_are_a_choice(tmp_path: Path, names: tuple[str, str]) -> None:
    below = ["s", "pF", "pF"] if names[0] == "Cap1" else ()
    columns = [("Time", T) if below else TESTER[0], (names[0], C), (names[1], cells(CAP + 5))]
    error = refused(tmp_path, columns, below=below)
    assert all(f'"{name}"' in str(error) for name in names)
    table = read(tmp_path, columns, below=below, columns={"capacitance": names[1]})
    np.testing.assert_allclose(table.columns["capacitance"], force_of(cells(CAP + 5), 1e-12))
    assert f'column 2 "{names[0]}"' in reasons(table)


def test_the_loss_of_the_chosen_channel_goes_with_it(tmp_path: Path) -> None:
    loss = [cells(0.01 + 0 * TIME), cells(0.2 + 0 * TIME)]
    columns = [TESTER[0], ("Cs1 (pF)", C), ("D1", loss[0]), ("Cs2 (pF)", C), ("D2", loss[1])]
    table = read(tmp_path, columns, columns={"capacitance_series": "Cs2 (pF)"})
    np.testing.assert_allclose(table.columns["capacitance"], force_of(C, 1e-12) / 1.04)


# --------------------------------------------------------------------------------------------------- series and parallel


@pytest.mark.parametrize(
    "line", ["MODE: SERIES", "Measure: Cs-D", "Equivalent circuit,series", "Ersatzschaltung: Reihe", "Ls/Cs"]
)
def test_a_circuit_named_above_the_header_decides(tmp_path: Path, line: str) -> None:
    columns = [TESTER[0], ("C (pF)", C), ("D", ["0.4"] * N)]
    table = read(tmp_path, columns, above=[line])
    np.testing.assert_allclose(table.columns["capacitance"], force_of(C, 1e-12) / 1.16)
    assert "series or a parallel" in str(refused(tmp_path, [TESTER[0], ("Cp (pF)", C), ("D", ["0.4"] * N)], above=[line]))


def test_a_capacitance_that_does_not_say_is_refused_where_it_matters(tmp_path: Path) -> None:
    columns = [TESTER[0], ("Cap (pF)", C), ("D", cells(0.4 + 0 * TIME))]
    assert "Cp or Cs" in str(refused(tmp_path, columns))
    parallel = read(tmp_path, columns, columns={"capacitance": "Cap (pF)"})
    series = read(tmp_path, columns, columns={"capacitance_series": "Cap (pF)"})
    np.testing.assert_allclose(parallel.columns["capacitance"], 1.16 * series.columns["capacitance"])
    assert read(tmp_path, [TESTER[0], ("Cap (pF)", C), ("D", ["0.01"] * N)]).columns["capacitance"].size == N


@pytest.mark.parametrize(
    ("name", "value", "loss"),
    [
        ("D (%)", "40", 0.4),
        ("D (‰)", "400", 0.4),
        ("D (x1e-3)", "400", 0.4),
        ("D (10^-3)", "400", 0.4),
        ("Q", "2.5", 0.4),
        ("D", "0.4", 0.4),
    ],
)
def test_a_loss_is_read_in_every_notation(tmp_path: Path, name: str, value: str, loss: float) -> None:
    table = read(tmp_path, [TESTER[0], ("Cs (pF)", C), (name, [value] * N)])
    np.testing.assert_allclose(table.columns["dissipation"], loss)
    np.testing.assert_allclose(table.columns["capacitance"], force_of(C, 1e-12) / (1 + loss**2))


def test_a_loss_that_no_capacitor_has_is_refused(tmp_path: Path) -> None:
    columns = [TESTER[0], ("Cs (pF)", C), ("D", ["400"] * N)]
    assert "none of a capacitor" in str(refused(tmp_path, columns))
    table = read(tmp_path, columns, units={"dissipation": "1e-3"})
    np.testing.assert_allclose(table.columns["dissipation"], 0.4)


def test_a_letter_that_may_be_a_place_or_a_loss_is_refused(tmp_path: Path) -> None:
    assert "may be a dissipation or a displacement" in str(refused(tmp_path, [TESTER[0], ("D", D), TESTER[2], METER[1]]))


@pytest.mark.parametrize("name", ["Cp (rel) (pF)", "Cp (offset removed) (pF)", "Delta Cp (pF)", "Cp change (pF)"])
def test_a_change_of_a_capacitance_is_no_capacitance(tmp_path: Path, name: str) -> None:
    assert "is no" in str(refused(tmp_path, [TESTER[0], (name, C)]))


# ---------------------------------------------------------------------------------------------------- rows of several records


def in_turn(values: Sequence[str]) -> list[str]:
    return [values[i % len(values)] for i in range(N)]


@pytest.mark.parametrize(
    ("key", "values"),
    [
        ("Channel", ("1", "2", "3")),
        ("sensor_id", ("a", "b")),
        ("Frequency (Hz)", ("1000", "10000")),
        ("Range", ("100pF", "1nF")),
        ("Level (V)", ("0.5", "1.0")),
        ("", ("1", "2")),
    ],
)
def test_rows_of_several_records_in_turn_are_refused_until_one_is_chosen(
    tmp_path: Path, key: str, values: tuple[str, ...]
) -> None:
    capacitance = cells(CAP + 5.0 * (np.arange(N) % len(values)))
    columns = [("Time (s)", T), (key, in_turn(values)), ("Cp (pF)", capacitance)]
    error = refused(tmp_path, columns)
    assert all(f'"{v}"' in str(error) for v in values)
    choice = error.faults[0].choice
    assert choice is not None
    assert (choice.option, choice.alternatives) == ("where", values)
    table = read(tmp_path, columns, where={choice.key: values[1]})
    asked = np.array([v == values[1] for v in in_turn(values)])
    assert table.lines.tolist() == (2 + np.flatnonzero(asked)).tolist()
    assert not any(table.reasons)
    np.testing.assert_allclose(table.columns["capacitance"], force_of(capacitance, 1e-12)[asked])
    others = [f"{what}: {why}" for what, why in reasons(table).items() if "row(s)" in what]
    assert len(others) == 1
    assert others[0].startswith(f"{N - int(asked.sum())} row(s), in lines 2 to")
    assert "not asked for" in others[0]


def test_specimens_one_below_the_other_are_refused_until_one_is_chosen(tmp_path: Path) -> None:
    half = N // 2
    for time in ([("Time (s)", T[:half] * 2)], []):
        columns = [("ID", ["a"] * half + ["b"] * half), *time, ("Extension (mm)", D[:half] * 2), ("Load (N)", F[:half] * 2)]
        assert "--where ID=a" in str(refused(tmp_path, columns))
        table = read(tmp_path, columns, where={"ID": "b"})
        assert table.lines.tolist() == list(range(half + 2, N + 2))
        assert not any(table.reasons)


def test_a_range_that_changes_over_a_pause_is_a_choice(tmp_path: Path) -> None:
    half = N // 2
    time = cells(np.concatenate((TIME[:half], TIME[half:] + 3600)), 2)
    columns = [("Time (s)", time), *TESTER[1:], ("Range", ["100 pF"] * half + ["1 nF"] * half)]
    assert '--where "Range=1 nF"' in str(refused(tmp_path, columns))
    columns = [TESTER[0], *columns[1:]]
    assert not any(read(tmp_path, columns).reasons)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("Step", ["1"] * 36 + ["2"] * 24),
        ("State", ["LOADING"] * 36 + ["UNLOADING"] * 24),
        ("Humidity", in_turn(("41", "42", "41"))),
        ("Channel", ["3"] * N),
        ("No.", [str(i) for i in range(N)]),
        ("Event", [""] * 30 + ["mark"] + [""] * 29),
    ],
)
def test_columns_that_accompany_one_record_are_no_choice(tmp_path: Path, name: str, values: list[str]) -> None:
    table = read(tmp_path, [*TESTER, (name, values)])
    assert not any(table.reasons)
    assert f'column 4 "{name}"' in reasons(table)


@pytest.mark.parametrize("value", ["1000", "1.0E3", "1000.0", "1000,0"])
@pytest.mark.parametrize("column", ["Frequency (Hz)", "frequency", "2"])
def test_a_value_of_a_column_is_found_in_any_notation(tmp_path: Path, column: str, value: str) -> None:
    for written, sep in (("1000", ","), ("1000,0", ";"), ("1.00E+03", ",")):
        time, cap = ([c.replace(".", ",") for c in x] if sep == ";" else x for x in (T, C))
        columns = [("Time (s)", time), ("Frequency (Hz)", in_turn((written, "9999"))), ("Cp (pF)", cap)]
        table = read(tmp_path, columns, sep=sep, where={column: value})
        assert sum(not r for r in table.reasons) == N // 2


def test_rows_by_a_column_or_value_that_is_not_there_are_refused_with_those_that_are(tmp_path: Path) -> None:
    columns = [("Time (s)", T), ("Channel", in_turn(("1", "2"))), ("Cp (pF)", C)]
    assert '"1", "2"' in str(refused(tmp_path, columns, where={"Channel": "7"}))
    assert '2 "Channel"' in str(refused(tmp_path, columns, where={"Sensor": "1"}))


def test_a_key_with_a_damaged_value_is_a_key(tmp_path: Path) -> None:
    values = [*in_turn(("100 pF", "1 nF"))[:-1], "1 n"]
    columns = [("Time (s)", T), ("Range", values), ("Cp (pF)", cells(CAP + 5.0 * (np.arange(N) % 2)))]
    assert "several records" in str(refused(tmp_path, columns))


def test_a_coarse_measurement_is_no_key(tmp_path: Path) -> None:
    coarse = cells(np.round(0.01 * np.sin(37.0 * np.arange(N)), 2), 2)
    assert not any(read(tmp_path, [*TESTER, ("Corrected_Force (N)", coarse), ("Torque (N·m)", coarse)]).reasons)


def test_a_frequency_that_is_read_back_is_one_frequency(tmp_path: Path) -> None:
    columns = [*METER, ("Frequency (Hz)", cells(1000.0 + 0.1 * np.sin(np.arange(N)), 3))]
    assert not any(read(tmp_path, columns).reasons)


# ------------------------------------------------------------------------------------------------- specimens side by side


def test_specimens_side_by_side_of_which_the_first_is_named_are_a_choice(tmp_path: Path) -> None:
    group = [("Time (min)", cells(TIME / 60, 6)), ("Load (N)", F), ("Displacement (mm)", D)]
    others = [[("", group[0][1]), ("", cells(k * FORCE)), ("", D)] for k in (2, 3)]
    columns = [*group, *others[0], *others[1]]
    with pytest.raises(SeveralSpecimens) as caught:
        read(tmp_path, columns, sep="\t")
    assert caught.value.count == 3
    for k in (1, 2, 3):
        table = read(tmp_path, columns, sep="\t", specimen=k)
        np.testing.assert_allclose(table.columns["force"], force_of(cells(k * FORCE)))
        assert sum("of specimen" in reason for reason in reasons(table).values()) == 6


def test_columns_without_names_that_are_no_specimens_are_refused(tmp_path: Path) -> None:
    columns = [*TESTER, ("", cells(FORCE[::-1])), ("", cells(FORCE)), ("", F), ("", F)]
    assert refused(tmp_path, columns, sep="\t").faults[0].column == 4


# ---------------------------------------------------------------------------------------------------------------- names


@pytest.mark.parametrize(
    "names",
    [
        ("Temps (s)", "Déplacement (mm)", "Force (N)"),
        ("Temps (s)", "Enfoncement (mm)", "Charge (N)"),
        ("Czas (s)", "Przemieszczenie (mm)", "Siła (N)"),
        ("Czas [s]", "Droga [mm]", "Siła standardowa [N]"),
        ("Tempo (s)", "Spostamento (mm)", "Forza (N)"),
        ("Tijd (s)", "Verplaatsing (mm)", "Kracht (N)"),
        ("Tempo (s)", "Deslocamento (mm)", "Força (N)"),
        ("시간 (s)", "변위 (mm)", "하중 (N)"),
        ("Time, s", "Position (z), mm", "Fz, N"),
        ("t / s", "s / mm", "F / N"),
        ("T_1_Time[s]", "C_2_Stroke[mm]", "C_1_Force[N]"),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "native"])
def test_headers_of_many_labs_are_understood(tmp_path: Path, names: tuple[str, str, str], encoding: str) -> None:
    native = {"Czas": "cp1250", "시간": "cp949"}.get(names[0].split(" ")[0], "latin-1")
    path = tmp_path / "lab.csv"
    rows = ["\t".join(names), *("\t".join(row) for row in zip(T, D, F, strict=True))]
    path.write_text("\n".join(rows) + "\n", encoding=encoding if encoding == "utf-8" else native)
    table = read_lab_file(path)
    np.testing.assert_allclose(table.columns["time"], force_of(T))
    np.testing.assert_allclose(table.columns["displacement"], force_of(D, 1e-3))
    np.testing.assert_allclose(table.columns["force"], force_of(F))


def test_a_column_whose_name_is_a_number_is_no_row(tmp_path: Path) -> None:
    table = read(tmp_path, [*TESTER, ("25", F)])
    assert "not understood" in reasons(table)['column 4 "25"']


def test_instruments_of_nanometres_need_the_scale_said(tmp_path: Path) -> None:
    columns = [("Depth (nm)", cells(DEPTH / 2, 5)), ("Load (µN)", cells(FORCE / 20, 5))]
    assert "--scale micro" in str(refused(tmp_path, columns))
    table = read(tmp_path, columns, scale="micro")
    np.testing.assert_allclose(table.columns["force"], force_of(cells(FORCE / 20, 5), 1e-6))


def test_status_words_of_a_tester_make_no_reading_of_a_meter_unusable(tmp_path: Path) -> None:
    table = read(tmp_path, [*METER, ("Status", ["Running"] * (N - 1) + ["Stopped"])])
    assert not any(table.reasons)
    assert "the status of a tester" in reasons(table)['column 3 "Status"']
    bad = read(tmp_path, [*METER, ("Status", ["0"] * (N - 1) + ["2"])])
    assert bad.reasons[-1] == "LCR status 2"


# ------------ a preference by words alone, which the readings do not bear out


@pytest.mark.parametrize(
    ("raw", "other"),
    [
        (0.01 * np.sin(37.0 * np.arange(N)), FORCE),  # one of them was not plugged in
        (1.1 * FORCE, FORCE),
        (FORCE, 0.5 * FORCE + 0.1),
    ],
)
def test_a_raw_force_is_no_preference_over_one_that_is_no_other_form_of_it(
    tmp_path: Path, raw: npt.NDArray[np.floating[Any]], other: npt.NDArray[np.floating[Any]]
) -> None:
    table = (("Time (s)", T), ("Extension (mm)", D), ("Raw_Force(N)", cells(raw)), ("Kraft (N)", cells(other)))
    error = refused(tmp_path, table)
    assert '"Raw_Force(N)", "Kraft (N)"' in error.faults[0].message
    assert '--columns "force=Kraft (N)"' in error.faults[0].advice
    np.testing.assert_allclose(read(tmp_path, table, columns={"force": "Kraft (N)"}).columns["force"], other, atol=1e-4)


def test_a_raw_force_is_preferred_to_one_with_another_zero_and_less_noise(tmp_path: Path) -> None:
    noisy = FORCE + 0.01 * np.sin(23.0 * np.arange(N))
    table = read(tmp_path, (*TESTER[:2], ("Kraft (N)", cells(FORCE - 0.4)), ("Raw Force (N)", cells(noisy))))
    np.testing.assert_allclose(table.columns["force"], noisy, atol=1e-4)
    assert any('"Raw Force (N)", not from "Kraft (N)"' in note for note in table.notes)


def test_two_capacitances_that_differ_by_their_level_are_a_choice(tmp_path: Path) -> None:
    error = refused(tmp_path, (("Time (s)", T), ("Cp (pF)", C), ("Kapazität (pF)", cells(CAP - 12.0))))
    assert "2 columns may be the capacitance" in error.faults[0].message


def test_a_capacitance_below_zero_is_none(tmp_path: Path) -> None:
    error = refused(tmp_path, (("Time (s)", T), ("Cp (pF)", cells(0.1 - CAP))))
    assert "is negative" in error.faults[0].message
    assert error.faults[0].line == 2


@pytest.mark.parametrize(
    ("still", "moving"),
    [("Load (N)", "Load (max) (N)"), ("Load (N)", "Load (kPa)"), ("Load 2 (N)", "Load (°C)"), ("F (N)", "Force (mm)")],
)
def test_a_column_that_bears_the_name_is_a_rival_whatever_its_unit(tmp_path: Path, still: str, moving: str) -> None:
    first = ["6.4100"] * N if still == "Load (N)" else F
    error = refused(tmp_path, (*TESTER[:2], (still, first), (moving, F)))
    assert (
        f'"{still}" could be the force, but "{moving}", which bears the plain name, cannot be read' in error.faults[0].message
    )
    assert f'--columns "force={still}"' in error.faults[0].advice
    table = read(tmp_path, (*TESTER[:2], (still, first), (moving, F)), columns={"force": still})
    np.testing.assert_allclose(table.columns["force"], force_of(first))


@pytest.mark.parametrize(
    ("column", "beside"), [("d (mm)", "Compression (%)"), ("F (N)", "Charge (pC)"), ("Load (N)", "Force (V)")]
)
def test_a_strain_a_charge_or_a_voltage_is_no_rival(tmp_path: Path, column: str, beside: str) -> None:
    table = tuple((column if n[0] == {"d": "E"}.get(column[0], "L") else n, c) for n, c in TESTER)
    found = read(tmp_path, (*table, (beside, F)))
    assert {"time", "displacement", "force"} <= set(found.columns)
    assert any(beside in what for what in reasons(found))


# ---------------------------------------------------------------------------------------- units that a line above contradicts


@pytest.mark.parametrize("sep", [",", ";", "\t", "|", " "])
@pytest.mark.parametrize(
    "line", ["Units : Load{sep}kN", "Units : Load kN", "Load{sep}kN", "Unit of Load: kN", "Units Time s Load kN", "Load in kN"]
)
def test_a_unit_contradicted_above_is_refused_whatever_parts_the_cells(tmp_path: Path, sep: str, line: str) -> None:
    if sep == " " and line == "Load{sep}kN":
        return  # two words between blanks are a title
    names = ("Time_(s)", "Extension_(mm)", "Load_(N)") if sep == " " else tuple(n for n, _ in TESTER)
    table = tuple((name, c) for name, (_, c) in zip(names, TESTER, strict=True))
    error = refused(tmp_path, table, above=(line.format(sep=sep),), sep=sep)
    assert any('"kN" is declared in line 1' in fault.message for fault in error.faults)
    assert "--units force=" in error.faults[0].advice
    said = read(tmp_path, table, above=(line.format(sep=sep),), sep=sep, units={"force": "N"})
    np.testing.assert_allclose(said.columns["force"], force_of(F))


def test_two_lines_above_that_contradict_each_other_are_refused(tmp_path: Path) -> None:
    table = (*TESTER[:2], ("Load", F))
    error = refused(tmp_path, table, above=("Load;kN", "Units : Load,N"))
    assert 'unknown unit "kN or N"' in error.faults[0].message
    np.testing.assert_allclose(read(tmp_path, table, above=("Load;kN",)).columns["force"], force_of(F, 1e3))


def test_a_series_capacitance_has_its_unit_contradicted_above_too(tmp_path: Path) -> None:
    error = refused(tmp_path, (("Time (s)", T), ("Cs (pF)", C), ("D", ["0.002"] * N)), above=("Units : Cs,nF",))
    assert '"nF" is declared in line 1' in error.faults[0].message


@pytest.mark.parametrize("line", ["Grip distance;50;mm", "Speed;1;mm/min", "Load cell 5;kN", "Unit system: SI", "Comment;N"])
def test_a_line_above_that_declares_no_unit_of_a_reading_is_none(tmp_path: Path, line: str) -> None:
    np.testing.assert_allclose(read(tmp_path, TESTER, above=(line,)).columns["force"], force_of(F))


def test_rows_of_two_settings_in_turn_are_a_choice_whatever_the_setting_is_called(tmp_path: Path) -> None:
    n = np.arange(120)
    capacitance = 52.3 + 7.0 * np.clip(n / 119 - 0.3, 0.0, None) ** 1.5
    keys: Columns = (("Time (s)", cells(0.03 * n)), ("Bias", ["off", "on"] * 60))
    table = (*keys, ("Cp (pF)", cells(capacitance * np.where(n % 2, 0.99, 1.0))))
    error = refused(tmp_path, table)
    assert 'column "Bias" changes' in str(error)
    assert "--where Bias=off" in str(error)
    one = read(tmp_path, table, where={"Bias": "off"})
    np.testing.assert_allclose(one.columns["capacitance"], capacitance[::2] * 1e-12, rtol=1e-4)
    read(tmp_path, (*keys, ("Cp (pF)", cells(capacitance))))


def test_days_beside_times_of_day_that_are_asked_for_are_named_as_theirs(tmp_path: Path) -> None:
    n = np.arange(40)
    table = (
        ("Date", ["2026-03-03"] * 20 + ["2026-03-04"] * 20),
        ("Clock", [f"14:{k // 2:02d}:{k % 2 * 30:02d}" for k in n]),
        ("Force (N)", cells(0.1 * n)),
        ("Disp (mm)", cells(0.02 * n)),
    )
    found = read(tmp_path, table, columns={"time": "Clock"})
    assert reasons(found)['column 1 "Date"'] == 'the days of "Clock", whose times are read with them'
    assert np.ptp(found.columns["time"]) > 86_400


@pytest.mark.parametrize(
    ("table", "factor"),
    [
        ([("Time (s)", T), ("Extension", D), ("Unit", ["mm"] * N), ("Load", F), ("Unit", ["N"] * N)], 1.0),
        ([("Time", T), ("s", ["s"] * N), ("Extension", D), ("mm", ["mm"] * N), ("Load", F), ("mN", ["mN"] * N)], 1e-3),
        ([("Time (s)", T), ("Extension (mm)", D), ("Load", F), ("Batch", ["7b"] * N), ("Load unit", ["kN"] * N)], 1e3),
        ([("unit_load", ["mN"] * N), ("Time (s)", T), ("Extension (mm)", D), ("Load", F)], 1e-3),
        ([("Zeit (s)", T), ("Weg (mm)", D), ("Kraft", F), ("Einheit", ["N"] * N)], 1.0),
        ([("Time (s)", T), ("Extension (mm)", D), ("Load (N)", F), ("Unit", ["N"] * N)], 1.0),
    ],
)
def test_units_that_stand_in_a_column_of_their_own_are_those_of_the_column_beside_or_named(
    tmp_path: Path, table: Columns, factor: float
) -> None:
    found = read(tmp_path, table, sep=";")
    np.testing.assert_allclose(found.columns["force"], factor * np.array(F, dtype=float), rtol=1e-12)
    np.testing.assert_allclose(found.columns["displacement"], 1e-3 * np.array(D, dtype=float), rtol=1e-12)
    assert any("says so in every row" in note for note in found.notes)


@pytest.mark.parametrize(
    ("name", "units", "load"),
    [
        ("Unit", ["N"] * 30 + ["mN"] * 30, "Load"),  # two units
        ("Unit", ["N"] * 59 + [""], "Load"),  # a row without one
        ("Unit", ["mm"] * N, "Load"),  # of another quantity
        ("Unit", ["V"] * N, "Load"),
        ("Code", ["N"] * N, "Load"),  # a letter
        ("Unit", ["mN"] * N, "Load (N)"),  # against the name
    ],
)
def test_a_column_that_states_no_one_unit_or_not_that_of_the_column_beside_it_gives_none(
    tmp_path: Path, name: str, units: Sequence[str], load: str
) -> None:
    refused(tmp_path, [("Time (s)", T), ("Extension (mm)", D), (load, F), (name, units)])


@pytest.mark.parametrize("names", [("force_N", "disp_mm"), ("Load", "Extension"), ("Kraft", "Weg")])
@pytest.mark.parametrize("more", [[], [("unit", ["N", "mm"] * N)]])
def test_a_table_with_one_reading_a_row_is_refused_with_what_makes_a_press_of_it(
    tmp_path: Path, names: tuple[str, str], more: Columns
) -> None:
    values = [cell for pair in zip(F, D, strict=True) for cell in pair]
    table = [("time_s", [t for t in T for _ in names]), ("channel", names * N), ("value", values), *more]
    (fault,) = refused(tmp_path, table).faults
    assert f'column "channel" says of which quantity, "{names[0]}", "{names[1]}"' in fault.message
    assert "pivot" in fault.advice
    wide = [("time_s", T), ("force_N", values[::2]), ("disp_mm", values[1::2])]
    np.testing.assert_allclose(read(tmp_path, wide).columns["force"], np.array(F, dtype=float))


@pytest.mark.parametrize("letter", ["d", "D"])
def test_letters_of_a_press_without_units_ask_for_units_alone(tmp_path: Path, letter: str) -> None:
    table = [("t", T), (letter, D), ("F", F)]
    error = refused(tmp_path, table)
    assert [fault.message for fault in error.faults if "has no unit" not in fault.message] == []
    read_so = read(tmp_path, table, units={"time": "s", "displacement": "mm", "force": "N"})
    np.testing.assert_allclose(read_so.columns["force"], force_of(F, 1.0))
    assert "displacement" in read_so.columns
    assert any('force is taken from "F"' in note for note in read_so.notes)


def test_a_letter_f_of_a_capacitance_is_one_and_of_more_a_force(tmp_path: Path) -> None:
    farads = [f"{float(c) * 1e-12:.6g}" for c in C]
    table = read(tmp_path, [("Time (s)", T), ("Extension (mm)", D), ("F", farads)])
    np.testing.assert_allclose(table.columns["capacitance"], [float(c) for c in farads])
    error = refused(tmp_path, [("Time (s)", T), ("Extension (mm)", D), ("F", F)])
    assert "--units force=" in error.faults[0].advice
    beside = read(tmp_path, [("Time (s)", T), ("Extension (mm)", D), ("Load (N)", F), ("d", D)])
    assert "displacement" in beside.columns
    assert beside.sources["displacement"] == "Extension (mm)"


@pytest.mark.parametrize(
    ("raw", "corrected"),
    [("C_meas", "C_corr"), ("C_raw", "C_net"), ("C", "C_comp"), ("Cp", "Cp corrected"), ("Capacitance", "Capacitance korr.")],
)
def test_a_capacitance_that_is_corrected_beside_the_raw_one_is_a_choice(tmp_path: Path, raw: str, corrected: str) -> None:
    table = [("Time (s)", T), (f"{raw} (pF)", cells(CAP + 31.4)), ("C_stray (pF)", ["31.40"] * N), (f"{corrected} (pF)", C)]
    fault = refused(tmp_path, table).faults[0]
    assert fault.choice is not None
    assert fault.choice.alternatives == (f"{raw} (pF)", f"{corrected} (pF)")
    read_back = read(tmp_path, table, columns={"capacitance": f"{corrected} (pF)"})
    assert read_back.sources["capacitance"] == f"{corrected} (pF)"


@pytest.mark.parametrize(
    ("quantity", "raw", "corrected"),
    [
        ("force", "F_meas (N)", "F_corr (N)"),
        ("force", "Force (N)", "Force corrected (N)"),
        ("displacement", "Extension (mm)", "Corrected extension (mm)"),
        ("displacement", "z_meas (mm)", "z_comp (mm)"),
    ],
)
def test_a_press_that_is_corrected_beside_the_raw_one_is_a_choice_unless_by_its_zero_alone(
    tmp_path: Path, quantity: str, raw: str, corrected: str
) -> None:
    own, beside = (F, ("Extension (mm)", D)) if quantity == "force" else (D, ("Force (N)", F))
    by_load = cells(0.9 * FORCE if quantity == "force" else DEPTH - 0.03 * FORCE)
    fault = refused(tmp_path, [("Time (s)", T), (raw, own), (corrected, by_load), beside]).faults[0]
    assert fault.choice is not None
    assert fault.choice.alternatives == (raw, corrected)
    by_zero = cells((FORCE if quantity == "force" else DEPTH) + 0.1)
    table = read(tmp_path, [("Time (s)", T), (raw, own), (corrected, by_zero), beside])
    assert table.sources[quantity] == raw
    assert any(f'not from "{corrected}"' in note for note in table.notes)


def test_a_filtered_capacitance_beside_the_raw_one_is_no_choice(tmp_path: Path) -> None:
    table = read(tmp_path, [("Time (s)", T), ("C (pF)", C), ("C_filtered (pF)", cells(CAP + 0.05 * np.sin(50 * TIME)))])
    assert table.sources["capacitance"] == "C (pF)"


@pytest.mark.parametrize("names", [("Load A (N)", "Load B (N)", "Load A+B (N)"), ("F1 (N)", "F2 (N)", "Fsum (N)")])
def test_of_cells_that_share_the_load_equally_the_sum_is_asked_about(tmp_path: Path, names: tuple[str, str, str]) -> None:
    half = 0.5 * FORCE
    columns = [*TESTER[:2], (names[0], cells(half + 0.002)), (names[1], cells(half - 0.002)), (names[2], F)]
    error = refused(tmp_path, columns)
    assert f'"{names[2]}" is the sum of' in str(error)
    table = read(tmp_path, columns, columns={"force": names[2]})
    np.testing.assert_allclose(table.columns["force"], force_of(F))


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("Stiffness (N/mm)", "a stiffness: not used"),
        ("Slope (N/mm)", "a stiffness: not used"),
        ("Federrate (N/mm)", "a stiffness: not used"),
        ("Spring rate (kN/m)", "a stiffness: not used"),
        ("Strain rate (1/s)", "a rate: not used"),
        ("Stress (N/mm²)", "a stress or pressure: not used"),
        ("ln F", '"ln" makes it a function of a reading: not used'),
        ("log10(F)", '"log10" makes it a function of a reading: not used'),
        ("F^2", '"^2" makes it a function of a reading: not used'),
    ],
)
def test_the_reason_why_a_column_is_not_read_is_true(name: str, reason: str) -> None:
    assert why_unread(name) == reason

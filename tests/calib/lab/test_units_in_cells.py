"""Units in cells and in columns of their own, words behind numbers, and names that are no quantity by their unit."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 60
DEPTH = [round(0.0113 * min(i, 40), 4) for i in range(N)]
FORCE = [round(0.5 * x**1.5 + 0.0001 * (i * 7 % 5), 4) for i, x in enumerate(DEPTH)]
CAP = [round(97.3 + 2 * x * x + 0.0003 * (i * 3 % 7), 4) for i, x in enumerate(DEPTH)]
LOSS = [f"0.00{200 + i * 11 % 9}" for i in range(N)]
TIMES = [f"{0.1 * i:.1f}" for i in range(N)]


def read(folder: Path, head: str, row: str, mark: str = ",", reading: Reading | None = None) -> LabTable:
    """A file whose rows are written as a pattern of t, x, F, C, D says."""
    data = zip(TIMES, DEPTH, FORCE, CAP, LOSS, strict=True)
    rows = [row.format(t=t, x=x, F=f, C=c, D=d).replace(",", mark) for t, x, f, c, d in data]
    path = folder / "lab.txt"
    path.write_text("\n".join([*([head.replace(",", mark)] if head else []), *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


def agree(table: LabTable, *quantities: str) -> None:
    truth = {"time": (list(map(float, TIMES)), 1.0), "displacement": (DEPTH, 1e-3), "force": (FORCE, 1.0)}
    truth |= {"capacitance": (CAP, 1e-12), "dissipation": (list(map(float, LOSS)), 1.0)}
    for quantity in quantities:
        values, factor = truth[quantity]
        good = np.isfinite(table.columns[quantity])
        assert np.count_nonzero(good) > N - 5
        np.testing.assert_allclose(table.columns[quantity][good], factor * np.array(values)[good], rtol=1e-9)


LOG = ("time", "capacitance", "dissipation")
PRESS = ("time", "displacement", "force")


@pytest.mark.parametrize(
    ("head", "row", "quantities"),
    [
        ("t,C,D", "{t} s,{C} pF,{D}", LOG),
        ("t,C,D", "{t}s,{C}pF,{D}", LOG),
        ("Time,Cp,D", "{t} s,{C} pF,{D}", LOG),
        ("t,C,T", "{t} s,{C} pF,{D} T", LOG[:2]),
        ("t,x,F", "{t} s,{x} mm,{F} N", PRESS),
        ("Time (s),Cp (pF),D", "{t},{C} pF ok,{D}", LOG),
        ("Time (s),Cp (pF),D", "{t},{C} ok,{D}", LOG),
    ],
)
@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_a_unit_in_each_cell_is_read_beside_columns_without_one(
    tmp_path: Path, head: str, row: str, quantities: tuple[str, ...], mark: str
) -> None:
    agree(read(tmp_path, head, row, mark), *quantities)


@pytest.mark.parametrize(
    ("row", "columns"),
    [
        ("{t} s,{x} mm,{F} N", {"time": "1", "displacement": "2", "force": "3"}),
        ("{t} s,{C} pF,{D}", {"time": "1", "capacitance": "2"}),
    ],
)
def test_cells_with_units_below_no_header_are_asked_for_by_one_command_that_works(
    tmp_path: Path, row: str, columns: dict[str, str]
) -> None:
    with pytest.raises(InputError, match="numbers with their units") as caught:
        read(tmp_path, "", row, "\t")
    assert " ".join(f"--columns {quantity}={k}" for quantity, k in columns.items()) in str(caught.value)
    agree(read(tmp_path, "", row, "\t", Reading(columns=columns)), *columns)


@pytest.mark.parametrize("word", ["C", "cts", "V"])
def test_a_word_that_is_no_unit_of_the_column_is_passed_by_where_its_unit_is_said(tmp_path: Path, word: str) -> None:
    with pytest.raises(InputError, match=f'has "{word}" behind the number'):
        read(tmp_path, "t,Cp,D", "{t} s,{C} " + word + ",{D}")
    table = read(tmp_path, "t,Cp,D", "{t} s,{C} " + word + ",{D}", reading=Reading(units={"capacitance": "pF"}))
    agree(table, *LOG)
    assert any(f'"{word}" behind its numbers is passed by' in note for note in table.notes)


def test_a_unit_in_all_cells_is_not_passed_by_for_another_that_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        read(tmp_path, "t,Cp,D", "{t} s,{C} nF,{D}", reading=Reading(units={"capacitance": "pF"}))


@pytest.mark.parametrize(
    ("head", "row"),
    [
        ("Time,Unit,Force,Unit,Displacement,Unit", "{t},s,{F},N,{x},mm"),
        ("Time,TimeUnit,Force,ForceUnit,Displacement,DisplacementUnit", "{t},s,{F},N,{x},mm"),
        ("Time,Force,Displacement,Unit,Unit,Unit", "{t},{F},{x},s,N,mm"),
        ("Zeit,Einheit,Kraft,Krafteinheit,Weg,Einheit", "{t},[s],{F},[N],{x},[mm]"),
    ],
)
def test_columns_of_units_give_these_with_a_note(tmp_path: Path, head: str, row: str) -> None:
    table = read(tmp_path, head, row)
    agree(table, *PRESS)
    assert sum("says so in every row" in note for note in table.notes) == 3


def test_a_column_of_units_against_the_header_is_settled_by_a_unit_that_is_said(tmp_path: Path) -> None:
    head, row = "Time (s),Displacement (mm),Force (N),Unit", "{t},{x},{F},mN"
    with pytest.raises(InputError, match="or say: --units force="):
        read(tmp_path, head, row)
    agree(read(tmp_path, head, row, reading=Reading(units={"force": "N"})), *PRESS)


def test_a_d_before_a_force_is_no_dissipation_and_no_force_unless_asked(tmp_path: Path) -> None:
    head, row = "Time (s),Displacement (mm),dF (N),C (pF)", "{t},{x},{F},{C}"
    table = read(tmp_path, head, row)
    assert {"dissipation", "force"}.isdisjoint(table.columns)
    assert any("change of a force" in unread.reason for unread in table.unread)
    assert any('--columns "force=dF (N)"' in note for note in table.notes)
    agree(read(tmp_path, head, row, reading=Reading(columns={"force": "dF (N)"})), *PRESS, "capacitance")


def test_a_frequency_that_follows_the_press_is_named_as_not_read(tmp_path: Path) -> None:
    rows = [f"{t},{x},{f},{1e7 / math.sqrt(c):.1f}" for t, x, f, c in zip(TIMES, DEPTH, FORCE, CAP, strict=True)]
    path = tmp_path / "fdc.csv"
    for name, said in (("ch0_freq_Hz", "as of a circuit that a sensor is in"), ("Resonance frequency (Hz)", "resonance")):
        path.write_text("\n".join([f"Time (s),Displacement (mm),Force (N),{name}", *rows]) + "\n", encoding="utf-8")
        table = read_lab_file(path)
        assert "frequency" not in table.columns
        assert any(said in unread.reason for unread in table.unread)
    set_to = [
        f"{t},{x},{f},{1e5 + 0.01 * (i % 3):.2f},{97 + x}" for i, (t, x, f) in enumerate(zip(TIMES, DEPTH, FORCE, strict=True))
    ]
    path.write_text(
        "\n".join(["Time (s),Displacement (mm),Force (N),Frequency (Hz),Cp (pF)", *set_to]) + "\n", encoding="utf-8"
    )
    assert "frequency" in read_lab_file(path).columns


def test_a_capacitance_with_a_number_taken_off_may_be_left_out(tmp_path: Path) -> None:
    head, row = "Time (s),Displacement (mm),Force (N),C - 97 pF", "{t},{x},{F},{C}"
    with pytest.raises(InputError, match="--columns capacitance=none"):
        read(tmp_path, head, row)
    agree(read(tmp_path, head, row, reading=Reading(columns={"capacitance": "none"})), *PRESS)


def test_a_table_of_intervals_as_rheometers_export_it_is_read(tmp_path: Path) -> None:
    head = ["Interval and data points:\t1\t60", "Interval data:\tPoint No.\tTime\tGap\tNormal Force", "\t\t[s]\t[mm]\t[N]"]
    rows = [f"\t{i + 1}\t{t}\t{x}\t{f}" for i, (t, x, f) in enumerate(zip(TIMES, DEPTH, FORCE, strict=True))]
    (path := tmp_path / "interval.txt").write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")
    agree(read_lab_file(path), *PRESS)


def test_a_prefix_alone_behind_numbers_is_read_where_there_is_but_one_unit(tmp_path: Path) -> None:
    """Engineers write 97.0012p; of a capacitance that is of farads, of a loss of nothing."""
    for head in ("t (s),Cp,D", "t (s),Cap,D", "t (s),Cp (F),D", "t (s),C,D"):
        table = read(tmp_path, head, "{t},{C}p,{D}")
        agree(table, "time", "capacitance", "dissipation")
        assert any("read in the unit that stands behind it (p)" in note for note in table.notes)
    data = zip(TIMES, CAP, LOSS, strict=True)
    rows = [f"{t},{c / 1000:.7f}n,{1000 * float(d):.3f}m" for t, c, d in data]
    path = tmp_path / "lab.txt"
    path.write_text("\n".join(["t (s),Cp,D", *rows]) + "\n", encoding="utf-8")
    agree(read_lab_file(path), *LOG)


@pytest.mark.parametrize("unit", ["mN", "N"])
def test_a_prefix_alone_behind_a_force_is_asked_for_its_unit(tmp_path: Path, unit: str) -> None:
    rows = [f"{t},{x},{1000 * f:.1f}m" for t, x, f in zip(TIMES, DEPTH, FORCE, strict=True)]
    path = tmp_path / "lab.txt"
    path.write_text("\n".join(["t (s),Depth (mm),Force", *rows]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="no unit of force") as caught:
        read_lab_file(path)
    assert any("Say in which unit the numbers are: --units force=" in fault.advice for fault in caught.value.faults)
    agree(read_lab_file(path, Reading(units={"force": unit})), *PRESS)


def test_an_m_behind_a_displacement_in_metres_is_asked_about(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="may be metres, or thousandths of one"):
        read(tmp_path, "t (s),Depth (m),Force (N)", "{t},{x}m,{F}")
    agree(read(tmp_path, "t (s),Depth (m),Force (N)", "{t},{x}m,{F}", reading=Reading(units={"displacement": "mm"})), *PRESS)
    table = read(tmp_path, "t (s),Depth (m),Force (N)", "{t},{x}m,{F}", reading=Reading(units={"displacement": "m"}))
    np.testing.assert_allclose(table.columns["displacement"], DEPTH)


# --------------------------------------------------------------------------------------- a meter that changes its range

LAST = ",".join(("Time (s)", "Displacement (mm)", "Force (N)", "Cp"))


def of_cells(folder: Path, head: str, cells: list[str], reading: Reading | None = None, mark: str = ".") -> LabTable:
    """A press with a last column of such cells."""
    rows = [f"{t};{x};{f};{cell}" for t, x, f, cell in zip(TIMES, DEPTH, FORCE, cells, strict=True)]
    path = folder / "lab.txt"
    path.write_text("\n".join([head.replace(",", ";"), *(row.replace(".", mark) for row in rows)]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


def in_units(values: list[float], usual: str, other: str, factor: float, *rows: int) -> list[str]:
    return [f"{v * factor:.7f} {other}" if r in rows else f"{v:.4f} {usual}" for r, v in enumerate(values)]


@pytest.mark.parametrize("rows", [(30,), (0, 31), (30, 31, 59)])
@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("head", [LAST, f"{LAST} (pF)"])
def test_few_cells_in_another_unit_are_read_in_it_with_a_note(
    tmp_path: Path, rows: tuple[int, ...], mark: str, head: str
) -> None:
    table = of_cells(tmp_path, head, in_units(CAP, "pF", "nF", 1e-3, *rows), mark=mark)
    agree(table, *PRESS, "capacitance")
    assert any("read in the unit that stands behind it (nF, pF)" in note for note in table.notes)


@pytest.mark.parametrize(
    ("head", "row"),
    [
        ("t (s),Force (N),Displacement", "{t};{f};{x:.4f} mm"),
        ("t (s),Displacement (mm),Force", "{t};{x};{f:.4f} N"),
        ("Displacement (mm),Force (N),Time", "{x};{f};{t} s"),
    ],
)
def test_so_is_a_single_cell_of_a_place_a_force_and_a_time(tmp_path: Path, head: str, row: str) -> None:
    data = zip(map(float, TIMES), DEPTH, FORCE, strict=True)
    rows = [row.format(t=round(t, 4), x=x, f=f) for t, x, f in data]
    first, last = rows[40].rsplit(";", 1)
    number, unit = last.split(" ")
    smaller = {"mm": "µm", "N": "mN", "s": "ms"}[unit]
    rows[40] = f"{first};{1000 * float(number):.4f} {smaller}"
    path = tmp_path / "lab.txt"
    path.write_text("\n".join([head.replace(",", ";"), *rows]) + "\n", encoding="utf-8")
    agree(read_lab_file(path), *PRESS)


def test_a_prefix_and_an_exponent_may_differ_in_few_cells(tmp_path: Path) -> None:
    agree(of_cells(tmp_path, LAST, [f"{c / 1000:.7f}n" if r == 9 else f"{c}p" for r, c in enumerate(CAP)]), "capacitance")
    agree(of_cells(tmp_path, LAST, [f"{c / 1000:.7e} nF" if r == 9 else f"{c} pF" for r, c in enumerate(CAP)]), "capacitance")


def test_a_cell_without_a_unit_among_others_is_asked_for_by_itself(tmp_path: Path) -> None:
    cells = [f"{c}" if r == 30 else f"{c} pF" for r, c in enumerate(CAP)]
    with pytest.raises(InputError, match=r"has no unit behind it.*--units capacitance=pF") as caught:
        of_cells(tmp_path, LAST, cells)
    assert [fault.line for fault in caught.value.faults] == [32]
    agree(of_cells(tmp_path, LAST, cells, Reading(units={"capacitance": "pF"})), "capacitance")
    agree(of_cells(tmp_path, LAST, [*cells[:30], "", *cells[31:]]), "capacitance")


@pytest.mark.parametrize("odd", ["97.5 V", "lost", "97.5 kPa"])
def test_an_odd_cell_among_others_with_units_is_refused_by_itself(tmp_path: Path, odd: str) -> None:
    cells = [odd if r == 30 else f"{c} pF" for r, c in enumerate(CAP)]
    with pytest.raises(InputError, match="is not a number") as caught:
        of_cells(tmp_path, LAST, cells)
    assert [fault.line for fault in caught.value.faults] == [32]
    agree(of_cells(tmp_path, LAST, [*cells[:30], "", *cells[31:]]), "capacitance")


def test_a_cell_in_a_unit_of_another_system_is_refused_by_itself(tmp_path: Path) -> None:
    cells = in_units(FORCE, "N", "gf", 1 / 9.80665e-3, 30)
    rows = [f"{t};{x};{cell}" for t, x, cell in zip(TIMES, DEPTH, cells, strict=True)]
    path = tmp_path / "lab.txt"
    path.write_text("\n".join(["t (s);Displacement (mm);Force", *rows]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="is in gf, and other cells are in N") as caught:
        read_lab_file(path)
    assert [fault.line for fault in caught.value.faults] == [32]


def test_cells_in_another_unit_than_the_header_are_asked_about_once(tmp_path: Path) -> None:
    cells = [f"{c} pF" for c in CAP]
    for head, reading in ((f"{LAST} (nF)", Reading()), (LAST, Reading(units={"capacitance": "nF"}))):
        with pytest.raises(InputError, match="--units capacitance=pF") as caught:
            of_cells(tmp_path, head, cells, reading)
        assert len(caught.value.faults) == 1
        agree(of_cells(tmp_path, head, cells, Reading(units={"capacitance": "pF"})), "capacitance")

"""What a refusal advises leads on, and says no unit that the file does not; layouts that none did lead out of are read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hostile_press import lines_of, press

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

P = press(120, seed=5)
HEADER = "Time (s),Displacement (mm),Force (N)"
ROWS = lines_of(HEADER.split(","), (P.t, P.d, P.f))[0][1:]
WIDER = lines_of([*HEADER.split(","), "Cp (pF)"], (P.t, P.d, P.f, P.c))[0][1:]


def _read(folder: Path, lines: list[str], reading: Reading | None = None, encoding: str = "utf-8") -> LabTable:
    path = folder / "press.csv"
    path.write_bytes(("\n".join(lines) + "\n").encode(encoding))
    return read_lab_file(path, reading or Reading())


def _advice(folder: Path, lines: list[str], reading: Reading | None = None) -> str:
    with pytest.raises(InputError) as caught:
        _read(folder, lines, reading)
    return str(caught.value)


def _is_press(table: LabTable) -> None:
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * np.array(P.d, float))
    np.testing.assert_allclose(table.columns["force"], np.array(P.f, float))


# ------------------------------------------------------------------------------------------------------------ units in advice


@pytest.mark.parametrize("header", ["foo [s],qux [xm],quux [xN]", "foo,qux,quux"])
def test_columns_that_are_not_understood_are_asked_for_without_a_unit_that_the_file_does_not_say(
    tmp_path: Path, header: str
) -> None:
    said = _advice(tmp_path, [header, *ROWS])
    assert "=mm" not in said
    assert "=N " not in said


@pytest.mark.parametrize(("written", "meant"), [("?m", "um"), ("\ufffdm", "um")])
def test_a_unit_that_is_said_of_a_column_whose_own_is_damaged_is_noted_with_it(
    tmp_path: Path, written: str, meant: str
) -> None:
    lines = [f"Time (s),qux [{written}],Force (N)", *ROWS]
    columns = {"displacement": "2"}
    table = _read(tmp_path, lines, Reading(columns=columns, units={"displacement": "mm"}))
    assert any(f"though the file says {written}" in note for note in table.notes)
    table = _read(tmp_path, lines, Reading(columns=columns, units={"displacement": meant}))
    assert not any("though the file says" in note for note in table.notes)


@pytest.mark.parametrize(
    ("header", "encoding"),
    [
        ("Prüfzeit [s];Verschiebung [µm];Prüfkraft [mN]", "cp850"),
        ("Время, с;Перемещение, мкм;Усилие, мН", "koi8-r"),
        ("Время, с;Перемещение, мкм;Усилие, мН", "cp866"),
        ("時間(s);変位(um);荷重(mN)", "euc_jp"),
        ("Prüfzeit [s];Verschiebung [µm];Prüfkraft [mN]", "latin-1"),
        ("Время, с;Перемещение, мкм;Усилие, мН", "cp1251"),
        ("時間(s);変位(um);荷重(mN)", "shift_jis"),
    ],
)
def test_names_and_units_in_encodings_of_old_programs_are_read(tmp_path: Path, header: str, encoding: str) -> None:
    table = _read(tmp_path, [header, *(row.replace(",", ";") for row in ROWS)], encoding=encoding)
    np.testing.assert_allclose(table.columns["displacement"], 1e-6 * np.array(P.d, float))
    np.testing.assert_allclose(table.columns["force"], 1e-3 * np.array(P.f, float))


# ----------------------------------------------------------------------------------------------------------- names and columns


def test_rows_with_a_cell_more_than_the_header_are_one_fault_whose_advice_leads_on(tmp_path: Path) -> None:
    said = _advice(tmp_path, [HEADER, *WIDER])
    assert said.count("the header has 3") == 1
    assert "such as Other" in said
    table = _read(tmp_path, [f"{HEADER},Other", *WIDER])
    _is_press(table)
    assert any("Other" in str(unread) for unread in table.unread)


@pytest.mark.parametrize(
    "first", ["Time (s),Displacement (mm),", "Time (s),Displacement (mm)", "Time (s),Displacement (mm),Force (N)"]
)
def test_a_header_that_goes_on_in_the_next_line_is_read_with_a_note(tmp_path: Path, first: str) -> None:
    names = [*HEADER.split(","), "Cp (pF)"]
    second = ",".join(names[first.rstrip(",").count(",") + 1 :])
    table = _read(tmp_path, ["a remark", first, second, *WIDER])
    _is_press(table)
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * np.array(P.c, float))
    assert any("goes on in the next line" in note for note in table.notes)


@pytest.mark.parametrize(
    "head",
    [
        ["Time (s),Displacement (mm),", "Force (N),quux (pF)"],
        ["Time (s),Displacement (mm),", "Force (N),Force (N)"],
        ["Time (s),Displacement (mm),Force (N)", "Time (s)"],
        ["Capacitance", "Time (s),Displacement (mm),Force (N)"],
        ["Capacitance,", "Time (s),Displacement (mm),Force (N),"],
        ["Cp (pF),,,", "Time (s),Displacement (mm),Force (N),"],
        ["Capacitance,Time", "Displacement (mm),Force (N)"],
    ],
)
def test_two_lines_that_are_no_header_together_are_refused(tmp_path: Path, head: list[str]) -> None:
    with pytest.raises(InputError):
        _read(tmp_path, [*head, *WIDER])


# -------------------------------------------------------------------------------------------------------------- rows in quotes


@pytest.mark.parametrize("head", [[HEADER], ["a remark, of mine", HEADER], ["Time,Displacement,Force", "s,mm,N"]])
def test_rows_in_quotes_as_a_whole_below_a_plain_header_are_read_with_a_note(tmp_path: Path, head: list[str]) -> None:
    table = _read(tmp_path, [*head, *(f'"{row}"' for row in ROWS)])
    _is_press(table)
    assert any("the quotes are taken off" in note for note in table.notes)


@pytest.mark.parametrize("header", ["Time (s),Displacement (mm)", "Time (s);Displacement (mm);Force (N)"])
def test_rows_in_quotes_below_a_header_of_other_cells_stay_as_they_are(tmp_path: Path, header: str) -> None:
    with pytest.raises(InputError):
        _read(tmp_path, [header, *(f'"{row}"' for row in ROWS)])


@pytest.mark.parametrize("name", ["Crosshead\ndisplacement\n(mm)", "Displacement\nof the\nstage\n(mm)", "Displacement\n(mm)"])
def test_names_in_quotes_over_several_lines_are_one_cell_each(tmp_path: Path, name: str) -> None:
    _is_press(_read(tmp_path, [f'"Time\n(s)","{name}","Load\n(N)"', *ROWS]))


@pytest.mark.parametrize("above", ['"a remark, of mine', 'see "notes'])
def test_a_quotation_mark_above_that_is_left_open_takes_no_line_to_its_own(tmp_path: Path, above: str) -> None:
    _is_press(_read(tmp_path, [above, HEADER, *ROWS]))

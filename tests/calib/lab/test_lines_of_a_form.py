"""Lines that hold their numbers in a text: logs, JSON lines, lists, SQL, LaTeX; each read to the truth, or with a way out."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hostile_press import press

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

P = press(120, seed=5)
CLOCKS = [f"10:{int(float(t)) // 60:02d}:{float(t) % 60:06.3f}" for t in P.t]
BY_NUMBER = {"time": "1", "force": "2", "displacement": "3"}
UNITS = {"time": "s", "force": "N", "displacement": "mm"}
Row = Callable[[str, str, str, str, str], str]


def _lines(row: Row | str) -> list[str]:
    values = zip(P.t, P.f, P.d, P.c, CLOCKS, strict=True)
    if isinstance(row, str):
        return [row % {"t": t, "f": f, "d": d, "c": c, "s": s} for t, f, d, c, s in values]
    return [row(t, f, d, c, s) for t, f, d, c, s in values]


def _read(folder: Path, lines: Sequence[str], reading: Reading | None = None, name: str = "press.txt") -> LabTable:
    path = folder / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


def _refused(folder: Path, lines: Sequence[str], reading: Reading | None = None) -> str:
    with pytest.raises(InputError) as caught:
        _read(folder, lines, reading)
    return str(caught.value)


def _is_press(table: LabTable) -> None:
    truth = {"force": (P.f, 1.0), "displacement": (P.d, 1e-3), "capacitance": (P.c, 1e-12), "time": (P.t, 1.0)}
    for quantity, values in table.columns.items():
        there, factor = truth[quantity]
        own = values - (values[0] if quantity == "time" else 0.0)
        np.testing.assert_allclose(own, factor * np.array(there, float), atol=1e-9 * factor)
    assert len(table.columns) > 1


NAMED = {
    "mqtt": 'sensors/press {"t_s":%(t)s,"C_pF": %(c)s,"F_N":%(f)s,"x_mm":%(d)s}',
    "python": "{'t_s': %(t)s, 'F_N': %(f)s, 'x_mm': %(d)s}",
    "JSON lines": '{"t_s": %(t)s, "F_N": %(f)s, "x_mm": %(d)s}',
    "JSON with units": '{"time":"2026-03-01T%(s)sZ","force":{"value":%(f)s,"unit":"N"},"disp":{"value":%(d)s,"unit":"mm"}}',
    "a query": "t_s=%(t)s&F_N=%(f)s&x_mm=%(d)s",
    "XML": '<row t_s="%(t)s" F_N="%(f)s" x_mm="%(d)s"/>',
    "SQL": "INSERT INTO `press` (`t_s`, `F_N`, `x_mm`) VALUES ('%(t)s', '%(f)s', '%(d)s');",
    "a repr": "Reading(t_s=%(t)s, force_N=%(f)s, disp_mm=%(d)s)",
    "French": "[%(s)s] force mesurée = %(f)s N ; déplacement = %(d)s mm ;",
    "prose": "after %(t)s s the force was %(f)s N and the displacement was %(d)s mm",
    "levels": "%(s)s INFO rig/1 F=%(f)s N x=%(d)s mm",
    "tolerances": "t=%(t)s s: F = %(f)s +/- 0.01 N, x = %(d)s +/- 0.002 mm",
    "pairs": "('t_s', %(t)s), ('F_N', %(f)s), ('x_mm', %(d)s)",
    "a prefix": "rig{t_s:%(t)s F_N:%(f)s x_mm:%(d)s}",
    "a logger": 'Mar  1 %(s)s host node[12]: {"F_N":%(f)s,"x_mm":%(d)s}',
}


@pytest.mark.parametrize("row", NAMED.values(), ids=NAMED)
def test_numbers_in_a_text_are_columns_by_the_names_before_and_the_units_behind_them(tmp_path: Path, row: str) -> None:
    table = _read(tmp_path, _lines(row))
    _is_press(table)
    assert {"force", "displacement"} <= table.columns.keys()
    assert any("differ by their numbers alone" in n or "each line is an object of JSON" in n for n in table.notes)


def test_a_number_that_is_a_part_of_the_text_is_no_column(tmp_path: Path) -> None:
    row = "[%(s)s][D][sensor:094]: 'Capacitance': Sending state %(c)s00 pF with 2 decimals of accuracy"
    table = _read(tmp_path, _lines(row))
    assert table.columns.keys() == {"time", "capacitance"}
    _is_press(table)
    assert any("#2 pF with 2 decimals" in note for note in table.notes)


@pytest.mark.parametrize("word", ["peak", "setpoint", "offset", "std"])
def test_a_number_of_a_quantity_that_is_not_its_value_is_not_read(tmp_path: Path, word: str) -> None:
    row = '{"t_s":%(t)s,"x_mm":%(d)s,"force":{"WORD":%(f)s,"unit":"N"}}'.replace("WORD", word)
    said = _refused(tmp_path, _lines(row))
    assert "no force column" in said or "may be no force" in said


NAMELESS = {
    "lists": "[%(t)s, %(f)s, %(d)s]",
    "lists with commas": "[%(t)s, %(f)s, %(d)s],",
    "tuples": "(%(t)s, %(f)s, %(d)s)",
    "SQL": "INSERT INTO press VALUES (%(t)s, %(f)s, %(d)s, %(c)s);",
    "HTML": "<tr><td>%(t)s</td><td>%(f)s</td><td>%(d)s</td></tr>",
    "LaTeX": "%(t)s & %(f)s & %(d)s \\\\",
    "NMEA": "$PRESS,%(t)s,%(f)s,%(d)s*4F",
    "tab and blanks": "%(t)s\t%(f)s  %(d)s",
    "a word": "DATA: %(t)s, %(f)s, %(d)s",
}


@pytest.mark.parametrize("row", NAMELESS.values(), ids=NAMELESS)
def test_numbers_without_names_are_counted_in_the_refusal_and_read_by_their_numbers(tmp_path: Path, row: str) -> None:
    said = _refused(tmp_path, _lines(row))
    assert "press.txt:1: the lines are of one form" in said
    assert "--columns time=1" in said
    _is_press(_read(tmp_path, _lines(row), Reading(columns=BY_NUMBER, units=UNITS)))


def test_the_print_of_an_array_is_read_by_the_numbers_of_its_columns(tmp_path: Path) -> None:
    lines = _lines(" [%(t)s %(f)s %(d)s]")
    lines[0], lines[-1] = f"[{lines[0].strip()}", f"{lines[-1]}]"
    table = _read(tmp_path, lines, Reading(columns=BY_NUMBER, units=UNITS))
    _is_press(table)
    assert len(table.lines) == len(P.t)


def test_an_array_of_objects_one_a_line_is_read(tmp_path: Path) -> None:
    lines = _lines(' {"t_s": %(t)s, "F_N": %(f)s, "x_mm": %(d)s},')
    lines[0], lines[-1] = f"[{lines[0].strip()}", f"{lines[-1].rstrip(',')}]"
    _is_press(_read(tmp_path, lines, name="press.json"))


ABOVE = {
    "lists": (["t_s, F_N, x_mm"], "[%(t)s, %(f)s, %(d)s]"),
    "tuples": (["('Time (s)', 'Force (N)', 'Displacement (mm)')"], "('%(t)s', '%(f)s', '%(d)s')"),
    "LaTeX": (
        [r"\begin{tabular}{ccc}", r"Time (s) & Force (N) & Displacement (mm) \\ \hline"],
        r"%(t)s & %(f)s & %(d)s \\",
    ),
    "tab and blanks": (["t_s\tF_N  x_mm"], "%(t)s\t%(f)s  %(d)s"),
    "terminal": (["2026-03-01 09:59:59.900 F_N,x_mm"], "2026-03-01 %(s)s %(f)s,%(d)s"),
    "units in a line": (["units: t in s, F in N, x in mm"], "rig{t:%(t)s F:%(f)s x:%(d)s}"),
    "settings in JSON": (['{"rig": "A"}', '{"ball_mm": 10}', "t_s,F_N,x_mm"], "%(t)s,%(f)s,%(d)s"),
    "ARFF": (
        ["@relation press", "@attribute 'Time (s)' numeric", "@ATTRIBUTE F_N REAL", "@attribute x_mm numeric", "@data"],
        "%(t)s,%(f)s,%(d)s",
    ),
}


@pytest.mark.parametrize(("above", "row"), ABOVE.values(), ids=ABOVE)
def test_names_and_units_that_stand_above_the_lines_are_taken(tmp_path: Path, above: list[str], row: str) -> None:
    table = _read(tmp_path, [*above, *_lines(row)])
    assert table.columns.keys() == {"time", "force", "displacement"}
    _is_press(table)


def test_messages_of_several_forms_are_parted_by_the_command_of_the_refusal(tmp_path: Path) -> None:
    rows = zip(
        _lines("[%(s)s][D]: 'Force': Sending state %(f)s N"),
        _lines("[%(s)s][D]: 'Capacitance': Sending state %(c)s0 pF"),
        strict=True,
    )
    said = _refused(tmp_path, [line for pair in rows for line in pair])
    assert "2 forms" in said
    subprocess.run(["sh", "-c", said.split("a terminal does: ")[1]], cwd=tmp_path, check=True)
    table = read_lab_file(tmp_path / "2_press.txt")
    assert table.columns.keys() == {"time", "capacitance"}
    _is_press(table)


def test_lines_of_other_forms_are_named_or_refused_if_they_may_be_rows(tmp_path: Path) -> None:
    rows = _lines(NAMED["a prefix"])
    table = _read(tmp_path, ["log of rig 1", *rows[:30], "touch detected", *rows[30:], "bye"])
    _is_press(table)
    assert any('the first is "touch detected" (line 32)' in note for note in table.notes)
    assert [unread.what for unread in table.unread if "no line of that form" in unread.reason] == ["line 1", "line 123"]
    for odd in ("load cell tared", "rig{t_s:1 F_kN:2 x_mm:3}", "Specimen 2", "run 2 started", "range 2"):
        assert f'press.txt:61:1: "{odd}" is not of the form' in _refused(tmp_path, [*rows[:60], odd, *rows[60:]])
    assert "F_mN" in _refused(tmp_path, [*[row.replace("F_N", "F_mN") for row in rows[:20]], *rows[20:]])


def test_what_stands_above_lines_without_a_header_is_looked_at(tmp_path: Path) -> None:
    assert "REL mode ON" in _refused(tmp_path, ["REL mode ON", *_lines("rig{t_s:%(t)s C_pF:%(c)s}")])


CHANGED = {
    "a sign in the text": "t %(t)s;F-%(f)s;x-%(d)s;",
    "a sign apart": "rig{t_s:%(t)s F_N:- %(f)s x_mm:%(d)s}",
    "a factor": "rig{t_s:%(t)s F_N (x10):%(f)s x_mm:%(d)s}",
    "brackets": "rig;%(t)s;(%(f)s);(%(d)s)",
    "a bound": "rig{t_s:%(t)s F_N:<%(f)s x_mm:%(d)s}",
    "a power": "rig{t_s:%(t)s F_N:%(f)s*10^-3 x_mm:%(d)s}",
}


@pytest.mark.parametrize("row", CHANGED.values(), ids=CHANGED)
def test_numbers_beside_which_the_text_changes_them_are_not_read(tmp_path: Path, row: str) -> None:
    lines = _lines(lambda t, f, d, c, s: row % {"t": t, "f": f.strip("-"), "d": d.strip("-")})
    assert "A table has one line of names" in _refused(tmp_path, lines)


def test_decimal_commas_in_a_text_are_told_from_commas_between_numbers(tmp_path: Path) -> None:
    table = _read(tmp_path, [line.replace(".", ",") for line in _lines("rig{t_s:%(t)s F_N:%(f)s x_mm:%(d)s}")])
    _is_press(table)


def test_a_null_in_a_line_is_a_row_that_is_not_used(tmp_path: Path) -> None:
    lines = _lines(NAMED["JSON lines"])
    lines[50] = lines[50].replace(P.f[50], "null")
    table = _read(tmp_path, lines)
    assert np.flatnonzero(np.isnan(table.columns["force"])).tolist() == [50]


def test_a_table_with_a_column_of_words_is_none_of_lines_of_a_form(tmp_path: Path) -> None:
    table = _read(tmp_path, ["Time (s),Force (N),State,Displacement (mm)", *_lines("%(t)s,%(f)s,running,%(d)s")])
    _is_press(table)
    assert not any("differ by their numbers alone" in note for note in table.notes)

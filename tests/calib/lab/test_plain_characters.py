"""Characters that stand for others (entities, escapes, odd hyphens, marks nobody sees) are read as these, and said so."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calib.errors import Fault, InputError
from calib.lab import LabTable, read_lab_file

N = 40
DEPTH = [-0.2 + 0.9 * i for i in range(N)]
FORCE = [-0.0092 + 0.0005 * i * i for i in range(N)]


def written(folder: Path, names: str, cell: Callable[[float], str] = lambda f: f"{f:.4f}", sep: str = ";") -> Path:
    path = folder / "lab.csv"
    rows = [sep.join((f"{i * 0.1:.1f}", f"{x:.1f}", cell(f))) for i, (x, f) in enumerate(zip(DEPTH, FORCE, strict=True))]
    path.write_text("\n".join([names, *rows]) + "\n", encoding="utf-8")
    return path


def is_right(table: LabTable) -> None:
    np.testing.assert_allclose(table.columns["time"], [0.1 * i for i in range(N)], atol=1e-9)
    np.testing.assert_allclose(table.columns["displacement"], np.array(DEPTH) * 1e-6, atol=1e-7)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)


@pytest.mark.parametrize("unit", ["&micro;m", "&#181;m", "&#xB5;m", "&mu;m", r"\u00b5m", r"\u03bcm", r"\xb5m"])
def test_a_unit_with_an_entity_or_an_escape_is_read_with_a_note(tmp_path: Path, unit: str) -> None:
    table = read_lab_file(written(tmp_path, f"Time (s);Displacement ({unit});Force (N)"))
    is_right(table)
    assert any("stand for" in note and "µ" in note.replace("μ", "µ") for note in table.notes)


@pytest.mark.parametrize("unit", ["m&sup2;", "&bogus;m", "&#59;m", r"\u0041m", r"\u00b5"])
def test_an_entity_of_no_length_makes_none(tmp_path: Path, unit: str) -> None:
    with pytest.raises(InputError):
        read_lab_file(written(tmp_path, f"Time (s)\tDisplacement ({unit})\tForce (N)", sep="\t"))


@pytest.mark.parametrize("hyphen", ["\u2010", "\u2011", "\u2012", "\u2014", "\uff0d", "&minus;", "&#8722;"])
def test_a_hyphen_or_a_dash_before_a_number_is_a_minus(tmp_path: Path, hyphen: str) -> None:
    table = read_lab_file(written(tmp_path, "Time (s)\tz (µm)\tForce (N)", lambda f: f"{f:.4f}".replace("-", hyphen), "\t"))
    is_right(table)
    assert any("stand for" in note for note in table.notes)


def test_a_hyphen_within_a_date_or_a_word_stays(tmp_path: Path) -> None:
    table = read_lab_file(written(tmp_path, "Date: 2026\u201111\u201126, by M\u20117\nTime (s);z (µm);Force (N)"))
    is_right(table)
    assert not any("hyphens" in note for note in table.notes)


@pytest.mark.parametrize("mark", ["\u200e", "\u200f", "\u202b", "\u2067", "\u200b"])
def test_marks_that_nobody_sees_cost_no_column(tmp_path: Path, mark: str) -> None:
    table = read_lab_file(written(tmp_path, f"{mark}Time (s){mark};z (µm){mark};Force (N)", lambda f: f"{mark}{f:.4f}"))
    is_right(table)
    assert any("which nobody sees" in note for note in table.notes)


@pytest.mark.parametrize("sep", [",\t", ", \t", ",  \t ", ";\t", " ;\t"])
def test_a_delimiter_before_each_tab_is_one_with_it(tmp_path: Path, sep: str) -> None:
    table = read_lab_file(written(tmp_path, sep.join(("Time (s)", "z (µm)", "Force (N)")), sep=sep))
    is_right(table)
    assert any("both are taken as one" in note for note in table.notes)


def test_decimal_commas_stay_beside_commas_before_tabs(tmp_path: Path) -> None:
    path = written(tmp_path, "Time (s),\tz (µm),\tForce (N),", lambda f: f"{f:.4f},", ",\t")
    path.write_text(path.read_text(encoding="utf-8").replace(".", ","), encoding="utf-8")
    is_right(read_lab_file(path))


def test_tabs_of_which_some_stand_behind_no_delimiter_are_delimiters_themselves(tmp_path: Path) -> None:
    table = read_lab_file(written(tmp_path, "Specimen 4,\tpad 2\nTime (s)\tz (µm)\tForce (N)", sep="\t"))
    is_right(table)
    assert not any("both are taken as one" in note for note in table.notes)


@pytest.mark.parametrize("sep", [",", ";"])
def test_numbers_in_single_quotes_are_read(tmp_path: Path, sep: str) -> None:
    path = written(tmp_path, sep.join(("'Time (s)'", "'z (µm)'", "'Force (N)'")), sep=sep)
    names, *rows = path.read_text(encoding="utf-8").splitlines()
    quoted = [sep.join(f"'{cell}'" for cell in row.split(sep)) for row in rows]
    path.write_text("\n".join([names, *quoted]) + "\n", encoding="utf-8")
    table = read_lab_file(path)
    is_right(table)
    assert any("is read as" in note for note in table.notes)


@pytest.mark.parametrize("word", ["OF", "--.--", "-.---", "---,--", "***", "OVFL", "UNDERFLOW", "OL", "------"])
def test_a_word_for_no_reading_costs_its_row_alone(tmp_path: Path, word: str) -> None:
    path = written(tmp_path, "Time (s);z (µm);Force (N)", lambda f: word if f > 0.74 else f"{f:.4f}")
    table = read_lab_file(path)
    assert "over-range" in table.reasons[-1]
    assert all(not why for why in table.reasons[:-1])


@pytest.mark.parametrize("word", ["of", "Of", "O F", "--.5-", "OFF", "-.-x"])
def test_another_word_is_no_number(tmp_path: Path, word: str) -> None:
    with pytest.raises(InputError, match="is not a number"):
        read_lab_file(written(tmp_path, "Time (s);z (µm);Force (N)", lambda f: word if f > 0.74 else f"{f:.4f}"))


def test_microfarads_in_capitals_stay_a_unit(tmp_path: Path) -> None:
    path = tmp_path / "lab.csv"
    rows = [f"{i * 0.1:.1f};{97.3e-6 + 1e-8 * i * i:.9f};UF" for i in range(N)]
    path.write_text("\n".join(["Time (s);CP;UNIT", *rows]) + "\n", encoding="utf-8")
    assert read_lab_file(path).columns["capacitance"][0] == pytest.approx(97.3e-12, rel=1e-6)


def test_a_message_that_asks_has_no_point_behind_its_question_mark() -> None:
    assert str(Fault('unknown unit "PF", did you mean pF?', advice="If so, say it")).endswith("pF? If so, say it")
    assert str(Fault("the cell is empty", advice="Fill it")) == "the cell is empty. Fill it"


def test_a_name_of_ten_thousand_brackets_takes_no_time(tmp_path: Path) -> None:
    path = written(tmp_path, "Tim" + "(" * 5000 + " " * 2000 + "(" * 3000 + ";z (µm);Force (N)")
    begun = time.perf_counter()
    read_lab_file(path)
    assert time.perf_counter() - begun < 3.0


def test_marks_that_nobody_sees_cost_no_column_of_a_workbook(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["\u200fTime (s)", "z (µm)\u200b", "\ufeffForce (N)\u200e"])
    for i, (x, f) in enumerate(zip(DEPTH, FORCE, strict=True)):
        book.active.append([0.1 * i, x, f])
    book.save(tmp_path / "lab.xlsx")
    table = read_lab_file(tmp_path / "lab.xlsx")
    is_right(table)
    assert any("nobody sees" in note for note in table.notes)

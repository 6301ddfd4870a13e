"""Words beside a table by which its readings are in another unit than its header says: refused, with advice that settles it."""

from pathlib import Path

import numpy as np
import pytest

import calib
from calib.errors import InputError
from calib.lab import read_lab_file
from calib.lab.instruments.contrary import unit_against

HEADER = "Time (s),Displacement (mm),Force (N)"
ROWS = [f"{0.1 * i:.1f},{0.01 * i:.4f},{0.3 * i**1.5:.4f}" for i in range(40)]

OF_FORCE = (
    "Force is in mN!",
    "Achtung: Kraft in mN, nicht N",
    "注意：力的单位是mN",
    "# force column is in mN (header wrong)",
    "NB force in mN",
    "# force actually in mN",
    "Load cell output in millinewtons",
    "Forces are milli-newtons",
    "сила в миллиньютонах",
    "Uwaga: siła podana w mN",
    "荷重の単位はNではなくmN",
    "힘은 mN 단위입니다",
    "fuerza en mN en vez de N",
    "oops, header wrong: mN",
    "header says N but it is mN",
    "converted from N to mN",
    "Force was recorded in mN on channel 2",
    "force is in grams",
    "F in mN",
    "Force [mN] over displacement [um]",
    "the force is not in N",
)
OF_NO_FORCE = (
    "max 500 mN",
    "500 mN load cell",
    "Load cell: 10 kN",
    "Preload (mN): 50",
    "Preload in mN: 50",
    "Max force (mN),512",
    "Force resolution: mN",
    "range: mN",
    "converted from mN to N",
    "umgerechnet von kN in N",
    "mN -> N",
    "force is in N, not mN",
    "Kraft in N",
    "stiffness N/mm",
    "Operator: M. N. Smith",
)
OF_DISPLACEMENT = (
    "# displacement is in inches, sorry",
    "Weg in µm",
    "x in inches",
    "位移单位是微米",
    "перемещение в микрометрах",
    "Units: force N, displacement um",
)
OF_NO_DISPLACEMENT = (
    "ball radius in um",
    "Sample thickness (um)",
    "Speed 0.1 um/s",
    "speed in um per s",
    "displacement in mm",
    "Gauge length um",
    "0.05 um steps",
)


def _write(folder: Path, *lines: str) -> Path:
    path = folder / "press.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize("words", OF_FORCE)
def test_words_that_give_the_force_another_unit_contradict_its_header(words: str) -> None:
    assert unit_against(words, "force", 1.0)


@pytest.mark.parametrize("words", OF_NO_FORCE)
def test_a_unit_of_something_else_contradicts_no_force(words: str) -> None:
    assert unit_against(words, "force", 1.0) == ""


def test_words_on_the_displacement_are_told_from_sizes_and_speeds() -> None:
    assert all(unit_against(words, "displacement", 1e-3) for words in OF_DISPLACEMENT)
    assert not any(unit_against(words, "displacement", 1e-3) for words in OF_NO_DISPLACEMENT)


@pytest.mark.parametrize("place", ["above", "below", "among", "beside"])
@pytest.mark.parametrize("words", ["# NB: force in mN!", "# sorry, the load is in millinewtons"])
def test_a_contradiction_is_refused_wherever_it_stands(tmp_path: Path, place: str, words: str) -> None:
    lines = {
        "above": [words, HEADER, *ROWS],
        "below": [HEADER, *ROWS, "", words],
        "among": [HEADER, *ROWS[:20], words, *ROWS[20:]],
        "beside": [f"{HEADER},Remarks", f'{ROWS[0]},"{words[2:]}"', *(f"{row}," for row in ROWS[1:])],
    }[place]
    with pytest.raises(calib.InputError, match="unit"):
        calib.read_lab_file(_write(tmp_path, *lines))


@pytest.mark.parametrize(("unit", "factor"), [("mN", 1e-3), ("N", 1.0)])
@pytest.mark.parametrize("place", ["above", "below", "beside"])
def test_a_unit_that_is_said_settles_the_contradiction(tmp_path: Path, place: str, unit: str, factor: float) -> None:
    lines = {
        "above": ["Achtung: Kraft in mN, nicht N", HEADER, *ROWS],
        "below": [HEADER, *ROWS, "", "NB force in mN"],
        "beside": [f"{HEADER},Remarks", f"{ROWS[0]},force in mN", *(f"{row}," for row in ROWS[1:])],
    }[place]
    table = calib.read_lab_file(_write(tmp_path, *lines), calib.Reading(units={"force": unit}))
    np.testing.assert_allclose(table.columns["force"][-1], factor * float(ROWS[-1].split(",")[2]))


def test_a_unit_that_holds_from_a_row_on_is_settled_by_no_unit(tmp_path: Path) -> None:
    rows = [f"{row}," if i != 20 else f"{row},force now in mN" for i, row in enumerate(ROWS)]
    with pytest.raises(calib.InputError, match="another unit or range"):
        calib.read_lab_file(_write(tmp_path, f"{HEADER},Remarks", *rows), calib.Reading(units={"force": "mN"}))


def test_what_is_said_against_words_is_noted(tmp_path: Path) -> None:
    path = _write(tmp_path, HEADER, *ROWS, "", "NB force in mN")
    table = calib.read_lab_file(path, calib.Reading(units={"force": "N"}))
    assert any("as asked" in note and "NB force in mN" in note for note in table.notes)


def _workbook(path: Path, *, comment: str = "", box: str = "", side: str = "") -> Path:
    xlsxwriter = pytest.importorskip("xlsxwriter")
    book = xlsxwriter.Workbook(path)
    sheet = book.add_worksheet("Data")
    sheet.write_row(0, 0, HEADER.split(","))
    for r, row in enumerate(ROWS, 1):
        sheet.write_row(r, 0, list(map(float, row.split(","))))
    if comment:
        sheet.write_comment("C1", comment)
    if box:
        sheet.insert_textbox("F4", box)
    if side:
        sheet.write("H3", side)
    book.close()
    return path


@pytest.mark.parametrize("place", ["comment", "box", "side"])
def test_a_workbook_is_refused_for_what_its_comments_and_side_cells_say(tmp_path: Path, place: str) -> None:
    path = _workbook(tmp_path / "press.xlsx", **{place: "Force values are in mN!!"})
    with pytest.raises(calib.InputError, match="mN"):
        calib.read_lab_file(path)
    for unit, factor in (("mN", 1e-3), ("N", 1.0)):
        table = calib.read_lab_file(path, calib.Reading(units={"force": unit}))
        np.testing.assert_allclose(table.columns["force"][-1], factor * float(ROWS[-1].split(",")[2]))


def test_a_comment_on_a_name_is_of_its_column(tmp_path: Path) -> None:
    with pytest.raises(calib.InputError, match="its own is N"):
        calib.read_lab_file(_workbook(tmp_path / "press.xlsx", comment="values are in mN"))


def test_comments_that_contradict_nothing_are_told(tmp_path: Path) -> None:
    table = calib.read_lab_file(_workbook(tmp_path / "press.xlsx", comment="10 kN load cell, zeroed by Ana"))
    assert any("10 kN load cell" in note for note in table.notes)


@pytest.mark.parametrize("template", ["Force (kN)", "Load [lbf]", "Displacement (in)", "Cp (nF)"])
@pytest.mark.parametrize("gap", [0, 3])
def test_an_empty_column_of_a_template_states_no_unit_of_another(tmp_path: Path, template: str, gap: int) -> None:
    path = tmp_path / "lab.csv"
    rows = [
        f"{i * 0.1:.1f},{i * 0.0131:.4f},{i * i * 0.0007:.4f},{97.3 + 0.0137 * i * i:.4f}{',' * (gap + 1)}" for i in range(40)
    ]
    names = f"Time (s),Displacement (mm),Force (N),Cp (pF){',' * (gap + 1)}{template}"
    path.write_text("\n".join([names, *rows]) + "\n", encoding="utf-8")
    table = read_lab_file(path)
    assert table.columns["force"][39] == pytest.approx(39 * 39 * 0.0007)
    assert any(template in unread.what and "empty" in unread.reason for unread in table.unread)


@pytest.mark.parametrize("remark", ["Force in kN!", "force was in kN", "N.B. force: kN"])
def test_a_remark_above_an_empty_column_states_it(tmp_path: Path, remark: str) -> None:
    path = tmp_path / "lab.csv"
    rows = [f"{i * 0.1:.1f},{i * 0.0131:.4f},{i * i * 0.0007:.4f}," for i in range(40)]
    path.write_text("\n".join([f"Time (s),Displacement (mm),Force (N),{remark}", *rows]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="kN"):
        read_lab_file(path)


@pytest.mark.parametrize("unit", ["kN", "mN", "gf"])
@pytest.mark.parametrize("names", ["t_s,d_mm,F_N", "time_s,x_mm,f_n", "t_s,C_pF,F_N"])
def test_f_n_beside_names_that_end_in_their_units_has_two_units(tmp_path: Path, names: str, unit: str) -> None:
    path = tmp_path / "press.csv"
    middle = "pF" if "pF" in names else "mm"
    path.write_text("\n".join([names, f"s,{middle},{unit}", *ROWS]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=f"--units force={unit} or --units force=N"):
        read_lab_file(path)
    for said, factor in (("N", 1.0), (unit, {"kN": 1e3, "mN": 1e-3, "gf": 9.80665e-3}[unit])):
        force = read_lab_file(path, calib.Reading(units={"force": said})).columns["force"]
        assert force[-1] == pytest.approx(factor * float(ROWS[-1].rsplit(",", 1)[1]))


def test_so_has_f_n_with_a_unit_in_its_own_brackets_beside_such_names(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    path.write_text("\n".join(["t_s,d_mm,F_N [mN]", *ROWS]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="--units force=mN or --units force=N"):
        read_lab_file(path)


@pytest.mark.parametrize(
    "header",
    [
        "t,d,F_N\ns,mm,mN",
        "Time [s],Displacement [mm],F_N [mN]",
        "t_s,d_mm,F_N_mN",
        "Zeit,Weg,F_N\ns,mm,mN",
    ],
)
def test_f_n_beside_names_without_units_in_them_is_the_symbol_of_a_normal_force(tmp_path: Path, header: str) -> None:
    path = tmp_path / "press.csv"
    path.write_text("\n".join([header, *ROWS]) + "\n", encoding="utf-8")
    table = read_lab_file(path)
    assert table.columns["force"][-1] == pytest.approx(1e-3 * float(ROWS[-1].rsplit(",", 1)[1]))
    assert any("the index is that of a normal force" in note for note in table.notes)

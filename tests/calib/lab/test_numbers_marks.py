"""The decimal mark is told for each column by what its cells, the other columns or its course show, and never guessed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 40
TIME = [f"{i * 0.1:.1f}" for i in range(N)]
DEPTH = [f"{i * 0.0131:.4f}" for i in range(N)]
CAP = [f"{97.301 + 0.0137 * i * i:.3f}" for i in range(N)]


def comma(cells: list[str]) -> list[str]:
    return [c.replace(".", ",") for c in cells]


def written(tmp_path: Path, head: str, *columns: list[str], sep: str = ";") -> Path:
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([head, *(sep.join(row) for row in zip(*columns, strict=True))]) + "\n", encoding="utf-8")
    return path


def capacitance(table: LabTable) -> list[float]:
    return [round(c * 1e12, 6) for c in table.columns["capacitance"].tolist()]


def refusal(path: Path, reading: Reading | None = None) -> str:
    with pytest.raises(InputError) as caught:
        read_lab_file(path, reading or Reading())
    return str(caught.value)


def test_three_decimals_everywhere_are_decimals_if_the_other_columns_show_the_mark(tmp_path: Path) -> None:
    table = read_lab_file(written(tmp_path, "Zeit (s);Cp (pF)", comma(TIME), comma(CAP)))
    assert capacitance(table) == [float(c) for c in CAP]


def test_three_decimals_of_which_no_column_tells_are_refused_until_the_mark_is_said(tmp_path: Path) -> None:
    path = written(tmp_path, "Zeit (s);Cp (pF)", [str(i) for i in range(N)], comma(CAP))
    assert '--decimal ","' in refusal(path)
    assert capacitance(read_lab_file(path, Reading(decimal=","))) == [float(c) for c in CAP]
    assert capacitance(read_lab_file(path, Reading(decimal="."))) == [1000 * float(c) for c in CAP]


@pytest.mark.parametrize(("mark", "other"), [(".", ","), (",", ".")])
def test_a_column_whose_mark_the_others_use_for_decimals_of_the_other_kind_is_asked_for(
    tmp_path: Path, mark: str, other: str
) -> None:
    cap = [c.replace(".", other) for c in CAP]
    path = written(tmp_path, "Time (s);Cp (pF)", [t.replace(".", mark) for t in TIME], cap)
    assert "--decimal" in refusal(path)
    assert capacitance(read_lab_file(path, Reading(decimal=other))) == [float(c) for c in CAP]
    assert capacitance(read_lab_file(path, Reading(decimal=mark))) == [1000 * float(c) for c in CAP]


def test_columns_that_each_show_their_own_mark_are_read_by_it_and_a_note_says_so(tmp_path: Path) -> None:
    cap = [f"{97.3 + i / 100:.2f}" for i in range(N)]
    table = read_lab_file(written(tmp_path, "Time (s);Cp (pF)", comma(TIME), cap))
    assert capacitance(table) == [float(c) for c in cap]
    assert any("decimal comma" in note and "decimal point" in note for note in table.notes)


def test_thousands_points_go_on_from_the_whole_numbers_below_a_thousand(tmp_path: Path) -> None:
    um = [f"{i * 37:,}".replace(",", ".") for i in range(N)]
    force = [f"{i * 0.11:.2f}".replace(".", ",") for i in range(N)]
    table = read_lab_file(written(tmp_path, "Zeit (s);Weg (µm);Kraft (N)", comma(TIME), um, force))
    np.testing.assert_allclose(table.columns["displacement"], np.arange(N) * 37e-6)
    assert any("thousands" in note for note in table.notes)


def test_an_asked_mark_that_the_whole_file_contradicts_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, "Time (s);Extension (mm);Load (N)", TIME, DEPTH, TIME)
    assert "asked for" in refusal(path, Reading(decimal=","))


# ----------------------------------------------------------------------------------------------------- lost, moved marks


def test_a_spreadsheet_that_took_three_decimals_for_thousands_is_refused(tmp_path: Path) -> None:
    eaten = [str(round(float(c) * 1000)) if len(c.rstrip("0").split(".")[1]) == 3 else c.rstrip("0") for c in CAP]
    assert {"." in c for c in eaten} == {True, False}
    assert "lost their decimal mark" in refusal(written(tmp_path, "Time (s);Cp (pF)", TIME, eaten))


@pytest.mark.parametrize("digits", [4, 5])
@pytest.mark.parametrize("place", ["force", "displacement", "time"])
def test_a_display_of_so_many_digits_is_read_as_written(tmp_path: Path, place: str, digits: int) -> None:
    number = np.arange(N)
    columns = {"time": 0.05 * number, "displacement": 2.5 * number / N, "force": 6 * np.clip(number / N - 0.1, 0, None) ** 1.5}
    texts = {q: [f"{v:.2f}" for v in values] for q, values in columns.items()}
    texts[place] = [f"{v:.{digits}f}" if v < 1 else f"{v:.3f}" for v in columns[place]]
    path = written(tmp_path, "Time (s);Displacement (mm);Force (N)", *texts.values())
    unit = 1e-3 if place == "displacement" else 1.0
    np.testing.assert_allclose(read_lab_file(path).columns[place], unit * np.array(texts[place], float), atol=1e-12)


def test_decimal_marks_that_became_marks_of_thousands_are_read_only_where_they_are_said_to_be_right(tmp_path: Path) -> None:
    force = 0.0112 + 6 * np.clip(np.arange(N) / N - 0.1, 0, None) ** 1.5
    damaged = [f"{f:.4f}".replace(".", ",") if f < 1 else f"{round(1e4 * f):,}" for f in force]
    path = written(tmp_path, "Zeit (s);Weg (mm);Kraft (N)", comma(TIME), comma(DEPTH), damaged)
    assert 'say --decimal ","' in refusal(path)
    with pytest.raises(InputError, match=r"10 times larger .* --units force="):
        read_lab_file(path, Reading(decimal=","))
    table = read_lab_file(path, Reading(decimal=",", units={"force": "N"}))
    np.testing.assert_allclose(table.columns["force"], [float(c.replace(",", ".")) for c in damaged])


def test_numbers_of_which_all_marks_are_lost_are_refused_by_those_with_fewer_digits(tmp_path: Path) -> None:
    lost = [f"{float(c):g}".replace(".", "") for c in [f"{97.301 + 0.0011 * i:.3f}" for i in range(N)]]
    assert {len(c) for c in lost} == {4, 5}
    assert "off by powers of ten" in refusal(written(tmp_path, "Time (s);Cp (pF)", TIME, lost))


@pytest.mark.parametrize("every", [9, 17, 39])
@pytest.mark.parametrize("sign", ["", "-"])
def test_a_mark_that_is_stripped_now_and_then_makes_rows_unusable_or_the_column(tmp_path: Path, every: int, sign: str) -> None:
    force = [f"{sign}{0.1 + i * 0.0123:.5f}".replace(".", ",") for i in range(N)]
    damaged = [f.replace(",", "") if i % every == every - 1 else f for i, f in enumerate(force)]
    path = written(tmp_path, "Zeit (s);Weg (mm);Kraft (N)", comma(TIME), comma(DEPTH), damaged)
    table = read_lab_file(path)
    bad = [i for i in range(N) if damaged[i] != force[i]]
    assert bad == [i for i, reason in enumerate(table.reasons) if reason]
    assert all("decimal mark" in table.reasons[i] for i in bad)


@pytest.mark.parametrize("nines", ["-999", "999"])
def test_nines_among_numbers_with_a_mark_are_told_as_what_they_may_be(tmp_path: Path, nines: str) -> None:
    n = 200
    force = [nines if i in (50, 51, 52, 120) else f"{0.1 + i * 0.0123:.4f}" for i in range(n)]
    times, depth = [f"{i * 0.1:.1f}" for i in range(n)], [f"{i * 0.0131:.4f}" for i in range(n)]
    table = read_lab_file(written(tmp_path, "Time (s),Depth (mm),Force (N)", times, depth, force, sep=","))
    assert [i for i, reason in enumerate(table.reasons) if reason] == [50, 51, 52, 120]
    assert "stands for no reading, or seems to have lost its decimal mark" in table.reasons[50]


@pytest.mark.parametrize("quantity", ["Cp (pF)", "Force (N)"])
def test_units_that_a_number_is_off_by_are_named_of_their_own_quantity_alone(tmp_path: Path, quantity: str) -> None:
    cells = [f"{(97.3 + 0.01 * i) * (4.4482216 if i == 20 else 1):.4f}" for i in range(N)]
    table = read_lab_file(written(tmp_path, f"Time (s),Depth (mm),{quantity}", TIME, DEPTH, cells, sep=","))
    assert table.reasons[20]
    assert ("N and lbf" in table.reasons[20]) == (quantity == "Force (N)")


@pytest.mark.parametrize("power", [-3, -2, -1, 1, 2, 3])
@pytest.mark.parametrize("quantity", ["time", "displacement", "force", "capacitance"])
def test_a_mark_moved_in_one_cell_of_a_smooth_signal_makes_its_row_unusable(tmp_path: Path, quantity: str, power: int) -> None:
    n, at = 400, 217
    columns = {
        "time": [f"{i * 0.05:.4f}" for i in range(n)],
        "displacement": [f"{0.2 + i * 0.0021:.4f}" for i in range(n)],
        "force": [f"{0.4 + (i * 0.01) ** 1.5:.4f}" for i in range(n)],
        "capacitance": [f"{97.3011 + 1e-4 * i * i:.4f}" for i in range(n)],
    }
    columns[quantity][at] = f"{float(columns[quantity][at]) * 10.0**power:.4f}"
    path = written(tmp_path, "Time (s);Extension (mm);Load (N);Cp (pF)", *columns.values())
    table = read_lab_file(path)
    assert [i for i, reason in enumerate(table.reasons) if reason] == [at]
    assert "off by a factor" in table.reasons[at]


@pytest.mark.parametrize("seed", range(12))
def test_honest_spikes_steps_resets_stairs_and_noise_are_not_touched(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 600
    force = 5 * np.abs(np.sin(np.linspace(0, 9, n))) ** 1.5 + rng.normal(0, 0.004, n)
    force[rng.integers(0, n, 4)] += rng.uniform(-8, 8, 4)  # spikes
    force[300:] += rng.uniform(1, 50)  # a step of the zero
    stairs = np.repeat(rng.choice([0.0, 0.1, 0.5, 1.0, 5.0, 10.0], n // 20), 20)
    stairs += np.where(rng.uniform(size=n) < 0.3, 0.001, 0)
    time = np.cumsum(np.where(rng.uniform(size=n) < 0.01, rng.uniform(10, 4000), 0.02))
    cap = 97.3 + 0.4 * force + rng.normal(0, 0.002, n)
    cells = [[f"{x:.{d}f}" for x in column] for column, d in ((time, 2), (stairs, 3), (force, 4), (cap, 3))]
    table = read_lab_file(written(tmp_path, "Time (s);Extension (mm);Load (N);Cp (pF)", *cells))
    assert not any(table.reasons)


@pytest.mark.parametrize("form", ["g", ".3g", ".5g"])
def test_numbers_without_trailing_zeros_are_not_doubted(tmp_path: Path, form: str) -> None:
    force = [f"{x:{form}}" for x in np.linspace(0.05, 250, 300).round(3)]
    depth = [f"{x:{form}}" for x in np.linspace(0.001, 2, 300).round(4)]
    time = [f"{i * 0.5:g}" for i in range(300)]
    table = read_lab_file(written(tmp_path, "Time (s);Extension (mm);Load (N)", time, depth, force))
    assert not any(table.reasons)


# 7401 and more, with points between the thousands; or 7.401 and more.
MICRONS = [f"{7.401 + 0.01 * i:.3f}" for i in range(N)]


@pytest.mark.parametrize(("row", "cell"), [(33, "7.7"), (12, "7.52"), (39, "7.")])
def test_a_cell_that_was_cut_shows_no_decimal_point_where_the_other_columns_have_commas(
    tmp_path: Path, row: int, cell: str
) -> None:
    cut = [*MICRONS[:row], cell, *MICRONS[row + 1 :]]
    path = written(tmp_path, "Zeit (s);Weg (µm);Kraft (N)", comma(TIME), cut, comma(DEPTH))
    assert "other columns have a decimal comma" in refusal(path)
    table = read_lab_file(path, Reading(decimal="."))
    read = np.array([not why for why in table.reasons])
    assert np.count_nonzero(~read) == (cell != "7.52")  # which is what those beside it let expect
    np.testing.assert_allclose(table.columns["displacement"][read], 1e-6 * np.array([float(c) for c in cut])[read])
    assert f'"{cell}" in column "Weg (µm)" is not a number' in refusal(path, Reading(decimal=","))
    whole = written(tmp_path, "Zeit (s);Weg (µm);Kraft (N)", comma(TIME), [*cut[:row], "", *cut[row + 1 :]], comma(DEPTH))
    assert read_lab_file(whole, Reading(decimal=",")).columns["displacement"][0] == pytest.approx(7.401e-3)


def test_a_cut_row_leaves_no_cell_that_is_not_a_number(tmp_path: Path) -> None:
    path = written(tmp_path, "Zeit (s);Weg (µm);Kraft (N)", comma(TIME), MICRONS, comma(DEPTH))
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[20] = lines[20].rsplit(";", 1)[0][:-2]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    table = read_lab_file(path, Reading(decimal=","))
    assert [bool(why) for why in table.reasons] == [i == 19 for i in range(N)]


def test_zeros_at_the_end_that_a_program_leaves_away_show_a_decimal_point(tmp_path: Path) -> None:
    trimmed = [f"{7.41 + 0.013 * i:.3f}".rstrip("0") for i in range(N)]
    path = written(tmp_path, "Zeit (s);Weg (mm);Kraft (N)", comma(TIME), trimmed, comma(DEPTH))
    np.testing.assert_allclose(read_lab_file(path).columns["displacement"], [1e-3 * float(c) for c in trimmed])


DIGITS = {
    "Arabic": "٠١٢٣٤٥٦٧٨٩",
    "Persian": "۰۱۲۳۴۵۶۷۸۹",
    "Devanagari": "०१२३४५६७८९",
    "full width": "０１２３４５６７８９",
}


@pytest.mark.parametrize("script", DIGITS)
@pytest.mark.parametrize("marks", [".-", "٫-", "．－", ",−"])
@pytest.mark.parametrize("before", ["", "\u200f"])
def test_digits_of_other_scripts_are_read_with_a_note(tmp_path: Path, script: str, marks: str, before: str) -> None:
    change = str.maketrans("0123456789.-", DIGITS[script] + marks)
    load = [f"{0.01 * i * i - 0.5:.4f}" for i in range(N)]
    told = [[before + cell.translate(change) for cell in column] for column in (TIME, DEPTH, load)]
    table = read_lab_file(written(tmp_path, "Time (s);Displacement (mm);Force (N)", *told))
    np.testing.assert_allclose(table.columns["force"], [float(cell) for cell in load], rtol=1e-12)
    np.testing.assert_allclose(table.columns["displacement"], [1e-3 * float(cell) for cell in DEPTH], rtol=1e-12)
    assert any("digits of another script" in note for note in table.notes)


def test_a_name_with_such_a_digit_is_kept_where_the_numbers_are_written_as_usual(tmp_path: Path) -> None:
    table = read_lab_file(written(tmp_path, "Time (s);Displacement (mm);Force (N);台座２", TIME, DEPTH, CAP, DEPTH))
    assert 'column 4 "台座２"' in [unread.what for unread in table.unread]
    assert not any("another script" in note for note in table.notes)


_IN_MILLIONS = ["-2,453", "1,855", "23,567", "412,122", "1,004,265", "1,504,938", "1,203,364", "804,265", "304,265", "12,265"]


def _quoted_rows(forces: list[str], places: list[str]) -> str:
    rows = [f'"{100 * i}","{place}","{force}"' for i, (place, force) in enumerate(zip(places, forces, strict=True))]
    return "\n".join(['"Time (ms)","Displacement (nm)","Force (uN)"', *rows]) + "\n"


def test_whole_numbers_of_which_some_are_millions_have_their_thousands_set_apart(tmp_path: Path) -> None:
    places = ["-96", "6,988", "14,538", "21,535", "28,582", "35,845", "28,907", "21,777", "14,111", "321"]
    path = tmp_path / "lab.csv"
    path.write_text(_quoted_rows(_IN_MILLIONS, places))
    table = read_lab_file(path)
    np.testing.assert_allclose(table.columns["force"][4], 1.004265)
    np.testing.assert_allclose(table.columns["displacement"][[0, 1]], [-96e-9, 6988e-9])
    assert any("sets thousands apart" in note for note in table.notes)


@pytest.mark.parametrize(("n", "why"), [(10, "sets thousands apart in the millions"), (30, '"4,0679" .* is not a number')])
def test_a_number_with_a_digit_too_many_is_no_decimal_comma_beside_millions(tmp_path: Path, n: int, why: str) -> None:
    rows = [(200_000 * i, f"{4_679 - 500 * abs(i - 8):,}") for i in range(n)]
    path = tmp_path / "lab.csv"
    lines = [f'"{t:,}","{100 * i}","{force}"' for i, (t, force) in enumerate(rows)]
    path.write_text("\n".join(['"Time (ms)","Displacement (um)","Force (mN)"', *lines]) + "\n")
    assert read_lab_file(path).columns["force"][8] == pytest.approx(4.679)
    path.write_text(path.read_text().replace('"4,679"', '"4,0679"'))
    with pytest.raises(InputError, match=why):
        read_lab_file(path)


@pytest.mark.parametrize("odd", ["1004265", "23.5"])
def test_millions_beside_numbers_of_another_form_prove_no_thousands(tmp_path: Path, odd: str) -> None:
    path = tmp_path / "lab.csv"
    path.write_text(_quoted_rows([*_IN_MILLIONS[:-1], odd], ["6,988"] * 10))
    with pytest.raises(InputError, match="decimal mark"):
        read_lab_file(path)


@pytest.mark.parametrize("encoding", ["cp1252", "utf-8"])
def test_a_dash_of_windows_is_a_minus_and_its_apostrophe_sets_thousands_apart(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "lab.csv"
    force = [f"{i * 31.7:.1f}" for i in range(N)]
    swiss = [f"{f[:-5]}’{f[-5:]}" if len(f) > 5 else f for f in force]
    rows = [f"{t};–{d};{f}" for t, d, f in zip(TIME, DEPTH, swiss, strict=True)]
    path.write_bytes("\n".join(["Zeit [s];Weg [mm];Kraft [mN]", *rows, ""]).encode(encoding))
    table = read_lab_file(path, Reading())
    assert table.encoding == encoding
    assert table.columns["displacement"].tolist() == pytest.approx([-float(d) * 1e-3 for d in DEPTH])
    assert table.columns["force"].tolist() == pytest.approx([float(f) * 1e-3 for f in force])


@pytest.mark.parametrize(
    ("head", "encoding"),
    [
        ("Time (s);Extension (µm);Load (N)", "latin-1"),
        ("Prüfer: „Meier“ – Halle 3\nZeit (s);Weg (µm);Kraft (N)", "cp1252"),
        ("Время (с);Перемещение (мм);Сила (Н)", "cp1251"),
        ("時間(s);変位(mm);荷重(N)", "cp932"),
        ("日時;変位(mm);荷重(N)", "cp932"),
        ("測定時間(s);変位(mm);荷重(N)", "cp932"),
    ],
)
def test_signs_of_windows_are_read_where_no_other_encoding_makes_more_words(tmp_path: Path, head: str, encoding: str) -> None:
    path = tmp_path / "lab.csv"
    clock = "日時" in head
    stamps = [f"2024/05/02 12:30:{float(t):04.1f}" if clock else t for t in TIME]
    rows = [";".join(row) for row in zip(stamps, DEPTH, DEPTH, strict=True)]
    path.write_bytes("\n".join([head, *rows, ""]).encode(encoding))
    table = read_lab_file(path, Reading())
    assert {"time", "displacement", "force"} <= table.columns.keys()
    assert table.encoding == {"cp932": "shift-jis"}.get(encoding, encoding)
    assert all(ord(c) < 0x80 or ord(c) > 0x9F for c in " ".join((*table.sources.values(), *table.notes)))


@pytest.mark.parametrize("sep", [";", "\t"])
def test_hundreds_of_thousands_may_be_set_apart_as_in_india(tmp_path: Path, sep: str) -> None:
    def indian(n: int) -> str:
        return f"{n // 100_000},{n % 100_000 // 1000:02d},{n % 1000:03d}" if n > 99_999 else f"{n:,}"

    nm = [9700 * i for i in range(N)]
    table = read_lab_file(
        written(tmp_path, f"Time (s){sep}Displacement (nm){sep}Force (N)", TIME, [*map(indian, nm)], DEPTH, sep=sep)
    )
    assert table.columns["displacement"].tolist() == pytest.approx([n * 1e-9 for n in nm])


@pytest.mark.parametrize("odd", ["1,6,600", "01,06,600", "1,06,60", "1.06.600"])
def test_groups_of_no_country_are_no_number(tmp_path: Path, odd: str) -> None:
    cells = [*(f"{9700 * i:,}" for i in range(N - 1)), odd]
    assert odd in refusal(written(tmp_path, "Time (s);Displacement (nm);Force (N)", TIME, cells, DEPTH), Reading(decimal="."))


@pytest.mark.parametrize("nines", ["-999", "999"])
@pytest.mark.parametrize("sep", [",", ";"])
def test_nines_for_no_reading_leave_the_decimal_mark_that_other_columns_show(tmp_path: Path, nines: str, sep: str) -> None:
    cells = [nines if i in (10, 20, 21) else c for i, c in enumerate(CAP)]
    path = written(tmp_path, sep.join(("Time (s)", "Displacement (mm)", "Cp (pF)")), TIME, DEPTH, cells, sep=sep)
    table = read_lab_file(path)
    kept = [i for i in range(N) if i not in (10, 20, 21)]
    assert np.allclose(table.columns["capacitance"][kept], [1e-12 * float(CAP[i]) for i in kept])
    assert all(nines in table.reasons[i] or np.isnan(table.columns["capacitance"][i]) for i in (10, 20, 21))


@pytest.mark.parametrize("whole", [["-998"], ["-999", "512"]])
def test_other_whole_numbers_leave_it_in_doubt(tmp_path: Path, whole: list[str]) -> None:
    cells = [*CAP[:-3], *(whole * 3)[:3]]
    assert "may set thousands apart" in refusal(written(tmp_path, "Time (s);Cp (pF)", TIME, cells))


def test_times_of_day_with_a_decimal_comma_show_that_of_the_numbers(tmp_path: Path) -> None:
    clock = [f"23:59:{40 + i * 24 // 100}.{i * 24 % 100:02d}" for i in range(N)]
    path = written(tmp_path, "Datum;Uhrzeit;Cp (pF)", ["12.03.24"] * N, comma(clock), comma(CAP))
    table = read_lab_file(path)
    assert capacitance(table) == [float(c) for c in CAP]
    assert any("as it is in the times of day" in note for note in table.notes)
    assert not any("is read as a time of day" in note for note in table.notes)  # the date


@pytest.mark.parametrize("mark", [",", "."])
def test_milliseconds_behind_a_comma_or_a_point_show_no_mark(tmp_path: Path, mark: str) -> None:
    clock = [f"23:59:{40 + i * 24 // 100}{mark}{i * 240 % 1000:03d}" for i in range(N)]
    path = written(tmp_path, "Uhrzeit;Cp (pF)", clock, comma(CAP))
    assert "the decimal mark cannot be told" in refusal(path)


@pytest.mark.parametrize("mark", [",", "."])
def test_a_column_that_is_not_read_shows_the_mark_with_a_note(tmp_path: Path, mark: str) -> None:
    cap, warm = ([c.replace(".", mark) for c in cells] for cells in (CAP, [f"{22 + i % 3 / 10:.1f}" for i in range(N)]))
    table = read_lab_file(written(tmp_path, "Time (s);C (pF);Temp (°C)", [str(i) for i in range(N)], cap, warm))
    assert capacitance(table) == [float(c) for c in CAP]
    assert any('as it is in "Temp (°C)"' in note for note in table.notes)


@pytest.mark.parametrize("beside", ["22.1", "22,150", "1,234,567", "22,1 warm", "12,5;13.5"])
def test_a_column_beside_that_shows_another_mark_or_none_tells_nothing(tmp_path: Path, beside: str) -> None:
    cells = [beside.split(";")[i % len(beside.split(";"))] for i in range(N)]
    path = written(tmp_path, "Time (s);C (pF);Temp (°C)", [str(i) for i in range(N)], comma(CAP), cells)
    assert "--decimal" in refusal(path)


def test_columns_beside_that_show_two_marks_tell_nothing(tmp_path: Path) -> None:
    warm, damp = ["22,1"] * N, ["45.2"] * N
    path = written(tmp_path, "Time (s);C (pF);Temp (°C);RH (%)", [str(i) for i in range(N)], comma(CAP), warm, damp)
    assert "--decimal" in refusal(path)


def grouped(numbers: list[int], mark: str) -> list[str]:
    return [f"{n:,}".replace(",", mark) for n in numbers]


MS = [i * 50 for i in range(N)]
DEPTH_UM = [i * 37 for i in range(N)]
FORCE_MN = [round(0.9 * i * i) for i in range(N)]
POSITION_UM = [14250 - um for um in DEPTH_UM]


@pytest.mark.parametrize("sep", [",", ";", "\t"])
@pytest.mark.parametrize(("mark", "other"), [(".", ","), (",", ".")])
@pytest.mark.parametrize("plain_time", [True, False])
def test_a_mark_of_thousands_in_one_column_is_no_decimal_mark_of_another_that_shows_none(
    tmp_path: Path, sep: str, mark: str, other: str, plain_time: bool
) -> None:
    times = list(map(str, MS)) if plain_time else grouped(MS, mark)
    columns = [times, grouped(POSITION_UM, mark), grouped(FORCE_MN, mark)]
    quoted = [[f'"{cell}"' for cell in column] for column in columns]
    path = written(tmp_path, sep.join(["Time (ms)", "Position (µm)", "Force (mN)"]), *quoted, sep=sep)
    said = refusal(path)
    assert "may be the decimal mark, and sets thousands apart in" in said
    assert f'--decimal "{other}" if it sets thousands apart' in said
    table = read_lab_file(path, Reading(decimal=other))
    np.testing.assert_allclose(np.abs(table.columns["displacement"]), np.array(POSITION_UM) * 1e-6)
    np.testing.assert_allclose(table.columns["force"], np.array(FORCE_MN) * 1e-3)


def test_the_mark_that_is_said_is_that_of_open_columns_and_leaves_thousands_that_show(tmp_path: Path) -> None:
    path = written(tmp_path, "Time (ms);Displacement (µm);Cp (pF)", grouped(MS, "."), grouped(DEPTH_UM, "."), CAP)
    assert "Cp (pF)" in refusal(path)
    table = read_lab_file(path, Reading(decimal="."))
    assert capacitance(table) == [float(c) for c in CAP]
    np.testing.assert_allclose(table.columns["displacement"], np.array(DEPTH_UM) * 1e-6)
    assert not any("other columns" in note for note in table.notes)


def test_no_decimal_mark_is_told_of_columns_that_have_thousands_alone(tmp_path: Path) -> None:
    path = written(tmp_path, "Time (ms);Position (µm);Force (N)", grouped(MS, ","), grouped(DEPTH_UM, ","), DEPTH)
    notes = read_lab_file(path, Reading()).notes
    assert sum("sets thousands apart" in note for note in notes) == 2
    assert not any("other columns" in note for note in notes)


@pytest.mark.parametrize("sep", [",", ";"])
def test_thousands_of_a_column_that_is_not_read_leave_the_mark_of_the_others_open(tmp_path: Path, sep: str) -> None:
    count = [f"{990 + i}" if i < 10 else f"1.{i - 10:03}" for i in range(N)]
    head = sep.join(["Scan count", "Time (s)", "Cp (pF)"])
    path = written(tmp_path, head, count, [str(i) for i in range(N)], CAP, sep=sep)
    assert 'sets thousands apart in "Scan count"' in refusal(path)
    count = [str(990 + i) for i in range(N)]
    path = written(tmp_path, ",".join(["Scan count", "Time (s)", "Cp (pF)"]), count, [str(i) for i in range(N)], CAP, sep=",")
    assert capacitance(read_lab_file(path, Reading())) == [float(c) for c in CAP]


# --------------------------------------------------------------------------------------------- thousands and stripped decimals


def _german(value: float) -> str:
    """With a point between thousands, a decimal comma, and without zeros at the end: 1.017,1 and 1.266."""
    return f"{value:,.1f}".removesuffix(".0").translate(str.maketrans(",.", ".,"))


def test_numbers_with_both_marks_show_that_thousands_are_set_apart_in_those_without_decimals(tmp_path: Path) -> None:
    force = [round(i * 61.7, 1) if i % 5 else float(round(i * 61.7)) for i in range(N)]
    written_so = [_german(f) for f in force]
    assert any(c.count(".") == 1 and "," not in c for c in written_so)
    table = read_lab_file(written(tmp_path, "Zeit (s);Weg (mm);Kraft (mN)", comma(TIME), comma(DEPTH), written_so))
    np.testing.assert_allclose(table.columns["force"], 1e-3 * np.array(force))
    assert any("sets thousands apart" in note for note in table.notes)


@pytest.mark.parametrize("odd", ["1266", "1266,5"])
def test_they_do_not_where_another_number_has_its_thousands_together(tmp_path: Path, odd: str) -> None:
    force = [_german(round(i * 61.7, 1) if i % 5 else float(round(i * 61.7))) for i in range(N)]
    force[20] = odd
    assert "decimal mark" in refusal(written(tmp_path, "Zeit (s);Weg (mm);Kraft (mN)", comma(TIME), comma(DEPTH), force))


def test_whole_numbers_beside_thousands_are_asked_about_with_what_to_say(tmp_path: Path) -> None:
    depth = [f"{254 + i * 9021:,}" for i in range(N)]
    rows = [f'{0.2 * i:.3f},"{d}",{0.01 * i:.4f}' for i, d in enumerate(depth)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["Time (s),Depth (nm),Load (N)", *rows]) + "\n")
    assert "--decimal" in refusal(path)
    table = read_lab_file(path, Reading(decimal="."))
    np.testing.assert_allclose(table.columns["displacement"], 1e-9 * (254 + 9021 * np.arange(N)))


@pytest.mark.parametrize("rows", [slice(1, None, 2), slice(20, None), slice(7, 14)])
@pytest.mark.parametrize("digits", [2, 4])
def test_a_mark_that_changes_within_a_column_is_read_where_each_cell_shows_its_own(
    tmp_path: Path, rows: slice, digits: int
) -> None:
    cells = [f"{97.301 + 0.0137 * i * i:.{digits}f}" for i in range(N)]
    mixed = list(cells)
    mixed[rows] = comma(cells)[rows]
    path = written(tmp_path, "Time (s);Cp (pF)", TIME, mixed)
    assert 'If each cell has a decimal mark of its own, --decimal "." reads it' in refusal(path)
    table = read_lab_file(path, Reading(decimal="."))
    assert capacitance(table) == [float(c) for c in cells]
    assert any("has another decimal mark than most cells" in note for note in table.notes)


@pytest.mark.parametrize("odd", ["97,123", "1,097.12", "1,097,123"])
def test_a_mark_that_changes_is_refused_where_one_may_set_thousands_apart(tmp_path: Path, odd: str) -> None:
    cells = [f"{97.301 + 0.0137 * i * i:.4f}" for i in range(N)]
    cells[9], cells[10] = "97,1234", odd
    assert "the decimal mark cannot be told" in refusal(written(tmp_path, "Time (s);Cp (pF)", TIME, cells))


def test_exponents_of_fortran_are_read_with_a_note(tmp_path: Path) -> None:
    cells = [f"{float(c):.4E}".replace("E", "D") for c in CAP]
    table = read_lab_file(written(tmp_path, "Time (s);Cp (pF)", TIME, cells))
    np.testing.assert_allclose(capacitance(table), [float(c) for c in CAP], rtol=1e-4)
    assert f'exponents as Fortran writes them are read, as in "{cells[0]}"' in table.notes


@pytest.mark.parametrize(("mark", "other"), [(".", ","), (",", ".")])
def test_a_mark_that_the_file_contradicts_is_refused_and_the_other_reads_it(tmp_path: Path, mark: str, other: str) -> None:
    time, cap = ([c.replace(".", mark) for c in column] for column in (TIME, CAP))
    path = written(tmp_path, "Time (s);Cp (pF)", time, cap)
    message = refusal(path, Reading(decimal=other))
    assert "was asked for, the file shows another" in message
    assert f'--decimal "{mark}"' in message
    assert capacitance(read_lab_file(path, Reading(decimal=mark))) == [float(c) for c in CAP]


def test_thousands_by_the_mark_that_was_asked_for_are_told(tmp_path: Path) -> None:
    path = written(tmp_path, "Time (s);Cp (pF)", TIME, comma(CAP))
    assert "sets thousands apart, as the decimal mark that was asked for says" in " ".join(
        read_lab_file(path, Reading(decimal=".")).notes
    )


def test_three_decimals_of_a_mark_that_changes_are_read_if_the_numbers_go_on(tmp_path: Path) -> None:
    half = N // 2
    time, depth, cap = ([*column[:half], *comma(column[half:])] for column in (TIME, DEPTH, CAP))
    path = written(tmp_path, "Time (s);Displacement (mm);Cp (pF)", time, depth, cap)
    assert '--decimal "."' in refusal(path)
    assert capacitance(read_lab_file(path, Reading(decimal="."))) == [float(c) for c in CAP]
    far = [*cap[:half], *(f"{float(c) / 10:.3f}".replace(".", ",") for c in CAP[half:])]
    far_apart = written(tmp_path, "Time (s);Displacement (mm);Cp (pF)", time, depth, far)
    assert "decimal mark" in refusal(far_apart, Reading(decimal="."))

"""What is read of a lab file, and what is refused, on hand-made tables with known numbers and on real exports."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st

from calib.errors import InputError
from calib.lab.instruments.columns import read_columns
from calib.lab.instruments.families import FAMILIES, discover
from calib.lab.instruments.labtable import AS_FOUND, LabTable, Reading
from calib.lab.instruments.reader import read_lab_file
from calib.lab.instruments.text import read_lab_text

LABDATA = Path(__file__).resolve().parents[4] / "shared" / "labdata"
needs_labdata = pytest.mark.skipif(not LABDATA.is_dir(), reason="the folder of real lab files is not here")

BLUEHILL = (
    'Text Inputs : Specimen label,"s 1"\r\nGeneral : Start Date,13/11/2018\r\n\r\nTime,Extension,Load\r\n(s),(mm),(N)\r\n'
)


def read(tmp_path: Path, text: str | bytes, name: str = "lab.csv") -> LabTable:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_lab_file(path)


def refused(tmp_path: Path, text: str | bytes) -> InputError:
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    for fault in caught.value.faults:
        assert fault.path == tmp_path / "lab.csv"
    return caught.value


# ---------------------------------------------------------------------------------------------------------- Bluehill


def test_bluehill_with_header_block_is_read_in_si_with_its_own_signs(tmp_path: Path) -> None:
    table = read(tmp_path, BLUEHILL + "0.00000,-2.04726,-4.31900\r\n0.02000,-2.05730,-4.37385\r\n")
    assert table.recognised_as == "Instron Bluehill raw data"
    assert "Extension" in table.reason
    assert "Text Inputs" in table.reason
    np.testing.assert_array_equal(table.columns["time"], [0.0, 0.02])
    np.testing.assert_array_equal(table.columns["displacement"], [-2.04726e-3, -2.0573e-3])
    np.testing.assert_array_equal(table.columns["force"], [-4.319, -4.37385])
    assert dict(table.sources) == {"time": "Time (s)", "displacement": "Extension (mm)", "force": "Load (N)"}
    np.testing.assert_array_equal(table.lines, [6, 7])
    assert table.reasons == ("", "")
    assert len(table.sha256) == 64


def test_units_inside_the_names_and_columns_in_any_order(tmp_path: Path) -> None:
    table = read(tmp_path, "Compressive load (kN),Time (ms),Compressive extension (um)\n0.001,20,5\n0.002,40,7\n")
    assert table.recognised_as == "Instron Bluehill raw data"
    np.testing.assert_allclose(table.columns["force"], [1, 2], rtol=1e-15)
    np.testing.assert_array_equal(table.columns["time"], [0.02, 0.04])
    np.testing.assert_array_equal(table.columns["displacement"], [5e-6, 7e-6])


def test_bluehill_universal_export_with_specimen_number_and_thousands_separators(tmp_path: Path) -> None:
    text = (
        '\n1,Time,Displacement,Force\n,(s),(mm),(kN)\n"","999.98000","0.0072","0.0009"\n"","1,000.06200","-0.0001","0.0005"\n'
    )
    table = read(tmp_path, text)
    assert "specimen number 1" in table.reason
    np.testing.assert_array_equal(table.columns["time"], [999.98, 1000.062])
    np.testing.assert_allclose(table.columns["force"], [0.9, 0.5], rtol=1e-15)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "latin-1"])
def test_every_encoding_gives_the_same_numbers(tmp_path: Path, encoding: str) -> None:
    text = "Prüfer;Weiß\nZeit;Traversenweg;Kraft\n(s);(µm);(N)\n0,5;12,25;-0,125\n1,0;13,5;-0,25\n"
    table = read(tmp_path, text.encode(encoding))
    assert table.encoding == encoding
    assert (table.delimiter, table.decimal) == (";", ",")
    np.testing.assert_allclose(table.columns["displacement"], [12.25e-6, 13.5e-6], rtol=1e-15)
    np.testing.assert_array_equal(table.columns["force"], [-0.125, -0.25])


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    rows=st.lists(
        st.tuples(st.integers(0, 9_999_999), st.integers(-99_999, 99_999), st.integers(-99_999, 99_999)), min_size=2, max_size=8
    ).map(sorted),  # by time, which from 57 s to 1 s would have changed its unit
    notation=st.sampled_from([(",", "."), (";", ","), (";", "."), ("\t", "."), ("\t", ",")]),
    length=st.sampled_from([("mm", 1e-3), ("um", 1e-6), ("in", 0.0254), ("cm", 1e-2)]),
    load=st.sampled_from([("N", 1.0), ("kN", 1e3), ("mN", 1e-3)]),
    quoted=st.booleans(),
    newline=st.sampled_from(["\n", "\r\n"]),
)
@example(
    rows=[(164, 0, 0), (233, 0, 0), (59216, 0, 0), (76975, 0, 0)],
    notation=(",", "."),
    length=("mm", 1e-3),
    load=("N", 1.0),
    quoted=False,
    newline="\n",
)
def test_what_is_written_in_the_bluehill_layout_is_read_back(
    tmp_path: Path,
    rows: list[tuple[int, int, int]],
    notation: tuple[str, str],
    length: tuple[str, float],
    load: tuple[str, float],
    quoted: bool,
    newline: str,
) -> None:
    delimiter, decimal = notation
    quote = '"' if quoted else ""

    def line(cells: list[str]) -> str:
        return delimiter.join(f"{quote}{c}{quote}" for c in cells) + newline

    text = line(["Time", "Extension", "Load"]) + line(["(s)", f"({length[0]})", f"({load[0]})"])
    for t, x, f in rows:
        text += line([c.replace(".", decimal) for c in (f"{t / 1e5:.5f}", f"{x / 1e4:.4f}", f"{f / 1e5:.5f}")])
    path = tmp_path / "lab.csv"
    path.write_text(text, encoding="utf-8", newline="")
    try:
        table = read_lab_file(path, Reading(scale="micro"))  # readings of any size
    except InputError as error:
        assume("If a unit or a range was switched there" not in str(error))  # which a few random readings may look like
        raise
    expected = np.array(rows, dtype=float) / [1e5, 1e4, 1e5] * [1.0, length[1], load[1]]
    for quantity, column in zip(("time", "displacement", "force"), expected.T, strict=True):
        there = np.isfinite(table.columns[quantity])
        np.testing.assert_allclose(table.columns[quantity][there], column[there], rtol=1e-14)
        # A number may only be missing where its neighbours contradict it by a power of ten, as a lost decimal mark does.
        assert all("neighbours" in reason for reason, here in zip(table.reasons, there, strict=True) if not here)


# --------------------------------------------------------------------------------------------------------------- LCR


def test_lcr_log_is_read_and_bad_status_makes_rows_unusable(tmp_path: Path) -> None:
    table = read(tmp_path, "Time (s),Cp (pF),D,Status\n0.0,97.301,0.012,0\n0.1,97.302,0.012,1\n0.2,9.9E37,0.012,0\n")
    assert table.recognised_as == "LCR log"
    np.testing.assert_allclose(table.columns["capacitance"][:2], [97.301e-12, 97.302e-12], rtol=1e-15)
    assert np.isnan(table.columns["capacitance"][2])
    assert table.reasons == ("", "LCR status 1", "over-range 9.9E37")


@pytest.mark.parametrize("code", ["-1.0E+30", "1E+30", "9.99999E+28", "-9.99E+30", "3.4028235E+38", "1e20", "9.9E37"])
@pytest.mark.parametrize("run", [1, 2, 5])
@pytest.mark.parametrize("column", [1, 2, 3])
def test_powers_of_ten_that_no_measurement_reaches_are_no_readings(tmp_path: Path, code: str, run: int, column: int) -> None:
    way = np.round(1.0 - np.abs(np.linspace(-1.0, 1.0, 100)), 4)
    rows = [[f"{0.1 * k:.1f}", f"{x:.4f}", f"{3 * x**1.5:.4f}", f"{97 + 2 * x**1.4:.4f}"] for k, x in enumerate(way.tolist())]
    lost = [*range(30, 30 + run), 70]
    for k in lost:
        rows[k][column] = code
    table = read(tmp_path, "\n".join(["Time (s),Displacement (mm),Force (N),Cp (pF)", *map(",".join, rows)]) + "\n")
    assert [k for k, why in enumerate(table.reasons) if why] == lost
    assert {why for why in table.reasons if why} == {f"{'no reading,' if code[0] == '-' else 'over-range'} {code}"}


@pytest.mark.parametrize("sentinel", ["9.9E37", "9.90000E+37", "999999", "OVER", "OV01", "ERR", "Err.4", "+OL", "FAIL"])
def test_every_sentinel_becomes_an_unusable_row(tmp_path: Path, sentinel: str) -> None:
    table = read(tmp_path, f"Force (N),CP[F],D\n0.5,9.7E-11,0.01\n0.6,{sentinel},0.01\n0.7,9.8E-11,0.01\n")
    assert np.isnan(table.columns["capacitance"][1])
    assert table.reasons == ("", f"over-range {sentinel}", "")


def test_series_capacitance_becomes_parallel_with_the_dissipation(tmp_path: Path) -> None:
    table = read(tmp_path, "Time (s),Cs [F],D\n0,1.04E-10,0.2\n1,1.04E-10,0\n")
    np.testing.assert_allclose(table.columns["capacitance"], [1e-10, 1.04e-10], rtol=1e-12)
    assert any("1 + D^2" in note for note in table.notes)


def test_series_capacitance_without_dissipation_is_refused(tmp_path: Path) -> None:
    assert "series capacitance" in str(refused(tmp_path, "Time (s),Cs (pF)\n0,97\n1,98\n"))


def test_a_capacitance_logged_at_a_lower_rate_leaves_the_other_rows_usable(tmp_path: Path) -> None:
    rows = "".join(f"{i},{i * 0.1},{i * 0.2},{97 + i if i % 5 == 0 else ''}\n" for i in range(10))
    table = read(tmp_path, "Time (s),Extension (mm),Load (N),Cp (pF)\n" + rows)
    assert table.recognised_as == "table with a header"
    assert not any(table.reasons)
    assert np.sum(np.isfinite(table.columns["capacitance"])) == 2


def test_letters_with_two_meanings_are_told_apart_by_their_unit(tmp_path: Path) -> None:
    table = read(tmp_path, "t (s),d (mm),F (N),f (kHz),Cp (pF),D\n0,0.1,1,1,97,0.01\n1,0.2,2,1,98,0.01\n")
    assert set(table.columns) == {"time", "displacement", "force", "frequency", "capacitance", "dissipation"}
    assert table.columns["frequency"][0] == 1000.0


# ------------------------------------------------------------------------------------------------- tables, real files


def test_of_two_force_columns_the_raw_one_is_taken_and_noted(tmp_path: Path) -> None:
    text = (
        "Well,E5\r\nBaseline_Force(N),0.459\r\n\r\nTimestamp(s),Z_Position(mm),Corrected_Force(N),Raw_Force(N)\r\n"
        "1.5,-74.01,0.004,0.463\r\n1.6,-74.02,0.001,0.460\r\n\r\nTotal_Measurement_Time(s),65.677\r\n"
    )
    table = read(tmp_path, text)
    np.testing.assert_array_equal(table.columns["force"], [0.463, 0.46])
    assert any("Raw_Force" in n and "Corrected_Force" in n for n in table.notes)
    assert any("Total_Measurement_Time" in n for n in table.notes)


def test_the_programs_own_observations_are_read_back(tmp_path: Path) -> None:
    table = read(
        tmp_path, "time_s,displacement_m,force_N,branch,used,reason\n0.0,1e-4,0.3,loading,True,\n0.1,2e-4,0.4,loading,True,\n"
    )
    np.testing.assert_array_equal(table.columns["displacement"], [1e-4, 2e-4])


@needs_labdata
@pytest.mark.parametrize(
    ("name", "family", "rows", "first_force", "last_displacement"),
    [
        ("instron/i05_bh2_ccyclic_headerblock_crlf.csv", "Instron Bluehill raw data", 1495, -4.319, -7.02018e-3),
        ("instron/i09_bhu_exports_quoted_kN_blankfirstcol.csv", "Instron Bluehill raw data", 4041, 0.5, -3e-7),
        ("p1_ecoflex_compression/EF30_0T_A1.csv", "table with a header", 1202, 0.02275, 20.00007e-3),
        ("p3_asmi_sphere_indentation/well_E5_20251030_122001.csv", "table with a header", 358, 0.463, -77.58e-3),
    ],
)
def test_real_files_are_read(name: str, family: str, rows: int, first_force: float, last_displacement: float) -> None:
    table = read_lab_file(LABDATA / name)
    assert table.recognised_as == family
    assert len(table.lines) == len(table.reasons) == rows
    assert not any(table.reasons)
    assert table.columns["force"][0] == pytest.approx(first_force, rel=1e-12)
    assert table.columns["displacement"][-1] == pytest.approx(last_displacement, rel=1e-9)


@needs_labdata
@pytest.mark.parametrize(
    "name",
    [
        "p1_ecoflex_compression/phantoms_table_v1.csv",
        "p3_asmi_sphere_indentation/summary.csv",
        "p3_asmi_sphere_indentation/E5_summary.txt",
        "p3_asmi_sphere_indentation/well_heatmap_spring_constant_data.csv",
    ],
)
def test_real_tables_of_something_else_are_refused(name: str) -> None:
    with pytest.raises(InputError, match=r"understood|no table is found"):
        read_lab_file(LABDATA / name)


def test_a_hundred_thousand_rows_are_read_in_about_a_second(tmp_path: Path) -> None:
    rows = "".join(f"{i * 0.001:.5f},{-i * 1e-5:.5f},{-i * 5e-5:.5f}\n" for i in range(100_000))
    start = time.process_time()
    table = read(tmp_path, BLUEHILL.replace("\r\n", "\n") + rows)
    assert time.process_time() - start < 3  # 0.5 s on an idle machine
    assert table.lines.size == 100_000


def test_a_name_of_thousands_of_words_is_refused_soon(tmp_path: Path) -> None:
    path = tmp_path / "names.csv"
    path.write_text("Time;" + "1 " * 5000 + "Extension;Load\n(s);(mm);(N)\n" + "0.5;-0.02;-0.04\n" * 5)
    start = time.process_time()
    with pytest.raises(InputError, match="no displacement column"):
        read_lab_file(path)
    assert time.process_time() - start < 2  # 0.2 s on an idle machine


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("quote", ["", '"'])
def test_a_few_odd_rows_among_thousands_change_no_other_row(tmp_path: Path, delimiter: str, quote: str) -> None:
    cells = [[f"{i * 0.01:.2f}", f"{i * 1e-4:.5f}", f"{i * 1e-3:.3f}"] for i in range(3000)]
    rows = [delimiter.join(f"{quote}{c}{quote}" for c in row) for row in cells]
    rows[700] = delimiter.join(cells[700][:2])  # a cell missing at the end
    rows[900] += delimiter * 2  # two too many, empty
    rows[1100] = delimiter.join(["", *cells[1100][1:]])  # no time
    rows[1500] = ""
    rows[1501] = delimiter * 2
    text = delimiter.join(("Time (s)", "Extension (mm)", "Load (N)")) + "\n" + "\n".join(rows)
    table = read(tmp_path, f"{text}\nEnd of record\n")
    line = [i + 2 for i in range(3000) if i not in (1500, 1501)]
    np.testing.assert_array_equal(table.lines, line)
    told = {int(n): reason for n, reason in zip(table.lines, table.reasons, strict=True) if reason}
    assert told == {702: "empty cell: force", 1102: "empty cell: time"}
    good = np.array([not r for r in table.reasons])
    np.testing.assert_allclose(table.columns["force"][good], (table.lines[good] - 2) * 1e-3, atol=1e-12)
    np.testing.assert_allclose(table.columns["time"][good], (table.lines[good] - 2) * 0.01, atol=1e-9)
    assert any('"End of record" (line 3002)' in note for note in table.notes)
    # What is no row is refused however many rows stand around it.
    head = text.split("\n", 1)[0]
    for row, said in (
        (delimiter.join(("away", "from", "desk")), "stands among the rows"),
        (delimiter.join((*cells[2000], "7.5")), "has 4 cells"),
    ):
        rows[2000] = row
        error = refused(tmp_path, "\n".join((head, *rows)))
        assert error.faults[0].line == 2002
        assert said in str(error)


def test_times_of_day_pass_midnight_and_miss_some_rows(tmp_path: Path) -> None:
    stamps = [
        f"2024-05-02 {(86_390 + i) // 3600 % 24:02d}:{(86_390 + i) // 60 % 60:02d}:{(86_390 + i) % 60:02d}.5" for i in range(20)
    ]
    stamps[3], stamps[5] = "", "11:59:55,5 pm"
    table = read(tmp_path, "Time;Extension (mm);Load (N)\n" + "".join(f"{t};0.{i:03d};1\n" for i, t in enumerate(stamps)))
    expected = 86_390.5 + np.arange(20.0)
    expected[3] = np.nan
    np.testing.assert_array_equal(table.columns["time"], expected)
    assert table.reasons[3] == "empty cell: time"
    stamps[7] = "24:10:00"
    text = "Time;Extension (mm);Load (N)\n" + "".join(f"{t};0.{i:03d};1\n" for i, t in enumerate(stamps))
    assert '"24:10:00" in column "Time" is not a number' in str(refused(tmp_path, text))


@pytest.mark.parametrize("late", [9, 10, 11])
def test_rows_out_of_order_over_midnight_add_no_day(tmp_path: Path, late: int) -> None:
    stamps = [f"{(86_390 + i) // 3600 % 24:02d}:{(86_390 + i) // 60 % 60:02d}:{(86_390 + i) % 60:02d}" for i in range(40)]
    stamps[late], stamps[late + 1] = stamps[late + 1], stamps[late]
    table = read(tmp_path, "Time,Extension (mm),Load (N)\n" + "".join(f"{t},0.{i:03d},1\n" for i, t in enumerate(stamps)))
    times = table.columns["time"]
    assert np.all(times[: late - 1] == 86_390 + np.arange(late - 1))
    assert np.all(times[late + 2 :] == 86_390 + np.arange(late + 2, 40))
    assert np.nanmax(times) < 86_440


# ----------------------------------------------------------------------------------------------------------- refusals


def test_text_in_number_cells_is_refused_with_line_column_and_value(tmp_path: Path) -> None:
    error = refused(tmp_path, "Time,Extension,Load\n(s),(mm),(N)\n0,0.1,1.0\n1,abc,1.1\n2,0.3,1.2x\n")
    assert [(f.line, f.column) for f in error.faults] == [(4, 2), (5, 3)]
    assert '"abc"' in str(error)
    assert '"1.2x"' in str(error)


def test_many_faults_are_capped_with_their_count(tmp_path: Path) -> None:
    error = refused(tmp_path, BLUEHILL + "".join(f"{i},bad,1\n" for i in range(25)))
    assert len(error.faults) == 11
    assert "25 cells" in str(error.faults[-1])


def test_empty_cells_make_unusable_rows_with_a_reason(tmp_path: Path) -> None:
    table = read(tmp_path, BLUEHILL + "0,0.1,1\n1,,1.1\n2,0.3,\n3,0.4\n4,0.5,1.5\n5,0.6,1.6\n6,0.7,1.7\n,,\n")
    assert table.reasons[:5] == ("", "empty cell: displacement", "empty cell: force", "empty cell: force", "")
    assert np.isnan(table.columns["displacement"][1])
    assert table.lines.size == 7


def test_a_column_without_a_unit_is_refused_with_advice(tmp_path: Path) -> None:
    error = refused(tmp_path, "Time (s),Extension,Load (N)\n0,0.1,1\n1,0.2,2\n")
    assert error.faults[0].column == 2
    assert "Extension (mm)" in error.faults[0].advice


@pytest.mark.parametrize(
    ("unit", "message"),
    [
        ("furlongz", "unknown unit"),
        ("gr", 'unit "gr" of force, did you mean gf.*--units force=gf'),
        ("PF", "unknown|converted"),
    ],
)
def test_a_unit_that_is_unknown_or_of_something_else_is_refused(tmp_path: Path, unit: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read(tmp_path, f"Time,Extension,Load\n(s),(mm),({unit})\n0,0.1,1\n1,0.2,2\n")
    assert [(f.line, f.column) for f in caught.value.faults] == [(2, 3)]


def test_two_units_for_one_column_must_agree(tmp_path: Path) -> None:
    assert "in its name" in str(refused(tmp_path, "Time (s),Extension (mm),Load (N)\n(s),(m),(N)\n0,0.1,1\n1,0.2,2\n"))


def test_all_faults_of_a_header_come_at_once(tmp_path: Path) -> None:
    error = refused(tmp_path, "Time,Extension,Load,Load\n(s),(mm),(lumps),(N)\n0,x,1,1\n1,0.2,2,2\n")
    text = str(error)
    assert "appears twice" in text
    assert "lumps" in text
    assert '"x"' in text


def test_a_missing_column_names_what_was_found_and_what_is_understood(tmp_path: Path) -> None:
    text = str(refused(tmp_path, "Time,Extension\n(s),(mm)\n0,0.1\n1,0.2\n"))
    assert "no force column" in text
    assert '"Extension"' in text
    assert '"load"' in text


def test_a_file_without_known_names_shows_its_header(tmp_path: Path) -> None:
    text = str(refused(tmp_path, "a,b\n1,2\n3,4\n"))
    assert '"a"' in text
    assert "Load (N)" in text


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "empty"),
        (b"\xef\xbb\xbf\r\n", "empty"),
        (b"PK\x03\x04\x00\x00\x81\x82", "not text"),
        (b"Time,Load\n(s),(N)\n", "no row"),
    ],
)
def test_files_without_rows_are_refused(tmp_path: Path, content: bytes, message: str) -> None:
    assert message in str(refused(tmp_path, content))


def test_a_missing_file_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot read"):
        read_lab_file(tmp_path / "nothing.csv")


def test_one_comma_that_may_be_either_mark_is_refused(tmp_path: Path) -> None:
    error = refused(tmp_path, "Time (s);Extension (mm);Load (N)\n1;1,250;2\n2;1,500;3\n")
    assert "decimal mark cannot be told" in str(error)
    assert (error.faults[0].line, error.faults[0].column) == (2, 2)


def test_both_decimal_marks_in_one_file_are_refused_not_repaired(tmp_path: Path) -> None:
    error = refused(tmp_path, "Time (s);Extension (mm);Load (N)\n0.5;0,9966;2.25\n1.5;10,114;3.5\n")
    assert '"0,9966" (line 2' in str(error)


def test_a_decimal_comma_between_commas_is_refused(tmp_path: Path) -> None:
    error = refused(tmp_path, "Time (s),Extension (mm),Load (N)\n0,5,0,1,1,0\n1,0,0,2,2,0\n")
    assert "6 cells" in str(error)
    assert "semicolons" in str(error)


def test_two_specimens_in_a_file_are_refused_until_one_is_chosen(tmp_path: Path) -> None:
    text = BLUEHILL + "0,1,2\n1,2,3\nTime,Extension,Load\n(s),(mm),(N)\n0,1,2\n1,2,4\n"
    assert "holds 2 specimens" in str(refused(tmp_path, text))
    table = read_lab_file(tmp_path / "lab.csv", Reading(specimen=2))
    np.testing.assert_array_equal(table.columns["force"], [2.0, 4.0])
    np.testing.assert_array_equal(table.lines, [10, 11])


def test_a_line_among_the_rows_is_refused_also_above_a_table_of_results(tmp_path: Path) -> None:
    results = "Load (N),Extension (mm)\n5.5,0.7\n"
    rows = "Time (s),Extension (mm),Load (N)\n0,0.1,1\n1,0.2,2\n"
    table = read(tmp_path, rows + "operator,away\n" + results)
    assert [any(word in note for note in table.notes) for word in ("operator,away", "a table of 1 row(s)")] == [True, True]
    assert '"operator,away" stands among the rows' in str(refused(tmp_path, rows + "operator,away\n2,0.3,3\n" + results))


# ------------------------------------------------------------------------------------------------------------ families


def test_families_are_asked_in_the_order_of_their_priorities() -> None:
    order = [
        "Hioki LCR meter",
        "Keysight LCR meter",
        "GW Instek LCR meter",
        "LCR log",
        "MTS",
        "ZwickRoell testXpert",
        "Mecmesin",
        "Instron WaveMatrix",
        "Instron Bluehill raw data",
        "table with a header",
    ]
    assert [f.name for f in FAMILIES if f.name in order] == order
    assert FAMILIES[-1].name == order[-1]
    assert len({f.priority for f in FAMILIES}) == len(FAMILIES)


READER = """
from dataclasses import replace

from calib.lab.instruments.cut import cut as cut_table
from calib.lab.instruments.family import InstrumentFamily, channels, line_above, needs

HEADER = {"displacement": "Stempelvej (mm)", "force": "Trykkraft (N)"}


def cut(text, reading):
    if not any("Presskraft" in line for line in text.lines[:5]):
        return None
    return cut_table(text, replace(reading, columns={**HEADER, **reading.columns}))


def recognise(sheet):
    above = line_above(sheet, "presskraft")
    return f'"{above[1]}" in line {above[0]}; {channels(sheet)}' if above else ""


FAMILY = InstrumentFamily("Presskraft", 45, recognise, needs("displacement", "force"), verified=False, cut=cut)
"""


def test_a_reader_with_words_of_its_own_is_one_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "more_families"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "presskraft.py").write_text(READER)
    (folder / "late.py").write_text(READER.replace('"Presskraft", 45', '"Late", 46'))
    monkeypatch.syspath_prepend(tmp_path)
    family, later = discover([str(folder)], "more_families")
    assert (family.name, later.name) == ("Presskraft", "Late")
    path = tmp_path / "p.csv"
    path.write_text(
        "Presskraft 3000\nStempelvej (mm);Trykkraft (N)\n" + "".join(f"{i / 10};{i * i / 7:.3f}\n" for i in range(9))
    )
    assert read_lab_file(path).recognised_as != "Presskraft"
    assert family.cut is not None
    sheet = family.cut(read_lab_text(path), AS_FOUND)
    assert sheet is not None
    table = read_columns(sheet, family, family.recognise(sheet), AS_FOUND)
    assert table.reason == '"Presskraft 3000" in line 1; channels Stempelvej (mm), Trykkraft (N) in line 2'
    assert table.columns["displacement"][-1] == pytest.approx(0.8e-3)
    assert table.columns["force"][-1] == pytest.approx(64 / 7, abs=1e-3)

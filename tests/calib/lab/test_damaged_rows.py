"""Damage that real files showed once they were changed on purpose: each is left out, refused, or read as it should be."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, observe, read_lab_file

N = 60
X = np.linspace(0.0, 1.0, N)
F = 6.0 * X**1.7 + 0.2
HEAD = "Time (s),Extension (mm),Load (N)"


def rows(force: np.ndarray | None = None) -> list[str]:
    return [f"{0.1 * i:.1f},{x:.5f},{f:.4f}" for i, (x, f) in enumerate(zip(X, F if force is None else force, strict=True))]


def read(folder: Path, lines: list[str], head: str = HEAD) -> LabTable:
    (folder / "a.csv").write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    return read_lab_file(folder / "a.csv")


@pytest.mark.parametrize("row", [0, N - 1, 20])
@pytest.mark.parametrize("power", [10.0, 100.0, 0.1])
def test_a_number_off_by_a_power_of_ten_is_left_out_at_the_ends_too(tmp_path: Path, row: int, power: float) -> None:
    force = F.copy()
    force[row] *= power
    table = read(tmp_path, rows(force))
    assert "factor" in table.reasons[row]
    assert sum(map(bool, table.reasons)) == 1


def _pulled_off(last: str) -> list[str]:
    """A press whose ball sticks as it is drawn back, and its last row."""
    noise = 0.001 * np.sin(37.0 * np.arange(N)) + 0.0005 * np.cos(11.0 * np.arange(N))
    depth = np.concatenate([X[::2], X[::-2]])
    pull = np.where(np.arange(N) < N // 2, 0.0, -0.036)
    lines = [
        f"{0.1 * i:.1f},{x:.5f},{2 * x**1.5 + p + e:.4f}" for i, (x, p, e) in enumerate(zip(depth, pull, noise, strict=True))
    ]
    ends = [f"{0.1 * (N + i):.1f},{0.0002 * (3 - i):.5f},{f}" for i, f in enumerate(("-0.0371", "-0.0383", "-0.0358", last))]
    return [*lines, *ends]


@pytest.mark.parametrize("last", ["-0.0003", "-0.0004", "-0.0036", "0.0002"])
def test_the_first_reading_after_the_ball_came_off_is_about_zero_and_off_by_no_factor(tmp_path: Path, last: str) -> None:
    assert not any(read(tmp_path, _pulled_off(last)).reasons)


@pytest.mark.parametrize("last", ["-0.360", "-3.6000", "-0.000358"])
def test_a_last_reading_of_a_pull_that_is_not_about_zero_as_written_is_left_out(tmp_path: Path, last: str) -> None:
    assert "factor" in read(tmp_path, _pulled_off(last)).reasons[-1]


def test_whole_numbers_that_begin_with_a_zero_have_lost_their_marks(tmp_path: Path) -> None:
    lines = [f"{0.1 * i:.1f},{x:.5f},{round(1e3 * f):04d}" for i, (x, f) in enumerate(zip(X, F, strict=True))]
    with pytest.raises(InputError, match="begins with a zero"):
        read(tmp_path, lines)


@pytest.mark.parametrize("stray", ["-0.52542", "3.1"])
def test_a_mark_in_a_single_cell_is_not_that_of_a_column_that_lost_its_own(tmp_path: Path, stray: str) -> None:
    lines = [f"{round(1e5 * 0.14 * i):06d},{x:.5f},{f:.4f}" for i, (x, f) in enumerate(zip(X, F, strict=True))]
    lines[50] = f"{stray}," + lines[50].split(",", 1)[1]
    with pytest.raises(InputError, match="lost their decimal mark"):
        read(tmp_path, lines)


@pytest.mark.parametrize("zero", [0.0, -0.7, -3.0])
@pytest.mark.parametrize("row", [20, 30, N - 2])
def test_a_whole_number_where_all_others_have_decimals_is_left_out_beside_a_change_of_sign_too(
    tmp_path: Path, zero: float, row: int
) -> None:
    force = 0.4631 + zero - np.where(X > 0.3, 40.0 * np.maximum(X - 0.3, 0.0) ** 1.5, 0.0)
    lines = rows(force)
    time, x, f = lines[row].split(",")
    lines[row] = f"{time},{x},{f.replace('.', '')}"
    table = read(tmp_path, lines)
    assert "decimal mark" in table.reasons[row] or "factor" in table.reasons[row]
    assert sum(map(bool, table.reasons)) == 1


def test_whole_numbers_of_a_column_that_leaves_zeros_out_are_read(tmp_path: Path) -> None:
    lines = [f"{0.1 * i:.1f},{x:.5f},{round(9.0 * x, 1):g}" for i, x in enumerate(X)]
    table = read(tmp_path, lines)
    assert not any(table.reasons)


def test_a_row_without_its_last_cell_or_with_one_too_many_is_left_out(tmp_path: Path) -> None:
    lines = [f"{line},23.5" for line in rows()]
    lines[0] = ",".join(lines[0].split(",")[1:]) + ","
    table = read(tmp_path, lines, f"{HEAD},T (°C)")
    assert table.reasons[0] == "no cell in the last column"
    assert not any(table.reasons[1:])
    lines = [f"{line}," for line in rows()]
    lines[7] = lines[7].replace(",", ",0.5,", 1)[:-1]
    table = read(tmp_path, lines, f"{HEAD},")
    assert "more cells" in table.reasons[7]


def test_a_line_of_averages_below_the_rows_is_no_row(tmp_path: Path) -> None:
    table = read(tmp_path, [*rows(), "Average,0.5,2.1"], "Run,Extension (mm),Load (N)")
    assert len(table.lines) == N
    assert any("Average" in str(u) for u in table.unread)


@pytest.mark.parametrize("names", [("Mean", "StdDev", "Max"), ("Mittelwert",), ("Average", "Std. dev.")])
def test_results_below_the_rows_with_their_names_in_front_are_no_rows(tmp_path: Path, names: Sequence[str]) -> None:
    table = read(tmp_path, [*rows(), *(f"{name},2.95,0.5,2.1" for name in names)])
    assert len(table.lines) == N
    assert not any(table.reasons)
    assert any(names[0] in str(u) for u in table.unread)


@pytest.mark.parametrize("first", ["calm", "7"])
def test_last_rows_with_a_cell_too_many_that_are_no_results_are_refused(tmp_path: Path, first: str) -> None:
    with pytest.raises(InputError, match="cells"):
        read(tmp_path, [*rows(), *[f"{first},2.95,0.5,2.1"] * 3])


def test_bars_and_the_tables_of_r_are_cut(tmp_path: Path) -> None:
    for head, mark in (("Time (s)|Extension (mm)|Load (N)", "|"), ('"Time (s)" "Extension (mm)" "Load (N)"', " ")):
        table = read(tmp_path, [line.replace(",", mark) for line in rows()], head)
        np.testing.assert_allclose(table.columns["force"], F, atol=1e-4)


def test_thousands_set_apart_in_some_numbers_only_are_refused(tmp_path: Path) -> None:
    lines = [f"{0.1 * i:.1f};{97.5 + 0.001 * i:.3f}".replace("97.", "97,") for i in range(N)]
    lines[9] = lines[9].replace(",", "")
    with pytest.raises(InputError, match="thousands"):
        read(tmp_path, lines, "Time (s);Cp (pF)")


@pytest.mark.parametrize("row", [1, 3, 20, N - 8, N - 6, N - 3])
def test_a_spike_of_two_rows_turns_no_sign(tmp_path: Path, row: int) -> None:
    force = F.copy()
    force[row : row + 2] = -25.0
    seen = observe(read(tmp_path, rows(force)))
    assert [d.factor for d in seen.signs.values()] == [1.0, 1.0]


def test_a_press_in_the_last_few_rows_is_no_jump_of_an_instrument(tmp_path: Path) -> None:
    # A step of the displacement every row, contact in the last ten: the steepest rows are the last.
    force = (
        0.4 + np.where(X > 0.83, -9.0 * (np.maximum(X - 0.83, 0.0) / 0.17) ** 1.6, 0.0) + 0.003 * np.sin(37.0 * np.arange(N))
    )
    seen = observe(read(tmp_path, rows(force)))
    assert seen.signs["force"].factor == -1.0


@pytest.mark.parametrize("ends", [("", ""), ("", ","), (",", ""), (",,", ",")], ids=["none", "behind", "before", "both"])
def test_a_row_one_column_too_far_is_left_out_also_beside_columns_that_are_always_empty(
    tmp_path: Path, ends: tuple[str, str]
) -> None:
    before, behind = ends
    rows = [f"{0.14 * i:.4f},{1.4 * i:.4f},{0.003 * i:.4f}" for i in range(60)]
    rows[30] = "," + rows[30].rsplit(",", 1)[0]
    lines = [f"{before}{row}{behind}" for row in ["Time,Displacement,Force", "(s),(mm),(kN)", *rows]]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    table = read_lab_file(path)
    assert np.flatnonzero(np.isnan(table.columns["displacement"])).tolist() == [30]
    assert np.flatnonzero(np.isnan(table.columns["force"])).tolist() == [30]


@pytest.mark.parametrize(
    "content",
    [
        "Results\nTime,Extension,Load\n(s),(mm),(kN)\n1.0,2.0,3.0\n\nTime,Extension,Load\n(s),("
        + " " * 3000
        + "mm),(kN)\n4.0,5.0,6.0\n",
        "Time (s);Extension (mm);Load (N)\n" + "[s];[" * 2000 + "\n0.0;0.1;0.2\n0.1;0.2;0.3\n",
        "a b c\n\n1,2,3\n4,5,6\nx\n",
        "Zeit;Weg;Kraft\ns;mm;N\n" + "".join(f"0,{k};0,{k};0,{k}\n" for k in range(9)) + "1" * 9000 + " " * 4000 + ";0,9;0,9\n",
        "Time (s);Extension (mm);Load (N)\n" + '"(' * 50_000 + "\n0.0;0.1;0.2\n",
        ("Time (s),Strain (%),Ext" + "\u00a0" * 3500 + "e" + "(" * 5000 + ",1\n") * 30 + "Time (s),Load (N)\n",
        ("Time [s];Extension [mm];Load [" + "1," * 2500 + "\n" + "0.1;0.2;0.3\n" * 12) * 60,
        '"Maximum Load"\n"(N)"\n"8.366"' + "\n" * 500_000 + '"Time","Load"\n',
    ],
    ids=[
        "among units",
        "brackets among units",
        "numbers without a header",
        "digits in a time",
        "a long line",
        "blanks above",
        "an open bracket",
        "empty lines",
    ],
)
def test_monstrous_cells_are_refused_or_read_at_once(tmp_path: Path, content: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(content, encoding="utf-8")
    start = time.process_time()
    with contextlib.suppress(InputError):
        read_lab_file(path)
    assert time.process_time() - start < 1.0


@pytest.mark.parametrize(
    ("line", "broken"),
    [
        (5, {5: '0.4,0.06780","0.2616'}),  # two marks, and the second one opens a cell
        (5, {5: '0.4,"0.06780,0.2616'}),
        (5, {5: '0.4,"0.06780,"0.2616'}),
        (5, {5: '0.4,0.06780,"0.2616', 6: '0.5,0.08475,0.2907"'}),  # closed by the next row, which is lost in it
        (5, {5: '0.4,0.06780","0.2616', 9: '0.8,0.13559",0.4004'}),
        (0, {0: 'Time (s),"Extension (mm),Load (N)"s'}),
        (60, {60: '5.9,1.00000","6.2000'}),
    ],
)
@pytest.mark.parametrize("column", ["", ",ok"])
def test_a_quotation_mark_that_is_left_open_is_refused_where_it_stands(
    tmp_path: Path, line: int, broken: dict[int, str], column: str
) -> None:
    lines = [HEAD, *rows()]
    for at, text in broken.items():
        lines[at] = text
    lines = [text + (",Remark" if i == 0 and column else column) for i, text in enumerate(lines)]
    with pytest.raises(InputError, match="a quotation mark is not closed") as error:
        read(tmp_path, lines[1:], lines[0])
    assert error.value.faults[0].line == line + 1


@pytest.mark.parametrize("quoted", ['"a 5"" rod"', '"one, two" ', 'a "word" in it', '" "'])
def test_quotation_marks_in_pairs_are_text(tmp_path: Path, quoted: str) -> None:
    table = read(tmp_path, [f"{line},{quoted}" for line in rows()], f"{HEAD},Remark")
    assert len(table.lines) == N
    assert not any(table.reasons)


@pytest.mark.parametrize("shifted", [[3], range(3, N, 10), range(30, N), range(N)])
def test_a_row_that_begins_with_an_empty_cell_and_has_one_too_many_is_told_as_that(tmp_path: Path, shifted: list[int]) -> None:
    lines = [f",{line}" if i in shifted else line for i, line in enumerate(rows())]
    with pytest.raises(InputError) as error:
        read(tmp_path, lines)
    fault = error.value.faults[0]
    assert (fault.line, fault.column) == (shifted[0] + 2, 1)
    assert "begins with an empty cell" in fault.message
    assert "decimal mark" not in fault.advice
    if len(shifted) == N:  # what the advice says of them
        assert len(read(tmp_path, lines, f",{HEAD}").lines) == N
    else:
        assert len(read(tmp_path, [line.lstrip(",") for line in lines]).lines) == N


def test_rows_that_are_moved_to_the_right_and_have_lost_their_ends_are_no_clock_of_their_own(tmp_path: Path) -> None:
    lines = ["," + line.rsplit(",", 1)[0] if i > 30 else line for i, line in enumerate(rows())]
    table = read(tmp_path, lines)
    assert not any(table.reasons[:31])
    assert set(table.reasons[31:]) == {"its cells stand one column too far to the right"}


@pytest.mark.parametrize(
    ("above", "head", "note"),
    [
        (["Units: s, mm, N"], "Time,Extension,Load", "line 1 says the unit of time (s)"),
        (["A press", "Load in N"], "Time (s),Extension (mm),Load", "line 2 says the unit of force (N)"),
        (["Decimal separator: point"], HEAD, 'line 1 says the decimal mark (".")'),
        (["MODE: PARALLEL"], "Time (s),Displacement (mm),C (pF)", "line 1 says how the meter takes the capacitance"),
    ],
)
def test_a_line_that_decides_how_the_file_is_read_is_none_that_is_not_read(
    tmp_path: Path, above: list[str], head: str, note: str
) -> None:
    table = read(tmp_path, [*above[1:], head, *rows(F + 90.0)], above[0])
    assert any(note in said for said in table.notes)
    assert not any(f"line {len(above)}" in str(unread) or "Load in" in str(unread) for unread in table.unread)


def test_the_time_is_not_advised_to_be_left_out_where_nothing_else_ties_the_readings(tmp_path: Path) -> None:
    for head, leads_out in (("Time (s),Cp (pF)", False), ("Time (s),Cp (pF),Load (N)", True)):
        lines = [f"0.1,{97 + f:.4f},{f:.4f}" for f in F]
        with pytest.raises(InputError, match="all times are") as error:
            read(tmp_path, [line if leads_out else line.rsplit(",", 1)[0] for line in lines], head)
        assert ("time=none" in str(error.value)) == leads_out


def test_the_time_is_not_advised_to_be_left_out_where_it_shows_that_rows_are_out_of_sequence(tmp_path: Path) -> None:
    lines = [f"{0.1 * (N - i):.1f},{97 + f:.4f},{f:.4f}" for i, f in enumerate(F)]
    with pytest.raises(InputError, match="time falls") as error:
        read(tmp_path, lines, "Time (s),Cp (pF),Load (N)")
    assert "time=none" not in str(error.value)


def test_rows_that_are_written_twice_count_once(tmp_path: Path) -> None:
    lines = rows()
    table = read(tmp_path, [line for line in lines for _ in range(2)])
    assert [i for i, reason in enumerate(table.reasons) if not reason] == list(range(0, 2 * N, 2))
    assert "the row before once more" in table.reasons[1]
    once = observe(read(tmp_path, lines))
    twice = observe(table)
    np.testing.assert_array_equal(twice.channels["force"][twice.used], once.channels["force"][once.used])


def test_times_too_coarse_to_tell_readings_apart_make_no_copies(tmp_path: Path) -> None:
    force = np.round(F, 1)
    lines = [f"{i // 5},{x:.5f},{f:.1f}" for i, (x, f) in enumerate(zip(np.where(X < 0.1, 0.0, X), force, strict=True))]
    assert not any("once more" in reason for reason in read(tmp_path, lines).reasons)


def _with_stray_cells(folder: Path, rows_with: Sequence[int], place: int, sep: str, n: int = 90) -> LabTable:
    cells = [[f"{0.05 * i:.3f}", f"{0.01 * i:.4f}", f"{0.02 * max(0, i - 20):.4f}", f"{97 + 0.01 * i:.4f}"] for i in range(n)]
    for i in rows_with:
        cells[i].insert(place, "")
    head = sep.join(("Time (s)", "Displacement (mm)", "Force (N)", "Capacitance (pF)"))
    path = folder / "stray.csv"
    path.write_text("\n".join([head, *map(sep.join, cells), ""]), encoding="utf-8")
    return read_lab_file(path)


@pytest.mark.parametrize("sep", [",", ";", "\t"])
@pytest.mark.parametrize("place", [1, 2, 3])
def test_a_row_with_a_stray_empty_cell_is_left_out_with_the_reason(tmp_path: Path, sep: str, place: int) -> None:
    table = _with_stray_cells(tmp_path, [40], place, sep)
    assert [i for i, why in enumerate(table.reasons) if why] == [40]
    assert table.reasons[40] == "5 cells, one of them empty, where most rows have 4"
    assert any("fewer or more cells than most are left out, the first in line 42" in note for note in table.notes)


@pytest.mark.parametrize("rows_with", [range(20, 40), range(90)])
def test_many_rows_with_a_cell_too_many_are_refused(tmp_path: Path, rows_with: Sequence[int]) -> None:
    with pytest.raises(InputError):
        _with_stray_cells(tmp_path, rows_with, 1, ",")


def test_a_row_that_begins_with_an_empty_cell_is_refused_as_before(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="begins with an empty cell"):
        _with_stray_cells(tmp_path, [40], 0, ",")


def _of_day(lines: Sequence[str]) -> list[str]:
    return [f"12:00:{float(line.split(',')[0]):06.3f},{line.split(',', 1)[1]}" for line in lines]


@pytest.mark.parametrize("of_day", [False, True])
@pytest.mark.parametrize(("block", "behind"), [((30, 40), 40), ((10, 40), 40), ((10, 20), 40), ((0, N), N), ((50, N), N)])
def test_a_block_that_was_pasted_twice_is_left_out_once(
    tmp_path: Path, of_day: bool, block: tuple[int, int], behind: int
) -> None:
    lines = _of_day(rows()) if of_day else rows()
    again = lines[slice(*block)]
    table = read(tmp_path, [*lines[:behind], *again, *lines[behind:]], HEAD.replace(" (s)", "") if of_day else HEAD)
    assert [r for r, why in enumerate(table.reasons) if why] == [*range(behind, behind + len(again))]
    assert any("stand twice" in note for note in table.notes)
    whole = read(tmp_path, lines, HEAD.replace(" (s)", "") if of_day else HEAD)
    for quantity, values in whole.columns.items():
        kept = [v for v, why in zip(table.columns[quantity], table.reasons, strict=True) if not why]
        np.testing.assert_array_equal(kept, values)
    assert observe(table).used.sum() == observe(whole).used.sum()


def test_a_block_pasted_three_times_is_left_out_twice(tmp_path: Path) -> None:
    lines = rows()
    table = read(tmp_path, [*lines[:40], *lines[30:40], *lines[30:40], *lines[40:]])
    assert [r for r, why in enumerate(table.reasons) if why] == [*range(40, 60)]


@pytest.mark.parametrize("change", ["other readings", "another time", "other place"])
def test_a_block_that_is_like_one_above_but_for_something_is_not_left_out(tmp_path: Path, change: str) -> None:
    lines = rows()
    again = lines[20:40]
    if change == "other readings":
        again = [f"{line}1" for line in again]
    elif change == "another time":
        again = [f"{float(line.split(',')[0]) + 0.01:.2f},{line.split(',', 1)[1]}" for line in again]
    else:
        again = [*again[:10], *reversed(again[10:])]
    with pytest.raises(InputError):
        observe(read(tmp_path, [*lines[:40], *again, *lines[40:]]))


def test_cycles_whose_times_begin_anew_with_the_same_coarse_readings_are_no_block_pasted_twice(tmp_path: Path) -> None:
    lines = [
        f"{0.1 * i:.1f},{round(x, 2):.2f},{max(round(f, 1) - 1.0, 0):.1f}" for i, (x, f) in enumerate(zip(X, F, strict=True))
    ]
    other = [line if i < 12 else f"{line}7" for i, line in enumerate(lines)]
    with pytest.raises(InputError, match="begins anew"):
        read(tmp_path, [*lines, *other])


def test_rows_out_of_the_order_of_their_time_are_refused_with_what_to_do(tmp_path: Path) -> None:
    lines = rows()
    with pytest.raises(InputError, match="order of their time"):
        observe(read(tmp_path, [*lines[:30], *lines[33:36], *lines[30:33], *lines[36:]]))


@pytest.mark.parametrize("at", [[20], [7, 30, 51]])
def test_cells_whose_exponent_is_cut_are_left_out_before_the_size_of_the_column_is_judged(
    tmp_path: Path, at: list[int]
) -> None:
    cells = [f"{9.7e-11 + 4e-13 * x * x:.6E}" for x in X]
    whole = [f"{0.1 * i:.1f},{c[:-1] if i in at else c}" for i, c in enumerate(cells)]
    table = read(tmp_path, whole, "Time [s],Cp [F]")
    assert [i for i, why in enumerate(table.reasons) if why] == at
    with pytest.raises(InputError, match="no test of a small sample"):
        read(tmp_path, [f"{0.1 * i:.1f},{c[:-1]}" for i, c in enumerate(cells)], "Time [s],Cp [F]")


@pytest.mark.parametrize(("block", "behind"), [((20, 24), 24), ((20, 35), 35), ((10, 20), 45), ((30, 50), N)])
def test_a_block_that_was_pasted_twice_shows_without_a_clock(tmp_path: Path, block: tuple[int, int], behind: int) -> None:
    lines = [line.split(",", 1)[1] for line in rows()]
    head = HEAD.split(",", 1)[1]
    again = lines[slice(*block)]
    table = read(tmp_path, [*lines[:behind], *again, *lines[behind:]], head)
    assert [r for r, why in enumerate(table.reasons) if why] == [*range(behind, behind + len(again))]
    assert any(f"line {behind + 2} is line {block[0] + 2} again" in note for note in table.notes)
    assert observe(table).n_cycle == observe(read(tmp_path, lines, head)).n_cycle


@pytest.mark.parametrize("change", ["one digit", "cycles", "ramps"])
def test_rows_without_a_clock_that_are_alike_but_go_on_elsewhere_are_kept(tmp_path: Path, change: str) -> None:
    lines = [line.split(",", 1)[1] for line in rows()]
    head = HEAD.split(",", 1)[1]
    coarse = [f"{round(x, 2):.2f},{max(round(f, 1) - 1.0, 0):.1f}" for x, f in zip(X, F, strict=True)]
    both = {
        "one digit": [*lines[:35], *(f"{line}1" for line in lines[20:35]), *lines[35:]],
        "cycles": [*lines, *lines[::-1], *lines, *lines[::-1]],
        "ramps": [*coarse, *(line if i < 12 else f"{line}7" for i, line in enumerate(coarse))],
    }[change]
    assert not any("twice" in note for note in read(tmp_path, both, head).notes)


def test_readings_that_were_pasted_twice_beside_their_clock_are_refused_and_read_without_it(tmp_path: Path) -> None:
    lines = [line.split(",", 1)[1] for line in rows()]
    both = [f"{0.1 * i:.1f},{line}" for i, line in enumerate([*lines[:40], *lines[30:40], *lines[40:]])]
    with pytest.raises(InputError, match="lines 42 to 51 hold the readings of the lines from 32 on once more"):
        read(tmp_path, both)
    table = read_lab_file(tmp_path / "a.csv", Reading(columns={"time": "none"}))
    assert [r for r, why in enumerate(table.reasons) if why] == [*range(40, 50)]


def test_cycles_that_are_alike_beside_a_clock_are_kept(tmp_path: Path) -> None:
    lines = [line.split(",", 1)[1] for line in rows()]
    table = read(tmp_path, [f"{0.1 * i:.1f},{line}" for i, line in enumerate([*lines, *lines, *lines])])
    assert not any(table.reasons)


@pytest.mark.parametrize("gap", [" " * 50, "\t" * 50], ids=["blanks", "tabs"])
def test_names_far_apart_in_many_lines_are_read_at_once(tmp_path: Path, gap: str) -> None:
    block = 500 * f"时间 (s){gap}位移 (mm){gap}载荷 (N)\n" + "".join(f"0.{k}{gap}0.{k}{gap}0.{k}\n" for k in range(10, 22))
    path = tmp_path / "a.csv"
    path.write_text(2 * block, encoding="utf-8")
    start = time.process_time()
    with contextlib.suppress(InputError):
        read_lab_file(path, Reading(specimen=1))
    assert time.process_time() - start < 2.0  # 0.4 s on an idle machine


@pytest.mark.parametrize("cell", ["0.E874", "0E400", "0e-999"])
@pytest.mark.parametrize("column", [0, 1, 2])
@pytest.mark.parametrize("which", [slice(30, 31), slice(0, 10), slice(10, 55)])
def test_a_nought_with_a_monstrous_exponent_is_refused_or_read(tmp_path: Path, cell: str, column: int, which: slice) -> None:
    cells = [row.split(",") for row in rows()]
    for row in cells[which]:
        row[column] = cell
    refused = ""
    try:
        table = read(tmp_path, [",".join(row) for row in cells])
    except InputError as fault:
        refused = str(fault)
    if refused:
        assert cell in refused
    else:
        kept = np.array([not reason for reason in table.reasons])
        kept[which] = False
        np.testing.assert_allclose(table.columns["force"][kept], F[kept], atol=1e-4)

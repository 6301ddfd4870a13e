"""What is told of a channel that jumps alone, how a user settles it, and what words and units of labs are understood beside."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hostile_press import lines_of, press, texts

from calib.errors import InputError
from calib.lab import LabTable, Reading, observe, read_lab_file
from calib.lab.instruments.doubts import doubtful
from calib.lab.instruments.times_noise import times_noise
from models.sensor import FloatArray

P = press(160, seed=81)
T, X, F, C = (np.array(column, dtype=float) for column in (P.t, P.d, P.f, P.c))
ROWS = np.arange(T.size)
HEADS = ("Time (s)", "Extension (mm)", "Load (N)", "Cp (pF)")


def _read(
    folder: Path, *columns: FloatArray, heads: Sequence[str] = HEADS, reading: Reading | None = None, encoding: str = "utf-8"
) -> LabTable:
    path = folder / "press.csv"
    written = [texts(c, n) for c, n in zip(columns, (2, 4, 3, 3), strict=False)]
    path.write_text("\n".join(lines_of(heads[: len(columns)], written)[0]) + "\n", encoding=encoding)
    return read_lab_file(path, reading or Reading())


def test_an_overflow_is_refused_with_its_line_both_readings_and_the_jump(tmp_path: Path) -> None:
    wrapped = np.where(F > 4, F - 8, F)
    row = int(np.argmax(F > 4))
    with pytest.raises(InputError) as caught:
        _read(tmp_path, T, X, wrapped, C)
    (fault,) = caught.value.faults
    assert (fault.line, fault.column) == (row + 2, 3)
    for word in (f'"{wrapped[row - 1]:.3f}"', f'"{wrapped[row]:.3f}"', f"{wrapped[row] - wrapped[row - 1]:.5g}", "overflowed"):
        assert word in fault.message


def test_a_jump_of_a_capacitance_is_read_if_the_user_says_its_unit_once_more(tmp_path: Path) -> None:
    stepped = np.where(ROWS >= 60, C + 1.5, C)
    with pytest.raises(InputError, match="say it once more: --units capacitance="):
        _read(tmp_path, T, X, F, stepped)
    table = _read(tmp_path, T, X, F, stepped, reading=Reading(units={"capacitance": "pF"}))
    assert any("jump by 1.5" in note for note in table.notes)
    np.testing.assert_allclose(table.columns["capacitance"], np.round(stepped, 3) * 1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("row", [45, 60, 80])
def test_rows_of_one_zero_of_the_load_are_used_together(tmp_path: Path, row: int, sign: float) -> None:
    tared = np.where(row <= ROWS, F - F[row], F)
    table = _read(tmp_path, T, sign * X, sign * tared)
    assert table.zeroed == {"force": (row,)}
    assert any(f"in line {row + 2}" in note and "set anew" in note for note in table.notes)
    seen = observe(table)
    assert {d.factor for d in seen.signs.values()} == {sign}
    assert not (np.any(seen.used[:row]) and np.any(seen.used[row:]))
    assert any(f"its force seems to have another zero, as if set anew in line {row + 2}" in why for why in seen.reason)


@pytest.mark.parametrize("to", [0.0, 0.3])
def test_rows_of_one_zero_of_the_place_are_used_together_in_contact_too(tmp_path: Path, to: float) -> None:
    anew = np.where(ROWS >= 60, X - X[60] + to, X)
    table = _read(tmp_path, T, anew, F)
    assert table.zeroed == {"displacement": (60,)}
    seen = observe(table)
    assert not (np.any(seen.used[:60]) and np.any(seen.used[60:]))


@pytest.mark.parametrize("share", [0.01, 0.015, 0.02, 0.03])
@pytest.mark.parametrize("which", [3, 4])
def test_noise_that_grows_with_the_load_costs_no_row_and_is_told_as_what_it_may_be(
    tmp_path: Path, share: float, which: int
) -> None:
    told = left_out = 0
    for n in (80, 160, 400):
        for seed in range(8):
            p, rng = press(n, seed=90 + seed, unloading=False), np.random.default_rng([91, n, seed])
            t, x, f, c = (np.array(column, dtype=float) for column in (p.t, p.d, p.f, p.c))
            table = _read(tmp_path, *(t, x, f * (1 + rng.normal(0, share, f.size)), c)[:which])
            left_out += bool(table.zeroed)
            jumps = [note for note in table.notes if "jump" in note]
            told += bool(jumps)
            assert all("noise that grows with the reading, or another zero" in note for note in jumps) or table.zeroed
    assert left_out <= 1
    assert told <= 4


@pytest.mark.parametrize("share", [0.01, 0.02])
@pytest.mark.parametrize("n", [80, 160, 400])
@pytest.mark.parametrize("which", [3, 4])
def test_a_tare_in_contact_is_told_beside_noise_that_grows_with_the_load(
    tmp_path: Path, share: float, n: int, which: int
) -> None:
    for seed in range(4):
        p, rng = press(n, seed=90 + seed, unloading=False), np.random.default_rng([92, n, seed])
        t, x, f, c = (np.array(column, dtype=float) for column in (p.t, p.d, p.f, p.c))
        row, noisy = int(0.4 * f.size), f * (1 + rng.normal(0, share, f.size))
        table = _read(tmp_path, *(t, x, np.where(np.arange(f.size) >= row, noisy - noisy[row], noisy), c)[:which])
        # That may also be told as a load that contradicts the place, or as a slip.
        assert any(f"in line {row + 2}" in note for note in table.notes) or "contradicts" in table.reasons[row]


@pytest.mark.parametrize("share", [0.1, 0.2, 0.5])
def test_steps_beside_noise_that_grows_are_told_by_their_size_or_by_the_readings_behind(share: float) -> None:
    rng = np.random.default_rng(93)
    course = np.concatenate([np.zeros(40), np.linspace(0.0, 1.0, 100) ** 1.5])
    noisy = course * (1 + 0.02 * rng.normal(size=course.size)) + 1e-3 * rng.normal(size=course.size)
    at = np.array([110])
    for off_by, told in ((share, True), (0.0, False)):
        y = noisy + np.where(np.arange(noisy.size) > at[0], off_by, 0.0)
        off = np.abs(np.diff(y)[at] - np.median(np.diff(y)[105:116]))
        assert (times_noise(y, at, off, np.zeros(0, dtype=np.int64)) > 8).tolist() == [told]
    # One that comes back is noise.
    y = noisy.copy()
    y[at + 1] += 0.1
    off = np.abs(np.diff(y)[at] - np.median(np.diff(y)[105:116]))
    assert not np.any(times_noise(y, at, off, np.zeros(0, dtype=np.int64)) > 8)


def test_zeros_of_chosen_rows_are_counted_among_these(tmp_path: Path) -> None:
    tared = np.where(ROWS >= 60, F - F[60], F)
    path = tmp_path / "press.csv"
    rows = [f"{t:.2f},{x:.4f},{f:.3f},a" for t, x, f in zip(T, X, tared, strict=True)]
    path.write_text("\n".join([",".join((*HEADS[:3], "Channel")), *(["0,0,0,b"] * 3), *rows]) + "\n")
    table = read_lab_file(path, Reading(where={"Channel": "a"}))
    assert table.zeroed == {"force": (60,)}


def test_a_tare_before_the_touch_is_told_and_left_to_the_model(tmp_path: Path) -> None:
    table = _read(tmp_path, T, X, np.where(ROWS < 8, F + 0.7, F), C)
    assert not any(table.reasons)
    assert not table.zeroed
    assert any('"Load (N)": the readings jump by' in note and "another zero of the load cell" in note for note in table.notes)


def test_a_slip_to_a_part_of_the_load_is_told_as_open(tmp_path: Path) -> None:
    table = _read(tmp_path, T, X, np.where((ROWS >= 60) & (ROWS < 96), F - 0.5, F))
    assert not any(table.reasons)
    assert not table.zeroed
    assert any("a slip" in note for note in table.notes)


@pytest.mark.parametrize("seed", range(4))
def test_noise_about_zero_is_not_off_by_a_power_of_ten(seed: int) -> None:
    rng = np.random.default_rng([9, 4 * seed + 2])
    n = 250_000
    rows = np.arange(n)
    values = np.where(rows < n // 2, 0.0, 1e-3 * (rows - n // 2)) + 0.004 * rng.normal(size=n)
    cells = np.char.mod("%.4f", values).tolist()
    assert doubtful(cells, np.round(values, 4), ".").rows == {}


@pytest.mark.parametrize(
    ("unit", "newtons", "told"),
    [
        *((unit, 4.4482216152605, "pounds-force (lbf)") for unit in ("lb", "lbs", "LBS", "pounds")),
        *((unit, 9.80665e-3, "grams-force (gf)") for unit in ("g", "grams", "Gramm")),
        *((unit, 9.80665, "kilograms-force (kgf)") for unit in ("kg", "KG", "kilo")),
        ("mg", 9.80665e-6, "milligrams-force (mgf)"),
        ("oz", 0.27801385095378, "ounces-force (ozf)"),
    ],
)
def test_masses_of_a_load_are_read_as_weights_and_told(tmp_path: Path, unit: str, newtons: float, told: str) -> None:
    table = _read(tmp_path, T, X, F, heads=(*HEADS[:2], f"Load ({unit})"))
    np.testing.assert_allclose(table.columns["force"], F * newtons)
    assert any(told in note for note in table.notes)


def test_a_unit_that_may_be_of_a_mass_or_another_is_refused_with_the_unit_to_paste(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--units force=gf"):
        _read(tmp_path, T, X, F, heads=(*HEADS[:2], "Force (gr)"))


@pytest.mark.parametrize("heads", [("時間(秒)", "位移(mm)", "荷重(N)"), ("時間(s)", "行程(公厘)", "負載(牛頓)")])
def test_traditional_chinese_in_big5_is_read(tmp_path: Path, heads: tuple[str, ...]) -> None:
    table = _read(tmp_path, T, X, F, heads=heads, encoding="big5")
    assert table.encoding == "big5"
    np.testing.assert_allclose(table.columns["force"], F)
    np.testing.assert_allclose(table.columns["displacement"], X * 1e-3)


def test_a_column_of_thousands_commas_alone_says_how_either_is_said(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    path.write_text("Time (ms);Cp (fF)\n" + "".join(f"{1243 + 7 * i:,};{2000 + 9 * i:,}\n" for i in range(40)))
    with pytest.raises(InputError, match=r'--decimal "\." if it sets thousands apart'):
        read_lab_file(path)
    table = read_lab_file(path, Reading(decimal="."))
    np.testing.assert_allclose(table.columns["capacitance"], 1e-15 * (2000 + 9 * np.arange(40)))


@pytest.mark.parametrize("head", ["Time", "Time (d:h:min:s)"])
def test_times_of_four_parts_count_days(tmp_path: Path, head: str) -> None:
    seconds = [86400 + 23 * 3600 + 59 * 60 + 30 + i for i in range(60)]
    clock = [f"{s // 86400}:{s // 3600 % 24:02d}:{s // 60 % 60:02d}:{s % 60:02d}" for s in seconds]
    path = tmp_path / "press.csv"
    rows = (f"{c},{x:.4f},{f:.3f}\n" for c, x, f in zip(clock, X, F, strict=False))
    path.write_text(f"{head},Extension (mm),Load (N)\n" + "".join(rows))
    np.testing.assert_allclose(np.diff(read_lab_file(path).columns["time"]), 1.0)


@pytest.mark.parametrize("last", [range(60), (i * 37 % 100 for i in range(60))])
def test_times_of_four_parts_that_may_end_in_frames_are_refused(tmp_path: Path, last: Sequence[int]) -> None:
    path = tmp_path / "press.csv"
    rows = (f"0:00:{i // 2:02d}:{k:02d},{x:.4f},{f:.3f}\n" for i, (k, x, f) in enumerate(zip(last, X, F, strict=False)))
    path.write_text("Time,Extension (mm),Load (N)\n" + "".join(rows))
    with pytest.raises(InputError, match=r"part|second"):
        read_lab_file(path)


@pytest.mark.parametrize("words", ["# tare", "# Nullung Kraft", "% 载荷清零"])
def test_rows_before_and_behind_a_remark_on_a_zero_are_not_used_together(tmp_path: Path, words: str) -> None:
    path = tmp_path / "press.csv"
    lines = lines_of(HEADS, [texts(c, n) for c, n in zip((T, X, F, C), (2, 4, 3, 3), strict=True)])[0]
    path.write_text("\n".join([*lines[:31], words, *lines[31:]]) + "\n")
    table = read_lab_file(path)
    assert table.zeroed["force"] == (30,)
    assert any("in line 32 says that a zero was set anew" in note for note in table.notes)
    seen = observe(table)
    assert not np.any(seen.used[:30])
    assert np.any(seen.used[30:])


@pytest.mark.parametrize(("column", "names"), [("capacitance zeroed", HEADS), ("zero", (HEADS[0], HEADS[3]))])
def test_a_capacitance_that_was_zeroed_is_refused_with_the_line_of_the_remark(
    tmp_path: Path, column: str, names: Sequence[str]
) -> None:
    path = tmp_path / "press.csv"
    by_name = dict(zip(HEADS, (texts(c, n) for c, n in zip((T, X, F, C), (2, 4, 3, 3), strict=True)), strict=True))
    remarks = [column if r == 20 else "" for r in range(T.size)]
    lines = lines_of([*names, "Comment"], [*(by_name[n] for n in names), remarks])[0]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match="another zero from there on") as caught:
        read_lab_file(path)
    assert [fault.line for fault in caught.value.faults] == [22]


def test_a_line_that_says_tare_without_a_mark_of_comments_is_refused_with_a_way_out_that_keeps_what_it_says(
    tmp_path: Path,
) -> None:
    path = tmp_path / "press.csv"
    lines = lines_of(HEADS, [texts(c, n) for c, n in zip((T, X, F, C), (2, 4, 3, 3), strict=True)])[0]
    path.write_text("\n".join([*lines[:31], "TARE", *lines[31:]]) + "\n")
    with pytest.raises(InputError, match="write # before it"):
        read_lab_file(path)
    path.write_text("\n".join([*lines[:31], "# TARE", *lines[31:]]) + "\n")
    assert read_lab_file(path).zeroed["force"] == (30,)


def test_a_capacitance_all_of_whose_marks_are_lost_is_refused_unless_its_unit_is_said(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    rows = (f"{t:.2f},{x:.4f},{f:.3f},{1000 * c:.0f}\n" for t, x, f, c in zip(T, X, F, C, strict=True))
    path.write_text(",".join(HEADS) + "\n" + "".join(rows))
    with pytest.raises(InputError, match="decimal marks may be lost") as caught:
        read_lab_file(path)
    assert (caught.value.faults[0].line, caught.value.faults[0].column) == (2, 4)
    table = read_lab_file(path, Reading(units={"capacitance": "pF"}))
    np.testing.assert_allclose(table.columns["capacitance"], np.round(1000 * C) * 1e-12)
    path.write_text(path.read_text().replace("Cp (pF)", "Cp (fF)"))
    np.testing.assert_allclose(read_lab_file(path).columns["capacitance"], np.round(1000 * C) * 1e-15)


@pytest.mark.parametrize("size", [1.2, 2.0])
def test_the_neck_of_a_sticky_sample_that_the_capacitance_does_not_see_keeps_its_readings(tmp_path: Path, size: float) -> None:
    """A pull of a dozen rows on the way back, with drift, noise and few readings: steep, but no offset that comes and goes."""
    rng = np.random.default_rng(4)
    down: FloatArray = np.concatenate([np.linspace(0, 0.8, 120), np.linspace(0.8, 0, 120)])
    pressed = np.maximum(down - 0.25, 0.0)
    pull = size * 1.6 * np.exp(-(((np.arange(240) - 212) / 3.6) ** 2))
    force = 4 * pressed**1.5 - pull + 0.002 * np.arange(240) + 0.02 * rng.normal(size=240)
    capacitance = 96.8 + 2.5 * pressed + 0.002 * rng.normal(size=240)
    time: FloatArray = 0.2 * np.arange(240, dtype=np.float64)
    table = _read(tmp_path, time, down, force, capacitance)
    assert not any(table.reasons)
    assert not table.zeroed


def _jumped(fault: str, row: int) -> FloatArray:
    behind = row <= ROWS
    return {
        "sign": np.where(behind, -F, F),
        "half": np.where(behind, F / 2, F),
        "double": np.where(behind, 2 * F, F),
        "five times": np.where(behind, 5 * F, F),
        "tared": np.where(behind, F - F[row], F),
    }[fault]


@pytest.mark.parametrize("fault", ["sign", "half", "double", "five times", "tared"])
@pytest.mark.parametrize(("place", "cap"), [(0.0, 0.05), (0.004, 0.0), (0.0, -0.05)], ids=["lead", "crosshead", "back"])
@pytest.mark.parametrize("row", [55, 70])
def test_a_small_step_of_another_channel_does_not_make_a_large_one_of_the_load(
    tmp_path: Path, fault: str, place: float, cap: float, row: int
) -> None:
    behind = row <= ROWS
    columns = (T, X + place * behind, _jumped(fault, row), C + cap * behind)
    if fault == "tared":
        assert _read(tmp_path, *columns).zeroed == {"force": (row,)}
        return
    with pytest.raises(InputError) as refused:
        _read(tmp_path, *columns)
    assert refused.value.faults[0].line == row + 2
    assert "times what those above go on as" in refused.value.faults[0].message


@pytest.mark.parametrize("share", [0.15, 0.4])
@pytest.mark.parametrize("part", [0.6, 1.0])
@pytest.mark.parametrize("row", [55, 70])
def test_a_slip_that_the_capacitance_shows_in_proportion_is_none(tmp_path: Path, share: float, part: float, row: int) -> None:
    left = np.where(row <= ROWS, 1 - share * np.exp(-(ROWS - row) / 20.0), 1.0)
    load = F * left
    cap = (
        97.4
        + 3.1 * (np.clip(F * (1 + part * (left - 1)), 0, None) / 5) ** 0.8
        + (C - 97.4 - 3.1 * (np.clip(F, 0, None) / 5) ** 0.8)
    )
    table = _read(tmp_path, T, X, load, cap)
    assert not any(table.reasons)
    assert not table.zeroed


@pytest.mark.parametrize("fault", ["sign", "double"])
def test_another_sign_or_range_over_a_pause_is_refused_and_a_load_that_relaxed_is_not(tmp_path: Path, fault: str) -> None:
    row = 70
    late = T + 6.0 * (row <= ROWS)
    with pytest.raises(InputError) as refused:
        _read(tmp_path, late, X, _jumped(fault, row), C)
    assert refused.value.faults[0].line == row + 2
    assert not any(_read(tmp_path, late, X, np.where(row <= ROWS, 0.85 * F, F), C).reasons)

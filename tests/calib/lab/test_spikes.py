"""Readings that stand alone are left out with the reason; turns, snaps, steps and what two instruments show are kept."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from calib.lab import LabTable, Reading, read_lab_file
from calib.lab.instruments.spikes import alone
from models.sensor import FloatArray

N = 160
RNG = np.random.default_rng(5)
TIME: FloatArray = 0.3 * np.arange(N, dtype=np.float64)
TURN = 1 - np.abs(np.linspace(-1, 1, N))
DEPTH = 1.15 * TURN
FORCE = 8 * np.maximum(DEPTH - 0.15, 0.0) ** 1.5 + 0.002 * RNG.standard_normal(N)
CAP = 30 + FORCE + 0.003 * RNG.standard_normal(N)
HEADS = {"force": "Load (N)", "displacement": "Extension (mm)", "capacitance": "Cp (pF)"}
VALUES = {"force": FORCE, "displacement": DEPTH, "capacitance": CAP}


def _read(folder: Path, **changed: dict[int, str]) -> LabTable:
    cells = {q: [f"{v:.4f}" for v in values] for q, values in VALUES.items()}
    for quantity, texts in changed.items():
        for row, text in texts.items():
            cells[quantity][row] = text
    rows = zip((f"{0.3 * i:.1f}" for i in range(N)), *cells.values(), strict=True)
    path = folder / "press.csv"
    head = ",".join(("Time (s)", *(HEADS[q] for q in cells)))
    path.write_text("\n".join([head, *map(",".join, rows)]) + "\n", encoding="utf-8")
    return read_lab_file(path, Reading())


def _left_out(table: LabTable) -> list[int]:
    return [row for row, why in enumerate(table.reasons) if why]


def test_a_press_as_it_is_keeps_all_its_readings(tmp_path: Path) -> None:
    assert _left_out(_read(tmp_path)) == []


@pytest.mark.parametrize("cell", ["0.0000", "-1", "-99.99", "999.9999", "-9.99E+02", "0", "12"])
@pytest.mark.parametrize("quantity", ["force", "capacitance", "displacement"])
@pytest.mark.parametrize("rows", [(60,), (55, 60, 61, 90)])
def test_marks_of_no_reading_are_left_out(tmp_path: Path, cell: str, quantity: str, rows: tuple[int, ...]) -> None:
    table = _read(tmp_path, **{quantity: dict.fromkeys(rows, cell)})
    assert _left_out(table) == list(rows)
    assert all(table.reasons[r].startswith(f'"{cell}" ') for r in rows)


def test_an_outlier_of_many_noises_is_left_out_and_one_of_five_is_kept(tmp_path: Path) -> None:
    for size, left in ((100, [10]), (5, [])):  # before contact, where no step hides it
        assert _left_out(_read(tmp_path, force={10: f"{FORCE[10] + size * 0.002:.4f}"})) == left


@pytest.mark.parametrize("quantity", ["force", "displacement", "capacitance"])
@pytest.mark.parametrize("row", [2, 20, 52, 100, N - 3])
def test_a_damaged_digit_that_leaves_a_smooth_course_by_less_than_its_steps_is_left_out(
    tmp_path: Path, quantity: str, row: int
) -> None:
    off = {"force": 0.05, "displacement": 0.004, "capacitance": 0.06}[quantity]
    assert _left_out(_read(tmp_path, **{quantity: {row: f"{VALUES[quantity][row] + off:.4f}"}})) == [row]


@pytest.mark.parametrize("row", [0, 1, N - 2, N - 1])
def test_beside_an_end_only_what_is_far_off_is_left_out(tmp_path: Path, row: int) -> None:
    assert _left_out(_read(tmp_path, displacement={row: "5.1234"})) == [row]
    assert _left_out(_read(tmp_path, displacement={row: f"{DEPTH[row] + 0.004:.4f}"})) == []


@pytest.mark.parametrize("every", [4, 5, 7])
@pytest.mark.parametrize("quantity", ["force", "capacitance"])
@pytest.mark.parametrize("begins", [0.08, 0.15, 0.21, 0.3])
def test_a_touch_between_the_readings_of_a_channel_sampled_more_rarely_leaves_none_out(
    every: int, quantity: str, begins: float
) -> None:
    depth = 0.9 * (1 - np.abs(np.linspace(-1, 1, 200)))
    noise = np.random.default_rng(7).standard_normal((2, 200))
    force = 4 * np.maximum(depth - begins, 0.0) ** 1.5 + 0.003 * noise[0]
    cap = 97.2 + 1.8 * np.maximum(depth - begins, 0.0) ** 1.2 + 0.0008 * noise[1]
    for first in range(every):
        rare = np.arange(200) % every == first
        channels = {"displacement": depth, "force": force, "capacitance": cap}
        assert alone(channels | {quantity: np.where(rare, channels[quantity], np.nan)}) == {}


@pytest.mark.parametrize("every", [2, 3, 5])
def test_a_damaged_digit_of_a_channel_sampled_more_rarely_is_left_out(tmp_path: Path, every: int) -> None:
    cells = {row: "" for row in range(N) if row % every} | {20 * every: f"{CAP[20 * every] + 0.4:.4f}"}
    assert [row for row in _left_out(_read(tmp_path, capacitance=cells)) if row % every == 0] == [20 * every]


def test_four_damaged_digits_are_left_out_together(tmp_path: Path) -> None:
    damaged = {row: f"{DEPTH[row] - 0.003:.4f}" for row in (31, 60, 66, 120)}
    assert _left_out(_read(tmp_path, displacement=damaged)) == list(damaged)


def test_cells_of_one_row_that_changed_places_are_left_out(tmp_path: Path) -> None:
    table = _read(tmp_path, force={70: f"{DEPTH[70]:.4f}"}, displacement={70: f"{FORCE[70]:.4f}"})
    assert _left_out(table) == [70]


def test_two_readings_far_beyond_all_others_near_the_start_are_left_out(tmp_path: Path) -> None:
    for first in (0, 2):
        assert _left_out(_read(tmp_path, force={first: "-40.0011", first + 1: "-40.0025"})) == [first, first + 1]


def test_what_force_and_capacitance_show_both_has_happened_where_no_displacement_goes_on() -> None:
    off = np.where(np.arange(N) == 60, 1.0, 0.0)
    assert alone({"force": FORCE + off, "capacitance": CAP + off}) == {}


@pytest.mark.parametrize(
    ("force", "cap"),
    [("0.0000", "0.000"), ("999.0", "999.0"), ("0.0012", "30.001"), (f"{FORCE[60] + 1:.4f}", f"{CAP[60] + 1:.4f}")],
    ids=["zeros", "a mark", "at rest", "a knock"],
)
@pytest.mark.parametrize("rows", [(60,), (42, 60, 75), (30, 42, 55, 60, 70, 85, 100)])
def test_force_and_capacitance_that_leave_and_come_back_together_while_the_ball_goes_on_are_both_left_out(
    tmp_path: Path, force: str, cap: str, rows: tuple[int, ...]
) -> None:
    table = _read(tmp_path, force=dict.fromkeys(rows, force), capacitance=dict.fromkeys(rows, cap))
    assert _left_out(table) == list(rows)
    assert not table.zeroed


@pytest.mark.parametrize(
    "course",
    [
        np.where(DEPTH > 0.3, 8 * (DEPTH - 0.3), 0.0),
        np.where((DEPTH > 0.3) & (np.arange(N) < 80), 3.0, 0.0) + DEPTH,
        np.where(np.arange(N) == 40, -0.3, 0.0) + np.where(np.arange(N) > 40, np.linspace(-0.25, 3, N), 0.0),
        5 * np.abs(np.sin(np.arange(N) / 1.5)),
    ],
    ids=["a corner", "a pulse", "a snap", "a coarse oscillation"],
)
def test_corners_steps_snaps_and_coarse_records_are_kept(
    tmp_path: Path, course: FloatArray, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(VALUES, "force", course)
    monkeypatch.setitem(VALUES, "capacitance", 30 + course)
    assert not any("stands alone" in why for why in _read(tmp_path).reasons)


def _short(folder: Path, load: FloatArray, cap: FloatArray, cells: dict[int, str] | None = None) -> list[int]:
    """The rows left out of a press of forty with such loads [N], two decimals or as written, and capacitances [pF]."""
    depth = 1.2 * (1 - np.abs(2 * np.arange(load.size) / load.size - 1.0))
    texts = [f"{f:.2f}" for f in load]
    for row, text in (cells or {}).items():
        texts[row] = text
    lines = [f"{0.5 * i:.1f},{x:.4f},{f},{c:.4f}" for i, (x, f, c) in enumerate(zip(depth, texts, cap, strict=True))]
    path = folder / "press.csv"
    path.write_text("Time (s),Extension (mm),Load (N),Cp (pF)\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return _left_out(read_lab_file(path))


TOUCH, SHORT = 8, 1.2 * (1 - np.abs(np.arange(40) / 20 - 1.0))
LOAD = 9.0 * np.maximum(SHORT - 1.2 * TOUCH / 20, 0.0) ** 1.6
NOISE = 1e-3 * np.random.default_rng(7).standard_normal(40)


# A simulated press that draws the ball on at the touch: load [N] and capacitance [pF].
SNAP_LOAD = "-0.2 -0.0 -0.1 0.1 -0.1 -0.1 0.1 0.1 0.0 0.1 -9.4 -8.5 -7.3 -5.9 -4.3 -2.7 -1.2 0.6 2.4 4.1 5.9 7.7 9.6"
SNAP_CAP = (
    "72.2059 72.2059 72.2054 72.2062 72.2051 72.2046 72.2068 72.2059 72.2066 72.2062 72.4354 72.5487 72.6820 "
    "72.8253 72.9743 73.1284 73.2856 73.4471 73.6112 73.7794 73.9502 74.1212 74.2946"
)


def _pressed(folder: Path, loads: Sequence[str], caps: Sequence[str]) -> Path:
    """A file of a steady approach with these loads [N] and capacitances [pF], as written."""
    path = folder / "press.csv"
    lines = [f"{0.5 * i:.3f},{0.0559 * i:.4f},{load},{cap}" for i, (load, cap) in enumerate(zip(loads, caps, strict=True))]
    path.write_text("Time (s),Extension (mm),Load (N),Cp (pF)\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_a_snap_of_load_and_capacitance_in_a_short_press_is_no_damaged_cell(tmp_path: Path) -> None:
    path = _pressed(tmp_path, SNAP_LOAD.split(), SNAP_CAP.split())
    assert _left_out(read_lab_file(path)) == []


@pytest.mark.parametrize(("row", "cell"), [(2, "0.09"), (15, "2."), (16, "03.26"), (1, "-00.")])
def test_a_cell_among_readings_at_rest_or_that_no_format_prints_is_left_out(tmp_path: Path, row: int, cell: str) -> None:
    cap = 46.7 + 0.8 * LOAD + NOISE
    assert _short(tmp_path, LOAD, cap) == []
    assert _short(tmp_path, LOAD, cap, {row: cell}) == [row]


# The same of one that is not drawn on.
PRESSED_LOAD = (
    "0.000 0.000 0.001 0.000 -0.001 -0.000 -0.000 0.000 0.004 0.008 0.016 0.024 0.034 0.047 0.061 0.077 0.094 0.114 0.135 "
    "0.157 0.179 0.205 0.232 0.261 0.291 0.322"
)
PRESSED_CAP = (
    "104.316 104.319 104.319 104.317 104.315 104.318 104.317 104.351 104.467 104.627 104.819 105.038 105.282 105.548 105.835 "
    "106.139 106.463 106.801 107.156 107.525 107.908 108.309 108.718 109.144 109.581 110.028"
)


def test_a_load_that_comes_back_at_once_behind_the_touch_is_left_out_where_the_capacitance_goes_on(tmp_path: Path) -> None:
    for damaged in (False, True):
        loads = PRESSED_LOAD.split()
        loads[8] = "0.040" if damaged else loads[8]
        path = _pressed(tmp_path, loads, PRESSED_CAP.split())
        assert _left_out(read_lab_file(path)) == ([8] if damaged else [])


@pytest.mark.parametrize(
    ("quantity", "row", "factor"), [("force", -2, 1.6), ("displacement", -2, 1.6), ("displacement", -10, 0.8)]
)
def test_a_damaged_cell_near_the_turn_of_a_short_press_is_left_out_and_the_press_as_it_is_kept(
    tmp_path: Path, quantity: str, row: int, factor: float
) -> None:
    n = 40
    turn = n // 2
    depth = 1.2 * (1 - np.abs(np.arange(n) / turn - 1.0))
    load = 30 * np.maximum(depth - 0.2, 0.0) ** 1.6 * np.where(np.arange(n) > turn, 0.8, 1.0)
    columns = {"displacement": depth, "force": load, "capacitance": 60 + 0.1 * load}
    for damaged in (False, True):
        if damaged:
            columns[quantity][turn + row] *= factor
        lines = [f"{0.5 * i:.1f},{x:.4f},{f:.3f},{c:.4f}" for i, (x, f, c) in enumerate(zip(*columns.values(), strict=True))]
        path = tmp_path / "press.csv"
        path.write_text("Time (s),Extension (mm),Load (N),Cp (pF)\n" + "\n".join(lines) + "\n", encoding="utf-8")
        assert _left_out(read_lab_file(path)) == ([turn + row] if damaged else [])


@pytest.mark.parametrize("missing", [(3,), (2, 3), (8,), (20, 21, 22), (79, 80), (100, 130)])
@pytest.mark.parametrize("noise", [0.0, 5e-5])
def test_no_reading_beside_missing_rows_stands_alone_where_it_goes_on_over_time(missing: tuple[int, ...], noise: float) -> None:
    there = ~np.isin(np.arange(N), missing)
    depth = DEPTH + noise * np.random.default_rng(3).standard_normal(N)
    values = {"displacement": np.round(depth[there], 4), "force": FORCE[there], "capacitance": CAP[there]}
    assert alone(values, TIME[there]) == {}


@pytest.mark.parametrize("seed", range(12))
def test_no_reading_stands_alone_where_rows_are_lost_at_random(seed: int) -> None:
    there = np.random.default_rng(seed).random(N) > 0.02 * (1 + seed)
    values = {"displacement": np.round(DEPTH[there], 4), "force": FORCE[there], "capacitance": CAP[there]}
    assert alone(values, TIME[there]) == {}


@pytest.mark.parametrize("quantity", ["force", "displacement", "capacitance"])
@pytest.mark.parametrize("missing", [(40,), (18, 19), (96,)])
def test_a_damaged_digit_is_left_out_beside_missing_rows_too(quantity: str, missing: tuple[int, ...]) -> None:
    there = ~np.isin(np.arange(N), missing)
    values = {q: np.round(v[there], 4) for q, v in VALUES.items()}
    for row in (20, 41, 100):
        at = int(np.count_nonzero(there[:row]))
        damaged = values[quantity].copy()
        damaged[at] += {"force": 0.5, "displacement": 0.05, "capacitance": 0.6}[quantity]
        assert alone(values | {quantity: damaged}, TIME[there]).keys() == {quantity}


@pytest.mark.parametrize("seed", [4, 8, 12, 14])
@pytest.mark.parametrize("share", [0.2, 0.3, 0.6])
def test_no_reading_of_a_load_cell_at_the_end_of_its_range_stands_alone_for_its_noise(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    place = np.concatenate([np.linspace(0, 0.8, 130), np.linspace(0.79, 0.01, 110)]) + rng.normal(0, 2e-4, 240)
    load = np.minimum(4.0 * np.clip(place - 0.1, 0, None) ** 1.5 + rng.normal(0, 3e-3, 240), share * 2.3)
    values: dict[str, FloatArray] = {"displacement": np.asarray(place), "force": np.asarray(np.round(load, 4))}
    assert alone(values) == {}
    values["force"][30] += 0.2
    assert list(alone(values)["force"]) == [30]


def _at_a_constant_speed(folder: Path, **changed: dict[int, float]) -> LabTable:
    """A press without its place, 60 rows down at an even pace and a hold of 20, at whose start the force relaxes at once."""
    depth = np.minimum(np.arange(80), 59) / 60
    force = 4.4 * np.maximum(depth - 0.1, 0.0) ** 1.3 - 0.065 * (np.arange(80) > 59)
    capacitance = 97.0 + 0.4 * depth + 0.3 * depth**2
    rng = np.random.default_rng(3)
    values = {"force": force + 0.001 * rng.normal(size=80), "capacitance": capacitance + 0.002 * rng.normal(size=80)}
    for quantity, cells in changed.items():
        for row, value in cells.items():
            values[quantity][row] += value
    path = folder / "hold.csv"
    rows = [
        f"{0.1 * i:.1f},{f:.4f},{c:.4f}" for i, (f, c) in enumerate(zip(values["force"], values["capacitance"], strict=True))
    ]
    path.write_text("\n".join(["Time (s),Force (N),Cp (pF)", *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path, Reading())


def test_the_last_reading_before_a_hold_whose_force_relaxes_at_once_is_kept(tmp_path: Path) -> None:
    assert _left_out(_at_a_constant_speed(tmp_path)) == []


@pytest.mark.parametrize("row", [45, 59, 62])
def test_a_reading_off_the_line_before_a_hold_is_left_out(tmp_path: Path, row: int) -> None:
    assert _left_out(_at_a_constant_speed(tmp_path, force={row: 0.3})) == [row]

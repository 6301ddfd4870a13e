"""A unit or a range that is switched within a record, told from jumps that happened; words that state a factor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hostile_press import lines_of, press, texts, times

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file
from models.sensor import FloatArray

P = press(120, seed=61)
HEADS = ("Time (s)", "Extension (mm)", "Load (N)")


def _read(folder: Path, *columns: tuple[str, ...], heads: tuple[str, ...] = HEADS, reading: Reading | None = None) -> LabTable:
    path = folder / "press.csv"
    path.write_text("\n".join(lines_of(heads, columns)[0]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


def _from_row(row: int, factor: str, decimals: int) -> tuple[str, ...]:
    return (*P.f[:row], *times(P.f[row:], factor, decimals))


def test_a_switched_unit_is_refused_with_its_line_the_ratio_and_both_readings(tmp_path: Path) -> None:
    force = _from_row(50, "101.9716213", 1)
    with pytest.raises(InputError) as caught:
        _read(tmp_path, P.t, P.d, force)
    (fault,) = caught.value.faults
    assert (fault.line, fault.column) == (52, 3)
    for word in ("101.972 times larger", f'"{P.f[49]}"', f'"{force[50]}"', "gf after N"):
        assert word in fault.message


def test_a_unit_that_the_file_names_and_the_user_says_once_more_is_believed_and_noted(tmp_path: Path) -> None:
    force = _from_row(50, "10", 3)
    with pytest.raises(InputError, match="say it once more: --units force="):
        _read(tmp_path, P.t, P.d, force)
    table = _read(tmp_path, P.t, P.d, force, reading=Reading(units={"force": "N"}))
    assert table.columns["force"][50] == float(force[50])
    assert any("10 times larger" in note and "as asked" in note for note in table.notes)


@pytest.mark.parametrize("said", ["mN", "10 N"])
def test_another_unit_than_that_of_the_file_does_not_settle_a_switch(tmp_path: Path, said: str) -> None:
    with pytest.raises(InputError, match="from this line on"):
        _read(tmp_path, P.t, P.d, _from_row(50, "10", 3), reading=Reading(units={"force": said}))


def test_a_unit_that_only_the_user_says_does_not_settle_a_switch(tmp_path: Path) -> None:
    heads = (*HEADS[:2], "Load")
    with pytest.raises(InputError, match="from this line on"):
        _read(tmp_path, P.t, P.d, _from_row(50, "10", 3), heads=heads, reading=Reading(units={"force": "N"}))


def test_a_load_that_jumps_by_ten_as_the_ball_does_is_no_switch(tmp_path: Path) -> None:
    ball = np.array(P.d, float)
    ball[50:] += 0.6
    table = _read(tmp_path, P.t, texts(ball, 4), _from_row(50, "10", 3))
    assert not any(table.reasons)


@pytest.mark.parametrize("start", [25, 40, 60])
def test_a_ball_that_comes_off_a_load_cell_that_was_not_zeroed_is_no_switch(tmp_path: Path, start: int) -> None:
    rng = np.random.default_rng(start)
    n = 120
    pull = -2.0 - 18.0 * np.clip(np.arange(n) / start, 0, 1)
    force = np.where(np.arange(n) < start, pull, -2.0) + rng.normal(0, 0.01, n)
    table = _read(tmp_path, P.t, texts(1.4 - 0.01 * np.arange(n), 4), texts(force, 4))
    assert not any(table.reasons)


def test_a_factor_of_no_quantity_is_asked_of_force_and_of_capacitance(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    lines = ["Amplifier factor 2", *lines_of((*HEADS, "Cp (pF)"), (P.t, P.d, P.f, P.c))[0]]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_lab_file(path)
    assert [f.column for f in caught.value.faults] == [3, 4]
    table = read_lab_file(path, Reading(units={"force": "0.5 N", "capacitance": "pF"}))
    np.testing.assert_allclose(table.columns["force"], 0.5 * np.array(P.f, float))


def test_a_parallel_capacitance_of_another_capacitor_than_the_series_one_is_a_choice(tmp_path: Path) -> None:
    heads, other = ("Time (s)", "Cp 2 (pF)", "Cs (pF)", "D"), texts(0.01 * np.sin(np.arange(120.0)), 4)
    with pytest.raises(InputError, match="not of the same capacitor"):
        _read(tmp_path, P.t, other, P.c, P.loss, heads=heads)
    columns = {"capacitance_series": "Cs (pF)"}
    table = _read(tmp_path, P.t, other, P.c, P.loss, heads=heads, reading=Reading(columns=columns))
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * np.array(P.c, float), rtol=1e-3)
    table = _read(tmp_path, P.t, P.c, P.c, P.loss, heads=("Time (s)", "Cp (pF)", "Cs (pF)", "D"))
    np.testing.assert_allclose(table.columns["capacitance"], 1e-12 * np.array(P.c, float))


@pytest.mark.parametrize("unit", ["C", "kPa"])
def test_a_second_column_does_not_take_the_place_of_a_first_whose_unit_is_impossible(tmp_path: Path, unit: str) -> None:
    heads = ("Time (s)", "Extension (mm)", "Load 2 (N)", f"Load ({unit})")
    with pytest.raises(InputError) as caught:
        _read(tmp_path, P.t, P.d, P.f, P.f, heads=heads)
    (fault,) = caught.value.faults
    assert '"Load 2 (N)" could be the force' in fault.message
    assert f'"Load ({unit})", which bears the plain name' in fault.message
    assert '--columns "force=Load 2 (N)"' in fault.advice
    table = _read(tmp_path, P.t, P.d, P.f, P.f, heads=heads, reading=Reading(columns={"force": "Load 2 (N)"}))
    np.testing.assert_allclose(table.columns["force"], [float(f) for f in P.f])


# ------------------------------------------------------ switches among scattering readings, at a turn, and just before a touch


def _noise(n: int, seed: int, level: float = 0.186, size: float = 0.006) -> list[float]:
    return [level + size * float(z) for z in np.random.default_rng(seed).normal(size=n)]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    ("factor", "decimals"), [(0.001, 6), (101.9716213, 3), (0.1019716213, 4), (10.0, 3), (0.2248089431, 4)]
)
def test_a_switch_among_readings_that_scatter_about_a_load_is_told(
    tmp_path: Path, factor: float, decimals: int, seed: int
) -> None:
    force = _noise(120, seed)
    written = (*texts(force[:80], 3), *texts([factor * f for f in force[80:]], decimals))
    with pytest.raises(InputError, match="from this line on") as caught:
        _read(tmp_path, P.t, P.d, written)
    assert abs((caught.value.faults[0].line or 0) - 82) <= 1


@pytest.mark.parametrize("n", [3, 8])
def test_a_block_in_another_unit_just_before_the_touch_is_told(tmp_path: Path, n: int) -> None:
    start = 40
    force = np.array(_noise(120, 3))
    force[start + n :] -= 0.4 * np.arange(1, 121 - start - n)
    written = tuple(
        f"{10 * f:.2f}" if start <= k < start + n else t
        for k, (f, t) in enumerate(zip(force.tolist(), texts(force, 3), strict=True))
    )
    with pytest.raises(InputError, match="10 times larger"):
        _read(tmp_path, P.t, P.d, written)


@pytest.mark.parametrize("loss", [0.0, 0.06, 0.12, 0.15])
@pytest.mark.parametrize("decimals", [3, 4])
def test_newtons_switched_to_pounds_where_the_press_turns_are_told(tmp_path: Path, loss: float, decimals: int) -> None:
    n, top = 120, 60
    ball = 1.2 * (1 - np.abs(np.arange(n) - top) / top)
    force = 8.0 * ball**1.5
    force[top + 1 :] *= 1 - loss
    written = (*texts(force[: top + 1], 3), *texts(force[top + 1 :] / 4.4482216, decimals))
    with pytest.raises(InputError, match="lbf after N"):
        _read(tmp_path, P.t, texts(ball, 4), written)


@pytest.mark.parametrize("left", [0.5, 0.3])
def test_a_sample_that_breaks_to_another_share_and_goes_on_is_no_switch(tmp_path: Path, left: float) -> None:
    ball = 1.2 * np.arange(120) / 119
    force = 8.0 * ball**1.5
    force[70:] *= left
    assert not any(_read(tmp_path, P.t, texts(ball, 4), texts(force, 3)).reasons)


@pytest.mark.parametrize("seed", range(6))
def test_coarse_or_wild_readings_about_zero_are_no_switches(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    coarse = np.concatenate([0.0003 + 0.0001 * rng.integers(0, 3, 60), 0.0012 + 0.0001 * rng.integers(0, 3, 60)])
    assert _read(tmp_path, P.t, P.d, texts(coarse, 4), heads=(*HEADS[:2], "Load (kN)")).columns["force"].size == 120
    wild = [_read(tmp_path, P.t, P.d, texts(0.01 * rng.normal(size=120), n)) for n in (4, 5) for _ in range(3)]
    assert all(table.columns["force"].size == 120 for table in wild)


def test_a_load_of_little_but_noise_that_jumps_by_ten_is_no_switch(tmp_path: Path) -> None:
    refused = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(100, 400))
        noise = rng.normal(size=n)
        for row in range(1, n):
            noise[row] = 0.8 * noise[row - 1] + 0.6 * noise[row]
        depth = np.linspace(-0.5, 0.5, n)
        force = 0.002 * (noise + 3.0 * np.maximum(depth, 0.0) ** 1.5)
        try:
            _read(tmp_path, texts(0.1 * np.arange(n), 1), texts(depth, 4), texts(force, 5))
        except InputError as error:
            refused += "from this line on" in str(error)
    assert refused == 0


@pytest.mark.parametrize(
    "first",
    [
        ("-0.0010", "-0.0008", "-0.0051", "-0.0044", "-0.0014"),
        ("0.0025", "0.0024", "0.0211", "0.0221", "0.0298"),
    ],
)
def test_noise_of_the_first_rows_is_no_switch(tmp_path: Path, first: tuple[str, ...]) -> None:
    course = (f"{0.006 + 0.05 * i**1.2:.4f}" for i in range(1, len(P.t) - len(first) + 1))
    force = (*first, *course)
    table = _read(tmp_path, P.t, tuple(f"{0.01 * i:.4f}" for i in range(len(P.t))), force)
    np.testing.assert_allclose(table.columns["force"], np.array(force, float))


# ------------------------------------------------------------- jumps that the ball makes, or that end where nothing is pressed


def _stair(steps: int, dwell: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """A stage that steps and waits, up and down again, with a touch on the way; the load of each row."""
    rng = np.random.default_rng(seed)
    levels = np.linspace(0.0, 1.0, steps + 1)
    ball = np.repeat(np.concatenate([levels, levels[-2::-1]]), dwell)
    force = 3.0 * np.clip((ball - rng.uniform(0.2, 0.4)) / 0.7, 0, None) ** 1.5 + rng.normal(0, 0.002, ball.size)
    return ball + rng.normal(0, 1e-4, ball.size), force + 0.01


@pytest.mark.parametrize("dwell", [2, 3, 4])
def test_a_load_that_jumps_because_a_stage_steps_and_waits_is_no_switch(tmp_path: Path, dwell: int) -> None:
    for seed in range(20):
        ball, force = _stair(6 + seed, dwell, seed)
        time = texts(0.5 * np.arange(ball.size), 1)
        assert _read(tmp_path, time, texts(ball, 4), texts(force, 4)).columns["force"].size == ball.size


@pytest.mark.parametrize(("factor", "words"), [(101.9716213, "gf after N"), (0.2248089431, "lbf after N"), (1000.0, "1,000")])
def test_a_unit_that_is_switched_while_a_stage_steps_and_waits_is_told(tmp_path: Path, factor: float, words: str) -> None:
    ball, force = _stair(10, 4, 1)
    row = 4 * 9 + 2
    written = (*texts(force[:row], 4), *texts(factor * force[row:], 4))
    with pytest.raises(InputError, match="from this line on") as caught:
        _read(tmp_path, texts(0.5 * np.arange(ball.size), 1), texts(ball, 4), written)
    assert words in caught.value.faults[0].message
    assert caught.value.faults[0].line == row + 2


@pytest.mark.parametrize("seed", range(12))
def test_a_ball_that_snaps_off_to_noise_about_zero_is_no_switch(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    ball = np.tile(np.concatenate([np.linspace(0, 1, 30), np.linspace(1, 0, 31)[1:]]), 3)
    force = 3.0 * np.clip(ball - 0.3, 0, None) ** 1.5 + rng.normal(0, 0.004, ball.size)
    for cycle in range(3):
        top, off = 60 * cycle + 29, 60 * cycle + 53
        force[top:off] = np.linspace(force[top], -rng.uniform(0.2, 1.5), off - top) + rng.normal(0, 0.004, off - top)
        force[off : 60 * cycle + 60] = rng.normal(0, 0.004, 60 * cycle + 60 - off)
    _read(tmp_path, texts(0.04 * np.arange(ball.size), 2), texts(ball, 4), texts(-force, 4))

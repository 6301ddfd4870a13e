"""Grades on lab files: each check objects at a known number, stays quiet on a clean test, and is right on real files."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from scipy.signal import lfilter

from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.reader import read_lab_file
from calib.lab.observations import Observations, observe
from calib.lab.pressing import make_sweep
from calib.lab.quality.grade import Grade, worst_first
from calib.lab.quality.judgement import judge
from calib.lab.quality.material import LIGHT_RIG
from calib.lab.quality.words import grade_rows, number_text, quality_in_words
from calib.lab.sweep import sweeps_from_json, sweeps_to_json
from calib.lab.use import FIRST_LOADING, Use
from models.sensor import BoolArray, FloatArray

SHARED = Path(__file__).resolve().parents[4] / "shared" / "labdata"
DATASETS = Path(__file__).resolve().parents[3] / "datasets" / "padded_sensor"
needs_labdata = pytest.mark.skipif(not SHARED.is_dir(), reason="the folder of real lab files is not here")


@dataclass(frozen=True)
class Test:
    """A pressing of 5 N and 0.8 mm after 0.2 mm of approach, logged every 0.1 s. Lengths in mm, time in s, force in N."""

    __test__ = False

    approach: float = 0.2
    depth: float = 0.8
    speed: float = 0.01
    interval: float = 0.1
    hold: float = 0.0
    unloading: bool = True
    hysteresis: float = 0.05
    relaxation: float = 0.0
    load_zero: float = 0.2
    drift: float = 0.0  # [N/s]
    noise: float = 2e-3
    decimals: int = 3
    limit: float = math.inf

    @property
    def top(self) -> float:
        return (self.approach + self.depth) / self.speed

    def columns(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        end = self.top + self.hold + (self.top if self.unloading else 0.0)
        t = np.arange(0, end + 1e-9, self.interval)
        x = np.interp(t, [0, self.top, self.top + self.hold, 2 * self.top + self.hold], [0, self.top, self.top, 0]) * self.speed
        d = np.maximum(x - self.approach, 0) / self.depth
        back = np.where(t > self.top + self.hold, 1 - self.hysteresis, 1.0)
        relaxed = 1 - self.relaxation * np.clip((t - self.top) / max(self.hold, 1e-9), 0, 1)
        noise = self.noise * np.random.default_rng(1).normal(size=t.size)
        f = 5 * d**1.6 * back * relaxed + self.load_zero + self.drift * t + noise
        return t, x, np.minimum(f, self.limit)

    def file(self, folder: Path, keep: Callable[[FloatArray], BoolArray] | None = None) -> Path:
        t, x, f = self.columns()
        rows = np.ones(t.size, dtype=bool) if keep is None else keep(t).astype(bool)
        lines = [f"{a:.4f},{b:.5f},{c:.{self.decimals}f}\n" for a, b, c in zip(t[rows], x[rows], f[rows], strict=True)]
        path = folder / "tester.csv"
        path.write_text("Time (s),Extension (mm),Load (N)\n" + "".join(lines))
        return path

    def observe(self, folder: Path, keep: Callable[[FloatArray], BoolArray] | None = None) -> Observations:
        return observe(read_lab_file(self.file(folder, keep)))


def grade(obs: Observations, check: str, channel: str = "force", compliance: float | None = None) -> Grade:
    found = [v for v in judge(obs, compliance) if v.check == check and v.channel == channel]
    assert len(found) == 1, f"{check} of {channel}: {len(found)} grades"
    return found[0]


def checks(obs: Observations) -> set[str]:
    return {v.check for v in judge(obs)}


# --------------------------------------------------------------------------------------------------- a clean test, shape


def test_every_check_gives_a_good_verdict_with_its_number_on_a_clean_test(tmp_path: Path) -> None:
    grades = judge(Test(hold=5.0).observe(tmp_path), machine_compliance=2e-6)
    assert {v.check for v in grades} == {
        "readings in contact",
        "signal",
        "gap in time",
        "even time steps",
        "size",
        "resolution",
        "clipping",
        "start before contact",
        "drift before contact",
        "return to zero",
        "change in the hold",
        "load zero",
        "hysteresis",
        "machine compliance",
    }
    assert [v for v in grades if v.level != "good"] == []
    assert all(math.isfinite(v.number) and v.finding and not v.advice for v in grades)
    assert {v.file for v in grades} == {"tester.csv"}
    assert quality_in_words(grades) == "14 checks: all good."


def test_verdicts_do_not_change_the_observations(tmp_path: Path) -> None:
    obs = Test().observe(tmp_path)
    assert obs.force is not None
    force, used = obs.force.copy(), obs.used.copy()
    judge(obs)
    np.testing.assert_array_equal(obs.force, force)
    np.testing.assert_array_equal(obs.used, used)


def test_objections_come_first_and_with_advice(tmp_path: Path) -> None:
    grades = judge(Test(interval=4.0, decimals=1, unloading=False).observe(tmp_path))
    levels = [row[0] for row in grade_rows(grades)]
    assert levels == sorted(levels, key=["bad", "warning", "good"].index)
    assert levels[0] == "bad"
    assert all(bool(row[4]) == (row[0] != "good") for row in grade_rows(grades))
    words = quality_in_words(grades)
    assert words.startswith(f"{len(grades)} checks: ")
    assert "resolution, force, of tester.csv" in words


@pytest.mark.parametrize(("window", "late"), [(1, False), (5, False), (300, True), (900, True)])
def test_a_channel_that_is_averaged_over_a_part_of_the_press_is_late(tmp_path: Path, window: int, late: bool) -> None:
    t, x, f = Test(load_zero=0.0).columns()
    before = np.cumsum(np.concatenate([np.full(window, f[0]), f]))
    averaged = (before[window:] - before[:-window]) / window
    path = tmp_path / "tester.csv"
    rows = (f"{a:.1f},{b:.5f},{c:.4f}\n" for a, b, c in zip(t, x, averaged, strict=True))
    path.write_text("Time (s),Extension (mm),Load (N)\n" + "".join(rows))
    found = [v for v in judge(observe(read_lab_file(path))) if v.check == "late readings"]
    assert [v.level for v in found] == (["bad"] if late else [])
    assert all(v.number > 0.02 and "average" in v.advice for v in found)


@pytest.mark.parametrize("depth", [0.2, 0.5, 0.79, 1.0])
@pytest.mark.parametrize(("window", "late"), [(1, False), (300, True)])
def test_a_stiffer_sample_that_is_pressed_next_makes_no_reading_late(
    tmp_path: Path, depth: float, window: int, late: bool
) -> None:
    _, x, f = Test().columns()
    x, f = np.concatenate([x, x[1:] * (0.2 + depth * 0.8)]), np.concatenate([f, 2.5 * f[1:] * depth**1.6])
    f = np.convolve(np.concatenate([np.full(window - 1, f[0]), f]), np.full(window, 1 / window), "valid")
    path = tmp_path / "tester.csv"
    rows = "".join(f"{0.1 * i:.4f},{a:.5f},{b:.4f}\n" for i, (a, b) in enumerate(zip(x, f, strict=True)))
    path.write_text("Time (s),Extension (mm),Load (N)\n" + rows)
    found = [v for v in judge(observe(read_lab_file(path))) if v.check == "late readings"]
    assert [v.level for v in found] == (["bad"] if late else [])


@pytest.mark.parametrize("seconds", [-0.5, 0.0, 1.0, 4.0, 20.0])
@pytest.mark.parametrize("falls", [1, -1])
def test_a_channel_that_runs_ahead_of_the_press_is_early(tmp_path: Path, seconds: float, falls: int) -> None:
    test = Test(hysteresis=0.0)
    t, x, f = test.columns()
    ahead = np.interp(t + seconds, t, f)
    capacitance = 97.0 + falls * 0.4 * ahead
    path = tmp_path / "ahead.csv"
    rows = (f"{a:.2f},{b:.5f},{c:.4f},{e:.4f}\n" for a, b, c, e in zip(t, x, f, capacitance, strict=True))
    path.write_text("Time (s),Extension (mm),Load (N),Cp (pF)\n" + "".join(rows))
    found = [v for v in judge(observe(read_lab_file(path))) if v.check == "early readings"]
    assert [(v.channel, v.level) for v in found] == ([("capacitance", "bad")] if seconds > 2 else [])
    assert all("look at the clocks" in v.advice and "goes deeper" in v.finding for v in found)


@pytest.mark.parametrize("kind", ["relaxes", "spikes", "drifts", "is held"])
def test_what_goes_on_at_the_top_of_a_press_is_not_early(tmp_path: Path, kind: str) -> None:
    test = Test(hold=5.0 if kind != "spikes" else 0.0, relaxation=0.2 if kind == "relaxes" else 0.0)
    t, x, f = test.columns()
    if kind == "spikes":
        f[600] += 8.0
    if kind == "drifts":
        f = f - 0.02 * t
    if kind == "is held":
        x = x + np.where((t > test.top) & (t < test.top + 5.0), 2e-4 * (t - test.top), 0.0)
    path = tmp_path / "press.csv"
    path.write_text(
        "Time (s),Extension (mm),Load (N)\n" + "".join(f"{a:.2f},{b:.5f},{c:.4f}\n" for a, b, c in zip(t, x, f, strict=True))
    )
    assert "early readings" not in checks(observe(read_lab_file(path)))


@pytest.mark.parametrize("column", ["Extension (mm)", "Load (N)"])
@pytest.mark.parametrize("apart", [-3, -2, -1, 0, 1, 2, 3, 4])
@pytest.mark.parametrize("relaxes", [0.0, 0.2])
def test_a_column_pasted_some_rows_off_turns_in_another_row(tmp_path: Path, column: str, apart: int, relaxes: float) -> None:
    rng = np.random.default_rng(7)
    t = np.arange(120) * 0.1
    fine = np.linspace(0, t[-1], 12_000)
    x = np.interp(fine, [0, 7.03, t[-1]], [0, 1.4, 0.1])
    elastic = 8.0 * np.clip(x - 0.2, 0, None) ** 1.6
    step = fine[1]
    slow = step * lfilter([1.0], [1, -np.exp(-step / 1.5)], np.gradient(elastic, step))
    f = np.interp(t, fine, (1 - relaxes) * elastic + relaxes * slow) + 0.004 * rng.normal(size=t.size)
    columns = {"Extension (mm)": np.interp(t, fine, x), "Load (N)": f}
    columns[column] = np.roll(columns[column], apart)
    if apart:
        columns[column][slice(apart) if apart > 0 else slice(apart, None)] = columns[column][apart if apart > 0 else apart - 1]
    rows = zip(t, *columns.values(), strict=True)
    path = tmp_path / "press.csv"
    path.write_text("Time (s),Extension (mm),Load (N)\n" + "".join(f"{a:.1f},{b:.5f},{c:.4f}\n" for a, b, c in rows))
    found = [v for v in judge(observe(read_lab_file(path))) if v.check == "rows apart"]
    assert [v.level for v in found] == (["warning"] if apart else [])
    late = apart if column == "Load (N)" else -apart
    assert all(v.number == pytest.approx(late, abs=0.35) and "pasted" in v.advice for v in found)


@pytest.mark.parametrize("apart", [-5, -3, -2, -1, 0, 1, 2, 3, 5])
@pytest.mark.parametrize("turn", [60.0, 59.97, 60.04])
def test_a_column_pasted_some_rows_off_is_told_where_the_ball_turns_at_a_reading(
    tmp_path: Path, turn: float, apart: int
) -> None:
    x = 1.4 - 0.02 * np.abs(np.arange(121) - turn)
    f = np.roll(8.0 * np.clip(x - 0.4, 0, None) ** 1.6, apart) + 0.004 * np.random.default_rng(3).normal(size=x.size)
    cells = [f"{b:.4f}" if 0 <= i - apart < x.size else "" for i, b in enumerate(f)]
    rows = "".join(f"{0.1 * i:.1f},{a:.5f},{b}\n" for i, (a, b) in enumerate(zip(x, cells, strict=True)))
    path = tmp_path / "press.csv"
    path.write_text("Time (s),Extension (mm),Load (N)\n" + rows)
    found = [v for v in judge(observe(read_lab_file(path))) if v.check == "rows apart"]
    assert [round(v.number) for v in found] == ([apart] if apart else [])
    assert all(v.level == "bad" and f"{abs(apart)} cells are empty" in v.finding for v in found)


@pytest.mark.parametrize("held", ["drop", "backlash", "hold"])
def test_what_a_machine_does_at_a_turn_is_no_shift_by_a_row(tmp_path: Path, held: str) -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        x = np.concatenate([np.linspace(0, 1.4, 70), np.full(10 if held == "hold" else 0, 1.4), np.linspace(1.38, 0.1, 50)])
        f = 8.0 * np.clip(x - 0.2, 0, None) ** 1.6
        if held == "drop":
            f[70:] *= rng.uniform(0.75, 0.97)
        elif held == "backlash":
            f[72:] = f[70:-2]
            f[70:72] = f[69]
        f += 0.004 * rng.normal(size=x.size)
        path = tmp_path / "press.csv"
        rows = "".join(f"{0.1 * i:.1f},{a:.5f},{b:.4f}\n" for i, (a, b) in enumerate(zip(x, f, strict=True)))
        path.write_text("Time (s),Extension (mm),Load (N)\n" + rows)
        assert not [v for v in judge(observe(read_lab_file(path))) if v.check == "rows apart"]


def test_worst_first_keeps_the_order_within_a_level() -> None:
    levels: dict[str, Literal["good", "bad"]] = {"a": "good", "b": "bad", "c": "good", "d": "bad"}
    made = [Grade(check, level, 1.0, "N", "", "", "force", "f") for check, level in levels.items()]
    assert [v.check for v in worst_first(made)] == ["b", "d", "a", "c"]


@pytest.mark.parametrize(
    ("number", "unit", "text"),
    [(0.123, "1", "12 %"), (1.7, "1", "170 %"), (2e-4, "m", "0.2 mm"), (1.0, "readings", "1 reading"), (-0.46, "N", "-0.46 N")],
)
def test_numbers_are_shown_in_the_units_of_people(number: float, unit: str, text: str) -> None:
    assert number_text(Grade("x", "good", number, unit, "", "", "force", "f")) == text


def test_a_file_without_a_loading_branch_gets_no_verdict(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("Extension (mm),Load (N)\n0,0\n0.1,1\n0.2,2\n")
    assert judge(observe(read_lab_file(tmp_path / "t.csv"))) == ()


# ------------------------------------------------------------------------------------------------------------ each check


@pytest.mark.parametrize(("interval", "level"), [(0.1, "good"), (4.0, "warning"), (8.0, "bad")])
def test_few_readings_in_contact_are_counted(tmp_path: Path, interval: float, level: str) -> None:
    found = grade(Test(interval=interval).observe(tmp_path), "readings in contact")
    assert found.level == level
    assert found.number == pytest.approx(80 / interval, rel=0.15, abs=2)
    assert found.unit == "readings"


@pytest.mark.parametrize(("noise", "level"), [(2e-3, "good"), (0.25, "warning"), (1.0, "bad")])
def test_a_signal_in_the_noise_is_told_by_their_ratio(tmp_path: Path, noise: float, level: str) -> None:
    obs = Test(noise=noise).observe(tmp_path)
    found = grade(obs, "signal")
    assert found.level == level
    assert found.number == pytest.approx(5 / noise, rel=0.5)
    # Where nothing but noise is, no other share of the range is claimed.
    assert ("hysteresis" in checks(obs)) == (level != "bad")


@pytest.mark.parametrize(("decimals", "steps", "level"), [(3, 5000, "good"), (1, 50, "bad")])
def test_coarse_steps_of_the_load_are_told_by_their_number(tmp_path: Path, decimals: int, steps: float, level: str) -> None:
    found = grade(Test(decimals=decimals).observe(tmp_path), "resolution")
    assert (found.level, found.unit) == (level, "steps")
    assert found.number == pytest.approx(steps, rel=0.03)


@pytest.mark.parametrize(("step", "level"), [(0.002, ""), (0.01, ""), (0.025, "warning"), (0.1, "bad"), (0.2, "bad")])
def test_a_displacement_that_is_rounded_coarsely_is_told_by_what_it_does_to_a_modulus(
    tmp_path: Path, step: float, level: str
) -> None:
    t, x, f = Test().columns()
    place = np.round(x / step) * step
    rows = [f"{a:.2f},{b:.4f},{c:.4f},{97 + 0.4 * c:.4f}\n" for a, b, c in zip(t, place, f, strict=True)]
    path = tmp_path / "rounded.csv"
    path.write_text("Time (s),Extension (mm),Load (N),Cp (pF)\n" + "".join(rows))
    found = [v for v in judge(observe(read_lab_file(path))) if v.check == "resolution of displacement"]
    assert [v.level for v in found] == ([level] if level else [])
    for v in found:
        assert v.number == pytest.approx(1.5 * step / math.sqrt(12) / 0.8, rel=0.3)
        assert "more decimals" in v.advice
        assert f"in steps of {step:.3g} mm" in v.finding


def test_a_drive_that_goes_by_steps_and_rests_is_not_rounded(tmp_path: Path) -> None:
    t = np.arange(0.0, 160.0, 0.5)
    x = np.round(np.minimum(np.floor(t / 5), 31 - np.floor(t / 5)) * 0.05, 4)
    f = 5 * np.maximum(x - 0.1, 0) ** 1.6 * (1 + 0.02 * np.exp(-(t % 5)))
    path = tmp_path / "steps.csv"
    path.write_text(
        "Time (s),Extension (mm),Load (N)\n" + "".join(f"{a:.2f},{b:.4f},{c:.4f}\n" for a, b, c in zip(t, x, f, strict=True))
    )
    assert "resolution of displacement" not in checks(observe(read_lab_file(path)))


def test_steps_of_a_converter_are_seen_behind_many_digits(tmp_path: Path) -> None:
    t, x, f = Test(noise=0.0).columns()
    count = 0.04883712345678
    lines = [f"{a:.4f},{b:.5f},{count * round(c / count):.15f}\n" for a, b, c in zip(t, x, f, strict=True)]
    (tmp_path / "t.csv").write_text("Time (s),Extension (mm),Load (N)\n" + "".join(lines))
    found = grade(observe(read_lab_file(tmp_path / "t.csv")), "resolution")
    assert found.level == "warning"
    assert found.number == pytest.approx(5 / count, rel=0.02)


def _table(folder: Path, header: str, columns: list[list[str]]) -> Observations:
    path = folder / "t.csv"
    path.write_text(header + "\n" + "".join(",".join(row) + "\n" for row in zip(*columns, strict=True)))
    return observe(read_lab_file(path))


@pytest.mark.parametrize(("unit", "newton"), [("N", 1.0), ("mN", 1e-3), ("lbf", 4.4482216), ("kgf", 9.80665)])
@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_few_readings_far_apart_have_the_step_of_their_last_digit(
    tmp_path: Path, unit: str, newton: float, noise: float
) -> None:
    _, x, f = Test(noise=noise, approach=0.01, load_zero=0.0, interval=1.5).columns()
    cells = [[f"{v:.4f}" for v in x], [f"{v:.3f}" for v in 0.37 * f / newton]]
    found = grade(_table(tmp_path, f"Extension (mm),Load ({unit})", cells), "resolution")
    assert found.number == pytest.approx(0.37 * 5 / newton / 0.001, rel=0.1)


@pytest.mark.parametrize("step", [0.02, 0.03, 0.04883, 0.0127])
@pytest.mark.parametrize(("decimals", "noise", "strays"), [(3, 0.0, 0), (4, 0.0, 0), (3, 0.03, 0), (4, 0.03, 2), (8, 0.0, 3)])
@pytest.mark.parametrize("unit", ["N", "lbf"])
def test_steps_of_a_coarse_display_are_seen_behind_more_decimals(
    tmp_path: Path, step: float, decimals: int, noise: float, strays: int, unit: str
) -> None:
    _, x, f = Test(noise=noise, interval=0.3).columns()
    shown = step * np.round(f / step)
    shown[40 : 40 + 17 * strays : 17] += 0.37 * step
    cells = [[f"{v:.4f}" for v in x], [f"{v:.{decimals}f}" for v in shown]]
    found = grade(_table(tmp_path, f"Extension (mm),Load ({unit})", cells), "resolution")
    assert found.number == pytest.approx(5 / step, rel=0.05)


@pytest.mark.parametrize(("step", "level"), [(1e-4, "good"), (0.02, "warning"), (0.05, "bad")])
@pytest.mark.parametrize(("unit", "picofarad"), [("pF", "{:.4f}"), ("F", "{:.6f}E-12")])
def test_a_converted_series_capacitance_has_the_steps_in_which_it_was_written(
    tmp_path: Path, step: float, level: str, unit: str, picofarad: str
) -> None:
    _, x, f = Test(interval=0.3, noise=0.01).columns()
    series = step * np.round((97 + 0.5 * f) / step)
    loss = 0.0123 + 1e-4 * np.random.default_rng(3).normal(size=x.size)
    cells = [[f"{v:.4f}" for v in x], [picofarad.format(v) for v in series], [f"{v:.5f}" for v in loss]]
    found = grade(_table(tmp_path, f"Extension (mm),Cs ({unit}),D", cells), "resolution", "capacitance")
    assert found.level == level
    assert found.number == pytest.approx(2.5 / step, rel=0.05)


@pytest.mark.parametrize(("limit", "level"), [(math.inf, "good"), (5.12, "warning"), (4.0, "bad")])
def test_a_flat_top_while_the_crosshead_goes_on_is_clipping(tmp_path: Path, limit: float, level: str) -> None:
    found = grade(Test(limit=limit).observe(tmp_path), "clipping")
    assert found.level == level
    if level == "bad":
        # F = 3.8 N is reached at (3.8 / 5)^(1 / 1.6) of the depth, and the rest of the loading branch is lost.
        assert found.number == pytest.approx(800 * (1 - 0.76 ** (1 / 1.6)), abs=12)
        assert "4 N" in found.finding


@pytest.mark.parametrize(("limit", "level"), [(math.inf, "good"), (4.8, "bad"), (4.0, "bad"), (2.5, "bad")])
def test_a_flat_top_under_noise_is_clipping(tmp_path: Path, limit: float, level: str) -> None:
    t, x, f = Test(limit=limit, noise=0.0).columns()
    f += 3e-3 * np.random.default_rng(2).normal(size=f.size)
    lines = [f"{a:.4f},{b:.5f},{c:.4f}\n" for a, b, c in zip(t, x, f, strict=True)]
    (tmp_path / "t.csv").write_text("Time (s),Extension (mm),Load (N)\n" + "".join(lines))
    found = grade(observe(read_lab_file(tmp_path / "t.csv")), "clipping")
    assert found.level == level
    if level == "bad":
        assert "levels off" in found.finding


@pytest.mark.parametrize("seed", range(8))
def test_a_press_that_gets_softer_does_not_level_off(tmp_path: Path, seed: int) -> None:
    # A foam whose cells collapse: the rise falls to a third, and does not end.
    t = np.arange(0, 80, 0.1)
    x = 0.01 * t
    d = np.maximum(x - 0.2, 0.0)
    f = 4 * np.tanh((d / 0.3) ** 1.6) + 0.8 * d + 5e-3 * np.random.default_rng(seed).normal(size=t.size)
    lines = [f"{a:.4f},{b:.5f},{c:.4f}\n" for a, b, c in zip(t, x, f, strict=True)]
    (tmp_path / "t.csv").write_text("Time (s),Extension (mm),Load (N)\n" + "".join(lines))
    assert grade(observe(read_lab_file(tmp_path / "t.csv")), "clipping").level == "good"


@pytest.mark.parametrize("units", [{"force": "kN"}, {"displacement": "m"}])
def test_a_press_that_no_ball_in_silicone_makes_asks_for_its_units(tmp_path: Path, units: dict[str, str]) -> None:
    found = grade(observe(read_lab_file(Test().file(tmp_path), Reading(units=units))), "size")
    assert found.level == "warning"
    assert "--units" in found.advice


@pytest.mark.parametrize(("each", "places"), [(10, 21), (20, 11), (5, 41), (40, 6)])
@pytest.mark.parametrize("limit", [math.inf, 2.0])
def test_readings_while_the_ball_stands_on_a_step_are_no_clipping(tmp_path: Path, each: int, places: int, limit: float) -> None:
    x = np.repeat(np.linspace(0.0, 1.0, places), each)
    x = np.concatenate([x, x[::-1]])
    noise = 2e-3 * np.random.default_rng(3).normal(size=x.size)
    f = np.minimum(5 * np.maximum(x - 0.2, 0.0) ** 1.5, limit) + noise
    lines = [f"{0.5 * i:.1f},{b:.3f},{c:.3f}\n" for i, (b, c) in enumerate(zip(x, f, strict=True))]
    (tmp_path / "t.csv").write_text("Time (s),Extension (mm),Load (N)\n" + "".join(lines))
    found = grade(observe(read_lab_file(tmp_path / "t.csv")), "clipping")
    if math.isinf(limit):
        assert found.level == "good"
    elif places > 20:
        assert found.level == "bad"


def test_coarse_steps_alone_are_no_clipping(tmp_path: Path) -> None:
    assert grade(Test(decimals=1, noise=0.0).observe(tmp_path), "clipping").level == "good"


def test_a_record_that_starts_in_contact_is_bad(tmp_path: Path) -> None:
    obs = Test().observe(tmp_path, keep=lambda t: t > 30)
    found = grade(obs, "start before contact")
    assert (found.level, found.number, found.unit) == ("bad", 0.0, "m")
    assert "drift before contact" not in checks(obs)
    assert "in contact or not" in grade(obs, "load zero").finding


def test_a_balanced_cell_that_starts_at_first_touch_is_a_warning(tmp_path: Path) -> None:
    found = grade(
        Test(load_zero=0.0, approach=0.0, noise=1e-3).observe(tmp_path, keep=lambda t: t > 0.7), "start before contact"
    )
    assert found.level == "warning"
    assert "light touch" in found.finding


@pytest.mark.parametrize(("approach", "level"), [(0.2, "good"), (0.012, "warning")])
def test_the_travel_before_contact_is_measured(tmp_path: Path, approach: float, level: str) -> None:
    found = grade(Test(approach=approach, noise=5e-4).observe(tmp_path), "start before contact")
    assert found.level == level
    assert found.number == pytest.approx(approach * 1e-3, abs=0.01e-3)


def test_a_curve_that_stiffens_has_no_flat_part(tmp_path: Path) -> None:
    x = np.linspace(0, 20, 1200)
    f = 40 * x / (22 - x) + 0.02 * np.random.default_rng(2).normal(size=x.size) + 4
    lines = "".join(f"{0.1 * i:.1f},{a:.4f},{b:.3f}\n" for i, (a, b) in enumerate(zip(x, f, strict=True)))
    (tmp_path / "t.csv").write_text("Time (s),Extension (mm),Load (N)\n" + lines)
    assert grade(observe(read_lab_file(tmp_path / "t.csv")), "start before contact").level == "bad"


@pytest.mark.parametrize(("share", "level"), [(0.0, "good"), (0.03, "warning"), (-0.03, "warning"), (0.08, "bad")])
def test_drift_before_contact_is_scaled_to_the_loading(tmp_path: Path, share: float, level: str) -> None:
    found = grade(Test(drift=share * 5 / 100, approach=0.4, depth=0.6).observe(tmp_path), "drift before contact")
    assert found.level == level
    assert found.number == pytest.approx(share, abs=0.1 * abs(share) + 1e-3)


def test_drift_is_seen_while_the_crosshead_waits(tmp_path: Path) -> None:
    t, x, f = Test(approach=0.05, unloading=False).columns()
    wait = np.arange(0, 60, 0.1)
    rng = np.random.default_rng(4)
    t, x = np.concatenate([wait, t + 60]), np.concatenate([0 * wait, x])
    f = np.concatenate([0.2 + 2e-3 * rng.normal(size=wait.size), f]) + 2e-3 * t
    lines = "".join(f"{a:.3f},{b:.5f},{c:.4f}\n" for a, b, c in zip(t, x, f, strict=True))
    (tmp_path / "t.csv").write_text("Time (s),Extension (mm),Load (N)\n" + lines)
    found = grade(observe(read_lab_file(tmp_path / "t.csv")), "drift before contact")
    assert found.level == "warning"
    assert found.number == pytest.approx(2e-3 * 85 / 5.17, rel=0.03)
    assert "from 63" in found.finding  # 600 readings of the wait and four fifths of the approach


@pytest.mark.parametrize(
    ("share", "level"), [(0.0, "good"), (0.003, "good"), (0.008, "warning"), (-0.03, "warning"), (0.08, "bad")]
)
def test_a_load_that_does_not_come_back_after_the_press_is_scaled_to_the_loading(
    tmp_path: Path, share: float, level: str
) -> None:
    found = grade(Test(drift=share * 5 / 100, hold=10.0).observe(tmp_path), "return to zero")
    assert found.level == level
    assert found.number == pytest.approx(share, abs=0.1 * abs(share) + 5e-4)
    assert ("higher" if share > 0 else "lower") in found.finding or share == 0


def test_a_ball_that_still_sticks_where_it_touched_is_no_drift_and_a_record_that_ends_there_says_nothing(
    tmp_path: Path,
) -> None:
    t, x, f = Test(hysteresis=0.0).columns()
    back = t > t[-1] / 2
    stuck = np.where(back & (x < 0.2), -0.4 * np.maximum(x - 0.12, 0) / 0.08, 0.0)
    lines = [f"{a:.3f},{b:.5f},{c:.4f}\n" for a, b, c in zip(t, x, f + stuck, strict=True)]
    (tmp_path / "t.csv").write_text("Time (s),Extension (mm),Load (N)\n" + "".join(lines))
    assert grade(observe(read_lab_file(tmp_path / "t.csv")), "return to zero").level == "good"
    short = [line for line, over in zip(lines, ~back | (x > 0.15), strict=True) if over]
    (tmp_path / "t.csv").write_text("Time (s),Extension (mm),Load (N)\n" + "".join(short))
    assert "return to zero" not in checks(observe(read_lab_file(tmp_path / "t.csv")))


@pytest.mark.parametrize("beside", ["Time (s)", "Extension (mm)", "Load (N)"])
@pytest.mark.parametrize(("share", "level"), [(0.0, "good"), (0.03, "warning"), (-0.03, "warning"), (0.08, "bad")])
def test_a_meter_that_does_not_come_back_is_told_whatever_ties_its_log_to_the_press(
    tmp_path: Path, share: float, level: str, beside: str
) -> None:
    test = Test(hysteresis=0.0)
    t, x, f = test.columns()
    path = test.file(tmp_path)
    depth = np.maximum(x - test.approach, 0) / test.depth
    read = 100 + 1.5 * (depth**1.4 + share * t / (t[-1] / 2)) + 2e-3 * np.random.default_rng(2).normal(size=t.size)
    column = {"Time (s)": t + 7.0, "Extension (mm)": x, "Load (N)": f}[beside]
    meter = tmp_path / "meter.csv"
    meter.write_text(f"{beside},Cp (pF)\n" + "".join(f"{a:.4f},{b:.4f}\n" for a, b in zip(column, read, strict=True)))
    sweep = make_sweep("a", "", indenter_radius=5e-3, force_file=path, capacitance_file=meter)
    (found,) = [g for g in sweep.grades if g.check == "return to zero" and g.channel == "capacitance"]
    assert found.level == level
    assert found.number == pytest.approx(share, abs=0.15 * abs(share) + 2e-3)


@pytest.mark.parametrize(("relaxation", "level"), [(0.02, "good"), (0.1, "warning"), (0.4, "bad")])
def test_relaxation_in_a_hold_is_told_as_a_share(tmp_path: Path, relaxation: float, level: str) -> None:
    found = grade(Test(hold=20.0, relaxation=relaxation).observe(tmp_path), "change in the hold")
    assert found.level == level
    # The ends of the hold are means over a fifth of it each.
    assert found.number == pytest.approx(-0.8 * relaxation, rel=0.1)


@pytest.mark.parametrize(("hysteresis", "level"), [(0.05, "good"), (0.2, "warning"), (0.4, "bad"), (-0.1, "warning")])
def test_hysteresis_is_the_share_of_work_not_given_back(tmp_path: Path, hysteresis: float, level: str) -> None:
    found = grade(Test(hysteresis=hysteresis).observe(tmp_path), "hysteresis")
    assert found.level == level
    assert found.number == pytest.approx(hysteresis, abs=0.005)


def test_without_unloading_there_is_no_verdict_on_hysteresis(tmp_path: Path) -> None:
    assert "hysteresis" not in checks(Test(unloading=False).observe(tmp_path))


def test_of_several_cycles_the_first_gives_the_hysteresis(tmp_path: Path) -> None:
    _, x, f = Test(hysteresis=0.2).columns()
    _, _, later = Test(hysteresis=0.02).columns()
    x, f = np.concatenate([x, x[1:]]), np.concatenate([f, later[1:]])
    lines = "".join(f"{0.1 * i:.3f},{b:.5f},{c:.4f}\n" for i, (b, c) in enumerate(zip(x, f, strict=True)))
    (tmp_path / "t.csv").write_text("Time (s),Extension (mm),Load (N)\n" + lines)
    assert grade(observe(read_lab_file(tmp_path / "t.csv")), "hysteresis").number == pytest.approx(0.2, abs=0.005)


@pytest.mark.parametrize(("compliance", "level"), [(2e-6, "good"), (30e-6, "warning"), (100e-6, "bad"), (None, "warning")])
def test_the_machine_takes_its_share_of_the_travel(tmp_path: Path, compliance: float | None, level: str) -> None:
    found = grade(Test().observe(tmp_path), "machine compliance", compliance=compliance)
    assert found.level == level
    assert found.number == pytest.approx((compliance or LIGHT_RIG) * 5 / 0.8e-3, rel=0.02)
    assert re.search(r"10 % at 1[56][0-9.]* and 50 % at (79|80)[0-9.]* µm/N", found.finding)


def test_what_is_warned_of_and_what_is_believed_where_no_compliance_is_given_are_told_together(tmp_path: Path) -> None:
    obs = Test().observe(tmp_path)
    (found,) = (g for g in judge(obs, believed_compliance=5.6e-6) if g.check == "machine compliance")
    alone = grade(obs, "machine compliance")
    assert (found.level, found.number) == (alone.level, alone.number)
    assert found.finding == f"{alone.finding}; without a prior a calibration believes at most 5.6 µm/N, 3.5 % of the travel"


def test_an_unknown_compliance_never_says_bad(tmp_path: Path) -> None:
    assert grade(Test(depth=0.1).observe(tmp_path), "machine compliance").level == "warning"


@pytest.mark.parametrize(("gap", "level"), [(0.1, "good"), (1.8, "good"), (5.0, "warning"), (30.0, "bad")])
def test_a_gap_while_loading_is_measured(tmp_path: Path, gap: float, level: str) -> None:
    found = grade(Test().observe(tmp_path, keep=lambda t: (t <= 50.0001) | (t >= 49.9999 + gap)), "gap in time")
    assert found.level == level
    assert found.number == pytest.approx(gap, abs=1e-6)


@pytest.mark.parametrize("rows", [25, 60, 150])
def test_rows_that_are_missing_at_the_turn_are_told(tmp_path: Path, rows: int) -> None:
    top = Test().top
    found = grade(Test().observe(tmp_path, keep=lambda t: np.abs(t - top) > 0.05 * rows), "gap in time")
    assert found.level == "warning"
    assert found.number == pytest.approx(0.1 * rows, abs=0.21)
    assert "at the turn" in found.finding


@pytest.mark.parametrize("hold", [0.0, 20.0])
def test_a_turn_and_a_rest_that_are_written_are_no_gap(tmp_path: Path, hold: float) -> None:
    assert grade(Test(hold=hold).observe(tmp_path), "gap in time").level == "good"


def test_a_rest_at_the_turn_that_is_written_less_often_is_no_gap(tmp_path: Path) -> None:
    test = Test(hold=60.0)
    seldom = test.observe(tmp_path, keep=lambda t: (np.abs(t - test.top - 30) > 30) | (np.round(t * 10) % 40 == 0))
    assert grade(seldom, "gap in time").level == "good"


@pytest.mark.parametrize("rows", [20, 60, 300])
def test_rows_that_were_deleted_and_their_times_numbered_anew_leave_a_leap(tmp_path: Path, rows: int) -> None:
    _, x, f = (v[np.r_[0:600, 600 + rows : v.size]] for v in Test().columns())
    lines = "".join(f"{0.1 * i:.3f},{b:.5f},{c:.4f}\n" for i, (b, c) in enumerate(zip(x, f, strict=True)))
    (tmp_path / "t.csv").write_text("Time (s),Extension (mm),Load (N)\n" + lines)
    found = grade(observe(read_lab_file(tmp_path / "t.csv")), "gap in time")
    assert found.level == "warning"
    assert f"leaps by {rows + 1} times its usual step in line 602" in found.finding


@pytest.mark.parametrize("kind", ["staircase", "two speeds", "ever faster"])
def test_steps_with_rests_and_another_speed_are_no_leap(tmp_path: Path, kind: str) -> None:
    t = np.arange(0, 120, 0.1)
    place = {
        "staircase": np.minimum(t // 10 * 0.1, 1.0),
        "two speeds": np.interp(t, [0, 2, 120], [0, 0.5, 1.0]),
        "ever faster": (t / 120) ** 6,
    }
    x = place[kind] + 2e-5 * np.random.default_rng(2).normal(size=t.size)
    f = 5 * np.maximum(x - 0.02, 0) ** 1.6 + 2e-3 * np.random.default_rng(1).normal(size=t.size)
    lines = "".join(f"{a:.3f},{b:.5f},{c:.4f}\n" for a, b, c in zip(t, x, f, strict=True))
    (tmp_path / "t.csv").write_text("Time (s),Extension (mm),Load (N)\n" + lines)
    assert grade(observe(read_lab_file(tmp_path / "t.csv")), "gap in time").level == "good"


def test_a_hold_within_the_loading_is_no_gap(tmp_path: Path) -> None:
    t = np.arange(0, 140, 0.1)
    x = np.interp(t, [0, 60, 100, 140], [0, 0.6, 0.6, 1.0])
    f = 5 * np.maximum(x - 0.2, 0) ** 1.6 + 2e-3 * np.random.default_rng(1).normal(size=t.size)
    lines = "".join(f"{a:.3f},{b:.5f},{c:.4f}\n" for a, b, c in zip(t, x, f, strict=True))
    (tmp_path / "t.csv").write_text("Time (s),Extension (mm),Load (N)\n" + lines)
    obs = observe(read_lab_file(tmp_path / "t.csv"))
    assert any(b == "hold" for b in obs.branch)
    assert grade(obs, "gap in time").number == pytest.approx(0.1)


def test_uneven_time_steps_are_told_by_their_ratio(tmp_path: Path) -> None:
    assert grade(Test().observe(tmp_path), "even time steps").number == pytest.approx(1, abs=0.01)
    uneven = Test(interval=0.01).observe(tmp_path, keep=lambda t: (t < 20) | (np.round(t * 100) % 50 == 0))
    found = grade(uneven, "even time steps")
    assert found.level == "warning"
    assert found.number == pytest.approx(50, rel=0.01)


@pytest.mark.parametrize(("zero", "level"), [(-4.3, "good"), (-5.2, "warning"), (6.0, "warning")])
def test_an_unzeroed_load_is_a_note_unless_it_exceeds_range_or_prior(tmp_path: Path, zero: float, level: str) -> None:
    found = grade(Test(load_zero=zero).observe(tmp_path), "load zero")
    assert found.level == level
    assert found.number == pytest.approx(zero, abs=2e-3)


# ------------------------------------------------------------------------------------------------- capacitance over time


def _meter(folder: Path, limit: float = math.inf, noise: float = 2e-3, fall: bool = False) -> Observations:
    t, x, _ = Test(hold=5.0).columns()
    d = np.maximum(x - 0.2, 0) / 0.8
    change = 2 * d**1.6
    noisy = 97 + (-change if fall else change) + noise * np.random.default_rng(3).normal(size=t.size)
    c = np.minimum(noisy, limit)
    (folder / "lcr.csv").write_text("Time (s),Cp (pF)\n" + "".join(f"{a:.2f},{b:.3f}\n" for a, b in zip(t, c, strict=True)))
    return observe(read_lab_file(folder / "lcr.csv"))


@pytest.mark.parametrize("fall", [False, True])
def test_a_meter_log_without_displacement_is_judged_up_to_its_crest(tmp_path: Path, fall: bool) -> None:
    obs = _meter(tmp_path, fall=fall)
    assert {v.level for v in judge(obs)} == {"good"}
    assert grade(obs, "readings in contact", "capacitance").number == pytest.approx(790, abs=25)
    start = grade(obs, "start before contact", "capacitance")
    assert start.unit == "s"
    assert start.number == pytest.approx(20, abs=2)
    assert grade(obs, "resolution", "capacitance").number == pytest.approx(2000, rel=0.02)


def test_a_meter_that_clips_is_told_by_readings_without_noise(tmp_path: Path) -> None:
    assert grade(_meter(tmp_path), "clipping", "capacitance").level == "good"
    found = grade(_meter(tmp_path, limit=98.5), "clipping", "capacitance")
    assert found.level == "bad"
    assert "98.5 pF" in found.finding


def test_a_quiet_meter_says_nothing_on_clipping(tmp_path: Path) -> None:
    assert "clipping" not in checks(_meter(tmp_path, noise=0.0))


# ------------------------------------------------------------------------------------------------------------ real files


@needs_labdata
@pytest.mark.parametrize(
    ("name", "objections"),
    [
        ("instron/i05_bh2_ccyclic_headerblock_crlf.csv", {"start before contact": "bad"}),
        (
            "instron/i09_bhu_exports_quoted_kN_blankfirstcol.csv",
            {"size": "warning", "start before contact": "bad", "resolution": "warning"},
        ),
        (
            "p1_ecoflex_compression/EF30_0T_A1.csv",
            {"size": "warning", "start before contact": "warning", "machine compliance": "warning"},
        ),
        ("p3_asmi_sphere_indentation/well_E5_20251030_122001.csv", {"machine compliance": "warning"}),
        (
            "p3_asmi_sphere_indentation/well_E6_20251030_122108.csv",
            {"machine compliance": "warning", "drift before contact": "warning"},
        ),
        (
            "p3_asmi_sphere_indentation/well_E7_20251030_122153.csv",
            {"machine compliance": "warning", "drift before contact": "warning"},
        ),
    ],
)
def test_real_files_get_the_objections_they_deserve(name: str, objections: dict[str, str]) -> None:
    grades = judge(observe(read_lab_file(SHARED / name)))
    assert {v.check: v.level for v in grades if v.level != "good"} == objections


@needs_labdata
def test_a_public_indentation_needs_its_compliance() -> None:
    """The authors' 64.27 N/mm takes a third of the travel in contact; their modulus doubles with it."""
    obs = observe(read_lab_file(SHARED / "p3_asmi_sphere_indentation" / "well_E5_20251030_122001.csv"))
    found = grade(obs, "machine compliance", compliance=1 / 64.27e3)
    assert found.level == "warning"
    assert found.number == pytest.approx(10.0 / 64.27 / 0.545, rel=0.05)


@needs_labdata
def test_a_load_in_kilonewtons_with_four_decimals_has_steps_of_a_tenth_of_a_newton() -> None:
    obs = observe(read_lab_file(SHARED / "instron" / "i09_bhu_exports_quoted_kN_blankfirstcol.csv"))
    assert grade(obs, "resolution").number == pytest.approx(73)
    assert "steps of 0.1 N" in grade(obs, "resolution").finding
    assert grade(obs, "hysteresis").number == pytest.approx(0.066, abs=0.002)


@pytest.mark.parametrize("name", ["sensor1_instron.csv", "sensor2_instron.csv", "sensor1_lcr.csv", "sensor2_lcr.csv"])
def test_the_data_set_of_the_project_gets_no_objection_with_its_prior(name: str) -> None:
    grades = judge(observe(read_lab_file(DATASETS / name)), machine_compliance=5e-6)
    assert [v for v in grades if v.level != "good"] == []


# ------------------------------------------------------------------------------------------------------------- the sweep


def test_a_sweep_keeps_the_verdicts_on_both_files_and_they_survive_json() -> None:
    files = DATASETS / "sensor1_instron.csv", DATASETS / "sensor1_lcr.csv"
    sweep = make_sweep("sensor 1", "", 5e-3, *files)
    assert {v.file for v in sweep.grades} == {f.name for f in files}
    assert {v.channel for v in sweep.grades} == {"force", "capacitance"}
    text = sweeps_to_json([sweep])
    assert json.loads(text)["sweeps"][0]["grades"][0]["check"] == "readings in contact"
    assert sweeps_from_json(text)[0].grades == sweep.grades


def test_a_file_of_both_channels_is_judged_once(tmp_path: Path) -> None:
    t, x, f = Test().columns()
    c = 97 + 0.4 * f + 1e-3 * np.random.default_rng(1).normal(size=t.size)
    lines = "".join(f"{a:.3f},{b:.5f},{d:.3f},{e:.4f}\n" for a, b, d, e in zip(t, x, f, c, strict=True))
    path = tmp_path / "both.csv"
    path.write_text("Time (s),Displacement (mm),Force (N),Capacitance (pF)\n" + lines)
    grades = make_sweep("s", "", 5e-3, path, path).grades
    assert len({(v.check, v.channel) for v in grades}) == len(grades)


def test_a_known_compliance_of_the_machine_reaches_the_verdict(tmp_path: Path) -> None:
    path = Test().file(tmp_path)
    levels = [
        {v.check: v.level for v in make_sweep("s", "", 5e-3, path, None, machine_compliance=c).grades}["machine compliance"]
        for c in (None, 2e-6)
    ]
    assert levels == ["warning", "good"]


def _two_presses(folder: Path, factor: float, noise: float = 0.004) -> Path:
    """A file of two presses, the second of which rises by a factor of the first."""
    rng = np.random.default_rng(11)
    one = 1.1 * (1 - np.abs(np.linspace(-1, 1, 201)))
    x = np.concatenate([one, one])
    f = 5.0 * np.clip(x - 0.1, 0, None) ** 1.6
    f[one.size :] *= factor
    f += noise * rng.normal(size=x.size)
    path = folder / "press.csv"
    rows = "".join(f"{0.1 * i:.1f},{a:.5f},{b:.4f}\n" for i, (a, b) in enumerate(zip(x, f, strict=True)))
    path.write_text("Time (s),Extension (mm),Load (N)\n" + rows)
    return path


@pytest.mark.parametrize(("factor", "told"), [(1.0, False), (0.75, False), (0.5, True), (1 / 9.80665, True), (2.0, True)])
def test_a_press_that_is_a_multiple_of_another_is_told(tmp_path: Path, factor: float, told: bool) -> None:
    obs = observe(read_lab_file(_two_presses(tmp_path, factor)), FIRST_LOADING)
    found = [v for v in judge(obs) if v.check == "presses alike"]
    assert [v.level for v in found] == (["warning"] if told else [])
    assert all(v.number == pytest.approx(factor, rel=0.02) for v in found)


@pytest.mark.parametrize(
    ("factor", "noise", "bad"),
    [
        (1.0, 0.004, False),
        (0.97, 0.004, False),
        (0.9, 0.004, True),
        (0.75, 0.004, True),
        (1.2, 0.004, True),
        (1.2, 0.1, True),
        (0.5, 0.004, True),
        (1.0, 0.1, False),
        (1.0, 0.4, False),
    ],
)
def test_presses_that_are_used_together_have_to_be_alike(tmp_path: Path, factor: float, noise: float, bad: bool) -> None:
    obs = observe(read_lab_file(_two_presses(tmp_path, factor, noise)), Use(cycles=(1, 2)))
    found = [v for v in judge(obs) if v.check == "presses alike"]
    assert [v.level for v in found] == (["bad"] if bad else [])
    assert all(v.number == pytest.approx(factor, rel=0.02 + 0.3 * noise) for v in found)
    assert all("and both are used" in v.finding for v in found)

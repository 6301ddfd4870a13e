"""The offset of two clocks on simulated pairs of records whose offset is known, and the pairs that do not tell it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab.clocks.estimate import clock_offset
from calib.lab.clocks.offset import ClockOffset
from calib.lab.instruments.clock import read_clock
from calib.lab.instruments.labtable import LabTable
from calib.lab.observations import Observations, observe
from calib.lab.pressing import make_sweep
from calib.lab.sweep import sweeps_from_json, sweeps_to_json
from calib.lab.use import Use
from calib.priors import Normal
from calib.problem.unknowns import list_unknowns
from calib.report.rows import learned_in_words
from calib.sampling.posterior import Posterior
from models.sensor import FloatArray


def table(name: str, **columns: FloatArray) -> LabTable:
    n = next(iter(columns.values())).size
    sources = {key: key for key in columns}
    return LabTable(Path(name), "0" * 64, "table", "", "utf-8", ",", ".", columns, sources, np.arange(2, n + 2), ("",) * n, ())


@dataclass(frozen=True)
class Pair:
    """A pressing seen by a tester and a meter: lengths in mm, times in s of the tester's clock, capacitance in pF.

    `average` is the share of an interval over which the meter averages, `stamp` where in it the stamp lies (0 middle, 0.5 end).
    """

    speed: float = 0.05
    unloading_speed: float = 0.05
    hold: float = 1.0
    approach: float = 0.2
    depth: float = 0.7
    gap: float = 0.5
    cycles: int = 1
    hysteresis: float = 0.2
    creep: float = 0.0
    change: float = 2.5
    force_power: float = 1.8
    capacitance_power: float = 1.6
    force_noise: float = 5e-3
    capacitance_noise: float = 5e-3
    tester_rate: float = 50.0
    meter_rate: float = 10.0
    average: float = 0.0
    stamp: float = 0.0
    offset: float = 1.7
    tester_span: tuple[float, float] | None = None
    meter_span: tuple[float, float] | None = None

    @property
    def top(self) -> float:
        """Duration of a loading branch."""
        return (self.approach + self.depth) / self.speed

    @property
    def period(self) -> float:
        return self.top + self.hold + (self.approach + self.depth) / self.unloading_speed + self.gap

    def phase(self, t: FloatArray) -> FloatArray:
        return np.where(t < 0, 0.0, np.mod(np.clip(t, 0, self.cycles * self.period - 1e-9), self.period))

    def depth_at(self, t: FloatArray) -> FloatArray:
        """Reading above first touch."""
        up = np.clip(self.phase(t) * self.speed, 0, self.approach + self.depth)
        down = self.unloading_speed * np.clip(self.phase(t) - self.top - self.hold, 0, None)
        return np.asarray(np.maximum(up - down, 0) - self.approach)

    def curve(self, t: FloatArray, power: float) -> FloatArray:
        d = np.maximum(self.depth_at(t), 0) / self.depth
        back = self.phase(t) > self.top + self.hold
        return np.asarray(d**power * np.where(back, 1 - self.hysteresis * (1 - d), 1))

    def capacitance(self, t: FloatArray) -> FloatArray:
        since = np.clip(self.phase(t) - self.top, 0, None)
        crept = 1 + self.creep * (1 - np.exp(-2 * since / max(self.hold, 1)))
        return np.asarray(97.3 + self.change * self.curve(t, self.capacitance_power) * crept)

    def tester(self, rng: np.random.Generator, cycles: tuple[int, ...] = ()) -> Observations:
        start, end = self.tester_span or (-0.3, self.cycles * self.period)
        t = np.arange(start, end, 1 / self.tester_rate) + rng.uniform(0, 1) / self.tester_rate
        x = self.depth_at(t) + rng.normal(0, 1e-4, t.size)
        f = 5 * self.curve(t, self.force_power) + 0.31 + self.force_noise * rng.normal(size=t.size)
        columns = {"time": np.round(t, 4), "displacement": np.round(x, 5) * 1e-3, "force": np.round(f, 3)}
        return observe(table("t.csv", **columns), Use(cycles=cycles))

    def meter(self, rng: np.random.Generator) -> Observations:
        start, end = self.meter_span or (-2.0, self.cycles * self.period + 3)
        t = np.arange(start, end, 1 / self.meter_rate) + rng.uniform(0, 1) / self.meter_rate
        shifts = self.average / self.meter_rate * (np.arange(16) / 16 - 15 / 32)
        c = np.mean([self.capacitance(t + s) for s in shifts], axis=0) + self.capacitance_noise * rng.normal(size=t.size)
        stamps = np.round(t - self.offset + self.stamp / self.meter_rate, 4)
        return observe(table("c.csv", time=stamps, capacitance=np.round(c, 3) * 1e-12))


def estimate(pair: Pair, within: tuple[float, float] | None = None, cycles: tuple[int, ...] = ()) -> ClockOffset:
    rng = np.random.default_rng(0)
    return clock_offset(pair.tester(rng, cycles), pair.meter(rng), within)


def random_pair(rng: np.random.Generator, slowest: float, fastest: float) -> Pair:
    speed = float(np.exp(rng.uniform(np.log(slowest), np.log(fastest))))
    return Pair(
        speed=speed,
        unloading_speed=speed * float(rng.choice([1, 2])),
        hold=float(rng.choice([0, 0, 1, 3, 10])),
        approach=float(rng.uniform(0.1, 0.3)),
        hysteresis=float(rng.uniform(0, 0.3)),
        creep=float(rng.choice([0, 0.005, 0.01])),
        change=float(rng.uniform(2, 4)),
        force_power=float(rng.uniform(1.5, 2.1)),
        capacitance_power=float(rng.uniform(1.4, 1.9)),
        capacitance_noise=float(rng.choice([2e-3, 5e-3, 10e-3])),
        tester_rate=float(rng.choice([20, 50, 100])),
        meter_rate=float(rng.choice([5, 10, 20, 50])),
        average=float(rng.choice([0, 1])),
        offset=float(rng.uniform(-4, 4)),
    )


# ------------------------------------------------------------------------------------------------- what the data tell


@pytest.mark.parametrize(
    ("slowest", "fastest", "median", "most"),
    # Speeds in mm/s: from 2 to 10 mm/min, and from there to 0.75 mm/s; limits on |error| in s, median and 95 %.
    [(2 / 60, 10 / 60, 0.006, 0.025), (10 / 60, 0.75, 0.004, 0.012)],
)
def test_the_offset_is_within_ten_milliseconds_where_the_data_can_tell(
    slowest: float, fastest: float, median: float, most: float
) -> None:
    rng = np.random.default_rng(42)
    errors, sds, words = [], [], []
    for _ in range(10):
        pair = random_pair(rng, slowest, fastest)
        found = clock_offset(pair.tester(rng), pair.meter(rng))
        errors.append(abs(found.value - pair.offset))
        sds.append(found.sd)
        words.append(found.confidence)
    error, sd = np.array(errors), np.array(sds)
    assert np.median(error) < median
    assert np.quantile(error, 0.95) < most
    assert np.all(error < 3.5 * sd)
    assert np.mean(error < 2 * sd) > 0.8
    clear = np.array(words) == "clear"
    assert np.array_equal(clear, sd <= 0.005)
    assert np.all(error[clear] < 0.011)


def test_a_slow_pressing_tells_less_and_says_so() -> None:
    rng = np.random.default_rng(7)
    n_weak = 0
    for _ in range(4):
        pair = random_pair(rng, 0.5 / 60, 1 / 60)
        found = clock_offset(pair.tester(rng), pair.meter(rng))
        assert abs(found.value - pair.offset) < 3.5 * found.sd
        if found.confidence == "clear":
            assert found.sd <= 0.005
            continue
        n_weak += 1
        (said,) = (e for e in found.evidence if "do not tell the offset within 10 ms" in e)
        # Some micrometres of travel at most, in mm and s here.
        travel = float(said.split()[-2]) * 1e-3
        assert travel == pytest.approx(2 * found.sd * pair.speed, rel=0.2)
        assert travel < 3e-3
    assert n_weak > 1


def test_a_meter_that_stamps_the_end_of_its_averaging_moves_the_clock_but_not_the_tie() -> None:
    pair = Pair(average=1.0, stamp=0.5, meter_rate=5.0, speed=0.2, unloading_speed=0.2, capacitance_noise=2e-3)
    found = estimate(pair)
    middle = pair.offset - 0.1
    assert abs(found.value - middle) < max(3 * found.sd, 0.01)
    assert found.systematic == pytest.approx(0.1)
    assert abs(found.value - pair.offset) < found.systematic + 3 * found.sd
    assert found.sd < 0.02
    assert any("stamps" in e for e in found.evidence)


def test_onset_and_turning_point_are_both_told_and_agree() -> None:
    found = estimate(Pair(speed=0.2, unloading_speed=0.2, capacitance_noise=2e-3))
    assert found.confidence == "clear"
    assert found.turning_point is not None
    assert found.onset is not None
    assert abs(found.onset[0] - 1.7) < 3 * found.onset[1]
    assert found.onset[1] > found.turning_point[1]
    assert any("agrees" in e for e in found.evidence)


def test_a_clock_that_runs_at_another_rate_makes_onset_and_turning_point_disagree() -> None:
    pair = Pair(capacitance_noise=1e-3, force_noise=1e-3)
    rng = np.random.default_rng(3)
    tester, meter = pair.tester(rng), pair.meter(rng)
    assert meter.time is not None
    found = clock_offset(tester, replace(meter, time=meter.time * 1.2))
    assert found.confidence == "weak"
    assert any("disagree" in e for e in found.evidence)
    assert found.turning_point is not None
    assert found.sd > 10 * found.turning_point[1]


def test_a_log_that_ends_before_the_turning_point_tells_by_its_onset_alone() -> None:
    found = estimate(Pair(meter_span=(-2.0, 14.0)))
    assert found.confidence == "weak"
    assert found.turning_point is None
    assert abs(found.value - 1.7) < 3 * found.sd


def test_as_many_cycles_in_both_records_are_not_ambiguous() -> None:
    found = estimate(Pair(cycles=3, speed=0.1, unloading_speed=0.1))
    assert found.confidence != "ambiguous"
    assert abs(found.value - 1.7) < 0.03


# --------------------------------------------------------------------------------------------- what they do not tell


@pytest.mark.parametrize("change", [0.0, 0.02])
def test_a_capacitance_that_hardly_changes_is_ambiguous(change: float) -> None:
    found = estimate(Pair(change=change))
    assert found.confidence == "ambiguous"
    assert not found.alternatives
    assert "noise" in found.evidence[0]
    assert found.sd > 5
    assert abs(found.value - 1.7) < 3 * found.sd


def test_a_monotone_stretch_is_ambiguous() -> None:
    found = estimate(Pair(meter_span=(8.0, 15.0)))
    assert found.confidence == "ambiguous"
    assert not found.alternatives
    assert "no turning point" in found.evidence[0]
    assert abs(found.value - 1.7) < 3 * found.sd
    assert found.sd > 0.5


@pytest.mark.parametrize("seed", [1, 2])
def test_a_noisy_press_has_one_offset_as_noise_fits_no_offset_better(seed: int) -> None:
    slow = Pair(speed=0.01, unloading_speed=0.01, hold=0.0, approach=0.13, depth=0.52, hysteresis=0.1)
    pair = replace(slow, change=0.7, capacitance_noise=0.028, tester_rate=10.0, meter_rate=5.0)
    found = clock_offset(pair.tester(np.random.default_rng(seed)), pair.meter(np.random.default_rng(seed + 99)))
    assert found.confidence == "weak"
    assert abs(found.value - pair.offset) < 3 * found.sd < 1.0


@pytest.mark.parametrize("one", ["tester", "meter"])
def test_cycles_that_one_record_does_not_hold_leave_whole_periods(one: str) -> None:
    pair = Pair(cycles=3, speed=0.1, unloading_speed=0.1)
    part = (-0.3, pair.period - 0.2) if one == "tester" else (pair.period - 0.2, 2 * pair.period - 0.2)
    pair = replace(pair, tester_span=part) if one == "tester" else replace(pair, meter_span=part)
    found = estimate(pair)
    assert found.confidence == "ambiguous"
    assert "whole periods" in found.evidence[0]
    offsets = np.sort([found.value, *found.alternatives])
    np.testing.assert_allclose(np.diff(offsets), pair.period, atol=0.1)
    assert np.min(np.abs(offsets - 1.7)) < 0.1
    known = estimate(pair, within=(1.0, 3.0), cycles=(1,) if one == "tester" else (2,))
    assert known.confidence != "ambiguous"
    assert abs(known.value - 1.7) < 0.1


# --------------------------------------------------------------------------------------------------- what becomes of it


def write(pair: Pair, folder: Path, seed: int = 0) -> tuple[Path, Path]:
    rng = np.random.default_rng(seed)
    tester, meter = pair.tester(rng), pair.meter(rng)
    names = (("Time (s)", 1.0), ("Extension (mm)", 1e3), ("Load (N)", 1.0))
    columns = [c for c in (tester.time, tester.displacement, tester.force) if c is not None]
    rows = [
        ",".join(f"{v * scale:.6f}" for v, (_, scale) in zip(row, names, strict=True)) for row in zip(*columns, strict=True)
    ]
    (folder / "t.csv").write_text("\n".join([",".join(n for n, _ in names), *rows]) + "\n")
    assert meter.time is not None
    assert meter.capacitance is not None
    rows = [f"{a:.4f},{c * 1e12:.4f}" for a, c in zip(meter.time, meter.capacitance, strict=True)]
    (folder / "c.csv").write_text("\n".join(["Time (s),Cp (pF)", *rows]) + "\n")
    return folder / "t.csv", folder / "c.csv"


def test_the_sweep_keeps_the_evidence_and_its_notes_say_it(tmp_path: Path) -> None:
    sweep = make_sweep("s", "", 5e-3, *write(Pair(), tmp_path))
    assert sweep.clock is not None
    assert (sweep.clock_offset, sweep.clock_offset_sd) == (sweep.clock.value, sweep.clock.sd)
    assert set(sweep.clock.evidence) <= set(sweep.notes)
    again = sweeps_from_json(sweeps_to_json([sweep]))[0]
    assert again.clock == sweep.clock


def test_an_offset_that_the_data_do_not_tell_gets_a_wide_prior(
    tmp_path: Path, make_posterior: Callable[..., Posterior]
) -> None:
    sweep = make_sweep("sensor 1", "", 5e-3, *write(Pair(change=0.0), tmp_path))
    assert sweep.clock is not None
    assert sweep.clock.confidence == "ambiguous"
    assert any("ambiguous" in n for n in sweep.notes)
    experiment = make_posterior(True, 1).experiment
    infos, _ = list_unknowns(experiment, (sweep,))
    info = next(i for i in infos if i.parameter == "clock_offset")
    assert "do not tell" in info.origin
    assert not info.from_data
    low, high = (float(info.prior.ppf_normal(z)) for z in (-1.0, 1.0))
    assert (high - low) / 2 == pytest.approx(sweep.clock_offset_sd)
    assert sweep.clock_offset_sd > 5
    assert learned_in_words(0.05, 0.1, from_data=info.from_data) == "prior-driven"


def test_an_offset_that_the_data_tell_gets_a_prior_as_wide_as_is_said_of_it(
    tmp_path: Path, make_posterior: Callable[..., Posterior]
) -> None:
    sweep = make_sweep("sensor 1", "", 5e-3, *write(Pair(), tmp_path))
    experiment = make_posterior(True, 1).experiment
    (info,) = (i for i in list_unknowns(experiment, (sweep,))[0] if i.parameter == "clock_offset")
    low, high = (float(info.prior.ppf_normal(z)) for z in (-1.0, 1.0))
    assert (low + high) / 2 == pytest.approx(sweep.clock_offset)
    assert (high - low) / 2 == pytest.approx(sweep.clock_offset_sd)
    assert learned_in_words(0.05, 0.1, from_data=info.from_data) == "found in the data"
    # What somebody believes of the clocks is a belief, however little the data say to it.
    (specimen,) = experiment.specimens
    own = {**specimen.priors, "clock_offset": Normal(sweep.clock_offset, 0.01)}
    believed = replace(experiment, specimens=(replace(specimen, priors=own),))
    (info,) = (i for i in list_unknowns(believed, (sweep,))[0] if i.parameter == "clock_offset")
    assert not info.from_data


def test_whole_periods_are_refused_with_advice_unless_the_range_is_known(tmp_path: Path) -> None:
    pair = Pair(cycles=2, speed=0.1, unloading_speed=0.1)
    files = write(replace(pair, meter_span=(-0.3, pair.period - 0.2)), tmp_path)
    with pytest.raises(InputError, match=r"whole periods.*Save both logs"):
        make_sweep("s", "", 5e-3, *files)
    sweep = make_sweep("s", "", 5e-3, *files, clock_range=(0.0, 4.0))
    assert abs(sweep.clock_offset - 1.7) < 0.1


def test_the_cycle_of_the_tester_decides_which_readings_of_the_meter_are_used(tmp_path: Path) -> None:
    pair = Pair(cycles=3, speed=0.1, unloading_speed=0.1)
    files = write(pair, tmp_path)
    for cycle in (1, 3):
        sweep = make_sweep("s", "", 5e-3, *files, use=Use(cycles=(cycle,)))
        assert "capacitance" in sweep.channels
        assert sweep.channels["capacitance"].time is not None
        start = (cycle - 1) * pair.period - 1.7
        assert np.all(sweep.channels["capacitance"].time > start - 1)
        assert np.all(sweep.channels["capacitance"].time < start + pair.top + 0.2)
        assert abs(sweep.clock_offset - 1.7) < 0.05
        assert any(f"cycle {cycle} is used" in n for n in sweep.notes)
    with pytest.raises(InputError, match="no cycle 4, the file has 3 loading branches"):
        make_sweep("s", "", 5e-3, *files, use=Use(cycles=(4,)))


@pytest.mark.parametrize("minus", ["-", "\u2212"])
def test_times_before_a_trigger_are_read_as_before_zero_with_a_note(minus: str) -> None:
    seconds = np.arange(-150, 300) * 0.5
    cells = [f"{minus if s < 0 else ''}00:{int(abs(s)) // 60:02d}:{abs(s) % 60:04.1f}" for s in seconds]
    found = read_clock(cells)
    assert not found.conflict
    np.testing.assert_allclose(found.seconds, seconds)
    assert any("with a minus" in note for note in found.notes)


def test_a_minus_beside_a_date_is_refused() -> None:
    cells = [f"{'-' if k < 3 else ''}00:00:{k:04.1f}" for k in range(20)]
    assert read_clock(cells, ["2024-05-02"] * 20).conflict

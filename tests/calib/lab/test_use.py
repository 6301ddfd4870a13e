"""A part of a press: up to a force or a depth, on its way back, or several cycles, and what becomes of it in a sweep."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab.branches import label_branches
from calib.lab.instruments.reader import read_lab_file
from calib.lab.observations import Observations, observe, why_left_out
from calib.lab.pressing import make_sweep
from calib.lab.quality.judgement import judge
from calib.lab.sweep import sweeps_from_json, sweeps_to_json
from calib.lab.use import Branch, Use, same_part, use_value
from models.sensor import FloatArray

CONTACT = 0.05  # [mm], crosshead reading at first touch
LOAD_ZERO = 0.2  # [N]
SPEED = 0.02  # [mm/s]
HYSTERESIS = 0.1
OFFSET = 1.5  # [s], clock of the tester minus clock of the meter


@dataclass(frozen=True)
class Cycles:
    """Presses to some depths [mm] after an approach of 0.2 mm, each a little softer than the one before, as Mullins found."""

    depths: Sequence[float] = (0.8, 0.8, 0.8)
    softer: float = 0.02
    noise: float = 3e-3

    def motion(self) -> tuple[FloatArray, FloatArray]:
        corners = [-0.2]
        for depth in self.depths:
            corners += [depth, -0.2]
        times = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(corners)) / SPEED)])
        return times, np.array(corners)

    def state(self, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Depth [mm], 1 where the ball goes back, and cycle from 1."""
        times, corners = self.motion()
        leg = np.clip(np.searchsorted(times, t, side="right") - 1, 0, times.size - 2)
        return np.interp(t, times, corners), np.asarray(leg % 2 == 1, dtype=float), np.asarray(leg // 2 + 1, dtype=float)

    def force(self, depth: FloatArray, back: FloatArray, cycle: FloatArray) -> FloatArray:
        d = np.maximum(depth, 0) / 0.8
        return 5 * d**1.8 * (1 - HYSTERESIS * back) * (1 - self.softer * (cycle - 1)) + LOAD_ZERO

    def capacitance(self, depth: FloatArray, back: FloatArray, cycle: FloatArray) -> FloatArray:
        d = np.maximum(depth, 0) / 0.8
        return 97 + 2 * d**1.6 * (1 - HYSTERESIS * back) * (1 - self.softer * (cycle - 1))

    def write(self, folder: Path) -> Path:
        """Files of a tester, of a meter, and of loggers that have displacement, force, or both beside the capacitance."""
        rng = np.random.default_rng(1)
        t = np.arange(0, self.motion()[0][-1], 0.05)
        depth, back, cycle = self.state(t)
        f = self.force(depth, back, cycle) + self.noise * rng.normal(size=t.size)
        c = self.capacitance(depth, back, cycle) + self.noise * rng.normal(size=t.size)
        x = depth + CONTACT
        stamps = np.arange(-1, t[-1] + 3, 0.1)
        meter = self.capacitance(*self.state(stamps + OFFSET)) + self.noise * rng.normal(size=stamps.size)
        named = {
            "tester.csv": (("Time (s)", t), ("Extension (mm)", x), ("Load (N)", f)),
            "meter.csv": (("Time (s)", stamps - stamps[0]), ("Cp (pF)", meter)),
            "placed.csv": (("Extension (mm)", x + 3), ("Cp (pF)", c)),
            "loaded.csv": (("Time (s)", t), ("Load (N)", f), ("Cp (pF)", c)),
            "both.csv": (("Time (s)", t), ("Extension (mm)", x), ("Load (N)", f), ("Cp (pF)", c)),
        }
        for name, columns in named.items():
            rows = zip(*(v for _, v in columns), strict=True)
            lines = [",".join(n for n, _ in columns), *(",".join(f"{v:.5f}" for v in row) for row in rows)]
            (folder / name).write_text("\n".join(lines) + "\n")
        return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Cycles().write(tmp_path_factory.mktemp("lab"))


def seen(path: Path, use: Use) -> Observations:
    return observe(read_lab_file(path), use)


def used_force(obs: Observations) -> FloatArray:
    assert obs.force is not None
    return obs.force[obs.used]


# ------------------------------------------------------------------------------------------------------------- which rows


@pytest.mark.parametrize("branch", ["loading", "unloading"])
@pytest.mark.parametrize("limit", [1.0, 4.0])
def test_rows_beyond_a_force_are_left_out_with_the_reason_and_no_others(folder: Path, branch: Branch, limit: float) -> None:
    whole = seen(folder / "tester.csv", Use(branch=branch))
    obs = seen(folder / "tester.csv", Use(max_force=limit, branch=branch))
    assert np.max(used_force(obs)) <= limit
    assert obs.force is not None
    inside = whole.used & (obs.force < limit - 0.02)
    np.testing.assert_array_equal(obs.used & inside, inside)
    out = whole.used & ~obs.used
    assert {obs.reason[r] for r in np.flatnonzero(out)} == {f"more force than max_force = {limit:g} N"}
    assert "as read, its zero not taken off" in " ".join(obs.use_notes)


@pytest.mark.parametrize("limit", [0.2, 0.5])
def test_depth_counts_from_where_contact_begins_and_the_note_says_where(folder: Path, limit: float) -> None:
    obs = seen(folder / "tester.csv", Use(max_depth=limit * 1e-3))
    assert obs.displacement is not None
    deepest = np.max(obs.displacement[obs.used]) * 1e3
    assert deepest == pytest.approx(CONTACT + limit, abs=0.015)
    assert np.min(obs.displacement[obs.used]) * 1e3 == pytest.approx(CONTACT - 0.2, abs=1e-3)
    note = " ".join(obs.use_notes)
    assert "counted from contact at 0.0" in note
    assert "where force leaves its flat part" in note
    assert any(f"deeper than max_depth = {limit:g} mm after contact" in reason for reason in obs.reason)


@pytest.mark.parametrize("branch", ["loading", "unloading"])
@pytest.mark.parametrize(
    "use", [Use(max_depth=1e-6), Use(max_depth=1e-9), Use(max_depth=1e-6, cycles=(2, 3)), Use(max_force=4.0, max_depth=1e-6)]
)
def test_limits_that_leave_no_row_in_contact_are_refused_with_where_it_begins(folder: Path, use: Use, branch: Branch) -> None:
    with pytest.raises(InputError, match=r"rows? in contact, which begins at 0\.\d+ mm .*; what is left ends at 0\.") as caught:
        seen(folder / "tester.csv", replace(use, branch=branch))
    (fault,) = caught.value.faults
    assert fault.line is not None
    assert "a sweep needs 5 rows in contact" in fault.advice


def test_a_record_that_starts_in_contact_says_that_the_true_depth_is_larger(tmp_path: Path) -> None:
    x = np.linspace(0.2, 0.8, 400)
    (tmp_path / "t.csv").write_text("Extension (mm),Load (N)\n" + "".join(f"{v:.5f},{5 * v**1.8:.5f}\n" for v in x))
    obs = seen(tmp_path / "t.csv", Use(max_depth=0.3e-3))
    assert "the true depth is larger" in " ".join(obs.use_notes)
    assert obs.displacement is not None
    assert np.max(obs.displacement[obs.used]) == pytest.approx(0.5e-3, abs=3e-6)


def test_noise_at_a_limit_does_not_bias_the_last_rows(tmp_path: Path) -> None:
    """Leaving out single readings above the limit alone would keep the low half of the noise."""
    x = np.linspace(-0.2, 0.8, 20000)
    true = 5 * (np.maximum(x, 0) / 0.8) ** 1.8
    f = true + 0.1 * np.random.default_rng(1).normal(size=x.size)
    (tmp_path / "t.csv").write_text(
        "Extension (mm),Load (N)\n" + "".join(f"{a:.6f},{b:.5f}\n" for a, b in zip(x, f, strict=True))
    )
    obs = seen(tmp_path / "t.csv", Use(max_force=2.0))
    rows = np.flatnonzero(obs.used)
    assert np.mean(used_force(obs)[-200:] - true[rows[-200:]]) == pytest.approx(0, abs=0.03)


@pytest.mark.parametrize(("cycles", "words"), [((2,), "cycle 2 is used"), ((1, 3), "cycles 1 and 3 are used")])
def test_the_named_cycles_are_used_together(folder: Path, cycles: tuple[int, ...], words: str) -> None:
    obs = seen(folder / "tester.csv", Use(cycles=cycles))
    assert obs.used_cycles == cycles
    assert set(obs.cycle[obs.used].tolist()) == set(cycles)
    assert {obs.branch[r] for r in np.flatnonzero(obs.used)} == {"loading"}
    one = seen(folder / "tester.csv", Use(cycles=cycles[:1]))
    assert obs.used.sum() == pytest.approx(len(cycles) * one.used.sum(), abs=6)
    np.testing.assert_array_equal(obs.loading, one.used)
    assert any(words in reason for reason in why_left_out(obs))
    sweep = make_sweep("s", "", 5e-3, folder / "tester.csv", None, use=Use(cycles=cycles))
    assert any(words in note for note in sweep.notes)


def test_the_way_back_is_used_instead_of_the_way_in(folder: Path) -> None:
    obs = seen(folder / "tester.csv", Use(branch="unloading", cycles=(2,)))
    assert {obs.branch[r] for r in np.flatnonzero(obs.used)} == {"unloading"}
    assert set(obs.cycle[obs.used].tolist()) == {2}
    assert "loading branch (unloading is used)" in why_left_out(obs)
    assert {v.check for v in judge(obs)} >= {"signal", "start before contact", "gap in time"}
    assert [v for v in judge(obs, 1e-7) if v.level == "bad"] == []


@pytest.mark.parametrize("back", [1.0, 3.0])
@pytest.mark.parametrize("behind", [0.0, 0.2, 0.5, 0.95])
@pytest.mark.parametrize("n", [60, 121, 400])
def test_the_ball_turns_between_the_readings_at_which_it_does(tmp_path: Path, n: int, behind: float, back: float) -> None:
    rng = np.random.default_rng(n)
    top = n // 2 + behind  # the turn, in readings
    i = np.arange(int(top + top / back))
    way_in = i <= top
    depth = np.where(way_in, i, top - back * (i - top)) / top
    force = 5 * np.maximum(depth - 0.2, 0) ** 1.5 * np.where(way_in, 1, 0.93) + rng.normal(0, 0.004, i.size)
    place = depth + rng.normal(0, 4e-4, i.size)
    lines = [f"{0.1 * k:.1f},{x:.5f},{f:.4f}" for k, x, f in zip(i, place, force, strict=True)]
    path = tmp_path / "press.csv"
    path.write_text("\n".join(["Time (s),Displacement (mm),Force (N)", *lines]) + "\n")
    seen = observe(read_lab_file(path))
    assert list(seen.branch) == ["loading" if k else "unloading" for k in way_in]


def test_a_reading_far_off_at_the_turn_is_not_where_the_ball_turns() -> None:
    depth = np.concatenate([np.arange(60.0), np.arange(60.0)[::-1]])
    depth[62] += 40  # a stray on the way back
    branch, _, _ = label_branches(depth, None, np.maximum(depth - 10, 0), standstill=True)
    assert branch.tolist() == ["loading"] * 60 + ["unloading"] * 60


def test_a_record_that_starts_pressed_can_be_used_on_its_way_back(tmp_path: Path) -> None:
    t = np.arange(0, 60, 0.1)
    x = 0.8 - SPEED * t
    f = 5 * (np.maximum(x, 0) / 0.8) ** 1.8 + 2e-3 * np.random.default_rng(1).normal(size=t.size)
    lines = (f"{a:.2f},{b:.5f},{c:.4f}\n" for a, b, c in zip(t, x, f, strict=True))
    (tmp_path / "t.csv").write_text("Time (s),Extension (mm),Load (N)\n" + "".join(lines))
    with pytest.raises(InputError, match=r'use = \{ branch = "unloading" \}'):
        make_sweep("s", "", 5e-3, tmp_path / "t.csv", None)
    sweep = make_sweep("s", "", 5e-3, tmp_path / "t.csv", None, use=Use(branch="unloading"))
    assert np.max(sweep.channels["force"].value) == pytest.approx(5, rel=0.05)


@pytest.mark.parametrize(
    ("use", "message", "advice"),
    [
        (Use(cycles=(4,)), "there is no cycle 4, the file has 3 loading branches", "from 1 to 3"),
        (Use(cycles=(2, 7)), "there is no cycle 7", "from 1 to 3"),
        (Use(max_force=0.0), "max_force must be positive, got 0", "Leave max_force out"),
        (Use(max_depth=-1e-3), "max_depth must be positive", "Leave max_depth out"),
        (Use(max_force=0.01), "max_force = 0.01 N leaves none of the", "larger limits"),
    ],
)
def test_a_use_that_cannot_be_is_refused_with_a_way_out(folder: Path, use: Use, message: str, advice: str) -> None:
    with pytest.raises(InputError) as caught:
        seen(folder / "tester.csv", use)
    assert message in caught.value.faults[0].message
    assert advice in caught.value.faults[0].advice


def _not_tared(folder: Path, rest: float) -> tuple[Path, FloatArray]:
    """A press of 2 N whose load reads so much at rest, and its loads."""
    x = np.concatenate([np.linspace(-0.2, 0.8, 100), np.linspace(0.79, -0.2, 99)])
    f = rest + 2.0 * (np.maximum(x, 0) / 0.8) ** 1.8 + 1e-3 * np.random.default_rng(3).normal(size=x.size)
    path = folder / "load.csv"
    rows = (f"{0.1 * k:.1f},{a:.5f},{b:.4f}\n" for k, (a, b) in enumerate(zip(x, f, strict=True)))
    path.write_text("Time (s),Extension (mm),Load (N)\n" + "".join(rows))
    return path, f


@pytest.mark.parametrize("limit", [-2.0, -1.5])
@pytest.mark.parametrize("branch", ["loading", "unloading"])
def test_a_limit_below_zero_is_right_of_a_load_that_is_below_it_at_rest(tmp_path: Path, limit: float, branch: Branch) -> None:
    path, force = _not_tared(tmp_path, -3.2)
    used = seen(path, Use(max_force=limit, branch=branch)).used
    assert np.count_nonzero(used) > 30
    assert np.max(force[used]) <= limit < np.max(force)


@pytest.mark.parametrize(
    ("rest", "limit", "message"),
    [
        (-3.2, -4.0, r"max_force must be above the load at rest, got -4 N: the load at rest is -3\.2"),
        (0.0, -2.0, "max_force must be positive, got -2 N"),
        (0.0, 0.0, "max_force must be positive, got 0 N"),
    ],
)
def test_a_limit_below_the_load_at_rest_is_refused_with_limits_that_work(
    tmp_path: Path, rest: float, limit: float, message: str
) -> None:
    path, _ = _not_tared(tmp_path, rest)
    with pytest.raises(InputError, match=message) as caught:
        seen(path, Use(max_force=limit))
    ways = dict(re.findall(r'(max_force|max_depth) = "([^"]*)"', caught.value.faults[0].advice))
    assert set(ways) == {"max_force", "max_depth"}
    numbers = {key: float(said.split()[0]) for key, said in ways.items()}
    for use in (Use(max_force=numbers["max_force"]), Use(max_depth=1e-3 * numbers["max_depth"])):
        assert 20 < np.count_nonzero(seen(path, use).used) < 100


@pytest.mark.parametrize(
    ("name", "use", "message"),
    [
        ("placed.csv", Use(max_force=1.0), "max_force says nothing of this file, which has no force column"),
        ("loaded.csv", Use(max_depth=1e-4), "max_depth says nothing of this file, which has no displacement column"),
        ("meter.csv", Use(branch="unloading"), "nothing tells the cycles and branches"),
        ("meter.csv", Use(cycles=(2,)), "nothing tells the cycles and branches"),
    ],
)
def test_a_use_of_what_a_file_does_not_have_is_refused(folder: Path, name: str, use: Use, message: str) -> None:
    with pytest.raises(InputError, match=message):
        seen(folder / name, use)


# ------------------------------------------------------------------------------------------------------ what a sweep has


TIES = [("both.csv", "both.csv"), ("tester.csv", "meter.csv"), ("tester.csv", "placed.csv"), ("tester.csv", "loaded.csv")]


def _true_depth(folder: Path, use: Use, force: str, capacitance: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points of the capacitance [pF], the depth [mm] they were read at, and their sd [pF]."""
    sweep = make_sweep("s", "", 5e-3, folder / force, folder / capacitance, use=use, clock_range=(0.3, 0.7))
    points = sweep.channels["capacitance"]
    sd = sweep.noise["capacitance"] / np.sqrt(points.n_effective) * 1e12
    if points.time is not None:
        depth = Cycles().state(points.time - 1 + OFFSET)[0]
    elif points.displacement is not None:
        depth = points.displacement * 1e3 - CONTACT - (3 if capacitance == "placed.csv" else 0)
    else:
        assert points.force is not None
        scale = 1 - HYSTERESIS * (use.branch == "unloading")
        depth = 0.8 * (np.maximum(points.force - LOAD_ZERO, 0) / 5 / scale) ** (1 / 1.8)
    return points.value * 1e12, depth, sd


@pytest.mark.parametrize(("force", "capacitance"), TIES)
@pytest.mark.parametrize(
    "use", [Use(), Use(branch="unloading"), Use(max_force=2.0), Use(max_depth=0.4e-3), Use(branch="unloading", max_force=3.0)]
)
def test_points_of_a_part_lie_on_its_curve_however_they_are_tied(folder: Path, use: Use, force: str, capacitance: str) -> None:
    value, depth, _ = _true_depth(folder, use, force, capacitance)
    back = np.full(depth.size, float(use.branch == "unloading"))
    off = value - Cycles().capacitance(depth, back, np.ones(depth.size))
    # Where the ball turns round the capacitance steps by the hysteresis: a reading there is of either branch.
    pressed = (depth > 0.1) & (depth < 0.78)
    assert np.sum(pressed) > 10
    assert np.max(np.abs(off[pressed])) < 0.012
    reach = 0.8
    if use.max_force is not None:
        reach = 0.8 * ((use.max_force - LOAD_ZERO) / 5 / (1 - HYSTERESIS * back[0])) ** (1 / 1.8)
    if use.max_depth is not None:
        reach = use.max_depth * 1e3
    assert 0.9 * reach < np.max(depth) < reach + 0.03


@pytest.mark.parametrize(("force", "capacitance"), TIES)
@pytest.mark.parametrize("cycles", [(2, 3), (1, 3)])
def test_points_of_several_cycles_lie_between_them(folder: Path, cycles: tuple[int, ...], force: str, capacitance: str) -> None:
    value, depth, sd = _true_depth(folder, Use(cycles=cycles), force, capacitance)
    pressed = depth > 0.1
    forwards = np.zeros(depth.size)
    low, high = (Cycles().capacitance(depth, forwards, np.full(depth.size, float(c))) for c in (cycles[1], cycles[0]))
    # A depth that is known by the force of the first cycle is too small in a softer one.
    slack = (0.06 if capacitance == "loaded.csv" else 0.012) + 3 * sd
    assert np.all(value[pressed] > low[pressed] - slack[pressed])
    assert np.all(value[pressed] < high[pressed] + slack[pressed])
    assert np.max(depth) == pytest.approx(0.8, abs=0.05)
    assert value.size >= 20


def test_the_clock_is_tied_by_the_whole_press_whatever_part_is_used(folder: Path) -> None:
    files = folder / "tester.csv", folder / "meter.csv"
    whole = make_sweep("s", "", 5e-3, *files, clock_range=(0.3, 0.7))
    part = make_sweep("s", "", 5e-3, *files, clock_range=(0.3, 0.7), use=Use(max_depth=0.3e-3))
    assert part.clock_offset == whole.clock_offset
    assert part.clock_offset_sd == whole.clock_offset_sd
    assert part.channels["capacitance"].value.max() < whole.channels["capacitance"].value.max()


def test_where_contact_begins_stays_with_a_sweep(folder: Path) -> None:
    sweep = make_sweep("s", "", 5e-3, folder / "tester.csv", None)
    assert sweep.contact == pytest.approx(CONTACT * 1e-3, abs=15e-6)
    assert sweeps_from_json(sweeps_to_json([sweep]))[0].contact == sweep.contact
    assert np.isnan(make_sweep("s", "", 5e-3, None, folder / "loaded.csv").contact)


# -------------------------------------------------------------------------------------------------------- what may be said


def test_what_is_said_of_a_part_becomes_numbers() -> None:
    assert use_value("max_force", "500 mN") == 0.5
    assert use_value("max_force", "-2 N") == -2.0
    assert use_value("max_depth", "0.8 mm") == 0.8e-3
    assert use_value("branch", "unloading") == "unloading"
    assert use_value("cycles", [3, 2]) == (2, 3)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("max_force", 5, "must be a quantity with its unit, got 5"),
        ("max_force", "5", "has no unit"),
        ("max_force", "5 mm", "mm"),
        ("max_depth", "-5 mm", "must be positive"),
        ("max_depth", "0 mm", "must be positive"),
        ("branch", "down", 'must be "loading" or "unloading", got "down"'),
        ("cycles", 2, "must be a list of whole numbers from 1, got 2"),
        ("cycles", [], "must be a list"),
        ("cycles", [0], "must be a list"),
        ("cycles", [True], "must be a list"),
        ("cycles", [2, 2], "names one twice"),
    ],
)
def test_what_cannot_be_said_of_a_part_is_refused(key: str, value: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        use_value(key, value)


def test_a_part_is_the_same_if_it_shares_a_cycle_on_the_same_branch() -> None:
    assert same_part(Use(), Use(cycles=(1, 2)))
    assert same_part(Use(max_force=1.0), Use(max_force=2.0))
    assert not same_part(Use(), Use(cycles=(2,)))
    assert not same_part(Use(), Use(branch="unloading"))

"""Which way compression is, decided from whole records that mislead at a glance, obeyed where it is said, refused in doubt."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab.instruments import LabTable, read_lab_file
from calib.lab.observations import Observations, observe
from calib.lab.resets import resets_of
from calib.lab.shape import shape_of
from models.sensor import FloatArray

SIGNS = [(1, 1), (-1, -1), (-1, 1), (1, -1)]
SPEED = 0.02  # [mm/s]


def table(
    columns: Mapping[str, FloatArray], sign: Mapping[str, str] | None = None, names: Mapping[str, str] | None = None
) -> LabTable:
    """A lab table of columns in SI, as a reader would give it."""
    n = next(iter(columns.values())).size
    return LabTable(
        path=Path("press.csv"),
        sha256="0",
        recognised_as="table with a header",
        reason="",
        encoding="utf-8",
        delimiter=",",
        decimal=".",
        columns=columns,
        sources={name: name for name in columns} | dict(names or {}),
        lines=np.arange(n) + 2,
        reasons=("",) * n,
        notes=(),
        sign=sign or {},
    )


@dataclass(frozen=True)
class Record:
    """A ball that goes from corner to corner [mm] above a sensor whose surface is at 0; force [N], compression positive."""

    corners: Sequence[float] = (-0.2, 0.8, -0.2)
    wait: float = 0.0
    power: float = 1.8
    peak: float = 5.0
    pull_off: float = 0.0
    neck: float = 0.15
    zero: float = 0.3
    drift: float = 0.0  # [N/s]
    noise: float = 5e-3
    rate: float = 5.0
    seed: int = 1
    spikes: Mapping[int, float] = field(default_factory=dict)

    @property
    def columns(self) -> dict[str, FloatArray]:
        """Time [s], displacement [m], force [N] and capacitance [F]."""
        legs = np.abs(np.diff(self.corners)) / SPEED
        times = np.concatenate([[0.0], np.cumsum(np.concatenate([[self.wait], legs]))])
        t = np.arange(0, times[-1], 1 / self.rate)
        x = np.interp(t, times, [self.corners[0], *self.corners])
        back = np.gradient(x) < -1e-9
        d = np.maximum(x, 0) / 0.8
        stuck = np.zeros(t.size, dtype=bool)
        for i in range(1, t.size):
            stuck[i] = x[i] > 0 or (stuck[i - 1] and x[i] > -self.neck)
        force = self.peak * d**self.power * np.where(back, 0.9, 1.0)
        sticks = np.interp(x, [-self.neck, -0.98 * self.neck, 0.0, 0.3, 0.8], [0, -1, -0.7, -0.2, 0])
        force = force + self.pull_off * np.where(back & stuck, sticks, 0)
        rng = np.random.default_rng(self.seed)
        force = force + self.zero + self.drift * t + self.noise * rng.normal(size=t.size)
        for row, by in self.spikes.items():
            force[row] += by
        return {"time": t, "displacement": x * 1e-3, "force": force, "capacitance": (97 + 2 * d**1.6) * 1e-12}


def seen(
    columns: Mapping[str, FloatArray], force: int, displacement: int, without: Sequence[str] = ("capacitance",)
) -> Observations:
    """What is made of a record with the signs of some tester."""
    turned = {"force": force, "displacement": displacement}
    return observe(table({q: turned.get(q, 1) * v for q, v in columns.items() if q not in without}))


MISLEADING = {
    "a press": Record(),
    "a press that ends at the top": Record(corners=(-0.2, 0.8)),
    "a record from the touch on": Record(corners=(0.0, 0.8, 0.0), zero=0.0),
    "a pull-off above the press": Record(corners=(-0.2, 0.8, -0.5), pull_off=15.0),
    "a pull-off at which the record ends": Record(corners=(-0.2, 0.8, -0.1), pull_off=12.0),
    "a long neck, withdrawn far": Record(corners=(-0.2, 0.8, -5.0), pull_off=12.0, neck=1.5),
    "a pull-off in each cycle": Record(corners=(-0.2, 0.8, -0.5, 0.8, -0.5), pull_off=9.0),
    "a withdrawal tenfold the press": Record(corners=(-0.2, 0.8, -8.0)),
    "an approach tenfold the press": Record(corners=(-8.0, 0.8)),
    "a start in the press": Record(corners=(0.8, -0.3, 0.8, -0.3)),
    "a start in the press, only lifted": Record(corners=(0.8, -0.3)),
    "a start in the press, with pull-off": Record(corners=(0.8, -0.5, 0.8), pull_off=9.0),
    "a start in contact": Record(corners=(0.1, 0.8, 0.1), zero=0.0),
    "a load of twice the press that was not zeroed": Record(zero=-10.0),
    "a drift of three presses while it waits": Record(wait=60.0, drift=-0.1),
    "a drift of a third of the press": Record(drift=-0.02),
    "a drift over cycles": Record(corners=(-0.2, 0.8, -0.2, 0.8, -0.2), drift=-0.05),
    "spikes at the start and inside": Record(spikes={0: -60.0, 1: -55.0, 100: -40.0, 180: -90.0, 181: -90.0}),
    "a touch first": Record(corners=(-1.0, 0.08, -1.0, 0.8, -1.0)),
    "few readings": Record(rate=0.2),
}


@pytest.mark.parametrize("record", MISLEADING.values(), ids=MISLEADING.keys())
@pytest.mark.parametrize(("force", "displacement"), SIGNS)
def test_compression_is_made_positive_whatever_misleads(record: Record, force: int, displacement: int) -> None:
    true = record.columns
    obs = seen(true, force, displacement)
    assert obs.force is not None
    assert obs.displacement is not None
    np.testing.assert_array_equal(obs.force, true["force"])
    np.testing.assert_array_equal(obs.displacement, true["displacement"])
    for quantity, sign in (("force", force), ("displacement", displacement)):
        assert obs.signs[quantity].factor == sign
        assert obs.signs[quantity].strength in ("clear", "likely")
        assert obs.signs[quantity].note in obs.sign_note


@pytest.mark.parametrize("seed", range(3))
def test_a_record_zeroed_in_the_press_may_as_well_be_a_press_onto_a_plateau(seed: int) -> None:
    columns = Record(corners=(0.8, -0.3, 0.8), seed=seed).columns
    tared = {**columns, "force": columns["force"] - columns["force"][0], "displacement": columns["displacement"] - 0.8e-3}
    with pytest.raises(InputError, match="cannot be told which way compression is in force") as caught:
        seen(tared, -1, -1)
    assert "is flat, as out of contact" in caught.value.faults[0].advice
    turned = {q: -tared[q] for q in ("force", "displacement")}
    said = observe(table(turned, {"force": "compression negative"}))
    assert said.signs["force"].factor == said.signs["displacement"].factor == -1


@pytest.mark.parametrize("seed", range(3))
def test_a_record_that_starts_pressed_and_is_flat_at_zero_load_is_read_as_one(seed: int) -> None:
    obs = seen(Record(corners=(0.8, -0.3, 0.8), zero=0.0, seed=seed).columns, -1, -1)
    assert obs.signs["force"].factor == obs.signs["displacement"].factor == -1
    assert "starts pressed" in obs.sign_note


def saturated(share: float, record: Record, *, noise: float = 3e-3, on_top: bool = False) -> dict[str, FloatArray]:
    """A press without noise of which the load cell ends at a share of the peak, with noise before it, or on its flat top."""
    columns = record.columns
    scatter = np.random.default_rng(record.seed).normal(0.0, noise, columns["force"].size)
    before, behind = (0.0, scatter) if on_top else (scatter, 0.0)
    columns["force"] = np.round(np.minimum(columns["force"] + before, share * record.peak) + behind, 4)
    return columns


PRESSES = {
    "from before the touch": Record(zero=0.0, noise=0.0),
    "from the touch on": Record(corners=(0.0, 0.8, 0.0), zero=0.0, noise=0.0),
    "held at the turn": Record(corners=(0.0, 0.8, 0.8001, 0.0), zero=0.0, noise=0.0),
    "without its way back": Record(corners=(-0.1, 0.8), zero=0.0, noise=0.0),
}


@pytest.mark.parametrize("share", [0.2, 0.3, 0.4, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("press", PRESSES.values(), ids=PRESSES.keys())
@pytest.mark.parametrize("on_top", [False, True], ids=["to the digit", "with noise on top"])
@pytest.mark.parametrize(("force", "displacement"), SIGNS)
def test_the_end_of_the_range_of_a_load_cell_is_no_rest_out_of_contact(
    share: float, press: Record, on_top: bool, force: int, displacement: int
) -> None:
    found = seen(saturated(share, press, on_top=on_top), force, displacement).signs
    assert (found["force"].factor, found["displacement"].factor) == (force, displacement)


@pytest.mark.parametrize("offset", [0.6, -2.0, 7.0])
@pytest.mark.parametrize(("force", "displacement"), SIGNS)
def test_a_saturated_load_that_was_not_zeroed_is_not_turned(offset: float, force: int, displacement: int) -> None:
    columns = saturated(0.3, PRESSES["from before the touch"])
    found = seen({**columns, "force": columns["force"] + offset}, force, displacement).signs
    assert (found["force"].factor, found["displacement"].factor) == (force, displacement)


def foam(noise: float = 3e-3) -> dict[str, FloatArray]:
    """A press of a foam, whose load stands at a plateau, with a loss on the way back."""
    columns = Record(corners=(0.0, 0.8, 0.0), zero=0.0).columns
    depth = columns["displacement"] / 0.8e-3
    back = np.gradient(depth) < 0
    scatter = np.random.default_rng(1).normal(0.0, noise, depth.size)
    return {**columns, "force": 3.2 * np.tanh(3.5 * depth) * np.where(back, 0.88, 1.0) + scatter}


@pytest.mark.parametrize(("force", "displacement"), SIGNS)
def test_a_plateau_of_a_foam_turns_no_sign(force: int, displacement: int) -> None:
    columns = foam()
    with pytest.raises(InputError, match="cannot be told which way compression is in force") as caught:
        seen(columns, force, displacement)
    assert "--sign" in caught.value.faults[0].advice
    beside = seen(columns, force, displacement, without=())
    assert (beside.signs["force"].factor, beside.signs["displacement"].factor) == (force, displacement)


def test_names_settle_what_a_plateau_leaves_open() -> None:
    columns = {q: v for q, v in foam().items() if q != "capacitance"}
    for names in (
        {"force": "Compressive load (N)", "displacement": "Compressive extension (mm)"},
        {"force": "Druckkraft [N]", "displacement": "Stauchung [mm]"},
        {"force": "Compressive load (N)", "displacement": "Position (mm)"},
    ):
        found = observe(table(columns, names=names)).signs
        assert found["force"].factor == found["displacement"].factor == 1


@pytest.mark.parametrize("zero", [0.0, -5.2, 20.0])
@pytest.mark.parametrize(("force", "displacement"), SIGNS)
def test_the_bend_of_a_machine_that_starts_to_move_makes_no_retreat(zero: float, force: int, displacement: int) -> None:
    # From a load of 4 N on: steep as the slack goes, then slower and slower, as a retreat looks from its end.
    u = np.linspace(0.0, 1.0, 60)
    load = zero + 4.3 + 0.45 * (1.0 - np.exp(-u / 0.08)) + 0.75 * u - 0.1 * u**2 + 0.01 * np.sin(37.0 * np.arange(60))
    columns = {"time": u, "displacement": 2.0e-3 + 0.19e-3 * u, "force": load}
    with pytest.raises(InputError, match="cannot be told") as caught:
        seen(columns, force, displacement)
    assert all(words in str(caught.value) for words in ("a press", "a retreat"))


DOUBTFUL = {
    "a straight line from a load, without a flat part": Record(corners=(0.8, 0.0), power=1.0, zero=0.0),
    "a lift that ends at the pull-off": Record(corners=(0.8, -0.1), pull_off=9.0),
    "a little more and a little less": Record(corners=(0.6, 0.8, 0.6), power=1.0),
}


@pytest.mark.parametrize("record", DOUBTFUL.values(), ids=DOUBTFUL.keys())
@pytest.mark.parametrize(("force", "displacement"), SIGNS)
def test_a_doubtful_sign_is_refused_and_the_advice_leads_out(record: Record, force: int, displacement: int) -> None:
    true = record.columns
    columns = {"time": true["time"], "force": force * true["force"], "displacement": displacement * true["displacement"]}
    with pytest.raises(InputError, match="cannot be told which way compression is in force") as caught:
        observe(table(columns))
    fault = caught.value.faults[0]
    sense = "positive" if force > 0 else "negative"
    for words in ('--sign "force=compression positive"', '--sign "force=compression negative"', "a press", "a retreat"):
        assert words in fault.advice
    assert fault.choice is not None
    assert (fault.choice.option, fault.choice.key) == ("sign", "force")
    obs = observe(table(columns, {"force": f"compression {sense}"}))
    np.testing.assert_array_equal(obs.displacement, true["displacement"])
    np.testing.assert_array_equal(obs.force, true["force"])


def sticky(touch: float, pull: float, zero: float, rows: int, hold: int = 0) -> dict[str, FloatArray]:
    """A press of 1 N from contact on, or 0.85 mm before, of a ball that sticks by `pull` [N] where the record ends."""
    up = rows // 2
    way = np.concatenate([np.linspace(0, 0.85, up), np.full(hold, 0.85), np.linspace(0.85, 0, rows - up - hold)])
    share = (way - touch) / (0.85 - touch)
    press = np.maximum(share, 0.0) ** 1.5
    sticks = np.where((np.arange(rows) >= up + hold) & (share < 0.55), pull * np.exp(-(((share - 0.02) / 0.16) ** 2)), 0.0)
    noise = 0.003 * np.random.default_rng(rows).normal(size=rows)
    force = np.round(press - sticks + zero + noise, 4)
    return {
        "time": 0.1 * np.arange(rows, dtype=np.float64),
        "displacement": way * 1e-3,
        "force": force,
        "capacitance": (97 + press) * 1e-12,
    }


STICKS = {
    "four presses and a load of no zero": sticky(0.02, 4.0, 6.0, 400, 80),
    "four presses, in few rows": sticky(0.0, 4.0, -5.0, 16),
    "seven presses, hardly out of contact": sticky(0.05, 7.0, 5.0, 60),
    "twelve presses": sticky(0.05, 12.0, -5.0, 160),
    "two presses": sticky(0.0, 2.0, 5.0, 30),
    "twelve presses, in few rows": sticky(0.0, 12.0, 2.0, 16),
}


@pytest.mark.parametrize("true", STICKS.values(), ids=STICKS.keys())
@pytest.mark.parametrize(("force", "displacement"), SIGNS)
def test_a_ball_that_sticks_to_the_end_by_more_than_it_pressed_leaves_the_sign_in_doubt(
    true: dict[str, FloatArray], force: int, displacement: int
) -> None:
    columns = {"time": true["time"], "force": force * true["force"], "displacement": displacement * true["displacement"] + 5e-3}
    with pytest.raises(InputError, match="cannot be told which way compression is in force") as caught:
        observe(table(columns))
    assert '--sign "force=compression positive" if this is' in caught.value.faults[0].advice
    assert (
        observe(table(columns, {"force": f"compression {'positive' if force > 0 else 'negative'}"})).signs["force"].factor
        == force
    )


@pytest.mark.parametrize(("force", "displacement"), SIGNS)
def test_a_capacitance_settles_whether_a_small_change_before_a_large_one_is_a_retreat(force: int, displacement: int) -> None:
    true = Record(corners=(0.8, 0.0, 0.8), zero=10.0, drift=0.04).columns
    with pytest.raises(InputError, match="cannot be told which way compression is in force"):
        seen(true, force, displacement)
    assert seen(true, force, displacement, without=()).signs["force"].factor == force


@pytest.mark.parametrize("force", [1, -1])
@pytest.mark.parametrize("displacement", [1, -1])
def test_one_stretch_that_softens_from_a_load_on_is_in_doubt(force: int, displacement: int) -> None:
    depth = np.linspace(0.0, 24e-3, 120)
    load = 0.45 + 1.7 * np.minimum(depth / 18e-3, 1.0) ** 0.5
    columns = {"displacement": displacement * depth, "force": force * load}
    with pytest.raises(InputError, match="cannot be told which way compression is in force"):
        observe(table(columns))
    assert observe(table(columns, {"force": "compression positive"})).signs["force"].factor == 1


@pytest.mark.parametrize("zero", [6.0, -14.0])
@pytest.mark.parametrize(("force", "displacement"), SIGNS)
def test_a_record_that_starts_deep_and_only_bends_is_in_doubt_if_its_displacement_is_zero_at_the_other_end(
    zero: float, force: int, displacement: int
) -> None:
    x = np.abs(np.mod(np.arange(300) * 0.3 + 40.0, 80.0) - 40.0) * 1e-3
    columns = {"displacement": x, "force": zero + 8.0 * (x / 40e-3) ** 0.8}
    with pytest.raises(InputError, match="cannot be told which way compression is in force") as caught:
        seen(columns, force, displacement)
    assert "--sign" in caught.value.faults[0].advice
    said = observe(table({"displacement": x, "force": columns["force"]}, {"force": "compression positive"}))
    assert said.signs["displacement"].factor == 1


@pytest.mark.parametrize("n_press", [1, 2, 4])
@pytest.mark.parametrize("force", [1, -1])
@pytest.mark.parametrize("displacement", [1, -1])
def test_a_press_that_begins_under_a_drift_in_the_last_rows_is_in_doubt(n_press: int, force: int, displacement: int) -> None:
    n = np.arange(39.0)
    drift = 0.1 + 0.07 * n - 2e-4 * n**2 + 0.005 * (-1.0) ** n
    load = -drift + 0.42 * np.clip(n - 38 + n_press, 0.0, None)
    columns = {"displacement": displacement * 70e-6 * n, "force": force * load}
    with pytest.raises(InputError, match="cannot be told which way compression is"):
        observe(table(columns))
    sense = "positive" if force > 0 else "negative"
    said = {"force": f"compression {sense}", "displacement": f"compression {'positive' if displacement > 0 else 'negative'}"}
    assert observe(table(columns, said)).signs["force"].factor == force


@pytest.mark.parametrize(("force", "displacement"), SIGNS)
@pytest.mark.parametrize(("steep", "n_press"), [(1.2, 9), (0.35, 10), (0.25, 15)])
def test_a_drift_does_not_tell_how_displacement_goes_with_the_force_of_the_press_behind_it(
    steep: float, n_press: int, force: int, displacement: int
) -> None:
    n = np.arange(60.0)
    load = -0.46 - 0.09 * n + 0.005 * (-1.0) ** n + steep * np.clip(n - 59 + n_press, 0.0, None)
    columns = {"displacement": displacement * (74.0 + 0.07 * n) * 1e-3, "force": force * load}
    sense = {1: "compression positive", -1: "compression negative"}
    said = {"force": sense[force]}
    for signs in ({}, said):
        with contextlib.suppress(InputError):
            found = observe(table(columns, signs)).signs
            assert (found["force"].factor, found["displacement"].factor) == (force, displacement)
    obs = observe(table(columns, said | {"displacement": sense[displacement]}))
    assert (obs.signs["force"].factor, obs.signs["displacement"].factor) == (force, displacement)


@pytest.mark.parametrize(("force", "displacement"), SIGNS)
def test_a_retreat_that_ends_with_the_ball_coming_off_is_still_read(force: int, displacement: int) -> None:
    depth = np.linspace(0.8, -0.4, 120)
    load = 5.0 * np.clip(depth / 0.8, 0.0, None) ** 1.8 + np.where((depth < 0.05) & (depth > -0.15), -0.4, 0.0)
    found = observe(table({"displacement": displacement * depth * 1e-3, "force": force * load})).signs
    assert (found["force"].factor, found["displacement"].factor) == (force, displacement)


@pytest.mark.parametrize("displacement", [1, -1])
def test_a_retreat_whose_load_is_negative_is_in_doubt(displacement: int) -> None:
    way = np.linspace(0.0, 3.0, 150)
    load = -7.2 * (1 - (way / 3.0) ** 1.7) - 0.4
    columns = {"displacement": displacement * way * 1e-3, "force": load}
    with pytest.raises(InputError, match="cannot be told which way compression is in force"):
        observe(table(columns))
    found = observe(table(columns, {"force": "compression negative"})).signs
    assert (found["force"].factor, found["displacement"].factor) == (-1, -displacement)


def test_what_is_said_is_obeyed_and_a_contradiction_is_told() -> None:
    columns = Record().columns
    del columns["capacitance"]
    agreed = observe(table(columns, {"force": "compression positive", "displacement": "compression positive"}))
    assert "opposite" not in agreed.sign_note
    assert [d.strength for d in agreed.signs.values()] == ["stated", "stated"]
    against = observe(table(columns, {"force": "compression negative"}))
    assert (against.signs["force"].factor, against.signs["displacement"].factor) == (-1, -1)
    assert "as stated; the record shows the opposite" in against.sign_note
    apart = observe(table(columns, {"force": "compression positive", "displacement": "compression negative"}))
    assert (apart.signs["force"].factor, apart.signs["displacement"].factor) == (1, -1)
    assert "opposite" in apart.sign_note


def test_a_sign_said_of_what_is_not_there_is_told_and_a_wrong_word_refused() -> None:
    columns = Record().columns
    obs = observe(table({q: columns[q] for q in ("time", "capacitance")}, {"force": "compression negative"}))
    assert obs.sign_note == "force: its sign is stated, but the file has no such column"
    with pytest.raises(InputError, match="force = up"):
        observe(table(columns, {"force": "up"}))


def test_names_count_less_than_what_the_record_shows() -> None:
    true = Record().columns
    columns = {"time": true["time"], "force": -true["force"], "displacement": true["displacement"]}
    obs = observe(table(columns, names={"force": "Compressive load (N)"}))
    assert obs.signs["force"].factor == -1
    assert 'although force is called "Compressive load (N)"' in obs.sign_note
    line = Record(corners=(0.6, 0.8, 0.6), power=1.0).columns
    named = {"time": line["time"], "force": -line["force"], "displacement": line["displacement"]}
    assert observe(table(named, names={"force": "Tensile force (N)"})).signs["force"].factor == -1


@pytest.mark.parametrize("force", [1, -1])
@pytest.mark.parametrize(
    "record", [Record(zero=0.0), Record(corners=(-0.2, 0.8, -0.5), pull_off=15.0, zero=0.0), Record(drift=-0.2)]
)
def test_a_force_beside_a_capacitance_is_told_by_what_rises_with_compression(record: Record, force: int) -> None:
    assert seen(record.columns, force, 1, without=("displacement",)).signs["force"].factor == force


@pytest.mark.parametrize("displacement", [1, -1])
@pytest.mark.parametrize("corners", [(-0.2, 0.8, -0.2), (0.8, -0.3, 0.8), (-0.2, 0.8, -6.0)])
def test_a_displacement_beside_a_capacitance_is_told_by_what_rises(corners: Sequence[float], displacement: int) -> None:
    columns = Record(corners=corners).columns
    rng = np.random.default_rng(1)
    noisy = {**columns, "capacitance": columns["capacitance"] + 5e-15 * rng.normal(size=columns["time"].size)}
    obs = seen(noisy, 1, displacement, without=("force",))
    assert obs.signs["displacement"].factor == displacement


def test_noise_alone_keeps_its_sign_and_says_so() -> None:
    columns = Record(peak=0.0).columns
    obs = seen(columns, -1, 1)
    assert obs.signs["force"].strength == "none"
    assert "force: no excursion beyond its noise, sign kept" in obs.sign_note


@pytest.mark.parametrize("sign", [1, -1])
def test_rows_before_an_extension_that_was_reset_at_touch_are_left_out(sign: int) -> None:
    columns = Record(corners=(-2.0, 0.8, -0.2), zero=0.0).columns
    x = columns["displacement"]
    touch = int(np.argmax(x > 0))
    reset = np.where(np.arange(x.size) < touch, x + 5e-3, x - x[touch])
    obs = seen({**columns, "displacement": reset}, 1, sign)
    assert obs.signs["displacement"].factor == sign
    assert not np.any(obs.used[:touch])
    assert np.flatnonzero(obs.used)[0] == touch
    assert f"set anew in line {touch + 2}" in obs.reason[touch - 5]
    assert obs.displacement is not None
    assert np.max(obs.displacement[obs.used]) == pytest.approx(np.max(reset[touch:]), abs=1e-5)


def test_a_fast_return_of_the_crosshead_is_no_reset() -> None:
    x = np.tile(np.concatenate([np.linspace(0, 0.8e-3, 200), [0.0]]), 3)
    force = np.asarray(5 * (x / 0.8e-3) ** 1.8, dtype=np.float64)
    assert resets_of(x, force, np.linspace(0.0, 60.0, x.size), np.ones(x.size, dtype=bool)).size == 0


def test_a_slow_press_after_a_fast_approach_does_not_stand_still() -> None:
    t = np.concatenate([np.arange(0, 10, 0.1), np.arange(10, 16, 0.1)])
    x = np.where(t < 10, t - 10, (t - 10) / 60)
    force = 3 * (np.maximum(x, 0) / 0.1) ** 1.5 + 1e-3 * np.random.default_rng(1).normal(size=t.size)
    obs = observe(table({"time": t, "displacement": x * 1e-3, "force": force}))
    assert np.mean(obs.used[t > 10]) > 0.95


def test_short_cycles_after_a_long_approach_are_told_apart() -> None:
    obs = seen(Record(corners=(-8.0, 0.3, 0.1, 0.3, 0.1, 0.3, -8.0), zero=0.0).columns, -1, -1)
    assert obs.n_cycle == 3


def test_the_shape_of_a_press_is_what_it_was_made_with() -> None:
    x = np.linspace(-0.4, 0.8, 600)
    found = shape_of(x, np.maximum(x, 0) ** 2, np.arange(600.0))
    assert found is not None
    assert found.slope == 1
    assert found.flat_low == pytest.approx(1 / 3 + np.sqrt(0.02) * 2 / 3, abs=0.04)
    assert found.flat_high < 0.02
    assert found.bend == pytest.approx(0.5 - 0.64 / 3 * 0.8 / 1.2 / 0.64, abs=0.02)


# A press of which a drift hides most: the ball goes one way, and the force first away from the load, then along with it.
STEPS = np.arange(39, dtype=np.float64)
CLOCK = np.asarray(0.86 * STEPS, dtype=np.float64)
PLACE = np.asarray(-74.0e-3 - 7e-5 * STEPS, dtype=np.float64)
PRESSED = -8.9 * (np.clip(STEPS - 30.5, 0, None) / 7.5) ** 1.3 + 0.004 * np.sin(37.0 * STEPS)


@pytest.mark.parametrize("rows", range(34, 40))
@pytest.mark.parametrize("share", [0.3, 0.45, 0.6, 0.75, 0.9])
def test_a_drift_that_hides_the_press_turns_no_sign(share: float, rows: int) -> None:
    force = np.asarray(PRESSED + share * 8.9 * STEPS / STEPS.size, dtype=np.float64)
    record = table({"time": CLOCK[:rows], "displacement": PLACE[:rows], "force": force[:rows]})
    try:
        seen = observe(record)
    except InputError:
        return  # in doubt
    assert [seen.signs[q].factor for q in ("force", "displacement")] == [-1.0, -1.0]


def test_a_force_that_leaves_and_comes_back_as_the_ball_goes_one_way_shows_no_direction() -> None:
    force = np.asarray(np.where(STEPS < 30, 0.1 * STEPS, 3.0 - 0.35 * (STEPS - 30)), dtype=np.float64)
    with pytest.raises(InputError, match="it cannot be told which way compression is"):
        observe(table({"time": CLOCK, "displacement": PLACE, "force": force}))


def test_a_record_that_starts_pressed_shows_compression_or_its_sign_is_refused(tmp_path: Path) -> None:
    # A press of a tester that writes compression negative and was not zeroed, cut soon after it began.
    rows = np.arange(36)
    x = -2.047 - 0.0034 * np.clip(rows - 4, 0, None)
    f = -4.3 - 0.84 * (rows / 35) ** 0.6
    path = tmp_path / "press.csv"
    cells = "".join(f"{0.02 * r:.2f},{a:.5f},{b:.5f}\n" for r, a, b in zip(rows, x, f, strict=True))
    path.write_text("Time (s),Extension (mm),Load (N)\n" + cells)
    with pytest.raises(InputError, match="cannot be told which way compression is"):
        observe(read_lab_file(path))


@pytest.mark.parametrize(("force", "displacement"), SIGNS)
@pytest.mark.parametrize(("drift", "back"), [(-1.2, 0.6), (-2.0, 0.9), (-2.7, 0.8), (-1.0, 0.3)])
def test_a_drift_larger_than_the_press_does_not_tell_a_sign_where_the_retreat_is_cut_short(
    drift: float, back: float, force: int, displacement: int
) -> None:
    depth = np.concatenate([np.linspace(0.0, 1.0, 60), np.linspace(1.0, back, max(6, round(60 * (1 - back))))])
    load = 3.0 * depth**1.5 + 3.0 * drift * np.linspace(0.0, 1.0, depth.size)
    columns = {"displacement": displacement * (depth + 20.0) * 1e-3, "force": force * load}
    with contextlib.suppress(InputError):
        found = observe(table(columns)).signs
        assert (found["force"].factor, found["displacement"].factor) == (force, displacement)
    sense = {1: "compression positive", -1: "compression negative"}
    found = observe(table(columns, {"force": sense[force], "displacement": sense[displacement]})).signs
    assert (found["force"].factor, found["displacement"].factor) == (force, displacement)


@pytest.mark.parametrize(("force", "displacement"), SIGNS)
@pytest.mark.parametrize("drift", [0.0, 0.08, -0.08])
@pytest.mark.parametrize("back", [0.0, 0.3, 0.6, 0.9])
def test_a_small_drift_leaves_the_sign_of_a_press_whose_retreat_is_cut_short(
    back: float, drift: float, force: int, displacement: int
) -> None:
    depth = np.concatenate([np.linspace(-0.2, 1.0, 60), np.linspace(1.0, back, max(6, round(60 * (1 - back))))])
    load = 3.0 * np.maximum(depth, 0.0) ** 1.5 + 3.0 * drift * np.linspace(0.0, 1.0, depth.size)
    found = observe(table({"displacement": displacement * depth * 1e-3, "force": force * load})).signs
    assert (found["force"].factor, found["displacement"].factor) == (force, displacement)


@pytest.mark.parametrize(("force", "displacement"), SIGNS)
@pytest.mark.parametrize(("drift", "right"), [(-1.4, False), (-2.6, False), (0.0, True), (-0.05, True)])
def test_a_record_of_a_dozen_rows_under_a_drift_is_in_doubt(drift: float, right: bool, force: int, displacement: int) -> None:
    depth = np.concatenate([np.linspace(-0.8, 0.8, 6), np.linspace(0.8, -0.8, 6)[1:]])
    load = np.maximum(depth, 0.0) ** 1.4 + drift * np.linspace(0.0, 1.0, depth.size)
    columns = {"displacement": displacement * depth * 1e-3, "force": force * load}
    if not right:
        with pytest.raises(InputError, match=r"it cannot be told which way compression is|a drift is larger than the press"):
            observe(table(columns))
        return
    found = observe(table(columns)).signs
    assert (found["force"].factor, found["displacement"].factor) == (force, displacement)


SAID: tuple[dict[str, str], ...] = (
    {},
    {"force": "compression positive"},
    {"force": "compression negative"},
    {"force": "compression positive", "displacement": "compression positive"},
)


@pytest.mark.parametrize("said", SAID)
@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("corners", [(-0.2, 0.8, -0.2), (-0.2, 0.8, -0.2, 0.8, -0.2), (-0.2, 0.8, 0.1)])
def test_a_force_that_was_sorted_alone_is_refused_whatever_is_said_of_its_sign(
    corners: Sequence[float], order: int, said: dict[str, str]
) -> None:
    columns = Record(corners=corners).columns
    columns = {"displacement": columns["displacement"], "force": np.sort(columns["force"])[::order]}
    with pytest.raises(
        InputError, match="force goes one way from the first row to the last, while the ball goes there and comes"
    ):
        observe(table(columns, said))


@pytest.mark.parametrize(
    "record",
    [
        Record(),
        Record(corners=(-0.2, 0.8)),
        Record(corners=(0.8, -0.2)),
        Record(corners=(-0.2, 0.8, 0.6)),
        Record(drift=0.02),
        Record(wait=60.0, drift=0.1),
        Record(corners=(-0.2, 0.8, -0.5), pull_off=15.0),
    ],
)
def test_a_press_whose_sign_is_said_is_not_taken_for_a_sorted_one(record: Record) -> None:
    columns = {q: v for q, v in record.columns.items() if q != "capacitance"}
    assert observe(table(columns, {"force": "compression positive"})).signs["force"].factor == 1


def test_a_displacement_that_is_turned_against_its_name_is_told_of() -> None:
    columns = Record().columns
    columns = {"displacement": -columns["displacement"], "force": columns["force"]}
    names = {"displacement": "Compressive displacement (mm)"}
    found = observe(table(columns, {"force": "compression positive"}, names)).signs["displacement"]
    assert found.factor == -1
    assert 'but displacement is called "Compressive displacement (mm)"' in found.note
    told = observe(table(Record().columns, {"force": "compression positive"}, names)).signs["displacement"]
    assert told.factor == 1
    assert "but displacement is called" not in told.note

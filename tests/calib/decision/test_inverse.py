"""Readings of a gripper turned into forces, where the right force is known."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from calib.checks import Member
from calib.decision import ForceTable, Gripper, GripperTables, Status, invert
from calib.decision.inverse import table_of
from calib.decision.readable import SensorDraws, next_sensor
from calib.decision.retreat import Retreats, band_of
from calib.errors import InputError
from calib.lab import SHARES, Unloading
from calib.priors.distributions import Fixed, Normal, Prior
from calib.sampling.posterior import Posterior, thin_draws
from models.analytic import ClosedForm
from models.curves import predict_design
from models.response import Response
from models.sensor import Design, FloatArray, design_from
from models.surrogate import load_surrogate

MakePosterior = Callable[..., Posterior]


@dataclass(frozen=True)
class Spring:
    """F = k d with k = 1000 N/m; the change is F/100 N and a term in F^2, less a `dip` at small forces; no error of its own."""

    bend: float = 0.0
    dip: float = 0.0
    reach: float = 20.0
    name: str = "spring"

    @property
    def identity(self) -> str:
        return repr(self)

    def max_depth(self, design: Design) -> FloatArray:
        """The softer the sensor, the farther."""
        return self.reach * 1e-3 * np.asarray(design.draws().sensor.young_modulus) / 1e6

    def outside(self, design: Design, depth: FloatArray) -> str:
        return "" if np.all(np.max(depth) <= self.max_depth(design)) else "the spring ends here"

    def respond(self, design: Design, depth: FloatArray) -> Response:
        c0 = np.atleast_1d(np.asarray(design.draws().rest_capacitance, dtype=float))
        d = np.maximum(np.broadcast_to(depth, (c0.size, np.shape(depth)[-1])), 0.0)
        force = 1000 * d
        change = force / 100 - self.bend * force**2 - self.dip * force * np.exp(-force)
        nothing = np.zeros((*d.shape, 0))
        return Response(d, force, d, c0[:, None] * (1 + change), c0, nothing, nothing)


NOISE = 1e-14
ERRORLESS = ClosedForm(force_error=0.0, capacitance_error=0.0)


def _draws(forward: Spring, modulus: FloatArray, parasitic: float = 0.0) -> SensorDraws:
    """Draws of a sensor of which only the modulus is not known, which the spring takes for its length."""
    values = {"sensor_thickness": 0.74e-3, "padding_thickness": 1.1e-3, "relative_permittivity": 2.8}
    design = design_from({**values, "young_modulus": modulus, "indenter_radius": 5e-3, "sensor_radius": 10e-3}).draws()
    nothing = np.zeros(modulus.size)
    return SensorDraws(forward, design, nothing + NOISE, nothing + parasitic, nothing, nothing)


def _table(forward: Spring, rated: float = 5.0, parasitic: float = 0.0, spread: float = 0.0, n_tare: int = 4) -> ForceTable:
    modulus = 1e6 * np.exp(spread * np.linspace(-2, 2, 200))
    return table_of("spring", "specimen", [_draws(forward, modulus, parasitic)], Gripper(n_tare=n_tare), rated)


def test_force_and_bounds_of_a_linear_sensor_are_those_of_its_noise() -> None:
    table = _table(Spring())
    c0 = float(table.rest_capacitance[1])
    force = np.linspace(0.5, 5.0, 10)
    found = table.read(force / 100)
    noise = NOISE / c0 * np.sqrt(1 + (1 + force / 100) ** 2 / 4)  # of a reading and of a tare by four
    np.testing.assert_allclose(found.force, force, rtol=1e-4)
    np.testing.assert_allclose(found.upper - force, 164.485 * noise, rtol=0.01)
    np.testing.assert_allclose(force - found.lower, 164.485 * noise, rtol=0.01)
    np.testing.assert_allclose(found.sigma, 100 * noise, rtol=0.01)
    assert np.all(found.status == Status.VALID)


@pytest.mark.parametrize("parasitic", [0.0, 5e-12])
def test_what_leads_add_stays_in_the_denominator(parasitic: float) -> None:
    table = _table(Spring(), parasitic=parasitic)
    c0 = float(table.rest_capacitance[1])
    capacitance = c0 * (1 + 3.0 / 100)
    assert float(table.force_at(capacitance + parasitic, c0 + parasitic).force) == pytest.approx(3.0, rel=1e-4)
    assert table.tare[1] == pytest.approx(c0 + parasitic)


def test_statuses_part_where_the_table_says() -> None:
    table = _table(Spring())
    step = 1e-9
    at = np.array([table.below - step, table.below + step, 0.0, table.touch - step, table.touch + step])
    said = [Status.BELOW_REST, Status.NO_CONTACT, Status.NO_CONTACT, Status.NO_CONTACT, Status.VALID]
    assert table.read(at).status.tolist() == said
    end = float(table.ratio[-1])
    assert table.read([end, end + step, 1e9]).status.tolist() == [Status.VALID, Status.BEYOND_RANGE, Status.BEYOND_RANGE]
    assert table.read([np.nan, np.inf, -np.inf]).status.tolist() == [Status.BAD_INPUT] * 3
    beyond = table.read(10 * end)
    assert (beyond.force, beyond.lower) == (table.force[-1], table.lower[-1])
    assert table.read(-0.5).force == 0
    for pair in ((0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (np.nan, 1.0), (1.0, np.inf)):
        assert table.force_at(*pair).status == Status.BAD_INPUT
    with_contact = table.read(np.linspace(table.touch, end, 50)[1:])
    assert np.all(with_contact.lower > 0)


def test_a_reading_may_have_any_unit() -> None:
    table = _table(Spring())
    one, other = (table.force_at(scale * 1.03 * 97.3, scale * 97.3) for scale in (1e-12, 1.0))
    assert float(one.force) == pytest.approx(float(other.force), rel=1e-9)


def test_a_table_ends_where_the_signal_turns_and_says_so() -> None:
    # x = F/100 - F^2/2000 is largest at 10 N; 11 N reads like 9 N.
    table = _table(Spring(bend=5e-4, reach=30.0), rated=12.0)
    assert table.end == pytest.approx(10.0, rel=0.02)
    assert table.end <= table.turn < 10.5
    rising = table.read((lambda f: f / 100 - f**2 / 2000)(np.array([2.0, 5.0, 8.0])))
    np.testing.assert_allclose(rising.force, [2.0, 5.0, 8.0], rtol=1e-3)
    assert np.isnan(_table(Spring(bend=5e-4, reach=9.0), rated=5.0).turn)


def test_a_turn_beyond_the_table_is_looked_for() -> None:
    table = _table(Spring(bend=5e-4, reach=30.0), rated=8.0)
    assert table.end == pytest.approx(8.8)
    # F/100 - F^2/2000 at 8.8 N comes again at 11.2 N.
    assert table.turn == pytest.approx(11.2, rel=0.03)


def test_a_signal_that_dips_first_gives_bounds_that_hold_both_forces() -> None:
    table = _table(Spring(dip=0.02))
    force = np.linspace(0.05, 5.0, 100)
    ratio = force / 100 - 0.02 * force * np.exp(-force)
    found = table.read(ratio)
    assert np.any(np.diff(ratio) < 0)
    assert np.all((found.lower <= force + 1e-9) & (force <= found.upper + 1e-9))


@pytest.mark.parametrize("forward", [Spring(), Spring(dip=0.02), Spring(bend=5e-4)])
def test_tables_grow_and_keep_their_order(forward: Spring) -> None:
    table = _table(forward, rated=12.0, spread=0.05)
    assert np.all(np.diff(table.ratio) > 0)
    for column in (table.force, table.lower, table.upper):
        assert np.all(np.diff(column) >= 0)
    assert np.all((table.lower <= table.force) & (table.force <= table.upper))


def test_a_table_ends_where_draws_end_and_counts_those_that_do_not_reach_as_the_worse() -> None:
    # Draws end between 8.2 and 18 N.
    table = _table(Spring(reach=12.0), rated=20.0, spread=0.2)
    assert table.end == pytest.approx(table.looked)
    assert 8.0 < table.end < 9.0
    whole = _table(Spring(reach=100.0), rated=20.0, spread=0.2)
    last = table.ratio[-1]
    assert table.read(last).upper >= whole.read(last).upper - 1e-6


def test_a_reading_almost_without_noise_has_a_table_whose_rows_integers_tell_apart() -> None:
    draws = replace(_draws(Spring(), np.full(200, 1e6)), noise=np.full(200, 1e-24))
    table = table_of("spring", "specimen", [draws], Gripper(), 5.0)
    assert np.all(np.diff(np.round(table.ratio * 1e9)) > 0)
    assert table.read(0.03).force == pytest.approx(3.0, rel=1e-4)


def test_a_noise_that_drowns_the_signal_is_refused_with_both() -> None:
    draws = replace(_draws(Spring(), np.full(200, 1e6)), noise=np.full(200, 1e-11))
    with pytest.raises(InputError, match=r"up to 5.5 N it rises by 55000 ppm .*, and by .* ppm through the noise of 1e\+04 fF"):
        table_of("spring", "specimen", [draws], Gripper(), 5.0)


# --- of a posterior -----------------------------------------------------------------------------------------------------


def _exact(posterior: Posterior) -> Posterior:
    keep = [i for i, p in enumerate(posterior.parameters) if not p.parameter.endswith("discrepancy")]
    return replace(posterior, parameters=tuple(posterior.parameters[i] for i in keep), draws=posterior.draws[:, :, keep])


def _made(posterior: Posterior, forward: Spring | ClosedForm | None = None, seed: int = 1, **asked: Any) -> GripperTables:
    return invert(posterior, forward or ClosedForm(), Gripper(n_draw=200, **asked), seed=seed)


def test_every_specimen_the_next_one_and_a_design_have_a_table(make_posterior: MakePosterior) -> None:
    made = _made(make_posterior(), padding=3e-3)
    assert [t.sensor for t in made.tables] == ["specimen", "specimen", "next", "design"]
    assert [t.padding_thickness for t in made.tables][3] == pytest.approx(3e-3)
    plain = _made(make_posterior())
    assert [t.name for t in plain.tables] == ["sensor 1", "sensor 2", "next specimen"]
    np.testing.assert_array_equal(plain.tables[0].force, made.tables[0].force)


def test_bounds_hold_the_force_of_nine_in_ten_of_their_own_sensors(make_posterior: MakePosterior) -> None:
    posterior, rng, gripper = _exact(make_posterior()), np.random.default_rng(3), Gripper(parasitic=(2e-12, 0.5e-12))
    values = thin_draws(posterior, 900, rng)
    forward = ERRORLESS
    draws = next_sensor(posterior, forward, values, posterior.parameters, posterior.table.lots, gripper, rng)
    table = table_of("next", "next", [draws], gripper, 1.5)
    force = np.array([0.02, 0.3, 0.8, 1.4])
    p = predict_design(forward, draws.design, force)
    tare = p.rest_capacitance + draws.parasitic
    read = p.rest_capacitance[:, None] * (1 + p.change) + draws.parasitic[:, None]
    noisy_tare = tare + draws.noise / 8 * rng.standard_normal(tare.size)
    found = table.force_at(read + draws.noise[:, None] * rng.standard_normal(read.shape), noisy_tare[:, None])
    inside = np.mean((found.lower <= force) & (force <= found.upper), axis=0)
    np.testing.assert_allclose(inside, 0.9, atol=0.03)


def test_the_next_specimen_is_known_less_well_than_a_measured_one(
    make_posterior: MakePosterior, make_lot: MakePosterior
) -> None:
    one, _, following = _made(_exact(make_posterior()), ERRORLESS, noise=1e-15).tables
    at = 0.5 * following.largest
    assert np.interp(at, following.force, following.sigma) > 1.5 * np.interp(at, one.force, one.sigma)
    assert "taken to share" in " ".join(following.conditions)
    alike, differing = (_made(_exact(make_lot(spread=Fixed(s))), ERRORLESS, noise=1e-15).tables[2] for s in (1e-3, 0.3))
    assert differing.sigma[60] > 2 * alike.sigma[60]
    assert "drawn from the lot" in " ".join(differing.conditions)


def test_the_next_specimen_says_what_measuring_its_padding_brings_where_that_is_much(make_posterior: MakePosterior) -> None:
    def with_padding(prior: Prior) -> Posterior:
        posterior = make_posterior()
        known = [replace(p, prior=prior) if p.parameter == "padding_thickness" else p for p in posterior.parameters]
        return replace(posterior, parameters=tuple(known))

    *_, following, design = _made(with_padding(Normal(1.1e-3, 2e-4)), ERRORLESS, padding=1.1e-3).tables
    said = next(c for c in following.conditions if "--padding" in c)
    force, before, after = (float(x) for x in re.findall(r"([\d.]+) N\b", said))
    assert f"{np.interp(force, following.force, following.sigma):.2g}" == f"{before:.2g}"
    assert after == pytest.approx(np.interp(force, design.force, design.sigma), rel=0.05)
    assert after < 0.9 * before
    *_, sure = _made(with_padding(Fixed(1.1e-3)), ERRORLESS).tables
    assert "--padding" not in " ".join(sure.conditions)


def test_the_next_of_specimens_on_different_paddings_is_amber_and_a_design_is_not(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    rows = dict(posterior.diagnostics.parameters)
    thin = rows["padding_thickness[sensor 2]"]
    rows["padding_thickness[sensor 2]"] = replace(thin, mean=0.5e-3, median=0.5e-3)
    made = _made(replace(posterior, diagnostics=replace(posterior.diagnostics, parameters=rows)), padding=1.1e-3)
    gates = [[reason.gate for reason in table.verdict.reasons] for table in made.tables]
    assert ["padding" in of for of in gates] == [False, False, True, False]
    assert "0.5 to 1.1 mm of padding" in next(r.finding for r in made.tables[2].verdict.reasons if r.gate == "padding")


def _unloading(most: float, error: float = 0.0) -> Unloading:
    return Unloading(-most * 4 * SHARES * (1 - SHARES), np.full(SHARES.size, error), 5.0, 2.0)


def test_what_was_measured_of_unloading_goes_with_the_table_of_its_sensor_and_the_widest_with_the_next(
    make_posterior: MakePosterior,
) -> None:
    retreats: Retreats = {"sensor 1": [_unloading(0.2)], "sensor 2": [_unloading(0.4), "it begins in contact"]}
    made = invert(make_posterior(), ClosedForm(), Gripper(padding=3e-3, n_draw=100), retreats=retreats)
    widest = [table.retreat.widest for table in made.tables if table.retreat is not None]
    np.testing.assert_allclose(np.array(widest)[:, 0], [-0.04, -0.08, -0.08, -0.08], atol=1e-9)
    said = [next(c for c in table.conditions if c.startswith("unloading")) for table in made.tables]
    assert "up to 4 % of it less than loading makes it, most so at 50 % of it" in said[0]
    assert "the bounds do not hold that" in said[0]
    assert "measured on sensor 1 and sensor 2" in said[2]
    assert said[3].endswith("other padding may differ")
    silent = invert(make_posterior(), ClosedForm(), Gripper(n_draw=100), retreats={"sensor 1": ["it begins in contact"]})
    assert "by how much it is off is not known (sensor 1: it begins in contact)" in " ".join(silent.tables[0].conditions)


def test_bounds_with_the_band_hold_a_press_that_is_let_go() -> None:
    band = band_of({"one": [_unloading(0.3, 0.01)]}, ["one"])
    assert band is not None
    meant = np.linspace(0.0, 3.0, 31)
    missing = 0.3 * 3.0 / 5.0 * 4 * (meant / 3.0) * (1 - meant / 3.0)
    low, high = band.around(meant, 3.0)
    assert np.all((low <= -missing + 5e-3) & (high >= -missing - 5e-3))
    assert np.all((low <= 0) & (high >= 0))


def test_what_was_not_measured_is_amber_in_its_own_table(make_posterior: MakePosterior) -> None:
    made = _made(make_posterior(), padding=3e-3)
    measured = _made(make_posterior()).verdict
    extra = [[r.gate for r in t.verdict.reasons if r not in measured.reasons] for t in made.tables]
    assert extra == [[], [], [], ["extrapolation"]]
    assert "extrapolation" in [r.gate for r in made.verdict.reasons]
    more = _made(make_posterior(), force=2 * made.tables[0].rated)
    assert all("extrapolation" in [r.gate for r in t.verdict.reasons] for t in more.tables)


def test_no_table_is_advised_that_the_model_does_not_cover(make_posterior: MakePosterior) -> None:
    def action(advised: float) -> str:
        made = invert(make_posterior(), ClosedForm(), Gripper(padding=3e-3, n_draw=100), advised=advised)
        return next(reason.action for reason in made.tables[-1].verdict.reasons if reason.gate == "range")

    assert action(9.0).startswith('Make it for 9 N (--force "9 N")')
    told = re.match(
        r"The model covers such padding up to ([\d.]+) N only, and no table can be made up to 500 N: ", action(500.0)
    )
    assert told is not None
    assert action(float(told[1])).startswith("Make it for")


def test_a_specimen_may_be_called_next(make_posterior: MakePosterior) -> None:
    posterior = make_posterior(n_specimen=1)
    experiment = replace(posterior.experiment, specimens=(replace(posterior.experiment.specimens[0], name="next specimen"),))
    sweeps = tuple(replace(sweep, specimen="next specimen") for sweep in posterior.sweeps)
    infos = tuple(replace(p, key=replace(p.key, specimen="next specimen")) if p.specimen else p for p in posterior.parameters)
    summaries = posterior.diagnostics.parameters
    named = {new.name: summaries[old.name] for old, new in zip(posterior.parameters, infos, strict=True)}
    diagnostics = replace(posterior.diagnostics, parameters=named)
    renamed = replace(posterior, experiment=experiment, sweeps=sweeps, parameters=infos, diagnostics=diagnostics)
    assert [table.name for table in _made(renamed).tables] == ["next specimen", "the next specimen"]


def test_a_range_that_ends_before_what_was_asked_is_amber(make_posterior: MakePosterior) -> None:
    # The spring's draws end at about 0.62 times its reach.
    made = _made(_exact(make_posterior()), Spring(reach=4.0), force=5.0)
    reasons = {r.gate: r.finding for r in made.tables[0].verdict.reasons}
    assert "5 N were asked for, and the table ends at 2.4" in reasons["range"]
    turning = _made(_exact(make_posterior()), Spring(bend=2e-3, reach=20.0), force=2.4)
    assert "reads like a smaller one" in {r.gate: r.finding for r in turning.tables[0].verdict.reasons}["turn"]
    assert "they fold back" in " ".join(turning.tables[0].conditions)


def test_leads_of_many_times_the_sensor_are_amber(make_posterior: MakePosterior) -> None:
    posterior = _exact(make_posterior())
    found = {}
    for leads in (1e-10, 2e-9):
        gripper = Gripper(force=2.0, parasitic=(leads, 1e-12), noise=1e-16)
        found[leads] = {r.gate: r.finding for r in invert(posterior, load_surrogate(), gripper).tables[0].verdict.reasons}
    assert "leads" not in found[1e-10]
    assert "leads of 2000 pF" in found[2e-9]["leads"]


def test_padding_that_the_surrogate_does_not_cover_is_refused_with_its_range(make_posterior: MakePosterior) -> None:
    with pytest.raises(InputError, match=r"does not cover next specimen on 300 mm of padding: .* h_p/R from 0 to 10, got 60"):
        invert(make_posterior(), load_surrogate(), Gripper(padding=0.3, n_draw=100))


def test_a_run_without_capacitance_is_refused(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    sweeps = tuple(replace(s, channels={"force": s.channels["force"]}) for s in posterior.sweeps)
    with pytest.raises(InputError, match="no capacitance was measured in this run"):
        _made(replace(posterior, sweeps=sweeps))


def test_the_models_of_an_average_answer_for_their_own_draws(make_posterior: MakePosterior) -> None:
    posterior = _exact(make_posterior())
    models = [Member(str(bend), posterior, Spring(bend=bend), 0.5) for bend in (0.0, 5e-4)]
    made = invert(posterior, models[0].forward, Gripper(force=5.0, n_draw=200), members=models)
    table = made.tables[0]
    # 5 N read like F/100 by one, and like F/100 - F^2/2000 by the other.
    assert table.read(0.0375).lower < 3.8
    assert table.read(0.0375).upper > 4.9


def test_tables_depend_on_the_seed_alone(make_posterior: MakePosterior) -> None:
    first, again, other = (_made(make_posterior(), seed=s).tables[2] for s in (1, 1, 2))
    np.testing.assert_array_equal(first.upper, again.upper)
    assert not np.array_equal(first.upper, other.upper)


def test_working_points_of_a_spring_are_its_own(make_posterior: MakePosterior) -> None:
    made = _made(_exact(make_posterior()), Spring(), force=5.0, parasitic=(0.0, 0.0))
    for point in made.tables[0].points:
        assert point.stiffness == pytest.approx((1000, 1000, 1000), rel=1e-6)
        assert point.gain == pytest.approx((0.01, 0.01, 0.01), rel=1e-4)
        assert point.depth == pytest.approx(point.force / 1000, rel=2e-3)
        assert point.noise == pytest.approx(made.tables[0].noise / made.tables[0].tare[1] / 0.01, rel=0.05)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"force": 0.0}, "force must be positive, got 0 N"),
        ({"force": float("nan")}, "force must be positive, got nan N"),
        ({"force": float("inf")}, "force must be positive, got inf N"),
        ({"padding": -1e-3}, "padding thickness must not be negative or infinite, got -1 mm"),
        ({"parasitic": (-1e-12, 0.0)}, "parasitic capacitance must not be negative, got -1 pF"),
        ({"parasitic": (1e-12, -1e-13)}, "standard deviation of the parasitic capacitance must not be negative"),
        ({"noise": 0.0}, "noise must be positive, got 0 fF"),
        ({"n_tare": 0}, "n_tare must be at least 1, got 0"),
    ],
)
def test_a_gripper_that_cannot_be_is_refused(asked: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Gripper(**asked)

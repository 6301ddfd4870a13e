"""Specifications whose answer can be counted, and what is said where they cannot be met."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import truncnorm

from calib.checks import Verdict, members_or
from calib.decision.causes import causes, first_order
from calib.decision.choices import PaddingChoice
from calib.decision.conformity import Conformity
from calib.decision.guard_band import Drawing, crossings, guarded, inspected, inwards, risks, step_of
from calib.decision.performance import ElectrodeGroup, pressed
from calib.decision.record import recommendation_from_json, recommendation_to_json
from calib.decision.requirement import Requirement
from calib.decision.sensors import sensors_of
from calib.decision.specified import conform, recommend_for
from calib.errors import InputError
from calib.experiment import CandidateMaterial, Limit, Specification, Tolerance
from calib.priors import LogNormal, Uniform
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm
from models.response import Response
from models.sensor import Design, FloatArray
from models.surrogate import FAMILIES, load_surrogate

MakePosterior = Callable[..., Posterior]


@dataclass(frozen=True)
class Spring:
    """F = E d / 1 km: 0.62 MPa give way by 1.6 mm per N; C changes by 1 % per N and by 0.1 % for each mm of padding."""

    reach: float = 20.0
    name: str = "spring"

    @property
    def identity(self) -> str:
        return repr(self)

    def max_depth(self, design: Design) -> FloatArray:
        return np.asarray(self.reach / self._stiffness(design))

    def _stiffness(self, design: Design) -> FloatArray:
        return np.asarray(design.draws().sensor.young_modulus, dtype=float) * 1e-3

    def outside(self, design: Design, depth: FloatArray) -> str:
        return "" if np.all(np.max(depth) <= self.max_depth(design)) else "the spring ends here"

    def respond(self, design: Design, depth: FloatArray) -> Response:
        batch = design.draws()
        h = np.asarray(batch.padding.thickness)[:, None]
        d = np.maximum(np.broadcast_to(depth, (h.shape[0], np.shape(depth)[-1])), 0.0)
        force = self._stiffness(batch)[:, None] * d
        c0 = np.broadcast_to(np.asarray(batch.rest_capacitance, dtype=float), h.shape[:1])
        nothing = np.zeros((*d.shape, 0))
        return Response(d, force, d, c0[:, None] * (1 + 0.01 * force * (1 + 100 * h)), c0, nothing, nothing)


@pytest.fixture(scope="module")
def posterior(make_posterior: MakePosterior) -> Posterior:
    """Without discrepancy, so that what a draw does is known."""
    whole = make_posterior(widen=5.0)
    keep = [i for i, p in enumerate(whole.parameters) if not p.parameter.endswith("discrepancy")]
    return replace(whole, parameters=tuple(whole.parameters[i] for i in keep), draws=whole.draws[:, :, keep])


_BASE = Specification((Limit("stroke", "at_most", 1.0),), (2.0,), lower=1e-3, upper=5e-3, steps=9, n_draw=900)


def _conform(posterior: Posterior, *limits: Limit, forward: Spring | None = None, **fields: Any) -> Conformity:
    spec = replace(_BASE, limits=limits, **fields)
    return conform(posterior, forward or Spring(), spec, seed=1, verdict=Verdict())


def _moduli(posterior: Posterior) -> FloatArray:
    k = [p.name for p in posterior.parameters].index("young_modulus")
    return posterior.draws[..., k].ravel()


# --- probability --------------------------------------------------------------------------------------------------------


def test_probability_is_the_share_of_sensors_that_conform(posterior: Posterior) -> None:
    # 2 N / (E / 1 km) at most the limit: as many as have at least that modulus.
    least = float(np.quantile(_moduli(posterior), 0.3))
    c = _conform(posterior, Limit("stroke", "at_most", 2e3 / least))
    np.testing.assert_allclose(c.best.probability, 0.7, atol=0.03)
    assert c.best.error[0] == pytest.approx(np.sqrt(0.7 * 0.3 / 900), rel=0.1)
    assert not c.met
    assert c.causes[0].name == "Young's modulus"
    assert c.causes[0].share > 0.9


def test_all_limits_must_hold_at_every_load_and_under_every_ball(posterior: Posterior) -> None:
    median = float(np.median(_moduli(posterior)))
    at_two, at_one = Limit("stroke", "at_most", 2e3 / median), Limit("stroke", "at_most", 2e3 / median, at=1.0)
    assert _conform(posterior, at_two, force=(1.0, 2.0), ball=(4e-3, 5e-3)).best.best_probability == pytest.approx(
        0.5, abs=0.04
    )
    assert _conform(posterior, at_one, force=(1.0, 2.0)).always


def test_a_load_in_use_is_part_of_the_probability(posterior: Posterior) -> None:
    # 1 % per N, and 0.1 of that for each mm: at 5 mm at least 2.25 % from 1.5 N on, of loads from 1 to 2 N.
    c = _conform(posterior, Limit("signal", "at_least", 0.0225), force=Uniform(1.0, 2.0))
    assert c.best.best == pytest.approx(5e-3)
    assert c.best.best_probability == pytest.approx(0.5, abs=0.01)
    assert c.causes[0].name == "load"


def test_tolerance_of_pads_counts_for_nominal_thicknesses_and_not_for_measured_ones(posterior: Posterior) -> None:
    # Half of the pads made to 3 mm are at least 3 mm: sensor thicknesses differ by far less.
    height = 3e-3 + 0.73e-3
    c = _conform(posterior, Limit("height", "at_most", height), padding_tolerance=Tolerance("uniform", 0.8e-3), steps=41)
    at = {name: np.interp(3.4e-3, c.thickness, getattr(c.best, name)) for name in ("probability", "exact")}
    assert at["probability"] == pytest.approx(0.25, abs=0.04)
    assert at["exact"] < 0.01
    assert np.interp(2.6e-3, c.thickness, c.best.probability) == pytest.approx(0.75, abs=0.04)
    assert c.causes[0].name == "padding tolerance"


def test_what_is_advised_is_what_conforms_and_not_the_largest_signal(posterior: Posterior) -> None:
    # The signal grows with the padding, whose height is limited.
    spec = replace(_BASE, limits=(Limit("height", "at_most", 3.5e-3),))
    found = recommend_for(posterior, Spring(), spec, seed=1, verdict=Verdict())
    assert found.conformity is not None
    assert found.best > 4.5e-3
    assert found.advised_in_words == f"{1e3 * found.conformity.best.best:.2f} mm" != found.best_in_words
    assert replace(found, conformity=None).advised_in_words.startswith("5")


def test_no_pad_is_made_thinner_than_nothing(posterior: Posterior) -> None:
    c = _conform(
        posterior, Limit("height", "at_most", 9e-3), padding_tolerance=Tolerance("uniform", 0.8e-3), lower=0.0, steps=11
    )
    assert c.best.covered.all()
    made = Tolerance("uniform", 0.8e-3).pads(0.5e-3, np.linspace(-5, 5, 1001))
    assert (made[0], made[-1]) == pytest.approx((0.0, 1.3e-3), abs=1e-8)
    cut = Tolerance("normal", 0.8e-3).pads(0.5e-3, ndtri((np.arange(100_000) + 0.5) / 100_000))
    assert np.all(cut > 0)
    # Another implementation: what scipy has of it.
    assert np.mean(cut) == pytest.approx(truncnorm(-0.5 / 0.8, np.inf, 0.5e-3, 0.8e-3).mean(), rel=1e-4)


def test_thin_pads_are_judged_and_risks_are_those_of_all_that_are_made(posterior: Posterior) -> None:
    # Pads of up to 1 mm conform, as sensors are 0.74 mm thick, and such a tolerance makes many thinner than three sd of it.
    limit = Limit("height", "at_most", 1.77e-3)
    given = Tolerance("normal", 0.4e-3)
    c = _conform(posterior, limit, padding_tolerance=given, gauge=1e-5, lower=0.05e-3, upper=3e-3, steps=60, probability=0.9)
    assert c.met
    assert c.best.covered.all()
    d = c.drawing
    assert d is not None
    assert d.accepted is not None
    assert d.accepts_nominal
    # Each pad that is made is accepted or not, and conforms or not.
    made = given.pads(d.nominal, np.random.default_rng(1).standard_normal(400_000))
    taken = (made >= d.accepted[0]) & (made <= d.accepted[1])
    rejected_good = np.mean(~taken & (made < 1.03e-3))
    assert d.accepted_share == pytest.approx(np.mean(taken), abs=0.01)
    assert d.producers_risk == pytest.approx(rejected_good, abs=0.01)
    # Without a tolerance the drawing is the same: it says which pads conform, however they are made.
    alone = _conform(posterior, limit, gauge=1e-5, lower=0.05e-3, upper=3e-3, steps=60, probability=0.9).drawing
    assert alone is not None
    assert alone.accepted == pytest.approx(d.accepted, abs=0.02e-3)
    # Where no nominal conforms, it is told that exact pads do.
    loose = _conform(posterior, limit, padding_tolerance=Tolerance("normal", 3e-3), lower=0.2e-3, upper=3e-3, steps=57)
    assert not loose.met
    assert re.search(r"Pads of exactly 0\.20 to [0-9.]+ mm would conform: .* \(tolerance in \[padding\]\)", loose.in_words)


def test_a_tolerance_at_no_padding_never_accepts_less_than_nothing(posterior: Posterior) -> None:
    assert inspected((0.0, 0.0), 0.01e-3, 1.0)[0] is None
    limit = Limit("height", "at_most", 0.79e-3)
    c = _conform(posterior, limit, lower=0.0, upper=1.5e-3, steps=181, gauge=0.05e-3, probability=0.5)
    assert c.drawing is not None
    assert c.drawing.accepted is None
    assert "in a range of -" not in c.in_words
    assert "specification" in {reason.gate for reason in c.verdict.reasons}


@pytest.mark.parametrize("gauge", [0.0, 0.02e-3])
def test_what_is_advised_is_in_the_middle_of_what_its_drawing_accepts(posterior: Posterior, gauge: float) -> None:
    # Everything conforms: the range that was asked for is what there is to be in the middle of.
    tolerance = Tolerance("normal", 0.02e-3)
    c = _conform(posterior, Limit("stroke", "at_most", 9e-3), padding_tolerance=tolerance, gauge=gauge, upper=1.2e-3, steps=181)
    assert c.always
    assert c.best.best == pytest.approx(1.1e-3)
    assert c.drawing is not None
    assert c.drawing.limits is not None
    assert c.drawing.limits[0] == pytest.approx(1.1e-3)
    assert c.drawing.accepted_share > 0.9


def test_a_drawing_that_accepts_few_of_the_pads_that_are_made_is_amber(posterior: Posterior) -> None:
    tolerance = Tolerance("normal", 0.5e-3)
    c = _conform(posterior, Limit("stroke", "at_most", 9e-3), padding_tolerance=tolerance, upper=1.2e-3, steps=181)
    assert c.drawing is not None
    assert c.drawing.accepted_share < 0.3
    (told,) = (reason.finding for reason in c.verdict.reasons if reason.gate == "specification")
    assert told.startswith("of pads made to 1.10 mm the drawing accepts 1")


@pytest.mark.parametrize(
    ("tolerance", "beyond"),
    [
        (Tolerance("uniform", 0.4e-3), True),
        (Tolerance("normal", 0.2e-3), True),
        (Tolerance("normal", 0.02e-3), False),
    ],
)
def test_sensors_made_much_thicker_or_thinner_than_those_measured_are_extrapolated_to(
    posterior: Posterior, tolerance: Tolerance, beyond: bool
) -> None:
    c = _conform(posterior, Limit("stroke", "at_most", 9e-3), sensor_tolerance=tolerance, upper=1.2e-3, steps=11)
    said = [reason.finding for reason in c.verdict.reasons if "the advice is for sensors of" in reason.finding]
    assert len(said) == beyond


def test_a_load_that_no_sensor_carries_on_any_padding_is_refused_with_what_is_carried(posterior: Posterior) -> None:
    assert _conform(posterior, Limit("height", "at_most", 9e-3), forward=Spring(reach=2.1)).always
    with pytest.raises(InputError, match=r"no sensor carries 2 N on any padding.*Ask for a load below 1\.9 N"):
        _conform(posterior, Limit("height", "at_most", 9e-3), forward=Spring(reach=1.9))


class Thin(Spring):
    """A spring that bottoms out just below 2 N on less than 2 mm of padding."""

    def max_depth(self, design: Design) -> FloatArray:
        reach = np.where(np.asarray(design.draws().padding.thickness) < 2e-3, 1.9, 20.0)
        return np.asarray(reach / self._stiffness(design))


def test_padding_on_which_the_load_is_just_not_carried_is_no_way_out_of_a_signal_that_is_too_small(
    posterior: Posterior,
) -> None:
    c = _conform(posterior, Limit("signal", "at_least", 0.05), forward=Thin())
    assert not c.met
    assert c.best.best == pytest.approx(5e-3)
    assert c.best.shortfall[-1] == pytest.approx(1 - 0.03 / 0.05, rel=1e-3)
    assert c.best.shortfall[0] > 1
    # Nor out of one that is missed by whatever factor.
    hopeless = _conform(posterior, Limit("signal", "at_least", 0.9), Limit("stroke", "at_most", 1e-6), forward=Thin())
    assert hopeless.best.not_carried[hopeless.at_best] == 0
    assert c.best.not_carried.tolist() == [1, 1, *[0] * 7]


@dataclass(frozen=True)
class Weak(Spring):
    """A spring that bottoms out just below 2 N where it is softer than `least`."""

    least: float = 0.0

    def max_depth(self, design: Design) -> FloatArray:
        soft = np.asarray(design.draws().sensor.young_modulus) < self.least
        return np.asarray(np.where(soft, 1.9, 20.0) / self._stiffness(design))


def test_draws_that_do_not_carry_the_load_are_failures_and_said_to_be(posterior: Posterior) -> None:
    weak = Weak(least=float(np.quantile(_moduli(posterior), 0.3)))
    c = _conform(posterior, Limit("height", "at_most", 9e-3), forward=weak)
    np.testing.assert_allclose(c.best.not_carried, 0.3, atol=0.03)
    assert c.best.best_probability == pytest.approx(0.7, abs=0.03)
    assert "do not carry the load within what the model covers" in c.in_words
    assert "No change of limits meets it" in c.in_words
    assert [reason.gate for reason in c.verdict.reasons if reason.gate != "extrapolation"] == ["specification"]


@pytest.mark.parametrize(
    ("idle", "binds"),
    [
        (Limit("stroke", "at_most", 1.9), Limit("stroke", "at_most", 1.9e-2)),
        (Limit("signal", "at_least", 2e-5), Limit("signal", "at_least", 1e-3)),
        (Limit("height", "at_most", 5.0), Limit("height", "at_most", 5e-2)),
    ],
)
def test_a_limit_that_nothing_comes_near_is_amber_where_another_binds(posterior: Posterior, idle: Limit, binds: Limit) -> None:
    other = Limit("signal", "at_most", 0.025) if idle.quantity != "signal" else Limit("height", "at_most", 4e-3)
    found = {r.gate: r.finding for r in _conform(posterior, other, idle).verdict.reasons}
    assert idle.in_words in found["limits"]
    assert "cannot bind" in found["limits"]
    assert "limits" not in {r.gate for r in _conform(posterior, other, binds).verdict.reasons}


def test_a_resolution_that_is_to_be_coarse_is_refused() -> None:
    with pytest.raises(InputError, match=r"force_resolution at_least.*Write at_most"):
        replace(_BASE, limits=(Limit("force_resolution", "at_least", 0.02),))


# --- what stands in the way ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wanted", [0.8, 0.95])
def test_what_is_nearest_is_met_with_just_the_probability_that_was_asked_for(posterior: Posterior, wanted: float) -> None:
    median = float(np.median(_moduli(posterior)))
    limits = (Limit("stroke", "at_most", 2e3 / median), Limit("signal", "at_least", 0.02))
    c = _conform(posterior, *limits, probability=wanted)
    assert not c.met
    (needed,) = c.needed
    assert "The specification is not met" in c.in_words
    assert f"It would be met with {100 * wanted:g} %, if asked for stroke at most" in c.in_words
    assert c.verdict.colour == "amber"
    again = _conform(posterior, replace(limits[0], value=needed.value * (1 + 1e-9)), limits[1], probability=wanted)
    assert again.met
    assert again.best.best_probability == pytest.approx(wanted, abs=2 / 900)


@pytest.mark.parametrize("n_draw", [200, 900])
def test_a_limit_that_would_be_met_is_told_with_what_the_draws_leave_open(posterior: Posterior, n_draw: int) -> None:
    moduli = _moduli(posterior)
    c = _conform(posterior, Limit("stroke", "at_most", 2e3 / float(np.median(moduli))), n_draw=n_draw)
    (needed,) = c.needed
    exact = 2e3 / float(np.quantile(moduli, 0.05))
    assert 0 < needed.error < 0.1 * exact
    assert abs(needed.value - exact) < 3 * needed.error
    assert f"mm (± {needed.error * 1e3:.1g} mm) instead of" in c.in_words
    assert c.to_plain()["needed"][0]["error"] == needed.error


def test_where_no_limit_alone_would_do_all_together_are_named(posterior: Posterior) -> None:
    c = _conform(posterior, Limit("signal", "at_least", 0.035), Limit("stroke", "at_most", 3e-3))
    assert c.needed == ()
    assert f"on {c.best.best * 1e3:.2f} mm of padding all of them together would have to give way by a factor of" in c.in_words
    for share, met in ((c.all_needed * (1 + 1e-9), True), (0.99 * c.all_needed, False)):
        eased = [Limit("signal", "at_least", 0.035 * (1 - share)), Limit("stroke", "at_most", 3e-3 / (1 - share))]
        assert _conform(posterior, *eased).met is met


def test_a_specification_that_always_holds_says_so_and_what_more_could_be_asked_for(posterior: Posterior) -> None:
    c = _conform(posterior, Limit("height", "at_most", 9e-3))
    assert c.always
    assert "So does every thickness from 1.00 to 5.00 mm: the specification does not choose" in c.in_words
    assert "It would still hold with one of: height at most" in c.in_words
    assert {reason.gate for reason in c.verdict.reasons} <= {"extrapolation"}  # of thicker padding than was measured


def test_regret_is_what_another_padding_would_have_saved(posterior: Posterior) -> None:
    # Signal grows with the padding: at 5 mm 3 %, at 1 mm 2.2 %.
    c = _conform(posterior, Limit("signal", "at_least", 0.03 - 1e-7))
    assert c.best.best == pytest.approx(5e-3)
    assert c.best.regret[-1] == 0
    assert c.best.regret[0] == pytest.approx(1 - 2.2 / 3, rel=1e-3)
    assert (c.best.avoidable[0], c.best.avoidable[-1]) == (1, 0)


def test_the_front_has_no_point_that_another_beats_in_both(posterior: Posterior) -> None:
    c = _conform(posterior, Limit("signal", "at_least", 0.01))
    signals = [c.built[i].signal[2, k] for i, k in c.front]
    strokes = [c.built[i].stroke[2, k] for i, k in c.front]
    assert signals == sorted(signals)
    assert strokes == sorted(strokes)
    assert max(signals) == pytest.approx(np.nanmax(c.best.signal[2]))


# --- what does not fit a run --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"dielectric_tolerance": Tolerance("normal", 1e-3)}, "dielectrics would be thinner than nothing"),
        ({"electrode_tolerance": Tolerance("uniform", 1e-4)}, r"electrodes would be wider than the disc \(10 mm\)"),
        ({"sensor_tolerance": Tolerance("normal", 1e-3)}, "sensors would be thinner than nothing"),
        ({"electrode_radii": (12e-3,)}, "electrodes would be wider than the disc"),
    ],
)
def test_tolerances_that_make_what_cannot_be_are_refused(posterior: Posterior, fields: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        _conform(posterior, Limit("stroke", "at_most", 1e-2), **fields)


def test_a_spread_that_the_run_has_inferred_is_not_counted_twice(make_lot: MakePosterior) -> None:
    with pytest.raises(InputError, match="the run has inferred how the young_modulus of a lot differs"):
        _conform(make_lot(), Limit("stroke", "at_most", 1e-2), modulus_spread=0.05)


def test_too_few_draws_are_no_answer(posterior: Posterior) -> None:
    one = replace(posterior, draws=posterior.draws[:1, :1], log_prob=posterior.log_prob[:1, :1])
    with pytest.raises(InputError, match="the posterior has 1 draws, too few"):
        _conform(one, Limit("stroke", "at_most", 1e-2))


_MATERIALS = (CandidateMaterial("foam", 0.4e6, 0.3), CandidateMaterial("soft", LogNormal(0.4e6, 1.05)))


def test_materials_that_no_surrogate_serves_are_left_out_with_the_reason(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    slides = replace(posterior, experiment=replace(posterior.experiment, base="slippery"))
    spec = replace(_BASE, limits=(Limit("signal", "at_least", 0.01),), materials=_MATERIALS, n_draw=60, steps=5)
    c = conform(slides, load_surrogate(None, FAMILIES["slippery"]), spec, seed=1, verdict=Verdict())
    assert {b.name for b in c.built if not b.left_out} == {"as measured", "padding of soft"}
    assert c.unserved_in_words[0].startswith("padding of foam: no surrogate serves it: the slippery surrogate is trained for")
    stroke = {b.name: b.stroke[2, -1] for b in c.built}
    assert stroke["padding of soft"] > 1.1 * stroke["as measured"]


def test_a_foam_of_the_same_modulus_gives_way_more_and_signals_less(make_posterior: MakePosterior) -> None:
    spec = replace(_BASE, limits=(Limit("signal", "at_least", 0.01),), materials=_MATERIALS, n_draw=60, steps=5)
    c = conform(make_posterior(), load_surrogate(), spec, seed=1, verdict=Verdict())
    assert not c.unserved_in_words
    built = {b.name: b for b in c.built}
    foam, soft = built["padding of foam"], built["padding of soft"]
    covered = np.isfinite(foam.stroke[2]) & np.isfinite(soft.stroke[2])
    assert covered.any()
    assert np.all(foam.stroke[2][covered] > soft.stroke[2][covered])
    assert np.all(foam.signal[2][covered] < soft.signal[2][covered])


def test_balls_beyond_the_models_range_are_refused_with_it(make_posterior: MakePosterior) -> None:
    spec = replace(_BASE, limits=(Limit("signal", "at_least", 0.01),), ball=(0.1,), n_draw=60, steps=5)
    with pytest.raises(InputError, match="as measured, padding from 1 to 5 mm: the surrogate covers none of these thicknesses"):
        conform(make_posterior(), load_surrogate(), spec, seed=1, verdict=Verdict())


@pytest.mark.parametrize(
    ("ball", "told"),
    [
        ({"ball": Uniform(100.0, 300.0), "by_curvature": True}, "balls of 3.45 and 9.09 mm radius (measured with 5 mm)"),
        ({"ball": Uniform(4.8e-3, 8e-3)}, "a ball of 7.84 mm radius (measured with 5 mm)"),
        ({"ball": (3e-3, 5e-3, 9e-3)}, "balls of 3 and 9 mm radius (measured with 5 mm)"),
        ({"ball": Uniform(190.0, 210.0), "by_curvature": True}, ""),
        ({"ball": (4.8e-3, 5.2e-3)}, ""),
    ],
)
def test_balls_are_held_against_those_measured_by_their_ends(
    make_posterior: MakePosterior, ball: dict[str, Any], told: str
) -> None:
    c = _conform(make_posterior(), Limit("signal", "at_least", 0.01), lower=1e-3, upper=1.2e-3, force=(1.0,), **ball)
    found = [reason.finding for reason in c.verdict.reasons if "mm radius" in reason.finding]
    assert [told in finding for finding in found] == ([True] if told else [])
    smallest, largest = c.specification.outermost_balls
    assert f"ball radius {smallest * 1e3:.3g} to {largest * 1e3:.3g} mm, pressed without friction" in c.conditions


@pytest.mark.parametrize("upper", [9.0, 4.0])
def test_a_range_far_beyond_the_model_is_refused_with_how_far_it_goes(make_posterior: MakePosterior, upper: float) -> None:
    spec = replace(_BASE, limits=(Limit("signal", "at_least", 0.01),), lower=0.5e-3, upper=upper, n_draw=60)
    refused = r"goes beyond what the surrogate covers for this sensor, which is up to ([0-9.]+) mm"
    with pytest.raises(InputError, match=refused) as raised:
        conform(make_posterior(), load_surrogate(), spec, seed=1, verdict=Verdict())
    wanted = Requirement(1.0, 0.5e-3, upper, n_draw=60)
    with pytest.raises(InputError, match=refused):
        recommend_for(make_posterior(), load_surrogate(), wanted, seed=1)
    found = re.search(refused, str(raised.value))
    assert found is not None
    within = replace(spec, upper=float(found[1]) * 1e-3, steps=21)
    assert conform(make_posterior(), load_surrogate(), within, seed=1, verdict=Verdict()).best.covered.all()


def test_thicknesses_that_the_model_does_not_cover_are_named_and_none_beyond_them_is_judged(
    make_posterior: MakePosterior,
) -> None:
    spec = replace(_BASE, limits=(Limit("signal", "at_least", 0.01),), lower=0.5e-3, upper=90e-3, steps=91, n_draw=60)
    c = conform(make_posterior(), load_surrogate(), spec, seed=1, verdict=Verdict())
    covered = np.flatnonzero(c.best.covered)
    assert covered.tolist() == list(range(covered.size))
    assert 0 < covered.size < 45
    assert "Not all thicknesses that were asked for are judged: the surrogate covers no padding of " in c.in_words
    assert c.to_plain()["built"][0]["not_judged"] == c.best.not_judged


def test_a_tolerance_by_which_no_nominal_thickness_can_be_judged_is_named(make_posterior: MakePosterior) -> None:
    limits = (Limit("signal", "at_least", 0.01),)
    spec = replace(_BASE, limits=limits, padding_tolerance=Tolerance("normal", 60e-3), n_draw=60)
    with pytest.raises(InputError, match=r"of 60 mm \(tolerance in \[padding\]\): too many .* Give a smaller tolerance in"):
        conform(make_posterior(), load_surrogate(), spec, seed=1, verdict=Verdict())


# --- the model between knots --------------------------------------------------------------------------------------------


def test_what_lies_between_knots_is_what_the_model_says_there(make_posterior: MakePosterior) -> None:
    spec = replace(_BASE, force=(1.0, 5.0, 10.0), limits=(Limit("dielectric_strain", "at_most", 0.4),), lower=0.0, upper=9e-3)
    rng = np.random.default_rng(1)
    (part,) = sensors_of(members_or((), make_posterior(), load_surrogate()), "complete", 40, None, rng, 1).parts
    group = pressed(part, spec, [PaddingChoice()], {})
    assert isinstance(group, ElectrodeGroup)
    everyone = np.ones(40, dtype=bool)
    for thickness in np.random.default_rng(2).uniform(0, 9e-3, 25):
        found, exact = group.tables[0].at(np.full(40, thickness)), group.tables[0].ask(np.full(40, thickness), everyone)
        np.testing.assert_array_equal(np.isfinite(found[..., 0]), np.isfinite(exact[..., 0]))
        for quantity in (0, 1, 3, 5, 6):  # depth, compliance, thinning, change and slope
            np.testing.assert_allclose(found[..., quantity], exact[..., quantity], rtol=5e-4, atol=1e-12)


def test_an_electrode_outside_the_models_range_is_left_out_and_takes_no_other_with_it(make_posterior: MakePosterior) -> None:
    spec = replace(_BASE, limits=(Limit("stroke", "at_most", 9e-3),), n_draw=60, steps=5, electrode_radii=(3e-3, 10e-3))
    c = conform(make_posterior(), load_surrogate(), spec, seed=1, verdict=Verdict())
    assert [(b.name, b.best_probability == 1) for b in c.built] == [("electrode 10 mm", True), ("electrode 3 mm", False)]
    assert c.unserved_in_words[0].endswith("for 95 % of the draws: the surrogate covers a_e/a from 0.5 to 1, got 0.3")


def test_electrodes_that_share_their_mechanics_have_the_signal_of_each_alone(make_posterior: MakePosterior) -> None:
    spec = replace(_BASE, limits=(Limit("signal", "at_least", 0.01),), n_draw=60, steps=5, electrode_radii=(8e-3, 10e-3))
    both = conform(make_posterior(), load_surrogate(), spec, seed=1, verdict=Verdict())
    for radius in spec.electrode_radii:
        (alone,) = conform(
            make_posterior(), load_surrogate(), replace(spec, electrode_radii=(radius,)), seed=1, verdict=Verdict()
        ).built
        (shared,) = (b for b in both.built if b.name == alone.name)
        np.testing.assert_allclose(shared.signal, alone.signal, rtol=1e-9)
        np.testing.assert_allclose(shared.stroke, alone.stroke, rtol=1e-9)


# --- guard bands --------------------------------------------------------------------------------------------------------


def test_risks_are_those_of_pads_made_measured_and_sorted_one_by_one() -> None:
    # Another implementation: a million pads, each read once.
    rng = np.random.default_rng(1)
    u, sd, tolerance = 0.04, 0.12, (-0.2, 0.2)
    true = rng.normal(0, sd, 1_000_000)
    read = true + rng.normal(0, u, true.size)
    layers = np.linspace(-4, 4, 20_001) * sd
    weight = np.exp(-0.5 * (layers / sd) ** 2)
    made = np.interp((np.arange(20_000) + 0.5) / 20_000, np.cumsum(weight) / np.sum(weight), layers)
    for factor in (0.0, 1.0):
        accepted, w = guarded(tolerance, u, factor)
        assert accepted is not None
        assert w == pytest.approx(2 * factor * u)
        found = risks(made, (np.abs(made) <= 0.2).astype(float), accepted, u)
        taken, good = (read >= accepted[0]) & (read <= accepted[1]), np.abs(true) <= 0.2
        assert found.accepted == pytest.approx(np.mean(taken), abs=0.002)
        assert found.consumers == pytest.approx(np.mean(taken & ~good), abs=0.0005)
        assert found.producers == pytest.approx(np.mean(~taken & good), abs=0.002)


def test_guard_bands_that_leave_nothing_are_said_to(posterior: Posterior) -> None:
    height = 0.74e-3 + 3e-3
    limits = (Limit("height", "at_most", height + 0.1e-3), Limit("height", "at_least", height - 0.1e-3))
    coarse, fine = (
        _conform(posterior, *limits, gauge=gauge, steps=121, lower=2.5e-3, upper=3.5e-3, probability=0.5)
        for gauge in (0.2e-3, 0.005e-3)
    )
    assert coarse.drawing is not None
    assert fine.drawing is not None
    assert coarse.drawing.accepted is None
    assert "There is no tolerance for the drawing" in coarse.in_words
    assert "With a drawing of its own" not in coarse.in_words
    assert fine.drawing.accepted is not None
    np.testing.assert_allclose(np.diff(fine.drawing.tolerance), 0.2e-3, atol=0.06e-3)
    np.testing.assert_allclose(np.diff(fine.drawing.tolerance) - np.diff(fine.drawing.accepted), 0.02e-3, rtol=1e-6)


def test_the_tolerance_stands_as_on_a_drawing_and_never_takes_in_more(posterior: Posterior) -> None:
    height = 0.74e-3 + 3e-3
    limits = (Limit("height", "at_most", height + 0.3333e-3), Limit("height", "at_least", height - 0.1111e-3))
    given = Tolerance("uniform", 0.02e-3)
    c = _conform(posterior, *limits, gauge=0.002e-3, padding_tolerance=given, steps=121, lower=2.5e-3, upper=3.5e-3)
    assert c.drawing is not None
    assert c.drawing.accepted is not None
    said = re.search(
        r"^For the drawing: ([0-9.]+) mm \+([0-9.]+)/-([0-9.]+)\. "
        r"That is what to accept: readings from ([0-9.]+) to ([0-9.]+) mm",
        c.in_words,
        re.MULTILINE,
    )
    assert said is not None, c.in_words
    nominal, more, less, low, high = (float(x) for x in said.groups())
    assert (nominal + more, nominal - less) == pytest.approx((high, low))
    assert c.drawing.accepted[0] - 1e-12 <= low * 1e-3 < c.drawing.accepted[0] + 0.01e-3
    assert c.drawing.accepted[1] - 0.01e-3 < high * 1e-3 <= c.drawing.accepted[1] + 1e-12
    # Which tolerance was given, and which is the answer, are told apart, each in a line of its own.
    lines = c.in_words.splitlines()
    (of_making,) = (line for line in lines if line.startswith("What was given is how pads are made, with"))
    assert given.in_words in of_making
    assert not any(given.in_words in line for line in lines if line.startswith("For the drawing"))
    assert max(line.count(". ") for line in lines) <= 1
    # Other nominals that it accepts are as far within it as pads are off.
    others = re.search(r"^The named one is not the only one: .* from ([0-9.]+) to ([0-9.]+) mm", c.in_words, re.MULTILINE)
    assert others is not None, c.in_words
    first, last = (float(x) for x in others.groups())
    assert low + 0.01 < first < nominal < last < high - 0.01


def test_a_drawing_that_only_pads_without_error_are_within_names_no_other_nominal(posterior: Posterior) -> None:
    height = 0.74e-3 + 3e-3
    limits = (Limit("height", "at_most", height + 0.1e-3), Limit("height", "at_least", height - 0.1e-3))
    asked: dict[str, Any] = {"steps": 121, "lower": 2.5e-3, "upper": 3.5e-3, "probability": 0.5, "gauge": 0.002e-3}
    wide = _conform(posterior, *limits, padding_tolerance=Tolerance("uniform", 0.3e-3), **asked)
    exact = _conform(posterior, *limits, **asked)
    assert "the drawing accepts pads" not in wide.in_words
    assert "the drawing accepts pads" in exact.in_words


@pytest.mark.parametrize(
    ("ends", "rounded", "step"),
    [
        ((4.1301e-3, 7.4899e-3), (4.14e-3, 7.48e-3), 0.01e-3),
        ((4.13e-3, 7.48e-3), (4.13e-3, 7.48e-3), 0.01e-3),  # already steps: rounding errors take nothing off
        ((0.0, 0.05001e-3), (0.0, 0.05e-3), 0.001e-3),
        ((3.0001e-3, 3.0008e-3), (3.001e-3, 3.0e-3), 0.001e-3),  # nothing is left
    ],
)
def test_limits_are_rounded_inwards_to_a_step_that_is_read(
    ends: tuple[float, float], rounded: tuple[float, float], step: float
) -> None:
    assert step_of(ends) == step
    assert inwards(ends, step) == pytest.approx(rounded)
    drawing = Drawing(3e-3, ends, ends, 0.0, False, False, *[math.nan] * 4)
    assert (drawing.limits is None) == (rounded[0] >= rounded[1])


def test_ends_of_an_interval_lie_between_the_thicknesses_that_were_tried() -> None:
    grid, p = np.arange(5.0), np.array([0.0, 0.5, 1.0, 0.5, 0.0])
    assert crossings(grid, p, 0.75, 2) == pytest.approx((1.5, 2.5))
    assert crossings(grid, np.array([1.0, 1, 1, np.nan, 0]), 0.75, 1) == (0.0, 2.0)
    assert crossings(grid, p, 0.75, 0) is None


# --- causes -------------------------------------------------------------------------------------------------------------


def test_shares_of_variance_are_those_of_ishigami() -> None:
    # Exact: 0.3139, 0.4424, 0 (Ishigami & Homma 1990, a = 7, b = 0.1).
    x = np.random.default_rng(1).uniform(-np.pi, np.pi, (3, 20_000))
    y = np.sin(x[0]) + 7 * np.sin(x[1]) ** 2 + 0.1 * x[2] ** 4 * np.sin(x[0])
    found = {c.name: c for c in causes({"a": x[0], "b": x[1], "c": x[2]}, y)}
    assert [c.name for c in causes({"a": x[0], "b": x[1], "c": x[2]}, y)][:2] == ["b", "a"]
    for name, exact in (("a", 0.3139), ("b", 0.4424), ("c", 0.0)):
        assert found[name].share == pytest.approx(exact, abs=3 * max(found[name].error, 0.007))
    assert not found["c"].counts


def test_shares_of_a_sum_are_those_of_its_variances() -> None:
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(2, 5_000))
    y = 3 * a + b
    assert first_order(a, y).share == pytest.approx(0.9, abs=0.02)
    assert first_order(b, y).share == pytest.approx(0.1, abs=0.05)
    assert causes({"constant": np.ones(5_000)}, y) == ()


# --- files --------------------------------------------------------------------------------------------------------------


def test_json_round_trip_keeps_a_specification_and_its_answer(posterior: Posterior) -> None:
    spec = replace(
        _BASE,
        limits=(Limit("stroke", "at_most", 3.4e-3, at=2.0), Limit("height", "at_most", 4e-3)),
        force=(1.0, 2.0),
        padding_tolerance=Tolerance("uniform", 1e-4),
        gauge=1e-5,
        materials=(CandidateMaterial("soft", LogNormal(0.4e6, 1.05)),),
    )
    made = recommend_for(posterior, Spring(), spec, seed=1)
    text = recommendation_to_json(made)
    again = recommendation_from_json(text)
    assert recommendation_to_json(again) == text
    assert again.conformity is not None
    assert again.conformity.specification == spec
    plain = json.loads(text)["conformity"]
    assert plain["said"] == again.conformity.in_words
    assert json.loads(text)["verdict"] == again.conformity.verdict.to_plain()
    table = again.conformity.to_dataframe()
    assert len(table) == 2 * 9
    assert {"fails_stroke_at_most_2_N", "fails_height_at_most", "probability", "stroke_95_m"} <= set(table.columns)


def test_a_recommendation_without_a_specification_has_none_in_its_file(posterior: Posterior) -> None:
    text = recommendation_to_json(recommend_for(posterior, ClosedForm(), Requirement(1.5, 0.0, 6e-3, n_draw=60), seed=1))
    assert "conformity" not in json.loads(text)
    assert recommendation_from_json(text).conformity is None

"""Padding recommendations where the right answer is known."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from calib.decision.extrapolation import measured_presses
from calib.decision.padding import recommend
from calib.decision.recommendation import Recommendation
from calib.decision.record import recommendation_from_json, recommendation_to_json
from calib.decision.requirement import Requirement
from calib.decision.words import percent
from calib.errors import InputError
from calib.priors.distributions import Fixed, Normal
from calib.problem.lots import Lot, LotPrior
from calib.problem.next_specimen import as_next_specimen, padding_about_mean
from calib.sampling.posterior import Posterior, thin_draws
from models.analytic import ClosedForm
from models.response import Response
from models.sensor import Design, FloatArray
from models.surrogate import Surrogate, load_surrogate

MakePosterior = Callable[..., Posterior]


@dataclass(frozen=True)
class Hill:
    """F = k d with k = 1000 N/m; the change at force F is F/100 N times a hill of `width` over the padding, with its `top`."""

    top: float = 4e-3
    width: float = 4e-3
    reach: float = 20.0
    name: str = "hill"

    @property
    def identity(self) -> str:
        return repr(self)

    def max_depth(self, design: Design) -> FloatArray:
        h = np.asarray(design.draws().padding.thickness)
        return np.where(h < 1e-3, 2e-3, self.reach * 1e-3)

    def outside(self, design: Design, depth: FloatArray) -> str:
        return "" if np.all(np.max(depth) <= self.max_depth(design)) else "the hill ends here"

    def respond(self, design: Design, depth: FloatArray) -> Response:
        batch = design.draws()
        h = np.asarray(batch.padding.thickness)[:, None]
        d = np.maximum(np.broadcast_to(depth, (h.shape[0], np.shape(depth)[-1])), 0.0)
        force = 1000 * d
        c0 = np.broadcast_to(np.asarray(batch.rest_capacitance, dtype=float), h.shape[:1])
        change = force / 100 * (1 - ((h - self.top) / self.width) ** 2 / 4)
        nothing = np.zeros((*d.shape, 0))
        return Response(d, force, d, c0[:, None] * (1 + change), c0, nothing, nothing)


def _recommend(
    posterior: Posterior, forward: Hill | ClosedForm | Surrogate, *numbers: float, seed: int = 1, n_thickness: int = 37
) -> Recommendation:
    force, lower, upper = numbers
    return recommend(posterior, forward, Requirement(force, lower, upper, n_thickness=n_thickness, n_draw=200), seed=seed)


def _exact(posterior: Posterior) -> Posterior:
    """The same without discrepancy."""
    keep = [i for i, p in enumerate(posterior.parameters) if not p.parameter.endswith("discrepancy")]
    return replace(posterior, parameters=tuple(posterior.parameters[i] for i in keep), draws=posterior.draws[:, :, keep])


def test_a_load_that_no_reading_tells_is_amber(make_posterior: MakePosterior) -> None:
    posterior = _exact(make_posterior())
    told = float(_recommend(posterior, Hill(), 3.0, 1e-3, 9e-3).resolution_at_best[2])
    for share, gates in ((0.5, ["resolution"]), (2.0, [])):
        verdict = _recommend(posterior, Hill(), share * told, 1e-3, 9e-3).verdict
        assert [reason.gate for reason in verdict.reasons if reason.gate == "resolution"] == gates
    assert (
        f"one tells {told:.2g} N from nothing"
        in _recommend(posterior, Hill(), 0.5 * told, 1e-3, 9e-3).verdict.reasons[-1].finding
    )


def test_leads_that_take_of_the_signal_are_a_condition(make_posterior: MakePosterior) -> None:
    posterior = _exact(make_posterior())
    name = "parasitic_capacitance"
    parameters = {k: s for k, s in posterior.diagnostics.parameters.items() if k != name}
    without = replace(posterior, diagnostics=replace(posterior.diagnostics, parameters=parameters))
    for leads, said in ((15e-12, True), (0.0, False)):
        known = replace(without, fixed={**posterior.fixed, name: leads})
        conditions = " ".join(_recommend(known, Hill(), 3.0, 1e-3, 9e-3).conditions)
        assert ("a signal of the sensor alone, C/C0 - 1: with leads of 15 pF" in conditions) == said


def test_recommends_the_top_of_the_hill(make_posterior: MakePosterior) -> None:
    r = _recommend(_exact(make_posterior()), Hill(), 3.0, 1e-3, 9e-3)
    assert r.best == pytest.approx(4e-3, abs=0.12e-3)
    assert r.best_probability == 1
    assert r.optimum == pytest.approx(4e-3, abs=1e-6)
    assert r.change_at_best == pytest.approx(0.03, rel=1e-3)
    assert r.depth_at_best == pytest.approx(3e-3, rel=1e-3)
    assert r.border == ""


def test_interval_is_where_the_loss_stays_below_the_tolerance(make_posterior: MakePosterior) -> None:
    # 1 - x^2 / 4 >= 0.95 for |x| <= sqrt(0.2), x in units of 4 mm.
    r = _recommend(_exact(make_posterior()), Hill(), 3.0, 1e-3, 9e-3, n_thickness=81)
    half = 4e-3 * np.sqrt(0.2)
    assert r.interval == pytest.approx((4e-3 - half, 4e-3 + half), abs=0.11e-3)


def test_resolution_is_noise_over_slope(make_posterior: MakePosterior) -> None:
    posterior = _exact(make_posterior())
    r = _recommend(posterior, Hill(), 3.0, 1e-3, 9e-3)
    c0, noise = 43e-12, 5e-15  # noise, of the posterior; C0 of its first specimen, that of the second is 8 % less
    assert r.resolution_at_best[2] == pytest.approx(noise / (0.01 * c0), rel=0.12)


def test_discrepancy_makes_the_recommendation_less_sure(make_posterior: MakePosterior) -> None:
    sure = _recommend(_exact(make_posterior()), Hill(), 3.0, 1e-3, 9e-3)
    rough = _recommend(make_posterior(widen=30.0), Hill(), 3.0, 1e-3, 9e-3)
    assert np.ptp(rough.optimum) > np.ptp(sure.optimum)
    assert np.nansum(rough.probability == 1) < np.nansum(sure.probability == 1)


def test_a_recommendation_at_the_border_says_so(make_posterior: MakePosterior) -> None:
    r = _recommend(_exact(make_posterior()), Hill(), 3.0, 1e-3, 3e-3)
    assert r.best == 3e-3
    assert "border of the asked range" in r.border
    assert "thicker padding may do better" in r.in_words


def test_a_recommendation_at_the_end_of_the_models_range_says_so(make_posterior: MakePosterior) -> None:
    r = _recommend(_exact(make_posterior()), Hill(top=0.5e-3), 3.0, 0.0, 4e-3, n_thickness=41)
    assert not r.covered[0]
    assert r.coverage[0] == 0
    assert np.isnan(r.change[:, 0]).all()
    assert r.best == pytest.approx(1e-3)
    assert "border of what the model covers" in r.border


def test_where_a_padding_that_is_not_covered_may_be_the_best_the_advice_is_amber_and_says_among_which_it_is_best(
    make_posterior: MakePosterior,
) -> None:
    # The top is well inside what is covered, but the signal has hardly fallen off where that ends.
    r = _recommend(_exact(make_posterior()), Hill(top=1.4e-3), 3.0, 0.0, 4e-3, n_thickness=41)
    assert r.best == pytest.approx(1.4e-3, abs=0.1e-3)
    assert r.border == ""
    (reason,) = (reason for reason in r.verdict.reasons if reason.gate == "coverage")
    assert reason.level == "amber"
    assert "covers 1 to 4 mm of padding and not 0.0 to 0.9 mm" in reason.finding
    assert "below 2 N" in reason.action
    assert "with 1 to 4 mm of padding, all that the model covers between 0 and 4 mm at this force" in r.in_words
    assert r.sureness == "sure among those that the model covers, but see what speaks against it"


def test_paddings_that_are_not_covered_are_named_where_the_signal_has_fallen_off_beside_them(
    make_posterior: MakePosterior,
) -> None:
    r = _recommend(_exact(make_posterior()), Hill(), 3.0, 0.0, 8e-3, n_thickness=41)
    assert not [reason for reason in r.verdict.reasons if reason.gate == "coverage"]
    assert "between 0 and 8 mm (0.0 to 0.8 mm not covered by the model at this force)" in r.in_words


def test_a_request_that_is_not_covered_at_all_names_the_range(make_posterior: MakePosterior) -> None:
    with pytest.raises(
        InputError, match=r"reaches 50 N at no padding from 0 to 9 mm .* up to 2 N at 0 mm and up to 20 N at 9 mm"
    ):
        _recommend(make_posterior(), Hill(), 50.0, 0.0, 9e-3)


def test_gain_over_the_measured_specimens_is_the_ratio_of_changes(make_posterior: MakePosterior) -> None:
    r = _recommend(_exact(make_posterior()), Hill(), 3.0, 1e-3, 9e-3)
    assert r.present_padding == pytest.approx(1.2e-3, abs=0.11e-3)
    assert r.gain[2] == pytest.approx(r.change_at_best[2] / r.present_change[2], rel=0.02)


def test_specimens_take_turns_among_the_draws(make_posterior: MakePosterior) -> None:
    two, one = (_recommend(make_posterior(n_specimen=n), ClosedForm(capacitance_error=0.0), 1.5, 0.0, 6e-3) for n in (2, 1))
    assert np.ptp(two.depth[[0, 4], 0]) > np.ptp(one.depth[[0, 4], 0])


@pytest.mark.parametrize(("forward", "force"), [(Hill(), 3.0), (ClosedForm(), 2.0), (load_surrogate(), 6.0)])
def test_a_fine_grid_of_thicknesses_says_what_a_coarse_one_says(
    make_posterior: MakePosterior, forward: Hill | ClosedForm | Surrogate, force: float
) -> None:
    # The fine one is interpolated, the coarse one is not; at 6 N thin paddings lie outside what the surrogate covers.
    posterior = _exact(make_posterior())
    coarse = _recommend(posterior, forward, force, 0.0, 6e-3, n_thickness=25)
    fine = _recommend(posterior, forward, force, 0.0, 6e-3, n_thickness=241)
    np.testing.assert_allclose(fine.thickness[::10], coarse.thickness, atol=1e-12)
    np.testing.assert_array_equal(fine.coverage[::10], coarse.coverage)
    for name in ("depth", "resolution"):
        np.testing.assert_allclose(getattr(fine, name)[:, ::10], getattr(coarse, name), rtol=2e-4)


def test_a_fine_grid_asks_the_model_at_few_thicknesses(make_posterior: MakePosterior) -> None:
    asked: list[int] = []

    class Counted(Hill):
        def respond(self, design: Design, depth: FloatArray) -> Response:
            asked.append(np.size(design.sensor.thickness))
            return super().respond(design, depth)

    _recommend(_exact(make_posterior()), Counted(), 3.0, 0.0, 9e-3, n_thickness=1001)
    assert sum(asked) < 2 * 200 * (97 + 1001 / 15)


def test_recommendation_depends_on_the_seed_alone(make_posterior: MakePosterior) -> None:
    first, again, other = (_recommend(make_posterior(), ClosedForm(), 1.5, 0.0, 6e-3, seed=s) for s in (1, 1, 2))
    assert recommendation_to_json(first) == recommendation_to_json(again)
    assert recommendation_to_json(first) != recommendation_to_json(other)


def test_recommendation_of_an_unconverged_posterior_is_red(make_posterior: MakePosterior) -> None:
    r = _recommend(make_posterior(converged=False), ClosedForm(), 1.5, 0.0, 6e-3)
    assert r.verdict.colour == "red"
    assert r.in_words.startswith("Do not build on this: the chains have not converged: R-hat of young_modulus")
    assert r.sureness in ("not to be relied on", "not sure", "no clear best")
    assert "No padding is recommended" in r.in_words
    assert " mm" not in r.in_words
    assert "capacitance change" not in r.in_words


def test_recommendation_from_a_dishonest_model_is_red_but_not_unconverged(
    make_posterior: MakePosterior,
) -> None:
    r = _recommend(make_posterior(honest=False), ClosedForm(), 1.5, 0.0, 6e-3)
    assert [x.gate for x in r.verdict.reasons if x.level == "red"] == ["surrogate"]
    assert r.in_words.startswith("Do not build on this: at 12 loading curves of the posterior the closed form is off")
    assert "9.0 and 0.9 times the error it states" in r.in_words
    assert "not converged" not in r.in_words
    assert recommendation_from_json(recommendation_to_json(r)).verdict == r.verdict


def test_recommendation_is_conditioned_on_base_and_electrode(make_posterior: MakePosterior) -> None:
    text = " ".join(_recommend(make_posterior(), ClosedForm(), 1.5, 0.0, 6e-3).conditions)
    assert "bonded" in text
    assert "electrode radius 10 mm" in text


def test_json_round_trip_keeps_everything(make_posterior: MakePosterior) -> None:
    r = _recommend(_exact(make_posterior()), Hill(), 3.0, 0.0, 9e-3)
    text = recommendation_to_json(r)
    again = recommendation_from_json(text)
    assert recommendation_to_json(again) == text
    assert again.verdict == r.verdict
    plain = json.loads(text)
    assert (plain["kind"], plain["format"]) == ("recommendation", 6)
    assert plain["change"][0][0] is None  # nothing that JSON does not know
    assert plain["best"] == r.best


def test_a_table_has_one_row_for_each_thickness(make_posterior: MakePosterior) -> None:
    r = _recommend(_exact(make_posterior()), Hill(), 3.0, 0.0, 9e-3)
    table = r.to_dataframe()
    bands = [f"{name}_{q}{unit}" for name, unit in UNITS for q in ("05", "25", "50", "75", "95")]
    assert list(table.columns) == ["thickness_m", "coverage", "covered", *bands, "probability"]
    np.testing.assert_array_equal(table["thickness_m"], r.thickness)
    np.testing.assert_array_equal(table["covered"], r.covered)
    np.testing.assert_array_equal(table["probability"], r.probability)
    for name, _ in UNITS:
        np.testing.assert_array_equal(table[[b for b in bands if b.startswith(name)]].to_numpy().T, getattr(r, name))
    assert table.loc[~table["covered"], bands].isna().all(axis=None)
    best = table.set_index("thickness_m").loc[r.best]
    assert best["probability"] == r.best_probability
    assert best["change_50"] == r.change_at_best[2]


UNITS = (("change", ""), ("depth", "_m"), ("resolution", "_N"))


@pytest.mark.parametrize(
    "text", ["", "{}", "[1]", '{"format": 99}', '{"kind": "run", "format": 1}', '{"kind": "recommendation", "format": 99}']
)
def test_a_file_that_is_no_recommendation_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="not a recommendation this version can read"):
        recommendation_from_json(text)


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ((-1.0, 0.0, 9e-3), "force must be positive, got -1 N"),
        ((1.0, -1e-3, 9e-3), "padding thickness must not be negative, got -1 mm"),
        ((1.0, 9e-3, 1e-3), "padding range is empty: 9 mm to 1 mm"),
        ((float("nan"), 0.0, 9e-3), "force must be positive, got nan N"),
    ],
)
def test_requirements_say_what_is_wrong_with_them(numbers: tuple[float, float, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Requirement(*numbers)


def test_no_probability_is_called_certain() -> None:
    assert [percent(p) for p in (1.0, 0.5, 0.0)] == ["more than 99 %", "50 %", "less than 1 %"]


# --- the next specimen of a lot -----------------------------------------------------------------------------------------


def test_a_recommendation_says_whose_sensor_it_is_for(make_posterior: MakePosterior, make_lot: MakePosterior) -> None:
    for posterior, sensor, said in (
        (make_posterior(), "measured", "It is for the measured sensors"),
        (make_lot(), "next", "It is for the next sensor of this lot, which nobody has measured"),
    ):
        r = _recommend(posterior, Hill(), 3.0, 1e-3, 9e-3)
        assert said in r.in_words
        assert json.loads(recommendation_to_json(r))["sensor"] == sensor
        assert recommendation_from_json(recommendation_to_json(r)).sensor == sensor


def test_the_next_specimen_scatters_about_its_lot_by_the_spread(make_lot: MakePosterior) -> None:
    posterior = make_lot(spread=Fixed(0.2))
    values, lots = thin_draws(posterior, 900, np.random.default_rng(1)), posterior.table.lots
    following = as_next_specimen(values, lots, np.random.default_rng(2))
    away = np.log(following["young_modulus[sensor 1]"] / values["young_modulus"]) / 0.2
    assert np.mean(away) == pytest.approx(0, abs=0.12)
    assert np.std(away) == pytest.approx(1, abs=0.08)
    np.testing.assert_array_equal(following["young_modulus[sensor 1]"], following["young_modulus[sensor 2]"])
    np.testing.assert_array_equal(following["machine_compliance"], values["machine_compliance"])
    for quantity in ("relative_permittivity", "sensor_thickness", "padding_thickness"):
        of_next, of_lot = following[f"{quantity}[sensor 1]"], values[quantity]
        off = (of_next / of_lot - 1) / values[f"{quantity}_spread"]
        assert np.mean(off) == pytest.approx(0, abs=0.12)
        assert np.std(off) == pytest.approx(1, abs=0.15)
        np.testing.assert_array_equal(of_next, following[f"{quantity}[sensor 2]"])
    cast = padding_about_mean(values, following, lots)
    np.testing.assert_allclose(cast * values["padding_thickness"], following["padding_thickness[sensor 1]"])


def test_the_next_specimen_is_one_that_can_be(make_lot: MakePosterior) -> None:
    lots = make_lot().table.lots
    lots = (*lots, Lot("dielectric_thickness", LotPrior(Normal(0.36e-3, 0.05e-3), Fixed(0.1), (None, None)), np.array([0, 1])))
    sensor = {f"sensor_thickness[sensor {k}]": np.full(500, 0.74e-3) for k in (1, 2)}
    dielectric = {f"dielectric_thickness[sensor {k}]": np.full(500, 0.36e-3) for k in (1, 2)}
    of_lot = {"dielectric_thickness": np.full(500, 0.36e-3), "dielectric_thickness_spread": np.full(500, 0.1)}
    values = {**sensor, **dielectric, **of_lot}
    following = as_next_specimen(values, lots[-1:], np.random.default_rng(1))
    assert np.max(following["dielectric_thickness[sensor 2]"]) <= 0.37e-3
    assert np.std(following["dielectric_thickness[sensor 2]"]) > 0.01e-3
    with pytest.raises(ValueError, match="two dielectrics do not fit into a sensor of this lot"):
        as_next_specimen({**values, "dielectric_thickness": np.full(500, 0.9e-3)}, lots[-1:], np.random.default_rng(1))


def test_the_next_padding_scatters_about_what_is_asked_for(make_lot: MakePosterior) -> None:
    lot = _exact(make_lot(spread=Fixed(1e-3)))
    names = [p.name for p in lot.parameters]
    fine = lot.draws.copy()
    fine[..., [k for k, name in enumerate(names) if name.endswith("_spread")]] = 1e-3
    rough = fine.copy()
    rough[..., names.index("padding_thickness_spread")] = 0.05
    fine_width, rough_width = (
        np.ptp(_recommend(replace(lot, draws=draws), Hill(), 3.0, 2e-3, 3e-3).change_at_best[[0, 4]]) for draws in (fine, rough)
    )
    assert rough_width > 5 * fine_width


def test_the_next_specimen_is_less_certain_the_more_specimens_differ(make_lot: MakePosterior) -> None:
    alike, differing = (
        _recommend(_exact(make_lot(spread=Fixed(spread))), ClosedForm(capacitance_error=0.0), 1.5, 0.5e-3, 6e-3)
        for spread in (1e-3, 0.3)
    )
    assert np.ptp(differing.change_at_best[[0, 4]]) > 1.5 * np.ptp(alike.change_at_best[[0, 4]])
    assert differing.present_padding == pytest.approx(alike.present_padding, rel=0.05)


def test_the_next_specimen_is_the_same_for_the_same_seed(make_lot: MakePosterior) -> None:
    one, same, other = (_recommend(make_lot(), Hill(), 3.0, 1e-3, 9e-3, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.change, same.change)
    assert not np.array_equal(one.change, other.change)


def test_what_was_pressed_is_known_of_an_average_whose_first_model_has_unknowns_of_its_own(
    make_posterior: MakePosterior,
) -> None:
    posterior = make_posterior(n_specimen=2)
    e = posterior.experiment
    for first in (replace(e, law="gent"), replace(e, padding_material="foam")):  # the average has not what these need
        assert measured_presses(replace(posterior, experiment=first)) == measured_presses(posterior)

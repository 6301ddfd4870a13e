"""What to measure next: what is expected of a measurement against what a calibration with it finds, and what is said of it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from calib.checks import Reason, verdict_of
from calib.decision.candidate import Candidate
from calib.decision.candidates import candidates_of
from calib.decision.extrapolation import Aim
from calib.decision.gain import Knowledge, covariance, present_knowledge, with_measurement
from calib.decision.known import Known, force_reached
from calib.decision.measurements import next_measurements
from calib.decision.padding import recommend
from calib.decision.ranking import NextMeasurements, next_from_json, next_to_json
from calib.decision.read_by_itself import with_reading
from calib.decision.requirement import Requirement
from calib.decision.specified import conform
from calib.decision.wanted_presses import largest_load
from calib.errors import InputError
from calib.experiment import PRESSES, READINGS, Bench, Limit, Specification, experiment_from, read_experiment
from calib.priors import HalfNormal, Normal, Prior, TruncatedNormal, Uniform
from calib.problem import (
    CORRELATION_LENGTH,
    Problem,
    SweepPlan,
    build_problem,
    columns_at,
    model_sweeps,
    plan_sweep,
    plan_sweeps,
    put_together,
    values_at,
)
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.sampling import (
    Diagnostics,
    Gate,
    Look,
    ParameterSummary,
    Posterior,
    discrepancies_with,
    expected_information,
    look_at,
)
from models.analytic import ClosedForm
from models.sensor import FloatArray, design_from

GREEN = verdict_of([])


def _problem(specimens: int = 1, padding: str = "1.10 mm", name: str = "sensor", **tables: object) -> Problem:
    """A calibration of simulated sensors by the closed form: 5 N or so, with noise."""
    thickness = {"fixed": "0 mm"} if padding == "0 mm" else {"normal": [padding, "0.03 mm"]}
    priors = {"sensor_thickness": {"normal": ["0.74 mm", "0.02 mm"]}, "padding_thickness": thickness}
    names = [f"{name} {k}" for k in range(1, specimens + 1)]
    # Nothing is read from the files, which have to be there.
    files = sorted(str(path) for path in Path(__file__).parent.glob("*.py"))
    experiment = experiment_from(
        {
            "model": "closed form",
            "indenter": {"radius": "5 mm"},
            "sensor": {"radius": "10 mm"},
            "priors": {"young_modulus": {"lognormal": ["0.7 MPa", 1.6]}},
            "specimens": [{"name": n, "priors": priors, "force": file} for n, file in zip(names, files, strict=False)],
            **tables,
        },
        folder=".",
    )
    truth = {"young_modulus": 0.62e6, "sensor_thickness": 0.74e-3, "padding_thickness": 0.0 if padding == "0 mm" else 1.1e-3}
    design = design_from({**truth, "relative_permittivity": 2.8, "indenter_radius": 5e-3, "sensor_radius": 10e-3})
    rng, depth = np.random.default_rng(3), 0.25e-3 if padding == "0 mm" else 0.4e-3
    sweeps = [
        synthetic_sweep(ClosedForm(), design, depth, Rig(machine_compliance=2e-6), rng, specimen=name, n_points=25, tie="none")
        for name in names
    ]
    return build_problem(experiment, sweeps, ClosedForm())


def _posterior(look: Look, n_draw: int = 2000) -> Posterior:
    """Draws near a mode, as a posterior."""
    problem = look.problem
    rng = np.random.default_rng(0)
    draws = columns_at(problem, look.theta[rng.choice(len(look.theta), n_draw, p=look.weight)])
    summaries = {
        info.name: ParameterSummary(
            unit="",
            mean=float(np.mean(column)),
            sd=float(np.std(column)),
            median=float(np.median(column)),
            interval_90=(float(np.quantile(column, 0.05)), float(np.quantile(column, 0.95))),
            r_hat=1.0,
            ess_bulk=400.0,
            ess_tail=400.0,
            prior_contraction=0.9,
            prior_shift=0.0,
        )
        for info, column in zip(problem.parameters, draws.T, strict=True)
    }
    facts = Diagnostics(True, (), (), summaries, 100, 10, 1, 40, (0.3,), {}, Gate())
    shaped = draws.reshape(4, -1, draws.shape[1])
    nothing = np.zeros(shaped.shape[:2])
    return Posterior(
        problem.experiment,
        problem.sweeps,
        problem.parameters,
        problem.fixed,
        problem.forward.name,
        shaped,
        nothing,
        nothing[..., None],
        ("a",),
        40,
        1,
        facts,
        {},
    )


@pytest.fixture(scope="module")
def look() -> Look:
    """At a calibration of one specimen by force alone."""
    return look_at(_problem())


@pytest.fixture(scope="module")
def found(look: Look) -> NextMeasurements:
    """What to measure next after it."""
    return next_measurements(_posterior(look), ClosedForm(), seed=1, verdict=GREEN)


def _known(look: Look) -> Known:
    draws = look.theta[np.random.default_rng(0).choice(len(look.theta), 1000, p=look.weight)]
    return Known(look.problem, look.weight @ look.theta, draws)


def _sd_of_modulus(look: Look) -> float:
    column = columns_at(look.problem, look.theta)[:, look.problem.names.index("young_modulus")]
    return float(np.sqrt(look.weight @ (column - look.weight @ column) ** 2))


def _share(known: Known, candidate: Candidate) -> float:
    """Of the sd of the modulus, expected to be left by a measurement."""
    slope: FloatArray = np.eye(known.middle.size)[known.problem.names.index("young_modulus")][:, None]
    present = present_knowledge(known, known.draws[:64], np.zeros((64, 0)))
    both = (present, with_measurement(present, candidate))
    now, after = (np.mean(covariance(one)(slope)[:, slope[:, 0] > 0]) for one in both)
    return float(np.sqrt(after / now))


@pytest.mark.parametrize("kind", ["ball", "padding", "padding_thickness"])
def test_what_is_expected_of_a_measurement_is_what_a_calibration_with_it_finds(look: Look, kind: str) -> None:
    known = _known(look)
    candidate = next(c for c in candidates_of(known, Bench(balls=(3e-3,), paddings=(3e-3,)))[0] if c.kind == kind)
    problem = candidate.problem
    if problem is None:
        assert candidate.reads is not None
        k, sd = candidate.reads
        info = look.problem.parameters[k]
        prior, _ = with_reading(info.parameter, info.prior, 1.1e-3, sd)
        infos = tuple(replace(i, prior=prior) if i is info else i for i in look.problem.parameters)
        problem = replace(look.problem, parameters=infos)
    else:  # readings with noise of their own, a quarter of a mN at a point as those of the calibration
        points = problem.sweeps[-1].channels["force"]
        noise = 5e-3 / np.sqrt(points.n_effective) * np.random.default_rng(1).standard_normal(points.value.size)
        sweep = replace(problem.sweeps[-1], channels={"force": replace(points, value=points.value + noise)})
        problem = replace(problem, sweeps=(*look.problem.sweeps, sweep), plans=(*look.problem.plans, plan_sweep(sweep)))
    came = _sd_of_modulus(look_at(problem)) / _sd_of_modulus(look)
    # What is read of the discrepancy differs from press to press.
    assert _share(known, candidate) == pytest.approx(came, rel=0.25)


def test_a_press_once_more_in_the_same_way_tells_nothing_of_what_the_model_left_out_of_the_first(look: Look) -> None:
    known = _known(look)
    # Its noise is new, and so is its contact.
    assert _share(known, next(c for c in candidates_of(known, Bench())[0] if c.kind == "repeat")) > 0.97


def test_presses_that_share_their_misfit_tell_more_than_one_and_less_than_if_they_did_not(look: Look) -> None:
    known = _known(look)
    candidate = next(c for c in candidates_of(known, Bench())[0] if c.kind == "repeat")
    problem = candidate.problem
    assert problem is not None
    draws = np.tile(candidate.middle, (8, 1))

    def information(plans: Sequence[SweepPlan]) -> FloatArray:
        return expected_information(problem, plans, candidate.middle, draws)

    one, two = information(problem.plans[:1]), information(problem.plans)
    alone = [information([plan_sweep(sweep)]) for sweep in problem.sweeps]
    # By itself a press tells the same, but for the depths over which its misfit stays alike.
    assert np.max(np.abs(one - alone[0])) < 0.05 * np.max(alone[0])
    column = problem.names.index("young_modulus")
    assert one[0, column, column] < two[0, column, column] < 0.8 * (alone[0] + alone[1])[0, column, column]
    assert np.min(np.linalg.eigvalsh(two - one)) > -1e-6 * np.max(two)


def test_after_the_same_press_once_more_a_calibration_is_about_as_sure_as_was_expected(look: Look) -> None:
    known = _known(look)
    candidate = next(c for c in candidates_of(known, Bench())[0] if c.kind == "repeat")
    assert candidate.problem is not None
    points = candidate.problem.sweeps[-1].channels["force"]
    noise = 5e-3 / np.sqrt(points.n_effective) * np.random.default_rng(1).standard_normal(points.value.size)
    again = replace(candidate.problem.sweeps[-1], channels={"force": replace(points, value=points.value + noise)})
    sweeps = (*look.problem.sweeps, again)
    came = _sd_of_modulus(look_at(replace(candidate.problem, sweeps=sweeps, plans=plan_sweeps(sweeps)))) / _sd_of_modulus(look)
    # As if what the model leaves out were drawn anew it would be 0.76.
    assert _share(known, candidate) == pytest.approx(came, abs=0.1)


def test_misfit_that_a_deeper_press_repeats_is_found_as_much_larger_as_was_expected(look: Look) -> None:
    known = _known(look)
    candidate = next(c for c in candidates_of(known, Bench())[0] if c.kind == "force")
    problem, draws = candidate.problem, candidate.middle[None].copy()
    assert problem is not None
    k = problem.names.index("force_discrepancy")
    prior = problem.parameters[k].prior
    draws[0, k] = prior.to_normal(np.array(0.01))
    expected = float(prior.ppf_normal(discrepancies_with(problem, candidate.middle, draws)[0, k])) / 0.01
    models = model_sweeps(problem, problem.forward, problem.plans, values_at(problem, draws))
    (some,) = put_together(problem.plans, models)
    own, depth = some.readings.discrepancy, some.readings.depth[0]
    assert own is not None
    # What is so: the misfit stays alike over a share of the first press, and is taken to over one of the deeper press.
    length = CORRELATION_LENGTH * np.max(depth[: some.presses[0]])
    so = np.outer(own.sd[0], own.sd[0]) * np.exp(-0.5 * ((depth[:, None] - depth) / length) ** 2)
    modes = own.sd[0][:, None] * own.correlation.modes[0]
    noise = np.diag(some.readings.variance[0])
    misses = np.random.default_rng(2).multivariate_normal(np.zeros(depth.size), noise + so, 400)
    factors = np.exp(np.linspace(0.0, 2.0, 81))
    densities = []
    for c in factors:
        taken = noise + c**2 * modes @ modes.T
        densities.append(-0.5 * (np.linalg.slogdet(taken)[1] + np.sum(misses * np.linalg.solve(taken, misses.T).T, axis=1)))
    assert 1.2 < expected < 3
    assert factors[np.argmax(np.mean(densities, axis=1))] == pytest.approx(expected, rel=0.1)


@pytest.mark.parametrize("prior", [HalfNormal(2e-4), Uniform(0.0, 5e-4)], ids=lambda p: p.kind)
def test_no_discrepancy_is_expected_beyond_where_its_prior_goes(look: Look, prior: Prior) -> None:
    known = _known(look)
    problem = next(c for c in candidates_of(known, Bench())[0] if c.kind == "force").problem
    assert problem is not None
    k = problem.names.index("force_discrepancy")
    infos = tuple(replace(info, prior=prior) if n == k else info for n, info in enumerate(problem.parameters))
    draws = np.zeros((5, len(infos)))
    draws[:, k] = [-3.0, 0.0, 2.0, 3.5, 4.5]
    found = discrepancies_with(replace(problem, parameters=infos), np.zeros(len(infos)), draws)[:, k]
    assert np.all(np.isfinite(found))
    assert np.all(found <= np.maximum(draws[:, k], 4.0))


def test_a_press_no_deeper_leaves_discrepancies_as_they_are(look: Look) -> None:
    known = _known(look)
    candidate = next(c for c in candidates_of(known, Bench())[0] if c.kind == "repeat")
    assert candidate.problem is not None
    draws = np.tile(candidate.middle, (4, 1))
    assert np.array_equal(discrepancies_with(candidate.problem, candidate.middle, draws), draws)


def test_reading_a_quantity_as_badly_as_it_is_known_tells_nothing_and_exactly_as_much_as_fixing_it(look: Look) -> None:
    known = _known(look)

    def share(sd: float) -> float:
        bench = Bench(sds={"padding_thickness": sd})
        return _share(known, next(c for c in candidates_of(known, bench)[0] if c.kind == "padding_thickness"))

    fixed = replace(look.problem, parameters=tuple(p for p in look.problem.parameters if p.parameter != "padding_thickness"))
    at = np.array([p.parameter != "padding_thickness" for p in look.problem.parameters])
    fixed = replace(fixed, fixed={**look.problem.fixed, "padding_thickness[sensor 1]": 1.1e-3})
    without = Known(fixed, known.middle[at], known.draws[:, at])
    slope: FloatArray = np.eye(int(at.sum()))[fixed.names.index("young_modulus")][:, None]
    left = float(
        np.mean(covariance(present_knowledge(without, without.draws[:64], np.zeros((64, 0))))(slope)[:, slope[:, 0] > 0])
    )
    whole: FloatArray = np.eye(at.size)[look.problem.names.index("young_modulus")][:, None]
    now = float(np.mean(covariance(present_knowledge(known, known.draws[:64], np.zeros((64, 0))))(whole)[:, whole[:, 0] > 0]))
    assert share(1.0) == pytest.approx(1.0, abs=1e-6)
    assert share(1e-9) == pytest.approx(np.sqrt(left / now), rel=0.02)


def test_specimens_of_a_lot_and_its_modulus_are_as_wide_and_as_alike_before_any_data_as_believed() -> None:
    problem = _problem(2, pooling="partial", priors={"young_modulus": {"lognormal": ["0.7 MPa", 1.3]}})
    n, lots = len(problem.parameters), problem.table.lots
    draws, spread = np.zeros((1, n)), np.full((1, len(lots)), 0.05)
    times = covariance(Knowledge(problem, np.zeros(n), draws, spread, np.zeros((1, n, n))))
    c = times(np.eye(n + len(lots)))[0]
    place = [lot.quantity for lot in lots].index("young_modulus")
    one, other = lots[place].columns
    prior = lots[place].prior.specimen_priors[0]
    width, sigma = np.log(prior.ppf_normal(1.0) / prior.ppf_normal(0.0)), np.log(1.3)
    assert c[n + place, n + place] == pytest.approx(sigma**2)
    assert c[one, one] == pytest.approx((sigma**2 + 0.05**2) / width**2)
    assert c[one, other] == pytest.approx(sigma**2 / width**2)
    assert c[one, n + place] == pytest.approx(sigma**2 / width)


def test_under_partial_pooling_the_lot_is_asked_for_and_one_more_specimen_tells_of_it() -> None:
    problem = _problem(2, pooling="partial", priors={"young_modulus": {"lognormal": ["0.7 MPa", 1.6]}})
    problem = replace(problem, forward=ClosedForm(force_error=1e-3, capacitance_error=1e-3))
    known = _known(look_at(problem))
    candidates, unjudged = candidates_of(known, Bench(balls=()))
    n, lots = known.middle.size, problem.table.lots
    spread = np.full((64, len(lots)), 0.04)
    present = present_knowledge(known, known.draws[:64], spread)
    slope = np.eye(n + len(lots))[:, [n + [lot.quantity for lot in lots].index("young_modulus")]]
    left = {c.kind: np.mean(slope.T @ covariance(with_measurement(present, c))(slope)) for c in candidates}
    now = np.mean(slope.T @ covariance(present)(slope))
    # Two specimens of a spread of 4 % leave the lot's modulus at least 0.04 / sqrt(2); three have 2 / 3 of the variance.
    assert 0.04 / np.sqrt(2) < np.sqrt(now) < 0.06
    assert np.sqrt(left["specimen"] / now) == pytest.approx(np.sqrt(2 / 3), rel=0.05)
    assert left["repeat"] > left["specimen"]
    assert any("`nominal` does not say" in said for said in unjudged)
    assert any("nothing is known yet" in said for said in unjudged)


def test_ranking_falls_by_the_hour_and_nothing_makes_the_modulus_less_sure(found: NextMeasurements) -> None:
    rates = [one.per_hour for one in found.ranked]
    assert rates == sorted(rates, reverse=True)
    assert all(0 <= one.reduction < 1 and 0 < one.sd <= found.sd for one in found.ranked)
    assert {"repeat", "force", "ball", "specimen", "padding", "machine_compliance"} <= {one.kind for one in found.ranked}
    assert all(one.per_hour == pytest.approx(60 * one.reduction / one.minutes) for one in found.ranked)
    assert "for an hour in the lab" in found.in_words


def test_a_bench_says_what_can_be_measured_and_how_long_that_takes(look: Look) -> None:
    bench = Bench(load_cell=20.0, balls=(), minutes={"repeat": 1.0}, without=frozenset({"padding", "specimen", "force"}))
    found = next_measurements(_posterior(look), ClosedForm(), bench=bench, seed=1, verdict=GREEN)
    kinds = {one.kind: one for one in found.ranked}
    assert not {"ball", "padding", "specimen", "force"} & set(kinds)
    assert kinds["repeat"].minutes == 1.0
    assert any("20 N" in said for said in found.rests_on)


def test_a_bench_that_leaves_nothing_to_measure_is_refused_and_so_is_a_load_cell_in_other_units(look: Look) -> None:
    nothing = Bench(balls=(), paddings=(), without=frozenset({*PRESSES, *READINGS}))
    with pytest.raises(InputError, match=r"leaves nothing that could be measured.*`without`"):
        next_measurements(_posterior(look), ClosedForm(), bench=nothing, seed=1, verdict=GREEN)
    with pytest.raises(InputError, match=r"load_cell is 0\.001 N, and this run was pressed to .*Check its unit"):
        next_measurements(_posterior(look), ClosedForm(), bench=Bench(load_cell=1e-3), seed=1, verdict=GREEN)


def test_no_press_goes_beyond_the_load_cell_also_where_it_bears_less_than_was_measured(look: Look) -> None:
    known = _known(look)
    cell = 0.6 * max(force_reached(known, sweep) for sweep in known.problem.sweeps)
    some = {}
    for bench in (Bench(load_cell=cell), Bench(load_cell=2 * cell)):
        presses = [c for c in candidates_of(known, bench)[0] if c.problem is not None]
        assert {"repeat", "specimen", "padding", "ball"} <= {c.kind for c in presses}
        assert all(c.press is not None and c.press.force <= bench.load_cell * 1.001 for c in presses if bench.load_cell)
        some[bench.load_cell] = {c.alike for c in presses}
    assert some[cell] <= some[2 * cell]  # a better cell takes no measurement away


def test_a_small_ball_is_tried_as_far_as_the_model_goes_whatever_the_load_cell_bears(look: Look) -> None:
    known = _known(look)
    reached = max(force_reached(known, sweep) for sweep in known.problem.sweeps)
    some = {}
    for share in (0.1, 2.0):
        candidates, unjudged = candidates_of(known, Bench(load_cell=share * reached, balls=(0.2e-3,)))
        some[share] = {c.alike: c.press.force for c in candidates if c.kind == "ball" and c.press is not None}
        assert not any("ball of 0.2 mm" in said for said in unjudged)
    assert set(some[0.1]) == set(some[2.0]) != set()
    assert all(some[2.0][one] >= force for one, force in some[0.1].items())


@pytest.mark.parametrize("name", [r"a $x^$ b $\frac{$", "{force:.2g} {0} {}"])
def test_a_name_with_braces_stands_in_what_to_measure_as_it_is(name: str) -> None:
    look = look_at(_problem(name=name))
    candidates, unjudged = candidates_of(_known(look), Bench(balls=(3e-3,)))
    presses = [candidate.what for candidate in candidates if f"press {name} 1 " in candidate.what]
    assert len(presses) > 1
    assert all(text.startswith(f"press {name} 1 ") and " up to " in text for text in presses)
    assert not any("{force" in text.replace(name, "") for text in (*presses, *unjudged))


def test_what_is_taken_as_known_or_exact_is_said_and_not_ranked() -> None:
    problem = _problem(padding="0 mm", priors={"machine_compliance": {"fixed": "2 um/N"}})
    found = next_measurements(_posterior(look_at(problem)), ClosedForm(), seed=1, verdict=GREEN)
    said = " ".join(found.unjudged)
    assert "machine_compliance as known (2 µm/N)" in said
    assert "padding_thickness as known (0 mm)" in said
    assert "indenter_radius as exact" in said
    assert "time is not modelled" in said
    assert not {"machine_compliance", "padding_thickness"} & {one.kind for one in found.ranked}


def test_every_draft_is_an_experiment_once_its_files_are_there(found: NextMeasurements, tmp_path: Path) -> None:
    for number, one in enumerate(found.ranked, 1):
        path = tmp_path / "next.toml"
        text = found.draft(number, tmp_path)
        path.write_text(text, encoding="utf-8")
        for name in ("sensor_1_next_force", "sensor_1_next_capacitance", "sensor_2_next_force"):
            (tmp_path / f"{name}.csv").write_text(f"{number} {name}", encoding="utf-8")
        again = read_experiment(path)
        assert one.what in text
        assert again.unedited, one.what
        presses = sum(len(specimen.sweeps) for specimen in again.specimens)
        assert presses == 1 + (one.kind in {"repeat", "force", "ball", "capacitance", "padding", "specimen"})


def test_what_is_said_of_a_measurement_has_no_more_digits_than_a_standard_deviation_deserves(found: NextMeasurements) -> None:
    known = replace(found, mean=0.616028e6, sd=6.5847e3)
    assert known.in_words.startswith("Young's modulus is 0.6160 ± 0.0066 MPa (±1.1 % of it). Most for an hour")
    of_signal = replace(known, asked="padding", label="signal", mean=0.131642, sd=1.8412e-3, by_unknowns=1.5e-3)
    assert of_signal.in_words.startswith("Signal is 13.16 ± 0.18 % (±1.4 % of it). ")
    assert "differences between sensors, ±0.81 %, are left by all" in of_signal.in_words
    shown = [size.lstrip("0.").replace(".", "") for size in re.findall(r"±([\d.]+)", known.in_words)]
    assert len(shown) >= 3
    assert {len(digits) for digits in shown} == {2}
    one = found.ranked[0]
    assert known.brings(replace(one, sd=4.7601e3, reduction=0.28)) == "modulus ±0.77 % instead of ±1.1 %"
    assert known.brings(replace(one, sd=6.5e3, reduction=0.0129)) == "modulus ±1.1 %, narrower by 1 % of it"


def test_a_number_that_is_not_ranked_is_refused(found: NextMeasurements, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no measurement 99"):
        found.draft(99, tmp_path)


def test_signal_on_recommended_padding_has_a_part_that_no_measurement_takes_away(look: Look) -> None:
    wanted = Requirement(5.0, 0.5e-3, 4e-3, n_thickness=8)
    exact = ClosedForm(force_error=1e-3, capacitance_error=1e-3)
    found = next_measurements(_posterior(look), exact, wanted, seed=1, verdict=GREEN)
    left = np.sqrt(found.sd**2 - found.by_unknowns**2)
    assert left > 0
    assert all(left * 0.999 <= one.sd <= found.sd for one in found.ranked)
    assert all(0 <= one.regret <= found.regret * 1.001 for one in found.ranked)
    assert "are left by all" in found.in_words
    assert any(one.reduction > 0.1 for one in found.ranked)


_FARTHER = Requirement(6.0, 3.9e-3, 4e-3, n_thickness=3)


@pytest.fixture(scope="module")
def farther(look: Look) -> NextMeasurements:
    """For a signal at more force, on thicker padding, than were measured."""
    return next_measurements(_posterior(look), ClosedForm(), _FARTHER, seed=1, verdict=GREEN)


def test_the_press_that_an_advice_beyond_the_data_asks_for_is_among_the_measurements(farther: NextMeasurements) -> None:
    asked = next(reason for reason in farther.verdict.reasons if reason.gate == "extrapolation")
    assert "Press one pad of about" in asked.action
    assert {"force", "padding"} <= set(farther.beyond)
    confirming = [one for one in farther.ranked if farther.confirms(one)]
    assert [one.kind for one in confirming] == ["padding"]
    assert "up to 6 N" in confirming[0].what
    number = farther.ranked.index(confirming[0]) + 1
    assert f"Green on extrapolation with number {number} of all: {confirming[0].what}" in farther.in_words
    told = {one.kind: farther.settled_in_words(one) for one in farther.ranked if not farther.confirms(one)}
    assert told["force"] == "force"
    assert not any(told[kind] for kind in ("repeat", "machine_compliance"))
    record = json.loads(next_to_json(farther))
    assert [one["confirms"] for one in record["ranked"]].index(True) == number - 1


def test_a_calibration_with_that_press_is_green_on_extrapolation(look: Look, farther: NextMeasurements) -> None:
    posterior, known = _posterior(look), _known(look)
    aim = Aim(6.0, recommend(posterior, ClosedForm(), _FARTHER, seed=1, verdict=GREEN).best, 0.0, (5e-3,))
    what = next(one.what for one in farther.ranked if farther.confirms(one))
    problem = next(c.problem for c in candidates_of(known, Bench(), aim)[0] if c.what == what)
    assert problem is not None
    with_it = _posterior(look_at(problem))
    assert not recommend(with_it, ClosedForm(), _FARTHER, seed=1, verdict=GREEN).verdict.reasons


def test_an_advice_for_another_ball_is_confirmed_with_that_ball(look: Look) -> None:
    wanted = replace(_FARTHER, force=5.0, indenter_radius=6e-3)
    found = next_measurements(_posterior(look), ClosedForm(), wanted, Bench(balls=(6e-3,)), seed=1, verdict=GREEN)
    assert {"padding", "ball", "capacitance"} <= set(found.beyond)  # as force alone was measured
    (one,) = [one for one in found.ranked if found.confirms(one)]
    assert "press it with a ball of 6 mm radius, the LCR meter connected, up to 5 N" in one.what
    assert one.experiment.specimens[-1].sweeps[0].indenter_radius == 6e-3
    asked = next(reason for reason in found.verdict.reasons if reason.gate == "extrapolation")
    assert "mm with a ball of 6 mm radius to 5 N" in asked.action


def test_what_the_load_cell_or_the_lab_does_not_bear_confirms_nothing_and_is_said(look: Look) -> None:
    known, wanted = _known(look), _FARTHER
    most = largest_load(known, Bench()) / 2
    weak = next_measurements(_posterior(look), ClosedForm(), wanted, Bench(load_cell=most), seed=1, verdict=GREEN)
    assert not any(weak.confirms(one) for one in weak.ranked)
    assert "leaves force" in weak.in_words
    assert [r.action[:60] for r in weak.verdict.reasons if r.gate == "extrapolation"] == [
        "None of the measurements that lab and model allow confirms i"
    ]
    thin = next_measurements(_posterior(look), ClosedForm(), wanted, Bench(paddings=(2e-3,)), seed=1, verdict=GREEN)
    assert not any("padding" in one.settles for one in thin.ranked)
    assert any("which the advice is for: it is not among the paddings of the bench file" in said for said in thin.unjudged)


def test_modulus_that_is_fixed_and_an_average_are_refused(look: Look) -> None:
    posterior = _posterior(look)
    with pytest.raises(InputError, match="is an average"):
        next_measurements(replace(posterior, of_model=np.zeros((4, 500), dtype=np.int64)), ClosedForm(), seed=1, verdict=GREEN)
    fixed = _problem(priors={"young_modulus": {"fixed": "0.62 MPa"}})
    with pytest.raises(InputError, match="nothing to learn"):
        next_measurements(_posterior(look_at(fixed)), ClosedForm(), seed=1, verdict=GREEN)


def test_a_red_calibration_and_a_posterior_that_is_not_normal_are_said(
    look: Look, make_posterior: Callable[..., Posterior]
) -> None:
    red = verdict_of([Reason("convergence", "red", "chains do not agree", "Go on")])
    found = next_measurements(_posterior(look), ClosedForm(), seed=1, verdict=red)
    assert found.in_words.startswith("Do not plan by this: chains do not agree.")
    # Draws made by hand, far narrower than the data make them.
    by_hand = next_measurements(make_posterior(n_specimen=1), ClosedForm(), seed=1, verdict=GREEN)
    assert [reason.gate for reason in by_hand.verdict.reasons] == ["linearisation"]
    assert by_hand.in_short.doubts == (by_hand.verdict.reasons[0].finding,)
    assert next_from_json(next_to_json(by_hand)) == by_hand.in_short


def test_record_says_all_of_it_in_si(found: NextMeasurements) -> None:
    record = json.loads(next_to_json(found, "abc"))
    assert (record["kind"], record["for"], record["fingerprint"]) == ("next measurements", "modulus", "abc")
    assert record["target"]["sd"] == pytest.approx(found.sd)
    assert [one["what"] for one in record["ranked"]] == [one.what for one in found.ranked]
    assert record["not_judged"] == list(found.unjudged)


def test_reading_and_what_was_believed_are_weighed_by_their_variances() -> None:
    prior, note = with_reading("padding_thickness", Normal(1.1e-3, 0.03e-3), 1.14e-3, 0.01e-3)
    assert isinstance(prior, TruncatedNormal | Normal)
    assert prior.mean == pytest.approx(1.136e-3)
    assert prior.sd == pytest.approx(0.03e-3 / np.sqrt(10), rel=1e-3)
    assert "0.900 times what you read, plus 0.100 times 1.1 mm" in note
    bounded, _ = with_reading("machine_compliance", HalfNormal(5e-6), 1e-7, 1e-7)
    assert isinstance(bounded, TruncatedNormal)
    assert bounded.low == 0.0
    wide, told = with_reading("contact_offset", Uniform(-0.5e-3, 0.5e-3), 0.1e-3, 0.01e-3)
    assert wide.support == (-0.5e-3, 0.5e-3)
    assert "takes the place" in told


# --- deciding on a specification ----------------------------------------------------------------------------------------


def _asked(stroke: float, **more: Any) -> Specification:
    """Padding of 1 to 3 mm that gives way by so much [m] at most under 3 N."""
    given: dict[str, Any] = {"lower": 1e-3, "upper": 3e-3, "steps": 9, "probability": 0.9, **more}
    return Specification((Limit("stroke", "at_most", stroke),), (3.0,), **given)


def _for_specification(look: Look, stroke: float, **more: Any) -> NextMeasurements:
    exact = ClosedForm(force_error=1e-3, capacitance_error=1e-3)
    few = Bench(balls=(3e-3,), paddings=(), without=frozenset({"specimen", "force", "capacitance"}))
    return next_measurements(_posterior(look), exact, _asked(stroke, **more), few, seed=1, verdict=GREEN)


@pytest.fixture(scope="module")
def strokes(look: Look) -> FloatArray:
    """Of the draws, on the padding that gives way least, quantiles 1, 30, 50, 70, 99 %."""
    wide = conform(_posterior(look), ClosedForm(), _asked(1e-3), seed=1, verdict=GREEN).best.stroke[:, 0]
    return np.asarray(wide[2] + (wide[4] - wide[0]) / 3.29 * np.array([-4.0, -0.5, 0.0, 0.5, 4.0]), dtype=float)


def test_a_specification_that_hangs_on_the_modulus_is_decided_more_often_rightly_after_measuring(
    look: Look, strokes: FloatArray
) -> None:
    found = _for_specification(look, float(strokes[3]))
    assert found.deciding is not None
    assert not found.deciding.released
    assert 0.5 < found.deciding.probability < 0.9
    assert found.deciding.now.wrong_hold == pytest.approx(found.deciding.probability)
    rates = [one.per_hour for one in found.ranked]
    assert rates == sorted(rates, reverse=True)
    assert found.ranked[0].tells
    assert all(one.decided is not None and one.decided.loss <= found.deciding.now.loss for one in found.ranked)
    assert "held back, as sensors on the best padding conform with" in found.in_words
    assert "Most for an hour in the lab" in found.in_words
    assert any("9 times as much" in said for said in found.rests_on)


@pytest.mark.parametrize("at", [0, 4])
def test_where_the_decision_is_sure_already_no_measurement_is_worth_its_time(look: Look, strokes: FloatArray, at: int) -> None:
    found = replace(_for_specification(look, float(strokes[at])), verdict=GREEN)
    assert found.deciding is not None
    assert found.deciding.released is (at == 4)
    assert not any(one.tells for one in found.ranked)
    assert "no measurement is worth its time" in found.in_words


@pytest.mark.parametrize("at", [0, 4])
@pytest.mark.parametrize("colour", ["amber", "red"])
def test_nothing_is_released_and_no_measurement_spared_where_the_verdict_is_not_green(
    look: Look, strokes: FloatArray, at: int, colour: Literal["amber", "red"]
) -> None:
    doubt = verdict_of([Reason("prior", colour, "the modulus lies far from what was believed", "Look at it")])
    found = replace(_for_specification(look, float(strokes[at])), verdict=doubt)
    said = found.in_words
    assert "released, as" not in said
    assert "worth its time" not in said
    assert ("prior" in said) is (colour == "amber")
    assert ("%" in said) is (colour == "amber")


def test_the_press_that_confirms_an_advice_is_first_of_those_that_tell_nothing_and_says_why(
    look: Look, strokes: FloatArray
) -> None:
    asked = _asked(float(strokes[4]))
    bench = Bench(balls=(3e-3,))
    found = next_measurements(_posterior(look), ClosedForm(), asked, bench, seed=1, verdict=GREEN)
    advised = conform(_posterior(look), ClosedForm(), asked, seed=1, verdict=GREEN)
    assert found.beyond
    assert not any(one.tells for one in found.ranked)
    first = found.ranked[0]
    assert found.settles_all(first)
    assert f"on {advised.best.best * 1e3:.4g} mm of padding" in first.what
    assert f"with number 1 of all: {first.what}; not for what the draws would tell" in found.in_words
    assert "not decided yet, as the verdict is amber (extrapolation)" in found.in_words
    assert next_from_json(next_to_json(found)) == found.in_short
    assert found.in_short.first[0].brings.startswith("holds the model against data")


def test_nothing_is_released_while_the_draws_leave_open_whether_it_conforms(look: Look) -> None:
    asked = Specification((Limit("height", "at_most", 9e-3),), (3.0,), lower=1e-3, upper=1.2e-3, steps=9, probability=0.999999)
    found = next_measurements(_posterior(look), ClosedForm(), asked, seed=1, verdict=GREEN)
    assert "specification" in {reason.gate for reason in found.verdict.reasons}
    assert re.search(r"not decided yet, as the verdict is amber \([a-z, ]*specification\)", found.in_words)
    assert "released, as" not in found.in_words


def test_where_all_hangs_on_what_scatters_no_measurement_is_worth_its_time(look: Look, strokes: FloatArray) -> None:
    found = replace(_for_specification(look, float(strokes[3]), modulus_spread=0.5), verdict=GREEN)
    assert found.deciding is not None
    assert found.deciding.exactly.loss == pytest.approx(found.deciding.now.loss, rel=0.05)
    assert not any(one.tells for one in found.ranked)
    assert "No measurement that was tried is worth its time" in found.in_words


def test_height_hangs_on_no_unknown_that_a_press_tells(look: Look) -> None:
    tall = Specification((Limit("height", "at_most", 2.75e-3),), (3.0,), lower=2.0e-3, upper=3e-3, steps=9, probability=0.9)
    found = next_measurements(_posterior(look), ClosedForm(), tall, seed=1, verdict=GREEN)
    kinds = {one.kind: one for one in found.ranked}
    assert not kinds["machine_compliance"].tells


def test_a_specification_has_a_draft_and_a_record_that_a_report_reads(look: Look, strokes: FloatArray, tmp_path: Path) -> None:
    found = _for_specification(look, float(strokes[3]))
    assert found.ranked[0].what in " ".join(found.draft(1, tmp_path).replace("#", " ").split())
    text = next_to_json(found, "abc")
    record = json.loads(text)
    assert record["for"] == "spec"
    assert found.deciding is not None
    assert record["deciding"]["now"]["wrong_hold"] == pytest.approx(found.deciding.now.wrong_hold)
    assert record["ranked"][0]["decided"]["loss"] < record["deciding"]["now"]["loss"]
    assert next_from_json(text) == found.in_short
    assert next_from_json(text, draws_sha256="of another") is None
    with pytest.raises(InputError, match="not what `calib next` has written"):
        next_from_json(text.replace("spec", "spex", 1))

"""The one verdict on a calibration: what takes green away, at which number, with what to do; nothing does of a sound one."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib.checks.predictive import predict
from calib.checks.reasons import conflict_limit, judge_posterior, passed_gates
from calib.checks.verdict import AMBER_ALLOWS, Reason, Verdict, verdict_from_plain, verdict_of
from calib.decision.padding import recommend
from calib.decision.requirement import Requirement
from calib.experiment import Unedited
from calib.lab import Grade
from calib.priors import Prior, TruncatedNormal, Uniform
from calib.sampling import Departure, FirstEstimate, Foretold, Posterior
from models.analytic import ClosedForm

MakePosterior = Callable[..., Posterior]


def _with(posterior: Posterior, **changes: Any) -> Posterior:
    return replace(posterior, diagnostics=replace(posterior.diagnostics, **changes))


def _moved(posterior: Posterior, name: str, **changes: Any) -> Posterior:
    parameters = posterior.diagnostics.parameters
    return _with(posterior, parameters={**parameters, name: replace(parameters[name], **changes)})


def _gates(posterior: Posterior) -> dict[str, str]:
    return {r.gate: r.level for r in judge_posterior(posterior).reasons}


def test_a_sound_calibration_is_green_and_says_what_was_looked_at(make_posterior: MakePosterior) -> None:
    verdict = judge_posterior(make_posterior(honest=True))
    assert (verdict.colour, verdict.reasons) == ("green", ())
    assert {"convergence", "surrogate", "prior", "discrepancy", "lab data"} <= set(
        passed_gates(make_posterior(honest=True), verdict)
    )


def test_red_comes_before_amber_and_files_keep_it_all() -> None:
    amber, red = Reason("range", "amber", "near the end", "Stop earlier"), Reason("fit", "red", "off", "Look")
    verdict = verdict_of([amber, red])
    assert (verdict.colour, verdict.reasons) == ("red", (red, amber))
    assert verdict_of([amber]).colour == "amber"
    assert verdict_from_plain(json.loads(json.dumps(verdict.to_plain()))) == verdict
    assert Verdict().to_plain() == {"colour": "green", "reasons": []}


@pytest.mark.parametrize(
    ("name", "prior", "cuts"),
    [
        ("young_modulus", lambda m, s: Uniform(0.5 * m, m + 1.2 * s), True),
        ("young_modulus", lambda m, s: Uniform(m - 1.2 * s, 2 * m), True),
        ("young_modulus", lambda m, s: TruncatedNormal(m, m, 0.5 * m, m + 1.2 * s), True),
        ("young_modulus", lambda m, s: Uniform(m - 2 * s, m + 2 * s), False),
        ("machine_compliance", lambda m, s: Uniform(0.0, 9 * m), False),
        ("parasitic_capacitance", lambda m, s: Uniform(m - s, m + 9 * s), True),
    ],
)
def test_a_prior_whose_end_cuts_what_the_data_say_is_amber_unless_there_is_nothing_beyond(
    make_posterior: MakePosterior, name: str, prior: Callable[[float, float], Prior], cuts: bool
) -> None:
    posterior = _moved(make_posterior(), name, prior_contraction=0.97)
    s = posterior.diagnostics.parameters[name]
    if name == "machine_compliance":  # at the end of what there is
        posterior = _moved(posterior, name, mean=s.sd)
    own = prior(s.mean, s.sd)
    parameters = tuple(replace(p, prior=own) if p.name == name else p for p in posterior.parameters)
    found = [r for r in judge_posterior(replace(posterior, parameters=parameters)).reasons if r.gate == "prior"]
    assert [(r.level, f"{name} at the end of its prior" in r.finding) for r in found] == ([("amber", True)] if cuts else [])


@pytest.mark.parametrize(("shift", "level"), [(0.9, None), (1.01, "amber"), (1.6, "red")])
def test_what_contradicts_a_prior_is_graded_by_how_rare_it_is(
    make_posterior: MakePosterior, shift: float, level: str | None
) -> None:
    posterior = make_posterior()
    limit = conflict_limit(len(posterior.parameters))
    for sign in (-1, 1):
        found = judge_posterior(_moved(posterior, "machine_compliance", prior_shift=sign * shift * limit))
        assert [r.level for r in found.reasons if r.gate == "prior"] == ([level] if level else [])
        assert not level or "machine compliance would be 2 µm/N" in found.reasons[0].finding


def test_unknowns_of_a_sound_lab_rarely_contradict_their_priors() -> None:
    shifts = np.abs(np.random.default_rng(3).standard_normal((20000, 20)))
    assert np.mean(np.any(shifts > conflict_limit(20), axis=1)) == pytest.approx(0.01, abs=0.003)


@pytest.mark.parametrize(("z", "level"), [(1.9, None), (2.46, "amber"), (5.0, "red"), (-4.0, None)])
def test_a_discrepancy_above_what_was_believed_is_no_success(
    make_posterior: MakePosterior, z: float, level: str | None
) -> None:
    posterior = _moved(make_posterior(), "capacitance_discrepancy", prior_shift=z, mean=0.054)
    found = [r for r in judge_posterior(posterior).reasons if r.gate == "discrepancy"]
    assert [r.level for r in found] == ([level] if level else [])
    assert all("5.4 %" in r.finding for r in found)


@pytest.mark.parametrize(("log_bayes", "level"), [(-200.0, None), (-4.0, None), (0.1, "amber"), (1.5, "amber"), (44.0, "red")])
def test_a_model_that_the_data_prefer_takes_the_green_away(
    make_posterior: MakePosterior, log_bayes: float, level: str | None
) -> None:
    other = Departure("own-padding", "padding of its own modulus", log_bayes, FirstEstimate(0.7e6, 0.02e6))
    found = [r for r in judge_posterior(_with(make_posterior(), departures=(other,))).reasons if r.gate == "model"]
    assert [r.level for r in found] == ([level] if level else [])
    assert all("0.700 ± 0.020 instead of 0.6200 ± 0.0040 MPa" in r.finding for r in found)


@pytest.mark.parametrize(
    ("log_bayes", "modulus", "level"), [(-1.0, 0.622e6, None), (-1.0, 0.64e6, "amber"), (-3.5, 0.66e6, None)]
)
def test_a_model_that_the_data_leave_open_takes_the_green_away_where_it_moves_the_modulus(
    make_posterior: MakePosterior, log_bayes: float, modulus: float, level: str | None
) -> None:
    other = Departure("own-padding", "padding of its own modulus", log_bayes, FirstEstimate(modulus, 0.02e6))
    found = [r for r in judge_posterior(_with(make_posterior(), departures=(other,))).reasons if r.gate == "model"]
    assert [r.level for r in found] == ([level] if level else [])
    assert all(
        "describes these data about as well as the one given" in r.finding and "odds 1 : 2.7" in r.finding for r in found
    )


def test_models_that_describe_the_data_about_as_well_are_all_named_and_none_is_advised(make_posterior: MakePosterior) -> None:
    padding = Departure("own-padding", "padding of its own modulus", 3.7, FirstEstimate(0.7e6, 0.02e6))
    clock = Departure("clock-rate", "the meter's clock about 1.2 % fast", 2.9, FirstEstimate(0.61e6, 0.007e6))
    gent = Departure("gent", "Gent", 0.3, FirstEstimate(0.62e6, 0.01e6))
    (reason,) = judge_posterior(_with(make_posterior(), departures=(gent, clock, padding))).reasons
    assert reason.finding.startswith(
        "other models describe these data better than the one given, which do not tell them apart: padding"
    )
    assert "; or the meter's clock about 1.2 % fast (18 times as probable), with a Young's modulus of 0.610" in reason.finding
    assert "Gent" not in reason.finding
    assert "a part of the base that is not bonded" in reason.finding
    assert reason.action.startswith("Take none of these on its odds alone")
    # One that is far more probable than the others is named by itself, and still not advised.
    (reason,) = judge_posterior(_with(make_posterior(), departures=(replace(clock, log_bayes=9.0), padding))).reasons
    assert reason.finding.startswith("another model describes these data better than the one given: the meter's clock")
    assert "padding" not in reason.finding
    assert reason.action.startswith("Take none of these on its odds alone")


def test_models_that_could_not_be_asked_take_the_green_away(make_posterior: MakePosterior) -> None:
    unknown = Departure("own-padding", "padding of its own modulus", np.nan, None)
    assert _gates(_with(make_posterior(), departures=(unknown,))) == {"model": "amber"}
    known = replace(unknown, name="slippery", log_bayes=-40.0)
    assert _gates(_with(make_posterior(), departures=(unknown, known))) == {}


@pytest.mark.parametrize(("z", "level"), [(0.8, None), (3.9, "amber"), (-7.0, "red")])
def test_a_specimen_that_the_others_do_not_predict_is_named(make_posterior: MakePosterior, z: float, level: str | None) -> None:
    ratio = FirstEstimate(1 + 0.03 * z, 0.03)
    told = (Foretold("sensor 1", "force", FirstEstimate(1.01, 0.03), 0.3), Foretold("sensor 2", "force", ratio, z))
    found = [r for r in judge_posterior(_with(make_posterior(), foretold=told)).reasons if r.gate == "specimens"]
    assert [r.level for r in found] == ([level] if level else [])
    side = f"11.7 ± 3.0 % higher than expected, {z:.1f}" if z > 0 else f"21.0 ± 3.0 % lower than expected, {-z:.1f}"
    wanted = f"sensor 2 is not predicted by the others: its force is {side} standard deviations, and of two specimens"
    assert all(r.finding.startswith(wanted) and 'pooling = "partial"' in r.action for r in found)


def test_of_three_the_one_that_is_not_predicted_is_meant(make_posterior: MakePosterior) -> None:
    told = [Foretold(f"sensor {k}", "capacitance", FirstEstimate(1.0, 0.03), z) for k, z in ((1, 0.5), (2, -1.0), (3, 4.1))]
    (reason,) = judge_posterior(_with(make_posterior(), foretold=tuple(told))).reasons
    assert "sensor 3" in reason.finding
    assert "of two specimens" not in reason.finding


def test_parts_of_a_press_that_cannot_be_foretold_take_the_green_away(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    z = [0.3] * len(posterior.blocks)
    assert _gates(_with(posterior, block_z=tuple(z))) == {}
    assert "left-out data" in passed_gates(_with(posterior, block_z=tuple(z)), judge_posterior(posterior))
    z[1] = np.nan
    unknown = _with(posterior, block_z=tuple(z))
    assert _gates(unknown) == {"left-out data": "amber"}
    assert "left-out data" not in passed_gates(unknown, judge_posterior(posterior))


def test_a_misfit_says_where_along_the_press_it_lies(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    predictions = list(predict(posterior, ClosedForm(), np.random.default_rng(1), n_draw=50))
    fit = predictions[0].channels["force"]
    span = np.ptp(fit.check.mean)
    thirds = np.concatenate([np.full(n, off) for n, off in ((14, 0.0), (13, -0.02), (13, 0.05))])
    y = fit.check.mean + span * thirds
    wrong = replace(fit, check=replace(fit.check, y=y, p_value=1e-4))
    predictions[0] = replace(predictions[0], channels={**predictions[0].channels, "force": wrong})
    assert wrong.check.pattern == "2.0 % too low in the middle third, 5.0 % too high in the last third"
    (reason,) = judge_posterior(posterior, predictions).reasons
    assert reason.finding.endswith(f"of its range the force of sensor 1 lies {wrong.check.pattern}")
    large = judge_posterior(_moved(posterior, "force_discrepancy", prior_shift=3.0, mean=0.05), predictions).reasons
    (grown,) = [r for r in large if r.gate == "discrepancy"]
    assert grown.finding.endswith(f"of its range the force of sensor 1 lies {wrong.check.pattern}")


def test_bad_lab_data_guesses_of_the_draft_and_an_unlearned_modulus_are_amber_but_noise_is_red(
    make_posterior: MakePosterior,
) -> None:
    posterior = make_posterior()

    def graded(check: str) -> Posterior:
        grade = Grade(check, "bad", 0.4, "1", "found", "Repeat it.", "force", "f.csv")
        return replace(posterior, sweeps=(replace(posterior.sweeps[0], grades=(grade,)), *posterior.sweeps[1:]))

    assert _gates(graded("hysteresis")) == {"lab data": "amber"}
    assert _gates(graded("signal")) == {"lab data": "red"}
    assert _gates(_moved(posterior, "young_modulus", prior_contraction=0.2)) == {"learned": "amber"}
    left = replace(posterior.experiment, unedited=(Unedited(5, "indenter radius"),))
    assert _gates(replace(posterior, experiment=left)) == {"experiment file": "amber"}


def test_advice_beyond_what_was_measured_is_amber_and_never_very_sure(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    near = recommend(
        posterior, ClosedForm(), Requirement(2.0, 1.0e-3, 1.2e-3, n_thickness=3, n_draw=100, tolerance=0.5), seed=1
    )
    assert near.verdict.colour == "green"
    assert near.sureness == "very sure"
    far = recommend(posterior, ClosedForm(), Requirement(20.0, 3e-3, 4e-3, n_thickness=3, n_draw=100, tolerance=0.5), seed=1)
    (reason,) = far.verdict.reasons
    assert (reason.gate, reason.level) == ("extrapolation", "amber")
    assert "times the largest measured force" in reason.finding
    assert "times the thickest measured padding" in reason.finding
    assert "sure" in far.sureness
    assert "very" not in far.sureness
    other = Requirement(2.0, 1.0e-3, 1.2e-3, n_thickness=3, n_draw=100, tolerance=0.5, indenter_radius=9e-3)
    (reason,) = recommend(posterior, ClosedForm(), other, seed=1).verdict.reasons
    assert "a ball of 9 mm radius (measured with 5 mm)" in reason.finding


def test_advice_is_not_very_sure_while_the_data_leave_another_model_open(make_posterior: MakePosterior) -> None:
    asked = Requirement(2.0, 1.0e-3, 1.2e-3, n_thickness=3, n_draw=100, tolerance=0.5)
    open_ = Departure("own-padding", "padding of its own modulus", -1.2, FirstEstimate(0.63e6, 0.02e6))
    out = replace(open_, name="slippery", model="slippery base", log_bayes=-130.0)
    found = recommend(_with(make_posterior(), departures=(open_, out)), ClosedForm(), asked, seed=1)
    assert found.verdict.colour == "green"
    assert [m.split(" (")[0] for m in found.open_models] == ["padding of its own modulus"]
    assert "leave others open" in found.sureness
    closed = recommend(_with(make_posterior(), departures=(out,)), ClosedForm(), asked, seed=1)
    assert (closed.open_models, closed.sureness) == ((), "very sure")


@pytest.mark.parametrize("page", ["docs/verdict.md", "docs/batch.md", "docs/tutorial.md", "README.md"])
def test_what_amber_allows_stands_in_the_same_words_wherever_it_is_told(page: str) -> None:
    text = " ".join((Path(__file__).parents[3] / page).read_text(encoding="utf-8").split())
    assert AMBER_ALLOWS in text

"""The report: complete, self-contained, honest about convergence, and with numbers that a person can read."""

from __future__ import annotations

import csv
import io
import json
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, get_args

import matplotlib as mpl
import numpy as np
import pytest

from calib.catalogue import UnknownName
from calib.checks import UNSEEN, Unseen, unseen_to_text
from calib.checks.predictive import Prediction, predict
from calib.checks.reasons import judge_posterior
from calib.checks.verdict import AMBER_ALLOWS, Reason, Verdict, verdict_of
from calib.decision import NextInShort, ShortMeasurement
from calib.decision.padding import recommend
from calib.decision.recommendation import Recommendation
from calib.decision.requirement import Requirement
from calib.digits import interval_text, with_uncertainty
from calib.experiment.plan import MaterialLaw
from calib.lab.quality.grade import Grade
from calib.report import sections
from calib.report.figures.predictive import channel_figure
from calib.report.page import report_page
from calib.report.pictures import figure_address
from calib.report.rows import SENSOR_PARAMETERS, parameter_rows
from calib.report.sections.convergence import criteria
from calib.report.sections.headline import summary_sentences
from calib.report.sections.limits import LIMITS_OF_LAWS, limits
from calib.report.summary import summary_csv, summary_json
from calib.sampling.diagnostics import Gate
from calib.sampling.findings import Departure, FirstEstimate, Foretold
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm

MakePosterior = Callable[..., Posterior]
FORWARD = ClosedForm(force_error=0.002, capacitance_error=0.005)


@pytest.fixture(scope="module")
def predictions(make_posterior: MakePosterior) -> tuple[Prediction, ...]:
    return predict(make_posterior(), FORWARD, np.random.default_rng(1), n_draw=100)


@pytest.fixture(scope="module")
def recommendation(make_posterior: MakePosterior) -> Recommendation:
    return recommend(make_posterior(), FORWARD, Requirement(8.0, 0.0, 4e-3, n_thickness=13, n_draw=100), seed=1)


@pytest.fixture(scope="module")
def page(make_posterior: MakePosterior, predictions: tuple[Prediction, ...], recommendation: Recommendation) -> str:
    return report_page(make_posterior(), predictions, recommendation, posterior_sha256="aa")


@pytest.mark.usefixtures("undrawn")
def test_report_shows_what_to_measure_next_with_minutes_and_what_it_brings_but_not_where_it_is_red(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...]
) -> None:
    one = ShortMeasurement("press <sensor 1> with a ball of 3 mm", "modulus ±0.7 % instead of ±1.1 %", 20.0, 0.36, 1.08)
    known = NextInShort("modulus", "Young's modulus", "Young's modulus is 0.62 MPa ± 1.1 %.", (one,))
    told = _text(report_page(make_posterior(), predictions, verdict=Verdict(), next_steps=known))
    assert "What to measure next" in told
    assert "press &lt;sensor 1&gt; with a ball of 3 mm modulus ±0.7 % instead of ±1.1 % 36 % 108 % 20" in told
    hint = report_page(make_posterior(), predictions, verdict=Verdict(), next_steps=replace(known, doubts=("it bends",)))
    assert "A hint only: it bends." in _text(hint)
    why = replace(known, first=(), why_not="there are 99 unknowns")
    assert "Not worked out here: there are 99 unknowns" in _text(
        report_page(make_posterior(), predictions, verdict=Verdict(), next_steps=why)
    )
    red = verdict_of([Reason("convergence", "red", "chains do not agree", "Go on")])
    assert "What to measure next" not in _text(report_page(make_posterior(), predictions, verdict=red, next_steps=known))


@pytest.mark.usefixtures("undrawn")
def test_what_to_measure_next_for_another_load_than_that_of_the_advice_says_so(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...], recommendation: Recommendation
) -> None:
    def told(load: str) -> str:
        known = NextInShort("padding", f"signal at {load} on 4 mm of padding", "It is known to 2 %.", ())
        return _text(report_page(make_posterior(), predictions, recommendation, next_steps=known))

    assert "Asked of another load than the 8 N of the advice on this page" in told("20 N")
    assert "Asked of another load" not in told("8 N")


def test_limits_say_that_pressing_once_more_does_not_average_what_the_model_leaves_out(make_posterior: MakePosterior) -> None:
    posterior = make_posterior(n_specimen=1)
    again = replace(posterior, sweeps=(*posterior.sweeps, replace(posterior.sweeps[0], name="again")))
    other = replace(posterior, sweeps=(*posterior.sweeps, replace(posterior.sweeps[0], name="other", indenter_radius=3e-3)))
    headings = [[heading for heading, _ in limits(one)] for one in (posterior, other, again)]
    assert ["What the model leaves out is the same in every press of a specimen under one ball" in of for of in headings] == [
        False,
        False,
        True,
    ]


def _text(page: str) -> str:
    """The words of a page, without tags, styles and pictures."""
    page = re.sub(r"<style>.*?</style>", " ", page, flags=re.S)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", page))


def test_report_needs_nothing_beside_itself(page: str) -> None:
    assert "<script" not in page
    assert "http://" not in re.sub(r"base64,[A-Za-z0-9+/=]+", "", page)
    assert "https://" not in page
    assert all(source.startswith("data:image/") for source in re.findall(r'src="([^"]*)', page))
    assert not re.search(r"@import|url\(", page)


def test_report_is_well_formed(page: str) -> None:
    class Balance(HTMLParser):
        open: list[str]

        def handle_starttag(self, tag: str, attrs: object) -> None:
            if tag not in ("meta", "img", "br"):
                self.open.append(tag)

        def handle_endtag(self, tag: str) -> None:
            assert self.open.pop() == tag

    parser = Balance()
    parser.open = []
    parser.feed(page)
    assert parser.open == []
    ids = re.findall(r'id="([^"]*)"', page)
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'href="#([^"]*)"', page)) <= set(ids)


def test_every_picture_says_in_words_what_it_shows(page: str) -> None:
    alts = re.findall(r'<img src="[^"]*" alt="([^"]*)"', page)
    assert len(alts) == page.count("<img ") == 13
    assert all(len(alt) > 10 for alt in alts)


def test_verdict_comes_first_with_numbers_units_and_padding(page: str) -> None:
    text = _text(page)
    assert text.index("Green: the numbers can be used.") < text.index("0.6200 ± 0.0040 MPa") < text.index("Parameters Mean")
    assert "At 8 N it gives a capacitance change" in text[: text.index("Parameters Mean")]


def test_every_value_on_the_page_is_rounded_by_its_uncertainty(page: str) -> None:
    values = re.findall(r"(-?[\d.]+) ± ([\d.]+)", _text(page))
    assert len(values) > 20
    for value, sd in values:
        assert len(value.partition(".")[2]) == len(sd.partition(".")[2]), (value, sd)
        assert len(sd.replace(".", "").lstrip("0")) == 2, (value, sd)


@pytest.mark.usefixtures("undrawn")
def test_unconverged_report_says_so_before_anything_else(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...]
) -> None:
    text = _text(report_page(make_posterior(converged=False), predictions))
    assert (
        text.index("Red: do not use the numbers.")
        < text.index("R-hat of young_modulus is 1.31")
        < text.index("0.6200 ± 0.0040 MPa")
    )
    assert "✗ not met" in text


def test_prior_driven_parameters_are_named_in_the_verdict(page: str) -> None:
    assert "The data hardly moved relative permittivity: there the result is the prior, not the measurement." in _text(page)


def test_report_names_files_hashes_excluded_rows_command_and_seed(page: str) -> None:
    text = _text(page)
    wanted = (
        "sensor 1_force.csv",
        "ab" * 32,
        "300 unloading branch, 12 empty cell",
        "calib calibrate experiment.toml -o RUN --seed 7",
    )
    assert all(w in text for w in (*wanted, "seed 7", "versions numpy "))


def test_report_states_what_outweighs_the_noise(make_posterior: MakePosterior, page: str) -> None:
    text = _text(page)
    assert "on a slippery base the same curve would mean about 1.9 times the Young&#39;s modulus" in text
    assert all(word in text for word in ("Fringe fields are left out", "Only the loading branch", "Friction is left out"))
    headings = [h for h, _ in limits(make_posterior())]
    assert "The model is the closed form" in headings
    assert "Electrode radius is the disc radius" in headings


def test_the_limits_are_those_of_the_law_of_the_experiment(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    gent = replace(posterior, experiment=replace(posterior.experiment, law="gent"))
    assert (
        "stiffening at large strain is not modelled" in dict(limits(posterior))["Neo-Hookean, nearly incompressible silicone"]
    )
    assert not any(text.endswith("stiffening at large strain is not modelled.") for _, text in limits(gent))
    assert "Gent's law, nearly incompressible silicone" in dict(limits(gent))
    assert not any("Neo-Hookean" in heading for heading, _ in limits(gent))
    assert set(LIMITS_OF_LAWS) == set(get_args(MaterialLaw))


@pytest.mark.usefixtures("undrawn")
def test_what_nothing_shows_stands_on_the_first_page_where_it_exceeds_a_standard_deviation(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...]
) -> None:
    def page_of(shift: float, **options: Any) -> str:
        found = make_posterior(**options)
        modulus = UnknownName("young_modulus")
        kept = [Unseen("load_step", 0.004, modulus, shift, 0.01 * shift), Unseen("force_gain", 0.01, modulus, -1.3, -0.0098)]
        return _text(report_page(replace(found, attrs={**found.attrs, UNSEEN: unseen_to_text(kept)}), predictions))

    page = page_of(-5.2)
    told = (
        "Not seen: a load cell balanced anew at the touch of every press, by the noise of one reading (4 mN), would shift "
        "Young&#39;s modulus of the sensor by 5.2 of its standard deviations"
    )
    assert 0 < page.index(told) < page.index("Holds only for")
    assert "give load_step = " in page
    exact = (
        "an exact load cell: one that reads 1 % too high makes Young&#39;s modulus of the sensor 0.98 % too large "
        "(1.3 of its standard deviations)"
    )
    assert page.index("Holds only for") < page.index(exact)
    without = _text(report_page(make_posterior(), predictions))
    assert "Not seen" not in without
    status = re.search(r"(Green|Amber): [^.]*\.", without)
    assert status is not None
    assert page.index(status[0]) < page.index(told)  # the light stays what it is
    assert "Not seen" not in page_of(0.9)
    void = page_of(-5.2, converged=False)
    assert "Not seen" not in void
    assert exact not in void


def test_a_model_that_data_may_have_asked_for_says_that_the_choice_is_in_no_uncertainty(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    heading = "The model is taken as known before these data"
    assert heading not in dict(limits(posterior))
    own = replace(posterior, experiment=replace(posterior.experiment, padding_material="own", law="gent"))
    said = dict(limits(own))[heading]
    assert said.startswith("It has: Gent, padding of its own modulus. If that was chosen because a simpler model did not")
    assert "the choice was made on the same data" in said
    foam = replace(posterior, experiment=replace(posterior.experiment, padding_material="foam"))
    assert heading not in dict(limits(foam))


def test_what_is_said_of_friction_is_that_of_the_contact_of_the_experiment(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    stick = replace(posterior, experiment=replace(posterior.experiment, stick=True))
    free, stuck = ({heading for heading, _ in limits(p)} for p in (posterior, stick))
    assert free - stuck == {"Friction is left out"}
    assert stuck - free == {"The ball is taken as sticking", "The model is taken as known before these data"}
    advice = "give friction_coefficient = { uniform = [0, 0.6] } in [priors]"
    plain = replace(posterior.experiment, model="surrogate")
    plans = [plain, replace(plain, base="slippery"), replace(plain, law="gent")]
    said = [dict(limits(replace(posterior, experiment=plan)))["Friction is left out"] for plan in plans]
    assert [advice in text for text in said] == [True, True, False]  # as far as there are surrogates


def test_a_run_is_judged_by_its_own_gate(make_posterior: MakePosterior) -> None:
    posterior = make_posterior(converged=False)  # R-hat 1.31, 37 effective draws, 32 autocorrelation times
    lenient = replace(posterior, diagnostics=replace(posterior.diagnostics, gate=Gate(r_hat=1.5, ess=30.0, length=20.0)))
    strict = replace(posterior, diagnostics=replace(posterior.diagnostics, gate=Gate(length=40.0)))
    assert [(c.asked, c.met) for c in criteria(lenient)[:3]] == [
        ("below 1.5", True),
        ("above 30", True),
        ("at least 20 autocorrelation times", True),
    ]
    assert [c.met for c in criteria(strict)[:3]] == [False, False, False]
    assert all(row.r_hat_met and row.ess_met for row in parameter_rows(lenient))
    assert not any(row.r_hat_met or row.ess_met for row in parameter_rows(strict))


@pytest.mark.usefixtures("undrawn")
def test_a_dishonest_model_is_not_called_unconverged_and_gets_advice_that_can_help(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...]
) -> None:
    head = _text(report_page(make_posterior(honest=False), predictions)).partition("Parameters Mean")[0]
    assert "Red: do not use the numbers." in head
    assert "9.0 and 0.9 times the error it states" in head
    assert "calib surrogate refine" in head
    assert "--resume" not in head
    assert "not converged" not in head
    assert "can be used" not in head
    both = _text(report_page(make_posterior(converged=False, honest=False), predictions)).partition("Parameters Mean")[0]
    assert all(words in both for words in ("have not converged", "R-hat of young_modulus", "--resume", "surrogate refine"))


@pytest.mark.usefixtures("undrawn")
def test_what_is_red_shows_no_number_that_one_might_take_for_a_result(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...], recommendation: Recommendation
) -> None:
    posterior = make_posterior(converged=False)
    red = judge_posterior(posterior, predictions)
    known = replace(recommendation, verdict=red)
    page = report_page(posterior, predictions, known, posterior_sha256="aa")
    rows = [row for row in parameter_rows(posterior) if row.parameter in SENSOR_PARAMETERS]
    assert rows
    struck = re.sub(r"<s>.*?</s>", "", page)  # on the first page and in every table
    for row in rows:
        assert f"<s>{row.value}" in page, row.name
        assert row.value not in struck, row.name
    assert known.best_in_words not in _text(page)
    assert 'class="value"' not in page
    assert page.count("✗ no result") == len([row for row in rows if not row.where])
    assert "What padding" not in _text(page)
    assert "RED: no results" in page  # at the head of every sheet of paper
    # Advice of before, when the verdict was a better one, is none either.
    stale = _text(report_page(posterior, predictions, recommendation, posterior_sha256="bb"))
    assert recommendation.best_in_words not in stale
    assert "can be used" not in stale
    assert "No padding is recommended" in stale
    # Where it is not red nothing is struck through.
    fine = report_page(posterior, predictions, recommendation, verdict=Verdict(), posterior_sha256="aa")
    assert "<s>" not in fine
    assert "no result" not in fine


@pytest.mark.usefixtures("undrawn")
def test_a_module_put_beside_the_others_is_a_section(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "weather.py").write_text(WEATHER, encoding="utf-8")
    monkeypatch.setattr(sections, "__path__", [*sections.__path__, str(tmp_path)])
    monkeypatch.delitem(sys.modules, "calib.report.sections.weather", raising=False)
    page = report_page(make_posterior(), predictions)
    assert page.index('<section id="limits">') < page.index('<section id="weather">\n<h2>The weather</h2>')
    assert page.index('<section id="weather">') < page.index('<section id="appendix">')
    assert '<a href="#limits">Limits</a><a href="#weather">Weather</a><a href="#convergence">Convergence</a>' in page
    assert "<dt>rain</dt><dd>2 &lt; 3 mm</dd>" in page


WEATHER = """
from calib.report.section import Section

ORDER = 49


def section(results):
    return Section("weather", "The weather", "Weather", "limits.html.j2", {"limits": [("rain", "2 < 3 mm")]})
"""


def test_no_two_sections_claim_the_same_place() -> None:
    orders = [module.ORDER for module in sections.section_modules()]
    assert orders == sorted(set(orders))


def test_what_the_room_offers_is_loaded_when_asked_for_and_without_the_extras() -> None:
    code = (
        "import sys, calib.report as room\n"
        "assert not {'matplotlib', 'jinja2', 'models.fem'} & set(sys.modules)\n"
        "assert all(getattr(room, name) for name in room.__all__)\n"
        "assert dir(room) == sorted(room.__all__)\n"
        "assert not {'pyvista', 'vtkmodules', 'meshio', 'corner'} & set(sys.modules)\n"
        "assert not hasattr(room, 'nonsense')\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.usefixtures("undrawn")
def test_a_model_that_does_not_describe_the_data_is_no_success(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...]
) -> None:
    first = predictions[0]
    fit = first.channels["force"]
    doubtful = replace(fit, check=replace(fit.check, p_value=1e-5))
    wrong = replace(first, channels={**first.channels, "force": doubtful})
    text = _text(report_page(make_posterior(), (wrong, *predictions[1:])))
    assert "Red: do not use the numbers." in text
    assert "fit the model does not describe the force of sensor 1 within what it claims" in text
    assert "can be used" not in text


@pytest.mark.usefixtures("undrawn")
def test_other_models_stand_in_a_table_with_the_modulus_that_each_would_give(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...]
) -> None:
    posterior = make_posterior()
    assert "Other models of these data" not in report_page(posterior, predictions)
    found = (
        Departure("slippery", "slippery base", -130.0, FirstEstimate(1.2e6, 0.02e6)),
        Departure("stick", "sticking", float("nan"), None),
        Departure("own-padding", "padding of its own modulus", -1.2, FirstEstimate(0.63e6, 0.022e6)),
        Departure("gent", "Gent", 2.0, FirstEstimate(0.61e6, 0.01e6)),
    )
    foretold = (Foretold("sensor 2", "force", FirstEstimate(1.03, 0.012), 2.5),)
    plain = Departure("discrepancy-off", "no discrepancy", 1.5, FirstEstimate(0.62e6, 0.009e6))
    diagnostics = replace(posterior.diagnostics, departures=found, foretold=foretold, without_discrepancy=plain)
    told = replace(posterior, diagnostics=diagnostics)
    text = _text(report_page(told, predictions)).partition("Other models of these data")[2]
    assert (
        text.index("Gent 7.4 ask for it 0.610 ± 0.010")
        < text.index("padding of its own modulus 0.3 do not rule it out 0.630 ± 0.022")
        < text.index("slippery base 3.5e-57 rule it out 1.200 ± 0.020")
        < text.index("sticking not known")
    )
    wanted = "the force of sensor 2 is 1.030 ± 0.012 times what they let one expect (2.5 standard deviations from 1)"
    assert wanted in text
    assert "no discrepancy (4.5 times as probable), with a Young&#39;s modulus of 0.6200 ± 0.0090 instead of" in text


GRADES = (
    Grade("readings in contact", "good", 240.0, "readings", "240 readings", "", "force", "sensor 1_force.csv"),
    Grade(
        "load zero", "warning", -6.1, "N", "the force before contact is -6.1 N", "Balance it.", "force", "sensor 1_force.csv"
    ),
    Grade("hysteresis", "bad", 0.41, "1", "gives back 59 % <of it>", "Condition it.", "force", "sensor 1_force.csv"),
)


def _judged(posterior: Posterior) -> Posterior:
    first, *others = posterior.sweeps
    return replace(posterior, sweeps=(replace(first, grades=GRADES), *others))


@pytest.mark.usefixtures("undrawn")
def test_the_quality_of_the_lab_data_is_a_table_with_the_worst_first(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...]
) -> None:
    page = report_page(_judged(make_posterior()), predictions)
    text = _text(page)
    assert "3 checks: 1 bad (hysteresis, force, of sensor 1_force.csv), 1 warning, 1 good." in text
    part = text[text.index("level check number finding advice") :]
    assert (
        part.index("sensor 1: sensor 1_force.csv")
        < part.index("✗ bad hysteresis, force 41 % gives back 59 % &lt;of it&gt;. Condition it.")
        < part.index("! warning load zero, force -6.1 N the force before contact is -6.1 N. Balance it.")
        < part.index("✓ good readings in contact, force: 240 readings")
    )
    assert f"Amber: the numbers {AMBER_ALLOWS}." in text
    assert "lab data what flaws of the lab files do is not in the uncertainties: hysteresis of the force of sensor 1" in text


@pytest.mark.usefixtures("undrawn")
def test_a_run_without_verdicts_has_no_table_of_them(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...]
) -> None:
    assert "Quality of the lab data" not in report_page(make_posterior(), predictions)


def test_summary_json_carries_the_verdicts_in_si(make_posterior: MakePosterior) -> None:
    quality = json.loads(summary_json(_judged(make_posterior()), Verdict()))["data_quality"]
    assert [q["level"] for q in quality] == ["good", "warning", "bad"]
    assert quality[2] == {
        "specimen": "sensor 1",
        "sweep": "",
        "check": "hysteresis",
        "level": "bad",
        "number": 0.41,
        "unit": "1",
        "finding": "gives back 59 % <of it>",
        "advice": "Condition it.",
        "channel": "force",
        "file": "sensor 1_force.csv",
    }


@pytest.mark.usefixtures("undrawn")
def test_a_recommendation_from_another_posterior_is_marked_as_old(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...], recommendation: Recommendation
) -> None:
    page = report_page(make_posterior(n_specimen=1), predictions[:1], recommendation, posterior_sha256="bb")
    assert "advice was made from other draws" in _text(page.partition("<nav>")[0])
    assert "recommendation was made from other draws" in _text(page.partition("<nav>")[2])


@pytest.mark.usefixtures("undrawn")
def test_names_from_the_experiment_file_are_escaped(make_posterior: MakePosterior, predictions: tuple[Prediction, ...]) -> None:
    posterior = make_posterior(n_specimen=1)
    evil = replace(posterior, experiment=replace(posterior.experiment, name="<b>5 < 6 & 7</b>"))
    assert "<h1>&lt;b&gt;5 &lt; 6 &amp; 7&lt;/b&gt;</h1>" in report_page(evil, predictions[:1])


def test_pictures_are_the_same_every_time(predictions: tuple[Prediction, ...]) -> None:
    first, again = (figure_address(channel_figure(predictions[0], "force")) for _ in range(2))
    assert first == again


def test_figures_leave_the_settings_of_matplotlib_alone(predictions: tuple[Prediction, ...]) -> None:
    before = dict(mpl.rcParams)
    channel_figure(predictions[1], "capacitance")
    assert dict(mpl.rcParams) == before


def test_figures_refuse_a_channel_that_is_not_there(predictions: tuple[Prediction, ...]) -> None:
    with pytest.raises(ValueError, match="sensor 1 has no force readings"):
        channel_figure(replace(predictions[0], channels={}), "force")
    with pytest.raises(ValueError, match="sensor 1 has no capacitance readings"):
        channel_figure(replace(predictions[0], channels={}), "capacitance")


def test_report_works_with_force_alone(make_posterior: MakePosterior) -> None:
    posterior = make_posterior(n_specimen=1)
    keep = [
        i
        for i, p in enumerate(posterior.parameters)
        if "capacitance" not in p.parameter and p.parameter != "relative_permittivity"
    ]
    infos = tuple(posterior.parameters[i] for i in keep)
    d = posterior.diagnostics
    alone = replace(
        posterior,
        sweeps=tuple(replace(s, channels={"force": s.channels["force"]}) for s in posterior.sweeps),
        parameters=infos,
        draws=posterior.draws[:, :, keep],
        diagnostics=replace(d, parameters={i.name: d.parameters[i.name] for i in infos}),
    )
    page = report_page(
        alone,
        predict(alone, FORWARD, np.random.default_rng(1), n_draw=60),
        recommend(alone, FORWARD, Requirement(5.0, 0.0, 4e-3, n_thickness=5, n_draw=60), seed=1),
    )
    assert re.search(r"force resolution [^.]*dC/dF not known", _text(page))


@pytest.mark.parametrize(
    ("mean", "sd", "text"),
    [
        (0.61234, 0.01432, "0.612 ± 0.014"),
        (0.61234, 0.00996, "0.612 ± 0.010"),
        (1.0, 0.0996, "1.00 ± 0.10"),
        (12345.0, 2345.0, "12300 ± 2300"),
        (-0.00001, 0.5, "0.00 ± 0.50"),
        (3.0, 9.96, "3 ± 10"),
        (2.0, 0.0, "2"),
        (float("nan"), 1.0, "not known"),
    ],
)
def test_uncertainty_sets_the_digits(mean: float, sd: float, text: str) -> None:
    assert with_uncertainty(mean, sd) == text


def test_interval_has_as_many_digits_as_it_deserves() -> None:
    assert interval_text(0.58912, 0.63551) == "0.589 to 0.636"
    assert interval_text(120.0, 480.0) == "120 to 480"
    assert interval_text(float("nan"), 1.0) == "not known"


def test_rows_are_in_display_units(make_posterior: MakePosterior) -> None:
    rows = {r.name: r for r in parameter_rows(make_posterior())}
    assert rows["young_modulus"].unit == "MPa"
    assert rows["sensor_thickness[sensor 1]"].where == "sensor 1"
    assert rows["machine_compliance"].value == "2.00 ± 0.30"
    assert rows["relative_permittivity"].learned == "prior-driven"


def test_summary_json_has_the_documented_layout(make_posterior: MakePosterior) -> None:
    summary = json.loads(summary_json(make_posterior(converged=False), verdict_of([Reason("fit", "red", "found", "Do")])))
    assert list(summary.items())[:2] == [("kind", "summary"), ("format", 1)]
    reasons = [{"gate": "fit", "level": "red", "finding": "found", "action": "Do"}]
    assert summary["verdict"] == {"colour": "red", "reasons": reasons}
    assert summary["converged"] is False
    assert summary["surrogate_honest"] is None
    assert summary["reasons"] == ["R-hat of young_modulus is 1.31, above 1.01"]
    assert summary["seed"] == 7
    assert summary["versions"] == {"numpy": np.__version__}
    assert {"file": "sensor 1_force.csv", "sha256": "ab" * 32} in summary["inputs"]
    assert {"file": "experiment.toml", "sha256": "ef" * 32} in summary["inputs"]
    e = summary["parameters"]["young_modulus"]
    assert e["unit"] == "Pa"
    assert e["mean"] == pytest.approx(0.62e6)
    assert set(e) == {
        "unit",
        "mean",
        "sd",
        "median",
        "interval_90",
        "r_hat",
        "ess_bulk",
        "ess_tail",
        "prior_contraction",
        "prior_shift",
    }


def test_summary_json_tells_the_chains_from_the_surrogate(make_posterior: MakePosterior) -> None:
    facts = {}
    for key, posterior in (
        ("honest", make_posterior(honest=True)),
        ("dishonest", make_posterior(honest=False)),
        ("neither", make_posterior(converged=False, honest=False)),
    ):
        summary = json.loads(summary_json(posterior, Verdict()))
        facts[key] = (summary["converged"], summary["surrogate_honest"], len(summary["reasons"]))
    assert facts == {"honest": (True, True, 0), "dishonest": (True, False, 1), "neither": (False, False, 2)}


def test_summary_json_writes_null_for_what_is_not_known(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    d = posterior.diagnostics
    lost = {**d.parameters, "young_modulus": replace(d.parameters["young_modulus"], r_hat=float("nan"))}
    summary = json.loads(summary_json(replace(posterior, diagnostics=replace(d, parameters=lost)), Verdict()))
    assert summary["parameters"]["young_modulus"]["r_hat"] is None


def test_summary_csv_has_one_line_per_parameter(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    rows = list(csv.DictReader(io.StringIO(summary_csv(posterior))))
    assert [r["parameter"] for r in rows] == [p.name for p in posterior.parameters]
    assert float(rows[0]["interval_90_low"]) < float(rows[0]["mean"]) < float(rows[0]["interval_90_high"])


# --- specimens of one lot -----------------------------------------------------------------------------------------------


def test_the_table_of_a_lot_shows_the_lot_its_spread_and_the_moduli_of_specimens(make_lot: Callable[..., Posterior]) -> None:
    found = parameter_rows(make_lot())
    assert [row.name for row in found[:2]] == ["young_modulus", "young_modulus_spread"]
    rows = {row.name: row for row in found}
    assert rows["young_modulus"].label == "Young's modulus of the sensor, lot"
    assert rows["young_modulus_spread"].unit == "%"
    assert rows["young_modulus[sensor 1]"].where == "sensor 1"
    assert rows["young_modulus[sensor 1]"].origin == "its lot"
    assert rows["padding_thickness"].label == "padding thickness, lot"
    assert rows["padding_thickness[sensor 1]"].origin == "its lot, and what was measured of it"
    experiment = make_lot().experiment
    wanted = zip(experiment.specimens, (1.1e-3, 1.3e-3), strict=True)
    meant = tuple(replace(s, nominal={"padding_thickness": value}) for s, value in wanted)
    differing = replace(make_lot(), experiment=replace(experiment, specimens=meant))
    labels = {row.name: row.label for row in parameter_rows(differing)}
    assert labels["padding_thickness"] == "padding thickness, lot, as sensor 1 was meant"
    assert labels["sensor_thickness"] == "sensor thickness, lot"


@pytest.mark.parametrize(("n", "said"), [(1, "one specimen cannot tell"), (2, "2 specimens can hardly tell")])
def test_few_specimens_hardly_tell_a_spread_and_the_report_says_so(
    make_lot: Callable[..., Posterior], n: int, said: str
) -> None:
    posterior = make_lot(n_specimen=n)
    parameters = {
        name: replace(s, prior_contraction=0.02) if name.endswith("_spread") else s
        for name, s in posterior.diagnostics.parameters.items()
    }
    posterior = replace(posterior, diagnostics=replace(posterior.diagnostics, parameters=parameters))
    text = summary_sentences(posterior)
    assert said in text
    assert "Young's modulus of the lot is" in text
    for quantity in ("Young's modulus", "relative permittivity", "sensor thickness", "padding thickness"):
        assert f"% in {quantity}" in text
    assert "hardly moved" not in text  # which is said once


@pytest.mark.parametrize(("learned", "said"), [(0.12, "the data taught 12 %: it is mostly what was put in"), (0.8, "")])
def test_a_permittivity_that_is_mostly_what_was_put_in_is_said_to_be(
    make_posterior: MakePosterior, learned: float, said: str
) -> None:
    posterior = make_posterior()
    parameters = {
        name: replace(s, prior_contraction=learned) if name == "relative_permittivity" else s
        for name, s in posterior.diagnostics.parameters.items()
    }
    text = summary_sentences(replace(posterior, diagnostics=replace(posterior.diagnostics, parameters=parameters)))
    assert said in text
    assert ("mostly what was put in" in text) == bool(said)


@pytest.mark.usefixtures("undrawn")
def test_the_page_of_a_lot_says_whose_padding_it_is_and_what_the_specimens_are(make_lot: Callable[..., Posterior]) -> None:
    posterior = make_lot()
    advice = recommend(posterior, ClosedForm(), Requirement(1.0, 0.5e-3, 3e-3, n_thickness=9, n_draw=60), seed=1)
    text = _text(report_page(posterior, (), advice))
    assert "It is for the next sensor of this lot" in text
    assert "each a sensor of this lot that was not measured" in text
    assert "The specimens are of one lot: each has a modulus, a permittivity and thicknesses of its own" in text
    assert json.loads(summary_json(posterior, Verdict()))["pooling"] == "partial"

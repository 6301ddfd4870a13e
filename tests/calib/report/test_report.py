"""The report: complete, self-contained, honest about convergence, and with numbers that a person can read."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser

import matplotlib as mpl
import numpy as np
import pytest

from calib.checks.predictive import Prediction, predict
from calib.decision.padding import recommend
from calib.decision.recommendation import Recommendation
from calib.decision.requirement import Requirement
from calib.lab.quality import Verdict
from calib.report import figures
from calib.report.page import figure_address, interval_text, limits, parameter_rows, with_uncertainty, write_report
from calib.report.summary import summary_csv, summary_json
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm

MakePosterior = Callable[..., Posterior]
FORWARD = ClosedForm(force_error=0.002, capacitance_error=0.005)


@pytest.fixture(scope="module")
def predictions(make_posterior: MakePosterior) -> tuple[Prediction, ...]:
    return predict(make_posterior(), FORWARD, np.random.default_rng(1), n_draw=100)


@pytest.fixture(scope="module")
def recommendation(make_posterior: MakePosterior) -> Recommendation:
    return recommend(
        make_posterior(), FORWARD, Requirement(8.0, 0.0, 4e-3, n_thickness=13, n_draw=100), seed=1, posterior_sha256="aa"
    )


@pytest.fixture(scope="module")
def page(make_posterior: MakePosterior, predictions: tuple[Prediction, ...], recommendation: Recommendation) -> str:
    return write_report(make_posterior(), predictions, recommendation, posterior_sha256="aa")


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Drawing is what takes time; most tests are about words."""
    monkeypatch.setattr("calib.report.page.figure_address", lambda *_, **__: "data:,")


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
    assert len(alts) == page.count("<img ") == 9
    assert all(len(alt) > 10 for alt in alts)


def test_verdict_comes_first_with_numbers_units_and_padding(page: str) -> None:
    text = _text(page)
    assert (
        text.index("Converged: the numbers below can be used")
        < text.index("0.6200 ± 0.0040 MPa")
        < text.index("Parameters Mean")
    )
    assert "mm of padding. At 8 N it gives a capacitance change" in text[: text.index("Parameters Mean")]


@pytest.mark.usefixtures("no_pictures")
def test_unconverged_report_says_so_before_anything_else(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...]
) -> None:
    text = _text(write_report(make_posterior(converged=False), predictions))
    assert text.index("Not converged") < text.index("R-hat of young_modulus is 1.31") < text.index("0.6200 ± 0.0040 MPa")
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
    assert all(w in text for w in (*wanted, "seed 7", "version of numpy"))


def test_report_states_what_outweighs_the_noise(make_posterior: MakePosterior, page: str) -> None:
    text = _text(page)
    assert "on a slippery base the same curve would mean about 1.9 times the Young&#39;s modulus" in text
    assert all(word in text for word in ("Fringe fields are left out", "Only the loading branch", "Friction is left out"))
    headings = [h for h, _ in limits(make_posterior())]
    assert "The model is the closed form" in headings
    assert "Electrode radius is the disc radius" in headings


@pytest.mark.usefixtures("no_pictures")
def test_a_model_that_does_not_describe_the_data_is_no_success(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...]
) -> None:
    first = predictions[0]
    fit = first.channels["force"]
    doubtful = replace(fit, check=replace(fit.check, p_value=1e-5))
    wrong = replace(first, channels={**first.channels, "force": doubtful})
    text = _text(write_report(make_posterior(), (wrong, *predictions[1:])))
    assert "Converged, but the model does not describe all data" in text
    assert "The model does not describe the force of sensor 1 within what it claims" in text
    assert "can be used" not in text


VERDICTS = (
    Verdict("readings in contact", "good", 240.0, "readings", "240 readings", "", "force", "sensor 1_force.csv"),
    Verdict(
        "load zero", "warning", -6.1, "N", "the force before contact is -6.1 N", "Balance it.", "force", "sensor 1_force.csv"
    ),
    Verdict("hysteresis", "bad", 0.41, "1", "gives back 59 % <of it>", "Condition it.", "force", "sensor 1_force.csv"),
)


def _judged(posterior: Posterior) -> Posterior:
    first, *others = posterior.sweeps
    return replace(posterior, sweeps=(replace(first, verdicts=VERDICTS), *others))


@pytest.mark.usefixtures("no_pictures")
def test_the_quality_of_the_lab_data_is_a_table_with_the_worst_first(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...]
) -> None:
    page = write_report(_judged(make_posterior()), predictions)
    text = _text(page)
    assert "3 checks: 1 bad (hysteresis, force, of sensor 1_force.csv), 1 warning, 1 good." in text
    part = text[text.index("level check number finding advice") :]
    assert (
        part.index("sensor 1: sensor 1_force.csv")
        < part.index("✗ bad hysteresis, force 41 % gives back 59 % &lt;of it&gt;. Condition it.")
        < part.index("! warning load zero, force -6.1 N the force before contact is -6.1 N. Balance it.")
        < part.index("✓ good readings in contact, force: 240 readings")
    )
    assert 'href="#quality"' in page


@pytest.mark.usefixtures("no_pictures")
def test_a_run_without_verdicts_has_no_table_of_them(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...]
) -> None:
    assert "Quality of the lab data" not in write_report(make_posterior(), predictions)


def test_summary_json_carries_the_verdicts_in_si(make_posterior: MakePosterior) -> None:
    quality = json.loads(summary_json(_judged(make_posterior())))["data_quality"]
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


@pytest.mark.usefixtures("no_pictures")
def test_a_recommendation_from_another_posterior_is_marked_as_old(
    make_posterior: MakePosterior, predictions: tuple[Prediction, ...], recommendation: Recommendation
) -> None:
    page = write_report(make_posterior(n_specimen=1), predictions[:1], recommendation, posterior_sha256="bb")
    assert "made from an earlier posterior" in _text(page)


@pytest.mark.usefixtures("no_pictures")
def test_names_from_the_experiment_file_are_escaped(make_posterior: MakePosterior, predictions: tuple[Prediction, ...]) -> None:
    posterior = make_posterior(n_specimen=1)
    evil = replace(posterior, experiment=replace(posterior.experiment, name="<b>5 < 6 & 7</b>"))
    assert "<h1>&lt;b&gt;5 &lt; 6 &amp; 7&lt;/b&gt;</h1>" in write_report(evil, predictions[:1])


def test_pictures_are_the_same_every_time(predictions: tuple[Prediction, ...]) -> None:
    first, again = (figure_address(figures.force_figure(predictions[0])) for _ in range(2))
    assert first == again


def test_figures_leave_the_settings_of_matplotlib_alone(predictions: tuple[Prediction, ...]) -> None:
    before = dict(mpl.rcParams)
    figures.capacitance_figure(predictions[1])
    assert dict(mpl.rcParams) == before


def test_figures_refuse_a_channel_that_is_not_there(predictions: tuple[Prediction, ...]) -> None:
    with pytest.raises(ValueError, match="sensor 1 has no force readings"):
        figures.force_figure(replace(predictions[0], channels={}))
    with pytest.raises(ValueError, match="sensor 1 has no capacitance readings"):
        figures.capacitance_figure(replace(predictions[0], channels={}))


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
    page = write_report(
        alone,
        predict(alone, FORWARD, np.random.default_rng(1), n_draw=60),
        recommend(alone, FORWARD, Requirement(5.0, 0.0, 4e-3, n_thickness=5, n_draw=60), seed=1),
    )
    assert "force resolution not known" in _text(page)


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
    assert rows["relative_permittivity"].verdict == "prior-driven"


def test_summary_json_has_the_documented_layout(make_posterior: MakePosterior) -> None:
    summary = json.loads(summary_json(make_posterior(converged=False)))
    assert summary["converged"] is False
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


def test_summary_json_writes_null_for_what_is_not_known(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    d = posterior.diagnostics
    lost = {**d.parameters, "young_modulus": replace(d.parameters["young_modulus"], r_hat=float("nan"))}
    summary = json.loads(summary_json(replace(posterior, diagnostics=replace(d, parameters=lost))))
    assert summary["parameters"]["young_modulus"]["r_hat"] is None


def test_summary_csv_has_one_line_per_parameter(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    rows = list(csv.DictReader(io.StringIO(summary_csv(posterior))))
    assert [r["parameter"] for r in rows] == [p.name for p in posterior.parameters]
    assert float(rows[0]["interval_90_low"]) < float(rows[0]["mean"]) < float(rows[0]["interval_90_high"])

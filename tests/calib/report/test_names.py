"""Names of others in figures, pages and tables: shown as they are written, whatever they would mean to what draws them."""

from __future__ import annotations

import csv
import html
import io
import json
import logging
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calib.checks.predictive import predict
from calib.checks.verdict import Verdict
from calib.decision.padding import recommend
from calib.decision.requirement import Requirement
from calib.lab.instruments import read_lab_file
from calib.lab.observations import observe
from calib.lab.quality.grade import Grade
from calib.report import file_figure, report_page, summary_csv, summary_json, write_figure
from calib.report.figures.posterior import trace_figure
from calib.report.figures.predictive import change_figure
from calib.report.pictures import figure_address
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm

FORWARD = ClosedForm(force_error=0.002, capacitance_error=0.005)

#: Formulas, formats, pages, templates, quotes, letters that the font lacks, writing from the right, marks before and after.
NAMES = (
    r"a $x^$ b $\frac{$",
    r"%s %d %(x)s \n \alpha \\",
    "<script>alert(1)</script> & &amp;",
    "{{ 7 * 7 }} {% raw %} {#",
    "emoji 😀🏳️‍🌈 日本語",
    "\"double\" 'single' `back`",
    "_first; of = all #",
    "שלום العربية e\u0301",
    "$",
    "x" * 100,
)


def _renamed(posterior: Posterior, new: dict[str, str], experiment: str) -> Posterior:
    """The same posterior with other names of its specimens, their files and the experiment."""
    parameters = tuple(
        replace(p, key=replace(p.key, specimen=new.get(p.specimen, ""))) if p.specimen else p for p in posterior.parameters
    )
    names = {old.name: p.name for old, p in zip(posterior.parameters, parameters, strict=True)}
    d = posterior.diagnostics
    return replace(
        posterior,
        experiment=replace(
            posterior.experiment,
            name=experiment,
            specimens=tuple(replace(s, name=new[s.name]) for s in posterior.experiment.specimens),
        ),
        sweeps=tuple(
            replace(
                s,
                specimen=new[s.specimen],
                files=tuple((f"{new[s.specimen]}.csv", digest) for _, digest in s.files),
                grades=(Grade("signal", "warning", 3.0, "times", f"{experiment} found", "Do", "force", new[s.specimen]),),
            )
            for s in posterior.sweeps
        ),
        parameters=parameters,
        diagnostics=replace(
            d,
            parameters={names[name]: summary for name, summary in d.parameters.items()},
            tau={names[name]: tau for name, tau in d.tau.items()},
            warnings=(*d.warnings, experiment),
        ),
        blocks=tuple(b.replace("sensor 1", new["sensor 1"]).replace("sensor 2", new["sensor 2"]) for b in posterior.blocks),
        attrs={**posterior.attrs, "command": f"calib calibrate '{experiment}'"},
    )


@pytest.fixture(autouse=True)
def silent(caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]) -> object:
    """What is drawn says nothing to the user; warnings of Python are errors in all tests."""
    caplog.set_level(logging.WARNING)
    yield
    assert caplog.records == []
    assert "".join(capfd.readouterr()) == ""


def test_page_tables_and_figures_show_names_as_they_are_written(make_posterior: Callable[..., Posterior]) -> None:
    first, second, experiment = NAMES[0], NAMES[4], NAMES[2]
    posterior = _renamed(make_posterior(), {"sensor 1": first, "sensor 2": second}, experiment)
    found = recommend(posterior, FORWARD, Requirement(8.0, 0.0, 4e-3, n_thickness=7, n_draw=50), seed=1)
    page = report_page(posterior, predict(posterior, FORWARD, np.random.default_rng(1), n_draw=50), found)
    assert "<script" not in page
    assert html.unescape(re.sub(r"<[^>]*>", "", page)).count(first) > 3
    assert f"<title>Calibration report: {html.escape(experiment)}" in page.replace("&#34;", "&quot;")


@pytest.mark.parametrize("names", list(zip(NAMES[::2], NAMES[1::2], strict=True)))
def test_every_name_can_be_drawn_and_listed(make_posterior: Callable[..., Posterior], names: tuple[str, str]) -> None:
    posterior = _renamed(make_posterior(), dict(zip(("sensor 1", "sensor 2"), names, strict=True)), names[0])
    thickness = [f"sensor_thickness[{name}]" for name in names]
    figures = [
        change_figure(predict(posterior, FORWARD, np.random.default_rng(1), n_draw=50)),
        trace_figure(posterior, thickness),
    ]
    assert all(figure_address(figure).startswith("data:image/svg") for figure in figures)
    assert {*thickness} <= {*json.loads(summary_json(posterior, Verdict()))["parameters"]}
    assert {*thickness} <= {row[0] for row in csv.reader(io.StringIO(summary_csv(posterior)))}


@pytest.mark.parametrize("name", [n for n in NAMES if "/" not in n])
def test_every_name_of_a_file_can_be_drawn(tmp_path: Path, name: str) -> None:
    path = tmp_path / f"{name}.csv"
    rows = "".join(f"{0.004 * i:.4f},{0.02 * i**1.5 + 0.003 * np.sin(37.0 * i):.5f}\n" for i in range(120))
    path.write_text(f"Displacement (mm),Force (N)\n{rows}", encoding="utf-8")
    figure = file_figure(observe(read_lab_file(path)))
    write_figure(figure, tmp_path / "figure.pdf")
    assert figure_address(figure, vector=False).startswith("data:image/png")
    assert name[:40] in figure.get_suptitle()

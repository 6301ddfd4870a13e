"""What is to be cited is what CITATION.cff has, on the screen and in the report."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

from typer.testing import CliRunner

from calib.citation import AUTHORS, PAPER, TITLE, YEAR, bibtex, citation
from calib.cli import app
from calib.provenance import PROGRAM
from calib.report.sections.run import run_facts
from calib.sampling.posterior import Posterior

CFF = (Path(__file__).parents[2] / "CITATION.cff").read_text(encoding="utf-8")


def _said(key: str) -> list[str]:
    return [value.strip('"') for value in re.findall(rf"^ *(?:- )?{key}: (.*)$", CFF, re.M)]


def test_the_citation_is_that_of_the_file() -> None:
    software, paper = _said("title")
    assert (software, AUTHORS, str(YEAR)) == (TITLE, _said("name")[0], _said("date-released")[0][:4])
    assert _said("version") == [version(PROGRAM)]
    names = _said("family-names")
    assert PAPER.startswith(", ".join(names))
    assert all(part in PAPER for part in (paper, *_said("collection-title")[0].split(", SPIE"), _said("year")[0]))
    for part in (software, paper, " and ".join(names), AUTHORS):
        assert part in bibtex("1.2.3")


def test_command_and_report_say_it(make_posterior: Callable[..., Posterior]) -> None:
    result = CliRunner().invoke(app, ["cite"])
    assert result.exit_code == 0
    assert result.stdout.splitlines()[:2] == [citation(version(PROGRAM)), PAPER]
    assert bibtex(version(PROGRAM)).rstrip() in result.stdout
    posterior = make_posterior()
    assert "to cite" not in dict(run_facts(posterior))
    made = replace(posterior, attrs={**posterior.attrs, f"version of {PROGRAM}": "0.0.7"})
    assert dict(run_facts(made))["to cite"] == f"{citation('0.0.7')}. Sensor model: {PAPER}"

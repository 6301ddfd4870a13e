"""What to measure next on the page of a run: what was asked of its posterior, else of its modulus; nothing of a red one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from calib.checks import Verdict
from calib.decision import next_measurements, next_to_json
from calib.experiment import Bench
from calib.runs.folder import Run
from calib.runs.page import next_steps_of
from calib.sampling import Posterior
from models.analytic import ClosedForm

FORWARD = ClosedForm(force_error=0.002, capacitance_error=0.005)


@pytest.fixture(scope="module")
def posterior(make_posterior: Callable[..., Posterior]) -> Posterior:
    """Of one specimen."""
    return make_posterior(n_specimen=1)


def _run(folder: Path, posterior: Posterior, sha256: str = "aa") -> Run:
    run = Run(folder, posterior, FORWARD, sha256)
    vars(run)["verdict"] = Verdict()  # as if it had been judged
    return run


def test_a_page_shows_the_first_three_for_the_modulus(tmp_path: Path, posterior: Posterior) -> None:
    found = next_steps_of(_run(tmp_path, posterior))
    assert found is not None
    assert (found.asked, found.why_not) == ("modulus", "")
    assert 1 <= len(found.first) <= 3
    rates = [one.per_hour for one in found.first]
    assert rates == sorted(rates, reverse=True)


def test_a_page_shows_what_was_asked_of_its_posterior_and_nothing_that_is_of_another_or_was_changed(
    tmp_path: Path, posterior: Posterior
) -> None:
    bench = Bench(balls=(3e-3,), paddings=(), without=frozenset({"repeat", "force", "specimen"}))
    asked = next_measurements(posterior, FORWARD, bench=bench, seed=1, verdict=Verdict())
    path = tmp_path / "next.json"
    path.write_text(next_to_json(asked), encoding="utf-8")
    assert next_steps_of(_run(tmp_path, posterior)) == asked.in_short
    assert next_steps_of(_run(tmp_path, posterior, "bb")) == asked.in_short  # another file of the same draws
    of_another = next_steps_of(_run(tmp_path, replace(posterior, draws=posterior.draws[:, :-1])))
    assert of_another is not None
    assert of_another != asked.in_short
    path.write_text(path.read_text(encoding="utf-8").replace("3 mm", "4 mm"), encoding="utf-8")
    assert next_steps_of(_run(tmp_path, posterior)) not in (None, asked.in_short)


def test_of_a_red_run_nothing_is_worked_out_and_of_one_of_many_unknowns_it_is_said_why(
    tmp_path: Path, posterior: Posterior
) -> None:
    run = Run(tmp_path, replace(posterior, diagnostics=replace(posterior.diagnostics, converged=False)), FORWARD, "aa")
    assert run.verdict.colour == "red"
    assert next_steps_of(run) is None
    many = _run(tmp_path, replace(posterior, parameters=posterior.parameters * 5))
    found = next_steps_of(many)
    assert found is not None
    assert "unknowns, and it would take a while" in found.why_not

"""Models of the same data compared: which predicts them better, when that cannot be told, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from calib.checks.comparison import compare_runs, comparison_in_words, doubts
from calib.checks.verdict import Verdict
from calib.cli import app
from calib.errors import InputError
from calib.runs.folder import Run
from calib.sampling.posterior import Posterior
from calib.sampling.storage import save_posterior
from models.analytic import ClosedForm

MakePosterior = Callable[..., Posterior]
FORWARD = ClosedForm(force_error=0.002, capacitance_error=0.005)


@pytest.fixture(scope="module")
def posterior(make_posterior: MakePosterior) -> Posterior:
    made = make_posterior(n_specimen=1)
    tame = np.mean(made.log_likelihood, axis=(0, 1)) + 0.05 * np.random.default_rng(1).normal(size=made.log_likelihood.shape)
    return replace(made, log_likelihood=tame)  # so that no block pulls it by itself


def worse(posterior: Posterior, by: float, seed: int = 0) -> Posterior:
    """The same, predicting each block worse, by so much on the average and with as large a scatter from block to block."""
    lost = by * (1 + np.random.default_rng(seed).normal(size=len(posterior.blocks)))
    return replace(posterior, log_likelihood=posterior.log_likelihood - lost)


def test_the_model_that_predicts_every_block_better_is_found(posterior: Posterior) -> None:
    n = len(posterior.blocks)
    best, second = compare_runs([("bad", worse(posterior, 5.0), FORWARD), ("good", posterior, FORWARD)])
    assert (best.name, second.name) == ("good", "bad")
    assert best.behind == best.error == 0
    lost = best.left_out.pointwise - second.left_out.pointwise
    assert second.behind == pytest.approx(best.left_out.elpd - second.left_out.elpd)
    assert second.error == pytest.approx(np.sqrt(n) * np.std(lost, ddof=1))
    assert "good" in comparison_in_words((best, second))
    assert "better than bad" in comparison_in_words((best, second))


def test_a_difference_within_its_error_decides_nothing(posterior: Posterior) -> None:
    assert "cannot tell" in comparison_in_words(
        compare_runs([("a", posterior, FORWARD), ("b", worse(posterior, 0.01), FORWARD)])
    )


def test_runs_of_other_data_are_refused(posterior: Posterior) -> None:
    sweep = posterior.sweeps[0]
    force = sweep.channels["force"]
    moved = replace(sweep, channels={**sweep.channels, "force": replace(force, value=force.value + 0.1)})
    for other in (replace(posterior, sweeps=(moved,)), replace(posterior, sweeps=(replace(sweep, files=(("x", "y"),)),))):
        with pytest.raises(InputError, match="b and a are of different data"):
            compare_runs([("a", posterior, FORWARD), ("b", other, FORWARD)])


def test_what_has_not_converged_is_said(posterior: Posterior) -> None:
    unfinished = replace(posterior, diagnostics=replace(posterior.diagnostics, converged=False))
    assert "b has not converged" in doubts(compare_runs([("a", posterior, FORWARD), ("b", unfinished, FORWARD)]))


def test_a_model_that_is_off_by_more_than_it_states_is_said(posterior: Posterior, make_posterior: MakePosterior) -> None:
    found = doubts(compare_runs([("a", posterior, FORWARD), ("b", make_posterior(n_specimen=1, honest=False), FORWARD)]))
    assert "b has not converged" not in found
    assert any(doubt.startswith("b: at 12 loading curves") and "times the error it states" in doubt for doubt in found)


def test_the_command_prints_a_table_and_a_verdict(
    posterior: Posterior, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Run, "verdict", property(lambda run: Verdict()))  # no curves go with these draws
    stuck = replace(worse(posterior, 5.0), experiment=replace(posterior.experiment, stick=True))
    for name, p in (("neo", posterior), ("stick", stuck)):
        (tmp_path / name).mkdir()
        save_posterior(p, tmp_path / name / "posterior.nc")
    result = CliRunner().invoke(app, ["compare", str(tmp_path / "neo"), str(tmp_path / "stick")], env={"COLUMNS": "200"})
    trusted = not doubts(compare_runs([("neo", posterior, FORWARD), ("stick", stuck, FORWARD)]))
    assert result.exit_code == (0 if trusted else 3), result.output
    assert "neo-Hookean" in result.output
    assert "sticking" in result.output
    assert "predicts these data better" in " ".join(result.output.split())
    result = CliRunner().invoke(app, ["compare", str(tmp_path / "neo")])
    assert result.exit_code == 2
    assert "at least two" in result.output

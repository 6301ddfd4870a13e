"""The fingerprint of a run: the same inputs have the same one, and each input alone changes it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import calib.sampling.checkpoint as checkpoint
from calib.errors import InputError
from calib.priors.distributions import Normal
from calib.problem.problem import Problem, build_problem
from calib.sampling.checkpoint import fingerprint, open_checkpoint
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm
from models.fem import FiniteElements
from models.surrogate.surrogate import load_surrogate

MakePosterior = Callable[..., Posterior]


@pytest.fixture
def problem(make_posterior: MakePosterior) -> Problem:
    p = make_posterior()
    return build_problem(p.experiment, p.sweeps, ClosedForm())


def _mark(problem: Problem) -> str:
    return fingerprint(problem, 1, 4, 64)


def test_the_same_inputs_have_the_same_fingerprint_wherever_their_files_lie(
    problem: Problem, make_posterior: MakePosterior
) -> None:
    p = make_posterior()
    moved = replace(p.experiment, path=Path("/elsewhere/e.toml"), name="renamed")
    assert _mark(build_problem(moved, p.sweeps, ClosedForm())) == _mark(problem)
    surrogates = [load_surrogate(), replace(load_surrogate(), provenance={"date": "another"})]
    assert len({_mark(replace(problem, forward=s)) for s in surrogates}) == 1


EXPERIMENT: dict[str, Any] = {
    "law": "gent",
    "stick": True,
    "padding_material": "own",
    "sensor_radius": 11e-3,
    "discrepancy": "off",
}


@pytest.mark.parametrize("name", EXPERIMENT)
def test_what_the_experiment_says_changes_the_fingerprint(problem: Problem, name: str) -> None:
    changed = replace(problem.experiment, **{name: EXPERIMENT[name]})
    assert _mark(replace(problem, experiment=changed)) != _mark(problem)


def test_the_forward_models_content_changes_the_fingerprint(problem: Problem) -> None:
    surrogate = load_surrogate()
    forwards = (
        ClosedForm(),
        ClosedForm(force_error=0.05),
        FiniteElements(),
        FiniteElements(5e-4),
        surrogate,
        replace(surrogate, force_modes=1.001 * surrogate.force_modes),
    )
    assert len({_mark(replace(problem, forward=f)) for f in forwards}) == len(forwards)


def test_data_priors_and_fixed_values_change_the_fingerprint(problem: Problem) -> None:
    first, *rest = problem.sweeps
    force = np.array(first.channels["force"].value)
    force[3] = np.nextafter(force[3], 1.0)
    moved = {**first.channels, "force": replace(first.channels["force"], value=force)}
    sweeps = (replace(first, channels=moved), *rest)
    prior = replace(problem.parameters[1], prior=Normal(2.8, 0.21))
    changed = (
        replace(problem, sweeps=sweeps),
        replace(problem, parameters=(problem.parameters[0], prior, *problem.parameters[2:])),
        replace(problem, fixed={**problem.fixed, "electrode_radius": 9e-3}),
    )
    assert len({_mark(p) for p in (problem, *changed)}) == 4


def test_seed_ensembles_and_walkers_change_the_fingerprint(problem: Problem) -> None:
    marks = {fingerprint(problem, *run) for run in ((1, 4, 64), (2, 4, 64), (1, 5, 64), (1, 4, 66))}
    assert len(marks) == 4


@pytest.mark.parametrize(("name", "value"), [("LIKELIHOOD_VERSION", 99), ("_BASE", "slippery"), ("_FORMAT", 99), ("MOVES", ())])
def test_what_the_program_does_changes_the_fingerprint(
    problem: Problem, monkeypatch: pytest.MonkeyPatch, name: str, value: object
) -> None:
    before = _mark(problem)
    monkeypatch.setattr(checkpoint, name, value)
    assert _mark(problem) != before


def test_another_version_of_the_sampler_changes_the_fingerprint(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    before = _mark(problem)
    monkeypatch.setattr(checkpoint, "version", lambda package: version(package) + ".post1")
    assert _mark(problem) != before


def test_a_checkpoint_of_another_run_or_version_is_refused(tmp_path: Path) -> None:
    open_checkpoint(tmp_path, "ab", resume=False)
    open_checkpoint(tmp_path, "ab", resume=True)
    manifest = tmp_path / "manifest.json"
    assert json.loads(manifest.read_text()) == {"kind": "checkpoint", "format": 2, "fingerprint": "ab"}
    with pytest.raises(InputError, match="of another run"):
        open_checkpoint(tmp_path, "cd", resume=True)
    for text in ('{"fingerprint": "ab", "format": 1}', "[]", '{"kind": "checkpoint", "format": 1, "fingerprint": "ab"}', "{"):
        manifest.write_text(text)
        with pytest.raises(InputError, match="of another run"):
            open_checkpoint(tmp_path, "ab", resume=True)

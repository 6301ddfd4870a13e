"""How far a run is stands in its folder while it goes on, and nothing of it when it has ended."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from small_run import QUICK, quick

from calib.runs import run_state
from calib.runs.progress import PROGRESS, Teller, telling
from calib.sampling import BLOCK_STEPS, Posterior, Progress

BEGUN = Progress("sampling", 50, 200, 30.0, 50, 5.0, 100, float("nan"), "", 0.0, "", 400.0, 20_000)


def test_a_run_is_none_then_running_then_finished_or_stopped(lab: Path) -> None:
    seen = []
    folder = lab / "run"
    assert run_state(folder).condition == "none"

    def look(*given: Any, **options: Any) -> Posterior:
        seen.append(run_state(folder))
        made = QUICK.sample(*given, **options)
        seen.append(run_state(folder))
        return made

    quick(lab, stages=replace(QUICK, sample=look))
    assert [state.condition for state in seen] == ["running", "running"]
    assert "process" in seen[0].owner
    assert seen[0].last is not None
    assert [row[0] for row in seen[0].last.first] == ["young_modulus"]
    assert seen[1].last is not None
    assert seen[1].last.stage == "block likelihoods"
    assert seen[1].last.looks[-1].steps == 10
    state = run_state(folder)
    assert (state.condition, state.last, state.command) == ("finished", None, "calib calibrate")
    assert not list(folder.rglob(".*"))
    (folder / "posterior.nc").unlink()
    assert run_state(folder).condition == "stopped"
    assert run_state(folder).steps == BLOCK_STEPS  # a whole block of each ensemble, as its name says


def test_a_look_is_told_once_and_all_of_them_are_kept(tmp_path: Path) -> None:
    first, second = replace(BEGUN, r_hat=1.2, ess=40.0), replace(BEGUN, r_hat=1.1, ess=90.0, steps=100)
    with telling(tmp_path) as teller:
        for told in (BEGUN, first, first, second):
            teller.sampling(told)
        found = json.loads((tmp_path / PROGRESS).read_text())
        assert [look["r_hat"] for look in found["looks"]] == [1.2, 1.1]
        state = run_state(tmp_path)
        assert state.last == teller.last
    assert not (tmp_path / PROGRESS).exists()


def test_a_run_that_is_gone_on_with_keeps_what_is_wanted_and_whose_it_is_while_it_starts(tmp_path: Path) -> None:
    with telling(tmp_path) as teller:
        teller.sampling(replace(BEGUN, r_hat=1.2, r_hat_parameter="young_modulus", ess=40.0, ess_parameter="load_zero"))
        teller.sampling(replace(BEGUN, stage="start", done=7, wanted=8, target=0.0))
        last = run_state(tmp_path).last
    assert last is not None
    assert (last.stage, last.target, last.r_hat_parameter, last.ess_parameter) == ("start", 400.0, "young_modulus", "load_zero")


def test_what_is_wanted_of_draws_is_told_after_sampling_too(tmp_path: Path) -> None:
    with telling(tmp_path) as teller:
        teller.sampling(replace(BEGUN, r_hat=1.2, r_hat_parameter="young_modulus", ess=40.0, ess_parameter="force_noise"))
        teller.stage("spot check")
        last = run_state(tmp_path).last
    assert last is not None
    assert (last.stage, last.target, last.r_hat_parameter, last.ess_parameter) == (
        *("spot check", 400.0, "young_modulus", "force_noise"),
    )
    assert (last.done, last.wanted, last.seconds_left) == (0, 0, None)


def test_that_it_cannot_be_told_is_no_reason_not_to_calibrate(tmp_path: Path) -> None:
    Teller(tmp_path / "nowhere").sampling(BEGUN)


@pytest.mark.parametrize("text", ["", "{", "[]", '{"looks": 1}', '{"looks": [], "first": [], "stage": "x", "more": 1}'])
def test_a_damaged_file_tells_nothing(tmp_path: Path, text: str) -> None:
    (tmp_path / PROGRESS).write_text(text)
    assert run_state(tmp_path).last is None


def test_what_a_killed_process_told_is_gone_once_another_goes_on(tmp_path: Path) -> None:
    Teller(tmp_path).sampling(replace(BEGUN, r_hat=1.2, ess=40.0))
    assert run_state(tmp_path).last is not None
    with telling(tmp_path):
        assert run_state(tmp_path).last is None

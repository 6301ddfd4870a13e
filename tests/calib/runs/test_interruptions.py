"""A calibration that is ended before any of its operations on files can be gone on with, or started anew, to the same draws."""

from __future__ import annotations

import errno
import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_run import DONE, KILLED, QUICK, REFUSED, at_operation, in_a_process, quick

from calib.errors import InputError
from calib.runs import load_run, verify
from calib.runs.calibration import Stages
from calib.sampling import FINGERPRINT
from calib.sampling.posterior import Posterior

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked here")

#: Operations of one calibration that are tried here, of about 35: while it begins, and later.
EARLY, SOME = (1, 2, 3, 5, 7), (13, 21, 30)


def _blocks(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.glob("checkpoint/ensemble-*")}


def _die() -> None:
    os._exit(KILLED)


def _no_room() -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _ended_at(number: int, lab: Path, act: Callable[[], None], stages: Stages = QUICK) -> int:
    def work() -> None:
        at_operation(number, lab / "run", act)
        quick(lab, seed=4, stages=stages)

    return in_a_process(work)


def _goes_on(lab: Path) -> None:
    """The same command leads on, or the same with --resume where the first one says so."""
    try:
        quick(lab, seed=4)
    except InputError as error:
        if "--resume" not in str(error):
            raise
        quick(lab, resume=True)


def shows_that_it_goes_on(lab: Path, reference: dict[str, bytes]) -> None:
    """Go on with a run that was ended; its draws are those of one that was not."""
    if (lab / "run").exists():
        verify_tells_the_truth(lab / "run")
    assert in_a_process(lambda: _goes_on(lab)) == DONE
    found = _blocks(lab / "run")
    both = found.keys() & reference.keys()
    assert len(both) >= 8
    assert all(found[name] == reference[name] for name in both)
    assert {finding.state for finding in verify(lab / "run")} == {"fine"}
    assert not list((lab / "run").rglob(".*"))
    run = load_run(lab / "run")
    assert run.posterior.seed == 4
    assert run.posterior.attrs[FINGERPRINT] == json.loads((lab / "run" / "run.json").read_text())["fingerprint"]


def verify_tells_the_truth(folder: Path) -> None:
    """Nothing is called changed, and fine only what a command wrote to its end."""
    if not any(path.suffix for path in folder.glob("[!.]*")):
        with pytest.raises(InputError, match="there is no run in this folder"):
            verify(folder)
        return
    findings = verify(folder)
    assert not [f for f in findings if f.state == "changed"]
    assert [f for f in findings if f.state != "fine"]


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Blocks of a calibration that nobody interrupts, more of them than any of the others makes."""
    from small_run import make_lab

    lab = make_lab(tmp_path_factory.mktemp("reference"))
    quick(lab, seed=4)
    quick(lab, resume=True)
    return _blocks(lab / "run")


@pytest.mark.parametrize("number", [*EARLY, *SOME])
def test_a_calibration_that_is_killed_goes_on_to_the_same_draws(lab: Path, reference: dict[str, bytes], number: int) -> None:
    assert _ended_at(number, lab, _die) == KILLED
    shows_that_it_goes_on(lab, reference)


@pytest.mark.parametrize("number", [1, 2, 4, 5, 7, 21])
def test_a_calibration_that_finds_the_disk_full_goes_on_to_the_same_draws(
    lab: Path, reference: dict[str, bytes], number: int
) -> None:
    assert _ended_at(number, lab, _no_room) != DONE  # without a file of its progress, as at others, it does
    shows_that_it_goes_on(lab, reference)


def test_bad_input_found_as_sampling_begins_leaves_nothing_behind(lab: Path) -> None:
    def refused(*_: object, checkpoint: Path, **__: object) -> Posterior:
        checkpoint.mkdir()
        (checkpoint / "manifest.json").touch()
        raise InputError([])

    with pytest.raises(InputError):
        quick(lab, stages=Stages(sample=refused))
    assert not (lab / "run").exists()


def test_bad_input_found_later_keeps_what_was_sampled(lab: Path) -> None:
    def refused(*_: object, checkpoint: Path, **__: object) -> Posterior:
        checkpoint.mkdir()
        (checkpoint / "ensemble-0-start.npz").touch()
        raise InputError([])

    with pytest.raises(InputError):
        quick(lab, stages=Stages(sample=refused))
    assert (lab / "run" / "checkpoint" / "ensemble-0-start.npz").exists()
    assert (lab / "run" / "run.json").exists()


def test_an_empty_folder_may_become_a_run_and_a_folder_with_anything_else_may_not(
    lab: Path, make_posterior: Callable[..., Posterior]
) -> None:
    stages = replace(QUICK, sample=lambda *_, **__: make_posterior(n_specimen=1))
    (lab / "run").mkdir()
    quick(lab, stages=stages)
    for name in ("file", "folder/notes.txt"):
        (lab / name).parent.mkdir(exist_ok=True)
        (lab / name).touch()
        with pytest.raises(InputError, match="exists and is not overwritten"):
            quick(lab, name.split("/")[0], stages=stages)


def test_damaged_and_foreign_blocks_are_computed_again_to_the_same_draws(lab: Path, reference: dict[str, bytes]) -> None:
    quick(lab, seed=4)
    quick(lab, "other", seed=5)
    checkpoint = lab / "run" / "checkpoint"
    damaged = bytearray(reference["ensemble-1-00000.npz"])
    damaged[len(damaged) // 2] ^= 1
    (checkpoint / "ensemble-1-00000.npz").write_bytes(damaged)
    (checkpoint / "ensemble-0-00000.npz").write_bytes((lab / "other/checkpoint/ensemble-0-00000.npz").read_bytes())
    (checkpoint / "ensemble-2-start.npz").write_bytes(reference["ensemble-2-start.npz"][:-200])
    (checkpoint / "manifest.json").write_text("{")
    (lab / "run" / "run.json").write_text("{")
    (lab / "run" / "posterior.nc").write_bytes((lab / "other/posterior.nc").read_bytes())
    quick(lab, resume=True, seed=4)
    found = _blocks(lab / "run")
    assert all(found[name] == reference[name] for name in found.keys() & reference.keys())
    assert {finding.state for finding in verify(lab / "run")} == {"fine"}
    undamaged = lab / "undamaged"
    quick(lab, "undamaged", seed=4)
    quick(lab, "undamaged", resume=True)
    if len(_blocks(undamaged)) == len(found):
        np.testing.assert_array_equal(load_run(undamaged).posterior.draws, load_run(lab / "run").posterior.draws)


def test_without_run_json_and_manifest_the_seed_must_be_said(lab: Path) -> None:
    quick(lab, seed=4)
    for name in ("run.json", "checkpoint/manifest.json"):
        (lab / "run" / name).write_text("{")
    assert in_a_process(lambda: quick(lab, resume=True)) == REFUSED
    assert in_a_process(lambda: quick(lab, resume=True, seed=5)) == REFUSED
    assert in_a_process(lambda: quick(lab, resume=True, seed=4)) == DONE

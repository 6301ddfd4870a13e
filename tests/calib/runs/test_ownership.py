"""A run folder has one owner at a time, however its owners end."""

from __future__ import annotations

import errno
import fcntl
import os
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from small_run import DONE, QUICK, REFUSED, begin, end, in_a_process, make_lab, quick

from calib.errors import InputError
from calib.runs import load_run
from calib.runs.ownership import is_bare, owned, owner_of
from calib.sampling.posterior import Posterior

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked here")


@pytest.fixture(scope="module")
def rehearsed(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Processes that are forked of this one find loaded what a calibration needs, and the start of the usual ensembles."""
    quick(make_lab(tmp_path_factory.mktemp("rehearsed")), seed=5)


def _own(folder: Path, command: str = "another") -> None:
    with owned(folder, command):
        pass


def test_a_second_owner_is_refused_and_told_who_the_first_is(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with owned(folder, "calib calibrate e.toml -o run"):
        said = rf"in use by process {os.getpid()} on .* since 2.* \(calib calibrate e\.toml -o run\)"
        with pytest.raises(InputError, match=said):
            _own(folder)
        assert in_a_process(lambda: _own(folder)) == REFUSED
        assert "calib calibrate e.toml" in owner_of(folder)
        (folder / "kept").touch()
    assert owner_of(folder) == ""
    assert [p.name for p in folder.iterdir()] == ["kept"]
    assert in_a_process(lambda: _own(folder)) == DONE


def test_a_disk_without_locks_is_refused_and_left_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "lockf", none)
    monkeypatch.setattr(fcntl, "flock", none)
    with pytest.raises(InputError, match="its file system cannot lock files"):
        _own(tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_said_of_the_lock_file_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(OSError, match=r"No space left on device: '.*run.*lock"):
        _own(tmp_path / "run")
    assert list(tmp_path.iterdir()) == []


def test_a_lock_ends_with_its_process_and_what_it_left_is_removed(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    read, write = os.pipe()

    def hold() -> None:
        with owned(folder, "to be killed"):
            (folder / ".posterior.0badcafe.part.nc").touch()
            os.write(write, b"x")
            time.sleep(60)

    pid = begin(hold)
    os.read(read, 1)
    with pytest.raises(InputError, match=f"process {pid} on"):
        _own(folder)
    os.kill(pid, signal.SIGKILL)
    assert end(pid) == -signal.SIGKILL
    assert owner_of(folder) == ""
    assert {p.name for p in folder.iterdir()} == {".lock", ".posterior.0badcafe.part.nc"}
    with owned(folder, "next"):
        assert [p.name for p in folder.iterdir()] == [".lock"]
    assert not folder.exists()


def test_what_a_killed_owner_left_among_the_checkpoints_is_removed_by_any_next_one(tmp_path: Path) -> None:
    folder, elsewhere = tmp_path / "run", tmp_path / "elsewhere"
    for place in (folder / "checkpoint", elsewhere):
        place.mkdir(parents=True)
        (place / ".ensemble-0-00000.0badcafe.part.npz").touch()
        (place / "ensemble-0-00000.npz").touch()
    (folder / "linked").symlink_to(elsewhere)
    with owned(folder, "report"):
        assert [path.name for path in (folder / "checkpoint").iterdir()] == ["ensemble-0-00000.npz"]
    assert len(list(elsewhere.iterdir())) == 2


def test_worker_processes_do_not_inherit_the_lock(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with owned(folder, "parent"):
        (descriptor,) = (int(d) for d in os.listdir("/proc/self/fd") if _leads_to(d, folder / ".lock"))
        assert not os.get_inheritable(descriptor)


def _leads_to(descriptor: str, path: Path) -> bool:
    try:
        return os.readlink(f"/proc/self/fd/{descriptor}") == str(path)
    except OSError:
        return False


def test_a_file_system_without_locks_is_refused_with_a_way_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def without(*_: object) -> None:
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(fcntl, "flock", without)
    with pytest.raises(InputError, match=r"cannot lock files \(Operation not supported\).* Keep runs on a disk"):
        _own(tmp_path)
    assert owner_of(tmp_path) == ""


def test_what_a_killed_begin_leaves_is_bare(tmp_path: Path) -> None:
    assert is_bare(tmp_path)
    (tmp_path / ".lock").touch()
    (tmp_path / ".run.0badcafe.part.json").touch()
    assert is_bare(tmp_path)
    (tmp_path / "notes.txt").touch()
    assert not is_bare(tmp_path)


@pytest.mark.usefixtures("rehearsed")
@pytest.mark.parametrize("pause", [0.0, 0.002, 0.01, 0.05, 0.3])
def test_of_two_starts_on_one_folder_one_is_refused(lab: Path, make_posterior: Callable[..., Posterior], pause: float) -> None:
    posterior = make_posterior(n_specimen=1)
    inside = lab / "inside"

    def alone(*_: object, **__: object) -> Posterior:
        inside.mkdir()  # fails if the other one is in there, too
        time.sleep(0.4)
        inside.rmdir()
        return posterior

    stages = replace(QUICK, sample=alone, page=lambda *_: "page")
    first = begin(lambda: quick(lab, seed=5, stages=stages))
    time.sleep(pause)
    second = begin(lambda: quick(lab, seed=6, stages=stages))
    assert sorted((end(first), end(second))) == [DONE, REFUSED]
    assert load_run(lab / "run").posterior.seed == posterior.seed
    assert in_a_process(lambda: quick(lab, resume=True, stages=stages)) == DONE


@pytest.mark.usefixtures("rehearsed")
def test_two_real_starts_give_the_draws_of_one_of_them(lab: Path) -> None:
    pids = [begin(partial(quick, lab, seed=seed)) for seed in (5, 6)]
    assert sorted(map(end, pids)) == [DONE, REFUSED]
    seed = load_run(lab / "run").posterior.seed
    quick(lab, "alone", seed=seed)
    found, alone = ({p.name: p.read_bytes() for p in (lab / name / "checkpoint").iterdir()} for name in ("run", "alone"))
    assert found == alone

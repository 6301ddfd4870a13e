"""Stopping a command: at whatever it is, it ends at once, without a traceback, keeps what it has and says how to go on."""

from __future__ import annotations

import io
import os
import shlex
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from threading import Timer
from typing import TextIO

import pytest
import stays
from small_run import make_lab, quick

from calib.cli.calibrate import _resuming
from calib.runs import load_run, verify

ROOT = Path(__file__).parents[3]

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals as POSIX has them")

DESIGN = """
indenter.radius = "5 mm"
sensor.thickness = "0.74 mm"
sensor.radius = "10 mm"
sensor.young_modulus = "0.69 MPa"
sensor.relative_permittivity = 2.8
padding.thickness = "1.1 mm"
"""

BEGIN = ("calibrate", "experiment.toml", "-o", "my run", "--seed", "7")


@pytest.fixture(scope="module", autouse=True)
def climbed(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Commands that are forked of this process find the modes climbed to."""
    quick(make_lab(tmp_path_factory.mktemp("climbed")), seed=7)


@dataclass(frozen=True)
class _Command:
    """A command on its way: its process, the leader of a group of its own, and what it writes."""

    pid: int
    stdout: TextIO
    stderr: TextIO

    def end(self) -> tuple[int, str]:
        """Wait until it ends: exit code, and what it said on stderr."""
        with self.stdout, self.stderr:
            said = self.stderr.read()
            return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1]), said


def _begun(folder: Path, stage: str, words: tuple[str, ...], processes: int, fresh: bool = False) -> _Command:
    """A command on its way to a stage; forked of this process, which has loaded all that it needs, if not fresh."""
    if not (folder / "experiment.toml").exists():
        make_lab(folder)
    outputs = [os.pipe(), os.pipe()]
    readers = [io.TextIOWrapper(io.FileIO(read), "utf-8") for read, _ in outputs]
    pid = os.fork()
    if pid == 0:
        os.setsid()
        os.chdir(folder)
        for number, (_, write) in enumerate(outputs, start=1):
            os.dup2(write, number)
        os.environ |= {"PYTHONPATH": str(ROOT), "PROCESSES": str(processes)}
        if fresh:
            os.execv(sys.executable, [sys.executable, stays.__file__, stage, *words])
        stays.run_forked(stage, words)
    for _, write in outputs:
        os.close(write)
    return _Command(pid, *readers)


def _stopped(
    folder: Path,
    stage: str,
    signals: tuple[signal.Signals, ...] = (signal.SIGINT,),
    processes: int = 1,
    words: tuple[str, ...] = BEGIN,
    fresh: bool = False,
) -> tuple[int, str, float]:
    """Stop a command in a stage: exit code, what it said on stderr, and the seconds that it took to end."""
    command = _begun(folder, stage, words, processes, fresh)
    if command.stdout.readline() != "there\n":
        raise AssertionError(command.end()[1])
    begin = time.monotonic()
    for signum in signals:
        os.killpg(command.pid, signum)
        time.sleep(0.05)
    watchdog = Timer(60, os.killpg, (command.pid, signal.SIGKILL))
    watchdog.start()
    try:
        code, said = command.end()
    finally:
        watchdog.cancel()
    return code, _without_first_answer(said), time.monotonic() - begin


def _without_first_answer(said: str) -> str:
    lines = said.splitlines(keepends=True)
    return "".join(
        line for line in lines if not line.startswith("First answer, not the result") and "(first answer)" not in line
    )


@pytest.mark.parametrize(
    ("stage", "processes", "fresh"),
    [
        ("reading", 1, False),
        ("sampling", 1, True),
        ("sampling", 0, False),
        ("block likelihoods", 0, False),
        ("spot check", 1, False),
        ("writing", 1, False),
        ("saving", 1, False),
        ("the report", 0, False),
    ],
)
def test_ctrl_c_ends_every_stage_at_once_and_says_how_to_go_on(tmp_path: Path, stage: str, processes: int, fresh: bool) -> None:
    code, said, seconds = _stopped(tmp_path, stage, processes=processes, fresh=fresh)
    assert code == 130
    assert seconds < 2
    if stage == "reading":
        assert said == "Stopped before anything was begun.\n"
        assert not (tmp_path / "my run").exists()
    else:
        assert said == 'Stopped. Continue with: calib calibrate experiment.toml -o "my run" --resume --seed 7\n'
        assert (tmp_path / "my run" / "run.json").is_file()


@pytest.mark.parametrize("processes", [0, 2])
def test_ctrl_c_in_the_reweighting_leaves_a_finished_run_without_it(tmp_path: Path, processes: int) -> None:
    words = (*BEGIN, "--reweight", "30", "--processes", str(processes))
    code, said, seconds = _stopped(tmp_path, "re-weighting", words=words)
    assert code == 130
    assert seconds < 2
    again = f'calib calibrate experiment.toml -o "my run" --resume --seed 7 --processes {processes} --reweight 30'
    assert said == f"Re-weighting was stopped; all else is written. Do it with: {again}\n"
    assert {finding.state for finding in verify(tmp_path / "my run")} == {"fine"}
    assert load_run(tmp_path / "my run").posterior.diagnostics.reweighting is None
    assert (tmp_path / "my run" / "report.html").read_text() == "a page"


def test_ctrl_c_ends_what_is_computed_of_a_run_and_leaves_it_as_it_was(tmp_path: Path) -> None:
    assert _begun(tmp_path, "nothing", BEGIN, 0).end()[0] == 3
    before = {path: path.read_bytes() for path in (tmp_path / "my run").rglob("*") if path.is_file()}
    code, said, seconds = _stopped(tmp_path, "recommending", words=("recommend", "my run", "--force", "2 N"))
    assert (code, said) == (130, "Stopped.\n")
    assert seconds < 2
    assert {path: path.read_bytes() for path in (tmp_path / "my run").rglob("*") if path.is_file()} == before


def test_ctrl_c_ends_the_finite_elements(tmp_path: Path) -> None:
    (tmp_path / "design.toml").write_text(DESIGN, encoding="utf-8")
    words = ("simulate", "design.toml", "--displacement", "0.5 mm", "--steps", "500", "--model", "fem", "-o", "curve.csv")
    code, said, seconds = _stopped(tmp_path, "simulating", words=words)
    assert (code, said) == (130, "Stopped.\n")
    assert seconds < 2
    assert not list(tmp_path.glob("*curve.csv*"))


@pytest.mark.parametrize(("signum", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_other_signals_end_it_too_with_their_exit_codes(tmp_path: Path, signum: signal.Signals, code: int) -> None:
    assert _stopped(tmp_path, "sampling", (signum,))[0] == code


def test_a_second_ctrl_c_changes_nothing_and_what_does_not_listen_is_ended(tmp_path: Path) -> None:
    code, said, seconds = _stopped(tmp_path, "something deaf", (signal.SIGINT, signal.SIGINT, signal.SIGTERM))
    assert code == 130
    assert said.startswith("Stopped. Continue with: ")
    assert said.count("\n") == 1
    assert seconds < 2


def test_a_signal_that_does_not_wake_the_main_thread_ends_its_wait_all_the_same(tmp_path: Path) -> None:
    code, said, seconds = _stopped(tmp_path, "a wait", ())
    assert code == 130
    assert said.startswith("Stopped. Continue with: ")
    assert seconds < 2


def test_ctrl_c_ends_a_command_whose_messages_nobody_reads(tmp_path: Path) -> None:
    command = _begun(tmp_path, "sampling", BEGIN, 0)
    assert command.stdout.readline() == "there\n"
    with open(f"/proc/{command.pid}/fd/2", "wb", buffering=0, opener=lambda p, f: os.open(p, f | os.O_NONBLOCK)) as full:
        while full.write(b"x" * 4096) is not None:
            pass
    begin = time.monotonic()
    watchdog = Timer(60, os.killpg, (command.pid, signal.SIGKILL))
    watchdog.start()
    os.killpg(command.pid, signal.SIGINT)
    code = os.waitstatus_to_exitcode(os.waitpid(command.pid, 0)[1])
    watchdog.cancel()
    assert code == 130
    assert time.monotonic() - begin < 3
    command.stdout.close()
    command.stderr.close()


def test_advice_is_a_command_of_the_options_that_matter() -> None:
    odd = Path("-a $x 'b'\n.toml")
    text = _resuming(odd, Path("my run"), {"--surrogate": Path("a b.npz"), "--seed": 3, "--budget": None})
    words = ["calib", "calibrate", f"./{odd}", "-o", "my run", "--resume", "--surrogate", "a b.npz", "--seed", "3"]
    assert shlex.split(text) == words

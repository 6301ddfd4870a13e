"""Stopping a command: at whatever it is, it ends at once, without a traceback, keeps what it has and says how to go on."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from calib.cli.calibrate import _resuming
from calib.runs import load_run, verify

ROOT = Path(__file__).parents[3]

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals as POSIX has them")

# Two unknowns that nothing fixes: sampling it takes a second.
EXPERIMENT = """
model = "closed form"
discrepancy = "off"
indenter.radius = "5 mm"
sensor.radius = "10 mm"
[priors]
young_modulus = { lognormal = ["0.7 MPa", 1.6] }
machine_compliance = { fixed = "0 um/N" }
force_noise = { fixed = "0.01 N" }
[[specimens]]
name = "sensor 1"
force = "force.csv"
[specimens.priors]
sensor_thickness = { fixed = "0.74 mm" }
padding_thickness = { fixed = "1.10 mm" }
"""

DESIGN = """
indenter.radius = "5 mm"
sensor.thickness = "0.74 mm"
sensor.radius = "10 mm"
sensor.young_modulus = "0.69 MPa"
sensor.relative_permittivity = 2.8
padding.thickness = "1.1 mm"
"""

# A command that stays for ever in one of its stages, and says on stdout when it is there.
COMMAND = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where the tests themselves run in the background
signal.signal(signal.SIGHUP, signal.SIG_DFL)
import math, os, sys, threading, time
import calib.runs.calibration as calibration
import calib.runs.folder as run_folder
import calib.sampling.assess as assess
from calib.cli import app
from calib.runs import Stages
from calib.sampling import Gate, sample
from calib.workers import workers

def stay(*args, **kwargs):
    print("there", flush=True)
    while True:
        time.sleep(0.01)

def deaf(*args, **kwargs):
    print("there", flush=True)
    while True:
        try:
            time.sleep(60)
        except BaseException:
            pass

def heard_by_another_thread(*args, **kwargs):
    # The handler is due in the main thread, which waits, and is not woken: as if the signal came just before it began to.
    other = threading.Thread(target=time.sleep, args=(600,), daemon=True)
    other.start()
    threading.Timer(0.2, signal.pthread_kill, (other.ident, signal.SIGINT)).start()
    print("there", flush=True)
    threading.Event().wait()

def with_workers(*args, **kwargs):
    with workers(int(os.environ["PROCESSES"])) as executor:
        executor.submit(os.getpid).result()
        waiting(None, None, 0, executor)

def waiting(posterior, forward, n_draw, executor, **kwargs):
    running = [executor.submit(time.sleep, 600) for _ in range(3)]
    print("there", flush=True)
    running[0].result()

def brief(problem, **options):
    return sample(problem, **{**options, "max_steps": 50, "max_seconds": math.inf, "processes": 0, "gate": Gate(ess=1e9)})

def in_the_elements():
    from models.fem import FiniteElements
    solve = FiniteElements.solve
    def solved(*args, **kwargs):
        print("there", flush=True)
        return solve(*args, **kwargs)
    FiniteElements.solve = solved

if __name__ == "__main__":
    stage, *words = sys.argv[1:]
    stages = {"spot_check": lambda posterior, _: posterior, "page": lambda *args: "a page"}
    if stage == "reading":
        calibration.read_sweeps = stay
    elif stage == "writing":
        stages["sample"] = lambda *args, **kwargs: None
        calibration.write_run = stay
    elif stage == "saving":
        stages["sample"] = lambda *args, **kwargs: None
        run_folder.save_posterior = stay
    elif stage == "spot check":
        stages |= {"sample": lambda *args, **kwargs: None, "spot_check": stay}
    elif stage == "block likelihoods":
        assess.log_likelihood_blocks = stay
        stages["sample"] = brief
    elif stage == "re-weighting":
        stages |= {"sample": brief, "reweight": waiting}
    elif stage == "the report":
        stages |= {"sample": brief, "page": stay}
    elif stage == "simulating":
        in_the_elements()
    elif stage == "recommending":
        run_folder.recommend = stay
    else:
        stages["sample"] = {
            "sampling": with_workers,
            "something deaf": deaf,
            "a wait": heard_by_another_thread,
            "nothing": brief,
        }[stage]
    app(words, obj=Stages(**stages))
"""

BEGIN = ("calibrate", "experiment.toml", "-o", "my run", "--seed", "7")


def _begun(folder: Path, stage: str, words: tuple[str, ...], processes: int) -> subprocess.Popen[str]:
    """A command on its way to a stage."""
    (folder / "force.csv").write_text(
        "Displacement (mm),Force (N)\n" + "".join(f"{0.01 * i:.3f},{0.002 * i**1.5:.6f}\n" for i in range(80)), encoding="utf-8"
    )
    (folder / "experiment.toml").write_text(EXPERIMENT, encoding="utf-8")
    (folder / "command.py").write_text(COMMAND, encoding="utf-8")
    return subprocess.Popen(
        [sys.executable, "command.py", stage, *words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PROCESSES": str(processes)},
        start_new_session=True,
    )


def _stopped(
    folder: Path,
    stage: str,
    signals: tuple[signal.Signals, ...] = (signal.SIGINT,),
    processes: int = 1,
    words: tuple[str, ...] = BEGIN,
) -> tuple[int, str, float]:
    """Stop a command in a stage: exit code, what it said on stderr, and the seconds that it took to end."""
    process = _begun(folder, stage, words, processes)
    assert process.stdout is not None
    if process.stdout.readline() != "there\n":
        raise AssertionError(process.communicate()[1])
    begin = time.monotonic()
    for signum in signals:
        os.killpg(process.pid, signum)
        time.sleep(0.05)
    try:
        _, said = process.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        raise
    return process.returncode, said, time.monotonic() - begin


@pytest.mark.parametrize(
    ("stage", "processes"),
    [
        ("reading", 1),
        ("sampling", 1),
        ("sampling", 0),
        ("block likelihoods", 0),
        ("spot check", 1),
        ("writing", 1),
        ("saving", 1),
        ("the report", 0),
    ],
)
def test_ctrl_c_ends_every_stage_at_once_and_says_how_to_go_on(tmp_path: Path, stage: str, processes: int) -> None:
    code, said, seconds = _stopped(tmp_path, stage, processes=processes)
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
    whole = _begun(tmp_path, "nothing", BEGIN, 0)
    whole.communicate(timeout=120)
    assert whole.returncode == 3
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
    process = _begun(tmp_path, "sampling", BEGIN, 0)
    assert process.stdout is not None
    assert process.stderr is not None
    assert process.stdout.readline() == "there\n"
    with open(f"/proc/{process.pid}/fd/2", "wb", buffering=0, opener=lambda p, f: os.open(p, f | os.O_NONBLOCK)) as full:
        while full.write(b"x" * 4096) is not None:
            pass
    begin = time.monotonic()
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait(60) == 130
    assert time.monotonic() - begin < 3
    process.communicate()


def test_advice_is_a_command_of_the_options_that_matter() -> None:
    odd = Path("-a $x 'b'\n.toml")
    text = _resuming(odd, Path("my run"), {"--surrogate": Path("a b.npz"), "--seed": 3, "--budget": None})
    words = ["calib", "calibrate", f"./{odd}", "-o", "my run", "--resume", "--surrogate", "a b.npz", "--seed", "3"]
    assert shlex.split(text) == words

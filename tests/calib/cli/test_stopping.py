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

ROOT = Path(__file__).parents[3]

pytestmark = pytest.mark.skipif(os.name == "nt", reason="signals as POSIX has them")

EXPERIMENT = """
model = "closed form"
indenter.radius = "5 mm"
sensor.radius = "10 mm"
[[specimens]]
name = "sensor 1"
force = "force.csv"
[specimens.priors]
sensor_thickness = { normal = ["0.74 mm", "0.02 mm"] }
padding_thickness = { normal = ["1.10 mm", "0.03 mm"] }
"""

# A calibration that stays for ever in one of its stages, and says on stdout when it is there.
COMMAND = """
import os, sys, time
import calib.runs.calibration as calibration
from calib.cli import app
from calib.runs import Stages
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

def with_workers(*args, **kwargs):
    with workers(int(os.environ["PROCESSES"])) as executor:
        executor.submit(os.getpid).result()
        running = [executor.submit(time.sleep, 600) for _ in range(3)]
        print("there", flush=True)
        running[0].result()

if __name__ == "__main__":
    stage, *words = sys.argv[1:]
    stages = {}
    if stage == "reading":
        calibration.read_sweeps = stay
    elif stage == "writing":
        stages = {"sample": lambda *args, **kwargs: None, "spot_check": lambda *args: None}
        calibration.write_run = stay
    elif stage == "spot check":
        stages = {"sample": lambda *args, **kwargs: None, "spot_check": stay}
    else:
        stages = {"sample": {"sampling": with_workers, "something deaf": deaf}[stage]}
    app(words, obj=Stages(**stages))
"""


def _stopped(folder: Path, stage: str, signals: tuple[signal.Signals, ...], processes: int = 1) -> tuple[int, str, float]:
    """Stop a calibration in a stage: exit code, what it said on stderr, and the seconds that it took to end."""
    (folder / "force.csv").write_text(
        "Displacement (mm),Force (N)\n" + "".join(f"{0.01 * i:.3f},{0.002 * i**1.5:.6f}\n" for i in range(80)), encoding="utf-8"
    )
    (folder / "experiment.toml").write_text(EXPERIMENT, encoding="utf-8")
    (folder / "command.py").write_text(COMMAND, encoding="utf-8")
    words = [stage, "calibrate", "experiment.toml", "-o", "my run", "--seed", "7"]
    process = subprocess.Popen(
        [sys.executable, "command.py", *words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PROCESSES": str(processes)},
        start_new_session=True,
    )
    assert process.stdout is not None
    if process.stdout.readline() != "there\n":
        raise AssertionError(process.communicate()[1])
    begin = time.monotonic()
    for signum in signals:
        os.killpg(process.pid, signum)
        time.sleep(0.05)
    _, said = process.communicate(timeout=600)
    return process.returncode, said, time.monotonic() - begin


@pytest.mark.parametrize(
    ("stage", "processes"), [("reading", 1), ("sampling", 1), ("sampling", 0), ("spot check", 1), ("writing", 1)]
)
def test_ctrl_c_ends_every_stage_at_once_and_says_how_to_go_on(tmp_path: Path, stage: str, processes: int) -> None:
    code, said, seconds = _stopped(tmp_path, stage, (signal.SIGINT,), processes)
    assert code == 130
    assert seconds < 2
    if stage == "reading":
        assert said == "Stopped before anything was begun.\n"
        assert not (tmp_path / "my run").exists()
    else:
        assert said == 'Stopped. Continue with: calib calibrate experiment.toml -o "my run" --resume --seed 7\n'
        assert (tmp_path / "my run" / "run.json").is_file()


@pytest.mark.parametrize(("signum", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_other_signals_end_it_too_with_their_exit_codes(tmp_path: Path, signum: signal.Signals, code: int) -> None:
    assert _stopped(tmp_path, "sampling", (signum,))[0] == code


def test_a_second_ctrl_c_changes_nothing_and_what_does_not_listen_is_ended(tmp_path: Path) -> None:
    code, said, seconds = _stopped(tmp_path, "something deaf", (signal.SIGINT, signal.SIGINT, signal.SIGTERM))
    assert code == 130
    assert said.startswith("Stopped. Continue with: ")
    assert said.count("\n") == 1
    assert seconds < 2


def test_advice_is_a_command_of_the_options_that_matter() -> None:
    odd = Path("-a $x 'b'\n.toml")
    text = _resuming(odd, Path("my run"), {"--surrogate": Path("a b.npz"), "--seed": 3, "--budget": None})
    words = ["calib", "calibrate", f"./{odd}", "-o", "my run", "--resume", "--surrogate", "a b.npz", "--seed", "3"]
    assert shlex.split(text) == words

"""A small experiment in a folder, a calibration of it that takes a second, and processes that can be killed where one likes."""

from __future__ import annotations

import math
import os
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from calib.checks import Elsewhere
from calib.errors import InputError
from calib.experiment import read_experiment
from calib.files import sha256_of
from calib.problem import Problem
from calib.runs.calibration import Calibration, Stages, calibrate
from calib.runs.folder import Run
from calib.runs.listing import Input, Listing
from calib.runs.written import write_run
from calib.sampling import FINGERPRINT, Gate, Identity, assess, identity_of, sampler
from calib.sampling.posterior import Posterior
from calib.sampling.sampler import sample
from calib.sampling.start import Start, start
from calib.sampling.target import Mode, ProblemTarget
from models.analytic import ClosedForm
from models.sensor import design_from

#: Exit codes of `in_a_process`.
DONE, REFUSED, FAILED, KILLED = 0, 2, 1, 9

EXPERIMENT = """
name = "One specimen"
model = "closed form"
discrepancy = "off"
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
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


#: Steps of a block of what is sampled `in_short_blocks`.
BLOCK = 10

_PLACES = 512
_CLIMBED: dict[str, tuple[Mode, ...]] = {}
_BEGUN: dict[tuple[str, int, tuple[int, ...], int], Start] = {}


def _climbed(target: ProblemTarget, seed: np.random.SeedSequence) -> tuple[Mode, ...]:
    key = identity_of(target.space.problem, 0).fingerprint
    if key not in _CLIMBED:
        places = target.places(np.random.default_rng(0), _PLACES)
        _CLIMBED[key] = (target.climb(places[np.argmax(target.log_density(places))], []),)
    return _CLIMBED[key]


def _begun(target: ProblemTarget, modes: Sequence[Mode], seed: np.random.SeedSequence, n_walker: int) -> Start:
    assert isinstance(seed.entropy, int)
    key = (identity_of(target.space.problem, 0).fingerprint, seed.entropy, seed.spawn_key, n_walker)
    if key not in _BEGUN:
        _BEGUN[key] = start(target, modes, seed, n_walker, most_rounds=2)
    return _BEGUN[key]


@contextmanager
def in_short_blocks() -> Iterator[None]:
    """Sample in blocks of `BLOCK` steps."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (sampler, assess):
            patch.setattr(module, "BLOCK_STEPS", BLOCK)
        yield


@contextmanager
def in_small_steps() -> Iterator[None]:
    """Sample in this process without what takes longest of a calibration of a few steps.

    Its blocks are short. There is one mode for each problem, climbed to from one place; where an ensemble begins is found once
    for each problem and seed, on which alone it depends, in two rounds. All that has tests of its own. A process that is forked
    knows those of this one.
    """
    with in_short_blocks(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(sampler, "find_modes", _climbed)
        patch.setattr(sampler, "start", _begun)
        yield


def one_block_more(problem: Problem, *, checkpoint: Path, **options: Any) -> Posterior:
    """Sample one block of every ensemble more than the first one has, however long that takes."""
    n_block = len(list(checkpoint.glob("ensemble-0-0*.npz"))) + 1
    limits = {"max_steps": BLOCK * n_block, "max_seconds": math.inf, "gate": Gate(ess=1e9), "processes": 0}
    with in_small_steps():
        return sample(problem, checkpoint=checkpoint, **{**options, **limits})


#: A calibration without its slow ends.
QUICK = Stages(
    one_block_more,
    spot_check=lambda posterior, _: posterior,
    page=lambda run, _: f"<p>{run.posterior.seed}</p>",
    look_elsewhere=lambda *_: Elsewhere(),
    foretell_blocks=lambda posterior, *_: posterior,
    check=lambda _: None,  # labs are measured with one model and calibrated with another
)


def make_lab(folder: Path) -> Path:
    """Write the experiment into a folder, and its lab file, drawn from the closed form."""
    rng = np.random.default_rng(5)
    values = {"young_modulus": 0.62e6, "sensor_thickness": 0.74e-3, "padding_thickness": 1.1e-3, "relative_permittivity": 2.8}
    depth = np.linspace(-0.05e-3, 0.6e-3, 120)
    r = ClosedForm().respond(design_from({**values, "indenter_radius": 5e-3, "sensor_radius": 10e-3}), depth)
    force = r.force + 0.03 + rng.normal(0, 0.01, depth.size)
    table = pd.DataFrame({"Displacement (mm)": 1e3 * depth + 0.05, "Force (N)": force})
    table.to_csv(folder / "force.csv", index=False, float_format="%.6f")
    (folder / "experiment.toml").write_text(EXPERIMENT, encoding="utf-8")
    return folder


def quick(lab: Path, name: str = "run", *, seed: int | None = None, stages: Stages = QUICK, **options: Any) -> Calibration:
    """Calibrate the experiment of a folder, as short as can be."""
    options = {"processes": 0, "command": "calib calibrate", **options}
    return calibrate(lab / "experiment.toml", lab / name, seed=seed, stages=stages, **options)


def by_hand(lab: Path, name: str, posterior: Posterior) -> Run:
    """A run folder of a posterior that was made by hand, as if it were of the experiment of a lab."""
    told = read_experiment(lab / "experiment.toml")
    own: dict[str, Any] = {
        "path": told.path,
        "sha256": told.sha256,
        "name": told.name,
        "laboratory": told.laboratory,
        "instruments": told.instruments,
    }
    forward = ClosedForm()
    identity = Identity({"seed": str(posterior.seed), "forward model": f"{forward.name}, {forward.identity}"})
    posterior = replace(
        posterior,
        experiment=replace(posterior.experiment, **own),
        attrs={**posterior.attrs, "version of python": "3", "platform": "any", FINGERPRINT: identity.fingerprint},
    )
    files = {"experiment": lab / "experiment.toml", "lab file": lab / "force.csv"}
    inputs = tuple(Input(what, str(path), f"../{path.name}", sha256_of(path)) for what, path in files.items())
    listing = Listing(posterior.seed, {}, identity.parts, identity.fingerprint, inputs, {}, "")
    (lab / name).mkdir()
    run, _ = write_run(lab / name, posterior, forward, listing, "calib calibrate", QUICK.page)
    return run


def begin(work: Callable[[], object]) -> int:
    """Begin work in a process of its own, with all that this one has loaded; gives its number."""
    pid = os.fork()
    if pid:
        return pid
    code = FAILED
    try:
        work()
        code = DONE
    except InputError as error:
        sys.stderr.write(f"{error}\n")
        code = REFUSED
    except BaseException as error:
        sys.stderr.write(f"{type(error).__name__}: {error}\n")
    finally:
        os._exit(code)


def has_ended(pid: int) -> bool:
    """Whether a process has ended, which is still to be waited for."""
    return os.waitid(os.P_PID, pid, os.WEXITED | os.WNOHANG | os.WNOWAIT) is not None


def end(pid: int) -> int:
    """Wait for a process; its exit code, or minus the signal that ended it."""
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def in_a_process(work: Callable[[], object]) -> int:
    """Do work in a process of its own; its exit code."""
    return end(begin(work))


def at_operation(number: int, folder: Path, act: Callable[[], None]) -> None:
    """Act before the n-th operation on files in a folder (from 1) of this process: to open for writing, to name, to remove."""
    count = 0
    counting = threading.Lock()
    names = {"open", "os.mkdir", "os.rename", "os.remove", "os.rmdir"}

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        nonlocal count
        if event not in names or not str(arguments[0]).startswith(str(folder)):
            return
        if event == "open" and not (isinstance(arguments[2], int) and arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)):
            return
        with counting:
            count += 1
            if count != number:
                return
        act()

    sys.addaudithook(watch)

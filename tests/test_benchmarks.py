"""Every benchmark runs from its command line to its end, at a size of seconds; what it finds is for docs/ and not for here.

What samples does so in short blocks, after one climb and two rounds of steps; a first answer, too, is what one climb finds, and
labs are simulated with coarse finite elements: how well is not looked at here. Functions of the sampler and a constant of the
benchmarks are replaced for that in the process of the script, whose own options are those of its user.
"""

from __future__ import annotations

import importlib
import io
import os
import runpy
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent / "calib" / "runs"))

from small_run import BLOCK, in_small_steps

from calib.sampling import estimate
from calib.sampling.coordinates import Coordinates
from calib.sampling.scoring import score
from models.sensor import FloatArray
from models.surrogate.points import design_points
from models.surrogate.store import open_store
from models.surrogate.training import run_point, store_settings

ROOT = Path(__file__).parents[1]

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked here")

BENCHMARKS = sorted(path.name for path in (ROOT / "benchmarks").glob("*.py"))
ACCURACY = 2e-2
#: As coarse as can be without what a check would ask more of.
ACCURACY_OF_LABS = 2e-3

#: Benchmarks that start workers, each of which loads the script.
STARTING_PROCESSES = ("damage_files.py", "fem_robustness.py")

#: Those whose last line tells how well something is found: no first answer of theirs is replaced.
ANSWERED_IN_FULL = ("check_faults.py", "next_decision.py")

#: Benchmark -> what makes it small, and a piece of what it prints in the end. FOLDER is one of the test's own.
QUICK: dict[str, tuple[list[str], str]] = {
    "averaging.py": (
        ["sound", "--labs", "1", "--candidates", "own-padding", "--processes", "0"],
        "| sound | 1 | as given |",
    ),
    "bases.py": (["slippery", "--labs", "1", "--processes", "0"], "| slippery | thicknesses measured | 1 | 1 | 0 |"),
    "batch.py": (
        [
            *("--lots", "1", "--lot", "1", "--new", "1", "--exact", "0", "--surrogate", "--steps", str(BLOCK)),
            *("--processes", "0", "--folder", "FOLDER/batches"),
        ],
        "sound newcomers named as strangers: ",
    ),
    "check_faults.py": (["N called kN", "--labs", "1"], "| N called kN | 1 | force alone | 0 | 1 | 0 | 0 | 1 |"),
    "damage_files.py": (["-n", "18"], "0 failed"),
    "fem_base.py": (["--parts", "designs", "--designs", "2", "--accuracy", "2e-2"], "2 of 2 paths reach the end"),
    "fem_accuracy.py": (["--finest", "1.6e-3"], "force against Hertz with a bonded layer"),
    # One case of one part; all cases of all parts are run by hand, see docs/reliability.md.
    "crash.py": (["--parts", "kills", "-n", "1", "--folder", "FOLDER/crash"], "0 of 1 not right"),
    # FElupe is not there: its part says so and is skipped.
    "fem_foam.py": (["--parts", "uniaxial", "felupe"], "uniaxial compression to 30, 60 %"),
    # CalculiX is a program and scikit-fem a package, both of their own: what is not there is skipped, and ours runs alone.
    "fem_peers.py": (["--until", "0.1", "--size", "0.4"], "2 steps to 0.1 mm, one core"),
    "fem_robustness.py": (["--designs", "2", "--processes", "1", "--accuracy", "2e-2"], "2 of 2 paths reach the end"),
    "forward_models.py": (["--draws", "32"], "closed form, 32 designs"),
    "fuzz_readers.py": (["-n", "40", "--saved", "FOLDER/failures"], "0 failed"),
    "gent_family.py": (
        ["--accuracy", "1e-1", "--steps", "2", "--laws", "neo-hookean"],
        "neo-hookean                       0.00%",
    ),
    "faults.py": (["sound", "--labs", "1", "--steps", str(BLOCK), "--processes", "0"], "| sound | 1 |"),
    # Gaussian process and polynomial chaos need scikit-learn and chaospy, the extra `benchmark`: too large for every change.
    "learning_curve.py": (
        ["FOLDER/runs.sqlite", "--accuracy", str(ACCURACY), "--fits", "ours", "--runs", "64", "--kept", "8", "--steps", "20"],
        "error that 95 % of 8 designs stay below",
    ),
    "first_answers.py": (["nothing", "--labs", "1", "--steps", str(BLOCK), "--processes", "0"], "| nothing | 1 | 0 |"),
    "gripper.py": (["exact", "--labs", "1", "--draws", "100", "--processes", "0"], "| exact | design | 1 | 0 |"),
    "lots.py": (["-n", "1", "--labs", "1"], "padding_thickness"),
    "likelihood.py": (["--draws", "40", "--specimens", "2", "--sweeps", "3", "--repeats", "1"], "sweeps of one specimen"),
    # What fails is told by its exit code: a seed of which all mutants are read as they may be.
    "mutate_lab_files.py": (["-n", "30", "--folder", "FOLDER", "-o", "FOLDER/mutants.csv"], "0 of 30 failed"),
    "next_decision.py": (["--labs", "1", "--readings", "1", "--kinds", "padding_thickness"], "1 labs, 0 of them left out"),
    "next.py": (["force alone", "--labs", "1", "--kinds", "ball"], "1 labs, 0 of them left out"),
    "outliers.py": (["1 % at 10 sd", "--seeds", "1"], "| 1 % at 10 sd | 1 | 0 |"),
    "specifications.py": (
        ["as believed, to 10 N", "--labs", "1", "--processes", "0", "--quick", "--draws", "60"],
        "| hangs on the modulus | nominal |",
    ),
    "thinning.py": (["FOLDER/runs.sqlite", "--accuracy", str(ACCURACY), "--steps", "40"], "80 paths, "),
    "two_balls.py": (["FOLDER/lab"], "2 specimens, 2 balls each"),
    "planted.py": (["nothing", "--labs", "1", "--steps", str(BLOCK), "--processes", "0"], "| nothing | 1 | 0 |"),
    "posterior_against_fem.py": (
        [
            *("--cases", "force", "--designs", "8", "--accuracy", "3e-2", "--steps", str(BLOCK)),
            *("--draws", "30", "--processes", "0"),
        ],
        "force: 8 unknowns, NOT converged; 30 draws re-weighted",
    ),
    "prior_conflict.py": (["sound", "--labs", "1", "--draws", "400", "--processes", "0"], "| sound | 1 |"),
    "read_large_file.py": (["-n", "3000", "--files", "ragged", "two rates"], "two rates: 0 MB, 3000 rows"),
    # Moves and peers on the shipped experiment take minutes; one target shows that the table is made.
    "sampling.py": (["targets", "three modes", "--seeds", "1"], "0 converged and wrong; 0 of 1 runs"),
    "specimens.py": (["-n", "1", "--steps", str(BLOCK), "--processes", "0"], "shared unknowns within the 90 % interval"),
    "surrogate_range.py": (["FOLDER/range.png"], ""),
}


@pytest.fixture
def beside(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], Any]:
    """Function that imports a module of benchmarks/ by its name."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    return importlib.import_module


def run(folder: Path, script: str, *words: str) -> str:
    """What a script of benchmarks/ prints; its own neighbours are found beside it, as its user has it.

    Its process is forked of this one, which has loaded most of what it needs; what starts processes itself gets a fresh one.
    """
    output = folder / "printed.txt"
    with output.open("w", encoding="utf-8") as printed:
        pid = os.fork()
        if pid == 0:
            os.dup2(printed.fileno(), 1)
            os.dup2(printed.fileno(), 2)
            os.chdir(ROOT / "benchmarks")
            if script in STARTING_PROCESSES:
                os.execv(sys.executable, [sys.executable, script, *words])
            _run_here(script, words)
    code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    said = output.read_text(encoding="utf-8")
    assert code == 0, said
    return said


def _one_climb(space: Coordinates, _: object) -> tuple[FloatArray, bool]:
    """The mode that is climbed to from where the readings show contact, in the place of the highest of a few."""
    return score(space, space.nominal())[0], True


@contextmanager
def _briefly(script: str) -> Iterator[None]:
    """Sample, look at posteriors and simulate labs in a fraction of the time."""
    with ExitStack() as brief, pytest.MonkeyPatch.context() as patch:
        patch.setattr(importlib.import_module("simulated.faulty"), "ACCURACY", ACCURACY_OF_LABS)
        if script != "sampling.py":  # which tells how well it is sampled
            brief.enter_context(in_small_steps())
        if script not in ANSWERED_IN_FULL:
            patch.setattr(estimate, "highest_mode", _one_climb)
        yield


def _run_here(script: str, words: tuple[str, ...]) -> NoReturn:
    """Run a script as Python runs it, first for its help and then in earnest, and end the process as it would."""
    sys.stdout, sys.stderr = (io.TextIOWrapper(io.FileIO(number, "w", closefd=False), "utf-8") for number in (1, 2))
    code: object = 1
    brief = ExitStack()
    try:
        warnings.resetwarnings()  # those of a script are no errors
        sys.path.insert(0, os.getcwd())
        brief.enter_context(_briefly(script))
        for given in (("--help",), words):
            sys.argv = [script, *given]
            try:
                runpy.run_path(str(ROOT / "benchmarks" / script), run_name="__main__")
                code = 0
            except SystemExit as end:
                code = end.code or 0
            if code:
                break
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code if isinstance(code, int) else 1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a store of runs: the path of one design told of eighty, which is enough to be read and fitted."""
    folder = tmp_path_factory.mktemp("benchmarks")
    path = run_point(np.array([0.15, 0.2, 2.0, 1.0]), ACCURACY)
    with open_store(folder / "runs.sqlite", store_settings(ACCURACY)) as store:
        for point in design_points(80, seed=1):
            store.add(point, path.arrays)
    return folder


@pytest.mark.parametrize("name", BENCHMARKS)
def test_a_benchmark_runs(name: str, folder: Path) -> None:
    assert name in QUICK, f"say in QUICK of {Path(__file__).name} what makes benchmarks/{name} run in a few seconds"
    words, said = QUICK[name]
    assert said in run(folder, name, *(word.replace("FOLDER", str(folder)) for word in words))


def test_no_benchmark_is_expected_that_is_not_there() -> None:
    assert set(QUICK) <= set(BENCHMARKS)


def test_the_input_for_calculix_is_written_without_calculix(beside: Callable[[str], Any]) -> None:
    text = beside("fem_peers").deck(0.05 * np.arange(1, 3), 0.4, 400.0, 0.25)[0]
    assert text.count("*STEP, NLGEOM") == text.count("*END STEP") == 2
    assert "TYPE=CAX8R, ELSET=DISC" in text


def test_every_kind_of_mutant_is_in_the_docs_with_its_reason(beside: Callable[[str], Any]) -> None:
    rows = [f"| {kind.name} | {kind.why} |" for kind in beside("mutate_lab_files").KINDS]
    docs = (ROOT / "docs" / "reading.md").read_text(encoding="utf-8").replace("\\|", "|")
    assert [row for row in rows if row not in docs] == []


def test_the_likelihood_is_that_of_simulated_lots_at_their_truth(beside: Callable[[str], Any]) -> None:
    """Else lots of many specimens, which add up what is wrong with one, would miss what they share."""
    rows = [beside("specimens").scores(2, seed)["scores"] for seed in range(12)]
    for name in ("young_modulus", "relative_permittivity", "parasitic_capacitance", "force_noise", "capacitance_noise"):
        slope, curvature = np.array([row[name] for row in rows]).T
        assert abs(slope.mean()) < 4 * slope.std(ddof=1) / np.sqrt(slope.size), name
        assert 0.3 < slope.var(ddof=1) / curvature.mean() < 3, name

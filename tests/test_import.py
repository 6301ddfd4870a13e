"""`import calib` takes no time and loads nothing; its names are there when they are asked for, and so is help."""

from __future__ import annotations

import inspect
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import calib
from models.surrogate import load_surrogate

ROOT = Path(__file__).parents[1]

#: What a name of the API or a calculation may load, and neither `import calib` nor help.
HEAVY = ("numpy", "scipy", "pandas", "xarray", "matplotlib", "arviz")


def python(code: str, *, both: bool = False) -> str:
    """What a fresh Python prints; in front of it, if it is asked for, what it says of faults."""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return ((done.stderr if both else "") + done.stdout).strip()


def test_import_takes_less_than_three_tenths_of_a_second() -> None:
    code = "import time; t = time.perf_counter(); import calib; print(time.perf_counter() - t)"
    assert min(float(python(code)) for _ in range(5)) < 0.3


def test_import_loads_no_package_of_another_project() -> None:
    code = f"import sys, calib; print(*(name for name in {HEAVY} if name in sys.modules))"
    assert python(code) == ""


@pytest.mark.parametrize("name", calib.__all__)
def test_every_name_is_there(name: str) -> None:
    assert getattr(calib, name) is not None
    assert name in dir(calib)


def test_names_are_sorted_and_each_is_there_once() -> None:
    assert dir(calib) == sorted(set(calib.__all__))


FUNCTIONS = [getattr(calib, name) for name in calib.__all__ if inspect.isfunction(getattr(calib, name))]


@pytest.mark.parametrize("function", [*FUNCTIONS, load_surrogate], ids=lambda f: str(f.__name__))
def test_a_path_may_be_a_text(function: Callable[..., object]) -> None:
    for parameter in inspect.signature(function).parameters.values():
        assert "Path" not in parameter.annotation or "str" in parameter.annotation, parameter


def test_an_experiment_in_a_text_is_read_and_a_run_that_is_not_there_is_named(tmp_path: Path) -> None:
    assert calib.read_experiment(str(ROOT / "datasets" / "padded_sensor" / "experiment.toml")).specimens
    with pytest.raises(calib.InputError, match="no-run"):
        calib.load_run(str(tmp_path / "no-run"))
    with pytest.raises(calib.InputError, match="no-run"):
        calib.load_posterior(str(tmp_path / "no-run.nc"))


def test_a_name_that_is_not_there_is_refused_as_python_does() -> None:
    name = "calibrat"
    with pytest.raises(AttributeError, match=f"module 'calib' has no attribute '{name}'"):
        getattr(calib, name)
    assert not hasattr(calib, "numpy")


def test_help_loads_nothing_that_calculates_or_draws() -> None:
    code = f"""
import sys
from calib.cli import app
try:
    app(["--help"])
except SystemExit as end:
    assert not end.code
print("loaded:", *(name for name in {("scipy", "matplotlib", "arviz", "pandas", "xarray")} if name in sys.modules))
"""
    said = python(code)
    assert "Commands" in said or "calibrate" in said
    assert said.splitlines()[-1] == "loaded:"


@pytest.mark.parametrize(("loaded", "home"), [("ArviZ", "a file"), ("corner", "empty")])
def test_a_home_that_nothing_can_be_kept_in_stops_nothing_and_nothing_is_said(loaded: str, home: str, tmp_path: Path) -> None:
    folder = tmp_path / "home"
    if home == "a file":
        folder.write_text("")
    code = f"""
import os
os.environ.pop("XDG_CACHE_HOME", None)
os.environ.update(HOME={str(folder)!r}, MPLCONFIGDIR={str(tmp_path)!r})
from calib.report import corner_figure
from calib.sampling import load_arviz
if {loaded!r} == "ArviZ":
    load_arviz()
else:
    try:
        corner_figure(None)
    except AttributeError:  # of what is no posterior, which is looked at after corner is loaded
        pass
"""
    assert python(code, both=True) == ""


@pytest.mark.parametrize("said", ['unknown key "prior"', "force reads 0 N in every row"])
def test_a_refusal_waits_neither_for_what_draws_nor_for_what_samples(said: str, tmp_path: Path) -> None:
    experiment = tmp_path / "experiment.toml"
    shutil.copytree(ROOT / "datasets" / "padded_sensor", tmp_path, dirs_exist_ok=True)
    if "key" in said:
        experiment.write_text(experiment.read_text(encoding="utf-8").replace("[priors]", "[prior]", 1), encoding="utf-8")
    else:
        rows = "".join(f"{0.1 * row:.1f},{0.004 * row:.5f},0.0\n" for row in range(500))
        (tmp_path / "sensor1_instron.csv").write_text("Time (s),Displacement (mm),Force (N)\n" + rows)
    code = f"""
import sys
from calib.cli import app
try:
    app(["calibrate", {str(experiment)!r}, "-o", {str(tmp_path / "run")!r}])
except SystemExit as end:
    assert end.code == 2, end.code
print("loaded:", *(name for name in ("matplotlib", "emcee", "arviz", "scipy.stats", "scipy.signal") if name in sys.modules))
"""
    printed = python(code, both=True)
    assert said in " ".join(printed.split())
    assert printed.splitlines()[-1] == "loaded:"

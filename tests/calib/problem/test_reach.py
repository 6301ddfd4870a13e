"""A press that is deeper than the forward model covers is refused with a use that, written as advised, is covered."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from calib.errors import InputError
from calib.experiment import experiment_from
from calib.problem.problem import problem_from


def write(folder: Path, contact: float) -> None:
    """Files of a press of 1.5 mm into 1.84 mm; lengths in mm."""
    rng = np.random.default_rng(1)
    depth = np.linspace(-0.3, 1.5, 600)
    depth = np.concatenate([depth, depth[::-1]])
    d = np.maximum(depth, 0)
    t, x = np.arange(d.size) * 0.1, depth + contact
    f = 2 * d**1.8 * (1 + d) + 0.1 + 0.004 * rng.normal(size=d.size)
    c = 97 + 2 * d**1.6 * (1 + d) + 0.003 * rng.normal(size=d.size)
    time, place, load, cp = (("Time (s)", t), ("Extension (mm)", x), ("Load (N)", f), ("Cp (pF)", c))
    for name, columns in {
        "tester.csv": (time, place, load),
        "meter.csv": (time, cp),
        "placed.csv": (place, cp),
        "loaded.csv": (time, ("Load (N)", 9 * f), cp),
    }.items():
        rows = (",".join(f"{v:.5f}" for v in row) for row in zip(*(v for _, v in columns), strict=True))
        (folder / name).write_text("\n".join([",".join(n for n, _ in columns), *rows]) + "\n")


def tables(**specimen: Any) -> dict[str, Any]:
    priors = {
        "sensor_thickness": {"normal": ["0.74 mm", "0.02 mm"]},
        "padding_thickness": {"normal": ["1.10 mm", "0.03 mm"]},
    }
    return {
        "model": "closed form",
        "indenter": {"radius": "5 mm"},
        "sensor": {"radius": "10 mm"},
        "specimens": [{"name": "s", "priors": priors, **specimen}],
    }


@pytest.mark.parametrize("contact", [0.0, 3.0])
@pytest.mark.parametrize(
    ("files", "key"),
    [
        ({"force": "tester.csv"}, "max_depth"),
        ({"force": "tester.csv", "capacitance": "meter.csv"}, "max_depth"),
        ({"force": "tester.csv", "capacitance": "placed.csv"}, "max_depth"),
        ({"force": "tester.csv", "capacitance": "loaded.csv"}, "max_depth"),
        ({"capacitance": "loaded.csv"}, "max_force"),
    ],
)
def test_a_press_that_is_too_deep_is_refused_with_a_use_that_fits(
    tmp_path: Path, contact: float, files: dict[str, str], key: str
) -> None:
    write(tmp_path, contact)
    with pytest.raises(InputError, match="lies outside what the closed form covers") as caught:
        problem_from(experiment_from(tables(**files), tmp_path))
    advised = re.search(r'use = \{ (\w+) = "([^"]*)" \}', str(caught.value))
    assert advised is not None
    assert advised[1] == key
    problem = problem_from(experiment_from(tables(**files, use={key: advised[2]}), tmp_path))
    for points in problem.sweeps[0].channels.values():
        assert points.value.size >= 10


def test_a_design_that_is_not_covered_gets_no_depth_for_advice(tmp_path: Path) -> None:
    write(tmp_path, 0.0)
    plan = tables(force="tester.csv")
    plan["specimens"][0]["priors"] = {"sensor_thickness": {"fixed": "0.74 mm"}, "padding_thickness": {"fixed": "60 mm"}}
    plan["model"] = "surrogate"
    with pytest.raises(InputError, match="Use less of the press, or check thicknesses") as caught:
        problem_from(experiment_from(plan, tmp_path))
    assert "max_depth" not in str(caught.value)

"""What lab files show that the model has not, time and drift, takes the green away where it outweighs what is stated."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calib.checks import Reason, drift_by_share, drift_of_meter, plausibility
from calib.experiment import Experiment, Specimen, SweepFiles
from calib.lab import Grade, Sweep
from calib.priors import LogNormal, Normal, Prior
from calib.problem import build_problem
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.sampling import FirstEstimate
from models.sensor import design_from
from models.surrogate import load_surrogate

MODULUS, THICKNESSES = 0.62e6, {"sensor_thickness": 0.75e-3, "padding_thickness": 1.62e-3}


def _sweep() -> Sweep:
    radii = {"sensor_radius": 10e-3, "indenter_radius": 5e-3}
    design = design_from({**THICKNESSES, **radii, "young_modulus": MODULUS, "relative_permittivity": 2.8})
    rng = np.random.default_rng(4)
    rig = Rig(0.1e-3, 1e-6, 0.2)
    return synthetic_sweep(load_surrogate(), design, 0.55e-3, rig, rng, specimen="sensor 1", tie="none", n_points=20)


def _reasons(sweep: Sweep, known_to: float = 0.012) -> tuple[Reason, ...]:
    """What a check says of a press of a specimen whose thicknesses are known to so much."""
    thick: dict[str, Prior] = {name: Normal(value, known_to * value) for name, value in THICKNESSES.items()}
    specimen = Specimen("sensor 1", (SweepFiles("", None, None, 5e-3),), thick)
    priors: dict[str, Prior] = {"young_modulus": LogNormal(0.7e6, 1.6)}
    experiment = Experiment("lab", Path("e.toml"), "", 5e-3, 10e-3, "sensor", priors, (specimen,), "surrogate", "on")
    return plausibility(build_problem(experiment, [sweep], load_surrogate())).reasons


def _graded(sweep: Sweep, check: str, number: float, channel: str = "force") -> Sweep:
    finding = f"{check} of {number:g}"
    return replace(sweep, grades=(*sweep.grades, Grade(check, "warning", number, "1", finding, "Repeat it.", channel, "f.csv")))


def _drifting(sweep: Sweep, drift: float) -> Sweep:
    """With a load zero that moves by so much [N] along the press, and the grade that says so."""
    points = sweep.channels["force"]
    assert points.displacement is not None
    along = (points.displacement - points.displacement[0]) / np.ptp(points.displacement)
    moved = replace(points, value=points.value + drift * along)
    changed = replace(sweep, channels={**sweep.channels, "force": moved})
    return _graded(changed, "return to zero", drift / float(np.ptp(moved.value)))


@pytest.mark.parametrize(
    ("check", "number"), [("hysteresis", 0.14), ("hysteresis", -0.14), ("change in the hold", -0.07), ("hysteresis", 0.01)]
)
def test_a_material_with_time_is_amber_where_the_modulus_is_known_better_than_that(check: str, number: float) -> None:
    found = [r for r in _reasons(_graded(_sweep(), check, number)) if r.gate == "rate"]
    if number in (-0.14, 0.01):
        assert found == []
        return
    (reason,) = found
    assert reason.level == "amber"
    said = "unloading gives back 14 % less" if check == "hysteresis" else "force falls by 7 % while the crosshead stands"
    assert reason.finding.startswith(said)
    assert "differ by about 7 %" in reason.finding
    # Of a modulus that is hardly known it takes nothing away.
    assert not [r for r in _reasons(_graded(_sweep(), check, number), known_to=0.1) if r.gate == "rate"]


@pytest.mark.parametrize("drift", [0.15, -0.15])
def test_a_load_cell_that_drifts_is_amber_and_the_modulus_without_it_is_said(drift: float) -> None:
    sound = _sweep()
    assert _reasons(sound) == ()
    (reason,) = [r for r in _reasons(_drifting(sound, drift)) if r.gate == "drift"]
    assert reason.level == "amber"
    without = float(reason.finding.split("sensor is ")[1].split(" ±")[0])
    assert without == pytest.approx(MODULUS * 1e-6, rel=0.04)
    with_it = float(reason.finding.split("instead of ")[1].split(" ±")[0])
    assert abs(with_it - without) > 0.01
    assert reason.action == "Repeat it"


def test_a_drift_that_is_nothing_beside_what_is_not_known_is_not_said() -> None:
    assert not [r for r in _reasons(_drifting(_sweep(), 0.004)) if r.gate == "drift"]


def test_what_both_sides_of_the_press_tell_of_a_drift_counts_more_than_the_few_readings_before_it() -> None:
    still = replace(_graded(_sweep(), "return to zero", 1e-4).grades[0], level="good")
    sweep = replace(_graded(_sweep(), "drift before contact", 0.04), grades=())
    alone = _graded(sweep, "drift before contact", 0.04)
    assert [r.gate for r in _reasons(alone)] == ["drift"]
    assert _reasons(replace(alone, grades=(*alone.grades, still))) == ()


def test_where_the_modulus_without_the_drift_cannot_be_found_the_share_says_how_far_it_may_be_off() -> None:
    drifting = _drifting(_sweep(), 0.15)
    (reason,) = drift_by_share([drifting], FirstEstimate(MODULUS, 0.02 * MODULUS))
    share = drifting.grades[0].number
    assert f"{3 * share / 0.02:.1f} of its standard deviations" in reason.finding
    assert not list(drift_by_share([drifting], FirstEstimate(MODULUS, 0.2 * MODULUS)))
    assert not list(drift_by_share([_sweep()], FirstEstimate(MODULUS, 0.001 * MODULUS)))


@pytest.mark.parametrize(("number", "gates"), [(0.03, ["drift"]), (0.015, [])])
def test_a_meter_that_drifts_by_more_than_is_believed_of_the_model_is_amber(number: float, gates: list[str]) -> None:
    assert [r.gate for r in _reasons(_graded(_sweep(), "drift before contact", number, "capacitance"))] == gates


@pytest.mark.parametrize(("known_to", "gates"), [(0.02, []), (0.01, ["drift"])])
def test_a_meter_that_drifts_by_more_than_the_signal_is_known_to_is_amber(known_to: float, gates: list[str]) -> None:
    drifting = _graded(_sweep(), "return to zero", 0.015, "capacitance")
    assert [r.gate for r in drift_of_meter([drifting], known_to)] == gates

"""Proof by simulation: the simulated lab is that of the measurement model, and what is surer than it ought to be is red."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.stats import binom, norm

from calib.checks.proof.judgement import Proof
from calib.checks.proof.presses import SimulatedPress, presses_of
from calib.checks.proof.ranks import coverage_interval, probability_of, rank_band, rank_points, rank_shares
from calib.checks.proof.replicate import (
    LIKELIHOOD,
    NEXT,
    Outcome,
    Place,
    Replicate,
    ReplicateSetting,
    attempt,
    draw_truth,
    places_of,
    pressed_again,
    replicate_from_plain,
    replicate_to_plain,
)
from calib.checks.proof.simulation import Curve, TrueSweep, curve_of, true_sweeps, write_lab
from calib.experiment import Experiment, experiment_from, read_experiment, read_sweeps
from calib.lab import Sweep
from calib.lab.clocks.way_back import draw_way_back
from calib.priors import Normal
from calib.problem import Problem, build_problem, medians, of_lot, prior_values, residuals
from models.analytic import ClosedForm
from models.sensor import Design, design_from
from models.surrogate import load_surrogate

DATASET = Path(__file__).parents[3] / "datasets" / "padded_sensor" / "experiment.toml"

#: A forward model that is taken for exact, so that residuals show all else.
EXACT = ClosedForm(force_error=1e-6, capacitance_error=1e-6)

#: What is true where a test says nothing else.
TRUTH = {
    "young_modulus": 0.7e6,
    "machine_compliance": 4e-6,
    "parasitic_capacitance": 0.7e-12,
    "force_noise": 4e-3,
    "capacitance_noise": 8e-15,
    "force_discrepancy": 0.0,
    "capacitance_discrepancy": 0.0,
    "contact_offset": 0.13e-3,
    "load_zero": -0.6,
    "clock_offset": 2.2,
}


@cache
def _shipped() -> tuple[Experiment, tuple[Sweep, ...], tuple[SimulatedPress, ...]]:
    plan = read_experiment(DATASET)
    one = replace(plan, specimens=plan.specimens[:1], model="closed form")
    sweeps = read_sweeps(one)
    return one, sweeps, presses_of(one, sweeps)


def _pressed(sweep: TrueSweep) -> Curve:
    """The closed form in the place of the finite elements."""
    end = sweep.depth or 0.6e-3
    s = np.sqrt(np.linspace(0.0, 1.0, 200) ** 2 * end)
    r = EXACT.respond(sweep.design, s**2)
    return Curve(end, CubicSpline(s, r.force), CubicSpline(s, r.capacitance))


def _simulated(
    experiment: Experiment,
    sweeps: Sequence[Sweep],
    presses: Sequence[SimulatedPress],
    folder: Path,
    seed: int,
    changes: Mapping[str, float],
) -> tuple[Problem, dict[str, float]]:
    """The problem of what a lab would have measured, and the truth."""
    problem = build_problem(experiment, sweeps, EXACT)
    wanted = {**TRUTH, **changes}
    truth = {**medians(problem), **problem.fixed}
    truth = {name: wanted.get(name.split("[")[0], value) for name, value in truth.items()}
    true = true_sweeps(problem, truth, presses)
    again = write_lab(experiment, true, [_pressed(sweep) for sweep in true], folder, np.random.default_rng(seed))
    return build_problem(again, read_sweeps(again), EXACT), truth


def test_a_simulated_lab_is_that_of_the_measurement_model(tmp_path: Path) -> None:
    chi = []
    for seed in range(3):
        folder = tmp_path / str(seed)
        folder.mkdir()
        again, truth = _simulated(*_shipped(), folder, seed, {})
        off = residuals(again, truth)
        chi.append(float(off @ off) / off.size)
    assert np.mean(chi) == pytest.approx(1.0, abs=0.25)


def test_the_curve_of_a_simulated_lab_is_smooth_as_that_of_a_sensor_is() -> None:
    design = design_from(
        {
            "indenter_radius": 5e-3,
            "sensor_radius": 10e-3,
            "young_modulus": 0.62e6,
            "relative_permittivity": 2.8,
            "sensor_thickness": 0.74e-3,
            "padding_thickness": 1.10e-3,
        }
    )
    curve = curve_of(design, depth=0.6e-3)
    depth = np.linspace(0.0, 0.6e-3, 41)[1:]  # as far apart as the points of a sweep
    smooth = load_surrogate().respond(design, depth)
    at_rest = float(smooth.rest_capacitance)
    force, capacitance = curve.at(depth)
    for rise, other in ((force, smooth.force), (capacitance - at_rest, smooth.capacitance - at_rest)):
        basis = other[:, None] * np.polynomial.chebyshev.chebvander(depth / depth[-1], 8)
        left = rise - basis @ np.linalg.lstsq(basis, rise, rcond=None)[0]
        assert np.max(np.abs(rise - other)) < 1e-3 * np.max(other)
        # Readings of 5 mN in 5 N, thirty to a point, scatter by 2e-4 of the range, elements by 3e-5.
        assert np.std(left) < 5e-6 * np.max(other)


@pytest.mark.parametrize("name", ["contact_offset", "load_zero", "machine_compliance", "clock_offset", "parasitic_capacitance"])
def test_every_nuisance_of_the_lab_is_in_its_files(tmp_path: Path, name: str) -> None:
    changed = {"contact_offset": -0.2e-3, "load_zero": 1.5, "machine_compliance": 1e-5, "clock_offset": -4.0}.get(name, 3e-12)
    again, truth = _simulated(*_shipped(), tmp_path, 1, {name: changed})
    full = next(n for n in again.names if n.startswith(name))
    true, elsewhere = residuals(again, truth), residuals(again, {**truth, full: TRUTH[name]})
    assert true @ true < 1.5 * true.size
    assert elsewhere @ elsewhere > 10 * true.size


@pytest.mark.parametrize("name", ["displacement_gain", "force_gain", "capacitance_gain"])
def test_every_gain_of_the_lab_is_in_its_files(tmp_path: Path, name: str) -> None:
    experiment, sweeps, presses = _shipped()
    named = replace(experiment, priors={**experiment.priors, name: Normal(1.0, 0.02)})
    again, truth = _simulated(named, sweeps, presses, tmp_path, 1, {name: 1.03})
    true, elsewhere = residuals(again, truth), residuals(again, {**truth, name: 1.0})
    assert true @ true < 1.5 * true.size
    assert elsewhere @ elsewhere > 10 * true.size


def test_offsets_of_clocks_are_as_far_off_as_the_readers_say_of_them(tmp_path: Path) -> None:
    off = []
    for seed in range(10):
        folder = tmp_path / str(seed)
        folder.mkdir()
        again, truth = _simulated(*_shipped(), folder, seed, {"clock_offset": 0.0})
        (sweep,) = again.sweeps
        off.append((sweep.clock_offset - truth["clock_offset[sensor 1]"]) / sweep.clock_offset_sd)
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.5
    assert np.max(np.abs(off)) < 4


def test_a_way_back_is_one_that_is_believed_possible_and_leaves_the_way_in_alone() -> None:
    rng = np.random.default_rng(3)
    distance = np.linspace(0.0, 1.0, 101)
    since = np.linspace(0.0, 20.0, 101)
    gaps, leans = [], []
    for _ in range(200):
        drawn = draw_way_back(20.0, rng)
        assert not np.any(drawn.at(distance[::-1], since[::-1] - 40.0, since[::-1] - 41.0))
        hysteresis = drawn.of_hysteresis(distance)
        assert np.max(np.abs(hysteresis)) < 0.05
        leans.append(float(hysteresis[50]))
        back = drawn.at(distance, since, since)
        assert back[-1] == 0.0  # at contact all is as before
        gaps.append(float(np.max(np.abs(back))))
    assert 0.01 < np.median(gaps) < 0.06
    assert abs(np.mean(leans)) < 3 * np.std(leans) / np.sqrt(200)  # to neither side


def test_a_discrepancy_is_planted_with_the_size_that_is_drawn(tmp_path: Path) -> None:
    far = []
    for seed in range(4):
        folder = tmp_path / str(seed)
        folder.mkdir()
        again, truth = _simulated(*_shipped(), folder, seed, {"force_discrepancy": 0.05, "capacitance_discrepancy": 0.05})
        known = residuals(again, truth)
        assert known @ known < 1.6 * known.size
        unknown = residuals(again, {**truth, "force_discrepancy": 0.001, "capacitance_discrepancy": 0.001})
        far.append(float(unknown @ unknown) / unknown.size)
    assert np.median(far) > 10


@pytest.mark.parametrize("tie", ["one file", "force", "displacement"])
def test_other_ties_of_the_capacitance_are_kept(tmp_path: Path, tie: str) -> None:
    way = np.linspace(-0.1e-3, 0.5e-3, 400)
    force = np.where(way > 0, 2e7 * np.abs(way) ** 2, 0.0)
    capacitance = 97.0 + 2e3 * np.maximum(way, 0.0)
    rng = np.random.default_rng(1)
    columns = {"Displacement (mm)": (way + 0.2e-3) * 1e3, "Force (N)": force + 0.4 + 4e-3 * rng.standard_normal(way.size)}
    own = {"one file": [*columns], "force": ["Force (N)"], "displacement": ["Displacement (mm)"]}[tie]
    meter = {name: columns[name] for name in own} | {"Cp (pF)": capacitance + 8e-3 * rng.standard_normal(way.size)}
    for path, table in (("tester.csv", columns), ("meter.csv", meter)):
        rows = np.column_stack(list(table.values()))
        np.savetxt(tmp_path / path, rows, delimiter=",", header=",".join(table), comments="")
    files = {"force": "meter.csv" if tie == "one file" else "tester.csv", "capacitance": "meter.csv"}
    tables = {
        "indenter": {"radius": "5 mm"},
        "sensor": {"radius": "10 mm"},
        "priors": {"young_modulus": {"lognormal": ["0.7 MPa", 1.6]}},
        "specimens": [{"name": "a", **{k: str(tmp_path / v) for k, v in files.items()}, "priors": _THICKNESSES}],
        "model": "closed form",
    }
    experiment = experiment_from(tables)
    sweeps = read_sweeps(experiment)
    again, truth = _simulated(experiment, sweeps, presses_of(experiment, sweeps), tmp_path, 1, {})
    assert again.sweeps[0].tied_by("capacitance") == sweeps[0].tied_by("capacitance")
    off = residuals(again, truth)
    assert off @ off < 1.5 * off.size


_THICKNESSES = {
    "sensor_thickness": {"normal": ["0.74 mm", "0.02 mm"]},
    "padding_thickness": {"normal": ["1.1 mm", "0.03 mm"]},
    "dielectric_thickness": {"normal": ["0.16 mm", "0.006 mm"]},
}


def test_a_replicate_presses_calibrates_and_ranks() -> None:
    plan = read_experiment(DATASET)
    one = plan.specimens[0]
    force = replace(one, sweeps=tuple(replace(f, capacitance=None) for f in one.sweeps))
    experiment = replace(plan, specimens=(force,))
    sweeps = read_sweeps(experiment)
    setting = ReplicateSetting(experiment, sweeps, presses_of(experiment, sweeps), None, 1)
    replicate = attempt(setting, 3)
    assert replicate.outcome == "done"
    assert {"young_modulus", "padding_thickness[sensor 1]", LIKELIHOOD} <= set(replicate.places)
    assert all(0 < place.rank < 1 and abs(place.off) < 5 for place in replicate.places.values())
    assert replicate_from_plain(replicate_to_plain(replicate)).places == replicate.places


def test_the_next_specimen_of_a_lot_is_ranked_by_what_the_lot_says_of_it() -> None:
    one, sweeps, _ = _shipped()
    problem = build_problem(replace(one, pooling="partial"), sweeps, EXACT)
    names = [*problem.names, *(info.name for info in of_lot(problem))]
    ranks: dict[str, list[float]] = {}
    for seed in range(300):
        rng = np.random.default_rng(seed)
        drawn = prior_values(problem, rng, 100)
        draws = np.column_stack([drawn[name] for name in names])
        truth = {name: float(drawn[name][-1]) for name in names if name != "force_noise"}  # without it nothing is pressed
        for name, place in places_of(problem, draws[:-1], np.full(99, 1 / 99), truth, rng).items():
            ranks.setdefault(name, []).append(place.rank)
    following = {name: np.array(of) for name, of in ranks.items() if name.endswith(f"[{NEXT}]")}
    assert {name.split("[")[0] for name in following} == {"young_modulus", *(lot.quantity for lot in problem.table.lots)}
    assert all(probability_of(rank) > 0.001 for rank in following.values())
    # It is another one than that which was measured.
    assert all(np.all(rank != ranks[name.replace(NEXT, "sensor 1")]) for name, rank in following.items())


def test_around_a_posterior_the_same_sensors_are_pressed_again_with_a_rig_of_their_own(tmp_path: Path) -> None:
    experiment, sweeps, presses = _shipped()
    problem = build_problem(experiment, sweeps, EXACT)
    known = {**medians(problem), "young_modulus": 0.66e6, "contact_offset[sensor 1]": 0.2e-3}
    draws = np.array([[known[name] for name in problem.names]])
    drawn = draw_truth(problem, presses, np.random.default_rng(3), draws)
    assert drawn is not None
    truth, true = drawn
    assert truth["young_modulus"] == 0.66e6
    assert truth["contact_offset[sensor 1]"] == 0.2e-3
    assert true[0].values["contact_offset"] == truth["contact_offset[sensor 1, again]"] != 0.2e-3
    again = pressed_again(write_lab(experiment, true, [_pressed(true[0])], tmp_path, np.random.default_rng(4)))
    both = build_problem(again, (*sweeps, *read_sweeps(again)), EXACT)
    assert set(both.names) | set(both.fixed) == set(truth)
    new = residuals(replace(both, sweeps=both.sweeps[1:], plans=both.plans[1:]), truth)
    assert new @ new < 1.6 * new.size


# --- ranks --------------------------------------------------------------------------------------------------------------


def test_uniform_ranks_leave_their_band_as_often_as_is_said_and_no_others_hide_in_it() -> None:
    rng = np.random.default_rng(20220222)
    n, level = 200, 0.9
    low, high = rank_band(n, level)
    left, rare = 0, 0
    for _ in range(1000):
        ranks = rng.random(n)
        share = rank_shares(ranks)
        left += bool(np.any((share < low) | (share > high)))
        rare += probability_of(ranks) < 1 - level
    assert binom.cdf(left, 1000, 0.1) > 0.001
    assert binom.sf(left, 1000, 0.1) > 0.001
    assert rare == pytest.approx(left, abs=15)
    assert probability_of(rng.beta(1.4, 1.0, n)) < 0.01  # too low
    assert probability_of(norm.cdf(1.4 * rng.standard_normal(n))) < 0.01  # too narrow
    assert low[0] < rank_points()[0] < high[0]


def test_coverage_has_the_interval_of_clopper_and_pearson() -> None:
    # Clopper and Pearson, Biometrika 26 (1934) 404: 95 % limits of 9 of 10 by their binomial tails.
    low, high = coverage_interval(9, 10)
    assert binom.sf(8, 10, low) == pytest.approx(0.025, rel=1e-6)
    assert binom.cdf(9, 10, high) == pytest.approx(0.025, rel=1e-6)
    assert coverage_interval(0, 5)[0] == 0.0
    assert coverage_interval(5, 5)[1] == 1.0


# --- verdict ------------------------------------------------------------------------------------------------------------


def _replicates(n: int, off: Callable[[np.random.Generator], float], outcome: Outcome = "done") -> list[Replicate]:
    """Replicates of which all quantities but the modulus are as they ought to be."""
    rng = np.random.default_rng(7)

    def place(z: float) -> Place:
        rank = float(norm.cdf(z))
        return Place(1.0, rank, 0.05 <= rank <= 0.95, -z)

    names = ("padding_thickness[a]", "force_noise", LIKELIHOOD)
    return [
        Replicate(k, outcome, "", {"young_modulus": place(off(rng)), **{n: place(float(rng.standard_normal())) for n in names}})
        for k in range(n)
    ]


@pytest.mark.parametrize(
    ("off", "colour", "said"),
    [
        (lambda rng: rng.standard_normal(), "green", ""),
        (lambda rng: 1.5 * rng.standard_normal(), "red", "too narrow"),
        (lambda rng: 0.6 * rng.standard_normal(), "amber", "too wide"),
        (lambda rng: rng.standard_normal() + 0.4, "amber", "too low"),
        (lambda rng: rng.standard_normal() - 1.5, "red", "too high"),
    ],
)
def test_a_modulus_that_is_surer_than_it_ought_to_be_is_red(
    off: Callable[[np.random.Generator], float], colour: str, said: str
) -> None:
    proof = Proof(tuple(_replicates(400, off)))
    assert proof.verdict.colour == colour
    assert all("young_modulus" in r.finding and said in r.finding for r in proof.verdict.reasons)


def test_replicates_that_are_lost_few_or_not_converged_are_said() -> None:
    sound = _replicates(300, lambda rng: rng.standard_normal())
    lost = [Replicate(300 + k, "refused", "no contact") for k in range(30)]
    reasons = {r.gate: r for r in Proof((*sound, *lost)).verdict.reasons}
    assert "30 of 330" in reasons["replicates"].finding
    assert "no contact" in reasons["replicates"].finding
    loose = _replicates(300, lambda rng: rng.standard_normal(), "not converged")
    assert Proof(tuple(loose)).verdict.colour == "red"
    assert [r.gate for r in Proof(tuple(sound[:50])).verdict.reasons] == ["replicates"]
    assert Proof(tuple(lost)).verdict.colour == "red"


def test_design_of_a_press_is_that_of_the_specimen() -> None:
    experiment, sweeps, presses = _shipped()
    problem = build_problem(experiment, sweeps, EXACT)
    design: Design = true_sweeps(problem, {**medians(problem), **problem.fixed}, presses)[0].design
    assert float(np.asarray(design.sensor.young_modulus)) == pytest.approx(0.7e6)
    assert float(np.asarray(design.padding.thickness)) == pytest.approx(1.1e-3)

"""Posterior: recovery, reproducibility, checkpoints that survive a kill, and the gate."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from multiprocessing.context import SpawnProcess
from pathlib import Path

import numpy as np
import pytest
from small_run import BLOCK, has_ended, in_short_blocks, in_small_steps
from small_run import begin as begin_process
from small_run import end as end_process

from calib.checks.reweighting import problem_of
from calib.checks.sensitivity import sensitivity_of_headlines
from calib.errors import InputError
from calib.experiment.experiment_file import read_experiment
from calib.experiment.plan import Experiment, Specimen, SweepFiles
from calib.lab.pressing import make_sweep
from calib.priors.distributions import Fixed, HalfNormal, LogNormal, Normal, Prior, Uniform
from calib.problem.likelihood import log_posterior
from calib.problem.problem import Problem, build_problem
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.problem.values import coordinates_of, specimen_design
from calib.sampling import scoring
from calib.sampling.coordinates import coordinates
from calib.sampling.diagnostics import Gate
from calib.sampling.ensemble import KINDS, SHAPELESS, STORE_EVERY, EnsembleState, Moves, advance, walk
from calib.sampling.laplace import importance_weights, laplace_density
from calib.sampling.posterior import Posterior, leave_out, thin_draws
from calib.sampling.sampler import NothingSampled, Progress, sample
from calib.sampling.scoring import score
from calib.sampling.start import Start, find_modes, join_modes, start
from calib.sampling.target import Target, target_of
from models.analytic import ClosedForm
from models.response import Forward, Response
from models.sensor import Design, FloatArray, design_from
from models.surrogate.surrogate import load_surrogate

DATASETS = Path(__file__).parents[3] / "datasets"

EXACT = ClosedForm(force_error=0.0, capacitance_error=0.0)
RIG = Rig(contact_offset=0.05e-3, machine_compliance=2e-6, load_zero=0.1, parasitic_capacitance=0.3e-12, clock_offset=1.0)
TRUTH: Mapping[str, float] = {
    "indenter_radius": 5e-3,
    "sensor_radius": 10e-3,
    "young_modulus": 0.7e6,
    "relative_permittivity": 2.8,
    "sensor_thickness": 0.74e-3,
    "padding_thickness": 1.1e-3,
    "dielectric_thickness": 0.16e-3,
}
KNOWN: Mapping[str, Prior] = {"machine_compliance": Fixed(2e-6), "force_noise": Fixed(5e-3)}


@dataclass(frozen=True)
class Quick:
    """A forward that costs next to nothing: a Hertz-like force over the total thickness, capacitance quadratic in depth."""

    name: str = "quick"
    reach: float = 1e-3

    @property
    def identity(self) -> str:
        return f"quick, reach {self.reach!r}"

    def max_depth(self, design: Design) -> FloatArray:
        return np.full(np.shape(design.sensor.thickness) or (1,), self.reach)

    def outside(self, design: Design, depth: FloatArray) -> str:
        return "" if np.max(depth) <= self.reach else "too deep"

    def respond(self, design: Design, depth: FloatArray) -> Response:
        column = {k: np.atleast_1d(v)[:, None] for k, v in design.parameters().items()}
        d = np.maximum(np.broadcast_to(depth, (column["sensor_thickness"].shape[0], np.shape(depth)[-1])), 0.0)
        h = column["sensor_thickness"] + column["padding_thickness"]
        force = 0.2 * column["young_modulus"] * d**1.5 * (1 + 2 * d / h)
        c0 = np.atleast_1d(np.asarray(design.rest_capacitance, dtype=float))
        capacitance = c0[:, None] * (1 + 0.2 * (d / h) ** 2)
        none = np.zeros((*d.shape, 0))
        response = Response(d, force, d, capacitance, c0, none, none)
        return response if design.is_batch else response.draw(0)


QUICK = Quick()


def small_problem(
    specimen: str = "sensor 1", seed: int = 0, shared: Mapping[str, Prior] = KNOWN, forward: Forward = QUICK
) -> Problem:
    """Modulus, padding thickness, contact offset and load zero from a force sweep."""
    rng = np.random.default_rng(seed)
    sweep = synthetic_sweep(forward, design_from(dict(TRUTH)), 0.6e-3, RIG, rng, specimen=specimen, n_points=24, tie="none")
    own: dict[str, Prior] = {"sensor_thickness": Fixed(0.74e-3), "padding_thickness": Normal(1.1e-3, 0.03e-3)}
    files = (SweepFiles("", Path("force.csv"), None, 5e-3),)
    experiment = Experiment(
        "small", Path("e.toml"), "", 5e-3, 10e-3, "sensor", shared, (Specimen(specimen, files, own),), "closed form", "off"
    )
    return build_problem(experiment, [sweep], forward)


#: What no run of these tests reaches, so that it goes on to its last step.
FAR = Gate(ess=1e9)


def quick(
    problem: Problem, folder: Path, seed: int = 1, max_steps: int = BLOCK, processes: int = 0, resume: bool = False
) -> Posterior:
    with in_small_steps():
        return sample(
            problem,
            seed=seed,
            checkpoint=folder,
            n_walkers=64,
            gate=FAR,
            max_steps=max_steps,
            processes=processes,
            resume=resume,
        )


def begin(target: Target, seed: np.random.SeedSequence, n_walker: int = 64) -> Start:
    """The start of an ensemble that knows the modes it has found itself."""
    return start(target, join_modes(target, find_modes(target, seed.spawn(1)[0])), seed, n_walker)


def endless(problem: Problem, folder: Path, max_steps: int) -> Posterior:
    """Go on for as many steps, as no run can meet the gate: one that has ended cannot be killed."""
    with in_small_steps():
        return sample(problem, seed=1, checkpoint=folder, max_steps=max_steps, processes=0, gate=Gate(ess=1e9), resume=True)


@pytest.fixture(scope="module")
def started() -> tuple[Target, Start]:
    """A target, and where an ensemble of it begins."""
    target = target_of(small_problem())
    return target, begin(target, np.random.SeedSequence(4))


@pytest.fixture(scope="module")
def posterior(tmp_path_factory: pytest.TempPathFactory) -> Posterior:
    """A short run."""
    return quick(small_problem("a/b"), tmp_path_factory.mktemp("run"), max_steps=2 * BLOCK)


def test_the_truth_is_recovered_from_force_and_capacitance(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    sweep = synthetic_sweep(EXACT, design_from(dict(TRUTH)), 0.6e-3, RIG, rng, specimen="s", n_points=24)
    known = {
        p: Fixed(getattr(RIG, p)) for p in ("machine_compliance", "force_noise", "capacitance_noise", "parasitic_capacitance")
    }
    own: dict[str, Prior] = {
        "sensor_thickness": Fixed(0.74e-3),
        "padding_thickness": Normal(1.1e-3, 0.03e-3),
        "dielectric_thickness": LogNormal(0.16e-3, 1.2),
        "clock_offset": Fixed(1.0),
    }
    files = (SweepFiles("", Path("f.csv"), Path("c.csv"), 5e-3),)
    specimens = (Specimen("s", files, own),)
    experiment = Experiment("r", Path("e.toml"), "", 5e-3, 10e-3, "sensor", known, specimens, "closed form", "off")
    problem = build_problem(experiment, [sweep], EXACT)
    seen: list[Progress] = []
    found = sample(problem, seed=3, checkpoint=tmp_path, processes=0, progress=seen.append)
    assert found.diagnostics.converged, found.diagnostics.reasons
    truth = {**TRUTH, **{k: getattr(RIG, k) for k in RIG.__dataclass_fields__}}
    for k, p in enumerate(found.parameters):
        low, high = np.quantile(found.draws[..., k], [0.005, 0.995])
        assert low < truth[p.parameter] < high, p.name
        summary = found.diagnostics.parameters[p.name]
        assert summary.r_hat < 1.01
        assert min(summary.ess_bulk, summary.ess_tail) > 400
    contraction = {p.parameter: found.diagnostics.parameters[p.name].prior_contraction for p in found.parameters}
    assert contraction["contact_offset"] > 0.999
    assert contraction["young_modulus"] > 0.9
    assert contraction["relative_permittivity"] < 0.5
    assert [s.steps for s in seen] == sorted(s.steps for s in seen)
    assert seen[-1].ess == min(min(s.ess_bulk, s.ess_tail) for s in found.diagnostics.parameters.values())
    blocks = leave_out(found)
    assert blocks.elpd == pytest.approx(blocks.pointwise.sum())
    assert len(found.blocks) == blocks.k_hat.size == 6


@pytest.mark.parametrize(
    "shared",
    [
        {"machine_compliance": HalfNormal(5e-6), "force_noise": Fixed(0.02)},
        {**KNOWN, "force_noise": Fixed(0.02), "young_modulus": Uniform(0.7e6, 2e6)},
    ],
    ids=["machine_compliance", "young_modulus"],
)
def test_an_unknown_at_the_end_of_what_is_believed_does_not_keep_a_run_from_converging(
    shared: Mapping[str, Prior], tmp_path: Path
) -> None:
    problem = small_problem(shared=shared)
    found = sample(problem, seed=1, checkpoint=tmp_path, processes=0, max_steps=100)
    assert found.diagnostics.converged, found.diagnostics.reasons


def test_ranks_of_the_truth_are_uniform_over_repeated_experiments(tmp_path: Path) -> None:
    # Truths from the prior, data from the truth: the truth's rank among the draws is uniform (Talts et al. 2018).
    rng = np.random.default_rng(5)
    prior: dict[str, Prior] = {
        "young_modulus": LogNormal(0.7e6, 1.1),
        "contact_offset": Normal(0.0, 0.02e-3),
        "load_zero": Normal(0.0, 0.05),
    }
    shared = {**KNOWN, "young_modulus": prior["young_modulus"]}
    own: dict[str, Prior] = {"sensor_thickness": Fixed(0.74e-3), "padding_thickness": Fixed(1.1e-3)}
    own |= {p: prior[p] for p in ("contact_offset", "load_zero")}
    specimen = Specimen("s", (SweepFiles("", Path("f.csv"), None, 5e-3),), own)
    experiment = Experiment("c", Path("e.toml"), "", 5e-3, 10e-3, "sensor", shared, (specimen,), "closed form", "off")
    ranks = []
    for k in range(8):
        true = {name: float(p.ppf_normal(rng.standard_normal())) for name, p in prior.items()}
        rig = replace(RIG, contact_offset=true["contact_offset"], load_zero=true["load_zero"], force_noise=5e-3)
        design = design_from({**TRUTH, "young_modulus": true["young_modulus"]})
        sweep = synthetic_sweep(QUICK, design, 0.3e-3, rig, rng, specimen="s", n_points=8, tie="none")
        found = quick(build_problem(experiment, [sweep], QUICK), tmp_path / str(k), seed=k, max_steps=4 * BLOCK)
        ranks += [float(np.mean(found.draws[..., i] < true[p.parameter])) for i, p in enumerate(found.parameters)]
    assert np.mean(ranks) == pytest.approx(0.5, abs=0.2)
    assert np.std(ranks) == pytest.approx(12**-0.5, abs=0.12)


def test_moves_leave_the_posterior_as_it_is() -> None:
    # With useless data the posterior is the prior: standard normal in theta.
    problem = small_problem(shared={**KNOWN, "force_noise": Fixed(1e5)}, forward=Quick(reach=1e-2))
    target, n = target_of(problem), len(problem.parameters)
    coords = np.random.default_rng(0).standard_normal((256, n))
    started = begin(target, np.random.SeedSequence(4))
    assert started.proposal is not None
    state = replace(started.state, coords=coords, log_prob=log_posterior(problem, coords))
    for kind in ("proposal", "nearby", "differential evolution", "jump"):
        # The first three alone; whole differences seldom find a place, so they go along with short ones.
        shares = SHAPELESS if kind == "jump" else {kind: 1.0}
        path = walk(target, state, Moves(shares, started.proposal), 200)
        assert path.accepted[kind] > 0
        theta = path.chain.reshape(-1, n)
        np.testing.assert_allclose(theta.mean(axis=0), 0.0, atol=0.1)
        np.testing.assert_allclose(theta.var(axis=0), 1.0, atol=0.1)


def test_every_ensemble_starts_at_the_mode_however_bad_the_prior_draws_are() -> None:
    # Of the second ensemble of this seed one climb ends at a false mode, 500 lower, with a contact point 0.4 mm off; another
    # stands still on its way, 3000 lower, unless its differences are taken anew.
    experiment = read_experiment(DATASETS / "padded_sensor" / "experiment.toml")
    sweeps = [
        make_sweep(s.name, f.name, f.indenter_radius, f.force, f.capacitance) for s in experiment.specimens for f in s.sweeps
    ]
    problem = build_problem(experiment, sweeps, load_surrogate())
    target = target_of(problem)
    places = target.places(np.random.default_rng(0), 512)
    likely = places[np.argsort(-target.log_density(places))][:4]
    highest = max((target.climb(place, []) for place in likely), key=lambda mode: mode.log_density)
    seed = np.random.SeedSequence(3).spawn(4)[1]
    assert abs(find_modes(target, seed.spawn(1)[0])[0].log_density - highest.log_density) < 0.5


def test_modes_and_where_an_ensemble_begins_depend_on_its_seed_alone() -> None:
    target, seed = target_of(small_problem()), np.random.SeedSequence(4)
    modes, again = (find_modes(target, seed) for _ in range(2))
    for mode, other in zip(modes, again, strict=True):
        np.testing.assert_array_equal(mode.x, other.x)
    begun, anew = (start(target, modes, seed, 64).state for _ in range(2))
    np.testing.assert_array_equal(begun.coords, anew.coords)
    np.testing.assert_array_equal(begun.random_keys, anew.random_keys)


def test_a_chain_does_not_depend_on_how_it_is_split_into_blocks(started: tuple[Target, Start]) -> None:
    target, begun = started
    whole = advance(target, begun.state, begun.proposal, 30)
    first = advance(target, begun.state, begun.proposal, 10)
    second = advance(target, first.end, begun.proposal, 20)
    np.testing.assert_array_equal(whole.chain, np.concatenate([first.chain, second.chain]))
    np.testing.assert_array_equal(whole.log_prob, np.concatenate([first.log_prob, second.log_prob]))
    np.testing.assert_array_equal(whole.end.random_keys, second.end.random_keys)


def test_the_share_of_accepted_steps_is_that_of_all_steps(posterior: Posterior, started: tuple[Target, Start]) -> None:
    target, begun = started
    block = advance(target, begun.state, begun.proposal, 100)
    places = np.array([2 if kind == "proposal" else 1 for kind in KINDS])  # that are tried in a step of this kind
    steps = block.tried / places
    assert np.sum(steps) == 100 * 64
    # Step by step: of two states a few steps apart, a walker that stands where it stood was refused each time.
    state, moved = block.end, []
    for _ in range(30):
        coords = state.coords
        state = advance(target, state, begun.proposal, STORE_EVERY).end
        moved.append(np.mean(np.any(state.coords != coords, axis=1)))
    refused = (1 - block.accepted / np.maximum(block.tried, 1)) ** places @ steps / np.sum(steps)
    assert 1 - refused**STORE_EVERY == pytest.approx(np.mean(moved), abs=0.04)
    diagnostics = posterior.diagnostics
    assert all(0.2 < a < 0.98 for a in diagnostics.acceptance_fraction)
    assert set(diagnostics.acceptance_by_move) == {"proposal", "nearby", "differential evolution"}
    assert min(diagnostics.acceptance_by_move.values()) < diagnostics.acceptance_fraction[0]


@pytest.mark.parametrize("power", [1e-3, 1.0])
def test_the_score_is_the_slope_of_the_tempered_density_and_the_information_near_its_bend(power: float) -> None:
    problem = small_problem()
    space = coordinates(problem)
    mode, _, _ = score(space, np.zeros(len(problem.parameters)))
    x = mode + 0.02 * np.random.default_rng(2).standard_normal(mode.size)
    slopes = scoring.slopes_at(space, x, power)
    assert slopes is not None
    step = 1e-4 * np.eye(x.size)
    ahead, behind = (scoring.tempered(space, x + sign * step, power) for sign in (1, -1))
    np.testing.assert_allclose(slopes[0], (ahead - behind) / 2e-4, rtol=2e-3, atol=2e-3 * np.max(np.abs(slopes[0])))
    assert np.all(np.linalg.eigvalsh(slopes[1]) > 0)


@pytest.mark.parametrize("each", [1, 6])
def test_what_is_known_round_a_mode_is_a_density_and_near_the_posterior(each: int) -> None:
    target = target_of(small_problem(shared={name: prior for name, prior in KNOWN.items() if name != "force_noise"}))
    random = np.random.RandomState(1)
    mode = find_modes(target, np.random.SeedSequence(1))[0].x
    known = replace(laplace_density(target.space, mode, random), each=each)
    x = known.draw(random, 4000)
    assert len(np.unique(x[:, known.first], axis=0)) == -(-4000 // each)
    one_by_one = [known.log_density(row[None])[0] for row in x[-7:][::-1]]
    np.testing.assert_allclose(known.log_density(x)[-7:][::-1], one_by_one, rtol=1e-9)
    # For draws x of a density q that is nowhere zero, q(x + d) / q(x) is 1 in the mean, whatever d is.
    for step in 0.2 * np.linalg.cholesky(np.cov(x.T)).T:
        ratio = np.exp(known.log_density(x + step) - known.log_density(x))
        assert np.mean(ratio) == pytest.approx(1, abs=5 * np.std(ratio) / np.sqrt(ratio.size))
    weight = importance_weights(target.log_density(x) - known.log_density(x))
    assert 1 / np.sum(weight**2) > 0.4 * x.shape[0]


def test_an_ensemble_starts_where_the_posterior_is_with_moves_that_fit_it(started: tuple[Target, Start]) -> None:
    target, begun = started
    block = advance(target, begun.state, begun.proposal, 200)
    later = block.log_prob[block.log_prob.shape[0] // 2 :]
    at_first = target.log_density(begun.state.coords) - target.to_theta(begun.state.coords)[1]
    error = np.std(later) / np.sqrt(at_first.size)
    assert np.mean(at_first) == pytest.approx(np.mean(later), abs=5 * error)
    tried, accepted = block.tried[KINDS.index("proposal")], block.accepted[KINDS.index("proposal")]
    assert accepted > 0.3 * tried


def test_draws_do_not_depend_on_the_number_of_processes(tmp_path: Path) -> None:
    problem = small_problem(forward=EXACT)
    here = quick(problem, tmp_path / "here", processes=0)
    (tmp_path / "there").mkdir()
    for known in (tmp_path / "here" / "manifest.json", *(tmp_path / "here").glob("*-modes.npz")):
        (tmp_path / "there" / known.name).write_bytes(known.read_bytes())
    with in_short_blocks():
        there = sample(
            problem, seed=1, checkpoint=tmp_path / "there", n_walkers=64, gate=FAR, max_steps=BLOCK, processes=2, resume=True
        )
    np.testing.assert_array_equal(here.draws, there.draws)


def test_ensembles_have_their_own_starts_and_streams(posterior: Posterior) -> None:
    first = posterior.draws[..., 0]
    assert np.unique(first[:, 0]).size == first.shape[0]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked here")
def test_a_killed_and_resumed_run_gives_the_chain_of_an_uninterrupted_one(tmp_path: Path) -> None:
    problem = small_problem()
    folder = tmp_path / "killed"
    run = begin_process(lambda: endless(problem, folder, max_steps=100_000))
    try:
        while not has_ended(run) and len(list(folder.glob("ensemble-*-0*.npz"))) < 6:
            time.sleep(0.005)
    finally:
        os.kill(run, signal.SIGKILL)
    assert end_process(run) == -signal.SIGKILL
    # As many steps as the killed one may have made, or more: a machine that is busy kills late.
    made = 1 + max(int(path.stem.split("-")[2]) for path in folder.glob("ensemble-*-0*.npz"))
    steps = BLOCK * max(made, 3)
    (folder / ".ensemble-0-00009.0badcafe.part.npz").write_bytes(b"half a file")
    resumed = endless(problem, folder, steps)
    whole = endless(problem, tmp_path / "whole", steps)
    np.testing.assert_array_equal(resumed.draws, whole.draws)
    np.testing.assert_array_equal(resumed.log_prob, whole.log_prob)
    assert resumed.diagnostics == whole.diagnostics
    assert not list(folder.glob("*.part*"))


def test_a_damaged_checkpoint_is_computed_anew(tmp_path: Path) -> None:
    problem = small_problem()
    whole = quick(problem, tmp_path, max_steps=3 * BLOCK)
    block = tmp_path / "ensemble-2-00001.npz"
    block.write_bytes(block.read_bytes()[:1000])
    np.testing.assert_array_equal(quick(problem, tmp_path, max_steps=3 * BLOCK, resume=True).draws, whole.draws)


def test_resuming_with_other_inputs_is_refused(tmp_path: Path) -> None:
    quick(small_problem(), tmp_path)
    with pytest.raises(InputError, match="of another run"):
        quick(small_problem(), tmp_path, seed=2, resume=True)
    with pytest.raises(InputError, match="of another run"):
        quick(small_problem(seed=5), tmp_path, resume=True)


def test_a_new_run_does_not_take_over_old_checkpoints(tmp_path: Path) -> None:
    other = quick(small_problem(), tmp_path, seed=2)
    fresh = quick(small_problem(), tmp_path, seed=1)
    assert not np.any(np.isin(other.draws, fresh.draws))
    np.testing.assert_array_equal(fresh.draws, quick(small_problem(), tmp_path / "fresh", seed=1).draws)


def test_a_spent_budget_is_not_convergence_and_says_so(posterior: Posterior) -> None:
    assert not posterior.diagnostics.converged
    assert posterior.diagnostics.steps == 2 * BLOCK
    assert any("effective sample size" in reason for reason in posterior.diagnostics.reasons)


def test_seconds_end_a_run_too_and_what_was_done_is_kept(tmp_path: Path) -> None:
    done = quick(small_problem(), tmp_path)
    with in_short_blocks():
        found = sample(
            small_problem(), seed=1, checkpoint=tmp_path, n_walkers=64, processes=0, max_seconds=0.0, gate=FAR, resume=True
        )
    assert found.diagnostics.steps == done.diagnostics.steps
    assert not found.diagnostics.converged
    np.testing.assert_array_equal(found.draws, done.draws)


def _endless(*_: object) -> EnsembleState:
    time.sleep(600)
    raise AssertionError


def test_seconds_end_the_search_for_the_start_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("calib.sampling.sampler.start", _endless)
    begin = time.monotonic()
    with pytest.raises(NothingSampled, match="before there was a draw: 0 of 4 ensembles have found where to start"):
        sample(small_problem(), seed=1, checkpoint=tmp_path, processes=0, max_seconds=0.3)
    assert 0.3 < time.monotonic() - begin < 10
    monkeypatch.undo()
    assert sample(small_problem(), seed=1, checkpoint=tmp_path, processes=0, max_steps=40, resume=True).diagnostics.steps == 40


def test_no_worker_is_started_when_the_budget_is_spent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def started(_: SpawnProcess) -> None:
        raise AssertionError

    monkeypatch.setattr(SpawnProcess, "start", started)
    with pytest.raises(NothingSampled, match="0 of 4 ensembles"):
        sample(small_problem(), seed=1, checkpoint=tmp_path, processes=2, max_seconds=0.0)


def _deepest(problem: Problem) -> float:
    points = problem.sweeps[0].channels["force"]
    assert points.displacement is not None
    return float(np.max(points.displacement)) - RIG.contact_offset - RIG.machine_compliance * float(np.max(points.value))


def test_a_posterior_at_the_end_of_the_models_range_is_warned_about(tmp_path: Path) -> None:
    problem = small_problem()
    short = Quick(reach=1.005 * _deepest(problem))
    problem = replace(problem, forward=short)
    warnings = quick(problem, tmp_path).diagnostics.warnings
    assert len(warnings) == 1
    assert "within 2 % of the end" in warnings[0]


def test_thinned_draws_have_all_parameters_and_make_a_design(posterior: Posterior) -> None:
    values = thin_draws(posterior, 50, np.random.default_rng(0))
    assert set(values) == {p.name for p in posterior.parameters} | set(posterior.fixed)
    assert {v.shape for v in values.values()} == {(50,)}
    k = [p.name for p in posterior.parameters].index("young_modulus")
    assert np.all(np.isin(values["young_modulus"], posterior.draws[..., k]))
    design = specimen_design(posterior, values, "a/b")
    np.testing.assert_array_equal(design.sensor.young_modulus, values["young_modulus"])
    assert np.all(np.asarray(design.sensor.thickness) == 0.74e-3)
    with pytest.raises(KeyError, match="no sweep"):
        specimen_design(posterior, values, "c")


# --- specimens of one lot -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def of_a_lot(tmp_path_factory: pytest.TempPathFactory) -> tuple[Problem, Posterior]:
    """Two specimens of one lot, of which the second is 10 % stiffer, and some steps of their posterior."""
    parts = [small_problem(), small_problem("sensor 2", seed=1)]
    harder = design_from({**TRUTH, "young_modulus": 0.77e6})
    rng = np.random.default_rng(2)
    sweep = synthetic_sweep(QUICK, harder, 0.6e-3, RIG, rng, specimen="sensor 2", n_points=24, tie="none")
    known = {"padding_thickness": Fixed(1.1e-3), "contact_offset": Fixed(0.05e-3)}
    specimens = tuple(replace(s, priors={**s.priors, **known}) for p in parts for s in p.experiment.specimens)
    experiment = replace(parts[0].experiment, pooling="partial", specimens=specimens)
    problem = build_problem(experiment, [parts[0].sweeps[0], sweep], QUICK)
    return problem, quick(problem, tmp_path_factory.mktemp("lot"))


def test_lot_and_spread_follow_the_draws_of_the_specimens(of_a_lot: tuple[Problem, Posterior]) -> None:
    problem, posterior = of_a_lot
    assert [p.name for p in posterior.parameters] == [*problem.names, "young_modulus", "young_modulus_spread"]
    assert posterior.unknowns == problem.parameters
    assert set(posterior.diagnostics.parameters) == {p.name for p in posterior.parameters}
    found = {name: s.mean for name, s in posterior.diagnostics.parameters.items()}
    assert found["young_modulus[sensor 1]"] < found["young_modulus"] < found["young_modulus[sensor 2]"]
    assert 0.02 < found["young_modulus_spread"] < 0.15
    together = {name: posterior.draws[..., k].ravel() for k, name in enumerate(p.name for p in posterior.parameters)}
    # The specimens, well known, tell the lot's value within spread / sqrt(2), so that it strays the more, the wider the spread.
    between = np.sqrt(together["young_modulus[sensor 1]"] * together["young_modulus[sensor 2]"])
    away = np.log(np.abs(np.log(together["young_modulus"] / between)))
    assert np.corrcoef(away, np.log(together["young_modulus_spread"]))[0, 1] > 0.2
    assert len(np.unique(together["young_modulus"])) == together["young_modulus"].size  # each draw has one of its own


def test_a_posterior_of_a_lot_is_turned_back_into_its_problem(of_a_lot: tuple[Problem, Posterior]) -> None:
    problem, posterior = of_a_lot
    again = problem_of(posterior, QUICK)
    assert again.names == problem.names
    z = coordinates_of(again, posterior.draws.reshape(-1, len(posterior.parameters))[:20, : len(problem.names)])
    np.testing.assert_allclose(log_posterior(again, z), posterior.log_prob.ravel()[:20], rtol=1e-9)


def test_headlines_of_a_lot_hang_on_their_priors_as_on_independent_beliefs(of_a_lot: tuple[Problem, Posterior]) -> None:
    found = sensitivity_of_headlines(of_a_lot[1])
    assert {"young_modulus", "young_modulus[sensor 1]", "young_modulus[sensor 2]"} <= found.keys()
    assert all(np.isfinite(s.z) for s in found.values())
    assert found["young_modulus[sensor 1]"].likelihood > found["young_modulus[sensor 1]"].prior

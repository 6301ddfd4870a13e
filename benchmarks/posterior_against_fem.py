"""The posterior from the surrogate against that from the finite elements: `python benchmarks/posterior_against_fem.py`.

Two cases on the first specimen of `datasets/padded_sensor`: its force alone, and force and capacitance. Each is calibrated with
the surrogate and again, with the same seed, with the finite elements, which takes more curves than can be solved one by one.
What the posterior varies of the geometry are thicknesses only, a few per cent; everything else scales or is depth. So they are
solved at `--designs` thicknesses around the priors, along one path each, and the logarithm of their ratio to the surrogate is
interpolated: quadratic in the thicknesses, Chebyshev in the root of depth. Every eighth design is left out to tell how far that
is off the finite elements; their own scatter at the accuracy asked for is averaged over.

Prints for every parameter the shift of the mean in posterior standard deviations and the ratio of the standard deviations,
finite elements against surrogate: of the two samples, with the Monte Carlo error of the shift; and of the draws of the first
re-weighted to the second likelihood (PSIS), where what the draws have in common cancels.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from scipy.stats import norm, qmc

from calib.checks.reweighting import reweight
from calib.experiment.experiment_file import read_experiment
from calib.lab.pressing import make_sweep
from calib.problem.measurement import model_sweep
from calib.problem.problem import Problem, build_problem
from calib.sampling.posterior import Posterior, thin_draws
from calib.sampling.sampler import sample
from calib.workers import workers
from models.fem import FiniteElements
from models.response import Response
from models.sensor import Design, FloatArray, design_from
from models.surrogate.surrogate import Surrogate, load_surrogate

DATA = Path(__file__).parents[1] / "datasets" / "padded_sensor"

#: Mean and sd [m] of the priors of the thicknesses: sensor, padding, dielectric.
MEAN, SD = np.array([0.74e-3, 1.10e-3, 0.160e-3]), np.array([0.02e-3, 0.03e-3, 0.006e-3])
HEAD = """
name = "{name}"
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
[priors]
young_modulus = {{ lognormal = ["0.7 MPa", 1.6] }}
machine_compliance = {{ halfnormal = "5 um/N" }}
{electric}
[[specimens]]
name = "sensor 1"
force = "{data}/sensor1_instron.csv"
{capacitance}
[specimens.priors]
sensor_thickness = {{ normal = ["0.74 mm", "0.02 mm"] }}
padding_thickness = {{ normal = ["1.10 mm", "0.03 mm"] }}
{dielectric}
"""
CASES = {
    "force": {"electric": "", "capacitance": "", "dielectric": ""},
    "force and capacitance": {
        "electric": 'relative_permittivity = { normal = [2.8, 0.15] }\nparasitic_capacitance = { normal = ["0 pF", "1 pF"] }',
        "capacitance": f'capacitance = "{DATA}/sensor1_lcr.csv"',
        "dielectric": 'dielectric_thickness = { normal = ["0.160 mm", "0.006 mm"] }',
    },
}

#: The designs are spread by this many sd of the priors; depths of a path; terms of the Chebyshev series; share left out.
SPREAD, N_DEPTH, N_TERM, EVERY = 1.5, 24, 13, 8


def designs(thickness: FloatArray) -> Design:
    """A batch of the specimen with the thicknesses (n, 3)."""
    n = len(thickness)
    fixed = {"indenter_radius": 5e-3, "sensor_radius": 10e-3, "young_modulus": 0.7e6, "relative_permittivity": 2.8}
    varied = dict(zip(("sensor_thickness", "padding_thickness", "dielectric_thickness"), thickness.T, strict=True))
    return design_from({name: np.full(n, value) for name, value in fixed.items()} | varied)


@dataclass(frozen=True, eq=False)
class Correction:
    """A quantity of the finite elements over that of the surrogate, down to the depth `end`: exp of a polynomial.

    Quadratic in the first `used` thicknesses, Chebyshev's in the root of depth: coefficients (n_term, N_TERM).
    """

    used: int
    end: float
    coefficients: FloatArray

    @classmethod
    def fit(cls, used: int, end: float, thickness: FloatArray, depth: FloatArray, ratio: FloatArray) -> Correction:
        """To the logarithms `ratio` (n, n_depth) at thicknesses (n, 3) and depths (n_depth,)."""
        weight = np.sqrt(depth / end)  # the least depths, of hardly any force, have the largest relative scatter
        matrix = np.einsum("nk,dl->ndkl", _quadratics(thickness, used), weight[:, None] * _series(depth, end))
        solution = np.linalg.lstsq(matrix.reshape(ratio.size, -1), (ratio * weight).ravel())[0]
        return cls(used, end, solution.reshape(-1, N_TERM))

    def log_ratio(self, thickness: FloatArray, depth: FloatArray) -> FloatArray:
        """Its logarithm at thicknesses (n, 3) and depths (n, n_depth)."""
        terms = _series(depth, self.end)
        found = np.einsum("nk,kl,ndl->nd", _quadratics(thickness, self.used), self.coefficients, terms, optimize=True)
        return np.asarray(found, dtype=float)


def _quadratics(thickness: FloatArray, used: int) -> FloatArray:
    x = ((thickness - MEAN) / (2 * SD))[:, :used]
    pairs = [x[:, i] * x[:, j] for i in range(used) for j in range(i, used)]
    return np.stack([np.ones(len(x)), *x.T, *pairs], axis=1)


def _series(depth: FloatArray, end: float) -> FloatArray:
    return chebvander(2 * np.sqrt(np.clip(depth / end, 0, 1)) - 1, N_TERM - 1)


@dataclass(frozen=True, eq=False)
class Interpolated:
    """The surrogate corrected to the finite elements; states no error of its own. A `models.response.Forward`."""

    surrogate: Surrogate
    force: Correction
    change: Correction

    @property
    def name(self) -> str:
        """Short name."""
        return "interpolated finite elements"

    @property
    def identity(self) -> str:
        """That of the surrogate, and the corrections' numbers."""
        numbers = b"".join(c.coefficients.tobytes() + np.float64(c.end).tobytes() for c in (self.force, self.change))
        return f"{self.surrogate.identity}, corrected, sha256 {sha256(numbers).hexdigest()}"

    def max_depth(self, design: Design) -> FloatArray:
        """Up to the end of the paths."""
        return np.minimum(self.surrogate.max_depth(design), self.force.end)

    def outside(self, design: Design, depth: FloatArray) -> str:
        """See `models.response.Forward.outside`."""
        end = self.force.end
        beyond = f"depths up to {end * 1e3:.4g} mm are covered" if np.max(depth) > end else ""
        return self.surrogate.outside(design, depth) or beyond

    def respond(self, design: Design, depth: FloatArray) -> Response:
        """See `models.response.Forward.respond`."""
        batch = design.draws()
        rough = self.surrogate.respond(batch, depth)
        layers = (batch.sensor.thickness, batch.padding.thickness, batch.dielectric_thickness)
        thickness = np.stack([np.asarray(t) for t in layers], axis=1)
        rest = rough.rest_capacitance[:, None]
        change = (rough.capacitance - rest) * np.exp(self.change.log_ratio(thickness, rough.depth))
        found = replace(
            rough,
            force=rough.force * np.exp(self.force.log_ratio(thickness, rough.depth)),
            capacitance=rest + change,
            force_error=rough.force_error[..., :0],
            capacitance_error=rough.capacitance_error[..., :0],
        )
        return found if design.is_batch else found.draw(0)


def _solve(accuracy: float, thickness: FloatArray, depth: FloatArray) -> tuple[FloatArray, FloatArray]:
    found = FiniteElements(accuracy).respond(designs(thickness[None]).draw(0), depth)
    return found.force, found.capacitance_change


def interpolate(surrogate: Surrogate, end: float, n: int, accuracy: float, processes: int) -> Interpolated:
    """Solve at n designs down to the depth `end`, fit, and print how far the fit is off at designs that it has not seen."""
    z = norm.ppf(qmc.Sobol(3, rng=7).random(n) * 0.9998 + 1e-4)
    thickness, depth = MEAN + SPREAD * SD * z, end * (np.arange(1, N_DEPTH + 1) / N_DEPTH) ** 2
    with workers(processes) as executor:
        force, change = np.swapaxes(list(executor.map(_solve, [accuracy] * n, thickness, [depth] * n)), 0, 1)
    rough = surrogate.respond(designs(thickness), depth)
    kept, deep = np.arange(n) % EVERY != EVERY - 1, depth > 0.1 * end
    corrections = []
    for name, used, ratio in (
        ("force", 2, np.log(force / rough.force)),
        ("change of capacitance", 3, np.log(change / rough.capacitance_change)),
    ):
        tried = Correction.fit(used, end, thickness[kept], depth, ratio[kept])
        unseen = ratio[~kept]
        left = unseen - tried.log_ratio(thickness[~kept], np.broadcast_to(depth, unseen.shape))
        before, after = (100 * np.sqrt(np.mean(r[:, deep] ** 2)) for r in (unseen, left))
        print(f"{name}: surrogate {before:.4f} % rms off finite elements at {accuracy:g}, interpolation {after:.4f} %", end=" ")
        print(f"({len(unseen)} designs not fitted, from {0.1 * end * 1e3:.2g} to {end * 1e3:.2g} mm)", flush=True)
        corrections.append(Correction.fit(used, end, thickness, depth, ratio))
    return Interpolated(surrogate, *corrections)


def calibrate(case: str, forward: Surrogate | Interpolated, seed: int, steps: int, processes: int) -> tuple[Problem, Posterior]:
    """The posterior of a case with a forward model, after so many steps at most."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "experiment.toml"
        path.write_text(HEAD.format(name=case, data=DATA, **CASES[case]), encoding="utf-8")
        plan = read_experiment(path)
        files = plan.specimens[0].sweeps[0]
        sweep = make_sweep("sensor 1", files.name, files.indenter_radius, files.force, files.capacitance)
        problem = build_problem(plan, (sweep,), forward)
        folder_of_run = Path(folder) / "checkpoint"
        return problem, sample(
            problem, seed=seed, checkpoint=folder_of_run, max_steps=steps, max_seconds=600, processes=min(processes, 4)
        )


def main() -> None:
    """Print a table for each case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--designs", type=int, default=64)
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1, help="0 for none but this")
    parser.add_argument("--accuracy", type=float, default=4e-5, help="of the finite elements")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--steps", type=int, default=20_000, help="of sampling, at most")
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES))
    parser.add_argument("--draws", type=int, help="that are re-weighted, at most [default: all]")
    asked = parser.parse_args()
    fast = load_surrogate()
    start = time.perf_counter()
    first = {case: calibrate(case, fast, asked.seed, asked.steps, asked.processes) for case in asked.cases}
    end = 0.0
    for problem, posterior in first.values():
        draws = thin_draws(posterior, 1000, np.random.default_rng(0))
        end = max(end, 1.02 * float(np.max(model_sweep(problem, fast, problem.plans[0], draws).deepest)))
    exact = interpolate(fast, end, asked.designs, asked.accuracy, asked.processes)
    for case, (_, one) in first.items():
        _, other = calibrate(case, exact, asked.seed, asked.steps, asked.processes)
        values = thin_draws(one, asked.draws or one.log_prob.size, np.random.default_rng(0))
        with workers(asked.processes) as executor:
            found = reweight(one, fast, exact, values, executor)
        again = thin_draws(other, other.log_prob.size, np.random.default_rng(0))
        converged = "both converged" if one.diagnostics.converged and other.diagnostics.converged else "NOT converged"
        print(f"\n{case}: {len(found.shifts)} unknowns, {converged}; {found.n_draw} draws re-weighted, k-hat {found.k_hat:.2f}")
        print(f"  {'':<34}{'two samples':>28}{'re-weighted':>22}")
        print(f"  {'parameter':<34}{'shift of mean / sd':>20}{'sd':>8}{'shift':>15}{'sd':>7}")
        for name, s in found.shifts.items():
            shift = (np.mean(again[name]) - s.mean) / s.sd
            error = np.sqrt(sum(1 / q.diagnostics.parameters[name].ess_bulk for q in (one, other)))
            print(f"  {name:<34}{shift:>+12.3f} ± {error:.3f}{np.std(again[name]) / s.sd:>8.3f}", end="")
            print(f"{s.shift:>+10.3f} ± {s.error:.3f}{s.weighted_sd / s.sd:>7.3f}", flush=True)
    print(f"\n{time.perf_counter() - start:.0f} s in all")


if __name__ == "__main__":
    main()

"""The posterior from the surrogate against that from the finite elements: `python benchmarks/posterior_against_fem.py`.

Two cases on the first specimen of `datasets/padded_sensor`: its force alone, and force and capacitance. Each is calibrated with
the surrogate, and draws of its posterior are re-weighted to the likelihood with finite elements (PSIS). As both posteriors are
seen at the same draws, a shift of a few hundredths of a standard deviation can be told. Prints for every parameter the shift
of the mean in posterior standard deviations with its Monte Carlo error, and the ratio of the standard deviations.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np

from calib.experiment import read_experiment
from calib.likelihood import build_problem
from calib.posterior import sample, thin_draws
from calib.reweight import reweight
from calib.sweep import make_sweep
from models.fem import FiniteElements
from models.surrogate import load_surrogate

DATA = Path(__file__).parents[1] / "datasets" / "padded_sensor"

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


def main() -> None:
    """Print a table for each case."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=400)
    parser.add_argument("--processes", type=int, default=None)
    parser.add_argument("--accuracy", type=float, default=1e-4, help="of the finite elements")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    fast = load_surrogate()
    for name, parts in CASES.items():
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "experiment.toml"
            path.write_text(HEAD.format(name=name, data=DATA, **parts), encoding="utf-8")
            plan = read_experiment(path)
            files = plan.specimens[0].sweeps[0]
            sweep = make_sweep("sensor 1", files.name, files.indenter_radius, files.force, files.capacitance)
            problem = build_problem(plan, (sweep,), fast)
            posterior = sample(problem, seed=asked.seed, checkpoint=Path(folder) / "checkpoint", max_seconds=600)
        start = time.perf_counter()
        values = thin_draws(posterior, asked.draws, np.random.default_rng(asked.seed))
        with ProcessPoolExecutor(asked.processes) as executor:
            found = reweight(posterior, fast, FiniteElements(asked.accuracy), values, executor)
        took = time.perf_counter() - start
        converged = "converged" if posterior.diagnostics.converged else "NOT converged"
        print(f"{name}: {len(found.shifts)} unknowns, {converged}; {found.n_draw} draws, {found.ess:.0f} effective,", end=" ")
        print(f"k-hat {found.k_hat:.2f} (limit {found.k_limit:.2f}), {took:.0f} s")
        print(f"  {'parameter':<34}{'shift of mean / sd':>22}{'sd ratio':>10}")
        for parameter, s in found.shifts.items():
            print(f"  {parameter:<34}{s.shift:>+12.3f} ± {s.error:.3f}  {s.weighted_sd / s.sd:>10.3f}", flush=True)


if __name__ == "__main__":
    main()

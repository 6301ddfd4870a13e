"""Calibrate simulated lots under partial pooling: `python benchmarks/lots.py -n 2 3 5 --labs 60 -o lots.jsonl`.

A lab is drawn from what its experiment believes: modulus and spread of the lot, moduli and thicknesses of the specimens,
rig, noise and discrepancies; its curves by the surrogate. One more specimen of the lot is drawn that no calibration sees.
Printed for each size of a lot: in how many labs the truth lies within the central 90 % - of the lot's modulus, its spread,
the moduli of the specimens, and the modulus of the next one. Posteriors are the weighted draws of a first answer where their
weights can be trusted (k-hat below 0.7, 200 effective draws), as in `calib prove`; the others are left out and counted, or
sampled with --sample.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from simulated.labs import keep_row, kept_rows
from specimens import with_discrepancy

from calib.decision.next_specimen import as_next_specimen
from calib.errors import InputError
from calib.experiment import Experiment, Specimen, forward_of_experiment, read_experiment
from calib.priors import HalfNormal, LogNormal, Normal, Prior, default_prior
from calib.problem import Problem, build_problem, values_at, values_of_lot
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.sampling import K_HAT, Gate, look_at, sample, smooth_weights
from models.response import Forward
from models.sensor import FloatArray, design_from

EXPERIMENT = Path(__file__).parents[1] / "datasets" / "padded_sensor" / "experiment.toml"
#: How deep the ball is pressed [m], and points of each channel.
DEPTH, POINTS = 0.55e-3, 25
#: Effective draws from which a first answer is taken for the posterior, and what chains have to reach; most steps of them.
WORTH, GATE, MOST_STEPS = 200.0, Gate(r_hat=1.02, ess=200.0), 4000
# What is believed of the lot and the rig, and what a microscope reads of each specimen: median and error.
_LOT: Mapping[str, Prior] = {
    "young_modulus": LogNormal(0.7e6, 1.3),
    "young_modulus_spread": default_prior("young_modulus_spread"),
    "relative_permittivity": Normal(2.8, 0.15),
    "machine_compliance": HalfNormal(5e-6),
    "parasitic_capacitance": Normal(0.0, 1e-12),
}
_READ: Mapping[str, Prior] = {
    "sensor_thickness": Normal(0.74e-3, 0.02e-3),
    "padding_thickness": Normal(1.1e-3, 0.03e-3),
    "dielectric_thickness": Normal(0.16e-3, 0.006e-3),
}
_RIG = ("machine_compliance", "parasitic_capacitance", "force_noise", "capacitance_noise")


def lab(n: int, seed: int) -> tuple[Problem, dict[str, float]]:
    """The calibration of a simulated lot of n specimens, and the true values [SI] of its unknowns and of the next modulus."""
    plain = read_experiment(EXPERIMENT)
    forward = forward_of_experiment(plain)
    for attempt in range(50):
        try:
            return _drawn(plain, forward, n, np.random.default_rng([n, seed, attempt]))
        except (InputError, ValueError):  # a sensor that cannot be, or that the surrogate does not cover: no lab has it
            continue
    raise ValueError("no lab could be drawn")


def _drawn(plain: Experiment, forward: Forward, n: int, rng: np.random.Generator) -> tuple[Problem, dict[str, float]]:
    def of(prior: Prior) -> float:
        return float(prior.ppf_normal(rng.standard_normal()))

    truth = {name: of(prior) for name, prior in _LOT.items()} | {"force_noise": 5e-3, "capacitance_noise": 1e-14}
    truth |= {f"{channel}_discrepancy": of(default_prior(f"{channel}_discrepancy")) for channel in ("force", "capacitance")}
    specimens, sweeps = [], []
    for k in range(n):
        name = f"sensor {k}"
        own = {"young_modulus": truth["young_modulus"] * math.exp(truth["young_modulus_spread"] * rng.standard_normal())}
        own |= {quantity: of(prior) for quantity, prior in _READ.items()}
        zeros = {
            "contact_offset": 0.2e-3,
            "load_zero": 0.3 * rng.standard_normal(),
            "clock_offset": 2.0 * rng.standard_normal(),
        }
        truth |= {f"{quantity}[{name}]": value for quantity, value in (own | zeros).items()}
        specimens.append(Specimen(name, plain.specimens[0].sweeps, dict(_READ)))
        design = design_from(
            {
                **own,
                "relative_permittivity": truth["relative_permittivity"],
                "indenter_radius": 5e-3,
                "sensor_radius": plain.sensor_radius,
            }
        )
        rig = Rig(**zeros, **{of_rig: truth[of_rig] for of_rig in _RIG})
        sweeps.append(synthetic_sweep(forward, design, DEPTH, rig, rng, specimen=name, n_points=POINTS))
    whole = replace(plain, pooling="partial", specimens=tuple(specimens), priors={**plain.priors, **_LOT})
    problem = build_problem(whole, sweeps, forward)
    truth["next"] = truth["young_modulus"] * math.exp(truth["young_modulus_spread"] * rng.standard_normal())
    return build_problem(whole, with_discrepancy(problem, truth, rng), forward), truth


def answer(n: int, seed: int, sampled: bool) -> dict[str, Any]:
    """One lab: where truth lies in its posterior, as the share of draws below; nothing where there is none."""
    problem, truth = lab(n, seed)
    built = time.process_time()
    row: dict[str, Any] = {"specimens": n, "seed": seed, "by": "none", "effective": 0.0, "k_hat": math.inf}
    values: Mapping[str, FloatArray] = {}
    weight: FloatArray = np.empty(0)
    try:
        look = look_at(problem)
        weight, row["k_hat"] = smooth_weights(np.log(np.maximum(look.weight, 1e-300)))
        row["effective"] = round(look.effective_draws, 1)
        if look.confirmed and look.effective_draws > WORTH and row["k_hat"] < K_HAT:
            row["by"] = "first answer"
            values = {
                **values_at(problem, look.theta),
                **values_of_lot(problem, look.theta, np.random.default_rng([n, seed, 1])),
            }
    except ValueError:  # there is none
        pass
    if not values and sampled:
        posterior = sample(problem, seed=seed, processes=0, gate=GATE, max_steps=MOST_STEPS)
        row["by"] = "chains" if posterior.diagnostics.converged else "not converged"
        draws = posterior.draws.reshape(-1, posterior.draws.shape[-1])
        values = {p.name: draws[:, k] for k, p in enumerate(posterior.parameters)}
        weight = np.full(len(draws), 1 / len(draws))
    row["processor"] = round(time.process_time() - built, 2)
    if values:
        following = as_next_specimen(values, np.random.default_rng([n, seed, 2]))["young_modulus"]
        places = {**values, "next": following}
        row["ranks"] = {q: round(float(weight @ (v < truth[q]) / np.sum(weight)), 4) for q, v in places.items() if q in truth}
    return row


#: What the table tells of: its name, and the names of the unknowns, or where these begin.
ROWS = (
    ("modulus of the lot", "young_modulus"),
    ("its spread", "young_modulus_spread"),
    ("moduli of the specimens", "young_modulus["),
    ("modulus of the next", "next"),
)


def report(rows: Sequence[Mapping[str, Any]]) -> None:
    """Print how often 90 % intervals hold the truth, for each size of a lot."""
    print(
        f"{'specimens':>9} {'labs':>5} {'sampled':>7} {'left out':>8} {'CPU [s]':>8}   " + "   ".join(name for name, _ in ROWS)
    )
    for n in sorted({row["specimens"] for row in rows}):
        every = [row for row in rows if row["specimens"] == n]
        own = [row for row in every if "ranks" in row]
        cells = []
        for name, key in ROWS:
            found = [
                r for row in own for of, r in row["ranks"].items() if (of.startswith(key) if key[-1] == "[" else of == key)
            ]
            inside = sum(0.05 < rank < 0.95 for rank in found) / max(len(found), 1)
            error = math.sqrt(0.9 * 0.1 / max(len(own), 1))
            cells.append(f"{f'{inside:.0%} ± {error:.0%}':>{len(name)}}")
        seconds = float(np.median([row["processor"] for row in every]))
        chains = sum(row["by"] in ("chains", "not converged") for row in own)
        print(f"{n:9d} {len(own):5d} {chains:7d} {len(every) - len(own):8d} {seconds:8.1f}   " + "   ".join(cells))


def main(words: Sequence[str] | None = None) -> None:
    """Print a table of all labs that are kept, those that were not there answered first."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, nargs="+", default=[2, 3, 5], help="specimens of a lot")
    parser.add_argument("--labs", type=int, default=60, help="of each size")
    parser.add_argument("--sample", action="store_true", help="sample labs whose weighted draws cannot be trusted")
    parser.add_argument("-o", "--output", type=Path, help="file for the labs, a line of JSON each")
    given = parser.parse_args(words)
    rows = kept_rows(given.output)
    known = {(row["specimens"], row["seed"]) for row in rows}
    for seed in range(given.labs):
        for n in given.n:
            if (n, seed) not in known:
                rows.append(answer(n, seed, given.sample))
                keep_row(given.output, rows[-1])
    report(rows)


if __name__ == "__main__":
    main()

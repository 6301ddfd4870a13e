"""From random designs over the whole plausible range to the share of loading paths that end, and whether any answer is wrong.

`python benchmarks/fem_robustness.py --designs 500 --seed 1 --processes 2`, with `--foam` for compressible paddings

Every design is pressed to the smaller of 60 % local compression of a layer on the axis and d = R/2. A path is right if the
work of the ball is the stored energy to 0.5 % and the penetration, along the deformed edges and not at their nodes alone, stays
below 1e-4 of the indentation at every step.
"""

from __future__ import annotations

import argparse
import os
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


import numpy as np

from models.fem import dimensionless
from models.fem.check import work
from models.fem.equilibrium import Failure, State, compression, make_model, stored_energy
from models.fem.path import walk
from models.layers import layered
from models.sensor import Design, design_from

#: Steps of a path: d = end * s^2 at equal steps of s, as the contact radius grows about linearly in s.
STEPS = (np.arange(1, 21) / 20) ** 2
LOCAL_COMPRESSION = 0.6


@dataclass(frozen=True)
class Outcome:
    """One path: how far it came of its goal, why it ended early if it did, and the checks."""

    design: Design
    reached: float
    reason: str
    energy_error: float
    penetration: float
    seconds: float
    indefinite: bool


def random_designs(n: int, seed: int, *, foam: bool = False) -> list[Design]:
    """Designs log-uniform in E_p/E 0.05-20, h_s 0.2-3, a 3-25, R 1-20 mm with a >= R, uniform in h_p 0-10 mm.

    With `foam` uniform in the padding's Poisson's ratio 0-0.5, too.
    """
    rng = np.random.default_rng(seed)

    def log_uniform(low: float, high: float) -> float:
        return float(low * (high / low) ** rng.uniform())

    designs: list[Design] = []
    while len(designs) < n:
        radius, disc = log_uniform(1e-3, 20e-3), log_uniform(3e-3, 25e-3)
        values = {
            "indenter_radius": radius,
            "sensor_thickness": log_uniform(0.2e-3, 3e-3),
            "sensor_radius": disc,
            "young_modulus": 0.6e6,
            "relative_permittivity": 2.8,
            "padding_thickness": rng.uniform(0, 10e-3),
            "padding_young_modulus": 0.6e6 * log_uniform(0.05, 20),
        }
        if foam:
            values["padding_poisson_ratio"] = rng.uniform(0, 0.5)
        if disc >= radius:
            designs.append(design_from(values))
    return designs


def press(design: Design, accuracy: float) -> Outcome:
    """One loading path."""
    scaled, _ = dimensionless(layered(design))
    end = min(0.5, LOCAL_COMPRESSION * scaled.thickness)
    start = time.process_time()
    model = make_model(scaled, end, accuracy)
    states: list[State] = []
    reason = ""
    for state in walk(model, end * STEPS):
        if isinstance(state, Failure):
            reason = state.reason
            break
        states.append(state)
        if np.max(compression(model, state)) >= LOCAL_COMPRESSION:
            break
    seconds = time.process_time() - start
    if not states:
        return Outcome(design, 0.0, reason, np.nan, np.nan, seconds, False)
    return Outcome(
        design,
        states[-1].depth / end if reason else 1.0,
        reason,
        work(states) / stored_energy(model, states[-1]) - 1,
        max(s.penetration / s.depth for s in states),
        seconds,
        not all(s.positive_definite for s in states),
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--designs", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--foam", action="store_true", help="paddings of any Poisson's ratio from 0 to 0.5")
    parser.add_argument("--accuracy", type=float, default=1e-3)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    given = parser.parse_args()
    designs = random_designs(given.designs, given.seed, foam=given.foam)
    with ProcessPoolExecutor(given.processes) as executor:
        outcomes = list(executor.map(press, designs, [given.accuracy] * len(designs), chunksize=4))
    ended = [o for o in outcomes if not o.reason]
    error = np.abs([o.energy_error for o in outcomes])
    times = [o.seconds for o in outcomes]
    print(f"{len(ended)} of {len(outcomes)} paths reach the end ({len(ended) / len(outcomes):.1%})")
    spread = f"median {np.nanmedian(error):.1e}, 99 % {np.nanquantile(error, 0.99):.1e}, worst {np.nanmax(error):.1e}"
    print(f"work against stored energy: {spread}")
    overlap = np.array([o.penetration for o in outcomes])
    spread = f"median {np.nanmedian(overlap):.1e}, worst {np.nanmax(overlap):.1e}"
    print(f"penetration over depth, between nodes too: {np.mean(overlap < 1e-4):.1%} of the paths below 1e-4, {spread}")
    print(f"an indefinite tangent on the way: {sum(o.indefinite for o in outcomes)}")
    spread = f"median {np.median(times):.2f}, 95 % {np.quantile(times, 0.95):.2f}, worst {max(times):.2f}"
    print(f"seconds a path of {STEPS.size} steps: {spread}")
    for o in outcomes:
        p = {k: float(v) for k, v in o.design.parameters().items()}
        name = ", ".join(
            f"{k} {p[v] * 1e3:.3g}"
            for k, v in (
                ("R", "indenter_radius"),
                ("h_s", "sensor_thickness"),
                ("h_p", "padding_thickness"),
                ("a", "sensor_radius"),
            )
        )
        name += f" mm, E_p/E {p['padding_young_modulus'] / p['young_modulus']:.3g}, nu_p {p['padding_poisson_ratio']:.3g}"
        if o.reason:
            print(f"ended at {o.reached:.0%}: {name}: {o.reason}")
        elif abs(o.energy_error) > 5e-3 or o.penetration > 1e-4:
            print(f"wrong: {name}: energy {o.energy_error:+.2%}, penetration {o.penetration:.1e}")


if __name__ == "__main__":
    main()

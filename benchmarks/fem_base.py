"""Friction between stack and base: how far off it is, what it does, how robust it is: `python benchmarks/fem_base.py`.

`hill`: a plate on a thin disc of which all slides, against the friction hill of the slab method. `sensor`: force and change of
capacitance of the paper's sensor from a slippery base to a bonded one, on three paddings, and work against what is stored and
what friction takes. `designs`: random designs and coefficients, how many reach the end of their path.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import replace

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from models.examples import PAPER_SENSOR
from models.fem import FiniteElements
from models.fem.check import taken_by_base, work
from models.fem.equilibrium import stored_energy
from models.fem.solution import Solution
from models.layers import Dielectric, Layer, LayeredDesign, flat_punch, layered
from models.sensor import FloatArray, design_from
from models.surrogate.domain import COMPRESSION, DEPTH
from models.surrogate.families import FAMILIES
from models.surrogate.points import random_groups
from models.surrogate.training import design_of

FRICTIONS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 4.0, np.inf)


def rubbing(design: LayeredDesign, coefficient: float, depth: FloatArray, accuracy: float) -> Solution:
    """Press a design on a base of some friction."""
    on_base = replace(design, base="slippery", base_friction_coefficient=coefficient)
    return FiniteElements(accuracy).solve(on_base, depth)


def hill(accuracy: float) -> None:
    """Force over that without friction, against 2 (exp(k) - 1 - k)/k^2 with k = f a/h."""
    print("plate on a disc that slides: force over that without friction, against the friction hill")
    h, frictions = 1e-3, (0.01, 0.02, 0.03, 0.05)
    depth = np.array([0.5e-3, 1e-3, 2e-3, 4e-3]) * h
    print("a/h     " + "".join(f"f = {f:<10g}" for f in frictions))
    for slenderness in (3, 5, 10, 20, 30):
        a = slenderness * h
        disc = LayeredDesign(flat_punch(6 * a, 1e-3), (Layer(h, 0.6e6),), a, a, (Dielectric(0.6 * h, h, 2.8),))
        free = rubbing(disc, 0.0, depth, accuracy).response.force
        row = []
        for f in frictions:
            k = f * slenderness
            off = rubbing(disc, f, depth, accuracy).response.force / free * k**2 / (2 * (np.exp(k) - 1 - k)) - 1
            row.append(off[np.argmax(np.abs(off))])
        print(f"{slenderness:<8g}" + "".join(f"{off:<+14.3%}" for off in row))
    print()


def sensor(accuracy: float) -> None:
    """The paper's sensor on three paddings, at half and all of a depth."""
    for padding, deepest in ((0.3e-3, 0.3e-3), (1.1e-3, 0.6e-3), (5e-3, 1.5e-3)):
        design = layered(design_from(PAPER_SENSOR | {"padding_thickness": padding}))
        print(f"paper's sensor on {padding * 1e3:g} mm of padding, pressed {deepest * 1e3:g} mm")
        print("f       force at half  force    change at half  change   work - stored - taken  taken   of base slips  seconds")
        depth = np.linspace(0, deepest, 21)[1:]
        for f in FRICTIONS:
            began = time.process_time()
            found = rubbing(design, f, depth, accuracy)
            seconds = time.process_time() - began
            if found.failure is not None:
                print(f"{f:<8g}{found.failure.reason}")
                continue
            r, last = found.response, found.states[-1]
            stored, taken = stored_energy(found.model, last), taken_by_base(found)
            off = work(found.states) / (stored + taken) - 1
            print(
                f"{f:<8g}{r.force[9]:<15.4f}{r.force[-1]:<9.4f}{r.capacitance_change[9]:<16.3%}{r.capacitance_change[-1]:<9.3%}"
                f"{off:<+23.1e}{taken / stored:<8.1%}{np.mean(last.sliding.slip != 0):<15.0%}{seconds:.1f}"
            )
        print()


def designs(n: int, accuracy: float) -> None:
    """Random designs of the surrogate's range on bases of f from 0.03 to 3, with and without friction of the ball."""
    rng = np.random.default_rng(20261128)
    reached, off, seconds = 0, [], []
    for k, groups in enumerate(random_groups(n, rng, FAMILIES["slippery"])):
        h_s, h_p = groups[:2]
        design = replace(design_of(groups, FAMILIES["slippery"]), friction_coefficient=0.3 * (k % 2))
        coefficient = float(np.exp(rng.uniform(np.log(0.03), np.log(3))))
        depth = 0.95 * min(DEPTH, COMPRESSION * (h_s + h_p)) * np.linspace(0, 1, 21)[1:] ** 2
        began = time.process_time()
        found = rubbing(design, coefficient, depth, accuracy)
        seconds.append(time.process_time() - began)
        if found.failure is None:
            reached += 1
            if k % 2 == 0:
                balance = stored_energy(found.model, found.states[-1]) + taken_by_base(found)
                off.append(abs(work(found.states) / balance - 1))
        else:
            names = ", ".join(f"{x:.3g}" for x in groups)
            print(f"{names} on f = {coefficient:.3g}: {found.failure.reason} at {found.failure.depth:.3g} of {depth[-1]:.3g}")
    print(f"{reached} of {n} paths reach the end, {np.median(seconds):.1f} s in the median, {np.max(seconds):.1f} s at worst")
    if off:
        print(f"work against what is stored and taken: median {np.median(off):.1e}, worst {np.max(off):.1e}")


def main() -> None:
    """Run the parts that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", choices=("hill", "sensor", "designs"), default=["hill", "sensor", "designs"])
    parser.add_argument("--accuracy", type=float, default=1e-3, help="of the finite elements")
    parser.add_argument("--designs", type=int, default=100, help="random ones")
    words = parser.parse_args()
    if "hill" in words.parts:
        hill(words.accuracy)
    if "sensor" in words.parts:
        sensor(words.accuracy)
    if "designs" in words.parts:
        designs(words.designs, words.accuracy)


if __name__ == "__main__":
    main()

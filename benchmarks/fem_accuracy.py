"""From the paper's sensor (and reference curves, if given) to how far off the finite elements are and why.

`python benchmarks/fem_accuracy.py [--references FOLDER] [--finest 2e-5]`

Prints the error against the accuracy asked for with the observed rate, the balance of energy, the ring formula beside Laplace's
equation for thin and thick dielectrics, exact small-strain solutions, and each reference curve at its every point. FOLDER holds
an index.json and the CSV files it names (columns d_mm, F_N, dC).
"""

from __future__ import annotations

import argparse
import json
import os
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from forward_models import STEPS

from models.analytic import bonded_layer_factor, hertz_force
from models.examples import PAPER_SENSOR
from models.fem import FiniteElements
from models.fem.check import energy_error
from models.fem.laplace import laplace_capacitance
from models.sensor import VACUUM_PERMITTIVITY, Design, FloatArray, design_from


def convergence(finest: float) -> None:
    """Error against the mesh of the accuracy `finest`, rms over the steps, with the rate in the element size."""
    design = design_from(PAPER_SENSOR)
    exact = FiniteElements(finest).solve(design, STEPS)
    print("accuracy   elements   seconds   error of force (rms, worst)   rate   of capacitance change     energy balance")
    last = np.nan
    for accuracy in (6.4e-2, 1.6e-2, 4e-3, 1e-3, 2.5e-4):
        if accuracy < 10 * finest:
            break
        start = time.perf_counter()
        found = FiniteElements(accuracy).solve(design, STEPS)
        seconds = time.perf_counter() - start
        force = found.response.force / exact.response.force - 1
        change = found.response.capacitance_change / exact.response.capacitance_change - 1
        rms, rms_change = (float(np.sqrt(np.mean(e**2))) for e in (force, change))
        shape = found.model.mesh.shape
        print(
            f"{accuracy:8.3%} {shape[0]:5d} x {shape[1]:2d} {seconds:9.2f} {rms:15.3%} {np.max(np.abs(force)):10.3%} "
            f"{np.log2(last / rms):7.1f} {rms_change:12.3%} {np.max(np.abs(change)):10.3%} {energy_error(found):+14.1e}"
        )
        last = rms
    print()


def rings_and_laplace() -> None:
    """Change of capacitance by both, for dielectrics from thin to half the sensor."""
    print("t_d/h_s   depth     rings      Laplace    difference, share of the change")
    for share in (0.1, 0.2, 0.3, 0.4, 0.5):
        design = design_from(PAPER_SENSOR | {"dielectric_thickness": share * 0.74e-3})
        solution = FiniteElements().solve(design, np.array([0.1, 0.2, 0.4, 0.6]) * 1e-3)
        length, mesh = solution.units.length, solution.model.mesh
        for state, rings in zip(solution.states, solution.response.capacitance_change, strict=True):
            c = sum(
                d.relative_permittivity
                * laplace_capacitance(
                    mesh, state.u, d.lower / length, d.upper / length, solution.design.electrode_radius / length
                )
                for d in solution.design.dielectrics
            )
            field = VACUUM_PERMITTIVITY * length * c / solution.design.rest_capacitance - 1
            print(f"{share:5.1f} {state.depth * length * 1e3:9.2f} mm {rings:10.4%} {field:10.4%} {rings / field - 1:+12.2%}")
    print()


def exact_solutions() -> None:
    """Hertz with the exact factor of a bonded layer, small strain."""
    print("R, h, d (mm)          chi     force against Hertz with a bonded layer")
    for radius, h, depth in ((5, 5, 0.02), (5, 5, 0.05), (5, 2, 0.02), (10, 2, 0.05), (20, 1, 0.02), (20, 1, 0.05)):
        design = design_from(
            PAPER_SENSOR
            | {
                "indenter_radius": radius * 1e-3,
                "sensor_thickness": 0.5e-3,
                "padding_thickness": (h - 0.5) * 1e-3,
                "sensor_radius": 25e-3,
            }
        )
        d = np.array([depth * 1e-3])
        chi = np.sqrt(radius * depth) / h
        exact = hertz_force(0.69e6, radius * 1e-3, d) * bonded_layer_factor(np.array([chi]))
        print(f"{radius:4g} {h:4g} {depth:6g} {chi:12.3f} {FiniteElements().respond(design, d).force[0] / exact[0] - 1:+12.2%}")
    print()


def references(folder: Path) -> None:
    """Every listed point of the reference curves."""
    print("case    points   seconds   force: worst, stated   capacitance change: worst, stated")
    for case in json.loads((folder / "index.json").read_text()):
        depth, force, change = np.loadtxt(folder / case["file"], delimiter=",", skiprows=1).T
        start = time.perf_counter()
        found = FiniteElements().respond(_reference_design(case["design"]), depth * 1e-3)
        seconds = time.perf_counter() - start
        stated = case["rel_change_on_mesh_refinement"]

        def worst(value: FloatArray, truth: FloatArray) -> float:
            return float(np.max(np.abs(value / truth - 1)))

        print(
            f"{case['name']:6} {depth.size:6d} {seconds:10.2f} {worst(found.force, force):12.2%} {stated['F']:8.2%} "
            f"{worst(found.capacitance_change, change):15.2%} {stated['dC']:10.2%}"
        )


def _reference_design(d: dict[str, float]) -> Design:
    return design_from(
        {
            "indenter_radius": d["R"] * 1e-3,
            "sensor_thickness": d["h_s"] * 1e-3,
            "sensor_radius": d["a"] * 1e-3,
            "young_modulus": 3e6 * d["mu_s"],
            "relative_permittivity": 2.8,
            "padding_thickness": d["h_p"] * 1e-3,
            "padding_young_modulus": 3e6 * d["mu_p"],
        }
    )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--references", type=Path)
    parser.add_argument("--finest", type=float, default=2e-5, help="accuracy that others ten times as coarse are measured by")
    given = parser.parse_args()
    convergence(given.finest)
    rings_and_laplace()
    exact_solutions()
    if given.references is not None:
        references(given.references)


if __name__ == "__main__":
    main()

"""From compressible paddings to how far the finite elements are off exact layers and another finite-element code.

`python benchmarks/fem_foam.py --parts hayes uniaxial mesh softening felupe`

`hayes`: a ball on a bonded layer at small strain against the integral equation of Hayes et al. (J. Biomech. 5 (1972) 541).
`uniaxial`: a disc between slippery plates, in closed form. `mesh`: the error against a finer mesh. `softening`: force on
silicone over that on a foam of the same modulus, of the paper's stack and of thin ones. `felupe`: sensor on foam at finite
strain by FElupe (`pip install felupe tensortrax`), whose material is the energy itself, differentiated automatically, in
displacement elements of high order under a penalty; the sensor's Poisson's ratio is 0.49 in both, as displacement elements do
not go much nearer to 0.5.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import time
from dataclasses import replace

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from forward_models import STEPS
from peers.felupe_layers import SENSOR_POISSON_RATIO, Stack, press
from scipy.optimize import brentq

from models.analytic import ball_on_bonded_layer
from models.examples import PAPER_SENSOR
from models.fem import FiniteElements
from models.fem.check import energy_error
from models.layers import Dielectric, Layer, LayeredDesign, Profile, flat_punch, layered, sphere
from models.sensor import Base, design_from

MODULUS = 0.69e6
#: What the finite elements take 0.5 for: lambda = 1e4 mu.
NEARLY_HALF = 0.49995


def stack(profile: Profile, layers: tuple[Layer, ...], radius: float, base: Base = "bonded") -> LayeredDesign:
    """Layers on a base, with a dielectric somewhere, as there has to be one."""
    top = sum(x.thickness for x in layers)
    return LayeredDesign(profile, layers, radius, radius, (Dielectric(0.5 * top, top, 2.8),), 0.0, base)


def hayes() -> None:
    """Force at a depth of a thousandth of the thickness or less."""
    print("ball on a bonded layer at small strain: force against the integral equation")
    print("nu      " + "".join(f"a/h = {x:<8g}" for x in (0.25, 0.5, 1, 2, 3)))
    worst = 0.0
    for nu in (0.0, 0.3, 0.4, 0.45, 0.49, 0.5):
        row = []
        for a in (0.25, 0.5, 1.0, 2.0, 3.0):
            ball = 1000 * a
            depth, force = ball_on_bonded_layer(a, ball, min(nu, NEARLY_HALF))
            layer = Layer(1e-3, 1e6, poisson_ratio=nu)
            design = stack(sphere(ball * 1e-3), (layer,), (a + 8) * 1e-3)
            found = FiniteElements(1e-4).respond(design, np.array([depth * 1e-3])).force[0]
            row.append(found / force - 1)
        worst = max(worst, *np.abs(row))
        print(f"{nu:<8g}" + "".join(f"{x:<+14.3%}" for x in row))
    print(f"worst {worst:.3%}\n")


def uniaxial_stress(stretch: float, nu: float) -> float:
    """P/E of a compressible neo-Hookean bar: free sides, mu (r - 1/r) + lambda (J - 1) r L = 0 with the lateral stretch r."""
    mu = 1 / (2 * (1 + nu))
    lame = 2 * mu * nu / (1 - 2 * nu)

    def side(r: float) -> float:
        return mu * (r - 1 / r) + lame * (r**2 * stretch - 1) * r * stretch

    r = float(brentq(side, 0.5, 2.0, xtol=1e-15))
    return mu * (stretch - 1 / stretch) + lame * (r**2 * stretch - 1) * r**2


def uniaxial() -> None:
    """Force of a disc between slippery plates."""
    print("uniaxial compression to 30, 60 %: force against the closed form")
    for nu in (0.0, 0.15, 0.3, 0.45, 0.49, 0.499):
        design = stack(flat_punch(30e-3, 1e-3), (Layer(4e-3, 1e6, poisson_ratio=nu),), 5e-3, "slippery")
        found = FiniteElements(1e-2).respond(design, np.array([1.2e-3, 2.4e-3])).force
        exact = [-np.pi * 25 * uniaxial_stress(stretch, nu) for stretch in (0.7, 0.4)]
        print(f"{nu:<8g}" + "".join(f"{x:<+14.1e}" for x in found / exact - 1))
    print()


def _force_on_layer(depth: float, near: float, nu: float) -> float:
    """Force of a ball of radius 1e4 at a small depth in a layer of thickness 1, with a contact of about `near`."""
    a = brentq(lambda x: ball_on_bonded_layer(x, 1e4, nu)[0] / depth - 1, 0.3 * near, 2 * near)
    return ball_on_bonded_layer(float(a), 1e4, nu)[1]


def mesh() -> None:
    """Error of force and capacitance change of the paper's sensor on foams, against a mesh for 0.005 %."""
    print("accuracy asked for: rms (worst step) of force and capacitance change, energy balance, seconds, Newton steps")
    for nu in (0.5, 0.49, 0.45, 0.3, 0.0):
        design = design_from(PAPER_SENSOR | {"padding_poisson_ratio": nu})
        exact = FiniteElements(5e-5).respond(design, STEPS)
        for accuracy in (4e-3, 1e-3, 2.5e-4):
            start = time.process_time()
            found = FiniteElements(accuracy).solve(design, STEPS)
            seconds = time.process_time() - start
            force = found.response.force / exact.force - 1
            change = found.response.capacitance_change / exact.capacitance_change - 1
            rms = [f"{np.sqrt(np.mean(e**2)):7.3%} ({np.max(np.abs(e)):6.3%})" for e in (force, change)]
            newton = sum(len(x.newton) for x in found.states)
            print(f"{nu:<6g} {accuracy:8.3%}  {rms[0]}  {rms[1]}  {energy_error(found):+.1e}  {seconds:.2f}  {newton}")
    print()


def softening() -> None:
    """Force on silicone over that on a foam of the same modulus."""
    print("force on an incompressible padding over that on one of nu and the same modulus, at equal depth")
    nus = (0.49, 0.45, 0.4, 0.3, 0.15, 0.0)
    print(f"{'':40s}" + "".join(f"{nu:<8g}" for nu in nus))
    for words, values, depth in (
        ("the paper's sensor, 0.2 mm", PAPER_SENSOR, 0.2e-3),
        ("the paper's sensor, 0.7 mm", PAPER_SENSOR, 0.7e-3),
        ("h_s 0.2, h_p 1 mm, 0.2 mm", PAPER_SENSOR | {"sensor_thickness": 0.2e-3, "padding_thickness": 1e-3}, 0.2e-3),
        ("h_s 0.2, h_p 1 mm, 0.4 mm", PAPER_SENSOR | {"sensor_thickness": 0.2e-3, "padding_thickness": 1e-3}, 0.4e-3),
        ("h_s 0.2, h_p 0.5 mm, 0.2 mm", PAPER_SENSOR | {"sensor_thickness": 0.2e-3, "padding_thickness": 0.5e-3}, 0.2e-3),
    ):
        force = [
            FiniteElements().respond(design_from(values | {"padding_poisson_ratio": nu}), np.array([depth])).force[0]
            for nu in (0.5, *nus)
        ]
        print(f"{words:40s}" + "".join(f"{force[0] / f:<8.3f}" for f in force[1:]))
    for a in (0.5, 1.0, 2.0, 4.0):
        force = []
        depth = ball_on_bonded_layer(a, 1e4, 0.3)[0]
        for nu in (NEARLY_HALF, *nus):
            force.append(_force_on_layer(depth, a, nu))
        words = f"one layer, small strain, a/h {a:g} at nu 0.3"
        print(f"{words:40s}" + "".join(f"{force[0] / f:<8.3f}" for f in force[1:]))
    print()


#: h_s, h_p, radius of disc and ball [mm], E_p/E, nu_p, largest depth and size of FElupe's elements [mm].
CASES = (
    (0.74, 1.10, 10.0, 5.0, 1.0, 0.3, 0.7, 0.11),
    (0.74, 1.10, 10.0, 5.0, 0.2, 0.0, 0.7, 0.11),
    (0.5, 0.5, 8.0, 4.0, 1.0, 0.45, 0.3, 0.11),
    (1.0, 3.0, 10.0, 5.0, 0.5, 0.4, 1.2, 0.16),
    (0.4, 2.0, 6.0, 3.0, 2.0, 0.15, 0.5, 0.13),
)


def against_felupe(accuracy: float, order: int, n_case: int, n_step: int) -> None:
    """Force and capacitance change of sensors on foams against FElupe."""
    if importlib.util.find_spec("felupe") is None:
        print("FElupe is not there: pip install felupe tensortrax")
        return
    print("sensor on foam against FElupe; its two meshes apart; force [N] and change of both")
    worst = np.zeros(2)
    for h_s, h_p, a, ball, ratio, nu, deepest, size in CASES[:n_case]:
        depth = deepest * np.arange(1, n_step + 1) / n_step
        design = design_from(
            PAPER_SENSOR
            | {
                "sensor_thickness": h_s * 1e-3,
                "padding_thickness": h_p * 1e-3,
                "sensor_radius": a * 1e-3,
                "indenter_radius": ball * 1e-3,
                "padding_young_modulus": ratio * MODULUS,
                "padding_poisson_ratio": nu,
            }
        )
        plain = layered(design)
        sensor = replace(plain.layers[-1], poisson_ratio=SENSOR_POISSON_RATIO)
        ours = FiniteElements(accuracy).respond(replace(plain, layers=(plain.layers[0], sensor)), depth * 1e-3)
        coarse, fine = (
            press(Stack(h_s, h_p, a, ball, MODULUS * 1e-6, ratio * MODULUS * 1e-6, nu), depth, order, larger * size)
            for larger in (1.45, 1.0)
        )
        print(f"R {ball:g}, h_s {h_s:g}, h_p {h_p:g}, a {a:g} mm, E_p/E {ratio:g}, nu_p {nu:g}")
        for k, d in enumerate(depth):
            off = ours.force[k] / fine[k, 0] - 1, ours.capacitance_change[k] / fine[k, 1] - 1
            own = coarse[k] / fine[k] - 1
            worst = np.maximum(worst, np.abs(off))
            print(
                f"  {d:5.3f} mm  {ours.force[k]:9.5f} {fine[k, 0]:9.5f} {off[0]:+8.3%} ({own[0]:+8.3%})   "
                f"{ours.capacitance_change[k]:9.6f} {fine[k, 1]:9.6f} {off[1]:+8.3%} ({own[1]:+8.3%})"
            )
    print(f"worst of {n_case * n_step} points: force {worst[0]:.3%}, capacitance change {worst[1]:.3%}")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = {"hayes": hayes, "uniaxial": uniaxial, "mesh": mesh, "softening": softening}
    parser.add_argument("--parts", nargs="*", choices=(*parts, "felupe"), default=(*parts, "felupe"))
    parser.add_argument("--accuracy", type=float, default=1e-3, help="of the finite elements beside FElupe")
    parser.add_argument("--order", type=int, default=3, help="of FElupe's elements")
    parser.add_argument("--cases", type=int, default=len(CASES))
    parser.add_argument("--steps", type=int, default=5)
    given = parser.parse_args()
    for name, part in parts.items():
        if name in given.parts:
            part()
    if "felupe" in given.parts:
        against_felupe(given.accuracy, given.order, given.cases, given.steps)


if __name__ == "__main__":
    main()

"""From silicones of other laws to how well Gent's, fitted to their curves, reproduces and predicts them.

`python benchmarks/gent_family.py [--accuracy 1e-3] [--steps 12] [--laws yeoh mooney-rivlin ogden]`

The paper's sensor on padding of the same law is pressed to 0.9 mm by finite elements. Modulus and 1/J_m of Gent's law are
fitted to force and capacitance change together, at equal relative weights from 2 % of the largest force on; so are those of a
law with the second invariant, Gent's with a share c of W = (I2 - 3)/2. Printed are the worst misfits, the modulus found over
the true one, and how far off the fit then predicts the change at 10 N on 5 mm of padding.
"""

from __future__ import annotations

import argparse
import os
from dataclasses import dataclass, replace

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from models.examples import PAPER_SENSOR
from models.fem import FiniteElements
from models.laws import First, Gent, Law, MooneyRivlin, NeoHookean, Ogden, Second, Yeoh
from models.layers import layered
from models.sensor import BoolArray, FloatArray, design_from

#: Mild to strong; the three terms of Ogden's law are those of vulcanised rubber (Ogden 1972).
LAWS: tuple[Law, ...] = (
    NeoHookean(),
    Yeoh(0.02),
    Yeoh(0.05),
    Yeoh(0.1),
    Yeoh(0.18),
    Yeoh(0.05, 0.01),
    Yeoh(-0.02, 0.002),
    MooneyRivlin(0.1),
    MooneyRivlin(0.2),
    MooneyRivlin(0.4),
    Ogden((1.0,), (1.3,)),
    Ogden((1.0,), (3.0,)),
    Ogden((1.0,), (4.0,)),
    Ogden((0.9692, 0.0071, 0.0237), (1.3, 5.0, -2.0)),
)
#: 1/J_m and shares c for which curves are worked out; cubics between.
STIFFENING, SHARES = np.array([0.0, 0.02, 0.05, 0.1, 0.18, 0.3]), np.array([-0.2, -0.1, 0.0, 0.15, 0.3, 0.5])
NO_SHARE = 2
DEEPEST, THICK_DEEPEST, PREDICTED_FORCE = 0.9e-3, 2.2e-3, 10.0


@dataclass(frozen=True)
class WithShare:
    """A law in whose energy W = (I2 - 3)/2 - 2 ln J, of the same shear modulus, has a share."""

    law: Law
    share: float
    name: str = "with the second invariant"

    def energy(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> FloatArray:
        """See `Law.energy`."""
        return (1 - self.share) * self.law.energy(a, det, hoop) + self.share * MooneyRivlin(1.0).energy(a, det, hoop)

    def derivatives(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> tuple[First, Second]:
        """See `Law.derivatives`."""
        (x, y, z), (p, q, r, s, t, u) = (
            tuple((1 - self.share) * one + self.share * other for one, other in zip(*both, strict=True))
            for both in zip(self.law.derivatives(a, det, hoop), MooneyRivlin(1.0).derivatives(a, det, hoop), strict=True)
        )
        return (x, y, z), (p, q, r, s, t, u)

    def admissible(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> BoolArray:
        """See `Law.admissible`."""
        return self.law.admissible(a, det, hoop)


def pressed(law: Law, accuracy: float, steps: int) -> FloatArray:
    """Force and capacitance change of the paper's sensor at its depths, then of one on 5 mm of padding, (4, n_step)."""
    columns = []
    for values, deepest in ((PAPER_SENSOR, DEEPEST), (PAPER_SENSOR | {"padding_thickness": 5e-3}, THICK_DEEPEST)):
        plain = layered(design_from(values))
        design = replace(plain, layers=tuple(replace(x, law=law) for x in plain.layers))
        found = FiniteElements(accuracy).respond(design, deepest * np.arange(1, steps + 1) / steps)
        columns += [found.force, found.capacitance_change]
    return np.stack(columns)


def signal(curves: FloatArray, scale: float = 1.0) -> float:
    """Change at 10 N on 5 mm of padding, the modulus `scale` times that of the curves."""
    return float(CubicSpline(np.append(0, scale * curves[2]), np.append(0, curves[3]))(PREDICTED_FORCE))


@dataclass(frozen=True, eq=False)
class Fit:
    """What came of a fit: modulus over the true one, 1/J_m, share c; worst misfits and the error of the predicted change."""

    scale: float
    stiffening: float
    share: float
    force: float
    change: float
    signal: float


def fit(truth: FloatArray, table: FloatArray, *, stiffens: bool, with_share: bool) -> Fit:
    """Fit the curves of `table`, (n_stiffening, n_share, 4, n_step), to those of a silicone of modulus 1."""
    seen = truth[0] > 0.02 * truth[0, -1]
    of_stiffening = CubicSpline(STIFFENING, table)

    def curves(x: FloatArray) -> FloatArray:
        by_share = of_stiffening(x[1] if stiffens else 0.0)
        return np.asarray(CubicSpline(SHARES, by_share)(x[-1]) if with_share else by_share[NO_SHARE])

    def misfit(x: FloatArray) -> FloatArray:
        found = curves(x)
        return np.stack([x[0] * found[0] / truth[0] - 1, found[1] / truth[1] - 1])[:, seen]

    def residual(x: FloatArray) -> FloatArray:
        return misfit(x).ravel()

    low, high = [0.3], [3.0]
    for there, axis in ((stiffens, STIFFENING), (with_share, SHARES)):
        low, high = ([*low, axis[0]], [*high, axis[-1]]) if there else (low, high)
    start = [1.0, *([0.03] if stiffens else []), *([0.05] if with_share else [])]
    x = least_squares(residual, start, bounds=(low, high), xtol=1e-12, ftol=1e-12).x
    worst = np.max(np.abs(misfit(x)), axis=1)
    return Fit(
        x[0],
        x[1] if stiffens else 0.0,
        x[-1] if with_share else 0.0,
        worst[0],
        worst[1],
        signal(curves(x), x[0]) / signal(truth) - 1,
    )


def words(law: Law) -> str:
    """Name of a law with its shape parameters."""
    match law:
        case Yeoh():
            return f"Yeoh, c2 {law.c2:g}, c3 {law.c3:g}"
        case MooneyRivlin():
            return f"Mooney-Rivlin, c01 share {law.c01_share:g}"
        case Ogden():
            return f"Ogden, exponents {', '.join(f'{x:g}' for x in law.exponents)}"
        case _:
            return law.name


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--accuracy", type=float, default=1e-3)
    parser.add_argument("--steps", type=int, default=12)
    parser.add_argument("--laws", nargs="*", default=sorted({law.name for law in LAWS}), help="names of laws")
    given = parser.parse_args()
    table = np.array(
        [
            [pressed(WithShare(Gent(1 / s) if s else NeoHookean(), float(c)), given.accuracy, given.steps) for c in SHARES]
            for s in STIFFENING
        ]
    )
    print("worst misfit of force and change, modulus found over the true one, error of the predicted change")
    print(f"{'law':30s}   neo-Hookean                     Gent                                   Gent with c")
    for law in LAWS:
        if law.name not in given.laws:
            continue
        truth = pressed(law, given.accuracy, given.steps)
        parts = []
        for stiffens, with_share in ((False, False), (True, False), (True, True)):
            f = fit(truth, table, stiffens=stiffens, with_share=with_share)
            shape = f" 1/J_m {f.stiffening:5.3f}" if stiffens else ""
            shape += f" c {f.share:+5.2f}" if with_share else ""
            parts.append(f"{f.force:6.2%} {f.change:6.2%} {f.scale:6.3f} {f.signal:+7.2%}{shape}")
        print(f"{words(law):30s}   " + "   ".join(parts), flush=True)


if __name__ == "__main__":
    main()

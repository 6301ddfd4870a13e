"""From deformation gradient and pressure to stress and tangent of a nearly incompressible neo-Hookean solid.

The in-plane gradient and the hoop stretch are stacked as f = (F_rr, F_rz, F_zr, F_zz, F_tt), components first.
Energy per reference volume: W = mu/2 (tr F^T F - 3 - 2 ln J) + p (J - 1) - p^2 / (2 K), a perturbed Lagrangian in the
pressure p (Wriggers, "Nonlinear Finite Element Methods", 2008, section 10.2; Bonet & Wood, "Nonlinear Continuum Mechanics for
Finite Element Analysis", 2008, Eq. 6.27).
"""

from __future__ import annotations

import numpy as np

from models.sensor import FloatArray


def jacobian(f: FloatArray) -> FloatArray:
    """J = det F, shape of one component."""
    return np.asarray((f[0] * f[3] - f[1] * f[2]) * f[4])


def cofactor(f: FloatArray) -> FloatArray:
    """dJ/df, shape (5, ...)."""
    return np.stack([f[3] * f[4], -f[2] * f[4], -f[1] * f[4], f[0] * f[4], f[0] * f[3] - f[1] * f[2]])


def energy(f: FloatArray, p: FloatArray, mu: FloatArray, bulk: FloatArray) -> FloatArray:
    """Energy density W of the module's formula, shape of one component."""
    j = jacobian(f)
    return np.asarray(mu / 2 * (np.sum(f**2, axis=0) - 3 - 2 * np.log(j)) + p * (j - 1) - p**2 / (2 * bulk))


def stress(f: FloatArray, p: FloatArray, mu: FloatArray) -> FloatArray:
    """First Piola-Kirchhoff stress dW/df = mu (f - cof/J) + p cof, shape (5, ...)."""
    return mu * f + (p - mu / jacobian(f)) * cofactor(f)


def tangent(f: FloatArray, p: FloatArray, mu: FloatArray) -> FloatArray:
    """d2W/df2 = mu 1 + mu/J^2 cof cof + (p - mu/J) d2J/df2, shape (5, 5, ...)."""
    j = jacobian(f)
    c = cofactor(f)
    a = (mu / j**2) * c[:, None] * c[None, :]
    k = p - mu / j
    for m, n, value in ((0, 3, f[4]), (1, 2, -f[4]), (0, 4, f[3]), (1, 4, -f[2]), (2, 4, -f[1]), (3, 4, f[0])):
        a[m, n] += k * value
        a[n, m] += k * value
    for m in range(5):
        a[m, m] += mu
    return np.asarray(a)

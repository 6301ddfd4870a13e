"""From deformation gradient and pressure to stress and tangent of a hyperelastic solid, compressible or nearly not.

The in-plane gradient A and the hoop stretch t are stacked as f = (F_rr, F_rz, F_zr, F_zz, F_tt), components first.
Energy per reference volume: mu w(a, D, t) + p (J - 1) - p^2 / (2 lambda) with a `models.laws.Law` w of a = A : A, D = det A
and t, and J = D t: a perturbed Lagrangian in the pressure p (Wriggers, "Nonlinear Finite Element Methods", 2008, section 10.2).
At its stationary point, p = lambda (J - 1), it is mu w + lambda/2 (J - 1)^2: with w neo-Hookean the compressible neo-Hookean
solid of Lame's constants mu and lambda, so that one form serves every Poisson's ratio. With da = 2 A : dA and dD = c : dA,
c = cof A, the chain rule gives

    S   = 2 W_a A + (W_D + p t) c,      S_t = W_t + p D,                                                              (1)
    H   = 4 W_aa A A + 2 W_aD (A c + c A) + W_DD c c + 2 W_a 1 + (W_D + p t) d2D/dA2,                                 (2)
    H_t = 2 W_at A + (W_Dt + p) c,      H_tt = W_tt.                                                                  (3)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.laws import First, Law, Second
from models.sensor import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class Material:
    """Law of every element: `laws`, and for each the element numbers `where` it holds.

    `modulus` and `lame` are mu and lambda, (n_element, 1).
    """

    laws: tuple[Law, ...]
    where: tuple[np.ndarray[tuple[int], np.dtype[np.intp]], ...]
    modulus: FloatArray
    lame: FloatArray


def _arguments(f: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    return f[0] ** 2 + f[1] ** 2 + f[2] ** 2 + f[3] ** 2, f[0] * f[3] - f[1] * f[2], f[4]


def energy(material: Material, f: FloatArray, p: FloatArray) -> FloatArray:
    """Energy density of the module's formula.

    Parameters
    ----------
    material : laws and moduli.
    f : (5, n_element, n_quad), deformation.
    p : (n_element, n_quad), pressure.

    Returns
    -------
    Per reference volume, (n_element, n_quad).
    """
    a, det, hoop = _arguments(f)
    w = np.empty_like(a)
    for law, at in zip(material.laws, material.where, strict=True):
        w[at] = law.energy(a[at], det[at], hoop[at])
    mu = material.modulus
    return np.asarray(mu * w + p * (det * hoop - 1) - p**2 / (2 * material.lame))


def admissible(material: Material, f: FloatArray, least: float) -> BoolArray:
    """Where a deformation can be: every stretch positive, and no chain stretched beyond its end.

    Parameters
    ----------
    material : laws and moduli.
    f : (5, n_element, n_quad), deformation.
    least : J must be above.

    Returns
    -------
    Shape (n_element, n_quad).
    """
    a, det, hoop = _arguments(f)
    good = (det * hoop > least) & (hoop > 0)
    for law, at in zip(material.laws, material.where, strict=True):
        good[at] &= law.admissible(a[at], np.maximum(det[at], 1e-300), hoop[at])
    return np.asarray(good)


def _derivatives(material: Material, f: FloatArray) -> tuple[First, Second]:
    """Derivatives of mu w in a, D, t at every quadrature point."""
    a, det, hoop = _arguments(f)
    mu = material.modulus
    if len(material.laws) == 1:
        first, second = material.laws[0].derivatives(a, det, hoop)
        (x, y, z), (u, v, w, q, r, s) = first, second
        return (mu * x, mu * y, mu * z), (mu * u, mu * v, mu * w, mu * q, mu * r, mu * s)
    out = np.empty((9, *a.shape))
    for law, at in zip(material.laws, material.where, strict=True):
        first, second = law.derivatives(a[at], det[at], hoop[at])
        for row, value in zip(out, (*first, *second), strict=True):
            row[at] = mu[at] * value
    return (out[0], out[1], out[2]), (out[3], out[4], out[5], out[6], out[7], out[8])


@dataclass(frozen=True, eq=False)
class Point:
    """Stress (5, ...), tangent (5, 5, ...), cofactor (5, ...) and J at every quadrature point."""

    stress: FloatArray
    tangent: FloatArray
    cofactor: FloatArray
    jacobian: FloatArray


def at_point(material: Material, f: FloatArray, p: FloatArray) -> Point:
    """Stress and tangent of the material, Eqs. (1)-(3).

    Parameters
    ----------
    material : laws and moduli.
    f : (5, n_element, n_quad), deformation.
    p : (n_element, n_quad), pressure.

    Returns
    -------
    First Piola-Kirchhoff stress, its derivative at fixed pressure, cof F and J.
    """
    (w_a, w_d, w_t), (w_aa, w_ad, w_at, w_dd, w_dt, w_tt) = _derivatives(material, f)
    det = f[0] * f[3] - f[1] * f[2]
    hoop = f[4]
    in_plane = f[:4]
    c = np.stack([f[3], -f[2], -f[1], f[0]])
    k = w_d + p * hoop
    twice = 2 * w_a
    stress = np.empty_like(f)
    stress[:4] = twice * in_plane + k * c  # Eq. (1)
    stress[4] = w_t + p * det
    tangent = np.empty((5, *f.shape))
    x, y = 4 * w_aa * in_plane + 2 * w_ad * c, 2 * w_ad * in_plane + w_dd * c
    for m in range(4):
        for n in range(m, 4):
            tangent[m, n] = x[m] * in_plane[n] + y[m] * c[n]  # Eq. (2)
        tangent[m, m] += twice
    tangent[0, 3] += k
    tangent[1, 2] -= k
    tangent[:4, 4] = 2 * w_at * in_plane + (w_dt + p) * c  # Eq. (3)
    tangent[4, 4] = w_tt
    for m in range(5):
        for n in range(m):
            tangent[m, n] = tangent[n, m]
    cofactor_f = np.empty_like(f)
    cofactor_f[:4] = c * hoop
    cofactor_f[4] = det
    return Point(stress, tangent, cofactor_f, det * hoop)


def least_acoustic(point: Point, directions: int = 36) -> FloatArray:
    """How far the material is from losing its stability: the least m.Q(n).m over directions n and volume-keeping shears m.

    Q_ik = H_iJkL n_J n_L with m . (cof A n) = 0, n and m in the plane; strong ellipticity of an incompressible solid asks for a
    positive value (Knowles & Sternberg, J. Elasticity 8 (1978) 329; Zee & Sternberg, Arch. Ration. Mech. Anal. 83 (1983) 53).
    A compressible neo-Hookean one is polyconvex and never loses it: all m are stable there, these among them.

    Parameters
    ----------
    point : stress and tangent.
    directions : number of directions n over half a turn.

    Returns
    -------
    In the unit of the tangent, (n_element, n_quad).
    """
    least = np.full(point.jacobian.shape, np.inf)
    c, h = point.cofactor, point.tangent
    for angle in np.pi * np.arange(directions) / directions:
        n = np.array([np.cos(angle), np.sin(angle)])
        normal = np.stack([c[0] * n[0] + c[1] * n[1], c[2] * n[0] + c[3] * n[1]])
        m = np.stack([-normal[1], normal[0]]) / np.hypot(*normal)
        # Components of the dyad m n in the order rr, rz, zr, zz.
        dyad = np.stack([m[0] * n[0], m[0] * n[1], m[1] * n[0], m[1] * n[1]])
        least = np.minimum(least, np.einsum("m...,mn...,n...->...", dyad, h[:4, :4], dyad))
    return np.asarray(least)

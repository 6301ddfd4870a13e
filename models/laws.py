"""From the shape parameters of a hyperelastic law to its strain energy and derivatives, for unit shear modulus.

All laws are isotropic. In an axisymmetric deformation without torsion, with A the in-plane 2 x 2 part of the deformation
gradient and t the hoop stretch, an isotropic energy is a function of three scalars alone,

    a = A : A,   D = det A,   t,        I1 = a + t^2,   I2 = D^2 + a t^2,   J = D t,                                   (1)

and a law gives W(a, D, t) with its first and second derivatives; `models.fem.material` turns those into stress and tangent.
Every energy is for small-strain shear modulus 1 and carries a term -k ln J that makes the undeformed state free of stress. In
an incompressible layer, whose J the model holds within 1e-4 of 1, that term is a choice of what part of the stress the pressure
takes, not of material; in a foam, which is neo-Hookean, it is part of the material (`models.fem.material`). The small-strain
shear modulus of a layer, E / (2 (1 + nu)), multiplies the law; what is left are numbers without dimension.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from models.sensor import BoolArray, FloatArray

#: W_a, W_D, W_t.
First = tuple[FloatArray, FloatArray, FloatArray]
#: W_aa, W_aD, W_at, W_DD, W_Dt, W_tt.
Second = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]


class Law(Protocol):
    """A strain energy per reference volume in units of the shear modulus, as a function of (1); any shape that broadcasts."""

    @property
    def name(self) -> str:
        """Name in design files."""
        ...

    def energy(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> FloatArray:
        """Strain energy per reference volume, W(a, D, t), of the invariants (1).

        Parameters
        ----------
        a : A : A.
        det : D = det A.
        hoop : t; all of any shape that broadcasts.

        Returns
        -------
        W in units of the shear modulus.
        """
        ...

    def derivatives(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> tuple[First, Second]:
        """First and second derivatives of the energy, from which stress and tangent follow.

        Parameters
        ----------
        a, det, hoop : the invariants, as in `energy`.

        Returns
        -------
        W_a, W_D, W_t, and W_aa, W_aD, W_at, W_DD, W_Dt, W_tt.
        """
        ...

    def admissible(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> BoolArray:
        """Where the energy exists, given D > 0 and t > 0; Gent's chains end at a stretch.

        Parameters
        ----------
        a, det, hoop : the invariants, as in `energy`.

        Returns
        -------
        Whether, for each.
        """
        ...


def _everywhere(a: FloatArray) -> BoolArray:
    return np.ones(np.shape(a), dtype=bool)


def _by_invariants(
    a: FloatArray, det: FloatArray, hoop: FloatArray, w1: FloatArray, w2: float, w11: FloatArray, k: float
) -> tuple[First, Second]:
    """Derivatives of w(I1, I2) - k ln J with w_1, constant w_2, and w_11, by the chain rule through (1)."""
    zero = np.zeros_like(a)
    i2_t = 2 * a * hoop
    first = (w1 + w2 * hoop**2, 2 * w2 * det - k / det, 2 * hoop * w1 + w2 * i2_t - k / hoop)
    second = (
        w11 + zero,
        zero,
        2 * hoop * w11 + 2 * w2 * hoop,
        2 * w2 + k / det**2,
        zero,
        4 * hoop**2 * w11 + 2 * w1 + 2 * w2 * a + k / hoop**2,
    )
    return first, second


@dataclass(frozen=True)
class NeoHookean:
    """The simplest rubber, with one modulus and no shape parameter: W = (I1 - 3)/2 - ln J, Gaussian chains (Treloar 1943)."""

    name: str = field(default="neo-hookean", init=False)

    def energy(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> FloatArray:
        """See `Law.energy`."""
        return np.asarray((a + hoop**2 - 3) / 2 - np.log(det * hoop))

    def derivatives(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> tuple[First, Second]:
        """See `Law.derivatives`."""
        half, zero = np.full_like(a, 0.5), np.zeros_like(a)
        first = (half, -1 / det, hoop - 1 / hoop)
        return first, (zero, zero, zero, 1 / det**2, zero, 1 + 1 / hoop**2)

    def admissible(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> BoolArray:
        """See `Law.admissible`."""
        return _everywhere(a)


@dataclass(frozen=True)
class MooneyRivlin:
    """Rubber that softens in tension: W = [(1 - c)(I1 - 3) + c (I2 - 3)]/2 - (1 + c) ln J (Mooney 1940, Rivlin 1948).

    `c01_share` is c = C01/(C10 + C01), with mu = 2 (C10 + C01); 0 is neo-Hookean. Negative values, as fits to tension give
    them, stiffen without bound in tension and soften in compression: not to be carried over from tension.

    Raises
    ------
    ValueError
        If the share is not between -1 and 1.
    """

    c01_share: float
    name: str = field(default="mooney-rivlin", init=False)

    def __post_init__(self) -> None:
        if not -1 <= self.c01_share <= 1:
            raise ValueError(f"c01_share must lie between -1 and 1, got {self.c01_share:g}")

    def energy(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> FloatArray:
        """See `Law.energy`."""
        c = self.c01_share
        i1, i2 = a + hoop**2, det**2 + a * hoop**2
        return np.asarray((1 - c) / 2 * (i1 - 3) + c / 2 * (i2 - 3) - (1 + c) * np.log(det * hoop))

    def derivatives(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> tuple[First, Second]:
        """See `Law.derivatives`."""
        c = self.c01_share
        return _by_invariants(a, det, hoop, np.full_like(a, (1 - c) / 2), c / 2, np.zeros_like(a), 1 + c)

    def admissible(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> BoolArray:
        """See `Law.admissible`."""
        return _everywhere(a)


@dataclass(frozen=True)
class Yeoh:
    """Rubber that softens and stiffens again, as a cubic in I1 - 3.

    W = [(I1 - 3) + c2 (I1 - 3)^2 + c3 (I1 - 3)^3]/2 - ln J (Yeoh 1993, Rubber Chem. Technol. 66:754).

    `c2` = C2/C1 and `c3` = C3/C1, with mu = 2 C1.
    """

    c2: float
    c3: float = 0.0
    name: str = field(default="yeoh", init=False)

    def energy(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> FloatArray:
        """See `Law.energy`."""
        x = a + hoop**2 - 3
        return np.asarray((x + self.c2 * x**2 + self.c3 * x**3) / 2 - np.log(det * hoop))

    def derivatives(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> tuple[First, Second]:
        """See `Law.derivatives`."""
        x = a + hoop**2 - 3
        w1 = (1 + 2 * self.c2 * x + 3 * self.c3 * x**2) / 2
        return _by_invariants(a, det, hoop, w1, 0.0, self.c2 + 3 * self.c3 * x, 1.0)

    def admissible(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> BoolArray:
        """See `Law.admissible`."""
        return _everywhere(a)


@dataclass(frozen=True)
class Gent:
    """Rubber whose chains can be stretched so far and no further: W = -(Jm/2) ln(1 - (I1 - 3)/Jm) - ln J.

    Gent 1996, Rubber Chem. Technol. 69:59.

    `locking` is Jm, the value of I1 - 3 at which the chains are fully stretched; silicones have 10 to 80.

    Raises
    ------
    ValueError
        If it is not positive.
    """

    locking: float
    name: str = field(default="gent", init=False)

    def __post_init__(self) -> None:
        if not self.locking > 0:
            raise ValueError(f"locking must be positive, got {self.locking:g}")

    def _left(self, a: FloatArray, hoop: FloatArray) -> FloatArray:
        return np.asarray(1 - (a + hoop**2 - 3) / self.locking)

    def energy(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> FloatArray:
        """See `Law.energy`."""
        return np.asarray(-self.locking / 2 * np.log(self._left(a, hoop)) - np.log(det * hoop))

    def derivatives(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> tuple[First, Second]:
        """See `Law.derivatives`."""
        left = self._left(a, hoop)
        return _by_invariants(a, det, hoop, 0.5 / left, 0.0, 0.5 / (self.locking * left**2), 1.0)

    def admissible(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> BoolArray:
        """See `Law.admissible`."""
        return np.asarray(self._left(a, hoop) > 1e-3)


@dataclass(frozen=True)
class Ogden:
    """Rubber of any curve, as a sum of powers of the principal stretches.

    W = sum_i (2 m_i / alpha_i^2) (l1^alpha_i + l2^alpha_i + l3^alpha_i - 3) - sum_i (2 m_i / alpha_i) ln J (Ogden 1972).

    `shares` are m_i = mu_i/mu, which sum to one; `exponents` are alpha_i. One term with alpha 2 is neo-Hookean.

    With the in-plane principal stretches l1, l2: l1^alpha + l2^alpha = 2 D^b T_b(c), b = alpha/2, c = a/(2 D), and
    T_b(c) = cosh(b arcosh c) the Chebyshev function of degree b, which is smooth where l1 = l2 (c = 1).

    Raises
    ------
    ValueError
        If there are no terms, lengths differ, shares do not sum to one, or an exponent is zero.
    """

    shares: tuple[float, ...]
    exponents: tuple[float, ...]
    name: str = field(default="ogden", init=False)

    def __post_init__(self) -> None:
        if not self.shares or len(self.shares) != len(self.exponents):
            raise ValueError(
                "shares and exponents must be of the same length, at least one, got "
                f"{len(self.shares)} and {len(self.exponents)}"
            )
        if abs(sum(self.shares) - 1) > 1e-6:
            raise ValueError(f"shares must sum to one, got {sum(self.shares):g}")
        if any(e == 0 for e in self.exponents):
            raise ValueError("exponents must not be zero")

    def energy(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> FloatArray:
        """See `Law.energy`."""
        c, total = a / (2 * det), np.zeros(np.broadcast(a, det, hoop).shape)
        for m, alpha in zip(self.shares, self.exponents, strict=True):
            b = alpha / 2
            total = total + 2 * m / alpha**2 * (2 * det**b * _chebyshev(b, c)[0] + hoop**alpha - 3)
            total = total - 2 * m / alpha * np.log(det * hoop)
        return np.asarray(total)

    def derivatives(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> tuple[First, Second]:
        """See `Law.derivatives`."""
        c = a / (2 * det)
        zero = np.zeros(np.broadcast(a, det, hoop).shape)
        w_a, w_d, w_t, w_aa, w_ad, w_dd, w_tt = (zero,) * 7
        for m, alpha in zip(self.shares, self.exponents, strict=True):
            b, k, log = alpha / 2, 2 * m / alpha**2, 2 * m / alpha
            t0, t1, t2 = _chebyshev(b, c)
            power = k * det ** (b - 2)
            mixed = b * t0 - c * t1
            w_a = w_a + power * det * t1
            w_d = w_d + 2 * power * det * mixed - log / det
            w_t = w_t + k * alpha * hoop ** (alpha - 1) - log / hoop
            w_aa = w_aa + power * t2 / 2
            w_ad = w_ad + power * ((b - 1) * t1 - c * t2)
            w_dd = w_dd + 2 * power * ((b - 1) * mixed - c * ((b - 1) * t1 - c * t2)) + log / det**2
            w_tt = w_tt + k * alpha * (alpha - 1) * hoop ** (alpha - 2) + log / hoop**2
        return (w_a, w_d, w_t), (w_aa, w_ad, zero, w_dd, zero, w_tt)

    def admissible(self, a: FloatArray, det: FloatArray, hoop: FloatArray) -> BoolArray:
        """See `Law.admissible`."""
        return _everywhere(a)


def _chebyshev(b: float, c: FloatArray) -> First:
    """T_b(c) = cosh(b arcosh c) with its first two derivatives, c >= 1; a series in c - 1 where that is small."""
    e = c - 1
    near = e < 1e-2
    # T = sum_k s_k e^k with s_{k+1} = s_k (b^2 - k^2)/((2k + 1)(k + 1)), from the Chebyshev equation.
    series = [1.0]
    for k in range(8):
        series.append(series[-1] * (b**2 - k**2) / ((2 * k + 1) * (k + 1)))
    poly = np.polynomial.Polynomial(series)
    d1, d2 = poly.deriv(), poly.deriv(2)
    far = np.where(near, 1.0, e)
    s = np.arccosh(1 + far)
    t0, t1 = np.cosh(b * s), b * np.sinh(b * s) / np.sinh(s)
    t2 = (b**2 * t0 - (1 + far) * t1) / (far * (far + 2))
    small = np.where(near, e, 0.0)
    return (
        np.where(near, poly(small), t0),
        np.where(near, d1(small), t1),
        np.where(near, d2(small), t2),
    )

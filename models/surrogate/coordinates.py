"""From groups and depths to what the networks work with: features they see, terms along a path, closed forms they correct."""

from __future__ import annotations

import numpy as np

from models.analytic import layer_weight
from models.sensor import Base
from models.surrogate.domain import DEPTH, DISC, GAP, OWN, PADDING, SENSOR, STIFFNESS, WIDTH
from models.surrogate.families import Family
from models.surrogate.groups import Values

#: Terms of the polynomials in s of the curves.
N_DEPTH_TERMS = 12

#: Largest s: R/2 and the depth of 60 % compression are up to 9 % beyond their smooth minimum. The polynomials are Chebyshev's
#: on 0 <= s <= S_END.
S_END = 1.045


def mechanical_features(groups: Values) -> Values:
    """Coordinates (n, 8) of a design in which the mechanics is smooth, from groups (n, >= 4): what networks see.

    Logarithms of the groups and of what the design is in thicknesses of the stack h = h_s + h_p; of thin padding log(h_p/h_s +
    0.3) and log(h_p/R + 0.03), which are linear where it vanishes.
    """
    h_s, h_p, a, modulus = (groups[:, k] for k in (SENSOR, PADDING, DISC, STIFFNESS))
    h = h_s + h_p
    logs = np.log(np.stack([h_s, h_p / h_s + 0.3, h_p + 0.03, a, modulus, h, a / h], axis=1))
    return np.concatenate([logs, 1 / a[:, None] ** 2], axis=1)


#: Number of the features of the mechanics, which come first among those of the capacitance.
N_MECHANICAL = 8


def electric_features(groups: Values) -> Values:
    """Coordinates (n, 13) of a design in which the capacitance is smooth, from groups (n, n_group).

    Those of the mechanics, then of the electrode and of the gap.
    """
    a, share = groups[:, DISC], groups[:, WIDTH]
    width = share * a
    h = groups[:, SENSOR] + groups[:, PADDING]
    own = [np.log(width), np.log(width / h), np.log(share), share**4, groups[:, GAP]]
    return np.concatenate([mechanical_features(groups), np.stack(own, axis=1)], axis=1)


def with_own(features: Values, groups: Values, family: Family) -> Values:
    """Features and, in a family that has some, its own groups beside them.

    Parameters
    ----------
    features : (n, n_feature), of the mechanics or the capacitance.
    groups : (n, >= 4 + n_own), of the same designs.
    family : whose networks are to see them.

    Returns
    -------
    Inputs of its networks.
    """
    return np.concatenate([features, groups[:, OWN : OWN + len(family.own)]], axis=1) if family.own else features


def share_of_family(groups: Values, family: Family) -> Values:
    """How much of the difference between its family and the one that it adds to a design has: none where its own groups vanish.

    Parameters
    ----------
    groups : (n, >= 4 + n_own).
    family : that the designs belong to.

    Returns
    -------
    From 0 to 1 for each group of its own, (n,); 1 in a family without.
    """
    if not family.own:
        return np.ones(len(groups))
    return np.asarray(sum(groups[:, column] / group.end for column, group in enumerate(family.own, OWN)))


def fade_of_family(groups: Values, depth: Values, family: Family) -> Values:
    """How much of what its family adds a design has at a depth: ever less towards first touch, if the family fades.

    u/(u + fade) with u = R d/h_s^2, the square of the contact's radius over the sensor's thickness. Under a ball whose contact
    is small against the layer lies an incompressible half space, whose surface, pressed by Hertz' pressure, does not move along
    itself: there is nothing that friction could hold (K. L. Johnson, Contact Mechanics (1985), 5.4). A layer of thickness h_s
    moves it in proportion to u.

    Parameters
    ----------
    groups : (n, >= 4).
    depth : d/R, (n, n_depth).
    family : that the designs belong to.

    Returns
    -------
    From 0 to 1, (n, n_depth); 1 in a family that does not fade.
    """
    if not family.fade:
        return np.ones_like(depth)
    u = depth / groups[:, SENSOR, None] ** 2
    return np.asarray(u / (u + family.fade))


def depth_terms(s: Values, n: int = N_DEPTH_TERMS) -> Values:
    """Terms of the polynomials along a path, Chebyshev's T_0, T_1, ... on 0 <= s <= `S_END`.

    Parameters
    ----------
    s : place along the path, (..., n_depth).
    n : number of terms.

    Returns
    -------
    Their values, (..., n, n_depth).
    """
    x = 2 / S_END * s - 1
    # Term by term in memory: each step is one pass over numbers that lie beside each other.
    terms = np.empty((n, *x.shape), dtype=x.dtype)
    terms[0] = 1
    terms[1] = x
    double = 2 * x
    for k in range(2, n):
        np.multiply(double, terms[k - 1], out=terms[k])
        terms[k] -= terms[k - 2]
    return np.transpose(terms, (*range(1, x.ndim), 0, x.ndim))


def closed_force(groups: Values, depth: Values, base: Base = "bonded") -> Values:
    """Closed-form force that the networks correct: near enough for a smooth correction, right where the indentation vanishes.

    Hertz times a series in chi = sqrt(R d)/h of an incompressible layer, whose first terms carry a modulus that weights sensor
    and padding by their share in the compliance of a half space (`layer_weight`).

    On a bonded base the thin-layer series 1 + 1.133 chi + 1.497 chi^2 + 1.469 chi^3 (Garcia & Garcia, Biophys. J. 114 (2018)
    2923, without its quartic term, so that it keeps the chi^3 growth of a thin incompressible layer). Its last term carries the
    modulus of a thin bonded film, where the lubrication flow under the sphere weights each height with the square of its depth
    below the surface: shares (h_s/h)^3 and 1 - (h_s/h)^3.

    On a slippery base 1 + 0.884 chi + 0.75 chi^2/(1 + 0.4 chi), the last two constants by eye (finite elements of one modulus
    are within some 20 %): a thin film is squeezed out from under the sphere as a whole, so that the factor on Hertz grows with
    chi alone. Its last term carries the mean of the moduli over the height, as both layers are stretched alike.

    Parameters
    ----------
    groups : (n, >= 4).
    depth : d/R, (n, n_depth).
    base : that the layers rest on.

    Returns
    -------
    F / (mu R^2), (n, n_depth).
    """
    h_s, h_p, modulus = (groups[:, k, None] for k in (SENSOR, PADDING, STIFFNESS))
    contact = np.sqrt(depth)
    sensor = layer_weight(h_s / contact)
    both = layer_weight((h_s + h_p) / contact)
    deep = 1 - sensor / both
    young_deep = 3 / (1 - deep + deep / modulus)
    chi = contact / (h_s + h_p)
    if base == "bonded":
        thin = 1 - (h_s / (h_s + h_p)) ** 3
        young_thin = 3 / (1 - thin + thin / modulus)
        series = young_deep * (1 + chi * (1.133 + chi * 1.497)) + young_thin * 1.469 * chi * chi * chi
    else:
        series = young_deep * (1 + 0.884 * chi) + _mean_young(groups) * 0.75 * chi * chi / (1 + 0.4 * chi)
    return np.asarray(16 / 9 * depth * contact * series)


def _mean_young(groups: Values) -> Values:
    """Mean of sensor's and padding's modulus over the height, over the sensor's shear modulus, (n, 1)."""
    h_s, h_p, modulus = (groups[:, k, None] for k in (SENSOR, PADDING, STIFFNESS))
    return np.asarray(3 * (h_s + h_p * modulus) / (h_s + h_p))


def closed_change(groups: Values, depth: Values, force: Values, base: Base = "bonded") -> Values:
    """Rough change of capacitance that the networks correct.

    On a bonded base two parts over the electrode's area: d^2 for the quadratic effect of the strain under the sphere, and, in
    proportion to the force, the net outflow of material through the electrode's rim, which falls off within a few thicknesses
    of the stack and is the larger the softer the padding. Constants by eye, within a factor of about three.

    On a slippery base the layers give way over the whole electrode: the mean pressure F/(pi a_e^2) over their mean modulus is
    the strain across them, and C changes by twice that, as area grows and thickness shrinks. Beside it some of d^2. Within a
    factor of two for nine in ten.

    Parameters
    ----------
    groups : (n, n_group).
    depth : d/R, (n, n_depth).
    force : F/(mu R^2), (n, n_depth), see `closed_force`.
    base : that the layers rest on.

    Returns
    -------
    C/C0 - 1, (n, n_depth).
    """
    h_s, h_p, modulus, width = (groups[:, k, None] for k in (SENSOR, PADDING, STIFFNESS, WIDTH))
    electrode, h = width * groups[:, DISC, None], h_s + h_p
    if base == "bonded":
        reach = electrode / (2.5 * h)
        rest = depth * depth
        outflow = 0.15 * force * modulus ** (-0.55 * h_p / h) / (1 + reach * reach * reach)
    else:
        rest = 0.3 * depth * depth
        outflow = 2 / np.pi * force / _mean_young(groups)
    return np.asarray((rest + outflow) / (electrode * electrode))


def smooth_end(thinned: Values) -> Values:
    """Scale of depth over R: the smooth minimum of R/2 and the depth at which a layer is `thinned` to 40 %."""
    return np.asarray((DEPTH**-8.0 + thinned**-8.0) ** (-1 / 8))

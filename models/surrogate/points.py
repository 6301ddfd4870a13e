"""From a family, or a surrogate and its error, to points in the groups at which training paths are run."""

from __future__ import annotations

import numpy as np

from models.sensor import FloatArray
from models.surrogate.domain import DIELECTRIC, ELECTRODE, LENGTHS, MODULUS
from models.surrogate.families import NEO_HOOKEAN, Family
from models.surrogate.surrogate import Surrogate

#: By how much the points go beyond the range: a fit is worst where its points end.
_MARGIN = 1.1

#: Padding coordinate log(h_p + c), c = 0.15 mm: linear for thin padding, logarithmic for thick.
_PADDING_OFFSET = 0.15


def design_points(n: int, seed: int, family: Family = NEO_HOOKEAN) -> FloatArray:
    """Space-filling points for training paths, a little beyond the range of `domain`: a scrambled Sobol sequence.

    Even in the logarithms of R, h_s, a and E_p/E, in the padding's own coordinate and in the groups that the family has of its
    own, but half of the weight follows the Chebyshev density, which is denser towards the borders.

    Parameters
    ----------
    n : number of points; the first points are the same for any number.
    seed : of the scrambling.
    family : whose designs they are.

    Returns
    -------
    Groups (n, 4 + n_own), in the order of `domain.group_names`.
    """
    from scipy.stats import qmc  # takes long to load

    with np.errstate(all="ignore"):
        sobol = qmc.Sobol(_n_coordinate(family), rng=np.random.default_rng(seed))
        u = sobol.random_base2(max(0, int(np.ceil(np.log2(n)))))[:n]
    return _points_at((1 - np.cos(np.pi * u)) / 4 + u / 2, _MARGIN, family)


def random_groups(n: int, rng: np.random.Generator, family: Family = NEO_HOOKEAN) -> FloatArray:
    """Random points inside the range, even in the same coordinates: for tests of a surrogate.

    Parameters
    ----------
    n : number of points.
    rng : they are drawn with.
    family : whose designs they are.

    Returns
    -------
    Groups (n, 4 + n_own), in the order of `domain.group_names`.
    """
    return _points_at(rng.uniform(size=(n, _n_coordinate(family))), 1.0, family)


def _n_coordinate(family: Family) -> int:
    return 5 + len(family.own)


def _points_at(u: FloatArray, margin: float, family: Family) -> FloatArray:
    """Groups (n, 4 + n_own) at u in [0, 1]: R, h_s, h_p, a, E_p/E and own ones over their ranges, `margin` times wider."""
    low, high = np.array(list(LENGTHS.values())).T
    low, high = low / margin, high * margin
    radius, h_s = (low[k] * (high[k] / low[k]) ** u[:, k] for k in (0, 1))
    h_p = _PADDING_OFFSET * ((high[2] / _PADDING_OFFSET + 1) ** u[:, 2] - 1)
    narrow = np.maximum(low[3], radius / margin**0.3)
    a = narrow * (high[3] / narrow) ** u[:, 3]
    modulus = MODULUS[0] / margin * (MODULUS[1] / MODULUS[0] * margin**2) ** u[:, 4]
    # Not beyond what there is: a ball does no more than stick.
    own = [np.minimum(margin * group.end * u[:, k], group.most) for k, group in enumerate(family.own, 5)]
    return np.stack([h_s / radius, h_p / radius, a / radius, modulus, *own], axis=1)


def worst_points(surrogate: Surrogate, n: int, seed: int) -> FloatArray:
    """Points for new training paths where a surrogate states the largest errors, of force or of capacitance.

    Drawn without repetition from eight times as many points all over the range, each with a chance in proportion to its squared
    error (Efraimidis & Spirakis, Inf. Process. Lett. 97 (2006) 181).

    Parameters
    ----------
    surrogate : to be improved.
    n : number of points.
    seed : of the points they are drawn from, and of the draw.

    Returns
    -------
    Groups (n, 4 + n_own), in the order of `domain.group_names`.
    """
    rng = np.random.default_rng(seed)
    points = design_points(8 * n, seed, surrogate.family)
    electric = np.stack([rng.uniform(*DIELECTRIC, len(points)), rng.uniform(*ELECTRODE, len(points))], axis=1)
    error = surrogate.own_error(np.concatenate([points, electric], axis=1))
    weight = np.sum((error / np.mean(error, axis=0)) ** 2, axis=1)
    return np.asarray(points[np.argsort(np.log(rng.uniform(size=len(points))) / weight)[::-1][:n]])

"""A problem and coordinates z in, how probable they are before the data out, and draws of what is believed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from calib.catalogue import spread_of
from calib.priors import Fixed
from calib.problem.unknowns import UnknownTable
from calib.problem.values import Unknowns, values_at
from models.sensor import FloatArray


class _Believed(Protocol):
    """Anything of which something is believed: a `Problem` or a `Posterior`."""

    @property
    def table(self) -> UnknownTable:
        """The free unknowns made ready to be given values."""
        ...


def log_prior(of: _Believed, z: FloatArray) -> FloatArray:
    """Log density of what is believed before the data, up to a constant: standard normal, but for specimens of one lot.

    Parameters
    ----------
    of : a problem or a posterior.
    z : (n_draw, n_unknown).

    Returns
    -------
    (n_draw,), as high over its integral as -z^T z / 2.
    """
    standard: FloatArray = -0.5 * np.sum(z**2, axis=1)
    for lot in of.table.lots:
        standard = standard + lot.log_ratio(z)
    return standard


def log_prior_as_normal(of: _Believed, z: FloatArray) -> FloatArray:
    """As `log_prior`, with what is believed of a lot as the normal density of the same covariance: where climbs end.

    Parameters
    ----------
    of : a problem or a posterior.
    z : (n_draw, n_unknown).
    """
    standard: FloatArray = -0.5 * np.sum(z**2, axis=1)
    for lot in of.table.lots:
        standard = standard + lot.log_ratio_as_normal(z)
    return standard


def prior_covariance(of: _Believed, n: int) -> FloatArray:
    """Covariance (n, n) of the coordinates before the data: 1, but for specimens of one lot, which are alike.

    Parameters
    ----------
    of : a problem or a posterior.
    n : how many unknowns there are.
    """
    found = np.eye(n)
    for lot in of.table.lots:
        found[np.ix_(lot.columns, lot.columns)] = lot.prior.covariance
    return found


def prior_bend(of: _Believed, n: int) -> FloatArray:
    """What specimens' being alike adds to the curvature (n, n) of -log prior in the coordinates, which is 1, taken as normal.

    Parameters
    ----------
    of : a problem or a posterior.
    n : how many unknowns there are.
    """
    found = np.zeros((n, n))
    for lot in of.table.lots:
        found[np.ix_(lot.columns, lot.columns)] = lot.bend
    return found


def prior_coordinates(of: Unknowns, rng: np.random.Generator, n_draw: int) -> FloatArray:
    """Draw coordinates of what is believed before the data, (n_draw, n_unknown).

    Parameters
    ----------
    of : a problem or a posterior.
    rng : of the draws.
    n_draw : how many.
    """
    return _drawn(of, rng, n_draw)[0]


def prior_values(of: Unknowns, rng: np.random.Generator, n_draw: int) -> dict[str, FloatArray]:
    """Draw values of what is believed before the data, those of a lot with its specimens'.

    Parameters
    ----------
    of : a problem or a posterior.
    rng : of the draws.
    n_draw : how many.

    Returns
    -------
    Name -> SI values (n_draw,), fixed ones included.
    """
    z, of_lot = _drawn(of, rng, n_draw)
    return {**values_at(of, z), **of_lot}


def values_of_lot(of: _Believed, z: FloatArray, rng: np.random.Generator) -> dict[str, FloatArray]:
    """Draw what is of a lot given its specimens, by name: value and spread of each quantity that is pooled.

    Parameters
    ----------
    of : a problem or a posterior.
    z : (n_draw, n_unknown), draws of the unknowns.
    rng : of the lot's.

    Returns
    -------
    Name -> SI values (n_draw,), in the order of `of_lot`, no spread that is fixed; empty under complete pooling.
    """
    found = {}
    for lot in of.table.lots:
        found[lot.quantity], spread = lot.prior.draw_of(z[:, lot.columns], rng)
        if not isinstance(lot.prior.spread, Fixed):
            found[spread_of(lot.quantity)] = spread
    return found


def _drawn(of: Unknowns, rng: np.random.Generator, n_draw: int) -> tuple[FloatArray, Mapping[str, FloatArray]]:
    z = rng.standard_normal((n_draw, len(of.parameters)))
    of_lots = {}
    for lot in of.table.lots:
        z[:, lot.columns], of_lots[lot.quantity], of_lots[spread_of(lot.quantity)] = lot.prior.draw(rng, n_draw)
    return z, of_lots

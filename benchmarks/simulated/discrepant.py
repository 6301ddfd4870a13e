"""A generator in, by how much a true sensor is off every model out: what a calibration takes for granted that it may be."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.interpolate import CubicSpline

from calib.priors import default_prior
from calib.problem import correlation_between
from models.sensor import FloatArray
from simulated.faulty import Curve

# No width is farther from the usual one, in standard deviations.
_FARTHEST = 2.5


def drawn_widths(rng: np.random.Generator, planted: bool) -> dict[str, float]:
    """Draw the sd of the discrepancy of force and capacitance [1] from the priors of a calibration; 0 where none is planted.

    Parameters
    ----------
    rng : the source of random numbers, of which as many are taken in both cases.
    planted : whether there is one.
    """
    z = np.clip(rng.standard_normal(2), -_FARTHEST, _FARTHEST)
    channels = ("force", "capacitance")
    return {c: float(default_prior(f"{c}_discrepancy").ppf_normal(own)) * planted for c, own in zip(channels, z, strict=True)}


def curve_off(curve: Curve, width: Mapping[str, float], rng: np.random.Generator) -> Curve:
    """A loading curve that is off by discrepancies: a Gaussian process along the depth times force and change.

    Parameters
    ----------
    curve : of the model.
    width : sd of each discrepancy [1], by channel.
    rng : of the processes.
    """
    share = curve.force.x**2 / curve.force.x[-1] ** 2
    value, vector = np.linalg.eigh(correlation_between(share, share))

    def process() -> FloatArray:
        return np.asarray(vector @ (np.sqrt(np.maximum(value, 0.0)) * rng.standard_normal(share.size)), dtype=float)

    s, rest = curve.force.x, float(curve.capacitance(0.0))
    force = curve.force(s) * (1 + width["force"] * process())
    capacitance = rest + (curve.capacitance(s) - rest) * (1 + width["capacitance"] * process())
    return Curve(CubicSpline(s, force), CubicSpline(s, capacitance))

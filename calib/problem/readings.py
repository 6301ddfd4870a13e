"""What instruments should read in a sweep, channel by channel, and how far readings may lie from that, for many draws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from calib.problem.plan import Correlation
from models.sensor import BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """The model discrepancy of a channel, the last term of (4): sd at each point, and how points go together.

    Attributes
    ----------
    sd : delta g, (n_draw, n_point), SI.
    correlation : K, the same for all draws but where presses repeat each other.
    """

    sd: FloatArray
    correlation: Correlation


@dataclass(frozen=True, eq=False)
class PredictedReadings:
    """What an instrument should read at the points of a channel, and how far readings may lie from that, for many draws.

    The covariance of the readings of one draw is diag(variance) + modes modes^T: noise of single readings, and errors that
    neighbouring points share (of the forward model, and the discrepancy). Draws outside the forward model's range are left out.

    Attributes
    ----------
    depth : [m], (n_covered, n_point), true indentation at each point.
    mean : (n_covered, n_point), SI, expected reading.
    variance : (n_covered, n_point), SI, independent part of the covariance.
    error : (n_covered, n_point, n_mode), SI, factors of the forward model's own error.
    observed : (n_point,), SI, what was read.
    discrepancy : None where there is none. What it leaves to single points is in `variance`.
    """

    depth: FloatArray
    mean: FloatArray
    variance: FloatArray
    error: FloatArray
    observed: FloatArray
    discrepancy: Discrepancy | None = None

    @property
    def modes(self) -> FloatArray:
        """Factors of the correlated part of the covariance, those of the discrepancy last, (n_covered, n_point, n_mode), SI."""
        if self.discrepancy is None:
            return self.error
        own = self.discrepancy.sd[..., None] * self.discrepancy.correlation.modes
        return np.concatenate([self.error, own], axis=-1)

    @property
    def sd(self) -> FloatArray:
        """Standard deviation of each reading by itself, independent and correlated part together, (n_covered, n_point)."""
        variance = self.variance + np.sum(self.error**2, axis=-1)
        if self.discrepancy is not None:
            variance = variance + self.discrepancy.sd**2 * np.sum(self.discrepancy.correlation.modes**2, axis=-1)
        return np.asarray(np.sqrt(variance), dtype=float)

    def only(self, rows: BoolArray | IntArray) -> PredictedReadings:
        """Some of the draws."""
        own = self.discrepancy
        own = None if own is None else Discrepancy(own.sd[rows], own.correlation.only(rows))
        depth, mean, variance, error = (column[rows] for column in (self.depth, self.mean, self.variance, self.error))
        return PredictedReadings(depth, mean, variance, error, self.observed, own)


@dataclass(frozen=True, eq=False)
class SweepModel:
    """What the instruments should read in one sweep, channel by channel, for a batch of draws of the unknowns.

    Attributes
    ----------
    covered : (n_draw,), draws whose design is valid and whose depths the forward model covers; the channels hold these only.
    range_use : (n_draw,), deepest point over the deepest the forward model covers; inf where the design is not covered.
    channels : name -> predicted readings, in the order of the sweep's channels; empty if no draw is covered.
    """

    covered: BoolArray
    range_use: FloatArray
    channels: Mapping[str, PredictedReadings]

    @property
    def deepest(self) -> FloatArray:
        """Largest true indentation [m] at a reading, (n_covered,)."""
        return np.asarray(np.max([np.max(c.depth, axis=1) for c in self.channels.values()], axis=0), dtype=float)

"""Distributions of one unknown before the data, each addressed by a standard-normal coordinate z."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np
import numpy.typing as npt
from scipy.special import erf, erfinv, log_ndtr, ndtr, ndtri, ndtri_exp

from calib.catalogue import display
from models.sensor import FloatArray, Scalar

# A truncated normal keeps this many sd inside its bounds: a thickness truncated at zero is then never exactly zero.
_INSIDE = 1e-12


@dataclass(frozen=True)
class Prior(ABC):
    """What is believed of one unknown before the data, as a distribution over its values in SI.

    The sampler never sees the value x itself but a coordinate z that is standard normal under the prior:
    x = F^-1(Phi(z)), with F the distribution function of the prior and Phi that of the standard normal. In z the log prior is
    -z^2/2 (up to a constant) for every kind of prior, so that a sampler meets neither bounds nor scales.

    >>> thickness = Normal(0.74e-3, 0.02e-3)
    >>> f"{float(thickness.ppf_normal(1.0)):.5f}"
    '0.00076'
    """

    kind: ClassVar[str]

    @staticmethod
    @abstractmethod
    def value_at(z: FloatArray, *numbers: Scalar) -> FloatArray:
        """What `ppf_normal` is, of the numbers that make a prior of this kind, which may be of many priors at once.

        Parameters
        ----------
        z : [1], standard-normal coordinates, (n_draw, n_prior) or any shape.
        numbers : the fields of the prior in their order, (n_prior,) or single numbers, SI.
        """

    def ppf_normal(self, z: npt.ArrayLike) -> FloatArray:
        """Value x = F^-1(Phi(z)) [SI] at standard-normal coordinate z, any shape; increasing, accurate in both tails."""
        return self.value_at(_array(z), *(getattr(self, f.name) for f in fields(self)))

    @abstractmethod
    def to_normal(self, x: npt.ArrayLike) -> FloatArray:
        """Coordinate z = Phi^-1(F(x)) of the value x [SI], any shape; +-inf at a bound, nan outside the support."""

    @property
    @abstractmethod
    def support(self) -> tuple[float, float]:
        """Smallest and largest value [SI]; may be infinite."""

    @abstractmethod
    def describe(self, parameter: str) -> str:
        """Say the prior in words and numbers for a report, in the display unit of `parameter`."""

    def interval(self, mass: float) -> tuple[float, float]:
        """Give the central interval [SI] that holds the share `mass` of the prior: as much lies below as above it.

        >>> lo, hi = Uniform(0.0, 1.0).interval(0.9)
        >>> f"{lo:.3f} {hi:.3f}"
        '0.050 0.950'

        Raises
        ------
        ValueError
            If `mass` is not between 0 and 1.
        """
        if not 0 < mass < 1:
            raise ValueError(f"mass of an interval must be between 0 and 1, got {mass}")
        z = -float(ndtri((1 - mass) / 2))
        lo, hi = self.ppf_normal(np.array([-z, z]))
        return float(lo), float(hi)

    def to_json(self) -> dict[str, object]:
        """Write the prior as a JSON object, SI; an infinite bound is null. The inverse is `prior_from_json`."""
        values = {f.name: float(getattr(self, f.name)) for f in fields(self)}
        return {"kind": self.kind, **{k: v if math.isfinite(v) else None for k, v in values.items()}}


@dataclass(frozen=True)
class Normal(Prior):
    """Normal distribution, x = mean + sd z.

    Raises
    ------
    ValueError
        If a number is not finite or sd is not positive.
    """

    kind = "normal"
    mean: float
    sd: float

    def __post_init__(self) -> None:
        _require(math.isfinite(self.mean), f"mean of a normal prior must be finite, got {self.mean}")
        _require(_is_positive(self.sd), f"sd of a normal prior must be positive, got {self.sd}")

    @staticmethod
    def value_at(z: FloatArray, *numbers: Scalar) -> FloatArray:
        """See `Prior.value_at`."""
        mean, sd = numbers
        return _array(mean + sd * z)

    def to_normal(self, x: npt.ArrayLike) -> FloatArray:
        """See `Prior.to_normal`."""
        return (_array(x) - self.mean) / self.sd

    @property
    def support(self) -> tuple[float, float]:
        """All numbers."""
        return -math.inf, math.inf

    def describe(self, parameter: str) -> str:
        """E.g. 'normal, mean 0 pF, sd 2 pF'."""
        return f"normal, mean {display(parameter, self.mean)}, sd {display(parameter, self.sd)}"


@dataclass(frozen=True)
class LogNormal(Prior):
    """Log-normal distribution, x = median * factor^z: two thirds of the mass between median / factor and median * factor.

    `factor` is the geometric standard deviation [1].

    Raises
    ------
    ValueError
        If the median is not positive or the factor is not above 1.
    """

    kind = "lognormal"
    median: float
    factor: float

    def __post_init__(self) -> None:
        _require(_is_positive(self.median), f"median of a log-normal prior must be positive, got {self.median}")
        _require(
            math.isfinite(self.factor) and self.factor > 1,
            f"geometric sd of a log-normal prior must be above 1, got {self.factor}",
        )

    @staticmethod
    def value_at(z: FloatArray, *numbers: Scalar) -> FloatArray:
        """See `Prior.value_at`."""
        median, factor = numbers
        return _array(median * np.exp(np.log(factor) * z))

    def to_normal(self, x: npt.ArrayLike) -> FloatArray:
        """See `Prior.to_normal`."""
        with np.errstate(divide="ignore", invalid="ignore"):
            z: FloatArray = np.log(_array(x) / self.median) / math.log(self.factor)
        return z

    @property
    def support(self) -> tuple[float, float]:
        """Positive numbers."""
        return 0.0, math.inf

    def describe(self, parameter: str) -> str:
        """E.g. 'log-normal, median 0.7 MPa, factor 1.6'."""
        return f"log-normal, median {display(parameter, self.median)}, factor {self.factor:.6g}"


@dataclass(frozen=True)
class HalfNormal(Prior):
    """Half-normal distribution: the absolute value of a normal one with mean 0 and sd `scale`.

    F(x) = 2 Phi(x / scale) - 1 = erf(x / (scale sqrt 2)) for x >= 0.

    Raises
    ------
    ValueError
        If the scale is not positive.
    """

    kind = "halfnormal"
    scale: float

    def __post_init__(self) -> None:
        _require(_is_positive(self.scale), f"scale of a half-normal prior must be positive, got {self.scale}")

    @staticmethod
    def value_at(z: FloatArray, *numbers: Scalar) -> FloatArray:
        """See `Prior.value_at`."""
        (scale,) = numbers
        # Each half by the form that does not subtract from one: erf below the median, the survival function above it.
        lower = math.sqrt(2) * erfinv(ndtr(np.minimum(z, 0.0)))
        upper = -ndtri_exp(log_ndtr(-np.maximum(z, 0.0)) - math.log(2))
        return _array(scale * np.where(z < 0, lower, upper))

    def to_normal(self, x: npt.ArrayLike) -> FloatArray:
        """See `Prior.to_normal`."""
        t = _array(x) / self.scale
        share = erf(np.maximum(t, 0.0) / math.sqrt(2))
        upper = -ndtri_exp(np.minimum(log_ndtr(-t) + math.log(2), 0.0))
        z = np.where(share < 0.5, ndtri(np.minimum(share, 0.5)), upper)
        return np.where(t < 0, np.nan, z)

    @property
    def support(self) -> tuple[float, float]:
        """Zero and above."""
        return 0.0, math.inf

    def describe(self, parameter: str) -> str:
        """E.g. 'half-normal, scale 5 µm/N'."""
        return f"half-normal, scale {display(parameter, self.scale)}"


@dataclass(frozen=True)
class Uniform(Prior):
    """Uniform distribution between `low` and `high`.

    Raises
    ------
    ValueError
        If a bound is not finite or `low` is not below `high`.
    """

    kind = "uniform"
    low: float
    high: float

    def __post_init__(self) -> None:
        finite = math.isfinite(self.low) and math.isfinite(self.high)
        _require(finite and self.low < self.high, f"low must be below high, got {self.low} and {self.high}")

    @staticmethod
    def value_at(z: FloatArray, *numbers: Scalar) -> FloatArray:
        """See `Prior.value_at`."""
        low, high = (_array(n) for n in numbers)
        width = high - low
        # From the nearer bound, so that Phi is small and exact.
        return _array(np.where(z < 0, low + width * ndtr(z), high - width * ndtr(-z)))

    def to_normal(self, x: npt.ArrayLike) -> FloatArray:
        """See `Prior.to_normal`."""
        x = _array(x)
        below, above = (x - self.low) / (self.high - self.low), (self.high - x) / (self.high - self.low)
        return _array(np.where(below < 0.5, ndtri(below), -ndtri(above)))

    @property
    def support(self) -> tuple[float, float]:
        """(low, high)."""
        return self.low, self.high

    def describe(self, parameter: str) -> str:
        """E.g. 'uniform between -0.5 mm and 0.5 mm'."""
        return f"uniform between {display(parameter, self.low)} and {display(parameter, self.high)}"


@dataclass(frozen=True)
class TruncatedNormal(Prior):
    """Normal distribution of `mean` and `sd` (before truncation) restricted to `low`..`high`; bounds may be infinite.

    F(x) = (Phi(t) - Phi(a)) / (Phi(b) - Phi(a)), t = (x - mean) / sd, a and b the same of low and high. Values keep
    1e-12 sd away from the bounds, so that a thickness truncated at zero is never zero.

    Raises
    ------
    ValueError
        If sd is not positive, `low` is not below `high`, or less than a millionth of the normal lies between them.
    """

    kind = "truncated_normal"
    mean: float
    sd: float
    low: float
    high: float

    def __post_init__(self) -> None:
        _require(math.isfinite(self.mean), f"mean of a truncated normal prior must be finite, got {self.mean}")
        _require(_is_positive(self.sd), f"sd of a truncated normal prior must be positive, got {self.sd}")
        _require(self.low < self.high, f"low must be below high, got {self.low} and {self.high}")
        _require(
            float(log_mass(*self._bounds())) > math.log(1e-6),
            f"mean {self.mean} with sd {self.sd} leaves next to nothing between {self.low} and {self.high}",
        )

    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        return _array((self.low - self.mean) / self.sd), _array((self.high - self.mean) / self.sd)

    @staticmethod
    def value_at(z: FloatArray, *numbers: Scalar) -> FloatArray:
        """See `Prior.value_at`."""
        mean, sd, low, high = (_array(n) for n in numbers)
        a, b = (low - mean) / sd, (high - mean) / sd
        # Phi(t) = Phi(a) Phi(-z) + Phi(b) Phi(z), in logarithms; the same for 1 - Phi(t) = Phi(-t). Nothing is subtracted.
        log_below, log_above = log_ndtr(z), log_ndtr(-z)
        log_lower = np.logaddexp(log_ndtr(a) + log_above, log_ndtr(b) + log_below)
        log_upper = np.logaddexp(log_ndtr(-a) + log_above, log_ndtr(-b) + log_below)
        lower = log_lower < log_upper
        t = ndtri_exp(np.minimum(np.where(lower, log_lower, log_upper), 0.0))
        margin = _INSIDE * sd
        return _array(np.clip(mean + sd * np.where(lower, t, -t), low + margin, high - margin))

    def to_normal(self, x: npt.ArrayLike) -> FloatArray:
        """See `Prior.to_normal`."""
        a, b = self._bounds()
        exact = (_array(x) - self.mean) / self.sd
        t = np.clip(exact, a, b)
        whole = log_mass(a, b)
        log_lower = np.minimum(log_mass(a, t) - whole, 0.0)
        log_upper = np.minimum(log_mass(t, b) - whole, 0.0)
        z = np.where(log_lower < log_upper, ndtri_exp(log_lower), -ndtri_exp(log_upper))
        return np.where((exact < a) | (exact > b), np.nan, z)

    @property
    def support(self) -> tuple[float, float]:
        """(low, high)."""
        return self.low, self.high

    def describe(self, parameter: str) -> str:
        """E.g. 'normal, mean 2.85, sd 0.25, between 2 and 12'."""
        text = f"normal, mean {display(parameter, self.mean)}, sd {display(parameter, self.sd)}"
        if math.isinf(self.high):
            return text if math.isinf(self.low) else f"{text}, truncated at {_bound(parameter, self.low)}"
        if math.isinf(self.low):
            return f"{text}, truncated above {_bound(parameter, self.high)}"
        return f"{text}, between {display(parameter, self.low)} and {display(parameter, self.high)}"


@dataclass(frozen=True)
class Fixed(Prior):
    """A known number in the place of a prior: the quantity takes no part in the sampling.

    Raises
    ------
    ValueError
        If the value is not finite.
    """

    kind = "fixed"
    value: float

    def __post_init__(self) -> None:
        _require(math.isfinite(self.value), f"a fixed value must be finite, got {self.value}")

    @staticmethod
    def value_at(z: FloatArray, *numbers: Scalar) -> FloatArray:
        """See `Prior.value_at`; the value, whatever z."""
        (value,) = numbers
        return _array(np.broadcast_to(value, z.shape).copy())

    def to_normal(self, x: npt.ArrayLike) -> FloatArray:
        """See `Prior.to_normal`; zero at the value, nan elsewhere."""
        return np.where(_array(x) == self.value, 0.0, np.nan)

    @property
    def support(self) -> tuple[float, float]:
        """(value, value)."""
        return self.value, self.value

    def describe(self, parameter: str) -> str:
        """E.g. 'fixed at 0.74 mm'."""
        return f"fixed at {display(parameter, self.value)}"


#: Kind -> class.
PRIORS: Mapping[str, type[Prior]] = {c.kind: c for c in (Normal, LogNormal, HalfNormal, Uniform, TruncatedNormal, Fixed)}


def prior_from_json(data: Mapping[str, object]) -> Prior:
    """Read the prior that `Prior.to_json` wrote.

    >>> prior_from_json(LogNormal(0.7e6, 1.6).to_json())
    LogNormal(median=700000.0, factor=1.6)

    Raises
    ------
    ValueError
        If the kind is unknown or a number is missing.
    """
    cls = PRIORS.get(str(data.get("kind")))
    if cls is None:
        raise ValueError(f"unknown kind of prior {data.get('kind')!r}, known are {', '.join(PRIORS)}")
    # JSON has no infinity; only the bounds of a truncated normal may be infinite.
    infinite = {"low": -math.inf, "high": math.inf}
    values: dict[str, float] = {}
    for f in fields(cls):
        value = data.get(f.name)
        if value is None and f.name in infinite and f.name in data:
            values[f.name] = infinite[f.name]
        elif isinstance(value, (int, float)):
            values[f.name] = float(value)
        else:
            raise ValueError(f"prior of kind {cls.kind} needs a number {f.name}, got {value!r}")
    return cls(**values)


def _bound(parameter: str, value: float) -> str:
    return "zero" if value == 0 else display(parameter, value)


# --- numerics -----------------------------------------------------------------------------------------------------------


def _array(values: npt.ArrayLike) -> FloatArray:
    return np.asarray(values, dtype=np.float64)


def _require(condition: bool, message: str) -> None:
    if not condition:
        raise ValueError(message)


def _is_positive(value: float) -> bool:
    return math.isfinite(value) and value > 0


def log_mass(low: FloatArray, high: FloatArray) -> FloatArray:
    """Logarithm of the probability that a standard normal variable lies between two bounds, exact far out in either tail, too.

    log(Phi(high) - Phi(low)), without subtracting numbers that are nearly alike.

    Parameters
    ----------
    low, high : [1], of one shape, low <= high; may be infinite.

    Returns
    -------
    The logarithm, of the same shape; -inf where the bounds are equal.
    """
    # A pair in the upper tail is mirrored to the lower one, where Phi is small and exact.
    mirror = low > 0
    p, q = np.where(mirror, -high, low), np.where(mirror, -low, high)
    with np.errstate(divide="ignore", invalid="ignore"):
        log_p, log_q = log_ndtr(p), log_ndtr(q)
        tail = np.where(p == q, -np.inf, log_q + np.log(-np.expm1(log_p - log_q)))
        # Across zero both tails are cut off from one; close to zero their sum cancels, and erf does not.
        centre = np.log((erf(q / math.sqrt(2)) - erf(p / math.sqrt(2))) / 2)
        wide = np.log1p(-ndtr(p) - ndtr(-q))
    return _array(np.where(q <= 0, tail, np.where(np.maximum(-p, q) < 1, centre, wide)))

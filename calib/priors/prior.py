"""Priors of single parameters: from the forms of an experiment file to distributions in a standard-normal coordinate."""

from __future__ import annotations

import difflib
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import ClassVar

import numpy as np
import numpy.typing as npt
from scipy.special import erf, erfinv, log_ndtr, ndtr, ndtri, ndtri_exp

from calib.errors import Fault, InputError
from calib.quantity import parse_quantity
from models.sensor import PARAMETERS, FloatArray

#: Largest share of a normal prior's mass below zero that is cut off without asking, for a parameter that cannot be negative.
NEGLIGIBLE_MASS = 1e-3

#: Parameters that cannot be negative but may be zero: no padding, a rigid machine, a model without discrepancy.
ZERO_ALLOWED = frozenset({"padding_thickness", "machine_compliance", "force_discrepancy", "capacitance_discrepancy"})

# A truncated normal keeps this many sd inside its bounds: a thickness truncated at zero is then never exactly zero.
_INSIDE = 1e-12


@dataclass(frozen=True)
class Prior(ABC):
    """Distribution of one parameter in SI, addressed by z: if z is standard normal, `ppf_normal(z)` follows the prior.

    In the coordinate z the log prior is -z^2/2 (up to a constant) for every kind of prior, so a sampler meets neither
    bounds nor scales. The map is x = F^-1(Phi(z)), F the distribution function of the prior, Phi that of the standard normal.
    """

    kind: ClassVar[str]

    @abstractmethod
    def ppf_normal(self, z: npt.ArrayLike) -> FloatArray:
        """Value x = F^-1(Phi(z)) [SI] at standard-normal coordinate z, any shape; increasing, accurate in both tails."""

    @abstractmethod
    def to_normal(self, x: npt.ArrayLike) -> FloatArray:
        """Coordinate z = Phi^-1(F(x)) of the value x [SI], any shape; +-inf at a bound, nan outside the support."""

    @property
    @abstractmethod
    def support(self) -> tuple[float, float]:
        """Smallest and largest value [SI]; may be infinite."""

    @abstractmethod
    def describe(self, parameter: str) -> str:
        """Words and numbers for a report, in the display unit of `parameter`."""

    def interval(self, mass: float) -> tuple[float, float]:
        """Central interval [SI] that holds the share `mass` of the prior: as much lies below as above it.

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
        """The prior as a JSON object, SI; an infinite bound is null. The inverse is `prior_from_json`."""
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

    def ppf_normal(self, z: npt.ArrayLike) -> FloatArray:
        """See `Prior.ppf_normal`."""
        return self.mean + self.sd * _array(z)

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

    def ppf_normal(self, z: npt.ArrayLike) -> FloatArray:
        """See `Prior.ppf_normal`."""
        return self.median * np.exp(math.log(self.factor) * _array(z))

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

    def ppf_normal(self, z: npt.ArrayLike) -> FloatArray:
        """See `Prior.ppf_normal`."""
        z = _array(z)
        # Each half by the form that does not subtract from one: erf below the median, the survival function above it.
        lower = math.sqrt(2) * erfinv(ndtr(np.minimum(z, 0.0)))
        upper = -ndtri_exp(log_ndtr(-np.maximum(z, 0.0)) - math.log(2))
        return _array(self.scale * np.where(z < 0, lower, upper))

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

    def ppf_normal(self, z: npt.ArrayLike) -> FloatArray:
        """See `Prior.ppf_normal`."""
        z = _array(z)
        width = self.high - self.low
        # From the nearer bound, so that Phi is small and exact.
        return _array(np.where(z < 0, self.low + width * ndtr(z), self.high - width * ndtr(-z)))

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
            float(_log_mass(*self._bounds())) > math.log(1e-6),
            f"mean {self.mean} with sd {self.sd} leaves next to nothing between {self.low} and {self.high}",
        )

    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        return _array((self.low - self.mean) / self.sd), _array((self.high - self.mean) / self.sd)

    def ppf_normal(self, z: npt.ArrayLike) -> FloatArray:
        """See `Prior.ppf_normal`."""
        z = _array(z)
        a, b = self._bounds()
        # Phi(t) = Phi(a) Phi(-z) + Phi(b) Phi(z), in logarithms; the same for 1 - Phi(t) = Phi(-t). Nothing is subtracted.
        log_lower = np.logaddexp(log_ndtr(a) + log_ndtr(-z), log_ndtr(b) + log_ndtr(z))
        log_upper = np.logaddexp(log_ndtr(-a) + log_ndtr(-z), log_ndtr(-b) + log_ndtr(z))
        t = np.where(log_lower < log_upper, ndtri_exp(np.minimum(log_lower, 0.0)), -ndtri_exp(np.minimum(log_upper, 0.0)))
        margin = _INSIDE * self.sd
        return _array(np.clip(self.mean + self.sd * t, self.low + margin, self.high - margin))

    def to_normal(self, x: npt.ArrayLike) -> FloatArray:
        """See `Prior.to_normal`."""
        a, b = self._bounds()
        exact = (_array(x) - self.mean) / self.sd
        t = np.clip(exact, a, b)
        whole = _log_mass(a, b)
        log_lower = np.minimum(_log_mass(a, t) - whole, 0.0)
        log_upper = np.minimum(_log_mass(t, b) - whole, 0.0)
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
    """A known number: the parameter takes no part in the sampling.

    Raises
    ------
    ValueError
        If the value is not finite.
    """

    kind = "fixed"
    value: float

    def __post_init__(self) -> None:
        _require(math.isfinite(self.value), f"a fixed value must be finite, got {self.value}")

    def ppf_normal(self, z: npt.ArrayLike) -> FloatArray:
        """The value, whatever z."""
        return np.full(np.shape(z), self.value)

    def to_normal(self, x: npt.ArrayLike) -> FloatArray:
        """Zero at the value, nan elsewhere."""
        return np.where(_array(x) == self.value, 0.0, np.nan)

    @property
    def support(self) -> tuple[float, float]:
        """(value, value)."""
        return self.value, self.value

    def describe(self, parameter: str) -> str:
        """E.g. 'fixed at 0.74 mm'."""
        return f"fixed at {display(parameter, self.value)}"


_CLASSES: Mapping[str, type[Prior]] = {c.kind: c for c in (Normal, LogNormal, HalfNormal, Uniform, TruncatedNormal, Fixed)}


def prior_from_json(data: Mapping[str, object]) -> Prior:
    """The prior that `Prior.to_json` wrote.

    >>> prior_from_json(LogNormal(0.7e6, 1.6).to_json())
    LogNormal(median=700000.0, factor=1.6)

    Raises
    ------
    ValueError
        If the kind is unknown or a number is missing.
    """
    cls = _CLASSES.get(str(data.get("kind")))
    if cls is None:
        raise ValueError(f"unknown kind of prior {data.get('kind')!r}, known are {', '.join(_CLASSES)}")
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


# --- forms of the experiment file ---------------------------------------------------------------------------------------

# Kind -> names of its numbers, in the order they are written. "factor" is a plain number, all others have the parameter's unit.
_FORMS: Mapping[str, tuple[str, ...]] = {
    "normal": ("mean", "sd"),
    "lognormal": ("median", "geometric sd"),
    "halfnormal": ("scale",),
    "uniform": ("low", "high"),
    "truncated_normal": ("mean", "sd", "low", "high"),
    "fixed": ("value",),
}

# Magnitudes [SI] beyond which only a slip of the unit explains a number: "3 PF" for pF, "0.7 mPa" for MPa.
_CONCEIVABLE = {"m": (0.0, 1.0), "Pa": (1.0, 1e12), "F": (0.0, 1e-3), "m/N": (0.0, 1.0), "N": (0.0, 1e5)}

# What people write who know the distribution by another name.
_SYNONYMS = {
    "gaussian": "normal",
    "gauss": "normal",
    "constant": "fixed",
    "value": "fixed",
    "range": "uniform",
    "flat": "uniform",
}

#: A sensible prior of each parameter as one writes it, for advice in messages and for experiment files made by `calib init`.
EXAMPLES: Mapping[str, str] = MappingProxyType(
    {
        "young_modulus": '{ lognormal = ["0.7 MPa", 1.6] }',
        "padding_young_modulus": '{ lognormal = ["0.7 MPa", 1.6] }',
        "stiffening": "{ uniform = [0, 0.1] }",
        "relative_permittivity": "{ normal = [2.8, 0.2] }",
        "sensor_thickness": '{ normal = ["0.74 mm", "0.02 mm"] }',
        "padding_thickness": '{ normal = ["1.10 mm", "0.03 mm"] }',
        "dielectric_thickness": '{ normal = ["0.16 mm", "0.01 mm"] }',
        "electrode_radius": '{ fixed = "10 mm" }',
        "machine_compliance": '{ halfnormal = "5 um/N" }',
        "contact_offset": '{ uniform = ["-0.5 mm", "0.5 mm"] }',
        "load_zero": '{ normal = ["0 N", "1 N"] }',
        "parasitic_capacitance": '{ normal = ["0 pF", "2 pF"] }',
        "clock_offset": '{ normal = ["0 s", "5 s"] }',
        "force_noise": '{ lognormal = ["5 mN", 3] }',
        "capacitance_noise": '{ lognormal = ["20 fF", 3] }',
        "force_discrepancy": "{ halfnormal = 0.01 }",
        "capacitance_discrepancy": "{ halfnormal = 0.02 }",
    }
)


def parse_value(parameter: str, value: object) -> float:
    """SI number of one quantity of an experiment file: "0.74 mm" for a dimensional parameter, 2.8 for a dimensionless one.

    >>> parse_value("sensor_thickness", "0.74 mm"), parse_value("relative_permittivity", 2.8)
    (0.00074, 2.8)

    Raises
    ------
    InputError
        (a ValueError) if it is not a number, or the unit is missing, unknown or of another dimension.
    """
    row = PARAMETERS[parameter]
    if isinstance(value, str):
        try:
            number = parse_quantity(value, row.unit)
        except ValueError as error:
            raise InputError(Fault(f"{parameter}: {error}")) from None
        smallest, largest = _CONCEIVABLE.get(row.unit, (0.0, math.inf))
        if number != 0 and not smallest <= abs(number) <= largest:
            advice = f"Check the letters of the unit: {parameter} is usually given in {_plain_unit(parameter)}"
            raise InputError(Fault(f'{parameter} cannot be "{value}" ({number:.3g} {row.unit})', advice=advice))
        return number
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        wanted = "a quantity in quotes" if row.unit else "a number"
        raise InputError(Fault(f"{parameter} must be {wanted}, got {_written(value)}", advice=_example_value(parameter)))
    if row.unit:
        # The unit people use for the parameter, unless the number is of a size that only SI explains (0.00074, 690000).
        unit = _plain_unit(parameter) if value == 0 or 1e-3 <= abs(value) <= 1e3 else row.unit
        raise InputError(
            Fault(f"{parameter} has no unit, got {value}", advice=f'Write "{abs(value) if row.positive else value} {unit}"')
        )
    if not math.isfinite(value):
        raise InputError(Fault(f"{parameter} must be finite, got {value}"))
    return float(value)


def parse_prior(parameter: str, value: object) -> Prior:
    """The prior of `parameter` as written in an experiment file: a table of one kind and its numbers.

    The forms are `{ normal = [mean, sd] }`, `{ lognormal = [median, geometric sd] }`, `{ halfnormal = scale }`,
    `{ uniform = [low, high] }`, `{ truncated_normal = [mean, sd, low, high] }` and `{ fixed = value }`; dimensional numbers
    are texts with a unit. A parameter that cannot be negative gets no mass below zero: a normal prior with at most 0.1 % of it
    there is truncated at zero (and `describe` says so), one with more is refused.

    >>> parse_prior("young_modulus", {"lognormal": ["0.7 MPa", 1.6]})
    LogNormal(median=700000.0, factor=1.6)
    >>> parse_prior("sensor_thickness", {"normal": ["0.74 mm", "0.02 mm"]}).describe("sensor_thickness")
    'normal, mean 0.74 mm, sd 0.02 mm, truncated at zero'

    Raises
    ------
    InputError
        (a ValueError) with everything that is wrong: an unknown kind, not exactly one kind, a wrong number of values, a
        missing or wrong unit, a spread that is not positive, bounds in the wrong order, mass below zero.
    """
    if not isinstance(value, Mapping):
        known = isinstance(value, str if PARAMETERS[parameter].unit else (int, float)) and not isinstance(value, bool)
        advice = f"A known value is written {{ fixed = {_toml(value)} }}" if known else _write(parameter)
        raise InputError(Fault(f"{parameter} needs a prior, got {_written(value)}", advice=advice))
    unknown = [str(kind) for kind in value if kind not in _FORMS]
    if unknown:
        raise InputError(Fault(_unknown_kind(parameter, kind), advice=_kind_advice(kind)) for kind in unknown)
    if len(value) != 1:
        got = "none" if not value else " and ".join(value)
        raise InputError(Fault(f"{parameter} needs exactly one kind of prior, got {got}", advice=_write(parameter)))
    ((kind, given),) = value.items()
    names = _FORMS[kind]
    written: Sequence[object] = given if isinstance(given, list) else [given]
    if len(written) != len(names):
        got = f"{len(written)} value{'s' if len(written) != 1 else ''}"
        raise InputError(Fault(f"{parameter}: {kind} takes {_form(names)}, got {got}", advice=_kind_example(parameter, kind)))
    faults: list[Fault] = []
    numbers: list[float] = []
    for name, entry in zip(names, written, strict=True):
        try:
            numbers.append(_geometric_sd(parameter, entry) if name == "geometric sd" else parse_value(parameter, entry))
        except InputError as error:
            faults.extend(error.faults)
    if not faults:
        faults = _faults(
            parameter, dict(zip(names, numbers, strict=True)), dict(zip(names, map(_written, written), strict=True))
        )
    if faults:
        raise InputError(faults)
    if kind == "normal" and PARAMETERS[parameter].positive:
        return TruncatedNormal(numbers[0], numbers[1], 0.0, math.inf)
    return _CLASSES[kind](*numbers)


def sign_fault(parameter: str, value: float, written: str) -> Fault | None:
    """What is wrong with the sign of a value [SI] of `parameter`, `written` so in the file; None if nothing is."""
    if not PARAMETERS[parameter].positive or value > 0 or (value == 0 and parameter in ZERO_ALLOWED):
        return None
    rule = "must not be negative" if parameter in ZERO_ALLOWED else "must be positive"
    advice = "Give the thickness as measured, without a sign" if parameter.endswith("thickness") and value < 0 else ""
    return Fault(f"{parameter} {rule}, got {written.strip(chr(34))}", advice=advice or _example_value(parameter))


def _faults(parameter: str, number: Mapping[str, float], written: Mapping[str, str]) -> list[Fault]:
    """What is wrong with the numbers of a prior; both mappings by the names in `_FORMS`."""
    faults = []
    for name in ("sd", "scale"):
        if name in number and not number[name] > 0:
            advice = "A known value is written { fixed = value }" if number[name] == 0 else ""
            faults.append(Fault(f"{name} of {parameter} must be positive, got {written[name]}", advice=advice))
    if "geometric sd" in number and not number["geometric sd"] > 1:
        advice = "1.6 means: two thirds of the mass between median / 1.6 and median * 1.6"
        got = written["geometric sd"]
        faults.append(Fault(f"geometric sd of {parameter} must be above 1, got {got}", advice=advice))
    if "low" in number and not number["low"] < number["high"]:
        got = f"{written['low']} and {written['high']}"
        faults.append(Fault(f"lower bound of {parameter} must be below the upper bound, got {got}"))
    for name in ("value", "median"):
        if name in number and (fault := sign_fault(parameter, number[name], written[name])):
            faults.append(fault)
        elif name == "median" and name in number and not number[name] > 0:
            faults.append(
                Fault(f"median of a log-normal prior must be positive, got {written[name]}", advice=_write(parameter))
            )
    if PARAMETERS[parameter].positive and "low" in number and number["low"] < 0:
        faults.append(Fault(f"{parameter} cannot be negative, got a lower bound of {written['low']}"))
    if faults:
        return faults
    if "mean" in number and "low" not in number and PARAMETERS[parameter].positive:
        return _mass_faults(parameter, number["mean"], number["sd"], written)
    if "mean" in number and "low" in number:
        bounds = [(number[k] - number["mean"]) / number["sd"] for k in ("low", "high")]
        if not float(_log_mass(_array(bounds[0]), _array(bounds[1]))) > math.log(1e-6):
            between = f"between {written['low']} and {written['high']}"
            got = f"mean {written['mean']}, sd {written['sd']}"
            return [Fault(f"truncated normal of {parameter} leaves next to nothing {between}, got {got}")]
    return []


def _mass_faults(parameter: str, mean: float, sd: float, written: Mapping[str, str]) -> list[Fault]:
    """Whether a normal prior of a parameter that cannot be negative puts too much mass below zero."""
    share = float(ndtr(-mean / sd))
    if share <= NEGLIGIBLE_MASS:
        return []
    if mean == 0 and parameter in ZERO_ALLOWED:
        advice = f"Write {{ halfnormal = {written['sd']} }}"
        return [Fault(f"{parameter} cannot be negative, but half of the prior lies below zero", advice=advice)]
    if fault := sign_fault(parameter, mean, written["mean"]):
        return [fault]
    numbers = f"mean {written['mean'].strip(chr(34))}, sd {written['sd'].strip(chr(34))}"
    message = f"{parameter} cannot be negative, but {100 * share:.2g} % of the prior lies below zero ({numbers})"
    high = _toml(display(parameter, mean + 4 * sd)) if PARAMETERS[parameter].unit else f"{mean + 4 * sd:.4g}"
    zero = _toml(f"0 {_plain_unit(parameter)}") if PARAMETERS[parameter].unit else "0"
    factor = f"{math.exp(math.sqrt(math.log1p((sd / mean) ** 2))):.3g}"
    return [
        Fault(
            message,
            advice=f"Write {{ truncated_normal = [{written['mean']}, {written['sd']}, {zero}, {high}] }}".replace("µ", "u")
            + f" or {{ lognormal = [{written['mean']}, {factor}] }}",
        )
    ]


def _geometric_sd(parameter: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        advice = "1.6 means: two thirds of the mass between median / 1.6 and median * 1.6"
        raise InputError(
            Fault(f"geometric sd of {parameter} must be a plain number above 1, got {_written(value)}", advice=advice)
        )
    return float(value)


def _unknown_kind(parameter: str, kind: str) -> str:
    return f'{parameter}: unknown kind of prior "{kind}"'


def _kind_advice(kind: str) -> str:
    plain = kind.lower().replace("-", "").replace("_", "").replace(" ", "")
    candidates = {k.replace("_", ""): k for k in _FORMS}
    close = difflib.get_close_matches(plain, candidates, n=1, cutoff=0.6)
    guess = _SYNONYMS.get(plain) or candidates.get(plain) or (candidates[close[0]] if close else "")
    return f'Did you mean "{guess}"?' if guess else f"Known kinds: {', '.join(_FORMS)}"


def _kind_example(parameter: str, kind: str) -> str:
    row = PARAMETERS[parameter]
    entries = [
        "number" if name == "geometric sd" or not row.unit else f'"{name} in {_plain_unit(parameter)}"' for name in _FORMS[kind]
    ]
    return f"Write {{ {kind} = {entries[0] if len(entries) == 1 else '[' + ', '.join(entries) + ']'} }}"


def _form(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"[{', '.join(names)}]"


def _write(parameter: str) -> str:
    """Advice that shows a prior."""
    return f"Give for example {parameter} = {EXAMPLES[parameter]}"


def _example_value(parameter: str) -> str:
    """Advice that shows a value: the first number of the example prior; the radii of ball and disc have no prior."""
    number = re.search(r'"[^"]*"|[\d.]+', EXAMPLES.get(parameter, '"5 mm"'))
    return f"Give for example {number[0]}" if number else ""


def _plain_unit(parameter: str) -> str:
    return PARAMETERS[parameter].display_unit.replace("µ", "u")


def _toml(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value)


def _written(value: object) -> str:
    """A value as it stands in a TOML file, good enough for a message."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list):
        return "a list"
    return _toml(value)


def display(parameter: str, value: float) -> str:
    """A value [SI] of `parameter` in its display unit.

    >>> display("sensor_thickness", 0.74e-3), display("relative_permittivity", 2.8)
    ('0.74 mm', '2.8')
    """
    row = PARAMETERS[parameter]
    return f"{value * row.display_scale + 0.0:.6g} {row.display_unit}".rstrip()


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


def _log_mass(low: FloatArray, high: FloatArray) -> FloatArray:
    """log(Phi(high) - Phi(low)) for low <= high, without cancellation in either tail."""
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


# --- defaults -----------------------------------------------------------------------------------------------------------

#: Priors of what an experiment file does not name. `DEFAULT_REASONS` says why each is so. The thicknesses of a specimen have
#: none (they must be measured), nor has what is derived (dielectric_thickness = sensor_thickness / 2, electrode_radius = disc
#: radius) or comes from the data (clock_offset). The medians of the two noises stand in for the estimate from the sweep, which
#: `calib.problem.likelihood` puts in their place.
DEFAULT_PRIORS: Mapping[str, Prior] = MappingProxyType(
    {
        "young_modulus": LogNormal(0.8e6, 1.8),
        "padding_young_modulus": LogNormal(0.8e6, 1.8),
        "stiffening": Uniform(0.0, 0.1),
        "relative_permittivity": TruncatedNormal(2.85, 0.25, 2.0, 12.0),
        "machine_compliance": HalfNormal(2e-6),
        "load_zero": TruncatedNormal(0.0, 1.0, -5.0, 5.0),
        "contact_offset": Uniform(-0.5e-3, 0.5e-3),
        "parasitic_capacitance": Normal(0.0, 0.5e-12),
        "force_noise": LogNormal(5e-3, 3.0),
        "capacitance_noise": LogNormal(20e-15, 3.0),
        "force_discrepancy": HalfNormal(0.01),
        "capacitance_discrepancy": HalfNormal(0.02),
    }
)

_MODULUS_REASON = (
    "casting silicones of this kind: small-strain E = 3 mu of 0.58 MPa (Dragon Skin 30), 0.66 MPa (Elastosil 28), "
    "1.05 MPa (RTV 615), 2.0 MPa (Sylgard 184, 10:1); within-lab scatter is 3-5 %, but test methods and labs differ by a "
    "factor of 2 and more (Varner and Cohen, arXiv 2404.16960), hence the factor 1.8 (90 %: 0.3-2.1 MPa)"
)

#: Reason and source of each default prior, one sentence, for the report. "Judgement" means that no citable figure was found.
DEFAULT_REASONS: Mapping[str, str] = MappingProxyType(
    {
        "young_modulus": _MODULUS_REASON,
        "padding_young_modulus": _MODULUS_REASON,
        "stiffening": "judgement: casting silicones lock at J_m of 10 to 80, or not within reach (0: neo-Hookean)",
        "relative_permittivity": (
            "judgement: values around 2.5-3.2 are usual for unfilled silicones at 1 kHz (silicone fluid PMX-200: 2.7); give "
            "your own prior for a filled silicone or an acrylic (VHB: 4.7)"
        ),
        "machine_compliance": "judgement: load string and fixtures of a table-top tester, 10 µm at 5 N",
        "load_zero": "judgement: the cell is usually balanced before the test, but nothing here relies on it",
        "contact_offset": (
            "judgement: the crosshead is zeroed by eye near first touch; already a trigger at 0.02 N sits 34 µm deep at 0.6 MPa"
        ),
        "parasitic_capacitance": (
            "judgement: what an open correction of the LCR meter leaves; without one leads add up to 5 pF, then give your own"
        ),
        "force_noise": "wide around the scatter of the sweep's own readings: a factor of 3 either way",
        "capacitance_noise": "wide around the scatter of the sweep's own readings: a factor of 3 either way",
        "force_discrepancy": "judgement: neo-Hookean discs without rate effects or tilt describe a good specimen to about 1 %",
        "capacitance_discrepancy": (
            "judgement: stiff electrodes and fringe fields, both left out, are worth about 2 % of the change"
        ),
    }
)


def default_prior(parameter: str) -> Prior:
    """The prior of a parameter that the experiment file does not name; see `DEFAULT_PRIORS` and `DEFAULT_REASONS`.

    >>> default_prior("machine_compliance").describe("machine_compliance")
    'half-normal, scale 2 µm/N'

    Raises
    ------
    ValueError
        If the parameter has no default prior.
    """
    if parameter not in DEFAULT_PRIORS:
        raise ValueError(f"{parameter} has no default prior. {_write(parameter)}")
    return DEFAULT_PRIORS[parameter]

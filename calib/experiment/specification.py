"""What somebody demands of a sensor on its padding in, one self-checked `Specification` (SI), or its faults, out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from types import MappingProxyType
from typing import Any, Literal, cast, get_args

import numpy as np
from scipy.special import ndtr, ndtri

from calib.errors import Fault, InputError
from calib.experiment.toml_places import KeyPath
from calib.priors import Prior, prior_from_json
from models.sensor import INCOMPRESSIBLE, FloatArray, Parameter

#: What a specification may limit.
Limited = Literal["signal", "force_resolution", "stroke", "dielectric_strain", "height"]
Side = Literal["at_least", "at_most"]

#: How what may be limited is called and written.
LIMITED: Mapping[Limited, Parameter] = MappingProxyType(
    {
        "signal": Parameter("signal", "ΔC/C0", "", "%", 1e2, "capacitance change at the load"),
        "force_resolution": Parameter("force_resolution", "δF", "N", "mN", 1e3, "force that one reading tells from noise"),
        "stroke": Parameter("stroke", "d", "m", "mm", 1e3, "indentation at the load"),
        "dielectric_strain": Parameter("dielectric_strain", "ε_d", "", "%", 1e2, "thinning of the dielectric under the ball"),
        "height": Parameter("height", "h", "m", "mm", 1e3, "sensor and padding together, unloaded"),
    }
)

#: Share of draws of a distribution of loads, balls or moduli that it must keep within a factor, and that factor.
_KEPT, _FACTOR = 0.999, 1000.0
# Magnitudes [SI] beyond which only a slip of the unit explains a number: "10 mN" for N, "5 m" for mm.
_CONCEIVABLE = {"N": (1e-3, 1e4), "mm": (1e-6, 0.15), "1/mm": (5.0, 1e6), "MPa": (1.0, 1e12)}
#: Most loads, balls, and combinations of design variables that are gone through.
MOST_VALUES, MOST_CANDIDATES = 50, 60
#: Thicknesses that are tried, at most.
MOST_STEPS = 1001


@dataclass(frozen=True)
class Limit:
    """One side of a limit: `quantity` must be at least, or at most, `value` [SI].

    `at` [N] is the load at which it counts, one of the specification's; None for every load.
    """

    quantity: Limited
    side: Side
    value: float
    at: float | None = None

    @property
    def in_words(self) -> str:
        """Such as "stroke at most 2 mm at 10 N"."""
        load = "" if self.at is None else f" at {self.at:.4g} N"
        side = self.side.replace("_", " ")
        return f"{self.quantity.replace('_', ' ')} {side} {limited_in_words(self.quantity, self.value)}{load}"

    def margin(self, value: FloatArray) -> FloatArray:
        """Room that values [SI] leave to the limit, as a share of it: negative where it is missed, by -1 at most.

        >>> Limit("stroke", "at_most", 2e-3).margin(np.array([1e-3, 4e-3])).tolist()
        [0.5, -0.5]
        """
        if self.side == "at_least":
            return np.asarray(np.maximum(value / self.value - 1, -1.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(value > self.value, self.value / value - 1, 1 - value / self.value)

    def value_with(self, margin: float) -> float:
        """The value [SI] that leaves so much room, not negative, to the limit: see `margin`."""
        return self.value * (1 + margin if self.side == "at_least" else 1 - margin)


def limited_in_words(quantity: Limited, value: float) -> str:
    """Write a value of what is limited for people.

    Parameters
    ----------
    quantity : which.
    value : [SI].

    Examples
    --------
    >>> limited_in_words("signal", 0.0812), limited_in_words("stroke", 0.002)
    ('8.12 %', '2 mm')
    """
    row = LIMITED[quantity]
    return f"{value * row.display_scale:.4g} {row.display_unit}"


@dataclass(frozen=True)
class Tolerance:
    """How what is built scatters about its nominal value: `normal` with a standard deviation, `uniform` within plus or minus.

    >>> Tolerance("uniform", 0.1e-3).in_words
    'an error anywhere within ± 0.1 mm'

    Attributes
    ----------
    kind : of the distribution.
    size : [m], standard deviation, or half of the width.
    """

    kind: Literal["normal", "uniform"]
    size: float

    def offset(self, z: FloatArray) -> FloatArray:
        """How far off [m] what is built is at standard-normal coordinates, any shape."""
        return np.asarray(self.size * (z if self.kind == "normal" else 2 * ndtr(z) - 1), dtype=float)

    def pads(self, nominal: float, z: FloatArray) -> FloatArray:
        """Draw how thick pads [m] are that are made to a nominal thickness.

        The distribution is cut off at zero, as no pad is thinner than nothing: what is left of it is what there is.
        No padding at all has no tolerance.

        Parameters
        ----------
        nominal : [m].
        z : standard-normal coordinates, any shape, which the pads have, too.

        Examples
        --------
        >>> bool(np.min(Tolerance("normal", 0.1e-3).pads(0.05e-3, np.array([-4.0, 0.0, 4.0]))) > 0)
        True
        """
        if nominal == 0:
            return np.zeros(np.shape(z))
        if self.kind == "uniform":
            low, high = max(nominal - self.size, 0.0), nominal + self.size
            return np.asarray(low + (high - low) * ndtr(z), dtype=float)
        return np.maximum(nominal - self.size * ndtri(ndtr(-z) * ndtr(nominal / self.size)), 0.0)

    @property
    def in_words(self) -> str:
        """What it is, for people."""
        mm = f"{self.size * 1e3:.4g} mm"
        return f"a standard deviation of {mm}" if self.kind == "normal" else f"an error anywhere within ± {mm}"


@dataclass(frozen=True)
class CandidateMaterial:
    """A material that the padding may be made of, of the law of the sensor's silicone.

    Attributes
    ----------
    name : of it.
    young_modulus : [Pa], a number, or what is believed of it.
    poisson_ratio : [1], 0.5 for what keeps its volume; below for a foam.
    """

    name: str
    young_modulus: float | Prior
    poisson_ratio: float = INCOMPRESSIBLE


@dataclass(frozen=True)
class Specification:
    """What a sensor on its padding must do, what is built how exactly, and what may be chosen. SI throughout.

    >>> spec = Specification((Limit("signal", "at_least", 0.08),), force=(10.0,))
    >>> spec.probability, spec.steps
    (0.95, 181)

    Attributes
    ----------
    limits : what must hold, all of them at once, at every load and under every ball.
    force : [N], loads, or the distribution of the load of a sensor in use.
    name : of the specification.
    probability : [1], with which a sensor on its padding must conform.
    ball : [m], radii, or what is believed of the radius; None for the ball of the calibration.
    by_curvature : whether `ball` is the distribution of a curvature [1/m], of which the radius is the inverse.
    lower, upper : [m], paddings to choose from.
    steps : how many of them are tried, evenly spaced.
    padding_tolerance : of the thickness of the padding about its nominal; None for pads that are all alike.
    gauge : [m], standard uncertainty of a reading of the padding's thickness when pads are inspected; 0 for an exact one.
    guard_band : r of the guard band w = r U, U = 2 `gauge`; 0 for none.
    materials : that the padding may be made of; none for that of the calibration alone.
    sensor_thicknesses, electrode_radii : [m], to choose from; none for those of the measured sensors.
    sensor_tolerance, dielectric_tolerance, electrode_tolerance : of sensor thickness, dielectric thickness, electrode radius.
    modulus_spread, permittivity_spread : [1], standard deviation of the logarithm from sensor to sensor, beside what is not
        known of those that were measured.
    n_draw : how many draws of the posterior are used.

    Raises
    ------
    InputError
        With all that is wrong.
    """

    limits: tuple[Limit, ...]
    force: tuple[float, ...] | Prior
    name: str = ""
    probability: float = 0.95
    ball: tuple[float, ...] | Prior | None = None
    by_curvature: bool = False
    lower: float = 0.0
    upper: float = 9e-3
    steps: int = 181
    padding_tolerance: Tolerance | None = None
    gauge: float = 0.0
    guard_band: float = 1.0
    materials: tuple[CandidateMaterial, ...] = ()
    sensor_thicknesses: tuple[float, ...] = ()
    electrode_radii: tuple[float, ...] = ()
    sensor_tolerance: Tolerance | None = None
    dielectric_tolerance: Tolerance | None = None
    electrode_tolerance: Tolerance | None = None
    modulus_spread: float = 0.0
    permittivity_spread: float = 0.0
    n_draw: int = 1000

    def __post_init__(self) -> None:
        if faults := [fault for _, fault in faults_of({f.name: getattr(self, f.name) for f in fields(self)})]:
            raise InputError(faults)

    @property
    def largest_force(self) -> float:
        """The largest load [N]; of a distribution its 95 % quantile."""
        return float(self.force.ppf_normal(1.645)) if isinstance(self.force, Prior) else max(self.force)

    @property
    def smallest_force(self) -> float:
        """The smallest load [N]; of a distribution its 5 % quantile."""
        return float(self.force.ppf_normal(-1.645)) if isinstance(self.force, Prior) else min(self.force)

    @property
    def electrical(self) -> bool:
        """Whether a limit hangs on the change of capacitance."""
        return any(limit.quantity in ("signal", "force_resolution") for limit in self.limits)

    @property
    def outermost_balls(self) -> tuple[float, ...]:
        """Radii [m] of the smallest and the largest ball, or of the one; of a distribution its 5 % and 95 % quantiles.

        Empty for the ball of the calibration.
        """
        if self.ball is None:
            return ()
        radii = self.ball
        if isinstance(radii, Prior):
            ends = radii.ppf_normal(np.array([-1.645, 1.645]))
            radii = tuple(float(end) for end in (1 / ends if self.by_curvature else ends))
        return tuple(sorted({min(radii), max(radii)}))

    def to_plain(self) -> dict[str, Any]:
        """What files hold of it; the inverse is `specification_from_plain`."""
        plain = {f.name: getattr(self, f.name) for f in fields(self)}
        plain |= {name: _plain_values(plain[name]) for name in ("force", "ball")}
        plain["limits"] = [asdict(limit) for limit in self.limits]
        plain["materials"] = [
            {"name": m.name, "young_modulus": _plain_values(m.young_modulus), "poisson_ratio": m.poisson_ratio}
            for m in self.materials
        ]
        return plain | {name: asdict(plain[name]) for name in _TOLERANCES if plain[name] is not None}


def specification_from_plain(plain: Mapping[str, Any]) -> Specification:
    """The specification that `Specification.to_plain` wrote."""
    read = dict(plain)
    read |= {name: _values_from_plain(read[name]) for name in ("force", "ball")}
    read["limits"] = tuple(Limit(**limit) for limit in read["limits"])
    read["materials"] = tuple(
        CandidateMaterial(m["name"], cast("float | Prior", _values_from_plain(m["young_modulus"])), m["poisson_ratio"])
        for m in read["materials"]
    )
    read |= {name: tuple(read[name]) for name in ("sensor_thicknesses", "electrode_radii")}
    return Specification(**read | {name: Tolerance(**read[name]) for name in _TOLERANCES if read[name] is not None})


def _plain_values(values: object) -> object:
    return values.to_json() if isinstance(values, Prior) else values


def _values_from_plain(plain: Any) -> Any:
    if isinstance(plain, Mapping):
        return prior_from_json(plain)
    return tuple(plain) if isinstance(plain, list) else plain


#: Field of a specification that is a tolerance -> where it stands in a file.
_TOLERANCES: Mapping[str, KeyPath] = MappingProxyType(
    {
        "padding_tolerance": ("padding", "tolerance"),
        "sensor_tolerance": ("sensor", "thickness_tolerance"),
        "dielectric_tolerance": ("sensor", "dielectric_tolerance"),
        "electrode_tolerance": ("sensor", "electrode_tolerance"),
    }
)


@dataclass
class _Found:
    """Faults with their places, as they are found."""

    faults: list[tuple[KeyPath, Fault]] = field(default_factory=list)

    def unless(self, holds: bool, at: KeyPath, message: str, advice: str = "") -> None:
        if not holds:
            self.faults.append((at, Fault(message, advice=advice)))


def faults_of(values: Mapping[str, Any]) -> list[tuple[KeyPath, Fault]]:
    """Find everything that is wrong with what a specification would be made of.

    Parameters
    ----------
    values : the fields of a `Specification`, by name.

    Returns
    -------
    What is wrong, each with the key in a file where it stands.
    """
    found = _Found()
    p = values["probability"]
    message = f"probability must be from 0.5 to below 1, got {p:.6g}"
    found.unless(0.5 <= p < 1, ("probability",), message, "Write for example 0.95")
    _values(found, ("loads", "force"), values["force"], "force", 1.0, "N")
    if values["ball"] is not None:
        name, scale, unit = ("curvature", 1e-3, "1/mm") if values["by_curvature"] else ("ball", 1e3, "mm")
        _values(found, ("loads", name), values["ball"], name, scale, unit)
    _limits(found, values["limits"], values["force"])
    _padding(found, values)
    for name, key in (("sensor_thicknesses", "thickness"), ("electrode_radii", "electrode_radius")):
        _list(found, ("sensor", key), values[name], key, 1e3, "mm")
    for name, where in _TOLERANCES.items():
        if values[name] is not None:
            size = values[name].size
            message = f"{where[-1]} must be positive, got {size * 1e3:.6g} mm"
            found.unless(math.isfinite(size) and size > 0, where, message, "Leave it out for none")
    for name, key in (("modulus_spread", "young_modulus"), ("permittivity_spread", "relative_permittivity")):
        said = f"spread of {key} must lie between 0 and 0.5, got {values[name]:.6g}"
        found.unless(0 <= values[name] <= 0.5, ("spread", key), said, "0.05 is a standard deviation of 5 %")
    found.unless(values["n_draw"] >= 50, (), f"n_draw must be at least 50, got {values['n_draw']}")
    return found.faults


def _values(found: _Found, at: KeyPath, values: object, name: str, scale: float, unit: str) -> None:
    """Check loads, balls or a modulus: a distribution, or some numbers."""
    if isinstance(values, Prior):
        low, high = values.interval(_KEPT)
        holds = 0 < low < high < math.inf and high < _FACTOR * low
        reach = f"99.9 % of it from {low * scale:.3g} to {high * scale:.3g} {unit}"
        advice = "Give one that stays positive and within a factor of a thousand, such as { uniform = [...] }"
        found.unless(holds, at, f"{name} has a distribution that no sensor could meet, {reach}", advice)
    else:
        _list(found, at, cast("Sequence[float]", values), name, scale, unit)
        found.unless(len(cast("Sequence[float]", values)) > 0, at, f"{name} is an empty list", "Give at least one")


def _list(found: _Found, at: KeyPath, values: Sequence[float], name: str, scale: float, unit: str) -> None:
    found.unless(len(values) <= MOST_VALUES, at, f"{len(values)} values of {name}, more than {MOST_VALUES}", "Give fewer")
    for value in values[:MOST_VALUES]:
        holds = math.isfinite(value) and value > 0
        found.unless(holds, at, f"{name} must be positive, got {value * scale:.6g} {unit}")
        smallest, largest = _CONCEIVABLE[unit]
        likely = not holds or smallest <= value <= largest
        found.unless(likely, at, f"{name} cannot be {value * scale:.3g} {unit}", "Check the letters of the unit")
    found.unless(len(set(values)) == len(values), at, f"{name} names a value twice", "Give each once")


def _limits(found: _Found, limits: Sequence[Limit], force: object) -> None:
    advice = "Give for example signal = { at_least = 0.08 } in [limits]"
    found.unless(bool(limits), ("limits",), "a specification without limits always holds", advice)
    for limit in limits:
        at: KeyPath = ("limits", limit.quantity)
        row, value = LIMITED[limit.quantity], limit.value
        got = f"got {value * row.display_scale:.6g} {row.display_unit}"
        found.unless(math.isfinite(value) and value > 0, at, f"{limit.quantity} {limit.side} must be positive, {got}")
        message = f"{limit.quantity} {limit.side}, {got}, asks for readings that tell no less"
        meant = limit.side in sides_of(limit.quantity)
        found.unless(meant, at, message, "Write at_most: the smaller it is, the better it is read")
        if limit.quantity in ("signal", "dielectric_strain") and value >= 1:
            found.unless(False, at, f"{limit.quantity} must be below 1, {got}", 'Write 8 percent as 0.08 or "8 %"')
        if limit.at is None:
            continue
        where = (*at, "at")
        found.unless(limit.quantity != "height", where, "height does not depend on a load", "Leave at = out")
        if isinstance(force, Prior):
            message = "a limit cannot count at one load where the load is a distribution"
            found.unless(False, where, message, "Leave at = out, or list the loads")
        else:
            loads = cast("Sequence[float]", force)
            listed = any(math.isclose(limit.at, load, rel_tol=1e-9) for load in loads)
            known = ", ".join(f"{load:g} N" for load in loads[:10])
            message = f"the limit counts at {limit.at:g} N, which is none of the loads"
            found.unless(listed, where, message, f"These are {known}")
    for quantity in dict.fromkeys(limit.quantity for limit in limits):
        own = [limit for limit in limits if limit.quantity == quantity]
        for low in (limit for limit in own if limit.side == "at_least"):
            for high in (limit for limit in own if limit.side == "at_most"):
                together = low.at is None or high.at is None or low.at == high.at
                between = " and ".join(f"{x.side.replace('_', ' ')} {limited_in_words(quantity, x.value)}" for x in (low, high))
                message = f"nothing has a {quantity} of {between}"
                holds = not together or low.value < high.value
                found.unless(holds, ("limits", quantity), message, "The smaller one is at_least")


def _padding(found: _Found, values: Mapping[str, Any]) -> None:
    lower, upper, steps = values["lower"], values["upper"], values["steps"]
    at: KeyPath = ("padding", "thickness")
    message = f"padding thickness must not be negative, got {lower * 1e3:.6g} mm"
    found.unless(lower >= 0, at, message, "Start at 0 mm or above")
    asked = f"{lower * 1e3:.6g} mm to {upper * 1e3:.6g} mm"
    advice = "Write the smaller thickness first, and about a pad that is there a narrow range, such as 1.09 to 1.11 mm"
    found.unless(lower < upper < math.inf, at, f"the padding range is empty: {asked}", advice)
    message = f"steps must be from 3 to {MOST_STEPS}, got {steps}"
    found.unless(3 <= steps <= MOST_STEPS, ("padding", "steps"), message, "Leave it out for 181")
    gauge, factor = values["gauge"], values["guard_band"]
    found.unless(0 <= gauge < math.inf, ("padding", "gauge"), f"gauge must not be negative, got {gauge * 1e3:.6g} mm")
    found.unless(
        0 <= factor <= 10, ("padding", "guard_band"), f"guard_band must be from 0 to 10, got {factor:.6g}", "1 is usual"
    )
    names = [m.name for m in values["materials"]]
    for i, material in enumerate(values["materials"]):
        where: KeyPath = ("padding", "materials", i)
        found.unless(bool(material.name.strip()), where, "a material needs a name", 'Give name = "..."')
        found.unless(names.count(material.name) == 1, where, f'the material "{material.name}" is there twice', "Name each once")
        modulus = material.young_modulus
        told = modulus if isinstance(modulus, Prior) else (modulus,)
        _values(found, (*where, "young_modulus"), told, "young_modulus", 1e-6, "MPa")
        nu = material.poisson_ratio
        found.unless(
            0 <= nu <= INCOMPRESSIBLE, (*where, "poisson_ratio"), f"poisson_ratio must lie between 0 and 0.5, got {nu:.6g}"
        )
    n = (1 + len(names)) * max(1, len(values["sensor_thicknesses"])) * max(1, len(values["electrode_radii"]))
    message = f"{n} combinations of materials, sensor thicknesses and electrode radii, more than {MOST_CANDIDATES}"
    found.unless(n <= MOST_CANDIDATES, ("padding",), message, "Give fewer of each")


#: Both sides of a limit, as they are written.
SIDES: tuple[Side, ...] = get_args(Side)


def sides_of(quantity: Limited) -> tuple[Side, ...]:
    """On which sides a quantity may be limited: nobody asks for readings that tell little.

    Parameters
    ----------
    quantity : which.

    Examples
    --------
    >>> sides_of("stroke"), sides_of("force_resolution")
    (('at_least', 'at_most'), ('at_most',))
    """
    return ("at_most",) if quantity == "force_resolution" else SIDES

"""From geometry and material of indenter, sensor and padding to one self-checked, SI-valued `Design`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]
IntArray = npt.NDArray[np.int64]
#: One number, or one number per draw with shape (n_draw,).
Scalar = float | FloatArray
#: What the stack rests on: glued to a rigid base, or free to slide on it (but not to lift off), without friction or with it.
Base = Literal["bonded", "slippery"]

#: Poisson's ratio of a material that keeps its volume: what silicone is taken for, and the largest there is.
INCOMPRESSIBLE = 0.5
#: Vacuum permittivity [F/m], CODATA 2018.
VACUUM_PERMITTIVITY = 8.8541878128e-12


@dataclass(frozen=True)
class Parameter:
    """How one quantity is called and written: name in code, symbol, unit, unit for people, words.

    `display_scale` display units make one SI unit: a thickness of 1e-3 m is shown as 1e-3 * 1e3 = 1 mm.
    """

    name: str
    symbol: str
    unit: str
    display_unit: str
    display_scale: float
    label: str


def _table(*rows: Parameter) -> Mapping[str, Parameter]:
    return MappingProxyType({row.name: row for row in rows})


#: The quantities of a design: name -> symbol, units, label.
PARAMETERS: Mapping[str, Parameter] = _table(
    Parameter("young_modulus", "E", "Pa", "MPa", 1e-6, "Young's modulus of the sensor"),
    Parameter("padding_young_modulus", "E_p", "Pa", "MPa", 1e-6, "Young's modulus of the padding"),
    Parameter("padding_poisson_ratio", "ν_p", "", "", 1.0, "Poisson's ratio of the padding"),
    Parameter("stiffening", "1/J_m", "", "", 1.0, "stiffening of sensor and padding (inverse of Gent's limit)"),
    Parameter("relative_permittivity", "ε_r", "", "", 1.0, "relative permittivity"),
    Parameter("sensor_thickness", "h_s", "m", "mm", 1e3, "sensor thickness"),
    Parameter("padding_thickness", "h_p", "m", "mm", 1e3, "padding thickness"),
    Parameter("dielectric_thickness", "t_d", "m", "mm", 1e3, "thickness of each dielectric"),
    Parameter("sensor_radius", "a", "m", "mm", 1e3, "disc radius"),
    Parameter("electrode_radius", "a_e", "m", "mm", 1e3, "electrode radius"),
    Parameter("indenter_radius", "R", "m", "mm", 1e3, "ball radius"),
    Parameter("friction_coefficient", "f", "", "", 1.0, "friction between ball and sensor"),
    Parameter("base_friction_coefficient", "f_b", "", "", 1.0, "friction between padding and base"),
)


def _require_positive(name: str, value: Scalar, *, zero_allowed: bool = False) -> None:
    values = np.asarray(value, dtype=float)
    good = ((values >= 0) if zero_allowed else (values > 0)) & (values < np.inf)
    if not np.all(good):
        bad = ~good
        row = PARAMETERS.get(name)
        scale, unit = (row.display_scale, row.display_unit) if row else (1.0, "")
        worst = float(np.atleast_1d(values)[np.atleast_1d(bad)][0])
        rule = "must not be negative" if zero_allowed else "must be positive"
        raise ValueError(f"{name} {rule}, got {worst * scale:.6g} {unit}".rstrip())


def _require_friction(name: str, value: Scalar) -> None:
    friction = np.atleast_1d(np.asarray(value, dtype=float))
    if not np.all(friction >= 0):
        raise ValueError(f"{name} must not be negative, got {friction[~(friction >= 0)][0]:g}")


def require_base(base: Base, friction: Scalar) -> None:
    """Refuse what is no base, and friction on one that nothing slides on.

    Parameters
    ----------
    base : what a stack rests on.
    friction : Coulomb's coefficient there [1], one number or one per draw.

    Raises
    ------
    ValueError
        If the base is none of `Base`, or the friction is negative, or above zero and the base not slippery.
    """
    if base not in get_args(Base):
        raise ValueError(f"base must be bonded or slippery, got {base!r}")
    _require_friction("base_friction_coefficient", friction)
    if base != "slippery" and np.any(np.asarray(friction) > 0):
        raise ValueError(
            f"base_friction_coefficient is that of a slippery base, got {np.max(friction):g} on one that is {base}"
        )


def require_poisson_ratio(name: str, value: Scalar) -> None:
    """Refuse what is no Poisson's ratio of a foam or a rubber.

    Parameters
    ----------
    name : of the quantity, for the message.
    value : [1], one number or one per draw.

    Raises
    ------
    ValueError
        If a value is not between 0 and 0.5.
    """
    values = np.atleast_1d(np.asarray(value, dtype=float))
    bad = ~((values >= 0) & (values <= INCOMPRESSIBLE))
    if np.any(bad):
        raise ValueError(f"{name} must lie between 0 and 0.5, got {values[bad][0]:.6g}")


@dataclass(frozen=True, eq=False)
class Indenter:
    """A rigid ball of `radius` [m] that is pressed into the sensor.

    `friction_coefficient` [1] is Coulomb's, inf for full stick.

    Raises
    ------
    ValueError
        If the radius is not positive or the friction coefficient is negative.
    """

    radius: Scalar
    friction_coefficient: Scalar = 0.0

    def __post_init__(self) -> None:
        _require_positive("indenter_radius", self.radius)
        _require_friction("friction_coefficient", self.friction_coefficient)


@dataclass(frozen=True, eq=False)
class Sensor:
    """A disc of two dielectric layers between three compliant electrodes, all lengths in [m], modulus in [Pa].

    The signal electrode lies at mid-plane, the grounds at +- the dielectric thickness from it. `electrode_radius` and
    `dielectric_thickness` are what was given, None where they follow from the disc: read them from a `Design`, which has
    their values in that case too. `stiffening` [1] is 1/J_m of Gent's law (`models.laws.Gent`) in sensor and padding; 0, the
    default, is neo-Hookean.

    Raises
    ------
    ValueError
        If a quantity is not positive (the stiffening: negative), an electrode is wider than the disc, or a dielectric thicker
        than half the sensor.
    """

    thickness: Scalar
    radius: Scalar
    young_modulus: Scalar
    relative_permittivity: Scalar
    electrode_radius: Scalar | None = None
    dielectric_thickness: Scalar | None = None
    stiffening: Scalar = 0.0

    def __post_init__(self) -> None:
        _require_positive("sensor_thickness", self.thickness)
        _require_positive("sensor_radius", self.radius)
        _require_positive("young_modulus", self.young_modulus)
        _require_positive("relative_permittivity", self.relative_permittivity)
        _require_positive("stiffening", self.stiffening, zero_allowed=True)
        slack = 1 + 1e-9
        if self.electrode_radius is not None:
            _require_positive("electrode_radius", self.electrode_radius)
            if np.any(np.asarray(self.electrode_radius) > np.asarray(self.radius) * slack):
                raise ValueError(
                    f"electrode_radius must not exceed the disc radius, got {np.max(self.electrode_radius) * 1e3:.6g} mm "
                    f"on a disc of {np.min(self.radius) * 1e3:.6g} mm"
                )
        if self.dielectric_thickness is not None:
            _require_positive("dielectric_thickness", self.dielectric_thickness)
            if np.any(np.asarray(self.dielectric_thickness) > np.asarray(self.thickness) / 2 * slack):
                raise ValueError(
                    "dielectric_thickness (of each of the two) must not exceed half the sensor thickness, got "
                    f"{np.max(self.dielectric_thickness) * 1e3:.6g} mm in a sensor of {np.min(self.thickness) * 1e3:.6g} mm"
                )


@dataclass(frozen=True, eq=False)
class Padding:
    """Soft padding of `thickness` [m] (0 for none) and `young_modulus` [Pa] bonded to the sensor above it, on the base.

    `young_modulus` is None for the same silicone as the sensor; `Design.padding_young_modulus` says what that is.
    `poisson_ratio` [1] from 0 to 0.5 is that of a foam, a compressible neo-Hookean solid; None, as 0.5, is as incompressible
    as the sensor. `base_friction_coefficient` [1] is Coulomb's on a base that is slippery otherwise, inf for full stick;
    without padding it is the sensor's.

    Raises
    ------
    ValueError
        If the thickness or the friction coefficient is negative, the modulus is not positive, or Poisson's ratio is not between
        0 and 0.5.
    """

    thickness: Scalar
    young_modulus: Scalar | None = None
    poisson_ratio: Scalar | None = None
    base_friction_coefficient: Scalar = 0.0

    def __post_init__(self) -> None:
        _require_positive("padding_thickness", self.thickness, zero_allowed=True)
        if self.young_modulus is not None:
            _require_positive("padding_young_modulus", self.young_modulus)
        if self.poisson_ratio is not None:
            require_poisson_ratio("padding_poisson_ratio", self.poisson_ratio)
        _require_friction("base_friction_coefficient", self.base_friction_coefficient)


@dataclass(frozen=True, eq=False)
class Design:
    """Indenter on sensor on padding: everything a `Forward` needs but the depth.

    Every quantity is one number or an array of shape (n_draw,): a design may stand for a batch of draws. What follows from
    other quantities (electrode radius, dielectric thickness, modulus of the padding) is worked out when it is asked for, so
    that it follows when `dataclasses.replace` changes them.

    Raises
    ------
    ValueError
        If a padding that is compressible stiffens: its law is neo-Hookean. If the base is none of `Base`, or has friction and
        is not slippery.
    """

    indenter: Indenter
    sensor: Sensor
    padding: Padding
    base: Base = "bonded"

    def __post_init__(self) -> None:
        require_base(self.base, self.padding.base_friction_coefficient)
        both = self.padding_is_compressible & (np.asarray(self.sensor.stiffening) > 0)
        if np.any(both):
            ratio = np.broadcast_to(np.asarray(self.padding_poisson_ratio, dtype=float), both.shape)
            raise ValueError(
                f"a padding with padding_poisson_ratio below 0.5 is neo-Hookean and does not stiffen with the sensor, got "
                f"{ratio[both][0]:.6g}; set stiffening to 0, or describe the stack layer by layer, each with its law"
            )

    @property
    def electrode_radius(self) -> Scalar:
        """Radius of the electrodes [m]; the disc's where none was given."""
        own = self.sensor.electrode_radius
        return self.sensor.radius if own is None else own

    @property
    def dielectric_thickness(self) -> Scalar:
        """Thickness of each of the two dielectrics [m]; half the sensor where none was given."""
        own = self.sensor.dielectric_thickness
        return self.sensor.thickness / 2 if own is None else own

    @property
    def padding_young_modulus(self) -> Scalar:
        """Young's modulus of the padding [Pa]; the sensor's where none was given."""
        own = self.padding.young_modulus
        return self.sensor.young_modulus if own is None else own

    @property
    def padding_poisson_ratio(self) -> Scalar:
        """Poisson's ratio of the padding [1]; 0.5, incompressible, where none was given."""
        if self.padding.poisson_ratio is not None:
            return self.padding.poisson_ratio
        shape = np.shape(self.padding.thickness)
        return np.full(shape, INCOMPRESSIBLE) if shape else INCOMPRESSIBLE

    @property
    def padding_is_compressible(self) -> BoolArray:
        """Whether there is a padding that changes its volume, a Poisson's ratio below 0.5; shape () or (n_draw,)."""
        below = np.asarray(self.padding_poisson_ratio) < INCOMPRESSIBLE
        return np.asarray(below & (np.asarray(self.padding.thickness) > 0))

    @property
    def total_thickness(self) -> Scalar:
        """Thickness of sensor and padding together, h_s + h_p [m]."""
        return self.sensor.thickness + self.padding.thickness

    @property
    def rest_capacitance(self) -> Scalar:
        """Capacitance without contact, C0 = 2 eps_0 eps_r pi a_e^2 / t_d [F] (Zhu et al. 2019, Eq. 1).

        Of the two dielectrics in parallel, without fringe fields.
        """
        area = np.pi * np.asarray(self.electrode_radius, dtype=float) ** 2
        c0 = 2 * VACUUM_PERMITTIVITY * self.sensor.relative_permittivity * area / self.dielectric_thickness  # Eq. (1)
        return float(c0) if np.ndim(c0) == 0 else np.asarray(c0, dtype=float)

    def parameters(self) -> dict[str, Scalar]:
        """Every quantity of the design as parameter name -> value [SI], with what follows from others worked out."""
        return {
            "indenter_radius": self.indenter.radius,
            "sensor_thickness": self.sensor.thickness,
            "sensor_radius": self.sensor.radius,
            "young_modulus": self.sensor.young_modulus,
            "relative_permittivity": self.sensor.relative_permittivity,
            "electrode_radius": self.electrode_radius,
            "dielectric_thickness": self.dielectric_thickness,
            "padding_thickness": self.padding.thickness,
            "padding_young_modulus": self.padding_young_modulus,
            "padding_poisson_ratio": self.padding_poisson_ratio,
            "stiffening": self.sensor.stiffening,
            "friction_coefficient": self.indenter.friction_coefficient,
            "base_friction_coefficient": self.padding.base_friction_coefficient,
        }

    def given(self) -> dict[str, Scalar]:
        """The `parameters` that were given, without those that follow from others: the inverse of `design_from`."""
        follows = {
            "electrode_radius": self.sensor.electrode_radius is None,
            "dielectric_thickness": self.sensor.dielectric_thickness is None,
            "padding_young_modulus": self.padding.young_modulus is None,
            "padding_poisson_ratio": self.padding.poisson_ratio is None,
        }
        return {name: value for name, value in self.parameters().items() if not follows.get(name, False)}

    def draws(self) -> Design:
        """The same design with every quantity of shape (n_draw,); a design of plain numbers gets n_draw = 1."""
        values = self.given()
        shapes = {np.shape(v) for v in values.values()}
        if len(shapes) == 1 and shapes != {()}:
            return self
        shape = np.broadcast_shapes((1,), *shapes)
        spread = {k: np.broadcast_to(np.asarray(v, dtype=float), shape) for k, v in values.items()}
        return design_from(spread, base=self.base)

    def draw(self, index: int) -> Design:
        """Draw number `index` as a design of plain numbers."""
        batch = self.draws().given()
        single = {k: float(np.asarray(v)[index]) for k, v in batch.items()}
        return design_from(single, base=self.base)

    def only(self, rows: BoolArray) -> Design:
        """The batch of those draws that `rows` (n_draw,) marks."""
        chosen = {k: np.asarray(v)[rows] for k, v in self.draws().given().items()}
        return design_from(chosen, base=self.base)

    @property
    def is_batch(self) -> bool:
        """Whether any quantity is an array of draws."""
        return any(np.ndim(v) > 0 for v in self.parameters().values())


def design_from(values: Mapping[str, Scalar], *, friction_coefficient: Scalar = 0.0, base: Base = "bonded") -> Design:
    """Make a `Design` from a mapping of names to numbers.

    Parameters
    ----------
    values : parameter name (see `PARAMETERS`) -> value [SI], each a number or of shape (n_draw,). `electrode_radius`,
        `dielectric_thickness` and `padding_young_modulus` may be left out and then follow from the others (see `Design`);
        `padding_poisson_ratio` is 0.5, `stiffening` and `base_friction_coefficient` 0 by default.
    friction_coefficient : [1], of ball on sensor, inf for full stick, if `values` do not say it.
    base : what the stack rests on.

    Returns
    -------
    The design; other names in `values` are not looked at.

    Raises
    ------
    KeyError
        If a required parameter is missing.
    ValueError
        If a value breaks a rule of `Indenter`, `Sensor`, `Padding` or `Design`.
    """
    return Design(
        Indenter(values["indenter_radius"], values.get("friction_coefficient", friction_coefficient)),
        Sensor(
            thickness=values["sensor_thickness"],
            radius=values["sensor_radius"],
            young_modulus=values["young_modulus"],
            relative_permittivity=values["relative_permittivity"],
            electrode_radius=values.get("electrode_radius"),
            dielectric_thickness=values.get("dielectric_thickness"),
            stiffening=values.get("stiffening", 0.0),
        ),
        Padding(
            values["padding_thickness"],
            values.get("padding_young_modulus"),
            values.get("padding_poisson_ratio"),
            values.get("base_friction_coefficient", 0.0),
        ),
        base,
    )

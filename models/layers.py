"""From an indenter's profile and any stack of bonded layers to one self-checked, SI-valued `LayeredDesign`.

A `Design` (sensor on padding under a sphere) is the simple case, and `layered` turns it into one of these.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from models.laws import Gent, Law, NeoHookean
from models.sensor import INCOMPRESSIBLE, VACUUM_PERMITTIVITY, Base, Design, require_base, require_poisson_ratio

#: Largest finite coefficient of friction on the base: at ten the paper's sensor takes all but 0.3 % of the force on a bonded
#: one.
LARGEST_BASE_FRICTION = 10.0


@dataclass(frozen=True)
class Profile:
    """Meridian of a rigid axisymmetric indenter: a flat face, a rounded edge, and a straight flank from there on.

    Attributes
    ----------
    flat_radius : [m], radius b of the flat face; 0 for none.
    rounding_radius : [m], radius rho of the arc that begins at r = b.
    flank_angle : [rad], inclination at which the arc ends and the flank goes on, pi/2 for a vertical wall.

    Raises
    ------
    ValueError
        If a length or the angle is not in its range.
    """

    flat_radius: float
    rounding_radius: float
    flank_angle: float

    def __post_init__(self) -> None:
        if not 0 <= self.flat_radius < np.inf:
            raise ValueError(f"the flat face must not have a negative radius, got {self.flat_radius * 1e3:g} mm")
        if not 0 < self.rounding_radius < np.inf:
            raise ValueError(f"the rounding radius must be positive, got {self.rounding_radius * 1e3:g} mm")
        if not 0 < self.flank_angle <= np.pi / 2:
            raise ValueError(f"the flank angle must lie between 0 and 90 degrees, got {np.degrees(self.flank_angle):g}")

    @property
    def length(self) -> float:
        """A length that scales with the indenter, flat face plus rounding [m]; a sphere's radius."""
        return self.flat_radius + self.rounding_radius

    def scaled(self, factor: float) -> Profile:
        """The same shape, `factor` times as large."""
        return replace(self, flat_radius=self.flat_radius * factor, rounding_radius=self.rounding_radius * factor)

    def radius_at(self, height: float) -> float:
        """Radius [m] of the indenter `height` [m] above its lowest point."""
        b, rho, angle = self.flat_radius, self.rounding_radius, self.flank_angle
        end = rho * (1 - np.cos(angle))
        if height <= end:
            return float(b + np.sqrt(max(0.0, height * (2 * rho - height))))
        return float(b + rho * np.sin(angle) + (height - end) / np.tan(angle))

    def height_at(self, radius: float) -> float:
        """Height [m] above the lowest point at which the indenter has `radius` [m]; inf where it never has."""
        b, rho, angle = self.flat_radius, self.rounding_radius, self.flank_angle
        if radius <= b:
            return 0.0
        end = b + rho * np.sin(angle)
        if radius <= end:
            return float(rho - np.sqrt(rho**2 - (radius - b) ** 2))
        return np.inf if angle == np.pi / 2 else float(rho * (1 - np.cos(angle)) + (radius - end) * np.tan(angle))


def sphere(radius: float) -> Profile:
    """A sphere of `radius` [m] on a shaft as wide as itself."""
    return Profile(0.0, radius, np.pi / 2)


def flat_punch(radius: float, edge_radius: float) -> Profile:
    """A flat-ended cylinder with a rounded edge.

    Parameters
    ----------
    radius : [m], of the cylinder.
    edge_radius : [m], of the rounding of its edge.

    Returns
    -------
    Its profile.

    Raises
    ------
    ValueError
        If the edge is rounder than the cylinder is wide.
    """
    if edge_radius > radius:
        raise ValueError(f"the edge radius {edge_radius * 1e3:g} mm exceeds the cylinder's {radius * 1e3:g} mm")
    return Profile(radius - edge_radius, edge_radius, np.pi / 2)


def cone(half_angle: float, tip_radius: float) -> Profile:
    """A cone with a rounded tip.

    Parameters
    ----------
    half_angle : [rad], between axis and flank.
    tip_radius : [m], of the rounding of its tip.

    Returns
    -------
    Its profile.
    """
    return Profile(0.0, tip_radius, np.pi / 2 - half_angle)


@dataclass(frozen=True)
class Layer:
    """One layer: `thickness` [m], small-strain `young_modulus` [Pa], hyperelastic `law`, and a `name` for pictures.

    `poisson_ratio` [1] from 0 to 0.5 is that of a foam, a compressible neo-Hookean solid; 0.5 is incompressible, of any law.

    Raises
    ------
    ValueError
        If thickness or modulus is not positive, Poisson's ratio is not between 0 and 0.5, or a compressible layer has another
        law: at small strain the others would not have that ratio.
    """

    thickness: float
    young_modulus: float
    law: Law = field(default_factory=NeoHookean)
    name: str = ""
    poisson_ratio: float = INCOMPRESSIBLE

    def __post_init__(self) -> None:
        if not 0 < self.thickness < np.inf:
            raise ValueError(f"the thickness of layer {self.name!r} must be positive, got {self.thickness * 1e3:g} mm")
        if not 0 < self.young_modulus < np.inf:
            raise ValueError(f"young_modulus of layer {self.name!r} must be positive, got {self.young_modulus * 1e-6:g} MPa")
        require_poisson_ratio(f"poisson_ratio of layer {self.name!r}", self.poisson_ratio)
        if self.poisson_ratio < INCOMPRESSIBLE and self.law != NeoHookean():
            raise ValueError(
                f"a layer with a poisson_ratio below 0.5 must be neo-hookean, but layer {self.name!r} is {self.law.name} with "
                f"{self.poisson_ratio:g}"
            )


@dataclass(frozen=True)
class Dielectric:
    """Elastomer between two electrodes at heights `lower` and `upper` [m] above the base, undeformed."""

    lower: float
    upper: float
    relative_permittivity: float

    @property
    def thickness(self) -> float:
        """Undeformed thickness [m]."""
        return self.upper - self.lower


@dataclass(frozen=True)
class LayeredDesign:
    """Indenter on bonded layers on a base.

    Attributes
    ----------
    profile : of the indenter.
    friction_coefficient : Coulomb's, inf for full stick.
    layers : from the base up.
    radius, electrode_radius : of the disc and of every electrode [m].
    dielectrics : electrically in parallel; at least one.
    base : what the stack rests on.
    base_friction_coefficient : Coulomb's between stack and a base that is slippery otherwise, at most `LARGEST_BASE_FRICTION`;
        inf for full stick.

    Raises
    ------
    ValueError
        If a quantity is out of its range or a dielectric lies outside the stack.
    """

    profile: Profile
    layers: tuple[Layer, ...]
    radius: float
    electrode_radius: float
    dielectrics: tuple[Dielectric, ...]
    friction_coefficient: float = 0.0
    base: Base = "bonded"
    base_friction_coefficient: float = 0.0

    def __post_init__(self) -> None:
        if not self.layers:
            raise ValueError("a stack needs at least one layer")
        if not 0 < self.radius < np.inf:
            raise ValueError(f"the disc radius must be positive, got {self.radius * 1e3:g} mm")
        if not 0 < self.electrode_radius <= self.radius * (1 + 1e-9):
            raise ValueError(
                f"electrode_radius must be positive and not exceed the disc's {self.radius * 1e3:g} mm, "
                f"got {self.electrode_radius * 1e3:g} mm"
            )
        if not self.friction_coefficient >= 0:
            raise ValueError(f"friction_coefficient must not be negative, got {self.friction_coefficient:g}")
        require_base(self.base, self.base_friction_coefficient)
        if LARGEST_BASE_FRICTION < self.base_friction_coefficient < np.inf:
            raise ValueError(
                f"base_friction_coefficient must not be above {LARGEST_BASE_FRICTION:g} unless it is inf, for a base on which "
                f"nothing slides, got {self.base_friction_coefficient:g}"
            )
        if not self.dielectrics:
            raise ValueError("a stack needs at least one dielectric")
        for d in self.dielectrics:
            if not (-1e-9 * self.thickness <= d.lower < d.upper <= self.thickness * (1 + 1e-9)):
                raise ValueError(
                    f"a dielectric from {d.lower * 1e3:g} to {d.upper * 1e3:g} mm does not lie in a stack of "
                    f"{self.thickness * 1e3:g} mm"
                )
            if not 0 < d.relative_permittivity < np.inf:
                raise ValueError(f"relative_permittivity must be positive, got {d.relative_permittivity:g}")

    @property
    def frictionless(self) -> bool:
        """Whether nothing rubs, so that forces do not depend on the path."""
        return self.friction_coefficient == 0 and self.base_friction_coefficient in (0, np.inf)

    @property
    def thickness(self) -> float:
        """Thickness of the whole stack [m]."""
        return float(sum(layer.thickness for layer in self.layers))

    def scaled(self, length: float, modulus: float) -> LayeredDesign:
        """The same design in other units.

        Parameters
        ----------
        length : [m], the new unit of length.
        modulus : [Pa], the new unit of the moduli.

        Returns
        -------
        The design with lengths and moduli in these units.
        """
        return replace(
            self,
            profile=self.profile.scaled(1 / length),
            layers=tuple(
                replace(x, thickness=x.thickness / length, young_modulus=x.young_modulus / modulus) for x in self.layers
            ),
            radius=self.radius / length,
            electrode_radius=self.electrode_radius / length,
            dielectrics=tuple(replace(d, lower=d.lower / length, upper=d.upper / length) for d in self.dielectrics),
        )

    @property
    def rest_capacitance(self) -> float:
        """C0 [F] of the dielectrics in parallel, plates of the electrodes' area without fringe fields."""
        per_area = sum(d.relative_permittivity / d.thickness for d in self.dielectrics)
        return float(VACUUM_PERMITTIVITY * np.pi * self.electrode_radius**2 * per_area)


def layered(design: Design) -> LayeredDesign:
    """One (not batch) `Design` as layers: padding, if any, below the sensor, both of one law."""
    p = {k: float(np.asarray(v)) for k, v in design.parameters().items()}
    law: Law = Gent(1 / p["stiffening"]) if p["stiffening"] > 0 else NeoHookean()
    sensor = Layer(p["sensor_thickness"], p["young_modulus"], law, "sensor")
    padding = p["padding_thickness"]
    below = (Layer(padding, p["padding_young_modulus"], law, "padding", p["padding_poisson_ratio"]),) if padding > 0 else ()
    middle, t_d, eps = padding + p["sensor_thickness"] / 2, p["dielectric_thickness"], p["relative_permittivity"]
    t_d = min(t_d, p["sensor_thickness"] / 2)
    return LayeredDesign(
        profile=sphere(p["indenter_radius"]),
        layers=(*below, sensor),
        radius=p["sensor_radius"],
        electrode_radius=min(p["electrode_radius"], p["sensor_radius"]),
        dielectrics=(Dielectric(middle - t_d, middle, eps), Dielectric(middle, middle + t_d, eps)),
        friction_coefficient=p["friction_coefficient"],
        base=design.base,
        base_friction_coefficient=p["base_friction_coefficient"],
    )


def path_end(design: LayeredDesign) -> float:
    """Largest indentation [m] that the finite elements accept: 65 % of the stack, and the indenter short of the disc's rim.

    A sphere goes in no deeper than its radius; a plate whose flat face covers the disc has no rim to come near.
    """
    p = design.profile
    rim = np.inf if p.flat_radius >= design.radius else p.height_at(0.97 * design.radius)
    ball = p.rounding_radius if p == sphere(p.rounding_radius) else np.inf
    return min(0.65 * design.thickness, rim, ball)

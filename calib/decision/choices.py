"""A specification and a sensor in draws in, the sensors that may be built, each with its scatter, out; or why one cannot be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.special import ndtri

from calib.decision.sensors import ModelDraws
from calib.errors import Fault, InputError
from calib.experiment import CandidateMaterial, Specification
from calib.priors import Prior
from models.response import Forward
from models.sensor import Design, FloatArray, design_from
from models.surrogate import FAMILIES, Surrogate, family_of_design, is_shipped, load_surrogate

#: Standard-normal coordinates by what scatters, each (n_draw,).
Coordinates = Mapping[str, FloatArray]

#: What may scatter beside what the posterior does not know, by the name under which its share of the doubt is told.
PADDING, SENSOR, DIELECTRIC, ELECTRODE = "padding tolerance", "sensor tolerance", "dielectric tolerance", "electrode tolerance"
MODULUS, PERMITTIVITY = "modulus from sensor to sensor", "permittivity from sensor to sensor"
LOAD, BALL, MATERIAL = "load", "ball", "modulus of the padding's material"


@dataclass(frozen=True)
class PaddingChoice:
    """What may be chosen beside the padding's thickness: None for what was measured.

    Attributes
    ----------
    material : of the padding.
    sensor_thickness : [m].
    electrode_radius : [m].
    """

    material: CandidateMaterial | None = None
    sensor_thickness: float | None = None
    electrode_radius: float | None = None

    @property
    def name(self) -> str:
        """What is chosen, in words; "as measured" for nothing."""
        parts = [] if self.material is None else [f"padding of {self.material.name}"]
        if self.sensor_thickness is not None:
            parts.append(f"sensor {self.sensor_thickness * 1e3:.4g} mm")
        if self.electrode_radius is not None:
            parts.append(f"electrode {self.electrode_radius * 1e3:.4g} mm")
        return ", ".join(parts) or "as measured"


def choices_of(specification: Specification) -> list[list[PaddingChoice]]:
    """All combinations of the design variables; those of one list share their mechanics and differ in electrodes alone."""
    materials = (None, *specification.materials)
    thicknesses = specification.sensor_thicknesses or (None,)
    electrodes = specification.electrode_radii or (None,)
    return [[PaddingChoice(m, h, a) for a in electrodes] for m, h in product(materials, thicknesses)]


def coordinates_of(specification: Specification, n_draw: int, rng: np.random.Generator) -> dict[str, FloatArray]:
    """Draw what scatters, each by itself in layers of equal probability (a Latin hypercube), which needs fewer draws.

    Parameters
    ----------
    specification : what scatters.
    n_draw : how many draws.
    rng : they are drawn with.
    """
    s = specification
    scatters = {
        PADDING: s.padding_tolerance is not None,
        SENSOR: s.sensor_tolerance is not None,
        DIELECTRIC: s.dielectric_tolerance is not None,
        ELECTRODE: s.electrode_tolerance is not None,
        MODULUS: s.modulus_spread > 0,
        PERMITTIVITY: s.permittivity_spread > 0,
        LOAD: isinstance(s.force, Prior),
        BALL: isinstance(s.ball, Prior),
        MATERIAL: any(isinstance(m.young_modulus, Prior) for m in s.materials),
    }
    layers = ndtri((np.arange(n_draw) + 0.5) / n_draw)
    return {name: rng.permutation(layers) for name, there in scatters.items() if there}


def balls_of(specification: Specification, base: Design, z: Coordinates) -> list[FloatArray]:
    """Radii [m] of the balls that press, each (n_draw,).

    Parameters
    ----------
    specification : that may name them.
    base : has the ball of the calibration.
    z : where the radius scatters.
    """
    known = np.asarray(base.indenter.radius, dtype=float)
    if specification.ball is None:
        return [known]
    if isinstance(specification.ball, Prior):
        found = specification.ball.ppf_normal(z[BALL])
        return [1 / found if specification.by_curvature else found]
    return [np.full(known.shape, radius) for radius in specification.ball]


def forces_of(specification: Specification, n_draw: int, z: Coordinates) -> FloatArray:
    """Loads [N], (n_draw, n_load).

    Parameters
    ----------
    specification : that names them.
    n_draw : how many draws.
    z : where the load scatters.
    """
    if isinstance(specification.force, Prior):
        return np.asarray(specification.force.ppf_normal(z[LOAD])[:, None])
    return np.broadcast_to(np.array(specification.force), (n_draw, len(specification.force)))


def built(part: ModelDraws, specification: Specification, choice: PaddingChoice, z: Coordinates) -> Design:
    """What would be built of a choice: a design of each draw, with what it scatters by, on the padding of the base.

    The dielectrics of a sensor of another thickness keep their share of it; a tolerance of the sensor's thickness is one of all
    its layers alike. Modulus and permittivity scatter by factors; padding of the sensor's own silicone has its modulus.

    Parameters
    ----------
    part : draws of one model.
    specification : with tolerances and spread.
    choice : of the design variables.
    z : coordinates of these draws, (n_draw,).

    Raises
    ------
    InputError
        If tolerances make what cannot be: a thickness below nothing, dielectrics thicker than the sensor, electrodes wider than
        the disc.
    """
    own = {name: np.asarray(value, dtype=float) for name, value in part.base.draws().parameters().items()}
    share = own["dielectric_thickness"] / own["sensor_thickness"]
    if choice.sensor_thickness is not None:
        own["sensor_thickness"] = np.full(part.size, choice.sensor_thickness)
    if choice.electrode_radius is not None:
        own["electrode_radius"] = np.full(part.size, choice.electrode_radius)
    if specification.sensor_tolerance is not None:
        own["sensor_thickness"] = own["sensor_thickness"] + specification.sensor_tolerance.offset(z[SENSOR])
    own["dielectric_thickness"] = share * own["sensor_thickness"]
    if specification.dielectric_tolerance is not None:
        own["dielectric_thickness"] = own["dielectric_thickness"] + specification.dielectric_tolerance.offset(z[DIELECTRIC])
    if specification.electrode_tolerance is not None:
        own["electrode_radius"] = own["electrode_radius"] + specification.electrode_tolerance.offset(z[ELECTRODE])
    alike = part.member.posterior.experiment.padding_material == "sensor"
    if specification.modulus_spread > 0:
        factor = np.exp(specification.modulus_spread * z[MODULUS])
        own["young_modulus"] = own["young_modulus"] * factor
        if alike:
            own["padding_young_modulus"] = own["padding_young_modulus"] * factor
    if specification.permittivity_spread > 0:
        factor = np.exp(specification.permittivity_spread * z[PERMITTIVITY])
        own["relative_permittivity"] = own["relative_permittivity"] * factor
    if choice.material is not None:
        modulus = choice.material.young_modulus
        own["padding_young_modulus"] = (
            modulus.ppf_normal(z[MATERIAL]) if isinstance(modulus, Prior) else np.full(part.size, modulus)
        )
        own["padding_poisson_ratio"] = np.full(part.size, choice.material.poisson_ratio)
    _require_buildable(own, choice)
    return design_from(own, base=part.base.base)


def _require_buildable(own: Mapping[str, FloatArray], choice: PaddingChoice) -> None:
    """Refuse tolerances that make what cannot be."""
    h_s, t_d, a_e, a = (own[n] for n in ("sensor_thickness", "dielectric_thickness", "electrode_radius", "sensor_radius"))
    slack = 1 + 1e-9
    rules = (
        (h_s > 0, "sensors would be thinner than nothing", "Give a smaller thickness_tolerance"),
        (t_d > 0, "dielectrics would be thinner than nothing", "Give a smaller dielectric_tolerance"),
        (
            t_d <= h_s / 2 * slack,
            "sensors would have dielectrics that are together thicker than the sensor",
            "Where they fill the sensor, thickness_tolerance is that of both: leave dielectric_tolerance out",
        ),
        (a_e > 0, "electrodes would have no radius", "Give a smaller electrode_tolerance"),
        (
            a_e <= a * slack,
            f"electrodes would be wider than the disc ({np.min(a) * 1e3:.4g} mm)",
            "An electrode that covers the disc has no tolerance of its own; give a smaller electrode_radius",
        ),
    )
    faults = []
    for holds, message, advice in rules:
        if not np.all(holds):
            faults.append(Fault(f"{choice.name}: {100 * np.mean(~holds):.0f} % of the {message}", advice=advice))
    if faults:
        raise InputError(faults)


def forward_for(part: ModelDraws, design: Design) -> tuple[Forward, str]:
    """The model that serves what would be built: that of the calibration, or the shipped surrogate of the family that does.

    Parameters
    ----------
    part : draws of one model.
    design : what would be built of it.

    Returns
    -------
    The model, and why none serves the design; "" if one does.
    """
    forward = part.member.forward
    if not isinstance(forward, Surrogate):
        return forward, ""
    why = forward.family.refusal(design)
    if not why:
        return forward, ""
    family = family_of_design(design)
    if family is None:
        return forward, f"no surrogate serves it: the {forward.name} {why}"
    if not is_shipped(family):
        return forward, f"no surrogate of the family {family.name} ({family.words}) comes with the package"
    return load_surrogate(None, FAMILIES[family.name]), ""


#: Quantity that may be pooled -> the field of a specification that would have its spread a second time, and its key in a file.
_POOLED = {
    "young_modulus": ("modulus_spread", "young_modulus in [spread]"),
    "relative_permittivity": ("permittivity_spread", "relative_permittivity in [spread]"),
    "padding_thickness": ("padding_tolerance", "tolerance in [padding]"),
    "sensor_thickness": ("sensor_tolerance", "thickness_tolerance in [sensor]"),
    "dielectric_thickness": ("dielectric_tolerance", "dielectric_tolerance in [sensor]"),
}


def require_spread_once(specification: Specification, pooled: Sequence[str]) -> None:
    """Refuse a spread or a tolerance that the run has inferred already.

    Parameters
    ----------
    specification : that may state one.
    pooled : quantities of which the run has the spread of its lot.

    Raises
    ------
    InputError
        If both have it.
    """
    message = "the run has inferred how the {} of a lot differs, and the specification states it again"
    faults = []
    for quantity in pooled:
        field, key = _POOLED.get(quantity, ("", ""))
        if field and getattr(specification, field):
            faults.append(Fault(message.format(quantity), advice=f"Leave {key} out"))
    if faults:
        raise InputError(faults)

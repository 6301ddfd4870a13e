"""From a design to its dimensionless groups, and the bounds on them within which the shipped surrogates are trained.

The range is what these quantities can make together (all lengths may be scaled by one factor, so only their ratios matter):

    R 1-20 mm,  h_s 0.2-3 mm,  h_p 0-10 mm,  a 3-25 mm but not below R,  E_p/E 0.05-20,  t_d/h_s 0.1-0.5,  a_e/a 0.5-1.

A design is inside if there is a scale that brings its four lengths inside together, which is a bound on each ratio of two of
them (two intervals on a line meet if neither ends before the other begins, and intervals that meet two by two meet all).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from models.sensor import Design, FloatArray
from models.surrogate.families import NEO_HOOKEAN, Family
from models.surrogate.groups import POISSON_RATIO, Values

#: Lengths [mm] whose ratios make the range, and the ranges of the plain ratios.
LENGTHS = MappingProxyType({"R": (1.0, 20.0), "h_s": (0.2, 3.0), "h_p": (0.0, 10.0), "a": (3.0, 25.0)})
MODULUS = (0.05, 20.0)  # E_p / E
DIELECTRIC = (0.1, 0.5)  # t_d / h_s
ELECTRODE = (0.5, 1.0)  # a_e / a

#: A path goes to the depth at which a layer is thinned to 40 % on the axis, and no deeper than half the radius.
COMPRESSION = 0.6
DEPTH = 0.5  # over R
#: Depths of a path: d = end * s^2 at equal steps of s (contact radius grows about linearly in s), as far as it goes.
PATH = np.linspace(0.1, 1.0, 20)

#: The groups that shape the mechanics of any family, in the order of the first columns of an array of groups. Those that a
#: family has of its own follow them, then, where the capacitance is meant, t_d/h_s and a_e/a.
GEOMETRY = ("h_s/R", "h_p/R", "a/R", "E_p/E")
SENSOR, PADDING, DISC, STIFFNESS = range(len(GEOMETRY))
OWN = len(GEOMETRY)  # the first of a family's own
GAP, WIDTH = -2, -1


def group_names(family: Family) -> tuple[str, ...]:
    """Names of the groups that shape the mechanics of a family, in the order of their columns."""
    return (*GEOMETRY, *(group.name for group in family.own))


# Relative rounding that a bound forgives.
_SLACK = 1e-9


@dataclass(frozen=True)
class Bound:
    """A column of the groups, or the ratio of two, that must lie between `low` and `high`."""

    name: str
    low: float
    high: float
    over: int
    under: int | None = None

    def of(self, groups: FloatArray) -> FloatArray:
        """Compute what is bounded (n,) for groups (n, n_group), those of the capacitance included."""
        return groups[:, self.over] if self.under is None else np.asarray(groups[:, self.over] / groups[:, self.under])

    def holds(self, groups: FloatArray) -> npt.NDArray[np.bool_]:
        """Whether each of the designs keeps the bound, (n,)."""
        value = self.of(groups)
        return np.asarray((value >= self.low - _SLACK * abs(self.low)) & (value <= self.high * (1 + _SLACK)))


def _ratio(over: str, under: str, low: float = 0.0) -> Bound:
    (over_low, over_high), (under_low, under_high) = LENGTHS[over], LENGTHS[under]
    column = {"R": None, "h_s": SENSOR, "h_p": PADDING, "a": DISC}
    above = column[over]
    assert above is not None
    return Bound(f"{over}/{under}", max(low, over_low / under_high), over_high / under_low, above, column[under])


#: What a design of any family must keep; the depth it may go to is up to each surrogate.
BOUNDS = (
    _ratio("h_s", "R"),
    _ratio("h_p", "R"),
    _ratio("a", "R", low=1.0),
    Bound("E_p/E", *MODULUS, STIFFNESS),
    _ratio("h_p", "h_s"),
    _ratio("a", "h_s"),
    _ratio("h_p", "a"),
    Bound("t_d/h_s", *DIELECTRIC, GAP),
    Bound("a_e/a", *ELECTRODE, WIDTH),
)


def bounds(family: Family) -> tuple[Bound, ...]:
    """List the bounds that a design of a family must keep to be covered by its surrogates."""
    own = (Bound(group.name, 0.0, group.end, column) for column, group in enumerate(family.own, OWN))
    return (*BOUNDS, *own)


def groups_from(values: Mapping[str, Values], family: Family) -> Values:
    """Compute the dimensionless groups of designs.

    Parameters
    ----------
    values : (n_draw,), of the designs by the names of `models.sensor.PARAMETERS`.
    family : whose groups are wanted.

    Returns
    -------
    Geometry and ratio of moduli, the family's own, t_d/h_s and a_e/a, (n_draw, n_group).
    """
    radius, thickness = values["indenter_radius"], values["sensor_thickness"]
    padding = values["padding_thickness"]
    # Without padding its modulus and its Poisson's ratio mean nothing.
    modulus = np.where(np.real(padding) > 0, values["padding_young_modulus"] / values["young_modulus"], 1.0)
    own = [group.coordinate(values[group.parameter]) for group in family.own]
    if POISSON_RATIO in family.own:
        at = family.own.index(POISSON_RATIO)
        own[at] = np.where(np.real(padding) > 0, own[at], 0.0)
    return np.stack(
        [
            thickness / radius,
            padding / radius,
            values["sensor_radius"] / radius,
            modulus,
            *own,
            values["dielectric_thickness"] / thickness,
            values["electrode_radius"] / values["sensor_radius"],
        ],
        axis=-1,
    )


def groups_of(batch: Design, family: Family = NEO_HOOKEAN) -> FloatArray:
    """Compute the dimensionless groups of a batch of designs, as `groups_from`.

    Parameters
    ----------
    batch : every quantity of shape (n_draw,).
    family : whose groups are wanted; what a design has beyond them is not looked at, see `Family.refusal`.

    Returns
    -------
    Shape (n_draw, n_group).
    """
    values = {k: np.asarray(v, dtype=float) for k, v in batch.parameters().items()}
    return np.asarray(groups_from(values, family), dtype=float)


def inside(groups: FloatArray, family: Family = NEO_HOOKEAN) -> npt.NDArray[np.bool_]:
    """Which designs a surrogate is trained for.

    Parameters
    ----------
    groups : (n, n_group), see `groups_from`.
    family : whose bounds they must keep.

    Returns
    -------
    Whether they keep every bound, (n,).
    """
    return np.asarray(np.all([bound.holds(groups) for bound in bounds(family)], axis=0), dtype=bool)


def violated(groups: FloatArray, family: Family = NEO_HOOKEAN) -> str:
    """Say which bound designs do not keep.

    Parameters
    ----------
    groups : (n, n_group), see `groups_from`.
    family : whose bounds they must keep.

    Returns
    -------
    Empty if all keep every bound, else the first bound that one does not: its name, range and value; of a family's own group
    those of the parameter.
    """
    own = {group.name: group for group in family.own}
    for bound in bounds(family):
        holds = bound.holds(groups)
        if not np.all(holds):
            name, numbers = bound.name, np.array([bound.low, bound.high, bound.of(groups)[~holds][0]])
            if name in own:
                name, numbers = own[name].parameter, own[name].value(numbers)
            low, high, worst = numbers
            return f"{name} from {low:.4g} to {high:.4g}, got {worst:.4g}"
    return ""

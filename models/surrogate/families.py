"""Which physics a surrogate stands for: the families by name, what each has beyond the first, and how it is trained."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from models.sensor import Base, BoolArray, Design
from models.surrogate.groups import BASE_FRICTION, FRICTION, GROUPS, POISSON_RATIO, STIFFENING, Group, Values


@dataclass(frozen=True)
class Recipe:
    """How the surrogate of a family is trained if nothing else is asked for.

    Attributes
    ----------
    points : finite-element paths.
    hidden : layers of the networks of mechanics and of capacitance.
    steps : of their training.
    coarse_points : paths of `coarse_accuracy` beside them: several for the price of one, and several times as far off.
    members : networks of mechanics, and as many of capacitance, whose mean is taken: they err otherwise where paths are few.
    """

    points: int
    hidden: tuple[tuple[int, ...], tuple[int, ...]]
    steps: int
    coarse_points: int = 0
    coarse_accuracy: float = 1e-2
    members: int = 1


@dataclass(frozen=True)
class Family:
    """Designs of one base, one kind of contact and one kind of layers, which one surrogate serves.

    Attributes
    ----------
    name : on the command line and in files.
    words : what its designs are.
    recipe : how it is trained.
    base : that its designs rest on.
    own : groups that its designs have beyond geometry and the ratio of moduli; all others are plain.
    adds_to : name of the family, on the same base, whose surrogate its own adds to; empty for one that stands by itself.
    fade : R d/h_s^2 at which half is left of what it adds, see `coordinates.fade_of_family`; 0 if that does not fade towards
        first touch. No other family adds to one that fades.
    signed : whether the capacitance may fall, so that its change has no logarithm: what the family adds is then a share of the
        change of the family that it adds to. No other family adds to such a one, and it does not fade.
    """

    name: str
    words: str
    recipe: Recipe
    base: Base = "bonded"
    own: tuple[Group, ...] = ()
    adds_to: str = ""
    fade: float = 0.0
    signed: bool = False

    @property
    def signature(self) -> str:
        """What makes its surrogates compute otherwise than the same networks of another family would."""
        ends = {group.parameter: group.end for group in self.own}
        first = f"{ends.pop(STIFFENING.parameter, 0.0)!r} False "  # a ball that sticks had a family of its own once
        others = [*([self.base] if self.base != "bonded" else []), *(f"{name} {end!r}" for name, end in ends.items())]
        shaped = [*([f"fade {self.fade!r}"] if self.fade else []), *(["signed"] if self.signed else [])]
        return first + "".join(f"{word} " for word in [*others, *shaped])

    def serves(self, design: Design) -> BoolArray:
        """Which draws of a batch have nothing that the family has not, (n_draw,); see `refusal`."""
        known = np.full(np.shape(design.sensor.thickness), design.base == self.base)
        for group in GROUPS:
            if group not in self.own:
                known = known & (_values(design, group) == group.plain)
        return known

    def refusal(self, design: Design) -> str:
        """Say what a batch of designs has that the family has not; empty if there is nothing."""
        if design.base != self.base:
            return f'is trained for layers on a {self.base} base; base must be "{self.base}", got "{design.base}"'
        for group in GROUPS:
            values = _values(design, group)
            if group not in self.own and np.any(values != group.plain):
                other = float(np.atleast_1d(values)[np.atleast_1d(values != group.plain)][0])
                return f"is trained for {group.plain_words}; {group.parameter} must be {group.plain:g}, got {other:.4g}"
        return ""


def _values(design: Design, group: Group) -> Values:
    """Values of the group's parameter; where there is no padding, its Poisson's ratio means nothing."""
    values = np.asarray(design.parameters()[group.parameter], dtype=float)
    return np.where(design.padding_is_compressible, values, group.plain) if group is POISSON_RATIO else values


_LARGE = ((128, 128, 128), (160, 160, 160))
_SMALL = ((64, 64, 64), (64, 64, 64))
_AVERAGED = ((64, 64, 64), (96, 96, 96))

# R d/h_s^2, the square of contact radius over the sensor's thickness, at which friction has half of its effect: the best of
# those tried (`docs/surrogate.md`).
_FRICTION_FADE = 3.0

NEO_HOOKEAN = Family(
    "neo-hookean", "neo-Hookean sensor on padding, bonded base, frictionless sphere", Recipe(8192, _LARGE, 120_000)
)
#: Families with surrogates of their own, by name.
FAMILIES = MappingProxyType(
    {
        family.name: family
        for family in (
            NEO_HOOKEAN,
            Family(
                "gent",
                "Gent sensor on padding of the same J_m, bonded base, frictionless sphere",
                Recipe(5600, _SMALL, 120_000),
                own=(STIFFENING,),
                adds_to="neo-hookean",
            ),
            Family(
                "slippery",
                "neo-Hookean sensor on padding, slippery base, frictionless sphere",
                Recipe(5632, _LARGE, 60_000),
                base="slippery",
            ),
            Family(
                "friction",
                "neo-Hookean sensor on padding, bonded base, sphere with Coulomb friction from none to stick",
                Recipe(5383, _AVERAGED, 24_000, members=3),
                own=(FRICTION,),
                adds_to="neo-hookean",
                fade=_FRICTION_FADE,
            ),
            Family(
                "slippery-friction",
                "neo-Hookean sensor on padding, slippery base, sphere with Coulomb friction from none to stick",
                Recipe(5383, _AVERAGED, 24_000, members=3),
                base="slippery",
                own=(FRICTION,),
                adds_to="slippery",
                fade=_FRICTION_FADE,
            ),
            Family(
                "rubbing-base",
                "neo-Hookean sensor on padding, slippery base with Coulomb friction up to 1, frictionless sphere",
                Recipe(5334, _AVERAGED, 20_000, members=3),
                base="slippery",
                own=(BASE_FRICTION,),
                adds_to="slippery",
            ),
            Family(
                "foam",
                "neo-Hookean sensor on compressible neo-Hookean padding, bonded base, frictionless sphere",
                Recipe(4096, _AVERAGED, 30_000, members=3),
                own=(POISSON_RATIO,),
                adds_to="neo-hookean",
                signed=True,
            ),
        )
    }
)


def family_of(unknowns: Collection[str] = (), *, base: Base = "bonded") -> Family | None:
    """The family that serves designs on a base in which some parameters are not plain.

    Parameters
    ----------
    unknowns : names of the parameters of `GROUPS` that may be other than plain: "stiffening", "friction_coefficient" (a ball
        that sticks is the end of it), ...
    base : that they rest on.

    Returns
    -------
    The family; None if there is none for this combination.
    """
    for family in FAMILIES.values():
        if {group.parameter for group in family.own} == set(unknowns) and family.base == base:
            return family
    return None


def family_of_design(design: Design) -> Family | None:
    """The family that serves a design; None if there is none."""
    unknowns = {group.parameter for group in GROUPS if np.any(_values(design, group) != group.plain)}
    return family_of(unknowns, base=design.base)

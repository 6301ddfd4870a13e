"""Which physics a surrogate stands for: the families, by name, and the one that a law and a kind of contact belong to."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Family:
    """Designs of one material law and one kind of contact, which one surrogate serves.

    Attributes
    ----------
    stiffening : largest 1/J_m of Gent's law in sensor and padding; 0 for neo-Hookean layers alone.
    stick : whether the sensor sticks to the ball, or slides on it without friction.
    """

    name: str
    words: str
    stiffening: float = 0.0
    stick: bool = False

    @property
    def friction_coefficient(self) -> float:
        """Friction [1] between ball and sensor, infinite where they stick, as in `models.sensor.Indenter`."""
        return float("inf") if self.stick else 0.0


NEO_HOOKEAN = Family("neo-hookean", "neo-Hookean sensor on padding, bonded base, frictionless sphere")
#: Families with surrogates of their own, by name. Silicones have a J_m of 10 and more.
FAMILIES = MappingProxyType(
    {
        family.name: family
        for family in (
            NEO_HOOKEAN,
            Family("gent", "Gent sensor on padding of the same J_m, bonded base, frictionless sphere", stiffening=0.1),
            Family("stick", "neo-Hookean sensor on padding, bonded base, sphere that sticks", stick=True),
        )
    }
)


def family_of(*, stiffening: bool, stick: bool) -> Family | None:
    """The family that a law and a kind of contact belong to.

    Parameters
    ----------
    stiffening : whether the layers stiffen as Gent's law has it.
    stick : whether the ball sticks to the sensor.

    Returns
    -------
    The family; None if no surrogate serves such designs.
    """
    found = [f for f in FAMILIES.values() if (f.stiffening > 0) == stiffening and f.stick == stick]
    return found[0] if found else None

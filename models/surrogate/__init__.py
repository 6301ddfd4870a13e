"""A design and depths in, a `Response` with its own error out in microseconds, and how that is learnt; knows no measurement."""

from models.surrogate.families import FAMILIES, NEO_HOOKEAN, Family, family_of
from models.surrogate.surrogate import Surrogate, load_surrogate

__all__ = ["FAMILIES", "NEO_HOOKEAN", "Family", "Surrogate", "family_of", "load_surrogate"]

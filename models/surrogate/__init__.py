"""A design and depths in, a `Response` with its own error out, in microseconds; and how such networks are made."""

from models.surrogate.domain import FAMILIES, NEO_HOOKEAN, Family, family_of
from models.surrogate.surrogate import Surrogate, load_surrogate

__all__ = ["FAMILIES", "NEO_HOOKEAN", "Family", "Surrogate", "family_of", "load_surrogate"]

"""A design and depths in, a `Response` with its own error out in microseconds, and how that is learnt; knows no measurement."""

from models.surrogate.families import FAMILIES, NEO_HOOKEAN, Family, family_of, family_of_design
from models.surrogate.surrogate import NotShippedError, Surrogate, is_shipped, load_surrogate, shipped_in_words

__all__ = [
    "FAMILIES",
    "NEO_HOOKEAN",
    "Family",
    "NotShippedError",
    "Surrogate",
    "family_of",
    "family_of_design",
    "is_shipped",
    "load_surrogate",
    "shipped_in_words",
]

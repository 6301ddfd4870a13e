"""A `Problem` in, what speaks against its files and priors before anything is sampled out, and what its data will tell."""

from calib.checks.plausibility.outlook import Outlook, Ridge, Told
from calib.checks.plausibility.plausibility import FILES, Plausibility, expected_in_words, in_units, plausibility, ways_out
from calib.checks.plausibility.ranges import Range
from calib.checks.plausibility.slips import scaled

__all__ = [
    "FILES",
    "Outlook",
    "Plausibility",
    "Range",
    "Ridge",
    "Told",
    "expected_in_words",
    "in_units",
    "plausibility",
    "scaled",
    "ways_out",
]

"""A `Problem` in, what speaks against its files and priors before anything is sampled out, and what its data will tell."""

from calib.checks.plausible.judgement import (
    FILES,
    Plausibility,
    expected_in_words,
    in_units,
    measured_in_words,
    plausibility,
    ways_out,
)
from calib.checks.plausible.outlook import Outlook, Ridge, UnknownOutlook
from calib.checks.plausible.ranges import Range
from calib.checks.plausible.slips import scaled

__all__ = [
    "FILES",
    "Outlook",
    "Plausibility",
    "Range",
    "Ridge",
    "UnknownOutlook",
    "expected_in_words",
    "in_units",
    "measured_in_words",
    "plausibility",
    "scaled",
    "ways_out",
]

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
from calib.checks.plausible.outlook import TARE, Outlook, Ridge, Tare, UnknownOutlook, tare_from_text, tare_to_text
from calib.checks.plausible.ranges import Range
from calib.checks.plausible.slips import scaled
from calib.checks.plausible.unmodelled import drift_by_share

__all__ = [
    "FILES",
    "TARE",
    "Outlook",
    "Plausibility",
    "Range",
    "Ridge",
    "Tare",
    "UnknownOutlook",
    "drift_by_share",
    "expected_in_words",
    "in_units",
    "measured_in_words",
    "plausibility",
    "scaled",
    "tare_from_text",
    "tare_to_text",
    "ways_out",
]

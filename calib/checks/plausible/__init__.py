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
from calib.checks.plausible.unmodelled import drift_by_share, drift_of_meter
from calib.checks.plausible.unseen import UNSEEN, Unseen, unseen_from_text, unseen_to_text

__all__ = [
    "FILES",
    "UNSEEN",
    "Outlook",
    "Plausibility",
    "Range",
    "Ridge",
    "UnknownOutlook",
    "Unseen",
    "drift_by_share",
    "drift_of_meter",
    "expected_in_words",
    "in_units",
    "measured_in_words",
    "plausibility",
    "scaled",
    "unseen_from_text",
    "unseen_to_text",
    "ways_out",
]

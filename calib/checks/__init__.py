"""A `Posterior` in, whether it may be believed out: predictive, spot check, re-weighting, comparison; changes no draw."""

from calib.checks.comparison import Candidate, compare_runs, comparison_in_words, doubts
from calib.checks.departures import Elsewhere, look_elsewhere, with_departures, with_elsewhere
from calib.checks.plausibility import (
    FILES,
    Outlook,
    Plausibility,
    Range,
    Ridge,
    Told,
    expected_in_words,
    in_units,
    plausibility,
    scaled,
    ways_out,
)
from calib.checks.predictive import BAND_LEVELS, Bands, FitCheck, Prediction, band, predict
from calib.checks.reasons import RULED_OUT, conflict_limit, departure_in_words, judge_posterior, passed_gates
from calib.checks.refine import error_rows, refinement_in_words, require_own_surrogate, shift_rows, stands, training_points
from calib.checks.reweighting import ACCURACY, LEAST_DRAWS, reweight, with_reweighting
from calib.checks.spotcheck import Comparison, compare_draws, with_spot_check
from calib.checks.verdict import Colour, Level, Reason, Verdict, verdict_from_plain, verdict_of

__all__ = [
    "ACCURACY",
    "BAND_LEVELS",
    "FILES",
    "LEAST_DRAWS",
    "RULED_OUT",
    "Bands",
    "Candidate",
    "Colour",
    "Comparison",
    "Elsewhere",
    "FitCheck",
    "Level",
    "Outlook",
    "Plausibility",
    "Prediction",
    "Range",
    "Reason",
    "Ridge",
    "Told",
    "Verdict",
    "band",
    "compare_draws",
    "compare_runs",
    "comparison_in_words",
    "conflict_limit",
    "departure_in_words",
    "doubts",
    "error_rows",
    "expected_in_words",
    "in_units",
    "judge_posterior",
    "look_elsewhere",
    "passed_gates",
    "plausibility",
    "predict",
    "refinement_in_words",
    "require_own_surrogate",
    "reweight",
    "scaled",
    "shift_rows",
    "stands",
    "training_points",
    "verdict_from_plain",
    "verdict_of",
    "ways_out",
    "with_departures",
    "with_elsewhere",
    "with_reweighting",
    "with_spot_check",
]

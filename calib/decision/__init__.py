"""A `Posterior` and what is wanted of it in, what to build, or what a reading on a gripper means, out; knows no page."""

from calib.decision.as_built import AsBuilt
from calib.decision.batch import DRIFTING, Batch, conditions_of_next, expected_of
from calib.decision.causes import Cause
from calib.decision.conditions import open_models_of
from calib.decision.conformity import Built, Conformity, Needed
from calib.decision.extrapolation import force_exceeded, largest_force, largest_in_words, measured_presses
from calib.decision.force_table import (
    N_ROW,
    ForceReading,
    ForceTable,
    GripperTables,
    Status,
    WorkingPoint,
)
from calib.decision.gripper import LEVEL, WIDTH_IN_SD, Gripper
from calib.decision.guard_band import Drawing, Risks
from calib.decision.inspection import (
    Inspected,
    Inspection,
    Presented,
    counted_already,
    held_by_another,
    inspect,
    inspected_from_plain,
    inspected_to_plain,
    presented,
    without_copies,
)
from calib.decision.inverse import invert
from calib.decision.measurements import next_measurements
from calib.decision.padding import recommend
from calib.decision.ranking import (
    Deciding,
    Measurement,
    NextInShort,
    NextMeasurements,
    ShortMeasurement,
    next_from_json,
    next_to_json,
    percent_of_few,
    shortfall_in_words,
)
from calib.decision.recommendation import INTERVAL_PROBABILITY, OfModel, Recommendation
from calib.decision.record import recommendation_from_json, recommendation_to_json
from calib.decision.release import Decided
from calib.decision.requirement import Requirement
from calib.decision.retreat import RetreatBand, Retreats
from calib.decision.specified import conform, recommend_for
from calib.decision.trend import Trend
from calib.decision.views import LIMITED_HERE, PLACE, Landscape, View, landscape
from calib.decision.words import percent, spans_in_words, void_in_words

__all__ = [
    "DRIFTING",
    "INTERVAL_PROBABILITY",
    "LEVEL",
    "LIMITED_HERE",
    "N_ROW",
    "PLACE",
    "WIDTH_IN_SD",
    "AsBuilt",
    "Batch",
    "Built",
    "Cause",
    "Conformity",
    "Decided",
    "Deciding",
    "Drawing",
    "ForceReading",
    "ForceTable",
    "Gripper",
    "GripperTables",
    "Inspected",
    "Inspection",
    "Landscape",
    "Measurement",
    "Needed",
    "NextInShort",
    "NextMeasurements",
    "OfModel",
    "Presented",
    "Recommendation",
    "Requirement",
    "RetreatBand",
    "Retreats",
    "Risks",
    "ShortMeasurement",
    "Status",
    "Trend",
    "View",
    "WorkingPoint",
    "conditions_of_next",
    "conform",
    "counted_already",
    "expected_of",
    "force_exceeded",
    "held_by_another",
    "inspect",
    "inspected_from_plain",
    "inspected_to_plain",
    "invert",
    "landscape",
    "largest_force",
    "largest_in_words",
    "measured_presses",
    "next_from_json",
    "next_measurements",
    "next_to_json",
    "open_models_of",
    "percent",
    "percent_of_few",
    "presented",
    "recommend",
    "recommend_for",
    "recommendation_from_json",
    "recommendation_to_json",
    "shortfall_in_words",
    "spans_in_words",
    "void_in_words",
    "without_copies",
]

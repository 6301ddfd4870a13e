"""A `Posterior` and what is wanted of it in, what to build, or what a reading on a gripper means, out; knows no page."""

from calib.decision.causes import Cause
from calib.decision.conformity import Built, Conformity, Needed
from calib.decision.extrapolation import largest_force
from calib.decision.force_table import (
    LEVEL,
    N_ROW,
    WIDTH_IN_SD,
    ForceReading,
    ForceTable,
    GripperTables,
    Status,
    WorkingPoint,
)
from calib.decision.gripper import Gripper
from calib.decision.guard_band import Drawing
from calib.decision.inverse import invert
from calib.decision.measurements import Measurement, NextMeasurements, next_measurements, next_to_json
from calib.decision.padding import recommend
from calib.decision.recommendation import INTERVAL_PROBABILITY, OfModel, Recommendation
from calib.decision.record import recommendation_from_json, recommendation_to_json
from calib.decision.requirement import Requirement
from calib.decision.specified import conform, recommend_for
from calib.decision.views import LIMITED_HERE, Landscape, View, landscape
from calib.decision.words import percent

__all__ = [
    "INTERVAL_PROBABILITY",
    "LEVEL",
    "LIMITED_HERE",
    "N_ROW",
    "WIDTH_IN_SD",
    "Built",
    "Cause",
    "Conformity",
    "Drawing",
    "ForceReading",
    "ForceTable",
    "Gripper",
    "GripperTables",
    "Landscape",
    "Measurement",
    "Needed",
    "NextMeasurements",
    "OfModel",
    "Recommendation",
    "Requirement",
    "Status",
    "View",
    "WorkingPoint",
    "conform",
    "invert",
    "landscape",
    "largest_force",
    "next_measurements",
    "next_to_json",
    "percent",
    "recommend",
    "recommend_for",
    "recommendation_from_json",
    "recommendation_to_json",
]

"""A `Posterior` and what is wanted in, a `Recommendation` of what to build and how sure that is out; knows no page."""

from calib.decision.causes import Cause
from calib.decision.conformity import Built, Conformity, Needed
from calib.decision.guard_band import Drawing
from calib.decision.padding import recommend
from calib.decision.recommendation import INTERVAL_PROBABILITY, OfModel, Recommendation
from calib.decision.record import recommendation_from_json, recommendation_to_json
from calib.decision.requirement import Requirement
from calib.decision.specified import conform, recommend_for
from calib.decision.words import percent

__all__ = [
    "INTERVAL_PROBABILITY",
    "Built",
    "Cause",
    "Conformity",
    "Drawing",
    "Needed",
    "OfModel",
    "Recommendation",
    "Requirement",
    "conform",
    "percent",
    "recommend",
    "recommend_for",
    "recommendation_from_json",
    "recommendation_to_json",
]

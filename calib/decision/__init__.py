"""A `Posterior` and a `Requirement` in, a `Recommendation` of what to build and how sure that is out; knows no page."""

from calib.decision.padding import recommend
from calib.decision.recommendation import INTERVAL_PROBABILITY, OfModel, Recommendation, percent
from calib.decision.record import recommendation_from_json, recommendation_to_json
from calib.decision.requirement import Requirement

__all__ = [
    "INTERVAL_PROBABILITY",
    "OfModel",
    "Recommendation",
    "Requirement",
    "percent",
    "recommend",
    "recommendation_from_json",
    "recommendation_to_json",
]

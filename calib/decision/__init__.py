"""A `Posterior` and a requirement in, what to build out, and how sure that is; knows no page."""

from calib.decision.padding import (
    INTERVAL_PROBABILITY,
    Recommendation,
    Requirement,
    percent,
    recommend,
    recommendation_from_json,
    recommendation_to_json,
)

__all__ = [
    "INTERVAL_PROBABILITY",
    "Recommendation",
    "Requirement",
    "percent",
    "recommend",
    "recommendation_from_json",
    "recommendation_to_json",
]

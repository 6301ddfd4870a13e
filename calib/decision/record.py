"""From a recommendation to the text of recommendation.json, and back."""

from __future__ import annotations

from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from calib.checks import BAND_LEVELS
from calib.decision.recommendation import Recommendation
from calib.decision.requirement import Requirement
from calib.errors import Fault, InputError
from calib.records import record_from_text, record_to_text

#: Layout version of recommendation.json.
FORMAT = 1
_KIND = "recommendation"

_ARRAYS = (
    *("thickness", "coverage", "change", "depth", "resolution", "probability", "optimum"),
    *("change_at_best", "depth_at_best", "resolution_at_best", "present_change", "gain"),
)


def recommendation_to_json(recommendation: Recommendation) -> str:
    """Write a recommendation for other programs: SI, nan as null, with the verdict in words."""
    r = recommendation
    content: dict[str, Any] = {
        "verdict": r.verdict,
        "sureness": r.sureness,
        "band_levels": BAND_LEVELS,
        "requirement": asdict(r.requirement),
    }
    content |= {f.name: getattr(r, f.name) for f in fields(r) if f.name != "requirement"}
    return record_to_text(_KIND, FORMAT, content)


def recommendation_from_json(text: str, path: Path | None = None) -> Recommendation:
    """Read the recommendation that `recommendation_to_json` wrote.

    Parameters
    ----------
    text : of the file.
    path : of the file, to be named if it is refused.

    Raises
    ------
    InputError
        If the text is not a recommendation of this format.
    """
    try:
        record = record_from_text(_KIND, FORMAT, text)
        read: dict[str, Any] = {f.name: record[f.name] for f in fields(Recommendation)}
        for name in _ARRAYS:
            read[name] = np.asarray(read[name], dtype=float)
        read["covered"] = np.asarray(read["covered"], dtype=bool)
        read["requirement"] = Requirement(**read["requirement"])
        read["interval"] = None if read["interval"] is None else tuple(read["interval"])
        read["conditions"], read["reasons"] = tuple(read["conditions"]), tuple(read["reasons"])
        return Recommendation(**read)
    except (ValueError, KeyError, TypeError) as error:
        if isinstance(error, InputError):
            raise
        advice = "Delete it and run `calib recommend` again."
        raise InputError(Fault(f"not a recommendation this version can read ({error})", path=path, advice=advice)) from None

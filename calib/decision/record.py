"""From a recommendation to the text of recommendation.json, and back."""

from __future__ import annotations

import math
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from calib.checks import BAND_LEVELS, verdict_from_plain
from calib.decision.conformity import conformity_from_plain
from calib.decision.recommendation import OfModel, Recommendation
from calib.decision.requirement import Requirement
from calib.errors import Fault, InputError
from calib.records import exact_record_from_text, record_to_text

#: Layout version of recommendation.json.
FORMAT = 6
_KIND = "recommendation"

_ADVICE = "Delete it, or run `calib recommend` again"

_ARRAYS = (
    *("thickness", "coverage", "change", "depth", "resolution", "probability", "optimum"),
    *("change_at_best", "depth_at_best", "resolution_at_best", "present_change", "gain"),
)


def recommendation_to_json(recommendation: Recommendation, fingerprint: str = "") -> str:
    """Write a recommendation for other programs: SI, nan as null, and in words.

    Parameters
    ----------
    recommendation : to be written.
    fingerprint : of the run that it is of; empty if it is of none.
    """
    r = recommendation
    content: dict[str, Any] = {
        "fingerprint": fingerprint,
        "verdict": r.verdict.to_plain(),
        "said": r.in_words,
        "sureness": r.sureness,
        "share_of_the_choice_of_model": r.share_of_choice,
        "band_levels": BAND_LEVELS,
        "requirement": asdict(r.requirement),
    }
    content |= {f.name: getattr(r, f.name) for f in fields(r) if f.name not in ("requirement", "verdict", "conformity")}
    content["of_models"] = [asdict(model) for model in r.of_models]
    if r.conformity is not None:
        content["conformity"] = r.conformity.to_plain()
    return record_to_text(_KIND, FORMAT, content)


def recommendation_from_json(text: str, path: Path | None = None, fingerprint: str | None = None) -> Recommendation:
    """Read the recommendation that `recommendation_to_json` wrote.

    Parameters
    ----------
    text : of the file.
    path : of the file, to be named if it is refused.
    fingerprint : of the run that it must be of; None for any.

    Raises
    ------
    InputError
        If the text is not, to the last byte, a recommendation that was written in this format, or is of another run.
    """
    try:
        record = exact_record_from_text(_KIND, FORMAT, text)
        if fingerprint is not None and record["fingerprint"] != fingerprint:
            raise InputError(Fault("this recommendation is of another run", path, advice=_ADVICE))
        read: dict[str, Any] = {f.name: record[f.name] for f in fields(Recommendation) if f.name != "conformity"}
        if "conformity" in record:
            read["conformity"] = conformity_from_plain(record["conformity"])
        for name in _ARRAYS:
            read[name] = np.asarray(read[name], dtype=float)
        read["covered"] = np.asarray(read["covered"], dtype=bool)
        read["requirement"] = Requirement(**read["requirement"])
        read["interval"] = None if read["interval"] is None else tuple(read["interval"])
        read["conditions"], read["open_models"] = tuple(read["conditions"]), tuple(read["open_models"])
        read["of_models"] = tuple(
            OfModel(
                **{
                    **m,
                    "best": _number(m["best"]),
                    **{name: tuple(map(_number, m[name])) for name in ("change", "young_modulus")},
                }
            )
            for m in read["of_models"]
        )
        read["verdict"] = verdict_from_plain(read["verdict"])
        return Recommendation(**read)
    except (ValueError, KeyError, TypeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(Fault(f"not a recommendation this version can read ({error})", path, advice=_ADVICE)) from None


def _number(value: float | None) -> float:
    return math.nan if value is None else value

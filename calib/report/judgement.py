"""A posterior and its predictions in, whether its numbers may be used out: the same in the page as on the screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from calib.checks import Prediction
from calib.lab import quality_in_words
from calib.sampling import Posterior


@dataclass(frozen=True)
class Judgement:
    """Whether the numbers of a calibration may be used, and what speaks against it.

    Attributes
    ----------
    good : whether nothing does: what is shown in green.
    status : that in a sentence.
    misfits : channels that the model does not describe, "the force of sensor 1".
    bad_data : what the checks of the lab files say if one of them is bad, in a sentence; else "".
    """

    good: bool
    status: str
    misfits: tuple[str, ...]
    bad_data: str


def judge_run(posterior: Posterior, predictions: Sequence[Prediction]) -> Judgement:
    """Judge a calibration by its chains, its forward model, what it predicts, and the files it was made from.

    Parameters
    ----------
    posterior : the result.
    predictions : of its sweeps.
    """
    grades = [v for s in posterior.sweeps for v in s.grades]
    bad_data = quality_in_words(grades) if any(v.level == "bad" for v in grades) else ""
    misfits = tuple(
        f"the {kind} of {p.title}" for p in predictions for kind, channel in p.channels.items() if not channel.check.passed
    )
    good = posterior.diagnostics.usable and not misfits and not bad_data
    return Judgement(good, _status(posterior, bool(misfits), bool(bad_data)), misfits, bad_data)


def _status(posterior: Posterior, misfits: bool, bad_data: bool) -> str:
    d = posterior.diagnostics
    if not d.converged:
        return "Not converged: the numbers below are preliminary. Do not build on them."
    if not d.usable:
        return (
            f"Converged, but the {posterior.forward_name} is off the finite elements by more than it states: the numbers below "
            "are preliminary. Do not build on them."
        )
    if misfits:
        return "Converged, but the model does not describe all data. Look at the residuals before using the numbers."
    if bad_data:
        return "Converged, but the lab data are bad. Look at their quality before using the numbers."
    return "Converged: the numbers below can be used."


def listed(words: Sequence[str]) -> str:
    """Words as a part of a sentence: all of them, or the first three and how many more there are."""
    if len(words) > 4:
        words = [*words[:3], f"{len(words) - 3} more"]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]

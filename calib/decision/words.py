"""Probabilities, thicknesses and whose sensor an answer is for in, the words for people that all answers share out."""

from __future__ import annotations

import numpy as np

from calib.checks import Verdict
from calib.digits import span_text
from models.sensor import BoolArray, FloatArray

#: Where a specification has how pads are made.
TOLERANCE_KEY = "tolerance in [padding]"

#: Gate of what goes beyond the data, and how an advice begins that does.
EXTRAPOLATION = "extrapolation"
PROVISO = "If the model holds beyond what was measured, "


def sensor_in_words(*, of_next: bool, spread: bool = False) -> str:
    """Whose sensor an answer is for, in a sentence.

    Parameters
    ----------
    of_next : whether for one of a lot that has not been measured, as partial pooling tells of it.
    spread : whether for another one, whose modulus differs by a spread that was stated.
    """
    if of_next:
        return (
            "It is for the next sensor of this lot, which nobody has measured: its modulus, permittivity and thicknesses "
            "may differ from those measured as the spreads of the lot say, and its padding from what was wanted."
        )
    if spread:
        return "It is for another sensor like those measured, whose modulus differs from theirs by the spread that was stated."
    return (
        "It is for the measured sensors, on new padding: another one of their lot may differ in modulus and thicknesses, "
        'which is not in the intervals (pooling = "partial" has it).'
    )


def void_in_words(verdict: Verdict) -> str:
    """What is said in the place of an advice that must not be used: why, and no number that one might take for it.

    Parameters
    ----------
    verdict : on it, which is red.
    """
    return (
        f"Do not build on this: {verdict.reasons[0].finding}. No padding is recommended: a calibration that must not be used "
        "has no results. Settle what is red first, then ask again."
    )


def percent(probability: float) -> str:
    """Write a probability for people, never as "100 %" or "0 %": a finite number of draws does not show that."""
    if probability > 0.99:
        return "more than 99 %"
    return "less than 1 %" if probability < 0.01 else f"{probability * 100:.0f} %"


def about(probability: float, error: float) -> str:
    """Write a probability with its Monte Carlo error for people, such as "95 % (± 0.7 %)".

    Parameters
    ----------
    probability, error : [1].
    """
    return f"{percent(probability)} (± {100 * error:.1g} %)" if error >= 0.0005 else percent(probability)


def spans_in_words(thickness: FloatArray, chosen: BoolArray) -> str:
    """Thicknesses of a grid in words: from where to where, as often as they begin anew.

    Parameters
    ----------
    thickness : [m], (n,), ascending.
    chosen : (n,), those that are meant; one or more.

    >>> spans_in_words(np.array([0, 1e-3, 2e-3, 3e-3]), np.array([True, False, True, True]))
    '0 mm and 2 to 3 mm'
    """
    turns = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int))).reshape(-1, 2)
    ends = [(float(thickness[first]) * 1e3, float(thickness[last - 1]) * 1e3) for first, last in turns]
    return " and ".join(f"{span_text(a)} mm" if a == b else f"{span_text(a, b)} mm" for a, b in ends)

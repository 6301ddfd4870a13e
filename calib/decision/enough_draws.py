"""A probability by draws and the one asked for in, whether the draws tell which is larger, and how many would, out."""

from __future__ import annotations

import math

import numpy as np

from models.sensor import FloatArray

# Standard errors by which probabilities differ that draws tell apart.
_APART = 2.0
# By how many more draws it is asked again than would just tell, and of how many more than there are a calibration may be asked.
_ROOM, _MORE = 1.2, 20.0
# It is not asked again with fewer: what few draws found may be far off.
_FEW = 1000


def monte_carlo_error(probability: FloatArray | float, n: float) -> FloatArray:
    """Standard error [1] of a share of independent draws, Agresti and Coull's: not zero where all draws agree.

    Parameters
    ----------
    probability : [1], the share, any shape.
    n : how many independent draws.
    """
    p = (np.asarray(probability) * n + 2) / (n + 4)
    return np.asarray(np.sqrt(p * (1 - p) / (n + 4)))


def left_open(probability: float, asked: float, error: float) -> bool:
    """Whether draws leave open on which side of what is asked for a probability lies.

    Parameters
    ----------
    probability, asked : [1].
    error : its Monte Carlo standard error [1].
    """
    return abs(probability - asked) < _APART * error


def draws_that_tell(probability: float, asked: float) -> float:
    """How many independent draws would tell them apart, if the probability is what it was found to be; infinite if none would.

    Parameters
    ----------
    probability, asked : [1].

    Examples
    --------
    >>> draws_that_tell(1.0, 0.95) < 60 < 1e6 < draws_that_tell(1.0, 0.999999) < 1e7, draws_that_tell(0.95, 0.95)
    (True, inf)
    """
    if probability == asked:
        return math.inf
    n = 1.0
    while left_open(probability, asked, float(monte_carlo_error(probability, n))):
        n *= 1.05
    return n


def most_that_is_told(n: float) -> float:
    """The largest probability [1] of which so many independent draws can show that it is reached.

    Parameters
    ----------
    n : how many.
    """
    return 1 - _APART * float(monte_carlo_error(1.0, n))


def most_in_percent(n: float) -> float:
    """`most_that_is_told` in per cent, rounded down to the hundredth that is shown.

    Parameters
    ----------
    n : how many independent draws.
    """
    return math.floor(1e4 * most_that_is_told(n)) / 100


def left_open_in_words(found: str, asked: float) -> str:
    """What draws leave open, behind their number.

    Parameters
    ----------
    found : the probability of conforming, with its error, in words.
    asked : [1].
    """
    return f"leave open on which side of {100 * asked:g} % the probability of conforming is, {found}"


def what_would_tell(probability: float, asked: float, most: float) -> str:
    """What to do where draws leave it open, in words.

    Parameters
    ----------
    probability, asked : [1].
    most : how many independent draws all of the posterior are worth.
    """
    if asked > most_that_is_told(most):
        return (
            f"All draws of this run, worth {most:.0f} independent ones, can tell {most_in_percent(most):g} % at most: ask for "
            "no more than that, or calibrate with more draws"
        )
    wanted = max(_ROOM * draws_that_tell(probability, asked), min(_FEW, most))
    if wanted <= most:
        return f"Ask calib recommend again with --draws {_rounded_up(wanted)}"
    if wanted <= _MORE * most:
        worth = _rounded_up(wanted)
        return f"Calibrate with more draws, worth some {worth} independent ones (now {most:.0f}), and give as many to --draws"
    return "Give what binds more room, or ask for a lower probability: draws do not tell what is so near"


def _rounded_up(n: float) -> int:
    """A number with two digits that is not less."""
    step: float = 10 ** max(0, math.floor(math.log10(n)) - 1)
    return int(math.ceil(n / step) * step)

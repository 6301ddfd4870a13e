"""A posterior's mean and standard deviation of an unknown in, the ends of its prior that cut it out.

A prior that ends, as a uniform one does, is hardly surprised by a posterior that leans on its end: the standard-normal
coordinate of the mean grows with the logarithm of how near it is. The posterior is then as narrow as the end makes it, and what
hangs on it is as sure, and as wrong.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from calib.catalogue import bounds_of, display
from calib.checks.verdict import Reason
from calib.problem import ParameterInfo
from models.sensor import INCOMPRESSIBLE

#: A mean less than this many standard deviations from an end is that of a posterior that is cut near its mode, or before: a
#: normal one that is cut at its mode has 1.32, an exponential one that falls from the end 1.
LEANS = 1.4
# Below these there is nothing that the model without this unknown, which is asked beside, does not say as well.
_SMALLEST = {"friction_coefficient": 0.05, "base_friction_coefficient": 0.05}
# Largest values that there are; the smallest, of what cannot be negative, is zero.
_LARGEST = {"padding_poisson_ratio": INCOMPRESSIBLE}


def ends_that_cut(parameter: ParameterInfo, mean: float, sd: float) -> Iterator[Reason]:
    """Say which end of its prior an unknown leans on, unless there is nothing beyond it.

    Parameters
    ----------
    parameter : an unknown that the data tell something of.
    mean, sd : of its posterior, SI.
    """
    name = parameter.parameter
    low, high = parameter.prior.support
    least = -math.inf if bounds_of(name) == "any" else _SMALLEST.get(name, 0.0)
    ends = [*([(low, "least")] if low > least else []), *([(high, "most")] if high < _LARGEST.get(name, math.inf) else [])]
    for end, word in ends:
        if abs(mean - end) < LEANS * sd:
            about, allowed = display(name, float(f"{mean:.3g}")), f"at {word} {display(name, end)} allowed"
            finding = f"the data put {parameter.name} at the end of its prior: about {about}, {allowed}"
            advice = f"Look why {parameter.name} should not lie beyond, and else give it a prior that goes on there"
            yield Reason("prior", "amber", f"{finding}, which cuts it and what hangs on it", advice)

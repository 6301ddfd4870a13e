"""An experiment whose specimens are of one lot in, what is believed of the lot's modulus and of its spread out.

Under partial pooling (`pooling = "partial"`) each specimen has a Young's modulus of its own, about that of the lot. How lot and
specimens go together: `calib.problem.lots`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from calib.catalogue import POOLED, SPREAD, display
from calib.errors import Fault
from calib.experiment.plan import Experiment
from calib.priors import Fixed, LogNormal, Prior, default_prior

# A spread above this is no share of a modulus: 5 % is 0.05.
_MOST_SPREAD = 1.0


def lot_prior(experiment: Experiment) -> LogNormal:
    """What is believed of the modulus of the lot.

    Raises
    ------
    TypeError
        If it is another distribution than the one that `lot_faults` lets through.
    """
    prior = experiment.priors.get(POOLED) or default_prior(POOLED)
    if not isinstance(prior, LogNormal):
        raise TypeError(f"the prior of {POOLED} of a lot must be log-normal, got {prior}")
    return prior


def spread_prior(experiment: Experiment) -> Prior:
    """What is believed of how far the moduli of specimens differ, as a share: what the experiment says, else the default."""
    return experiment.priors.get(SPREAD) or default_prior(SPREAD)


def lot_faults(experiment: Experiment) -> Iterator[tuple[str, Fault]]:
    """What an experiment says of a lot that cannot be: the unknown, and what is wrong with its prior."""
    prior, spread = experiment.priors.get(POOLED), experiment.priors.get(SPREAD)
    if experiment.pooling == "complete":
        if spread is not None:
            advice = 'Write pooling = "partial" at the top of the file, or leave it out'
            yield SPREAD, Fault(f"{SPREAD} has no meaning for specimens that share one modulus", advice=advice)
        return
    if prior is not None and not isinstance(prior, LogNormal):
        message = f'under pooling = "partial" the prior of {POOLED}, that of the lot, must be log-normal'
        yield POOLED, Fault(message, advice=f'Write {POOLED} = {_as_log_normal(prior)}, or pooling = "complete"')
    if spread is None:
        return
    low, median = (float(spread.ppf_normal(z)) for z in (-8.0, 0.0))
    if not 0 < median <= _MOST_SPREAD or not math.isfinite(median):
        advice = 'Give it as a share, 5 % as 0.05; for specimens that do not differ write pooling = "complete"'
        yield SPREAD, Fault(f"{SPREAD} must be above 0 and at most 1, got {median:g}", advice=advice)
    elif low < 0:
        yield SPREAD, Fault(f"{SPREAD} must not be negative", advice="Give it a prior such as { lognormal = [0.04, 2] }")


def _as_log_normal(prior: Prior) -> str:
    """A log-normal prior with the median and the width of another one, as it is written in a file; else an example."""
    low, median, high = (float(prior.ppf_normal(z)) for z in (-1.0, 0.0, 1.0))
    factor = math.sqrt(high / low) if 0 < low <= high < math.inf and not isinstance(prior, Fixed) else 1.0
    factor = factor if factor >= 1.01 else 1.1
    return f'{{ lognormal = ["{display(POOLED, float(f"{median:.3g}"))}", {factor:.3g}] }}'

"""A look at a problem on a slippery base in, what friction there, which its model does not have, would do to a modulus out.

Padding that lies unglued rubs on its base, and silicone on most things by more than a tenth of what presses it. That friction
makes a force larger and leaves its curve nearly as it was, so that a calibration finds a larger modulus and no check sees it.
By how much is told by another first answer.
"""

from __future__ import annotations

from collections.abc import Iterator

from calib.catalogue import QUANTITIES, UNKNOWNS
from calib.checks.departures import answer_under
from calib.checks.plausible.unseen import most_moved
from calib.checks.verdict import Reason
from calib.experiment import Variant
from calib.priors import Fixed
from calib.problem import Problem
from calib.sampling import FirstAnswer

#: Coefficient of friction on the base that is looked at where none is taken: little, of silicone.
COEFFICIENT = 0.1
# Share of a friction that is fixed by which it may be another: a table's, or that of another surface or day.
_UNSURE = 0.25
# Standard deviations by which a modulus may be off by it.
_LIMIT = 1.0
_FRICTION = "base_friction_coefficient"


def base_friction(problem: Problem, first: FirstAnswer | None) -> Iterator[Reason]:
    """What speaks against a calibration because the friction of a slippery base is taken for none, or as known exactly.

    Parameters
    ----------
    problem : what is calibrated.
    first : the first answer that it gives, if there is one.

    Returns
    -------
    A reason if little friction, or a little more than what is fixed, would move a modulus by more than its standard deviation,
    or that cannot be told.
    """
    experiment = problem.experiment
    prior = experiment.priors.get(_FRICTION)
    if experiment.base != "slippery" or not (prior is None or isinstance(prior, Fixed)):
        return
    taken = 0.0 if prior is None else prior.value
    unknown = f"{_FRICTION} = {UNKNOWNS[_FRICTION].example} in [priors]"
    if experiment.stick or experiment.rubs:  # no surrogate has both frictions
        unknown += ' and model = "fem" at the top of the file'
    advice = f"Glue the padding to its base, oil it, or let its friction be unknown: {unknown}"
    other = COEFFICIENT if taken == 0 else (1 + _UNSURE) * taken
    after = None if first is None else _with_friction(problem, first, other)
    if after is None and first is not None and taken > 0:  # beyond what a surrogate has
        other = (1 - _UNSURE) * taken
        after = _with_friction(problem, first, other)
    as_taken = "for none" if taken == 0 else f"as {taken:g} exactly"
    if first is None or after is None:
        finding = f"friction of the padding on its base is taken {as_taken}, and what another would do cannot be told"
        yield Reason("base", "amber", finding, advice)
        return
    before = first.parameters
    moduli = [p.key for p in problem.parameters if p.parameter == "young_modulus"]
    if not moduli:
        return
    most, shift = most_moved(moduli, before, after.parameters)
    if abs(shift) <= _LIMIT:
        return
    share = 100 * (before[str(most)].mean / after.parameters[str(most)].mean - 1)
    little = f"a coefficient of {other:.3g} there"
    why = f"{little}, which is little for silicone," if taken == 0 else f"{little}, as another surface or day may have it,"
    finding = (
        f"friction of the padding on its base is taken {as_taken}: {why} makes {QUANTITIES[most.parameter].label} "
        f"{abs(share):.2g} % too {'large' if share > 0 else 'small'} ({abs(shift):.1f} of the standard deviations that are "
        "stated), and nothing in the data tells"
    )
    yield Reason("base", "amber", finding, advice)


def _with_friction(problem: Problem, first: FirstAnswer, coefficient: float) -> FirstAnswer | None:
    """What would be found if the base rubbed so much; None where that cannot be told."""
    rubs = Variant("", {"model": "surrogate", "priors": {**problem.experiment.priors, _FRICTION: Fixed(coefficient)}})
    return answer_under(problem, rubs, first.means)

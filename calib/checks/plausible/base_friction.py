"""A look at a problem on a slippery base in, what friction there, which its model does not have, would do to a modulus out.

Padding that lies unglued rubs on its base, and silicone on most things by more than a tenth of what presses it. That friction
makes a force larger and leaves its curve nearly as it was, so that a calibration finds a larger modulus and no check sees it.
By how much is found from finite elements of one design, at the middle of the posterior: what friction makes of its force and of
its change of capacitance is carried over to all others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from calib.catalogue import QUANTITIES
from calib.checks.plausible.unseen import most_moved
from calib.checks.verdict import Reason
from calib.problem import Problem, range_use, specimen_design, values_at
from calib.sampling import FirstAnswer, FirstEstimate, Look, first_answer
from models.fem import FiniteElements
from models.response import ConvergenceError, Forward, OutOfRangeError, Response
from models.sensor import Design, FloatArray

#: Coefficient of friction on the base that is looked at: little, of silicone.
COEFFICIENT = 0.1
#: Standard deviations by which a modulus may be off by it.
_LIMIT = 1.0
# Of the finite elements: ratios of two of their curves on one grid are nearer than that.
_ACCURACY = 3e-3
_STEPS = 12


@dataclass(frozen=True, eq=False)
class Rubbing:
    """The model `inner` with force and change of capacitance times factors that depend on the depth alone.

    Attributes
    ----------
    inner : the model.
    depth : [m], rising, (n_depth,); beyond them factors are those of the ends.
    force, change : the factors there, (n_depth,).
    """

    inner: Forward
    depth: FloatArray
    force: FloatArray
    change: FloatArray

    @property
    def name(self) -> str:
        """Name of the model inside."""
        return self.inner.name

    @property
    def identity(self) -> str:
        """Identity of the model inside, and the factors."""
        factors = [column.tolist() for column in (self.depth, self.force, self.change)]
        return f"{self.inner.identity}, times {factors!r}"

    def max_depth(self, design: Design) -> FloatArray:
        """See `Forward.max_depth`, of the model inside."""
        return self.inner.max_depth(design)

    def outside(self, design: Design, depth: FloatArray) -> str:
        """See `Forward.outside`, of the model inside."""
        return self.inner.outside(design, depth)

    def respond(self, design: Design, depth: FloatArray) -> Response:
        """See `Forward.respond`: the response of the model inside times the factors, and so its error."""
        found = self.inner.respond(design, depth)
        force, change = (np.interp(found.depth, self.depth, factor) for factor in (self.force, self.change))
        at_rest = found.rest_capacitance[..., None]
        return replace(
            found,
            force=force * found.force,
            capacitance=at_rest + change * (found.capacitance - at_rest),
            force_error=force[..., None] * found.force_error,
            capacitance_error=change[..., None] * found.capacitance_error,
        )


def base_friction(problem: Problem, look: Look | None, first: FirstAnswer | None) -> Iterator[Reason]:
    """What speaks against a calibration because the friction of a slippery base is taken for none.

    Takes one or two seconds of processor time on a slippery base, none on a bonded one.

    Parameters
    ----------
    problem : what is calibrated.
    look : at its posterior, if there is one.
    first : the first answer that it gives, if there is one.

    Returns
    -------
    A reason if little friction would move a modulus by more than its standard deviation, or that cannot be told.
    """
    if problem.experiment.base != "slippery" or problem.experiment.base_rubs:
        return
    slow = problem.experiment.model == "fem"
    after = None if look is None or first is None or slow else _with_friction(look, first)
    if first is None or after is None:
        finding = "friction of the padding on its base is taken for none, and what a little of it would do cannot be told"
        yield Reason("base", "amber", finding, "Glue the padding to its base")
        return
    before = first.parameters
    moduli = [p.key for p in problem.parameters if p.parameter == "young_modulus"]
    if not moduli:
        return
    most, shift = most_moved(moduli, before, after)
    if abs(shift) <= _LIMIT:
        return
    share = 100 * (before[str(most)].mean / after[str(most)].mean - 1)
    finding = (
        f"the padding is taken to slide on its base without friction: a coefficient of {COEFFICIENT:g} there, which is little "
        f"for silicone, makes {QUANTITIES[most.parameter].label} {abs(share):.2g} % too {'large' if share > 0 else 'small'} "
        f"({abs(shift):.1f} of the standard deviations that are stated), and nothing in the data tells"
    )
    yield Reason(
        "base", "amber", finding, "Glue the padding to its base, or oil it and take its modulus for that much less sure"
    )


def _with_friction(look: Look, first: FirstAnswer) -> Mapping[str, FirstEstimate] | None:
    """What would be found if the model had friction on the base; None where that cannot be told."""
    near = {name: estimate.mean for name, estimate in first.parameters.items()}
    try:
        return first_answer(replace(look.problem, forward=rubbing_at(look)), near).parameters
    except (ConvergenceError, OutOfRangeError, ValueError):
        return None


def rubbing_at(look: Look) -> Rubbing:
    """The model of a look with what friction of `COEFFICIENT` on the base makes of the design at its middle.

    Raises
    ------
    ConvergenceError, OutOfRangeError
        If the finite elements do not press that design so deep.
    ValueError
        If the model of the look does not cover it.
    """
    problem, middle = look.problem, (look.weight @ look.theta)[None]
    sweep = problem.sweeps[0]
    design = specimen_design(problem, values_at(problem, middle), sweep.specimen, sweep.name).draw(0)
    deepest = float(range_use(problem, middle)[0] * problem.forward.max_depth(design)[0])
    depth = deepest * np.linspace(0, 1, _STEPS + 1)[1:] ** 2
    other = replace(design, padding=replace(design.padding, base_friction_coefficient=COEFFICIENT))
    free, rubs = (FiniteElements(_ACCURACY).respond(one, depth) for one in (design, other))
    return Rubbing(problem.forward, depth, rubs.force / free.force, rubs.capacitance_change / free.capacitance_change)

"""From a frictionless solution to the derivatives of its force and capacitance with respect to the design, step by step.

With the discrete equilibrium r(x, q) = 0 of unknowns x (displacement, pressure, contact) and a parameter q of the design,

    K dx/dq = -dr/dq,                                                                                                 (1)
    dF/dq = dF/dq|_x + dF/dx . dx/dq,      dC/dq = dC/dq|_x + dC/dx . dx/dq,                                          (2)

(implicit differentiation; Tortorelli & Michaleris, Inverse Probl. Eng. 1 (1994) 71). K is the tangent at the equilibrium,
factorised once for all parameters. dr/dq and the two right-hand sides of (2) are central differences of single evaluations at
the equilibrium, on grids carried over to the changed design, so nothing is solved anew.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from models.fem import contact as contacts
from models.fem.elements import (
    Condensed,
    Residual,
    condensed_change,
    deformation,
    displacement_step,
    make_elements,
    pressure_step,
    residual,
)
from models.fem.equilibrium import DiscreteSensor, Linearised, State, linearise
from models.fem.mesh import moved
from models.fem.solution import Solution, capacitance_of
from models.layers import LayeredDesign, layered
from models.sensor import INCOMPRESSIBLE, Design, FloatArray, design_from
from models.threads import one_thread

#: Relative step of the differences: their error is about its square.
_STEP = 3e-5

#: A design as a function of the relative change of one of its parameters.
DesignPath = Callable[[float], LayeredDesign]


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """Derivatives along a path, each by parameter name of shape (n_state,), in SI: [N] and [F] per unit of the parameter.

    `indentation` is among the names. A parameter that is zero (no padding) has none, since another design would have
    another number of layers, and Poisson's ratio has none at 0.5, where the model lets a layer give way a little.
    """

    force: dict[str, FloatArray]
    capacitance: dict[str, FloatArray]


def sensitivities(solution: Solution, design: Design) -> Sensitivities:
    """Derivatives of force and capacitance with respect to every parameter of the design.

    Parameters
    ----------
    solution : without friction.
    design : that it is of, one, not a batch; its parameters are taken as independent of each other, given or not.

    Returns
    -------
    By parameter, arrays (n_state,).

    Raises
    ------
    ValueError
        If the solution has friction: its states then depend on the whole path.
    """
    values = {k: float(np.asarray(v)) for k, v in design.draw(0).parameters().items()}
    # Steps are shares of a parameter; of Poisson's ratio shares of what it lacks to 0.5, where lambda grows beyond bounds.
    units = values | {"padding_poisson_ratio": INCOMPRESSIBLE - values["padding_poisson_ratio"]}

    def family(name: str) -> DesignPath:
        return lambda t: layered(design_from(values | {name: values[name] + units[name] * t}, base=design.base))

    relative = derivatives(solution, {name: family(name) for name, unit in units.items() if unit > 0})
    units["indentation"] = 1.0
    return Sensitivities(
        {name: d / units[name] for name, d in relative.force.items()},
        {name: d / units[name] for name, d in relative.capacitance.items()},
    )


def derivatives(solution: Solution, families: dict[str, DesignPath]) -> Sensitivities:
    """Derivatives of force and capacitance along any change of the design.

    Parameters
    ----------
    solution : without friction.
    families : by name, a design at t that is the solution's own at t = 0, to be differentiated by t there. It may refuse one
        side with a ValueError (an electrode as wide as its disc can only shrink); the difference is then one-sided.

    Returns
    -------
    By name, arrays (n_state,).

    Raises
    ------
    ValueError
        If the solution has friction.
    """
    if not solution.design.frictionless:
        raise ValueError("with friction a state depends on the whole path; there are no derivatives at fixed depth")
    force: dict[str, list[float]] = {name: [] for name in (*families, "indentation")}
    capacitance: dict[str, list[float]] = {name: [] for name in (*families, "indentation")}
    sides = {name: _sides(solution, family) for name, family in families.items()}
    with one_thread():
        for state in solution.states:
            at = _Equilibrium(solution, state) if state.depth > 0 else None
            for name, (plus, minus) in sides.items():
                d_force, d_change = (0.0, _rest_slope(plus, minus)) if at is None else at.along(plus, minus)
                force[name].append(d_force)
                capacitance[name].append(d_change)
            d_force, d_change = (0.0, 0.0) if at is None else at.deeper()
            force["indentation"].append(d_force)
            capacitance["indentation"].append(d_change)
    return Sensitivities({k: np.array(v) for k, v in force.items()}, {k: np.array(v) for k, v in capacitance.items()})


def _side(solution: Solution, design: LayeredDesign, t: float) -> _Side:
    units, model = solution.units, solution.model
    scaled, old = design.scaled(units.length, units.modulus), model.design
    if (scaled.profile, scaled.layers, scaled.radius) == (old.profile, old.layers, old.radius):
        return _Side(design, t, model, True)
    mesh = moved(model.mesh, old, scaled)
    parts, surface = make_elements(mesh, scaled), contacts.make_surface(mesh)
    return _Side(design, t, replace(model, design=scaled, mesh=mesh, elements=parts, surface=surface), False)


def _sides(solution: Solution, family: DesignPath) -> tuple[_Side, _Side]:
    """The changed designs on both sides, or on one and the unchanged one."""
    sides = []
    for t in (_STEP, -_STEP):
        try:
            sides.append(_side(solution, family(t), t))
        except ValueError:
            sides.append(_side(solution, solution.design, 0.0))
    return sides[0], sides[1]


def _rest_slope(plus: _Side, minus: _Side) -> float:
    return (plus.design.rest_capacitance - minus.design.rest_capacitance) / (plus.t - minus.t)


@dataclass(frozen=True, eq=False)
class _Side:
    """A design changed by t, on the solution's own topology; `same_mechanics` if only its capacitance can differ."""

    design: LayeredDesign
    t: float
    model: DiscreteSensor
    same_mechanics: bool

    def elements(self, u: FloatArray, pressure: FloatArray) -> Residual:
        """Force and volume residual of the elements."""
        return residual(self.model.elements, deformation(self.model.elements, u), pressure)

    def edges(self, state: State) -> FloatArray:
        """Force of the contact."""
        gap = contacts.gap(self.model.surface, self.model.design.profile, state.u, state.depth)
        return contacts.contact_system(self.model.surface, gap, state.contact, 0.0).residual

    def reaction(self, u: FloatArray, pressure: FloatArray) -> float:
        """Force on the base and so on the indenter, from the stresses: it does not hang on the stiff contact."""
        mesh, parts = self.model.mesh, self.model.elements
        nodal = np.bincount(parts.dofs.ravel(), self.elements(u, pressure).force.ravel(), 2 * mesh.n_node)
        return float(np.sum(nodal.reshape(mesh.r.size, mesh.n_row, 2)[:, 0, 1]))


class _Equilibrium:
    """One state brought to the last digit, with its factorised tangent."""

    def __init__(self, solution: Solution, state: State) -> None:
        self.solution, model = solution, solution.model
        parts = model.elements
        gap = contacts.gap(model.surface, model.design.profile, state.u, state.depth)
        at = linearise(model, state.u, deformation(parts, state.u), gap, state.pressure, state.contact, state.sliding)
        du = model.band.spread(at.step)
        displacement_step(parts, at.condensed, du)
        self.state = replace(
            state,
            u=state.u + du,
            pressure=state.pressure + pressure_step(parts, at.condensed, du),
            contact=contacts.stepped(gap, state.contact, 0.0, contacts.moved_by(model.surface, du)),
        )
        self.at: Linearised = at

    def along(self, plus: _Side, minus: _Side) -> tuple[float, float]:
        """Derivatives of force and capacitance between two changed designs."""
        state, band, width = self.state, self.solution.model.band, plus.t - minus.t
        if plus.same_mechanics and minus.same_mechanics:
            return 0.0, self._slope(plus, minus, np.zeros_like(state.u))
        one, two = (side.elements(state.u, state.pressure) for side in (plus, minus))
        border, follow = condensed_change(self.at.condensed, (one.force - two.force) / width, (one.volume - two.volume) / width)
        change = band.gather(border, (plus.edges(state) - minus.edges(state)) / width)
        return self._difference(plus, minus, band.spread(-self.at.factor.solve(change)), follow)  # Eq. (1)

    def deeper(self) -> tuple[float, float]:
        """Derivatives of force and capacitance with respect to the indentation."""
        at, length = self.at.condensed, self.solution.units.length
        _, follow = condensed_change(at, np.zeros_like(at.residual.force), np.zeros_like(at.residual.volume))
        plus, minus = (_side(self.solution, self.solution.design, t) for t in (_STEP, -_STEP))
        force, capacitance = self._difference(plus, minus, self.solution.model.band.spread(self.at.rate), follow)
        return force / length, capacitance / length

    def _difference(self, plus: _Side, minus: _Side, du: FloatArray, follow: Condensed) -> tuple[float, float]:
        """Eq. (2): force and capacitance of both sides, each with the state moved along by `du`, which is completed here."""
        state, parts = self.state, self.solution.model.elements
        displacement_step(parts, follow, du)
        dp = pressure_step(parts, follow, du)
        up, down = (side.reaction(state.u + side.t * du, state.pressure + side.t * dp) for side in (plus, minus))
        return (up - down) / (plus.t - minus.t) * self.solution.units.force, self._slope(plus, minus, du)

    def _slope(self, plus: _Side, minus: _Side, du: FloatArray) -> float:
        units = self.solution.units
        up, down = (capacitance_of(s.design, units, s.model.mesh, self.state.u + s.t * du) for s in (plus, minus))
        return (up - down) / (plus.t - minus.t)

"""The finite-element sensor model: exact and slow. A `Design` and depths (or forces) in, a `Response` out."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from models.analytic import CHI_MAX, bonded_layer_factor, effective_modulus, hertz_force
from models.fem.capacitance import ring_capacitance
from models.fem.equilibrium import Failure, Model, State, make_model, walk, walk_to_forces
from models.fem.mesh import Stack
from models.response import OutOfRangeError, Response
from models.sensor import VACUUM_PERMITTIVITY, Design, FloatArray

__all__ = ["ConvergenceError", "FiniteElements", "stack_of"]


class ConvergenceError(RuntimeError):
    """No equilibrium was found. `depth_reached` [m], `reason`, and `response` up to there (None if there is none)."""

    def __init__(self, depth_reached: float, reason: str, response: Response | None) -> None:
        self.depth_reached = depth_reached
        self.reason = reason
        self.response = response
        super().__init__(f"no equilibrium beyond an indentation of {depth_reached * 1e3:.4g} mm: {reason}")


def stack_of(design: Design) -> Stack:
    """The dimensionless stack of one (not batch) design: lengths over R, padding modulus over sensor modulus."""
    p = {k: float(v) for k, v in design.parameters().items()}
    radius = p["indenter_radius"]
    return Stack(
        p["sensor_thickness"] / radius,
        p["padding_thickness"] / radius,
        p["sensor_radius"] / radius,
        p["padding_young_modulus"] / p["young_modulus"],
    )


@dataclass(frozen=True)
class FiniteElements:
    """Axisymmetric finite elements as a `Forward`: nearly incompressible neo-Hookean, hard frictionless sphere, bonded base.

    `refinement` divides every element size; at 1 force is within 0.3 % and capacitance change within 1.3 % of the
    independent codes' results, force within 0.05 % beyond a tenth of the path.

    Covers depths to 65 % of the stack, to R, and to where the contact nears the rim (d = a^2 / (2 R)). Elements are sized by
    the largest depth asked for, so the same depth in another call may differ within that accuracy.
    """

    refinement: float = 1.0
    name: str = "finite elements"

    def max_depth(self, design: Design) -> FloatArray:
        """Largest depth [m] covered, shape (n_draw,)."""
        p = {k: np.asarray(v) for k, v in design.draws().parameters().items()}
        rim = p["sensor_radius"] ** 2 / (2 * p["indenter_radius"])
        thick = 0.65 * (p["sensor_thickness"] + p["padding_thickness"])
        return np.asarray(np.minimum(np.minimum(thick, p["indenter_radius"]), rim), dtype=float)

    def outside(self, design: Design, depth: FloatArray) -> str:
        """Empty, or the violated bound."""
        if design.indenter.friction_coefficient:
            return f"contact is frictionless; friction_coefficient must be 0, got {design.indenter.friction_coefficient:g}"
        limit = self.max_depth(design)
        deepest = np.max(np.broadcast_to(depth, (limit.size, np.shape(depth)[-1])), axis=-1)
        worst = int(np.argmax(deepest - limit))
        if deepest[worst] > limit[worst] * (1 + 1e-9):
            return (
                f"finite elements cover depths up to {limit[worst] * 1e3:.4g} mm here (65 % of the stack, R, and a^2/(2R)), "
                f"got {deepest[worst] * 1e3:.4g} mm"
            )
        return ""

    def respond(self, design: Design, depth: FloatArray) -> Response:
        """See `models.response.Forward.respond`.

        Raises
        ------
        OutOfRangeError
            If a depth is not covered.
        ConvergenceError
            If equilibrium is not found.
        """
        if reason := self.outside(design, depth):
            raise OutOfRangeError(reason)
        batch = design.draws()
        n_draw = np.shape(batch.sensor.thickness)[0]
        depths = np.broadcast_to(np.asarray(depth, dtype=float), (n_draw, np.shape(depth)[-1]))
        rows = [self._one(batch.draw(i), depths[i]) for i in range(n_draw)]
        return _stacked(rows) if design.is_batch else rows[0]

    def respond_to_force(self, design: Design, force: FloatArray) -> Response:
        """Response of one design at increasing positive forces [N], shape (n_force,): the depths are found.

        Raises
        ------
        ValueError
            If the forces do not increase from above zero.
        OutOfRangeError
            As for `respond`; also if a force is not reached at the largest depth covered.
        ConvergenceError
            If equilibrium is not found.
        """
        if force[0] <= 0 or np.any(np.diff(force) <= 0):
            raise ValueError("forces must be positive and increase")
        if reason := self.outside(design, np.zeros(1)):
            raise OutOfRangeError(reason)
        single = design.draw(0)
        radius, mu = float(np.asarray(single.indenter.radius)), float(np.asarray(single.sensor.young_modulus)) / 3
        deepest = float(self.max_depth(single)[0])
        # The mesh needs the end depth, which is known only afterwards: guess, walk, and walk again if the guess was poor.
        guess = _closed_form_depth(single, float(force[-1]), deepest)
        while True:
            model = make_model(stack_of(single), guess / radius, self.refinement)
            end = min(1.3 * guess, deepest)
            states, failure = _split(walk_to_forces(model, force / (mu * radius**2), end / radius))
            reached = max((s.depth for s in states), default=0.0) * radius
            if failure is None and reached > 0.7 * guess:
                return _response(single, model, states)
            if failure is None:
                guess = 1.05 * reached
            elif end < deepest:
                guess = min(1.4 * guess, deepest)
            elif failure.depth * radius >= deepest * (1 - 1e-9):
                raise OutOfRangeError(
                    f"{force[-1]:.4g} N is not reached within the depths that finite elements cover here, up to "
                    f"{deepest * 1e3:.4g} mm; ask for less"
                )
            else:
                raise ConvergenceError(reached, failure.reason, _response(single, model, states) if states else None)

    def _one(self, design: Design, depth: FloatArray) -> Response:
        radius = float(np.asarray(design.indenter.radius))
        wanted, inverse = np.unique(np.maximum(depth, 0.0), return_inverse=True)
        loaded = wanted[wanted > 0]
        model = make_model(stack_of(design), float(loaded[-1] if loaded.size else 0.1 * radius) / radius, self.refinement)
        states, failure = _split(walk(model, loaded / radius)) if loaded.size else ([], None)
        if failure is not None:
            reached = states[-1].depth * radius if states else 0.0
            raise ConvergenceError(reached, failure.reason, _response(design, model, states) if states else None)
        unique = _response(design, model, states)
        first = wanted.size - loaded.size  # one row for "no contact", if it was asked for
        n = len(states)

        def at(values: FloatArray, rest: float) -> FloatArray:
            return np.concatenate([np.full(first, rest), values[:n]])[inverse.ravel()]

        c0 = float(unique.rest_capacitance)
        return Response(
            np.asarray(depth, dtype=float),
            at(unique.force, 0.0),
            at(unique.contact_radius, 0.0),
            at(unique.capacitance, c0),
            unique.rest_capacitance,
            np.zeros((depth.size, 0)),
            np.zeros((depth.size, 0)),
        )


def _split(results: Iterable[State | Failure]) -> tuple[list[State], Failure | None]:
    states: list[State] = []
    for result in results:
        if isinstance(result, Failure):
            return states, result
        states.append(result)
    return states, None


def _response(design: Design, model: Model, states: list[State]) -> Response:
    """SI response from dimensionless states."""
    p = {k: float(v) for k, v in design.parameters().items()}
    radius, mu = p["indenter_radius"], p["young_modulus"] / 3
    stack = model.stack
    dielectric = np.array([p["dielectric_thickness"] / radius])
    electrode = np.array([p["electrode_radius"] / radius])
    unit = VACUUM_PERMITTIVITY * p["relative_permittivity"] * radius
    rings = [ring_capacitance(model.mesh, s.u, stack.sensor_thickness, dielectric, electrode)[0, 0] for s in states]
    n = len(states)
    return Response(
        np.array([s.depth * radius for s in states]),
        np.array([s.force * mu * radius**2 for s in states]),
        np.array([s.contact_radius * radius for s in states]),
        unit * np.array(rings),
        np.asarray(design.rest_capacitance, dtype=float),
        np.zeros((n, 0)),
        np.zeros((n, 0)),
    )


def _stacked(rows: list[Response]) -> Response:
    return Response(
        np.stack([r.depth for r in rows]),
        np.stack([r.force for r in rows]),
        np.stack([r.contact_radius for r in rows]),
        np.stack([r.capacitance for r in rows]),
        np.stack([r.rest_capacitance for r in rows]),
        np.stack([r.force_error for r in rows]),
        np.stack([r.capacitance_error for r in rows]),
    )


def _closed_form_depth(design: Design, force: float, deepest: float) -> float:
    """Depth [m] at which the closed form carries `force`, at most `deepest`: a guess for the mesh."""
    radius = np.asarray(design.indenter.radius)
    depth = np.linspace(0, deepest, 200)[1:]
    chi = np.minimum(np.sqrt(radius * depth) / np.asarray(design.total_thickness), CHI_MAX)
    curve = hertz_force(effective_modulus(design, depth)[0], float(radius), depth) * bonded_layer_factor(chi)
    return float(np.interp(force, curve, depth))

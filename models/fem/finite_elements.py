"""From a design and depths (or forces) to equilibria and a `Response`: the finite elements as a `Forward`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from models.analytic import CHI_MAX, bonded_layer_factor, hertz_force
from models.fem.equilibrium import Failure, State, make_model
from models.fem.path import walk, walk_to_forces
from models.fem.solution import Solution, dimensionless
from models.layers import LayeredDesign, layered, path_end
from models.response import OutOfRangeError, Response
from models.sensor import Design, FloatArray
from models.threads import one_thread

#: Version of the numbers: to be raised with every change of mesh, elements, contact or path that changes a result.
_NUMERICS = 4


@dataclass(frozen=True)
class FiniteElements:
    """Axisymmetric finite elements as a `Forward`: hyperelastic layers, incompressible or foams, under a hard indenter.

    For a trustworthy answer where a second or so for a curve does not matter; the surrogate is learnt from it.

    Covers depths to 65 % of the stack, to R for a sphere, and to where the indenter is 97 % as wide as the disc. Elements are
    sized by the largest depth asked for, so the same depth in another call may differ within the accuracy.

    Attributes
    ----------
    accuracy : relative accuracy of force and capacitance change that the grid is made for.
    name : for tables and reports.

    Raises
    ------
    ValueError
        If the accuracy is not between 1e-5 and 0.1.
    """

    accuracy: float = 1e-3
    name: str = "finite elements"

    def __post_init__(self) -> None:
        if not 1e-5 <= self.accuracy <= 0.1:
            raise ValueError(f"accuracy must lie between 1e-5 and 0.1, got {self.accuracy:g}")

    @property
    def identity(self) -> str:
        """Version of the numbers, and the accuracy: see `models.response.Forward.identity`."""
        return f"finite elements, numerics {_NUMERICS}, accuracy {float(self.accuracy)!r}"

    def max_depth(self, design: Design) -> FloatArray:
        """Largest depth [m] covered, shape (n_draw,)."""
        batch = design.draws()
        return np.array([path_end(layered(batch.draw(i))) for i in range(np.shape(batch.sensor.thickness)[0])])

    def outside(self, design: Design, depth: FloatArray) -> str:
        """See `Forward.outside`."""
        limit = self.max_depth(design)
        deepest = np.max(np.broadcast_to(depth, (limit.size, np.shape(depth)[-1])), axis=-1)
        worst = int(np.argmax(deepest - limit))
        return _beyond(float(deepest[worst]), float(limit[worst]))

    def respond(self, design: Design | LayeredDesign, depth: FloatArray) -> Response:
        """Force, contact and capacitance at given depths, see `models.response.Forward.respond`.

        Parameters
        ----------
        design : one, a batch of draws, or any stack of layers.
        depth : [m], shape (n_depth,) or (n_draw, n_depth), in any order: the path goes from the shallowest to the deepest.

        Returns
        -------
        Arrays of shape (n_depth,), of a batch (n_draw, n_depth).

        Raises
        ------
        OutOfRangeError
            If a depth is not covered.
        ConvergenceError
            If equilibrium is not found.
        """
        if isinstance(design, LayeredDesign):
            return self._loading(design, np.asarray(depth, dtype=float))
        if reason := self.outside(design, depth):
            raise OutOfRangeError(reason)
        batch = design.draws()
        n_draw = np.shape(batch.sensor.thickness)[0]
        depths = np.broadcast_to(np.asarray(depth, dtype=float), (n_draw, np.shape(depth)[-1]))
        rows = [self._loading(layered(batch.draw(i)), depths[i]) for i in range(n_draw)]
        return _stacked(rows) if design.is_batch else rows[0]

    def respond_to_force(self, design: Design | LayeredDesign, force: FloatArray) -> Response:
        """Force, contact and capacitance at given forces, whose depths are found.

        Parameters
        ----------
        design : one, not a batch.
        force : [N], positive, shape (n_force,), gone through in that order.

        Returns
        -------
        Arrays of shape (n_force,).

        Raises
        ------
        ValueError, OutOfRangeError
            As `solve_to_force`.
        ConvergenceError
            If equilibrium is not found.
        """
        return self.solve_to_force(design, force).checked().response

    def solve(self, design: Design | LayeredDesign, depth: FloatArray) -> Solution:
        """Find the equilibria of one design along a path of depths: loading, unloading, again.

        Without friction the order does not matter; with it the force on the way back is another.

        Parameters
        ----------
        design : one, not a batch.
        depth : [m], shape (n_depth,), gone through in that order.

        Returns
        -------
        A state for every depth; a path that ends early is returned as far as it came, with the `failure`.

        Raises
        ------
        OutOfRangeError
            If a depth is not covered.
        """
        single = _one(design)
        path = np.maximum(np.asarray(depth, dtype=float), 0.0)
        deepest = float(np.max(path))
        if reason := _beyond(deepest, path_end(single)):
            raise OutOfRangeError(reason)
        scaled, units = dimensionless(single)
        with one_thread():
            model = make_model(scaled, (deepest or 0.1 * single.thickness) / units.length, self.accuracy)
            states, failure = _split(walk(model, path / units.length))
        return Solution(single, units, model, states, failure)

    def solve_to_force(self, design: Design | LayeredDesign, force: FloatArray) -> Solution:
        """Find the equilibria of one design along a path of forces, with the depths that go with them.

        Parameters
        ----------
        design : one, not a batch.
        force : [N], positive, shape (n_force,), gone through in that order.

        Returns
        -------
        A state for every force; a path that ends early is returned as far as it came, with the `failure`.

        Raises
        ------
        ValueError
            If a force is not positive.
        OutOfRangeError
            If the design is not covered, or a force is not reached at the largest depth covered.
        """
        if np.min(force) <= 0:
            raise ValueError("forces must be positive")
        single = _one(design)
        scaled, units = dimensionless(single)
        deepest, largest = path_end(single), float(np.max(force))
        # The mesh needs the end depth, which is known only afterwards: guess, walk, and walk again if the guess was poor.
        guess = _closed_form_depth(single, largest, deepest)
        while True:
            end = min(1.3 * guess, deepest)
            with one_thread():
                model = make_model(scaled, guess / units.length, self.accuracy)
                states, failure = _split(walk_to_forces(model, force / units.force, end / units.length))
            reached = max((s.depth for s in states), default=0.0) * units.length
            if failure is None and reached > 0.7 * guess:
                return Solution(single, units, model, states, None)
            if failure is None:
                guess = 1.05 * reached
            elif end < deepest:
                guess = min(1.4 * guess, deepest)
            elif failure.depth * units.length >= deepest * (1 - 1e-9):
                raise OutOfRangeError(
                    f"{largest:.4g} N is not reached within the depths that finite elements cover here, up to "
                    f"{deepest * 1e3:.4g} mm; ask for less"
                )
            else:
                return Solution(single, units, model, states, failure)

    def _loading(self, design: LayeredDesign, depth: FloatArray) -> Response:
        """Response at depths in any order, gone through from the shallowest to the deepest."""
        wanted, inverse = np.unique(np.maximum(depth, 0.0), return_inverse=True)
        found = self.solve(design, wanted).checked().response
        at, none = inverse.ravel(), np.zeros((depth.size, 0))
        return Response(
            depth, found.force[at], found.contact_radius[at], found.capacitance[at], found.rest_capacitance, none, none
        )


def _one(design: Design | LayeredDesign) -> LayeredDesign:
    return design if isinstance(design, LayeredDesign) else layered(design.draw(0))


def _beyond(depth: float, limit: float) -> str:
    if depth <= limit * (1 + 1e-9):
        return ""
    return (
        f"finite elements cover depths up to {limit * 1e3:.4g} mm here (65 % of the stack, R, and an indenter narrower than "
        f"the disc), got {depth * 1e3:.4g} mm"
    )


def _split(results: Iterable[State | Failure]) -> tuple[tuple[State, ...], Failure | None]:
    states: list[State] = []
    for result in results:
        if isinstance(result, Failure):
            return tuple(states), result
        states.append(result)
    return tuple(states), None


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


def _closed_form_depth(design: LayeredDesign, force: float, deepest: float) -> float:
    """Depth [m] at which a sphere on one layer of the stack's mean compliance carries `force`: a guess for the mesh."""
    h = design.thickness
    modulus = h / sum(x.thickness / x.young_modulus for x in design.layers)
    depth = np.linspace(0, deepest, 200)[1:]
    radius = np.array([design.profile.radius_at(d) for d in depth])
    sphere = radius**2 / (2 * depth)  # radius of the sphere that is as wide at that depth
    chi = np.minimum(np.sqrt(sphere * depth) / h, CHI_MAX)
    curve = hertz_force(modulus, sphere, depth) * bonded_layer_factor(chi)
    return float(np.interp(force, np.maximum.accumulate(curve), depth))

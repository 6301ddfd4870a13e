"""From equilibria in the units of the finite elements to the `Response` [SI] of the design that they are of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.fem.capacitance import ring_capacitance
from models.fem.equilibrium import DiscreteSensor, Failure, State
from models.fem.mesh import Mesh
from models.layers import LayeredDesign
from models.response import ConvergenceError, Response
from models.sensor import VACUUM_PERMITTIVITY, FloatArray


@dataclass(frozen=True)
class Units:
    """What the finite elements count in: `length` [m], the indenter's size, and `modulus` [Pa], a third of the top layer's."""

    length: float
    modulus: float

    @property
    def force(self) -> float:
        """Unit of force [N]."""
        return self.modulus * self.length**2


def dimensionless(design: LayeredDesign) -> tuple[LayeredDesign, Units]:
    """Put a design into the units of the finite elements, in which a ball has radius 1 and the top layer Young's modulus 3.

    The shear modulus of an incompressible top layer is 1 then. Returns the design so scaled, and the units.
    """
    units = Units(design.profile.length, design.layers[-1].young_modulus / 3)
    return design.scaled(units.length, units.modulus), units


@dataclass(frozen=True, eq=False)
class Solution:
    """Equilibria of one design along a path: what a `Response` is made of.

    Attributes
    ----------
    design : in SI.
    units : in which `model` and `states` count.
    model : the discretised design.
    states : one for every depth reached, in the order of the path.
    failure : why the path ended before its last depth, or None.
    """

    design: LayeredDesign
    units: Units
    model: DiscreteSensor
    states: tuple[State, ...]
    failure: Failure | None

    @property
    def response(self) -> Response:
        """Force, contact and capacitance [SI] at the states there are, arrays of shape (n_state,)."""
        units, states = self.units, self.states
        rest, none = self.design.rest_capacitance, np.zeros((len(states), 0))
        mesh = self.model.mesh
        return Response(
            np.array([s.depth * units.length for s in states]),
            np.array([s.force * units.force for s in states]),
            np.array([s.contact_radius * units.length for s in states]),
            np.array([capacitance_of(self.design, units, mesh, s.u) if s.depth > 0 else rest for s in states]),
            np.asarray(rest, dtype=float),
            none,
            none,
        )

    def checked(self) -> Solution:
        """Return this solution if its path came to the end, else raise the reason.

        Raises
        ------
        ConvergenceError
            If the path ended early.
        """
        if self.failure is None:
            return self
        reached = self.states[-1].depth * self.units.length if self.states else 0.0
        raise ConvergenceError(reached, self.failure.reason, self.response if self.states else None)


def capacitance_of(design: LayeredDesign, units: Units, mesh: Mesh, u: FloatArray) -> float:
    """Capacitance of all dielectrics in parallel on a deformed grid.

    Parameters
    ----------
    design : whose dielectrics and electrodes they are [SI].
    units : in which the grid counts.
    mesh : the grid, undeformed.
    u : (n_dof,), displacements of its nodes.

    Returns
    -------
    C [F], without fringe fields.
    """
    dielectrics = design.dielectrics
    lower, upper = (np.array([getattr(d, k) for d in dielectrics]) / units.length for k in ("lower", "upper"))
    rings = ring_capacitance(mesh, u, lower, upper, np.array([design.electrode_radius / units.length]))
    permittivity = np.array([d.relative_permittivity for d in dielectrics])
    return float(VACUUM_PERMITTIVITY * units.length * permittivity @ rings[:, 0])

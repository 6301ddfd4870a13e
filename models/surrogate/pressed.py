"""Dimensionless curves of designs and depths in, force and capacitance in SI with the surrogate's own error out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from models.response import Asked, Response
from models.sensor import BoolArray, FloatArray
from models.surrogate.domain import PATH
from models.surrogate.shapes import FIRST_TOUCH, Places, Shapes

#: Terms of the polynomials in s of the logarithm of the error's standard deviation, and of its modes.
N_ERROR_TERMS = 3
N_MODE_TERMS = 6

#: Modes kept of the error along a path.
N_ERROR_MODES = 5

#: Change of capacitance, delta, that counts as nothing.
CHANGE_SCALE = 5e-5

#: Designs pressed together: their arrays stay in the processor's cache.
_CHUNK = 128

_FORCE, _CAPACITANCE = 0, 1  # rows of the error's terms


@dataclass(frozen=True, eq=False)
class SurrogateCurves:
    """Loading curves of a batch of designs as a surrogate gives them: see `models.response.Curves`.

    Attributes
    ----------
    limit : [m], (n_draw,), 0 where the design is not covered.
    shapes : the curves without units; harmless ones where the design is not covered.
    error_terms : of the logarithms of the errors' sd, of log F and of C/C0 - 1 over itself + delta, (n_draw, 2, N_ERROR_TERMS);
        where that is signed, over the base's + delta.
    radius, force_scale, rest_capacitance : R [m], mu R^2 [N] and C0 [F], (n_draw,).
    force_modes, capacitance_modes : (n_mode, N_MODE_TERMS), modes of the error's correlation along s.
    """

    limit: FloatArray
    shapes: Shapes
    error_terms: FloatArray
    radius: FloatArray
    force_scale: FloatArray
    rest_capacitance: FloatArray
    force_modes: FloatArray
    capacitance_modes: FloatArray

    def only(self, rows: slice | BoolArray) -> SurrogateCurves:
        """The curves of some of the designs."""
        return SurrogateCurves(
            self.limit[rows],
            self.shapes.only(rows),
            self.error_terms[rows],
            self.radius[rows],
            self.force_scale[rows],
            self.rest_capacitance[rows],
            self.force_modes,
            self.capacitance_modes,
        )

    def press(self, asked: Sequence[Asked]) -> list[Response]:
        """See `models.response.Curves`; what was not asked for is nan and has no modes of error."""
        return [self._press(one) for one in asked]

    def _press(self, asked: Asked) -> Response:
        n_draw, n_depth = asked.depth.shape
        modes = {"force": self.force_modes, "capacitance": self.capacitance_modes}
        rows = {name: 1 + len(modes.get(name, ())) for name in asked.columns}
        # All in one block: of several, some go back to the system after each batch, and getting them again takes a quarter of
        # the time.
        block = np.empty((sum(rows.values()), n_draw, n_depth))
        of_column = dict(zip(rows, np.split(block, np.cumsum(list(rows.values()))[:-1]), strict=False))
        columns = {name: own[0] for name, own in of_column.items()}
        errors = {name: own[1:] for name, own in of_column.items()}
        for first in range(0, n_draw, _CHUNK):
            part = slice(first, first + _CHUNK)
            some = self if n_draw <= _CHUNK else self.only(part)
            touching = asked.depth[part] > 0
            at = some.shapes.places(np.where(touching, asked.depth[part] / some.radius[:, None], FIRST_TOUCH))
            if "force" in columns:
                force = some.shapes.force(at) * (some.force_scale[:, None] * touching)
                columns["force"][part] = force
                _spread(self.force_modes, force * some._relative_sd(_FORCE, at), at, errors["force"][:, part])
            if "contact radius" in columns:
                columns["contact radius"][part] = some.shapes.contact_radius(at) * (some.radius[:, None] * touching)
            if "capacitance" in columns:
                (change, scale), c0 = some.shapes.change_and_scale(at), some.rest_capacitance[:, None]
                columns["capacitance"][part] = c0 + change * (c0 * touching)
                # The error is known from `PATH` on; nearer to first touch there is less and less to be wrong about.
                known = np.minimum(at.s / PATH[0], 1.0) * (c0 * touching)
                sd = (scale + CHANGE_SCALE) * some._relative_sd(_CAPACITANCE, at) * known
                _spread(self.capacitance_modes, sd, at, errors["capacitance"][:, part])
        nothing = np.broadcast_to(np.nan, (n_draw, n_depth))
        none = np.empty((0, n_draw, n_depth))
        return Response(
            depth=asked.depth,
            force=columns.get("force", nothing),
            contact_radius=columns.get("contact radius", nothing),
            capacitance=columns.get("capacitance", nothing),
            rest_capacitance=self.rest_capacitance,
            force_error=errors.get("force", none).transpose(1, 2, 0),
            capacitance_error=errors.get("capacitance", none).transpose(1, 2, 0),
        )

    def _relative_sd(self, channel: int, at: Places) -> FloatArray:
        """Sd of log F or of C/C0 - 1 over itself + delta, (n_draw, n_depth)."""
        logs = self.error_terms[:, channel : channel + 1] @ at.terms[:, :N_ERROR_TERMS]
        return np.asarray(np.exp(logs[:, 0]))


def _spread(modes: FloatArray, sd: FloatArray, at: Places, into: FloatArray) -> None:
    """Write an error of given sd (n_draw, n_depth) along the modes, (n_mode, n_draw, n_depth)."""
    terms = at.terms[:, :N_MODE_TERMS].transpose(1, 0, 2).reshape(N_MODE_TERMS, -1)
    np.multiply(sd, (modes @ terms).reshape(into.shape), out=into)

"""Groups of designs and what the networks say of them in, their dimensionless loading curves out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.sensor import BoolArray
from models.surrogate.coordinates import closed_change, closed_force, depth_terms, fade_of_family
from models.surrogate.families import NEO_HOOKEAN, Family
from models.surrogate.groups import Values

#: Nearer to first touch than this depth over R a curve is taken as it is there.
FIRST_TOUCH = 1e-12


@dataclass(frozen=True, eq=False)
class Places:
    """Depths along the curves of a batch of designs, with what all columns of a curve need there.

    Attributes
    ----------
    depth : over R, positive, (n_draw, n_depth).
    s : sqrt(depth / reach), (n_draw, n_depth).
    terms : of the polynomials in s, (n_draw, N_DEPTH_TERMS, n_depth).
    closed : closed-form F/(mu R^2), (n_draw, n_depth).
    fade : how much there is of what fades towards first touch, (n_draw, n_depth); None if nothing does.
    """

    depth: Values
    s: Values
    terms: Values
    closed: Values
    fade: Values | None = None


@dataclass(frozen=True, eq=False)
class Shapes:
    """Dimensionless loading curves of a batch of designs; everything is complex if the groups or depths are.

    Attributes
    ----------
    groups : (n_draw, n_group), inside the range.
    limit, reach : largest depth covered and the scale of depth, over R, (n_draw,).
    coefficients : of the polynomials p_F, p_a and p_C, (n_draw, 3, N_DEPTH_TERMS).
    fading : of what is added to these, and fades towards first touch, (n_draw, 3, N_DEPTH_TERMS); None if nothing does. In a
        family whose change is signed p_C is that of its base, and this holds what is added as a share of its change.
    family : of the designs, which says what closed forms the polynomials correct, and what fades how.
    """

    groups: Values
    limit: Values
    reach: Values
    coefficients: Values
    fading: Values | None = None
    family: Family = NEO_HOOKEAN

    def only(self, rows: slice | BoolArray) -> Shapes:
        """The curves of some of the designs."""
        fading = None if self.fading is None else self.fading[rows]
        return Shapes(self.groups[rows], self.limit[rows], self.reach[rows], self.coefficients[rows], fading, self.family)

    def places(self, depth: Values) -> Places:
        """Work out what all columns need at depths over R, positive, (n_draw, n_depth)."""
        s = np.sqrt(depth / self.reach[:, None])
        fade = None if self.fading is None or self.family.signed else fade_of_family(self.groups, depth, self.family)
        return Places(depth, s, depth_terms(s), closed_force(self.groups, depth, self.family.base), fade)

    def force(self, at: Places) -> Values:
        """F/(mu R^2), (n_draw, n_depth)."""
        return np.asarray(at.closed * np.exp(at.s * self._polynomial(0, at)))

    def contact_radius(self, at: Places) -> Values:
        """Contact radius over R, (n_draw, n_depth)."""
        return np.asarray(np.sqrt(at.depth) * np.exp(at.s * self._polynomial(1, at)))

    def change(self, at: Places) -> Values:
        """C/C0 - 1, (n_draw, n_depth)."""
        return self.change_and_scale(at)[0]

    def change_and_scale(self, at: Places) -> tuple[Values, Values]:
        """C/C0 - 1 and what its error is a share of, (n_draw, n_depth) each: itself, or the base's where it is signed."""
        closed = closed_change(self.groups, at.depth, at.closed, self.family.base)
        change = np.asarray(closed * np.exp(self._polynomial(2, at)))
        if not self.family.signed or self.fading is None:
            return change, change
        return np.asarray(change * (1 + (self.fading[:, 2:] @ at.terms)[:, 0])), change

    def _polynomial(self, which: int, at: Places) -> Values:
        value = (self.coefficients[:, which : which + 1] @ at.terms)[:, 0]
        if self.fading is not None and at.fade is not None:
            value = value + at.fade * (self.fading[:, which : which + 1] @ at.terms)[:, 0]
        return np.asarray(value)

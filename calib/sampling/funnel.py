"""Coordinates of a posterior in, the logarithm of a density that widens with its scales out; it can be drawn from, too.

A posterior of this kind of problem is a funnel: the noises and discrepancies u set how wide everything else is, and where they
are small it is narrow. So the density takes the scales first, then the rest given them. With y the coordinates, centred and
scaled, u ahead, and phi = (u, u u^T) bent so that it stays bounded,

    y_k = a_k + sum_{j<k} l_kj y_j + b_k phi + exp(c_k + d_k phi) r_k,                                               (1)

r_k = t_k of all but the scales, t multivariate Student. The scales are long on one side, so theirs is, as in
`calib.sampling.skew`,

    t_k = sinh(delta_k arsinh((r_k - xi_k) / eta_k) - epsilon_k).                                                    (2)

Where draws come to an end of what is believed of a coordinate, a normal score z that has no end itself, the others follow its
value v (`calib.sampling.ends`), and so none of them moves as z goes on. There y is that of v, in its own line and in those of
others; it comes right after the scales; and as v ends at v_low and v_high, its t is the normal score of that of (2)
between theirs,

    Phi(t_k) = (Phi(s(v)) - Phi(s(v_low))) / (Phi(s(v_high)) - Phi(s(v_low))), s(v) the right-hand side of (2).        (3)

Where groups of coordinates (those of each specimen) are independent of each other given the rest, (1) has no terms between
groups, and t is multivariate Student within each group.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import gammaln

from calib.sampling.ends import score_at, value_at
from calib.sampling.skew import skewed, straight_ends, straightened
from models.sensor import BoolArray, FloatArray

#: Columns, or their numbers.
Indices = np.ndarray[tuple[int], np.dtype[np.intp]]
# Where u, in standard deviations, is bent to a constant: it enters (1) as _BEND tanh(u / _BEND).
_BEND = 2.0


@dataclass(frozen=True, eq=False)
class Funnel:
    """One density of the form (1), n coordinates of which `order` names first the scales, n_phi terms of phi.

    Attributes
    ----------
    order : (n,), columns of x in the order of y.
    n_scale : how many of them are scales.
    centre, spread : (n,), y = (x - centre) / spread, in the order of x; of a value with an end, y = (v - centre) / spread.
    constant, linear, bent : a (n,), l (n, n) strictly lower, b (n, n_phi) of (1).
    width : (n, 1 + n_phi), c and d of (1).
    skew : (n_lead, 4) of the scales and of values with an end, which come right after them: epsilon, log delta, xi and log eta
        of (2); all zero for a density that is not skewed.
    ends : (n, 2), between which the value of each column of x lies that others follow, in its order; infinite where it is x
        itself. See `calib.sampling.ends`.
    block : (n,), number of the group that each of y belongs to, from 1; 0 for those that are in none, which come first.
    freedom, scale : (n_block,), of each group, the first of those in none: degrees of freedom of t, and the factor that it is
        wider by than standard.
    """

    order: Indices
    n_scale: int
    centre: FloatArray
    spread: FloatArray
    constant: FloatArray
    linear: FloatArray
    bent: FloatArray
    width: FloatArray
    skew: FloatArray
    ends: FloatArray
    block: Indices
    freedom: FloatArray
    scale: FloatArray

    @property
    def block_of_columns(self) -> Indices:
        """Number of the group of each column of x, (n,); 0 for those in none."""
        found = np.empty_like(self.block)
        found[self.order] = self.block
        return found

    def log_density(self, x: FloatArray) -> FloatArray:
        """Logarithm of the density at x (n_draw, n), (n_draw,)."""
        t, log_widths = self._lines(x)
        return np.asarray(np.sum(self.log_blocks(t), axis=1) - np.sum(log_widths, axis=1), dtype=float)

    def log_blocks(self, t: FloatArray) -> FloatArray:
        """Logarithm of the density of the residuals t (n_draw, n) of each group, (n_draw, n_block)."""
        square = np.stack([np.sum(t[:, self.block == k] ** 2, axis=1) for k in range(self.freedom.size)], axis=1)
        return log_student(square, np.bincount(self.block, minlength=self.freedom.size), self.freedom, self.scale)

    def log_widths(self, x: FloatArray) -> FloatArray:
        """Logarithms of the widths of all lines, |dx / dt|, at x (n_draw, n), (n_draw, n), in the order of y."""
        return self._lines(x)[1]

    def log_volume(self, x: FloatArray) -> FloatArray:
        """Logarithm of |dx / dt|, the volume of a unit of t at x (n_draw, n), (n_draw,)."""
        return np.asarray(np.sum(self.log_widths(x), axis=1), dtype=float)

    def log_shared(self, x: FloatArray) -> FloatArray:
        """Logarithm of the density at x (n_draw, n) of the coordinates in no group, (n_draw,)."""
        t, log_widths = self._lines(x)
        return np.asarray(self.log_blocks(t)[:, 0] - np.sum(log_widths[:, self.block == 0], axis=1), dtype=float)

    def residuals(self, x: FloatArray) -> FloatArray:
        """Residuals t of (1) and (2) at x (n_draw, n), (n_draw, n)."""
        return self._lines(x)[0]

    def _lines(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The residuals t at x (n_draw, n), and the logarithms of |dx / dt| of each line, (n_draw, n)."""
        values, log_slopes = followed_values(x, self.ends)
        y = ((values - self.centre) / self.spread)[:, self.order]
        phi = scale_terms(y[:, : self.n_scale])
        log_widths = self._log_widths(phi)
        t = (y - self.constant - y @ self.linear.T - phi @ self.bent.T) * np.exp(-log_widths)
        lead = slice(self.n_lead)
        t[:, lead], log_bends = straightened(t[:, lead], self.skew)
        for k in self.ended:
            t[:, k], log_bend = score_at(t[:, k], *self._ends_of(k, y, phi))  # (3)
            log_bends[:, k] += log_bend
        log_widths[:, lead] -= log_bends
        return t, log_widths + np.log(self.spread)[self.order] - log_slopes[:, self.order]

    def at(self, t: FloatArray) -> FloatArray:
        """Point x (n_draw, n) at which `residuals` gives t (n_draw, n)."""
        y = np.zeros_like(t)
        r = t.copy()
        lead, rest = slice(self.n_lead), slice(self.n_lead, None)
        r[:, lead] = skewed(t[:, lead], self.skew)
        ended = self.ended
        for k in range(self.n_lead):  # one after the other, as each changes phi
            phi = scale_terms(y[:, : self.n_scale])
            if k in ended:
                held, _ = value_at(t[:, k], *self._ends_of(k, y, phi))  # (3)
                r[:, k] = skewed(held[:, None], self.skew[k : k + 1])[:, 0]
            middle, log_width = self.line(k, y, phi)
            y[:, k] = middle + np.exp(log_width) * r[:, k]
        phi = scale_terms(y[:, : self.n_scale])
        right = self.constant + phi @ self.bent.T + np.exp(self._log_widths(phi)) * r
        right[:, rest] += y[:, lead] @ self.linear[rest, lead].T
        lower = np.eye(self.constant.size - self.n_lead) - self.linear[rest, rest]
        y[:, rest] = solve_triangular(lower, right[:, rest].T, lower=True, unit_diagonal=True).T
        values = np.empty_like(y)
        values[:, self.order] = y
        values = self.centre + self.spread * values
        for column in self.order[ended]:
            values[:, column], _ = score_at(values[:, column], *self.ends[column])
        return values

    @property
    def n_lead(self) -> int:
        """How many lines come first: those of scales and of values with an end."""
        return len(self.skew)

    @property
    def ended(self) -> Indices:
        """Numbers of the lines whose coordinate others follow by its value, as that has an end."""
        return np.flatnonzero(has_ends(self.ends[self.order]))

    def line(self, k: int | np.intp, y: FloatArray, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Middle and logarithm of the width of a line of (1), given those before it, (n_draw,) each.

        Parameters
        ----------
        k : its number.
        y : (n_draw, n), as far as it is known.
        phi : (n_draw, n_phi), of these.
        """
        return self.constant[k] + y @ self.linear[k] + phi @ self.bent[k], self._log_widths(phi)[:, k]

    def ends_of_r(self, k: int | np.intp, y: FloatArray, phi: FloatArray) -> FloatArray:
        """Ends between which the residual r of a line of (1) lies whose value has ends, (2, n_draw).

        Parameters
        ----------
        k, y, phi : see `line`.
        """
        middle, log_width = self.line(k, y, phi)
        column = self.order[k]
        ends = (self.ends[column] - self.centre[column]) / self.spread[column]
        return np.asarray((ends[:, None] - middle) * np.exp(-log_width), dtype=float)

    def _ends_of(self, k: int | np.intp, y: FloatArray, phi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Between which the t of line k in (2) lies, (n_draw,) each."""
        return straight_ends(self.ends_of_r(k, y, phi), self.skew[k])

    def draw(self, random: np.random.RandomState, n_draw: int) -> FloatArray:
        """Independent draws (n_draw, n).

        Parameters
        ----------
        random : the source of random numbers.
        n_draw : how many.
        """
        return self.at(self.fresh(random, n_draw))

    def fresh(self, random: np.random.RandomState, n_draw: int) -> FloatArray:
        """Independent draws of the residuals t, (n_draw, n).

        Parameters
        ----------
        random : the source of random numbers.
        n_draw : how many.
        """
        scale = self.scale / np.sqrt(random.chisquare(self.freedom, (n_draw, self.freedom.size)) / self.freedom)
        return np.asarray(random.standard_normal((n_draw, self.constant.size)) * scale[:, self.block], dtype=float)

    def nearby(self, random: np.random.RandomState, t: FloatArray, length: float) -> FloatArray:
        """Residuals near t (n_draw, n), a step that leaves their density alone; see `calib.sampling.proposal.Proposal.step`.

        Parameters
        ----------
        random : the source of random numbers.
        t : where the steps begin.
        length : of the steps, in (0, 1].
        """
        t = t / self.scale[self.block]
        size = np.bincount(self.block, minlength=self.freedom.size)
        square = np.stack([np.sum(t[:, self.block == k] ** 2, axis=1) for k in range(size.size)], axis=1)
        root = np.sqrt(random.gamma((self.freedom + size) / 2, 2 / (self.freedom + square)))[:, self.block]
        new = np.sqrt(1 - length**2) * t + length * random.standard_normal(t.shape) / root
        return np.asarray(self.scale[self.block] * new, dtype=float)

    def _log_widths(self, phi: FloatArray) -> FloatArray:
        return np.asarray(self.width[:, 0] + phi @ self.width[:, 1:].T, dtype=float)


def log_student(square: FloatArray, n: Indices | int, freedom: FloatArray | float, scale: FloatArray | float) -> FloatArray:
    """Log density of the n-dimensional Student distribution at points whose squared length is given.

    Parameters
    ----------
    square : squared lengths.
    n : number of dimensions.
    freedom : degrees of freedom.
    scale : factor that it is wider by than standard.
    """
    norm = gammaln((freedom + n) / 2) - gammaln(freedom / 2) - n / 2 * np.log(freedom * np.pi) - n * np.log(scale)
    return np.asarray(norm - (freedom + n) / 2 * np.log1p(square / (freedom * scale**2)), dtype=float)


def has_ends(ends: FloatArray) -> BoolArray:
    """Which values have an end, (n,), by the ends (n, 2) between which they lie."""
    return np.asarray(np.any(np.isfinite(ends), axis=-1), dtype=bool)


def followed_values(x: FloatArray, ends: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The values v that lines follow in the place of coordinates, and log dv / dx of each, (n_draw, n) both.

    Parameters
    ----------
    x : (n_draw, n), the coordinates.
    ends : (n, 2), between which the value of each lies; infinite where it is x itself.
    """
    ended = np.flatnonzero(has_ends(ends))
    values, log_slopes = x.copy() if ended.size else x, np.zeros_like(x)
    for k in ended:
        values[:, k], log_slopes[:, k] = value_at(x[:, k], *ends[k])
    return values, log_slopes


def scale_terms(u: FloatArray) -> FloatArray:
    """Terms phi of (1), scales u (n_draw, n_scale) and their products, bounded, (n_draw, n_phi)."""
    bounded = _BEND * np.tanh(u / _BEND)
    i, j = np.triu_indices(u.shape[1])
    return np.concatenate([bounded, bounded[:, i] * bounded[:, j]], axis=1)

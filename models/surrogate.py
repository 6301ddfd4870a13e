"""From a `TrainingSet` to the fast `Forward`: polynomials in the dimensionless groups and in the depth, with their own error.

With one material law F/(mu R^2) and C/C0 depend only on h_s/R, h_p/R, a/R, E_p/E (and t_d/h_s, a_e/a for C) and d/R; the moduli
and the permittivity scale exactly. What is fitted is the ratio to a closed form, which is smooth and of order one:

    log F - log F_closed,   log a_c - log sqrt(R d),   log(C/C0 - 1 + delta) - log(plate form + delta)

(delta = 1e-5 stops the last from chasing changes that no instrument sees), each a polynomial in s = sqrt(d / reach) whose
coefficients are polynomials of weighted total degree in four coordinates (a polynomial chaos; Xiu & Karniadakis, SIAM J. Sci.
Comput. 24 (2002) 619). Their error is measured by leaving each training path out (exact for least squares; Blatman & Sudret,
J. Comput. Phys. 230 (2011) 2345) and handed on as modes of the error's covariance along the sweep.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from importlib.metadata import version
from importlib.resources import as_file, files
from itertools import product
from pathlib import Path

import numpy as np
from numpy.polynomial import chebyshev

from models import training
from models.analytic import layer_weight
from models.response import OutOfRangeError, Response
from models.sensor import Design, FloatArray, IntArray
from models.training import DIELECTRIC, DIELECTRIC_POINTS, ELECTRODE, ELECTRODE_POINTS, GROUPS, PATH, TrainingSet

#: Polynomial terms in s, weighted total degree in the groups, and modes kept of the capacitance and of the errors.
N_DEPTH_TERMS = 9
DEGREE = 10
N_CAPACITANCE_MODES = 30
N_ERROR_MODES = 5

_FORMAT = 1


#: Weight of each coordinate in the total degree; a light one may take high powers. Chosen by leave-one-out error.
_DEGREE_WEIGHTS = np.array([1.4, 0.8, 0.9, 1.5])

#: Change of capacitance that counts as nothing.
_CHANGE_SCALE = 1e-5


# Relative rounding that a bound forgives.
_SLACK = 1e-9


def _groups(batch: Design) -> FloatArray:
    """The six dimensionless groups (n_draw, 6) of a batch: those of `GROUPS`, then t_d/h_s and a_e/a."""
    sensor, padding = batch.sensor, batch.padding
    r = np.asarray(batch.indenter.radius)
    # Without padding its modulus means nothing.
    modulus = np.where(np.asarray(padding.thickness) > 0, batch.padding_young_modulus / np.asarray(sensor.young_modulus), 1.0)
    return np.stack(
        [
            sensor.thickness / r,
            padding.thickness / r,
            sensor.radius / r,
            modulus,
            sensor.dielectric_thickness / np.asarray(sensor.thickness),
            sensor.electrode_radius / np.asarray(sensor.radius),
        ],
        axis=1,
    )


def _multi_index(degree: int) -> IntArray:
    """Exponents (n_term, 4) of weighted total degree at most `degree`."""
    every = np.array(list(product(range(int(degree / _DEGREE_WEIGHTS.min()) + 1), repeat=len(GROUPS))))
    return np.asarray(every[every @ _DEGREE_WEIGHTS <= degree], dtype=np.int64)


def _coordinates(groups: FloatArray) -> FloatArray:
    """Coordinates (n, 4) in [-1, 1]: those of `training.to_unit`, but log(1 + a/h) in place of the disc radius.

    What happens at the rim falls off over the thickness h = h_s + h_p: a disc is wide or narrow in thicknesses.
    """
    x = training.to_unit(groups)
    (h_low, h_high), (p_low, p_high), (a_low, a_high), _ = GROUPS.values()
    low, high = np.log1p(a_low / (h_high + p_high)), np.log1p(a_high / (h_low + p_low))
    x[:, 2] = 2 * (np.log1p(groups[:, 2] / (groups[:, 0] + groups[:, 1])) - low) / (high - low) - 1
    return x


def _group_basis(x: FloatArray, exponents: IntArray) -> FloatArray:
    """Products of Chebyshev polynomials of the coordinates, shape (n, n_term)."""
    powers = chebyshev.chebvander(x, int(exponents.max()))
    basis = powers[:, 0, exponents[:, 0]]
    for axis in range(1, x.shape[1]):
        basis = basis * powers[:, axis, exponents[:, axis]]
    return np.asarray(basis)


def _interpolation(points: FloatArray) -> FloatArray:
    """Matrix (n_point, n_point) from Chebyshev polynomials at x to the weights of the interpolation through `points`."""
    vander = chebyshev.chebvander(2 * (points - points[0]) / (points[-1] - points[0]) - 1, points.size - 1)
    return np.asarray(np.linalg.inv(vander))


_DIELECTRIC_WEIGHTS, _ELECTRODE_WEIGHTS = _interpolation(DIELECTRIC_POINTS), _interpolation(ELECTRODE_POINTS)


def _electric_weights(electric: FloatArray) -> FloatArray:
    """Weights (n_draw, n_dielectric * n_electrode) of the tabulated t_d/h_s and a_e/a at `electric` (n_draw, 2)."""
    per_axis = []
    for x, (low, high), matrix in zip(
        electric.T, (DIELECTRIC, ELECTRODE), (_DIELECTRIC_WEIGHTS, _ELECTRODE_WEIGHTS), strict=True
    ):
        per_axis.append(chebyshev.chebvander(2 * (x - low) / (high - low) - 1, matrix.shape[0] - 1) @ matrix)
    return np.asarray((per_axis[0][:, :, None] * per_axis[1][:, None, :]).reshape(electric.shape[0], -1))


def closed_force(groups: FloatArray, depth: FloatArray) -> FloatArray:
    """Closed-form F / (mu R^2) that the surrogate corrects; groups (n, 4), depth (n, n_depth) in units of R.

    Hertz times the thin-layer series 1 + 1.133 chi + 1.497 chi^2 + 1.469 chi^3 (Garcia & Garcia, Biophys. J. 114 (2018) 2923,
    without its quartic term, so that it keeps the chi^3 growth of a thin incompressible layer). Its first three terms carry a
    modulus that weights sensor and padding by their share in the compliance of a half space (`layer_weight`), the last that of
    a thin bonded film, where the lubrication flow under the sphere weights each height with the square of its depth below the
    surface: shares (h_s/h)^3 and 1 - (h_s/h)^3.
    """
    h_s, h_p, _, modulus = (g[:, None] for g in groups.T)
    contact = np.sqrt(depth)
    sensor = layer_weight(h_s / contact)
    both = layer_weight((h_s + h_p) / contact)
    deep, thin = 1 - sensor / both, 1 - (h_s / (h_s + h_p)) ** 3
    young_deep, young_thin = (3 / (1 - share + share / modulus) for share in (deep, thin))
    chi = contact / (h_s + h_p)
    series = young_deep * (1 + 1.133 * chi + 1.497 * chi**2) + young_thin * 1.469 * chi**3
    return np.asarray(16 / 9 * depth**1.5 * series)


def plate_form(groups: FloatArray, depth: FloatArray) -> FloatArray:
    """The Winkler form of `analytic.plate_capacitance_change` times (a_e/R)^2; groups (n, 4), depth (n, n_depth) over R."""
    h = (groups[:, 0] + groups[:, 1])[:, None]
    return np.asarray(2 * (-h * np.log1p(-depth / h) - depth))


@dataclass(frozen=True, eq=False)
class Surrogate:
    """The fast `Forward`. Refuses what lies outside its training range.

    Attributes
    ----------
    exponents : (n_term, 4).
    force, contact : (n_term, n_depth_term).
    capacitance : (n_term, n_mode), and `capacitance_modes` (n_mode, n_depth_term, n_dielectric, n_electrode).
    force_error_modes : (n_error_mode, n_depth_term) of log F.
    capacitance_error_modes : (n_error_mode, n_depth_term, n_dielectric, n_electrode).
    provenance : where it comes from: finite-element settings, training set and its hash, versions, date, own error.
    """

    exponents: IntArray
    force: FloatArray
    contact: FloatArray
    capacitance: FloatArray
    capacitance_modes: FloatArray
    force_error_modes: FloatArray
    capacitance_error_modes: FloatArray
    provenance: Mapping[str, str]

    @property
    def name(self) -> str:
        """Short name for tables and reports."""
        return "surrogate"

    def info(self) -> dict[str, str]:
        """Provenance, error and range as words."""
        ranges = {f"range of {k}": f"{low:g} to {high:g}" for k, (low, high) in self._ranges.items()}
        depth = "the smooth minimum of 57 % of the stack, 0.9 R and 0.36 a^2/R"
        return {**self.provenance, **ranges, "range of d": f"up to {depth}"}

    @cached_property
    def _ranges(self) -> dict[str, tuple[float, float]]:
        return {**GROUPS, "t_d/h_s": DIELECTRIC, "a_e/a": ELECTRODE}

    def _limit(self, groups: FloatArray, design: Design) -> FloatArray:
        """Largest depth [m] (n_draw,) of the batch `design` with its `groups` (n_draw, 6); 0 outside the training range."""
        bounds = np.array(list(self._ranges.values()))
        inside = np.all((groups >= bounds[:, 0] - _SLACK) & (groups <= bounds[:, 1] + _SLACK), axis=1)
        if design.indenter.friction_coefficient:
            inside[:] = False
        return np.where(inside, training.reach(*groups[:, :3].T) * np.asarray(design.indenter.radius), 0.0)

    def max_depth(self, design: Design) -> FloatArray:
        """Largest depth [m] covered, shape (n_draw,); 0 where the design is outside the training range."""
        batch = design.draws()
        return self._limit(_groups(batch), batch)

    def outside(self, design: Design, depth: FloatArray) -> str:
        """Empty, or one sentence that names the violated bound, the value, and how it comes about."""
        if design.indenter.friction_coefficient:
            return (
                "the surrogate is trained for frictionless contact; friction_coefficient must be 0, got "
                f"{design.indenter.friction_coefficient:g}"
            )
        batch = design.draws()
        groups = _groups(batch)
        for column, (group, (low, high)) in zip(groups.T, self._ranges.items(), strict=True):
            for value in (np.min(column), np.max(column)):
                if not low - _SLACK <= value <= high + _SLACK:
                    return f"the surrogate covers {group} from {low:g} to {high:g}, got {value:.4g}"
        limit = self._limit(groups, batch)
        deepest = np.max(np.broadcast_to(depth, (limit.size, np.shape(depth)[-1])), axis=-1)
        worst = int(np.argmax(deepest - limit))
        if deepest[worst] > limit[worst] * (1 + _SLACK):
            return (
                f"the surrogate covers depths up to {limit[worst] * 1e3:.4g} mm for this design (57 % of the stack, 0.9 R, "
                f"0.36 a^2/R), got {deepest[worst] * 1e3:.4g} mm"
            )
        return ""

    def respond(self, design: Design, depth: FloatArray) -> Response:
        """See `models.response.Forward.respond`."""
        batch = design.draws()
        every = _groups(batch)
        if np.any(np.max(depth, axis=-1) > self._limit(every, batch) * (1 + _SLACK)):
            raise OutOfRangeError(self.outside(design, depth))
        p = {k: np.asarray(v) for k, v in batch.parameters().items()}
        radius, mu = p["indenter_radius"][:, None], p["young_modulus"][:, None] / 3
        groups, electric = every[:, :4], every[:, 4:]
        depths = np.broadcast_to(np.asarray(depth, dtype=float), (groups.shape[0], np.shape(depth)[-1]))
        touching = depths > 0
        d = np.where(touching, depths, 1e-9 * radius) / radius
        s = np.sqrt(d / training.reach(*groups[:, :3].T)[:, None])
        terms = chebyshev.chebvander(2 * np.minimum(s, 1.0) - 1, N_DEPTH_TERMS - 1)
        basis = _group_basis(_coordinates(groups), self.exponents)

        force = closed_force(groups, d) * np.exp(_along(terms, basis @ self.force)) * (mu * radius**2)
        contact = np.sqrt(d) * np.exp(_along(terms, basis @ self.contact)) * radius

        flat = _electric_weights(electric)
        modes = self.capacitance_modes.reshape(-1, flat.shape[1])
        here = (flat @ modes.T).reshape(flat.shape[0], -1, N_DEPTH_TERMS)
        coefficients = np.einsum("nm,nmk->nk", basis @ self.capacitance, here)
        c0 = np.asarray(batch.rest_capacitance, dtype=float)
        plate = plate_form(groups, d) / (p["electrode_radius"][:, None] / radius) ** 2
        scale = (plate + _CHANGE_SCALE) * np.exp(_along(terms, coefficients))

        error_modes = self.capacitance_error_modes.reshape(-1, flat.shape[1])
        error_here = (flat @ error_modes.T).reshape(flat.shape[0], -1, N_DEPTH_TERMS)
        force = np.where(touching, force, 0.0)
        scale = np.where(touching, scale, _CHANGE_SCALE)
        error_scale = np.where(touching, scale, 0.0) * c0[:, None]
        response = Response(
            depth=depths,
            force=force,
            contact_radius=np.where(touching, contact, 0.0),
            capacitance=c0[:, None] * (1 + (scale - _CHANGE_SCALE)),
            rest_capacitance=c0,
            force_error=force[..., None] * (terms @ self.force_error_modes.T),
            capacitance_error=error_scale[..., None] * np.einsum("ndk,nmk->ndm", terms, error_here),
        )
        return response if design.is_batch else response.draw(0)

    def save(self, path: Path) -> None:
        """Write as npz; nothing in it is executed on reading."""
        np.savez_compressed(
            path,
            format=_FORMAT,
            exponents=self.exponents.astype(np.int16),
            force=self.force,
            contact=self.contact,
            capacitance=self.capacitance,
            capacitance_modes=self.capacitance_modes,
            force_error_modes=self.force_error_modes,
            capacitance_error_modes=self.capacitance_error_modes,
            provenance=np.array(json.dumps(dict(self.provenance))),
        )


def _along(terms: FloatArray, coefficients: FloatArray) -> FloatArray:
    """Polynomial values (n, n_depth) from terms (n, n_depth, n_term) and coefficients (n, n_term)."""
    return np.asarray((terms @ coefficients[..., None])[..., 0])


def load_surrogate(path: Path | None = None) -> Surrogate:
    """Read a surrogate that `Surrogate.save` wrote; without a path the one shipped with the package.

    Raises
    ------
    ValueError
        If the file is not a surrogate of this format.
    """
    if path is None:
        with as_file(files("models") / "data" / "surrogate.npz") as shipped:
            return load_surrogate(shipped)
    try:
        with np.load(path, allow_pickle=False) as file:
            data = {name: file[name] for name in file.files}
        written = int(data["format"])
    except (KeyError, OSError, EOFError, ValueError):
        raise ValueError(f"{path} is not a surrogate file; give one that `calib surrogate train` wrote") from None
    if written != _FORMAT:
        raise ValueError(f"{path} has surrogate format {written}, this version reads {_FORMAT}; train it anew")
    return Surrogate(
        data["exponents"].astype(np.int64),
        data["force"],
        data["contact"],
        data["capacitance"],
        data["capacitance_modes"],
        data["force_error_modes"],
        data["capacitance_error_modes"],
        json.loads(str(data["provenance"])),
    )


def least_paths(degree: int = DEGREE) -> int:
    """Fewest training paths that `fit_surrogate` takes: 1.5 for each polynomial term."""
    return int(np.ceil(1.5 * len(_multi_index(degree))))


def fit_surrogate(data: TrainingSet, degree: int = DEGREE) -> Surrogate:
    """Least-squares fit of everything, and the leave-one-out error.

    Raises
    ------
    ValueError
        If there are fewer than 1.5 training paths per polynomial term.
    """
    exponents = _multi_index(degree)
    n_run, n_term = data.groups.shape[0], exponents.shape[0]
    if n_run < least_paths(degree):
        raise ValueError(f"{n_run} training paths are too few for {n_term} terms; give at least {least_paths(degree)}")
    depth = training.reach(*data.groups[:, :3].T)[:, None] * PATH**2
    basis = _group_basis(_coordinates(data.groups), exponents)
    q, r = np.linalg.qr(basis)
    leverage = np.sum(q**2, axis=1)

    def regress(values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coefficients (n_term, n_out) and leave-one-out residuals (n_run, n_out)."""
        coefficients = np.linalg.solve(r, q.T @ values)
        residual = values - basis @ coefficients
        return coefficients, residual / (1 - leverage)[:, None]

    force_curves = _depth_fit(np.log(data.force / closed_force(data.groups, depth)))
    contact_curves = _depth_fit(np.log(data.contact_radius / np.sqrt(depth)))
    electrode = (ELECTRODE_POINTS * data.groups[:, 2:3]) ** 2
    plate = plate_form(data.groups, depth)[:, :, None, None] / electrode[:, None, None, :]
    scaled = np.log((data.capacitance + _CHANGE_SCALE) / (plate + _CHANGE_SCALE))
    n_out = scaled.shape[2] * scaled.shape[3]
    columns = np.moveaxis(scaled.reshape(n_run, PATH.size, n_out), 1, 2).reshape(-1, PATH.size)
    capacitance_curves = np.moveaxis(_depth_fit(columns).reshape(n_run, n_out, N_DEPTH_TERMS), 1, 2)
    flat = capacitance_curves.reshape(n_run, -1)
    _, _, vt = np.linalg.svd(flat, full_matrices=False)
    modes = vt[:N_CAPACITANCE_MODES]

    force, force_loo = regress(force_curves)
    contact, _ = regress(contact_curves)
    capacitance, _ = regress(flat @ modes.T)
    _, capacitance_loo = regress(flat)
    # What the polynomial in s leaves of a path belongs to the error, too.
    force_left = np.log(data.force / closed_force(data.groups, depth)) - force_curves @ _terms(PATH).T
    loo_at_path = force_loo @ _terms(PATH).T + force_left
    shape = (N_DEPTH_TERMS, scaled.shape[2], scaled.shape[3])
    return Surrogate(
        exponents,
        force,
        contact,
        capacitance,
        modes.reshape(-1, *shape),
        _error_modes(force_loo),
        _error_modes(capacitance_loo).reshape(-1, *shape),
        {
            "model": "neo-Hookean sensor on padding, bonded base, frictionless sphere",
            "finite elements": f"Q2/P1, accuracy {data.accuracy:g}, K/mu 1e4",
            "training paths": f"{n_run} of {n_run + len(data.failures)} (Sobol sequence, seed {data.seed})",
            "training hash (SHA-256)": data.digest,
            "fit": f"weighted total degree {degree} ({n_term} terms), {N_DEPTH_TERMS} terms in depth",
            "leave-one-out error of force": _in_words(loo_at_path),
            "leave-one-out error of capacitance change": _in_words(
                capacitance_loo.reshape(n_run, N_DEPTH_TERMS, n_out).swapaxes(1, 2) @ _terms(PATH).T
            ),
            "numpy": version("numpy"),
            "scipy": version("scipy"),
            "date": datetime.now(UTC).date().isoformat(),
        },
    )


def _in_words(error: FloatArray) -> str:
    return f"rms {np.sqrt(np.mean(error**2)):.2%}, 95 % below {np.quantile(np.abs(error), 0.95):.2%}"


def _terms(s: FloatArray) -> FloatArray:
    return np.asarray(chebyshev.chebvander(2 * s - 1, N_DEPTH_TERMS - 1))


def _depth_fit(values: FloatArray) -> FloatArray:
    """Coefficients (n, n_depth_term) of curves (n, n_path) in s, through zero at s = 0: Hertz' limit, and no change of C.

    Small depths, where few elements touch, weigh less; they hold what discretisation noise there is.
    """
    weight = np.clip(PATH / 0.4, 0.3, 1.0)
    terms = np.vstack([_terms(PATH) * weight[:, None], 10 * _terms(np.zeros(1))])
    right = np.hstack([values * weight, np.zeros((values.shape[0], 1))])
    return np.asarray(np.linalg.lstsq(terms, right.T, rcond=None)[0].T)


def _error_modes(residual: FloatArray) -> FloatArray:
    """Principal modes V with V^T V = covariance of the residuals about zero, largest first."""
    _, size, vt = np.linalg.svd(residual / np.sqrt(residual.shape[0]), full_matrices=False)
    return np.asarray(size[:N_ERROR_MODES, None] * vt[:N_ERROR_MODES])

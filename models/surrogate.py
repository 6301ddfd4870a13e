"""From a design and depths to curves at once: small networks over the dimensionless groups, polynomials in depth, own error.

With one material law F/(mu R^2) and C/C0 depend only on h_s/R, h_p/R, a/R, E_p/E (and t_d/h_s, a_e/a for C) and d/R; the moduli
and the permittivity scale exactly. Along a path the variable is s = sqrt(d / reach), reach(design) a smooth minimum of R/2 and
of the depth at which a layer is thinned to 40 %. Then

    log F = log F_closed + s p_F(s),     log(C/C0 - 1 + delta) = log((d/a_e)^2 + delta) + s^2 p_C(s),

and log a_c = log sqrt(R d) + s p_a(s), with polynomials p whose coefficients are networks of the groups. So C = C0 and F = 0 at
no indentation, F goes over into Hertz' limit there, and everything is smooth in depth. delta = 5e-5 stops the second from
chasing changes that no instrument sees. The error is a covariance along the path, F(s) sigma(s) rho(s, s') sigma(s') F(s'),
with sigma a network, too, and rho the correlation of what the fit missed on paths kept out of it (`models.fitting`).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np

from models import domain
from models.analytic import layer_weight
from models.domain import DEPTH, DISC, PADDING, PATH, SENSOR, STIFFNESS, WIDTH, Values, electric_features, mechanical_features
from models.network import Network, network_from
from models.response import OutOfRangeError, Response
from models.sensor import VACUUM_PERMITTIVITY, Design, FloatArray

#: Terms of the polynomials in s, and modes kept of the error along a path.
N_DEPTH_TERMS = 12
N_ERROR_MODES = 6

#: Change of capacitance that counts as nothing.
CHANGE_SCALE = 5e-5

#: The polynomials are Chebyshev's on 0 <= s <= 1.05: paths end where a step lands, a little beyond the reach.
_S_END = 1.05

#: Points in s between which the logarithm of the error's standard deviation is interpolated.
ERROR_POINTS = np.array([0.19, 0.37, 0.55, 0.73, 0.91])

#: Designs evaluated together: their arrays stay in the processor's cache.
_CHUNK = 256

_FORMAT = 2

# Relative rounding that a bound forgives.
_SLACK = 1e-9


def _chebyshev(x: Values, n: int) -> Values:
    """T_0..T_(n-1) at x, shape (..., n)."""
    terms = np.empty((*x.shape, n), dtype=x.dtype)
    terms[..., 0] = 1
    terms[..., 1] = x
    for k in range(2, n):
        terms[..., k] = 2 * x * terms[..., k - 1] - terms[..., k - 2]
    return terms


def depth_terms(s: Values) -> Values:
    """The terms (..., N_DEPTH_TERMS) of the polynomials in s."""
    return _chebyshev(2 / _S_END * s - 1, N_DEPTH_TERMS)


def closed_force(groups: Values, depth: Values) -> Values:
    """Closed-form F / (mu R^2) that the surrogate corrects; groups (n, >= 4), depth (n, n_depth) in units of R.

    Hertz times the thin-layer series 1 + 1.133 chi + 1.497 chi^2 + 1.469 chi^3 (Garcia & Garcia, Biophys. J. 114 (2018) 2923,
    without its quartic term, so that it keeps the chi^3 growth of a thin incompressible layer). Its first three terms carry a
    modulus that weights sensor and padding by their share in the compliance of a half space (`layer_weight`), the last that of
    a thin bonded film, where the lubrication flow under the sphere weights each height with the square of its depth below the
    surface: shares (h_s/h)^3 and 1 - (h_s/h)^3.
    """
    h_s, h_p, modulus = (groups[:, k, None] for k in (SENSOR, PADDING, STIFFNESS))
    contact = np.sqrt(depth)
    sensor = layer_weight(h_s / contact)
    both = layer_weight((h_s + h_p) / contact)
    deep, thin = 1 - sensor / both, 1 - (h_s / (h_s + h_p)) ** 3
    young_deep, young_thin = (3 / (1 - share + share / modulus) for share in (deep, thin))
    chi = contact / (h_s + h_p)
    series = young_deep * (1 + chi * (1.133 + chi * 1.497)) + young_thin * 1.469 * chi * chi * chi
    return np.asarray(16 / 9 * depth * contact * series)


def smooth_end(thinned: Values) -> Values:
    """Scale of depth over R: the smooth minimum of R/2 and the depth at which a layer is `thinned` to 40 %."""
    return np.asarray((DEPTH**-8.0 + thinned**-8.0) ** (-1 / 8))


@dataclass(frozen=True, eq=False)
class _Paths:
    """Dimensionless curves of a batch of designs and depths (n_draw, n_depth): what the networks say."""

    force: Values
    contact_radius: Values
    change: Values
    s: Values
    change_scale: Values


@dataclass(frozen=True, eq=False)
class Surrogate:
    """The fast `Forward`. Refuses what lies outside its training range.

    Attributes
    ----------
    end : network from mechanical features to log(d / h) where a layer is thinned to 40 %, or the finite elements end.
    mechanics : from mechanical features to the coefficients of p_F and p_a, (n, 2 * N_DEPTH_TERMS) side by side.
    capacitance : from electric features to those of p_C.
    force_sd, capacitance_sd : from features to the logarithm of the error's standard deviation at `ERROR_POINTS`.
    force_modes, capacitance_modes : (n_mode, N_DEPTH_TERMS), modes of the error's correlation along s.
    provenance : where it comes from: finite-element settings, training set and its hash, versions, date, own error.
    """

    end: Network
    mechanics: Network
    capacitance: Network
    force_sd: Network
    capacitance_sd: Network
    force_modes: FloatArray
    capacitance_modes: FloatArray
    provenance: Mapping[str, str]

    @property
    def name(self) -> str:
        """Short name for tables and reports."""
        return "surrogate"

    def info(self) -> dict[str, str]:
        """Provenance, error and range as words."""
        ranges = {f"range of {b.name}": f"{b.low:.4g} to {b.high:.4g}" for b in domain.BOUNDS}
        depth = "R/2, or where a layer is thinned to 40 % on the axis if that is first"
        return {**self.provenance, **ranges, "range of d": f"up to {depth}"}

    def _limit(self, groups: FloatArray, design: Design) -> FloatArray:
        """Largest depth [m] (n_draw,) of the batch `design` with its `groups` (n_draw, 6); 0 outside the training range."""
        inside = domain.inside(groups)
        if design.indenter.friction_coefficient:
            inside[:] = False
        # What is outside may be anything, also nothing the networks' features are defined for.
        thinned = self._thinned(np.where(inside[:, None], groups, 1.0))
        return np.where(inside, np.minimum(DEPTH, thinned) * np.asarray(design.indenter.radius), 0.0)

    def _thinned(self, groups: Values) -> Values:
        """Depth over R (n_draw,) at which a layer is thinned to 40 %."""
        return np.asarray((groups[:, SENSOR] + groups[:, PADDING]) * np.exp(self.end(mechanical_features(groups))[:, 0]))

    def max_depth(self, design: Design) -> FloatArray:
        """Largest depth [m] covered, shape (n_draw,); 0 where the design is outside the training range."""
        batch = design.draws()
        return self._limit(domain.groups_of(batch), batch)

    def outside(self, design: Design, depth: FloatArray) -> str:
        """Empty, or one sentence that names the violated bound, the value, and how it comes about."""
        if design.indenter.friction_coefficient:
            return (
                "the surrogate is trained for frictionless contact; friction_coefficient must be 0, got "
                f"{design.indenter.friction_coefficient:g}"
            )
        batch = design.draws()
        groups = domain.groups_of(batch)
        bound = domain.violated(groups)
        if bound:
            return f"the surrogate covers {bound}"
        limit = self._limit(groups, batch)
        deepest = np.max(np.broadcast_to(depth, (limit.size, np.shape(depth)[-1])), axis=-1)
        worst = int(np.argmax(deepest - limit))
        if deepest[worst] > limit[worst] * (1 + _SLACK):
            why = "half the radius" if limit[worst] >= DEPTH * np.asarray(batch.indenter.radius)[worst] else "60 % compression"
            return (
                f"the surrogate covers depths up to {limit[worst] * 1e3:.4g} mm for this design ({why}), "
                f"got {deepest[worst] * 1e3:.4g} mm"
            )
        return ""

    def respond(self, design: Design, depth: FloatArray) -> Response:
        """See `models.response.Forward.respond`."""
        batch = design.draws()
        groups = domain.groups_of(batch)
        if np.any(np.max(depth, axis=-1) > self._limit(groups, batch) * (1 + _SLACK)):
            raise OutOfRangeError(self.outside(design, depth))
        radius = np.asarray(batch.indenter.radius)[:, None]
        mu = np.asarray(batch.sensor.young_modulus)[:, None] / 3
        c0 = np.asarray(batch.rest_capacitance, dtype=float)
        depths = np.broadcast_to(np.asarray(depth, dtype=float), (groups.shape[0], np.shape(depth)[-1]))
        n_draw, n_depth = depths.shape
        force, contact, change = (np.empty((n_draw, n_depth)) for _ in range(3))
        force_error, change_error = (np.empty((n_draw, n_depth, N_ERROR_MODES)) for _ in range(2))
        for first in range(0, n_draw, _CHUNK):
            part = slice(first, first + _CHUNK)
            touching = depths[part] > 0
            paths = self._paths(groups[part], np.where(touching, depths[part] / radius[part], 1e-12))
            force[part] = np.where(touching, paths.force, 0.0)
            contact[part] = np.where(touching, paths.contact_radius, 0.0)
            change[part] = np.where(touching, paths.change, 0.0)
            sd_f, sd_c = self._error(groups[part], paths)
            terms = depth_terms(np.maximum(paths.s, PATH[0]))
            force_error[part] = (force[part] * sd_f)[..., None] * (terms @ self.force_modes.T)
            change_error[part] = np.where(touching, paths.change_scale * sd_c, 0.0)[..., None] * (
                terms @ self.capacitance_modes.T
            )
        scale = mu * radius**2
        response = Response(
            depth=depths,
            force=scale * force,
            contact_radius=radius * contact,
            capacitance=c0[:, None] * (1 + change),
            rest_capacitance=c0,
            force_error=scale[..., None] * force_error,
            capacitance_error=c0[:, None, None] * change_error,
        )
        return response if design.is_batch else response.draw(0)

    def _paths(self, groups: Values, depth: Values) -> _Paths:
        """Curves at depths over R (n_draw, n_depth), for groups (n_draw, 6); complex where either is."""
        s = np.sqrt(depth / smooth_end(self._thinned(groups))[:, None])
        terms = depth_terms(s)
        mechanics = self.mechanics(mechanical_features(groups))
        coefficients = np.concatenate([mechanics, self.capacitance(electric_features(groups))], axis=1)
        logs = terms @ coefficients.reshape(-1, 3, N_DEPTH_TERMS).swapaxes(1, 2)
        plain = (depth / (groups[:, WIDTH] * groups[:, DISC])[:, None]) ** 2 + CHANGE_SCALE
        change_scale = plain * np.exp(s * s * logs[..., 2])
        return _Paths(
            force=closed_force(groups, depth) * np.exp(s * logs[..., 0]),
            contact_radius=np.sqrt(depth) * np.exp(s * logs[..., 1]),
            change=change_scale - CHANGE_SCALE,
            s=s,
            change_scale=change_scale,
        )

    def _error(self, groups: FloatArray, paths: _Paths) -> tuple[FloatArray, FloatArray]:
        """Standard deviations (n_draw, n_depth) of log F and of log(C/C0 - 1 + delta)."""
        weights = error_weights(paths.s)
        out = []
        for network, features in ((self.force_sd, mechanical_features), (self.capacitance_sd, electric_features)):
            out.append(np.exp((weights @ network(features(groups))[..., None])[..., 0]))
        # The error is known from `PATH` on; nearer to first touch there is less and less to be wrong about.
        return out[0], out[1] * np.minimum(paths.s / PATH[0], 1.0)

    def own_error(self, groups: FloatArray) -> FloatArray:
        """Rms along the path of the sd it states of log F and of log(C/C0 - 1 + delta), (n, 2), for groups (n, 6)."""
        logs = (self.force_sd(mechanical_features(groups)), self.capacitance_sd(electric_features(groups)))
        return np.stack([np.sqrt(np.mean(np.exp(2 * x), axis=1)) for x in logs], axis=1)

    def gradients(self, design: Design, depth: FloatArray) -> Gradients:
        """Derivatives of force and capacitance with respect to every parameter and to the indentation, to rounding.

        By complex steps (Squire & Trapp, SIAM Rev. 40 (1998) 110) through closed forms, networks and polynomials.

        Raises
        ------
        OutOfRangeError
            If the surrogate does not cover the design or a depth.
        """
        if why := self.outside(design, depth):
            raise OutOfRangeError(why)
        values = {k: np.asarray(v, dtype=float) for k, v in design.draws().parameters().items()}
        n_draw = values["indenter_radius"].size
        depths = np.broadcast_to(np.asarray(depth, dtype=float), (n_draw, np.shape(depth)[-1]))
        force: dict[str, FloatArray] = {}
        capacitance: dict[str, FloatArray] = {}
        for name in (*values, "indentation"):
            # Relative to the parameter, or to the depth: a padding of nothing has no modulus to change.
            step = 1e-30 * np.where(values.get(name, np.ones(1)) > 0, 1.0, 0.0)
            moved = values | ({name: values[name] * (1 + 1j * step)} if name != "indentation" else {})
            at = depths * (1 + (1j * 1e-30 if name == "indentation" else 0j))
            f, c = self._dimensional(moved, at)
            size = depths if name == "indentation" else values[name][:, None]
            good = (size > 0) & (depths > 0)
            for found, into in ((f, force), (c, capacitance)):
                into[name] = np.divide(np.imag(found) / 1e-30, size, out=np.zeros(depths.shape), where=good)
        if not design.is_batch:
            force, capacitance = ({k: v[0] for k, v in d.items()} for d in (force, capacitance))
        return Gradients(force, capacitance)

    def _dimensional(self, values: Mapping[str, Values], depth: Values) -> tuple[Values, Values]:
        """Force [N] and capacitance [F] (n_draw, n_depth) in complex arithmetic."""
        radius = values["indenter_radius"][:, None]
        groups = domain.groups_from(values).astype(complex)
        touching = np.real(depth) > 0
        paths = self._paths(groups, np.where(touching, depth / radius, 1e-12))
        area = np.pi * values["electrode_radius"] ** 2
        c0 = 2 * VACUUM_PERMITTIVITY * values["relative_permittivity"] * area / values["dielectric_thickness"]
        force = values["young_modulus"][:, None] / 3 * radius**2 * np.where(touching, paths.force, 0.0)
        return force, c0[:, None] * (1 + np.where(touching, paths.change, 0.0))

    def save(self, path: Path) -> None:
        """Write as npz; nothing in it is executed on reading."""
        arrays: dict[str, Any] = {}
        for name in _NETWORKS:
            arrays |= getattr(self, name).arrays(name)
        np.savez_compressed(
            path,
            format=_FORMAT,
            force_modes=self.force_modes,
            capacitance_modes=self.capacitance_modes,
            provenance=np.array(json.dumps(dict(self.provenance))),
            **arrays,
        )


_NETWORKS = ("end", "mechanics", "capacitance", "force_sd", "capacitance_sd")


@dataclass(frozen=True, eq=False)
class Gradients:
    """Derivatives by parameter name, in SI: [N] and [F] per unit of the parameter, of the shape of the response's arrays.

    `indentation` is among the names. A parameter that is zero (no padding) has the derivative zero here.
    """

    force: dict[str, FloatArray]
    capacitance: dict[str, FloatArray]


def error_weights(s: FloatArray) -> FloatArray:
    """Weights (..., n_point) of a linear interpolation between `ERROR_POINTS`, constant beyond them."""
    step = ERROR_POINTS[1] - ERROR_POINTS[0]
    at = np.clip((s - ERROR_POINTS[0]) / step, 0, ERROR_POINTS.size - 1)
    return np.asarray(np.maximum(0.0, 1 - np.abs(at[..., None] - np.arange(ERROR_POINTS.size))), dtype=float)


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
    networks = {name: network_from(data, name) for name in _NETWORKS}
    return Surrogate(
        **networks,
        force_modes=data["force_modes"],
        capacitance_modes=data["capacitance_modes"],
        provenance=json.loads(str(data["provenance"])),
    )

"""A calibration problem in, its log posterior written anew for JAX out, as gradient-based samplers of other people need it.

The formulas are those of `calib.problem` and `models.surrogate`, where they are explained; what is missing here: readings that
have to be looked up on a loading curve, other laws than the neo-Hookean one, a padding of its own modulus, and electrodes of a
radius that is not known. That both say the same: `python benchmarks/sampling.py port`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import astuple, dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import erfinv, ndtr, ndtri

from calib.lab import Sweep
from calib.priors import HalfNormal, LogNormal, Normal, Prior, TruncatedNormal, Uniform
from calib.problem import Problem
from calib.problem.plan import ChannelPlan, SweepPlan, present
from calib.problem.repeats import repeats_of
from calib.problem.values import lookup
from models.sensor import VACUUM_PERMITTIVITY
from models.surrogate.coordinates import N_DEPTH_TERMS, N_MECHANICAL, S_END
from models.surrogate.domain import DEPTH, PATH, bounds
from models.surrogate.network import Network
from models.surrogate.pressed import CHANGE_SCALE, N_ERROR_TERMS, N_MODE_TERMS
from models.surrogate.shapes import FIRST_TOUCH
from models.surrogate.surrogate import Surrogate

jax.config.update("jax_enable_x64", True)

#: Scalars and arrays of JAX; those of one draw, as batches are made by `jax.vmap`.
_Array = Any


def log_posterior_of(problem: Problem) -> Callable[[_Array], _Array]:
    """Write the log posterior of a problem as a function of z (n_unknown,) that JAX can compile and differentiate.

    Parameters
    ----------
    problem : that is to be sampled.

    Returns
    -------
    The function, to the same constant as `calib.problem.log_posterior`; -inf for a draw that is not covered.

    Raises
    ------
    ValueError
        If the problem is of a kind that is not written here.
    """
    forward = problem.forward
    sweeps_tied = all(not channel.needs_curve for plan in problem.plans for channel in plan.channels.values())
    known = {"young_modulus", "sensor_thickness", "padding_thickness", "dielectric_thickness", "relative_permittivity"}
    named = {p.parameter for p in problem.parameters} | {name.split("[")[0] for name in problem.fixed}
    if not (isinstance(forward, Surrogate) and forward.base is None and sweeps_tied and known <= named):
        raise ValueError("only a surrogate without stiffening, and sweeps whose depths the records hold, are written for JAX")
    if any(len(repeats.places) > 1 for repeats in repeats_of(problem.plans)):
        raise ValueError("presses that repeat each other are not written for JAX")
    if named & {"padding_young_modulus", "electrode_radius", "stiffening"} or problem.experiment.friction_coefficient:
        raise ValueError("a padding of its own modulus, an electrode radius and friction are not written for JAX")

    def log_posterior(z: _Array) -> _Array:
        values = {p.name: _value(p.prior, z[k]) for k, p in enumerate(problem.parameters)} | dict(problem.fixed)
        groups, radius = zip(*(_groups(problem, values, plan.sweep) for plan in problem.plans), strict=True)
        curves = _curves(forward, jnp.stack(groups))
        parts = []
        possible = jnp.all(curves.inside)
        for k, (plan, r) in enumerate(zip(problem.plans, radius, strict=True)):
            for name, channel in plan.channels.items():
                depth = _depth(values, plan, channel)
                possible &= jnp.max(depth) <= curves.limit[k] * r
                parts.append(_density(forward, curves, k, values, plan.sweep, name, channel, depth))
        total = jnp.sum(jnp.stack(parts)) - 0.5 * jnp.sum(z**2)
        return jnp.where(possible & jnp.isfinite(total), total, -jnp.inf)

    return log_posterior


def _value(prior: Prior, z: _Array) -> _Array:
    """See `Prior.value_at` of each kind."""
    match prior:
        case Normal():
            return prior.mean + prior.sd * z
        case LogNormal():
            return prior.median * jnp.exp(np.log(prior.factor) * z)
        case HalfNormal():
            # Each half by the form that does not subtract from one; the other one is kept away from where it has no slope.
            lower = np.sqrt(2) * erfinv(ndtr(jnp.minimum(z, 0.0)))
            return prior.scale * jnp.where(z < 0, lower, -ndtri(ndtr(-jnp.maximum(z, 0.0)) / 2))
        case Uniform():
            return prior.low + (prior.high - prior.low) * ndtr(z)
        case TruncatedNormal():
            a, b = (prior.low - prior.mean) / prior.sd, (prior.high - prior.mean) / prior.sd
            lower = ndtr(a) * ndtr(-z) + ndtr(b) * ndtr(z)
            upper = ndtr(-a) * ndtr(-z) + ndtr(-b) * ndtr(z)
            return prior.mean + prior.sd * jnp.where(
                lower < upper, ndtri(jnp.minimum(lower, 0.5)), -ndtri(jnp.minimum(upper, 0.5))
            )
    raise ValueError(f"priors of the kind {type(prior).__name__}{astuple(prior)} are not written for JAX")


def _of(values: Mapping[str, _Array], parameter: str, sweep: Sweep) -> _Array:
    found = lookup(values, parameter, sweep.specimen, sweep.name)
    return 0.0 if found is None else found


def _groups(problem: Problem, values: Mapping[str, _Array], sweep: Sweep) -> tuple[_Array, float]:
    """The six groups of `models.surrogate.domain` and the radius of the ball [m]."""
    radius, disc = sweep.indenter_radius, problem.experiment.sensor_radius
    thickness = _of(values, "sensor_thickness", sweep)
    padding = _of(values, "padding_thickness", sweep)
    gap = _of(values, "dielectric_thickness", sweep) / thickness
    return jnp.stack([thickness / radius, padding / radius, disc / radius, 1.0, gap, 1.0]), radius


@dataclass(frozen=True, eq=False)
class _Curves:
    """See `models.surrogate.pressed`, one row for each sweep; `limit` and `reach` over R."""

    groups: _Array
    inside: _Array
    limit: _Array
    reach: _Array
    coefficients: _Array
    error_terms: _Array


def _curves(forward: Surrogate, groups: _Array) -> _Curves:
    """See `models.surrogate.surrogate`."""
    slack = 1e-9
    h_s, h_p, a, modulus, gap, share = groups.T
    ratios = {"h_s/R": h_s, "h_p/R": h_p, "a/R": a, "h_p/h_s": h_p / h_s, "a/h_s": a / h_s, "h_p/a": h_p / a}
    ratios |= {"E_p/E": modulus, "t_d/h_s": gap, "a_e/a": share}
    bounded = [(ratios[bound.name], bound) for bound in bounds(forward.family)]
    inside = [(x >= b.low - slack * abs(b.low)) & (x <= b.high * (1 + slack)) for x, b in bounded]
    h, width = h_s + h_p, share * a
    logs = jnp.log(jnp.stack([h_s, h_p / h_s + 0.3, h_p + 0.03, a, modulus, h, a / h], axis=1))
    own = [jnp.log(width), jnp.log(width / h), jnp.log(share), share**4, gap]
    features = jnp.concatenate([logs, 1 / a[:, None] ** 2, jnp.stack(own, axis=1)], axis=1)
    mechanical = features[:, :N_MECHANICAL]
    thinned = h * jnp.exp(_network(forward.end, mechanical)[:, 0])
    mechanics, capacitance = _network(forward.mechanics, mechanical), _network(forward.capacitance, features)
    error = [_network(forward.force_sd, mechanical), _network(forward.capacitance_sd, features)]
    return _Curves(
        groups,
        jnp.all(jnp.stack(inside), axis=0) & (gap <= 0.5 * (1 + slack)),
        jnp.minimum(DEPTH, thinned),
        (DEPTH**-8.0 + thinned**-8.0) ** (-1 / 8),
        jnp.concatenate([mechanics, capacitance], axis=1).reshape(-1, 3, N_DEPTH_TERMS),
        jnp.stack(error, axis=1),
    )


def _network(network: Network, x: _Array) -> _Array:
    *hidden, last = (layer.astype(float) for layer in network.layers)
    a = (x - network.centre) / network.width
    for layer in hidden:
        a = jnp.tanh(a @ layer[:-1] + layer[-1])
    return a @ last[:-1] + last[-1]


def _depth(values: Mapping[str, _Array], plan: SweepPlan, channel: ChannelPlan) -> _Array:
    """Equation (1) of `calib.problem.measurement`, (n_point,)."""
    sweep, points = plan.sweep, channel.points
    if channel.tie == "clock":
        track = present(sweep.track)
        time = present(points.time) + _of(values, "clock_offset", sweep)
        index = jnp.clip(jnp.searchsorted(jnp.asarray(track.time), time, method="compare_all") - 1, 0, track.time.size - 2)
        start, end = jnp.asarray(track.time)[index], jnp.asarray(track.time)[index + 1]
        weight = jnp.clip((time - start) / (end - start), 0.0, 1.0)
        columns = (jnp.asarray(track.displacement), jnp.asarray(track.force))
        reading, load = (c[index] + weight * (c[index + 1] - c[index]) for c in columns)
    else:
        reading, load = present(points.displacement), present(channel.load)
    return reading - _of(values, "contact_offset", sweep) - _of(values, "machine_compliance", sweep) * load


def _density(
    forward: Surrogate,
    curves: _Curves,
    k: int,
    values: Mapping[str, _Array],
    sweep: Sweep,
    name: str,
    channel: ChannelPlan,
    depth: _Array,
) -> _Array:
    """Log density of a channel's readings: `models.surrogate.shapes` and (2) to (4) of `calib.problem.measurement`."""
    radius, points = sweep.indenter_radius, channel.points
    touching = depth > 0
    d = jnp.where(touching, depth / radius, FIRST_TOUCH)
    s = jnp.sqrt(d / curves.reach[k])
    terms = _terms(s)
    groups, coefficients = curves.groups[k], curves.coefficients[k]
    closed = _closed_force(groups, d)
    relative = jnp.exp(curves.error_terms[k, 0 if name == "force" else 1] @ terms[:N_ERROR_TERMS])
    if name == "force":
        ideal = (
            closed * jnp.exp(s * (coefficients[0] @ terms)) * (_of(values, "young_modulus", sweep) / 3 * radius**2) * touching
        )
        sd, signal, zero, modes = ideal * relative, ideal, "load_zero", forward.force_modes
    else:
        area = np.pi * (float(radius) * groups[2]) ** 2
        gap = _of(values, "dielectric_thickness", sweep)
        c0 = 2 * VACUUM_PERMITTIVITY * _of(values, "relative_permittivity", sweep) * area / gap
        change = _closed_change(groups, d, closed) * jnp.exp(coefficients[2] @ terms)
        signal = change * c0 * touching
        ideal = c0 + signal
        sd = (change + CHANGE_SCALE) * relative * jnp.minimum(s / PATH[0], 1.0) * c0 * touching
        zero, modes = "parasitic_capacitance", forward.capacitance_modes
    error = sd * (modes @ terms[:N_MODE_TERMS])
    own_sd = _of(values, f"{name}_discrepancy", sweep) * signal
    correlation = present(channel.correlation)  # no press repeats another
    variance = _of(values, f"{name}_noise", sweep) ** 2 / points.n_effective + own_sd**2 * correlation.rest
    residual = points.value - ideal - _of(values, zero, sweep)
    columns = jnp.concatenate([error, own_sd * correlation.modes.T, residual[None]]) / jnp.sqrt(variance)
    diagonal = jnp.diagonal(jnp.linalg.cholesky(columns @ columns.T + jnp.eye(columns.shape[0])))
    log_det = jnp.sum(jnp.log(variance)) + 2 * jnp.sum(jnp.log(diagonal[:-1]))
    return -0.5 * (log_det + diagonal[-1] ** 2 - 1.0 + points.value.size * np.log(2 * np.pi))


def _terms(s: _Array) -> _Array:
    """See `models.surrogate.coordinates.depth_terms`; (n, n_depth)."""
    x = 2 / S_END * s - 1
    terms = [jnp.ones_like(x), x]
    while len(terms) < N_DEPTH_TERMS:
        terms.append(2 * x * terms[-1] - terms[-2])
    return jnp.stack(terms)


def _closed_force(groups: _Array, depth: _Array) -> _Array:
    """See `models.surrogate.coordinates.closed_force`."""
    h_s, h_p, modulus = groups[0], groups[1], groups[3]
    contact = jnp.sqrt(depth)
    sensor, both = _layer_weight(h_s / contact), _layer_weight((h_s + h_p) / contact)
    deep, thin = 1 - sensor / both, 1 - (h_s / (h_s + h_p)) ** 3
    young_deep, young_thin = (3 / (1 - share + share / modulus) for share in (deep, thin))
    chi = contact / (h_s + h_p)
    return 16 / 9 * depth * contact * (young_deep * (1 + chi * (1.133 + chi * 1.497)) + young_thin * 1.469 * chi**3)


def _layer_weight(ratio: _Array) -> _Array:
    return 2 / np.pi * jnp.arctan(ratio) - ratio / (np.pi * (1 + ratio**2))


def _closed_change(groups: _Array, depth: _Array, force: _Array) -> _Array:
    """See `models.surrogate.coordinates.closed_change`."""
    h_s, h_p, modulus = groups[0], groups[1], groups[3]
    electrode, h = groups[6] * groups[2], h_s + h_p
    reach = electrode / (2.5 * h)
    outflow = 0.15 * force * modulus ** (-0.55 * h_p / h) / (1 + reach**3)
    return (depth**2 + outflow) / electrode**2

"""A calibration problem in, coordinates in which its sharpest ridge is straight, and the way to theta and back, out.

Readings of capacitance pin C0 + C_p of a specimen to a few parts in 1e5, while permittivity and thickness of the dielectric,
C0 = 2 eps_0 eps_r pi a_e^2 / t_d, are each known to some percent: in the priors' coordinates the posterior is a thin, curved
sheet, along which straight steps leave it at once. So for each specimen one coordinate is exchanged for

    c = (log(g_C C0 + C_p) - log C_seen) / w,                                                                        (1)

g_C the gain of the LCR meter, 1 unless it is unknown, C_seen and w constants: a reading, and the prior's sd of the logarithm,
so that c is about as wide as theta. Which one: the thickness of the dielectric where it is unknown; where it follows from the
sensor's, the permittivity (for each specimen that has one of its own, else for the first) or the sensor's thickness (for the
others). All else stays as it is in theta. On 20 parameters of two specimens the exchange brings the autocorrelation time of the
permittivity from 360 steps to 90.

Of many specimens each has its own coordinate exchanged, the first one, too: so given what they share the specimens stay
independent of each other, and are sampled as such (`Coordinates.scopes`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np

from calib.catalogue import UnknownName
from calib.problem import Problem, Scopes, log_posterior, log_posterior_parts, lookup, nominal_zero, scopes_of, values_at
from models.sensor import VACUUM_PERMITTIVITY, FloatArray

# What the capacitance of a specimen at rest, and what is read of it, depends on.
_IN_CAPACITANCE = (
    "dielectric_thickness",
    "sensor_thickness",
    "electrode_radius",
    "relative_permittivity",
    "sensor_radius",
    "parasitic_capacitance",
    "capacitance_gain",
)

#: From so many specimens on they are sampled as independent of each other, given what they share. Fewer are sampled all at
#: once: given the value and the spread of their lot, specimens that are alike move together only by as little as they differ,
#: and a proposal of all of them is not held up by that. The draws that tell it grow as the square of the number of unknowns.
MANY_SPECIMENS = 7

#: Unknowns of a sweep that its readings show at a glance.
CONTACT = ("contact_offset", "load_zero")

# Step of differences in theta, and prior draws from which w of (1) is computed.
_STEP = 1e-4
_N_DRAW = 1024


@dataclass(frozen=True)
class Exchange:
    """One coordinate of theta, number `column`, exchanged for c of a specimen. `power` is that of the parameter in C0."""

    column: int
    specimen: str
    power: int
    seen: float
    width: float = 1.0


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Coordinates x in which the posterior is easier to sample than in theta, and the way to theta and back.

    Attributes
    ----------
    problem : that is sampled.
    exchanges : the coordinates of theta that are replaced, in the order in which theta is put together again.
    scopes : which coordinates belong to which specimen, given the shared ones; all are shared where specimens are few.
    """

    problem: Problem
    exchanges: tuple[Exchange, ...]
    scopes: Scopes

    def to_theta(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Turn coordinates x (n_draw, n_parameter) into theta, and give log |d theta / d x| (n_draw,) there.

        Where no value of the exchanged parameter gives the wanted capacitance, theta is nan and the logarithm -inf. Elsewhere
        the value is that at z = 0 times the ratio of the wanted to the resulting C0 to the power of +-1.
        """
        theta, log_slopes = self.to_theta_by_exchange(x)
        return theta, np.sum(log_slopes, axis=1)

    def to_theta_by_exchange(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As `to_theta`, the logarithm as a sum over the `exchanges`, (n_draw, n_exchange)."""
        theta = x.copy()
        log_slopes = np.zeros((x.shape[0], len(self.exchanges)))
        # Far out on a ladder of steps an unknown may be as large as no number is, or nothing.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            for k, e in enumerate(self.exchanges):
                prior, median = self.problem.parameters[e.column].prior, self._medians[k]
                theta[:, e.column] = 0.0
                c0, parasitic = self._capacitances(theta, e.specimen)
                total = e.seen * np.exp(x[:, e.column] * e.width)
                wanted = total - parasitic
                possible = wanted > 0
                value = median * (np.where(possible, wanted, c0) / c0) ** e.power
                low, high = prior.support
                possible &= (value > low) & (value < high)
                z = prior.to_normal(np.where(possible, value, median))
                possible &= np.isfinite(z)
                z = np.where(possible, z, 0.0)
                # d log(value) / d log(total) = power total / wanted; the prior's own map z -> value by central differences.
                above, below = prior.ppf_normal(np.stack([z + _STEP, z - _STEP]))
                slope = (above - below) / (2 * _STEP)
                step = np.log(value * total / wanted * e.width / slope)
                log_slopes[:, k] = np.where(possible & np.isfinite(step), step, -np.inf)
                theta[:, e.column] = np.where(possible, z, np.nan)
        return theta, log_slopes

    def from_theta(self, theta: FloatArray) -> FloatArray:
        """Turn theta into coordinates x (n_draw, n_parameter), the inverse of `to_theta`."""
        x = theta.copy()
        for e in self.exchanges:
            c0, parasitic = self._capacitances(theta, e.specimen)
            x[:, e.column] = np.log(np.maximum(c0 + parasitic, 1e-3 * c0) / e.seen) / e.width
        return x

    def nominal(self) -> FloatArray:
        """A place to begin at, (n_parameter,): the priors' medians, contact and load zero where the readings show them."""
        theta = np.zeros((1, len(self.problem.parameters)))
        columns = {name: k for k, name in enumerate(self.problem.names)}
        for sweep in self.problem.sweeps:
            for quantity, value in zip(CONTACT, nominal_zero(sweep), strict=True):
                name = str(UnknownName(quantity, sweep.specimen, sweep.name))
                if name in columns:
                    z = self.problem.parameters[columns[name]].prior.to_normal(value)
                    theta[0, columns[name]] = z if np.isfinite(z) else 0.0
        return np.asarray(self.from_theta(theta)[0], dtype=float)

    def log_density(self, x: FloatArray) -> FloatArray:
        """Log posterior density in the coordinates x, up to a constant, (n_draw,)."""
        theta, log_jacobian = self.to_theta(x)
        possible = np.isfinite(log_jacobian)
        if np.any(possible):
            log_jacobian[possible] += log_posterior(self.problem, theta[possible])
        return log_jacobian

    def log_parts(self, x: FloatArray, power: float = 1.0) -> FloatArray:
        """Log density of prior times likelihood to a power, in parts: of what is shared, then of each specimen given that.

        Parameters
        ----------
        x : (n_draw, n_parameter).
        power : of the likelihood, 1 for the posterior.

        Returns
        -------
        (n_draw, 1 + n_specimen), in the coordinates x; -inf for a specimen where it has none.
        """
        theta, log_slopes = self.to_theta_by_exchange(x)
        # Far out on a ladder of steps an unknown may be as large as no number is.
        with np.errstate(over="ignore", invalid="ignore"):
            parts = log_posterior_parts(self.problem, np.where(np.isfinite(theta), theta, 0.0))
            own = parts.prior + power * parts.likelihood
            order = {name: k for k, name in enumerate(self.scopes.specimens)}
            for k, e in enumerate(self.exchanges):
                own[:, order[e.specimen]] += log_slopes[:, k]
            found = np.concatenate([parts.prior_shared[:, None], own], axis=1)
        return np.where(np.isfinite(found), found, -np.inf)

    def _capacitances(self, theta: FloatArray, specimen: str) -> tuple[FloatArray, FloatArray]:
        """C0 [F] of a specimen as the LCR meter reads it, and the parasitic capacitance [F], (n_draw,)."""
        return capacitance_at_rest(
            values_at(self.problem, theta, _in_capacitance(specimen)), specimen, self.problem.experiment.sensor_radius
        )

    @cached_property
    def _medians(self) -> tuple[FloatArray, ...]:
        """Values at z = 0 of the parameters of the `exchanges`."""
        return tuple(self.problem.parameters[e.column].prior.ppf_normal(0.0) for e in self.exchanges)


@cache
def _in_capacitance(specimen: str) -> tuple[str, ...]:
    """Names of all unknowns that the C0 of a specimen may depend on."""
    return tuple(dict.fromkeys(str(name) for p in _IN_CAPACITANCE for name in UnknownName(p, specimen).wider))


def capacitance_at_rest(values: Mapping[str, FloatArray], specimen: str, sensor_radius: float) -> tuple[FloatArray, FloatArray]:
    """C0 [F] of a specimen as the LCR meter reads it, g_C C0 of (1), and the parasitic capacitance [F], (n_draw,).

    Parameters
    ----------
    values : name -> SI values (n_draw,).
    specimen : its name.
    sensor_radius : [m], of the disc where that is no unknown.

    Raises
    ------
    KeyError
        If the values say no thickness or no permittivity of it.
    """
    thickness, half, radius, permittivity, disc, parasitic, gain = (lookup(values, p, specimen) for p in _IN_CAPACITANCE)
    if thickness is None and half is not None:
        thickness = half / 2
    if thickness is None or permittivity is None:
        raise KeyError(f"specimen {specimen!r} has no thickness or permittivity")
    disc = np.full(permittivity.size, sensor_radius) if disc is None else disc
    area = np.pi * (disc if radius is None else radius) ** 2
    c0 = (1.0 if gain is None else gain) * 2 * VACUUM_PERMITTIVITY * permittivity * area / thickness
    return np.asarray(c0, dtype=float), np.zeros(permittivity.size) if parasitic is None else parasitic


def coordinates(problem: Problem) -> Coordinates:
    """Choose the coordinates to sample a problem in, so that its sharpest ridge is straight and walkers move along it fast.

    They are those of the module; where there is no capacitance, those of theta.
    """
    columns = {name: k for k, name in enumerate(problem.names)}
    specimens = list(dict.fromkeys(s.specimen for s in problem.sweeps))
    many = len(specimens) >= MANY_SPECIMENS
    found: list[Exchange] = []
    for specimen in specimens:
        own_sweeps = [s for s in problem.sweeps if s.specimen == specimen]
        readings = [s.channels["capacitance"].value for s in own_sweeps if "capacitance" in s.channels]
        if not readings:
            continue
        own = str(UnknownName("dielectric_thickness", specimen))
        choices = [(own, -1), (str(UnknownName("relative_permittivity", specimen)), 1)]
        choices += [] if many else [("relative_permittivity", 1)]
        choices += [(str(UnknownName("sensor_thickness", specimen)), -1)] if own not in problem.fixed else []
        taken = {e.column for e in found}
        free = [(columns[name], power) for name, power in choices if name in columns and columns[name] not in taken]
        if free:
            found.append(Exchange(free[0][0], specimen, free[0][1], float(np.min(readings[0]))))
    # The permittivity first: the thicknesses that make up a wanted C0 depend on it.
    scopes = scopes_of(problem) if many else Scopes(np.arange(len(problem.parameters)), {})
    plain = Coordinates(problem, tuple(sorted(found, key=lambda e: -e.power)), scopes)
    draws = np.random.default_rng(20190304).standard_normal((_N_DRAW, len(problem.parameters)))
    width = np.std(plain.from_theta(draws), axis=0)
    return replace(plain, exchanges=tuple(replace(e, width=float(width[e.column])) for e in plain.exchanges))

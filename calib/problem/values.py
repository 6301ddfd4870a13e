"""Values of the unknowns: from standard-normal coordinates z to SI by name, to what holds for a sweep, to designs."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import cache
from typing import Protocol

import numpy as np

from calib.catalogue import UnknownName
from calib.experiment import Experiment
from calib.lab import Sweep
from calib.priors import default_prior
from calib.problem.unknowns import ParameterInfo, UnknownTable
from models.sensor import Design, FloatArray, Scalar, design_from


class Unknowns(Protocol):
    """Anything that has unknowns to give values to: a `Problem` or a `Posterior`."""

    @property
    def parameters(self) -> tuple[ParameterInfo, ...]:
        """The unknowns that are free, in the order of z."""
        ...

    @property
    def fixed(self) -> Mapping[str, float]:
        """Name -> value [SI] of the unknowns that a prior fixes."""
        ...

    @property
    def table(self) -> UnknownTable:
        """The free unknowns made ready to be given values."""
        ...


class Calibrated(Protocol):
    """Anything that carries an experiment and its sweeps: a `Problem` or a `Posterior`."""

    @property
    def experiment(self) -> Experiment:
        """What is calibrated."""
        ...

    @property
    def sweeps(self) -> tuple[Sweep, ...]:
        """The reduced data of the experiment."""
        ...


def values_at(of: Unknowns, z: FloatArray, only: Collection[str] | None = None) -> dict[str, FloatArray]:
    """The values of the unknowns at standard-normal coordinates: the one way from what is sampled to what it means.

    Value = F^-1(Phi(z)) with F the distribution function of the unknown's prior.

    Parameters
    ----------
    of : a problem or a posterior.
    z : (n_draw, n_unknown), in the order of `of.parameters`.
    only : names that are wanted; default all.

    Returns
    -------
    Name -> SI values (n_draw,), fixed ones included.
    """
    table = of.table
    if only is None:
        values = dict(zip(table.columns, table.priors.ppf_normal(z.T), strict=True))
        return values | {name: np.full(z.shape[0], value) for name, value in of.fixed.items()}
    free = {name: table.columns[name] for name in only if name in table.columns}
    values = {name: of.parameters[k].prior.ppf_normal(z[:, k]) for name, k in free.items()}
    return values | {name: np.full(z.shape[0], of.fixed[name]) for name in only if name in of.fixed}


def columns_at(of: Unknowns, z: FloatArray) -> FloatArray:
    """Give the values of the free unknowns as an array, SI, for storing and summarising draws.

    Parameters
    ----------
    of : a problem or a posterior.
    z : (n_draw, n_unknown), in the order of `of.parameters`.

    Returns
    -------
    (n_draw, n_unknown), the columns in the order of `of.parameters`.
    """
    return np.ascontiguousarray(of.table.priors.ppf_normal(z.T).T)


def coordinates_of(of: Unknowns, columns: FloatArray) -> FloatArray:
    """Find the standard-normal coordinates at which the unknowns have given values: the inverse of `columns_at`.

    Parameters
    ----------
    of : a problem or a posterior.
    columns : SI values (n_draw, n_unknown).

    Returns
    -------
    z (n_draw, n_unknown); infinite at a bound of a prior, nan outside.
    """
    return np.stack([p.prior.to_normal(columns[:, k]) for k, p in enumerate(of.parameters)], axis=1)


def lookup(values: Mapping[str, FloatArray], parameter: str, specimen: str = "", sweep: str = "") -> FloatArray | None:
    """Find the value of a quantity that holds for a sweep: its own, else its specimen's, else the one that all share.

    Parameters
    ----------
    values : name -> SI values (n_draw,).
    parameter : which quantity.
    specimen, sweep : empty for the shared one.

    Returns
    -------
    (n_draw,), or None if there is none.
    """
    for name in _where_to_look(parameter, specimen, sweep):
        if (found := values.get(name)) is not None:
            return found
    return None


@cache
def _where_to_look(parameter: str, specimen: str, sweep: str) -> tuple[str, ...]:
    """Names under which a value may stand, kept as the likelihood asks for them at every evaluation."""
    return tuple(str(name) for name in UnknownName(parameter, specimen, sweep).wider)


def design_columns(known: Calibrated, values: Mapping[str, FloatArray], sweep: Sweep) -> dict[str, FloatArray | None]:
    """Find the unknowns that make the design of a sweep: sweeps for which these are the same columns share their designs.

    Parameters
    ----------
    known : a `Problem` or a `Posterior`.
    values : name -> SI values (n_draw,), fixed ones included.
    sweep : one that was pressed.

    Returns
    -------
    Quantity -> SI values (n_draw,), None for one that is not among the values.

    Raises
    ------
    KeyError
        If a value that the design needs is not there.
    """
    experiment = known.experiment
    needed = ["young_modulus", "sensor_thickness", "padding_thickness"]
    needed += ["padding_young_modulus"] if experiment.padding_material != "sensor" else []
    needed += ["padding_poisson_ratio"] if experiment.padding_material == "foam" else []
    needed += ["stiffening"] if experiment.law == "gent" else []
    optional = ["relative_permittivity", "electrode_radius", "dielectric_thickness"]
    optional += ["sensor_radius", "indenter_radius", "friction_coefficient", "base_friction_coefficient"]
    found = {p: lookup(values, p, sweep.specimen, sweep.name) for p in needed + optional}
    for p in needed:
        if found[p] is None:
            raise KeyError(f"{p} of specimen {sweep.specimen!r} is not among {', '.join(values)}")
    return found


def design_values(known: Calibrated, values: Mapping[str, FloatArray], sweep: Sweep) -> dict[str, FloatArray]:
    """Collect the quantities of a design for the draws of one sweep, as `models.sensor.design_from` takes them, unchecked.

    Without capacitance readings nothing electrical was inferred; the permittivity is then the median of its prior.

    Parameters
    ----------
    known : a `Problem` or a `Posterior`.
    values : name -> SI values (n_draw,), fixed ones included.
    sweep : one that was pressed, which also has the radius of the ball, where that is not unknown.

    Returns
    -------
    Quantity -> SI values (n_draw,).

    Raises
    ------
    KeyError
        If a value that the design needs is not there.
    """
    found = {p: v for p, v in design_columns(known, values, sweep).items() if v is not None}
    shape = np.broadcast_shapes(*(np.shape(v) for v in found.values()))
    constant = {"indenter_radius": sweep.indenter_radius, "sensor_radius": known.experiment.sensor_radius}
    constant = {p: value for p, value in constant.items() if p not in found}
    if "relative_permittivity" not in found:
        prior = known.experiment.priors.get("relative_permittivity", default_prior("relative_permittivity"))
        constant["relative_permittivity"] = float(prior.ppf_normal(0.0))
    design = {p: v if v.shape == shape else np.broadcast_to(v, shape) for p, v in found.items()}
    return design | {p: np.full(shape, v) for p, v in constant.items()}


def specimen_design(known: Calibrated, values: Mapping[str, FloatArray], specimen: str, sweep: str = "") -> Design:
    """Turn draws of the unknowns into designs for a forward model: a specimen under the ball of one of its sweeps.

    Parameters
    ----------
    known : a `Problem` or a `Posterior`.
    values : name -> SI values (n_draw,), those that are fixed included, as `thin_draws` gives them.
    specimen, sweep : default the specimen's first sweep.

    Returns
    -------
    One batch of the draws.

    Raises
    ------
    KeyError
        If a value that the design needs is not there, or the specimen or sweep does not exist.
    ValueError
        If a value breaks a rule of a design (see `models.sensor`).
    """
    own = [s for s in known.sweeps if s.specimen == specimen and sweep in ("", s.name)]
    if not own:
        raise KeyError(f"there is no sweep {sweep!r} of a specimen {specimen!r}")
    return designed(design_values(known, values, own[0]), known.experiment)


def designed(values: Mapping[str, Scalar], experiment: Experiment) -> Design:
    """Make a design with the base and the contact of an experiment.

    Parameters
    ----------
    values : quantity -> SI value, as `design_values` gives them.
    experiment : what is calibrated.

    Returns
    -------
    One, or a batch of draws.

    Raises
    ------
    ValueError
        If a value breaks a rule of a design (see `models.sensor`).
    """
    return design_from(values, friction_coefficient=experiment.friction_coefficient, base=experiment.base)

"""An experiment and its sweeps in, the list of unknowns with their priors out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from calib.catalogue import CHANNELS, POOLED, SPREADS, UNKNOWNS, Setting, UnknownName, spread_of, unknowns_of
from calib.experiment import Experiment, Specimen, lot_prior
from calib.lab import Sweep
from calib.priors import Fixed, Prior, StackedPriors, default_prior, stack_priors
from calib.problem.centred import FROM_DATA, noise_default, sweep_defaults
from calib.problem.lots import Lot, lot_of


@dataclass(frozen=True)
class ParameterInfo:
    """One unknown of a problem: what it is called, what is believed of it before the data, and where that belief comes from.

    Attributes
    ----------
    key : its name in parts: which quantity, of which specimen and sweep.
    prior : its distribution before the data.
    origin : where the prior comes from: "experiment file", "default", or a sentence for a default centred on the data.
    """

    key: UnknownName
    prior: Prior
    origin: str = "experiment file"

    @property
    def name(self) -> str:
        """As in results: "young_modulus", "sensor_thickness[sensor 1]", "contact_offset[sensor 1, ball 2]"."""
        return str(self.key)

    @property
    def parameter(self) -> str:
        """Name of the quantity, a key of `calib.catalogue.UNKNOWNS`."""
        return self.key.parameter

    @property
    def specimen(self) -> str:
        """Name of the specimen that the unknown belongs to, empty for an unknown that all specimens share."""
        return self.key.specimen

    @property
    def sweep(self) -> str:
        """Name of the sweep that the unknown belongs to, empty for an unknown that all sweeps of the specimen share."""
        return self.key.sweep

    @property
    def from_data(self) -> bool:
        """Whether centre and width of the prior are what the records show: that the data hardly move it is no reproach."""
        return self.origin.startswith(FROM_DATA)


@dataclass(frozen=True, eq=False)
class UnknownTable:
    """Unknowns made ready to be given values thousands of times.

    Attributes
    ----------
    columns : name -> its number in the order of z.
    priors : of all of them, in that order.
    lots : those that are of one lot, and what is believed of them together, for each quantity; none under complete pooling.
    """

    columns: Mapping[str, int]
    priors: StackedPriors
    lots: tuple[Lot, ...] = ()


def table_of(parameters: Sequence[ParameterInfo], experiment: Experiment) -> UnknownTable:
    """Make unknowns ready to be given values.

    Parameters
    ----------
    parameters : the unknowns, in the order of z.
    experiment : that they are of.
    """
    lots = []
    for quantity in POOLED if experiment.pooling == "partial" else ():
        own = [k for k, p in enumerate(parameters) if p.parameter == quantity and p.specimen]
        if own:
            prior = lot_of(experiment, quantity, [parameters[k].specimen for k in own])
            lots.append(Lot(quantity, prior, np.array(own, dtype=np.int64)))
    stacked = stack_priors([p.prior for p in parameters])
    return UnknownTable({p.name: k for k, p in enumerate(parameters)}, stacked, tuple(lots))


class _OfLots(Protocol):
    """Anything that has lots: a `Problem` or a `Posterior`."""

    @property
    def experiment(self) -> Experiment:
        """What is calibrated."""
        ...

    @property
    def table(self) -> UnknownTable:
        """The free unknowns made ready to be given values."""
        ...


def of_lot(of: _OfLots) -> tuple[ParameterInfo, ...]:
    """What is of a lot, and follows from its specimens, so that it is no unknown of a problem: value and spread of quantities.

    Posteriors list them after the unknowns. Nothing under complete pooling, no spread that is fixed.

    Parameters
    ----------
    of : a problem or a posterior.
    """
    infos = []
    for lot in of.table.lots:
        names = list(dict.fromkeys(UnknownName.parse(n).specimen for n, k in of.table.columns.items() if k in lot.columns))
        _, origin = lot_prior(of.experiment, lot.quantity, names)
        origin += ", and what was measured of specimens" if any(lot.prior.known) else ""
        infos.append(ParameterInfo(UnknownName(lot.quantity), lot.prior.before, origin))
        spread = spread_of(lot.quantity)
        infos.append(_info(UnknownName(spread), of.experiment.priors.get(spread), None))
    return tuple(info for info in infos if not isinstance(info.prior, Fixed))


def list_unknowns(experiment: Experiment, sweeps: Sequence[Sweep]) -> tuple[tuple[ParameterInfo, ...], dict[str, float]]:
    """List all unknowns of an experiment in a fixed order, and the values of those that are fixed.

    Shared ones come first, then those of each specimen, then those of each of its sweeps. An unknown of the catalogue is listed
    if its row's `exists` says so: for example nothing electrical without capacitance readings. Of what is pooled each specimen
    of a lot has a value of its own; see `of_lot` for those of the lot. What is fixed is known, and not pooled.

    Parameters
    ----------
    experiment : with the priors that it names.
    sweeps : its reduced data, which decide what else there is.

    Returns
    -------
    The unknowns that are free, and name -> value [SI] of those that a prior fixes.
    """
    found: list[ParameterInfo] = []
    noises = {f"{channel}_noise": noise_default(channel, sweeps) for channel in CHANNELS}
    pooled = _pooled(experiment, sweeps)
    for parameter in unknowns_of("material", "rig"):
        if parameter in pooled or parameter in SPREADS:
            continue
        given = experiment.priors.get(parameter)
        if UNKNOWNS[parameter].exists(_setting(experiment, sweeps, given)):
            found.append(_info(UnknownName(parameter), given, noises.get(parameter)))
    for specimen in experiment.specimens:
        own = [s for s in sweeps if s.specimen == specimen.name]
        if not own:
            continue
        for parameter in (*(q for q in POOLED if q in pooled and UNKNOWNS[q].scope == "material"), *unknowns_of("specimen")):
            given = specimen.priors.get(parameter, experiment.priors.get(parameter))
            if (prior := pooled.get(parameter, {}).get(specimen.name)) is not None:
                found.append(ParameterInfo(UnknownName(parameter, specimen.name), prior, _origin(specimen, parameter)))
            elif UNKNOWNS[parameter].exists(_setting(experiment, own, given)):
                found.append(_info(UnknownName(parameter, specimen.name), given, None))
        for sweep in own:
            defaults = sweep_defaults(sweep)
            for parameter in unknowns_of("sweep"):
                given = specimen.priors.get(parameter, experiment.priors.get(parameter))
                if UNKNOWNS[parameter].exists(_setting(experiment, [sweep], given)):
                    name = UnknownName(parameter, specimen.name, sweep.name if len(own) > 1 else "")
                    found.append(_info(name, given, defaults.get(parameter)))
    fixed = {i.name: i.prior.value for i in found if isinstance(i.prior, Fixed)}
    spreads = {spread_of(quantity): experiment.priors.get(spread_of(quantity)) for quantity in pooled}
    known = fixed | {name: prior.value for name, prior in spreads.items() if isinstance(prior, Fixed)}
    return tuple(i for i in found if i.name not in fixed), known


def _pooled(experiment: Experiment, sweeps: Sequence[Sweep]) -> dict[str, dict[str, Prior]]:
    """Quantity that is pooled -> name of each specimen that has an unknown value of it, and what is believed of that."""
    found = {}
    for quantity in POOLED if experiment.pooling == "partial" else ():
        names = []
        for specimen in experiment.specimens:
            own = [s for s in sweeps if s.specimen == specimen.name]
            given = specimen.priors.get(quantity, experiment.priors.get(quantity))
            there = bool(own) and UNKNOWNS[quantity].exists(_setting(experiment, own, given))
            if there and not isinstance(given, Fixed):
                names.append(specimen.name)
        if names:
            found[quantity] = dict(zip(names, lot_of(experiment, quantity, names).specimen_priors, strict=True))
    return found


def _origin(specimen: Specimen, parameter: str) -> str:
    """Where what is believed of a specimen of a lot comes from."""
    return "its lot, and what was measured of it" if parameter in specimen.priors else "its lot"


def _setting(experiment: Experiment, sweeps: Sequence[Sweep], given: Prior | None) -> Setting:
    named: Literal["", "prior", "fixed"] = "" if given is None else "fixed" if isinstance(given, Fixed) else "prior"
    return Setting(
        channels=frozenset(c for s in sweeps for c in s.channels),
        ties=frozenset(s.tied_by(c) for s in sweeps for c in s.channels),
        padding=experiment.padding_material,
        law=experiment.law,
        discrepancy=experiment.discrepancy,
        pooling=experiment.pooling,
        given=named,
    )


def _info(name: UnknownName, given: Prior | None, fallback: tuple[Prior, str] | None) -> ParameterInfo:
    if given is not None:
        return ParameterInfo(name, given)
    prior, origin = fallback or (default_prior(name.parameter), "default")
    return ParameterInfo(name, prior, origin)

"""An experiment and its sweeps in, the list of unknowns with their priors out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from calib.catalogue import CHANNELS, POOLED, SPREAD, UNKNOWNS, Setting, UnknownName, unknowns_of
from calib.experiment import Experiment
from calib.lab import Sweep
from calib.priors import Fixed, Prior, StackedPriors, default_prior, stack_priors
from calib.problem.centred import noise_default, sweep_defaults
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


@dataclass(frozen=True, eq=False)
class UnknownTable:
    """Unknowns made ready to be given values thousands of times.

    Attributes
    ----------
    columns : name -> its number in the order of z.
    priors : of all of them, in that order.
    lot : those that are of one lot, and what is believed of them together; None where specimens share one modulus.
    """

    columns: Mapping[str, int]
    priors: StackedPriors
    lot: Lot | None = None


def table_of(parameters: Sequence[ParameterInfo], experiment: Experiment) -> UnknownTable:
    """Make unknowns ready to be given values.

    Parameters
    ----------
    parameters : the unknowns, in the order of z.
    experiment : that they are of.
    """
    believed = lot_of(experiment)
    own = np.array([k for k, p in enumerate(parameters) if p.parameter == POOLED and p.specimen], dtype=np.int64)
    lot = None if believed is None else Lot(believed, own)
    return UnknownTable({p.name: k for k, p in enumerate(parameters)}, stack_priors([p.prior for p in parameters]), lot)


def of_lot(experiment: Experiment) -> tuple[ParameterInfo, ...]:
    """What is of a lot, and follows from its specimens, so that it is no unknown of a problem: its modulus, and its spread.

    Posteriors list them after the unknowns. Nothing where specimens share one modulus, no spread that is fixed.
    """
    believed = lot_of(experiment)
    if believed is None:
        return ()
    found = ((POOLED, believed.modulus), (SPREAD, believed.spread))
    infos = (_info(UnknownName(name), experiment.priors.get(name), (prior, "default")) for name, prior in found)
    return tuple(info for info in infos if not isinstance(info.prior, Fixed))


def list_unknowns(experiment: Experiment, sweeps: Sequence[Sweep]) -> tuple[tuple[ParameterInfo, ...], dict[str, float]]:
    """List all unknowns of an experiment in a fixed order, and the values of those that are fixed.

    Shared ones come first, then those of each specimen, then those of each of its sweeps. An unknown of the catalogue is listed
    if its row's `exists` says so: for example nothing electrical without capacitance readings. Of a lot each specimen has a
    modulus of its own; see `of_lot` for that of the lot.

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
    lot = lot_of(experiment)
    for parameter in unknowns_of("material", "rig"):
        if lot is not None and parameter in (POOLED, SPREAD):
            continue
        given = experiment.priors.get(parameter)
        if UNKNOWNS[parameter].exists(_setting(experiment, sweeps, given)):
            found.append(_info(UnknownName(parameter), given, noises.get(parameter)))
    for specimen in experiment.specimens:
        own = [s for s in sweeps if s.specimen == specimen.name]
        if not own:
            continue
        if lot is not None:
            found.append(ParameterInfo(UnknownName(POOLED, specimen.name), lot.own, "its lot"))
        for parameter in unknowns_of("specimen"):
            given = specimen.priors.get(parameter, experiment.priors.get(parameter))
            if UNKNOWNS[parameter].exists(_setting(experiment, own, given)):
                found.append(_info(UnknownName(parameter, specimen.name), given, None))
        for sweep in own:
            defaults = sweep_defaults(sweep)
            for parameter in unknowns_of("sweep"):
                given = specimen.priors.get(parameter, experiment.priors.get(parameter))
                if UNKNOWNS[parameter].exists(_setting(experiment, [sweep], given)):
                    name = UnknownName(parameter, specimen.name, sweep.name if len(own) > 1 else "")
                    found.append(_info(name, given, defaults.get(parameter)))
    fixed = {i.name: i.prior.value for i in found if isinstance(i.prior, Fixed)}
    if lot is not None and isinstance(lot.spread, Fixed):
        fixed[SPREAD] = lot.spread.value
    return tuple(i for i in found if i.name not in fixed), fixed


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

"""A calibrated lot in draws and the presses of one more specimen in, the unknowns of that specimen, given each draw, out.

A **newcomer** is a specimen of a calibrated lot that had no part in its calibration. What is believed of it before its own data
is what the lot's posterior says of the next specimen. Given a draw j of that posterior, with the value L and the spread tau of
each quantity that is pooled and the rig as it was found, the coordinates x of its pooled quantities (`calib.problem.lots`) and
those z of all else that is its own are independent,

    x_q ~ N(mu_jq, tau_jq^2),   z_k ~ N(0, 1),                                                                         (1)

and its readings follow from them and the draw as in `calib.problem.measurement`. Under complete pooling nothing is pooled by a
spread: material and rig are the draw's, thicknesses are believed of it as of a specimen that it was meant to be like.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from calib.catalogue import CHANNELS, UnknownName, spread_of, unknowns_of
from calib.errors import Fault, InputError
from calib.experiment import Experiment, Specimen
from calib.lab import Sweep
from calib.priors import Fixed, LogNormal, Normal, Prior, TruncatedNormal
from calib.problem.lots import Lot, LotPrior
from calib.problem.measurement import model_sweeps
from calib.problem.plan import SweepPlan, plan_sweeps
from calib.problem.problem import Problem
from calib.problem.readings import SweepModel
from calib.problem.unknowns import ParameterInfo, list_unknowns
from models.response import Forward
from models.sensor import FloatArray, IntArray

# Step of differences in z.
_STEP = 1e-4


@dataclass(frozen=True, eq=False)
class CalibratedLot:
    """What is known of a lot, its material and its rig, in draws: what every newcomer begins with.

    Attributes
    ----------
    experiment : of the calibration.
    values : unknown -> SI values (n_draw,) of what all specimens share, values and spreads of the lot and fixed ones included.
    parameters : what of it is unknown, with what was believed of it before the calibration.
    lots : the quantities that are pooled; none under complete pooling.
    """

    experiment: Experiment
    values: Mapping[str, FloatArray]
    parameters: tuple[ParameterInfo, ...]
    lots: tuple[Lot, ...]

    @property
    def size(self) -> int:
        """How many draws there are."""
        return int(next(iter(self.values.values())).size)


@dataclass(frozen=True, eq=False)
class NewcomerUnknown:
    """An unknown of a newcomer itself.

    Attributes
    ----------
    info : its name, and what is believed of it before its data, by mean and sd where it is pooled.
    prior : that of its z; None where it is pooled.
    of_lot : where it is pooled, what is believed of the lot, and the number of the specimen that it was meant to be like.
    mean, spread : (n_draw,), of (1), for each draw of the lot.
    """

    info: ParameterInfo
    prior: Prior | None
    of_lot: tuple[LotPrior, int] | None
    mean: FloatArray
    spread: FloatArray

    def value(self, coordinate: FloatArray) -> FloatArray:
        """Values [SI] at coordinates x or z, (n,)."""
        if self.of_lot is not None:
            return self.of_lot[0].at(coordinate, self.of_lot[1])
        assert self.prior is not None
        return self.prior.ppf_normal(coordinate)

    def coordinate(self, value: FloatArray) -> FloatArray:
        """The inverse of `value`."""
        if self.of_lot is not None:
            return self.of_lot[0].away_of(value, self.of_lot[1])
        assert self.prior is not None
        return self.prior.to_normal(value)

    def slope(self, coordinate: FloatArray) -> FloatArray:
        """Derivative of the coordinate by the logarithm of the value, (n,)."""
        up, down = self.value(coordinate + _STEP), self.value(coordinate - _STEP)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(2 * _STEP / np.log(up / down), dtype=float)


@dataclass(frozen=True, eq=False)
class Newcomer:
    """One more specimen of a calibrated lot, with its data.

    Attributes
    ----------
    lot : what it begins with.
    experiment : of the newcomer alone, in the lab of the lot.
    sweeps, plans : its presses.
    forward : the model of the sensor.
    own : its own unknowns, in the order of their coordinates.
    fixed : name -> value [SI] of what is known of it.
    """

    lot: CalibratedLot
    experiment: Experiment
    sweeps: tuple[Sweep, ...]
    plans: tuple[SweepPlan, ...]
    forward: Forward
    own: tuple[NewcomerUnknown, ...]
    fixed: Mapping[str, float]

    @property
    def name(self) -> str:
        """Of the specimen."""
        return self.experiment.specimens[0].name

    @cached_property
    def means(self) -> FloatArray:
        """Means of (1), (n_draw, n_own)."""
        return np.stack([own.mean for own in self.own], axis=1)

    @cached_property
    def spreads(self) -> FloatArray:
        """Standard deviations of (1), (n_draw, n_own)."""
        return np.stack([own.spread for own in self.own], axis=1)

    def values(self, coordinates: FloatArray, rows: IntArray) -> dict[str, FloatArray]:
        """Values of all that its readings depend on, by name, SI (n,).

        Parameters
        ----------
        coordinates : of its own unknowns, (n, n_own).
        rows : draws of the lot, (n,).
        """
        own = {one.info.name: one.value(coordinates[:, k]) for k, one in enumerate(self.own)}
        known = {name: np.full(rows.size, value) for name, value in self.fixed.items()}
        return {**{name: column[rows] for name, column in self.lot.values.items()}, **known, **own}

    def respond(self, coordinates: FloatArray, rows: IntArray) -> list[SweepModel]:
        """What the instruments should read in each of its sweeps, for draws of the lot.

        Parameters
        ----------
        coordinates, rows : as in `values`.
        """
        return list(model_sweeps(self, self.forward, self.plans, self.values(coordinates, rows)))

    def log_prior(self, coordinates: FloatArray, rows: IntArray) -> FloatArray:
        """Logarithm of (1), up to a constant, (n,).

        Parameters
        ----------
        coordinates, rows : as in `values`.
        """
        spread = self.spreads[rows]
        away = (coordinates - self.means[rows]) / spread
        return np.asarray(-0.5 * np.sum(away**2, axis=1) - np.sum(np.log(spread), axis=1), dtype=float)

    def given(self, row: int) -> Problem:
        """The problem that is left where a draw of the lot is taken for true: its own unknowns, all else fixed.

        Parameters
        ----------
        row : number of the draw.
        """
        infos = []
        for one in self.own:
            if one.of_lot is None:
                infos.append(one.info)
                continue
            middle, spread = float(one.mean[row]), float(one.spread[row])
            value = float(one.value(np.array(middle)))
            if isinstance(one.of_lot[0].value, LogNormal):
                infos.append(replace(one.info, prior=LogNormal(value, float(np.exp(spread)))))
            else:
                sd = spread * value / (1 + middle)
                infos.append(replace(one.info, prior=TruncatedNormal(value, sd, 0.0, np.inf)))
        known = {name: float(column[row]) for name, column in self.lot.values.items()} | dict(self.fixed)
        alone = replace(self.experiment, pooling="complete")
        return Problem(alone, self.sweeps, self.forward, tuple(infos), known, self.plans)


def template_of(lot: CalibratedLot, like: str | None = None) -> Specimen:
    """The specimen of a lot that newcomers were meant to be like.

    Parameters
    ----------
    lot : the calibrated lot.
    like : its name; None for the first one, if all were meant to be alike.

    Raises
    ------
    InputError
        If there is no such specimen, or they were not meant to be alike.
    """
    specimens = lot.experiment.specimens
    names = ", ".join(s.name for s in specimens)
    if like is not None:
        found = next((s for s in specimens if s.name == like), None)
        if found is None:
            raise InputError(Fault(f'the lot has no specimen "{like}"', advice=f"It has {names}"))
        return found
    pooled = {of.quantity for of in lot.lots}
    for quantity in unknowns_of("specimen"):
        wanted = (
            {s.nominal.get(quantity) for s in specimens} if quantity in pooled else {s.priors.get(quantity) for s in specimens}
        )
        if len(wanted) > 1:
            kind = "were not meant to be alike" if quantity in pooled else "are not believed to be alike before the data"
            advice = f"Say which of them the new ones were meant to be like, --like NAME ({names})"
            if quantity not in pooled:
                advice += '; or calibrate the lot with pooling = "partial", which tells how far specimens differ'
            raise InputError(Fault(f"the specimens of the lot {kind} in {quantity}", lot.experiment.path, advice=advice))
    return specimens[0]


def newcomer_experiment(lot: CalibratedLot, template: Specimen, name: str) -> Experiment:
    """The experiment of one newcomer, in the lab of its lot, whose files are still those of its template.

    What was measured of the template itself, and where its contact was, is not known of the newcomer.

    Parameters
    ----------
    lot : the calibrated lot.
    template : from `template_of`.
    name : of the newcomer.
    """
    pooled = {of.quantity: of for of in lot.lots}
    own = unknowns_of("specimen")
    priors = {q: prior for q, prior in template.priors.items() if isinstance(prior, Fixed) or (q in own and q not in pooled)}
    of_lot = {quantity: of.prior.value for quantity, of in pooled.items()}
    alone = Specimen(name, template.sweeps, priors, dict(template.nominal))
    return replace(lot.experiment, specimens=(alone,), priors={**lot.experiment.priors, **of_lot})


def newcomer_of(lot: CalibratedLot, experiment: Experiment, sweeps: Sequence[Sweep], forward: Forward, like: str) -> Newcomer:
    """Put a newcomer together: its own unknowns, and what is believed of them.

    Parameters
    ----------
    lot : that it belongs to.
    experiment : of the newcomer alone, from `newcomer_experiment`.
    sweeps : its data.
    forward : the model of the sensor.
    like : name of the specimen of the lot that it was meant to be like.

    Raises
    ------
    InputError
        If it was measured in what the lot was not.
    """
    brought = [c for c in CHANNELS if any(c in sweep.channels for sweep in sweeps) and f"{c}_noise" not in lot.values]
    if brought:
        message = f"it was measured in {' and '.join(brought)}, of which the calibration of the lot knows nothing"
        raise InputError(Fault(message, advice="Calibrate the lot with such measurements, too"))
    infos, known = list_unknowns(experiment, sweeps)
    name = experiment.specimens[0].name
    pooled = {of.quantity: of for of in lot.lots}
    own = []
    ones = np.ones(lot.size)
    for info in infos:
        if not info.specimen:
            continue
        of = pooled.get(info.parameter)
        if of is None:
            own.append(NewcomerUnknown(info, info.prior, None, 0 * ones, ones))
            continue
        number = _number(lot, of, like)
        mean = of.prior.away_of(lot.values[of.quantity])
        spread = lot.values[spread_of(of.quantity)]
        own.append(
            NewcomerUnknown(
                replace(info, prior=_predictive(of.prior, number, mean, spread)), None, (of.prior, number), mean, spread
            )
        )
    mine = {n: value for n, value in known.items() if UnknownName.parse(n).specimen == name}
    return Newcomer(lot, experiment, tuple(sweeps), plan_sweeps(sweeps), forward, tuple(own), mine)


def _number(lot: CalibratedLot, of: Lot, like: str) -> int:
    """Number of a specimen among those that have a quantity of the lot."""
    names = [s.name for s in lot.experiment.specimens if not isinstance(s.priors.get(of.quantity), Fixed)]
    return names.index(like) if like in names else 0


def _predictive(prior: LotPrior, number: int, mean: FloatArray, spread: FloatArray) -> Prior:
    """What is believed of a newcomer's quantity, by mean and sd over draws of the lot."""
    middle = float(np.mean(mean))
    sd = float(np.sqrt(np.var(mean) + np.mean(spread**2)))
    value = float(prior.at(np.array(middle), number))
    if isinstance(prior.value, LogNormal):
        return LogNormal(value, float(np.exp(sd)))
    found = Normal(value, sd * value / (1 + middle))
    return TruncatedNormal(found.mean, found.sd, 0.0, np.inf)

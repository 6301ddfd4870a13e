"""Sweeps modelled one by one in, their readings put together as they share errors out: by themselves, or with their repeats."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from calib.problem.density import Terms, log_normal, log_normal_of, terms_of
from calib.problem.plan import Correlation, SweepPlan, repeating
from calib.problem.readings import Discrepancy, PredictedReadings, SweepModel
from models.sensor import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class Repeats:
    """A channel in all sweeps of one specimen under one ball: one sweep, or several that share what the model leaves out.

    Attributes
    ----------
    channel : its name.
    places : numbers of the sweeps among those that are modelled.
    """

    channel: str
    places: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Together:
    """Readings of a channel whose errors depend on those of no other readings, for the draws that are covered in all of them.

    Attributes
    ----------
    repeats : which sweeps they are of.
    covered : (n_draw,).
    readings : of the sweeps one after the other.
    presses : how many points of each.
    """

    repeats: Repeats
    covered: BoolArray
    readings: PredictedReadings
    presses: tuple[int, ...]


def repeats_of(plans: Sequence[SweepPlan]) -> tuple[Repeats, ...]:
    """Sort the channels of sweeps by whose errors go together, in the order of the first sweep of each.

    Parameters
    ----------
    plans : from `plan_sweeps`, of which some may be left out.

    Raises
    ------
    ValueError
        If presses repeat each other that were not planned together, and so would be taken for independent.
    """
    found = repeating((plan.sweep, plan.channels) for plan in plans)
    for name, places in found:
        deepest = {plans[k].channels[name].deepest for k in places}
        if len(places) > 1 and (len(deepest) > 1 or np.isnan(deepest.pop())):
            sweep = plans[places[-1]].sweep
            raise ValueError(f"{sweep.title} repeats another press and was not planned with it: use plan_sweeps for all")
    return tuple(Repeats(name, tuple(places)) for name, places in found)


def put_together(plans: Sequence[SweepPlan], models: Iterable[SweepModel]) -> Iterator[Together]:
    """Put the readings of sweeps together as their errors go together; nothing of sweeps that no draw covers.

    Parameters
    ----------
    plans, models : of the same sweeps.

    Yields
    ------
    In the order of the last sweep of each, and of its channels, so that no more of the models need be held than repeat each
    other.
    """
    of_sweep = _by_sweep(plans)
    held: dict[int, SweepModel] = {}
    for k, model in enumerate(models):
        for repeats in of_sweep[k]:
            if len(repeats.places) == 1:
                if model.channels:
                    readings = model.channels[repeats.channel]
                    yield Together(repeats, model.covered, readings, (readings.observed.size,))
                continue
            held[k] = model
            if k != repeats.places[-1]:
                continue
            some = [held[place] for place in repeats.places]
            covered = np.all([one.covered for one in some], axis=0)
            if np.any(covered):
                presses = [_only(one.channels[repeats.channel], one.covered, covered) for one in some]
                yield Together(repeats, covered, _stacked(presses), tuple(press.observed.size for press in presses))


def log_normal_sweeps(plans: Sequence[SweepPlan], models: Iterable[SweepModel]) -> Iterator[FloatArray]:
    """Log density of what was read in each sweep, holding none of them.

    Parameters
    ----------
    plans, models : of the same sweeps.

    Yields
    ------
    (n_draw,) for each sweep, -inf where a draw is not covered at it. The density of a channel in sweeps that repeat each other
    is in the last of them.
    """
    of_sweep = _by_sweep(plans)
    begun: dict[Repeats, tuple[BoolArray, Terms | None]] = {}
    for k, model in enumerate(models):
        alone = [log_normal(model.channels[r.channel]) for r in of_sweep[k] if len(r.places) == 1 and model.channels]
        found = np.full(model.covered.size, -np.inf)
        found[model.covered] = np.sum(alone, axis=0)
        for repeats in of_sweep[k]:
            if len(repeats.places) == 1:
                continue
            terms = terms_of(model.channels[repeats.channel]) if model.channels else None
            begun[repeats] = _added(begun.get(repeats), model.covered, terms)
            if k == repeats.places[-1]:
                covered, whole = begun.pop(repeats)
                density = np.full(covered.size, -np.inf)
                if whole is not None:
                    density[covered] = log_normal_of(whole)
                found += density
        yield found


def _added(
    before: tuple[BoolArray, Terms | None] | None, covered: BoolArray, terms: Terms | None
) -> tuple[BoolArray, Terms | None]:
    """Terms of presses and of one more, for the draws that are covered in all of them."""
    if before is None:
        return covered, terms
    both = before[0] & covered
    if before[1] is None or terms is None:
        return both, None
    return both, before[1].only(both[before[0]]) + terms.only(both[covered])


def _by_sweep(plans: Sequence[SweepPlan]) -> list[list[Repeats]]:
    """`repeats_of` in which each sweep stands, in the order of its channels."""
    at = {(k, repeats.channel): repeats for repeats in repeats_of(plans) for k in repeats.places}
    return [[at[k, name] for name in plan.channels] for k, plan in enumerate(plans)]


def _only(readings: PredictedReadings, those: BoolArray, wanted: BoolArray) -> PredictedReadings:
    kept = wanted[those]
    return readings if np.all(kept) else readings.only(kept)


def _stacked(presses: Sequence[PredictedReadings]) -> PredictedReadings:
    """Readings of presses that repeat each other, one after the other: the errors that they share have the same factors."""
    depth, mean, variance, error = (
        np.concatenate([getattr(press, name) for press in presses], axis=1) for name in ("depth", "mean", "variance", "error")
    )
    own = [press.discrepancy for press in presses if press.discrepancy is not None]
    correlations = [one.correlation for one in own]
    whole = Correlation(
        np.concatenate([one.modes for one in correlations], axis=-2),
        np.concatenate([one.rest for one in correlations], axis=-1),
    )
    discrepancy = Discrepancy(np.concatenate([one.sd for one in own], axis=1), whole)
    return PredictedReadings(depth, mean, variance, error, np.concatenate([press.observed for press in presses]), discrepancy)

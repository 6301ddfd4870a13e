"""A problem and draws of its unknowns in, what stands out of each sweep out: as it was read, and as it should be."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from calib.lab import Points, Sweep
from calib.problem.centred import nominal_zero
from calib.problem.measurement import WayDown, ways_down
from calib.problem.problem import Problem
from calib.problem.values import values_at
from models.curves import Lookup, look_up, look_up_force, table_depths
from models.response import Asked, Response
from models.sensor import BoolArray, FloatArray

#: What is seen of a sweep: the force at the end of the press, how deep the ball was there, the capacitance at rest, and how
#: much it changed until the end.
Seen = Literal["force", "depth", "rest capacitance", "capacitance change"]

# How far [m], and by what share of the travel, the contact as the readings show it may lie off (sd).
_CONTACT, _CONTACT_SHARE = 0.02e-3, 0.02
# Readings at either end of a channel of which the median is taken.
_AT_END = 3


@dataclass(frozen=True, eq=False)
class Glance:
    """One quantity of one sweep, as it was read and as each of many draws says that it should be read, noise included.

    Attributes
    ----------
    sweep : the press.
    seen : which quantity.
    observed : [N], [m] or [F]; the change of capacitance in [F], too.
    expected : (n_draw,), SI, nan for a draw whose design the forward model does not cover or that is no design.
    at_least : (n_draw,), whether the forward model ends before the press does: what is expected is then that much or more.
    """

    sweep: Sweep
    seen: Seen
    observed: float
    expected: FloatArray
    at_least: BoolArray


@dataclass(frozen=True)
class _Press:
    """The end of a press: travel [m] since contact, nan without a crosshead, and load [N] since before contact, nan without."""

    travel: float
    load: float


def glances(problem: Problem, theta: FloatArray, rng: np.random.Generator) -> Iterator[Glance]:
    """Compare what stands out of every sweep with what draws of the unknowns, such as those of the prior, say of it.

    Contact and load zero are taken from the readings: their priors are so wide that nothing would be out of the way. So that a
    force in a wrong unit is seen as what it is, a draw's depth follows from the travel with the draw's own force, not with the
    one that was read.

    Parameters
    ----------
    problem : from `build_problem`.
    theta : (n_draw, n_parameter), coordinates z of the unknowns.
    rng : of noise, and of where contact is.

    Yields
    ------
    For each sweep what can be seen of it, in the order of `Seen`.
    """
    values = values_at(problem, theta)
    bare = [replace(plan, channels={}) for plan in problem.plans]  # the readings' own depths are not asked for
    for plan, way in zip(problem.plans, ways_down(problem, problem.forward, bare, values), strict=True):
        yield from _glances(plan.sweep, way, rng)


def _glances(sweep: Sweep, way: WayDown, rng: np.random.Generator) -> Iterator[Glance]:
    covered, end = way.covered, _end_of(sweep)
    if way.curves is None:
        return
    own, n = way.own.of(covered), int(np.sum(covered))
    (table,) = way.curves.press([Asked(table_depths(way.limit[covered]), ("force", "capacitance"))])

    def seen(what: Seen, observed: float, expected: FloatArray, lookup: Lookup | None, column: FloatArray | None) -> Glance:
        whole, short = np.full(covered.size, np.nan), np.zeros(covered.size, dtype=bool)
        if lookup is not None and column is not None:
            beyond = np.isnan(lookup.weight[:, 0])
            expected = np.where(beyond, column, expected)
            short[covered] = beyond
        whole[covered] = expected
        return Glance(sweep, what, observed, whole, short)

    def noise(name: str, signal: FloatArray) -> FloatArray:
        points = sweep.channels.get(name)
        share = 1.0 if points is None else 1 / np.sqrt(points.n_effective[-1])
        own_sd = np.hypot(own[f"{name}_noise"][:, 0] * share, own[f"{name}_discrepancy"][:, 0] * signal)
        return np.asarray(own_sd * rng.standard_normal(n), dtype=float)

    gain_x = np.ravel(own.gain("displacement")) * np.ones(n)
    by_travel = None
    if np.isfinite(end.travel):
        by_travel = _by_travel(table, own["machine_compliance"], end.travel / gain_x[:, None], rng)
    by_load = look_up_force(table, np.full((n, 1), end.load) / own.gain("force")) if end.load > 0 else None
    if by_travel is not None:
        force = by_travel.at(table.force)[:, 0] * np.ravel(own.gain("force"))
        yield seen("force", end.load, force + noise("force", force), by_travel, table.force[:, -1])
        if by_load is not None:
            depth = by_load.at(table.depth)[:, 0]
            travel = gain_x * (depth + own["machine_compliance"][:, 0] * end.load)
            yield seen("depth", end.travel, travel, by_load, table.depth[:, -1])
    channel = sweep.channels.get("capacitance")
    place = by_travel if by_travel is not None else by_load
    if channel is None:
        return
    gain = np.ravel(own.gain("capacitance")) * np.ones(n)
    first, last = _ends(channel)
    rest = gain * table.rest_capacitance + own["parasitic_capacitance"][:, 0]
    yield seen("rest capacitance", first, rest + noise("capacitance", np.zeros(n)), None, None)
    if place is not None:
        ideal = gain[:, None] * (table.capacitance - table.rest_capacitance[:, None])
        change = place.at(ideal)[:, 0]
        noisy = change + noise("capacitance", change) + noise("capacitance", np.zeros(n))
        yield seen("capacitance change", last - first, noisy, place, ideal[:, -1])


def _by_travel(table: Response, compliance: FloatArray, travel: FloatArray, rng: np.random.Generator) -> Lookup:
    """Where on each draw's loading curve (1) of `calib.problem.measurement` has the crosshead so far below contact."""
    crosshead = np.maximum.accumulate(table.depth + compliance * table.force, axis=-1)
    sd = _CONTACT + _CONTACT_SHARE * travel
    return look_up(crosshead, travel + sd * rng.standard_normal((crosshead.shape[0], 1)))


def _end_of(sweep: Sweep) -> _Press:
    """The deepest reading of a press, by the record that has most of it: of the tester, else of the meter."""
    contact, load_zero = nominal_zero(sweep)
    loaded = [(points, load) for name, points in sweep.channels.items() if (load := sweep.load_at(name)) is not None]
    for points, load in loaded:  # that of the tester comes first
        if points.displacement is not None:
            at = int(np.argmax(points.displacement))
            return _Press(float(points.displacement[at]) - contact, float(load[at]) - load_zero)
    for _, load in loaded:
        return _Press(float("nan"), float(np.ptp(load)))
    return _Press(float("nan"), float("nan"))


def _ends(points: Points) -> tuple[float, float]:
    """A channel before it is pressed, and at the end of the press."""
    return float(np.median(points.value[:_AT_END])), float(points.value[-1])

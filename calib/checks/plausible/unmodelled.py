"""A problem and its first answer in, what relaxation and drift that its lab files show would do to the modulus out.

The grades of a lab file say how large they are as shares of a range. Whether that matters depends on how well the modulus comes
out besides: 5 % of hysteresis is nothing to a modulus that is known to 6 %, and three standard deviations of one that is known
to 0.8 %. The model has neither time nor drift, and no interval holds them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from calib.catalogue import QUANTITIES, UnknownName
from calib.checks.verdict import Reason
from calib.digits import with_uncertainty
from calib.errors import InputError
from calib.lab import Grade, Sweep
from calib.problem import Problem, build_problem
from calib.sampling import FirstAnswer, FirstEstimate, first_answer

#: Standard deviations by which the modulus of slow and of fast loading may differ: those beyond it are outside a 90 % interval
#: (1.645) by more than one.
RATE_LIMIT = 2.645
#: Standard deviations by which a drift of the load cell may move the modulus.
DRIFT_LIMIT = 1.0
#: Drift of the capacitance as a share of its change that what the model leaves out holds, by the default prior of that.
SIGNAL_DRIFT = 0.02
# How many times its share of the range a drift of the load cell moves the modulus, as contact and compliance move with it: 1.5
# to 4.7 in four labs of `benchmarks/simulated`.
_CARRIED_ON = 3.0
_MODULUS = "young_modulus"


def unmodelled(problem: Problem, first: FirstAnswer) -> Iterator[Reason]:
    """What speaks against a calibration because its lab files show relaxation, or a drift, that its intervals do not hold.

    Parameters
    ----------
    problem : from `build_problem`.
    first : its first answer.
    """
    known = {n: e for n, e in first.parameters.items() if UnknownName.parse(n).parameter == _MODULUS and e.mean > 0}
    if known:
        name = min(known, key=lambda n: known[n].sd / known[n].mean)
        yield from _of_rate(problem.sweeps, known[name])
        yield from _of_load(problem, first, name)
    yield from drift_of_meter(problem.sweeps)


def drift_of_meter(sweeps: Sequence[Sweep], known_to: float = np.inf) -> Iterator[Reason]:
    """What speaks against all changes of capacitance because the meter drifts by more than what the model may leave out.

    Parameters
    ----------
    sweeps : with the grades on their files.
    known_to : [1], sd of the signal over it, if it is known: a drift larger than that counts, too.
    """
    limit = min(SIGNAL_DRIFT, DRIFT_LIMIT * known_to)
    drifts = [(s, g) for s in sweeps for g in _drift(s, "capacitance") if abs(g.number) > limit]
    if drifts:
        sweep, grade = max(drifts, key=lambda pair: abs(pair[1].number))
        finding = (
            f"the capacitance of {sweep.title} drifts: {grade.finding}. All changes that are predicted may be off by as much"
        )
        yield Reason("drift", "amber", finding, grade.advice.rstrip("."))


def _of_rate(sweeps: Sequence[Sweep], modulus: FirstEstimate) -> Iterator[Reason]:
    """Between slow and fast loading: half of the hysteresis, or what is lost while the crosshead stands."""
    by_sweep = [own for sweep in sweeps if (own := dict(_between_speeds(sweep)))]
    if not by_sweep:
        return
    effect = float(np.mean([max(own.values()) for own in by_sweep]))
    away = effect * modulus.mean / modulus.sd if modulus.sd > 0 else 0.0
    if away > RATE_LIMIT:
        shown = {what: float(np.mean([own[what] for own in by_sweep if what in own])) for what in set().union(*by_sweep)}
        seen = []
        if "hysteresis" in shown:
            seen.append(f"unloading gives back {_percent(2 * shown['hysteresis'])} less than loading took")
        if "hold" in shown:
            seen.append(f"force falls by {_percent(shown['hold'])} while the crosshead stands")
        finding = (
            f"{' and '.join(seen)}: the moduli of slow and of fast loading differ by about {_percent(effect)}, "
            f"{away:.1f} of the standard deviations that are stated, which hold no time"
        )
        action = "Condition the specimen and press at the speed of the use, or state the modulus for this speed alone"
        yield Reason("rate", "amber", finding, action)


def _between_speeds(sweep: Sweep) -> Iterator[tuple[str, float]]:
    for grade in sweep.grades:
        if grade.channel == "force" and grade.check == "hysteresis" and grade.number > 0:
            yield "hysteresis", grade.number / 2
        if grade.channel == "force" and grade.check == "change in the hold" and grade.number < 0:
            yield "hold", -grade.number


def _of_load(problem: Problem, first: FirstAnswer, name: str) -> Iterator[Reason]:
    """The same readings without the drift of the load cell, as it is seen before contact, all the way."""
    drifting = [(sweep.title, grade) for sweep in problem.sweeps for grade in _drift(sweep, "force")]
    if not drifting:
        return
    try:
        sweeps = [_without_drift(sweep) for sweep in problem.sweeps]
        near = first.means
        steady = first_answer(build_problem(problem.experiment, sweeps, problem.forward), near).parameters[name]
    except (InputError, ValueError, KeyError):
        yield from drift_by_share(problem.sweeps, first.parameters[name])
        return
    own = first.parameters[name]
    away = (steady.mean - own.mean) / own.sd if own.sd > 0 else 0.0
    if abs(away) > DRIFT_LIMIT:
        title, grade = max(drifting, key=lambda pair: abs(pair[1].number))
        k, unit = QUANTITIES[_MODULUS].display_scale, QUANTITIES[_MODULUS].display_unit
        label = UnknownName.parse(name).label
        with_it, without = (with_uncertainty(e.mean * k, e.sd * k) for e in (own, steady))
        finding = (
            f"the force of {title} drifts: {grade.finding}. Without an even drift of that size {label} is {without} instead of "
            f"{with_it} {unit}, {abs(away):.1f} standard deviations away"
        )
        yield Reason("drift", "amber", finding, grade.advice.rstrip("."))


def drift_by_share(sweeps: Sequence[Sweep], modulus: FirstEstimate) -> Iterator[Reason]:
    """What speaks against a modulus because its load cell drifts, where no first answer is to be had without the drift.

    Parameters
    ----------
    sweeps : that tell the modulus.
    modulus : as they tell it.
    """
    drifting = [(sweep.title, grade) for sweep in sweeps for grade in _drift(sweep, "force")]
    if not drifting or modulus.sd <= 0:
        return
    title, grade = max(drifting, key=lambda pair: abs(pair[1].number))
    away = _CARRIED_ON * abs(grade.number) * modulus.mean / modulus.sd
    if away > DRIFT_LIMIT:
        finding = (
            f"the force of {title} drifts: {grade.finding}. The modulus may be off by three times that share, "
            f"{away:.1f} of its standard deviations"
        )
        yield Reason("drift", "amber", finding, grade.advice.rstrip("."))


def _drift(sweep: Sweep, channel: str) -> list[Grade]:
    """The drift of a channel if it is distinct from none and matters: as both sides of the press tell it, where they do."""
    own = {g.check: g for g in sweep.grades if g.channel == channel}
    found = own.get("return to zero", own.get("drift before contact"))
    return [found] if found is not None and found.level != "good" else []


def _without_drift(sweep: Sweep) -> Sweep:
    """The sweep as a steady load cell has it: without what grows along the press from nothing to the drift at its end."""
    points, track, found = sweep.channels.get("force"), sweep.track, _drift(sweep, "force")
    if not found or points is None or points.displacement is None:
        return sweep
    drift = found[0].number * float(np.ptp(points.value))
    begin, way = float(np.min(points.displacement)), float(np.ptp(points.displacement))
    steady = replace(points, value=points.value - drift * (points.displacement - begin) / way)
    if track is not None:
        track = replace(track, force=track.force - drift * np.clip((track.displacement - begin) / way, 0.0, 1.0))
    return replace(sweep, channels={**sweep.channels, "force": steady}, track=track)


def _percent(share: float) -> str:
    return f"{100 * abs(share):.2g} %"

"""From what turning point, onset and survey say of the offset to the `ClockOffset` that is concluded, with its evidence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calib.digits import with_uncertainty
from calib.lab.clocks.offset import ClockOffset, Confidence
from calib.lab.clocks.records import CrossheadRecord, MeterRecord
from calib.lab.clocks.survey import OffsetRange
from calib.lab.signal import crests
from models.sensor import FloatArray

_Estimate = tuple[float, float]

# An offset is clear if it is known within 10 ms, twice this sd [s].
_CLEAR_SD = 0.005


def unknown(
    meter: MeterRecord, low: float, high: float, alternatives: Sequence[float], why: str, value: float | None = None
) -> ClockOffset:
    """Conclude that the offset cannot be found: its error is as wide as a uniform distribution over all that is possible.

    Parameters
    ----------
    meter : its record.
    low, high : [s], limits of what is possible.
    alternatives : [s], offsets that fit about as well.
    why : the reason in words.
    value : [s], what is most likely; the middle if None.
    """
    value = (low + high) / 2 if value is None else value
    sd = max((high - low) / np.sqrt(12.0), abs(value - (low + high) / 2), meter.interval)
    said = f"the clock offset is ambiguous: {why}; anything from {low:.3g} to {high:.3g} s is possible"
    return ClockOffset(value, float(sd), meter.systematic, "ambiguous", None, None, tuple(alternatives), (said,))


def several(
    meter: MeterRecord, tester: CrossheadRecord, ranges: Sequence[OffsetRange], turning: tuple[float, float] | None
) -> ClockOffset:
    """Conclude that offsets far apart fit about as well: the best of them, an sd that spans them all, and the others.

    Parameters
    ----------
    meter, tester : the two records.
    ranges : the offsets that fit, the best first.
    turning : offset and sd [s] from the turning point near the best; None if the readings there do not determine it.
    """
    values = [a.value for a in ranges]
    best = turning[0] if turning else values[0]
    steps = np.diff(np.sort(values))
    periods = [*np.diff(crest_times(tester.time, tester.displacement)), *np.diff(crest_times(meter.time, meter.capacitance))]
    equal = any(np.all(np.abs(steps / p - np.rint(steps / p)) < 0.05) for p in periods if p > 0)
    what = f"whole periods of {np.min(steps):.3g} s (several equal cycles)" if equal else "separate offsets"
    listed = ", ".join(f"{v:.2f}" for v in sorted(values)[:8])
    said = f"the clock offset is ambiguous by {what}: {listed} s fit the capacitance about equally well"
    sd = max(float(np.std(np.array(values))), turning[1] if turning else 0.0)
    return ClockOffset(best, sd, meter.systematic, "ambiguous", turning, None, tuple(values[1:]), (said,))


def crest_times(time: FloatArray, values: FloatArray) -> list[float]:
    """Find the times at which each press of a record is deepest [s].

    Parameters
    ----------
    time : [s], shape (n,).
    values : displacement or capacitance, shape (n,), in any unit.
    """
    return [float(time[row]) for row in crests(values)]


def from_onset_alone(meter: MeterRecord, onset: tuple[float, float], why: str, *more: str) -> ClockOffset:
    """Conclude from the onset alone, where the turning point does not determine the offset: a weak conclusion.

    Parameters
    ----------
    meter : its record.
    onset : offset and sd [s].
    why : the reason that there is no estimate from the turning point, in words.
    more : further sentences for the report.
    """
    said = f"clock offset from the onset only, {why}: {with_uncertainty(*onset)} s"
    return ClockOffset(onset[0], onset[1], meter.systematic, "weak", None, onset, (), (said, *more))


def combined(
    meter: MeterRecord, tester: CrossheadRecord, best: OffsetRange, turning: _Estimate | None, onset: _Estimate | None
) -> ClockOffset:
    """Conclude where one range of offsets fits: the turning point's value, compared with the onset's.

    Parameters
    ----------
    meter, tester : the two records.
    best : the offsets that the survey found.
    turning, onset : offset and sd [s] from either feature; None if the readings do not determine it.
    """
    stamps = f"stamps at the beginning or end of a reading move the clock itself by up to {meter.systematic:.3f} s, not the tie"
    if turning is None and onset is None:
        return _from_survey(meter, tester, best, stamps)
    if turning is None:
        assert onset is not None
        return from_onset_alone(meter, onset, "the log does not show the turning point", stamps)
    value, sd = turning
    evidence = [f"clock offset from the turning point: {with_uncertainty(value, sd)} s", stamps]
    sharp = sd <= _CLEAR_SD
    agrees = True
    if onset is not None:
        apart = onset[0] - value
        agrees = abs(apart) <= 3 * float(np.hypot(onset[1], sd))
        evidence.append(f"the onset tells {with_uncertainty(*onset)} s: {'agrees' if agrees else 'DISAGREES'}")
        if not agrees:
            sd = abs(apart)
            evidence.append(
                f"onset and turning point disagree by {abs(apart):.3f} s, more than their errors allow (clocks of different "
                f"rate, or a capacitance that leaves its flat part apart from the force): the sd is taken as large as that"
            )
    confidence: Confidence = "clear" if sharp and agrees else "weak"
    if not sharp:
        travel = 2 * sd * tester.speed_at_contact
        evidence.append(
            f"the data do not tell the offset within 10 ms, but within {2 * sd:.2g} s (two sd), in which the crosshead moves "
            f"by {travel * 1e6:.2g} µm"
        )
    return ClockOffset(value, sd, meter.systematic, confidence, turning, onset, (), tuple(evidence))


def _from_survey(meter: MeterRecord, tester: CrossheadRecord, best: OffsetRange, stamps: str) -> ClockOffset:
    """Conclude where neither feature gives an estimate: the survey's range if it is narrow and has readings on both sides."""
    both = [np.sum(meter.time + best.value < tester.top), np.sum(meter.time + best.value > tester.leave)]
    if best.width < 0.2 * tester.duration and min(both) >= 3:
        sd = max(best.width / 2, meter.interval / 4)
        said = (
            f"clock offset from a fit of the whole log only, too few readings at the turning point: "
            f"{with_uncertainty(best.value, sd)} s"
        )
        return ClockOffset(best.value, sd, meter.systematic, "weak", None, None, (), (said, stamps))
    why = "no turning point within the log and no clear onset of the capacitance"
    widen = max(0.0, 0.3 * tester.duration - best.width) / 2
    return unknown(meter, best.low - widen, best.high + widen, (), why)

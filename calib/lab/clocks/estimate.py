"""From the observations of tester and meter to the offset of their clocks: the survey, the two features, the conclusion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from calib.lab.clocks.conclusion import combined, crest_times, from_onset_alone, several, unknown
from calib.lab.clocks.offset import ClockOffset
from calib.lab.clocks.onset import offset_from_onset
from calib.lab.clocks.records import CrossheadRecord, MeterRecord
from calib.lab.clocks.survey import OffsetRange, survey
from calib.lab.clocks.turning_point import offset_from_turning_point
from calib.lab.observations import Observations
from calib.lab.signal import NO_SIGNAL


def clock_offset(tester: Observations, lcr: Observations, within: tuple[float, float] | None = None) -> ClockOffset:
    """Find how far the clocks of testing machine and LCR meter are apart, by what both saw of one press.

    It takes the used cycle of the tester's record and the whole log of the meter. A survey of all possible offsets fits the
    whole log as a function of the crosshead's reading, one curve for loading and one for unloading; offsets far apart that fit
    about as well make the answer ambiguous. Around the best, the turning point gives the offset (`offset_from_turning_point`);
    hysteresis and creep widen its sd but do not shift the value. The onset of contact, seen in force and in capacitance, gives
    a second estimate, less sharp, to compare with.

    Assumptions: both clocks run at the same rate; capacitance grows with compression (unless only the opposite fits); stamps
    keep the same distance to the middle of their readings. Range: loading in more than ten intervals of the meter.

    Measured on 500 random pairs (tester of 20-100 Hz, meter of 5-50 readings/s and 2-10 fF, change of 2-4 pF, with and without
    hold, hysteresis and creep), |error| median and 95 %: 10 and 47 ms from 0.5 to 2 mm/min, 3 and 17 ms from 2 to 10 mm/min, 1
    and 7 ms from there to 0.75 mm/s; within two stated sd in 97 of 100, within three in 99; within 10 ms in all whose stated sd
    is below 4 ms. A capacitance that jumps by a per cent or more where the crosshead leaves looks like another offset.

    Alternatives by discrete steps are not averaged: no normal prior between two periods is honest, so `make_sweep` refuses them
    unless `within` decides. An offset that is merely unknown gets an sd as wide as what is possible, as its prior.

    Parameters
    ----------
    tester : with time, displacement and force.
    lcr : with time and capacitance.
    within : [s], the range in which the offset is known to lie, None for any; it can decide between alternatives.

    Returns
    -------
    Clock of the tester minus clock of the meter [s], with its sd, how sure it is, and why.

    Raises
    ------
    InputError
        If the log has fewer than five readings.
    """
    meter, press = MeterRecord.of(lcr), CrossheadRecord.of(tester)
    low, high = float(press.time[0] - meter.time[-1]), float(press.time[-1] - meter.time[0])
    if within is not None:
        low, high = max(low, within[0]), min(high, within[1])
    if high <= low:
        why = "no offset in the range given lets the log overlap the tester's record"
        low, high = within or (low, high)
        return unknown(meter, low, high, (), why)
    if meter.change < NO_SIGNAL * meter.noise or meter.change == 0.0:
        why = f"the capacitance changes by {meter.change * 1e15:.3g} fF, its noise is {meter.noise * 1e15:.3g} fF"
        together = float(np.clip(press.time[0] - meter.time[0], low, high))
        return unknown(meter, low, high, (), why, together)
    if not press.returns:
        return _from_loading_only(meter, press, low, high)
    ranges = survey(meter, press, low, high)
    best = ranges[0]
    turning = offset_from_turning_point(meter, press, best)
    if len(ranges) > 1:
        return several(meter, press, ranges, turning)
    centre, reach = (turning[0], 0.25 * press.duration) if turning else (best.value, 0.5 * press.duration + best.width)
    return combined(meter, press, best, turning, offset_from_onset(meter, press, centre, reach))


def _from_loading_only(meter: MeterRecord, tester: CrossheadRecord, low: float, high: float) -> ClockOffset:
    """Estimate the offset for a tester's record that ends at the top: the first rise of the capacitance must be its loading."""
    crests = crest_times(meter.time, meter.capacitance)
    if len(crests) > 1:
        values = [tester.top - crest for crest in crests]
        values = [v for v in values if low <= v <= high]
        if len(values) > 1:
            ranges = [OffsetRange(v, v, v) for v in values]
            return several(meter, tester, ranges, offset_from_turning_point(meter, tester, ranges[0]))
    crest = crests[0] if crests else float(meter.time[-1])
    kept = meter.time <= crest
    shorter = replace(meter, time=meter.time[kept], capacitance=meter.capacitance[kept])
    middle = tester.top - crest
    onset = offset_from_onset(shorter, tester, middle, 0.5 * tester.duration)
    if onset is None:
        # The top of the log lies within the loading branch, no more is known.
        low, high = max(low, tester.begin - float(shorter.time[0])), min(high, middle)
        why = "no turning point in the tester's record and no clear onset"
        return unknown(meter, min(low, high), max(low, high), (), why)
    return from_onset_alone(meter, onset, "no record beyond the turning point")

"""From the onsets of force and of capacitance, which are one event, to the offset of the clocks, with its error."""

from __future__ import annotations

import numpy as np

from calib.lab.clocks.records import CrossheadRecord, MeterRecord
from calib.lab.onset import beginning, departure
from calib.lab.signal import NO_SIGNAL, excursion
from models.sensor import FloatArray

# Share of the depth within which force and capacitance leave their flat parts together (sd): roughness, adhesion.
_SAME_ONSET = 0.005


def offset_from_onset(meter: MeterRecord, tester: CrossheadRecord, centre: float, reach: float) -> tuple[float, float] | None:
    """The offset that makes the capacitance leave its flat part where the force does: less sharp than the turning point.

    Parameters
    ----------
    meter, tester : the two records.
    centre, reach : [s], the offset is looked for within `reach` of `centre`.

    Returns
    -------
    Offset and sd [s]; None if either channel shows no onset there.
    """
    if not np.isfinite(tester.contact_sd):
        return None
    on_tester = meter.time + centre
    inside = (on_tester > tester.begin - reach) & (on_tester < tester.top)
    t, c = meter.time[inside], meter.capacitance[inside]
    if t.size < 12:
        return None
    rise = np.maximum.accumulate(excursion(c) if np.sum(excursion(c)) > 0 else -excursion(c))
    first = beginning(c, rise, meter.noise, meter.change)
    if first is None or rise[-1] < NO_SIGNAL * meter.noise:
        return None
    ts = first.means(t)
    before = tester.time <= tester.top
    time, x = tester.time[before], tester.displacement[before]

    def depth(g: float) -> FloatArray:
        return np.asarray((np.interp(ts + g, time, x) - tester.contact) / tester.depth)

    low = centre - reach
    high = min(centre + reach, tester.top - float(ts[-1]))
    found = departure(depth, first.y, first.noise, low, high) if high > low else None
    if found is None:
        return None
    # The tester's own onset is not known exactly: its error in time is the error in displacement over the speed there.
    speed = tester.speed_at_contact
    sd = float(np.linalg.norm([found[1], tester.contact_sd / speed, _SAME_ONSET * tester.depth / speed]))
    return (found[0], sd) if sd < 0.08 * tester.duration else None

"""From the observations of one lab file to verdicts on their quality: what may spoil a calibration, how much, and what to do.

Verdicts never change data and never refuse a file; they are made before any inference, so that a lab can repeat a test while
the specimen is still on the bench. Every check gives a number whether or not it objects; one that a file has nothing to say on
(no unloading branch, no time column) gives no verdict.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.integrate import trapezoid

from calib.lab.instruments import IntArray
from calib.lab.observations import HOLD, Observations
from calib.lab.reduction import find_onset, integrated_time
from calib.lab.signal import excursion, reading_noise, resolution, reversals
from models.sensor import BoolArray, FloatArray

Level = Literal["good", "warning", "bad"]

#: Readings in contact. Noise (sd) judged from the n - 4 degrees of freedom that a cubic leaves is uncertain by
#: 1 / sqrt(2 (n - 4)): 12 % at 40 readings, which is also the number of points a channel is reduced to, and 25 % at 12.
FEW_READINGS, TOO_FEW_READINGS = 40, 12
#: Range over the noise of one reading. At 10 the tie of two clocks gives the channel up; at 30 the range alone is known from
#: forty independent readings to 2 % (sd), which is what a calibration states for the modulus.
WEAK_SIGNAL, NO_SIGNAL = 30.0, 10.0
#: Steps of the display in the range: relative resolution of the force indicator of 0.5 % (class 1) and 1.5 % (class 3, the
#: coarsest of a calibrated testing machine), ISO 7500-1:2018, table 2. Taken over for the change of capacitance.
FEW_STEPS, TOO_FEW_STEPS = 1 / 0.005, 1 / 0.015
#: Readings in a row at exactly the largest value before a channel is suspected, and the share of its range that must be lost
#: on this flat top for the verdict bad. The load cell or the meter's range ends there, and the curve with it.
FLAT_TOP, FLAT_TOP_LOSS = 5, 0.02
#: Drift before contact, scaled to the duration of loading, as a share of the range. The load zero is one constant: a drift goes
#: on into the modulus by about its share. 1 % is below what a calibration states for the modulus (2 %), 5 % above.
DRIFT, LARGE_DRIFT = 0.01, 0.05
#: Change of a channel while the crosshead stands under load, as a share of the range. The model has no time: the loading curve
#: holds some of this relaxation, and its modulus is that of this speed. 5 % is the scatter of moduli within a lab (Varner and
#: Cohen, arXiv 2404.16960: 3-5 %); from 20 % on a viscoelastic model would be the right one.
RELAXATION, LARGE_RELAXATION = 0.05, 0.20
#: Share of the work of loading that unloading does not give back. A curve of an elastic material lies about half-way between
#: the branches: half of this ratio is what the modulus from the loading branch is too large. 10 % is 5 % of the modulus, the
#: scatter within a lab; 30 % lies between a first cycle (40 %) and a conditioned one (16 %) of one soft silicone.
HYSTERESIS, LARGE_HYSTERESIS = 0.10, 0.30
#: Negative hysteresis beyond this cannot be of the material: unloading would give back more than loading took.
NEGATIVE_HYSTERESIS = -0.02
#: Share of the travel in contact that the machine takes. The compliance of one rig is known to about 12 % (50-64 N/mm): at 10 %
#: the depth is then known to 1 % and the modulus to 2 %; at 50 % the sensor's share is the smaller one, and the modulus of the
#: same record may double (12 and 23 MPa in a public indentation data set, without and with its compliance).
COMPLIANCE_SHARE, LARGE_COMPLIANCE_SHARE = 0.10, 0.50
#: Machine compliance [m/N] of a light table-top rig, of 50-64 N/mm; taken where none is given.
TYPICAL_COMPLIANCE = 1 / 57e3
#: Share of the travel before contact, and readings there. From 2 % on the flat part has points of its own in the reduction;
#: fewer than three readings tell no level, so that load zero and contact point are extrapolated.
SHORT_START, FEW_BEFORE, TOO_FEW_BEFORE = 0.02, 10, 3
#: Slope of a beginning over the mean slope after it, above which it is no flat part but contact; so is one that rises by more
#: than `LARGE_DRIFT` of the range.
FLAT_SLOPE = 0.1
#: First reading of force, as a share of the range, up to which a record that starts in contact starts with a light touch.
LIGHT_TOUCH = 0.01
#: A gap is longer than so many usual time steps, and takes so much of the duration of loading: one of the forty points, and one
#: fifth of the curve.
GAP_STEPS, GAP, LARGE_GAP = 5.0, 1 / 40, 0.2
#: Ratio of long to short time steps (95th to 5th percentile) above which neighbouring readings are no even series: their
#: correlation, counted in readings, is then that of the densest part.
UNEVEN_STEPS = 10.0
#: Load zero [N] up to which the default prior of `load_zero` reaches.
LOAD_ZERO_REACH = 5.0

_RANK: dict[Level, int] = {"bad": 0, "warning": 1, "good": 2}


@dataclass(frozen=True)
class Verdict:
    """What one check found in one channel of one lab file.

    Attributes
    ----------
    check : what was looked at, such as "hysteresis".
    level : "good", "warning" (look at it: the result may carry it) or "bad" (repeat the test if at all possible).
    number : what was found, in `unit`; always finite.
    unit : "N", "m", "s"; "1" for a share; "times" for a ratio; "readings" or "steps" for a count.
    finding : the number in a sentence, with what it is compared to.
    advice : what to do about it; "" where nothing is to be done.
    channel : "force" or "capacitance".
    file : name of the lab file.
    """

    check: str
    level: Level
    number: float
    unit: str
    finding: str
    advice: str
    channel: str
    file: str


@dataclass(frozen=True, eq=False)
class _Loading:
    """One channel on the loading branch, arrays of shape (n_row,) in the order of reading.

    Attributes
    ----------
    rows : of the file. x : displacement [m], else time [s], else number of the reading, as `x_unit` says.
    y : readings [unit], turned so that they rise in contact (by `sign`). flat : rows before contact.
    span : range of y without single spikes. noise : sd of one reading. step : of the display. All in `unit`.
    """

    file: str
    name: str
    unit: str
    rows: IntArray
    x: FloatArray
    x_unit: str
    y: FloatArray
    sign: float
    flat: BoolArray
    span: float
    noise: float
    step: float

    @property
    def touch(self) -> float:
        """Where the flat part ends, or the branch begins if there is none. In `x_unit`."""
        return float(np.max(self.x[self.flat]) if np.any(self.flat) else self.x[0])

    @property
    def zero(self) -> float:
        """Level before contact, or the first reading if there is no flat part. In `unit`, of `y`."""
        return float(np.median(self.y[self.flat]) if np.any(self.flat) else self.y[0])

    def verdict(self, check: str, level: Level, number: float, unit: str, finding: str, advice: str) -> Verdict:
        return Verdict(check, level, float(number), unit, finding, "" if level == "good" else advice, self.name, self.file)

    def text(self, value: float) -> str:
        return f"{value:.3g} N" if self.unit == "N" else f"{value * 1e12:.4g} pF"


def judge(obs: Observations, machine_compliance: float | None = None) -> tuple[Verdict, ...]:
    """Verdicts on one lab file, channel by channel, in the order of the checks.

    Parameters
    ----------
    obs : one lab file with force, capacitance or both, over displacement or time.
    machine_compliance : [m/N], what is known of it: measured, or the upper end of its prior; None if nothing is. Then a light
        table-top rig (`TYPICAL_COMPLIANCE`) is taken, and the verdict is a warning at most.

    Returns
    -------
    One verdict for each check that applies; none at all for a file with fewer than five readings of a channel on the loading
    branch, which the reduction refuses.
    """
    verdicts: list[Verdict | None] = []
    for c in (_loading(obs, name) for name in ("force", "capacitance")):
        if c is None:
            continue
        verdicts += [_readings(c), _signal(c), _gap(obs, c), _even_steps(obs, c)]
        if c.span <= NO_SIGNAL * c.noise:
            continue  # all other numbers would be shares of noise
        verdicts += [_resolution(c), _clipping(obs, c), _start(c), _drift(obs, c), _relaxation(obs, c)]
        if c.name == "force":
            verdicts += [_load_zero(c), _hysteresis(obs, c), _compliance(c, machine_compliance)]
    return tuple(v for v in verdicts if v is not None)


def worst_first(verdicts: Iterable[Verdict]) -> list[Verdict]:
    """Bad ones, warnings, good ones; in the order given within a level."""
    return sorted(verdicts, key=lambda v: _RANK[v.level])


def verdict_rows(verdicts: Iterable[Verdict]) -> list[tuple[str, str, str, str, str]]:
    """Verdicts for people, the worst first: level, check with its channel, number with unit, finding, advice."""
    return [(v.level, check_name(v), number_text(v), v.finding, v.advice) for v in worst_first(verdicts)]


def check_name(verdict: Verdict) -> str:
    """The check with the channel it was made on.

    >>> check_name(Verdict("drift", "good", 0.1, "1", "", "", "force", "a.csv"))
    'drift, force'
    """
    return f"{verdict.check}, {verdict.channel}"


def number_text(verdict: Verdict) -> str:
    """The number of a verdict with its unit, as people read it: shares in per cent, lengths in mm.

    >>> number_text(Verdict("hysteresis", "good", 0.0712, "1", "", "", "force", "a.csv"))
    '7.1 %'
    >>> number_text(Verdict("start", "good", 0.00017, "m", "", "", "force", "a.csv"))
    '0.17 mm'
    """
    value, unit = verdict.number + 0.0, verdict.unit  # no minus zero
    if unit == "1":
        return _percent(value)
    if unit == "m":
        return f"{value * 1e3:.3g} mm"
    if unit in ("readings", "steps"):
        return f"{value:.0f} {unit}" if round(value) != 1 else f"1 {unit[:-1]}"
    return f"{value:.0f} {unit}" if abs(value) >= 100 else f"{value:.3g} {unit}"


def quality_in_words(verdicts: Sequence[Verdict]) -> str:
    """How many verdicts there are of each level, and which are bad, in a sentence.

    >>> quality_in_words([Verdict("gap in time", "good", 0.1, "s", "", "", "force", "a.csv")])
    '1 check: all good.'
    >>> quality_in_words([Verdict("hysteresis", "bad", 0.4, "1", "", "", "force", "a.csv")])
    '1 check: 1 bad (hysteresis, force, of a.csv).'
    """
    n = {level: sum(v.level == level for v in verdicts) for level in _RANK}
    total = f"{len(verdicts)} check{'s' if len(verdicts) != 1 else ''}"
    if n["good"] == len(verdicts):
        return f"{total}: all good."
    parts = []
    if n["bad"]:
        bad = [f"{check_name(v)}, of {v.file}" for v in verdicts if v.level == "bad"]
        parts.append(f"{n['bad']} bad ({'; '.join(bad[:4])}{f'; {len(bad) - 4} more' if len(bad) > 4 else ''})")
    if n["warning"]:
        parts.append(f"{n['warning']} warning{'s' if n['warning'] > 1 else ''}")
    if n["good"]:
        parts.append(f"{n['good']} good")
    return f"{total}: {', '.join(parts)}."


# --- the loading branch -------------------------------------------------------------------------------------------------


def _loading(obs: Observations, name: str) -> _Loading | None:
    if (obs.force if name == "force" else obs.capacitance) is None:
        return None
    values = _values(obs, name)
    clock = np.arange(len(obs.used), dtype=float) if obs.time is None else obs.time
    x_all = clock if obs.displacement is None else obs.displacement
    x_unit = "m" if obs.displacement is not None else "s" if obs.time is not None else "readings"
    rows = np.flatnonzero(obs.used & np.isfinite(x_all) & np.isfinite(values))
    if rows.size < 5:
        return None
    if obs.displacement is None and obs.force is None:
        rows = rows[: first_crest(values[rows])]
    y = values[rows]
    away = excursion(y)
    sign = 1.0 if float(away[np.argmax(np.abs(away))]) >= 0 else -1.0
    y = sign * y
    x = x_all[rows]
    step = resolution(y)
    span = float(np.max(sign * away) - min(0.0, float(np.min(sign * away))))
    if step == 0.0:
        # More digits than a decimal step shows, such as counts of a converter times a factor.
        gaps = np.diff(np.unique(y))
        step = float(np.min(gaps[gaps > 1e-9 * span], initial=span)) if gaps.size else span
    return _Loading(
        file=obs.table.path.name,
        name=name,
        unit="N" if name == "force" else "F",
        rows=rows,
        x=x,
        x_unit=x_unit,
        y=y,
        sign=sign,
        flat=_flat_part(x, y),
        span=span,
        noise=reading_noise(y),
        step=step,
    )


def _values(obs: Observations, name: str) -> FloatArray:
    values = obs.force if name == "force" else obs.capacitance
    assert values is not None
    return values


def first_crest(values: FloatArray) -> int:
    """Rows up to the end of the first loading in a record (n_row,) of capacitance over time alone: to its first crest."""
    away = excursion(values)
    noise = reading_noise(values)
    rise = away * (float(np.sign(away[np.argmax(np.abs(away))])) or 1.0)
    top = float(np.max(rise))
    if top <= NO_SIGNAL * noise:
        return int(values.size)
    turns = reversals(rise, max(0.1 * top, 6 * noise))
    crest = next((b for b in turns[1:] if rise[b] >= 0.5 * top), int(np.argmax(rise)))
    # A hold creeps on by less than 2 % and must not count as loading.
    return max(5, int(np.argmax(rise[: crest + 1] >= 0.98 * rise[crest])) + 1)


def _flat_part(x: FloatArray, y: FloatArray) -> BoolArray:
    """Rows before contact: what lies before the onset, if it is flat against what follows.

    The onset of a curve that stiffens is found far from its start even if it is in contact all along; what lies before is then
    no flat part, and the search goes on in it.
    """
    rows, span = np.arange(x.size), float(np.ptp(y))
    while rows.size >= 8:
        onset = find_onset(x[rows], y[rows])
        flat = rows[x[rows] < onset]
        if flat.size < TOO_FEW_BEFORE:
            break
        end = float(np.max(x[rows]))
        tail = rows[x[rows] > end - 0.05 * (end - onset)]
        after = (float(np.mean(y[tail])) - float(np.mean(y[flat]))) / max(end - onset, 1e-300)
        slope, error = _slope(x[flat], y[flat])
        level = abs(slope) - 2 * error <= min(FLAT_SLOPE * abs(after), LARGE_DRIFT * span / max(float(np.ptp(x[flat])), 1e-300))
        if level and not _bends_up(x[flat], y[flat], span):
            return np.isin(np.arange(x.size), flat)
        rows = flat
    # Noise may hide the onset in a flat beginning as well as in a slow one; it is flat if nothing shows that it is not.
    order = np.arange(x.size)
    rise = float(np.ptp(np.sort(y)[x.size // 50 : x.size - x.size // 50])) / max(float(np.ptp(x)), 1e-300)
    for share in (0.5, 0.3, 0.2, 0.1, 0.05):
        first = order < share * x.size
        if np.sum(first) >= FEW_BEFORE:
            slope, error = _slope(x[first], y[first])
            if abs(slope) <= 2 * error and abs(slope) + error <= FLAT_SLOPE * rise:
                return first
    return np.zeros(x.size, dtype=bool)


def _bends_up(x: FloatArray, y: FloatArray, span: float) -> bool:
    """Whether y rises in the second half by half as much again as in the first, and by more than a light touch.

    That is contact: a drift goes on evenly or settles.
    """
    middle = (float(np.min(x)) + float(np.max(x))) / 2
    late = x > middle
    if min(np.sum(late), np.sum(~late)) < 5:
        return False
    (first, error), (second, other) = _slope(x[~late], y[~late]), _slope(x[late], y[late])
    rises = second * float(np.ptp(x[late])) > LIGHT_TOUCH * span
    return rises and second > 1.5 * first and second - first > 3 * math.hypot(error, other)


def _slope(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Slope of the least-squares line and its standard error, for readings that depend on their neighbours."""
    u = x - float(np.mean(x))
    power = float(u @ u)
    if power == 0.0:
        return 0.0, math.inf
    slope = float(u @ y) / power
    residual = y - float(np.mean(y)) - slope * u
    freedom = max(y.size - 2, 1)
    return slope, math.sqrt(float(residual @ residual) / freedom / power * integrated_time(residual, 2))


# --- the checks ---------------------------------------------------------------------------------------------------------


def _level(value: float, warning: float, bad: float) -> Level:
    return "bad" if value > bad else "warning" if value > warning else "good"


def _readings(c: _Loading) -> Verdict:
    n = int(np.sum(~c.flat))
    level = _level(-n, -FEW_READINGS, -TOO_FEW_READINGS)
    finding = f"{n} readings of {c.name} in contact on the loading branch; from {FEW_READINGS} on the noise is known well"
    advice = "Log faster or press slower; a sweep lives on a hundred readings and more."
    return c.verdict("readings in contact", level, n, "readings", finding, advice)


def _signal(c: _Loading) -> Verdict | None:
    if c.y.size < 20:
        return None  # second differences of so few readings are the curve's bend, not noise
    ratio = c.span / max(c.noise, 1e-9 * c.span, 1e-300)
    level = _level(-ratio, -WEAK_SIGNAL, -NO_SIGNAL)
    finding = f"{c.name} changes by {c.text(c.span)}, {ratio:.0f} times the noise of one reading ({c.text(c.noise)})"
    advice = "Press harder, average longer (slower meter speed), shield the leads."
    return c.verdict("signal", level, ratio, "times", finding, advice)


def _resolution(c: _Loading) -> Verdict:
    steps = c.span / c.step
    level = _level(-steps, -FEW_STEPS, -TOO_FEW_STEPS)
    asked = f"class 1 of ISO 7500-1 asks for {FEW_STEPS:.0f}" if c.name == "force" else f"{FEW_STEPS:.0f} are enough"
    finding = f"{c.name} is written in steps of {c.text(c.step)}, {steps:.0f} in the range of {c.text(c.span)}; {asked}"
    advice = "in N rather than kN, or use a smaller load cell" if c.name == "force" else "or choose a finer range of the meter"
    return c.verdict("resolution", level, steps, "steps", finding, f"Export with more decimals, {advice}.")


def _clipping(obs: Observations, c: _Loading) -> Verdict | None:
    y, x = c.y, c.x
    if c.x_unit != "m":
        if c.noise <= c.step:
            return None  # a quiet meter repeats one value in a hold as well
        # The branch ends where the channel does not rise any more, which here is the very thing to look at.
        x = np.flatnonzero(np.isfinite(_values(obs, c.name))).astype(np.float64)
        y = c.sign * _values(obs, c.name)[x.astype(np.intp)]
    top = float(np.max(y))
    begin, end = _longest(y == top)
    n = end - begin
    before = (x >= x[begin] - 0.1 * float(np.ptp(x))) & (np.arange(x.size) < begin)
    rise = max(_slope(x[before], y[before])[0], 0.0) if np.sum(before) >= 5 else 0.0
    lost = rise * float(x[end - 1] - x[begin])
    if n >= FLAT_TOP and lost > 3 * (c.step + c.noise):
        finding = f"{n} readings in a row at exactly {c.text(c.sign * top)}, where {c.name} was to rise by {c.text(lost)} more"
        advice = "The channel has reached the end of its range: choose a larger one, or press less."
        return c.verdict("clipping", "bad" if lost > FLAT_TOP_LOSS * c.span else "warning", n, "readings", finding, advice)
    finding = f"{n} reading{'s' if n != 1 else ''} in a row at the largest value, {c.text(c.sign * top)}: no flat top"
    return c.verdict("clipping", "good", n, "readings", finding, "")


def _start(c: _Loading) -> Verdict:
    n = int(np.sum(c.flat))
    travel = max(c.touch - float(c.x[0]), 0.0)
    share = travel / max(float(np.ptp(c.x)), 1e-300)
    advice = "Start the record 0.1 mm or more above the sensor and let the ball come down to it."
    if n < TOO_FEW_BEFORE:
        finding = f"{c.name} changes from the first reading on: the record starts in contact, its contact point is extrapolated"
        first = abs(float(c.y[0])) / c.span
        light = c.name == "force" and first <= LIGHT_TOUCH
        if light:
            finding += f"; a light touch, {_percent(first)} of the range, if the cell was balanced"
        return c.verdict("start before contact", "warning" if light else "bad", travel, c.x_unit, finding, advice)
    level: Level = "warning" if share < SHORT_START or n < FEW_BEFORE else "good"
    shown = f"{travel * 1e3:.3g} mm" if c.x_unit == "m" else f"{travel:.3g} {c.x_unit}"
    finding = f"{c.name} is flat over the first {shown} ({n} readings, {_percent(share)} of the branch)"
    return c.verdict("start before contact", level, travel, c.x_unit, finding, advice)


def _drift(obs: Observations, c: _Loading) -> Verdict | None:
    values = _values(obs, c.name)
    clock = np.arange(len(obs.used), dtype=float) if obs.time is None else obs.time
    flat = c.rows[c.flat]
    # The last fifth before the onset may already be contact that does not show yet.
    flat = flat[: max(TOO_FEW_BEFORE, int(0.8 * flat.size))]
    waiting = np.array([r == HOLD for r in obs.reason], dtype=bool) & (np.arange(len(obs.used)) < c.rows[0])
    if obs.displacement is not None:
        waiting &= obs.displacement <= c.touch
    rows = np.concatenate([np.flatnonzero(waiting), flat])
    rows = rows[np.isfinite(clock[rows]) & np.isfinite(values[rows])]
    if flat.size == 0 or rows.size < FEW_BEFORE:
        return None
    slope, error = _slope(clock[rows], c.sign * values[rows])
    duration = float(clock[c.rows[-1]] - clock[c.rows[0]])
    if not (math.isfinite(error) and math.isfinite(duration)):
        return None
    share, sd = slope * duration / c.span, error * duration / c.span
    sure = abs(share) > 3 * sd
    level = _level(abs(share), DRIFT, LARGE_DRIFT) if sure else "good"
    loading = f"{duration:.3g} {'s' if obs.time is not None else 'readings'} of loading"
    doubt = "" if sure else "; not distinct from none"
    finding = (
        f"before contact {c.name} drifts by {_percent(share)} of its range in the {loading} (sd {_percent(sd)}, from "
        f"{rows.size} readings{doubt})"
    )
    advice = (
        "Let cell and specimen come to rest before the test, press faster, and look for cables that pull."
        if c.name == "force"
        else "Warm the meter up, keep hands and cables away from the leads, and repeat the open correction."
    )
    return c.verdict("drift before contact", level, share, "1", finding, advice)


def _relaxation(obs: Observations, c: _Loading) -> Verdict | None:
    if obs.displacement is None:
        return None
    values = _values(obs, c.name)
    hold = np.array([r == HOLD for r in obs.reason], dtype=bool) & np.isfinite(values)
    begin, end = _longest(hold & (obs.displacement > (c.touch + float(np.max(c.x))) / 2))
    n = end - begin
    if n < 10:
        return None
    ends = max(2, n // 5)
    change = c.sign * (float(np.mean(values[end - ends : end])) - float(np.mean(values[begin : begin + ends])))
    share = change / c.span
    level = _level(abs(share), RELAXATION, LARGE_RELAXATION)
    length = f"{obs.time[end - 1] - obs.time[begin]:.3g} s" if obs.time is not None else f"{n} readings"
    finding = f"{c.name} changes by {_percent(share)} of its range while the crosshead stands for {length} under load"
    advice = "The material relaxes, and the modulus is that of this speed: press at the speed of the use, or much slower."
    return c.verdict("change in the hold", level, share, "1", finding, advice)


def _load_zero(c: _Loading) -> Verdict:
    zero = c.sign * c.zero
    level: Level = "warning" if abs(zero) > min(c.span, LOAD_ZERO_REACH) else "good"
    where = "the force before contact" if np.any(c.flat) else "the first reading of force, in contact or not,"
    share = _percent(abs(zero) / c.span)
    finding = f"{where} is {zero:.3g} N, {share} of the range of {c.text(c.span)}; it is a parameter, not taken off"
    advice = f"Balance the load cell before the test; beyond {LOAD_ZERO_REACH:g} N give load_zero a prior of its own."
    return c.verdict("load zero", level, zero, "N", finding, advice)


def _hysteresis(obs: Observations, c: _Loading) -> Verdict | None:
    if obs.displacement is None:
        return None
    values = _values(obs, c.name)
    branch = np.array(obs.branch, dtype=object)
    number = np.arange(branch.size)
    again = np.flatnonzero((number > c.rows[-1]) & (branch == "loading"))
    first = (number > c.rows[-1]) & (number < (again[0] if again.size else branch.size))
    rows = np.flatnonzero(first & (branch == "unloading") & np.isfinite(values) & np.isfinite(obs.displacement))
    if rows.size < TOO_FEW_READINGS:
        return None
    x, y = obs.displacement[rows], c.sign * values[rows]
    low, high = max(c.touch, float(np.min(x))), min(float(np.max(c.x)), float(np.max(x)))
    if high - low < 0.5 * (float(np.max(c.x)) - c.touch):
        return None
    loading, unloading = (_area(*curve, c.zero, low, high) for curve in ((c.x, c.y), (x, y)))
    if loading <= 0:
        return None
    ratio = (loading - unloading) / loading
    odd = ratio < NEGATIVE_HYSTERESIS
    level = "warning" if odd else _level(ratio, HYSTERESIS, LARGE_HYSTERESIS)
    work = f"{_percent(unloading / loading)} of the {loading * 1e3:.3g} mJ of loading"
    finding = f"unloading gives back {work} (first cycle); only loading is calibrated against"
    advice = (
        "Unloading above loading is not of the material: look for a filter, or a lag between force and displacement."
        if odd
        else "Condition the specimen with a few cycles before the test, or press slower; the modulus is that of loading."
    )
    return c.verdict("hysteresis", level, ratio, "1", finding, advice)


def _compliance(c: _Loading, machine_compliance: float | None) -> Verdict | None:
    force, travel = float(np.max(c.y)) - c.zero, float(np.max(c.x)) - c.touch
    if c.x_unit != "m" or force <= 0 or travel <= 0:
        return None
    given = machine_compliance is not None
    compliance = TYPICAL_COMPLIANCE if machine_compliance is None else machine_compliance
    share = compliance * force / travel
    level = _level(share, COMPLIANCE_SHARE, LARGE_COMPLIANCE_SHARE if given else math.inf)
    shares = (COMPLIANCE_SHARE, LARGE_COMPLIANCE_SHARE)
    limits = " and ".join(f"{_percent(s)} at {s * travel / force * 1e6:.3g}" for s in shares)
    taken = "as given" if given else "a light table-top rig, as none is given"
    finding = (
        f"a machine of {compliance * 1e6:.3g} µm/N ({taken}) takes {_percent(share)} of the {travel * 1e3:.3g} mm of travel at "
        f"{c.text(force)}; it would be {limits} µm/N"
    )
    advice = "Press the ball onto bare steel and give the slope as prior of machine_compliance."
    return c.verdict("machine compliance", level, share, "1", finding, advice)


def _gap(obs: Observations, c: _Loading) -> Verdict | None:
    if obs.time is None:
        return None
    # Holds within the branch are not used, but they are readings: no gap.
    branch = slice(int(c.rows[0]), int(c.rows[-1]) + 1)
    time, values = obs.time[branch], _values(obs, c.name)[branch]
    time = np.maximum.accumulate(time[np.isfinite(time) & np.isfinite(values)])
    usual = float(np.median(np.diff(time))) if time.size >= 10 else 0.0
    if usual <= 0:
        return None
    longest = float(np.max(np.diff(time)))
    share = longest / float(time[-1] - time[0])
    level = _level(share, GAP, LARGE_GAP) if longest > GAP_STEPS * usual else "good"
    size = f"{longest:.3g} s, {longest / usual:.3g} times the usual step and {_percent(share)} of the branch"
    advice = "Readings are missing: look for a stop of the logger, or for rows deleted by hand."
    return c.verdict("gap in time", level, longest, "s", f"longest time without a reading while loading: {size}", advice)


def _even_steps(obs: Observations, c: _Loading) -> Verdict | None:
    if obs.time is None:
        return None
    steps = np.diff(obs.time[c.rows])[np.diff(c.rows) == 1]
    steps = steps[np.isfinite(steps)]
    if steps.size < 10 or float(np.median(steps)) <= 0:
        return None
    low, high = (float(v) for v in np.percentile(steps, [5, 95]))
    ratio = high / max(low, 1e-3 * float(np.median(steps)))
    finding = f"nine of ten time steps lie between {low:.3g} and {high:.3g} s"
    advice = "Log in equal steps of time: the noise is judged as if readings followed each other evenly."
    return c.verdict("even time steps", _level(ratio, UNEVEN_STEPS, math.inf), ratio, "times", finding, advice)


def _area(x: FloatArray, y: FloatArray, zero: float, low: float, high: float) -> float:
    """Integral of y - zero over x from low to high, of means of neighbouring readings."""
    order = np.argsort(x, kind="stable")
    groups = np.array_split(order, min(300, x.size))
    xs, ys = (np.array([v[g].mean() for g in groups]) for v in (x, y))
    at = np.linspace(low, high, 601)
    return float(trapezoid(np.interp(at, xs, ys) - zero, at))


def _longest(mask: BoolArray) -> tuple[int, int]:
    """Begin and end of the longest run of True; equal where there is none."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    if edges.size == 0:
        return 0, 0
    k = int(np.argmax(edges[1::2] - edges[::2]))
    return int(edges[2 * k]), int(edges[2 * k + 1])


def _percent(share: float) -> str:
    return f"{share * 100:.2g} %" if abs(share) < 0.995 else f"{share * 100:.0f} %"

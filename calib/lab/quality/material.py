"""From one channel to grades on what the model leaves out: relaxation and hysteresis of the material, give of the machine."""

from __future__ import annotations

import math

import numpy as np

from calib.lab.observations import Observations
from calib.lab.part import HOLD
from calib.lab.quality.grade import Grade, level_beyond
from calib.lab.quality.loading import LoadingBranch, channel_values, longest_run
from calib.lab.quality.words import percent
from models.sensor import FloatArray

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
#: Readings of the unloading branch from which on its work is known.
LEAST_UNLOADING = 12
#: Share of the travel in contact that the machine takes. The compliance of one rig is known to about 12 % (50-64 N/mm): at 10 %
#: the depth is then known to 1 % and the modulus to 2 %; at 50 % the sensor's share is the smaller one, and the modulus of the
#: same record may double (12 and 23 MPa in a public indentation data set, without and with its compliance).
COMPLIANCE_SHARE, LARGE_COMPLIANCE_SHARE = 0.10, 0.50
#: Machine compliance [m/N] of a light table-top rig, of 50-64 N/mm: what a machine may well have of which nothing is said.
LIGHT_RIG = 1 / 57e3


def check_relaxation(obs: Observations, c: LoadingBranch) -> Grade | None:
    """How much does the channel go on changing while the crosshead stands under load?

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.

    Returns
    -------
    None without a displacement column, or without a hold of ten readings under load.
    """
    if obs.displacement is None:
        return None
    values = channel_values(obs, c.name)
    hold = np.array([r == HOLD for r in obs.reason], dtype=bool) & np.isfinite(values)
    begin, end = longest_run(hold & (obs.displacement > (c.touch + float(np.max(c.x))) / 2))
    n = end - begin
    if n < 10:
        return None
    ends = max(2, n // 5)
    change = c.sign * (float(np.mean(values[end - ends : end])) - float(np.mean(values[begin : begin + ends])))
    share = change / c.span
    level = level_beyond(abs(share), RELAXATION, LARGE_RELAXATION)
    length = f"{obs.time[end - 1] - obs.time[begin]:.3g} s" if obs.time is not None else f"{n} readings"
    finding = f"{c.name} changes by {percent(share)} of its range while the crosshead stands for {length} under load"
    advice = "The material relaxes, and the modulus is that of this speed: press at the speed of the use, or much slower."
    return c.grade("change in the hold", level, share, "1", finding, advice)


def check_hysteresis(obs: Observations, c: LoadingBranch) -> Grade | None:
    """What share of the work of loading does unloading not give back?

    Parameters
    ----------
    obs : the lab file.
    c : the channel that is judged.

    Returns
    -------
    None without an unloading branch over at least half of the travel in contact, and where that is what is used.
    """
    if obs.displacement is None or obs.use.branch == "unloading":
        return None
    values = channel_values(obs, c.name)
    branch = np.array(obs.branch, dtype=object)
    number = np.arange(branch.size)
    again = np.flatnonzero((number > c.rows[-1]) & (branch == "loading"))
    first = (number > c.rows[-1]) & (number < (again[0] if again.size else branch.size))
    rows = np.flatnonzero(first & (branch == "unloading") & np.isfinite(values) & np.isfinite(obs.displacement))
    if rows.size < LEAST_UNLOADING:
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
    level = "warning" if odd else level_beyond(ratio, HYSTERESIS, LARGE_HYSTERESIS)
    work = f"{percent(unloading / loading)} of the {loading * 1e3:.3g} mJ of loading"
    finding = f"unloading gives back {work} (first cycle); only loading is calibrated against"
    advice = (
        "Unloading above loading is not of the material: look for a drift, a filter, or a lag between force and displacement."
        if odd
        else "Condition the specimen with a few cycles before the test, or press slower; the modulus is that of loading."
    )
    return c.grade("hysteresis", level, ratio, "1", finding, advice)


def check_compliance(c: LoadingBranch, machine_compliance: float | None, believed_compliance: float | None) -> Grade | None:
    """What share of the travel is taken by the machine and not by the sensor?

    Where nothing is given, a light table-top rig is warned of, and what a calibration believes instead is told beside it.

    Parameters
    ----------
    c : the force over displacement.
    machine_compliance : [m/N], as given; None if nothing is.
    believed_compliance : [m/N], at most, what a calibration believes where none is given; None if that is not known here.

    Returns
    -------
    None without a displacement column, or without force or travel in contact.
    """
    force, travel = float(np.max(c.y)) - c.zero, float(np.max(c.x)) - c.touch
    if c.x_unit != "m" or force <= 0 or travel <= 0:
        return None
    given = machine_compliance is not None
    compliance = LIGHT_RIG if machine_compliance is None else machine_compliance
    share = compliance * force / travel
    level = level_beyond(share, COMPLIANCE_SHARE, LARGE_COMPLIANCE_SHARE if given else math.inf)
    shares = (COMPLIANCE_SHARE, LARGE_COMPLIANCE_SHARE)
    limits = " and ".join(f"{percent(s)} at {s * travel / force * 1e6:.3g}" for s in shares)
    taken = "at most, as given" if given else "a light table-top rig, as none is given"
    finding = (
        f"a machine of {compliance * 1e6:.3g} µm/N ({taken}) takes {percent(share)} of the {travel * 1e3:.3g} mm of travel at "
        f"{c.text(force)}; it would be {limits} µm/N"
    )
    if not given and believed_compliance is not None:
        finding += (
            f"; without a prior a calibration believes at most {believed_compliance * 1e6:.2g} µm/N, "
            f"{percent(believed_compliance * force / travel)} of the travel"
        )
    advice = "Press the ball onto bare steel and give the slope as prior of machine_compliance."
    return c.grade("machine compliance", level, share, "1", finding, advice)


def _area(x: FloatArray, y: FloatArray, zero: float, low: float, high: float) -> float:
    """Integral of y - zero over x from low to high, of means of neighbouring readings."""
    order = np.argsort(x, kind="stable")
    groups = np.array_split(order, min(300, x.size))
    xs, ys = (np.array([v[g].mean() for g in groups]) for v in (x, y))
    at = np.linspace(low, high, 601)
    return float(np.trapezoid(np.interp(at, xs, ys) - zero, at))

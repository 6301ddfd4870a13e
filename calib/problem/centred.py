"""Default priors that the data centre: where the contact, the load zero and the noise of a sweep may lie, from its readings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from calib.lab import Sweep, hertz_onset, level_before_contact
from calib.priors import LogNormal, Normal, Prior, TruncatedNormal, Uniform, default_prior

#: How the origin of a prior begins of which the records give the width, too, and not the centre alone.
FROM_DATA = "default, as found in the data"

#: Within this distance of zero [m] the onset found in the data agrees with the default prior of the contact offset.
ONSET_NEAR_ZERO = 0.25e-3

#: Within this distance of zero [N] the load before contact agrees with the default prior of the load zero.
LOAD_NEAR_ZERO = 1.0

#: Geometric sd of the prior of a noise around its estimate from the sweeps.
NOISE_FACTOR = 2.0

#: Sd [s] of the prior of a clock offset around its estimate from the data, where that states none.
CLOCK_OFFSET_SD = 0.2


def nominal_zero(sweep: Sweep) -> tuple[float, float]:
    """Estimate crosshead reading at first touch [m] and load before contact [N] from the data; (0, 0) if they show none."""
    for channel, points in sweep.channels.items():  # the tester's record comes first
        force = sweep.load_at(channel)
        if points.displacement is None or force is None:
            continue
        noise = sweep.noise.get("force", float("nan"))
        sd = noise / np.sqrt(points.n_effective) if np.isfinite(noise) else np.zeros(force.size)
        load = level_before_contact(points.displacement, force, sd)
        load = 0.0 if np.isnan(load) else load
        return hertz_onset(points.displacement, force - load), load
    return 0.0, 0.0


def sweep_defaults(sweep: Sweep) -> Mapping[str, tuple[Prior, str]]:
    """Choose default priors of the unknowns of one sweep, centred on what its readings show.

    Returns
    -------
    Unknown -> its prior, and where that comes from, in words.
    """
    priors = {p: (default_prior(p), "default") for p in ("contact_offset", "load_zero")}
    onset, load = nominal_zero(sweep)
    if abs(onset) > ONSET_NEAR_ZERO:
        centre = round(onset, 5)
        priors["contact_offset"] = (
            Uniform(centre - 0.5e-3, centre + 0.5e-3),
            f"default, centred on the onset of force in the data at {centre * 1e3:.2f} mm of crosshead reading",
        )
    if abs(load) > LOAD_NEAR_ZERO:
        centre = round(load, 2)
        priors["load_zero"] = (
            TruncatedNormal(centre, 1.0, centre - 5.0, centre + 5.0),
            f"default, centred on the load before contact in the data, {centre:.2f} N",
        )
    if np.isfinite(sweep.clock_offset):
        told = sweep.clock is None or sweep.clock.confidence != "ambiguous"
        origin = (
            f"{FROM_DATA}, {sweep.clock_offset:.3g} s, and as sure as that is"
            if told
            else "default, as wide as what is possible: the data do not tell the offset of the clocks"
        )
        sd = sweep.clock_offset_sd if sweep.clock_offset_sd > 0.0 else CLOCK_OFFSET_SD
        priors["clock_offset"] = Normal(sweep.clock_offset, sd), origin
    return priors


def noise_default(channel: str, sweeps: Sequence[Sweep]) -> tuple[Prior, str]:
    """Choose the default prior of the noise of one reading: log-normal around what the readings of the sweeps scatter by.

    Parameters
    ----------
    channel : a key of `calib.catalogue.CHANNELS`.
    sweeps : of the experiment.

    Returns
    -------
    The prior, that of the catalogue if no sweep shows a scatter, and where it comes from, in words.
    """
    estimates = [s.noise.get(channel, float("nan")) for s in sweeps]
    good = [e for e in estimates if np.isfinite(e) and e > 0]
    if good:
        return LogNormal(float(np.exp(np.mean(np.log(good)))), NOISE_FACTOR), "default, centred on the scatter of the readings"
    spans = [span for s in sweeps if channel in s.channels and (span := float(np.ptp(s.channels[channel].value))) > 0]
    if any(e == 0 for e in estimates) and spans:
        return LogNormal(1e-4 * max(spans), 3.0), "default, a ten-thousandth of the range: the readings show no scatter"
    return default_prior(f"{channel}_noise"), "default"

"""Draws of sensors, and the posterior that they are of, in, what an answer holds for and leaves open, in words, out."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from calib.catalogue import display
from calib.checks import RULED_OUT, departure_in_words
from calib.decision.sensors import ModelDraws, with_padding
from calib.digits import span_text
from calib.errors import Fault, InputError
from calib.experiment import Experiment
from calib.sampling import Posterior
from models.analytic import caution
from models.sensor import FloatArray

#: A thickness is covered when at least this share of the draws stays inside the model's range.
COVERED_SHARE = 0.95
# Leads that take so much of the signal away, as a share of it, are told.
_LEADS = 0.005
# Where the range of a model ends is told to within this share.
_TO_WITHIN = 1e-3


def open_models_of(posterior: Posterior) -> tuple[str, ...]:
    """Models that the data have not ruled out, if any were held against them: what an answer under this one cannot know."""
    return tuple(departure_in_words(d, posterior) for d in posterior.diagnostics.departures if d.log_bayes > RULED_OUT)


def conditions_of(
    parts: Sequence[ModelDraws], thickest: float, balls: Sequence[float], *, electrode_chosen: bool = False, material: str = ""
) -> tuple[str, ...]:
    """What an answer holds for: what all models take for granted, and in what they differ.

    Parameters
    ----------
    parts : draws of each model.
    thickest : [m], padding that the answer is for.
    balls : [m], radii of the smallest and the largest ball that it is for, or of the one.
    electrode_chosen : whether the electrode is one of the things that were chosen.
    material : that was chosen for the padding; "" for that of the calibration.
    """
    radius = np.concatenate([np.asarray(part.base.electrode_radius) for part in parts]) * 1e3
    spread = f"{np.median(radius):.3g} mm"
    if np.ptp(radius) > 1e-6:
        spread = (
            f"{np.median(radius):.3g} mm (90 % interval {np.quantile(radius, 0.05):.3g} to {np.quantile(radius, 0.95):.3g} mm)"
        )
    rough = [caution(part.member.forward, with_padding(part.base, thickest)) for part in parts]
    ball = f"ball radius {' to '.join(f'{radius * 1e3:.3g}' for radius in balls)} mm"
    choices = [_choices(part.member.posterior.experiment) for part in parts]
    other = "" if electrode_chosen else ": another electrode needs its own recommendation"
    base, contact, padding = (" or ".join(dict.fromkeys(words)) for words in zip(*choices, strict=True))
    return (
        *dict.fromkeys(f"a first look alone: {words}" for words in rough if words),
        base,
        f"electrode radius {spread}{other}",
        f"{ball}, {contact}",
        padding if not material else f"padding of {material}, of the law of the sensor's silicone",
        *_of_leads(parts),
    )


def _of_leads(parts: Sequence[ModelDraws]) -> Iterator[str]:
    """That a signal is that of the sensor alone, if the leads of the lab make it noticeably smaller at the meter."""
    name, found = "parasitic_capacitance", []
    for part in parts:
        posterior = part.member.posterior
        known = posterior.diagnostics.parameters.get(name)
        leads = posterior.fixed.get(name, 0.0) if known is None else known.median
        found.append((leads, leads / (leads + float(np.median(part.base.rest_capacitance)))))
    leads, share = max(found, key=lambda one: one[1])
    if share >= _LEADS:
        yield (
            f"a signal of the sensor alone, C/C0 - 1: with leads of {leads * 1e12:.2g} pF, as in the lab, a meter reads "
            f"{100 * share:.2g} % less of it"
        )


def _choices(e: Experiment) -> tuple[str, str, str]:
    """Base, contact and padding of an experiment as conditions."""
    base = (
        "padding bonded to the rigid base: on a slippery base the sensor is softer and the optimum moves"
        if e.base == "bonded"
        else f"padding that slides on the rigid base, {'with' if e.base_rubs else 'without'} friction: on a bonded one the "
        "sensor is stiffer and the optimum moves"
    )
    contact = "sticking to the sensor" if e.stick else "pressed with friction" if e.rubs else "pressed without friction"
    padding = (
        "padding of the sensor's own silicone"
        if e.padding_material == "sensor"
        else "padding of its own material, with the modulus found for it"
    )
    return base, contact, padding


def require_within_range(part: ModelDraws, grid: FloatArray) -> None:
    """Refuse paddings that go so far beyond what the model covers that hardly any of those that are tried lies within.

    Parameters
    ----------
    part : draws of one model.
    grid : [m], (n_thickness,), ascending, of the paddings that are tried.

    Raises
    ------
    InputError
        With how far the model goes, if it covers the first of them and not the third.
    """

    def covered(thickness: float) -> bool:
        return not part.member.forward.outside(with_padding(part.base, thickness), np.zeros(1))

    low, high = float(grid[0]), float(grid[-1])
    if covered(float(grid[2])) or not covered(low):
        return
    asked = f"padding from {span_text(low * 1e3, high * 1e3)} mm"
    while high - low > _TO_WITHIN * high:
        middle = (low + high) / 2
        low, high = (middle, high) if covered(middle) else (low, middle)
    most = f"{math.floor(low * 1e4) / 10:g} mm"
    name, between = part.member.forward.name, display("padding_thickness", float(grid[1] - grid[0]))
    message = f"{asked}, in steps of {between}, goes beyond what the {name} covers for this sensor, which is up to {most}"
    raise InputError(Fault(message, advice=f"Ask for padding from {span_text(float(grid[0]) * 1e3)} mm to {most} at most"))

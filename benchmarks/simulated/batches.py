"""A seed in, the lab files that a production line would have written out: of specimens to calibrate, and of many more."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
from scipy.interpolate import CubicSpline

from calib.checks import presses_of
from calib.checks.proof.simulation import STEPS, Curve, TrueSweep, write_lab
from calib.experiment import Experiment, Specimen, experiment_toml, read_experiment, read_sweeps
from calib.priors import LogNormal, Normal, Prior
from models.response import Forward
from models.sensor import Design, design_from

EXPERIMENT = Path(__file__).parents[2] / "datasets" / "padded_sensor" / "experiment.toml"

#: What is believed of the lot, of which its truth is drawn, and how far specimens differ.
LOT: Mapping[str, LogNormal | Normal] = MappingProxyType(
    {
        "young_modulus": LogNormal(0.65e6, 1.2),
        "relative_permittivity": Normal(2.8, 0.1),
        "sensor_thickness": Normal(0.74e-3, 0.03e-3),
        "padding_thickness": Normal(1.1e-3, 0.05e-3),
        "dielectric_thickness": Normal(0.16e-3, 0.008e-3),
    }
)
SPREADS: Mapping[str, float] = MappingProxyType(
    {
        "young_modulus": 0.04,
        "relative_permittivity": 0.01,
        "sensor_thickness": 0.03,
        "padding_thickness": 0.03,
        "dielectric_thickness": 0.04,
    }
)
#: Load at which the true signal is told [N].
SIGNAL_AT = 3.0
# Standard deviation [m] of what a microscope reads of a thickness of the specimens that are calibrated.
_READ = {"sensor_thickness": 0.02e-3, "padding_thickness": 0.03e-3, "dielectric_thickness": 0.006e-3}


@dataclass(frozen=True)
class Oddity:
    """What is planted in a specimen.

    Attributes
    ----------
    factors : quantity -> factor.
    ball : radius [m], None for that of the rig.
    """

    factors: Mapping[str, float]
    ball: float | None = None


@dataclass(frozen=True)
class Made:
    """A lot as it was simulated.

    Attributes
    ----------
    experiment : file of the part of it that is calibrated.
    folder : with the lab files of the others.
    truth : name of a specimen -> quantity -> SI value.
    """

    experiment: Path
    folder: Path
    truth: Mapping[str, Mapping[str, float]]


def curve_by(forward: Forward) -> Callable[[TrueSweep], Curve]:
    """Loading curves by any forward model, in the place of the finite elements.

    Parameters
    ----------
    forward : the model.
    """

    def curve(sweep: TrueSweep) -> Curve:
        depth = sweep.depth
        assert depth is not None
        s = np.sqrt(np.linspace(0.0, 1.0, 4 * STEPS + 1) ** 2 * depth)
        found = forward.respond(sweep.design, s**2)
        return Curve(depth, CubicSpline(s, found.force), CubicSpline(s, found.capacitance))

    return curve


def make_lot(
    folder: Path,
    seed: int,
    *,
    lot: int = 3,
    new: int = 50,
    curve: Callable[[TrueSweep], Curve] = TrueSweep.curve,
    odd: Mapping[int, Oddity] = MappingProxyType({}),
    drift: float = 0.0,
) -> Made:
    """Draw a lot, and write the lab files of the specimens that are calibrated, and of those that are made after them.

    Parameters
    ----------
    folder : for all of it.
    seed : of everything that is drawn.
    lot, new : how many specimens are calibrated, and how many are new.
    curve : of a press; by finite elements unless said otherwise.
    odd : number of a new specimen -> what is planted in it.
    drift : share by which the modulus of the new specimens goes up from the first to the last.
    """
    plain = read_experiment(EXPERIMENT)
    press = presses_of(plain, read_sweeps(plain))[0]
    rng = np.random.default_rng([seed, 20261123])
    of_lot = {name: _drawn(prior, rng) for name, prior in LOT.items()}
    rig = {
        "machine_compliance": abs(4e-6 * rng.standard_normal()),
        "parasitic_capacitance": 0.7e-12 * rng.standard_normal(),
        "force_noise": 5e-3,
        "capacitance_noise": 1e-14,
        "force_discrepancy": abs(2e-3 * rng.standard_normal()),
        "capacitance_discrepancy": abs(4e-3 * rng.standard_normal()),
        "load_step": 0.0,
        "displacement_gain": 1.0,
        "force_gain": 1.0,
        "capacitance_gain": 1.0,
    }
    truth: dict[str, dict[str, float]] = {}
    sweeps: list[TrueSweep] = []
    specimens: list[Specimen] = []
    for k in range(lot + new):
        number = k - lot
        name = f"lot {k + 1}" if number < 0 else f"s{number + 1:03d}"
        planted = odd.get(number, Oddity({}))
        own = _cast(of_lot, rng)
        if number >= 0:
            own["young_modulus"] *= 1 + drift * (number / max(new - 1, 1) - 0.5)
        own = {q: value * planted.factors.get(q, 1.0) for q, value in own.items()}
        zeros = {
            "contact_offset": 0.2e-3 + 0.03e-3 * rng.standard_normal(),
            "load_zero": 0.3 * rng.standard_normal(),
            "clock_offset": press.clock_offset + rng.standard_normal(),
        }
        truth[name] = {**own, **zeros}
        design = _design(own, planted.ball or plain.indenter_radius, plain)
        sweeps.append(TrueSweep(replace(press, specimen=name, name=""), design, {**rig, **zeros}))
        read: dict[str, Prior] = {q: Normal(own[q] + sd * rng.standard_normal(), sd) for q, sd in _READ.items()}
        specimens.append(Specimen(name, plain.specimens[0].sweeps, read if number < 0 else {}))
    curves = [curve(sweep) for sweep in sweeps]
    for sweep, pressed in zip(sweeps, curves, strict=True):
        own = truth[sweep.press.specimen]
        own["signal"] = true_signal(pressed, SIGNAL_AT)
    parts = folder / "lot", folder / "new"
    for part in parts:
        part.mkdir(parents=True)
    priors = {**plain.priors, **LOT}
    experiment = replace(plain, name=f"Lot {seed}", pooling="partial", specimens=tuple(specimens[:lot]), priors=priors)
    calibrated = write_lab(experiment, sweeps[:lot], curves[:lot], parts[0], rng)
    for number, (sweep, own_curve) in enumerate(zip(sweeps[lot:], curves[lot:], strict=True)):
        alone = replace(experiment, specimens=(specimens[lot + number],))
        files = write_lab(alone, [sweep], [own_curve], parts[1], rng).specimens[0].sweeps[0]
        for path, kind in ((files.force, "press"), (files.capacitance, "cap")):
            assert path is not None
            path.rename(parts[1] / f"s{number + 1:03d}_{kind}.csv")
    path = parts[0] / "experiment.toml"
    path.write_text(experiment_toml(calibrated, parts[0], {}), encoding="utf-8")
    (folder / "truth.json").write_text(json.dumps({"lot": of_lot, "rig": rig, **truth}, indent=1), encoding="utf-8")
    return Made(path, parts[1], truth)


def true_signal(curve: Curve, force: float) -> float:
    """Change of capacitance C/C0 - 1 at a load [N]; nan where the press does not go so far.

    Parameters
    ----------
    curve : of the press.
    force : [N].
    """
    depth = np.linspace(0.0, curve.end, 2001)
    load, capacitance = curve.at(depth)
    return float(np.interp(force, load, capacitance / capacitance[0] - 1, right=math.nan))


def _drawn(prior: Prior, rng: np.random.Generator) -> float:
    return float(prior.ppf_normal(rng.standard_normal()))


def _cast(of_lot: Mapping[str, float], rng: np.random.Generator) -> dict[str, float]:
    """One specimen of a lot."""
    found = {}
    for quantity, prior in LOT.items():
        away = SPREADS[quantity] * rng.standard_normal()
        value = of_lot[quantity]
        found[quantity] = value * math.exp(away) if isinstance(prior, LogNormal) else value + prior.mean * away
    return found


def _design(own: Mapping[str, float], ball: float, experiment: Experiment) -> Design:
    return design_from({**own, "indenter_radius": ball, "sensor_radius": experiment.sensor_radius})

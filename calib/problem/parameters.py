"""An experiment and its sweeps in, the list of unknowns with their priors, and the way from values to designs, out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from calib.experiment.plan import Experiment, Specimen
from calib.lab.sweep import ForcePoints, Sweep
from calib.priors.prior import Fixed, LogNormal, Normal, Prior, TruncatedNormal, Uniform, default_prior
from models.sensor import Design, FloatArray, Scalar, design_from

#: Within this distance of zero [m] the onset found in the data agrees with the default prior of the contact offset.
ONSET_NEAR_ZERO = 0.25e-3

#: Within this distance of zero [N] the load before contact agrees with the default prior of the load zero.
LOAD_NEAR_ZERO = 1.0

#: Geometric sd of the prior of a noise around its estimate from the sweeps.
NOISE_FACTOR = 2.0

#: Least sd [s] of the prior of a clock offset around its estimate from the data.
CLOCK_OFFSET_SD = 0.2


@dataclass(frozen=True)
class ParameterInfo:
    """One unknown: its name in results, what it is (key of `models.sensor.PARAMETERS`), what it belongs to, its prior.

    Attributes
    ----------
    name : "young_modulus", "sensor_thickness[sensor 1]", or "contact_offset[sensor 1, ball 2]" for one of several sweeps.
    specimen, sweep : empty for what is shared by all specimens, or by all sweeps of the specimen.
    origin : where the prior comes from: "experiment file", "default", or a sentence for a default centred on the data.
    """

    name: str
    parameter: str
    specimen: str
    sweep: str
    prior: Prior
    origin: str = "experiment file"


class Calibrated(Protocol):
    """What knows the experiment and its sweeps: a `Problem` or a `Posterior`."""

    @property
    def experiment(self) -> Experiment:
        """The experiment."""
        ...

    @property
    def sweeps(self) -> tuple[Sweep, ...]:
        """Its reduced data."""
        ...


def sweep_title(sweep: Sweep) -> str:
    """Name of a sweep for people: its specimen, and its own name if it has one."""
    return f"{sweep.specimen}, {sweep.name}" if sweep.name else sweep.specimen


def tied_by(sweep: Sweep) -> str:
    """What tells the depth of the capacitance readings: "displacement", "force" or "clock"; "" if nothing does.

    The most direct wins: the LCR file's own displacement, its own force column, the clock it shares with the tester.
    """
    points = sweep.capacitance
    if points is None:
        return ""
    if points.displacement is not None:
        return "displacement"
    if points.force is not None:
        return "force"
    return "clock" if points.time is not None and sweep.track is not None else ""


def load_before_contact(points: ForcePoints, noise: float) -> float:
    """Median load [N] of the points before contact; nan if the sweep starts in contact.

    Before contact: the leading points that stay within five sd of a point, or 1 % of the range of force, of the first; at
    least three.
    """
    order = np.argsort(points.displacement)
    force, n = points.force[order], points.n_effective[order]
    sd = noise / np.sqrt(n) if np.isfinite(noise) else np.zeros(force.size)
    close = np.abs(force - force[0]) <= np.maximum(5 * sd, 0.01 * np.ptp(force))
    n_before = int(np.argmin(close)) if not np.all(close) else force.size
    return float(np.median(force[:n_before])) if n_before >= 3 else float("nan")


def onset_reading(points: ForcePoints, load_zero: float) -> float:
    """Crosshead reading [m] at which a line through F^(2/3) (Hertz) of the first half of the loading meets zero load.

    Good to some tens of micrometres: it centres a prior, it is not an estimate of the contact offset.
    """
    force = np.maximum(points.force - load_zero, 0.0)
    top = float(np.max(force))
    part = (force > 0.03 * top) & (force < 0.5 * top)
    if np.count_nonzero(part) < 3:
        part = force > 0
    if np.count_nonzero(part) < 3 or np.ptp(points.displacement[part]) == 0:
        return float(np.min(points.displacement))
    slope, intercept = np.polyfit(points.displacement[part], np.cbrt(force[part]) ** 2, 1)
    onset = -intercept / slope if slope > 0 else np.min(points.displacement)
    return float(np.clip(onset, np.min(points.displacement) - 0.5e-3, np.max(points.displacement)))


def _crosshead_and_force(sweep: Sweep) -> ForcePoints | None:
    """Points of crosshead reading and load of a sweep, from whichever record has both."""
    if sweep.force is not None:
        return sweep.force
    points = sweep.capacitance
    if points is not None and points.displacement is not None and points.force is not None:
        return ForcePoints(points.displacement, points.force, points.n_effective)
    return None


def nominal_zero(sweep: Sweep) -> tuple[float, float]:
    """Crosshead reading at first touch [m] and load before contact [N] as the data show them; (0, 0) where they do not."""
    points = _crosshead_and_force(sweep)
    if points is None:
        return 0.0, 0.0
    load = load_before_contact(points, sweep.force_noise)
    load = 0.0 if np.isnan(load) else load
    return onset_reading(points, load), load


def _sweep_defaults(sweep: Sweep) -> Mapping[str, tuple[Prior, str]]:
    """Default priors of what belongs to one sweep, those whose centre the data move included, with their origin."""
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
        # Where the data do not tell, the sd is that of all that is possible and needs no factor.
        sd = (3 if told else 1) * sweep.clock_offset_sd if np.isfinite(sweep.clock_offset_sd) else 0.0
        origin = (
            f"default, centred on the offset found in the data, {sweep.clock_offset:.3g} s"
            if told
            else "default, as wide as what is possible: the data do not tell the offset of the clocks"
        )
        priors["clock_offset"] = Normal(sweep.clock_offset, max(sd, CLOCK_OFFSET_SD)), origin
    return priors


def _noise_default(parameter: str, estimates: Sequence[float], ranges: Sequence[float]) -> tuple[Prior, str]:
    """Prior of the noise of one reading: log-normal around the sweeps' estimate; default without one."""
    good = [e for e in estimates if np.isfinite(e) and e > 0]
    if good:
        return LogNormal(float(np.exp(np.mean(np.log(good)))), NOISE_FACTOR), "default, centred on the scatter of the readings"
    spans = [r for r in ranges if r > 0]
    if any(e == 0 for e in estimates) and spans:
        return LogNormal(1e-4 * max(spans), 3.0), "default, a ten-thousandth of the range: the readings show no scatter"
    return default_prior(parameter), "default"


def list_parameters(experiment: Experiment, sweeps: Sequence[Sweep]) -> tuple[tuple[ParameterInfo, ...], dict[str, float]]:
    """All unknowns of an experiment in a fixed order, and the values of those that are fixed.

    Shared ones come first, then those of each specimen, then those of each of its sweeps. Parameters of a measurement that
    nobody made are left out: nothing electrical without capacitance readings. `dielectric_thickness` and `electrode_radius`
    are unknowns only if a prior names them; else they are derived (half the sensor, the disc).
    """
    electrical = any(s.capacitance is not None for s in sweeps)
    ties = [tied_by(s) for s in sweeps]
    forces = any(s.force is not None for s in sweeps)
    needs_force_noise = forces or "force" in ties
    shared = ["young_modulus"]
    if experiment.padding_material == "own":
        shared.append("padding_young_modulus")
    if experiment.law == "gent":
        shared.append("stiffening")
    if electrical or isinstance(experiment.priors.get("relative_permittivity"), Fixed):
        shared.append("relative_permittivity")
    if _worth_naming(experiment.priors.get("electrode_radius"), electrical):
        shared.append("electrode_radius")
    if electrical:
        shared.append("parasitic_capacitance")
    if forces or any(t in ("displacement", "clock") for t in ties):
        shared.append("machine_compliance")
    shared += ["force_noise"] if needs_force_noise else []
    shared += ["capacitance_noise"] if electrical else []
    if experiment.discrepancy == "on":
        shared += ["force_discrepancy"] if forces else []
        shared += ["capacitance_discrepancy"] if electrical else []

    noises = {
        "force_noise": _noise_default(
            "force_noise",
            [s.force_noise for s in sweeps],
            [float(np.ptp(s.force.force)) for s in sweeps if s.force is not None],
        ),
        "capacitance_noise": _noise_default(
            "capacitance_noise",
            [s.capacitance_noise for s in sweeps],
            [float(np.ptp(s.capacitance.capacitance)) for s in sweeps if s.capacitance is not None],
        ),
    }
    found: list[ParameterInfo] = []

    def add(
        parameter: str, given: Prior | None, fallback: tuple[Prior, str] | None, specimen: str = "", sweep: str = ""
    ) -> None:
        where = ", ".join(w for w in (specimen, sweep) if w)
        prior, origin = (given, "experiment file") if given is not None else fallback or (default_prior(parameter), "default")
        found.append(ParameterInfo(f"{parameter}[{where}]" if where else parameter, parameter, specimen, sweep, prior, origin))

    for p in shared:
        add(p, experiment.priors.get(p), noises.get(p))
    for specimen in experiment.specimens:
        own = [s for s in sweeps if s.specimen == specimen.name]
        if not own:
            continue
        for p in ("sensor_thickness", "padding_thickness"):
            add(p, _given(experiment, specimen, p), None, specimen.name)
        dielectric = _given(experiment, specimen, "dielectric_thickness")
        if _worth_naming(dielectric, any(s.capacitance is not None for s in own)):
            add("dielectric_thickness", dielectric, None, specimen.name)
        for sweep in own:
            defaults = _sweep_defaults(sweep)
            name = sweep.name if len(own) > 1 else ""
            for p in _of_sweep(sweep):
                add(p, _given(experiment, specimen, p), defaults.get(p), specimen.name, name)
    fixed = {i.name: i.prior.value for i in found if isinstance(i.prior, Fixed)}
    return tuple(i for i in found if i.name not in fixed), fixed


def _worth_naming(prior: Prior | None, electrical: bool) -> bool:
    """Whether a derived parameter is listed: if a prior names it, and there are data on it or it is known anyway."""
    return prior is not None and (electrical or isinstance(prior, Fixed))


def _given(experiment: Experiment, specimen: Specimen, parameter: str) -> Prior | None:
    return specimen.priors.get(parameter, experiment.priors.get(parameter))


def _of_sweep(sweep: Sweep) -> list[str]:
    """Unknowns of one sweep: those that its records depend on."""
    tie = tied_by(sweep)
    found = []
    if sweep.force is not None or tie in ("clock", "displacement"):
        found.append("contact_offset")
    if sweep.force is not None or tie == "force":
        found.append("load_zero")
    if tie == "clock":
        found.append("clock_offset")
    return found


def lookup(values: Mapping[str, FloatArray], parameter: str, specimen: str = "", sweep: str = "") -> FloatArray | None:
    """Values of a parameter for a sweep: its own, else its specimen's, else the shared ones, else None."""
    for name in (f"{parameter}[{specimen}, {sweep}]", f"{parameter}[{specimen}]", parameter):
        if name in values:
            return values[name]
    return None


def design_values(known: Calibrated, values: Mapping[str, FloatArray], specimen: str, sweep: str) -> dict[str, FloatArray]:
    """Arguments of `models.sensor.design_from` of the draws `values`, each (n_draw,); nothing is checked.

    Without capacitance readings nothing electrical was inferred; the permittivity is then the median of its prior.
    """
    experiment = known.experiment
    ball = next(s.indenter_radius for s in known.sweeps if s.specimen == specimen and s.name == sweep)
    wanted = ["young_modulus", "sensor_thickness", "padding_thickness", "relative_permittivity"]
    optional = ["electrode_radius", "dielectric_thickness"]
    if experiment.padding_material == "own":
        wanted.append("padding_young_modulus")
    if experiment.law == "gent":
        wanted.append("stiffening")
    found = {p: lookup(values, p, specimen, sweep) for p in wanted + optional}
    shape = np.broadcast_shapes(*(np.shape(v) for v in found.values() if v is not None))
    design: dict[str, FloatArray] = {
        "indenter_radius": np.full(shape, ball),
        "sensor_radius": np.full(shape, experiment.sensor_radius),
    }
    for p, v in found.items():
        if v is not None:
            design[p] = np.broadcast_to(v, shape)
        elif p == "relative_permittivity":
            prior = experiment.priors.get(p, default_prior(p))
            design[p] = np.full(shape, float(prior.ppf_normal(0.0)))
        elif p in wanted:
            raise KeyError(f"{p} of specimen {specimen!r} is not among {', '.join(values)}")
    return design


def specimen_design(known: Calibrated, values: Mapping[str, FloatArray], specimen: str, sweep: str = "") -> Design:
    """Designs of a specimen under the ball of one of its sweeps (default the first), a batch of the draws in `values`.

    Parameters
    ----------
    known : a `Problem` or a `Posterior`.
    values : parameter name -> SI values (n_draw,), those that are fixed included, as `thin_draws` gives them.

    Raises
    ------
    KeyError
        If a parameter that the design needs is not among the values, or the specimen or sweep does not exist.
    ValueError
        If a value breaks a rule of a design (see `models.sensor`).
    """
    names = [s.name for s in known.sweeps if s.specimen == specimen]
    if not names or (sweep and sweep not in names):
        raise KeyError(f"there is no sweep {sweep!r} of a specimen {specimen!r}")
    design: Mapping[str, Scalar] = design_values(known, values, specimen, sweep or names[0])
    return design_from(design, friction_coefficient=known.experiment.friction_coefficient)

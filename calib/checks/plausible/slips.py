"""An experiment and its sweeps in, the slips that may have been made out: each with the experiment as it would be without it.

A slip is what happens to a careful person: a diameter typed for a radius, kN for N, two files or two thicknesses mixed up.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from itertools import combinations

from calib.catalogue import CHANNELS, display
from calib.experiment import Experiment
from calib.lab import Points, Sweep
from calib.priors import LogNormal, Normal, Prior, TruncatedNormal, default_prior

# Share of a record's duration by which the clocks may lie apart if it belongs to the other specimen.
_CLOCK_SHARE = 0.05
# A thickness may be the total of two if it is so much larger than the other part.
_WHOLE = 1.1
# Pairs of specimens that are looked at, of which there are too many in a large experiment.
_MOST_PAIRS = 6
# Factors of units that are mixed up, and how that is said.
_FORCE_UNITS: Mapping[float, str] = {
    1e-3: "a thousandth of this force, as if N were called kN",
    1e3: "a thousand times this force, as if kN were called N",
    9.80665: "9.81 times this force, as if kgf were called N",
    1 / 9.80665: "a 9.81th of this force, as if N were called kgf",
    4.448222: "4.45 times this force, as if lbf were called N",
    1 / 4.448222: "a 4.45th of this force, as if N were called lbf",
    9.80665e-3: "0.00981 times this force, as if gf were called N",
}


@dataclass(frozen=True, eq=False)
class Slip:
    """One slip that may have been made, and the experiment as it would be without it.

    Attributes
    ----------
    gate : what it is about, in a word or two.
    without : how the data are read then, to follow "with", such as "half this radius of the ball (2.5 mm)".
    question : to the user, as an action: "Look whether its diameter was entered for its radius".
    experiment, sweeps : without the slip.
    same_data : whether the readings are the same numbers, so that the evidences of both problems can be compared.
    hidden : whether the data may look sound with it, other unknowns taking its place: such a slip is always looked for.
    exchange : of which two presses files are exchanged, and which files: to exchange the force files of two specimens, or their
        capacitance files, is one exchange, but for which of the two is called which.
    """

    gate: str
    without: str
    question: str
    experiment: Experiment
    sweeps: tuple[Sweep, ...]
    same_data: bool = True
    hidden: bool = False
    exchange: tuple[str, str] = ("", "")


def slips_of(experiment: Experiment, sweeps: Sequence[Sweep]) -> Iterator[Slip]:
    """All slips that may have been made in an experiment, what is easily mixed up first.

    Parameters
    ----------
    experiment : as it was written.
    sweeps : its data.
    """
    sweeps = tuple(sweeps)
    yield from _radii(experiment, sweeps)
    yield from _thicknesses(experiment, sweeps)
    yield from _mixed_up(experiment, sweeps)
    yield from _units(experiment, sweeps)


def _radii(experiment: Experiment, sweeps: tuple[Sweep, ...]) -> Iterator[Slip]:
    for k, words in ((0.5, "half"), (2.0, "twice")):
        typed = "its diameter was entered for its radius" if k < 1 else "half its radius was entered"
        radii = sorted({sweep.indenter_radius for sweep in sweeps})
        if len(radii) > 1:
            yield Slip(
                "ball",
                f"{words} these radii of the balls",
                f"Measure the balls, and look whether {typed.replace('its', 'their')}",
                replace(experiment, indenter_radius=k * experiment.indenter_radius),
                tuple(replace(s, indenter_radius=k * s.indenter_radius) for s in sweeps),
                hidden=True,
            )
        for radius in radii:
            some = tuple(replace(s, indenter_radius=k * radius) if s.indenter_radius == radius else s for s in sweeps)
            yield Slip(
                "ball",
                f"{words} this radius of the ball ({display('indenter_radius', k * radius)})",
                f"Measure the ball, and look whether {typed}",
                _with_prior(replace(experiment, indenter_radius=k * experiment.indenter_radius), "indenter_radius", k),
                some,
                hidden=True,
            )
        name = "electrode_radius" if "electrode_radius" in experiment.priors else "sensor_radius"
        if not any("capacitance" in sweep.channels for sweep in sweeps):
            continue
        what = "electrodes" if name == "electrode_radius" else "sensor's disc"
        changed = _with_prior(experiment, name, k)
        if name == "sensor_radius":
            changed = replace(changed, sensor_radius=k * changed.sensor_radius)
        typed = "the diameter was entered for the radius" if k < 1 else "half the radius was entered"
        said = f"{words} this radius of the {what}"
        yield Slip(what, said, f"Measure the {what}, and look whether {typed}", changed, sweeps)


def _thicknesses(experiment: Experiment, sweeps: tuple[Sweep, ...]) -> Iterator[Slip]:
    sensor, padding, dielectric = "sensor_thickness", "padding_thickness", "dielectric_thickness"

    def known(name: str) -> bool:
        return all(name in s.priors for s in experiment.specimens)

    def slip(gate: str, without: str, question: str, change: Callable[[Mapping[str, Prior]], dict[str, Prior]]) -> Slip:
        own = tuple(replace(s, priors={**s.priors, **change(s.priors)}) for s in experiment.specimens)
        return Slip(gate, without, question, replace(experiment, specimens=own), sweeps)

    if known(sensor) and known(padding):
        question = f"Look whether {sensor} and {padding} were mixed up"
        without = "the thicknesses of sensor and padding exchanged"
        yield replace(slip("thicknesses", without, question, lambda p: {sensor: p[padding], padding: p[sensor]}), hidden=True)
        for whole, part in ((sensor, padding), (padding, sensor)):
            if all(_median(s.priors[whole]) > _WHOLE * _median(s.priors[part]) for s in experiment.specimens):
                question = f"Look whether the total thickness was entered as {whole}"
                without = f"{whole} less {part}, as if it were the total of both"
                yield slip("thicknesses", without, question, partial(_without_part, whole, part))
    for name in filter(known, (sensor, padding, dielectric)):
        for k, words in ((10.0, "ten times"), (0.1, "a tenth of"), (1e3, "a thousand times"), (1e-3, "a thousandth of")):
            question = f"Look at the unit and the decimal point of {name}"
            yield slip("thicknesses", f"{words} this {name}", question, partial(_scaled, name, k))
    if known(dielectric) and any("capacitance" in sweep.channels for sweep in sweeps):
        for k, words in ((2.0, "twice"), (0.5, "half")):
            question = f"Look at the number of dielectrics: {dielectric} is that of each of the two"
            yield slip("dielectrics", f"{words} this {dielectric}", question, partial(_scaled, dielectric, k))


def _scaled(name: str, k: float, priors: Mapping[str, Prior]) -> dict[str, Prior]:
    return {name: scaled(priors[name], k)}


def _without_part(whole: str, part: str, priors: Mapping[str, Prior]) -> dict[str, Prior]:
    prior, value = priors[whole], _median(priors[part])
    if isinstance(prior, Normal | TruncatedNormal):
        return {whole: replace(prior, mean=prior.mean - value)}
    return {whole: scaled(prior, 1 - value / _median(prior))}


def _mixed_up(experiment: Experiment, sweeps: tuple[Sweep, ...]) -> Iterator[Slip]:
    places = {sweep.title: k for k, sweep in enumerate(sweeps)}
    pairs = list(combinations(sweeps, 2))
    for one, other in pairs:
        if one.specimen == other.specimen and one.indenter_radius != other.indenter_radius:
            exchanged = list(sweeps)
            exchanged[places[one.title]] = replace(one, indenter_radius=other.indenter_radius)
            exchanged[places[other.title]] = replace(other, indenter_radius=one.indenter_radius)
            said = f"the balls of {one.title} and {other.title} exchanged"
            yield Slip("ball", said, "Look which ball was used for which file", experiment, tuple(exchanged))
    apart = [(one, other) for one, other in pairs if one.specimen != other.specimen and one.name == other.name]
    for one, other in apart[:_MOST_PAIRS]:
        shared = [name for name in CHANNELS if name in one.channels and name in other.channels]
        for names in (*([name] for name in shared), *([shared] if len(shared) > 1 else [])):
            exchanged = list(sweeps)
            exchanged[places[one.title]] = _with_channels_of(one, other, names)
            exchanged[places[other.title]] = _with_channels_of(other, one, names)
            what = " and ".join(names)
            said = f"the {what} files of {one.specimen} and {other.specimen} exchanged"
            of_both = (f"{one.title}, {other.title}", what)
            question = "Look which file is of which specimen"
            yield Slip("files", said, question, experiment, tuple(exchanged), exchange=of_both)


def _with_channels_of(sweep: Sweep, other: Sweep, names: Sequence[str]) -> Sweep:
    """A sweep with channels of another one, which bring clock and noise along, and, with the force, the tester's record."""
    channels = {name: (other if name in names else sweep).channels[name] for name in sweep.channels}
    noise = {name: (other if name in names else sweep).noise.get(name, float("nan")) for name in sweep.noise}
    changed = replace(sweep, channels=channels, noise=noise)
    if "force" in names:
        changed = replace(changed, track=other.track, contact=other.contact)
    if "capacitance" not in names and "force" not in names:
        return changed
    if set(names) >= {"force", "capacitance"}:
        return replace(changed, clock_offset=other.clock_offset, clock_offset_sd=other.clock_offset_sd, clock=other.clock)
    if changed.track is None:
        return changed
    meter = other if "capacitance" in names else sweep
    sd = _CLOCK_SHARE * float(changed.track.time[-1] - changed.track.time[0])
    return replace(changed, clock_offset=meter.clock_offset, clock_offset_sd=sd, clock=None)


def _units(experiment: Experiment, sweeps: tuple[Sweep, ...]) -> Iterator[Slip]:
    if any(sweep.load_at(name) is not None for sweep in sweeps for name in sweep.channels):
        for k, words in _FORCE_UNITS.items():
            some = tuple(_with_force_in(sweep, k) for sweep in sweeps)
            yield Slip("unit of force", words, "Look at the unit of the force column", experiment, some, same_data=False)
    for k in (1e3, 1e-3):
        changed = _with_prior(experiment, "young_modulus", k, default=True)
        said = f"a prior of young_modulus that is {k:.6g} times as large"
        yield Slip("unit of modulus", said, "Look at the unit of young_modulus: kPa or MPa", changed, sweeps)
    if any("capacitance" in sweep.channels for sweep in sweeps):
        for k in (1e3, 1e-3):
            some = tuple(_with_capacitance_in(sweep, k) for sweep in sweeps)
            said = f"{k:.6g} times this capacitance"
            yield Slip("unit of capacitance", said, "Look at the unit of the capacitance column", experiment, some, False)


def _with_force_in(sweep: Sweep, k: float) -> Sweep:
    def points(name: str, p: Points) -> Points:
        force = None if p.force is None else k * p.force
        return replace(p, value=k * p.value if name == "force" else p.value, force=force)

    track = None if sweep.track is None else replace(sweep.track, force=k * sweep.track.force)
    noise = {name: k * sd if name == "force" else sd for name, sd in sweep.noise.items()}
    return replace(sweep, channels={n: points(n, p) for n, p in sweep.channels.items()}, track=track, noise=noise)


def _with_capacitance_in(sweep: Sweep, k: float) -> Sweep:
    if "capacitance" not in sweep.channels:
        return sweep
    points = sweep.channels["capacitance"]
    noise = {name: k * sd if name == "capacitance" else sd for name, sd in sweep.noise.items()}
    return replace(sweep, channels={**sweep.channels, "capacitance": replace(points, value=k * points.value)}, noise=noise)


def _with_prior(experiment: Experiment, name: str, k: float, *, default: bool = False) -> Experiment:
    """The experiment with a prior scaled, where it has one of its own, or by default."""
    prior = experiment.priors.get(name, default_prior(name) if default else None)
    return experiment if prior is None else replace(experiment, priors={**experiment.priors, name: scaled(prior, k)})


def scaled(prior: Prior, k: float) -> Prior:
    """The prior of k times a quantity.

    Parameters
    ----------
    prior : of the quantity.
    k : positive.
    """
    if isinstance(prior, LogNormal):
        return replace(prior, median=k * prior.median)
    return replace(prior, **{f.name: k * getattr(prior, f.name) for f in fields(prior)})


def _median(prior: Prior) -> float:
    return float(prior.ppf_normal(0.0))

"""A truth and how a lab pressed in, the files that it would have written out: finite elements, all nuisances, and noise.

The simulated lab is that of `calib.problem.measurement`, whose equations the numbers below mean; its curves are those of the
finite elements, not of the surrogate that the calibration uses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from calib.checks.proof.presses import Log, SimulatedPress
from calib.errors import Fault, InputError
from calib.experiment import Experiment, Specimen, SweepFiles
from calib.lab import AS_FOUND, draw_once_turned
from calib.problem import Calibrated, correlation_between, lookup, specimen_design
from models.fem import FiniteElements
from models.sensor import Design, FloatArray

#: Steps of the finite elements on the way down, and their accuracy.
STEPS, ACCURACY = 32, 5e-4

# Points between which the way of the crosshead is turned into depth, and share of the way that lies before contact.
_FINE = 4001

# Degree of the polynomial by which a curve grows, over the root of depth, faster than by Hertz's law.
_DEGREE = 8


@dataclass(frozen=True, eq=False)
class Curve:
    """The loading curve of one sensor under one ball, as splines over the root of depth, as smooth as that of a sensor is.

    Attributes
    ----------
    end : [m], how deep it goes.
    force, capacitance : [N], [F].
    """

    end: float
    force: CubicSpline
    capacitance: CubicSpline

    def at(self, depth: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Force [N] and capacitance [F] at depths [m], any shape; nothing is pressed above zero."""
        s = np.sqrt(np.clip(depth, 0.0, self.end))
        return np.asarray(self.force(s)), np.asarray(self.capacitance(s))


def curve_of(design: Design, *, depth: float | None = None, force: float | None = None) -> Curve:
    """Press one sensor by finite elements, to a depth or to a force.

    As the edge of contact goes from element to element, force and change of capacitance are off from step to step, by a
    twenty-thousandth of the largest (sd) at this accuracy. A sensor has no elements: in its readings this would be noise that
    nobody drew, of the size of what is left of 5 mN in the mean of thirty readings. With x the root of depth over its largest,
    both are therefore x^3 p(x), Hertz's law times a polynomial, by least squares: what that leaves of eight kinds of design is
    the roughness alone, and from there to finer elements is a smooth ten-thousandth.

    Parameters
    ----------
    design : one, not a batch.
    depth : [m], how deep.
    force : [N], how hard, where the depth is not known.

    Raises
    ------
    OutOfRangeError, ConvergenceError
        Of the finite elements.
    """
    fem = FiniteElements(ACCURACY)
    way = np.linspace(0.0, 1.0, STEPS + 1)[1:] ** 2
    pressed = fem.respond_to_force(design, way * (force or 0.0)) if depth is None else fem.respond(design, way * depth)
    root = np.sqrt(pressed.depth)
    at_rest = float(np.asarray(design.rest_capacitance))
    return Curve(
        float(pressed.depth[-1]),
        _through(root, pressed.force, 0.0),
        _through(root, pressed.capacitance, at_rest),
    )


def _through(root: FloatArray, value: FloatArray, at_rest: float) -> CubicSpline:
    """A spline over the root of depth through x^3 p(x), fitted to what rises from rest in steps."""
    x = root / root[-1]
    # What steps are off by grows with what they are off from, but more slowly.
    basis, weight = x[:, None] ** 3 * np.polynomial.chebyshev.chebvander(2 * x - 1, _DEGREE), x**-1.5
    coefficients = np.linalg.lstsq(basis * weight[:, None], (value - at_rest) * weight, rcond=None)[0]
    return CubicSpline(np.concatenate([[0.0], root]), at_rest + np.concatenate([[0.0], basis @ coefficients]))


@dataclass(frozen=True, eq=False)
class TrueSweep:
    """What is true of one press: its design, and the values of the unknowns of its rig, 0 or 1 for those that do not exist.

    Attributes
    ----------
    press : how it was pressed.
    design : one, not a batch.
    values : unknown -> SI value.
    """

    press: SimulatedPress
    design: Design
    values: Mapping[str, float]

    @property
    def reading(self) -> FloatArray | None:
        """Crosshead [m] of the record that ties the press, so moved that contact comes as far from its start as it did."""
        log = self.press.tester or self.press.meter
        if log is None or log.displacement is None:
            return None
        return self._moved(log.displacement)

    @property
    def at_contact(self) -> float:
        """Reading of the crosshead where contact begins [m]."""
        v = self.values
        return v["contact_offset"] + v["displacement_gain"] * v["machine_compliance"] * v["load_zero"] / v["force_gain"]

    def _moved(self, displacement: FloatArray) -> FloatArray:
        contact = self.press.contact
        return displacement if np.isnan(contact) else displacement - contact + self.at_contact

    @property
    def depth(self) -> float | None:
        """A depth [m] that the press does not go beyond; None where it is known by force alone."""
        if self.reading is None:
            return None
        give = self.values["machine_compliance"] * abs(self.values["load_zero"]) / self.values["force_gain"]
        return (float(np.max(self.reading)) - self.values["contact_offset"]) / self.values["displacement_gain"] + give

    @property
    def force(self) -> float | None:
        """Largest true force [N] of a press that is known by force alone."""
        log = self.press.meter
        if log is None or log.force is None:
            return None
        return float(np.max(log.force) - self.press.load) / self.values["force_gain"]

    def curve(self) -> Curve:
        """Its loading curve by finite elements, as far as it was pressed."""
        if (depth := self.depth) is not None:
            return curve_of(self.design, depth=depth)
        return curve_of(self.design, force=self.force)


#: Value of an unknown of the rig that does not exist.
_ABSENT: Mapping[str, float] = {
    **dict.fromkeys(
        ("contact_offset", "machine_compliance", "load_zero", "load_step", "parasitic_capacitance", "clock_offset"), 0.0
    ),
    **dict.fromkeys(("force_noise", "capacitance_noise", "force_discrepancy", "capacitance_discrepancy"), 0.0),
    **dict.fromkeys(("displacement_gain", "force_gain", "capacitance_gain"), 1.0),
}


def true_sweeps(known: Calibrated, values: Mapping[str, float], presses: Sequence[SimulatedPress]) -> tuple[TrueSweep, ...]:
    """What is true of every press, given the values of all unknowns.

    Parameters
    ----------
    known : the experiment and its sweeps.
    values : name of an unknown -> SI value, fixed ones included.
    presses : in the order of the sweeps.

    Raises
    ------
    ValueError
        If the values make no sensor.
    """
    one = {name: np.array([value]) for name, value in values.items()}
    found = []
    for press in presses:
        of_rig = {name: lookup(one, name, press.specimen, press.name) for name in _ABSENT}
        own = {name: _ABSENT[name] if value is None else float(value[0]) for name, value in of_rig.items()}
        found.append(TrueSweep(press, specimen_design(known, one, press.specimen, press.name).draw(0), own))
    return tuple(found)


def write_lab(
    experiment: Experiment, sweeps: Sequence[TrueSweep], curves: Sequence[Curve], folder: Path, rng: np.random.Generator
) -> Experiment:
    """Write the files of a simulated lab.

    Parameters
    ----------
    experiment : whose lab it is.
    sweeps : what is true of each of its presses.
    curves : of each.
    folder : for the files.
    rng : of the noise and of the discrepancy.

    Returns
    -------
    The same experiment with these files, which are read without being told anything of them.
    """
    of_press: dict[tuple[str, str], tuple[Path | None, Path | None]] = {}
    left = _left_out(experiment, sweeps, curves, rng)
    for k, (sweep, curve) in enumerate(zip(sweeps, curves, strict=True)):
        at = (sweep.press.specimen, sweep.press.name)
        of_press[at] = _write_press(_way(sweep, curve, left.get(at), rng), sweep, folder, k, rng)

    def files(specimen: Specimen, f: SweepFiles) -> SweepFiles:
        force, capacitance = of_press[specimen.name, f.name]
        return replace(f, force=force, capacitance=capacitance, force_reading=AS_FOUND, capacitance_reading=AS_FOUND)

    specimens = tuple(replace(s, sweeps=tuple(files(s, f) for f in s.sweeps)) for s in experiment.specimens)
    return replace(experiment, specimens=specimens)


@dataclass(frozen=True, eq=False)
class _Way:
    """Load [N], crosshead [m] and capacitance [F] over depths [m] from before contact to the end, without noise."""

    depth: FloatArray
    load: FloatArray
    reading: FloatArray
    capacitance: FloatArray


@dataclass(frozen=True, eq=False)
class _LeftOut:
    """What the model leaves out of presses that repeat each other, as functions of depth over the deepest of theirs [m]."""

    deepest: float
    force: CubicSpline
    capacitance: CubicSpline


def _left_out(
    experiment: Experiment, sweeps: Sequence[TrueSweep], curves: Sequence[Curve], rng: np.random.Generator
) -> dict[tuple[str, str], _LeftOut]:
    """What presses of one specimen under one ball share, by specimen and sweep; nothing of a press that nobody repeated."""
    balls = {(s.name, f.name): f.indenter_radius for s in experiment.specimens for f in s.sweeps}
    together: dict[tuple[str, float], list[tuple[TrueSweep, Curve]]] = {}
    for sweep, curve in zip(sweeps, curves, strict=True):
        specimen, name = sweep.press.specimen, sweep.press.name
        together.setdefault((specimen, balls[specimen, name]), []).append((sweep, curve))
    found: dict[tuple[str, str], _LeftOut] = {}
    for presses in together.values():
        if len(presses) > 1:
            left = _LeftOut(max(_deepest(*press) for press in presses), _process(rng), _process(rng))
            found |= {(sweep.press.specimen, sweep.press.name): left for sweep, _ in presses}
    return found


def _deepest(sweep: TrueSweep, curve: Curve) -> float:
    """What the crosshead reads at the end of a press [m], from contact on."""
    if (way := sweep.reading) is not None:
        return float(np.max(way) - sweep.at_contact)
    force, _ = curve.at(np.array([curve.end]))
    return sweep.values["displacement_gain"] * (curve.end + sweep.values["machine_compliance"] * float(force[0]))


def _way(sweep: TrueSweep, curve: Curve, left: _LeftOut | None, rng: np.random.Generator) -> _Way:
    """Equations (1) to (3), with a discrepancy as in (4), on a fine grid."""
    v = sweep.values
    depth = np.linspace(-0.5 * curve.end, curve.end, _FINE)
    force, capacitance = curve.at(depth)
    at_rest = float(curve.capacitance(0.0))
    # The process of a press by itself runs along what the crosshead reads, as the likelihood has it, which the load zero only
    # moves; that of presses that repeat each other along the depth.
    along = v["displacement_gain"] * (depth + v["machine_compliance"] * force)
    share = np.clip(along / _deepest(sweep, curve) if left is None else depth / left.deepest, 0.0, None)
    of_force = np.asarray((_process(rng) if left is None else left.force)(share))
    load = v["force_gain"] * force * (1 + v["force_discrepancy"] * of_force) + v["load_zero"] + v["load_step"] * (depth > 0)
    of_signal = np.asarray((_process(rng) if left is None else left.capacitance)(share))
    signal = (capacitance - at_rest) * (1 + v["capacitance_discrepancy"] * of_signal)
    reading = v["displacement_gain"] * (depth + v["machine_compliance"] * load / v["force_gain"]) + v["contact_offset"]
    read = v["capacitance_gain"] * (at_rest + signal) + v["parasitic_capacitance"]
    return _Way(depth, load, np.maximum.accumulate(reading), read)


def _process(rng: np.random.Generator) -> CubicSpline:
    """A draw of the Gaussian process of (4) over the share of depth, by its values on a few nodes."""
    nodes = np.linspace(0.0, 1.0, 41)
    value, vector = np.linalg.eigh(correlation_between(nodes, nodes))
    drawn = vector @ (np.sqrt(np.maximum(value, 0.0)) * rng.standard_normal(nodes.size))
    return CubicSpline(nodes, drawn)


def _write_press(
    way: _Way, sweep: TrueSweep, folder: Path, number: int, rng: np.random.Generator
) -> tuple[Path | None, Path | None]:
    press = sweep.press
    force_path = capacitance_path = None
    if press.tester is not None:
        moved = _needed(sweep.reading)
        columns = _written(press.tester, moved, way, sweep, 0.0, rng)
        if press.meter is press.tester:
            columns |= _capacitance(np.interp(moved, way.reading, way.capacitance), sweep, rng)
        force_path = _save(folder / f"{number} tester.csv", columns)
        capacitance_path = force_path if press.meter is press.tester else None
    if press.meter is not None and press.meter is not press.tester:
        meter = press.meter
        if meter.displacement is not None:
            moved = sweep._moved(meter.displacement)
        elif meter.force is not None:
            # The machine goes to the same forces on the sensor as it did.
            wanted = meter.force - press.load + sweep.values["load_zero"]
            moved = np.interp(wanted, np.maximum.accumulate(way.load), way.reading)
        else:
            time, times = _times_of_both(press)
            moved = np.interp(time, times, _needed(sweep.reading))
        shift = 0.0 if np.isnan(press.clock_offset) else press.clock_offset - sweep.values["clock_offset"]
        columns = _written(meter, moved, way, sweep, shift, rng)
        read = np.interp(moved, way.reading, way.capacitance)
        if meter.displacement is None and meter.force is None:
            read = read + _once_turned(way, sweep, rng)
        columns |= _capacitance(read, sweep, rng)
        capacitance_path = _save(folder / f"{number} meter.csv", columns)
    return force_path, capacitance_path


def _times_of_both(press: SimulatedPress) -> tuple[FloatArray, FloatArray]:
    """Times [s] of the meter's readings by the tester's clock, and of the tester's own."""
    meter, tester = (None if log is None else log.time for log in (press.meter, press.tester))
    return _needed(meter) + press.clock_offset, _needed(tester)


def _once_turned(way: _Way, sweep: TrueSweep, rng: np.random.Generator) -> FloatArray:
    """What each reading of the meter [F] differs by from that of loading at the same place, (n,).

    The tie by clocks allows for hysteresis, creep and friction that turns round, so that there is some in the lab, too, drawn
    from what is believed there: with none, offsets are found better than is said of them.
    """
    (time, times), reading = _times_of_both(sweep.press), _needed(sweep.reading)
    change = float(np.ptp(np.interp([sweep.at_contact, np.max(reading)], way.reading, way.capacitance)))
    return change * draw_once_turned(time, times, reading, sweep.at_contact, rng)


def _written(
    log: Log, moved: FloatArray, way: _Way, sweep: TrueSweep, shift: float, rng: np.random.Generator
) -> dict[str, FloatArray]:
    """The columns of a record but for its capacitance, in the units of their headers."""
    columns: dict[str, FloatArray] = {}
    if log.time is not None:
        columns["Time (s)"] = log.time + shift
    if log.displacement is not None:
        columns["Displacement (mm)"] = moved * 1e3
    if log.force is not None:
        load = np.interp(moved, way.reading, way.load)
        columns["Force (N)"] = load + sweep.values["force_noise"] * rng.standard_normal(load.size)
    return columns


def _capacitance(read: FloatArray, sweep: TrueSweep, rng: np.random.Generator) -> dict[str, FloatArray]:
    noisy = read + sweep.values["capacitance_noise"] * rng.standard_normal(read.size)
    return {"Cp (pF)": noisy * 1e12}


def _save(path: Path, columns: Mapping[str, FloatArray]) -> Path:
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, fmt="%.10g", delimiter=",", header=",".join(columns), comments="", encoding="utf-8")
    return path


def _needed(column: FloatArray | None) -> FloatArray:
    if column is None:
        raise InputError(Fault("a record of this experiment lacks what its sweep is tied by"))
    return column

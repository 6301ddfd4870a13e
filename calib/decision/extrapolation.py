"""A posterior and what is asked of it in, how far that is beyond what was measured and what the model covers out."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from calib.checks import Reason
from calib.decision.words import EXTRAPOLATION, spans_in_words
from calib.lab import Sweep
from calib.problem import lookup
from calib.sampling import Posterior
from models.sensor import BoolArray, FloatArray

#: What is asked may exceed what was measured by this factor before it counts as extrapolation.
MARGIN = 1.1

# Beside a thickness that is near the best with no more than this probability the signal has fallen off, and a thickness
# farther out is not taken for a better one.
_FALLEN_OFF = 0.05


@dataclass(frozen=True)
class Measured:
    """One press of the data at the medians: true force [N], depth, padding, sensor with padding, radius of the ball [m].

    `electrical` says whether the capacitance was read, too.
    """

    force: float
    depth: float
    padding: float
    total: float
    ball: float
    electrical: bool = True


@dataclass(frozen=True)
class Covered:
    """What the model covers of the presses that would confirm an advice.

    Attributes
    ----------
    force : [N], up to which it covers one on the padding of the advice, for nearly all draws; 0 for none.
    paddings : that it covers at the load of the advice, in words; "" for none, or where no other was looked at.
    """

    force: float
    paddings: str = ""

    def confirms(self, load: float) -> bool:
        """Whether such a press goes far enough for a load [N]."""
        return load <= self.force

    def on_it(self, load: float) -> str:
        """How far the model goes on that padding, where it does not go up to a load [N], and what to do."""
        return f"The model {self._covers}, and no table can be made up to {load:g} N: keep the gripper below, or choose another"

    def instead(self, load: float) -> str:
        """What is to be asked for, where it does not, and why, in words."""
        most = self._most
        ways = [f"padding that it covers at {load:g} N ({self.paddings})"] if self.paddings else []
        ways += [f"no more than {most:g} N here"] if most > 0 else []
        ask = f"ask for {' or '.join(ways)}" if ways else "ask for less force, or calibrate with another model"
        return f"The model {self._covers}: no press that confirms this can be calibrated with; {ask}"

    @property
    def _most(self) -> float:
        """`force` [N] as it is told: rounded down."""
        return math.floor(self.force * 100) / 100 if self.force < 10 else math.floor(self.force * 10) / 10

    @property
    def _covers(self) -> str:
        return f"covers such padding up to {self._most:g} N only" if self._most > 0 else "covers no press on such padding"


@dataclass(frozen=True)
class Aim:
    """What an advice is for.

    Attributes
    ----------
    force : load [N].
    padding : [m].
    depth : that the ball sinks in there [m].
    balls : [m], radii of the smallest and the largest ball that press, or of the one.
    places : decimals [mm] that the padding is shown with; as on a drawing if nothing else is said.
    signal : whether it hangs on the change of capacitance, and not on stroke, strain and height alone.
    sensor : thickness of the sensor [m]; None for that of those measured.
    """

    force: float
    padding: float
    depth: float
    balls: tuple[float, ...]
    places: int = 2
    signal: bool = True
    sensor: float | None = None


def force_exceeded(force: float, largest: float) -> str:
    """How far a load goes beyond the largest that was measured, in words; "" within it.

    Parameters
    ----------
    force, largest : [N].
    """
    return f"{force / largest:.1f} times the largest measured force ({largest:.2g} N)" if force > MARGIN * largest else ""


def exceeded(presses: Sequence[Measured], aim: Aim) -> dict[str, str]:
    """In what an advice goes beyond the data: force, padding, depth, ball or capacitance, each with by how much in words.

    Parameters
    ----------
    presses : of the data.
    aim : what the advice is for.
    """
    # A few numbers, asked for thickness by thickness while somebody moves a slider: arrays of them take ten times as long.
    thickest, thinnest = max(p.padding for p in presses), min(p.padding for p in presses)
    largest = largest_on(presses, aim.padding)
    deepest, share = max(p.depth for p in presses), max(p.depth / p.total for p in presses)
    balls = sorted({p.ball for p in presses})
    total = aim.padding + (median(p.total - p.padding for p in presses) if aim.sensor is None else aim.sensor)
    found = {}
    if too_large := force_exceeded(aim.force, largest):
        there = " on padding as thick" if largest < max(p.force for p in presses) else ""
        found["force"] = f"{too_large}{there}"
    if aim.padding > 0 and thickest == 0:
        found["padding"] = f"{aim.padding * 1e3:.2f} mm of padding (measured without any)"
    elif aim.padding > MARGIN * thickest:
        found["padding"] = f"{aim.padding / thickest:.1f} times the thickest measured padding ({thickest * 1e3:.2f} mm)"
    elif aim.padding < thinnest / MARGIN:
        found["padding"] = f"{aim.padding * 1e3:.2f} mm of padding, thinner than any measured ({thinnest * 1e3:.2f} mm)"
    if deepest > 0 and aim.depth / total > MARGIN * share:
        found["depth"] = f"a depth of {100 * (aim.depth / total):.0f} % of the thickness (measured up to {100 * share:.0f} %)"
    if others := _other_balls(presses, aim):
        known = " and ".join(f"{r * 1e3:g}" for r in balls)
        found["ball"] = f"{_balls_in_words(others)} (measured with {known} mm)"
    if aim.signal and not any(p.electrical for p in presses):
        found["capacitance"] = "a change of capacitance (none was measured)"
    return found


def largest_on(presses: Sequence[Measured], padding: float) -> float:
    """The largest force [N] of the presses on padding as thick, or of all where none is.

    A hard press on thin padding says nothing of how thick padding goes on beyond a gentle one.

    Parameters
    ----------
    presses : of the data.
    padding : [m].
    """
    return max(p.force for p in [p for p in presses if MARGIN * p.padding >= padding] or presses)


def _other_balls(presses: Sequence[Measured], aim: Aim) -> list[float]:
    """Radii [m] that are smaller, or larger, than any that was pressed with."""
    smallest, largest = min(p.ball for p in presses) / MARGIN, max(p.ball for p in presses) * MARGIN
    return [ball for ball in aim.balls if not smallest < ball < largest]


def _balls_in_words(radii: Sequence[float]) -> str:
    told = " and ".join(f"{radius * 1e3:.3g}" for radius in radii)
    return f"a ball of {told} mm radius" if len(radii) == 1 else f"balls of {told} mm radius"


def pad_to_press(aim: Aim) -> float:
    """Thickness [m] of the pad that confirms an advice: the one that the advice shows, to the same place.

    Parameters
    ----------
    aim : what the advice is for.
    """
    return float(f"{aim.padding * 1e3:.{aim.places}f}") / 1e3


def beyond_the_measured(posterior: Posterior, aim: Aim, covered: Covered, what: str = "the advice is for") -> Iterator[Reason]:
    """Say by how much a prediction goes beyond the forces, paddings, depths and balls of the data it rests on.

    Parameters
    ----------
    posterior : of the calibration, with its sweeps.
    aim, covered, what : as in `beyond`.
    """
    yield from beyond(measured_presses(posterior), aim, covered, what)


def beyond(presses: Sequence[Measured], aim: Aim, covered: Covered, what: str = "the advice is for") -> Iterator[Reason]:
    """The same for presses that are known already.

    Parameters
    ----------
    presses : of the data.
    aim : what is predicted for.
    covered : what the model covers of the presses that would confirm it: one that it does not cover is not asked for.
    what : asks for that, in words.
    """
    found = exceeded(presses, aim)
    if found:
        finding = f"{what} {', '.join(found.values())}: there the model was held against no data"
        others = _other_balls(presses, aim)
        under = f" with {_balls_in_words(others)}" if others else ""
        meter = ", read by an LCR meter beside the tester," if "capacitance" in found else ""
        pad = f"pad of about {aim.padding * 1e3:.{aim.places}f} mm" if aim.padding > 0 else "sensor without padding"
        action = f"Press one {pad}{under} to {aim.force:.4g} N{meter} and calibrate with it, to confirm"
        yield Reason(EXTRAPOLATION, "amber", finding, action if covered.confirms(aim.force) else covered.instead(aim.force))


def beyond_the_covered(
    thickness: FloatArray, covered: BoolArray, probability: FloatArray, force: float, everywhere: float
) -> Iterator[Reason]:
    """Say where the best padding may be one that the model does not cover: one beside it is as good as the best that it does.

    Parameters
    ----------
    thickness : [m], (n_thickness,), ascending, of the paddings that were asked for.
    covered : (n_thickness,), which of them the model covers.
    probability : (n_thickness,), that one is near the best of those that are covered; nan where it is not.
    force : [N], that was asked for.
    everywhere : [N], up to which all of them are covered.
    """
    wall = np.concatenate([[True], covered, [True]])
    beside = covered & ~(wall[:-2] & wall[2:])
    if np.any(probability[beside] > _FALLEN_OFF):
        finding = (
            f"at {force:g} N the model covers {spans_in_words(thickness, covered)} of padding and not "
            f"{spans_in_words(thickness, ~covered)}, and beside that the signal has not fallen off: another padding may "
            "give more than the best of these"
        )
        less = f"a force below {everywhere:.2g} N, where all are covered, or " if everywhere > 0 else ""
        yield Reason("coverage", "amber", finding, f"Ask for {less}for paddings that are covered, and take it for those alone")


def largest_force(posterior: Posterior, like: str = "") -> float:
    """The largest true force [N] of all presses that a posterior rests on, at its medians.

    Parameters
    ----------
    posterior : of the calibration, with its sweeps.
    like : name of a specimen that was pressed: of the presses on padding as thick as its own.
    """
    presses = measured_presses(posterior)
    own = [press.padding for press, sweep in zip(presses, posterior.sweeps, strict=True) if sweep.specimen == like]
    return max(largest_on(presses, padding) for padding in own or [0.0])


def largest_in_words(presses: Sequence[Measured]) -> str:
    """Up to which force was pressed, and on which padding where thicker padding was pressed less.

    Parameters
    ----------
    presses : of the data.
    """
    on = {f"{largest_on(presses, padding):.2g}": padding for padding in sorted({p.padding for p in presses})}
    if len(on) == 1:
        return f"forces up to {next(iter(on))} N, the largest measured"
    each = ", ".join(f"{force} N on padding of {padding * 1e3:.3g} mm" for force, padding in on.items())
    return f"forces up to {each}, the largest measured on padding as thick"


def measured_presses(posterior: Posterior) -> list[Measured]:
    """Every press that a posterior rests on, at its medians."""
    middle = {name: np.array([s.median]) for name, s in posterior.diagnostics.parameters.items()}
    middle |= {name: np.array([value]) for name, value in posterior.fixed.items()}
    return [_press(posterior, middle, sweep) for sweep in posterior.sweeps]


def _press(posterior: Posterior, middle: Mapping[str, FloatArray], sweep: Sweep) -> Measured:

    def value(name: str, otherwise: float) -> float:
        found = lookup(middle, name, sweep.specimen, sweep.name)
        return otherwise if found is None else float(found[0])

    loads = [p.value for name, p in sweep.channels.items() if name == "force"]
    loads += [p.force for p in sweep.channels.values() if p.force is not None]
    zero, gain = value("load_zero", 0.0) + value("load_step", 0.0), value("force_gain", 1.0)
    force = max((float(np.max(load)) - zero) / gain for load in loads) if loads else 0.0
    readings = [p.displacement for p in sweep.channels.values() if p.displacement is not None]
    readings += [sweep.track.displacement] if sweep.track is not None else []
    reading = max((float(np.max(r)) for r in readings), default=0.0)
    travel = (reading - value("contact_offset", reading)) / value("displacement_gain", 1.0)
    depth = travel - value("machine_compliance", 0.0) * force
    # Not by way of a design: an average of models has not every unknown that the first of them has.
    sensor, padding = (value(name, math.nan) for name in ("sensor_thickness", "padding_thickness"))
    return Measured(
        force, max(depth, 0.0), padding, sensor + padding, sweep.indenter_radius, electrical="capacitance" in sweep.channels
    )

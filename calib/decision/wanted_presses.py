"""A calibration and a bench in, the presses that a lab could make next out: of specimens that are there, and of new ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count

from calib.catalogue import display
from calib.decision.extrapolation import MARGIN, Aim, pad_to_press
from calib.decision.known import Known, force_reached
from calib.experiment import Bench
from calib.lab import Sweep

# Specimens on which further presses are tried.
_MOST_SPECIMENS = 4
#: A force counts as larger, a ball or a thickness as another, from this factor on.
ANOTHER = 1.15
# Of the measured thickness of the padding, those that are tried where the bench says nothing.
_PADDINGS = (0.0, 0.5, 2.0, 3.0)


@dataclass(frozen=True)
class WantedPress:
    """A press that is to be tried.

    Attributes
    ----------
    kind : one of `calib.experiment.PRESSES`.
    words : in words of the lab, with a place for the force.
    template : the sweep that it is like.
    specimen : that is pressed, one that is there or a new one.
    ball : [m], its radius.
    force : [N], up to which.
    electrical : whether the LCR meter is connected.
    padding : [m], thickness of it under a new specimen; None for one that is there.
    """

    kind: str
    words: str
    template: Sweep
    specimen: str
    ball: float
    force: float
    electrical: bool
    padding: float | None = None


def largest_load(known: Known, bench: Bench, aim: Aim | None = None) -> float:
    """Force [N] that tester, load cell and sensor may see.

    Where nothing is said of them it is twice the largest that was measured, or the load that an advice is for, if that is more.

    Parameters
    ----------
    known : the calibration.
    bench : what the lab has.
    aim : what the advice is for; None for none.
    """
    if bench.load_cell is not None:
        return bench.load_cell
    twice = 2 * max(force_reached(known, sweep) for sweep in known.problem.sweeps)
    return twice if aim is None else max(twice, aim.force)


def wanted_presses(known: Known, bench: Bench, aim: Aim | None) -> Iterator[WantedPress | str]:
    """List the presses that a lab could make next, and in words those of which nothing can be said.

    Parameters
    ----------
    known : the calibration.
    bench : what the lab can measure.
    aim : what an advice is for, so that what would confirm it is among them; None for none.
    """
    templates: dict[str, Sweep] = {}
    for sweep in known.problem.sweeps:
        best = templates.get(sweep.specimen)
        if best is None or len(sweep.channels) > len(best.channels):
            templates[sweep.specimen] = sweep
    if len(templates) > _MOST_SPECIMENS:
        yield f"further presses of {len(templates) - _MOST_SPECIMENS} specimens, which are like those of the first"
    cell = largest_load(known, bench, aim)
    for template in list(templates.values())[:_MOST_SPECIMENS]:
        yield from _wanted_on(known, bench, template, cell, aim)
    template = next(iter(templates.values()))
    yield from _wanted_anew(known, bench, template, cell, aim)
    if "indenter_radius" in known.names and "ball" not in bench.without:
        yield "another ball: the radius of the ball is an unknown here, which one ball alone may have"
    pooled = {lot.quantity for lot in known.problem.table.lots}
    if "padding_thickness" in pooled and not any(s.nominal for s in known.problem.experiment.specimens):
        yield "padding of another thickness: it is pooled here, and `nominal` does not say what was wanted of each specimen"
    yield "slower and faster presses: time is not modelled"


def _wanted_on(known: Known, bench: Bench, template: Sweep, cell: float, aim: Aim | None) -> Iterator[WantedPress]:
    """Further presses of a specimen that is there."""
    name = template.specimen
    force = min(force_reached(known, template), cell)
    own = [sweep.indenter_radius for sweep in known.problem.sweeps if sweep.specimen == name]
    ball = display("indenter_radius", template.indenter_radius)
    again = WantedPress(
        "repeat",
        f"press {name} once more with the ball of {ball} radius up to {{force:.2g}} N",
        template,
        name,
        template.indenter_radius,
        force,
        "capacitance" in template.channels,
    )
    if "repeat" not in bench.without:
        yield again
    if "force" not in bench.without and cell > ANOTHER * force:
        words = f"press {name} with the ball of {ball} radius up to {{force:.2g}} N instead of {force:.2g} N"
        yield replace(again, kind="force", words=words, force=cell)
    if "ball" not in bench.without and "indenter_radius" not in known.names:
        for radius in bench.balls:
            if all(max(radius / one, one / radius) > ANOTHER for one in own):
                words = f"press {name} with a ball of {display('indenter_radius', radius)} radius up to {{force:.2g}} N"
                wanted_there = aim is not None and any(_alike(radius, wanted, MARGIN) for wanted in aim.balls)
                to = _confirming(force, cell, aim) if wanted_there else force
                yield replace(again, kind="ball", words=words, ball=radius, force=to)
    if "capacitance" not in bench.without and not again.electrical and "force" in template.channels:
        words = f"press {name} once more with the LCR meter connected, up to {{force:.2g}} N"
        yield replace(again, kind="capacitance", words=words, electrical=True)


def _wanted_anew(known: Known, bench: Bench, template: Sweep, cell: float, aim: Aim | None) -> Iterator[WantedPress | str]:
    """Presses of specimens that nobody has made, like one that is there but for its padding."""
    taken = {specimen.name for specimen in known.problem.experiment.specimens}
    name = next(f"sensor {k}" for k in count(len(taken) + 1) if f"sensor {k}" not in taken)
    padding = known.value("padding_thickness", template.specimen)
    # A signal that nobody measured is confirmed by a meter alone.
    electrical = "capacitance" in template.channels
    connected = not electrical and aim is not None and aim.signal
    connected = connected and "capacitance" not in bench.without and "force" in template.channels
    meter = ", the LCR meter connected," if connected else ""
    like = WantedPress(
        "specimen",
        f"make one more sensor like {template.specimen} and press it{meter} up to {{force:.2g}} N",
        template,
        name,
        template.indenter_radius,
        min(force_reached(known, template), cell),
        electrical or connected,
        padding,
    )
    if "specimen" not in bench.without:
        yield like
    pooled = {lot.quantity for lot in known.problem.table.lots}
    own = next(s for s in known.problem.experiment.specimens if s.name == template.specimen)
    wanted_of_each = "padding_thickness" not in pooled or "padding_thickness" in own.nominal
    if "padding" not in bench.without and wanted_of_each:
        asked = bench.paddings
        if asked is None:
            asked = tuple(round(share * padding, 4) for share in _PADDINGS) if padding > 0 else (1e-3, 3e-3)
        confirming = padding
        if aim is not None and not _alike(aim.padding, padding, MARGIN):
            if bench.paddings is not None and not any(_alike(aim.padding, thickness, MARGIN) for thickness in asked):
                at = display("padding_thickness", pad_to_press(aim))
                yield f"padding of {at}, which the advice is for: it is not among the paddings of the bench file"
            else:
                confirming = pad_to_press(aim)
                asked = (confirming, *(thickness for thickness in asked if not _alike(thickness, confirming, MARGIN)))
        others = () if aim is None else _others_at_hand(known, bench, aim, template.indenter_radius)
        for thickness in dict.fromkeys(asked):
            if thickness == padding or (thickness != confirming and _alike(thickness, padding, ANOTHER)):
                continue
            on = f"on {display('padding_thickness', thickness)} of padding" if thickness > 0 else "without padding"
            force = _confirming(like.force, cell, aim)
            for ball in (others if thickness == confirming else ()) or (template.indenter_radius,):
                with_it = f" with a ball of {display('indenter_radius', ball)} radius" if ball in others else ""
                words = f"make one more sensor {on} and press it{with_it}{meter} up to {{force:.2g}} N"
                yield replace(like, kind="padding", words=words, padding=thickness, ball=ball, force=force)


def _confirming(force: float, cell: float, aim: Aim | None) -> float:
    """Force [N] that confirms what an advice is for; less than was pressed with would tell less, and cost as much."""
    return force if aim is None else min(max(aim.force, force), cell)


def _alike(one: float, other: float, factor: float) -> bool:
    """Whether two lengths differ by less than a factor; none is like none only."""
    return one == other or max(one, other) < factor * min(one, other)


def _others_at_hand(known: Known, bench: Bench, aim: Aim, radius: float) -> tuple[float, ...]:
    """Balls [m] of the bench like those that an advice is for and unlike one of that radius, each the nearest."""
    if "ball" in bench.without or "indenter_radius" in known.names:
        return ()
    wanted = [ball for ball in aim.balls if not _alike(ball, radius, MARGIN)]
    near = [[own for own in bench.balls if _alike(own, ball, MARGIN)] for ball in wanted]
    return tuple(min(own, key=lambda r: abs(r - ball)) for own, ball in zip(near, wanted, strict=True) if own)

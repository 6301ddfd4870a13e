"""Sensors that may be built and a specification in, how far each draw keeps each limit at each thickness of padding out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.decision.along import Ask, Tabulated, Untabulated, tabulated
from calib.decision.choices import PADDING, Coordinates, PaddingChoice, balls_of, built, forces_of, forward_for
from calib.decision.sensors import ModelDraws, with_padding
from calib.experiment import Limit, Specification
from models.curves import curves_of, press_to, signal_at
from models.response import Forward
from models.sensor import BoolArray, Design, FloatArray
from models.surrogate.thinning import load_thinning, thinning_refusal

# Knots over the range of paddings: with these what lies between is off by 1e-4 of itself at most (tests).
_N_KNOT = 41
# Standard deviations by which no pad is farther off what it is made to: of a million one is.
_FARTHEST = 5.0
# By how little, as a share of itself, a load is missed at least that is not carried.
_NOT = 1e-9


@dataclass(frozen=True, eq=False)
class Errors:
    """Standard normals by which models are wrong, smooth along the thickness: (n_draw, n_thickness) each.

    Attributes
    ----------
    force, capacitance : of the force at given depth, and of the change of capacitance there.
    thinning : of the thinning of the dielectric.
    """

    force: FloatArray
    capacitance: FloatArray
    thinning: FloatArray

    def only(self, rows: slice) -> Errors:
        """Those of some draws."""
        return Errors(self.force[rows], self.capacitance[rows], self.thinning[rows])


@dataclass(frozen=True, eq=False)
class Performance:
    """What draws do at one nominal thickness of padding, arrays (n_draw, ...).

    Attributes
    ----------
    margins : (n_draw, n_limit), how far the worst load and ball are inside a limit, as a share of it; outside negative, and no
        less than -1: v / l - 1 of a value v below the least l, l / v - 1 of one above the most. Loads that are not carried do
        not count here; inf where none is.
    reach : (n_draw,), largest force that every ball is carried to inside the model's range, over the load wanted, less 1:
        negative where a load is not carried; -1 where the model does not cover the design.
    inside : (n_draw,), whether the model covers the design, with its electrodes.
    signal, stroke : (n_draw,), at the largest load, under the first ball; nan where not carried.
    """

    margins: FloatArray
    reach: FloatArray
    inside: BoolArray
    signal: FloatArray
    stroke: FloatArray


# What stands in a table at each load: the mechanics that all electrodes share, then three quantities of each, then the reach.
_MECHANICAL = ("depth", "compliance", "sd of the force", "thinning", "sd of the thinning")
_ELECTRIC = ("change", "slope", "sd of the change")


@dataclass(frozen=True, eq=False)
class ElectrodeGroup:
    """Choices that differ in their electrodes alone, of one model's draws, pressed at knots over the thickness.

    Attributes
    ----------
    part, choices, designs : the draws, what is chosen, and what is built of each choice.
    specification : what is asked.
    forces : [N], (n_draw, n_load).
    balls : radii [m], (n_draw,) each.
    tables : under each ball.
    pads : (n_draw,), standard-normal coordinate of how pads are made; None where all have their nominal thickness.
    """

    part: ModelDraws
    choices: Sequence[PaddingChoice]
    designs: Sequence[Design]
    specification: Specification
    forces: FloatArray
    balls: Sequence[FloatArray]
    tables: Sequence[Tabulated | Untabulated]
    pads: FloatArray | None

    def at(self, thickness: float, errors: Errors, k: int, *, exact: bool = False) -> Iterator[Performance]:
        """What every choice does on padding of a nominal thickness.

        Parameters
        ----------
        thickness : [m], nominal.
        errors : of the model.
        k : the thickness's column among them.
        exact : whether pads have exactly that thickness, as one that was measured has.
        """
        own = np.full(self.part.size, thickness)
        if not exact:
            tolerance = self.specification.padding_tolerance
            own = own if tolerance is None or self.pads is None else tolerance.pads(thickness, self.pads)
            own = own if self.part.cast is None else own * self.part.cast
        answers = np.stack([table.at(own) for table in self.tables], axis=1)  # (n_draw, n_ball, n_load, n_quantity)
        for index in range(len(self.choices)):
            yield self._of(index, answers, own, errors, k)

    def _of(self, index: int, answers: FloatArray, thickness: FloatArray, errors: Errors, k: int) -> Performance:
        depth, compliance, force_sd, thin, thin_sd = np.moveaxis(answers[..., : len(_MECHANICAL)], 3, 0)
        first = len(_MECHANICAL) + index * len(_ELECTRIC)
        change, slope, change_sd = np.moveaxis(answers[..., first : first + len(_ELECTRIC)], 3, 0)
        reach = np.min(answers[..., -1], axis=(1, 2))
        own, design, forces = self.part.own, self.designs[index], self.forces[:, None]
        e_force, e_change, e_thin = (e[:, k, None, None] for e in (errors.force, errors.capacitance, errors.thinning))
        gap_force, gap_change = own.force_discrepancy[:, None, None], own.capacitance_discrepancy[:, None, None]
        # Too much force at given depth is less depth at given force, and with it less change.
        force_error = e_force * np.hypot(gap_force * forces, force_sd)
        change_error = e_change * np.hypot(gap_change * change, change_sd)
        signal = change - slope * force_error + change_error
        stroke = depth - compliance * force_error
        with np.errstate(divide="ignore", invalid="ignore"):
            steeper = 1 + change_error / np.where(change > 0, change, np.inf)
            rise = np.maximum(slope * steeper, 0.0) * np.asarray(design.rest_capacitance)[:, None, None]
            resolution = own.noise[:, None, None] / rise + 0 * change
            strain = (thin + e_thin * thin_sd) * np.where(depth > 0, stroke / depth, 1.0)
        height = np.broadcast_to((np.asarray(design.sensor.thickness) + thickness)[:, None, None], depth.shape)
        values = {
            "signal": signal,
            "stroke": stroke,
            "force_resolution": resolution,
            "dielectric_strain": strain,
            "height": height,
        }
        margins = np.stack([self._margin(limit, values[limit.quantity]) for limit in self.specification.limits], axis=1)
        largest = int(np.argmax(self.forces[0]))
        needed = np.max(self.forces, axis=1)
        # Where a load is carried and what is limited there is not known, nothing may be said of the draw.
        limited = np.stack([change, *(values[limit.quantity] for limit in self.specification.limits)])
        carried = np.isfinite(depth)
        known = np.all(~carried | ~np.any(np.isnan(limited), axis=0), axis=(1, 2)) & (reach > 0)
        room = np.where(
            np.all(carried, axis=(1, 2)), np.maximum(reach / needed - 1, 0.0), np.minimum(reach / needed - 1, -_NOT)
        )
        return Performance(
            margins,
            np.where(known, room, -1.0),
            known,
            signal[:, 0, largest],
            stroke[:, 0, largest],
        )

    def _margin(self, limit: Limit, value: FloatArray) -> FloatArray:
        """The worst of all loads and balls, (n_draw,)."""
        if limit.at is not None:
            value = value[:, :, np.isclose(self.forces[0], limit.at, rtol=1e-9, atol=0)]
        # What is missed is missed by a whole limit at most: a load that is not carried is worse.
        room = limit.margin(value)
        return np.asarray(np.min(np.where(np.isnan(room), np.inf, room), axis=(1, 2)))


@dataclass(frozen=True)
class Refused:
    """Choices that no model serves, and why."""

    choices: Sequence[PaddingChoice]
    why: str


def pressed(
    part: ModelDraws, specification: Specification, choices: Sequence[PaddingChoice], z: Coordinates
) -> ElectrodeGroup | Refused:
    """Press what would be built of choices that share their mechanics, at knots over the thickness of padding.

    Each electrode radius is read off at the depths that were found once for all of them.

    Parameters
    ----------
    part : draws of one model.
    specification : what is asked.
    choices : that differ in their electrodes alone.
    z : coordinates of these draws.

    Returns
    -------
    The group, or why no model serves it.
    """
    designs = [built(part, specification, choice, z) for choice in choices]
    forward, why = forward_for(part, designs[0])
    if why:
        return Refused(choices, why)
    strained = any(limit.quantity == "dielectric_strain" for limit in specification.limits)
    if strained and (why := thinning_refusal(designs[0])):
        return Refused(choices, why)
    balls, forces = balls_of(specification, part.base, z), forces_of(specification, part.size, z)
    tolerance = specification.padding_tolerance
    pads = None if tolerance is None else z[PADDING]
    shift = 0.25 * float(np.median(np.asarray(designs[0].sensor.thickness)))
    cast = np.ones(1) if part.cast is None else part.cast
    low, high = made_within(specification)
    low, high = low * min(1.0, float(np.min(cast))), high * max(1.0, float(np.max(cast)))
    asks = [_ask_of(forward, designs, forces, ball, strained) for ball in balls]
    tables = [tabulated(ask, forces, low, high, shift, _N_KNOT) for ask in asks]
    return ElectrodeGroup(part, choices, designs, specification, forces, balls, tables, pads)


def made_within(specification: Specification) -> tuple[float, float]:
    """The thinnest and the thickest pad [m] that is looked at: of what is asked for, off it by the tolerance."""
    tolerance = specification.padding_tolerance
    if tolerance is None:
        return specification.lower, specification.upper
    ends = np.array([-_FARTHEST, _FARTHEST])
    return float(tolerance.pads(specification.lower, ends)[0]), float(tolerance.pads(specification.upper, ends)[1])


def pressed_as_built(part: ModelDraws, specification: Specification, z: Coordinates) -> ElectrodeGroup | Refused:
    """Press sensors that are there, each on the padding that it has: nothing is chosen, and nothing scatters.

    Parameters
    ----------
    part : draws of one model; `cast` has the padding of each over the nominal one that `ElectrodeGroup.at` is asked for.
    specification : its loads, balls and limits count.
    z : coordinates of the loads and balls that have a distribution.

    Returns
    -------
    The group, or why no model serves it.
    """
    design = part.base
    forward, why = forward_for(part, design)
    strained = any(limit.quantity == "dielectric_strain" for limit in specification.limits)
    why = why or (thinning_refusal(design) if strained else "")
    if why:
        return Refused([PaddingChoice()], why)
    balls, forces = balls_of(specification, design, z), forces_of(specification, part.size, z)
    tables = [Untabulated(_ask_of(forward, [design], forces, ball, strained)) for ball in balls]
    return ElectrodeGroup(part, [PaddingChoice()], [design], specification, forces, balls, tables, None)


def _ask_of(forward: Forward, designs: Sequence[Design], forces: FloatArray, ball: FloatArray, strained: bool) -> Ask:
    """What designs under a ball of a radius [m] (n_draw,) do at loads on paddings of any thickness."""

    def ask(thickness: FloatArray, rows: BoolArray) -> FloatArray:
        some = [with_padding(design.only(rows), thickness) for design in designs]
        pressing = [replace(d, indenter=replace(d.indenter, radius=ball[rows])) for d in some]
        return _asked(forward, pressing, forces[rows], strained)

    return ask


def _asked(forward: Forward, designs: Sequence[Design], forces: FloatArray, strained: bool) -> FloatArray:
    """What designs that differ in their electrodes alone do at loads, (n_draw, n_load, n_quantity)."""
    # The widest electrode tells the mechanics: if the model covers any of them, it covers that.
    widest = int(np.argmax([np.median(np.asarray(design.electrode_radius)) for design in designs]))
    first = press_to(curves_of(forward, designs[widest]), forces)
    thin = load_thinning().of(designs[widest], first.depth) if strained else (0 * first.depth,) * 2
    found = [first.depth, first.compliance, first.force_error, *thin]
    for index, design in enumerate(designs):
        at = signal_at(first, curves_of(forward, design) if index != widest else None)
        found += [at.change, at.change_slope, at.change_error]
    return np.stack([*found, np.broadcast_to(first.reach[:, None], first.depth.shape)], axis=2)

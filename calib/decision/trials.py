"""Sensors that may be built, pressed, in, what is said of each at every thickness of its padding, with its draws, out."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.checks import band
from calib.decision.choices import PaddingChoice
from calib.decision.conditions import COVERED_SHARE
from calib.decision.conformity import Built
from calib.decision.enough_draws import monte_carlo_error
from calib.decision.guard_band import crossings, within_its_drawing
from calib.decision.performance import ElectrodeGroup, Errors, made_within
from calib.decision.sensors import with_padding
from calib.decision.words import TOLERANCE_KEY, spans_in_words
from calib.experiment import Specification
from models.sensor import BoolArray, Design, FloatArray

# Pads thinner, and thicker, than any that was asked for, that are looked at for what becomes of those that are made.
_BEYOND = 20


@dataclass(frozen=True, eq=False)
class Tried:
    """One sensor that may be built, with its draws.

    Attributes
    ----------
    choice, built : what is chosen, and what is said of it.
    designs : of each model's draws.
    margins : (n_draw, n_thickness, n_limit), see `Performance`.
    reach : (n_draw, n_thickness).
    worst : (n_draw, n_thickness), the smallest margin; where a load is not carried `reach` less 1, a whole limit. Not below
        nothing: conforms.
    at : index of the best thickness.
    pads : [m], (n_pad,), all thicknesses that pads may have which are made to those of the grid.
    pads_conform : [1], (n_pad,), probability that one of exactly this thickness conforms, 0 where the model does not cover it.
    """

    choice: PaddingChoice
    built: Built
    designs: Sequence[Design]
    margins: FloatArray
    reach: FloatArray
    worst: FloatArray
    at: int
    pads: FloatArray
    pads_conform: FloatArray


def try_all(
    groups: Sequence[ElectrodeGroup],
    choices: Sequence[PaddingChoice],
    grid: FloatArray,
    errors: Errors,
    rows: Sequence[slice],
    n_effective: int,
) -> Iterator[Tried]:
    """Go through the thicknesses, for all choices of a group at once.

    Parameters
    ----------
    groups : of the same choices, one for each model.
    choices : which.
    grid : [m], (n_thickness,).
    errors : of the models.
    rows : the draws of each model.
    n_effective : how many independent draws all are worth.

    Returns
    -------
    One for each choice; its best thickness is nan where no thickness is covered.
    """
    s = groups[0].specification
    shape = (len(choices), rows[-1].stop, grid.size)
    margins, reach = np.empty((*shape, len(s.limits))), np.empty(shape)
    inside, signal, stroke = np.empty(shape, dtype=bool), np.empty(shape), np.empty(shape)
    for k, thickness in enumerate(grid):
        for group, own in zip(groups, rows, strict=True):
            for i, at in enumerate(group.at(float(thickness), errors.only(own), k)):
                margins[i, own, k], reach[i, own, k], inside[i, own, k] = at.margins, at.reach, at.inside
                signal[i, own, k], stroke[i, own, k] = at.signal, at.stroke
    pads = _pads(s, grid)
    if s.padding_tolerance is None:
        conform, known = np.mean(_worst(margins, reach) >= 0, axis=1), np.mean(inside, axis=1) >= COVERED_SHARE
    else:
        conform, known = _of_exact(groups, len(choices), grid, pads, errors, rows)
    own_pads = np.searchsorted(pads, grid)
    for i, choice in enumerate(choices):
        worst = _worst(margins[i], reach[i])
        draws = _Draws(margins[i], reach[i], worst, signal[i], stroke[i])
        covered = np.mean(inside[i], axis=0) >= COVERED_SHARE
        exact = np.where(known[i], conform[i], np.nan)[own_pads]
        made, best = _summary(choice.name, s, grid, covered, draws, exact, n_effective)
        if not np.all(covered):
            why = _why_not_covered(groups, i, grid, covered, exact)
            made = replace(made, left_out=f"{why[0]}: {why[1]}") if best is None else replace(made, not_judged=": ".join(why))
        designs = [group.designs[i] for group in groups]
        k = 0 if best is None else best
        yield Tried(choice, made, designs, margins[i], reach[i], worst, k, pads, np.where(known[i], conform[i], 0.0))


def _pads(s: Specification, grid: FloatArray) -> FloatArray:
    """Thicknesses [m] of pads that are made to those of the grid, with the grid's own among them."""
    low, high = made_within(s)
    below = np.linspace(low, grid[0], _BEYOND, endpoint=False) if low < grid[0] else grid[:0]
    above = np.linspace(high, grid[-1], _BEYOND, endpoint=False)[::-1] if high > grid[-1] else grid[:0]
    return np.concatenate([below, grid, above])


def _of_exact(
    groups: Sequence[ElectrodeGroup],
    n_choice: int,
    grid: FloatArray,
    pads: FloatArray,
    errors: Errors,
    rows: Sequence[slice],
) -> tuple[FloatArray, BoolArray]:
    """Probability that pads of exactly a thickness conform, and whether the model covers them, (n_choice, n_pad) each."""
    conform, known = np.empty((n_choice, pads.size)), np.empty((n_choice, pads.size), dtype=bool)
    # Errors are smooth along the thickness: beyond the grid they are as at its end.
    columns = np.clip(np.searchsorted(grid, pads), 0, grid.size - 1)
    for j, (thickness, k) in enumerate(zip(pads, columns, strict=True)):
        each = [list(g.at(float(thickness), errors.only(own), int(k), exact=True)) for g, own in zip(groups, rows, strict=True)]
        for i, parts in enumerate(zip(*each, strict=True)):
            conform[i, j] = np.mean(np.concatenate([_worst(one.margins, one.reach) for one in parts]) >= 0)
            known[i, j] = np.mean(np.concatenate([one.inside for one in parts])) >= COVERED_SHARE
    return conform, known


@dataclass(frozen=True, eq=False)
class _Draws:
    """Draws of one sensor, (n_draw, n_thickness), the margins (n_draw, n_thickness, n_limit); see `Tried`, `Performance`."""

    margins: FloatArray
    reach: FloatArray
    worst: FloatArray
    signal: FloatArray
    stroke: FloatArray


def _worst(margins: FloatArray, reach: FloatArray) -> FloatArray:
    """The smallest margin; where a load is not carried a whole limit and how far the load is off, as no padding is better."""
    return np.asarray(np.where(reach < 0, reach - 1, np.min(margins, axis=-1)))


def _summary(
    name: str, s: Specification, grid: FloatArray, covered: BoolArray, draws: _Draws, exact: FloatArray, n_effective: int
) -> tuple[Built, int | None]:
    """What is said of one sensor, and the index of its best thickness; None where no thickness is covered."""
    known = np.where(covered, 1.0, np.nan)
    margins, reach, worst = draws.margins, draws.reach, draws.worst
    conforms = worst >= 0
    probability = np.mean(conforms, axis=0) * known
    error = monte_carlo_error(np.mean(conforms, axis=0), n_effective) * known
    outside = np.isfinite(margins) & (margins < 0)
    kept = np.sum(outside, axis=2) == 1
    short = np.maximum(-worst, 0.0)
    least = np.min(np.where(covered, short, np.inf), axis=1, initial=np.inf)
    anywhere = np.any(conforms & covered, axis=1)
    left = short - least[:, None] if np.any(covered) else short
    at = _best(s, grid, covered, probability, exact, error, worst) if np.any(covered) else None
    span = None if at is None else crossings(grid, probability, s.probability, at)
    bands = [np.full((5, grid.size), np.nan) for _ in range(2)]
    for into, value in zip(bands, (draws.signal, draws.stroke), strict=True):
        carried = covered & (np.mean(np.isfinite(value), axis=0) >= COVERED_SHARE)
        into[:, carried] = band(value[:, carried])
    return (
        Built(
            name=name,
            left_out="",
            not_judged="",
            covered=covered,
            probability=probability,
            error=error,
            exact=exact,
            not_carried=np.mean(reach < 0, axis=0) * known,
            fails=np.mean(outside, axis=0).T * known,
            alone=np.mean(outside & kept[:, :, None] & (reach >= 0)[:, :, None], axis=0).T * known,
            shortfall=np.mean(short, axis=0) * known,
            regret=np.mean(left, axis=0) * known,
            avoidable=np.mean(~conforms & anywhere[:, None], axis=0) * known,
            signal=bands[0],
            stroke=bands[1],
            best=math.nan if at is None else float(grid[at]),
            best_probability=math.nan if at is None else float(probability[at]),
            best_error=math.nan if at is None else float(error[at]),
            interval=span,
        ),
        at,
    )


def _best(
    s: Specification,
    grid: FloatArray,
    covered: BoolArray,
    probability: FloatArray,
    exact: FloatArray,
    error: FloatArray,
    worst: FloatArray,
) -> int:
    """Of thicknesses that conform as probably as the draws can tell, that in the middle of what its own drawing accepts.

    A thickness that does not conform with the probability that was asked for is not preferred to one that does. Where none
    does, or no drawing accepts one that does, that of the least expected shortfall; where several have none, that with most
    room for the worst draw in twenty.
    """
    known = np.nan_to_num(probability, nan=-1.0)
    top = int(np.argmax(known))
    tied = covered & (known >= known[top] - 2 * error[top])
    if known[top] >= s.probability:
        tied &= known >= s.probability
        at = within_its_drawing(grid, exact, s.probability, tied, s.gauge, s.guard_band)
        if at is not None:
            return at
    short = np.mean(np.maximum(-worst, 0.0), axis=0)
    tied &= short <= np.min(short[tied]) + 1e-12
    return int(np.argmax(np.where(tied, np.quantile(worst, 0.05, axis=0), -np.inf)))


def left_out(choice: PaddingChoice, why: str, grid: FloatArray, s: Specification) -> Built:
    """What is said of a sensor that no model serves.

    Parameters
    ----------
    choice : of the design variables.
    why : it is left out.
    grid : [m], (n_thickness,).
    s : the specification.
    """
    nothing, several = np.full(grid.size, np.nan), np.full((len(s.limits), grid.size), np.nan)
    five = np.full((5, grid.size), np.nan)
    nan = math.nan
    return Built(
        choice.name,
        why,
        "",
        np.zeros(grid.size, dtype=bool),
        *(nothing,) * 4,
        several,
        several,
        *(nothing,) * 3,
        five,
        five,
        nan,
        nan,
        nan,
        None,
    )


def _why_not_covered(
    groups: Sequence[ElectrodeGroup], i: int, grid: FloatArray, covered: BoolArray, exact: FloatArray
) -> list[str]:
    """What the model does not cover of the nominal thicknesses of one sensor, and why, as far as it says so."""
    group, forward = groups[0], groups[0].part.member.forward
    which = "none of these thicknesses" if not np.any(covered) else f"no padding of {spans_in_words(grid, ~covered)}"
    said = f"the {forward.name} covers {which} for {100 * COVERED_SHARE:g} % of the draws"
    tolerance = group.specification.padding_tolerance
    known = np.isfinite(exact)
    if tolerance is not None and np.all(known[~covered]):
        given = f"with pads made with {tolerance.in_words} ({TOLERANCE_KEY})"
        return [f"{said} {given}", f"too many of them are {'thinner or ' if grid[0] > 0 else ''}thicker than it covers"]
    away = np.flatnonzero(~covered)
    one = with_padding(group.designs[i], float(grid[away[away.size // 2]]))
    under = [replace(one, indenter=replace(one.indenter, radius=ball)) for ball in group.balls]
    reasons = [why for design in under if (why := forward.outside(design, np.zeros(1)))]
    return [said, *reasons[:1]]

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
from calib.decision.guard_band import crossings
from calib.decision.performance import ElectrodeGroup, Errors
from calib.decision.sensors import with_padding
from calib.experiment import Specification
from models.sensor import BoolArray, Design, FloatArray


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
    """

    choice: PaddingChoice
    built: Built
    designs: Sequence[Design]
    margins: FloatArray
    reach: FloatArray
    worst: FloatArray
    at: int


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
    exact = np.empty((len(choices), grid.size))
    thinnest = min(float(np.min(group.offset)) for group in groups)
    buildable = (grid == 0) | (grid + thinnest >= 0)
    for k, thickness in enumerate(grid):
        if not buildable[k]:
            margins[:, :, k], reach[:, :, k], inside[:, :, k] = np.nan, -1.0, False
            signal[:, :, k], stroke[:, :, k], exact[:, k] = np.nan, np.nan, np.nan
            continue
        for group, own in zip(groups, rows, strict=True):
            for i, at in enumerate(group.at(float(thickness), errors.only(own), k)):
                margins[i, own, k], reach[i, own, k], inside[i, own, k] = at.margins, at.reach, at.inside
                signal[i, own, k], stroke[i, own, k] = at.signal, at.stroke
        if s.padding_tolerance is None:
            exact[:, k] = np.mean(_worst(margins[:, :, k], reach[:, :, k]) >= 0, axis=1)
        else:
            each = [
                [_worst(a.margins, a.reach) for a in g.at(float(thickness), errors.only(own), k, exact=True)]
                for g, own in zip(groups, rows, strict=True)
            ]
            exact[:, k] = [np.mean(np.concatenate(one) >= 0) for one in zip(*each, strict=True)]
    for i, choice in enumerate(choices):
        worst = _worst(margins[i], reach[i])
        draws = _Draws(margins[i], reach[i], worst, signal[i], stroke[i])
        covered = np.mean(inside[i], axis=0) >= COVERED_SHARE
        made, best = _summary(choice.name, s, grid, covered, draws, exact[i], n_effective)
        if best is None:
            made = replace(made, left_out=_why_not_covered(groups, i, grid))
        designs = [group.designs[i] for group in groups]
        yield Tried(choice, made, designs, margins[i], reach[i], worst, 0 if best is None else best)


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
    # Agresti & Coull's standard error, which is not zero where all draws agree.
    p = (np.mean(conforms, axis=0) * n_effective + 2) / (n_effective + 4)
    error = np.sqrt(p * (1 - p) / (n_effective + 4)) * known
    outside = np.isfinite(margins) & (margins < 0)
    kept = np.sum(outside, axis=2) == 1
    short = np.maximum(-worst, 0.0)
    least = np.min(np.where(covered, short, np.inf), axis=1, initial=np.inf)
    anywhere = np.any(conforms & covered, axis=1)
    left = short - least[:, None] if np.any(covered) else short
    at = _best(s, covered, probability, error, worst) if np.any(covered) else None
    span = None if at is None else crossings(grid, probability, s.probability, at)
    bands = [np.full((5, grid.size), np.nan) for _ in range(2)]
    for into, value in zip(bands, (draws.signal, draws.stroke), strict=True):
        carried = covered & (np.mean(np.isfinite(value), axis=0) >= COVERED_SHARE)
        into[:, carried] = band(value[:, carried])
    return (
        Built(
            name=name,
            left_out="",
            covered=covered,
            probability=probability,
            error=error,
            exact=exact * known,
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


def _best(s: Specification, covered: BoolArray, probability: FloatArray, error: FloatArray, worst: FloatArray) -> int:
    """Of thicknesses that conform as probably as the draws can tell, that of the least expected shortfall.

    Where several have none, that with most room for the worst draw in twenty. A thickness that does not conform with the
    probability that was asked for is not preferred to one that does.
    """
    known = np.nan_to_num(probability, nan=-1.0)
    top = int(np.argmax(known))
    tied = covered & (known >= known[top] - 2 * error[top])
    if known[top] >= s.probability:
        tied &= known >= s.probability
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


def _why_not_covered(groups: Sequence[ElectrodeGroup], i: int, grid: FloatArray) -> str:
    group, forward = groups[0], groups[0].part.member.forward
    middle = with_padding(group.designs[i], float(grid[grid.size // 2]))
    under = [replace(middle, indenter=replace(middle.indenter, radius=ball)) for ball in group.balls]
    reasons = [why for design in under if (why := forward.outside(design, np.zeros(1)))]
    said = f"the {forward.name} covers none of these thicknesses for 95 % of the draws"
    return f"{said}: {reasons[0]}" if reasons else said

"""From the shape of a record and the names in it to evidence on which way compression is, with weights and in words."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calib.lab.instruments import LabTable, says_sense
from calib.lab.shape import Shape
from models.sensor import FloatArray

#: Quantities that have a sign, with unit and factor to it for people.
SIGNED: Mapping[str, tuple[str, float]] = {"force": ("N", 1.0), "displacement": ("mm", 1e3)}

# A flat end counts from the first share of the travel on (any curve is flat over a little), and most from the second on.
_FLAT_COUNTS, _FLAT_FROM, _FLAT_MOST = 3.0, 0.08, 0.23
# What a bend counts at most, and which share of the change it then is (a force that goes with depth^1.5: 0.1).
_BEND_COUNTS, _BEND_MOST = 3.0, 0.1
# What the first change counts if the record begins at zero load, if it does not, and from which nearness to zero on it does.
_START_COUNTS, _ANYWHERE_COUNTS, _NEAR_ZERO = 2.6, 0.3, 0.35
# What a bend counts, from which on a channel stiffens up to a flat end; and the nearness to zero from which on a record may
# begin at zero, and surely does.
_STIFFENS, _FROM_ZERO, _SURELY_FROM_ZERO = 0.6, 1 / 3, 0.5
# Share of the largest change from which on the first counts fully.
_FIRST = 0.4
# No record starts pressed by as much as this [m]: what that counts.
_DEEP, _DEEP_COUNTS = 10e-3, 1.5
# What last readings count that turn against all before, and how many times as large as usual their steps then are.
_END_COUNTS, _END_STEPS = 1.5, 3.0
# What it counts that the displacement is zero at one of its ends, and how near to zero that is, as a share of its range.
_ZERO_COUNTS, _AT_ZERO = 2.5, 0.03
# What it counts that a name says which sign compression has.
_SAID_COUNTS = 2.0
_COMPRESSION = re.compile(r"compress|indent|penetrat|\bdepth|druck|stauch|eindring|écras|压|圧", re.IGNORECASE)
_TENSION = re.compile(r"\btensile|\btension|\bpull|zug|elongat|dehn|traction|拉|引", re.IGNORECASE)


@dataclass(frozen=True)
class Evidence:
    """One observation: which sign it speaks for, by how much, and in words."""

    weight: float
    words: str


# --- evidence: weights are positive where they speak for "compression positive" in the channel that is named ---------------


def of_shape(name: str, shape: Shape, same: float) -> list[Evidence]:
    """How the channel bends, and at which end of the displacement it is flat.

    A flat end at an extreme is no rest where the channel stiffens up to there, as at the end of a range; nor is it known to be
    one where the record goes away from zero and straight on to there. Where the record begins near zero and goes there, it may
    be a plateau of what is pressed as well as a rest behind a record that was zeroed in the press: what the shape says against
    that beginning then counts no more than this does.

    Parameters
    ----------
    name : of the channel.
    shape : how it goes with the displacement.
    same : whether it rises with the displacement, as 1 or -1.
    """
    more = shape.flat_low - shape.flat_high
    flat = float(np.sign(more)) * _FLAT_COUNTS * float(np.clip((abs(more) - _FLAT_FROM) / (_FLAT_MOST - _FLAT_FROM), 0.0, 1.0))
    # A force that goes from one side of zero to the other bends by adhesion, too.
    adhesion = (0.8 if shape.once else 0.5) * _BEND_MOST if shape.crosses else 0.0
    bend = _bend_counts(shape.bend, adhesion)
    begins, goes_there = float(np.sign(shape.first)), flat * shape.first_travel < 0
    if shape.end_extreme if goes_there else shape.begin_extreme:
        from_zero, goes_away = _from_zero(shape), abs(shape.begin + shape.first) > abs(shape.begin)
        left = shape.bend_above if flat > 0 else shape.bend_below
        agrees = _bend_counts(left, 0.0) * float(np.sign(flat)) * same
        against = [w for w in (flat * same, bend) if w * begins < 0]
        if agrees < -_STIFFENS and (goes_there or from_zero == 0):
            bend = _bend_counts(left, adhesion)
            flat *= 1 - from_zero
        elif goes_there and agrees < _STIFFENS and goes_away:
            flat = 0.0
        elif goes_there and against:
            most = 1 - from_zero * (1 - min(1.0, abs(of_start(name, shape)[0].weight / sum(against))))
            flat, bend = (most * w if w * sense * begins < 0 else w for w, sense in ((flat, same), (bend, 1.0)))
    share, end = (shape.flat_low, "small") if flat > 0 else (shape.flat_high, "large")
    words = f"{name} is flat, as out of contact, over {share * 100:.0f} % of the travel at {end} displacements of the file"
    bends = f"{name} bends {up(bend)} over the displacement, and a press stiffens"
    return [Evidence(flat * same, words), Evidence(bend, bends)]


def _bend_counts(bend: float, adhesion: float) -> float:
    """What a bend counts beyond one that adhesion explains."""
    bent = float(np.sign(bend)) * max(abs(bend) - adhesion, 0.0)
    return _BEND_COUNTS * float(np.clip(bent / _BEND_MOST, -1.0, 1.0))


def _from_zero(shape: Shape) -> float:
    """How surely a record begins near zero and goes away from it, from 0 to 1."""
    begin, end = abs(shape.begin), abs(shape.begin + shape.first)
    near = (end - begin) / max(end + begin, 1e-300)
    return float(np.clip((near - _FROM_ZERO) / (_SURELY_FROM_ZERO - _FROM_ZERO), 0.0, 1.0))


def of_start(name: str, shape: Shape) -> list[Evidence]:
    """Which way the channel goes first: a record begins out of contact, near zero load.

    Parameters
    ----------
    name : of the channel.
    shape : how it goes with the displacement.
    """
    end = shape.begin + shape.first
    weight = _ANYWHERE_COUNTS if shape.crosses else start_counts(shape.begin, end, waits=False)
    if abs(shape.first_travel) > _DEEP and abs(end) > abs(shape.begin):
        weight += _DEEP_COUNTS
    # A small first change may be drift, while the ball is still on its way.
    weight *= min(1.0, shape.share / _FIRST)
    return [Evidence(float(np.sign(shape.first)) * weight, f"the record begins with {name} going {up(shape.first)}")]


def of_end(name: str, x: FloatArray, y: FloatArray, first: float) -> list[Evidence]:
    """Whether the last readings go steeply against all before while the ball moves on, as where a press begins under a drift.

    Parameters
    ----------
    name : of the channel.
    x, y : displacement and channel, (n_row,), in the order of reading.
    first : change of the channel in the first stretch.
    """
    moves, steps = np.diff(x), np.diff(y) * np.sign(first)
    onwards = (steps < 0) & (np.sign(moves) == np.sign(x[-1] - x[0]))
    n = int(np.argmin(onwards[::-1])) if not np.all(onwards) else 0
    if n == 0 or 2 * n > steps.size or float(np.mean(-steps[-n:])) <= _END_STEPS * float(np.quantile(np.abs(steps[:-n]), 0.9)):
        return []
    return [Evidence(-float(np.sign(first)) * _END_COUNTS, f"{name} turns {up(-first)} in the last {n} reading(s), steeply")]


def of_zero(x: FloatArray, same: float) -> list[Evidence]:
    """Where the displacement is counted from: its zero is a start or a touch, and the press goes away from it.

    Parameters
    ----------
    x : displacement, (n_row,), of which a single odd reading at either end counts nothing.
    same : whether the channel that the evidence is of rises with it, as 1 or -1.
    """
    low, high = (float(np.partition(x, k)[k]) for k in (1, x.size - 2))
    near, far = sorted((low, high), key=abs)
    if abs(near) > _AT_ZERO * (high - low):
        return []
    sense = float(np.sign(far))
    return [Evidence(sense * same * _ZERO_COUNTS, f"displacement is zero at one end and goes {up(sense)} from there")]


def start_counts(begin: float, end: float, *, waits: bool) -> float:
    """How much the first change counts: most from zero on, least away from it.

    Parameters
    ----------
    begin, end : of the channel in the first stretch.
    waits : whether the record is flat before.
    """
    if waits:
        return _START_COUNTS
    near = (abs(end) - abs(begin)) / max(abs(end) + abs(begin), 1e-300)
    return _ANYWHERE_COUNTS + (_START_COUNTS - _ANYWHERE_COUNTS) * max(near - _NEAR_ZERO, 0.0) / (1 - _NEAR_ZERO)


def of_names(table: LabTable, quantity: str, same: float) -> list[Evidence]:
    """What the name of a column says of its sense, or a line beside the table.

    Parameters
    ----------
    table : the lab file.
    quantity : of which name.
    same : whether it goes with the channel that the evidence is of, as 1 or -1.
    """
    name = table.sources.get(quantity, "")
    if sense := says_sense(name):
        return [Evidence(_SAID_COUNTS * sense * same, f'{quantity} is called "{name}"')]
    if quantity in table.conventions:
        sense, line = table.conventions[quantity]
        once = quantity == "force" or line != table.conventions.get("force", (0, ""))[1]
        return [Evidence(_SAID_COUNTS * sense * same, line)] if once else []
    compression, tension = bool(_COMPRESSION.search(name)), bool(_TENSION.search(name))
    if compression == tension:
        return []
    return [Evidence(same if compression else -same, f'{quantity} is called "{name}"')]


def of_capacitance(sensed: Shape | None, quantity: str, same: float) -> list[Evidence]:
    """What a capacitance in the same file says, as it rises with compression.

    Parameters
    ----------
    sensed : how it goes with the quantity; None if the file has none that shows anything.
    quantity : beside it.
    same : whether that goes with the channel that the evidence is of, as 1 or -1.
    """
    if sensed is None:
        return []
    return [
        Evidence(2.0 * sensed.slope * same, f"capacitance, which rises with compression, goes {along(sensed.slope)} {quantity}")
    ]


def turned(e: Evidence, same: float) -> Evidence:
    """The same observation as evidence on a channel that goes with the other one, or against it.

    Parameters
    ----------
    e : the evidence.
    same : 1 or -1.
    """
    return Evidence(e.weight * same, e.words)


# --- words -----------------------------------------------------------------------------------------------------------------


def up(value: float) -> str:
    """Whether something rises or falls, in a word."""
    return "up" if value >= 0 else "down"


def along(same: float) -> str:
    """Whether two things go the same way, in a word."""
    return "with" if same > 0 else "against"


def amount(value: float, quantity: str) -> str:
    """Write a value with its unit for people, to two digits.

    Parameters
    ----------
    value : [N] or [m].
    quantity : which.
    """
    unit, scale = SIGNED[quantity]
    size = abs(value * scale)
    decimals = max(0, 1 - math.floor(math.log10(size))) if size > 0 else 0
    return f"{value * scale:+.{decimals}f} {unit}"


def words_for(evidence: Sequence[Evidence], factor: float) -> str:
    """Name what speaks for a sign, the weightiest first.

    Parameters
    ----------
    evidence : all there is.
    factor : the sign that is spoken for.
    """
    speaking = sorted((e for e in evidence if e.words and e.weight * factor >= 0.5), key=lambda e: -abs(e.weight))
    return "; ".join(e.words for e in speaking)


def why(evidence: Sequence[Evidence], factor: float) -> str:
    """Name what speaks for a sign, and what against it.

    Parameters
    ----------
    evidence : all there is.
    factor : the sign that was decided on.
    """
    against = words_for(evidence, -factor)
    return words_for(evidence, factor) + (f"; although {against}" if against else "")

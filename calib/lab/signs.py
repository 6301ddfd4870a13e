"""From the columns of a lab table to which way compression is in force and displacement, weighed over the whole record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from calib.errors import Choice, Fault, InputError
from calib.lab.evidence import (
    SIGNED,
    Evidence,
    along,
    amount,
    of_capacitance,
    of_end,
    of_names,
    of_shape,
    of_start,
    of_zero,
    start_counts,
    turned,
    up,
    why,
    words_for,
)
from calib.lab.folded import bounces_of, pulls_of
from calib.lab.instruments import LabTable, says_sense
from calib.lab.linear import slope_and_error
from calib.lab.shape import NOTHING, Shape, at_the_end_of_its_range, calm, shape_of, steady
from calib.lab.signal import excursion, reading_noise, resolution, reversals
from models.sensor import BoolArray, FloatArray

#: What may be said of the sign of a quantity (`Reading.sign`), and the factor that makes compression positive.
SIGNS: Mapping[str, float] = {"compression positive": 1.0, "compression negative": -1.0}
Strength = Literal["clear", "likely", "stated", "none"]

# Evidence counts about as the logarithm of odds. Below the first number nothing is decided, from the second on it is clear.
_DOUBTFUL, _CLEAR = 0.7, 2.5
# What may stand against an odd sign in a single stretch, as a share of what is for it.
_CONTRADICTED = 0.3
# The same of any sign that a single stretch shows.
_OPPOSED = 0.5
# What the flat end of a retreat and what else speaks for it, but for its bend, must come to at least.
_SEEN = 1.0
# Share of the largest load that the load in compression reaches in a press.
_COMPRESSED = 0.1
# Share of it that is left, at most, where a retreat ends.
_UNLOADED = 0.2
# Share of the changes of force that must go one way with the displacement, for the two signs to hang together.
_TOGETHER = 0.5
# Share of all its travel that a crosshead which goes one way is displaced by in the end, and rows that show it.
_ONE_WAY, _FEWEST = 0.9, 8
# Of the change by a drift, what a press under it is at least: where an adhesive ball comes off, the load jumps by less.
_OUTWEIGHED = 0.5
# Rows out of contact that tell a drift of the load, in which a capacitance stays within so many noises; the sd of a drift.
_FEWEST_OUT, _STANDS_STILL, _SURE = 8, 4.0, 5.0
_LAST_ROWS = "the last rows, in which force changes most, go the other way with the displacement than all others"

# Share of its range by which a force that was sorted goes on as the ball goes there, and as it goes back, and by which it
# comes back itself at most.
_ON, _BACK = 0.1, 0.02
# Share of its travel by which a ball goes there and back.
_TURNED = 0.5
# Share of the rows of a stretch that are near its turn, and by how much of their sum paces on both sides of it differ at most.
_NEAR_TURN, _SAME_PACE = 0.15, 0.2

_RETREAT = "a retreat from a record that starts pressed (with --branch unloading, if that is all of it), or a pull"
_APART = "force changes, but not with the displacement"
_THERE_AND_BACK = "over the same places force changes otherwise as the ball goes there than as it comes back"
_DRIFT_AND_PRESS = (
    "force goes one way and then the other as the ball goes on, more steeply where it changes less, as in a press under a drift"
)


@dataclass(frozen=True)
class SignDecision:
    """Which way compression is in one column of a lab file, and how sure that is.

    Attributes
    ----------
    quantity : "force" or "displacement".
    factor : 1, or -1 where compression is negative in the file.
    strength : "clear" or "likely" by the evidence of the record, "stated" by the user, "none" where the column shows nothing.
    note : the decision in words, with what it rests on.
    """

    quantity: str
    factor: float
    strength: Strength
    note: str


def decide_signs(
    table: LabTable, displacement: FloatArray | None, force: FloatArray | None, good: BoolArray
) -> dict[str, SignDecision]:
    """Decide which way compression is in force and displacement of a lab file, from all that its record shows.

    In contact the force grows with the depth, so that the two signs hang together; a press stiffens, so that the force bends
    towards compression; out of contact it is flat; a record begins before the press, not in it, and a pull-off comes after it.
    Names that speak of compression or tension and a capacitance that rises with compression count, too; a line beside the table
    that says the sign counts where these leave it in doubt, and else is told of where they say the opposite.

    Parameters
    ----------
    table : one lab file.
    displacement, force : [m] and [N], its own without jumps where a zero was set anew, (n_row,); None if it has none.
    good : rows that can be used, (n_row,).

    Returns
    -------
    Quantity -> decision, for force and displacement where the file has them.

    Raises
    ------
    InputError
        If the record speaks for both signs, or for none, and `Reading.sign` does not say which it is; or if the force is shown
        without its sign.
    """
    lost = _lost_sign(table, displacement, force, good)
    if lost is not None and "force" not in _said(table):
        raise InputError(_without_sign(table, lost))
    if displacement is not None and force is not None and _goes_on_as_the_ball_turns(displacement, force, good):
        raise InputError(_sorted(table))
    try:
        decided = _decide(replace(table, conventions={}), displacement, force, good)
    except InputError:
        if not table.conventions:
            raise
        decided = _decide(table, displacement, force, good)
    if any(_contradicted(table, decision) for decision in decided.values()):
        # What the file says may make doubtful what the record shows.
        weighed = _decide(table, displacement, force, good)
        decided = {q: d if d.factor == weighed[q].factor else weighed[q] for q, d in decided.items()}
    if lost is not None:
        decided["force"] = replace(decided["force"], note=f"{decided['force'].note}; but {lost.shown}")
    return {quantity: _with_contradiction(table, decision) for quantity, decision in decided.items()}


@dataclass(frozen=True)
class _LostSign:
    """What shows that a force is written without its sign, which readings are of the other sense, and which lack a minus."""

    shown: str
    of_others: str
    minus: str


def _lost_sign(table: LabTable, displacement: FloatArray | None, force: FloatArray | None, good: BoolArray) -> _LostSign | None:
    """What shows that the force of a record is written without its sign; None if nothing does."""
    driver = displacement if displacement is not None else table.columns.get("capacitance")
    if force is None or driver is None:
        return None
    time = table.columns.get("time", np.arange(force.size, dtype=np.float64))
    along = driver if displacement is not None else time
    rows = np.flatnonzero(good & np.isfinite(force) & np.isfinite(driver) & np.isfinite(along))
    found = bounces_of(driver[rows], along[rows], force[rows])
    if found:
        at = _lines([str(line) for line in table.lines[rows[found]].tolist()])
        shown = (
            f"the force comes to zero at {at} and leaves it at the same pace, while the ball goes on, as one without its sign"
        )
        return _LostSign(shown, "on one side of there", "on the side out of contact")
    pulls = [table.lines[rows[list(pull)]].tolist() for pull in pulls_of(driver[rows], force[rows])]
    if not pulls:
        return None
    where = _lines([f"{first} to {last}" for first, last in pulls])
    shown = f"the force grows again in {where} as the ball goes on between the press and its rest, as a pull without its sign"
    return _LostSign(shown, "there", "in these lines")


def _lines(lines: list[str]) -> str:
    """Name some lines, the first of many."""
    shown = ", ".join(lines[:4]) + (f" and {len(lines) - 4} others" if len(lines) > 4 else "")
    return f"line{'s' if len(lines) > 1 or ' ' in lines[0] else ''} {shown}"


def _without_sign(table: LabTable, lost: _LostSign) -> Fault:
    """Refuse a force of which some readings have lost their sign, unless it is said that they have theirs."""
    return Fault(
        f"{lost.shown} would: the readings {lost.of_others} are of the other sense",
        table.path,
        int(table.lines[0]) if len(table.lines) else None,
        advice=f"Export the force with its sign, or write a minus before the readings {lost.minus}; if they are right "
        f'as they stand, say --sign "force=compression positive" (or negative){_left_out(table)}',
        choice=Choice("sign", tuple(SIGNS), "force"),
    )


def _left_out(table: LabTable) -> str:
    """Advice to leave the force out, where something is left then."""
    return "; or leave the force out: --columns force=none" if "capacitance" in table.columns else ""


def _contradicted(table: LabTable, decision: SignDecision) -> str:
    """What the name of its column or a line beside the table says of the sign, if that is the opposite of a decision; or ""."""
    name = table.sources.get(decision.quantity, "")
    sense, words = table.conventions.get(decision.quantity, (0, ""))
    sense, words = (own, f'the column is called "{name}"') if (own := says_sense(name)) else (sense, words)
    return words if sense and sense != decision.factor and decision.strength != "none" else ""


def _with_contradiction(table: LabTable, decision: SignDecision) -> SignDecision:
    """A decision with what is said of the sign beside it, if that is the opposite."""
    words = _contradicted(table, decision)
    return replace(decision, note=f"{decision.note}; the file says the opposite: {words}") if words else decision


def _decide(
    table: LabTable, displacement: FloatArray | None, force: FloatArray | None, good: BoolArray
) -> dict[str, SignDecision]:
    """Decide the signs by the record, the names, what the user says, and the conventions of the table, if it has any."""
    columns = {"displacement": displacement, "force": force, "capacitance": table.columns.get("capacitance")}
    found = {n: v for n, v in columns.items() if v is not None and np.sum(good & np.isfinite(v)) >= 2}
    time = table.columns.get("time")
    shown = {name: _moves(values[good & np.isfinite(values)]) for name, values in found.items()}
    said = _said(table)

    def shape(x: str, y: str) -> Shape | None:
        if not (shown.get(x) and shown.get(y)):
            return None
        rows = np.flatnonzero(good & np.isfinite(found[x]) & np.isfinite(found[y]))
        for channel in (found[q] for q in (x, y) if q != "displacement"):
            rows = rows[~at_the_end_of_its_range(channel[rows])] if rows.size else rows
        clock = rows.astype(float) if time is None or not np.all(np.isfinite(time[rows])) else time[rows]
        return shape_of(found[x][rows], found[y][rows], clock) if rows.size >= 5 else None

    press = shape("displacement", "force")
    sensed = {"displacement": shape("displacement", "capacitance"), "force": shape("capacitance", "force")}
    if press is not None and abs(press.slope) >= _TOGETHER:
        load = found["force"][good & np.isfinite(found["force"])]
        both = good & np.isfinite(found["force"]) & np.isfinite(found["displacement"])
        x, y = (found[q][both] for q in ("displacement", "force"))
        if not set(SIGNED) <= set(said) and press.against:
            raise InputError(_unrelated(table, None, [q for q in SIGNED if q not in said], _THERE_AND_BACK))
        if not set(SIGNED) <= set(said) and _ends_otherwise(x, y, press.slope):
            raise InputError(_unrelated(table, None, [q for q in SIGNED if q not in said]))
        same = float(np.sign(press.slope))
        end = of_end("force", x, y, press.first)
        sensed_by = of_capacitance(sensed["displacement"], "displacement", same)
        zero = of_zero(x, same)
        by_itself = _drifts(found, good, time) if sensed["displacement"] is not None else 0.0
        decided = _together(table, press, steady(load), zero, end, sensed_by, said, by_itself)
        factor = decided["force"].factor
        if not set(SIGNED) <= set(said) and press.once and _goes_as_a_drift(x, factor * y, press.first * factor):
            raise InputError(_unrelated(table, None, [q for q in SIGNED if q not in said], _DRIFT_AND_PRESS))
        return {**decided, **_missing(found, said)}
    if press is not None and (open_ := [q for q in SIGNED if q not in said]):
        raise InputError(_unrelated(table, press, open_))
    if press is None and not said and _leaves_and_comes_back(found, shown, good) and sensed["force"] is None:
        words = "force leaves where it began, and comes back to it, as the ball goes one way"
        raise InputError(_unrelated(table, None, tuple(SIGNED), words))
    decided = {}
    faults: list[Fault] = []
    for quantity in SIGNED:
        if quantity not in found:
            continue
        rows = good & np.isfinite(found[quantity])
        if not shown[quantity]:
            decided[quantity] = _still(quantity, said)
        elif quantity == "displacement" and sensed[quantity] is not None:
            decided[quantity] = _by_capacitance(table, _present(sensed[quantity]), said)
        else:
            try:
                decided[quantity] = _alone(table, quantity, found[quantity][rows], sensed[quantity], said)
            except InputError as error:
                faults += error.faults
    if faults:
        raise InputError(faults)
    both = good & np.all([np.isfinite(found[q]) for q in SIGNED], axis=0) if set(SIGNED) <= set(found) else np.zeros(0, bool)
    if not said and all(map(shown.get, SIGNED)) and not _go_together(*(decided[q].factor * found[q][both] for q in SIGNED)):
        raise InputError(_unrelated(table, None, tuple(SIGNED), _APART))
    return {**decided, **_missing(found, said)}


def _missing(found: Mapping[str, FloatArray], said: Mapping[str, float]) -> dict[str, SignDecision]:
    """What was said of columns that the file does not have; nothing where one thing was said of both and one is there."""
    missing = [q for q in said if q not in found]
    if len(set(said.values())) == 1 and len(said) > len(missing):
        return {}
    return {q: SignDecision(q, said[q], "stated", f"{q}: its sign is stated, but the file has no such column") for q in missing}


def _said(table: LabTable) -> dict[str, float]:
    """What the user says of the signs, as factors."""
    for quantity, sense in table.sign.items():
        if quantity not in SIGNED or sense not in SIGNS:
            raise InputError(
                Fault(
                    f'the sign "{quantity} = {sense}" is not understood',
                    table.path,
                    advice=f'Of {" and ".join(SIGNED)} may be said {" or ".join(SIGNS)}: --sign "force=compression negative"',
                )
            )
    return {quantity: SIGNS[sense] for quantity, sense in table.sign.items()}


def _present(shape: Shape | None) -> Shape:
    assert shape is not None
    return shape


def _moves(values: FloatArray) -> bool:
    """Whether a column shows more than its noise, spikes aside."""
    range_of = float(np.ptp(steady(values)))
    return range_of > NOTHING * reading_noise(values) and range_of > 0


def _still(quantity: str, said: Mapping[str, float]) -> SignDecision:
    if quantity in said:
        return _stated(quantity, said[quantity], "")
    return SignDecision(quantity, 1.0, "none", f"{quantity}: no excursion beyond its noise, sign kept")


def _together(
    table: LabTable,
    press: Shape,
    load: FloatArray,
    zero: Sequence[Evidence],
    end: Sequence[Evidence],
    sensed: Sequence[Evidence],
    said: Mapping[str, float],
    by_itself: float,
) -> dict[str, SignDecision]:
    """Decide both signs of a record whose force (`load`, without spikes) goes with the displacement: one decides the other.

    `zero`, `end` and `sensed` are evidence on the sign of the force from the zero of the displacement, the last readings and a
    capacitance; `by_itself` is what a drift makes of the force up to the turn [N], if that before contact goes on.
    """
    same = float(np.sign(press.slope))
    others = [*of_names(table, "force", 1.0), *of_names(table, "displacement", same), *sensed]
    evidence = [*of_shape("force", press, same), *of_start("force", press), *others, *end]
    total = sum(e.weight for e in evidence)
    if said:
        factor = said.get("force", same * said.get("displacement", 0.0))
        wanted = {q: said.get(q, factor if q == "force" else same * factor) for q in SIGNED}
        found: dict[str, SignDecision] = {}
        for quantity, own in wanted.items():
            shown = float(np.sign(total)) * (1.0 if quantity == "force" else same)
            against = ""
            if abs(total) >= _DOUBTFUL and shown != own:
                against = f"; the record shows the opposite ({words_for(evidence, float(np.sign(total)))})"
            elif same * wanted["force"] != wanted["displacement"]:
                against = "; but then the force falls while the ball goes deeper"
            if quantity in said:
                found[quantity] = _stated(quantity, own, against)
            else:
                other = "displacement" if quantity == "force" else "force"
                against += "".join(f"; but {e.words}" for e in of_names(table, quantity, 1.0) if e.weight * own < 0)
                found[quantity] = _decision(
                    quantity, own, "stated", f"it goes {along(same)} {other}, whose sign is stated{against}"
                )
        return found
    factor = float(np.sign(total))
    opposed = sum(abs(e.weight) for e in evidence if e.weight * factor < 0)
    # That a record starts pressed, or that the force never is on the side of compression, takes more than a likelihood, and in
    # one stretch alone no strong evidence against it.
    pressed = press.first * factor < 0
    pulled = float(np.max(factor * load)) < _COMPRESSED * float(np.max(np.abs(load)))
    odd = pressed or pulled
    doubt = odd and press.once and opposed > _CONTRADICTED * (abs(total) + opposed)
    # One that starts pressed shows compression somewhere.
    doubt |= pressed and pulled and press.once
    # A load that is never on the side of compression and ends at none may as well be the retreat from a press.
    doubt |= pulled and press.once and abs(press.begin + press.rise) < _UNLOADED * float(np.max(np.abs(load)))
    # Where a drift hides the press the first change and the bend oppose each other.
    doubt |= press.once and opposed > _OPPOSED * (abs(total) + opposed)
    # A machine that starts to move bends the force as well: a retreat alone has to be seen to end out of contact, or be named.
    named = sum(e.weight * factor for e in evidence[3:])
    doubt |= press.once and pressed and evidence[0].weight * factor + max(named, 0.0) < _SEEN
    # A ball that sticks up to the end bends it, too, and what came before is flat beside that: only others tell that this is
    # a press, and what came before a retreat.
    doubt |= press.outdone and pressed and sum(e.weight * factor for e in others) < _SEEN
    # A drift that began before contact and is larger than all that the force changes by hides a press of the other way, which
    # the bend may show.
    doubt |= (
        evidence[1].weight * factor < 0
        and abs(by_itself) > abs(press.first)
        and min(by_itself * factor, by_itself * press.first) > 0
    )
    # So does a place that is zero where the ball is deepest, unless force is seen to be flat, out of contact, at the other end.
    opposing = [e for e in zero if e.weight * factor < 0 < _CLEAR - evidence[0].weight * factor]
    evidence += opposing
    least = _CLEAR + abs(opposing[0].weight) if opposing else _CLEAR if odd else _DOUBTFUL
    if doubt or abs(total) < least or not words_for(evidence, factor):
        raise InputError(_doubtful(table, "force", evidence, press.rise, press.first_travel))
    strength: Strength = "clear" if abs(total) >= _CLEAR else "likely"
    begun = " (the record starts pressed)" if press.first * factor < 0 else ""
    force = f"{amount(press.rise, 'force')} in the first stretch{begun}; {why(evidence, factor)}"
    place = f"{amount(press.first_travel, 'displacement')} in the first stretch; force goes {along(same)} it"
    return {
        "force": _decision("force", factor, strength, force),
        "displacement": _decision("displacement", same * factor, strength, place),
    }


def _drifts(found: Mapping[str, FloatArray], good: BoolArray, time: FloatArray | None) -> float:
    """What the force changes by up to the turn of the ball [N] if it goes on as before contact, of which a capacitance tells.

    Out of contact a capacitance stands still, and so does a load, but for a drift; 0 where too few rows tell, or it rests.
    """
    columns = [found[q] for q in ("displacement", "force", "capacitance")]
    rows = np.flatnonzero(good & np.all([np.isfinite(v) for v in columns], axis=0))
    place, load, sensed = (v[rows] for v in columns)
    clock = rows.astype(np.float64) if time is None or not np.all(np.isfinite(time[rows])) else time[rows]
    few = max(5, min(_FEWEST_OUT, rows.size // 10))
    left = np.abs(calm(sensed) - np.median(sensed[:few])) > _STANDS_STILL * max(reading_noise(sensed), resolution(sensed))
    out = int(np.argmax(left))
    turn = int(np.argmax(np.abs(calm(place) - place[0])))
    if out < _FEWEST_OUT or turn <= out or np.ptp(clock[:out]) <= 0:
        return 0.0
    slope, error = slope_and_error(clock[:out], load[:out])
    changes, unsure = slope_and_error(clock[:out], sensed[:out])
    drifts = abs(slope) > _SURE * error and abs(changes) < _SURE * unsure
    return float(slope * (clock[turn] - clock[0])) if drifts else 0.0


def _by_capacitance(table: LabTable, sensed: Shape, said: Mapping[str, float]) -> SignDecision:
    """Decide the sign of a displacement without a force that goes with it, by the capacitance of the same file."""
    if "displacement" in said:
        return _stated("displacement", said["displacement"], "")
    same = float(np.sign(sensed.slope)) or 1.0
    # In terms of whether the capacitance rises in compression.
    evidence = [
        Evidence(2.0, "capacitance rises with compression"),
        *of_shape("capacitance", sensed, same),
        Evidence(float(np.sign(sensed.first)), f"the record begins with capacitance going {up(sensed.first)}"),
        *of_names(table, "displacement", same),
    ]
    total = sum(e.weight for e in evidence)
    if abs(total) < _DOUBTFUL or abs(sensed.slope) < _TOGETHER:
        raise InputError(_doubtful(table, "displacement", [turned(e, same) for e in evidence], sensed.first_travel, None))
    factor = same * float(np.sign(total))
    falls = "" if total > 0 else "; capacitance falls with compression in this file"
    strength: Strength = "clear" if abs(total) >= _CLEAR else "likely"
    words = f"{amount(sensed.first_travel, 'displacement')} in the first stretch; capacitance goes {along(same)} it{falls}"
    return _decision("displacement", factor, strength, words)


def _alone(table: LabTable, quantity: str, values: FloatArray, sensed: Shape | None, said: Mapping[str, float]) -> SignDecision:
    """Decide the sign of a column by its course in time, where nothing else in the file goes with it."""
    if quantity in said:
        return _stated(quantity, said[quantity], "")
    path = steady(values)
    away = excursion(path)
    largest = float(away[np.argmax(np.abs(away))])
    if sensed is not None and abs(sensed.slope) >= _TOGETHER:
        evidence = [*of_capacitance(sensed, quantity, 1.0), *of_start(quantity, sensed), *of_names(table, quantity, 1.0)]
    else:
        beyond = np.flatnonzero(np.abs(away) > max(0.1 * float(np.ptp(path)), NOTHING * reading_noise(values)))
        first = float(away[beyond[0]]) if beyond.size else largest
        waits = bool(beyond.size and beyond[0] > 0.05 * away.size)
        counts = start_counts(float(path[0]), float(path[0]) + first, waits=waits)
        evidence = [
            Evidence(float(np.sign(first)) * counts, f"{quantity} goes {up(first)} first"),
            Evidence(float(np.sign(largest)), f"its largest excursion from the start is {amount(largest, quantity)}"),
            *of_names(table, quantity, 1.0),
        ]
    total = sum(e.weight for e in evidence)
    if abs(total) < _DOUBTFUL:
        raise InputError(_doubtful(table, quantity, evidence, largest, None))
    strength: Strength = "clear" if abs(total) >= _CLEAR else "likely"
    factor = float(np.sign(total))
    return _decision(quantity, factor, strength, why(evidence, factor))


def _decision(quantity: str, factor: float, strength: Strength, words: str) -> SignDecision:
    sense, done = ("positive", "kept") if factor > 0 else ("negative", "turned")
    how = "" if strength == "stated" else f"{strength}: "
    return SignDecision(quantity, factor, strength, f"{quantity} {sense} in compression: sign {done} ({how}{words})")


def _stated(quantity: str, factor: float, against: str) -> SignDecision:
    return _decision(quantity, factor, "stated", f"as stated{against}")


def _ends_otherwise(displacement: FloatArray, force: FloatArray, slope: float) -> bool:
    """Whether the last three forces leave all others far behind, and go the other way with the displacement than these."""
    travel, change = np.diff(displacement[-3:]), np.diff(force[-3:])
    far = abs(force[-1] - force[-3]) > float(np.ptp(steady(force[:-1])))
    onwards = abs(float(np.sum(np.sign(travel)))) == abs(float(np.sum(np.sign(change)))) == 2.0
    return bool(far and onwards and np.sign(travel[-1] * change[-1]) == -np.sign(slope))


def _goes_as_a_drift(displacement: FloatArray, load: FloatArray, change: float) -> bool:
    """Whether a load that falls and then rises as the ball goes one way is steep where it does not go as on the whole.

    Of a drift and a press the press is the steeper one. On the whole force then goes with displacement as the drift does.

    Parameters
    ----------
    displacement, load : [m] and [N], positive in compression, (n_row,), in the order of reading.
    change : of the load on the whole [N], from which the sign of the displacement is taken.
    """
    load = calm(load)
    lowest = int(np.argmin(load))
    fall, rise = float(load[0] - load[lowest]), float(load[-1] - load[lowest])
    before, behind = abs(float(displacement[lowest] - displacement[0])), abs(float(displacement[-1] - displacement[lowest]))
    if change < 0:
        return rise > _OUTWEIGHED * fall and rise * before > fall * behind
    return fall > _OUTWEIGHED * rise and fall * behind > rise * before


def _goes_on_as_the_ball_turns(displacement: FloatArray, force: FloatArray, good: BoolArray) -> bool:
    """Whether the force goes one way from the first row to the last, and at the same pace across the turn of the ball.

    A drift that is larger than the press goes one way, too, but there the force changes its pace where the ball turns.
    """
    rows = good & np.isfinite(displacement) & np.isfinite(force)
    if np.count_nonzero(rows) < _FEWEST:
        return False
    place, load = calm(displacement[rows]), calm(force[rows])
    way, change = float(np.ptp(load)), float(load[-1] - load[0])
    if way <= NOTHING * reading_noise(force[rows]) or abs(change) < (1 - _BACK) * way:
        return False
    onwards = load * np.sign(change)
    if float(np.max(np.maximum.accumulate(onwards) - onwards)) > _BACK * way:
        return False
    turns = reversals(place, _TURNED * float(np.ptp(place)))
    there, back = (
        sum(float(onwards[b] - onwards[a]) for a, b in pairwise(turns) if up * (place[b] - place[a]) > 0) for up in (1, -1)
    )
    if min(there, back) < _ON * way:
        return False
    paces = [_paces(onwards, *three) for three in zip(turns, turns[1:], turns[2:], strict=False)]
    before, after = max(paces, key=lambda pace: abs(pace[0]) + abs(pace[1]), default=(0.0, 0.0))
    return abs(after - before) <= _SAME_PACE * (abs(after) + abs(before))


def _paces(load: FloatArray, begin: int, turn: int, end: int) -> tuple[float, float]:
    """Change of the load in a row, shortly before and shortly after the row in which the ball turns."""
    n = max(round(_NEAR_TURN * min(turn - begin, end - turn)), 2)
    before, after = max(turn - n, begin), min(turn + n, end)
    return float(load[turn] - load[before]) / max(turn - before, 1), float(load[after] - load[turn]) / max(after - turn, 1)


def _leaves_and_comes_back(found: Mapping[str, FloatArray], shown: Mapping[str, bool], good: BoolArray) -> bool:
    """Whether the force changes while the displacement goes one way, and has not changed at its end: drift and press cancel."""
    if not all(shown.get(q) for q in SIGNED):
        return False
    rows = good & np.isfinite(found["force"]) & np.isfinite(found["displacement"])
    if np.count_nonzero(rows) < _FEWEST:
        return False
    place, force = calm(found["displacement"][rows]), calm(found["force"][rows])
    moves = np.diff(place)
    one_way = abs(float(place[-1] - place[0])) >= _ONE_WAY * float(np.sum(np.abs(moves)))
    return bool(one_way and np.count_nonzero(moves) >= moves.size / 2 and np.ptp(force) > 0)


def _go_together(force: FloatArray, displacement: FloatArray) -> bool:
    """Whether the force, positive in compression, goes up with the displacement on the whole, reading by reading."""
    steps, moves = np.diff(force), np.diff(displacement)
    total = float(np.sum(np.abs(steps[moves != 0])))
    return total == 0 or float(np.sum(np.sign(moves) * steps)) >= _TOGETHER * total


def _unrelated(table: LabTable, press: Shape | None, open_: Sequence[str], words: str = _LAST_ROWS) -> Fault:
    """Refuse to guess where force goes with the displacement as well as against it, as under a drift larger than the press.

    `press` is None where no stretch tells, but what `words` say.
    """
    options = " and ".join(f'--sign "{q}=compression positive" (or negative)' for q in open_)
    if press is not None:
        words = f"only {50 * (1 + abs(press.slope)):.0f} % of the changes of force go one way with the displacement"
    return Fault(
        f"it cannot be told which way compression is in {' and '.join(open_)}: {words}",
        table.path,
        int(table.lines[0]) if len(table.lines) else None,
        advice=f"Say {options}, or sign in an experiment file; a drift larger than the press does that",
        choice=Choice("sign", tuple(SIGNS), open_[0]),
    )


def _sorted(table: LabTable) -> Fault:
    """Refuse a record whose rows do not belong together."""
    return Fault(
        "force goes one way from the first row to the last, while the ball goes there and comes back: the rows of one column "
        "were sorted, or a drift is larger than the press",
        table.path,
        int(table.lines[0]) if len(table.lines) else None,
        advice=f"Export the file again, and sort no column alone{_left_out(table)}",
    )


def _doubtful(table: LabTable, quantity: str, evidence: Sequence[Evidence], change: float, travel: float | None) -> Fault:
    other = "" if travel is None else f" while displacement goes by {amount(travel, 'displacement')}"
    first = f"at first {quantity} goes by {amount(change, quantity)}{other}"
    alternatives = []
    for factor, sense in ((1.0, "positive"), (-1.0, "negative")):
        kind = "a press" if change * factor > 0 else _RETREAT
        why = words_for(evidence, factor)
        alternatives.append(f'--sign "{quantity}=compression {sense}" if this is {kind}' + (f" (for it: {why})" if why else ""))
    toml = f'in an experiment file sign = {{ {quantity} = "compression positive" }} beside the file'
    return Fault(
        f"it cannot be told which way compression is in {quantity}: {first}, and the record speaks for both, or for none",
        table.path,
        int(table.lines[0]) if len(table.lines) else None,
        advice=f"Say {alternatives[0]}, or {alternatives[1]}; {toml}",
        choice=Choice("sign", tuple(SIGNS), quantity),
    )

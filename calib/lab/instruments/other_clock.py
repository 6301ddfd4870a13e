"""From columns of which some end before the others to those that were read at the times of another clock, with the advice."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import compress

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.rivals import difference, readings
from calib.lab.instruments.rows import NO_LAST_CELL
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.side_clocks import parts
from calib.lab.instruments.units import is_unit_of, lab_factor, stands_for
from calib.lab.instruments.vocabulary import UNKNOWN
from models.sensor import FloatArray

# Columns of one clock end within such a share of the rows; a clock has so many readings at least, and moves in such a share.
_SHARE, _FEWEST, _MOVES = 0.9, 5, 0.8
# Two clocks of one record go on for about as long; of rows pasted side by side the faster one has gone on for far less.
_NEARLY, _PASTED = 0.5, 0.125
# So many rows without a cell at the end of a column are none that was lost.
_LOST = 3
# Times that differ by such a share of their span are those of one clock.
_EXACTLY = 1e-5
_WITHOUT_ROWS = ("time", "displacement", "force", "capacitance", "capacitance_series")
_PRESS = ("displacement", "force")
_READ = (*_PRESS, "capacitance", "capacitance_series")
_TIME_WORDS = ("time", "t", "zeit", "clock", "timer", "temps", "tiempo", "tempo", "tijd", "czas", "tid")


def of_another_clock(sheet: Sheet, places: Mapping[str, int]) -> list[Fault]:
    """Refuse columns that end before the others where a time, or a count, ends with them: each block has a clock of its own.

    Programs that log several rates write each rate as a block of columns, one beside the other, from the first row on: a row
    then holds readings of different times.

    Parameters
    ----------
    sheet : the record.
    places : quantity -> index of its column.
    """
    judged = {q: i for q, i in places.items() if q in _WITHOUT_ROWS}
    last = len(sheet.lines) - 1
    if last not in sheet.reasons and all(sheet.columns[i][last].strip() for i in judged.values()):
        return []  # all end together
    sheet = _without_distrusted(sheet)
    ends = {q: _end(sheet.columns[i]) for q, i in judged.items()}
    longest = max(ends.values(), default=0)
    whole = {q: n for q, n in ends.items() if _FEWEST <= n <= longest - _LOST and _length(sheet.columns[judged[q]]) == n}
    if "time" in whole and 1 < sum(n == whole["time"] for n in whole.values()) < len(judged):
        return [_two_tables(sheet, judged, {q: n for q, n in whole.items() if n == whole["time"]}, longest)]
    press = {q: n for q, n in whole.items() if _apart_from_time(sheet, places) and q in _PRESS}
    if press and len({ends[q] for q in judged if q in _PRESS}) == 1:
        return [_two_tables(sheet, judged, press, longest)]
    short = {q: n for q, n in whole.items() if n < _SHARE * longest or _is_counted(sheet, judged, q, n)}
    for quantity, n in short.items():
        own = [i for i in range(len(sheet.names)) if i != places[quantity] and _length(sheet.columns[i]) == n]
        clock = next((i for i in own if quantity != "time" and _counts(sheet, i, n)), None)
        if quantity == "time":
            clock = places["time"] if len(short) < len(judged) else None
        if clock is None:
            continue
        name, index = stands_for(quantity), places[quantity]
        without = Choice("columns", ("none",), name)
        beside = f', as does "{sheet.names[clock] or f"column {clock + 1}"}"' if clock != index else ""
        message = (
            f'"{sheet.names[index]}" ends after {n} of {longest} rows{beside}: it seems to have a clock of its own, so that '
            "its rows are not those of the other columns"
        )
        advice = f"Save the columns of each clock in a file of their own, or leave these out: {without}"
        line = int(sheet.lines[n]) if n < len(sheet.lines) else None
        return [Fault(message, sheet.text.path, line, index + 1, advice=advice, choice=without)]
    return []


def of_one_time(sheet: Sheet, places: Mapping[str, int]) -> list[str]:
    """What to say of a time that stands with the capacitance alone, an empty column apart from a press without one.

    Parameters
    ----------
    sheet : the record.
    places : quantity -> index of its column.
    """
    if not _apart_from_time(sheet, places):
        return []
    time, press = sheet.names[places["time"]], next(sheet.names[places[q]] for q in _PRESS if q in places)
    return [f'"{press}" stands apart from "{time}", by an empty column: its rows are taken as read at these times']


def second_clock(
    sheet: Sheet, places: Mapping[str, int], values: Mapping[str, FloatArray], unread: Mapping[int, str], reading: Reading
) -> list[Fault]:
    """Refuse press and capacitance of one time where a column under another name may be the time that one of them was read at.

    That is a column in a unit of time that goes up from row to row about as far as the time does, and is not the same. Where
    one of the two stands between the columns of the press and the capacitance, it may go up by far more or less.

    Parameters
    ----------
    sheet : the record.
    places : quantity -> index of its column.
    values : quantity -> readings in SI, (n_row,).
    unread : index -> why a column is not read.
    reading : what the user says of the file.
    """
    said = {stands_for(q) for q in reading.columns}
    merged = "capacitance" in values and bool({"force", "displacement"} & set(values))
    if not merged or "capacitance" in said or said >= {"force", "displacement"}:
        return []
    clocks = _may_be_clocks(sheet, places, unread)
    if "time" not in values:
        # None of several is known by its name: the first stands for the time.
        first = next(iter(clocks), -1)
        places, own = {**places, "time": first}, clocks.pop(first, np.zeros(0))
    else:
        own = values["time"]
    for index, other in clocks.items():
        spans = [float(np.ptp(v[np.isfinite(v)])) if np.isfinite(v).any() else 0.0 for v in (own, other)]
        of_two = _parts_instruments(places, index) or _of_two_instruments(sheet, places["time"], index)
        nearly = _PASTED if of_two else _NEARLY
        if not nearly * spans[0] < spans[1] < spans[0] / nearly or difference(own, other)[0] == "same":
            continue
        taken, name = (sheet.names[i] for i in (places["time"], index))
        advice = f"Save the records of two instruments as two files, or {_with_a_clock(sheet, places, index)}"
        message = f'"{name}" may be a time of its own beside "{taken}": which readings belong to which is not told'
        return [Fault(message, sheet.text.path, sheet.named_at, index + 1, advice=advice)]
    return []


def clocks_beside(sheet: Sheet, places: Mapping[str, int], unread: Mapping[int, str]) -> tuple[dict[int, str], list[str]]:
    """Tell of columns of names that are not known, in a unit of time, how they go beside the time that is read.

    Parameters
    ----------
    sheet : the record.
    places : quantity -> index of its column.
    unread : index -> why a column is not read.

    Returns
    -------
    Why each is not read, and the notes on those that go on otherwise, with the option that reads them.
    """
    if "time" not in places:
        return {}, []
    taken = sheet.names[places["time"]]
    reasons, notes = {}, []
    unit = sheet.unit_written(places["time"])
    factor = lab_factor(unit, "time") if is_unit_of(unit or "?", "time") else 1.0
    for index in range(len(sheet.names)):
        own = sheet.unit_written(index)
        unknown = unread.get(index, "").startswith(UNKNOWN) and index not in sheet.set_aside
        if not unknown or not is_unit_of(own or "?", "time"):
            continue
        columns = [sheet.columns[places["time"]], sheet.columns[index]]
        time, other = readings(columns, [factor, lab_factor(own, "time")], sheet.declared_decimal)
        steps = np.diff(other[np.isfinite(other)])
        falls = int(np.count_nonzero(steps < 0))
        if steps.size < _FEWEST or np.mean(steps > 0) < _MOVES or np.count_nonzero(np.isfinite(time)) < _FEWEST:
            continue
        how, off = difference(time, other)
        if falls:
            reasons[index] = f'begins anew, {falls} time(s), while "{taken}" goes on'
        elif how in ("same", "zero"):
            but = " but for their zero" if how == "zero" else ""
            within = f", within {100 * off:.2g} % of their span" if off > _EXACTLY else ""
            reasons[index] = f'the same times as "{taken}"{but}{within}'
        else:
            asked = Choice("columns", (sheet.name_for_asking(index),), "time")
            reasons[index] = f'another clock, "{taken}" is taken'
            why = "whose name is known" if "time" not in sheet.assigned.values() else "as asked"
            spans = [float(np.ptp(v[np.isfinite(v)])) for v in (time, other)]
            notes.append(
                f'"{sheet.names[index]}" is a clock, too, which goes on for {spans[1]:.4g} s where "{taken}" does for '
                f"{spans[0]:.4g} s: the time is that of the latter, {why}; to read the other, {asked}; "
                "what was read at the other times is to be left out"
            )
    return reasons, notes


def twin_axes(sheet: Sheet, places: Mapping[str, int], unread: Mapping[int, str], reading: Reading) -> list[Fault]:
    """Refuse readings over two columns of one name, `X,Load (N),X,Ext (mm)`, that are not understood, rise, and differ.

    What stands behind each was read over it, so that the readings of a row are not of one moment.

    Parameters
    ----------
    sheet : the record.
    places : quantity -> index of its column.
    unread : index -> why a column is not read.
    reading : what the user says of the file.
    """
    by_name: dict[str, list[int]] = {}
    for index, name in enumerate(sheet.names):
        is_time = index == places.get("time", -1)
        if name and index not in sheet.set_aside and (is_time or unread.get(index, "").startswith(UNKNOWN)):
            by_name.setdefault(name.strip().lower(), []).append(index)
    for first, second in (twins[:2] for twins in by_name.values() if len(twins) > 1):
        ahead = [q for q, i in places.items() if q in _READ and first < i < second]
        behind = [q for q, i in places.items() if q in _READ and i > second]
        if not ahead or not behind or {*behind} <= {*reading.columns}:
            continue
        one, other = readings([sheet.columns[first], sheet.columns[second]], [1.0, 1.0], sheet.declared_decimal)
        rise = all(np.mean(np.diff(v) > 0) >= _MOVES for v in (one, other))
        if not rise or difference(one, other)[0] == "same":
            continue
        name = sheet.names[first]
        message = f'"{name}" stands twice (columns {first + 1} and {second + 1}), and both rise and differ: '
        message += "which readings belong to one moment is not told"
        advice = "Bring all readings to one clock and save them with that alone"
        # A load alone is no press.
        if ahead != ["force"]:
            advice += f", or leave the second pair out: {' '.join(str(Choice('columns', ('none',), q)) for q in behind)}"
        return [Fault(message, sheet.text.path, sheet.named_at, second + 1, advice=advice)]
    return []


def _of_two_instruments(sheet: Sheet, one: int, other: int) -> bool:
    """Whether two names are a word for time with one word each that is another: "Time_MTS (s)", "Time_FDC (s)"."""
    parts = [
        [word for word in re.split(r"[\s_.-]+", re.split(r"[(\[/]", sheet.names[i])[0].lower()) if word] for i in (one, other)
    ]
    parts = [of[:-1] if len(of) > 2 and is_unit_of(of[-1], "time") else of for of in parts]
    if any(len(of) != 2 for of in parts):
        return False
    return any(parts[0][k] == parts[1][k] in _TIME_WORDS and parts[0][1 - k] != parts[1][1 - k] for k in (0, 1))


def _may_be_clocks(sheet: Sheet, places: Mapping[str, int], unread: Mapping[int, str]) -> dict[int, FloatArray]:
    """The columns that are not read and may be times by unit or name, as they go up from row to row: index -> seconds."""
    found = {}
    for index in range(len(sheet.names)):
        unit, why = sheet.unit_written(index), unread.get(index, "not understood")
        beside_taken = "time" in places and why == f'"{sheet.names[places["time"]]}" is taken'
        beside_taken &= not sheet.plain_heading(index).quantity or ("time" in places and _sides(places, index) != "")
        if index in places.values() or index in sheet.set_aside or not (why.startswith(UNKNOWN) or beside_taken):
            continue
        named = "time" in places and sheet.plain_heading(index).quantity == "time" and _parts_instruments(places, index)
        if not is_unit_of(unit, "time") if unit else not named:
            continue
        (seconds,) = readings([sheet.columns[index]], [lab_factor(unit, "time") if unit else 1.0], sheet.declared_decimal)
        steps = np.diff(seconds)
        if not np.any(steps < 0) and np.mean(steps > 0) >= _MOVES:
            found[index] = seconds
    return found


def _without_distrusted(sheet: Sheet) -> Sheet:
    """The sheet without the rows that cannot be trusted, but for those at its end in which some columns go on alone.

    A row whose cells stand one column too far has an empty cell at its end, too.
    """
    last = next((r for r in range(len(sheet.lines) - 1, -1, -1) if sheet.reasons.get(r) != NO_LAST_CELL), -1)
    if all(r > last for r in sheet.reasons):
        return sheet
    kept = np.ones(len(sheet.lines), dtype=bool)
    kept[[r for r in sheet.reasons if r <= last]] = False
    columns = tuple(list(compress(c, kept.tolist())) for c in sheet.columns)
    return replace(sheet, columns=columns, lines=sheet.lines[kept], reasons={})


def _with_a_clock(sheet: Sheet, places: Mapping[str, int], index: int) -> str:
    """How to say which of two clocks is meant, and to leave out what was not read at it."""
    first, second = sorted((places["time"], index))
    meter = str(Choice("columns", ("none",), "capacitance"))
    press = " ".join(str(Choice("columns", ("none",), q)) for q in _PRESS if q in places)
    times = [str(Choice("columns", (sheet.name_for_asking(i),), "time")) for i in (first, second)]
    if side := _sides(places, index):
        without = (meter, press) if side == "press" else (press, meter)
        which = " or ".join(f"{time} {left_out}" for time, left_out in zip(times, without, strict=True))
        return f"say which one is read, without what stands with the other: {which}"
    return f"say which time is meant, {' or '.join(times)}, and leave out what was not read at it: {meter}, or {press}"


def _sides(places: Mapping[str, int], index: int) -> str:
    """What stands between two clocks, "press" or "meter", where the other stands behind the second; "" for any other order."""
    first, second = sorted((places["time"], index))
    press = [places[q] for q in _PRESS if q in places]
    meters = [i for q, i in places.items() if stands_for(q) == "capacitance"]
    if not press or not meters or min(*press, *meters) < first:
        return ""
    return "press" if max(press) < second < min(meters) else "meter" if max(meters) < second < min(press) else ""


def _apart_from_time(sheet: Sheet, places: Mapping[str, int]) -> bool:
    """Whether an empty column parts the time, with a capacitance, from all that is read of the press."""
    own = next((part for part in parts(sheet, sheet.columns) if places.get("time") in part), range(0))
    with_time = {stands_for(q) for q, i in places.items() if i in own}
    return "capacitance" in with_time and not with_time & {*_PRESS} and bool({*_PRESS} & set(places))


def _two_tables(sheet: Sheet, judged: Mapping[str, int], short: Mapping[str, int], longest: int) -> Fault:
    """The fault of two tables side by side, of which one has ended, and one alone has a time."""
    others = [q for q in judged if q not in short]
    named = [" and ".join(f'"{sheet.names[judged[q]]}"' for q in of) for of in (short, others)]
    without = [" ".join(str(Choice("columns", ("none",), stands_for(q))) for q in of) for of in (short, others)]
    n = next(iter(short.values()))
    message = (
        f"{named[0]} end{'s' if len(short) == 1 else ''} after {n} of {longest} rows, and {named[1]} "
        f"go{'es' if len(others) == 1 else ''} on without: they seem to be two tables side by side, whose rows are not of "
        "one time"
    )
    advice = f"Save each in a file of its own, or leave one of them out: {without[0]}, or {without[1]}"
    first = next(iter(short))
    line = int(sheet.lines[n]) if n < len(sheet.lines) else None
    return Fault(message, sheet.text.path, line, judged[first] + 1, advice=advice)


def _is_counted(sheet: Sheet, judged: Mapping[str, int], quantity: str, n: int) -> bool:
    """Whether a column that is not read counts the rows of one that is, and ends with it."""
    own = [i for i in range(len(sheet.names)) if i not in judged.values() and _length(sheet.columns[i]) == n]
    return quantity != "time" and any(_counts(sheet, i, n) for i in own)


def _parts_instruments(places: Mapping[str, int], index: int) -> bool:
    """Whether the later one of the time and a column stands between press and capacitance, and the other before both."""
    second = max(places["time"], index)
    press = [i < second for q, i in places.items() if q in _PRESS]
    meter = [i < second for q, i in places.items() if stands_for(q) == "capacitance"]
    return {*press} | {not before for before in meter} in ({True}, {False})


def _end(cells: Sequence[str]) -> int:
    """Number of rows up to the last with a cell."""
    return next((k for k in range(len(cells), 0, -1) if cells[k - 1].strip()), 0)


def _length(cells: Sequence[str]) -> int:
    """Number of rows up to the last with a cell, if none before it is empty; 0 otherwise."""
    n = _end(cells)
    return n if all(c.strip() for c in cells[:n]) else 0


def _counts(sheet: Sheet, index: int, n: int) -> bool:
    """Whether a column goes up from row to row, as times and counts do."""
    (values,) = readings([sheet.columns[index][:n]], [1.0], sheet.declared_decimal)
    steps = np.diff(values)
    return bool(np.all(np.isfinite(values)) and np.all(steps >= 0) and np.mean(steps > 0) >= _MOVES)

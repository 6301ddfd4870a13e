"""From the columns of a long table to the faults of those whose values part it into several records."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.between import changes_the_rig
from calib.lab.instruments.clock_cells import is_date
from calib.lab.instruments.column_words import few_values
from calib.lab.instruments.contrary import unit_against
from calib.lab.instruments.labtable import IntArray, Reading
from calib.lab.instruments.lexicon import EVENTS, KEYS, KEYS_IN_TURN, OF_TESTERS, PHASES
from calib.lab.instruments.numbers import is_missing, is_numeric, numbers_in
from calib.lab.instruments.sheet import OF_UNITS, Sheet
from calib.lab.instruments.small_tables import in_small_table, is_label
from calib.lab.instruments.stated import quantity_of, speaks_of_scale, stated_factors
from calib.lab.instruments.together import is_spread
from calib.lab.instruments.units import is_unit_of, lab_factor, stands_for
from calib.lab.instruments.validity import compares
from calib.lab.instruments.where import asked_name, filled_down, listed_values
from models.sensor import FloatArray

# A key has no more values than this; a column with more is a measurement, a counter or a remark.
_MOST, _MOST_NAMED = 64, 4096
# A key stands in nearly all rows.
_MOSTLY = 0.8
# Values with decimals of a setting, and rows in which each must stand.
_MOST_SETTINGS, _ROWS_OF_SETTING = 8, 5
# A frequency that a meter reads back differs by less from row to row.
_ONE_FREQUENCY = 0.01
# Records one below the other are apart by so many times the usual step of time.
_PAUSE = 50.0
# A change of a key is a jump where it is so many times the usual step, and this share of the span.
_STEPS, _SHARE = 4.0, 0.03
# Readings between two of another value of a key that tell whether they lie on a curve of their own.
_FEWEST_TURNS = 10
# A list is run through again where so many rows are those of a period before; its readings are apart where so many are beside.
_AGAIN, _BESIDE = 0.9, 0.6
# A column that changes in such a share of the rows names none of the phases of a record.
_IN_TURN = 0.4
# Words of what happens that number records, too: "run 2".
_OF_RECORDS = frozenset(("run", "test"))
# A press begins and ends below the first share of the largest of all, and goes beyond the second; it has so many readings.
_BEGINS, _PRESSES, _FEWEST_OF_PRESS = 0.25, 0.4, 6
_JUMPING = ("displacement", "force", "capacitance", "capacitance_series")
_WHOLE = re.compile(r"[+-]?\d+(?:[.,]0*)?")


def several_records(sheet: Sheet, used: Mapping[str, int], values: Mapping[str, FloatArray]) -> list[Fault]:
    """List the columns by whose values the rows belong to several records: channels, specimens, frequencies of a list sweep.

    A column of such a name is one as soon as it has two values; any other that is not read is, where time or displacement
    begins anew with its values, time pauses before them, a reading jumps with them, each of them stands at a whole press, or a
    reading goes with them from row to row, as over a list of voltages.

    Parameters
    ----------
    sheet : the record.
    used : quantity -> index of its column.
    values : quantity -> its readings in SI, nan where there is none.
    """
    sheet = sheet.trusted()
    faults: list[Fault] = []
    meter = "capacitance" in values or "capacitance_series" in values
    if "frequency" in values and _has_several(values["frequency"]):
        index = used["frequency"]
        if meter or _codes(sheet.columns[index], _MOST) is not None:
            faults.append(_fault(sheet, index, f'column "{sheet.names[index]}" names several frequencies'))
    for index in range(len(sheet.names)):
        # A column of a quantity that is read is another measurement of it.
        another = sheet.plain_heading(index).quantity in used and not sheet.holds_words(index)
        if index in used.values() or index in sheet.set_aside or another:
            continue
        if is_spread(sheet.names[index]):
            continue
        named = _is_named_key(sheet, index) or _is_of_rig(sheet, index)
        in_turn = None if named else _list_codes(sheet.columns[index])
        if in_turn is not None and _names_in_turn(sheet, index) and not _counts_within(sheet.columns[index], values):
            faults.append(_fault(sheet, index, f'column "{sheet.names[index]}" names several in turn, row by row'))
            continue
        swept = in_turn
        by = [q for q in _JUMPING if q in values and swept is not None and _goes_with(swept, values[q])]
        if by:
            what = by[0].removesuffix("_series")
            faults.append(
                _fault(sheet, index, f'column "{sheet.names[index]}" changes from row to row, and the {what} with it')
            )
            continue
        cells = filled_down(sheet.columns[index])
        codes = _codes(cells, _MOST_NAMED if named else _MOST)
        if codes is None:
            continue
        counting = _counts_within(sheet.columns[index], values)
        phases = _is_of_phases(sheet, index) and np.mean(codes[1:] != codes[:-1]) < _IN_TURN
        named &= bool(sheet.columns[index][1])  # a name in first rows alone may be a remark on them
        parts = named or _parts(codes, values, phases=phases, counting=counting)
        if not parts and (phases or not _names_presses(sheet, index, codes, values)):
            continue
        why = "changes where a press begins anew"
        if parts:
            why = "names several" if named else "changes, and time or a reading jumps with it"
        faults.append(_fault(sheet, index, f'column "{sheet.names[index] or index + 1}" {why}'))
    return faults


def keys_in_turn(sheet: Sheet, used: Mapping[str, int]) -> list[str]:
    """The notes on columns that are not read and run through a list again and again, row by row, though no reading shows it.

    Parameters
    ----------
    sheet : the record, of which no column tells several apart.
    used : quantity -> index of its column.
    """
    sheet = sheet.trusted()
    notes = []
    for index, column in enumerate(sheet.columns):
        another = sheet.plain_heading(index).quantity and not sheet.holds_words(index)
        known = index in used.values() or index in sheet.set_aside or another
        if known or is_unit_of(sheet.unit_written(index) or "?", "time") or _list_codes(column) is None:
            continue
        cells = [c.strip() for c in column]
        choice = Choice("where", tuple(dict.fromkeys(c for c in cells if c)), asked_name(sheet, index))
        notes.append(
            f'column "{sheet.names[index] or index + 1}" runs through {listed_values(cells)} again and again, which no reading '
            f"shows: all rows are read as one record; if they are of several, {choice}"
        )
    return notes


# A column of remarks is empty in most rows, and says few things.
_SELDOM, _MOST_REMARKS = 0.2, 1000
# Words by which a remark holds from its row on.
_FROM_HERE = re.compile(
    r"(?<![^\W_])(?:now|from (?:here|now|this)|switched|changed|since|then|jetzt|ab (?:hier|jetzt)|umgeschaltet|"
    r"umgestellt|nun|désormais|"
    r"maintenant|à partir|ahora|desde|ora|da qui|od|teraz|теперь|с этого)(?![^\W_])|从此|開始|以降|부터",
    re.IGNORECASE,
)
# Rows that show whether a column is one of units.
_FEW_ROWS = 20


def remarks_on_scale(
    sheet: Sheet, used: Mapping[str, int], factors: Mapping[str, float], reading: Reading
) -> tuple[list[str], list[Fault]]:
    """List the remarks in columns that are not read by which the rows are in another unit or range, from there on or at all.

    A single one that names the unit of a quantity, and no beginning, is settled by the user who says that unit.

    Parameters
    ----------
    sheet : the record.
    used : quantity -> index of its column.
    factors : quantity -> factor to SI, of those with a unit.
    reading : what the user says of the file.

    Returns
    -------
    A note where labels of a small table beside the rows have such units, and the faults of other remarks.
    """

    def speaks(cell: str) -> bool:
        return speaks_of_scale(cell) or any(unit_against(cell, q, factor) for q, factor in factors.items())

    faults: list[Fault] = []
    labels: list[str] = []
    stating = {stated.line for of_column in sheet.scalings.values() for stated in of_column}
    for index, column in enumerate(sheet.columns):
        if index in used.values() or sheet.set_aside.get(index, "").startswith(OF_UNITS):
            continue
        n_empty = column.count("")
        if n_empty == len(column) or compares(column):
            continue
        seldom = n_empty >= (1 - _SELDOM) * len(column)
        there = (r for r, c in enumerate(column if seldom else column[:_FEW_ROWS]) if c.strip())
        rows = [r for r in there if not stating or sheet.lines[r] not in stating]
        if seldom:
            speaking = [r for r in rows[:_MOST_REMARKS] if speaks(column[r])]
            of_tables = [r for r in speaking if in_small_table(sheet, r, index, used.values())]
            labels += [f'"{column[r].strip()[:60]}" (line {sheet.lines[r]})' for r in of_tables]
            speaking = [r for r in speaking if r not in of_tables]
            row = speaking[0] if speaking else None
            changed = next(
                (r for r in rows[:_MOST_REMARKS] if r > 0 and r not in speaking and changes_the_rig(column[r])), None
            )
            faults += [_of_another_press(sheet, index, changed)] if changed is not None else []
            of = {q for q in factors if row is not None and unit_against(column[row], q, math.nan)}
            single = len({column[r] for r in speaking}) == 1 and row is not None and not _FROM_HERE.search(column[row])
            if single and of and of <= {stands_for(q) for q in reading.units} | set(reading.units):
                continue
        else:
            row = _first_other_unit(column) if rows and all(_is_unit(column[r]) for r in rows) else None
        if row is not None:
            name = sheet.names[index] or index + 1
            message = f'"{column[row].strip()[:60]}" in column "{name}" may say that rows are in another unit or range'
            advice = "If they are, write all rows in one unit, or save those of each unit in a file of their own; else empty it"
            if seldom and single and of:
                first = sorted(of)[0]
                which = f"--units {first}={unit_against(column[row], first, math.nan)}"
                advice = f"If all rows are, say so: {which}, or the unit that is right; {advice[0].lower()}{advice[1:]}"
            faults.append(Fault(message, sheet.text.path, int(sheet.lines[row]), index + 1, advice=advice))
    faults += _beside_the_names(sheet, used, factors, reading)
    more = f" and {len(labels) - 1} more" if len(labels) > 1 else ""
    notes = (
        [f"a small table beside the rows is left out, whose units are taken for its own: {labels[0]}{more}"] if labels else []
    )
    return notes, faults


def _of_another_press(sheet: Sheet, index: int, row: int) -> Fault:
    """The fault of a remark in a column by which another specimen or ball was put in among the rows."""
    message = f'"{sheet.columns[index][row].strip()[:60]}" in column "{sheet.names[index] or index + 1}" stands among the rows'
    advice = "If the rows from it on are of another press or specimen, save them in a file of their own; else empty the cell"
    return Fault(message, sheet.text.path, int(sheet.lines[row]), index + 1, advice=advice)


def _beside_the_names(sheet: Sheet, used: Mapping[str, int], factors: Mapping[str, float], reading: Reading) -> Iterator[Fault]:
    """The faults of words beside the names of the columns, with a number or a unit behind them and no cell below either.

    They are no names, but side cells that may speak of the readings, as those beside a row do.
    """
    alone = [
        bool(name) and i not in used.values() and not any(map(str.strip, sheet.columns[i]))
        for i, name in enumerate(sheet.names)
    ]
    for index in (i for i in range(len(alone) - 1) if alone[i] and alone[i + 1]):
        words, value = sheet.names[index], sheet.names[index + 1]
        if is_numeric(words) or not (is_numeric(value) or _is_unit(value)):
            continue
        named = quantity_of(words)
        of = [named] if named is not None and named in factors else [q for q in factors if is_unit_of(value, stands_for(q))]
        if is_numeric(value):
            speaks = not is_label(words, value) and (speaks_of_scale(words) or bool(stated_factors([f"{words}: {value}"])))
        else:
            speaks = any(not math.isclose(lab_factor(value, q), factors[q]) for q in of if is_unit_of(value, q))
        if not speaks or set(of) & set(reading.units):
            continue
        message = f'"{words[:60]}" and "{value[:20]}" beside the names may say that the readings are in another unit or range'
        how = "write all rows in the unit that is right, and empty these cells"
        if of:
            q, unit = of[0], sheet.unit_written(used[of[0]])
            other = f'"{q}={value} {unit}"' if is_numeric(value) else f"{q}={value}"
            which = f"--units {q}={unit} if the header is right, --units {other} if these are"
            how = f"say which unit the readings have: {which}; or {how}"
        yield Fault(message, sheet.text.path, sheet.header_line or None, index + 1, advice=how[0].upper() + how[1:])


def _is_unit(cell: str) -> bool:
    return not is_numeric(cell) and any(is_unit_of(cell.strip(), q) for q in ("force", "displacement", "capacitance"))


def _first_other_unit(column: Sequence[str]) -> int | None:
    """The first row of a column of units that has another than the row before."""
    there = [(r, c.strip()) for r, c in enumerate(column) if c.strip()]
    return next((r for (_, one), (r, other) in pairwise(there) if one != other), None)


def _fault(sheet: Sheet, index: int, what: str) -> Fault:
    cells = [c.strip() for c in sheet.columns[index]]
    found = tuple(dict.fromkeys(c for c in cells if c and not is_missing(c)))
    choice = Choice("where", found, asked_name(sheet, index))
    return Fault(
        f"the rows may belong to several records: {what}: {listed_values(cells)}",
        sheet.text.path,
        sheet.named_at,
        index + 1,
        advice=f"Say which rows to read: {choice}",
        choice=choice,
    )


def _has_several(frequencies: FloatArray) -> bool:
    there = frequencies[np.isfinite(frequencies)]
    return there.size > 1 and float(there.max() - there.min()) > _ONE_FREQUENCY * float(np.abs(there).max())


def _codes(cells: Sequence[str], most: int) -> IntArray | None:
    """The number of the value in each row, -1 where there is none; None for a column of one value, or of too many."""
    if len({c.strip() for c in cells[:2000]}) > most + 1:
        return None
    rows_of: Counter[str] = Counter()
    for raw, count in Counter(cells).items():
        rows_of[raw.strip()] += count
    values = sorted(v for v in rows_of if not is_missing(v))
    if not 2 <= len(values) <= min(most, len(cells) // 2):
        return None
    # What a key names is a record of its own, of several rows; a number with decimals that often stands there is a setting.
    fractions = any(is_numeric(v) and not _WHOLE.fullmatch(v) for v in values)
    values = [v for v in values if rows_of[v] >= (_ROWS_OF_SETTING if fractions else 2)]
    if fractions and len(values) > _MOST_SETTINGS:
        return None
    if len(values) < 2 or sum(rows_of[v] for v in values) < _MOSTLY * sum(n for v, n in rows_of.items() if not is_missing(v)):
        return None
    number = {v: i for i, v in enumerate(values)}
    return np.array([number.get(c.strip(), -1) for c in cells], dtype=np.int64)


def _list_codes(cells: Sequence[str]) -> IntArray | None:
    """The number of the value in each row of a column that runs through a list again and again, row by row; else None."""
    first = [c.strip() for c in cells[: 4 * _MOST]]
    if not 2 <= len(set(first)) <= _MOST or len(cells) < 2 * _FEWEST_TURNS:
        return None
    _, found = np.unique([c.strip() for c in cells], return_inverse=True)
    codes = np.asarray(found, dtype=np.int64)
    if int(codes.max()) >= _MOST or np.mean(codes[1:] != codes[:-1]) < _MOSTLY:
        return None
    periods = range(2, min(2 * _MOST, len(cells) // 2))
    return codes if any(np.mean(codes[p:] == codes[:-p]) > _AGAIN for p in periods) else None


def _goes_with(codes: IntArray, v: FloatArray) -> bool:
    """Whether readings of one value of a list lie beside those of another, and not only between them, as in a press."""
    base = np.flatnonzero((codes == codes[0]) & np.isfinite(v))
    if base.size < _FEWEST_TURNS:
        return False
    for code in range(int(codes.max()) + 1):
        rows = np.flatnonzero((codes == code) & np.isfinite(v))
        rows = rows[(rows > base[0]) & (rows < base[-1])]
        if code == codes[0] or rows.size < _FEWEST_TURNS:
            continue
        off = v[rows] - np.interp(rows, base, v[base])
        middle = float(np.median(off))
        after = np.searchsorted(base, rows)
        around = np.stack([v[base[after - 1]], v[base[after]]])
        beside = v[rows] > around.max(axis=0) if middle > 0 else v[rows] < around.min(axis=0)
        if abs(middle) > _STEPS * 1.4826 * float(np.median(np.abs(off - middle))) and np.mean(beside) > _BESIDE:
            return True
    return False


def _is_named_key(sheet: Sheet, index: int) -> bool:
    """Whether the name is one of keys, and the cells are whole numbers or words."""
    parts = [w for w in re.split(r"[\s_.()\[\]#:/-]+", sheet.names[index].lower()) if w]
    if not any(w in KEYS for w in parts) or sheet.unit_written(index):
        return False
    return all(not is_numeric(c) or _WHOLE.fullmatch(c) for c in {c.strip() for c in sheet.columns[index]} if c)


# What the ball and what it presses are called by, whose size is no reading: two of it are two presses.
_RIG = frozenset(
    [
        "ball",
        "indenter",
        "tip",
        "pad",
        "padding",
        "electrode",
        "sphere",
        "kugel",
        "stempel",
        "elektrode",
        "polster",
        "bille",
        "poinçon",
        "bola",
        "esfera",
        "sfera",
    ]
)
_SIZES = frozenset(["diameter", "radius", "size", "d", "r", "ø", "durchmesser", "diam", "thickness", "dicke", "mm", "um", "in"])


def _is_of_rig(sheet: Sheet, index: int) -> bool:
    """Whether a column is one of the ball, or of what it presses, by its name, and has two values or a few."""
    parts = {w for w in re.split(r"[\s_.()\[\]#:/-]+", sheet.names[index].lower()) if w}
    return bool(parts & _RIG) and parts <= _RIG | _SIZES and bool(few_values(sheet.columns[index]))


def _names_in_turn(sheet: Sheet, index: int) -> bool:
    """Whether a column that runs through a list row by row is one of channels or specimens by its name."""
    parts = {w for w in re.split(r"[\s_.()\[\]#:/-]+", sheet.names[index].lower()) if w}
    return bool(parts & KEYS_IN_TURN) and not sheet.unit_written(index)


def _is_of_phases(sheet: Sheet, index: int) -> bool:
    """Whether a column counts, names or dates the phases of one record, at whose ends a reading may jump."""
    parts = {w for w in re.split(r"[\s_.()\[\]#:/-]+", sheet.names[index].lower()) if w}
    cells = {c.strip().lower() for c in sheet.columns[index]} - {""}
    dated = all(is_date(c) for c in cells)
    return bool(parts & PHASES) or dated or all(any(w in OF_TESTERS for w in re.split(r"[\s_-]+", c)) for c in cells)


def _names_presses(sheet: Sheet, index: int, codes: IntArray, values: Mapping[str, FloatArray]) -> bool:
    """Whether a column of words or whole numbers holds one value over each press, and another over the next.

    One whose cells speak of phases or cycles counts those of one record.
    """
    cells = {c.strip() for c in sheet.columns[index]} - {""}
    numbers = [c for c in cells if is_numeric(c)]
    words = [set(re.split(r"[\W\d_]+", c.lower())) & (EVENTS - _OF_RECORDS) for c in cells]
    if sheet.unit_written(index) or not all(map(_WHOLE.fullmatch, numbers)) or all(words):
        return False
    v = next((values[q] for q in ("displacement", "force") if q in values), np.zeros(0))
    there = np.flatnonzero(np.isfinite(v) & (codes >= 0)) if v.size else np.zeros(0, dtype=np.int64)
    if not there.size:
        return False
    way = v[there] - v[there[0]]
    way = way if way.max() >= -way.min() else -way
    presses = np.split(way, np.flatnonzero(np.diff(codes[there])) + 1)
    low, high = _BEGINS * float(way.max()), _PRESSES * float(way.max())
    if len(presses) < 2 or high <= 0 or min(map(len, presses)) < _FEWEST_OF_PRESS:
        return False
    return all(p[-1] <= low < high <= p.max() for p in presses[:-1]) and all(p[0] <= low for p in presses)


def _lie_apart(codes: IntArray, v: FloatArray) -> bool:
    """Whether readings of two values of a key, row by row in turn, lie on two curves: one is always above those beside it."""
    turn = np.flatnonzero((codes[:-2] == codes[2:]) & (codes[:-2] != codes[1:-1]) & (codes[:-2] >= 0) & (codes[1:-1] >= 0)) + 1
    above = (v[turn] - (v[turn - 1] + v[turn + 1]) / 2) * np.sign(codes[turn] - codes[turn - 1])
    above = above[np.isfinite(above)]
    if above.size < _FEWEST_TURNS:
        return False
    middle = float(np.median(above))
    return abs(middle) > _STEPS * 1.4826 * float(np.median(np.abs(above - middle)))


def _counts_within(cells: Sequence[str], values: Mapping[str, FloatArray]) -> bool:
    """Whether a column counts the rows that share a time, as frames of a second, while the press goes on from row to row.

    Channels of a scan count so, too, but share the place with the time.
    """
    if "time" not in values or "displacement" not in values or not all(map(_WHOLE.fullmatch, {c.strip() for c in cells[:50]})):
        return False
    numbers, place = numbers_in(cells), np.abs(np.diff(values["displacement"]))
    passed, steps = np.diff(values["time"]), np.diff(numbers)
    within, over = (passed == 0) & np.isfinite(steps), passed > 0
    if np.count_nonzero(within) < _FEWEST_TURNS or np.count_nonzero(over) < 2 or not np.all(steps[within] == steps[within][0]):
        return False
    moves = [float(np.nanmedian(place[of])) for of in (within, over)]
    return bool(steps[within][0] > 0) and moves[0] > moves[1] / _STEPS > 0


def _parts(codes: IntArray, values: Mapping[str, FloatArray], *, phases: bool, counting: bool = False) -> bool:
    """Whether the rows are of several records by a key: at its changes time falls, stands or pauses, or a reading jumps."""
    change = np.flatnonzero((codes[1:] != codes[:-1]) & (codes[1:] >= 0) & (codes[:-1] >= 0))
    if change.size == 0:
        return False
    time = values.get("time")
    if time is not None:
        step = np.diff(time)
        at = step[change]
        at, step = at[np.isfinite(at)], step[np.isfinite(step)]
        stands = not counting and np.mean(at <= 0) >= 0.4 and np.mean(step <= 0) < 0.99 if at.size else False
        if at.size and (np.mean(at < 0) >= 0.5 or stands):
            return True
    if phases:
        return False
    if time is not None and at.size and float(np.median(at)) > _PAUSE * float(np.median(np.abs(step))):
        return True
    # Of records one below the other the place begins anew; a force may also fall where a press turns.
    in_turn = change.size > 2 * (int(codes.max()) + 1)
    jumping = _JUMPING if in_turn or "displacement" not in values else ("displacement",)
    order = np.argsort(codes, kind="stable")
    within = np.flatnonzero(codes[order][1:] == codes[order][:-1])
    for quantity in jumping:
        if quantity not in values:
            continue
        v = values[quantity]
        span = float(np.nanmax(v, initial=-np.inf) - np.nanmin(v, initial=np.inf))
        across = np.abs(v[change + 1] - v[change])
        inside = np.abs(v[order][within + 1] - v[order][within])
        across, inside = across[np.isfinite(across)], inside[np.isfinite(inside)]
        if not across.size or not inside.size or not np.isfinite(span) or span == 0.0:
            continue
        if _lie_apart(codes, v):
            return True
        jump = float(np.median(across))
        if jump > _SHARE * span and jump > _STEPS * float(np.quantile(inside, 0.9)):
            return True
    return False

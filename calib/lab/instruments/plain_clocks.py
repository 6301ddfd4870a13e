"""From a `Sheet` to the same with times in their usual form: "10.22.31", "102231", milliseconds not filled up with zeros."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime

import numpy as np

from calib.errors import Fault, InputError
from calib.lab.instruments.clock import WITHOUT, read_clock
from calib.lab.instruments.clock_form import form_by_point
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.last_parts import with_last_parts
from calib.lab.instruments.numbers import to_numbers
from calib.lab.instruments.rivals import holds_clock
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.times import counts_clock
from calib.lab.instruments.units import is_unit_of, lab_factor
from models.sensor import FloatArray

# Rows from which on times tell how they are written; the middle step of a press [s], and the share of steps that may fall.
_FEWEST, _PACE, _FALLS = 9, 60.0, 0.1
_DAY = 86_400.0
# "10.22.31", "20.11.2026 10.22.31,250", as they are written in Finnish, Danish and Italian.
_DOTTED = re.compile(
    r"(?P<date>\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}[T ,]+)?(?:kl\.? ?)?(?P<h>[01]?\d|2[0-3])\.(?P<m>[0-5]\d)\.(?P<s>[0-5]\d)"
    r"(?P<part>[.,]\d{1,9})?"
)
_COMPACT = re.compile(r"(?P<date>(?:19|20)\d{6})[ _-]?(?P<clock>\d{6})(?P<part>[.,]\d{1,9})?")
_BARE = re.compile(r"(?P<h>\d{0,2}?)(?P<m>\d{2})(?P<s>\d{2})(?P<part>[.,]\d{1,9})?")
_MILLISECONDS = (["ms"], ["msec"], ["msecs"], ["millis"], ["milliseconds"], ["millisekunden"], ["millisecondes"])
_BARE_FORMS = frozenset(["hhmmss", "hmmss", "hh mm ss"])
# Names of the parts of a time in columns of their own.
_PARTS = {
    word: part
    for part, listed in (
        ("h", "hour hours h hr hrs hh std stunde stunden heure heures hora horas ora ore"),
        ("m", "minute minutes min mins mm minuten minuto minutos minuti"),
        ("s", "second seconds sec secs s ss sekunde sekunden sek seconde secondes segundo segundos secondi"),
    )
    for word in listed.split()
}
# A number, or a time of day, and the digits behind its point.
_SPLIT = re.compile(r"(?P<whole>\d+|.*\d:\d{2}:\d{2})(?P<mark>[.,])(?P<part>\d{1,9})")
# Minutes and seconds with a point between them, and the largest step of such that shows that they are.
_MINUTES, _MINUTE, _LARGEST_STEP = re.compile(r"(?P<h>)(?P<m>\d{1,4})[.,](?P<s>[0-5]\d)"), 60.0, 20.0
# What may stand behind the point of a time in a unit of so many seconds.
_SIXTIETHS = {
    _MINUTE: ("minutes and seconds", re.compile(rf"{_MINUTES.pattern}(?P<part>\d{{1,3}})?")),
    60 * _MINUTE: ("hours, minutes and seconds", re.compile(r"(?P<h>\d{1,4})[.,](?P<m>[0-5]\d)(?P<s>[0-5]\d)(?P<part>)")),
}
# What a stopwatch shows from its first full minute on, and by how many usual steps of time that is behind the seconds before.
_OF_STOPWATCH, _NEXT = re.compile(r"(?P<m>\d{1,2}):(?P<s>[0-5]\d)(?P<part>[.,]\d{1,9})"), 2.5
# What it shows before.
_SECONDS = re.compile(r"\d+(?:[.,]\d+)?", re.ASCII)
# Digits of parts of a second as they are counted: milli-, micro- and nanoseconds; steps that are even, as a share of the usual.
_COUNTED, _EVEN = (3, 6, 9), 0.5


def with_plain_clocks(sheet: Sheet, reading: Reading) -> Sheet:
    """Write times of day without colons, and seconds whose milliseconds are not filled up with zeros, as they are usually.

    Hours, minutes and seconds in columns beside each other are put together. A column is rewritten if all of its cells are such
    times and go on as these do; each is noted.

    Parameters
    ----------
    sheet : the record.
    reading : what the user says of the file: a column whose unit of time is said is no clock without marks.

    Raises
    ------
    InputError
        If milliseconds seem to be written without zeros before them, but do not go on evenly so.
    """
    sheet = _of_parts(sheet, reading)
    # What the format of a file says to be a time or a number is as it should be; a last part behind a colon is text in any.
    typed = sheet.text.typed
    columns, notes = list(sheet.columns), list(sheet.notes)
    headings = sheet.headings
    with_clocks = {i for i, cells in enumerate(sheet.columns) if holds_clock(cells)}
    for index in range(min(len(sheet.names), len(columns))):
        heading = headings.get(index)
        is_time = heading is not None and heading.quantity == "time"
        if index in sheet.set_aside or not (is_time or heading is None):
            continue
        if heading is None and with_clocks - {index}:
            continue  # days beside times of day
        name = sheet.names[index] or f"column {index + 1}"
        dotted = None if typed else _rewritten(columns[index], _from_dots) or _rewritten(columns[index], _from_digits)
        if dotted is not None:
            first = next(c for c in columns[index] if c.strip()).strip()
            notes.append(f'"{name}": "{first}" is read as a time of day, {next(c for c in dotted if c)}')
            columns[index] = dotted
        colons = with_last_parts(sheet, index, reading.units.get("time", "")) if is_time or heading is None else None
        if colons is not None:
            columns[index], note = colons
            notes += [note]
        if not is_time or typed:
            continue
        unit = (heading.unit if heading is not None else "") or sheet.unit_below(index)
        bare = _bare(columns[index], told=unit.lower().strip() in _BARE_FORMS)
        if bare is not None and "time" not in reading.units and (not unit or unit.lower().strip() in _BARE_FORMS):
            first = next(c for c in columns[index] if c.strip()).strip()
            notes.append(
                f'"{name}": "{first}" is read as hours, minutes and seconds without marks, {next(c for c in bare if c)}'
            )
            columns[index] = bare
        by_point = form_by_point(reading.units.get("time", "") or unit)
        if by_point and not any(":" in cell for cell in columns[index]):
            columns[index], note = _with_colons(sheet, index, columns[index], by_point)
            notes.append(note)
            continue
        form = _SIXTIETHS.get(lab_factor(unit, "time")) if is_unit_of(unit or "?", "time") else None
        sixtieths = _sixtieths(columns[index], form[1]) if form is not None and "time" not in reading.units else None
        if form is not None and sixtieths is not None:
            at = next(k for k, c in enumerate(sixtieths) if c and c[:5] != sixtieths[0][:5])
            notes.append(
                f'"{name}": "{columns[index][at].strip()}" is read as {form[0]}, {sixtieths[at]}: what stands behind '
                "the point never passes 59, and goes on as seconds do where a minute is full"
            )
            columns[index] = sixtieths
        stopwatch = _of_stopwatch(columns[index]) if unit in ("", "s") and "time" not in reading.units else None
        if stopwatch is not None:
            at = next(k for k, c in enumerate(columns[index]) if ":" in c)
            notes.append(
                f'"{name}": "{columns[index][at].strip()}" is read as minutes and seconds, {stopwatch[at]}: the seconds above '
                "it reach a full minute there"
            )
            columns[index] = stopwatch
        filled = _filled_up(columns[index])
        if filled is None:
            continue
        cells = [c.strip() for c in columns[index]]
        short = next(k for k, (a, b) in enumerate(zip(cells, filled, strict=True)) if a != b and not re.search(r"[.,]0$", a))
        written = cells[short]
        if max(map(_n_decimal, cells)) not in _COUNTED or not _is_even(_seconds(filled)):
            message = f'column "{name}": "{written}" seems to be {filled[short]}, the zeros before its milliseconds left away'
            advice = f'Log the time in milliseconds, or with all three digits ("%d.%03d"), {WITHOUT}'
            raise InputError(Fault(message, sheet.text.path, int(sheet.lines[short]), index + 1, advice=advice))
        notes.append(
            f'"{name}": the parts of a second are written without zeros before them: "{written}" is read as {filled[short]}, '
            "as the times go on evenly so"
        )
        columns[index] = filled
    return replace(sheet, columns=tuple(columns), notes=tuple(notes))


def _part(name: str) -> str:
    """Which part of a time a column is called after: "h", "m", "s", or "" for none."""
    return _PARTS.get(re.sub(r"[\W_]+", " ", name.lower()).strip(), "")


def _of_parts(sheet: Sheet, reading: Reading) -> Sheet:
    """Put minutes and seconds, and hours before them, together where they stand in columns beside each other and go on as one.

    Where they do not, none of them is a time.
    """
    parts = "".join(_part(name) or " " for name in sheet.names)
    letters = [name.strip().lower() for name in sheet.names]
    if (first := parts.find("h s")) >= 0 and letters[first + 1] == "m":
        parts = parts.replace("h s", "hms")  # "m" is a minute there alone
    at = parts.find("ms")
    if at < 0 or parts.count("ms") > 1:
        return sheet
    seconds = at + 1
    own = list(range(at - (at > 0 and parts[at - 1] == "h"), seconds + 1))
    if len(own) == 2 and sheet.names[at].strip().lower() == "mm":
        return sheet  # millimetres
    # Milliseconds behind them are a part as well.
    behind = [seconds + 1] if [n.strip().lower() for n in sheet.names[seconds + 1 : seconds + 2]] in _MILLISECONDS else []
    others = {i for i, h in sheet.headings.items() if h.quantity == "time"} - {*own, *behind}
    given = {sheet.assigned.get(i) for i in own} - {None}
    if others or set(own) & set(sheet.set_aside) or (given and sheet.assigned.get(seconds) != "time"):
        return sheet
    names = [f'"{sheet.names[i]}"' for i in own]
    values = np.array([to_numbers([c.strip().replace(",", ".") for c in sheet.columns[i]], ".").values for i in own])
    there = np.all(np.isfinite(values), axis=0)
    within = values[:, there]
    whole = np.all(within[:-1] % 1 == 0) and np.all(within >= 0) and np.all(within[-1] < 60)
    if within.shape[1] < _FEWEST or not whole or (len(own) == 3 and np.any(within[:2] >= np.array([[24.0], [60.0]]))):
        return sheet
    total = 60.0 * values[-2] + values[-1] + (3600.0 * values[0] if len(own) == 3 else 0.0)
    parts_of = [to_numbers([c.strip() for c in sheet.columns[i]], ".").values for i in behind]
    if any(np.any(p[there] % 1 != 0) or np.any(p[there] < 0) or np.any(p[there] >= 1000) for p in parts_of):
        return sheet
    total = total + sum(p / 1000 for p in parts_of) if parts_of else total
    steps = np.diff(total[there])
    falls = steps < 0
    if np.any(falls & ((steps > -_DAY / 2) | (len(own) == 2))) or not np.any(steps > 0):
        aside = {i: f"does not go on with {names[-2]}" for i in own[-1:] if i not in sheet.headings}
        return replace(sheet, set_aside={**sheet.set_aside, **aside})
    exact = reading.units.get("time") == "s" and seconds in sheet.assigned
    cells = [_clock_of(t, exact=exact) if ok else "" for t, ok in zip(total.tolist(), there.tolist(), strict=True)]
    names += [f'"{sheet.names[i]}"' for i in behind]
    aside = dict.fromkeys([*own[:-1], *behind], f"a part of the time, put together with {names[len(own) - 1]}")
    note = f"{', '.join(names[:-1])} and {names[-1]} are the parts of one time: it is put together from them"
    columns = (*sheet.columns[:seconds], cells, *sheet.columns[seconds + 1 :])
    return replace(sheet, columns=columns, set_aside={**sheet.set_aside, **aside}, notes=(*sheet.notes, note))


def _clock_of(total: float, *, exact: bool) -> str:
    """A time as one of day, or in seconds if `exact`, with as many digits as a clock has."""
    if exact:
        return f"{total:.6f}"
    micros = round(total * 1e6)
    minutes, rest = divmod(micros, 60_000_000)
    decimals = f".{rest % 1_000_000:06d}" if rest % 1_000_000 else ""
    return f"{minutes // 60:02d}:{minutes % 60:02d}:{rest // 1_000_000:02d}{decimals}"


def _seconds(cells: Sequence[str]) -> FloatArray:
    there = next((c for c in cells if c), "")
    return read_clock(cells).seconds if ":" in there else to_numbers([c.replace(",", ".") for c in cells], ".").values


def _goes_on(seconds: FloatArray, *, n_least: int = _FEWEST) -> bool:
    """Whether times go on as those of a press do, but for a few."""
    there = seconds[np.isfinite(seconds)]
    steps = np.diff(there)
    if there.size < n_least or not np.any(steps > 0):
        return False
    falls = np.count_nonzero((steps < 0) & (steps > -_DAY / 2))
    return bool(np.median(np.abs(steps)) <= _PACE and falls <= _FALLS * steps.size)


def _rewritten(cells: Sequence[str], one: Callable[[str], str | None]) -> list[str] | None:
    """The cells in the usual form, if each is empty or a time of that other one, and they go on."""
    found: list[str] = []
    if not any(cells):
        return None
    for cell in cells:
        text = one(cell.strip()) if cell.strip() else ""
        if text is None:
            return None
        found.append(text)
    return found if any(found) and _goes_on(read_clock(found).seconds) else None


def _from_dots(cell: str) -> str | None:
    match = _DOTTED.fullmatch(cell)
    if match is None:
        return None
    return f"{(match['date'] or '').replace(',', ' ')}{match['h']}:{match['m']}:{match['s']}{match['part'] or ''}"


def _from_digits(cell: str) -> str | None:
    match = _COMPACT.fullmatch(cell)
    if match is None:
        return None
    try:
        time = datetime.strptime(match["date"] + match["clock"], "%Y%m%d%H%M%S")
    except ValueError:
        return None
    return f"{time:%Y-%m-%d %H:%M:%S}{match['part'] or ''}"


def _bare(cells: Sequence[str], *, told: bool) -> list[str] | None:
    """Hours, minutes and seconds without marks with colons; where nobody says that they are, if they jump as such do."""
    found: list[str] = []
    for cell in cells:
        match = _BARE.fullmatch(cell.strip()) if cell.strip() else None
        if cell.strip() and (match is None or match["m"] > "59" or match["s"] > "59" or int(match["h"] or 0) > 23):
            return None
        found.append("" if match is None else f"{int(match['h'] or 0):02d}:{match['m']}:{match['s']}{match['part'] or ''}")
    if not any(found) or not _goes_on(read_clock(found).seconds):
        return None
    numbers = to_numbers([c.strip().replace(",", ".") for c in cells], ".").values
    return found if told or counts_clock(numbers[np.isfinite(numbers)]) else None


def _filled_up(cells: Sequence[str]) -> list[str] | None:
    """The cells with zeros before the parts of their seconds, where these are counted and not filled up; None where not.

    Decimals that end in 0 are written to the last digit, and then all have as many: those of several lengths are counted. None
    begins with 0, and as a count they never fall.
    """
    there: list[str] = []
    parts: list[str] = []
    shortest: dict[int, int] = {}
    longest = 0
    for written in cells:
        cell = written.strip()
        if not cell:
            continue
        match = _SPLIT.fullmatch(cell)
        if match is None or (len(match["part"]) > 1 and match["part"][0] == "0"):
            return None
        part, n_whole = match["part"], len(match["whole"])
        there.append(cell)
        parts.append(part)
        if part != "0":
            shortest[n_whole] = min(shortest.get(n_whole, 9), len(part))
        longest = max(longest, len(part))
    if len(there) < _FEWEST:
        return None
    # Numbers of so many digits in all have fewer decimals where they are larger.
    several = any(len(part) > shortest.get(len(cell) - len(part) - 1, 9) for cell, part in zip(there, parts, strict=True))
    if not several or not any(len(part) > 1 and part[-1] == "0" for part in parts):
        return None
    n_digit = next(n for n in _COUNTED if longest <= n)
    filled = [f"{c.strip()[: -len(p)]}{p:0>{n_digit}}" for c, p in zip(there, parts, strict=True)]
    if np.any(np.diff(_seconds(filled)) < 0):
        return None
    rest = iter(filled)
    return [next(rest) if c.strip() else "" for c in cells]


def _sixtieths(cells: Sequence[str], form: re.Pattern[str]) -> list[str] | None:
    """Minutes with seconds behind their point, "0.59" before "1.00", as times of day; None if they are decimals of a minute.

    So are hours with minutes and seconds, "10.0059" before "10.0100".
    """
    found: list[str] = []
    for cell in cells:
        match = form.fullmatch(cell.strip())
        if match is None and cell.strip():
            return None
        hours, minutes = divmod(60 * int(match["h"] or 0) + int(match["m"]), 60) if match is not None else (0, 0)
        part = f".{match['part']}" if match is not None and match["part"] else ""
        found.append(f"{hours:02d}:{minutes:02d}:{match['s']}{part}" if match is not None else "")
    seconds = read_clock(found).seconds if any(found) else np.empty(0)
    seconds = seconds[np.isfinite(seconds)]
    if np.any(np.diff(seconds) < 0):
        return None
    seconds = np.unique(seconds)  # several rows within one second
    steps = np.diff(seconds)
    full = np.diff(seconds // _MINUTE) > 0
    if seconds.size < _FEWEST or not np.any(full) or not np.any(~full):
        return None
    usual = float(np.median(steps[~full]))
    off = np.abs(steps - usual)
    return found if usual <= _LARGEST_STEP and np.all(off[full] <= 1 + _EVEN * usual) else None


def _with_colons(sheet: Sheet, index: int, cells: Sequence[str], form: str) -> tuple[list[str], str]:
    """Times that are said to be minutes with seconds behind their point, or hours with minutes, as clocks, and the note on it.

    Raises
    ------
    InputError
        If one is none, as its second part is of another length or passes 59.
    """
    matches = [_MINUTES.fullmatch(cell.strip()) for cell in cells]
    first, second = ("minutes", "seconds") if form == "min.s" else ("hours", "minutes")
    odd = next((k for k, (c, m) in enumerate(zip(cells, matches, strict=True)) if c.strip() and m is None), None)
    name = sheet.names[index] or f"column {index + 1}"
    if odd is not None:
        message = (
            f'column "{name}": "{cells[odd].strip()[:40]}" is no time of {first} and two digits of {second} behind the point'
        )
        advice = (
            f"If they are decimals of {first}, --units time={form.split('.')[0]}; else write them with a colon and all digits, "
            f'as "1:05", and say --units time={form.replace(".", ":")}'
        )
        raise InputError(Fault(message, sheet.text.path, int(sheet.lines[odd]), index + 1, advice=advice))
    found = [f"{int(match['m'])}:{match['s']}" if match is not None else "" for match in matches]
    at = next((k for k, clock in enumerate(found) if clock.strip("0:")), 0)
    return found, f'"{name}": "{cells[at].strip()}" is read as {first} and {second}, {found[at]}, as its unit says'


def _of_stopwatch(cells: Sequence[str]) -> list[str] | None:
    """Times that begin as seconds and go on as minutes and seconds once a minute is full, as clocks; None if they are none."""
    first, last = (next((c.strip() for c in order if c.strip()), "") for order in (cells, reversed(cells)))
    if ":" not in last or not _SECONDS.fullmatch(first):
        return None
    written = [c.strip() for c in cells]
    there = [k for k, c in enumerate(written) if c]
    behind = next((n for n, k in enumerate(there) if ":" in written[k]), 0)
    matches = [_OF_STOPWATCH.fullmatch(written[k]) for k in there[behind:]]
    if behind < _FEWEST or None in matches or not all(_SECONDS.fullmatch(written[k]) for k in there[:behind]):
        return None
    seconds = [float(written[k].replace(",", ".")) for k in there[:behind]]
    seconds += [float(m["m"]) * _MINUTE + float(m["s"] + m["part"].replace(",", ".")) for m in matches if m is not None]
    steps = np.diff(seconds)
    full = seconds[behind - 1] < _MINUTE <= seconds[behind]
    if not full or not 0 < steps[behind - 1] <= _NEXT * float(np.median(steps)):
        return None
    found = [""] * len(written)
    for k, second in zip(there, seconds, strict=True):
        found[k] = _clock_of(second, exact=False)
    return found


def _n_decimal(cell: str) -> int:
    return len(re.split("[.,]", cell)[-1]) if cell else 0


def _is_even(seconds: FloatArray) -> bool:
    steps = np.diff(seconds[np.isfinite(seconds)])
    usual = float(np.median(steps))
    return usual > 0 and bool(np.all(np.abs(steps - usual) <= _EVEN * usual))

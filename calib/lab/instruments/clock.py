"""From the cells of a column of times of day to seconds: dates, midnights and offsets counted, what may be two refused."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from itertools import compress

import numpy as np

from calib.lab.instruments.numbers import odd_cells
from models.sensor import FloatArray

_DATE = r"\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}"
_CLOCK = re.compile(
    rf"^\s*(?P<date>{_DATE})?[ T]*"
    r"(?P<first>\d{1,3}):(?P<second>\d{2})(?::(?P<third>\d{2})|(?=[.,]\d))(?P<part>[.,]\d+)?\s*"
    r"(?P<half>[AaPp]\.?[Mm]\.?)?\s*(?P<zone>Z|UTC|GMT|[+-]\d{2}:?\d{2})?\s*$"
)
# The usual one, with a date or without, recognised and read at once.
_USUAL_CLOCK = rf"(?:{_DATE}[ T]+)?\d{{1,2}}:\d{{2}}:\d{{2}}(?:[.,]\d+)?"
_NOT_USUAL_CLOCK = re.compile(rf"\n(?!{_USUAL_CLOCK}$)", re.ASCII | re.MULTILINE)
_DATED = re.compile(rf"{_DATE}[ T]+", re.ASCII)
_ZONE = re.compile(r"\s*(?:Z|UTC|GMT|[+-]\d{2}:?\d{2})$", re.ASCII)
_TWO_FIELDS = re.compile(r"^\s*\d{1,3}:\d{2}\s*$", re.ASCII)
_DAY = 86400.0

#: How a time may be said to be written, in `Reading.units`: the seconds that each of its parts counts.
FORMS = {
    "h:min:s": (3600.0, 60.0, 1.0),
    "min:s": (60.0, 1.0, 0.0),
    "h:min": (3600.0, 60.0, 0.0),
    "min:s:cs": (60.0, 1.0, 0.01),
}
_SAY = "Say what the parts of the time are: --units time="


def is_clock(cell: str) -> bool:
    """Whether a cell is a time of day, with or without a date: "12:30:01.25", "2024-05-02 12:30:01", "30:01.2"."""
    return _CLOCK.match(cell) is not None or _TWO_FIELDS.match(cell) is not None


def not_clocks(cells: Sequence[str], most: int) -> list[int] | None:
    """Find the cells of a column that are no time of day as usually written, all at once, as `not_numbers` does for numbers.

    Parameters
    ----------
    cells : of a column.
    most : how many of them are worth a look.

    Returns
    -------
    Their rows from 0; None if there are more than `most`.
    """
    return odd_cells(_NOT_USUAL_CLOCK, cells, most)


def is_date(cell: str) -> bool:
    """Whether a cell is a date and nothing else: "2024-05-02", "2.5.2024"."""
    return re.fullmatch(rf"\s*{_DATE}\s*", cell) is not None


@dataclass(frozen=True, eq=False)
class ClockTimes:
    """Times of day read as seconds, nan where a cell is none.

    Attributes
    ----------
    seconds : since the first midnight, (n_row,).
    notes : choices that were made.
    conflict, row, advice : why the column cannot be read, at which row from 0, and what to do; "" if it can.
    """

    seconds: FloatArray
    notes: tuple[str, ...] = ()
    conflict: str = ""
    row: int = 0
    advice: str = ""


def read_clock(cells: Sequence[str], dates: Sequence[str] = (), form: str = "") -> ClockTimes:
    """Read times of day as seconds since the first midnight, refusing what may mean two things.

    Without dates a fall by more than half a day is a midnight; with dates the days between them are counted, pauses of days
    included. Offsets from UTC are taken off where they change. Times without hours (`mm:ss.f`) may pass the hour.

    Parameters
    ----------
    cells : of the column, (n_row,).
    dates : those of a column of dates beside it, (n_row,); () without one.
    form : how its parts are to be understood, as `form_of_clock` gives it; "" if nobody says.
    """
    parsed = _parse(cells)
    n = len(cells)
    parts, there = parsed.parts, np.isfinite(parsed.parts[:, 0])
    if not np.any(there):
        return ClockTimes(np.full(n, np.nan))
    if 2 * np.count_nonzero(there) < sum(bool(c.strip()) for c in cells):
        row = int(np.argmax(there))
        return ClockTimes(np.full(n, np.nan), conflict="a time of day stands among numbers", row=row, advice="Correct the cell")
    notes: list[str] = []
    meant, conflict, likely = (form, "", "") if form in FORMS else _form(parsed, dates, form)
    if conflict:
        return ClockTimes(np.full(n, np.nan), conflict=conflict, row=int(np.argmax(there)), advice=f"{_SAY}{likely}")
    weights = FORMS[meant]
    timed = meant == "h:min:s" and not parsed.long_hours
    if meant in ("h:min:s", "min:s:cs"):
        parts = np.where(np.isnan(parts[:, 2:]), np.nan, parts)  # a part is missing
    last = 24 if timed else np.inf
    bad = (parts[:, 0] >= last) | (parts[:, 1] >= 60) | ((parts[:, 2] >= 61) & (meant == "h:min:s"))
    parts = np.where(bad[:, np.newaxis], np.nan, parts)
    values = np.asarray(weights[0] * parts[:, 0] + weights[1] * parts[:, 1])
    if weights[2]:
        values = values + weights[2] * parts[:, 2]
    values = values + parsed.fraction
    there = np.isfinite(values)
    unfilled = _unfilled(cells, values)
    if unfilled:
        return ClockTimes(
            values, conflict="the decimals of the seconds are not filled up with zeros", row=unfilled, advice=_LOG
        )
    if not timed:
        if meant == "min:s":
            falls = np.diff(values[there], prepend=values[there][:1]) < -0.8 * 3600
            values[there] += 3600 * np.cumsum(falls)
            notes.append("times are read as minutes and seconds" + (", falling where an hour is full" if np.any(falls) else ""))
        elif meant != "h:min:s":
            notes.append(f"times are read as {meant}")
        return ClockTimes(values, tuple(notes))
    written = list(dates) if len(dates) else parsed.dates
    days, fault, note = _days(written, values)
    if fault:
        row = int(np.argmax(there))
        return ClockTimes(
            values, conflict=fault, row=row, advice="Write the dates as 2024-05-02, or export the time in seconds"
        )
    if note:
        notes.append(note)
    zones = parsed.zones
    without = there & np.isnan(zones)
    given = zones[there & ~np.isnan(zones)]
    changing = given.size > 0 and bool(np.ptp(given) > 0)
    if given.size and np.any(without):
        row = int(np.flatnonzero(without)[0])
        return ClockTimes(values, conflict="some times have an offset from UTC and some have none", row=row, advice=_UTC)
    if changing:
        values = values - zones + np.nanmin(zones)
        notes.append("the offset from UTC changes among the times; it is taken off")
    if days is not None:
        values = values + _DAY * days
    else:
        falls = np.diff(values[there], prepend=0.0) < -_DAY / 2
        values[there] += _DAY * np.cumsum(falls)
    conflict, row = _set_back(values, changing=changing)
    return ClockTimes(values, tuple(notes), conflict, row, _UTC if conflict else "")


_LOG = "Log the time in seconds"
_UTC = "Log the time in seconds or in UTC, or split the file there"


@dataclass(frozen=True, eq=False)
class _Parsed:
    """Cells taken apart: numbers before, between and behind the colons (n_row, 3), decimals, and what else stands there."""

    parts: FloatArray
    fraction: FloatArray
    zones: FloatArray
    dates: list[str]
    has_half: bool
    long_hours: bool


def _parse(cells: Sequence[str]) -> _Parsed:
    n = len(cells)
    parts, fraction, zones = np.full((n, 3), np.nan), np.zeros(n), np.full(n, np.nan)
    dates = [""] * n
    has_half = False
    cells, zone = _without_one_zone(cells)
    odd = not_clocks(cells, n) or []
    regular = np.ones(n, dtype=bool)
    regular[odd] = False
    if np.any(regular):
        usual = cells if not odd else list(compress(cells, regular))
        own, text = _without_dates(usual)
        numbers = np.array(text.replace(",", ".").replace(":", "\n").split("\n"), dtype=np.float64).reshape(-1, 3)
        parts[regular] = numbers
        if own and odd:
            for i, day in zip(np.flatnonzero(regular).tolist(), own, strict=True):
                dates[i] = day
        elif own:
            dates = own
    if zone is not None:
        zones[:] = zone
    for i in odd:
        match = _CLOCK.match(cells[i])
        two = _TWO_FIELDS.match(cells[i])
        if match is None and two is None:
            continue
        if match is None:
            first, second = cells[i].split(":")
            parts[i, :2] = int(first), int(second)
            continue
        hour = int(match["first"])
        if match["half"]:
            has_half = True
            if not 1 <= hour <= 12:
                continue
            hour = hour % 12 + (12 if match["half"][0] in "pP" else 0)
        parts[i, :2] = hour, int(match["second"])
        if match["third"] is not None:
            parts[i, 2] = float(match["third"] + (match["part"] or "").replace(",", "."))
        elif match["part"]:
            fraction[i] = float("0" + match["part"].replace(",", "."))
        if match["zone"]:
            zones[i] = _offset(match["zone"])
        dates[i] = match["date"] or ""
    dated = any(dates)
    hours = parts[np.isfinite(parts[:, 0]), 0]
    long_hours = not dated and not has_half and bool(np.any(hours > 23)) and bool(np.all(np.diff(hours) >= 0))
    return _Parsed(parts, fraction, zones, dates if dated else [], has_half, long_hours)


def _without_one_zone(cells: Sequence[str]) -> tuple[Sequence[str], float | None]:
    """The cells without the offset from UTC that all of them have, and that offset [s]."""
    first = next((c for c in cells if c.strip()), "")
    match = _ZONE.search(first)
    if match is None or ":" not in first[: match.start()]:
        return cells, None
    end = match[0]
    if not all(c.endswith(end) for c in cells):
        return cells, None
    return [c[: -len(end)] for c in cells], _offset(end.strip())


def _offset(zone: str) -> float:
    if not zone[1:2].isdigit():
        return 0.0
    digits = zone[1:].replace(":", "")
    return (-1.0 if zone[0] == "-" else 1.0) * (3600.0 * int(digits[:2]) + 60.0 * int(digits[2:]))


def _without_dates(cells: Sequence[str]) -> tuple[list[str], str]:
    """The dates of usual times, [] if none has one, and the times without them, one in a line."""
    text = "\n" + "\n".join(cells)
    match = _DATED.match(cells[0])
    if match and text.count("\n" + match[0]) == len(cells):  # one day, and quickly told
        return [match[0].strip(" T")] * len(cells), text.replace("\n" + match[0], "\n")[1:]
    if not match and not any(mark in text for mark in "-/ T") and not _DATED.search(text):
        return [], text[1:]
    found = [_DATED.match(cell) for cell in cells]
    if not any(found):
        return [], text[1:]
    ends = [m.end() if m else 0 for m in found]
    return [c[:e].strip(" T") for c, e in zip(cells, ends, strict=True)], "\n".join(
        c[e:] for c, e in zip(cells, ends, strict=True)
    )


def _form(parsed: _Parsed, dates: Sequence[str], said: str) -> tuple[str, str, str]:
    """The form of times that the cells prove, one of `FORMS`; else "", why they do not, and the likeliest.

    What is `said` of it is "" or a form that names no length for its last part.
    """
    parts = parsed.parts
    there = np.isfinite(parts[:, 0])
    first, second, third = (parts[there, k] for k in range(3))
    missing = np.isnan(third)
    if np.mean(missing) > 0.5:
        if np.any(parsed.fraction > 0):
            return "min:s", "", ""
        repeated = 2 * np.count_nonzero(np.diff(60 * first + second) == 0) > first.size
        likely = "h:min" if repeated else "min:s"
        return "", "times of two parts may be hours and minutes or minutes and seconds", likely
    if said:
        return "", "the last part of the times may be frames or hundredths of a second", "min:s:cs for hundredths"
    above = (third >= 60) & ~missing
    if np.count_nonzero(above) > max(2, 0.02 * third.size):
        return "", "the last part of the times passes 60: it is no second", "min:s:cs for hundredths"
    whole = not np.any(third[~missing] % 1)
    if not whole or parsed.dates or len(dates) or parsed.has_half or np.any(np.isfinite(parsed.zones)) or third.size < 4:
        return "h:min:s", "", ""
    # Seconds go on where a minute is full; hundredths and frames jump there.
    minute = 60 * first + second
    carried = np.diff(minute) == 1
    stays = np.diff(minute) == 0
    steps = np.diff(third)
    if np.mean(steps[stays] == 0) > 0.3 if np.any(stays) else False:
        return "h:min:s", "", ""  # many readings within a second
    if np.any(carried) and np.any(stays):
        usual = float(np.percentile(steps[stays], 90))
        step = float(np.median(steps[carried] + 60))
        if usual / 3 <= step <= 3 * max(usual, 1.0):
            return "h:min:s", "", ""
        why = "the last part of the times does not go on as seconds do where a minute is full"
        return "", why, "min:s:cs for hundredths"
    if first[0] > 0:
        return "h:min:s", "", ""
    why = "the parts of the times may be hours, minutes and seconds, or minutes, seconds and hundredths: no minute is full"
    return "", why, "h:min:s"


def _unfilled(cells: Sequence[str], values: FloatArray) -> int:
    """A row where time falls within a second as decimals do that are not filled up (1.50, then 1.100); 0 if there is none."""
    falls = np.flatnonzero((np.diff(values) < 0) & (np.diff(values) > -1))
    if falls.size < 2 or falls.size > 0.5 * len(cells):
        return 0
    lengths = {len(re.split("[.,]", cells[i + k])[-1]) for i in falls[:20].tolist() for k in (0, 1)}
    return int(falls[0]) + 1 if len(lengths) > 1 else 0


def _days(dates: Sequence[str], values: FloatArray) -> tuple[FloatArray | None, str, str]:
    """Days since the first date (n_row,), None without dates or within one; why they cannot be told; a note on the choice."""
    if len(set(dates)) - ("" in dates) < 2:
        return None, "", ""
    there = np.isfinite(values)
    if any(not d.strip() for d in compress(dates, there)):
        return None, "some times have a date and some have none", ""
    index: dict[str, int] = {}
    codes = np.array([index.setdefault(d.strip(), len(index)) for d in dates])
    readings = {order: days for order in ("ymd", "dmy", "mdy") if (days := _ordinals(list(index), order)) is not None}
    if not readings:
        return None, f'"{next(iter(index))}" is no date', ""
    counted = {}
    for order, ordinals in readings.items():
        days = ordinals[codes].astype(np.float64)
        days -= days[there][0]
        counted[order] = days
    distinct = {days[there].tobytes(): order for order, days in reversed(counted.items())}
    if len(distinct) == 1:
        return next(iter(counted.values())), "", ""
    largest = {o: float(np.max(np.abs(np.diff((_DAY * counted[o] + values)[there])))) for o in distinct.values()}
    going_on = [o for o, step in largest.items() if step < _DAY]
    if len(going_on) != 1:
        return None, "day and month of the dates cannot be told apart", ""
    words = {"ymd": "year, month, day", "dmy": "day, month, year", "mdy": "month, day, year"}
    return counted[going_on[0]], "", f"dates are read as {words[going_on[0]]}: otherwise time would jump by months"


def _ordinals(dates: Sequence[str], order: str) -> np.ndarray[tuple[int], np.dtype[np.int64]] | None:
    found = []
    for text in dates:
        fields = re.split(r"[-/.]", text)
        year = order.index("y")
        if len(fields) != 3 or any(len(f) > 2 for i, f in enumerate(fields) if i != year) or len(fields[year]) not in (2, 4):
            return None
        if "." in text and order == "mdy":
            return None
        y, m, d = (int(fields[order.index(k)]) for k in "ymd")
        try:
            found.append(date(y + 2000 if y < 100 else y, m, d).toordinal())
        except ValueError:
            return None
    return np.array(found, dtype=np.int64)


def _set_back(values: FloatArray, *, changing: bool) -> tuple[str, int]:
    """Why a clock was set among the rows, and at which row: by an hour (daylight saving), or by half a day (no am and pm)."""
    rows = np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[rows])
    if changing or steps.size < 3:
        return "", 0
    usual = max(float(np.median(np.abs(steps))), 1.0)
    for size, why in (
        (3600.0, "the clock is set back by an hour"),
        (43200.0, "the clock falls by half a day, without am and pm"),
    ):
        back = np.flatnonzero((steps < 0) & (np.abs(steps + size) <= 3 * usual) & (np.abs(steps) > 10 * usual))
        if back.size:
            return why, int(rows[back[0] + 1])
    ahead = np.flatnonzero((np.abs(steps - 3600.0) <= 3 * usual) & (steps > 100 * usual))
    for k in ahead.tolist():
        before, after = values[rows[k]] % _DAY, values[rows[k + 1]] % _DAY
        if 3600 - before % 3600 <= 3 * usual and after % 3600 <= 3 * usual and before < 4 * 3600:
            return "the clock seems to be set ahead by an hour", int(rows[k + 1])
    return "", 0


# Letters of a written form -> what it means; any other is not known.
_LETTERS = {("h", "m", "s"): "h:min:s", ("m", "s"): "min:s", ("h", "m"): "h:min"}


def form_of_clock(unit: str) -> str:
    """The form of times that a unit says ("hh:mm:ss", "min:s"): one of `FORMS`, "other" of minutes and seconds, "" for none.

    >>> form_of_clock("HH:MM:SS.fff"), form_of_clock("mm:ss"), form_of_clock("s")
    ('h:min:s', 'min:s', '')
    """
    tidy = unit.strip().lower()
    if tidy in FORMS:
        return tidy
    letters = tuple(part.strip()[:1] for part in tidy.split(":"))
    return _LETTERS.get(letters, "other" if letters[:2] == ("m", "s") else "")

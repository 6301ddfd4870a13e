"""From a record to the date and time at which it began, as its file states it."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta

import numpy as np

from calib.lab.instruments.sheet import Sheet
from models.sensor import FloatArray

_DATE = re.compile(
    r"(?P<a>\d{1,4})(?P<mark>[-/.])(?P<b>\d{1,2})(?P=mark)(?P<c>\d{1,4})(?:[ T]+(?P<h>\d{1,2}):(?P<m>\d{2})(?::(?P<s>\d{2}))?"
    r"\s*(?P<half>[AaPp][Mm])?)?"
)
# Lines with the date of something else, and those that speak of the test's.
_OTHER_DATE = re.compile(r"calib|kalib|étalon|due|fällig|version|export|print|gedruckt|created|modified|install|firmware", re.I)
_BEGAN = re.compile(r"start|begin|began|test.?(?:date|time)|prüf(?:datum|zeit)|début|inicio|开始", re.I)
_EPOCH = (1e9, 3.4e9)  # [s] since 1970, in the years 2001 to 2077: no time since the start of a test
# [s] of days that spreadsheets count from the end of 1899, in the years 2009 to 2064.
# The day that the name of a time counts from: "Timestamp (s since 01.01.1904)".
_SINCE = re.compile(r"\bsince\s+([^()\[\]]*\d)", re.IGNORECASE)
_DAYS, _DAY_ZERO = (3.456e9, 5.184e9), datetime(1899, 12, 30)


def started_at(sheet: Sheet, time: FloatArray | None) -> datetime | None:
    """When a record began, if its file says so: the date in the first row, else one above the header, the test's before others.

    Parameters
    ----------
    sheet : the record.
    time : its time column [s], None if it has none; seconds since 1970 are a date too, then UTC, and so
        are days of a spreadsheet.
    """
    first = sheet.text.lines[int(sheet.lines[0]) - 1] if len(sheet.lines) else ""
    above = [line for line in sheet.prelude_of(())[-200:] if not _OTHER_DATE.search(line)]
    for line in (first, *sorted(above, key=lambda line: not _BEGAN.search(line))):
        match = _DATE.search(line)
        found = _date(match) if match else None
        if found is not None:
            return found
    since = next((m for name in sheet.names if (m := _SINCE.search(name))), None)
    if time is not None and time.size and np.isfinite(time[0]) and since is not None:
        zero = _date(match) if (match := _DATE.search(since[1])) is not None else None
        return zero + timedelta(seconds=round(float(time[0]))) if zero is not None else None
    if time is not None and time.size and _EPOCH[0] < time[0] < _EPOCH[1]:
        return datetime.fromtimestamp(round(float(time[0])), UTC).replace(tzinfo=None)
    if time is not None and time.size and _DAYS[0] < time[0] < _DAYS[1]:
        return _DAY_ZERO + timedelta(seconds=round(float(time[0])))
    return None


def hour_of_day(hour: int, half: str) -> int:
    """The hour of a day from that of its half.

    Parameters
    ----------
    hour : as written.
    half : "am" or "pm" in any form, "" for none.

    >>> hour_of_day(12, "AM"), hour_of_day(2, "p.m."), hour_of_day(14, "")
    (0, 14, 14)
    """
    return hour % 12 + (12 if half[0] in "pP" else 0) if half else hour


def date_in(text: str) -> datetime | None:
    """The first date of a text; None without one, or where day and month cannot be told apart."""
    match = _DATE.search(text)
    return _date(match) if match is not None else None


def _date(match: re.Match[str]) -> datetime | None:
    a, b, c = int(match["a"]), int(match["b"]), int(match["c"])
    if len(match["a"]) == 4:
        year, month, day = a, b, c
    elif len(match["c"]) == 4 and (match["mark"] == "." or a > 12):
        year, month, day = c, b, a
    elif len(match["c"]) == 4 and (b > 12 or a == b):
        year, month, day = c, a, b
    else:
        return None  # day and month cannot be told apart
    hour = hour_of_day(int(match["h"] or 0), match["half"] or "")
    try:
        return datetime(year, month, day, hour, int(match["m"] or 0), int(match["s"] or 0))
    except ValueError:
        return None

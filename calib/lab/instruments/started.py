"""From a record to the date and time at which it began, as its file states it."""

from __future__ import annotations

import re
from datetime import UTC, datetime

from calib.lab.instruments.sheet import Sheet
from models.sensor import FloatArray

_DATE = re.compile(
    r"(?P<a>\d{1,4})(?P<mark>[-/.])(?P<b>\d{1,2})(?P=mark)(?P<c>\d{1,4})(?:[ T]+(?P<h>\d{1,2}):(?P<m>\d{2})(?::(?P<s>\d{2}))?"
    r"\s*(?P<half>[AaPp][Mm])?)?"
)
_EPOCH = (1e9, 4.2e9)  # [s] since 1970, in the years 2001 to 2100: no time since the start of a test


def started_at(sheet: Sheet, time: FloatArray | None) -> datetime | None:
    """When a record began, if its file says so: the date in the first row, else the first one above the header.

    Parameters
    ----------
    sheet : the record.
    time : its time column [s], None if it has none; seconds since 1970 are a date too, then UTC.
    """
    first = sheet.text.lines[int(sheet.lines[0]) - 1] if len(sheet.lines) else ""
    for line in (first, *sheet.prelude[-200:]):
        match = _DATE.search(line)
        found = _date(match) if match else None
        if found is not None:
            return found
    if time is not None and time.size and _EPOCH[0] < time[0] < _EPOCH[1]:
        return datetime.fromtimestamp(round(float(time[0])), UTC).replace(tzinfo=None)
    return None


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
    hour = int(match["h"] or 0)
    if match["half"]:
        hour = hour % 12 + (12 if match["half"][0] in "pP" else 0)
    try:
        return datetime(year, month, day, hour, int(match["m"] or 0), int(match["s"] or 0))
    except ValueError:
        return None

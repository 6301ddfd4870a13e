"""From times of day taken apart to what their parts count: hours, minutes and seconds, or other forms, proven or said."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.lab.instruments.clock_cells import ClockParts
from calib.lab.instruments.clock_ends import beyond_sixty

#: How a time may be said to be written, in `Reading.units`: the seconds that each of its parts counts.
FORMS = {
    "h:min:s": (3600.0, 60.0, 1.0),
    "min:s": (60.0, 1.0, 0.0),
    "h:min": (3600.0, 60.0, 0.0),
    "min:s:cs": (60.0, 1.0, 0.01),
    "d:h:min:s": (3600.0, 60.0, 1.0),
}
#: How times that end in frames may be said to be written, with how many of these are a second, "h:min:s:frame/25".
FRAMES = re.compile(r"(?:h:)?min:s:frames?(?:/(?P<rate>\d{1,4}(?:\.\d{1,6})?))?", re.ASCII)
# How minutes with seconds, or hours with minutes, behind a point are said to be written: "min.s", "mm.ss", "h.min".
_BY_POINT = {
    "min.s": re.compile(r"(?:m|mm|mins?|minutes?|minuten?)\s?[.:,]\s?(?:s|ss|secs?|seconds?|sek|sekunden?)"),
    "h.min": re.compile(r"(?:h|hh|hours?|std|stunden?)\s?[.:,]\s?(?:m|mm|mins?|minutes?|minuten?)"),
}


@dataclass(frozen=True)
class ClockForm:
    """What the parts of times count: one of `FORMS`, and what is against it; or "" with why it is open, and the likeliest."""

    form: str
    conflict: str = ""
    likely: str = ""
    against: str = ""


_HOURS = ClockForm("h:min:s")
_NO_SECONDS = "the last part of the times does not go on as seconds do where a minute is full"
_HUNDREDTHS = "min:s:cs if it is hundredths, --units time=min:s:frame/25 if it is frames, 25 of which are a second"
_PARTS_OF_SECOND = "h:min:s:cs if it is hundredths, --units time=h:min:s:frame/25 if it is frames, 25 of which are a second"


def clock_form(parsed: ClockParts, dates: Sequence[str], said: str) -> ClockForm:
    """Tell what the parts of times count, by what is said of it, else by what the cells prove.

    Hours, minutes and seconds are proven by words between them, a date, am or pm, an offset from UTC, decimals, and by going on
    where a minute is full. Times that begin within the first hour and fill no minute may be anything.

    Parameters
    ----------
    parsed : the cells.
    dates : those of a column beside it, () without one.
    said : as `form_of_clock` gives it; "" if nobody says.
    """
    if parsed.spelled and not said:
        return _HOURS
    if parsed.days:
        return _four_parts(parsed, said)
    if said in FORMS:
        return ClockForm(said)
    parts = parsed.parts
    there = np.isfinite(parts[:, 0])
    first, second, third = (parts[there, k] for k in range(3))
    missing = np.isnan(third)
    if np.mean(missing) > 0.5:
        if np.any(parsed.fraction > 0):
            return ClockForm("min:s")
        repeated = 2 * np.count_nonzero(np.diff(60 * first + second) == 0) > first.size
        likely = "h:min" if repeated else "min:s"
        return ClockForm("", "times of two parts may be hours and minutes or minutes and seconds", likely)
    if said:
        return ClockForm("", "the last part of the times may be frames or hundredths of a second", _HUNDREDTHS)
    above = beyond_sixty(third)
    if np.count_nonzero(above) > max(2, 0.02 * third.size):
        return ClockForm("", "the last part of the times passes 60: it is no second", _HUNDREDTHS)
    whole = not np.any(third[~missing] % 1)
    if not whole or parsed.dates or len(dates) or parsed.has_half or np.any(np.isfinite(parsed.zones)) or third.size < 4:
        return _HOURS
    # Seconds go on where a minute is full; hundredths and frames jump there. A leap second is none of either.
    first, second, third = (part[~(third >= 60)] for part in (first, second, third))
    minute = 60 * first + second
    carried = np.diff(minute) == 1
    stays = np.diff(minute) == 0
    steps = np.diff(third)
    if np.mean(steps[stays] == 0) > 0.3 if np.any(stays) else False:
        return _HOURS  # many readings within a second
    if np.any(carried) and np.any(stays):
        usual = float(np.percentile(steps[stays], 90))
        step = float(np.median(steps[carried] + 60))
        if usual / 3 <= step <= 3 * max(usual, 1.0):
            return _HOURS
        return ClockForm("", _NO_SECONDS, _HUNDREDTHS)
    if first[0] > 0:
        return _HOURS
    why = "the parts of the times may be hours, minutes and seconds, or minutes, seconds and hundredths: no minute is full"
    return ClockForm("", why, "h:min:s")


def _four_parts(parsed: ClockParts, said: str) -> ClockForm:
    """The same of times of four parts, whose hours hold the days: proven by seconds that go on where a minute is full."""
    third = parsed.parts[np.isfinite(parsed.parts[:, 0]), 2]
    if np.any(third >= 60):
        return ClockForm("", "the last of four parts passes 60: it is no second", _PARTS_OF_SECOND)
    if said and said != "d:h:min:s":
        return ClockForm("", "the times have four parts", "d:h:min:s")
    if np.any(third % 1):
        return _HOURS
    found = clock_form(replace(parsed, days=False), (), "")
    if said:
        return replace(_HOURS, against=found.conflict if found.conflict == _NO_SECONDS else "")
    likely = f"d:h:min:s if they begin with days, --units time={_PARTS_OF_SECOND}"
    return found if found.form else ClockForm("", f"{found.conflict}; they have four", likely)


# Letters of a written form -> what it means; any other is not known.
_LETTERS = {("d", "h", "m", "s"): "d:h:min:s", ("h", "m", "s"): "h:min:s", ("m", "s"): "min:s", ("h", "m"): "h:min"}


def form_of_clock(unit: str) -> str:
    """The form of times that a unit says ("hh:mm:ss", "min:s"): one of `FORMS`, "other" of minutes and seconds, "" for none.

    >>> form_of_clock("HH:MM:SS.fff"), form_of_clock("mm:ss"), form_of_clock("s"), form_of_clock("mm:ss:cs")
    ('h:min:s', 'min:s', '', 'min:s:cs')
    """
    tidy = unit.strip().lower()
    if tidy in ("h:min:s:cs", "h:min:s:ms") or FRAMES.fullmatch(tidy):
        return "h:min:s"  # the last part is a decimal by then
    if form := form_by_point(tidy):
        return form.replace(".", ":")  # they have colons by then
    if tidy in FORMS:
        return tidy
    parts = [part.strip() for part in tidy.split(":")]
    letters = tuple(part[:1] for part in parts)
    if letters == ("m", "s", "c") and parts[-1] in ("c", "cc", "cs", "csec"):
        return "min:s:cs"
    return _LETTERS.get(letters, "other" if letters[:2] == ("m", "s") else "")


def form_by_point(unit: str) -> str:
    """What a unit says of times that are written as one number: "min.s", "h.min", or "" for nothing.

    >>> form_by_point("mm.ss"), form_by_point("min:s"), form_by_point("h.min"), form_by_point("min"), form_by_point("s")
    ('min.s', 'min.s', 'h.min', '', '')
    """
    tidy = unit.strip().lower()
    return next((form for form, pattern in _BY_POINT.items() if pattern.fullmatch(tidy)), "")

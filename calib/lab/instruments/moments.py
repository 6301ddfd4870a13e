"""From lines beside a table that name when a test began and when it ended to the seconds between the two."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from calib.lab.instruments.started import date_in, hour_of_day

_LONGEST, _DAY = 160, 86400.0
# "Start: 26.11.2026 14:05:07", "Prüfbeginn;14:05", "Test started at 2026-11-26T14:05:07.2 PM".
_BEGAN = (
    r"\w*start(?:ed|zeit|datum|ing)?|\w*(?:begin|began|beginn|begonnen|anfang)|débuté?|comienzo|inicio|inici[oó]|inizio|início|"
    r"początek|začátek|начало|开始|開始|시작"
)
_ENDED = (
    r"end(?:ed|e|zeit|datum|ing)?|\w{3,}ende|finish(?:ed)?|stop(?:ped|zeit)?|completed?|beendet|fin|fine|fim|final|koniec|konec|"
    r"конец|окончание|结束|結束|終了|종료"
)
_MOMENT = re.compile(
    rf"(?<![^\W_])(?:(?P<began>{_BEGAN})|(?P<ended>{_ENDED}))(?![^\W_])(?P<between>[^\d]{{0,40}})"
    r"(?P<date>(?:\d{1,4}[-/. ][\w]{1,9}[-/. ]\d{1,4}|[^\W\d]{3,9} \d{1,2},? \d{4})?)[\s,;T\"'|]*"
    r"(?<!\d)(?P<h>\d{1,2}):(?P<m>\d{2})(?::(?P<s>\d{2}(?:[.,]\d{1,9})?))?\s?(?P<half>[AaPp]\.?[Mm]\b)?(?![\d:])",
    re.IGNORECASE,
)
_HUMP = re.compile(r"(?<=[a-zß-ÿ])(?=[A-Z])")
# Moments of something else than the test.
_OF_OTHERS = re.compile(
    r"calib|kalib|export|print|gedruckt|program|install|warm|cure|shift|hold|halte|dwell|pause|contact|tare|tara|filter|session|"
    r"pre-?(?:load|cond)|vorlast|relax|unload|entlast",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Moments:
    """From when to when a test went on: seconds, how far these may be off as written, line of the end, and words of both."""

    seconds: float
    slack: float
    line: int
    shown: str


def moments(lines: Mapping[int, str]) -> Moments | None:
    """The time between a beginning and an end; None where there is not one of each, or the dates cannot be compared.

    Parameters
    ----------
    lines : 1-based line -> what stands there, beside a table.

    >>> found = moments({1: "Start: 26.11.2026 23:59:50", 2: "End: 27.11.2026 00:00:06"})
    >>> found.seconds, found.slack
    (16.0, 1.0)
    >>> moments({1: "Start: 14:05", 2: "Stopped at 2:07 PM"}).seconds, moments({1: "Start: 14:05:07", 2: "Hold end: 14:05:10"})
    (120.0, None)
    """
    there = {n: _HUMP.sub(" ", line) for n, line in lines.items() if len(line) <= _LONGEST and not _OF_OTHERS.search(line)}
    found = [(n, match) for n, line in sorted(there.items()) for match in _MOMENT.finditer(line)]
    began, ended = ([(n, m) for n, m in found if m[of]] for of in ("began", "ended"))
    if len(began) != 1 or len(ended) != 1:
        return None
    days = _days(began[0][1]["date"], ended[0][1]["date"])
    first, last = (_of_day(m) for _, m in (began[0], ended[0]))
    if days is None or first is None or last is None:
        return None
    seconds = last - first + days * _DAY
    if not any(m["date"] for _, m in found):
        seconds %= _DAY
    slack = max(_last_digit(m) for _, m in found)
    words = [(" ".join(m[0].replace('"', "").split()).strip(" ,;|'"), n) for n, m in (began[0], ended[0])]
    shown = " and ".join(f'"{text}" in line {n}' for text, n in words)
    return Moments(seconds, slack, ended[0][0], shown) if seconds >= 0 else None


def _days(first: str, last: str) -> int | None:
    """The days from one date to another; None where they cannot be told."""
    if first.strip().casefold() == last.strip().casefold():
        return 0
    days = [day for date in (first, last) if (day := date_in(date)) is not None]
    return (days[1] - days[0]).days if len(days) == 2 else None


def _of_day(match: re.Match[str]) -> float | None:
    hour = hour_of_day(int(match["h"]), match["half"] or "")
    if hour > 23 or int(match["m"]) > 59:
        return None
    return 3600.0 * hour + 60.0 * int(match["m"]) + float((match["s"] or "0").replace(",", "."))


def _last_digit(match: re.Match[str]) -> float:
    """What one more in the last digit of a moment is [s]."""
    if not match["s"]:
        return 60.0
    return float(10.0 ** -len(match["s"][3:]))

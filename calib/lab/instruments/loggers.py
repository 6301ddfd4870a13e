"""From lines that a logging library wrote, each with its prefix before named values, to lines of these values alone."""

from __future__ import annotations

import re
from collections.abc import Sequence

from calib.lab.instruments.vocabulary import understand

_DAY, _OF_DAY = r"\d{4}-\d\d-\d\d", r"\d\d:\d\d:\d\d"
_LEVEL = r"\[?(?:DEBUG|INFO|WARN|WARNING|ERROR|CRITICAL)\]?"
_SOURCE = r"\[?[\w.-]{1,40}\]?"
_PREFIXES = tuple(
    re.compile(form)
    for form in (
        # Arduino on an ESP32: "[   103][I][main.cpp:42] loop(): ".
        r"\[ {0,8}(?P<ms>\d{1,10})\]\[[EWIDV]\]\[[\w./-]{1,60}:\d{1,5}\] [\w:~]{1,60}\(\): ",
        # ESP-IDF: "I (1234) tag: ", by the clock of the system "I (10:22:31.000) tag: ".
        rf"[EWIDV] \((?:(?P<ms>\d{{1,10}})|(?P<clock>{_OF_DAY}\.\d{{3}}))\) [\w./-]{{1,40}}: ",
        # Python: "2023-04-12 10:22:31,000 INFO rig: ", "2023-04-12 10:22:31,000 - rig - INFO - ".
        rf"\[?(?P<clock>{_DAY} {_OF_DAY}[,.]\d{{3}})\]?(?: -)? (?:{_LEVEL}(?: -|:)? {_SOURCE}(?: -|:) |"
        rf"{_SOURCE}(?: -|:)? {_LEVEL}(?: -|:) |{_LEVEL}(?: -|:) )",
        # The same without a time: "INFO:rig:".
        rf"{_LEVEL}:{_SOURCE}:",
        # Syslog: "Apr 12 10:22:31.000 host prog[812]: ", "2023-04-12T10:22:31.000000+02:00 host prog[812]: ".
        rf"(?:[A-Z][a-z]{{2}} [ \d]\d (?P<clock>{_OF_DAY}(?:\.\d{{1,6}})?)|"
        rf"(?P<stamp>{_DAY}T{_OF_DAY}(?:\.\d{{1,6}})?)(?:Z|[+-]\d\d:?\d\d))"
        r" [\w.-]{1,60} [\w./-]{1,40}(?:\[\d{1,8}\])?: ",
    )
)
_ANY = re.compile("|".join("^" + re.sub(r"[?]P<\w+>", "?:", form.pattern) for form in _PREFIXES), re.MULTILINE)
# Values with their names, all that stands behind the prefix of a row.
_NAME = re.compile(r"(?:^|[\s,;|])\s*(?P<name>[^\W\d][^\s:=,;|]{0,40}) ?[:=] ?[-+.]?\d")
# Lines that show that each has the prefix, and characters at the beginning among which one stands.
_FEWEST, _BEGINNING = 5, 20_000


def may_be_logged(text: str) -> bool:
    """Whether a line near the beginning of a text has the prefix of a logging library."""
    return _ANY.search(text, 0, _BEGINNING) is not None


def without_loggers(lines: Sequence[str]) -> tuple[list[str], str]:
    """Take the prefixes of a logging library off the lines of named values, and keep its times where the values have none.

    Lines without such values stay as they are: above the first they say what starts, among the others they are for the user.

    Parameters
    ----------
    lines : of a text file.

    Returns
    -------
    The lines, as many as there are, and a note; [] and "" if most lines below the first such have no prefix of one kind.

    >>> log = [f"I ({300 + s}) rig: F_N={s} C_pF=97" for s in range(6)]
    >>> without_loggers(log)[0][1], without_loggers([f"I ({s}) rig: t_ms={s} C_pF=97" for s in range(6)])[0][1]
    ('time_ms=301; F_N=1 C_pF=97', 't_ms=1 C_pF=97')
    >>> without_loggers(["INFO:rig:F_N=1"] * 3 + ["F_N=1"] * 9)
    ([], '')
    """
    for form in _PREFIXES:
        found = [_before_values(form, line) for line in lines]
        there = [k for k, match in enumerate(found) if match is not None]
        below = sum(bool(line.strip()) for line in lines[there[0] :]) if there else 0
        if len(there) < _FEWEST or 2 * len(there) <= below:
            continue
        rests = [line[match.end() :] if match is not None else line for match, line in zip(found, lines, strict=True)]
        named = _NAME.findall(rests[there[0]])
        times = ["" if match is None else _time_of(match) for match in found]
        kept = any(times) and not any((h := understand(name)) is not None and h.quantity == "time" for name in named)
        of_times = "" if not any(times) else ", whose times are a column" if kept else ", whose times are not read"
        prefix = lines[there[0]].removesuffix(rests[there[0]]).strip()
        note = f'what a logger writes before every line is taken off, "{prefix}"{of_times}'
        return [f"{time}; {rest}" if kept and time else rest for time, rest in zip(times, rests, strict=True)], note
    return [], ""


def _before_values(form: re.Pattern[str], line: str) -> re.Match[str] | None:
    match = form.match(line)
    return match if match is not None and _NAME.match(line[match.end() :]) is not None else None


def _time_of(match: re.Match[str]) -> str:
    """The time in a prefix as a value with its name; "" if it has none."""
    own = match.groupdict()
    if own.get("ms"):
        return f"time_ms={own['ms']}"
    clock = own.get("clock") or own.get("stamp") or ""
    return f"received={clock.replace(',', '.').replace('T', ' ')}" if clock else ""

"""From lines with the time before them, as a terminal writes it, to lines with this time in a cell of its own."""

from __future__ import annotations

import re
from collections.abc import Sequence

from calib.lab.instruments.clock_cells import is_full_clock
from calib.lab.instruments.clock_words import in_figures
from calib.lab.instruments.numbers import SIGNS
from calib.lab.instruments.units import is_unit_of

# "14:05:22.000 -> ", as the serial monitor of Arduino writes it, "14:05:22.000 > " as that of PlatformIO, and
# "[2024-03-12 14:05:22.000] " as Tera Term and minicom do; and the name of the column that the times become.
_STAMP = re.compile(r"\s*(?:(?P<plain>\d[\d:.,T/ -]{6,34}?)\s*-?>|\[(?P<inside>[^\[\]]{7,40})\])[ \t]?")
_OF_STAMPS = "received"
# Lines that show that each has its time.
_FEWEST = 5
# What a line holds behind it: values with their names, or one with its unit alone, which is called by that.
_NAMED = re.compile(r"\s*[^\W\d][^\s:=,;|]{0,40} ?[:=] ?[-+.]?\d")
_ONE = re.compile(rf"\s*[{SIGNS}]?\d+(?:[.,]\d+)?(?:[eE][{SIGNS}]?\d+)? ?(?P<unit>[^\W\d_][^\s:=,;|]{{0,8}})\s*")
_NUMBERS = re.compile(rf"\s*[{SIGNS}]?[\d.][\d.eE+-]*(?:[ \t]+[{SIGNS}]?[\d.][\d.eE+-]*)*\s*")
# How a cell with a number begins, in quotes or not.
_BEGINS = frozenset("0123456789-+.\u2212\u2013\"'")
_CALLED = {"capacitance": "C", "force": "force", "displacement": "displacement"}


def with_stamps_in_cells(lines: Sequence[str]) -> tuple[list[str], str]:
    """Put the times before the lines of a terminal's log into cells of their own, or before the values that lines name.

    Lines above the first with a time stay as they are; below it each has one, but for a last line that was cut.

    Parameters
    ----------
    lines : of a text file; behind a last line end stands an empty one.

    Returns
    -------
    The lines, as many as there are, and a note; [] and "" if they have no such times, or no mark stands between cells.

    >>> log = [f"[14:05:2{s}] 97.{s} pF" for s in range(6)]
    >>> with_stamps_in_cells(log)[0][1]
    'received=14:05:21; C=97.1 pF'
    >>> with_stamps_in_cells([f"14:05:2{s}.0 -> {s},97.{s}" for s in range(6)])[0][1]
    '14:05:21.0,1,97.1'
    """
    found = [_stamp_of(line) for line in lines]
    first = next((i for i, match in enumerate(found) if match is not None), len(lines))
    there = [(match, line[match.end() :]) for match, line in zip(found, lines, strict=True) if match is not None]
    without = [i for i in range(first, len(lines)) if found[i] is None and lines[i].strip()]
    if len(there) < max(_FEWEST, first) or (without and without != [len(lines) - 1]):
        return [], ""
    how, mark = _how([rest for _, rest in there])
    if not how:
        return [], ""
    stamped = [_joined(match, line, how, mark) for match, line in zip(found, lines, strict=True)]
    sign = "in brackets stands" if there[-1][0]["inside"] else f'and "{there[-1][0][0].split()[-1]}" stand'
    called = f'; the number behind it, which has no name, is called "{mark}" by its unit' if how == "one" else ""
    return stamped, f"a time {sign} before every line, as a serial monitor writes them: these times are a column{called}"


# "Fri Nov 20 14:03:07 UTC 2026", as the program date writes it, in front of cells between blanks.
_OF_DATE = re.compile(
    r"\s*\[?(?P<stamp>[^\W\d_]{2,4}\.? +(?:[^\W\d_]{3,4}\.? +\d{1,2}|\d{1,2}\.? +[^\W\d_]{3,4}\.?) +"
    r"\d{1,2}:\d\d:\d\d(?:[.,]\d+)?(?: +[AP]M)?(?: +(?P<zone>[A-Z]{1,5}))? +\d{4})\]?:?(?P<behind> +\S.*)"
)
#: What shows that lines may begin with such dates.
MAY_BE_OF_DATE = re.compile(
    r"^[^\S\n]*\[?[^\W\d_]{2,4}\.? +[^\n]{3,14}\d{1,2}:\d\d:\d\d[^\n]{0,14}(?:19|20)\d\d\b", re.MULTILINE
)


def with_dates_in_figures(lines: Sequence[str]) -> list[str]:
    """The lines with the dates and times in words before them in figures; [] of any others, or where their zones change.

    >>> with_dates_in_figures([f"Fri Nov 20 14:03:0{s} UTC 2026: 0.{s} 0.2" for s in range(6)])[1]
    '2026-11-20T14:03:01 0.1 0.2'
    """
    found = [_OF_DATE.fullmatch(line) for line in lines]
    there = [match for match in found if match is not None]
    first = next((k for k, match in enumerate(found) if match is not None), 0)
    if len(there) < max(_FEWEST, sum(map(bool, map(str.strip, lines[first:]))) - 1) or len({m["zone"] for m in there}) > 1:
        return []
    figures = [in_figures(match["stamp"]).text.split(" ") if match is not None else [] for match in found]
    if any(parts and not is_full_clock(" ".join(parts[:2])) for parts in figures):
        return []
    return [
        f"{'T'.join(parts[:2])}{match['behind']}" if match is not None else line
        for line, match, parts in zip(lines, found, figures, strict=True)
    ]


def _stamp_of(line: str) -> re.Match[str] | None:
    match = _STAMP.match(line)
    return match if match is not None and is_full_clock(match["plain"] or match["inside"]) else None


def _how(rests: Sequence[str]) -> tuple[str, str]:
    """What stands behind the times: "named", "one" with its name, "numbers" or "cells" with the mark between; else ""."""
    if 2 * sum(_NAMED.match(rest) is not None for rest in rests) > len(rests):
        return "named", ""
    ones = [match["unit"] for rest in rests if (match := _ONE.fullmatch(rest)) is not None]
    if 2 * len(ones) > len(rests):
        name = next((name for quantity, name in _CALLED.items() if all(is_unit_of(u, quantity) for u in set(ones))), "value")
        return "one", name
    if all(map(_NUMBERS.fullmatch, rests[-_FEWEST - 1 : -1])):
        return "numbers", "\t"
    if 2 * sum(rest.lstrip()[:1] in _BEGINS and bool(rest.strip()) for rest in rests) <= len(rests):
        return "", ""  # words, which hold their numbers otherwise
    last = next((rest for rest in reversed(rests) if rest.strip()), "")
    mark = next((mark for mark in "\t;," if mark in last), "")
    return ("cells", mark) if mark else ("", "")


def _joined(match: re.Match[str] | None, line: str, how: str, mark: str) -> str:
    """A line with its time in front, as a cell or as one more value that is named."""
    if match is None:
        return line
    stamp, rest = in_figures((match["plain"] or match["inside"]).strip()).text, line[match.end() :]
    if how == "numbers":
        rest = mark.join(rest.split())
    if how in ("cells", "numbers"):
        return f"{stamp if rest[:1] in '-+.' or rest[:1].isdigit() else _OF_STAMPS}{mark}{rest}"
    named = f"{mark}={rest.strip()}" if how == "one" and _ONE.fullmatch(rest) else rest
    return f"{_OF_STAMPS}={stamp}; {named}"

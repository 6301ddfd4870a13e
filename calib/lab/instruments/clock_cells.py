"""From the cells of a column of times of day to their parts: hours, minutes, seconds, dates, offsets from UTC."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import compress, pairwise

import numpy as np

from calib.lab.instruments.clock_words import in_figures
from calib.lab.instruments.numbers import is_numeric, odd_cells
from models.sensor import FloatArray

# Characters of a date with a time of day, blanks around it apart.
_LONGEST = 80
# What time zones are called, with their summer times: "12:30:01 CEST". Some name several, so that none is an offset from UTC.
_ZONE_NAMES = "(?:CES?T|MES?Z|WES?T|EES?T|MSK|BST|IST|[ECMP][SD]T|AK[SD]T|HST|BRT|ART|JST|KST|SGT|HKT|A[CEW][SD]T|NZ[SD]T|GST)"
_DATE = r"\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}"
_CLOCK = re.compile(
    rf"^\s*(?P<date>{_DATE})?[ T]*"
    r"(?P<first>\d{1,3}):(?P<second>\d{1,2}(?=:)|\d{2})(?::(?P<third>\d{1,2})|(?=[.,]\d))(?P<part>[.,]\d+|(?<=:\d\d):\d{3}(?:\d{3})?)?\s*"
    rf"(?P<half>[AaPp]\.?[Mm]\.?)?\s*(?P<zone>Z|UTC|GMT|[+-]\d{{2}}:?\d{{2}})?(?:(?<=[\d\s])(?P<called>{_ZONE_NAMES}))?\s*$"
)
# Scripts write "10:0:0", without zeros in front; of two parts it is a ratio as well.
# The usual one, with a date or without, recognised and read at once.
_USUAL_CLOCK = rf"(?:{_DATE}[ T]+)?\d{{1,2}}:\d{{2}}:\d{{2}}(?:[.,]\d+)?"
_USUAL_PARTS = re.compile(rf"(?:{_DATE}[ T]+)?(\d{{1,2}}):(\d{{2}}):(\d{{2}}(?:[.,]\d{{1,12}})?)", re.ASCII)
_NOT_USUAL_CLOCK = re.compile(rf"\n(?!{_USUAL_CLOCK}$)", re.ASCII | re.MULTILINE)
_DATED = re.compile(rf"{_DATE}[ T]+", re.ASCII)
_DATE_ALONE = re.compile(rf"\s*{_DATE}\s*")
_ZONE = re.compile(r"\s*(?:Z|UTC|GMT|[+-]\d{2}:?\d{2})$", re.ASCII)
_CALLED = re.compile(rf"(?<=\d)\s*{_ZONE_NAMES}\s*$")
# Days, hours, minutes and seconds since the start.
_FOUR_FIELDS = re.compile(r"^\s*(\d{1,4}):(\d{1,2}):(\d{2}):(\d{2}(?:[.,]\d+)?)\s*$", re.ASCII)
# The minus of a time before zero, as of what was logged before a trigger: "-00:00:02.5".
_BEFORE_ZERO = re.compile(r"^\s*[-\u2212](?=\d{1,3}:\d{2}:\d{2}(?:[.,]\d+)?\s*$)", re.ASCII)
_TWO_FIELDS = re.compile(r"^\s*\d{1,3}:\d{2}\s*$", re.ASCII)


def is_clock(cell: str) -> bool:
    """Whether a cell is a time of day, with or without a date: "12:30:01.25", "2024-05-02 12:30:01:250", "30:01.2"."""
    cell = cell.strip()
    if len(cell) > _LONGEST or not any(character.isdecimal() for character in cell):
        return False
    return _has_form_of_clock(cell)


@lru_cache(maxsize=8192)  # cells of a line are asked about several times
def _has_form_of_clock(cell: str) -> bool:
    cell = _BEFORE_ZERO.sub("", cell)
    forms = (_CLOCK, _TWO_FIELDS, _FOUR_FIELDS)
    if any(form.match(cell) is not None for form in forms):
        return True
    text = in_figures(cell).text
    return text != cell and any(form.match(text) is not None for form in forms)


def is_reading(cell: str) -> bool:
    """Whether a cell is a number or a time, as a reading is.

    Parameters
    ----------
    cell : as written.

    >>> [is_reading(cell) for cell in ("0.5", "10:00:01.5", "Force (N)", "")]
    [True, True, False, False]
    """
    return is_numeric(cell) or is_clock(cell)


def is_full_clock(cell: str) -> bool:
    """Whether a cell is a time of day, or one since a start, that is nothing else: of three parts, or of two with decimals."""
    return is_clock(cell) and _TWO_FIELDS.match(cell) is None


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
    return [] if _usual_alike(cells) is not None else odd_cells(_NOT_USUAL_CLOCK, cells, most)


def is_date(cell: str) -> bool:
    """Whether a cell is a date and nothing else: "2024-05-02", "2.5.2024", "2 May 2024"."""
    return _DATE_ALONE.fullmatch(cell) is not None or _DATE_ALONE.fullmatch(in_figures(cell).text) is not None


@dataclass(frozen=True, eq=False)
class ClockParts:
    """Cells of times of day taken apart.

    Attributes
    ----------
    parts : numbers before, between and behind the colons, nan where there is none, (n_row, 3); all with a minus before zero.
    fraction : decimals behind a part that is not the third, (n_row,).
    zones : offset from UTC [s], nan where none is written, (n_row,).
    dates : of each cell, "" where it has none; [] if no cell has.
    has_half : whether am or pm is written.
    long_hours : whether hours pass 24, as of a time since the start.
    days : whether most have a fourth part before the others, whose days stand in the hours.
    spelled : whether words say what the parts count: "0 days 00:00:00.1", "PT0.1S", "14h03m07s".
    called : names of time zones that stand behind them, "" among them where some times have none; () if none has.
    """

    parts: FloatArray
    fraction: FloatArray
    zones: FloatArray
    dates: list[str]
    has_half: bool
    long_hours: bool
    days: bool = False
    spelled: bool = False
    called: tuple[str, ...] = ()


def clock_parts(cells: Sequence[str]) -> ClockParts:
    """Take the cells of a column of times of day apart, the usual ones all at once."""
    n = len(cells)
    parts, fraction, zones = np.full((n, 3), np.nan), np.zeros(n), np.full(n, np.nan)
    dates = [""] * n
    has_half, four, spelled = False, 0, False
    cells, name = _without_one_name(cells)
    called = {name} if name else set()
    cells, zone = _without_one_zone(cells)
    alike = _usual_alike(cells)
    odd = (odd_cells(_NOT_USUAL_CLOCK, cells, n) or []) if alike is None else []
    regular = np.ones(n, dtype=bool)
    regular[odd] = False
    if alike is not None:
        dates, parts = alike
    elif np.any(regular):
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
        before_zero = _BEFORE_ZERO.match(cells[i]) is not None
        cell = _BEFORE_ZERO.sub("", cells[i])
        match, two = _CLOCK.match(cell), _TWO_FIELDS.match(cell)
        if match is None and two is None and _FOUR_FIELDS.match(cell) is None:
            figures = in_figures(cell)
            cell, spelled = figures.text, spelled or figures.spelled
            match = _CLOCK.match(cell)
        if match is None and two is None:
            days = _FOUR_FIELDS.match(cell)
            if days is not None:
                four += 1
                parts[i] = 24 * int(days[1]) + int(days[2]), int(days[3]), float(days[4].replace(",", "."))
            continue
        if match is None:
            first, second = cell.split(":")
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
            parts[i, 2] = float(match["third"] + re.sub("[,:]", ".", match["part"] or ""))
        elif match["part"]:
            fraction[i] = float("0" + match["part"].replace(",", "."))
        called |= {match["called"] or ""} if not name else set()
        if match["zone"]:
            zones[i] = _offset(match["zone"])
        if before_zero:
            parts[i] = -parts[i]
        dates[i] = match["date"] or ""
    dated = any(dates)
    hours = parts[np.isfinite(parts[:, 0]), 0]
    long_hours = not dated and not has_half and bool(np.any(hours > 23)) and bool(np.all(np.diff(hours) >= 0))
    has_days = 2 * four > n
    called |= {""} if not name and np.any(regular) else set()
    names = tuple(sorted(called)) if any(called) else ()
    return ClockParts(
        parts, fraction, zones, dates if dated else [], has_half, long_hours or has_days, has_days, spelled, names
    )


def _usual_alike(cells: Sequence[str]) -> tuple[list[str], FloatArray] | None:
    """The dates and the parts of usual times that differ by their digits alone, as most columns do; None of any others."""
    first = cells[0] if len(cells) else ""
    usual = _USUAL_PARTS.fullmatch(first)
    text = "\n".join(cells) + "\n"
    if usual is None or not text.isascii() or len(text) != len(cells) * (len(first) + 1):
        return None
    written = np.frombuffer(text.encode(), dtype=np.uint8).reshape(len(cells), -1)
    is_digit = np.array([c.isdecimal() for c in first] + [False])
    figures = written[:, is_digit] - np.uint8(ord("0"))
    if np.any(written[:, ~is_digit] != written[0, ~is_digit]) or np.any(figures > 9):
        return None
    behind = np.cumsum(is_digit)  # digits up to each character
    starts = [int(behind[usual.start(k)]) - 1 for k in (1, 2, 3)] + [figures.shape[1]]
    parts = np.zeros((len(cells), 3))
    for k, (start, end) in enumerate(pairwise(starts)):
        for column in figures.T[start:end]:
            parts[:, k] = 10.0 * parts[:, k] + column
    parts[:, 2] /= 10.0 ** max(len(usual[3]) - 3, 0)
    end = usual.start(1)
    days = [first[:end]] * len(cells) if np.all(written[:, :end] == written[0, :end]) else [cell[:end] for cell in cells]
    return [day.strip(" T") for day in days], parts


def _without_one_name(cells: Sequence[str]) -> tuple[Sequence[str], str]:
    """The cells without the name of a time zone that all of them have, and that; "" if they have none, or several."""
    first = next((c for c in cells if c.strip()), "")
    match = _CALLED.search(first)
    if match is None or not all(not c.strip() or c.endswith(match[0]) for c in cells):
        return cells, ""
    return [c.removesuffix(match[0]) for c in cells], match[0].strip()


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
    if not zone[1:2].isdecimal():
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

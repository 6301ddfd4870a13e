"""From a date, a time of day or a duration with words in it ("2 Nov 2026", "1 day", "PT0.1S") to one in figures."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import date, timedelta
from decimal import Decimal

# The first letters of the months, in English, German, French, Spanish and Italian, those of several months longer.
_MONTHS = (
    "jan ene gen",
    "feb fév fev",
    "mar mär mrz",
    "apr avr abr",
    "may mai mag",
    "jun juin giu",
    "jul juil lug",
    "aug aoû aou ago",
    "sep set",
    "oct okt ott",
    "nov",
    "dec dez déc dic",
)
_MONTH_OF = {word: k for k, listed in enumerate(_MONTHS, 1) for word in listed.split()}
_WORD = r"(?P<month>[^\W\d_]{3,10})\.?"
_DAY_FIRST = re.compile(rf"(?P<day>\d{{1,2}})\.?[- /]{_WORD}[- /,]\s*(?P<year>\d{{4}})(?!\d)")
_MONTH_FIRST = re.compile(rf"{_WORD}[- ](?P<day>\d{{1,2}}),?[- ](?P<year>\d{{4}})(?!\d)")
# As ctime writes it, "Nov 20 14:03:07 2026", and the program date, "Nov 20 14:03:07 UTC 2026", "20 Nov 14:03:07 CET 2026".
_YEAR_LAST = re.compile(
    rf"(?:{_WORD}\s+(?P<day>\d{{1,2}})|(?P<first>\d{{1,2}})\.?\s+(?P<name>[^\W\d_]{{3,10}})\.?)\s+"
    r"(?P<clock>\d{1,2}:[\d:.,]+)(?:\s+(?P<half>[AP]M))?\s+(?:(?P<zone>[A-Z]{1,5}|[+-]\d\d:?\d\d)\s+)?(?P<year>\d{4})$"
)
# The offsets of zones by their letters, of those that are of one zone alone.
_OFFSETS = {
    zone: offset
    for offset, zones in {
        "+00:00": "UTC GMT Z WET",
        "+01:00": "CET MEZ WEST",
        "+02:00": "CEST MESZ EET",
        "+03:00": "EEST MSK",
        "+09:00": "JST KST",
        "-04:00": "EDT",
        "-05:00": "EST CDT",
        "-06:00": "MDT",
        "-07:00": "PDT",
        "-08:00": "PST",
    }.items()
    for zone in zones.split()
}
# ISO 8601 by the week and its day, or the day of the year, before a time of day: "2026-W47-5T14:03:07", "2026-324T14:03:07".
_OF_WEEK = re.compile(r"(?P<year>\d{4})-?W(?P<week>\d{2})-?(?P<day>[1-7])(?P<behind>[T ]\d{1,2}:\d.*|)")
_OF_YEAR = re.compile(r"(?P<year>\d{4})-(?P<day>\d{3})(?P<behind>[T ]\d{1,2}:\d.*)")
_WEEKDAY = re.compile(r"^[^\W\d_]{2,10}[.,]{0,2}\s+(?=\S)")
_OF_EAST = (
    (re.compile(r"(\d{2,4})\s?[年년]\s?(\d{1,2})\s?[月월]\s?(\d{1,2})\s?[日일]"), r"\1-\2-\3 "),
    (re.compile(r"(\d{1,2})\s?[時时点시]\s?(\d{1,2})\s?[分분]\s?(\d{1,2}(?:[.,]\d+)?)\s?[秒초]?"), r"\1:\2:\3"),
)
_HALVES = (
    (re.compile(r"\b([ap])\.?\s?m\b\.?", re.IGNORECASE), ""),
    (re.compile(r"上午|午前|오전"), "AM"),
    (re.compile(r"下午|午後|오후"), "PM"),
)
_NUMBER = r"\d+(?:[.,]\d+)?"
_DURATIONS = (
    # Of pandas and Python: "0 days 00:00:00.100000", "1 day, 0:00:01".
    re.compile(rf"\+?(?P<d>\d{{1,4}}) ?days?,? (?:\+)?(?P<h>\d{{1,2}}):(?P<m>\d{{2}}):(?P<s>{_NUMBER})", re.IGNORECASE),
    # ISO 8601.
    re.compile(rf"P(?:(?P<d>\d{{1,4}})D)?T(?:(?P<h>\d+)H)?(?:(?P<m>\d+)M)?(?:(?P<s>{_NUMBER})S)?"),
    # A difference of times as R writes it.
    re.compile(rf"(?P<s>{_NUMBER}) secs"),
    # "0 d 14 h 03 min 07 s".
    re.compile(rf"(?P<d>\d{{1,4}}) ?d ?(?P<h>\d{{1,3}}) ?h ?(?P<m>\d{{1,2}}) ?m(?:in)? ?(?P<s>{_NUMBER}) ?s(?:ec)?"),
)
# Of .NET, "1.00:00:00.5", and of ISO 8601 without marks, "20261120T140307.2Z".
_DAYS_BEFORE = re.compile(r"(\d{1,4})\.(\d{2}):(\d{2}):(\d{2}(?:[.,]\d+)?)")
_COMPACT = re.compile(r"(\d{4})(\d{2})(\d{2})[T_](\d{2})(\d{2})(\d{2}(?:[.,]\d+)?)(Z|[+-]\d{2}:?\d{2})?")
# As names of files have it: "2026-11-20_14-03-07.2".
_OF_FILES = re.compile(r"(\d{4})-(\d{2})-(\d{2})[_T ](\d{2})-(\d{2})-(\d{2}(?:[.,]\d+)?)")
# As spreadsheets of eastern Europe write dates: "2026. 11. 20. 14:03:07", "20. 11. 2026", "20.11.2026.", "20.11.2026 г."
_POINTED = re.compile(
    r"(?P<date>(?:\d{4}\.\s?\d{1,2}\.\s?\d{1,2}|\d{1,2}\.\s?\d{1,2}\.\s?(?:\d{4}|\d{2})))(?:\.(?!\d))?(?:\s?[грgr]\.?(?![^\W\d_]))?[,\s]*(?P<clock>\d{1,2}[:.]\d.*)?"
)
# A time of day, "14h03m07.2s".
_LETTERED = re.compile(r"(?P<h>\d{1,2}) ?h ?(?P<m>\d{2}) ?m(?:in)? ?(?P<s>\d{2}(?:[.,]\d+)?) ?s(?:ec)?")


@dataclass(frozen=True)
class Figures:
    """A time in figures, `text`; `spelled` if its words said what its parts count."""

    text: str
    spelled: bool = False


def in_figures(cell: str) -> Figures:
    """Write a time or a date with words in it in figures; any other cell stays as it is.

    >>> in_figures("20-Nov-2026 14:03:07.2").text, in_figures("2026/11/20 下午 2:03:07").text
    ('2026-11-20 14:03:07.2', '2026/11/20 2:03:07 PM')
    >>> in_figures("2026. 11. 20. 14:03:07,2").text, in_figures("20.11.2026 г.").text, in_figures("2026-11-20_14-03-07").text
    ('2026.11.20 14:03:07,2', '20.11.2026', '2026-11-20 14:03:07')
    >>> [in_figures(cell).text for cell in ("Fri Nov 20 14:03:07 UTC 2026", "2026-W47-5T14:03:07", "2026-324 14:03")]
    ['2026-11-20 14:03:07 +00:00', '2026-11-20T14:03:07', '2026-11-20 14:03']
    >>> in_figures("1 day, 0:00:01.5"), in_figures("PT75.5S").text, in_figures("Load")
    (Figures(text='1:00:00:01.5', spelled=True), '0:00:01:15.5', Figures(text='Load', spelled=False))
    """
    cell = cell.strip()
    compact = _COMPACT.fullmatch(cell)
    if compact is not None:
        return Figures(compact.expand(r"\1-\2-\3 \4:\5:\6\7"))
    pointed, of_files = _POINTED.fullmatch(cell), _OF_FILES.fullmatch(cell)
    if of_files is not None:
        return Figures(of_files.expand(r"\1-\2-\3 \4:\5:\6"))
    if pointed is not None:
        return Figures(" ".join(["".join(pointed["date"].split()), *([pointed["clock"]] if pointed["clock"] else [])]))
    days = _DAYS_BEFORE.fullmatch(cell)
    if days is not None:
        return Figures(":".join(days.groups()), spelled=True)
    if not any(c.isdecimal() for c in cell) or not (any(c.isalpha() for c in cell) or _OF_YEAR.fullmatch(cell)):
        return Figures(cell)
    if (counted := _of_iso(cell)) is not None:
        return Figures(counted)
    match = next((m for form in _DURATIONS if (m := form.fullmatch(cell)) is not None and any(m.groups())), None)
    if match is not None:
        return Figures(_duration(match), spelled=True)
    lettered = _LETTERED.fullmatch(cell)
    return Figures(":".join(lettered.groups()), spelled=True) if lettered is not None else Figures(_dated(cell))


def _of_iso(cell: str) -> str | None:
    """A date that counts weeks or the days of the year with its month and day; None of any other, and of a day that is none."""
    week, of_year = _OF_WEEK.fullmatch(cell), _OF_YEAR.fullmatch(cell)
    try:
        if week is not None:
            return f"{date.fromisocalendar(int(week['year']), int(week['week']), int(week['day']))}{week['behind']}"
        if of_year is not None:
            day = date(int(of_year["year"]), 1, 1) + timedelta(int(of_year["day"]) - 1)
            return f"{day}{of_year['behind']}" if day.year == int(of_year["year"]) else None
    except ValueError:
        return None
    return None


def _duration(match: re.Match[str]) -> str:
    found = {name: Decimal(text.replace(",", ".")) for name, text in match.groupdict().items() if text}
    parts = (("d", 86400), ("h", 3600), ("m", 60), ("s", 1))
    total = sum((found[name] * size for name, size in parts if name in found), Decimal(0))
    days, left = divmod(total, 86400)
    hours, left = divmod(left, 3600)
    minutes, seconds = divmod(left, 60)
    whole, _, decimals = f"{seconds:f}".partition(".")
    return f"{days:f}:{int(hours):02d}:{int(minutes):02d}:{int(whole):02d}" + (f".{decimals}" if decimals else "")


def _dated(cell: str) -> str:
    """A date with a month in letters in figures, east Asian signs as marks, and the half of the day behind the time."""
    text = cell
    for form, figures in _OF_EAST:
        text = form.sub(figures, text)
    for form, half in _HALVES:
        found = form.search(text)
        if found is not None:
            said = half or f"{found[1].upper()}M"
            before, behind = text[: found.start()].rstrip(), text[found.end() :].strip()
            at_once = before[-1:].isdecimal() and ":" in before.split()[-1]
            text = " ".join(filter(None, [before, said, behind] if at_once else [before, behind, said]))
            break
    for whole in (text, _WEEKDAY.sub("", text)):
        for form in (_DAY_FIRST, _MONTH_FIRST, _YEAR_LAST):
            match = form.match(whole)
            parts = match.groupdict() if match is not None else {}
            month = _month(parts["month"] or parts.get("name") or "") if parts else 0
            if match is not None and month:
                clock = whole[match.end() :].strip().lstrip(", ")
                if form is _YEAR_LAST:
                    zone = parts["zone"] or ""
                    clock = " ".join(
                        part
                        for part in (parts["clock"], parts["half"], _OFFSETS.get(zone, "" if zone.isalpha() else zone))
                        if part
                    )
                return f"{parts['year']}-{month:02d}-{int(parts['day'] or parts['first']):02d} {clock}".strip()
    bare = _WEEKDAY.sub("", text)
    return bare if bare[:1].isdecimal() and any(mark in bare for mark in "-/.") and ":" in bare else text


def _month(word: str) -> int:
    return next((k for n in (4, 3) if (k := _MONTH_OF.get(word[:n].lower(), 0))), 0)

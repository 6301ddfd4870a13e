"""A document in, one whose time is written in another way out: rightly, or so that it cannot be what its header says."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime, timedelta

from mutants.document import Column, Document, Row, put, with_column, with_rows
from mutants.kind import Kind

_DAY = datetime(2026, 3, 4)
#: Days from the zero of spreadsheets to 1 January 1970, and seconds of a day.
_SPREADSHEET, _SECONDS = 25_569, 86_400


def _seconds(doc: Document) -> tuple[int, list[float]] | None:
    """The column of the time and its seconds from the first row on, where it is numbers and every row has one."""
    at = doc.index("time")
    if at is None or not doc.columns[at].factors or doc.columns[at].mark != "." or doc.columns[at].group or doc.free_time:
        return None
    if any(at >= len(doc.row(i).cells) for i in doc.rows()):
        return None
    values = [doc.row(i).values[at] * doc.columns[at].factors[0] for i in doc.rows()]
    if not values or any(v != v for v in values) or max(values) - min(values) > 40_000:
        return None
    return at, [v - values[0] for v in values]


def _rewritten(doc: Document, at: int, column: Column, texts: Sequence[str], values: Sequence[float]) -> Document:
    new = iter(zip(texts, values, strict=True))

    def changed(row: Row) -> Row:
        text, value = next(new)
        return replace(row, cells=put(row.cells, at, text), values=put(row.values, at, value))

    return replace(with_rows(with_column(doc, at, column), changed), free_time=True)


def _as_time(
    names: Sequence[str],
    unit: str,
    text: Callable[[float], str],
    right: bool,
    begins: Sequence[float] = (0.0,),
    step: float = 1e-4,
) -> Callable[[Document, random.Random], Document | None]:
    """A change of the time column: its name, its unit, how seconds are written, and whether they may be read at all."""

    def change(doc: Document, rng: random.Random) -> Document | None:
        found = _seconds(doc)
        if found is None:
            return None
        at, values = found
        begin = rng.choice(begins)
        values = [begin + round(v / step) * step for v in values]
        column = Column(rng.choice(names), " " if unit else "", "()" if unit else "", unit, "time", (1.0,) if right else ())
        return _rewritten(doc, at, column, [text(v) for v in values], values)

    return change


def _clock(seconds: float) -> str:
    moment = _DAY + timedelta(seconds=round(seconds, 4))
    return f"{moment:%H:%M:%S}.{moment.microsecond // 100:04d}"


def _hundredths(seconds: float) -> str:
    n = round(seconds * 100)
    return f"{n // 6000:02d}:{n // 100 % 60:02d}:{n % 100:02d}"


def hundredths(doc: Document, rng: random.Random) -> Document | None:
    """Minutes, seconds and hundredths, which the name says, or a part that is no second or minute shows."""
    name = rng.choice(("Time (mm:ss:ff)", "Time [mm:ss:ff]", "Time"))
    new = _as_time((name,), "", _hundredths, True, step=1e-2)(doc, rng)
    at = None if new is None else new.index("time")
    if new is None or at is None:
        return None
    shown = name != "Time" or any(int(new.row(i).cells[at][-2:]) > 59 for i in new.rows())
    return new if shown else None


def _date(pattern: str, zone: str = "") -> Callable[[float], str]:
    def text(seconds: float) -> str:
        moment = _DAY + timedelta(seconds=round(seconds, 4))
        return f"{moment.strftime(pattern)}.{moment.microsecond // 100:04d}{zone}"

    return text


def _epoch(seconds: float) -> float:
    return (_DAY - datetime(1970, 1, 1)).total_seconds() + seconds


def night(doc: Document, rng: random.Random) -> Document | None:
    """Dates with a pause of a day or more in the middle, which clocks alone would not show."""
    found = _seconds(doc)
    if found is None or len(found[1]) < 10:
        return None
    at, values = found
    pause = _SECONDS * rng.choice((1, 2)) + rng.choice((0.0, 3600.0, -2.0))
    half = len(values) // 2
    values = [8 * 3600 + round(v, 4) + (pause if i >= half else 0.0) for i, v in enumerate(values)]
    text = _date(rng.choice(("%Y-%m-%d %H:%M:%S", "%Y-%m-%dT%H:%M:%S")))
    return _rewritten(doc, at, Column("Timestamp", quantity="time", factors=(1.0,)), [text(v) for v in values], values)


def summer_time(doc: Document, rng: random.Random) -> Document | None:
    """Dates with their zone, which changes within the record."""
    found = _seconds(doc)
    if found is None or len(found[1]) < 10:
        return None
    at, values = found
    half = rng.randrange(2, len(values) - 2)
    values = [8 * 3600 + round(v, 4) for v in values]
    before, after = _date("%Y-%m-%dT%H:%M:%S", "+01:00"), _date("%Y-%m-%dT%H:%M:%S", "+02:00")
    texts = [before(v) if i < half else after(v + 3600) for i, v in enumerate(values)]
    return _rewritten(doc, at, Column("Timestamp", quantity="time", factors=(1.0,)), texts, values)


_MORNING = (8 * 3600.0, 9.5 * 3600, 13 * 3600 + 61.5)
_SAME, _NEVER = "the same differences", "no time of a lab"
_CLOCKS = ("Time", "Time of day", "Clock", "Uhrzeit")
_DATES = ("Timestamp", "Time", "Date Time", "DateTime", "Date/Time")

KINDS = (
    Kind("time of day", _SAME, _as_time(_CLOCKS, "", _clock, True, _MORNING), True),
    Kind("time of day over midnight", _SAME, _as_time(_CLOCKS, "", _clock, True, (86_390.0, 86_399.5)), True),
    Kind("date and time", _SAME, _as_time(_DATES, "", _date("%Y-%m-%d %H:%M:%S"), True, _MORNING), True),
    Kind(
        "date and time, ISO",
        _SAME,
        _as_time(_DATES, "", _date("%Y-%m-%dT%H:%M:%S", "Z"), True, _MORNING),
        True,
    ),
    Kind("dates over a pause of a day", "the pause is in the time", night),
    Kind("zone changes", "the zone is in the time", summer_time),
    Kind(
        "minutes, seconds, hundredths",
        "not hours, minutes, seconds",
        hundredths,
    ),
    Kind(
        "epoch seconds",
        _SAME,
        _as_time(("Epoch", "Timestamp", "Unix time"), "s", lambda v: f"{_epoch(v):.4f}", True),
        True,
    ),
    Kind(
        "epoch milliseconds",
        _SAME,
        _as_time(("Epoch", "Timestamp", "Unix time", "Time"), "ms", lambda v: f"{1000 * _epoch(v):.1f}", True),
        True,
    ),
    Kind(
        "spreadsheet days under (s)",
        "no record lasts milliseconds and begins after 12 hours",
        _as_time(("Time", "Timestamp"), "s", lambda v: f"{_epoch(v) / _SECONDS + _SPREADSHEET:.10f}", False),
    ),
    Kind(
        "epoch seconds under (ms)",
        _NEVER,
        _as_time(("Time", "Timestamp"), "ms", lambda v: f"{_epoch(v):.4f}", False),
    ),
    Kind("epoch milliseconds under (s)", _NEVER, _as_time(("Time",), "s", lambda v: f"{1e3 * _epoch(v):.1f}", False)),
    Kind(
        "time with its digits lost",
        "nothing is left of the differences",
        _as_time(("Time", "Timestamp"), "s", lambda v: f"{_epoch(v):.5E}", False),
    ),
)

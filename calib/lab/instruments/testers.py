"""Testing machines: how the files of each maker are known. All are tables; what differs is the words and what stands above."""

from __future__ import annotations

import re

from calib.lab.instruments.columns import needs
from calib.lab.instruments.header import split_line
from calib.lab.instruments.labtable import Family
from calib.lab.instruments.sheet import Sheet

_TESTER = needs("displacement", "force")


def _channels(sheet: Sheet) -> str:
    named = [sheet.names[i] for i in sheet.headings()]
    return f"channels {', '.join(named)} in line {sheet.header_line}"


def _above(sheet: Sheet, pattern: re.Pattern[str]) -> tuple[int, str] | None:
    """1-based line and first cell of the first line above the header in which the pattern is found."""
    for i, line in enumerate(sheet.prelude):
        if pattern.search(line):
            cells = [c for c in split_line(line, sheet.delimiter) if c]
            return i + 1, (cells[0] if cells else line)[:60]
    return None


def _words(sheet: Sheet) -> list[str]:
    return [h.name for h in sheet.headings().values()]


def _holds_capacitance(sheet: Sheet) -> bool:
    return any(h.quantity.startswith("capacitance") for h in sheet.headings().values())


# ----------------------------------------------------------------------------------------------------------------- Instron

_BLUEHILL_DISPLACEMENT = (
    "extension",
    "displacement",
    "compressive extension",
    "compressive displacement",
    "traversenweg",
    "extensión",
    "位移",
    "変位",
)
_BLUEHILL_FORCE = (
    "load",
    "force",
    "compressive load",
    "compressive force",
    "last",
    "kraft",
    "charge",
    "carga",
    "载荷",
    "力",
    "荷重",
)
_BLUEHILL_BLOCK = re.compile(
    r"text inputs|specimen label|bluehill|^\"?(general|dimension|method|sample|number inputs)\s*:|is_[tc](?:omp|ens|cyclic)",
    re.IGNORECASE,
)


def bluehill(sheet: Sheet) -> str:
    """Bluehill's channel names, with units in brackets below them, its header block above, or a specimen number before them."""
    if _holds_capacitance(sheet):
        return ""
    named = _words(sheet)
    if not any(n in _BLUEHILL_DISPLACEMENT or n in _BLUEHILL_FORCE for n in named):
        return ""
    channels = _channels(sheet)
    first = sheet.names[0].strip('"')
    if first.isdigit() and sheet.units_line is not None:
        return f"{channels} after the specimen number {first}, units in line {sheet.units_line} (Bluehill Universal export)"
    block = _above(sheet, _BLUEHILL_BLOCK)
    if block is not None:
        return f'{channels}, header block with "{block[1]}" in line {block[0]}'
    if sheet.units_line is not None and "(" in sheet.text.lines[sheet.units_line - 1]:
        return f"{channels}, units in brackets in line {sheet.units_line}"
    both = any(n in _BLUEHILL_DISPLACEMENT for n in named) and any(n in _BLUEHILL_FORCE for n in named)
    if both and sheet.units_line is None:
        return f"{channels}, units in the names"
    return ""


# A channel with its wiring in brackets, "Position(Linear:Digital Position) (mm)", or counters only WaveMatrix writes.
_WAVEMATRIX_CHANNEL = re.compile(r"^\w[\w ]*\([^()]*:[^()]*\)\s*\(")
_WAVEMATRIX_COUNTERS = ("elapsed cycles", "cycle elapsed time")


def wavematrix(sheet: Sheet) -> str:
    """WaveMatrix: units inside the names, with torque, elapsed cycles, or a channel's wiring in brackets."""
    if _holds_capacitance(sheet) or sheet.units_line is not None:
        return ""
    telling = [
        n
        for n in sheet.names
        if _WAVEMATRIX_CHANNEL.match(n)
        or re.match(r"torque\s*\(", n, re.IGNORECASE)
        or re.sub(r"\s*\(.*", "", n).strip().lower() in _WAVEMATRIX_COUNTERS
    ]
    above = _above(sheet, re.compile(r"wavematrix", re.IGNORECASE))
    if above is not None:
        return f"{_channels(sheet)}, WaveMatrix named in line {above[0]}"
    return f'{_channels(sheet)}, with "{telling[0]}" among them, units in the names' if telling else ""


# --------------------------------------------------------------------------------------------------------------- other makers

_ZWICK_NAMES = ("standardkraft", "standardweg", "standard force", "standard travel", "prüfzeit", "traversenweg absolut")


def zwickroell(sheet: Sheet) -> str:
    """ZwickRoell testXpert: its own channel names, or its name above them."""
    above = _above(sheet, re.compile(r"testxpert|zwick", re.IGNORECASE))
    if above is not None:
        return f'{_channels(sheet)}, "{above[1]}" in line {above[0]}'
    own = [n for n in _words(sheet) if n in _ZWICK_NAMES]
    if not own:
        return ""
    where = f", units in line {sheet.units_line}" if sheet.units_line is not None else ""
    return f'{_channels(sheet)}, "{own[0]}" among them{where}'


def mts(sheet: Sheet) -> str:
    """MTS 793: a first line that declares language and marks, or TestSuite's words."""
    first = sheet.text.lines[0].lstrip("\ufeff") if sheet.text.lines else ""
    if sheet.header_line > 1 and first.startswith("MTS793|"):
        mark = f', decimal mark "{sheet.declared_decimal}" declared there' if sheet.declared_decimal else ""
        return f'line 1 is "{first[:40]}"{mark}; {_channels(sheet)}'
    above = _above(sheet, re.compile(r"\bMTS\b|multipurpose testware|testsuite|testworks", re.IGNORECASE))
    return f'{_channels(sheet)}, "{above[1]}" in line {above[0]}' if above is not None else ""


def mecmesin(sheet: Sheet) -> str:
    """Mecmesin: its name above, or event flags beside load and displacement, with specimens side by side."""
    above = _above(sheet, re.compile(r"mecmesin|vectorpro|emperor", re.IGNORECASE))
    if above is not None:
        return f'{_channels(sheet)}, "{above[1]}" in line {above[0]}'
    events = any(n.strip().lower() in ("event", "events") for n in sheet.names)
    minutes = any(h.quantity == "time" and h.unit in ("min", "mins", "minutes") for h in sheet.headings().values())
    beside = any("side by side" in note for note in sheet.notes)
    if events and (minutes or beside):
        return f"{_channels(sheet)}, event flags, {'specimens side by side' if beside else 'time in minutes'}"
    return ""


TESTERS = (
    Family("MTS", mts, _TESTER, verified=False),
    Family("ZwickRoell testXpert", zwickroell, _TESTER, verified=False),
    Family("Mecmesin", mecmesin, _TESTER, verified=False),
    Family("Instron WaveMatrix", wavematrix, _TESTER, verified=False),
    Family("Instron Bluehill raw data", bluehill, _TESTER, verified=True),
)

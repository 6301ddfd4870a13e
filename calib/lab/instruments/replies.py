"""From a log of an LCR meter's replies, lines without a header, to a `Sheet` with names."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from calib.errors import Fault, InputError, capped
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.text import LabText

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_TIME = r"(?:(?P<time>\d[\d:./\- T]*)\s*[,;\t]\s*)?"
# `0,CP 1.23456E-06,D 0.12345,0`: status, named values, comparator; a time may stand before it.
_VALUE = rf"[A-Z]{{1,5}}[ \t]+{_NUMBER}"
_NAMED = re.compile(
    rf"^\s*{_TIME}(?P<status>\d+)\s*,\s*(?P<values>{_VALUE}(?:\s*,\s*{_VALUE}){{0,8}})\s*(?:,\s*[+-]?\d+)?\s*$", re.ASCII
)
# `MAIN:PRIM 96.8pF` and then `MAIN:SECO .0045`; OV01 or OVER where there is no reading.
_MAIN = re.compile(
    rf"^\s*{_TIME}MAIN:(?P<which>PRIM|SECO)\s+(?P<value>{_NUMBER}|[A-Z]{{2,5}}\d{{0,2}})[ \t]*(?P<unit>[a-zA-Zµ]{{0,3}})\s*$"
)
_PREFIX = {"p": "e-12", "n": "e-9", "u": "e-6", "µ": "e-6", "m": "e-3", "": ""}


def replies(text: LabText) -> Sheet | None:
    """The replies as a table, each row with its line; None if the file does not hold any.

    Values that each line names become columns of these names, in the SI units in which meters reply. Of a GW Instek log the
    primary value is a column, in farad; its secondary is left out, as the log does not say what it is.

    Raises
    ------
    InputError
        If a line among the replies is none, or another quantity than a capacitance is the primary one.
    """
    seen = [line for line in text.lines[:20] if line.strip()]
    for pattern, cells_of in ((_NAMED, _named), (_MAIN, _main)):
        if len(seen) < 2 or not all(map(pattern.match, seen)):
            continue
        rows: list[list[str]] = []
        lines: list[int] = []
        faults: list[Fault] = []
        names: list[str] = []
        for number, line in enumerate(text.lines, 1):
            match = pattern.match(line)
            cut_short = not text.ended and number == len(text.lines)
            if match is None:
                if line.strip() and not cut_short:
                    faults.append(Fault(f'"{line.strip()[:60]}" stands among the replies', text.path, number, 1))
                continue
            found = cells_of(match)
            if found is None or cut_short:
                continue
            names = names or list(found)
            if list(found) != names:
                there, first = ", ".join(found), ", ".join(names)
                faults.append(Fault(f"the reply holds {there}, the first one {first}", text.path, number, 1))
                continue
            rows.append(list(found.values()))
            lines.append(number)
        if faults:
            raise InputError(capped(faults, "lines cannot be read"))
        if rows:
            return _sheet(text, names, rows, lines)
    return None


def _sheet(text: LabText, names: Sequence[str], rows: list[list[str]], lines: list[int]) -> Sheet:
    columns, places = tuple(zip(*rows, strict=True)), np.array(lines, dtype=np.int64)
    return Sheet(text, ",", 0, tuple(names), declared_decimal=".", columns=columns, lines=places)


def _timed(match: re.Match[str]) -> dict[str, str]:
    # A number without a unit would be refused; meters' hosts stamp seconds or a time of day.
    return {"Time (s)": match["time"].strip()} if match["time"] else {}


def _named(match: re.Match[str]) -> dict[str, str] | None:
    values = dict(part.split() for part in match["values"].split(","))
    in_farad = {"CP": "CP (F)", "CS": "CS (F)"}
    return {**_timed(match), "Status": match["status"], **{in_farad.get(n, n): v for n, v in values.items()}}


def _main(match: re.Match[str]) -> dict[str, str] | None:
    if match["which"] == "SECO":
        return None
    value, unit = match["value"], match["unit"]
    if re.fullmatch(_NUMBER, value):
        if not unit.endswith("F") or unit[:-1] not in _PREFIX:
            raise InputError(
                Fault(f'the primary value "{value}{unit}" is not a capacitance', advice="Set the meter to C and D")
            )
        value += _PREFIX[unit[:-1]]
    return {**_timed(match), "Capacitance (F)": value}

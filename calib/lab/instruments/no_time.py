"""From a `Sheet` of which no time is read to the note on a column that may be one, and the options by which it is read."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from decimal import Decimal

import numpy as np

from calib.errors import in_shell
from calib.lab.instruments.numbers import to_numbers
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.units import asked_factor, is_unit_of
from models.sensor import FloatArray

# "Sample rate: 50 Hz", "Sampling interval [ms];20", "Abtastrate 100 1/s".
_RATE = re.compile(
    r"\b(?:sampl\w*|scan|acquisition|data|logging|log|record\w*|measur\w*|abtast\w*|mess\w*|échantillonnage|muestreo)[\s_-]*"
    r"(?:acquisition[\s_-]*)?(?:rate|frequency|freq|interval|period|time|rate|frequenz|intervall|d'échantillonnage|step)?\b"
    r"(?P<between>[^\d]*)(?P<number>\d+(?:[.,]\d+)?)[\s,;]*(?P<unit>[^\W\d]+(?:/s(?:ec)?)?|1/s)?",
    re.IGNORECASE,
)
_UNIT_BEFORE = re.compile(r"[\[(,]\s*(?P<unit>[^\W\d]+(?:/s)?|1/s)\s*[\])]?")
_PER_SECOND = frozenset(
    [
        "hz",
        "khz",
        "s/s",
        "ks/s",
        "sa/s",
        "ksa/s",
        "sps",
        "ksps",
        "1/s",
        "samples/s",
        "samples/sec",
        "pts/s",
        "points/s",
        "readings/s",
    ]
)
_FEWEST = 5


def note_on_time(sheet: Sheet, used: Collection[int], unread: Mapping[int, str]) -> str:
    """Say of a record without a time which column looks like one, or counts the rows beside a rate; "" if none does.

    Parameters
    ----------
    sheet : the record.
    used : indices of the columns that are read.
    unread : index -> why a column is not read.
    """
    counter, rising = None, None
    for index in range(len(sheet.names)):
        if index in used or index in sheet.set_aside or not unread.get(index, "not understood").startswith("not understood"):
            continue
        values = to_numbers([c.strip() for c in sheet.columns[index]], sheet.declared_decimal or ".").values
        steps = np.diff(values)
        if values.size < _FEWEST or not np.all(np.isfinite(values)) or not np.all(steps > 0):
            continue
        if _counts(values):
            counter = index if counter is None else counter
        elif rising is None and (not sheet.unit_written(index) or is_unit_of(sheet.unit_written(index), "time")):
            rising = index
    if rising is not None:
        unit = sheet.unit_written(rising) or "s"
        asked = f"{in_shell(f'time={sheet.name_for_asking(rising)}')} --units time={unit}"
        return f'no time is read; "{_name(sheet, rising)}" rises from row to row as one does: if it is one, --columns {asked}'
    stated = _stated_step(sheet)
    if counter is None or stated is None:
        return ""
    line, step = stated
    asked = f"--columns {in_shell(f'time={sheet.name_for_asking(counter)}')} --units {in_shell(f'time={step} s')}"
    return (
        f'no time is read; "{_name(sheet, counter)}" counts the rows and line {line} says '
        f'"{sheet.prelude[line - 1].strip()[:60]}": {asked} reads the time from both'
    )


def _name(sheet: Sheet, index: int) -> str:
    return sheet.names[index] or f"column {index + 1}"


def _counts(values: FloatArray) -> bool:
    return bool(np.all(np.diff(values) == 1) and np.all(values % 1 == 0))


def _stated_step(sheet: Sheet) -> tuple[int, str] | None:
    """The line from 1 above the header that states how often was read, and the time [s] from one reading to the next."""
    for line, text in enumerate(sheet.prelude, 1):
        match = _RATE.search(text)
        if match is None or not Decimal(match["number"].replace(",", ".")):
            continue
        number = Decimal(match["number"].replace(",", "."))
        before = _UNIT_BEFORE.search(match["between"])
        unit = match["unit"] or (before["unit"] if before is not None else "")
        if unit.lower() in _PER_SECOND:
            return line, _written(1 / (number * (1000 if unit.lower().startswith("k") else 1)))
        if unit and is_unit_of(unit, "time") and not re.search(r"total|duration|dauer", text, re.IGNORECASE):
            return line, _written(number * Decimal(repr(asked_factor(unit, "time"))))
    return None


def _written(step: Decimal) -> str:
    return f"{step.normalize():f}" if step == round(step, 9) else f"{float(step):.9g}"

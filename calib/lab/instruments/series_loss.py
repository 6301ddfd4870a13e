"""From a `Sheet` with a series capacitance beside its series resistance to the dissipation, D = 2 pi f Rs Cs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from calib.lab.instruments.brackets import tidy
from calib.lab.instruments.numbers import to_numbers
from calib.lab.instruments.sheet import Sheet
from models.sensor import FloatArray

# A series resistance in its unit, in the name or with that below it.
_NAME = r"(?:r_?s|esr|r ?ser(?:ies)?|series (?:resistance|r)|serienwiderstand)"
_UNIT = r"(?P<prefix>[mkM]?)(?:Ω|\u2126|ohms?|Ohms?|OHMS?)"
_RESISTANCE = re.compile(rf"(?i:{_NAME})[\s_,]*[(\[]?\s*{_UNIT}\s*[)\]]?")
_PREFIX = {"": 1.0, "m": 1e-3, "k": 1e3, "M": 1e6}
_HERTZ = re.compile(r"(?P<number>\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)\s?(?P<prefix>[kM]?)Hz\b")
_SAYS_FREQUENCY = re.compile(r"\bfreq|frequen[cz]|fréquence|\bf\s*[=:]", re.IGNORECASE)
# A sensor with a larger loss is no capacitor that these are of.
_LARGEST = 1.0


@dataclass(frozen=True)
class SeriesLoss:
    """The dissipation of each row, which column it is drawn from, and a note on that."""

    values: FloatArray
    index: int
    note: str


def series_loss(sheet: Sheet, series: int, values: Mapping[str, FloatArray], decimal: str) -> SeriesLoss | None:
    """The dissipation by a series resistance; None where not one column is it or the frequency is not told.

    D = 2 pi f Rs Cs.

    Parameters
    ----------
    sheet : the record.
    series : index of the column of the series capacitance.
    values : what was read in SI, with "capacitance_series", and "frequency" if it is a column.
    decimal : decimal mark of the file.
    """
    found = [(i, _PREFIX[m["prefix"]]) for i in range(len(sheet.names)) if (m := _RESISTANCE.fullmatch(_with_unit(sheet, i)))]
    frequency = values["frequency"] if "frequency" in values else _said_frequency(sheet, series)
    if len(found) != 1 or frequency is None:
        return None
    index, factor = found[0]
    resistance = factor * to_numbers([cell.strip() for cell in sheet.columns[index]], decimal).values
    loss = np.asarray(2 * np.pi * frequency * resistance * values["capacitance_series"])  # D = 2 pi f Rs Cs
    there = loss[np.isfinite(loss)]
    if not there.size or there.min() < 0 or there.max() > _LARGEST:
        return None
    name, of = sheet.names[index], sheet.names[series]
    at = f"{np.nanmedian(frequency):.6g} Hz"
    return SeriesLoss(loss, index, f'dissipation is 2 pi f Rs Cs of "{name}" and "{of}" at {at}')


def _with_unit(sheet: Sheet, index: int) -> str:
    name, unit = tidy(sheet.names[index]), sheet.unit_below(index)
    return f"{name} ({unit})" if unit else name


def _said_frequency(sheet: Sheet, series: int) -> FloatArray | None:
    """The one frequency [Hz] that stands in the name of the capacitance, or else in lines above; None if there is not one."""
    for lines in ([sheet.names[series]], [line for line in sheet.prelude if _SAYS_FREQUENCY.search(line)]):
        said = {_in_hertz(match) for line in lines for match in _HERTZ.finditer(line)}
        if said:
            return np.array(said.pop()) if len(said) == 1 else None
    return None


def _in_hertz(match: re.Match[str]) -> float:
    return float(match["number"].replace(",", ".")) * _PREFIX[match["prefix"]]

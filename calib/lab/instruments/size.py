"""From readings in SI to the faults of columns whose size or sign no test of a small sample gives."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.numbers import SPACES
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.times import unit_of_numbers
from calib.lab.instruments.units import SI_UNIT, stands_for
from models.sensor import FloatArray

#: Largest reading, in SI, between which the tests of small soft samples lie: outside of it the unit is wrong.
PLAUSIBLE: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"displacement": (1e-9, 2.0), "force": (1e-6, 1e6), "capacitance": (1e-16, 1e-3), "capacitance_series": (1e-16, 1e-3)}
)
#: The same for instruments of nanometres and micronewtons (`Reading.scale` "micro").
MICRO: Mapping[str, tuple[float, float]] = MappingProxyType({**PLAUSIBLE, "displacement": (1e-12, 2.0), "force": (1e-12, 1e6)})
# Largest readings [SI] that presses of soft sensors usually have.
_USUAL: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "time": (0.5, 1e6),
        "displacement": (2e-5, 5e-2),
        "force": (2e-2, 1e3),
        "capacitance": (1e-12, 2e-8),
        "capacitance_series": (1e-12, 2e-8),
    }
)
# A capacitance may be larger than this only if its unit is said once more.
_LARGE = 1e-6
# A force that stays within such a share of its largest reading is none of a press that begins without contact.
_NEVER_NEAR_ZERO = 0.5
# A capacitance is a change of one if its smallest reading, but for such a share of them, is so small beside its largest.
_FEWEST, _FEW, _OF_A_SENSOR = 12, 0.1, 0.1
# Travel in contact [m] and load [N] that are no press of a ball, whatever the size of the block, unless the unit is said once
# more; what share of the change of the load tells contact, and the share of readings at either end that may be damaged.
_LONG, _HEAVY, _CONTACT, _ENDS = 0.1, 1e5, 0.2, 0.02
# What a pressed sensor rarely has, written in whole numbers of so many digits at least; cells that show it.
_WHOLE = {"capacitance": (1e-8, 5), "capacitance_series": (1e-8, 5), "force": (1e3, 4)}
_SHOWN = 500
# Before three digits, what sets thousands apart where the other mark is the decimal one.
_SETS_APART = {mark: re.compile(rf"(?<=\d)[{apart}{SPACES}](?=\d{{3}}(?!\d))") for mark, apart in ((".", ","), (",", "."))}
# Days of a calendar go up from nearly each row to the next.
_UP = 0.98

# Where a press is left without it.
_LEAVE_OUT = "; or name another column of the capacitance, or leave it out: --columns capacitance=none"


def is_usual_alone(quantity: str, largest: float) -> bool:
    """Whether a largest reading is one that a press of a soft sensor has, and a thousand times as much is not.

    Parameters
    ----------
    quantity : of any sort; all sizes of one without limits are usual as they are.
    largest : [SI].

    >>> is_usual_alone("capacitance", 97e-12), is_usual_alone("capacitance", 97e-15), is_usual_alone("force", 6.0)
    (True, False, True)
    """
    if quantity not in _USUAL:
        return True
    low, high = _USUAL[quantity]
    return low <= largest <= high and not low <= 1000 * largest <= high


def implausible(
    sheet: Sheet,
    values: Mapping[str, FloatArray],
    places: Mapping[str, int],
    decimals: Mapping[str, str],
    reading: Reading,
) -> list[Fault]:
    """List the columns whose largest reading is too small or too large for a small soft sample, and negative capacitances.

    Parameters
    ----------
    sheet : the record.
    values : quantity -> readings in SI, nan where there is none.
    places : quantity -> index of its column.
    decimals : quantity -> decimal mark of its column.
    reading : with `scale`.
    """
    faults = []
    limits = MICRO if reading.scale == "micro" else PLAUSIBLE
    for quantity, (low, high) in limits.items():
        if quantity not in values:
            continue
        size = np.abs(values[quantity])
        size = np.where(np.isfinite(size), size, 0.0)
        row = int(np.argmax(size))
        top = float(size[row])
        shown = stands_for(quantity)
        said_again = bool({quantity, shown} & set(reading.units))
        high = _LARGE if shown == "capacitance" and not said_again else high
        if top == 0.0 or low <= top <= high:
            continue
        advice = f"Check its unit; say the right one by --units {shown}=..."
        if shown == "capacitance" and _LARGE < top <= limits[quantity][1]:
            advice += f"; if it is right, say it once more: --units {shown}={sheet.unit_written(places[quantity]) or 'F'}"
        if top < low and top >= MICRO[quantity][0] and reading.scale != "micro":
            advice += ". If the instrument measures nanometres and micronewtons: --scale micro"
        name = sheet.names[places[quantity]]
        faults.append(
            Fault(
                f'column "{name}": the largest reading would be {top:.3g} {SI_UNIT[quantity]}, '
                "which no test of a small sample gives",
                sheet.text.path,
                int(sheet.lines[row]),
                places[quantity] + 1,
                advice=advice,
            )
        )
    faults = faults or _negative(sheet, values, places) or _date(sheet, values, places)
    return faults or _without_marks(sheet, values, places, decimals, reading)


def _date(sheet: Sheet, values: Mapping[str, FloatArray], places: Mapping[str, int]) -> list[Fault]:
    """Find days of a spreadsheet or of MATLAB under the name of a force: they go up in every row, by less than one in all."""
    force = values.get("force", np.zeros(0))
    force = force[np.isfinite(force)]
    if force.size < _FEWEST or np.mean(np.diff(force) > 0) < _UP:
        return []
    for unit in (1.0, 1e-3):  # N and mN: days in kN are no force of a small sample
        if unit_of_numbers(float(force[0]) / unit) == "day" and np.ptp(force) < unit:
            name = sheet.names[places["force"]]
            message = f'column "{name}": its numbers go up from {force[0] / unit:.9g} in every row, as days since 1899 or 0 do'
            advice = (
                "If its header stands over a date, put each name over its column; or say which is which: --columns force=..."
            )
            return [Fault(message, sheet.text.path, sheet.named_at, places["force"] + 1, advice=advice)]
    return []


def no_press(sheet: Sheet, values: Mapping[str, FloatArray], places: Mapping[str, int], reading: Reading) -> list[Fault]:
    """Find a load, and a travel in contact, that are larger than those of any press of a ball.

    Parameters
    ----------
    sheet : the record.
    values : quantity -> readings in SI, nan where there is none that can be used, (n_row,).
    places : quantity -> index of its column.
    reading : what the user says of the file: a unit that is said once more is right.
    """
    if "force" not in values or np.count_nonzero(np.isfinite(values["force"])) < _FEWEST:
        return []
    force = values["force"]
    change = np.abs(force - np.nanmedian(force[np.isfinite(force)][:_FEWEST]))
    spans = {"force": (_width(force), _HEAVY)}
    if "displacement" in values:
        pressed = np.nan_to_num(change) > _CONTACT * float(np.quantile(change[np.isfinite(change)], 1 - _ENDS))
        spans["displacement"] = _width(values["displacement"][pressed]), _LONG
    faults = []
    for quantity, (span, most) in spans.items():
        if span <= most or quantity in reading.units:
            continue
        index, unit = places[quantity], SI_UNIT[quantity]
        written = sheet.unit_written(index) or unit
        faults.append(
            Fault(
                f'column "{sheet.names[index]}": it goes over {span:.3g} {unit}{" in contact" if unit == "m" else ""}, '
                "which no press of a ball does",
                sheet.text.path,
                int(sheet.lines[int(np.nanargmax(np.abs(values[quantity])))]),
                index + 1,
                advice=f"Check its unit; say the right one by --units {quantity}=...; if it is right, say it once more: "
                f"--units {quantity}={written}",
            )
        )
    return faults


def _width(values: FloatArray) -> float:
    """What readings go over, but for a few at either end; 0 for too few."""
    there = values[np.isfinite(values)]
    return float(np.ptp(np.quantile(there, [_ENDS, 1 - _ENDS]))) if there.size >= _FEWEST else 0.0


def _without_marks(
    sheet: Sheet,
    values: Mapping[str, FloatArray],
    places: Mapping[str, int],
    decimals: Mapping[str, str],
    reading: Reading,
) -> list[Fault]:
    """The faults of large readings in long whole numbers beside columns with decimals: all their marks may be lost.

    So may they be where thousands are set apart in them, by a program that took the decimal marks for that.
    """
    faults = []
    for quantity, (large, digits) in _WHOLE.items():
        shown = stands_for(quantity)
        if quantity not in values or {quantity, shown} & set(reading.units) or sheet.text.typed:
            continue
        own = sheet.columns[places[quantity]]
        rows = np.flatnonzero(np.isfinite(values[quantity]))
        # Of a capacitance all readings are large; a force begins at zero.
        size = np.abs(values[quantity][rows])
        if not rows.size or float(np.median(size) if shown == "capacitance" else np.max(size)) < large:
            continue
        spread = rows[:: max(1, rows.size // _SHOWN)].tolist()
        # Who said which mark is the decimal one has said what the other is.
        mark = "" if reading.decimal else decimals.get(quantity) or "."
        cells = [_without_thousands(own[r], mark) for r in spread]
        others = [
            c for q, i in places.items() if q != quantity for r in spread if re.search(r"[.,]\d", c := sheet.columns[i][r])
        ]
        row = int(rows[int(np.argmax(size))]) if shown == "force" else int(rows[0])
        written = own[row].strip()
        if others and all(map(str.isdigit, cells)) and len(_without_thousands(written, mark)) >= digits:
            unit = sheet.unit_written(places[quantity]) or SI_UNIT[quantity]
            lost = "lost" if written.lstrip("+-\u2212").isdigit() else "taken for marks of thousands, as by a spreadsheet"
            faults.append(
                Fault(
                    f'column "{sheet.names[places[quantity]]}": "{written}" would be {values[quantity][row]:.3g} '
                    f"{SI_UNIT[quantity]}, written in whole numbers beside decimals: the decimal marks may be {lost}",
                    sheet.text.path,
                    int(sheet.lines[row]),
                    places[quantity] + 1,
                    advice="Export the file again from the instrument's software; if the numbers are whole, say their unit "
                    f"once more: --units {shown}={unit}; if all have lost as many decimals, with their number: "
                    f'--units "{shown}=1e-... {unit}"',
                )
            )
    return faults


def _without_thousands(cell: str, decimal: str) -> str:
    """The digits of a whole number, without its sign and what sets thousands apart in it, beside this decimal mark, if any.

    >>> _without_thousands("-25.832", ","), _without_thousands("25.832", "."), _without_thousands("1'025'832", ".")
    ('25832', '25.832', '1025832')
    """
    digits = cell.strip().lstrip("+-\u2212")
    return _SETS_APART[decimal].sub("", digits) if decimal else digits


def only_changes(sheet: Sheet, values: Mapping[str, FloatArray], places: Mapping[str, int], reading: Reading) -> list[Fault]:
    """The fault of a capacitance that is near zero in some rows and many times that in others: a change, not what was there.

    Parameters
    ----------
    sheet : the record.
    values : quantity -> readings in SI, nan where there is none.
    places : quantity -> index of its column.
    reading : a unit that is said once more is not doubted.
    """
    for quantity in ("capacitance", "capacitance_series"):
        # Of two the user chooses.
        alone = quantity in values and not {"capacitance", "capacitance_series"} <= set(values)
        there = values[quantity][np.isfinite(values[quantity])] if alone else np.zeros(0)
        if there.size < _FEWEST or {quantity, "capacitance"} & set(reading.units):
            continue
        low, high = np.quantile(there, [_FEW, 1 - _FEW])
        if low > _OF_A_SENSOR * high:
            continue
        row = int(np.nanargmin(values[quantity]))
        index = places[quantity]
        advice = _names_exchanged(sheet, values, places, index) or (
            "Export what the meter read, without a reference or an offset taken off; if it is all of it, say its "
            f"unit once more: --units capacitance=...{_LEAVE_OUT if {'displacement', 'force'} <= set(values) else ''}"
        )
        return [
            Fault(
                f'column "{sheet.names[index]}" goes from {low:.3g} to {high:.3g} F, which no sensor does that is pressed: it '
                "seems to be a change, without what was there before",
                sheet.text.path,
                int(sheet.lines[row]),
                index + 1,
                advice=advice,
            )
        ]
    return []


def _names_exchanged(sheet: Sheet, values: Mapping[str, FloatArray], places: Mapping[str, int], index: int) -> str:
    """What to do where the force stays as far from zero as a capacitance does: the two may bear each other's names."""
    force = values["force"][np.isfinite(values["force"])] if "force" in values else np.zeros(0)
    if force.size < _FEWEST or float(np.min(force)) <= _NEVER_NEAR_ZERO * float(np.max(force)):
        return ""
    own, other = places["force"], index
    columns = [Choice("columns", (sheet.name_for_asking(i),), q) for q, i in (("force", other), ("capacitance", own))]
    units = [
        Choice("units", (sheet.unit_written(i) or unit,), q)
        for q, i, unit in (("force", own, "N"), ("capacitance", other, "pF"))
    ]
    return (
        f'"{sheet.names[own]}" goes from {np.min(force):.4g} to {np.max(force):.4g} N and is never near zero, as a capacitance '
        f"is not: the two seem to have each other's names. If so: {' '.join(map(str, (*columns, *units)))}; if not, take the "
        "weight off the force and export what the meter read, without a reference taken off"
    )


def _negative(sheet: Sheet, values: Mapping[str, FloatArray], places: Mapping[str, int]) -> list[Fault]:
    """The fault of a capacitance that is below zero in most rows: a difference from another one, or no sensor at the meter."""
    for quantity in ("capacitance", "capacitance_series"):
        below = values[quantity] < 0 if quantity in values else np.zeros(0, dtype=bool)
        if 2 * np.count_nonzero(below) > np.count_nonzero(np.isfinite(values.get(quantity, below))):
            row = int(np.argmax(below))
            index = places[quantity]
            return [
                Fault(
                    f'column "{sheet.names[index]}": "{sheet.columns[index][row].strip()}" is negative, as are most of its '
                    "readings, which no capacitance is",
                    sheet.text.path,
                    int(sheet.lines[row]),
                    index + 1,
                    advice="Export what the meter read, without a reference or an offset taken off"
                    + (_LEAVE_OUT if {"displacement", "force"} <= set(values) else ""),
                )
            ]
    return []

"""A field of a deformed sensor in, how it becomes colours out: unit, range and colour map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import ListedColormap

from models.fem.fields import Fields, sheet

#: What a picture can be coloured by; see `models.fem.fields.Fields`.
FieldName = Literal["pressure", "thickness_stretch", "largest_stretch"]
_LABELS = {
    "pressure": "pressure",
    "thickness_stretch": "stretch through the thickness",
    "largest_stretch": "largest principal stretch",
}
#: Where each field is at rest, and whether compression is below (-1) or above (1) that.
_RESTS = {"pressure": (0.0, 1), "thickness_stretch": (1.0, -1), "largest_stretch": (1.0, 1)}


@dataclass(frozen=True)
class Scale:
    """How a field becomes a colour: `factor` times SI is shown, from `low` to `high`; `extend` says what lies beyond."""

    label: str
    factor: float
    low: float
    high: float
    extend: Literal["neither", "min", "max", "both"]
    colours: ListedColormap


def scale_of(fields: Fields, field: FieldName, half: float) -> Scale:
    """Choose the colours of a field so that they span what is shown, but for the extreme 0.2 % of its area.

    Parameters
    ----------
    fields : of one step of a solution.
    field : which of them.
    half : [m], the radius up to which the sensor is shown.

    Raises
    ------
    ValueError
        If there is no such field.
    """
    if field not in _LABELS:
        raise ValueError(f"there is no field {field!r}; there are {', '.join(_LABELS)}")
    values = np.asarray(getattr(fields, field))
    seen = fields.r <= half
    areas = [
        np.outer(np.gradient(sheet(fields, fields.rest_r, k)[:, 0]), np.gradient(sheet(fields, fields.rest_z, k)[0])).ravel()
        for k in range(len(fields.shapes))
    ]
    shown, area = values[seen], np.concatenate(areas)[seen]
    order = np.argsort(shown)
    share = np.cumsum(area[order])
    low, high = np.interp([0.001, 0.999], share / share[-1], shown[order])
    rest, sign = _RESTS[field]
    low, high = min(low, rest), max(high, rest)
    if high == low:
        low, high = rest - 1e-3, rest + 1e-3
    slack = 0.02 * (high - low)
    below, above = bool(np.min(shown) < low - slack), bool(np.max(shown) > high + slack)
    extend: Literal["neither", "min", "max", "both"] = (
        "both" if below and above else "min" if below else "max" if above else "neither"
    )
    factor, unit = (1.0, "") if field != "pressure" else (1e-6, " (MPa)") if max(-low, high) >= 1e6 else (1e-3, " (kPa)")
    colours = field_colours((low - rest) * sign, (high - rest) * sign)
    return Scale(_LABELS[field] + unit, factor, float(low) * factor, float(high) * factor, extend, colours)


def field_colours(start: float, end: float) -> ListedColormap:
    """Make colours for values that are at rest at 0: lightest there, darker away from it, warm above and cold below.

    Parameters
    ----------
    start, end : the values that the first and the last colour stand for, in any unit.
    """
    x = np.linspace(start, end, 512) / max(abs(start), abs(end))
    warm, cold = colormaps["magma"](1 - 0.8 * np.maximum(x, 0)), colormaps["YlGnBu"](0.85 * np.maximum(-x, 0) + 0.07)
    return ListedColormap(np.where(x[:, None] >= 0, warm, cold), name="warm and cold")

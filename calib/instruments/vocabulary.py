"""From the words and units in a header cell to the quantity they stand for."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from calib.quantity import unit_factor

#: Quantity -> SI unit. `capacitance_series` becomes `capacitance` once the dissipation is known; `status` is text.
SI_UNIT: Mapping[str, str] = MappingProxyType(
    {
        "time": "s",
        "displacement": "m",
        "force": "N",
        "capacitance": "F",
        "capacitance_series": "F",
        "dissipation": "",
        "frequency": "Hz",
        "cycle": "",
        "status": "",
    }
)

#: Quantities whose unit must be written in the file.
NEEDS_UNIT = ("time", "displacement", "force", "capacitance", "capacitance_series")

#: Example of a well-written header cell, for advice.
EXAMPLE: Mapping[str, str] = MappingProxyType(
    {
        "time": "Time (s)",
        "displacement": "Extension (mm)",
        "force": "Load (N)",
        "capacitance": "Cp (pF)",
        "capacitance_series": "Cs (pF)",
        "dissipation": "D",
        "frequency": "Frequency (Hz)",
        "cycle": "Cycle count",
        "status": "Status",
    }
)

# Quantity -> names in lower case, in order of preference where a file has several. Underscores and spaces are the same.
# The raw force comes before a corrected one: the model has the load zero as a parameter, and must see what the cell read.
_NAMES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "time": ("time", "total time", "elapsed time", "test time", "timestamp", "time stamp", "t", "zeit", "prüfzeit", "时间"),
        "displacement": (
            "extension",
            "displacement",
            "compressive extension",
            "compressive displacement",
            "crosshead",
            "crosshead displacement",
            "crosshead position",
            "crosshead travel",
            "compression",
            "indentation",
            "indentation depth",
            "depth",
            "z position",
            "position",
            "travel",
            "stroke",
            "z",
            "d",
            "traversenweg",
            "standardweg",
            "weg",
            "位移",
        ),
        "force": (
            "load",
            "force",
            "compressive load",
            "compressive force",
            "raw force",
            "raw load",
            "normal force",
            "axial force",
            "standard force",
            "fz",
            "f",
            "last",
            "kraft",
            "standardkraft",
            "prüfkraft",
            "载荷",
            "力",
            "corrected force",
            "corrected load",
        ),
        "capacitance": ("cp", "parallel capacitance", "capacitance", "cap", "c", "kapazität"),
        "capacitance_series": ("cs", "series capacitance"),
        "dissipation": ("d", "dissipation", "dissipation factor", "df", "loss tangent", "tan delta", "tan d", "tan δ", "tanδ"),
        "frequency": ("frequency", "freq", "f", "measurement frequency", "test frequency", "frequenz"),
        "cycle": ("total cycle count", "cycle count", "cycle", "total cycles", "cycles", "zyklus"),
        "status": ("status", "stat", "lcr status", "measurement status"),
    }
)

_BRACKETED = re.compile(r"^(?P<name>.*?)\s*[(\[]\s*(?P<unit>[^()\[\]]*?)\s*[)\]]\s*$", re.DOTALL)
_TAIL = re.compile(r"^(?P<name>.+?)\s*(?:_|/|,|\s)\s*(?P<unit>[^\s_/,]+)$")
_UNIT_CELL = re.compile(r"^[(\[]\s*(?P<unit>.*?)\s*[)\]]$")


@dataclass(frozen=True)
class Heading:
    """A header cell that was understood: the quantity, its preference (0 is best), and the unit in the name or None."""

    quantity: str
    rank: int
    name: str
    unit: str | None


def words(name: str) -> str:
    """The name in lower case with single spaces: `Z_Position` -> "z position"."""
    return re.sub(r"[\s_]+", " ", name.strip().lower()).strip()


def understood_names(quantity: str) -> str:
    """The names a quantity may have, for advice."""
    return ", ".join(f'"{n}"' for n in _NAMES[quantity][:6])


def convertible(unit: str, quantity: str) -> bool:
    """Whether `unit` is a unit of `quantity`."""
    try:
        unit_factor(unit, SI_UNIT[quantity])
    except ValueError:
        return False
    return True


def understand(cell: str, unit_below: str = "") -> Heading | None:
    """The quantity a header cell stands for, or None.

    Parameters
    ----------
    cell : such as "Load", "Load (N)", "CP[F]", "force_N".
    unit_below : unit in a units row under the cell, "" if none. It decides where a letter means two things (D, d, F, f).

    >>> understand("Compressive load (kN)")
    Heading(quantity='force', rank=2, name='compressive load', unit='kN')
    >>> understand("d", "mm").quantity, understand("D").quantity
    ('displacement', 'dissipation')
    """
    match = _BRACKETED.match(cell)
    name, unit = (match["name"], match["unit"] or None) if match else (cell, None)
    found = _lookup(words(name), unit or unit_below)
    if found is not None:
        return Heading(*found, words(name), unit)
    tail = None if match else _TAIL.match(cell.strip())
    if tail is not None:
        found = _lookup(words(tail["name"]), tail["unit"])
        if found is not None and convertible(tail["unit"], found[0]):
            return Heading(*found, words(tail["name"]), tail["unit"])
    return None


def _lookup(name: str, unit: str) -> tuple[str, int] | None:
    found = [(quantity, names.index(name)) for quantity, names in _NAMES.items() if name in names]
    if len(found) > 1:
        fitting = [f for f in found if (bool(unit) or not SI_UNIT[f[0]]) and convertible(unit, f[0])]
        return fitting[0] if fitting else None
    return found[0] if found else None


def unit_of_cell(cell: str) -> str | None:
    """The unit in a cell of a units row, "" if the cell is empty, None if it cannot be a unit.

    >>> unit_of_cell("(mm)"), unit_of_cell("kN"), unit_of_cell("0.5")
    ('mm', 'kN', None)
    """
    cell = cell.strip()
    if not cell:
        return ""
    match = _UNIT_CELL.match(cell)
    if match:
        return match["unit"]
    if not any(c.isdigit() for c in cell) and any(convertible(cell, q) for q in SI_UNIT):
        return cell
    return None

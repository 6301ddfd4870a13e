"""From the words and units in a header cell to the quantity they stand for."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

from calib.lab.instruments.units import SI_UNIT, is_unit_of, looks_like_unit

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

# Quantity -> names in lower case, in order of preference where a file has several; a bar sets names apart. Underscores and
# spaces are the same. The raw force comes before a corrected one: the model has the load zero as a parameter, and must see what
# the cell read.
_NAMES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        quantity: tuple(name.strip() for name in " | ".join(lines).split("|"))
        for quantity, lines in {
            "time": (
                "time | total time | running time | elapsed time | test time | timestamp | time stamp | t",
                "zeit | prüfzeit | laufzeit | testzeit | messzeit",
                "temps | temps écoulé | durée | tiempo | tiempo transcurrido",
                "时间 | 時間 | 试验时间 | 試験時間 | 経過時間 | 時刻",
                "cycle elapsed time",
            ),
            "displacement": (
                "extension | displacement | compressive extension | compressive displacement | crosshead",
                "crosshead displacement | crosshead position | crosshead travel | crosshead extension",
                "axial displacement | digital position | compression | indentation | indentation depth | depth | z position",
                "position | travel | standard travel | stroke | axial position | distance | deflection | deformation | disp",
                "z | d",
                "standardweg | traversenweg | weg | verschiebung | verformung | eindringtiefe | maschinenweg",
                "déplacement | deplacement | traverse | enfoncement | course",
                "desplazamiento | extensión | posición | recorrido | deformación",
                "位移 | 横梁位移 | 变形 | 変位 | ストローク | 変位量 | 伸び",
                "traversenweg absolut",
            ),
            "force": (
                "load | force | compressive load | compressive force | raw force | raw load | normal force",
                "axial force | axial load | standard force | fz | f",
                "standardkraft | kraft | prüfkraft | last | druckkraft | normalkraft | axialkraft",
                "charge | effort | force de compression | fuerza | carga",
                "载荷 | 荷载 | 负荷 | 力 | 试验力 | 試験力 | 荷重",
                "corrected force | corrected load",
            ),
            "capacitance": (
                "cp | parallel capacitance | capacitance | cap | c",
                "kapazität | capacité | capacitancia | capacidad | 电容 | 静電容量 | 電容",
            ),
            "capacitance_series": ("cs | series capacitance",),
            "dissipation": (
                "d | dissipation | dissipation factor | df | loss tangent | loss factor | tan delta | tan d | tan δ | tanδ",
                "verlustfaktor | tangente de pertes | facteur de pertes | factor de disipación | 损耗 | 損失係数 | 损耗因子",
            ),
            "frequency": (
                "frequency | freq | f | measurement frequency | test frequency",
                "frequenz | fréquence | frecuencia | 频率 | 周波数",
            ),
            "cycle": (
                "total cycle count | cycle count | cycle | total cycles | elapsed cycles | cycles | axial count",
                "zyklus | zyklen | ciclo | ciclos | 循环 | サイクル",
            ),
            "status": ("status | stat | lcr status | measurement status | ステータス | 状态",),
        }.items()
    }
)

_CELL = re.compile(r"^(?P<name>.*?)\s*[(\[{]\s*(?P<unit>[^()\[\]{}]*?)\s*[)\]}]\s*$", re.DOTALL)
_CHANNEL = re.compile(r"^(?P<name>[^(\[]+?)\s*[(\[][^()\[\]]*(?:\([^()]*\)[^()\[\]]*)*[)\]]$")
_TAIL = re.compile(r"^(?P<name>.+?)\s*(?:_|/|,|:|\sin\s|\s)\s*(?P<unit>[^\s_/,:]+)$")
_UNIT_CELL = re.compile(r"^[(\[{]\s*(?P<unit>.*?)\s*[)\]}]$")


@dataclass(frozen=True)
class Heading:
    """A header cell that was understood: the quantity, its preference (0 is best), and the unit in the name or None."""

    quantity: str
    rank: int
    name: str
    unit: str | None


def words(name: str) -> str:
    """Write a name in lower case with single spaces: `Z_Position` -> "z position"."""
    return re.sub(r"[\s_]+", " ", unicodedata.normalize("NFKC", name).strip().lower()).strip(" .:")


def understood_names(quantity: str) -> str:
    """List the names that a quantity may have in a header, for advice."""
    return ", ".join(f'"{n}"' for n in _NAMES[quantity][:6])


@lru_cache(maxsize=4096)
def understand(cell: str, unit_below: str = "") -> Heading | None:
    """Tell what a column holds from its header cell, in any of the languages and spellings that are known.

    Parameters
    ----------
    cell : such as "Load", "Load (N)", "CP[F]", "force_N", "Position(Linear:Digital Position) (mm)".
    unit_below : unit in a units row under the cell, "" if none. It decides where a letter means two things (D, d, F, f).

    Returns
    -------
    None if the cell is not understood.

    >>> understand("Compressive load (kN)")
    Heading(quantity='force', rank=2, name='compressive load', unit='kN')
    >>> understand("d", "mm").quantity, understand("D").quantity
    ('displacement', 'dissipation')
    """
    cell = unicodedata.normalize("NFKC", cell).strip()
    if len(cell) > 120:
        return None
    match = _CELL.match(cell)
    name, unit = (match["name"], match["unit"] or None) if match else (cell, None)
    found = _lookup(words(name), unit or unit_below)
    if found is None and (channel := _CHANNEL.match(name if match else cell)):
        # The channel's wiring in brackets after its name, as "Load(8800 (0,1):Load) (kN)".
        name = channel["name"]
        found = _lookup(words(name), unit or unit_below)
    if found is not None:
        return Heading(*found, words(name), unit)
    tail = None if match else _TAIL.match(cell)
    if tail is not None:
        found = _lookup(words(tail["name"]), tail["unit"])
        if found is not None and is_unit_of(tail["unit"], found[0]):
            return Heading(*found, words(tail["name"]), tail["unit"])
    return None


def _lookup(name: str, unit: str) -> tuple[str, int] | None:
    found = [(quantity, names.index(name)) for quantity, names in _NAMES.items() if name in names]
    if len(found) > 1:
        fitting = [f for f in found if (bool(unit) or not SI_UNIT[f[0]]) and is_unit_of(unit or "-", f[0])]
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
    return cell if looks_like_unit(cell) else None

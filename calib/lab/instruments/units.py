"""From a unit as a lab file writes it to its SI factor: only spellings listed here, as a wrong case is a factor of 1,000."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
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

# SI unit -> what `unit_factor` is asked for -> spellings. "MM" or "KN" can only mean one thing on a lab's instrument; "MN" and
# "PF" may be meant for "mN" and "pF" and are not listed.
_SPELLINGS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "s": {
            "s": "s S sec secs Sec Secs SEC second seconds Seconds sek Sek Sekunden seconde secondes segundo segundos 秒",
            "ms": "ms msec msecs millisecond milliseconds Millisekunden 毫秒 ミリ秒",
            "us": "us µs microseconds",
            "min": "min mins minute minutes Min MIN Minutes Minuten minuto minutos 分 分钟",
            "hour": "h hr hrs hour hours Stunden heures horas 小时 時間",
        },
        "m": {
            "m": "m meter meters metre metres Meter mètres metros 米",
            "cm": "cm centimeter centimeters",
            "mm": "mm MM millimeter millimeters millimetre millimetres Millimeter 毫米 ミリ",
            "um": "um µm UM micron microns micrometer micrometers micrometre micrometres Mikrometer 微米",
            "nm": "nm nanometer nanometers",
            "in": 'in inch inches In IN Inch Inches " Zoll pouces pulgadas 英寸',
            "thou": "mil mils thou",
        },
        "N": {
            "N": "N newton newtons Newton Newtons 牛 牛顿",
            "mN": "mN millinewton millinewtons",
            "uN": "uN µN",
            "kN": "kN KN kilonewton kilonewtons 千牛",
            "gf": "gf gF gF. grf gram-force gramforce",
            "kgf": "kgf kgF kp KGF kilogram-force",
            "lbf": "lbf lbF LBF lb-f pound-force",
            "ounce_force": "ozf ozF OZF",
            "cN": "cN",
        },
        "F": {
            "F": "F farad farads Farad 法拉",
            "mF": "mF",
            "uF": "uF µF",
            "nF": "nF",
            "pF": "pF picofarad picofarads 皮法",
            "fF": "fF",
        },
        "Hz": {"Hz": "Hz HZ hz hertz Hertz 赫兹", "kHz": "kHz KHz kHZ KHZ", "MHz": "MHz"},
        "": {"": "- 1 – — [-] none cycles # x"},
    }
)


def _tidy(unit: str) -> str:
    return re.sub(r"\s+", " ", unicodedata.normalize("NFKC", unit)).strip().replace("μ", "µ")


_BY_SPELLING: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        si: MappingProxyType({word: asked for asked, words in table.items() for word in words.split(" ")})
        for si, table in _SPELLINGS.items()
    }
)

# What is meant when a mass stands where a force is.
_AS_FORCE = {
    "g": "gf",
    "gr": "gf",
    "gram": "gf",
    "grams": "gf",
    "kg": "kgf",
    "lb": "lbf",
    "lbs": "lbf",
    "oz": "ozf",
    "gm": "gf",
}


def lab_factor(unit: str, quantity: str) -> float:
    """What to multiply a column by to have it in SI, from its unit as the lab file writes it.

    Parameters
    ----------
    unit : as written.
    quantity : one of `SI_UNIT`.

    >>> lab_factor("kN", "force"), lab_factor("μm", "displacement"), lab_factor("%", "dissipation")
    (1000.0, 1e-06, 0.01)

    Raises
    ------
    ValueError
        If the spelling is not known, with what may have been meant.
    """
    si, tidy = SI_UNIT[quantity], _tidy(unit)
    if si == "" and tidy == "%":
        return 0.01
    asked = _BY_SPELLING[si].get(tidy)
    if asked is None:
        raise ValueError(f'unknown unit "{unit}" of {quantity.removesuffix("_series")}{_hint(tidy, si)}')
    return unit_factor(asked, si)


def _hint(unit: str, si: str) -> str:
    if si == "N" and unit.lower() in _AS_FORCE:
        meant = _AS_FORCE[unit.lower()]
        return f" (a mass; if its weight is meant: --units force={meant})"
    alike = sorted({word for word in _BY_SPELLING[si] if word.lower() == unit.lower()})
    return f", did you mean {' or '.join(alike)}?" if alike else ""


def is_unit_of(unit: str, quantity: str) -> bool:
    """Whether a word is a known spelling of a unit of a quantity.

    Parameters
    ----------
    unit : as written.
    quantity : one of `SI_UNIT`.
    """
    try:
        lab_factor(unit, quantity)
    except ValueError:
        return False
    return True


def looks_like_unit(text: str) -> bool:
    """Whether a cell reads as a unit of anything that lab files hold, also of what is not used here (MPa, %, °C, N/mm).

    >>> looks_like_unit("kPa"), looks_like_unit("N·m"), looks_like_unit("abc")
    (True, True, False)
    """
    tidy = _tidy(text)
    return any(tidy in words for words in _BY_SPELLING.values()) or _OTHER_UNIT.fullmatch(tidy) is not None or tidy in _AS_FORCE


_OTHER_UNIT = re.compile(
    r"%|°|°?[CFK]|deg|rad|[kMG]?Pa|[mk]?V|[mk]?A|[mk]?W|[mk]?J|[mkM]?(?:Ω|ohm|Ohm)|[mµu]?S|psi|ksi|bar|N/mm²?|N/mm\^?2|"
    r"[mµ]?m/(?:s|min)|mm²|mm\^?2|N[·.*]?m|mm/mm|%/(?:s|min)|1/s|[mµun]?H|dB"
)

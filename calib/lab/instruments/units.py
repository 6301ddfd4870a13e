"""From a unit as a lab file writes it to its SI factor: only spellings listed here, as a wrong case is a factor of 1,000."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping
from decimal import Decimal
from functools import cache
from types import MappingProxyType

from calib.quantity import unit_factor

#: Quantity -> SI unit. `capacitance_series` becomes `capacitance` once the dissipation is known, `quality` is its inverse;
#: `status` is text.
SI_UNIT: Mapping[str, str] = MappingProxyType(
    {
        "time": "s",
        "displacement": "m",
        "force": "N",
        "capacitance": "F",
        "capacitance_series": "F",
        "dissipation": "",
        "quality": "",
        "frequency": "Hz",
        "cycle": "",
        "status": "",
    }
)

#: Quantities that a file may hold in place of another, which they become.
IN_PLACE_OF: Mapping[str, str] = MappingProxyType({"capacitance_series": "capacitance", "quality": "dissipation"})

# SI unit -> what `unit_factor` is asked for -> spellings. "MM" or "KN" can only mean one thing on a lab's instrument; "MN" and
# "PF" may be meant for "mN" and "pF" and are not listed.
_SPELLINGS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "s": {
            "s": "s S sec secs Sec Secs SEC second seconds Seconds sek Sek Sekunden seconde secondes "
            "segundo segundos secondi sekunda sekundy seg sn saniye mp másodperc sekuntia sekunder с сек 秒 초",
            "ms": "ms msec msecs millisecond milliseconds Millisekunden мс 毫秒 ミリ秒 밀리초",
            "us": "us µs microseconds",
            "ns": "ns nanoseconds",
            "min": "min mins minute minutes Min MIN Minutes Minuten minuto minutos minuti minuty мин 分 分钟 분",
            "day": "d day days Tag Tage jour jours día días giorni dni 天 日",
            "hour": "h hr hrs hour hours Hour Hours Stunden heures horas ore godziny 小时 時間 시간",
        },
        "m": {
            "m": "m meter meters metre metres Meter mètres metros 米",
            "cm": "cm centimeter centimeters",
            "mm": "mm MM millimeter millimeters millimetre millimetres Millimeter "
            "Millimetern millimètres milímetros millimetri milimetry мм 毫米 公厘 ミリ 밀리미터",
            "um": "um µm UM micron microns micrometer micrometers micrometre micrometres Mikrometer мкм 微米",
            "nm": "nm nanometer nanometers",
            "in": 'in inch inches In IN Inch Inches " Zoll pouces pulgadas 英寸',
            "thou": "mil mils thou",
        },
        "N": {
            "N": "N newton newtons Newton Newtons niuton niutony nyuton Н Ν 牛 牛顿 牛頓 뉴턴",
            "mN": "mN millinewton millinewtons мН",
            "uN": "uN µN micronewton micronewtons",
            "nN": "nN nanonewton nanonewtons",
            "kN": "kN KN kilonewton kilonewtons кН 千牛 킬로뉴턴",
            "gf": "gf gF gF. grf gram-force gramforce pond гс",
            "kgf": "kgf kgF kp KGF kilogram-force kilopond кгс",
            "lbf": "lbf lbF LBF lb-f pound-force lb lbs Lb Lbs LB LBS",
            "ounce_force": "ozf ozF OZF",
            "cN": "cN",
            "dN": "dN",
            "daN": "daN DaN dekanewton decanewton décanewton",
        },
        "F": {
            "F": "F farad farads Farad 法拉",
            "mF": "mF",
            "uF": "uF µF",
            "nF": "nF",
            "pF": "pF picofarad picofarads пФ 皮法",
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
    "oz": "ozf",
    "gm": "gf",
}


# A power of ten before a unit: "10^-3 N", "1e-12 F", "x10\u207b\u00b3 mm" (which NFKC writes 10\u22123).
_POWER = re.compile(
    r"(?:[x×*]\s?)?(?:10(?:(?:\^|\*\*) ?(?P<ten>[+-]?\d{1,2})|(?P<up>[+-]\d{1,2}))|(?:1(?:\.0*)?)?[eE](?P<e>[+-]?\d{1,2}))"
    r"(?:[ *·] ?(?P<unit>.+))?"
)
# Any factor, which the user may give.
_TIMES = re.compile(r"(?:[x×*]\s?)?(?P<number>\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)\s?(?P<unit>\D.*)?")
_SHARES = {"%": 1e-2, "‰": 1e-3, "ppm": 1e-6}


def lab_factor(unit: str, quantity: str) -> float:
    """What to multiply a column by to have it in SI, from its unit as the lab file writes it.

    Parameters
    ----------
    unit : as written; a power of ten may stand before it, as in "10^-3 N".
    quantity : one of `SI_UNIT`.

    >>> lab_factor("kN", "force"), lab_factor("μm", "displacement"), lab_factor("%", "dissipation")
    (1000.0, 1e-06, 0.01)
    >>> lab_factor("1e-12 F", "capacitance"), lab_factor("x1e-3", "dissipation")
    (1e-12, 0.001)

    Raises
    ------
    ValueError
        If the spelling is not known, with what may have been meant.
    """
    si, tidy = SI_UNIT[quantity], _tidy(unit)
    if si == "" and tidy in _SHARES:
        return _SHARES[tidy]
    asked = _BY_SPELLING[si].get(tidy)
    if asked is not None:
        return unit_factor(asked, si)
    power = _POWER.fullmatch(tidy.replace("\u2212", "-"))
    if power is not None and (not si or power["unit"]):
        exponent = int(power["ten"] or power["up"] or power["e"])
        return float(Decimal(repr(lab_factor(power["unit"] or "-", quantity))).scaleb(exponent))
    raise ValueError(f'unknown unit "{unit}" of {quantity.removesuffix("_series")}{_hint(tidy, si)}')


def asked_factor(unit: str, quantity: str) -> float:
    """What to multiply a column by to have it in SI, from its unit as a user says it: also "10 N", tens of newtons.

    Parameters
    ----------
    unit : a unit, or a number and a unit.
    quantity : one of `SI_UNIT`.

    >>> asked_factor("10 N", "force"), asked_factor("0.1 pF", "capacitance"), asked_factor("kN", "force")
    (10.0, 1e-13, 1000.0)

    Raises
    ------
    ValueError
        As `lab_factor`.
    """
    times = _TIMES.fullmatch(_tidy(unit))
    if times is None or is_unit_of(unit, quantity):
        return lab_factor(unit, quantity)
    number = Decimal(times["number"])
    if not number:
        raise ValueError(f'a unit of nothing, "{unit}"')
    return float(number * Decimal(repr(lab_factor(times["unit"] or "-", quantity))))


# Units between which testers and meters are switched, one in each system that is not decimal; SI unit -> units.
_SWITCHED = {
    "N": ("N", "mN", "kN", "gf", "kgf", "lbf"),
    "m": ("m", "mm", "um", "in"),
    "s": ("s", "ms", "min", "hour"),
}


@cache
def unit_ratios(quantity: str) -> tuple[tuple[float, str], ...]:
    """By what readings jump where the unit is switched, other than powers of ten, with the units in words.

    >>> [(round(ratio, 4), words) for ratio, words in unit_ratios("force")][:2]
    [(101.9716, 'gf after N'), (0.102, 'kgf after N')]
    """
    si = SI_UNIT[quantity]
    found: list[tuple[float, str]] = []
    for before in _SWITCHED.get(si, ()):
        for after in _SWITCHED[si]:
            ratio = unit_factor(before, si) / unit_factor(after, si)
            known = any(math.isclose(ratio, r, rel_tol=1e-9) for r, _ in found)
            if not known and not math.isclose(math.log10(ratio), round(math.log10(ratio)), abs_tol=1e-9):
                names = [_NAME_OF.get(unit, unit) for unit in (after, before)]
                found.append((ratio, " after ".join(names)))
    return tuple(found)


_NAME_OF = {"hour": "h"}


def _hint(unit: str, si: str) -> str:
    if si == "N" and unit.lower() in _AS_FORCE:
        meant = _AS_FORCE[unit.lower()]
        return f" (a mass; if the weight of so much is meant, say --units force={meant})"
    alike = sorted({word for word in _BY_SPELLING[si] if word.lower() == unit.lower()})
    return f", did you mean {' or '.join(alike)}?" if alike else ""


def is_pound(unit: str) -> bool:
    """Whether a unit of force is written as pounds, without a word of force: on a tester a pound is one."""
    return _tidy(unit).lower() in ("lb", "lbs")


def is_mass(unit: str) -> bool:
    """Whether a word is a unit of mass, which may stand where a force is meant."""
    return _tidy(unit).lower() in _AS_FORCE


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
    known = tidy in _AS_FORCE or tidy in _SHARES or any(tidy in words for words in _BY_SPELLING.values())
    return known or _OTHER_UNIT.fullmatch(tidy) is not None


_OTHER_UNIT = re.compile(
    r"%|°|°?[CFK]|deg|rad|[kMG]?Pa|[mkµu]?V|[mkµun]?A|[mk]?W|[mk]?J|[mkMG]?(?:Ω|ohms?|Ohms?|OHM)|[mµu]?S|psi|ksi|m?bar|N/mm²?|"
    r"N/mm\^?2|N/m|[mµ]?m/(?:s|min)|mm/sec|mm²|mm\^?2|N[·.* -]?mm?|mm/mm|%/(?:s|min)|1/s|[mµun]?H|dB|[pnµu]C|deg ?[CF]|"
    r"° ?[CFK]|rpm"
)

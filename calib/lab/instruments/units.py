"""From a unit as a lab file writes it to its SI factor: only spellings listed here, as a wrong case is a factor of 1,000."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Mapping
from decimal import Decimal
from functools import cache, lru_cache
from types import MappingProxyType

from calib.quantity import unit_factor

#: What a record holds, by the names of the quantities.
RECORDED = ("time", "displacement", "force", "capacitance")

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


def stands_for(quantity: str) -> str:
    """The quantity that one becomes, and that the user says for it; itself for most.

    >>> stands_for("capacitance_series"), stands_for("force")
    ('capacitance', 'force')
    """
    return IN_PLACE_OF.get(quantity, quantity)


# SI unit -> what `unit_factor` is asked for -> spellings, the usual one first. "MM" or "KN" can only mean one thing on a lab's
# instrument; "MN" and "PF" may be meant for "mN" and "pF" and are not listed. A mass stands for its weight.
_SPELLINGS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        "s": {
            "s": "s S sec secs Sec Secs SEC second seconds Seconds sek Sek Sekunden seconde secondes "
            "segundo segundos secondi sekunda sekundy seg sn saniye mp másodperc sekuntia sekunder sekund sekondes "
            "secunde segons sekundės detik giây с сек секунды секунда δευτ δευτερόλεπτα วินาที ثانية ثانیه שניות सेकंड 秒 초",
            "ms": "ms msec msecs mSec MSEC millis millisecond milliseconds Millisekunden millisecondes milisegundos "
            "millisecondi мс 毫秒 ミリ秒 밀리초",
            "cs": "cs csec centisecond centiseconds Zentisekunden centésimas",
            "us": "us µs usec µsec micros microsecond microseconds Mikrosekunden microsecondes мкс 微秒 マイクロ秒",
            "ns": "ns nsec nanosecond nanoseconds Nanosekunden",
            "min": "min mins minute minutes Min MIN Minutes Minuten minuto minutos minuti minuty мин 分 分钟 분",
            "day": "d day days Tag Tage jour jours día días giorni dni 天 日",
            "hour": "h H hr hrs Hr Hrs HR HRS hour hours Hour Hours Stunde Stunden heure heures hora horas ore godziny 小时 "
            "時間 시간",
        },
        "m": {
            "m": "m meter meters metre metres Meter mètres metros 米",
            "dm": "dm decimeter decimeters decimetre decimetres",
            "cm": "cm CM centimeter centimeters centimetre centimetres Zentimeter",
            "mm": "mm MM Mm millimeter millimeters millimetre millimetres Millimeter "
            "Millimetern millimètres milímetros millimetri milimetry мм 毫米 公厘 公釐 ミリ 밀리미터",
            "um": "um µm UM micron microns Mikron micrometer micrometers micrometre micrometres Mikrometer micromètres "
            "micrómetros микрон микрометр мкм 微米 マイクロメートル 마이크로미터",
            "nm": "nm nanometer nanometers nanometre nanometres Nanometer",
            "angstrom": "Å angstrom angstroms Angstrom Angstroms ångström ångströms Ångström Ångströms",
            "in": "in inch inches In IN Inch Inches \" '' ′′ ” Zoll pouce pouces pulgada pulgadas pollici 英寸",
            "thou": "mil mils thou thous",
            "microinch": "uin µin uinch µinch microinch microinches",
            "ft": "ft foot feet",
        },
        "N": {
            "N": "N newton newtons Newton Newtons niuton niutony nyuton Н Ν 牛 牛顿 牛頓 뉴턴",
            "mN": "mN millinewton millinewtons Millinewton мН 毫牛 밀리뉴턴",
            "uN": "uN µN micronewton micronewtons Mikronewton мкН 微牛",
            "nN": "nN nanonewton nanonewtons",
            "kN": "kN KN kilonewton kilonewtons кН 千牛 킬로뉴턴",
            "cN": "cN centinewton centinewtons",
            "dN": "dN decinewton decinewtons",
            "daN": "daN DaN dekanewton decanewton décanewton",
            "gf": "gf gF gF. grf g-f gwt gram-force grams-force gramforce gram_force pond гс "
            "g gm gms gram grams Gramm gramme grammes gramo gramos grammi gramy г 克 グラム 그램",
            "kgf": "kgf kgF kp KGF Kgf KgF kg-f kgwt kilogram-force kilograms-force kilogramforce kilogram_force kilopond кгс "
            "kg Kg KG kgs kilo kilos kilogram kilograms Kilogramm kilogramme kilogrammes kilogramo kilogramos кг 千克 公斤 "
            "キログラム 킬로그램",
            "milligram_force": "mgf mg milligram milligrams Milligramm 毫克",
            "lbf": "lbf lbF LBF lb-f lbsf pound-force pounds-force lb lbs Lb Lbs LB LBS pound pounds",
            "ounce_force": "ozf ozF OZF oz-f ounce-force oz Oz OZ ounce ounces",
            "dyn": "dyn dyne dynes",
            "poundal": "pdl poundal poundals",
            "kip": "kip kips",
        },
        "F": {
            "F": "F farad farads Farad 法拉",
            "mF": "mF millifarad millifarads",
            "uF": "uF µF uf µf ufd µfd microfarad microfarads Mikrofarad mikrofarad мкФ 微法",
            "nF": "nF nf nfd nanofarad nanofarads Nanofarad нФ 纳法",
            "pF": "pF pf pfd uuF µµF uufd µµfd mmfd picofarad picofarads Picofarad Pikofarad pikofarad пФ 皮法",
            "fF": "fF femtofarad femtofarads Femtofarad",
            "aF": "aF attofarad attofarads",
        },
        "Hz": {"Hz": "Hz HZ hz hertz Hertz 赫兹", "kHz": "kHz KHz kHZ KHZ", "MHz": "MHz"},
        "": {"": "- 1 – — [-] none cycles # x"},
    }
)

# Spellings that may be several units -> what may be meant, the likeliest first; those that differ by their case are found.
# The "µ" of DOS, of code pages 437 and 850, is read as "æ".
_MEANT: Mapping[str, Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "s": {"\N{REPLACEMENT CHARACTER}s": ("us",), "?s": ("us",), "æs": ("us",)},
        "m": {
            "\N{REPLACEMENT CHARACTER}m": ("um",),
            "?m": ("um",),
            "æm": ("um",),
            "A": ("Å",),
            "micro": ("um",),
            "u": ("um",),
            "µ": ("um",),
        },
        "N": {
            "p": ("gf",),
            "gr": ("gf",),
            "\N{REPLACEMENT CHARACTER}N": ("uN",),
            "?N": ("uN",),
            "æN": ("uN",),
            "t": ("1000 kgf",),
        },
        "F": {
            "mmF": ("pF", "mF"),
            "mfd": ("uF", "mF"),
            "mf": ("mF", "uF"),
            "\N{REPLACEMENT CHARACTER}F": ("uF",),
            "?F": ("uF",),
            "æF": ("uF",),
            "p": ("pF",),
            "n": ("nF",),
            "u": ("uF",),
        },
    }
)


def mended(text: str) -> str:
    """A text that was encoded as UTF-8 and read as another encoding, maybe twice, as it was; any other as it is.

    >>> mended("z (Âµm)"), mended("KapazitÃ¤t"), mended("Ångström")
    ('z (µm)', 'Kapazität', 'Ångström')
    """
    for _ in range(2):
        if not any(c in text for c in "ÃÂÎÏâÐÑ"):
            break
        for encoding in ("cp1252", "latin-1"):
            try:
                text = text.encode(encoding).decode("utf-8")
            except UnicodeError:
                continue
            break
    return text


def _tidy(unit: str) -> str:
    return re.sub(r"\s+", " ", unicodedata.normalize("NFKC", mended(unit))).strip().replace("μ", "µ")


_BY_SPELLING: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        si: MappingProxyType({_tidy(word): asked for asked, words in table.items() for word in words.split(" ")})
        for si, table in _SPELLINGS.items()
    }
)
# Units that are spelled out, "MILLIMETERS" and "PicoFarads", mean one thing in any case.
_SPELLED_OUT = 5
# "in." and "lbs." are abbreviations, "N." is an initial.
_ABBREVIATED = 2
_IN_ANY_CASE: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        si: MappingProxyType({word.lower(): asked for word, asked in table.items() if len(word) >= _SPELLED_OUT})
        for si, table in _BY_SPELLING.items()
    }
)
_DIFFER_BY_CASE: Mapping[str, Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        si: MappingProxyType(
            {low: tuple(sorted({a for word, a in table.items() if word.lower() == low})) for low in map(str.lower, table)}
        )
        for si, table in _BY_SPELLING.items()
    }
)
_MASSES = frozenset(
    [
        "g",
        "gm",
        "gms",
        "gram",
        "grams",
        "gramm",
        "gramme",
        "grammes",
        "gramo",
        "gramos",
        "grammi",
        "gramy",
        "г",
        "克",
        "グラム",
        "그램",
        "kg",
        "kgs",
        "kilo",
        "kilos",
        "kilogram",
        "kilograms",
        "kilogramm",
        "kilogramme",
        "kilogrammes",
        "kilogramo",
        "kilogramos",
        "кг",
        "千克",
        "公斤",
        "キログラム",
        "킬로그램",
        "mg",
        "milligram",
        "milligrams",
        "milligramm",
        "毫克",
        "lb",
        "lbs",
        "pound",
        "pounds",
        "oz",
        "ounce",
        "ounces",
    ]
)


def _asked(tidy: str, si: str) -> str | None:
    """What `unit_factor` is asked for by a spelling, with or without the mark of an abbreviation ("in."); None if unknown."""
    for word in (tidy, tidy.removesuffix(".") if len(tidy) > _ABBREVIATED else tidy):
        found = _BY_SPELLING[si].get(word)
        if found is None and len(word) >= _SPELLED_OUT:
            found = _IN_ANY_CASE[si].get(word.lower())
        if found is not None:
            return found
    return None


# A power of ten before a unit: "1/100 mm", "10^-3 N", "1e-12 F", "x10\u207b\u00b3 mm" (which NFKC writes 10\u22123).
_POWER = re.compile(
    r"(?:[x×*]\s?)?(?:10(?:(?:\^|\*\*) ?(?P<ten>[+-]?\d{1,2})|(?P<up>[+-]\d{1,2}))|(?:1(?:\.0*)?)?[eE](?P<e>[+-]?\d{1,2})|"
    r"1/1(?P<zeros>0{1,6}))"
    r"(?:[ *·] ?(?P<unit>.+))?"
)
# The same behind a unit, as a product of both: "N·10⁻³".
_POWER_BEHIND = re.compile(r"(?P<unit>[^\W\d_]+) ?[·\u22c5] ?10(?:\^|\*\*)?(?P<power>[+-]\d{1,2})")
# Any factor, which the user may give.
_TIMES = re.compile(r"(?:[x×*]\s?)?(?P<number>\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)\s?(?P<unit>\D.*)?")
_SHARES = {"%": 1e-2, "‰": 1e-3, "ppm": 1e-6}


def lab_factor(unit: str, quantity: str) -> float:
    """What to multiply a column by to have it in SI, from its unit as the lab file writes it.

    Parameters
    ----------
    unit : as written; a power of ten may stand before it, as in "10^-3 N", or behind a point, as in "N·10⁻³".
    quantity : one of `SI_UNIT`.

    >>> lab_factor("kN", "force"), lab_factor("μm", "displacement"), lab_factor("%", "dissipation")
    (1000.0, 1e-06, 0.01)
    >>> lab_factor("1e-12 F", "capacitance"), lab_factor("x1e-3", "dissipation"), lab_factor("1/100 mm", "displacement")
    (1e-12, 0.001, 1e-05)

    Raises
    ------
    ValueError
        If the spelling is not known, with what may have been meant.
    """
    si, tidy = SI_UNIT[quantity], _tidy(unit)
    if si == "" and tidy in _SHARES:
        return _SHARES[tidy]
    asked = _asked(tidy, si)
    if asked is not None:
        return unit_factor(asked, si)
    behind = _POWER_BEHIND.fullmatch(tidy.replace("\u2212", "-"))
    if behind is not None and si:
        return float(Decimal(repr(lab_factor(behind["unit"], quantity))).scaleb(int(behind["power"])))
    power = _POWER.fullmatch(tidy.replace("\u2212", "-"))
    if power is not None and (not si or power["unit"]):
        exponent = -len(power["zeros"]) if power["zeros"] else int(power["ten"] or power["up"] or power["e"])
        return float(Decimal(repr(lab_factor(power["unit"] or "-", quantity))).scaleb(exponent))
    meant = " or ".join(may_be_meant(unit, quantity))
    raise ValueError(
        f'unknown unit "{unit}" of {quantity.removesuffix("_series")}{f", did you mean {meant}?" if meant else ""}'
    )


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


def may_be_meant(unit: str, quantity: str) -> tuple[str, ...]:
    """The units that a spelling which is none may be meant for: those that differ by their case, or those that it is short for.

    Parameters
    ----------
    unit : as written.
    quantity : one of `SI_UNIT`.

    >>> may_be_meant("PF", "capacitance"), may_be_meant("mfd", "capacitance"), may_be_meant("quux", "force")
    (('pF',), ('uF', 'mF'), ())
    """
    si, tidy = SI_UNIT[quantity], _tidy(unit)
    table = _MEANT.get(si, {})
    listed = next((meant for word, meant in table.items() if tidy in (word, word.upper())), ())
    alike = _DIFFER_BY_CASE[si].get(tidy.lower(), ()) if si else ()
    return listed or tuple(dict.fromkeys(_usual(si, asked) for asked in alike))


def _usual(si: str, asked: str) -> str:
    return _SPELLINGS[si][asked].split(" ", 1)[0]


def usual_units(quantity: str) -> tuple[str, ...]:
    """The units that a quantity may be said in, in their usual spelling.

    Parameters
    ----------
    quantity : one of `SI_UNIT`.

    >>> usual_units("capacitance")
    ('F', 'mF', 'uF', 'nF', 'pF', 'fF', 'aF')
    """
    si = SI_UNIT[quantity]
    return tuple(_usual(si, asked) for asked in _SPELLINGS[si]) if si else ("1", "%", "‰")


# In a header of capitals alone these can only be meant so; "MN" and "MF" stay open, "NM" is a torque elsewhere.
_OF_CAPITALS = MappingProxyType(
    {
        word.upper(): word
        for word in ["pF", "nF", "uF", "fF", "ms", "us", "ns", "uN", "cN", "dN", "daN", "gf", "g", "mil", "dyn"]
    }
)


def from_capitals(unit: str) -> str:
    """A unit from a header of capitals alone, as it is usually written; "" if that cannot be told or is the same.

    >>> from_capitals("PF"), from_capitals("MN"), from_capitals("MM")
    ('pF', '', '')
    """
    return _OF_CAPITALS.get(_tidy(unit), "")


def is_mass(unit: str) -> bool:
    """Whether a unit of force is written as one of mass, whose weight is meant: on a tester a pound or a gram is a force."""
    return _tidy(unit).removesuffix(".").lower() in _MASSES


def as_force(unit: str) -> str:
    """The unit of force that a unit of mass stands for: "gf" of "grams"."""
    return _usual("N", _asked(_tidy(unit), "N") or "N")


@lru_cache(maxsize=4096)  # a word among thousands of lines costs as much as all that is read
def is_unit_of(unit: str, quantity: str) -> bool:
    """Whether a word is a known spelling of a unit of a quantity.

    Parameters
    ----------
    unit : as written.
    quantity : one of `SI_UNIT`.
    """
    if SI_UNIT[quantity] and unit.isdecimal():
        return False
    try:
        lab_factor(unit, quantity)
    except ValueError:
        return False
    return True


@lru_cache(maxsize=4096)
def is_unit_of_a_record(unit: str) -> bool:
    """Whether a word is a known spelling of a unit of what a record holds: a time, a displacement, a force or a capacitance.

    Parameters
    ----------
    unit : as written.
    """
    return any(is_unit_of(unit, quantity) for quantity in RECORDED)


#: Units of languages that set no blanks between words, the longest first: to be found within a sentence.
UNITS_WITHOUT_BLANKS = tuple(
    sorted({w for table in _BY_SPELLING.values() for w in table if len(w) > 1 and w[0] > "\u2e80"}, key=lambda w: (-len(w), w))
)
# How units that are spelled out begin in most languages, whatever their endings: "millinewtonach", "в миллиметрах".
_PREFIX = (
    r"(?P<prefix>milli|mili|милли|міл[іл]+|micro|mikro|микро|мікро|kilo|кило|кіло|nano|нано|pico|piko|пико|піко|femto|centi|"
    r"zenti|санти)?"
)
_BASES = {
    "force": ("N", "newton|niuton|njuton|nyuton|ньютон"),
    "displacement": ("m", "met[er]|mèt|mét|метр"),
    "capacitance": ("F", "farad|фарад"),
}
_LETTER_OF = {
    "mil": "m",
    "мил": "m",
    "міл": "m",
    "mic": "u",
    "mik": "u",
    "мик": "u",
    "мік": "u",
    "kil": "k",
    "кил": "k",
    "кіл": "k",
} | {
    "nan": "n",
    "нан": "n",
    "pic": "p",
    "pik": "p",
    "пик": "p",
    "пік": "p",
    "fem": "f",
    "cen": "c",
    "zen": "c",
    "сан": "c",
}


def unit_by_stem(word: str, quantity: str) -> str:
    """The usual unit of one that is spelled out in a sentence, in any language and with any ending; "" if it is none.

    Parameters
    ----------
    word : of a sentence.
    quantity : one of `SI_UNIT`.

    >>> [unit_by_stem(*of) for of in (("миллиньютонах", "force"), ("milimetrach", "displacement"), ("method", "displacement"))]
    ['mN', 'mm', '']
    """
    unit, stems = _BASES.get(quantity, ("", "\0"))
    match = re.match(rf"{_PREFIX}(?:{stems})", word.lower())
    if match is None or (unit == "m" and not match["prefix"]):
        return ""
    return _LETTER_OF.get((match["prefix"] or "")[:3], "") + unit


@lru_cache(maxsize=8192)
def looks_like_unit(text: str) -> bool:
    """Whether a cell reads as a unit of anything that lab files hold, also of what is not used here (MPa, %, °C, N/mm).

    >>> looks_like_unit("kPa"), looks_like_unit("N·m"), looks_like_unit("abc")
    (True, True, False)
    """
    tidy = _tidy(text)
    known = tidy in _SHARES or any(_asked(tidy, si) is not None for si in _BY_SPELLING)
    return known or _OTHER_UNIT.fullmatch(tidy) is not None


_OTHER_UNIT = re.compile(
    r"%|°|°?[CFK]|deg|rad|[kMG]?Pa|[mkµu]?V|[mkµun]?A|[mk]?W|[mk]?J|[mkMG]?(?:Ω|ohms?|Ohms?|OHM)|[mµu]?S|psi|ksi|m?bar|N/mm²?|"
    r"N/mm\^?2|N/m|[mµ]?m/(?:s|min)|mm/sec|mm²|mm\^?2|N[·.* -]?mm?|mm/mm|%/(?:s|min)|1/s|[mµun]?H|dB|[pnµu]C|deg ?[CF]|"
    r"° ?[CFK]|rpm"
)

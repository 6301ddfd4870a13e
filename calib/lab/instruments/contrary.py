"""From words beside a table to the unit that they say a quantity has, where it is not the one that the header gives."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from calib.lab.instruments.brackets import no_record
from calib.lab.instruments.lexicon import NAMES, UNIT_WORDS
from calib.lab.instruments.units import UNITS_WITHOUT_BLANKS, is_unit_of, lab_factor, mended, stands_for, unit_by_stem

_LONGEST = 500
_QUANTITIES = ("force", "displacement", "capacitance", "time")
# Letters of a language that sets blanks between its words.
_LETTER = "A-Za-zµÀ-ɏͰ-ϿЀ-ӿ"
_WITHOUT_BLANKS = "|".join(map(re.escape, UNITS_WITHOUT_BLANKS))
_UNIT = re.compile(
    rf"(?<![{_LETTER}\d/·*^.'’])(?!(?<=(?i:lcr|rlc)[ -])(?i:meter))"  # no unit: the LCR meter
    rf"(?:[{_LETTER}]+)(?![{_LETTER}\d/·*^²³'’]|\s?[-^]\d)|{_WITHOUT_BLANKS}",
)
_VALUE_BEFORE = re.compile(r"(?:\d|\d[eE][+-]?\d+)\s?(?:-\s?|[;,|\t]\s?\"?)?$")
_VALUE_BEHIND = re.compile(r"^[\s)\]\"']*[:=,;\t|]?[\s\"'<>≤≥~±(]*[-+]?\d")
_VALUE_NAMED = re.compile(r"^[\s)\]\"']*[:=][\s\"'<>≤≥~±(]*[-+]?\d")
# What stands right before a unit that readings are said to have: "in mN", "is: mN", "(mN)", "单位是mN".
_SAID = re.compile(
    r"(?:(?<![^\W_])(?:in|is|are|was|were|be|as|to|into|units?|units? of|ist|sind|war|waren|einheit|auf|en|est|sont|em|es|"
    r"son|è|sono|são|"
    r"w|we|to|są|v|ve|je|jsou|в|у|є|это|med|är|er|i|on|σε|είναι)\s|[:=→>(\[是为為用はがを는은이가]|단위)\s*[\"'(\[]*$",
    re.IGNORECASE,
)
_BRACKET = re.compile(r"[(\[]\s*$")
_NOT_BEFORE = re.compile(
    r"(?:(?<![^\W_])(?:not|never|nicht|kein|keine|pas|non|no|não|niet|nie|ne|не|inte|ikke|ei|değil|instead of|rather than|"
    r"statt|anstatt|anstelle von|au lieu de|en lugar de|en vez de|invece di|invece che|em vez de|in plaats van|zamiast|"
    r"místo|вместо)\s+"
    r"(?:in\s+|en\s+|em\s+|w\s+|v\s+|в\s+|the\s+|de\s+|d['’])?|不是|并非|非|而不是|不)[\"'(\[]*$",
    re.IGNORECASE,
)
_NOT_BEHIND = re.compile(r"^[\"')\]]*\s?(?:ではなく|でなく|じゃなく|ではありません|이 ?아니|가 ?아니|değil)")
_FROM = re.compile(r"(?<![^\W_])(?:from|von|aus|depuis|desde|da|dal|de|z|ze|из|från|fra)\s+[\"'(\[]*$|由$|从$", re.IGNORECASE)
_CONVERTED = re.compile(
    r"convert|konvert|umgerechnet|umrechn|rescaled|scaled|\bnow\b|jetzt|przelicz|переве|пересч|换算|換算|转换|変換|변환|환산",
    re.I,
)
_WRONG = re.compile(
    r"(?<![^\W_])(?:wrong\w*|actual(?:ly)?|really|real|in fact|sorry|oops|beware|caution|careful|attention|warning|note|"
    r"nb|n\.b\.?|"
    r"mistake\w*|erroneous\w*|incorrect\w*|instead|rather|falsch\w*|eigentlich|tatsächlich|achtung|vorsicht|hinweis|"
    r"nicht|statt|faux|fausse|"
    r"en fait|en réalité|remarque|attenzione|in realtà|sbagliat\w*|errat\w*|nota|atención|ojo|en realidad|equivocad\w*|"
    r"atenção|na verdade|"
    r"errad\w*|let op|eigenlijk|opgelet|uwaga|właściwie|naprawdę|błędn\w*|pozor|ve skutečnosti|chybn\w*|внимание|"
    r"ошиб\w*|на самом деле|увага|"
    r"obs|huom|egentligen|fel|dikkat|aslında|figyelem|valójában|προσοχή|not|pas|niet|nie|не)(?![^\W_])"
    r"|注意|错|錯|误|誤|实际|實際|実際|其实|其實|不是|주의|실제|잘못|아니|!",
    re.IGNORECASE,
)
_UNIT_WORD = re.compile(
    r"(?<![^\W_])(?:units?|einheit(?:en)?|unités?|unidad(?:es)?|unidades?|unità|eenhe(?:id|den)|enhet(?:er)?|"
    r"enhed(?:er)?|jednostk\w*|"
    r"jednotk\w*|единиц\w*|одиниц\w*|yksik\w*|birim\w*|mértékegység\w*|μονάδ\w*)(?![^\W_])|单位|單位|単位|단위",
    re.IGNORECASE,
)
_ALL = re.compile(
    r"\b(?:all|values|readings|data|numbers|columns?|header|everything|measured|recorded|logged|werte|daten|alle|alles|"
    r"spalten?|kopfzeile|"
    r"valeurs|données|colonnes?|valores|datos|columnas?|valori|colonn[ae])\b|数据|數據|列|データ|값",
    re.IGNORECASE,
)
# What beside readings is said of an instrument or a test, in a unit of its own.
_SETTING = (
    r"range|bereich|gamme|capacity|full[ -]?scale|nennlast|nennkraft|preload|pre-load|vorkraft|vorlast|précharge|"
    r"precarga|precarico|threshold|"
    r"schwelle|seuil|trigger|speed|geschw|velocity|vitesse|veloc|rates?\b|resol|auflös|résol|accura|genauig|precis|"
    r"noise|rausch|bruit|drift|"
    r"offset|tare|tara|steps?\b|schritt|increment|stiff|steif|compliance|spring|feder|modul|serial|type\b|model|"
    r"sensitiv|empfind|calib|kalib|"
    r"filter|axis|achse|plot|graph|chart|diagram|figure|abbild|tolerance|toleranz|uncert|unsicher|量程|精度|分辨|速度|レンジ|分解能"
)
_SETTINGS = {
    "force": re.compile(_SETTING, re.I),
    "displacement": re.compile(
        rf"{_SETTING}|ball|kugel|bille|sfera|radius|radii|rayon|diam|durchm|thick|dicke|épais|espes|spesso|length|länge|"
        rf"longueur|width|"
        r"breite|height|höhe|hauteur|gap|spalt|electrod|elektrod|disc|disk|sample|specimen|prüfling|probe|pad\b|foam|"
        r"rubber|sheet|layer|"
        r"wavelength|geometr|dimension|abmess|size|größe|厚|直径|半径|球",
        re.I,
    ),
    "capacitance": re.compile(rf"{_SETTING}|stray|cable|kabel|parasit|streu|open|short|reference|referenz", re.I),
    "time": re.compile(
        rf"{_SETTING}|interval|intervall|sampl|abtast|hold|halte|dwell|delay|pause|wait|warte|integr|apertur|constant|"
        rf"konstante|date|datum|"
        r"start|beginn|created|printed|clock|timeout|relax|cure|duration|dauer",
        re.I,
    ),
}
_LETTERS = {"force": "f", "displacement": "xzdhs", "capacitance": "c", "time": "t"}
_MARKS = re.compile(r"[\t;|,、，]")


@dataclass(frozen=True)
class _Named:
    """A unit in a line of words: where it stands, what it is of, and by what it makes SI."""

    start: int
    end: int
    text: str
    factor: float


def unit_against(line: str, quantity: str, factor: float) -> str:
    """The unit that a line says the readings of a quantity have, if it is another than theirs; "" if it says none.

    A number with a unit, a setting of the instrument and a size of the specimen are none of the readings.

    Parameters
    ----------
    line : above, below, between or beside the rows.
    quantity : of the readings.
    factor : from their unit to SI.

    >>> unit_against("NB force in mN", "force", 1.0), unit_against("Achtung: Kraft in mN, nicht N", "force", 1.0)
    ('mN', 'mN')
    >>> [unit_against(words, "force", 1.0) for words in ("max 500 mN", "Preload (mN): 50", "converted from mN to N")]
    ['', '', '']
    """
    quantity = stands_for(quantity)
    if quantity not in _QUANTITIES or len(line) > _LONGEST or not any(c.isalpha() for c in line):
        return ""
    text = _plain(line)
    units = list(_units_in(text, quantity))
    if not units:
        return ""
    own = [u for u in units if math.isclose(u.factor, factor, rel_tol=1e-9)]
    others = [u for u in units if u not in own and not _is_denied(text, u) and not _is_value(text, u)]
    denied = [u for u in own if _is_denied(text, u)]
    kept = [u for u in own if u not in denied and not _is_value(text, u)]
    if not others and not denied:
        return ""
    wrong = _WRONG.search(text) is not None
    named = names_quantity(text, quantity)
    for unit in others:
        if _is_of_readings(text, unit, quantity, named=named, wrong=wrong) and not _is_converted(text, unit, kept):
            return unit.text
    # "Force is not N": in which unit it is then is not said.
    return f"not {denied[0].text}" if denied and (named or len(denied[0].text) > 1) and not others else ""


def _plain(line: str) -> str:
    text = unicodedata.normalize("NFKC", mended(line)).replace("μ", "µ").replace("_", " ")
    return re.sub(
        r"\b(milli|micro|mikro|kilo|nano|pico|piko|femto|centi)[- ](?=newton|met[er]|farad|gram)", r"\1", text, flags=re.I
    )


def _units_in(text: str, quantity: str) -> Iterator[_Named]:
    for match in _UNIT.finditer(text):
        word = match[0]
        if is_unit_of(word, quantity):
            yield _Named(match.start(), match.end(), word, lab_factor(word, quantity))
        elif usual := unit_by_stem(word, quantity):
            yield _Named(match.start(), match.end(), usual, lab_factor(usual, quantity))


def _is_denied(text: str, unit: _Named) -> bool:
    return _NOT_BEFORE.search(text[: unit.start]) is not None or _NOT_BEHIND.search(text[unit.end :]) is not None


def _is_value(text: str, unit: _Named) -> bool:
    """Whether a unit is that of a number: "500 N", "Preload (N): 5"."""
    before, behind = text[: unit.start], text[unit.end :]
    if _VALUE_BEFORE.search(before):
        return True
    said = _SAID.search(before) is not None and not _BRACKET.search(before)
    return (_VALUE_NAMED if said else _VALUE_BEHIND).search(behind) is not None


def _is_of_readings(text: str, unit: _Named, quantity: str, *, named: bool, wrong: bool) -> bool:
    """Whether a unit is said of readings, not of an instrument, a specimen or nothing at all."""
    before = text[: unit.start]
    first = max((m.end() for m in _MARKS.finditer(before)), default=0)
    end = _MARKS.search(text, unit.end)
    part = text[first : end.start() if end is not None else len(text)]
    if (_SETTINGS[quantity].search(part) or no_record(part)) and not (named and wrong):
        return False
    said = _SAID.search(before) is not None
    letter = (
        re.search(rf"(?<![^\W_])[{_LETTERS[quantity]}]\s*(?:(?:in|is|ist|en|est)\s|[:=(\[])[\s\"'(\[]*$", before, re.I)
        is not None
    )
    if unit.text.lower() == "in" and re.match(r"\s+[^\W\d]", text[unit.end :]):
        return False  # "is in inches"
    if len(unit.text) == 1 or unit.text.lower() in UNIT_WORDS:
        return said and (named or letter)
    speaks = named or letter or wrong or _UNIT_WORD.search(text) is not None or (said and _ALL.search(text) is not None)
    return speaks or (said and quantity in ("force", "capacitance"))


def _is_converted(text: str, unit: _Named, kept: list[_Named]) -> bool:
    """Whether readings were in a unit once, and are in their own now: "converted from mN to N"; or a list names both."""
    if not kept:
        return False
    last = kept[-1].start > unit.start
    if last and (_FROM.search(text[: unit.start]) or _CONVERTED.search(text)):
        return True
    between = text[unit.end : kept[-1].start].strip(" )]\"'([").lower() if last else "-"
    if between in ("->", "→", "=>", "to", "into", "nach", "zu"):
        return True
    parts = [p.strip(" ()[]\"'") for p in re.split(r"[\s,;:|\t]+", _UNIT_WORD.sub("", text)) if p.strip(" ()[]\"'")]
    return all(any(is_unit_of(p, q) for q in _QUANTITIES) for p in parts)


@lru_cache(maxsize=1)
def _by_name() -> dict[str, str]:
    found: dict[str, str] = {}
    for quantity, names in NAMES.items():
        for name in names:
            if len(name) > 1 or name > "\u2e80":
                found.setdefault(name, stands_for(quantity))
    return found | {"kräfte": "force", "loads": "force", "cell": "force", "capa": "capacitance"}


@lru_cache
def _beginnings(quantity: str) -> tuple[str, ...]:
    """What longer and inflected words of a quantity begin with: "Kraftwerte", "forces", "силы"; and names without blanks."""
    names = [n for n, q in _by_name().items() if q == quantity and " " not in n and n <= "\u2e80"]
    whole = [n for n in names if len(n) > 4]
    return (*whole, *(n[:-1] for n in names if len(n) > 5 or (len(n) > 3 and not n.isascii())))


def names_quantity(text: str, quantity: str) -> bool:
    """Tell whether a line names a quantity, in any of the languages and inflected as languages do.

    Parameters
    ----------
    text : of the line.
    quantity : "force", "displacement", "capacitance" or "time".
    """
    low = text.lower()
    if any(q == quantity and n in low for n, q in _by_name().items() if n > "\u2e80"):
        return True
    parts = re.findall(r"[^\W\d_]+", low)
    pairs = [" ".join(parts[i : i + 2]) for i in range(len(parts) - 1)]
    if any(_by_name().get(w) == quantity or _by_name().get(w.removesuffix("s")) == quantity for w in (*parts, *pairs)):
        return True
    return any(part.startswith(_beginnings(quantity)) for part in parts)

"""From words beside a number and a unit to whether they say how far an instrument reaches, or how far readings may be off."""

from __future__ import annotations

import re

#: What is said before how far an instrument reaches, for patterns in any case: what it is made for, and its range.
RATED = (
    r"capacity|nominal(?: load| force| capacity)?|rated(?: load| force| capacity)?|full[ -]?scale|fs|"
    r"nenn(?:last|kraft|bereich)?|nom\.?|nominale|nominell|vollausschlag|capacité|capacidad|capacità|pleine échelle|"
    r"fondo (?:di |de )?scala|fondo (?:de )?escala"
)
RANGE = (
    r"(?:amplifier |sensor |measuring |meas\.? ?)?range|(?:mess)?bereich|gamme|plage|étendue(?: de mesure)?|calibre|rango|"
    r"alcance|portata|portée|campo(?: di misura)?|(?:meet)?bereik|zakres(?: pomiarowy)?|(?:mät|måle)?område|rozsah|"
    r"диапазон(?: измерени[яй])?|предел|测量范围|測定範囲|量程|範囲|范围|レンジ|측정 ?범위|범위"
)
#: The same with words that say something else where no unit stands behind the number: "max. 20 N", "échelle 20 N".
REACHES = (
    rf"{RATED}|{RANGE}|(?:max(?:imum|imale?)?|máx(?:imo)?|massimo|maks)\.?"
    rf"(?: (?:{RATED}|load|force|range|last|kraft|charge|carga|carico))?|最大|최대|échelle|escala|scala"
)
_UP_TO = r"up to|bis|jusqu['’]à|hasta|fino a|até|tot"
_EXTENT = r"(?:±\s?|[-+]?\d+(?:[.,]\d+)?\s?(?:-|–|to|bis|à|a|\.{2,3})\s?\+?)?\d+(?:[.,]\d+)?\s?"
_UNIT = r"(?:[mkµμu]?N|Н|k?gf?|lbf?|[mcµμun]?m)"
# "range ±5 mm", "Bereich 20 N", "量程20N", "20 N max."; of a meter in its units, too.
_REACH = (
    rf"(?:(?i:(?:{REACHES})[ :=]{{0,2}}(?:(?:{_UP_TO}) )?|(?:{_UP_TO}) ){_EXTENT}(?:{_UNIT}|[pnµμu]F|[mk]?V)|"
    rf"{_EXTENT}{_UNIT}\s?(?i:{REACHES}))(?![^\W_])"
)
_ALONE = re.compile(_REACH)
#: A name with its brackets, how far the instrument reaches, as `condition`, before these or behind them.
REACH_WITHIN = re.compile(rf"(?P<before>[^()\[\]]*?[^\W\d_])[\s,;]+(?P<condition>{_REACH})(?P<behind>\s*[(\[].*)")
REACH_BEHIND = re.compile(rf"(?P<before>.*[)\]])\s*[,;]?\s*(?P<condition>{_REACH})")
# How far readings may be off, behind a unit or a name: "(mm ±0.002)", "Force (N) ± 0.01"; it changes nothing of them.
_TOLERANCE = re.compile(
    r"(?<=[^\s(\[,;])\s*(?:±|\+/-)\s?\d+(?:[.,]\d+)?(?:\s?(?:%|[^\W\d_]{1,3})(?=\s*[)\]]))?\s?%?(?=\s*(?:[()\[\]]|$))"
)
_ENDS_IN_REACH = re.compile(rf"(?<![^\W_])(?:{REACHES})[\s:=]*$", re.IGNORECASE)


def is_reach(text: str) -> bool:
    """Whether words say nothing but how far an instrument reaches, in a unit.

    >>> [is_reach(text) for text in ("Bereich 20 N", "量程20N", "max. capacity 20 N", "20 N range", "±20 N", "max 20")]
    [True, True, True, True, False, False]
    """
    return _ALONE.fullmatch(text) is not None


def without_tolerance(cell: str) -> str:
    """A header cell without how far its readings may be off; that of a range is how far it reaches.

    >>> without_tolerance("Displacement (mm ±0.002)"), without_tolerance("Force (range: ±20 N)")
    ('Displacement (mm)', 'Force (range: ±20 N)')
    """
    return _TOLERANCE.sub(lambda m: m[0] if _ENDS_IN_REACH.search(m.string[: m.start()]) else "", cell)

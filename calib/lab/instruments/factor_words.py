"""From words in a name to whether they say by what the readings were or are to be multiplied: "div by 10", "tenfold"."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType

#: Numbers in words -> in figures, in the languages of lab files.
FIGURES: Mapping[str, str] = MappingProxyType(
    {
        word: figure
        for figure, words in {
            "2": "two zwei deux dos due dois twee dwa",
            "3": "three drei trois tres tre três drie",
            "4": "four vier quatre cuatro quattro quatro",
            "5": "five fünf cinq cinco cinque vijf pięć",
            "10": "ten zehn dix diez dieci dez tien dziesięć",
            "100": "hundred hundert cent cien ciento cento cem honderd sto",
            "1000": "thousand tausend mille mil duizend tysiąc",
        }.items()
        for word in words.split()
    }
)
#: Words that alone say that something was multiplied or divided, and those that say it of a part or a multiple, for patterns.
MULTIPLIED = (
    r"(?:two|three|four|five|ten|hundred|thousand)fold|doubled|halved|tripled|quadrupled|"
    r"(?:zwei|drei|vier|fünf|zehn|hundert|tausend)fach\w*|verdoppelt\w*|verdreifacht\w*|verzehnfacht\w*|halbiert\w*|"
    r"doublée?s?|duplicad[oa]s?|doblad[oa]s?|raddoppiat[oaie]|dimezzat[oaie]|dobrad[oa]s?|verdubbeld|gehalveerd\w*"
)
MULTIPLES = (
    r"double|halve|half|twice|triple|hälfte|halbe?[rsn]?|doppelte?[rsn]?|moitié|demi|doble|mitad|doppi[oa]|metà|dobro|metade|"
    r"dubbele?|helft|podwój\w*|połow\w*|(?:one|a) (?:half|third|quarter|tenth|hundredth|thousandth)"
)
_NUMBER = rf"(?:\d+(?:[.,]\d+)?(?:\s?/\s?\d+)?(?:\s?(?:\^|\*\*)\s?-?\d+|e[+-]?\d+)?|(?:{'|'.join(FIGURES)})(?![^\W_]))"
# What stands before a number by which something is multiplied or divided, and behind it.
_VERBS = (
    r"div(?:id\w*|is\w*)?\.?|mult(?:ipl\w*)?\.?|molt(?:ipl\w*)?\.?|scal(?:e|ed|es|ing)|times|geteilt|teilen|dividier\w*|multiplizier\w*|skalier\w*|mal|"
    r"fois|veces|volte|vezes|keer|razy|gedeeld|vermenigvuldigd|podziel\w*|p(?:rze)?omnoż\w*|gains?|ampl(?:if\w*)?\.?|verst[äa]rk\w*|"
    r"\w*fa[ck]tor|facteur|fattore|fator|współczynnik|multiplier|multiplikator|ratio|verhältnis|rapport|rapporto|lever|hebel|levier|leva|"
    r"übersetzung|coeff?\w*|koeff\w*|conversion|conversione|umrechnung|calibration|kalibrier\w*|cal|échelle|escala|scala|skala|over"
)
_LINKS = r"by|durch|mit|of|par|de|por|per|da|door|met|przez|um|with|auf|a"
_BEHIND = r"[x×]|-?\s?fold|-?\s?fach\w*|times|mal|fois|veces|volte|vezes|keer|razy|倍|배"
_SAID = re.compile(
    rf"(?<![^\W_])(?<!avg )(?<!averaged )(?<!mean )(?:{_VERBS})(?:[\s:=]*(?:{_LINKS})(?![^\W_]))?[\s:=]*"
    rf"(?P<number>{_NUMBER})(?![\w%])|"
    rf"(?<![\w.,])(?P<before>{_NUMBER})\s?(?:{_BEHIND})(?![^\W_])|"
    r"(?<=[^\W\d_]{2})\s?[/÷×*]\s?\d+(?:[.,]\d+)?$|"
    rf"(?:除以|乘以|乗|除|乘|곱하기|나누기)\s?{_NUMBER}",
    re.IGNORECASE,
)
# Words that say it alone, and those of which nothing but that is said with a number in brackets.
_ALONE = re.compile(
    rf"(?<![^\W_])(?:{MULTIPLIED}|{MULTIPLES}|in (?:tens|hundreds|thousands))(?![^\W_])"
    r"(?![\s-](?:bridge|brücke|pont|puente|ponte|column|cell|beam|ended|sided))",
    re.IGNORECASE,
)
_BARE = re.compile(rf"(?:by|durch|over|über|par|por|entre|per|x|k\s?=|×)\s?{_NUMBER}|1\s?/\s?\d+", re.IGNORECASE)
# A year or a one is none, nor is what a number is of.
_NO_FACTOR = re.compile(r"1(?:[.,]0+)?|(?:19|20)\d\d")
# Numbers that stand free, of no unit, and words before or behind those that count something.
_FREE = re.compile(
    r"(?<![\w.,/-])[+-]?\d+(?:[.,]\d+)?(?![\w/]|[.,]\d)(?!-\d)(?!\s?(?:[mkcdµμun]?[NVms]|kg|gf?|lbf?|in|k?Hz|mV/V|°C|min|h|[pn]F)(?![^\W_]))"
)
_COUNTING = re.compile(
    r"(?<![^\W_])(?:run|test|try|rev(?:ision)?|ver(?:sion)?|unit|part|set|step|no|nr|number|probe|versuch|lauf|messung|essai|prueba|prova|"
    r"sample|specimen|sensor|channel|chan|ch|kanal|canal|cell|zelle|pad|board|port|pin|slot|axis|node|id|order|lot|batch|cycle|day|week|type|model|typ|modell)"
    r"s?[.:# ]{0,2}\d|"
    r"\d\s?(?:samples?|points?|readings?|values?|pts|punkte|werte|messwerte|bits?|digits?|st|nd|rd|th)(?![^\W_])",
    re.IGNORECASE,
)
# A number right before a symbol: "2F", "½F", "0.5 Fz"; "2 Load" is a channel.
_BEFORE_SYMBOL = re.compile(
    r"\s*(?:(?P<number>\d+(?:[.,]\d+)?)[A-Za-z]{1,2}\s*$|(?P<part>[½⅓¼⅒]|\d+[⁄.,]\d+)\s?(?:[A-Za-z]{1,2}\s*$|[^\W\d_]{4}))"
)


def factor_words(text: str) -> str:
    """The words of a name or a bracket that say by what its readings were multiplied, or are to be; "" if none do.

    >>> [factor_words(text) for text in ("div by 10", "times ten", "10-fold", "Faktor 10", "Kraft 10-fach", "10倍", "1/10")]
    ['div by 10', 'times ten', '10-fold', 'Faktor 10', '10-fach', '10倍', '1/10']
    >>> [factor_words(text) for text in ("halbe Kraft", "half bridge", "factor 1", "calibration 2026", "run 10", "by hand")]
    ['halbe', '', '', '', '', '']
    """
    match = _BARE.fullmatch(text.strip()) or _SAID.search(text) or _ALONE.search(text)
    number = next((n for n in (match["number"], match["before"]) if n), "") if match is not None and match.re is _SAID else ""
    return "" if match is None or _NO_FACTOR.fullmatch(number) else match[0].strip()


def factor_before_symbol(text: str) -> str:
    """The number right before the symbol of a name, as formulas have a factor; "" if none is.

    >>> [factor_before_symbol(text) for text in ("2F", "½F", "0.5 Fz", "2 Load", "F2", "4 mm ball", "10N cell force")]
    ['2', '½', '0.5', '', '', '', '']
    """
    match = _BEFORE_SYMBOL.match(text)
    return (match["number"] or match["part"]) if match is not None else ""


def free_number(text: str) -> str:
    """A number that stands free in words that nobody knows, and counts nothing: it may be a factor; "" if there is none.

    >>> [free_number(text) for text in ("x 10 too high", "10 % low", "quux 2.5", "4 mm ball", "run 3", "v2", "10 samples")]
    ['10', '10', '2.5', '', '', '', '']
    """
    found = _FREE.search(text)
    return found[0] if found is not None and not _COUNTING.search(text) else ""

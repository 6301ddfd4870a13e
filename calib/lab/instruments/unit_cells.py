"""From a cell of a row of units to the unit in it and the words beside that, or to that it holds none that can be told."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

from calib.lab.instruments.brackets import factor_in, footnote_of, is_factor, is_letter, is_wiring, no_record
from calib.lab.instruments.instrument_words import instrument_words
from calib.lab.instruments.lexicon import DERIVED, RELATIVE
from calib.lab.instruments.units import RECORDED, is_unit_of, looks_like_unit

# Letters of a unit with the words beside it.
_LONGEST = 200
_BRACKETS = re.compile(r"[(\[{]\s*(?P<unit>[^()\[\]{}]*?)\s*[)\]}]")
# "mm", "(mm)", "in mm", "unit: mm", and what stands behind it.
_UNIT_FIRST = re.compile(
    r"(?:(?:in|units?|einheit|unité|unidad|unità)\s*[:=]?\s+)?"
    r"(?:[(\[{]\s*(?P<inside>[^()\[\]{}]+?)\s*[)\]}]|(?P<bare>[^\s()\[\]{},;*†:=]+))(?P<words>.*)",
    re.IGNORECASE | re.DOTALL,
)
_WITHIN = re.compile(r"(?P<unit>[^\s,;:]+)(?P<words>[\s,;:].*)", re.DOTALL)
# Signs of an arithmetic, and words of one; of numbers only the reach of an instrument and the number of a channel are none.
_ARITHMETIC = re.compile(
    r"[×*/=·^]\s*\d|\b[x]\s*\d|\d\s*[x×*/]|^\s*[/=·^:]|\b(?:or|oder|ou|per|divided|times|multiplied|scaled?|factor|gain|faktor|"
    r"facteur|mal|geteilt|mille|kilo|milli|micro|centi|deci|mega|half|halved|doubled?|inverse|reciprocal|log|squared|"
    r"(?:ten|hundred|thousand|million|tausend|hundert|zehn)\w*)\b",
    re.IGNORECASE,
)
# A power of ten times a unit: "×10⁻³ N", "(10^-3 N)", "*1E-3 N"; "1e-3 N" may be a reading.
_POWER = re.compile(
    r"[(\[]?\s*(?P<unit>(?:(?:[×x*·]\s?)?10\s?(?:(?:\^|\*\*)\s?[-+\u2212]?\d{1,2}|[⁺⁻]?[⁰¹²³⁴⁵⁶⁷⁸⁹]{1,2})|[×x*·]\s?1[eE][-+]?\d{1,2})"
    r"\s?[·*]?\s?[^\W\d_]{1,3})\s*[)\]]?"
)
_READING = re.compile(r"[+\-\u2212]?\d[\d.,]*(?:[eE][+-]?\d+)?\s*(?P<unit>[^\W\d_]\S{0,5})")
# The same with any words, and the letters of such a cell.
_WORDED = re.compile(r"[+\-\u2212]?\d[\d.,]*(?:[eE][+-]?\d+)?\s?[^\W\d_]\w{0,7}(?: [^\W\d_]\w{0,9})?")
_LONGEST_READING = 40
_NUMBER_AND_WORD = re.compile(
    r"[+\-\u2212]?\d[\d.,]*(?:[eE][+-]?\d+)?\s?(?P<word>(?:[x×*·]\s?1[0e][\d^e+-]*\s?)?(?P<unit>[^\W\d_]{1,12}))"
)
# Units that are words of a language, too.
_WORDS = ("s", "m", "in", "d", "h", "min", "-")
_NUMBERED = re.compile(
    r"\b(?:ch|chan|channel|kanal|sensor|load ?cell|cell|no|nr|axis|run|test|trial|specimen|sample|probe|versuch|essai|"
    r"zelle|dose|(?:kraft)?messdose|aufnehmer|cellule|capteur|canal|voie|celda|célula|cella|canale|sensore|kanaal|cel|kanał|czujnik|transducer|"
    r"achse|axe|eje|asse)[ ._#]*\d{1,3}\b",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class UnitCell:
    """A unit, "" of an empty cell, and the words beside it in its cell, "" for none."""

    unit: str
    remark: str = ""


@lru_cache(maxsize=4096)
def unit_cell(cell: str) -> UnitCell | None:
    """The unit in a cell of a units row, and the words beside it; None if the cell cannot be one of units.

    Words may stand before or behind a unit, in brackets or not, unless they are a statistic, a factor, or another unit.

    Parameters
    ----------
    cell : as written.

    >>> unit_cell("(mm)"), unit_cell("kN").unit, unit_cell("0.5"), unit_cell("N [100 N cell]")
    (UnitCell(unit='mm', remark=''), 'kN', None, UnitCell(unit='N', remark='[100 N cell]'))
    >>> unit_cell("(N) zeroed").unit, unit_cell("(N) max"), unit_cell("(N) x10"), unit_cell("(N) or (kN)")
    ('N', None, None, None)
    >>> unit_cell("×10⁻³ N").unit, unit_cell("(*1E-3 N)").unit, unit_cell("1e-3 N")
    ('×10⁻³ N', '*1E-3 N', None)
    """
    cell = " ".join(cell.split())
    if not cell:
        return UnitCell("")
    if len(cell) > _LONGEST:
        return None
    if "(" not in cell and (mark := footnote_of(cell, of_unit=True)) and cell.endswith(f" {mark})"):
        cell = cell[: -len(mark) - 2]
    match = _BRACKETS.fullmatch(cell)
    if match and (looks_like_unit(match["unit"]) or not _WITHIN.fullmatch(match["unit"])):
        return UnitCell(match["unit"])
    if looks_like_unit(cell):
        return UnitCell(cell)
    power = _POWER.fullmatch(cell)
    if power is not None and any(is_unit_of(power["unit"], quantity) for quantity in RECORDED):
        return UnitCell(power["unit"])
    beside = _unit_and_words(cell)
    if beside is None:
        return None
    unit, words = beside
    return UnitCell(unit, words) if _changes_nothing(unit, words) else None


def with_its_unit(cell: str) -> bool:
    """Whether a cell is a reading with its unit behind it.

    Parameters
    ----------
    cell : as written.

    >>> with_its_unit("-0.0026 N"), with_its_unit("97.1pF"), with_its_unit("3 of them"), with_its_unit("0.5")
    (True, True, False, False)
    """
    match = _READING.fullmatch(cell.strip())
    return match is not None and looks_like_unit(match["unit"])


def is_worded_reading(cell: str) -> bool:
    """Whether a cell is a number with a word or two behind it, units or not.

    Parameters
    ----------
    cell : as written.

    >>> [is_worded_reading(cell) for cell in ("97.1 pF ok", "0.002 T", "97.1", "Cp 97.1 pF")]
    [True, True, False, False]
    """
    return len(cell) <= _LONGEST_READING and _WORDED.fullmatch(cell.strip()) is not None


def same_word_behind(cells: Sequence[str]) -> str:
    """The word that stands behind the numbers of all cells that hold something; "" where there is none, or are several.

    Parameters
    ----------
    cells : of a column.

    >>> same_word_behind(["97.1 C", "97.2 C", ""]), same_word_behind(["97.1 C", "97.2"]), same_word_behind(["97.1", "97.2"])
    ('C', '', '')
    """
    there = [stripped for cell in cells if (stripped := cell.strip())]
    first = _NUMBER_AND_WORD.fullmatch(there[0]) if there else None
    word = first["word"] if first is not None else ""
    if not word or not all(cell.endswith(word) for cell in there):
        return ""
    alike = (_NUMBER_AND_WORD.fullmatch(cell) for cell in there)
    return word if all(match is not None and match["word"] == word for match in alike) else ""


def unit_behind_factor(cell: str) -> str:
    """The unit behind a factor behind a number, "mN" of "0.2 x10mN"; "" of any other cell.

    >>> unit_behind_factor("0.2 x10mN"), unit_behind_factor("0.2 mN")
    ('mN', '')
    """
    match = _NUMBER_AND_WORD.fullmatch(cell.strip())
    return match["unit"] if match is not None and match["word"] != match["unit"] else ""


def begins_with_unit(cell: str) -> bool:
    """Whether a cell is a unit with words beside it, whatever these say; no letter such as A or C, which may begin a name.

    Parameters
    ----------
    cell : as written.

    >>> begins_with_unit("N or kN"), begins_with_unit("A sensor"), begins_with_unit("Load")
    (True, False, False)
    """
    cell = " ".join(cell.split())
    found = _unit_and_words(cell) if len(cell) <= _LONGEST else None
    return found is not None and not (is_letter(found[0]) and not cell.startswith(("(", "[")))


def _unit_and_words(cell: str) -> tuple[str, str] | None:
    match = _UNIT_FIRST.fullmatch(cell)
    if match is None:
        return None
    unit, behind = match["inside"] or match["bare"], match["words"]
    if not looks_like_unit(unit):
        within = _WITHIN.fullmatch(unit) if match["inside"] else None
        if within is None or not looks_like_unit(within["unit"]):
            return None
        unit, behind = within["unit"], f"{within['words']} {behind}"
    return unit, behind.strip(" ,;:*†") if not _ARITHMETIC.search(behind) else behind.strip()


def _changes_nothing(unit: str, words: str) -> bool:
    """Whether words beside a unit leave the readings what they are."""
    plain = re.sub(r"[()\[\]{}]", " ", words).strip(" ,;*†")
    parts = [w for w in re.split(r"[\s.,;:()\[\]]+", plain) if w]
    if _ARITHMETIC.search(words) or (parts and looks_like_unit(f"{unit} {parts[0]}")):
        return False
    said = [part.strip() for part in re.split(r";|,(?!\d)", plain)]
    if all(is_wiring(part) for part in said if part):
        return True
    # The reach of an instrument beside other words is passed by: "5N cell; tared".
    plain = " ".join(part for part in said if not is_wiring(part))
    parts = [w for w in re.split(r"[\s.,;:()\[\]]+", plain) if w]
    if any(w.lower() in DERIVED - RELATIVE for w in parts):
        return False
    if is_unit_of(unit, "capacitance") and any(w.lower() in RELATIVE for w in parts):
        return False
    alone = [w for w in _NUMBERED.sub(" ", plain).split() if w]
    alone = [w for w, of_instrument in zip(alone, instrument_words(alone), strict=True) if not of_instrument]
    counted = any(any(c.isdigit() for c in w) for w in alone)
    other = any(looks_like_unit(w) and not is_letter(w) and w.lower() not in _WORDS for w in parts)
    return not (counted or other or is_factor(plain) or factor_in(f" {plain}") or no_record(plain))

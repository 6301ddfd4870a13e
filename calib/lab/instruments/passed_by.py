"""From words that are not understood beside a name to whether they leave its column what it is: `Weg (Tauchspule) [mm]`."""

from __future__ import annotations

import re

from calib.lab.instruments.brackets import BALL, factor_in, is_factor, no_record, says_sense, words_in
from calib.lab.instruments.instrument_words import instrument_words
from calib.lab.instruments.lexicon import (
    BAD_ROW,
    DERIVED,
    KEYS,
    MARKS_BAD,
    NUMBERED_OTHERWISE,
    PHASES,
    PROCESSED,
    QUALIFIERS,
    RELATIVE,
    SECOND,
    UNIT_WORDS,
)
from calib.lab.instruments.other_quantities import is_of_another, was_not_measured
from calib.lab.instruments.unit_cells import unit_cell
from calib.lab.instruments.units import looks_like_unit
from calib.lab.instruments.vocabulary import FUNCTION, understand, why_unread

_SAYS_MORE = DERIVED | PROCESSED | RELATIVE | PHASES | SECOND | NUMBERED_OTHERWISE | MARKS_BAD | BAD_ROW | UNIT_WORDS | KEYS
# How words begin that say that readings were computed or converted, or are of a part of what is meant.
_COMPUTED = """
    simul theor hertz berechn calc comput estim predict geschätzt extrap interp integr deriv ableit gradient inver betrag
    magnitud squar quadrat norm skal scal rest remain verbleib delta diff änder aender chang vari rate geschwin vitesse velo
    model fem virtu ideal dummy placeh unus wrong falsch umgerech convert konvert assum annahm approx left right links rechts
    gauche droit front back half hälfte complian nachgieb bend bieg delay verzög interv mirror gespiegel flip raw roh filt
    glätt smooth
"""
_STEMS = tuple(_COMPUTED.split())
# Words of how and with what a reading is taken: of others it is not known what they say of a column.
_OF_MEASURING = frozenset(
    [
        "absolut",
        "absolute",
        "absolu",
        "actuator",
        "aktor",
        "aufnehmer",
        "beam",
        "clock",
        "computer",
        "crosshead",
        "dehnmessstreifen",
        "dms",
        "dose",
        "druck",
        "encoder",
        "extern",
        "external",
        "fühler",
        "gemessen",
        "host",
        "intern",
        "internal",
        "kanal",
        "kolben",
        "kraftaufnehmer",
        "kraftmessdose",
        "kraftsensor",
        "laser",
        "loadcell",
        "logger",
        "lokal",
        "local",
        "lvdt",
        "machine",
        "maschine",
        "measured",
        "measurement",
        "medido",
        "messdose",
        "messtaster",
        "messung",
        "messwert",
        "mesuré",
        "motor",
        "pc",
        "piston",
        "probe",
        "rechner",
        "relativ",
        "relative",
        "rig",
        "s-beam",
        "sensor",
        "servo",
        "stage",
        "stempel",
        "stepper",
        "system",
        "systemzeit",
        "taster",
        "tauchspule",
        "tester",
        "traverse",
        "uhr",
        "utc",
        "wegaufnehmer",
        "zelle",
        "zylinder",
    ]
)
# How far an instrument reaches, or at which frequency it measures.
_REACH = re.compile(r"(?<![\w.,])\d+(?:[.,]\d+)?\s?(?:[mk]?N|kg|mm|k?Hz|m?V)(?!\w)")
_BALL = re.compile(BALL, re.IGNORECASE)
# Of how many readings each is, and what was taken off.
_SO_MANY = re.compile(r"n\s?=\s?\d{1,4}|(?:tared?|tara|tariert)\s?[:=]?\s?\d+(?:[.,]\d+)?\s?[^\W\d_]{0,3}", re.IGNORECASE)
_WORD = re.compile(r"[^\W\d_]{2,}(?:-[^\W\d_]+)*\.?|[^\W\d_](?:-[^\W\d_]{2,})+")
_MOST = 4
_UNITS = {"time": "s", "displacement": "mm", "force": "N", "capacitance": "pF"}


def may_be_passed_by(text: str, quantity: str) -> bool:
    """Whether words leave a column of a quantity what it is: no statistic, factor, unit, other quantity or processing.

    Parameters
    ----------
    text : in brackets beside the name, or below it.
    quantity : that the name means.

    >>> [may_be_passed_by(text, "force") for text in ("S-beam", "DMS", "KAP-S 10N", "lateral", "simuliert", "left", "mN")]
    [True, True, True, False, False, False, False]
    >>> may_be_passed_by("Tauchspule", "displacement"), may_be_passed_by("temperature", "displacement")
    (True, False)
    """
    plain = " ".join(_REACH.sub(" ", text).split())
    parts = plain.split()
    left = [part for part, of_instrument in zip(parts, instrument_words(parts), strict=True) if not of_instrument]
    said = words_in(plain)
    return (
        len(parts) <= _MOST
        and all(_WORD.fullmatch(part) and not looks_like_unit(part) for part in left)
        and not any(word in _SAYS_MORE - QUALIFIERS or word.startswith(_STEMS) for word in said)
        and not (is_factor(text) or factor_in(f" {text}") or says_sense(text) or FUNCTION.search(text) or no_record(text))
        and not (is_of_another(plain, quantity) or was_not_measured(plain))
        and (not left or _says_nothing_else(" ".join(left), quantity))
        and unit_cell(f"({_UNITS.get(quantity, '-')}) {plain}") is not None
    )


def tells_how_measured(text: str, quantity: str) -> bool:
    """Whether words in brackets leave a column what it is, and are known: those of an instrument, and of how it measures.

    Parameters
    ----------
    text, quantity : as of `may_be_passed_by`.

    >>> [tells_how_measured(text, "force") for text in ("S-beam", "gemessen", "4 mm ball", "n=10", "quux", "lateral")]
    [True, True, True, True, False, False]
    """
    if _BALL.fullmatch(text.strip()) or _SO_MANY.fullmatch(text.strip()):
        return True
    parts = " ".join(_REACH.sub(" ", text).split()).split()
    told = instrument_words(parts)
    known = all(
        of_instrument or part.strip(".").lower() in _OF_MEASURING for part, of_instrument in zip(parts, told, strict=True)
    )
    return known and may_be_passed_by(text, quantity)


def _says_nothing_else(words: str, quantity: str) -> bool:
    """Whether words are not understood, or are another name of the quantity, as of the crosshead."""
    found = understand(words)
    same = found is not None and found.quantity == quantity and not (found.name_doubt or found.index or found.processed)
    return same or (found is None and why_unread(words) == "not understood")

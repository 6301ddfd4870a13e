"""From what a file says of its meter's equivalent circuit, series or parallel, to what a capacitance in it is."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.header import split_line, without_comment_mark
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.unit_cells import unit_cell
from calib.lab.instruments.vocabulary import Heading
from models.sensor import FloatArray

# Words before which, or after which, a meter's circuit is named.
_OF_CIRCUIT = (
    r"(?:mode|modo|circuit|[eé]quiv\w*|schaltung|ersatzschalt\w*|function|func|para\w*|measure\w*|model|modell|mod[eè]le|"
    r"montage|schéma|schemat|circuito|equ|prim(?:ary)?|ser/par|imp|ckt|modus|układ)"
)
_AFTER = r"(?:mode|circuit|equivalent|model|schaltung|ersatz\w*)"
# "C is series", "the capacitance is Cs".
_C_IS = r"\b(?:c|cap|capacitance|kapazität)\s+(?:is|are|=|ist|in)\s+(?:an? |the |in )?"
# Behind a series of tests stands its number: "Measurement: series 3".
_OF_NUMBER = r"(?:#|no\b|nr\b|n°)?\.?\s*\d"
_SERIES = re.compile(
    rf"\b[cl]s\s*[-/–,]\s*(?:d|q|rs|esr|cs)\b|\b{_OF_CIRCUIT}\b.*"
    rf"\b(?:ser|series?|serie[ns]?|seriell|série|szeregow\w*|reihe\w*|cs|ls)\b(?!\s*{_OF_NUMBER})|"
    rf"\b(?:series|serial|serien?|reihen)[ -]*{_AFTER}|\b(?:circuit|equivalent|model)\W+serial\W*$|"
    r"series capacitance|pojemność szeregowa|直列|串联|串聯|\bcs(?:[dq]|rs|esr)\b|^\W*ser\W*$|"
    r"\b(?:circuit|ckt)(?: mode)?\W+s\W*$|"
    rf"{_C_IS}(?:series|serial|seriell|cs)\b|\bcs[ -]mode\b|"
    r"^\W*(?:type|typ|art|tipo)\W+(?:ser|series?|serien?|seriell|série|reihe)\W*$|"
    r"^\W*(?:(?:remarks?|comments?|notes?|bemerkung|hinweis|kommentar|remarque|commentaire)\W+)?(?-i:Cs)\W*$",
    re.IGNORECASE,
)
_PARALLEL = re.compile(
    rf"\b[cl]p\s*[-/–,]\s*(?:d|q|g|rp|cp)\b|\b{_OF_CIRCUIT}\b.*\b(?:par|parallel\w*|parallèle|paralelo|parallelo|równoległ\w*|cp|lp)\b|"
    rf"\bparallel\w*[ -]*{_AFTER}|parallel capacitance|並列|并联|並聯|\bcp(?:[dqg]|rp)\b|^\W*par\W*$|"
    rf"\b(?:circuit|ckt)(?: mode)?\W+p\W*$|{_C_IS}(?:parallel|cp)\b|\bcp[ -]mode\b",
    re.IGNORECASE,
)
_NAMES_PARALLEL = re.compile(r"\bcp|\bparallel|\bc par|并联|並列|並聯")


@dataclass(frozen=True)
class Circuit:
    """What a file says of its meter: "series", "parallel" or "both", the words, and their 1-based line."""

    word: str
    shown: str
    line: int


def said_circuit(lines: Sequence[str], in_rows: Sequence[tuple[int, str]] = ()) -> Circuit | None:
    """Which equivalent circuit is named above a header, or in every row; None if none is.

    Parameters
    ----------
    lines : above the header.
    in_rows : 1-based line and words of what columns say in every row.

    >>> said_circuit(["IM3536", "MODE,SERIES"]).word, said_circuit(["Measure: Cp-D"]).word
    ('series', 'parallel')
    """
    found: list[Circuit] = []
    for number, line in (*enumerate(lines[-200:], max(len(lines) - 200, 0) + 1), *in_rows):
        series, parallel = _SERIES.search(line), _PARALLEL.search(line)
        if series or parallel:
            word = "both" if series and parallel else "series" if series else "parallel"
            found.append(Circuit(word, line.strip()[:60], number))
    if not found:
        return None
    words = {c.word for c in found}
    return found[0] if len(words) == 1 else Circuit("both", "; ".join(c.shown for c in found[:2]), found[0].line)


#: The columns of a meter of capacitance.
OF_METER = ("capacitance", "capacitance_series", "dissipation", "quality", "frequency", "status")
# A meter that shows how far a reading is from a reference, not the reading.
_DEVIATION = re.compile(
    r"(?<!standard )(?<!std )(?<!std\. )\b(?:deviation|dev|delta|abweichung\w*|écart|ecart|desviaci[oó]n|scostamento)\b"
    r"[ _-]*(?:mode|display|meas\w*|function|modus|anzeige)?\s*[:=,;\t ]\s*\W*"
    r"(?:d?abs\w*|percent\w*|pct|%|on|ein|yes|ja|true|rel\w*|d?%|Δ\w*)(?![\w])|偏差|"
    r"\b(?:rel(?:ative?)?|null)[ _-]*(?:mode|function|modus|display|anzeige)?\s*[:=,;\t ]\s*\W*(?:on|ein|ja|yes|true)(?!\w)",
    re.IGNORECASE,
)


def shows_deviations(sheet: Sheet, index: int) -> list[Fault]:
    """Refuse a capacitance of a meter that is said, above the header, to show how far it is from a reference.

    Parameters
    ----------
    sheet : the record.
    index : the column of the capacitance.
    """
    for number, line in enumerate(sheet.prelude_of(OF_METER), 1):
        if _DEVIATION.search(line):
            message = (
                f'column "{sheet.names[index]}" holds no capacitance but how far it is from a reference, as line {number} says '
                f'("{line.strip()[:60]}")'
            )
            advice = (
                "Export the readings themselves, or add the reference and take the line away; or leave it out: "
                f"{Choice('columns', ('none',), 'capacitance')}"
            )
            return [Fault(message, sheet.text.path, number, advice=advice)]
    return []


_BESIDE = (
    ("series", re.compile(r"\b(?:series?|serie[ns]?|seriell|série|ser|cs|ls|reihe\w*)\b|直列|串联|串聯", re.IGNORECASE)),
    ("parallel", re.compile(r"\b(?:par|parallel\w*|parallèle|paralelo|cp|lp)\b|並列|并联|並聯", re.IGNORECASE)),
)


def circuit_beside_unit(sheet: Sheet, index: int) -> Circuit | None:
    """Which equivalent circuit the words beside the unit of a column name, in a row of units; None if they name none.

    Parameters
    ----------
    sheet : the record.
    index : which of its columns.
    """
    if sheet.units_line is None:
        return None
    line = without_comment_mark(sheet.text.lines[sheet.units_line - 1], sheet.delimiter)
    cells = split_line(line, sheet.delimiter)
    remark = found.remark if index < len(cells) and (found := unit_cell(cells[index])) is not None else ""
    named = [word for word, pattern in _BESIDE if pattern.search(remark)]
    return Circuit(named[0] if len(named) == 1 else "both", cells[index][:60], sheet.units_line) if named else None


# No capacitor loses more.
_LOSSY = 3.0


def impossible_loss(sheet: Sheet, index: int, dissipation: FloatArray, *, told: bool) -> list[Fault]:
    """Refuse a dissipation by which Cs is to be converted and which no capacitor has: it is in per cent or per mille.

    Parameters
    ----------
    sheet : the record.
    index : the column of the dissipation.
    dissipation : as read, nan where there is none.
    told : whether the user says its unit.
    """
    there = np.abs(dissipation[np.isfinite(dissipation)])
    if told or not there.size or float(np.median(there)) <= _LOSSY:
        return []
    return [
        Fault(
            f'column "{sheet.names[index]}": a dissipation of {float(np.median(there)):.3g} is none of a capacitor',
            sheet.text.path,
            int(sheet.lines[0]),
            index + 1,
            advice="Say in what it is, % for per cent or 1e-3 for per mille: --units dissipation=...",
        )
    ]


# A dissipation whose square, the share by which Cs and Cp differ, is no longer small beside other errors.
_LARGE = 0.1


def names_parallel(heading: Heading) -> bool:
    """Whether the name of a capacitance says that it is a parallel one: "cp", "capacitance cp", "parallel capacitance"."""
    return _NAMES_PARALLEL.search(heading.name) is not None


def untold_circuit(sheet: Sheet, index: int, heading: Heading, dissipation: FloatArray | None) -> tuple[list[str], list[Fault]]:
    """Note or refuse a capacitance that does not say whether it is Cp or Cs, by how far they differ.

    Parameters
    ----------
    sheet : the record.
    index, heading : the column of the capacitance.
    dissipation : of the same rows, nan where there is none; None if the file has none.
    """
    if names_parallel(heading):
        return [], []
    name = sheet.names[index] or f"column {index + 1}"
    if index in sheet.assigned:
        return [f'"{name}" is taken as Cp, the parallel capacitance, as asked'], []
    there = np.abs(dissipation[np.isfinite(dissipation)]) if dissipation is not None else np.zeros(0)
    large = float(np.quantile(there, 0.9)) if there.size else 0.0
    if large <= _LARGE:
        differ = f"; Cs would differ by {100 * large**2:.2g} %" if there.size else ""
        return [f'"{name}" does not say whether it is Cp or Cs; taken as Cp{differ}'], []
    asking = (sheet.name_for_asking(index),)
    series, parallel = Choice("columns", asking, "capacitance_series"), Choice("columns", asking, "capacitance")
    return [], [
        Fault(
            f'column "{name}" does not say whether it is Cp or Cs, which differ by {100 * large**2:.2g} % at D {large:.2g}',
            sheet.text.path,
            sheet.named_at,
            index + 1,
            advice=f"Say which: {parallel} for Cp, {series} for Cs",
            choice=parallel,
        )
    ]

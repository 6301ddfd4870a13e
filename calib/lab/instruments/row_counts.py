"""From the lines beside a table to the number of rows that they say it has, where there are fewer."""

from __future__ import annotations

import re

from calib.lab.instruments.sheet import Sheet

_THINGS = (
    r"(?:(?:data|scan|measured|measurement|test|logged)[ _-]*)?"
    r"(?:points?|samples?|readings?|rows?|records?|values?|lines?|scans?|measurements?)|data|"
    r"messwerte?n?|datenpunkte?n?|messpunkte?n?|datens[äa]tzen?|(?:daten|mess)?zeilen|werten?|punkten?|"
    r"points de mesure|mesures?|lignes|valeurs|puntos(?: de datos)?|muestras|filas|lecturas|medidas|"
    r"punti|campioni|righe|letture|misure|pontos|amostras|linhas|"
    r"meetpunten|punten|metingen|rijen|punktów|próbek|pomiarów|wierszy"
)
_NUMBER_OF = (
    r"(?:(?:total|acquired|recorded|measured|expected) )?"
    r"(?:numbers?|no\.?|nr\.?|num\.?|count|anzahl|zahl|nombre|nbre|número|numero|n[°º]|aantal|liczba|#)"
    r"[ _]*(?:(?:of|der|an|de|des|di|dei|van) )?"
)
# What is counted alone, in the plural: one sample may have this name. Few specimens are samples, too.
_PLURAL = (
    r"(?:(?:data|scan)[ _-]?)?(?:points|samples|readings|rows|records)|"
    r"messwerte|datenpunkte|messpunkte|datens[äa]tze|muestras|campioni|puntos|punti"
)
_COUNT = r"(?:data[ _-]?)?(?:points?|samples?|rows?|records?)[ _]count|n[ _](?:points|samples|rows)"
_OF_ALL = r"(?:[ _](?:per channel|in total|in all|in file|total))?"
_SAID = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        rf"(?:{_NUMBER_OF}(?:{_THINGS})|{_PLURAL}|{_COUNT}){_OF_ALL}[\s:=;,|\"']+(?P<number>\d{{1,9}})"
        r"(?:[\s;,|\"']+(?P=number))*(?:[\s\"',;]*(?:points|samples|rows|readings|records|pts))?",
        rf"(?P<number>\d{{1,9}})\s+(?:{_PLURAL})",
    )
)
_LONGEST = 120


def told_rows(sheet: Sheet) -> tuple[int, str]:
    """Find the number of rows that a line beside the table says it has, where the file has fewer: it may have been cut.

    A count may be of one channel, cycle or segment, or from before a resampling, so that nothing follows of one that is not
    more than there is.

    Parameters
    ----------
    sheet : with all its rows.

    Returns
    -------
    The number, and a note on it; 0 and "" where nothing says more rows than there are.
    """
    lines = sheet.lines_around
    said = {number: count for number, line in sorted(lines.items()) if (count := count_said(line)) > len(sheet.lines)}
    if not said:
        return 0, ""
    number, count = max(said.items(), key=lambda item: item[1])
    below = sum(bool(line.strip()) for line in sheet.text.lines[int(sheet.lines[0]) - 1 :])
    if count <= below:
        return 0, ""
    shown = " ".join(lines[number].replace('"', "").split()).strip(" #;,")[:60]
    return (
        count,
        f'"{shown}" stands in line {number}, and there are {len(sheet.lines)} of {count} rows: the file may have been cut',
    )


def count_said(line: str) -> int:
    """The number of rows that a line says, 0 if it says none.

    >>> [count_said(line) for line in ("Number of points:,240", "Samples;240", "Samples\\t240\\t240", "Anzahl Messwerte: 240")]
    [240, 240, 240, 240]
    >>> [count_said(line) for line in ("Sample: 240", "Points per second: 240", "Max. samples 240", "Samples: 240 Hz")]
    [0, 0, 0, 0]
    """
    text = line.strip(" \t#%*;,\"'") if len(line) <= _LONGEST else ""
    match = next((m for pattern in _SAID if (m := pattern.fullmatch(text)) is not None), None)
    return int(match["number"]) if match is not None else 0

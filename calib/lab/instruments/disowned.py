"""From the lines beside a record to those that say that a column that is read is not what the header says."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from calib.errors import Choice, Fault
from calib.lab.instruments.contrary import names_quantity, unit_against
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.units import IN_PLACE_OF
from calib.lab.instruments.vocabulary import understand

_QUANTITIES = ("force", "displacement", "capacitance")
_LONGEST, _MOST_LINES = 200, 400


def _words(pattern: str) -> re.Pattern[str]:
    return re.compile(rf"(?<![^\W\d_])(?:{pattern})(?![^\W\d_])", re.IGNORECASE)


# What is said of the columns: that two changed places, or that one is another than it seems.
_SWAPPED = _words(
    r"swapped|exchanged|interchanged|switched round|mixed up|transposed|vertauscht|verwechselt|inversée?s|échangée?s|"
    r"interverti\w*|intercambiad\w+|invertid\w+|trocad\w+|scambiat\w+|invertit\w+|verwisseld|zamienion\w+"
)
_WRONG = _words(
    r"wrong|mistaken?|incorrect|mislabell?ed|misnamed|erroneous|(?:is|are|was|were) (?:really|actually|in fact)|instead of|"
    r"should (?:be|read|say)|falsch\w*|fehlerhaft|eigentlich|in wirklichkeit|tatsächlich|sollte|faux|fausse|erronée?s?|"
    r"en fait|en réalité|equivocad\w+|incorrect[oa]s?|en realidad|errad\w+|na verdade|sbagliat\w+|errat\w+|in realtà|"
    r"verkeerd|eigenlijk|błędn\w+"
)
_COLUMN = _words(
    r"headers?|headings?|columns?|cols?|channels?|units?|spalten?|kanal|kanäle|kopfzeile|überschrift(?:en)?|einheit(?:en)?|"
    r"colonnes?|canal|canaux|en-?têtes?|unités?|columnas?|canales|encabezados?|unidad(?:es)?|colunas?|colonn[ae]|canal[ei]|"
    r"intestazion[ei]|unità|kolom(?:men)?|eenheid|kolumn\w*|jednostk\w*"
)
# Of what was put right, or is not of the readings.
_SETTLED = _words(
    r"replaced|repeated|corrected|fixed|mended|restarted|again|ersetzt|wiederholt|korrigiert|behoben|remplacée?|corrigée?|"
    r"reemplazad[oa]|corregid[oa]|control|controlled|rates?|speed|gripper"
)
_NUMBERED = re.compile(
    r"\b(?:col(?:umn)?s?|spalten?|channels?|kanal|colonnes?|columnas?|colonn[ae])\.? ?(\d{1,2})"
    r"(?: ?(?:and|und|et|y|e|&|,|/) ?(\d{1,2}))?",
    re.IGNORECASE,
)
# A list of all columns: "columns from left: time, force, displacement", "Spalten: 1 = Zeit, 2 = Kraft".
_LISTED = re.compile(r"\s*(?:[#%;!]+|//)?(?P<before>[^:=]{3,60}):\s*(?P<list>[^:]+)")
_OF_COLUMNS = _words(r"columns?|cols?|spalten?|colonnes?|columnas?|colunas?|colonn[ae]|kolom(?:men)?|kolumn\w*")
_PARTS = re.compile(r"[,;|]|(?<=\D)\s(?=\d{1,2}\s?[=.)])|\s(?:and|und|et|y|e)\s")
_NUMBER_BEFORE = re.compile(r"\s*(?:\d{1,2}\s?[=.)]?\s?)?(?P<name>.*?)\s*")
_LEVER = re.compile(r"\b(?:lever|hebel|levier|palanca|leva)\b\D{0,20}\d+(?:[.,]\d+)? ?[:/] ?\d+", re.IGNORECASE)


def disowned_in(
    lines: Iterable[tuple[int | None, str]],
    read: Mapping[str, tuple[str, int]],
    reading: Reading,
    path: Path,
) -> list[Fault]:
    """List the lines that say that columns that are read are not what the header says, as a fault of each.

    Columns that changed places, a header or a unit that is wrong, a load behind a lever: such words change what is read, and
    are settled by the user who names the columns, or their units, once more. What was put right before is none.

    Parameters
    ----------
    lines : number, None on another sheet, and text of each.
    read : quantity -> name and index of its column, -1 where the lines are of another sheet.
    reading : what the user says of the file.
    path : of the file.
    """
    faults = []
    for count, (number, line) in enumerate(lines):
        if count >= _MOST_LINES:
            break
        of = _spoken_of(line, read) if len(line) <= _LONGEST else ()
        if not of or set(of) <= {*reading.columns, *reading.units}:
            continue
        names = " and ".join(f'"{read[q][0]}"' for q in of)
        right = " ".join(str(Choice("columns", (read[q][0],), q)) for q in of)
        others = " ".join(f"--columns {q}=... --units {q}=..." for q in of)
        message = f'"{line.strip()[:80]}" may say that {names} {"is" if len(of) == 1 else "are"} not what the header says'
        advice = (
            f"If the header is right all the same, say so: {right}; else say which column each is, by its number, and in which "
            f"unit: {others}"
        )
        faults.append(Fault(message, path, number, advice=advice))
    return faults


def _in_another_order(line: str, read: Mapping[str, tuple[str, int]]) -> tuple[str, ...]:
    """The quantities that a list of all columns has in another order than they stand in; none of any other line."""
    match = _LISTED.fullmatch(line.strip())
    if match is None or not _OF_COLUMNS.search(match["before"]):
        return ()
    parts = [part for part in _PARTS.split(match["list"]) if part.strip()]
    names = [found["name"] for part in parts if (found := _NUMBER_BEFORE.fullmatch(part)) is not None]
    told = [heading.quantity for name in names if (heading := understand(name)) is not None]
    if len(told) != len(names) or len(set(told)) != len(told):
        return ()
    own = {IN_PLACE_OF.get(q, q): index for q, (_, index) in read.items() if index >= 0}
    listed = [q for q in (IN_PLACE_OF.get(q, q) for q in told) if q in own]
    if len(listed) < len(own):
        return ()
    there = sorted(listed, key=lambda q: own[q])
    return tuple(q for q in _QUANTITIES if q in listed and listed.index(q) != there.index(q))


def _spoken_of(line: str, read: Mapping[str, tuple[str, int]]) -> tuple[str, ...]:
    """The quantities that are read of which a line says that their columns are others than they seem."""
    if _LEVER.search(line) and "force" in read:
        return ("force",)
    if moved := _in_another_order(line, read):
        return moved
    swapped, wrong = _SWAPPED.search(line), _WRONG.search(line)
    if not (swapped or wrong) or _SETTLED.search(line):
        return ()
    own = {IN_PLACE_OF.get(q, q): q for q in read}
    named = [q for q in _QUANTITIES if q in own and names_quantity(line, q)]
    numbered = any(index >= 0 for _, index in read.values())  # as they are not on another sheet
    numbers = {int(n) - 1 for match in _NUMBERED.finditer(line) for n in match.groups() if n and numbered}
    named += [q for q in _QUANTITIES if q in own and q not in named and read[own[q]][1] in numbers]
    if swapped and len(named) > 1:
        return tuple(named)
    of_unit = tuple(q for q in named if unit_against(line, q, math.nan))
    if not _COLUMN.search(line):
        return of_unit
    return tuple(named) if named else () if numbers else tuple(q for q in _QUANTITIES if q in own)

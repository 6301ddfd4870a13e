"""From the lines beside a record to those that say that a column that is read is not what the header says."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from pathlib import Path

from calib.errors import Choice, Fault
from calib.lab.instruments.contrary import names_quantity, unit_against
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.units import stands_for
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
# "F and z swapped": two quantities by their symbols.
_SYMBOLS = {"F": "force", "C": "capacitance"} | dict.fromkeys("dsxzh", "displacement")
_TWO_SYMBOLS = re.compile(r"(?<![^\W_])([FCdsxzh])\s*(?:and|und|et|y|e|en|i|&|,|/|<?->)\s*([FCdsxzh])(?![^\W_])")
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
# "col 2 = force", "# Spalte 3: Kraft (N)": which column is what, by its number.
_ONE_COLUMN = re.compile(
    r"(?<![^\W\d_])(?:col(?:umn)?|spalte|colonne|columna|coluna|colonna|kolom|kolumna)\.? ?#?(?P<number>\d{1,2})\s?"
    r"(?:[=:]|is|ist|est|es)\s?"
    r"(?P<name>[^=:,;|]+?)\s*(?=[,;|.]|$|\s(?:and|und|et|y|e)\s)",
    re.IGNORECASE,
)
# Of a sign that was turned, by a word for it or of the force; a line that says which sign compression has is no such one.
_SIGN = _words(r"signs?|vorzeichen|signes?|signos?|segn[oi]|sinal|polarity|polarität|polarité|polaridad|polarità|teken|znak")
_TURNED = _words(
    r"invert(?:ed)?|reversed|flipped|negated|changed|opposite|invertiert\w*|umgekehrt\w*|gedreht\w*|negiert\w*|umgedreht\w*|"
    r"inversée?s?|opposée?s?|contraires?|invertid[oa]s?|cambiad[oa]s?|contrari[oa]s?|opuest[oa]s?|negad[oa]s?|invertit[oaie]|"
    r"oppost[oaie]|omgekeerd|odwrócon\w*"
)
_NEGATED = re.compile(
    r"(?<![^\W\d_])(?:(?:is|are|was|were|been|values?|channel|readings?) (?:inverted|negated|flipped)|negated|"
    r"(?:ist|sind|war|wurde) (?:invertiert|negiert)|(?:by|mit|par|por|per|[x×*]) ?[-−]1)(?![\w.,]*\d|[^\W\d_])",
    re.IGNORECASE,
)
_SENSE = re.compile(
    r"compress|druck|tension|tensile|zug|traction|trazione|tracción|compres|positi[vf]|negati[vf]", re.IGNORECASE
)
# Behind a quantity: that its readings were commanded, computed, or held. As many words may stand before.
_NO_READING = re.compile(
    r"(?<![^\W_])(?:(?:is|are|was|were|ist|sind|war|waren|est|sont|es|son|è|sono)\s+(?:the |an? |der |die |das |le |la |el )?"
    r"(?:peak[- ]?(?:hold|values?)|set ?points?|targets?|commanded|calculated|computed|simulated|estimated|sollwerte?|"
    r"berechnet|simuliert|calculée?s?|simulée?s?|consignes?|calculad[oa]s?|simulad[oa]s?|calcolat[oaie])|"
    r"not measured|nicht gemessen|non mesurée?s?|no medid[oa]s?|from (?:the )?set ?points?)(?![^\W_])",
    re.IGNORECASE,
)
_FEW_WORDS = 3
_EVENT = _words(
    r"at|when|while|during|after|before|until|from|every|each|if|bei|während|nach|vor|bis|ab|wenn|pendant|après|avant|quand|"
    r"durante|después|antes|cuando|dopo|prima|quando"
)
# A load that is that of one of several instruments: "Force is per cell".
_PER_ONE = re.compile(
    r"(?<![^\W\d_])(?:is|are|was|were|values?|readings?|given|shown|recorded|ist|sind|werte?|est|sont|es|son|è|sono|force|load|kraft|last|"
    r"fuerza|carga|forza|carico) (?:per|pro|par|por|je) "
    r"(?:load ?cells?|cells?|sensor|channel|leg|side|finger|transducer|capteur|cellule|"
    r"côté|zelle|kraftmessdose|aufnehmer|seite|kraftaufnehmer|celda|célula|lado|cella|sensore|lato)(?![^\W\d_])",
    re.IGNORECASE,
)


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
    own = {stands_for(q): q for q in read}
    settled = {*map(stands_for, (*reading.columns, *reading.units))}
    looked_at = [*islice(lines, _MOST_LINES)]
    numbered = _numbered_otherwise([line for _, line in looked_at], read)
    for number, line in looked_at:
        of = numbered.get(line) or _spoken_of(line, read) if len(line) <= _LONGEST else ()
        if not of or set(of) <= settled or (_turned(line) and set(of) <= {*reading.sign}):
            continue
        names = " and ".join(f'"{read[own[q]][0]}"' for q in of)
        right = " ".join(str(Choice("columns", (read[own[q]][0],), own[q])) for q in of)
        others = " ".join(f"--columns {own[q]}=... --units {q}=..." for q in of)
        message = f'"{line.strip()[:80]}" may say that {names} {"is" if len(of) == 1 else "are"} not what the header says'
        advice = (
            f"If the header is right all the same, say so: {right}; else say which column each is, by its number, and in which "
            f"unit: {others}"
        )
        if _turned(line):
            advice += f'; or say the sign: --sign "{of[0]}=compression positive" or --sign "{of[0]}=compression negative"'
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
    own = {stands_for(q): index for q, (_, index) in read.items() if index >= 0}
    listed = [q for q in (stands_for(q) for q in told) if q in own]
    if len(listed) < len(own):
        return ()
    there = sorted(listed, key=lambda q: own[q])
    return tuple(q for q in _QUANTITIES if q in listed and listed.index(q) != there.index(q))


def _numbered_otherwise(lines: Sequence[str], read: Mapping[str, tuple[str, int]]) -> dict[str, tuple[str, ...]]:
    """The lines that call a column by its number another quantity than it is read as, and the quantities that this is of.

    Columns may be counted from 0, which one of that number shows.
    """
    own = {index: stands_for(q) for q, (_, index) in read.items() if index >= 0}
    found: dict[str, tuple[str, ...]] = {}
    told = [
        (line, int(m["number"]), heading.quantity)
        for line in lines
        if len(line) <= _LONGEST
        for m in _ONE_COLUMN.finditer(line)
        if (heading := understand(m["name"].strip())) is not None
    ]
    first = 0 if any(number == 0 for _, number, _ in told) else 1
    for line, number, quantity in told:
        told_of, read_as = stands_for(quantity), own.get(number - first, "")
        if read_as and told_of != read_as and told_of in own.values():
            of = {told_of, read_as, *found.get(line, ())}
            found[line] = tuple(q for q in _QUANTITIES if q in of)
    return found


def _turned(line: str) -> bool:
    """Whether a line says that a sign was turned, and neither which one compression has nor when in the test."""
    turned = (_SIGN.search(line) is not None and _TURNED.search(line) is not None) or _NEGATED.search(line) is not None
    return turned and not _SENSE.search(line) and not _EVENT.search(line) and not _SETTLED.search(line)


def _spoken_of(line: str, read: Mapping[str, tuple[str, int]]) -> tuple[str, ...]:
    """The quantities that are read of which a line says that their columns are others than they seem."""
    if moved := _in_another_order(line, read):
        return moved
    if _turned(line):
        return tuple(q for q in ("force", "displacement") if q in read and names_quantity(line, q))
    if _PER_ONE.search(line) and "force" in read and names_quantity(line, "force"):
        return ("force",)
    own = {stands_for(q): q for q in read}
    if (none := _NO_READING.search(line)) is not None and len((before := line[: none.start()]).split()) <= _FEW_WORDS:
        held = tuple(q for q in _QUANTITIES if q in own and names_quantity(before, q))
        if held and not _SETTLED.search(line):
            return held
    swapped, wrong = _SWAPPED.search(line), _WRONG.search(line)
    if not (swapped or wrong) or _SETTLED.search(line):
        return ()
    named = [q for q in _QUANTITIES if q in own and names_quantity(line, q)]
    numbered = any(index >= 0 for _, index in read.values())  # as they are not on another sheet
    numbers = {int(n) - 1 for match in _NUMBERED.finditer(line) for n in match.groups() if n and numbered}
    named += [q for q in _QUANTITIES if q in own and q not in named and read[own[q]][1] in numbers]
    pair = _TWO_SYMBOLS.search(line) if swapped else None
    by_symbol = {_SYMBOLS[symbol] for symbol in pair.groups()} if pair is not None else set()
    named += [q for q in _QUANTITIES if q in by_symbol and q in own and q not in named and len(by_symbol) > 1]
    as_written = [q for q in _QUANTITIES if q in own and _stands_in(line, read[own[q]][0])] if swapped else []
    named += [q for q in as_written if q not in named and len(as_written) > 1]
    if swapped and len(named) > 1:
        return tuple(named)
    of_unit = tuple(q for q in named if unit_against(line, q, math.nan))
    if not _COLUMN.search(line):
        return of_unit
    return tuple(named) if named else () if numbers else tuple(q for q in _QUANTITIES if q in own)


def _stands_in(line: str, name: str) -> bool:
    """Whether a line holds a name as it is written above its column."""
    return re.search(rf"(?<![^\W_]){re.escape(name)}(?![^\W_])", line) is not None

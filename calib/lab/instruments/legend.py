"""From lines that say what columns of bare names are, `# t: time [s]`, `# F in mN`, a table of symbols, to a full header.

A line is one of a legend if it begins with the name of a column, or with its number, as the header below has them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from calib.errors import Choice, Fault, InputError, in_shell
from calib.lab.instruments.brackets import words_in
from calib.lab.instruments.clock_cells import is_reading
from calib.lab.instruments.declared import declared_units
from calib.lab.instruments.header import DELIMITERS, HEADER_WITHIN, split_line, without_comment_mark
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.lexicon import MOVING, PRESSING, QUALIFIERS, SENSORS
from calib.lab.instruments.lines import is_comment
from calib.lab.instruments.numbered import listed_header
from calib.lab.instruments.numbers import is_numeric
from calib.lab.instruments.stated import is_no_reading, quantity_of, stated_factors
from calib.lab.instruments.text import LabText
from calib.lab.instruments.units import (
    RECORDED,
    SI_UNIT,
    is_unit_of,
    is_unit_of_a_record,
    lab_factor,
    looks_like_unit,
    stands_for,
)
from calib.lab.instruments.vocabulary import Heading, as_a_record, understand

# Lines above a header that may be a legend, and letters of one.
_ABOVE, _LONGEST = 60, 160
# Letters of a name that is a symbol, which may mean anything; longer ones that are understood speak for themselves.
_SYMBOL = 3
_MARK = re.compile(r"^[\s#%!;/*|\"]+|[\s|\"]+$")
_BULLET = re.compile(r"^[-*•+]\s+")
_NUMBER = re.compile(
    r"(?:(?:col(?:umn|onne|umna|onna)?|spalte|field|feld)\s*\.?\s*)?[#(\[]?(?P<k>\d{1,2})[)\]]?\s*(?:[:=|,;.)\t–—-]+\s*|\s+)",
    re.IGNORECASE,
)
# Between a name and what it is.
_SEPARATOR = r"\s*(?:[:=|,;\t]|->|→|\s[-–—]\s|\s{2,}|\s(?:is|ist|est|es|è)\s|\s(?=(?:in|en|em)\s)|\s?(?=[\[(]))\s*"
# The unit that ends what is said: in brackets, behind "in", behind a comma or a stroke, or all of it.
_UNIT = re.compile(
    r"(?P<what>.*?)(?:\s*[(\[{]\s*(?P<bracket>[^()\[\]{}]+?)\s*[)\]}]|(?:^|[\s,])(?:in|en|em)\s+(?P<word>[^\s,;|]+)|"
    r"(?:^|\s*[,;|\t]\s*|\s{2,})(?P<last>[^\s,;|()]+))[\s.,;|]*",
    re.IGNORECASE,
)
_PARTS = re.compile(r"[;,]\s+|\s{2,}|(?<=[)\]])\s+|\s\|\s|\t|;|,(?=[^\W\d])|\s(?:and|und|et|y|e)\s")
# "[s] - time", and what is said behind the unit: "force [N], compression negative".
_UNIT_FIRST = re.compile(r"[(\[](?P<unit>[^()\[\]]+)[)\]]\s*[:=,–—-]\s*(?P<what>[^()\[\]:=]+)")
_BEHIND = re.compile(r"(?P<what>[^()\[\]]+?)\s*[(\[](?P<unit>[^()\[\]]+)[)\]](?P<more>[^\d=:]+)")
# "units: t=s d=mm": the word before what is said of units, and before each name with its mark behind it.
_OF_UNITS = re.compile(r"^(?:units?|einheiten|unités|unidades|unità)\s*[:=]\s*", re.IGNORECASE)
_BEFORE_EACH = re.compile(r"\s+(?=\S+?\s?[:=])")
# "All data in SI units (s, m, N)", "units: s, mm, N": a unit for each column, in their order.
_LIST = re.compile(
    r"[^()\[\]]*\b(?:units?|einheit(?:en)?|unités?|unidades|unità)\b[^()\[\]:=]*[:=(\[]\s*(?P<units>[^()\[\]:=]+)[)\]]?[\s.]*",
    re.IGNORECASE,
)
_SI = re.compile(
    r"[^\d()\[\]:=]*(?:[:=]\s*)?(?:\bsi[ -]?(?:base )?(?:units?|einheit(?:en)?|system)|"
    r"(?:unités?|unidades|unità)(?: du| del| de)? (?:système )?s\.?i)\b[^\d()\[\]:=]*",
    re.IGNORECASE,
)
# Words between those that say what a column is: "normal force measured by the load cell", "travel of the ball into the pad".
_BETWEEN = frozenset(
    re.findall(
        r"\w+",
        "of the a by from with in into on at to and as is it load cell since begin beginning der die das des dem den am im vom "
        "von zur zum mit le la les du de des en par au il lo del della di el los con por na w z do van het een door ab depuis",
    )
)
# How a meter takes a capacitance.
_CIRCUIT = re.compile(r"series|seriell|série|serie|parall[eè]le?", re.IGNORECASE)
# A name with a unit in brackets, in a header that states its own.
_OWN_UNIT = re.compile(r"(?P<name>[^()\[\]]+?)\s*[(\[](?P<unit>[^()\[\]]+)[)\]]")


@dataclass(frozen=True)
class _Said:
    """What a line of a legend says of a column: of its meaning, "" for none, and its unit, "" for none; its line, from 0."""

    meaning: str
    unit: str
    line: int


def with_legend(text: LabText, reading: Reading) -> tuple[LabText, Reading]:
    """Put what lines beside a header say of its columns, one by one, into the header, with a note, and empty these lines.

    A column that says its unit itself keeps it; a line that gives it another, or is of another quantity, is refused.

    Parameters
    ----------
    text : the file.
    reading : what the user says of it; a column may still be called as it is written.

    Raises
    ------
    InputError
        If two lines say different things of one column, or one contradicts the header.
    """
    header = None if (text.typed and text.units_line) or listed_header(text) is not None else _header(text)
    if header is None:
        return text, reading
    at, first, mark, written = header
    names = [_bare(name) for name in written]
    said: dict[int, _Said] = {}
    of_line: dict[int, set[int]] = {}
    for number in [*range(max(at - _ABOVE, 0), at), *range(at + 1, first)]:
        for index, (meaning, unit) in _said_in(text.lines[number], names, written, above=number < at).items():
            now = _Said(meaning, unit, number)
            of_line.setdefault(number, set()).add(index)
            _hold_against(text, at, index, written[index], said.get(index), now, reading)
            said[index] = now if index not in said or not said[index].unit else said[index]
    assigned = {_place(c, written): q for q, c in reading.columns.items()}
    said = {
        k: s
        for k, s in said.items()
        if names[k] == written[k] and _says_more(names[k], s, text) and _goes_with(s, assigned.get(k))
    }
    new = {k: _named(names[k], s) for k, s in said.items()}
    if not new or not _is_one(new, said):
        return text, reading
    if not assigned:
        _check_exchanged(text, at, names, new, said)
    used = {s.line for s in said.values()}
    cells = [new.get(k, name) for k, name in enumerate(written)]
    quote = '"' if any(mark in cell for cell in cells) else ""
    header_line = mark.join(f"{quote}{cell}{quote}" for cell in cells)
    lines = [header_line if line == text.lines[at] else line for line in text.lines]
    # What a name does not hold of its line may be a sign, or a remark on the readings.
    more = {s.line for k, s in said.items() if s.meaning and s.meaning not in new[k]}
    more |= {number for number, columns in of_line.items() if not columns <= new.keys()}
    for number in (*(used - more), *_titles(text.lines, used)):
        lines[number] = ""
    shown = ", ".join(f'"{names[k]}" is "{new[k]}"' for k in sorted(new))
    where = f"line {min(used) + 1} says" if len(used) == 1 else f"lines {min(used) + 1} to {max(used) + 1} say"
    columns = {q: new.get(_place(c, written), c) for q, c in reading.columns.items()}
    told = f"{where} what the columns of line {at + 1} are: {shown}"
    return replace(text, lines=tuple(lines), notes=(*text.notes, told)), replace(reading, columns=columns)


def _place(column: str, written: Sequence[str]) -> int:
    """The place of a column that the user names, by its name or number; -1 if it is none."""
    if column in written:
        return written.index(column)
    return int(column) - 1 if column.isdecimal() and 0 < int(column) <= len(written) else -1


def _goes_with(said: _Said, quantity: str | None) -> bool:
    """Whether the unit that a line says of a column is one of what the user says it is."""
    return quantity is None or not said.unit or is_unit_of(said.unit, stands_for(quantity))


def _header(text: LabText) -> tuple[int, int, str, list[str]] | None:
    """The line of names above the first row of numbers, that row, what parts the names, and these."""
    lines = text.lines
    first = next((i for i, line in enumerate(lines[:HEADER_WITHIN]) if _delimiter(line)), 0)
    delimiter = _delimiter(lines[first]) if first else ""
    if not delimiter:
        return None
    width = len(_cells(lines[first], delimiter))
    for at in range(first - 1, max(first - 1 - _ABOVE, -1), -1):
        line = without_comment_mark(lines[at], delimiter).strip(" ")
        # Names between commas stand above rows between blanks or tabs.
        for mark in (delimiter, *(m for m in ",;" if delimiter in " \t" and m in line)):
            cells = _cells(line, mark)
            is_header = len(cells) == width and all(cells) and len({*cells}) == width and not any(map(_is_no_name, cells))
            if is_header and not _are_units(cells, lines[at - 1] if at else "", mark):
                return at, first, "\t" if mark == " " else mark, cells
    return None


def _delimiter(line: str) -> str:
    """What parts the cells of a row of numbers; "" for any other line."""
    for delimiter in DELIMITERS:
        cells = _cells(line, delimiter)
        numbers = sum(is_reading(cell) for cell in cells)
        if numbers > 1 and 2 * numbers > len(cells):
            return delimiter
    return ""


def _cells(line: str, delimiter: str) -> list[str]:
    """The cells of a line without the empty ones behind them."""
    cells = split_line(line, delimiter)
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _are_units(cells: Sequence[str], above: str, mark: str) -> bool:
    """Whether cells are units below as many names."""
    names = _cells(above, mark)
    return all(map(looks_like_unit, cells)) and len(names) == len(cells) and all(names) and not any(map(is_numeric, names))


def _is_no_name(cell: str) -> bool:
    return is_numeric(cell) or len(cell) > 40 or (looks_like_unit(cell) and len(cell) > 1) or ":" in cell or "=" in cell


def _bare(name: str) -> str:
    """A name without the unit in brackets behind it."""
    match = _OWN_UNIT.fullmatch(name)
    return match["name"] if match is not None else name


def _said_in(line: str, names: Sequence[str], written: Sequence[str], *, above: bool) -> dict[int, tuple[str, str]]:
    """What a line says of columns: index -> meaning and unit; nothing unless all of it does."""
    if not line.strip() or len(line) > _LONGEST:
        return {}
    plain = _BULLET.sub("", _MARK.sub("", line))
    if any(len(cells := _cells(plain, mark)) == len(names) and all(map(looks_like_unit, cells)) for mark in DELIMITERS):
        return {}  # a row of units
    if above and (listed := _listed(plain, names, written)):
        return listed
    plain = _OF_UNITS.sub("", plain)
    ways = (_PARTS.split(plain), _BEFORE_EACH.split(plain))
    found: list[tuple[int, tuple[str, str]] | None] = [None]
    for parts in ([part.strip() for part in way if part and part.strip()] for way in ways):
        found = found if all(found) else [_of_part(part, names, alone=False) for part in parts] if len(parts) > 1 else [None]
    of = [one for one in found if one is not None]
    if len(of) == len(names) and of != sorted(of) and not any(meaning for _, (meaning, _) in of) and not is_comment(line):
        return {}  # another header
    if not all(found):
        found = [_of_part(plain, names)]
    return dict(one for one in found if one is not None)


def _listed(line: str, names: Sequence[str], written: Sequence[str]) -> dict[int, tuple[str, str]]:
    """The units of a line that lists one for each column, in their order, or says that they are those of the SI."""
    match = _LIST.fullmatch(line)
    units = [unit for unit in re.split(r"[\s,;|]+", match["units"].strip()) if unit] if match is not None else []
    if len(units) == len(names) and all(map(looks_like_unit, units)):
        fits = all(understand(f"{name} ({unit})") is not None for name, unit in zip(names, units, strict=True))
        return {k: ("", unit) for k, unit in enumerate(units)} if fits else {}
    if _SI.fullmatch(line) is None:
        return {}
    plain = {k: h for k, name in enumerate(written) if (h := understand(name)) is not None and h.unit is None and not h.letter}
    # A symbol that means one thing alone.
    plain |= {k: h for k, name in enumerate(written) if k not in plain and (h := _only_meaning(name)) is not None}
    return {k: ("", SI_UNIT[h.quantity]) for k, h in plain.items() if stands_for(h.quantity) in RECORDED}


def _only_meaning(name: str) -> Heading | None:
    """What a symbol means in the units of the SI, if that is one quantity of a record alone."""
    of = _meanings(name)
    return next(iter(of.values())) if len(of) == 1 else None


def _meanings(name: str) -> dict[str, Heading]:
    """What a symbol is, by quantity, with a unit of that behind it."""
    found = {q: understand(f"{name} ({SI_UNIT[q]})") for q in RECORDED if understand(name) is None or len(name) <= _SYMBOL}
    return {q: h for q, h in found.items() if h is not None and stands_for(h.quantity) == q}


def _of_part(part: str, names: Sequence[str], *, alone: bool = True) -> tuple[int, tuple[str, str]] | None:
    """The column that a line, or a part of it, is of, its meaning and its unit; None if it is of none."""
    number = _NUMBER.match(part) if alone else None
    own = part[number.end() :] if number is not None else part
    k = int(number["k"]) - 1 if number is not None else -1
    for index in sorted(range(len(names)), key=lambda i: -len(names[i])):
        symbol = rf"[`'\"]?{re.escape(names[index])}[`'\"]?"
        match = re.match(rf"{symbol}(?:{_SEPARATOR})", own)
        if match is not None and k in (-1, index):
            return _meant(own[match.end() :], index, names)
        turned = re.fullmatch(
            rf"(?P<what>[^\d:=,;()\[\]]+?)\s*(?:[:=]|\sis)\s*{symbol}\s*[,(\[]\s*(?P<unit>[^()\[\],]+)[)\]]?", own
        )
        if turned is not None and understand(f"{turned['what']} ({turned['unit']})") is not None:
            return index, (turned["what"].strip(), turned["unit"].strip())
    return _meant(own, k, names) if 0 <= k < len(names) else None


def _meant(rest: str, index: int, names: Sequence[str]) -> tuple[int, tuple[str, str]] | None:
    """Meaning and unit of what stands behind a name; None if it has no unit, and is no quantity."""
    rest = rest.strip()
    first = _UNIT_FIRST.fullmatch(rest)
    behind = _BEHIND.fullmatch(rest) if first is None else None
    if first is not None and looks_like_unit(first["unit"]):
        rest = f"{first['what']} ({first['unit']})"
    elif behind is not None and looks_like_unit(behind["unit"]) and not stated_factors([behind["more"]]):
        rest = f"{behind['what']}, {behind['more'].strip(' ,;-()[]')} ({behind['unit']})"
    match = _UNIT.fullmatch(rest)
    unit = (match["bracket"] or match["word"] or match["last"] or "") if match is not None else ""
    if match is None or not looks_like_unit(unit):
        heading = understand(rest) if rest and not any(map(str.isdigit, rest)) else None
        return (index, (rest, "")) if heading is not None and heading.unit is None and not heading.letter else None
    what = match["what"].strip(" ,;|:-–—\t*_`")
    of_others = any(re.match(rf"{re.escape(name)}\s*[,;:=|]", what) for name in names)
    if of_others or "=" in what or (any(map(str.isdigit, what)) and understand(f"{what} ({unit})") is None):
        return None
    return index, (what, unit)


def _says_more(name: str, said: _Said, text: LabText) -> bool:
    """Whether a line is needed for a column: of a symbol, or of a name that is not understood, or a unit that it lacks."""
    heading = understand(name)
    if not said.meaning and not is_unit_of_a_record(said.unit):
        return False
    if heading is None or len(name) <= _SYMBOL:
        return True
    return not said.meaning and heading.unit is None and not declared_units([text.lines[said.line]])


def _named(name: str, said: _Said) -> str:
    """The name of a column as its line says it: what it is, and its unit."""
    unit = f" ({said.unit})" if said.unit else ""
    if not said.meaning:
        return f"{name}{unit}"
    if understand(f"{said.meaning}{unit}") is not None or as_a_record(f"{said.meaning}{unit}") is not None:
        return f"{said.meaning}{unit}"
    first = re.split(r"[,;.(\[]|\s[-–—]\s", said.meaning)[0].strip()
    quantity = next((h.quantity for h in (understand(f"{first}{unit}"),) if h is not None), quantity_of(first))
    quantity = stands_for(quantity) if quantity is not None else ""
    if not quantity or not is_unit_of(said.unit, quantity) or is_no_reading(quantity, said.meaning):
        return f"{said.meaning}{unit}"
    if understand(f"{first}{unit}") is None and not all(_says_nothing_else(word, quantity) for word in words_in(first)):
        return f"{said.meaning}{unit}"
    circuit = _CIRCUIT.search(said.meaning) if quantity == "capacitance" else None
    plain = first if understand(f"{first}{unit}") is not None else quantity
    return f"{plain} ({circuit[0]}){unit}" if circuit is not None and circuit[0] not in plain else f"{plain}{unit}"


def _says_nothing_else(word: str, quantity: str) -> bool:
    """Whether a word is a name of a quantity, of what presses and moves, or one between such words."""
    own = understand(word)
    of_press = word.startswith(tuple(PRESSING)) or word in MOVING | QUALIFIERS | SENSORS
    return of_press or word in _BETWEEN or (own is not None and stands_for(own.quantity) == quantity)


def _is_one(new: Mapping[int, str], said: Mapping[int, _Said]) -> bool:
    """Whether what is said of the columns is a legend of a record: a unit of one is among it, or two quantities."""
    return any(is_unit_of_a_record(s.unit) for s in said.values()) or sum(understand(n) is not None for n in new.values()) > 1


def _check_exchanged(text: LabText, at: int, names: Sequence[str], new: Mapping[int, str], said: Mapping[int, _Said]) -> None:
    """Refuse two symbols each of which is said to be what the other one usually is: lines may have changed places."""
    found = {k: h for k, name in new.items() if (h := understand(name)) is not None and said[k].unit}
    for k, heading in found.items():
        usual = _meanings(names[k])
        for other, its in found.items():
            if other == k or heading.quantity in usual or its.quantity not in usual or its.quantity in _meanings(names[other]):
                continue
            ways = ([(k, heading, k), (other, its, other)], [(other, heading, k), (k, its, other)])
            said_so, exchanged = (
                " ".join(
                    f"--columns {in_shell(f'{h.quantity}={names[column]}')} --units {h.quantity}={said[of].unit}"
                    for column, h, of in way
                )
                for way in ways
            )
            raise InputError(
                Fault(
                    f'line {said[k].line + 1} says that "{names[k]}" is the {heading.quantity}, '
                    f'line {said[other].line + 1} that "{names[other]}" is the {its.quantity}, which "{names[k]}" usually is',
                    text.path,
                    at + 1,
                    k + 1,
                    advice=f"If that is so: {said_so}; if the two lines changed places: {exchanged}",
                )
            )


def _titles(lines: Sequence[str], used: set[int]) -> Iterator[int]:
    """The line of titles above a legend, "Symbol;Meaning;Unit"."""
    above = min(used) - 1
    cells = [c for c in re.split(r"[\s,;|\t]+", _MARK.sub("", lines[above])) if c] if above >= 0 else []
    if 1 < len(cells) <= 4 and all(_TITLE.fullmatch(cell) for cell in cells):
        yield above


_TITLE = re.compile(
    r"(?:columns?|col|symbols?|names?|variables?|fields?|quantity|quantities|meaning|description|units?|no|nr|#|type|channel|"
    r"spalten?|symbole?|größen?|bedeutung|beschreibung|einheit(?:en)?|kanal|colonnes?|grandeurs?|unités?|description|"
    r"columnas?|símbolos?|magnitud|unidad(?:es)?|colonn[ae]|simbol[oi]|grandezz[ae]|unità)\.?",
    re.IGNORECASE,
)


def _hold_against(text: LabText, at: int, index: int, cell: str, before: _Said | None, now: _Said, reading: Reading) -> None:
    """Refuse what a line says of a column that another line, or the header, contradicts."""
    line = text.lines[now.line].strip()[:60]
    declared = declared_units([text.lines[now.line]])
    said = [q for q in RECORDED if is_unit_of(now.unit, q)] if before is not None and _differ(before, now) else []
    if before is not None and said and not {*said} & {*reading.units, *declared}:
        other = text.lines[before.line].strip()[:60]
        message = f'column "{cell}": line {before.line + 1} says "{other}", line {now.line + 1} "{line}"'
        which = Choice("units", (before.unit, now.unit), said[0]) if is_unit_of(before.unit, said[0]) else None
        advice = f"Correct one of the two lines, or say which is right: {which}" if which else "Correct one of the two lines"
        raise InputError(Fault(message, text.path, now.line + 1, advice=advice, choice=which))
    own = understand(cell)
    if own is None or own.unit is None or not now.unit or not is_unit_of(own.unit, own.quantity):
        return
    quantity = stands_for(own.quantity)
    if {own.quantity, quantity} & {*reading.units, *reading.columns} or _agrees(own, now):
        return
    if quantity in declared:
        return  # which is held against the header with all that declares units
    if now.meaning and understand(f"{now.meaning} ({now.unit})") is None:
        return  # of something else, as far as is known
    others = [q for q in RECORDED if is_unit_of(now.unit, q)]
    choice = Choice("units", (own.unit, now.unit) if quantity in others else (own.unit,), quantity)
    says = "say which is right" if quantity in others else "if the header is right"
    raise InputError(
        Fault(
            f'line {now.line + 1} says of column "{cell}" of line {at + 1}: "{line}", its own unit is {own.unit}',
            text.path,
            now.line + 1,
            index + 1,
            advice=f"Correct one of the two, or {says}: {choice}",
            choice=choice,
        )
    )


def _agrees(own: Heading, now: _Said) -> bool:
    """Whether a unit is that of a header, or none of a record."""
    of = [q for q in RECORDED if is_unit_of(now.unit, q)]
    if not of:
        return True
    quantity = stands_for(own.quantity)
    return quantity in of and lab_factor(now.unit, quantity) == lab_factor(own.unit or "", quantity)


def _differ(before: _Said, now: _Said) -> bool:
    """Whether two lines give a column different units."""
    if not before.unit or not now.unit:
        return False
    of = [q for q in RECORDED if is_unit_of(before.unit, q)]
    return not any(is_unit_of(now.unit, q) and lab_factor(now.unit, q) == lab_factor(before.unit, q) for q in of) and bool(of)

"""From lines that hold numbers in a text that is the same in all, `press {"t_s":0.1,"F_N":0.2}`, to a `Sheet` of these."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import dropwhile

import numpy as np

from calib.errors import Fault, InputError
from calib.lab.instruments.between import SPECIMEN
from calib.lab.instruments.brackets import is_letter, no_record, usual_case
from calib.lab.instruments.declared import declared_decimal, declared_units
from calib.lab.instruments.header import find_header, without_comment_mark
from calib.lab.instruments.labtable import AS_FOUND, Reading
from calib.lab.instruments.lines import not_read
from calib.lab.instruments.named_values import units_said_above
from calib.lab.instruments.run_on import is_only_words
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.text import LabText
from calib.lab.instruments.units import is_unit_of, looks_like_unit
from calib.lab.instruments.vocabulary import understand

# A date, a time of day, or both, a number, and what stands in the place of one. A digit behind a letter or a point is none,
# such as those of "CH1" and of an address.
_DATE = r"(?:\d{4}[-/.]\d{1,2}[-/.]\d{1,2}|\d{1,2}[-/.]\d{1,2}[-/.]\d{2,4})"
_CLOCK = (
    rf"{_DATE}[T ]\d{{1,2}}:\d\d(?::\d\d(?:[.,]\d{{1,9}})?)?"
    r"(?:Z(?!\w)|[+-]\d\d:?\d\d)?"
    rf"|\d{{1,2}}:\d\d:\d\d(?:[.,]\d{{1,9}})?|{_DATE}"
)
_SIGN = r"(?<![\w.)\]])[-+\u2212]?"
_END = r"(?:[eE][-+]?\d{1,3})?(?![\d]|[.,]\d)(?![eE][-+]?\d)"
_POINT = rf"{_SIGN}(?:\d+(?:\.\d*)?|\.\d+){_END.replace('[.,]', '[.]')}"
_COMMA = rf"{_SIGN}\d+(?:,\d+)?{_END}"
_NONE = (
    r"(?<![\w.])-?(?:nan|NaN|NAN|None|null|NULL|NA|inf|Infinity|true|false|True|False|OVER|OVLD|OL|"
    r"DEBUG|INFO|NOTICE|WARN|WARNING|ERROR|TRACE)(?![\w.])"
)
_MARKS = {mark: re.compile(rf"(?<![\w.:])(?:{_CLOCK})(?![\d:])|{n}|{_NONE}") for mark, n in ((".", _POINT), (",", _COMMA))}
_IS_NONE = re.compile(r"-?(?:nan|none|null|na)", re.IGNORECASE)
_IS_CLOCK = re.compile(_CLOCK)
_WITH_DECIMALS = re.compile(r"(?<![\w.])\d+\.\d+(?!\.?\d)")
# Lines in the middle of a file that show its form; how many share it at least, of which share of those with numbers.
_LOOKED_AT, _FEWEST, _NEARLY_ALL = 60, 5, 0.8
# Rows below which no names stand.
_FIRST_ROWS = 30
# Of messages in turn, each is so large a share of them.
_IN_TURN = 0.1
# Characters of a line of such a form, and numbers in it.
_LONGEST, _MOST = 2000, 60
# A row of a table, of numbers with points between one kind of marks; a quick look at what most files are.
_CELL = r"(?:[-+]?(?:\d++(?:\.\d*+)?+|\.\d++)(?:[eE][-+]?\d{1,3})?+)"
_OF_TABLES = (
    *(re.compile(rf'[ "]*+{_CELL}?+[ "]*+(?:{mark}[ "]*+{_CELL}?+[ "]*+)*+') for mark in ",;\t"),
    re.compile(rf" *+{_CELL}(?: ++{_CELL})*+ *+"),
)
# What stands between the cells of a table, and around the rows of one in brackets.
_BETWEEN_CELLS = re.compile(r"[\"'\s,;|]*")
_OPENED, _CLOSED, _CHECKSUM = r"[\s\[(]*", r"[\s\]),;]*", re.compile(r"\*[0-9A-Fa-f]{2}$")
# "t+0.1 s: F=0.2 N": the time since the start.
_SINCE_START = re.compile(r"[\[(]?\s?[tT]\s?\+\s?")
# What stands beside a number that changes it: signs, powers, "less than", fractions, and minutes.
_CHANGES_NEXT, _CHANGES_LAST = (
    re.compile(r"(?:[-+\u2212\u2013<~±^×·*≤≥]|[:=(,;]\s*[-\u2212\u2013]\s*|^[/:'.])$"),
    re.compile(r"[-\u2212\u2013^](?!>)|\s?[×·*]\s?10"),
)
# A factor in the text, "x10".
_FACTOR = re.compile(r"(?<![^\W_])[x×*]\s?\d+(?![\w:])", re.IGNORECASE)
_LETTER = re.compile(r"[^\W\d_]")
_UNIT = re.compile(r"[\"')\]}]?\s?[\[({]?(?P<unit>[^\s,;|&:=\"'()\[\]{}<>]{1,12}?)[\])}]?(?=$|/\s?$|[\s,;|&\"'()\]{}<.:=])")
# What makes the word before it a name, if no other name stands behind: "0.1 N=5", but not "0.1 s: F = 5".
_OF_NAME = re.compile(r"[\"')\]]?\s*[:=](?![^:=]*[^\W\d_])")
# How far a number may be off, as a number behind it: "0.1 +/- 0.01".
_TOLERANCE = re.compile(r"\s*(?:±|\+/-|\+-)\s*")
_UNIT_KEY = re.compile(
    r"[^{}]{0,40}?(?:\bunits?\b[\"']?|[\"']u[\"'])\s*[:=]\s*[\"']?(?P<unit>[^\s,;\"'{}]{1,12})", re.IGNORECASE
)
_GLUED = re.compile(r"[^\W\d_]{1,6}")
# A name is what stands between marks that a program puts around names.
_AROUND = re.compile(r"[,;|&{}<>\"'`:=\t]+|(?<!\w)[\[\](]|[\])](?=\s*[^\s:=])|(?<=\w)\((?=[^()]*$)|(?<=\s)->")
_LIST = re.compile(r"[(\[](?P<names>[^()\[\]]*(?:[(\[][^()\[\]]{1,12}[)\]][^()\[\]]*)*)[)\]]")
# The text of JSON and of Python, whose numbers have a decimal point.
_OF_PROGRAM = re.compile(r"[{,]\s?(?:\"[^\"]*\"|'[^']*')\s?:")
_NUMBERED = re.compile(r"\b(?:run|test|trial|cycle|record|press|specimen|sample)\b[^\w]*\d", re.IGNORECASE)
_FILLERS = re.compile(r"^(?:(?:and|the|at|a|then)\s+)+|(?:\s+(?:was|is|reads?|value|of|at))+$", re.IGNORECASE)
# What stands for the value behind its name.
_OF_VALUES = re.compile(
    r"v|val|values?|readings?|data|measurements?|measured|(?:sending )?state|is|wert|messwert|valeur|valor|valore|waarde",
    re.IGNORECASE,
)
# A name as programs give it, right before its value.
_OF_PROGRAMS = re.compile(r"\w[=:]\s?[\"']?$")
# Words before a name that are none of it: a level, an address.
_OF_LOGGERS = re.compile(r"DEBUG|INFO|NOTICE|WARN(?:ING)?|ERROR|TRACE|CRITICAL|[\w.-]{2,}[/@][\w./@-]+")
_OF_CLOCKS = "received"
_ABOVE, _UNITS_ABOVE = 3, 20


@dataclass(frozen=True)
class _Form:
    """The text of a line around its numbers: literals, one more than there are numbers, and the decimal mark of these."""

    literals: tuple[str, ...]
    mark: str

    @property
    def pattern(self) -> re.Pattern[str]:
        between = ["".join(r"\s*" if c == " " else re.escape(c) for c in literal) for literal in self.literals]
        # Blanks fill up numbers within brackets: "[    0.100000] F=0.2".
        between[0] += r"\s*" if self.literals[0][-1:] in tuple("[(") else ""
        between[1:-1] = [text if text != r"\s*" else r"\s+" for text in between[1:-1]]
        number = f"({_MARKS[self.mark].pattern})"
        return re.compile(_OPENED + number.join(between) + _CLOSED + f"(?:{_CHECKSUM.pattern})?")

    @property
    def shown(self) -> str:
        """The text with the numbers of its numbers in their place."""
        parts = [f"{literal}#{k}" for k, literal in enumerate(self.literals[:-1], 1)]
        return ("".join(parts) + self.literals[-1]).strip()


def of_one_form(text: LabText, reading: Reading) -> Sheet | None:
    """Cut a file whose lines differ by their numbers alone into a sheet with a column for each number; None of any other.

    A column has the name that the text before its numbers holds, with the unit behind them, else that which stands at its place
    in a line above the rows, else its number. Numbers in the text that never change are part of it.

    Parameters
    ----------
    text : the file.
    reading : what the user says of it.

    Raises
    ------
    InputError
        If lines of several forms are written in turn, a line among the others may be a row of its own kind, or no column has a
        name and the user says of none what it is.
    """
    middle = max(0, len(text.lines) // 2 - _LOOKED_AT)
    sample = [line for line in text.lines[middle : middle + 2 * _LOOKED_AT] if line.strip()]
    if len(sample) < _FEWEST or max(map(len, sample)) > _LONGEST:
        return None
    least = max(_FEWEST, _IN_TURN * len(sample))
    if sum(not any(row.fullmatch(line) for row in _OF_TABLES) for line in sample) < least:
        return None
    forms = _forms_of(sample)
    often = [(form, n) for form, n in forms.most_common(6) if n >= least]
    if not often or not any(_is_text(form) for form, _ in often):
        return None
    form = often[0][0]
    named = _has_header(text, form)
    if often[0][1] < _NEARLY_ALL * forms.total():
        if sum(n for _, n in often) >= _NEARLY_ALL * forms.total() and not named:
            _refuse_in_turn(text, [form for form, _ in often])
        return None
    if not _is_text(form):
        return None
    is_plain = not any(map(_LETTER.search, form.literals))
    if named and not is_plain:
        return None
    rows, lines = _rows_of(text, form)
    if len(form.literals) < 3 or len(rows) < _FEWEST or _may_change(form, rows):
        return None
    form, rows = _without_constants(form, rows)
    width = len(form.literals) - 1
    if width < 2:
        return None
    names, units = _names_and_units(form, rows)
    last = next((i for i in reversed(range(lines[0] - 1)) if text.lines[i].strip()), -1)
    listed = _list_before(form.literals[0], width) if not any(names) else []
    above = next(
        (
            (i, found)
            for i in range(last, max(last - _ABOVE, -1), -1)
            if not any(names) and (found := _names_in(text.lines[i], form))
        ),
        None,
    )
    if not (above and is_plain) and named:
        return None
    by_number = any(map(str.isdecimal, reading.columns.values()))
    if not any(names) and not listed and not above and any(units) and not by_number:
        return None  # numbers with their units alone
    own = listed or (above[1] if above else names)
    called = [
        name or (str(k) if not _IS_CLOCK.fullmatch(cell) else _OF_CLOCKS if ":" in cell else "date")
        for k, (name, cell) in enumerate(zip(own, rows[0], strict=True), 1)
    ]
    if len({*called}) < len(called):
        called = [name if called.count(name) == 1 else f"{name} {k}" for k, name in enumerate(called, 1)]
    written = [(n, line) for n, line in enumerate(text.lines[: lines[0] - 1], 1) if line.strip()]
    units_line, said = units_said_above(written[-_UNITS_ABOVE:], called, units)
    units = [said.get(name, unit) for name, unit in zip(called, units, strict=True)]
    at = above[0] if above else -1
    notes, beside = _others(text, form, lines, at)
    unnamed = not any(understand(name) for name in called if name not in (_OF_CLOCKS, "date"))
    if unnamed and not any(units) and not reading.columns:
        raise InputError(_nameless(text, form, rows, lines, called))
    columns = [list(column) for column in zip(*rows, strict=True)]
    sheet = Sheet(
        text,
        "\t",
        0,
        tuple(called),
        units_line=units_line or None,
        units=tuple(units) if any(units) else (),
        declared_units=declared_units(text.lines[: lines[0] - 1]),
        declared_decimal="." if _OF_PROGRAM.search(form.shown) else declared_decimal(text.lines[: lines[0] - 1]),
        columns=tuple([["" if _IS_NONE.fullmatch(c) else c for c in column] for column in columns]),
        lines=np.array(lines, dtype=np.int64),
        cut_short=_is_cut(text, form, rows, lines),
        beside=tuple(beside.items()),
    )
    many = (
        f"{len(lines)} lines, from line {lines[0]} on, differ by their numbers alone, which are the columns: {form.shown[:300]}"
    )
    names_at = [f"their names are those of line {at + 1}"] if above else []
    if said:
        names_at.append(f"line {units_line} says their units: {', '.join(f'{name} in {unit}' for name, unit in said.items())}")
    outside = [i - 1 for i in beside if not lines[0] < i < lines[-1] and i != units_line]
    unread = not_read(sheet, outside, "no line of that form")
    return replace(sheet, notes=(many, *names_at, *notes), unread=tuple(unread))


def _has_header(text: LabText, form: _Form) -> bool:
    """Whether names are understood above the first lines of a form, or in these."""
    pattern = form.pattern
    first = next((i for i, line in enumerate(text.lines) if len(line) <= _LONGEST and pattern.fullmatch(line)), 0)
    return find_header(replace(text, lines=text.lines[: first + _FIRST_ROWS]), AS_FOUND) is not None


def is_of_one_form(lines: Sequence[str]) -> bool:
    """Whether nearly all lines are of one form, with two numbers or more in a text that is no table's.

    Parameters
    ----------
    lines : of a file, without blank ones.

    >>> is_of_one_form(['{"t": 0.1, "F": 0.2}'] * 5), is_of_one_form(["0.1,0.2"] * 5)
    (True, False)
    """
    forms = _forms_of(lines[:_LOOKED_AT])
    form, count = forms.most_common(1)[0] if forms else (None, 0)
    return (
        form is not None
        and count >= max(_FEWEST, _NEARLY_ALL * len(lines[:_LOOKED_AT]))
        and len(form.literals) > 2
        and _is_text(form)
    )


def _forms_of(lines: Sequence[str]) -> Counter[_Form]:
    """The forms of lines, each with how many of them have it, but for those without a number."""
    found = Counter(form for line in lines if (form := _form_of(line, ".")) is not None)
    if any(_WITH_DECIMALS.search(_IS_CLOCK.sub("", line)) for line in lines):
        return found
    with_commas = Counter(form for line in lines if (form := _form_of(line, ",")) is not None)
    points, commas = (forms.most_common(1)[0][0] if forms else None for forms in (found, with_commas))
    if points is None or commas is None or len(points.literals) == len(commas.literals):
        return found
    # "F=0,1 x=0,2" has decimal commas; numbers between commas in brackets may be whole ones.
    return with_commas if all(literal != "," for literal in commas.literals) and _is_text(commas) else Counter()


def _form_of(line: str, mark: str) -> _Form | None:
    parts = _MARKS[mark].split(_CHECKSUM.sub("", line.strip()))
    if not 1 < len(parts) <= _MOST:
        return None
    literals = [re.sub(r"[ ]+", " ", part) for part in parts]
    # The first and the last row of a list have a bracket more.
    literals[0] = re.sub(rf"^{_OPENED}", _first_bracket, literals[0])
    literals[-1] = re.sub(rf"{_CLOSED}$", _first_bracket, literals[-1])
    return _Form(tuple(literals), mark)


def _first_bracket(found: re.Match[str]) -> str:
    return re.sub(r"[^\[\]()]", "", found[0])[:1]


def _is_text(form: _Form) -> bool:
    """Whether more stands around the numbers than between the cells of a table, or not the same between all of them."""
    # "," and ",," are of one kind, as are cells in quotes and those without.
    kinds = {frozenset(literal) - {*" \"'"} for literal in form.literals[1:-1]}
    return len(kinds) > 1 or not all(map(_BETWEEN_CELLS.fullmatch, form.literals))


def _rows_of(text: LabText, form: _Form) -> tuple[list[tuple[str, ...]], list[int]]:
    pattern = form.pattern
    matches = ((number, pattern.fullmatch(line)) for number, line in enumerate(text.lines, 1) if len(line) <= _LONGEST)
    found = [(number, match.groups()) for number, match in matches if match is not None]
    return [cells for _, cells in found], [number for number, _ in found]


def _may_change(form: _Form, rows: Sequence[Sequence[str]]) -> bool:
    """Whether what stands beside a number may be a part of it: a sign, a power, brackets, a mark of thousands, a factor."""
    if any(map(_FACTOR.search, form.literals)):
        return True
    for k, (before, behind) in enumerate(zip(form.literals, form.literals[1:], strict=False)):
        if (
            before and not before.endswith("->") and not _SINCE_START.fullmatch(before) and _CHANGES_NEXT.search(before)
        ) or _CHANGES_LAST.match(behind):
            return True
        if re.search(r"(?:^|[^\w\s])\s*\($", before) and behind.startswith(")") and len(form.literals) > 2:
            return True
        if k + 1 < len(rows[0]) and behind in (",", " ", "'", "."):
            pairs = [(row[k], row[k + 1]) for row in rows]
            if all(re.fullmatch(r"[-+]?\d{1,3}", a) and re.match(r"\d{3}(?!\d)", b) for a, b in pairs):
                return True
    return False


def _without_constants(form: _Form, rows: list[tuple[str, ...]]) -> tuple[_Form, list[tuple[str, ...]]]:
    """The form with the numbers as parts of its text that are the same in all rows and that no name of a quantity precedes."""
    literals, kept = [form.literals[0]], []
    for k, behind in enumerate(form.literals[1:]):
        cells = {row[k] for row in rows}
        name = _name_in(literals[-1], "")
        within = behind[:1] in (":", "=", "]", ")", "'", '"', "#") and not _LETTER.search(behind) and k + 2 < len(form.literals)
        worded = _LETTER.search(literals[-1]) and (within or understand(name) is None)
        if len(cells) == 1 and (worded or _TOLERANCE.fullmatch(literals[-1]) or _LETTER.match(next(iter(cells)))):
            literals[-1] += cells.pop() + behind
        else:
            literals.append(behind)
            kept.append(k)
    if len(kept) == len(form.literals) - 1:
        return form, rows
    return _Form(tuple(literals), form.mark), [tuple(row[k] for k in kept) for row in rows]


def _names_and_units(form: _Form, rows: list[tuple[str, ...]]) -> tuple[list[str], list[str]]:
    """The name before each number and the unit behind it, "" where there is none.

    Letters that adjoin a number and are no unit are put back to it in the rows.
    """
    last, inner = form.literals[-1], form.literals[1:-1]
    # "s 0.1 mm 0.2 N 0.3" has units in the place of names.
    in_front = bool(_LETTER.search(form.literals[0])) and not _LETTER.search(last) and all(" " not in t.strip() for t in inner)
    # The text between all numbers is the same, as in a list: none is a name.
    alike = len({*inner}) == 1 and (len(inner) > 1 or not _LETTER.search(inner[0]))
    names, units, rest = [], [], form.literals[0]
    for k, behind in enumerate(form.literals[1:]):
        beyond = _TOLERANCE.match(behind)
        if beyond is not None and (number := _MARKS[form.mark].match(behind, beyond.end())) is not None:
            behind = behind[number.end() :]  # how far it may be off, in all rows the same
        key = _UNIT_KEY.match(behind)
        found = None if in_front and behind.startswith(" ") else _UNIT.match(behind)
        glued = _GLUED.match(behind)
        unit = ""
        following = behind
        if key is not None and looks_like_unit(key["unit"]):
            unit, following = key["unit"], behind[key.end() :]
        elif _is_symbol_of_next(behind, form.literals[k + 2 : k + 3]):
            following = behind
        elif found is not None and looks_like_unit(usual_case("", found["unit"])) and not _OF_NAME.match(behind, found.end()):
            unit, following = found["unit"], behind[found.end() :]
        elif glued is not None and glued.end() == len(behind.split(" ")[0].rstrip(",;)]}")):
            following = behind[glued.end() :]
            rows[:] = [(*row[:k], row[k] + glued[0], *row[k + 1 :]) for row in rows]
        names.append("" if alike else _name_in(rest, unit))
        units.append(unit)
        rest = following
    return names, units


def _is_symbol_of_next(between: str, behind: Sequence[str]) -> bool:
    """Whether a letter between two numbers is the symbol of the second, by the unit behind that: "0.1 C 97.1 pF"."""
    letter, found = between.strip(), _UNIT.match(behind[0]) if behind else None
    heading = understand(letter, found["unit"]) if found is not None and is_letter(letter) else None
    return heading is not None and found is not None and is_unit_of(found["unit"], heading.quantity)


def _name_in(before: str, unit: str) -> str:
    """The name in the text before a number: its last part that has letters, or one before it that the unit belongs to."""
    if _SINCE_START.fullmatch(before):
        return "t"
    parts = [_FILLERS.sub("", part.strip(" -.#*/\\")) for part in _AROUND.split(before.rstrip(" :=\"'`"))]
    named = [part for part in parts if part and _LETTER.search(part)]
    if not named:
        return ""
    for k, part in reversed([*enumerate(named, 1)]):
        heading = understand(part, unit)
        if heading is not None and (k == len(named) or (unit and is_unit_of(unit, heading.quantity))):
            return part
        if not _OF_VALUES.fullmatch(part):
            break
    last = named[-1].rsplit(maxsplit=1)[-1]
    own = understand(last) if _OF_PROGRAMS.search(before) and not no_record(named[-1]) else None
    if own is not None and own.unit:
        return last  # "<row t_s=", "press F_N="
    return " ".join(dropwhile(_OF_LOGGERS.fullmatch, named[-1].split())) or named[-1]


def _list_before(before: str, width: int) -> list[str]:
    """The names that a list in brackets before the numbers holds, as many as there are; [] without such."""
    for match in _LIST.finditer(before):
        names = [name.strip(" \"'`[]") for name in match["names"].split(",")]
        if len(names) == width and all(_LETTER.search(name) for name in names):
            return names
    return []


def _names_in(line: str, form: _Form) -> list[str]:
    """The words of a line above the rows at the places of their numbers, of a form without words; [] if it has others."""
    if any(map(_LETTER.search, form.literals)):
        return []
    line = without_comment_mark(line, ",").strip()
    found = _words_between(line, form, "  +") or _words_between(line, form, " +")
    clocked = [_IS_CLOCK.fullmatch(name) is not None for name in found]
    plain = all(clock or _LETTER.search(name) for name, clock in zip(found, clocked, strict=True))
    if not plain or not any(understand(name) for name in found):
        return []
    return ["" if clock else name for name, clock in zip(found, clocked, strict=True)]


def _words_between(line: str, form: _Form, blanks: str) -> list[str]:
    """The words of a line between the same marks as numbers, between blanks so many; [] if it has others."""
    between = [rf"\s*{re.escape(mark)}\s*" if (mark := literal.strip(" ")) else blanks for literal in form.literals[1:-1]]
    first, last = form.literals[0].strip(), form.literals[-1].strip()
    opened, closed = (_OPENED if "(" in first or "[" in first else r"\s*"), (_CLOSED if last.strip(" ,;") else r"[\s,;]*")
    begin = opened + (re.escape(first) + r"\s*" if first.strip("[(") else "")
    end = r"\s*" + re.escape(last) + (r"(?:\s*\\[a-z]+)?" if last.startswith("\\") else "") if last.strip("]),;") else ""
    name = rf"({_CLOCK}|\S(?:.{{0,60}}?\S)?)"
    match = re.fullmatch(begin + name + "".join(text + name for text in between) + end + closed, line)
    found = [] if match is None else [name.strip("\"'` ") for name in match.groups()]
    # One blank parts names of one word alone.
    several = [" " in name and not _IS_CLOCK.fullmatch(name) for name in found]
    apart = [k for k, text in enumerate(between) if text == " +"]
    return [] if any(several[k] or several[k + 1] for k in apart if found) else found


def _others(text: LabText, form: _Form, lines: Sequence[int], header: int) -> tuple[list[str], dict[int, str]]:
    """Notes on the lines of other forms among the rows, and all such lines by their number; what may be a row is refused."""
    there = {*lines, header + 1}
    others = {n: line for n, line in enumerate(text.lines, 1) if line.strip() and n not in there}
    width, within, apart = len(form.literals) - 1, [], []
    for number, line in others.items():
        if number == len(text.lines) and not text.ended:
            continue  # cut off
        n_number = len(_MARKS[form.mark].findall(line))
        if not lines[0] < number < lines[-1]:
            apart += [number] if n_number >= width else []
            continue
        if n_number >= width or SPECIMEN.search(line) or _NUMBERED.search(line) or not is_only_words(line):
            raise InputError(_other_form(text, form, number, line))
        within.append((number, line))
    beside = [number for number in apart if number in (lines[0] - 1, lines[-1] + 1)]
    if beside or len(apart) >= _FEWEST:
        number = (beside or apart)[0]
        raise InputError(_other_form(text, form, number, others[number]))
    if not within:
        return [], others
    number, line = within[0]
    return [
        f'{len(within)} line(s) of text among the rows are left out, the first is "{line.strip()[:60]}" (line {number})'
    ], others


def _other_form(text: LabText, form: _Form, number: int, line: str) -> Fault:
    message = f'"{line.strip()[:80]}" is not of the form of the other lines, {form.shown[:200]}'
    advice = "Take this line out of the file if it is no reading of this press, or write it as the others are"
    return Fault(message, text.path, number, 1, advice)


def _nameless(text: LabText, form: _Form, rows: Sequence[Sequence[str]], lines: Sequence[int], called: Sequence[str]) -> Fault:
    width = len(called)
    quantities = ("time", "displacement", "force", "capacitance")[: min(width, 4)] if width > 2 else ("time", "capacitance")
    said = " ".join(f"--columns {quantity}={k}" for k, quantity in enumerate(quantities, 1))
    units = " ".join(f"--units {quantity}=..." for quantity in quantities)
    shown = ", ".join(
        f"{k} is {cell} ({name})" if name != str(k) else f"{k} is {cell}"
        for k, (name, cell) in enumerate(zip(called, rows[0], strict=True), 1)
    )
    return Fault(
        f"the lines are of one form, {form.shown[:200]}, in which no name of a quantity "
        f"is understood; in this line {shown[:300]}",
        text.path,
        lines[0],
        advice=f"Say which number is what, and its unit, such as: {said} {units}, each in the unit of the file",
    )


def _refuse_in_turn(text: LabText, forms: Sequence[_Form]) -> None:
    """Refuse messages of several forms in turn, with a command that writes those of each to a file of their own."""
    if not all(len(form.literals) > 2 and any(map(_LETTER.search, form.literals)) for form in forms):
        return  # a time and a reading stand in each
    first = {form: next((n for n, line in enumerate(text.lines, 1) if _form_of(line, form.mark) == form), 0) for form in forms}
    forms = sorted(forms, key=lambda form: first[form])
    own = {
        form: next((w for w in _words_of(form) if not any(w in "\0".join(o.literals) for o in forms if o is not form)), "")
        for form in forms
    }
    if not all(own.values()) or not all(first.values()):
        return
    shown = "; ".join(f'"{text.lines[n - 1].strip()[:60]}" (line {n})' for n in (first[form] for form in forms))
    name = text.path.name
    commands = "; ".join(
        f"grep -F -e {shlex.quote(word)} {shlex.quote(name)} > {shlex.quote(f'{k}_{name}')}"
        for k, word in enumerate(own.values(), 1)
    )
    raise InputError(
        Fault(
            f"the lines are of {len(forms)} forms, and which of them go together cannot be told: {shown}",
            text.path,
            min(first.values()),
            advice=f"Write the lines of each form to a file of their own, which a terminal does: {commands}",
        )
    )


def _words_of(form: _Form) -> list[str]:
    """The words of a form that may tell it from another, the longest first."""
    found = {word for literal in form.literals for word in re.findall(r"[^\W\d_][\w .-]*[^\W\d_]|[^\W\d]\w*", literal)}
    return sorted(found, key=lambda word: (-len(word), word))


def _is_cut(text: LabText, form: _Form, rows: Sequence[Sequence[str]], lines: Sequence[int]) -> bool:
    """Whether the file ends within the last row, which no text behind its last number closes."""
    if text.ended or lines[-1] != len(text.lines) or form.literals[-1].strip() or len(rows) < 2:
        return False
    return len(rows[-1][-1].partition(".")[2]) != len(rows[-2][-1].partition(".")[2])

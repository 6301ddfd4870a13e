"""From lines that name each of their values, `t_ms:20 force_N:0.4`, together or one a line, to a `Sheet` with these names."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from calib.errors import Fault, InputError, capped
from calib.lab.instruments.brackets import usual_case
from calib.lab.instruments.declared import UNIT_NAMES
from calib.lab.instruments.lines import not_read
from calib.lab.instruments.numbers import is_numeric
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.text import LabText
from calib.lab.instruments.units import looks_like_unit

_PAIR = (
    r"(?P<name>[^\W\d][^\s:=,;|]{0,40}) ?[:=][ \t]{0,8}"
    r"(?P<value>(?:\d{4}-\d{2}-\d{2}[ T])?\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?|"
    r"[+-]?(?:\d+(?:[.,]\d+)?|[.,]\d+)(?:[eE][+-]?\d+)?|nan|inf|over|ovf|ol|-+)"
    r"(?: ?(?P<unit>(?![\d.,])[^\s:=,;|]{1,12})(?![^\s,;|]{0,40} ?[:=]))?"
)
# One value alone in a line, whose name may be of several words and hold its unit: "Time (s): 0.1", "Force (N),0.2".
_ALONE = re.compile(
    r"\s*(?P<name>[^\W\d][^:=,;|\t\n]{0,60}?)\s*[:=,;|\t]\s*"
    + _PAIR[_PAIR.index("(?P<value>") : _PAIR.index("(?: ?(?P<unit>")]
    + r"(?:\s?(?P<unit>(?![\d.,])[^\s:=,;|]{1,12}))?[\s,;|]*",
    re.IGNORECASE,
)
# A time before the first name, as terminals write it.
_STAMP = re.compile(
    r"[ \t]*(?P<stamp>(?:\d{1,4}[-./]\d{1,2}[-./]\d{1,4}[ T]+)?\d{1,2}:\d{2}:\d{2}(?:[.,]\d{1,9})?)[ \t,;|]+(?=[^\W\d])"
)
_ONE = re.compile(_PAIR, re.IGNORECASE)
_PLAIN = re.sub(r"\?P<\w+>", "", _PAIR)
# Two values at least, or one behind a time.
_LINE = re.compile(rf"\s*{_PLAIN}(?:[\s,;|]+{_PLAIN})+[\s,;|]*", re.IGNORECASE)
_BEHIND_A_TIME = re.compile(rf"\s*{_PLAIN}(?:[\s,;|]+{_PLAIN})*[\s,;|]*", re.IGNORECASE)
# The units of the values in a line above them: "# units: t s, d mm, F N", "# t in ms; z in um", "t[s] d[mm]".
_ITS_UNIT = r"(?P<name>[^\W\d]\w*)(?:\s+(?:in|is)\s+|\s*[:=\[(]\s*|\s+)(?P<unit>[^\s,;|()\[\]]{1,12})[\])]?"
_NAME_AND_UNIT = re.compile(_ITS_UNIT)
_ONE_UNIT = f"(?>{re.sub(r'[?]P<[a-z]+>', '?:', _ITS_UNIT)})"
_UNIT_LINE = re.compile(
    rf"[\s#%/;!\"]*(?:(?:{UNIT_NAMES})\s*[:=]?\s+)?(?P<pairs>{_ONE_UNIT}(?:[\s,;|]++{_ONE_UNIT})++)[\s,;|.]*", re.IGNORECASE
)
# Lines above the first one that may say what the logger is, and lines that show that each names its values.
_ABOVE, _FEWEST = 20, 5
# Values that are named in every line of a log with a slower channel, one of them the first.
_FEWEST_ALWAYS = 2
# Lines in which such a channel is missing at least, as a share; in fewer its value may be lost.
_SHARE_MISSING = 0.1
# Lines that show whether they name one value or several in turn.
_LOOKED_AT = 200
# Letters of a line that says units.
_LONGEST = 200
# A number in a line that says which record begins there: "Reading 12", "--- 3 ---".
_COUNT = re.compile(r"\d+")


def named_values(text: LabText) -> Sheet | None:
    """Cut a file whose lines name each of their values into a sheet, each line a row; None if it is no such file.

    A unit that stands behind a value in all lines is that of its name; where lines differ it stays in the cells.

    Parameters
    ----------
    text : the file.

    Raises
    ------
    InputError
        If a line among them is none, or names other values than the first.
    """
    found = _of_each_line(text) or _of_records(text) or _of_labels(text)
    if found is None:
        return None
    names, rows, lines, first, cut_short, note = found
    written = [(number, line) for number, line in enumerate(text.lines, 1) if line.strip()]
    below, columns = [], []
    for name, cells in zip(names, zip(*rows, strict=True), strict=True):
        own = {unit for value, unit in cells if value} or {""}
        below.append(own.pop() if len(own) == 1 and looks_like_unit(usual_case(name, next(iter(own)))) else "")
        columns.append([value if below[-1] else f"{value} {unit}".strip() for value, unit in cells])
    units_line, said = units_said_above(written[:first], names, below)
    below = [said.get(name, unit) for name, unit in zip(names, below, strict=True)]
    sheet = Sheet(
        text,
        " ",
        0,
        tuple(names),
        units_line or None,
        units=tuple(below) if any(below) else (),
        columns=tuple(columns),
        lines=np.array(lines, dtype=np.int64),
        cut_short=cut_short,
    )
    more = (
        [f"line {units_line} says their units: {', '.join(f'{name} in {unit}' for name, unit in said.items())}"] if said else []
    )
    above = [n - 1 for n, _ in written[:first] if n != units_line]
    return replace(sheet, notes=(note, *more), unread=tuple(not_read(sheet, above, "above the rows")))


_Found = tuple[list[str], list[list[tuple[str, str]]], list[int], int, bool, str]


def _of_labels(text: LabText) -> _Found | None:
    """The same of rows whose cells are names and values in turn, `Time (s),0.1,Force (N),0.2`, alike in all lines."""
    begin = list(islice((line for line in text.lines if line.strip()), _FEWEST))
    for mark in ",;\t|" if len(begin) == _FEWEST else "":
        rows = [[cell.strip() for cell in line.split(mark)] for line in begin]
        names = rows[0][::2]
        alike = len(names) > 1 and all(row[::2] == names and len(row) == 2 * len(names) for row in rows)
        if not alike or len({*names}) < len(names) or not all(any(map(str.isalpha, name)) for name in names):
            continue
        if not all(is_numeric(cell) for row in rows for cell in row[1::2]):
            continue
        written = [(number, line) for number, line in enumerate(text.lines, 1) if line.strip()]
        found = [[cell.strip() for cell in line.split(mark)] for _, line in written]
        odd = next((k for k, row in enumerate(found) if row[::2] != names or len(row) != 2 * len(names)), None)
        if odd is not None:
            number, line = written[odd]
            message = f'"{line.strip()[:60]}" does not name the values that the lines above do: {", ".join(names)}'
            raise InputError(Fault(message, text.path, number, 1, "Take the line out of the file, or mend it"))
        note = f"names and values stand in turn in each line, from line {written[0][0]} on: {', '.join(names)}"
        return names, [[(c, "") for c in row[1::2]] for row in found], [n for n, _ in written], 0, False, note
    return None


def _of_each_line(text: LabText) -> _Found | None:
    """Names, values with units, 1-based lines, filled lines above, whether the last is cut, and a note: each line a row."""
    begin = list(islice((line for line in text.lines if line.strip()), _LOOKED_AT))
    first = next((k for k, line in enumerate(begin[: _ABOVE + 1]) if _pairs(line)), -1)
    named = [[name for name, _, _ in _pairs(line)] for line in begin[first:]] if first >= 0 else []
    names = max(named[:_FEWEST], key=len, default=[])
    if names and (fault := _of_channels_in_turn(text, text.lines.index(begin[first]))) is not None:
        raise InputError(fault)
    # A slower channel is named in some of the lines alone, the others in all.
    names = max((own for own in named if _are_among(names, own)), key=len, default=[])
    there = [own for own in named if own]
    missing = {name: sum(name not in own for own in there) for name in names}
    always = [name for name in names if missing[name] < max(_FEWEST, _SHARE_MISSING * len(there))]
    if len(named) < _FEWEST or not all(_are_among(own, names) for own in named[:_FEWEST]):
        return None
    if len(always) < len(names) and (len(always) < _FEWEST_ALWAYS or always[0] != names[0]):
        return None
    written = [(number, line) for number, line in enumerate(text.lines, 1) if line.strip()]
    rows: list[list[tuple[str, str]]] = []
    lines: list[int] = []
    faults: list[Fault] = []
    cut_short = False
    for number, line in written[first:]:
        found = _pairs(line)
        last = number == len(text.lines) and not text.ended
        own = [name for name, _, _ in found]
        if own == names or (_are_among(own, names) and {*always} <= {*own}):
            before = next((row[names.index(own[-1])][0] for row in reversed(rows) if row[names.index(own[-1])][0]), "")
            cut_short = last and (_decimals(found[-1][1]) != _decimals(before) or (own != names and own[-1] != always[-1]))
            by_name = {name: (value, unit) for name, value, unit in found}
            rows.append([by_name.get(name, ("", "")) for name in names])
            lines.append(number)
        elif not last:
            shown, wanted = line.strip()[:60], ", ".join(names)
            advice = "Take this line out of the file, or mend it"
            faults.append(
                Fault(f'"{shown}" does not name the values {wanted} as the lines above', text.path, number, 1, advice)
            )
    if len(rows) < len(faults):
        return None  # lines about what stands below them
    if faults:
        raise InputError(capped(faults, "lines cannot be read"))
    return names, rows, lines, first, cut_short, f"each line names its values, from line {lines[0]} on: {', '.join(names)}"


def _are_among(own: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a line names some of these values, in their order."""
    rest = iter(names)
    return bool(own) and all(name in rest for name in own)


def _of_records(text: LabText) -> _Found | None:
    """The same of values that stand one a line, each behind its name, where the same names come in the same order again.

    Records may be parted by blank lines, or by lines that are the same but for their number.
    """
    head = list(islice(((k, line) for k, line in enumerate(text.lines) if line.strip()), _LOOKED_AT))
    seen = [match["name"] if (match := _ALONE.fullmatch(line)) is not None else "" for _, line in head]
    first = next((k for k in range(min(_ABOVE, len(seen))) if seen[k] and seen[k] in seen[k + 2 :]), -1)
    names = seen[first : seen.index(seen[first], first + 1)] if first >= 0 else []
    # Behind the last name of a record may stand the line that begins the next.
    title = head[first + len(names) - 1][1] if names and not names[-1] else ""
    names = names[:-1] if title else names
    again = [name for name in seen[first:] if name]
    if len(names) < 2 or not all(names) or again[: _FEWEST * len(names)] != names * _FEWEST:
        return None
    wanted = _COUNT.sub("", title).strip()
    first -= int(bool(title) and first > 0 and _COUNT.sub("", head[first - 1][1]).strip() == wanted)
    rows: list[list[tuple[str, str]]] = []
    lines: list[int] = []
    values: list[tuple[int, str, str]] = []
    cut_short, end = False, len(text.lines)
    for number, line in enumerate(text.lines[head[first][0] :], head[first][0] + 1):
        if not line.strip() or (not values and wanted and _COUNT.sub("", line).strip() == wanted):
            continue
        match = _ALONE.fullmatch(line)
        if match is None or match["name"] != names[len(values)]:
            end = number - 1
            break
        values.append((number, match["value"], match["unit"] or ""))
        if len(values) == len(names):
            cut_short = number == len(text.lines) and not text.ended and _decimals(values[-1][1]) != _decimals(rows[-1][-1][0])
            lines.append(values[0][0])
            rows.append([(value, unit) for _, value, unit in values])
            values = []
    below = [(k, line) for k, line in enumerate(text.lines[end:], end + 1) if line.strip()]
    others = [line for _, line in below if (match := _ALONE.fullmatch(line)) is not None and match["name"] in names]
    if len(rows) * len(names) < len(below) and 2 * len(others) < len(below):
        return None  # lines about what stands below them
    if others:
        number, line = below[0]
        message = f'"{line.strip()[:60]}" stands where the value of {names[len(values)]} would, as in the records above'
        raise InputError(Fault(message, text.path, number, 1, "Take this record out of the file, or mend it"))
    note = f"the values stand one a line, {len(names)} of each record, from line {lines[0]} on: {', '.join(names)}"
    if values:
        note += f"; the record that begins in line {values[0][0]} is cut off and left out"
    if below:
        note += f'; {len(below)} line(s) of text left out, the first is "{below[0][1].strip()[:60]}" (line {below[0][0]})'
    return names, rows, lines, first, cut_short, note


def units_said_above(above: Sequence[tuple[int, str]], names: Sequence[str], own: Sequence[str]) -> tuple[int, dict[str, str]]:
    """The 1-based line above the rows that says units of their values, name by name, and those; 0 and {} without such a line.

    Of two such lines, or where one of the values has a unit of its own, none is taken.

    Parameters
    ----------
    above : the filled lines above the rows, each with its number.
    names, own : of the values, and the units that stand with them.
    """
    found: list[tuple[int, dict[str, str]]] = []
    for number, line in above:
        match = _UNIT_LINE.fullmatch(line) if len(line) < _LONGEST else None
        pairs = [(m["name"], m["unit"]) for m in _NAME_AND_UNIT.finditer(match["pairs"])] if match is not None else []
        said = {name: usual_case(name, unit) for name, unit in pairs}
        if len(said) == len(pairs) > 1 and said.keys() <= {*names} and all(map(looks_like_unit, said.values())):
            found.append((number, said))
    return found[0] if len(found) == 1 and not any(own) else (0, {})


def _of_channels_in_turn(text: LabText, first: int) -> Fault | None:
    """What to say of lines that name one value each besides their time, of several in turn; None if they do not."""
    named = [tuple(name for name, _, _ in _pairs(line)) for line in text.lines[first : first + _LOOKED_AT] if line.strip()]
    often = [names for names, count in Counter(named).items() if len(names) == 2 and count >= max(_FEWEST, len(named) / 10)]
    if len(often) < 2 or len({names[0] for names in often}) > 1:
        return None
    listed = ", ".join(f'"{names[1]}"' for names in often)
    advice = f"Save the lines of the one that is meant in a file of their own, such as those with {often[0][1]}"
    return Fault(f"lines name one value each, of {len(often)} in turn: {listed}", text.path, first + 1, advice=advice)


def _pairs(line: str) -> list[tuple[str, str, str]]:
    """The names with their values and units in a line, a time before them by the name "Time"; [] if it holds anything else."""
    stamp = _STAMP.match(line)
    rest = line[stamp.end() :] if stamp is not None else line
    if (_LINE if stamp is None else _BEHIND_A_TIME).fullmatch(rest) is None:
        return []
    found = [(match["name"], match["value"], match["unit"] or "") for match in _ONE.finditer(rest)]
    if any(name.count(a) != name.count(b) for name, _, _ in found for a, b in ("()", "[]", "{}")):
        return []  # "Reading(t=0.1, F=0.2)"
    return [("Time", stamp["stamp"], ""), *found] if stamp is not None else found


def _decimals(value: str) -> int:
    return len(value.replace(",", ".").partition(".")[2])

"""From the lines of a lab file in which no header is understood to what seems to be one, and what to do about it."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from itertools import islice, pairwise

from calib.errors import Choice, Fault
from calib.lab.instruments.clock_cells import is_clock, is_date, is_reading
from calib.lab.instruments.header import (
    DELIMITERS,
    HEADER_WITHIN,
    are_units,
    find_header,
    split_line,
    width_of_row,
    without_comment_mark,
)
from calib.lab.instruments.labtable import AS_FOUND
from calib.lab.instruments.numbers import is_missing, is_numeric
from calib.lab.instruments.odd_delimiters import parted_oddly
from calib.lab.instruments.text import LabText
from calib.lab.instruments.unit_cells import with_its_unit
from calib.lab.instruments.units import RECORDED, is_unit_of
from calib.lab.instruments.vocabulary import EXAMPLE, understand, understood_names

# Lines that are looked at for quantities that stand in lines, and how many readings, of what share of the cells, show one.
_LINES_OF_QUANTITIES, _READINGS_IN_A_LINE, _MOSTLY = 50, 10, 0.8
# Numbers of one reading, in lines of their own between blank ones, are fewer.
_MOST_OF_RECORD = 20

#: What may be said of the columns of a file whose names are not understood, as an example: units are those of the file.
SAID_BY_NUMBER = (
    "--columns time=1 --columns displacement=2 --columns force=3 --units time=... --units displacement=... --units force=..., "
    "each in the unit of the file"
)


#: What a table looks like, for a file in which none is found.
A_TABLE = (
    "A table has one line of names with their units, below it one line for each reading, and one separator in all of them: "
    '"Time (s);Displacement (mm);Force (N)", then "0.0;0.000;0.001", then "0.1;0.020;0.004". Export the file so, or write it '
    "so by a few lines of a program"
)


def no_header(text: LabText) -> Fault:
    """The fault of a file without a header that is understood, with what seems to be one."""
    first, width = _first_row(text)
    unknown = unknown_header(text)
    seen = (unknown[1] + 1, [f'"{c[:40]}"' for c in unknown[2] if c][:12]) if unknown is not None else _likely_header(text)
    found = (
        f"; found {', '.join(seen[1])}"
        if seen
        else f'; {"the first row is" if width else "the file begins with"} "{text.lines[first].strip()[:60]}"'
    )
    numbered = find_header(text, AS_FOUND, numbers=True)
    odd = [(k, c) for k, c in enumerate(numbered[2], 1) if is_numeric(c)] if numbered is not None else []
    if numbered is not None and odd and not seen:
        said = f"--columns capacitance={odd[0][1]} --units capacitance=..."
        return Fault(
            f"numbers stand where names of columns would: {', '.join(c for _, c in odd[:8])}",
            text.path,
            numbered[1] + 1,
            odd[0][0],
            advice=f"If they are names, say which column is what, and its unit: {said}",
        )
    if (odd_delimiter := parted_oddly(text.path, text.lines)) is not None:
        return odd_delimiter
    if (alone := _one_a_line(text)) is not None:
        return alone
    lying = _quantities_in_lines(text)
    if lying and not seen:
        places = " and ".join(f'"{name}" in line {line}' for line, name in lying[:4])
        return Fault(
            f"each quantity stands in a line, with its readings one beside the other: {places}",
            text.path,
            lying[0][0],
            advice="Turn rows and columns, so that each quantity is a column with its name on top (in a spreadsheet: copy, "
            "paste special, transpose), and save the file again",
        )
    with_units = _numbers_with_units(text)
    names = split_line(text.lines[seen[0] - 1], with_units[1]) if seen is not None and with_units is not None else []
    blank = with_units is not None and with_units[1] == " "
    if with_units is not None and ((blank and not seen) or all(with_its_unit(name) or is_reading(name) for name in names)):
        line, _, of = with_units
        shown = ", ".join(f"{quantity} in column {k}" for quantity, k in of.items())
        said = " ".join(str(Choice("columns", (str(k),), quantity)) for quantity, k in of.items())
        return Fault(
            f'there is no header, but numbers with their units, "{text.lines[line].strip()[:60]}": by these {shown}',
            text.path,
            line + 1,
            advice=f"If that is so, say it: {said}; or write names above them",
        )
    replies = _reply_lines(text)
    if replies and not seen:
        return Fault(
            f"there is no header; the lines look like replies of {replies}, without a time and without the names of the values",
            text.path,
            advice="A capacitance is read over a time: log the time of each reply in a column before it, and write names and "
            'units above, as in "Time (s),Cp (F),D,status"',
        )
    if not seen and (clock := _beside_a_clock(text.lines[first])) is not None:
        return Fault(f"there is no header; {clock[0]}{found}", text.path, first + 1, advice=clock[1])
    if not width:
        return Fault(
            f"no table is found{found}",
            text.path,
            first + 1,
            advice=A_TABLE,
        )
    understood = "; ".join(f"{q}: {understood_names(q)}" for q in ("displacement", "force", "capacitance", "time"))
    return Fault(
        f"no header row with column names that are understood{found}",
        text.path,
        seen[0] if seen else first + 1,
        advice=f'Name the columns for example "{EXAMPLE["time"]}", "{EXAMPLE["force"]}", or say which is what, by '
        f"{'name or ' if seen else ''}number: {_by_number(text, width, unknown)}. Understood are {understood}",
    )


def _first_row(text: LabText) -> tuple[int, int]:
    """The index of the first line of numbers that stands with others, and its cells; the first line and 0 of a file without."""
    filled = [i for i, line in enumerate(text.lines[:HEADER_WITHIN]) if line.strip()]
    widths = ((i, width_of_row(text.lines[i])) for i in filled)
    rows = ((i, n) for (i, n), (_, below) in pairwise(widths) if n > 1 and n == below)
    return next(rows, (filled[0] if filled else 0, 0))


def _one_a_line(text: LabText) -> Fault | None:
    """The fault of a file that has one number a line; None of any other. Blank lines show how many are of one record."""
    numbers = [is_reading(line.strip()) and not width_of_row(line) for line in text.lines[:HEADER_WITHIN] if line.strip()]
    if len(numbers) < _READINGS_IN_A_LINE or sum(numbers) < _MOSTLY * len(numbers):
        return None
    first = next(i for i, line in enumerate(text.lines) if is_reading(line.strip()))
    names = [line.strip() for line in text.lines[:first] if line.strip()]
    blocks = Counter(len(block.split()) for block in re.split(r"\n\s*\n", "\n".join(text.lines[first:]).strip()))
    block, n_block = blocks.most_common(1)[0]
    n = block if 1 < block < _MOST_OF_RECORD and n_block > 1 else len(names) if len(names) > 1 else 3
    of_names = ", as many as lines of names stand above" if n == len(names) else ""
    each = "" if of_names or n == block else " (here three, a dash for each)"
    name = text.path.name
    return Fault(
        "each line holds one number, and nothing shows which of them are of one reading",
        text.path,
        first + 1,
        advice="Write what was read at one time in one line, below a line of names such as Time (s),Force (N). Where "
        f"{n} lines in turn{each} are one reading{of_names}, a terminal does it: grep -v '^ *$' \"{name}\" | paste -d ';' "
        f'{" ".join("-" * n)} > "new_{name}". Where one column stands below the other, write them side by side',
    )


# A number with the unit behind it, a blank between them or not, or another word.
_WITH_UNIT_APART = re.compile(r"[-+]?[\d.][\d.,]*(?:[eE][-+]?\d+)?\s?[^\W\d_][^\s\d]*(?=\s|$)|\S+")


def _numbers_with_units(text: LabText) -> tuple[int, str, dict[str, int]] | None:
    """The first line of numbers with their units, what parts them, and quantity -> column from 1; None if there is none.

    Each quantity is the one of a single column.
    """
    for line, written in enumerate(text.lines[:HEADER_WITHIN]):
        if not re.search(r"[^\W\d_]", written):
            continue
        for delimiter in DELIMITERS:
            cells = split_line(written, delimiter) if delimiter != " " else _WITH_UNIT_APART.findall(written)
            own = {k: re.sub(r"^[^a-zµμÅ%]*", "", c, flags=re.I) for k, c in enumerate(cells, 1) if with_its_unit(c)}
            if len(own) < 2 or not all(with_its_unit(c) or is_reading(c) or is_missing(c) for c in cells if c):
                continue
            found = {q: [k for k, unit in own.items() if is_unit_of(unit, q)] for q in RECORDED}
            of = {q: k for q, (k, *others) in ((q, ks) for q, ks in found.items() if ks) if not others}
            return (line, delimiter, of) if "capacitance" in of or {"force", "displacement"} <= of.keys() else None
    return None


def _quantities_in_lines(text: LabText) -> list[tuple[int, str]]:
    """The 1-based lines that begin with the name of a quantity and go on with its readings, and those names; [] of one only."""
    for delimiter in DELIMITERS[:-1]:
        found: list[tuple[int, str]] = []
        for number, line in enumerate(text.lines[:_LINES_OF_QUANTITIES], 1):
            name, *readings = split_line(line, delimiter)
            heading = understand(name) if name and len(readings) >= _READINGS_IN_A_LINE else None
            if heading is not None and sum(map(is_reading, readings)) >= _MOSTLY * len(readings):
                found.append((number, name))
        if len(found) > 1:
            return found
    return []


def _beside_a_clock(line: str) -> tuple[str, str] | None:
    """What stands in a line of numbers behind a time of day, with its date before it or not, and the options that read these.

    >>> _beside_a_clock("2026-03-01 10:00:00 97.12")[0], _beside_a_clock("touch at 10:00:00")
    ('column 2 holds times of day, column 1 their dates, column 3 numbers', None)
    """
    for delimiter in DELIMITERS:
        cells = [cell for cell in split_line(line, delimiter) if cell]
        clocks = [k for k, cell in enumerate(cells, 1) if is_clock(cell)]
        dates = [k for k, cell in enumerate(cells, 1) if is_date(cell)]
        others = [k for k in range(1, len(cells) + 1) if k not in (*clocks, *dates)]
        if len(clocks) != 1 or len(dates) > 1 or not others or not all(is_reading(cells[k - 1]) for k in others):
            continue
        parts = ("capacitance",) if len(others) == 1 else ("displacement", "force", "capacitance")[: len(others)]
        said = [f"--columns time={clocks[0]}", *(f"--columns {of}={k}" for of, k in zip(parts, others, strict=False))]
        units = " ".join(f"--units {of}=..." for of in parts)
        held = [f"column {clocks[0]} holds times of day", *(f"column {k} their dates" for k in dates)]
        numbers = f"column{'s' if len(others) > 1 else ''} {', '.join(map(str, others))} numbers"
        what = f"if it is a {parts[0]}" if len(parts) == 1 else f"if they are a {', a '.join(parts)}, or by their own numbers"
        return ", ".join(
            [*held, numbers]
        ), f"Say what the numbers are, {what}: {' '.join(said)} {units}; or write names above them"
    return None


def _by_number(text: LabText, width: int, unknown: tuple[str, int, list[str]] | None) -> str:
    """Options that say of columns what they are: those whose names have a unit of a press, else the first ones."""
    mark, header, names = unknown if unknown is not None else ("", 0, [])
    inside = [re.findall(r"[(\[]([^()\[\]]+)[)\]]", name) for name in names]
    if names and are_units(below := split_line(text.lines[header + 1], mark)):
        inside = [[unit.strip("[]() ")] for unit in below]
    of = {q: next((k for k, units in enumerate(inside, 1) if any(is_unit_of(u, q) for u in units)), 0) for q in RECORDED}
    if (of["displacement"] and of["force"]) or (of["time"] and of["capacitance"]):
        return " ".join(f"--columns {quantity}={k}" for quantity, k in of.items() if k)
    shown = ("time", "capacitance") if width == 2 else ("time", "displacement", "force")
    said = " ".join(f"--columns {quantity}={k}" for k, quantity in enumerate(shown, 1))
    begin = re.split(r"[\t;,|]", text.lines[_first_row(text)[0]].strip())[0]
    timed = is_clock(begin) or is_clock(begin.split()[0] if begin.split() else "")
    units = " ".join(f"--units {quantity}=..." for quantity in shown[timed:])  # a time of day has none
    return f"{said} {units}, each in the unit of the file"


def unknown_header(text: LabText) -> tuple[str, int, list[str]] | None:
    """Delimiter, index and cells of the names right above the first rows of numbers, one for each, be they understood or not.

    Names that stand there more than once are the numbers of their columns.

    Parameters
    ----------
    text : of a file in which no header is understood.
    """
    first, width = _first_row(text)
    above = list(islice((i for i in range(first - 1, -1, -1) if text.lines[i].strip()), 2))
    for delimiter in DELIMITERS if width else ():
        row = split_line(text.lines[first], delimiter)
        if sum(map(bool, row)) != width:
            continue
        found = [(i, split_line(without_comment_mark(text.lines[i], delimiter), delimiter)) for i in above]
        apart = next((k for k, (_, cells) in enumerate(found) if not _are_above(cells, row)), len(found))
        names = found[:apart]
        if len(names) > 1 and are_units(names[0][1]):
            names = names[1:]
        if names and not are_units(names[0][1]):
            line, cells = names[0]
            return delimiter, line, [name if cells.count(name) == 1 else str(k) for k, name in enumerate(cells, 1)]
    return None


def _are_above(names: Sequence[str], row: Sequence[str]) -> bool:
    """Whether cells are words, one above each number of a row."""
    there = [name for name, cell in zip(names, row, strict=False) if cell]
    return len(names) == len(row) and all(any(map(str.isalpha, name)) and not is_reading(name) for name in there)


_BUS_REPLY = re.compile(
    r"^\s*[+-]?\d\.\d+E[+-]\d+\s*,\s*[+-]?\d\.\d+E[+-]\d+\s*,\s*[+-]?\d+\s*(?:,\s*[+-]?\d+)?\s*$", re.IGNORECASE
)


def _reply_lines(text: LabText) -> str:
    lines = [line for line in text.lines[:20] if line.strip()]
    if lines and all(_BUS_REPLY.match(line) for line in lines):
        return "a Keysight E4980A (value, value, status)"
    return ""


def _likely_header(text: LabText) -> tuple[int, list[str]] | None:
    # The last line of words above the first line of numbers: what the user would call the header.
    above: tuple[int, list[str]] | None = None
    for index, line in enumerate(text.lines[:HEADER_WITHIN]):
        for delimiter in DELIMITERS[:-1]:
            cells = [c for c in split_line(line, delimiter) if c]
            if len(cells) < 2:
                continue
            if sum(map(is_reading, cells)) >= 2:
                return above
            above = (index + 1, [f'"{c[:40]}"' for c in cells[:12]])
            break
    return None  # no rows below

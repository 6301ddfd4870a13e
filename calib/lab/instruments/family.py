"""What an instrument family is, and what its module may look at in a sheet to recognise files of its instruments."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from calib.lab.instruments.header import split_line
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.text import LabText

Requirement = Callable[[frozenset[str]], tuple[str, ...]]


@dataclass(frozen=True)
class InstrumentFamily:
    """Instruments whose files look alike: how a file is known as theirs, and what must be found in it.

    Each stands as `FAMILY` in a file of its own in `calib.lab.instruments.families`, where it is found without being listed.

    Attributes
    ----------
    name : as it stands in `LabTable.recognised_as`.
    priority : families are asked from the lowest to the highest, and the first that recognises a sheet reads it. Meters stand
        below 50, testers below 100, the table with any header at 1000; the surer a family is of its files, the earlier it goes.
    recognise : a sheet -> the reason why it belongs to the family, for people, "" if it does not.
    requirement : the quantities found -> the quantities that are needed besides, () if nothing is.
    verified : whether the layout was seen in files of that instrument; where not, it is built from what is documented.
    cut : a text that is no table with a header that others understand -> its sheet, None if the text is not the family's; None
        for a family whose files are such tables.
    """

    name: str
    priority: int
    recognise: Callable[[Sheet], str]
    requirement: Requirement
    verified: bool
    cut: Callable[[LabText, Reading], Sheet | None] | None = None


# --- what a family needs -------------------------------------------------------------------------------------------------


def needs(*quantities: str) -> Requirement:
    """Make the requirement that all these quantities are in the file."""
    return lambda found: tuple(q for q in quantities if q not in found)


def needs_of_log(found: frozenset[str]) -> tuple[str, ...]:
    """What a log of an LCR meter lacks: a capacitance, and something that ties it to the tester's record."""
    missing = () if "capacitance" in found else ("capacitance",)
    return missing + (() if found & {"time", "force", "displacement"} else ("time", "force"))


# --- what a sheet shows --------------------------------------------------------------------------------------------------


def channels(sheet: Sheet) -> str:
    """Name the columns that are understood, as the beginning of a reason."""
    named = [sheet.names[i] for i in sheet.headings]
    return f"channels {', '.join(named)} in line {sheet.header_line}"


def channel_names(sheet: Sheet) -> list[str]:
    """The names of the columns that are understood, in lower case and without units."""
    return [h.name for h in sheet.headings.values()]


def holds_capacitance(sheet: Sheet) -> bool:
    """Whether a column is a capacitance, which no testing machine writes."""
    return any(h.quantity.startswith("capacitance") for h in sheet.headings.values())


def capacitance_log(sheet: Sheet) -> str:
    """Why a sheet is the log of an LCR meter: a capacitance column, unless force and displacement stand beside it. Else ""."""
    found = sheet.headings
    quantities = {h.quantity for h in found.values()}
    if not quantities & {"capacitance", "capacitance_series"} or {"force", "displacement"} <= quantities:
        return ""
    shown = ("capacitance", "capacitance_series", "dissipation", "status")
    names = [sheet.names[i] for i, h in found.items() if h.quantity in shown]
    unnamed = "as asked, the columns are" if sheet.assigned else "the columns are"
    where = f"the header at line {sheet.header_line} names" if sheet.header_line else unnamed
    return f"{where} {', '.join(names)}"


# What may stand before the name of a maker: nothing, the word of a setting with its mark, what was done with it.
_KEY = re.compile(
    r"[^\w]*(?:[^\W\d_][\w ./()-]{0,30}[:=,;\t|][^\w]*)?"
    r"(?:(?:exported|created|generated|written|recorded|measured|logged|taken|made)\s+(?:by|with|from|on|in)\s+)?(?:the\s+)?",
    re.IGNORECASE,
)
# Words of a sentence that does not say whose file it is, or says that it is another's.
_OF_A_REMARK = re.compile(
    r"\b(?:was|were|not|never|instead|than|(?:un)?like|broken|defect(?:ive)?|replaced|without|before|former(?:ly)?|later|until|"
    r"nicht|keine?|statt|defekt|kaputt|war|ersetzt|ohne|pas|sans|remplacé|sin|roto|antes)\b|\bno\b(?!\W*\d)"
)


def named_above(sheet: Sheet, pattern: str) -> str:
    """Say in words where a line above the header is that of a maker, a model or a program; "" if none is.

    It begins with the name, or with the word of a setting before it ("Instrument: ..."). A sentence in which one occurs, as
    that a meter was broken, makes a file nobody's.

    Parameters
    ----------
    sheet : a record.
    pattern : a regular expression of names, upper and lower case alike.
    """
    for number, line in enumerate(sheet.prelude, 1):
        match = re.search(pattern, line, re.IGNORECASE)
        if match is not None and _KEY.fullmatch(line[: match.start()]) and _OF_A_REMARK.search(line) is None:
            cells = [cell for cell in split_line(line, sheet.delimiter) if cell]
            shown = next((cell for cell in cells if re.search(pattern, cell, re.IGNORECASE)), match[0])
            return f'"{shown.strip()[:60]}" in line {number}'
    return ""


def line_above(sheet: Sheet, pattern: str) -> tuple[int, str] | None:
    """Look for a pattern above the header, such as the first words of a block that a program writes there.

    Parameters
    ----------
    sheet : a record.
    pattern : a regular expression, upper and lower case alike.

    Returns
    -------
    The 1-based line and its first cell; None if nothing matches.
    """
    for i, line in enumerate(sheet.prelude):
        if re.search(pattern, line, re.IGNORECASE):
            cells = [c for c in split_line(line, sheet.delimiter) if c]
            return i + 1, (cells[0] if cells else line)[:60]
    return None

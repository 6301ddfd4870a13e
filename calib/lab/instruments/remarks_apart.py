"""From a `Sheet` without rows to the same with remarks behind its last readings in cells of their own: `97.2 # touch`."""

from __future__ import annotations

import re
from dataclasses import replace

from calib.lab.instruments.clock_cells import is_reading
from calib.lab.instruments.header import split_line
from calib.lab.instruments.sheet import Sheet

# What a remark begins with, and the shortest text that shows it.
_MARKS = ("#", "//", ";", "<-")
_REMARK = re.compile(r"(?P<row>[^#;\"]*?[^\s#;\"<])\s*(?P<remark>(?:#|//|;|<-+)\s*[^\W\d][^\"]*)")
_BEHIND_SEMICOLONS = re.compile(r"(?P<row>[^#\"]*?[^\s#\"<])\s*(?P<remark>(?:#|//|<-+)\s*[^\W\d][^\"]*)")
# Rows with a remark are fewer than this share, and no longer than so many characters.
_FEW, _LONGEST = 0.25, 300


def with_remarks_apart(sheet: Sheet, start: int) -> Sheet:
    """Put what stands behind a mark of remarks in the last cell of a row into a cell of its own, if the row is whole before it.

    Parameters
    ----------
    sheet : without rows.
    start : index of the first line below its header and units.
    """
    lines = sheet.text.lines[start:]
    whole = "\n".join(lines)
    marks = [mark for mark in _MARKS if mark != sheet.delimiter and mark in whole]
    if not marks or sheet.text.typed:
        return sheet
    found = {i: line for i, line in enumerate(lines) if any(mark in line for mark in marks)}
    if len(found) > _FEW * len(lines):
        return sheet
    apart = {start + i: row for i, line in found.items() if (row := _apart(sheet, line)) is not None}
    if not apart:
        return sheet
    kept = tuple(apart.get(i, line) for i, line in enumerate(sheet.text.lines))
    return replace(sheet, text=replace(sheet.text, lines=kept))


def _apart(sheet: Sheet, line: str) -> str | None:
    """A row with its remark in a cell of its own; None of any other line."""
    form = _BEHIND_SEMICOLONS if sheet.delimiter == ";" else _REMARK
    match = form.fullmatch(line) if len(line) <= _LONGEST else None
    if match is None:
        return None
    cells = split_line(match["row"], sheet.delimiter)
    whole = len(cells) == len(sheet.names) and is_reading(cells[-1])
    return f'{match["row"]}{sheet.delimiter}"{match["remark"].strip()}"' if whole else None

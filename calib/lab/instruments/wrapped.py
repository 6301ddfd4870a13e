"""From the lines of a lab file to the same with a header that is broken into two lines in one, and a note on it."""

from __future__ import annotations

from collections.abc import Sequence

from calib.lab.instruments.numbers import is_numeric
from calib.lab.instruments.vocabulary import Heading, understand

# Lines within which a header stands, and rows whose width is looked at.
_WITHIN, _ROWS = 40, 5


def with_whole_header(lines: Sequence[str]) -> tuple[list[str], str]:
    """Join a header that goes on in the next line, where all names of both are understood and are as many as the rows are wide.

    Each has its unit, as no title above a header has, and the first line has two names at least.

    Parameters
    ----------
    lines : of the file.

    Returns
    -------
    The lines, an empty one in the place of the second, and a note; none and "" if no header is broken.
    """
    for delimiter in ",;\t":
        within = (i for i, line in enumerate(lines[:_WITHIN]) if delimiter in line)
        first = next((i for i in within if len(_names(lines[i], delimiter)) > 1), None)
        if first is None or first + 2 >= len(lines):
            continue
        names = [_names(line, delimiter) for line in lines[first : first + 2]]
        quantities = [heading.quantity for half in names for heading in half]
        rows = [line.split(delimiter) for line in lines[first + 2 : first + 2 + _ROWS] if line.strip()]
        wide = all(len(row) == len(quantities) and all(is_numeric(c.strip(' "')) for c in row) for row in rows)
        both = len(names[1]) > 0 and all(heading.unit for half in names for heading in half)
        if both and rows and wide and len(set(quantities)) == len(quantities):
            joined = f"{lines[first].rstrip().rstrip(delimiter)}{delimiter}{lines[first + 1].strip().strip(delimiter)}"
            note = f"the header in line {first + 1} goes on in the next line"
            return [*lines[:first], joined, "", *lines[first + 2 :]], note
    return [], ""


def _names(line: str, delimiter: str) -> list[Heading]:
    """What the cells of a line are, beside a delimiter that it may end or begin with; none if one is not understood."""
    found: list[Heading] = []
    for cell in line.strip().strip(delimiter).split(delimiter):
        name = cell.strip(' "')
        heading = None if is_numeric(name) else understand(name)
        if heading is None:
            return []
        found.append(heading)
    return found

"""From the cells of a header to these without what a program writes around every name: `A: Time (s)`, `'Force (N)'`."""

from __future__ import annotations

import re
import string
from collections.abc import Sequence

from calib.lab.instruments.units import is_unit_of
from calib.lab.instruments.vocabulary import understand

_LETTERED = re.compile(r"(?P<letter>[A-Z]): ?(?P<name>\S.*)")
_IN_QUOTES = re.compile(r"'(?P<name>[^']+)'|\u2018(?P<curly>[^\u2018\u2019]+)\u2019|`(?P<back>[^`]+)`")
# As pandas writes the two lines of a header in one.
_OF_TWO = re.compile(r"\('(?P<name>[^']+)', ?'(?P<unit>[^']*)'\)")
_UNIT_BEHIND = re.compile(r"(?P<name>[^\W\d_][\w ]*?)-(?P<unit>[^\W\d_]{1,3})")
# "g_force" is an acceleration.
_UNIT_BEFORE = re.compile(r"(?P<unit>(?!g_)[^\W\d_]{1,3})_(?P<name>[^\W\d_]\w*)")


def plain_names(cells: Sequence[str]) -> list[str]:
    """The names of a header without what stands around each of them, where all have it; else the cells as they are.

    These are letters that number the columns, quotes, the two lines of names and units as a pair, and units behind a dash or
    before a low line.

    Parameters
    ----------
    cells : of a header.

    >>> plain_names(["X: Time (s)", "A: Force (N)"]), plain_names(["'Time (s)'", "'Force (N)'"])
    (['Time (s)', 'Force (N)'], ['Time (s)', 'Force (N)'])
    >>> plain_names(["('Time', 's')", "('Force', 'N')"]), plain_names(["Time-s", "Force-N"]), plain_names(["s_time", "N_force"])
    (['Time (s)', 'Force (N)'], ['Time (s)', 'Force (N)'], ['time (s)', 'force (N)'])
    >>> plain_names(["X: Force (N)", "Y: Force (N)"]), plain_names(["m_disp", "m_force"])
    (['X: Force (N)', 'Y: Force (N)'], ['m_disp', 'm_force'])
    """
    there = [cell for cell in cells if cell]
    if len(there) < 2 or len(there) < len(cells):
        return list(cells)
    return _lettered(cells) or _quoted(cells) or _paired(cells) or _with_units(cells) or list(cells)


def _lettered(cells: Sequence[str]) -> list[str]:
    found = [_LETTERED.fullmatch(cell) for cell in cells]
    letters = "".join(m["letter"] for m in found if m is not None)
    if len(letters) < len(cells) or not string.ascii_uppercase.startswith(letters.removeprefix("X")):
        return []
    return [m["name"] for m in found if m is not None]


def _quoted(cells: Sequence[str]) -> list[str]:
    found = [_IN_QUOTES.fullmatch(cell) for cell in cells]
    return [m["name"] or m["curly"] or m["back"] for m in found if m is not None] if all(found) else []


def _paired(cells: Sequence[str]) -> list[str]:
    found = [m for cell in cells if (m := _OF_TWO.fullmatch(cell)) is not None]
    return [f"{m['name']} ({m['unit']})" if m["unit"] else m["name"] for m in found] if len(found) == len(cells) else []


def _with_units(cells: Sequence[str]) -> list[str]:
    for pattern in (_UNIT_BEHIND, _UNIT_BEFORE):
        found = [m for cell in cells if (m := pattern.fullmatch(cell)) is not None]
        if len(found) == len(cells) and all(_is_of(m["name"], m["unit"]) for m in found):
            return [f"{m['name']} ({m['unit']})" for m in found]
    return []


def _is_of(name: str, unit: str) -> bool:
    """Whether a unit is one of the quantity that a name is understood as."""
    heading = understand(f"{name} ({unit})")
    return heading is not None and heading.unit == unit and is_unit_of(unit, heading.quantity)

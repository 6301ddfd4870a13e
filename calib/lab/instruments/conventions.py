"""From the lines beside a table to what they say of the sign of compression, such as "compression negative"."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping

from calib.lab.instruments.brackets import says_sense
from calib.lab.instruments.sheet import Sheet

# What a part of a line speaks of; a convention for nothing in particular is one of loads.
_OF = {
    "force": re.compile(r"\b(?:force|load|kraft|last|charge|effort|fuerza|carga|forza|f)(?![^\W\d_])", re.IGNORECASE),
    "displacement": re.compile(
        r"\b(?:disp(?:lacement|\.)?|position|extension|travel|stroke|crosshead|depth|weg|traverse|déplacement|desplazamiento)"
        r"(?![^\W\d_])",
        re.IGNORECASE,
    ),
}
_PARTS = re.compile(r"[;,]|\.\s|\sbut\s")
_LONGEST = 200


def conventions(sheet: Sheet, columns: Collection[str]) -> Mapping[str, tuple[int, str]]:
    """Find what the lines above, below and among the rows say of the sign that compression has.

    Parameters
    ----------
    sheet : the record.
    columns : quantities that it has: a convention for nothing in particular is of the force, without one of the displacement.

    Returns
    -------
    Quantity -> 1 or -1, the sign of compression, and the line in words; without those of which two lines say different things.
    """
    found: dict[str, tuple[int, str]] = {}
    different: set[str] = set()
    for line, text in sorted(sheet.lines_and_sheets.items()):
        if len(text) > _LONGEST or not says_sense(text):
            continue
        of: list[str] = []
        for part in _PARTS.split(text):
            of = [q for q, pattern in _OF.items() if pattern.search(part)] or of
            sense = says_sense(part)
            for quantity in (of or ["force" if "force" in columns else "displacement"]) if sense else []:
                different |= {quantity} if found.get(quantity, (sense, ""))[0] != sense else set()
                found[quantity] = sense, f'line {line} says "{text.strip()}"'
    return {q: said for q, said in found.items() if q in columns and q not in different}

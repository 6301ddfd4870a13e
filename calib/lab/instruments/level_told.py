"""From the lines beside a capacitance to the notes on an offset that they say was taken off it, or is to be added."""

from __future__ import annotations

import re

from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.units import is_unit_of

_LONGEST = 160
_AMOUNT = re.compile(
    r"(?<![\w.])(?<!\d,)[+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?[\s;,\t\"]{0,3}(?P<unit>[^\W\d_]{1,12})(?![^\W_])|[(\[]\s?(?P<named>\w{1,5})\s?[)\]]"
)
# "CAPDAC", "offset", "subtracted", "to be added", "abgezogen", "Cin - Cref".
_SHIFTED = re.compile(
    r"cap ?dac|(?<![^\W_])offsets?(?![^\W_])|subtract|deduct|(?:taken|took) off|removed|(?:to be|must be|not|already) added|"
    r"add(?:ed)? (?:to|back)|minus|nulled|abgezogen|subtrahiert|abzuziehen|addier|hinzu|soustrai|ajouter|restad|sottratt|"
    r"\bc\w* ?[-\u2212] ?c\w+|减去|差し引",
    re.IGNORECASE,
)


def level_told(sheet: Sheet, index: int) -> list[str]:
    """The notes on lines by which a capacitance is not all that was there, or more: its level matters, which no zero makes up.

    Parameters
    ----------
    sheet : the record.
    index : the column of the capacitance.
    """
    for number, line in sorted(sheet.lines_and_sheets.items()):
        if tells_of_a_level(line):
            shown = " ".join(line.replace('"', "").split()).strip(" #;,")[:60]
            return [
                f'line {number} says "{shown}": "{sheet.names[index]}" is read as it is written, with nothing added or taken '
                "off; if that is to be done, write the column anew"
            ]
    return []


def tells_of_a_level(line: str) -> bool:
    """Whether a line speaks of an amount that is taken off a capacitance, or added.

    >>> tells_of_a_level("Offset: 2.5 pF"), tells_of_a_level("Offset: 2.5 mm")
    (True, False)
    """
    amounts = _AMOUNT.finditer(line) if len(line) <= _LONGEST and _SHIFTED.search(line) else ()
    return any(is_unit_of(match["unit"] or match["named"], "capacitance") for match in amounts)

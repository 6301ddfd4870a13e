"""From the columns of a sheet that say which rows are good to the rows that they say are not, with the reason."""

from __future__ import annotations

from dataclasses import dataclass

from calib.lab.instruments.lexicon import BAD_ROW, VALIDITY
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.vocabulary import words

# A column of so many different cells at most, of which the good ones stand in more than this share of the rows.
_KINDS, _SHARE = 12, 0.5


@dataclass(frozen=True)
class Validity:
    """What columns such as "Valid" say: rows from 0 that are not good -> why; index of such a column -> what it is."""

    rows: dict[int, str]
    columns: dict[int, str]


def said_bad(sheet: Sheet) -> Validity:
    """Find the rows that a column of the file itself calls bad: FALSE under "Valid", E12 under "Error", FAULT under "Status".

    Parameters
    ----------
    sheet : the record.
    """
    rows: dict[int, str] = {}
    columns: dict[int, str] = {}
    for index, name in enumerate(sheet.names):
        plain = words(name)
        if plain not in VALIDITY and sheet.plain_heading(index).quantity != "status":
            continue
        cells = sheet.columns[index]
        kinds = {c: c.strip().lower() for c in set(cells)}
        if len(kinds) > _KINDS:
            continue
        if plain in VALIDITY:
            good = VALIDITY[plain] | {""}
            bad = {c for c, said in kinds.items() if said not in good}
            if sum(cells.count(c) for c in bad) >= _SHARE * len(cells) or any("." in c or "," in c for c in bad):
                continue
            columns[index] = "says which rows are good"
        else:
            bad = {c for c, said in kinds.items() if any(w in BAD_ROW for w in said.replace("_", " ").split())}
            if sum(cells.count(c) for c in bad) >= _SHARE * len(cells):
                continue
        for row in (r for r, cell in enumerate(cells) if cell in bad) if bad else ():
            rows.setdefault(row, f'"{name}" says "{cells[row].strip()[:20]}"')
    return Validity(rows, columns)

"""From the names of a header to these without what programs put behind the second of two equal ones, and a note on each."""

from __future__ import annotations

import re
from collections.abc import Sequence

from calib.lab.instruments.vocabulary import understand

# "Time_s_1" of MATLAB, "Time (s).1" of pandas, "Time (s)_duplicated_0" of Polars, "Time (s)2" of tables in Excel,
# "Time (s):1" of SQLite, "Time (s) (2)".
_TAIL = re.compile(r"(?P<name>.+?)(?:[._:]\d{1,2}|_duplicated_\d{1,2}|(?<=[)\]])\d{1,2}|\s?\(#?\d{1,2}\))")
# Of each of them the number of its column, as readr of R writes it: "Time (s)...1".
_PLACE = re.compile(r"(?P<name>.+?)\.\.\.(?P<column>\d{1,3})")


def said_again(names: Sequence[str], units: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Give columns that a program renamed, as a table may not have two of one name, the name that they had.

    Such a name is that of another column with a tail behind it, and that is understood: a load `Load_N_1` beside `Load_N`.
    `Load 2` is a second load cell, and `CH1_1` beside `CH1` may be anything.

    Parameters
    ----------
    names : of the columns.
    units : below them, () without such a row.

    Returns
    -------
    The names, and a note for each that is another than before.

    >>> said_again(("Time_s", "Load_N", "Time_s_1", "Cp_pF", "Sample_1"), ())
    (('Time_s', 'Load_N', 'Time_s', 'Cp_pF', 'Sample_1'), ('"Time_s_1" (column 3) is taken for a second column "Time_s"',))
    """
    below = [*units, *[""] * len(names)]
    places = [
        m["name"] if (m := _PLACE.fullmatch(n)) is not None and m["column"] == str(i) else n for i, n in enumerate(names, 1)
    ]
    plain = [place if places.count(place) > 1 else name for place, name in zip(places, names, strict=True)]
    found, notes = list(plain), []
    for index, name in enumerate(plain):
        tail = _TAIL.fullmatch(name)
        if tail is not None and tail["name"] in plain:
            found[index] = tail["name"]
        if found[index] != names[index] and understand(found[index], below[index]) is None:
            found[index] = names[index]
        if found[index] != names[index]:
            notes.append(f'"{names[index]}" (column {index + 1}) is taken for a second column "{found[index]}"')
    return tuple(found), tuple(notes)

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

# Where so many quantities stand again, all columns do: of another specimen, or run.
_OF_A_BLOCK = 2


def said_again(names: Sequence[str], units: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Give columns that a program renamed, as a table may not have two of one name, the name that they had.

    Such a name is that of another column with a tail behind it, and that is understood: a load `Load_N_1` beside `Load_N`.
    `Load 2` is a second load cell, and `CH1_1` beside `CH1` may be anything, unless several quantities stand again with it.

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
    tails = [tail["name"] if (tail := _TAIL.fullmatch(name)) is not None else "" for name in plain]
    # Of names that are not understood as they stand all may have a tail, the first too: "Time_s_1" and "Time_s_2".
    twice = [
        base in plain or (tails.count(base) > 1 and understand(plain[i], below[i]) is None) for i, base in enumerate(tails)
    ]
    found = [base if base and again else name for base, again, name in zip(tails, twice, plain, strict=True)]
    known = [i for i, name in enumerate(found) if name != names[i] and understand(name, below[i]) is not None]
    if len(known) < _OF_A_BLOCK:  # else columns of other kinds stand again with them
        found = [name if i in known else names[i] for i, name in enumerate(found)]
    notes = [
        f'"{name}" (column {i + 1}) is taken for a second column "{found[i]}"'
        for i, name in enumerate(names)
        if found[i] != name
    ]
    return tuple(found), tuple(notes)

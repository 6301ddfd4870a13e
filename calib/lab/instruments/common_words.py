"""From the names of a header that all begin with the same words, such as `Rig1 Time (s)`, to the names behind these."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import takewhile

from calib.lab.instruments.brackets import is_factor, no_record
from calib.lab.instruments.lexicon import KEYS, RUNS
from calib.lab.instruments.passed_by import may_be_passed_by
from calib.lab.instruments.units import stands_for
from calib.lab.instruments.vocabulary import NEEDS_UNIT, understand

# Which run it is that all columns are of.
_LATEST = {"last", "latest"}
# What ends the words before a name, and letters of a number of a machine or a specimen: "P7", "E30-1".
_END = re.compile(r".*[\s_:/|-]", re.DOTALL)
_NUMBERED = re.compile(r"(?![xXdD]\d)[^\W\d_]{1,2}\d[\w.-]{0,8}")


def common_words(cells: Sequence[str]) -> tuple[str, list[str]]:
    """The words with which all names of a header begin, none of which is understood with them, and the names without them.

    Parameters
    ----------
    cells : of a header.

    Returns
    -------
    Words and names; "" and [] where there are none, they may change what a column is, or fewer than two names are understood.

    >>> common_words(["Rig1 Time (s)", "Rig1 Force (N)"]), common_words(["Run #3 Time(s)", "Run #3 Force(N)"])[0]
    (('Rig1', ['Time (s)', 'Force (N)']), 'Run #3')
    >>> common_words(["Max Time (s)", "Max Force (N)"]), common_words(["Rig1 Time (s)", "Rig2 Force (N)"])
    (('', []), ('', []))
    """
    named = [cell for cell in cells if cell]
    # What the first and the last by the alphabet begin with, all do.
    alike = takewhile(lambda pair: pair[0] == pair[1], zip(min(named), max(named), strict=False)) if len(named) > 1 else ()
    match = _END.match("".join(one for one, _ in alike))
    if match is None or not re.search(r"[^\W\d_]", match[0]) or any(understand(cell) is not None for cell in named):
        return "", []
    words = match[0].strip(" _:/|-")
    names = [cell[match.end() :] if cell else "" for cell in cells]
    found = {stands_for(h.quantity) for name in names if name and (h := understand(name)) is not None}
    return (words, names) if len(found & set(NEEDS_UNIT)) > 1 and say_nothing(words) else ("", [])


def say_nothing(words: str) -> bool:
    """Whether words before all names tell a machine or a run, and nothing of the readings.

    >>> say_nothing("Last Run"), say_nothing("Previous")
    (True, False)
    >>> say_nothing("Rig1"), say_nothing("wf group 1"), say_nothing("x10"), say_nothing("max"), say_nothing("simulated")
    (True, True, False, False, False)
    """
    parts = [part for part in re.split(r"[\s_:/|-]+", words) if part.strip("#.")]
    if is_factor(words) or no_record(words):
        return False
    plain = [re.sub(r"[\d#.]+", "", part) for part in parts if not _NUMBERED.fullmatch(part)]
    left = " ".join(part for part in plain if part and part.lower() not in KEYS | RUNS | _LATEST)
    return not left or all(may_be_passed_by(left, quantity) for quantity in ("force", "displacement"))

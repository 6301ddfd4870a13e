"""From the rows above and below a line of text to whether clock and press run on across it, so that it is but a remark."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from calib.lab.instruments.going_on import values_of
from calib.lab.instruments.stated import speaks_of_scale, speaks_of_zero
from calib.lab.instruments.units import looks_like_unit
from models.sensor import FloatArray

# What stands in a file whose two versions were put together.
_OF_TWO_VERSIONS = ("<<<<", ">>>>", "====")
# How words begin that speak of another ball, specimen or press.
_OF_ANOTHER = re.compile(
    r"(?<![^\W_])(?:chang|swap|replac|exchang|new(?![^\W_])|next|other|another|second|neu|nächst|naechst|gewechsel|wechsel|"
    r"getauscht|tausch|ander|zweit|nouve|suivant|autre|deuxi|remplac|nuev|siguiente|otr[oa]|cambi|nuov|prossim|altr[oa]|now[aey]|"
    r"нов|друг|след|замен)|新|换|換|替|次の|别|別|다음|새 |교체",
    re.IGNORECASE,
)
# A factor.
_TIMES = re.compile(r"(?<![^\W\d_])[x×*/]\s?\d|\d\s?[x×](?![^\W\d_])", re.IGNORECASE)
# Rows on either side of the line that are looked at, and the fewest that show a pace.
_NEAR, _FEWEST = 5, 3
# The step of the clock across the line over the longest beside it; the pace of a channel on one side of it over the other.
_LONGER, _OF_ANOTHER_PACE = 1.5, 2.0
# A channel runs one way if it comes so far with all its steps.
_ONE_WAY = 0.67
# In contact a channel is so far from its first and last reading, as a share of its range: no ball or specimen is changed there.
_IN_CONTACT = 0.1


def is_only_words(line: str) -> bool:
    """Whether a line among rows holds words that name no unit, range, zero, or another ball or specimen.

    >>> is_only_words("*** Marker 1: touch ***"), is_only_words("Event,touch,"), is_only_words("10:22:13 contact detected")
    (True, True, True)
    >>> [is_only_words(line) for line in ("=====", "(s),(mm),(N)", "range 2", "tare", "Kugel gewechselt")]
    [False, False, False, False, False]
    """
    cells = [c.strip(" ()[]\"'") for c in re.split(r"[,;\t]", line)]
    return (
        re.search(r"[^\W\d_]{3}|[^\x00-\u2fff]{2}", line) is not None
        and not line.startswith(_OF_TWO_VERSIONS)
        and not any(c and looks_like_unit(c) for c in cells)
        and not _OF_ANOTHER.search(line)
        and not _TIMES.search(line)
        and not speaks_of_scale(line)
        and not speaks_of_zero(line)
    )


def runs_on(
    quantities: Mapping[int, str],
    above: Sequence[Sequence[str]],
    below: Sequence[Sequence[str]],
    whole: Callable[[int], Sequence[str]],
    decimal: str,
) -> bool:
    """Whether time goes on at its pace across a line, every reading at its own, and the ball is moving or in contact there.

    A ball or a specimen is changed while the ball stands still and bears nothing, so that neither happened.

    Parameters
    ----------
    quantities : column -> what it is.
    above, below : cells of the rows next to the line.
    whole : column -> its cells in all rows of the file.
    decimal : the decimal mark, "" if it is not known.
    """
    above, below = above[-_NEAR:], below[:_NEAR]
    if min(len(above), len(below)) < _FEWEST:
        return False
    columns = {k: values_of([row[k].strip() if k < len(row) else "" for row in (*above, *below)], decimal) for k in quantities}
    times = [columns[k] for k, quantity in quantities.items() if quantity == "time"]
    others = {k: columns[k] for k, quantity in quantities.items() if quantity != "time"}
    if not times or not others or not all(np.all(np.isfinite(v)) for v in columns.values()):
        return False
    at = len(above) - 1
    if not all(_is_at_its_pace(np.diff(v), at) for v in times) or not all(_is_near(np.diff(v), at) for v in others.values()):
        return False
    ways = [(_way(v[: at + 1]), _way(v[at + 1 :])) for v in others.values()]
    if any(before * after < 0 for before, after in ways):
        return False  # it turns there
    moving = any(
        before and after and max(abs(before), abs(after)) <= _OF_ANOTHER_PACE * min(abs(before), abs(after))
        for before, after in ways
    )
    loads = [k for k, quantity in quantities.items() if quantity in ("force", "capacitance")]
    return moving or (bool(loads) and all(_is_in_contact(values_of(whole(k), decimal), others[k][at]) for k in loads))


def _is_at_its_pace(steps: FloatArray, at: int) -> bool:
    """Whether a clock goes on across the line as it does beside it."""
    beside = np.delete(steps, at)
    return bool(np.all(steps > 0) and np.min(beside) / _LONGER <= steps[at] <= _LONGER * np.max(beside))


def _is_near(steps: FloatArray, at: int) -> bool:
    """Whether the step across the line is as those beside it."""
    beside = np.delete(steps, at)
    room = max(float(np.ptp(beside)), 0.5 * float(np.max(np.abs(beside))))
    return bool(np.min(beside) - room <= steps[at] <= np.max(beside) + room)


def _way(values: FloatArray) -> float:
    """The mean step of readings that run one way; 0 of others."""
    steps = np.diff(values)
    whole = float(np.sum(steps))
    return whole / len(steps) if abs(whole) > _ONE_WAY * float(np.sum(np.abs(steps))) else 0.0


def _is_in_contact(values: FloatArray, at: float) -> bool:
    """Whether a reading is far from the first and from the last of its column."""
    there = values[np.isfinite(values)]
    return bool(there.size) and min(abs(at - there[0]), abs(at - there[-1])) > _IN_CONTACT * float(np.ptp(there))

"""From all names of a header to columns that are a record by those beside them: means with deviations, "actual" by a target."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Sequence
from functools import lru_cache

from calib.lab.instruments.brackets import (
    are_counts,
    ends_without_unit,
    is_commanded,
    no_record,
    tidy,
    without_brackets,
    words_in,
)
from calib.lab.instruments.lexicon import LEAST, MEASURED, MOST, QUALIFIERS, SPREADS
from calib.lab.instruments.meanings import PLAIN
from calib.lab.instruments.units import is_unit_of, looks_like_unit
from calib.lab.instruments.vocabulary import Heading, as_a_mean, as_a_record, is_mean_of_readings, understand

# Whole seconds and their parts as computers give them, "tv_sec" and "tv_usec", unless beside minutes and hours.
_SECONDS = re.compile(r"(?:(?:[^\W\d_]{1,20}[_./]){0,3}?(?:header[ _./])?(?:tv|stamp)[ _./])?secs?", re.IGNORECASE)
_THEIR_PARTS = re.compile(
    r"(?:(?:[^\W\d_]{1,20}[_./]){0,3}?(?:header[ _./])?(?:tv|stamp)[ _./])?(?:[mun]secs?|nanosecs?)", re.IGNORECASE
)
_OF_DAY = re.compile(r"(?:hours?|hrs?|min(?:ute)?s?)", re.IGNORECASE)
# A unit behind a stroke, as in "Weg/mm"; "/s" may be a rate, which no reading is.
_BY_STROKE = re.compile(r"(?:[^/]*[\s_.-])?(?P<last>[^\W\d_]{3,}) ?/ ?(?P<unit>[^\W\d_]+)")
# An instrument that is called as a unit: "Digital micrometer".
_INSTRUMENT = re.compile(r"[^\W\d_][\s_]+mi[ck]rom(?:eter|etre|ètre|etro)$", re.IGNORECASE)
_QUANTITIES = ("displacement", "force", "capacitance")


@lru_cache(maxsize=256)
def understood_together(names: tuple[str, ...], below: tuple[str, ...]) -> dict[int, Heading]:
    """The columns that are a record by what the others are: index -> heading, of quantities that no other column is.

    A mean is one where it and its deviation, it between the smallest and the largest reading, or means of several quantities
    and nothing else, stand in each row, where it says of how many readings, or alone beside a time and another reading;
    "actual (mm)" is one where another column in such a unit was commanded; "secs" is the time beside "nsecs".

    Parameters
    ----------
    names, below : of all columns, and the units below them, "" where there is none.

    >>> found = understood_together(("depth mean (mm)", "depth std (mm)", "target (N)", "actual (N)"), ("",) * 4)
    >>> [(index, heading.quantity, heading.unit) for index, heading in found.items()]
    [(0, 'displacement', 'mm'), (3, 'force', 'N')]
    """
    columns = list(zip(names, below, strict=True))
    known = {heading.quantity for name, unit in columns if name and (heading := understand(name, unit)) is not None}
    found = {i: h for i, (name, unit) in enumerate(columns) if name and (h := as_a_mean(name, unit)) is not None}
    records = [as_a_record(name, unit) for name, unit in columns]
    spreads = {h.quantity for (name, _), h in zip(columns, records, strict=True) if h is not None and is_spread(name)}
    others = [
        i
        for i, h in enumerate(records)
        if h is not None and h.quantity in _QUANTITIES and i not in found and not is_spread(names[i])
    ]
    least, most = ({i: h.quantity for i in others if (h := records[i]) and _has_word(names[i], of)} for of in (LEAST, MOST))
    between = {*least.values()} & {*most.values()}
    others = [i for i in others if (least | most).get(i) not in between]
    spreads |= between
    means = Counter(mean.quantity for mean in found.values())
    found = {
        i: h
        for i, h in found.items()
        if h.quantity not in known
        and (
            h.quantity in spreads
            or is_mean_of_readings(names[i])
            or (not others and len(means) > 1)
            or ("time" in known and (known | means.keys()) & ({*_QUANTITIES} - {h.quantity}) and means[h.quantity] == 1)
        )
        and not any(
            (other := records[k]) is not None
            and other.quantity == h.quantity
            and not (h.quantity in spreads and (_has_word(names[k], LEAST) or _has_word(names[k], MOST)))
            for k in others
        )
    }
    for quantity in ("displacement", "force"):
        measured = [i for i, (name, unit) in enumerate(columns) if _is_measured(name, unit, quantity)]
        commanded = [i for i, (name, unit) in enumerate(columns) if _is_commanded(name, unit, quantity)]
        if quantity not in known and commanded and len(measured) == 1:
            name, unit = columns[measured[0]]
            own = unit or unit_in(name)
            found[measured[0]] = Heading(quantity, 3 * PLAIN, " ".join(_plain_words(name)), None if unit else own)
    seconds = [
        i for i, (name, unit) in enumerate(columns) if _SECONDS.fullmatch(name) and (not unit or is_unit_of(unit, "time"))
    ]
    beside = any(map(_THEIR_PARTS.fullmatch, names)) and not any(map(_OF_DAY.fullmatch, names))
    if "time" not in known and len(seconds) == 1 and beside:
        found[seconds[0]] = Heading("time", 3 * PLAIN, "seconds", None if columns[seconds[0]][1] else "s")
    return found


def is_spread(name: str) -> bool:
    """Whether a name is that of a deviation of readings from their mean."""
    return _has_word(name, SPREADS)


def _has_word(name: str, of: Collection[str]) -> bool:
    return any(word.strip("()[]{}") in of for word in words_in(name))


@lru_cache(maxsize=8192)
def unit_in(name: str) -> str:
    """The unit that ends the name of a column, in brackets or not; "" if none does.

    >>> unit_in("Force ch1 (N)"), unit_in("Force_ch1_N"), unit_in("Force"), unit_in("Ram force/N"), unit_in("Slope N/mm")
    ('N', 'N', '', 'N', 'N/mm')
    >>> unit_in("Ext,mm"), unit_in("Krag: N"), unit_in("Weg|mm"), unit_in("Rate,N/mm")
    ('mm', 'N', 'mm', 'N/mm')
    """
    cut = without_brackets(tidy(name))
    inside = [b for b in (cut[1] if cut is not None else ()) if looks_like_unit(b)]
    by_stroke = _BY_STROKE.fullmatch(name)
    of_reading = by_stroke is not None and any(is_unit_of(by_stroke["unit"], quantity) for quantity in _QUANTITIES)
    if by_stroke is not None and of_reading and not looks_like_unit(by_stroke["last"]) and not are_counts(by_stroke["last"]):
        return by_stroke["unit"]
    if ends_without_unit(name) or _INSTRUMENT.search(name):
        return inside[-1] if inside else ""
    tail = re.split(r"[\s_,:|]+", name)[-1:]
    return inside[-1] if inside else next((word for word in tail if looks_like_unit(word)), "")


def _plain_words(name: str) -> Sequence[str]:
    """The words of a name without its brackets and the unit behind it."""
    cut = without_brackets(tidy(name))
    words = words_in(cut[0] if cut is not None else name)
    return words[:-1] if len(words) > 1 and looks_like_unit(unit_in(name)) and words[-1] == unit_in(name).lower() else words


def _is_measured(name: str, below: str, quantity: str) -> bool:
    """Whether words of what was measured stand in a name alone, beside those of the instrument, or beside its quantity."""
    unit = below or unit_in(name)
    words = _plain_words(name)
    left = [word for word in words if word not in MEASURED]
    if len(left) == len(words) or not is_unit_of(unit, quantity) or no_record(name):
        return False
    heading = understand(f"{' '.join(left)} ({unit})") if left else None
    plain = heading is not None and not (heading.name_doubt or heading.unit_doubt or heading.index or heading.processed)
    return all(word in QUALIFIERS for word in left) or (plain and heading is not None and heading.quantity == quantity)


def _is_commanded(name: str, below: str, quantity: str) -> bool:
    if not no_record(name) or not any(map(is_commanded, words_in(name))):
        return False
    record = as_a_record(name, below)
    return is_unit_of(below or unit_in(name), quantity) and (record is None or record.quantity == quantity)

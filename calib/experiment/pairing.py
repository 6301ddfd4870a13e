"""Records of lab files in, specimens out: force and capacitance of one press put together by name or time, or said why not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from calib.enumeration import first_of
from calib.experiment.lab_files import Found
from calib.experiment.naming import numbers_of
from calib.experiment.presses import Named, Press, Pressed, named, specimens_of

#: Two records of one press begin within this time [s] of each other.
TOGETHER = 600.0

#: Two records that begin further apart than this [s] are of one press only if the user says so.
FAR_APART = 3600.0

#: Two records of one press differ in length by less than this factor, or it is noted.
AS_LONG = 2.0


# What of two names must agree, from all of it on; the first that finds one partner on each side decides.
_KEYS: tuple[Callable[[Named], tuple[str, ...]], ...] = (
    partial(Named.key, folder=True),
    Named.key,
    partial(Named.key, stamps=False),
    partial(Named.key, stamps=False, specimen_words=False),
)


def pair(records: Sequence[Found]) -> list[Pressed]:
    """Put records of force and capacitance together that belong to one press, and presses that belong to one specimen.

    Names go first: two files belong together if their names agree but for words such as instron and lcr, dates, and "sensor"
    before a number; the numbers in them must agree. So do those that agree but for words that all files of one instrument have
    and none of the other. Of those left over, two belong together if they began within `TOGETHER` of
    each other. Where more than one could be meant none is taken, and the press says so.
    """
    both = [r for r in records if r.is_force and r.is_capacitance]
    lcr = [named(r) for r in records if r.is_capacitance and r not in both]
    tester = [named(r) for r in records if r not in both and not r.is_capacitance]
    partner, why = _by_name(tester, lcr)
    for i, (j, said) in _by_words_of_instruments(tester, lcr, partner).items():
        partner[i], why[i] = j, said
    if len(tester) == len(lcr) == 1 and not partner and not _contradict(tester[0], lcr[0]):
        partner[0], why[0] = 0, "paired as the only two: check"
    for i, j in _by_time(tester, lcr, partner).items():
        doubt = ", but their names differ: check" if _contradict(tester[i], lcr[j]) else ""
        partner[i], why[i] = j, f"paired by time: the records began {_apart(tester[i], lcr[j]):.0f} s apart{doubt}"
    presses = [Press(r, r) for r in both]
    free = [c.record for j, c in enumerate(lcr) if j not in partner.values()]
    for i, t in enumerate(tester):
        if i in partner:
            other = lcr[partner[i]]
            presses.append(Press(t.record, other.record, why[i], _doubts(t, other), asked=_asked(t, other)))
        else:
            presses.append(Press(t.record, None, notes=_alone(t, tester, lcr), candidates=_candidates(t, lcr, free)))
    presses += [Press(None, c.record, notes=_alone(c, lcr, tester)) for c in lcr if c.record in free]
    return specimens_of(presses)


def _candidates(record: Named, others: Sequence[Named], free: Sequence[Found]) -> tuple[Found, ...]:
    """Records of the other instrument that are of no other press, and whose names are like its own and do not contradict it."""
    return tuple(o.record for o in others if o.record in free and _alike(record, o) and not _contradict(record, o))


def _by_name(tester: Sequence[Named], lcr: Sequence[Named]) -> tuple[dict[int, int], dict[int, str]]:
    partner: dict[int, int] = {}
    why: dict[int, str] = {}
    for key in _KEYS:
        keys = [key(t) for t in tester], [key(c) for c in lcr]
        count = Counter(keys[0]), Counter(keys[1])
        for i, k in enumerate(keys[0]):
            if k and i not in partner and count[0][k] == count[1][k] == 1 and (j := keys[1].index(k)) not in partner.values():
                partner[i], why[i] = j, "paired by name"
    for i, j in _one_to_one(tester, lcr, partner, _has_more_words).items():
        more = sorted(set(_KEYS[-1](tester[i])) ^ set(_KEYS[-1](lcr[j])))
        partner[i], why[i] = j, f'paired by name, though only one has "{" ".join(more)}": check'
    return partner, why


def _by_words_of_instruments(
    tester: Sequence[Named], lcr: Sequence[Named], taken: Mapping[int, int]
) -> dict[int, tuple[int, str]]:
    """Pairs of names that agree but for words that all files of one instrument have and none of the other, and why.

    That of one file of each such a word is the instrument's may be chance, and is to be checked.
    """
    if not tester or not lcr:
        return {}
    words = [[frozenset(_words(n)) for n in side] for side in (tester, lcr)]
    in_tester, in_lcr = (frozenset[str]().union(*side) for side in words)
    of_tester, of_lcr = (side[0].intersection(*side) for side in words)
    of_tester, of_lcr = of_tester - in_lcr, of_lcr - in_tester
    if not of_tester and not of_lcr:
        return {}

    def agree(a: Named, b: Named) -> bool:
        one, other = (tuple(t for t in _KEYS[-1](n) if t not in of_tester | of_lcr) for n in (a, b))
        return one == other != ()

    told = " and ".join(f'"{word}"' for word in (*sorted(of_tester), *sorted(of_lcr)))
    said = f"paired by name, taking {told} for words of the instruments" + (
        ": check" if len(tester) == 1 or len(lcr) == 1 else ""
    )
    return {i: (j, said) for i, j in _one_to_one(tester, lcr, taken, agree).items()}


def _words(name: Named) -> Iterator[str]:
    """The words of a name that tell specimens apart as far as is known, without those that stand before their numbers."""
    return (text for text in _KEYS[-1](name) if not text[:1].isdecimal())


def _has_more_words(a: Named, b: Named) -> bool:
    """Whether two names have the same numbers, at least one, and one has all words of the other."""
    one, other = Counter(_KEYS[-1](a)), Counter(_KEYS[-1](b))
    same_numbers = numbers_of(_KEYS[-1](a)) == numbers_of(_KEYS[-1](b)) != ()
    return same_numbers and (one <= other or other <= one)


def _contradict(a: Named, b: Named) -> bool:
    """Whether two names cannot be of one press: their numbers differ, or neither says all that the other does."""
    numbers = numbers_of(_KEYS[-1](a)), numbers_of(_KEYS[-1](b))
    one, other = Counter(_KEYS[-1](a)), Counter(_KEYS[-1](b))
    return (all(numbers) and numbers[0] != numbers[1]) or not (one <= other or other <= one)


def _by_time(tester: Sequence[Named], lcr: Sequence[Named], taken: Mapping[int, int]) -> dict[int, int]:
    return _one_to_one(tester, lcr, taken, lambda a, b: (apart := _apart(a, b)) is not None and apart <= TOGETHER)


def _one_to_one(
    tester: Sequence[Named], lcr: Sequence[Named], taken: Mapping[int, int], fits: Callable[[Named, Named], bool]
) -> dict[int, int]:
    """Pairs that fit and of which neither fits another that is not taken."""
    near = {
        (i, j)
        for i, a in enumerate(tester)
        for j, b in enumerate(lcr)
        if i not in taken and j not in taken.values() and fits(a, b)
    }
    count = Counter(i for i, _ in near), Counter(j for _, j in near)
    return {i: j for i, j in sorted(near) if count[0][i] == count[1][j] == 1}


def _apart(a: Named, b: Named) -> float | None:
    """Time [s] between the starts of two records; None if one of them does not state its start."""
    one, other = a.record.table.started, b.record.table.started
    return None if one is None or other is None else abs((one - other).total_seconds())


def _doubts(force: Named, capacitance: Named) -> tuple[str, ...]:
    """What speaks against two records being of one press: when they began, how long they took."""
    notes = []
    apart = _apart(force, capacitance)
    if apart is not None and apart > TOGETHER:
        notes.append(f"the records began {apart / 3600:.1f} h apart: check that they are of one press")
    long, short = sorted(((_duration(n.record), n.record) for n in (force, capacitance)), key=lambda d: -d[0])
    if short[0] > 0 and long[0] / short[0] >= AS_LONG:
        notes.append(
            f"{long[1].table.path.name} lasts {long[0]:.0f} s, {short[1].table.path.name} {short[0]:.0f} s: check that "
            "they are of one press"
        )
    return tuple(notes)


def _asked(force: Named, capacitance: Named) -> str:
    """What the user has to say of two records that began far apart by their clocks."""
    apart = _apart(force, capacitance)
    if apart is None or apart <= FAR_APART:
        return ""
    return f"the two began {apart / 3600:.1f} h apart by their clocks; remove this mark if they are of one press, else the line"


def _duration(record: Found) -> float:
    """Time [s] from the first row to the last; 0 if it is not known."""
    time = record.table.columns.get("time", np.empty(0))
    time = time[np.isfinite(time)]
    return float(np.ptp(time)) if time.size else 0.0


def _alone(record: Named, own: Sequence[Named], others: Sequence[Named]) -> tuple[str, ...]:
    """Why a record has no partner although names are alike."""
    like = [o for o in others if _alike(record, o)]
    if not like:
        return ()
    if len(like) > 1:
        return (f"not paired, as {first_of([o.record.shown for o in like])} fit it alike",)
    partner = like[0].record.shown
    rivals = [o.record.shown for o in own if o is not record and (_alike(record, o) or _alike(like[0], o))]
    if rivals:
        return (f"not paired, as {partner} fits {first_of(rivals)} as well",)
    return (f"not paired with {partner}, as their numbers differ",)


def _alike(a: Named, b: Named) -> bool:
    """Whether two names agree, wholly, but for which press of the specimen it is, or but for words that one has more."""
    if any(key(a) and key(a) == key(b) for key in _KEYS) or (a.base != () and a.base == b.base):
        return True
    return _has_more_words(a, b)

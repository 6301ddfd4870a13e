"""Records of lab files in, specimens out: force and capacitance of one press put together by name or time, or said why not."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np

from calib.experiment.lab_files import Found
from calib.experiment.naming import Token, is_ball, key_of, numbers_of, shown, split_repeat, tokens_of

#: Two records of one press begin within this time [s] of each other.
TOGETHER = 600.0

#: Two records of one press differ in length by less than this factor, or it is noted.
AS_LONG = 2.0


@dataclass(frozen=True, eq=False)
class Press:
    """Records that belong to one press, and why they were put together.

    Attributes
    ----------
    force, capacitance : its records; may be of one file, and one may be missing.
    why : the reason, in words for the user; "" if there was nothing to put together.
    notes : what speaks against it, or why no partner was found, one sentence each.
    name : what the file names call it, among several presses of one specimen; "" for the only one.
    ball : whether that speaks of a ball, which may differ from the others'.
    """

    force: Found | None
    capacitance: Found | None
    why: str = ""
    notes: tuple[str, ...] = ()
    name: str = ""
    ball: bool = False

    @property
    def in_words(self) -> str:
        """Why these records stand together, and what speaks against it; "" if there is nothing to say."""
        return ", but ".join(part for part in (self.why, "; ".join(self.notes)) if part)

    @property
    def main(self) -> Found:
        """The record that the press is called after."""
        found = self.force or self.capacitance
        assert found is not None
        return found


@dataclass(frozen=True, eq=False)
class Pressed:
    """One specimen: its name, its presses, and what is to be said of them, one sentence each."""

    name: str
    presses: tuple[Press, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class _Named:
    """A record with its name cut into words."""

    record: Found
    tokens: tuple[Token, ...]
    folder: tuple[str, ...]

    def key(self, *, folder: bool = False, stamps: bool = True, specimen_words: bool = True) -> tuple[str, ...]:
        own = key_of(self.tokens, stamps=stamps, specimen_words=specimen_words)
        k = self.record.reading.specimen
        return (*(self.folder if folder else ()), *own, *(() if k is None else (str(k),)))


def _named(record: Found) -> _Named:
    kind: Literal["force", "capacitance", ""] = "capacitance" if record.is_capacitance else "force"
    if record.is_force and record.is_capacitance:
        kind = ""
    folder = tuple(text for part in record.folders for text in key_of(tokens_of(part, "")))
    return _Named(record, tokens_of(record.title, kind), folder)


# What of two names must agree, from all of it on; the first that finds one partner on each side decides.
_KEYS: tuple[Callable[[_Named], tuple[str, ...]], ...] = (
    partial(_Named.key, folder=True),
    _Named.key,
    partial(_Named.key, stamps=False),
    partial(_Named.key, stamps=False, specimen_words=False),
)


def pair(records: Sequence[Found]) -> list[Pressed]:
    """Put records of force and capacitance together that belong to one press, and presses that belong to one specimen.

    Names go first: two files belong together if their names agree but for words such as instron and lcr, dates, and "sensor"
    before a number; the numbers in them must agree. Of those left over, two belong together if they began within `TOGETHER` of
    each other. Where more than one could be meant none is taken, and the press says so.
    """
    both = [r for r in records if r.is_force and r.is_capacitance]
    lcr = [_named(r) for r in records if r.is_capacitance and r not in both]
    tester = [_named(r) for r in records if r not in both and not r.is_capacitance]
    partner, why = _by_name(tester, lcr)
    if len(tester) == len(lcr) == 1 and not partner and not _contradict(tester[0], lcr[0]):
        partner[0], why[0] = 0, "paired as the only two: check"
    for i, j in _by_time(tester, lcr, partner).items():
        doubt = ", but their names differ: check" if _contradict(tester[i], lcr[j]) else ""
        partner[i], why[i] = j, f"paired by time: the records began {_apart(tester[i], lcr[j]):.0f} s apart{doubt}"
    presses = [Press(r, r) for r in both]
    for i, t in enumerate(tester):
        if i in partner:
            other = lcr[partner[i]]
            presses.append(Press(t.record, other.record, why[i], _doubts(t, other)))
        else:
            presses.append(Press(t.record, None, notes=_alone(t, tester, lcr)))
    presses += [Press(None, c.record, notes=_alone(c, lcr, tester)) for j, c in enumerate(lcr) if j not in partner.values()]
    return _uniquely_named(_specimens(presses))


def _by_name(tester: Sequence[_Named], lcr: Sequence[_Named]) -> tuple[dict[int, int], dict[int, str]]:
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


def _has_more_words(a: _Named, b: _Named) -> bool:
    """Whether two names have the same numbers, at least one, and one has all words of the other."""
    one, other = Counter(_KEYS[-1](a)), Counter(_KEYS[-1](b))
    same_numbers = numbers_of(_KEYS[-1](a)) == numbers_of(_KEYS[-1](b)) != ()
    return same_numbers and (one <= other or other <= one)


def _contradict(a: _Named, b: _Named) -> bool:
    """Whether two names cannot be of one press: their numbers differ, or neither says all that the other does."""
    numbers = numbers_of(_KEYS[-1](a)), numbers_of(_KEYS[-1](b))
    one, other = Counter(_KEYS[-1](a)), Counter(_KEYS[-1](b))
    return (all(numbers) and numbers[0] != numbers[1]) or not (one <= other or other <= one)


def _by_time(tester: Sequence[_Named], lcr: Sequence[_Named], taken: Mapping[int, int]) -> dict[int, int]:
    return _one_to_one(tester, lcr, taken, lambda a, b: (apart := _apart(a, b)) is not None and apart <= TOGETHER)


def _one_to_one(
    tester: Sequence[_Named], lcr: Sequence[_Named], taken: Mapping[int, int], fits: Callable[[_Named, _Named], bool]
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


def _apart(a: _Named, b: _Named) -> float | None:
    """Time [s] between the starts of two records; None if one of them does not state its start."""
    one, other = a.record.table.started, b.record.table.started
    return None if one is None or other is None else abs((one - other).total_seconds())


def _doubts(force: _Named, capacitance: _Named) -> tuple[str, ...]:
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


def _duration(record: Found) -> float:
    """Time [s] from the first row to the last; 0 if it is not known."""
    time = record.table.columns.get("time", np.empty(0))
    time = time[np.isfinite(time)]
    return float(np.ptp(time)) if time.size else 0.0


def _alone(record: _Named, own: Sequence[_Named], others: Sequence[_Named]) -> tuple[str, ...]:
    """Why a record has no partner although names are alike."""
    like, rivals = ([o.record.shown for o in side if o is not record and _alike(record, o)] for side in (others, own))
    if not like:
        return ()
    if len(like) > 1:
        return (f"not paired, as {_few(like)} fit it alike",)
    if rivals:
        return (f"not paired, as {like[0]} fits {_few(rivals)} as well",)
    return (f"not paired with {like[0]}, as their numbers differ",)


def _alike(a: _Named, b: _Named) -> bool:
    """Whether two names agree, wholly or but for which press of the specimen it is."""
    return any(key(a) and key(a) == key(b) for key in _KEYS) or (_base(a.tokens) != () and _base(a.tokens) == _base(b.tokens))


def _few(names: Sequence[str]) -> str:
    if len(names) > 4:
        return f"{', '.join(names[:3])} and {len(names) - 3} more"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


# ------------------------------------------------------------------------------------------------------- presses of a specimen


def _base(tokens: Sequence[Token]) -> tuple[str, ...]:
    return key_of(split_repeat(tokens)[0], stamps=False)


def _specimens(presses: Sequence[Press]) -> list[Pressed]:
    """Put presses together whose names say that they are of one specimen, and tell where they may be."""
    named = [_named(p.main) for p in presses]
    bases = [_base_of_press(press, own) for press, own in zip(presses, named, strict=True)]
    groups: dict[object, list[int]] = {}
    for i, base in enumerate(bases):
        groups.setdefault(base or i, []).append(i)
    found = []
    for members in groups.values():
        repeats = [split_repeat(named[i].tokens)[1] for i in members]
        said = [_sweep_name(named[i], repeat) for i, repeat in zip(members, repeats, strict=True)]
        if len(members) == 1 or not any(repeats) or len(set(said)) < len(said):
            found += [Pressed(_name(named[i]), (presses[i],)) for i in members]
            continue
        first = named[members[0]]
        name = shown(first.record.title, split_repeat(first.tokens)[0])
        sweeps = [_as_sweep(presses[i], name, is_ball(r)) for i, name, r in zip(members, said, repeats, strict=True)]
        note = "by their names these are presses of one specimen; if not, make blocks of them"
        found.append(Pressed(name, tuple(sweeps), (note,)))
    return _with_hints(found)


def _base_of_press(press: Press, named: _Named) -> tuple[str, ...]:
    """The part of a press' name that tells the specimen; () where it cannot be one of several presses."""
    if press.force is None or named.record.reading.specimen is not None:
        return ()
    return (*named.folder, *_base(named.tokens))


def _as_sweep(press: Press, name: str, ball: bool) -> Press:
    return Press(press.force, press.capacitance, press.why, press.notes, name, ball)


def _sweep_name(named: _Named, repeat: Sequence[Token]) -> str:
    """What tells a press from the others of its specimen: "press 2", "ball 5mm"; "1" for one without a number."""
    told = [t for k, t in enumerate(repeat) if k == 0 or t.role in ("word", "number", "stamp")]
    return shown(named.record.title, told, instruments=True).replace("_", " ") or "1"


def _name(named: _Named) -> str:
    name = shown(named.record.title, named.tokens)
    specimen = named.record.reading.specimen
    return name if specimen is None else f"{name or 'specimen'} {specimen}"


def _with_hints(specimens: Sequence[Pressed]) -> list[Pressed]:
    """Say of specimens whose names differ in the last number only that they may be one: "A 1", "A 2"."""

    def base(s: Pressed) -> tuple[str, ...]:
        named = _named(s.presses[0].main)
        key = key_of(named.tokens, stamps=False, specimen_words=False)
        alone = len(s.presses) == 1 and named.record.reading.specimen is None and s.presses[0].force
        return (*named.folder, *key[:-1]) if alone and len(key) > 1 and key[-1].isdecimal() else ()

    bases = [base(s) for s in specimens]
    found = []
    for i, specimen in enumerate(specimens):
        alike = list(dict.fromkeys(s.name for s, b in zip(specimens, bases, strict=True) if b and b == bases[i]))
        if len(alike) > 1 and alike[0] == specimen.name:
            hint = f"if {_few(alike)} are presses of one specimen, make one block of them, with [[specimens.sweeps]]"
            specimen = Pressed(specimen.name, specimen.presses, (*specimen.notes, hint))
        found.append(specimen)
    return found


def _uniquely_named(specimens: Iterable[Pressed]) -> list[Pressed]:
    """Specimens of one name are told apart by their folders, else by a number."""
    found: list[Pressed] = []
    for number, s in enumerate(specimens, 1):
        folder = re.sub(r"[\[\](),\x00-\x1f]+", " ", " ".join(s.presses[0].main.folders)).strip()
        name = s.name or folder or f"specimen {number}"
        wanted = [name, *([f"{folder} {name}"] if folder else []), *(f"{name} {k}" for k in range(2, number + 2))]
        taken = {f.name for f in found}
        found.append(Pressed(next(n for n in wanted if n not in taken), s.presses, s.notes))
    return found

"""Presses in, specimens out: presses that are of one specimen by the names of their files, each with a name of its own."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from calib.enumeration import first_of
from calib.experiment.lab_files import Found
from calib.experiment.naming import (
    Token,
    ball_in_name,
    counts_presses,
    is_ball,
    key_of,
    radius_in_name,
    shown,
    split_repeat,
    tokens_of,
)


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
    perhaps : what in the name of the only press of a specimen may tell its ball, where other names tell others: "r5"; "" else.
    radius : of the ball [mm], as the file names tell it; "" if they do not.
    candidates : records of capacitance that may be of it, of which none was taken.
    asked : what the user has to say before its records hold for one press; "" if there is nothing.
    """

    force: Found | None
    capacitance: Found | None
    why: str = ""
    notes: tuple[str, ...] = ()
    name: str = ""
    ball: bool = False
    perhaps: str = ""
    radius: str = ""
    candidates: tuple[Found, ...] = ()
    asked: str = ""

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
class Named:
    """A record with the words of its name and of the folders that it lies in."""

    record: Found
    tokens: tuple[Token, ...]
    folder: tuple[str, ...]

    def key(self, *, folder: bool = False, stamps: bool = True, specimen_words: bool = True) -> tuple[str, ...]:
        """What tells it from records of other presses: see `key_of`, and which specimen of its file it is.

        Parameters
        ----------
        folder : whether the folders count.
        stamps, specimen_words : as in `key_of`.
        """
        own = key_of(self.tokens, stamps=stamps, specimen_words=specimen_words)
        k = self.record.reading.specimen
        return (*(self.folder if folder else ()), *own, *(() if k is None else (str(k),)))

    @property
    def base(self) -> tuple[str, ...]:
        """What is left of its key without the end that tells several presses of one specimen apart."""
        return key_of(split_repeat(self.tokens)[0], stamps=False)


def named(record: Found) -> Named:
    """Cut the name of a record into words."""
    kind: Literal["force", "capacitance", ""] = "capacitance" if record.is_capacitance else "force"
    if record.is_force and record.is_capacitance:
        kind = ""
    folder = tuple(text for part in record.folders for text in key_of(tokens_of(part, "")))
    return Named(record, tokens_of(record.title, kind), folder)


def specimens_of(presses: Sequence[Press]) -> list[Pressed]:
    """Put presses together whose names say that they are of one specimen, and say of others that they may be."""
    groups: dict[object, list[Press]] = {}
    for i, press in enumerate(presses):
        groups.setdefault(_specimen_of(press) or i, []).append(press)
    found = [s for members in groups.values() for s in _put_together(members)]
    return _uniquely_named(_with_balls(_with_hints(found)))


def _specimen_of(press: Press) -> tuple[str, ...]:
    """The part of a press' name that tells the specimen; () where it cannot be one of several presses."""
    own = named(press.main)
    if press.force is None or own.record.reading.specimen is not None:
        return ()
    return (*own.folder, *own.base)


def _put_together(presses: Sequence[Press]) -> list[Pressed]:
    """One specimen with several presses, if their names tell these apart; else a specimen for each."""
    own = [named(press.main) for press in presses]
    repeats = [split_repeat(n.tokens)[1] for n in own]
    names = [_sweep_name(n, repeat) for n, repeat in zip(own, repeats, strict=True)]
    if len(presses) == 1 or not any(repeats) or len(set(names)) < len(names):
        return [Pressed(_name(n), (press,)) for n, press in zip(own, presses, strict=True)]
    balls = not counts_presses(repeats)
    sweeps = [
        replace(p, name=name, ball=balls and is_ball(r), radius=radius_in_name(r) if balls else "")
        for p, name, r in zip(presses, names, repeats, strict=True)
    ]
    note = "by their names these are presses of one specimen; if not, make blocks of them"
    return [Pressed(shown(own[0].record.title, split_repeat(own[0].tokens)[0]), tuple(sweeps), (note,))]


def _sweep_name(own: Named, repeat: Sequence[Token]) -> str:
    """What tells a press from the others of its specimen: "press 2", "ball 5mm"; "1" for one without a number."""
    told = [t for k, t in enumerate(repeat) if k == 0 or t.role in ("word", "number", "stamp")]
    return shown(own.record.title, told, instruments=True).replace("_", " ") or "1"


def _name(own: Named) -> str:
    name = shown(own.record.title, own.tokens)
    specimen = own.record.reading.specimen
    return name if specimen is None else f"{name or 'specimen'} {specimen}"


def _with_hints(specimens: Sequence[Pressed]) -> list[Pressed]:
    """Say of specimens whose names differ in a number at the end only that they may be one: "A 1", "A 2"."""
    stems = [_stem(s) for s in specimens]
    found = []
    for specimen, stem in zip(specimens, stems, strict=True):
        alike = list(dict.fromkeys(s.name for s, other in zip(specimens, stems, strict=True) if other and other == stem))
        if len(alike) > 1 and alike[0] == specimen.name:
            hint = f"if {first_of(alike)} are presses of one specimen, make one block of them, with [[specimens.sweeps]]"
            specimen = replace(specimen, notes=(*specimen.notes, hint))
        found.append(specimen)
    return found


def _with_balls(specimens: Sequence[Pressed]) -> list[Pressed]:
    """Say of specimens pressed once what in their names may be a ball, where names tell several: "s1 r5", "s2 r8"."""
    balls = {id(p): ball_in_name(named(p.main).tokens) for s in specimens for p in s.presses if p.force is not None}
    sizes = {tuple(t.text for t in ball): ball for ball in balls.values() if ball}
    if len(sizes) < 2 or counts_presses(list(sizes.values())):
        return list(specimens)

    def asked(press: Press) -> Press:
        ball = balls.get(id(press), ())
        if not ball:
            return press
        return replace(press, perhaps=shown(press.main.title, ball, instruments=True), radius=radius_in_name(ball))

    return [s if len(s.presses) > 1 else replace(s, presses=(asked(s.presses[0]),)) for s in specimens]


def _stem(specimen: Pressed) -> tuple[str, ...]:
    """The name of a specimen without a number that stands apart at its end; () without one ("A1", "sensor 1")."""
    own = named(specimen.presses[0].main)
    told = [t for t in own.tokens if t.role in ("word", "number")]
    key = own.key(stamps=False, specimen_words=False)
    single = len(specimen.presses) == 1 and specimen.presses[0].force is not None and own.record.reading.specimen is None
    apart = len(told) > 1 and told[-1].role == "number" and told[-2].end < told[-1].start
    return (*own.folder, *key[:-1]) if single and apart and len(key) > 1 else ()


def _uniquely_named(specimens: Iterable[Pressed]) -> list[Pressed]:
    """Specimens of one name are told apart by their folders, else by a number."""
    found: list[Pressed] = []
    for number, s in enumerate(specimens, 1):
        folder = re.sub(r"[\[\](),\x00-\x1f]+", " ", " ".join(s.presses[0].main.folders)).strip()
        name = s.name or folder or f"specimen {number}"
        wanted = [name, *([f"{folder} {name}"] if folder else []), *(f"{name} {k}" for k in range(2, number + 2))]
        taken = {f.name for f in found}
        found.append(replace(s, name=next(n for n in wanted if n not in taken)))
    return found

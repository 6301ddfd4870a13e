"""What a draft of an experiment file cannot know, marked EDIT in it, and from a file's text to the marks that are left."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from calib.catalogue import UNKNOWNS
from calib.enumeration import first_of
from calib.experiment.toml_places import KeyPath, comments_in

#: How a line is marked: the word at the beginning of its comment, and after it what to do.
MARK = "# EDIT:"
#: How a line says that what stands there was measured, and with what; and that it was not, and is to stand nevertheless.
MEASURED, STANDS = "# measured:", "# not measured:"


@dataclass(frozen=True)
class Guess:
    """A quantity that decides the result and that no lab file tells, as it stands in a draft.

    Attributes
    ----------
    value : the draft's guess, TOML.
    task : what to put in its place.
    why : why it matters, and how a lab measures it; a sentence or two.
    in_force : whether the line holds; else it is commented out and another quantity stands for it until it is given.
    electrical : whether it matters for capacitance alone.
    """

    value: str
    task: str
    why: str
    in_force: bool = True
    electrical: bool = False


def _default(name: str) -> str:
    return UNKNOWNS[name].default


#: By the keys that lead to it, in the order of a draft.
GUESSES: Mapping[tuple[str, ...], Guess] = {
    ("base",): Guess(
        '"bonded"',
        '"bonded" if the padding is glued to a rigid base, "slippery" if it may slide on it',
        "On a slippery base the same curve means 1.9 times the Young's modulus. Not sure? `calib compare` asks the data.",
    ),
    ("indenter", "radius"): Guess(
        '"5 mm"',
        "radius of the ball, half its diameter",
        "The force grows with its root. Measure the diameter with a caliper, halve it.",
    ),
    ("indenter", "friction_coefficient"): Guess(
        "0",
        '0 if the ball slides on the sensor, "stick" if it sticks',
        "A ball that rubs makes the same sensor stiffer. Talc or oil lets it slide. Not sure? `calib compare` asks the data.",
    ),
    ("sensor", "radius"): Guess(
        '"10 mm"',
        "radius of the disc, half its diameter",
        "The force depends on it where the ball comes near the rim, the capacitance on the electrodes. Measure with a caliper.",
    ),
    ("sensor", "electrode_radius"): Guess(
        '"10 mm"',
        "radius of the electrodes, if they do not fill the disc",
        "The capacitance goes with its square, its relative change depends on it too. Measure where both overlap, on a photo.",
        in_force=False,
        electrical=True,
    ),
    ("padding", "material"): Guess(
        '"sensor"',
        '"sensor" if it is the same silicone, "own" for a modulus of its own',
        "One modulus for both layers or two: two of the same batch and cure have one. What was cast tells.",
    ),
    ("priors", "young_modulus"): Guess(
        _default("young_modulus"),
        "median and factor, from the datasheet or a tensile test",
        "Thickness and modulus make the force together: where the data cannot part them, this decides. Pull a strip.",
    ),
    ("priors", "machine_compliance"): Guess(
        _default("machine_compliance"),
        "what the machine gives, crosshead travel per force",
        "Travel that bends the machine is taken for a soft sensor. Press the ball on the bare base: travel over force is it.",
    ),
    ("priors", "relative_permittivity"): Guess(
        _default("relative_permittivity"),
        "mean, sd, lowest, highest, at the meter's frequency",
        "The capacitance at rest goes with it over the thickness. Measure a plate of the silicone of known thickness and area.",
        electrical=True,
    ),
    ("priors", "parasitic_capacitance"): Guess(
        _default("parasitic_capacitance"),
        "mean and sd of what leads and clips add",
        "It adds to every reading and is taken for permittivity. Open correction at the clips, then read it without sensor.",
        electrical=True,
    ),
    ("specimens", "priors", "sensor_thickness"): Guess(
        '{ lognormal = ["0.8 mm", 1.5] }',
        'mean and sd, such as { normal = ["0.74 mm", "0.02 mm"] }',
        "Sensor and padding thickness decide more than all else. Cut a strip, read it under the microscope at several places.",
    ),
    ("specimens", "priors", "padding_thickness"): Guess(
        '{ lognormal = ["1.1 mm", 1.5] }',
        'mean and sd, such as { normal = ["1.10 mm", "0.03 mm"] }',
        "",
    ),
    ("specimens", "priors", "dielectric_thickness"): Guess(
        '{ normal = ["0.16 mm", "0.01 mm"] }',
        "of each of the two, if not half the sensor",
        "The capacitance goes with one over the thickness of a dielectric: electrodes and covers do not count. Microscope.",
        in_force=False,
        electrical=True,
    ),
}


@dataclass(frozen=True)
class Unedited:
    """A line of an experiment file that holds a guess as if it were known: marked EDIT, or meant to stand.

    Attributes
    ----------
    line : from 1.
    what : the quantity, such as "indenter radius" or "sensor_thickness".
    of : name of the specimen it is of; "" for the others.
    stands : whether the line says that it was not measured and is to stand; else it is still marked EDIT and holds what the
        draft put there.
    """

    line: int
    what: str
    of: str = ""
    stands: bool = False


def unedited_in_words(unedited: Sequence[Unedited]) -> str:
    """Say which lines are left as the draft made them; those of several specimens stand together. Nothing for none.

    >>> left = [Unedited(30, "sensor_thickness", "a"), Unedited(40, "sensor_thickness", "b")]
    >>> unedited_in_words([Unedited(7, "indenter radius"), *left])
    '3 lines marked EDIT are unchanged: line 7 indenter radius, lines 30 and 40 sensor_thickness of "a" and "b"'
    >>> unedited_in_words([Unedited(7, "indenter radius", stands=True)])
    '1 guess is taken as exactly known and was not measured: line 7 indenter radius'
    """
    marked, standing = ([u for u in unedited if u.stands is stands] for stands in (False, True))
    n, m = len(marked), len(standing)
    said = []
    if marked:
        said.append(f"{n} line{' marked EDIT is' if n == 1 else 's marked EDIT are'} unchanged: {_places(marked)}")
    if standing:
        are, were = ("guess is", "was") if m == 1 else ("guesses are", "were")
        said.append(f"{m} {are} taken as exactly known and {were} not measured: {_places(standing)}")
    return "; ".join(said)


def _places(unedited: Sequence[Unedited]) -> str:
    """Lines by their quantity, those of several specimens together."""
    groups: dict[str, list[Unedited]] = {}
    for u in unedited:
        groups.setdefault(u.what, []).append(u)
    parts = []
    for what, own in groups.items():
        lines = first_of([str(u.line) for u in own])
        of = first_of([f'"{name}"' for name, _ in groupby(u.of for u in own) if name])
        parts.append(f"line{'s' if len(own) > 1 else ''} {lines} {what}" + (f" of {of}" if of else ""))
    return ", ".join(parts)


def unedited_lines(text: str, data: Mapping[str, Any], places: Mapping[KeyPath, tuple[int, int]]) -> tuple[Unedited, ...]:
    """Find the lines of an experiment file that hold a guess as if it were known.

    These are lines that are still marked EDIT and hold what the draft put there, and lines of a quantity without a prior that
    say it was not measured: its guess stands as exact. A prior that is to stand says by its width how far it is known.

    A line is done when the mark is removed or its value is another than the draft's. A value that is commented out is done when
    the experiment gives it anywhere; a mark without a value when it is removed.

    Parameters
    ----------
    text : of the file, with LF line ends.
    data : what `tomllib` makes of it.
    places : line and column of every key, see `locate_keys`.
    """
    keys: dict[int, KeyPath] = {}
    tables: list[tuple[int, KeyPath]] = [(0, ())]
    lines = text.split("\n")
    for path, (line, column) in sorted(places.items(), key=lambda p: (p[1], len(p[0]))):
        if lines[line - 1].startswith("[", column - 1) and isinstance(_at(data, path), dict):
            tables.append((line, path))
        else:
            keys.setdefault(line, path)
    found = []
    for line, comment in comments_in(text):
        if MARK in comment:
            left = _left(line, comment, data, keys, max(t for t in tables if t[0] < line)[1])
            found += [Unedited(line, what, _specimen(data, path)) for path, what in left]
        elif STANDS in comment and line in keys and "priors" not in keys[line] and guess_at(keys[line]) is not None:
            found.append(Unedited(line, _called(keys[line]), _specimen(data, keys[line]), stands=True))
    return tuple(found)


def guess_at(path: KeyPath) -> Guess | None:
    """The guess of a draft at a key; None where it makes none.

    Parameters
    ----------
    path : of the key.
    """
    return GUESSES.get(tuple(key for key in path if isinstance(key, str)))


_COMMENTED = re.compile(rf"#\s*([A-Za-z_]+)\s*=\s*\S.*{MARK}")


def _left(
    line: int, comment: str, data: Mapping[str, Any], keys: Mapping[int, KeyPath], table: KeyPath
) -> Iterator[tuple[KeyPath, str]]:
    """Where the mark in a line is left as it was: the path and name of its quantity; nothing where it is not."""
    commented = _COMMENTED.match(comment)
    if commented:
        key = commented[1]
        if not any(key in _at(data, at) for at in (table, ("sensor",), ("priors",))):
            yield (*table, key), _called((*table, key))
    elif not comment.startswith(MARK):
        return
    elif line not in keys:
        yield table, re.split(r"[.:;,]", comment.removeprefix(MARK).strip(), maxsplit=1)[0][:60]
    else:
        path = keys[line]
        guess = guess_at(path)
        value = _at(data, path)
        choice = re.match(rf"{MARK} choose (\w+)", comment)
        if guess is not None and value != tomllib.loads(f"value = {guess.value}")["value"]:
            return
        if choice and isinstance(value, dict) and choice[1] in value:
            return
        yield path, _called(path)


def _at(data: Any, path: KeyPath) -> Any:
    """The value at a path; an empty table where there is none."""
    for key in path:
        try:
            data = data[key]
        except (KeyError, IndexError, TypeError):
            return {}
    return data


def _called(path: KeyPath) -> str:
    words = [str(k) for k in path if isinstance(k, str)]
    return " ".join(words[-2:]) if words[-1] in ("radius", "material") else words[-1]


def _specimen(data: Mapping[str, Any], path: KeyPath) -> str:
    return str(_at(data, path[:2]).get("name", "")) if path[:1] == ("specimens",) and len(path) > 2 else ""

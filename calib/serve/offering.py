"""A lab file that the experiment does not name in, what it may be in it out: its partner, its specimen and its press."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from calib.errors import Fault, InputError
from calib.experiment import Found, Said, look_through, pair
from calib.lab import AS_FOUND, Sweep, make_sweep
from calib.serve.looking import Kept, Understood, entries_of, experiment_tables, understand
from calib.serve.toml_text import value_at
from calib.serve.workspace import Workspace
from calib.visible import shortened

# Files beside one that are looked at for its partner, by how their names are alike.
_NEAR = 12
# Files of the experiment that one is held against by its name.
_KNOWN = 24
# What was read lately: a form that is sent again does not read it again.
_LOOKED, _TIED = Kept(64), Kept(16)


@dataclass(frozen=True, eq=False)
class Offer:
    """What a file may be in the experiment, to be shown.

    Attributes
    ----------
    found : what is known of the file.
    partners : names of files that may be the other record of its press.
    partner : the one that was chosen, or that its name or time tells; "" for none.
    why : why that, and what speaks against it.
    needs : the other record that it is of no use without, in words; "" for none.
    tie : by what the two belong together, in words.
    clock : whether that is the clock, of which something may be said.
    faults : why the two cannot be used together as they are.
    specimens : names of those that there are.
    specimen : the one that it seems to be of; "" for a new one.
    name : what a new one would be called.
    press : what its press would be called.
    ball : radius of the ball in the experiment, as it stands there; "" for none.
    """

    found: Understood
    partners: tuple[str, ...]
    partner: str
    why: str
    needs: str
    tie: tuple[str, ...]
    clock: bool
    faults: tuple[Fault, ...]
    specimens: tuple[str, ...]
    specimen: str
    name: str
    press: str
    ball: str


def offer(space: Workspace, name: str, chosen: str | None = None) -> Offer:
    """Say what a lab file may be in the experiment of a folder.

    Parameters
    ----------
    space : the folder.
    name : of the file, as it is listed.
    chosen : the other record of its press, "" for none; None if nothing was chosen yet.

    Raises
    ------
    InputError
        If there is no such file, no experiment, or the file is in it already.
    """
    found = _addable(space, name)
    tables = experiment_tables(space)
    names = tuple(str(s.get("name", "")) for s in specimens_in(tables))
    near = _near(space, tables, found)
    pairing = _paired(space, tables, found, near)
    partner = pairing.partner if chosen is None else chosen
    if partner and partner not in near:
        message = f'"{shortened(partner)}" cannot be the other record of this press'
        raise InputError(Fault(message, advice="Choose from the list"))
    tie, clock, faults = _tie(space, found, partner)
    needs = ""
    if not partner and not _is_force(found) and not _is_tied(found):
        needs = "a force file of the same press: nothing in this one ties its capacitance to a depth"
    return Offer(
        found,
        tuple(near),
        partner,
        pairing.why if partner and partner == pairing.partner else "",
        needs,
        tie,
        clock,
        faults,
        names,
        pairing.specimen if pairing.specimen in names else "",
        _unused(pairing.name, names),
        pairing.press or f"press {_presses(tables, pairing.specimen) + 1}",
        str(value_at(tables, ("indenter", "radius")) or ""),
    )


def _addable(space: Workspace, name: str) -> Understood:
    found = understand(space, name)
    if not space.text:
        raise InputError(
            Fault("there is no experiment yet to add a file to", advice="Let the page write a first one from the files")
        )
    if not experiment_tables(space):
        raise InputError(Fault("the experiment cannot be read as it is", advice="Mend it first, in its text"))
    if found.entries:
        where = ", ".join(entry.title for entry in found.entries)
        raise InputError(Fault(f"{name} is in the experiment already: {where}", advice="Change it there, in its text"))
    if found.observations is None:
        raise InputError(found.faults)
    return found


def _near(space: Workspace, tables: Mapping[str, Any], found: Understood) -> list[str]:
    """Files that the experiment does not name and that may be the other record of a press, those with like names first."""
    if _is_force(found) and _is_capacitance(found):
        return []
    named = {path for path, _ in entries_of(space, tables)}
    others = [name for name in space.lab_files() if name != found.name and space.folder / name not in named]
    others.sort(key=lambda name: -difflib.SequenceMatcher(None, name, found.name).ratio())
    wanted = _is_capacitance if _is_force(found) else _is_force
    return [
        name
        for name in others[:_NEAR]
        if wanted(other := understand(space, name)) and not (_is_force(other) and _is_capacitance(other))
    ]


def _is_force(found: Understood) -> bool:
    o = found.observations
    return o is not None and o.force is not None and o.displacement is not None


def _is_capacitance(found: Understood) -> bool:
    return found.observations is not None and found.observations.capacitance is not None


def _is_tied(found: Understood) -> bool:
    """Whether a record of capacitance says itself how deep or how hard was pressed."""
    o = found.observations
    return o is not None and (o.displacement is not None or o.force is not None)


@dataclass(frozen=True)
class _Pairing:
    """What names and times of files tell of one: its partner and why, its specimen in the experiment, names for both."""

    partner: str = ""
    why: str = ""
    specimen: str = ""
    name: str = ""
    press: str = ""


def _paired(space: Workspace, tables: Mapping[str, Any], found: Understood, near: Sequence[str]) -> _Pairing:
    """Pair a file with those near it, and with those of the experiment, as a draft would."""
    named = {path: at for path, at in entries_of(space, tables) if path.is_relative_to(space.folder) and path.is_file()}
    known = sorted(path.relative_to(space.folder).as_posix() for path in named)
    records = records_of(space, [found.name, *near, *known[:_KNOWN]])
    own = next((r for r in records if r.table.path == space.folder / found.name), None)
    for specimen in pair(records):
        press = next((p for p in specimen.presses if own is not None and own in (p.force, p.capacitance)), None)
        if press is None:
            continue
        other = press.capacitance if press.force is own else press.force
        partner = "" if other is None or other is own else other.table.path.relative_to(space.folder).as_posix()
        of = [
            r.table.path for p in specimen.presses for r in (p.force, p.capacitance) if r is not None and r.table.path in named
        ]
        index = named[of[0]].at[1] if of else None
        there = value_at(tables, ("specimens", index, "name")) if index is not None else ""
        why = press.in_words if partner in near else ""
        return _Pairing(partner if partner in near else "", why, str(there or ""), specimen.name, press.name)
    return _Pairing()


def _presses(tables: Mapping[str, Any], specimen: str) -> int:
    """How many presses a specimen has; of none in particular the one with the most."""
    sweeps = [s.get("sweeps") for s in specimens_in(tables) if specimen in ("", s.get("name"))]
    return max((len(own) if isinstance(own, list) else 1 for own in sweeps), default=1)


def _unused(name: str, names: Sequence[str]) -> str:
    wanted = name or "specimen"
    return next(n for n in (wanted, *(f"{wanted} {k}" for k in range(2, len(names) + 3))) if n not in names)


def _tie(space: Workspace, found: Understood, partner: str) -> tuple[tuple[str, ...], bool, tuple[Fault, ...]]:
    """By what the records of a press belong together, whether by the clock, and why they cannot be used so."""
    files = files_of_press(space, found, partner)
    if len(files) < 2:
        return (), False, ()
    both = files["force"], files["capacitance"]
    by_clock = both[0] is not both[1] and not _is_tied(both[1])
    sweep = _TIED.get(tuple(_mark(space.folder / u.name, u.said) for u in both), partial(_sweep, space, files))
    if isinstance(sweep, InputError):
        return (), by_clock, sweep.faults
    by = sweep.tied_by("capacitance")
    if by == "clock" and sweep.clock is not None:
        c = sweep.clock
        value = f"clock of the tester minus clock of the meter {c.value:.3g} s ± {c.sd:.2g} s, {c.confidence}"
        return (f"by the clocks of both: {value}", *c.evidence), True, ()
    words = {"displacement": "by the crosshead's column in the capacitance file", "force": "by the force column in it"}
    return (words.get(by, ""),) if by in words and both[0] is not both[1] else (), False, ()


def _sweep(space: Workspace, files: Mapping[str, Understood]) -> Sweep | InputError:
    """The sweep that the records of a press would be, or why they are none."""
    force, capacitance = files.get("force"), files.get("capacitance")
    main = force or capacitance
    assert main is not None
    try:
        return make_sweep(
            "new",
            "",
            5e-3,  # any: nothing that is asked here depends on the ball
            None if force is None else space.folder / force.name,
            None if capacitance is None else space.folder / capacitance.name,
            force_reading=AS_FOUND if force is None else force.said.reading,
            capacitance_reading=AS_FOUND if capacitance is None else capacitance.said.reading,
            use=main.said.use,
        )
    except InputError as error:
        return error


def _mark(path: Path, said: Said) -> str:
    stat = path.stat()
    return repr((str(path), stat.st_mtime_ns, stat.st_size, said))


def _folder_of(name: str) -> str:
    return name.rpartition("/")[0].removeprefix("lab").removeprefix("/")


def specimens_in(tables: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The tables of all specimens of an experiment file, given its tables; none where something else stands in their place."""
    found = tables.get("specimens")
    return [s for s in found if isinstance(s, dict)] if isinstance(found, list) else []


def records_of(space: Workspace, names: Sequence[str]) -> list[Found]:
    """The records of files, each looked through once as long as it and what is said of it stay the same.

    Parameters
    ----------
    space : the folder.
    names : of the files, as they are listed.
    """
    kept = space.said()
    found: list[Found] = []
    for name in names:
        path = space.folder / name
        said = kept.get(path, Said())
        looked = _LOOKED.get(_mark(path, said), partial(look_through, [path], {path: (said.reading, said.use)}))[0]
        found += [replace(record, folder=_folder_of(name)) for record in looked[0].records]
    return found


def files_of_press(space: Workspace, found: Understood, partner: str) -> dict[str, Understood]:
    """The records of a press: "force" and "capacitance" -> file.

    Parameters
    ----------
    space : the folder.
    found : one file of it.
    partner : name of the other; "" for none.
    """
    files = {"force": found} if _is_force(found) else {}
    if _is_capacitance(found):
        files["capacitance"] = found
    if partner:
        files["capacitance" if _is_force(found) else "force"] = understand(space, partner)
    return files

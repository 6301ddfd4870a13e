"""A lab file that the experiment does not name in, what it may be in it out; and, once that is said, the experiment with it."""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from calib.catalogue import QUANTITIES
from calib.errors import Fault, InputError
from calib.experiment import (
    MARK,
    Experiment,
    Found,
    KeyPath,
    Press,
    Pressed,
    Said,
    experiment_from,
    locate_keys,
    look_through,
    pair,
    read_sweeps,
    specimen_text,
)
from calib.files import sha256_of
from calib.lab import AS_FOUND, Sweep, make_sweep
from calib.priors import parse_value
from calib.serve.looking import Kept, Understood, entries_of, experiment_tables, reading_tables, understand, use_tables
from calib.serve.toml_text import value_at, with_entry, with_presses, with_value, without_mark
from calib.serve.workspace import Workspace
from calib.visible import name_fault, shortened

#: What a form says of which specimen a file is: a new one, or the name of one behind this.
NEW, OF = "new", "="

# Files beside one that are looked at for its partner, by how their names are alike.
_NEAR = 12
# Files of the experiment that one is held against by its name.
_KNOWN = 24
# What was read lately: a form that is sent again does not read it again.
_LOOKED, _TIED = Kept(64), Kept(16)
_ANOTHER, _SAME = "another", "same"
_THICKNESSES = ("sensor_thickness", "padding_thickness")


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
    names = tuple(str(s.get("name", "")) for s in _specimens(tables))
    near = _near(space, tables, found)
    told = _told_by_names(space, tables, found, near)
    partner = told.partner if chosen is None else chosen
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
        told.why if partner and partner == told.partner else "",
        needs,
        tie,
        clock,
        faults,
        names,
        told.specimen if told.specimen in names else "",
        _unused(told.name, names),
        told.press or f"press {_presses(tables, told.specimen) + 1}",
        str(value_at(tables, ("indenter", "radius")) or ""),
    )


def added(space: Workspace, form: Mapping[str, str]) -> str:
    """The text of the experiment with a file in it, as a form says.

    Parameters
    ----------
    space : the folder.
    form : `name` and `partner`, the files; `of`, `specimen`, `press`, `first`: which specimen, and names; `ball`, `radius`;
        `clock_offset` and `clock_offset_sd`; and of a new specimen each thickness and its sd, likewise.

    Raises
    ------
    InputError
        With everything that is not said, is wrong, or would then be wrong with the experiment.
    """
    said = {key: value.strip() for key, value in form.items()}
    told = offer(space, said.get("name", ""), said.get("partner", ""))
    faults = [*([Fault(f"it needs {told.needs}", advice="Choose it, or drop it first")] if told.needs else [])]
    of = said.get("of", "")
    names = told.specimens
    if of != NEW and of.removeprefix(OF) not in names:
        faults.append(Fault("which specimen was pressed?", advice="Choose one, or a new one"))
    faults += _name_faults(said, of, names)
    radius, wrong = _radius(said, told.ball)
    faults += wrong
    priors, wrong = _priors(said, of == NEW)
    faults += wrong
    faults += _clock_faults(space, priors, of)
    faults += _copies(space, told)
    if faults:
        raise InputError(faults)
    text = _with_specimen(space, told, said) if of == NEW else _with_press(space, told, said, radius)
    at: KeyPath = ("specimens", len(names) if of == NEW else names.index(of.removeprefix(OF)))
    if of == NEW and radius:
        text = with_value(text, (*at, "indenter_radius"), radius)
    for key, value in priors.items():
        text = _measured(text, (*at, "priors", key), value)
    _require_no_worse(space, text, int(at[1]), told, clock="clock_offset" in priors)
    return text


# --- what is said -------------------------------------------------------------------------------------------------------


def _name_faults(said: Mapping[str, str], of: str, names: Sequence[str]) -> list[Fault]:
    wanted = {"specimen": "the new specimen"} if of == NEW else {"press": "this press"}
    faults = []
    for key, what in wanted.items():
        name = said.get(key, "")
        if not name:
            faults.append(Fault(f"what is {what} called?", advice="Give it a name"))
        elif (fault := name_fault(name)) or any(c in name for c in "[],"):
            faults.append(Fault(f'"{shortened(name)}" {fault or "holds a bracket or a comma"}', advice="Choose another name"))
    if of == NEW and said.get("specimen") in names:
        faults.append(Fault(f'there is a specimen "{said["specimen"]}" already', advice="Choose it above, or another name"))
    return faults


def _radius(said: Mapping[str, str], usual: str) -> tuple[str, list[Fault]]:
    """The radius of another ball as it is to be written, "" for that of the experiment."""
    ball = said.get("ball", "")
    if ball == _SAME and usual:
        return "", []
    if ball != _ANOTHER:
        return "", [Fault("which ball pressed?", advice="Say whether it is that of the experiment, or another with its radius")]
    text = said.get("radius", "")
    fault = _not_positive("indenter_radius", text, "the radius of the ball", "5 mm")
    return (text, []) if fault is None else ("", [fault])


def _priors(said: Mapping[str, str], new: bool) -> tuple[dict[str, Any], list[Fault]]:
    """Priors that a form gives, empty ones left out: the clock's, and thicknesses of a new specimen."""
    found: dict[str, Any] = {}
    faults: list[Fault] = []
    for key in ("clock_offset", *(_THICKNESSES if new else ())):
        texts = said.get(key, ""), said.get(f"{key}_sd", "")
        if not any(texts):
            continue
        label = QUANTITIES[key].label
        if not all(texts):
            faults.append(Fault(f"{label}: a value and its standard deviation belong together", advice="Give both, or neither"))
            continue
        wrong = [_not_positive(key, texts[1], f"the standard deviation of the {label}", "0.02 mm")]
        wrong.append(
            _no_quantity(key, texts[0], label) if key == "clock_offset" else _not_positive(key, texts[0], label, "1 mm")
        )
        faults += [fault for fault in wrong if fault is not None]
        found[key] = {"normal": list(texts)}
    return found, faults


def _clock_faults(space: Workspace, priors: Mapping[str, Any], of: str) -> list[Fault]:
    """A fault where a specimen has clocks of its own already, which those given for one more press would replace."""
    there = next((s for s in _specimens(experiment_tables(space)) if f"{OF}{s.get('name')}" == of), {})
    if "clock_offset" not in priors or value_at(there, ("priors", "clock_offset")) is None:
        return []
    message = f"the experiment says already how far the clocks of {of.removeprefix(OF)} are apart, for all of its presses"
    return [Fault(message, advice="Leave the clocks out here, and change that in the experiment if it does not hold for all")]


def _no_quantity(key: str, text: str, what: str) -> Fault | None:
    try:
        parse_value(key, text)
    except InputError as error:
        return Fault(f"{what}: {error.faults[0].message}", advice=error.faults[0].advice)
    return None


def _not_positive(key: str, text: str, what: str, example: str) -> Fault | None:
    if not text:
        return Fault(f"{what} is not given", advice=f"Write for example {example}")
    try:
        value = parse_value(key, text)
    except InputError as error:
        return Fault(f"{what}: {error.faults[0].message}", advice=error.faults[0].advice)
    return None if 0 < value < math.inf else Fault(f"{what} must be positive, got {shortened(text)}")


def _copies(space: Workspace, told: Offer) -> list[Fault]:
    """A fault for a file whose bytes are those of one that is in the experiment: a press counted twice makes it too certain."""
    named = {path for path, _ in entries_of(space, experiment_tables(space)) if path.is_file()}
    there = {sha256_of(path): path.name for path in named}
    faults = []
    for name in (told.found.name, *([told.partner] if told.partner else [])):
        if of := there.get(sha256_of(space.lab_file(name))):
            advice = "Data counted twice make the result too certain: leave the copy out"
            faults.append(Fault(f"{name} has the same bytes as {of}, which is in the experiment", advice=advice))
    return faults


# --- what is there ------------------------------------------------------------------------------------------------------


def _specimens(tables: Mapping[str, Any]) -> list[dict[str, Any]]:
    found = tables.get("specimens")
    return [s for s in found if isinstance(s, dict)] if isinstance(found, list) else []


def _presses(tables: Mapping[str, Any], specimen: str) -> int:
    """How many presses a specimen has; of none in particular the one with the most."""
    sweeps = [s.get("sweeps") for s in _specimens(tables) if specimen in ("", s.get("name"))]
    return max((len(own) if isinstance(own, list) else 1 for own in sweeps), default=1)


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


def _is_force(found: Understood) -> bool:
    o = found.observations
    return o is not None and o.force is not None and o.displacement is not None


def _is_capacitance(found: Understood) -> bool:
    return found.observations is not None and found.observations.capacitance is not None


def _is_tied(found: Understood) -> bool:
    """Whether a record of capacitance says itself how deep or how hard was pressed."""
    o = found.observations
    return o is not None and (o.displacement is not None or o.force is not None)


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


@dataclass(frozen=True)
class _Told:
    """What names and times of files tell of one: its partner and why, its specimen in the experiment, names for both."""

    partner: str = ""
    why: str = ""
    specimen: str = ""
    name: str = ""
    press: str = ""


def _told_by_names(space: Workspace, tables: Mapping[str, Any], found: Understood, near: Sequence[str]) -> _Told:
    """Pair a file with those near it, and with those of the experiment, as a draft would."""
    named = {path: at for path, at in entries_of(space, tables) if path.is_relative_to(space.folder) and path.is_file()}
    known = sorted(path.relative_to(space.folder).as_posix() for path in named)
    records = _records(space, [found.name, *near, *known[:_KNOWN]])
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
        return _Told(partner if partner in near else "", why, str(there or ""), specimen.name, press.name)
    return _Told()


def _records(space: Workspace, names: Sequence[str]) -> list[Found]:
    """The records of files, each looked through once as long as it and what is said of it stay the same."""
    kept = space.said()
    found: list[Found] = []
    for name in names:
        path = space.folder / name
        said = kept.get(path, Said())
        looked = _LOOKED.get(_mark(path, said), partial(look_through, [path], {path: (said.reading, said.use)}))[0]
        found += [replace(record, folder=_folder_of(name)) for record in looked[0].records]
    return found


def _mark(path: Path, said: Said) -> str:
    stat = path.stat()
    return repr((str(path), stat.st_mtime_ns, stat.st_size, said))


def _folder_of(name: str) -> str:
    return name.rpartition("/")[0].removeprefix("lab").removeprefix("/")


def _unused(name: str, names: Sequence[str]) -> str:
    wanted = name or "specimen"
    return next(n for n in (wanted, *(f"{wanted} {k}" for k in range(2, len(names) + 3))) if n not in names)


def _files(space: Workspace, found: Understood, partner: str) -> dict[str, Understood]:
    """The records of a press: "force" and "capacitance" -> file."""
    files = {"force": found} if _is_force(found) else {}
    if _is_capacitance(found):
        files["capacitance"] = found
    if partner:
        files["capacitance" if _is_force(found) else "force"] = understand(space, partner)
    return files


def _tie(space: Workspace, found: Understood, partner: str) -> tuple[tuple[str, ...], bool, tuple[Fault, ...]]:
    """By what the records of a press belong together, whether by the clock, and why they cannot be used so."""
    files = _files(space, found, partner)
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


# --- into the experiment ------------------------------------------------------------------------------------------------


def _with_press(space: Workspace, told: Offer, said: Mapping[str, str], radius: str) -> str:
    """One more press of a specimen that is there."""
    text = space.text
    tables = tomllib.loads(text)
    names = [str(s.get("name", "")) for s in _specimens(tables)]
    k = names.index(said["of"].removeprefix(OF))
    files = _files(space, told.found, told.partner)
    entry: dict[str, Any] = {"name": said["press"]}
    for key, file in files.items():
        words = reading_tables(file.said.reading)
        entry[key] = {"file": file.name, **words} if words else file.name
    main = files.get("force") or files["capacitance"]
    if use := use_tables(main.said.use):
        entry["use"] = use
    if radius:
        entry["indenter_radius"] = radius
    own = tables["specimens"][k]
    if "sweeps" in own:
        return with_entry(text, ("specimens", k, "sweeps"), entry)
    first = said.get("first", "") or "press 1"
    if first == said["press"]:
        raise InputError(Fault(f'both presses would be called "{shortened(first)}"', advice="Give each its own name"))
    if fault := name_fault(first) or ("holds a bracket or a comma" if any(c in first for c in "[],") else ""):
        raise InputError(Fault(f'"{shortened(first)}" {fault}', advice="Choose another name"))
    return with_presses(text, k, first, entry)


def _with_specimen(space: Workspace, told: Offer, said: Mapping[str, str]) -> str:
    """One more specimen at the end, as a draft would have it."""
    files = _files(space, told.found, told.partner)
    found = {r.table.path: r for r in _records(space, list(dict.fromkeys(file.name for file in files.values())))}
    force, capacitance = (found[space.folder / files[key].name] if key in files else None for key in ("force", "capacitance"))
    press = Press(force, capacitance, told.why)
    text = space.text
    tables = tomllib.loads(text)
    electrical = capacitance is not None or any("capacitance" in str(s) for s in _specimens(tables))
    block = specimen_text(Pressed(said["specimen"], (press,)), space.folder, electrical)
    made = f"{text.rstrip()}\n\n{block}\n\n"
    try:
        now = tomllib.loads(made)
        own = now["specimens"].pop()
        right = now == tables and own["name"] == said["specimen"]
    except (tomllib.TOMLDecodeError, KeyError, AttributeError, IndexError):
        right = False
    if not right:
        raise InputError(Fault("specimens are written in a way that none can be put behind them", advice="Add it in the text"))
    return made


def _measured(text: str, at: KeyPath, value: Any) -> str:
    """A prior that somebody has given, in place of a guess and its mark."""
    made = with_value(text, at, value)
    line = locate_keys(made).get(at, (0, 0))[0]
    return without_mark(made, line) if line and MARK in made.split("\n")[line - 1] else made


def _require_no_worse(space: Workspace, text: str, specimen: int, told: Offer, *, clock: bool) -> None:
    """Refuse an experiment in which something would be wrong that was not before, and a press that cannot be read."""
    before = {fault.message for fault in _read(space, space.text)[1]}
    experiment, faults = _read(space, text)
    if new := [fault for fault in faults if fault.message not in before]:
        raise InputError([Fault(f"the experiment would be refused: {f.message}", advice=f.advice) for f in new])
    if experiment is None:  # for what was wrong before, so that its sweeps cannot be read
        if told.faults and not clock:
            raise InputError(told.faults)
        return
    own = experiment.specimens[specimen]
    read_sweeps(replace(experiment, specimens=(replace(own, sweeps=own.sweeps[-1:]),)))


def _read(space: Workspace, text: str) -> tuple[Experiment | None, tuple[Fault, ...]]:
    try:
        return experiment_from(tomllib.loads(text), space.folder), ()
    except InputError as error:
        return None, error.faults

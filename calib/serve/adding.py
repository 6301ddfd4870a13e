"""What a form says of a lab file in, the text of the experiment with that file in it out, or all that is not said or wrong."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from calib.catalogue import QUANTITIES
from calib.errors import Fault, InputError
from calib.experiment import MARK, Experiment, KeyPath, Press, Pressed, experiment_from, locate_keys, read_sweeps, specimen_text
from calib.files import sha256_of
from calib.priors import parse_value
from calib.serve.looking import entries_of, experiment_tables, reading_tables, use_tables
from calib.serve.offering import Offer, files_of_press, offer, records_of, specimens_in
from calib.serve.toml_text import value_at, with_entry, with_presses, with_value, without_mark
from calib.serve.workspace import Workspace
from calib.visible import name_fault, shortened

#: What a form says of which specimen a file is: a new one, or the name of one behind this.
NEW, OF = "new", "="
# How a form says which ball pressed, and the thicknesses that it gives of a new specimen.
_ANOTHER, _SAME = "another", "same"
_THICKNESSES = ("sensor_thickness", "padding_thickness")


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
    offered = offer(space, said.get("name", ""), said.get("partner", ""))
    faults = [*([Fault(f"it needs {offered.needs}", advice="Choose it, or drop it first")] if offered.needs else [])]
    of = said.get("of", "")
    names = offered.specimens
    if of != NEW and of.removeprefix(OF) not in names:
        faults.append(Fault("which specimen was pressed?", advice="Choose one, or a new one"))
    faults += _name_faults(said, of, names)
    radius, wrong = _radius(said, offered.ball)
    faults += wrong
    priors, wrong = _priors(said, of == NEW)
    faults += wrong
    faults += _clock_faults(space, priors, of)
    faults += _copies(space, offered)
    if faults:
        raise InputError(faults)
    text = _with_specimen(space, offered, said) if of == NEW else _with_press(space, offered, said, radius)
    at: KeyPath = ("specimens", len(names) if of == NEW else names.index(of.removeprefix(OF)))
    if of == NEW and radius:
        text = with_value(text, (*at, "indenter_radius"), radius)
    for key, value in priors.items():
        text = _measured(text, (*at, "priors", key), value)
    _require_no_worse(space, text, int(at[1]), offered, clock="clock_offset" in priors)
    return text


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
    there = next((s for s in specimens_in(experiment_tables(space)) if f"{OF}{s.get('name')}" == of), {})
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


def _copies(space: Workspace, offered: Offer) -> list[Fault]:
    """A fault for a file whose bytes are those of one that is in the experiment: a press counted twice makes it too certain."""
    named = {path for path, _ in entries_of(space, experiment_tables(space)) if path.is_file()}
    there = {sha256_of(path): path.name for path in named}
    faults = []
    for name in (offered.found.name, *([offered.partner] if offered.partner else [])):
        if of := there.get(sha256_of(space.lab_file(name))):
            advice = "Data counted twice make the result too certain: leave the copy out"
            faults.append(Fault(f"{name} has the same bytes as {of}, which is in the experiment", advice=advice))
    return faults


def _with_press(space: Workspace, offered: Offer, said: Mapping[str, str], radius: str) -> str:
    """One more press of a specimen that is there."""
    text = space.text
    tables = tomllib.loads(text)
    names = [str(s.get("name", "")) for s in specimens_in(tables)]
    k = names.index(said["of"].removeprefix(OF))
    files = files_of_press(space, offered.found, offered.partner)
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


def _with_specimen(space: Workspace, offered: Offer, said: Mapping[str, str]) -> str:
    """One more specimen at the end, as a draft would have it."""
    files = files_of_press(space, offered.found, offered.partner)
    found = {r.table.path: r for r in records_of(space, list(dict.fromkeys(file.name for file in files.values())))}
    force, capacitance = (found[space.folder / files[key].name] if key in files else None for key in ("force", "capacitance"))
    press = Press(force, capacitance, offered.why)
    text = space.text
    tables = tomllib.loads(text)
    electrical = capacitance is not None or any("capacitance" in str(s) for s in specimens_in(tables))
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


def _require_no_worse(space: Workspace, text: str, specimen: int, offered: Offer, *, clock: bool) -> None:
    """Refuse an experiment in which something would be wrong that was not before, and a press that cannot be read."""
    before = {fault.message for fault in _read(space, space.text)[1]}
    experiment, faults = _read(space, text)
    if new := [fault for fault in faults if fault.message not in before]:
        raise InputError([Fault(f"the experiment would be refused: {f.message}", advice=f.advice) for f in new])
    if experiment is None:  # for what was wrong before, so that its sweeps cannot be read
        if offered.faults and not clock:
            raise InputError(offered.faults)
        return
    own = experiment.specimens[specimen]
    read_sweeps(replace(experiment, specimens=(replace(own, sweeps=own.sweeps[-1:]),)))


def _read(space: Workspace, text: str) -> tuple[Experiment | None, tuple[Fault, ...]]:
    try:
        return experiment_from(tomllib.loads(text), space.folder), ()
    except InputError as error:
        return None, error.faults

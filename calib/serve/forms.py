"""An experiment file in, the fields of a form that shows the same out, each with a check beside it; and a field's value back.

The file is the truth: what a form cannot show stands there all the same, and what is wrong is kept, and said beside its field.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from typing import Any, Literal

from calib.catalogue import QUANTITIES, UNKNOWNS, unknowns_of
from calib.errors import Fault, InputError
from calib.experiment import (
    MARK,
    STANDS,
    KeyPath,
    Unedited,
    comments_in,
    experiment_schema,
    guess_at,
    locate_keys,
    read_experiment,
    unedited_lines,
)
from calib.priors import FORMS, parse_prior, parse_value
from calib.serve.deciding import Known, decided, known_by, measured_prior
from calib.serve.looking import experiment_tables
from calib.serve.toml_text import value_at, with_mark, with_note, with_value, without_mark
from calib.serve.workspace import Workspace


def as_json(value: Any) -> str:
    """A value of an experiment as a page compares it, a day as its text."""
    return json.dumps(value, default=str)


@dataclass(frozen=True)
class Field:
    """One value of an experiment, to be shown and changed.

    Attributes
    ----------
    at : path of its key.
    label, about : what it is, and what may be put in, in words.
    kind : "text", "choice", "quantity" or "prior".
    value : as it stands in the file; None if it does not.
    choices : of a choice, the words; of a prior, its kinds.
    example : of a value.
    default : what holds if it is not given, in words.
    task : what the mark EDIT asks for that is left of it; "" without one.
    marked : line of that mark; 0 without one.
    wrong : what is wrong with it; "" if nothing is.
    read : how it was understood; "" where that says nothing new.
    line : of its key in the file; 0 if it is not there.
    quantity : name of the quantity, for one with a unit.
    known : of a quantity that a draft guesses, how it is known; "" of the others.
    by : with what it was measured, as far as that is said.
    """

    at: KeyPath
    label: str
    about: str
    kind: str
    value: Any
    choices: tuple[str, ...] = ()
    example: str = ""
    default: str = ""
    task: str = ""
    wrong: str = ""
    read: str = ""
    line: int = 0
    marked: int = 0
    quantity: str = ""
    known: Known | Literal[""] = ""
    by: str = ""

    @property
    def name(self) -> str:
        """By which a form knows it."""
        return json.dumps(self.at)

    @property
    def identifier(self) -> str:
        """By which a page knows it."""
        return "f-" + "-".join(str(key) for key in self.at)

    @property
    def shown(self) -> str:
        """Its value as a text."""
        if self.at[-1] == "measured" and isinstance(self.value, list):
            return _TO.join(map(str, self.value))
        return "" if self.value is None else self.value if isinstance(self.value, str) else as_json(self.value)

    @property
    def kind_of_prior(self) -> str:
        """Of a prior, which distribution it is; "" for none."""
        return next(iter(self.value), "") if isinstance(self.value, dict) else ""

    @property
    def numbers(self) -> list[str]:
        """Of a prior, its numbers as texts."""
        found: Any = next(iter(self.value.values()), []) if isinstance(self.value, dict) else []
        return [str(number) for number in (found if isinstance(found, list) else [found])]

    @property
    def number_names(self) -> list[tuple[str, str]]:
        """Of a prior, its numbers by name, each with what stands there."""
        numbers = self.numbers
        names = FORMS.get(self.kind_of_prior, ())
        return [(name, numbers[k] if k < len(numbers) else "") for k, name in enumerate(names)]


@dataclass(frozen=True)
class FieldGroup:
    """Fields that belong together, under a heading; `addable` are unknowns that may get a prior there, at the path `at`.

    `identifier` is by what a page knows it; "" for none.
    """

    title: str
    fields: tuple[Field, ...]
    identifier: str = ""
    at: KeyPath = ()
    addable: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Form:
    """An experiment file as a form.

    Attributes
    ----------
    groups : of its fields.
    faults : what is wrong with it that no field shows.
    marked : lines that are still marked EDIT and hold what the draft put there.
    """

    groups: tuple[FieldGroup, ...]
    faults: tuple[Fault, ...]
    marked: tuple[Unedited, ...]

    @property
    def fields(self) -> Iterator[Field]:
        """Every field."""
        for group in self.groups:
            yield from group.fields


# Unknowns that a form offers without being asked for; others may be added.
_USUAL = ("young_modulus", "relative_permittivity", "machine_compliance", "parasitic_capacitance")
_OF_SPECIMEN = ("sensor_thickness", "padding_thickness", "dielectric_thickness")
_LABELS = {
    "name": "Heading of the report",
    "base": "Padding rests on a base",
    "pooling": "Specimens",
    "model": "Forward model",
    "discrepancy": "Model may be a little wrong",
    "law": "Material law",
    "material": "Padding is of",
    "friction_coefficient": "Friction of the ball",
}
# Of a laboratory and its instruments, by table and key.
_NAMES = {
    ("laboratory", "name"): "Name of the laboratory",
    ("laboratory", "operator"): "Who measured",
    ("laboratory", "email"): "E-mail",
    ("laboratory", "measured"): "Measured on",
    ("instruments", "kind"): "What it is",
    ("instruments", "serial"): "Serial number",
    ("instruments", "calibrated"): "Last calibrated on",
}
_EXAMPLES = {"measured": "2026-03-17, or 2026-03-17 to 2026-03-18", "calibrated": "2026-01-12", "country": "NZ"}
# Between the first day and the last.
_TO = " to "
_PARAMETERS = {("indenter", "radius"): "indenter_radius", ("sensor", "radius"): "sensor_radius"}


def form_of_experiment(space: Workspace) -> Form:
    """Show the experiment file of a folder as a form.

    Parameters
    ----------
    space : the folder.
    """
    text = space.text
    faults = _faults(space)
    tables = experiment_tables(space)
    if not tables:
        return Form((), faults, ())
    builder = _Builder(text, tables, faults)
    top = ("name", "base", "pooling", "model", "discrepancy")
    groups = [
        FieldGroup("Experiment", tuple(builder.field((key,)) for key in top)),
        FieldGroup("Ball", tuple(builder.field(("indenter", key)) for key in ("radius", "friction_coefficient"))),
        FieldGroup(
            "Sensor",
            tuple(builder.field(("sensor", key)) for key in ("radius", "electrode_radius", "dielectric_thickness", "law")),
        ),
        FieldGroup("Padding", (builder.field(("padding", "material")),)),
        builder.priors(("priors",), "Known before the data: material and rig", _USUAL, ("material", "rig")),
    ]
    specimens = tables.get("specimens")
    for i, specimen in enumerate(specimens if isinstance(specimens, list) else []):
        if isinstance(specimen, dict):
            title = f"Specimen {specimen.get('name', i + 1)}"
            groups.append(builder.priors(("specimens", i, "priors"), title, _OF_SPECIMEN, ("specimen", "sweep")))
    groups += builder.certificate()
    lines = {field.line for group in groups for field in group.fields if field.line}
    rest = tuple(fault for fault in faults if fault.line not in lines)
    return Form(tuple(groups), rest, builder.unedited)


def changed_by(space: Workspace, at: KeyPath, form: Mapping[str, str]) -> str:
    """Text of the experiment file with one field's value as a form gives it.

    Parameters
    ----------
    space : the folder.
    at : path of the field.
    form : `value`, or `kind` and `number0`, `number1`, ... of a prior; an empty value takes the key out. `example` puts an
        example of a prior there, marked EDIT.

    Raises
    ------
    InputError
        If there is no such field, or the file cannot be changed there.
    """
    field = next((field for field in form_of_experiment(space).fields if field.at == at), None)
    unknown = str(at[-1])
    if field is None and not (at[:-1] and at[-2] == "priors" and unknown in UNKNOWNS):
        raise InputError(Fault(f"there is no field {'.'.join(map(str, at))}", advice="Reload the page"))
    if form.get("example") == "yes" and (field is None or field.value is None) and unknown in UNKNOWNS:
        example = tomllib.loads(f"value = {UNKNOWNS[unknown].example}")["value"]
        return with_mark(with_value(space.text, at, example), at, "what you know of it; this is an example")
    if field is None or field.kind == "prior":
        changed = with_value(space.text, at, _prior(unknown, form))
    else:
        changed = with_value(space.text, at, _value(field, form.get("value", "").strip()))
    line = locate_keys(changed).get(at, (0, 0))[0]
    shown = changed.split("\n")[line - 1] if line else ""
    if STANDS in shown:
        return with_note(changed, at, "")  # no guess any more
    return without_mark(changed, line) if MARK in shown else changed  # somebody has said what it is


def decided_by(space: Workspace, at: KeyPath, form: Mapping[str, str]) -> str:
    """Text of the experiment file with what a form says of how a quantity is known.

    Parameters
    ----------
    space : the folder.
    at : path of the field.
    form : see `calib.serve.deciding`; of what was measured `mean` and `sd` of a prior, `value` of what has none; empty for what
        stands there.

    Raises
    ------
    InputError
        If there is nothing to decide there, or what is said makes no sense.
    """
    field = next((field for field in form_of_experiment(space).fields if field.at == at), None)
    if field is None or not field.known:
        raise InputError(Fault(f"there is nothing to decide at {'.'.join(map(str, at))}", advice="Reload the page"))
    if field.value is None and form.get("known") == "stands":
        return without_mark(space.text, field.marked)  # what is usual stands, which no line says
    own = field.kind == "prior"
    given = measured_prior(form) if own else _value(field, form.get("value", "").strip())
    return decided(space.text, at, form, None if given == field.value else given)


def _value(field: Field, text: str) -> Any:
    if not text:
        return None
    if field.at == ("laboratory", "measured") and _TO in text:
        return [day.strip() for day in text.split(_TO)]
    if field.at[-1] == "friction_coefficient" or (field.quantity and not QUANTITIES[field.quantity].unit):
        return _number(text)
    return text


def _number(text: str) -> int | float | str:
    """A plain number; what is none stays a text, which the reader of the file objects to."""
    try:
        number = float(text)
    except ValueError:
        return text
    if not math.isfinite(number):
        return text
    return int(number) if number.is_integer() and abs(number) < 1e15 and "." not in text and "e" not in text.lower() else number


def _prior(unknown: str, form: Mapping[str, str]) -> dict[str, Any] | None:
    kind = form.get("kind", "").strip()
    if not kind:
        return None
    names = FORMS.get(kind)
    if names is None:
        raise InputError(Fault(f'there is no prior "{kind[:40]}"', advice=f"Choose one of {', '.join(FORMS)}"))
    unit = QUANTITIES[unknown].unit
    texts = [form.get(f"number{k}", "").strip() for k in range(len(names))]
    plain = [name == "geometric sd" or not unit for name in names]
    numbers = [_number(text) if bare else text for text, bare in zip(texts, plain, strict=True)]
    return {kind: numbers if len(numbers) > 1 else numbers[0]}


def _rounded(name: str, value: float) -> str:
    """A value as people read it."""
    row = QUANTITIES[name]
    return f"{value * row.display_scale:.3g} {row.display_unit}".strip()


def _faults(space: Workspace) -> tuple[Fault, ...]:
    try:
        read_experiment(space.experiment)
    except InputError as error:
        return error.faults
    return ()


class _Builder:
    """Makes the fields of one file."""

    def __init__(self, text: str, tables: Mapping[str, Any], faults: Sequence[Fault]) -> None:
        self.lines, self.tables, self.faults = text.split("\n"), tables, faults
        self.places = locate_keys(text)
        self.unedited = tuple(u for u in unedited_lines(text, tables, self.places) if not u.stands)
        self.comments = dict(comments_in(text))
        self.schema = experiment_schema()["properties"]

    def field(self, at: KeyPath) -> Field:
        """One that is no prior."""
        schema = self.schema
        for key in at[:-1]:
            schema = schema["items"]["properties"] if isinstance(key, int) else schema[key]
            schema = schema if isinstance(key, int) else schema.get("properties", schema)
        own = schema[at[-1]]
        key = str(at[-1])
        quantity = _PARAMETERS.get((str(at[0]), key), key if key in QUANTITIES else "")
        label = QUANTITIES[quantity].label if quantity in QUANTITIES and key not in _LABELS else _LABELS.get(key, key)
        label = _NAMES.get((str(at[0]), key), label)
        choices = tuple(map(str, own.get("enum", ())))
        kind = "choice" if choices else "quantity" if quantity and key != "friction_coefficient" else "text"
        default = own.get("default")
        value = value_at(self.tables, at)
        value = value.isoformat() if isinstance(value, date) else value
        read = self._quantity_in_words(quantity, value) if kind == "quantity" and value is not None else ""
        if quantity in ("indenter_radius", "sensor_radius") and read:
            read = f"{read} in diameter"
        return Field(
            at,
            f"{label[0].upper()}{label[1:]}",
            own.get("description", ""),
            kind,
            value,
            choices,
            _EXAMPLES.get(key, str(own.get("examples", [""])[0])),
            "" if default is None else str(default),
            read=read,
            quantity=quantity if kind == "quantity" else "",
            **self._state(at),
        )

    def certificate(self) -> list[FieldGroup]:
        """What is for a certificate alone: the laboratory, and each instrument that is there."""
        laboratory = tuple(self.field(("laboratory", key)) for key in self.schema["laboratory"]["properties"])
        found = [FieldGroup("Laboratory, for a certificate", laboratory, "laboratory")]
        there = self.tables.get("instruments")
        for i, instrument in enumerate(there if isinstance(there, list) else []):
            if isinstance(instrument, dict):
                own = tuple(self.field(("instruments", i, key)) for key in self.schema["instruments"]["items"]["properties"])
                found.append(FieldGroup(f"Instrument {instrument.get('kind', i + 1)}", own))
        return found

    def priors(self, at: KeyPath, title: str, usual: Sequence[str], scopes: Sequence[Any]) -> FieldGroup:
        """Those of a table of priors: the usual ones, and those that are in the file."""
        there = value_at(self.tables, at)
        given = [key for key in (there if isinstance(there, dict) else {}) if key in UNKNOWNS and key not in usual]
        known = [name for name in unknowns_of(*scopes) if name not in usual and name not in given]
        return FieldGroup(
            title,
            tuple(self._prior((*at, name)) for name in (*usual, *given)),
            at=at,
            addable=tuple((name, UNKNOWNS[name].quantity.label) for name in known),
        )

    def _prior(self, at: KeyPath) -> Field:
        name = str(at[-1])
        row = UNKNOWNS[name]
        value = value_at(self.tables, at)
        read = ""
        if value is not None:
            try:
                prior = parse_prior(name, value)
                low, high = prior.interval(0.9)
                ends = _rounded(name, low), _rounded(name, high)
                read = f"known, {ends[0]}" if low == high else f"90 % between {ends[0]} and {ends[1]}"
            except (InputError, ValueError):
                read = ""
        label = row.quantity.label
        return Field(
            at,
            f"{label[0].upper()}{label[1:]}",
            f"Exists: {row.when}." + (f" Default because: {row.reason}." if row.reason else ""),
            "prior",
            value,
            tuple(FORMS),
            row.example,
            row.default or row.derived,
            read=read,
            quantity=name,
            **self._state(at),
        )

    def _state(self, at: KeyPath) -> dict[str, Any]:
        line = self.places.get(at, (0, 0))[0]
        own = [fault for fault in self.faults if line and fault.line == line]
        if not line:  # what is said of a key that is missing has the line of its table
            table, missing = self.places.get(at[:-1], (0, 0))[0], re.compile(rf"(?:\w+_)?{at[-1]}\b.* is missing")
            own = [fault for fault in self.faults if table and fault.line == table and missing.match(fault.message)]
        marked = next((u.line for u in self.unedited if self._is_of(u, at)), 0)
        shown = self.lines[marked - 1] if marked else ""
        task = shown[shown.rindex(MARK) + len(MARK) :].strip() if MARK in shown else ""
        wrong = " ".join(fault.sentences for fault in own)
        known: Known | Literal[""] = ""
        by = ""
        if task:
            known = "undecided"
        elif line and guess_at(at) is not None:
            known, by = known_by(self.comments.get(line, ""))
            known = "measured" if known == "undecided" else known  # a mark that stayed where the value is another
        return {"line": line, "task": task, "marked": marked if task else 0, "wrong": wrong, "known": known, "by": by}

    def _is_of(self, unedited: Unedited, at: KeyPath) -> bool:
        """Whether a mark is in the line of a key, or in one that is commented out and would give it."""
        line = self.places.get(at, (0, 0))[0]
        if line:
            return unedited.line == line
        of = value_at(self.tables, (*at[:2], "name")) if at[0] == "specimens" else ""
        return unedited.what == at[-1] and unedited.of == (of or "")

    @staticmethod
    def _quantity_in_words(name: str, value: Any) -> str:
        try:
            number = parse_value(name, value)
        except InputError:
            return ""
        return _rounded(name, 2 * number if name in ("indenter_radius", "sensor_radius") else number)

"""A lab file in, what was understood of it and what is said of it out; and corrections of that, back into a file."""

from __future__ import annotations

import io
import os
import threading
import tomllib
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from calib.catalogue import CHANNELS
from calib.errors import Fault, InputError
from calib.experiment import KeyPath, Said, compliance_said
from calib.lab import (
    QUANTITIES,
    SIGNED,
    SIGNS,
    Observations,
    Reading,
    Use,
    grade_rows,
    is_unit_of,
    judge,
    observe,
    read_lab_file,
    readings_of,
    use_in_words,
    use_value,
    why_left_out,
)
from calib.priors import parse_prior
from calib.report import any_letters, file_figure
from calib.serve.toml_text import value_at, with_value
from calib.serve.workspace import Workspace
from calib.visible import shortened

#: Units that a form offers for a quantity; any other may be typed.
UNITS = {
    "time": ("s", "ms", "min"),
    "displacement": ("mm", "um", "in", "m"),
    "force": ("N", "mN", "kN", "gf", "kgf", "lbf"),
    "capacitance": ("pF", "nF", "fF", "F"),
}
#: What the names of the fields of chosen rows end in: as many columns may be asked at once.
WHERES = ("", "_2", "_3", "_4")
#: One at a time draws: settings of the drawing library are those of the whole process.
DRAWING = threading.Lock()
# What was read is kept as long as the file is the same: reading a long file takes a second.
_KEPT = 64
# Rows of a file that are shown.
_FIRST_ROWS = 8

_T = TypeVar("_T")


class Kept:
    """What was computed lately, by what it was computed from; a page that is loaded again does not compute it again."""

    def __init__(self, most: int) -> None:
        self._most, self._kept, self._lock = most, OrderedDict[Hashable, Any](), threading.Lock()

    def get(self, key: Hashable, make: Callable[[], _T]) -> _T:
        """What a key stands for, made if it is not there.

        Parameters
        ----------
        key : all that it depends on.
        make : makes it.
        """
        with self._lock:
            if key in self._kept:
                self._kept.move_to_end(key)
                found: _T = self._kept[key]
                return found
        made = make()
        with self._lock:
            self._kept[key] = made
            while len(self._kept) > self._most:
                self._kept.popitem(last=False)
        return made


_OBSERVED = Kept(_KEPT)


@dataclass(frozen=True)
class Entry:
    """Where an experiment names a lab file: path of the key, and of the table that it stands in."""

    at: KeyPath
    sweep: KeyPath
    title: str


@dataclass(frozen=True, eq=False)
class Understood:
    """What is known of a lab file.

    Attributes
    ----------
    name : by which it is listed.
    said : of it, in the experiment if that names the file.
    entries : where the experiment names it.
    observations : what was understood; None if it is refused.
    faults : why.
    """

    name: str
    said: Said
    entries: tuple[Entry, ...]
    observations: Observations | None
    faults: tuple[Fault, ...]

    @property
    def apart(self) -> bool:
        """Whether it is no lab file at all, but settings or results, as calib exports them: JSON that no experiment names."""
        return self.observations is None and not self.entries and self.name.lower().endswith(".json")


def experiment_tables(space: Workspace) -> dict[str, Any]:
    """Tables of the experiment file, empty where there is none that can be read."""
    try:
        return tomllib.loads(space.text)
    except (tomllib.TOMLDecodeError, InputError, RecursionError):
        return {}


def understand(space: Workspace, name: str) -> Understood:
    """Read a lab file as it is said.

    Parameters
    ----------
    space : the folder.
    name : of the file, as it is listed.

    Raises
    ------
    InputError
        If there is no such file, or what is said of it cannot be read.
    """
    path = space.lab_file(name)
    entries = tuple(_entries(space, path))
    said = _said_in(experiment_tables(space), entries[0]) if entries else space.said().get(path, Said())
    try:
        return Understood(name, said, entries, observed(path, said), ())
    except InputError as error:
        return Understood(name, said, entries, None, error.faults)


def observed(path: Path, said: Said) -> Observations:
    """Read a lab file, or remember what was read.

    Parameters
    ----------
    path : of the file.
    said : of it.

    Raises
    ------
    InputError
        If it cannot be understood.
    """
    stat = path.stat()
    key = (str(path), stat.st_mtime_ns, stat.st_size, repr(said))
    return _OBSERVED.get(key, lambda: observe(read_lab_file(path, said.reading), said.use))


def picture(found: Observations) -> bytes:
    """Draw what was understood of a file, as PNG.

    Parameters
    ----------
    found : in it.
    """
    buffer = io.BytesIO()
    with DRAWING, any_letters():
        file_figure(found).savefig(buffer, format="png", dpi=100, metadata={"Software": None})
    return buffer.getvalue()


# --- in words -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Column:
    """A quantity of a file, ready to print."""

    name: str
    source: str
    low: str
    high: str
    unit: str
    noise: str
    resolution: str


def columns_of(o: Observations) -> list[Column]:
    """What every column that is read holds."""
    estimates = readings_of(o)
    found = []
    for name, values, scale, unit in _scaled(o):
        finite = values[np.isfinite(values)] * scale + 0.0
        low, high = (f"{finite.min():.6g}", f"{finite.max():.6g}") if finite.size else ("-", "-")
        e = estimates.get(name)
        about = ("", "") if e is None else (f"{e.noise * scale:.2g}", f"{e.resolution * scale:.2g}")
        found.append(Column(name, o.table.sources.get(name, ""), low, high, unit, *about))
    return found


def first_rows(o: Observations) -> tuple[list[str], list[list[str]]]:
    """The first rows that were read, in the units of display: headings, and a row of cells each."""
    there = list(_scaled(o))
    heads = ["line", *(f"{name} ({unit})" if unit else name for name, _, _, unit in there), "branch", "used"]
    n = min(_FIRST_ROWS, len(o.used))
    rows = []
    for row in range(n):
        cells = [f"{values[row] * scale + 0.0:.6g}" if np.isfinite(values[row]) else "-" for _, values, scale, _ in there]
        used = "yes" if o.used[row] else o.reason[row] or "no"
        rows.append([str(int(o.table.lines[row])), *cells, o.branch[row] or "-", used])
    return heads, rows


def notes_of(o: Observations) -> list[str]:
    """Choices that were made while reading, one sentence each."""
    which = [use_in_words(o.use, o.used_cycles)] if o.n_cycle > 1 or o.use.branch != "loading" else []
    signs = [decision.note for decision in o.signs.values()]
    return [note for note in (*signs, *which, *o.use_notes, *o.table.notes) if note]


def left_out(o: Observations) -> list[str]:
    """Which rows are not used, and what of the file is not read."""
    rows = [f"{count} rows not used: {reason}" for reason, count in why_left_out(o).most_common(12)]
    return [*rows, *(f"not read: {part}" for part in o.table.unread)]


def grades(space: Workspace, o: Observations) -> list[tuple[str, str, str, str, str]]:
    """What was judged of the data, the worst first: level, check, number, finding, advice.

    Parameters
    ----------
    space : the folder, whose experiment may say how far the machine gives.
    o : a lab file.
    """
    priors = experiment_tables(space).get("priors")
    name = "machine_compliance"
    try:
        given = {name: parse_prior(name, priors[name])} if isinstance(priors, dict) and name in priors else {}
    except (InputError, ValueError):
        given = {}  # what is wrong with it is said where it is changed
    return grade_rows(judge(o, **compliance_said(given)))


def _scaled(o: Observations) -> Iterator[tuple[str, Any, float, str]]:
    for name, values, scale, unit in (
        ("time", o.time, 1.0, "s"),
        ("displacement", o.displacement, 1e3, "mm"),
        *((name, values, CHANNELS[name].display_scale, CHANNELS[name].display_unit) for name, values in o.channels.items()),
    ):
        if values is not None:
            yield name, values, scale, unit


# --- what is said -------------------------------------------------------------------------------------------------------


def said_from(form: Mapping[str, str]) -> Said:
    """What a form says of a lab file; fields that are empty say nothing.

    Parameters
    ----------
    form : name of the field -> text.

    Raises
    ------
    InputError
        With every fault in it.
    """
    text = {name: value.strip() for name, value in form.items() if value.strip()}
    faults: list[Fault] = []

    def word(name: str, choices: tuple[str, ...]) -> str:
        value = text.get(name, "")
        if value and value not in choices:
            faults.append(Fault(f'{name.replace("_", " ")} must be one of {", ".join(choices)}, got "{value[:80]}"'))
            return ""
        return value

    for q in QUANTITIES:
        unit = text.get(f"units_{q}", "")
        if unit and q != "time" and not is_unit_of(unit, q):  # a time may be a form of a clock
            advice = (
                f"Write one such as {', '.join(UNITS[q])}" if q in UNITS else "Leave it empty, or write what the header says"
            )
            faults.append(Fault(f'unit of the {q.replace("_", " ")}: "{shortened(unit)}" is none', advice=advice))
    by_quantity = {key: {q: text[f"{key}_{q}"] for q in QUANTITIES if f"{key}_{q}" in text} for key in ("units", "columns")}
    specimen = text.get("specimen")
    if specimen is not None and not (specimen.isdecimal() and int(specimen) >= 1):
        faults.append(Fault(f'specimen must be a whole number from 1, got "{specimen[:80]}"'))
        specimen = None
    where: dict[str, str] = {}
    for column, value in ((text.get(f"where_column{k}"), text.get(f"where_value{k}")) for k in WHERES):
        if column is not None and value is not None and where.get(column, value) == value:
            where[column] = value
        elif column is not None and value is not None:
            faults.append(Fault(f'only rows where: "{shortened(column)}" cannot hold two values at once'))
        elif column is not None or value is not None:
            faults.append(Fault("only rows where: a column and its value belong together"))
    sign = {q: sense for q in SIGNED if (sense := word(f"sign_{q}", tuple(SIGNS)))}
    reading = Reading(
        units=by_quantity["units"],
        columns=by_quantity["columns"],
        specimen=None if specimen is None else int(specimen),
        where=where,
        sheet=text.get("sheet", ""),
        sign=sign,
        scale=word("scale", ("micro",)),
        decimal=word("decimal", (".", ",")),
    )
    use: dict[str, Any] = {}
    for key in ("max_force", "max_depth", "branch", "cycles"):
        if key not in text:
            continue
        numbers = [part.strip() for part in text[key].split(",")]
        whole = key == "cycles" and all(part.isdecimal() for part in numbers)
        try:
            use[key] = use_value(key, [int(part) for part in numbers] if whole else text[key])
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    return Said(reading, Use(**use))


def form_of(said: Said) -> dict[str, str]:
    """Fields of a form that says the same, the inverse of `said_from`."""
    r, use = said.reading, said.use
    found = {f"units_{q}": unit for q, unit in r.units.items()}
    found |= {f"columns_{q}": column for q, column in r.columns.items()}
    found |= {f"sign_{q}": sense for q, sense in r.sign.items()}
    found |= {"sheet": r.sheet, "scale": r.scale, "decimal": r.decimal}
    found |= {"specimen": "" if r.specimen is None else str(r.specimen)}
    for k, (column, value) in zip(WHERES, r.where.items(), strict=False):
        found |= {f"where_column{k}": column, f"where_value{k}": value}
    found |= {"max_force": "" if use.max_force is None else f"{use.max_force:.12g} N"}
    found |= {"max_depth": "" if use.max_depth is None else f"{use.max_depth * 1e3:.12g} mm"}
    found |= {"branch": "" if use.branch == "loading" else use.branch}
    return found | {"cycles": ", ".join(map(str, use.cycles))}


def correct(space: Workspace, name: str, said: Said) -> None:
    """Keep what is said of a lab file: in the experiment where that names it, else beside it.

    Parameters
    ----------
    space : the folder.
    name : of the file.
    said : of it.

    Raises
    ------
    InputError
        If the experiment is written so that a form cannot change it.
    """
    path = space.lab_file(name)
    entries = list(_entries(space, path))
    if not entries:
        space.say(path, said)
        return
    text = space.text
    tables = tomllib.loads(text)
    for entry in entries:
        now = value_at(tables, entry.at)
        file = now["file"] if isinstance(now, dict) else now
        words = reading_tables(said.reading)
        if isinstance(now, dict) and "specimen" in now and len(entries) > 1:  # several specimens of one file are its entries
            words["specimen"] = now["specimen"]
        if isinstance(now, dict) and isinstance(now.get("where"), dict) and len(now["where"]) > 1:  # more than the form shows
            words["where"] = now["where"]
        text = with_value(text, entry.at, {"file": file, **words} if words else file)
        text = with_value(text, (*entry.sweep, "use"), use_tables(said.use) or None)
    space.write_experiment(text)


def reading_tables(reading: Reading) -> dict[str, Any]:
    """What is said of how a file is read, as tables of TOML; what is not said is not there."""
    found: dict[str, Any] = {}
    for key in ("units", "columns", "where", "sign"):
        if table := dict(getattr(reading, key)):
            found[key] = table
    if reading.specimen is not None:
        found["specimen"] = reading.specimen
    texts = {"sheet": reading.sheet, "scale": reading.scale, "decimal": reading.decimal}
    return found | {key: text for key, text in texts.items() if text}


def use_tables(use: Use) -> dict[str, Any]:
    """The part of a press that is used, as a table of TOML; empty for the usual one."""
    found: dict[str, Any] = {}
    if use.max_force is not None:
        found["max_force"] = f"{use.max_force:.12g} N"
    if use.max_depth is not None:
        found["max_depth"] = f"{use.max_depth * 1e3:.12g} mm"
    if use.branch != "loading":
        found["branch"] = use.branch
    return found | ({"cycles": list(use.cycles)} if use.cycles else {})


def _entries(space: Workspace, path: Path) -> Iterator[Entry]:
    """Where the experiment names a file."""
    return (entry for named, entry in entries_of(space, experiment_tables(space)) if named == path)


def entries_of(space: Workspace, tables: Mapping[str, Any]) -> Iterator[tuple[Path, Entry]]:
    """Every lab file that an experiment names, and where.

    Parameters
    ----------
    space : the folder.
    tables : of the experiment.
    """
    specimens = tables.get("specimens")
    for i, specimen in enumerate(specimens if isinstance(specimens, list) else []):
        if not isinstance(specimen, dict):
            continue
        presses: list[tuple[KeyPath, Any]] = [(("specimens", i), specimen)]
        sweeps = specimen.get("sweeps")
        presses += [(("specimens", i, "sweeps", j), s) for j, s in enumerate(sweeps if isinstance(sweeps, list) else [])]
        for at, press in presses:
            for key in ("force", "capacitance"):
                entry = press.get(key) if isinstance(press, dict) else None
                file = entry.get("file") if isinstance(entry, dict) else entry
                if isinstance(file, str) and file and "\0" not in file:
                    yield (
                        Path(os.path.abspath(space.folder / file)),
                        Entry((*at, key), at, f"{specimen.get('name', i + 1)}, {key}"),
                    )


def _said_in(tables: Mapping[str, Any], entry: Entry) -> Said:
    """What an experiment says of a file, read as a form would have it."""
    now = value_at(tables, entry.at)
    form: dict[str, str] = {}
    for key, value in now.items() if isinstance(now, dict) else ():
        if key in ("units", "columns") and isinstance(value, dict):
            form |= {f"{key}_{q}": str(v) for q, v in value.items()}
        elif key == "sign":
            senses = value if isinstance(value, dict) else dict.fromkeys(SIGNED, value)
            form |= {f"sign_{q}": str(v) for q, v in senses.items()}
        elif key == "where" and isinstance(value, dict):
            form |= {"where_column": str(next(iter(value), "")), "where_value": str(next(iter(value.values()), ""))}
        elif key != "file":
            form[key] = str(value)
    use = value_at(tables, (*entry.sweep, "use"))
    for key, value in use.items() if isinstance(use, dict) else ():
        form[key] = ", ".join(map(str, value)) if isinstance(value, list) else str(value)
    said = said_from(form)
    where = now.get("where") if isinstance(now, dict) else None
    if isinstance(where, dict) and len(where) > 1:
        said = replace(said, reading=replace(said.reading, where={str(k): str(v) for k, v in where.items()}))
    return said

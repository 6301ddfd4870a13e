"""The lab files that an experiment file names: sweeps of a specimen, how each file is to be read, and whether it is there."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from calib.experiment.lab_entries import READING_KEYS, reading_at, use_at
from calib.experiment.plan import SweepFiles
from calib.experiment.signposts import SIGNPOSTS, SWEEP_KEYS
from calib.experiment.toml_file import Toml
from calib.experiment.toml_places import KeyPath
from calib.experiment.toml_values import check_keys, quantity_at, quoted, table_at, tables_at, text_at
from calib.lab import AS_FOUND, Reading
from calib.regular import names_beside
from calib.visible import LONGEST_NAME, character_fault, name_fault, shortened


def read_sweeps_of(toml: Toml, at: KeyPath, radius: float, meant: set[str]) -> list[tuple[SweepFiles, KeyPath]]:
    """Read which sweeps a specimen has: its [[specimens.sweeps]], or its own files if it has but one sweep (the short form).

    Parameters
    ----------
    toml : the file, which faults are noted in.
    at : path of the specimen's table.
    radius : [m], of the ball, for sweeps that do not name another.
    meant : keys of the specimen that were misspelled, see `check_keys`; they are not reported as missing.

    Returns
    -------
    The files of each sweep, and the path of the key of its first file: the place for faults that concern the sweep.
    """
    specimen = table_at(toml, at)
    short = [key for key in SWEEP_KEYS if key in specimen]
    if "sweeps" not in specimen:
        if not short and meant.isdisjoint(SWEEP_KEYS) and "sweeps" not in meant:
            message = f"specimen {quoted(specimen.get('name'))} has neither a force nor a capacitance file"
            toml.fault(at, message, 'Give for example force = "sensor1_instron.csv"')
            return []
        return [_sweep(toml, at, "", radius, quiet=not meant.isdisjoint(SWEEP_KEYS))]
    if short:
        message = f"specimen {quoted(specimen.get('name'))} has both {short[0]} and [[specimens.sweeps]]"
        toml.fault((*at, short[0]), message, "Move it into a [[specimens.sweeps]] of its own, or leave the sweeps out")
    sweeps: list[tuple[SweepFiles, KeyPath]] = []
    for number, place in enumerate(tables_at(toml, (*at, "sweeps")), start=1):
        found = check_keys(toml, place, ("name", *SWEEP_KEYS), SIGNPOSTS)
        name = text_at(toml, (*place, "name"), default=f"sweep {number}")
        check_name(toml, (*place, "name"), name)
        if name in (sweep.name for sweep, _ in sweeps):
            message = f'sweep "{name}" of specimen {quoted(specimen.get("name"))} is given twice'
            toml.fault((*place, "name"), message, "Give each its own name")
        sweeps.append(_sweep(toml, place, name, radius, quiet=not found.isdisjoint(SWEEP_KEYS)))
    return sweeps


def _sweep(toml: Toml, at: KeyPath, name: str, radius: float, *, quiet: bool) -> tuple[SweepFiles, KeyPath]:
    table = table_at(toml, at)
    if "indenter_radius" in table:
        radius = quantity_at(toml, (*at, "indenter_radius"), "indenter_radius")
    if "force" not in table and "capacitance" not in table and not quiet:
        what = f'sweep "{name}"' if name else f"specimen {quoted(table.get('name'))}"
        toml.fault(at, f"{what} has neither a force nor a capacitance file", 'Give for example force = "sensor1_instron.csv"')
    nothing = (None, AS_FOUND)
    force, capacitance = (_lab_file(toml, (*at, key)) if key in table else nothing for key in ("force", "capacitance"))
    files = SweepFiles(name, force[0], capacitance[0], radius, force[1], capacitance[1], use_at(toml, (*at, "use")))
    return files, (*at, "force" if "force" in table else "capacitance")


def _lab_file(toml: Toml, at: KeyPath) -> tuple[Path | None, Reading]:
    """Read the entry of a lab file: absolute path, and how to read it; None and a fault if there is no such file."""
    if not isinstance(table_at(toml, at[:-1])[str(at[-1])], Mapping):
        return _path(toml, at), AS_FOUND
    table = table_at(toml, at)
    check_keys(toml, at, ("file", *READING_KEYS), SIGNPOSTS)
    reading = reading_at(toml, at)
    if "file" not in table:
        toml.fault(at, f"{at[-1]} names no file", 'Give { file = "sensor1_instron.csv", ... }')
        return None, AS_FOUND
    return _path(toml, (*at, "file")), reading


def _path(toml: Toml, at: KeyPath) -> Path | None:
    text = text_at(toml, at)
    if not text:
        return None
    if fault := character_fault(text):
        toml.fault(at, f'{at[-1]} is not the name of a file, got "{shortened(text)}", which {fault}', "Rename it")
        return None
    path = Path(os.path.abspath(toml.folder / text))  # not resolve(): a symbolic link keeps its name
    if os.path.isfile(path):  # which a name that no system takes is not, without an error
        return path
    what = f"{at[-1]} file"
    if len(text) > 2 * LONGEST_NAME:
        toml.fault(at, f'{what} not found: "{shortened(text)}"')
    elif os.path.exists(path) and not path.is_dir():
        toml.fault(at, f"{what} {path} is a pipe or a device", "Give the name of a file")
    elif path.is_dir():
        toml.fault(at, f"{what} {path} is a folder", names_beside(path / path.name))
    elif "\\" in text:
        toml.fault(at, f"{what} not found: {path}", "Write paths with forward slashes")
    elif not path.parent.is_dir():
        advice = "Write paths relative to the experiment file"
        toml.fault(at, f"{what} not found, there is no folder {path.parent}", advice)
    else:
        toml.fault(at, f"{what} not found: {path}", names_beside(path))
    return None


def check_name(toml: Toml, at: KeyPath, name: str) -> None:
    """Note a fault if a specimen's or sweep's name cannot stand in brackets as in contact_offset[sensor 1, ball 2].

    Parameters
    ----------
    toml : the file.
    at : path of the key of the name.
    name : of the specimen or sweep.
    """
    if any(c in name for c in "[],\n\r"):
        toml.fault(at, f'name "{shortened(name)}" must not contain brackets, commas or line breaks')
    elif fault := name_fault(name):
        toml.fault(at, f'name "{shortened(name)}" {fault}', "It stands in tables, in figures and in the names of results")

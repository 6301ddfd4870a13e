"""An experiment file among what was dropped, or the example that comes with the package, in, the experiment of the page out.

Its lab files stay where they are; it is written anew with their names as seen from the page's folder.
"""

from __future__ import annotations

import os
import shutil
import tomllib
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from calib.errors import Fault, InputError
from calib.experiment import LARGEST_TOML, KeyPath, shipped, walk
from calib.regular import bytes_of
from calib.serve.toml_text import value_at, with_value
from calib.serve.workspace import Workspace
from calib.visible import shortened

_FILES = ("force", "capacitance")
# Of experiment files so many are offered; each has these tables, which no other TOML of this program has together.
_MOST, _TABLES = 20, {"specimens", "indenter", "sensor"}
# Where the example goes, and which of its files: those that a lab would drop.
_EXAMPLE, _OF_EXAMPLE = "example", (".csv", ".toml")


@dataclass(frozen=True)
class Offered:
    """An experiment file in a folder below that of the page.

    Attributes
    ----------
    name : of the file, as seen from the page's folder.
    title : that it gives itself; "" for none.
    specimens : names of them.
    """

    name: str
    title: str
    specimens: tuple[str, ...]


def experiments_in(space: Workspace) -> tuple[Offered, ...]:
    """Find experiment files in folders below that of the page, such as one that came along with dropped lab files.

    Parameters
    ----------
    space : the folder.
    """
    found: list[Offered] = []
    for path, _ in walk(space.folder):
        if path.suffix.lower() == ".toml" and path.parent != space.folder and not path.is_symlink() and len(found) < _MOST:
            try:
                tables = _tables(path)
            except (InputError, OSError):
                continue
            names = tuple(str(one.get("name", "")) for one in tables["specimens"])
            found.append(Offered(path.relative_to(space.folder).as_posix(), str(tables.get("name", "")), names))
    return tuple(found)


def use_experiment(space: Workspace, name: str) -> None:
    """Make an experiment file of a folder below that of the page the experiment of the page.

    Parameters
    ----------
    space : the folder.
    name : of the file, as it is offered.

    Raises
    ------
    InputError
        If there is an experiment already, none is offered by this name, or it names files outside of the folder.
    """
    if os.path.lexists(space.experiment):
        advice = "Move it elsewhere first, or open the page of the other folder"
        raise InputError(Fault("there is an experiment in this folder, which is not overwritten", advice=advice))
    if name not in (offered.name for offered in experiments_in(space)):
        raise InputError(Fault(f'no experiment "{shortened(name)}" is offered here', advice="Reload the page"))
    path = space.folder / name
    text = bytes_of(path, LARGEST_TOML, "an experiment file").decode("utf-8-sig").replace("\r\n", "\n")
    tables = tomllib.loads(text)
    faults: list[Fault] = []
    for at in _places_of_files(tables):
        try:
            text = with_value(text, at, _from_here(space, path, str(value_at(tables, at))))
        except InputError as error:
            faults += error.faults
    if faults:
        raise InputError(faults)
    space.write_experiment(text)


def put_example(space: Workspace) -> None:
    """Put the lab files of the shipped example into the folder, as if they had been dropped, and use its experiment.

    Parameters
    ----------
    space : the folder.

    Raises
    ------
    InputError
        If there is an experiment already, or something else by the name of its folder.
    """
    folder = space.lab / _EXAMPLE
    if os.path.lexists(space.experiment) or os.path.lexists(folder) or space.lab.is_symlink():
        advice = "Open the page of a new folder to try the example"
        raise InputError(Fault("there is an experiment, or the example, in this folder already", advice=advice))
    space.lab.mkdir(exist_ok=True)
    part = space.lab / f".{_EXAMPLE}.part"
    shutil.rmtree(part, ignore_errors=True)
    try:
        part.mkdir()
        for file in sorted(shipped().iterdir()):
            if file.suffix in _OF_EXAMPLE:
                shutil.copyfile(file, part / file.name)
        part.rename(folder)
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise
    use_experiment(space, (folder / space.experiment.name).relative_to(space.folder).as_posix())


def _tables(path: Path) -> dict[str, Any]:
    """The tables of an experiment file.

    Raises
    ------
    InputError
        If it is none.
    """
    try:
        tables = tomllib.loads(bytes_of(path, LARGEST_TOML, "an experiment file").decode("utf-8-sig"))
    except (ValueError, RecursionError):
        tables = {}
    specimens = tables.get("specimens")
    if not tables.keys() >= _TABLES or not isinstance(specimens, list) or not all(isinstance(one, dict) for one in specimens):
        raise InputError(Fault("this is no experiment file", path))
    return tables


def _places_of_files(tables: dict[str, Any]) -> list[KeyPath]:
    """Where an experiment names lab files."""
    found: list[KeyPath] = []
    for i, specimen in enumerate(tables["specimens"]):
        sweeps = specimen.get("sweeps", [])
        of: list[tuple[KeyPath, Any]] = [(("specimens", i), specimen)]
        of += [(("specimens", i, "sweeps", k), sweep) for k, sweep in enumerate(sweeps if isinstance(sweeps, list) else [])]
        for at, table in of:
            for key in _FILES:
                value = table.get(key) if isinstance(table, dict) else None
                if isinstance(value, str):
                    found.append((*at, key))
                elif isinstance(value, dict) and isinstance(value.get("file"), str):
                    found.append((*at, key, "file"))
    return found


def _from_here(space: Workspace, path: Path, named: str) -> str:
    """The name of a lab file as seen from the page's folder.

    Raises
    ------
    InputError
        If it leads out of that.
    """
    there = Path(os.path.normpath(path.parent / named))
    absolute = PurePosixPath(named).is_absolute() or PureWindowsPath(named).drive or PureWindowsPath(named).root
    if absolute or not there.is_relative_to(space.folder):
        advice = "Drop that file, too, and name it in the text of the experiment as seen from its folder"
        message = f'"{shortened(named)}", which {path.name} names, lies outside of what was dropped'
        raise InputError(Fault(message, advice=advice))
    return there.relative_to(space.folder).as_posix()

"""A TOML file of what is said of lab files before they are in an experiment in, how each is to be read and used out, and back.

It holds one table for each file, with the keys that an experiment file has beside the file's name, and `use`::

    [files."lab/press.csv"]
    units = { force = "kN" }
    use = { cycles = [2] }
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from calib.experiment.draft import quoted_text, reading_words, relative_name, use_words
from calib.experiment.lab_entries import READING_KEYS, reading_at, use_at
from calib.experiment.signposts import SIGNPOSTS
from calib.experiment.toml_file import read_toml
from calib.experiment.toml_values import check_keys, raise_faults, table_at
from calib.lab import AS_FOUND, FIRST_LOADING, Reading, Use


@dataclass(frozen=True)
class Said:
    """What is said of one lab file: how it is to be read, and which part of it is used."""

    reading: Reading = AS_FOUND
    use: Use = FIRST_LOADING


def read_said(path: Path | str) -> dict[Path, Said]:
    """Read what is said of lab files; file names in it are relative to the folder that it lies in.

    Parameters
    ----------
    path : the TOML file.

    Returns
    -------
    Absolute path of a lab file -> what is said of it.

    Raises
    ------
    InputError
        With every fault of the file, each with line and column.
    """
    toml = read_toml(Path(path))
    check_keys(toml, (), ("files",), SIGNPOSTS)
    found: dict[Path, Said] = {}
    for name in table_at(toml, ("files",)):
        at = ("files", name)
        check_keys(toml, at, (*READING_KEYS, "use"), SIGNPOSTS)
        found[(toml.folder / name).absolute()] = Said(reading_at(toml, at), use_at(toml, (*at, "use")))
    raise_faults(toml)
    return found


def said_toml(said: Mapping[Path, Said], folder: Path) -> str:
    """Write what is said of lab files, so that `read_said` reads the same.

    Parameters
    ----------
    said : absolute path of a lab file -> what is said of it.
    folder : absolute, that the text is written into.
    """
    lines = ["# How lab files are to be read that are in no experiment file yet: `calib init FILES... --said` goes by it."]
    for path, of_file in said.items():
        lines += ["", f"[files.{quoted_text(relative_name(path, folder))}]", *reading_words(of_file.reading)]
        if words := use_words(of_file.use):
            lines.append(f"use = {{ {', '.join(words)} }}")
    return "\n".join(lines) + "\n"

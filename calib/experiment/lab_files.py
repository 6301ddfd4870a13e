"""Files and folders in, every file in them out: with the records it holds, or with the reason why it is left out."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from calib.errors import Choice, Fault, InputError
from calib.experiment.folder import walk, written_by_calib
from calib.lab import AS_FOUND, FIRST_LOADING, LabTable, Reading, Use, observe, read_lab_file


@dataclass(frozen=True, eq=False)
class Found:
    """One record of a lab file, for which `calib init` looks for a partner.

    Attributes
    ----------
    table : what was read; if the file leaves something open, with the first alternative that can be read.
    reading : what an experiment file must say of the file besides what is open: which specimen in it.
    open : refusals of the file that its user must answer by a choice, in the order in which they came.
    notes : choices made while reading, one sentence each; none if something is open.
    folder : of the file, relative to the folder that was looked through; "" if it lies there or was named itself.
    use : which part of the press is used, where that was said.
    """

    table: LabTable
    reading: Reading = AS_FOUND
    open: tuple[Fault, ...] = ()
    notes: tuple[str, ...] = ()
    folder: str = ""
    use: Use = FIRST_LOADING

    @property
    def title(self) -> str:
        """Name of the record: that of its file without ending.

        It is "S7_1" for Bluehill's `S7.is_comp_RawData/Specimen_RawData_1.csv`.
        """
        path = self.table.path
        numbered = re.fullmatch(r"specimen_?rawdata_?(\d+)", path.stem, re.IGNORECASE)
        sample = _BLUEHILL.fullmatch(path.absolute().parent.name)
        return f"{sample[1]}_{numbered[1]}" if numbered and sample else path.stem

    @property
    def shown(self) -> str:
        """Name of its file, with the folder that it lies in."""
        return f"{self.folder}/{self.table.path.name}" if self.folder else self.table.path.name

    @property
    def folders(self) -> tuple[str, ...]:
        """Folders that it lies in, but for that of Bluehill's raw data, which the title tells."""
        parts = tuple(part for part in self.folder.split("/") if part)
        return parts[:-1] if parts and _BLUEHILL.fullmatch(parts[-1]) else parts

    @property
    def is_force(self) -> bool:
        """Whether it holds force over displacement."""
        return {"force", "displacement"} <= set(self.table.columns)

    @property
    def is_capacitance(self) -> bool:
        """Whether it holds capacitance."""
        return "capacitance" in self.table.columns


_BLUEHILL = re.compile(r"(.+)\.is_\w+_rawdata", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Looked:
    """One file or folder that was come across.

    Attributes
    ----------
    path : where it is.
    shown : its path as listed, relative to the folder that was looked through.
    records : what it holds.
    left_out : why it, or a part of it, is not used, one sentence each.
    note : what is to be known of it as a file; "" for nothing.
    named : whether the user named it, and did not only name a folder around it.
    faults : what is wrong with a file that was named and cannot be used.
    """

    path: Path
    shown: str
    records: tuple[Found, ...] = ()
    left_out: tuple[str, ...] = ()
    note: str = ""
    named: bool = False
    faults: tuple[Fault, ...] = ()


def look_through(
    paths: Iterable[Path], said_of: Mapping[Path, tuple[Reading, Use]] = MappingProxyType({})
) -> tuple[list[Looked], list[Path]]:
    """Look at every file that is named or lies in a folder that is named, at any depth, whatever its ending.

    Parameters
    ----------
    paths : files and folders.
    said_of : absolute path of a file -> what is said of how it is read, and of the part of it that is used.

    Raises
    ------
    InputError
        If a folder holds no file, or no file can be used; with the reason of each.

    Returns
    -------
    Every file, and folders that were not looked into, in order; and what lies there and was written by calib itself, which is
    no lab file: experiment files, run folders, tables of `calib read` and `calib simulate`.
    """
    given = list(dict.fromkeys(paths))
    named = {path for path in given if not path.is_dir()}
    looked: list[Looked] = []
    own: list[Path] = []
    for path in given:
        if path in named:
            looked.append(_look(path, path.name, "", said_of, named=True))
            continue
        inside = [entry for entry in walk(path) if entry[0] not in named]
        if not inside:
            raise InputError(Fault("there is no file in this folder", path))
        for file, reason in inside:
            shown = file.relative_to(path).as_posix() + ("/" if reason.endswith("folder") else "")
            if written_by_calib(file):
                own.append(file)
            elif reason:
                looked.append(Looked(file, shown, left_out=(reason,)))
            else:
                folder = file.relative_to(path).parent
                looked.append(_look(file, shown, "" if folder == Path() else folder.as_posix(), said_of, named=False))
    return _with_copies_noted(looked), own


def _look(path: Path, shown: str, folder: str, said_of: Mapping[Path, tuple[Reading, Use]], *, named: bool) -> Looked:
    reading, use = said_of.get(path.absolute(), (AS_FOUND, FIRST_LOADING))
    try:
        records, left_out = _records(path, reading, reading, ())
    except InputError as error:
        return Looked(path, shown, (), (error.faults[0].message,), named=named, faults=error.faults)
    return Looked(path, shown, tuple(replace(r, folder=folder, use=use) for r in records), left_out, named=named)


#: Alternatives of a choice that are tried until one can be read.
_TRIED = 4


def _records(
    path: Path, reading: Reading, preview: Reading, asked: tuple[Fault, ...]
) -> tuple[tuple[Found, ...], tuple[str, ...]]:
    """Every record of a file, and why others of it are left out; what is open is tried with its first alternatives.

    Raises
    ------
    InputError
        As `read_lab_file` and `observe`; and if a record holds neither force over displacement nor capacitance.
    """
    try:
        table = read_lab_file(path, preview)
        sign_note = observe(table).sign_note
    except InputError as error:
        fault = error.faults[0]
        choice = fault.choice
        if choice is None or any(f.choice is None for f in error.faults) or any(f.choice == choice for f in asked):
            raise
        if choice.option == "specimen":
            return _specimens(path, reading, preview, asked, choice)
        for value in choice.alternatives[:_TRIED]:
            try:
                return _records(path, reading, said(preview, choice, value), (*asked, fault))
            except InputError:
                continue
        raise
    there = set(table.columns)
    if not ({"force", "displacement"} <= there or "capacitance" in there):
        message = f"has neither force over displacement nor capacitance (found {', '.join(sorted(there))})"
        raise InputError(Fault(message, path, advice="Leave it out, or name its columns (see `calib read --help`)"))
    notes = () if asked else tuple(note for note in (sign_note, *table.notes) if note)
    return (Found(table, reading, asked, notes),), ()


def _specimens(
    path: Path, reading: Reading, preview: Reading, asked: tuple[Fault, ...], choice: Choice
) -> tuple[tuple[Found, ...], tuple[str, ...]]:
    """Every specimen of a file that holds several: each is a specimen of the experiment, so that there is nothing to choose."""
    found: list[Found] = []
    left_out: list[str] = []
    faults: list[Fault] = []
    for value in choice.alternatives:
        try:
            records, reasons = _records(path, said(reading, choice, value), said(preview, choice, value), asked)
        except InputError as error:
            faults += error.faults
            left_out.append(f"specimen {value}: {error.faults[0].message}")
        else:
            found += records
            left_out += reasons
    if not found:
        raise InputError(faults)
    return tuple(found), tuple(left_out)


def said(reading: Reading, choice: Choice, value: str) -> Reading:
    """What is said of a file with one more choice made.

    Parameters
    ----------
    reading : what was said before.
    choice : what was open.
    value : one of its alternatives.
    """
    made: Any = int(value) if choice.option == "specimen" else value
    if choice.key:
        made = {**getattr(reading, choice.option), choice.key: value}
    changed: dict[str, Any] = {choice.option: made}
    return replace(reading, **changed)


def _with_copies_noted(looked: list[Looked]) -> list[Looked]:
    """Note of files with the same bytes as an earlier one: a press counted twice makes the result too certain."""
    first: dict[str, Looked] = {}
    noted: list[Looked] = []
    for file in looked:
        if file.records:
            original = first.setdefault(file.records[0].table.sha256, file)
            if original is not file:
                note = f"the same bytes as {original.shown}: if it is a copy, leave it out, or one press is counted twice"
                file = replace(file, records=tuple(replace(r, notes=(note, *r.notes)) for r in file.records), note=note)
        noted.append(file)
    return noted

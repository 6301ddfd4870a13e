"""A folder in, what a page works on in it out: lab files, the experiment, what is said of files, runs; names never lead out.

    FOLDER/experiment.toml       the experiment
    FOLDER/lab/                  lab files that were dropped; those anywhere else in the folder are found, too
    FOLDER/readings.toml         how files are to be read that are in no experiment yet
    FOLDER/NAME/                 a run, as `calib calibrate experiment.toml -o NAME` makes it
    FOLDER/.serve/               of the page itself: its secret, and what its commands have said

Nothing else is kept anywhere: a page that is closed, or a server that is killed, takes nothing along.
"""

from __future__ import annotations

import hashlib
import os
import re
import secrets
import shutil
from collections.abc import AsyncIterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from calib.errors import Fault, InputError
from calib.experiment import LARGEST_TOML, Said, listed, read_said, said_toml, walk, written_by_calib
from calib.files import real_path, remove_leftovers, whole_file, write_text
from calib.regular import bytes_of
from calib.signature import BEGIN
from calib.visible import LONGEST_NAME, character_fault, shortened, visible

#: Bytes of the largest file that may be dropped: ten times the largest export that the readers were tried on.
LARGEST_UPLOAD = 200_000_000

_EXPERIMENT, _SAID, _LAB, _OWN, _REMOVED = "experiment.toml", "readings.toml", "lab", ".serve", ".removed"
# Folders within folders of a dropped file, and the names of runs: what every file system and shell takes as it stands.
_DEEPEST = 4
_RUN_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,59}")
# What Windows or a shell takes for something else.
_NOT_IN_NAMES = re.compile(r'[<>:"|?*\\]')


@dataclass(frozen=True)
class Workspace:
    """The folder that a page works on.

    Attributes
    ----------
    folder : absolute.
    opened : name of the run whose folder was given, with which the page begins; "" for none.
    """

    folder: Path
    opened: str = ""

    @property
    def experiment(self) -> Path:
        """The experiment file, which need not be there."""
        return self.folder / _EXPERIMENT

    @property
    def lab(self) -> Path:
        """Folder of files that were dropped; it need not be there."""
        return self.folder / _LAB

    @property
    def page_folder(self) -> Path:
        """Folder of what the page keeps for itself: how it is reached, jobs, downloads."""
        return self.folder / _OWN

    @property
    def readings(self) -> Path:
        """The file of what is said of lab files that are in no experiment."""
        return self.folder / _SAID

    # --- the experiment ---

    @property
    def text(self) -> str:
        """Text of the experiment file, with LF line ends; "" where there is none.

        Raises
        ------
        InputError
            If it is no text, no file, or too large.
        """
        try:
            content = bytes_of(self.experiment, LARGEST_TOML, "an experiment file")
            return content.decode("utf-8-sig").replace("\r\n", "\n")
        except FileNotFoundError:
            return ""
        except UnicodeDecodeError:
            advice = "Save it as UTF-8 in an editor"
            raise InputError(Fault("is not UTF-8 text", self.experiment, advice=advice)) from None

    def write_experiment(self, text: str) -> None:
        """Write the experiment file, whole or not at all.

        Raises
        ------
        InputError
            If it would be larger than what is read again.
        """
        content = text.replace("\r\n", "\n")
        if len(content.encode()) > LARGEST_TOML:
            advice = "Take out what is not needed; lab files are named in it, and not put into it"
            raise InputError(
                Fault(f"an experiment file has at most {LARGEST_TOML / 1e6:g} MB, and this has more", advice=advice)
            )
        write_text(self.experiment, content)

    # --- lab files ---

    def lab_files(self) -> list[str]:
        """Names of all files that may be lab files, as seen from the folder, with forward slashes."""
        names = []
        for path, reason in walk(self.folder):
            if not reason and path.is_file() and _may_be_data(path):
                names.append(path.relative_to(self.folder).as_posix())
        return names

    def other_files(self) -> list[tuple[str, str]]:
        """Names of files that are no lab files, as seen from the folder, each with what it is; hidden ones are not told."""
        return [
            (path.relative_to(self.folder).as_posix(), reason)
            for path, reason in walk(self.folder)
            if reason and path.is_file() and not path.name.startswith((".", "~$"))
        ]

    def lab_file(self, name: str) -> Path:
        """Path of a lab file by the name that it is listed by.

        Raises
        ------
        InputError
            If none is listed by it.
        """
        path = listed(self.folder, name)
        if path is None or not _may_be_data(path):
            raise InputError(
                Fault(f'there is no lab file "{shortened(name)}" in this folder', advice="Look at the list of files")
            )
        return path

    def remove_lab_file(self, name: str) -> None:
        """Put a lab file out of the way; it stays in a hidden folder."""
        path = self.lab_file(name)
        there = self.folder / _REMOVED / f"{datetime.now():%Y%m%d-%H%M%S}-{secrets.token_hex(2)}"
        there.mkdir(parents=True)
        os.replace(path, there / path.name)
        with suppress(OSError):
            path.parent.rmdir()

    async def receive(self, name: str, chunks: AsyncIterator[bytes]) -> str:
        """Write a file that is dropped, in `lab/`, as it comes; whole or not at all.

        Parameters
        ----------
        name : that it came with: that of a file, or of one in folders, with forward slashes.
        chunks : of its bytes.

        Returns
        -------
        The name that it is listed by.

        Raises
        ------
        InputError
            If the name is none, the file is too large, or another of this name is there.
        """
        path = self.folder / _LAB / Path(*parts_of(name))
        inside = (self.folder / _LAB).absolute()
        within, whole = real_path(inside), real_path(self.folder)
        if not real_path(path.parent).is_relative_to(within) or not within.is_relative_to(whole):
            raise InputError(
                Fault(f'"{shortened(name)}" would lie outside this folder, behind a link', advice="Remove the link")
            )
        path.parent.mkdir(parents=True, exist_ok=True)
        digest, size = hashlib.sha256(), 0
        with whole_file(path.with_name(f".{path.name}.dropped")) as whole, whole.open("wb") as file:
            async for chunk in chunks:
                size += len(chunk)
                if size > LARGEST_UPLOAD:
                    raise InputError(too_large(name))
                digest.update(chunk)
                file.write(chunk)
        dropped = path.with_name(f".{path.name}.dropped")
        try:
            if _is_key(dropped):
                advice = "It belongs into the folder itself, where its owner alone can read it; make it anew if others may have"
                raise InputError(Fault(f'"{shortened(name)}" is a key, which is not dropped on a page', advice=advice))
            if path.exists() and (not path.is_file() or _sha256(path) != digest.hexdigest()):
                advice = "Remove that one first, or rename this one"
                raise InputError(Fault(f'another file "{shortened(name)}" is there already, with other content', advice=advice))
            os.replace(dropped, path)
        finally:
            dropped.unlink(missing_ok=True)
        return path.relative_to(self.folder).as_posix()

    # --- what is said of them ---

    def said(self) -> dict[Path, Said]:
        """What is said of lab files that are in no experiment yet.

        Raises
        ------
        InputError
            If the file that holds it is damaged.
        """
        return read_said(self.readings) if self.readings.is_file() else {}

    def say(self, path: Path, said: Said) -> None:
        """Keep what is said of a lab file; nothing is kept of one of which nothing is said.

        Parameters
        ----------
        path : of the file.
        said : of it.
        """
        kept = {p: s for p, s in {**self.said(), path: said}.items() if s != Said()}
        write_text(self.readings, said_toml(kept, self.folder))

    # --- runs ---

    def runs(self) -> list[str]:
        """Names of the folders of all runs, as seen from the folder, the one begun last first."""
        return [path.relative_to(self.folder).as_posix() for path in sorted(self._holding("run.json"), key=_age)]

    def exports(self) -> list[str]:
        """Names of the folders with tables for a gripper, the one made last first."""
        found = sorted(self._holding("force_tables.json"), key=lambda path: _age(path, "force_tables.json"))
        return [path.relative_to(self.folder).as_posix() for path in found]

    def left_out(self) -> list[str]:
        """Folders that hold a run and are not shown, each with the reason: the page does not go behind links."""
        found = []
        for path in self._folders():
            name = path.relative_to(self.folder).as_posix()
            if (reason := self._why_not_shown(path)) and (path / "run.json").is_file():
                found.append(f"{visible(name)} {reason}")
        return found

    def _holding(self, name: str) -> list[Path]:
        return [path for path in self._folders() if (path / name).is_file() and not self._why_not_shown(path)]

    def _folders(self) -> list[Path]:
        """Folders in this one, and in those, that are not hidden."""
        found: list[Path] = []
        for path in self.folder.glob("*"):
            if not path.name.startswith(".") and path.is_dir():
                found.append(path)
                if not path.is_symlink():
                    found += [below for below in path.glob("*") if not below.name.startswith(".") and below.is_dir()]
        return found

    def _why_not_shown(self, path: Path) -> str:
        """Why a folder is not shown, as the end of a sentence; "" if it is."""
        if path.is_symlink():
            return "is a link: open the page of the folder that it leads to"
        name = path.relative_to(self.folder).as_posix()
        fault = "begins with a dash, as options of commands do" if name.startswith("-") else character_fault(name)
        return f"{fault}: rename it" if fault else ""

    def run(self, name: str) -> Path:
        """Folder of a run by the name that it is listed by, or that of a calibration which has just been begun.

        Raises
        ------
        InputError
            If none is listed by it.
        """
        begun = (
            _RUN_NAME.fullmatch(name) and (self.page_folder / "jobs" / name).is_dir() and not (self.folder / name).is_symlink()
        )
        if begun or name in self.runs():
            return self.folder / name
        raise InputError(Fault(f'there is no run "{shortened(name)}" in this folder', advice="Look at the list of runs"))

    def result(self, name: str, file: str) -> Path:
        """A file of a run, or of tables for a gripper; what is behind a link is none.

        Parameters
        ----------
        name : of the run or of the tables, as it is listed.
        file : in it.

        Raises
        ------
        InputError
            If there is none.
        """
        path = (self.export(name) if name in self.exports() else self.run(name)) / file
        if not path.is_file() or path.is_symlink():
            raise InputError(Fault(f"there is no {shortened(file)} in {name}", advice="Look at the list of its files"))
        return path

    def export(self, name: str) -> Path:
        """Folder of tables for a gripper by the name that it is listed by.

        Raises
        ------
        InputError
            If none is listed by it.
        """
        if name in self.exports():
            return self.folder / name
        raise InputError(Fault(f'there are no tables "{shortened(name)}" in this folder', advice="Look at their list"))

    def new_folder(self, name: str) -> Path:
        """Folder of a run, or of tables, that is to be made.

        Raises
        ------
        InputError
            If the name is none, or taken.
        """
        require_plain(name)
        if name == _LAB:
            raise InputError(Fault(f'"{name}" is the folder of lab files', advice="Choose another name"))
        path = self.folder / name
        if path.exists() or path.is_symlink():
            raise InputError(Fault(f'there is a "{name}" in this folder already', advice="Choose another name"))
        return path

    def free_name(self, begin: str, end: str = "") -> str:
        """A name for a folder or a file that is not taken: the beginning, a number, and the end.

        Parameters
        ----------
        begin, end : of the name.
        """
        return next(name for k in range(1, 10_000) if not os.path.lexists(self.folder / (name := f"{begin}{k}{end}")))

    def tidy(self) -> None:
        """Remove what a killed server left unfinished; for the one that has the folder to itself."""
        shutil.rmtree(self.page_folder / "downloads", ignore_errors=True)
        dropped = self.folder / _LAB
        for path, _, files in () if dropped.is_symlink() else os.walk(dropped):
            for name in files:
                if name.startswith(".") and name.endswith(".dropped"):
                    Path(path, name).unlink(missing_ok=True)
            remove_leftovers(Path(path))


def open_workspace(folder: Path | str) -> Workspace:
    """Open a folder to work in; it is made if it does not exist.

    Parameters
    ----------
    folder : of the work; that of a run stands for the folder around it, and the page begins with that run.

    Raises
    ------
    InputError
        If it is a file, or a folder that cannot be shown.
    """
    path = Path(folder).absolute()
    if fault := character_fault(str(path)):
        raise InputError(Fault(f"its name {fault}", path, advice="Rename it, or the folder that it is in"))
    if path.exists() and not path.is_dir():
        raise InputError(Fault("this is a file, and a folder to work in is wanted", path, advice="Give a folder"))
    opened = ""
    if (path / "run.json").is_file():
        path, opened = path.parent, path.name
    if not path.parent.is_dir():
        raise InputError(Fault(f"the folder {path.parent} does not exist", path, advice="Create it first"))
    path.mkdir(exist_ok=True)
    found = Workspace(path.resolve(), opened)
    found.page_folder.mkdir(mode=0o700, exist_ok=True)
    links = (
        found.page_folder,
        *found.page_folder.glob("*"),
        *found.page_folder.glob("jobs/*"),
        *found.page_folder.glob("jobs/*/*"),
    )
    if link := next((link for link in links if link.is_symlink()), None):
        advice = "Remove the link: what is of the page lies in its folder and nowhere else"
        raise InputError(Fault("this leads elsewhere, where the page would write and remove", link, advice=advice))
    return found


def parts_of(name: str) -> tuple[str, ...]:
    """Parts of the name that a file was dropped with, none of which leads anywhere else or is hidden.

    >>> parts_of("S7.is_comp_RawData/Specimen_RawData_1.csv")
    ('S7.is_comp_RawData', 'Specimen_RawData_1.csv')

    Raises
    ------
    InputError
        If it is no such name.
    """
    parts = tuple(name.split("/"))
    bad = "is no name of a file"
    if not 1 <= len(parts) <= _DEEPEST or any(not part.strip() or part.strip(". ") == "" for part in parts):
        raise InputError(Fault(f'"{shortened(name)}" {bad}', advice="Rename it"))
    for part in parts:
        if reason := _why_not(part):
            raise InputError(Fault(f'"{shortened(name)}" {bad} that can be kept: it {reason}', advice="Rename it"))
    return parts


def _why_not(part: str) -> str:
    """Why a part of a name is not kept, as the end of a sentence; "" if it is."""
    if fault := character_fault(part):
        return fault
    if part.startswith((".", "~$")) or part != part.strip():
        return "is hidden, or begins or ends with a blank"
    if found := _NOT_IN_NAMES.search(part):
        return f"holds the character {found[0]}"
    return f"is longer than {2 * LONGEST_NAME} bytes" if len(part.encode()) > 2 * LONGEST_NAME else ""


def require_plain(name: str) -> None:
    """Refuse a name that not every file system and shell takes as it stands.

    Raises
    ------
    InputError
        If so.
    """
    if not _RUN_NAME.fullmatch(name):
        advice = "Use letters, digits, - and _, such as run1"
        raise InputError(Fault(f'"{shortened(name)}" cannot be a name here', advice=advice))


def too_large(name: str) -> Fault:
    """What is said of a dropped file that is too large."""
    most = f"{LARGEST_UPLOAD / 1e6:.0f} MB"
    advice = "Copy it into the folder yourself if it is a lab file, or export fewer columns"
    return Fault(f'"{shortened(name)}" is larger than {most}, which no lab file is', advice=advice)


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _may_be_data(path: Path) -> bool:
    return path.suffix.lower() != ".toml" and not written_by_calib(path)


def _is_key(path: Path) -> bool:
    """Whether a file is a secret key of minisign's format, as `calib key new` writes it."""
    with path.open("rb") as file:
        first = file.readline(300).removeprefix(b"\xef\xbb\xbf").lstrip()
    return first.startswith(BEGIN.encode()) and b"secret key" in first


def _age(path: Path, name: str = "run.json") -> tuple[float, str]:
    try:
        return -(path / name).stat().st_mtime, path.name
    except OSError:
        return 0.0, path.name

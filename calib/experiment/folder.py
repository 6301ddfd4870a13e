"""A folder in, what lies in it out, at any depth: files that may be lab files, and all else with the reason why it is none."""

from __future__ import annotations

import mimetypes
import os
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

from calib.signature import BEGIN

# What lies in a folder that calib wrote as a whole: a run, and tables for a gripper.
_OF_OWN_FOLDERS = ("run.json", "force_tables.json")


def walk(folder: Path) -> Iterator[tuple[Path, str]]:
    """Files in a folder at any depth, and folders that are not looked into, each with the reason why it is left out, or ""."""
    try:
        entries = sorted(folder.iterdir(), key=lambda p: (p.is_dir(), _in_order(p.name)))
    except OSError as error:
        yield folder, f"{error.strerror}: an unreadable folder"
        return
    for path in entries:
        if not path.is_dir():
            yield path, _why_no_file(path)
        elif reason := _why_not_into(path):
            yield path, reason
        elif _is_empty(path):
            yield path, "an empty folder"
        elif _is_own(path):
            yield path, ""
        else:
            yield from walk(path)


def listed(folder: Path, name: str) -> Path | None:
    """The file that `walk` finds under a name and gives no reason against; None if it finds none.

    Looked for folder by folder, so that one among ten thousand does not take a walk through all of them.

    Parameters
    ----------
    folder : that is walked.
    name : as seen from it, with forward slashes.
    """
    path = folder
    parts = name.split("/")
    try:
        for depth, part in enumerate(parts, 1):
            if part not in os.listdir(path):
                return None
            path = path / part
            if depth < len(parts) and (not path.is_dir() or _why_not_into(path) or _is_own(path)):
                return None
        return path if not path.is_dir() and not _why_no_file(path) else None
    except OSError:
        return None


def _why_not_into(path: Path) -> str:
    """Why a folder is not looked into; "" if it is."""
    if path.is_symlink():
        return "a link to a folder"
    return "a hidden folder" if _is_hidden(path) or path.name == "__pycache__" else ""


def _why_no_file(path: Path) -> str:
    """Why what is no folder is no lab file, as its name tells; "" if it may be one."""
    if not path.is_file():
        return "a broken link" if path.is_symlink() else "no regular file"
    return "a hidden file" if _is_hidden(path) else _name_fault(path) or _kind(path)


def _is_hidden(path: Path) -> bool:
    return path.name.startswith((".", "~$"))


def _is_empty(path: Path) -> bool:
    try:
        return not any(path.iterdir())
    except OSError:
        return False  # it cannot be read, which is said where its files would be


def _is_own(path: Path) -> bool:
    return any((path / name).is_file() for name in _OF_OWN_FOLDERS)


def _in_order(name: str) -> list[tuple[int, int, str]]:
    """Key by which "s2" comes before "s10"."""
    return [(1, int(p), "") if p.isdecimal() else (0, 0, p.casefold()) for p in re.split(r"(\d+)", name)]


def _name_fault(path: Path) -> str:
    try:
        str(path).encode("utf-8")
    except UnicodeEncodeError:
        return "its name is not readable text: rename it"
    return ""


# Kinds that hold no readings, by the first part of their type; others are tried.
_KINDS: Mapping[str, str] = {
    "image": "a picture",
    "video": "a film",
    "audio": "a sound",
    "font": "a font",
    "application/pdf": "a PDF document; export the readings as CSV",
    "application/msword": "a Word document",
    "application/vnd.openxmlformats-officedocument.wordprocessingml.document": "a Word document",
    "application/vnd.openxmlformats-officedocument.presentationml.presentation": "slides",
    "application/vnd.ms-powerpoint": "slides",
    "application/vnd.oasis.opendocument.text": "a text document",
    "application/rtf": "a text document",
    "application/zip": "an archive: unpack it",
    "application/x-tar": "an archive: unpack it",
    "application/x-7z-compressed": "an archive: unpack it",
    "application/vnd.rar": "an archive: unpack it",
    "text/html": "a web page",
    "text/css": "a web page",
    "text/markdown": "notes",
    "text/x-python": "a program",
    "application/x-sh": "a program",
    "application/javascript": "a program",
    "text/javascript": "a program",
    "application/x-msdownload": "a program",
}
_ENDINGS: Mapping[str, str] = {
    ".7z": "an archive: unpack it",
    ".rar": "an archive: unpack it",
    ".md": "notes",
    ".docx": "a Word document",
    ".pptx": "slides",
    ".odt": "a text document",
    ".rtf": "a text document",
    ".webp": "a picture",
    ".heic": "a picture",
    ".ipynb": "a notebook",
    ".m": "a program",
    ".r": "a program",
    ".vi": "a LabVIEW program",
    ".stl": "a drawing",
    ".step": "a drawing",
    ".npz": "an archive of arrays: save them as CSV",
    ".npy": "an array: save it as CSV",
    ".pkl": "a Python object: save its table as CSV",
}


def _kind(path: Path) -> str:
    """What a file is that is known by its ending to hold no table of readings; "" if it may hold one."""
    ending = path.suffix.lower()
    if ending in _ENDINGS:
        return _ENDINGS[ending]
    kind, packed = mimetypes.MimeTypes().guess_type(f"file{ending}")
    if packed is not None:
        return "an archive: unpack it"
    return _KINDS.get(kind or "", _KINDS.get((kind or "").partition("/")[0], ""))


# The first words of tables that calib writes: every row that `calib read -o` understood, and curves of `calib simulate`.
_OWN_TABLE = re.compile(
    rb"(?:(?:time_s|displacement_m|[a-z]+_(?:N|F)),)+.*branch,cycle,used,reason\s|displacement_m,force_N,contact_radius_m,"
)


def written_by_calib(path: Path) -> bool:
    """Whether calib wrote it itself: an experiment file, a run folder, a table of `calib read` or `calib simulate`, a key.

    A key or a signature is known by its first words, of calib or of minisign, under whatever name: nobody is to see its lines.
    """
    if path.is_dir():
        return _is_own(path)
    try:
        if not path.is_file():
            return False
        with path.open("rb") as file:
            start = file.readline(300)
        if start.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(BEGIN.encode()):
            return True
        if path.suffix.lower() != ".toml":
            return _OWN_TABLE.match(start) is not None
        data = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return False
    return "specimens" in data or {"indenter", "sensor"} <= data.keys()

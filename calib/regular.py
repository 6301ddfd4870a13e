"""From the name of a file to its bytes, if it is a file that comes to an end: no folder, pipe or device, and not too large."""

from __future__ import annotations

import difflib
import stat
from pathlib import Path

from calib.errors import Fault, InputError
from calib.visible import character_fault

_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def require_regular(path: Path, advice: str = "Give the name of a file") -> None:
    """Refuse what is no regular file, which reading would wait for or never come to the end of.

    Parameters
    ----------
    path : what is to be read.
    advice : what to do else.

    Raises
    ------
    InputError
        If so.
    OSError
        If it is not there, or cannot be looked at.
    """
    mode = path.stat().st_mode
    if not stat.S_ISREG(mode):
        raise InputError(Fault(f"cannot be read: it is {_KINDS.get(stat.S_IFMT(mode), 'no file')}", path, advice=advice))


def bytes_of(path: Path, most: int, what: str) -> bytes:
    """Read a regular file of limited size.

    Parameters
    ----------
    path : the file.
    most : bytes that it may have.
    what : the noun that it is called in the refusal, such as "an experiment file".

    Raises
    ------
    InputError
        If it is no regular file, or larger.
    OSError
        If it cannot be read.
    """
    require_regular(path)
    with path.open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise InputError(Fault(f"has more than {most / 1e6:g} MB, too many for {what}", path, advice="Choose another file"))
    return data


def names_beside(path: Path) -> str:
    """Advice for a file that is not there: files of its kind in its folder, those spelled most like it first.

    >>> names_beside(Path("no/such/folder/press.csv"))
    'There is no folder no/such/folder'

    Parameters
    ----------
    path : of the file; those that end as it does or in .csv are listed.
    """
    folder = path.parent
    if not folder.is_dir():
        return f"There is no folder {folder}"
    own = path.suffix.lower()
    endings = {own} if own == ".toml" else {".csv", own} - {""}
    kind = " or ".join(ending[1:].upper() for ending in sorted(endings))
    try:
        files = sorted(p.name for p in folder.iterdir() if p.is_file())
    except OSError as error:
        return f"The folder cannot be listed: {error.strerror}"
    names = [name for name in files if Path(name).suffix.lower() in endings]
    if (close := difflib.get_close_matches(path.name, files, n=1, cutoff=0.8)) and close[0] not in names:
        return f"Nearest to that name is {close[0]}"
    if not names:
        return f"There are no {kind} files in that folder"
    likely = difflib.get_close_matches(path.name, names, n=3, cutoff=0.6)
    names = likely + [name for name in names if name not in likely]
    more = f" and {len(names) - 12} more" if len(names) > 12 else ""
    return f"{kind} files in that folder: {', '.join(names[:12])}{more}"


def require_shown(path: Path) -> None:
    """Refuse a file or folder whose name cannot be shown in messages, figures and records.

    Raises
    ------
    InputError
        If so; with the character.
    """
    if fault := character_fault(str(path.absolute())):
        raise InputError(Fault(f"its name {fault}", path, advice="Rename it, or the folder that it is in"))

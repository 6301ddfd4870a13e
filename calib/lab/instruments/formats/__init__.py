"""The formats that are no plain text: a file put into this folder is found, none is listed anywhere.

A file holds one `FORMAT`, a `Format` that tells by the first bytes whether a file is of it.
"""

from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from calib.lab.instruments.part import Format

# As much as is needed to tell the formats apart.
_HEAD = 4096


def discover(folders: Iterable[str], package: str) -> tuple[Format, ...]:
    """The formats that stand in the files of a package, by name.

    Parameters
    ----------
    folders : where the package's files lie, its `__path__`.
    package : its name.
    """
    found = (import_module(f"{package}.{module.name}").FORMAT for module in iter_modules(folders))
    return tuple(sorted(found, key=lambda one: one.name))


#: All that there are.
FORMATS = discover(__path__, __name__)


def format_of(path: Path) -> Format | None:
    """Tell the format of a file by its first bytes; None if it is to be read as text, or cannot be opened."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError:
        return None
    return next((one for one in FORMATS if one.recognise(head, path)), None)

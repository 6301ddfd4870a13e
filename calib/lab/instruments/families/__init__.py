"""The instrument families that lab files are recognised as: a file put into this folder is found, none is listed anywhere.

A file holds one `FAMILY`, an `InstrumentFamily` that declares its own place in the order in which families are asked.
"""

from collections.abc import Iterable
from importlib import import_module
from pkgutil import iter_modules

from calib.lab.instruments.family import InstrumentFamily


def discover(folders: Iterable[str], package: str) -> tuple[InstrumentFamily, ...]:
    """The families that stand in the files of a package, in the order in which they are asked.

    Parameters
    ----------
    folders : where the package's files lie, its `__path__`.
    package : its name.
    """
    found = (import_module(f"{package}.{module.name}").FAMILY for module in iter_modules(folders))
    return tuple(sorted(found, key=lambda family: (family.priority, family.name)))


#: In the order in which they are asked; the last recognises everything with a header.
FAMILIES = discover(__path__, __name__)

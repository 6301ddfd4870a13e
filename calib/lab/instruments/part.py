"""What a file that is no plain text is taken apart into: a `Part` per sheet, group or variable, and its `Format`."""

from __future__ import annotations

import io
import logging
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path

from calib.errors import Fault, InputError
from calib.lab.instruments.text import LabText

#: How the libraries are installed that some formats need.
INSTALL = 'pip install "dielectric-elastomer-calibration[formats]"'

# A cell of a sheet: its row from 1 and its column from 0.
Cell = tuple[int, int]
#: What is advised at the end of the reason why a channel of another length than its time is no table.
EXPORT_ALIKE = "export all alike"


@dataclass(frozen=True, eq=False)
class CellTypes:
    """What the types of a sheet's cells say beyond their text, each by cell (row from 1, column from 0).

    Attributes
    ----------
    texts : cells of text that look like numbers with a mark or a blank in them, as written.
    dates : cells that are dates or times, with their number format.
    shown : numbers that the sheet shows otherwise than they are stored (in per cent, in thousands, with a unit): the format.
    errors : cells that hold an error instead of a value, such as "#DIV/0!".
    uncalculated : formulas without a stored result.
    formulas : formulas with one; their text, "" where the format does not give it.
    """

    texts: Mapping[Cell, str] = field(default_factory=dict)
    dates: Mapping[Cell, str] = field(default_factory=dict)
    shown: Mapping[Cell, str] = field(default_factory=dict)
    errors: Mapping[Cell, str] = field(default_factory=dict)
    uncalculated: Mapping[Cell, str] = field(default_factory=dict)
    formulas: Mapping[Cell, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Part:
    """One table of a file that may hold several.

    Attributes
    ----------
    kind, name : such as "sheet" and "Data"; the name is what the user says to choose it.
    text : its cells as lines of text; None where it holds no table.
    reason : why it holds none, "" if it does.
    hidden : whether the file hides it from who opens it.
    types : what its cells are; empty where every number is one.
    notes : what is to be known of it, one sentence each.
    above : lines of the text above its first row, where the file has none: row 1 is then line `above` + 1 of the text.
    """

    kind: str
    name: str
    text: LabText | None
    reason: str = ""
    hidden: bool = False
    types: CellTypes = field(default_factory=CellTypes)
    notes: tuple[str, ...] = ()
    above: int = 0

    @property
    def title(self) -> str:
        """Kind and name, as it is called in messages."""
        return f'{"hidden " if self.hidden else ""}{self.kind} "{self.name}"'


@dataclass(frozen=True)
class Format:
    """A kind of file that is not read as plain text.

    Each stands as `FORMAT` in a file of its own in `calib.lab.instruments.formats`, where it is found without being listed.

    Attributes
    ----------
    name : for people, such as "Excel workbook (.xlsx)".
    recognise : the first bytes of a file (4,096, or all) and its path -> whether it is of this format. No two formats may
        recognise the same file.
    take_apart : a file -> its parts, in their order; refuses what cannot be read.
    """

    name: str
    recognise: Callable[[bytes, Path], bool]
    take_apart: Callable[[Path], tuple[Part, ...]]


def not_installed(path: Path, what: str) -> InputError:
    """Make the refusal of a format whose library is not installed.

    Parameters
    ----------
    path : the file.
    what : the format and the library, such as "workbooks (.xlsx) are read with openpyxl".
    """
    return InputError(Fault(f"{what}, which is not installed", path, advice=f"Install it: {INSTALL}; or export a CSV file"))


@contextmanager
def damaged(path: Path, what: str) -> Iterator[None]:
    """Turn whatever a library raises on a damaged file into the refusal of that file, and hide what it prints.

    Parameters
    ----------
    path : the file.
    what : its format, such as "workbook".

    Raises
    ------
    InputError
        With what was raised.
    """
    logged = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings(), redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except OSError as error:
        message = f"the {what} cannot be read: {error.strerror or error}"
        raise InputError(Fault(message, path, advice="Save it again, or export a CSV file")) from None
    except Exception as error:  # each library has its own, and raises those of Python on damaged bytes
        said = " ".join(str(error).split())[:120]
        message = f"the {what} is damaged or cut short ({type(error).__name__}{': ' + said if said else ''})"
        raise InputError(Fault(message, path, advice="Save it again, or export a CSV file")) from None
    finally:
        logging.disable(logged)

"""What every reader gives, `LabTable` (one lab file as columns in SI), and what a reader is, `Family`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from models.sensor import FloatArray

if TYPE_CHECKING:
    from calib.instruments.sheet import Sheet

IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LabTable:
    """One lab file as columns in SI, nothing turned, zeroed or repaired.

    Attributes
    ----------
    path, sha256 : the file and the hash of its bytes.
    recognised_as : the family that read it, such as "Instron Bluehill raw data", "LCR log", "table with a header".
    reason : why it was recognised as that.
    encoding, delimiter, decimal : how the text was read; `decimal` is the decimal mark.
    columns : canonical name -> SI values of shape (n_row,); nan where the cell was empty or a sentinel. Names: time [s],
        displacement [m], force [N], capacitance [F] (parallel equivalent), dissipation [1], frequency [Hz], cycle [1].
        The signs are the file's.
    sources : canonical name -> the column as written in the file, such as "Compressive load (N)".
    lines : line in the file of each row, 1-based, shape (n_row,).
    reasons : per row "" or why the row is not usable, such as "LCR status 1" or "over-range 9.9E37".
    notes : choices made while reading, one sentence each.
    """

    path: Path
    sha256: str
    recognised_as: str
    reason: str
    encoding: str
    delimiter: str
    decimal: str
    columns: Mapping[str, FloatArray]
    sources: Mapping[str, str]
    lines: IntArray
    reasons: tuple[str, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Family:
    """A family of instruments: its name, how it knows its files, how it reads them.

    Attributes
    ----------
    name : as it stands in `LabTable.recognised_as`.
    recognise : a sheet -> the reason why it belongs to the family, "" if it does not.
    read : a sheet and that reason -> the table; raises `calib.errors.InputError` with all faults of the file.
    """

    name: str
    recognise: Callable[[Sheet], str]
    read: Callable[[Sheet, str], LabTable]

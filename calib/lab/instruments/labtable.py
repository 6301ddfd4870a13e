"""What reading a lab file gives (`LabTable`: columns in SI), and what may be said of the file beforehand (`Reading`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import numpy as np
import numpy.typing as npt

from models.sensor import FloatArray

IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Reading:
    """What the user says of a file that the file does not say, or says wrongly.

    Attributes
    ----------
    units : quantity -> unit, such as {"force": "kN"}; used instead of what the file says.
    columns : quantity -> header cell as written, or the number of the column from 1, such as {"force": "Load 2"}.
    specimen : which of several specimens in the file, from 1; None if the file is expected to hold one.
    where : column -> value, such as {"Frequency (Hz)": "1000"}: only rows that hold these values are read, as if the
        file held no others.
    sheet : which sheet of a workbook, group of a TDMS file or variable of a MAT file; "" if there is one that fits.
    sign : quantity (force, displacement) -> "compression positive" or "compression negative", where the file leaves it open.
    scale : "micro" for instruments of nanometres and micronewtons, whose readings are implausibly small otherwise; else "".
    decimal : the decimal mark, "." or ",", where the file leaves it open; else "".
    """

    units: Mapping[str, str] = field(default_factory=dict)
    columns: Mapping[str, str] = field(default_factory=dict)
    specimen: int | None = None
    where: Mapping[str, str] = field(default_factory=dict)
    sheet: str = ""
    sign: Mapping[str, str] = field(default_factory=dict)
    scale: str = ""
    decimal: str = ""


#: What is said of a file of which nothing is said.
AS_FOUND = Reading()


@dataclass(frozen=True)
class Unread:
    """A part of a lab file that is not used: what it is, such as `column 4 "T (°C)"` or `lines 1 to 7`, and why."""

    what: str
    reason: str

    def __str__(self) -> str:
        return f"{self.what}: {self.reason}"


@dataclass(frozen=True, eq=False)
class LabTable:
    """One lab file as columns in SI, nothing turned, zeroed or repaired.

    Attributes
    ----------
    path, sha256 : the file and the hash of its bytes.
    recognised_as : the family that read it, such as "Instron Bluehill raw data", "LCR log", "table with a header".
    reason : why it was recognised as that.
    encoding, delimiter, decimal : how the text was read; `delimiter` is a blank for runs of blanks, `decimal` the decimal mark.
    columns : canonical name -> SI values of shape (n_row,); nan where the cell was empty or a sentinel. Names: time [s],
        displacement [m], force [N], capacitance [F] (parallel equivalent), dissipation [1], frequency [Hz], cycle [1].
        The signs are the file's.
    sources : canonical name -> the column as written in the file, such as "Compressive load (N)".
    lines : line in the file of each row, 1-based, shape (n_row,).
    reasons : per row "" or why the row is not usable, such as "LCR status 1" or "over-range 9.9E37".
    notes : choices made while reading, one sentence each.
    unread : every column, line and block of the file that is not used, with the reason.
    started : date and time at which the record began, as the file states it; None if it does not.
    sign : what was said of the signs, see `Reading.sign`.
    zeroed : quantity -> rows from 0 from which on its readings have another zero than above.
    conventions : quantity -> 1 or -1, the sign of compression by a line beside the table, and that in words.
    written : "force", "capacitance" -> the readings in the unit of the file, (n_row,); of a series capacitance that was
        converted, as they were: what the steps of the instrument are seen in.
    stages : columns that are not read and have a few values, such as "Phase" -> the cells of each row.
    told_rows : how many rows the record has in the file, and a line beside it says, where these are more; else None.
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
    unread: tuple[Unread, ...] = ()
    started: datetime | None = None
    sign: Mapping[str, str] = field(default_factory=dict)
    zeroed: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    conventions: Mapping[str, tuple[int, str]] = field(default_factory=dict)
    written: Mapping[str, FloatArray] = field(default_factory=dict)
    stages: Mapping[str, Sequence[str]] = field(default_factory=dict)
    told_rows: tuple[int, int] | None = None

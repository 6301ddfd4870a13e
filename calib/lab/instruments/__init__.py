"""Lab files in, a `LabTable` of columns in SI out; knows instruments, and nothing of presses, branches or sensors."""

from calib.lab.instruments.brackets import says_sense
from calib.lab.instruments.families import FAMILIES
from calib.lab.instruments.family import InstrumentFamily
from calib.lab.instruments.labtable import AS_FOUND, IntArray, LabTable, Reading, Unread
from calib.lab.instruments.reader import QUANTITIES, no_such_quantity, read_lab_file
from calib.lab.instruments.rounded import rounded_rows
from calib.lab.instruments.sheet import SeveralSpecimens
from calib.lab.instruments.units import is_unit_of

__all__ = [
    "AS_FOUND",
    "FAMILIES",
    "QUANTITIES",
    "InstrumentFamily",
    "IntArray",
    "LabTable",
    "Reading",
    "SeveralSpecimens",
    "Unread",
    "is_unit_of",
    "no_such_quantity",
    "read_lab_file",
    "rounded_rows",
    "says_sense",
]

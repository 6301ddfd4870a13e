"""Records of lab files in, which hold the same readings out, whatever their files are called and however they were cut."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from itertools import chain
from typing import TypeVar

import numpy as np

from calib.errors import InputError
from calib.experiment.lab_files import Found, look_through
from calib.experiment.plan import Experiment
from calib.lab import SAME, Sweep, rows_of, share_in_both
from models.sensor import IntArray

_Name = TypeVar("_Name", bound=Hashable)

# Of which readings are compared; that of time and displacement is the same wherever a machine keeps its pace.
_COMPARED = ("force", "capacitance")


def readings_in(records: Sequence[Found]) -> tuple[IntArray, ...]:
    """What stands for the readings of some records, by `calib.lab.rows_of`, an array for each column that is compared.

    Parameters
    ----------
    records : of one specimen.
    """
    columns = (record.table.columns for record in records)
    return tuple(rows_of(of[name]) for of in columns for name in _COMPARED if name in of)


def readings_of_sweeps(experiment: Experiment, sweeps: Sequence[Sweep]) -> dict[str, tuple[IntArray, ...]]:
    """The same of every specimen whose lab files still lie where they were read, with the bytes that were read.

    Parameters
    ----------
    experiment, sweeps : whose files they are.
    """
    of_run = {sha256: sweep.specimen for sweep in sweeps for _, sha256 in sweep.files}
    if not of_run:
        return {}
    entries = [entry for specimen in experiment.specimens for entry in specimen.sweeps]
    paths = {path for entry in entries for path in (entry.force, entry.capacitance) if path is not None and path.is_file()}
    found: dict[str, list[Found]] = {}
    try:
        looked = look_through(sorted(paths))[0] if paths else []
    except (InputError, OSError):
        return {}
    for record in chain.from_iterable(file.records for file in looked):
        if record.table.sha256 in of_run:
            found.setdefault(of_run[record.table.sha256], []).append(record)
    return {specimen: readings_in(records) for specimen, records in found.items()}


def held_twice(readings: Mapping[_Name, Sequence[IntArray]]) -> Iterator[tuple[_Name, _Name]]:
    """Pairs of specimens with the same readings, in the order in which the mapping has them.

    Parameters
    ----------
    readings : name of a specimen -> from `readings_in`.
    """
    owners = [(name, rows) for name, several in readings.items() for rows in several if rows.size]
    if len(owners) < 2:
        return
    every = np.concatenate([rows for _, rows in owners])
    owner = np.repeat(np.arange(len(owners)), [rows.size for _, rows in owners])
    order = np.argsort(every, kind="stable")
    again = np.flatnonzero(np.diff(every[order]) == 0)
    met = np.unique(np.column_stack([owner[order[again]], owner[order[again + 1]]]), axis=0)
    place = {name: k for k, name in enumerate(readings)}
    found = set()
    for k, j in met.tolist():
        (one, rows), (other, others) = owners[k], owners[j]
        if one != other and share_in_both(rows, others) >= SAME:
            found.add((min(place[one], place[other]), max(place[one], place[other])))
    names = list(readings)
    yield from ((names[one], names[other]) for one, other in sorted(found))

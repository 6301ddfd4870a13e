"""Records of lab files in, which hold the same readings out, whatever their files are called and however they were cut."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TypeVar

import numpy as np

from calib.errors import InputError
from calib.experiment.lab_files import Found, look_through
from calib.experiment.plan import Experiment
from calib.lab import SAME, Sweep, rows_of, share_in_both, thinned_rows_of
from models.sensor import FloatArray, IntArray

_Name = TypeVar("_Name", bound=Hashable)

# Of which readings are compared; that of time and displacement is the same wherever a machine keeps its pace.
_COMPARED = ("force", "capacitance")
# Of what copies of records of more readings than this may hold a few rows are kept: there are nine times as many as readings.
_LONG = 20_000


@dataclass(frozen=True, eq=False)
class Held:
    """What stands for the readings of a column, by `calib.lab.rows_of`.

    Attributes
    ----------
    rows, few : of the readings as they are, all and a few.
    thinned : of copies of them that were thinned out; of a long record a few.
    long : whether it is one.
    """

    rows: IntArray
    few: IntArray
    thinned: IntArray
    long: bool

    def same_as(self, other: Held) -> bool:
        """Whether one of two columns has half of the other's readings, or the other half of those that are left of it."""
        return share_in_both(self.rows, other.rows) >= SAME or self._has_thinned(other) or other._has_thinned(self)

    def _has_thinned(self, other: Held) -> bool:
        return share_in_both(self.thinned, other.few if self.long else other.rows) >= SAME


def readings_in(records: Sequence[Found]) -> tuple[Held, ...]:
    """What stands for the readings of some records, for each column that is compared.

    Parameters
    ----------
    records : of one specimen.
    """
    columns = (record.table.columns[name] for record in records for name in _COMPARED if name in record.table.columns)
    return tuple(map(_held, columns))


def _held(column: FloatArray) -> Held:
    long = column.size > _LONG
    return Held(rows_of(column), rows_of(column, few=True), thinned_rows_of(column, few=long), long)


def readings_of_sweeps(experiment: Experiment, sweeps: Sequence[Sweep]) -> dict[str, tuple[Held, ...]]:
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


def held_twice(readings: Mapping[_Name, Sequence[Held]]) -> Iterator[tuple[_Name, _Name]]:
    """Pairs of specimens with the same readings, in the order in which the mapping has them.

    Parameters
    ----------
    readings : name of a specimen -> from `readings_in`.
    """
    owners = [(name, held) for name, several in readings.items() for held in several if held.rows.size]
    if len(owners) < 2:
        return
    parts = [np.union1d(held.rows, held.thinned) for _, held in owners]
    every = np.concatenate(parts)
    owner = np.repeat(np.arange(len(owners)), [part.size for part in parts])
    order = np.argsort(every, kind="stable")
    again = np.flatnonzero(np.diff(every[order]) == 0)
    met = np.unique(np.column_stack([owner[order[again]], owner[order[again + 1]]]), axis=0)
    place = {name: k for k, name in enumerate(readings)}
    found = set()
    for k, j in met.tolist():
        (one, held), (other, others) = owners[k], owners[j]
        if one != other and held.same_as(others):
            found.add((min(place[one], place[other]), max(place[one], place[other])))
    names = list(readings)
    yield from ((names[one], names[other]) for one, other in sorted(found))

"""A file that finite-element runs land in one by one, and from which a stopped training campaign goes on."""

from __future__ import annotations

import io
import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from models.sensor import FloatArray

_FORMAT = 2


class StoreError(ValueError):
    """A file that cannot serve as the store asked for, and why."""


@dataclass(frozen=True, eq=False)
class RunStore:
    """Runs by the point they are at. Every `add` is one transaction: what was added survives a kill, and nothing half does.

    One process writes at a time; the workers of a campaign hand their results to it.
    """

    connection: sqlite3.Connection

    def __contains__(self, point: FloatArray) -> bool:
        """Whether the run at `point` has been made."""
        return self.connection.execute("select 1 from runs where point = ?", (_key(point),)).fetchone() is not None

    def find(self, point: FloatArray) -> tuple[dict[str, FloatArray], str] | None:
        """Arrays of the run at `point` and why it ended early (empty if it did not), or None if it has not been made."""
        row = self.connection.execute("select arrays, failure from runs where point = ?", (_key(point),)).fetchone()
        return None if row is None else (_arrays(row[0]), str(row[1]))

    def runs(self) -> Iterator[tuple[FloatArray, dict[str, FloatArray], str]]:
        """Every run: its point, its arrays, and why it ended early."""
        for point, arrays, failure in self.connection.execute("select point, arrays, failure from runs"):
            yield np.frombuffer(point, dtype="<f8"), _arrays(arrays), str(failure)

    def add(self, point: FloatArray, arrays: Mapping[str, FloatArray], failure: str = "") -> None:
        """Keep a run; what was there at its point before is replaced.

        Parameters
        ----------
        point : groups that the run is at.
        arrays : its results, by name.
        failure : why it ended early; empty if it did not.
        """
        blob = io.BytesIO()
        np.savez(blob, **dict(arrays))  # type: ignore[arg-type]  # an array by the name of an option is not among them
        with self.connection:
            self.connection.execute("insert or replace into runs values (?, ?, ?)", (_key(point), blob.getvalue(), failure))

    def __len__(self) -> int:
        """Number of runs, failed ones included."""
        return int(self.connection.execute("select count(*) from runs").fetchone()[0])


def _arrays(blob: bytes) -> dict[str, FloatArray]:
    with np.load(io.BytesIO(blob), allow_pickle=False) as data:
        return {name: data[name] for name in data.files}


def _key(point: FloatArray) -> bytes:
    return np.ascontiguousarray(point, dtype="<f8").tobytes()


@contextmanager
def open_store(path: Path, settings: Mapping[str, object]) -> Iterator[RunStore]:
    """Open the file of a campaign, or begin it.

    Parameters
    ----------
    path : of the file.
    settings : what its runs have in common and others do not: accuracy, depths, ...

    Yields
    ------
    The store.

    Raises
    ------
    StoreError
        If the file is not such a store, was begun with other settings (named), or is being written by another process.
    """
    wanted = json.loads(json.dumps({"format": _FORMAT, **settings}))
    connection = sqlite3.connect(path, timeout=5.0)
    try:
        try:
            with connection:
                connection.execute("create table if not exists settings (text text not null)")
                connection.execute(
                    "create table if not exists runs (point blob primary key, arrays blob not null, failure text not null)"
                )
                row = connection.execute("select text from settings").fetchone()
                if row is None:
                    connection.execute("insert into settings values (?)", (json.dumps(wanted),))
        except sqlite3.OperationalError as error:
            raise StoreError(f"cannot be written: {error}") from None
        except sqlite3.DatabaseError:
            raise StoreError("is not a store of finite-element runs") from None
        begun = json.loads(row[0]) if row is not None else wanted
        if begun != wanted:
            differ = [k for k in sorted({*begun, *wanted}) if begun.get(k) != wanted.get(k)]
            told = ", ".join(f"{k} is {begun.get(k)} there and {wanted.get(k)} here" for k in differ)
            raise StoreError(f"holds runs of other settings: {told}")
        yield RunStore(connection)
    finally:
        connection.close()

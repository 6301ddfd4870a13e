"""A file that finite-element runs land in one by one, and from which a stopped training campaign goes on."""

from __future__ import annotations

import io
import json
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from models.sensor import FloatArray

# Raised whenever rows mean something else than before.
_FORMAT = 5

_TABLES = (
    "create table if not exists settings (text text not null)",
    "create table if not exists runs "
    "(point blob primary key, arrays blob not null, failure text not null, sha256 text not null)",
)
_ROWS = "select point, arrays, failure, sha256 from runs"

_FOREIGN = "is not a store of finite-element runs"
_COPY = "put a copy of it back, if there is one"


class StoreError(ValueError):
    """A file that cannot serve as the store asked for, why, and what to do about it."""


@dataclass(frozen=True, eq=False)
class RunStore:
    """Runs by the point they are at. Every `add` is one transaction: what was added survives a kill, and nothing half does.

    One process writes at a time; the workers of a campaign hand their results to it. What the database cannot do, such as write
    to a full disk, is a `StoreError`.
    """

    connection: sqlite3.Connection

    def __contains__(self, point: FloatArray) -> bool:
        """Whether the run at `point` has been made."""
        return bool(self._select("select 1 from runs where point = ?", _key(point)))

    def find(self, point: FloatArray) -> tuple[dict[str, FloatArray], str] | None:
        """Arrays of the run at `point` and why it ended early (empty if it did not), or None if it has not been made."""
        found = self._select(f"{_ROWS} where point = ?", _key(point))
        return _run(*found[0])[1:] if found else None

    def runs(self) -> Iterator[tuple[FloatArray, dict[str, FloatArray], str]]:
        """Every run: its point, its arrays, and why it ended early."""
        with _as_store_errors():
            for row in self.connection.execute(_ROWS):
                yield _run(*row)

    def add(self, point: FloatArray, arrays: Mapping[str, FloatArray], failure: str = "") -> None:
        """Keep a run; what was there at its point before is replaced.

        Parameters
        ----------
        point : groups that the run is at.
        arrays : its results, by name.
        failure : why it ended early; empty if it did not.
        """
        blob, named = io.BytesIO(), dict[str, Any](arrays)
        np.savez(blob, **named)
        row = (_key(point), blob.getvalue(), failure)
        with _as_store_errors(), self.connection:
            self.connection.execute("insert or replace into runs values (?, ?, ?, ?)", (*row, _digest(*row)))

    def __len__(self) -> int:
        """Number of runs, failed ones included."""
        return int(self._select("select count(*) from runs")[0][0])

    def _select(self, query: str, *values: bytes) -> list[Any]:
        with _as_store_errors():
            return self.connection.execute(query, values).fetchall()


def _run(point: bytes, arrays: bytes, failure: str, digest: str) -> tuple[FloatArray, dict[str, FloatArray], str]:
    """A row as a run, if it is to the last byte what `add` was given."""
    if digest != _digest(point, arrays, failure):
        raise StoreError(f"is damaged: a run in it is not as it was written; {_COPY}")
    with np.load(io.BytesIO(arrays), allow_pickle=False) as data:
        return np.frombuffer(point, dtype="<f8"), {name: data[name] for name in data.files}, failure


def _digest(*row: object) -> str:
    """Checksum of a row's values and of what they are."""
    return sha256(ascii(row).encode()).hexdigest()


def _key(point: FloatArray) -> bytes:
    return np.ascontiguousarray(point, dtype="<f8").tobytes()


@contextmanager
def _as_store_errors() -> Iterator[None]:
    """Say what the database cannot do as a `StoreError`."""
    try:
        yield
    except sqlite3.OperationalError as error:
        raise StoreError(f"cannot be read or written ({error}); what it held before is kept") from None
    except sqlite3.DatabaseError as error:
        if error.sqlite_errorcode == sqlite3.SQLITE_NOTADB:
            raise StoreError(_FOREIGN) from None
        raise StoreError(f"is damaged ({error}); {_COPY}") from None


@contextmanager
def open_store(path: Path, settings: Mapping[str, object]) -> Iterator[RunStore]:
    """Open the file of a campaign and check all of it, or begin it.

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
        If the file is not such a store, is damaged, was begun with other settings (named), or is being written by another
        process.
    """
    wanted = json.loads(json.dumps({"format": _FORMAT, **settings}))
    new = not path.exists() or path.stat().st_size == 0
    with _as_store_errors():
        connection = sqlite3.connect(path, timeout=5.0)
    with closing(connection):
        store = RunStore(connection)
        with _as_store_errors():
            if new:
                _begin(connection, wanted)
            _check(connection, wanted)
            for _ in store.runs():
                pass  # reading checks them
        yield store


def _begin(connection: sqlite3.Connection, wanted: Mapping[str, object]) -> None:
    """Make the tables, all or none."""
    connection.execute("begin immediate")
    with connection:
        for table in _TABLES:
            connection.execute(table)
        if connection.execute("select text from settings").fetchone() is None:
            connection.execute("insert into settings values (?)", (json.dumps(wanted),))


def _check(connection: sqlite3.Connection, wanted: Mapping[str, object]) -> None:
    """Refuse what is no store, is damaged, cannot be written, or holds runs of other settings than those `wanted`.

    SQLite itself takes a damaged table for one with fewer rows.
    """
    tables = {name for (name,) in connection.execute("select name from sqlite_master where type = 'table'")}
    if not {"settings", "runs"} <= tables:
        raise StoreError(_FOREIGN)
    if (found := connection.execute("pragma integrity_check(1)").fetchone()[0]) != "ok":
        raise StoreError(f"is damaged ({found.splitlines()[-1]}); {_COPY}")
    connection.execute("begin immediate")
    connection.rollback()
    try:
        (text,) = connection.execute("select text from settings").fetchone()
        begun = dict(json.loads(text))
    except (TypeError, ValueError, RecursionError):
        raise StoreError(f"is damaged: it does not say what its runs are of; {_COPY}") from None
    if begun != wanted:
        differ = [k for k in sorted({*begun, *wanted}) if begun.get(k) != wanted.get(k)]
        told = ", ".join(f"{k} is {begun.get(k)} there and {wanted.get(k)} here" for k in differ)
        raise StoreError(f"holds runs of other settings: {told}")

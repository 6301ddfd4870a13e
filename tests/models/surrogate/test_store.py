"""The file of a training campaign, damaged, foreign, or where nothing can be written."""

from __future__ import annotations

import random
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from models.surrogate.store import StoreError, open_store

SETTINGS = {"accuracy": 1e-3, "path": [0.1, 1.0]}
POINTS = np.random.default_rng(1).random((30, 5))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("store") / "runs.sqlite"
    rng = np.random.default_rng(2)
    with open_store(path, SETTINGS) as store:
        for k, point in enumerate(POINTS):
            store.add(point, {"force": rng.random(20), "capacitance": rng.random((20, 6))}, "stuck" if k % 4 == 0 else "")
    return path


def content(path: Path) -> list[tuple[bytes, dict[str, bytes], str]]:
    with open_store(path, SETTINGS) as store:
        runs = [(point.tobytes(), {k: v.tobytes() for k, v in arrays.items()}, why) for point, arrays, why in store.runs()]
    return sorted(runs, key=lambda run: run[0])


def test_a_damaged_store_is_refused_or_holds_what_it_held(whole: Path, tmp_path: Path) -> None:
    data, path, rng = whole.read_bytes(), tmp_path / "runs.sqlite", random.Random(1)
    held, n_refused = content(whole), 0

    def flipped(at: int) -> bytes:
        return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]

    def zeroed(at: int) -> bytes:
        return data[:at] + bytes(min(500, len(data) - at)) + data[at + 500 :]

    def doubled(at: int) -> bytes:
        return data[: at + 4096] + data[at:]

    hows: tuple[Callable[[int], bytes], ...] = (flipped, zeroed, doubled, lambda at: data[: at + 1])
    for k in range(160):
        at = rng.randrange(len(data)) if k % 3 else rng.randrange(300)
        path.write_bytes(hows[k % len(hows)](at))
        for left in tmp_path.glob("runs.sqlite-*"):
            left.unlink()
        try:
            found = content(path)
        except StoreError:
            n_refused += 1
            continue
        assert found == held
    assert n_refused > 80


@pytest.mark.parametrize(
    "change",
    [
        "update runs set failure = 'stock' where failure = 'stuck'",
        "update runs set failure = x'' where failure = ''",
        "update runs set arrays = substr(arrays, 1, 100)",
        "update runs set point = zeroblob(40) where failure = 'stuck' and rowid = 1",
        "update runs set sha256 = ''",
        "delete from settings",
        "update settings set text = '[1]'",
        "update settings set text = '{'",
    ],
)
def test_rows_that_are_not_as_they_were_written_are_refused(whole: Path, tmp_path: Path, change: str) -> None:
    path = tmp_path / "runs.sqlite"
    path.write_bytes(whole.read_bytes())
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(change)
    with pytest.raises(StoreError, match=r"is damaged.*put a copy of it back"), open_store(path, SETTINGS):
        pass


def test_foreign_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.sqlite"
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("create table bookmarks (url text)")
    before = path.read_bytes()
    with pytest.raises(StoreError, match="is not a store"), open_store(path, SETTINGS):
        pass
    assert path.read_bytes() == before
    with pytest.raises(StoreError, match="cannot be read or written"), open_store(tmp_path, SETTINGS):
        pass


def test_a_store_of_an_older_layout_is_refused_in_a_sentence(tmp_path: Path) -> None:
    path = tmp_path / "runs.sqlite"
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("create table settings (text text not null)")
        connection.execute("create table runs (point blob primary key, arrays blob not null, failure text not null)")
        connection.execute("""insert into settings values ('{"format": 2, "accuracy": 0.001, "path": [0.1, 1.0]}')""")
    with pytest.raises(StoreError, match="format is 2 there and 5 here"), open_store(path, SETTINGS):
        pass


def test_an_empty_file_is_a_store_that_was_not_begun(tmp_path: Path) -> None:
    # What a kill leaves between making the file and its first transaction.
    path = tmp_path / "runs.sqlite"
    path.touch()
    with open_store(path, SETTINGS) as store:
        assert len(store) == 0


def test_a_full_disk_is_told_and_leaves_what_was_there(whole: Path, tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    path = tmp_path / "runs.sqlite"
    path.write_bytes(whole.read_bytes())
    held = content(path)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    with open_store(path, SETTINGS) as store:
        resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size, limits[1]))
        try:
            with pytest.raises(StoreError, match=r"cannot be read or written .*what it held before is kept"):
                store.add(np.zeros(5), {"force": np.zeros(100_000)})
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert content(path) == held

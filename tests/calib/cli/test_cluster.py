"""A Dask cluster does the work of a training; one that cannot is a sentence within seconds, and what came in is kept."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import as_completed
from copy import deepcopy
from functools import partial
from pathlib import Path
from typing import Any

import distributed
import pytest
from typer.testing import CliRunner

from calib.cli import app
from calib.cli.cluster import _require_same_versions, dask_executor
from calib.errors import InputError


@pytest.fixture
def cluster() -> Iterator[Any]:
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None, host="127.0.0.1", protocol="tcp://"
    ) as made:
        yield made


@pytest.fixture
def silent() -> Iterator[str]:
    """Something that takes a connection and never says a word, as a program that is no scheduler may."""
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen(5)
        yield f"tcp://127.0.0.1:{listening.getsockname()[1]}"


def _refusal(address: str) -> str:
    begin = time.monotonic()
    with pytest.raises(InputError) as caught, dask_executor(address, patience=0.5):
        raise AssertionError("there is no cluster")
    assert time.monotonic() - begin < 15
    (fault,) = caught.value.faults
    return str(fault)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense://x", "no address", "", "tls://127.0.0.1:1"])
def test_where_no_scheduler_is_that_is_said(address: str) -> None:
    assert _refusal(address).startswith(f"--scheduler: no Dask scheduler answers at {address} (")


def test_what_listens_and_says_nothing_is_not_waited_for(silent: str) -> None:
    assert "says nothing within 0.5 s" in _refusal(silent)


ENDING = """
import sys
from calib.cli.cluster import dask_executor
from calib.errors import InputError
try:
    with dask_executor(sys.argv[1], patience=0.5):
        pass
except InputError:
    print("refused")
"""


@pytest.mark.parametrize("address", ["nonsense", "tls://127.0.0.1:1", "silent"])
def test_a_program_that_reached_no_scheduler_ends_at_once_and_silently(silent: str, address: str) -> None:
    words = [sys.executable, "-c", ENDING, silent if address == "silent" else address]
    run = subprocess.run(words, capture_output=True, text=True, timeout=60, check=True)
    assert (run.stdout, run.stderr) == ("refused\n", "")


def test_the_command_ends_with_2_and_leaves_no_file(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["surrogate", "train", "-o", str(tmp_path / "mine.npz"), "--scheduler", "nonsense://x"])
    assert result.exit_code == 2
    assert "no Dask scheduler answers at nonsense://x" in " ".join(result.stderr.split())
    assert not list(tmp_path.iterdir())


def test_a_cluster_computes(cluster: Any) -> None:
    with dask_executor(cluster.scheduler_address) as executor:
        assert list(executor.map(abs, [-1, 2, -3])) == [1, 2, 3]


def test_a_fault_of_the_work_itself_is_not_taken_for_one_of_the_cluster(cluster: Any) -> None:
    with pytest.raises(ZeroDivisionError), dask_executor(cluster.scheduler_address) as executor:
        executor.submit(divmod, 1, 0).result()


def test_a_cluster_that_is_lost_is_a_sentence_and_what_came_in_is_there(cluster: Any) -> None:
    kept: list[None] = []

    def work() -> None:
        with dask_executor(cluster.scheduler_address) as executor:
            pieces = [executor.submit(partial(time.sleep, 0.05 + i * 1e-4)) for i in range(200)]
            for piece in as_completed(pieces, timeout=600):
                kept.append(piece.result())
                if len(kept) == 3:
                    cluster.close(timeout=5)

    with pytest.raises(InputError, match=r"was lost .*the same command goes on"):
        work()
    assert 3 <= len(kept) < 200


# --- versions -----------------------------------------------------------------------------------------------------------


class Client:
    """Stands in for a client, with the versions that a cluster would tell."""

    def __init__(self, found: dict[str, Any], own: object) -> None:
        self.found, self.own = found, own

    def get_versions(self) -> dict[str, Any]:
        return self.found

    def run(self, *_: object, **__: object) -> dict[str, object]:
        return dict.fromkeys(self.found["workers"], self.own)


SAME = {"python": "3.11.7.final.0", "dask": "2026.8.0", "distributed": "2026.8.0", "numpy": "2.4.6"}


def _client(own: object = "0.1.0", **at: dict[str, str]) -> Client:
    found = {
        "client": {"packages": SAME},
        "scheduler": {"packages": SAME | at.get("scheduler", {})},
        "workers": {"tcp://1": {"packages": SAME}, "tcp://2": {"packages": SAME | at.get("worker", {})}},
    }
    return Client(deepcopy(found), own)


@pytest.mark.parametrize(
    ("client", "said"),
    [
        (_client(scheduler={"python": "3.12.1.final.0"}), "the scheduler has Python 3.12, this computer has 3.11"),
        (_client(worker={"dask": "2024.1.0"}), "the worker tcp://2 has dask 2024.1.0, this computer has 2026.8.0"),
        (_client(worker={"numpy": "1.26.0"}), "the worker tcp://2 has numpy 1.26.0"),
        (_client(own="9.9"), "the worker tcp://1 has dielectric-elastomer-calibration 9.9"),
        (_client(own=ModuleNotFoundError("calib")), "the worker tcp://1 has dielectric-elastomer-calibration none"),
    ],
)
def test_other_versions_are_refused_by_name(client: Client, said: str) -> None:
    with pytest.raises(InputError) as caught:
        _require_same_versions(client, "tcp://0")
    assert said in str(caught.value)
    assert "Install the same version" in str(caught.value)


def test_a_patch_of_python_may_differ() -> None:
    _require_same_versions(_client(worker={"python": "3.11.9.final.0"}, own=_own()), "tcp://0")


def _own() -> str:
    from importlib.metadata import version

    return version("dielectric-elastomer-calibration")

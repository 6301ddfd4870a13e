"""Processes or the address of a Dask scheduler in, an executor out; a cluster that cannot do the work is a sentence."""

from __future__ import annotations

import gc
import logging
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Annotated, Any

import typer

from calib.cli.common import err
from calib.errors import Fault, InputError
from calib.provenance import PROGRAM
from calib.workers import workers

#: How long a scheduler may take to answer [s].
PATIENCE = 5.0

_GOES_ON = "What came in is kept; the same command goes on with it"


Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help='Address of a Dask scheduler to run on, e.g. "tls://node1:8786" (with the extra `cluster`). Whoever answers '
        "there can run code on this computer.",
    ),
]


@contextmanager
def executor_of(processes: int | None, scheduler: str | None) -> Iterator[Executor]:
    """Run work on processes of this machine, or on the workers of a Dask cluster.

    Parameters
    ----------
    processes : how many; the number of processors if None.
    scheduler : address of the cluster's scheduler, see `dask_executor`; None for this machine.

    Yields
    ------
    The executor.

    Raises
    ------
    InputError
        As `dask_executor`.
    """
    with workers(processes) if scheduler is None else dask_executor(scheduler) as executor:
        yield executor


@contextmanager
def dask_executor(address: str, patience: float = PATIENCE) -> Iterator[Executor]:
    """Run work on the workers of a Dask cluster.

    Client, scheduler and workers send each other Python objects, by which each can run code on the others; how they are sure of
    each other (TLS) is set in Dask's own configuration.

    Parameters
    ----------
    address : of the scheduler, such as "tls://node1:8786".
    patience : how long it may take to answer [s].

    Yields
    ------
    The executor.

    Raises
    ------
    InputError
        If Dask is not installed, no scheduler answers there, versions do not agree, or the cluster is lost in between.
    """
    try:
        distributed: Any = import_module("distributed")
    except ImportError:
        advice = f'Install it with: pip install "{PROGRAM}[cluster]"'
        raise InputError(Fault("--scheduler needs the extra `cluster`, which is not installed", advice=advice)) from None
    # What it logs of a lost connection, with its traceback, is said in a sentence.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    client = _connected(distributed, address, patience)
    try:
        _require_same_versions(client, address)
        yield client.get_executor()
    except (CancelledError, distributed.CancelledError, distributed.comm.CommClosedError) as error:
        message = f"--scheduler: the Dask scheduler at {address} was lost ({str(error) or 'it ended'})"
        raise InputError(Fault(message, advice=_GOES_ON)) from None
    except distributed.KilledWorker as error:
        message = f"--scheduler: workers of {address} ended again and again ({error})"
        raise InputError(Fault(message, advice=_GOES_ON)) from None
    finally:
        client.close(timeout=2)


def _connected(distributed: Any, address: str, patience: float) -> Any:
    """Connect in a thread beside: what accepts a connection and never says a word would keep Dask waiting for ever."""
    answer: SimpleQueue[Any] = SimpleQueue()

    def connect() -> None:
        try:
            found = distributed.Client(address, timeout=patience, set_as_default=False)
        except Exception as error:  # whatever answers there, or the address itself, raises errors of any kind
            found = (str(error) or type(error).__name__).splitlines()[0]
        # What an error leaves half connected is closed now: as the program ends nothing answers it any more.
        gc.collect()
        answer.put(found)

    Thread(target=connect, daemon=True).start()
    try:
        found = answer.get(timeout=patience + 2)
    except Empty:
        found = f"what listens there says nothing within {patience:g} s"
    if not isinstance(found, str):
        return found
    advice = "Start one with: dask scheduler, and its workers with: dask worker ADDRESS"
    raise InputError(Fault(f"--scheduler: no Dask scheduler answers at {address} ({found})", advice=advice))


def _require_same_versions(client: Any, address: str) -> None:
    """Refuse a cluster with another Python, Dask or edition of this package: it would misread what is sent, or err."""
    found = client.get_versions()
    workers = {name: there["packages"] for name, there in found["workers"].items()}
    if not workers:
        err().print(f"Waiting for workers: {address} has none yet.", markup=False)
    here = _of_interest(found["client"]["packages"])
    for name, packages in {"the scheduler": found["scheduler"]["packages"], **workers}.items():
        for what, there in _of_interest(packages).items():
            if there != here[what]:
                who = name if name == "the scheduler" else f"the worker {name}"
                message = f"--scheduler: {who} has {what} {there}, this computer has {here[what]}"
                raise InputError(Fault(message, advice="Install the same versions on all of them"))
    try:
        own = version(PROGRAM)
    except PackageNotFoundError:
        return
    for name, there in client.run(version, PROGRAM, on_error="return").items():
        if there != own:
            got = "none" if isinstance(there, Exception) else there
            message = f"--scheduler: the worker {name} has {PROGRAM} {got}, this computer has {own}"
            raise InputError(Fault(message, advice="Install the same version on all of them"))


def _of_interest(packages: dict[str, str]) -> dict[str, str]:
    python = ".".join(str(packages["python"]).split(".")[:2])
    return {
        "Python": python,
        **{name: packages[name] for name in ("dask", "distributed", "cloudpickle", "numpy") if name in packages},
    }

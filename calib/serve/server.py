"""A folder in, its page served on this machine until it is told to stop; what it is worth is in the folder all the time."""

from __future__ import annotations

import os
import secrets
import socket
import stat
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import uvicorn

from calib.errors import Fault, InputError
from calib.files import whole_file
from calib.records import record_from_text, record_to_text
from calib.runs import owned, owner_of
from calib.serve.app import app_of
from calib.serve.connection import Patient
from calib.serve.keys import Keys
from calib.serve.security import Door
from calib.serve.workspace import Workspace

#: Where a page is that has no other place yet.
PORT = 8311
# Ports that are tried after it.
_TRIED = 20
# Kind and format of what is kept of the door.
_RECORD = "door", 1


def serve(space: Workspace, port: int | None, ready: Callable[[Door], None], keys: Keys | None = None) -> None:
    """Serve the page of a folder on loopback until the process is told to stop.

    The secret and the port are kept in the folder, for its owner's eyes alone, so that a page that is open goes on when its
    server is begun again.

    Parameters
    ----------
    space : the folder.
    port : to listen on; None for that of last time, or the first that is free.
    ready : told who is let in, once it listens.
    keys : that certificates may be signed with; None for those that lie in the folder.

    Raises
    ------
    InputError
        If another process serves this folder, or the port is taken.
    """
    known = _known(space.page_folder / "door.json")
    if said := owner_of(space.page_folder):
        advice = "Stop it with Ctrl-C in its terminal" if known is None else f"Open {known.address}"
        raise InputError(Fault(f"the page of this folder is served already, by {said}", space.folder, advice=advice))
    with owned(space.page_folder, "calib serve"):
        space.tidy()
        listening = _listening(port, None if known is None else known.port)
        with listening:
            token = secrets.token_urlsafe(32) if known is None else known.token
            door = Door(token, listening.getsockname()[1], secrets.token_urlsafe(32))
            _keep(space.page_folder / "door.json", door)
            config = uvicorn.Config(
                app_of(space, door, keys),
                http=Patient,
                log_level="error",
                access_log=False,
                server_header=False,
                ws="none",
                lifespan="off",
            )
            _warm_up()
            listening.listen()  # so that who is told of it finds it
            ready(door)
            uvicorn.Server(config).run(sockets=[listening])


def _warm_up() -> None:
    """Load what pages need, so that the first of them does not wait for it."""
    for module in ("calib.report", "calib.runs", "calib.checks", "calib.decision"):
        package = import_module(module)
        for name in getattr(package, "__all__", ()):
            getattr(package, name)


def _listening(port: int | None, before: int | None) -> socket.socket:
    """A socket on loopback."""
    wanted = [port] if port is not None else [*([before] if before else []), *range(PORT, PORT + _TRIED), 0]
    for number in wanted:
        found = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        if os.name == "posix":
            found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            found.bind(("127.0.0.1", number))
        except OSError as error:
            found.close()
            if port is not None:
                advice = "Leave --port out, or give another"
                raise InputError(Fault(f"port {port} cannot be had: {error.strerror}", advice=advice)) from None
            continue
        return found
    raise InputError(Fault("no port of this machine is free", advice="Close other programs"))


def _known(path: Path) -> Door | None:
    """What was kept of last time; None unless only its owner, who is this user, could have written and read it."""
    try:
        about = path.lstat()
        if not stat.S_ISREG(about.st_mode) or (os.name == "posix" and (about.st_uid != os.getuid() or about.st_mode & 0o077)):
            return None
        found = record_from_text(*_RECORD, path.read_text(encoding="utf-8"))
        token, port = found["token"], found["port"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    sound = isinstance(token, str) and len(token) >= 40 and isinstance(port, int) and 0 < port < 65536
    return Door(token, port) if sound else None


def _keep(path: Path, door: Door) -> None:
    with whole_file(path) as whole:
        whole.chmod(0o600)
        whole.write_text(record_to_text(*_RECORD, {"token": door.token, "port": door.port}), encoding="utf-8")

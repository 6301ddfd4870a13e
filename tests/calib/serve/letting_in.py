"""The page of a folder as a browser that was let in sees it, without a network."""

from __future__ import annotations

from typing import NamedTuple

from starlette.testclient import TestClient

from calib.serve import Door, Keys, Workspace, app_of

HOST = "http://127.0.0.1:8311"
DOOR = Door("s" * 43, 8311)
SAYS = {"Origin": HOST}
SCRIPT = {**SAYS, "Accept": "application/json"}


def let_in(space: Workspace, keys: Keys | None = None) -> TestClient:
    """A browser that has opened the address of the terminal."""
    client = TestClient(app_of(space, DOOR, keys), base_url=HOST, headers=SAYS, raise_server_exceptions=False)
    assert client.get(f"/?token={DOOR.token}").status_code == 200
    return client


class Work(NamedTuple):
    """A page and the folder that it works on."""

    page: TestClient
    space: Workspace

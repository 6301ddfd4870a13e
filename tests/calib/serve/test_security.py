"""The page answers its own browser and nobody else, and no name leads out of its folder."""

from __future__ import annotations

import asyncio
import os
import socket
import stat
import subprocess
import sys
import threading
from collections.abc import AsyncIterator, Iterator, MutableMapping
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import uvicorn
from letting_in import DOOR, HOST
from small_lab import write_lab
from starlette.testclient import TestClient

from calib.errors import InputError
from calib.runs import owned
from calib.serve import Door, Workspace, app_of, open_workspace
from calib.serve import server as serving
from calib.serve.connection import Patient
from calib.serve.page import LARGEST_FORM
from calib.serve.workspace import LARGEST_UPLOAD, parts_of

PAGES = (
    "/",
    "/files",
    "/files/row?name=lab/press.csv",
    "/file?name=lab/press.csv",
    "/file/picture.png?name=lab/press.csv",
    "/experiment",
    "/experiment/state",
    "/check",
    "/check/found",
    "/check/light",
    "/calibrate",
    "/calibrate/command?name=a",
    "/calibrate/resumed?name=a",
    "/run?name=a",
    "/run/progress?name=a",
    "/run/found?name=a",
    "/run/verified?name=a",
    "/run/file?name=a&file=run.json",
    "/run/bundle.zip?name=a",
    "/report?name=a",
    "/report/page?name=a",
    "/padding",
    "/padding/look?name=a",
    "/padding/view?name=a",
    "/runs",
    "/runs/difference?first=a&second=b",
    "/runs/difference/command?first=a&second=b",
    "/runs/average/command?run=a&run=b&name=c",
    "/runs/curves.png?first=a&second=b",
    "/files/add?name=lab/press.csv",
    "/certificate?name=a",
    "/certificate/look?name=a",
    "/certificate/command?name=a",
    "/certificate/page?name=a",
    "/export?name=a",
    "/export/look?name=a",
    "/export/command?name=a",
    "/export/file?name=a&file=README.md",
    "/export/bundle.zip?name=a",
    "/next?name=a",
    "/next/found?name=a",
    "/next/command?name=a",
    "/static/serve.js",
)
CHANGES = (
    ("POST", "/file/correct"),
    ("POST", "/file/remove"),
    ("PUT", "/files/upload?name=x.csv"),
    ("POST", "/files/draft"),
    ("POST", "/experiment/put"),
    ("POST", "/experiment/decide"),
    ("POST", "/files/use"),
    ("POST", "/files/example"),
    ("POST", "/experiment/write"),
    ("POST", "/calibrate/begin"),
    ("POST", "/calibrate/resume"),
    ("POST", "/calibrate/cancel"),
    ("POST", "/padding/advise"),
    ("POST", "/runs/average"),
    ("POST", "/files/add/put"),
    ("POST", "/experiment/instrument"),
    ("POST", "/certificate/issue"),
    ("POST", "/certificate/key"),
    ("POST", "/export/make"),
    ("POST", "/next/ask"),
    ("POST", "/next/draft"),
)


@pytest.fixture
def space(tmp_path: Path) -> Workspace:
    """A folder with a lab file and its experiment."""
    return open_workspace(write_lab(tmp_path / "work"))


@pytest.fixture
def stranger(space: Workspace) -> TestClient:
    """A browser that was not let in."""
    return TestClient(app_of(space, DOOR), base_url=HOST, raise_server_exceptions=False)


@pytest.fixture
def page(stranger: TestClient) -> TestClient:
    """The same, let in."""
    stranger.get(f"/?token={DOOR.token}")
    return stranger


def everything(folder: Path) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_every_route_is_tried_here(space: Workspace) -> None:
    routes = {getattr(route, "path", "") for route in app_of(space, DOOR).routes}
    tried = {path.split("?")[0] for path in (*PAGES, *(path for _, path in CHANGES))}
    assert {route.replace("{name}", "serve.js") for route in routes} == tried


def test_without_the_secret_nothing_is_answered(stranger: TestClient, space: Workspace) -> None:
    before = everything(space.folder)
    for path in PAGES:
        assert stranger.get(path).status_code == 403, path
    for method, path in CHANGES:
        assert stranger.request(method, path, headers={"Origin": HOST}).status_code == 403, path
    stranger.cookies.set(DOOR.cookie, "another")
    assert stranger.get("/files").status_code == 403
    assert stranger.get("/?token=another").status_code == 403
    assert stranger.get("/?token=%ff%00").status_code == 403
    assert everything(space.folder) == before


def test_the_secret_is_kept_where_no_script_and_no_other_page_can_take_it(stranger: TestClient) -> None:
    said = stranger.get(f"/?token={DOOR.token}").headers["set-cookie"]
    assert "HttpOnly" in said
    assert "samesite=strict" in said.lower()
    assert stranger.get("/files").status_code == 200


def test_a_secret_for_once_lets_in_once(space: Workspace) -> None:
    app = app_of(space, Door("s" * 43, 8311, "o" * 43))
    first, second = (TestClient(app, base_url=HOST) for _ in range(2))
    assert first.get(f"/?token={'o' * 43}").status_code == 200
    assert first.get("/files").status_code == 200
    assert second.get(f"/?token={'o' * 43}").status_code == 403
    assert second.get("/?token=").status_code == 403
    assert second.get("/files").status_code == 403


@pytest.mark.parametrize("host", ["attacker.example", "attacker.example:8311", "127.0.0.1", "127.0.0.1:80", "0.0.0.0:8311", ""])
def test_another_name_for_this_machine_is_refused(page: TestClient, host: str) -> None:
    assert page.get("/files", headers={"Host": host}).status_code == 403


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Origin": "null"},
        {"Origin": "http://attacker.example"},
        {"Origin": "https://127.0.0.1:8311"},
        {"Origin": "http://127.0.0.1:8312"},
        {"Origin": "http://localhost:8311"},
        {"Sec-Fetch-Site": "cross-site"},
        {"Sec-Fetch-Site": "same-site"},
    ],
)
def test_a_change_that_another_page_asks_for_is_refused(page: TestClient, space: Workspace, headers: dict[str, str]) -> None:
    before = everything(space.folder)
    for method, path in CHANGES:
        assert page.request(method, path, headers=headers).status_code == 403, path
    assert everything(space.folder) == before


def test_what_another_page_shows_or_links_to_is_not_answered(page: TestClient, stranger: TestClient) -> None:
    for site in ("cross-site", "same-site"):  # another port of this machine is the same site, and gets the cookie sent along
        for path in ("/files", "/run/bundle.zip?name=a", "/certificate/page?name=a"):
            assert page.get(path, headers={"Sec-Fetch-Site": site}).status_code == 403, path
    assert stranger.get(f"/?token={DOOR.token}", headers={"Sec-Fetch-Site": "cross-site"}).status_code == 200  # a link to it
    assert page.get("/files", headers={"Sec-Fetch-Site": "none"}).status_code == 200


@pytest.mark.parametrize("other", ['{"a": 1}', "a b, c", 'x="', f"1; {DOOR.cookie}=forged", "é", "; ;=;"])
def test_cookies_that_others_of_this_machine_have_left_keep_nobody_out(stranger: TestClient, other: str) -> None:
    own = f"{DOOR.cookie}={DOOR.token}"
    for header in (f"{own}; other={other}", f"other={other}; {own}"):
        assert stranger.get("/files", headers=[(b"Cookie", header.encode())]).status_code == 200, header
    assert stranger.get("/files", headers=[(b"Cookie", f"other={other}".encode())]).status_code == 403


def test_a_browser_names_no_port_80(space: Workspace) -> None:
    host = "http://127.0.0.1"
    page = TestClient(app_of(space, Door("s" * 43, 80)), base_url=host, raise_server_exceptions=False)
    assert page.get(f"/?token={DOOR.token}").status_code == 200
    assert page.get("/files").status_code == 200
    assert page.post("/experiment/instrument", data={"kind": "ball"}, headers={"Origin": host}).status_code == 200


def test_no_change_is_made_by_a_link(page: TestClient) -> None:
    for _, path in CHANGES:
        assert page.get(path).status_code == 405, path


def test_an_answer_loads_nothing_from_elsewhere_and_is_in_no_frame_of_another(page: TestClient) -> None:
    for path in PAGES:
        headers = page.get(path).headers
        assert "default-src 'none'" in headers["content-security-policy"], path
        assert "frame-ancestors 'self'" in headers["content-security-policy"], path
        assert headers["x-content-type-options"] == "nosniff", path
        assert headers["cache-control"] == "no-store", path
        assert "access-control-allow-origin" not in headers, path
    text = page.get("/files").text + page.get("/static/serve.js").text + page.get("/static/serve.css").text
    assert "https://" not in text
    assert [line for line in text.split("\n") if "http://" in line and "www.w3.org/2000/svg" not in line] == []


OUT = (
    "../secret.csv",
    "..\\secret.csv",
    "/etc/passwd",
    "lab/../../secret.csv",
    "%2e%2e/secret.csv",
    "lab/press.csv/../../../x",
    "\x00",
    "a" * 5000,
)


@pytest.mark.parametrize("name", OUT)
def test_no_name_leads_out_of_the_folder(page: TestClient, space: Workspace, tmp_path: Path, name: str) -> None:
    (tmp_path / "secret.csv").write_text("Displacement (mm),Force (N)\n0,0\n")
    before = everything(tmp_path)
    own = {"Origin": HOST}
    pages = ["/files/row", "/file", "/file/picture.png", "/files/add", "/run", "/run/progress", "/run/found", "/report"]
    pages += ["/report/page", "/certificate", "/certificate/look", "/certificate/page", "/export", "/export/look", "/next"]
    for path in (*pages, "/next/found", "/export/file", "/export/bundle.zip"):
        assert page.get(path, params={"name": name}).status_code == 422, path
    for path in ("/run/file", "/run/bundle.zip", "/padding/view", "/padding/look", "/run/verified"):
        assert page.get(path, params={"name": name, "file": "../run.json"}).status_code == 422, path
    for path in (
        "/file/correct",
        "/file/remove",
        "/calibrate/begin",
        "/calibrate/resume",
        "/calibrate/cancel",
        "/padding/advise",
        "/files/add/put",
        "/certificate/issue",
        "/certificate/key",
        "/export/make",
        "/next/ask",
        "/next/draft",
    ):
        assert page.post(path, data={"name": name}, headers=own).status_code == 422, path
    assert page.post("/runs/average", data={"run": ["a", name], "name": name}, headers=own).status_code == 422
    assert everything(tmp_path) == before
    for path in ("/static/../app.py", "/static/%2e%2e/app.py", "/static/..%2fapp.py", "/static/serve.py"):
        assert page.get(path).status_code == 404


@pytest.mark.parametrize(
    "name",
    [
        "../x.csv",
        "a/../x.csv",
        "/x.csv",
        "a//x.csv",
        "..",
        ".",
        "",
        " ",
        ".hidden",
        "a/.git/x",
        "~$x.xlsx",
        "C:\\x.csv",
        "a\\x.csv",
        "x\n.csv",
        "x\x1b[31m.csv",
        "x\u202evsc.csv",
        "x.csv ",
        "a/b/c/d/e.csv",
        "x" * 300,
        "con|x",
        "\ud800.csv",
    ],
)
def test_a_dropped_file_with_such_a_name_is_refused(name: str) -> None:
    with pytest.raises(InputError):
        parts_of(name)


def test_a_dropped_file_goes_through_no_link(page: TestClient, space: Workspace, tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (space.folder / "lab" / "link").symlink_to(tmp_path / "elsewhere")
    answer = page.put("/files/upload?name=link/x.csv", content=b"x", headers={"Origin": HOST})
    assert answer.status_code == 422
    assert list((tmp_path / "elsewhere").iterdir()) == []


def test_nothing_behind_a_link_is_taken_for_a_run_or_for_the_page_s_own(
    page: TestClient, space: Workspace, tmp_path: Path
) -> None:
    elsewhere = tmp_path / "elsewhere"
    (elsewhere / "downloads").mkdir(parents=True)
    (elsewhere / "downloads" / "precious").touch()
    for name in ("run.json", "report.html", "posterior.nc"):
        (elsewhere / name).write_text("{}")
    (space.folder / "linked").symlink_to(elsewhere)
    shown = page.get("/runs").text
    assert "linked is a link" in shown
    for path in ("/run", "/run/found", "/report/page", "/run/bundle.zip", "/run/file", "/certificate"):
        assert page.get(path, params={"name": "linked", "file": "report.html"}).status_code == 422, path
    (space.folder / "own").mkdir()
    (space.folder / "own" / "run.json").write_text("{}")
    (space.folder / "own" / "report.html").symlink_to(elsewhere / "report.html")
    for path in ("/report/page", "/run/file"):
        assert page.get(path, params={"name": "own", "file": "report.html"}).status_code == 422, path
    other = tmp_path / "other"
    other.mkdir()
    (other / ".serve").symlink_to(elsewhere)
    with pytest.raises(InputError, match="leads elsewhere"):
        open_workspace(other)
    assert (elsewhere / "downloads" / "precious").exists()


def test_a_run_whose_name_cannot_be_shown_does_not_keep_the_others_away(page: TestClient, space: Workspace) -> None:
    for name in ("x\u202ey", "x\ny", os.fsdecode(b"x\xff"), "<b> \"'", "--x $(id)"):
        (space.folder / name).mkdir()
        (space.folder / name / "run.json").write_text("{}")
    for path in ("/runs", "/calibrate", "/padding", "/files"):
        assert page.get(path).status_code == 200, path
    shown = page.get("/runs").text
    assert "x\\u202ey holds the character" in shown
    assert "\u202e" not in shown
    assert "<b>" not in shown
    assert "--x $(id) begins with a dash" in shown
    assert space.runs() == ["<b> \"'"]


def test_of_a_thousand_files_a_page_lists_five_hundred(page: TestClient, space: Workspace) -> None:
    for k in range(1012):
        (space.folder / "lab" / f"f{k}.csv").write_text("x")
    first, second, last = (page.get(f"/files?from={k}").text for k in ("x", "500", "1000"))
    assert [text.count("data-load=") for text in (first, second, last)] == [500, 500, 13]
    assert "Files 501 to 1000 of 1013" in second
    assert "from=1000" in second
    assert "The next ones" not in last
    assert page.get("/files?from=99999999").text.count("data-load=") == 0


def test_a_connection_on_which_nothing_is_asked_is_closed(space: Workspace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("calib.serve.connection.PATIENCE", 0.3)
    server = uvicorn.Server(uvicorn.Config(app_of(space, DOOR), http=Patient, log_level="error", ws="none", lifespan="off"))
    with serving._listening(None, None) as listening:
        listening.listen()
        address = listening.getsockname()
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
        thread.start()
        try:
            with closing(socket.create_connection(address)) as silent, closing(socket.create_connection(address)) as half:
                half.sendall(b"GET /files HTTP/1.1\r\nHost: x\r\nX-")
                for held in (silent, half):
                    held.settimeout(20)
                    assert held.recv(100) == b""
        finally:
            server.should_exit = True
            thread.join()


def test_who_has_gone_before_all_was_said_is_no_defect(space: Workspace) -> None:
    sent: list[int] = []

    async def left() -> None:
        async def receive() -> dict[str, object]:
            return {"type": "http.disconnect"}

        async def send(message: MutableMapping[str, Any]) -> None:
            sent.append(message.get("status", 0))

        said = {"host": HOST.removeprefix("http://"), "origin": HOST, "cookie": f"{DOOR.cookie}={DOOR.token}"}
        headers = [(name.encode(), value.encode()) for name, value in said.items()]
        scope = {"type": "http", "method": "POST", "path": "/experiment/put", "query_string": b"", "headers": headers}
        await app_of(space, DOOR)(scope, receive, send)

    asyncio.run(left())
    assert sent[0] == 400


def test_a_file_of_a_gigabyte_is_refused_before_it_comes(page: TestClient, space: Workspace) -> None:
    headers = {"Origin": HOST, "Content-Length": "1000000000", "Accept": "application/json"}
    answer = page.put("/files/upload?name=x.csv", content=b"x", headers=headers)
    assert answer.status_code == 413
    assert answer.json()["faults"]
    assert not (space.folder / "lab" / "x.csv").exists()


def test_a_file_that_does_not_say_how_large_it_is_ends_at_the_limit(
    page: TestClient, space: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("calib.serve.pages.files.LARGEST_UPLOAD", 1_000_000)

    def endless() -> Iterator[bytes]:
        for _ in range(40):
            yield b"x" * 50_000

    answer = page.put("/files/upload?name=x.csv", content=endless(), headers={"Origin": HOST, "Accept": "application/json"})
    assert answer.status_code == 413
    assert [path.name for path in (space.folder / "lab").iterdir()] == ["press.csv"]
    assert LARGEST_UPLOAD <= 1_000_000_000


def test_nothing_is_left_of_a_file_that_breaks_off(space: Workspace) -> None:
    async def broken() -> AsyncIterator[bytes]:
        yield b"x"
        raise ConnectionError

    with pytest.raises(ConnectionError):
        asyncio.run(space.receive("x.csv", broken()))
    assert [path.name for path in (space.folder / "lab").iterdir()] == ["press.csv"]


def test_a_form_that_is_too_large_or_none_is_refused(page: TestClient) -> None:
    own = {"Origin": HOST, "Accept": "application/json"}
    assert page.post("/experiment/write", content=b"text=" + b"x" * LARGEST_FORM, headers=own).status_code == 413
    assert page.post("/experiment/write", content=b"\xff\xfe", headers=own).status_code == 422
    assert page.post("/experiment/write", content=b"no form", headers=own).status_code == 422
    assert page.post("/experiment/write", content=b"&".join([b"a=1"] * 3000), headers=own).status_code == 422


def test_names_of_files_are_shown_and_run_nothing(page: TestClient, space: Workspace) -> None:
    name = "<img src=x onerror=alert(1)>.csv" if os.name == "posix" else "&amp;.csv"
    (space.folder / "lab" / name).write_bytes((space.folder / "lab" / "press.csv").read_bytes())
    shown = page.get("/files").text + page.get("/file", params={"name": f"lab/{name}"}).text
    assert "<img src=x" not in shown
    assert "onerror" in shown


def test_the_secret_lies_in_the_folder_for_its_owner_alone(tmp_path: Path) -> None:
    path = tmp_path / "door.json"
    serving._keep(path, DOOR)
    assert serving._known(path) == DOOR
    if os.name == "posix":
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
        path.chmod(0o644)  # as it comes out of an archive that somebody else has packed
        assert serving._known(path) is None
        path.chmod(0o600)
    serving._keep(path, replace(DOOR, token="short"))
    assert serving._known(path) is None
    serving._keep(path, DOOR)
    path.write_text(path.read_text().replace('"format": 1', '"format": 2'))
    assert serving._known(path) is None


def test_the_page_listens_on_this_machine_alone() -> None:
    with serving._listening(None, None) as listening:
        assert listening.getsockname()[0] == "127.0.0.1"
        listening.listen()
        with pytest.raises(InputError, match="cannot be had"):
            serving._listening(listening.getsockname()[1], None)


def test_without_the_extra_the_command_says_what_to_install(tmp_path: Path) -> None:
    code = (
        "import importlib.util as u, sys; real = u.find_spec\n"
        "u.find_spec = lambda name, *a: None if name == 'starlette' else real(name, *a)\n"
        f"sys.argv = ['calib', 'serve', {str(tmp_path / 'new')!r}]\n"
        "from calib.__main__ import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 2
    assert 'pip install "dielectric-elastomer-calibration[serve]"' in done.stderr
    assert not (tmp_path / "new").exists()


def test_a_second_server_of_a_folder_leads_to_the_first(space: Workspace) -> None:
    serving._keep(space.page_folder / "door.json", DOOR)
    with owned(space.page_folder, "calib serve"), pytest.raises(InputError, match=f"served already, by process.*{DOOR.token}"):
        serving.serve(space, None, lambda _: None)

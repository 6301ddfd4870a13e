"""The page answers its own browser and nobody else, and no name leads out of its folder."""

from __future__ import annotations

import asyncio
import os
import stat
import subprocess
import sys
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
from letting_in import DOOR, HOST
from small_lab import write_lab
from starlette.testclient import TestClient

from calib.errors import InputError
from calib.runs import owned
from calib.serve import Door, Workspace, app_of, open_workspace
from calib.serve import server as serving
from calib.serve.page import LARGEST_FORM
from calib.serve.workspace import LARGEST_UPLOAD, parts_of

PAGES = (
    "/",
    "/files",
    "/files/row?name=lab/press.csv",
    "/file?name=lab/press.csv",
    "/file/picture.png?name=lab/press.csv",
    "/experiment",
    "/experiment/fields",
    "/experiment/state",
    "/check",
    "/check/found",
    "/check/light",
    "/calibrate",
    "/calibrate/command?name=a",
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
    ("POST", "/experiment/mean-it"),
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
    path.write_text('{"token": "short", "port": 80}')
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
    serving._keep(space.own / "door.json", DOOR)
    with owned(space.own, "calib serve"), pytest.raises(InputError, match=f"served already, by process.*{DOOR.token}"):
        serving.serve(space, None, lambda _: None)

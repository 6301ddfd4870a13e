"""The print of a report: by a browser that is there, refused in words without one, and gone with the page it is of."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

from calib.cli import app
from calib.decision import Requirement
from calib.report import BROWSERS, PrintError, find_browser, print_page
from calib.runs import load_run, recommend_in, verify
from calib.sampling.posterior import Posterior
from calib.sampling.storage import save_posterior
from models.analytic import ClosedForm

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="stand-ins for browsers are shell scripts")

#: Whether a browser is found beside the search path: where this system installs programs, which no test can change.
INSTALLED = find_browser({**os.environ, "PATH": ""}) is not None

PRINTS = """#!/bin/sh
for word in "$@"; do
    case "$word" in
        --print-to-pdf=*) out="${word#--print-to-pdf=}" ;;
        --user-data-dir=*) test -d "${word#--user-data-dir=}" || exit 1 ;;
        file://*) page="$word" ;;
    esac
done
{ echo "%PDF-1.4"; echo "$page"; head -c 2000 /dev/zero | tr "\\0" " "; echo "%%EOF"; } > "$out"
"""
HANGS = """#!/bin/sh
sleep 60 &
echo $! > "$(dirname "$0")/child"
sleep 60
"""
FAILS = """#!/bin/sh
echo "cannot open display" >&2
exit 1
"""


def _program(folder: Path, text: str, name: str = "chromium") -> Path:
    folder.mkdir(exist_ok=True)
    path = folder / name
    path.write_text(text, encoding="utf-8")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


@pytest.fixture
def run(make_posterior: Callable[..., Posterior], tmp_path: Path, undrawn: None) -> Path:
    folder = tmp_path / "run #1 %41 ü"
    folder.mkdir()
    save_posterior(make_posterior(n_specimen=1), folder / "posterior.nc", ClosedForm())
    return folder


def test_a_browser_is_found_on_the_path_first_and_else_where_it_is_usually_installed(tmp_path: Path) -> None:
    for name in BROWSERS[::-1]:
        found = _program(tmp_path / "bin", FAILS, name)
        assert find_browser({"PATH": str(tmp_path / "bin")}) == found
    application = tmp_path / "Applications" / "Chromium.app" / "Contents" / "MacOS"
    application.mkdir(parents=True)
    alone = {"PATH": str(tmp_path), "HOME": str(tmp_path), "PROGRAMFILES(X86)": str(tmp_path)}
    assert find_browser(alone, "darwin") is None
    assert find_browser(alone, "darwin") != _program(application, FAILS, "Chromium")
    assert find_browser(alone, "darwin") == application / "Chromium"
    edge = tmp_path / "Microsoft" / "Edge" / "Application"
    edge.mkdir(parents=True)
    assert find_browser(alone, "win32") is None
    assert _program(edge, FAILS, "msedge.exe") == find_browser(alone, "win32")
    assert find_browser({}, "linux") is None


def test_a_browser_that_hangs_is_ended_with_all_that_it_started(tmp_path: Path) -> None:
    browser = _program(tmp_path / "bin", HANGS)
    with pytest.raises(PrintError, match=r"had not ended after 0\.5 s"):
        print_page(browser, tmp_path / "page.html", tmp_path / "page.pdf", time_limit=0.5)
    child = int((tmp_path / "bin" / "child").read_text(encoding="utf-8"))
    state = Path(f"/proc/{child}/stat")
    if sys.platform == "linux":
        assert not state.exists() or state.read_text(encoding="utf-8").split()[2] == "Z"
    else:
        with pytest.raises(ProcessLookupError):
            os.kill(child, 0)


def test_a_print_that_fails_says_what_the_browser_said_and_leaves_the_page(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(_program(tmp_path / "bin", FAILS).parent) + os.pathsep + "/usr/bin:/bin")
    result = CliRunner().invoke(app, ["report", str(run), "--pdf"])
    assert result.exit_code == 1
    said = " ".join(result.stderr.split())
    assert "report.html is written, but not report.pdf" in said
    assert "left no whole PDF, and said: cannot open display" in said
    assert sorted(path.name for path in run.glob("report*")) == ["report.html"]
    assert all(f.state == "fine" for f in verify(run) if "report" in f.name)
    (tmp_path / "bin" / "chromium").write_bytes(b"\x7fELF")
    assert "cannot be run" in CliRunner().invoke(app, ["report", str(run), "--pdf"]).stderr


@pytest.mark.skipif(INSTALLED, reason="there is one where this system installs programs")
def test_without_a_browser_nothing_is_written_and_what_was_looked_for_is_named(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    result = CliRunner().invoke(app, ["report", str(run), "--pdf"])
    assert result.exit_code == 2
    said = " ".join(result.stderr.split())
    assert all(name in said for name in BROWSERS)
    assert "open report.html in any browser and print it from there: that gives the same" in said
    assert [path.name for path in run.iterdir()] == ["posterior.nc"]


def test_the_print_is_of_the_run_as_its_page_is_and_gone_once_that_is_written_anew(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(_program(tmp_path / "bin", PRINTS).parent) + os.pathsep + "/usr/bin:/bin")
    result = CliRunner().invoke(app, ["report", str(run), "--pdf"])
    assert result.exit_code == 0, result.stderr
    printed = run / "report.pdf"
    assert (run / "report.html").absolute().as_uri().encode() in printed.read_bytes()
    assert f"{run / 'report.html'}, {printed}" in result.stdout

    def state() -> list[str]:
        return [f.state for f in verify(run) if f.name == "report.pdf"]

    assert state() == ["fine"]
    content = bytearray(printed.read_bytes())
    content[500] ^= 1
    printed.write_bytes(content)
    assert state() == ["changed"]
    recommend_in(load_run(run), Requirement(2.0, 0.5e-3, 3e-3, n_thickness=5, n_draw=50), seed=1)
    assert not printed.exists()
    assert state() == []

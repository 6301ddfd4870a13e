"""A page in, its print as PDF out, by a browser that is found on this machine."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

#: Programs that print pages as this project lays them out, in the order in which they are looked for.
BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "microsoft-edge-stable",
    "msedge",
)
#: Seconds that a print may take; one of ten sheets takes one or two.
TIME_LIMIT = 120.0

_APPLICATIONS = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
)
_PROGRAMS = ("Google/Chrome/Application/chrome.exe", "Chromium/Application/chrome.exe", "Microsoft/Edge/Application/msedge.exe")
_PROGRAM_FOLDERS = ("PROGRAMFILES", "PROGRAMFILES(X86)", "LOCALAPPDATA")
# A print of nothing at all is about this long [bytes].
_LEAST = 800


class PrintError(Exception):
    """A browser did not print a page, for the reason it says."""


def find_browser(environment: Mapping[str, str] = os.environ, platform: str = sys.platform) -> Path | None:
    """Find a browser that can print pages: on the search path, else where it is usually installed; None if there is none.

    Parameters
    ----------
    environment : variables that say where programs are.
    platform : as `sys.platform` says it.
    """
    for name in BROWSERS:
        if found := shutil.which(name, path=environment.get("PATH", "")):
            return Path(found)
    usual: list[Path] = []
    if platform == "darwin":
        usual = [Path(root + place) for root in ("", environment.get("HOME", "")) for place in _APPLICATIONS]
    elif platform == "win32":
        folders = [Path(environment[name]) for name in _PROGRAM_FOLDERS if environment.get(name)]
        usual = [folder / place for place in _PROGRAMS for folder in folders]
    return next((path for path in usual if path.is_file()), None)


def print_page(browser: Path, page: Path, printed: Path, time_limit: float = TIME_LIMIT) -> None:
    """Print a page as PDF, in a profile of its own that is gone afterwards.

    Parameters
    ----------
    browser : program, see `find_browser`.
    page : HTML file.
    printed : PDF file to be written.
    time_limit : [s], after which the browser is ended.

    Raises
    ------
    PrintError
        If the browser cannot be run, takes too long, or leaves no whole PDF.
    """
    with tempfile.TemporaryDirectory(prefix="calib-print-", ignore_cleanup_errors=True) as profile:
        words = [
            str(browser),
            "--headless",
            "--disable-gpu",
            "--disable-extensions",
            "--disable-background-networking",
            "--no-first-run",
            "--no-pdf-header-footer",
            f"--user-data-dir={profile}",
            f"--print-to-pdf={printed.absolute()}",
            # A browser refuses to shut itself in for root; what it shows here is a page of ours without scripts.
            *(["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else []),
            page.absolute().as_uri(),
        ]
        try:
            said = _ended(words, time_limit)
        except OSError as error:
            raise PrintError(f"{browser} cannot be run: {error.strerror or error}") from error
    content = printed.read_bytes() if printed.is_file() else b""
    if len(content) < _LEAST or not content.startswith(b"%PDF-") or b"%%EOF" not in content[-1024:]:
        last = said.strip().splitlines()[-1:]
        raise PrintError(f"{browser} left no whole PDF{f', and said: {last[0][:300]}' if last else ''}")


def _ended(words: list[str], time_limit: float) -> str:
    """Run a program to its end, with all that it starts; what it says on standard error."""
    process = subprocess.Popen(
        words,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        start_new_session=True,
    )
    try:
        return process.communicate(timeout=time_limit)[1]
    except subprocess.TimeoutExpired:
        raise PrintError(f"{words[0]} had not ended after {time_limit:g} s") from None
    finally:
        if process.poll() is None:
            with suppress(OSError):
                os.killpg(process.pid, signal.SIGKILL) if hasattr(os, "killpg") else process.kill()
            process.communicate()

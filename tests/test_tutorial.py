"""What the tutorial shows of the commands that take seconds is what they say; of the others, that they exist."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from calib.cli import app

TUTORIAL = Path(__file__).parents[1] / "docs" / "tutorial.md"
#: Commands that are not run here: they take long, or install.
LONG = ("calibrate", "recommend", "verify")


def _shown() -> list[tuple[list[str], list[str]]]:
    """Each command of the tutorial, with the lines that are shown of what it says."""
    found: list[tuple[list[str], list[str]]] = []
    for block in re.findall(r"^```console\n(.*?)^```", TUTORIAL.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE):
        for line in block.splitlines():
            if line.startswith("$ "):
                found.append((shlex.split(line[2:]), []))
            elif line != "…":
                found[-1][1].append(line)
    return [(words[1:], lines) for words, lines in found if words[0] == "calib"]


def _plain(text: str) -> str:
    return " ".join(text.split())


def test_the_tutorial_shows_what_its_commands_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    commands = _shown()
    assert [words[0] for words, _ in commands] == ["example", "read", "init", "check", "calibrate", "recommend", "verify"]
    for words, lines in commands:
        if words[0] in LONG:
            assert CliRunner().invoke(app, [words[0], "--help"]).exit_code == 0
            continue
        result = CliRunner().invoke(app, words)
        assert result.exit_code == 0, result.output
        said = [_plain(line) for line in result.stdout.splitlines()]
        assert [line for line in lines if _plain(line) not in said] == [], words
        if words[0] == "example":
            monkeypatch.chdir(tmp_path / "demo")

"""What the how-tos show is real: files are read as shown, experiments are valid, commands and their options exist."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

import calib
from calib.cli import app

ROOT = Path(__file__).parents[1]
PAGES = sorted(path for path in (ROOT / "docs" / "howto").glob("*.md") if path.name != "index.md")
#: Commands that take no run and no time.
SHORT = ("read", "cite")


def _plain(text: str) -> str:
    return " ".join(text.split())


def _shown(text: str) -> list[tuple[list[str], list[str]]]:
    """Each command of a page, with the lines that are shown of what it says."""
    found: list[tuple[list[str], list[str]]] = []
    for block in re.findall(r"^```console\n(.*?)^```", text, re.DOTALL | re.MULTILINE):
        for line in block.splitlines():
            if line.startswith("$ "):
                found.append((shlex.split(line[2:]), []))
            elif line != "…":
                found[-1][1].append(_plain(line))
    assert all(words[0] == "calib" for words, _ in found)
    return [(words[1:], lines) for words, lines in found]


def _spoken_of(text: str) -> list[list[str]]:
    """Commands in the running text."""
    return [shlex.split(words.partition(" > ")[0])[1:] for words in re.findall(r"`(calib [^`]*)`", text)]


def _help_of(words: list[str]) -> str:
    """The help of a command, with that of the one below it, if it has one."""
    depth = 2 if words[0] == "surrogate" else 1
    result = CliRunner().invoke(app, [*words[:depth], "--help"], env={"COLUMNS": "200"})
    assert result.exit_code == 0, words
    return result.stdout


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> Path:
    """A folder with the files that a page shows, and with empty ones that its experiments name."""
    for name, content in re.findall(r"^```\{code-block\} \w+\n:caption: (\S+)\n\n(.*?)^```", _text(request), re.DOTALL | re.M):
        (tmp_path / name).write_text(content, encoding="utf-8")
        for lab_file in re.findall(r'= "(\w+\.csv)"', content):
            (tmp_path / lab_file).touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _text(request: pytest.FixtureRequest) -> str:
    path = request.node.callspec.params["page"]
    assert isinstance(path, Path)
    return path.read_text(encoding="utf-8")


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_what_a_page_shows_is_what_its_commands_say(page: Path, folder: Path) -> None:
    text = page.read_text(encoding="utf-8")
    commands = _shown(text)
    assert commands
    for words in [*(words for words, _ in commands), *_spoken_of(text)]:
        known = _help_of(words)
        assert all(re.search(rf"(?<![\w-]){re.escape(word)}\b", known) for word in words if word.startswith("--")), words
    for words, lines in commands:
        if words[0] in SHORT:
            result = CliRunner().invoke(app, words)
            refused = any(line.startswith("Error:") for line in lines)
            assert result.exit_code == (2 if refused else 0), result.output
            said = [_plain(line) for line in (result.stderr if refused else result.stdout).splitlines()]
            assert [line for line in lines if line not in said] == [], words
        else:
            assert lines == []
    for path in folder.glob("*.toml"):
        assert calib.read_experiment(path).specimens


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_options_in_a_table_exist(page: Path, folder: Path) -> None:
    known = _help_of(["read"])
    rows = re.findall(r"^\| [^|]* \| `(--[\w-]+) [^|]*\| `(\w+) = ", page.read_text(encoding="utf-8"), re.M)
    assert all(option in known for option, _ in rows)
    assert rows or page.stem != "files_not_read"


def test_every_page_is_in_the_list() -> None:
    listed = re.findall(r"^(\w+)$", (ROOT / "docs" / "howto" / "index.md").read_text(encoding="utf-8"), re.M)
    assert sorted(listed) == [path.stem for path in PAGES]

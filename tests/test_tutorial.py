"""The tutorial shows all that its commands say; of a sampled posterior, last digits may be those of another machine."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

sys.path.insert(0, str(Path(__file__).parents[1] / "docs"))

from make_outputs import BLOCK, TUTORIAL, write_diameter_for_radius

from calib.cli import app

#: Commands whose numbers are those of a sampled posterior: the last digits are another machine's own.
SAMPLED = ("calibrate", "recommend", "verify")
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_MEAN_AND_SD = re.compile(r"(-?\d+\.\d+) ± (\d+\.\d+)")


def _shown() -> list[tuple[list[str], list[str]]]:
    """Each command of the tutorial, with the lines that are shown of what it says."""
    found: list[tuple[list[str], list[str]]] = []
    for block in BLOCK.findall(TUTORIAL.read_text(encoding="utf-8")):
        for line in block.splitlines():
            if line.startswith("$ "):
                found.append((shlex.split(line[2:]), []))
            else:
                found[-1][1].append(line)
    return [(words[1:], lines) for words, lines in found if words[0] == "calib"]


def _plain(lines: list[str]) -> list[str]:
    """Lines without blanks at their ends and within tables, and without those about the machine that this runs on."""
    return [text for line in lines if (text := " ".join(line.replace("─", "").split())) and "on this machine" not in text]


def test_the_tutorial_shows_what_its_commands_say(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    commands = _shown()
    order = ["example", "read", "init", "check", "check", "calibrate", "recommend", "verify"]
    assert [words[0] for words, _ in commands] == order
    for words, lines in commands:
        if slip := words[-1] == "diameter.toml":  # what the reader is asked to save
            write_diameter_for_radius(Path("experiment.toml"), Path("diameter.toml"))
        result = CliRunner().invoke(app, words)
        assert result.exit_code == (2 if slip else 0), result.output
        shown, said = _plain(lines), _plain(result.output.splitlines())
        if words[0] not in SAMPLED:
            assert shown == said
        else:
            assert [_NUMBER.sub("#", line) for line in shown] == [_NUMBER.sub("#", line) for line in said]
            pairs = [[(float(m), float(sd)) for line in text for m, sd in _MEAN_AND_SD.findall(line)] for text in (shown, said)]
            assert all(abs(a - b) < 0.5 * sd for (a, sd), (b, _) in zip(*pairs, strict=True))
        if words[0] == "example":
            monkeypatch.chdir(tmp_path / "demo")

"""Write below each command of the tutorial all that it says: `python docs/make_outputs.py`; look at the difference."""

from __future__ import annotations

import os
import re
import shlex
import tempfile
from contextlib import chdir
from pathlib import Path

from typer.testing import CliRunner

from calib.cli import app

TUTORIAL = Path(__file__).parent / "tutorial.md"
BLOCK = re.compile(r"^```console\n(.*?)^```", re.DOTALL | re.MULTILINE)


def answered(block: str) -> str:
    """The same commands, each with what it says now; those of the shell itself say nothing."""
    lines = []
    for command in (line for line in block.splitlines() if line.startswith("$ ")):
        lines.append(command)
        words = shlex.split(command[2:])
        if words[0] == "cd":
            os.chdir(words[1])
        if words[0] == "calib":
            if words[-1] == "diameter.toml":  # what the reader is asked to save
                write_diameter_for_radius(Path("experiment.toml"), Path("diameter.toml"))
            result = CliRunner().invoke(app, words[1:])
            if result.exit_code != 0 and words[-1] != "diameter.toml":
                raise SystemExit(f"{command} ended with {result.exit_code}: {result.output}")
            lines.extend(line.rstrip() for line in result.output.splitlines())
    return "\n".join(lines).rstrip() + "\n"


def write_diameter_for_radius(experiment: Path, copy: Path) -> None:
    """Copy an experiment with the diameter of its ball where the radius belongs."""
    copy.write_text(experiment.read_text(encoding="utf-8").replace('radius = "5 mm"', 'radius = "10 mm"', 1), encoding="utf-8")


def main() -> None:
    """Run all commands in the order of the page, in a folder of its own."""
    text = TUTORIAL.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as scratch, chdir(scratch):
        made = BLOCK.sub(lambda found: f"```console\n{answered(found[1])}```", text)
    TUTORIAL.write_text(made, encoding="utf-8")


if __name__ == "__main__":
    main()

"""How the documentation site is built: `python -m sphinx -W docs site`."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

from sphinx.highlighting import lexers

import calib

HERE = Path(__file__).parent
PROGRAM = "dielectric-elastomer-calibration"

project = "Bayesian calibration of dielectric-elastomer tactile sensors"
html_title = "calib"
release = metadata.version(PROGRAM)
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
html_theme = "furo"
html_copy_source = False
exclude_patterns = ["conf.py"]
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]
default_role = "literal"
suppress_warnings = ["ref.python"]  # attributes of one name in several results
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_rtype = False
autodoc_preserve_defaults = True

_GIVEN = ("Parameters", "Attributes")
_RETURNED = {"Returns": "returns", "Yields": "yields"}


def _with_descriptions(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Put sections of docstrings into the form that Sphinx reads: here they say what is given and returned, and no types."""
    section = ""
    kept: list[str] = []
    for line, below in zip(lines, [*lines[1:], ""], strict=True):
        text = line.replace("|", r"\|")  # magnitudes, and no substitutions
        if below and set(below) == {"-"} and line:
            section = line
            kept.append("" if line in _RETURNED else line)
        elif section in _GIVEN and (found := re.match(r"([\w*, ]+) : (.*)$", text)):
            kept += [found[1], f"    {found[2]}"]
        elif section in _RETURNED and line and set(line) == {"-"}:
            kept.append(f":{_RETURNED[section]}:")
        elif section in _RETURNED:
            kept.append(f"    {text}" if text else "")
        else:
            kept.append(text)
    lines[:] = kept


def _beside_the_docs(app: Any, name: str, text: list[str]) -> None:
    """What stands above the folder of the docs is a page of its own."""
    text[0] = text[0].replace("](../CONTRIBUTING.md", "](contributing.md")


def _write_references() -> None:
    """The pages that follow from the program itself: every command with its options, every public name, how to contribute."""
    folder = HERE / "reference"
    words = [sys.executable, "-m", "typer", "calib.cli", "utils", "docs", "--name", "calib", "--title", "Commands"]
    commands = subprocess.run(words, capture_output=True, text=True, check=True, cwd=HERE.parent).stdout
    _write(folder / "commands.md", commands)
    named = {name: getattr(calib, name) for name in calib.__all__}
    kinds: dict[str, Callable[[object], bool]] = {"Functions": inspect.isfunction, "Results and settings": inspect.isclass}
    blocks = ["# Python\n\n`import calib` offers these names, each loaded when it is asked for.\n"]
    for heading, is_one in kinds.items():
        blocks.append(f"## {heading}\n")
        for name, obj in named.items():
            if is_one(obj):
                directive = "autofunction" if inspect.isfunction(obj) else "autoclass"
                members = "" if inspect.isfunction(obj) else "   :members:\n"
                blocks.append(f"```{{eval-rst}}\n.. {directive}:: calib.{name}\n{members}```\n")
    _write(folder / "python.md", "\n".join(blocks))
    _write(HERE / "contributing.md", (HERE.parent / "CONTRIBUTING.md").read_text(encoding="utf-8").replace("](docs/", "]("))


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def setup(app: Any) -> None:
    """Called by Sphinx before it reads the pages."""
    _write_references()
    lexers["mermaid"] = import_module("pygments.lexers.special").TextLexer()
    app.connect("source-read", _beside_the_docs)
    app.connect("autodoc-process-docstring", _with_descriptions, priority=100)

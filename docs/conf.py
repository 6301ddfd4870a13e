"""How the documentation site is built: `python -m sphinx -W docs site`."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

from sphinx.highlighting import lexers

import calib
from calib.catalogue import UNKNOWNS
from calib.decision import Recommendation, Requirement
from calib.experiment import experiment_schema, specification_schema
from calib.runs.listing import Listing
from calib.sampling import ParameterSummary

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


def _as_of_the_code(app: Any, name: str, text: list[str]) -> None:
    """What stands above the folder of the docs is a page of its own; tables of the code stand where a page asks for them."""
    page = text[0].replace("](../CONTRIBUTING.md", "](contributing.md")
    text[0] = re.sub(r"^<!-- table: (.+) -->$", lambda found: _TABLES[found[1]](), page, flags=re.MULTILINE)


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(' '.join(cell.split()).replace('|', chr(92) + '|') for cell in row)} |" for row in lines)


def _unknowns() -> str:
    """Every unknown of the catalogue, one a row."""
    rows = []
    for row in UNKNOWNS.values():
        q = row.quantity
        signs = "any sign" if row.bounds == "any" else row.bounds
        units = f"{q.display_unit or '1'}" + (f" (SI: {q.unit})" if q.unit and q.unit != q.display_unit else "")
        when = row.when + (f"; else `{row.derived}`" if row.derived else "")
        default = f"`{row.default}`" if row.default else "must be given" if row.required else "none"
        reason = f": {row.reason}" if row.reason else ""
        rows.append((f"`{row.name}`", q.symbol, q.label, units, f"{row.scope}, {signs}", when, default + reason))
    return _table(("key", "symbol", "what it is", "unit", "one per, sign", "exists", "default prior, and why"), rows)


def _keys(schema: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, str, str]]:
    """Every key below a table of a schema, with where it stands, what it is for, and what holds where it is left out."""
    for key, value in schema["properties"].items():
        several = value.get("type") == "array" and value["items"].get("type") == "object"
        inside = value["items"] if several else value
        about = inside.get("description") or value.get("description", "")
        if key == "priors":  # one key for each unknown, which have a table of their own
            yield f"`{above}[{key}]`", f"{about} Its keys: [the unknowns](unknowns.md).", ""
        elif inside.get("type") == "object" and "properties" in inside:
            yield f"`{above}{f'[[{key}]]' if several else f'[{key}]'}`", about, ""
            yield from _keys(inside, f"{above}{key}.")
        else:
            choices = f" One of {', '.join(f'`{c}`' for c in value['enum'])}." if "enum" in value else ""
            asked = "must be given" if key in schema.get("required", ()) else ""
            yield f"`{above}{key}`", about + choices, f"`{value['default']}`" if "default" in value else asked


def _attributes(of: type) -> str:
    """What a docstring says of each attribute."""
    rows: list[list[str]] = []
    for line in (inspect.getdoc(of) or "").split("Attributes\n----------\n")[1].split("\n\n")[0].splitlines():
        if line.startswith(" "):
            rows[-1][1] += line
        else:
            names, _, said = line.partition(" : ")
            rows.append([", ".join(f"`{name}`" for name in names.split(", ")), said])
    return _table(("key", "what it is"), rows)


def _variables() -> str:
    """What draws of the unknowns are called in `posterior.nc`, and their units."""
    rows = [(f"`{u.name}`", u.quantity.label, u.quantity.unit or "1") for u in UNKNOWNS.values()]
    return _table(("variable", "what it is", "unit"), rows)


_TABLES: dict[str, Callable[[], str]] = {
    "unknowns": _unknowns,
    "keys of an experiment file": lambda: _table(("key", "what it is", "default"), _keys(experiment_schema())),
    "keys of a specification file": lambda: _table(("key", "what it is", "default"), _keys(specification_schema())),
    "summary of a parameter": lambda: _attributes(ParameterSummary),
    "variables": _variables,
    "recommendation": lambda: _attributes(Recommendation),
    "request": lambda: _attributes(Requirement),
    "listing": lambda: _attributes(Listing),
}


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
    app.connect("source-read", _as_of_the_code)
    app.connect("autodoc-process-docstring", _with_descriptions, priority=100)

"""What the packages import is what pyproject.toml requires and constraints.txt pins, an extra only where it is asked for."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.ndimage import median_filter

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
OWN = {"calib", "models"}

#: Requirements whose module has another name.
MODULE = {"scikit-learn": "sklearn"}
#: Rooms that are of an extra as a whole, and loaded only by who asks for them.
ROOMS = ("calib/serve",)
#: Modules that another requirement brings along by the same project.
OF_THE_SAME_PROJECT = {"vtkmodules": "vtk"}


class Import(NamedTuple):
    """An import of what is neither Python's nor our own: the first name, where it is, and whether it waits for a call."""

    module: str
    place: str
    lazy: bool


def module_of(requirement: str) -> str:
    """`import` name of a line of requirements."""
    name = re.split(r"[<>=~!;\[ ]", requirement)[0].lower()
    return MODULE.get(name, name.replace("-", "_"))


def imports_of(path: Path) -> Iterator[Import]:
    """Every import of a file, those for the type checker aside; `import_module` of a text and what hands one on counts, too."""

    def visit(node: ast.AST, lazy: bool) -> Iterator[tuple[str, int, bool]]:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            for other in node.orelse:
                yield from visit(other, lazy)
            return
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield alias.name, node.lineno, lazy
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module, node.lineno, lazy
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("import_module", "importlib.import_module", "_optional"):
            argument = node.args[0]
            if isinstance(argument, ast.Constant) and isinstance(argument.value, str):
                yield argument.value, node.lineno, lazy
        inside = lazy or isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda))
        for child in ast.iter_child_nodes(node):
            yield from visit(child, inside)

    for name, line, lazy in visit(ast.parse(path.read_text(encoding="utf-8")), False):
        first = name.split(".")[0]
        if first not in OWN and first not in sys.stdlib_module_names:
            place = f"{path.relative_to(ROOT)}:{line}" if path.is_relative_to(ROOT) else f"{path.name}:{line}"
            yield Import(OF_THE_SAME_PROJECT.get(first, first), place, lazy)


REQUIRED = {module_of(line) for line in PROJECT["dependencies"]}
OPTIONAL = {module_of(line) for name, extra in PROJECT["optional-dependencies"].items() if name != "test" for line in extra}


@pytest.fixture(scope="module")
def imports() -> list[Import]:
    """All that the packages import."""
    return [found for package in sorted(OWN) for path in sorted((ROOT / package).rglob("*.py")) for found in imports_of(path)]


def test_what_is_imported_is_required(imports: list[Import]) -> None:
    missing = [f"{found.place} imports {found.module}" for found in imports if found.module not in REQUIRED | OPTIONAL]
    assert not missing, "add to `dependencies` of pyproject.toml, with a lower bound, and to constraints.txt"


def test_what_is_required_is_imported(imports: list[Import]) -> None:
    unused = REQUIRED - {found.module for found in imports}
    assert not unused, "take out of `dependencies` of pyproject.toml"


def test_an_extra_is_imported_only_when_it_is_asked_for(imports: list[Import]) -> None:
    early = [
        f"{found.place} imports {found.module}"
        for found in imports
        if found.module in OPTIONAL and not found.lazy and not found.place.startswith(ROOMS)
    ]
    assert not early, "import it inside the function that needs it, and say there which extra installs it"
    assert not REQUIRED & OPTIONAL


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_of_an_extra_is_loaded_only_when_it_is_asked_for(room: str) -> None:
    package = room.replace("/", ".")
    code = f"import sys, {package}, calib.cli; assert not [m for m in {sorted(OPTIONAL)} if m in sys.modules]"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_every_requirement_has_a_lower_bound_and_a_version_in_the_constraints() -> None:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pinned = {module_of(line) for line in lines if "==" in line}
    extras = PROJECT["optional-dependencies"]
    for requirement in (
        *PROJECT["dependencies"],
        *(line for name in ("test", "cluster", "docs", "serve", "view") for line in extras[name]),
    ):
        assert ">=" in requirement
        assert module_of(requirement) in pinned, f"add {requirement} to constraints.txt"


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("import numpy.linalg as la", [("numpy", False)]),
        ("def f():\n    from vtkmodules.vtkCommonCore import vtkLogger", [("vtk", True)]),
        ("from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import pandas\nelse:\n    import json", []),
        ("def f():\n    return import_module('distributed')", [("distributed", True)]),
        ("from calib import lab\nfrom . import x", []),
        ("try:\n    import pyvista\nexcept ImportError:\n    pass", [("pyvista", False)]),
    ],
)
def test_imports_are_found(text: str, found: list[tuple[str, bool]], tmp_path: Path) -> None:
    (tmp_path / "m.py").write_text(text)
    assert [(i.module, i.lazy) for i in imports_of(tmp_path / "m.py")] == found


@pytest.mark.parametrize("size", [5, 9])
def test_running_medians_of_the_installed_scipy_are_medians(size: int) -> None:
    rng = np.random.default_rng(0)
    for n in (size, size + 1, 2 * size, 50, 240):
        for _ in range(30):
            values = np.cumsum(rng.normal(size=n))
            windows = np.lib.stride_tricks.sliding_window_view(np.pad(values, size // 2, mode="edge"), size)
            np.testing.assert_array_equal(median_filter(values, size=size, mode="nearest"), np.median(windows, axis=1))


@pytest.mark.parametrize("function", [np.exp, np.log, np.log1p, np.expm1, np.sinh, np.cosh, np.tanh, np.arcsinh, np.arctan])
def test_the_bits_of_a_function_do_not_depend_on_where_its_numbers_are_in_memory(function: np.ufunc) -> None:
    # NumPy before 2.0.2 takes another way, with other last bits, where the result lies close behind a column of a table: then a
    # run that is resumed has other draws, once in some 2,000 starts.
    memory, elsewhere = np.empty(72), np.empty(10)
    rng = np.random.default_rng(5)
    for _ in range(100):
        table, behind = memory[:60].reshape(10, 6), memory[62:]
        table[...] = rng.exponential(size=table.shape)
        function(table[:, 5], out=behind)
        function(table[:, 5], out=elsewhere)
        np.testing.assert_array_equal(behind, elsewhere)

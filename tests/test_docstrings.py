"""Docstrings of public functions are data sheets: every argument and every exception that is raised on the spot is named."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("calib", "models")

FunctionNode = ast.FunctionDef | ast.AsyncFunctionDef


class Function(NamedTuple):
    """A public function or method: its file, its name with that of its class, and its node in the syntax tree."""

    path: Path
    name: str
    node: FunctionNode


def is_public(name: str) -> bool:
    return not name.startswith("_")


def trees() -> Iterator[tuple[Path, ast.Module]]:
    """The syntax tree of every public module of the two packages."""
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            if path.stem == "__init__" or is_public(path.stem):
                yield path, ast.parse(path.read_text(encoding="utf-8"), str(path))


def functions() -> list[Function]:
    """All public functions and methods of the two packages."""
    return [function for path, tree in trees() for function in functions_of(path, tree)]


def functions_of(path: Path, tree: ast.Module | ast.ClassDef, prefix: str = "") -> Iterator[Function]:
    """Public functions of a module and public methods of its public classes, without what a function defines inside."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef) and is_public(node.name):
            yield from functions_of(path, node, f"{prefix}{node.name}.")
        elif isinstance(node, FunctionNode) and is_public(node.name):
            yield Function(path, prefix + node.name, node)


def commands() -> frozenset[tuple[str, str]]:
    """Module and name of every function that `calib.cli` registers as a command: `app.command(...)(module.function)`."""
    tree = ast.parse((ROOT / "calib" / "cli" / "__init__.py").read_text(encoding="utf-8"))
    return frozenset(
        (call.args[0].value.id, call.args[0].attr)
        for call in ast.walk(tree)
        if isinstance(call, ast.Call)
        and isinstance(call.func, ast.Call)
        and isinstance(call.func.func, ast.Attribute)
        and call.func.func.attr == "command"
        and isinstance(call.args[0], ast.Attribute)
        and isinstance(call.args[0].value, ast.Name)
    )


def is_command(function: Function) -> bool:
    """Whether the docstring is a text for the command line.

    Typer prints it as the help of the command, and every option has its own help there: a section "Parameters" would be printed
    a second time, with names of Python that nobody types.
    """
    in_cli = function.path.is_relative_to(ROOT / "calib" / "cli")
    return in_cli and (function.path.stem, function.name) in commands()


def is_property(node: FunctionNode) -> bool:
    names = {ast.unparse(decorator).rpartition(".")[2] for decorator in node.decorator_list}
    return bool(names & {"property", "cached_property", "setter"})


def arguments_of(node: FunctionNode, method: bool) -> list[str]:
    """Names of the arguments, without `self` or `cls` and without `_`, which a function takes and does not use."""
    given = node.args
    positional = [*given.posonlyargs, *given.args]
    static = any(ast.unparse(decorator) == "staticmethod" for decorator in node.decorator_list)
    if method and not static:
        positional = positional[1:]
    stars = [star for star in (given.vararg, given.kwarg) if star is not None]
    return [argument.arg for argument in (*positional, *given.kwonlyargs, *stars) if is_public(argument.arg)]


def section(docstring: str, title: str) -> str | None:
    """Body of a numpydoc section, None if there is none."""
    found = re.search(rf"^{title}\n-+\n(.*?)(?=^\w[\w ]*\n-+$|\Z)", docstring, re.MULTILINE | re.DOTALL)
    return found[1] if found else None


def documented_arguments(docstring: str) -> set[str]:
    """Names before the colon of each entry of the section "Parameters"; several may share a line."""
    entries = re.findall(r"^([\w*][\w*, ]*?) ?:(?: |$)", section(docstring, "Parameters") or "", re.MULTILINE)
    return {name.strip().lstrip("*") for entry in entries for name in entry.split(",")}


def is_reference(docstring: str, known: frozenset[str]) -> bool:
    """Whether the docstring as a whole hands over to another function: "See `Forward.solve`." and what is special here."""
    found = re.match(r"See `([\w.]+)`", docstring)
    return found is not None and any(name == found[1] or name.endswith(f".{found[1]}") for name in known)


def raised(node: FunctionNode) -> set[str]:
    """Public exception classes that the body itself raises; what a function that is called raises is not counted.

    Nor is an AssertionError: it marks a place that is never reached, which no caller has to expect.
    """
    names = set()
    pending: list[ast.AST] = list(node.body)
    while pending:
        child = pending.pop()
        if isinstance(child, (FunctionNode, ast.Lambda, ast.ClassDef)):
            continue
        if isinstance(child, ast.Raise) and isinstance(child.exc, ast.Call):
            name = ast.unparse(child.exc.func).rpartition(".")[2]
            if name[:1].isupper() and name != "AssertionError":
                names.add(name)
        pending.extend(ast.iter_child_nodes(child))
    return names


def missing_of(function: Function, known: frozenset[str]) -> list[str]:
    """What the docstring of a function lacks, in words."""
    arguments = arguments_of(function.node, method="." in function.name)
    docstring = ast.get_docstring(function.node)
    if docstring is None:
        return ["a docstring"]
    if is_reference(docstring, known):
        return []
    missing = []
    if len(arguments) >= 2:
        documented = documented_arguments(docstring)
        absent = [name for name in arguments if name not in documented]
        if section(docstring, "Parameters") is None:
            missing.append('a section "Parameters"')
        elif absent:
            missing.append(f"in Parameters: {', '.join(absent)}")
        strangers = sorted(documented - set(arguments))
        if strangers:
            missing.append(f"an argument for what Parameters names: {', '.join(strangers)}")
    silent = sorted(name for name in raised(function.node) if name not in (section(docstring, "Raises") or ""))
    if silent:
        missing.append(f"in Raises: {', '.join(silent)}")
    return missing


def full_names(functions: Iterable[Function]) -> frozenset[str]:
    """Dotted names of functions."""
    return frozenset(
        f"{'.'.join(function.path.relative_to(ROOT).with_suffix('').parts)}.{function.name}" for function in functions
    )


def faults_of(functions: Iterable[Function], known: frozenset[str]) -> list[str]:
    """One line for every function whose docstring lacks something: file, line, name, and what is missing."""
    return [
        f"{function.path.relative_to(ROOT)}:{function.node.lineno}: {function.name} lacks {'; '.join(missing)}"
        for function in functions
        if not is_property(function.node) and not is_command(function) and (missing := missing_of(function, known))
    ]


def test_docstrings_name_every_argument_and_every_exception_raised_on_the_spot() -> None:
    found = functions()
    faults = faults_of(found, full_names(found))
    assert not faults, "\n".join(["", *faults])


@pytest.mark.parametrize(
    ("source", "missing"),
    [
        ("def f(a, b):\n    pass", "a docstring"),
        ('def f(a, b):\n    """Add."""', 'a section "Parameters"'),
        ('def f(a, b):\n    """Add.\n\n    Parameters\n    ----------\n    a : [m].\n    """', "in Parameters: b"),
        (
            'def f(a, b):\n    """Add.\n\n    Parameters\n    ----------\n    a, b, c : [m].\n    """',
            "an argument for what Parameters names: c",
        ),
        ('def f(a):\n    """Add."""\n    raise ValueError(a)', "in Raises: ValueError"),
        ('class C:\n    def f(self, a, *b, **c):\n        """See `nowhere`."""', 'a section "Parameters"'),
    ],
)
def test_what_is_missing_is_found_and_named(source: str, missing: str) -> None:
    (fault,) = faults_of(functions_of(ROOT / "models" / "example.py", ast.parse(source)), frozenset())
    assert fault.startswith("models/example.py:")
    assert fault.endswith(f"lacks {missing}")


def test_data_sheets_references_and_private_names_are_accepted() -> None:
    source = '''
def f(a, b, *, c):
    """Add.

    Parameters
    ----------
    a, b : [m], the two.
    c : [N],
        in a line of its own: the third.

    Raises
    ------
    ValueError
        Always.
    """
    raise ValueError(a)

def g(a, b):
    """See `f`."""

def _h(a, b): pass

class C:
    @property
    def total(self): pass
    def one(self, a):
        """One argument needs no section."""
'''
    known = frozenset({"models.example.f"})
    assert faults_of(functions_of(ROOT / "models" / "example.py", ast.parse(source)), known) == []


def test_commands_of_the_command_line_are_known() -> None:
    assert ("calibrate", "calibrate") in commands()
    assert ("surrogate", "train") in commands()

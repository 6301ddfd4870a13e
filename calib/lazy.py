"""A package and the modules in which its names are defined in, its `__getattr__` out, which loads each when it is asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module


def on_demand(package: str, modules: Mapping[str, Sequence[str]]) -> Callable[[str], object]:
    """Let a package offer names without loading the modules that define them (PEP 562).

    Parameters
    ----------
    package : its name.
    modules : module, relative to the package with a dot before it, or absolute -> names.

    Returns
    -------
    What the package is to have as `__getattr__`.
    """
    module_of = {name: module for module, names in modules.items() for name in names}

    def load(name: str) -> object:
        if name not in module_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(module_of[name], package), name)

    return load

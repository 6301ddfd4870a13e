"""The results of a calibration in, the sections of its report in their order out; knows no page.

A section is a module in this folder and a template in `calib/report/templates`; it is found here and listed nowhere. The module
has a number `ORDER`, its place among the others, and a function `section(results) -> Section | None`, None where it has nothing
to say. One with pictures also has a function `plots(results) -> Mapping[str, Plot]`: what `results.picture` finds, in any
section.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import replace
from importlib import import_module
from pkgutil import iter_modules
from types import MappingProxyType, ModuleType

from calib.report.pictures import Drawing, Plot
from calib.report.section import Results, Section
from calib.workers import given_to


def section_modules() -> list[ModuleType]:
    """The modules of this folder, in the order of their sections."""
    found = [import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__)]
    return sorted(found, key=lambda module: int(module.ORDER))


def plots_of(results: Results) -> dict[str, Plot]:
    """The plots of all sections, by name, in their order."""
    found: dict[str, Plot] = {}
    for module in section_modules():
        if hasattr(module, "plots"):
            found |= module.plots(results)
    return found


def drawings_of(results: Results, executor: Executor | None = None) -> dict[str, Drawing]:
    """The pictures of all sections, by name.

    Parameters
    ----------
    results : that they show.
    executor : draws them, from now on, beside what goes on here; None to draw each when it is called for.
    """
    found = {name: plot.drawing for name, plot in plots_of(results).items()}
    return found if executor is None else dict(zip(found, given_to(executor, list(found.values())), strict=True))


def sections_of(results: Results, drawings: Mapping[str, Drawing] = MappingProxyType({})) -> list[Section]:
    """Make the sections that have something to say of these results, in their order.

    Parameters
    ----------
    results : what came out.
    drawings : pictures that are not to be drawn here.
    """
    plots = plots_of(results)
    drawn = {name: plot.drawing for name, plot in plots.items()}
    results = replace(results, plots=plots, drawings={**drawn, **drawings})
    made = (module.section(results) for module in section_modules())
    return [section for section in made if section is not None]

"""Every parameter before and after the data."""

from __future__ import annotations

from collections.abc import Mapping

from calib.catalogue import UnknownName, display
from calib.report.figures.posterior import prior_figure
from calib.report.pictures import Plot
from calib.report.rows import PRIOR_DRIVEN_WORDS, few_specimens_in_words, label_of, parameter_rows
from calib.report.section import Results, Section
from calib.sampling import Posterior

ORDER = 35

# Parameters in one picture.
_MOST = 12


def plots(results: Results) -> Mapping[str, Plot]:
    """Every parameter before and after the data."""
    caption = (
        "Blue: what is left after the data, which each panel is zoomed to. Grey: what was assumed, with where 95 % of that "
        "lie. Where the two coincide the data said nothing."
    )
    return {
        name: Plot(f"Prior and posterior density, {name}", caption, prior_figure, (results.posterior, of))
        for name, of in _priors(results.posterior).items()
    }


def _priors(posterior: Posterior) -> dict[str, list[str]]:
    """Pictures of priors, by name, with the parameters in each: what all share, then each specimen; as many as fit a sheet."""
    groups: dict[str, list[str]] = {}
    for p in posterior.parameters:
        groups.setdefault(p.specimen or "material and rig", []).append(p.name)
    found = {}
    for whose, names in groups.items():
        for first in range(0, len(names), _MOST):
            part = f", {1 + first // _MOST}" if len(names) > _MOST else ""
            found[f"priors of {whose}{part}"] = names[first : first + _MOST]
    return found


def section(results: Results) -> Section:
    """Show every parameter before and after the data, in a table and in figures."""
    posterior = results.posterior
    rows = parameter_rows(posterior)
    fixed = posterior.fixed.items()
    context = {
        "rows": rows,
        "void": results.void,
        "of_lots": posterior.experiment.pooling == "partial",
        "few": few_specimens_in_words(posterior),
        "prior_driven": any(r.learned == PRIOR_DRIVEN_WORDS for r in rows),
        "fixed": [(label_of(name), display(UnknownName.parse(name).parameter, value)) for name, value in fixed],
        "prior_pictures": [results.picture(name) for name in _priors(posterior)],
    }
    return Section("parameters", "Parameters", "Parameters", "parameters.html.j2", context)

"""Every parameter before and after the data, and the ridges between them."""

from __future__ import annotations

from collections.abc import Mapping

from calib.catalogue import display
from calib.report.figures.posterior import corner_figure, prior_figure
from calib.report.pictures import Drawing, dense_drawing, drawing
from calib.report.rows import PRIOR_DRIVEN_WORDS, label_of, parameter_rows, told_by_few
from calib.report.section import Results, Section
from calib.sampling import Posterior

ORDER = 20


def drawings(results: Results) -> Mapping[str, Drawing]:
    """Every parameter before and after the data, and pairs of them."""
    posterior = results.posterior
    found = {"pairs": dense_drawing(corner_figure, posterior)}
    return found | {name: drawing(prior_figure, posterior, specimens=of) for name, of in _priors(posterior).items()}


def _priors(posterior: Posterior) -> dict[str, bool]:
    """Pictures of priors, by name: whether they are of parameters of the specimens; else of those that all share."""
    found = {"priors": False, "priors of specimens": True}
    return {name: of for name, of in found.items() if any(bool(p.specimen) == of for p in posterior.parameters)}


def section(results: Results) -> Section:
    """Show every parameter before and after the data, in a table and in figures."""
    posterior = results.posterior
    rows = parameter_rows(posterior)
    context = {
        "rows": rows,
        "of_lots": posterior.experiment.pooling == "partial",
        "few": told_by_few(posterior),
        "prior_driven": any(r.learned == PRIOR_DRIVEN_WORDS for r in rows),
        "fixed": [(label_of(name), display(name.split("[")[0], value)) for name, value in posterior.fixed.items()],
        "prior_pictures": [
            results.picture(
                name,
                f"Prior and posterior density of every parameter of {'the specimens' if of_specimens else 'material and rig'}",
                "Grey: what was assumed. Blue: what is left after the data. Where the two coincide the data said nothing.",
            )
            for name, of_specimens in _priors(posterior).items()
        ],
        "corner_picture": results.picture(
            "pairs",
            "Pairwise posterior of the material parameters and of the thicknesses of the first specimen",
            "Contours hold 50 % and 90 % of the draws. A narrow slanted shape is a ridge: the data know a combination "
            "of the two well, not each of them.",
        ),
    }
    return Section("parameters", "Parameters", "Parameters", "parameters.html.j2", context)

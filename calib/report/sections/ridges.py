"""Which parameters the data know only together: every pair of those that matter."""

from __future__ import annotations

from collections.abc import Mapping

from calib.report.figures.posterior import corner_figure
from calib.report.pictures import Plot
from calib.report.section import Results, Section

ORDER = 67

_TITLE = "Parameters that go together"


def plots(results: Results) -> Mapping[str, Plot]:
    """Pairs of parameters."""
    caption = (
        "Contours hold 50 % and 90 % of the draws. A narrow slanted shape is a ridge: the data know a combination of the two "
        "well, not each of them."
    )
    alt = "Pairwise posterior of the material parameters and of the thicknesses of the first specimen"
    return {"pairs": Plot(alt, caption, corner_figure, (results.posterior,), vector=False)}


def section(results: Results) -> Section:
    """Show ridges."""
    return Section("ridges", _TITLE, "Ridges", "ridges.html.j2", {"picture": results.picture("pairs")}, appendix=True)

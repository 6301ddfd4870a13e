"""Which padding to build next, if that was asked."""

from __future__ import annotations

from collections.abc import Mapping

from calib.decision import Recommendation, percent
from calib.digits import median_and_interval
from calib.report.figures.padding import beside_figure, padding_figure
from calib.report.pictures import Plot
from calib.report.section import PADDING, Results, Section

ORDER = 42


def plots(results: Results) -> Mapping[str, Plot]:
    """The signal over the padding, and what comes with it, if a padding is recommended."""
    r = results.recommendation
    if r is None:
        return {}
    which = "the recommended thickness" if r.conformity is None else "the thickness of the largest signal"
    padding = (
        f"The signal over the padding. Bands hold 50 % and 90 % of the draws. Green: {which} and those that are as good with a "
        "probability of at least 80 %. Hatched: outside what the model covers."
    )
    beside = "What else comes with the thickness; below, zoomed, where single draws of the posterior have their optimum."
    return {
        PADDING: Plot("Capacitance change against padding thickness with its uncertainty", padding, padding_figure, (r,)),
        "beside": Plot(
            "Force resolution, indentation and place of the optimum against padding thickness", beside, beside_figure, (r,)
        ),
    }


def section(results: Results) -> Section | None:
    """Show the recommended padding with its figure; None if none was asked for."""
    r = results.recommendation
    if r is None or results.void:  # the first page says why
        return None
    context = {
        "recommendation": r,
        "stale": results.stale,
        "rows": _rows(r),
        "percent": percent(r.best_probability),
        "pictures": [results.picture(name) for name in (PADDING, "beside") if name != results.signal_picture],
    }
    title = "What padding to build next" if r.conformity is None else "What padding gives the largest signal"
    return Section("padding", title, "Padding", "padding.html.j2", context)


def _rows(r: Recommendation) -> list[tuple[str, str, str]]:
    return [
        ("capacitance change", median_and_interval(r.change_at_best * 100, "%"), f"at {r.requirement.force:g} N"),
        ("indentation", median_and_interval(r.depth_at_best * 1e3, "mm"), "how far the ball sinks in: the softness one feels"),
        (
            "force resolution",
            median_and_interval(r.resolution_at_best * 1e3, "mN"),
            "noise of one capacitance reading over dC/dF",
        ),
    ]

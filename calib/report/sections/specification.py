"""Whether a specification will be met, and by which padding, if that was asked."""

from __future__ import annotations

from collections.abc import Mapping

from calib.decision import Conformity, percent
from calib.report.figures.specification import conformity_figure, front_figure
from calib.report.pictures import Plot
from calib.report.section import CONFORMITY, Results, Section

ORDER = 40


def plots(results: Results) -> Mapping[str, Plot]:
    """Conformity over the padding, and signal against stroke, if there is a specification."""
    c = _conformity(results)
    if c is None:
        return {}
    conformity = (
        "Above: probability that a sensor on such padding conforms, with twice its Monte Carlo error; dashed: the "
        f"{100 * c.specification.probability:g} % asked for; green: thicknesses that conform; hatched: guard bands for what "
        "the gauge does not know. Below: share of draws that miss each limit."
    )
    front = (
        "Signal against stroke, medians, along the padding's thickness; thick where it conforms; dotted: what no other beats "
        "in both."
    )
    return {
        CONFORMITY: Plot(
            "Probability of conformity and missed limits against padding thickness", conformity, conformity_figure, (c,)
        ),
        "front": Plot("Capacitance change against stroke of the sensors that may be built", front, front_figure, (c,)),
    }


def section(results: Results) -> Section | None:
    """Show what of a specification is met; None if none was asked for."""
    r, c = results.recommendation, _conformity(results)
    if r is None or c is None or results.void:  # the first page says why
        return None
    counted = [cause for cause in c.causes if cause.counts]
    context = {
        "conformity": c,
        "stale": results.stale,
        "rows": _rows(c),
        "causes": [(cause.name, f"{100 * cause.share:.0f} %", f"{100 * cause.error:.0f} %") for cause in counted],
        "sensors": _sensors(c),
        "pictures": (results.picture("front"),),
    }
    title = f"Specification{f': {c.specification.name}' if c.specification.name else ''}"
    return Section("specification", title, "Specification", "specification.html.j2", context)


def _conformity(results: Results) -> Conformity | None:
    return None if results.recommendation is None else results.recommendation.conformity


def _rows(c: Conformity) -> list[tuple[str, str, str]]:
    b, k = c.best, c.at_best
    rows = [
        (limit.in_words, percent(float(b.fails[i, k])), percent(float(b.alone[i, k])))
        for i, limit in enumerate(c.specification.limits)
    ]
    return [*rows, ("the load is carried", percent(float(b.not_carried[k])), "")]


def _sensors(c: Conformity) -> list[tuple[str, str, str, str]]:
    """What may be built, each with its best padding."""
    if len(c.built) == 1:
        return []
    rows = []
    for b in c.built:
        if b.left_out:
            rows.append((b.name, "left out", b.left_out, ""))
        else:
            span = "none" if b.interval is None else f"{b.interval[0] * 1e3:.2f} to {b.interval[1] * 1e3:.2f} mm"
            rows.append((b.name, f"{b.best * 1e3:.2f} mm", percent(b.best_probability), span))
    return rows

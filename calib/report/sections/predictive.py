"""The data of every sweep beside what the model says under the posterior, with residuals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from calib.checks import Prediction
from calib.report.figures.predictive import change_figure, channel_figure
from calib.report.pictures import Drawing, Picture, drawing
from calib.report.section import Results, Section

ORDER = 40


def drawings(results: Results) -> Mapping[str, Drawing]:
    """Every channel of every sweep, and the change of capacitance."""
    found = {_name(p, kind): drawing(channel_figure, p, kind) for p in results.predictions for kind in p.channels}
    if any(p.change is not None for p in results.predictions):
        found["change"] = drawing(change_figure, results.predictions)
    return found


def _name(p: Prediction, kind: str) -> str:
    return f"{kind} of {p.specimen}, {p.sweep}"


def section(results: Results) -> Section:
    """Show data and predictions sweep by sweep, in pictures and checks."""
    context = {"sweeps": [_part(results, p) for p in results.predictions], "change": _change_picture(results)}
    return Section("sweeps", "Data and model", "Data and model", "predictive.html.j2", context)


@dataclass(frozen=True)
class SweepPart:
    """One sweep: its pictures, and of each channel name, check in words, and whether that passed."""

    title: str
    pictures: tuple[Picture, ...]
    checks: tuple[tuple[str, str, bool], ...]


def _part(results: Results, p: Prediction) -> SweepPart:
    pictures, checks = [], []
    for kind, channel in p.channels.items():
        caption = f"{p.title}: {kind} as read, and residuals in units of the predicted standard deviation."
        alt = f"{kind} of {p.title}: data, model and residuals"
        pictures.append(results.picture(_name(p, kind), alt, caption))
        checks.append((kind, channel.check.in_words, channel.check.passed))
    return SweepPart(f"{p.title} (ball of {p.indenter_radius * 1e3:g} mm radius)", tuple(pictures), tuple(checks))


def _change_picture(results: Results) -> Picture | None:
    if "change" not in results.drawings:
        return None
    return results.picture(
        "change",
        "Capacitance change against force of all specimens",
        "Capacitance change against true force, freed of load zero and parasitic capacitance. Band: 90 % of the model curve.",
    )

"""The data of every sweep beside what the model says under the posterior, with residuals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from calib.checks import Prediction
from calib.problem import channel_of_block
from calib.report.figures.predictive import change_figure, channel_figure
from calib.report.pictures import Picture, Plot
from calib.report.section import CHANGE, Results, Section

ORDER = 30


def plots(results: Results) -> Mapping[str, Plot]:
    """Every channel of every sweep, and the change of capacitance."""
    found = {_name(p, kind): _channel(p, kind) for p in results.predictions for kind in p.channels}
    if any(p.change is not None for p in results.predictions):
        found[CHANGE] = Plot(
            "Capacitance change against force of all specimens",
            "Capacitance change against true force, freed of load zero and parasitic capacitance. Band: 90 % of the model's "
            "curve.",
            change_figure,
            (results.predictions,),
        )
    return found


def _channel(p: Prediction, kind: str) -> Plot:
    caption = f"{p.title}: {kind} as read, and residuals in units of the predicted standard deviation."
    return Plot(f"{kind} of {p.title}: data, model and residuals", caption, channel_figure, (p, kind))


def _name(p: Prediction, kind: str) -> str:
    return f"{kind} of {p.title}"


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
        pictures.append(results.picture(_name(p, kind)))
        words = ". ".join(filter(None, (channel.check.in_words, _left_out_in_words(results, p, kind))))
        checks.append((kind, words, channel.check.passed))
    return SweepPart(f"{p.title} (ball of {p.indenter_radius * 1e3:g} mm radius)", tuple(pictures), tuple(checks))


def _left_out_in_words(results: Results, p: Prediction, kind: str) -> str:
    """Say how far the parts of a channel are off what all other data foretell; "" where that is not known."""
    posterior = results.posterior
    of_blocks = zip(posterior.blocks, posterior.diagnostics.block_z, strict=False)
    z = np.array([z for name, z in of_blocks if channel_of_block(name) == f"{p.title}, {kind}"])
    known = np.abs(z[np.isfinite(z)])
    if not known.size:
        return ""
    left = f" ({z.size - known.size} of {z.size} could not be)" if known.size < z.size else ""
    return (
        f"Left out and foretold by all other data{left}, its parts are off by {np.max(known):.1f} standard deviations at most"
    )


def _change_picture(results: Results) -> Picture | None:
    """The signal of all specimens; None where there is none, or the first page has it."""
    shown = CHANGE in results.plots and results.signal_picture != CHANGE
    return results.picture(CHANGE) if shown else None

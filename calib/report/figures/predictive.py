"""Predictions of sweeps in, figures of data beside model with residuals out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from calib.catalogue import CHANNELS
from calib.checks import Bands, FitCheck, Prediction
from calib.report.style import BLUE, DASHES, ENSEMBLE_COLOURS, GREY, INK, LIGHT, MARKERS, WIDTH, in_legend, styled_figure


@styled_figure
def channel_figure(prediction: Prediction, channel: str) -> Figure:
    """Draw one channel of a sweep as it was read: data, bands of model and of a new reading, residuals below.

    Parameters
    ----------
    prediction : of the sweep.
    channel : name of the channel; force is drawn over the crosshead, every other one over the load cell.

    Raises
    ------
    ValueError
        If the sweep has no such readings.
    """
    if channel not in prediction.channels:
        raise ValueError(f"{prediction.title} has no {channel} readings")
    fit, row = prediction.channels[channel], CHANNELS[channel]
    across, scale = ("crosshead reading (mm)", 1e3) if channel == "force" else ("load cell reading (N)", 1.0)
    return _channel_figure(fit.bands, fit.check, scale, row.display_scale, across, row.axis)


@styled_figure
def change_figure(predictions: Sequence[Prediction]) -> Figure:
    """Draw capacitance change over force of all sweeps in one picture: data and bands of the model."""
    fig = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    ax = fig.add_subplot()
    shown = [p for p in predictions if p.change is not None]
    for i, p in enumerate(shown):
        colour = ENSEMBLE_COLOURS[i % len(ENSEMBLE_COLOURS)]
        if p.change is not None:
            ax.fill_between(p.change.x, p.change.model[0] * 100, p.change.model[4] * 100, color=colour, alpha=0.25, lw=0)
            dashes = DASHES[i % len(DASHES)]
            ax.plot(p.change.x, p.change.model[2] * 100, color=colour, lw=1.2, ls=dashes, label=in_legend(p.title))
        marker = MARKERS[i % len(MARKERS)]
        ax.plot(p.change_x, p.change_y * 100, ls="", marker=marker, ms=2.6, mfc="white", mec=colour, mew=0.8)
    ax.set_xlabel("force (N)")
    ax.set_ylabel("capacitance change (%)")
    if 1 <= len(shown) <= 8:
        ax.legend(loc="upper left")
    return fig


def _channel_figure(bands: Bands, check: FitCheck, x_scale: float, y_scale: float, x_label: str, y_label: str) -> Figure:
    fig = Figure(figsize=(WIDTH, 3.8), layout="constrained")
    upper, lower = fig.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [3.4, 1]})
    x = bands.x * x_scale
    upper.fill_between(x, bands.reading[0] * y_scale, bands.reading[4] * y_scale, color=LIGHT, lw=0, label="new reading, 90 %")
    upper.fill_between(x, bands.model[0] * y_scale, bands.model[4] * y_scale, color=BLUE, alpha=0.35, lw=0, label="model, 90 %")
    upper.plot(x, bands.model[2] * y_scale, color=BLUE, lw=1.1, label="model, median")
    upper.plot(check.x * x_scale, check.y * y_scale, ls="", marker="o", ms=2.8, mfc="white", mec=INK, mew=0.7, label="data")
    upper.set_ylabel(y_label)
    upper.legend(loc="upper left")
    upper.ticklabel_format(useOffset=False)
    lower.axhspan(-1.645, 1.645, color=LIGHT, alpha=0.6, lw=0)
    lower.axhline(0, color=GREY, lw=0.7)
    lower.plot(check.x * x_scale, check.residual, ls="", marker="o", ms=2.8, color=INK)
    reach = max(3.0, 1.1 * float(np.max(np.abs(check.residual))))
    lower.set_ylim(-reach, reach)
    lower.set_ylabel("residual / sd")
    lower.set_xlabel(x_label)
    fig.align_ylabels([upper, lower])
    return fig

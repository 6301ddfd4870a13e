"""A batch of newcomers in, its figure out: modulus and signal one after the other, against what the lot lets one expect."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from calib.catalogue import QUANTITIES
from calib.decision import DRIFTING, Batch, Inspected
from calib.report.style import BLUE, GREEN, GREY, INK, ORANGE, VERMILION, WIDTH, styled_figure

_COLOURS: Mapping[str, str] = {"green": GREEN, "amber": ORANGE, "red": VERMILION}
_MARKS: Mapping[str, str] = {"green": "o", "amber": "s", "red": "X"}


@styled_figure
def batch_figure(batch: Batch) -> Figure:
    """Draw modulus and signal of each newcomer with its central 90 %, that of the lot's next one, and the trend."""
    shown = [name for name in DRIFTING if any(name in row.estimates for row in batch.rows)]
    fig = Figure(figsize=(WIDTH, 0.5 + 2.3 * max(len(shown), 1)), layout="constrained")
    axes = np.atleast_1d(fig.subplots(max(len(shown), 1), 1, sharex=True))
    for ax, name in zip(axes, shown, strict=False):
        _along(ax, batch, name)
    axes[-1].set_xlabel("specimen, in the order of their files")
    axes[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    if shown:
        axes[0].legend(loc="upper left", bbox_to_anchor=(-0.02, 1.24), ncols=3, borderaxespad=0, columnspacing=1.0)
    return fig


def _along(ax: Axes, batch: Batch, name: str) -> None:
    scale, unit = scaled(name)
    low, middle, high = (value * scale for value in batch.expected.get(name, (np.nan,) * 3))
    ax.axhspan(low, high, color=BLUE, alpha=0.10, lw=0, label="90 % of the lot")
    ax.axhline(middle, color=BLUE, lw=0.8, ls=(0, (4, 3)))
    for light in ("green", "amber", "red"):
        own = [(k, row) for k, row in enumerate(batch.rows, 1) if row.light == light and name in row.estimates]
        if not own:
            continue
        x = np.array([k for k, _ in own])
        mean, ends = _ends([row for _, row in own], name, scale)
        ax.errorbar(x, mean, yerr=np.abs(ends - mean), fmt="none", ecolor=_COLOURS[light], elinewidth=0.8)
        ax.plot(x, mean, _MARKS[light], color=_COLOURS[light], ms=3.2, label=light)
    trend = next((t for t in batch.trends if t.quantity == name and t.drifts), None)
    if trend is not None:
        value = np.median([row.estimates[name][0] for row in batch.usable if name in row.estimates]) * scale
        ax.plot([1, len(batch.rows)], [value * (1 - trend.change / 2), value * (1 + trend.change / 2)], color=INK, lw=1.0)
    ax.set_ylabel(f"{'modulus' if name == 'young_modulus' else f'signal at {batch.force:g} N'} ({unit})")
    ax.margins(x=0.02)
    ax.tick_params(color=GREY)


def _ends(rows: list[Inspected], name: str, scale: float) -> tuple[np.ndarray, np.ndarray]:
    found = np.array([row.estimates[name] for row in rows]) * scale
    return found[:, 0], found[:, 2:].T


def scaled(name: str) -> tuple[float, str]:
    """Factor from SI to the unit that people read a quantity of a batch in, and that unit."""
    if name == "signal":
        return 100.0, "%"
    if name == "stroke":
        return 1e3, "mm"
    return QUANTITIES[name].display_scale, QUANTITIES[name].display_unit

"""The observations of one lab file in, a figure of what was understood of it out."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calib.catalogue import CHANNELS
from calib.lab import Observations
from calib.report.style import BLUE, GREY, ORANGE, VERMILION, styled_figure
from models.sensor import BoolArray, FloatArray

# Points drawn of each kind of rows: a million rows make no better picture than ten thousand.
_DRAWN = 10_000


@styled_figure
def file_figure(obs: Observations) -> Figure:
    """Draw what was understood of a lab file: its channels over each other and over time, coloured by what became of each row.

    Used rows are blue, other loading, unloading and holds have colours of their own, rows without a reading are left out.
    """
    values = {**({} if obs.displacement is None else {"displacement": obs.displacement}), **obs.channels}
    shown = {name: (CHANNELS[name].display_unit, CHANNELS[name].display_scale) for name in obs.channels}
    units = {"displacement": ("mm", 1e3), **shown}
    there = [(name, f"{name} ({units[name][0]})".replace(" ()", ""), units[name][1]) for name in values]
    time = obs.time if obs.time is not None else np.arange(len(obs.reason), dtype=float)
    clock = "time (s)" if obs.time is not None else "row"
    driver = next((c for c in there if c[0] in ("displacement", "force")), None)
    pairs = [(driver, c) for c in there if driver is not None and c is not driver]
    fig = Figure(figsize=(4.6 * (1 + bool(pairs)), 2.5 * max(len(there), len(pairs), 1)), layout="constrained")
    grid = fig.add_gridspec(max(len(there), 1), 1 + bool(pairs))
    spans = np.array_split(np.arange(max(len(there), 1)), max(len(pairs), 1))
    for span, (across, up) in zip(spans, pairs, strict=False):
        ax = fig.add_subplot(grid[int(span[0]) : int(span[-1]) + 1, 0])
        _draw(ax, values[across[0]] * across[2], values[up[0]] * up[2], obs)
        ax.set_xlabel(across[1])
        ax.set_ylabel(up[1])
    above: Axes | None = None
    for row, (name, label, scale) in enumerate(there):
        ax = fig.add_subplot(grid[row, -1], sharex=above)
        _draw(ax, time, values[name] * scale, obs)
        ax.set_ylabel(label)
        above = above or ax
        if row == len(there) - 1:
            ax.set_xlabel(clock)
    handles, labels = fig.axes[0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=5, markerscale=3)
    fig.suptitle(f"{obs.table.path.name}: {obs.table.recognised_as}", fontsize=9.5, fontweight="bold", x=0.01, ha="left")
    return fig


def _draw(ax: Axes, x: FloatArray, y: FloatArray, obs: Observations) -> None:
    branch = np.array(obs.branch, dtype=object)
    kinds: tuple[tuple[str, BoolArray, str], ...] = (
        ("unloading", (branch == "unloading") & ~obs.used, ORANGE),
        ("hold", (branch == "hold") & ~obs.used, VERMILION),
        ("other rows", ~np.isin(branch, ("unloading", "hold")) & ~obs.used, GREY),
        ("used", obs.used, BLUE),
    )
    for label, rows, colour in kinds:
        chosen = np.flatnonzero(rows & np.isfinite(x) & np.isfinite(y))
        if chosen.size:
            chosen = chosen[:: max(1, chosen.size // _DRAWN)]
            ax.plot(x[chosen], y[chosen], ls="", marker=".", ms=2.5, mew=0, color=colour, label=f"{label} ({int(rows.sum())})")

"""A padding recommendation in, its figure out."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calib.decision import INTERVAL_PROBABILITY, Recommendation
from calib.report.style import BLUE, GREEN, GREY, LIGHT, ORANGE, PURPLE, VERMILION, styled_figure
from models.sensor import FloatArray


@styled_figure
def padding_figure(recommendation: Recommendation) -> Figure:
    """Draw capacitance change over padding thickness with its uncertainty, each draw's optimum, resolution and indentation."""
    r = recommendation
    mm = r.thickness * 1e3
    fig = Figure(figsize=(9.4, 5.0), layout="constrained")
    grid = fig.add_gridspec(3, 2, width_ratios=[1.75, 1], height_ratios=[1.0, 3.2, 1.3])
    main = fig.add_subplot(grid[1, 0])
    optimum, probability = fig.add_subplot(grid[0, 0], sharex=main), fig.add_subplot(grid[2, 0], sharex=main)
    right = grid[:, 1].subgridspec(2, 1)
    resolution, depth = fig.add_subplot(right[0], sharex=main), fig.add_subplot(right[1], sharex=main)

    _five_bands(main, mm, r.change * 100, BLUE)
    main.set_ylabel(f"capacitance change at {r.requirement.force:g} N (%)")
    main.set_ylim(bottom=min(0.0, main.get_ylim()[0]))
    if np.isfinite(r.present_change[2]):
        now = r.present_change * 100
        main.errorbar(
            r.present_padding * 1e3,
            now[2],
            yerr=[[now[2] - now[0]], [now[4] - now[2]]],
            fmt="s",
            ms=4.5,
            color=VERMILION,
            lw=1.2,
            label="the measured specimens",
        )
    edges = np.concatenate([[mm[0]], 0.5 * (mm[1:] + mm[:-1]), [mm[-1]]])
    optimum.stairs(np.histogram(r.optimum * 1e3, edges)[0], edges, fill=True, color=BLUE, alpha=0.55, lw=0)
    optimum.set_title("where each draw of the posterior has its optimum")
    optimum.set_yticks([])
    optimum.spines["left"].set_visible(False)
    probability.plot(mm, r.probability * 100, color=GREEN, lw=1.4)
    probability.axhline(INTERVAL_PROBABILITY * 100, color=GREY, lw=0.8, ls=(0, (4, 3)))
    probability.set_ylim(-3, 103)
    probability.set_ylabel(f"within {r.requirement.tolerance * 100:g} %\nof best (%)")
    probability.set_xlabel("padding thickness (mm)")
    millinewton = np.where(np.isfinite(r.resolution), r.resolution, np.nan) * 1e3
    _five_bands(resolution, mm, millinewton, PURPLE)
    if np.any(np.isfinite(millinewton)):
        ceiling = 6 * float(np.nanmin(millinewton[2]))
        resolution.set_ylim(0, min(float(np.nanmax(millinewton[4])) * 1.05, ceiling))
    else:
        resolution.text(0.5, 0.5, "no capacitance noise known", transform=resolution.transAxes, ha="center", color=GREY)
    resolution.set_title("force resolution, one reading (mN)")
    _five_bands(depth, mm, r.depth * 1e3, ORANGE)
    depth.set_title("indentation (mm)")
    depth.set_ylim(bottom=0)
    depth.set_xlabel("padding thickness (mm)")
    for ax in (main, probability, resolution, depth):
        if r.interval is not None and r.interval[1] > r.interval[0]:
            label = f"as good with ≥ {INTERVAL_PROBABILITY * 100:g} %" if ax is main else None
            ax.axvspan(r.interval[0] * 1e3, r.interval[1] * 1e3, color=GREEN, alpha=0.10, lw=0, label=label)
        ax.axvline(r.best * 1e3, color=GREEN, lw=1.2, label=f"recommended: {r.best * 1e3:.2f} mm" if ax is main else None)
        for i, (lo, hi) in enumerate(_runs(edges, ~r.covered)):
            label = "not covered by the model" if ax is main and i == 0 else None
            ax.axvspan(lo, hi, facecolor="#f2f2f2", edgecolor=LIGHT, hatch="///", lw=0, label=label)
    main.legend(loc="best")
    main.set_xlim(mm[0], mm[-1])
    for ax in (main, optimum, resolution):
        ax.tick_params(labelbottom=False)
    return fig


def _five_bands(ax: Axes, x: FloatArray, bands: FloatArray, colour: str) -> None:
    ax.fill_between(x, bands[0], bands[4], color=colour, alpha=0.16, lw=0)
    ax.fill_between(x, bands[1], bands[3], color=colour, alpha=0.30, lw=0)
    ax.plot(x, bands[2], color=colour, lw=1.6)


def _runs(edges: FloatArray, flags: FloatArray | np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[tuple[float, float]]:
    """Intervals between `edges` (n + 1) over which the n `flags` are set without a break."""
    change = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(float(edges[a]), float(edges[b])) for a, b in zip(change[::2], change[1::2], strict=True)]

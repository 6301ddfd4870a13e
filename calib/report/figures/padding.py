"""A padding recommendation in, its figures out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calib.decision import INTERVAL_PROBABILITY, Recommendation
from calib.report.style import BLUE, GREEN, GREY, LIGHT, ORANGE, PURPLE, VERMILION, WIDTH, styled_figure
from models.sensor import FloatArray


@styled_figure
def padding_figure(recommendation: Recommendation) -> Figure:
    """Draw capacitance change over padding thickness with its uncertainty, and how probably a thickness is as good."""
    r = recommendation
    mm = r.thickness * 1e3
    fig = Figure(figsize=(WIDTH, 4.3), layout="constrained")
    main, probability = fig.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [2.6, 1]})
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
    probability.plot(mm, r.probability * 100, color=GREEN, lw=1.4)
    probability.axhline(INTERVAL_PROBABILITY * 100, color=GREY, lw=0.8, ls=(0, (4, 3)))
    probability.set_ylim(-3, 103)
    probability.set_ylabel(f"within {r.requirement.tolerance * 100:g} %\nof best (%)")
    _mark(r, (main, probability))
    # Below the axes: what marks the recommended thickness goes through every height of them.
    fig.legend(*main.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    fig.align_ylabels([main, probability])
    return fig


@styled_figure
def beside_figure(recommendation: Recommendation) -> Figure:
    """Draw what else comes with a padding thickness: force resolution, indentation, and where each draw has its optimum."""
    r = recommendation
    mm = r.thickness * 1e3
    fig = Figure(figsize=(WIDTH, 4.3), layout="constrained")
    resolution, depth, optimum = fig.subplots(3, 1, gridspec_kw={"height_ratios": [1.4, 1.4, 1]})
    depth.sharex(resolution)
    resolution.tick_params(labelbottom=False)
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
    _mark(r, (resolution, depth))
    _optimum(optimum, r)
    return fig


def _optimum(ax: Axes, r: Recommendation) -> None:
    """Where the draws have their optimum, which may be far narrower than the thicknesses that are as good."""
    mm = r.optimum * 1e3
    lo, hi = float(np.quantile(mm, 0.002)), float(np.quantile(mm, 0.998))
    room = max(0.25 * (hi - lo), 0.5 * float(r.thickness[1] - r.thickness[0]) * 1e3)
    edges = np.linspace(lo - room, hi + room, 61)
    ax.stairs(np.histogram(mm, edges)[0], edges, fill=True, color=BLUE, alpha=0.55, lw=0)
    ax.set_xlim(edges[0], edges[-1])
    ax.set_title("optimum of each draw of the posterior (mm)")
    ax.set_yticks([])
    ax.spines["left"].set_visible(False)
    ax.locator_params(axis="x", nbins=5)
    if edges[0] < r.best * 1e3 < edges[-1]:
        ax.axvline(r.best * 1e3, color=GREEN, lw=1.2)


def _mark(r: Recommendation, axes: Sequence[Axes]) -> None:
    """Show in all axes which thickness is recommended, which are as good, and which are not covered."""
    edges = _edges(r)
    for ax in axes:
        first = ax is axes[0]
        if r.interval is not None and r.interval[1] > r.interval[0]:
            label = f"as good with ≥ {INTERVAL_PROBABILITY * 100:g} %" if first else None
            ax.axvspan(r.interval[0] * 1e3, r.interval[1] * 1e3, color=GREEN, alpha=0.10, lw=0, label=label)
        what = "recommended" if r.conformity is None else "largest signal"
        ax.axvline(r.best * 1e3, color=GREEN, lw=1.2, label=f"{what}: {r.best_in_words}" if first else None)
        for i, (lo, hi) in enumerate(_runs(edges, ~r.covered)):
            label = "not covered by the model" if first and i == 0 else None
            ax.axvspan(lo, hi, facecolor="#f2f2f2", edgecolor=LIGHT, hatch="///", lw=0, label=label)
    axes[0].set_xlim(edges[0], edges[-1])
    axes[-1].set_xlabel("padding thickness (mm)")


def _edges(r: Recommendation) -> FloatArray:
    """Thicknesses [mm] halfway between those of the recommendation, and its first and last."""
    mm = r.thickness * 1e3
    return np.concatenate([[mm[0]], 0.5 * (mm[1:] + mm[:-1]), [mm[-1]]])


def _five_bands(ax: Axes, x: FloatArray, bands: FloatArray, colour: str) -> None:
    ax.fill_between(x, bands[0], bands[4], color=colour, alpha=0.16, lw=0)
    ax.fill_between(x, bands[1], bands[3], color=colour, alpha=0.30, lw=0)
    ax.plot(x, bands[2], color=colour, lw=1.6)


def _runs(edges: FloatArray, flags: FloatArray | np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[tuple[float, float]]:
    """Intervals between `edges` (n + 1) over which the n `flags` are set without a break."""
    change = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(float(edges[a]), float(edges[b])) for a, b in zip(change[::2], change[1::2], strict=True)]

"""A conformity to a specification in, its figures out."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calib.decision import Conformity
from calib.report.style import (
    BLUE,
    DASHES,
    ENSEMBLE_COLOURS,
    GREEN,
    GREY,
    INK,
    LIGHT,
    ORANGE,
    VERMILION,
    WIDTH,
    in_legend,
    styled_figure,
)


@styled_figure
def conformity_figure(conformity: Conformity) -> Figure:
    """Draw the probability of conformity over thickness, with tolerance, guard bands, and which limits are missed."""
    c, b = conformity, conformity.best
    mm = c.thickness * 1e3
    fig = Figure(figsize=(WIDTH, 6.6), layout="constrained")
    main, limits = fig.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [1.6, 1]})
    main.fill_between(
        mm, 100 * (b.probability - 2 * b.error), 100 * (b.probability + 2 * b.error), color=BLUE, alpha=0.16, lw=0
    )
    main.plot(mm, 100 * b.probability, color=BLUE, lw=1.6, label="made to this thickness")
    if c.specification.padding_tolerance is not None:
        main.plot(mm, 100 * b.exact, color=INK, lw=0.9, ls=(0, (1, 1.2)), label="exactly this thickness")
    main.axhline(100 * c.specification.probability, color=GREY, lw=0.8, ls=(0, (4, 3)))
    main.set_ylim(-3, 103)
    main.set_ylabel("probability of conformity (%)")
    for ax in (main, limits):
        if not np.all(b.covered):
            across, there = ax.get_xaxis_transform(), ~b.covered
            ax.fill_between(mm, 0, 1, where=there, transform=across, color="#f2f2f2", ec=LIGHT, hatch="///", lw=0)
        ax.axvline(b.best * 1e3, color=GREEN if c.met else VERMILION, lw=1.2)
    if c.drawing is not None:
        begin, end = (x * 1e3 for x in c.drawing.tolerance)
        main.axvspan(begin, end, color=GREEN, alpha=0.10, lw=0, label="conforms")
        if c.drawing.accepted is not None and c.drawing.guard_band > 0:
            first, last = (x * 1e3 for x in c.drawing.accepted)
            for k, (start, stop) in enumerate(((begin, first), (last, end))):
                label = "guard band" if k == 0 else None
                main.axvspan(start, stop, facecolor="none", edgecolor=ORANGE, hatch="////", lw=0, label=label)
    _below(main, -0.06, 2)
    colours = iter(ENSEMBLE_COLOURS * 3)
    for i, (limit, share) in enumerate(zip(c.specification.limits, b.fails, strict=True)):
        dashes = DASHES[i % len(DASHES)]
        limits.plot(mm, 100 * share, color=next(colours), lw=1.2, ls=dashes, label=in_legend(limit.in_words))
    limits.plot(mm, 100 * b.not_carried, color=GREY, lw=2.0, ls=(0, (1, 2)), label="load not carried")
    limits.set_ylim(-3, 103)
    limits.set_ylabel("draws that miss it (%)")
    limits.set_xlabel("nominal padding thickness (mm)")
    limits.set_xlim(mm[0], mm[-1])
    _below(limits, -0.3, 1)
    fig.align_ylabels([main, limits])
    return fig


def _below(ax: Axes, y: float, columns: int) -> None:
    """Put the legend below the axes: there is no corner through which no curve of these may go."""
    ax.legend(loc="upper left", bbox_to_anchor=(-0.02, y), ncols=columns, borderaxespad=0, columnspacing=1.0)


@styled_figure
def front_figure(conformity: Conformity) -> Figure:
    """Draw signal against stroke of all sensors that may be built, and the front of those that none beats in both."""
    c = conformity
    fig = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    ax = fig.subplots()
    colours = iter(ENSEMBLE_COLOURS * 20)
    for i, b in enumerate(c.built):
        if b.left_out:
            continue
        colour, dashes = next(colours), DASHES[i % len(DASHES)]
        stroke, signal = b.stroke[2] * 1e3, b.signal[2] * 100
        conforms = np.nan_to_num(b.probability, nan=-1.0) >= c.specification.probability
        ax.plot(stroke, signal, color=colour, lw=0.9, ls=dashes, alpha=0.7, label=in_legend(b.name))
        ax.plot(np.where(conforms, stroke, np.nan), np.where(conforms, signal, np.nan), color=colour, lw=2.8)
    front = [(c.built[i].stroke[2, k] * 1e3, c.built[i].signal[2, k] * 100) for i, k in c.front]
    if front:
        ax.plot(*zip(*front, strict=True), color=INK, lw=0.8, ls=(0, (1, 1.5)), label="the front")
    best = c.best
    ax.plot(best.stroke[2, c.at_best] * 1e3, best.signal[2, c.at_best] * 100, "o", color=GREEN if c.met else VERMILION, ms=5)
    load = c.specification.largest_force
    ax.set_xlabel(f"stroke at {load:.4g} N (mm)")
    ax.set_ylabel(f"capacitance change at {load:.4g} N (%)")
    ax.legend(loc="best")
    return fig

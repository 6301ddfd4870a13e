"""A posterior in, figures of its draws out: ridges between parameters, traces of the chains, priors beside posteriors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator

from calib.catalogue import QUANTITIES
from calib.digits import interval_text
from calib.report.style import BLUE, ENSEMBLE_COLOURS, FORMULA, GREY, WIDTH, in_formula, styled_figure
from calib.sampling import Posterior, load_arviz
from models.sensor import FloatArray


@styled_figure
def corner_figure(posterior: Posterior) -> Figure:
    """Draw every pair of the shared material parameters and the thicknesses of the first specimen (a corner plot)."""
    load_arviz()  # which corner imports too
    import corner

    wanted = (
        "young_modulus",
        "padding_young_modulus",
        "stiffening",
        "relative_permittivity",
        "electrode_radius",
        "sensor_radius",
        "indenter_radius",
        "displacement_gain",
        "force_gain",
        "capacitance_gain",
        "machine_compliance",
    )
    first = posterior.experiment.specimens[0].name
    thickness = ("sensor_thickness", "padding_thickness", "dielectric_thickness")
    flat = posterior.draws.reshape(-1, len(posterior.parameters))
    columns = [
        i
        for i, p in enumerate(posterior.parameters)
        if ((p.parameter in wanted and not p.specimen) or (p.parameter in thickness and p.specimen == first))
        and np.ptp(flat[:, i]) > 0
    ]
    rows = [QUANTITIES[posterior.parameters[i].parameter] for i in columns]
    shown = flat[:, columns] * np.array([r.display_scale for r in rows])
    n = len(columns)
    size = 1.25 * n + 0.85
    # A matrix of panels is not shown smaller than 640 pixels, or 96 mm on paper: its letters are 13 pixels high there, or 5.5
    # points, however many panels it has.
    letters = 72.0 * 13.0 / 640.0 * size
    margin = 0.14
    fig = Figure(figsize=(size, size))
    if n == 0:
        return fig
    labels = [_axis_label(r.name, "") for r in rows]
    spread = np.quantile(shown, [0.002, 0.998], axis=0)
    pad = 0.05 * np.maximum(spread[1] - spread[0], 1e-12 * np.abs(spread[1]) + 1e-300)
    corner.corner(
        shown,
        fig=fig,
        labels=labels,
        range=list(zip(spread[0] - pad, spread[1] + pad, strict=True)),
        color=BLUE,
        bins=28,
        smooth=1.0,
        smooth1d=None,
        levels=(0.5, 0.9),
        plot_datapoints=False,
        plot_density=False,
        fill_contours=True,
        max_n_ticks=3,
        hist_kwargs={"histtype": "stepfilled", "alpha": 0.35, "color": BLUE},
        label_kwargs={"fontsize": 1.1 * letters, **FORMULA},
        labelpad=0.28,
    )
    fig.subplots_adjust(left=margin, bottom=margin, right=1 - 0.05 / size, top=1 - 0.05 / size)
    for ax in fig.axes:
        ax.grid(False)
        for axis in (ax.xaxis, ax.yaxis) if ax.get_frame_on() else ():
            low, high = sorted(axis.get_view_interval())
            ticks = MaxNLocator(3).tick_values(low, high)
            # Those at the ends would run into those of the next panel.
            axis.set_major_locator(FixedLocator([t for t in ticks if 0.11 < (t - low) / (high - low) < 0.89]))
        ax.tick_params(labelsize=letters)
    return fig


@styled_figure
def trace_figure(posterior: Posterior, names: Sequence[str]) -> Figure:
    """Draw how the chains of some parameters move, and their ranks: all ensembles must look alike.

    Left: median and central 80 % of each ensemble's walkers, step by step; converged ensembles lie over each other and do not
    drift. Right: share of each ensemble's draws in twenty equal slices of the pooled ranks, over its expectation; converged
    ensembles stay near one (Vehtari et al., Bayesian Analysis 16 (2021) 667, rank plots).

    Parameters
    ----------
    posterior : with the draws of every ensemble.
    names : of the parameters, one row each.
    """
    n = len(names)
    height = 0.6 + 1.1 * n
    fig = Figure(figsize=(WIDTH, height))
    # Fixed: to find out what room labels need takes as long as to draw them.
    room = {"left": 0.13, "right": 0.98, "bottom": 0.45 / height, "top": 1 - 0.25 / height, "hspace": 0.75, "wspace": 0.22}
    axes = fig.subplots(n, 2, squeeze=False, gridspec_kw={"width_ratios": [1.7, 1], **room})
    index = [p.name for p in posterior.parameters]
    for row, name in enumerate(names):
        info = posterior.parameters[index.index(name)]
        scale = QUANTITIES[info.parameter].display_scale
        values = posterior.draws[:, :, index.index(name)] * scale
        _trace(axes[row, 0], values, posterior.n_walkers)
        _ranks(axes[row, 1], values)
        axes[row, 0].set_title(_axis_label(info.parameter, info.specimen), fontweight="normal", **FORMULA)
        axes[row, 1].set_title("ranks / expected", fontweight="normal", fontsize=8.5)
    axes[-1, 0].set_xlabel("kept step")
    axes[-1, 1].set_xlabel("pooled rank")
    return fig


@styled_figure
def prior_figure(posterior: Posterior, names: Sequence[str] | None = None) -> Figure:
    """Draw what is left after the data (blue), which each panel is zoomed to, and what was believed before (grey line).

    Parameters
    ----------
    posterior : with its draws.
    names : of the parameters; None for all.
    """
    shown = [i for i, info in enumerate(posterior.parameters) if names is None or info.name in names]
    rows = -(-len(shown) // 2)
    tall = 1.5 * rows + 0.2
    fig = Figure(figsize=(WIDTH, tall))
    # Between the panels there is room for a label that goes beyond either.
    room = {"left": 0.03, "right": 0.97, "bottom": 0.3 / tall, "top": 1 - 0.3 / tall, "hspace": 0.7, "wspace": 0.26}
    axes = np.atleast_1d(np.asarray(fig.subplots(rows, 2, squeeze=False, gridspec_kw=room))).ravel()
    for ax, i in zip(axes, shown, strict=False):
        info = posterior.parameters[i]
        scale = QUANTITIES[info.parameter].display_scale
        draws = posterior.draws[:, :, i].ravel() * scale
        z = np.linspace(-3.2, 3.2, 241)
        x = np.asarray(info.prior.ppf_normal(z), dtype=float) * scale
        dx = np.gradient(x, z)
        inside = dx > 1e-9 * np.max(dx)
        density = np.exp(-0.5 * z[inside] ** 2) / np.sqrt(2 * np.pi) / dx[inside]
        believed = np.asarray(info.prior.ppf_normal(np.array([-1.96, 1.96])), dtype=float) * scale
        lo, hi = np.quantile(draws, [0.001, 0.999])
        room = 0.12 * (hi - lo) if hi > lo else max(1e-3 * abs(lo), 1e-12)
        lo, hi = float(lo - room), float(hi + room)
        height, edges = np.histogram(draws, np.linspace(lo, hi, 46), density=True)
        ax.stairs(height, edges, fill=True, color=BLUE, alpha=0.55, lw=0)
        ax.plot(x[inside], density, color=GREY, lw=1.2)
        ax.set_xlim(lo, hi)
        ax.set_yticks([])
        ax.spines["left"].set_visible(False)
        ax.grid(False)
        _few_ticks(ax, lo, hi)
        ax.set_title(_axis_label(info.parameter, info.specimen), fontsize=8.5, fontweight="normal", pad=14, **FORMULA)
        said = f"prior, 95 %: {interval_text(*(float(end) for end in believed))}"
        ax.text(0.0, 1.03, said, transform=ax.transAxes, fontsize=8.5, color=GREY)
    for ax in axes[len(shown) :]:
        ax.set_axis_off()
    return fig


def _few_ticks(ax: Axes, lo: float, hi: float) -> None:
    """Three ticks with all of their digits or, where these are many, two."""
    ticks = MaxNLocator(3).tick_values(lo, hi)
    longest = max(len(interval_text(float(ticks[0]), float(ticks[-1])).split(" to ")[0]), 4)
    ax.xaxis.set_major_locator(MaxNLocator(3 if longest <= 6 else 2, prune="both" if longest > 8 else None))
    ax.ticklabel_format(axis="x", useOffset=False, style="plain")


def _trace(ax: Axes, values: FloatArray, n_walkers: int) -> None:
    walkers = n_walkers if values.shape[1] >= 2 * n_walkers else 1
    steps = values.shape[1] // walkers
    for i, ensemble in enumerate(values[:, : steps * walkers].reshape(values.shape[0], steps, walkers)):
        colour = ENSEMBLE_COLOURS[i % len(ENSEMBLE_COLOURS)]
        lo, middle, hi = np.quantile(ensemble, [0.1, 0.5, 0.9], axis=1)
        x = np.arange(1, steps + 1)
        if walkers > 1:
            ax.fill_between(x, lo, hi, color=colour, alpha=0.12, lw=0)
        ax.plot(x, middle, color=colour, lw=0.9)
    ax.locator_params(axis="y", nbins=4)


def _ranks(ax: Axes, values: FloatArray, n_slice: int = 20) -> None:
    flat = values.ravel()
    rank = np.argsort(np.argsort(flat, kind="stable"), kind="stable").reshape(values.shape) / flat.size
    edges = np.linspace(0, 1, n_slice + 1)
    for i, row in enumerate(rank):
        count = np.histogram(row, edges)[0] * n_slice / row.size
        ax.stairs(count, edges, color=ENSEMBLE_COLOURS[i % len(ENSEMBLE_COLOURS)], lw=1.0, baseline=None)
    ax.axhline(1, color=GREY, lw=0.7)
    ax.set_ylim(bottom=0)
    ax.locator_params(axis="y", nbins=4)


def _axis_label(parameter: str, specimen: str) -> str:
    row = QUANTITIES[parameter]
    base, _, index = row.symbol.partition("_")
    symbol = f"${base}_{{{index}}}$" if index else f"${base}$"
    unit = f" ({row.display_unit})" if row.display_unit else ""
    return f"{symbol}{unit}, {in_formula(specimen)}" if specimen else f"{symbol}{unit}"

"""Posterior, predictions and recommendation in, matplotlib figures of one quiet style out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from calib.checks.predictive import Bands, Check, Prediction
from calib.decision import INTERVAL_PROBABILITY, Recommendation
from calib.report.style import BLUE, ENSEMBLE_COLOURS, GREEN, GREY, INK, LIGHT, ORANGE, PURPLE, VERMILION, styled_figure
from calib.sampling.posterior import Posterior
from models.sensor import PARAMETERS, FloatArray


@styled_figure
def force_figure(prediction: Prediction) -> Figure:
    """Force against crosshead reading as read: data, bands of model and of a new reading, residuals below.

    Raises
    ------
    ValueError
        If the sweep has no force readings.
    """
    if prediction.force is None:
        raise ValueError(f"{prediction.title} has no force readings")
    return _channel_figure(
        prediction.force.bands, prediction.force.check, 1e3, 1.0, "crosshead reading (mm)", "load cell reading (N)"
    )


@styled_figure
def capacitance_figure(prediction: Prediction) -> Figure:
    """Capacitance against load cell reading: data, bands of model and of a new reading, residuals below.

    Raises
    ------
    ValueError
        If the sweep has no capacitance readings.
    """
    if prediction.capacitance is None:
        raise ValueError(f"{prediction.title} has no capacitance readings")
    channel = prediction.capacitance
    return _channel_figure(channel.bands, channel.check, 1.0, 1e12, "load cell reading (N)", "LCR reading (pF)")


@styled_figure
def change_figure(predictions: Sequence[Prediction]) -> Figure:
    """Capacitance change against force of all sweeps in one picture: data and bands of the model."""
    fig = Figure(figsize=(6.2, 3.6), layout="constrained")
    ax = fig.add_subplot()
    shown = [p for p in predictions if p.change is not None]
    for i, p in enumerate(shown):
        colour = ENSEMBLE_COLOURS[i % len(ENSEMBLE_COLOURS)]
        if p.change is not None:
            ax.fill_between(p.change.x, p.change.model[0] * 100, p.change.model[4] * 100, color=colour, alpha=0.25, lw=0)
            ax.plot(p.change.x, p.change.model[2] * 100, color=colour, lw=1.2, label=p.title)
        ax.plot(p.change_x, p.change_y * 100, ls="", marker="o", ms=2.6, mfc="white", mec=colour, mew=0.8)
    ax.set_xlabel("force (N)")
    ax.set_ylabel("capacitance change (%)")
    if 1 <= len(shown) <= 8:
        ax.legend(loc="upper left")
    return fig


@styled_figure
def corner_figure(posterior: Posterior) -> Figure:
    """Corner plot of the shared material parameters and the thicknesses of the first specimen."""
    import corner

    wanted = (
        "young_modulus",
        "padding_young_modulus",
        "stiffening",
        "relative_permittivity",
        "electrode_radius",
        "machine_compliance",
    )
    first = posterior.experiment.specimens[0].name
    thickness = ("sensor_thickness", "padding_thickness", "dielectric_thickness")
    flat = posterior.draws.reshape(-1, len(posterior.parameters))
    columns = [
        i
        for i, p in enumerate(posterior.parameters)
        if (p.parameter in wanted or (p.parameter in thickness and p.specimen == first)) and np.ptp(flat[:, i]) > 0
    ]
    rows = [PARAMETERS[posterior.parameters[i].parameter] for i in columns]
    shown = flat[:, columns] * np.array([r.display_scale for r in rows])
    n = len(columns)
    fig = Figure(figsize=(1.25 * n + 1.2, 1.25 * n + 1.2))
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
        label_kwargs={"fontsize": 9},
        labelpad=0.1,
    )
    fig.subplots_adjust(left=0.14, bottom=0.14, right=0.99, top=0.99)
    for ax in fig.axes:
        ax.grid(False)
        ax.tick_params(labelsize=7.5)
    return fig


@styled_figure
def trace_figure(posterior: Posterior, names: Sequence[str]) -> Figure:
    """Trace and rank plots of some parameters: every ensemble must tell the same story.

    Left: median and central 80 % of each ensemble's walkers, step by step; converged ensembles lie over each other and do not
    drift. Right: share of each ensemble's draws in twenty equal slices of the pooled ranks, over its expectation; converged
    ensembles stay near one (Vehtari et al., Bayesian Analysis 16 (2021) 667, rank plots).
    """
    n = len(names)
    fig = Figure(figsize=(7.6, 0.35 + 1.15 * n), layout="constrained")
    axes = fig.subplots(n, 2, squeeze=False, gridspec_kw={"width_ratios": [2.2, 1]})
    index = [p.name for p in posterior.parameters]
    for row, name in enumerate(names):
        info = posterior.parameters[index.index(name)]
        scale = PARAMETERS[info.parameter].display_scale
        values = posterior.draws[:, :, index.index(name)] * scale
        _trace(axes[row, 0], values, posterior.n_walkers)
        _ranks(axes[row, 1], values)
        axes[row, 0].set_ylabel(_axis_label(info.parameter, info.specimen))
    axes[0, 0].set_title("trace")
    axes[0, 1].set_title("ranks / expected")
    axes[-1, 0].set_xlabel("kept step")
    axes[-1, 1].set_xlabel("pooled rank")
    return fig


@styled_figure
def prior_figure(posterior: Posterior) -> Figure:
    """Prior (grey line) against posterior (blue) of every parameter."""
    n = len(posterior.parameters)
    columns = min(4, n)
    rows = -(-n // columns)
    fig = Figure(figsize=(9.4, 1.55 * rows + 0.2), layout="constrained")
    axes = np.atleast_1d(np.asarray(fig.subplots(rows, columns, squeeze=False))).ravel()
    for ax, info, i in zip(axes, posterior.parameters, range(n), strict=False):
        scale = PARAMETERS[info.parameter].display_scale
        draws = posterior.draws[:, :, i].ravel() * scale
        z = np.linspace(-3.2, 3.2, 241)
        x = np.asarray(info.prior.ppf_normal(z), dtype=float) * scale
        dx = np.gradient(x, z)
        inside = dx > 1e-9 * np.max(dx)
        density = np.exp(-0.5 * z[inside] ** 2) / np.sqrt(2 * np.pi) / dx[inside]
        lo, hi = np.asarray(info.prior.ppf_normal(np.array([-1.96, 1.96])), dtype=float) * scale
        tails = np.quantile(draws, [0.001, 0.999])
        lo, hi = min(lo, tails[0]), max(hi, tails[1])
        height, edges = np.histogram(draws, np.linspace(lo, hi, 61), density=True)
        ax.stairs(height, edges, fill=True, color=BLUE, alpha=0.55, lw=0)
        ax.plot(x[inside], density, color=GREY, lw=1.2)
        ax.set_xlim(lo, hi)
        ax.set_yticks([])
        ax.spines["left"].set_visible(False)
        ax.grid(False)
        ax.locator_params(axis="x", nbins=4)
        ax.set_title(_axis_label(info.parameter, info.specimen), fontsize=8.5, fontweight="normal")
    for ax in axes[n:]:
        ax.set_axis_off()
    return fig


@styled_figure
def padding_figure(recommendation: Recommendation) -> Figure:
    """Capacitance change against padding thickness with its uncertainty, where each draw's optimum lies, resolution, depth."""
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


def _channel_figure(bands: Bands, check: Check, x_scale: float, y_scale: float, x_label: str, y_label: str) -> Figure:
    fig = Figure(figsize=(4.9, 4.0), layout="constrained")
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


def _five_bands(ax: Axes, x: FloatArray, bands: FloatArray, colour: str) -> None:
    ax.fill_between(x, bands[0], bands[4], color=colour, alpha=0.16, lw=0)
    ax.fill_between(x, bands[1], bands[3], color=colour, alpha=0.30, lw=0)
    ax.plot(x, bands[2], color=colour, lw=1.6)


def _runs(edges: FloatArray, flags: FloatArray | np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[tuple[float, float]]:
    """Intervals between `edges` (n + 1) over which the n `flags` are set without a break."""
    change = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return [(float(edges[a]), float(edges[b])) for a, b in zip(change[::2], change[1::2], strict=True)]


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
    row = PARAMETERS[parameter]
    base, _, index = row.symbol.partition("_")
    symbol = f"${base}_{{{index}}}$" if index else f"${base}$"
    unit = f" ({row.display_unit})" if row.display_unit else ""
    return f"{symbol}{unit}, {specimen}" if specimen else f"{symbol}{unit}"

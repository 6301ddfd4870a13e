"""Loading curves of two runs in, one figure with all of them over each other out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from calib.checks import Loading
from calib.report.style import BLUE, VERMILION, WIDTH, in_legend, styled_figure

_STYLES = ("-", (0, (5, 2)), (0, (1, 1.4)), (0, (5, 1.5, 1, 1.5)))


@styled_figure
def difference_figure(loadings: Sequence[Loading]) -> Figure:
    """Draw what specimens of two runs do under force: indentation and capacitance change, medians and 90 % bands.

    A colour for each run, a line for each of its specimens.
    """
    fig = Figure(figsize=(WIDTH, 5.4), layout="constrained")
    depth, change = fig.subplots(2, 1, sharex=True)
    runs = list(dict.fromkeys(loading.run for loading in loadings))
    lines = dict.fromkeys(runs, 0)
    for found in loadings:
        colour = (BLUE, VERMILION)[runs.index(found.run) % 2]
        style = _STYLES[lines[found.run] % len(_STYLES)]
        lines[found.run] += 1
        label = in_legend(f"{found.run}: {found.specimen}")
        for ax, bands, scale in ((depth, found.depth, 1e3), (change, found.change, 1e2)):
            if np.any(np.isfinite(bands)):
                ax.fill_between(found.force, bands[0] * scale, bands[4] * scale, color=colour, alpha=0.18, lw=0)
                ax.plot(found.force, bands[2] * scale, color=colour, lw=1.2, ls=style, label=label)
    depth.set_ylabel("indentation (mm)")
    change.set_ylabel("capacitance change (%)")
    change.set_xlabel("force (N)")
    if len(loadings) <= 8:
        depth.legend(loc="best")
    return fig

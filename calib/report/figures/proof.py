"""A proof by simulation in, its figure out: how far ranks stray from uniform, and how many intervals hold the truth."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from calib.catalogue import UnknownName, unknowns_of
from calib.checks import LIKELIHOOD, Proof, rank_band, rank_points, rank_shares
from calib.report.style import BLUE, GREEN, GREY, LIGHT, ORANGE, PURPLE, SKY, VERMILION, WIDTH, styled_figure

_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY)

#: Probability with which ranks of a sound calibration stay within the band that is drawn, everywhere at once.
LEVEL = 0.99


@styled_figure
def proof_figure(proof: Proof) -> Figure:
    """Draw the ranks of truths, as the share below each less what is uniform, beside the band, and coverage with its error.

    Numbers of the material are drawn in colours, and every quantity that strays; the others in grey.
    """
    tested = proof.tested
    heights = (3.4, 0.5 + 0.17 * len(tested))
    fig = Figure(figsize=(WIDTH, sum(heights)), layout="constrained")
    # Names beside the lower axes, however long, take nothing of the width of the upper ones.
    grid = fig.add_gridspec(2, 1, height_ratios=heights)
    above, below = (fig.add_subfigure(grid[row]) for row in (0, 1))
    ranks, cover = above.subplots(), below.subplots()
    at = rank_points()
    low, high = rank_band(len(proof.counted), LEVEL)
    ranks.fill_between(at, low - at, high - at, color=LIGHT, lw=0, label=f"{LEVEL * 100:g} % of sound ones stay inside")
    colours = iter(_COLOURS)
    for t in tested:
        material = t.name != LIKELIHOOD and UnknownName.parse(t.name).parameter in unknowns_of("material")
        colour = VERMILION if proof.strays(t) else next(colours, GREY) if material else GREY
        shown = colour != GREY
        ranks.step(
            at,
            rank_shares(proof.ranks(t.name)) - at,
            where="mid",
            color=colour,
            lw=1.4 if shown else 0.6,
            zorder=3 if shown else 2,
            label=t.name if shown else None,
        )
    ranks.axhline(0.0, color=GREY, lw=0.7)
    ranks.set_xlim(0, 1)
    ranks.set_xlabel("rank of the truth in its posterior")
    ranks.set_title(f"ranks of {len(proof.counted)} truths, less what is uniform")
    above.legend(loc="outside lower center", fontsize=6, ncols=2)
    rows = np.arange(len(tested))[::-1]
    for row, t in zip(rows, tested, strict=True):
        colour = VERMILION if t.interval[1] < 0.9 or t.interval[0] > 0.9 else BLUE
        cover.plot([100 * t.interval[0], 100 * t.interval[1]], [row, row], color=colour, lw=1.4)
        cover.plot(100 * t.covered, row, "o", ms=3, color=colour)
    cover.axvline(90, color=GREY, lw=0.8, ls=(0, (4, 3)))
    cover.set_yticks(rows, [t.name for t in tested], fontsize=6.5)
    cover.set_ylim(-0.7, len(tested) - 0.3)
    cover.set_title("90 % intervals that hold it (%)")
    return fig

"""Draw what the shipped surrogate covers: `python benchmarks/surrogate_range.py docs/surrogate_range.png`.

Left: which thicknesses of sensor and padding are inside, for three discs. Right: how deep it goes, as a share of the stack.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from calib.report.style import BLUE, FORMULA, GREEN, INK, LIGHT, ORANGE, SKY, VERMILION, styled_figure
from models.sensor import design_from
from models.surrogate.domain import inside
from models.surrogate.surrogate import load_surrogate

#: A sensor of 1 mm under a ball of 5 mm on a wide disc, over padding of these moduli.
RATIOS = {0.05: SKY, 0.25: BLUE, 1.0: INK, 4.0: ORANGE, 20.0: VERMILION}


@styled_figure
def draw() -> Figure:
    """The two panels."""
    figure = Figure(figsize=(8.2, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    h_s, h_p = np.geomspace(4e-3, 6, 400), np.geomspace(2e-3, 20, 400)
    one, two = np.meshgrid(h_s, h_p, indexing="ij")
    for a, colour, width in ((4.0, BLUE, 3.5), (20.0, GREEN, 2.2), (1.0, VERMILION, 1.4)):
        rest = [np.full(one.size, v) for v in (a, 1.0, 0.3, 1.0)]
        covered = inside(np.stack([one.ravel(), two.ravel(), *rest], axis=1)).reshape(one.shape).astype(float)
        left.contour(h_s, h_p, covered.T, levels=[0.5], colors=colour, linewidths=width)
        left.plot([], [], color=colour, linewidth=width, label=f"a/R = {a:g}")
    left.plot(0.148, 0.22, "o", color=INK, markersize=4)
    left.annotate("the paper's sensor", (0.148, 0.22), (6, 4), textcoords="offset points")
    left.set(xscale="log", yscale="log", title="Designs")
    left.set_xlabel("sensor over ball, $h_s/R$", **FORMULA)
    left.set_ylabel("padding over ball, $h_p/R$", **FORMULA)
    left.legend(loc="upper left", handlelength=1.0, borderaxespad=0)

    surrogate = load_surrogate()
    padding = np.linspace(0, 10e-3, 201)
    for ratio, colour in RATIOS.items():
        design = design_from(
            {
                "indenter_radius": 5e-3,
                "sensor_thickness": 1e-3,
                "sensor_radius": 15e-3,
                "young_modulus": 0.6e6,
                "padding_young_modulus": ratio * 0.6e6,
                "relative_permittivity": 2.8,
                "padding_thickness": padding,
            }
        )
        depth = surrogate.max_depth(design)
        right.plot(padding * 1e3, depth * 1e3, color=colour, label=f"$E_p/E$ = {ratio:g}")
    right.axhline(2.5, color=LIGHT, zorder=0)
    right.annotate("half the ball's radius", (10, 2.5), (0, 3), textcoords="offset points", ha="right")
    right.set(ylabel="largest indentation (mm)", ylim=(0, 2.75))
    right.set_xlabel("padding $h_p$ (mm)", **FORMULA)
    right.set_title("Depth: $R$ 5, $h_s$ 1, $a$ 15 mm", **FORMULA)
    for text in right.legend(loc="center right", bbox_to_anchor=(1, 0.53)).get_texts():
        text.set_parse_math(True)
    return figure


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("picture", type=Path, help="file to write, PNG")
    draw().savefig(parser.parse_args().picture, dpi=150)

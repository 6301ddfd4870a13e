"""The house style of figures: colours, and a decorator that draws in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from types import MappingProxyType
from typing import Any, ParamSpec

from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.text import Text

from calib.visible import visible

# Okabe and Ito's colours, distinct for all common kinds of colour vision.
BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7", "#56B4E9"
ENSEMBLE_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, VERMILION, SKY)
#: What tells lines and points apart beside their colours, for who does not see these.
DASHES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 2, 1.5, 2)), (0, (9, 3)))
MARKERS = ("o", "s", "^", "D", "v")
INK, GREY, LIGHT = "#222222", "#7a7a7a", "#d9d9d9"

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9,
    "axes.labelcolor": INK,
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#ececec",
    "grid.linewidth": 0.7,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.hashsalt": "calib",
    # Names of specimens and files are texts, whatever dollar signs stand in them. What is a formula says so: `FORMULA`.
    "text.parse_math": False,
}

#: How a label that is a formula is set: ax.set_ylabel("$E_p$", **FORMULA); a name in it goes through `in_formula`.
FORMULA: Mapping[str, Any] = MappingProxyType({"parse_math": True})

#: How wide a figure is drawn [inch]: as wide as a phone shows it, its letters are nine pixels high there.
WIDTH = 4.6

# Characters of a line of a figure that are shown, and of a name in a legend.
_LONGEST_LINE, _LONGEST_NAME = 120, 40

_P = ParamSpec("_P")


def styled_figure(draw: Callable[_P, Figure]) -> Callable[_P, Figure]:
    """Decorate a drawing function: it draws in the house style and leaves matplotlib's settings as they were.

    In its texts nothing but what says so is a formula, control characters are written out, and long lines are cut.
    """

    @wraps(draw)
    def drawn(*args: _P.args, **kwargs: _P.kwargs) -> Figure:
        with rc_context(_STYLE):
            figure = draw(*args, **kwargs)
        for text in figure.findobj(Text):
            text.set_text("\n".join(_cut(visible(line), _LONGEST_LINE) for line in text.get_text().split("\n")))
        return figure

    return drawn


def in_legend(name: str) -> str:
    """A name as the label of a line, so that it stands in the legend: not too long, and with no underscore in front."""
    return _cut(f" {name}" if name.startswith("_") else name, _LONGEST_NAME)


def in_formula(name: str) -> str:
    """A name beside a formula, as it is written: its dollar signs begin none."""
    return _cut(name, _LONGEST_NAME).replace("$", r"\$")


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}…"

"""Figures in, pictures out: as files, or as data addresses for a page that needs no other file."""

from __future__ import annotations

import base64
import io
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from matplotlib import rc_context
from matplotlib.figure import Figure

from calib.errors import Fault, InputError
from calib.files import whole_file


@dataclass(frozen=True)
class Picture:
    """A figure in a page.

    Attributes
    ----------
    source : its data address.
    alt : what it shows, for readers who cannot see it.
    caption : what stands under it.
    """

    source: str
    alt: str
    caption: str


def picture(figure: Figure, alt: str, caption: str, *, vector: bool = True) -> Picture:
    """Make a figure part of a page.

    Parameters
    ----------
    figure : as drawn.
    alt : what it shows, for who cannot see it.
    caption : what stands under it.
    vector : whether as SVG; else as PNG, for figures of many points.

    Returns
    -------
    Picture
        The same figure gives the same bytes.
    """
    return Picture(figure_address(figure, vector=vector), alt, caption)


def figure_address(figure: Figure, *, vector: bool = True) -> str:
    """Turn a figure into a data address for <img>.

    Parameters
    ----------
    figure : as drawn.
    vector : whether as SVG; else as PNG at 150 dpi.

    Returns
    -------
    str
        The same figure gives the same bytes.
    """
    buffer = io.BytesIO()
    with rc_context({"svg.hashsalt": "calib"}), any_letters():
        if vector:
            figure.savefig(buffer, format="svg", metadata={"Date": None})
        else:
            figure.savefig(buffer, format="png", dpi=150, metadata={"Software": None}, bbox_inches="tight", pad_inches=0.05)
    kind = "svg+xml" if vector else "png"
    return f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode('ascii')}"


def write_figure(figure: Figure, path: Path) -> None:
    """Write a figure to a file, whole or not at all.

    Parameters
    ----------
    figure : as drawn; 250 dpi if it becomes a PNG.
    path : ends in .png, .pdf or .svg.

    Raises
    ------
    InputError
        If the name ends in something else, or its folder does not exist.
    """
    if path.suffix not in (".png", ".pdf", ".svg"):
        raise InputError(Fault("the name of a picture ends in .png, .pdf or .svg", path, advice="Choose another"))
    with whole_file(path) as whole, any_letters():
        figure.savefig(whole, dpi=250)


@contextmanager
def any_letters() -> Iterator[None]:
    """Draw a box in silence where the font lacks a character of somebody's name; the page beside it has it."""
    log = logging.getLogger("matplotlib.mathtext")
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing from")
        log.addFilter(_no_missing_glyph)
        try:
            yield
        finally:
            log.removeFilter(_no_missing_glyph)


def _no_missing_glyph(record: logging.LogRecord) -> bool:
    return "does not have a glyph" not in str(record.msg)

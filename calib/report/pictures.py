"""Figures in, pictures out: as files, or as data addresses for a page that needs no other file."""

from __future__ import annotations

import base64
import io
import logging
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from html import unescape
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from calib.errors import Fault, InputError
from calib.files import whole_file

# Ending of a file -> what is left out of it that would differ from one time to the next.
_UNDATED: Mapping[str, dict[str, None]] = {".png": {"Software": None}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}


@dataclass(frozen=True)
class Picture:
    """A figure in a page.

    Attributes
    ----------
    name : by which the page knows it.
    source : its data address.
    alt : what it shows, for readers who cannot see it.
    caption : what stands under it.
    """

    name: str
    source: str
    alt: str
    caption: str


#: A picture that is still to be drawn: gives its data address. A worker can be sent it.
Drawing = Callable[[], str]


@dataclass(frozen=True, eq=False)
class Plot:
    """A figure that can be drawn, with what is said of it wherever it is shown.

    Attributes
    ----------
    alt : what it shows, for readers who cannot see it.
    caption : what stands under it.
    draw, args, kwargs : what draws it, and of what.
    vector : whether it is lines and letters in a page; of many points it is a grid of pixels there.
    """

    alt: str
    caption: str
    draw: Callable[..., Figure]
    args: tuple[Any, ...] = ()
    kwargs: Mapping[str, Any] = field(default_factory=dict)
    vector: bool = True

    @property
    def drawing(self) -> Drawing:
        """It as part of a page, still to be drawn."""
        return partial(_drawn, self.draw, self.args, self.kwargs, self.vector)

    def figure(self) -> Figure:
        """Draw it."""
        return self.draw(*self.args, **self.kwargs)


def pictures_in(page: str) -> dict[str, Drawing]:
    """The pictures of a page that was written before, by name."""
    found = re.findall(r'<img src="(data:[^"]*)" alt="[^"]*" data-name="([^"]*)"', page)
    return {unescape(name): partial(str, address) for address, name in found}


def _drawn(draw: Callable[..., Figure], args: tuple[Any, ...], kwargs: Mapping[str, Any], vector: bool) -> str:
    return figure_address(draw(*args, **kwargs), vector=vector)


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
            figure.savefig(buffer, format="png", dpi=150, metadata={"Software": None})
    kind = "svg+xml" if vector else "png"
    return f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode('ascii')}"


def write_figure(figure: Figure, path: Path) -> None:
    """Write a figure to a file, whole or not at all; its letters go with it, and the same figure gives the same bytes.

    Parameters
    ----------
    figure : as drawn; 250 dpi if it becomes a PNG.
    path : ends in .png, .pdf or .svg.

    Raises
    ------
    InputError
        If the name ends in something else, or its folder does not exist.
    """
    if path.suffix not in _UNDATED:
        raise InputError(Fault("the name of a picture ends in .png, .pdf or .svg", path, advice="Choose another"))
    # Letters as TrueType outlines, which publishers take (Type 3 they do not), or as paths.
    embedded = rc_context({"svg.hashsalt": "calib", "pdf.fonttype": 42, "svg.fonttype": "path"})
    with whole_file(path) as whole, embedded, any_letters():
        figure.savefig(whole, dpi=250, metadata=_UNDATED[path.suffix])


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

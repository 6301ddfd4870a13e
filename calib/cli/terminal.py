"""Texts and tables in, what a terminal shows of them out: nothing that somebody else wrote moves its cursor or renames it."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from io import TextIOWrapper

import rich.console
from rich.console import ConsoleOptions, RenderableType
from rich.segment import Segment

from calib.visible import visible


class Console(rich.console.Console):
    """A console that writes control characters out, whatever text they come in; its own colours and progress stay."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render as Rich does, in parts of which those with text have their control characters written out.

        Parameters
        ----------
        renderable, options : see `rich.console.Console.render`.
        """
        for segment in super().render(renderable, options):
            yield segment if segment.control else Segment(visible(segment.text), segment.style)


@contextmanager
def every_character() -> Iterator[None]:
    """Let a character that the terminal's encoding lacks be written out, not end the command."""
    streams = [stream for stream in (sys.stdout, sys.stderr) if isinstance(stream, TextIOWrapper)]
    before = [stream.errors for stream in streams]
    for stream in streams:
        stream.reconfigure(errors="backslashreplace")
    try:
        yield
    finally:
        for stream, errors in zip(streams, before, strict=True):
            stream.reconfigure(errors=errors)

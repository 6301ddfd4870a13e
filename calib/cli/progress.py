"""How far a calibration is in, a line on the terminal out: which stage of how many, what is known, and how long it may last."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from calib.cli.common import err

if TYPE_CHECKING:
    from rich.progress import Progress as Bar
    from rich.progress import TaskID

    from calib.sampling import FirstAnswer, Progress

#: Rows of a first answer that are shown before sampling.
_SHOWN_ROWS = 12


@dataclass(frozen=True, eq=False)
class Line:
    """A line of progress on stderr, if that is a terminal: `bar` shows `task`; `stages` are all that there are, in order."""

    bar: Bar
    task: TaskID
    stages: tuple[str, ...]

    def stage(self, name: str) -> None:
        """Say which stage begins."""
        self.bar.update(self.task, completed=0, total=None, description=self._words(name))

    @contextmanager
    def sampling(self) -> Iterator[Callable[[Progress], None]]:
        """Show sampling; gives the function to be told of its progress."""
        self.stage("start")
        yield self.show

    def show(self, p: Progress) -> None:
        """Show how far sampling is."""
        self.bar.update(
            self.task, description=f"{self._words(p.stage)}{progress_in_words(p)}", completed=p.done, total=p.wanted
        )

    def first_answer(self, first: FirstAnswer | None) -> None:
        """Show a first answer above the line: what the sensor is, without rig and noise."""
        if first is not None:
            lines = first_answer_lines(first, sensor_only=True)
            more = f"  and {len(lines) - _SHOWN_ROWS} more" if len(lines) > _SHOWN_ROWS else ""
            console = self.bar.console
            for text in ("First answer, not the result:", *lines[:_SHOWN_ROWS], *([more] if more else [])):
                console.print(text, markup=False, soft_wrap=True)

    def _words(self, name: str) -> str:
        return f"{self.stages.index(name) + 1}/{len(self.stages)} {name}"


def progress_in_words(p: Progress) -> str:
    """What is known of sampling, to follow the name of its stage: what is done, how long it may last, what is reached."""
    if p.stage == "start":
        return f": {p.done} of {p.wanted} done"
    if p.stage != "sampling":
        return ""
    words = f": {p.steps} steps"
    if math.isfinite(p.seconds_left) and p.seconds_left > 0:
        words += f", {'about' if p.ess > 0 else 'at least'} {_duration(p.seconds_left)} of it left"
    if p.ess > 0:
        words += f", R-hat {p.r_hat:.3f} ({p.r_hat_parameter})"
        words += f", effective draws {p.ess:.0f} of {p.target:.0f} ({p.ess_parameter})"
    return words


@contextmanager
def progress_line(stages: tuple[str, ...]) -> Iterator[Line]:
    """A line of progress on stderr, if that is a terminal.

    Parameters
    ----------
    stages : all that there are, in order.
    """
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    console = err()
    columns = (BarColumn(bar_width=20), TimeElapsedColumn(), TextColumn("{task.description}", markup=False))
    with Bar(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        yield Line(bar, bar.add_task("", total=None), stages)


def first_answer_lines(first: FirstAnswer, *, sensor_only: bool = False) -> list[str]:
    """Lines of a first answer, each of which says that it is one.

    Parameters
    ----------
    first : the answer.
    sensor_only : whether to leave out what is of the rig and of the noise.
    """
    from calib.report import first_rows

    rows = first_rows(first, sensor_only=sensor_only)
    width = max((len(row.name) for row in rows), default=0)
    rough = ", rough" if first.rough else ""
    return [f"  {row.name:<{width}}  about {row.value} {row.unit}".rstrip() + f"  (first answer{rough})" for row in rows]


def _duration(seconds: float) -> str:
    """A time in words, as exact as an estimate deserves.

    >>> _duration(3.2), _duration(47.0), _duration(130.0), _duration(9000.0)
    ('5 s', '50 s', '2 min', '2.5 h')
    """
    if seconds < 90:
        return f"{max(5, round(seconds / 5) * 5 if seconds < 30 else round(seconds / 10) * 10)} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"

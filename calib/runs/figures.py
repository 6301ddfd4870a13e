"""A run in, every figure of its report as a file for a paper out, with what is said of each."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from itertools import count
from pathlib import Path
from typing import Literal, get_args

from calib.checks import Verdict
from calib.decision import Recommendation
from calib.errors import Fault, InputError
from calib.files import naming, require_folder, write_text
from calib.report import plots_of_report, status_in_words, write_figure
from calib.runs.folder import Run, load_recommendation
from calib.visible import visible

Format = Literal["pdf", "svg", "png"]

#: The list of the figures, beside them.
CAPTIONS = "captions.md"
#: Where they go if nothing else is said: in the run's folder.
FIGURES = "figures"

# Characters of a file's name without its ending.
_LONGEST = 60


def figures_in(run: Run, folder: Path | str | None = None, *, kind: Format = "pdf") -> tuple[Path, ...]:
    """Write every figure of a run's report into a folder, in place of earlier ones, with a list of what each shows.

    The names follow from what is shown, the same run gives the same bytes, letters are in the files. Figures are 117 mm wide
    with letters of 9 points, but for that of pairs, which grows with their number; over a column of 84 mm letters have 6.5.

    Parameters
    ----------
    run : the calibration; if a padding was recommended, with its figures, unless the run is red: there is no advice then.
    folder : where to; None for the folder `figures` in that of the run.
    kind : ending of the files; PDF and SVG hold lines and letters, PNG 250 dots per inch.

    Returns
    -------
    The files, the list last.

    Raises
    ------
    InputError
        If the format is none of these, or there is no place for the folder.
    """
    if kind not in get_args(Format):
        raise InputError(Fault(f'"{kind}" is no format of figures', advice=f"Choose one of {', '.join(get_args(Format))}"))
    folder = run.folder / FIGURES if folder is None else Path(folder)
    recommendation = None if run.verdict.colour == "red" else load_recommendation(run.folder)
    plots = plots_of_report(run.posterior, run.predictions, recommendation)
    require_folder(folder, "Create it first")
    with naming(folder):
        folder.mkdir(exist_ok=True)
    names = _file_names(plots)
    for name, plot in plots.items():
        write_figure(plot.figure(), folder / f"{names[name]}.{kind}")
    captions = {f"{names[name]}.{kind}": plot.caption for name, plot in plots.items()}
    write_text(folder / CAPTIONS, _captions(run, recommendation, captions))
    return (*(folder / name for name in captions), folder / CAPTIONS)


def _file_names(names: Iterable[str]) -> dict[str, str]:
    """A name of a file for each name: small letters, digits and hyphens, no two the same on any system."""
    found: dict[str, str] = {}
    for name in names:
        plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode("ascii").lower()
        stem = re.sub("[^a-z0-9]+", "-", plain)[:_LONGEST].strip("-") or "figure"
        free = (f"{stem}-{k}" for k in count(2))
        found[name] = stem if stem not in found.values() else next(one for one in free if one not in found.values())
    return found


def _captions(run: Run, recommendation: Recommendation | None, captions: Mapping[str, str]) -> str:
    """What each file shows, under what of run and recommendation has to be known to use them."""
    lines = [f"# Figures of {visible(run.posterior.experiment.name)}", "", f"Posterior {run.posterior_sha256}."]
    lines += _verdict(run.verdict, "the numbers")
    if recommendation is not None:
        lines += _verdict(recommendation.verdict, "the advice")
        if recommendation.draws_sha256 != run.posterior.draws_sha256:
            lines += ["", "The advice was made from other draws: run `calib recommend` again."]
    for name, caption in captions.items():
        lines += ["", f"**{name}** {visible(caption)}"]
    return "\n".join(lines) + "\n"


def _verdict(verdict: Verdict, what: str) -> list[str]:
    reasons = [f"- {r.level}, {r.gate}: {visible(r.in_words)}" for r in verdict.reasons]
    return ["", status_in_words(verdict, what), *(["", *reasons] if reasons else [])]

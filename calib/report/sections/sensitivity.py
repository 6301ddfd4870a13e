"""What the headline numbers rest on: which of them would move with what was believed before, and which belief does it."""

from __future__ import annotations

from dataclasses import dataclass

from calib.catalogue import QUANTITIES, UnknownName
from calib.digits import with_uncertainty
from calib.report.section import Results, Section
from calib.sampling import Diagnosis, Posterior, Sensitivity

ORDER = 60

_TITLE = "What the numbers rest on"
# Rows of the table; of many specimens it holds those that move most.
_ROWS = 12
_WORDS: dict[Diagnosis, str] = {
    "none": "the data",
    "both": "data and beliefs, which agree",
    "prior-driven": "beliefs more than data",
    "conflict": "beliefs that pull away from the data",
    "not known": "not known",
}


def section(results: Results) -> Section | None:
    """Show what headline numbers rest on; None if that was not looked at."""
    rows = sensitivity_rows(results.posterior)
    if not rows:
        return None
    context = {"rows": rows[:_ROWS], "left_out": max(0, len(rows) - _ROWS)}
    return Section("sensitivity", _TITLE, "Sensitivity", "sensitivity.html.j2", context, appendix=True)


@dataclass(frozen=True)
class SensitivityRow:
    """One headline, ready to print.

    Attributes
    ----------
    label : what it is.
    value, weaker : what came out, and what would with beliefs half as strong, with the unit of display.
    rests_on : the data, or what was believed, in words.
    foremost : the belief that moves it most; "" where none does.
    doubtful : whether it is not the measurement that tells it.
    """

    label: str
    value: str
    weaker: str
    rests_on: str
    foremost: str
    doubtful: bool


def sensitivity_rows(posterior: Posterior) -> list[SensitivityRow]:
    """Make the rows of the table: in the order of the unknowns, or if they are many those that move most first."""
    found = list(posterior.diagnostics.sensitivity.items())
    if len(found) > _ROWS:
        found.sort(key=lambda pair: -abs(pair[1].shift))
    return [_row(posterior, name, s) for name, s in found]


def _row(posterior: Posterior, name: str, found: Sensitivity) -> SensitivityRow:
    unknown, s = UnknownName.parse(name), posterior.diagnostics.parameters[name]
    q = QUANTITIES[unknown.parameter]
    k = q.display_scale
    value, weaker = (f"{with_uncertainty(mean * k, s.sd * k)}" for mean in (s.mean, s.mean - found.shift * s.sd))
    counts = found.diagnosis not in ("none", "not known") and bool(found.pulls)
    by = UnknownName.parse(found.pulls[0].unknown).label if counts else ""
    foremost = "its own" if counts and by == unknown.label else by
    doubtful = found.diagnosis in ("conflict", "prior-driven")
    weaker = f"{weaker.split(' ±')[0]} {q.display_unit}".strip()
    return SensitivityRow(
        unknown.label, f"{value} {q.display_unit}".strip(), weaker, _WORDS[found.diagnosis], foremost, doubtful
    )

"""What speaks against the numbers, on paper, where the first sheet has a line of each only."""

from __future__ import annotations

from calib.report.first_sheet import crowded
from calib.report.section import Results, Section

ORDER = 15


def section(results: Results) -> Section | None:
    """All reasons with their actions; nothing where they stand on the first sheet."""
    if not crowded(results):
        return None
    title = "What speaks against it"
    return Section("reasons", title, "", "reasons.html.j2", {"reasons": results.reasons}, paper=True, of_draws=False)

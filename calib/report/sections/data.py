"""The lab files with their hashes, and what was left out of them."""

from __future__ import annotations

from calib.report.section import Results, Section

ORDER = 80

_TITLE = "Lab files and what was left out of them"


def section(results: Results) -> Section:
    """Show the lab files sweep by sweep."""
    return Section("data", _TITLE, "Files", "data.html.j2", {"sweeps": results.posterior.sweeps}, appendix=True, of_draws=False)

"""What to measure next, if that is known."""

from __future__ import annotations

from calib.report.section import Results, Section

ORDER = 43

_TITLE = "What to measure next"


def section(results: Results) -> Section | None:
    """Show the first measurements that would tell something; None where nothing is known of them, or the calibration is red."""
    known = results.next_steps
    if known is None or results.void:
        return None
    rows = [
        (one.what, one.brings, f"{100 * one.reduction:.0f} %", f"{100 * one.per_hour:.0f} %", f"{one.minutes:.0f}")
        for one in known.first
    ]
    advice = results.recommendation
    of_another_load = ""
    if known.asked == "padding" and advice is not None and advice.conformity is None:
        load = f"{advice.requirement.force:g} N"
        of_another_load = "" if f"signal at {load} " in known.label else load
    context = {"known": known, "rows": rows, "of_another_load": of_another_load}
    return Section("measurements", _TITLE, "Next", "measurements.html.j2", context)

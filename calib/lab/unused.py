"""From observations of which no row is used to the refusal that says why, and what to do."""

from __future__ import annotations

import re

import numpy as np

from calib.errors import Fault
from calib.lab.instruments import QUANTITIES
from calib.lab.observations import Observations, why_left_out

# The reason of a row without a number, and the quantity that has none.
_EMPTY = re.compile(r"(?:empty cell|no number, [^;:]*): (?P<quantity>[^;]*)")


def nothing_used(obs: Observations) -> Fault:
    """The refusal of a file none of whose rows can be used.

    Parameters
    ----------
    obs : of the file, without a row that is used.
    """
    reasons = why_left_out(obs)
    shown = "; ".join(f"{count} x {reason}" for reason, count in reasons.most_common(3))
    advice = _of_the_branch(obs) or _of_rows_in_turn(obs) or _of_empty_cells(obs, list(reasons)) or _of_readings(list(reasons))
    line = int(obs.table.lines[0]) if len(obs.table.lines) else None
    return Fault(f"none of the {len(obs.reason)} row(s) can be used: {shown}", obs.table.path, line, advice=advice)


def _of_the_branch(obs: Observations) -> str:
    """What to do where the rows are sound and of no press on its way down; "" where they are not."""
    if "unloading" in obs.branch and obs.use.branch == "loading":
        return (
            "If the press is on record only on its way back, say --branch unloading "
            '(in an experiment file: use = { branch = "unloading" }); else --sign says which way compression is'
        )
    if "hold" not in obs.branch:
        return ""
    moving = "displacement" if obs.displacement is not None else "force"
    named = f'"{obs.table.sources[moving]}"' if moving in obs.table.sources else moving
    return f"{named} stands still: say which column moves, --columns {moving}=..., or export the record of the press"


def _of_rows_in_turn(obs: Observations) -> str:
    """What to do where rows of a tester and of a meter stand in one table, none with readings of both, as if merged."""
    there = {q: np.isfinite(v) for q, v in obs.table.columns.items()}
    press = [q for q in ("force", "displacement") if q in there]
    if not press or "capacitance" not in there:
        return ""
    of_press = np.any([there[q] for q in press], axis=0)
    if np.any(of_press & there["capacitance"]) or not np.any(of_press) or not np.any(there["capacitance"]):
        return ""
    without = " ".join(f"--columns {q}=none" for q in press)
    return (
        "Rows of two clocks stand in one table: read it twice, as the file of the press with --columns capacitance=none, and "
        f'as that of the capacitance with {without} (in an experiment file: columns = {{ capacitance = "none" }})'
    )


def _of_empty_cells(obs: Observations, reasons: list[str]) -> str:
    """What to do where a column has no reading in rows that the others have one in."""
    told = [found["quantity"] for reason in reasons if (found := _EMPTY.fullmatch(reason)) is not None]
    empty = list(dict.fromkeys(told))
    if len(told) != len(reasons) or not set(empty) <= set(QUANTITIES):
        return ""
    if len(empty) > 1:
        return f"No row has a reading of each: export {' and '.join(empty)} in the same rows, or each in a file of its own"
    options = [f"say which column holds it, --columns {empty[0]}=..., or export it too"]
    if empty[0] in ("time", "capacitance") and obs.displacement is not None and obs.force is not None:
        options.insert(0, f"leave it out: --columns {empty[0]}=none")
    return f'The column "{obs.table.sources.get(empty[0], empty[0])}" is empty: {"; or ".join(options)}'


def _of_readings(reasons: list[str]) -> str:
    """What to do where an instrument had no reading, or says that it is none."""
    if all(reason.startswith("LCR status") for reason in reasons):
        return "If these readings are good all the same, leave the status out: --columns status=none"
    if all(reason.startswith("over-range") for reason in reasons):
        return "Measure in a range that holds the readings, or export a column that does"
    if all(reason.startswith("the column was too narrow") for reason in reasons):
        return "Make the column wider in the spreadsheet program, and save the file again"
    return "Correct what the rows say in the file, or export the whole record again"

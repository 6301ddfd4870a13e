"""From a simulated loading curve to CSV, and from the check of a finite-element solution to its errors in words."""

from __future__ import annotations

import numpy as np

from models.fem import FiniteElements, Solution
from models.fem.check import check
from models.response import Response


def curve_csv(curve: Response) -> str:
    """Write a loading curve as CSV with the columns of `Response.columns`, SI, one row per step."""
    columns = curve.columns()
    rows = np.stack(list(columns.values()), axis=1)
    return "\n".join([",".join(columns), *(",".join(f"{v:.10g}" for v in row) for row in rows)]) + "\n"


def check_in_words(elements: FiniteElements, solution: Solution) -> list[str]:
    """Solve again on a finer mesh and say, line by line, how far off the solution is.

    Parameters
    ----------
    elements : that the solution is of.
    solution : without a failure.
    """
    found = check(elements, solution)
    lines = ["Estimated error of the mesh (solved again on elements of half the size):"]
    for name, error in (("force", found.force_error), ("capacitance change", found.change_error)):
        worst = int(np.nanargmax(np.abs(error)))
        at = solution.states[worst].depth * solution.units.length * 1e3
        rms, most, last = (100 * e for e in (np.sqrt(np.nanmean(error**2)), error[worst], error[-1]))
        lines.append(f"  {name:<20}{rms:8.3f} % (rms over the steps), worst {most:+.3f} % at {at:.3g} mm, last {last:+.3f} %")
    if not np.isnan(found.energy_error):
        lines.append(f"Work of the indenter against stored energy: {found.energy_error:+.1e}")
    lines.append(f"Largest penetration, between the nodes too: {found.penetration:.1e} of the indentation")
    return lines

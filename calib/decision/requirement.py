"""From what somebody wants of a padding to a checked `Requirement`."""

from __future__ import annotations

from dataclasses import dataclass

from calib.errors import Fault, InputError


@dataclass(frozen=True)
class Requirement:
    """What a padding is wanted for: the largest capacitance change at a force, among the thicknesses of a range.

    >>> Requirement(force=10.0, lower=0.0, upper=9e-3).n_thickness
    91

    Attributes
    ----------
    force : [N], at which the signal counts.
    lower, upper : [m], range of thicknesses to choose from.
    n_thickness : how many thicknesses of that range are tried, evenly spaced.
    tolerance : [1], loss of signal that still counts as being as good as the best.
    indenter_radius : [m], radius of the ball; None for that of the experiment.
    n_draw : how many draws of the posterior are used.

    Raises
    ------
    InputError
        If the force is not positive, the range is empty or negative, or there are too few thicknesses or draws.
    """

    force: float
    lower: float
    upper: float
    n_thickness: int = 91
    tolerance: float = 0.05
    indenter_radius: float | None = None
    n_draw: int = 400

    def __post_init__(self) -> None:
        rules = (
            (self.force > 0, f"force must be positive, got {self.force:.6g} N", 'Write for example --force "10 N".'),
            (
                self.lower >= 0,
                f"padding thickness must not be negative, got {self.lower * 1e3:.6g} mm",
                "Start at 0 mm or above.",
            ),
            (
                self.upper > self.lower,
                f"the padding range is empty: {self.lower * 1e3:.6g} mm to {self.upper * 1e3:.6g} mm",
                'Write the smaller thickness first, for example --padding "0 mm:9 mm", and about a pad that is there a narrow '
                'range, --padding "1.09 mm:1.11 mm".',
            ),
            (self.n_thickness >= 3, f"n_thickness must be at least 3, got {self.n_thickness}", ""),
            (0 < self.tolerance < 1, f"tolerance must lie between 0 and 1, got {self.tolerance:.6g}", ""),
            (
                self.indenter_radius is None or self.indenter_radius > 0,
                f"indenter_radius must be positive, got {(self.indenter_radius or 0) * 1e3:.6g} mm",
                "",
            ),
            (self.n_draw >= 50, f"n_draw must be at least 50, got {self.n_draw}", ""),
        )
        if faults := [Fault(message, advice=advice) for holds, message, advice in rules if not holds]:
            raise InputError(faults)

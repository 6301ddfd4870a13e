"""From what somebody knows of a gripper's electronics to a checked `Gripper`."""

from __future__ import annotations

import math
from dataclasses import dataclass

from calib.errors import Fault, InputError

#: Probability with which bounds hold the force, and half their width in standard deviations of a normal distribution.
LEVEL, WIDTH_IN_SD = 0.9, 1.645


@dataclass(frozen=True)
class Gripper:
    """What reads the sensor on a gripper, and how: a reading is c / c0 - 1, with c0 the mean of the first readings unloaded.

    >>> Gripper(padding=5.5e-3).n_tare
    64

    Attributes
    ----------
    force : [N], the largest that is to be read; None for the largest that was measured.
    padding : [m], thickness of the padding of a design that is to be built; None if there is none.
    parasitic : [F], mean and standard deviation of what the gripper's leads add to every reading; None for those of the lab.
    noise : [F], standard deviation of one reading; None for that of the lab's meter.
    n_tare : how many readings c0 is the mean of.
    n_draw : how many draws of the posterior are used.

    Raises
    ------
    InputError
        If a number cannot be.
    """

    force: float | None = None
    padding: float | None = None
    parasitic: tuple[float, float] | None = None
    noise: float | None = None
    n_tare: int = 64
    n_draw: int = 1000

    def __post_init__(self) -> None:
        leads, sd = (0.0, 0.0) if self.parasitic is None else self.parasitic
        rules = (
            (
                self.force is None or 0 < self.force < math.inf,
                f"force must be positive, got {self.force or 0:.6g} N",
                'Write for example --force "5 N".',
            ),
            (
                self.padding is None or 0 <= self.padding < math.inf,
                f"padding thickness must not be negative or infinite, got {(self.padding or 0) * 1e3:.6g} mm",
                'Write for example --padding "5.5 mm".',
            ),
            (
                leads >= 0,
                f"parasitic capacitance must not be negative, got {leads * 1e12:.6g} pF",
                "Measure it without sensor.",
            ),
            (sd >= 0, f"standard deviation of the parasitic capacitance must not be negative, got {sd * 1e12:.6g} pF", ""),
            (
                self.noise is None or 0 < self.noise < math.inf,
                f"noise must be positive, got {(self.noise or 0) * 1e15:.6g} fF",
                'Write for example --noise "10 fF".',
            ),
            (self.n_tare >= 1, f"n_tare must be at least 1, got {self.n_tare}", ""),
            (self.n_draw >= 100, f"n_draw must be at least 100, got {self.n_draw}", ""),
        )
        if faults := [Fault(message, advice=advice) for holds, message, advice in rules if not holds]:
            raise InputError(faults)

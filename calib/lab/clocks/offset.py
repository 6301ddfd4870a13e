"""What is known of the offset of two clocks: `ClockOffset`, its value, its errors, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Confidence = Literal["clear", "weak", "ambiguous"]


@dataclass(frozen=True)
class ClockOffset:
    """How far two instruments' clocks are apart: clock of the tester minus clock of the LCR meter.

    `sd` is what the tie needs: the error of the offset that, added to the meter's stamps, gives the tester's time at the middle
    of each reading. A meter averages over up to one interval and stamps begin or end of that: against its clock proper the
    offset may be off by another `systematic`, which moves no reading along the curve and is therefore not in `sd`.

    Attributes
    ----------
    value, sd : [s]. Where the data do not determine the offset, the middle of what is possible and an sd as wide as that.
    systematic : [s], largest further difference to the clock proper (half an interval, or half the step of coarse stamps).
    confidence : "clear": from the turning point, one solution, known within 10 ms, and the onset does not contradict. "weak":
        less sharp than that, as the press is slow or the noise large; or from the onset only; or the two disagree.
        "ambiguous": the data do not determine the offset.
    turning_point, onset : (value, sd) [s] from either feature alone; None where there is no such estimate.
    alternatives : [s], offsets that fit about as well, far from `value`; empty unless ambiguous by discrete steps.
    evidence : sentences for the report.
    """

    value: float
    sd: float
    systematic: float
    confidence: Confidence
    turning_point: tuple[float, float] | None
    onset: tuple[float, float] | None
    alternatives: tuple[float, ...]
    evidence: tuple[str, ...]

"""The observations of a lab file in, verdicts on their quality out: what may spoil a calibration, how much, what to do.

Verdicts never change data and never refuse a file; they are made before any inference, so that a lab can repeat a test while
the specimen is still on the bench. Every check gives a number whether or not it objects; one that a file has nothing to say on
(no unloading branch, no time column) gives no verdict.
"""

from calib.lab.quality.judgement import judge
from calib.lab.quality.material import TYPICAL_COMPLIANCE
from calib.lab.quality.verdict import Level, Verdict, worst_first
from calib.lab.quality.words import check_name, number_text, quality_in_words, verdict_rows

__all__ = [
    "TYPICAL_COMPLIANCE",
    "Level",
    "Verdict",
    "check_name",
    "judge",
    "number_text",
    "quality_in_words",
    "verdict_rows",
    "worst_first",
]

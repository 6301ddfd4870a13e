"""The observations of a lab file in, grades on their quality out: what may spoil a calibration, how much, what to do.

Grades never change data and never refuse a file; they are made before any inference, so that a lab can repeat a test while
the specimen is still on the bench. Every check gives a number whether or not it objects; one that a file has nothing to say on
(no unloading branch, no time column) gives no grade.
"""

from calib.lab.quality.grade import Grade, Level, worst_first
from calib.lab.quality.judgement import judge, judge_return
from calib.lab.quality.material import LIGHT_RIG
from calib.lab.quality.words import check_name, grade_rows, number_text, quality_in_words

__all__ = [
    "LIGHT_RIG",
    "Grade",
    "Level",
    "check_name",
    "grade_rows",
    "judge",
    "judge_return",
    "number_text",
    "quality_in_words",
    "worst_first",
]

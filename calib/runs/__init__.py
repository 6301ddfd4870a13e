"""An experiment file in, a run folder out (posterior, summary, report, recommendation), and it back; knows no command line."""

from calib.runs.calibration import Calibration, Stages, Watch, calibrate
from calib.runs.folder import PageError, Run, load_recommendation, load_run, recommend_in, report_in
from calib.runs.refinement import Means, Refinement, refine
from calib.runs.verify import Finding, verify

__all__ = [
    "Calibration",
    "Finding",
    "Means",
    "PageError",
    "Refinement",
    "Run",
    "Stages",
    "Watch",
    "calibrate",
    "load_recommendation",
    "load_run",
    "recommend_in",
    "refine",
    "report_in",
    "verify",
]

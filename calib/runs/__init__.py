"""An experiment file in, a run folder out (posterior, summary, report, recommendation), and it back; knows no command line."""

from calib.runs.calibration import STAGES, Calibration, Stages, Watch, calibrate, quick
from calib.runs.folder import PageError, Run, load_recommendation, load_run, recommend_in, report_in
from calib.runs.integrity import Finding, verify
from calib.runs.refinement import Means, Refinement, refine

__all__ = [
    "STAGES",
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
    "quick",
    "recommend_in",
    "refine",
    "report_in",
    "verify",
]

"""An experiment file in, a run folder out (posterior, summary, report, recommendation), and it back; knows no command line."""

from calib.runs.calibration import Calibration, Stages, Watch, calibrate
from calib.runs.folder import Run, load_recommendation, load_run, recommend_in, write_page, write_run
from calib.runs.refinement import Means, Refinement, refine

__all__ = [
    "Calibration",
    "Means",
    "Refinement",
    "Run",
    "Stages",
    "Watch",
    "calibrate",
    "load_recommendation",
    "load_run",
    "recommend_in",
    "refine",
    "write_page",
    "write_run",
]

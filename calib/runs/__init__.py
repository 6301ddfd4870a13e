"""An experiment file in, a run folder out (posterior, summary, report, recommendation), and it back; knows no command line.

The names below are loaded when they are asked for: a first answer does not wait for the sampler, nor a page for either.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from calib.lazy import on_demand

if TYPE_CHECKING:
    from calib.runs.average import AVERAGE, average_runs
    from calib.runs.batch import batch_in, is_batch, verify_batch
    from calib.runs.before import Check, check
    from calib.runs.calibration import STAGES, Calibration, Stages, Watch, calibrate
    from calib.runs.certificate import certify_in, input_now
    from calib.runs.certified import Finding
    from calib.runs.difference import diff_runs
    from calib.runs.doctor import Examined, examine
    from calib.runs.export import NotUsableError, export_in, force_tables
    from calib.runs.figures import figures_in
    from calib.runs.folder import Run, changed_inputs, load_recommendation, load_run
    from calib.runs.integrity import verify
    from calib.runs.listing import CERTIFICATES, RESULTS, read_listing
    from calib.runs.measurements import asked_before, next_for, next_in, specified_before
    from calib.runs.ownership import owned, owner_of
    from calib.runs.page import PageError
    from calib.runs.preview import quick
    from calib.runs.progress import ConvergenceLook, LastProgress, RunState, run_state
    from calib.runs.proof import prove
    from calib.runs.received import Received, is_received, verify_certificate
    from calib.runs.refinement import Means, Refinement, refine
    from calib.runs.renewed import recommend_in, report_in
    from calib.runs.rivals import Forecast, Rivalry, calibrate_rivals

__all__ = [
    "AVERAGE",
    "CERTIFICATES",
    "RESULTS",
    "STAGES",
    "Calibration",
    "Check",
    "ConvergenceLook",
    "Examined",
    "Finding",
    "Forecast",
    "LastProgress",
    "Means",
    "NotUsableError",
    "PageError",
    "Received",
    "Refinement",
    "Rivalry",
    "Run",
    "RunState",
    "Stages",
    "Watch",
    "asked_before",
    "average_runs",
    "batch_in",
    "calibrate",
    "calibrate_rivals",
    "certify_in",
    "changed_inputs",
    "check",
    "diff_runs",
    "examine",
    "export_in",
    "figures_in",
    "force_tables",
    "input_now",
    "is_batch",
    "is_received",
    "load_recommendation",
    "load_run",
    "next_for",
    "next_in",
    "owned",
    "owner_of",
    "prove",
    "quick",
    "read_listing",
    "recommend_in",
    "refine",
    "report_in",
    "run_state",
    "specified_before",
    "verify",
    "verify_batch",
    "verify_certificate",
]

__getattr__ = on_demand(
    __name__,
    {
        ".calibration": (
            "STAGES",
            "Calibration",
            "Stages",
            "Watch",
            "calibrate",
        ),
        ".batch": (
            "batch_in",
            "is_batch",
            "verify_batch",
        ),
        ".before": (
            "Check",
            "check",
        ),
        ".folder": (
            "Run",
            "changed_inputs",
            "load_recommendation",
            "load_run",
        ),
        ".page": ("PageError",),
        ".renewed": (
            "recommend_in",
            "report_in",
        ),
        ".average": (
            "AVERAGE",
            "average_runs",
        ),
        ".certificate": ("certify_in", "input_now"),
        ".certified": ("Finding",),
        ".difference": ("diff_runs",),
        ".doctor": (
            "Examined",
            "examine",
        ),
        ".export": (
            "NotUsableError",
            "export_in",
            "force_tables",
        ),
        ".figures": ("figures_in",),
        ".integrity": ("verify",),
        ".measurements": (
            "asked_before",
            "next_for",
            "next_in",
            "specified_before",
        ),
        ".listing": ("CERTIFICATES", "RESULTS", "read_listing"),
        ".ownership": ("owned", "owner_of"),
        ".preview": ("quick",),
        ".progress": (
            "ConvergenceLook",
            "RunState",
            "LastProgress",
            "run_state",
        ),
        ".proof": ("prove",),
        ".received": ("Received", "is_received", "verify_certificate"),
        ".refinement": (
            "Means",
            "Refinement",
            "refine",
        ),
        ".rivals": (
            "Forecast",
            "Rivalry",
            "calibrate_rivals",
        ),
    },
)


def __dir__() -> list[str]:
    return __all__

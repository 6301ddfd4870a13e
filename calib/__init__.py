"""Bayesian calibration of a soft capacitive pressure sensor: lab files in, posterior, report and recommendation out.

The names below are what a notebook or a script needs, from a lab file to a decision. Each is loaded when it is asked for, so
that `import calib` takes no time. Rooms with more, such as `calib.lab`, are described in docs/architecture.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from calib.lazy import on_demand

if TYPE_CHECKING:
    from calib.catalogue import CHANNELS, UNKNOWNS, UnknownName
    from calib.checks import Prediction, compare_runs, comparison_in_words, doubts, predict, with_reweighting, with_spot_check
    from calib.decision import Recommendation, Requirement, recommend
    from calib.errors import Fault, InputError
    from calib.experiment import (
        Experiment,
        Specimen,
        SweepFiles,
        experiment_from,
        forward_of_experiment,
        read_design,
        read_experiment,
        read_sweeps,
    )
    from calib.lab import Grade, Observations, Points, Reading, Sweep, judge, make_sweep, observe, read_lab_file
    from calib.priors import Fixed, HalfNormal, LogNormal, Normal, Prior, TruncatedNormal, Uniform, default_prior, parse_prior
    from calib.problem import (
        Problem,
        build_problem,
        log_density,
        log_posterior,
        medians,
        problem_from,
        readings,
        residuals,
        specimen_design,
        values_at,
    )
    from calib.report import (
        change_figure,
        channel_figure,
        corner_figure,
        file_figure,
        padding_figure,
        prior_figure,
        summary_json,
        trace_figure,
        write_report,
    )
    from calib.runs import Run, calibrate, load_run, recommend_in
    from calib.sampling import (
        Diagnostics,
        FirstAnswer,
        Gate,
        Posterior,
        Progress,
        first_answer,
        leave_out,
        load_posterior,
        sample,
        save_posterior,
        thin_draws,
        to_arviz,
    )

__all__ = [
    "CHANNELS",
    "UNKNOWNS",
    "Diagnostics",
    "Experiment",
    "Fault",
    "FirstAnswer",
    "Fixed",
    "Gate",
    "Grade",
    "HalfNormal",
    "InputError",
    "LogNormal",
    "Normal",
    "Observations",
    "Points",
    "Posterior",
    "Prediction",
    "Prior",
    "Problem",
    "Progress",
    "Reading",
    "Recommendation",
    "Requirement",
    "Run",
    "Specimen",
    "Sweep",
    "SweepFiles",
    "TruncatedNormal",
    "Uniform",
    "UnknownName",
    "build_problem",
    "calibrate",
    "change_figure",
    "channel_figure",
    "compare_runs",
    "comparison_in_words",
    "corner_figure",
    "default_prior",
    "doubts",
    "experiment_from",
    "file_figure",
    "first_answer",
    "forward_of_experiment",
    "judge",
    "leave_out",
    "load_posterior",
    "load_run",
    "log_density",
    "log_posterior",
    "make_sweep",
    "medians",
    "observe",
    "padding_figure",
    "parse_prior",
    "predict",
    "prior_figure",
    "problem_from",
    "read_design",
    "read_experiment",
    "read_lab_file",
    "read_sweeps",
    "readings",
    "recommend",
    "recommend_in",
    "residuals",
    "sample",
    "save_posterior",
    "specimen_design",
    "summary_json",
    "thin_draws",
    "to_arviz",
    "trace_figure",
    "values_at",
    "with_reweighting",
    "with_spot_check",
    "write_report",
]

_ROOMS: dict[str, tuple[str, ...]] = {
    "calib.errors": (
        "Fault",
        "InputError",
    ),
    "calib.catalogue": (
        "CHANNELS",
        "UNKNOWNS",
        "UnknownName",
    ),
    "calib.lab": (
        "Observations",
        "Points",
        "Reading",
        "Sweep",
        "Grade",
        "judge",
        "make_sweep",
        "observe",
        "read_lab_file",
    ),
    "calib.priors": (
        "Fixed",
        "HalfNormal",
        "LogNormal",
        "Normal",
        "Prior",
        "TruncatedNormal",
        "Uniform",
        "default_prior",
        "parse_prior",
    ),
    "calib.experiment": (
        "Experiment",
        "Specimen",
        "SweepFiles",
        "experiment_from",
        "forward_of_experiment",
        "read_design",
        "read_experiment",
        "read_sweeps",
    ),
    "calib.problem": (
        "Problem",
        "build_problem",
        "log_density",
        "log_posterior",
        "medians",
        "problem_from",
        "readings",
        "residuals",
        "specimen_design",
        "values_at",
    ),
    "calib.sampling": (
        "Diagnostics",
        "FirstAnswer",
        "Gate",
        "Posterior",
        "Progress",
        "first_answer",
        "leave_out",
        "load_posterior",
        "sample",
        "save_posterior",
        "thin_draws",
        "to_arviz",
    ),
    "calib.checks": (
        "Prediction",
        "compare_runs",
        "comparison_in_words",
        "doubts",
        "predict",
        "with_reweighting",
        "with_spot_check",
    ),
    "calib.decision": (
        "Recommendation",
        "Requirement",
        "recommend",
    ),
    "calib.report": (
        "change_figure",
        "channel_figure",
        "corner_figure",
        "file_figure",
        "padding_figure",
        "prior_figure",
        "summary_json",
        "trace_figure",
        "write_report",
    ),
    "calib.runs": (
        "Run",
        "calibrate",
        "load_run",
        "recommend_in",
    ),
}
__getattr__ = on_demand(__name__, _ROOMS)


def __dir__() -> list[str]:
    return sorted(__all__)

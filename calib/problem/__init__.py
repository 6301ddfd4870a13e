"""Experiment, sweeps and forward model in, a `Problem` out: unknowns, values at z, likelihood; knows no sampler."""

from calib.problem.by_name import log_density, medians, readings, residuals
from calib.problem.likelihood import (
    LIKELIHOOD_VERSION,
    block_names,
    given_other_points,
    log_likelihood,
    log_likelihood_at,
    log_likelihood_blocks,
    log_likelihood_points,
    log_posterior,
    range_use,
)
from calib.problem.measurement import PredictedReadings, SweepModel, SweepPlan, model_sweep, plan_sweep
from calib.problem.problem import Problem, build_problem, problem_from
from calib.problem.unknowns import ParameterInfo
from calib.problem.values import Calibrated, columns_at, coordinates_of, lookup, specimen_design, values_at

__all__ = [
    "LIKELIHOOD_VERSION",
    "Calibrated",
    "ParameterInfo",
    "PredictedReadings",
    "Problem",
    "SweepModel",
    "SweepPlan",
    "block_names",
    "build_problem",
    "columns_at",
    "coordinates_of",
    "given_other_points",
    "log_density",
    "log_likelihood",
    "log_likelihood_at",
    "log_likelihood_blocks",
    "log_likelihood_points",
    "log_posterior",
    "lookup",
    "medians",
    "model_sweep",
    "plan_sweep",
    "problem_from",
    "range_use",
    "readings",
    "residuals",
    "specimen_design",
    "values_at",
]

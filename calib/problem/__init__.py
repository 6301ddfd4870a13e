"""Experiment, sweeps and forward model in, a `Problem` out: unknowns, values at z, likelihood; knows no sampler."""

from calib.problem.by_name import log_density, medians, readings, residuals
from calib.problem.centred import nominal_zero
from calib.problem.density import chi_square, given_other_points, log_likelihood_points, log_normal, point_densities
from calib.problem.glance import Glance, glances
from calib.problem.likelihood import (
    LIKELIHOOD_VERSION,
    block_names,
    channel_of_block,
    levels_of_blocks,
    log_likelihood,
    log_likelihood_at,
    log_likelihood_blocks,
    log_likelihood_sweeps,
    log_posterior,
    range_use,
    without_block,
)
from calib.problem.lots import Lot, LotPrior
from calib.problem.measurement import model_sweep, model_sweeps
from calib.problem.newcomer import CalibratedLot, Newcomer, NewcomerUnknown, newcomer_experiment, newcomer_of, template_of
from calib.problem.next_specimen import as_next_specimen, as_unmeasured_specimen, padding_about_mean
from calib.problem.plan import CORRELATION_LENGTH, SweepPlan, correlation_between, plan_sweep, plan_sweeps, specimen_and_ball
from calib.problem.prior import (
    log_prior,
    log_prior_as_normal,
    prior_bend,
    prior_coordinates,
    prior_covariance,
    prior_values,
    values_of_lot,
)
from calib.problem.problem import Problem, build_problem, outside_faults, problem_from
from calib.problem.readings import PredictedReadings, SweepModel
from calib.problem.repeats import Together, log_normal_sweeps, put_together
from calib.problem.specimens import LogPosteriorParts, Scopes, log_posterior_parts, scopes_of
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.problem.unknowns import ParameterInfo, UnknownTable, list_unknowns, of_lot, table_of
from calib.problem.values import (
    Calibrated,
    columns_at,
    coordinates_of,
    lookup,
    specimen_design,
    values_at,
)

__all__ = [
    "CORRELATION_LENGTH",
    "LIKELIHOOD_VERSION",
    "Calibrated",
    "CalibratedLot",
    "Glance",
    "LogPosteriorParts",
    "Lot",
    "LotPrior",
    "Newcomer",
    "NewcomerUnknown",
    "ParameterInfo",
    "PredictedReadings",
    "Problem",
    "Rig",
    "Scopes",
    "SweepModel",
    "SweepPlan",
    "Together",
    "UnknownTable",
    "as_next_specimen",
    "as_unmeasured_specimen",
    "block_names",
    "build_problem",
    "channel_of_block",
    "chi_square",
    "columns_at",
    "coordinates_of",
    "correlation_between",
    "given_other_points",
    "glances",
    "levels_of_blocks",
    "list_unknowns",
    "log_density",
    "log_likelihood",
    "log_likelihood_at",
    "log_likelihood_blocks",
    "log_likelihood_points",
    "log_likelihood_sweeps",
    "log_normal",
    "log_normal_sweeps",
    "log_posterior",
    "log_posterior_parts",
    "log_prior",
    "log_prior_as_normal",
    "lookup",
    "medians",
    "model_sweep",
    "model_sweeps",
    "newcomer_experiment",
    "newcomer_of",
    "nominal_zero",
    "of_lot",
    "outside_faults",
    "padding_about_mean",
    "plan_sweep",
    "plan_sweeps",
    "point_densities",
    "prior_bend",
    "prior_coordinates",
    "prior_covariance",
    "prior_values",
    "problem_from",
    "put_together",
    "range_use",
    "readings",
    "residuals",
    "scopes_of",
    "specimen_and_ball",
    "specimen_design",
    "synthetic_sweep",
    "table_of",
    "template_of",
    "values_at",
    "values_of_lot",
    "without_block",
]

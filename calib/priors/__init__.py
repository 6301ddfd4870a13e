"""What is believed of an unknown before the data, from its form in a file to a distribution; knows no lab file and no model."""

from calib.priors.defaults import default_prior
from calib.priors.distributions import (
    PRIORS,
    Fixed,
    HalfNormal,
    LogNormal,
    Normal,
    Prior,
    TruncatedNormal,
    Uniform,
    log_mass,
    prior_from_json,
)
from calib.priors.forms import FORMS, parse_prior, parse_value, sign_fault
from calib.priors.stacked import StackedPriors, stack_priors

__all__ = [
    "FORMS",
    "PRIORS",
    "Fixed",
    "HalfNormal",
    "LogNormal",
    "Normal",
    "Prior",
    "StackedPriors",
    "TruncatedNormal",
    "Uniform",
    "default_prior",
    "log_mass",
    "parse_prior",
    "parse_value",
    "prior_from_json",
    "sign_fault",
    "stack_priors",
]

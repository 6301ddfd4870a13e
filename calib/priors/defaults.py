"""Default priors: what is believed of an unknown that the experiment does not name, from the catalogue's forms."""

from __future__ import annotations

import tomllib
from functools import cache

from calib.catalogue import UNKNOWNS
from calib.priors.distributions import Prior
from calib.priors.forms import parse_prior


@cache
def default_prior(parameter: str) -> Prior:
    """Find the prior of an unknown that the experiment does not name; `calib.catalogue.UNKNOWNS` has its form and its reason.

    >>> default_prior("machine_compliance").describe("machine_compliance")
    'half-normal, scale 2 µm/N'

    Raises
    ------
    ValueError
        If the unknown has no default prior.
    """
    row = UNKNOWNS[parameter]
    if not row.default:
        raise ValueError(f"{parameter} has no default prior. Give for example {parameter} = {row.example}")
    return parse_prior(parameter, tomllib.loads(f"prior = {row.default}")["prior"])

"""A problem and one of its specimens in, how well the others predict what was read of it out.

The data of a specimen are left out of what all share, and held against what the posterior of the others makes of them, with the
specimen's own thicknesses, contact and lot as they are believed. Of a press that is how large its force and its capacitance
are: contact, load zero and clock nobody predicts. So the specimen gets a factor of its own on each of its channels. With these
free its data tell nothing of the modulus and the permittivity that it shares, nor of its own that are of a lot: the factors are
what was read over what the others let one expect. By a first answer their coordinate z has the mean m and the variance V, of
which the factor's own prior is a part; without it

    y = m / (1 - V) ± sqrt(V / (1 - V)),   y / sqrt(V / (1 - V)) ~ N(0, 1)                                              (1)

for a specimen that the others predict. Weights of the draws of the posterior (PSIS) do not tell it: on the shipped data leaving
a whole specimen out has a k-hat of 1.1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from calib.catalogue import CHANNELS, UnknownName
from calib.checks.looks import look_near
from calib.priors import LogNormal
from calib.problem import ParameterInfo, Problem
from calib.sampling import FirstEstimate, Foretold

# Prior of a factor: far wider than what specimens differ by, as (1) takes it away again.
_FACTOR = 1.3
# A factor of which the data leave more than this share of its prior's variance is not predicted at all.
_UNTOLD = 0.9


def foretold(problem: Problem, near: Mapping[str, float], specimen: str) -> tuple[Foretold, ...]:
    """Hold what was read of a specimen against what the others let one expect.

    Parameters
    ----------
    problem : of several specimens.
    near : values [SI] by name, where to look for a mode first.
    specimen : its name.

    Returns
    -------
    One for each channel of the specimen; nothing where it is alone, or where there is no first answer.
    """
    if len({sweep.specimen for sweep in problem.sweeps}) < 2:
        return ()
    channels = [channel for channel in CHANNELS if _has(problem, specimen, channel)]
    prior = LogNormal(1.0, _FACTOR)
    factors = tuple(ParameterInfo(UnknownName(f"{channel}_gain", specimen), prior) for channel in channels)
    look = look_near(replace(problem, parameters=(*problem.parameters, *factors)), near)
    if look is None:
        return ()
    found = []
    for k, channel in enumerate(channels, start=len(problem.parameters)):
        mean = float(look.weight @ look.theta[:, k])
        variance = float(look.weight @ (look.theta[:, k] - mean) ** 2)
        if not variance < _UNTOLD:
            continue
        sd = math.sqrt(variance / (1 - variance))
        ratio = math.exp(math.log(_FACTOR) * mean / (1 - variance))
        found.append(
            Foretold(specimen, channel, FirstEstimate(ratio, ratio * math.log(_FACTOR) * sd), mean / (1 - variance) / sd)
        )
    return tuple(found)


def _has(problem: Problem, specimen: str, channel: str) -> bool:
    """Whether readings of a specimen depend on what this channel's instrument says."""
    own = [sweep for sweep in problem.sweeps if sweep.specimen == specimen]
    return any(channel in sweep.channels or any(sweep.tied_by(c) == channel for c in sweep.channels) for sweep in own)

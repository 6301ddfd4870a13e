"""A posterior in, how well its model predicts each block of data from the others out: by weights, or by fitting anew.

Weights of the draws (PSIS) tell what the posterior would be without a block, where it does not pull too hard (k-hat at most
0.7). Where it does, the density of the block given the others is the ratio of two evidences,

    p(y_b | y_-b) = p(y) / p(y_-b),                                                                                     (1)

each computed by importance sampling from a density fitted to its own posterior (`calib.sampling.first_answer`).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from calib.checks.reweighting import problem_of
from calib.problem import without_block
from calib.sampling import LeaveOut, Posterior, first_answer, leave_out
from models.response import Forward


def leave_out_exactly(posterior: Posterior, forward: Forward) -> LeaveOut:
    """As `calib.sampling.leave_out`, with the blocks that its weights cannot be trusted for computed by (1).

    About a second of processor time for each of them. A block for which there is no evidence, as the posterior without it is
    not nearly normal given its scales, stays as it was, and doubtful. So do all with the finite elements, which would take
    hours.

    Parameters
    ----------
    posterior : as sampled.
    forward : the model that it was sampled with.
    """
    found = leave_out(posterior)
    if found.trusted or posterior.experiment.model == "fem":
        return found
    problem = problem_of(posterior, forward)
    near = {name: s.mean for name, s in posterior.diagnostics.parameters.items()}
    pointwise, refitted = found.pointwise.copy(), []
    try:
        whole = first_answer(problem, near).log_evidence
        for number in found.doubtful:
            pointwise[number] = whole - first_answer(without_block(problem, number), near).log_evidence
            refitted.append(number)
    except ValueError:
        pass
    se = math.sqrt(pointwise.size * float(np.var(pointwise)))
    return replace(found, elpd=float(np.sum(pointwise)), se=se, pointwise=pointwise, refitted=tuple(refitted))

"""A `Problem` in, a `Posterior` out, kept in files that can be resumed and read by ArviZ; knows no report.

The names below are loaded when they are asked for: a worker that makes steps waits for no container and no file format.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from calib.lazy import on_demand

if TYPE_CHECKING:
    from calib.sampling.archive import K_HAT, LeaveOut, load_arviz, smooth_weights
    from calib.sampling.assess import BLOCK_STEPS
    from calib.sampling.checkpoint import is_begun, kept_blocks, kept_identity, whose_checkpoint
    from calib.sampling.coordinates import MANY_SPECIMENS
    from calib.sampling.deeper import discrepancies_with
    from calib.sampling.diagnostics import Convergence, Diagnostics, Gate, summarise
    from calib.sampling.estimate import Look, answer_of, climb_from, first_answer, log_evidence_at, look_at
    from calib.sampling.expected import expected_information
    from calib.sampling.findings import (
        SENSITIVE,
        SHIFT_LIMIT,
        SPOT_CHECK_LIMIT,
        Averaged,
        Departure,
        Diagnosis,
        FirstAnswer,
        FirstEstimate,
        Foretold,
        ParameterSummary,
        Pull,
        Reweighting,
        Sensitivity,
        Shift,
        SpotCheck,
        Stranger,
        share_between,
    )
    from calib.sampling.groups import to_arviz
    from calib.sampling.identity import ENSEMBLES, FINGERPRINT, Identity, differences, identity_of, usual_walkers
    from calib.sampling.newcomer import GivenLot, given_chains, given_lot, joined_problem, lot_of, posterior_of, quantiles
    from calib.sampling.posterior import Posterior, coverage_intervals, leave_out, thin_draws
    from calib.sampling.sampler import NothingSampled, Progress, sample
    from calib.sampling.storage import load_posterior, save_posterior

__all__ = [
    "BLOCK_STEPS",
    "ENSEMBLES",
    "FINGERPRINT",
    "K_HAT",
    "MANY_SPECIMENS",
    "SENSITIVE",
    "SHIFT_LIMIT",
    "SPOT_CHECK_LIMIT",
    "Averaged",
    "Convergence",
    "Departure",
    "Diagnosis",
    "Diagnostics",
    "FirstAnswer",
    "FirstEstimate",
    "Foretold",
    "Gate",
    "GivenLot",
    "Identity",
    "LeaveOut",
    "Look",
    "NothingSampled",
    "ParameterSummary",
    "Posterior",
    "Progress",
    "Pull",
    "Reweighting",
    "Sensitivity",
    "Shift",
    "SpotCheck",
    "Stranger",
    "answer_of",
    "climb_from",
    "coverage_intervals",
    "differences",
    "discrepancies_with",
    "expected_information",
    "first_answer",
    "given_chains",
    "given_lot",
    "identity_of",
    "is_begun",
    "joined_problem",
    "kept_blocks",
    "kept_identity",
    "leave_out",
    "load_arviz",
    "load_posterior",
    "log_evidence_at",
    "look_at",
    "lot_of",
    "posterior_of",
    "quantiles",
    "sample",
    "save_posterior",
    "share_between",
    "smooth_weights",
    "summarise",
    "thin_draws",
    "to_arviz",
    "usual_walkers",
    "whose_checkpoint",
]

__getattr__ = on_demand(
    __name__,
    {
        ".archive": (
            "K_HAT",
            "LeaveOut",
            "load_arviz",
            "smooth_weights",
        ),
        ".assess": ("BLOCK_STEPS",),
        ".checkpoint": (
            "is_begun",
            "kept_blocks",
            "kept_identity",
            "whose_checkpoint",
        ),
        ".coordinates": ("MANY_SPECIMENS",),
        ".diagnostics": (
            "Convergence",
            "Diagnostics",
            "Gate",
            "summarise",
        ),
        ".deeper": ("discrepancies_with",),
        ".findings": (
            "SENSITIVE",
            "SHIFT_LIMIT",
            "SPOT_CHECK_LIMIT",
            "Averaged",
            "Departure",
            "Diagnosis",
            "FirstAnswer",
            "FirstEstimate",
            "Foretold",
            "ParameterSummary",
            "Pull",
            "Reweighting",
            "Sensitivity",
            "Shift",
            "SpotCheck",
            "share_between",
            "Stranger",
        ),
        ".estimate": (
            "Look",
            "answer_of",
            "climb_from",
            "first_answer",
            "log_evidence_at",
            "look_at",
        ),
        ".expected": ("expected_information",),
        ".groups": ("to_arviz",),
        ".identity": (
            "ENSEMBLES",
            "FINGERPRINT",
            "Identity",
            "differences",
            "identity_of",
            "usual_walkers",
        ),
        ".newcomer": (
            "GivenLot",
            "given_chains",
            "given_lot",
            "joined_problem",
            "lot_of",
            "posterior_of",
            "quantiles",
        ),
        ".posterior": (
            "Posterior",
            "coverage_intervals",
            "leave_out",
            "thin_draws",
        ),
        ".sampler": (
            "NothingSampled",
            "Progress",
            "sample",
        ),
        ".storage": (
            "load_posterior",
            "save_posterior",
        ),
    },
)


def __dir__() -> list[str]:
    return __all__

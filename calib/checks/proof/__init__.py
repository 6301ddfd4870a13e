"""An experiment in, proof by simulation out that its calibrations hold the truth as often as they say, or that they do not."""

from calib.checks.proof.judgement import Proof, Tested
from calib.checks.proof.presses import SimulatedPress, presses_of
from calib.checks.proof.ranks import rank_band, rank_points, rank_shares
from calib.checks.proof.replicate import (
    LIKELIHOOD,
    Replicate,
    ReplicateSetting,
    attempt,
    replicate_from_plain,
    replicate_to_plain,
)

__all__ = [
    "LIKELIHOOD",
    "Proof",
    "Replicate",
    "ReplicateSetting",
    "SimulatedPress",
    "Tested",
    "attempt",
    "presses_of",
    "rank_band",
    "rank_points",
    "rank_shares",
    "replicate_from_plain",
    "replicate_to_plain",
]

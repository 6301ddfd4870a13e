"""A measurement that could be made next: what it is in the lab, and the problem or the reading that it would make."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from calib.decision.extrapolation import Measured
from calib.experiment import Experiment
from calib.problem import Problem
from models.sensor import FloatArray


@dataclass(frozen=True, eq=False)
class Candidate:
    """A measurement that could be made next.

    Attributes
    ----------
    kind : of a press (`calib.experiment.PRESSES`), or the quantity that is read (`calib.experiment.READINGS`).
    what : in words of the lab.
    alike : the same for all that differ in nothing but the specimen.
    minutes : in the lab.
    experiment : with it; files that are still to be made have a name and no folder.
    notes : what is to be put in there, see `calib.experiment.experiment_toml`.
    problem : with one more sweep; None for a quantity that is read by itself.
    middle : (n_unknown,), of the problem.
    reads : number of the unknown that is read by itself, and its sd [SI]; None for a press.
    press : what a press is expected to measure; None for a quantity that is read by itself.
    """

    kind: str
    what: str
    alike: str
    minutes: float
    experiment: Experiment
    notes: Mapping[tuple[str, str], str]
    problem: Problem | None = None
    middle: FloatArray = field(default_factory=lambda: np.empty(0))
    reads: tuple[int, float] | None = None
    press: Measured | None = None

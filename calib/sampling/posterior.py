"""A sampled posterior as one frozen value, and draws and numbers taken from it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from calib.experiment import Experiment
from calib.lab import Sweep
from calib.problem import ParameterInfo, UnknownTable, of_lot, table_of
from calib.sampling.archive import LeaveOut, leave_blocks_out
from calib.sampling.diagnostics import Diagnostics
from calib.sampling.layout import chain_order, unknowns
from models.sensor import FloatArray, IntArray

if TYPE_CHECKING:
    import pandas as pd
    import xarray


@dataclass(frozen=True, eq=False)
class Posterior:
    """What a calibration found: draws of all unknowns, with the experiment and the data that they follow from.

    `sample` makes one. For notebooks `to_dataframe` gives the draws as a table, `to_xarray` as labelled arrays; for forward
    models `named_draws` and `thin_draws` give them by name.

    Attributes
    ----------
    experiment, sweeps : what was calibrated, and its data.
    parameters : the unknowns, then what is of a lot (`calib.problem.of_lot`), in the order of the last axis of `draws`.
    fixed : name -> value [SI] of the unknowns that a prior fixed.
    forward_name : the model of the sensor.
    draws : (n_ensemble, n_draw, n_parameter), SI, all walkers of one step, then of the next kept step.
    log_prob : (n_ensemble, n_draw), log posterior density in the priors' coordinates, up to a constant.
    log_likelihood : (n_ensemble, n_draw, n_block), see `log_likelihood_blocks`.
    blocks : names of these blocks.
    n_walkers : of each ensemble.
    seed : of the run.
    diagnostics : whether the draws may be used.
    attrs : versions, command, start and end time, ...
    of_model : (n_ensemble, n_draw), which of `diagnostics.models` each draw is of; None for the draws of one model.
    """

    experiment: Experiment
    sweeps: tuple[Sweep, ...]
    parameters: tuple[ParameterInfo, ...]
    fixed: Mapping[str, float]
    forward_name: str
    draws: FloatArray
    log_prob: FloatArray
    log_likelihood: FloatArray
    blocks: tuple[str, ...]
    n_walkers: int
    seed: int
    diagnostics: Diagnostics
    attrs: Mapping[str, str]
    of_model: IntArray | None = None

    @cached_property
    def table(self) -> UnknownTable:
        """The unknowns made ready to be given values, see `values_at`."""
        return table_of(self.parameters, self.experiment)

    def to_xarray(self) -> xarray.Dataset:
        """The draws as an `xarray.Dataset`, the group "posterior" of `posterior.nc`: for plots, and for ArviZ's functions.

        One variable for each quantity, with the dimensions chain (ensemble), draw, and specimen or sweep where each of them
        has a value of its own. SI, units in the attributes; draws in the order of `calib.sampling.layout.chain_order`.
        """
        return unknowns(self.parameters, self.sweeps, self.draws[:, self.order])

    def to_dataframe(self) -> pd.DataFrame:
        """The draws as a table: one row for each draw, one column for each unknown, named as in `summary.json`, SI.

        Rows are numbered by chain (ensemble) and draw, as in `to_xarray`.
        """
        import pandas as pd

        n_chain, n_draw, n_parameter = self.draws.shape
        rows = pd.MultiIndex.from_product([range(n_chain), range(n_draw)], names=["chain", "draw"])
        values = self.draws[:, self.order].reshape(-1, n_parameter)
        return pd.DataFrame(values, index=rows, columns=[p.name for p in self.parameters])

    @cached_property
    def draws_sha256(self) -> str:
        """What tells these draws from others: SHA-256 of the draws, of what they are of, and of the forward model's name.

        What is made from a posterior follows from it, whatever else the experiment file says by now, and is compared by this.
        """
        digest = hashlib.sha256(
            json.dumps([self.forward_name, [p.name for p in self.parameters], dict(self.fixed)], sort_keys=True).encode()
        )
        for array in (self.draws, self.of_model):
            if array is not None:
                digest.update(np.ascontiguousarray(array).tobytes())
        return digest.hexdigest()

    @property
    def unknowns(self) -> tuple[ParameterInfo, ...]:
        """Those of `parameters` that were sampled, whose draws come first."""
        return self.parameters[: len(self.parameters) - len(of_lot(self))]

    @property
    def order(self) -> npt.NDArray[np.intp]:
        """Index of the draw of an ensemble that stands at each place in files and tables, (n_draw,), see `chain_order`."""
        return chain_order(self.draws.shape[1], self.n_walkers)


def thin_draws(posterior: Posterior, n: int, rng: np.random.Generator) -> dict[str, FloatArray]:
    """Pick draws of a posterior at random without repetition, for computations that take too long for all of them.

    Parameters
    ----------
    posterior : as sampled or loaded.
    n : how many; all, if there are fewer.
    rng : of the choice.

    Returns
    -------
    Parameter name -> SI values (n,), fixed ones included.
    """
    flat = posterior.draws.reshape(-1, posterior.draws.shape[-1])
    chosen = flat[rng.choice(flat.shape[0], size=min(n, flat.shape[0]), replace=False)]
    return named_draws(posterior, chosen)


def named_draws(posterior: Posterior, draws: FloatArray) -> dict[str, FloatArray]:
    """Give draws of a posterior by name, as forward models and predictions take them.

    Parameters
    ----------
    posterior : that the draws are of.
    draws : (n, n_parameter), SI.

    Returns
    -------
    Parameter name -> SI values (n,), fixed ones included.
    """
    values = {p.name: np.ascontiguousarray(draws[:, k]) for k, p in enumerate(posterior.parameters)}
    return values | {name: np.full(draws.shape[0], value) for name, value in posterior.fixed.items()}


def coverage_intervals(posterior: Posterior, probability: float) -> dict[str, tuple[float, float]]:
    """Find between which values each parameter lies with a probability, as likely below as above (JCGM 101:2008, 7.7).

    Parameters
    ----------
    posterior : as sampled or loaded.
    probability : that the interval holds [1].

    Returns
    -------
    Parameter name -> lower and upper end, SI.
    """
    flat = posterior.draws.reshape(-1, posterior.draws.shape[-1])
    lower, upper = np.quantile(flat, [(1 - probability) / 2, (1 + probability) / 2], axis=0)
    return {p.name: (float(lower[k]), float(upper[k])) for k, p in enumerate(posterior.parameters)}


def leave_out(posterior: Posterior) -> LeaveOut:
    """Estimate how well a posterior's model predicts blocks of the data from the others (PSIS-LOO), to compare models.

    Blocks that fit badly stand out in the pointwise values.
    """
    n = posterior.log_prob.size
    ess = min(s.ess_bulk for s in posterior.diagnostics.parameters.values())
    return leave_blocks_out(posterior.log_likelihood, relative_efficiency=min(1.0, ess / n))

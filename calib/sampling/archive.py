"""Draws and their surroundings as plain arrays to ArviZ's containers and NetCDF files, and back.

The one module that knows ArviZ's containers.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from calib.errors import Fault, InputError
from calib.files import whole_file
from models.sensor import FloatArray

with warnings.catch_warnings():
    # The first import of each day announces the next major version, which the project's requirements exclude.
    warnings.simplefilter("ignore", FutureWarning)
    import arviz

# Its functions are only partly typed.
az: Any = arviz

_ENGINE = "h5netcdf"


@dataclass(frozen=True, eq=False)
class Archive:
    """What a NetCDF file of draws holds.

    Attributes
    ----------
    posterior : parameter name -> (n_chain, n_draw).
    log_prob : (n_chain, n_draw). log_likelihood : (n_chain, n_draw, n_block), blocks of neighbouring points.
    observed : name of a record -> its readings, (n_point,).
    attrs : texts.
    """

    posterior: Mapping[str, FloatArray]
    log_prob: FloatArray
    log_likelihood: FloatArray
    observed: Mapping[str, FloatArray]
    attrs: Mapping[str, str]


#: Largest k-hat at which leaving out a block of data can be judged (Vehtari, Gelman, Gabry 2017).
K_HAT = 0.7


@dataclass(frozen=True, eq=False)
class LeaveOut:
    """Expected log predictive density of left-out blocks by Pareto-smoothed importance sampling (PSIS-LOO).

    Attributes
    ----------
    elpd, se, p_loo : sum over blocks, its standard error, effective number of parameters.
    pointwise, k_hat : (n_block,); above 0.7 a block's k-hat says that its elpd cannot be trusted.
    """

    elpd: float
    se: float
    p_loo: float
    pointwise: FloatArray
    k_hat: FloatArray

    @property
    def trusted(self) -> bool:
        """Whether every block's k-hat is at most `K_HAT`."""
        return bool(np.all(self.k_hat <= K_HAT))


def rank_r_hat(chains: FloatArray) -> float:
    """Rank-normalised split R-hat of chains (n_chain, n_draw) in order of time (Vehtari et al. 2021); nan if all are alike."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(az.rhat(chains, method="rank"))


def effective_sample_size(chains: FloatArray, *, tail: bool = False) -> float:
    """Bulk (or tail, 5 % and 95 %) effective sample size of chains (n_chain, n_draw) (Vehtari et al. 2021)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(az.ess(chains, method="tail" if tail else "bulk"))


def leave_blocks_out(log_likelihood: FloatArray, *, relative_efficiency: float = 1.0) -> LeaveOut:
    """PSIS-LOO (Vehtari, Gelman, Gabry 2017) over blocks.

    Parameters
    ----------
    log_likelihood : (n_chain, n_draw, n_block), log density of each block given all others and the draw.
    relative_efficiency : effective over nominal number of draws.
    """
    n_draw = log_likelihood.shape[:2]
    data = az.from_dict(posterior={"dummy": np.zeros(n_draw)}, log_likelihood={"blocks": log_likelihood})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a large k-hat, which is part of the result
        warnings.simplefilter("ignore", RuntimeWarning)  # overflow where the fit of the tail weighs its own candidates
        found = az.loo(data, var_name="blocks", pointwise=True, reff=relative_efficiency)
    pointwise, k_hat = np.asarray(found.loo_i.values, dtype=float), np.asarray(found.pareto_k.values, dtype=float)
    return LeaveOut(float(found.elpd_loo), float(found.se), float(found.p_loo), pointwise, k_hat)


def smooth_weights(log_ratio: FloatArray, *, relative_efficiency: float = 1.0) -> tuple[FloatArray, float]:
    """Pareto-smoothed importance weights (n,) with sum 1, and k-hat (Vehtari et al., J. Mach. Learn. Res. 25 (2024) 72).

    Parameters
    ----------
    log_ratio : (n,), log of target over proposal density at each draw, up to a constant; -inf for a weight of zero.
    relative_efficiency : effective over nominal number of draws.

    Returns
    -------
    k-hat is 0 where all ratios are alike, which leaves no tail to fit; inf where fewer than five draws make the tail (n <= 20).
    Weights are nan if every ratio is -inf.
    """
    likely = np.isfinite(log_ratio)
    if not np.any(likely):
        return np.full(log_ratio.shape, np.nan), float("inf")
    if np.ptp(log_ratio[likely]) < 1e-9:
        return likely / np.count_nonzero(likely), 0.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # as in `leave_blocks_out`
        smoothed, k_hat = az.psislw(log_ratio - np.max(log_ratio), reff=relative_efficiency)
    return np.exp(_array(smoothed)), float(k_hat)


def write_archive(archive: Archive, path: Path) -> None:
    """Write NetCDF 4 atomically, with ArviZ's groups posterior, sample_stats, log_likelihood and observed_data."""
    data = az.from_dict(
        posterior={_safe(name): np.asarray(draws) for name, draws in archive.posterior.items()},
        sample_stats={"lp": archive.log_prob},
        log_likelihood={"blocks": archive.log_likelihood},
        observed_data={_safe(name): np.asarray(readings) for name, readings in archive.observed.items()},
        dims={_safe(name): [f"{_safe(name)} point"] for name in archive.observed} | {"blocks": ["block"]},
        attrs={**archive.attrs, "names": json.dumps([list(archive.posterior), list(archive.observed)])},
    )
    with whole_file(path) as whole:
        data.to_netcdf(str(whole), engine=_ENGINE)


def read_archive(path: Path) -> Archive:
    """The archive that `write_archive` wrote.

    Raises
    ------
    InputError
        If the file does not exist, cannot be read, or is not such an archive.
    """
    try:
        data = az.from_netcdf(str(path), engine=_ENGINE)
        names, records = json.loads(data.attrs["names"])
        posterior = {name: _array(data.posterior[_safe(name)].values) for name in names}
        observed = {name: _array(data.observed_data[_safe(name)].values) for name in records}
        attrs = {k: str(v) for k, v in data.attrs.items() if k != "names"}
        return Archive(
            posterior, _array(data.sample_stats["lp"].values), _array(data.log_likelihood["blocks"].values), observed, attrs
        )
    except FileNotFoundError:
        raise InputError(Fault("there is no such file", path, advice="Run `calib calibrate` first")) from None
    except (OSError, ValueError, KeyError, AttributeError, TypeError) as error:
        raise InputError(Fault(f"this is not a posterior that calib wrote ({error})", path)) from error


def _safe(name: str) -> str:
    """Name of a NetCDF variable: a slash would make a group of it."""
    return name.replace("/", "∕")


def _array(values: object) -> FloatArray:
    return np.array(values, dtype=float)

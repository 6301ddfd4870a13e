"""Plain arrays and data sets in, ArviZ's numbers, its container and its NetCDF files out: the one module that imports ArviZ."""

from __future__ import annotations

import errno
import io
import os
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from calib.errors import Fault, InputError
from calib.files import whole_file
from models.seal import sealed, unsealed
from models.sensor import FloatArray

if TYPE_CHECKING:
    import xarray

_ENGINE: Final = "h5netcdf"

# Random numbers hardly shrink: the fastest of zlib's levels with their bytes sorted takes what can be had.
_COMPRESSION = {"zlib": True, "complevel": 1, "shuffle": True}


#: Largest k-hat at which leaving out a block of data can be judged (Vehtari, Gelman, Gabry 2017).
K_HAT = 0.7


@dataclass(frozen=True, eq=False)
class LeaveOut:
    """Expected log predictive density of left-out blocks by Pareto-smoothed importance sampling (PSIS-LOO).

    Attributes
    ----------
    elpd, se, p_loo : sum over blocks, its standard error, effective number of parameters.
    pointwise, k_hat : (n_block,); above 0.7 a block's k-hat says that its elpd cannot be trusted, unless it is among the
        `refitted`, for which it was computed without importance weights of these draws.
    """

    elpd: float
    se: float
    p_loo: float
    pointwise: FloatArray
    k_hat: FloatArray
    refitted: tuple[int, ...] = ()

    @property
    def doubtful(self) -> tuple[int, ...]:
        """Numbers of the blocks whose elpd cannot be trusted."""
        return tuple(int(k) for k in np.flatnonzero(~(self.k_hat <= K_HAT)) if k not in self.refitted)

    @property
    def trusted(self) -> bool:
        """Whether every block's elpd can be trusted."""
        return not self.doubtful


def load_arviz() -> Any:
    """ArviZ, whose functions are only partly typed, loaded when it is needed first: that takes a second."""
    with warnings.catch_warnings():
        # The first import of each day announces the next major version, which the project's requirements exclude.
        warnings.simplefilter("ignore", FutureWarning)
        try:
            import arviz
        except OSError:
            # It notes the day in the user's cache, and cannot be imported where the user may not write there.
            with tempfile.TemporaryDirectory() as folder, _cache_in(folder):
                import arviz
    return arviz


@contextmanager
def _cache_in(folder: str) -> Iterator[None]:
    """Let libraries keep in a folder what they would keep in the user's cache."""
    before = os.environ.get("XDG_CACHE_HOME")
    os.environ["XDG_CACHE_HOME"] = folder
    try:
        yield
    finally:
        del os.environ["XDG_CACHE_HOME"]
        if before is not None:
            os.environ["XDG_CACHE_HOME"] = before


def rank_r_hat(chains: FloatArray) -> float:
    """Measure whether independent chains agree: rank-normalised split R-hat, near 1 if they do (Vehtari et al. 2021).

    The chains are (n_chain, n_draw), early draws first; nan if all draws are alike.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(load_arviz().rhat(chains, method="rank"))


def effective_sample_size(chains: FloatArray, *, tail: bool = False) -> float:
    """How many independent draws correlated draws are worth, for means (bulk) or for the ends of intervals (tail).

    Parameters
    ----------
    chains : (n_chain, n_draw), draws of one parameter.
    tail : whether the number is that for the 5 % and 95 % quantiles.

    Returns
    -------
    Effective sample size (Vehtari et al. 2021).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(load_arviz().ess(chains, method="tail" if tail else "bulk"))


def leave_blocks_out(log_likelihood: FloatArray, *, relative_efficiency: float = 1.0) -> LeaveOut:
    """Estimate how well a model predicts blocks of data that it was not fitted to, without fitting anew: PSIS-LOO over blocks.

    Reference: Vehtari, Gelman, Gabry, Stat. Comput. 27 (2017) 1413.

    Parameters
    ----------
    log_likelihood : (n_chain, n_draw, n_block), log density of each block given all others and the draw.
    relative_efficiency : effective over nominal number of draws.
    """
    n_draw = log_likelihood.shape[:2]
    data = load_arviz().from_dict(posterior={"dummy": np.zeros(n_draw)}, log_likelihood={"blocks": log_likelihood})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # a large k-hat, which is part of the result
        warnings.simplefilter("ignore", RuntimeWarning)  # overflow where the fit of the tail weighs its own candidates
        found = load_arviz().loo(data, var_name="blocks", pointwise=True, reff=relative_efficiency)
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
        smoothed, k_hat = load_arviz().psislw(log_ratio - np.max(log_ratio), reff=relative_efficiency)
    return np.exp(_array(smoothed)), float(k_hat)


def inference_data(groups: Mapping[str, xarray.Dataset], attrs: Mapping[str, str]) -> Any:
    """Put data sets into ArviZ's container, for its functions: an `arviz.InferenceData`.

    The one place that names this container. ArviZ 1.x has `xarray.DataTree` in its stead, which `xarray.open_datatree`
    makes of the file that `write_groups` writes.

    Parameters
    ----------
    groups : name of a group, such as "posterior" -> data set.
    attrs : texts that belong to the whole.
    """
    return load_arviz().InferenceData(attrs=dict(attrs), **groups)


def write_groups(groups: Mapping[str, xarray.Dataset], attrs: Mapping[str, str], path: Path) -> None:
    """Write data sets as the groups of one NetCDF 4 file, atomically, as `arviz.from_netcdf` of ArviZ 0.x and 1.x reads it.

    The file is made in memory, as HDF5 ends the program where it cannot write to the disk, and ends with its checksum.

    Parameters
    ----------
    groups : "posterior", "observed_data", ... -> data set.
    attrs : texts, kept with the file as a whole.
    path : of the file.

    Raises
    ------
    InputError
        If the folder does not exist.
    OSError
        If the file cannot be written, such as on a full disk; an earlier one stays as it was.
    """
    import h5netcdf
    import xarray
    from xarray.backends import H5NetCDFStore

    memory = io.BytesIO()
    with h5netcdf.File(memory, "w") as file:
        xarray.Dataset(attrs=dict(attrs)).dump_to_store(H5NetCDFStore(file))
        for name, dataset in groups.items():
            encoding = {str(key): _COMPRESSION for key, v in dataset.variables.items() if v.dtype.kind in "fi"}
            dataset.dump_to_store(H5NetCDFStore(file, group=name, mode="a"), encoding=encoding)
    content = sealed(memory.getvalue())
    with whole_file(path) as part:
        part.write_bytes(content)
        if part.read_bytes() != content:  # takes hundredths of a second; some network drives lose what they cannot write
            raise OSError(errno.EIO, os.strerror(errno.EIO), str(path))


def open_groups(path: Path) -> Archive:
    """Open a file that `write_groups` wrote, if it is whole: HDF5 ends the program, or makes up numbers, on a damaged one.

    Raises
    ------
    InputError
        If the file does not exist.
    OSError, ValueError
        If it cannot be read, is not what was written, or is no NetCDF 4 file.
    """
    if not path.is_file():
        raise InputError(Fault("there is no such file", path, advice="Run `calib calibrate` first"))
    return Archive(unsealed(path.read_bytes()))


@dataclass(frozen=True, eq=False)
class Archive:
    """The content of a file that `write_groups` wrote."""

    content: bytes

    def texts(self) -> dict[str, str]:
        """The texts that are kept with the file as a whole."""
        import xarray

        with xarray.open_dataset(io.BytesIO(self.content), engine=_ENGINE) as root:
            return {str(key): str(value) for key, value in root.attrs.items()}

    def group(self, name: str, variables: Sequence[str] | None = None) -> xarray.Dataset:
        """Read one group into memory.

        Parameters
        ----------
        name : of the group.
        variables : those to read; default all.

        Raises
        ------
        OSError, ValueError, KeyError
            If the group or a variable is not in it.
        """
        import xarray

        with xarray.open_dataset(io.BytesIO(self.content), group=name, engine=_ENGINE) as dataset:
            return (dataset if variables is None else dataset[list(variables)]).load()


def _array(values: object) -> FloatArray:
    return np.array(values, dtype=float)

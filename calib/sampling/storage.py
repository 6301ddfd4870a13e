"""A posterior to the file `posterior.nc` that ArviZ reads, and back to the last bit."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from calib.catalogue import UnknownName
from calib.errors import Fault, InputError
from calib.experiment import experiment_from_json, experiment_to_json
from calib.lab import sweeps_from_json, sweeps_to_json
from calib.priors import prior_from_json
from calib.problem import ParameterInfo
from calib.sampling.archive import open_groups, write_groups
from calib.sampling.diagnostics import diagnostics_from_json, diagnostics_to_json
from calib.sampling.groups import describe, make_groups
from calib.sampling.layout import chain_order, stacked
from calib.sampling.posterior import Posterior
from models.response import Forward
from models.sensor import FloatArray

#: Version of the file's content, raised when an older program could not read it.
FORMAT = 2

_VERSION = "calib_format"

_AGAIN = "Put a copy of it back, or write it anew from its checkpoints: `calib calibrate EXPERIMENT -o RUN --resume`"


def save_posterior(posterior: Posterior, path: Path | str, forward: Forward | None = None) -> None:
    """Write a posterior to one NetCDF 4 file, atomically, which ArviZ (`az.from_netcdf`) and `load_posterior` read.

    Parameters
    ----------
    posterior : with its experiment, data, diagnostics and versions, which are written, too.
    path : of the file.
    forward : the forward model it was sampled with, for the predictive groups, see `calib.sampling.groups.make_groups`;
        without it these are left out, and the file says so.

    Raises
    ------
    InputError
        If the folder does not exist.
    OSError
        If the file cannot be written; an earlier one stays as it was.
    """
    path = Path(path)
    record = {
        _VERSION: str(FORMAT),
        "experiment": experiment_to_json(posterior.experiment),
        "sweeps": sweeps_to_json(posterior.sweeps),
        "parameters": json.dumps([_parameter_to_json(p) for p in posterior.parameters]),
        "fixed": json.dumps(dict(posterior.fixed)),
        "diagnostics": diagnostics_to_json(posterior.diagnostics),
        "forward": posterior.forward_name,
        "seed": str(posterior.seed),
        "n_walkers": str(posterior.n_walkers),
        "attrs": json.dumps(dict(posterior.attrs)),
    }
    write_groups(make_groups(posterior, forward), describe(posterior, forward) | record, path)


def load_posterior(path: Path | str) -> Posterior:
    """Load the posterior that `save_posterior` wrote, its draws in the order in which they were sampled.

    Raises
    ------
    InputError
        If the file does not exist, is not to the last byte what `save_posterior` wrote, holds numbers that are not finite, or
        was written by another version of the program.
    """
    path = Path(path)
    try:
        return _restored(path)
    except InputError:
        raise
    except (OSError, ValueError, KeyError, AttributeError, TypeError, StopIteration) as error:
        raise InputError(Fault(f"this is not a posterior as calib wrote it ({error})", path, advice=_AGAIN)) from error


def _restored(path: Path) -> Posterior:
    archive = open_groups(path)
    record = archive.texts()
    if (found := _version(record)) != FORMAT:
        message = f"another version of calib wrote this posterior (format {found}, this version reads format {FORMAT})"
        advice = "Run `calib calibrate` again, or use the version that wrote it"
        raise InputError(Fault(message, path, advice=advice))
    parameters = tuple(_parameter_from_json(p) for p in json.loads(record["parameters"]))
    n_walkers = int(record["n_walkers"])
    stats = archive.group("sample_stats")
    log_prob = stats["lp"]
    blocks = archive.group("log_likelihood", ["blocks"])["blocks"]
    return Posterior(
        experiment=experiment_from_json(record["experiment"]),
        sweeps=sweeps_from_json(record["sweeps"]),
        parameters=parameters,
        fixed=json.loads(record["fixed"]),
        forward_name=record["forward"],
        draws=_as_sampled("draws", stacked(parameters, archive.group("posterior")), n_walkers),
        log_prob=_as_sampled("log posterior densities", log_prob.values, n_walkers),
        log_likelihood=_as_sampled("log likelihoods", blocks.values, n_walkers),
        blocks=tuple(str(name) for name in blocks["block"].values),
        n_walkers=n_walkers,
        seed=int(record["seed"]),
        diagnostics=diagnostics_from_json(record["diagnostics"]),
        attrs=json.loads(record["attrs"]),
        of_model=_as_sampled("models", stats["model"].values, n_walkers).astype(int) if "model" in stats else None,
    )


def _version(record: Mapping[str, str]) -> int:
    """Version of a file's content.

    Raises
    ------
    ValueError
        If it is no such file.
    """
    if _VERSION not in record:
        raise ValueError("it does not say what it is of")
    return int(record[_VERSION])


def _as_sampled(what: str, values: FloatArray, n_walker: int) -> FloatArray:
    """Draws (n_chain, n_draw, ...) in the order in which they were sampled, from that of `chain_order`."""
    if n_bad := np.count_nonzero(~np.isfinite(values)):
        raise ValueError(f"{n_bad} of the {values.size} {what} are not finite numbers")
    found = np.empty(values.shape)
    found[:, chain_order(values.shape[1], n_walker)] = values
    return found


def _parameter_to_json(p: ParameterInfo) -> dict[str, object]:
    return {"name": p.name, "prior": p.prior.to_json(), "origin": p.origin}


def _parameter_from_json(data: Mapping[str, object]) -> ParameterInfo:
    prior = data["prior"]
    if not isinstance(prior, dict):
        raise ValueError(f"a prior must be an object, got {prior!r}")
    return ParameterInfo(UnknownName.parse(str(data["name"])), prior_from_json(prior), str(data["origin"]))

"""A design and depths in, how much thinner its dielectrics become at most out, with the error of that: a small network.

What a ball of radius R that goes in by d makes of the dielectrics, each of thickness t_d beside mid-plane, is written

    T = (d / h) exp(n),     h = h_s + h_p,

T = 1 - t/t_d the largest thinning of either (`models.fem.capacitance.largest_thinning`), and n a network of the groups of the
design and of d. It learnt T from finite-element paths all over the range of the surrogates (`benchmarks/thinning.py`), and a
second one what the first misses of paths that it was not shown: the standard deviation of T over T + `SMALL`.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from models.seal import sealed, unsealed
from models.sensor import Design, FloatArray
from models.surrogate.coordinates import mechanical_features
from models.surrogate.domain import GAP, PADDING, SENSOR, groups_of, inside
from models.surrogate.families import NEO_HOOKEAN
from models.surrogate.network import Network, network_from

_FORMAT = 2

#: Thinning that counts as little: an error is a share of the thinning and this [1].
SMALL = 0.01

# How far the finite elements that were learnt from are off finer ones, as a share of the thinning (rms, usual grippers).
_OF_FINITE_ELEMENTS = 1e-4

# Indentations over a thickness at which their logarithms go over into constants.
_NEAR = 0.1


@dataclass(frozen=True, eq=False)
class Thinning:
    """The network, and how far it is off.

    Attributes
    ----------
    network : of `thinning_features`, to n.
    error : of the same, to the logarithm of the sd of T over T + `SMALL`.
    """

    network: Network
    error: Network

    def of(self, design: Design, depth: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How much thinner the dielectrics become, and the standard deviation of the error of that.

        Parameters
        ----------
        design : a batch of draws, with nothing that `thinning_refusal` names.
        depth : [m], (n_draw, n_depth); nan gives nan, as does a design outside the range of the surrogates.

        Returns
        -------
        Largest thinning [1] and its sd [1], (n_draw, n_depth).
        """
        groups = groups_of(design.draws())
        covered = inside(groups)
        groups = np.where(covered[:, None], groups, 1.0)
        over_radius = np.asarray(depth / np.asarray(design.indenter.radius, dtype=float).reshape(-1, 1))
        known = np.where(over_radius > 0, over_radius, 1e-9)
        features = thinning_features(groups, known)
        logs, log_sd = (network(features)[:, 0].reshape(known.shape) for network in (self.network, self.error))
        height = (groups[:, SENSOR] + groups[:, PADDING])[:, None]
        thinned = np.where(over_radius > 0, known / height * np.exp(logs), 0.0) + 0 * over_radius
        thinned[~covered] = np.nan
        return thinned, np.hypot(np.exp(log_sd) * (thinned + SMALL), _OF_FINITE_ELEMENTS * thinned)

    def save(self, path: Path) -> None:
        """Write as npz with a checksum behind it."""
        file = io.BytesIO()
        np.savez_compressed(file, **self._arrays())
        path.write_bytes(sealed(file.getvalue()))

    def _arrays(self) -> dict[str, Any]:
        return {"format": _FORMAT, **self.network.arrays("network"), **self.error.arrays("error")}


def thinning_features(groups: FloatArray, depth: FloatArray) -> FloatArray:
    """What the network sees of designs and depths.

    Parameters
    ----------
    groups : (n_draw, n_group), see `models.surrogate.domain.groups_from`.
    depth : d/R, (n_draw, n_depth), positive.

    Returns
    -------
    (n_draw * n_depth, n_feature), the depths of a draw together.
    """
    n_depth = depth.shape[1]
    contact = np.sqrt(depth).ravel()
    h_s, h_p = (np.repeat(groups[:, k], n_depth) for k in (SENSOR, PADDING))
    own = [contact, np.log(contact / (h_s + h_p) + _NEAR), np.log(contact / h_s + _NEAR), np.repeat(groups[:, GAP], n_depth)]
    return np.column_stack([np.repeat(mechanical_features(groups), n_depth, axis=0), *own])


def thinning_refusal(design: Design) -> str:
    """Say what designs have of which the thinning is not known; empty if there is nothing.

    Parameters
    ----------
    design : one, or a batch of draws.
    """
    why = NEO_HOOKEAN.refusal(design.draws())
    return f"the thinning of the dielectric {why}" if why else ""


@cache
def load_thinning() -> Thinning:
    """Read what is shipped with the package.

    Raises
    ------
    ValueError
        If the file is not, to the last byte, as it was written.
    """
    data = unsealed((files("models.surrogate") / "data" / "thinning.npz").read_bytes())
    with np.load(io.BytesIO(data), allow_pickle=False) as file:
        arrays: Mapping[str, Any] = {name: file[name] for name in file.files}
    if int(arrays["format"]) != _FORMAT:
        raise ValueError(f"thinning.npz has format {int(arrays['format'])}, this version reads {_FORMAT}")
    return Thinning(network_from(arrays, "network"), network_from(arrays, "error"))

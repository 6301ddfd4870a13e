"""Unknowns, sweeps and draws in, the data sets of `posterior.nc` with their dimensions, labels and units, and back, out.

- A quantity of a specimen has the dimension `specimen`, one of a sweep `sweep`: one flat dimension of all sweeps, labelled by
  their titles. The specimen of each is the coordinate `sweep_specimen` of the constants (beside the draws it would stop
  `az.summary` of ArviZ 1.x). An unknown that only some of them have gets a dimension of its own, such as
  `clock_offset_sweep`: there is nothing to fill the gaps with. A quantity of a lot is a variable by itself, and those of its
  specimens are another: `young_modulus` and `young_modulus_of_specimens`.
- Readings have a flat dimension for each channel, such as `force_point`, over all sweeps, with the coordinates
  `force_specimen`, `force_sweep` and `force_number` (from 1 within the sweep).
- Draws of an ensemble, which is a chain here, are in the order of `chain_order`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from calib.catalogue import CHANNELS, QUANTITIES, UNKNOWNS
from calib.lab import Points, Sweep
from calib.problem import ParameterInfo
from models.sensor import FloatArray

if TYPE_CHECKING:
    import xarray

# --- the order of draws -------------------------------------------------------------------------------------------------


def chain_order(n_draw: int, n_walker: int) -> npt.NDArray[np.intp]:
    """Order in which the draws of an ensemble make an honest chain: where they stand in a list of steps, (n_draw,).

    First the early half of the draws, then the late half, and in each half walker by walker, each walker step by step. ArviZ
    splits every chain in the middle: its R-hat then compares early with late, and its effective sample size sees how slowly
    each walker moves, which is hidden where neighbouring draws are those of different walkers.

    Of an odd number of steps the middle one belongs to the early half for one half of the walkers and to the late half for the
    others, so that the split lies between the halves and no draw is lost. (Of an odd number of draws ArviZ leaves out the
    middle one, which stands between the halves.)

    Parameters
    ----------
    n_draw : of the ensemble, listed step by step: all walkers of one step, then of the next.
    n_walker : of the ensemble.

    Examples
    --------
    Four steps of two walkers, numbered 0, 1 (first step), 2, 3, ...:

    >>> chain_order(8, 2).tolist()
    [0, 2, 1, 3, 4, 6, 5, 7]
    """
    index = np.arange(n_draw)
    half = (index >= n_draw // 2).astype(int) + (index >= n_draw - n_draw // 2)
    return np.lexsort((index // n_walker, index % n_walker, half))


# What coordinates are, by their name or by its end behind that of a channel or a quantity.
_COORDINATES = {
    "chain": "chain, one for each ensemble of walkers, from 0",
    "draw": "draw of a chain, from 0",
    "block": "block of neighbouring points of a sweep",
    "point": "point of all sweeps, from 0",
    "number": "point of its sweep, from 1",
    "specimen": "specimen",
    "sweep": "sweep",
}


def labelled(dataset: xarray.Dataset) -> xarray.Dataset:
    """Say of every coordinate what it is, and of those that are numbers that they have no unit.

    Parameters
    ----------
    dataset : with coordinates of this module's names.
    """
    told = {}
    for name, values in dataset.coords.items():
        unit = {} if values.dtype.kind in "OU" else {"units": "1"}
        told[name] = values.assign_attrs({**unit, "long_name": _COORDINATES[str(name).rpartition("_")[2]]})
    return dataset.assign_coords(told)


# --- unknowns -----------------------------------------------------------------------------------------------------------


def unknowns(parameters: Sequence[ParameterInfo], sweeps: Sequence[Sweep], draws: FloatArray) -> xarray.Dataset:
    """Lay out draws of the unknowns as one variable for each quantity, with specimens and sweeps as dimensions.

    Parameters
    ----------
    parameters : the unknowns, in the order of the last axis of `draws`.
    sweeps : of the experiment.
    draws : (n_chain, n_draw, n_parameter), SI, in the order that they shall have.
    """
    import xarray

    variables: dict[str, object] = {}
    coords = _chain_and_draw(draws)
    for variable, columns in _columns(parameters).items():
        row = QUANTITIES[parameters[columns[0]].parameter]
        attrs = {"units": row.unit or "1", "long_name": row.label}
        dimension, labels = _owners([parameters[k] for k in columns], sweeps)
        if dimension:
            variables[variable] = (("chain", "draw", dimension), draws[..., columns], attrs)
            coords[dimension] = _texts(labels)
        else:
            variables[variable] = (("chain", "draw"), draws[..., columns[0]], attrs)
    return labelled(xarray.Dataset(variables, coords))


def stacked(parameters: Sequence[ParameterInfo], dataset: xarray.Dataset) -> FloatArray:
    """Read the draws back from the data set that `unknowns` made.

    Parameters
    ----------
    parameters : the unknowns, in the order that the last axis shall have.
    dataset : one variable for each quantity.

    Returns
    -------
    (n_chain, n_draw, n_parameter), SI.
    """
    found: list[FloatArray] = [np.empty(0)] * len(parameters)
    for variable, columns in _columns(parameters).items():
        values = np.asarray(dataset[variable].values, dtype=float)
        for position, k in enumerate(columns):
            found[k] = values if values.ndim == 2 else values[..., position]
    return np.stack(found, axis=-1)


def _columns(parameters: Sequence[ParameterInfo]) -> dict[str, list[int]]:
    """Variable -> which unknowns are values of it, in the order of the unknowns."""
    found: dict[str, list[int]] = {}
    of_lots = {p.parameter for p in parameters if not p.specimen}
    for k, p in enumerate(parameters):
        of_specimens = p.specimen and p.parameter in of_lots
        found.setdefault(f"{p.parameter}_of_specimens" if of_specimens else p.parameter, []).append(k)
    return found


def _owners(infos: Sequence[ParameterInfo], sweeps: Sequence[Sweep]) -> tuple[str, list[str]]:
    """Dimension and labels of the specimens or sweeps that a quantity's unknowns belong to; "" if all share it."""
    parameter = infos[0].parameter
    if not infos[0].specimen:
        return "", []
    if UNKNOWNS[parameter].scope == "sweep":
        # An unknown of a specimen's only sweep does not name the sweep.
        owners = [next(s for s in sweeps if s.specimen == i.specimen and i.sweep in ("", s.name)) for i in infos]
        return "sweep" if len(owners) == len(sweeps) else f"{parameter}_sweep", [s.title for s in owners]
    names = [i.specimen for i in infos]
    return "specimen" if names == list(dict.fromkeys(s.specimen for s in sweeps)) else f"{parameter}_specimen", names


def _texts(names: Sequence[str]) -> npt.NDArray[np.object_]:
    return np.array(list(names), dtype=object)


def _chain_and_draw(draws: npt.NDArray[np.floating]) -> dict[str, object]:
    return {"chain": np.arange(draws.shape[0]), "draw": np.arange(draws.shape[1])}


# --- readings -----------------------------------------------------------------------------------------------------------

#: New readings of all points together; each given what all other points of its sweep read; log densities of the latter.
Kind = Literal["new", "given others", "density"]

# Kind -> what it adds to the name of a channel, and words.
_KINDS: Mapping[Kind, tuple[str, str]] = {
    "new": ("", "new {}"),
    "given others": ("_given_others", "new {}, given all other points of its sweep"),
    "density": ("", "log density of the {}, given all other points of its sweep"),
}


def observed(sweeps: Sequence[Sweep]) -> xarray.Dataset:
    """Lay out what was measured: one variable for each channel, over all sweeps."""
    import xarray

    values = {name: np.concatenate([p.value for _, p in rows]) for name, rows in _measured(sweeps).items()}
    attrs = {name: {"units": CHANNELS[name].unit or "1", "long_name": _words(name)} for name in values}
    variables = {name: ((f"{name}_point",), column, attrs[name]) for name, column in values.items()}
    return labelled(xarray.Dataset(variables, _point_coordinates(sweeps)))


def constants(sweeps: Sequence[Sweep]) -> xarray.Dataset:
    """Collect what is known beside the readings: where and when each was taken, how much it counts, and the ball of each sweep.

    Numbers that a sweep did not record are nan.
    """
    import xarray

    meaning = {
        "n_effective": ("1", "independent readings in the point"),
        "displacement": ("m", "crosshead reading at the point"),
        "force": ("N", "load cell reading at the point"),
        "time": ("s", "time of the point, by the clock of its instrument"),
    }
    variables: dict[str, object] = {}
    coords = _point_coordinates(sweeps)
    for name, rows in _measured(sweeps).items():
        for part, (unit, label) in meaning.items():
            columns = [getattr(p, part) for _, p in rows]
            if all(c is None for c in columns):
                continue
            filled = [np.full(p.value.size, np.nan) if c is None else c for c, (_, p) in zip(columns, rows, strict=True)]
            attrs = {"units": unit, "long_name": f"{name}: {label}"}
            variables[f"{name}_{part}"] = ((f"{name}_point",), np.concatenate(filled), attrs)
    coords["sweep"] = _texts([s.title for s in sweeps])
    coords["sweep_specimen"] = ("sweep", _texts([s.specimen for s in sweeps]))
    ball = QUANTITIES["indenter_radius"]
    radii = np.array([s.indenter_radius for s in sweeps])
    variables["indenter_radius"] = (("sweep",), radii, {"units": ball.unit, "long_name": ball.label})
    return labelled(xarray.Dataset(variables, coords))


def of_readings(sweeps: Sequence[Sweep], columns: Mapping[str, npt.NDArray[np.floating]], kind: Kind) -> xarray.Dataset:
    """Lay out predicted readings, or densities of the actual ones, as one variable for each channel over all sweeps.

    Parameters
    ----------
    sweeps : of the experiment; the points of `columns` are theirs, one after the other.
    columns : channel -> (n_chain, n_draw, n_point), new readings [SI], or log densities [1] of the readings there are.
    kind : which of them.
    """
    import xarray

    suffix, said = _KINDS[kind]
    variables = {}
    for name, values in columns.items():
        unit = "1" if kind == "density" else CHANNELS[name].unit or "1"
        attrs = {"units": unit, "long_name": said.format(_words(name))}
        variables[name + suffix] = (("chain", "draw", f"{name}_point"), values, attrs)
    first = next(iter(columns.values()))
    return labelled(xarray.Dataset(variables, {**_chain_and_draw(first), **_point_coordinates(sweeps)}))


def _words(channel: str) -> str:
    return f"{channel}, {CHANNELS[channel].label}"


def _measured(sweeps: Sequence[Sweep]) -> dict[str, list[tuple[Sweep, Points]]]:
    """Channel -> the sweeps that have it, with their points."""
    found: dict[str, list[tuple[Sweep, Points]]] = {}
    for sweep in sweeps:
        for name, points in sweep.channels.items():
            found.setdefault(name, []).append((sweep, points))
    return found


def _point_coordinates(sweeps: Sequence[Sweep]) -> dict[str, object]:
    found: dict[str, object] = {}
    for name, rows in _measured(sweeps).items():
        size = [p.value.size for _, p in rows]
        point = f"{name}_point"
        found[point] = np.arange(sum(size))
        found[f"{name}_specimen"] = (point, np.repeat(_texts([s.specimen for s, _ in rows]), size))
        found[f"{name}_sweep"] = (point, np.repeat(_texts([s.title for s, _ in rows]), size))
        found[f"{name}_number"] = (point, np.concatenate([np.arange(n) + 1 for n in size]))
    return found

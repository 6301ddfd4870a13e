"""From points in the dimensionless groups to a `TrainingSet`: one finite-element path for each, run on any executor."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from models.fem.capacitance import largest_thinning, ring_capacitance
from models.fem.equilibrium import DiscreteSensor, Failure, State, compression, make_model
from models.fem.path import walk
from models.fem.solution import dimensionless
from models.layers import LayeredDesign, layered
from models.sensor import BoolArray, FloatArray, IntArray, design_from
from models.surrogate.domain import COMPRESSION, DEPTH, DIELECTRIC, ELECTRODE, OWN, PATH, group_names
from models.surrogate.families import NEO_HOOKEAN, Family
from models.surrogate.groups import BASE_FRICTION, FRICTION
from models.surrogate.store import RunStore


def _lobatto(n: int, low: float, high: float) -> FloatArray:
    return np.asarray(low + (high - low) * (1 - np.cos(np.pi * np.arange(n) / (n - 1))) / 2)


#: t_d/h_s and a_e/a at which the capacitance of a path is taken: Chebyshev points of t_d/h_s and of (a_e/a)^2.
DIELECTRIC_POINTS = _lobatto(6, *DIELECTRIC)
ELECTRODE_POINTS = np.sqrt(_lobatto(7, ELECTRODE[0] ** 2, ELECTRODE[1] ** 2))
#: Pairs of them, at each of which a design has a capacitance.
N_ELECTRIC = DIELECTRIC_POINTS.size * ELECTRODE_POINTS.size


# Largest substep of a path with friction. Of 12 random designs 95 % of the points are within 0.06 % (force) and 0.14 % (change)
# of paths in steps of 1/160; at `models.fem.path.FRICTION_STEP`, half of it and 1.8 times as long, within 0.06 and 0.09 %.
_FRICTION_STEP = 1 / 20

#: How depths of a discretised design are gone through, as `models.fem.path.walk` does.
Path = Callable[[DiscreteSensor, FloatArray], Iterator[State | Failure]]

_WALK: Path = partial(walk, friction_step=_FRICTION_STEP)

# What is kept of a run, by name.
_ARRAYS = ("depth", "force", "contact_radius", "compression", "thinning", "capacitance")


@dataclass(frozen=True, eq=False)
class TrainingSet:
    """Dimensionless loading paths; what lies beyond the end of a path is nan.

    Attributes
    ----------
    groups : (n_run, 4 + n_own) in the order of `models.surrogate.domain.group_names`.
    depth, force, contact_radius : (n_run, n_depth), d/R, F/(mu R^2) and over R.
    compression : (n_run, n_depth), largest thinning of a layer on the axis as a share of its thickness.
    thinning : (n_run, n_depth, n_dielectric), largest of a dielectric at `DIELECTRIC_POINTS`, likewise.
    capacitance : (n_run, n_depth, n_dielectric, n_electrode), C / C0 - 1 at `DIELECTRIC_POINTS` and `ELECTRODE_POINTS`.
    failures : (n_run,) sentences, empty for a path that came to its end.
    accuracy : of the finite elements.
    family : whose designs they are.
    """

    groups: FloatArray
    depth: FloatArray
    force: FloatArray
    contact_radius: FloatArray
    compression: FloatArray
    thinning: FloatArray
    capacitance: FloatArray
    failures: tuple[str, ...]
    accuracy: float
    family: Family = NEO_HOOKEAN

    @property
    def n_step(self) -> IntArray:
        """Steps of each path (n_run,)."""
        return np.asarray(np.sum(np.isfinite(self.depth), axis=1))

    @property
    def digest(self) -> str:
        """SHA-256 over the numbers, in the order of the runs."""
        h = hashlib.sha256()
        for name in ("groups", *_ARRAYS):
            h.update(np.ascontiguousarray(getattr(self, name)).tobytes())
        return h.hexdigest()

    def only(self, chosen: BoolArray) -> TrainingSet:
        """The runs that are `chosen` (n_run,)."""
        arrays = {name: getattr(self, name)[chosen] for name in ("groups", *_ARRAYS)}
        return replace(self, failures=tuple(np.array(self.failures)[chosen].tolist()), **arrays)

    def at(self, points: FloatArray) -> TrainingSet:
        """The runs at `points` (n, 4 + n_own), to the last digit."""
        wanted = {point.tobytes() for point in points}
        return self.only(np.array([own.tobytes() in wanted for own in self.groups], dtype=bool))

    def joined(self, other: TrainingSet) -> TrainingSet:
        """These runs and, behind them, those of another set of the same family, whatever its accuracy."""
        arrays: dict[str, Any] = {
            name: np.concatenate([getattr(self, name), getattr(other, name)]) for name in ("groups", *_ARRAYS)
        }
        return replace(self, failures=self.failures + other.failures, **arrays)


@dataclass(frozen=True, eq=False)
class TrainingRun:
    """One path as far as it came, arrays over its steps as in a `TrainingSet`, and why it ended early (`failure`) if it did."""

    depth: FloatArray
    force: FloatArray
    contact_radius: FloatArray
    compression: FloatArray
    thinning: FloatArray
    capacitance: FloatArray
    failure: str = ""

    @property
    def arrays(self) -> dict[str, FloatArray]:
        """What is kept of it, by name."""
        return {name: getattr(self, name) for name in _ARRAYS}


def design_of(groups: FloatArray, family: Family = NEO_HOOKEAN) -> LayeredDesign:
    """Make the design that has given groups.

    Parameters
    ----------
    groups : (4 + n_own,), in the order of `group_names`.
    family : whose base, contact and layers it has.

    Returns
    -------
    In the units of the finite elements: R = 1 and shear modulus 1 in the sensor.
    """
    h_s, h_p, a, modulus = (float(g) for g in groups[:OWN])
    values = {
        "indenter_radius": 1.0,
        "sensor_thickness": h_s,
        "sensor_radius": a,
        "young_modulus": 3.0,
        "relative_permittivity": 1.0,
        "padding_thickness": h_p,
        "padding_young_modulus": 3.0 * modulus,
    }
    return dimensionless(layered(design_from(values | values_beyond(groups, family), base=family.base)))[0]


def values_beyond(groups: FloatArray, family: Family) -> dict[str, float]:
    """What designs of a family have beyond geometry and the ratio of moduli.

    Parameters
    ----------
    groups : (4 + n_own,), in the order of `group_names`.
    family : that the design belongs to.

    Returns
    -------
    Parameter name -> value, of the family's own groups.
    """
    return {g.parameter: float(g.value(np.asarray(x))) for g, x in zip(family.own, groups[OWN:], strict=True)}


def run_point(groups: FloatArray, accuracy: float, family: Family = NEO_HOOKEAN, path: Path = _WALK) -> TrainingRun:
    """Press one design with the finite elements, as deep as a surrogate goes, and keep its curves.

    Parameters
    ----------
    groups : (4 + n_own,), the design, in the order of `group_names`.
    accuracy : of the finite elements.
    family : whose base, contact and layers it has.
    path : how depths are gone through.

    Returns
    -------
    Curves at `PATH` until a layer is thinned by `COMPRESSION`, or as far as equilibrium was found.
    """
    h_s, h_p, a = (float(g) for g in groups[:3])
    end = min(DEPTH, COMPRESSION * (h_s + h_p))
    model = make_model(design_of(groups, family), end, accuracy)
    dielectric, electrode = DIELECTRIC_POINTS * h_s, ELECTRODE_POINTS * a
    middle = np.full_like(dielectric, h_p + h_s / 2)
    lower, upper = np.concatenate([middle - dielectric, middle]), np.concatenate([middle, middle + dielectric])
    at_rest = 2 * np.pi * electrode**2 / dielectric[:, None]
    rows, thinning, capacitance, failure = [], [], [], ""
    for state in path(model, end * PATH**2):
        if isinstance(state, Failure):
            names = ", ".join(f"{k} = {g:.4g}" for k, g in zip(group_names(family), groups, strict=True))
            failure = f"{names}: {state.reason} at d/R = {state.depth:.4g} of {end:.4g}"
            break
        thinned = float(np.max(compression(model, state)))
        rows.append((state.depth, state.force, state.contact_radius, thinned))
        thinning.append(largest_thinning(model.mesh, state.u, h_p + h_s / 2, dielectric))
        rings = ring_capacitance(model.mesh, state.u, lower, upper, electrode).reshape(2, dielectric.size, electrode.size)
        capacitance.append(np.sum(rings, axis=0) / at_rest - 1)
        if thinned >= COMPRESSION:
            break
    depth, force, radius, compressed = np.array(rows).reshape(-1, 4).T
    of_gaps, change = np.array(thinning).reshape(-1, dielectric.size), np.array(capacitance).reshape(-1, *at_rest.shape)
    return TrainingRun(depth, force, radius, compressed, of_gaps, change, failure)


def electric_groups(points: FloatArray) -> FloatArray:
    """Every t_d/h_s and a_e/a at which the capacitance of designs is taken.

    Parameters
    ----------
    points : (n, 4 + n_own), the designs, in the order of `group_names`.

    Returns
    -------
    Groups (n * `N_ELECTRIC`, 6 + n_own), rows of one design together.
    """
    gap, width = (x.ravel() for x in np.meshgrid(DIELECTRIC_POINTS, ELECTRODE_POINTS, indexing="ij"))
    own = np.tile(np.stack([gap, width], axis=1), (len(points), 1))
    return np.concatenate([np.repeat(points, N_ELECTRIC, axis=0), own], axis=1)


def store_settings(accuracy: float, family: Family = NEO_HOOKEAN) -> dict[str, object]:
    """What the runs of a campaign have in common, so that no others get among them.

    Parameters
    ----------
    accuracy : of the finite elements.
    family : whose designs they are.

    Returns
    -------
    Settings for `models.surrogate.store.open_store`.
    """
    return {
        "family": family.name,
        "groups": list(group_names(family)),
        "accuracy": accuracy,
        "path": PATH.tolist(),
        "ends": [DEPTH, COMPRESSION],
        "dielectric": DIELECTRIC_POINTS.tolist(),
        "electrode": ELECTRODE_POINTS.tolist(),
        **({"friction step": _FRICTION_STEP} if {FRICTION, BASE_FRICTION} & {*family.own} else {}),
    }


def run_training(
    points: FloatArray,
    executor: Executor,
    store: RunStore,
    *,
    accuracy: float,
    family: Family = NEO_HOOKEAN,
    progress: Callable[[int, int], None] | None = None,
    run: Callable[[FloatArray, float, Family], TrainingRun] = run_point,
) -> None:
    """Run every point that is not in the store yet; every result is kept there as it comes in.

    A path that ends early is kept as far as it came, with the reason.

    Parameters
    ----------
    points : (n, 4 + n_own), in the order of `group_names`.
    executor : any of `concurrent.futures`: processes, or a Dask cluster's `Client.get_executor()`.
    store : where results are kept.
    accuracy : of the finite elements.
    family : whose designs they are.
    progress : called with the points done and their number, as results come in.
    run : what is done for a point, its accuracy and its family; the executor must be able to send it.
    """
    missing = [p for p in points if p not in store]
    done = len(points) - len(missing)
    if progress is not None and done:
        progress(done, len(points))
    futures = {executor.submit(run, p, accuracy, family): p for p in missing}
    try:
        for count, future in enumerate(as_completed(futures), start=done + 1):
            done_run = future.result()
            store.add(futures[future], done_run.arrays, done_run.failure)
            if progress is not None:
                progress(count, len(points))
    except BaseException:
        for future in futures:
            future.cancel()
        raise


def points_wanted(store: RunStore, sequence: FloatArray, n: int) -> FloatArray:
    """Choose which points to run next.

    Parameters
    ----------
    store : the runs there are.
    sequence : points (n_point, n_group) in the order in which they are wanted; those in the store are passed over.
    n : number of runs that the store is to hold.

    Returns
    -------
    The first of the sequence that bring the store to `n`, (n_new, n_group); none if it holds as many.
    """
    new = np.array([point not in store for point in sequence], dtype=bool)
    return np.asarray(sequence[new][: max(0, n - len(store))])


def training_set(store: RunStore, accuracy: float, family: Family = NEO_HOOKEAN) -> TrainingSet:
    """Every run in a store as one set, in the order of the points.

    Parameters
    ----------
    store : the runs.
    accuracy : of the finite elements they were made with.
    family : whose designs they are.

    Returns
    -------
    The training set, failed runs included.

    Raises
    ------
    ValueError
        If the store is empty.
    """
    runs = sorted(store.runs(), key=lambda run: tuple(run[0]))
    if not runs:
        raise ValueError("the store holds no runs")
    return TrainingSet(
        groups=np.array([point for point, _, _ in runs]),
        failures=tuple(failure for _, _, failure in runs),
        accuracy=accuracy,
        family=family,
        **{name: np.array([_padded(arrays[name]) for _, arrays, _ in runs]) for name in _ARRAYS},
    )


def _padded(steps: FloatArray) -> FloatArray:
    """Steps of one path, filled up with nan to the length of `PATH`."""
    out = np.full((PATH.size, *steps.shape[1:]), np.nan)
    out[: len(steps)] = steps
    return out

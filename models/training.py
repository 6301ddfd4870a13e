"""From a box of dimensionless groups to a `TrainingSet`: one finite-element loading path per point, run on any executor."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np
from scipy.stats import qmc

from models.fem import dimensionless
from models.fem.capacitance import ring_capacitance
from models.fem.equilibrium import Failure, make_model
from models.fem.path import walk
from models.layers import LayeredDesign, layered
from models.sensor import FloatArray, Scalar, design_from
from models.store import RunStore

#: The dimensionless groups that shape the mechanics, and the range the shipped surrogate is trained on.
GROUPS = MappingProxyType(
    {
        "h_s/R": (0.06, 0.5),
        "h_p/R": (0.0, 3.6),
        "a/R": (1.25, 4.0),
        "E_p/E": (0.25, 4.0),
    }
)
#: Ranges of the groups that only the capacitance knows.
DIELECTRIC = (0.1, 0.5)  # t_d / h_s
ELECTRODE = (0.5, 1.0)  # a_e / a

#: Offset c of the padding coordinate log(h_p/h_s + c), which is linear for thin padding and logarithmic for thick.
_PADDING_OFFSET = 0.3

#: Depths of a path: d = reach * s^2 at equal steps of s (contact radius grows about linearly in s).
PATH = np.arange(2, 17) / 16


def chebyshev_points(n: int, low: float, high: float) -> FloatArray:
    """Chebyshev-Lobatto points on [low, high], increasing, shape (n,)."""
    return np.asarray(low + (high - low) * (1 - np.cos(np.pi * np.arange(n) / (n - 1))) / 2)


DIELECTRIC_POINTS = chebyshev_points(4, *DIELECTRIC)
ELECTRODE_POINTS = chebyshev_points(7, *ELECTRODE)


def reach(sensor_thickness: Scalar, padding_thickness: Scalar, radius: Scalar) -> FloatArray:
    """Depth to which a path goes, all in units of R: a smooth minimum of three limits.

    57 % of the stack, 0.9 R, and 0.36 a^2 / R (contact at about 85 % of the disc). Any shape that broadcasts.
    """
    h = np.asarray(sensor_thickness) + np.asarray(padding_thickness)
    rim = 0.36 * np.asarray(radius) ** 2
    return np.asarray(((0.57 * h) ** -6.0 + 0.9**-6.0 + rim**-6.0) ** (-1 / 6), dtype=float)


def to_unit(groups: FloatArray) -> FloatArray:
    """Groups (n, 4) in the order of `GROUPS` to coordinates in [-1, 1].

    Logarithms, but for the padding log(h_p/h_s + 0.3) between its ends at the given h_s: what thin padding does depends on how
    thin it is against the sensor.
    """
    h_s, h_p, a, modulus = groups.T
    low, high = _padding_ends(h_s)
    padding = 2 * (np.log(h_p / h_s + _PADDING_OFFSET) - low) / (high - low) - 1
    return np.stack([_log_unit(h_s, "h_s/R"), padding, _log_unit(a, "a/R"), _log_unit(modulus, "E_p/E")], axis=1)


def from_unit(x: FloatArray) -> FloatArray:
    """Inverse of `to_unit`, (n, 4) to (n, 4)."""
    h_s, a, modulus = (_log_ununit(x[:, k], name) for k, name in ((0, "h_s/R"), (2, "a/R"), (3, "E_p/E")))
    low, high = _padding_ends(h_s)
    ratio = np.exp(low + (high - low) * (x[:, 1] + 1) / 2) - _PADDING_OFFSET
    h_p = np.where(ratio > 1e-12, ratio, 0.0) * h_s
    return np.stack([h_s, h_p, a, modulus], axis=1)


def _padding_ends(h_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    low, high = GROUPS["h_p/R"]
    return np.log(low / h_s + _PADDING_OFFSET), np.log(high / h_s + _PADDING_OFFSET)


def _log_unit(value: FloatArray, name: str) -> FloatArray:
    low, high = np.log(GROUPS[name])
    return np.asarray(2 * (np.log(value) - low) / (high - low) - 1)


def _log_ununit(x: FloatArray, name: str) -> FloatArray:
    low, high = np.log(GROUPS[name])
    return np.asarray(np.exp(low + (high - low) * (x + 1) / 2))


def design_points(n: int, seed: int) -> FloatArray:
    """Space-filling points (n, 4) in the groups: a scrambled Sobol sequence, denser towards the borders of the box.

    The cosine map gives the density that polynomial least squares wants (Cohen & Migliorati, SMAI J. Comput. Math. 3 (2017)
    181).
    """
    with np.errstate(all="ignore"):
        u = qmc.Sobol(4, rng=np.random.default_rng(seed)).random_base2(max(0, int(np.ceil(np.log2(n)))))[:n]
    return from_unit(-np.cos(np.pi * u))


@dataclass(frozen=True, eq=False)
class TrainingSet:
    """Dimensionless loading paths.

    Attributes
    ----------
    groups : (n_run, 4) in the order of `GROUPS`.
    force : (n_run, n_depth), F / (mu R^2).
    contact_radius : (n_run, n_depth), over R.
    capacitance : (n_run, n_depth, n_dielectric, n_electrode), C / C0 - 1 at `DIELECTRIC_POINTS` and `ELECTRODE_POINTS`.
    failures : one sentence per point that did not reach the end; such points are not in the arrays.
    accuracy, seed : of the finite elements and of the points.
    """

    groups: FloatArray
    force: FloatArray
    contact_radius: FloatArray
    capacitance: FloatArray
    failures: tuple[str, ...]
    accuracy: float
    seed: int

    @property
    def digest(self) -> str:
        """SHA-256 over the numbers."""
        h = hashlib.sha256()
        for a in (self.groups, self.force, self.contact_radius, self.capacitance):
            h.update(np.ascontiguousarray(a).tobytes())
        return h.hexdigest()

    def save(self, path: Path) -> None:
        """Write as npz."""
        np.savez_compressed(
            path,
            groups=self.groups,
            force=self.force,
            contact_radius=self.contact_radius,
            capacitance=self.capacitance,
            failures=np.array(self.failures, dtype=str),
            accuracy=self.accuracy,
            seed=self.seed,
        )


def load_training_set(path: Path) -> TrainingSet:
    """Read what `TrainingSet.save` wrote; nothing in the file is executed."""
    with np.load(path, allow_pickle=False) as data:
        return TrainingSet(
            data["groups"],
            data["force"],
            data["contact_radius"],
            data["capacitance"],
            tuple(str(f) for f in data["failures"]),
            float(data["accuracy"]),
            int(data["seed"]),
        )


@dataclass(frozen=True, eq=False)
class Run:
    """One path of a `TrainingSet`, or why there is none (`failure`)."""

    force: FloatArray
    contact_radius: FloatArray
    capacitance: FloatArray
    failure: str = ""


def design_of(groups: FloatArray) -> LayeredDesign:
    """The design with groups (4,) in the units of the finite elements: R = 1 and shear modulus 1 in the sensor."""
    h_s, h_p, a, modulus = (float(g) for g in groups)
    design = design_from(
        {
            "indenter_radius": 1.0,
            "sensor_thickness": h_s,
            "sensor_radius": a,
            "young_modulus": 3.0,
            "relative_permittivity": 1.0,
            "padding_thickness": h_p,
            "padding_young_modulus": 3.0 * modulus,
        }
    )
    return dimensionless(layered(design))[0]


def run_point(groups: FloatArray, accuracy: float) -> Run:
    """Finite-element path for one point (4,) of the groups, to `reach`, at `PATH`."""
    h_s, h_p, a, _ = (float(g) for g in groups)
    end = float(reach(h_s, h_p, a))
    model = make_model(design_of(groups), end, accuracy)
    dielectric, electrode = DIELECTRIC_POINTS * h_s, ELECTRODE_POINTS * a
    middle = np.full_like(dielectric, h_p + h_s / 2)
    lower, upper = np.concatenate([middle - dielectric, middle]), np.concatenate([middle, middle + dielectric])
    at_rest = 2 * np.pi * electrode**2 / dielectric[:, None]
    force, radius, capacitance = [], [], []
    for state in walk(model, end * PATH**2):
        if isinstance(state, Failure):
            names = ", ".join(f"{k} = {g:.4g}" for k, g in zip(GROUPS, groups, strict=True))
            return Run(*(np.empty(0),) * 3, failure=f"{names}: {state.reason} at d/R = {state.depth:.4g} of {end:.4g}")
        force.append(state.force)
        radius.append(state.contact_radius)
        rings = ring_capacitance(model.mesh, state.u, lower, upper, electrode).reshape(2, dielectric.size, electrode.size)
        capacitance.append(np.sum(rings, axis=0) / at_rest - 1)
    return Run(np.array(force), np.array(radius), np.array(capacitance))


def store_settings(accuracy: float) -> dict[str, object]:
    """What the runs of a campaign have in common, for `models.store.open_store`."""
    return {
        "groups": list(GROUPS),
        "accuracy": accuracy,
        "path": PATH.tolist(),
        "dielectric": DIELECTRIC_POINTS.tolist(),
        "electrode": ELECTRODE_POINTS.tolist(),
    }


def run_training(
    points: FloatArray,
    executor: Executor,
    *,
    accuracy: float,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    store: RunStore | None = None,
) -> TrainingSet:
    """Run every point (n, 4) on `executor`; `progress(done, total)` is called as results come in.

    Any `concurrent.futures` executor will do: processes, or a Dask cluster's `Client.get_executor()`. With a `store` every
    result is kept there as it comes in, and points that it holds already are not run again. Points where equilibrium is not
    found are left out and named in `TrainingSet.failures`.
    """
    runs: dict[int, Run] = {}
    for i, point in enumerate(points if store is not None else ()):
        found = store.find(point) if store is not None else None
        if isinstance(found, str):
            runs[i] = Run(*(np.empty(0),) * 3, failure=found)
        elif found is not None:
            runs[i] = Run(found["force"], found["contact_radius"], found["capacitance"])
    if progress is not None and runs:
        progress(len(runs), len(points))
    futures = {executor.submit(run_point, p, accuracy): i for i, p in enumerate(points) if i not in runs}
    try:
        for future in as_completed(futures):
            i, run = futures[future], future.result()
            runs[i] = run
            if store is not None:
                arrays = {"force": run.force, "contact_radius": run.contact_radius, "capacitance": run.capacitance}
                store.add(points[i], {} if run.failure else arrays, run.failure)
            if progress is not None:
                progress(len(runs), len(points))
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    good = [i for i in range(len(points)) if not runs[i].failure]
    return TrainingSet(
        points[good],
        np.stack([runs[i].force for i in good]),
        np.stack([runs[i].contact_radius for i in good]),
        np.stack([runs[i].capacitance for i in good]),
        tuple(runs[i].failure for i in range(len(points)) if runs[i].failure),
        accuracy,
        seed,
    )

"""From points in the dimensionless groups to a `TrainingSet`: one finite-element path for each, run on any executor."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from scipy.stats import qmc

from models.fem import dimensionless
from models.fem.capacitance import ring_capacitance
from models.fem.equilibrium import Failure, compression, make_model
from models.fem.path import walk
from models.layers import LayeredDesign, layered
from models.sensor import BoolArray, FloatArray, IntArray, design_from
from models.surrogate.domain import (
    COMPRESSION,
    DEPTH,
    DIELECTRIC,
    ELECTRODE,
    GROUPS,
    LENGTHS,
    MODULUS,
    NEO_HOOKEAN,
    PATH,
    Family,
)
from models.surrogate.store import RunStore


def _lobatto(n: int, low: float, high: float) -> FloatArray:
    return np.asarray(low + (high - low) * (1 - np.cos(np.pi * np.arange(n) / (n - 1))) / 2)


#: t_d/h_s and a_e/a at which the capacitance of a path is taken: Chebyshev points of t_d/h_s and of (a_e/a)^2.
DIELECTRIC_POINTS = _lobatto(6, *DIELECTRIC)
ELECTRODE_POINTS = np.sqrt(_lobatto(7, ELECTRODE[0] ** 2, ELECTRODE[1] ** 2))


#: By how much the points go beyond the range: a fit is worst where its points end.
_MARGIN = 1.1

#: Padding coordinate log(h_p + c), c = 0.15 mm: linear for thin padding, logarithmic for thick.
_PADDING_OFFSET = 0.15


def design_points(n: int, seed: int, family: Family = NEO_HOOKEAN) -> FloatArray:
    """Space-filling points (n, 5) in the groups, a little beyond the range of `domain`: a scrambled Sobol sequence.

    Even in the logarithms of R, h_s, a and E_p/E, in the padding's own coordinate and in 1/J_m, but half of the weight follows
    the Chebyshev density, which is denser towards the borders.
    """
    with np.errstate(all="ignore"):
        sobol = qmc.Sobol(_n_coordinate(family), rng=np.random.default_rng(seed))
        u = sobol.random_base2(max(0, int(np.ceil(np.log2(n)))))[:n]
    return _points_at((1 - np.cos(np.pi * u)) / 4 + u / 2, _MARGIN, family)


def random_groups(n: int, rng: np.random.Generator, family: Family = NEO_HOOKEAN) -> FloatArray:
    """Random points (n, 5) in the groups inside the range, even in the same coordinates."""
    return _points_at(rng.uniform(size=(n, _n_coordinate(family))), 1.0, family)


def _n_coordinate(family: Family) -> int:
    return 6 if family.stiffening else 5


def _points_at(u: FloatArray, margin: float, family: Family) -> FloatArray:
    """Groups (n, 5) at u in [0, 1]: R, h_s, h_p, a, E_p/E and 1/J_m over their ranges, widened by the factor `margin`."""
    low, high = np.array(list(LENGTHS.values())).T
    low, high = low / margin, high * margin
    radius, h_s = (low[k] * (high[k] / low[k]) ** u[:, k] for k in (0, 1))
    h_p = _PADDING_OFFSET * ((high[2] / _PADDING_OFFSET + 1) ** u[:, 2] - 1)
    narrow = np.maximum(low[3], radius / margin**0.3)
    a = narrow * (high[3] / narrow) ** u[:, 3]
    modulus = MODULUS[0] / margin * (MODULUS[1] / MODULUS[0] * margin**2) ** u[:, 4]
    stiffening = margin * family.stiffening * u[:, 5] if family.stiffening else np.zeros(len(u))
    return np.stack([h_s / radius, h_p / radius, a / radius, modulus, stiffening], axis=1)


# What is kept of a run, by name.
_ARRAYS = ("depth", "force", "contact_radius", "compression", "capacitance")


@dataclass(frozen=True, eq=False)
class TrainingSet:
    """Dimensionless loading paths; what lies beyond the end of a path is nan.

    Attributes
    ----------
    groups : (n_run, 5) in the order of `models.surrogate.domain.GROUPS`.
    depth, force, contact_radius : (n_run, n_depth), d/R, F/(mu R^2) and over R.
    compression : (n_run, n_depth), largest thinning of a layer on the axis as a share of its thickness.
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
        for a in (self.groups, self.depth, self.force, self.contact_radius, self.compression, self.capacitance):
            h.update(np.ascontiguousarray(a).tobytes())
        return h.hexdigest()

    def only(self, chosen: BoolArray) -> TrainingSet:
        """The runs that are `chosen` (n_run,)."""
        arrays = {name: getattr(self, name)[chosen] for name in ("groups", *_ARRAYS)}
        return replace(self, failures=tuple(np.array(self.failures)[chosen].tolist()), **arrays)


@dataclass(frozen=True, eq=False)
class Run:
    """One path as far as it came, arrays over its steps as in a `TrainingSet`, and why it ended early (`failure`) if it did."""

    depth: FloatArray
    force: FloatArray
    contact_radius: FloatArray
    compression: FloatArray
    capacitance: FloatArray
    failure: str = ""


def design_of(groups: FloatArray, family: Family = NEO_HOOKEAN) -> LayeredDesign:
    """The design with groups (5,) in the units of the finite elements: R = 1 and shear modulus 1 in the sensor."""
    h_s, h_p, a, modulus, stiffening = (float(g) for g in groups)
    design = design_from(
        {
            "indenter_radius": 1.0,
            "sensor_thickness": h_s,
            "sensor_radius": a,
            "young_modulus": 3.0,
            "relative_permittivity": 1.0,
            "padding_thickness": h_p,
            "padding_young_modulus": 3.0 * modulus,
            "stiffening": stiffening,
        },
        friction_coefficient=family.friction_coefficient,
    )
    return dimensionless(layered(design))[0]


def run_point(groups: FloatArray, accuracy: float, family: Family = NEO_HOOKEAN) -> Run:
    """Finite-element path for one point (5,) of the groups, at `PATH` until a layer is thinned by `COMPRESSION`."""
    h_s, h_p, a = (float(g) for g in groups[:3])
    end = min(DEPTH, COMPRESSION * (h_s + h_p))
    model = make_model(design_of(groups, family), end, accuracy)
    dielectric, electrode = DIELECTRIC_POINTS * h_s, ELECTRODE_POINTS * a
    middle = np.full_like(dielectric, h_p + h_s / 2)
    lower, upper = np.concatenate([middle - dielectric, middle]), np.concatenate([middle, middle + dielectric])
    at_rest = 2 * np.pi * electrode**2 / dielectric[:, None]
    rows, capacitance, failure = [], [], ""
    for state in walk(model, end * PATH**2):
        if isinstance(state, Failure):
            names = ", ".join(f"{k} = {g:.4g}" for k, g in zip(GROUPS, groups, strict=True))
            failure = f"{names}: {state.reason} at d/R = {state.depth:.4g} of {end:.4g}"
            break
        thinned = float(np.max(compression(model, state)))
        rows.append((state.depth, state.force, state.contact_radius, thinned))
        rings = ring_capacitance(model.mesh, state.u, lower, upper, electrode).reshape(2, dielectric.size, electrode.size)
        capacitance.append(np.sum(rings, axis=0) / at_rest - 1)
        if thinned >= COMPRESSION:
            break
    depth, force, radius, thinning = np.array(rows).reshape(-1, 4).T
    return Run(depth, force, radius, thinning, np.array(capacitance).reshape(-1, *at_rest.shape), failure)


def store_settings(accuracy: float, family: Family = NEO_HOOKEAN) -> dict[str, object]:
    """What the runs of a campaign have in common, for `models.surrogate.store.open_store`."""
    return {
        "family": family.name,
        "groups": list(GROUPS),
        "accuracy": accuracy,
        "path": PATH.tolist(),
        "ends": [DEPTH, COMPRESSION],
        "dielectric": DIELECTRIC_POINTS.tolist(),
        "electrode": ELECTRODE_POINTS.tolist(),
    }


def run_training(
    points: FloatArray,
    executor: Executor,
    store: RunStore,
    *,
    accuracy: float,
    family: Family = NEO_HOOKEAN,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Run every point (n, 5) that is not in the `store` yet on `executor`; every result is kept there as it comes in.

    Any `concurrent.futures` executor will do: processes, or a Dask cluster's `Client.get_executor()`. `progress(done, total)`
    is called as results come in. A path that ends early is kept as far as it came, with the reason.
    """
    missing = [p for p in points if p not in store]
    done = len(points) - len(missing)
    if progress is not None and done:
        progress(done, len(points))
    futures = {executor.submit(run_point, p, accuracy, family): p for p in missing}
    try:
        for count, future in enumerate(as_completed(futures), start=done + 1):
            run = future.result()
            store.add(futures[future], {name: getattr(run, name) for name in _ARRAYS}, run.failure)
            if progress is not None:
                progress(count, len(points))
    except BaseException:
        for future in futures:
            future.cancel()
        raise


def points_wanted(store: RunStore, sequence: Iterable[FloatArray], n: int) -> FloatArray:
    """The first points of `sequence` that bring the runs in the store to `n`; none if it holds as many."""
    new = (point for point in sequence if point not in store)
    return np.array(list(islice(new, max(0, n - len(store))))).reshape(-1, len(GROUPS))


def training_set(store: RunStore, accuracy: float, family: Family = NEO_HOOKEAN) -> TrainingSet:
    """Every run in the store, in the order of the points.

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

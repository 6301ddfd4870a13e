"""From a surrogate and fresh random designs to its error against finite elements, with the coverage of its own error."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from models.fem import FiniteElements
from models.response import ConvergenceError, Forward, OutOfRangeError, Response
from models.sensor import BoolArray, Design, FloatArray, design_from
from models.surrogate.domain import DIELECTRIC, ELECTRODE, OWN, PATH, group_names, groups_of
from models.surrogate.error_fit import Z90
from models.surrogate.families import NEO_HOOKEAN, Family
from models.surrogate.points import random_groups
from models.surrogate.surrogate import Surrogate
from models.surrogate.training import values_beyond

#: Changes of capacitance below this share of C0 are compared to it instead of to themselves.
CHANGE_FLOOR = 1e-4

#: Error above which the table counts the share of points.
WITHIN = 0.003


@dataclass(frozen=True, eq=False)
class Validation:
    """Surrogate against finite elements, point by point.

    Attributes
    ----------
    force_error, change_error : (n_design, n_depth), relative; the change of capacitance above `CHANGE_FLOOR`.
    force_score, change_score : (n_design, n_depth), errors in units of the surrogate's own standard deviation.
    coordinates : by name, what tells the points from each other: the groups that shape the mechanics of their designs, and how
        deep they lie, (n_design, n_depth) each.
    failures : sentences on designs for which the finite elements found no equilibrium.
    share_error : (n_design, n_depth), of a family whose change of capacitance may vanish: its error as a share of the change of
        the family that it adds to; None of any other.
    """

    force_error: FloatArray
    change_error: FloatArray
    force_score: FloatArray
    change_score: FloatArray
    coordinates: Mapping[str, FloatArray]
    failures: tuple[str, ...]
    share_error: FloatArray | None = None

    def table(self) -> list[tuple[str, str, str, str, str, str, str]]:
        """Rows: quantity, points, median, 95 %, worst of the absolute error in %, share within 0.3 %, coverage of 90 %."""
        rows = []
        kinds = [
            ("force", self.force_error, self.force_score),
            ("capacitance change", self.change_error, self.change_score),
        ]
        if self.share_error is not None:
            kinds.append(("change over that of the family it adds to", self.share_error, self.change_score))
        for name, error, score in kinds:
            size = np.abs(error)
            rows.append(
                (
                    name,
                    str(size.size),
                    f"{100 * np.median(size):.2f} %",
                    f"{100 * np.quantile(size, 0.95):.2f} %",
                    f"{100 * np.max(size):.2f} %",
                    f"{100 * np.mean(size <= WITHIN):.1f} % within {100 * WITHIN:.1f} %",
                    f"{100 * _covered(score):.1f} %",
                )
            )
        return rows

    def boxes(self) -> list[tuple[str, str, str, str, str]]:
        """The same in sub-boxes of the range, where a band that holds over all may not: quarters of points by each coordinate.

        Rows: coordinate with its quarter, 95 % of the absolute error of force and of the change, and their coverage of 90 %,
        each with its standard error as a share of so few designs: what is missed of one goes together along its path.
        """
        rows = []
        for name, values in self.coordinates.items():
            for low, high in pairwise(np.quantile(values, _QUARTERS)):
                inside = (values >= low) & (values <= high)
                force, change = (
                    f"{100 * np.quantile(np.abs(e[inside]), 0.95):.2f} %" for e in (self.force_error, self.change_error)
                )
                of_force, of_change = (_share_inside(score, inside) for score in (self.force_score, self.change_score))
                rows.append((f"{name} {low:.3g} to {high:.3g}", force, change, of_force, of_change))
        return rows


_QUARTERS = np.linspace(0, 1, 5)


def _covered(score: FloatArray) -> float:
    """Share of scores inside a normal 90 % interval."""
    return float(np.mean(np.abs(score) <= Z90))


def _share_inside(score: FloatArray, which: BoolArray) -> str:
    """Coverage of the points (n_design, n_depth) that are meant, with its standard error over designs, in words."""
    held = which & (np.abs(score) <= Z90)
    share = np.sum(held) / np.sum(which)
    of_designs = np.sum(held - share * which, axis=1)[np.any(which, axis=1)]
    error = np.sqrt(of_designs.size / max(of_designs.size - 1, 1) * np.sum(of_designs**2)) / np.sum(which)
    return f"{100 * share:.1f} ± {100 * error:.1f} %"


def random_designs(n: int, seed: int, family: Family = NEO_HOOKEAN) -> list[Design]:
    """Designs spread over the whole range of a surrogate (see `points.random_groups`), R 5 mm, E 0.6 MPa, eps_r 2.8.

    Parameters
    ----------
    n : number of designs.
    seed : of the draw.
    family : that they belong to.

    Returns
    -------
    One design each, no batch.
    """
    rng = np.random.default_rng(seed)
    radius, modulus = 5e-3, 0.6e6
    designs = []
    for groups in random_groups(n, rng, family):
        h_s, h_p, a, ratio = groups[:OWN]
        designs.append(
            design_from(
                {
                    "indenter_radius": radius,
                    "sensor_thickness": h_s * radius,
                    "padding_thickness": h_p * radius,
                    "sensor_radius": a * radius,
                    "young_modulus": modulus,
                    "padding_young_modulus": ratio * modulus,
                    "relative_permittivity": 2.8,
                    "dielectric_thickness": rng.uniform(*DIELECTRIC) * h_s * radius,
                    "electrode_radius": rng.uniform(*ELECTRODE) * a * radius,
                }
                | values_beyond(groups, family),
                base=family.base,
            )
        )
    return designs


#: Standard deviation of the finite elements' numerical error as a share of their accuracy: at 1e-3 their force scatters by
#: 4.5e-4 from depth to depth against 1.5e-4, without correlation.
_NUMERICAL = 0.5


@dataclass(frozen=True)
class Toleranced:
    """The model `inner` with an independent error at every depth, of sd `share` times force and change of capacitance."""

    inner: Forward
    share: float

    @property
    def name(self) -> str:
        """Name of the model inside."""
        return self.inner.name

    @property
    def identity(self) -> str:
        """Identity of the model inside, and the share."""
        return f"{self.inner.identity}, error {float(self.share)!r}"

    def max_depth(self, design: Design) -> FloatArray:
        """See `Forward.max_depth`, of the model inside."""
        return self.inner.max_depth(design)

    def outside(self, design: Design, depth: FloatArray) -> str:
        """See `Forward.outside`, of the model inside."""
        return self.inner.outside(design, depth)

    def respond(self, design: Design, depth: FloatArray) -> Response:
        """See `Forward.respond`: the response of the model inside, with the error added."""
        found = self.inner.respond(design, depth)
        each = self.share * np.eye(found.depth.shape[-1])
        change = found.capacitance - found.rest_capacitance[..., None]
        return replace(
            found,
            force_error=np.concatenate([found.force_error, found.force[..., None] * each], axis=-1),
            capacitance_error=np.concatenate([found.capacitance_error, change[..., None] * each], axis=-1),
            own_modes=found.own_modes + len(each),
        )


def toleranced(exact: FiniteElements) -> Toleranced:
    """The finite elements with the numerical error that goes with their accuracy."""
    return Toleranced(exact, _NUMERICAL * exact.accuracy)


def compare(fast: Response, truth: Response) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Measure how wrong a fast response is, and whether the error that it states is large enough.

    Parameters
    ----------
    fast : the response to judge, with the error that it states.
    truth : of the same design and depths; its own error, if any, is allowed for.

    Returns
    -------
    Four arrays of the shape of the responses': relative error of force; of the change of capacitance, in comparison with at
    least `CHANGE_FLOOR`; and errors of force and of capacitance in units of their stated sd, inf where `fast` states none.
    """
    floor = np.maximum(np.abs(truth.capacitance_change), CHANGE_FLOOR)
    force, capacitance = fast.force - truth.force, fast.capacitance - truth.capacitance
    scores = []
    for error, own, other in (
        (force, fast.force_error, truth.force_error),
        (capacitance, fast.capacitance_error, truth.capacitance_error),
    ):
        sd, both = np.linalg.norm(own, axis=-1), np.linalg.norm(np.concatenate([own, other], axis=-1), axis=-1)
        scores.append(np.divide(error, both, out=np.full(error.shape, np.inf), where=sd > 0))
    change = (fast.capacitance_change - truth.capacitance_change) / floor
    return fast.force / truth.force - 1, change, scores[0], scores[1]


def response_or_why(exact: Forward, design: Design, depth: FloatArray) -> Response | str:
    """Ask a model that may fail, in a way that a worker process can send back.

    Parameters
    ----------
    exact : the model.
    design : one, or a batch of draws.
    depth : [m], shape (n_depth,) or (n_draw, n_depth).

    Returns
    -------
    The response, or the sentence why there is none: no equilibrium, or out of its range.
    """
    try:
        return exact.respond(design, depth)
    except (ConvergenceError, OutOfRangeError) as error:
        return str(error)


def validate(
    surrogate: Surrogate,
    designs: list[Design],
    executor: Executor,
    *,
    accuracy: float = 1e-3,
    progress: Callable[[int, int], None] | None = None,
) -> Validation:
    """Compare a surrogate with fresh finite elements, at `domain.PATH` depths of each design, up to the largest it covers.

    Parameters
    ----------
    surrogate : to be judged.
    designs : one each, no batch.
    executor : any of `concurrent.futures`, that the finite elements run on.
    accuracy : of the finite elements.
    progress : called with the designs done and their number.

    Returns
    -------
    Errors point by point.
    """
    depths = [float(surrogate.max_depth(d)[0]) * (1 - 1e-12) * PATH**2 for d in designs]
    exact = FiniteElements(accuracy)
    futures = {executor.submit(response_or_why, exact, d, z): i for i, (d, z) in enumerate(zip(designs, depths, strict=True))}
    results: dict[int, Response | str] = {}
    for future in as_completed(futures):
        results[futures[future]] = future.result()
        if progress is not None:
            progress(len(results), len(designs))
    seen, compared, shares, failures = [], [], [], []
    for i, design in enumerate(designs):
        truth = results[i]
        if isinstance(truth, str):
            failures.append(truth)
            continue
        seen.append(i)
        fast = surrogate.respond(design, depths[i])
        compared.append(compare(fast, truth))
        if surrogate.family.signed and surrogate.base is not None:
            below = surrogate.base.respond(_without_own(design, surrogate.family), depths[i]).capacitance_change
            shares.append((fast.capacitance_change - truth.capacitance_change) / np.maximum(below, CHANGE_FLOOR))
    force, change, force_score, change_score = (np.array([c[k] for c in compared]) for k in range(4))
    groups = np.array([groups_of(designs[i].draws(), surrogate.family)[0] for i in seen])
    coordinates = {
        name: np.repeat(groups[:, k, None], PATH.size, axis=1) for k, name in enumerate(group_names(surrogate.family))
    }
    coordinates["depth over the largest"] = np.repeat(PATH[None] ** 2, len(seen), axis=0)
    share = np.array(shares) if shares else None
    return Validation(force, change, force_score, change_score, coordinates, tuple(failures), share)


def _without_own(design: Design, family: Family) -> Design:
    """The design without what its family has beyond geometry and the ratio of moduli."""
    plain = {group.parameter: group.plain for group in family.own}
    return design_from({**design.given(), **plain}, base=design.base)

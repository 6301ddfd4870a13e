"""From a `TrainingSet` to a `Surrogate`: its networks, and from the paths kept out of the fit its error.

The networks say the coefficients of polynomials along a path, and what their training makes small is what these polynomials
miss of the path's own points, not of other coefficients: fitting coefficients, which trade off against each other, costs twice
the error. One path in eight is kept out (of few, one in four). Of what the fit misses there, networks learn the standard
deviation along the path, and its correlation along the path gives modes of the error's covariance, scaled so that 90 % of what
was kept out lies inside the 90 % band.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from typing import Literal

import numpy as np

from models.sensor import BoolArray, FloatArray
from models.surrogate.coordinates import (
    N_DEPTH_TERMS,
    N_MECHANICAL,
    S_END,
    closed_change,
    closed_force,
    electric_features,
    fade_of_family,
    share_of_family,
    smooth_end,
    with_own,
)
from models.surrogate.curve_fit import curve, curves_along, train_curves
from models.surrogate.domain import COMPRESSION, DEPTH, PADDING, PATH, SENSOR, inside
from models.surrogate.error_fit import learn_error
from models.surrogate.families import Family
from models.surrogate.network import Network, least_squares, mean_network, train_network
from models.surrogate.pressed import CHANGE_SCALE
from models.surrogate.recalled import recalled_curves
from models.surrogate.surrogate import Surrogate
from models.surrogate.training import N_ELECTRIC, TrainingSet, electric_groups
from models.threads import one_thread

#: Steps of a training.
STEPS = 120_000

# Weight of a coarse path beside a fine one in the second half of the training, and the factor of what is missed of it up to a
# place along it, where too few of its elements touch to tell what a family adds.
_COARSE_WEIGHT = 0.1
_COARSE_FROM = 0.35
_COARSE_BEFORE = 0.05

#: Where most sensors of grippers lie, as h_s/R, h_p/R, a/R and E_p/E, and the widths of that region in logarithms. In a
#: second half of the training of the capacitance a path there has up to `_USUAL_WEIGHT` times more weight: posteriors of such
#: sensors are narrower than the error that is good enough for all designs.
_USUAL = np.array([0.15, 0.22, 2.0, 1.0])
_USUAL_WIDTH = np.array([0.6, 0.9, 0.5, 0.6])
_USUAL_WEIGHT = 100.0
_THIN_PADDING = 0.03  # added to h_p/R before its logarithm

#: Fewest training paths that `fit_surrogate` takes, and steps a path must have to be of use.
LEAST_PATHS = 64
_LEAST_STEPS = 8

# From so many paths on, one in eight is enough to estimate the error (of fewer, one in four is kept out).
_ENOUGH_PATHS = 2048

# From so many paths on the training of the capacitance has a second half near usual grippers.
_MANY_PATHS = 4096

# A change below zero by no more than this share of `CHANGE_SCALE` is rounding.
_ROUNDING = 0.1

# How much more a place weighs at most where a signed change is small beside that of the base.
_MOST_WEIGHT = 4.0


#: What a surrogate's networks are of, and what of it may stay: they or the error that it states.
Part = Literal["mechanics", "capacitance"]
PARTS: tuple[Part, ...] = ("mechanics", "capacitance")
Kept = Part | Literal["error"]
KEPT: tuple[Kept, ...] = (*PARTS, "error")


def fit_surrogate(
    data: TrainingSet,
    *,
    base: Surrogate | None = None,
    start: Surrogate | None = None,
    keep: Collection[Kept] = (),
    coarse: TrainingSet | None = None,
    recall: int = 0,
    hidden: tuple[tuple[int, ...], tuple[int, ...]] | None = None,
    steps: int = STEPS,
    seed: int = 0,
    progress: Callable[[str, int, int], None] | None = None,
) -> Surrogate:
    """Make a surrogate from training paths: every network, then those of its error from the paths kept out of the fit.

    Parameters
    ----------
    data : the paths.
    base : what the surrogate is to add to, of the family that its own `adds_to`; None to stand by itself.
    start : surrogate of the same family whose networks go on learning, and whose ends of paths are kept. None to learn all from
        the beginning.
    keep : parts of `start` that stay as they are. One stays with its error, so that the other alone goes on; of both the error
        is learnt anew, from all paths, none of which their networks may have been fitted to. The error may stay while both go
        on, from paths too few, or too much of a part of the range, to say it.
    coarse : paths of a lower accuracy, of the same family: all are fitted but those along which the capacitance falls, which is
        a wrong equilibrium, and none says how large the error is.
    recall : points all over the range at which networks that go on learn what they say already, beside new paths of a part of
        it, so as not to forget: see `recalled_curves`. None of these curves says how large the error is.
    hidden : layers of the networks of mechanics and of capacitance; the others are small. By default the family's.
    steps : of their training, first with equal weight of all paths, then as many again with less weight of coarse ones and,
        for the capacitance of `_MANY_PATHS` and more, with more weight near usual grippers; one without either has no second
        half, and networks that go on have that half alone.
    seed : of the paths kept out and of the networks' start.
    progress : called with the name of the network, the steps done and their number.

    Returns
    -------
    The surrogate, with its own error and where it comes from.

    Raises
    ------
    ValueError
        If fewer than `LEAST_PATHS` paths are of use, the capacitance falls along some, the networks that are to go on are of
        other sizes, there are none to keep or none to learn, or nothing that could be recalled beside new paths.
    """
    if keep and start is None:
        raise ValueError("no part can be kept without a surrogate to go on from")
    if {*keep} == {*KEPT}:
        raise ValueError("with all its parts kept a surrogate has nothing to learn")
    all_kept = {*keep} == {*PARTS}
    if recall and (start is None or all_kept or coarse is not None):
        raise ValueError("networks recall what they say where they go on from fine paths alone")
    hidden = hidden if hidden is not None else data.family.recipe.hidden
    beside = coarse if start is None or not recall else recalled_curves(start, recall, seed)
    data, n_fine = _of_use(data, beside)
    n_run = len(data.groups)
    # The points' order is that of the groups: some of a random order are spread over all of them.
    rng = np.random.default_rng(seed)
    fitted = np.full(n_run, not all_kept)
    fitted[rng.permutation(n_fine)[:: 8 if n_fine >= _ENOUGH_PATHS else 4]] = False

    def counting(name: str) -> Callable[[int, int], None] | None:
        return None if progress is None else lambda done, total: progress(name, done, total)

    # Runs first, then every electrode of every run.
    groups = electric_groups(data.groups)
    rows_of = np.arange(len(groups)) // N_ELECTRIC
    plain = electric_features(groups)
    electric = with_own(plain, groups, data.family)
    features = with_own(plain[::N_ELECTRIC, :N_MECHANICAL], data.groups, data.family)
    if start is None:
        log_end, certain = _ends(data)
        end = train_network(
            features[fitted],
            least_squares(log_end[fitted, None], np.where(certain, 1.0, 0.1)[fitted]),
            (24, 24, 1),
            steps=max(steps // 4, 1),
            rng=rng,
            batch=512,
            progress=counting("end of the paths"),
        )
    else:
        end = start.end
    thinned = (data.groups[:, SENSOR] + data.groups[:, PADDING]) * np.exp(end(features)[:, 0])
    follow = _to_follow(data, groups, plain, thinned, base)
    share = share_of_family(data.groups, data.family)
    # The first steps of coarse paths are mostly noise.
    fine = np.arange(n_run) < n_fine
    trusted = np.where(~fine[:, None] & (follow.s < _COARSE_FROM) & (coarse is not None), _COARSE_BEFORE, 1.0)
    fine_first = None if coarse is None else np.where(fine, 1.0, _COARSE_WEIGHT)
    # Few paths would be fitted too closely by more weight near usual grippers: 2,048 of Gent's law were, to 0.50 instead of
    # 0.42 % at 95 %. So would the force of any number, which would follow the scatter of the finite elements there.
    usual_first = fine_first
    if n_fine >= _MANY_PATHS:
        usual_first = weight_of_usual(data.groups) * (1.0 if fine_first is None else fine_first)
    first, second = rng.spawn(2)
    members = data.family.recipe.members

    def networks(
        name: Part,
        inputs: FloatArray,
        values: FloatArray,
        weight: FloatArray,
        power: int,
        emphasis: FloatArray | None,
        layers: tuple[int, ...],
        own: np.random.Generator,
    ) -> Network:
        """Those of a part: as they are, gone on, or from the beginning."""
        begun: Network | None = None if start is None else getattr(start, name)
        if begun is not None and name in keep:
            return begun
        names = [name if members == 1 else f"{name}, network {k} of {members}" for k in range(1, members + 1)]
        starts = [None] * members if begun is None else begun.singles
        if len(starts) != members:
            raise ValueError(f"{name} is to go on from the mean of {len(starts)} networks; it must be of {members}")
        curves = curves_along(follow.s, values, weight, power, follow.fade)
        of_each = partial(np.repeat, repeats=len(inputs) // n_run)
        weights = None if emphasis is None else of_each(emphasis)
        learn = partial(train_curves, inputs, curves, of_each(fitted), of_each(share), weights, layers, steps, own)
        return mean_network([learn(counting(each), one) for each, one in zip(names, starts, strict=True)])

    of_mechanics = np.array([[1.0], [0.3]]) * trusted[:, None]  # the contact radius steps from node to node and counts less
    of_change = (follow.weight_of_change * trusted[rows_of])[:, None]
    with one_thread(), ThreadPoolExecutor(2) as pool:
        learning = pool.submit(
            networks, "capacitance", electric, follow.electrical[:, None], of_change, 0, usual_first, hidden[1], second
        )
        mechanics = networks("mechanics", features, follow.mechanical, of_mechanics, 1, fine_first, hidden[0], first)
        capacitance = learning.result()

    # What the fit misses where the surrogate answers: on paths kept out, inside the range, to the depth it goes to.
    out = np.flatnonzero(~fitted & inside(groups[::N_ELECTRIC], data.family))
    rows = (out[:, None] * N_ELECTRIC + np.arange(N_ELECTRIC)).ravel()
    s_out = np.where(data.depth <= np.minimum(follow.limit, thinned)[:, None], follow.s, np.nan)[out]
    s_rows, faded = np.repeat(s_out, N_ELECTRIC, axis=0), follow.fade(follow.s)[out]
    force = share[out, None] * mechanics(features[out])[:, :N_DEPTH_TERMS]
    change = share[rows_of[rows], None] * capacitance(electric[rows])
    missed_force = follow.mechanical[out, 0] - faded * curve(force, s_out, 1)
    missed_change = follow.share_of_change[rows] * (
        follow.electrical[rows] - np.repeat(faded, N_ELECTRIC, axis=0) * curve(change, s_rows, 0)
    )
    most = max(steps // 8, 1)
    errors_kept = () if all_kept else keep
    if start is not None and {"mechanics", "error"} & {*errors_kept}:
        force_sd, force_modes = start.force_sd, start.force_modes
    else:
        force_sd, force_modes = learn_error(features[out], s_out, missed_force, out.size, most, rng)
    if start is not None and {"capacitance", "error"} & {*errors_kept}:
        capacitance_sd, capacitance_modes = start.capacitance_sd, start.capacitance_modes
    else:
        capacitance_sd, capacitance_modes = learn_error(electric[rows], s_rows, missed_change, out.size, most, rng)
    stated = {
        "error of force": f"{_in_words(missed_force)} ({out.size} paths kept out of the fit)",
        "error of capacitance change": f"{_in_words(missed_change)} (likewise)",
        "numpy": version("numpy"),
        "scipy": version("scipy"),
        "date": datetime.now(UTC).date().isoformat(),
    }
    if start is not None and all_kept:
        paths = f"{_paths_in_words(data, n_fine, coarse)}, hash (SHA-256) {data.digest}"
        provenance = {**start.provenance, "networks since": _named(start), "paths of the error": paths, **stated}
    else:
        again = ""
        if coarse is not None:
            again += f"{' and as many' * (start is None)} with less weight of coarse paths"
        if recall:
            again += f" beside {n_run - n_fine} curves that they said before"
        if n_fine >= _MANY_PATHS:
            again += f", of the capacitance {'as many again ' * (start is None)}with more weight near usual grippers"
        if start is not None:
            again += f", going on from those of {_named(start)}"
        means = f"means of {members} networks of " if members > 1 else ""
        sizes = ", ".join(" x ".join(map(str, layers)) for layers in hidden)
        provenance = {
            "model": data.family.words,
            "finite elements": f"Q2/P1, accuracy {data.accuracy:g}, K/mu 1e4",
            "training paths": _paths_in_words(data, n_fine, coarse) + _before(start),
            "training hash (SHA-256)": data.digest,
            "networks": f"{means}{sizes}, {N_DEPTH_TERMS} terms in depth, {steps} steps of SOAP{again}, seed {seed}",
            **({} if start is None else {part: f"kept from {_named(start)}" for part in keep}),
            **stated,
        }
    return Surrogate(
        end,
        mechanics,
        capacitance,
        force_sd,
        capacitance_sd,
        force_modes,
        capacitance_modes,
        provenance,
        data.family,
        base,
    )


def weight_of_usual(groups: FloatArray) -> FloatArray:
    """How much more designs near usual grippers are to count in the second half of a training, (n,).

    Parameters
    ----------
    groups : (n, >= 4), in the order of `models.surrogate.domain.group_names`.

    Returns
    -------
    1 far from `_USUAL`, `_USUAL_WEIGHT` more there.
    """
    plain, middle = groups[:, : _USUAL.size].copy(), _USUAL.copy()
    plain[:, PADDING] += _THIN_PADDING
    middle[PADDING] += _THIN_PADDING
    away = np.log(plain / middle) / _USUAL_WIDTH
    return np.asarray(1 + _USUAL_WEIGHT * np.exp(-np.sum(away**2, axis=1) / 2))


def _of_use(data: TrainingSet, coarse: TrainingSet | None) -> tuple[TrainingSet, int]:
    """Paths that can be fitted, fine ones first, and the number of these; an error if too few, or if the capacitance falls."""
    data = data.only(data.n_step >= _LEAST_STEPS)
    n_fine = len(data.groups)
    if n_fine < LEAST_PATHS:
        raise ValueError(f"{n_fine} training paths are too few; give at least {LEAST_PATHS}")
    if falling := int(np.sum(_falls(data))):
        raise ValueError(f"the capacitance falls along {falling} of {n_fine} training paths; only one that rises can be fitted")
    if coarse is not None:
        data = data.joined(coarse.only((coarse.n_step >= _LEAST_STEPS) & ~_falls(coarse)))
    return data, n_fine


@dataclass(frozen=True, eq=False)
class _Follow:
    """Curves that the polynomials are to follow, of n_run runs and of n electrodes of all of them.

    Attributes
    ----------
    s : (n_run, n_depth), places along the paths; nan beyond their end, or beyond that of the surrogate below.
    limit : (n_run,), depth to which the surrogate below goes.
    fade : from places (n_run, n_point) to what the polynomials are multiplied with there.
    mechanical : (n_run, 2, n_depth), of force and contact radius.
    electrical : (n, n_depth), of the change of capacitance.
    share_of_change, weight_of_change : (n, n_depth), see `_to_learn`.
    """

    s: FloatArray
    limit: FloatArray
    fade: Callable[[FloatArray], FloatArray]
    mechanical: FloatArray
    electrical: FloatArray
    share_of_change: FloatArray
    weight_of_change: FloatArray


def _to_follow(
    data: TrainingSet, groups: FloatArray, plain: FloatArray, thinned: FloatArray, base: Surrogate | None
) -> _Follow:
    """Curves beyond closed forms and base, for `groups` of all electrodes, their `plain` features and ends (n_run,)."""
    reach, limit = smooth_end(thinned), np.full(len(data.groups), DEPTH)
    if base is not None:
        limit, reach = base.ends(groups[::N_ELECTRIC], plain[::N_ELECTRIC])
    s = np.sqrt(data.depth / reach[:, None])
    s[s > S_END * (1 + 1e-9)] = np.nan
    if base is not None:  # beyond its range its polynomials are wild, and so would be what is to be added to them
        s[data.depth > limit[:, None] * (1 + 1e-9)] = np.nan

    def fade(points: FloatArray) -> FloatArray:
        return fade_of_family(data.groups, points**2 * reach[:, None], data.family)

    mechanical = np.stack(
        [
            np.log(data.force / closed_force(data.groups, data.depth, data.family.base)),
            np.log(data.contact_radius / np.sqrt(data.depth)),
        ],
        axis=1,
    )
    change, closed = _electric_curves(data, groups)
    log_below = np.log(closed)
    if base is not None:
        for factor, coefficients in zip((np.ones_like(s), fade(s)), base.coefficients(groups, plain), strict=True):
            if coefficients is None:
                continue
            below = coefficients.reshape(-1, 3, N_DEPTH_TERMS)
            mechanical = mechanical - np.stack([factor * curve(below[::N_ELECTRIC, k], s, 1) for k in range(2)], axis=1)
            each, along = (np.repeat(x, N_ELECTRIC, axis=0) for x in (factor, s))
            log_below = log_below + each * curve(below[:, 2], along, 0)
    return _Follow(s, limit, fade, mechanical, *_to_learn(change, log_below, data.family))


def _falls(data: TrainingSet) -> BoolArray:
    """Along which paths (n_run,) the capacitance falls below that at rest, by more than rounding, where it cannot be fitted."""
    if data.family.signed:
        return np.zeros(len(data.groups), dtype=bool)
    return np.asarray(np.any(data.capacitance < -_ROUNDING * CHANGE_SCALE, axis=(1, 2, 3)))


def _electric_curves(data: TrainingSet, groups: FloatArray) -> tuple[FloatArray, FloatArray]:
    """C/C0 - 1 and its closed form at all of these, (n, n_depth)."""
    depth, support = np.repeat(data.depth, N_ELECTRIC, axis=0), data.family.base
    change = np.moveaxis(data.capacitance.reshape(-1, PATH.size, N_ELECTRIC), 1, 2).reshape(-1, PATH.size)
    return change, closed_change(groups, depth, closed_force(groups, depth, support), support)


def _to_learn(change: FloatArray, log_below: FloatArray, family: Family) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What the polynomials of C/C0 - 1 are to follow beyond what is below, how much its error counts, and its weight.

    Its logarithm, whose error counts by the share of the change in itself + delta: what counts as nothing is not chased. Where
    changes are signed, by how much they differ from those of the base as a share of these, which counts likewise, and weighs
    more where the change is small beside that of the base.
    """
    if not family.signed:
        size = np.maximum(change, 1e-12)
        counts = size / (size + CHANGE_SCALE)
        return np.log(size) - log_below, counts, counts
    below = np.exp(log_below)
    weight = np.minimum(below / (np.abs(change) + CHANGE_SCALE), _MOST_WEIGHT)
    return change / below - 1, below / (below + CHANGE_SCALE), weight


def _ends(data: TrainingSet) -> tuple[FloatArray, BoolArray]:
    """log(d/h) at which each path is thinned to 40 % or gets stuck (n_run,), and where that is seen and not extrapolated."""
    thickness = data.groups[:, SENSOR] + data.groups[:, PADDING]
    logs, certain = np.empty(len(thickness)), np.zeros(len(thickness), dtype=bool)
    for i, n in enumerate(data.n_step):
        x, y = np.log(data.depth[i, n - 3 : n]), np.log(data.compression[i, n - 3 : n])
        at, reached = np.log(COMPRESSION), y[-1] >= np.log(COMPRESSION)
        if data.failures[i] and not reached:
            logs[i], certain[i] = x[-1], True
        elif reached:
            logs[i], certain[i] = np.interp(at, y, x), True
        else:
            logs[i] = x[-1] + (at - y[-1]) / max((y[-1] - y[0]) / (x[-1] - x[0]), 0.3)
    return logs - np.log(thickness), certain


def _paths_in_words(data: TrainingSet, n_fine: int, coarse: TrainingSet | None) -> str:
    beside = ""
    if coarse is not None:
        beside = f", and {len(data.groups) - n_fine} of accuracy {coarse.accuracy:g}"
        if falling := int(np.sum(_falls(coarse))):
            beside += f" (without {falling} along which the capacitance falls)"
    return f"{n_fine}{beside}, {sum(map(bool, data.failures))} of them without equilibrium to their end"


def _before(start: Surrogate | None) -> str:
    """What the networks of `start`, if they go on, were trained on before."""
    return "" if start is None else f"; before, {start.provenance.get('training paths', 'unknown')}"


def _named(surrogate: Surrogate) -> str:
    training = surrogate.provenance.get("training hash (SHA-256)", "unknown")
    return f"a surrogate of {surrogate.provenance.get('date', 'an unknown date')} with training hash {training}"


def _in_words(error: FloatArray) -> str:
    middle, most, worst = 100 * np.quantile(np.abs(error[np.isfinite(error)]), [0.5, 0.95, 1.0])
    return f"median {middle:.2f} %, 95 % below {most:.2f} %, worst {worst:.1f} %"

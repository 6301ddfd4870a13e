"""Learn how thin dielectrics become, and how well that is known: `python benchmarks/thinning.py runs.sqlite -o thinning.npz`.

Takes a store written by `calib surrogate train`, whose paths hold the largest thinning of the dielectric at six ratios
t_d/h_s along each. A network learns it from seven eighths of the paths, and from what it misses of the others a second one how
far it is off, by design and depth; its scale is that at which 90 % of what is missed lie inside the 90 % band of networks that
were trained without them. Printed is how far it is off, by how large the thinning is, and how often that band holds. With -o
both are written: models/surrogate/data/thinning.npz. With --start the network that is there goes on, from paths that it has not
seen: few will do.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from models.sensor import BoolArray, FloatArray, IntArray
from models.surrogate.domain import inside
from models.surrogate.error_fit import Z90, scaled
from models.surrogate.fitting import weight_of_usual
from models.surrogate.network import Network, least_squares, train_network
from models.surrogate.store import open_store
from models.surrogate.thinning import SMALL, Thinning, load_thinning, thinning_features
from models.surrogate.training import DIELECTRIC_POINTS, TrainingSet, store_settings, training_set

_SIZES, _ERROR_SIZES = (64, 64, 64, 1), (24, 24, 1)
_STEPS = 40_000
#: One path in so many is kept out.
_KEPT = 8


@dataclass(frozen=True, eq=False)
class Points:
    """Thinnings of paths one by one: what networks see, how thick the stack is over the depth, the thinning, and the path."""

    features: FloatArray
    height_over_depth: FloatArray
    thinning: FloatArray
    path: IntArray

    @property
    def logs(self) -> FloatArray:
        """What the network says."""
        return np.asarray(np.log(self.thinning * self.height_over_depth))


def points_of(data: TrainingSet) -> Points:
    """Every depth and t_d/h_s of every path at which a dielectric is thinner than at rest."""
    x, height, thinning, path = [], [], [], []
    for k, groups in enumerate(data.groups):
        seen = np.isfinite(data.depth[k])
        depth = data.depth[k, seen]
        for share, own in zip(DIELECTRIC_POINTS, data.thinning[k, seen].T, strict=True):
            x.append(thinning_features(np.array([[*groups, share, 1.0]]), depth[None]))
            height.append((groups[0] + groups[1]) / depth)
            thinning.append(own)
            path.append(np.full(depth.size, k))
    found = Points(*(np.concatenate(part) for part in (x, height, thinning, path)))
    rows = found.thinning > 0
    return Points(*(getattr(found, name)[rows] for name in ("features", "height_over_depth", "thinning", "path")))


def learnt(points: Points, usual: FloatArray, rows: BoolArray, steps: int, network: Network | None) -> Network:
    """A network that has learnt from some rows; what hardly becomes thinner counts less, in a second half the `usual` more."""
    plain = (points.thinning / (points.thinning + SMALL)) ** 2
    rng = np.random.default_rng(1)
    for weight in (plain, plain * usual):
        slope = least_squares(points.logs[rows, None], weight[rows])
        network = train_network(points.features[rows], slope, _SIZES, steps=steps, rng=rng, start=network)
    assert network is not None
    return network


def missed_by(network: Network, points: Points, rows: BoolArray) -> FloatArray:
    """What a network misses of some rows, as a share of the thinning and `SMALL`."""
    off = np.exp(network(points.features[rows])[:, 0] - points.logs[rows]) - 1
    own = points.thinning[rows]
    return np.asarray(off * own / (own + SMALL))


def learnt_error(features: FloatArray, missed: FloatArray, path: IntArray, steps: int) -> tuple[Network, FloatArray]:
    """A network to the logarithm of the sd of what was missed, and what was missed over the sd of networks without its path."""
    logs = np.log(np.maximum(np.abs(missed), 1e-6))
    rng = np.random.default_rng(2)

    def trained(rows: BoolArray) -> Network:
        return train_network(features[rows], least_squares(logs[rows, None]), _ERROR_SIZES, steps=steps, rng=rng)

    def scores(network: Network, rows: BoolArray) -> FloatArray:
        return np.asarray(missed[rows] / np.exp(network(features[rows])[:, 0]))

    return scaled(trained, scores, rng.permutation(int(path.max()) + 1)[path])


def main(words: Sequence[str] | None = None) -> None:
    """Learn from the paths of a store, print the error, and write what is learnt if asked to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("store", type=Path, help="file of paths")
    parser.add_argument("--accuracy", type=float, default=1e-3, help="of its paths")
    parser.add_argument("--steps", type=int, default=_STEPS, help="of each half of the training")
    parser.add_argument("--start", action="store_true", help="go on from the networks that are shipped")
    parser.add_argument("-o", "--output", type=Path, help="file for the networks")
    given = parser.parse_args(words)
    with open_store(given.store, store_settings(given.accuracy)) as store:
        data = training_set(store, given.accuracy)
    points = points_of(data)
    kept = np.random.default_rng(3).permutation(len(data.groups)) % _KEPT == 0
    start = load_thinning().network if given.start else None
    network = learnt(points, weight_of_usual(data.groups)[points.path], ~kept[points.path], given.steps, start)
    covered = inside(np.column_stack([data.groups, np.full(len(data.groups), 0.3), np.ones(len(data.groups))]))
    rows = (kept & covered)[points.path]
    missed, thinning = missed_by(network, points, rows), points.thinning[rows]
    error, score = learnt_error(points.features[rows], missed, points.path[rows], max(given.steps // 10, 1))
    off = np.abs(missed) * (thinning + SMALL) / thinning
    print(f"{len(data.groups)} paths, {len(points.path)} thinnings; on the {rows.sum()} inside the range that were kept out:")
    print("| thinning | rms | 95 % within | 99 % within | inside the 90 % band |\n|---|---|---|---|---|")
    edges = (0.0, 0.02, 0.05, 0.1, 0.2, 0.3, np.inf)
    for least, most in pairwise(edges):
        own = (thinning >= least) & (thinning < most)
        if np.any(own):
            held = np.mean(np.abs(score[own]) <= Z90)
            sizes = " | ".join(f"{np.quantile(off[own], share):.2%}" for share in (0.95, 0.99))
            print(f"| {least:g} to {most:g} | {np.sqrt(np.mean(off[own] ** 2)):.2%} | {sizes} | {held:.1%} |")
    if given.output is not None:
        Thinning(network, error).save(given.output)
        print(f"Written: {given.output}")


if __name__ == "__main__":
    main()

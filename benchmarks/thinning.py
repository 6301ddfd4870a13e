"""Learn how thin dielectrics become, and how well that is known: `python benchmarks/thinning.py --paths FILE -o thinning.npz`.

Paths of the finite elements at points all over the range of the surrogates, each kept as a line of JSON in FILE and not done
twice, with the largest thinning of the dielectrics at six ratios t_d/h_s along each. A network learns it from four fifths of
the paths; printed is how far it is off the others, by how large the thinning is. With -o one that has learnt from all of them
is written: models/surrogate/data/thinning.npz.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from simulated.labs import keep_row, kept_rows

from models.fem.capacitance import row_positions
from models.fem.equilibrium import Failure, make_model
from models.fem.path import walk
from models.sensor import BoolArray, FloatArray
from models.surrogate.domain import COMPRESSION, DEPTH, PATH
from models.surrogate.network import Network, least_squares, train_network
from models.surrogate.points import design_points
from models.surrogate.thinning import Thinning, thinning_features
from models.surrogate.training import DIELECTRIC_POINTS, design_of

#: Thinning above which the relative error is stated.
SMALL = 0.05
_ACCURACY = 3e-3
_SIZES = (64, 64, 1)
_STEPS = 12_000


def path_of(groups: FloatArray) -> list[list[float]]:
    """Press one design as deep as a surrogate goes: a row for each depth, d/R and the largest thinning at each t_d/h_s."""
    h_s, h_p = (float(g) for g in groups[:2])
    end = min(DEPTH, COMPRESSION * (h_s + h_p))
    model = make_model(design_of(groups), end, _ACCURACY)
    rows = []
    for state in walk(model, end * PATH**2):
        if isinstance(state, Failure):
            break

        def line(height: float, u: FloatArray = state.u) -> FloatArray:
            return np.asarray(row_positions(model.mesh, u, h_p + h_s / 2 + height)[1], dtype=float)

        thinned = []
        for t in DIELECTRIC_POINTS * h_s:
            low, middle, high = line(-t), line(0.0), line(t)
            across = 1 - (high - low) / (2 * t)
            on_axis = max(1 - float(middle[0] - low[0]) / t, 1 - float(high[0] - middle[0]) / t)
            thinned.append(on_axis * float(np.max(across)) / float(across[0]))
        rows.append([state.depth, *thinned])
        if max(thinned) >= COMPRESSION:
            break
    return rows


def paths(n: int, seed: int, file: Path | None) -> Iterator[dict[str, Any]]:
    """Paths at the first n points of a sequence, with those that a file holds."""
    known = {tuple(row["groups"]): row for row in kept_rows(file)}
    for groups in design_points(max(n, 4096), seed)[:n]:
        point = tuple(float(g) for g in groups)
        if point not in known:
            known[point] = {"groups": point, "rows": path_of(groups)}
            keep_row(file, known[point])
        yield known[point]


def learnt(x: FloatArray, y: FloatArray, thinned: FloatArray, rows: BoolArray, steps: int) -> Network:
    """A network that has learnt from some rows; what hardly becomes thinner counts less."""
    weight = np.minimum(thinned / 0.1, 1) ** 2 + 0.02
    rng = np.random.default_rng(1)
    return train_network(x[rows], least_squares(y[rows, None], weight[rows]), _SIZES, steps=steps, rng=rng)


def main(words: Sequence[str] | None = None) -> None:
    """Make what paths are missing, print the error of what is learnt from them, and write it if asked to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=900, help="paths")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--steps", type=int, default=_STEPS, help="of the training")
    parser.add_argument("--paths", type=Path, help="file for the paths, a line of JSON each")
    parser.add_argument("-o", "--output", type=Path, help="file for the network")
    given = parser.parse_args(words)
    found = [row for row in paths(given.n, given.seed, given.paths) if row["rows"]]
    x, y, value, run = [], [], [], []
    for k, row in enumerate(found):
        depth, thinned = np.array(row["rows"])[:, 0], np.array(row["rows"])[:, 1:]
        for share, own in zip(DIELECTRIC_POINTS, thinned.T, strict=True):
            groups = np.array([[*row["groups"], share, 1.0]])
            x.append(thinning_features(groups, depth[None]))
            y.append(np.log(own * (groups[0, 0] + groups[0, 1]) / depth))
            value.append(own)
            run.append(np.full(depth.size, k))
    inputs, logs, thinnings, runs = np.concatenate(x), np.concatenate(y), np.concatenate(value), np.concatenate(run)
    held = runs % 5 == 0
    network = learnt(inputs, logs, thinnings, ~held, given.steps)
    off = np.abs(np.exp(network(inputs[held])[:, 0] - logs[held]) - 1)
    print(f"{len(found)} paths, {len(logs)} thinnings; on the {np.sum(held)} of the fifth that was held out:")
    print("| thinning above | rms | 95 % within | 99 % within |\n|---|---|---|---|")
    for least in (0.0, 0.02, 0.05, 0.1, 0.2, 0.3):
        own = off[thinnings[held] >= least]
        print(f"| {least:g} | {np.sqrt(np.mean(own**2)):.2%} | {np.quantile(own, 0.95):.2%} | {np.quantile(own, 0.99):.2%} |")
    if given.output is not None:
        sd = float(np.sqrt(np.mean(off[thinnings[held] >= SMALL] ** 2)))
        whole = learnt(inputs, logs, thinnings, np.ones(held.size, dtype=bool), given.steps)
        Thinning(whole, sd, SMALL).save(given.output)
        print(f"Written: {given.output}, sd {sd:.2%}")


if __name__ == "__main__":
    main()

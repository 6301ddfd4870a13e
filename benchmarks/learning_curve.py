"""How many finite-element runs a surrogate needs: `python benchmarks/learning_curve.py runs.sqlite --runs 256 512 1024 2048`.

Takes a store written by `calib surrogate train`, trains on the first N of a random order of its runs, and compares on 500
others inside the range at one step of the path. Beside our fit: a Gaussian process (scikit-learn, one length scale for each
coordinate, noise) and a polynomial chaos (chaospy, least squares, 2.5 runs a term) on that very output and on its logarithm,
both over the logarithms of the four groups. Those two need the extra `benchmark`; `--fits ours` does without.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from models.sensor import FloatArray, design_from
from models.surrogate.domain import inside
from models.surrogate.fitting import fit_surrogate
from models.surrogate.store import open_store
from models.surrogate.training import DIELECTRIC_POINTS, ELECTRODE_POINTS, TrainingSet, store_settings, training_set

#: Step of the path that is compared, and the electrodes: thickest dielectrics, full disc.
STEP = 7
GAP, WIDTH = DIELECTRIC_POINTS.size - 1, ELECTRODE_POINTS.size - 1
#: The largest number of runs that a Gaussian process is trained on.
MOST_GP = 2048

Fit = Callable[[TrainingSet, TrainingSet], tuple[FloatArray, FloatArray]]


def outputs(data: TrainingSet) -> tuple[FloatArray, FloatArray]:
    """F/(mu R^2) and C/C0 - 1 at `STEP`, each (n_run,)."""
    return data.force[:, STEP], data.capacitance[:, STEP, GAP, WIDTH]


def ours(steps: int) -> Fit:
    """Our fit with so many steps of training."""

    def fit(train: TrainingSet, test: TrainingSet) -> tuple[FloatArray, FloatArray]:
        surrogate = fit_surrogate(train, steps=steps)
        h_s, h_p, a, modulus = test.groups.T
        design = design_from(
            {
                "indenter_radius": np.ones(len(h_s)),
                "sensor_thickness": h_s,
                "sensor_radius": a,
                "young_modulus": np.full(len(h_s), 3.0),
                "padding_young_modulus": 3 * modulus,
                "relative_permittivity": np.ones(len(h_s)),
                "padding_thickness": h_p,
                "electrode_radius": a,
                "dielectric_thickness": h_s / 2,
            }
        )
        response = surrogate.respond(design, test.depth[:, STEP : STEP + 1])
        return response.force[:, 0], response.capacitance_change[:, 0]

    return fit


def by_output(one: Callable[[FloatArray, FloatArray, FloatArray], FloatArray], *, log: bool) -> Fit:
    """Each output by itself, of the coordinates in [-1, 1]."""

    def fit(train: TrainingSet, test: TrainingSet) -> tuple[FloatArray, FloatArray]:
        thin = np.array([0, 0.01, 0, 0])
        points = [np.log(data.groups[:, :4] + thin) for data in (train, test)]
        low, high = np.min(points[0], axis=0), np.max(points[0], axis=0)
        x, at = (2 * (p - low) / (high - low) - 1 for p in points)
        force, change = (one(x, np.log(y) if log else y, at) for y in outputs(train))
        return (np.exp(force), np.exp(change)) if log else (force, change)

    return fit


def gaussian_process(x: FloatArray, y: FloatArray, at: FloatArray) -> FloatArray:
    """Mean of a Gaussian process at `at`; nan if there are too many runs for it."""
    if len(x) > MOST_GP:
        return np.full(len(at), np.nan)
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    kernel = ConstantKernel(1.0, (1e-2, 1e6)) * RBF(np.ones(4), (0.05, 50.0)) + WhiteKernel(1e-4, (1e-9, 1.0))
    process = GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
    return np.asarray(process.fit(x, y).predict(at))


def polynomial_chaos(x: FloatArray, y: FloatArray, at: FloatArray) -> FloatArray:
    """Least squares on Legendre polynomials of the largest total degree that leaves 2.5 runs a term."""
    import chaospy

    joint = chaospy.J(*(chaospy.Uniform(-1, 1) for _ in range(4)))
    degree = 1
    while 2.5 * len(chaospy.generate_expansion(degree + 1, joint)) <= len(x):
        degree += 1
    found = chaospy.fit_regression(chaospy.generate_expansion(degree, joint), x.T, y)
    return np.asarray(found(*at.T))


def all_fits(steps: int) -> dict[str, Fit]:
    """Every fit by its name, ours with so many steps of training."""
    return {
        "ours": ours(steps),
        "GP": by_output(gaussian_process, log=False),
        "GP of log": by_output(gaussian_process, log=True),
        "PCE": by_output(polynomial_chaos, log=False),
        "PCE of log": by_output(polynomial_chaos, log=True),
    }


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("store", type=Path)
    parser.add_argument("--accuracy", type=float, default=1e-3)
    parser.add_argument("--runs", type=int, nargs="+", default=[256, 512, 1024, 2048, 4096, 8192])
    parser.add_argument("--kept", type=int, default=500, help="runs kept for the comparison")
    parser.add_argument("--steps", type=int, default=20_000, help="of our training")
    parser.add_argument("--fits", nargs="+", default=list(all_fits(0)), choices=list(all_fits(0)))
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    with open_store(asked.store, store_settings(asked.accuracy)) as store:
        data = training_set(store, asked.accuracy)
    data = data.only(data.n_step > STEP)
    rng = np.random.default_rng(0)
    middle = np.tile([0.3, 0.8], (len(data.groups), 1))
    order = rng.permutation(len(data.groups))
    test = order[inside(np.concatenate([data.groups, middle], axis=1))[order]][: asked.kept]
    rest = order[~np.isin(order, test)]
    chosen = np.zeros(len(order), dtype=bool)
    chosen[test] = True
    truth = data.only(chosen)
    fits = {name: fit for name, fit in all_fits(asked.steps).items() if name in asked.fits}
    what = "force / capacitance change (above 1e-4 of C0), and seconds of training"
    print(f"error that 95 % of {len(test)} designs stay below, {what}")
    print(f"{'runs':>6}" + "".join(f"{name:>26}" for name in fits))
    for n in asked.runs:
        chosen = np.zeros(len(order), dtype=bool)
        chosen[rest[:n]] = True
        train, row = data.only(chosen), []
        for fit in fits.values():
            start = time.perf_counter()
            force, change = fit(train, truth)
            true_force, true_change = outputs(truth)
            errors = (np.abs(force / true_force - 1), np.abs(change - true_change) / np.maximum(true_change, 1e-4))
            sizes = [f"{np.quantile(e, 0.95):.2%}" if np.all(np.isfinite(e)) else "-" for e in errors]
            row.append(f"{sizes[0]} / {sizes[1]}  {time.perf_counter() - start:5.0f} s")
        print(f"{n:>6}" + "".join(f"{cell:>26}" for cell in row), flush=True)


if __name__ == "__main__":
    main()

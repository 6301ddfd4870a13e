"""Whether specifications are kept as often as is said: `python benchmarks/specifications.py --labs 500 -o FILE`.

A lab is one specimen as the shipped experiment has them, its unknowns drawn from their priors (the modulus by a factor of
1.3), its curves by the finite elements, with noise. It is calibrated by weighted draws, and asked for padding for a load of
10 N, with data up to some 5 N. What a padding really does is computed by the finite elements.

First: limits on signal, stroke and thinning of the dielectric that are said to be missed with 5, 10 and 20 %, on 4 mm of
padding: how often are they? And how often does the stated 90 % band of the signal hold the truth? Then specifications of a
window of signal and stroke, which can be met, cannot, or hang on the modulus: thickness is chosen by the probability of
conformity, by a plug-in of the posterior's means (what least squares with prior knowledge gives), and for the nominal design.
Printed are the failure that was said and the one that came, and regret: by how much less of a limit the best padding would
have missed.

With -o labs are kept, a line of JSON each, and not repeated. --quick takes the surrogate with its own error for the truth.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from simulated.answered import weighted_posterior
from simulated.faulty import ACCURACY, DEPTH, EXPERIMENT, POINTS, curve_of
from simulated.labs import lab_parser, parsed, rows_of
from simulated.usual import usual_lab

from calib.checks import Verdict
from calib.decision import Conformity, conform
from calib.experiment import Experiment, Limit, Limited, Side, Specification, forward_of_experiment, read_experiment
from calib.problem import build_problem
from calib.problem.synthetic import synthetic_sweep
from calib.sampling import Posterior, look_at
from models.curves import curves_of, press_to, signal_at
from models.fem import FiniteElements
from models.fem.capacitance import row_positions
from models.response import ConvergenceError, Forward, OutOfRangeError
from models.sensor import Design, FloatArray, design_from
from models.surrogate.thinning import load_thinning
from models.threads import one_thread

#: Load [N], padding of the limits of stated failure, paddings to choose from, and those at which truth is computed [m].
FORCE, PADDING = 10.0, 4e-3
LOWER, UPPER, STEPS, N_TRUTH = 1.5e-3, 5.5e-3, 41, 9
#: Stated shares of failure.
STATED = (0.05, 0.1, 0.2)
#: Probability that a window is asked to hold with.
WANTED = 0.9
# Limits that nothing keeps: what they would have to be is a quantile of what is predicted.
_IMPOSSIBLE: tuple[tuple[Limited, Side, float], ...] = (
    ("signal", "at_least", 0.99),
    ("stroke", "at_most", 1e-6),
    ("dielectric_strain", "at_most", 1e-6),
)


@dataclass(frozen=True)
class Window:
    """Limits of signal and stroke as shares of what the posterior's median says at two paddings [m]."""

    signal: float
    signal_padding: float
    stroke: float
    stroke_padding: float


#: Kinds of specification.
WINDOWS: Mapping[str, Window] = {
    "can be met": Window(0.97, 2.5e-3, 1.05, 4e-3),
    "cannot be met": Window(1.03, 3.5e-3, 0.97, 3e-3),
    "hangs on the modulus": Window(0.998, 3e-3, 1.002, 3.1e-3),
}
#: What chooses a thickness.
WAYS = ("probability", "plug-in", "nominal")


@dataclass(frozen=True, eq=False)
class Truth:
    """What the sensor of a lab really does under the load, over the thickness of its padding."""

    signal: CubicSpline
    stroke: CubicSpline

    def short(self, thickness: FloatArray, signal: float, stroke: float) -> FloatArray:
        """By which share of a limit the worse of the two is missed; 0 where both are kept."""
        worst = np.minimum(self.signal(thickness) / signal - 1, 1 - self.stroke(thickness) / stroke)
        return np.asarray(np.maximum(-worst, 0.0))


def answer(kind: str, seed: int, _: int, *, quick: bool = False, n_draw: int = 400) -> dict[str, Any]:
    """Simulate, calibrate and ask one lab."""
    with one_thread():
        return _answer(kind, seed, quick, n_draw)


def _answer(kind: str, seed: int, quick: bool, n_draw: int) -> dict[str, Any]:
    began = time.process_time()
    whole = read_experiment(EXPERIMENT)
    experiment = replace(whole, specimens=whole.specimens[:1])
    rng = np.random.default_rng([seed, 20190306])
    design, posterior, forward = _lab(experiment, rng)
    nominal = _at(posterior, _medians(posterior, prior=True))
    plug_in = _at(posterior, _medians(posterior, prior=False))
    try:
        row = _asked(design, posterior, plug_in, nominal, forward, seed, quick, n_draw)
    except (ConvergenceError, OutOfRangeError) as error:
        row = {"refused": str(error)}
    return {"kind": kind, "seed": seed, **row, "processor": round(time.process_time() - began, 1)}


def _lab(experiment: Experiment, rng: np.random.Generator) -> tuple[Design, Posterior, Forward]:
    """The true design of a lab, and what it found."""
    truth, rig = usual_lab(experiment, rng, 1.3)
    design = design_from(truth)
    name = experiment.specimens[0].name
    sweep = synthetic_sweep(curve_of(design, 1.01 * DEPTH), design, DEPTH, rig, rng, specimen=name, n_points=POINTS)
    forward = forward_of_experiment(experiment)
    problem = build_problem(experiment, [sweep], forward)
    return design, weighted_posterior(problem, look_at(problem), rng), forward


def _medians(posterior: Posterior, *, prior: bool) -> FloatArray:
    """Values of all unknowns at the medians of their priors or at the posterior's means, without any discrepancy."""
    draws = posterior.draws.reshape(-1, posterior.draws.shape[-1])
    found = []
    for k, info in enumerate(posterior.parameters):
        value = float(info.prior.ppf_normal(0.0)) if prior else float(np.mean(draws[:, k]))
        found.append(0.0 if info.parameter.endswith("discrepancy") else value)
    return np.array(found)


def _at(posterior: Posterior, values: FloatArray) -> Posterior:
    """A posterior that knows everything."""
    return replace(posterior, draws=np.broadcast_to(values, (1, 60, values.size)).copy(), log_prob=np.zeros((1, 60)))


def _asked(
    design: Design,
    posterior: Posterior,
    plug_in: Posterior,
    nominal: Posterior,
    forward: Forward,
    seed: int,
    quick: bool,
    n_draw: int,
) -> dict[str, Any]:
    def asked(of: Posterior, limits: Sequence[Limit], lower: float, upper: float, steps: int, p: float = WANTED) -> Conformity:
        spec = Specification(tuple(limits), (FORCE,), probability=p, lower=lower, upper=upper, steps=steps, n_draw=n_draw)
        return conform(of, forward, spec, seed=seed, verdict=Verdict())

    row: dict[str, Any] = {"stated": {}, "windows": {}}
    real = dict(zip(("signal", "stroke", "dielectric_strain"), _real(design, PADDING, forward, quick, seed), strict=True))
    for p in STATED:
        for name, side, impossible in _IMPOSSIBLE:
            limit = Limit(name, side, impossible)
            found = asked(posterior, [limit], PADDING - 1e-6, PADDING + 1e-6, 3, 1 - p)
            value = found.needed[0].value
            row["stated"][f"{name} {p:g}"] = bool(real[name] < value if side == "at_least" else real[name] > value)
    band = asked(posterior, [Limit("signal", "at_least", 0.01)], PADDING - 1e-6, PADDING + 1e-6, 3).best.signal[:, 1]
    row["in band"] = bool(band[0] <= real["signal"] <= band[4])
    grid = np.linspace(LOWER, UPPER, N_TRUTH)
    known = np.array([_real(design, h, forward, quick, seed) for h in grid])
    truth = Truth(CubicSpline(grid, known[:, 0]), CubicSpline(grid, known[:, 1]))
    middle = asked(posterior, [Limit("signal", "at_least", 0.01)], LOWER, UPPER, STEPS)
    carried = np.isfinite(middle.best.signal[2])
    if not np.all(carried[(middle.thickness >= 2.4e-3) & (middle.thickness <= 4.1e-3)]):
        return {"refused": f"the load is not carried on the paddings of the windows: {np.sum(carried)} of {carried.size}"}
    signal, stroke = (
        CubicSpline(middle.thickness[carried], values[2, carried]) for values in (middle.best.signal, middle.best.stroke)
    )
    fine = np.linspace(LOWER, UPPER, 801)
    for kind, w in WINDOWS.items():
        least, most = w.signal * float(signal(w.signal_padding)), w.stroke * float(stroke(w.stroke_padding))
        limits = (Limit("signal", "at_least", least), Limit("stroke", "at_most", most))
        chosen = {
            way: asked(of, limits, LOWER, UPPER, STEPS) for way, of in zip(WAYS, (posterior, plug_in, nominal), strict=True)
        }
        best = float(np.min(truth.short(fine, least, most)))
        row["windows"][kind] = {
            way: {
                "padding": c.best.best,
                "said": 1 - c.best.best_probability,
                "failed": bool(truth.short(np.array([c.best.best]), least, most)[0] > 0),
                "regret": float(truth.short(np.array([c.best.best]), least, most)[0]) - best,
            }
            for way, c in chosen.items()
        } | {"possible": best == 0}
    return row


def _real(design: Design, padding: float, forward: Forward, quick: bool, seed: int) -> tuple[float, float, float]:
    """What a design really does on a padding: change of capacitance, depth [m] and thinning of the dielectric."""
    built = replace(design, padding=replace(design.padding, thickness=padding))
    if quick:
        pressed = press_to(curves_of(forward, built.draws()), np.array([FORCE]))
        at, wrong = signal_at(pressed), np.random.default_rng(seed).standard_normal(2)
        depth = float(pressed.depth[0, 0]) - wrong[0] * float((pressed.compliance * pressed.force_error)[0, 0])
        thinned = load_thinning().of(built.draws(), pressed.depth)[0]
        return float((at.change + wrong[1] * at.change_error)[0, 0]), depth, float(thinned[0, 0])
    solution = FiniteElements(ACCURACY).solve_to_force(built, np.array([FORCE]))
    state, mesh, unit = solution.states[-1], solution.model.mesh, solution.units.length
    h_s, t_d = (float(np.asarray(x)) / unit for x in (built.sensor.thickness, built.dielectric_thickness))
    low, middle, high = (row_positions(mesh, state.u, padding / unit + h_s / 2 + k * t_d)[1] for k in (-1, 0, 1))
    across = 1 - (high - low) / (2 * t_d)
    thin = max(1 - float(middle[0] - low[0]) / t_d, 1 - float(high[0] - middle[0]) / t_d) * float(np.max(across) / across[0])
    return float(solution.response.capacitance_change[-1]), float(solution.response.depth[-1]), thin


def table(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Lines of the tables in Markdown."""
    done = [row for row in rows if "refused" not in row]
    yield f"{len(rows)} labs, {len(rows) - len(done)} of them with a sensor that the finite elements cannot press so far."
    yield ""
    yield "| limit on | said 5 % | said 10 % | said 20 % |"
    yield "|---|---|---|---|"
    names = [name for name, _, _ in _IMPOSSIBLE]
    for name in (*names, "all"):
        which = names if name == "all" else [name]
        rates = [[row["stated"][f"{n} {p:g}"] for row in done for n in which] for p in STATED]
        yield f"| {name.replace('_', ' ')} | " + " | ".join(_share(own) for own in rates) + " |"
    inside = [row["in band"] for row in done]
    yield ""
    yield f"The 90 % band of the signal holds the truth in {_share(inside)} of the labs."
    yield ""
    yield "| specification | chosen by | failure said | failure found | regret, mean | regret, worst |"
    yield "|---|---|---|---|---|---|"
    for name in WINDOWS:
        for way in WAYS:
            own = [row["windows"][name][way] for row in done]
            said = np.mean([one["said"] for one in own]) if way == WAYS[0] else math.nan
            regret = np.array([one["regret"] for one in own])
            told = "-" if math.isnan(said) else f"{said:.0%}"
            yield (
                f"| {name} | {way} | {told} | {_share([one['failed'] for one in own])} | {np.mean(regret):.3%} | "
                f"{np.max(regret):.2%} |"
            )


def _share(flags: Sequence[bool]) -> str:
    p = float(np.mean(flags))
    return f"{p:.1%} ± {math.sqrt(max(p * (1 - p), 0.25 / len(flags)) / len(flags)):.1%}"


def main(words: Sequence[str] | None = None) -> None:
    """Ask the labs and print the tables."""
    parser = lab_parser(__doc__, ("sound",), 500)
    parser.add_argument("--quick", action="store_true", help="the surrogate for truth, not the finite elements")
    parser.add_argument("--draws", type=int, default=400, help="of each posterior")
    given = parsed(parser, words, ("sound",))
    one: Callable[..., dict[str, Any]] = partial(answer, quick=given.quick, n_draw=given.draws)
    rows = rows_of(one, given.kinds, given.labs, 0, given.processes, given.output)
    print("\n".join(table(rows)))


if __name__ == "__main__":
    main()

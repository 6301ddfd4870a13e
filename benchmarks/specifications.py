"""Whether specifications are kept as often as is said: `python benchmarks/specifications.py --labs 500 -o FILE`.

A lab is one specimen as the shipped experiment has them, its unknowns drawn from their priors (the modulus by a factor of
1.3), its curves by the finite elements, with noise. It is asked for padding for a load of 10 N: with data up to some 5 N on the
padding of the shipped experiment, or with data up to 10 N on three times that, as `calib next` would have it made. In the kinds
`as believed` the true sensors are off every model by a discrepancy, as the likelihood takes for granted, of a width drawn from
its prior: the data along their depth, what is built along its thickness. In `exact` none is. Posteriors are the weighted draws
of a first answer where these can be trusted (k-hat below 0.7, 200 effective draws), else, or with --chains always, chains.
What a padding really does is computed by the finite elements.

First: limits on signal, stroke and thinning of the dielectric that are said to be missed with 5, 10, 20 and 50 %, on 4 mm
of padding: how often are they? And how often do stated 90 % bands of the signal hold the truth, there and on the padding that
is advised? Then specifications of a window of signal and stroke, which can be met, cannot, or hang on the modulus: thickness
is chosen by the probability of conformity, by a plug-in of the posterior's means (all that is known, without its doubt), by a
plug-in of least squares (modulus, permittivity, contact and zeros fitted, all else as it was meant to be), and for the nominal
design. Printed are the failure that was said and the one that came, and regret: by how much less of a limit the best padding
would have missed.

With -o labs are kept, a line of JSON each, and not repeated: more of them may follow with --bands, which leaves the windows
out. --quick takes the surrogate with its own error for the truth.
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
from simulated.answered import calibrated
from simulated.discrepant import curve_off, drawn_widths
from simulated.faulty import ACCURACY, DEPTH, EXPERIMENT, POINTS, curve_of
from simulated.labs import lab_parser, parsed, rows_of
from simulated.usual import usual_lab

from calib.checks import Verdict
from calib.decision import Conformity, conform
from calib.decision.sensors import smooth_normals
from calib.experiment import Experiment, Limit, Limited, Side, Specification, forward_of_experiment, read_experiment
from calib.lab import Sweep
from calib.priors import Fixed, Normal
from calib.problem import Problem, build_problem, columns_at
from calib.problem.synthetic import synthetic_sweep
from calib.sampling import Posterior, look_at
from models.curves import curves_of, press_to, signal_at
from models.fem import FiniteElements
from models.fem.capacitance import largest_thinning
from models.response import ConvergenceError, Forward, OutOfRangeError
from models.sensor import Design, FloatArray, design_from
from models.surrogate.thinning import load_thinning
from models.threads import one_thread

#: What is planted, and what the data are of.
KINDS = ("as believed, to 5 N", "as believed, to 10 N", "exact, to 5 N", "exact, to 10 N")
#: Padding of the data up to the load [m], beyond that of the shipped experiment.
_MORE_PADDING = 2.2e-3
#: Most steps of the chains that stand in for a first answer.
STEPS_OF_CHAINS = 4000
# What least squares do not fit, but take as it was meant to be.
_MEANT = ("machine_compliance", "parasitic_capacitance")
#: Load [N], padding of the limits of stated failure, paddings to choose from, and those at which truth is computed [m].
FORCE, PADDING = 10.0, 4e-3
LOWER, UPPER, STEPS, N_TRUTH = 1.5e-3, 5.5e-3, 41, 9
#: Stated shares of failure.
STATED = (0.05, 0.1, 0.2, 0.5)
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
WAYS = ("probability", "plug-in", "least squares", "nominal")


@dataclass(frozen=True, eq=False)
class Truth:
    """What the sensor of a lab really does under the load, over the thickness of its padding."""

    signal: CubicSpline
    stroke: CubicSpline

    def short(self, thickness: FloatArray, signal: float, stroke: float) -> FloatArray:
        """By which share of a limit the worse of the two is missed; 0 where both are kept."""
        worst = np.minimum(self.signal(thickness) / signal - 1, 1 - self.stroke(thickness) / stroke)
        return np.asarray(np.maximum(-worst, 0.0))


def answer(
    kind: str, seed: int, _: int, *, quick: bool = False, n_draw: int = 400, chains: bool = False, bands: bool = False
) -> dict[str, Any]:
    """Simulate, calibrate and ask one lab."""
    with one_thread():
        return _answer(kind, seed, quick, n_draw, chains, bands)


def _answer(kind: str, seed: int, quick: bool, n_draw: int, chains: bool, bands: bool) -> dict[str, Any]:
    began = time.process_time()
    row: dict[str, Any] = {"kind": kind, "seed": seed}
    try:
        lab = _lab(kind, seed)
        found, posterior = calibrated(lab.problem, seed, STEPS_OF_CHAINS, chains=chains)
        row |= found
        if bands:
            row |= _asked(lab, {WAYS[0]: posterior}, quick, n_draw, bands=True)
            return {**row, "processor": round(time.process_time() - began, 1)}
        fitted = _least_squares(lab)
        ways = {
            "probability": posterior,
            "plug-in": _at(posterior, _medians(posterior, prior=False)),
            "least squares": _at(posterior, _medians(posterior, prior=True) | fitted),
            "nominal": _at(posterior, _medians(posterior, prior=True)),
        }
        row |= _asked(lab, ways, quick, n_draw)
    except (ConvergenceError, OutOfRangeError) as error:
        row["refused"] = str(error)
    return {**row, "processor": round(time.process_time() - began, 1)}


@dataclass(frozen=True, eq=False)
class Lab:
    """One lab: what it was told, its press, the true design, and by how much what is built of it is off every model."""

    seed: int
    experiment: Experiment
    forward: Forward
    sweep: Sweep
    design: Design
    width: Mapping[str, float]

    @property
    def problem(self) -> Problem:
        """Its calibration."""
        return build_problem(self.experiment, [self.sweep], self.forward)


def _lab(kind: str, seed: int) -> Lab:
    whole = read_experiment(EXPERIMENT)
    experiment = replace(whole, specimens=whole.specimens[:1])
    rng = np.random.default_rng([seed, 20190306])
    truth, rig = usual_lab(experiment, rng, 1.3)
    width = drawn_widths(np.random.default_rng([seed, 20190307]), kind.startswith("as believed"))
    if kind.endswith("to 10 N"):
        truth["padding_thickness"] += _MORE_PADDING
        own = experiment.specimens[0]
        thicker = Normal(float(own.priors["padding_thickness"].ppf_normal(0.0)) + _MORE_PADDING, 0.03e-3)
        own = replace(own, priors={**own.priors, "padding_thickness": thicker})
        experiment = replace(experiment, specimens=(own,))
    design = design_from(truth)
    depth = DEPTH
    if kind.endswith("to 10 N"):
        depth = float(FiniteElements(ACCURACY).respond_to_force(design, np.array([FORCE])).depth[0])
    true = curve_off(curve_of(design, 1.01 * depth), width, np.random.default_rng([seed, 20190308]))
    name = experiment.specimens[0].name
    sweep = synthetic_sweep(true, design, depth, rig, rng, specimen=name, n_points=POINTS)
    return Lab(seed, experiment, forward_of_experiment(experiment), sweep, design, width)


def _least_squares(lab: Lab) -> dict[str, float]:
    """What a fit without any doubt finds [SI]: all that is measured beside the press as it was meant to be, no discrepancy."""
    e = lab.experiment
    own = e.specimens[0]
    meant = {name: Fixed(float(prior.ppf_normal(0.0))) for name, prior in own.priors.items()}
    rig = {name: Fixed(float(prior.ppf_normal(0.0))) if name in _MEANT else prior for name, prior in e.priors.items()}
    plain = replace(e, priors=rig, specimens=(replace(own, priors=meant),), discrepancy="off")
    look = look_at(build_problem(plain, [lab.sweep], lab.forward))
    theta, _ = look.space.to_theta(look.mode[None])
    return dict(zip(look.problem.names, map(float, columns_at(look.problem, theta)[0]), strict=True))


def _medians(posterior: Posterior, *, prior: bool) -> dict[str, float]:
    """Values of all unknowns at the medians of their priors or at the posterior's means, without any discrepancy."""
    draws = posterior.draws.reshape(-1, posterior.draws.shape[-1])
    found = {}
    for k, info in enumerate(posterior.parameters):
        value = float(info.prior.ppf_normal(0.0)) if prior else float(np.mean(draws[:, k]))
        found[info.name] = 0.0 if info.parameter.endswith("discrepancy") else value
    return found


def _at(posterior: Posterior, known: Mapping[str, float]) -> Posterior:
    """A posterior that knows everything."""
    values = np.array([known[info.name] for info in posterior.parameters])
    return replace(posterior, draws=np.broadcast_to(values, (1, 60, values.size)).copy(), log_prob=np.zeros((1, 60)))


def _asked(lab: Lab, ways: Mapping[str, Posterior], quick: bool, n_draw: int, *, bands: bool = False) -> dict[str, Any]:
    posterior, forward = ways[WAYS[0]], lab.forward

    def asked(of: Posterior, limits: Sequence[Limit], lower: float, upper: float, steps: int, p: float = WANTED) -> Conformity:
        spec = Specification(tuple(limits), (FORCE,), probability=p, lower=lower, upper=upper, steps=steps, n_draw=n_draw)
        return conform(of, forward, spec, seed=lab.seed, verdict=Verdict())

    row: dict[str, Any] = {"stated": {}, "windows": {}}
    grid = np.linspace(LOWER, UPPER, N_TRUTH)
    thick = np.append(grid, PADDING)
    total = float(np.asarray(lab.design.sensor.thickness)) + thick
    gaps = smooth_normals(total, 2, np.random.default_rng([lab.seed, 20190309]))
    gaps *= np.array([[lab.width["force"]], [lab.width["capacitance"]]])
    wanted = slice(-1, None) if bands else slice(None)
    known = np.array([_real(lab, h, gap, quick) for h, gap in zip(thick[wanted], gaps.T[wanted], strict=True)])
    real = dict(zip(("signal", "stroke", "dielectric_strain"), known[-1], strict=True))
    for p in STATED:
        for name, side, impossible in _IMPOSSIBLE:
            limit = Limit(name, side, impossible)
            found = asked(posterior, [limit], PADDING - 1e-6, PADDING + 1e-6, 3, 1 - p)
            value = found.needed[0].value
            row["stated"][f"{name} {p:g}"] = bool(real[name] < value if side == "at_least" else real[name] > value)
    band = asked(posterior, [Limit("signal", "at_least", 0.01)], PADDING - 1e-6, PADDING + 1e-6, 3).best.signal[:, 1]
    row["in band"] = bool(band[0] <= real["signal"] <= band[4])
    if bands:
        return row
    truth = Truth(CubicSpline(grid, known[:-1, 0]), CubicSpline(grid, known[:-1, 1]))
    middle = asked(posterior, [Limit("signal", "at_least", 0.01)], LOWER, UPPER, STEPS)
    carried = np.isfinite(middle.best.signal[2])
    if not np.all(carried[(middle.thickness >= 2.4e-3) & (middle.thickness <= 4.1e-3)]):
        return {"refused": f"the load is not carried on the paddings of the windows: {np.sum(carried)} of {carried.size}"}
    advised = float(middle.thickness[carried][np.argmax(middle.best.signal[2, carried])])
    ends = [float(np.interp(advised, middle.thickness[carried], middle.best.signal[k, carried])) for k in (0, 4)]
    row["advised"], row["in band, advised"] = advised, bool(ends[0] <= float(truth.signal(advised)) <= ends[1])
    signal, stroke = (
        CubicSpline(middle.thickness[carried], values[2, carried]) for values in (middle.best.signal, middle.best.stroke)
    )
    fine = np.linspace(LOWER, UPPER, 801)
    for kind, w in WINDOWS.items():
        least, most = w.signal * float(signal(w.signal_padding)), w.stroke * float(stroke(w.stroke_padding))
        limits = (Limit("signal", "at_least", least), Limit("stroke", "at_most", most))
        chosen = {way: asked(of, limits, LOWER, UPPER, STEPS) for way, of in ways.items()}
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


def _real(lab: Lab, padding: float, gap: FloatArray, quick: bool) -> tuple[float, float, float]:
    """What the design of a lab really does on a padding: change of capacitance, depth [m] and thinning of the dielectric.

    `gap` (2,) is by which share force at a depth, and change, are off the model there.
    """
    built = replace(lab.design, padding=replace(lab.design.padding, thickness=padding))
    load = np.array([FORCE / (1 + gap[0])])
    if quick:
        pressed = press_to(curves_of(lab.forward, built.draws()), load)
        at, wrong = signal_at(pressed), np.random.default_rng(lab.seed).standard_normal(2)
        depth = float(pressed.depth[0, 0]) - wrong[0] * float((pressed.compliance * pressed.force_error)[0, 0])
        thinned = load_thinning().of(built.draws(), pressed.depth)[0]
        return float((1 + gap[1]) * (at.change + wrong[1] * at.change_error)[0, 0]), depth, float(thinned[0, 0])
    solution = FiniteElements(ACCURACY).solve_to_force(built, load)
    state, mesh, unit = solution.states[-1], solution.model.mesh, solution.units.length
    h_s, t_d = (float(np.asarray(x)) / unit for x in (built.sensor.thickness, built.dielectric_thickness))
    thin = float(largest_thinning(mesh, state.u, padding / unit + h_s / 2, np.array([t_d]))[0])
    return (1 + gap[1]) * float(solution.response.capacitance_change[-1]), float(solution.response.depth[-1]), thin


def table(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Lines of the tables in Markdown, for each kind."""
    for kind in dict.fromkeys(row["kind"] for row in rows):
        yield from (f"### {kind}", "", *_table_of([row for row in rows if row["kind"] == kind]), "")


def _table_of(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    done = [row for row in rows if "refused" not in row]
    yield f"{len(rows)} labs, {len(rows) - len(done)} of them with a sensor that cannot be pressed so far;"
    by_chains = [row for row in done if row["by"] == "chains"]
    not_converged = sum(not row["converged"] for row in by_chains)
    yield f"{len(by_chains)} calibrated by chains, {not_converged} of which have not converged."
    yield f"{np.sum([row['processor'] for row in rows]):.0f} s of processor time."
    if not done:
        return
    yield ""
    yield "| limit on | " + " | ".join(f"said {p:.0%}" for p in STATED) + " |"
    yield "|---" * (1 + len(STATED)) + "|"
    names = [name for name, _, _ in _IMPOSSIBLE]
    for name in (*names, "all"):
        which = names if name == "all" else [name]
        keys = [[f"{n} {p:g}" for n in which] for p in STATED]
        rates = [[row["stated"][key] for row in done for key in of if key in row["stated"]] for of in keys]
        yield f"| {name.replace('_', ' ')} | " + " | ".join(_share(own) if own else "-" for own in rates) + " |"
    inside = _share([row["in band"] for row in done])
    done = [row for row in done if row["windows"]]
    yield ""
    yield f"90 % bands of the signal hold the truth in {inside} of the labs on 4 mm of padding"
    if not done:
        return
    there = _share([row["in band, advised"] for row in done])
    yield f"and in {there} of {len(done)}"
    yield f"on the padding of the largest signal ({1e3 * np.median([row['advised'] for row in done]):.1f} mm, median)."
    yield ""
    yield "| specification | chosen by | failure said | failure found | regret, mean | regret, worst |"
    yield "|---|---|---|---|---|---|"
    for name in WINDOWS:
        for way in WAYS:
            own = [row["windows"][name][way] for row in done]
            said = np.mean([one["said"] for one in own]) if way == WAYS[0] else math.nan
            regret = np.array([one["regret"] for one in own])
            told = "-" if math.isnan(said) else f"{said:.0%}"
            error = np.std(regret) / math.sqrt(len(regret))
            yield (
                f"| {name} | {way} | {told} | {_share([one['failed'] for one in own])} | {np.mean(regret):.3%} ± {error:.3%} | "
                f"{np.max(regret):.2%} |"
            )


def _share(flags: Sequence[bool]) -> str:
    p = float(np.mean(flags))
    return f"{p:.1%} ± {math.sqrt(max(p * (1 - p), 0.25 / len(flags)) / len(flags)):.1%}"


def main(words: Sequence[str] | None = None) -> None:
    """Ask the labs and print the tables."""
    parser = lab_parser(__doc__, KINDS, 500)
    parser.add_argument("--quick", action="store_true", help="the surrogate for truth, not the finite elements")
    parser.add_argument("--draws", type=int, default=400, help="of each posterior")
    parser.add_argument(
        "--bands", action="store_true", help="limits and band on 4 mm alone, no windows: in a third of the time"
    )
    parser.add_argument("--chains", action="store_true", help="calibrate every lab by chains, to hold the others against")
    given = parsed(parser, words, KINDS)
    one: Callable[..., dict[str, Any]] = partial(
        answer, quick=given.quick, n_draw=given.draws, chains=given.chains, bands=given.bands
    )
    rows = rows_of(one, given.kinds, given.labs, 0, given.processes, given.output)
    print("\n".join(table(sorted(rows, key=lambda row: KINDS.index(row["kind"])))))


if __name__ == "__main__":
    main()

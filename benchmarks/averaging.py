"""Whether intervals of averaged models cover where one of the models is true: `python benchmarks/averaging.py -o FILE`.

Labs of `simulated.faulty` in which the experiment's own model is true, or another that differs in one choice. Every model that
`calib compare` would calibrate is asked for its posterior by importance draws near its mode, as the first answer is, with its
evidence, and with the density of each block of data given the others: by weights of the draws, or where k-hat is above 1 by
the evidences with and without it.
Printed for the experiment's own model and for averages by evidence, stacking and pseudo-BMA+: how many of the central 90 % of
Young's modulus, and of the signal at 10 N on the padding that each recommends, hold the truth; how wide they are beside those
of the experiment's own model (median); their score, which holds both together, over the truth (mean, the less the better); and
how much the model of the planted fault counts (mean). Labs in which the experiment's own model or that of the fault has no such
answer, as it would take sampling, are left out of the table. With -o labs are kept, a line of JSON each, and are not repeated.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any, cast

import numpy as np
from simulated.answered import weighted_posterior
from simulated.faulty import Lab, lab_of, true_signal
from simulated.labs import lab_parser, parsed, rows_of

from calib.checks import USUAL, WEIGHTINGS, AverageMember, ComparedModel, Member, Verdict, Weighting, average_models
from calib.decision import Requirement, recommend
from calib.errors import InputError
from calib.experiment import candidates_of, forward_of_experiment
from calib.problem import Problem, build_problem, log_likelihood_blocks, without_block
from calib.sampling import (
    LeaveOut,
    Look,
    Posterior,
    first_answer,
    look_at,
    smooth_weights,
)
from models.response import Forward
from models.threads import one_thread

#: What is planted -> the candidate that holds it.
KINDS = {
    "sound": "as-given",
    "slippery base": "slippery",
    "friction 0.3": "friction",
    "padding 20 % softer": "own-padding",
    "padding 30 % harder": "own-padding",
}
#: The experiment's own model alone, among ways to average.
AS_GIVEN = "as given"
#: Force [N] at which the signal counts, and the paddings [m] to choose from.
FORCE, PADDINGS, N_PADDING = 10.0, (0.5e-3, 6e-3), 23
#: A k-hat above which weights of draws say nothing of a block; a calibration, which takes longer, is content with 0.7 at most.
FAR = 1.0
#: A model of so much less log evidence than the best would have no weight in any way, and is not averaged.
HOPELESS = 15.0


@dataclass(frozen=True, eq=False)
class Answered:
    """A model with its posterior by importance draws, and how well it predicts each block; None of one that is hopeless."""

    model: AverageMember
    candidate: ComparedModel | None


def lab_row(name: str, seed: int, _: int, candidates: tuple[str, ...] = ()) -> dict[str, Any]:
    """Simulate one lab, ask all models, and say what each way to average them makes of it."""
    with one_thread():
        began = time.process_time()
        made = lab_of(name, seed)
        lab = replace(made, experiment=replace(made.experiment, candidates=candidates))
        answered = answers(lab, seed)
        row = {"kind": name, "seed": seed, "truth": float(np.asarray(lab.designs[0].sensor.young_modulus))}
        if answered and answered[0].model.name == "as-given":

            @cache
            def truth(specimen: int, padding: float) -> float:
                return true_signal(lab, specimen, padding, FORCE)

            row |= {way: _of_way(lab, answered, way, seed, truth) for way in (AS_GIVEN, *WEIGHTINGS)}
        return {**row, "processor": round(time.process_time() - began, 1)}


def answers(lab: Lab, seed: int) -> list[Answered]:
    """Posterior, evidence and left-out blocks of every model that has an answer, the experiment's own first."""
    looks: list[tuple[str, Problem, Look, Posterior]] = []
    near: dict[str, float] | None = None
    for variant in candidates_of(lab.experiment):
        experiment = variant.of(lab.experiment)
        try:
            problem = build_problem(experiment, lab.sweeps, forward_of_experiment(experiment))
            begin = None if near is None else {"padding_young_modulus": near["young_modulus"], **near}
            look = look_at(problem, begin)
            posterior = weighted_posterior(problem, look, np.random.default_rng([seed, 1]))
        except (InputError, ValueError):
            continue
        near = _means(posterior) if near is None else near
        looks.append((variant.name, problem, look, posterior))
    best = max((look.log_evidence for _, _, look, _ in looks), default=0.0)
    found = []
    for name, problem, look, posterior in looks:
        candidate = None
        if look.log_evidence > best - HOPELESS:
            candidate = ComparedModel(name, posterior, _left_out(problem, look, _means(posterior)), 0.0, 0.0)
        found.append(Answered(AverageMember(name, posterior, problem.forward, Verdict()), candidate))
    return found


def _means(posterior: Posterior) -> dict[str, float]:
    return {name: s.mean for name, s in posterior.diagnostics.parameters.items()}


def _left_out(problem: Problem, look: Look, near: Mapping[str, float]) -> LeaveOut:
    """Log density of each block given the others, 1 / E[1 / p(y_b | y_-b, draw)], or the ratio of two evidences."""
    log_density = log_likelihood_blocks(problem, look.theta)
    pointwise, k_hat = np.empty(log_density.shape[1]), np.empty(log_density.shape[1])
    whole, refitted = math.nan, []
    for b, own in enumerate(log_density.T):
        with np.errstate(divide="ignore"):
            weight, k_hat[b] = smooth_weights(np.log(look.weight) - own)
        pointwise[b] = np.log(weight @ np.exp(own - np.max(own))) + np.max(own)
        if not k_hat[b] <= FAR:
            try:
                whole = first_answer(problem, near).log_evidence if math.isnan(whole) else whole
                pointwise[b] = whole - first_answer(without_block(problem, b), near).log_evidence
                refitted.append(b)
            except ValueError:
                pass
    return LeaveOut(float(np.sum(pointwise)), math.nan, math.nan, pointwise, k_hat, tuple(refitted))


def _of_way(
    lab: Lab, answered: Sequence[Answered], way: str, seed: int, truth: Callable[[int, float], float]
) -> dict[str, Any]:
    """What one way makes of a lab: intervals of modulus and signal, and the truth of the signal."""
    posterior, forward = answered[0].model.posterior, answered[0].model.forward
    members: tuple[Member, ...] = ()
    if way != AS_GIVEN:
        compared = {a.model.name: (a.model, a.candidate) for a in answered if a.candidate is not None}
        models, candidates = zip(*compared.values(), strict=True)
        posterior, members = average_models(models, candidates, cast(Weighting, way))
    modulus = posterior.draws[..., [p.name for p in posterior.parameters].index("young_modulus")]
    return {
        "modulus": [float(q) for q in np.quantile(modulus, [0.05, 0.95])],
        "weights": {m.name: round(m.weight, 4) for m in members} or {"as-given": 1.0},
        **_signal(lab, posterior, forward, members, seed, truth),
    }


def _signal(
    lab: Lab, posterior: Posterior, forward: Forward, members: Sequence[Member], seed: int, truth: Callable[[int, float], float]
) -> dict[str, Any]:
    wanted = Requirement(FORCE, *PADDINGS, n_thickness=N_PADDING)
    try:
        best = recommend(posterior, forward, wanted, seed=seed, verdict=Verdict(), members=members)
    except InputError:
        return {}
    signals = [truth(k, best.best) for k in range(len(lab.designs))]
    band = best.change_at_best
    return {
        "padding": best.best,
        "signal": [float(band[0]), float(band[-1])],
        "signals": signals,
        "sure": best.best_probability,
    }


def table(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Lines of a table in Markdown: for each kind and all of them, and each way, what it covers."""
    yield "| planted | labs | way | modulus covered | wide | score | signal covered | wide | score | weight of its model |"
    yield "|---|---|---|---|---|---|---|---|---|---|"
    known = [row for row in rows if AS_GIVEN in row and KINDS[row["kind"]] in row[USUAL]["weights"]]
    groups = [(name, [row for row in known if row["kind"] == name]) for name in KINDS]
    for name, own in [*((n, g) for n, g in groups if g), ("all", known)]:
        for way in (AS_GIVEN, *WEIGHTINGS):
            weight = np.mean([r[way]["weights"].get(KINDS[r["kind"]], 0.0) for r in own])
            cells = (*_cells(own, way, "modulus"), *_cells(own, way, "signal"))
            yield f"| {name} | {len(own)} | {way} | {' | '.join(cells)} | {weight:.2f} |"


def _cells(rows: Sequence[Mapping[str, Any]], way: str, key: str) -> tuple[str, str, str]:
    """How many intervals hold the truth, their median width over that of the experiment's own model, and the mean score."""
    told = [r for r in rows if key in r[way]]
    pairs = [(r[way][key], truth) for r in told for truth in ([r["truth"]] if key == "modulus" else r[way]["signals"])]
    scores = [(_score(interval, truth), truth) for interval, truth in pairs if math.isfinite(truth)]
    inside = sum(interval[0] <= truth <= interval[1] for interval, truth in pairs)
    wide = [float(np.ptp(r[way][key]) / np.ptp(r[AS_GIVEN][key])) for r in told if key in r[AS_GIVEN]]
    mean = 100 * float(np.mean([score / truth for score, truth in scores])) if scores else math.nan
    return f"{inside} of {len(scores)}", f"{np.median(wide):.2f}" if wide else "-", f"{mean:.1f} %"


def _score(interval: Sequence[float], truth: float) -> float:
    """Score of a central 90 % interval, the less the better: Gneiting & Raftery, J. Am. Stat. Assoc. 102 (2007) 359, Eq. 43."""
    low, high = interval
    return high - low + 20 * max(low - truth, truth - high, 0.0)


def main(words: Sequence[str] | None = None) -> None:
    """Ask the labs that are wanted and print the table of all."""
    parser = lab_parser(__doc__, KINDS, 8)
    parser.add_argument("--candidates", nargs="*", default=[], help="models beside the experiment's own [default: all]")
    given = parsed(parser, words, KINDS)
    asked = partial(lab_row, candidates=tuple(given.candidates))
    rows = rows_of(asked, given.kinds, given.labs, 0, given.processes, given.output)
    print("\n".join(table(rows)))


if __name__ == "__main__":
    main()

"""Plant faults in simulated labs and see whether a verdict is green where it is wrong: `python benchmarks/faults.py -o FILE`.

Each lab of `simulated.faulty` is checked and calibrated as the shipped experiment is, other models are held against its data,
and a padding is recommended for 10 N. A headline, Young's modulus or the signal at that padding, is called wrong where the
truth lies outside its 90 % interval by more than one standard deviation; if the specimens differ, where one of theirs does.
What `calib calibrate` would stop at, as its files cannot be read or its check is red, is refused here as well and has no
headline.
Printed for each kind: labs with a wrong headline, and how many of these are amber or red; labs whose headlines are right, and
how many of these are; which gates object, and how often. It is the verdict on the calibration that counts: that on the
padding is amber in all of them, as none was pressed to 10 N. With -o labs are kept, a line of JSON each, and are not
repeated.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from simulated.faulty import KINDS, Lab, lab_of, true_signal
from simulated.labs import print_labs

from calib.checks import (
    FILES,
    judge_posterior,
    look_elsewhere,
    plausibility,
    predict,
    with_blocks_foretold,
    with_elsewhere,
    with_sensitivity,
)
from calib.decision import Requirement, recommend
from calib.errors import InputError
from calib.experiment import forward_of_experiment
from calib.problem import build_problem
from calib.sampling import first_answer, sample
from models.threads import one_thread

#: Force [N] at which the signal counts, and the paddings [m] to choose from.
FORCE, PADDINGS = 10.0, (0.5e-3, 6e-3)


def calibrate(name: str, seed: int, max_steps: int) -> dict[str, Any]:
    """Simulate, calibrate and judge one lab."""
    with one_thread():
        began = time.process_time()
        try:
            found = _calibrate(lab_of(name, seed), seed, max_steps)
        except InputError as error:
            found = {"refused": str(error.faults[0])}
    return {"kind": name, "seed": seed, **found, "processor": round(time.process_time() - began, 1)}


def _calibrate(lab: Lab, seed: int, max_steps: int) -> dict[str, Any]:
    moduli = [float(np.asarray(design.sensor.young_modulus)) for design in lab.designs]
    forward = forward_of_experiment(lab.experiment)
    problem = build_problem(lab.experiment, lab.sweeps, forward)
    before = plausibility(problem)
    if stop := [reason for reason in before.reasons if reason.level == "red" and reason.gate != FILES]:
        return {"refused": stop[0].finding, "reasons": [[r.gate, r.level, r.finding] for r in stop]}
    first = before.first
    if first is None:  # which the check does without where it says enough
        with suppress(ValueError):
            first = first_answer(problem)
    posterior = sample(problem, seed=seed, processes=0, max_steps=max_steps)
    posterior = with_sensitivity(with_elsewhere(posterior, look_elsewhere(problem, first)))
    posterior = with_blocks_foretold(posterior, forward)
    predictions = predict(posterior, forward, np.random.default_rng(seed))
    verdict = judge_posterior(posterior, predictions, [reason for reason in before.reasons if reason.gate != FILES])
    found = posterior.draws.reshape(-1, len(problem.names))[:, problem.names.index("young_modulus")]
    row: dict[str, Any] = {
        "verdict": verdict.colour,
        "reasons": [[r.gate, r.level, r.finding] for r in verdict.reasons],
        "others": {d.name: round(d.log_bayes, 1) for d in posterior.diagnostics.departures if math.isfinite(d.log_bayes)},
        "truth": moduli,
        "mean": float(np.mean(found)),
        "sd": float(np.std(found)),
        "modulus": max((_beyond(modulus, found) for modulus in moduli), key=abs),
    }
    try:
        best = recommend(posterior, forward, Requirement(FORCE, *PADDINGS, n_thickness=23), seed=seed, verdict=verdict)
    except InputError:
        return row
    signals = [true_signal(lab, k, best.best, FORCE) for k in range(len(lab.designs))]
    band = best.change_at_best
    sd = float(band[-1] - band[0]) / (2 * 1.645)
    offs = [0.0 if band[0] <= s <= band[-1] else float(min(abs(s - band[0]), abs(s - band[-1]))) / sd for s in signals]
    return {**row, "advice": best.verdict.colour, "padding": best.best, "signals": signals, "signal": max(offs, default=0.0)}


def _beyond(truth: float, draws: np.ndarray[Any, Any]) -> float:
    """How far a truth lies outside the central 90 % of draws, in their standard deviations; 0 inside."""
    low, high = np.quantile(draws, [0.05, 0.95])
    off = truth - high if truth > high else truth - low if truth < low else 0.0
    return float(off / np.std(draws))


def is_wrong(row: Mapping[str, Any]) -> bool:
    """Whether a headline of a lab that was not refused is off by more than one standard deviation beyond its interval."""
    return "refused" not in row and (abs(row["modulus"]) > 1 or row.get("signal", 0.0) > 1)


def objected(row: Mapping[str, Any]) -> bool:
    """Whether a calibration is anything but green, or was refused."""
    return "refused" in row or row["verdict"] != "green"


def table(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Lines of a table in Markdown, one for each kind and one for all faults."""
    yield "| planted | labs | wrong | of these amber or red | right | of these amber or red | gates |"
    yield "|---|---|---|---|---|---|---|"
    names = list(dict.fromkeys(row["kind"] for row in rows))
    groups = [(name, [row for row in rows if row["kind"] == name]) for name in names]
    groups.append(("all faults", [row for row in rows if row["kind"] != "sound"]))
    for name, own in groups:
        wrong, right = [r for r in own if is_wrong(r)], [r for r in own if not is_wrong(r)]
        gates = Counter(g for r in own for g in {x[0] for x in r.get("reasons", [["refused"]])})
        told = ", ".join(f"{gate} {n}" for gate, n in gates.most_common())
        counts = (len(own), len(wrong), sum(map(objected, wrong)), len(right), sum(map(objected, right)))
        yield f"| {name} | {' | '.join(map(str, counts))} | {told} |"


def main(words: Sequence[str] | None = None) -> None:
    """Judge the labs that are asked for and print the table of all."""
    print_labs(words, __doc__, KINDS, calibrate, table, labs=14, limit=("--steps", 1500, "of each walker, at most"))


if __name__ == "__main__":
    main()

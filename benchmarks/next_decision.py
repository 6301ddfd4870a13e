"""Decide on a specification after what `calib next --for spec` says: `python benchmarks/next_decision.py --labs 20 -o FILE`.

A simulated lab is one specimen of `benchmarks/next.py`, calibrated by weighted draws. It is asked for padding that keeps a
window of signal and stroke about what its posterior's medians do on 3 mm of padding, so that it hangs on what is not known.
Of a measurement of each kind it is worked out how often it would be decided wrongly after it. Then it is made: in sensors
that are drawn from the lab's posterior, as what will be read is not known; each time all is calibrated again, and what is won
by that decision is told by the new posterior: P - p if sensors are released, and nothing if they are held back, which is all of
the loss that a decision changes (`calib.decision.release`). Printed for each kind: what is won now, what is expected after it,
and the mean that came, with the standard error over labs of the difference. With -o labs are kept, a line of JSON each, and not
repeated.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from next import EXPERIMENT, Left, lab, looked, made
from simulated.answered import weighted_posterior
from simulated.labs import keep_row, kept_rows

from calib.checks import Verdict
from calib.decision import conform, next_measurements
from calib.decision.candidates import candidates_of
from calib.decision.known import Known
from calib.experiment import PRESSES, READINGS, Bench, Limit, Specification, forward_of_experiment, read_experiment
from calib.problem import columns_at
from calib.sampling import Look
from models.response import Forward
from models.sensor import FloatArray

#: Kinds of measurement, and what a lab has for them.
KINDS = ("ball", "padding", "padding_thickness", "machine_compliance")
BENCH = Bench(balls=(3e-3,), paddings=(3.3e-3,))
#: Load [N], padding [m] about which the window lies, how wide it is, and probability that is asked for.
FORCE, PADDING, ROOM, ASKED = 5.0, 3e-3, 0.025, 0.8
LOWER, UPPER, STEPS, DRAWS = 2.6e-3, 3.4e-3, 9, 2000


def window(look: Look, forward: Forward, seed: int, rng: np.random.Generator) -> Specification:
    """What a lab is asked for: signal and stroke within so much of what they are on 3 mm of padding, by medians."""
    wide = Specification((Limit("signal", "at_least", 1e-4),), (FORCE,), lower=LOWER, upper=UPPER, steps=STEPS)
    middle = conform(weighted_posterior(look.problem, look, rng), forward, wide, seed=seed, verdict=Verdict()).best
    at = round((PADDING - LOWER) / (UPPER - LOWER) * (STEPS - 1))
    signal, stroke = float(middle.signal[2, at]), float(middle.stroke[2, at])
    limits = (Limit("signal", "at_least", (1 - ROOM) * signal), Limit("stroke", "at_most", (1 + ROOM) * stroke))
    return replace(wide, limits=limits, probability=ASKED, n_draw=DRAWS)


def won_by(look: Look, forward: Forward, specification: Specification, seed: int, rng: np.random.Generator) -> float:
    """What deciding by a posterior wins, as it says itself, for sensors like the first, not like one made to learn from."""
    posterior = weighted_posterior(look.problem, look, rng)
    first = replace(posterior.experiment, specimens=posterior.experiment.specimens[:1])
    posterior = replace(posterior, experiment=first, sweeps=posterior.sweeps[:1])
    found = conform(posterior, forward, specification, seed=seed, verdict=Verdict())
    return max(float(np.nanmax(found.best.probability)) - ASKED, 0.0)


def decided(seed: int, kinds: Sequence[str], readings: int) -> dict[str, Any]:
    """One lab: what is won now, and for each kind what is expected and came."""
    forward = forward_of_experiment(read_experiment(EXPERIMENT))
    rng = np.random.default_rng([7, seed])
    problem, _, left = lab("one specimen", forward, rng)
    row: dict[str, Any] = {"seed": seed, "kinds": {}}
    look = looked(problem)
    if look is None:
        return {**row, "outcome": "not to be trusted"}
    specification = window(look, forward, seed, rng)
    posterior = weighted_posterior(problem, look, rng)
    bench = replace(BENCH, without=frozenset({*PRESSES, *READINGS} - {*kinds}))
    found = next_measurements(posterior, forward, specification, bench, seed=seed, verdict=Verdict())
    deciding = found.deciding
    assert deciding is not None
    now = max(deciding.probability - ASKED, 0.0)
    row |= {"outcome": "done", "now": now}
    known = Known(problem, look.weight @ look.theta, look.theta[rng.choice(len(look.theta), 4000, p=look.weight)])
    for candidate in candidates_of(known, bench)[0]:
        expected = next((one for one in found.ranked if one.what == candidate.what), None)
        if expected is None or expected.decided is None:
            continue
        came = []
        for k in range(readings):
            truth = {**dict(zip(problem.names, _picked(look, rng), strict=True)), **problem.fixed}
            after = made(candidate, problem, truth, Left((*left.seed, k), left.lengths), rng)
            again = None if after is None else looked(after)
            if again is not None:
                came.append(won_by(again, forward, specification, seed, rng))
        gain = deciding.now.loss - expected.decided.loss
        of = {"expected": now + gain, "share": expected.decided.share, "came": came}
        row["kinds"][candidate.kind] = of
    return row


def _picked(look: Look, rng: np.random.Generator) -> FloatArray:
    """Values [SI] of a draw of the posterior: a sensor as it may be."""
    one = look.theta[rng.choice(len(look.theta), 1, p=look.weight)]
    return np.asarray(columns_at(look.problem, one)[0], dtype=float)


def tell(rows: Sequence[dict[str, Any]]) -> None:
    """Print what is won, kind by kind."""
    done = [row for row in rows if row["outcome"] == "done"]
    print("| measurement | labs | readings | won now | expected after it | came | standard error |")
    print("|---|---|---|---|---|---|---|")
    for kind in dict.fromkeys(kind for row in done for kind in row["kinds"]):
        own = [(row["now"], row["kinds"][kind]) for row in done if row["kinds"].get(kind, {}).get("came")]
        if own:
            came = np.array([np.mean(of["came"]) for _, of in own])
            means = [np.mean([now for now, _ in own]), np.mean([of["expected"] for _, of in own]), np.mean(came)]
            error = np.std(came - np.array([of["expected"] for _, of in own])) / np.sqrt(len(own))
            told = " | ".join(f"{100 * mean:.2f} %" for mean in means)
            print(f"| {kind} | {len(own)} | {sum(len(of['came']) for _, of in own)} | {told} | {100 * error:.2f} % |")
    print(f"{len(rows)} labs, {len(rows) - len(done)} of them left out")


def main(words: Sequence[str] | None = None) -> None:
    """Print a table of what was expected of decisions and what came."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--labs", type=int, default=20)
    parser.add_argument("--readings", type=int, default=4, help="of each measurement in each lab")
    parser.add_argument("--kinds", nargs="*", default=KINDS, help="of measurements")
    parser.add_argument("-o", "--output", type=Path, help="file for the labs, a line of JSON each")
    given = parser.parse_args(words)
    rows = kept_rows(given.output)
    known = {row["seed"] for row in rows}
    for seed in range(given.labs):
        if seed not in known:
            rows.append(decided(seed, given.kinds, given.readings))
            keep_row(given.output, rows[-1])
    tell(rows)


if __name__ == "__main__":
    main()

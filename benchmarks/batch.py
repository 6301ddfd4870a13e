"""Inspect simulated batches: `python benchmarks/batch.py --lots 3 --lot 2 --new 50 --folder batches`.

A lot is drawn, with its rig, and the lab files of the specimens that are calibrated and of those made after them are written,
by finite elements (with --surrogate by the surrogate, which takes no time). The first are calibrated by chains under partial
pooling, the others inspected as by `calib batch`, against a limit on the signal that half of them meet. Printed: seconds;
how far means and standard deviations of the first --exact specimens of each lot are off those of the whole calibration with
them in it (weighted draws of its first answer, where they are worth 200; with --chains chains until their gate is met, which
are kept in the folder); how often central 90 % hold the truth; how often a specimen passes that does not conform and fails that
would, beside the risks that were stated; and with --odd, one specimen in ten being of other making or pressed in another way,
which of them were named, and how many sound ones.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from simulated.batches import EXPERIMENT, SIGNAL_AT, Made, Oddity, curve_by, make_lot

from calib.catalogue import POOLED
from calib.checks import Verdict
from calib.decision import Inspected, Inspection, Presented, inspect
from calib.experiment import Limit, Specification, forward_of_experiment, read_experiment, read_sweeps
from calib.problem import Problem, newcomer_experiment, newcomer_of, problem_from, values_at
from calib.runs.batch import inspection_of, newcomers_in
from calib.sampling import Posterior, given_lot, joined_problem, load_posterior, look_at, sample, save_posterior
from calib.workers import workers
from models.response import Forward

#: What is planted, one after the other.
ODD: Mapping[str, Oddity] = {
    "modulus 25 % up": Oddity({"young_modulus": 1.25}),
    "ball of 4 mm": Oddity({}, ball=4e-3),
    "padding 30 % thicker": Oddity({"padding_thickness": 1.3}),
    "permittivity 25 % up": Oddity({"relative_permittivity": 1.25}),
    "modulus 20 % down": Oddity({"young_modulus": 0.8}),
}
# Effective draws that a reference must be worth.
_WORTH = 200.0


def calibrated(folder: Path, seed: int, given: argparse.Namespace) -> tuple[Made, Posterior, Forward]:
    """A simulated lot in a folder, and its calibration; made if they are not there."""
    place = folder / f"lot of {given.lot}, seed {seed}"
    odd = {k: list(ODD.values())[k // 10 % len(ODD)] for k in range(5, given.new, 10)} if given.odd else {}
    forward = forward_of_experiment(read_experiment(EXPERIMENT))
    if (place / "truth.json").exists():
        truth = json.loads((place / "truth.json").read_text(encoding="utf-8"))
        made = Made(place / "lot" / "experiment.toml", place / "new", truth)
    elif given.surrogate:
        made = make_lot(place, seed, lot=given.lot, new=given.new, odd=odd, curve=curve_by(forward))
    else:
        made = make_lot(place, seed, lot=given.lot, new=given.new, odd=odd)
    kept = place / "posterior.nc"
    if not kept.exists():
        problem = problem_from(read_experiment(made.experiment), forward)
        save_posterior(sample(problem, seed=1, processes=given.processes, max_steps=given.steps), kept)
    return made, load_posterior(kept), forward


def against_whole(inspection: Inspection, one: Presented, kept: Path, steps: int) -> dict[str, tuple[float, float]] | None:
    """How far means [sd] and standard deviations (as a factor) of a newcomer are off those of the whole calibration.

    That is by its first answer, or by chains of so many steps at most, which a file keeps; 0 for the first answer.
    """
    experiment = newcomer_experiment(inspection.lot, inspection.template, "newcomer")
    experiment = replace(experiment, specimens=(replace(experiment.specimens[0], sweeps=one.sweeps),))
    newcomer = newcomer_of(inspection.lot, experiment, read_sweeps(experiment), inspection.forward, inspection.template.name)
    found = given_lot(newcomer, inspection.seed)
    problem = joined_problem(inspection.lot, inspection.sweeps, newcomer)
    whole = _by_chains(problem, kept, steps) if steps else _by_first_answer(problem)
    if whole is None:
        return None
    off = {}
    for own in newcomer.own:
        b = found.values[own.info.name]
        mean, sd = whole[own.info.name]
        own_mean = float(found.weight @ b)
        own_sd = float(np.sqrt(found.weight @ (b - own_mean) ** 2))
        off[own.info.parameter] = ((own_mean - mean) / sd, own_sd / sd)
    return off


def _by_first_answer(problem: Problem) -> dict[str, tuple[float, float]] | None:
    """Mean and standard deviation of every unknown by weighted draws; None where they are worth too little."""
    look = look_at(problem)
    if look.effective_draws < _WORTH:
        return None
    found = {}
    for name, column in values_at(problem, look.theta).items():
        mean = float(look.weight @ column)
        found[name] = mean, float(np.sqrt(look.weight @ (column - mean) ** 2))
    return found


def _by_chains(problem: Problem, kept: Path, steps: int) -> dict[str, tuple[float, float]] | None:
    """The same by chains; None where they have not converged."""
    if not kept.exists():
        facts = sample(problem, seed=2, processes=0, max_steps=steps).diagnostics
        rows = {name: [row.mean, row.sd, row.ess_bulk] for name, row in facts.parameters.items()}
        kept.write_text(json.dumps({"converged": facts.converged, "rows": rows}), encoding="utf-8")
    read = json.loads(kept.read_text(encoding="utf-8"))
    return {name: (row[0], row[1]) for name, row in read["rows"].items()} if read["converged"] else None


def batch_of(folder: Path, seed: int, given: argparse.Namespace) -> dict[str, Any]:
    """Inspect the newcomers of one lot: rows, seconds, and how far some are off the whole calibration."""
    made, posterior, forward = calibrated(folder, seed, given)
    plain = inspection_of(posterior, forward, Verdict(), None, None, 1, 0.0)
    new = [own["signal"] for name, own in made.truth.items() if name.startswith("s")]
    limit = float(np.nanmedian(new))
    specification = Specification((Limit("signal", "at_least", limit),), (SIGNAL_AT,), probability=given.probability)
    inspection = inspection_of(posterior, forward, Verdict(), specification, None, 1, 0.0)
    began = time.perf_counter()
    ones, _ = newcomers_in(made.folder, inspection, folder / "none")
    with workers(given.processes) as executor:
        rows = [future.result() for future in [executor.submit(inspect, inspection, one) for one in ones]]
    wall = time.perf_counter() - began
    place, steps = folder / f"lot of {given.lot}, seed {seed}", given.steps if given.chains else 0
    held = [against_whole(plain, one, place / f"whole {one.name}.json", steps) for one in ones[: given.exact]]
    exact = [found for found in held if found is not None]
    return {
        "rows": rows,
        "truth": made.truth,
        "limit": limit,
        "wall": wall,
        "processor": [row.seconds for row in rows],
        "exact": exact,
        "converged": posterior.diagnostics.converged,
    }


def report(lots: Sequence[Mapping[str, Any]], given: argparse.Namespace) -> None:
    """Print what was found of all lots."""
    pairs = [(row, lot["truth"][row.name], lot["limit"]) for lot in lots for row in lot["rows"]]
    planted = {f"s{k + 1:03d}": list(ODD)[k // 10 % len(ODD)] for k in range(5, given.new, 10)} if given.odd else {}
    sound = [pair for pair in pairs if pair[0].name not in planted]
    n = len(pairs)
    cpu = np.concatenate([lot["processor"] for lot in lots])
    walls = ", ".join(f"{lot['wall']:.0f}" for lot in lots)
    print(f"{len(lots)} lots of {given.lot}, {n} newcomers; lots that have converged: {sum(lot['converged'] for lot in lots)}")
    print(f"wall seconds of each lot on {max(given.processes, 1)} processes: {walls}; processor: {np.sum(cpu):.0f} in all,")
    print(f"  {np.median(cpu):.2f} s each (median), {np.max(cpu):.2f} s at most")
    k_hat = np.array([row.k_hat for row, _, _ in sound])
    print(
        f"k-hat above 0.7: {np.sum(~(k_hat <= 0.7))} of {len(sound)} sound ones; effective draws "
        f"{np.median([row.effective for row, _, _ in sound]):.0f} (median)"
    )
    off = [found for lot in lots for found in lot["exact"]]
    if off:
        shifts = np.array([[abs(shift) for shift, _ in one.values()] for one in off])
        ratios = np.array([[ratio for _, ratio in one.values()] for one in off])
        print(
            f"against the whole calibration ({len(off)} newcomers): means off by {np.sqrt(np.mean(shifts**2)):.3f} sd (rms), "
            f"{np.max(shifts):.2f} at most; sds by a factor of {np.min(ratios):.2f} to {np.max(ratios):.2f}"
        )
    print(f"\n{'central 90 % hold the truth':28s} {'share':>6s}  n")
    for name in (*POOLED, "signal"):
        known = [(row.estimates[name], truth[name]) for row, truth, _ in sound if name in row.estimates]
        known = [(estimate, value) for estimate, value in known if np.isfinite(value)]
        if known:
            held = np.mean([low <= value <= high for (_, _, low, high), value in known])
            print(f"{name:28s} {held:6.0%}  {len(known)}")
    told = [(row, truth["signal"], limit) for row, truth, limit in sound if np.isfinite(truth["signal"])]
    judged = [(row, signal >= limit) for row, signal, limit in told if row.decision != "none"]
    if judged:
        passed = [(row, conforms) for row, conforms in judged if row.decision == "pass"]
        failed = [(row, conforms) for row, conforms in judged if row.decision == "fail"]
        said = [sum(1 - row.conformity.probability for row, _ in passed), sum(row.conformity.probability for row, _ in failed)]
        found = [sum(not conforms for _, conforms in passed), sum(conforms for _, conforms in failed)]
        print(f"\npass with {given.probability:.0%}: {len(passed)} of {len(judged)}")
        for kind, stated, real in zip(("pass and do not conform", "fail and would conform"), said, found, strict=True):
            print(f"{kind}: said {stated:.1f}, found {real}, of {len(judged)}")
    alarms = sum(_named(row) for row, _, _ in sound)
    colours = {c: sum(row.verdict.colour == c for row, _, _ in sound) for c in ("green", "amber", "red")}
    print(f"\nsound newcomers named as strangers: {alarms} of {len(sound)}; verdicts {colours}")
    for what in ODD if given.odd else ():
        own = [row for row, _, _ in pairs if planted.get(row.name) == what]
        found = [f"{row.verdict.colour} ({', '.join(dict.fromkeys(r.gate for r in row.verdict.reasons))})" for row in own]
        print(f"{what}: {'; '.join(found)}")


def _named(row: Inspected) -> bool:
    return any(reason.gate == "belongs" for reason in row.verdict.reasons)


def main(words: Sequence[str] | None = None) -> None:
    """Print what was found of some lots, each made and calibrated if it is not there yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--lots", type=int, default=3)
    parser.add_argument("--first", type=int, default=1, help="seed of the first lot")
    parser.add_argument("--lot", type=int, default=2, help="specimens of a lot that are calibrated")
    parser.add_argument("--new", type=int, default=50, help="newcomers of each lot")
    parser.add_argument("--exact", type=int, default=5, help="newcomers held against the whole calibration")
    parser.add_argument("--chains", action="store_true", help="the whole calibration by chains, not by its first answer")
    parser.add_argument("--probability", type=float, default=0.95, help="of conforming that is asked for")
    parser.add_argument("--odd", action="store_true", help="one newcomer in ten is of other making, or pressed in another way")
    parser.add_argument("--surrogate", action="store_true", help="truth by the surrogate, not by finite elements")
    parser.add_argument("--steps", type=int, default=6000, help="most steps of a calibration")
    parser.add_argument("--processes", type=int, default=2, help="0 for none beside this one")
    parser.add_argument("--folder", type=Path, default=Path("batches"), help="for labs and calibrations, which are kept")
    given = parser.parse_args(words)
    given.folder.mkdir(parents=True, exist_ok=True)
    report([batch_of(given.folder, seed, given) for seed in range(given.first, given.first + given.lots)], given)


if __name__ == "__main__":
    main()

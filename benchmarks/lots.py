"""Calibrate simulated lots under partial pooling: `python benchmarks/lots.py -n 2 3 5 --labs 60 -o lots.jsonl`.

A lab is drawn from what its experiment believes: modulus, permittivity and thicknesses of the lot, their spreads, those of the
specimens, what a microscope reads of these, rig, noise and discrepancies; its curves by the surrogate. One more specimen of the
lot is drawn that no calibration sees. Every second lot has specimens that were meant to have different padding.
Printed for each size of a lot and each quantity: in how many labs the truth lies within the central 90 % - of the lot's value,
its spread, those of the specimens, and that of the next one; and how often a sound lab is amber or red by the gate "specimens",
by how far specimens lie off the others. With --same the specimens of a lab are one sensor's worth of silicone, calibrated under
complete pooling, and --off makes the last of them so many times as stiff: printed is how well specimens are predicted by the
others. Posteriors are the weighted draws of a first answer where their
weights can be trusted (k-hat below 0.7, 100 effective draws); the others are left out and counted, or
sampled with --sample.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtri
from simulated.labs import keep_row, kept_rows
from specimens import with_discrepancy

from calib.catalogue import spread_of
from calib.checks.left_out_specimens import foretold
from calib.checks.reasons import RATES
from calib.checks.strangers import strangers_of
from calib.errors import InputError
from calib.experiment import Experiment, Specimen, forward_of_experiment, read_experiment
from calib.priors import HalfNormal, LogNormal, Normal, Prior, default_prior
from calib.problem import Problem, as_next_specimen, build_problem, values_at, values_of_lot
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.sampling import K_HAT, Gate, first_answer, look_at, sample
from models.response import Forward
from models.sensor import FloatArray, design_from

EXPERIMENT = Path(__file__).parents[1] / "datasets" / "padded_sensor" / "experiment.toml"
#: How deep the ball is pressed [m], and points of each channel.
DEPTH, POINTS = 0.55e-3, 25
#: Effective draws from which a first answer is taken for the posterior, and what chains have to reach; most steps of them.
WORTH, GATE, MOST_STEPS = 100.0, Gate(r_hat=1.02, ess=200.0), 4000
# Of lots of up to so many specimens, of so many labs of each size, it is looked at how far these lie off the others, which
# takes longer than all else.
_ALARMS, _ALARMED = 3, 45
# What is believed of the lot and the rig: of thicknesses, about what was wanted. The spreads have their defaults.
_LOT: Mapping[str, LogNormal | Normal] = {
    "young_modulus": LogNormal(0.7e6, 1.3),
    "relative_permittivity": Normal(2.8, 0.15),
    "sensor_thickness": Normal(0.74e-3, 0.06e-3),
    "padding_thickness": Normal(1.1e-3, 0.1e-3),
    "dielectric_thickness": Normal(0.16e-3, 0.016e-3),
}
_BESIDE: Mapping[str, Prior] = {"machine_compliance": HalfNormal(5e-6), "parasitic_capacitance": Normal(0.0, 1e-12)}
# Standard deviation [m] of what a microscope reads of a thickness.
_READ = {"sensor_thickness": 0.02e-3, "padding_thickness": 0.03e-3, "dielectric_thickness": 0.006e-3}
# Padding that was wanted over that of the first, in every second lot.
_WANTED = (1.0, 2.0, 1.0, 2.0, 1.5)
_RIG = ("machine_compliance", "parasitic_capacitance", "force_noise", "capacitance_noise")


def lab(n: int, seed: int, same: bool = False, off: float = 1.0) -> tuple[Problem, dict[str, float]]:
    """The calibration of a simulated lot of n specimens, and the true values [SI] of its unknowns and of the next one."""
    plain = read_experiment(EXPERIMENT)
    forward = forward_of_experiment(plain)
    for attempt in range(50):
        try:
            return _drawn(plain, forward, np.random.default_rng([n, seed, attempt]), n, bool(seed % 2), same, off)
        except (InputError, ValueError):  # a sensor that cannot be, or that the surrogate does not cover: no lab has it
            continue
    raise ValueError("no lab could be drawn")


def _drawn(
    plain: Experiment, forward: Forward, rng: np.random.Generator, n: int, various: bool, same: bool, off: float
) -> tuple[Problem, dict[str, float]]:
    def of(prior: Prior) -> float:
        return float(prior.ppf_normal(rng.standard_normal()))

    spreads = {spread_of(quantity): default_prior(spread_of(quantity)) for quantity in _LOT}
    truth = {name: of(prior) for name, prior in {**_LOT, **spreads, **_BESIDE}.items()}
    if same:
        truth |= dict.fromkeys(spreads, 0.0)
    truth |= {"force_noise": 5e-3, "capacitance_noise": 1e-14}
    truth |= {f"{channel}_discrepancy": of(default_prior(f"{channel}_discrepancy")) for channel in ("force", "capacitance")}

    def cast(wanted: float) -> dict[str, float]:
        """One specimen of the lot, of so many times the padding of the first."""
        found = {}
        for quantity, prior in _LOT.items():
            away = truth[spread_of(quantity)] * rng.standard_normal()
            value = truth[quantity]
            found[quantity] = value * math.exp(away) if isinstance(prior, LogNormal) else value + prior.mean * away
        return {**found, "padding_thickness": wanted * found["padding_thickness"]}

    specimens, sweeps = [], []
    for k in range(n):
        name, wanted = f"sensor {k}", _WANTED[k] if various else 1.0
        own = cast(wanted)
        own["young_modulus"] *= off if k == n - 1 else 1.0
        zeros = {
            "contact_offset": 0.2e-3,
            "load_zero": 0.3 * rng.standard_normal(),
            "clock_offset": 2.0 * rng.standard_normal(),
        }
        truth |= {f"{quantity}[{name}]": value for quantity, value in (own | zeros).items()}
        read: dict[str, Prior] = {q: Normal(own[q] + sd * rng.standard_normal(), sd) for q, sd in _READ.items()}
        nominal = {"padding_thickness": 1.1e-3 * wanted} if various and not same else {}
        specimens.append(Specimen(name, plain.specimens[0].sweeps, read, nominal))
        design = design_from({**own, "indenter_radius": 5e-3, "sensor_radius": plain.sensor_radius})
        rig = Rig(**zeros, **{of_rig: truth[of_rig] for of_rig in _RIG})
        sweeps.append(synthetic_sweep(forward, design, DEPTH, rig, rng, specimen=name, n_points=POINTS))
    of_all = {q: prior for q, prior in _LOT.items() if not (same and q in _READ)}
    priors = {**plain.priors, **of_all, **_BESIDE}
    whole = replace(plain, pooling="complete" if same else "partial", specimens=tuple(specimens), priors=priors)
    problem = build_problem(whole, sweeps, forward)
    truth |= {f"next {quantity}": value for quantity, value in cast(1.0).items()}
    return build_problem(whole, with_discrepancy(problem, truth, rng), forward), truth


def answer(n: int, seed: int, sampled: bool) -> dict[str, Any]:
    """One lab: where truth lies in its posterior, as the share of draws below; nothing where there is none."""
    problem, truth = lab(n, seed)
    built = time.process_time()
    row: dict[str, Any] = {"specimens": n, "seed": seed, "by": "none", "effective": 0.0, "k_hat": math.inf}
    values: Mapping[str, FloatArray] = {}
    weight: FloatArray = np.empty(0)
    try:
        look = look_at(problem)
        weight, row["k_hat"] = look.smoothed
        row["effective"] = round(look.effective_draws, 1)
        if look.confirmed and look.effective_draws > WORTH and row["k_hat"] < K_HAT:
            row["by"] = "first answer"
            values = {
                **values_at(problem, look.theta),
                **values_of_lot(problem, look.theta, np.random.default_rng([n, seed, 1])),
            }
    except ValueError:  # there is none
        pass
    if not values and sampled:
        posterior = sample(problem, seed=seed, processes=0, gate=GATE, max_steps=MOST_STEPS)
        row["by"] = "chains" if posterior.diagnostics.converged else "not converged"
        draws = posterior.draws.reshape(-1, posterior.draws.shape[-1])
        values = {p.name: draws[:, k] for k, p in enumerate(posterior.parameters)}
        weight = np.full(len(draws), 1 / len(draws))
    row["processor"] = round(time.process_time() - built, 2)
    if values:
        following = as_next_specimen(values, problem.table.lots, np.random.default_rng([n, seed, 2]))
        places = {**values, **{f"next {q}": following[f"{q}[sensor 0]"] for q in _LOT}}
        row["ranks"] = {q: round(float(weight @ (v < truth[q]) / np.sum(weight)), 4) for q, v in places.items() if q in truth}
        if n > _ALARMS or seed >= _ALARMED:
            return row
        near = {name: float(weight @ v / np.sum(weight)) for name, v in values.items()}
        held = [s for lot in problem.table.lots for s in strangers_of(problem, near, lot.quantity)]
        row["strangers"] = {f"{s.quantity}[{s.specimen}]": round(s.z, 3) for s in held}
        told = [f for k in range(n) for f in foretold(problem, near, f"sensor {k}")]
        row["foretold"] = {f"{f.channel}[{f.specimen}]": round(f.z, 3) for f in told}
    return row


def predicted(n: int, seed: int, off: float) -> dict[str, Any]:
    """One lab of one silicone, whose last specimen is so many times as stiff: how far specimens lie off what others predict."""
    problem, _ = lab(n, seed, same=True, off=off)
    began = time.process_time()
    row: dict[str, Any] = {"specimens": n, "seed": seed, "off": off, "foretold": {}}
    try:
        near = {name: estimate.mean for name, estimate in first_answer(problem).parameters.items()}
    except ValueError:
        return row
    told = [f for k in range(n) for f in foretold(problem, near, f"sensor {k}")]
    row["foretold"] = {f"{f.channel}[{f.specimen}]": round(f.z, 3) for f in told}
    return {**row, "processor": round(time.process_time() - began, 2)}


def report_predicted(rows: Sequence[Mapping[str, Any]]) -> None:
    """Print how far specimens lie off what the others predict, and how often the right one is named."""
    for n, off in sorted({(row["specimens"], row["off"]) for row in rows}):
        every = [row for row in rows if (row["specimens"], row["off"]) == (n, off)]
        own = [row["foretold"] for row in every if row["foretold"]]
        z = np.array([z for told in own for z in told.values()])
        found = [told for told in own if max(map(abs, told.values())) > _limit(len(told))]
        named = sum(abs(told[f"force[sensor {n - 1}]"]) == max(map(abs, told.values())) for told in found)
        print(
            f"{n} specimens, the last {off:g} times as stiff: {len(own)} of {len(every)} labs; mean {np.mean(z):+.2f}, sd "
            f"{np.std(z):.2f}; {len(found)} amber or red, the last one's force the furthest off in {named}"
        )


def report(rows: Sequence[Mapping[str, Any]]) -> None:
    """Print how often 90 % intervals hold the truth, for each size of a lot, and how far specimens lie off the others."""
    for n in sorted({row["specimens"] for row in rows}):
        every = [row for row in rows if row["specimens"] == n]
        own = [row for row in every if "ranks" in row]
        chains = sum(row["by"] in ("chains", "not converged") for row in own)
        seconds = float(np.median([row["processor"] for row in every]))
        error = math.sqrt(0.9 * 0.1 / max(len(own), 1))
        print(
            f"\n{n} specimens: {len(own)} labs, {chains} of them sampled, {len(every) - len(own)} left out, {seconds:.1f} s of "
            f"processor time (median); 90 ± {error:.0%} expected"
        )
        print(f"{'':24s} {'lot':>6s} {'spread':>7s} {'specimens':>10s} {'next':>6s}")
        for quantity in _LOT:
            lot, spread, following = (_held(own, name) for name in (quantity, spread_of(quantity), f"next {quantity}"))
            print(f"{quantity:24s} {lot:>6.0%} {spread:>7.0%} {_held(own, f'{quantity}['):>10.0%} {following:>6.0%}")
        for kind in ("strangers", "foretold"):
            looked = [list(map(abs, row[kind].values())) for row in own if row.get(kind)]
            if looked:
                z = np.concatenate(looked)
                alarms = sum(max(off) > _limit(len(off)) for off in looked)
                print(
                    f"{kind}: rms {np.sqrt(np.mean(z**2)):.2f}, beyond 2: {np.mean(z > 2):.1%}; labs with an alarm {alarms} of "
                    f"{len(looked)}"
                )


def _held(rows: Sequence[Mapping[str, Any]], name: str) -> float:
    """Share of the truths of a quantity, or of all whose names begin so, that lie in their central 90 %."""
    ranks = ((of, rank) for row in rows for of, rank in row["ranks"].items())
    found = np.array([rank for of, rank in ranks if (of.startswith(name) if name[-1] == "[" else of == name)])
    return float(np.mean((found > 0.05) & (found < 0.95))) if found.size else math.nan


def _limit(n: int) -> float:
    """How far the furthest of n may lie off in a sound lab of a hundred."""
    return float(-ndtri(RATES["amber"] / (2 * max(n, 1))))


def main(words: Sequence[str] | None = None) -> None:
    """Print a table of all labs that are kept, those that were not there answered first."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, nargs="+", default=[2, 3, 5], help="specimens of a lot")
    parser.add_argument("--labs", type=int, default=60, help="of each size")
    parser.add_argument("--sample", action="store_true", help="sample labs whose weighted draws cannot be trusted")
    parser.add_argument("-o", "--output", type=Path, help="file for the labs, a line of JSON each")
    parser.add_argument("--same", action="store_true", help="specimens of one silicone, predicted by each other")
    parser.add_argument(
        "--off", type=float, nargs="+", default=[1.0], help="with --same, stiffness of the last over the others"
    )
    given = parser.parse_args(words)
    if given.same:
        labs = [(n, seed, off) for seed in range(given.labs) for n in given.n for off in given.off]
        rows = kept_rows(given.output)
        done = {(row["specimens"], row["seed"], row["off"]) for row in rows}
        for one in labs:
            if one not in done:
                rows.append(predicted(*one))
                keep_row(given.output, rows[-1])
        report_predicted(rows)
        return
    rows = kept_rows(given.output)
    known = {(row["specimens"], row["seed"]) for row in rows}
    for seed in range(given.labs):
        for n in given.n:
            if (n, seed) not in known:
                rows.append(answer(n, seed, given.sample))
                keep_row(given.output, rows[-1])
    report(rows)


if __name__ == "__main__":
    main()

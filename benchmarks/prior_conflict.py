"""How often sound labs are told that priors and data contradict each other, and labs that were told something wrong.

    OMP_NUM_THREADS=1 python benchmarks/prior_conflict.py --labs 70 -o conflicts.jsonl

Each lab is one of `simulated.faulty` without faults; in all kinds but "sound" priors of its experiment are moved by a few of
their standard deviations. Its posterior is drawn by importance sampling near the mode, in seconds. Printed for each kind: labs
in which a headline is a conflict by `calib.checks.sensitivity`; in which one hangs on priors and on data, called a
conflict elsewhere; in which the gate "prior" speaks; in which either does; how far z spreads; labs in which the modulus is off
the truth by more than two of its standard deviations, and how many of these either finds. With -o labs are kept, a line of JSON
each, and are not repeated.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from functools import lru_cache
from typing import Any

import numpy as np
from simulated.faulty import Lab, lab_of
from simulated.labs import print_labs

from calib.catalogue import SCALES
from calib.checks import conflict_limit
from calib.checks.sensitivity import HEADLINES, is_belief, pull_limit, sensitivities
from calib.experiment import Experiment, forward_of_experiment
from calib.priors import Prior, TruncatedNormal
from calib.problem import build_problem, columns_at
from calib.sampling import look_at
from calib.sampling.laplace import importance_weights, laplace_density
from models.threads import one_thread

# Labs whose posterior is drawn worse than this are left out: they need a sampler.
_FEW = 100.0
#: What is told wrongly, by name: the quantity, by how many standard deviations of its prior, and in how many specimens.
KINDS: Mapping[str, tuple[str, float, int]] = {
    "sound": ("", 0.0, 0),
    "padding, 3 sd, one specimen": ("padding_thickness", 3.0, 1),
    "padding, 3 sd, both": ("padding_thickness", 3.0, 2),
    "padding, 5 sd, one specimen": ("padding_thickness", 5.0, 1),
    "sensor thickness, 3 sd, both": ("sensor_thickness", 3.0, 2),
    "dielectric, 5 sd, one specimen": ("dielectric_thickness", 5.0, 1),
}


def with_priors_moved(experiment: Experiment, kind: str) -> Experiment:
    """The experiment of a lab of a kind, its normal priors moved."""
    name, off, count = KINDS[kind]

    def moved(prior: Prior) -> Prior:
        return replace(prior, mean=prior.mean + off * prior.sd) if isinstance(prior, TruncatedNormal) else prior

    specimens = [
        replace(s, priors={key: moved(p) if key == name and k < count else p for key, p in s.priors.items()})
        for k, s in enumerate(experiment.specimens)
    ]
    return replace(experiment, specimens=tuple(specimens))


@lru_cache(maxsize=1)
def _sound_lab(seed: int) -> Lab:
    return lab_of("sound", seed)


def judged(kind: str, seed: int, draws: int) -> dict[str, Any]:
    """Simulate one lab and see what its priors do to its headlines."""
    with one_thread():
        began = time.process_time()
        lab = _sound_lab(seed)
        experiment = with_priors_moved(lab.experiment, kind)
        problem = build_problem(experiment, lab.sweeps, forward_of_experiment(experiment))
        random = np.random.RandomState(seed)
        look = look_at(problem)
        density = laplace_density(look.space, look.mode, random)
        x = density.draw(random, 2 * draws)
        weight = importance_weights(look.space.log_density(x) - density.log_density(x))
        effective = 1 / float(np.sum(weight**2))
        if effective < _FEW:
            return {"kind": kind, "seed": seed, "effective": effective}
        x = x[random.choice(len(x), draws, p=weight)]
        theta, log_jacobian = look.space.to_theta(x)
        log_likelihood = look.space.log_density(x) - log_jacobian + 0.5 * np.sum(theta**2, axis=1)
    values = columns_at(problem, theta)
    ess = min(draws / 2, effective)
    headlines = {p.name: values[:, k] for k, p in enumerate(problem.parameters) if p.parameter in HEADLINES}
    beliefs = [k for k, p in enumerate(problem.parameters) if is_belief(p)]
    names = [problem.names[k] for k in beliefs]
    limit = pull_limit(len(experiment.specimens))
    found = sensitivities(headlines, names, theta[:, beliefs], log_likelihood, dict.fromkeys(headlines, ess), limit)
    shifts = [abs(float(np.mean(theta[:, k]))) for k, p in enumerate(problem.parameters) if p.parameter not in SCALES]
    modulus = headlines["young_modulus"]
    truth = float(np.asarray(lab.designs[0].sensor.young_modulus))
    return {
        "kind": kind,
        "seed": seed,
        "found": {name: {**asdict(s), "diagnosis": s.diagnosis} for name, s in found.items()},
        "prior": max(shifts) > conflict_limit(len(theta[0])),
        "modulus": float((np.mean(modulus) - truth) / np.std(modulus)),
        "effective": effective,
        "processor": round(time.process_time() - began, 1),
    }


def table(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Lines of a table in Markdown, one for each kind."""
    yield "| told wrongly | labs | conflict | hang on both | gate prior | either | spread of z | modulus 2 sd off | of these |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for kind in dict.fromkeys(row["kind"] for row in rows):
        own = [row for row in rows if row["kind"] == kind and row["effective"] >= _FEW]
        if not own:
            continue
        conflict = [_any(row, "conflict") for row in own]
        both = [c or _any(row, "both") for c, row in zip(conflict, own, strict=True)]
        prior = [row["prior"] for row in own]
        either = np.logical_or(conflict, prior)
        spread = np.sqrt(np.mean([s["z"] ** 2 for row in own for s in row["found"].values()]))
        off = np.array([abs(row["modulus"]) > 2 for row in own])
        counts = (len(own), sum(conflict), sum(both), sum(prior), int(np.sum(either)))
        yield f"| {kind} | {' | '.join(map(str, counts))} | {spread:.2f} | {np.sum(off)} | {np.sum(either & off)} |"


def _any(row: Mapping[str, Any], diagnosis: str) -> bool:
    return any(s["diagnosis"] == diagnosis for s in row["found"].values())


def main(words: Sequence[str] | None = None) -> None:
    """Judge the labs that are asked for and print the table of all."""
    print_labs(words, __doc__, KINDS, judged, table, labs=40, limit=("--draws", 4000, "of each posterior"))


if __name__ == "__main__":
    main()

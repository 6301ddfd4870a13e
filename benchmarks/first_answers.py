"""Hold weighted draws of first answers against chains: `python benchmarks/first_answers.py KIND... --labs 6 -o FILE`.

Draws that miss a part of the posterior have the best of weights, so that neither k-hat nor how many are effective tells. Each
lab is one specimen as those of the shipped experiment, pressed on the surrogate that it is calibrated with, of a model that
`planted.py` has, or of Gent's law, or with quiet readings. Printed for each kind, of labs whose weights are trusted and chains
converged: how large the standard deviation by weights is beside that of chains, in the mean of labs and the smallest, and how
far means lie apart, for the unknown with which it is worst and for all. With -o labs are kept, a line of JSON each.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from planted import KINDS as PLANTED
from planted import Kind, calibrated_as, planted_lab
from simulated.faulty import DEPTH, EXPERIMENT, POINTS
from simulated.labs import print_labs

from calib.experiment import forward_of_experiment, read_experiment
from calib.problem import build_problem, columns_at
from calib.problem.synthetic import synthetic_sweep
from calib.sampling import K_HAT, Gate, look_at, sample
from models.threads import one_thread

#: Noise [N] of a reading of quiet labs, and what chains have to reach.
QUIET, GATE = 1e-3, Gate(r_hat=1.01, ess=2000.0)
#: Kinds of labs, by name.
KINDS: Mapping[str, Kind] = {
    **{name: PLANTED[name] for name in ("nothing", "padding 0.7", "foam 0.3", "slippery", "friction 0.15")},
    "quiet": PLANTED["nothing"],
    "Gent's law": Kind(told={"law": "gent"}),
}


def calibrate(name: str, seed: int, max_steps: int) -> dict[str, Any]:
    """Simulate one lab and calibrate it both ways."""
    with one_thread():
        return _calibrate(name, seed, max_steps)


def _calibrate(name: str, seed: int, max_steps: int) -> dict[str, Any]:
    kind, began = KINDS[name], time.process_time()
    experiment = calibrated_as(read_experiment(EXPERIMENT), kind)
    rng = np.random.default_rng([seed, 20190311])
    _, design, rig = planted_lab(experiment, kind, rng)
    rig = replace(rig, force_noise=QUIET) if name == "quiet" else rig
    forward = forward_of_experiment(experiment)
    specimen = experiment.specimens[0].name
    sweep = synthetic_sweep(forward, design, DEPTH, rig, rng, specimen=specimen, n_points=POINTS)
    problem = build_problem(experiment, [sweep], forward)
    row: dict[str, Any] = {"kind": name, "seed": seed}
    look = look_at(problem)
    weight, k_hat = look.smoothed
    by_weights = columns_at(problem, look.theta)
    mean = weight @ by_weights
    sd = np.sqrt(weight @ (by_weights - mean) ** 2)
    row |= {"k_hat": round(k_hat, 2), "effective": round(look.effective_draws), "confirmed": look.confirmed}
    posterior = sample(problem, seed=seed, processes=0, gate=GATE, max_steps=max_steps)
    chains = posterior.draws.reshape(-1, len(problem.names))
    own = np.std(chains, axis=0)
    row |= {"converged": posterior.diagnostics.converged, "names": list(problem.names)}
    row |= {"sd": (sd / own).tolist(), "off": ((mean - np.mean(chains, axis=0)) / own).tolist()}
    return {**row, "processor": round(time.process_time() - began, 1)}


def table(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Lines of a table in Markdown, one for each kind."""
    yield "| kind | labs | trusted | narrowest: mean of labs | one lab | all unknowns | means apart, rms [sd] | farthest |"
    yield "|---|---|---|---|---|---|---|---|"
    for name in dict.fromkeys(row["kind"] for row in rows):
        own = [row for row in rows if row["kind"] == name]
        good = [row for row in own if row["confirmed"] and row["k_hat"] <= K_HAT and row["converged"]]
        if not good:
            yield f"| {name} | {len(own)} | 0 | | | | | |"
            continue
        sd, off = (np.array([row[key] for row in good]) for key in ("sd", "off"))
        names = [unknown.split("[")[0] for unknown in good[0]["names"]]
        narrowest, lab = int(np.argmin(np.mean(sd, axis=0))), np.unravel_index(np.argmin(sd), sd.shape)
        far = np.unravel_index(np.argmax(np.abs(off)), off.shape)
        cells = [
            f"{np.mean(sd[:, narrowest]):.2f} ({names[narrowest]})",
            f"{sd[lab]:.2f} ({names[int(lab[1])]})",
            f"{np.mean(sd):.2f}",
            f"{np.sqrt(np.mean(off**2)):.2f}",
            f"{abs(off[far]):.2f} ({names[int(far[1])]})",
        ]
        yield f"| {name} | {len(own)} | {len(good)} | {' | '.join(cells)} |"


def main(words: Sequence[str] | None = None) -> None:
    """Calibrate the labs that are asked for both ways and print the table of all."""
    print_labs(words, __doc__, KINDS, calibrate, table, labs=6, limit=("--steps", 6000, "of each walker, at most"))


if __name__ == "__main__":
    main()

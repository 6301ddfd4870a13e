"""Plant what outweighs the noise, and see whether calibrations cover it: `python benchmarks/planted.py KIND... --labs 60 -o F`.

A lab is one specimen as the shipped experiment has them, its unknowns drawn from their priors, its curves by the finite
elements, with the noise and the faults of its instruments; with --as-believed press and built sensor are off every model, too,
by a discrepancy of a width drawn from its prior, as the likelihood takes for granted. What is planted is a kind: padding that
is softer or harder than the sensor, or a foam, a ball that rubs, a slippery base, one that rubs. It is calibrated with the
model that knows of it, or (`as one silicone`) with one that does not. Printed for each kind: how often truth lies in the 90 %
interval of Young's modulus and of the signal at 10 N (on a foam 3 N) on the padding that is recommended, and how far the
modulus is off. Posteriors are the weighted draws of a first answer where these can be trusted (k-hat below 0.7, 200 effective
draws), else, or with --chains always, chains: how many, and how many of these converged, is printed, too. With -o labs are
kept, a line of JSON each, and those that are there are not repeated.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from simulated.answered import calibrated
from simulated.discrepant import curve_off, drawn_widths
from simulated.faulty import ACCURACY, DEPTH, EXPERIMENT, POINTS, curve_of
from simulated.labs import lab_parser, parsed, rows_of
from simulated.usual import usual_lab

from calib.decision import Requirement, recommend
from calib.errors import InputError
from calib.experiment import Experiment, forward_of_experiment, read_experiment
from calib.priors import parse_prior
from calib.problem import build_problem
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.sampling import Posterior
from models.fem import FiniteElements
from models.response import ConvergenceError, Forward, OutOfRangeError
from models.sensor import INCOMPRESSIBLE, Base, Design, FloatArray, design_from
from models.threads import one_thread

#: Force [N] at which the signal counts, on a foam, which a ball presses flat sooner, and the paddings [m] to choose from.
FORCE, FORCE_ON_FOAM, PADDINGS = 10.0, 3.0, (0.5e-3, 6e-3)
_ANY_FRICTION = {"uniform": [0, 0.6]}


@dataclass(frozen=True)
class Kind:
    """What is planted in a lab, and what its calibration is told.

    Attributes
    ----------
    ratio : of the padding's modulus to the sensor's.
    friction : of the ball.
    slippery, base_friction : whether the padding slides on its base, and the friction there.
    poisson_ratio : of the padding.
    told : attributes of the experiment that are changed, and priors that are added, under "priors".
    """

    ratio: float = 1.0
    friction: float = 0.0
    slippery: bool = False
    base_friction: float = 0.0
    poisson_ratio: float = INCOMPRESSIBLE
    told: Mapping[str, Any] = field(default_factory=dict)


_OWN: Mapping[str, Any] = {"padding_material": "own", "priors": {"padding_young_modulus": {"lognormal": ["0.7 MPa", 1.6]}}}
_FOAM: Mapping[str, Any] = {
    "padding_material": "foam",
    "priors": {"padding_young_modulus": {"lognormal": ["0.35 MPa", 1.6]}, "padding_poisson_ratio": {"uniform": [0, 0.5]}},
}
_RUBS: Mapping[str, Any] = {"priors": {"friction_coefficient": _ANY_FRICTION}}
_BASE_RUBS: Mapping[str, Any] = {"base": "slippery", "priors": {"base_friction_coefficient": {"uniform": [0, 1]}}}
#: What can be planted, by name.
KINDS: Mapping[str, Kind] = {
    "nothing": Kind(),
    "padding 0.7": Kind(ratio=0.7, told=_OWN),
    "padding 1.3": Kind(ratio=1.3, told=_OWN),
    "padding 0.8, as one silicone": Kind(ratio=0.8),
    **{f"foam {nu:g}": Kind(ratio=0.5, poisson_ratio=nu, told=_FOAM) for nu in (0.1, 0.3, 0.45)},
    "foam 0.3, as incompressible": Kind(ratio=0.5, poisson_ratio=0.3, told=_OWN),
    "slippery": Kind(slippery=True, told={"base": "slippery"}),
    "slippery, as bonded": Kind(slippery=True),
    "friction 0.3, as none": Kind(friction=0.3),
    **{f"friction {f:g}": Kind(friction=f, told=_RUBS) for f in (0.0, 0.15, 0.3, 0.6)},
    "slippery, friction 0.3": Kind(friction=0.3, slippery=True, told={"base": "slippery", **_RUBS}),
    "slippery, friction 0.3, as none": Kind(friction=0.3, slippery=True, told={"base": "slippery"}),
    **{f"base rubs {f:g}": Kind(slippery=True, base_friction=f, told=_BASE_RUBS) for f in (0.2, 0.5, 0.8)},
    "base rubs 0.2, as slippery": Kind(slippery=True, base_friction=0.2, told={"base": "slippery"}),
}


def calibrated_as(experiment: Experiment, kind: Kind) -> Experiment:
    """The experiment of one specimen that a lab of this kind calibrates."""
    changes = dict(kind.told)
    more = {name: parse_prior(name, value) for name, value in changes.pop("priors", {}).items()}
    whole = replace(experiment, specimens=experiment.specimens[:1], **changes)
    return replace(whole, priors={**whole.priors, **more})


def planted_lab(experiment: Experiment, kind: Kind, rng: np.random.Generator) -> tuple[dict[str, float], Design, Rig]:
    """Draw a lab of a kind: the values of its sensor, SI by name, that sensor, and the rig that it is pressed on."""
    truth, rig = usual_lab(experiment, rng, 1.6)
    truth["padding_young_modulus"] = kind.ratio * truth["young_modulus"]
    truth["padding_poisson_ratio"] = kind.poisson_ratio
    truth["base_friction_coefficient"] = kind.base_friction
    base: Base = "slippery" if kind.slippery else "bonded"
    return truth, design_from(truth, friction_coefficient=kind.friction, base=base), rig


def calibrate(name: str, seed: int, max_steps: int, *, believed: bool = False, chains: bool = False) -> dict[str, Any]:
    """Simulate and calibrate one lab; where truth lies."""
    with one_thread():
        return _calibrate(name, seed, max_steps, believed, chains)


def _calibrate(name: str, seed: int, max_steps: int, believed: bool, chains: bool) -> dict[str, Any]:
    kind, began = KINDS[name], time.process_time()
    experiment = calibrated_as(read_experiment(EXPERIMENT), kind)
    rng = np.random.default_rng([seed, 20190304])
    truth, design, rig = planted_lab(experiment, kind, rng)
    specimen = experiment.specimens[0].name
    width = drawn_widths(np.random.default_rng([seed, 20190311]), believed)
    curve = curve_off(curve_of(design, 1.01 * DEPTH), width, np.random.default_rng([seed, 20190312]))
    gap = np.random.default_rng([seed, 20190313]).standard_normal(2) * [width["force"], width["capacitance"]]
    sweep = synthetic_sweep(curve, design, DEPTH, rig, rng, specimen=specimen, n_points=POINTS)
    forward = forward_of_experiment(experiment)
    problem = build_problem(experiment, [sweep], forward)
    by, posterior = calibrated(problem, seed, max_steps, chains=chains)
    found = posterior.draws.reshape(-1, len(problem.names))
    modulus = found[:, problem.names.index("young_modulus")]
    force = FORCE_ON_FOAM if kind.poisson_ratio < INCOMPRESSIBLE else FORCE
    asked = Requirement(force, *PADDINGS, n_thickness=23)
    said = _recommended(posterior, forward, asked, design, gap, seed)
    return {
        "kind": name,
        "seed": seed,
        "believed": believed,
        **by,
        "truth": truth["young_modulus"],
        "mean": float(np.mean(modulus)),
        "sd": float(np.std(modulus)),
        "rank": float(np.mean(modulus < truth["young_modulus"])),
        **said,
        "processor": round(time.process_time() - began, 1),
    }


def _recommended(
    posterior: Posterior, forward: Forward, asked: Requirement, design: Design, gap: FloatArray, seed: int
) -> dict[str, Any]:
    """The padding that is recommended, the signal there and what was said of it; none where no padding carries the load.

    `gap` (2,) is by which share force at a depth, and change, of what is built are off the model.
    """
    nothing: dict[str, Any] = dict.fromkeys(("padding", "signal", "band", "signal inside"))
    try:
        best = recommend(posterior, forward, asked, seed=seed)
    except InputError:
        return nothing
    built = replace(design, padding=replace(design.padding, thickness=best.best))
    low, high = float(best.change_at_best[0]), float(best.change_at_best[-1])
    try:
        signal = float(FiniteElements(ACCURACY).respond_to_force(built, np.array([asked.force / (1 + gap[0])])).capacitance[0])
    except (OutOfRangeError, ConvergenceError):
        return {**nothing, "padding": best.best, "band": [low, high]}
    change = (1 + float(gap[1])) * (signal / float(np.asarray(built.rest_capacitance)) - 1)
    return {"padding": best.best, "signal": change, "band": [low, high], "signal inside": low <= change <= high}


def table(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Lines of a table in Markdown, one for each kind."""
    yield "| planted | labs | by chains | converged | modulus in 90 % | off, rms | off in sd, rms | signal in 90 % |"
    yield "|---|---|---|---|---|---|---|---|"
    for name in dict.fromkeys(row["kind"] for row in rows):
        own = [row for row in rows if row["kind"] == name]
        inside = np.mean([0.05 < row["rank"] < 0.95 for row in own])
        off = np.array([row["mean"] / row["truth"] - 1 for row in own])
        sds = np.array([(row["mean"] - row["truth"]) / row["sd"] for row in own])
        signals = [row["signal inside"] for row in own if row["signal inside"] is not None]
        chains = [row["converged"] for row in own if row["by"] == "chains"]
        rms = [f"{np.sqrt(np.mean(off**2)):.1%}", f"{np.sqrt(np.mean(sds**2)):.1f}"]
        signal = f"{np.mean(signals):.0%} of {len(signals)}" if signals else "-"
        yield f"| {name} | {len(own)} | {len(chains)} | {sum(chains)} | {inside:.0%} | {rms[0]} | {rms[1]} | {signal} |"


def main(words: Sequence[str] | None = None) -> None:
    """Calibrate the labs that are asked for and print the table of all."""
    parser = lab_parser(__doc__, KINDS, 60)
    parser.add_argument("--steps", metavar="N", type=int, default=3000, help="of each walker of chains, at most")
    parser.add_argument("--as-believed", action="store_true", help="with discrepancies; keep these labs in a file of their own")
    parser.add_argument("--chains", action="store_true", help="calibrate every lab by chains, to hold the others against")
    given = parsed(parser, words, KINDS)
    one = partial(calibrate, believed=given.as_believed, chains=given.chains)
    rows = rows_of(one, given.kinds, given.labs, given.steps, given.processes, given.output)
    order = list(KINDS)
    print("\n".join(table(sorted(rows, key=lambda row: order.index(row["kind"])))))


if __name__ == "__main__":
    main()

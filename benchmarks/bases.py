"""Whether data tell a bonded base from a slippery one: `python benchmarks/bases.py --labs 100 -o FILE`.

A lab is one specimen as the shipped experiment has them, bonded to its base or slipping on it, its unknowns drawn from their
priors (the modulus by a factor of 1.6), one press of it with curves by the finite elements, with noise and faults of its
instruments. What it knows is one of four things: thicknesses by the microscope, as the shipped experiment does; thicknesses
within 15 %; these and no capacitance; or these and no capacitance from a press of half the depth. Both bases are held against
the data by their evidences, as `calib compare` does. The true base is named rightly if the other is ruled out
(Bayes factor below e^-5), wrongly if it is ruled out itself, and else left open.

Where it is open, one more press is made, each by itself, and both are asked again: with a ball of half the radius, once more
half as deep again, or of a second specimen on three times the padding. Printed is how many of the open ones each would tell.
With -o labs are kept, a line of JSON each, and not repeated.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from simulated.faulty import DEPTH, EXPERIMENT, POINTS, curve_of
from simulated.labs import lab_parser, parsed, rows_of
from simulated.usual import usual_lab

from calib.checks import standings
from calib.checks.reasons import RULED_OUT
from calib.errors import InputError
from calib.experiment import AS_GIVEN, Experiment, Specimen, forward_of_experiment, read_experiment, variants_of
from calib.lab import Sweep
from calib.priors import Prior, TruncatedNormal
from calib.problem import build_problem
from calib.problem.synthetic import Rig, synthetic_sweep
from models.response import ConvergenceError, OutOfRangeError
from models.sensor import Base, design_from
from models.threads import one_thread

#: What is planted.
KINDS: tuple[Base, ...] = ("bonded", "slippery")
#: What a lab knows.
MEASURED, GUESSED, ALONE = "thicknesses measured", "thicknesses within 15 %", "within 15 %, force alone"
SHALLOW = f"{ALONE}, half as deep"
KNOWN = (MEASURED, GUESSED, ALONE, SHALLOW)
_GUESS = 0.15
#: What one more press is of.
MORE = ("ball of half the radius", "half as deep again", "three times the padding")
_SECOND = "second"


@dataclass(frozen=True)
class Pressed:
    """A lab of which a base is asked.

    Attributes
    ----------
    base : the true one.
    truth : values of the specimen, SI by name.
    rig : tester and meter.
    rng : of what comes next.
    """

    base: Base
    truth: Mapping[str, float]
    rig: Rig
    rng: np.random.Generator

    def press(self, depth: float = DEPTH, *, name: str = "", specimen: str = "sensor 1", **others: float) -> Sweep:
        """Press it, or one of which some values are others."""
        design = design_from({**self.truth, **others}, base=self.base)
        curve = curve_of(design, 1.01 * depth)
        return synthetic_sweep(curve, design, depth, self.rig, self.rng, specimen=specimen, name=name, n_points=POINTS)

    def more(self, what: str) -> Sweep:
        """Make one more press."""
        if what == MORE[0]:
            return self.press(name=_SECOND, indenter_radius=self.truth["indenter_radius"] / 2)
        if what == MORE[1]:
            return self.press(1.5 * DEPTH, name=_SECOND)
        return self.press(specimen=_SECOND, padding_thickness=3 * self.truth["padding_thickness"])


def lab_row(base: Base, seed: int, _: int) -> dict[str, Any]:
    """Simulate one lab and ask both bases, with one more press where that leaves it open."""
    with one_thread():
        began = time.process_time()
        experiment = read_experiment(EXPERIMENT)
        rng = np.random.default_rng([seed, 20190304])
        lab = Pressed(base, *usual_lab(experiment, rng, 1.6), rng)
        firsts = dict.fromkeys(KNOWN, lab.press()) | {SHALLOW: lab.press(DEPTH / 2)}
        odds = {known: _odds(experiment, known, base, [first]) for known, first in firsts.items()}
        unsure = [known for known in KNOWN if _named(odds[known]) == "open"]
        more: dict[str, dict[str, float]] = {}
        for what in MORE if unsure else ():
            try:
                second = lab.more(what)
            except (OutOfRangeError, ConvergenceError):
                continue
            more[what] = {known: _odds(experiment, known, base, [firsts[known], second]) for known in unsure}
        return {"kind": base, "seed": seed, "odds": odds, "more": more, "processor": round(time.process_time() - began, 1)}


def _odds(experiment: Experiment, known: str, true: Base, sweeps: Sequence[Sweep]) -> float:
    """Logarithm of how many times as probable the data are under the true base as under the other; nan if one has no answer."""
    if known in (ALONE, SHALLOW):
        sweeps = [replace(s, channels={"force": s.channels["force"]}, noise={"force": s.noise["force"]}) for s in sweeps]
    asked = _as_known(experiment, known, {s.specimen for s in sweeps})
    try:
        problem = build_problem(asked, sweeps, forward_of_experiment(asked))
    except InputError:
        return math.nan
    variants = [variant for variant in variants_of(asked) if variant.name in (AS_GIVEN, "slippery")]
    found = {standing.variant.name: standing.log_bayes for standing in standings(problem, variants)}
    slips = found["slippery"] - found[AS_GIVEN]
    return round(slips if true == "slippery" else -slips, 3)


def _as_known(experiment: Experiment, known: str, names: set[str]) -> Experiment:
    """The experiment of the specimens that were pressed, with what is known of their thicknesses."""
    first = experiment.specimens[0]

    def believed(times: float) -> dict[str, Prior]:
        found: dict[str, Prior] = {}
        for name, prior in first.priors.items():
            assert isinstance(prior, TruncatedNormal)
            mean = prior.mean * (times if name == "padding_thickness" else 1.0)
            found[name] = replace(prior, mean=mean, sd=prior.sd if known == MEASURED else _GUESS * mean)
        return found

    specimens = [replace(first, name="sensor 1", priors=believed(1.0))]
    if _SECOND in names:
        specimens.append(Specimen(_SECOND, first.sweeps, believed(3.0)))
    return replace(experiment, specimens=tuple(specimens))


def _named(odds: float) -> str:
    if math.isnan(odds):
        return "no answer"
    return "rightly" if odds > -RULED_OUT else "wrongly" if odds < RULED_OUT else "open"


def table(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Lines of a table in Markdown: how the base is named for each that is planted and each that is known; what would tell."""
    yield f"| base | known | labs | rightly | open | wrongly | no answer | {' | '.join(f'{m} tells' for m in MORE)} |"
    yield "|---|---|---|---|---|---|---|" + "---|" * len(MORE)
    for base in KINDS:
        own = [row for row in rows if row["kind"] == base]
        for known in KNOWN if own else ():
            named = [_named(row["odds"][known]) for row in own]
            cells = [str(named.count(word)) for word in ("rightly", "open", "wrongly", "no answer")]
            for what in MORE:
                then = [_named(row["more"][what][known]) for row in own if known in row["more"].get(what, {})]
                cells.append(
                    f"{then.count('rightly')} of {len(then)}" + (f", {w} wrongly" if (w := then.count("wrongly")) else "")
                )
            yield f"| {base} | {known} | {len(own)} | {' | '.join(cells)} |"


def main(words: Sequence[str] | None = None) -> None:
    """Ask the labs that are wanted and print the table of all."""
    given = parsed(lab_parser(__doc__, KINDS, 100), words, KINDS)
    rows = rows_of(lab_row, given.kinds, given.labs, 0, given.processes, given.output)
    print("\n".join(table(rows)))


if __name__ == "__main__":
    main()

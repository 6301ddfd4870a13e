"""A calibration and a bench in, the measurements that could follow out: each with the problem that it would make of it.

A press goes as far as the forward model covers it. A specimen that nobody has made has thicknesses of its own, known as well as
those of the specimen that it is like were before the data.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from calib.catalogue import display
from calib.decision.candidate import Candidate
from calib.decision.expected_press import NEXT, TOUCH, expected_sweep, force_covered, middle_with, sweep_like, with_sweep
from calib.decision.extrapolation import Aim
from calib.decision.known import Known, force_reached
from calib.decision.read_by_itself import readings_of
from calib.decision.wanted_presses import ANOTHER, WantedPress, wanted_presses
from calib.experiment import Bench, Experiment, SweepFiles
from calib.lab import AS_FOUND, FIRST_LOADING, Reading
from calib.priors import Fixed, Prior, TruncatedNormal
from calib.problem import outside_faults
from models.response import OutOfRangeError

# A press goes no further than this share of what the model covers for nearly all draws, and is not worth a change below this
# share of what the one it is like went to (of a smaller ball, of what presses it in as far for its size). Where less has to be
# tried, it is by this factor.
_SHARE, _LEAST, _STEP = 0.95, 0.4, 0.88


def candidates_of(known: Known, bench: Bench, aim: Aim | None = None) -> tuple[list[Candidate], list[str]]:
    """List the measurements that could be made next, and those of which nothing can be said, in words.

    Parameters
    ----------
    known : the calibration.
    bench : what the lab can measure.
    aim : what an advice is for, so that what would confirm it is among them: its padding, ball and load; None for none.
    """
    found: list[Candidate] = []
    unjudged: list[str] = []
    presses = (one if isinstance(one, str) else _pressed(known, bench, one) for one in wanted_presses(known, bench, aim))
    for one in (*presses, *readings_of(known, bench)):
        if isinstance(one, str):
            unjudged.append(one)
        else:
            found.append(one)
    return found, list(dict.fromkeys(unjudged))


def _pressed(known: Known, bench: Bench, wanted: WantedPress) -> Candidate | str:
    """The candidate that a press is, as far as the forward model covers it; in words why there is none."""
    experiment = _with_press(known, wanted)
    like = sweep_like(wanted)
    stub = with_sweep(known, experiment, like)
    try:
        reach = force_covered(known, stub, like)
        most = min(wanted.force, _SHARE * reach)
        before = force_reached(known, wanted.template)
        smaller = min(wanted.ball / wanted.template.indenter_radius, 1.0)
        least = ANOTHER * before if wanted.kind == "force" else min(_LEAST * before * smaller**2, wanted.force)
        if most < least:
            limit = f"covers this press up to {max(reach, 0.0):.2g} N only" if reach > 0 else "does not cover it"
            return f"{_in_words(wanted, wanted.force)}: the {known.problem.forward.name} {limit}"
        for force in _ladder(most, least):
            sweep, zeros, press = expected_sweep(known, stub, like, force)
            problem = with_sweep(known, experiment, sweep)
            # A calibration with it is refused where most of what is believed is not covered.
            faults = outside_faults(replace(problem, plans=problem.plans[-1:]))
            if not faults:
                break
        else:
            return f"{_in_words(wanted, wanted.force)}: {faults[0].message}"
    except (OutOfRangeError, ValueError) as error:
        return f"{_in_words(wanted, wanted.force)}: {error}"
    if len(problem.table.lots) > len(known.problem.table.lots):
        return f"{_in_words(wanted, force)}: it brings a quantity that is pooled, of which nothing is known yet"
    middle = middle_with(known, problem, zeros)
    words = _in_words(wanted, force)
    touch = f"zero the crosshead within {display('contact_offset', TOUCH)} of first touch"
    notes = {(wanted.specimen, NEXT): f"files of this press: {words}; {touch}"}
    if wanted.padding is not None:
        notes = {(wanted.specimen, ""): notes[wanted.specimen, NEXT]}
        own = experiment.specimens[-1].priors
        measured = [name for name in own if name != "padding_thickness" or wanted.padding > 0]
        notes |= {(wanted.specimen, name): "put in what you measure of it" for name in measured}
    alike = f"{wanted.kind} {wanted.ball:g} {wanted.padding or 0.0:g}"
    minutes = bench.time(wanted.kind)
    return Candidate(wanted.kind, words, alike, minutes, experiment, notes, problem, middle, press=press)


def _in_words(wanted: WantedPress, force: float) -> str:
    """What is wanted with its force [N]; a specimen's name may have braces of its own, and stands before it."""
    before, _, after = wanted.words.rpartition("{force:.2g}")
    return f"{before}{force:.2g}{after}"


def _ladder(force: float, least: float) -> Iterator[float]:
    """Forces [N] to try, one smaller than the other, down to the least."""
    while force >= least:
        yield force
        force *= _STEP


def _with_press(known: Known, wanted: WantedPress) -> Experiment:
    """The experiment with one more sweep, of a specimen that is there or of a new one."""
    experiment = known.problem.experiment
    own = next(s for s in experiment.specimens if s.name == wanted.template.specimen)
    before = next(f for f in own.sweeps if f.name == wanted.template.name)
    stem = f"{wanted.specimen} {NEXT}".replace(" ", "_")
    files = SweepFiles(
        NEXT,
        Path(f"{stem}_force.csv") if before.force is not None else None,
        Path(f"{stem}_capacitance.csv") if wanted.electrical else None,
        wanted.ball,
        _as_before(before.force_reading),
        _as_before(before.capacitance_reading),
        FIRST_LOADING,
    )
    if wanted.padding is None:
        more = tuple(replace(s, sweeps=(*s.sweeps, files)) if s is own else s for s in experiment.specimens)
        return replace(experiment, specimens=more)
    priors = dict(own.priors)
    nominal = dict(own.nominal)
    if "padding_thickness" in priors:
        priors["padding_thickness"] = _moved(priors["padding_thickness"], wanted.padding)
    if "padding_thickness" in nominal:
        nominal["padding_thickness"] = wanted.padding
    new = replace(own, name=wanted.specimen, sweeps=(replace(files, name=""),), priors=priors, nominal=nominal)
    return replace(experiment, specimens=(*experiment.specimens, new))


def _as_before(reading: Reading) -> Reading:
    """How a file of the same instrument is read: which record in it is left to the file."""
    return replace(reading, specimen=None, sheet="", where=AS_FOUND.where)


def _moved(prior: Prior, value: float) -> Prior:
    """A prior as wide as another, about another thickness; no padding is known."""
    if isinstance(prior, Fixed) or value == 0:
        return Fixed(value)
    low, high = prior.ppf_normal(np.array([-1.0, 1.0]))
    sd = float(high - low) / 2
    return TruncatedNormal(value, min(sd, value / 4), 0.0, math.inf)

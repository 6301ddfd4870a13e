"""A calibration and a bench in, the quantities that an instrument could read by themselves out, each as a candidate."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from calib.catalogue import QUANTITIES, UNKNOWNS, UnknownName, display
from calib.decision.candidate import Candidate
from calib.decision.known import Known
from calib.experiment import READINGS, Bench
from calib.priors import HalfNormal, Normal, Prior, TruncatedNormal
from calib.problem import columns_at

# A reading that has this share of what is known counts alone; a mean further from zero than this, in sds, is not near it.
_ALONE, _CLEAR = 0.995, 3.1
# Quantities that an experiment takes as exact where it does not say otherwise.
_RADII = ("electrode_radius", "sensor_radius", "indenter_radius")


def readings_of(known: Known, bench: Bench) -> Iterator[Candidate | str]:
    """List the quantities that a lab could read by themselves, and in words those from which nothing is to be gained.

    Parameters
    ----------
    known : the calibration.
    bench : what the lab can measure.
    """
    problem = known.problem
    sampled = {info.parameter for info in problem.parameters}
    for quantity, usual in READINGS.items():
        if quantity in bench.without:
            continue
        if quantity not in sampled:
            taken = [name for name in problem.fixed if UnknownName.parse(name).parameter == quantity]
            if taken:
                value = display(quantity, problem.fixed[taken[0]])
                yield f"{usual.how.format(of='')}: nothing to gain here, as the experiment takes {quantity} as known ({value})"
            elif quantity in _RADII:
                exact = f"the experiment takes {quantity} as exact ({UNKNOWNS[quantity].derived})"
                wanting = "what an error of it does is not in the posterior. Give it a prior to ask"
                yield f"{usual.how.format(of='')}: {exact}; {wanting}"
            continue
        for k, info in enumerate(problem.parameters):
            if info.parameter == quantity:
                yield _read(known, bench, k)


def _read(known: Known, bench: Bench, k: int) -> Candidate:
    """The candidate that reading an unknown by itself is."""
    info = known.problem.parameters[k]
    sd = bench.sd(info.parameter)
    usual = READINGS[info.parameter]
    row = QUANTITIES[info.parameter]
    off = f"{sd * row.display_scale:.3g} {row.display_unit}".rstrip()
    of = f" of {info.specimen}" if info.specimen else ""
    middle = float(columns_at(known.problem, known.middle[None])[0, k])
    experiment = known.problem.experiment
    before: Prior | None = info.prior
    if any(k in lot.columns for lot in known.problem.table.lots):  # what is read is of the specimen, the rest of its lot
        before = next(s for s in experiment.specimens if s.name == info.specimen).priors.get(info.parameter)
    prior, note = with_reading(info.parameter, before, middle, sd)
    if info.specimen:
        more = tuple(
            replace(s, priors={**s.priors, info.parameter: prior}) if s.name == info.specimen else s
            for s in experiment.specimens
        )
        experiment = replace(experiment, specimens=more)
    else:
        experiment = replace(experiment, priors={**experiment.priors, info.parameter: prior})
    what = f"{usual.how.format(of=of)} to {off} (sd)"
    notes = {(info.specimen, info.parameter): note}
    return Candidate(info.parameter, what, info.parameter, bench.time(info.parameter), experiment, notes, reads=(k, sd))


def with_reading(parameter: str, prior: Prior | None, value: float, sd: float) -> tuple[Prior, str]:
    """What is believed of a quantity once it is read by itself, and how to write that down.

    Parameters
    ----------
    parameter : the quantity.
    prior : what was believed before; None for nothing.
    value : SI, what is read.
    sd : SI, how well.

    Returns
    -------
    The product of both for a normal prior (also one that is cut off); else what is read alone. And a note for the file.
    """
    before = None
    match prior:
        case Normal(mean, own) | TruncatedNormal(mean, own, _, _):
            before = (mean, own)
        case HalfNormal(scale):
            before = (0.0, scale)
    if before is None:
        made, note = (value, sd), "put in what you read as mean; its sd takes the place of what was believed"
    else:
        share = before[1] ** 2 / (before[1] ** 2 + sd**2)
        made = ((1 - share) * before[0] + share * value, sd * math.sqrt(share))
        old = display(parameter, before[0])
        note = "put in what you read as mean"
        if share < _ALONE:
            note = (
                f"put in as mean {share:.3f} times what you read, plus {1 - share:.3f} times {old}, which was believed before"
            )
    mean, own = (float(f"{number:.4g}") for number in made)
    low, high = Normal(0.0, 1.0).support if prior is None else prior.support
    if low == 0 and mean < _CLEAR * own:  # a form that says where it is cut off
        top = mean + 8 * own
        return TruncatedNormal(mean, own, 0.0, top), note
    if math.isinf(low):
        return Normal(mean, own), note
    return TruncatedNormal(mean, own, low, high), note

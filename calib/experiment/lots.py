"""An experiment whose specimens are of one lot in, what is believed of each quantity that is pooled out.

Under partial pooling (`pooling = "partial"`) each specimen has a modulus, a permittivity and thicknesses of its own about those
of the lot. A thickness is pooled as its ratio to what was wanted (`nominal`): shrinkage, evaporated solvent and what is poured
are shares of a layer. What was measured of a specimen is known of that specimen beside. How lot and specimens go together:
`calib.problem.lots`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

from calib.catalogue import POOLED, SPREADS, UNKNOWNS, display, spread_of, unknowns_of
from calib.errors import Fault
from calib.experiment.plan import Experiment, Specimen
from calib.experiment.toml_places import KeyPath
from calib.priors import Fixed, LogNormal, Normal, Prior, TruncatedNormal, default_prior

#: Thicknesses, of which specimens of a lot may have been meant to be different.
CAST = tuple(quantity for quantity in unknowns_of("specimen") if quantity in POOLED)

# A spread above this is no share of a quantity: 5 % is 0.05.
_MOST_SPREAD = 1.0
# The lot's thickness lies within this share of what was wanted, or of what was measured (sd): wide beside both.
_CASTING = 0.2
# A normal prior that ends so many standard deviations off, where a thousandth of it would lie, is taken as one that does not.
_FAR = 3.0
# Specimens whose thicknesses differ by more than this factor were hardly meant to be alike.
_MEANT_ALIKE = 1.3


def lot_prior(experiment: Experiment, quantity: str, specimens: Sequence[str]) -> tuple[LogNormal | Normal, str]:
    """What is believed of the lot's value of a quantity, and where that comes from, in words.

    Parameters
    ----------
    experiment : of specimens of one lot.
    quantity : one of `calib.catalogue.POOLED`.
    specimens : names of those that have it.

    Raises
    ------
    TypeError
        If it is another distribution than those that `lot_faults` lets through.
    """
    given = experiment.priors.get(quantity)
    if given is not None:
        return _pooled(quantity, given), "experiment file"
    if UNKNOWNS[quantity].default:
        return _pooled(quantity, default_prior(quantity)), "default"
    known = [own for own in own_priors(experiment, quantity, specimens) if own is not None]
    by_factor = isinstance(known[0], LogNormal)
    wanted = _named(experiment, specimens[0]).nominal.get(quantity)
    if wanted is None:
        medians = [float(own.ppf_normal(0.0)) for own in known]
        wanted = math.exp(sum(map(math.log, medians)) / len(medians)) if by_factor else sum(medians) / len(medians)
        origin = f"default, about what was measured of the specimens, within {100 * _CASTING:.0f} %"
    else:
        origin = f"default, about what was wanted, within {100 * _CASTING:.0f} %"
    return LogNormal(wanted, 1 + _CASTING) if by_factor else Normal(wanted, _CASTING * wanted), origin


def spread_prior(experiment: Experiment, quantity: str) -> Prior:
    """What is believed of how far specimens differ in a quantity, as a share: what the experiment says, else the default.

    Parameters
    ----------
    experiment, quantity : see `lot_prior`.
    """
    return experiment.priors.get(spread_of(quantity)) or default_prior(spread_of(quantity))


def own_priors(experiment: Experiment, quantity: str, specimens: Sequence[str]) -> tuple[LogNormal | Normal | None, ...]:
    """What is known of each specimen by itself, such as what a microscope read of it; None for nothing.

    Parameters
    ----------
    experiment, quantity, specimens : see `lot_prior`.
    """
    found = (_named(experiment, name).priors.get(quantity) for name in specimens)
    return tuple(None if prior is None else _pooled(quantity, prior) for prior in found)


def nominal_ratios(experiment: Experiment, quantity: str, specimens: Sequence[str]) -> tuple[float, ...]:
    """What each specimen was meant to be over what the first one was, 1 where nothing else is said.

    Parameters
    ----------
    experiment, quantity, specimens : see `lot_prior`.
    """
    nominal = [_named(experiment, name).nominal.get(quantity) for name in specimens]
    first = nominal[0]
    return tuple(1.0 if own is None or first is None else own / first for own in nominal)


def _named(experiment: Experiment, name: str) -> Specimen:
    return next(specimen for specimen in experiment.specimens if specimen.name == name)


def _pooled(quantity: str, prior: Prior) -> LogNormal | Normal:
    found = _as_pooled(prior)
    if found is None:
        raise TypeError(f"the prior of {quantity} of a lot must be log-normal or normal, got {prior}")
    return found


def _as_pooled(prior: Prior) -> LogNormal | Normal | None:
    """A prior as one of the two kinds that can be pooled; normal is also one that ends where hardly any of it would lie."""
    if isinstance(prior, TruncatedNormal) and min(prior.mean - prior.low, prior.high - prior.mean) >= _FAR * prior.sd:
        return Normal(prior.mean, prior.sd)
    return prior if isinstance(prior, LogNormal | Normal) else None


# --- what cannot be -----------------------------------------------------------------------------------------------------


def lot_faults(experiment: Experiment) -> Iterator[tuple[KeyPath, Fault]]:
    """What an experiment says of a lot that cannot be: where that stands, and what is wrong with it."""
    if experiment.pooling == "complete":
        yield from _without_a_lot(experiment)
        return
    for quantity in POOLED:
        prior = experiment.priors.get(quantity)
        if prior is not None and not isinstance(prior, Fixed) and _as_pooled(prior) is None:
            like = _as_log_normal(quantity, prior)
            message = f'under pooling = "partial" the prior of {quantity}, that of the lot, must be log-normal or normal'
            yield ("priors", quantity), Fault(message, advice=f'Write {quantity} = {like}, or pooling = "complete"')
        if quantity in CAST:
            yield from _own_faults(experiment, quantity)
        yield from _spread_faults(experiment, spread_of(quantity))


def _without_a_lot(experiment: Experiment) -> Iterator[tuple[KeyPath, Fault]]:
    """What has a meaning for specimens of one lot alone."""
    advice = 'Write pooling = "partial" at the top of the file, or leave it out'
    for name in SPREADS:
        if name in experiment.priors:
            yield ("priors", name), Fault(f"{name} has no meaning for specimens that are not of one lot", advice=advice)
    for k, specimen in enumerate(experiment.specimens):
        if specimen.nominal:
            message = "nominal has no meaning for specimens that are not of one lot"
            yield ("specimens", k, "nominal"), Fault(message, advice=advice)


def _own_faults(experiment: Experiment, quantity: str) -> Iterator[tuple[KeyPath, Fault]]:
    """What is known of the thicknesses of specimens that does not go together with being of one lot."""
    of_lot = experiment.priors.get(quantity)
    own = {k: s.priors[quantity] for k, s in enumerate(experiment.specimens) if quantity in s.priors}
    own = {k: prior for k, prior in own.items() if not isinstance(prior, Fixed)}
    kinds = [type(found) for prior in (of_lot, *own.values()) if prior is not None and (found := _as_pooled(prior)) is not None]
    by_factor = kinds[:1] == [LogNormal]
    for k, prior in own.items():
        if not isinstance(_as_pooled(prior), LogNormal if by_factor else Normal):
            kind = "log-normal" if by_factor else "normal"
            message = f'under pooling = "partial" the priors of {quantity} of one lot must be of one kind, here {kind}'
            like = _as_log_normal(quantity, prior) if by_factor else _as_normal(quantity, prior)
            yield ("specimens", k, "priors", quantity), Fault(message, advice=f"Write {quantity} = {like}")
    unknown = {k: s for k, s in enumerate(experiment.specimens) if not isinstance(s.priors.get(quantity), Fixed)}
    nominal = {k: s.nominal.get(quantity) for k, s in unknown.items()}
    given = [k for k, value in nominal.items() if value is not None]
    if given and len(given) < len(nominal):
        k = next(k for k, value in nominal.items() if value is None)
        name = experiment.specimens[k].name
        message = f'nominal {quantity} of specimen "{name}" is missing, others have one'
        yield ("specimens", k), Fault(message, advice=f"Give it to all of them, as nominal = {{ {quantity} = ... }}")
    medians = sorted((float(prior.ppf_normal(0.0)), k) for k, prior in own.items())
    for (thinner, _), (thicker, k) in pairwise(medians):
        if not given and thicker > _MEANT_ALIKE * thinner:
            message = (
                f"{quantity} goes from {display(quantity, thinner)} to {display(quantity, thicker)} in specimens of one lot: "
                "were they meant to be alike?"
            )
            advice = (
                f"If not, say in each [[specimens]] what was wanted, here nominal = {{ {quantity} = "
                f'"{display(quantity, float(f"{thicker:.2g}"))}" }}'
            )
            yield ("specimens", k, "priors", quantity), Fault(message, advice=advice)
            return


def _spread_faults(experiment: Experiment, name: str) -> Iterator[tuple[KeyPath, Fault]]:
    spread = experiment.priors.get(name)
    if spread is None:
        return
    low, median = (float(spread.ppf_normal(z)) for z in (-8.0, 0.0))
    if not 0 < median <= _MOST_SPREAD or not math.isfinite(median):
        advice = 'Give it as a share, 5 % as 0.05; for specimens that do not differ write pooling = "complete"'
        yield ("priors", name), Fault(f"{name} must be above 0 and at most 1, got {median:g}", advice=advice)
    elif low < 0:
        yield (
            ("priors", name),
            Fault(f"{name} must not be negative", advice="Give it a prior such as { lognormal = [0.04, 2] }"),
        )


def _as_log_normal(quantity: str, prior: Prior) -> str:
    """A log-normal prior with the median and the width of another one, as it is written in a file; else an example."""
    low, median, high = (float(prior.ppf_normal(z)) for z in (-1.0, 0.0, 1.0))
    factor = math.sqrt(high / low) if 0 < low <= high < math.inf else 1.0
    return f"{{ lognormal = [{_written(quantity, median)}, {max(factor, 1.01):.3g}] }}"


def _as_normal(quantity: str, prior: Prior) -> str:
    """A normal prior with the median and the width of another one, as it is written in a file."""
    low, median, high = (float(prior.ppf_normal(z)) for z in (-1.0, 0.0, 1.0))
    return f"{{ normal = [{_written(quantity, median)}, {_written(quantity, (high - low) / 2)}] }}"


def _written(quantity: str, value: float) -> str:
    text = display(quantity, float(f"{value:.3g}"))
    return f'"{text}"' if " " in text else text


def wanted_faults(nominal: Mapping[str, float]) -> Iterator[tuple[str, Fault]]:
    """What was wanted of a specimen that cannot be cast: its quantity, and the fault."""
    for quantity, value in nominal.items():
        if value <= 0:
            yield (
                quantity,
                Fault(
                    f"nominal {quantity} must be positive, got {display(quantity, value)}",
                    advice=f"Of a specimen that has none write {quantity} = {{ fixed = 0 }} in [specimens.priors]",
                ),
            )

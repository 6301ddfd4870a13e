"""An experiment in, the models that its data should be held against out: its own, and those that differ in one choice."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from calib.experiment.plan import Experiment
from calib.priors import parse_prior
from models.surrogate import is_shipped

# Choices that outweigh the noise, by the attribute of an `Experiment`: for each value a name, as folders take it, and words.
_CHOICES: Mapping[str, Mapping[Any, tuple[str, str]]] = {
    "law": {"neo-hookean": ("neo-hookean", "neo-Hookean"), "gent": ("gent", "Gent")},
    "stick": {False: ("frictionless", "frictionless"), True: ("stick", "sticking")},
    "base": {"bonded": ("bonded", "bonded base"), "slippery": ("slippery", "slippery base")},
    "padding_material": {
        "sensor": ("one-silicone", "padding of the same silicone"),
        "own": ("own-padding", "padding of its own modulus"),
        "foam": ("foam", "foam as padding"),
    },
}
# Whether residuals of a sweep are correlated is a choice, too, which is held against the data where it is asked for.
_DISCREPANCY: Mapping[Any, tuple[str, str]] = {
    "on": ("discrepancy-on", ""),
    "off": ("discrepancy-off", "no discrepancy"),
}
# Of silicone on what it lies on unglued, and of steel on silicone, dry or oiled, as the priors of variants that rub: with less,
# the one without friction does, which would be a part of it, so that data of one that slides could never rule it out.
_BASE_FRICTION, _ANY_BASE_FRICTION = "base_friction_coefficient", {"uniform": [0.05, 1.0]}
_FRICTION, _ANY_FRICTION = "friction_coefficient", {"uniform": [0.05, 0.6]}
#: Names that `candidates` of an experiment file may hold; which of them depends on the experiment.
CANDIDATES = (
    *(name for names in _CHOICES.values() for value, (name, _) in names.items() if value != "foam"),
    "rubbing-base",
    "friction",
    *(name for name, _ in _DISCREPANCY.values()),
)
#: Name of the variant that an experiment itself is.
AS_GIVEN = "as-given"


@dataclass(frozen=True)
class Variant:
    """A model of the same data: an experiment with one of its choices made otherwise.

    Attributes
    ----------
    name : what is other, for lists and as the name of a folder; `AS_GIVEN` for the experiment itself.
    changes : attribute of `Experiment` -> value; none for the experiment itself.
    """

    name: str
    changes: Mapping[str, Any]

    def of(self, experiment: Experiment) -> Experiment:
        """The experiment with the choice made this way."""
        return replace(experiment, **self.changes)


def variants_of(experiment: Experiment) -> tuple[Variant, ...]:
    """List the models that the data of an experiment should be held against, the experiment itself first.

    Each of the others differs in one choice: the law, friction, the base and its friction, and whether the padding has a
    modulus of its own. Those that the experiment's forward model does not have, or no surrogate is shipped for, are left out;
    so are foams, which one sees (`kinds_of` has them). The discrepancy is not among the choices, see `possible_candidates`.
    """
    priors = experiment.priors
    glued, frictionless = ({k: p for k, p in priors.items() if k != name} for name in (_BASE_FRICTION, _FRICTION))
    others = [
        Variant(name, {choice: value} | ({"priors": glued} if value == "bonded" and experiment.base_rubs else {}))
        for choice, names in _CHOICES.items()
        for value, (name, _) in names.items()
        if value not in (getattr(experiment, choice), "foam")
    ]
    if experiment.base_rubs:
        others.append(Variant("slippery", {"priors": glued}))
    else:
        rubs = {**priors, _BASE_FRICTION: parse_prior(_BASE_FRICTION, _ANY_BASE_FRICTION)}
        others.append(Variant("rubbing-base", {"base": "slippery", "priors": rubs}))
    if experiment.rubs:
        others.append(Variant("frictionless", {"priors": frictionless}))
    else:
        others.append(Variant("friction", {"priors": {**priors, _FRICTION: parse_prior(_FRICTION, _ANY_FRICTION)}}))
    return (Variant(AS_GIVEN, {}), *(v for v in others if _has_model(v.of(experiment))))


def kinds_of(experiment: Experiment) -> tuple[Variant, ...]:
    """List the other models that a lab is asked about whose data contradict its own: those of `variants_of`, and a foam."""
    foam = Variant(_CHOICES["padding_material"]["foam"][0], {"padding_material": "foam"})
    asked = experiment.padding_material != "foam" and _has_model(foam.of(experiment))
    return (*variants_of(experiment)[1:], *([foam] if asked else []))


def possible_candidates(experiment: Experiment) -> tuple[Variant, ...]:
    """List the models that an experiment may name as `candidates`: those of `variants_of`, and with the other discrepancy."""
    others = (
        Variant(name, {"discrepancy": value}) for value, (name, _) in _DISCREPANCY.items() if value != experiment.discrepancy
    )
    return (*variants_of(experiment), *others)


def candidates_of(experiment: Experiment) -> tuple[Variant, ...]:
    """List the models that are to be calibrated and compared: those that the experiment names, else those of `variants_of`."""
    if not experiment.candidates:
        return variants_of(experiment)
    named = (AS_GIVEN, *experiment.candidates)
    return tuple(variant for variant in possible_candidates(experiment) if variant.name in named)


def _has_model(experiment: Experiment) -> bool:
    """Whether the forward model of an experiment has its base, its law, its friction and its padding."""
    if experiment.stick and experiment.rubs:  # by a prior that the experiment names
        return False
    if experiment.model == "closed form":
        return experiment.law == "neo-hookean" and experiment.base == "bonded" and not (experiment.stick or experiment.rubs)
    return experiment.model == "fem" or (experiment.family is not None and is_shipped(experiment.family))


def without_discrepancy(experiment: Experiment) -> Variant | None:
    """The same model with noise alone between it and the readings; None if it is one."""
    return Variant(_DISCREPANCY["off"][0], {"discrepancy": "off"}) if experiment.discrepancy == "on" else None


def model_in_words(experiment: Experiment) -> str:
    """Name the choices of a model that outweigh the noise: "neo-Hookean, frictionless, bonded base, foam as padding"."""
    words = {choice: names[getattr(experiment, choice)][1] for choice, names in _CHOICES.items()}
    if experiment.rubs:
        words["stick"] = "with friction"
    if experiment.base_rubs:
        words["base"] = "slippery base with friction"
    words["discrepancy"] = _DISCREPANCY[experiment.discrepancy][1]
    return ", ".join(filter(None, words.values()))


def beyond_simplest(experiment: Experiment) -> tuple[str, ...]:
    """Name the choices of a model that the simplest one does not have, which one may have made because data asked for them.

    A foam is none: one sees it.
    """
    simplest = {choice: next(iter(names)) for choice, names in _CHOICES.items()}
    found = [
        names[getattr(experiment, choice)][1]
        for choice, names in _CHOICES.items()
        if getattr(experiment, choice) not in (simplest[choice], "foam")
    ]
    return (*found, *(["friction"] if experiment.rubs else []), *(["friction on the base"] if experiment.base_rubs else []))

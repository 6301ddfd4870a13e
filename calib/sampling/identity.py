"""A problem and the settings of a run in, all that its draws depend on out: by name, and as one fingerprint."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import version

from calib.catalogue import UnknownName
from calib.lab import sweeps_to_json
from calib.priors import prior_from_json
from calib.problem import LIKELIHOOD_VERSION, Problem, of_lot, scopes_of
from calib.sampling.coordinates import MANY_SPECIMENS
from calib.sampling.ensemble import GROUPWISE, OF_LOT, SHAPELESS, SHAPELY, STORE_EVERY
from calib.sampling.start import START_VERSION

#: Independent ensembles of a run that is not told their number.
ENSEMBLES = 4

#: Key of the fingerprint among the texts that are kept with a posterior.
FINGERPRINT = "fingerprint"

# How parts are named.
_PRIOR, _FIXED, _MOVES = "prior of ", "fixed value of ", "moves of the sampler"

# Differences that a refusal names.
_NAMED = 4


@dataclass(frozen=True)
class Identity:
    """All that the draws of a run depend on, so that files of one run are never taken for those of another.

    Attributes
    ----------
    parts : what it is, in words -> its value, or the SHA-256 of a long one.
    """

    parts: Mapping[str, str]

    @property
    def fingerprint(self) -> str:
        """64 hexadecimal digits, others for every other identity."""
        return hashlib.sha256(json.dumps(dict(self.parts), sort_keys=True).encode()).hexdigest()


def identity_of(problem: Problem, seed: int, n_ensemble: int = ENSEMBLES, n_walker: int | None = None) -> Identity:
    """Say all that the draws of a chain depend on, so that a chain is never continued as that of another posterior.

    That is the data, the unknowns with their priors, what is known of the specimens and the rig, the forward model by its
    content, the likelihood's version, seed, ensembles and moves, and the version of emcee, whose code the moves are. Not where
    files lie, and not the version of this package, in whose place the versions of likelihood and sampler stand.

    Parameters
    ----------
    problem : what is sampled.
    seed : of the whole run.
    n_ensemble : how many ensembles.
    n_walker : how many walkers in each; None for `usual_walkers`.
    """
    e = problem.experiment
    forward = problem.forward
    return Identity(
        {
            "seed": str(seed),
            "ensembles": str(n_ensemble),
            "walkers of an ensemble": str(n_walker or usual_walkers(problem)),
            _MOVES: json.dumps([SHAPELY, SHAPELESS, GROUPWISE, OF_LOT, STORE_EVERY, START_VERSION]),
            "version of emcee": version("emcee"),
            "version of the likelihood": str(LIKELIHOOD_VERSION),
            "forward model": f"{forward.name}, {forward.identity}",
            "law": e.law,
            "contact": "stick" if e.stick else "friction" if e.rubs else "frictionless",
            "base": e.base,
            "radius of the sensor": f"{e.sensor_radius!r} m",
            "material of the padding": e.padding_material,
            "discrepancy": e.discrepancy,
            **_pooling(problem),
            "unknowns": ", ".join(problem.names),
            **{f"{_PRIOR}{p.name}": json.dumps(p.prior.to_json(), sort_keys=True) for p in problem.parameters},
            **{f"{_FIXED}{name}": repr(value) for name, value in problem.fixed.items()},
            **{
                f"data of sweep {k} ({sweep.title})": hashlib.sha256(sweeps_to_json((sweep,)).encode()).hexdigest()
                for k, sweep in enumerate(problem.sweeps, start=1)
            },
        }
    )


def _pooling(problem: Problem) -> dict[str, str]:
    """That specimens are of one lot, and what is believed of it; nothing under complete pooling."""
    if not problem.table.lots:
        return {}
    of_lots = {f"{_PRIOR}{i.name}": json.dumps(i.prior.to_json(), sort_keys=True) for i in of_lot(problem)}
    nominal = {f"nominal of {s.name}": json.dumps(dict(s.nominal), sort_keys=True) for s in problem.experiment.specimens}
    measured = {
        f"measured {quantity}[{s.name}]": json.dumps(s.priors[quantity].to_json(), sort_keys=True)
        for s in problem.experiment.specimens
        for quantity in (lot.quantity for lot in problem.table.lots)
        if quantity in s.priors
    }
    return {"pooling": "partial", **of_lots, **nominal, **measured}


def usual_walkers(problem: Problem) -> int:
    """Walkers of an ensemble that is not told their number: four for each unknown, and at least 96.

    Of many specimens, which move independently of each other, only the unknowns of one count and those that all share, and 96
    will do: a step costs as much as there are specimens, and every one of them moves at each.
    """
    scopes = scopes_of(problem)
    sizes = [own.size for own in scopes.specimens.values()]
    if len(sizes) >= MANY_SPECIMENS:
        return max(96, 4 * (scopes.shared.size + max(sizes)))
    return max(96, 4 * len(problem.parameters))


def differences(found: Mapping[str, str], wanted: Mapping[str, str]) -> str:
    """Say in words in what two identities differ; empty if they do not.

    Parameters
    ----------
    found : the parts of what is there.
    wanted : those of what is asked for now.
    """
    known, now = _by_unknown(found), _by_unknown(wanted)
    names = [*now, *(name for name in known if name not in now)]
    differing = [name for name in names if known.get(name) != now.get(name)]
    said = [_changed(name, known.get(name), now.get(name)) for name in differing[:_NAMED]]
    if len(differing) > _NAMED:
        said.append(f"{len(differing) - _NAMED} more differences")
    return "; ".join(said)


def _by_unknown(parts: Mapping[str, str]) -> dict[str, str]:
    """The parts with what is fixed among the priors, as it stands in an experiment file."""
    fixed = {name: value for name, value in parts.items() if name.startswith(_FIXED)}
    others = {name: value for name, value in parts.items() if name not in fixed}
    return others | {
        f"{_PRIOR}{name.removeprefix(_FIXED)}": f'{{"kind": "fixed", "value": {value}}}' for name, value in fixed.items()
    }


def _changed(name: str, old: str | None, new: str | None) -> str:
    """One difference in words."""
    if name.startswith("data of ") and old is not None and new is not None:
        return f"{name} have changed: its files, its ball or the part that is used"
    if name == _MOVES:
        return f"{name} are those of another version"
    was, now = (_worded(name, value) for value in (old, new))
    if was == now:  # in the digits that are shown
        was, now = _shown(old), _shown(new)
    return f"{name} was {was} and is {now} now"


def _worded(name: str, value: str | None) -> str:
    """A part of an identity as a user would say it."""
    if value is None or not name.startswith(_PRIOR):
        return _shown(value)
    try:
        unknown = UnknownName.parse(name.removeprefix(_PRIOR)).parameter
        return f'"{prior_from_json(json.loads(value)).describe(unknown)}"'
    except (ValueError, KeyError):  # of a version that knows other priors or unknowns
        return _shown(value)


def _shown(value: str | None) -> str:
    return "none" if value is None else re.sub(r"\b([0-9a-f]{8})[0-9a-f]{24,}\b", r"\1…", value)

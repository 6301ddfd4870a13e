"""Two runs of different data in, what differs between them out: unknowns, experiments, data and programs, and curves."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import PurePath
from typing import Any

import numpy as np

from calib.catalogue import UnknownName
from calib.checks import BAND_LEVELS, Changed, Difference, Loading, band, differences_of, drawn, members_or, shared_data
from calib.decision import largest_force
from calib.experiment import Experiment, experiment_to_json, held_twice, readings_of_sweeps
from calib.priors import prior_from_json
from calib.problem import specimen_design
from calib.runs.folder import Run
from calib.sampling import Posterior
from calib.visible import visible
from models.curves import predict_design
from models.sensor import FloatArray

# Forces of a curve and draws that it is of.
_N_FORCE, _N_DRAW = 41, 300
# What an experiment's record holds that is no choice of its user: where it lay, what it is.
_NOT_TOLD = ("kind", "format", "checksum", "path", "sha256", "unedited")


def diff_runs(first: Run, second: Run, *, same_specimens: bool = False) -> Difference:
    """Hold two calibrations of different data against each other: another lot, another day, another lab.

    For models of the same data there is `calib.compare_runs`.

    Parameters
    ----------
    first, second : the runs.
    same_specimens : whether specimens of one name are the same pieces, measured again.

    Returns
    -------
    The comparison; without any z if data are in both runs.
    """
    names = _names(first, second)
    shared = shared_data(first.posterior, second.posterior) or _cut(first, second)
    found = differences_of(first.posterior, second.posterior, names, same_specimens=same_specimens, shared=shared)
    changed = tuple(_changed(first, second))
    loadings = (*_loadings(first, names[0]), *_loadings(second, names[1]))
    return replace(found, changed=changed, loadings=loadings, colours=(first.verdict.colour, second.verdict.colour))


def _cut(first: Run, second: Run) -> tuple[str, ...]:
    """Say in words which readings are in the lab files of both, where these still lie; points do not tell of every cut."""
    both = [(k, readings_of_sweeps(run.posterior.experiment, run.posterior.sweeps)) for k, run in enumerate((first, second))]
    pairs = held_twice({(k, name): rows for k, of in both for name, rows in of.items()})
    return tuple(f"the same readings of {name}" for (k, _), (j, name) in pairs if k != j)


def _names(first: Run, second: Run) -> tuple[str, str]:
    """Names of the runs by which they are told apart."""
    folders = [run.folder.absolute() for run in (first, second)]
    for k in range(1, max(len(folder.parts) for folder in folders) + 1):
        one, other = (" ".join(visible(str(PurePath(*folder.parts[-k:]))).split()) for folder in folders)
        if one != other:
            return one, other
    return f"{folders[0].name} (first)", f"{folders[1].name} (second)"


def _changed(first: Run, second: Run) -> Iterator[Changed]:
    """What is not the same in two runs, what decides the numbers first."""
    yield from _not_alike(*(dict(_facts(run)) for run in (first, second)))
    ones, others = (_presses(run.posterior) for run in (first, second))
    for title in dict.fromkeys([*ones, *others]):
        if title in ones and title in others:
            yield from _not_alike(ones[title], others[title])
        else:
            yield Changed(f"press {title}", *("there" if title in of else "-" for of in (ones, others)))


def _not_alike(one: Mapping[str, str], other: Mapping[str, str]) -> Iterator[Changed]:
    for what in dict.fromkeys([*one, *other]):
        if one.get(what, "-") != other.get(what, "-"):
            yield Changed(what, one.get(what, "-"), other.get(what, "-"))


def _facts(run: Run) -> Iterator[tuple[str, str]]:
    """All that a run rests on, in words."""
    posterior = run.posterior
    yield "forward model", f"{run.forward.name}, {run.forward.identity}"
    yield from _of_experiment(posterior.experiment)
    yield from _priors(posterior)
    yield "seed", str(posterior.seed)
    yield from sorted((name, value) for name, value in posterior.attrs.items() if name.startswith("version of "))


def _of_experiment(experiment: Experiment) -> Iterator[tuple[str, str]]:
    record = json.loads(experiment_to_json(experiment))
    for name, value in record.items():
        if name not in (*_NOT_TOLD, "priors", "specimens"):
            yield name, _word(value)


def _presses(posterior: Posterior) -> dict[str, dict[str, str]]:
    """What is said of each press, and the bytes of its files, by its title."""
    found: dict[str, dict[str, str]] = {}
    for specimen in json.loads(experiment_to_json(posterior.experiment))["specimens"]:
        for sweep in specimen["sweeps"]:
            of = ", ".join(part for part in (specimen["name"], sweep["name"]) if part)
            found[of] = {f"{name} of {of}": _word(value) for name, value in _flat(sweep) if name != "name"}
    for measured in posterior.sweeps:
        files = {f"file of {measured.title}: {name}": f"SHA-256 {sha[:12]}" for name, sha in measured.files}
        found.setdefault(measured.title, {}).update(files)
    return found


def _flat(values: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Tables within tables as names with dots."""
    for name, value in values.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", value


def _word(value: Any) -> str:
    """A value of a record as one reads it; of a path its name alone."""
    if isinstance(value, str) and PurePath(value).is_absolute():
        return PurePath(value).name
    return value if isinstance(value, str) else json.dumps(value)


def _priors(posterior: Posterior) -> Iterator[tuple[str, str]]:
    for info in posterior.parameters:
        yield f"prior of {info.name}", info.prior.describe(info.parameter)
    for name, value in posterior.fixed.items():
        yield f"prior of {name}", prior_from_json({"kind": "fixed", "value": value}).describe(UnknownName.parse(name).parameter)


def _loadings(run: Run, name: str) -> Iterator[Loading]:
    """The curves of all specimens of a run, up to the largest force that it measured."""
    posterior = run.posterior
    force = largest_force(posterior) * np.linspace(0.0, 1.0, _N_FORCE) ** 2
    parts = drawn(members_or(run.members, posterior, run.forward), _N_DRAW, np.random.default_rng(posterior.seed))
    for specimen in posterior.experiment.specimens:
        if not any(sweep.specimen == specimen.name for sweep in posterior.sweeps):
            continue
        found = [predict_design(m.forward, specimen_design(m.posterior, values, specimen.name), force) for m, values in parts]
        depth, change = (band(np.concatenate(columns)) for columns in zip(*((p.depth, p.change) for p in found), strict=True))
        electrical = any("capacitance" in s.channels for s in posterior.sweeps if s.specimen == specimen.name)
        nothing: FloatArray = np.full((len(BAND_LEVELS), force.size), np.nan)
        yield Loading(name, specimen.name, force, depth, change if electrical else nothing)

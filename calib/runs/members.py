"""The posterior of an average in a run folder in, the models that it is an average of, as that folder keeps them, out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from calib.checks import Member, forward_of_average
from calib.errors import Fault, InputError
from calib.experiment import forward_of_experiment
from calib.files import sha256_of, whole_file
from calib.runs.listing import MEMBERS
from calib.sampling import Averaged, Posterior, load_posterior
from models.response import Forward

#: Among the texts kept with a posterior: the surrogate file it was made with, if not the shipped one.
SURROGATE_FILE = "surrogate file"


def forward_of(posterior: Posterior) -> Forward:
    """Load the forward model that a posterior was sampled with; of an average what refuses in its place.

    Raises
    ------
    InputError
        If the surrogate file it was made with is gone.
    """
    if posterior.diagnostics.models:
        return forward_of_average(len(posterior.diagnostics.models))
    # A file that another model was given, as it once could be, is none of its own.
    file = posterior.attrs.get(SURROGATE_FILE) if posterior.experiment.model == "surrogate" else None
    return forward_of_experiment(posterior.experiment, Path(file) if file else None)


def load_members(folder: Path, posterior: Posterior) -> tuple[Member, ...]:
    """Load the models that the posterior of a run is an average of; none if it is no average.

    Parameters
    ----------
    folder : of the run.
    posterior : of it.

    Raises
    ------
    InputError
        If one of them is not there, or is not the one that was averaged.
    """
    return tuple(_load(folder, model) for model in posterior.diagnostics.models)


def changed_forwards(posterior: Posterior, members: tuple[Member, ...]) -> Iterator[str]:
    """Say of which models of an average the forward model has changed since.

    Parameters
    ----------
    posterior : the average.
    members : its models, as loaded.
    """
    for told, member in zip(posterior.diagnostics.models, members, strict=True):
        if told.forward != f"{member.forward.name}, {member.forward.identity}":
            yield f"The {member.forward.name} is no longer the one that {member.name} was calibrated with."


def write_members(folder: Path, sources: Mapping[str, Path]) -> None:
    """Copy the posteriors of models into the folder of their average, to the byte.

    Parameters
    ----------
    folder : of the average.
    sources : name in that folder, from `member_file` -> file.
    """
    (folder / MEMBERS).mkdir(exist_ok=True)
    for name, source in sources.items():
        with whole_file(folder / name) as part:
            part.write_bytes(source.read_bytes())


def member_file(name: str) -> str:
    """Where the posterior of a model lies in the folder of its average."""
    return f"{MEMBERS}/{name}.nc"


def _load(folder: Path, model: Averaged) -> Member:
    path = folder / member_file(model.name)
    advice = "Average the runs again with `calib average`, or put the file back"
    if not path.is_file():
        raise InputError(
            Fault(f"the posterior of {model.name}, which this is an average of, is not there", path, advice=advice)
        )
    if sha256_of(path) != model.sha256:
        raise InputError(Fault("this posterior is not the one that was averaged", path, advice=advice))
    posterior = load_posterior(path)
    return Member(model.name, posterior, forward_of(posterior), model.weight)

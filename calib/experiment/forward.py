"""From an experiment or a design, and the name of a model, to the forward model that serves it."""

from __future__ import annotations

from pathlib import Path

from calib.errors import Fault, InputError
from calib.experiment.plan import Experiment
from models.analytic import ClosedForm
from models.fem import FiniteElements
from models.response import Forward
from models.sensor import Design
from models.surrogate import (
    NEO_HOOKEAN,
    Family,
    NotShippedError,
    Surrogate,
    family_of_design,
    load_surrogate,
    shipped_in_words,
)


def forward_of_experiment(experiment: Experiment, surrogate: Path | str | None = None) -> Forward:
    """Load the forward model that an experiment is to be calibrated with.

    Parameters
    ----------
    experiment : it says which model, which law and which contact.
    surrogate : file of a surrogate to use instead of the shipped one, if the model is a surrogate.

    Raises
    ------
    InputError
        If there is no such surrogate, it cannot be read, or the model is none.
    """
    return _forward(experiment.model, Path(surrogate) if surrogate is not None else None, experiment.family)


def forward_of_design(design: Design, model: str, surrogate: Path | None = None) -> Forward:
    """Load the forward model of a name for one design.

    Parameters
    ----------
    design : its base, law, friction and padding say which surrogate.
    model : "surrogate", "fem" or "closed-form".
    surrogate : file of a surrogate to use instead of the shipped one, if the model is a surrogate.

    Raises
    ------
    InputError
        If there is no such surrogate, it cannot be read, or the model is none.
    """
    return _forward(model, surrogate, family_of_design(design))


def surrogate_from(file: Path | None = None, family: Family | None = NEO_HOOKEAN) -> Surrogate:
    """Load a surrogate from a file, or the one shipped for a family.

    Parameters
    ----------
    file : of the surrogate; None for the shipped one.
    family : the family whose shipped surrogate is wanted; None if no surrogate serves the designs, which is refused.

    Raises
    ------
    InputError
        If there is no such surrogate, or it cannot be read.
    """
    if file is not None and not file.is_file():
        advice = "Leave --surrogate out to use the shipped one"
        raise InputError(Fault("there is no such surrogate file", file, advice=advice))
    if family is None:
        message = "there is no surrogate for this combination of base, law, friction and padding"
        raise InputError(Fault(message, advice=f"Use the model fem. There are surrogates of {shipped_in_words()}"))
    try:
        return load_surrogate(file, family)
    except NotShippedError as error:
        raise InputError(Fault(str(error))) from None
    except (OSError, ValueError, KeyError) as error:
        raise InputError(Fault(f"not a surrogate that can be read ({error})", file)) from None


def require_use_of(surrogate: Path | None, model: str) -> None:
    """Refuse a surrogate file that the model would take no notice of.

    Parameters
    ----------
    surrogate : the file; None if none is given.
    model : name of the model.

    Raises
    ------
    InputError
        If so.
    """
    if surrogate is not None and model != "surrogate":
        message = f'a surrogate file is given, but the model is "{model}", which uses none'
        raise InputError(Fault(message, surrogate, advice='Leave --surrogate out, or choose the model "surrogate"'))


def _forward(model: str, surrogate: Path | None, family: Family | None) -> Forward:
    require_use_of(surrogate, model)
    if model == "fem":
        return FiniteElements()
    if model.replace("-", " ") == "closed form":
        return ClosedForm()
    return surrogate_from(surrogate, family)

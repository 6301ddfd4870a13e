"""An experiment and another model of its data in, what to write into its file for that model, and where, out."""

from __future__ import annotations

from collections.abc import Mapping

from calib.catalogue import UNKNOWNS
from calib.errors import InputError
from calib.experiment.plan import Experiment
from calib.experiment.toml_file import read_toml
from calib.experiment.toml_places import KeyPath
from calib.experiment.variants import Variant

# Choice -> its key in an experiment file, and what is written for its values where that is not the value itself.
_KEYS: Mapping[str, tuple[KeyPath, Mapping[object, str]]] = {
    "base": (("base",), {}),
    "law": (("sensor", "law"), {}),
    "stick": (("indenter", "friction_coefficient"), {True: '"stick"', False: "0"}),
    "padding_material": (("padding", "material"), {}),
    "discrepancy": (("discrepancy",), {}),
}


def line_of_variant(experiment: Experiment, variant: Variant) -> str:
    """Say what to write for another model, and where: 'base = "slippery" (line 16)'; "" where something must be taken out.

    Parameters
    ----------
    experiment : as it is in its file.
    variant : that differs in one choice.
    """
    lines = []
    for choice, value in variant.changes.items():
        if choice == "priors" and value.keys() > experiment.priors.keys():
            lines += [f"{name} = {UNKNOWNS[name].example} (in [priors])" for name in value if name not in experiment.priors]
        elif choice in _KEYS:
            lines.append(_line(experiment, choice, value))
        else:
            return ""
    return " and ".join(lines)


def _line(experiment: Experiment, choice: str, value: object) -> str:
    at, written = _KEYS[choice]
    quoted = f'"{value}"'
    line = f"{at[-1]} = {written.get(value, quoted)}"
    place = _place(experiment, at)
    if place is not None:
        return f"{line} (line {place})"
    return f"{line} (in [{at[0]}])" if len(at) > 1 else f"{line} (at the top of the file)"


def _place(experiment: Experiment, at: KeyPath) -> int | None:
    """The line of a key in the file of an experiment; None where it does not stand there, or there is no file any more."""
    if experiment.path is None:
        return None
    try:
        places = read_toml(experiment.path).places
    except InputError:
        return None
    return places[at][0] if at in places else None

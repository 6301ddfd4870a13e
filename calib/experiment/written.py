"""An experiment in, the text of an experiment file that says the same out, with notes where something is still to be put in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from calib.catalogue import QUANTITIES
from calib.experiment.draft import quoted_text, reading_words, relative_name, use_words
from calib.experiment.edits import MARK
from calib.experiment.laboratory import LABORATORY, Laboratory, keys_of
from calib.experiment.plan import Experiment, Specimen, SweepFiles
from calib.lab import Reading
from calib.priors import Fixed, HalfNormal, LogNormal, Normal, Prior, TruncatedNormal, Uniform

#: What a note stands above: an unknown of all specimens ("", name), one of a specimen (its name, name), or a sweep (the name of
#: the specimen, that of the sweep).
Place = tuple[str, str]


def experiment_toml(experiment: Experiment, folder: Path, notes: Mapping[Place, str], head: Sequence[str] = ()) -> str:
    """Write an experiment as a file from which the same is read: for one that follows from another, with more to measure.

    Parameters
    ----------
    experiment : to be written.
    folder : of the file, which lab files are named relative to.
    notes : place -> what is still to be put in there; each stands above its line with the mark EDIT, which has to be removed.
    head : lines of the comment at the top.

    Returns
    -------
    The text, TOML with comments.
    """
    e = experiment
    lines = [f"# {line}".rstrip() for line in head]
    lines += [f"name = {quoted_text(e.name)}", f'model = "{e.model}"', f'discrepancy = "{e.discrepancy}"']
    lines += [f'base = "{e.base}"', f'pooling = "{e.pooling}"']
    if e.candidates:
        lines.append(f"candidates = [{', '.join(map(quoted_text, e.candidates))}]")
    lines += ["", "[indenter]", f"radius = {_quantity('indenter_radius', e.indenter_radius)}"]
    lines += ['friction_coefficient = "stick"'] if e.stick else []
    lines += ["", "[sensor]", f"radius = {_quantity('sensor_radius', e.sensor_radius)}"]
    lines += ['law = "gent"'] if e.law == "gent" else []
    lines += ["", "[padding]", f'material = "{e.padding_material}"', "", "[priors]", *_priors("", e.priors, notes)]
    for specimen in e.specimens:
        lines += ["", "[[specimens]]", *_specimen(e, specimen, folder, notes)]
    if e.laboratory != Laboratory():
        lines += ["", "[laboratory]", *_laboratory(e.laboratory)]
    for instrument in e.instruments:
        lines += ["", "[[instruments]]", *(f"{key} = {quoted_text(value)}" for key, value in keys_of(instrument).items())]
    return "\n".join(lines) + "\n"


def _laboratory(laboratory: Laboratory) -> list[str]:
    said = {key: value for key in LABORATORY if key != "measured" and (value := getattr(laboratory, key))}
    lines = [f"{key} = {quoted_text(value)}" for key, value in said.items()]
    if days := [quoted_text(day) for day in dict.fromkeys((laboratory.measured, laboratory.measured_until)) if day]:
        lines.append(f"measured = {days[0] if len(days) == 1 else '[' + ', '.join(days) + ']'}")
    return lines


def prior_toml(parameter: str, prior: Prior) -> str:
    """A prior as it stands in an experiment file.

    Parameters
    ----------
    parameter : the unknown.
    prior : what is believed of it.

    Raises
    ------
    ValueError
        If it is of a kind that has no form in a file.

    >>> prior_toml("sensor_thickness", Normal(0.74e-3, 0.02e-3))
    '{ normal = ["0.74 mm", "0.02 mm"] }'
    """

    def written(*numbers: float) -> str:
        return ", ".join(_quantity(parameter, number) for number in numbers)

    match prior:
        case Fixed(value):
            return f"{{ fixed = {written(value)} }}"
        case Normal(mean, sd):
            return f"{{ normal = [{written(mean, sd)}] }}"
        case TruncatedNormal(mean, sd, 0.0, high) if high == float("inf"):
            return f"{{ normal = [{written(mean, sd)}] }}"
        case TruncatedNormal(mean, sd, low, high):
            return f"{{ truncated_normal = [{written(mean, sd, low, high)}] }}"
        case LogNormal(median, factor):
            return f"{{ lognormal = [{written(median)}, {factor:.12g}] }}"
        case HalfNormal(scale):
            return f"{{ halfnormal = {written(scale)} }}"
        case Uniform(low, high):
            return f"{{ uniform = [{written(low, high)}] }}"
        case _:
            raise ValueError(f"a prior of the kind {type(prior).__name__} has no form in an experiment file")


def _quantity(parameter: str, value: float) -> str:
    row = QUANTITIES[parameter]
    unit = row.display_unit.replace("µ", "u")
    # As many digits as bring the same number back, and no more: 0.74 rather than 0.74000000000000005.
    shown = f"{value * row.display_scale:.12g}"
    return f'"{shown} {unit}"' if row.unit else f"{value:.12g}"


def _priors(specimen: str, priors: Mapping[str, Prior], notes: Mapping[Place, str]) -> list[str]:
    lines = []
    for name, prior in priors.items():
        lines += _note(notes, specimen, name)
        lines.append(f"{name} = {prior_toml(name, prior)}")
    return lines


def _note(notes: Mapping[Place, str], specimen: str, name: str) -> list[str]:
    return [f"{MARK} {note}" for at, note in notes.items() if at == (specimen, name)]


def _specimen(e: Experiment, specimen: Specimen, folder: Path, notes: Mapping[Place, str]) -> list[str]:
    lines = [f"name = {quoted_text(specimen.name)}"]
    alone = len(specimen.sweeps) == 1 and not specimen.sweeps[0].name
    if alone:
        lines += _sweep(e, specimen, specimen.sweeps[0], folder, notes)
    lines += ["[specimens.priors]", *_priors(specimen.name, specimen.priors, notes)]
    if specimen.nominal:
        lines += ["[specimens.nominal]", *(f"{name} = {_quantity(name, value)}" for name, value in specimen.nominal.items())]
    for number, sweep in enumerate(() if alone else specimen.sweeps, 1):
        name = sweep.name or f"press {number}"
        lines += ["[[specimens.sweeps]]", f"name = {quoted_text(name)}", *_sweep(e, specimen, sweep, folder, notes)]
    return lines


def _sweep(e: Experiment, specimen: Specimen, sweep: SweepFiles, folder: Path, notes: Mapping[Place, str]) -> list[str]:
    lines = _note(notes, specimen.name, sweep.name)
    if sweep.indenter_radius != e.indenter_radius:
        lines.append(f"indenter_radius = {_quantity('indenter_radius', sweep.indenter_radius)}")
    for key, path, how in (
        ("force", sweep.force, sweep.force_reading),
        ("capacitance", sweep.capacitance, sweep.capacitance_reading),
    ):
        if path is not None:
            lines.append(f"{key} = {_file(path, how, folder)}")
    if said := use_words(sweep.use):
        lines.append(f"use = {{ {', '.join(said)} }}")
    return lines


def _file(path: Path, how: Reading, folder: Path) -> str:
    name = quoted_text(relative_name(path, folder))
    said = reading_words(how)
    return f"{{ file = {name}, {', '.join(said)} }}" if said else name

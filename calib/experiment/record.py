"""An experiment as JSON text, and back: what a run keeps of the experiment that it is of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path

from calib.experiment.edits import Unedited
from calib.experiment.laboratory import Instrument, Laboratory
from calib.experiment.plan import Experiment, Specimen, SweepFiles
from calib.lab import Reading, Use
from calib.priors import Prior, prior_from_json
from calib.records import record_from_text, record_to_text

_FORMAT = 8


def experiment_to_json(experiment: Experiment) -> str:
    """Write the whole experiment as JSON text, SI, so that a run keeps what it is of; the inverse is `experiment_from_json`."""

    def priors(given: Mapping[str, Prior]) -> dict[str, object]:
        return {parameter: prior.to_json() for parameter, prior in given.items()}

    def file(path: Path | None) -> str | None:
        return None if path is None else str(path)

    def fields_of(said: Reading | Use) -> dict[str, object]:
        found = {f.name: getattr(said, f.name) for f in fields(said)}
        return {name: dict(value) if isinstance(value, Mapping) else value for name, value in found.items()}

    specimens = [
        {
            "name": specimen.name,
            "sweeps": [
                {
                    "name": sweep.name,
                    "force": file(sweep.force),
                    "capacitance": file(sweep.capacitance),
                    "indenter_radius": sweep.indenter_radius,
                    "force_reading": fields_of(sweep.force_reading),
                    "capacitance_reading": fields_of(sweep.capacitance_reading),
                    "use": fields_of(sweep.use),
                }
                for sweep in specimen.sweeps
            ],
            "priors": priors(specimen.priors),
            "nominal": dict(specimen.nominal),
        }
        for specimen in experiment.specimens
    ]
    document = {
        "name": experiment.name,
        "path": None if experiment.path is None else str(experiment.path),
        "sha256": experiment.sha256,
        "indenter_radius": experiment.indenter_radius,
        "sensor_radius": experiment.sensor_radius,
        "padding_material": experiment.padding_material,
        "model": experiment.model,
        "discrepancy": experiment.discrepancy,
        "law": experiment.law,
        "stick": experiment.stick,
        "base": experiment.base,
        "candidates": list(experiment.candidates),
        "pooling": experiment.pooling,
        "unedited": [[u.line, u.what, u.of, u.stands] for u in experiment.unedited],
        "laboratory": asdict(experiment.laboratory),
        "instruments": [asdict(instrument) for instrument in experiment.instruments],
        "priors": priors(experiment.priors),
        "specimens": specimens,
    }
    return record_to_text("experiment", _FORMAT, document, indent=None)


def experiment_from_json(text: str) -> Experiment:
    """Read the experiment that `experiment_to_json` wrote; the files it names need not exist any more.

    Raises
    ------
    ValueError
        If the text is not of the version that this program writes.
    """
    document = record_from_text("experiment", _FORMAT, text)

    def priors(given: Mapping[str, Mapping[str, object]]) -> dict[str, Prior]:
        return {parameter: prior_from_json(prior) for parameter, prior in given.items()}

    def file(path: str | None) -> Path | None:
        return None if path is None else Path(path)

    specimens = tuple(
        Specimen(
            specimen["name"],
            tuple(
                SweepFiles(
                    sweep["name"],
                    file(sweep["force"]),
                    file(sweep["capacitance"]),
                    float(sweep["indenter_radius"]),
                    Reading(**sweep["force_reading"]),
                    Reading(**sweep["capacitance_reading"]),
                    Use(**{**sweep["use"], "cycles": tuple(sweep["use"]["cycles"])}),
                )
                for sweep in specimen["sweeps"]
            ),
            priors(specimen["priors"]),
            specimen.get("nominal", {}),  # records of before there were lots do not have it
        )
        for specimen in document["specimens"]
    )
    return Experiment(
        name=document["name"],
        path=None if document["path"] is None else Path(document["path"]),
        sha256=document["sha256"],
        indenter_radius=float(document["indenter_radius"]),
        sensor_radius=float(document["sensor_radius"]),
        padding_material=document["padding_material"],
        priors=priors(document["priors"]),
        specimens=specimens,
        model=document["model"],
        discrepancy=document["discrepancy"],
        law=document["law"],
        stick=document["stick"],
        base=document["base"],
        candidates=tuple(document["candidates"]),
        pooling=document.get("pooling", "complete"),  # records of before there was a choice do not have it
        unedited=tuple(Unedited(*u) for u in document["unedited"]),
        # Records of before an experiment file could say who measured have neither.
        laboratory=Laboratory(**document.get("laboratory", {})),
        instruments=tuple(Instrument(**instrument) for instrument in document.get("instruments", ())),
    )

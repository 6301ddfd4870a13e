"""A certificate and the files of its run in, the description of its folder as an RO-Crate (1.1, Process Run Crate) out."""

from __future__ import annotations

import json
import mimetypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

from calib.provenance import PROGRAM
from calib.report.certificate import Certificate

#: Name that the file must have.
CRATE = "ro-crate-metadata.json"

_CRATE = "https://w3id.org/ro/crate/1.1"
_PROCESS = "https://w3id.org/ro/wfrun/process/0.5"
# What the context of RO-Crate 1.1 does not have yet.
_TERMS = {"sha256": "http://schema.org/sha256"}
_UNLICENSED = "#no-licence"

_FORMATS = {".nc": "application/x-hdf5", ".toml": "application/toml", ".minisig": "text/plain", ".npz": "application/zip"}
_ABOUT = {
    "posterior.nc": "draws of the posterior, with data, diagnostics and experiment (NetCDF)",
    "summary.json": "parameters, verdict and diagnostics, SI",
    "summary.csv": "parameters, SI",
    "report.html": "report for people",
    "report.pdf": "the same, printed",
    "as_calibrated.toml": "the experiment file, as it was calibrated",
    "recommendation.json": "which padding to build",
    "specification.csv": "which paddings conform to a specification",
    "next.json": "what to measure next",
    "run.json": "what the run is of, and the hashes of its files",
    "certificate.json": "certificate, with the hashes of all other files",
    "certificate.html": "certificate for people",
    "certificate.xml": "certificate as PTB's Digital Calibration Certificate",
    "certificate.json.minisig": "signature of certificate.json (minisign)",
}
_PAGES = ("report.html", "report.pdf")
_ADVICE = ("recommendation.json", "specification.csv", "next.json")
# Commands that make the draws, and all else but the advice; so may one that is no command of `calib`. What others write anew.
_MAKING = ("calibrate", "compare", "average", "")
_WRITTEN_BY: Mapping[str, tuple[str, ...]] = {
    "recommend": ("recommendation.json", "specification.csv", *_PAGES),
    "next": ("next.json", *_PAGES),
    "report": ("summary.json", "summary.csv", *_PAGES),
}


@dataclass(frozen=True)
class CrateFile:
    """A file in the folder of a run: its name there, and where they do not change any more its SHA-256 and size [byte]."""

    name: str
    sha256: str = ""
    size: int = -1


def crate_json(certificate: Certificate, files: tuple[CrateFile, ...]) -> str:
    """Write the content of ro-crate-metadata.json: who made what in a run's folder from what, for archives and search engines.

    Parameters
    ----------
    certificate : of the run.
    files : in its folder.
    """
    c = certificate
    graph: list[dict[str, Any]] = [
        {"@id": CRATE, "@type": "CreativeWork", "about": {"@id": "./"}, "conformsTo": {"@id": _CRATE}},
        _root(c, files),
        {"@id": _PROCESS, "@type": "CreativeWork", "name": "Process Run Crate", "version": "0.5"},
        {
            "@id": _UNLICENSED,
            "@type": "CreativeWork",
            "name": "No licence stated",
            "description": "Ask the laboratory before you use these data.",
        },
        *_people(c),
        *(_file(file) for file in files),
        *(_input(k, entry) for k, entry in enumerate(c.origin.inputs, 1)),
        *_instruments(c),
        *_software(c),
        *_actions(c, files),
    ]
    content = {"@context": [f"{_CRATE}/context", _TERMS], "@graph": graph}
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _root(c: Certificate, files: tuple[CrateFile, ...]) -> dict[str, Any]:
    root: dict[str, Any] = {
        "@id": "./",
        "@type": "Dataset",
        "name": c.name,
        "description": f"Calibration of a soft capacitive sensor. {c.title}. {c.statement} Verdict: {c.verdict.colour}.",
        "datePublished": c.issued,
        "license": {"@id": _UNLICENSED},
        "conformsTo": {"@id": _PROCESS},
        "identifier": c.number,
        "hasPart": [{"@id": _address(file.name)} for file in files],
        "mentions": _one_or_all([{"@id": action["@id"]} for action in _actions(c, files)]),
    }
    if c.laboratory.operator:
        root["author"] = {"@id": "#operator"}
    if c.laboratory.name:
        root["publisher"] = {"@id": "#laboratory"}
    return root


def _people(c: Certificate) -> list[dict[str, Any]]:
    laboratory, found = c.laboratory, []
    if laboratory.name:
        organisation = {"@id": "#laboratory", "@type": "Organization", "name": laboratory.name}
        if laboratory.email:
            organisation["email"] = laboratory.email
        if place := ", ".join(part for part in (laboratory.city, laboratory.country) if part):
            organisation["address"] = place
        found.append(organisation)
    if laboratory.operator:
        person: dict[str, Any] = {"@id": "#operator", "@type": "Person", "name": laboratory.operator}
        found.append(person | ({"affiliation": {"@id": "#laboratory"}} if laboratory.name else {}))
    return found


def _file(file: CrateFile) -> dict[str, Any]:
    ending = file.name[file.name.rfind(".") :]
    found: dict[str, Any] = {
        "@id": _address(file.name),
        "@type": "File",
        "name": file.name,
        "encodingFormat": _FORMATS.get(ending) or mimetypes.guess_type(file.name)[0] or "application/octet-stream",
    }
    if about := _ABOUT.get(file.name):
        found["description"] = about
    if file.sha256:
        found |= {"sha256": file.sha256, "contentSize": str(file.size)}
    return found


def _input(number: int, entry: Mapping[str, str]) -> dict[str, Any]:
    """A file that a run was made from and that lies elsewhere."""
    return {"@id": f"#input-{number}", "@type": "CreativeWork", "name": entry["file"], "description": entry["what"]} | (
        {"sha256": entry["sha256"]} if entry["sha256"] else {}
    )


def _instruments(c: Certificate) -> list[dict[str, Any]]:
    found = []
    for k, instrument in enumerate(c.instruments, 1):
        one = {"@id": f"#instrument-{k}", "@type": "IndividualProduct", "name": instrument.kind}
        told = {"manufacturer": instrument.maker, "model": instrument.model, "serialNumber": instrument.serial}
        words = {"last calibration": instrument.calibrated, "class": instrument.accuracy_class}
        told["description"] = ", ".join(f"{what} {value}" for what, value in words.items() if value)
        found.append(one | {key: value for key, value in told.items() if value})
    return found


def _software(c: Certificate) -> list[dict[str, Any]]:
    """The program in every version that wrote into the run."""
    versions = dict.fromkeys(command["version"] for command in c.origin.commands)
    return [
        {
            "@id": f"#calib-{quote(version, safe='')}",
            "@type": "SoftwareApplication",
            "name": PROGRAM,
            "softwareVersion": version,
            "description": ", ".join(f"{name} {number}" for name, number in c.calibrated_with.items()),
        }
        for version in versions
    ]


def _actions(c: Certificate, files: tuple[CrateFile, ...]) -> list[dict[str, Any]]:
    """What was done: the measurement, if it is told with what, and every command."""
    found: list[dict[str, Any]] = []
    inputs = [{"@id": f"#input-{k}"} for k in range(1, len(c.origin.inputs) + 1)]
    agent = {"agent": {"@id": "#operator"}} if c.laboratory.operator else {}
    if c.instruments:
        measured: dict[str, Any] = {"@id": "#measurement", "@type": "Action", "name": "measurement"}
        measured["instrument"] = _one_or_all([{"@id": f"#instrument-{k}"} for k in range(1, len(c.instruments) + 1)])
        lab = [at for at, entry in zip(inputs, c.origin.inputs, strict=True) if entry["what"] == "lab file"]
        days = {"startTime": c.laboratory.measured, "endTime": c.laboratory.measured_until}
        found.append({**measured, "result": _one_or_all(lab), **{key: day for key, day in days.items() if day}, **agent})
    of_certificate = [{"@id": _address(file.name)} for file in files if not file.sha256]
    commands = c.origin.commands
    written = files_of_commands([command["text"] for command in commands[:-1]], [file.name for file in files if file.sha256])
    there: list[dict[str, str]] = []
    for k, command in enumerate(commands, 1):
        made: dict[str, Any] = {
            "@id": f"#command-{k}",
            "@type": "CreateAction",
            "name": command["text"],
            "description": "command that wrote into this folder",
            "endTime": command["at"],
            "instrument": {"@id": f"#calib-{quote(command['version'], safe='')}"},
        }
        results = [{"@id": _address(name)} for name in written[k - 1] or ()] if k <= len(written) else of_certificate
        used = list(there) or inputs
        there += results
        told = {"object": used, "result": results}
        found.append({**made, **{key: _one_or_all(entries) for key, entries in told.items() if entries}, **agent})
    return found


def files_of_commands(commands: Sequence[str], names: Sequence[str]) -> list[list[str] | None]:
    """Which files of a run each command wrote that a later one did not write anew; None where no results come of it.

    Results come of commands that make draws, and of others as long as something of theirs is there.

    Parameters
    ----------
    commands : in their order.
    names : of the files.

    >>> files_of_commands(["calib calibrate x.toml -o R", "calib next R", "calib verify R"], ["posterior.nc", "next.json"])
    [['posterior.nc'], ['next.json'], None]
    """
    left, written = list(names), list[list[str] | None]()
    for text in reversed(commands):
        words = text.split()
        kind = words[1] if len(words) > 1 and words[0] == "calib" else ""
        makes = kind in _MAKING
        # What calibrates once more, to go on or to take the experiment anew, leaves advice as it was.
        own = [name for name in left if (name not in _ADVICE if makes else name in _WRITTEN_BY.get(kind, ()))]
        left = [name for name in left if name not in own]
        written.append(own if own or makes else None)
    return written[::-1]


def _one_or_all(entries: list[dict[str, str]]) -> object:
    """Entries of a property, as JSON-LD has them: one of them stands alone."""
    return entries[0] if len(entries) == 1 else entries


def _address(name: str) -> str:
    return quote(name)

"""The folder of a run as an RO-Crate, read by the library of the people who made RO-Crate."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from rocrate.rocrate import ROCrate

from calib.checks import Verdict
from calib.experiment import Instrument, Laboratory
from calib.report import CrateFile, Origin, certify, crate_json
from calib.sampling import Posterior

FILES = (CrateFile("posterior.nc", "ab" * 32, 7), CrateFile("members/a b.nc", "cd" * 32, 3), CrateFile("certificate.json"))
SAID = Laboratory("Soft Sensors", "A. Person", "a@b.org", "Auckland", "NZ", "", "2026-03-17", "2026-03-18")
COMMANDS = tuple({"text": f"calib {word}", "at": "2026-11-23T00:00:00+00:00", "version": "0.1.0"} for word in ("one", "two"))
INPUTS = (
    {"what": "experiment", "file": "experiment.toml", "sha256": "ef" * 32},
    {"what": "lab file", "file": "force.csv", "sha256": "01" * 32},
)


@pytest.fixture
def read(make_posterior: Callable[..., Posterior], tmp_path: Path) -> Callable[..., ROCrate]:
    """Function that writes a crate with its files, and reads it with rocrate."""

    def made(laboratory: Laboratory, instruments: tuple[Instrument, ...]) -> ROCrate:
        posterior = make_posterior()
        experiment = replace(posterior.experiment, laboratory=laboratory, instruments=instruments)
        origin = Origin(("surrogate",), COMMANDS, INPUTS, "text", {"python": "3"})
        certificate = certify(replace(posterior, experiment=experiment), Verdict(), origin, "2026-11-23T00:00:00+00:00")
        for file in FILES:
            (tmp_path / file.name).parent.mkdir(exist_ok=True)
            (tmp_path / file.name).write_text("x")
        (tmp_path / "ro-crate-metadata.json").write_text(crate_json(certificate, FILES), encoding="utf-8")
        return ROCrate(tmp_path)

    return made


def test_it_tells_what_was_made_by_whom_from_what_and_how(read: Callable[..., ROCrate]) -> None:
    crate = read(SAID, (Instrument("load cell", "Instron", "2530", "12345", "2026-01-12", "0.5"),))
    assert crate.name == "Padded sensor, two specimens"
    assert crate.root_dataset["author"]["name"] == "A. Person"
    assert crate.root_dataset["publisher"]["name"] == "Soft Sensors"
    assert crate.root_dataset["conformsTo"].id == "https://w3id.org/ro/wfrun/process/0.5"
    assert {e.id for e in crate.data_entities} == {"posterior.nc", "members/a%20b.nc", "certificate.json"}
    assert crate.get("posterior.nc")["sha256"] == "ab" * 32
    first, last = crate.get("#command-1"), crate.get("#command-2")
    assert (first["name"], last["name"]) == ("calib one", "calib two")
    assert first["instrument"]["softwareVersion"] == "0.1.0"
    assert [e["name"] for e in first["object"]] == ["experiment.toml", "force.csv"]
    assert last["result"].id == "certificate.json"
    assert crate.get("#measurement")["instrument"]["serialNumber"] == "12345"
    assert crate.get("#measurement")["result"]["sha256"] == "01" * 32


_CALIBRATE, _RECOMMEND, _NEXT = "calib calibrate a.toml -o RUN", "calib recommend RUN --force 10", "calib next RUN"


@pytest.mark.parametrize(
    ("texts", "written"),
    [
        (
            (_CALIBRATE, _RECOMMEND, _NEXT, "calib certificate RUN"),
            (["posterior.nc", "summary.json"], ["recommendation.json"], ["report.html", "next.json"]),
        ),
        (
            (_RECOMMEND, _NEXT, f"{_CALIBRATE} --resume", "calib certificate RUN"),
            (["recommendation.json"], ["next.json"], ["posterior.nc", "summary.json", "report.html"]),
        ),
    ],
    ids=["one after the other", "advice is kept where a run is gone on with"],
)
def test_each_file_is_of_the_command_that_wrote_it_last(
    make_posterior: Callable[..., Posterior], texts: tuple[str, ...], written: tuple[list[str], ...]
) -> None:
    commands = tuple({"text": text, "at": "2026-11-23T00:00:00+00:00", "version": "0.1.0"} for text in texts)
    names = ("posterior.nc", "summary.json", "report.html", "recommendation.json", "next.json")
    files = (*(CrateFile(name, "ab" * 32, 1) for name in names), CrateFile("certificate.json"))
    origin = Origin(("surrogate",), commands, INPUTS, "text", {"python": "3"})
    certificate = certify(make_posterior(), Verdict(), origin, "2026-11-23T00:00:00+00:00")
    graph = {entity["@id"]: entity for entity in json.loads(crate_json(certificate, files))["@graph"]}

    def ids(value: dict[str, str] | list[dict[str, str]]) -> list[str]:
        return [entry["@id"] for entry in (value if isinstance(value, list) else [value])]

    actions = [graph[f"#command-{k}"] for k in (1, 2, 3, 4)]
    assert [ids(action["result"]) for action in actions] == [*written, ["certificate.json"]]
    assert ids(actions[0]["object"]) == ["#input-1", "#input-2"]
    assert [ids(action["object"]) for action in actions[1:]] == [
        written[0],
        [*written[0], *written[1]],
        [n for w in written for n in w],
    ]


@pytest.mark.parametrize("said", [Laboratory(), SAID])
def test_every_entity_that_is_named_is_there_and_no_list_has_one_entry(
    read: Callable[..., ROCrate], said: Laboratory, tmp_path: Path
) -> None:
    read(said, ())
    graph = json.loads((tmp_path / "ro-crate-metadata.json").read_text(encoding="utf-8"))["@graph"]
    known = [entity["@id"] for entity in graph]
    assert len(set(known)) == len(known)

    def named(value: object) -> list[str]:
        if isinstance(value, dict):
            return [value["@id"]]
        return [name for entry in value for name in named(entry)] if isinstance(value, list) else []

    for entity in graph:
        for key, value in entity.items():
            assert not (isinstance(value, list) and len(value) == 1), (entity["@id"], key)
            assert {name for name in named(value) if name != "https://w3id.org/ro/crate/1.1"} <= set(known), key

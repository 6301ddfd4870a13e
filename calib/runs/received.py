"""A certificate without its run in, as a customer gets it, what can be told of it and what cannot out."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from calib.errors import Fault, InputError, in_shell_path
from calib.experiment import Laboratory
from calib.files import sha256_of
from calib.regular import bytes_of
from calib.report import CERTIFICATE_KINDS
from calib.runs.certified import NOT_ONE, Finding, NotOfThisRunError, certificate_content, check_signature, require_itself
from calib.runs.listing import CERTIFICATE, CERTIFICATES, CHECKPOINT, LISTING, POSTERIOR, SIGNATURE
from calib.signature import PublicKey
from calib.visible import shortened

# Bytes of the largest certificate: it holds the text of an experiment file.
_LARGEST = 50_000_000
# Letters of what it says that it is.
_LONGEST = 600


@dataclass(frozen=True)
class Received:
    """What was found of a certificate without its run.

    Attributes
    ----------
    findings : file by file, the certificate and its signature first.
    says : what the certificate says that it is, in a line; "" where it is none.
    untold : what cannot be told without the run, or without the key, in sentences.
    authentic : whether it is signed with the key that was given.
    """

    findings: tuple[Finding, ...]
    says: str
    untold: tuple[str, ...]
    authentic: bool


def is_received(path: Path) -> bool:
    """Whether a path is a certificate without its run: a file, or a folder with files of a certificate and of no run.

    Parameters
    ----------
    path : that was given.
    """
    if path.is_dir():
        of_run = any((path / name).exists() for name in (LISTING, CHECKPOINT, POSTERIOR))
        return not of_run and any((path / name).exists() for name in CERTIFICATES)
    return path.is_file()


def verify_certificate(path: Path | str, public_key: PublicKey | None = None) -> Received:
    """Check what can be checked of a certificate without its run: itself, its signature, and the files beside it that it names.

    Only the signature tells who wrote it: checksum, number and hashes tell of accidents, and whoever changes a file can make
    them anew.

    Parameters
    ----------
    path : of certificate.json, or of the folder that it lies in.
    public_key : of the laboratory that it has to be signed by; None if that is not asked for.

    Returns
    -------
    What was found.

    Raises
    ------
    InputError
        If the file is something else.
    """
    path = Path(path)
    if path.is_dir():
        path = path / CERTIFICATE
    if not path.is_file():
        note = "it holds the hashes of the others: ask the laboratory for it"
        return Received((Finding(path.name, "missing", note),), "", (), authentic=False)
    data = _data(path)
    signed = check_signature(path, public_key)
    findings = [] if signed is None else [signed]
    content: dict[str, Any] = {}
    try:
        content, _ = certificate_content(data)
        require_itself(content)
        _require_text(content)
        says = _says(content)
        others = list(_beside(path, content["files"]))
        absent = [name for name in content["files"] if not (path.parent / name).is_file()]
        own = Finding(path.name, "fine", "" if signed is not None else "not signed")
    except NotOfThisRunError as error:
        own = Finding(path.name, error.state, error.note)
    except NOT_ONE as error:
        own = Finding(path.name, "changed", f"it is no certificate as it was written ({error})")
    if own.state != "fine":
        return Received((own, *findings), "", (), authentic=False)
    authentic = public_key is not None and signed is not None and signed.state == "fine"
    return Received((own, *findings, *others), says, tuple(_untold(path.parent, absent, public_key, signed)), authentic)


def _require_text(content: Mapping[str, Any]) -> None:
    """Refuse a certificate that names another experiment, laboratory or instruments than the experiment's text in it does."""
    text = content["experiment"]["text"]
    if text is None:
        return
    tables = tomllib.loads(text)
    laboratory = dict(tables.get("laboratory", {}))
    days = laboratory.pop("measured", "")
    first, last = days if isinstance(days, list) else (days, days)
    said = Laboratory(**{key: str(value).strip() for key, value in laboratory.items()}, measured=str(first).strip())
    instruments = tables.get("instruments", [])
    told = {
        "name": str(tables.get("name", content["name"])).strip(),
        "laboratory": asdict(replace(said, measured_until=str(last).strip())),
        "instruments": [{key: str(value).strip() for key, value in one.items() if value} for one in instruments],
        "specimens": [specimen["name"] for specimen in tables["specimens"]],
    }
    for name, is_so in told.items():
        if content[name] != is_so:
            raise NotOfThisRunError("changed", f"its {name} is not that of the experiment's text in it")


def _data(path: Path) -> bytes:
    """The bytes of a certificate.

    Raises
    ------
    InputError
        If the file is something else, by its name or by what it says that it is.
    """
    advice = f"Give {CERTIFICATE}, or the folder of a run"
    if path.suffix != ".json":
        raise InputError(Fault(f"this is not a {CERTIFICATE}", path, advice=advice))
    data = bytes_of(path, _LARGEST, "a certificate")
    try:
        content = json.loads(data)
    except (ValueError, RecursionError):
        return data
    if isinstance(content, dict) and content.get("kind") not in CERTIFICATE_KINDS.values() and "results" not in content:
        raise InputError(
            Fault(f"this is no certificate: it says that it is a {shortened(str(content.get('kind')))}", path, advice=advice)
        )
    return data


def _says(content: Mapping[str, Any]) -> str:
    """What a certificate says that it is: title, number, of what, issued when; one line, whatever it holds."""
    of = ", ".join(content["specimens"])
    said = f'{content["title"]}, No. {content["number"]}, of "{content["name"]}" ({of}), issued {content["issued"][:10]}'
    return shortened(said, _LONGEST)


def _beside(path: Path, named: Mapping[str, str]) -> list[Finding]:
    """The files beside a certificate that it names, and those of a certificate that it does not name."""
    own = (path.name, f"{path.name}{SIGNATURE.removeprefix(CERTIFICATE)}")
    strange = [name for name in CERTIFICATES if name not in (*own, *named, CERTIFICATE, SIGNATURE)]
    found = []
    for name in (*named, *strange):
        file = path.parent / name
        if file.is_file():
            same = sha256_of(file) == named.get(name)
            found.append(Finding(name, "fine" if same else "changed", "" if same else f"not the one of {path.name}"))
    return found


def _untold(folder: Path, absent: list[str], key: PublicKey | None, signed: Finding | None) -> list[str]:
    told = []
    if key is None:
        how = "it is not signed" if signed is None else "give the laboratory's own key with --public-key"
        told.append(
            f"who wrote it: {how}. Whoever changes a certificate can make its checksum, its number and all hashes anew, "
            "and nothing here would show it"
        )
    if absent:
        told.append(f"whether {', '.join(absent)} are as they were: not here, and it has their hashes")
    here = (folder / LISTING).is_file()
    how = f"`calib verify {in_shell_path(folder)}` does" if here else "that takes the run, which stays with the laboratory"
    told.append(f"whether its model, its verdict and its results are those of the draws and of the lab files: {how}")
    return told

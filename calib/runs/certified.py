"""A run folder with a certificate in, whether that is of this run, whole and signed by whom it should be, out."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from calib.checks import Colour
from calib.errors import InputError
from calib.experiment import keys_of
from calib.files import sha256_of
from calib.records import exact_record_from_text
from calib.report import CERTIFICATE_FORMAT, CERTIFICATE_KINDS, certificate_number, certified_models, results_of
from calib.runs.folder import Run
from calib.runs.listing import CERTIFICATE, CERTIFICATES, MEMBERS, POSTERIOR, RESULTS, SIGNATURE, SUMMARIES, Listing
from calib.signature import PublicKey, fault_of, read_signature
from calib.visible import shortened

State = Literal["fine", "changed", "missing", "not finished", "stale"]

#: What a file that is no certificate fails of.
NOT_ONE = (KeyError, TypeError, ValueError, AttributeError, OSError, RecursionError)

_AGAIN = "issue it again with `calib certificate RUN`"
_BEST_FIRST = ("green", "amber", "red")

# How the name of a signature goes on after that of what it is of, and what may be a file of a run.
_SIGNED = SIGNATURE.removeprefix(CERTIFICATE)
_MEMBER = re.compile(rf"{MEMBERS}/[^/\\\n]+")

# Quantiles of the same draws, summed in another order.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Finding:
    """One file of a run, or one that it was made from: whether it is as it was, and what is to be said of it."""

    name: str
    state: State
    note: str = ""


class NotOfThisRunError(Exception):
    """Why a certificate is not one of the run that it lies in, or none at all: it is stale, or was changed."""

    def __init__(self, state: State, note: str) -> None:
        self.state, self.note = state, note
        super().__init__(note)


def check_certificate(folder: Path, listing: Listing, run: Run | None) -> dict[str, Finding]:
    """Hold a certificate against the run that it lies in, file by file and number by number.

    Parameters
    ----------
    folder : of the run.
    listing : what its `run.json` says.
    run : as loaded; None if it cannot be, and numbers are not compared.

    Returns
    -------
    Name of a file -> what was found, of those that are not fine and of results that it does not cover.
    """
    path = folder / CERTIFICATE
    if not path.is_file():
        return {}
    try:
        content, colour = certificate_content(path.read_bytes())
        wrong = {name: Finding(name, "changed", f"not the one of {CERTIFICATE}") for name in _others_changed(folder, content)}
        _require_own(folder, content, listing)
        if run is not None:
            _require_numbers(content, colour, run)
    except NotOfThisRunError as error:
        return {CERTIFICATE: Finding(CERTIFICATE, error.state, error.note)}
    except NOT_ONE as error:
        return {CERTIFICATE: Finding(CERTIFICATE, "changed", f"it is no certificate as it was written ({error})")}
    later = [name for name in RESULTS if name not in (*content["files"], *CERTIFICATES) and (folder / name).is_file()]
    return wrong | {name: Finding(name, "fine", "made after the certificate, which does not cover it") for name in later}


def check_signature(certificate: Path, key: PublicKey | None) -> Finding | None:
    """Say who signed a certificate; None if nobody did and nobody is asked for.

    Parameters
    ----------
    certificate : its certificate.json; the signature lies beside it, under its name and .minisig.
    key : of the laboratory that it should be signed by; None if any will do, and none is checked.

    Raises
    ------
    InputError
        If it is to be checked, and the package cryptography is not installed.
    """
    path = certificate.with_name(f"{certificate.name}{_SIGNED}")
    if not path.is_file() or not certificate.is_file():
        if key is None:
            return None
        note = f"{certificate.name} is not signed" if certificate.is_file() else "nothing is certified"
        return Finding(path.name, "missing", note)
    try:
        signature = read_signature(path)
    except InputError as error:
        return Finding(path.name, "changed", error.faults[0].message)
    if key is None:
        note = f"signed with the key {signature.name}, which is not checked: give the laboratory's own with --public-key"
        return Finding(path.name, "fine", note)
    content = certificate.read_bytes()
    if fault := fault_of(signature, content, key):
        return Finding(path.name, "changed", fault)
    return Finding(path.name, "fine", f"signed by {_signed_by(content)} with the key {key.name}, {signature.comment}")


def forwards_of(run: Run) -> tuple[str, ...]:
    """The forward model of a run by its content, or those of the models of an average.

    Parameters
    ----------
    run : as loaded.
    """
    models = run.posterior.diagnostics.models
    return tuple(f"{m.name}: {m.forward}" for m in models) if models else (run.forward.identity,)


def _signed_by(content: bytes) -> str:
    """Who a certificate says that it is from."""
    try:
        said = json.loads(content)["laboratory"]
        return ", ".join(said[key] for key in ("operator", "name") if said[key]) or "a laboratory that does not say its name"
    except (ValueError, KeyError, TypeError, RecursionError):
        return "whoever has it"


def certificate_content(data: bytes) -> tuple[dict[str, Any], Colour]:
    """Read what a certificate says, and the colour of its verdict, if it is whole by itself: checksum, number and text agree.

    Parameters
    ----------
    data : of certificate.json.

    Raises
    ------
    NotOfThisRunError
        If it is a certificate, but its parts do not belong together.
    KeyError, TypeError, ValueError, AttributeError, RecursionError
        If it is none as it was written.
    """
    text = data.decode("utf-8")
    kind = json.loads(text).get("kind")
    colour = next((colour for colour, name in CERTIFICATE_KINDS.items() if name == kind), None)
    if colour is None:
        raise ValueError(f"it is a {shortened(str(kind))}")
    content = exact_record_from_text(kind, CERTIFICATE_FORMAT, text)
    if content["verdict"]["colour"] != colour:
        raise ValueError(f"it is a {kind} with a verdict that is {content['verdict']['colour']}")
    if (content["results"] is None) != (colour == "red"):
        raise ValueError("it holds results where there are to be none, or none")
    experiment, named = content["experiment"], content["files"]
    if experiment["text"] is not None and hashlib.sha256(experiment["text"].encode()).hexdigest() != experiment["sha256"]:
        raise NotOfThisRunError("changed", "the text of the experiment in it is another")
    strange = [name for name in named if name not in RESULTS and not _MEMBER.fullmatch(name)]
    if strange or POSTERIOR not in named:
        raise NotOfThisRunError(
            "changed", f"it names {shortened(', '.join(strange))}" if strange else f"it is of no {POSTERIOR}"
        )
    if content["number"] != certificate_number(content):
        raise NotOfThisRunError("changed", "its number is not that of what it says")
    return content, colour


def _others_changed(folder: Path, content: Mapping[str, Any]) -> list[str]:
    """The page, the XML and the crate of a certificate, where they are not those that it names, or it names none."""
    named = content["files"]
    others = [name for name in CERTIFICATES if name not in (CERTIFICATE, SIGNATURE)]
    there = {name: sha256_of(folder / name) for name in others if (folder / name).is_file()}
    return [name for name, digest in there.items() if named.get(name) != digest]


def _require_own(folder: Path, content: Mapping[str, Any], listing: Listing) -> None:
    """Refuse a certificate of another run, or of what the files of this run were before."""
    if content["fingerprint"] != listing.fingerprint:
        raise NotOfThisRunError("changed", "it is of another run")
    inputs = [{"what": e.what, "file": Path(e.file).name, "sha256": e.sha256} for e in listing.inputs]
    if content["inputs"] != inputs:
        raise NotOfThisRunError("stale", f"the run has been made from other files since: {_AGAIN}")
    for name, digest in content["files"].items():
        path = folder / name
        if name in CERTIFICATES:
            if not path.is_file():
                raise NotOfThisRunError("stale", f"{name}, which it names, is not there: {_AGAIN}")
        elif not path.is_file() or sha256_of(path) != digest:
            raise NotOfThisRunError("stale", f"it is not of the {name} that is here: {_AGAIN}")


def _require_numbers(content: Mapping[str, Any], colour: Colour, run: Run) -> None:
    """Refuse a certificate that says other numbers than the posterior, or a better verdict than the summary."""
    posterior = run.posterior
    if content["experiment"]["sha256"] != posterior.experiment.sha256:
        raise NotOfThisRunError("stale", f"it is of another experiment file: {_AGAIN}")
    summary = json.loads((run.folder / SUMMARIES[0]).read_text(encoding="utf-8"))["verdict"]["colour"]
    worst = max(summary, "green" if posterior.diagnostics.converged else "red", key=_BEST_FIRST.index)
    if _BEST_FIRST.index(colour) < _BEST_FIRST.index(worst):
        raise NotOfThisRunError("changed", f"it says {colour}, and the verdict on this calibration is {worst}")
    experiment = posterior.experiment
    facts = {
        "laboratory": asdict(experiment.laboratory),
        "instruments": [keys_of(instrument) for instrument in experiment.instruments],
        "name": experiment.name,
        "seed": posterior.seed,
        "converged": posterior.diagnostics.converged,
        "open_models": list(certified_models(posterior, colour)),
        "forward_model": list(forwards_of(run)),
    }
    for fact, is_so in facts.items():
        if content[fact] != is_so:
            raise NotOfThisRunError("changed", f"its {fact.replace('_', ' ')} is not that of the run")
    if content["results"] is None:
        return
    expected = {value.name: value for value in results_of(posterior)}
    found = {value["name"]: value for value in content["results"]}
    if found.keys() != expected.keys():
        raise NotOfThisRunError("changed", "it holds other results than the posterior")
    for name, value in expected.items():
        said = found[name]
        pairs = [(said["value"], value.value), (said["standard_uncertainty"], value.standard_uncertainty)]
        pairs += zip(said["interval_95"], value.interval_95, strict=True)
        if said["unit"] != value.unit or not all(math.isclose(a, b, rel_tol=_ROUNDING) for a, b in pairs):
            raise NotOfThisRunError("changed", f"its {name} is not that of the posterior")

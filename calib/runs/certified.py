"""A run folder with a certificate in, whether that is of this run, whole and signed by whom it should be, out."""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from calib.checks import Colour, Verdict, verdict_from_plain, verdict_of
from calib.errors import InputError
from calib.files import sha256_of
from calib.provenance import commit, platform_in_words, versions
from calib.records import exact_record_from_text
from calib.report import (
    CERTIFICATE_FORMAT,
    CERTIFICATE_KINDS,
    DAY_GATE,
    Certificate,
    CrateFile,
    Origin,
    certificate_json,
    certificate_number,
    certificate_page,
    certified_content,
    certified_models,
    certify,
    crate_json,
    dcc_gaps,
    dcc_xml,
    follows_from_itself,
    results_of,
)
from calib.runs.folder import Run
from calib.runs.listing import (
    CERTIFICATE,
    CERTIFICATES,
    CERTIFIED,
    CRATE,
    DCC,
    LISTING,
    MEMBERS,
    PAGE_OF_IT,
    POSTERIOR,
    REPORT,
    RESULTS,
    SIGNATURE,
    SUMMARIES,
    Listing,
)
from calib.signature import PublicKey, fault_of, read_signature
from calib.visible import shortened, visible

State = Literal["fine", "not checked", "changed", "missing", "not finished", "stale"]

#: What a certificate says that comes of no result of its run.
_UNTOLD = "when it was issued, and with which versions"

#: What a file that is no certificate fails of.
NOT_ONE = (KeyError, TypeError, ValueError, AttributeError, OSError, RecursionError)

_AGAIN = "issue it again with `calib certificate RUN`"
_BEST_FIRST = ("green", "amber", "red")

# How the name of a signature goes on after that of what it is of, and what may be a file of a run.
_SIGNED = SIGNATURE.removeprefix(CERTIFICATE)
_MEMBER = re.compile(rf"{MEMBERS}/[^/\\\n]+")

# What of a certificate comes of the rest of it: what is told if both are not right.
_OF_THE_REST = ("title", "statement", "not_said", "number")

# Quantiles of the same draws, summed in another order.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Finding:
    """One file of a run, or one that it was made from: whether it is as it was, and what is to be said of it."""

    name: str
    state: State
    note: str = ""

    @property
    def wrong(self) -> bool:
        """Whether the file is not as it was; of a signature that was not checked nothing is known."""
        return self.state not in ("fine", "not checked")


class NotOfThisRunError(Exception):
    """Why a certificate is not one of the run that it lies in, or none at all: it is stale, was changed, or cannot be told."""

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
            wrong = _require_own_words(folder, content, listing, run) | wrong
        require_itself(content)
        _require_issued(content, listing)
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
        note = f"said to be signed with the key {signature.name}: give the laboratory's own with --public-key"
        return Finding(path.name, "not checked", note)
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


def require_itself(content: Mapping[str, Any]) -> None:
    """Refuse a certificate whose title, statement or list of what is not said does not follow from the rest of it.

    Parameters
    ----------
    content : of certificate.json.

    Raises
    ------
    NotOfThisRunError
        If so.
    KeyError, TypeError, ValueError
        If it is none as it was written.
    """
    for name, is_so in follows_from_itself(content).items():
        if content[name] != is_so:
            raise NotOfThisRunError("changed", f"its {_called(name)} is not what follows from the rest of it")


def _others_changed(folder: Path, content: Mapping[str, Any]) -> list[str]:
    """The page, the XML and the crate of a certificate, where they are not those that it names, or it names none."""
    named = content["files"]
    others = [name for name in CERTIFICATES if name not in (CERTIFICATE, SIGNATURE)]
    there = {name: sha256_of(folder / name) for name in others if (folder / name).is_file()}
    return [name for name, digest in there.items() if named.get(name) != digest]


def unsigned_in_words(listing: Listing) -> str:
    """What nobody answers for in the certificate of a run that is not signed.

    Parameters
    ----------
    listing : what the run's `run.json` says.
    """
    if CERTIFIED in listing.attrs:
        return f"not signed: {_UNTOLD}, is held by its number in {LISTING} alone, and who wrote both by nothing"
    return f"not signed: nothing tells {_UNTOLD}, all else is what the run says"


def _require_issued(content: Mapping[str, Any], listing: Listing) -> None:
    """Refuse a certificate that is not, to the last word, the one that was issued last for its run."""
    issued = listing.attrs.get(CERTIFIED, content["number"])
    if content["number"] != issued:
        said = f"it is not the one that was issued for this run, No. {issued}: {_UNTOLD}, or a word of it, is another"
        raise NotOfThisRunError("changed", said)


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
            if listing.files.get(name) == digest:
                note = f"it is of the {name} that the run wrote, which is not the one that is here: put that back"
                raise NotOfThisRunError("not checked", note)
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
    if content["open_models"] != list(certified_models(posterior, colour)):
        raise NotOfThisRunError("changed", "its open models are not those of the run")
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


def _require_own_words(folder: Path, content: Mapping[str, Any], listing: Listing, run: Run) -> dict[str, Finding]:
    """Refuse a certificate that says anything else than the run's own files; find its pages that do.

    All of it is made again, as when it was issued, from the posterior, the verdict and the lists of the run; what no file of
    the run tells (`_UNTOLD`) is taken from the certificate, whose number the run knows.

    Returns
    -------
    Name of a page, of the XML or of the crate -> what was found, of those that are not what comes of it.
    """
    said = verdict_from_plain(content["verdict"])
    verdict = verdict_of(reason for reason in said.reasons if reason.gate != DAY_GATE)
    if not run.another_forward and _words(run.verdict) != _words(verdict):
        raise NotOfThisRunError("changed", "its verdict is not that of the run")
    if strange := _commands(content["commands"]) - _commands(asdict(command) for command in listing.commands):
        begun = {listing.attrs.get("command", ""), run.posterior.attrs.get("command", "")}
        if not strange <= {visible(command) for command in begun}:
            raise NotOfThisRunError("changed", f"the run knows of no command `{shortened(min(strange))}`")
    origin = Origin(
        forward=forwards_of(run),
        commands=tuple(content["commands"]),
        inputs=tuple({"what": e.what, "file": Path(e.file).name, "sha256": e.sha256} for e in listing.inputs),
        text=content["experiment"]["text"],
        software=content["certified_with"],
    )
    made = certify(run.posterior, verdict, origin, content["issued"])
    if content["results"] is not None:
        pairs = zip(content["results"], made.results, strict=True)
        if any((said["label"], said["of"], said["learned"]) != (v.label, v.of, v.learned) for said, v in pairs):
            raise NotOfThisRunError("changed", "what it says beside its results is not that of the run")
    expected = certified_content(made)
    for name in sorted(expected, key=lambda name: name in _OF_THE_REST):
        if name != "results" and content[name] != expected[name]:  # results were compared as numbers
            raise NotOfThisRunError("changed", f"its {_called(name)} is not that of the run")
    if content["certified_with"] != made_with():  # which may lay it out in another way
        note = "not made again here, as it was issued with other versions: held by its hash in the certificate"
        return {name: Finding(name, "fine", note) for name in (PAGE_OF_IT, DCC, CRATE) if (folder / name).is_file()}
    of_run = {name: digest for name, digest in content["files"].items() if name not in CERTIFICATES}
    one, other = (certificate_texts(folder, made, of_run, signed=signed) for signed in (True, False))
    note = "it is not what comes of the certificate"
    return {
        name: Finding(name, "changed", note)
        for name in one
        if name != CERTIFICATE and (path := folder / name).is_file()
        if path.read_bytes() not in (one[name].encode(), other[name].encode())
    }


def _words(verdict: Verdict) -> set[tuple[str, str, str]]:
    """What a verdict says but for numbers, whose last digits another machine may round to the other side; without inputs.

    Files that a run was made from may have been changed, or put back, since: that is told of themselves.
    """
    return {(r.gate, r.level, re.sub(r"\d[\d.,e+-]*", "0", r.in_words)) for r in verdict.reasons if r.gate != "inputs"}


def _commands(commands: Iterable[Mapping[str, str]]) -> set[str]:
    return {command["text"] for command in commands}


def _called(name: str) -> str:
    return name.replace("_", " ")


def made_with() -> dict[str, str]:
    """What this program is, by name: versions of it and of the libraries that decide, platform, and commit where it has one."""
    return versions() | {"platform": platform_in_words()} | ({"commit": of_clone} if (of_clone := commit()) else {})


def certificate_texts(folder: Path, certificate: Certificate, of_run: Mapping[str, str], *, signed: bool) -> dict[str, str]:
    """The files of a certificate but its signature: name -> text.

    Parameters
    ----------
    folder : of the run.
    certificate : as made.
    of_run : the results in the folder -> SHA-256.
    signed : whether it gets a signature.
    """
    texts = {PAGE_OF_IT: certificate_page(certificate, of_run[POSTERIOR], of_run.get(REPORT, ""))}
    if not dcc_gaps(certificate):
        texts[DCC] = dcc_xml(certificate)
    named = [*texts, CERTIFICATE, *([SIGNATURE] if signed else []), LISTING]
    inside = [CrateFile(name, digest, (folder / name).stat().st_size) for name, digest in of_run.items()]
    texts[CRATE] = crate_json(certificate, (*inside, *(CrateFile(name) for name in named)))
    digests = {name: hashlib.sha256(text.encode()).hexdigest() for name, text in texts.items()}
    texts[CERTIFICATE] = certificate_json(certificate, {**of_run, **digests})
    return texts

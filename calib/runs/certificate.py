"""A finished run in, its certificate in its folder out: JSON, page, PTB's XML, RO-Crate, and a signature if asked for."""

from __future__ import annotations

import hashlib
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path

from calib.errors import Fault, InputError
from calib.files import require_writable, sha256_of, write_text
from calib.provenance import PROGRAM
from calib.report import Certificate, Origin, certify, files_of_commands
from calib.runs.advice import of_other_draws
from calib.runs.certified import certificate_texts, forwards_of, made_with
from calib.runs.folder import Run, owned_run, require_own_forward, unlisted
from calib.runs.listing import (
    CERTIFICATE,
    CERTIFICATES,
    CERTIFIED,
    EXPERIMENT,
    LISTING,
    MEMBERS,
    RESULTS,
    SIGNATURE,
    Command,
    Listing,
    read_listing,
    with_command,
    writing,
)
from calib.signature import SecretKey, sign
from calib.visible import visible


def certify_in(run: Run, *, key: SecretKey | None = None, command: str = "") -> Certificate:
    """Issue the certificate of a run and keep it there: certificate.json, .html, .xml, ro-crate-metadata.json, a signature.

    A run whose verdict is red gets a statement that says so first and holds no results. certificate.xml is written where the
    experiment file says what PTB's form asks for (`calib.report.dcc_gaps`). An earlier certificate is replaced.

    Parameters
    ----------
    run : the calibration; its files must be as they were written.
    key : of the laboratory, to sign with; None for no signature.
    command : the command line, kept with the run.

    Returns
    -------
    The certificate.

    Raises
    ------
    InputError
        If a file of the run is not as it was written, an advice in it is of other draws, the model is not the one that the run
        was calibrated with, or another process writes into the folder; nothing is written then.
    """
    require_own_forward(run)
    if not (run.folder / LISTING).is_file():
        advice = f"`calib report {run.folder}` makes it again; look at the files before you trust them"
        message = "run.json is not there: nothing tells whether the files of this run are as they were written"
        raise InputError(Fault(message, run.folder, advice=advice))
    for name in CERTIFICATES:
        require_writable(run.folder / name)
    command = command or "calib certificate"
    verdict = run.verdict
    with owned_run(run, command) as listing:
        _require_own_advice(run)
        of_run = _files_of(run.folder, listing)
        now = datetime.now(UTC)
        origin = _origin(run, with_command(listing, command))
        certificate = certify(run.posterior, verdict, origin, now.isoformat(timespec="seconds"))
        texts = certificate_texts(run.folder, certificate, of_run, signed=key is not None)
        if key is not None:
            colour = certificate.verdict.colour
            said = f"timestamp:{now.timestamp():.0f} file:{CERTIFICATE} number:{certificate.number} verdict:{colour}"
            texts[SIGNATURE] = sign(texts[CERTIFICATE].encode(), key, said)
        listing = replace(listing, attrs={**listing.attrs, CERTIFIED: certificate.number})
        with writing(run.folder, listing, (*CERTIFICATES, *unlisted(run.folder, listing)), command):
            for name in reversed(CERTIFICATES):  # a signature is never one of another certificate
                if name == SIGNATURE or name not in texts:
                    (run.folder / name).unlink(missing_ok=True)
            for name in CERTIFICATES:
                if name in texts:
                    write_text(run.folder / name, texts[name])
    return certificate


def _require_own_advice(run: Run) -> None:
    """Refuse to certify a report whose advice is of other draws.

    Raises
    ------
    InputError
        If so.
    """
    for name, note in of_other_draws(run).items():
        said, _, again = note.partition(": ")
        advice = f"{again[:1].upper()}{again[1:]}, and then certify"
        raise InputError(Fault(f"this advice was {said}, and nothing is certified", run.folder / name, advice=advice))


def _files_of(folder: Path, listing: Listing) -> dict[str, str]:
    """The results in a run folder with their hashes, all of them as they were written.

    Raises
    ------
    InputError
        If one is not.
    """
    members = sorted(name for name in listing.files if name.startswith(f"{MEMBERS}/"))
    found: dict[str, str] = {}
    for name in (*(name for name in RESULTS if name not in CERTIFICATES), *members):
        path = folder / name
        if not path.is_file() and name not in listing.files:
            continue
        found[name] = sha256_of(path) if path.is_file() else "gone"
        if listing.files.get(name) != found[name]:
            advice = f"Look at `calib verify {folder}`; `calib report {folder}` writes page and summary anew"
            raise InputError(Fault("this file is not as it was written, and nothing is certified", path, advice=advice))
    return found


def input_now(run: Run, what: str) -> tuple[Path | None, Path | None]:
    """Where a file that a run was made from is now, and where it was then.

    Parameters
    ----------
    run : as loaded.
    what : the file is: "experiment" or "surrogate".

    Returns
    -------
    Its path, None if it is at neither of the places where it may be; and that when the run was made, None if it had none.
    """
    listing = read_listing(run.folder)
    entries = [] if listing is None else [entry for entry in listing.inputs if entry.what == what]
    return (entries[0].found(run.folder), Path(entries[0].file)) if entries else (None, None)


def _origin(run: Run, listing: Listing) -> Origin:
    """How what is certified came about, by `run.json`, and the experiment file if it is still what it was."""
    posterior = run.posterior
    commands = listing.commands
    if begun := listing.attrs.get("command", "") if len(commands) < 2 else "":  # a folder of before they were kept
        attrs = posterior.attrs
        commands = (Command(visible(begun), attrs.get("ended", ""), attrs.get(f"version of {PROGRAM}", "")), *commands)
    written = files_of_commands([command.text for command in commands[:-1]], list(listing.files))
    commands = (*(c for c, own in zip(commands[:-1], written, strict=True) if own is not None), *commands[-1:])
    return Origin(
        forward=forwards_of(run),
        commands=tuple(asdict(command) for command in commands),
        inputs=tuple({"what": e.what, "file": Path(e.file).name, "sha256": e.sha256} for e in listing.inputs),
        text=_experiment_text(run.folder, listing, posterior.experiment.sha256),
        software=made_with(),
    )


def _experiment_text(folder: Path, listing: Listing, sha256: str) -> str | None:
    """The text of the experiment file, as the run has kept it or where it was; None if it is nowhere any more as it was."""
    places = [entry.found(folder) for entry in listing.inputs if entry.what == "experiment" and entry.sha256 == sha256]
    for path in (folder / EXPERIMENT, *places):
        if path is None or not path.is_file():
            continue
        content = path.read_bytes()
        if hashlib.sha256(content).hexdigest() == sha256:
            return content.decode("utf-8")
    return None

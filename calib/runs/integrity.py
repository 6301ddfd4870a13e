"""A run folder in, what of it and of what it was made from is still as it was, out."""

from __future__ import annotations

from pathlib import Path

from calib.errors import Fault, InputError
from calib.files import sha256_of
from calib.runs.advice import of_other_draws
from calib.runs.certified import Finding, check_certificate, check_signature, unsigned_in_words
from calib.runs.folder import Run, load_run
from calib.runs.listing import (
    CERTIFICATE,
    CHECKPOINT,
    LISTING,
    MEMBERS,
    POSTERIOR,
    RESULTS,
    SIGNATURE,
    Listing,
    checkpoint_names,
    read_listing,
)
from calib.runs.ownership import owner_of
from calib.sampling import kept_identity, whose_checkpoint
from calib.signature import PublicKey


def verify(folder: Path | str, public_key: PublicKey | None = None) -> tuple[Finding, ...]:
    """Hold every file of a run, and every file that it was made from, against the hashes in its `run.json`.

    A change of a single byte is found in any of them, `run.json` included. A certificate is held against the run that it lies
    in, too, and with the laboratory's key its signature against both. Needs no permission to write.

    Parameters
    ----------
    folder : of the run.
    public_key : of the laboratory that the certificate has to be signed by; None if it need not be.

    Returns
    -------
    What was found: `run.json`, inputs, forward model, results, checkpoint.

    Raises
    ------
    InputError
        If this is no run folder, or another process is writing into it.
    """
    folder = Path(folder)
    if not folder.is_dir() or not any((folder / name).exists() for name in (LISTING, CHECKPOINT, *RESULTS)):
        raise InputError(Fault("there is no run in this folder", folder, advice="Give the folder of `calib calibrate -o`"))
    if said := owner_of(folder):
        raise InputError(Fault(f"this folder is in use by {said}", folder, advice="Wait until it has ended"))
    try:
        listing = read_listing(folder)
    except InputError as error:
        return (Finding(LISTING, "changed", "; ".join(f.message for f in error.faults)),)
    if listing is None:
        return (Finding(LISTING, "missing", "nothing tells what the other files were"),)
    run, forward = _loaded(folder, listing)
    results = [name for name in RESULTS if name in listing.files or (folder / name).exists()]
    found = {name: _of_result(folder, name, listing) for name in (*_members(folder, listing), *results)}
    doubts = check_certificate(folder, listing, run)
    if signed := check_signature(folder / CERTIFICATE, public_key):
        doubts[SIGNATURE] = signed
    elif CERTIFICATE in found:
        doubts.setdefault(CERTIFICATE, Finding(CERTIFICATE, "fine", unsigned_in_words(listing)))
    if run is not None:
        doubts |= {name: Finding(name, "stale", note) for name, note in of_other_draws(run).items()}
    # What its own hash tells comes first: a file that is not as it was written is nobody's.
    found |= {name: doubt for name, doubt in doubts.items() if name not in found or found[name].state == "fine"}
    checkpoint = sorted({*checkpoint_names(folder), *(name for name in listing.files if name.startswith(f"{CHECKPOINT}/"))})
    return (
        _of_listing(listing),
        *_of_inputs(folder, listing),
        *forward,
        *found.values(),
        *(_of_checkpoint(folder, name, listing) for name in checkpoint),
    )


def _of_listing(listing: Listing) -> Finding:
    if not listing.unfinished:
        return Finding(LISTING, "fine")
    note = f'"{listing.unfinished}" has not come to its end: run it again, a calibration with --resume'
    return Finding(LISTING, "not finished", note)


def _of_inputs(folder: Path, listing: Listing) -> list[Finding]:
    found = []
    for entry in listing.inputs:
        path = entry.found(folder)
        if path is None:
            found.append(Finding(entry.file, "missing", f"{entry.what}, no longer there"))
        else:
            found.append(_compared(path, str(path), entry.sha256, entry.what))
    return found


def _loaded(folder: Path, listing: Listing) -> tuple[Run | None, tuple[Finding, ...]]:
    """The run, and its forward model by its numbers, wherever they come from; only a run that has ended says which it was."""
    if listing.files.get(POSTERIOR) is None or not listing.identity:
        return None, ()
    name = "forward model"
    path = folder / POSTERIOR
    if not path.is_file() or sha256_of(path) != listing.files[POSTERIOR]:
        return None, (Finding(name, "not checked", f"only {POSTERIOR} as the run wrote it tells which it was"),)
    try:
        run = load_run(folder)
    except InputError as error:
        return None, (Finding(name, "missing", f"cannot be told: {'; '.join(f.message for f in error.faults)}"),)
    return run, (Finding(name, "changed" if run.another_forward else "fine", run.another_forward or run.forward.name),)


def _members(folder: Path, listing: Listing) -> list[str]:
    """Names of the posteriors that an average is of, those that are not listed included."""
    there = (f"{MEMBERS}/{path.name}" for path in (folder / MEMBERS).glob("[!.]*"))
    return sorted({*there, *(name for name in listing.files if name.startswith(f"{MEMBERS}/"))})


def _of_result(folder: Path, name: str, listing: Listing) -> Finding:
    if name not in listing.files:
        note = "not written by a command that came to its end; `calib report RUN` lists it, if it is of this run"
        return Finding(name, "not finished" if listing.unfinished else "changed", note)
    path = folder / name
    return _compared(path, name, listing.files[name]) if path.is_file() else Finding(name, "missing")


def _of_checkpoint(folder: Path, name: str, listing: Listing) -> Finding:
    """A file of the checkpoint, which also says itself whether it is whole and whose it is: newer ones are not listed."""
    path = folder / name
    if not path.is_file():
        return Finding(name, "missing", "computed again by --resume")
    if name in listing.files:
        return _compared(path, name, listing.files[name], "computed again by --resume")
    own = whose_checkpoint(path) == listing.fingerprint
    if path.suffix == ".json":
        own = kept_identity(path.parent) == listing.identity
    if own:
        return Finding(name, "fine", "newer than the results: --resume goes on from it")
    return Finding(name, "changed", "damaged, or of another run: computed again by --resume")


def _compared(path: Path, name: str, sha256: str, note: str = "") -> Finding:
    try:
        same = sha256_of(path) == sha256
    except OSError as error:
        return Finding(name, "missing", f"cannot be read: {error.strerror}")
    return Finding(
        name, "fine" if same else "changed", note if not same or note in ("lab file", "experiment", "surrogate") else ""
    )

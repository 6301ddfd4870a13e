"""The command `verify`: a run folder or a certificate in, which files of it have changed and who signed it, on the screen."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import not_usable, refusing_bad_input, say
from calib.enumeration import first_of

if TYPE_CHECKING:
    from calib.runs import Finding, Received


def verify(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN", help="Folder of `calib calibrate` or `calib batch`, or a certificate.json without its run."
        ),
    ],
    public_key: Annotated[
        Path | None,
        typer.Option(metavar="FILE.pub", help="Key of the laboratory that the certificate must be signed with."),
    ] = None,
) -> None:
    """Check that nothing of a run, and nothing that it was made from, has changed since: every file against its hash.

    That is the experiment, the lab files, the surrogate, posterior, summary, recommendation, report and checkpoint, and
    run.json, which holds the hashes; of a batch its table and page, its lab files and the lot's posterior. A file that was
    moved away is missing, not changed; a run and its lab files may move together.

    A certificate is also held against the run: of another run it is changed, and stale if what it is of was written anew since.
    With --public-key it must be signed with that laboratory's key. Hashes tell of accidents; the signature tells who answers
    for all files of the run.

    Who gets a certificate without its run gives certificate.json, or a folder with the certificate's files alone: it is held
    against its own checksum and its signature, page and XML beside it against the hashes in it, and what cannot be told so is
    said. Without --public-key nothing tells who wrote it.

    Example: `calib verify run1 --public-key lab.pub`, `calib verify certificate.json --public-key lab.pub`

    Writes: nothing.

    Exit codes: 0 everything is as it was; 2 no run or certificate there, or another process is writing into it; 3 something
    has changed, is missing, stale, not signed with the key given, or was not written to its end, and saying what.
    """
    with refusing_bad_input():
        from calib.runs import is_batch, is_received, verify_batch, verify_certificate
        from calib.runs import verify as verify_run
        from calib.signature import read_public_key

        key = None if public_key is None else read_public_key(public_key)
        received = verify_certificate(run, key) if is_received(run) else None
        findings = received.findings if received is not None else verify_batch(run) if is_batch(run) else verify_run(run, key)
        blocks = [f for f in findings if f.name.startswith("checkpoint/") and f.state == "fine"]
        # A line each, the file last and never wrapped, so that it can be searched for and copied.
        for finding in findings:
            if finding not in blocks:
                say(f"{finding.state:<13} {finding.name}{f' ({finding.note})' if finding.note else ''}")
        if blocks:
            say(f"{'fine':<13} checkpoint ({len(blocks)} files)")
        wrong = [f for f in findings if f.wrong]
        unchecked = ". The signature was not checked: nothing tells who wrote them" * any(
            f.state == "not checked" for f in findings
        )
        if received is not None:
            _say_received(received, len(wrong))
        else:
            say(
                f"Not as written: {len(wrong)} of {len(findings)} files."
                if wrong
                else f"All {len(findings)} files are as they were{unchecked}."
            )
    if wrong:
        raise not_usable("; ".join(_said(state, names) for state, names in _by_state(wrong).items()))


#: What is said in the end of files that are not fine.
_STATES = {
    "changed": "not as written",
    "missing": "not there",
    "stale": "of what the run was before",
    "not finished": "not finished",
}


def _by_state(wrong: Sequence[Finding]) -> dict[str, list[str]]:
    return {state: names for state in _STATES if (names := [f.name for f in wrong if f.state == state])}


def _said(state: str, names: Sequence[str]) -> str:
    return f"{first_of(names)} {'is' if len(names) == 1 else 'are'} {_STATES[state]}"


def _say_received(received: Received, n_wrong: int) -> None:
    """Say what a certificate without its run is, what cannot be told of it, and the sum of it all."""
    n = len(received.findings)
    if n_wrong:
        say(f"Not as written: {n_wrong} of {n} files: do not rely on any of them.")
        return
    say(f"It says that it is: {received.says}.")
    for what in received.untold:
        say(f"Cannot be told here: {what}.")
    if received.authentic:
        say(f"All {n} files are as they were signed with the key given.")
    else:
        say(f"All {n} files agree with each other. Nothing tells who wrote them.")

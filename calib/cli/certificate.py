"""The commands `certificate` and `key new`: a finished run in, its certificate out, signed with a key of the laboratory."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import RunFolder, Strict, as_given, exit_by, loaded, refusing_bad_input, say, say_verdict
from calib.cli.signing import secret_key
from calib.errors import Fault, InputError, in_shell_path
from calib.files import require_writable, write_text
from calib.signature import PASSWORD

if TYPE_CHECKING:
    from calib.report import Certificate

_SECRET, _PUBLIC = ".key", ".pub"


def certificate(
    run: RunFolder,
    key: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Secret key to sign with, see `calib key new` [default: not signed].")
    ] = None,
    strict: Strict = False,
) -> None:
    """Issue the certificate of a run: results with uncertainties, verdict, who measured with what, all hashes.

    Who measured, when and with which instruments stands in the experiment file, in [laboratory] and [[instruments]]. What is
    not said there the certificate says it does not say. certificate.xml is PTB's Digital Calibration Certificate; it needs
    name, operator, country and measured in [laboratory]. It is no certificate of an accredited laboratory: docs/certificate.md.

    A run whose verdict is red gets a statement instead that says so first, and holds no results.

    Example: `calib certificate run1 --key lab.key`

    Writes: run1/certificate.html (to print), certificate.json, certificate.xml, ro-crate-metadata.json, and with a key
    certificate.json.minisig, which `calib verify run1 --public-key lab.pub` and minisign check.

    Exit codes: 0 done, the verdict green or amber; 2 bad input, or files that are not as they were written, nothing written;
    3 done, but the verdict is red, or with --strict amber.
    """
    with refusing_bad_input():
        from calib.report import dcc_gaps, status_in_words
        from calib.runs import certify_in

        secret = None if key is None else secret_key(key)
        found = loaded(run)
        made = certify_in(found, key=secret, command=as_given())
        say(f"{made.title}, No. {made.number}")
        say_verdict(made.verdict, status_in_words(made.verdict))
        for what in made.unsaid:
            say(f"  not said: {what}")
        if made.usable and (missing := dcc_gaps(made)):
            say(f"  no certificate.xml, which needs {', '.join(missing)}. {_how_to_add(made, run)}")
        names = [name for name in ("certificate.html", "certificate.json", "certificate.xml") if (run / name).is_file()]
        names += ["ro-crate-metadata.json", *(["certificate.json.minisig"] if secret is not None else [])]
        say(f"Written: {', '.join(str(run / name) for name in names)}")
        if secret is not None:
            again = f"calib verify {in_shell_path(run)} --public-key FILE.pub"
            say(f"Signed with the key {secret.public.name}. To check it: {again}")
    exit_by(made.verdict, strict)


def new_key(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE.key", help="File to write; must not exist yet.")],
    password: Annotated[bool, typer.Option("--password", help="Ask for a password that the key is kept under.")] = False,
) -> None:
    """Make a key pair of the laboratory to sign certificates with: FILE.key, to be kept secret, and FILE.pub, to be given away.

    Both are in the format of minisign (Ed25519), whose program can use them, too. Needs the extra `sign`. Where nobody can be
    asked for the password, it is taken from the environment variable CALIB_KEY_PASSWORD.

    Example: `calib key new -o lab.key --password`

    Writes: lab.key, which its owner alone may read, and lab.pub.

    Exit codes: 0 done; 2 a file of these names exists, or there is no place to write.
    """
    with refusing_bad_input():
        from calib.signature import new_key as make
        from calib.signature import public_key_text, secret_key_text

        if output.suffix != _SECRET:
            advice = f"Choose a name such as {in_shell_path(output.with_suffix(_SECRET))}"
            raise InputError(Fault(f"the name of a secret key ends in {_SECRET}", output, advice=advice))
        public = output.with_suffix(_PUBLIC)
        for path in (output, public):
            if os.path.lexists(path):
                raise InputError(Fault("exists and is not overwritten", path, advice="Choose another -o"))
            require_writable(path, "Create it, or choose another -o")
        key = make()
        write_text(output, secret_key_text(key, _new_password() if password else ""), mode=0o600)
        write_text(public, public_key_text(key.public))
        say(f"Written: {output}, to be kept secret and backed up, and {public}, to be given to who gets certificates.")
        say(f"The key is {key.public.name}.")


def _new_password() -> str:
    if given := os.environ.get(PASSWORD, ""):
        return given
    if not sys.stdin.isatty():
        raise InputError(Fault("--password: nobody can be asked for one", advice=f"Set {PASSWORD}"))
    return str(typer.prompt("New password", hide_input=True, confirmation_prompt=True, err=True))


def _how_to_add(made: Certificate, run: Path) -> str:
    """How a run learns what was added to its experiment file, which changes no draw."""
    words = f"calib calibrate {in_shell_path(Path(made.experiment[0]))} -o {in_shell_path(run)} --resume"
    return f"Add it to the experiment file, then: {words}"

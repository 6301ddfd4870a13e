"""The commands `certificate` and `key new`: a finished run in, its certificate out, signed with a key of the laboratory."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import RunFolder, Strict, as_given, exit_by, loaded, out, pasted, refusing_bad_input, say, say_verdict
from calib.cli.signing import secret_key
from calib.errors import Fault, InputError, in_shell_path
from calib.files import real_path, require_writable, write_text
from calib.signature import PASSWORD

if TYPE_CHECKING:
    from calib.runs import Run
    from calib.signature import SecretKey

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

    Writes: run1/certificate.html (to print), certificate.json, certificate.xml, and with a key certificate.json.minisig, which
    go to the customer, who checks them by `calib verify certificate.json --public-key lab.pub`, or minisign; and
    ro-crate-metadata.json, for archives of the whole folder.

    Exit codes: 0 done, the verdict green or amber; 2 bad input, or files that are not as they were written, nothing written;
    3 done, but the verdict is red, or with --strict amber.
    """
    with refusing_bad_input():
        from calib.report import dcc_gaps, status_in_words
        from calib.runs import certify_in, input_now

        secret = None if key is None else secret_key(key)
        found = loaded(run)
        made = certify_in(found, key=secret, command=as_given())
        say(f"{made.title}, No. {made.number}")
        how = how_to_add(found, input_now(found, "experiment"), input_now(found, "surrogate"))
        if made.missed:
            alone = "The verdict below is on the numbers alone. " if made.usable else ""
            none = "It names no laboratory. " if not made.laboratory.name else ""
            told = f"{none}{alone}What a customer will look for is not said:"
            out().print(told, style="yellow", markup=False, soft_wrap=True)
        for what in made.missed:
            say(f"  not said: {what}")
        if made.to_add:
            say("  Lines to add, filled in:")
            for line in made.to_add:
                say(f"    {line}")
            say(f"  {how}")
        say_verdict(made.verdict, status_in_words(made.verdict))
        for model in made.open_models:
            say(f"  not ruled out by these data: {model}")
        for what in made.unsaid:
            if what not in made.missed:
                say(f"  not said: {what}")
        missing = dcc_gaps(made) if made.usable else ()
        if missing:
            say(f"  no certificate.xml, which needs {', '.join(missing)}.")
            if not made.to_add:
                say(f"  {how}")
        handed = [name for name in ("certificate.html", "certificate.json", "certificate.xml") if (run / name).is_file()]
        handed += ["certificate.json.minisig"] if secret is not None else []
        say(f"Written: {', '.join(str(run / name) for name in (*handed, 'ro-crate-metadata.json'))}")
        say(f"To send to the customer: {', '.join(handed)}. The others stay with the run.")
        if secret is None:
            say("Not signed: nothing will tell the customer who wrote it. `calib key new -o lab.key`, then --key lab.key.")
        else:
            public = _public_of(secret, key)
            told, alone = in_shell_path(public), in_shell_path(Path(public.name))
            say(f"Signed with the key {secret.public.name}. {told} goes to the customer once, by another way than these.")
            say(f"To check it: calib verify {in_shell_path(run)} --public-key {told}")
            say(f"The customer, without the run: calib verify certificate.json --public-key {alone}")
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


def _public_of(secret: SecretKey, path: Path | None) -> Path:
    """The file of the public half of a key: beside the secret one, if that is where it lies."""
    from calib.signature import read_public_key

    if path is not None:
        beside = path.with_suffix(_PUBLIC)
        with suppress(InputError, OSError):
            if read_public_key(beside).key == secret.public.key:
                return beside
    return Path(f"FILE{_PUBLIC}")


def how_to_add(run: Run, experiment: tuple[Path | None, Path | None], surrogate: tuple[Path | None, Path | None]) -> str:
    """How a run learns what is added to its experiment file, which changes no draw, as a command that can be pasted.

    Parameters
    ----------
    run : the calibration.
    experiment, surrogate : where the file of each is, and where it was; None where it is not, or there was none.
    """
    from calib.experiment import shipped

    now, then = experiment
    file = _from_here(now) if now is not None else then
    if file is None:
        return "The run was made from no experiment file: say it where the experiment is made."
    copied = ""
    if now is not None and real_path(now).is_relative_to(real_path(shipped())):
        file = Path("mine") / now.name
        copied = "The experiment is the one that comes with the program: copy it first, by: calib example -o mine. "
    add = f"Add it to {in_shell_path(file)}" if now is not None else f"Put {in_shell_path(file)} back, and add it there"
    add = f"{copied}{add}"
    begun = run.posterior.attrs.get("command", "")
    if run.members or begun.startswith("calib compare"):
        return f"{add}, then make the run anew in another folder, as it was made by: {begun}"
    reweighted = run.posterior.diagnostics.reweighting
    options = {
        "--surrogate": _from_here(surrogate[0]) if surrogate[0] is not None else surrogate[1],
        "--reweight": None if reweighted is None else reweighted.n_draw,
    }
    words = ["calib calibrate", in_shell_path(file), "-o", in_shell_path(run.folder), "--resume"]
    return f"{add}, then: {pasted(words, options)}"


def _from_here(path: Path) -> Path:
    """A path as it is seen from where the command was given, if that is a shorter one."""
    whole, here = real_path(path), Path.cwd()
    return whole.relative_to(here) if whole.is_relative_to(here) else whole

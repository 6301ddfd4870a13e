"""The command `serve`: a folder in, its page on this machine until Ctrl-C."""

from __future__ import annotations

import webbrowser
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from calib.cli.common import refusing_bad_input, say
from calib.cli.signing import secret_key
from calib.cli.stopping import when_stopped
from calib.errors import Fault, InputError

if TYPE_CHECKING:
    from calib.serve import Door

#: What the page is made with, beside what everything else needs.
_NEEDED = ("starlette", "uvicorn", "tomlkit")


def serve(
    folder: Annotated[Path, typer.Argument(help="Folder to work in: lab files, experiment, runs. Made if it is new.")] = Path(),
    port: Annotated[
        int | None, typer.Option(min=1, max=65535, help="Port of the page [default: that of last time, or one that is free].")
    ] = None,
    key: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE", help="Secret key that certificates may be signed with [default: those in the folder]. Repeatable."
        ),
    ] = None,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")] = True,
) -> None:
    """Work on a page in the browser instead of on the command line: on this machine alone, for you alone.

    Drop lab files, see what was understood of each and correct it; fill in the experiment as a form; check it, calibrate it and
    watch; look at the report, choose a padding; compare runs and take them along. Every page shows the command that does the
    same.

    All that is done is in the folder, as files that the commands know. A page may be closed, and the server stopped or killed:
    a calibration goes on, and the next `calib serve` of the folder shows it.

    Nobody else can open the page: it listens on loopback, and asks for the secret in the address that is shown here. It loads
    nothing from anywhere.

    Certificates are signed on the page with keys that lie in the folder, or that --key names wherever they lie. The password of
    one that has one is asked for here, in the terminal; neither it nor a key ever goes to the browser.

    Example: `calib serve measurements`

    Example: `calib serve measurements --key ~/keys/lab.key`

    Exit codes: 2 the folder cannot be used, another page of it is served, or the extra is missing; 130 stopped by Ctrl-C.
    """
    with (
        refusing_bad_input(),
        when_stopped(lambda: "Stopped. Calibrations that were begun go on; everything is in the folder."),
    ):
        missing = [name for name in _NEEDED if find_spec(name) is None]
        if missing:
            advice = 'Install it: pip install "dielectric-elastomer-calibration[serve]"'
            raise InputError(Fault(f"the page needs the extra `serve` ({', '.join(missing)} not installed)", advice=advice))
        from calib.serve import Keys, open_workspace
        from calib.serve import serve as serve_pages

        given = {path.absolute(): secret_key(path) for path in key or ()}
        space = open_workspace(folder)

        def ready(door: Door) -> None:
            say(f"Working in {space.folder}. Open this address, which lets in who knows it:")
            say("")
            say(f"    {door.address}")
            say("")
            say("Ctrl-C stops the page; calibrations go on, and nothing is lost.")
            if browser:
                webbrowser.open(door.address_once)

        serve_pages(space, port, ready, Keys(space, given))

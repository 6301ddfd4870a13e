"""The command `cite`: what to cite for results of this program, on the screen."""

from __future__ import annotations

from importlib.metadata import version

from calib.citation import PAPER, bibtex, citation
from calib.cli.common import refusing_bad_input, say
from calib.provenance import PROGRAM


def cite() -> None:
    """Say what to cite: this program in the version that is installed, and the paper of the sensor model, also as BibTeX.

    A report names the version that its run was made with.

    Example: `calib cite`, `calib cite > calib.bib`

    Exit codes: 0 done.
    """
    with refusing_bad_input():
        installed = version(PROGRAM)
        say(citation(installed))
        say(PAPER)
        say("")
        say(bibtex(installed).rstrip())

"""The command `doctor`: an installation in, what of it works, and what to do where it does not, on the screen."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calib.cli.common import not_usable, out, refusing_bad_input, say

if TYPE_CHECKING:
    from calib.runs import Examined

_SIGNS = {"fine": "✓", "missing": "-", "broken": "✗"}
_STYLES = {"fine": "green", "missing": "yellow", "broken": "bold red"}


def doctor() -> None:
    """Say what of this installation works: packages, surrogates, models, this folder, extras, browser, processors.

    The models are held against a number of an independent finite-element code. What does not work is said with one thing to do
    about it; a minus is what is not there and only needed where it says.

    Example: `calib doctor`

    Writes: nothing that stays.

    Exit codes: 0 calibrations work here; 3 something does not.
    """
    with refusing_bad_input():
        from calib.runs import examine

        found = examine(told=_say)
        broken = sum(one.health == "broken" for one in found)
        missing = sum(one.health == "missing" for one in found)
        beside = f"; {missing} optional {'thing is' if missing == 1 else 'things are'} not there" if missing else ""
        verb = "thing does" if broken == 1 else "things do"
        say(f"{broken} {verb} not work here." if broken else f"Calibrations work here{beside}.")
    if broken:
        raise not_usable("calibrations do not work here before what is said above is done")


def _say(one: Examined) -> None:
    line = f"{_SIGNS[one.health]} {one.name:<17} {one.finding}"
    out().print(line, style=_STYLES[one.health], markup=False, soft_wrap=True)
    if one.action:
        out().print(f"  {'':<17} {one.action}", markup=False, soft_wrap=True)

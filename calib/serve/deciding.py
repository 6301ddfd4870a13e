"""A quantity that no lab file tells and how it is known, as a form says it, in, the text of the experiment with that out.

What is written is what one would write by hand: the value, and behind it with what it was measured, or that it was not and its
guess is to stand, as wide as it is or wider.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from typing import Any, Literal

from calib.errors import Fault, InputError
from calib.experiment import MARK, MEASURED, STANDS, KeyPath, guess_at
from calib.serve.toml_text import value_at, with_mark, with_note, with_value
from calib.visible import character_fault

#: How a quantity is known: nobody has said so yet, it was measured, or it was not and the guess is to stand.
Known = Literal["undecided", "measured", "stands"]

#: How much wider than the guess a prior may be made.
WIDER = (1, 2, 4)

_NUMBER = re.compile(r"\s*([+-]?[\d.]+(?:[eE][+-]?\d+)?)(.*)", re.DOTALL)
_LONGEST = 100
# Places in priors of what tells how wide they are; a lognormal's is a factor, which is raised to a power.
_WIDTHS = {"normal": 1, "truncated_normal": 1, "lognormal": 1}


def known_by(comment: str) -> tuple[Known, str]:
    """How a quantity is known by the comment in its line, and with what it was measured.

    >>> known_by("# measured: caliper"), known_by("# not measured: the guess stands"), known_by("")
    (('measured', 'caliper'), ('stands', ''), ('measured', ''))
    """
    if MARK in comment:
        return "undecided", ""
    if STANDS in comment:
        return "stands", ""
    return "measured", comment[comment.rindex(MEASURED) + len(MEASURED) :].strip() if MEASURED in comment else ""


def decided(text: str, at: KeyPath, form: Mapping[str, str], value: Any = None) -> str:
    """Text of the experiment file once somebody has said how a quantity is known.

    Parameters
    ----------
    text : of the file.
    at : path of the quantity.
    form : `known`, one of `Known`; of "measured" with what, `by`; of "stands" how many times as wide as it is a prior is to be,
        `wider`.
    value : that was measured, as it is to be written; None for what stands there.

    Raises
    ------
    InputError
        If the draft makes no guess of it, or what is said makes no sense.
    """
    guess = guess_at(at)
    if guess is None:
        raise InputError(Fault(f"{'.'.join(map(str, at))} is no quantity that a draft guesses", advice="Reload the page"))
    now, known = value_at(tomllib.loads(text), at), form.get("known", "")
    if known == "undecided":
        text = with_value(text, at, tomllib.loads(f"value = {guess.value}")["value"])
        return with_mark(with_note(text, at, ""), at, guess.task)
    if known == "stands":
        if now is None:
            raise InputError(Fault("there is no guess here that could stand", advice="Give what you know of it"))
        wider = form.get("wider", "1")
        if wider not in map(str, WIDER):
            raise InputError(Fault(f'"{wider[:20]}" is not how much wider a prior is made', advice="Reload the page"))
        if wider != "1":
            text = with_value(text, at, wider_prior(now, int(wider)))
        words = "the guess stands" if wider == "1" else f"the guess, {wider} times as wide"
        return with_note(text, at, f"{STANDS} {words}")
    if known != "measured":
        raise InputError(Fault("nothing says how it is known", advice="Choose measured, or that the guess stands"))
    if value is None and now is None:
        raise InputError(Fault("nothing says what was measured", advice="Give the value, and how sure it is"))
    by = _plain(form.get("by", "").strip())
    return with_note(text if value is None else with_value(text, at, value), at, f"{MEASURED} {by}" if by else "")


def measured_prior(form: Mapping[str, str]) -> dict[str, Any] | None:
    """The prior of what was measured, normal; None where a form says neither value nor uncertainty.

    >>> measured_prior({"mean": "0.74 mm", "sd": "0.02"})
    {'normal': ['0.74 mm', '0.02 mm']}

    Parameters
    ----------
    form : `mean`, and `sd`, which has the unit of the mean if it has none.

    Raises
    ------
    InputError
        If one of the two is missing.
    """
    mean, sd = (form.get(name, "").strip() for name in ("mean", "sd"))
    if not mean and not sd:
        return None
    if not mean or not sd:
        missing = "the value" if not mean else "how sure it is, as one standard deviation"
        raise InputError(Fault(f"{missing} is missing", advice='Give for example "0.74 mm" and "0.02 mm"'))
    unit = found[2] if (found := _NUMBER.fullmatch(mean)) else ""
    alone = _NUMBER.fullmatch(sd)
    sd = f"{sd}{unit}" if alone and not alone[2].strip() else sd
    return {"normal": [_as_written(mean), _as_written(sd)]}


def wider_prior(prior: Any, times: int) -> dict[str, Any]:
    """A prior as it stands in an experiment file, so many times as wide about the same middle.

    >>> wider_prior({"lognormal": ["0.8 mm", 1.5]}, 2), wider_prior({"halfnormal": "2 um/N"}, 2)
    ({'lognormal': ['0.8 mm', 2.25]}, {'halfnormal': '4 um/N'})

    Parameters
    ----------
    prior : kind -> its numbers.
    times : how many.

    Raises
    ------
    InputError
        If it has no width that could be larger.
    """
    kind = next(iter(prior), "") if isinstance(prior, dict) else ""
    numbers = prior.get(kind) if kind else None
    if kind == "halfnormal":
        return {kind: _times(numbers, times)}
    if kind in _WIDTHS and isinstance(numbers, list) and len(numbers) > 1:
        place = _WIDTHS[kind]
        width = numbers[place]
        if kind == "lognormal" and isinstance(width, int | float):
            made: Any = float(f"{float(width) ** times:.6g}")
        else:
            made = _times(width, times)
        return {kind: [*numbers[:place], made, *numbers[place + 1 :]]}
    said = f"a prior that is {kind.replace('_', ' ')}" if kind else "what stands there"
    raise InputError(Fault(f"{said} is not made wider here", advice="Give another distribution above"))


def _times(width: Any, times: int) -> Any:
    """A number, or a text of one with its unit, so many times as large."""
    if isinstance(width, int | float):
        return float(f"{width * times:.6g}")
    found = _NUMBER.fullmatch(str(width))
    if found is None:
        raise InputError(Fault(f'"{str(width)[:40]}" is no number that could be made larger', advice="Mend it above first"))
    return f"{float(found[1]) * times:.6g}{found[2]}"


def _as_written(text: str) -> str | float:
    """A plain number as a number, a quantity as its text.

    Raises
    ------
    InputError
        If it is a number without end, or none.
    """
    try:
        number = float(text)
    except ValueError:
        return text
    if not math.isfinite(number):
        raise InputError(Fault(f'"{text[:40]}" is no number that was measured', advice="Give the value, with its unit"))
    return number


def _plain(by: str) -> str:
    """With what it was measured, as a comment can hold it.

    Raises
    ------
    InputError
        If it cannot.
    """
    if fault := character_fault(by):
        raise InputError(Fault(f"with what it was measured: this {fault}", advice="Write it in a few plain words"))
    if "#" in by or len(by) > _LONGEST:
        raise InputError(Fault(f"with what it was measured is up to {_LONGEST} letters, without #", advice="Shorten it"))
    return by

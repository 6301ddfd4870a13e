"""From what the user says of the part of a press that is used to a checked `Use`, and back to words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, cast

from calib.errors import Fault, InputError
from calib.quantity import parse_quantity
from calib.visible import shortened

Branch = Literal["loading", "unloading"]

#: What may be said of the part that is used, and an example of each.
USE_KEYS = ("max_force", "max_depth", "branch", "cycles")
BRANCHES: tuple[Branch, ...] = ("loading", "unloading")


@dataclass(frozen=True)
class Use:
    """Which part of a press is used.

    Attributes
    ----------
    max_force : [N], rows with more force are left out; force as the file has it, compression positive, its zero not taken off:
        below zero where the load at rest is. None for no limit.
    max_depth : [m], rows deeper than this are left out; counted from where contact is estimated to begin. None for no limit.
    branch : "loading", or "unloading" for a press that is to be calibrated on its way back.
    cycles : which cycles, counted from 1; their rows are used together. Empty for the first.
    """

    max_force: float | None = None
    max_depth: float | None = None
    branch: Branch = "loading"
    cycles: tuple[int, ...] = ()


#: The whole first loading branch.
FIRST_LOADING = Use()


def use_value(key: str, value: object) -> float | str | tuple[int, ...]:
    """Check one thing that is said of the part to be used, and turn it into the value of the field of `Use`.

    Parameters
    ----------
    key : one of `USE_KEYS`.
    value : as written: a quantity such as "5 N", the name of a branch, or whole numbers.

    Returns
    -------
    [N] or [m], the branch, or the cycles in order.

    Raises
    ------
    InputError
        If it is none of that.
    """
    if key in ("max_force", "max_depth"):
        return _limit(key, value)
    if key == "branch":
        if value not in BRANCHES:
            raise InputError(Fault(f'branch must be "loading" or "unloading", got {_shown(value)}'))
        return str(value)
    return _cycles(value)


def _limit(key: str, value: object) -> float:
    unit, example = ("N", "5 N") if key == "max_force" else ("m", "0.8 mm")
    if not isinstance(value, str):
        raise InputError(
            Fault(f"{key} must be a quantity with its unit, got {_shown(value)}", advice=f'Give {key} = "{example}"')
        )
    try:
        number = parse_quantity(value, unit)
    except ValueError as error:
        raise InputError(Fault(f"{key}: {error}", advice=f'Give {key} = "{example}"')) from None
    if key == "max_depth" and not number > 0:
        raise InputError(Fault(f'{key} must be positive, got "{value}"', advice=f'Give {key} = "{example}"'))
    return number


def _cycles(value: object) -> tuple[int, ...]:
    numbers = value if isinstance(value, Sequence) and not isinstance(value, str) else None
    advice = "Give cycles = [2, 3], counted from 1"
    if not numbers or any(isinstance(n, bool) or not isinstance(n, int) or n < 1 for n in numbers):
        raise InputError(Fault(f"cycles must be a list of whole numbers from 1, got {_shown(value)}", advice=advice))
    if len(set(numbers)) < len(numbers):
        raise InputError(Fault(f"cycles names one twice, got {_shown(value)}", advice=advice))
    return tuple(sorted(cast(Sequence[int], numbers)))


def _shown(value: object) -> str:
    return (
        f'"{shortened(value)}"' if isinstance(value, str) else "a table" if isinstance(value, dict) else shortened(str(value))
    )


def same_part(one: Use, other: Use) -> bool:
    """Whether two uses of one file would count readings twice: the same branch of a cycle that is in both.

    Parameters
    ----------
    one, other : what is said of each.
    """
    if one.branch != other.branch:
        return False
    first, second = (set(use.cycles or (1,)) for use in (one, other))
    return bool(first & second)


def use_in_words(use: Use, cycles: Sequence[int]) -> str:
    """Name the branch and the cycles that are used: "cycle 2 is used", "unloading of cycles 2 and 3 is used".

    Parameters
    ----------
    use : what the user said.
    cycles : that it comes to in the file.
    """
    named = cycles_in_words(cycles)
    if use.branch == "unloading":
        return f"unloading of {named} is used"
    return f"{named} {'is' if len(cycles) == 1 else 'are'} used"


def cycles_in_words(cycles: Sequence[int]) -> str:
    """Name cycles: "cycle 2", "cycles 2, 3 and 5"."""
    if len(cycles) == 1:
        return f"cycle {cycles[0]}"
    return f"cycles {', '.join(str(c) for c in cycles[:-1])} and {cycles[-1]}"

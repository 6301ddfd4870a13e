"""What a page does in, the command that does the same out, to be typed in its folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from calib.errors import in_shell, in_shell_path
from calib.experiment import Said
from calib.lab import SIGNED


def typed(words: Sequence[str]) -> str:
    """A command as one types it: `calib` and its words, each quoted where it has to be.

    >>> typed(["recommend", "run1", "--force", "10 N"])
    'calib recommend run1 --force "10 N"'
    """
    return " ".join(["calib", *map(in_shell, words)])


def reading_command(name: str, said: Said) -> str:
    """The command that shows what is understood of a lab file.

    Parameters
    ----------
    name : of the file.
    said : of it.
    """
    reading, use = said.reading, said.use
    words = ["calib read", in_shell_path(Path(name))]
    words += [f"--units {in_shell(f'{q}={unit}')}" for q, unit in reading.units.items()]
    words += [f"--columns {in_shell(f'{q}={column}')}" for q, column in reading.columns.items()]
    words += [] if reading.specimen is None else [f"--specimen {reading.specimen}"]
    words += [f"--where {in_shell(f'{column}={value}')}" for column, value in reading.where.items()]
    words += _signs(reading.sign)
    texts = {"sheet": reading.sheet, "scale": reading.scale, "decimal": reading.decimal}
    texts |= {"branch": use.branch if use.branch != "loading" else ""}
    texts |= {"cycles": ",".join(map(str, use.cycles))}
    texts |= {"max-force": "" if use.max_force is None else f"{use.max_force:.12g} N"}
    texts |= {"max-depth": "" if use.max_depth is None else f"{use.max_depth * 1e3:.12g} mm"}
    words += [f"--{option} {in_shell(text)}" for option, text in texts.items() if text]
    return " ".join(words)


def _signs(sign: Mapping[str, str]) -> list[str]:
    senses = set(sign.values())
    if len(senses) == 1 and set(sign) == set(SIGNED):
        return [f"--sign {in_shell(senses.pop())}"]
    return [f"--sign {in_shell(f'{q}={sense}')}" for q, sense in sign.items()]

"""What a page does in, the command that does the same out, to be typed in its folder."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from calib.errors import Fault, InputError, in_shell, in_shell_path
from calib.experiment import Said
from calib.lab import SIGNED
from calib.runs import run_state
from calib.serve.workspace import Workspace

#: Minutes that a calibration is offered.
BUDGET = "10"


def typed(words: Sequence[str]) -> str:
    """A command as one types it: `calib` and its words, each quoted where it has to be.

    >>> typed(["recommend", "run1", "--force", "10 N"])
    'calib recommend run1 --force "10 N"'
    """
    return " ".join(["calib", *map(in_shell, words)])


def calibrating(space: Workspace, form: Mapping[str, str], experiment: str = "") -> list[str]:
    """The words of the command that calibrates, as a form says.

    Parameters
    ----------
    space : the folder.
    form : its fields: `name` of the run, and where they are filled in `budget`, `seed` and `anyway`.
    experiment : the file; that of the folder if none is given.

    Raises
    ------
    InputError
        If a field of it is no number.
    """
    words = ["calibrate", experiment or space.experiment.name, "-o", form["name"]]
    faults = []
    for key, least in (("budget", 0.0), ("seed", 0.0)):
        text = form.get(key, "").strip()
        if not text:
            continue
        try:
            number = float(text) if key == "budget" else int(text)
        except ValueError:
            number = math.nan
        if not (math.isfinite(number) and number >= least and number < 1e6):
            what = "minutes, such as 10 or 2.5, with a point" if key == "budget" else "a whole number, such as 1"
            faults.append(Fault(f'{key} must be {what}, got "{text[:40]}"'))
        else:
            words += [f"--{key}", f"{number:g}" if key == "budget" else str(number)]
    if faults:
        raise InputError(faults)
    return [*words, "--anyway"] if form.get("anyway") == "yes" else words


def resuming(space: Workspace, form: Mapping[str, str]) -> list[str]:
    """The words of the command that goes on with a run: of the experiment that it is of, as doubtful as it was begun.

    Parameters
    ----------
    space : the folder.
    form : its fields: `name` of the run, and `budget` where it is filled in.

    Raises
    ------
    InputError
        If there is no such run, or the budget is no number.
    """
    folder = space.run(form.get("name", ""))
    state = run_state(folder)
    own = None if state.experiment is None else state.experiment.resolve()
    experiment = own.relative_to(space.folder).as_posix() if own is not None and own.is_relative_to(space.folder) else ""
    anyway = "yes" if "--anyway" in state.command.split() else ""
    asked = {"name": form.get("name", ""), "budget": form.get("budget", ""), "anyway": anyway}
    return [*calibrating(space, asked, experiment), "--resume"]


def after_cancel(words: Sequence[str]) -> list[str]:
    """The words of the command that goes on where one was cancelled: the same, a calibration with `--resume`.

    >>> after_cancel(["calib", "calibrate", "experiment.toml", "-o", "run1"])
    ['calibrate', 'experiment.toml', '-o', 'run1', '--resume']

    Parameters
    ----------
    words : of the command, `calib` first.
    """
    return [*words[1:], *(["--resume"] if "calibrate" in words[1:2] and "--resume" not in words else [])]


def drafting(space: Workspace, files: Sequence[str], output: str) -> list[str]:
    """The words of the command that writes a first experiment from lab files, with what was said of them.

    Parameters
    ----------
    space : the folder.
    files : names of files and folders in it.
    output : name of what is written.
    """
    said = ["--said", space.readings.name] if space.readings.is_file() else []
    return ["init", *files, *said, "-o", output]


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

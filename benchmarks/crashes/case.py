"""How a run was disturbed and what came of it in, a verdict out."""

from __future__ import annotations

import json
import re
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Protocol

from crashes.command import Ended, run
from crashes.lab import Lab, blocks, difference

#: Verdicts, from good to bad; all but the first fail.
OUTCOMES = ("right", "bad refusal", "lost work", "traceback", "death", "hang", "wrong")


@dataclass(frozen=True)
class Case:
    """One disturbance: its part and number, what was done, the verdict, and a note with what was seen."""

    part: str
    number: int
    what: str
    outcome: str = "right"
    note: str = ""
    seconds: float = 0.0

    def line(self) -> str:
        """The case as a line of JSON."""
        return json.dumps(asdict(self), ensure_ascii=False)


class Part(Protocol):
    """Cases of one kind, as a module has them."""

    def size(self, lab: Lab, asked: int) -> int:
        """How many cases there are, if so many are asked for."""

    def case(self, lab: Lab, number: int) -> Case:
        """The case of a number, which decides all that is random in it."""


def recovered(case: Case, lab: Lab, place: Path, *, seed: int = 5, output: str = "RUN") -> Case:
    """Go on as a user would, with --resume or else anew, and compare with the undisturbed run.

    Parameters
    ----------
    case : what was done so far.
    lab : where.
    place : folder of the experiment.
    seed : of the run.
    output : the folder of the run, in `place`.

    Returns
    -------
    The case with its verdict.
    """
    folder = place / output
    before = blocks(folder)
    words = lab.calibrate(seed=seed, output=output)
    tried: list[Ended] = []
    for more in (("--resume",), (), ("--resume",)):
        ended = run((*words, *more), place, lab.log, cold=lab.cold)
        tried.append(ended)
        if ended.crashed:
            return _verdict(case, ended.crashed, f"calibrate {' '.join(more)}: {ended.last}")
        if ended.code in (0, 3):
            break
    else:
        said = " / ".join(f"[{e.code}] {e.last}" for e in tried[:2])
        return _verdict(case, "lost work" if before else "bad refusal", f"neither --resume nor a new start: {said}")
    if other := difference(folder, lab.reference(seed)):
        return _verdict(case, "wrong", other)
    after = blocks(folder)
    again = [name for name in before if name in after and after[name][0] != before[name][0]]
    if again:
        return _verdict(case, "lost work", f"{len(again)} of {len(before)} blocks were computed again, such as {again[0]}")
    leftover = [p.name for p in folder.rglob("*") if re.search(r"\.(part|tmp)", p.name)]
    if leftover:
        return _verdict(case, "bad refusal", f"left over: {', '.join(leftover[:3])}")
    if lab.verifies and (checked := run(("verify", output), place, lab.log)).code not in (0,):
        return _verdict(case, checked.crashed or "wrong", f"verify of a whole run: [{checked.code}] {checked.last}")
    return _verdict(case, "right", f"{len(tried)} commands, {len(before)} blocks kept")


def _verdict(case: Case, outcome: str, note: str) -> Case:
    return replace(case, outcome=outcome, note=f"{case.note}; {note}" if case.note and note else case.note or note)


def failed(case: Case, ended: Ended, names: tuple[str, ...] = ()) -> Case | None:
    """The case as failed if a command crashed, or refused without naming one of these; None if it did neither."""
    if ended.crashed:
        return _verdict(case, ended.crashed, f"[{ended.code}] {ended.last}")
    text = re.sub(r"[\s│]+", "", ended.text)
    if ended.code in (1, 2) and names and not any(re.sub(r"\s+", "", name) in text for name in names):
        return _verdict(case, "bad refusal", f"names none of {', '.join(names)}: {ended.last}")
    return None


def with_verdict(case: Case, outcome: str, note: str) -> Case:
    """The case with a verdict, its note behind what was noted before."""
    return _verdict(case, outcome, note)

"""A hostile lab file with its truth in, a verdict out: right, refused well or needlessly, or misread (run it for the table)."""

from __future__ import annotations

import importlib
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from hostile_press import FloatArray

from calib.errors import Fault, InputError
from calib.lab import AS_FOUND, LabTable, Reading, read_lab_file

Word = Literal[
    "right",
    "refused well",
    "refused needlessly",
    "refused badly",
    "right by luck",
    "told wrongly",
    "silent error",
    "crashed",
]
MISREAD: tuple[Word, ...] = ("silent error", "told wrongly", "right by luck", "crashed")
JUDGED = ("time", "displacement", "force", "capacitance", "dissipation", "frequency", "cycle")
OPTIONS = ("units", "columns", "specimen", "where", "sheet", "sign", "scale", "decimal")


@dataclass(frozen=True)
class Truth:
    """What the readings of a file are, known from the numbers that made it.

    Attributes
    ----------
    lines : line in the file of each reading, from 1.
    columns : quantity -> values in SI with the file's signs, nan where there is no reading.
    """

    lines: tuple[int, ...]
    columns: Mapping[str, FloatArray]


def truth(lines: Sequence[int], **columns: FloatArray) -> Truth:
    """Truth by quantity.

    Parameters
    ----------
    lines : line of each reading.
    columns : quantity=values, each as long as `lines`.

    Returns
    -------
    The truth.
    """
    for name, values in columns.items():
        assert name in JUDGED, name
        assert len(values) == len(lines), name
    return Truth(tuple(lines), columns)


@dataclass(frozen=True)
class Case:
    """One file, what is said of it, what it holds, and what may be done with it.

    Attributes
    ----------
    name : unique; names the file, too.
    kind : the class of causes, such as "brackets", or "benign ..." for a look-alike that a lab really has.
    content : the bytes of the file.
    may : "must_read", "must_refuse" (the file does not tell), or "may_refuse" (reading to the truth is as good).
    truth : what must be read; None where no reading of the file is defensible.
    reading : what the user says.
    named : words that must stand in what is told of a file that is read: columns, lines and blocks that are not used. "a|b" is
        either of them.
    told : words of a choice that must be told where the file is read, "a|b" as above; without them it is right by luck.
    blame : words of which one must stand in a refusal; the words of `named` and any line or column do as well.
    excused : lines that may be left out, with a reason.
    damaged : lines that hold a cell which is no reading (nan in the truth): not a word about them is a silent error.
    free : quantities that are not judged.
    ways_out : readings with which the file must be read, and what it must then be read to.
    suffix : of the file.
    time_tolerance : of times [s]; an origin of its own is always allowed.
    why : what is hostile in it, for who reads the table.
    """

    name: str
    kind: str
    content: bytes
    may: Literal["must_read", "must_refuse", "may_refuse"]
    truth: Truth | None
    reading: Reading = AS_FOUND
    named: tuple[str, ...] = ()
    told: tuple[str, ...] = ()
    blame: tuple[str, ...] = ()
    excused: frozenset[int] = frozenset()
    damaged: frozenset[int] = frozenset()
    free: frozenset[str] = frozenset()
    ways_out: tuple[tuple[Reading, Truth], ...] = ()
    suffix: str = ".csv"
    time_tolerance: float = 2e-6
    why: str = ""


@dataclass(frozen=True)
class Judged:
    """What a reader did with a case: the verdict in a word, and what it rests on."""

    word: Word
    detail: str = ""


@dataclass(frozen=True)
class _Differences:
    """Where a table differs from the truth: wrong quantities with an example, lines gone in silence, lines lost with reason."""

    wrong: dict[str, str] = field(default_factory=dict)
    gone: list[int] = field(default_factory=list)
    lost: list[int] = field(default_factory=list)
    absent: list[str] = field(default_factory=list)


def says(text: str, word: str) -> bool:
    """Whether a word, or one of several joined by "|", stands in a text by itself.

    Parameters
    ----------
    text : what is told.
    word : what is looked for, without regard to capitals.

    Returns
    -------
    True if it stands there.

    >>> says('column 4 "Load 2 (N)"', "Load 2"), says('column 4 "Load 2 (N)"', "oad|Temp")
    (True, False)
    """
    return any(re.search(rf"(?<!\w){re.escape(w)}(?!\w)", text, re.IGNORECASE) for w in word.split("|"))


def spoken_lines(text: str) -> set[int]:
    """Lines that a text names.

    >>> sorted(spoken_lines("line 7 is short, lines 9 to 11 and 20 are text"))
    [7, 9, 10, 11, 20]
    """
    found: set[int] = set()
    for match in re.finditer(r"\b(?:lines?|rows?)((?:[\s,]|and|to|-|–|\d)+)", text, re.IGNORECASE):
        for first, last in re.findall(r"(\d+)(?:\s*(?:to|-|–)\s*(\d+))?", match[1]):
            found.update(range(int(first), int(last or first) + 1))
    return found


def judge(case: Case, folder: Path) -> Judged:
    """Read the file of a case and say how it went.

    Parameters
    ----------
    case : the file and its truth.
    folder : where the file is written.

    Returns
    -------
    The verdict.
    """
    path = folder / f"{case.name}{case.suffix}"
    path.write_bytes(case.content)
    found = _read(path, case.reading)
    if isinstance(found, Judged):
        return found
    if isinstance(found, InputError):
        return _judge_refusal(case, found, path)
    return _judge_table(case, found)


def _read(path: Path, reading: Reading) -> LabTable | InputError | Judged:
    try:
        return read_lab_file(path, reading)
    except InputError as error:
        return error
    except Exception as error:  # anything else is a failure of the reader, which is what is judged here
        return Judged("crashed", f"{type(error).__name__}: {error}")


def _judge_refusal(case: Case, error: InputError, path: Path) -> Judged:
    text = _told(error)
    place = any(f.line is not None or f.column is not None for f in error.faults)
    if case.may == "must_read":
        return Judged("refused needlessly", text)
    if not (place or any(says(text, w) for w in (*case.blame, *case.named)) or re.search(r"\bline \d|\bcolumn \d|\"", text)):
        return Judged("refused badly", f"names no place: {text}")
    if case.blame and not any(says(text, w) for w in (*case.blame, *case.named)):
        return Judged("refused badly", f"names none of {case.blame}: {text}")
    if not any(f.advice for f in error.faults):
        return Judged("refused badly", f"no advice: {text}")
    return _judge_ways_out(case, " ".join(f.advice for f in error.faults), text, path)


def _place(fault: Fault) -> str:
    line = f"line {fault.line}" if fault.line is not None else ""
    column = f"column {fault.column}" if fault.column is not None else ""
    return f"{' '.join((line, column)).strip()}: " if line or column else ""


def _judge_ways_out(case: Case, advice: str, text: str, path: Path) -> Judged:
    advised = {o for o in OPTIONS if re.search(rf"--{o}\b|\b{o} ?= ?[\"{{\d]", advice)}
    tried: list[tuple[set[str], Judged]] = []
    for reading, expected in case.ways_out:
        said = {o for o in OPTIONS if getattr(reading, o) != getattr(AS_FOUND, o)}
        if advised and not said & advised:
            continue
        tried.append((said, _judge_way_out(case, reading, expected, path)))
    for said, judged in tried:
        if judged.word in MISREAD and judged.word != "right by luck":
            return Judged(judged.word, f"after {sorted(said)}, as advised: {judged.detail}")
    dead = [f"{sorted(said)}: {judged.detail}" for said, judged in tried if judged.word not in ("right", "right by luck")]
    if dead:
        return Judged("refused badly", f"way out does not lead out: {dead[0]} <- {text}")
    if advised and case.ways_out and not tried:
        ways = [sorted(o for o in OPTIONS if getattr(r, o) != getattr(AS_FOUND, o)) for r, _ in case.ways_out]
        return Judged("refused badly", f"advises {sorted(advised)}, what leads out is {ways}: {text}")
    return _judge_typed(case, text, path, proven=bool(tried))


def _judge_typed(case: Case, text: str, path: Path, *, proven: bool) -> Judged:
    """Type what a refusal advises, and what the next one advises: it must lead out, and never to other readings."""
    truths = [t for t in (case.truth, *(t for _, t in case.ways_out)) if t is not None]
    options, seen, still = advised_options(text), set[str](), ""
    if not options or not truths:
        return Judged("refused well", text)
    trials = [tuple(s) for s in ([o] for o in options)] + [options]
    for _ in range(3):
        following: list[tuple[tuple[str, str, str], ...]] = []
        for trial in trials:
            found = _read(path, with_options(case.reading, trial))
            shown = " ".join(f"--{o} {k}{'=' if k else ''}{v}" for o, k, v in trial)
            if isinstance(found, Judged):
                return found
            if isinstance(found, LabTable):
                judged = [_verdict(found, t, case, named=(), told=()) for t in truths]
                if any(j.word == "right" for j in judged):
                    proven = True
                elif all(j.word in MISREAD for j in judged):
                    return Judged("refused badly", f"typed as advised, {shown}, it misreads: {judged[0].detail} <- {text}")
            else:
                still = _told(found)
                more = tuple(o for o in advised_options(still) if o[:2] not in {t[:2] for t in trial})
                if more and still not in seen:
                    following.append((*trial, *more))
                seen.add(still)
        trials = following[:4]
    return Judged("refused well", text) if proven else Judged("refused badly", f"typed as advised, still: {still} <- {text}")


def _told(error: InputError) -> str:
    return " | ".join(f"{_place(f)}{f.message}. {f.advice}" for f in error.faults)


def advised_options(text: str) -> tuple[tuple[str, str, str], ...]:
    """Options that stand ready to be typed in an advice, as (option, key, value); places to fill in are left out.

    Parameters
    ----------
    text : such as 'Say which one: --specimen 1, or --columns "force=Load 2"'.

    Returns
    -------
    The first of each option and key.

    >>> advised_options('Say --where "f (Hz)=1000", or --specimen 1 to --specimen 2, or --units force=...')
    (('where', 'f (Hz)', '1000'), ('specimen', '', '1'))
    """
    found: dict[tuple[str, str], str] = {}
    for option, quoted, bare in re.findall(rf'--({"|".join(OPTIONS)})[ =](?:"([^"]*)"|([^\s,;]*[^\s,;.)]))', text):
        key, _, value = (quoted or bare).rpartition("=")
        if value and "..." not in value and "…" not in value and not re.fullmatch(r"[A-Z]{3,}|<.*>", value):
            found.setdefault((option, key), value)
    return tuple((o, k, v) for (o, k), v in found.items())


def with_options(reading: Reading, options: Iterable[tuple[str, str, str]]) -> Reading:
    """What the user says, with the options of an advice typed behind it.

    Parameters
    ----------
    reading : what was said before.
    options : (option, key, value), as `advised_options` finds them.

    Returns
    -------
    Both together.
    """
    for option, key, value in options:
        match option:
            case "units":
                reading = replace(reading, units={**reading.units, key: value})
            case "columns":
                reading = replace(reading, columns={**reading.columns, key: value})
            case "where":
                reading = replace(reading, where={**reading.where, key: value})
            case "sign":
                both = [key] if key else ["force", "displacement"]
                reading = replace(reading, sign={**reading.sign, **dict.fromkeys(both, value)})
            case "specimen":
                reading = replace(reading, specimen=int(value) if value.isdigit() else None)
            case "sheet":
                reading = replace(reading, sheet=value)
            case "scale":
                reading = replace(reading, scale=value)
            case "decimal":
                reading = replace(reading, decimal=value)
    return reading


def _judge_way_out(case: Case, reading: Reading, expected: Truth, path: Path) -> Judged:
    found = _read(path, reading)
    if isinstance(found, Judged):
        return found
    if isinstance(found, InputError):
        return Judged("refused needlessly", "still refused: " + " | ".join(str(f) for f in found.faults))
    return _verdict(found, expected, case, named=(), told=())


def _judge_table(case: Case, table: LabTable) -> Judged:
    if case.truth is None:
        notes = " | ".join(table.notes)
        word: Word = "told wrongly" if any(says(notes, w) for w in (*case.blame, *table.sources.values())) else "silent error"
        heads = "; ".join(f"{q} <- {s!r} {_few(table.columns[q])}" for q, s in table.sources.items() if q in table.columns)
        return Judged(word, f"read, though the file does not tell: {heads}; notes: {notes}")
    judged = _verdict(table, case.truth, case, case.named, case.told)
    if judged.word == "right" and case.may == "must_refuse" and not case.told:
        return Judged("right by luck", "read, though it had to be asked for")
    return judged


def _few(values: FloatArray) -> str:
    return "[" + ", ".join(f"{v:g}" for v in (*values[:2], *values[-1:])) + "]"


def _verdict(table: LabTable, expected: Truth, case: Case, named: tuple[str, ...], told: tuple[str, ...]) -> Judged:
    notes = " | ".join(table.notes)
    unread = " | ".join(f"{u.what}: {u.reason}" for u in table.unread)
    everything = " | ".join((notes, unread, *sorted(set(table.reasons))))
    differences = _differences(table, expected, case, everything)
    if differences.wrong:
        quantity = ", ".join(differences.wrong)
        heard = [q for q in differences.wrong if says(notes, q) or says(notes, table.sources.get(q, "\0"))]
        word: Word = "told wrongly" if heard else "silent error"
        return Judged(word, f"{quantity}: {next(iter(differences.wrong.values()))}" + (f"; notes: {notes}" if notes else ""))
    silent = [q for q in differences.absent if not (says(unread, q) or says(notes, q) or unread)]
    if silent:
        return Judged("silent error", f"no {', '.join(silent)}, and not a word")
    if differences.gone:
        return Judged("silent error", f"not a word about lines {differences.gone[:5]}")
    missing = [w for w in named if not says(everything, w)]
    if missing:
        return Judged("silent error", f"not named: {missing}; told: {everything or 'nothing'}")
    if differences.absent:
        spared = case.may != "must_read" and all(says(everything, "|".join((q, *case.blame))) for q in differences.absent)
        return Judged("refused well" if spared else "refused needlessly", f"no {', '.join(differences.absent)}: {everything}")
    if differences.lost:
        why = dict(zip(table.lines.tolist(), table.reasons, strict=True))
        reason = why.get(differences.lost[0], "no row of those asked for")
        return Judged(
            "refused needlessly", f"{len(differences.lost)} good lines left out, first {differences.lost[0]}: {reason}"
        )
    untold = [w for w in told if not says(everything, w)]
    if untold:
        return Judged("right by luck", f"not told: {untold}; told: {everything or 'nothing'}")
    return Judged("right", everything)


def _differences(table: LabTable, expected: Truth, case: Case, everything: str) -> _Differences:
    found = _Differences()
    row_of = {line: i for i, line in enumerate(expected.lines)}
    spoken = spoken_lines(everything)
    lines = [int(line) for line in table.lines]
    used = np.array([not r for r in table.reasons], dtype=bool)
    for line, reason in zip(lines, table.reasons, strict=True):
        if not reason and line in case.damaged and line not in spoken:
            found.gone.append(line)
        if reason and line in row_of and line not in case.excused | case.damaged and not _empty(expected, row_of[line]):
            found.lost.append(line)
    for line in sorted(set(row_of) - set(lines)):
        if not _empty(expected, row_of[line]) and not (line in case.excused | case.damaged and line in spoken):
            (found.lost if line in spoken else found.gone).append(line)
    strangers = [line for line, u in zip(lines, used, strict=True) if u and line not in row_of]
    if strangers:
        found.wrong["rows"] = f"line {strangers[0]} was read as a row ({len(strangers)} such lines)"
    if len(set(lines)) < len(lines):
        found.wrong["rows"] = "a line was read twice"
    kept = [i for i, (line, u) in enumerate(zip(lines, used, strict=True)) if u and line in row_of]
    at = np.array([row_of[lines[i]] for i in kept], dtype=np.intp)
    for quantity in JUDGED:
        if quantity in case.free or quantity not in {*expected.columns, *table.columns}:
            continue
        if quantity not in expected.columns:
            found.wrong[quantity] = f"{quantity} from {table.sources.get(quantity)!r}, which the file does not hold"
        elif quantity not in table.columns:
            found.absent.append(quantity)
        elif kept:
            wrong = _unequal(quantity, table.columns[quantity][kept], expected.columns[quantity][at], case)
            if wrong is not None:
                got, true = table.columns[quantity][kept][wrong], expected.columns[quantity][at][wrong]
                found.wrong[quantity] = f"line {lines[kept[wrong]]} {quantity} {got:.9g}, true {true:.9g}"
    return found


def _empty(expected: Truth, row: int) -> bool:
    return all(np.isnan(values[row]) for name, values in expected.columns.items() if name != "time")


def _unequal(quantity: str, got: FloatArray, true: FloatArray, case: Case) -> int | None:
    if quantity == "time":
        both = np.flatnonzero(~np.isnan(got) & ~np.isnan(true))
        origin = (got[both[0]] - true[both[0]]) if both.size else 0.0
        far = np.abs(got - origin - true) > case.time_tolerance
    else:
        far = np.abs(got - true) > 1e-9 * np.abs(true) + 1e-24
    different = np.flatnonzero(far | (np.isnan(got) != np.isnan(true)))
    return int(different[0]) if different.size else None


def collected(folder: Path = Path(__file__).parent) -> Iterator[tuple[str, Case]]:
    """All cases of the modules `hostile_*.py` beside this one, with the name of their module."""
    for path in sorted(folder.glob("hostile_*.py")):
        for case in getattr(importlib.import_module(path.stem), "CASES", ()):
            yield path.stem, case


def main(words: Iterable[str]) -> None:
    """Print case, verdict and detail, and the counts; if `words` are given, of cases whose name, kind or verdict holds one."""
    wanted, counts = tuple(words), Counter[tuple[str, str]]()
    with tempfile.TemporaryDirectory() as folder:
        for module, case in collected():
            judged = judge(case, Path(folder))
            counts["all", judged.word] += 1
            counts[module, judged.word] += 1
            if not wanted or any(w in f"{module} {case.name} {case.kind} {judged.word}" for w in wanted):
                print(f"{case.name:44} {judged.word:18} {judged.detail.replace(str(folder), '')[:400]}")
    for (module, word), n in sorted(counts.items()):
        print(f"{n:5} {word:20} {module}")


if __name__ == "__main__":
    main(sys.argv[1:])

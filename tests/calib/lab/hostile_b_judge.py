"""A case of the corpus in, a verdict on what the reader made of it out: right, refused, or which kind of error."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from hostile_b_case import Bools, Case, Floats

import calib.lab as lab
from calib.errors import InputError

RIGHT = "right"
REFUSED_WELL = "refused well"
REFUSED_BADLY = "refused badly"
NEEDLESSLY = "refused needlessly"
SILENT = "silent error"
TOLD_WRONGLY = "told wrongly"
BY_LUCK = "right by luck"
UNNAMED = "right, column unnamed"
CRASHED = "crashed"

VERDICTS = (RIGHT, REFUSED_WELL, REFUSED_BADLY, NEEDLESSLY, UNNAMED, BY_LUCK, TOLD_WRONGLY, SILENT, CRASHED)
#: What a corpus may hold where the reader is as it should be.
GOOD = (RIGHT, REFUSED_WELL)

#: Field of a reading -> the word by which an advice names the option.
_OPTIONS = {
    "sign": r"--sign|\bsign\b",
    "columns": r"--columns|\bcolumns\b",
    "specimen": r"--specimen|\bspecimen\b",
    "where": r"--where|\bwhere\b",
    "units": r"--units|\bunits\b",
    "scale": r"--scale|\bscale\b",
    "decimal": r"--decimal|\bdecimal\b",
    "sheet": r"--sheet|\bsheet\b",
}
#: A refusal without a place names a number, a name in quotes, a column or an option.
_NAMED = re.compile(r"[\"'“«\d]|max_\w+|\bcolumn\b")
_LEFT_OUT = re.compile(r"not used|not understood|not read|left out")
_ESSENTIAL = ("time", "displacement", "force", "capacitance", "dissipation")


@dataclass(frozen=True)
class Judgement:
    """A verdict with what it rests on."""

    verdict: str
    detail: str = ""


@dataclass(frozen=True)
class Outcome:
    """What was made of a file: rows, quantities, everything that was told."""

    lines: list[int]
    columns: Mapping[str, Floats]
    observed: Mapping[str, Floats]
    used: Bools
    reasons: tuple[str, ...]
    told: tuple[str, ...]


def attempt(case: Case, path: Path, reading: Mapping[str, Any], use: Mapping[str, Any]) -> Outcome:
    """Read and observe the file, as `calib read` does."""
    table = lab.read_lab_file(path, lab.Reading(**reading))
    seen = lab.observe(table, lab.Use(**use))
    observed = dict(seen.channels)
    if seen.displacement is not None:
        observed["displacement"] = seen.displacement
    unread = [f"{u.what}: {u.reason}" for u in table.unread]
    sources = [f'{q} from "{s}"' for q, s in table.sources.items()]
    rows = sorted({r for r in (*table.reasons, *seen.reason) if r})
    return Outcome(
        lines=[int(n) for n in table.lines],
        columns=table.columns,
        observed=observed,
        used=np.asarray(seen.used, bool),
        reasons=table.reasons,
        told=(*table.notes, *unread, seen.sign_note, *rows, *(f"source: {s}" for s in sources)),
    )


def judge(case: Case, folder: Path) -> Judgement:
    """Write the file into a folder, read it, and say what became of it."""
    path = folder / f"lab{case.suffix}"
    path.write_bytes(case.data)
    try:
        outcome = attempt(case, path, case.reading, case.use)
    except InputError as error:
        return _of_refusal(case, path, error)
    except Exception as error:
        return Judgement(CRASHED, f"{type(error).__name__}: {error}")
    if case.expected == "refuse":
        return _wrong(outcome, ["read, though it cannot be: " + ", ".join(q for q in outcome.columns)], tuple(outcome.columns))
    return judge_reading(case, outcome)


def _of_refusal(case: Case, path: Path, error: InputError) -> Judgement:
    text = str(error).replace(str(path), path.name)
    if case.expected == "read":
        return Judgement(NEEDLESSLY, text)
    lacking = []
    if not any(f.line is not None or f.column is not None or _NAMED.search(f"{f.message} {f.advice}") for f in error.faults):
        lacking.append("no line, column or value is named")
    if not all(f.advice for f in error.faults):
        lacking.append("a fault has no advice")
    if case.refusal and not re.search(case.refusal, text, re.IGNORECASE | re.DOTALL):
        lacking.append(f"nothing like /{case.refusal}/ is said")
    if case.way_out is not None:
        unsaid = [q for q in case.way_out if not re.search(_OPTIONS[q], text)]
        columns = case.way_out.get("columns", {})
        if columns and not any(re.search(rf'--columns "?{q}=', text) for q in columns):
            unsaid.append(" or ".join(columns))
        if unsaid:
            lacking.append(f"the advice has no option for {', '.join(unsaid)}")
        lacking += _dead_end(case, path)
    if lacking:
        return Judgement(REFUSED_BADLY, f"{'; '.join(lacking)} | {text}")
    return Judgement(REFUSED_WELL, text)


def _dead_end(case: Case, path: Path) -> list[str]:
    """Why the way out of a refusal does not lead out; nothing where it does."""
    use = case.use if case.way_use is None else case.way_use
    way = case.way_out or {}
    both = {q: {**case.reading[q], **way[q]} for q in way if isinstance(way[q], Mapping) and q in case.reading}
    reading = {**case.reading, **way, **both}
    try:
        outcome = attempt(case, path, reading, use)
    except InputError as error:
        return [f"the way out {reading} is refused: {str(error).replace(str(path), path.name)}"]
    except Exception as error:
        return [f"the way out {reading} crashes: {type(error).__name__}: {error}"]
    faults, _ = _faults(case, outcome, {**case.truth, **case.way_truth})
    return [f"the way out {reading} is wrong: {'; '.join(faults)}"] if faults else []


def judge_reading(case: Case, outcome: Outcome) -> Judgement:
    """What is to be said of a file that was read."""
    faults, quantities = _faults(case, outcome, case.truth)
    told = " | ".join(outcome.told)
    if faults and all(f.endswith(" is not read") for f in faults) and any(_LEFT_OUT.search(t) for t in outcome.told):
        return Judgement(NEEDLESSLY, f"{'; '.join(faults)} | told: {told}")
    if faults:
        return _wrong(outcome, faults, quantities)
    excluded = _excluded(case, outcome)
    if excluded:
        return Judgement(NEEDLESSLY, excluded)
    choices = " | ".join(t for t in outcome.told if not t.startswith("source: "))
    if case.choice and not re.search(case.choice, choices, re.IGNORECASE | re.DOTALL):
        return Judgement(BY_LUCK, f"nothing like /{case.choice}/ is told | {told}")
    unnamed = [c for c in case.left if not re.search(rf'"{re.escape(c)}(?:"| ?[\[(,/])', told)]
    if unnamed:
        return Judgement(UNNAMED, f"{', '.join(unnamed)} | {told}")
    return Judgement(RIGHT)


def _wrong(outcome: Outcome, faults: list[str], quantities: tuple[str, ...]) -> Judgement:
    """A silent error, or one that a note states as a fact: one that speaks of the quantity or of the column."""
    sources = [t for t in outcome.told if t.startswith("source: ")]
    columns = [s.split(" from ", 1)[1] for s in sources if any(s.startswith(f"source: {q} ") for q in quantities)]
    words = [q for q in quantities if q] + columns
    about = [t for t in outcome.told if t not in sources and any(w.lower() in t.lower() for w in words)]
    if about:
        return Judgement(TOLD_WRONGLY, f"{'; '.join(faults)} | told: {' | '.join(about)}")
    return Judgement(SILENT, f"{'; '.join(faults)} | told: {' | '.join(t for t in outcome.told if t)}")


def _excluded(case: Case, outcome: Outcome) -> str:
    """A benign row that is not usable costs the lab its data."""
    where = {n: i for i, n in enumerate(case.lines)}
    free = np.zeros(len(case.lines), bool) if case.free is None else case.free
    holds = np.all([~np.isnan(v) for v in case.truth.values()], axis=0) if case.truth else ~free
    out = [
        n
        for n, r in zip(outcome.lines, outcome.reasons, strict=True)
        if r and n in where and not free[where[n]] and holds[where[n]]
    ]
    if len(out) > 0.05 * len(case.lines):
        said = sorted({r for r in outcome.reasons if r})
        return f"{len(out)} of {len(case.lines)} rows are excluded: {'; '.join(said[:3])}"
    return ""


def _faults(case: Case, outcome: Outcome, truth: Mapping[str, Floats]) -> tuple[list[str], tuple[str, ...]]:
    """What is wrong with what was read, and of which quantities."""
    faults: list[str] = []
    wrong: list[str] = []
    at = {n: i for i, n in enumerate(outcome.lines)}
    free = np.zeros(len(case.lines), bool) if case.free is None else case.free
    kept = [(i, at[n]) for i, n in enumerate(case.lines) if n in at]
    gone = [n for n, f in zip(case.lines, free, strict=True) if n not in at and not f]
    if gone:
        faults.append(f"{len(gone)} rows are missing, the first in line {gone[0]}")
    known = set(case.lines)
    extra = [n for n, r in zip(outcome.lines, outcome.reasons, strict=True) if n not in known and not r]
    if extra:
        faults.append(f"line {extra[0]} is no reading")
    rows = [(i, j) for i, j in kept if not free[i] and not outcome.reasons[j]]
    if not rows:
        return [*faults, "no row is usable"], ("",)
    true_at, read_at = (np.array(k) for k in zip(*rows, strict=True))
    for q in (*_ESSENTIAL, "frequency", "cycle"):
        if q not in truth:
            if q in outcome.columns and q in _ESSENTIAL and not np.all(np.isnan(outcome.columns[q])):
                faults.append(f"a {q} is read that the file does not have")
                wrong.append(q)
            continue
        if q not in outcome.columns:
            if q not in case.optional:
                faults.append(f"{q} is not read")
                wrong.append(q)
            continue
        read = outcome.columns[q][read_at]
        differing = [_difference(q, t[true_at], read) for t in (truth[q], *case.or_else.get(q, ()))]
        if all(differing):
            i = int(np.argmax(~_same(q, truth[q][true_at], read)))
            faults.append(f"{q} in line {case.lines[true_at[i]]} is {truth[q][true_at][i]:.6g}, read as {read[i]:.6g}")
            wrong.append(q)
    more, signs = _of_signs(case, outcome, free)
    faults += more
    return faults, (*wrong, *signs)


def _of_signs(case: Case, outcome: Outcome, free: Any) -> tuple[list[str], list[str]]:
    """What is wrong with signs and rows after `observe`."""
    faults: list[str] = []
    wrong: list[str] = []
    where = {n: i for i, n in enumerate(case.lines)}
    used = np.array([bool(u) and n in where and not free[where[n]] for n, u in zip(outcome.lines, outcome.used, strict=True)])
    for q, turn in case.turned.items():
        if q not in outcome.observed or q not in outcome.columns:
            continue
        rows = used if used.any() else np.ones(len(used), bool)
        if not np.array_equal(outcome.observed[q][rows], turn * outcome.columns[q][rows], equal_nan=True):
            faults.append(f"{q} has the wrong sign in {'used' if used.any() else 'all'} rows")
            wrong.append(q)
    taken = np.zeros(len(case.lines), bool)
    for n, u in zip(outcome.lines, outcome.used, strict=True):
        if n in where:
            taken[where[n]] = bool(u)
    if case.must_use is not None:
        missing = case.must_use & ~taken & ~free
        if missing.sum() > 0.05 * case.must_use.sum() or (case.use and missing.any()):
            faults.append(
                f"{int(missing.sum())} of {int(case.must_use.sum())} rows of the wanted branch are not used, "
                f"the first in line {case.lines[int(np.argmax(missing))]}"
            )
            wrong.append("branch")
    if case.must_not_use is not None:
        strange = case.must_not_use & taken & ~free
        if strange.any():
            faults.append(
                f"{int(strange.sum())} rows are used that are not of the wanted part, "
                f"the first in line {case.lines[int(np.argmax(strange))]}"
            )
            wrong.append("branch")
    return faults, wrong


def _same(quantity: str, true: Floats, read: Floats) -> Any:
    if quantity == "time":  # which moment is zero is the file's clock's, or the day's
        true, read = true - true[0], read - read[0]
        return np.isclose(read, true, rtol=1e-7, atol=2e-6, equal_nan=True)
    scale = np.nanmax(np.abs(true)) if np.any(~np.isnan(true)) else 1.0
    return np.isclose(read, true, rtol=1e-6, atol=1e-9 * scale, equal_nan=True)


def _difference(quantity: str, true: Floats, read: Floats) -> bool:
    return not bool(np.all(_same(quantity, true, read)))

"""A mutant in, one verdict on how it was read out, with what was read, what may be, and where."""

from __future__ import annotations

import math
import re
import signal
import traceback
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import FrameType

import numpy as np
import numpy.typing as npt

from calib.errors import InputError
from calib.lab import LabTable, Observations, observe, read_lab_file
from mutants.document import Document, Row, Written, written
from mutants.mentions import SilentError, columns_named, is_named, lines_mentioned, lines_named, said_of
from mutants.presses import still_pressed

#: Verdicts that fail the run, and those that do not, the worse first.
FAILURES = ("SILENT", "CRASH", "NO ADVICE")
VERDICTS = ("as it should", "changes nothing", "excluded", "named", "refused", "excluded more", *FAILURES)

#: A file that takes longer is a crash [s of the processor].
LIMIT = 4.0


@dataclass(frozen=True)
class Verdict:
    """What came of a mutant: one of `VERDICTS`, and in words what and where."""

    verdict: str
    what: str


class TooSlowError(BaseException):
    """Raised by the watchdog; no reader can catch it as an `Exception`."""


def _bark(_signal: int, _frame: FrameType | None) -> None:
    raise TooSlowError


def judge(doc: Document, plain: Document, folder: Path) -> Verdict:
    """Read a mutant and say what came of it.

    Parameters
    ----------
    doc : the mutant.
    plain : the document before it was changed.
    folder : where the file is written.

    Returns
    -------
    The verdict.
    """
    before = signal.signal(signal.SIGPROF, _bark)
    signal.setitimer(signal.ITIMER_PROF, LIMIT)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return _judge(doc, plain, folder)
    except InputError as error:
        return _refusal(error)
    except SilentError as error:
        return Verdict("SILENT", str(error))
    except TooSlowError:
        return Verdict("CRASH", f"not done after {LIMIT:g} s of the processor")
    except Exception:
        return Verdict("CRASH", traceback.format_exc(limit=-3))
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def _refusal(error: InputError) -> Verdict:
    text = str(error).replace(str(error.faults[0].path) if error.faults else "", "")
    for fault in error.faults:
        placed = fault.line is not None or fault.column is not None or re.search(r'"[^"]*"|\d', fault.message)
        if not fault.message or not fault.advice or not placed:
            return Verdict("NO ADVICE", f"refused: {text}")
    return Verdict("refused", text)


def _read(doc: Document, folder: Path) -> tuple[Written, LabTable, Observations]:
    out = written(doc)
    path = folder / doc.path.name
    path.write_bytes(out.data)
    table = read_lab_file(path, doc.reading)
    return out, table, observe(table)


def _judge(doc: Document, plain: Document, folder: Path) -> Verdict:
    out, table, seen = _read(doc, folder)
    if doc.refuse:
        raise SilentError(f"read, with columns from {dict(table.sources)}; a choice must be made or the file refused")
    said = said_of(table)
    left_out, more, changed = _rows(doc, plain, out, table, seen, said)
    named = columns_named(doc, table, said)
    named |= lines_named(doc, out, table, said)
    if doc.signs and still_pressed(doc, plain):
        _directions(doc, seen)
        if doc.flipped:
            _signs(doc, folder, seen)
    if more:
        return Verdict("excluded more", f"{more[0]}; {len(more)} rows that were not changed are left out")
    if left_out:
        return Verdict("excluded", left_out)
    if named:
        return Verdict("named", "")
    return Verdict("as it should", "") if changed else Verdict("changes nothing", "")


def _expected(doc: Document, column: int, rows: Sequence[Row], factor: float) -> npt.NDArray[np.float64]:
    sign = -1.0 if doc.columns[column].quantity in doc.flipped else 1.0
    return np.array([sign * factor * r.values[column] for r in rows])


def _candidates(doc: Document, quantity: str, source: str) -> list[tuple[int, float]]:
    """Columns and factors by which a quantity may be read: its own column, or one that stands in if that cannot be read."""
    own = [(j, f) for j, c in enumerate(doc.columns) if c.quantity == quantity for f in c.factors]
    spare = [
        (j, f) for j, c in enumerate(doc.columns) if c.stands_in == quantity and (c.name or "?") in source for f in c.factors
    ]
    altered = not own or any(c.added for c in doc.columns if c.stands_in == quantity) or _is_altered(doc, quantity)
    return [*own, *(spare if altered else [])]


def _is_altered(doc: Document, quantity: str) -> bool:
    return any((c.quantity == quantity and "(" in (c.name or "")) or "[" in (c.name or "") for c in doc.columns)


def _rows(
    doc: Document, plain: Document, out: Written, table: LabTable, seen: Observations, said: str
) -> tuple[str, list[str], bool]:
    """What of the changed rows was left out, which others were, and if anything is otherwise than it was before."""
    rows = [(n, v) for n, v in zip(out.lines, doc.body, strict=True) if isinstance(v, Row)]
    place = {int(n): k for k, n in enumerate(table.lines)}
    if len(place) != len(table.lines):
        raise SilentError("a line of the file is read as two rows")
    ours = {n for n, _ in rows}
    for n, k in place.items():
        if n not in ours and not table.reasons[k] and any(math.isfinite(v[k]) for v in table.columns.values()):
            raise SilentError(f"line {n} is no row, and is read as {_reading(table, k)}")
    told = lines_mentioned([n for n, row in rows if n not in place and not row.absent], said)
    left_out, more, kept = "", [], []
    for n, row in rows:
        at = place.get(n)
        excusable = row.doubtful or row.absent or doc.doubt_all
        reason = "" if at is None else table.reasons[at]
        if at is None and not row.absent and n not in told:
            raise SilentError(f"line {n} is left out without a word")
        if at is None or reason:
            if not excusable:
                more.append(f"line {n}: {reason or 'not among the rows'}")
            elif not row.absent:
                left_out = left_out or f"line {n}: {reason or 'not among the rows'}"
        elif row.absent:
            raise SilentError(f"line {n} is read, though the user chose other rows")
        else:
            kept.append((at, row, n))
    used = np.array([k for k, _, _ in kept], dtype=int)
    taken = [row for _, row, _ in kept]
    changed = len(taken) != sum(isinstance(v, Row) for v in plain.body)
    for quantity, values in table.columns.items():
        if not len(used):
            continue
        options = _candidates(doc, quantity, table.sources[quantity])
        if not options and quantity == "frequency":
            continue
        found = values[used]
        failure = f'{quantity} is read from "{table.sources[quantity]}", which may not be read'
        for j, factor in options:
            failure, lost = _differs(doc, j, factor, found, kept, seen, quantity)
            if not failure:
                left_out = left_out or lost
                word = doc.columns[j].told
                if word and not is_named(word, said):
                    failure = f'{quantity} is read from "{table.sources[quantity]}", and no note says how "{word}" was taken'
                break
        if failure:
            raise SilentError(failure)
        old = plain.index(quantity)
        if old is None:
            changed = True
        else:
            before = {r.origin: r.values[old] * plain.columns[old].factors[0] for r in plain.body if isinstance(r, Row)}
            was = np.array([before.get(r.origin, math.nan) for r in taken])
            changed |= not np.allclose(found, was, rtol=1e-9, atol=0.0, equal_nan=True)
    return left_out, more, changed


def _differs(
    doc: Document,
    j: int,
    factor: float,
    found: npt.NDArray[np.float64],
    kept: Sequence[tuple[int, Row, int]],
    seen: Observations,
    quantity: str,
) -> tuple[str, str]:
    """Where readings are none that the column may have, and which doubtful ones are missing; "" for nowhere and none."""
    expected = _expected(doc, j, [row for _, row, _ in kept], factor)
    if quantity == "time" and doc.free_time:
        both = np.flatnonzero(np.isfinite(found) & np.isfinite(expected))
        if len(both):
            found, expected = found - found[both[0]], expected - expected[both[0]]
    # Seconds since 1970 hold differences to a quarter of a microsecond.
    tolerance = 1e-6 if quantity == "time" and doc.free_time else 1e-9 * np.abs(np.nan_to_num(expected))
    same = np.isnan(found) & np.isnan(expected) | (np.abs(found - expected) <= tolerance)
    lost = ""
    for k in map(int, np.flatnonzero(~same)):
        at, row, line = kept[k]
        if math.isnan(found[k]):
            if not (row.doubtful or doc.doubt_all):
                return f"{quantity} in line {line} is not read, which is {expected[k]:.10g}", ""
            if not seen.reason[at]:
                return f"{quantity} in line {line} is not read, without a reason", ""
            lost = lost or f"line {line}: {seen.reason[at]}"
            continue
        right = "nothing" if math.isnan(expected[k]) else f"{expected[k]:.10g}"
        if math.isnan(expected[k]) and _why(seen, at):
            lost = lost or f"line {line}: {seen.reason[at]}"
            continue
        return f"{quantity} in line {line} is read as {found[k]:.10g}, right is {right} ({int((~same).sum())} such rows)", ""
    return "", lost


def _why(seen: Observations, at: int) -> bool:
    """Whether a row is left out for a reason of its own, and not for its place in the press."""
    reason = seen.reason[at]
    usual = ("unloading", "hold", "cycle", "loading", "before", "after")
    return bool(reason) and not any(word in reason for word in usual)


def _reading(table: LabTable, at: int) -> str:
    return ", ".join(f"{q} {v[at]:.6g}" for q, v in table.columns.items())


def _directions(doc: Document, seen: Observations) -> None:
    """Hold the direction of compression against that of the whole file, for the columns in which their own numbers stand."""
    for quantity, right in doc.turned.items():
        column = next((c for c in doc.columns if c.quantity == quantity), None)
        values = getattr(seen, quantity)
        if column is None or values is None or (column.name or "") not in seen.table.sources[quantity]:
            continue
        found = float(np.sign(np.nansum(values * seen.table.columns[quantity])))
        if found * (-1.0 if quantity in doc.flipped else 1.0) != right:
            raise SilentError(f"{quantity} after `observe` is negative in compression ({seen.sign_note})")


def _signs(doc: Document, folder: Path, seen: Observations) -> None:
    """Hold what was understood of a mutant with flipped signs against the same without, but for rows that both leave out."""
    try:
        _, _, plain = _read(replace(doc, flipped=frozenset()), folder)
    except InputError:
        return
    either = [not (a and b) for a, b in zip(plain.table.reasons, seen.table.reasons, strict=True)]
    for name in ("force", "displacement"):
        one, other = (None if v is None else v[either] for v in (getattr(plain, name), getattr(seen, name)))
        if one is not None and other is not None and not np.allclose(one, other, rtol=1e-9, atol=1e-15, equal_nan=True):
            turned = np.allclose(one, -other, rtol=1e-9, atol=1e-15, equal_nan=True)
            raise SilentError(f"{name} after `observe` {'has the other sign' if turned else 'differs'} ({seen.sign_note})")
    if not np.array_equal(plain.used, seen.used):
        raise SilentError(f"{int(seen.used.sum())} rows are used, without the flipped sign {int(plain.used.sum())}")

"""Files of which one channel jumps alone, or cells of which are cut to fewer digits; and those whose jumps have happened."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
from hostile_cases import Case, truth
from hostile_press import FloatArray, Texts, comma, content, lines_of, press, si, texts

HEADS = ("Time (s)", "Extension (mm)", "Load (N)", "Cp (pF)")
SI = ("1", "1e-3", "1", "1e-12")
QUANTITIES = ("time", "displacement", "force", "capacitance")
DECIMALS = (2, 4, 3, 3)
P = press(160, seed=71)
WITNESSES: tuple[tuple[int, ...], ...] = ((0, 1, 2, 3), (0, 2, 3), (0, 3), (0, 1, 3))
T, X, F, C = (np.array(column, dtype=np.float64) for column in (P.t, P.d, P.f, P.c))
TOP = 96  # the row in which the press turns
NOISE = np.random.default_rng(72).normal(size=(4, 600))
ROWS = np.arange(T.size)


def case(
    name: str,
    kind: str,
    columns: Sequence[FloatArray],
    may: Literal["must_read", "must_refuse", "may_refuse"],
    *,
    which: Sequence[int] = (0, 1, 2, 3),
    told: tuple[str, ...] = (),
    lost: range = range(0),
    blame: tuple[str, ...] = ("jump", "jumps", "from this line on"),
) -> Case:
    """A file of a press, of which the readings of the columns `which` are written, and what it is worth.

    Parameters
    ----------
    name, kind : of the case.
    columns : all four, in the units of `HEADS`.
    may : what may become of it.
    which : numbers of the columns that the file has.
    told : words that a note has to have.
    lost : rows that may be left out.
    blame : words of which a refusal has to have one.
    """
    written = [texts(columns[q], DECIMALS[q]) for q in which]
    lines, numbers = lines_of([HEADS[q] for q in which], written)
    right = {QUANTITIES[q]: si(c, SI[q]) for q, c in zip(which, written, strict=True)}
    excused = frozenset(numbers[r] for r in lost)
    if may == "must_refuse":
        return Case(name, kind, content(lines), "must_refuse", None, blame=blame)
    return Case(name, kind, content(lines), may, truth(numbers, **right), told=told, excused=excused)


def _wrapped(values: FloatArray, limit: float, span: float) -> FloatArray:
    return np.asarray(np.where(values > limit, values - span, values))


def _overflows() -> Iterator[Case]:
    kind = "a counter that overflows"
    for share in (0.5, 0.65, 0.8):
        limit = share * float(np.max(F))
        for name, span in (("signed", 2 * limit), ("unsigned", limit)):
            for sign in (1.0, -1.0):
                wrapped = sign * _wrapped(F, limit, span)
                for there in ((0, 1, 2, 3), (0, 1, 2)):
                    told = f"force_{name}_{share}_{sign:+.0f}_{len(there)}"
                    yield case(told, kind, (T, X, wrapped, C), "must_refuse", which=there)
        limit = float(np.min(C)) + share * float(np.ptp(C))
        for span, what in ((float(np.ptp(C)), "12_bits"), (1.5 * float(np.ptp(C)), "8_bits")):
            for which in WITNESSES:
                name = f"capacitance_{what}_{share}_{'_'.join(map(str, which))}"
                wrapped = _wrapped(C, limit, span)
                # A short stretch that is beyond the limit is left out.
                over = np.flatnonzero(wrapped != C)
                lost = range(int(over[0]), int(over[-1]) + 1) if over.size < 0.2 * C.size else range(0)
                yield case(name, kind, (T, X, F, wrapped), "must_read" if lost else "must_refuse", which=which, lost=lost)
    for limit in (0.9, 1.1):
        for seen in ((0, 1, 2, 3), (0, 1, 2), (0, 1, 3)):
            name = f"displacement_dial_{limit}_{'_'.join(map(str, seen))}"
            yield case(name, kind, (T, _wrapped(X, limit, limit), F, C), "must_refuse", which=seen)


def _ranges() -> Iterator[Case]:
    kind = "a meter's range or offset"
    for row in (40, 60, 120):
        for name, after in (
            ("offset_up", C + 1.3),
            ("offset_down", C - 2.0),
            ("times_two", 2 * C),
            ("half", C / 2),
            ("gain", 1.04 * C),
            ("baseline", C - C[row]),
        ):
            stepped = np.where(row <= ROWS, after, C)
            for which in ((0, 1, 2, 3), (0, 2, 3)):
                yield case(f"{name}_{row}_{len(which)}", kind, (T, X, F, stepped), "must_refuse", which=which)
            yield case(f"{name}_{row}_place", kind, (T, X, F, stepped), "may_refuse", which=(0, 1, 3), told=("jump|jumps",))
    for row, n in ((45, 6), (60, 14), (110, 8)):
        for level in (0.02, 140.0):
            lost = np.where((row <= ROWS) & (row + n > ROWS), level + 0.004 * NOISE[0, : T.size], C)
            name = f"lost_lead_{row}_{n}_{level}"
            yield case(name, "a lead that is lost", (T, X, F, lost), "must_read", lost=range(row, row + n))


def _zeros() -> Iterator[Case]:
    for row in (50, 65, 80, 120):
        tared = np.where(row <= ROWS, F - F[row], F)
        anew = np.where(row <= ROWS, X - X[row], X)
        for which in ((0, 1, 2, 3), (0, 1, 2), (1, 2)):
            end = f"{row}_{'_'.join(map(str, which))}"
            yield case(f"tared_{end}", "a tare in contact", (T, X, tared, C), "may_refuse", which=which, told=("jump|jumps",))
            if row < TOP:
                told = ("jump|jumps",)
                yield case(f"place_zeroed_{end}", "a place zeroed", (T, anew, F, C), "may_refuse", which=which, told=told)


def _happened() -> Iterator[Case]:
    kind = "benign jumps of all"
    n = 160
    snap = np.where((ROWS >= 20) & (ROWS < 35), F - 0.06 * (35 - ROWS) / 15, F)
    yield case("snap_in_of_a_press", kind, (T, X, snap, np.where(ROWS >= 20, C + 0.05, C)), "must_read")
    off = np.where((ROWS > 130) & (ROWS < 150), F - 0.1 * (ROWS - 130), F)
    yield case("pull_off_after_a_long_pull", kind, (T, X, off, C), "must_read")
    slips = sum(np.where((r <= ROWS) & (ROWS <= TOP), 0.25 * k, 0.0) for k, r in enumerate((60, 67, 74, 81, 88), 1))
    stick = F - slips * (F > 1)
    yield case("stick_slip", kind, (T, X, stick, 97.4 + 3.1 * (np.clip(stick, 0, None) / 5) ** 0.8), "must_read")
    for coarse in (0.03, 0.1):
        quantised = [np.round(v / (coarse * s)) * coarse * s for v, s in zip((X, F, C), (0.5, 3.0, 1.0), strict=True)]
        yield case(f"counts_{coarse}", kind, (T, *quantised), "must_read")
    for every in (3, 8, 20):
        slow = C[ROWS // every * every]
        yield case(f"slow_meter_{every}", kind, (T, X, F, slow), "must_read")
    for row in (40, 100):
        pause = np.where(row <= ROWS, T + 60.0, T)
        yield case(f"pause_{row}", kind, (pause, X, np.where(row <= ROWS, 0.93 * F, F), C - 0.05 * (row <= ROWS)), "must_read")
    level = np.repeat([0.0, 0.2, 0.5, 0.8, 1.0, 0.6, 0.3, 0.0], n // 8)
    relaxing = np.asarray(level**1.5, dtype=np.float64) * (1 - 0.1 * (1 - np.exp(-(ROWS % (n // 8)) / 5)))
    stairs: tuple[FloatArray, ...] = (
        T,
        np.asarray(1.2 * level + 1e-4 * NOISE[1, :n], dtype=np.float64),
        np.asarray(6 * relaxing + 0.003 * NOISE[2, :n], dtype=np.float64),
        np.asarray(97 + 2 * level + 0.004 * NOISE[3, :n], dtype=np.float64),
    )
    for which in ((0, 1, 2, 3), (0, 1, 2), (0, 3)):
        yield case(f"steps_and_holds_{len(which)}", kind, stairs, "must_read", which=which)
    for broken in (0.0, 0.3, 0.6):
        left = np.where(ROWS >= 70, broken * F, F)
        gone = 97.4 + 3.1 * (np.clip(left, 0, None) / 5) ** 0.8 + 0.004 * NOISE[1, :n]
        yield case(f"break_to_{broken}", kind, (T, X, left + 0.003 * NOISE[2, :n], gone), "must_read")
    cycles = press(120, seed=73)
    repeated = [np.tile(np.array(c, dtype=np.float64), 4) for c in (cycles.d, cycles.f, cycles.c)]
    yield case("four_cycles", kind, (np.linspace(0.0, 47.9, 480), *repeated), "must_read")
    far = np.where(ROWS < 8, X - 9.0, X)
    yield case("fast_approach", kind, (T, far, F, C), "must_read")


def _short(cell: str, digits: int, kind: str) -> float:
    """A number with fewer digits."""
    return float(f"{float(cell):.{digits}f}" if kind == "rounded" else cell[: cell.index(".") + 1 + digits])


def _cut() -> Iterator[Case]:
    heads, columns = HEADS, [P.t, P.d, P.f, P.c]
    for at, start, digits in ((1, 50, 0), (1, 70, 1), (2, 60, 0), (2, 84, 1), (3, 50, 0), (3, 90, 1), (3, 110, 0), (0, 37, 0)):
        for kind in ("rounded", "cut"):
            # What is cut off must be more than noise.
            row = next(
                r for r in range(start, start + 30) if abs(float(columns[at][r]) - _short(columns[at][r], digits, kind)) > 0.03
            )
            short = f"{_short(columns[at][row], digits, kind):.{digits}f}"
            for apart, mark in ((",", "."), (";", ",")):
                changed: list[Texts] = list(columns)
                changed[at] = (*columns[at][:row], short, *columns[at][row + 1 :])
                lines, numbers = lines_of(heads, [c if mark == "." else comma(c) for c in changed], sep=apart)
                right = {q: si(c, by) for q, c, by in zip(QUANTITIES, changed, SI, strict=True)}
                right[QUANTITIES[at]] = si([*columns[at][:row], "", *columns[at][row + 1 :]], SI[at])
                name = f"{kind}_{at}_{row}_{'point' if mark == '.' else 'comma'}"
                damaged = frozenset({numbers[row]})
                yield Case(
                    name,
                    "digits cut off",
                    content(lines),
                    "may_refuse",
                    truth(numbers, **right),
                    damaged=damaged,
                    excused=damaged,
                )
    trimmed = [tuple(c.rstrip("0").rstrip(".") or "0" for c in column) for column in columns]
    lines, numbers = lines_of(heads, trimmed)
    right = {q: si(c, by) for q, c, by in zip(QUANTITIES, trimmed, SI, strict=True)}
    yield Case("zeros_left_away", "benign digits", content(lines), "must_read", truth(numbers, **right))


CASES = (*_overflows(), *_ranges(), *_zeros(), *_happened(), *_cut())

"""Short records in which a channel jumps near the touch or the turn, or whose remarks speak of a zero that was set anew."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Literal

import numpy as np
from hostile_cases import Case, truth
from hostile_jumps import DECIMALS, HEADS, QUANTITIES, SI, case
from hostile_press import FloatArray, content, lines_of, press, si, texts

REMARKS = (
    "tare",
    "Load zeroed",
    "reset load",
    "Nullung",
    "Tarieren",
    "mise à zéro",
    "RAZ",
    "puesta a cero",
    "azzeramento",
    "op nul gezet",
    "zerowanie",
    "vynulováno",
    "nollad",
    "nullstilt",
    "taaraus",
    "nullázás",
    "sıfırlandı",
    "обнуление",
    "清零",
    "リセット",
    "영점",
)


def _numbers(rows: int, seed: int) -> tuple[tuple[FloatArray, ...], int, int]:
    """Columns of a press, the row in which it turns, and the first in contact."""
    p = press(rows, seed=seed)
    columns = tuple(np.array(column, dtype=np.float64) for column in (p.t, p.d, p.f, p.c))
    return columns, rows * 3 // 5, int(np.argmax(columns[1] > 0.15))


_case = partial(case, blame=("jump", "jumps"))


def _overflows() -> Iterator[Case]:
    for rows in (60, 90):
        (t, x, f, c), turn, _ = _numbers(rows, 91)
        for before in (2, 3, 4, 5):
            limit = float(f[turn - before])
            for name, span in (("signed", 2 * limit), ("unsigned", limit)):
                wrapped = np.where(f > limit, f - span, f)
                over = np.flatnonzero(wrapped != f)
                # What is beyond the limit in a few rows contradicts the others and is left out; from zero on it may be a tare.
                short = over.size <= 3
                may: Literal["must_read", "must_refuse", "may_refuse"] = "must_read" if short else "may_refuse"
                lost = range(int(over[0]), int(over[-1]) + 1)
                for which in ((0, 1, 2, 3), (0, 1, 2)):
                    told = () if short else ("jump|jumps|contradicts",)
                    word = f"overflow_{name}_{rows}_{before}_{len(which)}"
                    yield _case(word, "an overflow at the turn", (t, x, wrapped, c), may, which=which, told=told, lost=lost)
        for behind in (1, 2, 3):
            doubled = np.where(np.arange(rows) >= turn + behind, 2 * c, c)
            word = f"range_{rows}_{behind}"
            yield _case(word, "a range at the turn", (t, x, f, doubled), "must_refuse", which=(0, 2, 3))


def _tares() -> Iterator[Case]:
    for rows in (45, 70, 110):
        (t, x, f, c), _, touch = _numbers(rows, 92)
        index = np.arange(rows)
        # In 110 rows the load is within its noise for longer.
        for behind in (3, 5) if rows < 110 else (6, 9):
            row = touch + behind
            tared = np.where(index >= row, f - f[row], f)
            for which in ((0, 1, 2, 3), (0, 1, 2), (0, 2, 3), (1, 2)):
                word = f"tare_{rows}_{behind}_{'_'.join(map(str, which))}"
                yield _case(word, "a tare at the touch", (t, x, tared, c), "may_refuse", which=which, told=("jump|jumps",))
        for behind in (-1, 0, 2):
            for off in (-1.2, 2.4):
                unzeroed = np.where(index < touch + behind, f + off, f)
                word = f"unzeroed_{rows}_{behind}_{off}"
                yield _case(word, "a tare at the touch", (t, x, unzeroed, c), "may_refuse", told=("jump|jumps",))
        back = np.where(index >= touch + 2, x - x[touch + 2], x)
        yield _case(f"place_{rows}", "a place zeroed at the touch", (t, back, f, c), "may_refuse", told=("jump|jumps",))


def _remarks() -> Iterator[Case]:
    columns, _, touch = _numbers(60, 93)
    written = [texts(c, n) for c, n in zip(columns, DECIMALS, strict=True)]
    right = {q: si(c, by) for q, c, by in zip(QUANTITIES, written, SI, strict=True)}
    row = touch + 6
    for k, words in enumerate(REMARKS):
        among, numbers = lines_of(HEADS, written)
        at = numbers[row]
        moved = tuple(n if n < at else n + 1 for n in numbers)
        among.insert(at - 1, f"# {words}")
        events = ["0" if k % 2 else ""] * 60
        events[row] = words
        beside, kept = lines_of((*HEADS, "Event"), [*written, events])
        for place, lines, where in (("line", among, moved), ("cell", beside, kept)):
            yield Case(
                f"remark_{place}_{k}",
                "a remark of a zero",
                content(lines),
                "must_read",
                truth(where, **right),
                named=(f"line {at}",),
                told=("zero",),
            )


def _nothing_was_zeroed() -> Iterator[Case]:
    columns, _, _ = _numbers(60, 94)
    written = [texts(c, n) for c, n in zip(columns, DECIMALS, strict=True)]
    right = {q: si(c, by) for q, c, by in zip(QUANTITIES, written, SI, strict=True)}
    for rows in (45, 60, 110):
        sound, _, _ = _numbers(rows, 95)
        for which in ((0, 1, 2, 3), (0, 1, 2), (0, 2, 3), (0, 1, 3)):
            yield _case(f"sound_{rows}_{''.join(map(str, which))}", "benign short records", sound, "must_read", which=which)
        far = np.where(np.arange(rows) < 4, sound[1] - 9.0, sound[1])
        yield _case(f"approach_{rows}", "benign short records", (sound[0], far, *sound[2:]), "must_read", lost=range(4))
    for k, words in enumerate(("timer reset", "unloading", "target 5 N", "hold")):
        lines, numbers = lines_of((*HEADS, "Comment"), [*written, [words if r == 20 else "" for r in range(60)]])
        yield Case(f"other_remark_{k}", "benign remarks", content(lines), "must_read", truth(numbers, **right))


CASES = (*_overflows(), *_tares(), *_remarks(), *_nothing_was_zeroed())

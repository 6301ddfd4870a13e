"""What happens to files between instrument and desk: loggers that stall, meters that saturate, columns that are moved about."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
from hostile_cases import Case, truth
from hostile_jumps import DECIMALS, HEADS, QUANTITIES, SI
from hostile_press import FloatArray, Texts, comma, content, lines_of, press, si, texts, times

WHICH: tuple[tuple[int, ...], ...] = ((0, 1, 2, 3), (0, 1, 2), (1, 2))


def _press(rows: int, seed: int) -> list[Texts]:
    p = press(rows, seed=seed)
    return [p.t, p.d, p.f, p.c]


def _case(
    name: str,
    kind: str,
    columns: Sequence[Texts],
    may: Literal["must_read", "must_refuse", "may_refuse"],
    *,
    which: Sequence[int] = (0, 1, 2, 3),
    told: tuple[str, ...] = (),
    damaged: range = range(0),
    of: int = 0,
    blame: tuple[str, ...] = (),
    sep: str = ",",
) -> Case:
    """A file of the columns `which`; `damaged` rows hold no reading of column `of`."""
    lines, numbers = lines_of([HEADS[q] for q in which], [columns[q] for q in which], sep=sep)
    if may == "must_refuse":
        return Case(name, kind, content(lines), may, None, blame=blame)
    right = {}
    for q in which:
        cells = [("" if r in damaged and q == of else c.replace(",", ".")) for r, c in enumerate(columns[q])]
        right[QUANTITIES[q]] = si(cells, SI[q])
    lost = frozenset(numbers[r] for r in damaged)
    return Case(name, kind, content(lines), may, truth(numbers, **right), told=told, damaged=lost, excused=lost, blame=blame)


def _stalls() -> Iterator[Case]:
    kind = "a channel that stands still"
    for rows in (50, 90):
        columns = _press(rows, 101)
        turn = rows * 3 // 5
        for q in (1, 2, 3):
            for start, n in ((turn // 2 + 2, 5), (turn - 9, 8)):
                stuck = list(columns)
                stuck[q] = (*columns[q][:start], *[columns[q][start]] * n, *columns[q][start + n :])
                word = f"stall_{rows}_{q}_{start}"
                yield _case(word, kind, stuck, "must_read", damaged=range(start + 1, start + n), of=q)
                late = (*columns[q][:start], *[columns[q][start]] * n, *columns[q][start + 1 : rows - n + 1])
                stuck[q] = late
                if start + 2 * n < turn:
                    yield _case(f"late_{word}", kind, stuck, "must_refuse", blame=("stands", "late"))
        for q, which in ((3, (0, 1, 2, 3)), (3, (0, 2, 3)), (2, (0, 1, 2, 3))):
            v = np.array(columns[q], float)
            top = float(np.quantile(v[:turn], 0.75))
            flat = list(columns)
            flat[q] = texts(np.minimum(v, top), DECIMALS[q])
            word = f"saturates_{rows}_{q}_{len(which)}"
            yield _case(word, "the end of a range", flat, "must_read", which=which, told=("end of its range",))


def _moved() -> Iterator[Case]:
    kind = "cells in other places"
    columns = _press(80, 102)
    for row in (30, 44, 62):
        for a, b in ((1, 2), (2, 3), (0, 1)):
            changed = list(columns)
            changed[a], changed[b] = columns[a][:row] + columns[b][row:], columns[b][:row] + columns[a][row:]
            yield _case(f"exchanged_{a}{b}_{row}", kind, changed, "must_refuse", blame=("places", "time", "number"))
    for by in (1, 2):
        order = np.argsort(np.array(columns[by], float), kind="stable")
        for backwards in (False, True):
            way = order[::-1] if backwards else order
            shuffled = [tuple(c[i] for i in way) for c in columns]
            for which in ((1, 2), (1, 2, 3)):
                word = f"sorted_{by}_{len(which)}_{backwards}"
                yield _case(word, "rows that were sorted", shuffled, "must_refuse", which=which, blame=("order",))
    for every in (2, 3, 5):
        for fill in ("0.000", "-1"):
            for q in (2, 3):
                filled = list(columns)
                filled[q] = tuple(c if r % every == 0 else fill for r, c in enumerate(columns[q]))
                word = f"filled_{q}_{every}_{fill}"
                yield _case(word, "cells that were filled", filled, "must_refuse", blame=("filled", "negative"))


def _switched() -> Iterator[Case]:
    kind = "a unit that is switched in a short record"
    for rows in (45, 60):
        columns = _press(rows, 103)
        turn = rows * 3 // 5
        for row in (turn // 2, turn - 4, turn - 3, turn - 2, turn - 1, turn + 1, turn + 2, turn + 4):
            for unit, factor in (("lbf", "0.2248089431"), ("gf", "101.9716213"), ("mN", "1000")):
                force = (*columns[2][:row], *times(columns[2][row:], factor, 4))
                yield _case(
                    f"to_{unit}_{rows}_{row}",
                    kind,
                    [*columns[:2], force, columns[3]],
                    "must_refuse",
                    which=(0, 1, 2),
                    blame=("from this line on",),
                )


def _damaged() -> Iterator[Case]:
    kind = "damaged cells near each other"
    columns = _press(45, 104)
    for first, second in ((33, 35), (32, 34), (16, 18), (31, 33)):
        for one, other in ((0.1, 0.001), (0.001, 0.1)):
            v = np.array(columns[2], float)
            v[first], v[second] = one * v[first], other * v[second]
            rows = {first, second}
            force = tuple(f"{x:.3f}" if r in rows else c for r, (x, c) in enumerate(zip(v, columns[2], strict=True)))
            lines, numbers = lines_of(HEADS, [*columns[:2], force, columns[3]])
            right = {q: si(c, by) for q, c, by in zip(QUANTITIES, [*columns[:2], force, columns[3]], SI, strict=True)}
            right["force"] = si([("" if r in rows else c) for r, c in enumerate(force)])
            lost = frozenset(numbers[r] for r in rows)
            yield Case(
                f"two_{first}_{one}_{other}",
                kind,
                content(lines),
                "may_refuse",
                truth(numbers, **right),
                damaged=lost,
                excused=lost,
            )


def _appended() -> Iterator[Case]:
    kind = "exports that were appended"
    one, other = _press(60, 105), _press(45, 106)
    first, _ = lines_of(HEADS, one)
    for name, heads, order in (
        ("units", (*HEADS[:2], "Load (mN)", HEADS[3]), (0, 1, 2, 3)),
        ("order", (HEADS[0], HEADS[2], HEADS[1], HEADS[3]), (0, 2, 1, 3)),
        ("same", HEADS, (0, 1, 2, 3)),
    ):
        more, _ = lines_of(heads, [other[q] for q in order])
        for between in ((), ("",)):
            yield Case(f"appended_{name}_{len(between)}", kind, content([*first, *between, *more]), "must_refuse", None)
    more, _ = lines_of((), other)
    for row in (20, 40):
        changed = [c[:row] + comma(c[row:]) for c in one]
        yield _case(f"locale_{row}", "a locale that changes", changed, "may_refuse", sep=";")


def _scaled() -> Iterator[Case]:
    kind = "another range within a record"
    columns = _press(80, 107)
    for q in (1, 2):
        for row in (24, 36):
            for by in (5.0, 0.4):
                v = np.array(columns[q], float)
                changed = list(columns)
                changed[q] = texts(np.where(np.arange(80) >= row, by * v, v), DECIMALS[q])
                yield _case(f"range_{q}_{row}_{by}", kind, changed, "may_refuse", told=("jump|jumps",))


def _sound() -> Iterator[Case]:
    kind = "benign standstills"
    n = 90
    rows = np.arange(n)
    noise = np.random.default_rng(108).normal(size=(3, n))
    hold = np.clip(np.minimum(rows, 36) + np.clip(rows - 52, 0, None) * -1.0, 0, None) / 36
    force = 6 * hold**1.6 * (1 - 0.1 * (1 - np.exp(-np.clip(rows - 36, 0, 16) / 5)))
    t, x = texts(0.1 * rows, 2), texts(1.4 * hold, 3)
    f: FloatArray = np.asarray(force + 0.002 * noise[0], dtype=np.float64)
    c: FloatArray = np.asarray(97 + 2 * hold + 0.002 * noise[1], dtype=np.float64)
    for places in ((3, 3), (1, 2), (2, 1)):
        columns = [t, x, texts(f, places[0]), texts(c, places[1])]
        for which in WHICH:
            yield _case(f"hold_{places[0]}{places[1]}_{len(which)}", kind, columns, "must_read", which=which)
    for every in (3, 5):
        slow = texts(c[rows // every * every], 3)
        yield _case(f"slow_{every}", kind, [t, x, texts(f, 3), slow], "must_read")
    part = _press(45, 109)
    twice = [texts(0.1 * rows, 2), *(column * 2 for column in part[1:])]
    yield _case("two_cycles", kind, twice, "must_read")
    coarse = [twice[0], part[1] * 2, texts(np.array(part[2] * 2, float), 1), texts(np.array(part[3] * 2, float), 1)]
    yield _case("two_cycles_coarse", kind, coarse, "must_read")
    paused = [column[:20] + (column[20],) * 6 + column[20:] for column in part]
    paused[0] = texts(0.1 * np.arange(51), 2)
    yield _case("logger_repeats_all", kind, paused, "must_read")


CASES = (*_stalls(), *_moved(), *_switched(), *_damaged(), *_appended(), *_scaled(), *_sound())

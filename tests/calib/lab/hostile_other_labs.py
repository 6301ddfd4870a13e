"""Hostile files of instruments, languages and loggers that the reader had misread, or refused with advice that led nowhere."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from hostile_cases import Case, Truth, truth
from hostile_press import content, lines_of, press, si, texts

from calib.lab import AS_FOUND, Reading

P = press(90, seed=33)
HEADS = ("Time (s)", "Extension (mm)", "Load (N)", "Cp (pF)")
RISEN = texts(np.maximum.accumulate([float(f) for f in P.f]), 3)


def _table(
    name: str,
    heads: Sequence[str],
    columns: Sequence[Sequence[str]],
    quantities: Sequence[tuple[str, str] | None],
    *,
    may: Any = "must_read",
    above: Sequence[str] = (),
    units: Sequence[str] = (),
    below: Sequence[str] = (),
    sep: str = ";",
    **more: Any,
) -> Case:
    """A case of columns, each with its quantity and its factor to SI; None for one that is no reading."""
    lines, numbers = lines_of(heads, columns, above=above, units=units, below=below, sep=sep)
    own = {q[0]: si(cells, q[1]) for q, cells in zip(quantities, columns, strict=True) if q is not None}
    told = more.pop("truth", truth(numbers, **own))
    return Case(f"other_{name}", "other labs", content(lines), may, told, **more)


T, X, F, C = ("time", "1"), ("displacement", "1e-3"), ("force", "1"), ("capacitance", "1e-12")


def _pushed(name: str, head: str, index: int, may: Any = "must_read", **more: Any) -> Case:
    """The plain file with another name for one of its columns."""
    heads = [*HEADS[:index], head, *HEADS[index + 1 :]]
    return _table(name, heads, (P.t, P.d, P.f, P.c), (T, X, F, C), may=may, **more)


def _names() -> Iterator[Case]:
    heads: tuple[str, ...]
    for k, head in enumerate(("Load<N>", "Load{N}", "Indenter force (N)")):
        yield _pushed(f"force_{k}", head, 2)
    places = (
        "Pos<mm>",
        "δ(mm)",
        "Gap (mm)",
        "Spalt [mm]",
        "Indenter depth (mm)",
        "Extension from preload / mm",
        "Achse Z [mm]",
    )
    for k, head in enumerate((*places, "实际位移 (mm)", "現在位置 (mm)")):
        yield _pushed(f"place_{k}", head, 1)
    for k, wished in enumerate(("目标位移 (mm)", "指令位置 (mm)", "Verplaatsing gewenst (mm)", "Posición consigna (mm)")):
        steps = texts([float(d) + 0.013 for d in P.d], 4)
        heads = ("Time (s)", wished, "Position (mm)", "Load (N)")
        yield _table(f"wish_{k}", heads, (P.t, steps, P.d, P.f), (T, None, X, F), named=(wished,))
    # Of three axes two stand still: only the one that moves is offered.
    still = ("12.0000",) * P.rows
    heads = ("Time (s)", "Pos1 (mm)", "Pos2 (mm)", "Pos3 (mm)", "Fz (N)")
    yield _table("axes", heads, (P.t, still, still, P.d, P.f), (T, None, None, X, F), named=("Pos1 (mm)", "Pos2 (mm)"))


def _units_as_names() -> Iterator[Case]:
    """Units that are spelled out where names would be, and such below names that are not understood."""
    for k, head in enumerate(
        (
            ("seconds", "millimeters", "newtons"),
            ("Sekunden", "Millimeter", "Newton"),
            ("secondes", "millimètres", "newtons"),
            ("Time (s)", "Millimetres", "Newtons"),
        )
    ):
        yield _table(f"units_{k}", head, (P.t, P.d, P.f), (T, X, F), named=head[1:])
    heads = ("Time", "Setpoint", "Force")
    yield _table(
        "units_below",
        heads,
        (P.t, P.d, P.f),
        (T, None, F),
        may="must_refuse",
        truth=None,
        units=("seconds", "millimeters", "newtons"),
        blame=("Setpoint",),
    )


def _peaks() -> Iterator[Case]:
    """The largest force so far, under names of many languages: whatever it is called, its readings show it."""
    names = (
        *("Fmax (N)", "F_pk (N)", "Pic de force (N)", "Force crête (N)", "Spitzenkraft (N)", "Höchstkraft [N]"),
        *("Forza di picco (N)", "Fuerza máx. (N)", "Fuerza pico (N)", "Força máxima (N)", "Break load (N)"),
        *("最大荷重 (N)", "峰值力 (N)", "최대하중 (N)"),
    )
    for k, name in enumerate(names):
        heads = ("Time (s)", "Extension (mm)", name)
        yield _table(
            f"peak_{k}", heads, (P.t, P.d, RISEN), (T, X, None), may="may_refuse", named=(name,), blame=(name, "force")
        )
    for k, name in enumerate(("Load (N)", "Piekkracht (N)")):
        heads = ("Time (s)", "Extension (mm)", name)
        yield _table(f"risen_{k}", heads, (P.t, P.d, RISEN), (T, X, None), may="must_refuse", truth=None, blame=("peak", name))


def _factors() -> Iterator[Case]:
    for k, (head, unit) in enumerate((("Kraft in 10 mN", "0.01 N"), ("Effort en 10 N", "10 N"), ("Load in 0.1 N", "0.1 N"))):
        lines, numbers = lines_of(HEADS[:3], (P.t, P.d, P.f), sep=";")
        lines[0] = ";".join((*HEADS[:2], head))
        true = truth(numbers, time=si(P.t), displacement=si(P.d, "1e-3"), force=si(P.f, unit.split()[0]))
        way = Reading(columns={"force": head}, units={"force": unit})
        yield Case(
            f"other_factor_{k}", "other labs", content(lines), "may_refuse", true, ways_out=((way, true),), blame=(head,)
        )
    heads = ("Time (s)", "Position (mm)", "log10 F (N)")
    yield _table("log", heads, (P.t, P.d, P.f), (T, X, None), may="must_refuse", truth=None, blame=("log10 F (N)",))


def _clocks() -> Iterator[Case]:
    heads: tuple[str, ...]
    columns: tuple[tuple[str, ...], ...]
    every = 5
    rest = ("",) * (P.rows - len(P.t[::every]))
    heads = ("Zeit 1 - schnell [s]", "Kraft [N]", "Weg [mm]", "Zeit 2 - langsam [s]", "Kapazität [pF]")
    columns = (P.t, P.f, P.d, (*P.t[::every], *rest), (*P.c[::every], *rest))
    without = Reading(columns={"capacitance": "none"})
    lines, numbers = lines_of(heads, columns, sep="\t")
    true = truth(numbers, displacement=si(P.d, "1e-3"), force=si(P.f))
    yield Case(
        "other_two_rates", "other labs", content(lines), "must_refuse", None, ways_out=((without, true),), blame=("clock",)
    )
    heads = ("Time (s)", "Load (N)", "Extension (mm)", "No. LCR", "Cp (pF)")
    columns = (P.t, P.f, P.d, (*map(str, range(18)), *rest), (*P.c[::every], *rest))
    lines, numbers = lines_of(heads, columns)
    true = truth(numbers, time=si(P.t), displacement=si(P.d, "1e-3"), force=si(P.f))
    yield Case(
        "other_two_counts", "other labs", content(lines), "must_refuse", None, ways_out=((without, true),), blame=("clock",)
    )
    # A meter that was switched off early has no clock of its own.
    off = (*P.c[:40], *("",) * (P.rows - 40))
    yield _table("meter_off", HEADS, (P.t, P.d, P.f, off), (T, X, F, C))
    for bits, unit, step in ((16, "ms", 700), (32, "us", 50_000)):
        counts = tuple(str((2**bits - 40 * step + step * i) % 2**bits) for i in range(P.rows))
        true_time = step * (1e-3 if unit == "ms" else 1e-6) * np.arange(P.rows, dtype=np.float64)
        lines, numbers = lines_of((f"Time ({unit})", *HEADS[1:3]), (counts, P.d, P.f))
        true = truth(numbers, time=true_time, displacement=si(P.d, "1e-3"), force=si(P.f))
        yield Case(f"other_overflow_{bits}", "other labs", content(lines), "must_read", true, told=("overflow",))
    anew = (*P.t[:45], *P.t[: P.rows - 45])
    lines, numbers = lines_of(HEADS[:3], (anew, P.d, P.f))
    true = truth(numbers, displacement=si(P.d, "1e-3"), force=si(P.f))
    way = Reading(columns={"time": "none"})
    yield Case("other_anew", "other labs", content(lines), "must_refuse", None, ways_out=((way, true),), blame=("begins anew",))


def _rows_said_bad() -> Iterator[Case]:
    bad = (12, 40, 71)
    for k, (name, good, not_good) in enumerate((("Valid", "TRUE", "FALSE"), ("Error", "", "E12"), ("Fehler", "0", "7"))):
        force = tuple("0.777" if i in bad else f for i, f in enumerate(P.f))
        flags = tuple(not_good if i in bad else good for i in range(P.rows))
        lines, numbers = lines_of((*HEADS[:3], name), (P.t, P.d, force, flags), sep=";")
        kept = np.array([np.nan if i in bad else 1.0 for i in range(P.rows)])
        true = truth(numbers, time=si(P.t), displacement=kept * si(P.d, "1e-3"), force=kept * si(force))
        of = frozenset(numbers[i] for i in bad)
        yield Case(
            f"other_bad_rows_{k}", "other labs", content(lines), "must_read", true, damaged=of, excused=of, named=(name,),
            free=frozenset({"displacement", "force"}),
        )  # fmt: skip
    counts = texts(0.01 * np.sin(np.arange(P.rows)), 3)  # of a controller, not of a row
    yield _table("error_of_control", (*HEADS[:3], "Error"), (P.t, P.d, P.f, counts), (T, X, F, None), named=("Error",))


def _capacitances() -> Iterator[Case]:
    heads: tuple[str, ...]
    change = texts([float(c) - float(P.c[0]) + 0.004 for c in P.c], 3)
    yield _table("change", HEADS, (P.t, P.d, P.f, change), (T, X, F, None), may="must_refuse", truth=None, blame=("change",))
    at_rest = texts(20 + 0.001 * np.sin(np.arange(P.rows)), 3)
    heads = (*HEADS[:3], "C0 (pF)")
    yield _table("at_rest", heads, (P.t, P.d, P.f, at_rest), (T, X, F, None), may="must_refuse", truth=None, blame=("at rest",))
    loss = np.array([0.32 + 0.01 * np.sin(i) for i in range(P.rows)])
    series = texts([float(c) * (1 + d * d) for c, d in zip(P.c, loss, strict=True)], 3)
    written = texts(loss, 5)
    said = (
        "Modo: serie",
        "Modèle équivalent : série",
        "PARA1: Cs",
        "Schemat zastępczy: szeregowy",
        "Circuito equivalente: serie",
    )
    for k, line in enumerate(said):
        lines, numbers = lines_of(("Time (s)", "C (pF)", "D"), (P.t, series, written), above=(line,), sep=";")
        d = si(written)
        true = truth(numbers, time=si(P.t), capacitance=si(series, "1e-12") / (1 + d * d), dissipation=d)
        yield Case(f"other_series_{k}", "other labs", content(lines), "must_read", true, told=("series",))
    # What the loss follows from stands beside: nothing to be taken as Cp.
    for k, (head, cells) in enumerate(
        (("Rs (ohm)", texts(loss * 3.2e6, 0)), ("θ (deg)", texts(np.degrees(np.arctan(loss)) - 90, 3)))
    ):
        heads = ("Time (s)", "Cs (pF)", head)
        yield _table(
            f"series_with_{k}", heads, (P.t, series, cells), (T, None, None), may="must_refuse", truth=None, blame=("series",)
        )


def _either(true: Truth, series: Sequence[str], cp: str, cs: str) -> tuple[tuple[Reading, Truth], ...]:
    """A question with two answers, Cp or Cs, and what is read after each."""
    converted = si(series, "1e-12") / (1 + si(P.loss) ** 2)
    as_series = Truth(true.lines, {**true.columns, "capacitance": converted})
    return (
        (Reading(columns={"capacitance": cp}), true),
        (Reading(columns={"capacitance_series": cs}), as_series),
    )


def _advised() -> Iterator[Case]:
    """Refusals whose advice no other file of the corpora provokes; the judge types it."""
    heads: tuple[str, ...]
    lost = tuple(f.replace(".", "") for f in texts([0.21 + 0.02 * i + 0.0003 * (i % 7) for i in range(P.rows)], 5))
    true_force = np.array([int(f) * 1e-5 for f in lost])
    lines, numbers = lines_of(HEADS[:3], (P.t, P.d, lost), sep=";")
    true = truth(numbers, time=si(P.t), displacement=si(P.d, "1e-3"), force=true_force)
    way = Reading(units={"force": "1e-5 N"})
    yield Case("other_lost_marks", "advice", content(lines), "must_refuse", None, ways_out=((way, true),), blame=("Load (N)",))
    trimmed = tuple(f"{0.2 + 0.02 * i + 0.0003 * (i % 7):.5f}".rstrip("0").replace(".", "") for i in range(P.rows))
    lines, _ = lines_of(HEADS[:3], (P.t, P.d, trimmed), sep=";")
    yield Case("other_lost_and_trimmed", "advice", content(lines), "must_refuse", None, blame=("Load (N)",))
    plain = truth(range(2, 2 + P.rows), time=si(P.t), displacement=si(P.d, "1e-3"), force=si(P.f))
    lines, _ = lines_of(("Time (s)", "D", "Load (N)"), (P.t, P.d, P.f))
    way = Reading(columns={"displacement": "D"}, units={"displacement": "mm"})
    yield Case("other_letter_d", "advice", content(lines), "must_refuse", None, ways_out=((way, plain),), blame=("D",))
    lines, _ = lines_of(("Time (s)", "Position (mm)", "Ausfahren (mm)", "Load (N)"), (P.t, ("3.0",) * P.rows, P.d, P.f))
    way = Reading(columns={"displacement": "Ausfahren (mm)"})
    yield Case("other_still", "advice", content(lines), "must_refuse", None, ways_out=((way, plain),), blame=("stands still",))
    lines, _ = lines_of((), (P.t, P.d, P.f), sep=";")
    way = Reading(
        columns={"time": "1", "displacement": "2", "force": "3"}, units={"time": "s", "displacement": "mm", "force": "N"}
    )
    bare = Truth(tuple(range(1, 1 + P.rows)), plain.columns)
    yield Case("other_without_names", "advice", content(lines), "must_refuse", None, ways_out=((way, bare),), blame=("header",))
    heads = ("Time (s)", "1000", "10000")
    lines, numbers = lines_of(heads, (P.t, P.c, tuple(f"{float(c) * 0.9:.3f}" for c in P.c)))
    way = Reading(columns={"capacitance": "1000"}, units={"capacitance": "pF"})
    true = truth(numbers, time=si(P.t), capacitance=si(P.c, "1e-12"))
    yield Case(
        "other_numbers_as_names", "advice", content(lines), "must_refuse", None, ways_out=((way, true),), blame=("1000",)
    )
    tiny = texts([float(d) * 1e-7 for d in P.d], 12)
    lines, _ = lines_of(("Time (s)", "Extension (mm)", "Load (N)"), (P.t, tiny, P.f))
    small = truth(range(2, 2 + P.rows), time=si(P.t), displacement=si(tiny, "1e-3"), force=si(P.f))
    way = Reading(scale="micro")
    yield Case("other_tiny", "advice", content(lines), "must_refuse", None, ways_out=((way, small),), blame=("Extension (mm)",))
    alike = tuple(f"{float(c) * 1.7:.3f}" for c in P.c)
    heads = ("Time (s)", "Cp (pF)", "Cs (pF)", "D")
    lines, numbers = lines_of(heads, (P.t, P.c, alike, P.loss))
    true = truth(numbers, time=si(P.t), capacitance=si(P.c, "1e-12"), dissipation=si(P.loss))
    either = _either(true, alike, "Cp (pF)", "Cs (pF)")
    free = frozenset({"dissipation"})
    yield Case(
        "other_two_capacitors", "advice", content(lines), "must_refuse", None, ways_out=either, free=free, blame=("Cp (pF)",)
    )
    for k, reading in enumerate((Reading(where={"Sampel": "1"}), Reading(columns={"force": "Lod (N)"}))):
        lines, _ = lines_of(HEADS[:3], (P.t, P.d, P.f))
        yield Case(f"other_mistyped_{k}", "advice", content(lines), "must_refuse", None, reading, blame=("Load (N)",))
    both = ("MODE: Cs-D", "Equivalent circuit: parallel")
    lines, numbers = lines_of(("Time (s)", "C (pF)", "D"), (P.t, P.c, P.loss), above=both, sep=";")
    true = truth(numbers, time=si(P.t), capacitance=si(P.c, "1e-12"), dissipation=si(P.loss))
    either = _either(true, P.c, "C (pF)", "C (pF)")
    yield Case("other_both_circuits", "advice", content(lines), "must_refuse", None, ways_out=either, blame=("C (pF)",))


CASES = (*_names(), *_units_as_names(), *_peaks(), *_factors(), *_clocks(), *_rows_said_bad(), *_capacitances(), *_advised())
assert all(c.reading == AS_FOUND or c.kind == "advice" for c in CASES)

"""Files whose numbers can be read in two ways, or were damaged by a spreadsheet, a printer or a logger."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Literal

import numpy as np
from hostile_cases import Case, truth
from hostile_press import Texts, comma, content, lines_of, minus, press, si, times

from calib.lab import AS_FOUND, Reading

KIND = "marks"
May = Literal["must_read", "must_refuse", "may_refuse"]
P = press(120, seed=71)
COMMA, POINT = Reading(decimal=","), Reading(decimal=".")
HEADS = ("Time (s)", "Extension (mm)", "Load (N)")


def _case(
    name: str,
    heads: tuple[str, ...],
    columns: tuple[Texts, ...],
    may: May,
    values: dict[str, tuple[Texts, str]] | None,
    *,
    sep: str = ";",
    ways: tuple[Reading, ...] = (),
    damaged: Iterable[int] = (),
    excused: Iterable[int] = (),
    reading: Reading = AS_FOUND,
    told: tuple[str, ...] = (),
    above: tuple[str, ...] = (),
    encoding: str = "utf-8",
    why: str = "",
    kind: str = KIND,
) -> Case:
    """A table, its columns as they stand in the file, and what they are worth: quantity -> (plain texts, unit in SI).

    Damaged and excused are rows, from 0. A way out reads to the same values.
    """
    lines, rows = lines_of(heads, columns, sep=sep, above=above)
    known = truth(rows, **{q: si(x, unit) for q, (x, unit) in values.items()}) if values is not None else None
    return Case(
        name,
        kind,
        content(lines, end="\r\n", encoding=encoding),
        may,
        known,
        reading=reading,
        told=told or (("decimal|mark|comma|point",) if may == "must_refuse" else ()),
        damaged=frozenset(rows[i] for i in damaged),
        excused=frozenset(rows[i] for i in excused),
        ways_out=tuple((way, known) for way in ways if known is not None),
        why=why,
    )


def _tester(t: Texts = P.t, d: Texts = P.d, f: Texts = P.f, force: str = "1") -> dict[str, tuple[Texts, str]]:
    return {"time": (t, "1"), "displacement": (d, "1e-3"), "force": (f, force)}


def _meter(t: Texts = P.t, c: Texts = P.c, unit: str = "1e-12") -> dict[str, tuple[Texts, str]]:
    return {"time": (t, "1"), "capacitance": (c, unit)}


def _with(column: Texts, rows: Iterable[int], change: Callable[[str], str]) -> Texts:
    chosen = set(rows)
    return tuple(change(x) if i in chosen else x for i, x in enumerate(column))


def _two_meanings() -> Iterator[Case]:
    steps = tuple(str(i) for i in range(120))
    pressed = press(120, seed=72, zero=1.2)  # never below 1, so that no leading zero tells the mark
    deep = tuple(f"{float(d) + 2:.3f}" for d in pressed.d)
    force = tuple(f"{float(f):.3f}" for f in pressed.f)
    yield _case(
        "three_decimals_meter_comma",
        ("Time (s)", "Cp (pF)"),
        (steps, comma(P.c)),
        "must_refuse",
        _meter(steps),
        ways=(COMMA,),
        why="97,401 may be 97.401 or 97401",
    )
    yield _case(
        "three_decimals_meter_point",
        ("Time (s)", "Cp (fF)"),
        (steps, P.c),
        "may_refuse",
        _meter(steps, unit="1e-15"),
        ways=(POINT,),
        why="97.401 fF with a point and whole seconds: as English as the header",
    )
    yield _case(
        "three_decimals_tester_comma",
        HEADS,
        (steps, comma(deep), comma(force)),
        "must_refuse",
        _tester(steps, deep, force),
        ways=(COMMA,),
        why="all of three decimals, all above 1",
    )
    yield _case(
        "three_decimals_tester_tab",
        HEADS,
        (steps, comma(deep), comma(force)),
        "must_refuse",
        _tester(steps, deep, force),
        ways=(COMMA,),
        sep="\t",
    )
    yield _case(
        "three_decimals_quoted_comma",
        HEADS,
        tuple(tuple(f'"{x}"' for x in c) for c in (steps, comma(deep), comma(force))),
        "must_refuse",
        _tester(steps, deep, force),
        ways=(COMMA,),
        sep=",",
    )
    whole = times(P.c, "1000", 0)
    pointed = tuple(f"{x[:-3]}.{x[-3:]}" for x in whole)
    yield _case(
        "thousands_points_beside_comma",
        ("Zeit (s)", "Cp (fF)"),
        (comma(P.t), pointed),
        "may_refuse",
        _meter(c=whole, unit="1e-15"),
        ways=(COMMA,),
        why="the time has a decimal comma, so the points are of thousands",
    )
    milli = times(press(120, seed=73, zero=0.2).f, "1000", 0)
    pointed = tuple(f"{x[:-3]}.{x[-3:]}" if len(x) > 3 else x for x in milli)
    yield _case(
        "thousands_points_from_1000_on",
        ("Zeit (s)", "Weg (mm)", "Kraft (mN)"),
        (comma(P.t), comma(P.d), pointed),
        "may_refuse",
        _tester(f=milli, force="1e-3"),
        ways=(COMMA,),
        why="998 and then 1.001: whole numbers with points of thousands",
    )
    whole_ms = tuple(str(100 * i) for i in range(120))
    yield _case(
        "thousands_points_all_whole",
        ("Zeit (ms)", "Weg (µm)", "Kraft (mN)"),
        (
            tuple(f"{x[:-3]}.{x[-3:]}" if len(x) > 3 else x for x in whole_ms),
            times(P.d, "1000", 0),
            pointed,
        ),
        "may_refuse",
        {"time": (whole_ms, "1e-3"), "displacement": (times(P.d, "1000", 0), "1e-6"), "force": (milli, "1e-3")},
        ways=(COMMA,),
        why="no decimal anywhere: 1.001 would be 1 mN after 998 mN",
    )
    yield _case(
        "point_column_in_comma_file",
        ("Zeit (s)", "Cp (pF)"),
        (comma(P.t), P.c),
        "may_refuse",
        _meter(),
        why="the meter wrote points, the tester's program commas: 97.401 is no 97401",
    )
    yield _case(
        "comma_column_in_point_file",
        ("Time (s)", "Cp (pF)"),
        (P.t, comma(P.c)),
        "may_refuse",
        _meter(),
        sep="\t",
        why="97,401 pF beside 0.10 s: thousands by the file, decimals by the sense",
    )
    two = tuple(f"{float(c):.2f}" for c in P.c)
    yield _case("point_column_two_decimals", ("Zeit (s)", "Cp (pF)"), (comma(P.t), two), "may_refuse", _meter(c=two))
    yield _case(
        "femtofarad_with_thousands_comma",
        ("Time (s)", "Cp (fF)"),
        (P.t, tuple(f"{x[:-3]},{x[-3:]}" for x in whole)),
        "may_refuse",
        _meter(c=whole, unit="1e-15"),
        sep="\t",
        ways=(POINT,),
    )
    half = 60
    for name, decimals in (("mark_changes_midway", 4), ("mark_changes_midway_three_decimals", 3)):
        d = tuple(f"{float(x):.{decimals}f}" for x in P.d)
        columns = tuple((*c[:half], *comma(c[half:])) for c in (P.t, d, P.f))
        yield _case(name, HEADS, columns, "may_refuse", _tester(d=d), why="the computer's region was changed")
    first = tuple(f"1.{x}" for x in comma(tuple(f"{float(x) + 100:.1f}" for x in P.t)))
    second = tuple(f"1,{float(f) + 200:.1f}" for f in P.f)
    yield _case(
        "two_conventions_in_a_row",
        HEADS,
        (first, comma(P.d), second),
        "may_refuse",
        _tester(t=tuple(x.replace(".", "").replace(",", ".") for x in first), f=tuple(x.replace(",", "") for x in second)),
    )


def _stripped() -> Iterator[Case]:
    ninth = range(4, 120, 9)
    yield _case(
        "spreadsheet_ate_points",
        ("Time (s)", "Cp (pF)"),
        (P.t, tuple(x.replace(".", "") if len(x.rstrip("0")) == 6 else f"{float(x):g}" for x in P.c)),
        "may_refuse",
        _meter(c=tuple("" if len(x.rstrip("0")) == 6 else f"{float(x):g}" for x in P.c)),
        damaged=[i for i, x in enumerate(P.c) if len(x.rstrip("0")) == 6],
        sep=",",
        why="97301 beside 99.28: three decimals became whole numbers",
    )
    negative = tuple(f"{-float(f) - 0.2:.5f}" for f in P.f)
    lost = _with(comma(negative), ninth, lambda x: ("-" if x[0] == "-" else "") + x.lstrip("-").replace(",", "").zfill(6))
    yield _case(
        "comma_lost_in_every_ninth",
        ("Zeit (s)", "Weg (mm)", "Kraft (N)"),
        (comma(P.t), comma(minus(P.d)), lost),
        "may_refuse",
        _tester(d=minus(P.d), f=_with(negative, ninth, lambda _: "")),
        damaged=ninth,
        why="-021000 beside -0,21000",
    )
    for name, rows, change, sep in (
        ("point_lost_once", [70], lambda x: x.replace(".", ""), ","),
        ("point_moved_once", [70], lambda x: f"{float(x) * 10:.2f}", ","),
        ("point_moved_down", [70, 71], lambda x: f"{float(x) / 10:.4f}", ","),
        ("comma_once_in_tab_file", [70], lambda x: x.replace(".", ","), "\t"),
        ("three_cells_by_1000", [60, 70, 80], lambda x: f"{float(x) * 1000:.0f}", ","),
    ):
        force = _with(P.f, rows, change)
        empty = _with(P.f, rows, lambda _: "")
        yield _case(
            name,
            HEADS,
            (P.t, P.d, force),
            "may_refuse",
            _tester(f=empty),
            sep=sep,
            damaged=rows,
            why="a cell that its neighbours contradict by a power of ten",
        )
    for name, change in (
        ("exponent_off_by_one", lambda x: x.replace("e-11", "e-10")),
        ("exponent_lost", lambda x: x.split("e")[0]),
    ):
        farad = tuple(f"{float(c) * 1e-12:.6e}" for c in tuple(f"{min(float(c), 99.9):.3f}" for c in P.c))
        yield _case(
            name,
            ("Time (s)", "Cp (F)"),
            (P.t, _with(farad, [33], change)),
            "may_refuse",
            _meter(c=_with(farad, [33], lambda _: ""), unit="1"),
            sep=",",
            damaged=[33],
        )
    yield _case(
        "all_marks_lost",
        ("Time (s)", "Cp (pF)"),
        (P.t, tuple(f"{float(c):g}".replace(".", "") for c in P.c)),
        "must_refuse",
        None,
        sep=",",
        why="974, 9741 and 97401 for 97.4, 97.41 and 97.401",
    )
    d_lost = _with(P.d, range(40, 60), lambda x: x.replace(".", "").lstrip("0") or "0")
    yield _case(
        "displacement_lost_marks_for_a_while",
        HEADS,
        (P.t, d_lost, P.f),
        "may_refuse",
        _tester(d=_with(P.d, range(40, 60), lambda _: "")),
        sep=",",
        damaged=range(40, 60),
    )
    for name, cell in (
        ("spreadsheet_made_a_date", "01.Mai"),
        ("spreadsheet_made_a_month", "May-03"),
        ("spreadsheet_too_narrow", "########"),
        ("letter_o_for_zero", "5.O21"),
        ("two_points", "5.02.1"),
        ("group_of_four", "5,0214.2"),
        ("question_mark", "5.0?1"),
        ("division_by_zero", "#DIV/0!"),
    ):
        force = (*P.f[:64], cell, *P.f[65:])
        yield _case(
            name, HEADS, (P.t, P.d, force), "may_refuse", _tester(f=_with(P.f, [64], lambda _: "")), sep="\t", damaged=[64]
        )


def _units_in_cells() -> Iterator[Case]:
    def ranged(c: str, i: int) -> tuple[str, str]:
        return (f"{float(c) / 1000:.6f}", "nF") if i % 3 == 0 else (c, "pF")

    pairs = [ranged(c, i) for i, c in enumerate(P.c)]
    heads = ("Time (s)", "Cp")
    yield _case("unit_in_cell_alike", heads, (P.t, tuple(f"{c} pF" for c in P.c)), "may_refuse", _meter(), sep=",")
    yield _case("unit_in_cell_changes", heads, (P.t, tuple(f"{x} {u}" for x, u in pairs)), "may_refuse", _meter(), sep=",")
    yield _case("unit_glued_changes", heads, (P.t, tuple(f"{x}{u}" for x, u in pairs)), "may_refuse", _meter(), sep=",")
    yield _case(
        "letter_of_magnitude",
        ("Time (s)", "Cp (F)"),
        (P.t, tuple(f"{x}{u[0]}" for x, u in pairs)),
        "may_refuse",
        _meter(),
        sep=",",
    )
    columns = (P.t, tuple(x for x, _ in pairs), tuple(u for _, u in pairs))
    yield _case(
        "unit_column_changes",
        ("Time (s)", "Cp", "Unit"),
        columns,
        "may_refuse",
        _meter(),
        sep=",",
        why="a hand-held meter that changes its range and writes the unit beside",
    )
    yield _case("unit_column_against_name", ("Time (s)", "Cp (pF)", "Unit"), columns, "may_refuse", _meter(), sep=",")
    forces = tuple(f"{float(f) * 1000:.0f} mN" if abs(float(f)) < 1 else f"{f} N" for f in P.f)
    yield _case(
        "force_with_units_in_cells",
        ("Time (s)", "Extension (mm)", "Load"),
        (P.t, P.d, forces),
        "may_refuse",
        _tester(),
        sep=",",
    )
    yield _case(
        "loss_in_percent_cells",
        ("Time (s)", "Cp (pF)", "D"),
        (P.t, P.c, tuple(f"{float(x) * 100:.3f}%" for x in P.loss)),
        "may_refuse",
        {**_meter(), "dissipation": (P.loss, "1")},
        sep=",",
    )
    yield _case(
        "trailing_minus",
        HEADS,
        (P.t, tuple(x[1:] + "-" if x[0] == "-" else x for x in minus(P.d)), P.f),
        "may_refuse",
        _tester(d=minus(P.d)),
        sep=",",
    )
    brackets = tuple(f"({x[1:]})" if x[0] == "-" else x for x in minus(P.f))
    yield _case("accountants_minus", HEADS, (P.t, P.d, brackets), "may_refuse", _tester(f=minus(P.f)), sep=",")


def _plain() -> Iterator[Case]:
    kind = f"benign {KIND}"
    short = tuple(f"{float(c):g}" for c in tuple(f"{float(c):.2f}" for c in P.c))
    whole = min(range(len(short)), key=lambda i: abs(float(short[i]) - round(float(short[i]))))
    short = (*short[:whole], f"{float(short[whole]):.0f}", *short[whole + 1 :])
    yield _case(
        "whole_number_among_decimals",
        ("Time (s)", "Cp (pF)"),
        (P.t, short),
        "must_read",
        _meter(c=short),
        sep=",",
        kind=kind,
        why="98 among 97.99 is 98.00 of a program that strips zeros",
    )
    t_short, d_short, f_short = (tuple(f"{float(x):g}" for x in c) for c in (P.t, P.d, P.f))
    yield _case(
        "stripped_zeros_everywhere",
        HEADS,
        (t_short, d_short, f_short),
        "must_read",
        _tester(t_short, d_short, f_short),
        sep=",",
        kind=kind,
    )
    yield _case(
        "german_three_decimals",
        ("Zeit (s)", "Kraft (N)", "Weg (mm)"),
        tuple(comma(c) for c in (P.t, P.f, P.d)),
        "must_read",
        _tester(),
        kind=kind,
    )
    three = tuple(f"{float(x):.3f}" for x in P.d)
    yield _case(
        "german_only_three_decimals",
        ("Zeit (s)", "Kraft (N)", "Weg (mm)"),
        tuple(comma(c) for c in (tuple(f"{float(x):.3f}" for x in P.t), P.f, three)),
        "must_read",
        _tester(d=three),
        kind=kind,
        why="0,123 tells that the comma is of decimals",
    )
    late = tuple(f"{float(x) + 995:.2f}" for x in P.t)
    grouped = tuple(f'"{float(x):,.2f}"' for x in late)
    quoted = tuple(tuple(f'"{x}"' for x in c) for c in (P.d, P.f))
    yield _case("thousands_from_1000_s_on", HEADS, (grouped, *quoted), "must_read", _tester(t=late), sep=",", kind=kind)
    german = tuple(f"{float(x):,.2f}".replace(",", " ").replace(".", ",").replace(" ", ".") for x in late)
    yield _case(
        "german_thousands_from_1000_s_on",
        ("Zeit (s)", "Weg (mm)", "Kraft (N)"),
        (german, comma(P.d), comma(P.f)),
        "must_read",
        _tester(t=late),
        kind=kind,
    )
    swiss = tuple(x.strip('"').replace(",", "'") for x in grouped)
    yield _case("swiss_apostrophes", HEADS, (swiss, P.d, P.f), "must_read", _tester(t=late), kind=kind)
    thin = tuple(x.strip('"').replace(",", "\u202f").replace(".", ",") for x in grouped)
    yield _case(
        "french_thin_blanks",
        ("Temps (s)", "Force (N)", "Extension (mm)"),
        (thin, comma(P.f), comma(P.d)),
        "must_read",
        _tester(t=late),
        kind=kind,
    )
    bare = tuple(tuple(x.replace("0.", ".", 1) if x.lstrip("-").startswith("0.") else x for x in c) for c in (P.t, P.d, P.f))
    yield _case("no_leading_zeros", HEADS, bare, "must_read", _tester(), sep=",", kind=kind)
    plus = tuple(f"{float(c) * 1e-12:+.5E}" for c in P.c)
    yield _case(
        "keysight_exponents", ("Time (s)", "Cp (F)"), (P.t, plus), "must_read", _meter(c=plus, unit="1"), sep=",", kind=kind
    )
    yield _case(
        "real_minus_sign",
        HEADS,
        (P.t, *(tuple(x.replace("-", "\u2212") for x in minus(c)) for c in (P.d, P.f))),
        "must_read",
        _tester(d=minus(P.d), f=minus(P.f)),
        sep=",",
        kind=kind,
    )
    micro = times(P.d, "1000", 0)
    milli = times(P.f, "1000", 0)
    yield _case(
        "whole_units_only",
        ("Time (ms)", "Extension (µm)", "Load (mN)"),
        (times(P.t, "1000", 0), micro, milli),
        "must_read",
        {"time": (times(P.t, "1000", 0), "1e-3"), "displacement": (micro, "1e-6"), "force": (milli, "1e-3")},
        sep=",",
        kind=kind,
    )
    nan = _with(P.c, [10, 50], lambda _: "NaN")
    yield _case(
        "not_a_number_cells",
        ("Time (s)", "Cp (pF)"),
        (P.t, nan),
        "must_read",
        _meter(c=_with(P.c, [10, 50], lambda _: "")),
        sep=",",
        excused=[10, 50],
        kind=kind,
    )
    jump = tuple(f"{float(f) + (4.0 if 60 <= i < 75 else 0):.3f}" for i, f in enumerate(P.f))
    yield _case(
        "a_real_step_in_force",
        HEADS,
        (P.t, P.d, jump),
        "must_read",
        _tester(f=jump),
        sep=",",
        kind=kind,
        why="a step by a factor of less than two is no lost mark",
    )
    small = press(120, seed=75, zero=0.012)
    yield _case(
        "tenfold_rise_at_touch",
        HEADS,
        (small.t, small.d, small.f),
        "must_read",
        _tester(small.t, small.d, small.f),
        sep=",",
        kind=kind,
        why="force rises by more than ten from row to row at the touch",
    )
    zeros = replace(small, f=tuple("0.000" if float(f) < 0.05 else f for f in small.f))
    yield _case(
        "exact_zeros_before_touch",
        HEADS,
        (zeros.t, zeros.d, zeros.f),
        "must_read",
        _tester(zeros.t, zeros.d, zeros.f),
        sep=",",
        kind=kind,
    )


assert np.unique(P.c).size > 100  # the press is no constant
CASES = (*_two_meanings(), *_stripped(), *_units_in_cells(), *_plain())

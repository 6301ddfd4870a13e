"""Files whose column names say more in their brackets than a unit: factors, contradictions, statistics, set values."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

import numpy as np
from hostile_cases import Case, Truth, truth
from hostile_press import FloatArray, Texts, content, lines_of, press, si, texts, times

from calib.lab import Reading

KIND = "brackets"
May = Literal["must_read", "must_refuse", "may_refuse"]
P = press(120, seed=41)
M = press(120, seed=42)


def _without_time(case: Case, head: str) -> Case:
    """The same file, where leaving out the time, with the reason, does as well as refusing the file."""
    rows = range(len(case.content.splitlines()) - P.rows + 1, len(case.content.splitlines()) + 1)
    known = truth(rows, displacement=si(P.d, "1e-3"), force=si(P.f))
    return replace(case, may="may_refuse", truth=known, named=(head,))


def _tester(
    name: str,
    heads: tuple[str, str, str],
    may: May,
    *,
    t: Texts = P.t,
    d: Texts = P.d,
    f: Texts = P.f,
    factors: tuple[str, str, str] | None = ("1", "1e-3", "1"),
    units: tuple[str, ...] = (),
    above: tuple[str, ...] = (),
    ways: tuple[tuple[Reading, tuple[str, str, str]], ...] = (),
    blame: tuple[str, ...] = (),
    told: tuple[str, ...] = (),
    why: str = "",
    sep: str = ",",
) -> Case:
    """A table of time, displacement and force, with what each is to be multiplied by for SI; None if no one can know."""
    lines, rows = lines_of(heads, [t, d, f], units=units, above=above, sep=sep)

    def values(by: tuple[str, str, str]) -> Truth:
        return truth(rows, time=si(t, by[0]), displacement=si(d, by[1]), force=si(f, by[2]))

    return Case(
        name,
        KIND,
        content(lines, end="\r\n"),
        may,
        values(factors) if factors is not None else None,
        blame=blame or tuple(heads),
        told=told,
        ways_out=tuple((reading, values(by)) for reading, by in ways),
        why=why,
    )


def _meter(
    name: str,
    head: str,
    may: May,
    *,
    c: Texts = M.c,
    factor: str | None = "1e-12",
    units: tuple[str, ...] = (),
    ways: tuple[tuple[Reading, str], ...] = (),
    named: tuple[str, ...] = (),
    more: tuple[tuple[str, Texts], ...] = (),
    why: str = "",
) -> Case:
    """A table of time and capacitance, with what the latter is to be multiplied by for SI."""
    names = ["Time (s)", head, *(n for n, _ in more)]
    lines, rows = lines_of(names, [M.t, c, *(x for _, x in more)], units=units)

    def values(by: str) -> Truth:
        return truth(rows, time=si(M.t), capacitance=si(c, by))

    return Case(
        name,
        KIND,
        content(lines),
        may,
        values(factor) if factor is not None else None,
        named=named,
        blame=(head, "capacitance"),
        ways_out=tuple((reading, values(by)) for reading, by in ways),
        why=why,
    )


def _factors() -> Iterator[Case]:
    time, way = "Time (s)", "Extension (mm)"
    tenfold, milli, kilo = times(P.f, "10", 2), times(P.f, "1000", 0), times(P.f, "0.001", 6)
    yield _tester("load_x10", (time, way, "Load [x10] (N)"), "must_refuse", f=tenfold, factors=None, why="x10 of what")
    yield _tester("load_times_10_behind", (time, way, "Load (N) x10"), "must_refuse", f=tenfold, factors=None)
    yield _tester("load_times_sign_100", (time, way, "Load ×100 (N)"), "must_refuse", f=times(P.f, "100", 1), factors=None)
    yield _tester("load_by_10", (time, way, "Load (N/10)"), "must_refuse", f=tenfold, factors=None)
    yield _tester("load_10_n", (time, way, "Load (10 N)"), "must_refuse", factors=None, why="a factor or the range of the cell")
    yield _tester("din_tenfold", ("t / s", "s / mm", "F / 10 N"), "must_refuse", f=times(P.f, "0.1", 4), factors=None)
    yield _tester(
        "factor_in_unit_row",
        ("Time", "Extension", "Load"),
        "must_refuse",
        f=tenfold,
        factors=None,
        units=("(s)", "(mm)", "(x10 N)"),
    )
    yield _tester("millinewton_times_1000", (time, way, "Force (mN) (x1000)"), "must_refuse", f=milli, factors=None)
    kilograms = times(P.f, "0.1019716", 6)
    yield _tester(
        "force_kilograms", (time, way, "Force (kg)"), "must_read", f=kilograms, factors=("1", "1e-3", "9.80665"), told=("kgf",)
    )
    yield _tester("ten_to_the_three_newton", (time, way, "Load (10^3 N)"), "may_refuse", f=kilo, factors=("1", "1e-3", "1e3"))
    yield _tester("ten_to_the_minus_three", (time, way, "Load (10^-3 N)"), "may_refuse", f=milli, factors=("1", "1e-3", "1e-3"))
    yield _tester("superscript_power", (time, way, "Force [10⁻³ N]"), "may_refuse", f=milli, factors=("1", "1e-3", "1e-3"))
    yield _tester("tenth_of_newton", (time, way, "Force (0.1 N)"), "may_refuse", f=tenfold, factors=("1", "1e-3", "0.1"))
    yield _tester("decinewton", (time, way, "Force (dN)"), "may_refuse", f=tenfold, factors=("1", "1e-3", "0.1"))
    yield _tester(
        "extension_x_1000", (time, "Extension x1000 (mm)", "Load (N)"), "must_refuse", d=times(P.d, "1000", 1), factors=None
    )
    yield _tester(
        "extension_hundredths",
        (time, "Extension (1/100 mm)", "Load (N)"),
        "may_refuse",
        d=times(P.d, "100", 2),
        factors=("1", "1e-5", "1"),
    )
    yield _without_time(
        _tester("time_x_100", ("Time x100 (s)", way, "Load (N)"), "must_refuse", t=times(P.t, "100", 0), factors=None),
        "Time x100 (s)",
    )
    yield _tester(
        "time_in_tenths", ("Time (0.1 s)", way, "Load (N)"), "may_refuse", t=times(P.t, "10", 0), factors=("0.1", "1e-3", "1")
    )
    yield _tester("minus_one", (time, way, "Load (-1) (N)"), "may_refuse", why="the numbers as they stand, or asked")
    for head in ("Cp (1e-1) (pF)", "Cp*10 (pF)", "Cp [x0.1] [pF]", "10*Cp (pF)"):
        name = "cp_" + "".join(x if x.isalnum() else "_" for x in head[2:]).strip("_").lower()
        yield _meter(name, head, "must_refuse", c=times(M.c, "10", 2), factor=None)
    yield _meter("cp_ten_to_minus_twelve_farad", "Cp (10^-12 F)", "may_refuse")
    yield _meter("cp_e_minus_12_farad", "Cp [E-12 F]", "may_refuse")
    yield _meter("cp_farad_times_1e12", "Cp [F*1e12]", "must_refuse", factor=None, why="already multiplied, or still to be")


def _contradictions() -> Iterator[Case]:
    time, way = "Time (s)", "Extension (mm)"
    kilo, as_newton = ("1", "1e-3", "1e3"), ("1", "1e-3", "1")
    for name, head in (
        ("kn_and_n", "Load (kN) (N)"),
        ("n_and_kn", "Load (N) [kN]"),
        ("name_kn_bracket_n", "Load_kN (N)"),
        ("n_or_mn", "Force (N)(mN)"),
        ("name_n_bracket_lbf", "Force N [lbf]"),
    ):
        yield _tester(
            name,
            (time, way, head),
            "must_refuse",
            factors=None,
            ways=(
                (Reading(units={"force": "N"}), as_newton),
                (Reading(columns={"force": head}, units={"force": "N"}), as_newton),
            ),
            why="two units for one column",
        )
    small = times(P.f, "0.001", 6)
    yield _tester(
        "unit_row_contradicts_name",
        (time, way, "Load (kN)"),
        "must_refuse",
        f=small,
        factors=None,
        units=("(s)", "(mm)", "(N)"),
        ways=((Reading(units={"force": "kN"}), kilo),),
    )
    yield _without_time(
        _tester(
            "unit_row_contradicts_time",
            ("Time (s)", way, "Load (N)"),
            "must_refuse",
            factors=None,
            units=("(min)", "(mm)", "(N)"),
            ways=((Reading(units={"time": "s"}), as_newton),),
        ),
        "Time (s)",
    )
    yield _tester(
        "units_above_contradict",
        (time, way, "Load (N)"),
        "must_refuse",
        factors=None,
        above=("Units : Force,kN",),
        blame=("kN", "Load (N)"),
        ways=((Reading(units={"force": "N"}), as_newton),),
    )
    yield _tester(
        "inch_and_mm",
        (time, "Extension (in) (mm)", "Load (N)"),
        "must_refuse",
        factors=None,
        ways=((Reading(units={"displacement": "mm"}), as_newton),),
    )
    pico = ((Reading(units={"capacitance": "pF"}), "1e-12"),)
    yield _meter("pf_and_nf", "Cp (nF) (pF)", "must_refuse", factor=None, ways=pico)
    yield _meter("name_nf_row_pf", "Cp_nF", "must_refuse", factor=None, units=("(s)", "(pF)"), ways=pico)
    yield _tester("units_twice_alike", ("Time (s)", way, "Load (N)"), "must_read", units=("(s)", "(mm)", "(N)"))
    yield _tester("unit_twice_in_name", (time, way, "Load (N) (N)"), "must_read")
    yield _tester(
        "newton_in_words_and_bracket",
        ("Time in s (s)", "Extension in mm (mm)", "Load in N (N)"),
        "may_refuse",
        why="they agree",
    )


def _no_records() -> Iterator[Case]:
    time, way = "Time (s)", "Extension (mm)"
    held = texts(np.maximum.accumulate(_floats(P.f)), 3)
    for name, head, f in (
        ("peak_hold_alone", "Force (peak hold) (N)", held),
        ("load_max_alone", "Load (max) (N)", held),
        ("maximum_load_alone", "Maximum load (N)", held),
        ("load_peak_alone", "Load Peak [N]", held),
        ("setpoint_alone", "Load (setpoint) (N)", P.f),
        ("force_command_alone", "Force command (N)", P.f),
        ("force_target_alone", "Force_target (N)", P.f),
        ("load_limit_alone", "Load (limit) (N)", P.f),
        ("force_error_alone", "Force (error) (N)", times(P.f, "0.01", 5)),
        ("force_deviation_alone", "Load (std) (N)", times(P.f, "0.01", 5)),
        ("force_in_volts", "Force (V)", P.f),
        ("newton_per_volt", "Force (10 N/V)", times(P.f, "0.1", 4)),
        ("force_per_millimetre", "Force (N/mm)", P.f),
        ("force_rate", "Force rate (N/s)", P.f),
        ("percent_of_range", "Load (% of 50 N)", times(P.f, "2", 2)),
        ("load_minimum", "Load min (N)", P.f),
        ("force_sollwert", "Kraft Soll (N)", P.f),
        ("force_raw_counts", "Force (counts)", times(P.f, "1000", 0)),
    ):
        yield _tester(
            name, (time, way, head), "must_refuse", f=f, factors=None, blame=("force", head), why="no record of a force"
        )
    for name, head in (
        ("extension_max_alone", "Extension (max) (mm)"),
        ("extension_command_alone", "Extension command (mm)"),
        ("position_setpoint_alone", "Position setpoint (mm)"),
        ("displacement_target_alone", "Displacement [target] (mm)"),
        ("displacement_rate", "Displacement (mm/s)"),
    ):
        yield _tester(name, (time, head, "Load (N)"), "must_refuse", factors=None, blame=("displacement", head))
    yield _meter("cp_standard_deviation", "Cp SD (pF)", "must_refuse", c=times(M.c, "0.001", 5), factor=None)
    base = times(tuple(f"{float(c) - 97.4:.3f}" for c in M.c), "1", 3)
    for name, head in (
        ("delta_c", "delta C (pF)"),
        ("greek_delta_cp", "ΔCp (pF)"),
        ("cp_minus_c0", "Cp-C0 (pF)"),
        ("cp_offset_removed", "Cp (offset 97.4 pF removed) (pF)"),
        ("cp_change", "Cp (change) (pF)"),
        ("cp_relative", "Cp (rel) (pF)"),
    ):
        yield _meter(name, head, "must_refuse", c=base, factor=None, why="a change of capacitance is no capacitance")


def _beside_the_record() -> Iterator[Case]:
    held = texts(np.maximum.accumulate(_floats(P.f)), 3)
    asked = texts(np.concatenate([np.linspace(0, 8, 72), np.linspace(8, 0, 48)]), 3)
    deep = texts(np.maximum.accumulate(_floats(P.d)), 4)
    for name, first, second, other in (
        ("peak_hold_before_force", "Force (peak hold) (N)", "Force (N)", held),
        ("setpoint_before_force", "Load (setpoint) (N)", "Force (N)", asked),
        ("load_command_before_load", "Load command (N)", "Load (N)", asked),
        ("max_load_before_load", "Max. Load (N)", "Load (N)", held),
        ("target_in_brackets_before", "Load [target] [N]", "Load [actual] [N]", asked),
        ("soll_before_ist", "Kraft (Soll) [N]", "Kraft (Ist) [N]", asked),
    ):
        for order in ("first", "last"):
            heads, columns = [first, second], [other, P.f]
            if order == "last":
                heads, columns = heads[::-1], columns[::-1]
            lines, rows = lines_of(["Time (s)", "Extension (mm)", *heads], [P.t, P.d, *columns])
            yield Case(
                name if order == "first" else name.replace("_before_", "_behind_").replace("_before", "_behind"),
                KIND,
                content(lines),
                "may_refuse" if "(Ist)" in second or "actual" in second else "must_read",
                truth(rows, time=si(P.t), displacement=si(P.d, "1e-3"), force=si(P.f)),
                named=(first.split(" [N]")[0].removesuffix(" (N)"),),
                ways_out=(
                    (
                        Reading(columns={"force": second}),
                        truth(rows, time=si(P.t), displacement=si(P.d, "1e-3"), force=si(P.f)),
                    ),
                ),
                why="what was asked for or held stands beside what was measured",
            )
    lines, rows = lines_of(
        ["Time (s)", "Extension (max) (mm)", "Extension (mm)", "Load (mean) (N)", "Load (N)"],
        [P.t, deep, P.d, times(P.f, "0.97", 3), P.f],
    )
    yield Case(
        "max_and_mean_beside",
        KIND,
        content(lines),
        "must_read",
        truth(rows, time=si(P.t), displacement=si(P.d, "1e-3"), force=si(P.f)),
        named=("Extension (max)", "Load (mean)"),
    )
    lines, rows = lines_of(
        ["Time (s)", "Cp mean (pF)", "Cp SD (pF)", "Cp (pF)"], [M.t, texts([99.0] * 120, 3), texts([0.01] * 120, 3), M.c]
    )
    yield Case(
        "mean_and_sd_before_cp",
        KIND,
        content(lines),
        "must_read",
        truth(rows, time=si(M.t), capacitance=si(M.c, "1e-12")),
        named=("Cp mean", "Cp SD"),
    )
    lines, rows = lines_of(["Time (s)", "dC (pF)", "Cp (pF)"], [M.t, texts(_floats(M.c) - 97.4, 3), M.c])
    yield Case(
        "change_before_cp",
        KIND,
        content(lines),
        "must_read",
        truth(rows, time=si(M.t), capacitance=si(M.c, "1e-12")),
        named=("dC",),
    )


def _floats(column: Texts) -> FloatArray:
    return np.array([float(x) for x in column])


CASES = (*_factors(), *_contradictions(), *_no_records(), *_beside_the_record())

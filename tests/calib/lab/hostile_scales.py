"""Files of which a part is in another unit or range, or whose words say so; and those with jumps that really happened."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal

import numpy as np
from hostile_cases import Case, truth
from hostile_press import FloatArray, Texts, comma, content, lines_of, press, si, texts, times

from calib.lab import Reading

P = press(120, seed=51)
M = press(120, seed=52)
HEADS = ("Time (s)", "Extension (mm)", "Load (N)", "Cp (pF)")
SI = ("1", "1e-3", "1", "1e-12")
QUANTITIES = ("time", "displacement", "force", "capacitance")


def _scaled(column: Texts, rows: range, factor: str, decimals: int) -> Texts:
    """The column with some rows in another unit."""
    return tuple(f"{Decimal(text) * Decimal(factor):.{decimals}f}" if i in rows else text for i, text in enumerate(column))


def _truth(lines: Sequence[int], columns: Sequence[Texts]) -> Mapping[str, FloatArray]:
    return dict(zip(QUANTITIES, (si(c, by) for c, by in zip(columns, SI, strict=True)), strict=True))


# --- a unit or a range is switched -----------------------------------------------------------------------------------------

# Name, which column, what its numbers are multiplied by, decimals; every one at four places.
SWITCHED = (
    ("load_in_g", 2, "101.9716213", 1),
    ("load_in_mn", 2, "1000", 0),
    ("load_in_kn", 2, "0.001", 6),
    ("load_in_kgf", 2, "0.1019716213", 4),
    ("load_in_lbf", 2, "0.2248089431", 4),
    ("load_range_x10", 2, "10", 3),
    ("load_range_x100", 2, "100", 2),
    ("extension_in_um", 1, "1000", 1),
    ("extension_in_in", 1, "0.03937007874", 5),
    ("extension_in_cm", 1, "0.1", 5),
    ("cp_in_nf", 3, "0.001", 6),
    ("cp_in_ff", 3, "1000", 0),
    ("cp_x10", 3, "10", 2),
    ("time_in_ms", 0, "1000", 0),
)
PLACES = {"for_good": range(41, 120), "at_the_peak": range(72, 120), "for_a_block": range(45, 61)}


def _switched() -> Iterator[Case]:
    for name, at, factor, decimals in SWITCHED:
        for place, rows in PLACES.items():
            columns = [P.t, P.d, P.f, P.c]
            if at == 0 and place != "for_good":
                continue  # times that fall back are left out as such
            if name == "load_in_lbf" and place == "at_the_peak":
                continue  # a load that drops by an eighth in the same row may as well have slipped
            columns[at] = _scaled(columns[at], rows, factor, decimals)
            lines, _ = lines_of(HEADS, columns)
            head = HEADS[at]
            yield Case(
                f"{name}_{place}", "a switched unit", content(lines), "must_refuse", None, blame=(head, head[:4], "off by")
            )
        for count in (1, 2) if at else ():
            columns = [P.t, P.d, P.f, P.c]
            columns[at] = _scaled(columns[at], range(50, 50 + count), factor, decimals)
            lines, numbers = lines_of(HEADS, columns)
            right = {q: v.copy() for q, v in _truth(numbers, (P.t, P.d, P.f, P.c)).items()}
            right[QUANTITIES[at]][50 : 50 + count] = np.nan
            yield Case(
                f"{name}_in_{count}_rows",
                "a switched unit",
                content(lines),
                "may_refuse",
                truth(numbers, **right),
                damaged=frozenset(numbers[50 : 50 + count]),
                blame=(HEADS[at],),
            )


# --- jumps that happened ---------------------------------------------------------------------------------------------------


def _happened(name: str, columns: Sequence[FloatArray], *, decimals: Sequence[int] = (2, 4, 3, 3)) -> Case:
    written = [texts(c, n) for c, n in zip(columns, decimals, strict=False)]
    lines, numbers = lines_of(HEADS[: len(written)], written)
    values = dict(zip(QUANTITIES, (si(c, by) for c, by in zip(written, SI, strict=False)), strict=False))
    return Case(name, "benign jumps", content(lines), "must_read", truth(numbers, **values))


def _real_jumps() -> Iterator[Case]:
    rng = np.random.default_rng(53)
    n = 120
    t = np.linspace(0.0, 0.1 * (n - 1), n)
    noise = 0.002 * rng.normal(size=n)
    hold = np.repeat([0.1, 1.0, 0.01], 40)
    yield _happened(
        "steps_of_force_by_tens", (t, np.repeat([0.1, 0.6, 0.05], 40) + 1e-4 * rng.normal(size=n), hold + noise / 50)
    )
    relaxing = np.where(np.arange(n) < 30, 0.1, 10.0 - 1.5 * (1 - np.exp(-(np.arange(n) - 30) / 15)))
    depth = np.where(np.arange(n) < 30, 0.05, 1.2) + 1e-4 * rng.normal(size=n)
    yield _happened("relaxation_after_a_preload_of_a_hundredth", (t, depth, relaxing + noise * relaxing / 10))
    fast = np.where(np.arange(n) < 20, 0.1 + 1e-3 * np.arange(n), 1.0 + 0.01 * (np.arange(n) - 20))
    force = np.where(np.arange(n) < 40, 0.0, 3.0 * (np.clip(np.arange(n) - 40, 0, None) / 80) ** 1.6)
    yield _happened("fast_approach_by_ten", (t, fast, force + noise))
    stairs = np.repeat([0.01, 0.1, 1.0, 0.1, 0.01, 0.1], 20)
    yield _happened("stairs_by_ten", (t, np.asarray(stairs, float), 4.0 * np.asarray(stairs**1.5, float) + noise))
    pause = np.where(np.arange(n) < 50, t, t + 44.6)
    yield _happened("pause_of_ten_times_the_time", (pause, np.array(P.d, float), np.array(P.f, float)))
    off = np.array(P.f, float)
    off[72:] = np.where(np.arange(48) < 30, off[72:] - 4.0 * np.linspace(0, 1, 48), -0.004 + noise[72:])
    yield _happened("pull_off", (t, np.array(P.d, float), off))
    snap = np.where(np.arange(n) < 20, 0.004, 0.0) + np.where(np.arange(n) >= 20, -0.05, 0.0)
    snap = snap + np.clip(np.arange(n) - 25, 0, None) ** 1.5 * 3e-3
    yield _happened("snap_in", (t, 0.1 * t, np.asarray(snap + noise / 2, float)), decimals=(2, 3, 4))
    slip = np.array(P.f, float)
    slip[60:] *= 1 - 0.7 * np.exp(-np.arange(slip.size - 60) / 8)
    yield _happened("slip_to_a_third", (t, np.array(P.d, float), slip))
    dwell = np.array(P.f, float)
    dwell[:10] = 0.5 * dwell[40]
    yield _happened("early_rows_of_a_held_load", (t, np.array(P.d, float), dwell))
    tare = np.array(P.f, float) + np.where(np.arange(n) < 60, 0.0, 30.0)
    yield _happened("tare_within_the_record", (t, np.array(P.d, float), tare))


# --- words among and beside the rows ---------------------------------------------------------------------------------------

SWITCHING_WORDS = (
    "# force now in mN", "# units: mN", "# Load: kN", "% range x10", "# gain 10", "// switched to gf", "# Einheit: mN",
    "# load cell changed", "# Kraft in kN", "# amplifier range 2", "# extension in um from here", "# force -> lbf",
)  # fmt: skip
HARMLESS_WORDS = (
    "# hold for 10 s", "# 5 N reached", "# unloading begins", "% second part", "# marker 3", "# pause", "# in contact",
    "# operator: A. N. Other",
)  # fmt: skip


def _words_among() -> Iterator[Case]:
    for k, word in enumerate(SWITCHING_WORDS):
        lines, numbers = lines_of(HEADS, (P.t, P.d, P.f, P.c))
        lines = [*lines[:61], word, *lines[61:]]
        yield Case(f"words_that_switch_{k}", "words among rows", content(lines), "must_refuse", None, blame=(word[2:],))
    for k, word in enumerate(HARMLESS_WORDS):
        lines, numbers = lines_of(HEADS, (P.t, P.d, P.f, P.c))
        lines = [*lines[:61], word, *lines[61:]]
        right = truth([n + (n > 61) for n in numbers], **_truth(numbers, (P.t, P.d, P.f, P.c)))
        yield Case(f"harmless_words_{k}", "benign words", content(lines), "must_read", right, named=("line 62",))
    for name, remark, may in (
        ("range", "range x10 from here", True),
        ("unit", "force in mN", True),
        ("none", "touched", False),
    ):
        remarks = tuple(remark if i == 60 else "" for i in range(120))
        lines, numbers = lines_of((*HEADS, "Comment"), (P.t, P.d, P.f, P.c, remarks))
        right = truth(numbers, **_truth(numbers, (P.t, P.d, P.f, P.c)))
        made = content(lines)
        if may:
            yield Case(f"remark_of_a_{name}", "words among rows", made, "must_refuse", None, blame=("Comment",))
        else:
            yield Case(f"remark_of_{name}", "benign words", made, "must_read", right, named=("Comment",))
    units = tuple("N" if i < 60 else "mN" for i in range(120))
    lines, _ = lines_of((*HEADS[:3], "Unit"), (P.t, P.d, P.f, units))
    yield Case("column_of_units", "words among rows", content(lines), "must_refuse", None, blame=("Unit",))


FACTORS_ABOVE = (
    ("Load gain: 10", "force"), ("Amplifier factor 2", ""), ("Range x10", ""), ("Verstärkung;100", ""),
    ("Force scale factor = 5", "force"), ("Gain: 20 dB", ""), ("Multiplier,0.5", ""), ("Load x10", "force"),
    ("Extension scaling: 2", "displacement"), ("放大倍数:10", ""), ("Attenuation: 10x", ""), ("Kraft Faktor 0,1", "force"),
    ("Facteur d'échelle: 2", ""),
)  # fmt: skip
NO_FACTORS_ABOVE = (
    "Load gain: 1", "Gauge factor: 2.07", "Load cell capacity: 500 N", "PID gain: 10", "Proportional gain,4",
    "Averaging factor 8", "Range: 500 N", "Calibration factor: -7050", "Sensitivity: 2 mV/V", "Safety factor 3",
    "Quality factor: 120", "Speed 10 mm/min", "Sample rate factor 4",
)  # fmt: skip
UNITS_ABOVE = (
    "Force in mN", "All loads in gf", "Units: s, mm, kN", "Load unit: lbf", "Einheiten: s; mm; kN", "Extension in inches",
    "Load: kN",
)  # fmt: skip


def _words_beside() -> Iterator[Case]:
    for k, (word, quantity) in enumerate(FACTORS_ABOVE):
        for below in (False, True):
            lines, numbers = lines_of(
                HEADS[:3], (P.t, P.d, P.f), above=() if below else ("Tester 5", word, ""), below=("", word) if below else ()
            )
            values = {"time": si(P.t), "displacement": si(P.d, "1e-3"), "force": si(P.f)}
            asked = {"displacement": "mm"} if quantity == "displacement" else {"force": "N"}
            halved = {"displacement": "0.5 mm"} if quantity == "displacement" else {"force": "0.5 N"}
            half = {q: v * 0.5 if q in halved else v for q, v in values.items()}
            yield Case(
                f"factor_{'below' if below else 'above'}_{k}",
                "factors beside",
                content(lines),
                "must_refuse",
                None,
                blame=(word,),
                ways_out=((Reading(units=asked), truth(numbers, **values)), (Reading(units=halved), truth(numbers, **half))),
            )
    for k, word in enumerate(NO_FACTORS_ABOVE):
        lines, numbers = lines_of(HEADS[:3], (P.t, P.d, P.f), above=("Tester 5", word, ""))
        right = truth(numbers, time=si(P.t), displacement=si(P.d, "1e-3"), force=si(P.f))
        yield Case(f"no_factor_above_{k}", "benign words", content(lines), "must_read", right, named=("lines 1 to 2",))
    for k, word in enumerate(UNITS_ABOVE):
        lines, numbers = lines_of(HEADS[:3], (P.t, P.d, P.f), above=("Tester 5", word, ""))
        yield Case(
            f"other_unit_above_{k}", "factors beside", content(lines), "must_refuse", None, blame=("declared in line 2",)
        )
    lines, numbers = lines_of(("Time", "Extension", "Load"), (P.t, P.d, times(P.f, "1000", 0)), above=("Units: s, mm, mN",))
    right = truth(numbers, time=si(P.t), displacement=si(P.d, "1e-3"), force=si(times(P.f, "1000", 0), "1e-3"))
    yield Case("units_listed_above", "benign words", content(lines), "must_read", right)
    lines, numbers = lines_of(HEADS[:3], (P.t, P.d, P.f), above=("Results in N and mm", "Units: s, mm, N"))
    right = truth(numbers, time=si(P.t), displacement=si(P.d, "1e-3"), force=si(P.f))
    yield Case("units_said_twice_above", "benign words", content(lines), "must_read", right)


# --- languages -------------------------------------------------------------------------------------------------------------

LANGUAGES = (
    ("finnish", "Aika (s);Siirtymä (mm);Voima (N)", "latin-1"), ("danish", "Tid (s);Vej (mm);Kraft (N)", "latin-1"),
    ("swedish", "Tid [s];Sträcka [mm];Kraft [N]", "latin-1"),
    ("norwegian", "Tid (s);Forskyvning (mm);Kraft (N)", "latin-1"),
    ("hungarian", "Idő [s];Elmozdulás [mm];Erő [N]", "cp1250"),
    ("turkish", "Zaman (sn);Yer değiştirme (mm);Kuvvet (N)", "cp1254"),
    ("greek", "Χρόνος (s);Μετατόπιση (mm);Δύναμη (N)", "cp1253"),
    ("greek_capitals", "ΧΡΟΝΟΣ (s);ΜΕΤΑΤΟΠΙΣΗ (mm);ΔΥΝΑΜΗ (N)", "cp1253"),
    ("dutch", "Tijd (s);Verplaatsing (mm);Kracht (N)", "latin-1"),
    ("portuguese", "Tempo (s);Deslocamento (mm);Força (N)", "latin-1"),
    ("czech", "Čas [s];Posuv [mm];Síla [N]", "cp1250"), ("slovak", "Čas [s];Dráha [mm];Sila [N]", "cp1250"),
    ("romanian", "Timp (s);Deplasare (mm);Forță (N)", "utf-8"),
    ("ukrainian", "Час (с);Переміщення (мм);Сила (Н)", "cp1251"), ("japanese", "時間(s);変位(mm);荷重(N)", "cp932"),
    ("chinese", "时间(s);位移(mm);力(N)", "gb18030"), ("korean", "시간(s);변위(mm);하중(N)", "cp949"),
    ("traditional_chinese", "時間(s);位移(mm);力量(N)", "utf-8"),
)  # fmt: skip


def _languages() -> Iterator[Case]:
    for name, head, encoding in LANGUAGES:
        lines, numbers = lines_of(head.split(";"), (comma(P.t), comma(P.d), comma(P.f)), sep=";")
        right = truth(numbers, time=si(P.t), displacement=si(P.d, "1e-3"), force=si(P.f))
        yield Case(f"names_{name}", "benign names", content(lines, encoding=encoding), "must_read", right)
    for unit, by in (("daN", "10"), ("dN", "0.1"), ("кгс", "9.80665")):
        lines, numbers = lines_of(("Time (s)", "Extension (mm)", f"Static force ({unit})"), (P.t, P.d, P.f))
        right = truth(numbers, time=si(P.t), displacement=si(P.d, "1e-3"), force=si(P.f, by))
        yield Case(f"static_force_{by}", "benign names", content(lines), "must_read", right)


# --- a header among the rows -----------------------------------------------------------------------------------------------


def _headers_among() -> Iterator[Case]:
    for left in (4, 9, 30):
        for name, second in (
            ("unit", ("Time (s)", "Extension (mm)", "Load (mN)")),
            ("form", ("t [s]", "Weg [mm]", "Kraft [N]")),
        ):
            head = HEADS[:3]
            lines, _ = lines_of(head, (P.t, P.d, P.f))
            lines = [*lines[:-left], ",".join(second), *lines[-left:]]
            blame = (second[-1],)
            yield Case(
                f"header_with_other_{name}_{left}", "headers among rows", content(lines), "must_refuse", None, blame=blame
            )


CASES = (*_switched(), *_real_jumps(), *_words_among(), *_words_beside(), *_languages(), *_headers_among())

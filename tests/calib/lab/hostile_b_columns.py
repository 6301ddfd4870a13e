"""Files in which several columns could be the quantity, or one looks like it, with the one that it is."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from hostile_b_case import Case, Col, Expected, Floats, Press, Written, branches, make, press, said, write

P = press()
GERMAN: Mapping[str, Any] = {"delimiter": ";", "decimal": ",", "encoding": "latin-1"}
POLISH: Mapping[str, Any] = {"delimiter": ";", "decimal": ",", "encoding": "cp1250"}
#: That a choice was made is told, in whatever words.
CHOSEN = r"taken|chosen|chose|prefer|instead|not used|beside|several|two columns|read as"


def time(name: str = "Time", p: Press = P) -> Col:
    """The clock."""
    return Col(name, p.time, "time", "s", 3)


def place(name: str, values: Floats | None = None, quantity: str = "displacement", unit: str = "mm", p: Press = P) -> Col:
    """Where the ball is."""
    return Col(name, p.depth if values is None else values, quantity, unit, 5)


def load(name: str, values: Floats | float | None = None, quantity: str = "force", unit: str = "N", p: Press = P) -> Col:
    """The force."""
    return Col(name, p.force if values is None else values, quantity, unit, 4)


def cap(name: str = "Cp", values: Floats | None = None, quantity: str = "capacitance", unit: str = "pF", p: Press = P) -> Col:
    """The capacitance."""
    digits = None if unit == "F" else 4
    return Col(name, p.capacitance if values is None else values, quantity, unit, digits)


def case(
    name: str, columns: Sequence[Col], expected: Expected = "either", way: Mapping[str, str] | None = None, **more: Any
) -> Case:
    """A case of columns; `way` is quantity -> header cell that leads out; what `write` takes goes to it."""
    how = {
        k: more.pop(k)
        for k in ("above", "below", "style", "units", "header", "delimiter", "decimal", "encoding", "quote")
        if k in more
    }
    written: Written = write(columns, **how)
    way_out = None if way is None else said(columns=way)
    return make(f"column: {name}", "column", expected, written, way_out=way_out, **more)


def _places() -> list[Case]:
    """A length that does not move, or was only asked for, before the one that was measured."""
    d = P.depth
    steps = np.round(d * 1e4) / 1e4
    path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(d)))])
    still = np.full(P.n_row, 0.020)
    gap = 0.012 - d
    drift = d + 3e-5 * P.force / 10.0
    n, F = load("Force"), load("Load")
    turned = branches(P)
    return [
        case(
            "constant D (mm) before Weg (mm)",
            [time("Zeit"), place("D", still, ""), place("Weg"), load("Kraft")],
            way={"displacement": "Weg (mm)"},
            **GERMAN,
            **turned,
        ),
        case(
            "constant d (mm) before Extension (mm)",
            [time(), place("d", still, ""), place("Extension"), F],
            way={"displacement": "Extension (mm)"},
            **turned,
        ),
        case(
            "constant z (mm) before 位移 (mm)",
            [time("时间"), place("z", still, ""), place("位移"), load("力")],
            way={"displacement": "位移 (mm)"},
            encoding="gbk",
            **turned,
        ),
        case(
            "constant Position (mm) before Strain gauge place",
            [time(), place("Position", still, ""), place("Displacement"), n],
            way={"displacement": "Displacement (mm)"},
            **turned,
        ),
        case(
            "Displacement that stands still before a Position that moves",
            [time(), place("Displacement", still * 0, ""), place("Position"), n],
            way={"displacement": "Position (mm)"},
            **turned,
        ),
        case(
            "gauge length and thickness before Déplacement",
            [time("Temps"), place("L0", still, ""), place("Epaisseur", still / 10, ""), place("Déplacement"), n],
            way={"displacement": "Déplacement (mm)"},
            **GERMAN,
            **turned,
        ),
        case(
            "diameter and height before Spostamento",
            [time("Tempo"), place("Diametro", still, ""), place("Altezza", still / 2, ""), place("Spostamento"), load("Forza")],
            way={"displacement": "Spostamento (mm)", "force": "Forza (N)", "time": "Tempo (s)"},
            delimiter=";",
            decimal=",",
            **turned,
        ),
        case(
            "Position command before Position feedback",
            [time(), place("Position command", steps, ""), place("Position feedback"), F],
            way={"displacement": "Position feedback (mm)"},
        ),
        case(
            "Weg Soll before Weg Ist",
            [time("Zeit"), place("Weg Soll", steps, ""), place("Weg Ist"), load("Kraft")],
            way={"displacement": "Weg Ist (mm)"},
            **GERMAN,
        ),
        case(
            "Axial command before Axial displacement",
            [time(), place("Axial Command", steps, ""), place("Axial Displacement"), load("Axial Force")],
            way={"displacement": "Axial Displacement (mm)"},
        ),
        case(
            "Consigne before Position mesurée",
            [time("Temps"), place("Consigne position", steps, ""), place("Position mesurée"), n],
            way={"displacement": "Position mesurée (mm)"},
            **GERMAN,
        ),
        case(
            "Posición objetivo before Posición",
            [time("Tiempo"), place("Posición objetivo", steps, ""), place("Posición"), load("Fuerza")],
            way={"displacement": "Posición (mm)", "force": "Fuerza (N)", "time": "Tiempo (s)"},
            **GERMAN,
        ),
        case(
            "only a commanded position",
            [time(), place("Position command", steps), F],
            expected="refuse",
            way={"displacement": "Position command (mm)"},
            refusal="command",
        ),
        case(
            "only a target position",
            [time(), place("Target displacement", steps), F],
            expected="refuse",
            way={"displacement": "Target displacement (mm)"},
            refusal="target",
        ),
        case(
            "Crosshead and LVDT that differ",
            [time(), place("Crosshead", drift), place("LVDT", d, ""), F],
            choice="LVDT",
            or_else={"displacement": (np.round(d, 8),)},
            way={"displacement": "Crosshead (mm)"},
        ),
        case(
            "Extension and Video extension",
            [time(), place("Video extension", d, ""), place("Extension", drift), F],
            choice="video",
            or_else={"displacement": (np.round(d, 8),)},
            way={"displacement": "Extension (mm)"},
        ),
        case(
            "Traverse and laser",
            [time("Zeit"), place("Laser", d, ""), place("Traversenweg", drift), load("Kraft")],
            choice="laser",
            or_else={"displacement": (np.round(d, 8),)},
            way={"displacement": "Traversenweg (mm)"},
            **GERMAN,
        ),
        case(
            "Extension and Corrected extension",
            [time(), place("Corrected extension", d, ""), place("Extension", drift), F],
            choice="corrected",
            or_else={"displacement": (np.round(d, 8),)},
            way={"displacement": "Extension (mm)"},
        ),
        case(
            "Displacement and Gap",
            [time(), place("Gap", gap, ""), place("Displacement"), n],
            choice="gap",
            or_else={"displacement": (np.round(gap, 8),)},
            way={"displacement": "Displacement (mm)"},
        ),
        case(
            "Werkzeugabstand before Standardweg",
            [time("Prüfzeit"), place("Werkzeugabstand", gap, ""), place("Standardweg"), load("Standardkraft")],
            choice="werkzeugabstand",
            or_else={"displacement": (np.round(gap, 8),)},
            way={"displacement": "Standardweg (mm)"},
            **GERMAN,
            **turned,
        ),
        case(
            "path run through and position",
            [time(), place("Total distance", path, ""), place("Position"), n],
            way={"displacement": "Position (mm)"},
            **turned,
        ),
        case(
            "Piezo and indentation depth",
            [time(), place("Piezo displacement", d * 1.2, "", "um"), place("Indentation depth", None, "displacement", "um"), n],
            choice="piezo",
            or_else={"displacement": (np.round(d * 1.2, 11),)},
            way={"displacement": "Indentation depth (um)"},
        ),
        case(
            "x, y and z of a stage, z moves",
            [
                time(),
                place("Position (x)", still, ""),
                place("Position (y)", still * 2, ""),
                place("Position (z)", 0.03 - d),
                load("Fz"),
            ],
            style="{name}, {unit}",
            delimiter="\t",
            way={"displacement": "Position (z), mm", "force": "Fz, N"},
            choice=r"\(x\)",
        ),
        case(
            "Displacement 1 and Displacement 2 of two presses",
            [time(), place("Displacement 1"), place("Displacement 2", drift, ""), n],
            choice="Displacement 2",
            or_else={"displacement": (np.round(drift, 8),)},
            way={"displacement": "Displacement 1 (mm)"},
        ),
    ]


def _loads() -> list[Case]:
    """Forces that were asked for, counted, corrected, or of another cell."""
    f = P.force
    wish = np.round(f)
    top = np.maximum.accumulate(f)
    mean = np.asarray(np.convolve(f, np.ones(9) / 9, mode="same"), np.float64)
    x, t = place("Extension"), time()
    raw = f + 0.463
    zero = f * 0
    side = 0.02 * f
    made: list[Case] = []
    pairs: tuple[tuple[str, str, Mapping[str, Any], tuple[str, str]], ...] = (
        ("Load (setpoint)", "Force", {}, ("Time", "Extension")),
        ("Target force", "Actual force", {}, ("Time", "Extension")),
        ("Force demand", "Force", {}, ("Time", "Extension")),
        ("Sollkraft", "Istkraft", GERMAN, ("Zeit", "Weg")),
        ("Kraft Sollwert", "Kraft", GERMAN, ("Zeit", "Weg")),
        ("Consigne force", "Force mesurée", GERMAN, ("Temps", "Déplacement")),
        ("Fuerza objetivo", "Fuerza", GERMAN, ("Tiempo", "Desplazamiento")),
        ("Forza impostata", "Forza misurata", GERMAN, ("Tempo", "Spostamento")),
        ("Siła zadana", "Siła", POLISH, ("Czas", "Przemieszczenie")),
        ("目標荷重", "荷重", {"encoding": "shift-jis"}, ("時間", "変位")),
        ("设定力", "力", {"encoding": "gbk"}, ("时间", "位移")),
        ("Fmax", "Force", {}, ("Time", "Extension")),
        ("Preload", "Load", {}, ("Time", "Extension")),
    )
    for wanted, measured, how, (clock, way) in pairs:
        made.append(
            case(
                f"{wanted} before {measured}",
                [time(clock), place(way), load(wanted, wish, ""), load(measured)],
                way={"force": "4", "time": "1", "displacement": "2"}
                if how is POLISH
                else {"force": f"{measured} (N)", "time": f"{clock} (s)", "displacement": f"{way} (mm)"},
                **how,
            )
        )
    return [
        *made,
        case(
            "only a setpoint of force",
            [t, x, load("Load (setpoint)", wish)],
            expected="refuse",
            way={"force": "Load (setpoint) (N)"},
            refusal="setpoint",
        ),
        case(
            "only a peak-hold force",
            [t, x, load("Force (peak hold)", top)],
            expected="refuse",
            refusal="peak",
        ),
        case("Peak force before Force", [t, x, load("Peak force", top, ""), load("Force")], way={"force": "Force (N)"}),
        case("Mean load before Load", [t, x, load("Mean load", mean, ""), load("Load")], way={"force": "Load (N)"}),
        case(
            "Corrected_Force before Raw_Force",
            [t, place("Z_Position"), load("Corrected_Force", f, ""), load("Raw_Force", raw)],
            style="{name}({unit})",
            choice="corrected",
            or_else={"force": (np.round(f, 4),)},
            way={"force": "Raw_Force(N)"},
        ),
        case(
            "filtered and unfiltered force",
            [t, x, load("Force filtered", mean, ""), load("Force unfiltered")],
            choice="filtered",
            or_else={"force": (np.round(mean, 4),)},
            way={"force": "Force unfiltered (N)"},
        ),
        case(
            "Force of an unplugged cell before Load", [t, x, load("Force", zero, ""), load("Load")], way={"force": "Load (N)"}
        ),
        case(
            "two load cells",
            [t, x, load("Load cell 1"), load("Load cell 2", side, "")],
            choice="Load cell 2",
            or_else={"force": (np.round(side, 4),)},
            way={"force": "Load cell 1 (N)"},
        ),
        case("Load and Load 2", [t, x, load("Load"), load("Load 2", side, "")], choice="Load 2", way={"force": "Load (N)"}),
        case(
            "Ch1 Force and Ch2 Force",
            [t, x, load("Ch1 Force", side, ""), load("Ch2 Force")],
            choice="Ch1",
            or_else={"force": (np.round(side, 4),)},
            way={"force": "Ch2 Force (N)"},
        ),
        case(
            "three axes of a load cell",
            [t, x, load("Fx", side, ""), load("Fy", -side, ""), load("Fz")],
            choice="Fx",
            way={"force": "Fz (N)"},
        ),
        case(
            "force per width before force",
            [t, x, load("Force per width", f / 0.02, "", "N/mm"), load("Force")],
            way={"force": "Force (N)"},
        ),
        case(
            "stiffness and work before load",
            [t, x, load("Stiffness", 3000.0, "", "N/mm"), Col("Work", f * P.depth, "", "mJ", 4), load("Load")],
            way={"force": "Load (N)"},
        ),
        case("torque before force", [t, x, load("Torque", side, "", "N·m"), load("Force")], way={"force": "Force (N)"}),
        case(
            "force limit that does not move before force",
            [t, x, load("Force limit", 15.0, ""), load("Force")],
            way={"force": "Force (N)"},
        ),
        case(
            "Load (N) and Load (lbf) that contradict",
            [t, x, load("Load"), load("Load", f * 1.7, "", "lbf")],
            choice="lbf",
            or_else={"force": (np.round(f * 1.7 / 4.4482216152605, 4) * 4.4482216152605,)},
            way={"force": "Load (N)"},
        ),
    ]


def _clocks() -> list[Case]:
    """Several times, of which one runs through the record."""
    p = press(((2.0, 60), (-0.3, 60), (2.0, 60), (-0.3, 60)))
    own = p.time - np.array([p.time[np.argmax(p.cycle == c)] for c in p.cycle])
    half = p.time % 6.0
    x, f = place("Position", p=p), load("Load", p=p)
    return [
        case("Step time before Time", [Col("Step time", half, "", "s", 3), time(p=p), x, f], way={"time": "Time (s)"}),
        case(
            "WaveMatrix, total and elapsed times",
            [
                time("Total Time", p),
                Col("Cycle Elapsed Time", own, "", "s", 3),
                Col("Total Cycles", p.cycle.astype(np.float64), "cycle", "", 0),
                Col("Elapsed Cycles", p.cycle.astype(np.float64) - 1, "", "", 0),
                Col("Step", 1.0, "", "", 0),
                place("Position(Linear:Digital Position)", p=p),
                load("Load(Linear:Load)", p=p),
            ],
            encoding="utf-8-sig",
            quote=True,
            way={"time": "Total Time (s)"},
        ),
        case(
            "Cycle time and Elapsed time, the second runs through",
            [Col("Cycle time", own, "", "s", 3), time("Elapsed time", p), x, f],
            way={"time": "Elapsed time (s)"},
        ),
        case(
            "Schrittzeit before Prüfzeit",
            [Col("Schrittzeit", half, "", "s", 3), time("Prüfzeit", p), place("Standardweg", p=p), load("Standardkraft", p=p)],
            way={"time": "Prüfzeit (s)"},
            **GERMAN,
        ),
        case(
            "Hold time that does not move before Time",
            [Col("Hold time", 5.0, "", "s", 1), time(p=p), x, f],
            way={"time": "Time (s)"},
        ),
    ]


def _series(d: float = 0.4, seed: int = 4) -> tuple[Floats, Floats, Floats]:
    """Series capacitance, dissipation, parallel capacitance of a lossy sensor."""
    loss = d + np.random.default_rng(seed).normal(0, 1e-4, P.n_row)
    return P.capacitance * (1 + loss**2), loss, P.capacitance


def _of_series(columns: Sequence[Col], written: Written) -> Mapping[str, Floats]:
    """The truth of a file whose capacitance column is in series: parallel by the dissipation that is written."""
    truth = dict(written.truth)
    if "series" in truth:
        truth["capacitance"] = truth.pop("series") / (1 + truth["dissipation"] ** 2)
    return truth


def series_case(
    name: str, columns: Sequence[Col], expected: Expected = "either", way_out: Mapping[str, Any] | None = None, **more: Any
) -> Case:
    """A case whose columns have one of quantity "series"."""
    how = {k: more.pop(k) for k in ("above", "style", "units", "header", "delimiter", "decimal", "encoding") if k in more}
    written = write(columns, **how)
    return make(f"column: {name}", "column", expected, written, truth=_of_series(columns, written), way_out=way_out, **more)


def _meters() -> list[Case]:
    """Series for parallel, and losses in per cent, per mille, as a quality, a resistance."""
    cs, d, cp = _series()
    t = time()

    def s(name: str = "C", unit: str = "pF") -> Col:
        return cap(name, cs, "series", unit)

    def loss(name: str = "D", unit: str = "", digits: int = 5) -> Col:
        return Col(name, d, "dissipation", unit, digits)

    omega = float(2 * np.pi * 1000.0)
    esr = d / (omega * cs)
    above = {
        "MODE: Cs-D": ("MODE: Cs-D",),
        "MODE: SERIES": ("MODEL: LCR-6100", "MODE: SERIES", "FREQ: 1.0000kHz", ""),
        "Equivalent circuit, Series": ("Model,IM3536", "Equivalent circuit,Series", ""),
        "Circuit mode SER in a comment": ("# circuit: SER, 1 kHz, 1 V",),
        "FUNC:IMP CSD": ("Keysight Technologies,E4980A", "FUNC:IMP CSD", ""),
        "Meas. function Cs-D": ("HIOKI IM3523", "Meas. function: Cs-D", ""),
        "Ersatzschaltbild seriell": ("Ersatzschaltbild: seriell", ""),
        "Circuit équivalent série": ("Circuit équivalent : série", ""),
        "Modello serie": ("Modello: serie", ""),
        "Układ szeregowy": ("Układ zastępczy: szeregowy", ""),
        "等效电路 串联": ("等效电路: 串联", ""),
        "等価回路 直列": ("等価回路: 直列", ""),
        "Wayne Kerr, Series": ("Wayne Kerr 6500B", "Function: C + D", "Equivalent: Series", ""),
    }
    lines = [series_case(f"series said above, {name}", [t, s(), loss()], above=given) for name, given in above.items()]
    parallel = {
        "MODE: PARALLEL": ("MODEL: LCR-6100", "MODE: PARALLEL", ""),
        "Cp-D": ("HIOKI IM3523", "Meas. function: Cp-D", ""),
        "Ersatzschaltbild parallel": ("Ersatzschaltbild: parallel", ""),
    }
    fine = [
        case(
            f"parallel said above, {name}",
            [t, cap("C"), Col("D", P.dissipation, "dissipation", "", 5)],
            expected="read",
            above=given,
        )
        for name, given in parallel.items()
    ]
    f = Col("Frequency", 1000.0, "frequency", "Hz", 1)
    return [
        *lines,
        *fine,
        series_case("Cs and D of 0.4", [t, s("Cs"), loss()]),
        series_case("CS in farads and D", [t, s("CS", "F"), loss()]),
        series_case("series capacitance in words", [t, s("Series capacitance"), loss("Dissipation factor")]),
        series_case("Reihenkapazität and Verlustfaktor", [time("Zeit"), s("Reihenkapazität"), loss("Verlustfaktor")], **GERMAN),
        series_case("Cs and D in per cent", [t, s("Cs"), loss("D", "%", 3)]),
        series_case("Cs and D in per mille", [t, s("Cs"), loss("D", "‰", 2)]),
        series_case("Cs and D in 1e-3 within the bracket", [t, s("Cs"), loss("D", "x1e-3", 2)]),
        series_case("Cs and tan d in 10^-3", [t, s("Cs"), loss("tan d", "10^-3", 2)], style="{name} [{unit}]"),
        series_case("Cs and tanδ in per cent", [t, s("Cs"), loss("tanδ", "%", 3)]),
        case("Cp and D in per cent", [t, cap(), Col("D", P.dissipation, "dissipation", "%", 4)]),
        case("Cp and D in per mille", [t, cap(), Col("D", P.dissipation, "dissipation", "‰", 3)]),
        case("Cp and D of 2.1 without unit", [t, cap(), Col("D", P.dissipation * 1e3, "dissipation", "", 3)]),
        case("Cs and D of 400 without unit", [t, cap("Cs", cs), Col("D", d * 1e3, "", "", 1)], expected="refuse", refusal="D"),
        series_case(
            "Primary said to be the capacitance under Cs-D",
            [t, s("Primary", "F"), loss("Secondary")],
            above=("Function: Cs-D", ""),
            reading=said(columns={"capacitance": "Primary (F)", "dissipation": "Secondary"}),
            or_else={"capacitance": (np.array([float(f"{v:.5E}") for v in cs]),)},
            choice="series|serial|Cs",
        ),
        case("Cs without any loss", [t, cap("Cs", cs)], expected="refuse", refusal="Cs|series"),
        make(
            "column: Cs and Q",
            "column",
            "either",
            write([t, cap("Cs", cs, ""), Col("Q", 1 / d, "", "", 4)]),
            truth={
                "time": np.round(P.time, 3),
                "capacitance": np.round(cs * 1e12, 4) * 1e-12 / (1 + np.round(1 / d, 4) ** -2),
                "dissipation": 1 / np.round(1 / d, 4),
            },
        ),
        make(
            "column: Cs and ESR with the frequency",
            "column",
            "either",
            write([t, f, cap("Cs", cs, ""), Col("ESR", esr, "", "ohm", 1)]),
            truth={
                "time": np.round(P.time, 3),
                "frequency": np.full(P.n_row, 1000.0),
                "capacitance": np.round(cs * 1e12, 4)
                * 1e-12
                / (1 + (omega * np.round(cs * 1e12, 4) * 1e-12 * np.round(esr, 1)) ** 2),
                "dissipation": omega * np.round(cs * 1e12, 4) * 1e-12 * np.round(esr, 1),
            },
        ),
        case("Cs before Cp", [t, cap("Cs", cs, ""), cap("Cp", cp), loss()], way={"capacitance": "Cp (pF)"}, expected="read"),
        case("Cp before Cs", [t, cap("Cp", cp), cap("Cs", cs, ""), loss()], way={"capacitance": "Cp (pF)"}, expected="read"),
        series_case(
            "Primary and Secondary under Cs-D", [t, s("Primary", "F"), loss("Secondary")], above=("Function: Cs-D", "")
        ),
        case(
            "Primary and Secondary under Cp-D",
            [t, cap("Primary", unit="F"), Col("Secondary", P.dissipation, "dissipation", "", 5)],
            above=("Function: Cp-D", ""),
            way={"capacitance": "Primary (F)"},
        ),
        case(
            "Data A and Data B under CPD",
            [t, cap("Data A", unit="F"), Col("Data B", P.dissipation, "dissipation", "", 5)],
            above=("Keysight Technologies,E4980A", "FUNC:IMP CPD", ""),
            way={"capacitance": "Data A (F)"},
        ),
        case(
            "Primary (F) without a mode",
            [t, cap("Primary", unit="F"), Col("Secondary", 0.0021, "", "", 5)],
            choice="series|parallel|mode|taken",
            way={"capacitance": "Primary (F)"},
        ),
    ]


def _capacitances() -> list[Case]:
    """Several capacitances, none, and what is called as one."""
    c = P.capacitance
    t = time()
    other = 0.97 * c
    z = 1 / (2 * np.pi * 1000 * c)
    stray = np.full(P.n_row, 3.2e-12)
    d_c = c - c[0]
    three = [press(seed=k) for k in (1, 2, 3)]
    order = np.arange(3 * 80) % 3
    times = np.arange(240, dtype=np.float64) * 0.2
    freq = np.array([1e3, 1e4, 1e5])[order]
    values = np.array([three[k].capacitance[i // 3] * (1, 0.98, 0.93)[k] for i, k in enumerate(order)])
    swept = write(
        [
            Col("Time", times, "time", "s", 2),
            Col("Frequency", freq, "frequency", "Hz", 0),
            Col("Cp", values, "capacitance", "pF"),
        ]
    )
    mine = order == 0
    return [
        case("d is a dissipation", [t, cap(), Col("d", P.dissipation, "dissipation", "", 5)], expected="read"),
        case(
            "d (mm) is a place, D a dissipation",
            [Col("t", P.time, "time", "s", 3), place("d"), load("F"), cap(), Col("D", P.dissipation, "dissipation", "", 5)],
            way={"displacement": "d (mm)", "force": "F (N)", "time": "t (s)"},
        ),
        case("D (mm) is the place that moves", [t, place("D"), load("Load"), cap()], way={"displacement": "D (mm)"}),
        case(
            "D (mm) stands still beside Cp",
            [t, place("D", np.full(P.n_row, 0.02), ""), load("Load"), cap()],
            way={"capacitance": "Cp (pF)"},
            **branches(P),
        ),
        case(
            "three frequencies side by side",
            [
                t,
                Col("Cp@1kHz", c, "capacitance", "pF"),
                Col("Cp@10kHz", other, "", "pF"),
                Col("Cp@100kHz", other * 0.9, "", "pF"),
            ],
            choice="10kHz",
            way={"capacitance": "Cp@1kHz (pF)"},
        ),
        case(
            "two frequencies side by side, in brackets",
            [t, Col("Cp (1 kHz)", c, "capacitance", "pF"), Col("Cp (1 MHz)", other, "", "pF")],
            choice="1 MHz",
            way={"capacitance": "Cp (1 kHz) (pF)"},
            or_else={"capacitance": (np.round(other * 1e12, 4) * 1e-12,)},
        ),
        make(
            "column: three frequencies one below the other",
            "column",
            "refuse",
            Written(swept.data, tuple(np.array(swept.lines)[mine]), {q: v[mine] for q, v in swept.truth.items()}, ()),
            way_out=said(where={"Frequency (Hz)": "1000"}),
            refusal="frequency",
        ),
        make(
            "column: three frequencies one below the other, one said",
            "column",
            "read",
            Written(swept.data, tuple(np.array(swept.lines)[mine]), {q: v[mine] for q, v in swept.truth.items()}, ()),
            reading=said(where={"Frequency (Hz)": "1000"}),
        ),
        case(
            "C1 and C2",
            [t, cap("C1"), cap("C2", other, "")],
            choice="C2",
            or_else={"capacitance": (np.round(other * 1e12, 4) * 1e-12,)},
            way={"capacitance": "C1 (pF)"},
        ),
        case("Cap and Cap2", [t, cap("Cap"), cap("Cap2", other, "")], choice="Cap2", way={"capacitance": "Cap (pF)"}),
        case(
            "reference before sensor", [t, cap("C_ref", stray * 30, ""), cap("C_sensor")], way={"capacitance": "C_sensor (pF)"}
        ),
        case("C0 before C", [t, cap("C0", np.full(P.n_row, c[0]), ""), cap("C")], way={"capacitance": "C (pF)"}),
        case("stray capacitance before Cp", [t, cap("Cstray", stray, ""), cap("Cp")], way={"capacitance": "Cp (pF)"}),
        case("delta C before C", [t, cap("ΔC", d_c, ""), cap("C")], way={"capacitance": "C (pF)"}),
        case("delta C alone", [t, cap("ΔC", d_c)], expected="refuse", refusal="ΔC|difference|change"),
        case("dC alone", [t, load("Load"), cap("dC", d_c)], expected="refuse", refusal="dC|difference|change"),
        case("relative change alone", [t, Col("dC/C0", d_c / c[0], "capacitance", "%", 4)], expected="refuse", refusal="dC"),
        case(
            "mean and deviation of Cp",
            [t, cap("Cp mean", c, ""), cap("Cp std", stray / 1e3, ""), cap("Cp")],
            way={"capacitance": "Cp (pF)"},
        ),
        case(
            "impedance and phase alone",
            [t, Col("|Z|", z, "", "ohm", 1), Col("Phase", -89.9, "", "deg", 2), Col("Frequency", 1000.0, "frequency", "Hz", 0)],
            expected="refuse",
            refusal="capacitance",
        ),
        case("impedance, phase and Cp", [t, Col("Z", z, "", "ohm", 1), Col("θ", -89.9, "", "deg", 2), cap()], expected="read"),
        case(
            "inductance and resistance alone",
            [t, Col("Ls", 1.2e-3, "", "H", None), Col("Rs", P.force + 10, "", "ohm", 2)],
            expected="refuse",
            refusal="Ls|capacitance|understood",
        ),
        case(
            "conductance and susceptance alone",
            [t, Col("G", 1e-9 + 0 * c, "", "S", None), Col("B", 6283 * c, "", "S", None)],
            expected="refuse",
            refusal="capacitance|understood",
        ),
        case(
            "charge, voltage and Cp",
            [t, Col("Charge", c * 1.0, "", "pC", 4), Col("Voltage", 1.0, "", "V", 3), cap()],
            expected="read",
        ),
        case(
            "time constant and raw counts before capacitance",
            [
                t,
                Col("Counts", np.asarray(np.round(c * 1e16), np.float64), "", "", 0),
                Col("tau", c * 1e6, "", "us", 4),
                cap("Capacitance"),
            ],
            expected="read",
        ),
        case(
            "capacitance of a cable and of a probe",
            [t, cap("C_cable", stray * 20, ""), cap("C_probe")],
            way={"capacitance": "C_probe (pF)"},
        ),
    ]


def column_cases() -> tuple[Case, ...]:
    """All cases of which column."""
    return (*_places(), *_loads(), *_clocks(), *_meters(), *_capacitances())

"""Files as labs really have them, with nothing wrong in them, and what they say: they have to be read."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from hostile_b_case import Case, Col, Expected, Press, Written, branches, make, press, renamed, said, write

P = press()
GERMAN: Mapping[str, Any] = {"delimiter": ";", "decimal": ",", "encoding": "latin-1"}
PLAIN = ("Time", "Extension", "Load")
_HOW = ("above", "below", "style", "units", "header", "delimiter", "decimal", "eol", "encoding", "quote", "tail", "end")


def frame(labels: Sequence[str] = PLAIN, units: Sequence[str] = ("s", "mm", "N"), p: Press = P, digits: int = 5) -> list[Col]:
    """Time, displacement, force under these names."""
    return [
        Col(labels[0], p.time, "time", units[0], 3),
        Col(labels[1], p.depth, "displacement", units[1], digits),
        Col(labels[2], p.force, "force", units[2], digits),
    ]


def case(name: str, columns: Sequence[Col], expected: Expected = "read", p: Press = P, **more: Any) -> Case:
    """A benign case of columns; what `write` takes goes to it."""
    how = {k: more.pop(k) for k in _HOW if k in more}
    made = write(columns, **how)
    turned = {q: 1 for q in ("force", "displacement") if q in made.truth}
    rows: Mapping[str, Any] = branches(p) if "displacement" in made.truth else {}
    return make(f"benign: {name}", "benign", expected, made, **{"turned": turned, **rows, **more})


def words(name: str, text: str | Sequence[str], n_row: int = P.n_row) -> Col:
    """A column of words."""
    return Col(name, [text] * n_row if isinstance(text, str) else list(text))


def _beside() -> list[Case]:
    """Columns beside the record whose names begin like those of quantities."""
    warm = 23.4 + 0.002 * P.time
    strain = P.depth / 0.03
    c = Col("Cp", P.capacitance, "capacitance", "pF", 4)
    t = Col("Time", P.time, "time", "s", 3)
    f = P.force
    index = Col("", np.arange(P.n_row, dtype=float), "", "", 0)
    status = np.array(["Running"] * P.n_row, dtype=object)
    status[-1] = "Stopped"
    state = ["LOADING" if b == "loading" else "UNLOADING" for b in P.branch]
    return [
        case("T (°C) beside Zeit", [*frame(("Zeit", "Weg", "Kraft")), Col("T", warm, "", "°C", 2)], **GERMAN),
        case("T (°C) before Zeit", [Col("T", warm, "", "°C", 2), *frame(("Zeit", "Weg", "Kraft"))], **GERMAN),
        case("t (s) and T (°C)", [*frame(("t", "Displacement", "Force")), Col("T", warm, "", "°C", 2)], encoding="utf-8"),
        case("C (°C) beside Cp", [t, Col("C", warm, "", "°C", 2), c]),
        case(
            "Temp. C and RH beside a capacitance", [t, c, Col("Temp C", warm, "", "", 2), Col("Humidity", 41.0, "", "%RH", 1)]
        ),
        case(
            "Compression (%) before Compression (mm)",
            [t, Col("Compression", strain, "", "%", 3), *frame(("", "Compression", "Load"))[1:]],
        ),
        case("Compression (%) beside Extension", [*frame(), Col("Compression", strain, "", "%", 3)]),
        case("Charge (pC) beside a capacitance", [t, Col("Charge", P.capacitance, "", "pC", 3), c]),
        case(
            "stress and strain beside force",
            [*frame(), Col("Compressive stress", f / 3e-4, "", "kPa", 3), Col("Compressive strain", strain, "", "%", 3)],
        ),
        case(
            "true stress before force",
            [t, Col("True stress", f / 3e-4, "", "MPa", 5), Col("True strain", strain, "", "", 5), *frame()[1:]],
        ),
        case("a tester's status, Running", [*frame(), words("Status", list(status))]),
        case("a tester's state, LOADING and UNLOADING", [*frame(), words("State", state)]),
        case("a meter's status, OK", [t, c, words("Status", "OK")], left=()),
        case("status of a machine above the header", frame(), above=("Machine: UTM-5", "Status: Running", "Operator: KM", "")),
        case("Load (N) and Load (lbf) that agree", [*frame(), Col("Load", f, "", "lbf", 6)]),
        case("Load (N) and Load (kN) that agree", [*frame(), Col("Load", f, "", "kN", 8)]),
        case("Extension (mm) and Extension (in) that agree", [*frame(), Col("Extension", P.depth, "", "in", 7)]),
        case("Time (s) and Time (min) that agree", [*frame(), Col("Time", P.time, "", "min", 7)]),
        case("empty column of comments", [*frame(), words("Comment", "")]),
        case("markers in a few rows", [*frame(), words("Event", ["touch" if i == 22 else "" for i in range(P.n_row)])]),
        case("index of a data frame", [index, *frame()]),
        case("column named 25", [*frame(), Col("25", warm, "", "", 2)]),
        case("column named 1 before the others", [Col("1", np.arange(P.n_row, dtype=float), "", "", 0), *frame()]),
        case("blank columns between", [frame()[0], words("", ""), frame()[1], words("", ""), frame()[2]]),
        case("date and file name in every row", [words("Date", "2024-03-21"), words("File", "pad7.csv"), *frame()]),
        case("battery, supply and set voltage", [*frame(), Col("Battery", 3.9, "", "V", 2), Col("Vset", 1.0, "", "V", 2)]),
        case("speed beside displacement", [*frame(), Col("Speed", 1e-3 / 60, "", "mm/s", 5)]),
        case("speed before displacement", [t, Col("Displacement rate", 1e-5, "", "mm/s", 5), *frame()[1:]]),
    ]


def _named() -> list[Case]:
    """Names of testers and meters of the world."""
    french = GERMAN
    utf8: Mapping[str, Any] = {"delimiter": ";", "decimal": ","}
    t = Col("Time", P.time, "time", "s", 3)
    cd = [Col("Cp", P.capacitance, "capacitance", "F", None), Col("D", P.dissipation, "dissipation", "", 5)]

    def meter(clock: str, c: str, d: str = "", unit: str = "pF") -> list[Col]:
        loss = [Col(d, P.dissipation, "dissipation", "", 5)] if d else []
        return [Col(clock, P.time, "time", "s", 3), Col(c, P.capacitance, "capacitance", unit, 4), *loss]

    return [
        case(
            "Primary load measurement", frame(("Time measurement", "Primary extension measurement", "Primary load measurement"))
        ),
        case("Tensile Force", frame(("Time", "Tensile extension", "Tensile Force"))),
        case("Tensile load, Crosshead", frame(("Time", "Crosshead", "Tensile load"))),
        case("French, Temps Déplacement Force", frame(("Temps", "Déplacement", "Force")), **french),
        case("French, Temps Course Charge", frame(("Temps", "Course", "Charge")), **french),
        case("French, Temps Enfoncement Effort", frame(("Temps", "Enfoncement", "Effort")), **french),
        case(
            "French, Déplacement traverse, Force, units below",
            frame(("Temps", "Déplacement traverse", "Force")),
            style="{name}",
            units="({unit})",
            **french,
        ),
        case(
            "French, Allongement and Force standard, UTF-8", frame(("Temps d'essai", "Allongement", "Force standard")), **utf8
        ),
        case(
            "French, C_1_Force[kN]",
            frame(("C_1_Temps", "C_1_Déplacement", "C_1_Force"), ("s", "mm", "kN"), digits=6),
            style="{name}[{unit}]",
            **french,
        ),
        case("Polish, Czas Przemieszczenie Siła", frame(("Czas", "Przemieszczenie", "Siła")), **utf8),
        case(
            "Polish, Czas Droga Siła, units below", frame(("Czas", "Droga", "Siła")), style="{name}", units="[{unit}]", **utf8
        ),
        case("Polish, Siła standardowa and Wydłużenie", frame(("Czas badania", "Wydłużenie", "Siła standardowa")), **utf8),
        case("Polish, Ugięcie and Obciążenie", frame(("Czas", "Ugięcie", "Obciążenie")), **utf8),
        case("Polish, cp1250", frame(("Czas", "Przemieszczenie", "Siła")), delimiter=";", decimal=",", encoding="cp1250"),
        case("Italian, Tempo Spostamento Forza", frame(("Tempo", "Spostamento", "Forza")), **utf8),
        case("Italian, Tempo Corsa Carico", frame(("Tempo", "Corsa", "Carico")), **utf8),
        case("Spanish, Tiempo Desplazamiento Fuerza", frame(("Tiempo", "Desplazamiento", "Fuerza")), **utf8),
        case("Spanish, Tiempo Extensión Carga", frame(("Tiempo", "Extensión", "Carga")), **GERMAN),
        case(
            "Spanish, Tiempo Carrera Carga, units below",
            frame(("Tiempo", "Carrera", "Carga")),
            style="{name}",
            units="({unit})",
            **utf8,
        ),
        case("German, Prüfzeit Traversenweg Prüfkraft", frame(("Prüfzeit", "Traversenweg", "Prüfkraft")), **GERMAN),
        case("German, Zeit Stauchung Druckkraft", frame(("Zeit", "Stauchung", "Druckkraft")), **GERMAN),
        case("German, Eindringtiefe", frame(("Zeit", "Eindringtiefe", "Kraft")), **GERMAN),
        case("Chinese, 时间 位移 试验力", frame(("时间", "位移", "试验力")), encoding="gbk"),
        case("Chinese, 时间 变形 载荷, UTF-8", frame(("时间", "变形", "载荷"))),
        case("Chinese, units in words", frame(("时间", "位移", "力"), ("秒", "毫米", "牛")), encoding="gb18030"),
        case("Japanese, 時間 ストローク 試験力", frame(("時間", "ストローク", "試験力")), encoding="shift-jis"),
        case(
            "Japanese, 時間 変位 荷重, wide brackets",
            frame(("時間", "変位", "荷重")),
            style="{name}（{unit}）",
            encoding="shift-jis",
        ),
        case("German meter", meter("Zeit", "Kapazität", "Verlustfaktor"), **GERMAN),
        case("French meter", meter("Temps", "Capacité", "Facteur de pertes"), **GERMAN),
        case("Spanish meter", meter("Tiempo", "Capacidad"), **utf8),
        case("Italian meter", meter("Tempo", "Capacità"), **utf8),
        case("Polish meter", meter("Czas", "Pojemność"), **utf8),
        case("Chinese meter", meter("时间", "电容", "损耗"), encoding="gbk"),
        case("Japanese meter", meter("時間", "静電容量", "損失係数"), encoding="shift-jis"),
        case(
            "Wayne Kerr, parallel",
            [t, *cd],
            above=("Wayne Kerr 6500B", "Frequency 1.0000 kHz, Drive 1.00 V", "Equivalent circuit: Parallel"),
        ),
        case(
            "Keysight with plus signs and exponents",
            [
                Col("Time", [f"+{v:.5E}" for v in P.time]),
                Col("Cp", [f"+{v:.5E}" for v in P.capacitance]),
                Col("D", [f"+{v:.5E}" for v in P.dissipation]),
            ],
            header=("Time (s),Cp (F),D",),
            truth={
                q: np.array([float(f"{x:.5E}") for x in v])
                for q, v in (("time", P.time), ("capacitance", P.capacitance), ("dissipation", P.dissipation))
            },
            left=(),
        ),
        case(
            "Hioki with number, date and time of day",
            [
                Col("No.", np.arange(1.0, P.n_row + 1), "", "", 0),
                words("DATE", "2024/03/21"),
                words("TIME", [f"10:{14 + int(s // 60):02d}:{s % 60:06.3f}" for s in P.time]),
                Col("Cp", P.capacitance, "capacitance", "F", None),
                Col("D", P.dissipation, "dissipation", "", 5),
            ],
            style="{name}[{unit}]",
            above=("HIOKI IM3536",),
            truth={
                "time": np.round(P.time, 3),
                "dissipation": np.round(P.dissipation, 5),
                "capacitance": np.array([float(f"{v:.5E}") for v in P.capacitance]),
            },
            left=(),
        ),
    ]


def _layouts() -> list[Case]:
    """Layouts of exports."""
    bluehill = (
        'Text Inputs : Specimen label,"pad 7"',
        "General : Start Date,21/03/2024 10:14 AM",
        "Dimension : Diameter,20.00,mm",
        "",
    )
    results = (
        "Results Table 1",
        ",Maximum Force,Displacement at Maximum Force",
        ",(N),(mm)",
        "1,10.01,2.00",
        "Mean,10.01,2.00",
        "",
    )
    mach = ("<Mach-1 File>", "<INFO>", "Time:\t10:14:05", "Data Acquisition Rate, Hz:\t10", "<END INFO>", "", "<DATA>")
    zwick = ('"Probenname";"Pad 7"', '"Prüfgeschwindigkeit";"10";"mm/min"', "")
    trapezium = ('"Test Mode","Single"', '"Test Type","Compression"', "", '"1 _ 1"')
    arduino = ("Booting...", "HX711 tare done", "AD7746 found at 0x48")
    grams = write(frame(("Time", "Distance", "Force"), ("sec", "mm", "g"), digits=4), quote=True)
    gf = {**grams.truth}
    millis = [
        Col("millis", P.time + 1.234, "time", "ms", 0),
        Col("force", P.force, "force", "N", 4),
        Col("disp", P.depth, "displacement", "mm", 5),
        Col("cap", P.capacitance, "capacitance", "pF", 4),
    ]
    return [
        case("Bluehill, header block and units row", frame(), style="{name}", units="({unit})", above=bluehill, eol="\r\n"),
        case(
            "Bluehill, notes within the units row",
            frame(),
            header=("Time,Extension,Load", "(s),(mm) from touch,(N) zeroed"),
            above=bluehill,
        ),
        case("units row with words", frame(), header=("Time,Extension,Load", "Seconds,mm,Newton")),
        case(
            "names with notes in a second bracket",
            frame(),
            header=("Time (s),Extension (mm) (crosshead),Load (N) (raw)",),
            expected="either",
            way_out=said(units={"displacement": "mm", "force": "N"}),
        ),
        case(
            "Bluehill, results before the record",
            frame(("Time", "Displacement", "Force")),
            style="{name}",
            units="({unit})",
            above=results,
            quote=True,
            eol="\r\n",
        ),
        case(
            "Zwick .TRA",
            frame(("Prüfzeit", "Standardweg", "Standardkraft")),
            style="{name}",
            units="{unit}",
            quote=False,
            above=zwick,
            suffix=".TRA",
            **GERMAN,
        ),
        case(
            "Zwick .TRA, TAB, corrected distance",
            frame(("Zeit", "Werkzeugabstand korrigiert", "Kraft")),
            style="{name}",
            units="{unit}",
            delimiter="\t",
            encoding="latin-1",
            suffix=".TRA",
            expected="either",
            must_use=None,
            must_not_use=None,
        ),
        case(
            "MTS TestSuite, units row without brackets",
            [frame()[k] for k in (1, 2, 0)],
            style="{name} ",
            units="{unit}",
            delimiter="\t",
            above=("Test Run 3", "Data Acquisition: Timed Data\tTime: 22.1 Sec\t21/03/2024 10:14:05", ""),
            suffix=".txt",
        ),
        case(
            "MTS, Axial Displacement and Axial Force",
            frame(("Time", "Axial Displacement", "Axial Force"), ("Sec", "mm", "N")),
            style="{name}",
            units="{unit}",
            delimiter="\t",
            suffix=".txt",
        ),
        case(
            "Trapezium, one specimen",
            frame(("Time", "Stroke", "Force"), ("sec", "mm", "N")),
            style="{name}",
            units="{unit}",
            quote=True,
            above=trapezium,
        ),
        case(
            "TA.XT in grams of force, unit said",
            frame(("Time", "Distance", "Force"), ("sec", "mm", "g"), digits=4),
            truth=gf,
            quote=True,
            reading=said(units={"force": "gf"}),
        ),
        case(
            "TA.XT in grams of force",
            frame(("Time", "Distance", "Force"), ("sec", "mm", "g"), digits=4),
            "either",
            quote=True,
            way_out=said(units={"force": "gf"}),
            choice="gram|gf",
        ),
        case(
            "Mach-1, one axis",
            [frame(("Time", "Position (z)", "Fz"))[k] for k in (0, 1, 2)],
            style="{name}, {unit}",
            delimiter="\t",
            above=mach,
            below=("<END DATA>",),
            suffix=".txt",
        ),
        case(
            "Mark-10, TAB in a .csv, Reading first",
            [
                Col("Reading", np.arange(1.0, P.n_row + 1), "", "", 0),
                *[frame(("Time", "Travel", "Load"))[k] for k in (2, 1, 0)],
            ],
            style="{name} [{unit}]",
            delimiter="\t",
        ),
        case(
            "FemtoTools, index and square brackets",
            [
                Col("Index", np.arange(P.n_row, dtype=float), "", "-", 0),
                *frame(("Time", "Displacement", "Force A"), ("s", "um", "uN"), digits=3),
            ],
            style="{name}[{unit}]",
            delimiter=";",
        ),
        case("Arduino, names with units behind an underscore", [*millis], header=("time_ms,force_N,disp_mm,cap_pF",), left=()),
        case(
            "Arduino, millis and lines of its start",
            [*millis],
            header=("millis (ms),Force (N),Position (mm),Cap (pF)",),
            above=arduino,
            left=(),
        ),
        case("semicolon told by Excel", frame(), above=("sep=;",), delimiter=";"),
        case("UTF-16 with TAB", frame(), delimiter="\t", encoding="utf-16", suffix=".txt"),
        case("old Mac line ends", frame(), eol="\r"),
        case("delimiter too many at each end", frame(), header=("Time (s),Extension (mm),Load (N),",), tail=","),
        case("delimiter too many, not in the header", frame(), tail=","),
        case("footer and blank lines", frame(), below=("", "", "End of test", "")),
        case("last line without end", frame(), end=False),
        case("quoted with decimal commas", frame(("Zeit", "Weg", "Kraft")), quote=True, **GERMAN),
        case("aligned by blanks", frame(), header=("Time(s)   Extension(mm)   Load(N)",), delimiter="    ", suffix=".txt"),
        case("groups above the names", frame(), above=("Clock,Crosshead,Load cell",)),
        case("comment lines with a number sign", frame(), above=("# ball of 10 mm", "# pad 7", "#")),
        case("header behind a number sign", frame(), header=("# Time (s),Extension (mm),Load (N)",), left=()),
        case("names in capitals", frame(("TIME", "EXTENSION", "LOAD"))),
        case("unit behind a slash", frame(), style="{name} / {unit}"),
        case("unit behind 'in'", frame(), style="{name} in {unit}", delimiter=";"),
    ]


def _rows() -> list[Case]:
    """Readings that are none, and records of another size."""
    gap = P.force.copy()
    gap[[40, 41, 130]] = np.nan
    nan = [("NaN" if np.isnan(v) else f"{v:.4f}") for v in gap]
    na = [("n/a" if np.isnan(v) else f"{v:.4f}") for v in gap]
    dash = [("---" if np.isnan(v) else f"{v:.4f}") for v in gap]
    base = write(frame())
    holes: list[Case] = []
    for label, texts in (("NaN", nan), ("n/a", na), ("dashes", dash)):
        made = case(
            f"missing force as {label}",
            [*frame()[:2], Col("Load (N)", texts)],
            truth={**base.truth, "force": np.array([np.nan if np.isnan(v) else float(f"{v:.4f}") for v in gap])},
            left=(),
        )
        holes.append(replace(made, free=np.isnan(gap)))
    tiny = press(peak=1.0, noise=0.0, jitter=0.0)
    depth, force = tiny.depth * 2.5e-4, tiny.force * 2e-4  # to 500 nm and 200 µN
    rng = np.random.default_rng(8)
    depth, force = depth + rng.normal(0, 2e-10, P.n_row), force + rng.normal(0, 2e-7, P.n_row)
    micro = [
        Col("Time", P.time, "time", "s", 3),
        Col("Depth", depth, "displacement", "nm", 2),
        Col("Load", force, "force", "µN", 3),
    ]
    femto = [
        Col("Time", P.time, "time", "s", 3),
        Col("Displacement", depth, "displacement", "nm", 2),
        Col("Force", force * 1e-2, "force", "nN", 1),
    ]
    short = press(((2.0, 45), (-0.3, 15)))
    quiet = press(noise=0.0, jitter=0.0)
    slow = press(((2.0, 180), (2.0, 40), (-0.3, 180)), step=30.0)
    meter = [
        Col("Time", P.time, "time", "s", 3),
        Col("Cp", np.where(np.arange(P.n_row) % 40 == 7, 9.9e37, P.capacitance), "", "F", None),
        Col("Status", np.where(np.arange(P.n_row) % 40 == 7, 1.0, 0.0), "", "", 0),
    ]
    over = np.arange(P.n_row) % 40 == 7
    micro_case = case(
        "nanometres and micronewtons, scale said", micro, reading=said(scale="micro"), delimiter="\t", suffix=".txt"
    )
    return [
        *holes,
        case(
            "status 1 with 9.9E37",
            meter,
            truth={"time": np.round(P.time, 3), "capacitance": np.array([float(f"{v:.5E}") for v in P.capacitance])},
            free=over,
            left=(),
        ),
        micro_case,
        renamed(micro_case, "benign: nanometres and micronewtons", expected="either", reading={}, way_out=said(scale="micro")),
        case("nanometres and nanonewtons, scale said", femto, reading=said(scale="micro")),
        case("sixty rows", frame(p=short), p=short),
        case("no noise at all", frame(p=quiet), p=quiet),
        case("a press of three hours", frame(p=slow), p=slow),
        case("force in kN with four decimals", [*frame()[:2], Col("Force", P.force * 20, "force", "kN", 4)]),
        case(
            "capacitance in nF with few digits",
            [Col("Time", P.time, "time", "s", 2), Col("Cp", P.capacitance, "capacitance", "nF", 4)],
        ),
        case("microfarads", [Col("Time", P.time, "time", "s", 2), Col("Cp", P.capacitance, "capacitance", "µF", 9)]),
        case("metres and kilonewtons", frame(("Time", "Displacement", "Force"), ("s", "m", "kN"), digits=8)),
        case("inches and pounds", frame(("Time", "Displacement", "Force"), ("s", "in", "lbf"), digits=6)),
        case("micrometres and millinewtons", frame(("Time", "Displacement", "Force"), ("s", "um", "mN"), digits=2)),
    ]


def _stacked(parts: Sequence[Written], between: Sequence[Sequence[str]], above: Sequence[str] = ()) -> tuple[Written, ...]:
    """Files one below the other, as one file; each part with its lines in it."""
    text: list[str] = list(above)
    lines: list[tuple[int, ...]] = []
    for part, before in zip(parts, between, strict=True):
        text += before
        lines.append(tuple(n + len(text) for n in part.lines))
        text += part.data.decode().rstrip("\n").split("\n")
    data = ("\n".join(text) + "\n").encode()
    return tuple(Written(data, at, p.truth, ()) for at, p in zip(lines, parts, strict=True))


def _beside_each_other(
    presses: Sequence[Press], labels: Sequence[str], named: bool, above: Sequence[str]
) -> tuple[Written, ...]:
    """Specimens side by side; the names of the columns stand above the first alone or above all."""
    groups = [write(frame(labels, ("min", "mm", "N"), p), style="{name} ({unit})") for p in presses]
    rows = [g.data.decode().rstrip("\n").split("\n") for g in groups]
    head = rows[0][0] if not named else ",".join(r[0] for r in rows)
    body = [",".join(cells) for cells in zip(*(r[1:] for r in rows), strict=True)]
    data = "\n".join([*above, head + ("," * 3 * (len(presses) - 1) if not named else ""), *body]) + "\n"
    first = len(above) + 2
    return tuple(Written(data.encode(), tuple(range(first, first + len(body))), g.truth, ()) for g in groups)


def _specimens() -> list[Case]:
    """Several specimens in one file, one of them wanted."""
    presses = [press(seed=k, peak=8.0 + k) for k in (1, 2, 3)]
    out: list[Case] = []

    def both(name: str, parts: Sequence[Written], which: int, open_: Expected = "refuse", **more: Any) -> None:
        wanted = parts[which - 1]
        turned = {"turned": {"force": 1, "displacement": 1}, **branches(presses[which - 1])}
        out.append(
            make(f"benign: {name}, specimen {which} said", "benign", "read", wanted, reading=said(specimen=which), **turned)
        )
        out.append(
            make(f"benign: {name}, none said", "benign", open_, wanted, way_out=said(specimen=which), **{**turned, **more})
        )

    universal = [
        write(
            frame(("Time", "Displacement", "Force"), ("s", "mm", "kN"), p, 8),
            quote=False,
            header=(f"{k},Time,Displacement,Force", ",(s),(mm),(kN)"),
        )
        for k, p in enumerate(presses, 1)
    ]
    shifted = [replace(w, data=_indent(w.data)) for w in universal]
    both("Bluehill Universal, one below the other", _stacked(shifted, [[], [], []]), 2)
    both("Bluehill Universal, one below the other, blank lines between", _stacked(shifted, [[], [""], [""]]), 3)
    both(
        "Bluehill Universal, results above",
        _stacked(shifted, [[], [], []], ("Results", ",Maximum Force", ",(kN)", "1,0.009", "2,0.010", "3,0.011", "")),
        3,
    )
    plain = [
        write(frame(("Time", "Displacement", "Force"), ("s", "mm", "N"), p), style="{name}", units="({unit})") for p in presses
    ]
    both(
        "Bluehill Universal, Specimen 1 as a line",
        _stacked(plain, [['"Specimen 1"'], ["", '"Specimen 2"'], ["", '"Specimen 3"']]),
        2,
    )
    both("blank line between two presses, names repeated", _stacked(plain[:2], [[], [""]]), 2)
    trapezium = [
        write(frame(("Time", "Stroke", "Force"), ("sec", "mm", "N"), p), style="{name}", units="{unit}", quote=True)
        for p in presses
    ]
    both("Trapezium, a block per specimen", _stacked(trapezium, [['"1 _ 1"'], ["", '"1 _ 2"'], ["", '"1 _ 3"']]), 3)
    mecmesin = _beside_each_other(presses, ("Time", "Displacement", "Load"), True, ("Sample 1,,,,,,,,",))
    both("Mecmesin, side by side, all columns named", mecmesin, 2)
    only = _beside_each_other(presses, ("Time", "Displacement", "Load"), False, ("Sample 1,,,,,,,,",))
    both("Mecmesin, side by side, only the first named", only, 1, "either", choice="column|sample|specimen")
    each = _beside_each_other(presses, ("Time", "Displacement", "Load"), True, ("Sample 1,,,Sample 2,,,Sample 3,,",))
    both("side by side, each with its number", each, 3)
    return out


def _indent(data: bytes) -> bytes:
    """The rows below a header of two lines get an empty first cell, as Bluehill Universal writes them."""
    head, units, *rows = data.decode().rstrip("\n").split("\n")
    return ("\n".join([head, units, *(f",{r}" for r in rows)]) + "\n").encode()


def benign_cases() -> tuple[Case, ...]:
    """All files that have to be read."""
    return (*_beside(), *_named(), *_layouts(), *_rows(), *_specimens())

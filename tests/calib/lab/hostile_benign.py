"""Files that look hostile and are what labs really have: they must be read."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from hostile_cases import Case, Truth, truth
from hostile_press import comma, content, lines_of, minus, press, si, times

from calib.lab import Reading

KIND = "benign"
P = press(150, seed=131)
NUMBER = tuple(str(i + 1) for i in range(150))


def _tester(rows: Sequence[int], turned: bool = False) -> Truth:
    d, f = (minus(P.d), minus(P.f)) if turned else (P.d, P.f)
    return truth(rows, time=si(P.t), displacement=si(d, "1e-3"), force=si(f))


def _meter(rows: Sequence[int], loss: bool = True) -> Truth:
    more = {"dissipation": si(P.loss)} if loss else {}
    return truth(rows, time=si(P.t), capacitance=si(P.c, "1e-12"), **more)


def _languages() -> Iterator[Case]:
    for name, heads, encoding in (
        ("french", ("Temps (s)", "Déplacement (mm)", "Force (N)"), "latin-1"),
        ("french_traverse", ("Temps [s]", "Déplacement traverse [mm]", "Charge [N]"), "utf-8"),
        ("polish", ("Czas (s)", "Przemieszczenie (mm)", "Siła (N)"), "cp1250"),
        ("polish_standard", ("Czas [s]", "Droga [mm]", "Siła standardowa [N]"), "utf-8"),
        ("italian", ("Tempo (s)", "Spostamento (mm)", "Forza (N)"), "utf-8"),
        ("spanish", ("Tiempo (s)", "Desplazamiento (mm)", "Carga (N)"), "latin-1"),
        ("german", ("Zeit [s]", "Traversenweg [mm]", "Standardkraft [N]"), "latin-1"),
        ("german_din", ("t / s", "s / mm", "F / N"), "latin-1"),
        ("german_in", ("Zeit in s", "Weg in mm", "Kraft in N"), "utf-8"),
    ):
        lines, rows = lines_of(heads, [comma(c) for c in (P.t, P.d, P.f)], sep=";")
        yield Case(f"{name}_header", KIND, content(lines, end="\r\n", encoding=encoding), "must_read", _tester(rows))
    for name, heads, encoding in (
        ("chinese", ("时间 (s)", "位移 (mm)", "载荷 (N)"), "gbk"),
        ("japanese", ("時間 (s)", "変位 (mm)", "荷重 (N)"), "shift-jis"),
        ("spreadsheet_unicode", ("Time (s)", "Extension (mm)", "Load (N)"), "utf-16"),
        ("byte_order_mark", ("Time (s)", "Extension (mm)", "Load (N)"), "utf-8-sig"),
    ):
        lines, rows = lines_of(heads, [P.t, P.d, P.f], sep="\t" if encoding == "utf-16" else ",")
        yield Case(f"{name}_encoding", KIND, content(lines, end="\r\n", encoding=encoding), "must_read", _tester(rows))


def _other_columns() -> Iterator[Case]:
    warm = tuple(f"{23.1 + i % 3 / 10:.1f}" for i in range(150))
    for name, heads, extra, named in (
        ("temperature_t_beside_zeit", ("Zeit (s)", "Weg (mm)", "Kraft (N)", "T (°C)"), warm, "T (°C)"),
        ("temperature_c", ("Time (s)", "Extension (mm)", "Load (N)", "C (°C)"), warm, "C (°C)"),
        (
            "compression_percent",
            ("Time (s)", "Extension (mm)", "Load (N)", "Compression (%)"),
            times(P.d, "3.3333", 3),
            "Compression (%)",
        ),
        ("charge", ("Time (s)", "Extension (mm)", "Load (N)", "Charge (pC)"), times(P.f, "2.1", 3), "Charge (pC)"),
        ("stress_and_more", ("Time (s)", "Extension (mm)", "Load (N)", "Stress (kPa)"), times(P.f, "3.1", 3), "Stress (kPa)"),
        (
            "frequency_of_sampling",
            ("Time (s)", "Extension (mm)", "Load (N)", "Rate (mm/min)"),
            ("10.0",) * 150,
            "Rate (mm/min)",
        ),
        ("status_running", ("Time (s)", "Extension (mm)", "Load (N)", "Status"), ("Running",) * 150, ""),
        (
            "remarks_now_and_then",
            ("Time (s)", "Extension (mm)", "Load (N)", "Remark"),
            tuple("touch" if i == 12 else "" for i in range(150)),
            "Remark",
        ),
        (
            "voltage_of_the_cell",
            ("Time (s)", "Extension (mm)", "Load (N)", "Load cell (mV)"),
            times(P.f, "0.2", 4),
            "Load cell (mV)",
        ),
        (
            "force_in_pounds_too",
            ("Time (s)", "Extension (mm)", "Load (N)", "Load (lbf)"),
            times(P.f, "0.224808943", 6),
            "Load (lbf)",
        ),
        (
            "extension_in_inches_too",
            ("Time (s)", "Extension (mm)", "Load (N)", "Extension (in)"),
            times(P.d, "0.0393700787", 7),
            "Extension (in)",
        ),
        (
            "force_in_kilonewtons_too",
            ("Time (s)", "Extension (mm)", "Load (N)", "Load (kN)"),
            times(P.f, "0.001", 6),
            "Load (kN)",
        ),
    ):
        lines, rows = lines_of(heads, [P.t, P.d, P.f, extra])
        yield Case(f"beside_{name}", KIND, content(lines), "must_read", _tester(rows), named=(named,) if named else ())
    names = ("Time (s)", "Frequency (Hz)", "Level (V)", "Cp (pF)", "D", "Status")
    constant = [("1000",) * 150, ("1.0",) * 150]
    lines, rows = lines_of(names, [P.t, *constant, P.c, P.loss, ("0",) * 150])
    known = truth(rows, time=si(P.t), frequency=si(constant[0]), capacitance=si(P.c, "1e-12"), dissipation=si(P.loss))
    yield Case("one_frequency_throughout", KIND, content(lines), "must_read", known, named=("Level (V)",))
    lines, rows = lines_of(("Time (s)", "Cp @1kHz (pF)"), [P.t, P.c])
    yield Case("frequency_in_the_name", KIND, content(lines), "must_read", _meter(rows, loss=False))
    lines, rows = lines_of(("Time (s)", "Cp (1 kHz) (pF)"), [P.t, P.c])
    yield Case("frequency_in_a_bracket", KIND, content(lines), "must_read", _meter(rows, loss=False))
    lines, rows = lines_of(
        ("No.", "Time (s)", "CP[F]", "D[]", "STATUS"), [NUMBER, P.t, tuple(f"{x}E-12" for x in P.c), P.loss, ("0",) * 150]
    )
    yield Case("numbered_readings_of_a_meter", KIND, content(lines), "must_read", _meter(rows), named=("No.",))


def _names() -> Iterator[Case]:
    for name, heads in (
        ("primary_load_measurement", ("Time measurement (s)", "Extension (mm)", "Primary load measurement (N)")),
        ("tensile_force", ("Time (s)", "Displacement (mm)", "Tensile Force (N)")),
        ("cell_in_a_bracket", ("Time (s)", "Extension (crosshead) (mm)", "Load (Cell 1) (N)")),
        ("channel_in_a_name", ("T_1_Time[s]", "C_2_Stroke[mm]", "C_1_Force[kN]")),
        ("capitals", ("TIME (S)", "EXTENSION (MM)", "LOAD (N)")),
        ("underscores", ("time_s", "displacement_mm", "force_N")),
        ("no_blanks", ("Time(s)", "Displacement(mm)", "Force(N)")),
        ("units_behind_a_comma", ("Time / s", "Displacement / mm", "Force / N")),
        ("mach_1", ("Time, s", "Position (z), mm", "Fz, N")),
        ("filtered", ("Time (s)", "Extension (mm)", "Load (filtered) (N)")),
        ("machine_words", ("Test time (s)", "Crosshead displacement (mm)", "Load cell (N)")),
        ("stroke", ("Time [sec]", "Stroke [mm]", "Force [N]")),
    ):
        kilo = "kN" in heads[2]
        lines, rows = lines_of(heads, [P.t, P.d, times(P.f, "0.001", 6) if kilo else P.f], sep="\t")
        yield Case(f"named_{name}", KIND, content(lines), "must_read", _tester(rows))
    lines, rows = lines_of(("1", "2", "3"), [P.t, P.d, P.f])
    said = Reading(
        columns={"time": "1", "displacement": "2", "force": "3"}, units={"time": "s", "displacement": "mm", "force": "N"}
    )
    yield Case("numbers_as_names", KIND, content(lines), "must_read", _tester(rows), reading=said, why="a numeric column name")


def _frames() -> Iterator[Case]:
    heads = ("Time", "Extension", "Load")
    units = ("(s)", "(mm)", "(N)")
    block = [
        'Text Inputs : Specimen label,"22L.3"',
        "General : Start Date,13/11/2018 5:14 PM",
        "Rate : Rate 1,1.00000,mm/min",
        "",
    ]
    lines, rows = lines_of(heads, [P.t, minus(P.d), minus(P.f)], above=block, units=units)
    yield Case("bluehill_block", KIND, content(lines, end="\r\n"), "must_read", _tester(rows, turned=True))
    quoted = [tuple(f'"{x}"' for x in c) for c in (("",) * 150, P.t, P.d, P.f)]
    lines, rows = lines_of(("1", *heads), quoted, units=("", *units))
    yield Case("specimen_number_before_names", KIND, content(lines, end="\r\n"), "must_read", _tester(rows))
    lines, rows = lines_of(
        heads, [P.t, P.d, P.f], units=("[s]", "[mm]", "[N]"), sep=";", above=["Load cell: 50 N", "Factor: 1"]
    )
    yield Case("range_of_the_cell_above", KIND, content(lines), "must_read", _tester(rows))
    plain, rows = lines_of(("Time (s)", "Extension (mm)", "Load (N)"), [P.t, P.d, P.f])
    yield Case("carriage_returns_only", KIND, content(plain, end="\r"), "must_read", _tester(rows))
    yield Case("padded_cells", KIND, content([" , ".join(x.split(",")) for x in plain]), "must_read", _tester(rows))
    yield Case("empty_lines_at_the_end", KIND, content([*plain, "", "", ",,"]), "must_read", _tester(rows))
    yield Case(
        "end_of_test", KIND, content([*plain, "End of test"]), "must_read", _tester(rows), named=("End of test|line 152",)
    )
    spaced = [plain[0], *(x for row in plain[1:] for x in (row, ""))]
    yield Case("every_other_line_empty", KIND, content(spaced), "must_read", _tester(range(2, 302, 2)))
    hashed = ["# tester: Instron 5943", "# cell: 50 N", "# rate: 1 mm/min", *plain]
    yield Case("remarks_above_the_header", KIND, content(hashed), "must_read", _tester(range(5, 155)))
    over = list(plain)
    over[80] = f"{P.t[79]},{P.d[79]},OVER"
    known = truth(rows, time=si(P.t), displacement=si(P.d, "1e-3"), force=si((*P.f[:79], "", *P.f[80:])))
    yield Case("one_reading_over", KIND, content(over), "must_read", known, excused=frozenset([81]))
    swapped, rows = lines_of(("Load (N)", "Extension (mm)", "Time (s)"), [P.f, P.d, P.t])
    yield Case("load_first", KIND, content(swapped), "must_read", _tester(rows))
    lines, rows = lines_of(("Extension (mm)", "Load (N)"), [P.d, P.f])
    known = truth(rows, displacement=si(P.d, "1e-3"), force=si(P.f))
    yield Case("no_time_at_all", KIND, content(lines), "must_read", known)
    lines, rows = lines_of(("Time (s)", "Extension (mm)", "Load (N)", "Cp (pF)", "D"), [P.t, P.d, P.f, P.c, P.loss])
    known = truth(
        rows, time=si(P.t), displacement=si(P.d, "1e-3"), force=si(P.f), capacitance=si(P.c, "1e-12"), dissipation=si(P.loss)
    )
    yield Case("press_and_capacitance_in_one", KIND, content(lines), "must_read", known)
    text = [f"{t:>10}{d:>12}{f:>12}" for t, d, f in zip(P.t, P.d, P.f, strict=True)]
    yield Case(
        "fixed_width",
        KIND,
        content([f"{'Time(s)':>10}{'Disp(mm)':>12}{'Force(N)':>12}", *text]),
        "must_read",
        _tester(range(2, 152)),
        suffix=".txt",
    )
    cut = [*plain[:-1], plain[-1][:9]]
    yield Case(
        "ends_within_a_line",
        KIND,
        "\n".join(cut).encode(),
        "must_read",
        _tester(range(2, 152)),
        excused=frozenset([151]),
        free=frozenset(),
    )


CASES = (*_languages(), *_other_columns(), *_names(), *_frames())

"""Files with columns, lines and blocks that are easily dropped or merged without a word."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from hostile_cases import Case, truth
from hostile_press import comma, content, lines_of, minus, press, si, times

from calib.lab import Reading

KIND = "unread"
A = press(120, seed=1)
B = press(120, seed=2, depth=1.2, top=5.2)
TESTER = {"time": si(A.t), "displacement": si(A.d, "1e-3"), "force": si(A.f)}
METER = {"time": si(A.t), "capacitance": si(A.c, "1e-12")}


def _second_load_cells() -> Iterator[Case]:
    for name, first, second in (
        ("load_and_load_2", "Load (N)", "Load 2 (N)"),
        ("force_and_aux_force", "Force [N]", "Force aux [N]"),
        ("kraft_and_kraft_sensor_b", "Kraft [N]", "Kraft_Sensor_B [N]"),
        ("load_and_load_cell_b", "Load(N)", "Load(cell B)(N)"),
    ):
        time, way = ("Zeit [s]", "Weg [mm]") if "Kraft" in first else ("Time (s)", "Extension (mm)")
        lines, rows = lines_of([time, way, first, second], [A.t, A.d, A.f, B.f])
        yield Case(
            name,
            KIND,
            content(lines),
            "may_refuse",
            truth(rows, **TESTER),
            named=(second.split(" [")[0].removesuffix(" (N)").removesuffix("(N)"),),
            ways_out=(
                (Reading(columns={"force": first}), truth(rows, **TESTER)),
                (Reading(columns={"force": second}), truth(rows, **{**TESTER, "force": si(B.f)})),
            ),
            why="a second load cell beside the first",
        )


def _numbered_channels() -> Iterator[Case]:
    for name, heads, quantity, factor, pair in (
        ("two_capacitance_channels", ("C1 (pF)", "C2 (pF)"), "capacitance", "1e-12", (A.c, B.c)),
        ("channels_ch0_ch1_pf", ("CH0_pF", "CH1_pF"), "capacitance", "1e-12", (A.c, B.c)),
        ("two_forces_fz_1_fz_2", ("Fz_1 (N)", "Fz_2 (N)"), "force", "1", (A.f, B.f)),
        ("two_sensors_cap_a_cap_b", ("Cap_A [pF]", "Cap_B [pF]"), "capacitance", "1e-12", (A.c, B.c)),
        ("two_equal_names", ("Load (N)", "Load (N)"), "force", "1", (A.f, B.f)),
    ):
        others = (["Extension (mm)"], [A.d]) if quantity == "force" else ([], [])
        lines, rows = lines_of(["Time (s)", *others[0], *heads], [A.t, *others[1], *pair])
        base = {"time": si(A.t), **({"displacement": si(A.d, "1e-3")} if quantity == "force" else {})}
        by_number = name == "two_equal_names"
        yield Case(
            name,
            KIND,
            content(lines, end="\r\n"),
            "must_refuse",
            truth(rows, **base, **{quantity: si(pair[0], factor)}),
            blame=heads,
            named=() if by_number else (heads[1].split(" ")[0],),
            ways_out=tuple(
                (
                    Reading(columns={quantity: str(len(others[0]) + 2 + i) if by_number else head}),
                    truth(rows, **base, **{quantity: si(pair[i], factor)}),
                )
                for i, head in enumerate(heads)
            ),
            why="two channels of equal rank: which one is a choice of the user",
        )


def _plain_name_beside_numbered() -> Iterator[Case]:
    lines, rows = lines_of(["Time (s)", "Cap (pF)", "Cap2 (pF)"], [A.t, A.c, B.c])
    yield Case(
        "cap_and_cap2",
        KIND,
        content(lines),
        "may_refuse",
        truth(rows, **METER),
        named=("Cap2",),
        ways_out=((Reading(columns={"capacitance": "Cap2 (pF)"}), truth(rows, time=si(A.t), capacitance=si(B.c, "1e-12"))),),
    )
    lines, rows = lines_of(["Time (s)", "Cp (pF)", "D", "Cp (pF).1", "D.1"], [A.t, A.c, A.loss, B.c, B.loss])
    yield Case(
        "pandas_renamed_duplicates",
        KIND,
        content(lines),
        "may_refuse",
        truth(rows, **METER, dissipation=si(A.loss)),
        named=("Cp (pF).1", "D.1"),
        free=frozenset({"dissipation"}),
        why="pandas writes the second of two equal names with .1",
    )
    strain = tuple(f"{100 * float(d) / 30:.4f}" for d in A.d)
    lines, rows = lines_of(
        ["Time (s)", "Extension (mm)", "Load (N)", "Compressive strain (%)", "Corrected position (mm)", "Temp (C)"],
        [A.t, A.d, A.f, strain, times(A.d, "0.987", 4), ("23.1",) * 120],
    )
    yield Case(
        "corrected_position_strain_and_temperature",
        KIND,
        content(lines),
        "may_refuse",
        truth(rows, **TESTER),
        named=("Compressive strain", "Corrected position", "Temp"),
    )


def _headers_behind_marks() -> Iterator[Case]:
    for name, mark, heads, sep, above in (
        ("savetxt_hash_comma", "# ", ("time (s)", "displacement (mm)", "force (N)"), ",", ()),
        ("savetxt_hash_tight", "#", ("Time[s]", "Displacement[mm]", "Force[N]"), ";", ()),
        ("savetxt_percent", "% ", ("t (s)", "displacement (mm)", "force (N)"), "\t", ()),
        ("savetxt_two_lines", "# ", ("time (s)", "displacement (mm)", "force (N)"), ",", ("# sample 3, silicone 00-30",)),
        ("savetxt_blanks", "# ", ("Time_s", "Displacement_mm", "Force_N"), " ", ()),
        ("savetxt_swapped", "# ", ("force (N)", "displacement (mm)", "time (s)"), ",", ()),
        ("comment_by_semicolon", "; ", ("time (s)", "displacement (mm)", "force (N)"), ",", ()),
        ("comment_by_slashes", "// ", ("time (s)", "displacement (mm)", "force (N)"), ",", ()),
    ):
        columns = [A.f, A.d, A.t] if "swapped" in name else [A.t, A.d, A.f]
        exponents = [tuple(f"{float(x):.6e}" for x in c) for c in columns]
        lines, rows = lines_of(heads, exponents, sep=sep)
        lines, rows = [*above, mark + lines[0], *lines[1:]], tuple(r + len(above) for r in rows)
        yield Case(
            name,
            KIND,
            content(lines),
            "must_read" if mark == "# " else "may_refuse",
            truth(rows, **TESTER),
            blame=("header", "#", "%"),
            why="the header is behind the mark of a comment",
        )
    lines, rows = lines_of(
        ["time (s)", "displacement (mm)", "force (N)"],
        [A.t, A.d, A.f],
        above=["# columns: time (s), force (N), displacement (mm)"],
    )
    yield Case(
        "comment_contradicts_header",
        KIND,
        content(lines),
        "may_refuse",
        truth(rows, **TESTER),
        blame=("line 1", "line 2"),
        named=("line 1|columns:|lines 1 to 1",),
        why="a stale comment lists another order than the header",
    )


def _long_formats() -> Iterator[Case]:
    def interleaved(name: str, key: str, values: tuple[str, ...], place: int, why: str, seeds: int = 10) -> Case:
        records = [press(60, seed=seeds + i, top=4.0 + i) for i in range(len(values))]
        heads = ["Time (s)", "Cp (pF)", "D"]
        heads.insert(place, key)
        lines, rows_of = [",".join(heads)], {v: list[int]() for v in values}
        for i in range(60):
            for value, record in zip(values, records, strict=True):
                cells = [record.t[i], record.c[i], record.loss[i]]
                cells.insert(place, value)
                lines.append(",".join(cells))
                rows_of[value].append(len(lines))
        return Case(
            name,
            KIND,
            content(lines),
            "must_refuse",
            None,
            blame=(key, *values),
            free=frozenset({"frequency"}),
            ways_out=tuple(
                (
                    Reading(where={key: value}),
                    truth(
                        rows_of[value],
                        time=si(record.t),
                        capacitance=si(record.c, "1e-12"),
                        dissipation=si(record.loss),
                    ),
                )
                for value, record in zip(values, records, strict=True)
            ),
            why=why,
        )

    yield interleaved("long_channel", "Channel", ("1", "2", "3"), 1, "channels below each other")
    yield interleaved("long_sensor_letters", "Sensor", ("A", "B"), 0, "two sensors in turn")
    yield interleaved("long_electrode", "electrode", ("r0c0", "r0c1", "r1c0", "r1c1"), 3, "a matrix of electrodes, scanned")
    yield interleaved("list_sweep_frequency", "Frequency (Hz)", ("1000", "10000", "100000"), 1, "list sweep of a meter")
    yield interleaved("list_sweep_exponents", "FREQ[Hz]", ("1.00000E+03", "1.00000E+05"), 0, "list sweep, exponents")
    yield interleaved("list_sweep_khz", "f (kHz)", ("1", "100"), 1, "list sweep, kHz")
    yield interleaved("list_sweep_level", "Level (V)", ("0.5", "1.0"), 1, "two drive levels in turn")
    yield interleaved("list_sweep_bias", "DC bias (V)", ("0", "5"), 3, "two bias voltages in turn")
    yield interleaved("list_sweep_range", "Range", ("100pF", "1nF"), 3, "two ranges in turn")
    yield interleaved("list_sweep_speed", "Speed", ("FAST", "SLOW2"), 3, "two speeds in turn")
    nameless = interleaved("long_nameless_key", "", ("1", "2"), 0, "channel numbers in a column without a name")
    yield replace(nameless, blame=("column 1", "time"), ways_out=())

    lines, rows = ["Specimen,Time (s),Extension (mm),Load (N)"], {"1": list[int](), "2": list[int]()}
    for number, record in (("1", A), ("2", B)):
        for cells in zip(record.t, record.d, record.f, strict=True):
            lines.append(",".join((number, *cells)))
            rows[number].append(len(lines))
    truths = {n: truth(rows[n], time=si(r.t), displacement=si(r.d, "1e-3"), force=si(r.f)) for n, r in (("1", A), ("2", B))}
    yield Case(
        "long_specimen",
        KIND,
        content(lines),
        "must_refuse",
        None,
        blame=("Specimen",),
        ways_out=tuple((Reading(where={"Specimen": n}), t) for n, t in truths.items())
        + tuple((Reading(specimen=int(n)), t) for n, t in truths.items()),
        why="specimens below each other, the time begins again",
    )
    lines = [line.replace("Specimen", "sample_name") for line in lines]
    lines = [("S-11" + line[1:] if line[0] == "1" else "S-12" + line[1:]) if line[0] in "12" else line for line in lines]
    yield Case(
        "long_sample_name",
        KIND,
        content(lines),
        "must_refuse",
        None,
        blame=("sample_name", "specimen"),
        ways_out=tuple((Reading(where={"sample_name": f"S-1{n}"}), t) for n, t in truths.items()),
    )
    lines, chosen = ["run,t_s,d_mm,F_N"], {n: list[int]() for n in ("1", "2", "3")}
    records = {n: press(60, seed=30 + int(n), top=5 + int(n)) for n in chosen}
    for n, record in records.items():
        for i in range(60):
            lines.append(f"{n},{float(record.t[i]) + 6 * (int(n) - 1):.2f},{record.d[i]},{record.f[i]}")
            chosen[n].append(len(lines))
    everything = tuple(range(2, len(lines) + 1))
    yield Case(
        "runs_one_after_the_other",
        KIND,
        content(lines),
        "may_refuse",
        truth(
            everything,
            time=si([line.split(",")[1] for line in lines[1:]]),
            displacement=si([line.split(",")[2] for line in lines[1:]], "1e-3"),
            force=si([line.split(",")[3] for line in lines[1:]]),
        ),
        named=("run",),
        free=frozenset({"cycle"}),
        ways_out=tuple(
            (
                Reading(where={"run": n}),
                truth(chosen[n], time=si(r.t), displacement=si(r.d, "1e-3"), force=si(r.f)),
            )
            for n, r in records.items()
        ),
        why="three presses of one record, numbered; the time goes on",
    )


def _ranges_and_flags() -> Iterator[Case]:
    half = A.rows // 2
    lines, rows = lines_of(["Time (s)", "Cp (pF)", "D", "Range"], [A.t, A.c, A.loss, ("100pF",) * half + ("1nF",) * half])
    yield Case(
        "autorange_once",
        KIND,
        content(lines),
        "may_refuse",
        truth(rows, **METER, dissipation=si(A.loss)),
        named=("Range",),
        ways_out=(
            (
                Reading(where={"Range": "100pF"}),
                truth(
                    rows[:half],
                    time=si(A.t[:half]),
                    capacitance=si(A.c[:half], "1e-12"),
                    dissipation=si(A.loss[:half]),
                ),
            ),
        ),
        why="the meter changed its range once: one record, but it must be said",
    )
    lines, rows = lines_of(["Time (s)", "Cp (pF)", "Channel"], [A.t, A.c, ("3",) * A.rows])
    yield Case("constant_channel", KIND, content(lines), "must_read", truth(rows, **METER), named=("Channel",))
    lines, rows = lines_of(
        ["Time (s)", "Extension (mm)", "Load (N)", "Segment", "Humidity (%)"],
        [A.t, A.d, A.f, ("1",) * 60 + ("2",) * 12 + ("3",) * 48, ("41",) * 120],
    )
    yield Case(
        "segments_of_one_record",
        KIND,
        content(lines),
        "must_read",
        truth(rows, **TESTER),
        named=("Segment", "Humidity"),
        free=frozenset({"cycle"}),
    )


def _blocks() -> Iterator[Case]:
    heads = ["Time (s)", "Extension (mm)", "Load (N)"]
    one, rows_1 = lines_of(heads, [A.t, A.d, A.f])
    two, rows_2 = lines_of(heads, [B.t, B.d, B.f])
    start = len(one) + 2
    truth_1 = truth(rows_1, **TESTER)
    truth_2 = truth([r + start for r in rows_2], time=si(B.t), displacement=si(B.d, "1e-3"), force=si(B.f))
    yield Case(
        "second_specimen_below",
        KIND,
        content([*one, "", "Specimen 2", *two]),
        "must_refuse",
        None,
        blame=("specimen", "specimens"),
        ways_out=((Reading(specimen=1), truth_1), (Reading(specimen=2), truth_2)),
        why="a second record below the first, under a title",
    )
    lines, rows = lines_of([*heads, "", *heads], [A.t, A.d, A.f, ("",) * 120, B.t, B.d, B.f])
    yield Case(
        "side_by_side_with_gap",
        KIND,
        content(lines),
        "must_refuse",
        None,
        blame=("specimen", "specimens"),
        ways_out=(
            (Reading(specimen=1), truth(rows, **TESTER)),
            (Reading(specimen=2), truth(rows, time=si(B.t), displacement=si(B.d, "1e-3"), force=si(B.f))),
        ),
    )
    minutes_a, minutes_b = (times(r.t, "0.01666666666666666667", 6) for r in (A, B))
    lines, rows = lines_of(
        ["Time (min)", "Load (N)", "Displacement (mm)", "", "", "", "", "", ""],
        [minutes_a, A.f, A.d, minutes_b, B.f, B.d, minutes_a, B.f, A.d],
    )
    yield Case(
        "samples_side_by_side_first_named",
        KIND,
        content(lines),
        "may_refuse",
        truth(rows, time=si(minutes_a, "60"), displacement=si(A.d, "1e-3"), force=si(A.f)),
        named=("column 4|columns 4",),
        blame=("column 4", "columns 4", "specimen", "specimens", "header"),
        ways_out=(
            (Reading(specimen=1), truth(rows, time=si(minutes_a, "60"), displacement=si(A.d, "1e-3"), force=si(A.f))),
            (Reading(specimen=2), truth(rows, time=si(minutes_b, "60"), displacement=si(B.d, "1e-3"), force=si(B.f))),
        ),
        why="three samples side by side, of which only the first has names",
    )
    half = 60
    first, rows_1 = lines_of(["time_s", "force_N", "disp_mm"], [A.t[:half], A.f[:half], A.d[:half]])
    for name, head, columns in (
        ("repeated_header_swaps_columns", ["time_s", "disp_mm", "force_N"], (A.t, A.d, A.f)),
        ("repeated_header_new_unit", ["time_s", "force_mN", "disp_mm"], (A.t, times(A.f, "1000", 0), A.d)),
    ):
        second, rows_2 = lines_of(head, [c[half:] for c in columns])
        yield Case(
            name,
            KIND,
            content([*first, *second]),
            "may_refuse",
            truth((*rows_1, *(r + len(first) for r in rows_2)), **TESTER),
            blame=(f"line {len(first) + 1}", "header"),
            why="the logger was started anew and writes another header",
        )


def _lines_among_readings() -> Iterator[Case]:
    heads = ["Time (s)", "Extension (mm)", "Load (N)"]
    lines, rows = lines_of(heads, [A.t, A.d, A.f])
    yield Case(
        "remark_within",
        KIND,
        content([*lines[:50], "### paused by operator, dust on the ball", *lines[50:]]),
        "may_refuse",
        truth([r + (r > 50) for r in rows], **TESTER),
        named=("line 51|lines 51 to 51|paused",),
        blame=("line 51",),
    )
    yield Case(
        "statistics_below",
        KIND,
        content([*lines, "Mean,0.7012,2.312", "SD,0.4011,2.201", "Max,1.4001,7.503"]),
        "may_refuse",
        truth(rows, **TESTER),
        named=("Mean|line 122|lines 122 to 124",),
        why="rows of statistics under the same columns",
    )
    yield Case(
        "results_table_below",
        KIND,
        content([*lines, "", "Results", "Maximum load,7.503,N", "Modulus,0.61,MPa"]),
        "must_read",
        truth(rows, **TESTER),
        named=("Results|Maximum load|lines 122 to 125|lines 123 to 125",),
    )
    yield Case(
        "maximum_row_in_unit_style",
        KIND,
        content([lines[0], "(s),(mm),(N)", "11.90,1.4001,7.503", *lines[1:]]),
        "may_refuse",
        truth([r + 2 for r in rows], **TESTER),
        blame=("line 3",),
        why="a row of maxima between units and readings: time falls after it",
        named=("line 3|lines 3 to 3",),
    )
    table = ["", "Frequency (Hz),Cp (pF)", "1000,97.4", "10000,97.1", "100000,96.2"]
    yield Case(
        "calibration_table_below",
        KIND,
        content([*lines, *table]),
        "may_refuse",
        truth(rows, **TESTER),
        named=("Frequency (Hz)|lines 122 to 126|lines 123 to 126",),
    )


def _instron_side_columns() -> Iterator[Case]:
    lines, rows = lines_of(
        ["Time", "Extension", "Load", "Compressive extension", "Compressive load", "Segment ID", "Total Cycle Count"],
        [A.t, minus(A.d), minus(A.f), A.d, A.f, ("22476",) * 120, ("0",) * 120],
        units=["(sec)", "(mm)", "(N)", "(mm)", "(N)", "", ""],
    )
    values = {"time": si(A.t), "displacement": si(minus(A.d), "1e-3"), "force": si(minus(A.f))}
    turned = truth(rows, **TESTER)
    yield Case(
        "extension_and_compressive_extension",
        KIND,
        content(lines, end="\r\n"),
        "may_refuse",
        truth(rows, **values),
        named=("Compressive extension", "Compressive load", "Segment ID"),
        free=frozenset({"cycle"}),
        ways_out=((Reading(columns={"force": "Compressive load", "displacement": "Compressive extension"}), turned),),
        why="both signs of the same readings side by side",
    )
    cs = tuple(f"{float(c) * (1 + float(loss) ** 2):.5f}" for c, loss in zip(A.c, A.loss, strict=True))
    lines, rows = lines_of(["Time (s)", "Cs (pF)", "Cp (pF)", "D", "Rs (ohm)"], [A.t, cs, A.c, A.loss, ("1200",) * 120])
    yield Case(
        "cs_before_cp",
        KIND,
        content(lines),
        "must_read",
        truth(rows, **METER, dissipation=si(A.loss)),
        named=("Cs (pF)", "Rs (ohm)"),
    )
    heads = ["Zeit (s)", "Weg (mm)", "Kraft (N)", "Bemerkung", "Nr."]
    lines, rows = lines_of(
        heads,
        [comma(A.t), comma(A.d), comma(A.f), ("",) * 119 + ("Ende",), tuple(str(i + 1) for i in range(120))],
        sep=";",
    )
    yield Case("remark_column_and_number", KIND, content(lines), "must_read", truth(rows, **TESTER), named=("Bemerkung", "Nr."))


CASES = (
    *_second_load_cells(),
    *_numbered_channels(),
    *_plain_name_beside_numbered(),
    *_headers_behind_marks(),
    *_long_formats(),
    *_ranges_and_flags(),
    *_blocks(),
    *_lines_among_readings(),
    *_instron_side_columns(),
)

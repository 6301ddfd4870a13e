"""Files whose cells stand under the wrong names: short rows, index columns, titles, numbers of channels, commas in commas."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Literal

from hostile_cases import Case, Truth, truth
from hostile_press import Texts, comma, content, lines_of, press, si, times

from calib.lab import AS_FOUND, Reading

KIND = "shifted"
SHORT = ("short|shorter|cells|fewer|incomplete",)
BENIGN = f"benign {KIND}"
May = Literal["must_read", "must_refuse", "may_refuse"]
P = press(120, seed=91)
Q = press(120, seed=92, depth=1.1, top=4.4)
HEADS = ("Time (s)", "Extension (mm)", "Load (N)")
PLAIN = ("time_s", "disp_mm", "force_N")


def _known(rows: Sequence[int], p: tuple[Texts, Texts, Texts] = (P.t, P.d, P.f), bad: Iterable[int] = ()) -> Truth:
    """Truth of a tester's table; rows in `bad`, from 0, hold no reading."""
    gone = set(bad)
    t, d, f = (tuple("" if i in gone else x for i, x in enumerate(c)) for c in p)
    return truth(rows, time=si(t), displacement=si(d, "1e-3"), force=si(f))


def _case(
    name: str,
    lines: Sequence[str],
    rows: Sequence[int],
    may: May,
    *,
    kind: str = KIND,
    known: Truth | None = None,
    bad: Iterable[int] = (),
    named: tuple[str, ...] = (),
    blame: tuple[str, ...] = (),
    ways: tuple[tuple[Reading, Truth], ...] = (),
    reading: Reading = AS_FOUND,
    told: tuple[str, ...] = (),
    suffix: str = ".csv",
    why: str = "",
    end: str = "\n",
) -> Case:
    bad = tuple(bad)
    return Case(
        name,
        kind,
        content(lines, end=end),
        may,
        known or (_known(rows, bad=bad) if rows else None),
        reading=reading,
        named=named,
        told=told,
        blame=blame,
        damaged=frozenset(rows[i] for i in bad),
        ways_out=ways,
        suffix=suffix,
        why=why,
    )


def _short_rows() -> Iterator[Case]:
    whole, rows = lines_of(PLAIN, [P.t, P.d, P.f])
    bad = range(20, 120, 17)
    for name, sep, dropped in (
        ("serial_lost_middle_cell", ",", 1),
        ("serial_lost_time", ",", 0),
        ("serial_lost_last_cell", ",", 2),
        ("serial_lost_middle_tab", "\t", 1),
        ("serial_lost_middle_blank", " ", 1),
        ("serial_lost_first_semicolon", ";", 0),
    ):
        lines, rows = lines_of(PLAIN, [P.t, P.d, P.f], sep=sep)
        for i in bad:
            cells = lines[rows[i] - 1].split(sep)
            del cells[dropped]
            lines[rows[i] - 1] = sep.join(cells)
        yield _case(
            name, lines, rows, "may_refuse", bad=bad, told=SHORT, why="which cell of a short row is missing cannot be told"
        )
    for name, sep, dropped in (("serial_lost_cell_before_spare", ",", 1), ("serial_lost_time_before_spare", "\t", 0)):
        lines, rows = lines_of((*PLAIN, "temp_C"), [P.t, P.d, P.f, ("23.1",) * 120], sep=sep)
        for i in bad:
            cells = lines[rows[i] - 1].split(sep)
            del cells[dropped]
            lines[rows[i] - 1] = sep.join(cells)
        yield _case(
            name,
            lines,
            rows,
            "may_refuse",
            bad=bad,
            told=SHORT,
            named=("temp_C",),
            why="filled from the left, the column that stays empty is one that is not used",
        )
    lines = list(whole)
    merged = lines[61] + lines[62]
    yield _case(
        "serial_lines_ran_together",
        [*lines[:61], merged, *lines[63:]],
        range(2, 121),
        "may_refuse",
        known=_known(range(2, 121), (_cut(P.t, 61), _cut(P.d, 61), _cut(P.f, 61)), bad=[60]),
        bad=[60],
    )
    text = [
        f"{float(t):8.2f}{float(d):10.4f}{'' if i % 10 == 7 else f'{float(f):10.3f}':>10}"
        for i, (t, d, f) in enumerate(zip(P.t, P.d, P.f, strict=True))
    ]
    swapped = [
        f"{float(t):8.2f}{'' if i % 10 == 7 else f'{float(d):10.4f}':>10}{float(f):10.3f}"
        for i, (t, d, f) in enumerate(zip(P.t, P.d, P.f, strict=True))
    ]
    head = f"{'time_s':>8}{'disp_mm':>10}{'force_N':>10}"
    empty = [i for i in range(120) if i % 10 == 7]
    yield _case("fixed_width_empty_last", [head, *text], range(2, 122), "may_refuse", bad=empty)
    yield _case(
        "fixed_width_empty_middle",
        [head, *swapped],
        range(2, 122),
        "may_refuse",
        bad=empty,
        why="runs of blanks as delimiter: the force moves under the displacement",
    )
    cells = [f"{d},{f},23.1" for d, f in zip(P.d, P.f, strict=True)]
    yield _case(
        "whole_column_not_logged",
        ["Time (s),Extension (mm),Load (N),Temperature (C)", *cells],
        (),
        "must_refuse",
        blame=("4", "header"),
        why="four names, three cells in every row: the time was not logged",
    )
    late = [line if i < 61 else line.replace(",", ",23.1,", 1) for i, line in enumerate(whole)]
    yield _case(
        "column_inserted_midway",
        late,
        range(2, 122),
        "may_refuse",
        bad=range(60, 120),
        why="a newer program logs the temperature as second cell",
    )
    yield _case(
        "starts_within_a_line",
        [whole[0], "0.0012,0.01", *whole[1:]],
        range(2, 123),
        "may_refuse",
        bad=[0],
        told=SHORT,
        known=_known(range(2, 123), (("", *P.t), ("", *P.d), ("", *P.f)), bad=[0]),
    )


def _cut(column: Texts, row: int) -> Texts:
    return (*column[:row], *column[row + 1 :])


def _index_columns() -> Iterator[Case]:
    number = tuple(str(i + 1) for i in range(120))
    indexed = [",".join(c) for c in zip(number, P.t, P.d, P.f, strict=True)]
    rows = range(2, 122)
    by_number = Reading(
        columns={"time": "2", "displacement": "3", "force": "4"}, units={"time": "s", "displacement": "mm", "force": "N"}
    )
    out = ((by_number, _known(rows)),)
    yield _case(
        "index_and_trailing_empty_name",
        ["Time (s),Extension (mm),Load (N),", *indexed],
        rows,
        "may_refuse",
        ways=out,
        named=("column 1|index|number|numbers|counts",),
        why="names are one to the left of their cells",
    )
    yield _case(
        "index_without_a_name",
        ["Time (s),Extension (mm),Load (N)", *indexed],
        rows,
        "may_refuse",
        named=("column 1|index|number|numbers|counts",),
        why="as R writes row names",
    )
    yield _case(
        "index_quoted_as_r_writes",
        ['"Time (s)","Extension (mm)","Load (N)"', *(f'"{x[: x.index(",")]}"{x[x.index(",") :]}' for x in indexed)],
        rows,
        "may_refuse",
        named=("column 1|index|number|numbers|counts",),
    )
    yield _case(
        "index_from_zero_tab",
        [
            "Time (s)\tExtension (mm)\tLoad (N)\t",
            *("\t".join((str(i), *c)) for i, c in enumerate(zip(P.t, P.d, P.f, strict=True))),
        ],
        rows,
        "may_refuse",
        named=("column 1|index|number|numbers|counts",),
    )
    yield _case(
        "pandas_index", [",Time (s),Extension (mm),Load (N)", *indexed], rows, "must_read", kind=BENIGN, named=("column 1",)
    )
    yield _case(
        "pandas_unnamed_index",
        ["Unnamed: 0,Time (s),Extension (mm),Load (N)", *indexed],
        rows,
        "must_read",
        kind=BENIGN,
        named=("Unnamed: 0",),
    )
    yield _case(
        "number_column", ["No.,Time (s),Extension (mm),Load (N)", *indexed], rows, "must_read", kind=BENIGN, named=("No.",)
    )
    plain = [",".join(c) for c in zip(P.t, P.d, P.f, strict=True)]
    yield _case(
        "trailing_separators_in_rows",
        ["Time (s),Extension (mm),Load (N)", *(x + "," for x in plain)],
        rows,
        "must_read",
        kind=BENIGN,
        why="pandas makes an index of the first cell",
    )
    yield _case(
        "many_trailing_separators",
        ["Time (s);Extension (mm);Load (N);;;;", *(x.replace(",", ";") + ";;;;" for x in plain)],
        rows,
        "must_read",
        kind=BENIGN,
    )
    yield _case(
        "leading_empty_name_only",
        [",Time (s),Extension (mm),Load (N)", *plain],
        rows,
        "may_refuse",
        why="four names, the first empty, above three cells",
    )
    yield _case("trailing_empty_name_only", ["Time (s),Extension (mm),Load (N),", *plain], rows, "must_read", kind=BENIGN)
    stamp = [f"2024-05-01,12:00:{float(t):05.2f},{d},{f}" for t, d, f in zip(P.t, P.d, P.f, strict=True)]
    yield _case("date_and_time_under_one_name", ["Timestamp,Extension (mm),Load (N)", *stamp], rows, "may_refuse")
    blank = [x.replace(",", " ") for x in stamp]
    yield _case("date_and_time_under_one_name_blank", ["Timestamp disp_mm force_N", *blank], rows, "may_refuse")


def _commas_in_commas() -> Iterator[Case]:
    rows = range(2, 122)
    heads = ",".join(HEADS)
    bare = [",".join(c) for c in zip(*(comma(x) for x in (P.t, P.d, P.f)), strict=True)]
    yield _case("decimal_comma_in_comma_file", [heads, *bare], rows, "may_refuse", why="six cells under three names")
    yield _case(
        "decimal_comma_padded_header", [heads + ",,,", *bare], rows, "may_refuse", why="and the header is padded to six"
    )
    yield _case(
        "decimal_comma_whole_seconds",
        [heads, *(f"{i},{d},{f}" for i, (d, f) in enumerate(zip(comma(P.d), comma(P.f), strict=True)))],
        rows,
        "may_refuse",
        known=_known(rows, (tuple(str(i) for i in range(120)), P.d, P.f)),
    )
    meter = [f"{t},{c}" for t, c in zip(comma(P.t), comma(P.c), strict=True)]
    known = truth(rows, time=si(P.t), capacitance=si(P.c, "1e-12"))
    yield _case(
        "decimal_comma_meter_padded",
        ["Time (s),Cp (pF),,", *meter],
        rows,
        "may_refuse",
        known=known,
        why="0,10,97,401 under Time, Cp, nothing, nothing",
    )
    yield _case(
        "decimal_comma_meter_four_names",
        ["Time (s),Cp (pF),D,Status", *meter],
        rows,
        "may_refuse",
        known=known,
        why="two readings fill four names",
    )
    yield _case(
        "decimal_comma_one_column",
        ["Time (s),Cp (pF),Remark", *(f"{i},{c}" for i, c in enumerate(comma(P.c)))],
        rows,
        "may_refuse",
        known=truth(rows, time=si([str(i) for i in range(120)]), capacitance=si(P.c, "1e-12")),
        why="97,401 fills Cp and Remark",
    )
    whole = tuple(x.replace(".", "") for x in times(P.d, "1000", 0))
    yield _case(
        "thousands_comma_unquoted",
        ["Time (s),Load (N),Extension (um)", *(f"{t},{f},{float(d):,.0f}" for t, f, d in zip(P.t, P.f, whole, strict=True))],
        rows,
        "may_refuse",
        known=truth(rows, time=si(P.t), force=si(P.f), displacement=si(whole, "1e-6")),
    )
    yield _case(
        "thousands_comma_unquoted_first",
        ["Extension (um),Load (N),Time (s)", *(f"{float(d):,.0f},{f},{t}" for t, f, d in zip(P.t, P.f, whole, strict=True))],
        rows,
        "may_refuse",
        known=truth(rows, time=si(P.t), force=si(P.f), displacement=si(whole, "1e-6")),
        why="1,012 um moves all that follows to the right",
    )
    yield _case(
        "units_behind_commas",
        ["Time, s,Extension, mm,Load, N", *(",".join(c) for c in zip(P.t, P.d, P.f, strict=True))],
        rows,
        "may_refuse",
        why="six names above three cells",
    )
    yield _case(
        "names_with_units_as_words",
        ["Time s Extension mm Load N", *(" ".join(c) for c in zip(P.t, P.d, P.f, strict=True))],
        rows,
        "may_refuse",
    )
    yield _case(
        "names_of_several_words_and_blanks",
        ["Load cell Crosshead displacement Test time", *(" ".join(c) for c in zip(P.f, P.d, P.t, strict=True))],
        rows,
        "may_refuse",
        reading=Reading(units={"time": "s", "displacement": "mm", "force": "N"}),
    )
    lines = [";".join(HEADS), *("\t".join(c) for c in zip(P.t, P.d, P.f, strict=True))]
    yield _case("header_semicolons_rows_tabs", lines, rows, "may_refuse")
    yield _case(
        "rows_as_one_quoted_text",
        [f'"{x}"' for x in lines_of(HEADS, [P.t, P.d, P.f])[0]],
        rows,
        "may_refuse",
        why="a spreadsheet quoted each line as one cell",
    )
    yield _case(
        "separator_line",
        ["sep=;", ";".join(HEADS), *(";".join(c) for c in zip(comma(P.t), comma(P.d), comma(P.f), strict=True))],
        range(3, 123),
        "must_read",
        kind=BENIGN,
    )


def _titles() -> Iterator[Case]:
    pairs = [f"{t},{f},{t},{d}" for t, d, f in zip(P.t, P.d, P.f, strict=True)]
    three = range(4, 124)
    asked = Reading(
        columns={"time": "1", "force": "2", "displacement": "4"}, units={"time": "s", "force": "N", "displacement": "mm"}
    )
    yield _case(
        "titles_above_x_y_x_y",
        ["Force,,Displacement,", "X,Y,X,Y", "s,N,s,mm", *pairs],
        three,
        "may_refuse",
        ways=((asked, _known(three)),),
    )
    yield _case(
        "titles_above_x_y_no_units",
        ["Force (N),,Displacement (mm),", "X,Y,X,Y", *pairs],
        range(3, 123),
        "may_refuse",
        ways=((asked, _known(range(3, 123))),),
        why="X of the force is a time",
    )
    other = [f"{d},{f},{t},{f}" for t, d, f in zip(P.t, P.d, P.f, strict=True)]
    yield _case(
        "titles_force_against_two_abscissae",
        ["Load vs extension,,Load vs time,", "X,Y,X,Y", "mm,N,s,N", *other],
        three,
        "may_refuse",
    )
    runs = [",".join(c) for c in zip(P.t, P.d, P.f, Q.t, Q.d, Q.f, strict=True)]
    both = ((Reading(specimen=1), _known(range(3, 123))), (Reading(specimen=2), _known(range(3, 123), (Q.t, Q.d, Q.f))))
    yield Case(
        "merged_titles_two_runs",
        KIND,
        content(["Run 1,,,Run 2,,", ",".join(HEADS * 2), *runs]),
        "must_refuse",
        None,
        blame=("specimen", "specimens"),
        ways_out=both,
        why="merged cells above two runs",
    )
    yield Case(
        "merged_titles_centred",
        KIND,
        content([",Run 1,,,Run 2,", ",".join(HEADS * 2), *runs]),
        "must_refuse",
        None,
        blame=("specimen", "specimens"),
        ways_out=both,
    )
    sensors = [",".join(c) for c in zip(P.t, P.c, Q.c, strict=True)]
    meter = [truth(range(3, 123), time=si(P.t), capacitance=si(c, "1e-12")) for c in (P.c, Q.c)]
    yield Case(
        "titles_sensor_a_sensor_b",
        KIND,
        content([",Sensor A,Sensor B", "Time (s),Cp (pF),Cp (pF)", *sensors]),
        "must_refuse",
        None,
        blame=("Cp (pF)",),
        ways_out=tuple((Reading(columns={"capacitance": n}), m) for n, m in zip("23", meter, strict=True)),
    )
    plain = [",".join(c) for c in zip(P.t, P.d, P.f, strict=True)]
    yield _case(
        "merged_title_of_groups",
        ["Machine,Machine,Load cell", ",".join(HEADS), *plain],
        range(3, 123),
        "must_read",
        kind=BENIGN,
        named=("line 1|lines 1 to 1|Machine",),
    )
    yield _case(
        "title_line_above",
        ["Silicone 00-30, sample 3, 2024-05-01", ",".join(HEADS), *plain],
        range(3, 123),
        "must_read",
        kind=BENIGN,
        named=("line 1|lines 1 to 1|Silicone 00-30",),
    )
    yield _case(
        "title_of_three_quantities",
        ["Force,Time,Displacement", ",".join(HEADS), *plain],
        range(3, 123),
        "may_refuse",
        why="a line of titles in another order than the names",
    )


def _rows_of_numbers_above() -> Iterator[Case]:
    plain = [",".join(c) for c in zip(P.t, P.d, P.f, strict=True)]
    heads = ",".join(HEADS)
    rows = range(3, 123)
    said = ("line 2|lines 2 to 2",)
    yield _case(
        "channel_numbers_below_names",
        [heads, "1,2,3", *plain],
        rows,
        "may_refuse",
        named=said,
        blame=("line 2",),
        why="1,2,3 are channels, not the first reading",
    )
    yield _case(
        "channel_numbers_from_zero",
        [heads, "0,1,2", *plain],
        rows,
        "may_refuse",
        named=said,
        blame=("line 2",),
        why="0,1,2 at time 0.00",
    )
    yield _case(
        "channel_numbers_below_units",
        ["Time,Extension,Load", "s,mm,N", "1,2,3", *plain],
        range(4, 124),
        "may_refuse",
        named=("line 3|lines 3 to 3",),
        blame=("line 3",),
    )
    yield _case(
        "channel_numbers_between",
        ["Time,Extension,Load", "1,2,3", "s,mm,N", *plain],
        range(4, 124),
        "may_refuse",
        named=said,
        blame=("line 2",),
    )
    yield _case(
        "channel_numbers_above_names", ["1,2,3", heads, *plain], rows, "must_read", kind=BENIGN, named=("line 1|lines 1 to 1",)
    )
    yield _case("channel_names_below_names", [heads, "CH1,CH2,CH3", *plain], rows, "may_refuse", named=said, blame=("line 2",))
    yield _case(
        "letters_of_a_spreadsheet", ["A,B,C", heads, *plain], rows, "must_read", kind=BENIGN, named=("line 1|lines 1 to 1",)
    )
    yield _case("types_below_names", [heads, "float,float,float", *plain], rows, "may_refuse", named=said, blame=("line 2",))
    meter = [f"{t};{c};{x}" for t, c, x in zip(P.t, P.c, P.loss, strict=True)]
    yield _case(
        "channel_numbers_of_a_meter",
        ["Time (s);Cp (pF);D", "1;2;3", *meter],
        rows,
        "may_refuse",
        named=said,
        blame=("line 2",),
        known=truth(rows, time=si(P.t), capacitance=si(P.c, "1e-12"), dissipation=si(P.loss)),
    )
    yield _case(
        "gains_below_names",
        [heads, "1,0.998,2.314", *plain],
        rows,
        "may_refuse",
        named=said,
        blame=("line 2",),
        why="calibration factors: time falls after them",
    )
    yield _case(
        "named_gains_below_names",
        ["Channel,Time (s),Extension (mm),Load (N)", "Gain,1,0.998,2.314", *(f"{i},{x}" for i, x in enumerate(plain))],
        rows,
        "may_refuse",
        named=said,
        blame=("line 2",),
    )
    flipped = [",".join(("Time (s)", *P.t)), ",".join(("Extension (mm)", *P.d)), ",".join(("Load (N)", *P.f))]
    yield Case(
        "transposed",
        KIND,
        content(flipped),
        "must_refuse",
        None,
        blame=("header", "column", "columns", "line 1"),
        why="quantities in rows",
    )
    keyed = [
        f"F:{f} D:{d} t:{t}" if i % 2 else f"t:{t} D:{d} F:{f}" for i, (t, d, f) in enumerate(zip(P.t, P.d, P.f, strict=True))
    ]
    yield Case(
        "keys_in_every_cell",
        KIND,
        content(keyed),
        "must_refuse",
        None,
        blame=("header", "line 1", "number"),
        why="the order of keys changes",
    )
    restarted = [heads, *plain[:60], heads, *(",".join(c) for c in zip(Q.t[:60], Q.d[:60], Q.f[:60], strict=True))]
    halves = [_known(range(a, a + 60), (x.t[:60], x.d[:60], x.f[:60])) for a, x in ((2, P), (63, Q))]
    yield Case(
        "logger_started_anew",
        KIND,
        content(restarted),
        "must_refuse",
        None,
        blame=("line 62", "specimens", "records"),
        ways_out=((Reading(specimen=1), halves[0]), (Reading(specimen=2), halves[1])),
        why="time begins again behind a second header",
    )
    lines = [heads, *plain]
    lines[70] = lines[70].replace(f",{P.d[69]},", ",,")
    yield Case(
        "an_empty_cell_in_its_place",
        BENIGN,
        content(lines),
        "must_read",
        truth(range(2, 122), time=si(P.t), displacement=si((*P.d[:69], "", *P.d[70:]), "1e-3"), force=si(P.f)),
        excused=frozenset([71]),
    )


CASES = (
    *_short_rows(),
    *_index_columns(),
    *_commas_in_commas(),
    *_titles(),
    *_rows_of_numbers_above(),
)

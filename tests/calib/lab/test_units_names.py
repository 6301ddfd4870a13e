"""What labs write for units, names, signs and numbers beyond the plain ones: read with a note, or refused with a way out."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file
from calib.lab.instruments.unit_cells import unit_cell
from calib.lab.instruments.units import asked_factor, lab_factor, usual_units
from calib.lab.instruments.vocabulary import understand, why_unread

N = 80
TIME = np.round(np.arange(N) * 0.1, 3)
DEPTH = np.round(np.sin(np.pi * np.arange(N) / (N - 1)), 4)
FORCE = np.round(2.0 * DEPTH + 2.0 * DEPTH**2, 4)
CAP = np.round(97.4 + 0.5 * FORCE, 4)
Array = npt.NDArray[np.floating[Any]]


def cells(values: Array, digits: int = 4) -> list[str]:
    return [f"{v:.{digits}f}" for v in values]


T, D, F, C = cells(TIME, 2), cells(DEPTH), cells(FORCE), cells(CAP)


def read(
    tmp_path: Path, header: str, *columns: Sequence[str], above: Sequence[str] = (), sep: str = ",", **said: Any
) -> LabTable:
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([*above, header, *map(sep.join, zip(*columns, strict=True))]) + "\n", encoding="utf-8")
    return read_lab_file(path, Reading(**said))


def refusal(tmp_path: Path, header: str, *columns: Sequence[str], **more: Any) -> InputError:
    with pytest.raises(InputError) as caught:
        read(tmp_path, header, *columns, **more)
    assert all(fault.advice for fault in caught.value.faults)
    return caught.value


def option(text: str, name: str) -> Mapping[str, str]:
    """The first value that an advice or a note says for an option, as a shell would give it to the command."""
    match = re.search(rf"--{name} (\"[^\"]*\"|\S+)", text)
    assert match is not None, text
    key, _, value = shlex.split(match[1].rstrip(";,:"))[0].partition("=")
    return {key: value}


def reasons(table: LabTable) -> str:
    return "\n".join(map(str, table.unread))


# ------------------------------------------------------------------------------------------------------------------ units


@pytest.mark.parametrize(
    ("unit", "quantity", "factor"),
    [
        *(
            ("dyn", "force", 1e-5),
            ("dynes", "force", 1e-5),
            ("kip", "force", 4448.2216152605),
            ("pdl", "force", 0.138254954376),
        ),
        *(("cN", "force", 1e-2), ("daN", "force", 10.0), ("kp", "force", 9.80665), ("ozf", "force", 0.27801385095378)),
        *(("µin", "displacement", 2.54e-8), ("uin", "displacement", 2.54e-8), ("microinch", "displacement", 2.54e-8)),
        *(("Å", "displacement", 1e-10), ("\u212b", "displacement", 1e-10), ("in.", "displacement", 0.0254)),
        *(("Âµm", "displacement", 1e-6), ("Î¼m", "displacement", 1e-6), ("″", "displacement", 0.0254)),
        *(("MILLIMETERS", "displacement", 1e-3), ("ft", "displacement", 0.3048), ("mil", "displacement", 2.54e-5)),
        *(("uuF", "capacitance", 1e-12), ("µµF", "capacitance", 1e-12), ("aF", "capacitance", 1e-18)),
        *(("pf", "capacitance", 1e-12), ("ufd", "capacitance", 1e-6), ("nanofarads", "capacitance", 1e-9)),
        *(("µs", "time", 1e-6), ("ns", "time", 1e-9), ("usec", "time", 1e-6), ("HR", "time", 3600.0), ("SECONDS", "time", 1.0)),
    ],
)
def test_units_that_mean_one_thing_are_read(unit: str, quantity: str, factor: float) -> None:
    assert lab_factor(unit, quantity) == pytest.approx(factor, rel=1e-9)


@pytest.mark.parametrize(
    ("unit", "quantity", "meant"),
    [
        *(("MN", "force", "mN"), ("Mn", "force", "mN"), ("gr", "force", "gf"), ("p", "force", "gf")),
        *(("PF", "capacitance", "pF"), ("mmF", "capacitance", "pF"), ("MFD", "capacitance", "uF"), ("MF", "capacitance", "mF")),
        *(("?m", "displacement", "um"), ("\ufffdm", "displacement", "um"), ("NM", "displacement", "nm")),
    ],
)
def test_units_that_may_mean_several_things_are_refused_with_what_is_meant(unit: str, quantity: str, meant: str) -> None:
    with pytest.raises(ValueError, match=f"did you mean {meant}"):
        lab_factor(unit, quantity)


@pytest.mark.parametrize("unit", ["ticks", "lumps", "N/mm"])
def test_an_unknown_unit_is_refused_with_all_units_of_the_quantity(tmp_path: Path, unit: str) -> None:
    for said in ({}, {"units": {"force": unit}}):
        header = f"Time (s),Depth (mm),Force ({unit})" if not said and unit != "N/mm" else "Time (s),Depth (mm),Force"
        fault = refusal(tmp_path, header, T, D, F, **said).faults[0]
        assert f"one of {', '.join(usual_units('force'))}" in fault.advice
        assert '("1e-5 N")' in fault.advice
    assert asked_factor("1e-5 N", "force") == 1e-5


def test_the_unit_that_was_meant_is_advised_and_reads_the_file(tmp_path: Path) -> None:
    header = "Time (s),Depth (mm),Force_Mn,Cp (FF)"
    faults = refusal(tmp_path, header, T, D, F, C).faults
    said = {k: v for fault in faults for k, v in option(fault.advice, "units").items()}
    assert said == {"force": "mN", "capacitance": "fF"}
    table = read(tmp_path, header, T, D, F, C, units=said)
    np.testing.assert_allclose(table.columns["force"], FORCE * 1e-3)


@pytest.mark.parametrize("header", ["TIME (S),DISP (MM),FORCE (N),CAP (PF)", "TIME_S,DISP_MM,FORCE_N,CAP_PF"])
def test_units_in_a_header_of_capitals_are_read_in_their_usual_case_and_told(tmp_path: Path, header: str) -> None:
    table = read(tmp_path, header, T, D, F, C)
    np.testing.assert_allclose(table.columns["capacitance"], CAP * 1e-12)
    np.testing.assert_allclose(table.columns["displacement"], DEPTH * 1e-3)
    assert any('in a name of capitals "PF" is read as pF' in note for note in table.notes)


def test_units_in_capitals_below_names_in_capitals_are_read_so_too(tmp_path: Path) -> None:
    columns = [[unit, *column] for unit, column in zip(("SEC", "MM", "N", "PF"), (T, D, F, C), strict=True)]
    np.testing.assert_allclose(read(tmp_path, "TIME,DISP,FORCE,CAP", *columns).columns["capacitance"], CAP * 1e-12)


@pytest.mark.parametrize("name", ["C (PF)", "CP (PF)", "CP(PF)", "C_PF", "CP_PF"])
@pytest.mark.parametrize("others", ["TIME (S),DISP (MM),FORCE (N)", "Time (s),Depth (mm),Force (N)"])
def test_a_capacitance_by_its_symbol_is_in_picofarads_where_petafarads_are_written(
    tmp_path: Path, others: str, name: str
) -> None:
    table = read(tmp_path, f"{others},{name}", T, D, F, C)
    np.testing.assert_allclose(table.columns["capacitance"], CAP * 1e-12)
    assert any('"PF" is read as pF' in note for note in table.notes)


@pytest.mark.parametrize(
    ("name", "factor", "unit"),
    [
        *(("Cap/PF", 1e-12, "PF"), ("C in PF", 1e-12, "PF"), ("Kapazität / NF", 1e-9, "NF"), ("C_sensor [PF]", 1e-12, "PF")),
        *(("Cap, NF", 1e-9, "NF"), ("Kapazit\u00e4t_PF", 1e-12, "PF"), ("Cp (PF)", 1e-12, "PF")),
    ],
)
def test_a_capacitance_in_petafarads_is_in_picofarads_also_beside_a_name_in_small_letters(
    tmp_path: Path, name: str, factor: float, unit: str
) -> None:
    cells = C if unit == "PF" else [f"{float(c) / 1000:.9f}" for c in C]
    table = read(tmp_path, f'Time (s),Depth (mm),Force (N),"{name}"', T, D, F, cells)
    np.testing.assert_allclose(table.columns["capacitance"], CAP * 1e-12, rtol=1e-6)
    assert any(f'": "{unit}" is read as {unit[0].lower()}F' in note for note in table.notes)


def test_petafarads_below_a_name_or_in_a_column_of_units_are_picofarads(tmp_path: Path) -> None:
    below = [[unit, *column] for unit, column in zip(("s", "mm", "N", "PF"), (T, D, F, C), strict=True)]
    beside = read(tmp_path, "Time (s),Depth (mm),Force (N),Cap,Unit", T, D, F, C, ["PF"] * len(C))
    for table in (read(tmp_path, "Time,Depth,Force,Cap", *below), beside):
        np.testing.assert_allclose(table.columns["capacitance"], CAP * 1e-12)
        assert any('"PF" is read as pF' in note for note in table.notes)


@pytest.mark.parametrize("name", ["C (MF)", "CP (FF)", "Cap (MF)", "Cp (FF)"])
def test_other_units_in_capitals_behind_a_symbol_are_asked_for(tmp_path: Path, name: str) -> None:
    assert "did you mean" in refusal(tmp_path, f"Time (s),Depth (mm),Force (N),{name}", T, D, F, C).faults[0].message


@pytest.mark.parametrize("name", ["FORCE (MN)", "FORCE_MN"])
def test_meganewtons_and_millinewtons_are_not_told_apart_by_capitals(tmp_path: Path, name: str) -> None:
    fault = refusal(tmp_path, f"TIME (S),DISP (MM),{name}", T, D, F).faults[0]
    assert option(fault.advice, "units") == {"force": "mN"}


@pytest.mark.parametrize(
    "name",
    [
        "Weight (g)",
        "weight_g",
        "Gewicht (g)",
        "Mass [g]",
        "Poids (g)",
        "Net weight (g)",
        "balance/g",
        "Scale (g)",
        "Waage [g]",
        "scale reading (g)",
    ],
)
def test_what_a_balance_below_the_sample_shows_is_a_force(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time (s),Depth (mm),{name},Cp (pF)", T, D, cells(100 * FORCE), C)
    np.testing.assert_allclose(table.columns["force"], np.round(100 * FORCE, 4) * 9.80665e-3)
    assert any("grams-force" in note for note in table.notes)


@pytest.mark.parametrize("name", ["CH1 (g)", "Channel 1 (g)", "AI0 (mg)"])
def test_a_channel_in_g_is_a_load_where_it_goes_with_the_displacement_and_is_asked_for_else(tmp_path: Path, name: str) -> None:
    size = 9.80665e-6 if "mg" in name else 9.80665e-3
    head, noise = f"Time (s),Depth (mm),{name},Cp (pF)", 1.0 + 0.01 * np.random.default_rng(3).standard_normal(N)
    np.testing.assert_allclose(read(tmp_path, head, T, D, cells(FORCE), C).columns["force"], np.round(FORCE, 4) * size)
    (fault,) = refusal(tmp_path, head, T, D, cells(noise), C).faults
    assert "a load or an acceleration" in fault.message
    assert option(fault.advice, "columns") == {"force": name}
    assert "force" not in read(tmp_path, head, T, D, cells(noise), C, columns={"force": "none"}).columns


@pytest.mark.parametrize("name", ["Load (g)", "CH1 (gf)", "CH1 (N)", "CH1 (kg)"])
def test_a_column_that_can_be_nothing_but_a_load_is_not_asked_for(tmp_path: Path, name: str) -> None:
    noise = 1.0 + 0.01 * np.random.default_rng(3).standard_normal(N)
    assert "force" in read(tmp_path, f"Time (s),Depth (mm),{name},Cp (pF)", T, D, cells(noise), C).columns


@pytest.mark.parametrize(
    "column",
    [
        ("Weight (g)", ["12.5"] * N),
        ("Weight", F),
        ("Acceleration (g)", F),
        ("Scale", F),
        ("Scale (%)", F),
        ("Balance (V)", F),
        ("Scale (g)", ["12.5"] * N),
    ],
)
def test_the_mass_of_a_sample_and_other_weights_are_no_force(tmp_path: Path, column: tuple[str, Sequence[str]]) -> None:
    table = read(tmp_path, f"Time (s),Depth (mm),Cp (pF),{column[0]}", T, D, C, column[1])
    assert "force" not in table.columns
    assert column[0] in reasons(table)


@pytest.mark.parametrize("name", ["Kern PCB (g)", "Laborwaage 2 (g)", "Mettler out (kg)"])
def test_a_column_in_grams_that_moves_is_named_where_no_force_is_read(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time (s),Depth (mm),{name},Cp (pF)", T, D, cells(FORCE), C)
    assert "force" not in table.columns
    assert any("no force is read" in note and f'--columns "force={name}"' in note for note in table.notes)


@pytest.mark.parametrize("name", ["Acceleration (g)", "Vibration 2 (g)", "a (g)"])
def test_an_acceleration_is_not_named_as_a_force(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"Time (s),Depth (mm),{name},Cp (pF)", T, D, cells(FORCE), C)
    assert not any("no force is read" in note for note in table.notes)


# ------------------------------------------------------------------------------------------------------------------- time


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("millis", 1e-3),
        ("micros", 1e-6),
        ("ts_ms", 1e-3),
        ("ts_us", 1e-6),
        ("time_ms", 1e-3),
        ("t_us", 1e-6),
        ("time_ns", 1e-9),
    ],
)
def test_times_whose_name_carries_the_unit_are_read(tmp_path: Path, name: str, unit: float) -> None:
    counted = [f"{round(5 / unit + t / unit)}" for t in TIME]
    table = read(tmp_path, f"{name},depth_mm,force_N", counted, D, F)
    np.testing.assert_allclose(table.columns["time"], 5 + TIME, rtol=1e-12)


@pytest.mark.parametrize("name", ["timestamp", "epoch", "unix time", "Time"])
@pytest.mark.parametrize(("scale", "digits", "word"), [(1, 3, "seconds"), (1e3, 0, "milliseconds"), (1e6, 0, "microseconds")])
def test_times_since_1970_without_a_unit_are_read_and_told(
    tmp_path: Path, name: str, scale: float, digits: int, word: str
) -> None:
    counted = [f"{(1795183387 + t) * scale:.{digits}f}" for t in TIME]
    table = read(tmp_path, f"{name},Depth (mm),Force (N)", counted, D, F)
    np.testing.assert_allclose(table.columns["time"] - 1795183387, TIME, atol=1e-6)
    assert any(f"taken as {word} since 1970" in note for note in table.notes)


@pytest.mark.parametrize("first", [0, 123456, 1795183387])
def test_any_other_timestamp_without_a_unit_stays_refused(tmp_path: Path, first: int) -> None:
    # The last counts milliseconds since the logger was switched on, three weeks ago: seconds would be minutes apart.
    counted = [f"{first + 1000 * t:.0f}" for t in TIME]
    fault = refusal(tmp_path, "timestamp,Depth (mm),Force (N)", counted, D, F).faults[0]
    assert "has no unit" in fault.message
    table = read(tmp_path, "timestamp,Depth (mm),Force (N)", counted, D, F, units={"time": "ms"})
    np.testing.assert_allclose(table.columns["time"] - first * 1e-3, TIME, atol=1e-6)


COUNT = [str(k) for k in range(N)]


@pytest.mark.parametrize(
    "above",
    ["Sample rate: 10 Hz", "Sampling interval [ms];100", "Abtastrate 10 1/s", "Data interval 0.1 s", "# sampling rate,10,S/s"],
)
def test_a_count_beside_a_stated_rate_is_told_with_the_options_that_make_a_time_of_them(tmp_path: Path, above: str) -> None:
    header = "Sample,Depth (mm),Force (N)"
    note = next(n for n in read(tmp_path, header, COUNT, D, F, above=[above]).notes if n.startswith("no time is read"))
    said, units = option(note, "columns"), option(note, "units")
    table = read(tmp_path, header, COUNT, D, F, above=[above], columns=said, units=units)
    np.testing.assert_allclose(table.columns["time"], TIME, atol=1e-9)


def test_a_column_that_rises_as_a_time_does_is_told_where_no_time_is_read(tmp_path: Path) -> None:
    header = "Chrono,Depth (mm),Force (N)"
    note = next(n for n in read(tmp_path, header, T, D, F).notes if n.startswith("no time is read"))
    table = read(tmp_path, header, T, D, F, columns=option(note, "columns"), units=option(note, "units"))
    np.testing.assert_allclose(table.columns["time"], TIME)
    assert not [n for n in read(tmp_path, header, T, D, F, columns={"time": "none"}).notes if n.startswith("no time")]
    (note,) = (n for n in read(tmp_path, "Sample,Depth (mm),Force (N)", COUNT, D, F).notes if n.startswith("no time"))
    assert "counts the rows" in note


def test_the_unit_of_counts_that_rise_is_asked_for_and_not_taken_for_granted(tmp_path: Path) -> None:
    ticks = [str(50 * k) for k in range(N)]
    note = next(n for n in read(tmp_path, "Ticks,Depth (mm),Force (N)", ticks, D, F).notes if n.startswith("no time is read"))
    assert "--columns time=Ticks --units time=..., s or what one count lasts" in note
    assert "time=s" not in note


def test_a_column_that_rises_but_falls_back_once_is_told_with_the_line(tmp_path: Path) -> None:
    back = [f"{float(t) - (float(T[N - 9]) if k >= N - 9 else 0):.3f}" for k, t in enumerate(T)]
    note = next(n for n in read(tmp_path, "Chrono,Depth (mm),Force (N)", back, D, F).notes if n.startswith("no time is read"))
    assert f'but falls from "{back[N - 10]}" to "{back[N - 9]}" in line {N - 7}' in note
    assert "two files" in note


# ------------------------------------------------------------------------------------------------------------ which column


SPREAD = [f"{0.001 * (k % 6):.3f}" for k in range(N)]


@pytest.mark.parametrize(
    "header",
    [
        "time (s),depth mean (mm),depth std (mm),force mean (N),force std (N)",
        "time_s,depth_avg_mm,depth_sd_mm,force_avg_N,force_sd_N",
        "Zeit [s],Weg Mittelwert [mm],Weg Standardabweichung [mm],Kraft Mittelwert [N],Kraft Standardabweichung [N]",
    ],
)
def test_means_of_each_row_are_the_record_where_nothing_else_is(tmp_path: Path, header: str) -> None:
    table = read(tmp_path, header, T, D, SPREAD, F, SPREAD)
    np.testing.assert_allclose(table.columns["force"], FORCE)
    np.testing.assert_allclose(table.columns["displacement"], DEPTH * 1e-3)
    assert sum("a mean of readings in each row" in note for note in table.notes) == 2
    assert reasons(table).count("is a statistic, no record") == 2


@pytest.mark.parametrize("word", ["max", "peak hold", "setpoint", "min", "range"])
def test_other_statistics_and_set_points_are_no_record_even_alone(tmp_path: Path, word: str) -> None:
    error = refusal(tmp_path, f"time (s),depth {word} (mm),force {word} (N)", T, D, F)
    assert "no record" in str(error) or "commanded" in str(error) or "no header" in str(error)


def test_a_mean_beside_the_largest_alone_or_a_time_alone_is_no_record(tmp_path: Path) -> None:
    extremes = "Time (s),Depth mean (mm),Force mean (N),Force max (N)"
    assert "no force column" in str(refusal(tmp_path, extremes, T, D, F, cells(FORCE + 1)))
    assert "no capacitance column" in str(refusal(tmp_path, "Time (s),Cp (average) (pF)", T, C))


@pytest.mark.parametrize(
    ("target", "measured"),
    [
        ("target_mm", "measured_mm"),
        ("command (mm)", "actual (mm)"),
        ("Soll [mm]", "Ist [mm]"),
        ("setpoint (mm)", "feedback (mm)"),
    ],
)
def test_what_was_measured_beside_what_was_commanded_is_the_quantity_of_their_unit(
    tmp_path: Path, target: str, measured: str
) -> None:
    table = read(tmp_path, f"time_s,{target},{measured},force_N", T, cells(DEPTH * 1.1), D, F)
    np.testing.assert_allclose(table.columns["displacement"], DEPTH * 1e-3)
    assert any("was measured where another was set" in note for note in table.notes)
    assert "was commanded" in reasons(table)
    # Without a commanded one beside it only its unit says so; with a displacement of its own nothing does.
    alone = read(tmp_path, f"time_s,{measured},force_N", T, D, F)
    assert any(f'displacement is taken from "{measured}", the only column in mm' in note for note in alone.notes)
    plain = read(
        tmp_path, f"time_s,{target},{measured},force_N,Extension (mm)", T, cells(DEPTH * 1.1), cells(DEPTH * 1.2), F, D
    )
    assert plain.sources["displacement"] == "Extension (mm)"


@pytest.mark.parametrize("name", ["LVDT (mm)", "laser [mm]", "encoder_mm", "Extensometer (mm)", "COD (mm)", "Messuhr (mm)"])
def test_displacement_sensors_are_known_by_the_instrument(tmp_path: Path, name: str) -> None:
    np.testing.assert_allclose(read(tmp_path, f"Time (s),{name},Force (N)", T, D, F).columns["displacement"], DEPTH * 1e-3)
    fault = refusal(tmp_path, f"Time (s),Crosshead (mm),{name},Force (N)", T, D, cells(0.93 * DEPTH), F).faults[0]
    assert "differ by up to 7" in fault.message
    for choice in ("Crosshead (mm)", name):
        assert f"displacement={choice}" in fault.advice
    table = read(tmp_path, f"Time (s),Crosshead (mm),{name},Force (N)", T, D, cells(DEPTH - 0.5), F)
    assert table.sources["displacement"] == "Crosshead (mm)"
    assert any("differs by its zero" in note for note in table.notes)


def test_a_sensor_without_a_unit_of_length_is_no_displacement() -> None:
    assert [understand(name) for name in ("Encoder", "Encoder (counts)", "Laser (V)", "LVDT [mV]")] == [None] * 4


@pytest.mark.parametrize(("noise", "share"), [(1e-4, ""), (0.03, "but for their zero and sign")])
def test_an_absolute_position_is_the_travel_up_to_its_zero_and_sign(tmp_path: Path, noise: float, share: str) -> None:
    absolute = cells(123.4 - DEPTH * (1 + noise))
    columns = (T, D, F, absolute)
    header = "Prüfzeit (s),Standardweg (mm),Standardkraft (N),Traversenweg absolut (mm)"
    if not share:
        table = read(tmp_path, header, *columns)
        np.testing.assert_allclose(table.columns["displacement"], DEPTH * 1e-3)
        assert any("differs by its sign" in note for note in table.notes)
        return
    message = refusal(tmp_path, header, *columns).faults[0].message
    assert share in message
    assert "999" not in message


@pytest.mark.parametrize("names", [("Load cell 5 kN (N)", "Load cell 10 N (N)"), ("load_cell_5kN_N", "load_cell_10N_N")])
def test_the_reach_of_a_cell_is_no_second_unit_and_two_cells_are_a_choice(tmp_path: Path, names: tuple[str, str]) -> None:
    assert all((h := understand(name)) is not None and h.quantity == "force" and not h.unit_doubt for name in names)
    noise = cells(0.3 * np.sin(17.0 * np.arange(N)))
    header = f"Time (s),Depth (mm),{names[0]},{names[1]}"
    fault = refusal(tmp_path, header, T, D, noise, F).faults[0]
    assert "2 columns may be the force" in fault.message
    np.testing.assert_allclose(read(tmp_path, header, T, D, noise, F, columns={"force": names[1]}).columns["force"], FORCE)
    np.testing.assert_allclose(read(tmp_path, header, T, D, F, F).columns["force"], FORCE)
    single = read(tmp_path, f"Time (s),Depth (mm),{names[0]}", T, D, F)
    np.testing.assert_allclose(single.columns["force"], FORCE)


def test_a_number_and_a_unit_that_stand_alone_are_the_unit() -> None:
    heading = understand("Load 5 kN")
    assert heading is not None
    assert heading.unit == "kN"


# -------------------------------------------------------------------------------------------------------------------- sign


SIGNED = np.round(FORCE - 0.8, 4)


@pytest.mark.parametrize(
    ("name", "push", "pull"),
    [
        ("Direction", "C", "T"),
        ("Sign", "+", "-"),
        ("Mode", "Push", "Pull"),
        ("Richtung", "Druck", "Zug"),
        ("State", "comp", "tens"),
        ("Type", "Compression", "Tension"),
    ],
)
def test_the_sign_of_a_load_that_stands_in_another_column_is_applied_and_told(
    tmp_path: Path, name: str, push: str, pull: str
) -> None:
    said = [push if f >= 0 else pull for f in SIGNED]
    header = f"Time (s),Depth (mm),Load (N),{name}"
    table = read(tmp_path, header, T, D, cells(np.abs(SIGNED)), said)
    np.testing.assert_allclose(table.columns["force"], SIGNED)
    assert any("whose sign" in str(u) for u in table.unread)
    assert any("tension is read as negative" in note for note in table.notes)
    signed = read(tmp_path, header, T, D, cells(SIGNED), said)
    np.testing.assert_allclose(signed.columns["force"], SIGNED)


@pytest.mark.parametrize(("name", "one", "other"), [("Direction", "Up", "Down"), ("Operator", "C", "T"), ("Grade", "+", "-")])
def test_words_of_other_things_change_no_sign(tmp_path: Path, name: str, one: str, other: str) -> None:
    said = [one if f >= 0 else other for f in SIGNED]
    table = read(tmp_path, f"Time (s),Depth (mm),Load (N),{name}", T, D, cells(np.abs(SIGNED)), said)
    np.testing.assert_allclose(table.columns["force"], np.abs(SIGNED))


def test_a_force_whose_decimal_marks_became_marks_of_thousands_is_refused_with_what_reads_it(tmp_path: Path) -> None:
    header = "Zeit [s];Weg [mm];Kraft [N]"
    comma = [[f"{c}".replace(".", ",") for c in column] for column in (T, D)]
    for apart in ".'":
        mangled = [f"{round(1e4 * f):,}".replace(",", apart) for f in FORCE]
        fault = refusal(tmp_path, header, *comma, mangled, sep=";").faults[0]
        assert "marks may be taken for marks of thousands" in fault.message
        assert option(fault.advice, "units") == {"force": "N"}
        for unit, factor in (("N", 1e4), ("1e-4 N", 1.0)):
            table = read(tmp_path, header, *comma, mangled, sep=";", units={"force": unit})
            np.testing.assert_allclose(table.columns["force"], np.round(1e4 * FORCE) / 1e4 * factor, atol=1e-12)
    small = [f"{round(1e4 * f):,}".replace(",", ".") for f in FORCE]
    table = read(tmp_path, header.replace("[N]", "[mN]"), *comma, small, sep=";")
    np.testing.assert_allclose(table.columns["force"], np.round(1e4 * FORCE) * 1e-3, atol=1e-12)


def test_words_that_change_at_the_largest_load_are_the_way_of_the_machine_and_asked_for(tmp_path: Path) -> None:
    said = ["Compression" if k < 40 else "Tension" for k in range(N)]
    header, force = "Time (s),Depth (mm),Load (N),Direction", cells(np.abs(FORCE))
    fault = refusal(tmp_path, header, T, D, force, said).faults[0]
    assert "far from zero" in fault.message
    table = read(tmp_path, header, T, D, force, said, columns=option(fault.advice, "columns"))
    np.testing.assert_allclose(table.columns["force"], np.abs(FORCE))
    assert any("no sign is taken from it" in note for note in table.notes)


# ----------------------------------------------------------------------------------------------------------------- numbers


def test_a_force_all_of_whose_marks_are_lost_is_refused_with_the_factor_that_reads_it(tmp_path: Path) -> None:
    lost = [f"{round(1e4 * f)}" for f in FORCE]
    fault = refusal(tmp_path, "Zeit [s];Weg [mm];Kraft [N]", T, D, lost, sep=";").faults[0]
    assert "decimal marks may be lost" in fault.message
    whole = {"force": "N"}
    assert option(fault.advice, "units") == whole
    assert fault.advice.endswith('--units "force=1e-... N"')  # the file does not tell how many
    table = read(tmp_path, "Zeit [s];Weg [mm];Kraft [N]", T, D, lost, sep=";", units={"force": "1e-4 N"})
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-12)
    table = read(tmp_path, "Zeit [s];Weg [mm];Kraft [N]", T, D, lost, sep=";", units=whole)
    np.testing.assert_allclose(table.columns["force"], np.round(1e4 * FORCE))


@pytest.mark.parametrize(("unit", "most"), [("mN", 3000), ("N", 300)])
def test_whole_numbers_of_a_usual_force_are_read(tmp_path: Path, unit: str, most: float) -> None:
    whole = [f"{round(most * f / 3)}" for f in FORCE]
    assert "force" in read(tmp_path, f"Time (s),Depth (mm),Force ({unit})", T, D, whole).columns


def test_numbers_in_brackets_are_below_zero(tmp_path: Path) -> None:
    written = [f"({-f:.4f})" if f < 0 else f"{f:.4f}" for f in SIGNED]
    table = read(tmp_path, "Time (s),Depth (mm),Force (N)", T, D, written)
    np.testing.assert_allclose(table.columns["force"], SIGNED)
    assert any("and so are all such cells" in note for note in table.notes)
    mixed = [c.replace("(", "-").replace(")", "") if k == 3 else c for k, c in enumerate(written)]
    assert "is not a number" in str(refusal(tmp_path, "Time (s),Depth (mm),Force (N)", T, D, mixed))
    single = ["(0.5)" if k == 3 else c for k, c in enumerate(F)]
    assert "is not a number" in str(refusal(tmp_path, "Time (s),Depth (mm),Force (N)", T, D, single))


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("Cp", [f"{c:.4f}pF" for c in CAP]),
        ("Cp", [f"{c:.4f} pF" for c in CAP]),
        ("Cp (F)", [f"{c:.4f}p" for c in CAP]),
        ("Cp (F)", [f"{c:.4f}pF" for c in CAP]),
        ("Cp (pF)", [f"{c:.4f}pF" for c in CAP]),
        ("Cp", [f"{c:.4f}pF" if k % 2 else f"{c / 1e3:.7f}nF" for k, c in enumerate(CAP)]),
        ("Cp", ["OVER" if k == 7 else f"{c:.4f}pF" for k, c in enumerate(CAP)]),
    ],
)
def test_numbers_with_their_unit_behind_them_are_read_by_it_and_told(tmp_path: Path, name: str, written: Sequence[str]) -> None:
    table = read(tmp_path, f"Time (s),Depth (mm),Force (N),{name}", T, D, F, written)
    there = np.isfinite(table.columns["capacitance"])
    np.testing.assert_allclose(table.columns["capacitance"][there], (CAP * 1e-12)[there], rtol=1e-9)
    assert there.sum() == N - ("OVER" in written)
    assert any("in the unit that stands behind it" in note for note in table.notes)


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("Cp (pF)", [f"{c:.4f}nF" for c in CAP]),
        ("Cp", [f"{c:.4f}" + ("" if k % 2 else "pF") for k, c in enumerate(CAP)]),
        ("Cp (pF)", [f"{c:.4f}" + ("nF" if k == 4 else "") for k, c in enumerate(CAP)]),
    ],
)
def test_units_behind_numbers_that_contradict_or_are_missing_are_refused(
    tmp_path: Path, name: str, written: Sequence[str]
) -> None:
    said = str(refusal(tmp_path, f"Time (s),Depth (mm),Force (N),{name}", T, D, F, written))
    assert "is not a number" in said or "not in pF as its name says" in said


@pytest.mark.parametrize("row", [0, 4, N - 1])
def test_a_single_wrong_prefix_among_others_is_read_and_left_out_as_off_the_course(tmp_path: Path, row: int) -> None:
    written = [f"{c:.4f}" + ("n" if k == row else "p") for k, c in enumerate(CAP)]
    table = read(tmp_path, "Time (s),Depth (mm),Force (N),Cp (F)", T, D, F, written)
    assert table.reasons[row]
    assert not any(table.reasons[:row] + table.reasons[row + 1 :])


def test_a_prefix_alone_is_read_once_the_unit_is_said(tmp_path: Path) -> None:
    written = [f"{c:.4f}p" for c in CAP]
    for unit in ("F", "pF"):
        table = read(tmp_path, "Time (s),Depth (mm),Force (N),Cp", T, D, F, written, units={"capacitance": unit})
        np.testing.assert_allclose(table.columns["capacitance"], CAP * 1e-12)


def test_a_cycle_of_words_is_no_count(tmp_path: Path) -> None:
    phases = ["1-Compress" if k < 40 else "1-Hold" if k < 44 else "1-Recover" for k in range(N)]
    table = read(tmp_path, "Cycle,Time_S,Displacement_mm,Force_N", phases, T, D, F)
    assert 'column 1 "Cycle": holds words, no count of cycles' in reasons(table)
    np.testing.assert_allclose(table.columns["force"], FORCE)


# ------------------------------------------------------------------------------------------------ names of more instruments


@pytest.mark.parametrize(
    "header",
    [
        "Time (s),Elongation(mm),Force(N)",
        "t_s,stage_mm,loadcell_N",
        "t_s,stage_z_mm,loadcell_N",
        "Time (s),Stage (mm),Load cell (N)",
        "Time (s),LVDT (mm),LoadCell (N)",
        "Thời gian (s),Chuyển vị (mm),Lực (N)",
        "Thời gian (s),Độ dịch chuyển (mm),Tải trọng (N)",
        "Waktu (s),Perpindahan (mm),Gaya (N)",
        "Waktu (s),Perpindahan (mm),Beban (N)",
        "الزمن (s),الإزاحة (mm),القوة (N)",
        "Време (s),Преместване (mm),Сила (N)",
        "Temps (s),Desplaçament (mm),Força (N)",
        "Tid [s],Vandring [mm],Kraft [N]",
        "Čas [s],Posun [mm],Sila [N]",
        "Время [с],Ход траверсы [мм],Нагрузка [Н]",
        "Timp (s),Cursă (mm),Forţă (N)",
        "Vrijeme (s),Hod (mm),Opterećenje (N)",
        "समय (s),विस्थापन (mm),बल (N)",
        "时间(s),压缩量(mm),压力(N)",
        "時間(s),位移(mm),壓力(N)",
    ],
)
def test_a_press_is_understood_under_the_names_of_more_instruments_and_languages(tmp_path: Path, header: str) -> None:
    table = read(tmp_path, header, T, D, F)
    np.testing.assert_allclose(table.columns["time"], TIME)
    np.testing.assert_allclose(table.columns["displacement"], DEPTH * 1e-3)
    np.testing.assert_allclose(table.columns["force"], FORCE)


@pytest.mark.parametrize(
    "name", ["Điện dung", "Kapasitansi", "السعة", "Капацитет", "Capacitat", "Kapacitet", "धारिता", "lcr_Cp"]
)
def test_a_capacitance_is_understood_in_more_languages(tmp_path: Path, name: str) -> None:
    np.testing.assert_allclose(read(tmp_path, f"Time (s),{name}_pF", T, C).columns["capacitance"], CAP * 1e-12)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("压力(MPa)", "a stress or pressure: not used"),
        ("压力(kPa)", "a stress or pressure: not used"),
        ("压力", "not understood"),
        ("Stage", "not understood"),
        ("Stage 2", "not understood"),
        ("Current stage", "not understood"),
        ("Stage x (mm)", "axis x: not used"),
        ("loadcell (mV)", "a voltage: not used"),
        ("LoadCell", "not understood"),
        ("Elongation (%)", "a share or strain: not used"),
        ("Stage temperature (°C)", "a temperature: not used"),
        ("Force (N) Max.", '"max" is a statistic, no record'),
    ],
)
def test_names_of_instruments_are_a_quantity_by_their_unit_alone(name: str, why: str) -> None:
    assert why_unread(name) == why


def test_averages_of_a_logger_are_the_record_with_a_note(tmp_path: Path) -> None:
    table = read(tmp_path, '"Time (s)","Load cell (N) Ave.","LVDT (mm) Ave."', T, F, D)
    np.testing.assert_allclose(table.columns["force"], FORCE)
    np.testing.assert_allclose(table.columns["displacement"], DEPTH * 1e-3)
    assert sum("a mean of readings in each row" in note for note in table.notes) == 2


@pytest.mark.parametrize("words", [("Min", "Max", "Avg"), ("minimum", "maximum", "mean"), ("min", "max", "Ave.")])
def test_an_average_between_the_least_and_the_largest_reading_is_the_record_with_a_note(
    tmp_path: Path, words: tuple[str, str, str]
) -> None:
    header = ",".join(["Time (s)", "Displacement (mm)", *(f"Force {word} (N)" for word in words)])
    table = read(tmp_path, header, T, D, cells(FORCE - 0.01), cells(FORCE + 0.01), F)
    np.testing.assert_allclose(table.columns["force"], FORCE)
    assert any("a mean of readings in each row" in note for note in table.notes)
    assert reasons(table).count("is a statistic, no record") == 2
    # A plain force comes before it.
    plain = read(tmp_path, header + ",Force (N)", T, D, cells(FORCE - 0.01), cells(FORCE + 0.01), F, cells(FORCE + 0.001))
    assert plain.sources["force"] == "Force (N)"


def test_an_average_beside_one_bound_of_its_quantity_is_no_record(tmp_path: Path) -> None:
    for header in ("Force Max (N),Force Avg (N)", "Force Min (N),Cp Max (pF),Force Avg (N)"):
        columns = [F] * header.count(",") + [F]
        assert "no force column" in str(refusal(tmp_path, f"Time (s),Displacement (mm),{header}", T, D, *columns))


@pytest.mark.parametrize(
    "above",
    [
        ["Force unit:,N", "Length unit:,mm", "Time unit:,s"],
        ["Length unit: mm", "Force unit: N", "Time unit: s"],
        ["Units: Time s, Length mm, Force N"],
    ],
)
def test_a_unit_of_length_declared_beside_that_of_force_is_the_displacements(tmp_path: Path, above: list[str]) -> None:
    table = read(tmp_path, "\n".join([*above, "Time,Displacement,Force"]), T, D, F)
    np.testing.assert_allclose(table.columns["displacement"], DEPTH * 1e-3)


@pytest.mark.parametrize(
    "above",
    [
        ["Force unit:,N", "Gauge length unit:,mm", "Time unit:,s"],
        ["Length unit:,mm"],
        ["Force unit:,N", "Length:,12 mm", "Time unit:,s"],
    ],
)
def test_a_length_of_something_else_declares_no_unit_of_the_displacement(tmp_path: Path, above: list[str]) -> None:
    error = refusal(tmp_path, "\n".join([*above, "Time (s),Displacement,Force (N)"]), T, D, F)
    assert 'column "Displacement" has no unit' in str(error)


@pytest.mark.parametrize(
    "name",
    [
        "Zeit  1 - Standardmessrate",
        "Time  1 - default sample rate",
        "Zeit 2 - schnelle Messrate",
        "Time - sampling rate",
        "Time 1 - fast rate",
    ],
)
def test_at_which_rate_a_time_was_sampled_leaves_it_a_time(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, f"{name},Kraft,Weg\ns,N,mm", T, F, D)
    assert table.sources["time"] == f"{name} (s)"
    np.testing.assert_allclose(table.columns["time"], TIME)


@pytest.mark.parametrize(
    ("name", "below", "why"),
    [
        ("Zeit 1 - Standardmessrate", "Hz", "a rate: not used"),
        ("Zeit 1 - Standardmessrate", "", "a rate: not used"),
        ("Standardmessrate", "s", "a rate: not used"),
        ("Sampling rate", "Hz", "a rate: not used"),
        ("Messrate", "Hz", "a rate: not used"),
        ("Saturated", "", "not understood"),
        ("Separated", "", "not understood"),
        ("Limit", "", '"limit" is a bound or a flag, not measured'),
        ("Force limit (N)", "", '"limit" is a bound or a flag, not measured'),
        ("Force setpoint (N)", "", '"setpoint" was commanded, not measured'),
    ],
)
def test_rates_flags_and_bounds_are_named_as_what_they_are(name: str, below: str, why: str) -> None:
    assert understand(name, below) is None
    assert why_unread(name, below) == why


@pytest.mark.parametrize(
    "name", ["Capacitance (F) x1E-12", "Cp (F) ×1e-12", "Cp [F] *10^-12", "Cp (F) 1E-12", "Capacitance x1E-12 (F)"]
)
def test_a_factor_behind_the_unit_of_a_name_is_asked_for_and_applied_as_said(tmp_path: Path, name: str) -> None:
    header = f"Time (s),Displacement (mm),Force (N),{name}"
    assert "in its name: the readings may have been multiplied by it" in str(refusal(tmp_path, header, T, D, F, C))
    table = read(tmp_path, header, T, D, F, C, units={"capacitance": "1e-12 F"})
    np.testing.assert_allclose(table.columns["capacitance"], CAP * 1e-12)
    assert "capacitance" not in read(tmp_path, header, T, D, F, C, columns={"capacitance": "none"}).columns


@pytest.mark.parametrize("name", ["Load (N) /10", "Load (N) x 10", "Load (N) 0.1"])
def test_a_plain_factor_behind_brackets_is_one(name: str) -> None:
    found = understand(name)
    assert found is not None
    assert "factor" in found.unit_doubt


@pytest.mark.parametrize("name", ["Load 2 (N)", "Load (N) 2", "Load cell 5 kN (N)", "Cp (pF) 1kHz", "Fz (N) [2]"])
def test_a_number_of_a_channel_a_reach_or_a_frequency_is_no_factor(name: str) -> None:
    found = understand(name)
    assert found is None or not found.unit_doubt


def test_a_unit_that_is_asked_for_as_the_file_has_it_is_no_other(tmp_path: Path) -> None:
    notes = read(tmp_path, "Time (0.1 s),Depth (mm),Force (N)", T, D, F, units={"time": "0.1 s"}).notes
    assert any("is read in 0.1 s as asked" in note for note in notes)
    assert not any("though the file says" in note for note in notes)
    notes = read(tmp_path, "Time (0.1 s),Depth (mm),Force (N)", T, D, F, units={"time": "s"}).notes
    assert any("is read in s as asked, though the file says 0.1 s" in note for note in notes)


# --------------------------------------------------------------------------- under what and with what a column was measured


@pytest.mark.parametrize(
    ("name", "quantity", "unit"),
    [
        ("Force (N) at 23 °C", "force", "N"),
        ("Force at 23 °C (N)", "force", "N"),
        ("Force (N, 23 °C)", "force", "N"),
        ("Force (N) (class 0.5)", "force", "N"),
        ("Force (N) (S/N 20331)", "force", "N"),
        ("LVDT [mm] (SN 4471)", "displacement", "mm"),
        ("Force (N) (±0.5 %)", "force", "N"),
        ("Force (N) (cal. 2025-03)", "force", "N"),
        ("Kraft (N) (kalibriert am 3.5.2024)", "force", "N"),
        ("Displacement (mm) (res. 0.1 µm)", "displacement", "mm"),
        ("Displacement (mm) at 1 mm/min", "displacement", "mm"),
        ("Displacement (mm) (1 mm/min)", "displacement", "mm"),
        ("Extension (mm) @ 0.5 mm/s", "displacement", "mm"),
        ("Displacement (mm) (range ±5 mm)", "displacement", "mm"),
        ("Force [N] (amplifier range 20 N)", "force", "N"),
        ("Cp (pF) at 23 °C", "capacitance", "pF"),
    ],
)
def test_under_what_and_with_what_a_column_was_measured_changes_nothing_of_it(name: str, quantity: str, unit: str) -> None:
    found = understand(name)
    assert found is not None
    assert (found.quantity, found.unit) == (quantity, unit)
    assert (found.unit_doubt, found.name_doubt, found.processed) == ("", "", False)


@pytest.mark.parametrize("name", ["Force (N) (10 Hz low pass)", "Force (N), 10 Hz filter", "Force (N) (filtered 10 Hz)"])
def test_a_filter_with_its_frequency_on_either_side_is_told(name: str) -> None:
    found = understand(name)
    assert found is not None
    assert found.processed


def test_the_number_of_one_of_several_alike_stands_behind_its_name() -> None:
    found = [understand(name) for name in ("Force No. 1 (N)", "Force Nr. 2 (N)")]
    assert [(f.quantity, f.index) for f in found if f is not None] == [("force", "1"), ("force", "2")]


@pytest.mark.parametrize(
    "name", ["Force (N) (cal. 2.5)", "Force (N) (x10)", "Force (N) (res. 0.1)", "Displacement (mm) (positive downwards)"]
)
def test_a_remark_that_may_change_the_readings_leaves_them_in_doubt(name: str) -> None:
    found = understand(name)
    assert found is not None
    assert found.unit_doubt or found.name_doubt


@pytest.mark.parametrize(
    "name", ["Force (N) at peak", "Displacement min (mm)", "Displacement (mm) (min)", "Max force (N) at 23 °C"]
)
def test_a_statistic_beside_a_condition_stays_one(name: str) -> None:
    assert understand(name) is None
    assert "is a statistic" in why_unread(name)


@pytest.mark.parametrize("cell", ["N (5 N Dose)", "N (23 °C)", "N (class 0.5)", "N (cal. 2025-03)", "mm (res. 1 µm)"])
def test_the_same_beside_the_unit_in_a_row_of_units_changes_nothing(cell: str) -> None:
    found = unit_cell(cell)
    assert found is not None
    assert found.unit == cell.split()[0]


@pytest.mark.parametrize(
    "name",
    [
        "Verlängerung (mm)",
        "Längenänderung (mm)",
        "压入深度/mm",
        "压痕深度 (mm)",
        "Indentation $\\delta$ (mm)",
        "Eindringtiefe δ (mm)",
    ],
)
def test_more_names_of_a_displacement_are_understood(name: str) -> None:
    found = understand(name)
    assert found is not None
    assert (found.quantity, found.unit, found.name_doubt) == ("displacement", "mm", "")


@pytest.mark.parametrize(
    "name", ["Capacitance $\\delta$ (pF)", "Force $\\delta$ (N)", "Indentation delta C (mm)", "Phase delta (mm)"]
)
def test_delta_behind_another_name_leaves_it_in_doubt(name: str) -> None:
    found = understand(name)
    assert found is None or found.name_doubt


def test_a_letter_in_a_unit_of_length_that_stands_alone_is_the_displacement_with_a_note(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    lines = (",".join(row) for row in zip(cells(TIME, 1), cells(DEPTH), cells(FORCE), strict=True))
    path.write_text("\n".join(["t in s,w in mm,F in N", *lines]) + "\n")
    table = read_lab_file(path)
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * DEPTH)
    assert any('"w in mm", the only column in mm' in note for note in table.notes)


@pytest.mark.parametrize("unit", ["×10⁻³ N", "(×10⁻³ N)", "10^-3 N", "*1E-3 N"])
def test_a_power_of_ten_times_a_unit_in_a_row_of_units_is_one(tmp_path: Path, unit: str) -> None:
    path = tmp_path / "press.csv"
    lines = (",".join(row) for row in zip(cells(TIME, 1), cells(DEPTH), cells(FORCE), strict=True))
    path.write_text("\n".join(["Time,Displacement,Force", f"s,mm,{unit}", *lines]) + "\n", encoding="utf-8")
    np.testing.assert_allclose(read_lab_file(path).columns["force"], 1e-3 * FORCE, atol=1e-12)


@pytest.mark.parametrize("cell", ["1e-3 N", "x10 N", "10^-3 foo", "x10"])
def test_a_reading_or_a_factor_of_another_form_is_no_unit(cell: str) -> None:
    found = unit_cell(cell)
    assert found is None or "N" not in found.unit

"""Names that hold a number, an instrument, a share or a reference beside a quantity are asked about, never guessed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 60
DEPTH = [round(0.0113 * min(k, 80 - k), 4) for k in range(N)]


def read(folder: Path, *names: str, above: str = "", reading: Reading | None = None) -> LabTable:
    """A press of 60 rows: time, displacement, force and capacitance under these names."""
    rows = [f"{0.1 * k:.1f};{x};{0.5 * x**1.5 + 1e-4 * (k * 7 % 5):.4f};{8 + x * x:.4f}" for k, x in enumerate(DEPTH)]
    path = folder / "press.csv"
    path.write_text("\n".join([*([above] if above else []), ";".join(names), *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


@pytest.mark.parametrize("name", ["Load cell 5 kN", "Kraft 1 kN", "Capteur de force 1 kN", "Load cell 10 kg", "Force 100 mN"])
def test_a_number_and_a_unit_behind_a_name_may_be_how_far_a_cell_reaches(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="may be how far the instrument reaches"):
        read(tmp_path, "Time (s)", "Weg (mm)", name, "C (pF)")
    table = read(tmp_path, "Time (s)", "Weg (mm)", name, "C (pF)", reading=Reading(units={"force": "N"}))
    np.testing.assert_allclose(table.columns["force"][40], 0.5 * DEPTH[40] ** 1.5, atol=1e-3)


@pytest.mark.parametrize(
    ("name", "place"),
    [("Laser 50 um", 1), ("Laser micrometer", 1), ("Depth micrometer", 1), ("Time 100 ms", 0), ("Cp 1 nF", 3)],
)
def test_so_may_be_those_behind_any_name_and_an_instrument_called_as_a_unit(tmp_path: Path, name: str, place: int) -> None:
    names = ["Time (s)", "Weg (mm)", "Force (N)", "C (pF)"]
    names[place] = name
    with pytest.raises(InputError, match=r"may be how far|may be an instrument"):
        read(tmp_path, *names)


@pytest.mark.parametrize("name", ["Force raw/2 (N)", "Compressive load/10 (N)", "Load primary/2 [N]", "force_raw/2_N"])
def test_a_factor_behind_any_name_is_asked_about(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="the factor"):
        read(tmp_path, "Time (s)", "Weg (mm)", name, "C (pF)")


@pytest.mark.parametrize("name", ["Seconds of hour", "seconds_of_the_minute", "Sekunden der Stunde", "ms of second"])
def test_the_whole_that_a_time_is_of_is_not_its_unit(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, name, "Weg (mm)", "Force (N)", "C (pF)")
    assert "time" not in table.columns
    assert any(name in str(of) for of in table.unread)


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("Cap above 90 (pF)", 3),
        ("Kapazität abzüglich 90 (pF)", 3),
        ("Cap increase (pF)", 3),
        ("Cap dummy sensor (pF)", 3),
        ("Depth hundredths mm", 1),
    ],
)
def test_words_of_more_less_or_another_are_no_record_by_their_unit_alone(tmp_path: Path, name: str, place: int) -> None:
    names = ["Time (s)", "Weg (mm)", "Force (N)", "C (pF)"]
    names[place] = name
    table = read(tmp_path, *names)
    assert ("capacitance" if place == 3 else "displacement") not in table.columns
    assert any(name in str(of) for of in table.unread)


@pytest.mark.parametrize(
    "above", ["REL mode ON, reference 90 pF", "NULL: ON (90.000 pF)", "Deviation measurement: dABS, Reference 90 pF"]
)
def test_a_meter_that_shows_how_far_it_is_from_a_reference_shows_no_capacitance(tmp_path: Path, above: str) -> None:
    with pytest.raises(InputError, match="how far it is from a reference"):
        read(tmp_path, "Time (s)", "Weg (mm)", "Force (N)", "Cap (pF)", above=above)


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("Force to go (N)", 2),
        ("Displacement last run (mm)", 1),
        ("Force of previous cycle (N)", 2),
        ("Remaining travel (mm)", 1),
        ("distance_to_go_mm", 1),
        ("Distance to target (mm)", 1),
        ("Restweg (mm)", 1),
        ("Verbleibender Weg (mm)", 1),
        ("Kraft letzter Versuch (N)", 2),
        ("Course restante (mm)", 1),
        ("Fuerza anterior (N)", 2),
        ("Old force (N)", 2),
        ("Cp prev (pF)", 3),
        ("Time to go (s)", 0),
        ("Force (last run) (N)", 2),
    ],
)
def test_what_is_left_or_of_another_run_is_no_record_of_this_one(tmp_path: Path, name: str, place: int) -> None:
    names = ["Time (s)", "Weg (mm)", "Force (N)", "C (pF)"]
    names[place] = name
    table = read(tmp_path, *names)
    assert ["time", "displacement", "force", "capacitance"][place] not in table.columns
    assert any("may be what is left, or of another run" in str(of) for of in table.unread)


@pytest.mark.parametrize(
    "names", [("Zeit (s)", "Weg (mm)", "Last (N)", "C (pF)"), ("Temps (s)", "Course (mm)", "Last/Load (N)", "C (pF)")]
)
def test_a_load_that_is_called_last_is_one(tmp_path: Path, names: tuple[str, ...]) -> None:
    assert read(tmp_path, *names).sources["force"] == names[2]


@pytest.mark.parametrize("words", ["Last Run ", "Last run: ", "Latest "])
def test_the_run_that_all_columns_are_of_is_passed_by(tmp_path: Path, words: str) -> None:
    table = read(tmp_path, *(f"{words}{name}" for name in ("Time (s)", "Displacement (mm)", "Force (N)", "Cp (pF)")))
    assert {"time", "displacement", "force", "capacitance"} <= set(table.columns)


def read_both(folder: Path, first: str, second: str, shift: float, reading: Reading | None = None) -> LabTable:
    """A press with two columns of a capacitance, the second of which is off by `shift` pF."""
    rows = [f"{0.1 * k:.1f};{x};{0.5 * x**1.5:.4f};{8 + x * x:.4f};{8 + shift + x * x:.4f}" for k, x in enumerate(DEPTH)]
    path = folder / "press.csv"
    path.write_text("\n".join([f"Time (s);Weg (mm);Force (N);{first};{second}", *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("Cp raw (pF)", "Cp open/short corr. (pF)"),
        ("Cp (pF)", "Cp open/short corr. (pF)"),
        ("C_meas (pF)", "C_corr (pF)"),
        ("Cp uncorrected (pF)", "Cp (pF)"),
        ("Cp unkorrigiert (pF)", "Cp korrigiert (pF)"),
        ("Cp brute (pF)", "Cp corrigée (pF)"),
        ("Cp roh (pF)", "Cp (pF)"),
    ],
)
def test_a_raw_capacitance_beside_a_corrected_one_is_a_choice_where_they_differ(
    tmp_path: Path, first: str, second: str
) -> None:
    with pytest.raises(InputError, match="2 columns may be the capacitance"):
        read_both(tmp_path, first, second, 0.3)
    table = read_both(tmp_path, first, second, 0.3, Reading(columns={"capacitance": second}))
    np.testing.assert_allclose(table.columns["capacitance"][0], 8.3e-12)
    alike = read_both(tmp_path, first, second, 0.0)
    np.testing.assert_allclose(alike.columns["capacitance"][0], 8e-12)
    assert any("agrees with it" in note for note in alike.notes)


@pytest.mark.parametrize(
    "name", ["Seconds of day", "seconds_of_hour", "Sekunden des Tages", "Secondes du jour", "sec since midnight"]
)
def test_the_unit_of_a_time_that_is_of_a_whole_is_the_first(tmp_path: Path, name: str) -> None:
    names = (name, "Weg (mm)", "Force (N)", "C (pF)")
    (note,) = [note for note in read(tmp_path, *names).notes if "no time is read" in note]
    assert f"--units time={name.split('_')[0].split(' ')[0].lower()}" in note
    for units in ({}, {"time": "s"}, {"time": note.rpartition("=")[2]}):
        table = read(tmp_path, *names, reading=Reading(columns={"time": name}, units=units))
        np.testing.assert_allclose(table.columns["time"], 0.1 * np.arange(N))


def test_a_time_of_day_in_numbers_is_asked_for_its_unit(tmp_path: Path) -> None:
    names = ("Time of day", "Weg (mm)", "Force (N)", "C (pF)")
    assert any('"time=Time of day" --units time=s' in note for note in read(tmp_path, *names).notes)
    with pytest.raises(InputError, match="has no unit"):
        read(tmp_path, *names, reading=Reading(columns={"time": "Time of day"}))


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("Kapazität bei 1 kHz (pF)", 3),
        ("Capacité à 1 kHz et 1 V (pF)", 3),
        ("Kapazität gemessen bei 1 kHz (pF)", 3),
        ("Pojemność przy 1 kHz (pF)", 3),
        ("Capacitance, parallel, 1 V (pF)", 3),
        ("Capacitance pF (range 1 nF)", 3),
        ("Cp (Bereich 1 nF) (pF)", 3),
        ("Sensor at 1 kHz, 1 V (pF)", 3),
        ("Kapazität (gemessen) [pF]", 3),
        ("C(t) (pF)", 3),
        ("F(t) [N]", 2),
        ("s(t) [mm]", 1),
        ("Force measured by the 10 N load cell (N)", 2),
        ("Kraft gemessen mit 10 N Kraftmessdose (N)", 2),
        ("Force (N) range 10 N", 2),
        ("Force (nominal 50 N) (N)", 2),
        ("Force nominal 50 N (N)", 2),
        ("Kraft (Nennlast 50 N) [N]", 2),
    ],
)
def test_settings_and_instruments_in_a_name_change_nothing(tmp_path: Path, name: str, place: int) -> None:
    names = ["Time (s)", "Weg (mm)", "Force (N)", "C (pF)"]
    names[place] = name
    table = read(tmp_path, *names)
    expected = [0.1 * np.arange(N), np.array(DEPTH) * 1e-3, 0.5 * np.array(DEPTH) ** 1.5, (8 + np.array(DEPTH) ** 2) * 1e-12]
    quantity = ["time", "displacement", "force", "capacitance"][place]
    np.testing.assert_allclose(table.columns[quantity], expected[place], rtol=1e-3, atol=1e-3 if quantity == "force" else 0)


@pytest.mark.parametrize("name", ["Cap two sensors parallel (pF)", "Nominal force (N)", "Capacitance, series, 1 V (pF)"])
def test_what_is_another_reading_by_its_name_is_still_none(tmp_path: Path, name: str) -> None:
    names = ["Time (s)", "Weg (mm)", "Force (N)", "C (pF)"]
    names[2 if "force" in name else 3] = name
    if "series" in name:
        with pytest.raises(InputError, match="is a series capacitance"):
            read(tmp_path, *names)
    else:
        assert any(name in str(of) for of in read(tmp_path, *names).unread)


@pytest.mark.parametrize(
    ("name", "place", "unit"),
    [
        ("Force (N) or (mN)", 2, "N"),
        ("Force in N or mN", 2, "N"),
        ("Force N|kgf", 2, "N"),
        ("Kraft (N) bzw. (kp)", 2, "N"),
        ("Fuerza (N) o (mN)", 2, "N"),
        ("Force (N) converted from (kgf)", 2, "N"),
        ("Force converted from kgf to N", 2, "N"),
        ("Force (N) accuracy (mN)", 2, "N"),
        ("Displacement (mm) instead of (um)", 1, "mm"),
        ("Travel mm / in", 1, "mm"),
        ("Displacement in mm or inch", 1, "mm"),
        ("Zeit (s) statt (min)", 0, "s"),
        ("Time (s) or (ms)", 0, "s"),
        ("Cp (pF) not (nF)", 3, "pF"),
    ],
)
def test_two_units_in_one_name_are_asked_about_whatever_stands_between(
    tmp_path: Path, name: str, place: int, unit: str
) -> None:
    names = ["Time (s)", "Weg (mm)", "Force (N)", "C (pF)"]
    names[place] = name
    quantity = ["time", "displacement", "force", "capacitance"][place]
    with pytest.raises(InputError, match=rf"two units, .*--units {quantity}="):
        read(tmp_path, *names)
    if place:
        with pytest.raises(InputError, match="two units"):
            read(tmp_path, *names, reading=Reading(columns={quantity: str(place + 1)}))
    table = read(tmp_path, *names, reading=Reading(units={quantity: unit}))
    plain = read(tmp_path, "Time (s)", "Weg (mm)", "Force (N)", "C (pF)")
    np.testing.assert_allclose(table.columns[quantity], plain.columns[quantity])


@pytest.mark.parametrize(
    ("name", "place"),
    [
        *(
            (name, 2)
            for name in ("Expected force (N)", "Ideal force (N)", "Kraft erwartet (N)", "Nennkraft (N)", "Rated load (N)")
        ),
        *((name, 2) for name in ("Force théorique (N)", "Fuerza calculada (N)", "Forza attesa (N)", "Siła obliczona (N)")),
        *((name, 2) for name in ("Verwachte kracht (N)", "理论力 (N)", "計算荷重 (N)", "Kraft alt (N)", "Force first run (N)")),
        *(
            (name, 1)
            for name in ("Stage backlash (mm)", "Displacement step (mm)", "Weg theoretisch (mm)", "Thermal displacement (mm)")
        ),
        *((name, 3) for name in ("Expected Cp (pF)", "Specific capacitance (pF)", "理论电容 (pF)")),
    ],
)
def test_what_was_not_measured_is_no_record_by_its_unit_alone(tmp_path: Path, name: str, place: int) -> None:
    names = ["Time (s)", "Weg (mm)", "Force (N)", "C (pF)"]
    names[place] = name
    table = read(tmp_path, *names)
    assert ["time", "displacement", "force", "capacitance"][place] not in table.columns
    assert any(name in str(of) for of in table.unread)


@pytest.mark.parametrize(
    ("name", "place"),
    [("Kugelkraft (N)", 2), ("Krag (N)", 2), ("Stepper displacement (mm)", 1), ("Lage (mm)", 1), ("Pad cap (pF)", 3)],
)
def test_other_words_are_still_a_record_by_their_unit_alone(tmp_path: Path, name: str, place: int) -> None:
    names = ["Time (s)", "Weg (mm)", "Force (N)", "C (pF)"]
    names[place] = name
    assert ["time", "displacement", "force", "capacitance"][place] in read(tmp_path, *names).columns


@pytest.mark.parametrize(
    "remark", ["FS=10", "range 10", "Messbereich 10", "cal 2026-01", "S/N 20331", "S/N 20331, cal 2026-01"]
)
def test_how_far_an_instrument_reaches_and_its_number_are_remarks(tmp_path: Path, remark: str) -> None:
    table = read(tmp_path, "Time (s)", "Weg (mm)", f"Force (N) [{remark}]", "C (pF)")
    np.testing.assert_allclose(table.columns["force"][40], 0.5 * DEPTH[40] ** 1.5, atol=1e-3)


def _with_commas(folder: Path, header: str, reading: Reading | None = None) -> LabTable:
    rows = [f"{0.1 * k:.1f},{x},{0.5 * x**1.5 + 1e-4 * (k * 7 % 5):.4f},{8 + x * x:.4f}" for k, x in enumerate(DEPTH)]
    path = folder / "press.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


@pytest.mark.parametrize(
    "header",
    [
        "Time (s),Weg (mm),Load (N) [S/N 20331, cal 2026-01],C (pF)",
        "Time (s),Weg (mm),Load (N),Cp (pF) @ 1 kHz, 1 V",
        "Time (s),Weg (mm),Load (N),Cp (pF) [1 kHz, 1 V]",
    ],
)
def test_names_that_commas_cut_in_two_are_put_together(tmp_path: Path, header: str) -> None:
    table = _with_commas(tmp_path, header)
    np.testing.assert_allclose(table.columns["force"][40], 0.5 * DEPTH[40] ** 1.5, atol=1e-3)
    np.testing.assert_allclose(table.columns["capacitance"][40], (8 + DEPTH[40] ** 2) * 1e-12, rtol=1e-4)


def test_a_name_too_many_leads_to_options_for_all_columns_that_work_as_typed(tmp_path: Path) -> None:
    header = "Time (s),Weg (mm),Force in N, not kgf,C (pF)"
    with pytest.raises(InputError, match="names 5 columns") as caught:
        _with_commas(tmp_path, header)
    typed = caught.value.faults[0].advice.split("its unit: ")[1].split(" --")
    said = [part.removeprefix("--").split(" ") for part in typed]
    columns, units = (dict(of.split("=") for kind, of in said if kind == which) for which in ("columns", "units"))
    assert columns == {"time": "1", "displacement": "2", "force": "3", "capacitance": "4"}
    table = _with_commas(tmp_path, header, Reading(columns=columns, units=units))
    np.testing.assert_allclose(table.columns["force"][40], 0.5 * DEPTH[40] ** 1.5, atol=1e-3)


@pytest.mark.parametrize("gap", ["", ","])
def test_specimens_side_by_side_may_have_units_of_their_own(tmp_path: Path, gap: str) -> None:
    path = tmp_path / "press.csv"
    rows = [f"{k / 10},{x},{0.5 * x**1.5:.4f},{gap}{k / 5},{x},{0.2 * x**1.5:.4f}" for k, x in enumerate(DEPTH)]
    path.write_text(
        "\n".join([f"Time (s),Weg (mm),Force (N),{gap}Time (s),Weg (mm),Force (kgf)", *rows]) + "\n", encoding="utf-8"
    )
    with pytest.raises(InputError, match="2 specimens stand side by side"):
        read_lab_file(path, Reading())
    for specimen, largest in ((1, 0.5), (2, 0.2 * 9.80665)):
        table = read_lab_file(path, Reading(specimen=specimen))
        np.testing.assert_allclose(table.columns["force"][40], largest * DEPTH[40] ** 1.5, atol=1e-2)


def test_specimens_side_by_side_that_differ_by_more_than_units_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    rows = [f"{0.1 * k:.1f},{x},{0.5 * x**1.5:.4f},{0.2 * k:.1f},{x},{0.2 * x**1.5:.4f}" for k, x in enumerate(DEPTH)]
    path.write_text(
        "\n".join(["Time (s),Weg (mm),Force (top) (N),Time (s),Weg (mm),Force (bottom) (N)", *rows]) + "\n", encoding="utf-8"
    )
    with pytest.raises(InputError, match="their columns differ"):
        read_lab_file(path, Reading(specimen=1))


@pytest.mark.parametrize("name", ["Force calculée (N)", "Verwachte kracht (N)", "理论力 (N)", "Expected force (N)"])
def test_what_may_not_be_measured_is_named_with_what_to_type_if_it_was(tmp_path: Path, name: str) -> None:
    names = ("Time (s)", "Weg (mm)", name, "C (pF)")
    assert any(f'--columns "force={name}"' in note for note in read(tmp_path, *names).notes)
    table = read(tmp_path, *names, reading=Reading(columns={"force": name}))
    np.testing.assert_allclose(table.columns["force"][40], 0.5 * DEPTH[40] ** 1.5, atol=1e-3)


@pytest.mark.parametrize(
    "name",
    [
        "Frame deflection (mm)",
        "Machine deflection (mm)",
        "deflection of the frame (mm)",
        "Machine compliance deflection (mm)",
        "load_cell_deflection_mm",
        "Rahmendurchbiegung (mm)",
        "Verformung der Maschine [mm]",
    ],
)
def test_how_far_the_machine_gives_way_is_no_displacement_unless_it_is_said(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, "Time (s)", name, "Force (N)", "C (pF)")
    assert "displacement" not in table.columns
    assert any("how far the machine itself gives way" in str(of) for of in table.unread)
    said = Reading(columns={"displacement": "2"}, units={"displacement": "mm"})
    beside = read(tmp_path, "Time (s)", name, "Force (N)", "C (pF)", reading=said)
    assert "displacement" in beside.columns


@pytest.mark.parametrize(
    "name", ["Deflection (mm)", "Deflection (machine) (mm)", "Machine displacement (mm)", "Frame displacement (mm)"]
)
def test_a_place_that_the_machine_tells_is_read(tmp_path: Path, name: str) -> None:
    assert "displacement" in read(tmp_path, "Time (s)", name, "Force (N)", "C (pF)").columns

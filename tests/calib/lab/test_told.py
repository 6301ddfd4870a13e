"""Settings and results beside a record that its readings contradict: refused where a unit explains it, else noted."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import calib
from calib.lab import LabTable
from calib.lab.instruments.vocabulary import understand

TIME = 0.1 * np.arange(120)
PLACE = 0.1 * np.clip(TIME - 1, 0, None)
FORCE = 3.0 * PLACE**1.5
CAPACITANCE = 97.1 + 1.5 * PLACE
NOISE = np.random.default_rng(7).normal(size=(2, TIME.size))
PLAIN = "Time (s),Displacement (mm),Force (N),Capacitance (pF)"


def told(path: Path, *above: str, header: str = PLAIN, scale: tuple[float, ...] = (1, 1, 1, 1), **said: Any) -> LabTable:
    columns = (
        scale[0] * TIME,
        scale[1] * (PLACE + 2e-4 * NOISE[0]),
        scale[2] * (FORCE + 3e-3 * NOISE[1]),
        scale[3] * CAPACITANCE,
    )
    rows = [",".join(f"{cell:.7g}" for cell in row) for row in zip(*columns, strict=True)]
    file = path / "told.csv"
    file.write_text("\n".join([*above, "", header, *rows]) + "\n")
    return calib.read_lab_file(file, calib.Reading(**said))


@pytest.mark.parametrize(
    ("above", "header", "way", "quantity", "largest"),
    [
        ("Test speed: 0.1 mm/s", PLAIN.replace("(mm)", "(m)"), "--units displacement=mm", "displacement", 1.09e-3),
        ('"Rate 1","6","mm/min"', PLAIN.replace("(mm)", "(in)"), "--units displacement=mm", "displacement", 1.09e-3),
        ("Vitesse (mm/s);0.1", PLAIN.replace("(s)", "(min)"), "--units time=s", "time", 11.9),
        ("Sampling rate: 10 Hz", PLAIN.replace("(s)", "(ms)"), "--units time=s", "time", 11.9),
        ("Sampling rate: 10 Hz", PLAIN.replace("(s)", "(min)"), "--units time=s", "time", 11.9),
        ("Note: Sampling rate: 10 Hz", PLAIN.replace("(s)", "(ms)"), "--units time=s", "time", 11.9),
        ("Remark: Test speed: 0.1 mm/s", PLAIN.replace("(mm)", "(m)"), "--units displacement=mm", "displacement", 1.09e-3),
        ("Sampling interval [ms],100", PLAIN.replace("(s)", "(min)"), "--units time=s", "time", 11.9),
        ("Test duration: 11.9 s", PLAIN.replace("(s)", "(ms)"), "--units time=s", "time", 11.9),
        (f"Maximum force: {FORCE.max():.3f} N", PLAIN.replace("(N)", "(kN)"), "--units force=N", "force", FORCE.max()),
        (f"Max load,{FORCE.max() / 10:.4f} N", PLAIN, '--units "force=0.1 N"', "force", FORCE.max() / 10),
        (f"Fmax = {FORCE.max() * 9.80665:.3f} N", PLAIN, "--units force=kgf", "force", FORCE.max() * 9.80665),
        (f"Largest force: {FORCE.max():.3f} N", PLAIN.replace("(N)", "(kN)"), "--units force=N", "force", FORCE.max()),
        (f"Größte Kraft: {FORCE.max():.3f} N", PLAIN.replace("(N)", "(kN)"), "--units force=N", "force", FORCE.max()),
        (f"Plus grande force;{FORCE.max():.3f} N", PLAIN.replace("(N)", "(kN)"), "--units force=N", "force", FORCE.max()),
        (f"Forza maggiore: {FORCE.max():.3f} N", PLAIN.replace("(N)", "(kN)"), "--units force=N", "force", FORCE.max()),
        ("Max displacement,1.09,mm", PLAIN.replace("(mm)", "(cm)"), "--units displacement=mm", "displacement", 1.09e-3),
        ("C0 = 97.107 pF", PLAIN.replace("(pF)", "(nF)"), "--units capacitance=pF", "capacitance", 98.7e-12),
        ("Initial capacitance: 97.107 nF", PLAIN, "--units capacitance=nF", "capacitance", 98.7e-9),
    ],
)
def test_what_another_unit_explains_is_refused_with_the_unit_that_settles_it(
    tmp_path: Path, above: str, header: str, way: str, quantity: str, largest: float
) -> None:
    with pytest.raises(calib.InputError) as error:
        told(tmp_path, above, header=header)
    (fault,) = error.value.faults
    assert fault.line == 1
    assert "stands in line 1, but as it is read" in fault.message
    assert way in fault.advice
    unit = way.split("=")[1].strip('"')
    table = told(tmp_path, above, header=header, units={quantity: unit})
    assert np.nanmax(table.columns[quantity]) == pytest.approx(largest, rel=0.02)
    assert not any("as it is read" in note for note in table.notes)


@pytest.mark.parametrize(
    "above",
    [
        "Nominal capacitance: 97.3 pF",
        "Nominal capacitance: 80 pF",
        "Nennkapazität: 97,3 pF",
        "C_nom;97.3;pF",
        "Sensor: 97.3 pF (nominal)",
        "Unloaded capacitance,97.3,pF",
        "Zero-load capacitance = 97.3 pF",
        "Capacitance at rest [pF]: 97.3",
        "Kapazität unbelastet: 97 pF",
        "Sensor capacitance 97.3 pF",
        "Kapazität: 97 pF",
    ],
)
@pytest.mark.parametrize("column", ["Capacitance (nF)", "Cp (nF)"])
def test_a_capacitance_that_is_a_thousand_times_the_nominal_one_is_refused(tmp_path: Path, above: str, column: str) -> None:
    with pytest.raises(calib.InputError) as error:
        told(tmp_path, above, header=PLAIN.replace("Capacitance (pF)", column))
    (fault,) = error.value.faults
    assert "stands in line 1, but as it is read the readings begin at" in fault.message
    assert "--units capacitance=pF" in fault.advice


@pytest.mark.parametrize(
    ("began", "ended"),
    [
        ("Start: 26.11.2026 14:05:07", "End: 26.11.2026 14:05:19"),
        ("Beginn der Messung;14:05:07", "Ende der Messung;14:05:19"),
        ("Test started at 2026-11-26T23:59:55.0", "Test finished at 2026-11-27T00:00:06.9"),
        ("StartTime,2:05:07 PM", "EndTime,2:05:19 PM"),
        ("Prüfbeginn: 26 Nov 2026 14:05:07", "Prüfende: 26 Nov 2026 14:05:19"),
        ("Début : 14:05:07", "Fin : 14:05:19"),
        ("Start 14:05:07, Stop 14:05:19", ""),
    ],
)
def test_a_clock_a_thousand_times_off_the_start_and_end_of_the_test_is_refused(tmp_path: Path, began: str, ended: str) -> None:
    with pytest.raises(calib.InputError) as error:
        told(tmp_path, began, ended, header=PLAIN.replace("Time (s)", "Elapsed (ms)"))
    (fault,) = error.value.faults
    assert "s apart, but as it is read the record lasts 0.0119 s" in fault.message
    assert "--units time=s" in fault.advice
    table = told(tmp_path, began, ended, header=PLAIN.replace("Time (s)", "Elapsed (ms)"), units={"time": "s"})
    assert np.nanmax(table.columns["time"]) == pytest.approx(11.9)
    assert not any("as it is read" in note for note in table.notes)


def test_a_record_that_lasts_longer_than_from_its_start_to_its_end_is_noted(tmp_path: Path) -> None:
    table = told(tmp_path, "Start: 14:05:07", "End: 14:05:11")
    (note,) = [note for note in table.notes if "as it is read" in note]
    assert '"Start: 14:05:07" in line 1 and "End: 14:05:11" in line 2 are 4 s apart' in note


@pytest.mark.parametrize(
    ("began", "ended"),
    [
        ("Start: 14:05:07", "End: 14:05:19"),
        ("Start: 14:05:07", "End: 14:45:00"),
        ("Start: 14:05", "End: 14:05"),
        ("Start: 14:05:07", "End: 14:17:04"),
        ("Start: 14:05", "End: 14:17"),
        ("Session start: 14:05:07", "Session end: 14:05:09"),
        ("Start: 14:05:07", "Hold end: 14:05:10"),
        ("Start: 26.11.2026 14:05:07", "End: 14:05:10"),
        ("Start of test: 26.11.2026 14:05:07", "Printed: 26.11.2026 14:05:08"),
        ("Start: 14:05:07", "Start: 14:05:08"),
    ],
)
def test_a_start_and_an_end_that_may_be_those_of_more_than_the_record_contradict_nothing(
    tmp_path: Path, began: str, ended: str
) -> None:
    assert not any("as it is read" in note for note in told(tmp_path, began, ended).notes)


def test_a_header_that_is_said_once_more_is_read_with_a_note(tmp_path: Path) -> None:
    table = told(tmp_path, "C0 = 97.107 nF", units={"capacitance": "pF"})
    assert any('"C0 = 97.107 nF" stands in line 1, but as it is read the readings begin at 0.0971' in n for n in table.notes)


def test_a_rate_that_is_contradicted_too_tells_which_of_two_units_a_speed_is_off_by(tmp_path: Path) -> None:
    with pytest.raises(calib.InputError) as error:
        told(tmp_path, "Test speed: 0.1 mm/s", "Sampling rate: 10 Hz", header=PLAIN.replace("(s)", "(ms)"))
    assert all("time=s" in fault.advice and "displacement=" not in fault.advice for fault in error.value.faults)


@pytest.mark.parametrize(
    "above",
    [
        "Test speed: 1 mm/min",
        "Sampling rate: 100 Hz",
        "Sampling interval: 20 ms",
        "Max force: 35 N",
        "Duration: 90 s",
        "C0 = 20 pF",
    ],
)
def test_what_no_unit_explains_is_noted_with_both_numbers(tmp_path: Path, above: str) -> None:
    (note,) = [note for note in told(tmp_path, above).notes if "as it is read" in note]
    assert above in note
    assert "nothing in the file says which is right" in note


@pytest.mark.parametrize(
    "above",
    [
        "Test speed: 0.1 mm/s",
        "Test speed: 6 mm/min",
        "Return speed: 100 mm/s",
        "Pre-load speed: 10 mm/min",
        "Sampling rate: 10 Hz",
        "Frequency: 100 kHz",
        "Load cell max force: 3400 N",
        "Max force limit: 34 N",
        "Maximum allowed displacement: 109 mm",
        "Hold duration: 11900 s",
        "C/C0 = 97 pF",
        "Stray capacitance C0 cable: 97 nF",
        "Tare: 3414 N",
        "Force rate: 1 N/s",
        "Max temperature: 25",
        "C0 = 97 pF",
        "Nominal capacitance: 120 pF",
        "Nominal cable capacitance: 30 nF",
        "Reference capacitance: 100 nF",
        "Capacitance range: 200 nF",
        "Sensor capacitance change: 2 nF",
        "Parallel capacitance: 97 nF",
        "Max load, 3,414 mN",
    ],
)
def test_what_agrees_or_is_said_in_another_sense_contradicts_nothing(tmp_path: Path, above: str) -> None:
    assert not any("as it is read" in note for note in told(tmp_path, above).notes)


def test_of_several_speeds_one_that_agrees_is_enough(tmp_path: Path) -> None:
    assert not any("as it is read" in n for n in told(tmp_path, "Speed 1: 100 mm/s", "Speed 2: 0.1 mm/s").notes)


def test_a_round_maximum_above_all_readings_may_be_a_limit(tmp_path: Path) -> None:
    scale = (1, 1, 5 / FORCE.max(), 1)
    assert any("as it is read the largest force" in note for note in told(tmp_path, "Max force: 50 N", scale=scale).notes)


@pytest.mark.parametrize(
    ("above", "header", "quantity", "units"),
    [
        ("Max. force: 5.0 N", PLAIN.replace("(N)", "(mN)"), "force", ("N", "mN")),
        ("Fmax = 5 N", PLAIN.replace("(N)", "(mN)"), "force", ("N", "mN")),
        ("Maximalkraft: 5 kN", PLAIN, "force", ("kN", "N")),
        ("Max displacement: 1.0 mm", PLAIN.replace("(mm)", "(um)"), "displacement", ("mm", "um")),
        ("Größter Weg: 1 mm", PLAIN.replace("(mm)", "(nm)"), "displacement", ("mm", "nm")),
    ],
)
def test_a_round_maximum_that_another_unit_would_meet_is_asked_about(
    tmp_path: Path, above: str, header: str, quantity: str, units: tuple[str, str]
) -> None:
    scale = (1, 1 / PLACE.max(), 5 / FORCE.max(), 1)
    with pytest.raises(calib.InputError, match="as another unit would make it") as error:
        told(tmp_path, above, header=header, scale=scale)
    (fault,) = error.value.faults
    for unit in units:
        assert f"--units {quantity}={unit}" in fault.advice
        table = told(tmp_path, above, header=header, scale=scale, units={quantity: unit})
        size = {"N": 5.0, "mN": 5e-3, "kN": 5e3, "mm": 1e-3, "um": 1e-6, "nm": 1e-9}[unit]
        assert np.nanmax(table.columns[quantity]) == pytest.approx(size, rel=0.01)


def test_a_large_capacitance_is_read_only_if_its_unit_is_said_once_more(tmp_path: Path) -> None:
    header = PLAIN.replace("pF", "uF")
    with pytest.raises(calib.InputError, match=r"say it once more: --units capacitance=uF"):
        told(tmp_path, header=header)
    table = told(tmp_path, header=header, units={"capacitance": "uF"})
    assert np.nanmax(table.columns["capacitance"]) == pytest.approx(98.7e-6, rel=0.01)


def test_names_of_force_and_capacitance_that_are_exchanged_are_told_with_what_reads_them_rightly(tmp_path: Path) -> None:
    header = "Time (s),Displacement (mm),Capacitance (pF),Force (N)"
    with pytest.raises(calib.InputError) as error:
        told(tmp_path, header=header)
    (fault,) = error.value.faults
    assert '--columns "force=Capacitance (pF)" --columns "capacitance=Force (N)"' in fault.advice
    assert "capacitance=none" not in fault.advice
    columns = {"force": "Capacitance (pF)", "capacitance": "Force (N)"}
    table = told(tmp_path, header=header, columns=columns, units={"force": "N", "capacitance": "pF"})
    assert np.nanmax(table.columns["force"]) == pytest.approx(FORCE.max(), rel=0.01)
    assert np.nanmax(table.columns["capacitance"]) == pytest.approx(98.7e-12, rel=0.01)


@pytest.mark.parametrize(
    "place", ["Displacement crosshead (mm)", "Displacement LVDT (mm)", "LVDT displacement (mm)", "Weg Traverse (mm)"]
)
def test_a_sensor_may_stand_beside_the_word_for_a_place(tmp_path: Path, place: str) -> None:
    table = told(tmp_path, header=PLAIN.replace("Displacement (mm)", place))
    assert table.sources["displacement"] == place


@pytest.mark.parametrize("name", ["Laser speed (mm/s)", "Encoder counts", "Force LVDT (N)", "Laser h"])
def test_a_sensor_beside_another_word_is_no_place(name: str) -> None:
    assert understand(name) is None


def test_a_letter_with_a_channel_and_a_unit_is_its_quantity_and_two_are_open(tmp_path: Path) -> None:
    assert told(tmp_path, header=PLAIN.replace("Capacitance", "C CH1")).sources["capacitance"] == "C CH1 (pF)"
    assert "capacitance" not in told(tmp_path, header=PLAIN.replace("Capacitance", "C S2")).columns


@pytest.mark.parametrize("label", ["S{}", "run {}", "Specimen_{}"])
def test_runs_side_by_side_with_labels_behind_their_units_are_read_one_at_a_time(tmp_path: Path, label: str) -> None:
    header = ",".join(f"{name} {label.format(run)}" for run in (1, 2) for name in PLAIN.split(","))
    rows = []
    for i in range(60):
        depth = max(0.0, 0.01 * (i - 10))
        own = f"{0.1 * i:.1f},{depth:.4f},{9 * depth**1.5:.4f},{97 + depth:.4f}"
        other = f"{0.06 * i:.2f},{2 * depth:.4f},{5 * depth**1.5:.4f},{98 + depth:.4f}" if i < 45 else ",,,"
        rows.append(f"{own},{other}")
    file = tmp_path / "runs.csv"
    file.write_text("\n".join([header, *rows]) + "\n")
    with pytest.raises(calib.InputError, match=r"--columns time=1 to read .*--columns time=5 to read"):
        calib.read_lab_file(file)
    for time, last in (("1", 5.9), ("5", 2.64)):
        table = calib.read_lab_file(file, calib.Reading(columns={"time": time}))
        assert set(table.columns) == {"time", "displacement", "force", "capacitance"}
        assert np.nanmax(table.columns["time"]) == pytest.approx(last)


def refused_with(path: Path, header: str, rows: list[str]) -> str:
    path.write_text("\n".join([header, *rows] if header else rows) + "\n")
    with pytest.raises(calib.InputError) as refused:
        calib.read_lab_file(path)
    return str(refused.value)


def test_of_a_force_and_a_displacement_with_clocks_of_their_own_no_single_one_is_offered(tmp_path: Path) -> None:
    rows = [f"{0.1 * i:.2f},{9e-5 * i**2:.4f},{0.08 * i:.2f},{0.009 * i:.4f},{97 + 0.01 * i:.3f}" for i in range(80)]
    said = refused_with(
        tmp_path / "two.csv", "Time (s),Force (N),Time (s),Displacement (mm)", [r.rsplit(",", 1)[0] for r in rows]
    )
    assert "the displacement interpolated to these times" in said
    assert "--columns" not in said
    said = refused_with(tmp_path / "three.csv", "Time (s),Force (N),Time (s),Displacement (mm),Cp (pF)", rows)
    assert '--columns time=3 to read "Displacement (mm)", "Cp (pF)"' in said
    assert "time=1" not in said
    table = calib.read_lab_file(tmp_path / "three.csv", calib.Reading(columns={"time": "3"}))
    assert {"displacement", "capacitance"} <= set(table.columns)


def test_replies_of_a_meter_without_a_time_are_asked_for_one(tmp_path: Path) -> None:
    rows = [f"+{9.71 + 0.001 * i:.4f}0E-11,+1.99730E-03,+0" for i in range(60)]
    said = refused_with(tmp_path / "raw.txt", "", rows)
    assert "log the time of each reply in a column before it" in said
    assert "--columns" not in said
    (tmp_path / "raw.csv").write_text("\n".join(["Time (s),Cp (F),D,status", *(f"{0.5 * i},{r}" for i, r in enumerate(rows))]))
    assert "capacitance" in calib.read_lab_file(tmp_path / "raw.csv").columns


@pytest.mark.parametrize(("header", "offered"), [("Time (s),Cp (pF)", False), ("Time (s),Cp (pF),s (mm),F (N)", True)])
def test_a_negative_capacitance_may_be_left_out_where_a_press_is_left(tmp_path: Path, header: str, offered: bool) -> None:
    rows = [f"{0.1 * i:.1f},{-97 - 0.01 * i:.3f}{f',{0.01 * i:.3f},{9e-4 * i**2:.4f}' if offered else ''}" for i in range(60)]
    said = refused_with(tmp_path / "lab.csv", header, rows)
    assert "which no capacitance is" in said
    assert ("--columns capacitance=none" in said) == offered


@pytest.mark.parametrize(
    "above",
    [
        "# AD7746 CAPDAC = 93.5 pF, shown: Cin - CAPDAC",
        "Offset: 93.5 pF",
        "Stray capacitance of 3.2 pF subtracted",
        "Kabelkapazität 12 pF abgezogen",
        "Reference (pF): 90.0, to be added",
        "C_offset,12.5,pF",
        "Cable 12 pF removed",
    ],
)
@pytest.mark.parametrize("name", ["Capacitance (pF)", "Cp (pF)"])
def test_an_offset_that_the_file_says_was_taken_off_a_capacitance_is_noted(tmp_path: Path, above: str, name: str) -> None:
    table = told(tmp_path, above, header=PLAIN.replace("Capacitance (pF)", name))
    (note,) = [note for note in table.notes if "with nothing added or taken off" in note]
    assert note.startswith("line 1 says")
    assert np.nanmax(table.columns["capacitance"]) == pytest.approx(98.7e-12, rel=0.01)


@pytest.mark.parametrize(
    "above",
    [
        "Offset: 0.5 N",
        "Stray capacitance: 3 pF",
        "C0 = 97 pF",
        "Cell offset subtracted",
        "Range 200 pF",
        "Operator: C-Cure, 5 mm",
    ],
)
def test_what_takes_no_capacitance_off_is_no_offset_of_one(tmp_path: Path, above: str) -> None:
    assert not any("with nothing added or taken off" in note for note in told(tmp_path, above).notes)

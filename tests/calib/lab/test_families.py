"""A file is called an instrument's only by marks that this instrument alone leaves in it."""

from __future__ import annotations

from pathlib import Path

import pytest

from calib.lab import read_lab_file

ROWS = "".join(f"{0.1 * i:.1f},{0.01 * i:.2f},{0.2 + (0.02 * i) ** 1.5:.4f}\n" for i in range(60))


def recognised(tmp_path: Path, head: str, rows: str = ROWS) -> str:
    path = tmp_path / "lab.csv"
    path.write_text(head + rows, encoding="utf-8")
    return read_lab_file(path).recognised_as


@pytest.mark.parametrize(
    "head",
    [
        "Time (s),Displacement (mm),Force (N)\n",
        "Time (s),Extension (mm),Load (N)\n",
        "time_s,extension_mm,load_N\n",
        "Time,Displacement,Force\n(s),(mm),(N)\n",
        "Time,Extension,Load\ns,mm,N\n",
        "Zeit (s),Weg (mm),Kraft (N)\n",
        "Operator,A\n\nTime (s),Displacement (mm),Force (N)\n",
    ],
)
def test_a_table_of_time_displacement_and_force_is_anybodys(tmp_path: Path, head: str) -> None:
    assert recognised(tmp_path, head) == "table with a header"


@pytest.mark.parametrize(
    "head",
    [
        "Time,Extension,Load\n(s),(mm),(N)\n",
        "1,Time,Displacement,Force\n,(s),(mm),(N)\n",
        'Text Inputs : Specimen label,"a"\nTime,Extension,Load\n(s),(mm),(N)\n',
        "Time (s),Compressive extension (mm),Compressive load (N)\n",
    ],
)
def test_bluehill_is_known_by_its_own_marks(tmp_path: Path, head: str) -> None:
    rows = "".join(f",{line}\n" for line in ROWS.splitlines()) if head.startswith("1,") else ROWS
    assert recognised(tmp_path, head, rows) == "Instron Bluehill raw data"


def test_torque_events_and_numbers_of_specimens_are_no_marks_of_a_maker(tmp_path: Path) -> None:
    more = "".join(f"{line},0\n" for line in ROWS.splitlines())
    for head in ("Time (s),Displacement (mm),Force (N),Torque (N·m)\n", "Time (s),Displacement (mm),Force (N),Event\n"):
        assert recognised(tmp_path, head, more) == "table with a header"
    capacitance = "".join(f"{0.1 * i:.1f},{97 + 0.01 * i:.2f}\n" for i in range(60))
    assert recognised(tmp_path, "Sample 3522\nTime (s),Cp (pF)\n", capacitance) == "LCR log"
    assert recognised(tmp_path, "Hioki 3522-50\nTime (s),Cp (pF)\n", capacitance) == "Hioki LCR meter"


@pytest.mark.parametrize(
    "head",
    [
        "Trapezium X\nMethod: comp.xmas\nSample: 3\n",
        "NexygenPlus 3.0\nMethod: Compression\nSpecimen: 1\n",
        "own rig\nSpecimen label: pad 3\n",
        "Test: Compression\nMethod: Comp.msm\n",
        "General: pads of March\n",
        "# as in the Bluehill export of last year\n",
        "# not measured on the Zwick\n",
        "# testXpert was down, read by hand\n",
        "Operator: K. Emperor\n",
    ],
)
def test_words_that_any_program_writes_above_name_none(tmp_path: Path, head: str) -> None:
    assert recognised(tmp_path, f"{head}Time (s),Extension (mm),Load (N)\n") == "table with a header"


@pytest.mark.parametrize(
    ("head", "family"),
    [
        ("# Hioki was broken, used Keysight E4980A\n", "LCR log"),
        ("# no E4980A here\n", "LCR log"),
        ("# kein Keysight, sondern Eigenbau\n", "LCR log"),
        ("# LCR: Hioki IM3536, 1 kHz, 1 V\n", "Hioki LCR meter"),
        ("Instrument,Keysight Technologies,E4980A\n", "Keysight LCR meter"),
        ("# measured with E4980AL\n", "Keysight LCR meter"),
        ("GW INSTEK LCR-6100\n", "GW Instek LCR meter"),
    ],
)
def test_a_meter_is_named_by_a_line_of_its_own_not_by_a_sentence(tmp_path: Path, head: str, family: str) -> None:
    rows = "".join(f"{0.1 * i:.1f},{97 + 0.01 * i:.2f}\n" for i in range(60))
    assert recognised(tmp_path, f"{head}Time (s),Cp (pF)\n", rows) == family

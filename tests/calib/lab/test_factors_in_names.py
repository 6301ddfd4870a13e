"""A factor anywhere in a name is asked about, also where the user names the column; conditions of a meter are no factor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file
from calib.lab.instruments.vocabulary import heading_as, understand

N = 60
TIME = np.arange(N) * 0.1
DEPTH = np.concatenate([np.linspace(0.0, 1.0, 36), np.linspace(1.0, 0.02, 24)])
FORCE = 7.0 * np.clip(DEPTH - 0.1, 0.0, None) ** 1.7 + 0.003 * np.sin(37.0 * np.arange(N))


def read(tmp_path: Path, force: str, reading: Reading) -> LabTable:
    rows = [f"{t:.2f};{d:.4f};{f:.4f}" for t, d, f in zip(TIME, DEPTH, FORCE, strict=True)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([f"Time (s);Extension (mm);{force}", *rows]) + "\n")
    return read_lab_file(path, reading)


@pytest.mark.parametrize(
    "name",
    [
        "10*F (N)",
        "10 x F (N)",
        "2*F (N)",
        "1000 F (N)",
        "0.1 Load (N)",
        "1e3 Force (N)",
        "Force (N) ÷ 10",
        "F times 10 (N)",
        "Kraft geteilt durch 10 (N)",
        "F in 10^-2 N",
        "Force x1000 (N)",
        "F^2 (N)",
        "Force_x10 (N)",
        "force_x1000_N",
        "force_div10_N",
        "Force (N) gain 10",
        "force_gain_10_N",
    ],
)
def test_a_factor_is_asked_about_by_its_name_and_again_where_the_user_names_the_column(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError):
        read(tmp_path, name, Reading())
    with pytest.raises(InputError, match="--units"):
        read(tmp_path, name, Reading(columns={"force": name}))
    table = read(tmp_path, name, Reading(columns={"force": name}, units={"force": "0.1 N"}))
    assert np.allclose(table.columns["force"], 0.1 * FORCE, atol=1e-5)


@pytest.mark.parametrize(
    "name",
    [
        "2 Load (N)",
        "x1 Load (N)",
        "Load cell 10 N (N)",
        "10 N cell (N)",
        "1 x Force (N)",
        "Force @ 100 Hz (N)",
        "Force_x1 (N)",
        "Load_2 (N)",
        "force_10N_N",
    ],
)
def test_a_channel_or_the_reach_of_a_cell_is_no_factor(tmp_path: Path, name: str) -> None:
    table = read(tmp_path, name, Reading(columns={"force": name}))
    assert np.allclose(table.columns["force"], FORCE, atol=1e-4)


@pytest.mark.parametrize(
    "name",
    [
        "Cp @ 100 kHz, 1 V (pF)",
        "Cp 1kHz 1V (pF)",
        "Cp [pF] (1 kHz; 1 V)",
        "C_p 1 MHz [pF]",
        "Cp-1kHz (pF)",
        "Cp @ 1 V (pF)",
        "Cp (f=1 kHz) [pF]",
        "Cp(1 kHz/1 V) (pF)",
        "Cp_100kHz_pF",
        "Cs @ 1 kHz, 500 mVrms (pF)",
        "C_s (pF)",
    ],
)
def test_at_which_frequency_and_voltage_a_meter_measured_is_no_part_of_the_name(name: str) -> None:
    heading = understand(name)
    assert heading is not None
    assert heading.quantity == ("capacitance_series" if "s" in name[:3] else "capacitance")
    assert heading.unit == "pF"
    assert not heading.unit_doubt + heading.name_doubt
    assert heading_as("capacitance", name).unit_doubt == ""


@pytest.mark.parametrize("name", ["Cp error @ 1 kHz (pF)", "Cp (5 V bias) (pF)", "Cp 1 kHz (nF) (pF)"])
def test_what_else_the_name_says_stays_in_doubt(name: str) -> None:
    heading = understand(name)
    assert heading is not None
    assert heading.unit_doubt + heading.name_doubt
    assert understand("Cp max 1 kHz (pF)") is None
    assert heading_as("capacitance", "Cp @ 100 (pF)").unit_doubt


@pytest.mark.parametrize(
    ("share", "offered"), [("ΔC/C0 (%)", False), ("dR/R0 (%)", False), ("Strain (%)", True), ("Compression (%)", True)]
)
def test_only_a_share_of_a_length_is_offered_as_a_displacement(tmp_path: Path, share: str, offered: bool) -> None:
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([f"Force (N),{share}", *(f"{f:.4f},{d:.4f}" for d, f in zip(DEPTH, FORCE, strict=True))]) + "\n")
    with pytest.raises(InputError, match="no displacement column") as raised:
        read_lab_file(path)
    assert (f"displacement={share}" in str(raised.value)) == offered


@pytest.mark.parametrize(
    "name",
    [
        "Load 100ths N",
        "Load 1/100ths N",
        "Load hundredths of N",
        "Force thousandths (N)",
        "Load x10^-2 N",
        "Kraft Hundertstel N",
        "Force dixièmes de N",
        "Fuerza centésimas N",
        "Forza centesimi N",
        "Load tens of N",
    ],
)
def test_parts_of_a_unit_in_words_are_asked_about_though_the_column_is_said(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="the factor"):
        read(tmp_path, name, Reading(columns={"force": name}))
    table = read(tmp_path, name, Reading(columns={"force": name}, units={"force": "0.01 N"}))
    np.testing.assert_allclose(table.columns["force"], 0.01 * FORCE, atol=1e-5)


@pytest.mark.parametrize("name", ["Force 10th run (N)", "Load cell 100 (N)", "Decimation force (N)"])
def test_numbers_of_other_things_are_no_parts_of_a_unit(name: str) -> None:
    assert "the factor" not in heading_as("force", name).unit_doubt


@pytest.mark.parametrize(
    "name",
    [
        "Force (N) (div by 10)",
        "Force (N) (multiply by ten)",
        "Force (N) (10 times too large)",
        "Force (N) (tenfold)",
        "Force (N) (1/10)",
        "Force (N) (one tenth)",
        "Force (N) (scale factor 0.1)",
        "Force (N) (scale 10)",
        "Force (N) (k=2)",
        "Force (N) (reading/10)",
        "Force (N), to be divided by 10",
        "Force over 10 (N)",
        "Force (N) (10% too high)",
        "Force (N) (quux 9.81)",
        "Force (N) (ratio 10)",
        "Kraft (N) (Faktor 10)",
        "Kraft (N) (mal zehn)",
        "Kraft 10-fach (N)",
        "halbe Kraft (N)",
        "Half force (N)",
        "Force (N) (facteur 10)",
        "Force (N) (divisé par 10)",
        "Fuerza (N) (dividida entre 10)",
        "Forza (N) (moltiplicata per 10)",
        "Siła (N) (współczynnik 10)",
        "力 (N) (10倍)",
        "力 (N) (除以10)",
        "2F (N)",
        "10F (N)",
        "½F (N)",
        "0.5 F (N)",
    ],
)
def test_a_factor_in_other_words_is_not_dropped_by_naming_the_column(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError) as first:
        read(tmp_path, name, Reading())
    assert "--columns" in str(first.value) or "--units" in str(first.value)
    for said in (name, "3"):
        with pytest.raises(InputError, match="--units"):
            read(tmp_path, name, Reading(columns={"force": said}))
    table = read(tmp_path, name, Reading(columns={"force": name}, units={"force": "0.1 N"}))
    assert np.allclose(table.columns["force"], 0.1 * FORCE, atol=1e-5)


def test_advice_on_an_unknown_number_has_the_column_and_its_unit_at_once(tmp_path: Path) -> None:
    name = "Force (N) (quux 9.81)"
    with pytest.raises(InputError, match=r'--columns "force=Force \(N\) \(quux 9.81\)" and --units force=N') as caught:
        read(tmp_path, name, Reading())
    assert caught.value.faults[0].choice is not None
    assert np.allclose(
        read(tmp_path, name, Reading(columns={"force": name}, units={"force": "N"})).columns["force"], FORCE, atol=1e-4
    )


@pytest.mark.parametrize(
    "words",
    [
        "run 3",
        "v2",
        "2026-03-04",
        "test 12",
        "10 samples",
        "avg of 10",
        "20 mm ball",
        "50N cell",
        "half bridge",
        "U9C",
        "cell 2",
        "by hand",
    ],
)
def test_what_counts_or_says_how_it_was_measured_is_no_factor_once_the_column_is_said(tmp_path: Path, words: str) -> None:
    name = f"Force (N) ({words})"
    assert np.allclose(read(tmp_path, name, Reading(columns={"force": name})).columns["force"], FORCE, atol=1e-4)

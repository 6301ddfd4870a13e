"""Lab files that speak of another specimen than the one that they were entered for are found; those of sound labs are not."""

from __future__ import annotations

from pathlib import Path

import pytest

from calib.experiment.of_others import files_of_others
from calib.experiment.plan import Experiment, Specimen, SweepFiles

BLUEHILL = 'Text Inputs : Specimen label,"{}"\nRate : Rate 1,1.00000,mm/min\n\nTime,Extension,Load\n(s),(mm),(N)\n0,0,0\n'


def _experiment(lab: Path, entered: dict[str, tuple[str, str]]) -> Experiment:
    """Name of a specimen -> names of its files of force and capacitance."""
    specimens = tuple(
        Specimen(name, (SweepFiles("", lab / force, lab / capacitance, 5e-3),), {})
        for name, (force, capacitance) in entered.items()
    )
    return Experiment("lab", lab / "experiment.toml", "", 5e-3, 10e-3, "sensor", {}, specimens, "closed form", "on")


def _told(lab: Path, entered: dict[str, tuple[str, str]]) -> list[tuple[str, str, str]]:
    return [(one.specimen, one.file, one.other) for one in files_of_others(_experiment(lab, entered))]


def test_files_that_were_exchanged_are_told_by_their_names(tmp_path: Path) -> None:
    entered = {"sensor 1": ("s02_press.csv", "s1_lcr.csv"), "sensor 2": ("s01_press.csv", "s2_lcr.csv")}
    assert _told(tmp_path, entered) == [("sensor 1", "s02_press.csv", "sensor 2"), ("sensor 2", "s01_press.csv", "sensor 1")]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_files_that_were_exchanged_are_told_by_what_the_tester_wrote(tmp_path: Path, encoding: str) -> None:
    for file, label in (("monday.csv", "Sensor 2"), ("tuesday.csv", "Sensor 1")):
        (tmp_path / file).write_text(BLUEHILL.format(label), encoding=encoding)
    (tmp_path / "a.csv").write_text("Time,Cp\n0,1e-10\n", encoding="utf-8")
    found = files_of_others(_experiment(tmp_path, {"s1": ("monday.csv", "a.csv"), "s2": ("tuesday.csv", "a.csv")}))
    assert [(one.specimen, one.file, one.says, one.other) for one in found] == [
        ("s1", "monday.csv", 'says "Sensor 2"', "s2"),
        ("s2", "tuesday.csv", 'says "Sensor 1"', "s1"),
    ]


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
@pytest.mark.parametrize("words", ["Probenbezeichnung: {}", "Échantillon : {}", "Prüfling Nr.;{}", "Muster;{}", "DUT: S_0{}"])
def test_what_is_written_in_other_languages_is_read_in_their_encodings(tmp_path: Path, words: str, encoding: str) -> None:
    for file, label in (("x.csv", "2"), ("y.csv", "1")):
        text = f"Kraftsensor: 1\nGerät: Prüfmaschine\n{words.format(label)}\n0;0\n"
        (tmp_path / file).write_text(text, encoding=encoding)
    assert [told[0] for told in _told(tmp_path, {"s1": ("x.csv", "u.csv"), "s2": ("y.csv", "v.csv")})] == ["s1", "s2"]


@pytest.mark.parametrize(
    ("labels", "told"),
    [
        (("A7", "A8", "A8", "A9"), [("p_b", "p_c"), ("p_c", "p_b")]),
        (("A7", "A8", "A9", "A10"), []),
        # Lots, and a method that two have.
        (("A", "A", "B", "B"), []),
        (("A", "A", "A", "B"), []),
    ],
)
def test_a_label_that_two_of_many_have_is_told_of_both(
    tmp_path: Path, labels: tuple[str, ...], told: list[tuple[str, str]]
) -> None:
    names = ("p_a", "p_b", "p_c", "p_d")
    for name, label in zip(names, labels, strict=True):
        (tmp_path / f"{name}.csv").write_text(BLUEHILL.format(label), encoding="utf-8")
    found = _told(tmp_path, {name: (f"{name}.csv", f"{name}_lcr.csv") for name in names})
    assert [(own, other) for own, _, other in found] == told


@pytest.mark.parametrize(
    "entered",
    [
        {"sensor 1": ("sensor1_instron.csv", "sensor1_lcr.csv"), "sensor 2": ("sensor2_instron.csv", "sensor2_lcr.csv")},
        # A day, a ball and a number of the press are no names of specimens.
        {"1": ("2024-05-02_s1_press_2.csv", "s1_lcr_2.csv"), "2": ("2024-05-01_s2_press_1.csv", "s2_lcr_1.csv")},
        {"1": ("press_a.csv", "c1.csv"), "2": ("press_b.csv", "c2.csv")},
        # Of both, and of none that is known.
        {"A": ("A_B_f.csv", "A_lcr.csv"), "B": ("B_f.csv", "B_lcr.csv")},
        {"soft": ("pad3.csv", "pad3_lcr.csv"), "hard": ("pad4.csv", "pad4_lcr.csv")},
        {"sensor 1": ("s11.csv", "s11_lcr.csv"), "sensor 2": ("s12.csv", "s12_lcr.csv")},
        {"only one": ("s2.csv", "s2_lcr.csv")},
    ],
)
def test_of_a_sound_lab_nothing_is_told(tmp_path: Path, entered: dict[str, tuple[str, str]]) -> None:
    assert not _told(tmp_path, entered)


def test_a_label_that_all_files_have_or_that_says_more_says_nothing(tmp_path: Path) -> None:
    for file, label in (("x.csv", "sensor 1"), ("y.csv", "sensor 1")):
        (tmp_path / file).write_text(BLUEHILL.format(label), encoding="utf-8")
    assert not _told(tmp_path, {"sensor 1": ("x.csv", "u.csv"), "sensor 2": ("y.csv", "v.csv")})
    for file, text in (("x.csv", "Probe: 2 kHz\n"), ("y.csv", "Sample: 1 of 3\n")):
        (tmp_path / file).write_text(text, encoding="utf-8")
    assert not _told(tmp_path, {"sensor 1": ("x.csv", "u.csv"), "sensor 2": ("y.csv", "v.csv")})

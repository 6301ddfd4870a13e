"""Which lab files are put together: by name or time, and never where several could be meant."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from calib.experiment.draft import experiment_text
from calib.experiment.edits import MARK
from calib.experiment.lab_files import Found
from calib.experiment.pairing import pair
from calib.experiment.presses import Pressed
from calib.lab import LabTable, Reading

FORCE, CAPACITANCE = ("time", "displacement", "force"), ("time", "capacitance")
NOON = datetime(2024, 5, 2, 12)


def _found(
    name: str, columns: tuple[str, ...], *, after: float | None = None, lasts: float = 10.0, specimen: int | None = None
) -> Found:
    path = Path("/lab") / name
    values = {c: np.linspace(0.0, lasts, 9) for c in columns}
    started = None if after is None else NOON + timedelta(seconds=after)
    rows = np.arange(2, 11)
    table = LabTable(
        path, name, "table", "", "utf-8", ",", ".", values, {c: c for c in columns}, rows, ("",) * 9, (), started=started
    )
    return Found(table, Reading(specimen=specimen), folder="" if path.parent.name == "lab" else path.parent.name)


def _paired(force: list[str], capacitance: list[str]) -> dict[str, str]:
    """Force file -> its capacitance file, of presses with both."""
    records = [*(_found(n, FORCE) for n in force), *(_found(n, CAPACITANCE) for n in capacitance)]
    presses = [p for s in pair(records) for p in s.presses]
    assert sum((p.force is not None) + (p.capacitance is not None) for p in presses) == len(records), "a record is lost"
    return {p.force.shown: p.capacitance.shown for p in presses if p.force and p.capacitance}


@pytest.mark.parametrize(
    ("force", "capacitance"),
    [
        ("s{}_press.csv", "s{}_cap.csv"),
        ("sensor{}_instron.csv", "sensor{}_lcr.csv"),
        ("A-0{}-force.csv", "A-0{}-C.csv"),
        ("press_s{}.csv", "cap_s{}.csv"),
        ("{}_F.csv", "{}_C.csv"),
        ("F{}.csv", "C{}.csv"),
        ("S{} Druck.csv", "S{} Kapazität.csv"),
        ("S{}-DRUCK.CSV", "s{}_kapazitaet.txt"),
        ("Sensor {} (force).csv", "sensor_0{}_capacitance.csv"),
        ("sensor{}_instron.csv", "s{}_lcr.csv"),
        ("s{}_force_raw.csv", "s{}_lcr_log_final.csv"),
        ("Probe{}Kraft.csv", "Probe{}Kapazitaet.csv"),
        ("2024-05-02_s{}_press.csv", "20240502_s{}_cap.csv"),
        ("s{}_press_2024-05-02_101500.csv", "s{}_cap_2024-05-02_101733.csv"),
        ("s{}_zwick.tra", "s{}_IM3536.csv"),
        ("instron5944_s{}.csv", "E4980A_s{}.csv"),
        ("传感器{}压力.csv", "传感器{}电容.csv"),
        ("s{}_padded_press.csv", "s{}_cap.csv"),
        ("force/s{}.csv", "lcr/s{}.csv"),
        ("s{}/press.csv", "s{}/cap.csv"),
        ("day{}/s1_press.csv", "day{}/s1_cap.csv"),
    ],
)
def test_names_that_agree_but_for_words_for_instruments_are_paired(force: str, capacitance: str) -> None:
    numbers = (1, 2, 3)
    wanted = {force.format(n): capacitance.format(n) for n in numbers}
    assert _paired([force.format(n) for n in numbers], [capacitance.format(n) for n in (2, 3, 1)]) == wanted


@pytest.mark.parametrize("letters", ["AB", "CF", "FC", "DE"])
def test_a_specimen_may_be_called_by_the_letter_of_a_quantity(letters: str) -> None:
    for force, capacitance in (("{}_F.csv", "{}_C.csv"), ("{}_press.csv", "{}_cap.csv"), ("force {}.csv", "C {}.csv")):
        wanted = {force.format(x): capacitance.format(x) for x in letters}
        assert _paired([*wanted], [*wanted.values()]) == wanted


@pytest.mark.parametrize(
    ("force", "capacitance"),
    [
        (["s1_press.csv"], ["s2_cap.csv"]),
        (["s1_press.csv", "s3_press.csv"], ["s2_cap.csv", "s4_cap.csv"]),
        (["s1_press_2.csv"], ["s2_press_1_cap.csv"]),
        (["s1_press.csv", "s1-force.csv"], ["s1_cap.csv"]),
        (["s1_press.csv"], ["s1_cap.csv", "S1 LCR.csv"]),
        (["s1_press.csv", "sensor1_force.csv"], ["1_lcr.csv"]),
        (["s1_press_1.csv", "s1_press_2.csv"], ["s1_cap.csv"]),
        (["s11_press.csv", "s12_press.csv"], ["s1_cap.csv", "s2_cap.csv"]),
        (["alpha_press.csv"], ["beta_cap.csv"]),
        (["a/s1_press.csv", "b/s1_press.csv"], ["c/s1_cap.csv"]),
        (["s1_day1_press.csv", "s1_day2_press.csv"], ["s1_day3_cap.csv"]),
    ],
)
def test_what_could_be_meant_otherwise_is_not_paired(force: list[str], capacitance: list[str]) -> None:
    assert _paired(force, capacitance) == {}


def test_where_several_could_be_meant_each_of_them_says_so() -> None:
    records = [_found("s1_press.csv", FORCE), _found("s1-f.csv", FORCE), _found("s1_cap.csv", CAPACITANCE)]
    presses = [p for s in pair(records) for p in s.presses]
    assert [p.notes for p in presses] == [
        ("not paired, as s1_cap.csv fits s1-f.csv as well",),
        ("not paired, as s1_cap.csv fits s1_press.csv as well",),
        ("not paired, as s1_press.csv and s1-f.csv fit it alike",),
    ]


def test_the_only_two_are_paired_if_their_names_do_not_contradict_and_are_to_be_checked() -> None:
    (only,) = pair([_found("Specimen_RawData_1.csv", FORCE), _found("log.txt", CAPACITANCE)])
    assert only.presses[0].in_words == "paired as the only two: check"


def test_times_pair_what_names_do_not_unless_two_are_near() -> None:
    def records(*after: float) -> list[Found]:
        return [
            *(_found(f"x{k}.csv", FORCE, after=3600.0 * k) for k in (1, 2)),
            *(_found(f"y{5 + k}.csv", CAPACITANCE, after=a) for k, a in enumerate(after)),
        ]

    near = [p for s in pair(records(7203.0, 3605.0)) for p in s.presses]
    assert [p.capacitance and p.capacitance.shown for p in near] == ["y6.csv", "y5.csv"]
    assert near[0].why == "paired by time: the records began 5 s apart, but their names differ: check"
    both_near = [p for s in pair(records(3603.0, 3605.0)) for p in s.presses]
    assert not any(p.force and p.capacitance for p in both_near)


def test_records_that_began_hours_apart_or_last_differently_are_to_be_checked() -> None:
    (apart,) = pair([_found("A_press.csv", FORCE, after=0), _found("A_cap.csv", CAPACITANCE, after=2 * 3600)])
    assert apart.presses[0].in_words == ("paired by name, but the records began 2.0 h apart: check that they are of one press")
    (short,) = pair([_found("A_press.csv", FORCE), _found("A_cap.csv", CAPACITANCE, lasts=2)])
    assert "A_press.csv lasts 10 s, A_cap.csv 2 s" in short.presses[0].in_words
    (alike,) = pair([_found("A_press.csv", FORCE), _found("A_cap.csv", CAPACITANCE, lasts=12)])
    assert alike.presses[0].in_words == "paired by name"


@pytest.mark.parametrize(
    ("force", "capacitance", "names", "why"),
    [
        (["P1_Zug.csv", "P2_Zug.csv"], ["P1_Meter.csv", "P2_Meter.csv"], ["P1", "P2"], "paired by name"),
        (
            ["P1_oben.csv", "P2_oben.csv"],
            ["P1_box.csv", "P2_box.csv"],
            ["P1_oben", "P2_oben"],
            'paired by name, taking "oben" and "box" for words of the instruments',
        ),
        (["P1_a.csv"], ["P1_b.csv"], ["P1_a"], 'paired by name, taking "a" and "b" for words of the instruments: check'),
    ],
)
def test_words_that_all_files_of_one_instrument_have_tell_no_specimens_apart(
    force: list[str], capacitance: list[str], names: list[str], why: str
) -> None:
    found = pair([*(_found(n, FORCE) for n in force), *(_found(n, CAPACITANCE) for n in capacitance)])
    assert [s.name for s in found] == names
    assert {s.presses[0].why for s in found} == {why}


def test_words_that_tell_specimens_apart_are_none_of_instruments() -> None:
    found = pair([*(_found(n, FORCE) for n in ("left.csv", "right.csv")), _found("top.csv", CAPACITANCE)])
    assert all(s.presses[0].force is None or s.presses[0].capacitance is None for s in found)
    assert len(found) == 3


def _sweeps(*names: str) -> dict[str, list[str]]:
    return {s.name: [p.name for p in s.presses] for s in pair([_found(n, FORCE) for n in names])}


def test_presses_of_one_specimen_become_its_sweeps_where_the_names_say_so() -> None:
    assert _sweeps("s1_press_1.csv", "s1_press_2.csv", "s2_press_1.csv") == {
        "s1": ["press 1", "press 2"],
        "s2 1": [""],
    }
    assert _sweeps("s1 ball 5mm.csv", "s1 ball 10 mm.csv", "s2 ball 5mm.csv") == {
        "s1": ["ball 5mm", "ball 10 mm"],
        "s2 ball 5mm": [""],
    }
    assert _sweeps("s1_run1_force.csv", "s1_run2_force.csv") == {"s1": ["run1", "run2"]}
    assert _sweeps("s1_press.csv", "s1_press_2.csv") == {"s1": ["1", "press 2"]}


def _balls(*names: str) -> dict[str, dict[str, tuple[bool, str]]]:
    """Specimen -> press -> whether it speaks of a ball, and the radius that it tells."""
    return {s.name: {p.name: (p.ball, p.radius) for p in s.presses} for s in pair([_found(n, FORCE) for n in names])}


def test_names_that_differ_in_the_radius_of_a_ball_alone_are_presses_of_one_specimen() -> None:
    assert _balls("s1_r5_force.csv", "s1_r8_force.csv", "s2_r5_force.csv") == {
        "s1": {"r5": (True, "5"), "r8": (True, "8")},
        "s2_r5": {"": (False, "5")},
    }
    assert _balls("s3_R2.5mm_F.csv", "s3_R5mm_F.csv") == {"s3": {"R2.5mm": (True, "2.5"), "R5mm": (True, "5")}}
    assert _balls("padA_radius5.csv", "padA_radius3.csv") == {"padA": {"radius5": (True, "5"), "radius3": (True, "3")}}
    assert _balls("r5_s6_force.csv", "r8_s6_force.csv") == {"s6": {"r5": (True, "5"), "r8": (True, "8")}}
    assert _balls("s7 d10mm press.csv", "s7 d16mm press.csv") == {"s7": {"d10mm": (True, "5"), "d16mm": (True, "8")}}
    assert _balls("s8_r5_press_1.csv", "s8_r5_press_2.csv") == {"s8": {"r5 1": (True, "5"), "r5 2": (True, "5")}}
    assert _balls("s1 ball 5mm.csv", "s1 ball 3mm.csv") == {"s1": {"ball 5mm": (True, ""), "ball 3mm": (True, "")}}
    # From one on without a gap the letter counts runs.
    assert _balls("s1_r1.csv", "s1_r2.csv", "s1_r3.csv") == {"s1": {f"r{k}": (False, "") for k in (1, 2, 3)}}


@pytest.mark.parametrize(
    "names",
    [
        ("ecoflex_r5.csv", "ecoflex_r8.csv"),  # replicates of a material, it may be
        ("batch1_d1_force.csv", "batch1_d2_force.csv"),  # devices
        ("s1_r5_b3.csv", "s1_r8_b4.csv"),
        ("s1_5mm.csv", "s1_8mm.csv"),  # a thickness, it may be
        ("r5_force.csv", "r8_force.csv"),
    ],
)
def test_what_may_be_no_radius_of_a_ball_makes_no_presses_of_one_specimen(names: tuple[str, str]) -> None:
    assert all(presses == [""] for presses in _sweeps(*names).values())


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (("sensor r5 press.csv", "sensor r8 press.csv"), [("r5", "5"), ("r8", "8")]),
        (("s1_r5_force.csv", "s1_r8_force.csv", "s2_r5_force.csv"), [("r5", "5")]),
        (("s1_r5_b3.csv", "s1_r8_b4.csv"), [("r5", "5"), ("r8", "8")]),
        (("s1 ball 5mm.csv", "s2 3 mm ball.csv"), [("ball 5mm", ""), ("3 mm ball", "")]),
        (("s1 d10mm.csv", "s2 dia 16.csv", "s3.csv"), [("d10mm", "5"), ("dia 16", "8"), ("", "")]),
        (("s1_r5_force.csv", "s2_r5_force.csv"), [("", ""), ("", "")]),  # one ball for all
        (("ecoflex_r1.csv", "ecoflex_r2.csv", "ecoflex_r3.csv"), [("", "")] * 3),  # replicates
        (("sensor_d1.csv", "sensor_d7.csv"), [("", "")] * 2),  # days
    ],
)
def test_names_of_specimens_that_may_tell_balls_of_their_own_are_asked_about(
    names: tuple[str, ...], told: list[tuple[str, str]]
) -> None:
    singles = [s.presses[0] for s in pair([_found(n, FORCE) for n in names]) if len(s.presses) == 1]
    assert [(p.perhaps, p.radius) for p in singles] == told


def test_presses_with_balls_have_each_their_capacitance() -> None:
    names = [("s1_r5_force.csv", "s1_r5_lcr.csv"), ("s1_r8_force.csv", "s1_r8_lcr.csv")]
    (s1,) = pair([_found(n, columns) for pair in names for n, columns in zip(pair, (FORCE, CAPACITANCE), strict=True)])
    assert [(p.force and p.force.shown, p.capacitance and p.capacitance.shown) for p in s1.presses] == names


@pytest.mark.parametrize(
    "names", [("press_1.csv", "press_2.csv"), ("s1_press.csv", "s2_press.csv"), ("sensor_1.csv", "sensor_2.csv")]
)
def test_numbers_of_specimens_are_no_presses_of_one(names: tuple[str, str]) -> None:
    assert all(presses == [""] for presses in _sweeps(*names).values())
    assert not any(s.notes for s in pair([_found(n, FORCE) for n in names]))


def test_a_number_that_may_be_of_a_press_is_said() -> None:
    first, second = pair([_found("A_1.csv", FORCE), _found("A_2.csv", FORCE)])
    assert first.notes == ("if A_1 and A_2 are presses of one specimen, make one block of them, with [[specimens.sweeps]]",)
    assert second.notes == ()


def test_sweeps_have_each_their_capacitance() -> None:
    names = [("s1_press_1.csv", "s1_cap_1.csv"), ("s1_press_2.csv", "s1_cap_2.csv")]
    (s1,) = pair([_found(n, columns) for pair in names for n, columns in zip(pair, (FORCE, CAPACITANCE), strict=True)])
    assert [(p.force and p.force.shown, p.capacitance and p.capacitance.shown) for p in s1.presses] == names


def test_specimens_of_one_name_are_told_apart() -> None:
    def names(specimens: list[Pressed]) -> list[str]:
        return [s.name for s in specimens]

    assert names(pair([_found("a/s1.csv", FORCE), _found("b/s1.csv", FORCE)])) == ["s1", "b s1"]
    assert names(pair([_found("a/press.csv", FORCE), _found("b/press.csv", FORCE)])) == ["a", "b"]
    assert names(pair([_found("s1.csv", FORCE), _found("s1.txt", FORCE)])) == ["s1", "s1 2"]
    assert names(pair([_found("both.csv", FORCE, specimen=1), _found("both.csv", FORCE, specimen=2)])) == ["both 1", "both 2"]
    assert names(pair([_found("press.csv", FORCE)])) == ["specimen 1"]


def test_a_press_that_several_names_with_more_words_fit_says_so_and_offers_them(tmp_path: Path) -> None:
    records = [_found("s2_press.csv", FORCE), *(_found(f"s2_cap_{k}.csv", CAPACITANCE) for k in "ab")]
    specimens = pair(records)
    presses = [p for s in specimens for p in s.presses]
    assert [p.notes for p in presses] == [
        ("not paired, as s2_cap_a.csv and s2_cap_b.csv fit it alike",),
        ("not paired, as s2_press.csv fits s2_cap_b.csv as well",),
        ("not paired, as s2_press.csv fits s2_cap_a.csv as well",),
    ]
    block = experiment_text(specimens, tmp_path).split("[[specimens]]")[1]
    lines = [line for line in block.split("\n") if line.startswith("# capacitance = ")]
    assert [MARK in line and f"s2_cap_{k}.csv" in line for k, line in zip("ab", lines, strict=True)] == [True, True]


def test_what_its_numbers_contradict_is_not_offered(tmp_path: Path) -> None:
    specimens = pair([_found("s1_press_1.csv", FORCE), _found("s1_cap_2.csv", CAPACITANCE)])
    assert "# capacitance = " not in experiment_text(specimens, tmp_path)


@pytest.mark.parametrize(("hours", "marked"), [(0.1, False), (0.9, False), (1.5, True), (30.0, True)])
def test_a_pair_whose_records_began_far_apart_is_marked_to_be_decided(tmp_path: Path, hours: float, marked: bool) -> None:
    specimens = pair([_found("A_press.csv", FORCE, after=0), _found("A_cap.csv", CAPACITANCE, after=3600 * hours)])
    line = next(line for line in experiment_text(specimens, tmp_path).split("\n") if line.startswith("capacitance = "))
    assert (f"{MARK} the two began {hours:.1f} h apart" in line) is marked

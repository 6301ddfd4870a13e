"""Columns that mark rows: those that a file itself calls bad are left out, whatever the column is called."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 120
TIME = np.round(0.1 * np.arange(N), 3)
DEPTH = np.round(np.concatenate([np.linspace(0.0, 1.0, N // 2), np.linspace(1.0, 0.0, N // 2)]), 4)
FORCE = np.round(4.0 * np.clip(DEPTH - 0.15, 0, None) ** 1.5, 4)
BAD = range(40, 46)


def read(tmp_path: Path, name: str, good: str, bad: str, *, glitch: float = 1.06) -> LabTable:
    lines = [f"Time (s),Displacement (mm),Force (N),{name}"]
    for k in range(N):
        force = FORCE[k] * (glitch if k in BAD else 1.0)
        lines.append(f"{TIME[k]:.3f},{DEPTH[k]:.4f},{force:.4f},{bad if k in BAD else good}")
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_lab_file(path)


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("exclude", "no", "yes"),
        ("Excluded", "", "x"),
        ("quality", "good", "bad"),
        ("DataQuality", "Good", "Bad"),
        ("Overload", "FALSE", "TRUE"),
        ("Status", "OK", "OVER"),
        ("Status", "", "ERR"),
        ("OK", "1", "0"),
        ("ok?", "yes", "no"),
        ("Use", "y", "n"),
        ("bad", "0", "1"),
        ("skip", "", "x"),
        ("is_outlier", "False", "True"),
        ("Ausreißer", "nein", "ja"),
        ("Mask", "0", "1"),
        ("Saturated", "no", "yes"),
        ("Remark", "", "saturated"),
        ("Comment", "", "sensor clipped"),
        ("Limit", "", "OVER"),
        ("Force overload", "0", "1"),
    ],
)
def test_rows_that_a_column_of_the_file_calls_bad_are_left_out(tmp_path: Path, name: str, good: str, bad: str) -> None:
    table = read(tmp_path, name, good, bad)
    assert [k for k, why in enumerate(table.reasons) if why] == list(BAD)
    assert all(f'"{name}" says "{bad}"' in table.reasons[k] for k in BAD)
    assert not any("zero was set" in note for note in table.notes)


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("Relay", "off", "on"),
        ("Light", "0", "1"),
        ("Remark", "", "max"),
        ("Comment", "", "no overload"),
        ("Remark", "", "turn"),
        ("Status", "Loading", "Unloading"),
        ("Mode", "A", "B"),
    ],
)
def test_columns_of_something_else_take_no_rows(tmp_path: Path, name: str, good: str, bad: str) -> None:
    table = read(tmp_path, name, good, bad, glitch=1.0)
    assert not any(table.reasons)


def test_a_mark_in_most_rows_is_none(tmp_path: Path) -> None:
    table = read(tmp_path, "Mask", "1", "0", glitch=1.0)
    assert not any(table.reasons)


def of_meter(tmp_path: Path, name: str, say: Callable[[int], str]) -> LabTable:
    rows = [f"{TIME[k]:.3f},{97.0 + DEPTH[k]:.4f},{say(k)}" for k in range(N)]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join([f"Time (s),Cp (pF),{name}", *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path)


@pytest.mark.parametrize("word", ["0", "+0", "0x00", "00000000", "0x0000", "0b0000"])
def test_a_status_without_a_flag_is_a_good_one_and_one_with_a_flag_is_not(tmp_path: Path, word: str) -> None:
    assert not any(of_meter(tmp_path, "Status", lambda _: word).reasons)
    flagged = of_meter(tmp_path, "Status", lambda k: "0x04" if k in BAD else word)
    assert [k for k, why in enumerate(flagged.reasons) if why] == list(BAD)
    assert set(flagged.reasons) == {"", "LCR status 0x04"}


@pytest.mark.parametrize("name", ["STATUS", "Comp", "JUDGE"])
def test_a_comparator_says_nothing_against_the_readings_that_it_compares(tmp_path: Path, name: str) -> None:
    table = of_meter(tmp_path, name, lambda k: "HI" if k > 70 else "LO" if k < 9 else "IN")
    assert not any(table.reasons)
    noted = any("within limits that were set" in note for note in table.notes)
    assert noted == (name == "STATUS")


def test_an_error_beside_the_words_of_a_comparator_and_a_lone_high_are_no_readings(tmp_path: Path) -> None:
    failed = of_meter(tmp_path, "STATUS", lambda k: "ERR" if k in BAD else "IN")
    assert [k for k, why in enumerate(failed.reasons) if why] == list(BAD)
    high = of_meter(tmp_path, "STATUS", lambda k: "HI" if k in BAD else "OK")
    assert [k for k, why in enumerate(high.reasons) if why] == list(BAD)


def test_the_status_may_be_left_out_whatever_its_words(tmp_path: Path) -> None:
    of_meter(tmp_path, "STATUS", lambda k: "ERR" if k in BAD else "IN")
    table = read_lab_file(tmp_path / "lab.csv", Reading(columns={"status": "none"}))
    assert not any(why.startswith("LCR status") for why in table.reasons)


def test_a_column_of_inches_that_becomes_one_of_millimetres_is_still_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="another unit or range"):
        of_meter(tmp_path, "Unit of the gap", lambda k: "in" if k < 60 else "mm")

"""A channel whose sign or range changes from a row on is refused with its line; one whose zero does is not taken for that."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hostile_press import lines_of, press, texts

from calib.errors import InputError
from calib.lab import LabTable, Reading, observe, read_lab_file
from calib.lab.instruments.followed import followed
from models.sensor import FloatArray

P = press(160, seed=81)
T, X, F, C = (np.array(column, dtype=float) for column in (P.t, P.d, P.f, P.c))
ROWS = np.arange(T.size)
HEADS = ("Time (s)", "Extension (mm)", "Load (N)", "Cp (pF)")
FACTORS = (-1.0, 0.5, 1.3, 2.0)
NONE = np.zeros(0, dtype=np.int64)


def _read(folder: Path, *columns: FloatArray, reading: Reading | None = None) -> LabTable:
    path = folder / "press.csv"
    written = [texts(c, n) for c, n in zip(columns, (2, 4, 3, 3), strict=False)]
    path.write_text("\n".join(lines_of(HEADS[: len(columns)], written)[0]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


@pytest.mark.parametrize("row", [50, 65, 80])
@pytest.mark.parametrize("factor", FACTORS)
def test_a_load_that_is_multiplied_from_a_row_on_is_refused_with_its_line(tmp_path: Path, factor: float, row: int) -> None:
    with pytest.raises(InputError, match="from this line on the readings are") as caught:
        _read(tmp_path, T, X, np.where(row <= ROWS, factor * F, F), C)
    (fault,) = caught.value.faults
    assert (fault.line, fault.column) == (row + 2, 3)
    assert f"{factor:.2g} times" in fault.message


@pytest.mark.parametrize("row", [50, 65, 80])
@pytest.mark.parametrize("factor", [-1.0, 2.0])
def test_a_place_that_is_multiplied_from_a_row_on_is_refused_with_its_line(tmp_path: Path, factor: float, row: int) -> None:
    with pytest.raises(InputError, match=f"from this line on the readings are {factor:.2g} times") as caught:
        _read(tmp_path, T, np.where(row <= ROWS, factor * X, X), F, C)
    assert caught.value.faults[0].line == row + 2


def test_a_multiplied_load_is_read_if_the_user_says_its_unit_once_more(tmp_path: Path) -> None:
    doubled = np.where(ROWS >= 65, 2 * F, F)
    table = _read(tmp_path, T, X, doubled, C, reading=Reading(units={"force": "N"}))
    np.testing.assert_allclose(table.columns["force"], np.round(doubled, 3))
    assert any("2 times" in note for note in table.notes)


@pytest.mark.parametrize("row", [50, 65, 80])
@pytest.mark.parametrize("share", [-0.6, -0.2, 0.2, 0.6])
def test_a_new_zero_of_the_load_is_not_taken_for_a_multiple(tmp_path: Path, share: float, row: int) -> None:
    table = _read(tmp_path, T, X, np.where(row <= ROWS, F + share * np.max(F), F), C)
    assert not any("times" in note for note in table.notes)


@pytest.mark.parametrize("share", [-0.6, 0.3])
def test_a_new_zero_of_the_place_is_not_taken_for_a_multiple(tmp_path: Path, share: float) -> None:
    table = _read(tmp_path, T, np.where(ROWS >= 65, X + share * np.max(X), X), F, C)
    assert table.zeroed == {"displacement": (65,)}


def test_a_load_that_slips_to_a_part_beside_no_capacitance_is_told_as_open(tmp_path: Path) -> None:
    table = _read(tmp_path, T, X, np.where(ROWS >= 65, 0.7 * F, F))
    assert any("slip" in note for note in table.notes)


@pytest.mark.parametrize("rubbed", [0.9, 0.8, 0.6])
def test_a_load_that_falls_to_a_part_as_the_ball_turns_is_friction(tmp_path: Path, rubbed: float) -> None:
    down = np.linspace(0.0, 1.0, 90)
    x = np.concatenate([down, down[::-1]])
    depth = np.clip(x - 0.15, 0.0, None)
    f = np.asarray(5 * depth**1.5 * np.where(np.arange(x.size) < 90, 1.0, rubbed), dtype=float)
    noise = np.random.default_rng(5).normal(size=(2, x.size))
    table = _read(
        tmp_path, *(np.asarray(v, dtype=float) for v in (0.1 * np.arange(x.size), x, f + 0.003 * noise[0], 97 + 2 * depth**1.2))
    )
    assert not any("times" in note for note in table.notes)
    assert np.any(observe(table).used)


@pytest.mark.parametrize("noise", [0.0005, 0.002])
@pytest.mark.parametrize("i", [40, 90])
def test_curves_tell_a_multiple_from_another_zero_of_the_same_jump(noise: float, i: int) -> None:
    w = np.linspace(0.1, 1.0, 140)
    scatter = noise * np.random.default_rng(i).normal(size=w.size)
    behind = np.arange(w.size) > i
    for factor in FACTORS:
        jump = (factor - 1) * float(w[i] ** 1.5)
        multiple = followed(np.where(behind, factor, 1.0) * w**1.5 + scatter, {"displacement": w}, i, NONE)
        shifted = followed(w**1.5 + np.where(behind, jump, 0.0) + scatter, {"displacement": w}, i, NONE)
        assert multiple is not None
        assert multiple.kind == "multiple"
        assert multiple.factor == pytest.approx(factor, rel=0.05)
        assert shifted is None or shifted.kind != "multiple"


def test_a_curve_without_a_jump_is_followed_by_no_multiple() -> None:
    w = np.linspace(0.1, 1.0, 140)
    w[70:] += 0.2
    assert followed(w**1.5, {"displacement": w}, 69, NONE) is None


@pytest.mark.parametrize("power", [-9, -6, -4, 0, 4])
def test_a_jump_by_powers_of_ten_over_a_ball_that_stood_in_two_places_is_judged(power: int) -> None:
    readings = np.where(np.arange(40) < 20, 10.0**power, 1.0) * (1 + 1e-3 * np.sin(np.arange(40)))
    followed(readings, {"displacement": np.where(np.arange(40) < 18, 0.1, 0.2)}, 19, NONE)

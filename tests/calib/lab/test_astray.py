"""Rows in which one channel contradicts the others and agrees on both sides are left out; sound presses are kept."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from hostile_press import lines_of, texts

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file
from calib.lab.instruments.astray import astray
from calib.lab.instruments.labtable import IntArray
from models.sensor import FloatArray

HEADS = {"time": "Time (s)", "displacement": "Displacement (mm)", "force": "Force (N)", "capacitance": "Cp (pF)"}
DRIVES = ("smooth", "coarse", "jerky", "stairs", "hold", "load only", "pull-off", "slips", "no capacitance", "no place")


def _places(drive: str, rng: np.random.Generator) -> FloatArray:
    n = int(rng.integers(60, 200))
    down = np.linspace(0, 1, n)
    if drive == "jerky":
        steps = rng.gamma(0.4, 1, n) + 1e-3
        down = np.cumsum(steps) / np.sum(steps)
    if drive == "stairs":
        down = np.repeat(np.linspace(0, 1, int(rng.integers(6, 15))), int(rng.integers(8, 20)))
    if drive == "load only":
        return np.tile(down, 3)
    held = np.ones(60 if drive == "hold" else 0)
    return np.concatenate([down, held, down[::-1], -0.1 * np.linspace(0, 1, 20)])


def _press(drive: str, seed: int) -> dict[str, FloatArray]:
    """A sound press of random size, noise and digits, as it is written: s, mm, N, pF."""
    rng = np.random.default_rng([seed, DRIVES.index(drive)])
    place = _places(drive, rng)
    depth = np.clip(place - rng.uniform(0.05, 0.2), 0, None)
    up = np.concatenate([[False], np.diff(place) < 0])
    held = np.zeros(place.size)
    for i in range(1, place.size):
        held[i] = held[i - 1] + 1 if abs(place[i] - place[i - 1]) < 1e-6 else 0
    force = rng.uniform(1.5, 5) * depth ** rng.uniform(1.3, 2.2) * np.where(up, rng.uniform(0.8, 1), 1)
    force = force * (1 - rng.uniform(0, 0.25) * (1 - np.exp(-held / 4)))
    if drive == "pull-off":
        force -= np.where(up & (place > 0.03), 0.3 * force.max() * np.exp(-depth / 0.05), 0.0)
    if drive == "slips":
        for row in rng.integers(20, place.size - 20, 3):
            force[row:] -= 0.2 * force[row] * np.exp(-np.arange(place.size - row) / rng.uniform(3, 30))
    top, few = rng.uniform(0.4, 1.2), drive == "coarse"
    columns = {
        "time": 0.1 * np.arange(place.size, dtype=np.float64),
        "displacement": np.round(top * place + rng.normal(0, 5e-5, place.size), 2 if few else 4),
        "force": np.round(force + rng.normal(0, rng.choice([0.0005, 0.003, 0.01]), place.size), 1 if few else 4),
        "capacitance": np.round(97 + 2 * depth**1.2 + rng.normal(0, 0.0015, place.size), 2 if few else 4),
    }
    if drive in ("no capacitance", "no place"):
        del columns["capacitance" if drive == "no capacitance" else "displacement"]
    return {q: np.asarray(v, dtype=np.float64) for q, v in columns.items()}


FAULTS: Mapping[str, Callable[[FloatArray], FloatArray]] = {
    "lost": lambda y: 0 * y,
    "near zero": lambda y: np.array([0.0011 * (i % 3) - 0.0021 for i in range(y.size)]),
    "wrong sign": lambda y: -y,
    "half": lambda y: y / 2,
    "stuck elsewhere": lambda y: 0 * y + 7.0,
}


def _read(folder: Path, columns: Mapping[str, FloatArray], reading: Reading | None = None) -> LabTable:
    written = [texts(values, 4) for values in columns.values()]
    path = folder / "press.csv"
    path.write_text("\n".join(lines_of([HEADS[q] for q in columns], written)[0]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


def _pressed_rows(columns: Mapping[str, FloatArray], length: int, rng: np.random.Generator) -> IntArray:
    """Rows in succession of a load of a fifth of the range at least, all on the way in."""
    load = columns["force"]
    top = int(np.argmax(load))
    first = int(np.argmax(load > 0.2 * load[top]))
    begin = int(rng.integers(max(first, 5), max(first, 5) + 1 + max(0, top - 5 - length - max(first, 5))))
    return np.arange(begin, begin + length, dtype=np.int64)


@pytest.mark.parametrize("drive", DRIVES)
def test_nothing_is_found_in_sound_presses(drive: str) -> None:
    assert [(seed, found) for seed in range(40) if (found := astray(_press(drive, seed)))] == []


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("length", [2, 4, 5, 8, 12, 20, 30])
def test_rows_in_which_the_load_alone_is_elsewhere_are_found_and_no_others(fault: str, length: int) -> None:
    missed = 0
    drives = ("smooth", "jerky", "hold", "no capacitance", "no place", "stairs")
    for drive in drives:
        for seed in range(6):
            columns = _press(drive, seed)
            rows = _pressed_rows(columns, length, np.random.default_rng(seed))
            load = columns["force"].copy()
            load[rows] = FAULTS[fault](load[rows])
            found = [r for run in astray(columns | {"force": load}) for r in run.rows]
            missed += found == []
            assert found in ([], rows.tolist()), (drive, seed)
    # Half a load among steps that are as large tells nothing.
    assert missed <= (3 if fault == "half" else 1)


def test_a_run_is_left_out_with_its_lines_cells_and_what_is_beside_it(tmp_path: Path) -> None:
    columns = _press("smooth", 3)
    rows = _pressed_rows(columns, 6, np.random.default_rng(3))
    load = columns["force"].copy()
    load[rows] = 0
    table = _read(tmp_path, columns | {"force": load})
    assert [r for r, why in enumerate(table.reasons) if why] == rows.tolist()
    for word in (f"lines {rows[0] + 2} to {rows[-1] + 2}", '"0.0000"', f"{load[rows[0] - 1]:.4g} N", "capacitance"):
        assert word in table.reasons[rows[0]]
    assert not any(_read(tmp_path, columns | {"force": load}, Reading(units={"force": "N"})).reasons)


def test_a_load_that_is_lost_again_and_again_is_refused(tmp_path: Path) -> None:
    columns = _press("smooth", 3)
    load = columns["force"].copy()
    pressed = np.flatnonzero(load > 0.03 * np.max(load))
    load[pressed[pressed // 8 % 2 == 0]] = 0
    with pytest.raises(InputError, match="contradicts displacement and capacitance in"):
        _read(tmp_path, columns | {"force": load})


@pytest.mark.parametrize("length", [1, 2, 3, 4, 8, 20])
@pytest.mark.parametrize("pair", [("displacement", "force"), ("time", "displacement")])
def test_rows_whose_cells_changed_places_are_left_out(tmp_path: Path, length: int, pair: tuple[str, str]) -> None:
    for seed in range(3):
        columns = _press("smooth", seed)
        rows = _pressed_rows(columns, length, np.random.default_rng(seed))
        one, other = (columns[q].copy() for q in pair)
        one[rows], other[rows] = other[rows].copy(), one[rows].copy()
        table = _read(tmp_path, columns | {pair[0]: one, pair[1]: other})
        assert [r for r, why in enumerate(table.reasons) if why] == rows.tolist()
        assert "changed places" in table.reasons[rows[0]]


@pytest.mark.parametrize(
    ("every", "quantity"),
    [(2, "capacitance"), (3, "capacitance"), (4, "capacitance"), (8, "capacitance"), (20, "capacitance"), (8, "force")],
)
def test_a_channel_that_repeats_its_readings_is_told(tmp_path: Path, every: int, quantity: str) -> None:
    columns = _press("smooth", 4)
    rows = np.arange(columns["time"].size)
    table = _read(tmp_path, columns | {quantity: columns[quantity][rows // every * every]})
    assert not any(table.reasons)
    assert any(f'"{HEADS[quantity]}" is read anew in about every {every}. row' in note for note in table.notes)


@pytest.mark.parametrize("drive", DRIVES)
def test_a_coarse_channel_and_one_at_rest_are_not_told_as_repeated(tmp_path: Path, drive: str) -> None:
    said = Reading(sign=dict.fromkeys(("force", "displacement"), "compression positive"))
    for seed in range(3):
        for digits in (1, 2, 3):
            columns = {q: v if q == "time" else np.round(v, digits) for q, v in _press(drive, seed).items()}
            path = tmp_path / f"{seed}_{digits}"
            path.mkdir()
            try:
                notes = _read(path, columns, said).notes
            except InputError:
                continue
            assert not any("read anew" in note for note in notes)

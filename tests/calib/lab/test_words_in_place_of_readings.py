"""A column of words under the name of a quantity is no reading: it tells records apart, names phases, or is named as unread."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 60
TIME = np.arange(N) * 0.1
DEPTH = np.concatenate([np.linspace(0.0, 1.0, 36), np.linspace(1.0, 0.02, 24)])
FORCE = 5.0 * np.clip(DEPTH - 0.1, 0.0, None) ** 1.5 + 0.002 * np.sin(37.0 * np.arange(N))
PRESS = [(f"{t:.2f}", f"{d:.4f}", f) for t, d, f in zip(TIME, DEPTH, FORCE, strict=True)]


def _read(folder: Path, name: str, rows: list[str], reading: Reading | None = None) -> LabTable:
    path = folder / "lab.csv"
    path.write_text("\n".join([f"Time (s),Displacement (mm),Force (N),{name}", *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


@pytest.mark.parametrize(
    "name", ["Pos", "Position", "Location", "Axis", "Weg", "Load", "C", "Cp", "Depth", "Force 2", "Crosshead", "Stage"]
)
@pytest.mark.parametrize("in_turn", [True, False])
def test_two_places_are_asked_for_in_one_go(tmp_path: Path, name: str, in_turn: bool) -> None:
    rows = [f"{t},{d},{f * k:.4f},{word}" for t, d, f in PRESS for word, k in (("left", 1.0), ("right", 1.3))]
    rows = rows if in_turn else sorted(rows, key=lambda row: row.endswith("right"))
    with pytest.raises(InputError) as caught:
        _read(tmp_path, name, rows)
    asked = f"{name}=left" if " " not in name else f'"{name}=left"'
    assert f"--where {asked}" in str(caught.value)
    table = _read(tmp_path, name, rows, Reading(where={name: "left"}))
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)
    np.testing.assert_allclose(table.columns["displacement"], 1e-3 * DEPTH, atol=1e-7)


@pytest.mark.parametrize(("name", "quantity"), [("Pos", "displacement"), ("Position", "displacement"), ("Load", "force")])
def test_one_word_and_the_ways_of_the_ball_are_told_and_not_read(tmp_path: Path, name: str, quantity: str) -> None:
    for words in (["left"] * N, ["down"] * 36 + ["up"] * 24):
        table = _read(tmp_path, name, [f"{t},{d},{f:.4f},{w}" for (t, d, f), w in zip(PRESS, words, strict=True)])
        np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)
        assert any(u.reason.startswith(f"holds words, no {quantity}") for u in table.unread)


def test_words_among_numbers_are_refused_as_before(tmp_path: Path) -> None:
    rows = [f"{t},{d},{f:.4f},{'lost' if t == '2.00' else 97 + f:}" for t, d, f in PRESS]
    with pytest.raises(InputError, match=r'"lost" in column "Cp .pF." is not a number'):
        _read(tmp_path, "Cp (pF)", rows)


def test_words_under_a_name_with_a_unit_are_refused_by_themselves(tmp_path: Path) -> None:
    rows = [f"{t},{d},{f:.4f},bad" for t, d, f in PRESS]
    with pytest.raises(InputError, match=r'"bad" in column "Cp .pF." is not a number'):
        _read(tmp_path, "Cp (pF)", rows)

"""Lines above the rows that say what X and Y are, or in which units the values that lines name are, are read as that."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, read_lab_file

N = 40
DEPTH = [round(0.011 * i, 4) for i in range(N)]
FORCE = [round(0.0021 * i * i, 4) for i in range(N)]
CAP = [round(97.301 + 0.0137 * i * i, 4) for i in range(N)]


def read(folder: Path, *lines: str) -> LabTable:
    path = folder / "lab.txt"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_lab_file(path)


def pairs(names: tuple[str, ...] = ("t", "d", "F", "C"), mark: str = "=", sep: str = " ") -> list[str]:
    rows = ((f"{0.1 * i:.1f}", x, f, c) for i, (x, f, c) in enumerate(zip(DEPTH, FORCE, CAP, strict=True)))
    return [sep.join(f"{name}{mark}{value}" for name, value in zip(names, row, strict=True)) for row in rows]


def is_right(table: LabTable) -> None:
    np.testing.assert_allclose(table.columns["time"], 0.1 * np.arange(N), atol=1e-9)
    np.testing.assert_allclose(table.columns["displacement"], np.array(DEPTH) * 1e-3, atol=1e-9)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-9)


@pytest.mark.parametrize(
    "line",
    [
        "# units: t s, d mm, F N, C pF",
        "# t in s; d in mm; F in N; C in pF",
        "t[s] d[mm] F[N] C[pF]",
        "Units = t: s, d: mm, F: N, C: pF",
        "% Einheiten: t (s), d (mm), F (N), C (pF).",
    ],
)
@pytest.mark.parametrize(("mark", "sep"), [("=", " "), ("=", ";"), (":", ", ")])
def test_a_line_of_units_above_lines_that_name_their_values_gives_them(tmp_path: Path, line: str, mark: str, sep: str) -> None:
    table = read(tmp_path, line, *pairs(mark=mark, sep=sep))
    is_right(table)
    np.testing.assert_allclose(table.columns["capacitance"], np.array(CAP) * 1e-12, atol=1e-17)
    assert any("line 1 says their units" in note for note in table.notes)


@pytest.mark.parametrize(
    "above",
    [
        ("# units: t s, d mm, F N, C pF", "# units: t s, d um, F N, C pF"),
        ("# units: t s, d mm, F N, C quux",),
        ("# units: t s, d mm, f N, c pF",),
        ("# operator Max, rig 3",),
    ],
)
def test_two_lines_of_units_or_others_give_none(tmp_path: Path, above: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match=r"no unit|may be a dissipation"):
        read(tmp_path, *above, *pairs())


def test_a_line_of_many_words_takes_no_time(tmp_path: Path) -> None:
    begun = time.perf_counter()
    with pytest.raises(InputError):
        read(tmp_path, "# " + "a in " * 38 + "!", *pairs())
    assert time.perf_counter() - begun < 3.0


@pytest.mark.parametrize(
    ("above", "names"),
    [
        (["Kanal X;Weg", "Kanal Y;Kraft"], "Zeit [s];X [mm];Y [N]"),
        (["Channel Y;Force", "Channel X;Displacement", "Program;7"], "Time (s);X (mm);Y (N)"),
        (["# Axis X: Weg [mm]", "# Axis Y: Kraft [N]"], "Zeit [s];X;Y"),
        (["Kanal X;Weg", "Kanal Y;Kraft"], "Zeit;X;Y\ns;mm;N"),
    ],
)
def test_channels_x_and_y_have_the_names_that_a_list_above_gives_them(tmp_path: Path, above: list[str], names: str) -> None:
    rows = [f"{0.1 * i:.1f};{x};{f}" for i, (x, f) in enumerate(zip(DEPTH, FORCE, strict=True))]
    table = read(tmp_path, *above, *names.split("\n"), *rows)
    is_right(table)
    assert any("X and Y are named" in note for note in table.notes)


@pytest.mark.parametrize(
    "above",
    [
        ["Kanal X;Weg"],
        ["Kanal X;Weg", "Kanal Y;Kraft", "Kanal X;Zeit"],
        ["Kanal X;Weg", "Kanal Y;Quux"],
        ["Kanal X;Kraft", "Kanal Y;Weg"],
    ],
)
def test_a_list_of_one_of_them_or_that_their_units_contradict_names_none(tmp_path: Path, above: list[str]) -> None:
    rows = [f"{0.1 * i:.1f};{x};{f}" for i, (x, f) in enumerate(zip(DEPTH, FORCE, strict=True))]
    with pytest.raises(InputError):
        read(tmp_path, *above, "Zeit [s];X [mm];Y [N]", *rows)

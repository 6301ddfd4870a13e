"""Numbers in ways of their own, `'0.5`, `9.7×10^-11`, `0·0111`, are read where a whole column is written so, with a note."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import Reading, read_lab_file

N = 40
DEPTH = [1e-5 * i for i in range(N)]
FORCE = [-0.0092 + 0.0005 * i * i for i in range(N)]


def written(folder: Path, cell: Callable[[int, float], str], sep: str = ";") -> Path:
    path = folder / "lab.csv"
    rows = [sep.join((f"{i * 0.1:.1f}", f"{x:.5f}", cell(i, f))) for i, (x, f) in enumerate(zip(DEPTH, FORCE, strict=True))]
    path.write_text("\n".join([sep.join(("Time (s)", "Displacement (m)", "Force (N)")), *rows]) + "\n", encoding="utf-8")
    return path


def power_of_ten(f: float, times: str) -> str:
    mantissa, exponent = f"{f:.5e}".split("e")
    return f"{mantissa}{times}{int(exponent)}"


def raised(cell: str) -> str:
    plain, exponent = cell.split("^")
    return plain + exponent.translate(str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻"))


@pytest.mark.parametrize(
    "cell",
    [
        lambda f: f"'{f:.4f}",
        lambda f: f"\u2019{f:.4f}",
        lambda f: f"'{f:.4f}" if f < 0 else f"{f:.4f}",
        lambda f: power_of_ten(f, "×10^"),
        lambda f: power_of_ten(f, "*10^"),
        lambda f: power_of_ten(f, " x 10**"),
        lambda f: raised(power_of_ten(f, "×10^")),
        lambda f: raised(power_of_ten(f, " · 10^")),
        lambda f: power_of_ten(f, "·10^"),
        lambda f: f"{f:.5e}".replace("e", " E"),
        lambda f: f"{f:.4f}".replace(".", "·"),
        lambda f: f"{f:.4f}".replace("-", "- "),
    ],
)
def test_a_column_of_numbers_in_a_way_of_its_own_is_read_with_a_note(tmp_path: Path, cell: Callable[[float], str]) -> None:
    table = read_lab_file(written(tmp_path, lambda _, f: cell(f)))
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)
    assert any("is read as" in note and "so are all such cells" in note for note in table.notes)


@pytest.mark.parametrize("odd", ["'0.0·5", "0·5·1", "1.2×10", "1.2×12^3", "1.2×10⁻⁻³", "- - 0.5", "0.5 E", "'", "5 E3"])
def test_a_cell_of_another_kind_among_them_is_no_number(tmp_path: Path, odd: str) -> None:
    path = written(tmp_path, lambda i, f: odd if i == 20 else f"'{f:.4f}")
    with pytest.raises(InputError, match="is not a number"):
        read_lab_file(path)


@pytest.mark.parametrize("cell", ["9.7 E-11", "9.7×10^-11", "0·0111"])
def test_one_cell_so_written_may_be_damage_and_is_not_read(tmp_path: Path, cell: str) -> None:
    with pytest.raises(InputError, match="is not a number"):
        read_lab_file(written(tmp_path, lambda i, f: cell if i == 20 else f"{f:.4f}"))


def test_a_middle_dot_before_three_digits_leaves_open_what_a_point_there_does(tmp_path: Path) -> None:
    path = tmp_path / "lab.csv"
    rows = [f"{i};97·{301 + i * i // 2:03}" for i in range(N - 10)]
    path.write_text("\n".join(["Time (s);Cp (pF)", *rows]) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match="decimal mark cannot be told"):
        read_lab_file(path)
    assert read_lab_file(path, Reading(decimal=".")).columns["capacitance"][0] == pytest.approx(97.301e-12)


@pytest.mark.parametrize("minus", [lambda x: f"({-x:.5f})", lambda x: f"{-x:.5f}-"])
def test_a_way_of_writing_a_minus_in_one_column_is_no_damage_in_another(tmp_path: Path, minus: Callable[[float], str]) -> None:
    def cell(x: float) -> str:
        return minus(x) if x < 0 else f"{x:.5f}"

    depth = [-1e-5, *DEPTH[1:]]
    rows = [f"{i * 0.1:.1f};{cell(x)};{cell(f)}" for i, (x, f) in enumerate(zip(depth, FORCE, strict=True))]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["Time (s);Displacement (m);Force (N)", *rows]) + "\n", encoding="utf-8")
    table = read_lab_file(path)
    np.testing.assert_allclose(table.columns["displacement"], depth, atol=1e-9)
    np.testing.assert_allclose(table.columns["force"], FORCE, atol=1e-4)
    path.write_text(path.read_text(encoding="utf-8").replace(";0.00005;", ";-0.00005;"), encoding="utf-8")
    with pytest.raises(InputError, match="is not a number"):
        read_lab_file(path)  # a minus in front beside it: one of the two may be damage


def test_a_zero_with_a_minus_in_front_is_no_other_way_of_writing_it(tmp_path: Path) -> None:
    cells = ["0.0030-", "0.0024-", "0.0002-", "-0.0000", *(f"{abs(f):.4f}" for f in FORCE[4:])]
    rows = [f"{i * 0.1:.1f},{x:.5f},{f}" for i, (x, f) in enumerate(zip(DEPTH, cells, strict=True))]
    path = tmp_path / "lab.csv"
    path.write_text("\n".join(["Time (s),Displacement (m),Force (N)", *rows]) + "\n", encoding="utf-8")
    np.testing.assert_allclose(read_lab_file(path).columns["force"][:4], [-0.003, -0.0024, -0.0002, 0.0], atol=1e-9)

"""A sign convention in a line beside the table: used where the record leaves the sign open, told where it says the opposite."""

from __future__ import annotations

from pathlib import Path

import pytest

from calib.errors import InputError
from calib.lab import Observations, observe, read_lab_file

N = 120


def press(folder: Path, above: str, force: str = "Force (N)", sign: int = 1, below: str = "") -> Observations:
    """A press and the way back, with a flat beginning: the record shows its signs."""
    rows = [*([above] if above else []), f"Time (s),Displacement (mm),{force}"]
    for i in range(N):
        x = 0.015 * min(i, N - 1 - i)
        rows.append(f"{0.1 * i:.2f},{x:.4f},{sign * 1.5 * max(0.0, x - 0.15) ** 1.5 + 0.0004 * (-1) ** i:.4f}")
    return observed(folder, [*rows, *([below] if below else [])])


def retreat(folder: Path, above: str) -> Observations:
    """The way back alone, zeroed where the ball was deepest: nothing in the record says which way compression is."""
    rows = [*([above] if above else []), "Time (s),Displacement (mm),Force (N)"]
    for i in range(N):
        x = 0.85 - 0.008 * i
        rows.append(f"{0.1 * i:.2f},{x - 0.85:.4f},{4.9 * max(0.0, x) ** 1.5 + 0.001 * (-1) ** i:.4f}")
    return observed(folder, rows)


def observed(folder: Path, rows: list[str]) -> Observations:
    path = folder / "lab.csv"
    path.write_text("\n".join(rows) + "\n")
    return observe(read_lab_file(path))


@pytest.mark.parametrize(
    "line",
    [
        "# Sign convention: compression negative",
        "# tension is positive",
        "# Force: push -ve, Displacement: push +ve",
        "# Load, compression negative",
    ],
)
def test_a_line_that_says_the_opposite_of_the_record_is_told(tmp_path: Path, line: str) -> None:
    plain, said = press(tmp_path, ""), press(tmp_path, line)
    assert said.signs["force"].factor == plain.signs["force"].factor == 1.0
    assert f'the file says the opposite: line 1 says "{line}"' in said.signs["force"].note
    assert "the opposite" not in said.signs["displacement"].note
    assert "the opposite" not in plain.signs["force"].note


def test_a_line_below_the_rows_and_a_name_are_told_too(tmp_path: Path) -> None:
    assert "the file says the opposite: line" in press(tmp_path, "", below="# compression negative").signs["force"].note
    named = press(tmp_path, "", force="Force (N, tension positive)").signs["force"]
    assert 'the file says the opposite: the column is called "Force (N, tension positive)"' in named.note


@pytest.mark.parametrize(
    ("line", "sign"),
    [
        ("# Sign convention: compression positive", 1),
        ("# Sign convention: compression negative", -1),
        ("# Compression - 5 mm ball", 1),  # no sign
        ("# Displacement, compression positive", 1),
        ("# force: compression negative; load cell 2: compression positive", 1),  # both are said of the force
    ],
)
def test_a_line_that_says_what_the_record_shows_changes_nothing(tmp_path: Path, line: str, sign: int) -> None:
    plain, said = press(tmp_path, "", sign=sign), press(tmp_path, line, sign=sign)
    assert said.signs == plain.signs
    assert said.signs["force"].factor == sign


def test_a_line_decides_where_the_record_does_not(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be told which way compression is"):
        retreat(tmp_path, "")
    for line in ("# Sign convention: compression positive (force and displacement)", "# tension negative"):
        said = retreat(tmp_path, line)
        assert said.signs["force"].factor == said.signs["displacement"].factor == 1.0
        assert said.signs["force"].note.count(f'line 1 says "{line}"') == 1


def test_a_line_is_heard_where_the_record_may_start_pressed(tmp_path: Path) -> None:
    # A press onto a plateau, or a lift from a press in which load and place were zeroed.
    rows = ["Time (s),Displacement (mm),Force (N)"]
    for i in range(N):
        x = 0.8 * min(i, N - 1 - i) / (N / 2)
        rows.append(f"{0.1 * i:.2f},{x:.4f},{3.2 * (1 - max(0.0, 1 - x / 0.55) ** 1.6) + 0.003 * (-1) ** i:.4f}")
    with pytest.raises(InputError, match="cannot be told which way compression is"):
        observed(tmp_path, rows)
    found = observed(tmp_path, ["# Force: compression positive", *rows]).signs
    assert found["force"].factor == found["displacement"].factor == 1.0
    assert 'line 1 says "# Force: compression positive"' in found["force"].note
    with pytest.raises(InputError, match='for it: line 1 says "# Force: compression negative"'):
        observed(tmp_path, ["# Force: compression negative", *rows])

"""Rows of one of several specimens in one table: what is read, observed and judged is what a file of them alone gives."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from calib.lab import Observations, Reading, observe, read_lab_file
from calib.lab.quality import judge

N = 90
NAMES = "Specimen,Time (s),Displacement (mm),Force (N),Cp (pF),D"


def _press(kind: str, seed: int) -> list[str]:
    """Rows of a press that goes there and back, rests in between, or comes in cycles; one cell of it is empty, one damaged."""
    rng = np.random.default_rng(seed)
    third, half = np.linspace(-0.1, 0.8, N // 3), np.linspace(-0.1, 0.8, N // 2)
    way = {
        "to and fro": np.concatenate([half, half[::-1]]),
        "hold": np.concatenate([third, np.full(N // 3, 0.8), third[::-1]]),
        "cycles": 0.35 - 0.45 * np.cos(np.arange(N) / N * 4 * np.pi),
    }[kind] + rng.normal(0, 2e-4, N)
    force = (2 + 0.2 * seed) * np.maximum(way, 0) ** 1.5 + rng.normal(0, 2e-3, N)
    capacitance = 97 + 2 * np.maximum(way, 0) ** 1.4 + rng.normal(0, 3e-3, N)
    cells = [[f"{0.1 * k:.1f}", f"{way[k]:.4f}", f"{force[k]:.4f}", f"{capacitance[k]:.3f}", "0.0021"] for k in range(N)]
    cells[20 + seed][2] = ""
    cells[30 + seed][3] = "9.9E37"
    return [",".join(row) for row in cells]


def _below(rows: list[list[str]]) -> list[str]:
    return [row for press in rows for row in press]


def _in_turn(rows: list[list[str]]) -> list[str]:
    return [row for together in zip(*rows, strict=True) for row in together]


def _in_pieces(rows: list[list[str]]) -> list[str]:
    return [row for begin in range(0, N, 15) for press in rows for row in press[begin : begin + 15]]


def _seen(path: Path, reading: Reading) -> Observations:
    return observe(read_lab_file(path, reading))


@pytest.mark.parametrize("kind", ["to and fro", "hold", "cycles"])
@pytest.mark.parametrize("laid", [_below, _in_turn, _in_pieces])
def test_each_of_three_specimens_is_observed_and_judged_as_in_a_file_of_its_own(
    tmp_path: Path, kind: str, laid: Callable[[list[list[str]]], list[str]]
) -> None:
    presses = [[f"{name},{row}" for row in _press(kind, seed)] for seed, name in enumerate("ABC")]
    path, alone = tmp_path / "all.csv", tmp_path / "alone.csv"
    path.write_text("\n".join([NAMES, *laid(presses)]) + "\n")
    for name, press in zip("ABC", presses, strict=True):
        alone.write_text("\n".join([NAMES, *press]) + "\n")
        own, seen = _seen(alone, Reading()), _seen(path, Reading(where={"Specimen": name}))
        assert int(seen.used.sum()) > N // 6
        for quantity, values in own.table.columns.items():
            np.testing.assert_array_equal(seen.table.columns[quantity], values)
        for one, other in ((seen.used, own.used), (seen.loading, own.loading), (seen.cycle, own.cycle)):
            np.testing.assert_array_equal(one, other)
        assert (seen.branch, seen.reason, seen.sign_note) == (own.branch, own.reason, own.sign_note)
        assert seen.table.notes == (f'only rows whose "Specimen" is "{name}" are read: {N} of {3 * N}', *own.table.notes)
        assert [replace(grade, file="") for grade in judge(seen)] == [replace(grade, file="") for grade in judge(own)]


@pytest.mark.parametrize("laid", [_below, _in_turn])
def test_rows_that_are_not_asked_for_are_named_with_what_they_hold(
    tmp_path: Path, laid: Callable[[list[list[str]]], list[str]]
) -> None:
    presses = [[f"{name},{row}" for row in _press("hold", seed)] for seed, name in enumerate("ABC")]
    (tmp_path / "all.csv").write_text("\n".join([NAMES, *laid(presses)]) + "\n")
    table = read_lab_file(tmp_path / "all.csv", Reading(where={"Specimen": "B"}))
    assert [u.reason for u in table.unread if "row(s)" in u.what] == ['not asked for: "Specimen" is "A", "C"']
    lines = np.array([line.split(",")[0] for line in (tmp_path / "all.csv").read_text().splitlines()])
    assert table.lines.tolist() == (1 + np.flatnonzero(lines == "B")).tolist()

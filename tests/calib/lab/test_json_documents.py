"""JSON of every layout that programs write: read to the truth, with what is missing left empty, or refused with the line."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 80
TIME = np.round(np.arange(N) * 0.1, 3)
DEPTH = np.round(1.2 * (1 - np.abs(2 * np.arange(N) / (N - 1) - 1)), 4)
FORCE = np.round(np.maximum(DEPTH - 0.2, 0) ** 1.5 + 0.003 * np.cos(7.0 * np.arange(N)), 4)
PRESS = pd.DataFrame({"t_s": TIME, "x_mm": DEPTH, "F_N": FORCE})
PLAIN = {"t": TIME.tolist(), "x": DEPTH.tolist(), "F": FORCE.tolist()}


def read(tmp_path: Path, text: str, **said: Any) -> LabTable:
    path = tmp_path / "press.json"
    path.write_text(text, encoding="utf-8")
    return read_lab_file(path, Reading(**said))


def is_press(table: LabTable, rows: slice = slice(None)) -> None:
    np.testing.assert_allclose(table.columns["time"], TIME[rows], atol=1e-9)
    np.testing.assert_allclose(table.columns["displacement"], DEPTH[rows] * 1e-3, atol=1e-12)
    np.testing.assert_allclose(table.columns["force"], FORCE[rows], atol=1e-12)


@pytest.mark.parametrize("orient", ["records", "columns", "index", "split", "table", "values"])
@pytest.mark.parametrize("indent", [0, 2])
def test_what_pandas_writes_is_read(tmp_path: Path, orient: Any, indent: int) -> None:
    text = PRESS.to_json(orient=orient, indent=indent)
    if orient != "values":
        table = read(tmp_path, text)
        is_press(table)
        assert not any("properties" in note for note in table.notes)  # the readings are none
        return
    columns, units = {"time": "1", "displacement": "2", "force": "3"}, {"time": "s", "displacement": "mm", "force": "N"}
    is_press(read(tmp_path, text, columns=columns, units=units))


LAYOUTS: dict[str, Callable[[], Any]] = {
    "units beside the lists": lambda: {"units": {"t": "s", "x": "mm", "F": "N"}, **PLAIN},
    "units above the lists": lambda: {"sample": "A", "units": {"t": "s", "x": "mm", "F": "N"}, "data": PLAIN},
    "units above the objects": lambda: {
        "units": {"t": "s", "x": "mm", "F": "N"},
        "data": [dict(zip("txF", row, strict=True)) for row in zip(*PLAIN.values(), strict=True)],
    },
    "a unit beside each list": lambda: {
        name: {"unit": unit, "values": values}
        for name, unit, values in zip(("time", "displacement", "force"), ("s", "mm", "N"), PLAIN.values(), strict=True)
    },
    "channels": lambda: {
        "rig": "press 2",
        "channels": [
            {"name": name, "unit": unit, "data": values}
            for name, unit, values in zip(("Time", "Displacement", "Force"), ("s", "mm", "N"), PLAIN.values(), strict=True)
        ],
    },
    "a value and a unit in each cell": lambda: [
        {"time": t, "force": {"value": f, "unit": "N"}, "displacement": {"value": x, "unit": "mm"}, "unit": ""}
        for t, x, f in zip(*PLAIN.values(), strict=True)
    ],
    "rows below their names": lambda: [list(PRESS), *PRESS.to_numpy().tolist()],
}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("indent", [None, 1])
def test_units_are_taken_from_where_they_stand(tmp_path: Path, layout: str, indent: int | None) -> None:
    said = {"units": {"time": "s"}} if layout == "a value and a unit in each cell" else {}
    is_press(read(tmp_path, json.dumps(LAYOUTS[layout](), indent=indent), **said))


def lines(change: Callable[[int, dict[str, float]], dict[str, Any]]) -> str:
    rows = [dict(zip(map(str, PRESS), row, strict=True)) for row in PRESS.itertuples(index=False, name=None)]
    return "\n".join(json.dumps(change(k, row)) for k, row in enumerate(rows)) + "\n"


def test_objects_in_lines_are_read_by_their_keys_in_any_order(tmp_path: Path) -> None:
    is_press(read(tmp_path, lines(lambda k, row: dict(reversed(row.items())) if k % 2 else row)))


def test_an_object_without_a_key_is_a_row_with_an_empty_cell(tmp_path: Path) -> None:
    table = read(tmp_path, lines(lambda k, row: row | ({} if k % 5 else {"C_pF": 97.0 + 0.01 * k})))
    is_press(table)
    assert np.array_equal(np.flatnonzero(np.isfinite(table.columns["capacitance"])), np.arange(0, N, 5))
    table = read(tmp_path, lines(lambda k, row: {q: v for q, v in row.items() if k not in (7, 8) or q != "F_N"}))
    assert np.array_equal(np.flatnonzero(np.isnan(table.columns["force"])), [7, 8])


def test_a_line_that_is_cut_off_is_refused_with_its_number(tmp_path: Path) -> None:
    whole = lines(lambda k, row: dict(reversed(row.items())) if k % 2 else row).splitlines()
    with pytest.raises(InputError, match=r"press\.json:41:1: .* is no object of JSON") as refused:
        read(tmp_path, "\n".join([*whole[:40], whole[40][:11], *whole[41:]]))
    assert "take it out of the file" in str(refused.value)


def test_of_two_tables_one_is_chosen_by_the_name_of_its_key(tmp_path: Path) -> None:
    half = {key: values[: N // 2] for key, values in PRESS.to_dict("list").items()}
    text = json.dumps({"first": half, "second": PRESS.to_dict("list")})
    with pytest.raises(InputError, match=r"first.*second"):
        read(tmp_path, text)
    is_press(read(tmp_path, text, sheet="second"))


@pytest.mark.parametrize("text", ["{}", "[]", "[{}]", '{"t": 1}', "[[1, 2], [3]]", '{"a": "b"}', "[" * 3000, '{"t": [1, 2'])
def test_what_holds_no_table_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError):
        read(tmp_path, text)

"""What shows that the rows of a record are not in the order in which they were read, and that rows in order are read."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from turning_press import DIGITS, HEADS
from uneven_presses import DRIVES, uneven

from calib.errors import InputError
from calib.lab import LabTable, Reading, observe, read_lab_file
from calib.lab.quality import judge
from models.sensor import FloatArray

SORTED = "the rows are in the order of column .* mixes loading with unloading"


def _press(n: int = 150, hold: int = 0, cycles: int = 1, noise: float = 0.002, gap: float = 0.013) -> dict[str, FloatArray]:
    """A press there and back, of which the load on the way back is lower by up to `gap` [N], and the capacitance as well."""
    rng = np.random.default_rng(1)
    down = np.linspace(0, 0.88, n)
    place = np.tile(np.concatenate([down, np.full(hold, down[-1]), down[::-1]]), cycles)
    back = np.tile(np.concatenate([np.zeros(n + hold), np.ones(n)]), cycles)
    depth = np.clip(place - 0.08, 0, None) / 0.8
    lower = back * 4 * depth * (1 - depth)
    force = 0.86 * depth**1.5 - gap * lower + rng.normal(0.004, noise, place.size)
    capacitance = 97 + 1.9 * depth**1.2 - 2 * gap * lower + rng.normal(0, 0.001, place.size)
    columns = {"displacement": place, "force": force, "capacitance": capacitance}
    return {q: np.round(v, DIGITS[q]) for q, v in columns.items()}


def _timed(**shape: Any) -> dict[str, FloatArray]:
    """The same with a time in front."""
    columns = _press(**shape)
    return {"time": 0.05 * np.arange(columns["force"].size, dtype=np.float64), **columns}


def _read(folder: Path, columns: Mapping[str, npt.NDArray[Any]], reading: Reading | None = None) -> LabTable:
    path = folder / "press.csv"
    rows = [",".join(f"{v[i]:.{DIGITS[q]}f}" for q, v in columns.items()) for i in range(len(next(iter(columns.values()))))]
    path.write_text("\n".join([",".join(HEADS[q] for q in columns), *rows]) + "\n", encoding="utf-8")
    return read_lab_file(path, reading or Reading())


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("shape", [{}, {"hold": 40}, {"cycles": 3}, {"noise": 0.0005}, {"noise": 0.004}, {"gap": 0.1}])
@pytest.mark.parametrize("by", ["displacement", "force", "capacitance"])
def test_rows_without_a_clock_that_were_sorted_are_refused(
    tmp_path: Path, by: str, shape: dict[str, Any], backwards: bool
) -> None:
    columns = _press(**shape)
    order = np.argsort(-columns[by] if backwards else columns[by], kind="stable")
    with pytest.raises(InputError, match=SORTED):
        _read(tmp_path, {q: v[order] for q, v in columns.items()})


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("shape", [{}, {"hold": 40}, {"cycles": 3}, {"noise": 0.0005}, {"noise": 0.004}, {"gap": 0.1}])
@pytest.mark.parametrize("by", ["displacement", "force", "capacitance"])
def test_rows_that_were_sorted_without_their_clock_are_refused(
    tmp_path: Path, by: str, shape: dict[str, Any], backwards: bool
) -> None:
    columns = _timed(**shape)
    order = np.argsort(-columns[by] if backwards else columns[by], kind="stable")
    sorted_so = {q: v if q == "time" else v[order] for q, v in columns.items()}
    with pytest.raises(InputError, match="as if they were sorted, and the time was not sorted with them") as caught:
        _read(tmp_path, sorted_so)
    quantity, unit = caught.value.faults[0].advice.rpartition("--units ")[2].split("=")
    table, said = None, ""
    try:
        table = _read(tmp_path, sorted_so, Reading(units={quantity: unit}))
    except InputError as other:
        said = other.faults[0].message
    if table is None:
        assert "two levels" in said
    else:
        assert np.mean(table.columns["force"] == sorted_so["force"]) > 0.9


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("rows_a_step", [1, 2, 6, 25])
def test_steps_in_which_the_load_relaxes_are_no_sorted_rows(tmp_path: Path, rows_a_step: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    steps = np.linspace(0, 1, 30 + seed)
    place, held = np.repeat(steps, rows_a_step), np.tile(np.arange(rows_a_step), steps.size)
    depth = np.clip(place - 0.1, 0, None)
    leap = np.repeat(np.diff(2 * np.clip(steps - 0.1, 0, None) ** 1.5, prepend=0.0), rows_a_step)
    force = 2 * depth**1.5 * (0.95 + 0.05 * np.exp(-held / 1.5)) + 0.3 * leap * np.exp(-held / 1.5)
    columns = {
        "time": 0.2 * np.arange(place.size),
        "displacement": place,
        "force": force + rng.normal(0, 0.002, place.size),
        "capacitance": 97 + 1.5 * depth**1.2 + rng.normal(0, 0.001, place.size),
    }
    assert np.isfinite(_read(tmp_path, columns).columns["force"]).all()


@pytest.mark.parametrize("seed", range(4))
def test_scatter_that_grows_with_the_load_or_of_a_ball_that_is_driven_by_it_is_no_sorting(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = 120 + 40 * seed
    place = np.sort(np.linspace(0, 1, n) + rng.normal(0, 1.5 / n, n))
    load = 2 * np.clip(place - 0.1, 0, None) ** 1.5
    driven = np.round(np.linspace(0, 3, n), 3)
    hunting = 0.1 + (driven / 2) ** (2 / 3) + rng.normal(0, 0.003, n) * (driven > 0.3)
    slips = load * (1 + 0.1 * ((np.arange(n) % 10) / 10 - 0.5))
    presses = ((place, load * (1 + rng.normal(0, 0.02, n)) + rng.normal(0, 0.002, n)), (hunting, driven), (place, slips))
    for at, force in presses:
        table = _read(tmp_path, {"time": 0.1 * np.arange(n), "displacement": at, "force": force})
        assert np.isfinite(table.columns["force"]).all()


@pytest.mark.parametrize("drive", DRIVES)
def test_rows_in_order_with_their_clock_are_read(tmp_path: Path, drive: str) -> None:
    for seed in range(6):
        columns = uneven(drive, seed).columns
        top = int(np.argmax(np.abs(columns["displacement"]))) + 1
        for rows in (slice(None), slice(top)):
            assert np.sum(observe(_read(tmp_path, {q: v[rows] for q, v in columns.items()})).used) >= 5


def test_rows_that_are_said_to_be_in_order_are_read(tmp_path: Path) -> None:
    columns = _press()
    order = np.argsort(columns["displacement"], kind="stable")
    columns = {q: columns[q][order] for q in ("displacement", "force")}
    with pytest.raises(InputError, match="say it once more: --units force=N"):
        _read(tmp_path, columns)
    table = _read(tmp_path, columns, Reading(units={"force": "N"}))
    np.testing.assert_allclose(table.columns["force"], columns["force"])


@pytest.mark.parametrize("drive", DRIVES)
def test_rows_in_order_without_a_clock_are_read(tmp_path: Path, drive: str) -> None:
    for seed in range(6):
        columns = {q: v for q, v in uneven(drive, seed).columns.items() if q != "time"}
        top = int(np.argmax(np.abs(columns["displacement"]))) + 1
        for rows in (slice(None), slice(top)):
            seen = observe(_read(tmp_path, {q: v[rows] for q, v in columns.items()}))
            assert np.sum(seen.used) >= 5


def test_a_channel_that_is_written_in_several_rows_and_a_coarse_place_are_no_sorted_rows(tmp_path: Path) -> None:
    columns = {q: v[:150] for q, v in _press(noise=0.0005).items()}
    slow = columns | {q: np.repeat(columns[q][::2], 2) for q in ("capacitance",)}
    coarse = columns | {"displacement": np.repeat(columns["displacement"][::2], 2)}
    for one in (slow, coarse):
        assert set(observe(_read(tmp_path, one)).branch) == {"loading"}


@pytest.mark.parametrize("quantity", ["displacement", "force", "capacitance"])
@pytest.mark.parametrize("block", [(40, 90), (160, 250), (70, 110)])
def test_a_block_that_was_pasted_upside_down_is_refused_with_its_lines(
    tmp_path: Path, quantity: str, block: tuple[int, int]
) -> None:
    columns, (first, end) = _timed(), block
    columns[quantity][first:end] = columns[quantity][first:end][::-1].copy()
    with pytest.raises(InputError, match=f"lines {first + 2} to {end + 1} seem to stand in reversed order") as caught:
        _read(tmp_path, columns)
    (fault,) = caught.value.faults
    unit = {"displacement": "mm", "force": "N", "capacitance": "pF"}[quantity]
    assert f"--units {quantity}={unit}" in fault.advice
    if quantity == "capacitance":
        assert "capacitance" not in _read(tmp_path, columns, Reading(columns={"capacitance": "none"})).columns


def test_a_block_across_the_turn_shows_where_the_ways_are_apart(tmp_path: Path) -> None:
    columns = _timed(gap=0.1)
    columns["force"][100:200] = columns["force"][100:200][::-1].copy()
    with pytest.raises(InputError, match="lines 102 to 201 seem to stand in reversed order"):
        _read(tmp_path, columns)


def test_a_load_that_slips_and_builds_up_again_is_no_block_upside_down(tmp_path: Path) -> None:
    columns = _timed()
    saw = np.zeros(300)
    saw[60:80] = -0.15 + np.arange(20) * 0.15 / 20
    saw[80:100] = saw[60:80]
    columns["force"] = np.round(columns["force"] + saw, 4)
    table = _read(tmp_path, columns)
    assert np.sum(observe(table).used) > 50


def _leaps(folder: Path, columns: dict[str, FloatArray]) -> list[tuple[str, str]]:
    return [(g.channel, g.level) for g in judge(observe(_read(folder, columns))) if g.check == "leap"]


def test_two_presses_that_were_joined_are_told_where_they_meet(tmp_path: Path) -> None:
    one, other = _timed(), _timed()
    assert not _leaps(tmp_path, one)
    kept = np.r_[0:70, 90:300]
    cut = {q: v[kept] for q, v in one.items()} | {"time": 0.05 * np.arange(kept.size)}
    assert not _leaps(tmp_path, cut)
    joined = cut | {"force": np.where(np.arange(kept.size) < 70, cut["force"], 1.3 * cut["force"])}
    assert ("force", "bad") in _leaps(tmp_path, joined)
    other["force"][150:] *= 0.8
    assert _leaps(tmp_path, other) == [("force", "warning")]


@pytest.mark.parametrize("sense", [1.0, -1.0])
@pytest.mark.parametrize("rows", [150, 300])
def test_a_drift_larger_than_the_press_is_no_clear_sign(tmp_path: Path, rows: int, sense: float) -> None:
    columns = {q: v[:rows].copy() for q, v in _timed().items()}
    passed = columns["time"] / columns["time"][-1]
    shape = passed if rows == 150 else 1 - np.exp(-passed / 0.2)
    columns["force"] = np.round(sense * (columns["force"] - 3 * 0.86 * shape), 4)
    columns["displacement"] = sense * columns["displacement"]
    with pytest.raises(InputError, match="it cannot be told which way compression is in force") as caught:
        observe(_read(tmp_path, columns))
    said = "compression positive" if sense > 0 else "compression negative"
    assert f'--sign "force={said}"' in str(caught.value)
    seen = observe(_read(tmp_path, columns, Reading(sign={"force": said, "displacement": said})))
    assert {d.factor for d in seen.signs.values()} == {sense}


def test_a_sign_stays_clear_under_a_drift_that_the_press_outweighs(tmp_path: Path) -> None:
    for rows, size in ((150, 0.3), (300, -0.5), (300, 1.5)):
        columns = {q: v[:rows].copy() for q, v in _timed().items()}
        columns["force"] = np.round(columns["force"] + size * 0.86 * columns["time"] / columns["time"][-1], 4)
        assert observe(_read(tmp_path, columns)).signs["force"].factor == 1


def _with_last_rows(folder: Path, columns: dict[str, FloatArray], last: list[str], blank: bool) -> LabTable:
    """The record with the largest or the smallest of each column below it."""
    drawn = {"max": np.max, "min": np.min}
    _read(folder, columns)
    path = folder / "press.csv"
    rows = [",".join(f"{drawn[what](v):.{DIGITS[q]}f}" for q, v in columns.items()) for what in last]
    path.write_text(path.read_text() + "\n" * blank + "\n".join(rows) + "\n")
    return read_lab_file(path)


@pytest.mark.parametrize("blank", [False, True])
@pytest.mark.parametrize("last", [["max"], ["max", "min"], ["min", "max"]])
@pytest.mark.parametrize("clock", [False, True])
def test_rows_of_the_largest_and_the_smallest_of_all_columns_are_no_readings(
    tmp_path: Path, last: list[str], blank: bool, clock: bool
) -> None:
    columns = _timed() if clock else _press()
    table = _with_last_rows(tmp_path, columns, last, blank)
    words = {"max": "a row of results: the maximum of the rows above", "min": "a row of results: the minimum of the rows above"}
    assert [r for r in table.reasons if r] == [words[what] for what in last]
    assert any(f"{len(last)} row(s) at the end are left out" in note for note in table.notes)
    assert observe(table).n_cycle == 1


@pytest.mark.parametrize("clock", [False, True])
def test_a_record_that_ends_at_its_largest_readings_keeps_them(tmp_path: Path, clock: bool) -> None:
    for rows in (slice(0, 150), slice(0, 151), slice(0, 150, 15), slice(0, 150, 5)):
        columns = {q: v[rows] for q, v in (_timed(noise=0.0) if clock else _press(noise=0.0)).items()}
        assert not any(_read(tmp_path, columns).reasons)
    jump = np.r_[0:20, 149]  # at rest, and then the peak at once
    assert not any("results" in why for why in _read(tmp_path, {q: v[jump] for q, v in _press().items()}).reasons)


@pytest.mark.parametrize("but", ["capacitance", ""])
def test_rows_of_a_lost_sign_and_of_a_tenth_in_one_record_have_a_way_out(tmp_path: Path, but: str) -> None:
    columns = {q: v for q, v in _timed().items() if q != but}
    columns["force"][60:66] *= -1
    columns["force"][100:106] /= 10
    rows = np.arange(300)
    for first, last in ((100, 105), (60, 65)):
        with pytest.raises(InputError, match=f"or remove lines {first + 2} to {last + 2}, which are then missing"):
            _read(tmp_path, {q: v[rows] for q, v in columns.items()})
        rows = rows[(rows < first) | (rows > last)]
    table = _read(tmp_path, {q: v[rows] for q, v in columns.items()})
    assert not any(table.reasons)


ALONE = "goes one way from the first row to the last, while .* goes there and comes back: it was sorted alone"


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("shape", [{}, {"hold": 40}, {"cycles": 3}, {"noise": 0.0005}, {"n": 60}])
@pytest.mark.parametrize(
    ("by", "layout"),
    [
        ("capacitance", ("time", "displacement", "force", "capacitance")),
        ("capacitance", ("displacement", "force", "capacitance")),
        ("capacitance", ("time", "displacement", "capacitance")),
        ("capacitance", ("time", "force", "capacitance")),
        ("force", ("time", "force", "capacitance")),
    ],
)
def test_a_column_that_was_sorted_alone_is_refused(
    tmp_path: Path, by: str, layout: tuple[str, ...], shape: dict[str, Any], backwards: bool
) -> None:
    columns = {q: v for q, v in _timed(**shape).items() if q in layout}
    sorted_so = {**columns, by: np.sort(columns[by])[:: -1 if backwards else 1]}
    with pytest.raises(InputError, match=ALONE) as caught:
        _read(tmp_path, sorted_so)
    advice = caught.value.faults[0].advice
    quantity, unit = advice.rpartition("--units ")[2].split("=")
    assert quantity in _read(tmp_path, sorted_so, Reading(units={quantity: unit})).columns
    if "=none" in advice:
        table = _read(tmp_path, sorted_so, Reading(columns={quantity: "none"}))
        assert quantity not in table.columns
        assert by == "force" or observe(table).n_cycle == shape.get("cycles", 1)


def test_a_capacitance_that_drifts_and_feels_the_press_was_not_sorted(tmp_path: Path) -> None:
    columns = _timed(noise=0.0005)
    smooth = 97 + 1.9 * np.clip(columns["displacement"] - 0.08, 0, None) + 4 * columns["time"] / np.max(columns["time"])
    _read(tmp_path, {**columns, "capacitance": smooth})


@pytest.mark.parametrize("apart", [",", ";", "\t"])
@pytest.mark.parametrize("clock", [False, True])
def test_rows_out_of_the_order_of_their_time_are_put_right_by_the_command_in_the_advice(
    tmp_path: Path, apart: str, clock: bool
) -> None:
    columns = _timed(n=40)
    cells = [[f"{x:.{DIGITS[q]}f}" for x in v] for q, v in columns.items()]
    if clock:
        cells[0] = [f"10:00:{float(t):06.3f}" for t in cells[0]]
    head = apart.join(HEADS[q].removesuffix(" (s)") if clock else HEADS[q] for q in columns)
    rows = [apart.join(row) for row in zip(*cells, strict=True)]
    path = tmp_path / "newest first.csv"
    path.write_text("\n".join(["# rig 2", head, *rows[::-1]]) + "\n")
    with pytest.raises(InputError, match="time falls at 79 of 79 rows") as caught:
        read_lab_file(path)
    command = caught.value.faults[0].advice.partition(": ")[2].partition(", or name")[0]
    subprocess.run(["bash", "-c", command], cwd=tmp_path, check=True)
    assert (tmp_path / "sorted.csv").read_text() == "\n".join(["# rig 2", head, *rows]) + "\n"


def test_rows_whose_times_no_command_sorts_are_asked_for_without_one(tmp_path: Path) -> None:
    columns = _timed(n=150)
    rows = [";".join(f"{columns[q][i]:.{DIGITS[q]}f}" for q in columns).replace(".", ",") for i in range(300)]
    path = tmp_path / "press.csv"
    path.write_text("\n".join([";".join(HEADS[q] for q in columns), *rows[::-1]]) + "\n")
    with pytest.raises(InputError, match="Sort the rows by their time, or name"):
        read_lab_file(path)

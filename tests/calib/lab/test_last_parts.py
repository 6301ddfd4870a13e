"""Times whose last part stands behind the seconds: frames of a camera, of which so many are a second."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from openpyxl import Workbook

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

N = 150
PLACE = [0.006 * min(i, N - 1 - i) for i in range(N)]
LOAD = [3.0 * max(0.0, x - 0.06) ** 1.5 for x in PLACE]


def timecode(frame: int, nominal: int, start: int = 36_000, mark: str = ":", hours: str = "{h:02d}:") -> str:
    seconds, part = divmod(frame, nominal)
    seconds += start
    return f"{hours.format(h=seconds // 3600)}{seconds // 60 % 60:02d}:{seconds % 60:02d}{mark}{part:02d}"


def record(folder: Path, times: Sequence[str], above: Sequence[str] = (), name: str = "Time", said: str = "") -> LabTable:
    rows = [f"{t},{x:.4f},{f:.4f}" for t, x, f in zip(times, PLACE, LOAD, strict=True)]
    path = folder / "press.csv"
    path.write_text("\n".join([*above, f"{name},Displacement (mm),Force (N)", *rows, ""]), encoding="utf-8")
    return read_lab_file(path, Reading(units={"time": said} if said else {}))


def assert_frames(table: LabTable, frames: Sequence[int], rate: float) -> None:
    time = table.columns["time"]
    np.testing.assert_allclose(time - time[0], (np.asarray(frames) - frames[0]) / rate, atol=2e-6)
    assert not any(table.reasons)
    assert any("counts frames" in note for note in table.notes), table.notes


def refusal(folder: Path, times: Sequence[str], above: Sequence[str] = (), said: str = "") -> str:
    with pytest.raises(InputError) as error:
        record(folder, times, above, said=said)
    return str(error.value)


@pytest.mark.parametrize(("nominal", "step"), [(24, 1), (25, 1), (25, 5), (30, 1), (30, 3), (48, 2), (50, 1), (20, 2)])
@pytest.mark.parametrize("before", ["", "2026-11-20 "])
def test_frames_are_read_with_a_note_where_the_times_go_on_evenly_so(
    tmp_path: Path, nominal: int, step: int, before: str
) -> None:
    frames = [7 + step * i for i in range(N)]
    assert_frames(record(tmp_path, [before + timecode(k, nominal) for k in frames]), frames, nominal)
    assert_frames(record(tmp_path, [timecode(k, nominal) for k in frames], name="Timecode"), frames, nominal)


def test_minutes_seconds_and_frames_are_no_hours_minutes_and_seconds(tmp_path: Path) -> None:
    frames = list(range(N))
    for start in (0, 65):
        assert_frames(record(tmp_path, [timecode(k, 25, start, hours="") for k in frames]), frames, 25)


def test_a_stated_rate_reads_frames_that_are_sampled_unevenly(tmp_path: Path) -> None:
    frames = [round(4.8 * i) for i in range(N)]
    times = [timecode(k, 24) for k in frames]
    assert_frames(record(tmp_path, times, ["Frame rate: 24 fps"]), frames, 24)
    told = refusal(tmp_path, times)
    assert "--units time=h:min:s:frame/25 if it is frames" in told
    assert_frames(record(tmp_path, times, said="h:min:s:frame/24"), frames, 24)


@pytest.mark.parametrize("said", ["h:min:s:cs", "h:min:s:ms", "d:h:min:s"])
def test_what_the_cells_contradict_is_not_taken_though_it_is_said(tmp_path: Path, said: str) -> None:
    frames = list(range(N))
    told = refusal(tmp_path, [timecode(k, 25) for k in frames], said=said)
    assert "--units time=h:min:s:frame/25" in told
    assert_frames(record(tmp_path, [timecode(k, 25) for k in frames], said="h:min:s:frame/25"), frames, 25)


def test_days_that_are_asked_for_against_the_steps_are_told(tmp_path: Path) -> None:
    table = record(tmp_path, [timecode(round(4.8 * i), 24) for i in range(N)], said="d:h:min:s")
    assert any("does not go on as seconds do" in note for note in table.notes)


def test_frames_that_are_said_need_a_rate_that_holds_them(tmp_path: Path) -> None:
    frames = [round(4.8 * i) for i in range(N)]
    times = [timecode(k, 24) for k in frames]
    assert "--units time=h:min:s:frame/25" in refusal(tmp_path, times, said="h:min:s:frame")
    assert "reaches 19" in refusal(tmp_path, times, said="h:min:s:frame/12")
    assert_frames(record(tmp_path, times, ["Camera: 24 fps"], said="h:min:s:frame"), frames, 24)


def _dropping(frame: int) -> str:
    """A frame of 29.97 a second, whose numbers 0 and 1 are left out at full minutes but the tenth."""
    tens, rest = divmod(frame, 17_982)
    return timecode(frame + 18 * tens + (2 * ((rest - 2) // 1798) if rest > 1 else 0), 30, 0, ";")


def test_frames_behind_a_semicolon_are_those_some_of_whose_numbers_are_left_out(tmp_path: Path) -> None:
    frames = list(range(1700, 1700 + N))
    times = [_dropping(k) for k in frames]
    assert "00:01:00;02" in times
    assert "00:01:00;00" not in times
    assert_frames(record(tmp_path, times), frames, 30 / 1.001)
    with_colons = [t.replace(";", ":") for t in times]
    assert_frames(record(tmp_path, with_colons, ["Frame rate: 29.97 fps"]), frames, 29.97)


def test_parts_behind_a_point_that_go_on_as_frames_are_asked_about(tmp_path: Path) -> None:
    frames = list(range(N))
    times = [timecode(k, 25, mark=".") for k in frames]
    told = refusal(tmp_path, times)
    assert "--units time=h:min:s:frame/25 if frames" in told
    assert "--units time=h:min:s if decimals" in told
    assert_frames(record(tmp_path, times, said="h:min:s:frame/25"), frames, 25)
    np.testing.assert_allclose(record(tmp_path, times, said="h:min:s").columns["time"][24:26], [36000.24, 36001.0])


def test_sixty_a_second_may_be_seconds_of_days(tmp_path: Path) -> None:
    frames = list(range(N))
    times = [timecode(k, 60) for k in frames]
    told = refusal(tmp_path, times, ["Frame rate: 60 fps"])
    assert "--units time=d:h:min:s if seconds" in told
    assert_frames(record(tmp_path, times, said="h:min:s:frame/60"), frames, 60)
    np.testing.assert_allclose(np.diff(record(tmp_path, times, ["Frame rate: 60 fps"], said="d:h:min:s").columns["time"]), 1.0)


@pytest.mark.parametrize(("nominal", "step"), [(25, 1), (100, 4)])
def test_workbooks_hold_such_times_as_text(tmp_path: Path, nominal: int, step: int) -> None:
    book = Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append(["Time", "Displacement (mm)", "Force (N)"])
    for i, (x, f) in enumerate(zip(PLACE, LOAD, strict=True)):
        sheet.append([timecode(step * i, nominal), x, f])
    book.save(tmp_path / "press.xlsx")
    form = "h:min:s:cs" if nominal == 100 else "h:min:s:frame/25"
    for units in ({}, {"time": form}):
        time = read_lab_file(tmp_path / "press.xlsx", Reading(units=units)).columns["time"]
        np.testing.assert_allclose(time - time[0], np.arange(N) * step / nominal, atol=2e-6)


def test_minutes_go_on_where_an_hour_is_full_and_frames_over_midnight(tmp_path: Path) -> None:
    frames = list(range(N))
    for start, hours in ((3598, ""), (86_398, "{h:02d}:")):
        times = [timecode(k, 25, start, hours=hours).replace("24:", "00:", 1 if k >= 50 and hours else 0) for k in frames]
        assert_frames(record(tmp_path, times), frames, 25)

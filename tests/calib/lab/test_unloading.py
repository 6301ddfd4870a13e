"""What a press tells of unloading: planted differences between its branches come out, whatever ties force and capacitance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from calib.lab import SHARES, Unloading, Use, measure_unloading
from models.sensor import FloatArray

PEAK, REST, GAIN, TRAVEL, DURATION, HOLD = 5.0, 100e-12, 0.4e-12, 1e-3, 50.0, 2.0
MISSING, ZERO, OFFSET = 0.08, 0.3, 4.0


def _press(time: FloatArray, down_to: float = 0.0) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Displacement [m], force [N] and capacitance [F] of a press that is held and let go, at times [s].

    Halfway back the force is 8 % of the largest less than where the same capacitance was read on the way down.
    """
    knots = [0.0, DURATION, DURATION + HOLD, 2 * DURATION + HOLD]
    x = TRAVEL * np.interp(time, knots, [0.0, 1.0, 1.0, down_to])
    share = np.maximum(x / TRAVEL - 0.2, 0.0) / 0.8  # first touch at a fifth of the travel
    meant = PEAK * share**1.5
    back = time > DURATION + HOLD
    force = meant - back * MISSING * PEAK * 4 * (meant / PEAK) * (1 - meant / PEAK)
    return x, force, REST + GAIN * meant


def _write(path: Path, time: FloatArray, **columns: FloatArray) -> Path:
    heads = {"x": "Displacement (mm)", "f": "Force (N)", "c": "Cp (pF)"}
    scale = {"x": 1e3, "f": 1.0, "c": 1e12}
    rows = np.column_stack([time, *(columns[name] * scale[name] for name in columns)])
    lines = [",".join(["Time (s)", *(heads[name] for name in columns)])]
    lines += [",".join(f"{value:.6f}" for value in row) for row in rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _planted(peak: float) -> FloatArray:
    share = SHARES * peak / PEAK
    return -MISSING * PEAK * 4 * share * (1 - share)


@pytest.mark.parametrize("tie", ["force", "displacement", "clock"])
def test_a_planted_difference_comes_out_however_the_files_are_tied(tmp_path: Path, tie: str) -> None:
    rng = np.random.default_rng(1)
    time = np.arange(0.0, 2 * DURATION + HOLD, 0.1)
    x, f, c = _press(time)
    f = f + ZERO + 2e-3 * rng.standard_normal(f.size)
    c = c + 2e-15 * rng.standard_normal(c.size)
    if tie == "force":
        both = _write(tmp_path / "both.csv", time, x=x, f=f, c=c)
        found = measure_unloading(both, both)
    else:
        force = _write(tmp_path / "force.csv", time, x=x, f=f)
        more = {"x": x} if tie == "displacement" else {}
        meter = _write(tmp_path / "meter.csv", time - (OFFSET if tie == "clock" else 0.0), **more, c=c)
        found = measure_unloading(force, meter, clock_offset=(OFFSET, 0.05) if tie == "clock" else None)
    assert isinstance(found, Unloading)
    assert found.peak == pytest.approx(PEAK, abs=0.05)
    assert found.hold == pytest.approx(HOLD, abs=0.3)
    off = found.off - _planted(found.peak)
    assert np.max(np.abs(off)) < 0.02
    # What a clock that is off by a sd does is in the error: forces rise by 0.19 N/s at the end.
    assert bool(np.max(found.error) > 0.01) is (tie == "clock")
    assert np.mean(np.abs(off) < 2 * np.hypot(found.error, 2e-3)) > 0.8


def test_an_elastic_press_shows_no_difference(tmp_path: Path) -> None:
    time = np.arange(0.0, 2 * DURATION + HOLD, 0.1)
    x, _, c = _press(time)
    both = _write(tmp_path / "both.csv", time, x=x, f=(c - REST) / GAIN, c=c)
    found = measure_unloading(both, both)
    assert isinstance(found, Unloading)
    assert np.nanmax(np.abs(found.off)) < 1e-3


def test_what_was_not_recorded_is_said(tmp_path: Path) -> None:
    time = np.arange(0.0, 2 * DURATION + HOLD, 0.1)
    x, f, c = _press(time)
    down = time <= DURATION
    one_way = _write(tmp_path / "one_way.csv", time[down], x=x[down], f=f[down], c=c[down])
    assert measure_unloading(one_way, one_way) == "it was not recorded while the ball retreats"
    x, f, c = _press(time, down_to=0.9)
    a_bit = _write(tmp_path / "a_bit.csv", time, x=x, f=f, c=c)
    assert measure_unloading(a_bit, a_bit) == "it was not recorded while the ball retreats to 50 % of its force"
    assert measure_unloading(a_bit, a_bit, use=Use(branch="unloading")) == "it is calibrated by unloading"
    assert measure_unloading(a_bit, None) == "no capacitance was measured"
    meter, force = _write(tmp_path / "meter.csv", time, c=c), _write(tmp_path / "force.csv", time, x=x, f=f)
    assert measure_unloading(force, meter) == "nothing ties its capacitance to a force"

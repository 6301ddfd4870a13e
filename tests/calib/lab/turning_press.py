"""One press there and back at an even pace, as a tester writes it, into which faults are planted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib.lab import Observations, observe, read_lab_file
from models.sensor import FloatArray

HEADS = {"time": "Time (s)", "displacement": "Displacement (mm)", "force": "Force (N)", "capacitance": "Cp (pF)"}
DIGITS = {"time": 3, "displacement": 4, "force": 4, "capacitance": 4}


@dataclass(frozen=True)
class Turning:
    """Where the ball is in each row [mm] and what is measured there, in s, mm, N and pF."""

    depth: FloatArray
    columns: dict[str, FloatArray]


def turning_press(seed: int = 1, hold: int = 0, halves: int = 100) -> Turning:
    """Press from before contact to 0.88 mm and go back, with a hold at 60 % in which the load relaxes.

    Parameters
    ----------
    seed : of the noise.
    hold : rows of the hold.
    halves : rows there, and back.
    """
    rng = np.random.default_rng(seed)
    down = np.arange(halves) * 0.0088 * 100 / halves
    at = int(0.6 * halves)
    place = np.concatenate([down[:at], np.full(hold, down[at]), down[at:], down[::-1]])
    held = np.concatenate([np.zeros(at), np.arange(hold), np.zeros(2 * halves - at)])
    depth = np.clip(place - 0.08, 0, None)
    ease = 1 - 0.05 * (1 - np.exp(-held / 8))
    force = 5.0 * depth**1.5 * ease + rng.normal(0.004, 0.002, place.size)
    capacitance = 97 + 2.5 * depth**1.2 * ease + rng.normal(0, 0.001, place.size)
    time = 0.05 * np.arange(place.size, dtype=np.float64)
    return Turning(depth, {"time": time, "displacement": place, "force": force, "capacitance": capacitance})


def observed(folder: Path, columns: Mapping[str, FloatArray], but: str = "") -> Observations:
    """Write columns to a file, without one of them, and read it.

    Parameters
    ----------
    folder : where it is written.
    columns : quantity -> readings, (n_row,).
    but : the quantity that is left out.
    """
    shown = {q: [f"{x:.{DIGITS[q]}f}" for x in v] for q, v in columns.items() if q != but}
    path = folder / "press.csv"
    rows = [",".join(row) for row in zip(*shown.values(), strict=True)]
    path.write_text("\n".join([",".join(HEADS[q] for q in shown), *rows]) + "\n", encoding="utf-8")
    return observe(read_lab_file(path))

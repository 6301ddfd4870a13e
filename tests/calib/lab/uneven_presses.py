"""Presses as they are made by hand, by event or in steps: sound ones of uneven steps, and the same with a planted fault."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hostile_press import FloatArray

from models.sensor import BoolArray

#: How the ball is driven.
DRIVES = ("smooth", "fast", "crank", "jerky", "events", "stairs", "load only")
#: What is planted into a sound press.
FAULTS = ("reset", "block", "outlier")


@dataclass(frozen=True)
class Uneven:
    """One press: what is written, and which rows are not sound.

    Attributes
    ----------
    text : the file.
    columns : quantity -> readings as written, in s, mm, N and pF, (n_row,).
    wrong : rows of a planted block or outlier; of a reset the first row with the other zero.
    """

    text: str
    columns: dict[str, FloatArray]
    wrong: tuple[int, ...]


def uneven(drive: str, seed: int, fault: str = "") -> Uneven:
    """Press a ball into a soft layer, force as depth^1.5, and write it down with few or many digits.

    Parameters
    ----------
    drive : one of DRIVES.
    seed : of everything that differs from press to press.
    fault : one of FAULTS, planted on the way down in contact; "" for a sound press.
    """
    rng = np.random.default_rng([seed, DRIVES.index(drive), 7])
    top = rng.uniform(0.4, 1.2)
    place, held = _places(drive, rng)
    place = place * top
    n = place.size
    depth = np.clip(place - 0.1 * top, 0, None) / (0.9 * top)
    down = np.concatenate([[True], np.diff(place) >= 0])
    force = rng.uniform(1.5, 5) * depth**1.5 * np.where(down, 1, 0.93 + 0.07 * place / top)
    force = force * (1 - 0.05 * (1 - np.exp(-held / 8)))
    noise = float(rng.choice([0.0005, 0.002, 0.005]))
    force = force + rng.normal(0, noise, n)
    columns = {
        "time": np.cumsum(rng.uniform(0.02, 0.4, n) if drive == "events" else np.full(n, 0.1)),
        "displacement": place + rng.normal(0, 0.00005, n),
        "force": force,
        "capacitance": 97 + 2.0 * depth**1.15 + rng.normal(0, 0.0015, n),
    }
    if rng.random() < 0.5:
        del columns["capacitance"]
    wrong: tuple[int, ...] = ()
    if fault:
        columns, wrong = _with_fault(fault, columns, depth, down, rng)
    sign = float(rng.choice([1, 1, -1]))
    digits = {
        "time": 3,
        "displacement": int(rng.choice([3, 4])),
        "force": int(rng.choice([2, 3, 4])),
        "capacitance": int(rng.choice([2, 3, 4])),
    }
    heads = {"time": "Time (s)", "displacement": "Displacement (mm)", "force": "Force (N)", "capacitance": "Cp (pF)"}
    written = {q: np.round(v * (sign if q in ("displacement", "force") else 1), digits[q]) + 0.0 for q, v in columns.items()}
    rows = zip(*([f"{x:.{digits[q]}f}" for x in v] for q, v in written.items()), strict=True)
    text = "\n".join([",".join(heads[q] for q in written), *(",".join(row) for row in rows)]) + "\n"
    return Uneven(text, written, wrong)


def _places(drive: str, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Places from 0 to 1, and for how many rows the ball has rested in each."""
    if drive == "stairs":
        levels, rests = np.linspace(0, 1, int(rng.integers(6, 15))), int(rng.integers(8, 40))
        way = np.concatenate([levels, levels[-2::-1]]) if rng.random() < 0.5 else levels
        return np.repeat(way, rests), np.tile(np.arange(rests, dtype=float), way.size)
    if drive == "load only":
        place = np.tile(np.linspace(0, 1, int(rng.integers(40, 120))), int(rng.integers(2, 5)))
        return place, np.zeros(place.size)
    if drive in ("smooth", "fast"):
        down = np.linspace(0, 1, int(rng.integers(80, 200)) if drive == "smooth" else int(rng.integers(12, 30)))
    elif drive == "events":
        down = np.sort(rng.uniform(0, 1, 150))
    else:
        steps = rng.gamma(0.6, 1, 300) if drive == "crank" else rng.gamma(0.35, 1, 250)
        steps = np.convolve(steps, np.ones(7) / 7, "same") if drive == "crank" else steps
        down = np.concatenate([np.zeros(12), np.cumsum(steps) / np.sum(steps)])
    place = np.concatenate([down, down[::-1]])
    return place, np.zeros(place.size)


def _with_fault(
    fault: str, columns: dict[str, FloatArray], depth: FloatArray, down: BoolArray, rng: np.random.Generator
) -> tuple[dict[str, FloatArray], tuple[int, ...]]:
    """The columns with a fault of a quarter of the range of force in contact, and its rows."""
    force = columns["force"].copy()
    span = float(np.ptp(force))
    first = int(np.argmax(depth))
    last = first - (20 if fault == "block" else 4)
    inner = np.flatnonzero((depth > 0.3) & (depth < 0.7) & (np.arange(depth.size) < last) & down)
    row = int(rng.choice(inner))
    if fault == "reset":
        force[row:] -= force[row]
        return columns | {"force": force}, (row,)
    rows = np.arange(row, row + int(rng.integers(5, 13))) if fault == "block" else np.array([row])
    force[rows] += float(rng.choice([-1, 1])) * rng.uniform(0.25, 0.4) * span
    return columns | {"force": force}, tuple(rows.tolist())

"""Write the synthetic lab files of this folder from the finite-element model: `python datasets/padded_sensor/make_dataset.py`.

Every number that a calibration should find again stands in `TRUTH` and is written to `truth.json`. The curves come from
`models.fem`, never from the surrogate that the calibration uses.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from models.fem import FiniteElements
from models.sensor import FloatArray, design_from

FOLDER = Path(__file__).parent
SEED = 20190304

#: SI. Shared by both specimens, then per specimen. `clock_offset` is the tester's clock minus the LCR meter's. `contact_offset`
#: is that of `calib.problem.measurement` (1), where the frame gives way by the load as it is read: the crosshead stands
#: c_m F_0 beyond it at first touch, at 0.212 and 0.174 mm.
TRUTH: dict[str, Any] = {
    "shared": {
        "indenter_radius": 5e-3,
        "sensor_radius": 10e-3,
        "young_modulus": 0.62e6,
        "relative_permittivity": 2.83,
        "machine_compliance": 3.1e-6,
        "parasitic_capacitance": 0.9e-12,
        "force_noise": 5e-3,
        "capacitance_noise": 10e-15,
    },
    "sensor 1": {
        "sensor_thickness": 0.752e-3,
        "padding_thickness": 1.081e-3,
        "dielectric_thickness": 0.163e-3,
        "contact_offset": 0.2109367e-3,
        "load_zero": 0.343,
        "clock_offset": 3.42,
    },
    "sensor 2": {
        "sensor_thickness": 0.731e-3,
        "padding_thickness": 1.124e-3,
        "dielectric_thickness": 0.158e-3,
        "contact_offset": 0.1745797e-3,
        "load_zero": -0.187,
        "clock_offset": -1.76,
    },
}

SPEED = 1e-3 / 60  # [m/s] crosshead
TRAVEL = {"sensor 1": 0.84e-3, "sensor 2": 0.80e-3}  # [m] crosshead from start to turning point
HOLD = 2.0  # [s] at the turning point
TESTER_RATE, LCR_RATE = 25.0, 8.0  # [Hz]
RELAXATION = 0.008  # share of force lost during the hold
HYSTERESIS = 0.07  # further share of force missing halfway down
LAG = 0.015  # share of the capacitance change kept too much halfway back


def curves(design_values: dict[str, float]) -> tuple[PchipInterpolator, PchipInterpolator]:
    """F(d) [N] and C(d) [F] of one specimen as interpolants of 61 finite-element states; straight before contact."""
    design = design_from(design_values)
    depth = 0.72e-3 * np.linspace(0, 1, 61) ** 1.5
    response = FiniteElements(accuracy=3e-4).respond(design, depth)
    before = np.array([-2e-3, -1e-3])
    x = np.concatenate([before, depth])
    force = PchipInterpolator(x, np.concatenate([[0, 0], response.force]))
    c0 = float(response.rest_capacitance)
    return force, PchipInterpolator(x, np.concatenate([[c0, c0], response.capacitance]))


def crosshead(t: FloatArray, travel: float) -> FloatArray:
    """Crosshead position [m]: down at constant speed, hold, up again."""
    down = travel / SPEED
    return np.asarray(np.interp(t, [0, down, down + HOLD, 2 * down + HOLD], [0, travel, travel, 0]))


def true_state(t: FloatArray, name: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Crosshead [m], force on the ball [N] and capacitance of the sensor [F] at the tester's times `t`, without noise."""
    shared, own = TRUTH["shared"], TRUTH[name]
    geometry = ("indenter_radius", "sensor_radius", "young_modulus", "relative_permittivity")
    values = {k: shared[k] for k in geometry} | {
        k: own[k] for k in ("sensor_thickness", "padding_thickness", "dielectric_thickness")
    }
    force_at, capacitance_at = curves(values)
    x = crosshead(t, TRAVEL[name])
    # The frame gives way by c_m times the load that is read: d + c_m (F(d) + F_0) = x - d_0.
    depth_grid = np.linspace(-0.4e-3, 0.72e-3, 4001)
    reading = depth_grid + own["contact_offset"] + shared["machine_compliance"] * (force_at(depth_grid) + own["load_zero"])
    depth = np.interp(x, reading, depth_grid)
    force, capacitance = force_at(depth), capacitance_at(depth)
    down = TRAVEL[name] / SPEED
    held = np.clip((t - down) / HOLD, 0, 1)
    back = np.where(t > down + HOLD, 1 - np.clip(depth / depth.max(), 0, 1), 0.0)
    force = force * (1 - RELAXATION * held) * (1 - HYSTERESIS * 4 * back * (1 - back))
    rise = capacitance - float(capacitance_at(-1e-3))
    return x, force, capacitance + LAG * rise * 4 * back * (1 - back)


def write_tester(path: Path, name: str, rng: np.random.Generator) -> None:
    """A Bluehill raw-data file: header block, names, units, compression negative, load cell not zeroed."""
    t = np.arange(0, 2 * TRAVEL[name] / SPEED + HOLD, 1 / TESTER_RATE)
    x, force, _ = true_state(t, name)
    reading = force + TRUTH[name]["load_zero"] + rng.normal(0, TRUTH["shared"]["force_noise"], t.size)
    position = x * 1e3 + rng.normal(0, 1e-4, t.size)
    lines = [
        f'Text Inputs : Specimen label,"{name}"',
        'General : Note,"SYNTHETIC DATA, see README.md"',
        "Rate : Rate 1,1.00000,mm/min",
        "",
        "Time,Extension,Load",
        "(s),(mm),(N)",
    ]
    lines += [f"{a:.4f},{-b:.4f},{-c:.3f}" for a, b, c in zip(t, position, reading, strict=True)]
    path.write_text("\r\n".join(lines) + "\r\n", encoding="utf-8")


def write_lcr(path: Path, name: str, rng: np.random.Generator) -> None:
    """An LCR log with its own clock: time, parallel capacitance, dissipation, status."""
    own, shared = TRUTH[name], TRUTH["shared"]
    end = 2 * TRAVEL[name] / SPEED + HOLD
    tester_time = np.arange(max(0.0, own["clock_offset"]) + 0.05, end, 1 / LCR_RATE)
    lcr_time = tester_time - own["clock_offset"]
    _, _, capacitance = true_state(tester_time, name)
    reading = capacitance + shared["parasitic_capacitance"] + rng.normal(0, shared["capacitance_noise"], tester_time.size)
    loss = rng.normal(0.0021, 0.00005, tester_time.size)
    lines = ["# SYNTHETIC DATA, see README.md", "Time (s),Cp (pF),D,Status"]
    lines += [f"{a:.3f},{b * 1e12:.3f},{c:.5f},0" for a, b, c in zip(lcr_time, reading, loss, strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def main() -> None:
    """Write all files of this folder."""
    rng = np.random.default_rng(SEED)
    for number, name in enumerate(("sensor 1", "sensor 2"), start=1):
        write_tester(FOLDER / f"sensor{number}_instron.csv", name, rng)
        write_lcr(FOLDER / f"sensor{number}_lcr.csv", name, rng)
    (FOLDER / "truth.json").write_text(json.dumps({"unit": "SI", **TRUTH}, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

"""Write a lab to prove: two specimens of one lot, each pressed with two balls: `python benchmarks/two_balls.py LAB`.

Its experiment pools partially, so that what is proved is a calibration of specimens that differ:
`calib prove LAB/experiment.toml --replicates 500 -o proof`. Only the times and the way of the crosshead of these presses
enter a proof, which makes sensors of its own. Curves are those of the finite elements.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from simulated.faulty import DEPTH, EXPERIMENT, SPEED, Physics, curve_of, pressed, written

from calib.problem.synthetic import Rig
from models.sensor import design_from

SEED = 20190307
#: Radii of the balls [m], and of each specimen its modulus [Pa] and its layers [m]: sensor, padding, dielectric.
BALLS = (5e-3, 2.5e-3)
SPECIMENS = ((0.64e6, 0.745e-3, 1.09e-3, 0.161e-3), (0.61e6, 0.733e-3, 1.12e-3, 0.158e-3))

SWEEP = """
[[specimens.sweeps]]
name = "ball {ball} mm"
indenter_radius = "{ball} mm"
force = "{stem}_tester.csv"
capacitance = "{stem}_meter.csv"
"""


def main(words: Sequence[str] | None = None) -> None:
    """Write experiment and lab files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args(words).folder
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(SEED)
    # Priors and what was measured of each specimen are those of the shipped experiment.
    head, own, _ = EXPERIMENT.read_text(encoding="utf-8").split("[[specimens]]")
    text = 'pooling = "partial"\n' + head.rstrip() + "\n"
    for k, (modulus, sensor, padding, dielectric) in enumerate(SPECIMENS, 1):
        text += f'\n[[specimens]]\nname = "sensor {k}"\n' + own[own.index("[specimens.priors]") :].rstrip() + "\n"
        for ball in BALLS:
            values = {"young_modulus": modulus, "relative_permittivity": 2.83, "sensor_radius": 10e-3, "indenter_radius": ball}
            layers = {"sensor_thickness": sensor, "padding_thickness": padding, "dielectric_thickness": dielectric}
            rig = Rig(0.2e-3, 3.1e-6, rng.normal(0, 0.3), 0.9e-12, rng.normal(0, 2), capacitance_noise=1e-14, speed=SPEED)
            record = pressed(curve_of(design_from(values | layers), 1.05 * DEPTH), rig, Physics(), rng)
            stem = f"sensor{k}_ball{ball * 1e3:g}mm"
            text += SWEEP.format(ball=f"{ball * 1e3:g}", stem=stem)
            written(record, folder / stem)
    (folder / "experiment.toml").write_text(text, encoding="utf-8")
    print(f"{folder / 'experiment.toml'}: {len(SPECIMENS)} specimens, {len(BALLS)} balls each")


if __name__ == "__main__":
    main()

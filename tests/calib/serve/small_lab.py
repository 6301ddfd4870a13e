"""One press of one sensor in a file whose force has no unit, and an experiment of it that is calibrated in seconds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from models.analytic import ClosedForm
from models.sensor import design_from

#: The unit of the force is what is to be corrected: the file does not say it.
EXPERIMENT = """
name = "One specimen"
model = "closed form"
discrepancy = "off"
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
[priors]
young_modulus = { lognormal = ["0.7 MPa", 1.6] }
machine_compliance = { fixed = "0 um/N" }
force_noise = { fixed = "0.01 N" }
capacitance_noise = { fixed = "5 fF" }
parasitic_capacitance = { fixed = "0 pF" }
[[specimens]]
name = "press"
force = { file = "lab/press.csv", units = { force = "N" } }
capacitance = { file = "lab/press.csv", units = { force = "N" } }
[specimens.priors]
sensor_thickness = { fixed = "0.74 mm" }
padding_thickness = { fixed = "1.10 mm" }
"""


def write_press(path: Path) -> Path:
    """Write the file of a press, drawn from the closed form."""
    rng = np.random.default_rng(5)
    values = {"young_modulus": 0.62e6, "sensor_thickness": 0.74e-3, "padding_thickness": 1.1e-3, "relative_permittivity": 2.8}
    depth = np.linspace(-0.05e-3, 0.6e-3, 150)
    r = ClosedForm().respond(design_from({**values, "indenter_radius": 5e-3, "sensor_radius": 10e-3}), depth)
    force = r.force + 0.03 + rng.normal(0, 0.01, depth.size)
    capacitance = 1e12 * r.capacitance + rng.normal(0, 0.005, depth.size)
    table = pd.DataFrame({"Displacement (mm)": 1e3 * depth + 0.05, "Force": force, "Cp (pF)": capacitance})
    table.to_csv(path, index=False, float_format="%.6f")
    return path


def write_lab(folder: Path) -> Path:
    """Write the file and the experiment into a folder as the page keeps them."""
    (folder / "lab").mkdir(parents=True)
    write_press(folder / "lab" / "press.csv")
    (folder / "experiment.toml").write_text(EXPERIMENT, encoding="utf-8")
    return folder

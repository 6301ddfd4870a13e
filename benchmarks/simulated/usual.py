"""A generator in, one lab like that of the shipped experiment out: what its sensor is made of, and its rig."""

from __future__ import annotations

import numpy as np

from calib.experiment import Experiment
from calib.problem.synthetic import Rig

# No lab is farther from the usual one, in standard deviations.
_FARTHEST = 2.5


def usual_lab(experiment: Experiment, rng: np.random.Generator, factor: float) -> tuple[dict[str, float], Rig]:
    """Draw the values of a sensor, SI by name, and the rig that it is pressed on.

    Parameters
    ----------
    experiment : whose ball and disc they are.
    rng : the source of random numbers.
    factor : by which moduli differ, one standard deviation of their logarithm.
    """

    def z() -> float:
        return float(np.clip(rng.standard_normal(), -_FARTHEST, _FARTHEST))

    truth = {
        "young_modulus": 0.7e6 * factor ** z(),
        "relative_permittivity": 2.8 + 0.15 * z(),
        "sensor_thickness": 0.74e-3 + 0.02e-3 * z(),
        "padding_thickness": 1.1e-3 + 0.03e-3 * z(),
        "dielectric_thickness": 0.16e-3 + 0.006e-3 * z(),
        "indenter_radius": experiment.indenter_radius,
        "sensor_radius": experiment.sensor_radius,
    }
    return truth, Rig(0.2e-3 + 0.03e-3 * z(), abs(5e-6 * z()), 0.3 * z(), 1e-12 * z(), 2 * z(), capacitance_noise=1e-14)

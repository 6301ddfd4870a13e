"""How thin dielectrics become, against the finite elements, and where it is not known."""

from __future__ import annotations

import numpy as np
import pytest

from models.fem import FiniteElements
from models.fem.capacitance import largest_thinning
from models.sensor import Design, FloatArray, design_from
from models.surrogate.error_fit import Z90
from models.surrogate.thinning import load_thinning, thinning_refusal

SENSOR = {
    "indenter_radius": 5e-3,
    "sensor_radius": 10e-3,
    "sensor_thickness": 0.74e-3,
    "dielectric_thickness": 0.16e-3,
    "young_modulus": 0.62e6,
    "relative_permittivity": 2.8,
}

#: Thicknesses [m] of sensor and padding, and moduli [Pa].
USUAL = [
    (0.74e-3, 1.1e-3, 0.62e6),
    (0.74e-3, 1.5e-3, 0.5e6),
    (0.7e-3, 2.0e-3, 0.7e6),
    (0.8e-3, 2.5e-3, 0.6e6),
    (0.6e-3, 3.3e-3, 0.55e6),
    (0.74e-3, 4.0e-3, 0.62e6),
    (0.9e-3, 4.5e-3, 0.8e6),
    (0.74e-3, 5.5e-3, 0.62e6),
]


def _both(design: Design, forces: list[float], elements: FiniteElements) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Thinning that the network says at forces [N], its sd, and that of finite elements, (n_force,) each."""
    solution = elements.solve_to_force(design, np.array(forces))
    unit, mesh = solution.units.length, solution.model.mesh
    thickness = float(design.padding.thickness) + float(design.sensor.thickness) / 2
    t_d = np.array([SENSOR["dielectric_thickness"] / unit])
    exact = [float(largest_thinning(mesh, state.u, thickness / unit, t_d)[0]) for state in solution.states]
    found, sd = load_thinning().of(design.draws(), np.array([[state.depth * unit for state in solution.states]]))
    return found[0], sd[0], np.array(exact)


@pytest.mark.parametrize("padding", [1.1e-3, 4e-3])
def test_thinning_is_that_of_the_finite_elements(padding: float) -> None:
    found, sd, exact = _both(design_from({**SENSOR, "padding_thickness": padding}), [2.0, 8.0], FiniteElements())
    assert np.all(np.abs(found - exact) <= 4 * sd)
    assert np.all((sd / found > 1e-4) & (sd / found < 1e-3))


def test_stated_error_of_the_thinning_holds_finite_elements_of_usual_grippers_that_it_has_not_seen() -> None:
    scores, off = [], []
    for h_s, padding, modulus in USUAL:
        design = design_from({**SENSOR, "sensor_thickness": h_s, "padding_thickness": padding, "young_modulus": modulus})
        found, sd, exact = _both(design, [1.0, 3.0, 6.0, 10.0], FiniteElements(5e-4))
        scores.append((found - exact) / sd)
        off.append(found / exact - 1)
    every = np.array(scores)
    assert abs(np.mean(every)) < 0.6, every
    assert np.mean(np.abs(every) <= Z90) >= 0.8, every
    assert np.sqrt(np.mean(np.square(off))) < 3e-4, off


def test_thinning_vanishes_with_depth_and_is_not_known_outside_the_range() -> None:
    design = design_from({**SENSOR, "padding_thickness": np.array([1e-3, 50e-3])})
    thin, _ = load_thinning().of(design.draws(), np.array([[0.0, 1e-6, np.nan]] * 2))
    assert thin[0, 0] == 0
    assert 0 < thin[0, 1] < 0.01
    assert np.isnan(thin[0, 2])
    assert np.all(np.isnan(thin[1]))


def test_other_physics_is_refused() -> None:
    values = {**SENSOR, "padding_thickness": 1e-3}
    assert thinning_refusal(design_from(values)) == ""
    for other in (
        design_from(values, base="slippery"),
        design_from({**values, "stiffening": 0.02}),
        design_from(values, friction_coefficient=np.inf),
    ):
        assert thinning_refusal(other).startswith("the thinning of the dielectric is trained for")

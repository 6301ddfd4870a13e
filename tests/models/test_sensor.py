"""A design checks itself and knows its defaults."""

import numpy as np
import pytest

from models.sensor import Design, Indenter, Padding, Sensor, design_from

PAPER = {
    "indenter_radius": 5e-3,
    "sensor_thickness": 0.74e-3,
    "sensor_radius": 10e-3,
    "young_modulus": 0.69e6,
    "relative_permittivity": 2.8,
    "padding_thickness": 1.1e-3,
}


def test_defaults_are_full_disc_electrodes_half_the_sensor_and_one_silicone():
    design = design_from(PAPER)
    assert design.sensor.electrode_radius == 10e-3
    assert design.sensor.dielectric_thickness == 0.37e-3
    assert design.padding_young_modulus == 0.69e6


def test_rest_capacitance_is_two_parallel_plates():
    # C = 2 eps_0 eps_r A / t, the paper's Eq. (1), for 161 um dielectrics: about 97 pF.
    design = design_from(PAPER | {"dielectric_thickness": 0.161e-3})
    assert design.rest_capacitance == pytest.approx(2 * 8.8541878128e-12 * 2.8 * np.pi * 1e-4 / 0.161e-3)
    assert design.rest_capacitance == pytest.approx(97e-12, rel=0.01)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"sensor_thickness": -0.74e-3}, "sensor_thickness must be positive, got -0.74 mm"),
        ({"padding_thickness": -1e-3}, "padding_thickness must not be negative, got -1 mm"),
        ({"young_modulus": 0.0}, "young_modulus must be positive, got 0 MPa"),
        ({"young_modulus": np.array([1e6, np.nan])}, "young_modulus must be positive, got nan MPa"),
        ({"electrode_radius": 11e-3}, "electrode_radius must not exceed the disc radius"),
        ({"dielectric_thickness": 0.4e-3}, "must not exceed half the sensor thickness, got 0.4 mm in a sensor of 0.74 mm"),
    ],
)
def test_impossible_values_are_refused_with_the_number(change, words):
    with pytest.raises(ValueError, match=words.replace("(", r"\(").replace(")", r"\)")):
        design_from(PAPER | change)


def test_a_batch_gives_its_draws_back():
    modulus = np.array([0.5e6, 0.7e6, 0.9e6])
    batch = design_from(PAPER | {"young_modulus": modulus})
    assert batch.is_batch
    assert batch.draw(2).sensor.young_modulus == 0.9e6
    assert not batch.draw(2).is_batch
    np.testing.assert_array_equal(batch.draws().padding_young_modulus, modulus)


def test_no_padding_is_a_design():
    design = Design(Indenter(5e-3), Sensor(1e-3, 10e-3, 1e6, 2.8), Padding(0.0))
    assert design.total_thickness == 1e-3

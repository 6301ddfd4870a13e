"""A design checks itself and knows its defaults."""

from dataclasses import replace

import numpy as np
import pytest

from models.examples import PAPER_SENSOR
from models.sensor import Design, FloatArray, Indenter, Padding, Sensor, design_from

FOAM = PAPER_SENSOR | {"padding_poisson_ratio": 0.3}


def test_defaults_are_full_disc_electrodes_half_the_sensor_and_one_silicone() -> None:
    design = design_from(PAPER_SENSOR)
    assert design.electrode_radius == 10e-3
    assert design.dielectric_thickness == 0.37e-3
    assert design.padding_young_modulus == 0.69e6


def test_rest_capacitance_is_two_parallel_plates() -> None:
    # C = 2 eps_0 eps_r A / t, the paper's Eq. (1), for 161 um dielectrics: about 97 pF.
    design = design_from(PAPER_SENSOR | {"dielectric_thickness": 0.161e-3})
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
        ({"padding_poisson_ratio": -0.1}, "padding_poisson_ratio must lie between 0 and 0.5, got -0.1"),
        ({"padding_poisson_ratio": np.array([0.5, 0.51])}, "padding_poisson_ratio must lie between 0 and 0.5, got 0.51"),
        ({"padding_poisson_ratio": np.nan}, "padding_poisson_ratio must lie between 0 and 0.5, got nan"),
        ({"padding_poisson_ratio": 0.3, "stiffening": 0.05}, "is neo-Hookean and does not stiffen with the sensor, got 0.3"),
        ({"dielectric_thickness": 0.4e-3}, "must not exceed half the sensor thickness, got 0.4 mm in a sensor of 0.74 mm"),
    ],
)
def test_impossible_values_are_refused_with_the_number(change: dict[str, float | FloatArray], words: str) -> None:
    with pytest.raises(ValueError, match=words.replace("(", r"\(").replace(")", r"\)")):
        design_from(PAPER_SENSOR | change)


def test_a_batch_gives_its_draws_back() -> None:
    modulus = np.array([0.5e6, 0.7e6, 0.9e6])
    batch = design_from(PAPER_SENSOR | {"young_modulus": modulus})
    assert batch.is_batch
    assert batch.draw(2).sensor.young_modulus == 0.9e6
    assert not batch.draw(2).is_batch
    np.testing.assert_array_equal(batch.draws().padding_young_modulus, modulus)


def test_what_follows_from_a_quantity_follows_when_that_is_changed() -> None:
    design = design_from(PAPER_SENSOR)
    thick = replace(design, sensor=replace(design.sensor, thickness=2e-3))
    assert thick.dielectric_thickness == 1e-3
    assert thick.rest_capacitance == pytest.approx(design.rest_capacitance * 0.74 / 2)
    wide = replace(design, sensor=replace(design.sensor, radius=20e-3))
    assert wide.electrode_radius == 20e-3
    assert wide.rest_capacitance == pytest.approx(design.rest_capacitance * 4)
    stiff = replace(design, sensor=replace(design.sensor, young_modulus=2e6))
    assert stiff.padding_young_modulus == 2e6
    assert thick.parameters() == design.parameters() | {"sensor_thickness": 2e-3, "dielectric_thickness": 1e-3}


def test_what_was_given_stays_when_another_quantity_is_changed() -> None:
    own = {"electrode_radius": 9e-3, "dielectric_thickness": 0.2e-3, "padding_young_modulus": 0.3e6}
    design = design_from(PAPER_SENSOR | own)
    other = replace(design, sensor=replace(design.sensor, thickness=2e-3, radius=20e-3, young_modulus=2e6))
    assert (other.electrode_radius, other.dielectric_thickness, other.padding_young_modulus) == tuple(own.values())
    with pytest.raises(ValueError, match=r"must not exceed half the sensor thickness, got 0\.2 mm in a sensor of 0\.3 mm"):
        replace(design.sensor, thickness=0.3e-3)


def test_what_follows_still_follows_in_a_batch_and_in_its_draws() -> None:
    modulus = np.array([0.5e6, 0.7e6, 0.9e6])
    batch = design_from(PAPER_SENSOR | {"young_modulus": modulus}).draws()
    thickness = np.array([1e-3, 2e-3, 3e-3])
    thick = replace(batch, sensor=replace(batch.sensor, thickness=thickness))
    np.testing.assert_array_equal(thick.dielectric_thickness, thickness / 2)
    np.testing.assert_array_equal(thick.draws().dielectric_thickness, thickness / 2)
    assert thick.draw(1).dielectric_thickness == 1e-3
    one = thick.draw(1)
    assert replace(one, sensor=replace(one.sensor, thickness=4e-3)).dielectric_thickness == 2e-3
    some = thick.only(np.array([True, False, True]))
    np.testing.assert_array_equal(some.padding_young_modulus, modulus[[0, 2]])
    moved = replace(some, sensor=replace(some.sensor, radius=np.array([5e-3, 6e-3])))
    np.testing.assert_array_equal(moved.electrode_radius, [5e-3, 6e-3])
    # One quantity that was given stays, draw by draw.
    given = replace(batch, sensor=replace(batch.sensor, dielectric_thickness=thickness / 10))
    np.testing.assert_array_equal(given.only(np.array([False, True, True])).dielectric_thickness, thickness[1:] / 10)


def test_a_design_is_made_again_from_what_was_given() -> None:
    for given in (PAPER_SENSOR, PAPER_SENSOR | {"dielectric_thickness": 0.2e-3, "padding_young_modulus": 0.3e6}, FOAM):
        design = design_from(given)
        assert design.given() == given | {"stiffening": 0.0, "friction_coefficient": 0.0, "base_friction_coefficient": 0.0}
        assert design_from(design.given()).parameters() == design.parameters()


def test_padding_is_as_incompressible_as_the_sensor_unless_it_is_said_to_be_a_foam() -> None:
    silicone, foam = design_from(PAPER_SENSOR), design_from(FOAM)
    assert (silicone.padding.poisson_ratio, silicone.padding_poisson_ratio, foam.padding_poisson_ratio) == (None, 0.5, 0.3)
    assert not silicone.padding_is_compressible
    assert not design_from(PAPER_SENSOR | {"padding_poisson_ratio": 0.5}).padding_is_compressible
    assert foam.padding_is_compressible
    np.testing.assert_array_equal(silicone.draws().padding_poisson_ratio, [0.5])
    # Where there is none, its Poisson's ratio means nothing.
    some = design_from(FOAM | {"padding_thickness": np.array([1e-3, 0.0]), "padding_poisson_ratio": 0.3})
    np.testing.assert_array_equal(some.padding_is_compressible, [True, False])
    assert design_from(FOAM | {"padding_thickness": 0.0, "stiffening": 0.05}).sensor.stiffening == 0.05


def test_a_missing_number_is_no_number() -> None:
    for name in ("electrode_radius", "dielectric_thickness", "padding_young_modulus"):
        with pytest.raises(ValueError, match=f"{name} must be positive, got nan"):
            design_from(PAPER_SENSOR | {name: float("nan")})


def test_no_padding_is_a_design() -> None:
    design = Design(Indenter(5e-3), Sensor(1e-3, 10e-3, 1e6, 2.8), Padding(0.0))
    assert design.total_thickness == 1e-3


def test_friction_on_the_base_is_that_of_a_slippery_one() -> None:
    friction = np.array([0.0, 0.3, np.inf])
    batch = design_from(PAPER_SENSOR | {"base_friction_coefficient": friction}, base="slippery")
    assert [batch.draw(k).padding.base_friction_coefficient for k in range(3)] == friction.tolist()
    with pytest.raises(ValueError, match=r"base_friction_coefficient must not be negative, got -0\.1"):
        design_from(PAPER_SENSOR | {"base_friction_coefficient": -0.1}, base="slippery")
    with pytest.raises(ValueError, match=r"is that of a slippery base, got 0\.3 on one that is bonded"):
        design_from(PAPER_SENSOR | {"base_friction_coefficient": 0.3})

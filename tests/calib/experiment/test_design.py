"""Design files: the simple sensor on padding, layers of any kind, and every fault with its place."""

from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.experiment.design import read_design
from models.laws import Gent, MooneyRivlin, NeoHookean, Ogden, Yeoh
from models.layers import LayeredDesign, cone, flat_punch, layered, sphere
from models.sensor import Design


def write(folder: Path, text: str) -> Path:
    path = folder / "design.toml"
    path.write_text(text, encoding="utf-8")
    return path


DESIGN = """\
[indenter]
radius = "5 mm"
friction_coefficient = 0.3
[sensor]
thickness = "0.74 mm"
radius = "10 mm"
young_modulus = "0.69 MPa"
relative_permittivity = 2.8
electrode_radius = "9 mm"
dielectric_thickness = "0.16 mm"
[padding]
thickness = "1.10 mm"
young_modulus = "0.3 MPa"
"""


def test_sensor_and_padding_of_one_gent_law_are_a_design_with_stiffening(tmp_path: Path) -> None:
    law = "law = { gent = { locking = 40 } }\n"
    both = DESIGN.replace("[sensor]\n", f"[sensor]\n{law}", 1).replace("[padding]\n", f"[padding]\n{law}", 1)
    design = read_design(write(tmp_path, both))
    assert isinstance(design, Design)
    assert design.sensor.stiffening == pytest.approx(1 / 40)
    assert {layer.law for layer in layered(design).layers} == {Gent(40.0)}
    other = both.replace("locking = 40", "locking = 50", 1)
    assert isinstance(read_design(write(tmp_path, other)), LayeredDesign)


def test_a_design_is_read(tmp_path: Path) -> None:
    design = read_design(write(tmp_path, DESIGN))
    assert isinstance(design, Design)
    assert design.indenter.friction_coefficient == 0.3
    assert design.parameters() == {
        "indenter_radius": 5e-3,
        "sensor_thickness": 0.74e-3,
        "sensor_radius": 10e-3,
        "young_modulus": 0.69e6,
        "relative_permittivity": 2.8,
        "electrode_radius": 9e-3,
        "dielectric_thickness": 0.16e-3,
        "padding_thickness": 1.1e-3,
        "padding_young_modulus": 0.3e6,
        "padding_poisson_ratio": 0.5,
        "stiffening": 0.0,
        "friction_coefficient": 0.3,
        "base_friction_coefficient": 0.0,
    }


def test_what_a_design_leaves_out_is_derived(tmp_path: Path) -> None:
    optional = ("friction", "electrode", "dielectric", 'young_modulus = "0.3')
    design = read_design(write(tmp_path, "\n".join(line for line in DESIGN.splitlines() if not line.startswith(optional))))
    assert isinstance(design, Design)
    assert design.indenter.friction_coefficient == 0
    assert design.electrode_radius == 10e-3
    assert design.dielectric_thickness == 0.37e-3
    assert design.padding_young_modulus == 0.69e6


def test_a_design_without_padding_is_zero_thick(tmp_path: Path) -> None:
    design = read_design(write(tmp_path, DESIGN.replace("1.10 mm", "0 mm")))
    assert isinstance(design, Design)
    assert design.padding.thickness == 0


@pytest.mark.parametrize(
    ("old", "new", "place", "parts"),
    [
        ('"0.74 mm"', '"-0.74 mm"', "5:1", ["sensor_thickness must be positive, got -0.74 mm"]),
        ('"0.74 mm"', "0.74", "5:1", ['sensor_thickness has no unit, got 0.74. Write "0.74 mm"']),
        (
            '"0.74 mm"',
            '"0.2 mm"',
            "10:1",
            ["dielectric_thickness", "half the sensor thickness, got 0.16 mm in a sensor of 0.2 mm"],
        ),
        ('"9 mm"', '"11 mm"', "9:1", ["disc radius, got 11 mm on a disc of 10 mm"]),
        ('"1.10 mm"', '"-1 mm"', "12:1", ["padding_thickness must not be negative, got -1 mm"]),
        ("= 0.3\n", "= -0.3\n", "3:1", ['friction_coefficient must be a plain number of zero or more, or "stick", got -0.3']),
        ("= 0.3\n", '= "0.3"\n', "3:1", ["friction_coefficient"]),
        ("young_modulus", "youngs_modulus", "7:1", ['unknown key "youngs_modulus" in [sensor]', '"young_modulus"']),
        (
            "relative_permittivity = 2.8\n",
            "",
            "4:1",
            ["relative_permittivity is missing. Give relative_permittivity = 2.8 in [sensor]"],
        ),
        (
            '"0.3 MPa"\n',
            '"0.3 MPa"\npoisson_ratio = 0.6\n',
            "14:1",
            ["poisson_ratio must be a plain number from 0 to 0.5, got 0.6. Leave it out for rubber"],
        ),
        ('"0.3 MPa"\n', '"0.3 MPa"\npoisson_ratio = "0.3"\n', "14:1", ["must be a plain number from 0 to 0.5"]),
        ('"0.3 MPa"\n', '"0.3 MPa"\npoisson_ratio = nan\n', "14:1", ["must be a plain number from 0 to 0.5, got nan"]),
        (
            '"0.3 MPa"\n',
            '"0.3 MPa"\npoisson_ratio = 0.3\nlaw = { gent = { locking = 40 } }\n',
            "15:1",
            ["a foam (poisson_ratio = 0.3) is neo-hookean, got gent. Leave out its law, or its poisson_ratio"],
        ),
        (
            "relative_permittivity = 2.8\n",
            "relative_permittivity = 2.8\npoisson_ratio = 0.49\n",
            "9:1",
            ['unknown key "poisson_ratio" in [sensor]', "a foam may stand in [padding]"],
        ),
        ("[padding]", "[pading]", "11:1", ['unknown key "pading" at the top of the file', '"padding"']),
        (
            '[padding]\nthickness = "1.10 mm"\nyoung_modulus = "0.3 MPa"\n',
            "",
            "1:1",
            ["padding_thickness is missing", '"0 mm" for none'],
        ),
    ],
)
def test_a_fault_of_a_design_is_told_with_its_place(tmp_path: Path, old: str, new: str, place: str, parts: list[str]) -> None:
    assert old in DESIGN
    with pytest.raises(InputError) as caught:
        read_design(write(tmp_path, DESIGN.replace(old, new, 1)))
    (fault,) = caught.value.faults
    assert f"{fault.line}:{fault.column}" == place
    for part in parts:
        assert part in str(fault)


def test_a_padding_with_a_poisson_ratio_is_a_foam(tmp_path: Path) -> None:
    foam = DESIGN.replace("[padding]\n", "[padding]\npoisson_ratio = 0\n", 1)
    design = read_design(write(tmp_path, foam))
    assert isinstance(design, Design)
    assert design.padding_poisson_ratio == 0
    foam_layer = layered_design(tmp_path, LAYERS + "poisson_ratio = 0.25\n")
    assert [x.poisson_ratio for x in foam_layer.layers] == [0.5, 0.5, 0.25]
    # Below a sensor that stiffens it is a layer of its own.
    gent = layered_design(tmp_path, foam.replace("[sensor]\n", "[sensor]\nlaw = { gent = { locking = 40 } }\n", 1))
    assert [(x.law, x.poisson_ratio) for x in gent.layers] == [(NeoHookean(), 0.0), (Gent(40.0), 0.5)]


def test_all_faults_of_a_design_are_reported_at_once(tmp_path: Path) -> None:
    text = DESIGN.replace('"0.74 mm"', '"0.74 kg"').replace('"1.10 mm"', "1.1").replace('"5 mm"', '"0 mm"')
    with pytest.raises(InputError) as caught:
        read_design(write(tmp_path, text))
    assert [fault.line for fault in caught.value.faults] == [2, 5, 12]


def layered_design(tmp_path: Path, text: str) -> LayeredDesign:
    design = read_design(write(tmp_path, text))
    assert isinstance(design, LayeredDesign)
    return design


def test_laws_base_and_stick_make_a_layered_design(tmp_path: Path) -> None:
    text = 'base = "slippery"\n' + DESIGN.replace("= 0.3\n[sensor]", '= "stick"\n[sensor]\nlaw = { gent = { locking = 40 } }')
    design = layered_design(tmp_path, text)
    assert (design.base, design.friction_coefficient, design.profile) == ("slippery", np.inf, sphere(5e-3))
    assert [(x.name, x.thickness, x.young_modulus, x.law) for x in design.layers] == [
        ("padding", 1.1e-3, 0.3e6, NeoHookean()),
        ("sensor", 0.74e-3, 0.69e6, Gent(40.0)),
    ]
    assert (design.radius, design.electrode_radius) == (10e-3, 9e-3)
    assert [(d.lower, d.upper) for d in design.dielectrics] == [
        pytest.approx((1.31e-3, 1.47e-3)),
        pytest.approx((1.47e-3, 1.63e-3)),
    ]


def test_stick_alone_stays_a_simple_design(tmp_path: Path) -> None:
    design = read_design(write(tmp_path, DESIGN.replace("= 0.3\n[sensor]", '= "stick"\n[sensor]')))
    assert isinstance(design, Design)
    assert design.indenter.friction_coefficient == np.inf


@pytest.mark.parametrize(
    ("written", "law"),
    [
        ("{ mooney-rivlin = { c01_share = 0.2 } }", MooneyRivlin(0.2)),
        ("{ yeoh = { c2 = 0.02 } }", Yeoh(0.02)),
        ("{ yeoh = { c2 = 0.02, c3 = 0.001 } }", Yeoh(0.02, 0.001)),
        ("{ ogden = { shares = [1.2, -0.2], exponents = [1.3, -2] } }", Ogden((1.2, -0.2), (1.3, -2.0))),
    ],
)
def test_every_law_can_be_written(tmp_path: Path, written: str, law: object) -> None:
    design = layered_design(tmp_path, 'base = "slippery"\n' + DESIGN + f"law = {written}\n")
    assert design.layers[0].law == law


def test_a_base_alone_asks_for_no_stack_of_layers(tmp_path: Path) -> None:
    design = read_design(write(tmp_path, 'base = "slippery"\n' + DESIGN + 'law = "neo-hookean"\n'))
    assert isinstance(design, Design)
    assert (design.base, design.indenter.friction_coefficient) == ("slippery", 0.3)


@pytest.mark.parametrize(("written", "friction"), [("0.4", 0.4), ('"stick"', np.inf)])
@pytest.mark.parametrize("text", ["design", "layers"])
def test_a_base_may_rub(tmp_path: Path, text: str, written: str, friction: float) -> None:
    top = f'base = "slippery"\nbase_friction_coefficient = {written}\n'
    design = read_design(write(tmp_path, top + {"design": DESIGN, "layers": LAYERS}[text]))
    design = layered(design) if isinstance(design, Design) else design
    assert (design.base, design.base_friction_coefficient) == ("slippery", friction)


@pytest.mark.parametrize(
    ("top", "place", "parts"),
    [
        ("base_friction_coefficient = 0.4\n", "1:1", ["is that of a slippery base, got 0.4", 'with base = "bonded"']),
        (
            'base = "slippery"\nbase_friction_coefficient = -1\n',
            "2:1",
            ["base_friction_coefficient must be a plain number", "got -1"],
        ),
    ],
)
def test_friction_of_a_base_that_cannot_be_is_refused_where_it_stands(
    tmp_path: Path, top: str, place: str, parts: list[str]
) -> None:
    with pytest.raises(InputError) as error:
        read_design(write(tmp_path, top + DESIGN))
    assert f"design.toml:{place}: " in str(error.value)
    assert all(part in str(error.value) for part in parts)


@pytest.mark.parametrize(
    ("written", "profile"),
    [
        ('shape = "flat punch"\nradius = "4 mm"\nedge_radius = "0.2 mm"', flat_punch(4e-3, 0.2e-3)),
        ('shape = "cone"\nhalf_angle = "60 deg"\ntip_radius = "0.5 mm"', cone(np.pi / 3, 0.5e-3)),
    ],
)
def test_other_indenters_can_be_written(tmp_path: Path, written: str, profile: object) -> None:
    assert layered_design(tmp_path, DESIGN.replace('radius = "5 mm"', written, 1)).profile == profile


LAYERS = """\
[indenter]
radius = "5 mm"
[disc]
radius = "10 mm"
[[layers]]
name = "padding"
thickness = "1.1 mm"
young_modulus = "0.3 MPa"
[[layers]]
thickness = "0.2 mm"
young_modulus = "0.69 MPa"
relative_permittivity = 2.8
law = { yeoh = { c2 = 0.02 } }
[[layers]]
name = "cover"
thickness = "50 um"
young_modulus = "1.2 MPa"
"""


def test_any_stack_of_layers_is_read_from_the_base_up(tmp_path: Path) -> None:
    design = layered_design(tmp_path, LAYERS)
    assert [x.name for x in design.layers] == ["padding", "layer 2", "cover"]
    assert [x.thickness for x in design.layers] == [1.1e-3, 0.2e-3, 50e-6]
    assert design.layers[1].law == Yeoh(0.02)
    assert [x.poisson_ratio for x in design.layers] == [0.5, 0.5, 0.5]
    (dielectric,) = design.dielectrics
    assert (dielectric.lower, dielectric.upper, dielectric.relative_permittivity) == pytest.approx((1.1e-3, 1.3e-3, 2.8))
    assert design.electrode_radius == 10e-3


@pytest.mark.parametrize(
    ("text", "place", "parts"),
    [
        (
            LAYERS.replace("relative_permittivity = 2.8\n", ""),
            "5:3",
            ["no layer is a dielectric", "relative_permittivity = 2.8"],
        ),
        (LAYERS.replace('"0.2 mm"', '"-0.2 mm"'), "10:1", ["thickness must be positive, got -0.2 mm"]),
        (LAYERS + "poisson_ratio = -0.1\n", "18:1", ["poisson_ratio must be a plain number from 0 to 0.5, got -0.1"]),
        (LAYERS.replace("c2 = 0.02 } }", "c2 = 0.02 } }\npoisson_ratio = 0.3"), "13:1", ["is neo-hookean, got yeoh"]),
        (LAYERS.replace('"0.2 mm"', "0.2"), "10:1", ["thickness must be a quantity in quotes, got 0.2"]),
        (LAYERS.replace('"1.2 MPa"', '"1.2 mm"'), "17:1", ['young_modulus: unit "mm" cannot be converted to Pa']),
        (LAYERS.replace('thickness = "50 um"\n', ""), "14:1", ["thickness is missing. Give thickness ="]),
        (
            LAYERS.replace("law = { yeoh = { c2 = 0.02 } }", 'law = "rubber"'),
            "13:1",
            ['unknown law "rubber"', "Known are neo-hookean"],
        ),
        (LAYERS.replace("c2 = 0.02", "c4 = 0.02"), "13:1", ['unknown shape parameter "c4" of yeoh', "It has c2, c3"]),
        (LAYERS.replace("{ c2 = 0.02 }", "{ c3 = 0.02 }"), "13:1", ["yeoh needs c2"]),
        (LAYERS.replace("yeoh = { c2 = 0.02 }", 'gent = { locking = "40" }'), "13:1", ["locking must be a plain number, got"]),
        (LAYERS.replace("yeoh = { c2 = 0.02 }", "gent = { locking = -4 }"), "13:1", ["gent: locking must be positive, got -4"]),
        (LAYERS.replace('[disc]\nradius = "10 mm"\n', ""), "1:1", ["sensor_radius is missing"]),
        (LAYERS + '[padding]\nthickness = "1 mm"\n', "18:1", ['unknown key "padding" at the top of the file']),
        (
            'base = "slipery"\n' + LAYERS,
            "1:1",
            ['base must be "bonded" or "slippery", got "slipery"', 'Did you mean "slippery"'],
        ),
        (
            LAYERS.replace("[indenter]\n", '[indenter]\nshape = "cone"\n'),
            "1:1",
            ['unknown key "radius" in [indenter]', "half_angle is missing"],
        ),
        (
            LAYERS.replace('radius = "5 mm"', 'shape = "flat punch"\nradius = "5 mm"\nedge_radius = "6 mm"', 1),
            "1:1",
            ["edge radius 6 mm exceeds the cylinder's 5 mm"],
        ),
    ],
)
def test_a_fault_of_a_layered_design_is_told_with_its_place(tmp_path: Path, text: str, place: str, parts: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        read_design(write(tmp_path, text))
    fault = caught.value.faults[0]
    assert f"{fault.line}:{fault.column}" == place
    said = "\n".join(str(f) for f in caught.value.faults)
    for part in parts:
        assert part in said

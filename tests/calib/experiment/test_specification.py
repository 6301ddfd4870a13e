"""Specification files as people write them: what is understood, and everything that is wrong at once, with its place."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from calib.errors import InputError
from calib.experiment.schema import specification_schema
from calib.experiment.specification import Limit, Specification, Tolerance, specification_from_plain
from calib.experiment.specification_file import read_specification, specification_from
from calib.priors import LogNormal, TruncatedNormal, Uniform

SHIPPED = Path(__file__).parents[3] / "datasets" / "padded_sensor" / "specification.toml"
SCHEMA = Draft202012Validator(specification_schema())


def _documented() -> dict[str, Any]:
    block = str(read_specification.__doc__).split("of the form::")[1].split("n_draw : how many")[0]
    return tomllib.loads("\n".join(line.strip() for line in block.splitlines()))


def _tables(**more: Any) -> dict[str, Any]:
    tables: dict[str, Any] = {"loads": {"force": "10 N"}, "limits": {"signal": {"at_least": 0.08}}}
    for name, values in more.items():
        tables[name] = values if name in ("limits", "probability") else {**tables.get(name, {}), **values}
    return tables


def test_what_is_documented_is_read_and_accepted_by_the_schema() -> None:
    tables = _documented()
    spec = specification_from(tables)
    assert spec.limits[0] == Limit("signal", "at_least", 0.08, at=10.0)
    assert (spec.force, spec.ball, spec.probability) == ((10.0,), (5e-3,), 0.95)
    assert spec.padding_tolerance == Tolerance("uniform", 1e-4)
    assert spec.gauge == pytest.approx(2e-5)
    assert spec.materials[0].name == "soft silicone"
    assert (spec.modulus_spread, spec.permittivity_spread) == (0.05, 0.01)
    assert not list(SCHEMA.iter_errors(tables))


def test_what_is_shipped_is_read_and_accepted_with_all_that_is_commented_out() -> None:
    text = SHIPPED.read_text(encoding="utf-8")
    for whole in (
        text,
        text.replace("\n# thickness", "\nthickness").replace("\n# electrode", "\nelectrode").replace("\n# ball", "\nball"),
    ):
        tables = tomllib.loads(whole)
        assert not list(SCHEMA.iter_errors(tables))
        assert specification_from(tables).name == "Finger tip"
    assert read_specification(SHIPPED) == specification_from(tomllib.loads(text))


def test_ranges_lists_distributions_and_curvatures_are_what_they_say() -> None:
    spec = specification_from(
        _tables(loads={"force": {"range": ["1 N", "10 N"], "steps": 4}, "curvature": ["0.2 1/mm", "0.25 1/mm"]})
    )
    assert spec.force == (1.0, 4.0, 7.0, 10.0)
    assert spec.ball == pytest.approx((5e-3, 4e-3))
    spec = specification_from(
        _tables(loads={"force": {"uniform": ["5 N", "10 N"]}, "curvature": {"lognormal": ["0.2 1/mm", 1.1]}})
    )
    assert spec.force == Uniform(5.0, 10.0)
    assert (spec.ball, spec.by_curvature) == (LogNormal(200.0, 1.1), True)
    assert spec.largest_force == pytest.approx(9.75, abs=0.01)
    assert specification_from_plain(spec.to_plain()) == spec


def test_a_load_may_come_down_to_nothing_where_it_is_cut_off() -> None:
    force = specification_from(_tables(loads={"force": {"truncated_normal": ["3 N", "1 N", "0 N", "5 N"]}})).force
    assert force == TruncatedNormal(3.0, 1.0, 0.0, 5.0)


def test_all_faults_of_a_file_are_told_at_once_each_with_line_and_column(tmp_path: Path) -> None:
    path = tmp_path / "spec.toml"
    path.write_text(
        """probability = 1.5
[loads]
force = "10 mm"
ball = "-5 mm"
[limits]
signal = { at_least = 8 }
stroke = { at_most = "2 mm", at_least = "3 mm" }
heigth = { at_most = "7 mm" }
[padding]
thickness = ["9 mm", "1 mm"]
tolerance = "0.1 mm"
""",
        encoding="utf-8",
    )
    with pytest.raises(InputError) as raised:
        read_specification(path)
    places = [(fault.line, fault.column) for fault in raised.value.faults]
    assert places == sorted(places)
    said = str(raised.value)
    for told in (
        'spec.toml:3:1: force: unit "mm" cannot be converted to N',
        "spec.toml:4:1: ball must be positive, got -5 mm",
        'spec.toml:8:1: unknown key "heigth" in [limits]. Did you mean "height"?',
        "spec.toml:11:1: tolerance must say which kind of tolerance it is",
    ):
        assert told in said
    path.write_text(
        path.read_text().replace('"10 mm"', '"10 N"').replace("-5", "5").replace("heigth", "height"), encoding="utf-8"
    )
    path.write_text(path.read_text().replace('tolerance = "0.1 mm"', ""), encoding="utf-8")
    with pytest.raises(InputError) as raised:
        read_specification(path)
    said = str(raised.value)
    for told in (
        "spec.toml:1:1: probability must be from 0.5 to below 1, got 1.5",
        "spec.toml:6:1: signal must be below 1, got 800 %. Write 8 percent as 0.08",
        "spec.toml:7:1: nothing has a stroke of at least 3 mm and at most 2 mm",
        "spec.toml:10:1: the padding range is empty: 9 mm to 1 mm",
    ):
        assert told in said


BAD: tuple[tuple[dict[str, Any], str], ...] = (
    ({"limits": {}}, "there are no limits"),
    ({"loads": {"force": []}}, "force is an empty list"),
    ({"loads": {"force": "0 N"}}, "force must be positive, got 0 N"),
    ({"loads": {"force": "10 uN"}}, "force cannot be 1e-05 N. Check the letters of the unit"),
    ({"loads": {"ball": "5 m"}}, "ball cannot be 5e+03 mm"),
    ({"loads": {"force": 10}}, "force must be a quantity in quotes, got 10"),
    ({"loads": {"force": {"range": ["10 N", "1 N"]}}}, "the range of forces is upside down or empty: 10 N to 1 N"),
    ({"loads": {"force": {"range": ["1 N", "10 N"], "steps": 1}}}, "steps must be a whole number from 2 to 50, got 1"),
    ({"loads": {"force": {"cauchy": ["5 N", "1 N"]}}}, 'force takes one kind of distribution, got "cauchy"'),
    ({"loads": {"force": {"lognormal": ["5 N", 1e9]}}}, "force has a distribution that no sensor could meet"),
    ({"loads": {"force": {"lognormal": ["5 N", "inf"]}}}, "is not a number with a unit"),
    ({"loads": {"force": {"normal": ["5 N", "5 N"]}}}, "5 is too wide a standard deviation about 5 N"),
    ({"loads": {"force": {"uniform": ["10 N", "5 N"]}}}, "low must be below high"),
    ({"loads": {"force": {"uniform": ["10 N", "5 N"]}}}, "Write { uniform = [low, high] }"),
    ({"limits": {"force_resolution": {"at_least": "20 mN"}}}, "asks for readings that tell no less. Write at_most"),
    ({"loads": {"force": [f"{k} N" for k in range(1, 80)]}}, "79 values of force, more than 50"),
    ({"loads": {"force": ["5 N", "5 N"]}}, "force names a value twice"),
    ({"loads": {"ball": "5 mm", "curvature": "0.2 1/mm"}}, "ball and curvature say the same"),
    ({"limits": {"signal": {"at_least": 0.1, "at": "5 N"}}}, "the limit counts at 5 N, which is none of the loads"),
    ({"limits": {"height": {"at_most": "7 mm", "at": "10 N"}}}, "height does not depend on a load"),
    ({"limits": {"signal": {"at_least": -0.1}}}, "at_least must be positive, got -0.1"),
    ({"limits": {"stroke": "2 mm"}}, 'stroke must say at_least or at_most, got "2 mm"'),
    ({"limits": {"stroke": {}}}, "stroke says neither at_least nor at_most"),
    ({"limits": {"stroke": {"at_most": 2}}}, "at_most must be a quantity in quotes, got 2"),
    ({"padding": {"thickness": "5 mm"}}, "thickness of the padding takes the two ends of a range"),
    ({"padding": {"steps": 100_000}}, "steps must be from 3 to 1001, got 100000"),
    ({"padding": {"tolerance": {"uniform": "0 mm"}}}, "must be positive, got 0 mm"),
    ({"padding": {"gauge": "-1 um"}}, "gauge must not be negative"),
    ({"padding": {"guard_band": 50}}, "guard_band must be from 0 to 10, got 50"),
    ({"padding": {"materials": [{"name": "a"}]}}, "young_modulus is missing"),
    (
        {"padding": {"materials": [{"name": "a", "young_modulus": "1 MPa", "law": "ogden"}]}},
        "A material has the law of the run",
    ),
    ({"padding": {"materials": [{"name": "a", "young_modulus": "1 MPa", "poisson_ratio": 0.6}]}}, "between 0 and 0.5, got 0.6"),
    ({"padding": {"materials": [{"name": "a", "young_modulus": "1 MPa"}] * 2}}, 'the material "a" is there twice'),
    ({"sensor": {"electrode_radius": {"uniform": ["5 mm", "8 mm"]}}}, "is chosen among values, not distributed"),
    ({"spread": {"young_modulus": 5}}, "spread of young_modulus must lie between 0 and 0.5, got 5"),
    ({"sensor": {"thickness": [f"{k} mm" for k in range(1, 40)], "electrode_radius": ["5 mm", "6 mm"]}}, "78 combinations"),
    ({"probability": 0.2}, "probability must be from 0.5 to below 1, got 0.2"),
)


@pytest.mark.parametrize(("more", "message"), BAD, ids=[message for _, message in BAD])
def test_a_specification_that_makes_no_sense_is_refused_with_the_reason(more: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as raised:
        specification_from(_tables(**more))
    assert message in str(raised.value)


def test_a_file_of_thousands_of_keys_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "spec.toml"
    path.write_text("".join(f"k{i} = 1\n" for i in range(10_000)), encoding="utf-8")
    with pytest.raises(InputError, match="10000 unknown keys at the top of the file") as raised:
        read_specification(path)
    assert len(raised.value.faults) < 5


def test_one_that_is_built_in_python_is_checked_in_the_same_way() -> None:
    with pytest.raises(InputError, match="force must be positive, got -1 N"):
        Specification((Limit("signal", "at_least", 0.1),), (-1.0,))
    with pytest.raises(InputError, match="a specification without limits always holds"):
        Specification((), (1.0,))


@pytest.mark.parametrize(
    "more",
    [
        {"loads": {"force": 10}},
        {"loads": {"ball": "5 mm", "curvature": "0.2 1/mm"}},
        {"limits": {}},
        {"limits": {"stroke": {}}},
        {"limits": {"height": {"at_most": "7 mm", "at": "10 N"}}},
        {"limits": {"force_resolution": {"at_least": "20 mN"}}},
        {"padding": {"tolerance": "0.1 mm"}},
        {"padding": {"tolerance": {"uniform": "0.1 mm", "normal": "0.1 mm"}}},
        {"padding": {"thickness": ["1 mm"]}},
        {"padding": {"materials": [{"name": "a"}]}},
        {"sensor": {"electrode_radius": {"uniform": ["5 mm", "8 mm"]}}},
    ],
)
def test_the_schema_refuses_the_usual_mistakes(more: dict[str, Any]) -> None:
    assert not SCHEMA.is_valid(_tables(**more))

"""Quantities: a text with a unit becomes an SI number, or is refused with the reason."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from calib.of_pint import factor_of_pint
from calib.quantity import parse_quantity, unit_factor


@pytest.mark.parametrize(
    ("text", "si_unit", "expected"),
    [
        ("0.74 mm", "m", 0.74e-3),
        ("0.03 mm", "m", 3e-5),
        ("0.74mm", "m", 0.74e-3),
        ("-.5 mm", "m", -0.5e-3),
        ("−0.5 mm", "m", -0.5e-3),
        ("1e-3 m", "m", 1e-3),
        ("0.1 µm", "m", 1e-7),
        ("0.1 μm", "m", 1e-7),
        ("0.7 MPa", "Pa", 0.7e6),
        ("0.7 N/mm^2", "Pa", 0.7e6),
        ("97.3 pF", "F", 97.3e-12),
        ("20 fF", "F", 20e-15),
        ("5 um/N", "m/N", 5e-6),
        ("5 µm/N", "m/N", 5e-6),
        ("500 mN", "N", 0.5),
        ("1 kgf", "N", 9.80665),
        ("2 min", "s", 120.0),
        ("2.8", "", 2.8),
        ("1 %", "", 0.01),
    ],
)
def test_a_text_with_a_unit_becomes_the_si_number_to_the_last_digit(text: str, si_unit: str, expected: float) -> None:
    assert parse_quantity(text, si_unit) == expected


@pytest.mark.parametrize(
    ("text", "si_unit", "message"),
    [
        ("", "m", "is not a number with a unit"),
        ("mm", "m", "is not a number with a unit"),
        ("nan mm", "m", "is not a number with a unit"),
        ("0.74", "m", '"0.74" has no unit, write for example "0.74 mm"'),
        ("0,74 mm", "m", "decimal comma"),
        ("1e999 mm", "m", "is not a finite number"),
        ("1e308 Mm", "m", "is not a finite number"),
        *((f"5 mm{more}", "m", f'unknown unit "mm{more}"') for more in ('"', "’", "€", "%", ".", "; 10 mm", " # 10 mm")),
        ("5 mm\u200b", "m", "unknown unit"),
        ("0.7 mm", "Pa", 'unit "mm" cannot be converted to Pa'),
        ("0.7 mm", "", "cannot be converted to a plain number"),
        ("0.7 Mpa", "Pa", 'unknown unit "Mpa", did you mean "MPa"?'),
        ("3 pf", "F", 'did you mean "pF"?'),
        ("1 MM", "m", 'did you mean "mm"?'),
        ("5 furlings", "m", 'unknown unit "furlings"$'),
        ("5 degC", "m", "degC"),
        ("5 2 mm", "m", "unknown unit"),
    ],
)
def test_what_is_no_quantity_is_refused_with_the_reason(text: str, si_unit: str, message: str) -> None:
    with pytest.raises(ValueError, match=message.replace("?", r"\?")):
        parse_quantity(text, si_unit)


@pytest.mark.parametrize("si_unit", ["m", "N", "Pa", "F", "s", "m/N", "Hz"])
def test_units_with_a_prefix_are_what_pint_says(si_unit: str) -> None:
    for prefix in ("f", "p", "n", "u", "µ", "m", "", "k", "M", "G"):
        assert unit_factor(f"{prefix}{si_unit}", si_unit) == pytest.approx(
            factor_of_pint(f"{prefix}{si_unit}", si_unit), rel=1e-12
        )


def test_reading_a_file_of_usual_units_does_not_load_what_takes_long(tmp_path: Path) -> None:
    path = tmp_path / "press.csv"
    path.write_text("Time (s),Extension (mm),Load (N)\n" + "".join(f"{k / 10},{k / 100},{k / 50}\n" for k in range(30)))
    code = (
        "import sys, pathlib; from calib.lab import read_lab_file; "
        "read_lab_file(pathlib.Path(sys.argv[1])); print('pint' in sys.modules)"
    )
    found = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
    assert found.stdout == "False\n"


def test_decimal_prefixes_are_exact() -> None:
    assert [unit_factor(u, "F") for u in ("pF", "nF", "uF", "F")] == [1e-12, 1e-9, 1e-6, 1.0]

"""Who measured, when and with what: read, written and kept as it is said, and refused where it cannot be meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from calib.errors import InputError
from calib.experiment import Instrument, Laboratory, experiment_from_json, experiment_to_json, experiment_toml, read_experiment

PLAN = """
{top}
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
[[specimens]]
name = "a"
force = "a.csv"
[specimens.priors]
sensor_thickness = {{ fixed = "0.74 mm" }}
padding_thickness = {{ fixed = "1.10 mm" }}
{end}
"""
SAID = """
[laboratory]
name = "Soft Sensors"
operator = "A. \\"Person\\""
email = "a@b.org"
city = "Auckland"
country = "NZ"
customer = "Grippers"
measured = [2026-03-17, "2026-03-18"]
[[instruments]]
kind = "load cell"
maker = "Instron"
model = "2530"
serial = "12345"
calibrated = 2026-01-12
class = "0.5"
[[instruments]]
kind = "ball"
"""
LABORATORY = Laboratory("Soft Sensors", 'A. "Person"', "a@b.org", "Auckland", "NZ", "Grippers", "2026-03-17", "2026-03-18")
INSTRUMENTS = (Instrument("load cell", "Instron", "2530", "12345", "2026-01-12", "0.5"), Instrument("ball"))


def _plan(folder: Path, end: str = "", top: str = "") -> Path:
    (folder / "a.csv").write_text("")
    (folder / "experiment.toml").write_text(PLAN.format(top=top, end=end), encoding="utf-8")
    return folder / "experiment.toml"


def test_it_is_read_kept_with_a_run_and_written_as_it_was_said(tmp_path: Path) -> None:
    experiment = read_experiment(_plan(tmp_path, SAID))
    assert experiment.laboratory == LABORATORY
    assert experiment.instruments == INSTRUMENTS
    kept = experiment_from_json(experiment_to_json(experiment))
    assert (kept.laboratory, kept.instruments) == (LABORATORY, INSTRUMENTS)
    (tmp_path / "next.toml").write_text(experiment_toml(experiment, tmp_path, {}), encoding="utf-8")
    again = read_experiment(tmp_path / "next.toml")
    assert (again.laboratory, again.instruments) == (LABORATORY, INSTRUMENTS)


def test_nothing_has_to_be_said_and_one_line_each_will_do(tmp_path: Path) -> None:
    experiment = read_experiment(_plan(tmp_path))
    assert experiment.laboratory == Laboratory()
    assert experiment.instruments == ()
    top = 'laboratory = { operator = "A", measured = "2026-03-17" }\ninstruments = [{ kind = "ball" }]'
    experiment = read_experiment(_plan(tmp_path, top=top))
    assert (experiment.laboratory.measured, experiment.laboratory.measured_until) == ("2026-03-17", "2026-03-17")
    assert experiment.instruments == (Instrument("ball"),)


@pytest.mark.parametrize(
    ("end", "message"),
    [
        ('[laboratory]\nopertor = "A"', 'unknown key "opertor" in [laboratory]. Did you mean "operator"?'),
        ('[[instruments]]\nkind = "ball"\nserail = "1"', 'unknown key "serail" in [[instruments]]. Did you mean "serial"?'),
        ('[[instruments]]\nserial = "1"', "kind is missing"),
        ('[[instruments]]\nkind = "ball"\nserial = 12', "serial must be a text in quotes, got 12"),
        ('[instruments]\nkind = "ball"', "[instruments] must be a list of tables"),
        (
            '[laboratory]\ncountry = "New Zealand"',
            'country must be two letters that ISO 3166-1 has, got "New Zealand". Did you mean "NZ" (New Zealand)?',
        ),
        ('[laboratory]\ncountry = "UK"', 'got "UK". Did you mean "GB" ('),
        ('[laboratory]\ncountry = "XX"', 'country must be two letters that ISO 3166-1 has, got "XX". Did you mean "'),
        ('[laboratory]\ncountry = "nz"', 'Did you mean "NZ" (New Zealand)?'),
        ('[laboratory]\ncountry = "Atlantis"', "or leave it out and give city"),
        ('[laboratory]\nemail = "nobody"', 'email must be an address, got "nobody"'),
        ('[laboratory]\nmeasured = "2026-02-30"', 'measured must be a day, got "2026-02-30"'),
        ('[laboratory]\nmeasured = "17.3.2026"', 'measured must be a day, got "17.3.2026"'),
        ("[laboratory]\nmeasured = 2026-03-17T08:00:00", "measured must be a day, got 2026-03-17 08:00:00"),
        (
            '[laboratory]\nmeasured = ["2026-03-18", "2026-03-17"]',
            "measured ends on 2026-03-17, before it begins on 2026-03-18",
        ),
        ('[laboratory]\nmeasured = ["2026-03-18"]', "measured must be a day, or the first and the last, got 1 of them"),
        ('[[instruments]]\nkind = "ball"\ncalibrated = "soon"', 'calibrated must be a day, got "soon"'),
        ('[laboratory]\noperator = "two\\nlines"', "holds the character \\n"),
        (f'[laboratory]\noperator = "{"x" * 101}"', "is 101 characters long, more than 100"),
        ("laboratory = 3", "[laboratory] must be a table, got 3"),
        ('[sensor.x]\noperator = "A"', "unknown key"),
    ],
)
def test_what_cannot_be_meant_is_refused_with_its_place(tmp_path: Path, end: str, message: str) -> None:
    top, end = (end, "") if end.startswith("laboratory =") else ("", end)
    plan = _plan(tmp_path, end, top)
    with pytest.raises(InputError) as caught:
        read_experiment(plan)
    assert any(message in str(fault) and fault.line for fault in caught.value.faults), [str(f) for f in caught.value.faults]


def test_a_key_in_the_wrong_table_is_led_to_its_own(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"It belongs in \[laboratory\]"):
        read_experiment(_plan(tmp_path, top='operator = "A"'))

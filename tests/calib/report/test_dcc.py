"""A certificate as PTB's Digital Calibration Certificate: valid where the schema is at hand, and always of the same form."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest
import xmlschema

from calib.catalogue import QUANTITIES
from calib.checks import Reason, Verdict
from calib.experiment import Instrument, Laboratory
from calib.report import Certificate, Origin, certify, dcc_gaps, dcc_xml
from calib.report.dcc import UNITS
from calib.sampling import Posterior

SCHEMA = Path(__file__).parent / "dcc"
LABORATORY = Laboratory("Université & Söhne <1>", "A. Person", "a@b.org", "Auckland", "NZ", "", "2026-03-17", "2026-03-18")
NS = {"dcc": "https://ptb.de/dcc", "si": "https://ptb.de/si"}


@pytest.fixture
def make(make_posterior: Callable[..., Posterior]) -> Callable[..., Certificate]:
    """Function that makes a certificate of a posterior that was made by hand."""

    def made(verdict: Verdict | None = None, laboratory: Laboratory = LABORATORY, **parts: Any) -> Certificate:
        posterior = make_posterior()
        instruments = (Instrument("load cell", "Instron", "2530", "1", "2026-01-12", "0.5"), Instrument("ball"))
        experiment = replace(posterior.experiment, laboratory=laboratory, instruments=instruments)
        software = {"python": "3", "dielectric-elastomer-calibration": "0.1.0", "platform": "Linux", "commit": "ab" * 20}
        command = {"text": "calib calibrate \x07", "at": "2026-11-23T00:00:00+00:00", "version": "0.1.0"}
        origin = Origin(("surrogate, sha256 00",), (command,), (), "text", software)
        posterior = replace(
            posterior, experiment=experiment, fixed={"machine_compliance": 2e-6}, attrs={**posterior.attrs, "commit": "ab" * 20}
        )
        return replace(certify(posterior, verdict or Verdict(), origin, "2026-11-23T00:00:00+00:00"), **parts)

    return made


def _plain(tag: str) -> str:
    return tag.split("}")[1]


def _every_kind(make: Callable[..., Certificate]) -> list[Certificate]:
    amber = Verdict((Reason("fit", "amber", "p is 0.001 \ufffe & <b>", "look at the residuals"),))
    customer = replace(LABORATORY, customer="Soft Grippers", email="", city="", measured_until="2026-03-17")
    return [make(), make(amber), make(laboratory=customer), make(instruments=(), known=())]


def test_it_is_valid_against_the_schema_of_ptb(make: Callable[..., Certificate]) -> None:
    schema = xmlschema.XMLSchema(
        SCHEMA / "dcc.xsd", locations={"https://ptb.de/si": str(SCHEMA / "SI_Format.xsd")}, allow="local"
    )
    for certificate in _every_kind(make):
        schema.validate(dcc_xml(certificate))


def test_it_holds_the_numbers_of_the_certificate(make: Callable[..., Certificate]) -> None:
    certificate = make()
    root = ET.fromstring(dcc_xml(certificate))
    found = {}
    for real in root.iterfind(".//dcc:results//si:real", NS):
        numbers = [real.find(f".//si:{name}", NS) for name in ("value", "standardUnc", "intervalMin", "intervalMax")]
        label, unit = real.findtext("si:label", namespaces=NS), real.findtext("si:unit", namespaces=NS)
        found[label] = (unit, *(float(number.text or "") for number in numbers if number is not None))
        for number in numbers:  # si:decimalType
            assert number is not None
            assert re.fullmatch(r"[-+]?((\d*\.\d+)|(\d+\.\d*)|(\d+\.?))([Ee][-+]?\d+)?", number.text or "")
    assert found == {v.name: (UNITS[v.unit], v.value, v.standard_uncertainty, *v.interval_95) for v in certificate.results}
    assert len(found) == 6
    assert "no certificate of an accredited calibration laboratory" in dcc_xml(certificate)


def test_every_quantity_has_a_unit_of_d_si() -> None:
    assert {q.unit or "1" for q in QUANTITIES.values()} <= UNITS.keys()


def test_what_the_form_asks_for_is_not_made_up(make: Callable[..., Certificate]) -> None:
    for key in ("name", "operator", "country", "measured"):
        certificate = make(laboratory=replace(LABORATORY, **{key: ""}))
        assert dcc_gaps(certificate) == (f"{key} in [laboratory]",)
        with pytest.raises(ValueError, match=f"no DCC without {key}"):
            dcc_xml(certificate)
    red = make(Verdict((Reason("convergence", "red", "has not converged", "go on"),)))
    assert dcc_gaps(red) == ("a verdict that is not red",)

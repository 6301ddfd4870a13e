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

# dcc.xsd 3.2.1 and SI_Format.xsd 2.1.0, as PTB publishes them under LGPL 3 (https://ptb.de/dcc/v3.2.1/dcc.xsd).
SCHEMA = Path(__file__).parents[4] / "shared" / "dcc"
LABORATORY = Laboratory("Université & Söhne <1>", "A. Person", "a@b.org", "Auckland", "NZ", "", "2026-03-17", "2026-03-18")
NS = {"dcc": "https://ptb.de/dcc", "si": "https://ptb.de/si"}

#: Which elements stand in which, in their order, in a certificate that xmlschema 4.3.2 and libxml2 found valid against PTB's
#: dcc.xsd 3.2.1 with D-SI 2.1.0 on 2026-11-23 (repetitions once).
FORM = {
    "digitalCalibrationCertificate": "administrativeData measurementResults",
    "administrativeData": "dccSoftware coreData items calibrationLaboratory respPersons customer statements",
    "dccSoftware": "software",
    "software": "name release type description",
    "coreData": "countryCodeISO3166_1 usedLangCodeISO639_1 mandatoryLangCodeISO639_1 uniqueIdentifier identifications "
    "beginPerformanceDate endPerformanceDate performanceLocation issueDate",
    "identifications": "identification",
    "identification": "issuer value name",
    "items": "item",
    "item": "name description identifications",
    "calibrationLaboratory": "contact",
    "contact": "name eMail location",
    "location": "city countryCode further",
    "respPersons": "respPerson",
    "respPerson": "person role mainSigner",
    "person": "name",
    "customer": "name eMail location",
    "statements": "statement",
    "statement": "name declaration",
    "measurementResults": "measurementResult",
    "measurementResult": "name usedMethods usedSoftware measuringEquipments influenceConditions results",
    "usedMethods": "usedMethod",
    "usedMethod": "name description reference",
    "usedSoftware": "software",
    "measuringEquipments": "measuringEquipment",
    "measuringEquipment": "name description manufacturer model identifications",
    "manufacturer": "name",
    "influenceConditions": "influenceCondition",
    "influenceCondition": "name description data",
    "results": "result",
    "result": "name data",
    "data": "quantity",
    "quantity": "name description real",
    "real": "label value unit coverageInterval",
    "coverageInterval": "standardUnc intervalMin intervalMax coverageProbability",
    **dict.fromkeys(("name", "description", "declaration", "further"), "content"),
}


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


def _faults(text: str) -> list[str]:
    """Where a text departs from the form."""
    found = []
    for element in ET.fromstring(text).iter():
        known = FORM.get(_plain(element.tag), "").split()
        places = [known.index(name) if name in known else -1 for name in (_plain(child.tag) for child in element)]
        if -1 in places or places != sorted(places):
            found.append(f"{_plain(element.tag)}: {[_plain(child.tag) for child in element]}")
    return found


def _every_kind(make: Callable[..., Certificate]) -> list[Certificate]:
    amber = Verdict((Reason("fit", "amber", "p is 0.001 \ufffe & <b>", "look at the residuals"),))
    customer = replace(LABORATORY, customer="Soft Grippers", email="", city="", measured_until="2026-03-17")
    return [make(), make(amber), make(laboratory=customer), make(instruments=(), known=())]


def test_it_is_valid_against_the_schema_of_ptb(make: Callable[..., Certificate]) -> None:
    if not SCHEMA.is_dir():
        pytest.skip(f"PTB's schema is not at {SCHEMA}")
    schema = xmlschema.XMLSchema(SCHEMA / "dcc.xsd", locations={"https://ptb.de/si": str(SCHEMA / "SI_Format.xsd")})
    for certificate in _every_kind(make):
        schema.validate(dcc_xml(certificate))


def test_it_is_of_the_form_that_was_found_valid(make: Callable[..., Certificate]) -> None:
    for certificate in _every_kind(make):
        text = dcc_xml(certificate)
        assert _faults(text) == []
        for element in ET.fromstring(text).iter():
            if element.text and element.text.strip():
                assert re.fullmatch(r"[^\s]+(\s+[^\s]+)*", element.text), element.text  # dcc:notEmptyStringType
            elif not len(element):
                pytest.fail(f"{element.tag} is empty")
        assert ET.fromstring(text).get("schemaVersion") == "3.2.1"


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

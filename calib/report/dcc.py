"""A certificate in, the same as a Digital Calibration Certificate of PTB (XML, DCC 3.2.1 with D-SI 2.1.0) out.

The form is that of https://ptb.de/dcc/v3.2.1/dcc.xsd. It asks who calibrated, where and when; what is not known is not made up:
`dcc_gaps` says what is missing.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from xml.etree import ElementTree as ET

from calib.experiment import Laboratory
from calib.provenance import PROGRAM
from calib.report.certificate import COVERAGE, MEANT, NOT_ACCREDITED, Certificate, CertifiedValue, KnownValue
from calib.visible import visible

_VERSION = "3.2.1"
_DCC, _SI, _XSI = "https://ptb.de/dcc", "https://ptb.de/si", "http://www.w3.org/2001/XMLSchema-instance"
_SCHEMA = f"{_DCC} https://ptb.de/dcc/v{_VERSION}/dcc.xsd"

#: Units as D-SI writes them.
UNITS: Mapping[str, str] = {
    "1": r"\one",
    "Pa": r"\pascal",
    "m": r"\metre",
    "N": r"\newton",
    "F": r"\farad",
    "s": r"\second",
    "m/N": r"\metre\newton\tothe{-1}",
}

#: What the form asks for, as keys of [laboratory].
_ASKED = ("name", "operator", "country", "measured")

# What XML 1.0 cannot hold.
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def dcc_gaps(certificate: Certificate) -> tuple[str, ...]:
    """What keeps a certificate from being written as XML, in words; nothing if it can be."""
    return (*laboratory_gaps(certificate.laboratory), *(() if certificate.usable else ("a verdict that is not red",)))


def laboratory_gaps(laboratory: Laboratory) -> tuple[str, ...]:
    """What an experiment file does not say of the laboratory, and PTB's form asks for, in words."""
    return tuple(f"{key} in [laboratory]" for key in _ASKED if not getattr(laboratory, key))


def dcc_xml(certificate: Certificate) -> str:
    """Write a certificate as a DCC: the same results, for programs of other people's laboratories.

    Parameters
    ----------
    certificate : without `dcc_gaps`.

    Raises
    ------
    ValueError
        If there are any.
    """
    if missing := dcc_gaps(certificate):
        raise ValueError(f"no DCC without {', '.join(missing)}")
    ET.register_namespace("dcc", _DCC)
    ET.register_namespace("si", _SI)
    ET.register_namespace("xsi", _XSI)
    about = {f"{{{_XSI}}}schemaLocation": _SCHEMA, "schemaVersion": _VERSION}
    root = ET.Element(f"{{{_DCC}}}digitalCalibrationCertificate", about)
    _administrative(_in(root, "administrativeData"), certificate)
    _measured(_in(_in(root, "measurementResults"), "measurementResult"), certificate)
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'


def _administrative(at: ET.Element, c: Certificate) -> None:
    _software(_in(at, "dccSoftware"), c.origin.software)
    core, laboratory = _in(at, "coreData"), c.laboratory
    _in(core, "countryCodeISO3166_1", laboratory.country)
    _in(core, "usedLangCodeISO639_1", "en")
    _in(core, "mandatoryLangCodeISO639_1", "en")
    _in(core, "uniqueIdentifier", f"{PROGRAM} {c.number}")
    marks = {"fingerprint of the run": c.fingerprint, "SHA-256 of the experiment file": c.experiment[1]}
    _identified(core, {name: value for name, value in marks.items() if value}, "other")
    _in(core, "beginPerformanceDate", laboratory.measured)
    _in(core, "endPerformanceDate", laboratory.measured_until)
    _in(core, "performanceLocation", "laboratory")
    _in(core, "issueDate", c.issued[:10])
    items = _in(at, "items")
    for name in c.specimens:
        item = _in(items, "item")
        _text(item, "name", name)
        _text(item, "description", "soft capacitive pressure sensor on its padding")
        _identified(item, {"name in the experiment file": name}, "calibrationLaboratory")
    _contact(_in(_in(at, "calibrationLaboratory"), "contact"), laboratory.name, c)
    person = _in(_in(at, "respPersons"), "respPerson")
    _text(_in(person, "person"), "name", laboratory.operator)
    _in(person, "role", "operator")
    _in(person, "mainSigner", "true")
    _contact(_in(at, "customer"), laboratory.customer or laboratory.name, c, own=not laboratory.customer)
    statements = _in(at, "statements")
    colour = c.verdict.colour
    said = [("Not an accredited certificate", NOT_ACCREDITED), (f"Verdict: {colour}", c.statement)]
    said += [(f"{reason.level}, {reason.gate}", reason.in_words) for reason in c.verdict.reasons]
    said += [(f"green, {light.gate}", light.reason) for light in c.gates if light.light == "green"]
    said += [("Model not ruled out by these data", model) for model in c.open_models]
    said += [("The numbers", MEANT)]
    said += [("Not said", f"This certificate does not say {what}.") for what in c.unsaid]
    for name, text in said:
        statement = _in(statements, "statement")
        _text(statement, "name", name)
        _text(statement, "declaration", text)


def _measured(at: ET.Element, c: Certificate) -> None:
    _text(at, "name", f"{c.title}: {c.name}")
    method = _in(_in(at, "usedMethods"), "usedMethod")
    _text(method, "name", "Bayesian inversion of force and capacitance against indentation")
    _text(method, "description", f"{c.model}. {'; '.join(c.origin.forward)}")
    _in(method, "reference", "JCGM 101:2008")
    _software(_in(at, "usedSoftware"), c.calibrated_with)
    if c.instruments:
        equipments = _in(at, "measuringEquipments")
        for instrument in c.instruments:
            one = _in(equipments, "measuringEquipment")
            _text(one, "name", instrument.kind)
            told = {"last calibration": instrument.calibrated, "class": instrument.accuracy_class}
            if words := ", ".join(f"{what} {value}" for what, value in told.items() if value):
                _text(one, "description", words)
            if instrument.maker:
                _text(_in(one, "manufacturer"), "name", instrument.maker)
            if instrument.model:
                _in(one, "model", instrument.model)
            if instrument.serial:
                _identified(one, {"serial number": instrument.serial}, "manufacturer")
    if c.known:
        conditions = _in(at, "influenceConditions")
        for known in c.known:
            condition = _in(conditions, "influenceCondition")
            _text(condition, "name", known.label)
            _text(condition, "description", "taken as known")
            _quantity(_in(condition, "data"), known)
    results = _in(at, "results")
    for of in dict.fromkeys(value.of for value in c.results):
        result = _in(results, "result")
        _text(result, "name", of or "all specimens")
        data = _in(result, "data")
        for value in c.results:
            if value.of == of:
                _quantity(data, value)


def _quantity(at: ET.Element, value: CertifiedValue | KnownValue) -> None:
    quantity = _in(at, "quantity", refType="basic_measuredValue") if isinstance(value, CertifiedValue) else _in(at, "quantity")
    _text(quantity, "name", value.label)
    if isinstance(value, CertifiedValue):
        _text(quantity, "description", value.learned)
    real = _in(quantity, "real", of=_SI)
    _in(real, "label", value.name, of=_SI)
    _in(real, "value", repr(value.value), of=_SI)
    _in(real, "unit", UNITS[value.unit], of=_SI)
    if isinstance(value, CertifiedValue):
        interval = _in(real, "coverageInterval", of=_SI)
        _in(interval, "standardUnc", repr(value.standard_uncertainty), of=_SI)
        _in(interval, "intervalMin", repr(value.interval_95[0]), of=_SI)
        _in(interval, "intervalMax", repr(value.interval_95[1]), of=_SI)
        _in(interval, "coverageProbability", f"{COVERAGE:g}", of=_SI)


def _software(at: ET.Element, versions: Mapping[str, str]) -> None:
    kinds = {PROGRAM: "application", "platform": "os"}
    for name, version in versions.items():
        if name == "commit":
            continue
        software, of_clone = _in(at, "software"), versions.get("commit", "") if name == PROGRAM else ""
        _text(software, "name", name)
        _in(software, "release", version)
        _in(software, "type", kinds.get(name, "library"))
        if of_clone:
            _text(software, "description", f"commit {of_clone}")


def _contact(at: ET.Element, name: str, c: Certificate, *, own: bool = True) -> None:
    _text(at, "name", name)
    if own and c.laboratory.email:
        _in(at, "eMail", c.laboratory.email)
    location = _in(at, "location")
    if own and c.laboratory.city:
        _in(location, "city", c.laboratory.city)
    if own:
        _in(location, "countryCode", c.laboratory.country)
    else:
        _text(location, "further", "not stated")


def _identified(at: ET.Element, values: Mapping[str, str], issuer: str) -> None:
    if values:
        listed = _in(at, "identifications")
        for name, value in values.items():
            one = _in(listed, "identification")
            _in(one, "issuer", issuer)
            _in(one, "value", value)
            _text(one, "name", name)


def _text(at: ET.Element, name: str, *texts: str) -> None:
    """A text for people, with its language."""
    within = _in(at, name)
    for text in texts:
        _in(within, "content", text, lang="en")


def _in(at: ET.Element, name: str, text: str = "", *, of: str = _DCC, **attributes: str) -> ET.Element:
    """One element more within another."""
    made = ET.SubElement(at, f"{{{of}}}{name}", attributes)
    if text:
        made.text = " ".join(_words(text))
    return made


def _words(text: str) -> Iterable[str]:
    """Words of a text, each with what XML cannot hold written out."""
    return _NO_XML.sub(lambda found: f"\\u{ord(found[0]):04x}", visible(text)).split()

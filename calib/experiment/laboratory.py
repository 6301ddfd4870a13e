"""The tables [laboratory] and [[instruments]] of an experiment file in, who measured, when and with what out."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from datetime import date, datetime

from calib.experiment.countries import COUNTRIES, nearest_countries
from calib.experiment.signposts import SIGNPOSTS
from calib.experiment.toml_file import Toml
from calib.experiment.toml_places import KeyPath
from calib.experiment.toml_values import check_keys, get, quoted, table_at, tables_at, text_at
from calib.visible import name_fault, shortened

#: How a day is written, and a country.
DAY, COUNTRY = r"\d{4}-\d{2}-\d{2}", f"(?:{'|'.join(COUNTRIES)})"

#: What stands for a text that is still to be put in.
BLANK = "..."

_EMAIL = r"[^@\s]+@[^@\s]+"


@dataclass(frozen=True)
class Laboratory:
    """Who measured, where and when, for a certificate; "" for what the experiment file does not say.

    Attributes
    ----------
    name : of the laboratory.
    operator : who measured.
    email : under which the laboratory answers.
    city : where it is.
    country : likewise, two letters of ISO 3166-1.
    customer : whom it measured for.
    measured : the first day of the presses, ISO 8601.
    measured_until : the last one; the same where it was one day.
    """

    name: str = ""
    operator: str = ""
    email: str = ""
    city: str = ""
    country: str = ""
    customer: str = ""
    measured: str = ""
    measured_until: str = ""


@dataclass(frozen=True)
class Instrument:
    """One instrument that was measured with; "" for what the experiment file does not say.

    Attributes
    ----------
    kind : what it is, such as "testing machine".
    maker, model, serial : as on its plate.
    calibrated : the day of its last calibration, ISO 8601.
    accuracy_class : that this found, such as "0.5" of ISO 7500-1.
    """

    kind: str
    maker: str = ""
    model: str = ""
    serial: str = ""
    calibrated: str = ""
    accuracy_class: str = ""


#: Keys of the two tables, and what they say.
LABORATORY: Mapping[str, str] = {
    "name": "Name of the laboratory, for the certificate.",
    "operator": "Who measured.",
    "email": "Under which the laboratory answers.",
    "city": "Where it is.",
    "country": 'Where it is, two letters of ISO 3166-1, such as "NZ".',
    "customer": "Whom it measured for; default itself.",
    "measured": "The day of the presses, or the first and the last of them.",
}
INSTRUMENT: Mapping[str, str] = {
    "kind": 'What it is, such as "testing machine", "load cell", "LCR meter", "ball", "microscope".',
    "maker": "Its maker.",
    "model": "Its model.",
    "serial": "Its serial number.",
    "calibrated": "The day of its last calibration.",
    "class": 'The class that this found, such as "0.5" of ISO 7500-1.',
}


def laboratory_in(toml: Toml) -> Laboratory:
    """Read [laboratory], and note a fault for what is wrong in it."""
    at: KeyPath = ("laboratory",)
    check_keys(toml, at, tuple(LABORATORY), SIGNPOSTS)
    table = table_at(toml, at)
    said = {key: _line(toml, (*at, key)) for key in LABORATORY if key in table and key != "measured"}
    if said.get("country") and said["country"] not in COUNTRIES:
        near = [f'"{code}" ({COUNTRIES[code]})' for code in nearest_countries(said["country"])]
        advice = f"Did you mean {' or '.join(near)}?" if near else 'For example "NZ", "DE", "GB"; or leave it out and give city'
        message = f"country must be two letters that ISO 3166-1 has, got {quoted(said['country'])}"
        toml.fault((*at, "country"), message, advice)
    if said.get("email") and not re.fullmatch(_EMAIL, said["email"]):
        toml.fault((*at, "email"), f"email must be an address, got {quoted(said['email'])}", 'For example "lab@example.org"')
    first, last = _days(toml, (*at, "measured"))
    return Laboratory(**said, measured=first, measured_until=last)


def instruments_in(toml: Toml) -> tuple[Instrument, ...]:
    """Read [[instruments]], and note a fault for what is wrong in them."""
    found = []
    for at in tables_at(toml, ("instruments",)):
        meant = check_keys(toml, at, tuple(INSTRUMENT), SIGNPOSTS)
        table = table_at(toml, at)
        if "kind" not in table and "kind" not in meant:
            toml.fault(at, "kind is missing", 'Give kind = "load cell", or what it is')
        said = {key: _line(toml, (*at, key)) for key in INSTRUMENT if key in table and key != "calibrated"}
        calibrated = _day(toml, (*at, "calibrated"))
        found.append(Instrument(said.pop("kind", ""), accuracy_class=said.pop("class", ""), calibrated=calibrated, **said))
    return tuple(found)


def instrument_of(keys: Mapping[str, str]) -> Instrument:
    """An instrument by the keys of the experiment file, as `keys_of` gives them.

    Parameters
    ----------
    keys : key -> what is said.

    Raises
    ------
    TypeError
        If there is another key among them, or `kind` is not.
    """
    return Instrument(**{"accuracy_class" if key == "class" else key: value for key, value in keys.items()})


def keys_of(instrument: Instrument) -> dict[str, str]:
    """What is said of an instrument, by the keys of the experiment file; nothing for what is not said."""
    named = {field.name: getattr(instrument, field.name) for field in fields(instrument)}
    return {"class" if name == "accuracy_class" else name: value for name, value in named.items() if value}


def _line(toml: Toml, at: KeyPath) -> str:
    """A text of one line; "" and a fault if it is none."""
    text = text_at(toml, at)
    if fault := name_fault(text):
        toml.fault(at, f"{at[-1]} {quoted(shortened(text))} {fault}", "Shorten it to what a certificate should show")
        return ""
    if text.strip() == BLANK:
        toml.fault(at, f'{at[-1]} is still "{BLANK}"', "Put in what it is, or take the line out")
        return ""
    return text


def _days(toml: Toml, at: KeyPath) -> tuple[str, str]:
    """The first and the last of some days; "" for both and a fault if they are none."""
    value = get(toml, at)
    if not isinstance(value, list):
        day = _day(toml, at)
        return day, day
    if len(value) != 2:
        toml.fault(at, f"measured must be a day, or the first and the last, got {len(value)} of them", _EXAMPLE)
        return "", ""
    first, last = _day(toml, (*at, 0)), _day(toml, (*at, 1))
    if first and last and last < first:
        toml.fault(at, f"measured ends on {last}, before it begins on {first}", "Give the earlier day first")
    return first, last


_EXAMPLE = 'For example measured = "2026-03-17", or ["2026-03-17", "2026-03-18"]'


def _day(toml: Toml, at: KeyPath) -> str:
    """A day, ISO 8601; "" if there is none, and a fault if it is none."""
    value = get(toml, at)
    if value is None:
        return ""
    if isinstance(value, date) and not isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, str) and re.fullmatch(DAY, value.strip()):
        try:
            return date.fromisoformat(value.strip()).isoformat()
        except ValueError:
            pass  # a day that there is not
    key = next(name for name in reversed(at) if isinstance(name, str))
    toml.fault(at, f"{key} must be a day, got {quoted(value)}", f'Year, month, day: {key} = "2026-03-17"')
    return ""

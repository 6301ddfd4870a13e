"""From advice in options of the command line to the fields of a lab file's form that say the same."""

from __future__ import annotations

import re
from collections.abc import Iterator

from markupsafe import Markup, escape

from calib.errors import Choice
from calib.hypertext import sentence
from calib.lab import QUANTITIES
from calib.visible import visible

# Name of an option -> what its field is called on the page; the first are said of a quantity, and have a field for each.
_OF_QUANTITY = {"units": "Unit", "columns": "Column", "sign": "Which way"}
_NAMES = _OF_QUANTITY | {
    "where": "Only rows where column",
    "specimen": "Specimen",
    "sheet": "Sheet",
    "decimal": "Decimal mark",
    "scale": "Scale",
    "cycles": "Cycles",
    "branch": "Branch",
    "max-force": "Up to force",
    "max-depth": "Up to depth",
}
# An option and the word behind it, which a full stop does not belong to; words to be put in are dots or capitals.
_OPTION = re.compile(
    rf"(?<![\w-])`?--(?P<option>{'|'.join(_NAMES)})(?![\w-])(?: (?P<quote>[\"'])(?P<quoted>.*?)(?P=quote)|"
    rf" (?P<bare>(?:{'|'.join(QUANTITIES)}|[A-Z0-9]+)=(?:\.\.\.|[^\s;,)`]*[^\s;,.)`])|(?P<alone>[0-9]+|[A-Z]+|\.\.\.)))?`?"
)
# Answers that are offered to one question.
_MOST_ANSWERS = 12
_TO_BE_PUT_IN = ("", "...", "NAME", "VALUE")


def by_fields(text: str) -> Markup:
    """Advice for the page of a lab file, in which links to its fields stand for options of the command line.

    >>> print(by_fields("say which column it is: --columns force=..."))
    say which column it is: <a href="#columns_force">Column of force</a>
    >>> print(by_fields('--units "force=1e-3 N"; or --specimen 2'))
    <a href="#units_force">Unit of force</a>: 1e-3 N; or <a href="#specimen">Specimen</a>: 2

    Parameters
    ----------
    text : advice, a note or a message.
    """
    return Markup("").join(
        sentence(words) if field is None else _link(field, words, value) for field, words, value in _parts(text)
    )


def in_fields(text: str) -> str:
    """The same as text alone, for what holds no links.

    >>> in_fields("say which column it is: --columns force=...")
    'say which column it is: "Column of force"'

    Parameters
    ----------
    text : advice, a note or a message.
    """
    return "".join(
        words if field is None else f'"{words}"{f": {value}" if value else ""}' for field, words, value in _parts(text)
    )


def answers_to(choice: Choice) -> list[tuple[str, str, str]]:
    """Answers to a question that a lab file leaves open, for buttons: each as value, the field it goes into, and what is shown.

    >>> answers_to(Choice("where", ("1000",), "Frequency (Hz)"))
    [('1000', 'where_value', 'Rows where Frequency (Hz) holds 1000')]
    >>> answers_to(Choice("units", ("N",), "force")), answers_to(Choice("specimen", ("2",)))
    ([('N', 'units_force', 'Unit of force: N')], [('2', 'specimen', 'Specimen: 2')])

    Parameters
    ----------
    choice : the question.
    """
    option, key = choice.option, choice.key
    field, asked = f"{option}_{key}" if key else option, f"{_NAMES[option]}{f' of {key}' if key else ''}:"
    if option == "where":
        field, asked = "where_value", f"Rows where {key} holds"
    return [(value, field, f"{asked} {value}") for value in choice.alternatives[:_MOST_ANSWERS]]


def _link(field: str, words: str, value: str) -> Markup:
    shown = escape(visible(f": {value}" if value else ""))
    return Markup('<a href="#{}">{}</a>{}').format(field, visible(words), shown)


def _parts(text: str) -> Iterator[tuple[str | None, str, str]]:
    """Pieces of a text: None and what stands there; or a field, what it is called, and what is to be said in it."""
    end = 0
    for found in _OPTION.finditer(text):
        between = text[end : found.start()]
        yield None, ", " if end and between == " " else between, ""
        yield _field(found["option"], found["quoted"] or found["bare"] or found["alone"] or "")
        end = found.end()
    yield None, text[end:], ""


def _field(option: str, said: str) -> tuple[str, str, str]:
    name, (key, equals, value) = _NAMES[option], said.partition("=")
    if option == "where":
        return "where_column", f'{name} "{key}" holds' if equals and key != "COLUMN" else name, _plain(value)
    if option not in _OF_QUANTITY:
        return option.replace("-", "_"), name, _plain(said)
    if not equals:  # of any quantity: the first that has the field
        return f"{option}_force", name, _plain(said)
    return f"{option}_{key}", f"{name} of {key}", _plain(value)


def _plain(value: str) -> str:
    return "" if value in _TO_BE_PUT_IN else value

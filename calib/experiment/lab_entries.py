"""From what an experiment file says of a lab file, and of the part of a press that is used, to `Reading` and `Use`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from calib.errors import InputError
from calib.experiment.signposts import SIGNPOSTS
from calib.experiment.toml_file import Toml
from calib.experiment.toml_places import KeyPath
from calib.experiment.toml_values import check_keys, choice_at, get, quoted, table_at, text_at
from calib.lab import FIRST_LOADING, QUANTITIES, SIGNED, SIGNS, USE_KEYS, Reading, Use, use_value

#: What may be said of a lab file beside its name.
READING_KEYS = ("units", "columns", "specimen", "where", "sheet", "sign", "scale", "decimal")


def reading_at(toml: Toml, at: KeyPath) -> Reading:
    """Read how a lab file is to be read, and note faults where that is wrong.

    Parameters
    ----------
    toml : the file.
    at : path of the table of the lab file.
    """
    table = table_at(toml, at)
    there = [key for key in READING_KEYS if key in table]
    found: dict[str, Any] = {}
    for key in there:
        place = (*at, key)
        if key in ("units", "columns"):
            found[key] = _by_quantity(toml, place)
        elif key == "specimen":
            found[key] = _count(toml, place)
        elif key == "where":
            found[key] = _where(toml, place)
        elif key == "sign":
            found[key] = _sign(toml, place)
        elif key == "sheet":
            found[key] = text_at(toml, place)
        else:
            found[key] = choice_at(toml, place, table[key], ("micro",) if key == "scale" else (".", ","))
    return Reading(**found)


def use_at(toml: Toml, at: KeyPath) -> Use:
    """Read which part of a press is used, and note faults where that is wrong.

    Parameters
    ----------
    toml : the file.
    at : path of the table `use`, which need not be there.
    """
    if get(toml, at) is None:
        return FIRST_LOADING
    check_keys(toml, at, USE_KEYS, SIGNPOSTS)
    found: dict[str, Any] = {}
    for key, value in table_at(toml, at).items():
        if key in USE_KEYS:
            try:
                found[key] = use_value(key, value)
            except InputError as error:
                toml.add((*at, key), error.faults)
    return Use(**found)


def _by_quantity(toml: Toml, at: KeyPath) -> dict[str, str]:
    """A table of quantity = "text", or a number for a column."""
    found: dict[str, str] = {}
    check_keys(toml, at, QUANTITIES, SIGNPOSTS)
    for quantity, value in table_at(toml, at).items():
        if isinstance(value, int) and not isinstance(value, bool) and at[-1] == "columns":
            found[quantity] = str(value)
        elif quantity in QUANTITIES:
            found[quantity] = text_at(toml, (*at, quantity))
    return found


def _count(toml: Toml, at: KeyPath) -> int | None:
    value = get(toml, at)
    if isinstance(value, int) and not isinstance(value, bool) and value >= 1:
        return value
    toml.fault(at, f"{at[-1]} must be a whole number from 1, got {quoted(value)}")
    return None


# Most columns by which rows are chosen.
_MOST_COLUMNS = 20


def _where(toml: Toml, at: KeyPath) -> dict[str, str]:
    """A table of column = value, a text or a number."""
    value = get(toml, at)
    example = 'Give where = { "Frequency (Hz)" = 1000 }'
    if not isinstance(value, Mapping) or not value:
        toml.fault(
            at, f"where must be a table of column = value, got {'an empty table' if value == {} else quoted(value)}", example
        )
        return {}
    found: dict[str, str] = {}
    if len(value) > _MOST_COLUMNS:
        toml.fault(at, f"where names {len(value)} columns, more than {_MOST_COLUMNS}", example)
        return {}
    for column, wanted in value.items():
        if isinstance(wanted, bool) or not isinstance(wanted, str | int | float) or not str(wanted).strip():
            toml.fault((*at, column), f'"{column}" must be a text or a number, got {quoted(wanted)}', example)
        else:
            found[column] = str(wanted).strip()
    return found


def _sign(toml: Toml, at: KeyPath) -> dict[str, str]:
    """A text for both quantities that have a sign, or a table by quantity."""
    value = get(toml, at)
    if not isinstance(value, Mapping):
        return dict.fromkeys(SIGNED, choice_at(toml, at, value, tuple(SIGNS)))
    check_keys(toml, at, tuple(SIGNED), SIGNPOSTS)
    return {q: choice_at(toml, (*at, q), value[q], tuple(SIGNS)) for q in SIGNED if q in value}

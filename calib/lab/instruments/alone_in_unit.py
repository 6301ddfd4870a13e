"""From all names of a header to columns of names that are not understood, each the only one in a unit: `Krag (N)`, `pF`."""

from __future__ import annotations

import re
from functools import lru_cache

from calib.lab.instruments.brackets import tidy, without_brackets, without_conditions, words_in
from calib.lab.instruments.factor_words import factor_words
from calib.lab.instruments.instrument_words import APART, instrument_words
from calib.lab.instruments.lexicon import ALTERED, DERIVED, PROCESSED, RELATIVE, STEP_TIMES
from calib.lab.instruments.meanings import PLAIN
from calib.lab.instruments.other_quantities import is_of_another, was_not_measured
from calib.lab.instruments.together import unit_in
from calib.lab.instruments.units import RECORDED, is_mass, is_unit_of, is_unit_of_a_record, looks_like_unit, stands_for
from calib.lab.instruments.vocabulary import FUNCTION, Heading, as_a_record, heading_as, understand, why_unread

# One letter or two may be anything ("dC", "dt") but for a maker before a word ("PI stage"), the penetration depth, the
# unknown capacitance and the change of length ("dL") of some instruments; a number is of one of many, a Greek letter a change.
_WORDS = re.compile(
    r"(?![ΔδΔ∆])(?=[^\W\d_]{3}|(?!d|x|y)[^\W\d_]{2}\s[^\W\d_]{3})[^\W\d_]+(?:[\s_.'’-]+[^\W\d_]+)*\.?|pd|cx|dl", re.IGNORECASE
)
# Letters that formulas and people have for a place or a force, and a load cut short; "t", "r", "l" and "a" are dimensions of a
# sample or a contact, "x" and "y" axes, "T", "V" and "Q" forces across.
_LETTERS = {"displacement": (*"uvwszUVWSZ",), "force": (*"LNPRWK", "Ld", "LD", "ld")}
# Letters of formulas before a word of what moves or is pressed, "F_Kugel", "u_ball"; "d" and "h" are sizes of it, "x" an axis.
_BEFORE_WORDS = {"displacement": "suwzSUWZ", "force": "FP"}
_LETTER_OF = re.compile(r"(?P<letter>[^\W\d_])[_ .-](?P<word>[^\W\d_]{3,}(?:[_ .-][^\W\d_]{3,})*)")
# Words behind such a letter that make it no reading along the axis, or no reading.
_NO_READINGS = re.compile(r"ref|err(?:or)?|resid(?:ual)?|tan|tang|lat|fric|norm|start|end|init|null|zero|hold|lim|off|rel")
# What an approach or a displacement along the axis is called in formulas, which elsewhere is a change or of another axis.
_OF_FORMULAS = {"displacement": ("delta", "δ", "u_z", "w_z", "d_z", "delta_z", "uz", "wz")}
# A change, "dCp", and a difference of capacitances, "Kap - Ref", "Cmeas-Cref": as those with a Greek letter.
_CHANGE = re.compile(r"d[A-Z].*")
_DIFFERENCE = re.compile(r"\s-\s|\bC\w*-C", re.IGNORECASE)
# Where a signal stands in an instrument or its program: "dev3456/imps/0/sample.param1", "/press/force".
_PATH = re.compile(r"/?[^\W\d_]\w*(?:/\w+){2,}(?:\.\w+)*|(?:/[^\W\d_]\w*){2,}")
# Which of its values or inputs a meter calls so: "Parameter 2", "Capacitance C1"; 0 is the one at rest.
_OF_SEVERAL = re.compile(r"(?P<words>[^\W\d_]{3,}(?:[\s_.-]+[^\W\d_]{3,})*)[\s_.-]*(?:(?<![^\W\d_])[^\W\d_])?[1-9]\d?")
# Scripts of which a word is one letter or two.
_SIGNS = re.compile(r"[\u0e00-\ud7ff][\u0e00-\ud7ff\s]*")


@lru_cache(maxsize=256)
def alone_in_unit(names: tuple[str, ...], below: tuple[str, ...]) -> dict[int, Heading]:
    """The columns whose names are words that are not understood, where no other has a unit, or a name, of the quantity.

    A time, a force or a place alone may be anything: two quantities, by names or units, have to be there.

    Parameters
    ----------
    names, below : of all columns, and the units below them, "" where there is none.

    Returns
    -------
    Index of a column -> what it is by its unit.

    >>> found = alone_in_unit(("Tyd (s)", "Verplasing (mm)", "Krag (N)", "Load (V)"), ("",) * 4)
    >>> [(index, heading.quantity) for index, heading in found.items()]
    [(0, 'time'), (1, 'displacement')]
    >>> alone_in_unit(("Time (s)", "u_mm", "t (N)"), ("",) * 3)[1].quantity
    'displacement'
    >>> alone_in_unit(("Krag (N)", "Wrywing (N)", "mm"), ("",) * 3), alone_in_unit(("Time (s)", "Krag 2 (N)"), ("",) * 2)
    ({}, {})
    """
    columns = list(zip(names, below, strict=True))
    units = [
        unit or unit_in(name) or (name if is_unit_of_a_record(name) and not is_mass(name) else "") for name, unit in columns
    ]
    plain = [understand(name, unit) or as_a_record(name, unit) if name else None for name, unit in columns]
    named = {stands_for(h.quantity) for h in plain if h is not None}
    found: dict[int, Heading] = {}
    for quantity in RECORDED:
        of_unit = [i for i, unit in enumerate(units) if unit and is_unit_of(unit, quantity)]
        if quantity in named or len(of_unit) != 1 or not _says_nothing(*columns[of_unit[0]], units[of_unit[0]], quantity):
            continue
        (index,) = of_unit
        own = None if below[index] else units[index]
        cut = without_brackets(tidy(names[index])) if quantity == "capacitance" else None
        of_words = understand(_without_number(cut[0])) if cut is not None else None
        of = of_words.quantity if of_words is not None and of_words.quantity == "capacitance_series" else quantity
        doubt = heading_as(quantity, names[index], below[index]).unit_doubt
        doubt = doubt if doubt.startswith("two units") else ""
        found[index] = Heading(of, 4 * PLAIN, " ".join(words_in(names[index])), own, unit_doubt=doubt)
    there = {h.quantity for h in found.values()} | (named & set(RECORDED))
    return found if len(there) > 1 and there != {"time"} else {}


def _says_nothing(name: str, below: str, unit: str, quantity: str) -> bool:
    """Whether a name is nothing but words that are not understood and a unit, or the unit alone; none of another quantity."""
    if name == unit:
        return True
    name = without_conditions(tidy(name))[0] if quantity == "capacitance" else name
    cut = without_brackets(tidy(name))
    if not name or is_mass(unit) or cut is None or not all(looks_like_unit(bracket) for bracket in cut[1]):
        return False
    outside = re.sub(rf"(?:\s+in\s+|[\s_,:|/]+){re.escape(unit)}$", "", cut[0].strip()) if not cut[1] and not below else cut[0]
    outside = _without_number(outside) if quantity == "capacitance" else _without_instrument(outside)
    said, alone = words_in(outside), outside.strip(" :,|")
    of_formula = _LETTER_OF.fullmatch(alone)
    by_letter = of_formula is not None and of_formula["letter"] in tuple(_BEFORE_WORDS.get(quantity, ()))
    by_letter = by_letter and not any(map(_NO_READINGS.fullmatch, said))
    if alone.lower() in _OF_FORMULAS.get(quantity, ()) and "Δ" not in alone:
        return True
    return (
        (by_letter or alone in _LETTERS.get(quantity, ()) or any(form.fullmatch(alone) for form in (_WORDS, _SIGNS, _PATH)))
        and not any(word in DERIVED or word in PROCESSED or word in RELATIVE or word in ALTERED for word in said)
        and heading_as("time", name).name not in STEP_TIMES
        and not is_of_another(outside, quantity)
        and not (quantity != "time" and was_not_measured(outside))
        and not (
            (_CHANGE.match(outside) and not (quantity == "displacement" and alone == "dL"))
            or (outside[:1] == "d" and understand(outside[1:], below or unit))
        )
        and not (quantity == "capacitance" and _DIFFERENCE.search(outside))
        and not (FUNCTION.search(outside) or factor_words(outside))
        and why_unread(name, below) == "not understood"
    )


def _without_instrument(outside: str) -> str:
    """A name without the model or channel beside words of which none is understood: "Stage" of "Stage M-406"."""
    parts = [part for part in re.split(APART, outside) if part]
    passed = instrument_words(parts)
    left = [part for part, is_passed in zip(parts, passed, strict=True) if not is_passed]
    return " ".join(left) if left and any(passed) and not any(map(understand, left)) else outside


def _without_number(outside: str) -> str:
    """The name of a capacitance without which of several it is: "Parameter" of "Parameter 2"."""
    match = _OF_SEVERAL.fullmatch(outside.strip(" :,|"))
    heading = understand(match["words"]) if match is not None else None
    of_another = heading is not None and stands_for(heading.quantity) != "capacitance"
    if match is None or of_another or any(map(_NO_READINGS.fullmatch, words_in(outside))):
        return outside
    return match["words"]

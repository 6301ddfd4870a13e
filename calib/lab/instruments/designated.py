"""From all names of a header to columns named by an instrument: `Force ch1 (N)`, `Kraft U9C [N]`, `Kistler 9207 [N]`."""

from __future__ import annotations

import re
from functools import lru_cache

from calib.lab.instruments.brackets import no_record, tidy, without_brackets
from calib.lab.instruments.instrument_words import APART, instrument_words
from calib.lab.instruments.lexicon import CHANNELS
from calib.lab.instruments.meanings import PLAIN
from calib.lab.instruments.together import unit_in
from calib.lab.instruments.units import is_unit_of, looks_like_unit, stands_for
from calib.lab.instruments.vocabulary import NEEDS_UNIT, Heading, as_a_record, understand

# A channel before a name, with a stroke between them: "AI 1/displacement", "ch2/Force"; "1/Force" is an inverse.
_OF_CHANNEL = re.compile(
    rf"^((?:{'|'.join(sorted(w for w in CHANNELS if len(w) > 1))})[ .#-]?\d{{1,3}})\s?/\s?(?=[^\W\d])", re.IGNORECASE
)
_BY_UNIT = ("force", "displacement", "capacitance")


@lru_cache(maxsize=256)
def designated(names: tuple[str, ...], below: tuple[str, ...]) -> dict[int, tuple[Heading, str]]:
    """The columns whose names hold a channel or a model beside the one word of a quantity, or a maker and a model in its place.

    Such a column is one only where no other is of the quantity by its name, or has a unit of it.

    Parameters
    ----------
    names, below : of all columns, and the units below them, "" where there is none.

    Returns
    -------
    Index of a column -> what it holds, and the words in its name that are passed by.

    >>> found = designated(("Kraft U9C [N]", "AI 2: Weg [mm]", "C S2 (pF)"), ("",) * 3)
    >>> [(index, heading.quantity, words) for index, (heading, words) in found.items()]
    [(0, 'force', 'U9C'), (1, 'displacement', 'AI 2')]
    >>> designated(("Force ch1 (N)", "Force ch2 (N)"), ("",) * 2), designated(("Force MAX1 (N)",), ("",))
    ({}, {})
    >>> [w for _, w in designated(("CH0001 Force (N)", "CH1-2 Disp (mm)", "param1 Cp (F)"), ("",) * 3).values()]
    ['CH0001', 'CH1-2', 'param1']
    """
    columns = list(zip(names, below, strict=True))
    found = {i: f for i, (name, unit) in enumerate(columns) if name and (f := _designated(name, unit)) is not None}
    if not found:
        return {}
    plain = [understand(name, unit) or as_a_record(name, unit) if name else None for name, unit in columns]
    units = [unit or unit_in(name) for name, unit in columns]

    def of(index: int, quantity: str) -> bool:
        heading = found[index][0] if index in found else plain[index]
        named = heading is not None and stands_for(heading.quantity) == quantity
        return named or is_unit_of(units[index], quantity)

    shown = {i: stands_for(heading.quantity) for i, (heading, _) in found.items()}
    return {i: f for i, f in found.items() if not any(of(k, shown[i]) for k in range(len(names)) if k != i)}


def _designated(name: str, below: str) -> tuple[Heading, str] | None:
    """What a name holds without the words for an instrument in it, and these; None if it has none, or others beside them."""
    if understand(name, below) is not None or no_record(name):
        return None
    cut = without_brackets(tidy(name))
    if cut is None or not all(looks_like_unit(bracket) for bracket in cut[1]):
        return None
    outside, brackets = cut
    parts = [part for part in re.split(APART, _OF_CHANNEL.sub(r"\1 ", outside)) if part]
    passed = instrument_words(parts)
    left = [part for part, is_passed in zip(parts, passed, strict=True) if not is_passed]
    words = " ".join(part for part, is_passed in zip(parts, passed, strict=True) if is_passed)
    unit = below or unit_in(name)
    if not words or not unit:
        return None
    heading = understand(" ".join([*left, *(f"({bracket})" for bracket in brackets)]), below) if left else None
    if heading is not None:
        # A letter with a channel and a unit is its quantity: "C CH1 (pF)"; one with a model may be of a specimen.
        lettered = heading.letter or len(heading.name) == 1
        of_channel = re.split(r"[\s.#\d-]", words.lower())[0] in {*CHANNELS, "u"}
        doubtful = (
            heading.name_doubt or heading.unit_doubt or heading.index or heading.processed or (lettered and not of_channel)
        )
        fits = heading.quantity in NEEDS_UNIT and is_unit_of(unit, heading.quantity)
        return (heading, words) if fits and not doubtful else None
    if [part for part in left if part != unit]:
        return None
    quantity = next((quantity for quantity in _BY_UNIT if is_unit_of(unit, quantity)), "")
    return (Heading(quantity, 3 * PLAIN, words.lower(), None if below else unit), words) if quantity else None

"""From what a meter is said to measure above a header (`FUNC,Cp-D`) to its columns `Primary` and `Secondary`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from calib.lab.instruments.vocabulary import Heading, heading_as

_NAMES = tuple(
    re.compile(rf"(?:{word})(?:[ _](?:value|reading|parameter|param|wert|display))?\s*(?:[(\[][^()\[\]]*[)\]])?", re.IGNORECASE)
    for word in (r"primary|prim|pri|main", r"secondary|second|seco|sec|sub")
)
_FUNCTION = re.compile(
    r"[\s#%\"';,]*(?:(?:test|meas\w*|mess|lcr|display)[ _-]?)?"
    r"(?:func(?:tion)?|funktion|mode|param\w*|measur\w*|fonction|función)(?:[ _-]?type)?\b[^\w]+"
    r"(?P<first>c[ps])(?:\s*[-/–,]\s*(?P<second>d|q|rs|rp|g|esr)\b)?[\W]*",
    re.IGNORECASE,
)
_HOLDS = {"cp": "capacitance", "cs": "capacitance_series", "d": "dissipation", "q": "quality"}
_WITHIN = 200


def by_function(names: Sequence[str], below: Sequence[str], above: Sequence[str]) -> dict[int, tuple[Heading, str]]:
    """The columns `Primary` and `Secondary` where one function is named above: index -> heading, and the words above.

    Parameters
    ----------
    names, below : of all columns, and the units below them, "" where there is none.
    above : the lines above the header.

    >>> found = by_function(("Time(s)", "Primary", "Secondary"), ("",) * 3, ("FUNC,Cp-D", "FREQ,100.000kHz"))
    >>> [(index, heading.quantity, words) for index, (heading, words) in found.items()]
    [(1, 'capacitance', 'FUNC,Cp-D'), (2, 'dissipation', 'FUNC,Cp-D')]
    >>> by_function(("Time(s)", "Primary"), ("",) * 2, ("FUNC,Cp-D", "FUNC,Cs-D"))
    {}
    """
    places = [[i for i, name in enumerate(names) if form.fullmatch(name)] for form in _NAMES]
    if len(places[0]) != 1 or len(places[1]) > 1:
        return {}
    said = [(match, line) for line in above[-_WITHIN:] if (match := _FUNCTION.fullmatch(line)) is not None]
    if len({(match["first"].lower(), (match["second"] or "").lower()) for match, _ in said}) != 1:
        return {}
    match, line = said[0]
    found: dict[int, tuple[Heading, str]] = {}
    for place, letters in zip(places, (match["first"], match["second"]), strict=True):
        quantity = _HOLDS.get((letters or "").lower())
        if quantity is None:
            continue
        for index in place:
            heading = heading_as(quantity, names[index], below[index])
            found[index] = replace(heading, name=f"{heading.name} {letters.lower()}"), line.strip()[:60]
    return found

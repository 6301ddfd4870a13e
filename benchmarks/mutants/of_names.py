"""A document in, one with another header, name, unit or sign of a column out, with what may be read of it."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Sequence
from dataclasses import replace

from mutants.document import (
    UNITS,
    Column,
    Document,
    Row,
    all_numbers,
    digits_after,
    number,
    put,
    shown,
    with_cells,
    with_column,
    with_rows,
)
from mutants.kind import Kind
from mutants.of_columns import column_read, two_columns

#: Words of other languages for a quantity; all of them are promised to be understood.
_WORDS = {
    "time": ("Zeit", "Prüfzeit", "Temps", "Tiempo", "时间", "時間", "Czas", "Time elapsed"),
    "displacement": ("Weg", "Traversenweg", "Standardweg", "Déplacement", "Desplazamiento", "位移", "変位", "Przemieszczenie"),
    "force": ("Kraft", "Standardkraft", "Last", "Force", "Fuerza", "载荷", "力", "荷重", "Siła"),
    "capacitance": ("Kapazität", "Capacité", "Capacidad", "电容", "静電容量", "Cap", "Pojemność"),
}
# Seconds or milliseconds since 1970.
_SINCE_1970 = r"1\d{9}(\d{3})?(\.|$)"
#: Names that say of a capacitance that it is that of the series circuit.
_SERIES = ("Cs", "CS", "Series capacitance")
_STATISTICS = ("max", "min", "mean", "peak hold", "setpoint", "command", "target", "average", "std")
_MEANS = ("mean", "average")
_OTHER_UNITS = ("degC", "V", "%", "kPa", "rpm", "foo", "Ohm")


def _with_unit(doc: Document, rng: random.Random) -> int | None:
    places = [j for j, c in enumerate(doc.columns) if c.quantity in _WORDS and c.unit and c.factors]
    return rng.choice(places) if places else None


def _exchanged(doc: Document, first: Column, second: Column, places: tuple[int, int]) -> Document:
    doc = with_column(with_column(doc, places[0], first), places[1], second)
    # The numbers under these names are others now, and so is which way they go; that of force and displacement hangs together.
    moved = {first.quantity, second.quantity} & doc.turned.keys()
    return replace(
        doc,
        turned={} if moved else doc.turned,
        doubt_all=doc.doubt_all or any("status" in (c.name or "").lower() for c in (first, second)),
    )


def _takes_the_key(doc: Document, places: tuple[int, int]) -> bool:
    """Whether one of two columns is the key by which rows are of two records: under another name it tells so no more."""
    return doc.refuse and any(doc.columns[j].added for j in places)


def swap_headers(doc: Document, rng: random.Random) -> Document | None:
    """Names and units of two columns change places; what is read follows the header."""
    places = two_columns(doc, rng)
    if places is None or _takes_the_key(doc, places):
        return None
    first, second = doc.columns[places[0]], doc.columns[places[1]]
    return _exchanged(doc, replace(second, mark=first.mark), replace(first, mark=second.mark), places)


def swap_names(doc: Document, rng: random.Random) -> Document | None:
    """Names alone change places, units stay: read by the unit where it is of the name's kind, else not at all."""
    places = two_columns(doc, rng)
    if places is None:
        return None

    def under(name: Column, unit: Column) -> Column:
        kind = name.quantity or name.stands_in
        factor = UNITS.get(kind, {}).get(unit.unit)
        factors = () if factor is None or not name.factors else (factor,)
        return replace(name, gap=unit.gap or name.gap, bracket=unit.bracket, unit=unit.unit, factors=factors, mark=unit.mark)

    first, second = (doc.columns[j] for j in places)
    if first.unit == second.unit or _takes_the_key(doc, places) or _bears_a_unit(first) or _bears_a_unit(second):
        return None
    return _exchanged(doc, under(second, first), under(first, second), places)


def _bears_a_unit(column: Column) -> bool:
    """Whether a unit stands in the name itself, which goes where the name goes."""
    inside = (column.name or "").rpartition(" (")[2]
    return inside.endswith(")") and any(inside[:-1] in units for units in UNITS.values())


def other_unit(doc: Document, rng: random.Random) -> Document | None:
    """Another unit of the same kind."""
    at = _with_unit(doc, rng)
    if at is None:
        return None
    column = doc.columns[at]
    units = UNITS[column.quantity]
    own = units.get(column.unit, column.factors[0])
    unit = rng.choice([u for u in units if units[u] != own])
    # Epoch times in milliseconds are kept in seconds.
    return with_column(doc, at, replace(column, unit=unit, factors=tuple(f * units[unit] / own for f in column.factors)))


def restate(doc: Document, rng: random.Random) -> Document | None:
    """Another unit, and the numbers with it."""
    at = _with_unit(doc, rng)
    if at is None:
        return None
    column = doc.columns[at]
    pairs = {"N": "mN", "mm": "µm", "s": "ms", "sec": "ms", "kN": "N", "pF": "fF", "min": "s"}
    unit = pairs.get(column.unit)
    if unit is None or column.group or not all_numbers(doc, at):
        return None
    factor = UNITS[column.quantity][unit]
    ratio = column.factors[0] / factor

    def changed(text: str, value: float) -> tuple[str, float]:
        if value != value:
            return text, value
        new = shown(value * ratio, max(digits_after(text, column.mark) - 3, 0), column)
        return new, float(new.replace(column.mark, "."))

    return with_column(with_cells(doc, at, changed), at, replace(column, unit=unit, factors=(factor,)))


def wrong_unit(doc: Document, rng: random.Random) -> Document | None:
    """A unit of another dimension, or none that exists."""
    at = _with_unit(doc, rng)
    if at is None:
        return None
    column = doc.columns[at]
    others = [u for q, units in UNITS.items() if q not in (column.quantity, "frequency") for u in units if u and u != "m"]
    return with_column(doc, at, replace(column, unit=rng.choice([*others, *_OTHER_UNITS]), factors=()))


def no_unit(doc: Document, rng: random.Random) -> Document | None:
    """No unit at a length, a force or a capacitance."""
    at = _with_unit(doc, rng)
    if at is None or doc.columns[at].quantity == "time":
        return None
    if _has_unit_in_name(doc.columns[at]):
        return None
    return with_column(doc, at, replace(doc.columns[at], unit="", bracket="", gap="", factors=()))


def no_time_unit(doc: Document, rng: random.Random) -> Document | None:
    """No unit at the time."""
    at = doc.index("time")
    if at is None or not doc.columns[at].unit or _has_unit_in_name(doc.columns[at]):
        return None
    column = doc.columns[at]
    if not column.factors and any(re.match(_SINCE_1970, cell) for i in doc.rows() for cell in doc.row(i).cells[at : at + 1]):
        return None  # seconds and milliseconds since 1970 without a unit may be read as what they are
    return with_column(doc, at, replace(column, unit="", bracket="", gap="", told="time"))


def _has_unit_in_name(column: Column) -> bool:
    """Whether a change before has put a unit into the name, which is left if that behind it is deleted."""
    units = [u for u in UNITS.get(column.quantity, {}) if u]
    return any(f"({u})" in (column.name or "") or f"[{u}]" in (column.name or "") for u in units)


def unit_above(doc: Document, rng: random.Random) -> Document | None:
    """The unit in a line above instead."""
    at = _with_unit(doc, rng)
    if at is None:
        return None
    column = doc.columns[at]
    line = f"Units : {column.name}{doc.delimiter}{column.unit}"
    return replace(with_column(doc, at, replace(column, unit="", bracket="", gap="")), above=(*_unblanked(doc.above), line))


def other_unit_above(doc: Document, rng: random.Random) -> Document | None:
    """A line above declares another unit than the header."""
    at = _with_unit(doc, rng)
    if at is None:
        return None
    column = doc.columns[at]
    units = UNITS[column.quantity]
    unit = rng.choice([u for u in units if units[u] != units.get(column.unit, column.factors[0])])
    doc = replace(doc, above=(*_unblanked(doc.above), f"Units : {column.name}{doc.delimiter}{unit}"))
    return with_column(doc, at, replace(column, factors=()))


def _unblanked(above: Sequence[str]) -> tuple[str, ...]:
    return tuple(above[:-1]) if above and not above[-1].strip() else tuple(above)


def _bracket(
    words: Sequence[str], factors: Callable[[Column, str], tuple[float, ...]], told: bool = False
) -> Callable[[Document, random.Random], Document | None]:
    def change(doc: Document, rng: random.Random) -> Document | None:
        at = _with_unit(doc, rng)
        if at is None:
            return None
        column = doc.columns[at]
        word = rng.choice([w for w in words if w != column.unit])
        name = f"{column.name} {rng.choice(('({})', '[{}]')).format(word)}"
        return with_column(
            doc, at, replace(column, name=name, factors=factors(column, word), told=word if told else column.told)
        )

    return change


def _same(column: Column, _: str) -> tuple[float, ...]:
    return column.factors


def _of_a_mean(column: Column, word: str) -> tuple[float, ...]:
    return column.factors if word in _MEANS else ()


def _multiplied(column: Column, word: str) -> tuple[float, ...]:
    return tuple(f * float(word.lstrip("x×*").replace("^", "e").replace("10e", "1e")) for f in column.factors)


def series(doc: Document, rng: random.Random) -> Document | None:
    """A series capacitance: the parallel one is Cs / (1 + D^2), which needs D."""
    at, loss = doc.index("capacitance"), doc.index("dissipation")
    if at is None or loss is None or not doc.columns[at].factors or doc.refuse:
        return None
    if len(doc.columns[loss].factors) != 1 or not (all_numbers(doc, at) and all_numbers(doc, loss)):
        return None
    factor = doc.columns[loss].factors[0]

    def parallel(row: Row) -> Row:
        return replace(row, values=put(row.values, at, row.values[at] / (1.0 + (factor * row.values[loss]) ** 2)))

    name = rng.choice(_SERIES)
    return with_column(with_rows(doc, parallel), at, _renamed(doc.columns[at], name))


def loss_in_percent(doc: Document, rng: random.Random) -> Document | None:
    """The dissipation in per cent or per mille."""
    at = doc.index("dissipation")
    if at is None or doc.columns[at].factors != (1.0,) or not all_numbers(doc, at):
        return None
    unit, ratio = rng.choice((("%", 100.0), ("‰", 1000.0)))
    column = doc.columns[at]

    def changed(text: str, value: float) -> tuple[str, float]:
        new = shown(value * ratio, 4, column)
        return new, number(new, column)

    new = replace(column, gap=" ", bracket="()", unit=unit, factors=(1.0 / ratio,))
    return with_column(with_cells(doc, at, changed), at, new)


def doubled_unit(doc: Document, rng: random.Random) -> Document | None:
    """A second unit, which contradicts the first."""
    at = _with_unit(doc, rng)
    if at is None:
        return None
    column = doc.columns[at]
    units = UNITS[column.quantity]
    other = rng.choice([u for u in units if units[u] != units.get(column.unit, column.factors[0])])
    return with_column(doc, at, replace(column, name=f"{column.name} ({other})", factors=()))


def agreeing_unit(doc: Document, rng: random.Random) -> Document | None:
    """The same unit written twice."""
    at = _with_unit(doc, rng)
    if at is None:
        return None
    return with_column(doc, at, replace(doc.columns[at], name=f"{doc.columns[at].name} ({doc.columns[at].unit})"))


def flip(doc: Document, rng: random.Random) -> Document | None:
    """The sign of displacement or force turned."""
    at = column_read(doc, rng, ("displacement", "force"))
    return None if at is None else replace(doc, flipped=doc.flipped ^ {doc.columns[at].quantity}, signs=True)


def language(doc: Document, rng: random.Random) -> Document | None:
    """A name of another language."""
    at = column_read(doc, rng)
    # A series capacitance under a name that does not say so is another one.
    if at is None or (doc.columns[at].name or "").startswith(_SERIES):
        return None
    column = doc.columns[at]
    return with_column(doc, at, _renamed(column, rng.choice(_WORDS[column.quantity])))


def _renamed(column: Column, word: str) -> Column:
    """The column under another word, with the brackets of its name, which a change before may have put there."""
    brackets = re.search(r" ?[(\[].*", column.name or "")
    return replace(column, name=word + (brackets[0] if brackets else ""))


KINDS = (
    Kind("swap two headers", "the numbers follow the header", swap_headers),
    Kind("swap two names, units stay", "read in the unit that stands there if it is of the name's kind", swap_names),
    Kind("unit of the same kind", "the numbers scale by exactly the factor", other_unit),
    Kind("unit and numbers restated", "the same in SI", restate, True),
    Kind("series capacitance", "parallel by the dissipation of its row", series, True),
    Kind("dissipation in per cent or per mille", "the same in SI", loss_in_percent),
    Kind("unit of another dimension", "no reading of it is right", wrong_unit),
    Kind("unit deleted", "nothing says which it is", no_unit),
    Kind("time unit deleted", "seconds may be taken if that is told", no_time_unit),
    Kind("unit declared above", "said in another place", unit_above),
    Kind("unit contradicted above", "nothing says which is right", other_unit_above, last=True),
    Kind(
        "bracket: statistic",
        "a maximum or a setpoint is no record; a mean alone is one, and told",
        _bracket(_STATISTICS, _of_a_mean, told=True),
    ),
    Kind(
        "bracket: factor",
        "applied and told, or refused",
        _bracket(("x10", "x100", "1e-3", "×1000", "1e3", "10^3", "*10"), _multiplied, told=True),
    ),
    Kind("bracket: plain word", "says which record it is", _bracket(("raw", "measured", "Channel 1", "ch 1"), _same)),
    Kind("bracket: contradicting unit", "nothing says which is right", doubled_unit),
    Kind("bracket: same unit twice", "said twice", agreeing_unit, True),
    Kind("sign flipped", "compression is positive again, with the same numbers", flip),
    Kind("name of another language", "the same quantity", language, True),
)

"""A document in, one with another header, unit, name, sign or column out, with what may be read of it."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import replace

from calib.lab import Reading
from mutants.document import NAN, UNITS, Column, Document, Row, digits_after, shown, with_cells, with_column, with_rows
from mutants.kind import Kind

#: Words of other languages for a quantity; all of them are promised to be understood.
_WORDS = {
    "time": ("Zeit", "Prüfzeit", "Temps", "Tiempo", "时间", "時間", "Czas", "Time elapsed"),
    "displacement": ("Weg", "Traversenweg", "Standardweg", "Déplacement", "Desplazamiento", "位移", "変位", "Przemieszczenie"),
    "force": ("Kraft", "Standardkraft", "Last", "Force", "Fuerza", "载荷", "力", "荷重", "Siła"),
    "capacitance": ("Kapazität", "Capacité", "Capacidad", "电容", "静電容量", "Cap", "Pojemność"),
}
_STATISTICS = ("max", "min", "mean", "peak hold", "setpoint", "command", "target", "average", "std")
_RIVALS = {
    "time": ("Time 2", "Start time", "Time (setpoint)", "Cycle time"),
    "displacement": ("Extension 2", "d", "z", "D", "Displacement (setpoint)", "Height", "Strain 1", "Extensometer"),
    "force": ("Load 2", "Load (setpoint)", "Force B", "Load cell 2", "Preload", "Force target", "Tare force"),
    "capacitance": ("Cap2", "Cp 2", "C2", "Cp (setpoint)", "C ref", "Stray capacitance"),
}
_OTHER_UNITS = ("degC", "V", "%", "kPa", "rpm", "foo", "Ohm")
_KEYS = {
    "Channel": ("1", "2"),
    "Sensor": ("A", "B"),
    "Frequency (Hz)": ("1000", "100000"),
    "Specimen": ("1", "2"),
    "Range": ("100 pF", "1 nF"),
    "Sample ID": ("s1", "s2"),
}


def _used(doc: Document, rng: random.Random, words: Sequence[str] = ()) -> int | None:
    """One of the columns that are read as time, displacement, force or capacitance, or as one of `words`."""
    places = [j for j, c in enumerate(doc.columns) if c.quantity in (words or _WORDS) and c.name]
    return rng.choice(places) if places else None


def _with_unit(doc: Document, rng: random.Random) -> int | None:
    places = [j for j, c in enumerate(doc.columns) if c.quantity in _WORDS and c.unit and c.factors]
    return rng.choice(places) if places else None


def _swap(doc: Document, rng: random.Random) -> tuple[int, int] | None:
    first = _used(doc, rng)
    others = [j for j, c in enumerate(doc.columns) if j != first and c.name]
    return None if first is None or not others else (first, rng.choice(others))


def _exchanged(doc: Document, first: Column, second: Column, places: tuple[int, int]) -> Document:
    doc = with_column(with_column(doc, places[0], first), places[1], second)
    return replace(doc, doubt_all=doc.doubt_all or any("status" in (c.name or "").lower() for c in (first, second)))


def swap_headers(doc: Document, rng: random.Random) -> Document | None:
    """Names and units of two columns change places; what is read follows the header."""
    places = _swap(doc, rng)
    if places is None:
        return None
    first, second = doc.columns[places[0]], doc.columns[places[1]]
    return _exchanged(doc, replace(second, mark=first.mark), replace(first, mark=second.mark), places)


def swap_names(doc: Document, rng: random.Random) -> Document | None:
    """Names alone change places, units stay: read by the unit where it is of the name's kind, else not at all."""
    places = _swap(doc, rng)
    if places is None:
        return None

    def under(name: Column, unit: Column) -> Column:
        kind = name.quantity or name.stands_in
        factor = UNITS.get(kind, {}).get(unit.unit)
        factors = () if factor is None or not name.factors else (factor,)
        return replace(name, gap=unit.gap or name.gap, bracket=unit.bracket, unit=unit.unit, factors=factors, mark=unit.mark)

    first, second = (doc.columns[j] for j in places)
    if first.unit == second.unit:
        return None
    return _exchanged(doc, under(second, first), under(first, second), places)


def swap_columns(doc: Document, rng: random.Random) -> Document | None:
    """Two columns change places with all that is in them."""
    places = _swap(doc, rng)
    if (
        places is None
        or any(c.name is None for c in doc.columns)
        or any(len(doc.row(i).cells) != len(doc.columns) for i in doc.rows())
    ):
        return None
    order = list(range(len(doc.columns)))
    order[places[0]], order[places[1]] = order[places[1]], order[places[0]]

    def moved(row: Row) -> Row:
        return replace(row, cells=tuple(row.cells[j] for j in order), values=tuple(row.values[j] for j in order))

    return with_rows(replace(doc, columns=tuple(doc.columns[j] for j in order)), moved)


def other_unit(doc: Document, rng: random.Random) -> Document | None:
    """Another unit of the same kind."""
    at = _with_unit(doc, rng)
    if at is None:
        return None
    column = doc.columns[at]
    units = UNITS[column.quantity]
    unit = rng.choice([u for u in units if units[u] != column.factors[0]])
    return with_column(doc, at, replace(column, unit=unit, factors=(units[unit],)))


def restate(doc: Document, rng: random.Random) -> Document | None:
    """Another unit, and the numbers with it."""
    at = _with_unit(doc, rng)
    if at is None:
        return None
    column = doc.columns[at]
    pairs = {"N": "mN", "mm": "µm", "s": "ms", "sec": "ms", "kN": "N", "pF": "fF", "min": "s"}
    unit = pairs.get(column.unit)
    if unit is None or column.group:
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
    return with_column(doc, at, replace(doc.columns[at], unit="", bracket="", gap="", factors=()))


def no_time_unit(doc: Document, rng: random.Random) -> Document | None:
    """No unit at the time."""
    at = doc.index("time")
    if at is None or not doc.columns[at].unit:
        return None
    column = doc.columns[at]
    return with_column(doc, at, replace(column, unit="", bracket="", gap="", told="time"))


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
    unit = rng.choice([u for u in units if units[u] != column.factors[0]])
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


def _none(_: Column, __: str) -> tuple[float, ...]:
    return ()


def _multiplied(column: Column, word: str) -> tuple[float, ...]:
    return tuple(f * float(word.lstrip("x×*").replace("^", "e").replace("10e", "1e")) for f in column.factors)


def doubled_unit(doc: Document, rng: random.Random) -> Document | None:
    """A second unit, which contradicts the first."""
    at = _with_unit(doc, rng)
    if at is None:
        return None
    column = doc.columns[at]
    units = UNITS[column.quantity]
    other = rng.choice([u for u in units if units[u] != column.factors[0]])
    return with_column(doc, at, replace(column, name=f"{column.name} ({other})", factors=()))


def agreeing_unit(doc: Document, rng: random.Random) -> Document | None:
    """The same unit written twice."""
    at = _with_unit(doc, rng)
    if at is None:
        return None
    return with_column(doc, at, replace(doc.columns[at], name=f"{doc.columns[at].name} ({doc.columns[at].unit})"))


def insert_column(doc: Document, at: int, column: Column, cells: Sequence[str], values: Sequence[float]) -> Document:
    """The document with one more column.

    Parameters
    ----------
    doc : the document.
    at : its place.
    column : its description.
    cells, values : text and number for each row of the body, in order.

    Returns
    -------
    The new document.
    """
    new = iter(zip(cells, values, strict=True))

    def longer(row: Row) -> Row:
        text, value = next(new)
        values = (*row.values[:at], value if at <= len(row.cells) else NAN, *row.values[at:])
        return replace(
            row, cells=(*row.cells[:at], text, *row.cells[at:]) if at <= len(row.cells) else row.cells, values=values
        )

    return with_rows(replace(doc, columns=(*doc.columns[:at], column, *doc.columns[at:])), longer)


def _series(doc: Document, at: int, rng: random.Random, style: str) -> list[float]:
    own = [doc.row(i).values[at] for i in doc.rows()]
    if style == "constant":
        return [round(rng.uniform(0.5, 20.0), 3)] * len(own)
    if style == "noise":
        return [rng.gauss(0.0, 0.01) for _ in own]
    factor = rng.choice((0.5, 1.1, 1.3, -1.0))
    return [0.1 + factor * v for v in own]


def rival(doc: Document, rng: random.Random) -> Document | None:
    """A column with a name of the same kind and other numbers."""
    at = _used(doc, rng)
    if at is None:
        return None
    column = doc.columns[at]
    name = rng.choice(_RIVALS[column.quantity])
    new = replace(column, name=name, quantity="", factors=(), told="", added=True)
    values = _series(doc, at, rng, rng.choice(("like", "like", "constant", "noise")))
    place = rng.choice((at, at + 1, len(doc.columns)))
    return insert_column(doc, place, new, [shown(v, 4, new) if v == v else "" for v in values], values)


def twin(doc: Document, rng: random.Random) -> Document | None:
    """A column with the same header and other numbers."""
    at = _used(doc, rng)
    if at is None:
        return None
    column = replace(doc.columns[at], factors=())
    values = _series(doc, at, rng, rng.choice(("like", "constant", "noise")))
    doc = with_column(doc, at, column)
    new = replace(column, quantity="", added=True)
    return insert_column(doc, rng.choice((at, at + 1)), new, [shown(v, 4, new) if v == v else "" for v in values], values)


def agreeing_column(doc: Document, rng: random.Random) -> Document | None:
    """The force once more in pounds."""
    at = doc.index("force")
    if at is None or not doc.columns[at].factors or not doc.columns[at].unit:
        return None
    column = doc.columns[at]
    factor = UNITS["force"]["lbf"]
    new = replace(column, unit="lbf", quantity="", factors=(factor,), stands_in="force", added=True)
    values = [round(doc.row(i).values[at] * column.factors[0] / factor, 6) for i in doc.rows()]
    return insert_column(doc, rng.choice((at, at + 1)), new, [shown(v, 6, new) if v == v else "" for v in values], values)


def _keyed(doc: Document, rng: random.Random) -> tuple[Document, str, str] | None:
    if any(c.name is None for c in doc.columns) or len(doc.rows()) < 4:
        return None
    name, keys = rng.choice(list(_KEYS.items()))
    at = rng.choice((0, 1, len(doc.columns)))
    blocks = rng.random() < 0.5
    column = Column(name, added=True) if "(" not in name else Column(name[:-5], " ", "()", "Hz", added=True)
    factors = [rng.choice((0.8, 1.2, 1.5)) for _ in doc.columns]

    def key(row: Row, text: str) -> Row:
        values = (*row.values[:at], NAN, *row.values[at:])
        return replace(row, cells=(*row.cells[:at], text, *row.cells[at:]), values=values)

    def second(row: Row) -> Row:
        cells = tuple(
            shown(row.values[j] * factors[j], max(digits_after(text, c.mark), 2), c)
            if j < len(doc.columns)
            and (c := doc.columns[j]).quantity not in ("", "time", "cycle")
            and row.values[j] == row.values[j]
            else text
            for j, text in enumerate(row.cells)
        )
        return replace(key(replace(row, cells=cells), keys[1]), absent=True)

    body: list[object] = []
    for item in doc.body:
        body += [key(item, keys[0])] if isinstance(item, Row) else [item]
        if isinstance(item, Row) and not blocks:
            body.append(second(item))
    if blocks:
        body += [second(item) for item in doc.body if isinstance(item, Row)]
    new = replace(
        doc, columns=(*doc.columns[:at], column, *doc.columns[at:]), body=tuple(v for v in body if not isinstance(v, str))
    )
    return new, name, keys[0]


def key_column(doc: Document, rng: random.Random) -> Document | None:
    """Every row twice, of two channels, frequencies or specimens."""
    found = _keyed(doc, rng)
    return None if found is None else replace(found[0], refuse=True)


def key_chosen(doc: Document, rng: random.Random) -> Document | None:
    """The same, and the user says which."""
    found = _keyed(doc, rng)
    if found is None or doc.reading != Reading():
        return None
    new, name, value = found
    header = name if doc.units_row is False or "(" not in name else name[:-5]
    return replace(new, reading=Reading(where={header: value}))


def constant_key(doc: Document, rng: random.Random) -> Document | None:
    """A key column with one value."""
    name, keys = rng.choice([(n, v) for n, v in _KEYS.items() if "(" not in n])
    n = len(doc.rows())
    return insert_column(doc, rng.choice((0, len(doc.columns))), Column(name, added=True), [keys[0]] * n, [NAN] * n)


def flip(doc: Document, rng: random.Random) -> Document | None:
    """The sign of displacement or force turned."""
    at = _used(doc, rng, ("displacement", "force"))
    return None if at is None else replace(doc, flipped=doc.flipped ^ {doc.columns[at].quantity})


def language(doc: Document, rng: random.Random) -> Document | None:
    """A name of another language."""
    at = _used(doc, rng)
    if at is None:
        return None
    column = doc.columns[at]
    return with_column(doc, at, replace(column, name=rng.choice(_WORDS[column.quantity])))


def index_column(doc: Document, rng: random.Random) -> Document | None:
    """A column that counts the rows, with a name."""
    n = len(doc.rows())
    start = rng.choice((0, 1))
    name = rng.choice(("No.", "Index", "#", "Point", "n", "Reading", "Sample", "Row"))
    return insert_column(doc, 0, Column(name, added=True), [str(i + start) for i in range(n)], [i + start for i in range(n)])


def index_without_name(doc: Document, rng: random.Random) -> Document | None:
    """A column that counts the rows, with an empty name or no cell in the header at all."""
    n = len(doc.rows())
    name = rng.choice(("", None))
    return insert_column(doc, 0, Column(name), [str(i) for i in range(n)], [float(i) for i in range(n)])


KINDS = (
    Kind("swap two headers", "the numbers follow the header", swap_headers),
    Kind(
        "swap two names, units stay", "read in the unit that stands there if it is one of the name's kind, else not", swap_names
    ),
    Kind("swap two columns", "order means nothing", swap_columns, True),
    Kind("unit of the same kind", "the numbers scale by exactly the factor", other_unit),
    Kind("unit and numbers restated", "the same in SI", restate, True),
    Kind("unit of another dimension", "no reading of it is right", wrong_unit),
    Kind("unit deleted", "nothing says which it is", no_unit),
    Kind("time unit deleted", "seconds may be taken if that is told", no_time_unit),
    Kind("unit declared above", "said in another place", unit_above),
    Kind("unit contradicted above", "nothing says which is right", other_unit_above),
    Kind("bracket: statistic", "a maximum, a mean or a setpoint is no record", _bracket(_STATISTICS, _none)),
    Kind(
        "bracket: factor",
        "applied and told, or refused",
        _bracket(("x10", "x100", "1e-3", "×1000", "1e3", "10^3", "*10"), _multiplied, told=True),
    ),
    Kind("bracket: plain word", "says which record it is", _bracket(("raw", "measured", "Channel 1", "ch 1"), _same)),
    Kind("bracket: contradicting unit", "nothing says which is right", doubled_unit),
    Kind("bracket: same unit twice", "said twice", agreeing_unit, True),
    Kind("rival column", "the true one is read and the rival named", rival),
    Kind("two columns of one header", "nothing says which is right", twin),
    Kind("the same force in pounds", "both agree", agreeing_column, True),
    Kind("key column of two values", "a choice must be made", key_column),
    Kind("key column, chosen", "the rows that were chosen", key_chosen, True),
    Kind("key column of one value", "named, as it is not used", constant_key, True),
    Kind("sign flipped", "compression is positive again, with the same numbers", flip),
    Kind("name of another language", "the same quantity", language, True),
    Kind("index column", "named, as it is not used", index_column, True),
    Kind("index column without a name", "no reading, and no column is shifted by it", index_without_name),
)

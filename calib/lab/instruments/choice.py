"""From a `Sheet` to which of its columns stand for which quantity, why the others are not read, and what is a choice."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from calib.errors import Fault
from calib.lab.instruments.circuit import said_circuit
from calib.lab.instruments.clock import is_clock
from calib.lab.instruments.family import InstrumentFamily
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.lexicon import OF_TESTERS
from calib.lab.instruments.numbers import is_numeric
from calib.lab.instruments.rivals import difference, goes_back, readings, stands_still
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.unit_choice import unit_of_column
from calib.lab.instruments.units import IN_PLACE_OF, is_unit_of
from calib.lab.instruments.vocabulary import EXAMPLE, NEEDS_UNIT, Heading, understood_names, why_unread, words
from models.sensor import FloatArray

# Quantities of which two columns that differ are a choice of the user.
_DECISIVE = ("time", "displacement", "force", "capacitance", "capacitance_series")
_RAW = "the load as the cell read it is preferred, its zero is a parameter of the model"


@dataclass(frozen=True)
class ColumnChoice:
    """Which columns are read, and what is to be said of all others.

    Attributes
    ----------
    chosen : quantity -> index of its column and its heading.
    unread : index -> why a column is not read.
    notes : choices made, one sentence each.
    faults : choices that the file does not tell.
    """

    chosen: Mapping[str, tuple[int, Heading]]
    unread: Mapping[int, str]
    notes: tuple[str, ...]
    faults: tuple[Fault, ...]


@dataclass(frozen=True)
class _Candidate:
    """A column that may be read as a quantity: its readings in SI at some rows, None where its unit is not known."""

    index: int
    heading: Heading
    values: FloatArray | None = field(default=None, compare=False)


def choose_columns(sheet: Sheet, family: InstrumentFamily, reading: Reading) -> ColumnChoice:
    """Choose which column of a file stands for which quantity: by the user's word, else by the preferred name.

    A column that stands still gives way to one that moves, one that was worked on to one that was not, and one whose unit or
    name is in doubt to one that is plain. Columns that agree but for their zero and sign are decided by the preferred name; of
    those that differ beyond that the user must choose, but for a raw force, which is preferred to a corrected one, and for a
    name with a number or letter (Load 2), which gives way to one without.

    Parameters
    ----------
    sheet : the record.
    family : what it was recognised as.
    reading : what the user says of the file.
    """
    headings, unread, notes, faults = _in_circuit(sheet, reading)
    unread.update({i: why for i, why in sheet.set_aside.items() if i < len(sheet.names)})
    headings = _without_stray_letters(sheet, headings, family, unread)
    by_quantity: dict[str, list[_Candidate]] = {}
    for index, heading in headings.items():
        by_quantity.setdefault(heading.quantity, []).append(_Candidate(index, heading))
    chosen: dict[str, tuple[int, Heading]] = {}
    for quantity, candidates in by_quantity.items():
        asked = [c for c in candidates if c.index in sheet.assigned]
        if asked:
            chosen[quantity] = asked[0].index, asked[0].heading
            notes.append(f'{quantity} is taken from "{_shown(sheet, asked[0].index)}" as asked')
            continue
        best, more = _best_of(sheet, quantity, candidates, reading, _index_of_asked(sheet))
        unread.update(more.unread)
        notes += more.notes
        faults += more.faults
        if best is not None:
            chosen[quantity] = best.index, best.heading
    _drop_what_has_no_use(sheet, chosen, unread)
    notes += _rest(sheet, chosen, unread, faults)
    return ColumnChoice(chosen, unread, tuple(notes), tuple(faults))


def _shown(sheet: Sheet, index: int) -> str:
    return sheet.names[index] or f"column {index + 1}"


def _index_of_asked(sheet: Sheet) -> str:
    """The number or letter in the names that the user gave, if they have one: the others go with it."""
    found = {sheet.plain_heading(i).index for i in sheet.assigned} - {""}
    return found.pop() if len(found) == 1 else ""


def _in_circuit(sheet: Sheet, reading: Reading) -> tuple[dict[int, Heading], dict[int, str], list[str], list[Fault]]:
    """The headings, with a capacitance whose name does not say so in series where the lines above the header do."""
    headings = dict(sheet.headings())
    notes: list[str] = []
    faults: list[Fault] = []
    said = said_circuit(sheet.prelude)
    if said is None:
        return headings, {}, notes, faults
    for index, heading in sheet.headings().items():
        if heading.quantity != "capacitance" or index in sheet.assigned:
            continue
        names_it = heading.name.startswith(("cp", "parallel"))
        if said.word == "both" or (said.word == "series" and names_it):
            claim = f'"{said.shown}" stands in line {said.line}'
            faults.append(
                Fault(
                    f'column "{sheet.names[index]}" may be a series or a parallel capacitance: {claim}',
                    sheet.text.path,
                    sheet.header_line or None,
                    index + 1,
                    advice=f'Say which: --columns "capacitance_series={sheet.name_for_asking(index)}" for Cs, '
                    f'else --columns "capacitance={sheet.name_for_asking(index)}"',
                )
            )
        elif said.word == "series":
            headings[index] = replace(heading, quantity="capacitance_series")
            notes.append(f'"{sheet.names[index]}" is a series capacitance: "{said.shown}" stands in line {said.line}')
        elif said.word == "parallel" and not names_it:
            headings[index] = replace(heading, name=f"parallel {heading.name}")
            notes.append(f'"{sheet.names[index]}" is a parallel capacitance: "{said.shown}" stands in line {said.line}')
    return headings, {}, notes, faults


def _without_stray_letters(
    sheet: Sheet, headings: Mapping[int, Heading], family: InstrumentFamily, unread: dict[int, str]
) -> dict[int, Heading]:
    """The headings without letters that have no unit and are not needed: `C`, `T` or `Z` may mean anything."""
    kept = dict(headings)
    for index, heading in headings.items():
        has_unit = heading.unit or sheet.unit_below(index) or heading.quantity in sheet.declared_units
        stray = heading.letter and heading.quantity in NEEDS_UNIT and not has_unit and index not in sheet.assigned
        others = frozenset(IN_PLACE_OF.get(h.quantity, h.quantity) for i, h in kept.items() if i != index)
        stray = stray and not (heading.quantity == "time" and sheet.names[index].strip().islower())
        if stray and not family.requirement(others):
            del kept[index]
            unread[index] = "a letter without a unit"
    return kept


# --- one quantity --------------------------------------------------------------------------------------------------------


def _best_of(
    sheet: Sheet, quantity: str, candidates: Sequence[_Candidate], reading: Reading, asked_index: str
) -> tuple[_Candidate | None, ColumnChoice]:
    """The column that is read for a quantity, None if there is none, and what is to be said of the others."""
    unread: dict[int, str] = {}
    filled = [c for c in candidates if _first_cell(sheet, c.index)]
    unread.update({c.index: "empty" for c in candidates if c not in filled})
    candidates = filled or candidates[:1]
    if not filled:
        unread.pop(candidates[0].index)
    if len(candidates) > 1 and quantity != "status":
        candidates = _with_values(sheet, candidates, reading)
        candidates = _that_move(sheet, quantity, candidates, unread)
    else:
        letter = candidates[0].heading.letter and quantity == "displacement"
        if letter and filled and stands_still(readings([sheet.columns[candidates[0].index]], [1.0], sheet.declared_decimal)[0]):
            unread[candidates[0].index] = "stands still: a dimension of the sample, no record"
            return None, ColumnChoice({}, unread, (), ())
    plain = [c for c in candidates if not c.heading.name_doubt and not c.heading.unit_doubt and _fits(sheet, c)]
    if any(words(sheet.names[c.index]) == words(sheet.names[p.index]) for c in candidates if c not in plain for p in plain):
        plain = []  # of two columns of one name none is the plain one
    for c in candidates if plain else ():
        if c not in plain:
            unread[c.index] = c.heading.name_doubt or c.heading.unit_doubt or "its unit is none of the quantity"
    candidates = sorted(plain or candidates, key=lambda c: _preference(c, asked_index))
    best, others = candidates[0], candidates[1:]
    found = _beside(sheet, quantity, best, others, asked_index)
    faults = list(found.faults)
    if best.heading.name_doubt:
        faults.append(
            Fault(
                f'column "{sheet.names[best.index]}" may be no {_said(quantity)}: {best.heading.name_doubt}',
                sheet.text.path,
                sheet.header_line or None,
                best.index + 1,
                advice=f'If it is the one: --columns "{quantity}={sheet.name_for_asking(best.index)}"',
            )
        )
    if best.heading.processed and quantity in _DECISIVE:
        found = replace(found, notes=(*found.notes, f'"{sheet.names[best.index]}" was worked on after the measurement'))
    return best, ColumnChoice({}, {**unread, **found.unread}, found.notes, tuple(faults))


def _said(quantity: str) -> str:
    return quantity.replace("_", " ").replace("capacitance series", "series capacitance")


def _first_cell(sheet: Sheet, index: int) -> str:
    return next((c for cell in sheet.columns[index] if (c := cell.strip())), "")


def _fits(sheet: Sheet, candidate: _Candidate) -> bool:
    """Whether the unit of a column, if it has one, is one of its quantity."""
    units = [u for u in (candidate.heading.unit or "", sheet.unit_below(candidate.index)) if u]
    return all(is_unit_of(u, candidate.heading.quantity) for u in units)


def _preference(candidate: _Candidate, asked_index: str) -> tuple[bool, bool, bool, int, int]:
    heading = candidate.heading
    other = bool(heading.index) and heading.index != asked_index
    return (bool(asked_index) and heading.index != asked_index, other, heading.processed, heading.rank, candidate.index)


def _with_values(sheet: Sheet, candidates: Sequence[_Candidate], reading: Reading) -> list[_Candidate]:
    factors = [unit_of_column(sheet, c.index, c.heading, reading) for c in candidates]
    # A decimal mark that the user gives or the file declares decides.
    decimal = reading.decimal or sheet.declared_decimal
    values = readings([sheet.columns[c.index] for c in candidates], [f for _, f in factors], decimal)
    known = [fault is None or holds_clock(sheet.columns[c.index]) for c, (fault, _) in zip(candidates, factors, strict=True)]
    return [replace(c, values=v if ok else None) for c, v, ok in zip(candidates, values, known, strict=True)]


def _that_move(sheet: Sheet, quantity: str, candidates: list[_Candidate], unread: dict[int, str]) -> list[_Candidate]:
    """The candidates without those that stand still while others move; of times also without times of day."""
    still = [c for c in candidates if c.values is not None and stands_still(c.values)]
    moving = [c for c in candidates if c not in still]
    if quantity in _DECISIVE and still and moving:
        unread.update({c.index: f'stands still while "{sheet.names[moving[0].index]}" moves' for c in still})
        candidates = moving
    if quantity == "time":
        # Seconds are finer than a time of day.
        plain = [c for c in candidates if not holds_clock(sheet.columns[c.index])]
        if plain:
            days = [c for c in candidates if c not in plain]
            unread.update({c.index: f'a time of day: "{sheet.names[plain[0].index]}" is preferred' for c in days})
            candidates = plain
    return candidates


def _begins_anew(candidate: _Candidate) -> bool:
    return candidate.values is not None and goes_back(candidate.values)


def _beside(sheet: Sheet, quantity: str, best: _Candidate, others: Sequence[_Candidate], asked_index: str) -> ColumnChoice:
    """What is to be said of columns beside the one that is read: they are the same, they are less, or they are a choice."""
    name = sheet.names[best.index]
    unread: dict[int, str] = {}
    notes: list[str] = []
    rivals: list[_Candidate] = []
    shares: dict[int, float] = {}
    for other in others:
        index, heading = other.index, other.heading
        word, share = ("different", 1.0)
        if other.values is not None and best.values is not None:
            word, share = difference(best.values, other.values)
        shares[index] = share
        less = heading.processed > best.heading.processed or (
            quantity == "force" and best.heading.name.startswith("raw") and not heading.index
        )
        numbered = bool(heading.index) and heading.index != best.heading.index and (not best.heading.index or asked_index)
        if word == "same":
            unread[index] = f'the same readings as "{name}"'
        elif quantity not in _DECISIVE:
            unread[index] = f'another column of the {_said(quantity)}: "{name}" is preferred'
        elif quantity == "time" and heading.name != best.heading.name and _begins_anew(other) and not _begins_anew(best):
            unread[index] = f'begins anew within the record: "{name}" is preferred'
            notes.append(f'time is taken from "{name}", not from "{sheet.names[index]}", which begins anew within the record')
        elif less:
            why = f"; {_RAW}" if quantity == "force" else ""
            unread[index] = f'worked on after the measurement: "{name}" is preferred{why}'
            notes.append(f'{_said(quantity)} is taken from "{name}", not from "{sheet.names[index]}"{why}')
        elif word in ("zero", "sign") and heading.index == best.heading.index:
            unread[index] = f'the same readings as "{name}" but for their {word}: "{name}" is preferred'
            notes.append(
                f'{_said(quantity)} is taken from "{name}", not from "{sheet.names[index]}", which differs by its {word}'
            )
        elif numbered:
            unread[index] = f'another {_said(quantity)} column: "{name}" is preferred'
            notes.append(
                f'{_said(quantity)} is taken from "{name}", not from "{sheet.names[index]}", which holds other readings: '
                f'--columns "{quantity}={sheet.name_for_asking(index)}" if that is meant'
            )
        else:
            rivals.append(other)
    same = [i for i, why in unread.items() if why.startswith("the same readings") and "but for" not in why]
    if same:
        twins = [i for i in same if sheet.names[i] == name]
        if twins:
            notes.append(f'"{name}" stands {len(twins) + 1} times with the same values')
        listed = ", ".join(f'"{sheet.names[i]}"' for i in same if i not in twins)
        if listed:
            notes.append(f'{_said(quantity)} is taken from "{name}"; {listed} agrees with it')
    return ColumnChoice({}, unread, tuple(notes), tuple(_choice_of(sheet, quantity, best, rivals, shares)))


def _choice_of(
    sheet: Sheet, quantity: str, best: _Candidate, rivals: Sequence[_Candidate], shares: Mapping[int, float]
) -> list[Fault]:
    """The fault of columns of which the user must choose one."""
    if not rivals:
        return []
    all_of = [best, *rivals]
    asking = [sheet.name_for_asking(c.index) for c in all_of]
    asked_for = IN_PLACE_OF.get(quantity, quantity) if quantity == "quality" else quantity
    advice = "Say which one is meant: " + " or ".join(f'--columns "{asked_for}={a}"' for a in asking[:40])
    line, first = sheet.header_line or None, rivals[0]
    twice = [c for c in rivals if sheet.names[c.index] == sheet.names[best.index]]
    if len(twice) == len(rivals):
        message = f'column "{sheet.names[best.index]}" appears twice (columns {best.index + 1} and {first.index + 1})'
    else:
        listed = ", ".join(f'"{sheet.names[c.index]}"' for c in all_of[:40])
        apart = f" by up to {100 * min(shares[first.index], 9.99):.0f} % of their span" if len(rivals) == 1 else ""
        message = f"{len(all_of)} columns may be the {_said(quantity)}, and they differ{apart}: {listed}"
    return [Fault(message, sheet.text.path, line, first.index + 1, advice=advice)]


# --- what is left --------------------------------------------------------------------------------------------------------


def _drop_what_has_no_use(sheet: Sheet, chosen: dict[str, tuple[int, Heading]], unread: dict[int, str]) -> None:
    """Take out what only a capacitance gives a meaning: its losses, and the status of its meter."""
    meter = "capacitance" in chosen or "capacitance_series" in chosen
    if "dissipation" in chosen and "quality" in chosen:
        unread[chosen.pop("quality")[0]] = f'"{sheet.names[chosen["dissipation"][0]]}" is preferred'
    for quantity in ("dissipation", "quality"):
        if quantity in chosen and not meter and chosen[quantity][0] not in sheet.assigned:
            unread[chosen.pop(quantity)[0]] = "no capacitance stands beside it"
    if "status" in chosen and chosen["status"][0] not in sheet.assigned:
        index = chosen["status"][0]
        said = {c.strip().lower() for c in sheet.columns[index]} - {""}
        if not meter:
            unread[chosen.pop("status")[0]] = "the status of a tester"
        elif said and all(any(w in OF_TESTERS for w in s.split()) for s in said):
            unread[chosen.pop("status")[0]] = "the status of a tester, not of a meter"


def _rest(sheet: Sheet, chosen: Mapping[str, tuple[int, Heading]], unread: dict[int, str], faults: list[Fault]) -> list[str]:
    """Give every other column its reason, and note those whose unit says that they might have been meant."""
    notes: list[str] = []
    used = {index for index, _ in chosen.values()}
    taken = {heading.quantity: index for index, heading in chosen.values()}
    for index, name in enumerate(sheet.names):
        if index in used or index in unread:
            continue
        if not _first_cell(sheet, index):
            unread[index] = "empty"
        elif not name:
            unread[index] = "without a name"
        else:
            heading = sheet.plain_heading(index)
            reason = why_unread(name, sheet.unit_below(index))
            if heading.quantity in taken:
                reason = f'"{_shown(sheet, taken[heading.quantity])}" is taken'
            elif heading.quantity:
                reason = "not used"
            unread[index] = reason
            if reason == "not understood":
                notes += _same_unit(sheet, index, taken, unread, faults)
    return notes


def _same_unit(sheet: Sheet, index: int, taken: Mapping[str, int], unread: dict[int, str], faults: list[Fault]) -> list[str]:
    """The note on a column not understood with a unit of a quantity that is read; where that stands still, a choice."""
    unit = sheet.unit_written(index)
    for quantity in ("force", "displacement", "capacitance"):
        if not unit or not is_unit_of(unit, quantity) or not is_numeric(_first_cell(sheet, index)):
            continue
        unread[index] = f"not understood, though in {unit}"
        if quantity not in taken or taken[quantity] in sheet.assigned:
            return []
        own = taken[quantity]
        one, other = readings([sheet.columns[own], sheet.columns[index]], [1.0, 1.0], sheet.declared_decimal)
        if stands_still(one) and not stands_still(other):
            faults.append(
                Fault(
                    f'"{sheet.names[own]}" stands still, and "{sheet.names[index]}", which is not understood, moves',
                    sheet.text.path,
                    sheet.header_line or None,
                    index + 1,
                    advice=f'Say which one is the {quantity}: --columns "{quantity}={sheet.name_for_asking(index)}" or '
                    f'--columns "{quantity}={sheet.name_for_asking(own)}"',
                )
            )
        return [f'{quantity} is taken from "{sheet.names[own]}"; "{sheet.names[index]}", in {unit} too, is not understood']
    return []


def holds_clock(cells: Sequence[str]) -> bool:
    """Whether a column holds times of day, by its first fifty cells."""
    return any(map(is_clock, (c for c in cells[:50] if c.strip())))


def missing_columns(sheet: Sheet, family: InstrumentFamily, choice: ColumnChoice, reading: Reading) -> list[Fault]:
    """List the faults of quantities that are needed and not there, and of units given to columns that are not there.

    Parameters
    ----------
    sheet : the record.
    family : what it was recognised as.
    choice : its columns.
    reading : what the user says of the file.
    """
    found = frozenset(IN_PLACE_OF.get(q, q) for q in choice.chosen)
    there = ", ".join(
        f'"{n}"' + (f" ({choice.unread[i]})" if choice.unread.get(i, "not understood") != "not understood" else "")
        for i, n in enumerate(sheet.names)
        if n
    )
    faults = [
        Fault(
            f"no {quantity} column among {there}",
            sheet.text.path,
            sheet.header_line or None,
            advice=f"{quantity.capitalize()} is understood under the names {understood_names(quantity)} and others, "
            f'for example "{EXAMPLE[quantity]}"; or say which column it is, by its name or number: --columns {quantity}=...',
        )
        for quantity in family.requirement(found)
    ]
    faults += [
        Fault(
            f'there is no {quantity} column to give the unit "{unit}" to',
            sheet.text.path,
            sheet.header_line or None,
            advice=f"Say which column it is: --columns {quantity}=..., or leave the unit out",
        )
        for quantity, unit in reading.units.items()
        if IN_PLACE_OF.get(quantity, quantity) not in found
    ]
    return faults

"""From a `Sheet` in which blocks with a time each stand side by side to the one that is read, or what its user has to say."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from calib.errors import Choice, Fault, InputError
from calib.lab.instruments.header import split_line
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.meanings import PLAIN
from calib.lab.instruments.rivals import difference, readings
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.units import is_unit_of, lab_factor, stands_for
from calib.lab.instruments.vocabulary import words

#: What to do with a force and a displacement that were read at other times.
ONE_CLOCK = (
    "Export them with the same times (in LabVIEW: Align and Resample Express VI), or save one table of the times and readings "
    "of the force and, in a column beside them, the displacement interpolated to these times, all counted from one moment"
)
_MEASURED = ("displacement", "force", "capacitance")


@dataclass(frozen=True)
class ClockBlock:
    """Columns that were read at one time: its column, all of them, and those of a press among them with what they are.

    `sure` is whether nothing but a block explains where they stand: an empty column, or a time of the same name.
    """

    time: int
    columns: range
    measured: tuple[tuple[int, str], ...]
    sure: bool


def blocks_of_clocks(sheet: Sheet, columns: Sequence[Sequence[str]]) -> tuple[ClockBlock, ...]:
    """Find the blocks of columns that stand side by side with a time each, whose rows are not of one time; () if none do.

    A block ends at an empty column without a name, or where the next time begins one. Times that agree row by row are one
    clock, and so are times of several names that testers write beside each other.

    Parameters
    ----------
    sheet : its names, with or without rows.
    columns : cells, a sequence for each name.
    """
    plain = [sheet.plain_heading(i) for i in range(len(sheet.names))]
    times = [i for i, h in enumerate(plain) if h.quantity == "time" and not h.name_doubt]
    if len(times) < 2:
        return ()
    spans = parts(sheet, columns)
    sure = [sum(t in span for t in times) for span in spans] == [1] * len(times)
    if not sure:
        first = next((i for i, h in enumerate(plain) if h.quantity), 0)
        sure = len({words(sheet.names[t]) for t in times}) == 1
        if first != times[0] or not (sure or max(plain[t].rank for t in times) >= PLAIN):
            return ()
        ends = [*times[1:], len(sheet.names)]
        spans = [range(t, end) for t, end in zip(times, ends, strict=True)]
    blocks = []
    for time, span in zip(times, spans, strict=True):
        of_press = [(i, stands_for(plain[i].quantity)) for i in span]
        blocks.append(ClockBlock(time, span, tuple((i, q) for i, q in of_press if q in _MEASURED), sure))
    if not all(block.measured for block in blocks):
        return ()
    units = [sheet.unit_written(t) for t in times]
    factors = [lab_factor(unit, "time") if is_unit_of(unit, "time") else 1.0 for unit in units]
    values = readings([columns[t] for t in times], factors, sheet.declared_decimal)
    same = all(difference(values[0], other)[0] == "same" for other in values[1:])
    return () if same else tuple(blocks)


def parts(sheet: Sheet, columns: Sequence[Sequence[str]]) -> list[range]:
    """Runs of columns between those that are empty and have no name.

    Parameters
    ----------
    sheet : its names.
    columns : cells, a sequence for each name.
    """
    empty = [not name and not any(map(str.strip, columns[i])) for i, name in enumerate(sheet.names)]
    edges = [-1, *(i for i, is_empty in enumerate(empty) if is_empty), len(empty)]
    return [range(a + 1, b) for a, b in pairwise(edges) if b > a + 1]


def _is_enough(quantities: Collection[str]) -> bool:
    """Whether a record of these quantities is read: a capacitance, or a load over the displacement."""
    return "capacitance" in quantities or {"displacement", "force"} <= set(quantities)


def choice_of_clock(sheet: Sheet, blocks: Sequence[ClockBlock]) -> tuple[str, Choice | None]:
    """What to say where blocks have a time each, and none is said: each with the columns that are read with it.

    Where none of them alone is a record that is read, there is nothing to choose.

    Parameters
    ----------
    sheet : their names.
    blocks : found by `blocks_of_clocks`.
    """
    left_out = {stands_for(q) for i, q in sheet.assigned.items() if i < 0}
    blocks = [b for b in blocks if any(q not in left_out for _, q in b.measured)] or list(blocks)
    enough = [b for b in blocks if _is_enough({q for _, q in b.measured} - left_out)]
    if not enough and {"displacement", "force"} <= {q for b in blocks for _, q in b.measured}:
        return ONE_CLOCK, None
    blocks = enough or blocks
    choices = [Choice("columns", (str(b.time + 1),), "time") for b in blocks]
    named = [", ".join(f'"{sheet.names[i]}"' for i, q in b.measured if q not in left_out) for b in blocks]
    listed = ", ".join(f"{choice} to read {names}" for choice, names in zip(choices, named, strict=True))
    advice = f"Say which time is meant, and the columns that stand with it are read alone: {listed}"
    return advice, Choice("columns", tuple(str(b.time + 1) for b in blocks), "time")


def of_one_clock(sheet: Sheet, start: int, reading: Reading) -> Sheet:
    """Put aside the columns that stand with another time than the one that the user says, but for those named, too.

    Parameters
    ----------
    sheet : without rows.
    start : index of the first line below its header and units.
    reading : what the user says of the file.

    Raises
    ------
    InputError
        If the user names columns of several times, or leaves out all that stand with the one that is said, or the times.
    """
    said = next((i for i, q in sheet.assigned.items() if q == "time"), None)
    if said is None or sum(sheet.plain_heading(i).quantity == "time" for i in range(len(sheet.names))) < 2:
        return sheet
    blocks = blocks_of_clocks(sheet, tuple(_columns(sheet, start)))
    left_out = {stands_for(q) for i, q in sheet.assigned.items() if i < 0}
    own = next((b for b in blocks if b.time == said), None)
    if said < 0:
        _check_one_left(sheet, [b for b in blocks if any(q not in left_out for _, q in b.measured)])
    if own is None:
        return sheet
    shown = f'"{sheet.names[said]}" (column {said + 1})'
    apart = [i for i in sheet.assigned if i >= 0 and i not in own.columns and any(i in b.columns for b in blocks)]
    if apart and own.sure:
        other = next(b for b in blocks if apart[0] in b.columns)
        raise InputError(
            Fault(
                f'"{sheet.names[apart[0]]}" stands with the time in column {other.time + 1}, whose rows are of other '
                f"times than those of {shown}",
                sheet.text.path,
                sheet.named_at,
                apart[0] + 1,
                advice=f"Read the columns of one time at once. {choice_of_clock(sheet, blocks)[0]}",
            )
        )
    if not apart and all(q in left_out for _, q in own.measured):
        raise InputError(
            Fault(
                f"all that stands with {shown} is left out, and the other columns stand with other times",
                sheet.text.path,
                sheet.named_at,
                said + 1,
                advice=choice_of_clock(sheet, blocks)[0],
            )
        )
    aside = {
        i: f"it stands with the time in column {block.time + 1}, and that in column {said + 1} is asked for"
        for block in blocks
        for i in block.columns
        if block is not own and sheet.names[i] and i not in sheet.assigned
    }
    return replace(sheet, set_aside={**sheet.set_aside, **aside})


def _check_one_left(sheet: Sheet, blocks: Sequence[ClockBlock]) -> None:
    """Refuse to leave the time out where columns of several times are read: their rows are not of one time."""
    if len(blocks) > 1:
        raise InputError(
            Fault(
                f"columns {blocks[0].time + 1} and {blocks[1].time + 1} are times that differ: what stands with the one was "
                "not read when what stands with the other was, row by row",
                sheet.text.path,
                sheet.named_at,
                blocks[1].time + 1,
                advice=choice_of_clock(sheet, blocks)[0],
            )
        )


def _columns(sheet: Sheet, start: int) -> Iterator[list[str]]:
    rows = [split_line(line, sheet.delimiter) for line in sheet.text.lines[start:] if line.strip()]
    for i in range(len(sheet.names)):
        yield [row[i] if i < len(row) else "" for row in rows]

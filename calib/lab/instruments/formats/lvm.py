"""Files of LabVIEW's text format (.lvm): a file in, its segments as parts out, as their headers say they are to be read."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from itertools import pairwise
from pathlib import Path

from calib.errors import Fault, InputError
from calib.lab.instruments.numbers import parse_number
from calib.lab.instruments.part import Format, Part
from calib.lab.instruments.text import LabText, OfColumn, read_lab_text

_FIRST = "LabVIEW Measurement"
_END = "***End_of_Header***"
_SPECIAL = ("***Start_Special***", "***End_Special***")
# Lines of a file's header, and of a segment's, that are the format's own.
_OF_FILES = (
    "writer_version",
    "reader_version",
    "separator",
    "decimal_separator",
    "multi_headings",
    "x_columns",
    "time_pref",
    "date",
    "time",
)
_OF_SEGMENTS = (
    "channels",
    "samples",
    "date",
    "time",
    "y_unit_label",
    "y_dimension",
    "x_unit_label",
    "x_dimension",
    "x0",
    "delta_x",
    "test_number",
    "test_numbers",
    "test_series",
)
# What a line of a segment's header begins with: among rows, and where none are expected.
_TAG, _ANY_TAG = re.compile(r"[^\W\d]\w*"), re.compile(r"[^\W\d][\w .-]*")
# Absolute times are seconds since this.
_EPOCH = datetime(1904, 1, 1)


def recognise(head: bytes, _: Path) -> bool:
    """Recognise the first line, in any encoding."""
    return head.replace(b"\x00", b"").lstrip(b"\xef\xbb\xbf\xff\xfe").startswith(_FIRST.encode())


@dataclass(frozen=True)
class _File:
    """What the header of a file says: separator, decimal mark, how many columns of x there are, and whether x is absolute.

    `stated` is whether it says the decimal mark, which it does since version 2; the rows show it else. `remarks` are
    the indices of its other lines, which somebody filled in.
    """

    separator: str
    decimal: str
    stated: bool
    x_columns: str
    absolute: bool
    remarks: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class _Segment:
    """One segment: its tags with a value per channel, the index of the line with its names, these, and those of its rows.

    `others` are the lines of its header that are none of the format's own, by index.
    """

    tags: Mapping[str, Sequence[str]]
    line: int
    names: Sequence[str]
    rows: Sequence[int]
    others: Mapping[int, Sequence[str]]


@dataclass(frozen=True, eq=False)
class _Table:
    """A column of x and channels that share it: names, units, cells by index of the line, and how many samples are said.

    `remarks` are the other lines of the segment's header, and `said` what they say of one channel: line, column and words.
    """

    name: str
    names: Sequence[str]
    units: Sequence[str]
    line: int
    rows: Mapping[int, Sequence[str]]
    begun: datetime | None
    notes: tuple[str, ...] = ()
    samples: int = 0
    remarks: tuple[int, ...] = ()
    said: tuple[OfColumn, ...] = ()


def take_apart(path: Path) -> tuple[Part, ...]:
    """Read every segment; segments with the same channels whose times go on are one part.

    Raises
    ------
    InputError
        If the header is not one of the format, or contradicts the rows.
    """
    text = read_lab_text(path)
    file, start = _header(text)
    segments = _segments(text, file, start)
    if not segments:
        raise _fault(text, "the file has no segment: no line of names begins with X_Value", start)
    tables = [table for number, segment in enumerate(segments, 1) for table in _tables(text, file, segment, number)]
    tables = _joined(tables, file)
    if len(tables) == 1:
        tables = [replace(tables[0], name="1")]
    return tuple(_part(text, file, table) for table in tables)


def _header(text: LabText) -> tuple[_File, int]:
    """What the header of the file says, and the index of the line below it."""
    tags: dict[str, str] = {}
    remarks: list[int] = []
    for index, line in enumerate(text.lines[1:200], 1):
        if line.strip().strip(",;") == _END:
            return replace(_said(text, tags, index), remarks=tuple(remarks)), index + 1
        match = re.match(r"(\w+)[\t,](.*)", line)
        if match:
            tags[match[1].lower()] = match[2].strip()
        if (match is None or match[1].lower() not in _OF_FILES) and line.strip(" \t,;"):
            remarks.append(index)
    raise _fault(text, f"the header has no line {_END}", 0)


def _said(text: LabText, tags: Mapping[str, str], line: int) -> _File:
    separator = {"tab": "\t", "comma": ","}.get(tags.get("separator", "Tab").strip('"\t ,').lower())
    rows = "\n".join(text.lines[line + 1 : line + 200])
    shown = "," if separator == "\t" and re.search(r"\d,\d", rows) and not re.search(r"\t-?\d+\.\d", rows) else "."
    decimal = tags.get("decimal_separator", shown).strip('"\t ')[:1]
    x_columns = tags.get("x_columns", "One").strip("\t ,").lower()
    if separator is None or decimal not in (".", ",") or x_columns not in ("no", "one", "multi") or decimal == separator:
        said = f"Separator {tags.get('separator')}, Decimal_Separator {decimal!r}, X_Columns {x_columns}"
        raise _fault(text, f"the header cannot be obeyed: {said}", line)
    return _File(
        separator, decimal, "decimal_separator" in tags, x_columns, tags.get("time_pref", "").lower().startswith("abs")
    )


def _segments(text: LabText, file: _File, start: int) -> list[_Segment]:
    segments: list[_Segment] = []
    tags: dict[str, Sequence[str]] = {}
    others: dict[int, Sequence[str]] = {}
    rows: list[int] = []
    special = False
    inside = False  # the rows of a segment
    for index in range(start, len(text.lines)):
        line = text.lines[index]
        cells = [cell.strip() for cell in line.split(file.separator)]
        if cells[0] in _SPECIAL:
            special = cells[0] == _SPECIAL[0]
            continue
        if special or not any(cells):
            continue
        if cells[0] == "X_Value":
            rows = []
            segments.append(_Segment(tags, index, cells, rows, others))
            tags, others, inside = {}, {}, True
        elif (_TAG if inside else _ANY_TAG).fullmatch(cells[0]) and cells[0].lower() not in ("nan", "inf"):
            inside = False
            tags[cells[0].lower()] = cells[1:]
            if cells[0].lower() not in _OF_SEGMENTS and any(cells[1:]):
                others[index] = cells
        elif cells[0] == _END:
            inside = False
        elif inside:
            rows.append(index)
        else:
            raise _fault(text, f'"{line.strip()[:60]}" stands where a segment\'s header is expected', index)
    return segments


def _tables(text: LabText, file: _File, segment: _Segment, number: int) -> list[_Table]:
    """The channels of a segment with their x, once for each column of x that differs."""
    names = segment.names
    places = [i for i, name in enumerate(names) if name == "X_Value"]
    n_channel = len(names) - len(places) - (names[-1] == "Comment")
    said = segment.tags.get("channels", ("",))[0]
    if re.fullmatch(r"[0-9]{1,6}", said) and int(said) != n_channel:
        raise _fault(text, f"the segment's header says {said} channels, and {n_channel} are named", segment.line)
    if file.x_columns == "multi":
        pairs = [(2 * k, 2 * k + 1) for k in range(n_channel)]
    else:
        pairs = [(0, 1 + k) for k in range(n_channel)]
    if [i for i, _ in pairs if names[i : i + 1] != ["X_Value"]] or len(set(places)) != len({i for i, _ in pairs}):
        raise _fault(text, f"the names do not fit X_Columns {file.x_columns} and {n_channel} channels", segment.line)
    width = len(names)
    cells: dict[int, list[str]] = {}
    for index in segment.rows:
        row = [cell.strip() for cell in text.lines[index].split(file.separator)]
        if len(row) > width and any(row[width:]):
            raise _fault(text, f"the row has {len(row)} cells, the names are {width}", index)
        cells[index] = (row + [""] * width)[:width]
    notes: list[str] = []
    strides = _strides(segment, file, n_channel)
    if file.x_columns == "no":
        groups = _made(text, file, segment, cells, n_channel, notes)
    else:
        groups = []
        for k, (place, channel) in enumerate(pairs):
            _add(groups, _Group(tuple(row[place] for row in cells.values()), _begun(segment, strides, k), (channel,)), file)
    if any(_said_of(segment, "y_unit_label", strides, k) is None for k in range(n_channel)):
        notes.append("under which channels the units of the segment's header stand cannot be told: they are not taken")
    comment = [width - 1] if names[-1] == "Comment" else []
    tables = []
    for group in groups:
        members = group.members
        nth = [member // 2 if file.x_columns == "multi" else member - 1 for member in members]
        dimension = _said_of(segment, "x_dimension", strides, nth[0]) or "Time"
        own = [_said_of(segment, "y_unit_label", strides, k) or "" for k in nth]
        tables.append(
            _Table(
                f"{number}" if len(groups) == 1 else f"{number}: {names[members[0]]}",
                [dimension, *(names[member] for member in (*members, *comment))],
                ["s" if dimension == "Time" else "", *own, *("" for _ in comment)],
                segment.line,
                {i: [x, *(row[m] for m in (*members, *comment))] for x, (i, row) in zip(group.xs, cells.items(), strict=True)},
                group.begun,
                tuple(notes),
                max(int(said) if (said := _said_of(segment, "samples", strides, k) or "").isdecimal() else 0 for k in nth),
                tuple(segment.others),
                tuple(_said_of_channels(segment, strides, nth)),
            )
        )
    return tables


# Tags of a segment that have a value for each of its channels.
_OF_CHANNELS = ("samples", "date", "time", "y_unit_label", "x_dimension", "x0", "delta_x")


def _strides(segment: _Segment, file: _File, n_channel: int) -> list[int]:
    """How many fields apart the values of channels may stand in a segment's header, by those that are filled.

    With a column of x for each channel National Instruments writes them above the channels, two apart
    (`Y_Unit_Label\\tmm\\t\\tN`), other programs one behind the other.
    """
    filled = {i for tag in _OF_CHANNELS for i, value in enumerate(segment.tags.get(tag, ())) if value}
    allowed = (1, 2) if file.x_columns == "multi" and n_channel > 1 else (1,)
    return [n for n in allowed if all(i % n == 0 and i < n * n_channel for i in filled)]


def _said_of(segment: _Segment, tag: str, strides: Sequence[int], channel: int) -> str | None:
    """What a tag says of a channel from 0, "" if nothing; None if that cannot be told, as it stands in different places."""
    values = segment.tags.get(tag, ())
    said = {values[n * channel] if n * channel < len(values) else "" for n in strides}
    return said.pop() if len(said) == 1 else None if any(values) else ""


def _said_of_channels(segment: _Segment, strides: Sequence[int], channels: Sequence[int]) -> Iterator[OfColumn]:
    """What the other lines of a segment's header say of its channels, where they have a value for several of them."""
    for index, (tag, *values) in segment.others.items():
        if any(values[1:]) and len(strides) == 1:  # one in the first place may be of them all
            for column, channel in enumerate(channels, 1):
                value = values[strides[0] * channel] if strides[0] * channel < len(values) else ""
                if value:
                    yield index + 1, column, f"{tag.replace('_', ' ')}\t{value}"


@dataclass(frozen=True, eq=False)
class _Group:
    """Channels, by their columns, that share a column of x and the moment from which it counts."""

    xs: tuple[str, ...]
    begun: datetime | None
    members: tuple[int, ...]


def _add(groups: list[_Group], own: _Group, file: _File) -> None:
    """Add a channel to those with its x, or by itself. One with fewer readings ends earlier, and so does its x."""
    for at, group in enumerate(groups):
        same = all(a == b or not a or not b for a, b in zip(group.xs, own.xs, strict=True))
        if same and _begin_together(group, own, file):
            longest = tuple(a or b for a, b in zip(group.xs, own.xs, strict=True))
            groups[at] = _Group(longest, group.begun, (*group.members, *own.members))
            return
    groups.append(own)


# Times beyond this [s] are absolute; below they are counted from the segment's date and time, or from midnight.
_ABSOLUTE = 1e9
# What the beginnings of channels may differ by, as a share of a step of x.
_TOGETHER = 0.1


def _begin_together(a: _Group, b: _Group, file: _File) -> bool:
    """Whether x counts from the same moment for both."""
    numbers = [x for cell in a.xs[:2] if (x := parse_number(cell, file.decimal)) is not None]
    if a.begun is None or b.begun is None or a.begun == b.begun or (numbers and numbers[0] > _ABSOLUTE):
        return True
    step = numbers[1] - numbers[0] if len(numbers) > 1 else 0.0
    return abs((a.begun - b.begun).total_seconds()) <= _TOGETHER * step


def _made(
    text: LabText, file: _File, segment: _Segment, cells: Mapping[int, Sequence[str]], n_channel: int, notes: list[str]
) -> list[_Group]:
    """Make x of its beginning and step, where the rows have none: for each that differs, its channels."""
    groups: dict[tuple[float, float], list[int]] = {}
    for k in range(n_channel):
        first, step = (parse_number(_said_of(segment, tag, (1,), k) or "", file.decimal) for tag in ("x0", "delta_x"))
        if first is None or step is None or step <= 0:
            raise _fault(text, f'channel "{segment.names[k + 1]}" has no X0 or no Delta_X, and the rows no time', segment.line)
        groups.setdefault((first, step), []).append(k + 1)
    if any(row[0] for row in cells.values()):
        raise _fault(text, "X_Columns is No, but the first column is not empty", segment.line)
    for first, step in groups:
        notes.append(f"time is made from X0 {first!r} and Delta_X {step!r}")
    n_row = len(cells)
    begun = _begun(segment, (1,), 0)
    return [
        _Group(tuple(repr(first + step * i).replace(".", file.decimal) for i in range(n_row)), begun, tuple(members))
        for (first, step), members in groups.items()
    ]


def _begun(segment: _Segment, strides: Sequence[int], channel: int) -> datetime | None:
    """Date and time from which x counts for a channel."""
    date, clock = (_said_of(segment, tag, strides, channel) or "" for tag in ("date", "time"))
    day = re.fullmatch(r"(\d{4})\D(\d{1,2})\D(\d{1,2})", date)
    hour = re.fullmatch(r"(\d{1,2}):(\d{2}):(\d{2})(?:[.,](\d+))?", clock)
    if day is None or hour is None:
        return None
    try:
        begun = datetime(int(day[1]), int(day[2]), int(day[3]), int(hour[1]), int(hour[2]), int(hour[3]))
    except ValueError:
        return None
    return begun + timedelta(seconds=float(f"0.{hour[4] or 0}"))


def _joined(tables: Sequence[_Table], file: _File) -> list[_Table]:
    """Segments with the same channels made one where their times go on, by themselves or by the segments' dates."""
    alike = len({(tuple(table.names), tuple(table.units)) for table in tables}) == 1
    filled = [table for table in tables if table.rows]
    if not alike or len(filled) < 2:
        return list(filled or tables)
    samples = sum(table.samples for table in filled)
    ends = [_ends(table, file) for table in filled]
    if any(end is None for end in ends):
        return filled
    spans = [end for end in ends if end is not None]
    own = [first - spans[0][0] for first, _ in spans]
    dated = [
        None if t.begun is None or filled[0].begun is None else (t.begun - filled[0].begun).total_seconds() for t in filled
    ]
    steps = [(last - first) / max(len(table.rows) - 1, 1) for table, (first, last) in zip(filled, spans, strict=True)]
    goes_on = all(b[0] > a[1] for a, b in pairwise(spans))
    agrees = all(d is None or d == 0 or abs(d - o) <= max(1.0, 0.01 * abs(o)) for d, o in zip(dated, own, strict=True))
    if goes_on and (agrees or file.absolute):
        rows = {i: row for table in filled for i, row in table.rows.items()}
        notes = (*filled[0].notes, f"{len(filled)} segments, whose times go on")
        return [replace(filled[0], rows=rows, notes=notes, samples=samples)]
    shifts = [d for d in dated if d is not None]
    apart = len(shifts) == len(filled) and all(
        shifts[k + 1] + spans[k + 1][0] >= shifts[k] + spans[k][1] + 0.5 * steps[k] for k in range(len(filled) - 1)
    )
    if goes_on or not apart or file.absolute:
        return filled
    rows = {}
    for table, shift in zip(filled, shifts, strict=True):
        for i, row in table.rows.items():
            x = parse_number(row[0], file.decimal)
            rows[i] = [row[0] if x is None else repr(x + shift).replace(".", file.decimal), *row[1:]]
    note = f"{len(filled)} segments, each counting its time anew: put one behind the other by their dates and times"
    return [replace(filled[0], rows=rows, notes=(*filled[0].notes, note), samples=samples)]


def _ends(table: _Table, file: _File) -> tuple[float, float] | None:
    xs = [parse_number(row[0], file.decimal) for row in table.rows.values()]
    if xs[0] is None or xs[-1] is None or table.names[0] != "Time":
        return None
    return xs[0], xs[-1]


def _part(text: LabText, file: _File, table: _Table) -> Part:
    """The table with every row in its own line, names and units above it in the lines of the segment's header."""
    if not table.rows:
        return Part("segment", table.name, None, "it has no rows")
    notes = list(table.notes)
    special = [i + 1 for i, line in enumerate(text.lines[: table.line]) if line.startswith(_SPECIAL[0])]
    notes += [f"{len(special)} special block(s) of a program are passed by, the first in line {special[0]}"] if special else []
    lines = ["" for _ in text.lines]
    begun = table.begun
    rows = dict(table.rows)
    if file.absolute and table.names[0] == "Time":
        numbers = {i: parse_number(row[0], file.decimal) for i, row in rows.items()}
        first = next((x for x in numbers.values() if x is not None), None)
        if first is not None and _ABSOLUTE < first < 2e10:
            begun = _EPOCH + timedelta(seconds=round(first, 3))
            for i, x in numbers.items():
                if x is not None:
                    rows[i] = [repr(round(x - first, 6)).replace(".", file.decimal), *rows[i][1:]]
            notes.append(f"time is absolute, counted from {begun} UTC on")
    for i in (*file.remarks, *table.remarks):
        lines[i] = "\t".join(cell.strip() for cell in text.lines[i].split(file.separator)).replace('"', "'").rstrip()
    said_in = next((i for i in range(table.line, 0, -1) if text.lines[i].lower().startswith("samples")), 0)
    if said_in and table.samples > len(rows):
        lines[said_in] = f"Samples\t{table.samples}"
    if begun is not None and table.line >= 3:
        lines[table.line - 2] = f"Date\t{begun.isoformat(sep=' ')}"
    lines[table.line - 1] = "\t".join(map(_quoted, table.names))
    lines[table.line] = "\t".join(table.units)
    for i, row in rows.items():
        lines[i] = "\t".join(map(_quoted, row))
    ended = text.ended or max(rows) < len(text.lines) - 1
    decimal = file.decimal if file.stated else ""
    own = replace(text, lines=tuple(lines), ended=ended, decimal=decimal, units_line=table.line + 1, of_columns=table.said)
    return Part("segment", table.name, own, notes=tuple(notes))


def _quoted(cell: str) -> str:
    cell = cell.replace("\t", " ")
    return '"' + cell.replace('"', '""') + '"' if '"' in cell else cell


def _fault(text: LabText, message: str, line: int) -> InputError:
    advice = "Write the file anew, or export a CSV file"
    return InputError(Fault(message, text.path, line + 1, advice=advice))


FORMAT = Format("LabVIEW (.lvm)", recognise, take_apart)

"""Files of LabVIEW's binary format (.tdms): a file in, its groups of channels as parts out."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from calib.lab.instruments.arrays import ArrayColumn, Source, array_part, is_column
from calib.lab.instruments.part import EXPORT_ALIKE, Format, Part, damaged, not_installed
from calib.lab.instruments.said_inside import Saying, sayings, unit_in
from calib.lab.instruments.vocabulary import understand

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsGroup

# Date and time at which a waveform began, as the file has it, offset and step.
_Wave = tuple[Any, float, float]


@dataclass(frozen=True)
class _Base:
    """What channels of one table have in common: waveform (None if the times are a channel, or unknown) and length."""

    wave: _Wave | None
    length: int


def recognise(head: bytes, _: Path) -> bool:
    """Recognise the mark at the beginning of a segment."""
    return head.startswith(b"TDSm")


def take_apart(path: Path) -> tuple[Part, ...]:
    """Read the channels of each group, with their units; a waveform's time is made from its offset and step.

    Channels of one group that have not the same times and lengths are several parts.

    Raises
    ------
    InputError
        If npTDMS is not installed, or the file is damaged.
    """
    try:
        from nptdms import TdmsFile
    except ImportError:
        raise not_installed(path, "files of LabVIEW (.tdms) are read with npTDMS") from None
    with damaged(path, "TDMS file"):
        data = path.read_bytes()
        sha256 = hashlib.sha256(data).hexdigest()
        file = TdmsFile.read(io.BytesIO(data))
        closed = not file.file_status.incomplete_final_segment
        above = list(sayings(file.properties))
        # A group without channels holds settings of the others.
        above += [said for group in file.groups() if not group.channels() for said in sayings(group.properties, (group.name,))]
        parts: list[Part] = []
        for group in file.groups():
            source = Source(path, sha256, "tdms", "group", group.name)
            parts += _parts(group, source, above, closed=closed)
    return tuple(parts)


def _parts(group: TdmsGroup, source: Source, above: Sequence[Saying], *, closed: bool) -> list[Part]:
    channels = group.channels()
    if not channels:
        return [Part(source.kind, source.name, None, "it has no channels")]
    headings = [(channel.name, understand(channel.name, unit_in(channel.properties)[0])) for channel in channels]
    own_time = [name for name, heading in headings if heading is not None and heading.quantity == "time"]
    tables: dict[_Base, list[TdmsChannel]] = {}
    for channel in channels:
        wave = None if own_time else _wave(channel)
        # Where the file was not closed, channels end at different readings of the same row.
        tables.setdefault(_Base(wave, len(channel) if closed else 0), []).append(channel)
    parts = []
    lengths = {base.length for base, members in tables.items() if any(m.name in own_time for m in members)}
    for base, members in tables.items():
        if own_time and base.length not in lengths and all(len(channel) for channel in members):
            its_times = f'"{own_time[0]}" has {min(lengths)}'
            reason = f"{base.length} readings, and {its_times}: which of them belong together is not told; {EXPORT_ALIKE}"
            parts += [Part("channel", f"{source.name}: {channel.name}", None, reason) for channel in members]
            continue
        said = [] if closed else ["the file was not closed: readings after its last whole row are missing"]
        lines = [*above, *sayings(group.properties)]
        columns = []
        for channel in members:
            values = channel[:]
            if len(values) == 0 or not is_column(values):
                parts.append(Part("channel", f"{source.name}: {channel.name}", None, "it holds no column of numbers"))
                continue
            unit, differing, rest = unit_in(channel.properties)
            columns.append(ArrayColumn(channel.name, unit, values, tuple(sayings(rest)), differing))
        if not columns:
            continue
        length = min(len(column.values) for column in columns)
        columns = [replace(column, values=column.values[:length]) for column in columns]
        if base.wave is not None:
            time, begun, note = _time(members[0], base.wave, length)
            columns, lines, said = [time, *columns], [*lines, *begun], [*said, note]
        elif own_time and any("wf_increment" in channel.properties for channel in members):
            said.append(f'time is the channel "{own_time[0]}", not the steps of the waveforms')
        name = source.name if len(tables) == 1 else f"{source.name}: {members[0].name}"
        parts.append(array_part(replace(source, name=name), columns, above=lines, notes=said))
    return parts


def _wave(channel: TdmsChannel) -> _Wave | None:
    """When a waveform began, its offset and its step; None if the channel is none."""
    step = channel.properties.get("wf_increment")
    if not isinstance(step, int | float) or not np.isfinite(step) or step <= 0:
        return None
    return channel.properties.get("wf_start_time"), float(channel.properties.get("wf_start_offset", 0.0)), float(step)


def _time(channel: TdmsChannel, wave: _Wave, length: int) -> tuple[ArrayColumn, list[Saying], str]:
    """The column of times of a waveform, what says when it began, and the note on both."""
    begun, offset, step = wave
    name = str(channel.properties.get("wf_xname") or "Time")
    unit = str(channel.properties.get("wf_xunit_string") or ("s" if name == "Time" else ""))
    lines = [] if begun is None else [Saying(("wf_start_time",), f"{str(np.datetime64(begun, 'ms')).replace('T', ' ')} UTC")]
    note = f"time is made from the waveform: {step!r} {unit} from reading to reading, from {offset!r} {unit} on"
    return ArrayColumn(name, unit, offset + step * np.arange(length)), lines, note


FORMAT = Format("LabVIEW (.tdms)", recognise, take_apart)

"""From times with a last part behind the seconds, "10:00:00:24", to decimals: hundredths, milliseconds, frames of a camera."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib.errors import Choice, Fault, InputError
from calib.lab.instruments.clock import WITHOUT, read_clock
from calib.lab.instruments.clock_form import FRAMES
from calib.lab.instruments.labtable import IntArray
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.ticks import Tick, stated_tick
from models.sensor import FloatArray

# A date, minutes and seconds with hours before them or without, and the part behind: of a colon; a semicolon, as of frames some
# of whose numbers are left out; or a point, behind which decimals are usual.
_TIMES = re.compile(r"(?P<date>.*[ T])?(?P<time>\d{1,3}(?::[0-5]\d){1,2})(?P<mark>[:;.])(?P<part>\d{1,3})", re.ASCII)
_LONGEST = 60
# Rows that tell something, those that are looked at first, and what a user may say -> how many digits the last part has.
_FEWEST, _SEEN, _WIDTHS = 9, 1000, {"h:min:s:cs": 2, "h:min:s:ms": 3}
# Seconds over which the steps show what the last part is, and the largest of them: from a minute to the next seconds go on so.
_SEVERAL, _WITHIN = 2.5, 0.6
# A count of frames is shown by so many full seconds, by steps of this share of them at most, nearly all of them the same.
_FULL, _STEP, _SAME, _ALIKE = 3, 0.25, 0.9, 0.8
# What else a last part may count, in a second or of a minute; frames a second that are broadcast as a thousandth fewer.
_NO_FRAMES, _BROADCAST = (10, 60, 100, 1000), (24, 30, 48, 60, 120)
# Numbers of frames left out at the beginning of a minute, but of every tenth, of 30 a second.
_DROPPED = 2
# So many numbers below 60 that differ are none of hundredths or milliseconds: these go beyond.
_SIXTY, _DIFFERENT = 60, 5


@dataclass(frozen=True, eq=False)
class _Times:
    """Times of a column taken apart: whole seconds, last parts as numbers and as written, and where they stand."""

    seconds: FloatArray
    parts: IntArray
    written: list[str]
    wholes: list[str]
    mark: str
    hours: bool


def with_last_parts(sheet: Sheet, index: int, said: str) -> tuple[list[str], str] | None:
    """Times whose last part counts hundredths, milliseconds or frames, with decimals, and the note on them; None if none are.

    Hundredths and frames are shown by times that go on evenly so over several seconds, milliseconds that are not filled up by
    times that never fall so, and else would; frames by a line with their rate, too. What the user says is obeyed, unless the
    cells show another.

    Parameters
    ----------
    sheet, index : the record, and which of its columns.
    said : the unit of time that the user says, "" if nobody does.

    Raises
    ------
    InputError
        If the cells may be two of these, or contradict what is said.
    """
    frames = FRAMES.fullmatch(said.strip().lower()) if said else None
    seen = [c.strip() for c in sheet.columns[index][:_SEEN] if c.strip()]
    first = seen[0] if seen else ""
    begins = _TIMES.fullmatch(first) if len(first) <= _LONGEST else None
    if begins is None:
        return None
    colons = begins["time"].count(":") == 2 and begins["mark"] == ":"
    if not (colons or said or begins["mark"] == ";"):
        # Usual times, of which few rows tell.
        sample = _taken_apart(seen, begins["mark"])
        if sample is None or not _frames_shown(sample):
            return None
    cells = [c.strip() for c in sheet.columns[index]]
    times = _taken_apart(cells, begins["mark"])
    if times is None:
        return None
    tick = stated_tick(sheet.lines_around)

    def refused(message: str, advice: str) -> InputError:
        message = f'"{first}" in column "{sheet.names[index]}": {message}'
        return InputError(Fault(message, sheet.text.path, int(sheet.lines[0]), index + 1, advice=advice))

    shown = _frames_shown(times)
    form = "h:min:s" if times.hours else "min:s"
    stated = _rate_stated(times, tick)
    if frames is not None:
        rate = float(frames["rate"]) if frames["rate"] else stated or float(shown)
        if not rate:
            raise refused(
                "how many frames there are in a second is not told",
                f"Say it: {_as_option(form, 25)} if there are 25, {WITHOUT}",
            )
        if int(times.parts.max()) >= round(rate):
            raise refused(
                f"the last part reaches {times.parts.max()}, which no frame of {rate:g} in a second does",
                f"Say how many there are: {_as_option(form, shown or int(times.parts.max()) + 1)} if so many, {WITHOUT}",
            )
        off = f", though the times go on evenly if there are {shown}" if shown and shown != round(rate) else ""
        return _of_frames(sheet, index, cells, times, rate, f"as asked{off}")
    meant = {"h:min:s:cs": 100, "min:s:cs": 100, "h:min:s:ms": 1000, "d:h:min:s": 60, "h:min:s": 60}.get(said)
    decimals, likely = times.mark == ".", shown or max(25, int(times.parts.max()) + 1)
    if meant is not None and not decimals and (shown or (meant > _SIXTY and _is_below_sixty(times))):
        what = {60: "seconds", 100: "hundredths", 1000: "milliseconds"}[meant]
        why = f"go on evenly if there are {shown} in a second" if shown else "are many that differ"
        more = f", {_as_option(form, meant)} if they are {what} all the same" if meant > _SIXTY else ""
        raise refused(
            f"the last parts never pass {times.parts.max()} and {why}: they are no {what}",
            f"Say what they are: {_as_option(form, likely)} if frames, {likely} of which are a second{more}, {WITHOUT}",
        )
    if said:
        width = _WIDTHS.get(said, 0) if len(max(times.written, key=len)) <= _WIDTHS.get(said, 0) else 0
        return _with_decimals(sheet, index, cells, times, width) if width and colons else None
    width = _width_shown(sheet, index, cells, times, stated) if colons else 0
    if width:
        return _with_decimals(sheet, index, cells, times, width)
    if decimals and shown:
        raise refused(
            f"what stands behind the point never passes {times.parts.max()} and goes on evenly if {shown} are a second: they "
            "may be frames, or decimals with pauses",
            f"Say what it is: {_as_option(form, shown)} if frames, --units time={form} if decimals, {WITHOUT}",
        )
    if stated and colons and round(stated) == _SIXTY and np.any(times.parts > 0):
        raise refused(
            "the last part may be frames, or seconds behind days, hours and minutes",
            f"Say what it is: {_as_option(form, stated)} if frames, --units time=d:h:min:s if seconds, {WITHOUT}",
        )
    if shown or (stated and times.mark != "." and (colons or times.mark == ";")):
        other = bool(stated and shown and round(stated) != shown)
        rate = stated if stated and not other else float(shown)
        if times.mark == ";" and not stated and shown in _BROADCAST:
            rate = shown / 1.001
        why = "the times go on evenly so" if shown else "they never reach that"
        if tick is not None and stated:
            why = f'{why}{", though" if other else ", and"} line {tick.line} says "{tick.shown}"'
        return _of_frames(sheet, index, cells, times, rate, f"as {why}")
    if times.mark == ";":
        raise refused(
            "the last part, behind a semicolon, seems to be frames, and how many are a second is not told",
            f"Say it: {_as_option(form, 29.97)} if there are 29.97, {WITHOUT}",
        )
    return None


def _as_option(form: str, rate: float) -> str:
    return str(Choice("units", (f"{form}:frame/{rate:.6g}",), "time"))


def _taken_apart(cells: Sequence[str], mark: str) -> _Times | None:
    """Times with a last part behind one mark; None if a cell is none, or too few are."""
    matches = []
    for cell in cells:
        match = _TIMES.fullmatch(cell) if len(cell) <= _LONGEST else None
        if cell and (match is None or match["mark"] != mark):
            return None
        if match is not None:
            matches.append(match)
    colons = {match["time"].count(":") for match in matches}
    if len(matches) < _FEWEST or len(colons) != 1:
        return None
    hours = colons == {2}
    weights = (3600.0, 60.0, 1.0) if hours else (60.0, 1.0)
    parts = np.array([match["time"].split(":") for match in matches], dtype=np.float64)
    wholes = [f"{match['date'] or ''}{match['time']}" for match in matches]
    written = [match["part"] for match in matches]
    return _Times(parts @ np.array(weights), np.array(written, dtype=np.int64), written, wholes, mark, hours)


def _frames_shown(times: _Times) -> int:
    """How many of the last part are a second, by steps that are even where a second is full; 0 where none show it."""
    seconds, steps = np.diff(times.seconds), np.diff(times.parts)
    within, full = seconds == 0, (seconds == 1) & (steps < 0)
    if np.count_nonzero(full) < _FULL or not np.any(within) or np.any(steps[within] < 1):
        return 0
    if times.mark == "." and len({*map(len, times.written)}) > 1:
        return 0
    step = int(np.median(steps[within]))
    numbers, counts = np.unique(step - steps[full], return_counts=True)
    found = int(numbers[np.argmax(counts)])
    alike = counts.max() >= _ALIKE * counts.sum() and np.mean(steps[within] == step) >= _SAME
    fits = int(times.parts.max()) < found and step <= _STEP * found
    return found if alike and fits and found not in _NO_FRAMES else 0


def _rate_stated(times: _Times, tick: Tick | None) -> float:
    """The frames in a second that a line says, where the last parts may be of these; 0 if none, or if they may not."""
    if tick is None or not 0 < round(1 / tick.seconds) < _NO_FRAMES[-1]:
        return 0.0
    rate = 1 / tick.seconds
    full = np.count_nonzero((np.diff(times.seconds) > 0) & (np.diff(times.parts) < 0))
    many = np.unique(times.parts).size >= min(_DIFFERENT, rate)
    return rate if int(times.parts.max()) < round(rate) and full >= 2 and many else 0.0


def _is_below_sixty(times: _Times) -> bool:
    return (
        int(times.parts.max()) < _SIXTY and np.unique(times.parts).size >= _DIFFERENT and bool(np.any(np.diff(times.seconds)))
    )


def _of_frames(sheet: Sheet, index: int, cells: Sequence[str], times: _Times, rate: float, why: str) -> tuple[list[str], str]:
    """Times that end in frames with decimals, counted from the first, and the note on them."""
    nominal = round(rate)
    minutes = np.floor(times.seconds / 60)
    dropping = times.mark == ";" or _leaves_out(times, minutes, nominal)
    dropped = _DROPPED * (nominal // 30) * (minutes - np.floor(minutes / 10)) if dropping and nominal % 30 == 0 else 0.0
    frames = times.seconds * nominal + times.parts - dropped
    # Over midnight, and where an hour is full that is not written, they begin anew.
    period = 86400.0 if times.hours else 3600.0
    begun = np.cumsum(np.concatenate(([0.0], np.diff(times.seconds) < -period / 2)))
    since = (frames - frames[0]) / rate + period * begun
    total = times.seconds[0] + times.parts[0] / nominal + since
    dated = any(" " in whole or "T" in whole for whole in times.wholes)
    if dated:
        # The date is that of the whole seconds.
        found = [f"{whole}{f'{part / rate:.6f}'[1:]}" for whole, part in zip(times.wholes, times.parts.tolist(), strict=True)]
    else:
        found = [_clock_of(second) for second in total.tolist()]
    rest = iter(found)
    at = int(np.argmax(times.parts > 0))
    example = f'"{times.wholes[at]}{times.mark}{times.written[at]}" is read as {found[at]}'
    left = f", of which {_DROPPED * (nominal // 30)} numbers are left out at full minutes" if np.any(dropped) else ""
    note = f'"{sheet.names[index]}": the last part of the times counts frames, {rate:.5g} a second{left}, {why}: {example}'
    return [next(rest) if c else "" for c in cells], note


def _leaves_out(times: _Times, minutes: FloatArray, nominal: int) -> bool:
    """Whether minutes begin with the number of a later frame, right behind the last one of the minute before."""
    turns = np.flatnonzero((np.diff(minutes) == 1) & (minutes[1:] % 10 != 0)) + 1
    behind = times.parts[turns] == _DROPPED * (nominal // 30)
    return bool(np.any(behind & (times.parts[turns - 1] == nominal - 1)))


def _clock_of(seconds: float) -> str:
    minutes, micros = divmod(round((seconds % 86400.0) * 1e6), 60_000_000)
    return f"{minutes // 60:02d}:{minutes % 60:02d}:{micros // 1_000_000:02d}.{micros % 1_000_000:06d}"


def _pointed(cells: Sequence[str], times: _Times, width: int) -> list[str]:
    filled = iter([f"{whole}.{part:0>{width}}" for whole, part in zip(times.wholes, times.written, strict=True)])
    return [next(filled) if c else "" for c in cells]


def _width_shown(sheet: Sheet, index: int, cells: Sequence[str], times: _Times, stated: float) -> int:
    """The digits of a last part that is shown to be hundredths or milliseconds; 0 where it is not.

    Raises
    ------
    InputError
        If the last parts have different numbers of digits, and it is not shown what they are.
    """
    lengths = {*map(len, times.written)}
    longest = max(lengths)
    if lengths == {3}:
        return 0
    seconds = {n: read_clock(_pointed(cells, times, n)).seconds for n in (2, 3) if longest <= n}
    even = {n for n, s in seconds.items() if _is_steady(s)}
    counted = len(lengths) > 1 and not any(len(p) > 1 and p[0] == "0" for p in times.written)
    as_decimals = read_clock(_pointed(cells, times, 0)).seconds
    proven = counted and longest == 3 and np.any(np.diff(as_decimals) < 0) and not np.any(np.diff(seconds[3]) < 0)
    width = 3 if proven else min(even, default=0) if longest < 3 or counted else 0
    if not width and len(lengths) > 1 and not (stated or _frames_shown(times)):
        first = next(c for c in cells if c)
        message = f'"{first}" in column "{sheet.names[index]}": the last part of the times may be of a second, or none'
        advice = (
            "Say what it is: --units time=h:min:s:ms if milliseconds, --units time=h:min:s:cs if hundredths, "
            f"{_as_option('h:min:s', 25)} if frames, 25 of which are a second, {WITHOUT}"
        )
        raise InputError(Fault(message, sheet.text.path, int(sheet.lines[0]), index + 1, advice=advice))
    return width


def _with_decimals(sheet: Sheet, index: int, cells: Sequence[str], times: _Times, width: int) -> tuple[list[str], str]:
    found = _pointed(cells, times, width)
    what = {2: "hundredths", 3: "milliseconds"}[width]
    at = next((k for k, p in enumerate(cells) if p and len(p.rsplit(":", 1)[1]) > 1), 0)
    return found, f'"{sheet.names[index]}": the last part of the times counts {what}: "{cells[at]}" is read as {found[at]}'


def _is_steady(seconds: FloatArray) -> bool:
    """Whether times go on in the same steps of parts of a second, but for their last digit, over several seconds."""
    there = seconds[np.isfinite(seconds)]
    steps = np.diff(there)
    return bool(np.min(steps) > 0 and np.max(steps) < min(_WITHIN, np.min(steps) * 1.1 + 0.02) and np.ptp(there) > _SEVERAL)

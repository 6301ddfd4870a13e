"""From lines that name channels elsewhere than in the header, by number or above their addresses, to lines with a header."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from itertools import pairwise

from calib.lab.instruments.vocabulary import understand

# TA Instruments writes "Sig1<tab>Time (min)", ... and the rows behind a line "StartOfData".
_SIGNAL = re.compile(r"sig(?P<number>\d{1,2})[\t,;]\s*(?P<name>\S.*?)\s*", re.IGNORECASE)
_START = "startofdata"
_ABOVE = 400
# Characters of a line that names a channel.
_LONGEST_KEY = 200
# Hioki writes what the user called a channel above its address: "Comment","Force", below it "Time","U1-1[N]".
_COMMENT, _TIME = re.compile(r'"?comments?"?[,;\t]', re.IGNORECASE), re.compile(r"time\b.*", re.IGNORECASE)
# Graphtec lists what the user called the channels, `"CH1","Disp"`, above a header with their addresses, `Number,ms,CH1,CH2`.
_CHANNEL = r"(?:CH|Chan|Channel|Kanal|Canal|Canale|Voie)\.?[ _-]?\d{1,3}"
_LISTED = re.compile(_CHANNEL, re.IGNORECASE)
# A key to the channels, one a line, in comments or without: "# CH3 = Force [N]", "Channel 3: Force (N)".
_KEY = re.compile(rf"[\s#%/;!\"]*(?P<channel>{_CHANNEL})\s*[=:]\s*(?P<name>[^\W\d].*?)[\s,;\"]*", re.IGNORECASE)
# A list of what the channels X and Y of a press monitor are, `Kanal X;Weg`, and their names in the header, "X [mm]".
_AXIS_KEY = re.compile(
    r"[\s#%/!\"]*(?:CH|Chan|Channel|Kanal|Canal|Canale|Voie|Axis|Achse|Axe|Asse|Eje)\.?[ _-]?(?P<axis>[XYZ])\"?\s*[=:,;\t]\s*"
    r"\"?(?P<name>[^\W\d][^,;\t\"]*)[\s,;\"]*",
    re.IGNORECASE,
)
_AXIS = re.compile(r"(?P<axis>[XYZ])\s*(?P<unit>[(\[][^()\[\]]+[)\]])?", re.IGNORECASE)
# Igor writes "WAVES/D<tab>time, force" between "IGOR" and "BEGIN".
_WAVES = re.compile(r"\s*WAVES(?:/[A-Z]+)*[\t ]+(?P<names>[^,\"]+(?:,[^,\"]+)+)", re.IGNORECASE)
# Weka lists the columns of an ARFF file, `@attribute 'Force (N)' numeric`, above the line "@data".
_ATTRIBUTE = re.compile(
    r"\s*@attribute\s+(?:(?P<mark>['\"])(?P<quoted>[^'\"]+)(?P=mark)|(?P<name>[^\s'\"]+))\s+[\w{].*", re.IGNORECASE
)
# What stands for the readings below a title, and between what was measured and over what it is drawn.
_OF_PAIR, _OVER = (
    ("y", "value", "values", "amplitude", "wert", "messwert"),
    re.compile(r"\s+(?:vs\.?|versus|over)\s+", re.IGNORECASE),
)
_ADDRESS = re.compile(r"(?:CH|[A-Z]{0,2})\d{1,3}(?:[-_][A-Z]{0,2}\d{1,3})?\s*(?P<unit>\[[^\[\]]+\]|\([^()]+\))?", re.IGNORECASE)


def with_signals_named(lines: Sequence[str]) -> list[str]:
    """The lines with the names of the signals where the data start; [] if the signals are not listed one by one, from 1 on.

    Parameters
    ----------
    lines : of a text file.

    >>> with_signals_named(["Sig1\\tTime (min)", "Sig2\\tStatic Force (N)", "Date\\t14-Mar", "StartOfData", "0.0\\t0.01"])[3:]
    ['Time (min)\\tStatic Force (N)', '0.0\\t0.01']
    """
    start = next((i for i, line in enumerate(lines[:_ABOVE]) if line.strip().lower() == _START), -1)
    found = [match for line in lines[: max(start, 0)] if (match := _SIGNAL.fullmatch(line)) is not None]
    if len(found) < 2 or [int(match["number"]) for match in found] != list(range(1, len(found) + 1)):
        return []
    row = next((line for line in lines[start + 1 :] if line.strip()), "")
    mark = next((mark for mark in "\t;," if mark in row), "")
    if not mark or row.rstrip(f"{mark} ").count(mark) != len(found) - 1 or any(mark in match["name"] for match in found):
        return []
    return [*lines[:start], mark.join(match["name"] for match in found), *lines[start + 1 :]]


def with_comments_as_names(lines: Sequence[str]) -> list[str]:
    """The lines with the names of a line "Comment" in that of the addresses and units below it; [] if there is no such pair.

    Parameters
    ----------
    lines : of a text file.

    >>> with_comments_as_names(["Comment,Force,Disp", "Time,U1-1[N],U1-2[mm]", "0.0,0.1,0.2"])
    ['', 'Time,Force [N],Disp [mm]', '0.0,0.1,0.2']
    """
    for i, (line, below) in enumerate(pairwise(lines[:_ABOVE])):
        start = _COMMENT.match(line)
        if start is None:
            continue
        mark = start[0][-1]
        names, addresses = (next(csv.reader([text], delimiter=mark)) for text in (line, below))
        found = [_ADDRESS.fullmatch(address.strip()) for address in addresses[1:]]
        if len(names) != len(addresses) or _TIME.fullmatch(addresses[0]) is None or None in found:
            continue
        named = [
            f"{name.strip()} {match['unit'] or ''}".strip() if name.strip() and match is not None else address
            for name, address, match in zip(names[1:], addresses[1:], found, strict=True)
        ]
        if any(mark in name or '"' in name for name in named) or not any(name.strip() for name in names[1:]):
            continue
        return [*lines[:i], "", mark.join([addresses[0], *named]), *lines[i + 2 :]]
    return []


def with_channels_named(lines: Sequence[str]) -> list[str]:
    """The lines with the names that a list gives to channels in the place of their addresses in the header; [] without such.

    A list with fewer than two names that are understood is one of settings.

    Parameters
    ----------
    lines : of a text file.

    >>> with_channels_named(['"CH1","Disp"', '"CH2","Force"', "No,ms,CH1,CH2", "NO.,ms,mm,N", "1,0,0.0,0.1"])
    ['', '', 'No,ms,Disp,Force', 'NO.,ms,mm,N', '1,0,0.0,0.1']
    >>> with_channels_named(["# CH1 = Time [s]", "# CH2 = Force [N]", "CH1;CH2", "0,0;0,1"])
    ['', '', 'Time [s];Force [N]', '0,0;0,1']
    """
    return next((named for mark in ",;\t" if (named := _with_channels_named(lines, mark))), [])


def _with_channels_named(lines: Sequence[str], mark: str) -> list[str]:
    named: dict[str, tuple[int, str]] = {}
    keys: set[int] = set()
    for i, line in enumerate(lines[:_ABOVE]):
        key = _KEY.fullmatch(line) if len(line) < _LONGEST_KEY else None
        cells = [key["channel"], key["name"]] if key is not None else _cells(line, mark)
        addresses = [cell for cell in cells if _LISTED.fullmatch(cell)]
        if len(addresses) > 1 and {*map(_address, addresses)} <= named.keys():
            of = [named.get(_address(cell), (i, "")) for cell in cells]
            names = [name or cell for (_, name), cell in zip(of, cells, strict=True)]
            known = sum(understand(name) is not None for _, name in of if name)
            if known < 2 or any(mark in name or '"' in name for name in names):
                return []
            # A list of names alone looks like a header.
            lists = {at for at, name in of if name and (at in keys or lines[at].count(mark) == 1)}
            return [*("" if k in lists else above for k, above in enumerate(lines[:i])), mark.join(names), *lines[i + 1 :]]
        if len(cells) < 2 or addresses != cells[:1] or not any(map(str.isalpha, cells[1])):
            continue
        keys |= {i} if key is not None else set()
        if named.setdefault(_address(cells[0]), (i, cells[1]))[1] != cells[1] and understand(cells[1]) is not None:
            return []  # two lists
    return []


def with_axes_named(lines: Sequence[str]) -> list[str]:
    """The lines with the names that a list gives to the channels X and Y in their place in the header; [] without such.

    Parameters
    ----------
    lines : of a text file.

    >>> with_axes_named(["Kanal X;Weg", "Kanal Y;Kraft", "Zeit [s];X [mm];Y [N]", "0,0;0,1;0,2"])
    ['', '', 'Zeit [s];Weg [mm];Kraft [N]', '0,0;0,1;0,2']
    """
    named: dict[str, tuple[int, str]] = {}
    for i, line in enumerate(lines[:_ABOVE]):
        key = _AXIS_KEY.fullmatch(line) if len(line) < _LONGEST_KEY else None
        if key is not None:
            axis, name = key["axis"].upper(), key["name"].strip()
            if axis in named or understand(name) is None:
                return []
            named[axis] = i, name
            continue
        mark = next((mark for mark in "\t;," if mark in line), ",")
        cells = _cells(line, mark)
        found = [_AXIS.fullmatch(cell) for cell in cells]
        axes = [match["axis"].upper() for match in found if match is not None]
        if len(axes) < 2:
            continue
        names = [
            f"{named.get(m['axis'].upper(), (0, m['axis']))[1]} {m['unit'] or ''}".strip() if m is not None else cell
            for m, cell in zip(found, cells, strict=True)
        ]
        known = all(understand(n) is not None or not m["unit"] for n, m in zip(names, found, strict=True) if m is not None)
        if sorted(axes) != sorted(named) or not known or any(mark in name or '"' in name for name in names):
            return []
        lists = {at for at, _ in named.values()}
        return [*("" if k in lists else above for k, above in enumerate(lines[:i])), mark.join(names), *lines[i + 1 :]]
    return []


def with_attributes_named(lines: Sequence[str]) -> list[str]:
    """The lines of an ARFF file with the names of its attributes where the data start; [] if it is none.

    Parameters
    ----------
    lines : of a text file.

    >>> with_attributes_named(["@relation r", "@attribute t_s numeric", "@ATTRIBUTE 'Force (N)' REAL", "@data", "0.0,0.1"])[3:]
    ['t_s,Force (N)', '0.0,0.1']
    """
    start = next((i for i, line in enumerate(lines[:_ABOVE]) if line.strip().lower() == "@data"), 0)
    found = [match for line in lines[:start] if (match := _ATTRIBUTE.fullmatch(line)) is not None]
    names = [(match["quoted"] or match["name"]).strip() for match in found]
    if not names or any("," in name or '"' in name for name in names):
        return []
    above = ["" if _ATTRIBUTE.fullmatch(line) else line for line in lines[:start]]
    return [*above, ",".join(names), *lines[start + 1 :]]


def _address(cell: str) -> str:
    """A channel however it is written: "CH1", "Ch. 1", "ch_01"."""
    return f"{cell.rstrip('0123456789').strip(' ._-').lower()} {int(re.sub('[^0-9]', '', cell) or -1)}"


def with_titles_of_pairs(lines: Sequence[str]) -> list[str]:
    """The lines with the titles above pairs of columns, as of exported curves, in the names of these; [] without such.

    Parameters
    ----------
    lines : of a text file.

    >>> with_titles_of_pairs(["Load (N) vs Time (s),,Extension (mm) vs Time (s),", "X,Y,X,Y", "0.0,0.1,0.0,0.2"])
    ['', 'Time (s),Load (N),Time (s),Extension (mm)', '0.0,0.1,0.0,0.2']
    >>> with_titles_of_pairs(["Load (N),,Extension (mm)", "Time (s),Value,Time (s),Value", "0.0,0.1,0.0,0.2"])[1]
    'Time (s),Load (N),Time (s),Extension (mm)'
    """
    for i, (line, below) in enumerate(pairwise(lines[:_ABOVE])):
        mark = next((mark for mark in "\t;," if mark in below), ",")
        titles, pairs = _cells(line, mark), _cells(below, mark)
        titles += [""] * (len(pairs) - len(titles))
        if len(pairs) % 2 or not pairs or not all(cell.lower() in _OF_PAIR for cell in pairs[1::2]) or any(titles[1::2]):
            continue
        names = [name for title, x in zip(titles[::2], pairs[::2], strict=True) for name in _of_title(title, x)]
        known = len(names) == len(pairs) and all((found := understand(name)) is not None and found.unit for name in names)
        if known and not any(mark in name or '"' in name for name in names):
            return [*lines[:i], "", mark.join(names), *lines[i + 2 :]]
    return []


def _of_title(title: str, x: str) -> list[str]:
    """The names of a pair of columns by its title and the name of the first; fewer where that says it not."""
    measured, *over = _OVER.split(title)
    return [*over, measured] if x.lower() == "x" else [x, measured]


def with_waves_named(lines: Sequence[str]) -> list[str]:
    """The lines of an Igor text file with the names of its waves as a header; [] if it holds other than one block of waves.

    Parameters
    ----------
    lines : of a text file.

    >>> with_waves_named(["IGOR", "WAVES/D\\ttime_s, force_N", "BEGIN", "\\t0.0\\t0.1", "END"])
    ['', 'time_s\\tforce_N', '', '0.0\\t0.1', '']
    """
    named = [(i, match) for i, line in enumerate(lines[:_ABOVE]) if (match := _WAVES.fullmatch(line)) is not None]
    words = [line.strip().upper() for line in lines]
    if len(named) != 1 or words.count("BEGIN") != 1 or words.count("END") != 1:
        return []
    (at, match), start, end = named[0], words.index("BEGIN"), words.index("END")
    names = [name.strip().strip("'") for name in match["names"].split(",")]
    if not at < start < end or any(line.strip() for line in lines[at + 1 : start]):
        return []
    above = [*lines[1:at], "\t".join(names), *[""] * (start - at)]
    return ["", *above, *(line.removeprefix("\t") for line in lines[start + 1 : end]), "", *lines[end + 1 :]]


def _cells(line: str, mark: str) -> list[str]:
    """The cells of a line between marks; none of a line that cannot be cut."""
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=mark), [])]
    except csv.Error:
        return []

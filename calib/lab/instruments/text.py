"""From the bytes of a lab file to lines of text: its encoding found, its hash taken."""

from __future__ import annotations

import codecs
import hashlib
import re
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from calib.errors import Fault, InputError
from calib.lab.instruments.brackets import kind_of_unit, without_brackets
from calib.lab.instruments.characters import BLANKS_OF_NO_WIDTH, DIRECTIONS, ORDER_OF_BYTES, with_plain_characters
from calib.lab.instruments.framed import of_array, of_tibble, of_tracker, of_wiki, without_words_before
from calib.lab.instruments.loggers import may_be_logged, without_loggers
from calib.lab.instruments.numbers import is_numeric
from calib.lab.instruments.odd_delimiters import with_usual_delimiters
from calib.lab.instruments.signals import (
    with_attributes_named,
    with_axes_named,
    with_channels_named,
    with_comments_as_names,
    with_signals_named,
    with_titles_of_pairs,
    with_waves_named,
)
from calib.lab.instruments.stamps import MAY_BE_OF_DATE, with_dates_in_figures, with_stamps_in_cells
from calib.lab.instruments.touching import with_cells_apart
from calib.lab.instruments.units import looks_like_unit
from calib.lab.instruments.vocabulary import understand
from calib.lab.instruments.wrapped import with_whole_header
from calib.regular import names_beside, require_regular

# Encodings of instruments' software besides Unicode and the Western ones, in the order in which a draw is decided.
_LEGACY = (
    "cp1250",
    "iso8859-2",
    "cp1251",
    "cp1253",
    "cp1254",
    "gb18030",
    "cp932",
    "cp949",
    "cp950",
    "cp850",
    "cp866",
    "koi8-r",
    "euc_jp",
)
# Those of old programs, of which a note is made.
_OLD = ("cp850", "cp866", "koi8-r", "euc_jp")
_NAMES = {"gb18030": "gbk", "cp932": "shift-jis", "cp950": "big5"}

# Bytes that are signs in the Western encoding of Windows, a dash or a quotation mark, and none in Latin-1.
_OF_WINDOWS = re.compile(rb"[\x80-\x9f]")
# Characters that no table has: bytes of another kind of file.
_CONTROL = re.compile("[\x00-\x08\x0e-\x1f\x7f]")
_CONTROL_BYTE = re.compile(b"[\x00-\x08\x0e-\x1f\x7f]")
_CONTROLS = bytes(c for c in range(128) if _CONTROL.match(chr(c)))
# The mark by which DOS ends a text, once or up to a full block.
_END_OF_DOS = b"\x1a"
# Characters that nobody sees: marks of the order of bytes, where files were joined, blanks of no width, and ends of pages.
_UNSEEN = (
    (ORDER_OF_BYTES, re.compile(ORDER_OF_BYTES), "a byte order mark"),
    (BLANKS_OF_NO_WIDTH, re.compile(f"[{BLANKS_OF_NO_WIDTH}]"), "a blank of no width"),
    (DIRECTIONS, re.compile(f"[{DIRECTIONS}]"), "a mark of the direction of writing"),
    ("\f\v", re.compile("^[\f\v]+|[\f\v]+$", re.MULTILINE), "the end of a page (a form feed)"),
)
# Control characters of a text that is damaged, as so many and a share of it; other files have more.
_FEW_CONTROLS, _SHARE_OF_CONTROLS = 10, 0.001
# How a terminal is told to write in colour.
_COLOURS = re.compile(r"\x1b\[[\d;]{0,12}[mK]")
_LONGEST_LINE = 20_000
# A cell in quotes that goes on in the next line, and its end; lines among which they are looked for, and that one may have.
_OPEN, _CLOSE = re.compile(r'(?:^|[,;\t])\s*"[^"]*$'), re.compile(r'[^"]*"\s*(?:[,;\t]|$)')
_HEAD, _BREAKS = 60, 40
# Lines within such a cell, all of words.
_WITHIN, _OF_WORDS = 3, re.compile(r"[^\W\d_]")
# Blanks at which no line is broken, beside a delimiter, where they pad a cell; between digits they set thousands apart.
_HARD_BLANKS = "\u00a0\u2007\u202f"
_PADDING = re.compile(rf'(?<=[;\t,|"\n])[{_HARD_BLANKS}]+|(?<![{_HARD_BLANKS}])[{_HARD_BLANKS}]++(?=[;\t,|"\n])')
# The exponent of a number in double precision as Fortran writes it, 1.25D-02.
_OF_MATHEMATICA = re.compile(r"(?<=[\d.])\*\^(?=[+-]?\d{1,3}(?![\w.]))")
_FORTRAN = re.compile(r"(?<=\d)(?<![A-Za-z_]\d)[dD](?=[+-]\d{2,3}(?![\w.]))")
# So many of its letters are looked at before all are.
_LETTERS = 1000
# A byte order mark of UTF-8, as it stands in a text that was read in another encoding and written in UTF-8.
_MARK = {codecs.BOM_UTF8.decode(encoding): encoding for encoding in ("cp1252", "cp1250", "cp1251", "cp1253", "cp1254")}
# A cell as spreadsheet programs are made to keep it as it is written, ="0.50", in quotes of its own or without.
_AS_FORMULA = re.compile(r'(?:(?<=[,;\t\n])|\A)(?:="([^"\n]*)"|"=""([^"\n]*)""")(?=[,;\t\n]|\Z)')
# A cell in quotes that was quoted once more, """Load (N)""", with the quotes around it or without.
_QUOTED_TWICE = re.compile(r'(^|[,;\t])(?:"""([^"\n]*)"""|""([^",;\t\n]+)"")(?=[,;\t\n]|\Z)', re.MULTILINE)
_MAY_BE_TWICE = re.compile(r'""[^,;\t\n]')
# A digit of another script than Latin, a cell with a number in such, and how many show that numbers are written so; what these
# scripts have for marks of numbers.
_OTHER_DIGIT = re.compile(r"(?![0-9])\d")
_OTHER_NUMBER = re.compile(
    r'(?:^|(?<=[;,\t|" ]))[-+\u2212\uff0d\uff0b]?(?:(?![0-9])\d)++[\u066b.,\uff0e]?(?:(?![0-9])\d)*+',
    re.MULTILINE,
)
_OTHER_MARKS = {"\u066b": ".", "\u066c": "'", "\uff0e": ".", "\uff0d": "-", "\uff0b": "+"}
_FEWEST_NUMBERS = 9
# A line in quotes as a whole, those within it written twice.
_QUOTED_LINE = re.compile(r'\s*"((?:[^"]|"")*)"[\s,;]*')
# A time before a line, as terminals write it.
_MAY_BE_STAMPED = re.compile(r"^[ \t]*(?:\d[^>\n]{4,40}>|\[[^\n]{0,30}\d:\d\d)", re.MULTILINE)
# Characters at the beginning among which the list of signals ends.
_OF_SIGNALS = 20_000
# Layouts whose columns are named elsewhere than above them: what shows one, the lines with the names above, and a note.
_NAMED_ELSEWHERE = (
    (MAY_BE_OF_DATE, with_dates_in_figures, "the dates and times in words before the cells of each line are read in figures"),
    (
        re.compile(r"^[^\S\n]*\|\|.*\|\|[^\S\n]*$", re.MULTILINE),
        of_tracker,
        "the table is one of an issue tracker: its marks are taken off",
    ),
    (
        re.compile(r"^[^\S\n]*<[a-z]{3,4}>\s+<", re.MULTILINE),
        of_tibble,
        "the line of the types of the columns, as R prints it, is passed by",
    ),
    (re.compile(r"\A\s*\{\|"), of_wiki, "the table is one of a wiki: its marks are taken off"),
    (re.compile(r"^[^\S\n]*\[{1,2}\s*[-+\d]", re.MULTILINE), of_array, "the brackets of a printed array are taken off"),
    (
        re.compile(r"^[^\S\n]*[^\W\d_][\w-]{0,15}\s*:\s*[-+.\d][^\n]*\n\s*[^\W\d_][\w-]{0,15}\s*:\s*[-+.\d]", re.MULTILINE),
        without_words_before,
        "a word and a colon stand before the cells of each line, which are passed by",
    ),
    (
        re.compile("startofdata", re.IGNORECASE),
        with_signals_named,
        'the columns are named by the list of signals ("Sig1" and so on) above "StartOfData"',
    ),
    (
        re.compile("comment", re.IGNORECASE),
        with_comments_as_names,
        'channels are named by the line "Comment" above their addresses and units',
    ),
    (
        re.compile(r'^[#%/;! \t"]*(?:CH|Chan|Channel|Kanal|Canal|Canale|Voie)\.?[ _-]?0*[12]"? *[,;\t=:]', re.I | re.MULTILINE),
        with_channels_named,
        "channels are named by the list of them above the header",
    ),
    (
        re.compile(r'^[#%/! \t"]*[^\W\d_]{2,8}\.?[ _-]?X"? *[,;\t=:]', re.I | re.MULTILINE),
        with_axes_named,
        "the channels X and Y are named by the list of them above the header",
    ),
    (
        re.compile(r"^[ \t]*@data[ \t]*$", re.IGNORECASE | re.MULTILINE),
        with_attributes_named,
        'the columns are named by the lines "@attribute" above "@data"',
    ),
    (re.compile(r"\AIGOR\n", re.IGNORECASE), with_waves_named, "the columns are the waves of an Igor text file"),
    (
        re.compile(r'[,;\t] ?"?(?:y|values?|amplitude|wert|messwert)"? ?[,;\t\n]', re.IGNORECASE),
        with_titles_of_pairs,
        "columns are named by the titles above their pairs",
    ),
)
# Lines at the beginning in which a header and its first rows stand.
_OF_HEADER = 60
#: What a line above a table says of one column alone: its 1-based number, the column from 0, and the words without its name.
OfColumn = tuple[int, int, str]
# As many bytes as hold no line of that length without a line end, in any encoding.
_CHUNK = 1 << 20
# Bytes of the largest file: a press of a day at 100 readings a second.
_LARGEST = 1_000_000_000


@dataclass(frozen=True, eq=False)
class LabText:
    """A lab file as lines of text.

    Attributes
    ----------
    path, sha256 : the file and the hash of its bytes.
    encoding : that was used.
    lines : without line ends; after a last line end stands an empty line.
    ended : whether the file ends with a line end.
    decimal : the decimal mark, where the file's format states it; else "".
    typed : whether numbers are numbers by the file's format, so that no decimal mark is in doubt.
    units_line : 1-based line of which the format states that units stand there, known ones or not; 0 if it states none.
    notes : in what it was not written as a table is.
    comments : what is written on cells and beside them, by 1-based line and column from 0, -1 where it stands at none.
    of_columns : what the format says of one column alone, in lines above its table.
    elsewhere : what other parts of the file say that hold no record, line by line; the k-th is of the line -k.
    """

    path: Path
    sha256: str
    encoding: str
    lines: tuple[str, ...]
    ended: bool
    decimal: str = ""
    typed: bool = False
    units_line: int = 0
    notes: tuple[str, ...] = ()
    comments: tuple[tuple[int, int, str], ...] = ()
    of_columns: tuple[OfColumn, ...] = ()
    elsewhere: tuple[str, ...] = ()


def require_readable(path: Path) -> None:
    """Refuse a lab file that is none (a pipe, a device), or too large to be the record of a press, before it is opened.

    Raises
    ------
    InputError
        If so, or if it is not there.
    """
    try:
        require_regular(path, "Give the name of a lab file")
        size = path.stat().st_size
    except OSError as error:
        advice = names_beside(path) if isinstance(error, FileNotFoundError) else ""
        raise InputError(Fault(f"cannot read the file: {error.strerror or error}", path, advice=advice)) from None
    if size > _LARGEST:
        raise InputError(Fault(f"has {size / 1e9:.1f} GB, too many for the record of a press", path, advice=_EXPORT))


def _may_be_fortran(text: str) -> bool:
    """Whether a sign stands behind a letter d, which few files have far below their header."""
    for letter in "Dd":
        at = text.find(letter)
        for _ in range(_LETTERS):
            if at < 0 or text[at + 1 : at + 2] in ("+", "-"):
                break
            at = text.find(letter, at + 1)
        if at >= 0 and (f"{letter}+" in text or f"{letter}-" in text):
            return True
    return False


def read_lab_text(path: Path) -> LabText:
    """Read a lab file as text, whatever encoding its software wrote it in.

    A byte order mark decides, then UTF-16 by its zero bytes, then UTF-8. Bytes that are not Unicode are read as Latin-1 (or as
    that of Windows, if signs stand in it that only this has, such as a dash), another code page, GBK, Shift-JIS, EUC-KR or
    Big5, whichever makes most of its words column names or units.

    Raises
    ------
    InputError
        If the file cannot be read, is empty, or is not text.
    """
    try:
        data = _bytes(path)
    except OSError as error:
        raise InputError(Fault(f"cannot read the file: {error.strerror or error}", path)) from None
    if not data.strip(b"\r\n\t ,;\x00\xef\xbb\xbf\xff\xfe"):
        raise InputError(Fault("the file is empty", path, advice="Export it again from the instrument's software"))
    body = data.rstrip(_END_OF_DOS + b"\r\n")
    whole = body + b"\n" if _END_OF_DOS in data[len(body) :] else data
    encoding, text = _decode(path, whole)
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    text, unseen = _without_the_unseen(text)
    unseen = unseen if whole == data else ("the mark by which DOS ends a file (0x1A) is left out", *unseen)
    text, plain = with_plain_characters(text)
    fortran: tuple[str, ...] = ()
    if _may_be_fortran(text) and (first := _FORTRAN.search(text)) is not None:
        shown = re.split(r"[^\w.,+-]", text[max(0, first.start() - 20) : first.end() + 3])[-1]
        fortran = (f'exponents as Fortran writes them are read, as in "{shown}"',)
        text = _FORTRAN.sub("E", text)
    if "*^" in text and (first := _OF_MATHEMATICA.search(text)) is not None:
        line = text.count("\n", 0, first.start()) + 1
        fortran = (*fortran, f"exponents as Mathematica writes them, *^, are read as those of ten, the first in line {line}")
        text = _OF_MATHEMATICA.sub("e", text)
    if any(blank in text for blank in _HARD_BLANKS):
        text = _PADDING.sub("", text)
    text, digits = _with_usual_digits(text)
    text, notes = _as_cells(text)
    notes = (*fortran, *(["colours of a terminal are left out"] if b"\x1b[" in data else []), *notes)
    lines = _with_whole_cells(text.split("\n"))
    if max(map(len, lines)) > _LONGEST_LINE:
        long = next(i for i, line in enumerate(lines) if len(line) > _LONGEST_LINE)
        raise InputError(
            Fault(f"a line of {len(lines[long])} characters is not a row of a lab's table", path, long + 1, advice=_EXPORT)
        )
    of_old = (f"the letters are read in {encoding}, in which most names are understood",) if encoding in _OLD else ()
    notes = (*of_old, *unseen, *plain, *digits, *notes)
    return LabText(path, hashlib.sha256(data).hexdigest(), encoding, lines, text.endswith("\n"), notes=notes)


def _without_the_unseen(text: str) -> tuple[str, tuple[str, ...]]:
    """The text without characters that nobody sees, where they change no cell, and a note: marks of bytes, ends of pages."""
    notes = []
    for characters, pattern, what in _UNSEEN:
        found = pattern.search(text) if any(c in text for c in characters) else None
        if found is not None:
            line = text.count("\n", 0, found.start()) + 1
            text, n = pattern.subn("", text)
            where = f"line {line}" if n == 1 else f"{n} places, the first in line {line},"
            notes.append(f"{what} in {where} is left out, which nobody sees")
    return text, tuple(notes)


def _without_marks(text: str) -> str:
    """The text without byte order marks at its beginning, be they written twice.

    What was written in UTF-8, read in another encoding and written in UTF-8 again is read as it was at first.
    """
    text = text.lstrip("\ufeff")
    for mark, encoding in _MARK.items():
        if text.startswith(mark):
            try:
                return _without_marks(text.encode(encoding).decode("utf-8"))
            except UnicodeError:
                return text.removeprefix(mark)
    return text


def _with_usual_digits(text: str) -> tuple[str, tuple[str, ...]]:
    """The text with the digits 0 to 9 for those of another script, where its numbers are written in these, and a note."""
    if text.isascii() or len(list(islice(_OTHER_NUMBER.finditer(text), _FEWEST_NUMBERS))) < _FEWEST_NUMBERS:
        return text, ()
    found = sorted(set(_OTHER_DIGIT.findall(text)))
    usual = {ord(digit): str(unicodedata.decimal(digit)) for digit in found}
    # The marks of these scripts are one thing each.
    text = text.translate(usual | {ord(mark): to for mark, to in _OTHER_MARKS.items()})
    return text, (f"the numbers are written in digits of another script ({''.join(found[:10])}), which are read as 0 to 9",)


def _as_cells(text: str) -> tuple[str, tuple[str, ...]]:
    """The text with cells for what spreadsheet programs write in their place, and notes on that: whole lines, and formulas."""
    notes = []
    if "=" in text and '="' in text:
        text, n_cell = _AS_FORMULA.subn(lambda found: f'"{found[1] or found[2] or ""}"', text)
        if n_cell:
            notes.append(
                f'{n_cell} cells are written as formulas of a spreadsheet, such as ="0.50": what stands in them is taken'
            )
    apart, note = with_cells_apart(text)
    if apart:
        text, notes = apart, [*notes, note]
    parted, note = with_usual_delimiters(text)
    if parted:
        text, notes = parted, [*notes, note]
    if may_be_logged(text):
        lines, note = without_loggers(text.split("\n"))
        text, notes = ("\n".join(lines), [*notes, note]) if lines else (text, notes)
    if _MAY_BE_STAMPED.search(text, 0, _OF_SIGNALS):
        stamped, note = with_stamps_in_cells(text.split("\n"))
        text, notes = ("\n".join(stamped), [*notes, note]) if stamped else (text, notes)
    for shown, with_names, note in _NAMED_ELSEWHERE:
        if shown.search(text[:_OF_SIGNALS]) and (named := with_names(text.split("\n"))):
            text, notes = "\n".join(named), [*notes, note]
    if '"' in text and (lines := _unquoted(_lines_of(text))):
        text = "\n".join(lines)
        notes.append("every line of cells stands in quotes as a whole, as if it were one cell: the quotes are taken off")
    if _MAY_BE_TWICE.search(text):
        text, n_cell = _QUOTED_TWICE.subn(lambda found: f'{found[1]}"{found[2] or found[3] or ""}"', text)
        if n_cell:
            notes.append(f"{n_cell} cells stand in quotes that were quoted once more: what stands in them is taken")
    joined, note = with_whole_header(text.split("\n", _OF_HEADER))
    if joined:
        text, notes = "\n".join(joined), [*notes, note]
    return text, tuple(notes)


def _lines_of(text: str) -> Iterator[str]:
    """The lines of a text one by one, of which the first few are enough for most."""
    begin = 0
    while (end := text.find("\n", begin)) >= 0:
        yield text[begin:end]
        begin = end + 1
    yield text[begin:]


def _unquoted(lines: Iterable[str]) -> list[str]:
    """The lines without the quotes around each of them; [] if one that has several cells has none, or cells of its own.

    Names above may stand without quotes, as many as there are cells in the first line that is in quotes.
    """
    found: list[str] = []
    n_whole, n_named, above = 0, 0, ""
    for line in lines:
        match = _QUOTED_LINE.fullmatch(line)
        inside = match[1].replace('""', '"') if match is not None else line
        whole = match is not None and re.search(r"[,;\t]", inside) is not None
        if not whole and '"' not in line and re.search(r"[,;\t]", line.strip(" ,;\t")) is None:
            found.append(line)  # a title, or nothing
        elif whole:
            if above and not n_whole and not any(0 < above.count(mark) == inside.count(mark) for mark in ",;\t"):
                return []
            n_whole += 1
            n_named += not is_numeric(re.split(r"[,;\t]", inside)[0].strip(' "'))
            found.append(inside)
        elif not n_whole and '"' not in line and not is_numeric(re.split(r"[,;\t]", line)[0]):
            above, n_named = line, 1
            found.append(line)
        else:
            return []
    # "0,5" alone in each line is a number.
    several = sum(len(re.findall(r"[,;\t]", line)) > 1 or "." in line for line in found if line)
    return found if n_whole > 1 and n_named and 2 * several > n_whole else []


def _with_whole_cells(lines: list[str]) -> tuple[str, ...]:
    """Lines where cells of a header that hold line breaks, in quotes, stand in one; blank ones take the place of others."""
    for first in range(min(len(lines), _HEAD)):
        last = first
        while last + 1 < len(lines) and last - first < _BREAKS and _goes_on(lines[first], lines[last + 1 : last + 2 + _WITHIN]):
            last += 1
            lines[first], lines[last] = f"{lines[first].rstrip()} {lines[last].lstrip()}", ""
    return tuple(lines)


def _goes_on(line: str, below: Sequence[str]) -> bool:
    """Whether a cell in quotes begins in a line and ends in the following one, or behind a few lines of words."""
    following = next((text for text in below if '"' in text or not _OF_WORDS.search(text)), "")
    if len(line) > _LONGEST_LINE or _OPEN.search(line) is None or _CLOSE.match(following) is None:
        return False
    # A row of numbers goes on in no cell of the row before: a quotation mark was left open.
    return sum(map(is_numeric, re.split(r"[,;\t]", following.replace('"', "")))) < 2


# Control characters in a text that is damaged, and zero bytes as a share of it; other files have more.
_FEW_CONTROLS = 20
_FEW_ZEROS = 0.05
_EXPORT = "Export a CSV file or a workbook from the instrument's software"


def _bytes(path: Path) -> bytes:
    """All bytes of a text; one that goes on and on without a line end is refused before it is read to its end."""
    parts: list[bytes] = []
    with path.open("rb") as file:
        while part := file.read(_CHUNK):
            if len(part) == _CHUNK and b"\n" not in part and b"\r" not in part:
                line = sum(p.count(b"\n") for p in parts) + 1
                message = f"a line of more than {_LONGEST_LINE} characters is not a row of a lab's table"
                raise InputError(Fault(message, path, line, advice=_EXPORT))
            parts.append(part)
    return b"".join(parts)


def _encodings(data: bytes) -> Iterator[str]:
    """The encodings that data may be in, the likeliest first."""
    if data.startswith(codecs.BOM_UTF8):
        yield "utf-8-sig"
    elif data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        yield "utf-16"
    elif b"\x00" in data[:1000]:
        # Most characters of a table are of ASCII, whose other byte is zero.
        halves = data[0:4000:2].count(0), data[1:4000:2].count(0)
        yield "utf-16-be" if halves[0] > halves[1] else "utf-16-le"
    else:
        yield "utf-8"
        yield from _legacy(data)


def _decode(path: Path, data: bytes) -> tuple[str, str]:
    for encoding in _encodings(data):
        try:
            text = data.decode(encoding)
        except UnicodeDecodeError:
            continue
        if not _has_controls(text) or not _has_controls(text := _COLOURS.sub("", text)):
            return _NAMES.get(encoding, encoding), _without_marks(text)
    zero = data.find(b"\x00")
    few = b"\x00" not in data.rstrip(b"\x00\r\n") or data.count(b"\x00") < _FEW_ZEROS * len(data)
    if zero >= 0 and few and not _CONTROL.search(data.replace(b"\x00", b"").decode("latin-1")):
        message = "the file is not text: zero bytes, as a power cut leaves them, stand in this line"
        advice = f"Cut them off if nothing else is lost. {_EXPORT}"
        raise InputError(Fault(message, path, data.count(b"\n", 0, zero) + 1, advice=advice))
    found = [m.start() for m in islice(_CONTROL_BYTE.finditer(data), int(_FEW_CONTROLS + _SHARE_OF_CONTROLS * len(data)) + 1)]
    if zero < 0 and 0 < len(found) <= _FEW_CONTROLS + _SHARE_OF_CONTROLS * len(data):
        message = f"the file is not text: a character that nobody sees (0x{data[found[0]]:02X}) stands in this line"
        advice = f"Remove it if it means nothing. {_EXPORT}"
        raise InputError(Fault(message, path, data.count(b"\n", 0, found[0]) + 1, advice=advice))
    raise InputError(Fault("the file is not text", path, advice=_EXPORT))


def _has_controls(text: str) -> bool:
    if not text.isascii():
        return _CONTROL.search(text) is not None
    data = text.encode("ascii")
    return len(data.translate(None, _CONTROLS)) < len(data)


def _legacy(data: bytes) -> list[str]:
    """The encodings besides Unicode, the one first in which most words are understood."""
    lines = [line for line in data[:100_000].splitlines()[:400] if not line.isascii()]

    def understood(encoding: str) -> int:
        count = 0
        for line in lines:
            text = line.decode(encoding, errors="replace")
            if "\ufffd" in text:
                return -1
            for cell in re.split(r"[\t;,]|\s{2,}", text):
                cell = cell.strip().strip('"')
                if cell.isascii() or len(cell) > 60:
                    continue
                count += _is_understood(cell)
        return count

    western = "cp1252" if _OF_WINDOWS.search(data) and _is_in(data, "cp1252") else "latin-1"
    encodings = (western, *_LEGACY)
    scores = {encoding: understood(encoding) for encoding in encodings}
    return sorted(encodings, key=lambda encoding: -scores[encoding])


def _is_in(data: bytes, encoding: str) -> bool:
    try:
        data.decode(encoding)
    except UnicodeDecodeError:
        return False
    return True


def _is_understood(cell: str) -> bool:
    """Whether a cell is a name, or holds a unit, that is known; a name with signs for a unit that are none is not."""
    found = understand(cell)
    inside = (without_brackets(cell) or ("", ()))[1]
    odd = [
        text for text in (cell.strip("()[]"), *inside) if not text.isascii() and (looks_like_unit(text) or kind_of_unit(text))
    ]
    return bool(odd) or (found is not None and (not found.unit or looks_like_unit(found.unit)))

"""What a line below the header is (a row, the header again, text), and what the rows of one record become: a `Table`."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from calib.lab.instruments.clock_cells import is_clock
from calib.lab.instruments.header import is_same_header
from calib.lab.instruments.labtable import IntArray, Unread
from calib.lab.instruments.lexicon import RESULTS
from calib.lab.instruments.numbers import is_error_of_spreadsheet, is_missing, is_numeric, is_over_range
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.unit_cells import is_worded_reading, with_its_unit
from calib.lab.instruments.vocabulary import understand

#: Words by which a line says that results, and no readings, stand below it.
OF_RESULTS = re.compile(
    r"result|ergebnis|auswertung|zusammenfassung|kennwert|résultat|résumé|synthèse|risultat|riepilogo|resultad|resumen|resumo|"
    r"wynik|podsumowanie|výsled|eredmény|sonuç|uitslag|samenvatting|statisti|statystyk|estadístic|summary|результат|итог|"
    r"结果|結果|汇总|統計|统计|결과|요약",
    re.IGNORECASE,
)
# The largest or smallest in languages that say it in two words; words of a cell that says what was computed.
_THE_MOST = re.compile(
    r"(?:l[ea] )?plus (?:grande?|petite?|haute?|basse?|bas|élevée?|forte?|faible)|(?:el |la )?m[áa]s (?:alt|baj|pequeñ)[oa]|"
    r"(?:el |la )?m[áa]s grande|(?:il |la )?pi[ùu] (?:alt|bass|piccol)[oa]|(?:il |la )?pi[ùu] grande"
)
_MOST_WORDS = 3
#: Rows of a second table that are too many to be left out as one of results.
FEW_ROWS = 10


@dataclass(frozen=True, eq=False)
class Table:
    """The rows of one record.

    Attributes
    ----------
    columns : of cells, as many as the header has, and one without a name where remarks stand behind the cells of some rows.
    lines : 1-based line of each row.
    notes : on what was left out.
    unread : lines that are no rows of the record.
    reasons : row from 0 -> why its cells cannot be trusted.
    specimens : how many there are, of which these rows are one.
    units, units_line : those below the header of this specimen and their 1-based line, where it has a header of its own; None
        where those of the sheet hold.
    """

    columns: Sequence[Sequence[str]]
    lines: IntArray
    notes: Sequence[str]
    unread: Sequence[Unread] = ()
    reasons: Mapping[int, str] = field(default_factory=dict)
    units: tuple[str, ...] | None = None
    units_line: int | None = None
    specimens: int = 1


def n_named(sheet: Sheet) -> int:
    """Count the columns up to the last that has a name."""
    return max((i + 1 for i, name in enumerate(sheet.names) if name), default=0)


def n_needed(sheet: Sheet) -> int:
    """Count the columns up to the last that has a name, but for one of remarks at the end, whose cells loggers leave away."""
    n = n_named(sheet)
    return n - 1 if n > 2 and sheet.names[n - 1].strip().lower() in _OF_REMARKS else n


def left_out(sheet: Sheet, indices: Sequence[int]) -> list[str]:
    """Write the note on lines of text that are left out; no note if there are none.

    Parameters
    ----------
    sheet : their file.
    indices : of the lines in the file, from 0.
    """
    if not indices:
        return []
    shown = sheet.text.lines[indices[0]].strip()[:80]
    return [f'{len(indices)} line(s) of text left out, the first is "{shown}" (line {indices[0] + 1})']


def is_result(cell: str) -> bool:
    """Whether a cell says what was computed from several readings: "Mean", "Std. dev."."""
    parts = [w for w in re.split(r"[\s_.,;:()]+", cell.lower()) if w]
    few = 0 < len(parts) <= _MOST_WORDS
    return few and (any(w in RESULTS for w in parts) or _THE_MOST.match(" ".join(parts)) is not None)


def not_read(sheet: Sheet, indices: Sequence[int], why: str) -> list[Unread]:
    """Name lines that are not read, those in succession together, each with its beginning.

    Parameters
    ----------
    sheet : their file.
    indices : of the lines in the file, from 0, in order.
    why : they are not.
    """
    spans: list[list[int]] = []
    for i in indices:
        if spans and not any(line.strip() for line in sheet.text.lines[spans[-1][1] + 1 : i]):
            spans[-1][1] = i
        else:
            spans.append([i, i])
    found = []
    for first, last in spans:
        what = f"line {first + 1}" if first == last else f"lines {first + 1} to {last + 1}"
        shown = re.sub(r"\s+", " ", sheet.text.lines[first]).strip()[:60]
        found.append(Unread(what, f'{why}, beginning "{shown}"' if shown else why))
    return found


_OF_REMARKS = (
    "comment",
    "comments",
    "remark",
    "remarks",
    "note",
    "notes",
    "kommentar",
    "bemerkung",
    "commentaire",
    "comentario",
)
# A line that a program has set apart from the rows; a spreadsheet's words for an error are none.
_COMMENT = re.compile(
    r"(?:#+(?!#|N/?A|NV|REF|DIV|VALUE|NAME|NUM|NULL|WERT|BEZUG|ZAHL)|%+|//+|!)\s*(?=[\w(\[\"']|[-=*~>]{2,}\s*[^\W\d_])",
    re.IGNORECASE,
)


def is_comment(line: str) -> bool:
    """Whether a line is behind a mark of comments, "#", "%", "//" or "!"."""
    plain = line.lstrip().lstrip('"')
    return _COMMENT.match(plain) is not None and not is_error_of_spreadsheet(re.split(r'[",;\t]', plain)[0].strip())


def kind_of_line(row: Sequence[str], header: Sequence[str], keys: Sequence[int], width: int) -> str:
    """Tell what a line below the header is: "header" again, "row", or "text".

    Parameters
    ----------
    row : its cells.
    header : those of the header, () if it cannot stand again.
    keys : columns that are understood, by index.
    width : columns of the header.
    """
    if row and is_comment(row[0]):
        return "header" if is_same_header([c.strip() for c in row], header) else "text"
    key = keys[0] if keys else 0
    if min(width, 2) <= len(row) > key and is_numeric(row[key]):
        return "row"
    cells = [c.strip() for c in row]
    if is_same_header(cells, header):
        return "header"
    there = [cells[i] for i in keys if i < len(cells)]
    if len(there) > 1 and (all(map(with_its_unit, there)) or _are_readings(there, cells, width)):
        return "row"
    numbers = sum(is_numeric(c) or is_clock(c) for c in there)
    nothing = sum(is_missing(c) or is_over_range(c) for c in there)
    first = next((c for c in cells if c), "")
    worded = not (is_numeric(first) or is_over_range(first) or is_clock(first) or is_missing(first))
    if worded and len(cells) < width and not any(map(is_numeric, cells[2:])):
        return "text"  # `key,value` below the table
    if worded and first.endswith(":") and len(cells) > width:
        return "text"  # "Data Header: Time: 10.000 Sec 3/12/2024 2:11:05 PM"
    if worded and len(cells) > width and 2 * (numbers + nothing) < len(there):
        return "text"  # "Test report 0815   Page 2", cut at its blanks
    readings = sum(is_numeric(c) or is_clock(c) for c in cells)
    if worded and readings < sum(bool(c) for c in cells) - readings and readings < 2:
        return "text"  # `key,value,unit`
    if numbers == 0 and not (nothing and not worded):
        return "text"
    return "row"


def _are_readings(there: Sequence[str], cells: Sequence[str], width: int) -> bool:
    """Whether the cells of the columns that are understood are numbers, with words behind some of which one is a unit."""
    worded = [cell for cell in there if not (is_numeric(cell) or is_missing(cell) or is_over_range(cell))]
    return len(cells) == width and any(map(with_its_unit, worded)) and all(map(is_worded_reading, worded))


def short_rows(lengths: Mapping[int, int], n_row: int, width: int) -> dict[int, str]:
    """Find rows with fewer cells than most have: which is missing cannot be told, so that none of the others can be trusted.

    Parameters
    ----------
    lengths : row from 0 -> its number of cells, of rows with another number than the header has.
    n_row : rows in all.
    width : cells of the header.

    Returns
    -------
    Row -> why it is not usable. A file most of whose rows are shorter than its header has a column that is filled more rarely.
    """
    of_length = Counter(lengths.values())
    counts = Counter({n: count for n, count in of_length.items() if n > 1})
    counts[width] += n_row - len(lengths)
    usual = max(counts, key=lambda n: (counts[n], n))
    if usual <= min(counts) and 1 not in of_length:
        return {}
    return {i: f"{n} cells where most rows have {usual}" for i, n in lengths.items() if n < usual}


def is_other_header(row: Sequence[str]) -> bool:
    """Whether a line of text names columns of another table: two of its cells are understood."""
    return sum(understand(c.strip()) is not None for c in row if c.strip()) >= 2

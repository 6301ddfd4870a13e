"""What a line below the header is (a row, the header again, text), and what the rows of one record become: a `Table`."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from calib.lab.instruments.clock_cells import is_clock
from calib.lab.instruments.contrary import names_quantity
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


#: Words by which a line beside the rows says that they are not what they seem, or by what number they are multiplied.
DOUBT = re.compile(
    r"(?<![^\W_])(?:not|never|no|un\w*connected|dis\w*connected|warn\w*|error\w*|fail\w*|fault\w*|wrong\w*|bad|dead|broken|"
    r"brok\w*|defect\w*|invalid\w*|ignore\w*|discard\w*|abort\w*|stopp\w*|slip\w*|over(?:load|range|flow)\w*|saturat\w*|"
    r"simulat\w*|synthetic|demo|dummy|reference|command\w*|setpoint\w*|reversed?|invert\w*|swapped|peak|hold|offset\w*|"
    r"should|must|beware|caution|attention|careful|except\w*|only|instead|old|previous|last|other|another|came off|"
    r"nicht|kein\w*|nie|warnung|achtung|vorsicht|fehler\w*|falsch\w*|kaputt|defekt|ungültig\w*|ignorieren|abgebrochen|"
    r"abbruch|überlast\w*|simuliert\w*|referenz\w*|vertauscht|umgekehrt|sollwert\w*|nur|statt|"
    r"pas|aucun\w*|attention|erreur\w*|faux|fausse|défaut\w*|défectueu\w*|ignorer|interrompu\w*|surcharge\w*|simulé\w*|"
    r"référence|consigne|inversé\w*|ninguna?|atención|aviso|fallo|equivocad\w+|roto|ignorar|abortad\w+|interrumpid\w+|"
    r"sobrecarga|simulad\w+|referencia|invertid\w+|non|attenzione|avviso|errore|sbagliat\w+|guasto|ignorare|interrott\w+|"
    r"sovraccaric\w+|simulat\w+|riferimento|não|atenção|erro|errad\w+|referência|niet|geen|fout\w*|nie|błąd\w*|uwaga|"
    r"ne|chyb\w*|inte|fel|не|ошибк\w*|внимание|[x×*]\s?\d+(?:[.,]\d+)?|mal \d+)(?![^\W_])"
    r"|注意|警告|错误|錯|误|エラー|誤|未接続|未连接|不|시뮬|주의|오류|!!",
    re.IGNORECASE,
)
_OF_PRESS = ("force", "displacement", "capacitance")
_CHANNEL = re.compile(
    r"(?<![^\W_])(?:channels?|sensors?|kan[aä]le?|kanal|canal|canaux|canales|sensore?s?|capteurs?)(?![^\W_])", re.I
)
# A block of so many lines is quoted in full; of a longer one so many at most, of the first, each no longer than this.
_SHORT, _QUOTED, _LOOKED_AT, _LONGEST_QUOTE = 4, 8, 400, 80


def not_read(sheet: Sheet, indices: Sequence[int], why: str, *, words: bool = True) -> list[Unread]:
    """Name lines that are not read, those in succession together, each with its beginning and what it says of the readings.

    Parameters
    ----------
    sheet : their file.
    indices : of the lines in the file, from 0, in order.
    why : they are not.
    words : whether they are words, of which those are quoted that may say something of the readings.
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
        shown = re.sub(r"\s+", " ", sheet.text.lines[first][:_LOOKED_AT]).strip()
        longest = _LONGEST_QUOTE if words else 60
        more = telling(sheet.text.lines[first + 1 : last + 1], first + 2) if words else ""
        found.append(Unread(what, f'{why}, beginning "{shown[:longest]}"{more and f", then {more}"}' if shown else why))
    return found


def telling(lines: Sequence[str], number: int | None = None) -> str:
    """Quote what a block of lines may say of the readings: all of a short one, else lines that name a channel or a doubt.

    Parameters
    ----------
    lines : of the block.
    number : 1-based line of the first, which is shown; None if they are not of the file itself.
    """
    there = [
        (i, " ".join(line[:_LOOKED_AT].split())) for i, line in enumerate(lines[:_LOOKED_AT]) if _HOLDS_A_WORD.search(line)
    ]
    doubts = [i for i, line in there if DOUBT.search(line)]
    if len(there) < _SHORT:
        chosen = [i for i, _ in there]
    else:
        named = [i for i, line in there if i not in doubts and _speaks_of_press(line)]
        chosen = [*doubts, *named]
    kept = sorted(chosen[:_QUOTED])
    text = dict(there)
    quoted = [f'"{text[i][:_LONGEST_QUOTE]}"' + (f" (line {number + i})" if number is not None else "") for i in kept]
    more = len(chosen) - len(kept)
    return ", ".join(quoted) + (f" and {more} more line(s) of this kind" if more else "")


_HOLDS_A_WORD = re.compile(r"[^\W\d_]{2}|[^\W\d_]\s*[x×*=]\s*\d")


def _speaks_of_press(line: str) -> bool:
    return _CHANNEL.search(line) is not None or any(names_quantity(line, quantity) for quantity in _OF_PRESS)


# One sign over and over, or with blanks between, rules off what stands above from what stands below; a device acknowledges a
# command. Signs of equality are a line of text, as they stand between two versions of a file that were put together.
_SAYS_NOTHING = re.compile(r"([-*#_~+–—])\1{2,}|(?:[-*#_~–—] )+[-*#_~–—]|[<>\[]*\s*(?:ok|ack)\s*[.!>\]]*", re.IGNORECASE)


def says_nothing(row: Sequence[str], width: int) -> bool:
    """Whether a line says nothing of the rows, as "-----", "****" and "ok" do, and holds no cells without readings.

    Parameters
    ----------
    row : its cells.
    width : columns of the header.
    """
    if row and row[0][:1].isdecimal():
        return False  # nearly all rows
    there = [cell.strip() for cell in row if cell.strip()]
    return bool(there) and (len(there) == 1 or len(there) != width) and _SAYS_NOTHING.fullmatch(" ".join(there)) is not None


def passed_over(sheet: Sheet, indices: Sequence[int]) -> list[str]:
    """Write the note on lines that say nothing of the rows; no note if there are none.

    Parameters
    ----------
    sheet : their file.
    indices : of the lines in the file, from 0.
    """
    shown = f'"{sheet.text.lines[indices[0]].strip()[:30]}" in line {indices[0] + 1}' if indices else ""
    what = f"{len(indices)} line(s) that say nothing of the rows are passed by as empty ones are, the first is {shown}"
    return [what] if indices else []


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
    if says_nothing(row, width):
        return "text"
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

"""From the lines below the header, taken one by one, to the rows of one record: blocks, specimens, text between them."""

from __future__ import annotations

import csv
import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice, pairwise, takewhile

import numpy as np

from calib.errors import Fault, InputError, capped
from calib.lab.instruments.clock_cells import is_clock, is_reading
from calib.lab.instruments.header import DELIMITERS, SAID_BY_NUMBER, split_blanks, split_line, width_of_row
from calib.lab.instruments.labtable import IntArray, Reading, Unread
from calib.lab.instruments.lexicon import OF_TESTERS, TURNS
from calib.lab.instruments.lines import (
    FEW_ROWS,
    Table,
    is_comment,
    is_other_header,
    is_result,
    kind_of_line,
    left_out,
    n_named,
    n_needed,
    not_read,
    passed_over,
    says_nothing,
    short_rows,
)
from calib.lab.instruments.numbers import is_missing, is_numeric, is_over_range, parse_number
from calib.lab.instruments.odd_delimiters import parted_oddly
from calib.lab.instruments.quotes import check_quotes
from calib.lab.instruments.results import LINES_OF_RESULTS, only_results
from calib.lab.instruments.run_on import is_only_words, runs_on
from calib.lab.instruments.sheet import Sheet, which_specimen
from calib.lab.instruments.stated import speaks_of_scale, speaks_of_zero
from calib.lab.instruments.text import LabText
from calib.lab.instruments.titles import units_in_row
from calib.lab.instruments.torn import thousands_advice, thousands_in
from calib.lab.instruments.touching import numbers_in_one
from calib.lab.instruments.unit_cells import unit_cell
from calib.lab.instruments.units import RECORDED, is_unit_of, looks_like_unit, stands_for
from calib.lab.instruments.vocabulary import EXAMPLE, understand


def block_table(sheet: Sheet, start: int, keys: Sequence[int], reading: Reading) -> Table:
    """Find the rows of one record, line by line, where several blocks, specimens or lines of text stand below the header.

    Parameters
    ----------
    sheet : without rows.
    start : index of the first line below its header and units.
    keys : columns that are understood, by index.
    reading : what the user says of the file.

    Raises
    ------
    SeveralSpecimens
        If the blocks are several specimens and `reading` does not say which.
    InputError
        If there are no rows, text stands among them, they do not fit the header, or another table follows.
    """
    rows = _cells_of(sheet, start)
    blocks, more, unread = _blocks(sheet, rows, start, keys)
    blocks = [replace(b, label=b.label or _label(sheet, b.line - 1)) for b in blocks if b.rows]
    if not blocks:
        raise InputError(_without_rows(sheet))
    kept, block_notes, specimens = _one_specimen(sheet, blocks, rows, reading)
    other = [start + i for b in blocks if b.rows[0] not in kept for i in b.rows]
    unread += not_read(sheet, other, "rows of another specimen", words=False) if block_notes else []
    width = len(sheet.names)
    results = _labelled_results(rows, kept, width)
    unread += not_read(sheet, [start + i for i in results], "results below the rows, with their names in front", words=False)
    kept = [i for i in kept if i not in results]
    chosen = _with_whole_remarks([rows[i] for i in kept], width, sheet.delimiter)
    lines = np.array(kept, dtype=np.int64) + start + 1
    beside = _remarks_beside(chosen, width, sheet.delimiter)
    chosen = [row[:width] if i in beside else row for i, row in enumerate(chosen)]
    stray = _with_a_stray_cell(chosen, width, sheet.delimiter)
    chosen = [[c for c in row if c.strip()] if i in stray else row for i, row in enumerate(chosen)]
    _check_width(sheet, chosen, lines, width)
    short = short_rows({i: len(row) for i, row in enumerate(chosen) if len(row) != width}, len(chosen), width) | stray
    full = [row if len(row) == width else (row + [""] * width)[:width] for row in chosen]
    own = next(b for b in blocks if b.rows[0] in kept)
    units = own.units if own.units is not None and own.units_line != sheet.units_line else None
    notes = [*block_notes, *more]
    columns = [*zip(*full, strict=True)]
    if beside:
        columns.append(tuple(beside.get(i, "") for i in range(len(full))))
        first = min(beside)
        shown = f'the first is "{beside[first][:60]}" (line {lines[first]})'
        notes.append(f"{len(beside)} row(s) have a remark behind their last cell, under no name, which is no reading: {shown}")
    return Table(columns, lines, notes, tuple(unread), short, units, own.units_line, specimens)


def _labelled_results(rows: list[list[str]], kept: Sequence[int], width: int) -> list[int]:
    """The last rows whose cells stand one column to the right, behind a word such as "Mean", in rows without one."""
    found: list[int] = []
    for i in reversed(kept):
        row = rows[i]
        if len(row) != width + 1 or not is_result(row[0]) or not all(is_numeric(c) or is_missing(c) for c in row[1:]):
            break
        found.insert(0, i)
    return found if len(found) < len(kept) and len(rows[kept[-1 - len(found)]]) == width else []


# Lines below a header among which a row of numbers between another mark than its names is looked for.
_NEXT = 20


def _without_rows(sheet: Sheet) -> Fault:
    """The fault of a header without rows, or whose names are not understood as those of the columns of numbers below it."""
    first = sheet.header_line
    if (odd_delimiter := parted_oddly(sheet.text.path, sheet.text.lines)) is not None:
        return odd_delimiter
    widths = {i: width_of_row(line) for i, line in enumerate(sheet.text.lines[first : first + _NEXT], first + 1)}
    row, width = next(((i, n) for i, n in widths.items() if n > 1), (0, 0))
    below = enumerate(sheet.text.lines[first : first + _NEXT], first + 1)
    line, touching = next(((i, found) for i, words in below if (found := numbers_in_one(words))), (0, ""))
    if not row and touching:
        message = (
            f'"{touching}" is several numbers that touch each other, and where each ends cannot be told by the other lines'
        )
        advice = (
            "Export the file again with wider columns or a mark between them; or, if each sign begins a number, put a blank "
        )
        advice += f"before it: sed -E 's/([0-9])([-+])/\\1 \\2/g' {shlex.quote(str(sheet.text.path))} > parted.txt"
        return Fault(message, sheet.text.path, line, advice=advice)
    if not row:
        message, advice = "there is a header but no row of numbers below it", "Export the raw data too"
    else:
        message = f"the names are not understood as those of the {width} columns of numbers that begin in line {row}"
        advice = (
            f"Say of each column by its number what it is, and its unit, for example {SAID_BY_NUMBER}; or write names such as "
            f'{EXAMPLE["time"]}", "{EXAMPLE["displacement"]}", "{EXAMPLE["force"]}", "{EXAMPLE["capacitance"]}"'
        )
    return Fault(message, sheet.text.path, sheet.header_line, advice=advice)


def _cells_of(sheet: Sheet, start: int) -> list[list[str]]:
    """Cells of every line from `start` on; faults for quotation marks that are not closed."""
    text, delimiter = sheet.text, sheet.delimiter
    lines = list(text.lines[start:])
    if delimiter == " ":
        return [split_blanks(line) for line in lines]
    if not any('"' in line for line in lines):
        return [line.split(delimiter) for line in lines]
    last = max((i for i, line in enumerate(lines) if line.strip()), default=-1)
    if last >= 0 and not text.ended and lines[last].count('"') % 2:
        lines[last] += '"'  # the file ends within this row, which is then left out
    check_quotes(text, delimiter, start, lines)
    try:
        return list(csv.reader(lines, delimiter=delimiter, skipinitialspace=True))
    except csv.Error as error:
        raise InputError(
            Fault(f"the rows cannot be cut into cells: {error}", text.path, advice="Export the file again")
        ) from None


@dataclass(frozen=True)
class _Block:
    """Rows below one header: its 1-based line, label, places of its rows, units below it and their line (None without)."""

    line: int
    label: str
    rows: list[int]
    units: tuple[str, ...] | None = None
    units_line: int | None = None


def _blocks(
    sheet: Sheet, rows: list[list[str]], start: int, keys: Sequence[int]
) -> tuple[list[_Block], list[str], list[Unread]]:
    """Rows of numbers below each standing of the header; lines of text below a block are left out, among its rows refused."""
    text, names = sheet.text, list(sheet.names)
    header = split_line(text.lines[sheet.header_line - 1], sheet.delimiter) if sheet.header_line else []
    first_units = sheet.units if sheet.units_line is not None else None
    blocks = [_Block(sheet.header_line, _numbered(header), [], first_units, sheet.units_line)]
    faults: list[Fault] = []
    apart: list[int] = []  # lines of text since the last row
    among_text: list[int] = []
    passed: list[int] = []
    run_on: list[int] = []  # indices of lines across which clock and press run on
    below: list[str] = []
    unread: list[Unread] = []
    skip_units = False
    # Indices of the last lines that hold something, the very last first.
    last = [*islice((k for k in range(len(rows) - 1, -1, -1) if any(c.strip() for c in rows[k])), LINES_OF_RESULTS)]
    head = _of_a_head(rows, [kind_of_line(row, header, keys, len(names)) for row in rows[:_LONGEST_HEAD]])
    for i, row in enumerate(rows):
        if not any(c.strip() for c in row):
            continue
        if says_nothing(row, len(names)):
            passed.append(start + i)
            continue
        of_page = _begins_with_a_word(row) and _NUMBER_OF_PAGE.search(" ".join(" ".join(row).split())) is not None
        kind = "text" if i < head or of_page else kind_of_line(row, header, keys, len(names))
        if skip_units:
            skip_units = False
            own = [unit_cell(c) for c in row]
            if all(cell is not None for cell in own):
                units = tuple("" if cell is None else cell.unit for cell in own)
                blocks[-1] = replace(blocks[-1], units=units, units_line=start + i + 1)
                continue
        if kind == "header":
            if apart and not blocks[-1].rows:
                line = start + apart[0] + 1
                message = (
                    f'"{text.lines[line - 1].strip()[:80]}" stands where the rows of the header in line {blocks[-1].line} begin'
                )
                raise InputError(Fault(message, text.path, line, 1, advice="Remove the line, or that header"))
            among_text += apart
            blocks.append(_Block(start + i + 1, _numbered(row), []))
            above = units_in_row(rows[apart[-1]], names) if apart else None
            if above is not None:
                blocks[-1] = replace(blocks[-1], units=above, units_line=start + apart[-1] + 1)
            apart, skip_units = [], sheet.units_line is not None and sheet.units_line > sheet.header_line
        elif kind == "text":
            late = i >= last[-1]
            other = is_other_header(row) or (late and _heads_results(sheet, rows, i, blocks[-1].rows))
            if other and _numbers_below(rows, i):
                _check_other_units(sheet, row, start + i)
                below = _another_table(sheet, rows, i, start)
                unread = not_read(sheet, range(start + i, start + last[0] + 1), "another table", words=False)
                break
            results = late and only_results(sheet, rows, i, blocks[-1].rows, keys)
            if results and not (i + 1 < len(rows) and _heads_results(sheet, rows, i + 1, blocks[-1].rows)):
                first = (apart or [i])[0]
                shown = text.lines[start + first].strip()[:80]
                below = [f'results below the rows are left out, from "{shown}" (line {start + first + 1}) on']
                unread = not_read(sheet, range(start + first, start + last[0] + 1), "results below the rows", words=False)
                apart = []
                break
            apart.append(i)
        else:
            remarks = [k for k in apart if _is_remark(text.lines[start + k])]
            if blocks[-1].rows:
                faults += [_of_scale(text, start + k) for k in remarks if speaks_of_scale(text.lines[start + k])]
            if remarks and blocks[-1].rows:
                among_text += remarks
                apart = [k for k in apart if k not in remarks]
            numbers = next((k for k in apart if _is_of_numbers(text.lines[start + k])), None)
            if numbers is not None and blocks[-1].rows:
                raise InputError(_other_names_needed(sheet, start + numbers))
            lone = text.lines[start + apart[0]] if len(apart) == 1 and len(run_on) < _REMARKS else ""
            if lone and blocks[-1].rows and _runs_on(sheet, rows, lone, blocks[-1].rows, i):
                among_text += apart
                run_on.append(start + apart[0])
                apart = []
            if apart and blocks[-1].rows:
                faults += [
                    Fault(
                        f'"{text.lines[start + k].strip()[:80]}" stands among the rows',
                        text.path,
                        start + k + 1,
                        1,
                        advice="If a zero was set anew there, write # before it, and rows of one zero are used together; "
                        "else remove the line"
                        if speaks_of_zero(text.lines[start + k])
                        else _ANOTHER_RUN,
                    )
                    for k in apart
                ]
            elif apart:
                among_text += apart
            apart = []
            blocks[-1].rows.append(i)
    if faults:
        raise InputError(capped(faults, "rows cannot be read"))
    among_text += apart
    lines = [start + i for i in sorted(among_text)]
    require_no_other_rows(sheet, lines, sum(len(b.rows) for b in blocks))
    if run_on:
        shown = f'"{text.lines[run_on[0]].strip()[:80]}" in line {run_on[0] + 1}'
        others = f" and {len(run_on) - 1} more line(s) are taken for remarks" if len(run_on) > 1 else " is taken for a remark"
        below.append(f"{shown}{others}: time goes on across it at its pace, and so do the readings")
    return blocks, [*left_out(sheet, lines), *passed_over(sheet, passed), *below], [*not_read(sheet, lines, "text"), *unread]


def _runs_on(sheet: Sheet, rows: list[list[str]], line: str, above: Sequence[int], first: int) -> bool:
    """Whether a line of words, of no run or specimen, stands among rows that go on: those `above`, and from `first` on."""
    if SPECIMEN.search(line) or _RUN.search(line) or not is_only_words(line):
        return False
    quantities = {i: h.quantity for i, h in sheet.headings.items() if h.quantity != "status"}
    key = min(quantities)
    below = takewhile(lambda row: key < len(row) and is_reading(row[key]), rows[first : first + _BESIDE])
    return runs_on(
        quantities,
        [rows[k] for k in above[-_BESIDE:]],
        list(below),
        lambda k: [row[k] for row in rows if k < len(row)],
        sheet.declared_decimal,
    )


def _of_a_head(rows: Sequence[Sequence[str]], kinds: Sequence[str]) -> int:
    """The number of lines above the first row that begins without a word, if one of them is text: `"HOffset",0,0` is no row."""
    n = next((i for i, row in enumerate(rows) if any(c.strip() for c in row) and not _begins_with_a_word(row)), 0)
    return n if n <= _LONGEST_HEAD and "text" in kinds[:n] and "header" not in kinds[:n] else 0


def _begins_with_a_word(row: Sequence[str]) -> bool:
    first = row[0].strip() if row else ""
    return first[:1].isalpha() and not (is_missing(first) or is_over_range(first) or is_clock(first))


def _is_of_numbers(line: str) -> bool:
    """Whether a line holds several numbers and nothing else, however they are parted."""
    cells = [c for c in re.split(r"[\t;,|\s]+", line.strip()) if c]
    return len(cells) > 2 and all(map(is_numeric, cells))


def require_no_other_rows(sheet: Sheet, indices: Sequence[int], n_row: int) -> None:
    """Refuse rows of numbers among lines taken for text or for one cell, as where others part their cells, unless they are few.

    Parameters
    ----------
    sheet : their file.
    indices : of the lines in the file, from 0.
    n_row : rows that were read.

    Raises
    ------
    InputError
        If there are ten or more, or two that are a twentieth of the rows.
    """
    width = n_named(sheet)
    found = [
        i for i in indices if any(_is_row_between(sheet.text.lines[i], d, width) for d in DELIMITERS if d != sheet.delimiter)
    ]
    if len(found) < 2 or (len(found) < FEW_ROWS and len(found) < _FEW_OTHERWISE * n_row):
        return
    line = sheet.text.lines[found[0]].strip()
    message = (
        f'"{line[:60]}" and {len(found) - 1} more line(s) are rows of numbers whose cells are parted otherwise than those of '
        "the rows above"
    )
    advice = "Write one delimiter between the cells of all rows, or save the rows of each in a file of their own"
    raise InputError(Fault(message, sheet.text.path, found[0] + 1, advice=advice))


def _is_row_between(line: str, delimiter: str, width: int) -> bool:
    """Whether a line has as many numbers between delimiters as there are columns, and nothing else."""
    cells = split_line(line.strip(), delimiter)
    return (
        _ONE_NUMBER.fullmatch(line.strip()) is None
        and width > 1
        and len(cells) == width
        and all(is_numeric(c) or is_clock(c) for c in cells)
    )


def _other_names_needed(sheet: Sheet, at: int) -> Fault:
    """The refusal of rows that the line taken for the header does not part into cells, so that some seem to be text."""
    header = sheet.text.lines[sheet.header_line - 1].strip()[:60] if sheet.header_line else ""
    n_cell = len([c for c in re.split(r"[\t;,|\s]+", sheet.text.lines[at].strip()) if c])
    return Fault(
        f'"{sheet.text.lines[at].strip()[:80]}" is a row of numbers, and "{header}", taken for the header, names no such',
        sheet.text.path,
        at + 1,
        advice=f"Write one line of names with units above the rows, one for each of their {n_cell} cells, as in "
        '"Displacement (mm),Force (N)" of two, in the place of the lines there',
    )


# Rows on either side of a line that show whether clock and press run on across it, and how many such lines are looked at.
_BESIDE, _REMARKS = 10, 20
# Rows whose cells are parted otherwise are fewer than this share of the others, or refused.
_FEW_OTHERWISE = 0.05
# A number by itself, its thousands set apart by blanks.
_ONE_NUMBER = re.compile(r"[-+]?\d{1,3}(?: \d{3})*(?:[.,]\d+)?|[-+]?\d+[.,]\d+(?:[eE][-+]?\d+)?")
# "Status: Running" among the rows, as testers write it.
_STATUS = re.compile(
    r"[\W_]*(?:test |machine )?(?:status|state|zustand|statut|état|estado|stato|stan)\s*[:=]\s*(?P<words>[^\d,;\t]+)", re.I
)
# "--- unloading ---".
_BETWEEN_DASHES = re.compile(r"[-=*~#>]{2,}\s*(?P<words>[^\W\d_][^\d,;\t]*?)\s*[-=*~#<]*")
# "Page 2 of 3", as a program writes it that prints a table.
_PAGE = re.compile(
    r"[-=*~\s]*(?:page|seite|página|pagina|pág\.?|strona|sida|side|страница|стр\.?|第)\s*\d+\s*"
    r"(?:(?:of|von|de|di|sur|z|av|из|/)\s*\d+|页|頁|ページ)?[-=*~\s]*",
    re.IGNORECASE,
)
# The same at the end of a line that stands on every page.
_NUMBER_OF_PAGE = re.compile(rf"(?<![^\W_]){_PAGE.pattern}$", re.IGNORECASE)
# A line that numbers or names a run, of another ball or specimen for all that it says.
_RUN = re.compile(
    r"(?<![^\W_])(?:run|test|trial|experiment|versuch|messung|muster|serie|series|batch|essai|mesure|ensayo|prova|próba|pomiar|"
    r"опыт|образец|测试|试验|測定|試験)\s*(?:no\.?|nr\.?|#|:)?\s*(?:\d+|[a-z])(?![^\W_])",
    re.IGNORECASE,
)
# A line that is nothing but a name with a number: "# S2", "# sensor B7", "File: press_02.csv".
_NAME_ALONE = re.compile(
    r"[#%/;*\s\"']*(?:[a-z]{1,3}[ _-]?\d{1,3}|(?:sensors?|capteur|balls?|kugel|electrode|elektrode|spot|pad|taxel|channel)"
    r"\s*(?:no\.?|nr\.?|#|:|=)?\s*[a-z]{0,3}[ _-]?\d{1,3}|(?:file|filename|datei|fichier|archivo)\s*[:=]\s*\S.*)[\s,;\"'=-]*",
    re.IGNORECASE,
)
# So much of a remark is looked at.
_LONGEST_REMARK = 200
_ANOTHER_RUN = (
    "If the rows below it are of another press or specimen, save them in a file of their own; if they go on, remove the line"
)


def _is_remark(line: str) -> bool:
    """Whether a line of text among the rows changes nothing of them.

    Such are a comment that names no specimen or run, a tester's status, what it does between dashes, a word alone
    that the ball turns or waits, and the number of a page.
    """
    plain = line.strip().strip(",;\t")
    if plain.strip(' "').lower() in TURNS:
        return True
    status = _STATUS.fullmatch(plain) or _BETWEEN_DASHES.fullmatch(plain)
    if status is not None:
        return all(w in OF_TESTERS for w in re.split(r"[\W_]+", status["words"].lower()) if w)
    return _PAGE.fullmatch(plain) is not None or (is_comment(line) and not _names_another(line) and not changes_the_rig(line))


def _names_another(line: str) -> bool:
    """Whether a line may name another specimen, sensor, file or run."""
    return bool(SPECIMEN.search(line) or _RUN.search(line) or _NAME_ALONE.fullmatch(line[:_LONGEST_REMARK]))


# What was changed for another, in either order of the words.
_CHANGED = (
    r"new|changed?|another|other|next|different|replaced|exchanged|swapped|neue[rsmn]?|andere[rsmn]?|nächste[rsmn]?|"
    r"gewechselt|getauscht|ausgetauscht|nouve(?:au|lle)|autre|chang[ée]e?|remplacée?|nuev[oa]|otr[oa]|cambiad[oa]|cambio de|"
    r"reemplazad[oa]|nuov[oa]|altr[oa]|cambiat[oa]|sostituit[oa]|nov[oa]|outr[oa]|trocad[oa]|nieuwe?|vervangen|nowy|nowa|inn[ay]"
)
_OF_RIG = (
    r"specimens?|samples?|test ?pieces?|sensors?|balls?|indenters?|tips?|probe[ns]?|prüfling|prüfkörper|kugel|stempel|"
    r"eindringkörper|éprouvette|échantillon|capteur|bille|poinçon|probeta|muestra|bola|punta|provino|campione|sfera|"
    r"amostra|esfera|monster|kogel|próbka|kulka|electrodes?|elektroden?|électrodes?|electrodos?|elettrod[oi]|"
    r"press(?:es)?|spots?|stelle"
)
_CHANGE_OF_RIG = re.compile(
    rf"(?<![^\W_])(?:(?:{_CHANGED})(?:\W+\w+)?\W+(?:{_OF_RIG})|(?:{_OF_RIG})\W+(?:\w+\W+)?(?:{_CHANGED}))(?![^\W_])"
    r"|(?:新|换|換|更换|交換|別の).{0,3}(?:试样|試験片|サンプル|样品|球|传感器|センサ)"
    rf"|(?<![^\W_])(?:moved|shifted|verschoben|déplacée?|movid[oa]|spostat[oa])(?:\W+\w+)?\W+(?:{_OF_RIG})(?![^\W_])"
    rf"|(?<![^\W_])(?:{_OF_RIG})(?![^\W_])[^.;]{{0,20}}(?:->|→|=>)",
    re.IGNORECASE,
)


def changes_the_rig(text: str) -> bool:
    """Whether words say that another specimen, sensor or ball was put in.

    Parameters
    ----------
    text : of a line or a cell.

    >>> [changes_the_rig(words) for words in ("# changed sample", "new ball 8 mm", "neue Probe", "sample touched", "hold")]
    [True, True, True, False, False]
    """
    return _CHANGE_OF_RIG.search(text[:_LONGEST_REMARK]) is not None


def _of_scale(text: LabText, at: int) -> Fault:
    return Fault(
        f'"{text.lines[at].strip()[:80]}" stands among the rows, and may say that those below are in another unit or range',
        text.path,
        at + 1,
        1,
        advice="If they are, write all rows in one unit, or save the rows of each unit in a file of their own; if it means "
        "nothing, remove the line",
    )


def _check_other_units(sheet: Sheet, row: Sequence[str], at: int) -> None:
    """Refuse a header below the rows that names the same quantities as that of the record: it goes on in other units."""
    own = {h.quantity for i, name in enumerate(sheet.names) if (h := understand(name, sheet.unit_below(i))) is not None}
    other = {h.quantity for c in row if (h := understand(c.strip())) is not None}
    if len(own) > 1 and own <= other and len(row) == len(sheet.names):
        shown = sheet.text.lines[at].strip()[:80]
        raise InputError(
            Fault(
                f'"{shown}" stands among the rows, and names the columns otherwise than the header in line {sheet.header_line}',
                sheet.text.path,
                at + 1,
                advice="Write all rows in the columns and units of one header, or save those below each in a file of their own",
            )
        )


def _numbers_below(rows: list[list[str]], at: int) -> bool:
    below = [r for r in rows[at + 1 : at + 5] if any(c.strip() for c in r)][:2]
    return any(sum(is_numeric(c) for c in r) >= 2 for r in below)


def _heads_results(sheet: Sheet, rows: list[list[str]], at: int, above: Sequence[int]) -> bool:
    """Whether a line of words names a few rows at the end of the file that do not go on from the record, behind a blank line.

    Parameters
    ----------
    sheet : the record, whose names are others.
    rows : cells of every line.
    at : which line.
    above : lines of the rows of the record.
    """
    cells = [c.strip() for c in rows[at] if c.strip()]
    filled_below = (rows[k] for k in range(at + 1, len(rows)) if any(c.strip() for c in rows[k]))
    below = list(islice(filled_below, FEW_ROWS))
    if not above or len(cells) < 2 or not 0 < len(below) < FEW_ROWS:
        return False
    time = next((i for i, h in sheet.headings.items() if h.quantity == "time"), None)
    apart = any(not any(c.strip() for c in r) for r in rows[above[-1] + 1 : at])
    words = not any(is_numeric(c) or is_clock(c) or is_missing(c) or is_over_range(c) for c in cells)
    if time is None or not (apart and words) or SPECIMEN.search(" ".join(cells[1:])) or set(cells) & set(sheet.names):
        return False
    filled = [[c for c in r if c.strip()] for r in below]
    numbered = len(cells) + (not rows[at][0].strip())  # rows may be numbered in a column without a name
    if any(len(r) not in (len(cells), numbered) or not any(map(is_numeric, r)) for r in filled):
        return False
    last, first = (_number_of(sheet, r, time) for r in (rows[above[-1]], below[0]))
    return last is not None and (first is None or first < last) and len(below) < len(above)


def _number_of(sheet: Sheet, row: Sequence[str], index: int) -> float | None:
    """The number in a cell of a row, None where there is none."""
    cell = row[index] if index < len(row) else ""
    marks = (sheet.declared_decimal,) if sheet.declared_decimal else (".", ",")
    return next((n for mark in marks if (n := parse_number(cell, mark)) is not None), None)


def _another_table(sheet: Sheet, rows: list[list[str]], at: int, start: int) -> list[str]:
    """The note on a table of results below the record; a long one is refused."""
    n = sum(1 for r in rows[at + 1 :] if sum(map(is_numeric, r)) >= 2)
    line = start + at + 1
    if n >= FEW_ROWS:
        raise InputError(
            Fault(
                f"another table with other columns begins here, with {n} rows",
                sheet.text.path,
                line,
                advice="Save one record per file",
            )
        )
    return [f"a table of {n} row(s) from line {line} on left out"]


#: Words by which a line or a name speaks of a specimen.
SPECIMEN = re.compile(
    r"specimen|sample|test ?piece|probe\b|prüfling|prüfkörper|éprouvette|échantillon|probeta|muestra|试样|試験片|サンプル", re.I
)


def _numbered(header: Sequence[str]) -> str:
    """The specimen whose number stands in the first cell of a header."""
    return f"specimen {header[0].strip()}" if header and header[0].strip().isdecimal() else ""


def _label(sheet: Sheet, header: int) -> str:
    """The nearest line above a header that names a specimen, a sensor, a file or a run, within eight lines."""
    for line in reversed(sheet.text.lines[max(header - 8, 0) : max(header, 0)]):
        if _names_another(line):
            named = re.sub(r"[\t;,]+", " ", line.replace('"', "")).strip()
            return _NUMBER_OF_PAGE.sub("", named)[:60]
    return ""


def _one_specimen(
    sheet: Sheet,
    blocks: list[_Block],
    rows: list[list[str]],
    reading: Reading,
) -> tuple[list[int], list[str], int]:
    """Rows of the specimen asked for, and how many there are: all blocks if the record only repeats its header, else one."""
    if len(blocks) == 1:
        return blocks[0].rows, [], 1
    if _time_goes_on(sheet, blocks, rows):
        _check_same_units(sheet, blocks)
        note = f"the header stands {len(blocks)} times; time goes on from block to block: one record"
        return [i for b in blocks for i in b.rows], [note], 1
    listed = "; ".join(
        f"{k}: {b.label + ', ' if b.label else ''}header at line {b.line}, {len(b.rows)} rows" for k, b in enumerate(blocks, 1)
    )
    if reading.specimen is None:
        raise which_specimen(sheet, f"the file holds {len(blocks)} specimens ({listed})", len(blocks))
    if not 1 <= reading.specimen <= len(blocks):
        raise which_specimen(sheet, f"there is no specimen {reading.specimen} ({listed})", len(blocks))
    block = blocks[reading.specimen - 1]
    note = f"specimen {reading.specimen} of {len(blocks)}: {block.label or f'header at line {block.line}'}"
    return block.rows, [note], len(blocks)


def _check_same_units(sheet: Sheet, blocks: Sequence[_Block]) -> None:
    """Refuse blocks of one record in other units."""
    other = next((b for b in blocks if b.units is not None and sheet.units and b.units != sheet.units), None)
    if other is not None:
        raise InputError(
            Fault(
                f"the units of this block differ from those in line {sheet.units_line}, and time goes on from block to block",
                sheet.text.path,
                other.units_line,
                advice="Write all rows of the record in the same units, or save the blocks in files of their own",
            )
        )


def _time_goes_on(sheet: Sheet, blocks: list[_Block], rows: list[list[str]]) -> bool:
    time = next((i for i, h in sheet.headings.items() if h.quantity == "time"), None)
    if time is None or any(b.label not in ("", blocks[0].label) for b in blocks):
        return False

    ends = [(_number_of(sheet, rows[b.rows[0]], time), _number_of(sheet, rows[b.rows[-1]], time)) for b in blocks]
    return all(last is not None and first is not None and first > last for (_, last), (first, _) in pairwise(ends))


def _with_whole_remarks(rows: list[list[str]], width: int, delimiter: str) -> list[list[str]]:
    """The rows, with a remark in their last cell put together where delimiters within it cut it: "max; unload" in two.

    The last column is one of text, and the cells before it are numbers where those of the other rows are.
    """
    if width < 2 or delimiter == " " or all(len(row) <= width for row in rows):
        return rows
    fitting = [row for row in rows if len(row) == width]
    last = {cell.strip() for cell in (row[-1] for row in fitting)} - {""}
    if not fitting or any(map(is_reading, last)):
        return rows
    numbers = [k for k in range(width - 1) if 2 * sum(is_reading(row[k]) for row in fitting) > len(fitting)]
    whole: list[list[str]] = []
    for row in rows:
        surplus = [c.strip() for c in row[width - 1 :]]
        cut = len(row) > width and all(is_reading(row[k]) for k in numbers) and not any(map(is_reading, surplus))
        cut = cut and any(surplus[0]) and any(surplus[1:])
        whole.append([*row[: width - 1], f"{delimiter} ".join(surplus)] if cut else row)
    return whole


# Lines between a header and its rows are no more than this.
_LONGEST_HEAD = 40
# Rows with a remark behind their last cell are fewer than this share.
_FEW_BESIDE = 0.25
# What may be a reading, with its unit or cut, or a factor of one.
_LIKE_A_NUMBER = re.compile(r"[\W_]*[x×]?\s?\d", re.IGNORECASE)


def _remarks_beside(rows: Sequence[Sequence[str]], width: int, delimiter: str) -> dict[int, str]:
    """The words behind the last cell of a few rows that are wider than the header: row -> words.

    None if one of them may be a reading, its unit or its factor, or if the cells under the names in one of these rows are not
    readings where those of the other rows are, and no others: they may be moved by a place.
    """
    fitting = [row for row in rows if len(row) == width or not any(c.strip() for c in row[width:])]
    wide = {i: [c.strip() for c in row[width:] if c.strip()] for i, row in enumerate(rows) if len(row) > width}
    wide = {i: words for i, words in wide.items() if words}
    if len(wide) > _FEW_BESIDE * len(rows):
        return {}
    usual = [2 * sum(is_reading(row[k]) for row in fitting if k < len(row)) > len(fitting) for k in range(width)]
    for i, words in wide.items():
        if any(_LIKE_A_NUMBER.match(w) or is_missing(w) or is_over_range(w) or looks_like_unit(w) for w in words):
            return {}
        if not any(usual) or any(is_reading(cell) != reading for cell, reading in zip(rows[i], usual, strict=False)):
            return {}
    return {i: f"{delimiter.strip()} ".join(words) for i, words in wide.items()}


_MOVED = (
    "Take the empty cell away if the others then go on from those of the rows beside them, or remove the row; where all rows "
    "begin so, put an empty cell before the names"
)


def _fits_once_moved(row: Sequence[str], width: int) -> bool:
    """Whether a row that is too wide begins with an empty cell, without which it has a cell for each name."""
    return (
        not row[0].strip()
        and bool(row[1].strip())
        and bool(row[width].strip())
        and not any(c.strip() for c in row[width + 1 :])
    )


# Rows with a stray empty cell are fewer than this share of the full ones.
_FEW_STRAY = 0.05
# Of all rows more than such a share have a cell more than the header.
_MOSTLY_WIDER = 0.5
#: What the reason says of such a row.
OF_STRAY = "one of them empty"


def _with_a_stray_cell(rows: Sequence[Sequence[str]], width: int, delimiter: str) -> dict[int, str]:
    """Single rows with a cell too many, one of them empty within the row, where others are full: row -> why it is left out."""
    if delimiter == " ":
        return {}
    stray = [
        i
        for i, row in enumerate(rows)
        if len(row) == width + 1 and bool(row[0].strip()) and bool(row[-1].strip()) and [c.strip() for c in row].count("") == 1
    ]
    n_full = sum(len(row) == width and all(map(str.strip, row)) for row in rows)
    if len(stray) > _FEW_STRAY * n_full:
        return {}
    return dict.fromkeys(stray, f"{width + 1} cells, {OF_STRAY}, where most rows have {width}")


def _all_options(sheet: Sheet, widest: int) -> str:
    """The options that say what every column is and its unit; with numbers where as many names as are too many say nothing."""
    named = n_needed(sheet)
    strange = [i for i in range(named) if i not in sheet.headings]
    known = len(strange) == named - widest
    said: dict[str, str] = {}
    for index, heading in sheet.headings.items():
        quantity, behind = stands_for(heading.quantity), sheet.names[index + 1 : index + 2]
        unit = sheet.unit_written(index) or next((name for name in behind if is_unit_of(name, quantity)), "...")
        number = index + 1 - sum(i < index for i in strange) if known else "..."
        if quantity in RECORDED:
            said.setdefault(quantity, f"--columns {quantity}={number} --units {quantity}={unit}")
    return " ".join(said.values()) or "--columns force=... --units force=..."


def _words_among(rows: Sequence[Sequence[str]], width: int) -> dict[int, int]:
    """Rows with a cell too many, one of them a word without which the others are numbers where those of the full rows are."""
    wide = [i for i, row in enumerate(rows) if len(row) == width + 1 and row[-1].strip()]
    full = [row for row in rows if len(row) == width][:_SAMPLE] if wide else []
    if not full:
        return {}
    usual = [2 * sum(is_reading(row[k]) for row in full) > len(full) for k in range(width)]
    found: dict[int, int] = {}
    for i in wide:
        row = rows[i]
        words = [
            k for k, cell in enumerate(row) if cell.strip() and not is_reading(cell) and not _LIKE_A_NUMBER.match(cell.strip())
        ]
        at = [k for k in words if all(map(_fits, [*row[:k], *row[k + 1 :]], usual))]
        if len(at) == 1:
            found[i] = at[0]
    return found


def _fits(cell: str, reading: bool) -> bool:
    """Whether a cell is empty, or a number where one is due and none where a word is."""
    return not cell.strip() or is_reading(cell) == reading


def _word_among(sheet: Sheet, words: Sequence[tuple[int, str, int]], width: int) -> Fault:
    """The fault of rows in which a word stands among the readings: line, word and column of each."""
    line, word, index = words[0]
    others = [str(of) for of, _, _ in words[1:]]
    named = ", ".join(others[:_LINES_NAMED]) + (
        f" and {len(others) - _LINES_NAMED} others" if len(others) > _LINES_NAMED else ""
    )
    also = f" (and so in line{'s' if len(others) > 1 else ''} {named})" if others else ""
    cells, them, whole = ("these cells", "them", "these rows") if others else ("this cell", "it", "this row")
    behind = index == width
    place = "behind its readings" if behind else "among its readings"
    moved = "Write" if behind else f"Move {them} behind the last reading and write"
    return Fault(
        f'the row has {width + 1} cells, the header has {width}: "{word.strip()[:40]}" stands {place}{also}',
        sheet.text.path,
        line,
        index + 1,
        advice=f"{moved} one more name at the end of the header, such as Remark; or take {cells} away, or {whole} out",
    )


# Rows with as many cells as the header that show which of them are numbers; lines named beside the first.
_SAMPLE, _LINES_NAMED = 200, 4

# A line of one cell among rows of several, as a count below them, is left out as a row that lacks cells is, if few are.
_FEW_LONE, _SHARE_LONE = 3, 0.01


def _check_width(sheet: Sheet, rows: list[list[str]], lines: IntArray, width: int) -> None:
    faults = []
    named = n_needed(sheet)
    widest = max(map(len, rows), default=0)
    if widest < named:
        # A cell too many among the names moves all columns behind it.
        raise InputError(
            Fault(
                f"the header names {named} columns, no row has more than {widest} cells",
                sheet.text.path,
                sheet.named_at,
                widest + 1,
                advice="Which names belong to which cells cannot be told: correct the header, or say of every column, by its "
                f"number, what it is and its unit: {_all_options(sheet, widest)}",
            )
        )
    cut_number = thousands_in(rows, width, sheet.delimiter)
    if sheet.header_line and cut_number:
        wide = next(i for i, row in enumerate(rows) if len([c for c in row if c.strip()]) > width)
        message = f'the row has {len(rows[wide])} cells, the header has {width}, and "{cut_number}" may be one number'
        at = int(lines[wide])
        raise InputError(Fault(message, sheet.text.path, at, advice=thousands_advice(cut_number, sheet.delimiter)))
    wider_by_one = [len(row) == width + 1 and bool(row[0].strip()) and bool(row[-1].strip()) for row in rows]
    if sheet.header_line and sum(wider_by_one) > _MOSTLY_WIDER * len(rows):
        wider = wider_by_one.index(True)
        raise InputError(
            Fault(
                f"the row has {width + 1} cells, the header has {width}, as in most rows: which name belongs to which cell "
                "cannot be told",
                sheet.text.path,
                int(lines[wider]),
                width + 1,
                advice="Write a name for each cell into the header: at its beginning, such as No, if the first cell of a row "
                "is its number; at its end, such as Other, if the last cell is none of the columns that are named"
                + ("; if the decimal mark is a comma, export with semicolons between the columns" * (sheet.delimiter == ",")),
            )
        )
    lone = sum(len(row) == 1 for row in rows)
    are_few = lone <= max(_FEW_LONE, int(_SHARE_LONE * len(rows)))
    among = _words_among(rows, width)
    if among:
        faults.append(_word_among(sheet, [(int(lines[i]), rows[i][k], k) for i, k in among.items()], width))
    for i, (row, line) in enumerate(zip(rows, lines.tolist(), strict=True)):
        if i not in among and len(row) > width and any(c.strip() for c in row[width:]):
            if _fits_once_moved(row, width):
                faults.append(
                    Fault(
                        "the row begins with an empty cell, behind which its cells stand one column further to the right than "
                        "the names",
                        sheet.text.path,
                        line,
                        1,
                        advice=_MOVED,
                    )
                )
                continue
            advice = (
                "If the decimal mark is a comma too, export with semicolons between the columns"
                if sheet.delimiter == ","
                else "Remove what does not belong to the table"
            ) + "; if the first cell is the number of the row, give it a name in the header, such as No"
            if len(row) >= 2 * width - 1:
                advice = (
                    "If two lines have run together, write each on its own, or remove this one; "
                    + advice[0].lower()
                    + advice[1:]
                )
            faults.append(
                Fault(f"the row has {len(row)} cells, the header has {width}", sheet.text.path, line, width + 1, advice=advice)
            )
        elif sheet.delimiter == " " and len(row) < width and not (are_few and len(row) == 1):
            # Blanks cannot hold an empty cell's place.
            faults.append(
                Fault(
                    f"the row has {len(row)} cells between blanks, the header has {width}",
                    sheet.text.path,
                    line,
                    advice="Remove the line if it is none of the readings; if a cell is missing, export with semicolons or "
                    "tabs between the columns",
                )
            )
    if faults and sheet.delimiter == " " and len(faults) == 1 and lines[-1] == faults[0].line and not sheet.text.ended:
        return  # the file ends within its last row
    if faults:
        raise InputError(capped(faults, "rows cannot be read"))

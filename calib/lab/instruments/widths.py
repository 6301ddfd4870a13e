"""Rows that have more or fewer cells than the header has names: what is one too many, or why it cannot be told."""

from __future__ import annotations

import re
from collections.abc import Sequence

from calib.errors import Fault, InputError, capped
from calib.lab.instruments.clock_cells import is_reading
from calib.lab.instruments.labtable import IntArray
from calib.lab.instruments.lines import n_needed
from calib.lab.instruments.numbers import is_missing, is_over_range
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.torn import thousands_advice, thousands_in
from calib.lab.instruments.units import RECORDED, is_unit_of, looks_like_unit, stands_for

# Rows with a remark behind their last cell are fewer than this share.
_FEW_BESIDE = 0.25
# What may be a reading, with its unit or cut, or a factor of one.
_LIKE_A_NUMBER = re.compile(r"[\W_]*[x×]?\s?\d", re.IGNORECASE)
# Rows with a stray empty cell are fewer than this share of the full ones.
_FEW_STRAY = 0.05
# Of all rows more than such a share have a cell more than the header.
_MOSTLY_WIDER = 0.5
#: What the reason says of such a row.
OF_STRAY = "one of them empty"
# Rows with as many cells as the header that show which of them are numbers; lines named beside the first.
_SAMPLE, _LINES_NAMED = 200, 4
# A line of one cell among rows of several, as a count below them, is left out as a row that lacks cells is, if few are.
_FEW_LONE, _SHARE_LONE = 3, 0.01
_MOVED = (
    "Take the empty cell away if the others then go on from those of the rows beside them, or remove the row; where all rows "
    "begin so, put an empty cell before the names"
)


def with_whole_remarks(rows: list[list[str]], width: int, delimiter: str) -> list[list[str]]:
    """The rows, with a remark in their last cell put together where delimiters within it cut it: "max; unload" in two.

    The last column is one of text, and the cells before it are numbers where those of the other rows are.

    Parameters
    ----------
    rows : cells of each row.
    width : number of names in the header.
    delimiter : between cells.
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


def remarks_beside(rows: Sequence[Sequence[str]], width: int, delimiter: str) -> dict[int, str]:
    """The words behind the last cell of a few rows that are wider than the header: row -> words.

    None if one of them may be a reading, its unit or its factor, or if the cells under the names in one of these rows are not
    readings where those of the other rows are, and no others: they may be moved by a place.

    Parameters
    ----------
    rows : cells of each row.
    width : number of names in the header.
    delimiter : between cells.
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


def _fits_once_moved(row: Sequence[str], width: int) -> bool:
    """Whether a row that is too wide begins with an empty cell, without which it has a cell for each name."""
    return (
        not row[0].strip()
        and bool(row[1].strip())
        and bool(row[width].strip())
        and not any(c.strip() for c in row[width + 1 :])
    )


def with_a_stray_cell(rows: Sequence[Sequence[str]], width: int, delimiter: str) -> dict[int, str]:
    """Single rows with a cell too many, one of them empty within the row, where others are full: row -> why it is left out.

    Parameters
    ----------
    rows : cells of each row.
    width : number of names in the header.
    delimiter : between cells.
    """
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


def check_width(sheet: Sheet, rows: list[list[str]], lines: IntArray, width: int) -> None:
    """Refuse rows whose cells cannot be told to belong to the names of the header.

    Parameters
    ----------
    sheet : the header and what is known of its names.
    rows : cells of each row.
    lines : (n_row,), line of each in the file.
    width : number of names in the header.

    Raises
    ------
    InputError
        If rows have more cells than there are names, or fewer where blanks part them, or if no row has a cell for each.
    """
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

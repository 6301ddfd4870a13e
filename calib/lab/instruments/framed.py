"""From rows in the frame of another notation, a wiki's table, a printed array, a word before each line, to the bare cells."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from calib.lab.instruments.numbers import is_missing, is_numeric

# The beginning of a table of a wiki, between its rows, and its title; none of them holds a cell.
_OF_WIKI = re.compile(r"\s*(?:\{\||\|\}|\|-|\|\+)")
# A row of an array as Python prints it: "[[ 0.0 0.1]", "[0.0, 0.1],".
_OF_ARRAY = re.compile(r"\s*\[{1,2}(?P<cells>[^\[\]]*)\]{1,2}[,;)]*\s*")
_LETTERS = re.compile(r"[^\W\d_]+")
# What may stand before names: "columns: t [s], F [N]".
_SAYS_COLUMNS = re.compile(
    r"\s*[#%/]*\s*(?:columns?|fields?|header|names|spalten|colonnes|columnas|colonne)\s*[:=]\s*", re.IGNORECASE
)
# The line of types below the names of a table that R prints.
_TYPES = re.compile(r"\s*<(?:dbl|int|chr|lgl|dttm|fct|date|time|num)>(?:\s+<(?:dbl|int|chr|lgl|dttm|fct|date|time|num)>)+\s*")
# A word and a colon before the cells of a line, and before several numbers.
_WORD = re.compile(r"\s*(?P<word>[^\W\d_][\w-]{0,15})\s*:\s*(?P<cells>.+)")
_NUMBERS = re.compile(r"[-+]?[\d.][\d.:eE+-]*\s*[,;\t|\s]\s*[-+]?[\d.].*")
# The fewest rows, and which share of the lines are so.
_FEWEST, _NEARLY_ALL = 5, 0.9


def of_tracker(lines: Sequence[str]) -> list[str]:
    """The lines of a table of an issue tracker, names between double strokes, with tabs between its cells; [] of any other.

    >>> of_tracker(["||t (s)||F (N)||", *["|0.0|0.1|"] * 5])[:2]
    ['t (s)\\tF (N)', '0.0\\t0.1']
    """
    first = next((k for k, line in enumerate(lines) if line.strip().startswith("||")), len(lines))
    rows = [line.strip() for line in lines[first + 1 :] if line.strip()]
    if len(rows) < _FEWEST or sum(row[:1] == "|" == row[-1:] for row in rows) < _NEARLY_ALL * len(rows):
        return []
    framed = [
        line.strip() if line.strip()[:1] == "|" == line.strip()[-1:] and k >= first else "" for k, line in enumerate(lines)
    ]
    names = "\t".join(cell.strip() for cell in framed[first].strip("|").split("||")) if framed[first] else ""
    cells = ["\t".join(cell.strip() for cell in line[1:-1].split("|")) if line else "" for line in framed]
    bare = [own if line else old for own, line, old in zip(cells, framed, lines, strict=True)]
    return [names if k == first else line for k, line in enumerate(bare)] if names else []


def of_tibble(lines: Sequence[str]) -> list[str]:
    """The lines of a table as R prints it without that of the types of its columns; [] of any other.

    >>> of_tibble(["  t_s   F_N", "<dbl> <dbl>", "1 0.0 0.1"])
    ['  t_s   F_N', '', '1 0.0 0.1']
    """
    types = [_TYPES.fullmatch(line) is not None for line in lines]
    return ["" if of_types else line for line, of_types in zip(lines, types, strict=True)] if sum(types) == 1 else []


def of_wiki(lines: Sequence[str]) -> list[str]:
    """The lines of a table of a wiki with tabs between its cells, empty ones in the place of its marks; [] of any other text.

    >>> of_wiki(["{|", "! t (s) !! F (N)", "|-", "| 0.0 || 0.1", "|}"])
    ['', 't (s)\\tF (N)', '', '0.0\\t0.1', '']
    """
    first = next((line for line in lines if line.strip()), "")
    if not first.lstrip().startswith("{|") or sum(line.lstrip().startswith("|-") for line in lines) < 1:
        return []
    found = []
    for line in lines:
        plain = line.strip()
        if not plain or _OF_WIKI.match(plain):
            found.append("")
        elif plain[0] in "!|":
            found.append("\t".join(cell.strip() for cell in re.split(r"\|\||!!", plain[1:])))
        else:
            found.append(line)
    return found


def of_array(lines: Sequence[str]) -> list[str]:
    """The lines of a printed array without its brackets; [] where fewer than nearly all lines behind the first row are rows.

    >>> of_array(["columns: t [s], F [N]", "[[0.0 0.1]", *[" [0.1 0.2]"] * 4, " [0.2 0.3]]"])[:3]
    ['t [s], F [N]', '0.0 0.1', '0.1 0.2']
    """
    rows = [_cells_of(line) for line in lines]
    first = next((k for k, row in enumerate(rows) if row), len(lines))
    below = [row for line, row in zip(lines[first:], rows[first:], strict=True) if line.strip()]
    if sum(map(bool, below)) < max(_FEWEST, _NEARLY_ALL * len(below)):
        return []
    # Without names above each row is a line of one form, whose numbers are asked for.
    if not any(len(_LETTERS.findall(line)) >= len(rows[first]) for line in lines[:first]):
        return []
    bare = [" ".join(row) if row else line for line, row in zip(lines, rows, strict=True)]
    return [_SAYS_COLUMNS.sub("", line) if k < first else line for k, line in enumerate(bare)]


def _cells_of(line: str) -> list[str]:
    """The numbers of a row of an array; [] of any other line."""
    match = _OF_ARRAY.fullmatch(line)
    cells = re.split(r"[,;\s]+", match["cells"].strip(" ,;\t")) if match is not None else []
    return cells if len(cells) > 1 and all(is_numeric(cell) or is_missing(cell) for cell in cells) else []


def without_words_before(lines: Sequence[str]) -> list[str]:
    """The lines without the word and colon that stand before names and rows, `HEAD: t,F`, `DATA: 0.0,0.1`; [] of any others.

    The names are one a number of the rows, right above them and behind a word of their own, or the same.

    >>> without_words_before(["HEAD: t_s,F_N", *["DATA: 0.0,0.1"] * 6])[:2]
    ['t_s,F_N', '0.0,0.1']
    """
    filled = [k for k, line in enumerate(lines) if line.strip()]
    matches = {k: _WORD.fullmatch(lines[k]) for k in filled}
    words = Counter(match["word"] for match in matches.values() if match is not None and _NUMBERS.fullmatch(match["cells"]))
    if not words or words.most_common(1)[0][1] < max(_FEWEST, _NEARLY_ALL * len(filled[1:-1])):
        return []
    word = words.most_common(1)[0][0]
    behind = {k: match["cells"] for k, match in matches.items() if match is not None and match["word"] == word}
    rows = [k for k, cells in behind.items() if _NUMBERS.fullmatch(cells)]
    above = next((k for k in reversed(filled) if k < rows[0]), -1)
    names = matches.get(above)
    row = matches[rows[0]]
    if names is None or row is None:
        return []
    alike = [mark for mark in ",;\t|" if names["cells"].count(mark) == row["cells"].count(mark) > 0]
    if not alike and len(names["cells"].split()) != len(row["cells"].split()):
        return []
    bare = {k: match["cells"] for k in (above, *rows) if (match := matches[k]) is not None}
    return [bare.get(k, line) for k, line in enumerate(lines)]

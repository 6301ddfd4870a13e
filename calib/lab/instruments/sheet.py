"""What a lab file is cut into: a `Sheet`, header cells, units, and the data cells of one record as text, column by column."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from calib.errors import Choice, Fault, InputError
from calib.lab.instruments.alone_in_unit import alone_in_unit
from calib.lab.instruments.brackets import (
    ends_without_unit,
    tidy,
    unit_of_capitals,
    unit_of_small_letters,
    usual_case,
    without_brackets,
)
from calib.lab.instruments.by_function import by_function
from calib.lab.instruments.contrary import names_quantity
from calib.lab.instruments.designated import designated
from calib.lab.instruments.labtable import IntArray, Unread
from calib.lab.instruments.meanings import PLAIN
from calib.lab.instruments.numbers import is_missing, is_over_range, to_numbers
from calib.lab.instruments.text import LabText
from calib.lab.instruments.together import understood_together
from calib.lab.instruments.units import SI_UNIT, looks_like_unit, stands_for
from calib.lab.instruments.vocabulary import Heading, heading_as, understand, words

# What is more than the capacitance of any sample [F], a force by its letter alone, and cells that are looked at.
_NO_FARAD = 1e-3
_FORCE = Heading("force", 4 * PLAIN, "f", None, letter=True)
_SEEN = 2000

#: Why a column is set aside that holds the units of another.
OF_UNITS = "the unit of"


@dataclass(frozen=True)
class Scaling:
    """A factor or offset that a line states of one column.

    Attributes
    ----------
    line, words : 1-based line, and the words beside the number; the line itself where there are none.
    kind : "factor", "offset", or "" for a number without words, which may be a factor.
    value : the number; nan where the words hold it.
    """

    line: int
    words: str
    kind: str
    value: float

    @property
    def says(self) -> str:
        """What it does, in words."""
        what = {"factor": "states a factor", "offset": "states an offset"}.get(self.kind, "may state a factor")
        return f"{self.words} in line {self.line} {what}" + ("" if math.isnan(self.value) else f" of {self.value:g}")


# Quantities of which no reading is a word.
_OF_NUMBERS = tuple(q for q in SI_UNIT if q not in ("time", "cycle", "status"))


@dataclass(frozen=True, eq=False)
class Sheet:
    """One record of a lab file, cut into cells.

    Attributes
    ----------
    text : the file.
    delimiter : between cells, a blank for runs of blanks.
    header_line, names : 1-based line of the header row and its cells, stripped; line 0 and numbers for a table without header.
    units_line, units : 1-based line of the units row and its units, "" where a cell is empty; None and () without a units row.
    declared_units : quantity -> (unit, 1-based line) as declared above the header.
    declared_decimal : decimal mark as declared above the header, "" if it is not.
    assigned : column -> quantity, as the user asked.
    columns : data cells, a sequence of (n_row,) for each name.
    lines : 1-based line of each row, shape (n_row,).
    cut_short : whether the file ends within the last row.
    notes : what was left out while cutting.
    set_aside : column -> why it is not read although the file may name it, as of another specimen.
    reasons : row from 0 -> why its cells cannot be trusted.
    declared_factors : quantity, "" for none in particular -> (words, 1-based line) that state a factor of its readings.
    scalings : column -> what rows of factors and offsets, or a table of channels, state of it.
    unread : lines and blocks of the file that are not in `columns`, with the reason.
    beside : 1-based line and words of what stands above, below and among the rows, in empty columns and on cells.
    in_every_row : of these, what columns that are not read say in all their cells, behind their names, and other sheets.
    """

    text: LabText
    delimiter: str
    header_line: int
    names: tuple[str, ...]
    units_line: int | None = None
    units: tuple[str, ...] = ()
    declared_units: Mapping[str, tuple[str, int]] = field(default_factory=dict)
    declared_decimal: str = ""
    assigned: Mapping[int, str] = field(default_factory=dict)
    columns: tuple[Sequence[str], ...] = ()
    lines: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    cut_short: bool = False
    notes: tuple[str, ...] = ()
    set_aside: Mapping[int, str] = field(default_factory=dict)
    reasons: Mapping[int, str] = field(default_factory=dict)
    unread: tuple[Unread, ...] = ()
    declared_factors: Mapping[str, tuple[str, int]] = field(default_factory=dict)
    scalings: Mapping[int, tuple[Scaling, ...]] = field(default_factory=dict)
    beside: tuple[tuple[int, str], ...] = ()
    in_every_row: tuple[tuple[int, str], ...] = ()

    @property
    def prelude(self) -> tuple[str, ...]:
        """The lines above the names, or the first row where no line holds names."""
        return self.text.lines[: max((self.named_at or 0) - 1, 0)]

    def prelude_of(self, quantities: Sequence[str]) -> tuple[str, ...]:
        """The lines above the names without those that are of columns of other quantities alone, which are empty."""
        of = {line: self.headings.get(index) for line, index, _ in self.text.of_columns}
        others = {line for line, heading in of.items() if heading is None or heading.quantity not in quantities}
        return tuple("" if number in others else line for number, line in enumerate(self.prelude, 1))

    @property
    def named_at(self) -> int | None:
        """The 1-based line of the names; of the first row where no line holds them, None where there is none yet."""
        return self.header_line or (int(self.lines[0]) if len(self.lines) else None)

    def trusted(self) -> Sheet:
        """The same with empty cells in the rows that cannot be trusted, to see what a column is."""
        if not self.reasons:
            return self
        columns = []
        for column in self.columns:
            cells = list(column)
            for row in self.reasons:
                cells[row] = ""
            columns.append(cells)
        return replace(self, columns=tuple(columns))

    def unit_below(self, column: int) -> str:
        """Unit of a column in the units row, "" if there is none."""
        return usual_case(self.names[column], self.units[column]) if column < len(self.units) else ""

    def usual_case_of(self, column: int) -> str:
        """The unit of a column as it is usually written, where it stands in capitals; else ""."""
        written = self.units[column] if column < len(self.units) else ""
        if written:
            return below if (below := self.unit_below(column)) != written else ""
        return unit_of_capitals(self.names[column])

    def from_small_letters(self, column: int) -> str:
        """The unit of a column as it is usually written, where it ends a name in small letters; else ""."""
        return "" if self.unit_below(column) else unit_of_small_letters(self.names[column])

    def plain_heading(self, column: int) -> Heading:
        """What a column is by its name alone, whatever the user says; of no quantity if it is not understood."""
        found = understand(self.names[column], self.unit_below(column))
        return found if found is not None else Heading("", 0, words(self.names[column]), None)

    @property
    def lines_around(self) -> dict[int, str]:
        """What stands above, below and among the rows and in remarks: 1-based line -> text.

        Behind one that is of a column alone, and does not say of which quantity, stands this in brackets.
        """
        around = dict(enumerate(self.prelude, 1)) | {line: words for line, words in self.beside if line >= 0}
        for line, index, _ in self.text.of_columns:
            heading = self.headings.get(index)
            quantity = stands_for(heading.quantity) if heading is not None else ""
            if quantity and line in around and not names_quantity(around[line], quantity):
                around[line] += f" ({quantity})"
        return around

    @property
    def lines_and_sheets(self) -> dict[int, str]:
        """What stands around the rows, and on sheets beside the record, whose lines are negative."""
        return self.lines_around | {line: words for line, words in self.beside if line < 0}

    def unit_written(self, column: int) -> str:
        """The last unit in the name of a column or below it, "" if there is none."""
        cut = without_brackets(tidy(self.names[column]))
        inside = [b for b in (cut[1] if cut is not None else ()) if looks_like_unit(b)]
        tail = re.search(r"[\s_,:|/]([^\s_,:|/]+)$", self.names[column].strip())
        ends = tail is not None and looks_like_unit(tail[1]) and not ends_without_unit(self.names[column])
        written = tail[1] if tail is not None and ends else ""
        return self.unit_below(column) or (inside[-1] if inside else written)

    def name_for_asking(self, column: int) -> str:
        """How the user may name a column: as it is written, by its number where the name does not tell it from others."""
        name = self.names[column]
        plain = [words(n) for n in self.names]
        clear = name and plain.count(words(name)) == 1 and "=" not in name and '"' not in name
        return name if clear else str(column + 1)

    @cached_property
    def headings(self) -> Mapping[int, Heading]:
        """Which columns are understood, and as what: cell index -> heading. What the user assigned goes first."""
        found: dict[int, Heading] = {}
        given = {stands_for(q) for q in self.assigned.values()}
        for index, name in enumerate(self.names):
            if index in self.assigned:
                found[index] = heading_as(self.assigned[index], name, self.unit_below(index))
            elif name and index not in self.set_aside:
                understood = understand(name, self.unit_below(index))
                free = understood is not None and stands_for(understood.quantity) not in given
                if understood is not None and free and not self._is_in_words(index, understood):
                    found[index] = understood
        together = understood_together(self.names, tuple(map(self.unit_below, range(len(self.names)))))
        together = together | {i: heading for i, (heading, _) in self.designated().items()} | self.alone_in_unit()
        together = together | {i: heading for i, (heading, _) in self.by_function().items()}
        more = {i: h for i, h in together.items() if i not in found and i not in self.set_aside and h.quantity not in given}
        return found | more

    def _is_in_words(self, column: int, heading: Heading) -> bool:
        """Whether a column under the name of a quantity holds words, and has no unit either."""
        without = heading.unit is None and not self.unit_below(column)
        return without and heading.quantity in _OF_NUMBERS and self.holds_words(column)

    def holds_words(self, column: int) -> bool:
        """Whether all cells of a column that hold something are words without a digit: "left", "right"."""
        cells = self.columns[column] if column < len(self.columns) else ()
        if any(map(str.isdigit, next((c for c in cells if c.strip()), "0"))):
            return False
        said = [c for c in {*map(str.strip, cells)} if c and not (is_missing(c) or is_over_range(c))]
        return any(any(map(str.isalpha, c)) for c in said) and not any(any(map(str.isdigit, c)) for c in said)

    def designated(self) -> dict[int, tuple[Heading, str]]:
        """The columns that are named by an instrument beside the quantity: cell index -> heading, and the words of it."""
        return designated(self.names, tuple(map(self.unit_below, range(len(self.names)))))

    def by_function(self) -> dict[int, tuple[Heading, str]]:
        """The columns of a meter whose function is named above: cell index -> heading, and the words of it."""
        return by_function(self.names, tuple(map(self.unit_below, range(len(self.names)))), self.prelude)

    def alone_in_unit(self) -> dict[int, Heading]:
        """The columns of names that are not understood, each the only one in a unit: cell index -> heading.

        A letter F with more than any capacitor has is no farad but a force without a unit, and one of several in F, as of
        "Oven 2 (F)", may be in degrees then.
        """
        found = alone_in_unit(self.names, tuple(map(self.unit_below, range(len(self.names)))))
        numbered = [i for i, h in found.items() if (h.unit or self.unit_below(i)) == "F" and re.search(r"\d", self.names[i])]
        found = {i: h for i, h in found.items() if not (i in numbered and self.columns and self._reaches(i, _NO_FARAD))}
        letters = [i for i, h in found.items() if self.names[i] == "F" == h.unit]
        if not letters or not self.columns or any(h.quantity == "force" for h in found.values()):
            return found
        return found | {i: _FORCE for i in letters if self._reaches(i, _NO_FARAD)}

    def _reaches(self, column: int, limit: float) -> bool:
        """Whether most cells of a column, with either decimal mark, hold numbers, some of them beyond a limit."""
        marks = [self.declared_decimal] if self.declared_decimal else [".", ","]
        tried = [to_numbers([c.strip() for c in self.columns[column][:_SEEN]], mark).values for mark in marks]
        sizes = [np.abs(v[np.isfinite(v)]) for v in tried]
        return any(2 * size.size > v.size > 0 and float(size.max()) > limit for size, v in zip(sizes, tried, strict=True))


class SeveralSpecimens(InputError):
    """A file that holds `count` specimens, of which none was chosen, or one that is not there."""

    def __init__(self, fault: Fault, count: int) -> None:
        super().__init__(fault)
        self.count = count


def which_specimen(sheet: Sheet, message: str, count: int) -> SeveralSpecimens:
    """Make the refusal of a file with several specimens of which none was chosen, or one that is not there.

    Parameters
    ----------
    sheet : the file.
    message : what is wrong.
    count : how many specimens there are.
    """
    advice = (
        f"Say which one: --specimen 1 to --specimen {count} (in an experiment file: specimen = 1), or export one specimen "
        "per file"
    )
    choice = Choice("specimen", tuple(str(k) for k in range(1, count + 1)))
    return SeveralSpecimens(Fault(message, sheet.text.path, sheet.header_line, advice=advice, choice=choice), count)

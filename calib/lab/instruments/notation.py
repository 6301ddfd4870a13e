"""From the number cells of a file to the decimal mark of each of its columns, by what the cells show; refusing to guess."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice

import numpy as np

from calib.lab.instruments.numbers import EXPONENT, SIGNS, SPACES, is_missing, to_numbers
from models.sensor import FloatArray


@dataclass(frozen=True)
class Notation:
    """The decimal marks of a file, or, if it leaves one open, why.

    Attributes
    ----------
    decimal : that of most columns, "" with a conflict.
    decimals : that of each column.
    notes : choices that were made.
    askable : the likelier mark where the user may say it, ".," if none is, "" where the cells contradict each other.
    damaged : whether the mark is known, and cells are read by it only if the user says that they are right.
    against : whether another mark was asked for than the file shows.
    conflict, places : why a mark cannot be told, "" if all can, and the cells (row, column) that show it.
    """

    decimal: str
    decimals: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    conflict: str = ""
    places: tuple[tuple[int, int], ...] = ()
    askable: str = ""
    damaged: bool = False
    against: bool = False


@dataclass(frozen=True)
class _Shown:
    """Where a cell of a column, each after a line end, shows which mark is the decimal one.

    ends : a cell that the mark may end, and not all that shows it; it is found several times as fast.
    certain : by any form that does.
    cut : by fewer than three digits after it alone, as they are left of thousands, too, where a row is cut.
    whole : by any other form.
    long : by more than three digits after it, as thousands have where a digit was doubled.
    twice : by the other mark, standing twice.
    unsure : cells whose one mark may as well set thousands apart.
    """

    mark: str
    ends: re.Pattern[str]
    certain: re.Pattern[str]
    cut: re.Pattern[str]
    whole: re.Pattern[str]
    long: re.Pattern[str]
    twice: re.Pattern[str]
    unsure: re.Pattern[str]

    def search(self, text: str) -> re.Match[str] | None:
        """The first cell that shows it."""
        # Without the mark as the last one only one form is left.
        if self.ends.search(text) is None:
            return self.twice.search(text) if _TWICE[_OTHER[self.mark]].search(text) else None
        found = self.certain.search(text)
        if found is not None and self.cut.fullmatch(found[0]) and self._are_few(text):
            found = self.whole.search(text)
        if found is not None and self.long.fullmatch(found[0]) and self._is_single(text):
            return None
        return found

    def may_set_thousands_apart(self, text: str) -> re.Match[str] | None:
        """The first cell whose one mark may as well set thousands apart."""
        return self.unsure.search(text) if self.ends.search(text) else None

    def _is_single(self, text: str) -> bool:
        """Whether a cell is the only one that shows it, among others with three digits after the mark."""
        n_certain = sum(1 for _ in islice(self.certain.finditer(text), _GROUPS))
        return n_certain == 1 and sum(1 for _ in islice(self.unsure.finditer(text), _FEWEST)) == _FEWEST

    def _are_few(self, text: str) -> bool:
        """Whether so few cells have fewer than three digits after the mark that these may be cells that were cut."""
        n_cut = sum(1 for _ in islice(self.cut.finditer(text), _MANY))
        if n_cut >= _MANY:
            return False
        n_three = sum(1 for _ in self.unsure.finditer(text))
        return n_cut <= _FEW * n_three or (n_cut == 1 and n_three >= _FEWEST)


_OTHER = {".": ",", ",": "."}
# A mark that stands twice in a number, with the digits of thousands or hundreds of them between.
_TWICE = {m: re.compile(rf"{re.escape(m)}\d{{2,3}}{re.escape(m)}", re.ASCII) for m in ".,"}


def _shown(mark: str) -> _Shown:
    point, apart = re.escape(mark), re.escape(_OTHER[mark])
    sign = rf"\n[ \t]*[{SIGNS}]?"
    end = rf"(?:{EXPONENT})?[ \t]*$"
    indian = r"|[1-9]\d?(?:,\d{2})+,\d{3}" if mark == "." else ""  # thousands, and hundreds of them
    twice = rf"(?:[1-9]\d{{0,2}}(?:{apart}\d{{3}}){{2,}}{indian}){end}"  # the other mark twice: it sets thousands apart
    cut = rf"[1-9]\d{{0,2}}{point}\d{{0,2}}[ \t]*$"
    longer = rf"[1-9]\d{{0,2}}{point}\d{{4,}}[ \t]*$"
    whole = "|".join(
        (
            rf"[1-9]\d{{0,2}}(?:[{apart}{SPACES}]\d{{3}})+{point}\d*{end}",  # both marks: the last is the decimal one
            twice,
            rf"\d*{point}\d{{4,}}{end}",  # more than three digits after it
            rf"(?:0\d*|\d{{4,}}|){point}\d{{0,3}}{end}",  # nothing, a leading zero or four digits before it
            rf"\d+{point}\d{{0,3}}{EXPONENT}[ \t]*$",  # an exponent
        )
    )
    unsure = rf"[1-9]\d{{0,2}}{point}\d{{3}}[ \t]*$"
    forms = (f"{cut}|{whole}", cut, whole, longer, twice, unsure)
    patterns = (re.compile(rf"{sign}(?:{form})", re.MULTILINE | re.ASCII) for form in forms)
    return _Shown(mark, re.compile(rf"{point}[^.,\n]*+$", re.MULTILINE), *patterns)


# Cells with fewer than three digits after the mark are no cells that were cut if they are so many, or such a share of those
# with three; a single one may be of so few of these.
_MANY, _FEW, _FEWEST = 200, 0.02, 10
# Numbers in which a mark stands twice, of which a single one may be two that were joined.
_GROUPS = 2
_SHOWN = {mark: _shown(mark) for mark in ".,"}
# After a line end: a whole number without any mark, other than the nines that stand for no reading; of a hundred or more.
_PLAIN_WHOLE = re.compile(rf"\n[ \t]*[{SIGNS}]?(?!9{{6}}\b)\d+[ \t]*$", re.MULTILINE | re.ASCII)
_WHOLE = re.compile(rf"\n[ \t]*[{SIGNS}]?(?!9{{6}}\b)\d{{3,}}[ \t]*$", re.MULTILINE | re.ASCII)
# Nines, or with a minus before them, that stand for no reading.
_NINES = re.compile(r"[+-]?9{3,}")
_THOUSANDS = re.compile(rf"\n[ \t]*[{SIGNS}]?(?!9{{6}}\b)\d{{4,}}[ \t]*$", re.MULTILINE | re.ASCII)
# With a mark: one or more digits other than a leading zero before it; nothing or zero before it and not three digits after it.
_ONE_AND_MORE = {m: re.compile(rf"\n[ \t]*[{SIGNS}]?[1-9]\d*{re.escape(m)}(\d*)[ \t]*$", re.M | re.A) for m in ".,"}
_BELOW_ONE = {m: re.compile(rf"\n[ \t]*[{SIGNS}]?0?{re.escape(m)}(\d*)[ \t]*$", re.M | re.A) for m in ".,"}
_NAMES = {".": "point", ",": "comma"}
# After a line end, with this decimal mark: a number in which the other sets thousands apart, and one above a thousand without.
_WITH_BOTH = {
    m: re.compile(rf"\n[ \t]*([{SIGNS}]?[1-9]\d{{0,2}}(?:{re.escape(o)}\d{{3}})+{re.escape(m)}\d+)[ \t]*$", re.M | re.A)
    for m, o in _OTHER.items()
}
_WITHOUT_BOTH = {m: re.compile(rf"\n[ \t]*[{SIGNS}]?\d{{4,}}(?:{re.escape(m)}\d*)?[ \t]*$", re.M | re.A) for m in ".,"}
# Numbers with both marks that show that the program sets thousands apart in every number.
_OF_BOTH = 3
# Steps between neighbours, as powers of ten: of a notation that fits, and of one that does not.
_SMOOTH, _ROUGH = 0.35, 1.0
# Share of the steps of a signal that go across one at most.
_ACROSS = 0.1


def decide_notation(
    columns: Sequence[Sequence[str]],
    names: Sequence[str],
    *,
    declared: str = "",
    asked: str = "",
    delimiter: str = "",
    beside: Callable[[], tuple[str, str]] = lambda: ("", ""),
    apart_beside: Callable[[], Mapping[str, str]] = dict,
    fits: Callable[[int, float], bool] = lambda column, largest: True,
) -> Notation:
    """Tell from the number cells whether the decimal mark of each column is a point or a comma.

    A cell with both marks shows its decimal mark by the last one; a single mark not followed by exactly three digits, after a
    leading zero, or before an exponent is decimal; a few cells with fewer digits among many with three may have been cut, and
    show nothing. One mark followed by three digits ("1,250") shows nothing by itself: a column of such cells has the
    decimal mark that the others show, if that is this one; whole numbers beside such cells ("999", "1.000") tell by going
    on from one to the next. A mark that sets thousands apart in one column is no decimal mark in another that shows none.
    What then is open is the user's to say, or refused. Cells of a column that contradict each other are refused; so is a
    column whose values below one have other than three decimals while all those above have exactly three, and do not go on
    from these: a spreadsheet has taken their decimal mark for a thousands mark ("0,9966", "10,114"), unless the user says it.

    Parameters
    ----------
    columns : the text of the cells, one sequence per column, equally long.
    names : of the columns, for notes.
    declared : the decimal mark that the file itself states, "" if it states none.
    asked : the decimal mark where the file leaves it open, as the user says; "" if nobody does.
    delimiter : of the file: no program that writes decimal commas parts cells by commas.
    beside : finds the decimal mark of its times of day, or of columns that are not read, "" if they show none, and which these
        are; asked where nothing else tells.
    apart_beside : finds the marks that set thousands apart in columns that are not read, and in which.
    fits : whether the largest number of a column is a reading as it is, and none if it is a thousand times as large; asked
        where numbers above a thousand in other columns have no mark: a program has them in none, a spreadsheet in some.
    """
    texts = ["\n" + "\n".join(column) for column in columns]
    commas = ["," in text for text in texts]
    strong: list[dict[str, re.Match[str] | None]] = []
    shown: list[str] = []
    notes: list[str] = []
    for c, text in enumerate(texts):
        found = {",": _SHOWN[","].search(text) if commas[c] else None, ".": _SHOWN["."].search(text)}
        if found["."] and found[","]:
            places = _places(texts, [(found["."], c), (found[","], c)])
            return Notation("", conflict="some cells have a decimal point and some a decimal comma", places=places)
        mark = "." if found["."] else "," if found[","] else ""
        if mark and commas[c]:
            apart = _SHOWN[_OTHER[mark]].may_set_thousands_apart(text)
            match = found[mark]
            whole = mark not in text
            if apart and match and (both := _with_both_marks(text, mark)):
                words = f'its {_NAMES[_OTHER[mark]]} sets thousands apart, in "{apart[0].strip()}" as in "{both}"'
                notes.append(f'"{names[c]}": {words}')
            elif apart and match and not (whole and asked == mark) and not _sets_thousands_apart(text, mark):
                conflict = "the other mark may set thousands apart, which then have no decimals, or be one, too"
                return Notation(
                    "", conflict=conflict, places=_places(texts, [(match, c), (apart, c)]), askable=mark if whole else ""
                )
        strong.append(found)
        shown.append(mark)
    seen = set(shown) - {""}
    for c, mark in enumerate(shown):
        if declared and mark and mark != declared:
            return Notation(
                "",
                conflict=f'the file declares the decimal mark "{declared}", a cell shows another',
                places=_places(texts, [(strong[c][mark], c)]),
            )
    decimals: list[str] = []
    was_open = False
    apart_in = {_OTHER[m] for m, text in zip(shown, texts, strict=True) if m and _sets_thousands_apart(text, m)}
    for c, mark in enumerate(shown):
        if mark in apart_in and mark in texts[c]:
            words = f"the {_NAMES[mark]} sets thousands apart in the millions of another column"
            return Notation(
                "", conflict=f"{words}, and a cell has it as decimal mark", places=_places(texts, [(strong[c][mark], c)])
            )
    plain = [text for text in texts if "." not in text and "," not in text and _THOUSANDS.search(text)]
    courses = [_course(text, columns[c], seen) if not shown[c] else "" for c, text in enumerate(texts)]
    apart_by = {mark: names[c] for c, text in enumerate(texts) if courses[c] == "thousands" for mark in ".," if mark in text}
    for c, text in enumerate(texts):
        others = _Others(seen, apart_in, apart_by, beside, apart_beside, partial(fits, c), large=bool(plain))
        if not declared and asked and courses[c] != "thousands" and _says_otherwise(text, asked, others):
            return _contradicted(asked, texts, shown, strong)
        decimal, note, conflict, showing = _decimal(text, columns[c], shown[c], courses[c], others, declared, asked, delimiter)
        if conflict:
            # Whole numbers beside a mark contradict nothing that may be said of it.
            contrary = sum(m is not None and ("." in m[0] or "," in m[0]) for m in showing) > 1
            likely = "" if contrary else ".," if seen else "," if commas[c] else "."
            return Notation("", conflict=conflict, places=_places(texts, [(m, c) for m in showing]), askable=likely)
        was_open |= not shown[c] and ("." in text or commas[c])
        notes += [f'"{names[c]}": {note}'] if note else []
        decimals.append(decimal)
        if decimal and decimal in text:
            conflict, showing = _damaged(text, columns[c], decimal)
            # A signal goes across one a few times; numbers in turn, as in two units, are not made right by a mark.
            few = bool(conflict) and _across(columns[c], decimal).size <= _ACROSS * len(columns[c])
            if conflict and not (few and decimal == asked):
                places = _places(texts, [(m, c) for m in showing])
                return Notation("", conflict=conflict, places=places, askable=decimal if few else "", damaged=few)
    if asked and not was_open and seen - {asked}:
        return _contradicted(asked, texts, shown, strong)
    told = [d for d in decimals if d]
    # Those of columns that have decimals at all, rather than thousands set apart alone.
    used = [d for d, text in zip(decimals, texts, strict=True) if d and d in text]
    usual = max(".,", key=(used or told).count) if told else declared or asked or "."
    for c, mark in enumerate(decimals):
        if mark and mark != usual and mark in texts[c]:
            notes.append(f'"{names[c]}" has a decimal {_NAMES[mark]}, other columns a decimal {_NAMES[usual]}')
    return Notation(usual, tuple(d or usual for d in decimals), tuple(notes))


def mark_shown(cells: Sequence[str]) -> str:
    """The decimal mark that a column of numbers shows by itself; "" if it shows none or both, or if some cell is no number.

    >>> mark_shown(["22,1", "22,15"]), mark_shown(["97,209", "97,211"]), mark_shown(["22,1", "21.07.24"])
    (',', '', '')
    """
    there = [c for c in map(str.strip, cells) if c and not is_missing(c)]
    text = "\n" + "\n".join(there)
    marks = [mark for mark in ".," if _SHOWN[mark].search(text)]
    numbers = len(marks) == 1 and not np.isnan(to_numbers(there, marks[0]).values).any()
    return marks[0] if numbers and _OTHER[marks[0]] not in text else ""


def _sets_thousands_apart(text: str, mark: str) -> bool:
    """Whether a column of whole numbers has the other mark in every number of four digits and more, and twice in some."""
    if mark in text or _OTHER[mark] not in text:
        return False
    groups = sum(1 for _ in islice(_SHOWN[mark].twice.finditer(text), _GROUPS))
    return groups >= _GROUPS and not _THOUSANDS.search(text)


def _with_both_marks(text: str, mark: str) -> str:
    """A number with both marks, of a column that sets thousands apart in all numbers; "" if these are few or others do not."""
    found = [m[1] for m in islice(_WITH_BOTH[mark].finditer(text), _OF_BOTH)]
    return found[0] if len(found) == _OF_BOTH and not _WITHOUT_BOTH[mark].search(text) else ""


def _places(texts: Sequence[str], found: Sequence[tuple[re.Match[str] | None, int]]) -> tuple[tuple[int, int], ...]:
    return tuple(sorted((texts[c].count("\n", 0, m.start()), c) for m, c in found if m is not None))


@dataclass(frozen=True)
class _Others:
    """What the columns of a file say of one that shows no decimal mark by itself.

    seen : decimal marks that columns show.
    apart_in : marks that set thousands apart in millions.
    apart_by : marks that set thousands apart as the course of a column shows, and which column.
    beside, apart_beside, fits : as of `decide_notation`, of this column.
    large : whether a column has numbers above a thousand without any mark.
    """

    seen: set[str]
    apart_in: set[str]
    apart_by: Mapping[str, str]
    beside: Callable[[], tuple[str, str]]
    apart_beside: Callable[[], Mapping[str, str]]
    fits: Callable[[float], bool]
    large: bool

    def sets_apart(self, mark: str) -> str:
        """The column in which a mark sets thousands apart, "" if none shows it."""
        return self.apart_by.get(mark) or ("" if mark in self.seen else self.apart_beside().get(mark, ""))


def _says_otherwise(text: str, asked: str, others: _Others) -> bool:
    """Whether the numbers of an open column were to be thousands by the mark that all other columns show as the decimal one."""
    mark = _OTHER[asked]
    open_to_it = others.seen == {mark} and mark in text and asked not in text and not _PLAIN_WHOLE.search(text)
    return open_to_it and not others.sets_apart(mark) and _SHOWN[mark].may_set_thousands_apart(text) is not None


def _contradicted(
    asked: str, texts: Sequence[str], shown: Sequence[str], strong: Sequence[Mapping[str, re.Match[str] | None]]
) -> Notation:
    """What to say where a decimal mark was asked for, and a column shows the other."""
    c = next(c for c, mark in enumerate(shown) if mark and mark != asked)
    words = f'the decimal mark "{asked}" was asked for, the file shows another'
    return Notation("", conflict=words, places=_places(texts, [(strong[c][shown[c]], c)]), askable=_OTHER[asked], against=True)


_Decision = tuple[str, str, str, tuple[re.Match[str] | None, ...]]


def _decimal(
    text: str,
    cells: Sequence[str],
    shown: str,
    course: str,
    others: _Others,
    declared: str,
    asked: str,
    delimiter: str,
) -> _Decision:
    """The decimal mark of one column ("" if it has none), a note, or why it is open and which cells show it."""
    if shown:
        return shown, "", "", ()
    unsure = {mark: match for mark in ".," if (match := _SHOWN[mark].may_set_thousands_apart(text)) is not None}
    if not unsure:
        return "", "", "", ()
    if len(unsure) == 2:
        return "", "", "some cells have a point before three digits and some a comma", tuple(unsure.values())
    mark, match = next(iter(unsure.items()))
    seen = others.seen
    if declared or (asked and course != "thousands"):
        told = f"its {_NAMES[mark]} sets thousands apart, as the decimal mark that was asked for says"
        return declared or asked, told if not declared and asked != mark else "", "", ()
    if mark in others.apart_in and seen == {_OTHER[mark]} and not _THOUSANDS.search(text):
        return _OTHER[mark], f"its {_NAMES[mark]} sets thousands apart, as it does in the millions of another column", "", ()
    plain = _PLAIN_WHOLE.search(text)
    hundreds = _WHOLE.search(text)
    if plain and seen == {mark} and _of_nines({m[0].strip() for m in islice(_PLAIN_WHOLE.finditer(text), _MANY)}):
        return mark, "", "", ()
    if course == "thousands":
        return _OTHER[mark], f"its {_NAMES[mark]} sets thousands apart, as the numbers below a thousand show", "", ()
    if seen <= {mark} and (where := others.sets_apart(mark)):
        words = f'the {_NAMES[mark]} may be the decimal mark, and sets thousands apart in "{where}"'
        return "", "", words, (match,)
    if course == "decimal":
        return mark, f"its {_NAMES[mark]} is the decimal mark, as the whole numbers among the others show", "", ()
    if hundreds and plain:
        return "", "", f'"{mark}" may set thousands apart or be the decimal mark: whole numbers beside it', (hundreds, match)
    if seen == {mark} or (not seen and mark == "." and delimiter == ","):
        return mark, "", "", ()
    if seen:
        words = f"the {_NAMES[mark]} may set thousands apart or be the decimal mark, other columns have a decimal "
        return "", "", words + " and a decimal ".join(_NAMES[s] for s in sorted(seen)), (match,)
    if others.large and not plain:
        largest = float(np.nanmax(np.abs(to_numbers(cells, mark).values)))
        words = f"its {_NAMES[mark]} is the decimal mark, as numbers above a thousand in other columns have none"
        if others.fits(largest):
            return mark, f"{words}, and a thousand times as much would be too large", "", ()
        words = f"the {_NAMES[mark]} may set thousands apart, as a spreadsheet does in some columns, or be the decimal mark"
        return "", "", f"{words}: with thousands the largest number is {1000 * largest:.7g}, else {largest:.6g}", (match,)
    shown_beside, where = others.beside()
    if mark == shown_beside:
        return mark, f"its {_NAMES[mark]} is the decimal mark, as it is in {where}", "", ()
    words = f"the {_NAMES[mark]} may set thousands apart or be the decimal mark, and no cell of the file tells"
    return "", "", words, (match,)


def _course(text: str, cells: Sequence[str], seen: set[str]) -> str:
    """What whole numbers beside those with a mark show of it: "decimal", "thousands", or "" if they show nothing."""
    marks = [mark for mark in ".," if _SHOWN[mark].may_set_thousands_apart(text)]
    if len(marks) != 1 or not _PLAIN_WHOLE.search(text) or (seen == {marks[0]} and not _WHOLE.search(text)):
        return ""
    course = _going_on(cells, marks[0])
    if course == "decimal":
        return course if seen <= {marks[0]} else ""
    # A program that sets thousands apart does so in every number.
    return course if seen <= {_OTHER[marks[0]]} and not _THOUSANDS.search(text) else ""


def marks_apart(columns: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """The marks that set thousands apart in columns of numbers, as those below a thousand show, and in which.

    >>> marks_apart({"No": [f"{i:,}" for i in range(990, 1010)], "Temperature": ["22,125"] * 20})
    {',': 'No'}
    """
    found: dict[str, str] = {}
    for name, cells in columns.items():
        there = [c for c in map(str.strip, cells) if c and not is_missing(c)]
        text = "\n" + "\n".join(there)
        if any(_SHOWN[mark].search(text) for mark in ".,"):
            continue
        if _course(text, there, set()) == "thousands":
            found.setdefault("." if "." in text else ",", name)
    return found


def _of_nines(whole: set[str]) -> bool:
    """Whether whole numbers are one only, which stands for no reading: "-999", "9999"."""
    return len(whole) == 1 and all(map(_NINES.fullmatch, whole))


def _going_on(cells: Sequence[str], mark: str) -> str:
    """Whether numbers with a mark go on from whole numbers beside them if it is "decimal" or if it sets "thousands" apart."""
    with_mark = np.array([mark in c for c in cells])
    steps = {}
    for name, decimal in (("decimal", mark), ("thousands", _OTHER[mark])):
        size = np.abs(to_numbers(cells, decimal).values)
        kept = np.isfinite(size) & (size > 0)
        changes = np.diff(with_mark[kept].astype(np.int8)) != 0
        if not np.any(changes):
            return ""
        steps[name] = float(np.median(np.abs(np.diff(np.log10(size[kept])))[changes]))
    best, worst = sorted(steps, key=lambda name: steps[name])
    return best if steps[best] < _SMOOTH and steps[worst] > _ROUGH else ""


def _damaged(text: str, cells: Sequence[str], decimal: str) -> tuple[str, tuple[re.Match[str] | None, ...]]:
    """Why a spreadsheet has taken the decimal mark of some cells for a thousands mark, and which; "" if it has not.

    A number that was damaged so is ten times as large at least, and so is the step to it from one below one; an instrument
    that shows as many digits of any number ("0.9976", then "1.002") writes what goes on.
    """
    if _OTHER[decimal] in text:
        return "", ()
    # What is told soon, or by few of the cells, is looked for first.
    small = next(_longer(text, decimal), None)
    if small is None:
        return "", ()
    large = _ONE_AND_MORE[decimal].search(text)
    if large is None or len(large[1]) != 3:
        return "", ()
    apart = _SHOWN[decimal].may_set_thousands_apart(text)
    if apart is None:
        return "", ()
    if {len(m) for m in _ONE_AND_MORE[decimal].findall(text)} != {3}:
        return "", ()
    if min({len(m) for m in _BELOW_ONE[decimal].findall(text)} - {0}) <= 3:
        return "", ()
    across = _across(cells, decimal)
    if across.size and float(np.median(across)) < _ROUGH:
        return "", ()
    return "values below one have more decimals than three, all others exactly three", (small, apart)


def _across(cells: Sequence[str], decimal: str) -> FloatArray:
    """The steps from numbers below one to others beside them and back, as powers of ten."""
    size = np.abs(to_numbers(cells, decimal).values)
    level = np.log10(size[size > 0])
    return np.asarray(np.abs(np.diff(level))[(level[1:] >= 0) != (level[:-1] >= 0)])


def _longer(text: str, decimal: str) -> Iterator[re.Match[str]]:
    """Values below one with more than three decimals."""
    return (m for m in _BELOW_ONE[decimal].finditer(text) if len(m[1]) > 3)

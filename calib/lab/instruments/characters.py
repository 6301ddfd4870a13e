"""From the text of a lab file to it with plain characters for entities, escapes, odd minus signs and double delimiters."""

from __future__ import annotations

import re
from collections.abc import Callable
from html.entities import html5

#: Characters of no width, which nobody sees: the mark of the order of bytes, blanks, marks of the direction of writing.
ORDER_OF_BYTES = "\ufeff"
BLANKS_OF_NO_WIDTH = "\u200b\u2060"
DIRECTIONS = "\u200e\u200f\u061c\u202a\u202b\u202c\u2066\u2067\u2068\u2069"
OF_NO_WIDTH = ORDER_OF_BYTES + BLANKS_OF_NO_WIDTH + DIRECTIONS
# "&micro;m", "&#181;m" and "&#xb5;m" as a page of the web has "µm", and "\u00b5m", "\xb5m" as JSON and Python have it.
_ENTITY = re.compile(r"&(?:#(?P<number>\d{2,6})|#[xX](?P<hex>[0-9a-fA-F]{2,5})|(?P<name>[A-Za-z]{2,8}\d{0,2}));")
_ESCAPE = re.compile(r"\\(?:u(?P<four>[0-9a-fA-F]{4})|x(?P<two>[0-9a-fA-F]{2}))(?![0-9a-fA-F])")
# What would be a delimiter or a quotation mark, and the first character behind those of ASCII and its controls.
_NO_LETTER, _BEYOND = ',;\t|"\n\r', 0xA0
# Letters of the West and of Greek, marks and blanks, and the minus: what names, units and numbers are written with.
_OF_TABLES = ((0x20, 0x400), (0x2000, 0x2052), (0x2126, 0x2127), (0x2206, 0x2213))
# Hyphens and dashes before a number at the beginning of a cell that are no minus by their code: "‑0.0020".
_HYPHENS = "\u2010\u2011\u2012\u2014\ufe63\uff0d"
_MINUS = re.compile(rf"(?:^|(?<=[;,\t|\"' ]))[{_HYPHENS}](?=[.,]?\d)", re.MULTILINE)
# A delimiter before each tab: "0.000,<tab>-0.0004"; lines that show it.
_DOUBLE = re.compile(r"(?P<mark>[,;|])[ \t]*\t[ \t]*")
_FEWEST_LINES = 3


def with_plain_characters(text: str) -> tuple[str, tuple[str, ...]]:
    """Write the characters that stand for others as these, and what two delimiters part as parted by one, with notes.

    Parameters
    ----------
    text : of a file.

    >>> with_plain_characters("t (s);z (&micro;m)\\n0;\u20110.2")[0]
    't (s);z (µm)\\n0;-0.2'
    >>> with_plain_characters("Q&A;2026\u201111\\n")
    ('Q&A;2026‑11\\n', ())
    """
    notes: list[str] = []
    if "&" in text:
        text = _replaced(text, _ENTITY, _of_entity, "entities of the web", notes)
    if "\\" in text:
        text = _replaced(text, _ESCAPE, _of_escape, "characters as programs escape them", notes)
    if any(hyphen in text for hyphen in _HYPHENS):
        text = _replaced(text, _MINUS, lambda _: "-", "hyphens or dashes before numbers", notes)
    plain = _parted_once(text) if "\t" in text else text
    if plain != text:
        notes.append("each tab stands behind a delimiter: both are taken as one")
    return plain, tuple(notes)


def _replaced(text: str, pattern: re.Pattern[str], plain: Callable[[re.Match[str]], str], what: str, notes: list[str]) -> str:
    """The text with what a pattern finds written plainly, and a note on it."""
    found = [(m, to) for m in pattern.finditer(text) if (to := plain(m)) != m[0]]
    if not found:
        return text
    first, to = found[0]
    line = text.count("\n", 0, first.start()) + 1
    notes.append(f'{len(found)} {what} are read as what they stand for, "{first[0]}" in line {line} as "{to}"')
    return pattern.sub(plain, text)


def _of_entity(match: re.Match[str]) -> str:
    if match["name"]:
        return _letter(html5.get(f"{match['name']};", ""), match[0], 0)
    code = int(match["number"]) if match["number"] else int(match["hex"], 16)
    return _letter(chr(code), match[0], 0) if code <= 0xFFFF else match[0]


def _of_escape(match: re.Match[str]) -> str:
    return _letter(chr(int(match["four"] or match["two"], 16)), match[0], _BEYOND)


def _letter(plain: str, written: str, beyond: int) -> str:
    """What a character is written for, where that is one, no delimiter, and can be seen or is a blank; else what is written."""
    if len(plain) != 1 or plain in _NO_LETTER or ord(plain) < beyond:
        return written
    seen = any(first <= ord(plain) < behind for first, behind in _OF_TABLES) and (plain.isprintable() or plain.isspace())
    return plain if seen else written


def _parted_once(text: str) -> str:
    """The text with a tab in place of a delimiter and a tab, where every tab stands behind one in all lines that have cells."""
    n_tab, n_double = len(re.findall(r"\t[ \t]*", text)), len(_DOUBLE.findall(text))
    lines = [line for line in text.split("\n") if line.strip()]
    if n_tab != n_double or sum("\t" in line for line in lines) < max(_FEWEST_LINES, len(lines) / 2):
        return text
    marks = {match["mark"] for match in _DOUBLE.finditer(text)}
    # A blank behind such a mark parts cells as the tab does: "0.0, 0.1,<tab>0.2".
    marked = rf"[{''.join(marks)}](?:[ \t]*\t[ \t]*| +(?=[-+\d.])| *$)"
    return re.sub(marked, "\t", text, flags=re.MULTILINE) if len(marks) == 1 else text

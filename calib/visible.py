"""From a text that somebody else wrote to one that can be shown: on a terminal, in a figure, in a message, in a file's name."""

from __future__ import annotations

import re

#: The longest name of a specimen, a sweep or an experiment: it stands in tables, in figures and in the names of unknowns.
LONGEST_NAME = 100

# What moves the cursor, colours, renames windows, turns the direction of writing, cannot be seen or is half a character.
# Line ends and tabs are no part of it, nor what joins the parts of emoji and of Arabic and Indian letters.
_INVISIBLE = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\xad\u061c\u180e\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb"
    "\ud800-\udfff\U000e0000-\U000e007f]"
)


def visible(text: str) -> str:
    """Write out control characters and all else that a screen would act on or not show, and leave the rest as it is.

    >>> visible("sensor \\x1b[31m1")
    'sensor \\\\x1b[31m1'
    """
    return _INVISIBLE.sub(_written_out, text)


def _written_out(match: re.Match[str]) -> str:
    code = ord(match[0])
    if 0xDC80 <= code <= 0xDCFF:  # a byte of a file's name that is no UTF-8
        code -= 0xDC00
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def shortened(text: str, most: int = 80) -> str:
    """A text for a message, its middle left out where it is long, control characters and line ends written out.

    Parameters
    ----------
    text : as found.
    most : characters that are kept.

    >>> shortened("0123456789" * 100, 20)
    '0123456789 ... 0123456789 (1000 characters)'
    """
    kept = text if len(text) <= most else f"{text[: most // 2]} ... {text[-(most // 2) :]}"
    shown = visible(kept).replace("\n", "\\n").replace("\t", "\\t")
    return shown if kept is text else f"{shown} ({len(text)} characters)"


def character_fault(text: str) -> str:
    """Why a text cannot be shown everywhere, as the end of a sentence that names the character; "" if it can.

    >>> character_fault("sensor\\t1"), character_fault("sensor 1")
    ('holds the character \\\\t', '')
    """
    found = _INVISIBLE.search(text) or re.search(r"[\n\t]", text)
    if found is None:
        return ""
    return "is no text in UTF-8" if 0xD800 <= ord(found[0]) <= 0xDFFF else f"holds the character {shortened(found[0])}"


def name_fault(name: str) -> str:
    """Why a text cannot be the name of a specimen, a sweep or an experiment, as the end of a sentence; "" if it can."""
    long = f"is {len(name)} characters long, more than {LONGEST_NAME}" if len(name) > LONGEST_NAME else ""
    return character_fault(name) or long

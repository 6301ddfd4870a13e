"""A document in, one written in another way or with other lines around the table out; the readings are the same."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace

from mutants.document import Document
from mutants.kind import Kind


def codec(*names: str) -> Callable[[Document, random.Random], Document | None]:
    """Another encoding."""

    def change(doc: Document, rng: random.Random) -> Document | None:
        name = rng.choice(names)
        texts = (*doc.above, *doc.below, *(f"{c.name}{c.unit}" for c in doc.columns))
        try:
            "".join(texts).encode(name)
        except UnicodeEncodeError:
            return None
        return replace(doc, codec=name)

    return change


def _newline(newline: str) -> Callable[[Document, random.Random], Document | None]:
    return lambda doc, rng: replace(doc, newline=newline) if doc.newline != newline else None


def _delimiter(*delimiters: str) -> Callable[[Document, random.Random], Document | None]:
    def change(doc: Document, rng: random.Random) -> Document | None:
        new = rng.choice([d for d in delimiters if d != doc.delimiter] or [doc.delimiter])
        if new == doc.delimiter:
            return None
        if new == " " and any(not cell for i in doc.rows() for cell in doc.row(i).cells):
            return None
        above = tuple(v.replace(doc.delimiter, new) if '"' not in v and new != " " else v for v in doc.above)
        return replace(doc, delimiter=new, above=above)

    return change


def quoted(doc: Document, rng: random.Random) -> Document | None:
    """Cells in quotes."""
    new = rng.choice([q for q in ("none", "data", "all") if q != doc.quote])
    return replace(doc, quote=new) if doc.protect else None


def trailing(doc: Document, rng: random.Random) -> Document | None:
    """Delimiters at the end of every row, of the header, too, or not."""
    n = rng.choice((1, 1, 3))
    return replace(doc, trail_rows=n, trail_header=rng.choice((0, n)))


def trailing_header(doc: Document, rng: random.Random) -> Document | None:
    """Empty cells at the end of the header alone."""
    return replace(doc, trail_header=rng.choice((1, 2)))


def behind_hash(doc: Document, rng: random.Random) -> Document | None:
    """The header behind a comment sign, as numpy.savetxt writes it."""
    return replace(doc, prefix=rng.choice(("# ", "#", "% ", "%", "// ")))


def lines_above(doc: Document, rng: random.Random) -> Document | None:
    """More lines above the header."""
    lines = (
        "Operator: N. N.",
        "Date,2026-03-04",
        "Sample thickness (mm),1.10",
        "Notes;pressed twice",
        "",
        "# exported",
        "Speed 1.0 mm/min",
        "Temperature,23.4,°C",
    )
    new = tuple(v.replace(",", doc.delimiter) for v in rng.sample(lines, rng.choice((1, 2, 4))))
    return replace(doc, above=(*new, *doc.above))


def titles_above(doc: Document, rng: random.Random) -> Document | None:
    """A line of titles just above the header, one for each column or for some."""
    words = ("Sample 1", "Sensor A", "Run 3", "Machine", "Data", "Channel")
    cells = [rng.choice(words) if j % rng.choice((1, 2)) == 0 else "" for j in range(len(doc.columns))]
    return replace(doc, above=(*doc.above, doc.delimiter.join(cells)))


def no_lines_above(doc: Document, rng: random.Random) -> Document | None:
    """No lines above the header."""
    return replace(doc, above=()) if doc.above else None


def footer(doc: Document, rng: random.Random) -> Document | None:
    """Lines below the table."""
    d = doc.delimiter
    lines = rng.choice(
        (
            ("End of test",),
            ("", "Maximum load (N)" + d + "12.5"),
            ("Total time (s)" + d + "37.8",),
            ("# end",),
            ("", "Results", "Modulus (MPa)", "0.62"),
        )
    )
    return replace(doc, below=(*[v for v in doc.below if v.strip()], *lines), end=True)


def numbers_below(doc: Document, rng: random.Random) -> Document | None:
    """A row of results below the table, after a blank line or at once, which looks like a row."""
    cells = [f"{rng.uniform(0.0, 30.0):.3f}" for _ in doc.columns[1:]]
    lines = (*rng.choice(((), ("",))), doc.delimiter.join([rng.choice(("Mean", "Std", "Max", "Average")), *cells]))
    return replace(doc, below=(*[v for v in doc.below if v.strip()], *lines), end=True)


def series_above(doc: Document, rng: random.Random) -> Document | None:
    """The line "MODE: SERIES" above a parallel capacitance: one of them is wrong."""
    at = doc.index("capacitance")
    if at is None or not (doc.columns[at].name or "").lower().startswith("cp"):
        return None
    return replace(
        doc,
        above=(rng.choice(("MODE: SERIES", "Function,Cs-D", "MEAS CS-D", "Equivalent circuit: series")), *doc.above),
        refuse=True,
    )


KINDS = (
    Kind("UTF-16", "the same text", codec("utf-16"), True),
    Kind("UTF-16 without its mark", "the same text", codec("utf-16-le", "utf-16-be")),
    Kind("byte order mark", "the same text", codec("utf-8-sig"), True),
    Kind("Latin-1, GBK, Shift-JIS", "the same text", codec("latin-1", "cp1252", "gbk", "shift_jis"), True, last=True),
    Kind("lines end in CR", "the same text", _newline("\r")),
    Kind("lines end in CRLF", "the same text", _newline("\r\n"), True),
    Kind("lines end in LF", "the same text", _newline("\n"), True),
    Kind("other delimiter", "the same cells", _delimiter(";", "\t", ","), True),
    Kind("delimiter | or blank", "the same cells", _delimiter("|", " ")),
    Kind("cells quoted", "the same cells", quoted, True),
    Kind("delimiters at the end of rows", "no cells", trailing),
    Kind("empty cells at the end of the header", "no columns", trailing_header),
    Kind("header behind a comment sign", "the same header", behind_hash),
    Kind("lines above added", "the same table", lines_above, True),
    Kind("titles above the header", "the same table", titles_above),
    Kind("lines above removed", "the same table", no_lines_above, True),
    Kind("lines below the table", "named, no readings", footer, True),
    Kind("row of results below the table", "named, no reading", numbers_below),
    Kind("series mode above a parallel capacitance", "one of them is wrong", series_above, last=True),
    Kind(
        "nothing", "the same readings; every column that is not used is named", lambda doc, rng: replace(doc, signs=True), True
    ),
)

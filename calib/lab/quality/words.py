"""From grades to words: their numbers with units, the rows of a table, and one sentence on all of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from calib.lab.quality.grade import LEVELS, Grade, worst_first


def grade_rows(grades: Iterable[Grade]) -> list[tuple[str, str, str, str, str]]:
    """Grades as rows of a table for people, the worst first: level, check with its channel, number, finding, advice."""
    return [(v.level, check_name(v), number_text(v), v.finding, v.advice) for v in worst_first(grades)]


def check_name(grade: Grade) -> str:
    """Name a check together with the channel it was made on.

    >>> check_name(Grade("drift", "good", 0.1, "1", "", "", "force", "a.csv"))
    'drift, force'
    """
    return f"{grade.check}, {grade.channel}"


def number_text(grade: Grade) -> str:
    """The number of a grade with its unit, as people read it: shares in per cent, lengths in mm.

    >>> number_text(Grade("hysteresis", "good", 0.0712, "1", "", "", "force", "a.csv"))
    '7.1 %'
    >>> number_text(Grade("start", "good", 0.00017, "m", "", "", "force", "a.csv"))
    '0.17 mm'
    """
    value, unit = grade.number + 0.0, grade.unit  # no minus zero
    if unit == "1":
        return percent(value)
    if unit == "m":
        return f"{value * 1e3:.3g} mm"
    if unit in ("readings", "steps"):
        return f"{value:.0f} {unit}" if round(value) != 1 else f"1 {unit[:-1]}"
    return f"{value:.0f} {unit}" if abs(value) >= 100 else f"{value:.3g} {unit}"


def quality_in_words(grades: Sequence[Grade]) -> str:
    """How many grades there are of each level, and which are bad, in a sentence.

    >>> quality_in_words([Grade("gap in time", "good", 0.1, "s", "", "", "force", "a.csv")])
    '1 check: all good.'
    >>> quality_in_words([Grade("hysteresis", "bad", 0.4, "1", "", "", "force", "a.csv")])
    '1 check: 1 bad (hysteresis, force, of a.csv).'
    """
    n = {level: sum(v.level == level for v in grades) for level in LEVELS}
    total = f"{len(grades)} check{'s' if len(grades) != 1 else ''}"
    if n["good"] == len(grades):
        return f"{total}: all good."
    parts = []
    if n["bad"]:
        bad = [f"{check_name(v)}, of {v.file}" for v in grades if v.level == "bad"]
        parts.append(f"{n['bad']} bad ({'; '.join(bad[:4])}{f'; {len(bad) - 4} more' if len(bad) > 4 else ''})")
    if n["warning"]:
        parts.append(f"{n['warning']} warning{'s' if n['warning'] > 1 else ''}")
    if n["good"]:
        parts.append(f"{n['good']} good")
    return f"{total}: {', '.join(parts)}."


def percent(share: float) -> str:
    """A share in per cent with two digits, as people read it.

    >>> percent(0.0712), percent(1.234)
    ('7.1 %', '123 %')
    """
    return f"{share * 100:.2g} %" if abs(share) < 0.995 else f"{share * 100:.0f} %"

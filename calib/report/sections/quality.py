"""What the checks say of the lab files."""

from __future__ import annotations

from dataclasses import dataclass

from calib.lab import Grade, check_name, grade_rows, number_text, quality_in_words
from calib.report.section import Results, Section
from calib.sampling import Posterior

ORDER = 20

_TITLE = "Quality of the lab data"


def section(results: Results) -> Section | None:
    """Show the grades on the lab files; None if none were given."""
    groups = quality_groups(results.posterior)
    if not groups:
        return None
    words = quality_in_words([v for s in results.posterior.sweeps for v in s.grades])
    return Section("quality", _TITLE, _TITLE, "quality.html.j2", {"groups": groups, "words": words}, of_draws=False)


@dataclass(frozen=True)
class QualityGroup:
    """What the checks say of one lab file: objections (level, check, number, finding, advice), and the rest (text, finding)."""

    title: str
    objections: tuple[tuple[str, str, str, str, str], ...]
    good: tuple[tuple[str, str], ...]


def quality_groups(posterior: Posterior) -> list[QualityGroup]:
    """The grades on the lab data by specimen and file, files with the worst grades first."""
    by_file: dict[str, list[Grade]] = {}
    for s in posterior.sweeps:
        for v in s.grades:
            by_file.setdefault(f"{s.title}: {v.file}", []).append(v)
    groups = [
        QualityGroup(
            title,
            tuple(row for row in grade_rows(grades) if row[0] != "good"),
            tuple((f"{check_name(v)}: {number_text(v)}", v.finding) for v in grades if v.level == "good"),
        )
        for title, grades in by_file.items()
    ]
    return sorted(groups, key=lambda g: min((("bad", "warning").index(o[0]) for o in g.objections), default=2))

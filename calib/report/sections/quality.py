"""What the checks say of the lab files."""

from __future__ import annotations

from dataclasses import dataclass

from calib.lab import Verdict, check_name, number_text, quality_in_words, verdict_rows
from calib.report.section import Results, Section
from calib.sampling import Posterior

ORDER = 30

_TITLE = "Quality of the lab data"


def section(results: Results) -> Section | None:
    """Show the verdicts on the lab files; None if none were given."""
    groups = quality_groups(results.posterior)
    if not groups:
        return None
    words = quality_in_words([v for s in results.posterior.sweeps for v in s.verdicts])
    return Section("quality", _TITLE, _TITLE, "quality.html.j2", {"groups": groups, "words": words})


@dataclass(frozen=True)
class QualityGroup:
    """What the checks say of one lab file: objections (level, check, number, finding, advice), and the rest (text, finding)."""

    title: str
    objections: tuple[tuple[str, str, str, str, str], ...]
    good: tuple[tuple[str, str], ...]


def quality_groups(posterior: Posterior) -> list[QualityGroup]:
    """The verdicts on the lab data by specimen and file, files with the worst verdicts first."""
    by_file: dict[str, list[Verdict]] = {}
    for s in posterior.sweeps:
        for v in s.verdicts:
            by_file.setdefault(f"{s.title}: {v.file}", []).append(v)
    groups = [
        QualityGroup(
            title,
            tuple(row for row in verdict_rows(verdicts) if row[0] != "good"),
            tuple((f"{check_name(v)}: {number_text(v)}", v.finding) for v in verdicts if v.level == "good"),
        )
        for title, verdicts in by_file.items()
    ]
    return sorted(groups, key=lambda g: min((("bad", "warning").index(o[0]) for o in g.objections), default=2))

"""What came out, for somebody who reads nothing else: whether to use it, what speaks against it, the main numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from calib.catalogue import POOLED, QUANTITIES, SPREADS, spread_of
from calib.checks import passed_gates
from calib.decision import largest_force, percent
from calib.experiment import model_in_words
from calib.report.rows import PRIOR_DRIVEN_WORDS, SENSOR_PARAMETERS, ParameterRow, parameter_rows, told_by_few
from calib.report.section import Results, Section
from calib.report.status import status_in_words
from calib.sampling import Posterior

ORDER = 10

# Specimens that the first sheet has room for, and reasons; of more it says how many.
_MOST_SPECIMENS, _MOST_LIGHTS = 8, 6


def section(results: Results) -> Section:
    """Show what came out, at the head of the report."""
    posterior, verdict, recommendation = results.posterior, results.verdict, results.recommendation
    conformity = None if recommendation is None else recommendation.conformity
    # What speaks against the calibration speaks against what follows from it, too, and is said once.
    more = [] if recommendation is None else [r for r in recommendation.verdict.reasons if r not in verdict.reasons]
    of_lots = posterior.experiment.pooling == "partial"  # of which what is of specimens stands in the table alone
    rows = [r for r in parameter_rows(posterior) if r.parameter in SENSOR_PARAMETERS]
    rows = [r for r in rows if not (of_lots and r.where and r.parameter in POOLED)]
    lights = len(verdict.reasons) + len(more)
    shown = _specimens(rows)
    context = {
        "verdict": verdict,
        "status": status_in_words(verdict),
        "passed": passed_gates(posterior, verdict),
        "sentences": summary_sentences(posterior),
        "recommendation": recommendation,
        "advice_status": "" if recommendation is None else status_in_words(recommendation.verdict, "the advice"),
        "beyond": more,
        "conforms": "" if conformity is None else percent(conformity.best.best_probability),
        "rows": [r for r in rows if not r.where],
        "specimens": shown[:_MOST_SPECIMENS],
        "left_out": max(0, len(shown) - _MOST_SPECIMENS),
        "columns": {r.label: (r.symbol, r.unit) for r in rows if r.where},
        "conditions": _conditions(results),
        "picture": results.picture(results.signal_picture) if results.signal_picture else None,
        # More than that does not fit onto one sheet, and the next section follows on where it ends.
        "one_sheet": lights <= _MOST_LIGHTS,
    }
    return Section("verdict", "", "", "headline.html.j2", context)


def _specimens(rows: Sequence[ParameterRow]) -> list[tuple[str, dict[str, ParameterRow]]]:
    """What each specimen is made of: its name, and its rows by label."""
    found: dict[str, dict[str, ParameterRow]] = {}
    for row in rows:
        if row.where:
            found.setdefault(row.where, {})[row.label] = row
    return list(found.items())


def _conditions(results: Results) -> tuple[str, ...]:
    """What the numbers hold for, in words."""
    posterior, recommendation = results.posterior, results.recommendation
    if recommendation is not None:
        c = recommendation.conformity
        return recommendation.conditions if c is None else c.conditions
    models = [m.model for m in posterior.diagnostics.models] or [model_in_words(posterior.experiment)]
    balls = " and ".join(f"{r * 1e3:g}" for r in sorted({sweep.indenter_radius for sweep in posterior.sweeps}))
    return (
        *models,
        f"ball radius {balls} mm, disc radius {posterior.experiment.sensor_radius * 1e3:g} mm",
        f"forces up to {largest_force(posterior):.2g} N, the largest measured",
    )


def summary_sentences(posterior: Posterior) -> str:
    """Say what came out in a few sentences: the material, and where the data said nothing.

    Parameters
    ----------
    posterior : the result.
    """
    rows = {row.name: row for row in parameter_rows(posterior)}
    parts = []
    whose = "lot" if posterior.experiment.pooling == "partial" else "silicone"
    if "young_modulus" in rows:
        parts.append(f"Young's modulus of the {whose} is {rows['young_modulus'].value} {rows['young_modulus'].unit}")
    if "relative_permittivity" in rows:
        parts.append(f"its relative permittivity {rows['relative_permittivity'].value}")
    text = " and ".join(parts) + " (mean ± one standard deviation). " if parts else ""
    few = told_by_few(posterior)
    text += _spreads(rows, few)
    said = SPREADS if few else ()  # that they are what was believed
    driven = [_called(r) for r in rows.values() if r.learned == PRIOR_DRIVEN_WORDS and r.parameter not in said]
    if driven:
        text += f"The data hardly moved {_listed(driven)}: there the result is the prior, not the measurement."
    return text.strip()


def _spreads(rows: Mapping[str, ParameterRow], few: str) -> str:
    """How far specimens of a lot differ, in a sentence, with what few of them cannot tell; empty under complete pooling."""
    labels = {q: QUANTITIES[q].label.removesuffix(" of the sensor") for q in POOLED if spread_of(q) in rows}
    if not labels:
        return ""
    told = [f"{rows[spread_of(q)].value} % in {label}" for q, label in labels.items()]
    return f"Its specimens differ by {', '.join(told)} (one standard deviation of the lot){few}. "


def _called(row: ParameterRow) -> str:
    return f"{row.label} ({row.where})" if row.where else row.label


def _listed(words: Sequence[str]) -> str:
    """Words as a part of a sentence: all of them, or the first three and how many more there are."""
    if len(words) > 4:
        words = [*words[:3], f"{len(words) - 3} more"]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]

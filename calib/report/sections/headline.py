"""What came out, for somebody who reads nothing else: whether to use it, what speaks against it, the main numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from calib.catalogue import POOLED, QUANTITIES, SPREADS, spread_of
from calib.checks import LEARNED, Colour, passed_gates
from calib.decision import largest_in_words, measured_presses, percent, void_in_words
from calib.enumeration import first_of
from calib.experiment import model_in_words
from calib.report.first_sheet import MOST_SPECIMENS, crowded, in_lines
from calib.report.put_in import put_in_conditions
from calib.report.rows import PRIOR_DRIVEN_WORDS, SENSOR_PARAMETERS, ParameterRow, few_specimens_in_words, parameter_rows
from calib.report.section import Results, Section
from calib.report.status import status_in_words
from calib.report.unseen import exact_conditions, not_seen
from calib.sampling import Posterior

ORDER = 10

# With so few reasons the first sheet of paper has room for a larger picture.
_FEW = 2

_NO_RESULT = (
    "There are no results. What the draws say of modulus and thicknesses is struck through here and in the tables, where it "
    "only serves to find the cause."
)


def section(results: Results) -> Section:
    """Show what came out, at the head of the report."""
    posterior, verdict, recommendation = results.posterior, results.verdict, results.recommendation
    conformity = None if recommendation is None else recommendation.conformity
    more = results.against_advice
    of_lots = posterior.experiment.pooling == "partial"  # of which what is of specimens stands in the table alone
    rows = [r for r in parameter_rows(posterior) if r.parameter in SENSOR_PARAMETERS]
    rows = [r for r in rows if not (of_lots and r.where and r.parameter in POOLED)]
    shown = _specimens(rows)
    cards = [r for r in rows if not r.where]
    sentences = _NO_RESULT if results.void else summary_sentences(posterior)
    advice = "" if recommendation is None else recommendation.in_short if conformity is None else conformity.in_short
    status = status_in_words(verdict)
    advice_status = "" if recommendation is None else status_in_words(recommendation.verdict, "the advice")
    advised: Colour | None = None if recommendation is None else recommendation.verdict.colour
    if advised is not None and results.void:  # it may be of before, when the verdict was a better one
        advice, advised = void_in_words(verdict), "red"
        advice_status = status_in_words(verdict, "the advice")
    unseen = not_seen(results)
    lines, left_out = in_lines(results) if crowded(results) else ((), 0)
    context = {
        "verdict": verdict,
        "void": results.void,
        "advised": advised,
        "status": status,
        "passed": passed_gates(posterior, verdict),
        "sentences": sentences,
        "unseen": unseen,
        "advice": advice,
        "recommendation": recommendation,
        "advice_status": advice_status,
        "beyond": more,
        "crowded": crowded(results),
        "lines": [line for line in lines if line[0] in verdict.reasons],
        "lines_of_advice": [line for line in lines if line[0] not in verdict.reasons],
        "left_out_reasons": left_out,
        "stale": results.stale,
        "conforms": "" if conformity is None else percent(conformity.best.best_probability),
        "rows": cards,
        "specimens": shown[:MOST_SPECIMENS],
        "left_out": max(0, len(shown) - MOST_SPECIMENS),
        "columns": {r.label: (r.symbol, r.unit) for r in rows if r.where},
        "conditions": (*_conditions(results), *exact_conditions(results), *put_in_conditions(results)),
        "tall": conformity is not None and not results.void,
        "roomy": len(verdict.reasons) + len(more) <= _FEW,
        "picture": results.picture(results.signal_picture) if results.signal_picture else None,
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
        largest_in_words(measured_presses(posterior)),
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
    text += _put_in(posterior, rows)
    few = few_specimens_in_words(posterior)
    text += _spreads(rows, few)
    said = SPREADS if few else ()  # that they are what was believed
    driven = [_called(r) for r in rows.values() if r.learned == PRIOR_DRIVEN_WORDS and r.parameter not in said]
    if driven:
        text += f"The data hardly moved {first_of(driven)}: there the result is the prior, not the measurement."
    return text.strip()


def _put_in(posterior: Posterior, rows: Mapping[str, ParameterRow]) -> str:
    """That a permittivity is mostly what was put in, where it is; of the modulus the verdict speaks."""
    summary = posterior.diagnostics.parameters.get("relative_permittivity")
    if "relative_permittivity" not in rows or summary is None or summary.prior_contraction >= LEARNED:
        return ""
    if rows["relative_permittivity"].learned == PRIOR_DRIVEN_WORDS:
        return ""  # said with all others that are
    share = f"{100 * summary.prior_contraction:.0f} %"
    return f"Of this permittivity the data taught {share}: it is mostly what was put in, and as right as that was. "


def _spreads(rows: Mapping[str, ParameterRow], few: str) -> str:
    """How far specimens of a lot differ, in a sentence, with what few of them cannot tell; empty under complete pooling."""
    labels = {q: QUANTITIES[q].label.removesuffix(" of the sensor") for q in POOLED if spread_of(q) in rows}
    if not labels:
        return ""
    told = [f"{rows[spread_of(q)].value} % in {label}" for q, label in labels.items()]
    return f"Its specimens differ by {', '.join(told)} (one standard deviation of the lot){few}. "


def _called(row: ParameterRow) -> str:
    return f"{row.label} ({row.where})" if row.where else row.label

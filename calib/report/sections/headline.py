"""What came out, for somebody who reads nothing else: whether to use it, a few sentences, the main numbers."""

from __future__ import annotations

from collections.abc import Sequence

from calib.checks import Prediction
from calib.lab import quality_in_words
from calib.report.rows import AGAINST_PRIOR_WORDS, PRIOR_DRIVEN_WORDS, SENSOR_PARAMETERS, ParameterRow, parameter_rows
from calib.report.section import Results, Section
from calib.sampling import Posterior

ORDER = 10


def section(results: Results) -> Section:
    """Show what came out, at the head of the report."""
    posterior, d = results.posterior, results.posterior.diagnostics
    verdicts = [v for s in posterior.sweeps for v in s.verdicts]
    fits = not _doubtful(results.predictions)
    context = {
        "good": d.usable and fits,
        "status": _status(posterior, fits),
        "reasons": d.reasons_against_use,
        "more_sampling": not d.converged,
        "other_model": d.surrogate_honest is False,
        "sentences": summary_sentences(posterior, results.predictions),
        "bad_data": quality_in_words(verdicts) if any(v.level == "bad" for v in verdicts) else "",
        "warnings": d.warnings,
        "recommendation": results.recommendation,
        "rows": [r for r in parameter_rows(posterior) if r.parameter in SENSOR_PARAMETERS],
    }
    return Section("verdict", "", "", "headline.html.j2", context)


def summary_sentences(posterior: Posterior, predictions: Sequence[Prediction]) -> str:
    """Say what came out in a few sentences.

    Parameters
    ----------
    posterior : the result.
    predictions : of its sweeps.

    Returns
    -------
    str
        The material, whether the model describes the data, and where the data said nothing or contradict what was believed.
    """
    rows = {row.name: row for row in parameter_rows(posterior)}
    parts = []
    if "young_modulus" in rows:
        parts.append(f"Young's modulus of the silicone is {rows['young_modulus'].value} {rows['young_modulus'].unit}")
    if "relative_permittivity" in rows:
        parts.append(f"its relative permittivity {rows['relative_permittivity'].value}")
    text = " and ".join(parts) + " (mean ± one standard deviation). " if parts else ""
    doubtful = _doubtful(predictions)
    if doubtful:
        text += f"The model does not describe {_listed(doubtful)} within what it claims: look at the residuals first. "
    else:
        text += "The model describes every sweep within its uncertainty. "
    driven = [_called(r) for r in rows.values() if r.learned == PRIOR_DRIVEN_WORDS]
    if driven:
        text += f"The data hardly moved {_listed(driven)}: there the result is the prior, not the measurement. "
    against = [_called(r) for r in rows.values() if r.learned == AGAINST_PRIOR_WORDS]
    if against:
        text += f"The data contradict the prior of {_listed(against)}: "
        text += "check it, or what the model leaves out, before using the rest."
    return text.strip()


def _status(posterior: Posterior, fits: bool) -> str:
    d = posterior.diagnostics
    if not d.converged:
        return "Not converged: the numbers below are preliminary. Do not build on them."
    if not d.usable:
        return (
            f"Converged, but the {posterior.forward_name} is off the finite elements by more than it states: the numbers below "
            "are preliminary. Do not build on them."
        )
    if not fits:
        return "Converged, but the model does not describe all data. Look at the residuals before using the numbers."
    return "Converged: the numbers below can be used."


def _doubtful(predictions: Sequence[Prediction]) -> list[str]:
    """Channels that the model does not describe."""
    return [f"the {kind} of {p.title}" for p in predictions for kind, channel in p.channels.items() if not channel.check.passed]


def _called(row: ParameterRow) -> str:
    return f"{row.label} ({row.where})" if row.where else row.label


def _listed(words: Sequence[str]) -> str:
    if len(words) > 4:
        words = [*words[:3], f"{len(words) - 3} more"]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]

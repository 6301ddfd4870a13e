"""What came out, for somebody who reads nothing else: whether to use it, a few sentences, the main numbers."""

from __future__ import annotations

from collections.abc import Sequence

from calib.report.judgement import judge_run, listed
from calib.report.rows import AGAINST_PRIOR_WORDS, PRIOR_DRIVEN_WORDS, SENSOR_PARAMETERS, ParameterRow, parameter_rows
from calib.report.section import Results, Section
from calib.sampling import Posterior

ORDER = 10


def section(results: Results) -> Section:
    """Show what came out, at the head of the report."""
    posterior, d = results.posterior, results.posterior.diagnostics
    judged = judge_run(posterior, results.predictions)
    context = {
        "good": judged.good,
        "status": judged.status,
        "reasons": d.reasons_against_use,
        "more_sampling": not d.converged,
        "other_model": d.surrogate_honest is False,
        "sentences": summary_sentences(posterior, judged.misfits),
        "bad_data": judged.bad_data,
        "warnings": d.warnings,
        "recommendation": results.recommendation,
        "rows": [r for r in parameter_rows(posterior) if r.parameter in SENSOR_PARAMETERS],
    }
    return Section("verdict", "", "", "headline.html.j2", context)


def summary_sentences(posterior: Posterior, misfits: Sequence[str]) -> str:
    """Say what came out in a few sentences.

    Parameters
    ----------
    posterior : the result.
    misfits : channels that the model does not describe.

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
    if misfits:
        text += f"The model does not describe {listed(misfits)} within what it claims: look at the residuals first. "
    else:
        text += "The model describes every sweep within its uncertainty. "
    driven = [_called(r) for r in rows.values() if r.learned == PRIOR_DRIVEN_WORDS]
    if driven:
        text += f"The data hardly moved {listed(driven)}: there the result is the prior, not the measurement. "
    against = [_called(r) for r in rows.values() if r.learned == AGAINST_PRIOR_WORDS]
    if against:
        text += f"The data contradict the prior of {listed(against)}: "
        text += "check it, or what the model leaves out, before using the rest."
    return text.strip()


def _called(row: ParameterRow) -> str:
    return f"{row.label} ({row.where})" if row.where else row.label

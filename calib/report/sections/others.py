"""What else the data would say: models that differ in one choice, and specimens that the others do not predict."""

from __future__ import annotations

import math
from dataclasses import dataclass

from calib.catalogue import QUANTITIES
from calib.checks import BAYES_LIMITS, RULED_OUT, departure_in_words
from calib.digits import with_uncertainty
from calib.report.section import Results, Section
from calib.sampling import Departure, FirstEstimate, Posterior

ORDER = 46

_TITLE = "Other models of these data"
# Specimens held against the others that are shown: those that lie furthest off.
_MOST = 5


def section(results: Results) -> Section | None:
    """Show the models that were held against the data, and specimens against each other; None if neither was done."""
    d = results.posterior.diagnostics
    if not d.departures and not d.foretold and not d.strangers and d.without_discrepancy is None:
        return None
    predicted = [
        (f.specimen, f.channel, _sized(f.ratio), f"{abs(f.z):.1f}") for f in sorted(d.foretold, key=lambda f: -abs(f.z))
    ]
    of_lot = [
        (s.specimen, QUANTITIES[s.quantity].label, _sized(s.ratio), f"{abs(s.z):.1f}")
        for s in sorted(d.strangers, key=lambda s: -abs(s.z))
    ]
    context = {
        "average": bool(d.models),
        "models": other_models(results.posterior),
        "without": _without_discrepancy(results.posterior),
        "predicted": predicted[:_MOST],
        "of_lot": of_lot[:_MOST],
    }
    return Section("others", _TITLE, "Other models", "others.html.j2", context)


def _without_discrepancy(posterior: Posterior) -> str:
    """Say what the fit without discrepancy makes of these data; "" where that is not known."""
    found = posterior.diagnostics.without_discrepancy
    return "" if found is None or math.isnan(found.log_bayes) else departure_in_words(found, posterior)


def _sized(ratio: FirstEstimate) -> str:
    return with_uncertainty(ratio.mean, ratio.sd)


@dataclass(frozen=True)
class OtherModel:
    """One other model, ready to print: its choices, the Bayes factor for it, what that means, Young's modulus under it."""

    model: str
    factor: str
    meaning: str
    young_modulus: str


def other_models(posterior: Posterior) -> list[OtherModel]:
    """Make the rows of the table of other models, those that describe the data best first, those without an answer last."""
    known = [d for d in posterior.diagnostics.departures if not math.isnan(d.log_bayes)]
    unknown = [d for d in posterior.diagnostics.departures if math.isnan(d.log_bayes)]
    return [_row(d) for d in (*sorted(known, key=lambda d: -d.log_bayes), *unknown)]


def _row(d: Departure) -> OtherModel:
    k = QUANTITIES["young_modulus"].display_scale
    modulus = "" if d.young_modulus is None else with_uncertainty(d.young_modulus.mean * k, d.young_modulus.sd * k)
    if math.isnan(d.log_bayes):
        return OtherModel(d.model, "not known", "it could not be asked quickly: calib compare", modulus)
    better = d.log_bayes > BAYES_LIMITS["amber"]
    meaning = "ask for it" if better else "rule it out" if d.log_bayes < RULED_OUT else "do not rule it out"
    return OtherModel(d.model, f"{math.exp(min(d.log_bayes, 700.0)):.2g}", meaning, modulus)

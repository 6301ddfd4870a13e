"""Which models were averaged, how much each counts, and what each would say by itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calib.catalogue import QUANTITIES
from calib.decision import Recommendation
from calib.digits import with_uncertainty
from calib.report.section import Results, Section
from calib.sampling import Averaged, Posterior, share_between

ORDER = 44

_TITLE = "Models that were averaged"

# Ways to weight models, as headings.
_WAYS = {"stacking": "by stacking", "pseudo-bma": "by pseudo-BMA+", "evidence": "by evidence"}


def section(results: Results) -> Section | None:
    """Show the models of an average; None for a posterior of one model."""
    models = results.posterior.diagnostics.models
    if not models:
        return None
    advice = None if results.void else results.recommendation
    context = {
        "by": weighting_in_words(results.posterior),
        "ways": [heading for way, heading in _WAYS.items() if all(way in m.weights for m in models)],
        "models": averaged_models(models, advice),
        "share": modulus_share(models),
        "recommendation": advice,
    }
    return Section("average", _TITLE, "Models", "average.html.j2", context)


@dataclass(frozen=True)
class AveragedModel:
    """One model of an average, ready to print."""

    name: str
    model: str
    weight: str
    interval: str
    weights: tuple[str, ...]
    young_modulus: str
    change: str
    best: str


def averaged_models(models: tuple[Averaged, ...], recommendation: Recommendation | None) -> list[AveragedModel]:
    """Make the rows of the table of models, those of most weight first.

    Parameters
    ----------
    models : of the average.
    recommendation : that was made from it; None if none was.
    """
    k = QUANTITIES["young_modulus"].display_scale
    said = {} if recommendation is None else {m.name: m for m in recommendation.of_models}
    rows = []
    for m in sorted(models, key=lambda m: -m.weight):
        own = said.get(m.name)
        modulus = "fixed" if m.young_modulus is None else with_uncertainty(m.young_modulus.mean * k, m.young_modulus.sd * k)
        change = with_uncertainty(100 * own.change[0], 100 * own.change[1]) if own is not None and own.n_draw > 1 else "-"
        best = f"{own.best * 1e3:.2f}" if own is not None and np.isfinite(own.best) else "-"
        weights = tuple(f"{m.weights[way]:.2f}" for way in _WAYS if way in m.weights)
        interval = f"{m.interval[0]:.2f} to {m.interval[1]:.2f}"
        rows.append(AveragedModel(m.name, m.model, f"{m.weight:.2f}", interval, weights, modulus, change, best))
    return rows


def modulus_share(models: tuple[Averaged, ...]) -> str:
    """Share of the variance of Young's modulus that is the choice of model, for people; "" where a model fixes it."""
    known = [(m.weight, m.young_modulus.mean, m.young_modulus.sd) for m in models if m.young_modulus is not None]
    return f"{100 * share_between(*zip(*known, strict=True)):.0f} %" if len(known) == len(models) else ""


def weighting_in_words(posterior: Posterior) -> str:
    """What the models of an average are weighted by."""
    return _WAYS[posterior.attrs["averaged by"]]

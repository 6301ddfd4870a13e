"""Runs of the same data under different models in, one posterior that is an average over the models out.

No model is chosen: draws of each are taken in proportion to its weight, so that what is not known of the model is part of the
uncertainty. The average holds the unknowns that all models have, and the padding's modulus where some take it to be the
sensor's. What is predicted each model predicts for its own draws (`calib.checks.member`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib.checks.comparison import ComparedModel
from calib.checks.member import Member, OfEach, shares
from calib.checks.reasons import OF_MODELS
from calib.checks.reweighting import problem_of
from calib.checks.verdict import Reason, Verdict, reasons_to_text
from calib.checks.weights import USUAL, Weighting, Weights, model_weights
from calib.errors import Fault, InputError
from calib.experiment import model_in_words
from calib.problem import ParameterInfo, of_lot
from calib.sampling import (
    K_HAT,
    Averaged,
    Convergence,
    Departure,
    Diagnostics,
    FirstAnswer,
    FirstEstimate,
    ParameterSummary,
    Posterior,
    first_answer,
    summarise,
)
from models.response import Forward
from models.sensor import FloatArray, IntArray

#: What speaks against a model of less weight than this does not speak against the average.
NOTICEABLE = 0.05

# Logarithm of a weight that is none.
_NO_WEIGHT = -700.0
# Takes the value of another unknown where the padding is of the sensor's silicone.
_PADDING, _SENSOR = "padding_young_modulus", "young_modulus"


@dataclass(frozen=True, eq=False)
class AverageMember:
    """One model of the data, as calibrated, that is to be averaged with others.

    Attributes
    ----------
    name : of the run, other than that of the others.
    posterior, forward : what was found, and the model that it was sampled with.
    verdict : on the run.
    sha256 : hash of its posterior's file; "" if it is not kept.
    """

    name: str
    posterior: Posterior
    forward: Forward
    verdict: Verdict
    sha256: str = ""


def average_models(
    models: Sequence[AverageMember], candidates: Sequence[ComparedModel], by: Weighting = USUAL
) -> tuple[Posterior, tuple[Member, ...]]:
    """Average the posteriors of several models of the same data, weighted by how well each describes them.

    Parameters
    ----------
    models : as calibrated, the experiment's own first.
    candidates : the same compared, from `calib.checks.compare_runs`, in any order.
    by : what they are weighted by, see `calib.checks.weights`.

    Returns
    -------
    The average, with the models and their weights in `diagnostics.models`; and the models, to predict with.

    Raises
    ------
    InputError
        If the weights that are asked for cannot be had.
    """
    found = _weights(models, {c.name: c.left_out.pointwise for c in candidates})
    if by not in found:
        message = f"the models cannot be weighted by {by}, as there is no evidence of all of them"
        raise InputError(Fault(message, advice=f"Weight them with --by {USUAL}"))
    weights = found[by]
    told = tuple(
        Averaged(
            name=m.name,
            model=model_in_words(m.posterior.experiment),
            forward=f"{m.forward.name}, {m.forward.identity}",
            sha256=m.sha256,
            weight=float(weights.value[k]),
            interval=(float(weights.low[k]), float(weights.high[k])),
            weights={way: float(own.value[k]) for way, own in found.items()},
            young_modulus=_modulus(m.posterior),
        )
        for k, m in enumerate(models)
    )
    members = tuple(Member(m.name, m.posterior, m.forward, t.weight) for m, t in zip(models, told, strict=True))
    posterior = _mixed(models, told, _outside(models, found, weights.value))
    doubted = _doubted(models, weights.value, candidates) if by != "evidence" else ()
    reasons = reasons_to_text((*_reasons(models, weights.value), *doubted))
    attrs = {**posterior.attrs, "averaged by": by, OF_MODELS: reasons}
    return replace(posterior, attrs=attrs), members


def _weights(models: Sequence[AverageMember], pointwise: Mapping[str, FloatArray]) -> Mapping[Weighting, Weights]:
    answers = [_evidence(m) for m in models]
    evidence = np.array([math.nan if answer is None else answer.log_evidence for answer in answers])
    error = np.array([math.nan if answer is None else answer.effective_draws**-0.5 for answer in answers])
    return model_weights(np.stack([pointwise[m.name] for m in models]), evidence, error)


def _evidence(model: AverageMember) -> FirstAnswer | None:
    """The first answer of a run, for its evidence: as kept, else once more from where the draws are; None if there is none.

    One that is rough, or found another mode than the draws are at, has no say.
    """
    kept, found = model.posterior.diagnostics.first_answer, model.posterior.diagnostics.parameters
    if kept is not None and math.isfinite(kept.log_evidence) and not (kept.rough or _is_elsewhere(kept, found)):
        return kept
    if model.posterior.experiment.model == "fem":  # which would take hours
        return None
    near = {name: s.mean for name, s in found.items()}
    try:
        return first_answer(problem_of(model.posterior, model.forward), near)
    except ValueError:
        return None


def _is_elsewhere(first: FirstAnswer, found: Mapping[str, ParameterSummary]) -> bool:
    return any(abs(own.mean - found[name].mean) > found[name].sd for name, own in first.parameters.items())


def _modulus(posterior: Posterior) -> FirstEstimate | None:
    found = posterior.diagnostics.parameters.get(_SENSOR)
    return None if found is None else FirstEstimate(found.mean, found.sd)


def _mixed(models: Sequence[AverageMember], told: tuple[Averaged, ...], departures: tuple[Departure, ...]) -> Posterior:
    """Draws of all models in one posterior, in an order that tells nothing: chains of an average have no history."""
    posteriors = [m.posterior for m in models]
    first, weight = posteriors[0], np.array([t.weight for t in told])
    n_chain, n_draw = (min(p.draws.shape[k] for p in posteriors) for k in (0, 1))
    rng = np.random.default_rng(first.seed)
    counts = shares(weight, n_draw)
    picked = [
        [rng.choice(p.draws.shape[1], int(own), replace=False) for p, own in zip(posteriors, counts, strict=True)]
        for _ in range(n_chain)
    ]
    order = [rng.permutation(n_draw) for _ in range(n_chain)]

    def mixed(columns: Sequence[FloatArray]) -> FloatArray:
        """One column of each model, (n_chain, n_draw, ...), picked and shuffled."""
        chains = (
            np.concatenate([c[chain][own] for c, own in zip(columns, picked[chain], strict=True)])[order[chain]]
            for chain in range(n_chain)
        )
        return np.stack(list(chains))

    columns = [_columns(p) for p in posteriors]
    infos = {info.name: info for p in reversed(posteriors) for info in p.parameters}
    parameters = tuple(info for name, info in infos.items() if all(name in c for c in columns))
    order_of = [p.name for p in first.parameters] + list(infos)
    lot = [info.name for info in of_lot(first)]  # which posteriors have last
    parameters = tuple(sorted(parameters, key=lambda info: (info.name in lot, order_of.index(info.name))))
    draws = np.stack([mixed([c[info.name] for c in columns]) for info in parameters], axis=-1)
    fixed = {n: v for n, v in first.fixed.items() if all(p.fixed.get(n) == v for p in posteriors)}
    of_model: IntArray = mixed([np.full(p.draws.shape[:2], k) for k, p in enumerate(posteriors)]).astype(np.int64)
    ended = max(p.attrs.get("ended", "") for p in posteriors)
    return Posterior(
        experiment=first.experiment,
        sweeps=first.sweeps,
        parameters=parameters,
        fixed=fixed,
        forward_name=forward_of_average(len(models)).name,
        draws=draws,
        log_prob=mixed([p.log_prob for p in posteriors]),
        log_likelihood=mixed([p.log_likelihood for p in posteriors]),
        blocks=first.blocks,
        n_walkers=1,
        seed=first.seed,
        diagnostics=_diagnostics(posteriors, told, parameters, draws, departures),
        attrs=_made_with(posteriors) | ({"ended": ended} if ended else {}),
        of_model=of_model,
    )


def _made_with(posteriors: Sequence[Posterior]) -> dict[str, str]:
    """What the draws of all models were made with, versions, platform and commit; where they differ, each that is told."""
    keys = dict.fromkeys(k for p in posteriors for k in p.attrs if k.startswith("version of ") or k in ("platform", "commit"))
    told = {key: dict.fromkeys(p.attrs.get(key, "not told") for p in posteriors) for key in keys}
    return {key: "; ".join(values) for key, values in told.items()}


def forward_of_average(n_model: int) -> OfEach:
    """What stands for the forward model of an average of so many models."""
    return OfEach(f"average of {n_model} models")


def _columns(posterior: Posterior) -> dict[str, FloatArray]:
    """Draws of every quantity of a model, (n_chain, n_draw) each: unknown, fixed, or by another of its quantities."""
    found = {p.name: posterior.draws[..., k] for k, p in enumerate(posterior.parameters)}
    found |= {name: np.full(posterior.draws.shape[:2], value) for name, value in posterior.fixed.items()}
    if posterior.experiment.padding_material == "sensor" and _SENSOR in found:
        found[_PADDING] = found[_SENSOR]
    return found


def _diagnostics(
    posteriors: Sequence[Posterior],
    told: Sequence[Averaged],
    parameters: tuple[ParameterInfo, ...],
    draws: FloatArray,
    departures: tuple[Departure, ...],
) -> Diagnostics:
    """Whether the draws of an average may be used: where those of each model that counts may."""
    counting = [(t, p) for t, p in zip(told, posteriors, strict=True) if t.weight >= NOTICEABLE]
    every = [p.diagnostics for p in posteriors]
    checks = [d.spot_check for d in (p.diagnostics for _, p in counting) if d.spot_check is not None]
    worst = max(checks, key=lambda c: max(c.force_score, c.change_score) if c.stated else 0.0, default=None)
    heaviest = max(counting, key=lambda pair: pair[0].weight)[1].diagnostics
    values = draws.reshape(-1, len(parameters))
    theta = np.stack([info.prior.to_normal(values[:, k]) for k, info in enumerate(parameters)], axis=1)
    state = _convergence(counting, parameters, min(d.steps for d in every))
    return Diagnostics(
        converged=all(p.diagnostics.converged for _, p in counting),
        reasons=tuple(f"{t.name}: {reason}" for t, p in counting for reason in p.diagnostics.reasons),
        warnings=tuple(f"{t.name}: {warning}" for t, p in counting for warning in p.diagnostics.warnings),
        parameters=summarise(parameters, values, theta, state),
        steps=state.steps,
        burn_in=max(d.burn_in for d in every),
        thin=1,
        n_walker=1,
        acceptance_fraction=(),
        tau={info.name: float(tau) for info, tau in zip(parameters, state.tau, strict=True)},
        gate=every[0].gate,
        spot_check=worst,
        departures=departures,
        foretold=heaviest.foretold,
        strangers=heaviest.strangers,
        models=tuple(told),
    )


def _convergence(
    counting: Sequence[tuple[Averaged, Posterior]], parameters: Sequence[ParameterInfo], steps: int
) -> Convergence:
    """That of the models: the largest R-hat, and so many draws as a weighted mean of their means is worth."""
    rows = []
    for info in parameters:
        known = [(t.weight, p.diagnostics, name) for t, p in counting if (name := _chain_of(p, info.name))]
        summaries = [(w, d.parameters[name]) for w, d, name in known]
        total = sum(w for w, _ in summaries)
        ess = [
            total**2 / sum(w**2 / n for w, n in sizes) if total else math.inf
            for sizes in ([(w, s.ess_bulk) for w, s in summaries], [(w, s.ess_tail) for w, s in summaries])
        ]
        tau = max((d.tau.get(name, math.nan) for _, d, name in known), default=math.nan)
        rows.append((max((s.r_hat for _, s in summaries), default=1.0), *ess, tau))
    r_hat, bulk, tail, tau = np.array(rows).T
    return Convergence(r_hat, bulk, tail, tau, steps)


def _chain_of(posterior: Posterior, name: str) -> str:
    """Name of the unknown of a model whose draws a quantity of the average has; "" where it is fixed."""
    known: Mapping[str, ParameterSummary] = posterior.diagnostics.parameters
    return name if name in known else _SENSOR if name == _PADDING and _SENSOR in known else ""


def _outside(models: Sequence[AverageMember], found: Mapping[Weighting, Weights], weight: FloatArray) -> tuple[Departure, ...]:
    """Models beside those averaged that were held against the data, with their Bayes factor against the average."""
    probable = found["evidence"].value if "evidence" in found else weight
    inside = {model_in_words(m.posterior.experiment) for m in models}
    best: dict[str, Departure] = {}
    for m, p in zip(models, probable, strict=True):
        # p(y) of the average is the mean of those of its models, of which p is the share of this one.
        shift = max(math.log(p * len(models)), _NO_WEIGHT) if p > 0 else _NO_WEIGHT
        for d in m.posterior.diagnostics.departures:
            other = best.get(d.model)
            log_bayes = d.log_bayes + shift
            if d.model not in inside and (other is None or not other.log_bayes >= log_bayes):
                best[d.model] = replace(d, name=f"{m.name}, {d.name}", log_bayes=log_bayes)
    return tuple(best.values())


def _doubted(models: Sequence[AverageMember], weight: FloatArray, candidates: Sequence[ComparedModel]) -> Iterator[Reason]:
    """Weights by left-out blocks are doubtful where a model that counts has blocks that cannot be left out."""
    counting = {m.name for m, w in zip(models, weight, strict=True) if w >= NOTICEABLE}
    bad = {c.name: len(c.left_out.doubtful) for c in candidates if c.name in counting and not c.left_out.trusted}
    if bad:
        told = ", ".join(f"{n} block{'s' if n > 1 else ''} of data under {name}" for name, n in bad.items())
        finding = f"how well models predict {told} cannot be told (k-hat above {K_HAT:g}), and their weights may be wrong"
        yield Reason("weights", "amber", finding, "Average them with --by evidence, and see whether that changes the numbers")


def _reasons(models: Sequence[AverageMember], weight: FloatArray) -> Iterator[Reason]:
    """What speaks against the models that count, but for other models, which the average answers."""
    counting = [m for m, w in zip(models, weight, strict=True) if w >= NOTICEABLE]
    said: dict[Reason, list[str]] = {}
    for m in counting:
        for reason in m.verdict.reasons:
            if reason.gate != "model":
                said.setdefault(reason, []).append(m.name)
    for reason, names in said.items():
        under = "" if len(names) == len(counting) else f"under {' and '.join(names)}: "
        yield replace(reason, finding=f"{under}{reason.finding}")

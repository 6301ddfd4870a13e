"""A calibration and what is asked of it in, how that depends on the unknowns near the middle of its posterior out.

The target T is taken as linear in the unknowns, T = T_0 + g^T (z - z_0), with g by central differences over a third of the
posterior's own width, so that what draws of it do is what the slope says. Under partial pooling the lot's values are more
coordinates, mu of `calib.problem.lots`, behind those of the unknowns.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from calib.catalogue import SCALES, UnknownName
from calib.decision.known import Known
from calib.decision.requirement import Requirement
from calib.errors import Fault, InputError
from calib.problem import Lot, as_next_specimen, lookup, specimen_design, values_at
from calib.sampling import Posterior, thin_draws
from models.curves import DesignPrediction, predict_design
from models.sensor import FloatArray

#: What a measurement may be for.
Asked = Literal["modulus", "padding", "spec"]

_MODULUS = "young_modulus"
# Width of the differences as a share of the posterior's, and draws by which a signal's spread is told.
_WIDTH, _DRAWS = 0.3, 400
# Draws of the best signal by which regret is told, and the least number of thicknesses that it is told of.
_NORMALS, _FEW = 2000, 3


@dataclass(frozen=True, eq=False)
class LearningTarget:
    """What is to be known better.

    Attributes
    ----------
    asked : "modulus" or "padding".
    label : of the quantity, for people.
    mean, sd : SI, over the posterior's draws; all that is not known of it.
    by_unknowns : SI, the part of `sd` that the unknowns cause, which measurements can take away.
    slopes : (n_part, n_state), g; the specimens whose signal it is, or one row.
    along : (n_thickness, n_state), slopes of the mean signal on padding of each thickness; empty for a modulus.
    signal : (n_thickness,), its mean over the draws.
    regret : share of the best signal that is expected to be lost for want of knowledge; nan for a modulus.
    """

    asked: Asked
    label: str
    mean: float
    sd: float
    by_unknowns: float
    slopes: FloatArray
    along: FloatArray
    signal: FloatArray
    regret: float

    def variance(self, covariance_times: Callable[[FloatArray], FloatArray]) -> float:
        """Mean over its parts, and over draws of the scales, of g^T C g.

        Parameters
        ----------
        covariance_times : gives C g, (n_draw, n_state, n_part), for g (n_state, n_part).
        """
        product = covariance_times(self.slopes.T)
        return float(np.mean(np.einsum("ps,dsp->dp", self.slopes, product)))


def modulus_target(posterior: Posterior, known: Known) -> LearningTarget:
    """Young's modulus of the material, or of the lot, as what is asked.

    Parameters
    ----------
    posterior : of the calibration.
    known : the same.

    Raises
    ------
    InputError
        If it is fixed.
    """
    infos = [info.name for info in posterior.parameters]
    if _MODULUS not in infos:
        raise InputError(Fault("young_modulus is fixed in this run: there is nothing to learn of it", advice="Give it a prior"))
    draws = posterior.draws[..., infos.index(_MODULUS)]
    slopes = slopes_at_middle(known, lambda values: values[_MODULUS])
    label = "Young's modulus of the lot" if known.problem.experiment.pooling == "partial" else "Young's modulus"
    sd = float(np.std(draws))
    return LearningTarget("modulus", label, float(np.mean(draws)), sd, sd, slopes[None], np.empty((0, 0)), np.empty(0), np.nan)


def signal_target(
    posterior: Posterior, known: Known, wanted: Requirement, best: float, rng: np.random.Generator
) -> LearningTarget:
    """The signal at a load on the recommended padding as what is asked, and what is lost by recommending with what is known.

    Parameters
    ----------
    posterior : of the calibration.
    known : the same.
    wanted : load, thicknesses, and ball.
    best : [m], the thickness that is recommended.
    rng : of the draws.

    Raises
    ------
    InputError
        If the model does not cover the thickness that is recommended for all of the posterior.
    """
    forward, problem = known.problem.forward, known.problem
    specimens = tuple(dict.fromkeys(sweep.specimen for sweep in problem.sweeps))
    grid = np.append(np.linspace(wanted.lower, wanted.upper, wanted.n_thickness), best)

    def predicted(values: Mapping[str, FloatArray], specimen: str, thickness: float) -> DesignPrediction:
        design = specimen_design(posterior, values, specimen).draws()
        n_draw = np.size(design.sensor.thickness)
        if wanted.indenter_radius is not None:
            design = replace(design, indenter=replace(design.indenter, radius=np.full(n_draw, wanted.indenter_radius)))
        padding = replace(design.padding, thickness=np.full(n_draw, thickness))
        return predict_design(forward, replace(design, padding=padding), np.array([wanted.force]))

    def changes(values: Mapping[str, FloatArray]) -> FloatArray:
        """(n_draw, n_specimen, n_thickness)."""
        of_lot = all_as_lot(values, problem.table.lots)
        return np.stack(
            [np.stack([predicted(of_lot, s, h).change[:, 0] for h in grid], axis=-1) for s in specimens],
            axis=1,
        )

    values = thin_draws(posterior, _DRAWS, rng)
    of_draws = changes(values)
    slopes = slopes_at_middle(known, changes)
    covered = np.all(np.isfinite(slopes), axis=(0, 1)) & (np.mean(np.isfinite(of_draws), axis=(0, 1)) > 0.95)
    if not covered[-1]:
        advice = "Ask for a smaller --force or other thicknesses"
        where = f"{best * 1e3:.3g} mm of padding at {wanted.force:g} N"
        message = f"the {forward.name} does not cover {where} for all of the posterior"
        raise InputError(Fault(message, advice=advice))
    at_best = of_draws[:, :, -1]
    whole = as_next_specimen(values, problem.table.lots, rng) if problem.table.lots else values
    signals, own = [], []
    for specimen in specimens:
        p = predicted(whole, specimen, best)
        signals.append(p.change[:, 0])
        discrepancy = [_or_zero(lookup(values, f"{c}_discrepancy", specimen), p) for c in ("capacitance", "force")]
        shares = (discrepancy[0] * p.change[:, 0], p.change_slope[:, 0] * discrepancy[1] * wanted.force)
        own.append(p.change_error[:, 0] ** 2 + shares[0] ** 2 + shares[1] ** 2)
    thick = covered[:-1]
    mean = np.mean(of_draws[:, :, :-1][..., thick], axis=1)
    mean = mean[np.all(np.isfinite(mean), axis=1)]
    return LearningTarget(
        "padding",
        f"signal at {wanted.force:g} N on {best * 1e3:.3g} mm of padding",
        float(np.nanmean(signals)),
        float(np.sqrt(np.nanvar(signals) + np.nanmean(own))),
        float(np.sqrt(np.mean(np.nanvar(at_best, axis=0)))),
        slopes[:, :, -1].T,
        np.mean(slopes[:, :, :-1][..., thick], axis=1).T,
        np.mean(mean, axis=0) if len(mean) else np.empty(0),
        _regret_of_draws(mean),
    )


def regret(target: LearningTarget, before: FloatArray, after: FloatArray) -> float:
    """Expected regret after a measurement, by what it is now and the ratio of both when all is normal.

    With V ~ N(V_0, C) the signals on padding of each thickness and M ~ N(V_0, C - C') what will be expected of them after a
    measurement that leaves C', the regret is E[max V] - E[max M] of the best V; now it is E[max V] - max V_0.

    Parameters
    ----------
    target : with the signal along thickness.
    before, after : C and C', (n_thickness, n_thickness).
    """
    if target.signal.size < _FEW or not target.regret > 0:
        return target.regret
    rng = np.random.default_rng(0)
    normal = rng.standard_normal((_NORMALS, target.signal.size))
    normal = np.concatenate([normal, -normal])
    now, learned = (_gain_of_choice(target.signal, covariance, normal) for covariance in (before, before - after))
    return target.regret * max(now - learned, 0.0) / now if now > 0 else target.regret


def _gain_of_choice(mean: FloatArray, covariance: FloatArray, normal: FloatArray) -> float:
    """E[max V] - max E[V] of normal V."""
    value, vector = np.linalg.eigh(0.5 * (covariance + covariance.T))
    away = normal @ (vector * np.sqrt(np.maximum(value, 0.0))).T
    best = int(np.argmax(mean))
    return float(np.mean(np.max(mean + away, axis=1) - mean[best] - away[:, best]))


def _regret_of_draws(signal: FloatArray) -> float:
    """Share of the best signal (n_draw, n_thickness) that the thickness which is best on average loses on average."""
    if signal.shape[0] == 0 or signal.shape[1] < _FEW:
        return float("nan")
    best = int(np.argmax(np.mean(signal, axis=0)))
    top = np.max(signal, axis=1)
    return float(np.mean(top - signal[:, best]) / np.mean(top))


def _or_zero(value: FloatArray | None, p: DesignPrediction) -> FloatArray:
    return np.zeros(p.change.shape[0]) if value is None else value


def all_as_lot(values: Mapping[str, FloatArray], lots: Sequence[Lot]) -> dict[str, FloatArray]:
    """Draws in which every specimen of a lot is as the lot is on average, where the same was wanted of it.

    Parameters
    ----------
    values : draws by name, SI (n_draw,), with those of the lot.
    lots : the quantities that are pooled.
    """
    whole = dict(values)
    for lot in lots:
        own = [name for name in values if (key := UnknownName.parse(name)).parameter == lot.quantity and key.specimen]
        for k, name in enumerate(own):
            whole[name] = lot.prior.another(values[lot.quantity], np.zeros(1), k)
    return whole


def slopes_at_middle(known: Known, of: Callable[[Mapping[str, FloatArray]], FloatArray]) -> FloatArray:
    """Differentiate what follows from values of the unknowns, and those of the lot, at the middle of the posterior.

    Parameters
    ----------
    known : the calibration.
    of : gives it (n_draw, ...) at values by name, SI (n_draw,).

    Returns
    -------
    (n_state, ...); nothing follows from the scales.
    """
    n, lots = known.middle.size, known.problem.table.lots
    width = _WIDTH * np.std(known.draws, axis=0)
    width[[p.parameter in SCALES for p in known.problem.parameters]] = 0.0
    means = [_means_of(known, lot) for lot in lots]
    width = np.append(width, [_WIDTH * float(np.std(mean)) for mean in means])
    steps = np.diag(width)
    states = np.append(known.middle, [float(np.mean(mean)) for mean in means]) + np.concatenate([steps, -steps])
    values: dict[str, FloatArray] = dict(values_at(known.problem, states[:, :n]))
    for j, lot in enumerate(lots, n):
        values[lot.quantity] = lot.prior.at(states[:, j])
    found = np.asarray(of(values), dtype=float)
    half = found.shape[0] // 2
    shape = (half, *[1] * (found.ndim - 1))
    over, there = (column.reshape(shape) for column in (np.where(width > 0, 2 * width, 1.0), width > 0))
    return np.where(there, (found[:half] - found[half:]) / over, 0.0)


def _means_of(known: Known, lot: Lot) -> FloatArray:
    """Mean of the specimens of a lot in x, (n_draw,): about where mu is."""
    return np.asarray(np.mean(lot.prior.away(known.draws[:, lot.columns]), axis=1), dtype=float)

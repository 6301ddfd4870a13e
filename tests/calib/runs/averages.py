"""Posteriors made by hand in, the same under another model, or with another evidence, out: what tests of averages average."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from calib.catalogue import UnknownName
from calib.problem import ParameterInfo
from calib.sampling import FirstAnswer, Posterior


def believed(posterior: Posterior, log_evidence: float) -> Posterior:
    """The same with an evidence, and with blocks of data none of which pulls it."""
    rng = np.random.default_rng(1)
    tame = np.mean(posterior.log_likelihood, axis=(0, 1)) + 0.05 * rng.normal(size=posterior.log_likelihood.shape)
    first = FirstAnswer({}, 400.0, log_evidence=log_evidence)
    diagnostics = replace(posterior.diagnostics, first_answer=first)
    return replace(posterior, log_likelihood=tame, diagnostics=diagnostics)


def with_own_padding(posterior: Posterior, factor: float = 1.2, log_evidence: float = 0.0) -> Posterior:
    """The same with a padding of its own modulus, 0.9 times the sensor's, which itself is so many times what it was."""
    k = [p.name for p in posterior.parameters].index("young_modulus")
    info = ParameterInfo(UnknownName("padding_young_modulus"), posterior.parameters[k].prior)
    draws = posterior.draws.copy()
    draws[..., k] *= factor
    d = posterior.diagnostics
    own = d.parameters["young_modulus"]
    stiffer = replace(own, mean=own.mean * factor, sd=own.sd * factor)
    summaries = {**d.parameters, "young_modulus": stiffer, "padding_young_modulus": stiffer}
    made = replace(
        posterior,
        experiment=replace(posterior.experiment, padding_material="own"),
        parameters=(*posterior.parameters, info),
        draws=np.concatenate([draws, 0.9 * draws[..., k : k + 1]], axis=-1),
        diagnostics=replace(d, parameters=summaries, tau={**d.tau, "padding_young_modulus": 38.0}),
    )
    return believed(made, log_evidence)

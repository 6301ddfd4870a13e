"""Posterior in, summary.json and summary.csv out: the numbers of a calibration for other programs."""

from __future__ import annotations

import csv
import io
from dataclasses import asdict

from calib.checks import Verdict
from calib.records import record_to_text
from calib.sampling import Diagnostics, Posterior

# Layout of summary.json.
_FORMAT = 1
_VERSION_OF = "version of "


def summary_json(posterior: Posterior, verdict: Verdict) -> str:
    """Write the content of summary.json, a calibration for other programs: whether to use it, what it is of, every parameter.

    SI, with nan as null. `verdict` sums up all that speaks against the numbers. `converged` is a fact of the chains alone,
    `surrogate_honest` one of the forward model (null if not known); `reasons` holds what speaks against either, `warnings` what
    may be cut off at the end of the model's range. `models` holds those that were averaged, with their weights, `other_models`
    what was found of models that differ in one choice, `specimens_foretold` how well each specimen is predicted by the
    others, channel by channel, `specimens_apart` how much stiffer that makes them than the others (`pooling` "complete"),
    `specimens_of_lot` how far each is off the others of its lot (`pooling` "partial", where the parameter `young_modulus` is
    that of the lot), `prior_sensitivity` how much headlines hang on what was believed before. `first_answer` is what was
    estimated before sampling, and where the result differs. "format" changes when a key changes its meaning or goes.

    Parameters
    ----------
    posterior : the result.
    verdict : on it, see `calib.checks.judge_posterior`.
    """
    d = posterior.diagnostics
    inputs = {posterior.experiment.file_name: posterior.experiment.sha256}
    for sweep in posterior.sweeps:
        inputs |= dict(sweep.files)
    record = {
        "verdict": verdict.to_plain(),
        "converged": d.converged,
        "surrogate_honest": d.surrogate_honest,
        "reasons": list(d.reasons_against_use),
        "warnings": list(d.warnings),
        "spot_check": asdict(d.spot_check) if d.spot_check is not None else None,
        "reweighting": asdict(d.reweighting) if d.reweighting is not None else None,
        "first_answer": _first_answer(d),
        "models": [asdict(model) for model in d.models],
        "other_models": [asdict(departure) for departure in d.departures],
        "without_discrepancy": asdict(d.without_discrepancy) if d.without_discrepancy is not None else None,
        "blocks_foretold": [{"block": name, "z": z} for name, z in zip(posterior.blocks, d.block_z, strict=False)],
        "specimens_foretold": [asdict(f) for f in d.foretold],
        "specimens_apart": _apart(posterior),
        "prior_sensitivity": {name: {"diagnosis": s.diagnosis, **asdict(s)} for name, s in d.sensitivity.items()},
        "pooling": posterior.experiment.pooling,
        "specimens_of_lot": [asdict(s) for s in d.strangers],
        "seed": posterior.seed,
        "versions": {k.removeprefix(_VERSION_OF): v for k, v in posterior.attrs.items() if k.startswith(_VERSION_OF)},
        "inputs": [{"file": name, "sha256": digest} for name, digest in inputs.items()],
        "data_quality": [{"specimen": s.specimen, "sweep": s.name, **asdict(v)} for s in posterior.sweeps for v in s.grades],
        "parameters": {name: asdict(s) for name, s in d.parameters.items()},
    }
    return record_to_text("summary", _FORMAT, record)


def _apart(posterior: Posterior) -> list[dict[str, object]]:
    """Forces that others do not predict as moduli that differ, where specimens share one."""
    if posterior.experiment.pooling == "partial":
        return []
    forces = [found for found in posterior.diagnostics.foretold if found.channel == "force"]
    return [{"specimen": f.specimen, "reference": "the others", "ratio": asdict(f.ratio)} for f in forces]


def _first_answer(d: Diagnostics) -> dict[str, object] | None:
    if d.first_answer is None:
        return None
    note = "estimated before sampling: not the result"
    return {"note": note, "compared": d.first_answer_in_words, **asdict(d.first_answer)}


def summary_csv(posterior: Posterior) -> str:
    """Write the content of summary.csv: one line per parameter, SI."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    columns = ("unit", "mean", "sd", "median", "r_hat", "ess_bulk", "ess_tail", "prior_contraction", "prior_shift")
    writer.writerow(("parameter", *columns[:4], "interval_90_low", "interval_90_high", *columns[4:]))
    for name, s in posterior.diagnostics.parameters.items():
        row = asdict(s)
        writer.writerow((name, *(row[c] for c in columns[:4]), *s.interval_90, *(row[c] for c in columns[4:])))
    return text.getvalue()

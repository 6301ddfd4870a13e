"""How the run was made: command, seed, versions, hashes."""

from __future__ import annotations

import numpy as np

from calib.checks import OF_MODELS, UNSEEN, unseen_from_text
from calib.citation import PAPER, citation
from calib.experiment import model_in_words
from calib.provenance import PROGRAM
from calib.report.section import Results, Section
from calib.sampling import Posterior

ORDER = 90

# How a version is named among the texts that are kept with a posterior.
_VERSION = "version of "


def section(results: Results) -> Section:
    """Show how the run was made, as a list of facts."""
    facts = run_facts(results.posterior, results.posterior_sha256)
    return Section("run", "How this was made", "Run", "run.html.j2", {"facts": facts}, appendix=True, of_draws=False)


def run_facts(posterior: Posterior, posterior_sha256: str = "") -> list[tuple[str, str]]:
    """Say how a run was made, so that it can be made again.

    Parameters
    ----------
    posterior : the result, with the texts kept with it.
    posterior_sha256 : hash of its file; "" if it is not kept.

    Returns
    -------
    list of (str, str)
        Name and value of each fact.
    """
    d = posterior.diagnostics
    facts = [
        ("forward model", posterior.forward_name),
        *(_of_average(posterior) if d.models else _of_chains(posterior)),
        ("seed", str(posterior.seed)),
        ("experiment file", f"{posterior.experiment.file_name} (sha256 {posterior.experiment.sha256})"),
    ]
    if posterior_sha256:
        facts.append(("posterior.nc", f"sha256 {posterior_sha256}"))
    if version := posterior.attrs.get(f"version of {PROGRAM}"):
        facts.append(("to cite", f"{citation(version)}. Sensor model: {PAPER}"))
    versions = {k.removeprefix(_VERSION): v for k, v in posterior.attrs.items() if k.startswith(_VERSION)}
    if versions:
        facts.append(("versions", ", ".join(f"{name} {version}" for name, version in versions.items())))
    for one in unseen_from_text(posterior.attrs.get(UNSEEN, "[]")):
        facts.append((UNSEEN, f"{one.error}: moves {one.name.label} by {abs(one.shift):.1f} of its standard deviations"))
    said = (OF_MODELS, UNSEEN)
    return facts + [
        (k.replace("_", " "), v)
        for k, v in posterior.attrs.items()
        if len(v) < 2000 and k not in said and not k.startswith(_VERSION)
    ]


def _of_chains(posterior: Posterior) -> list[tuple[str, str]]:
    n_ensemble, n_draw, _ = posterior.draws.shape
    d = posterior.diagnostics
    return [
        ("model", model_in_words(posterior.experiment)),
        ("sampling", f"{n_ensemble} independent ensembles of {posterior.n_walkers} walkers, {n_ensemble * n_draw} draws kept"),
        (
            "chains",
            f"{d.steps} steps of each walker, the first {d.burn_in} discarded, every {d.thin}. kept; share of accepted steps "
            + ", ".join(f"{a:.2f}" for a in d.acceptance_fraction),
        ),
    ]


def _of_average(posterior: Posterior) -> list[tuple[str, str]]:
    assert posterior.of_model is not None
    counts = np.bincount(posterior.of_model.ravel(), minlength=len(posterior.diagnostics.models))
    return [
        (f"model {m.name}", f"{m.model}; {n} draws; posterior sha256 {m.sha256}")
        for m, n in zip(posterior.diagnostics.models, counts, strict=True)
    ]

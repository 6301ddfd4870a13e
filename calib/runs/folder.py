"""From a posterior to a run folder (posterior.nc, summary, report, recommendation), and from such a folder back."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from calib.checks import Prediction, predict
from calib.decision import Recommendation, Requirement, recommend, recommendation_from_json, recommendation_to_json
from calib.errors import Fault, InputError
from calib.experiment import forward_of_experiment
from calib.files import sha256_of, write_text
from calib.report import summary_csv, summary_json, write_report
from calib.sampling import Posterior, load_posterior, save_posterior
from models.response import Forward

#: Among the texts kept with a posterior: the surrogate file it was made with, if not the shipped one.
SURROGATE_FILE = "surrogate file"

#: What a run folder has from its first second on.
RUN_RECORD = "run.json"
_POSTERIOR, _RECOMMENDATION, _REPORT = "posterior.nc", "recommendation.json", "report.html"


@dataclass(frozen=True, eq=False)
class Run:
    """A finished calibration in its folder.

    Attributes
    ----------
    folder : where it is.
    posterior : what was found.
    forward : the model to predict with, the one that the posterior was sampled with.
    posterior_sha256 : hash of the posterior's file.
    """

    folder: Path
    posterior: Posterior
    forward: Forward
    posterior_sha256: str

    @property
    def report(self) -> Path:
        """Path of the report's page."""
        return self.folder / _REPORT

    @cached_property
    def predictions(self) -> tuple[Prediction, ...]:
        """What the posterior predicts for its sweeps, always the same."""
        return predict(self.posterior, self.forward, np.random.default_rng(self.posterior.seed))

    @property
    def note(self) -> str:
        """Empty, or in words that the posterior was sampled with another model than is here now."""
        if self.forward.name == self.posterior.forward_name:
            return ""
        return f"calibrated with the {self.posterior.forward_name}, predicting with the {self.forward.name}."


def load_run(folder: Path) -> Run:
    """Load the posterior of a finished run and the forward model that it was sampled with.

    Raises
    ------
    InputError
        If there is no finished run, or the surrogate file it was made with is gone.
    """
    path = folder / _POSTERIOR
    if not path.is_file():
        advice = (
            "It was stopped before its end: continue it with --resume"
            if (folder / RUN_RECORD).exists()
            else "Run `calib calibrate` first"
        )
        raise InputError(Fault("there is no finished calibration in this folder (no posterior.nc)", folder, advice=advice))
    posterior = load_posterior(path)
    file = posterior.attrs.get(SURROGATE_FILE)
    return Run(folder, posterior, forward_of_experiment(posterior.experiment, Path(file) if file else None), sha256_of(path))


def load_recommendation(folder: Path) -> Recommendation | None:
    """Load the recommendation that was last made in a run folder; None if none was.

    Raises
    ------
    InputError
        If the file cannot be read as one.
    """
    path = folder / _RECOMMENDATION
    return recommendation_from_json(path.read_text(encoding="utf-8"), path) if path.is_file() else None


def write_run(folder: Path, posterior: Posterior, forward: Forward) -> Run:
    """Write what came of a calibration: posterior.nc, summary.json, summary.csv, report.html.

    Parameters
    ----------
    folder : must exist; a recommendation in it goes into the report.
    posterior : what was found.
    forward : the model it was sampled with.
    """
    path = folder / _POSTERIOR
    save_posterior(posterior, path, forward)
    run = Run(folder, posterior, forward, sha256_of(path))
    write_text(folder / "summary.json", summary_json(posterior))
    write_text(folder / "summary.csv", summary_csv(posterior))
    write_page(run, load_recommendation(folder))
    return run


def write_page(run: Run, recommendation: Recommendation | None = None) -> None:
    """Write report.html of a run anew.

    Parameters
    ----------
    run : whose posterior it shows.
    recommendation : shown in a section of its own, if there is one.
    """
    write_text(run.report, _page(run, recommendation))


def recommend_in(run: Run, requirement: Requirement, *, seed: int) -> Recommendation:
    """Recommend a padding from the posterior of a run and keep it there: recommendation.json, and report.html anew.

    Parameters
    ----------
    run : the calibration.
    requirement : what is wanted of the padding.
    seed : of the choice of draws.

    Raises
    ------
    InputError
        If the model covers no thickness of the request; nothing is written then.
    """
    found = recommend(run.posterior, run.forward, requirement, seed=seed, posterior_sha256=run.posterior_sha256)
    page = _page(run, found)
    write_text(run.folder / _RECOMMENDATION, recommendation_to_json(found))
    write_text(run.report, page)
    return found


def _page(run: Run, recommendation: Recommendation | None) -> str:
    return write_report(run.posterior, run.predictions, recommendation, posterior_sha256=run.posterior_sha256)

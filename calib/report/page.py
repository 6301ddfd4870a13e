"""The results of a calibration in, one self-contained report.html out: a frame around the sections, one after the other."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor

import jinja2
from markupsafe import Markup

from calib.checks import Member, Prediction, Verdict, judge_posterior
from calib.decision import NextInShort, Recommendation
from calib.report.environment import templates
from calib.report.pictures import Drawing, Plot, pictures_in
from calib.report.section import Results, Section
from calib.report.sections import drawings_of, plots_of, sections_of
from calib.sampling import FINGERPRINT, Posterior


def report_page(
    posterior: Posterior,
    predictions: Sequence[Prediction],
    recommendation: Recommendation | None = None,
    *,
    verdict: Verdict | None = None,
    posterior_sha256: str = "",
    drawings: Mapping[str, Drawing] | None = None,
    members: Sequence[Member] = (),
    next_steps: NextInShort | None = None,
) -> str:
    """Lay out a calibration as one HTML page that needs nothing beside itself: no network, no script, no other file.

    Parameters
    ----------
    posterior : the result, with its diagnostics.
    predictions : of its sweeps, see `calib.checks.predictive.predict`.
    recommendation : of a padding, if one was asked for; one that was made from other draws is marked as such.
    verdict : on the calibration; None to judge it here.
    posterior_sha256 : hash of the posterior's file, "" if it is not kept.
    drawings : pictures that are not to be drawn here: from `begin_drawing` or `kept_drawings`.
    members : the models that the posterior is an average of; none for one model.
    next_steps : what to measure next; None to say nothing of it.

    Returns
    -------
    str
        The page; the same results give the same bytes.
    """
    environment = templates()
    verdict = judge_posterior(posterior, predictions) if verdict is None else verdict
    results = Results(posterior, predictions, verdict, recommendation, posterior_sha256, members=members, next_steps=next_steps)
    sections = sections_of(results, drawings or {})
    laid_out = [(section, _laid_out(section, environment)) for section in sections]
    return environment.get_template("page.html.j2").render(
        void=results.void,
        name=posterior.experiment.name,
        setup=_setup(posterior),
        date=posterior.attrs.get("ended", "")[:10],
        run=_hash_of(posterior, posterior_sha256),
        sections=[part for part in laid_out if not part[0].appendix],
        appendix=[part for part in laid_out if part[0].appendix],
    )


def plots_of_report(
    posterior: Posterior, predictions: Sequence[Prediction], recommendation: Recommendation | None = None
) -> dict[str, Plot]:
    """Every figure of a report by name, not drawn yet, with what is said of it.

    Parameters
    ----------
    posterior, predictions, recommendation : as in `report_page`.
    """
    return plots_of(Results(posterior, predictions, recommendation=recommendation))


def begin_drawing(
    posterior: Posterior, predictions: Sequence[Prediction], recommendation: Recommendation | None, executor: Executor
) -> dict[str, Drawing]:
    """Let workers draw the pictures of a page, beside what goes on here until it is laid out.

    Parameters
    ----------
    posterior, predictions, recommendation : as in `report_page`.
    executor : the workers.
    """
    return drawings_of(Results(posterior, predictions, recommendation=recommendation), executor)


def kept_drawings(posterior: Posterior, predictions: Sequence[Prediction], page: str) -> dict[str, Drawing]:
    """Pictures of an earlier page of the same posterior, without those of a recommendation.

    Parameters
    ----------
    posterior, predictions : as in `report_page`.
    page : the earlier one, as it was written.
    """
    names = drawings_of(Results(posterior, predictions))
    return {name: draw for name, draw in pictures_in(page).items() if name in names}


def _laid_out(section: Section, environment: jinja2.Environment) -> Markup:
    return Markup(environment.get_template(section.template).render(section.context).rstrip())


def _hash_of(posterior: Posterior, posterior_sha256: str) -> str:
    """What tells this run from others on paper: the start of its fingerprint, else of its posterior; "" for none."""
    found = re.match("[0-9a-f]{16}", posterior.attrs.get(FINGERPRINT, "") or posterior_sha256)
    return found[0] if found else ""


def _setup(posterior: Posterior) -> str:
    e, n_model = posterior.experiment, len(posterior.diagnostics.models)
    n = len(e.specimens)
    padding = "of the same silicone" if e.padding_material == "sensor" else "of its own material"
    return (
        f"ball of {e.indenter_radius * 1e3:g} mm radius, disc of {e.sensor_radius * 1e3:g} mm radius, "
        f"{n} specimen{'s' if n != 1 else ''}, {f'average of {n_model} models' if n_model else f'padding {padding}'}"
    )

"""Posterior, predictions and recommendation in, one self-contained report.html out."""

from __future__ import annotations

import base64
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources

import jinja2
import numpy as np
from markupsafe import Markup
from matplotlib import rc_context
from matplotlib.figure import Figure

from calib.checks.predictive import Prediction
from calib.decision import Recommendation, percent
from calib.experiment.plan import Experiment
from calib.lab.quality import Verdict, check_name, number_text, quality_in_words, verdict_rows
from calib.priors.prior import DEFAULT_REASONS, display
from calib.problem.parameters import sweep_title
from calib.report import figures
from calib.sampling.archive import K_HAT
from calib.sampling.diagnostics import PRIOR_CONFLICT, SHIFT_LIMIT, SPOT_CHECK_LIMIT, Gate
from calib.sampling.posterior import Posterior, leave_out
from models.sensor import PARAMETERS

#: A parameter whose prior lost less than this share of its variance is called prior-driven.
PRIOR_DRIVEN = 0.1
PRIOR_DRIVEN_WORDS = "prior-driven"
#: What a parameter is called that the data pull far away from its prior.
AGAINST_PRIOR_WORDS = "against its prior"
#: A parameter whose prior lost more than this share of its variance is called settled by the data.
SETTLED = 0.9

#: What a run has to reach to count as converged.
GATE = Gate()

_HEADLINE = (
    "young_modulus",
    "padding_young_modulus",
    "stiffening",
    "relative_permittivity",
    "sensor_thickness",
    "padding_thickness",
    "dielectric_thickness",
    "electrode_radius",
)


@dataclass(frozen=True)
class ParameterRow:
    """One line of the parameter table, ready to print."""

    name: str
    label: str
    symbol: Markup
    where: str
    prior: str
    origin: str
    reason: str
    value: str
    unit: str
    interval: str
    contraction: float
    verdict: str
    r_hat: str
    ess_bulk: str
    ess_tail: str
    r_hat_met: bool
    ess_met: bool


@dataclass(frozen=True)
class Condition:
    """One condition of convergence: what was found, what was asked."""

    name: str
    found: str
    asked: str
    met: bool
    advice: bool = False


@dataclass(frozen=True)
class Picture:
    """A figure as a data address, with what it shows in words."""

    source: str
    alt: str
    caption: str


@dataclass(frozen=True)
class QualityGroup:
    """What the checks say of one lab file: objections (level, check, number, finding, advice), and the rest (text, finding)."""

    title: str
    objections: tuple[tuple[str, str, str, str, str], ...]
    good: tuple[tuple[str, str], ...]

    @property
    def bad(self) -> bool:
        """Whether one of the objections is bad."""
        return any(level == "bad" for level, *_ in self.objections)


@dataclass(frozen=True)
class SweepSection:
    """Pictures and checks of one sweep."""

    title: str
    pictures: tuple[Picture, ...]
    checks: tuple[tuple[str, str, bool], ...]


def write_report(
    posterior: Posterior,
    predictions: Sequence[Prediction],
    recommendation: Recommendation | None = None,
    *,
    posterior_sha256: str = "",
) -> str:
    """The report as one HTML page that needs nothing beside itself: no network, no script, no other file."""
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_template),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    d = posterior.diagnostics
    rows = parameter_rows(posterior)
    return environment.get_template("report.html.j2").render(
        experiment=posterior.experiment,
        converged=d.converged,
        reasons=d.reasons,
        warnings=d.warnings,
        fits=not _doubtful(predictions),
        verdict=verdict(posterior, predictions),
        headline=[r for i, r in zip(posterior.parameters, rows, strict=True) if i.parameter in _HEADLINE],
        rows=rows,
        fixed=[(n, _label(n), display(n.split("[")[0], v)) for n, v in posterior.fixed.items()],
        prior_driven=[r for r in rows if r.verdict == PRIOR_DRIVEN_WORDS],
        limits=limits(posterior),
        gates=gates(posterior),
        sweeps=[_sweep_section(p) for p in predictions],
        quality=quality_groups(posterior),
        quality_words=quality_in_words([v for s in posterior.sweeps for v in s.verdicts]),
        change=_change_picture(predictions),
        prior_picture=_picture(
            figures.prior_figure(posterior),
            "Prior and posterior density of every parameter",
            "Grey: what was assumed. Blue: what is left after the data. Where the two coincide the data said nothing.",
        ),
        corner_picture=_picture(
            figures.corner_figure(posterior),
            "Pairwise posterior of the material parameters and of the thicknesses of the first specimen",
            "Contours hold 50 % and 90 % of the draws. A narrow slanted shape is a ridge: the data know a combination "
            "of the two well, not each of them.",
            vector=False,
        ),
        trace_picture=_picture(
            figures.trace_figure(posterior, _traced(posterior)),
            "Trace and rank plots",
            "One colour per independent ensemble. They must lie over each other without drift (left), and the rank "
            "steps stay near one (right).",
        ),
        recommendation=recommendation,
        recommendation_stale=bool(
            recommendation and posterior_sha256 and recommendation.posterior_sha256 not in ("", posterior_sha256)
        ),
        padding_rows=_padding_rows(recommendation) if recommendation else [],
        padding_picture=_padding_picture(recommendation) if recommendation else None,
        data=posterior.sweeps,
        setup=_setup(posterior.experiment),
        date=posterior.attrs.get("ended", "")[:10],
        run=run_facts(posterior, posterior_sha256),
        percent=percent,
    )


def verdict(posterior: Posterior, predictions: Sequence[Prediction]) -> str:
    """What came out, in a few sentences for somebody who reads nothing else."""
    rows = dict(zip((p.name for p in posterior.parameters), parameter_rows(posterior), strict=True))
    parts = []
    if "young_modulus" in rows:
        parts.append(f"Young's modulus of the silicone is {rows['young_modulus'].value} {rows['young_modulus'].unit}")
    if "relative_permittivity" in rows:
        parts.append(f"its relative permittivity {rows['relative_permittivity'].value}")
    text = " and ".join(parts) + " (mean ± one standard deviation). " if parts else ""
    doubtful = _doubtful(predictions)
    if doubtful:
        text += f"The model does not describe {_and(doubtful)} within what it claims: look at the residuals first. "
    else:
        text += "The model describes every sweep within its uncertainty. "
    driven = [_symbol_of(r) for r in rows.values() if r.verdict == PRIOR_DRIVEN_WORDS]
    if driven:
        text += f"The data hardly moved {_and(driven)}: there the result is the prior, not the measurement. "
    against = [_symbol_of(r) for r in rows.values() if r.verdict == AGAINST_PRIOR_WORDS]
    if against:
        text += (
            f"The data contradict the prior of {_and(against)}: check it, or what the model leaves out, before using the rest."
        )
    return text.strip()


def _doubtful(predictions: Sequence[Prediction]) -> list[str]:
    """Channels that the model does not describe."""
    return [
        f"the {kind} of {p.title}"
        for p in predictions
        for kind, channel in (("force", p.force), ("capacitance", p.capacitance))
        if channel is not None and not channel.check.passed
    ]


def parameter_rows(posterior: Posterior) -> list[ParameterRow]:
    """The parameter table, in the order of the posterior's parameters."""
    rows = []
    for info in posterior.parameters:
        s = posterior.diagnostics.parameters[info.name]
        p = PARAMETERS[info.parameter]
        k = p.display_scale
        lo, hi = s.interval_90
        rows.append(
            ParameterRow(
                name=info.name,
                label=p.label,
                symbol=_html_symbol(p.symbol),
                where=", ".join(w for w in (info.specimen, info.sweep) if w),
                prior=_short(info.prior.describe(info.parameter)),
                origin=info.origin,
                reason=DEFAULT_REASONS.get(info.parameter, "") if info.origin.startswith("default") else "",
                value=with_uncertainty(s.mean * k, s.sd * k),
                unit=p.display_unit,
                interval=interval_text(lo * k, hi * k),
                contraction=s.prior_contraction,
                verdict=contraction_words(s.prior_contraction, s.prior_shift),
                r_hat=_number(s.r_hat, ".3f"),
                ess_bulk=_number(s.ess_bulk, ".0f"),
                ess_tail=_number(s.ess_tail, ".0f"),
                r_hat_met=_met_r_hat(s.r_hat),
                ess_met=_met_ess(min(s.ess_bulk, s.ess_tail)),
            )
        )
    return rows


def with_uncertainty(mean: float, sd: float) -> str:
    """Mean and sd with two significant digits of the sd, the mean to the same place.

    >>> with_uncertainty(0.61234, 0.01432), with_uncertainty(1234.5, 321.0), with_uncertainty(2.0, 0.0)
    ('0.612 ± 0.014', '1230 ± 320', '2')
    """
    if not (math.isfinite(mean) and math.isfinite(sd)):
        return "not known"
    if sd <= 0:
        return f"{mean:.6g}"
    places = 1 - math.floor(math.log10(sd))
    if places < 0 or round(sd, places) >= 10.0 ** (2 - places):
        places = 1 - math.floor(math.log10(round(sd, places)))
    if places > 7 or places < -7:
        return f"{mean:.6g} ± {sd:.2g}"
    return f"{round(mean, places) + 0.0:.{max(places, 0)}f} ± {round(sd, places):.{max(places, 0)}f}"


def interval_text(lo: float, hi: float) -> str:
    """An interval with as many digits as its width deserves.

    >>> interval_text(0.58912, 0.63551), interval_text(-2.0, 11.0)
    ('0.589 to 0.636', '-2 to 11')
    """
    if not (math.isfinite(lo) and math.isfinite(hi)):
        return "not known"
    width = hi - lo
    places = min(max(1 - math.floor(math.log10(width)), 0), 9) if width > 0 else 6
    return f"{lo:.{places}f} to {hi:.{places}f}"


def contraction_words(contraction: float, shift: float) -> str:
    """What the data did to a prior, in words: share of its variance taken away, and how far they pulled it (in its sd).

    >>> contraction_words(0.05, 0.1), contraction_words(0.5, 0.1), contraction_words(0.97, 0.1)
    ('prior-driven', 'moved by the data', 'settled by the data')
    >>> contraction_words(0.05, 1.5), contraction_words(0.5, -4.0)
    ('moved by the data', 'against its prior')
    """
    if abs(shift) > PRIOR_CONFLICT:
        return AGAINST_PRIOR_WORDS
    if contraction < PRIOR_DRIVEN and abs(shift) < 1:
        return PRIOR_DRIVEN_WORDS
    return "settled by the data" if contraction > SETTLED else "moved by the data"


def quality_groups(posterior: Posterior) -> list[QualityGroup]:
    """The verdicts on the lab data by specimen and file, files with the worst verdicts first."""
    by_file: dict[str, list[Verdict]] = {}
    for s in posterior.sweeps:
        for v in s.verdicts:
            by_file.setdefault(f"{sweep_title(s)}: {v.file}", []).append(v)
    groups = [
        QualityGroup(
            title,
            tuple(row for row in verdict_rows(verdicts) if row[0] != "good"),
            tuple((f"{check_name(v)}: {number_text(v)}", v.finding) for v in verdicts if v.level == "good"),
        )
        for title, verdicts in by_file.items()
    ]
    return sorted(groups, key=lambda g: min((("bad", "warning").index(o[0]) for o in g.objections), default=2))


def limits(posterior: Posterior) -> list[tuple[str, str]]:
    """What the numbers take for granted, as (heading, text)."""
    e = posterior.experiment
    found = [
        (
            "The base is taken as bonded",
            "Sensor and padding are modelled as stuck to each other and to the rigid finger. This choice outweighs all noise: "
            "on a slippery base the same curve would mean about 1.9 times the Young's modulus.",
        ),
        (
            (
                "The ball is taken as sticking",
                "The sensor does not slip on the ball at all; less friction would make it softer.",
            )
            if e.stick
            else ("Friction is left out", "The ball slides freely on the sensor; friction would make it a little stiffer.")
        ),
        (
            "Only the loading branch is used",
            "The material is elastic in the model: no hysteresis, no rate, no creep. Unloading and holds are not fitted.",
        ),
        (
            "Fringe fields are left out",
            "The capacitance is that of thin deformed rings between the electrodes; stray fields at the rim are not in it, a "
            "constant one goes into the parasitic capacitance.",
        ),
        (
            "Neo-Hookean, nearly incompressible silicone",
            "One modulus describes a layer; stiffening at large strain is not modelled.",
        ),
        (
            "One silicone for sensor and padding" if e.padding_material == "sensor" else "Padding of its own material",
            "Both have the same Young's modulus, as the experiment file says."
            if e.padding_material == "sensor"
            else "Its modulus is a parameter of its own; it trades off against the sensor's.",
        ),
    ]
    if "dielectric_thickness" not in {p.parameter for p in posterior.parameters} | {n.split("[")[0] for n in posterior.fixed}:
        found.append(
            (
                "Dielectric thickness is derived",
                "No dielectric_thickness was given, so each dielectric is half the sensor. Electrodes and covers would make it "
                "thinner, and the permittivity absorbs the difference.",
            )
        )
    if "electrode_radius" not in {p.parameter for p in posterior.parameters} | {n.split("[")[0] for n in posterior.fixed}:
        found.append(
            (
                "Electrode radius is the disc radius",
                f"No electrode_radius was given, so the electrodes fill the disc ({e.sensor_radius * 1e3:g} mm). The "
                "capacitance change depends on it as much as on the modulus.",
            )
        )
    if e.discrepancy == "off":
        found.append(
            (
                "Discrepancy is switched off",
                "Residuals are taken as independent noise. If they drift along the sweep, these uncertainties are too small.",
            )
        )
    if e.model == "closed form":
        found.append(
            (
                "The model is the closed form",
                "Hertz with a bonded-layer factor and a plate capacitance: good for a first look, wrong by a factor of up to "
                "two in the capacitance change. Use the surrogate or finite elements for numbers to build on.",
            )
        )
    return found


def gates(posterior: Posterior) -> list[Condition]:
    """What had to hold for the run to count as converged, and what of it did."""
    d, summaries = posterior.diagnostics, posterior.diagnostics.parameters
    worst_r = max(summaries, key=lambda n: np.nan_to_num(summaries[n].r_hat, nan=np.inf))
    worst_ess = min(summaries, key=lambda n: np.nan_to_num(min(summaries[n].ess_bulk, summaries[n].ess_tail), nan=-np.inf))
    r_hat = summaries[worst_r].r_hat
    ess = min(summaries[worst_ess].ess_bulk, summaries[worst_ess].ess_tail)
    slowest = max(d.tau, key=lambda n: np.nan_to_num(d.tau[n], nan=np.inf))
    lengths = d.steps / d.tau[slowest]
    return [
        Condition("R-hat, largest", f"{_number(r_hat, '.3f')} ({_label(worst_r)})", f"below {GATE.r_hat:g}", _met_r_hat(r_hat)),
        Condition(
            "effective draws, fewest", f"{_number(ess, '.0f')} ({_label(worst_ess)})", f"above {GATE.ess:g}", _met_ess(ess)
        ),
        Condition(
            "length of the chains",
            f"{d.steps} steps, {_number(lengths, '.0f')} autocorrelation times ({_label(slowest)})",
            f"at least {GATE.length:g} autocorrelation times",
            bool(lengths >= GATE.length),
        ),
        *_spot_check(posterior),
        *_reweighting(posterior),
        _left_out(posterior),
    ]


def _spot_check(posterior: Posterior) -> list[Condition]:
    """The forward model against the finite elements at draws of the posterior, if that was looked at."""
    found = posterior.diagnostics.spot_check
    if found is None:
        return []
    sizes = f"force within {found.force_error:.2%}, capacitance change within {found.change_error:.2%}"
    if not found.stated:
        return [
            Condition(f"{posterior.forward_name} against finite elements", sizes, "states no error of its own", False, True)
        ]
    scores = f"{found.force_score:.1f} and {found.change_score:.1f} times its own error"
    name = f"{posterior.forward_name} against finite elements at {found.n_curve} loading curves of the posterior"
    return [Condition(name, f"{sizes}; {scores}", f"at most {SPOT_CHECK_LIMIT:g} times its own error (rms)", found.passed)]


def _reweighting(posterior: Posterior) -> list[Condition]:
    """Advice rather than a gate: what the finite elements' likelihood makes of the draws, if that was looked at."""
    found = posterior.diagnostics.reweighting
    if found is None:
        return []
    asked = f"k-hat at most {found.k_limit:.2f}, no shift beyond {SHIFT_LIMIT:g} and twice its Monte Carlo error (advice)"
    return [
        Condition(f"{posterior.forward_name} posterior against finite elements", found.in_words(), asked, found.passed, True)
    ]


def _left_out(posterior: Posterior) -> Condition:
    """Advice rather than a gate: whether single blocks of data pull the posterior by themselves."""
    with np.errstate(over="ignore"):  # ArviZ lets exponentials of hopeless draws overflow on purpose
        k = leave_out(posterior).k_hat
    worst = int(np.nanargmax(k))
    found = f"{_number(float(k[worst]), '.2f')} ({posterior.blocks[worst]}); {int(np.sum(k > K_HAT))} of {k.size} blocks above"
    return Condition(
        "influence of single blocks of data, largest PSIS-LOO k-hat",
        found,
        f"at most {K_HAT:g} (advice)",
        bool(k[worst] <= K_HAT),
        True,
    )


def _met_r_hat(r_hat: float) -> bool:
    return bool(r_hat < GATE.r_hat)


def _met_ess(ess: float) -> bool:
    return bool(ess > GATE.ess)


def run_facts(posterior: Posterior, posterior_sha256: str = "") -> list[tuple[str, str]]:
    """How the run was made: command, seed, versions and whatever else the posterior carries."""
    n_ensemble, n_draw, _ = posterior.draws.shape
    d = posterior.diagnostics
    facts = [
        ("forward model", posterior.forward_name),
        ("sensor and padding", f"law: {posterior.experiment.law}"),
        ("ball", "sticking" if posterior.experiment.stick else "without friction"),
        ("sampling", f"{n_ensemble} independent ensembles of {posterior.n_walkers} walkers, {n_ensemble * n_draw} draws kept"),
        (
            "chains",
            f"{d.steps} steps of each walker, the first {d.burn_in} discarded, every {d.thin}. kept; share of accepted steps "
            + ", ".join(f"{a:.2f}" for a in d.acceptance_fraction),
        ),
        ("seed", str(posterior.seed)),
        ("experiment file", f"{posterior.experiment.path.name} (sha256 {posterior.experiment.sha256})"),
    ]
    if posterior_sha256:
        facts.append(("posterior.nc", f"sha256 {posterior_sha256}"))
    facts += [(k.replace("_", " "), v) for k, v in posterior.attrs.items() if len(v) < 2000]
    return facts


def figure_address(figure: Figure, *, vector: bool = True) -> str:
    """A figure as a data address for <img>: SVG, or PNG at 150 dpi; the same figure gives the same bytes."""
    buffer = io.BytesIO()
    with rc_context({"svg.hashsalt": "calib"}):
        if vector:
            figure.savefig(buffer, format="svg", metadata={"Date": None})
        else:
            figure.savefig(buffer, format="png", dpi=150, metadata={"Software": None}, bbox_inches="tight", pad_inches=0.05)
    kind = "svg+xml" if vector else "png"
    return f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode('ascii')}"


def _template(name: str) -> str:
    return (resources.files("calib.report") / "templates" / name).read_text(encoding="utf-8")


def _picture(figure: Figure, alt: str, caption: str, *, vector: bool = True) -> Picture:
    return Picture(figure_address(figure, vector=vector), alt, caption)


def _sweep_section(p: Prediction) -> SweepSection:
    pictures, checks = [], []
    for kind, channel, draw in (
        ("force", p.force, figures.force_figure),
        ("capacitance", p.capacitance, figures.capacitance_figure),
    ):
        if channel is not None:
            caption = f"{p.title}: {kind} as read, and residuals in units of the predicted standard deviation."
            pictures.append(_picture(draw(p), f"{kind} of {p.title}: data, model and residuals", caption))
            checks.append((kind, channel.check.in_words, channel.check.passed))
    return SweepSection(f"{p.title} (ball of {p.indenter_radius * 1e3:g} mm radius)", tuple(pictures), tuple(checks))


def _change_picture(predictions: Sequence[Prediction]) -> Picture | None:
    if all(p.change is None for p in predictions):
        return None
    return _picture(
        figures.change_figure(predictions),
        "Capacitance change against force of all specimens",
        "Capacitance change against true force, freed of load zero and parasitic capacitance. Band: 90 % of the model curve.",
    )


def _padding_picture(recommendation: Recommendation) -> Picture:
    return _picture(
        figures.padding_figure(recommendation),
        "Capacitance change against padding thickness with its uncertainty",
        "Bands hold 50 % and 90 % of the draws. Green: the recommended thickness and those that are as good with a probability "
        "of at least 80 %. Hatched: outside what the model covers.",
    )


def _padding_rows(r: Recommendation) -> list[tuple[str, str, str]]:
    rows = [
        ("capacitance change", _range(r.change_at_best * 100, "%"), f"at {r.requirement.force:g} N"),
        ("indentation", _range(r.depth_at_best * 1e3, "mm"), "how far the ball sinks in: the softness one feels"),
        ("force resolution", _range(r.resolution_at_best * 1e3, "mN"), "noise of one capacitance reading over dC/dF"),
    ]
    return [(label, value, note) for label, value, note in rows if value]


def _range(bands: np.ndarray[tuple[int], np.dtype[np.float64]], unit: str) -> str:
    lo, middle, hi = (float(v) for v in bands[[0, 2, 4]])
    if not all(math.isfinite(v) for v in (lo, middle, hi)):
        return "not known"
    places = min(max(2 - math.floor(math.log10(max(hi - lo, 1e-3 * abs(middle), 1e-9))), 0), 6) - 1
    return f"{middle:.{max(places, 0)}f} {unit} ({lo:.{max(places, 0)}f} to {hi:.{max(places, 0)}f})"


def _setup(e: Experiment) -> str:
    n = len(e.specimens)
    padding = "of the same silicone" if e.padding_material == "sensor" else "of its own material"
    return (
        f"ball of {e.indenter_radius * 1e3:g} mm radius, disc of {e.sensor_radius * 1e3:g} mm radius, "
        f"{n} specimen{'s' if n != 1 else ''}, padding {padding}"
    )


def _traced(posterior: Posterior) -> list[str]:
    """Parameters worth a trace: the headline ones that are shared, then those with the largest R-hat, six in all."""
    shared = [p.name for p in posterior.parameters if p.parameter in _HEADLINE and not p.specimen]
    summaries = posterior.diagnostics.parameters
    worst = sorted(
        (p.name for p in posterior.parameters if p.name not in shared), key=lambda n: -np.nan_to_num(summaries[n].r_hat)
    )
    return (shared + worst)[:6]


def _short(text: str) -> str:
    """Numbers of a text with at most four significant digits."""
    return re.sub(r"\d+\.\d{3,}", lambda found: f"{float(found[0]):.4g}", text)


def _label(name: str) -> str:
    parameter, _, where = name.partition("[")
    return PARAMETERS[parameter].label + (f" ({where.rstrip(']')})" if where else "")


def _html_symbol(symbol: str) -> Markup:
    base, _, index = symbol.partition("_")
    return Markup(f"<i>{base}</i><sub>{index}</sub>") if index else Markup(f"<i>{base}</i>")


def _symbol_of(row: ParameterRow) -> str:
    return f"{row.label} ({row.where})" if row.where else row.label


def _number(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else "not known"


def _and(words: Sequence[str]) -> str:
    if len(words) > 4:
        words = [*words[:3], f"{len(words) - 3} more"]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]

"""A posterior in, the lines of its table of parameters in the units and words that people read out."""

from __future__ import annotations

from dataclasses import dataclass

from markupsafe import Markup

from calib.catalogue import POOLED, QUANTITIES, SPREADS, UNKNOWNS, UnknownName
from calib.checks import LEARNED, Difference, Outlook, conflict_limit, in_units
from calib.digits import interval_text, number_or_unknown, shortened, with_uncertainty
from calib.priors import Fixed
from calib.problem import ParameterInfo
from calib.sampling import FirstAnswer, Posterior

#: A parameter whose prior lost less than this share of its variance is called prior-driven.
PRIOR_DRIVEN = 0.1
PRIOR_DRIVEN_WORDS = "prior-driven"
#: What a parameter is called that the data pull far away from its prior.
AGAINST_PRIOR_WORDS = "against its prior"
#: A parameter whose prior lost more than this share of its variance is called settled by the data.
SETTLED = 0.9

#: So many specimens leave how specimens of a lot differ mostly to its prior.
FEW_SPECIMENS = 3

#: Parameters of the sensor, which are asked for; the others are of the rig and of the noise.
SENSOR_PARAMETERS = (
    "young_modulus",
    "padding_young_modulus",
    "stiffening",
    "relative_permittivity",
    "sensor_thickness",
    "padding_thickness",
    "dielectric_thickness",
    "electrode_radius",
    "sensor_radius",
    *SPREADS,
)


@dataclass(frozen=True)
class ParameterRow:
    """One parameter, ready to print.

    Attributes
    ----------
    name : as in files.
    parameter : without specimen and sweep.
    where : those, "" if it is shared by all.
    label, symbol : what it is called, a quantity of a lot as such.
    prior, origin, reason : what was believed before, where that was said, and why, if it is a default.
    value, interval, unit : mean with standard deviation, and central 90 %, in the unit of display.
    contraction : share of the prior's variance that the data took away.
    learned : the same in words.
    r_hat, ess_bulk, ess_tail : of the chains.
    r_hat_met, ess_met : whether the run's gate was met.
    """

    name: str
    parameter: str
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
    learned: str
    r_hat: str
    ess_bulk: str
    ess_tail: str
    r_hat_met: bool
    ess_met: bool

    @property
    def doubtful(self) -> bool:
        """Whether the value is not what the measurement says: the data left it at its prior, or contradict the prior."""
        return self.learned in (PRIOR_DRIVEN_WORDS, AGAINST_PRIOR_WORDS)


def parameter_rows(posterior: Posterior) -> list[ParameterRow]:
    """Make the rows of the table of parameters, in the order of the posterior's unknowns, what is of a lot first."""
    gate, limit = posterior.diagnostics.gate, conflict_limit(len(posterior.parameters))
    rows = []
    n = len(posterior.unknowns)
    for info in (*posterior.parameters[n:], *posterior.unknowns):
        s = posterior.diagnostics.parameters[info.name]
        p = QUANTITIES[info.parameter]
        k = p.display_scale
        lo, hi = s.interval_90
        rows.append(
            ParameterRow(
                name=info.name,
                parameter=info.parameter,
                label=_label(posterior, info),
                symbol=_html_symbol(p.symbol),
                where=", ".join(w for w in (info.specimen, info.sweep) if w),
                prior=shortened(info.prior.describe(info.parameter)),
                origin=info.origin,
                reason=UNKNOWNS[info.parameter].reason if info.origin.startswith("default") else "",
                value=with_uncertainty(s.mean * k, s.sd * k),
                unit=p.display_unit,
                interval=interval_text(lo * k, hi * k),
                contraction=s.prior_contraction,
                learned=learned_in_words(s.prior_contraction, s.prior_shift, limit, from_data=info.from_data),
                r_hat=number_or_unknown(s.r_hat, ".3f"),
                ess_bulk=number_or_unknown(s.ess_bulk, ".0f"),
                ess_tail=number_or_unknown(s.ess_tail, ".0f"),
                r_hat_met=s.r_hat < gate.r_hat,
                ess_met=min(s.ess_bulk, s.ess_tail) > gate.ess,
            )
        )
    return rows


def _label(posterior: Posterior, info: ParameterInfo) -> str:
    """What a parameter is called: of a lot as such, and where its specimens were not meant to be alike, as which one."""
    label = QUANTITIES[info.parameter].label
    if info.specimen or posterior.experiment.pooling == "complete" or info.parameter not in POOLED:
        return label
    pooled = (s for s in posterior.experiment.specimens if not isinstance(s.priors.get(info.parameter), Fixed))
    meant = [s for s in pooled if info.parameter in s.nominal]
    alike = len({s.nominal[info.parameter] for s in meant}) < 2
    return f"{label}, lot" if alike else f"{label}, lot, as {meant[0].name} was meant"


@dataclass(frozen=True)
class FirstRow:
    """One parameter of a first answer, ready to print: name, value with its standard deviation, and unit of display."""

    name: str
    value: str
    unit: str


def first_rows(first: FirstAnswer, *, sensor_only: bool = False) -> list[FirstRow]:
    """Make the rows of the table of a first answer, in the order of the unknowns.

    Parameters
    ----------
    first : the answer.
    sensor_only : whether to leave out what is of the rig and of the noise.
    """
    rows = []
    for name, estimate in first.parameters.items():
        parameter = UnknownName.parse(name).parameter
        if sensor_only and parameter not in SENSOR_PARAMETERS:
            continue
        p = QUANTITIES[parameter]
        k = p.display_scale
        rows.append(FirstRow(name, with_uncertainty(estimate.mean * k, estimate.sd * k), p.display_unit))
    return rows


def pair_rows(difference: Difference) -> list[tuple[str, str, str, str, str]]:
    """Make the rows of the table of two runs: name, mean and standard deviation of each, unit of display, z or why not."""
    rows = []
    for pair in difference.pairs:
        q = QUANTITIES[UnknownName.parse(pair.name).parameter]
        sides = [
            "-" if s is None else with_uncertainty(s.mean * q.display_scale, s.sd * q.display_scale)
            for s in (pair.first, pair.second)
        ]
        weighed = pair.why if pair.z is None else f"{pair.z:+.1f}" + (f" ({pair.why})" if pair.why else "")
        rows.append((pair.name, *sides, q.display_unit, weighed))
    return [(name, one, other, unit, z) for name, one, other, unit, z in rows]


def outlook_rows(outlook: Outlook) -> list[tuple[str, str, str, str]]:
    """Make the rows of the table of what data will tell: name, sd before and after with their unit, and how much is learned."""
    rows = []
    for told in outlook.unknowns:
        before, after = (in_units(told.name.parameter, sd) for sd in (told.prior_sd, told.expected_sd))
        learned = learned_in_words(told.contraction, 0.0, from_data=told.from_data)
        rows.append((str(told.name), before, after, f"{max(told.contraction, 0.0) * 100:.0f} %, {learned}"))
    return rows


def learned_in_words(contraction: float, shift: float, limit: float = 3.5, *, from_data: bool = False) -> str:
    """Say in two to four words how much the data changed what was believed of a parameter.

    Parameters
    ----------
    contraction : share of the prior's variance that the data took away [1].
    shift : how far they pulled it, in its standard deviations [1].
    limit : how far contradicts what was believed [1], see `calib.checks.conflict_limit`.
    from_data : whether what was believed is what the records showed before, such as the offset of two clocks.

    Returns
    -------
    str
        Two to four words.

    Examples
    --------
    >>> learned_in_words(0.05, 0.1), learned_in_words(0.3, 0.1), learned_in_words(0.6, 0.1), learned_in_words(0.97, 0.1)
    ('prior-driven', 'mostly its prior', 'moved by the data', 'settled by the data')
    >>> learned_in_words(0.05, 1.5), learned_in_words(0.5, -4.0), learned_in_words(0.05, 0.1, from_data=True)
    ('mostly its prior', 'against its prior', 'found in the data')
    """
    if abs(shift) > limit:
        return AGAINST_PRIOR_WORDS
    if from_data and contraction < LEARNED:
        return "found in the data"
    if contraction < PRIOR_DRIVEN and abs(shift) < 1:
        return PRIOR_DRIVEN_WORDS
    if contraction < LEARNED:
        return "mostly its prior"
    return "settled by the data" if contraction > SETTLED else "moved by the data"


def few_specimens_in_words(posterior: Posterior) -> str:
    """What few specimens cannot tell of how specimens differ, as the end of a sentence; empty where there are many."""
    n = len({sweep.specimen for sweep in posterior.sweeps})
    if n > FEW_SPECIMENS:
        return ""
    who = "one specimen cannot" if n == 1 else f"{n} specimens can hardly"
    return f", which {who} tell: that is mostly what was believed before"


def label_of(name: str) -> str:
    """Name a parameter for people, from its name in results.

    >>> label_of("sensor_thickness[sensor 1]")
    'sensor thickness (sensor 1)'
    """
    return UnknownName.parse(name).label


def _html_symbol(symbol: str) -> Markup:
    base, _, index = symbol.partition("_")
    return Markup(f"<i>{base}</i><sub>{index}</sub>") if index else Markup(f"<i>{base}</i>")

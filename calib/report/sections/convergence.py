"""What a run had to reach so that its numbers may be used, and what of it it reached."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from calib.digits import number_or_unknown
from calib.report.figures.posterior import trace_figure
from calib.report.moves import moves_in_words
from calib.report.pictures import Plot
from calib.report.rows import SENSOR_PARAMETERS, label_of, parameter_rows
from calib.report.section import Results, Section
from calib.sampling import K_HAT, SHIFT_LIMIT, SPOT_CHECK_LIMIT, Posterior, leave_out

ORDER = 65


def plots(results: Results) -> Mapping[str, Plot]:
    """Traces of the chains."""
    if results.posterior.diagnostics.models:
        return {}
    caption = (
        "One colour per independent ensemble. They must lie over each other without drift (left), and the rank steps stay "
        "near one (right)."
    )
    return {
        name: Plot(f"Trace and rank plots of {', '.join(of)}", caption, trace_figure, (results.posterior, of))
        for name, of in _traces(results.posterior).items()
    }


def _traces(posterior: Posterior) -> dict[str, list[str]]:
    """Pictures of traces, by name, with three parameters each."""
    names = _traced(posterior)
    return {f"traces, {1 + first // 3}": names[first : first + 3] for first in range(0, len(names), 3)}


def section(results: Results) -> Section | None:
    """Show what a run had to reach, every parameter, and traces; None of an average, which has no chains."""
    posterior = results.posterior
    if posterior.diagnostics.models:
        return None
    context = {
        "criteria": criteria(posterior),
        "rows": parameter_rows(posterior),
        "moves": moves_in_words(posterior.diagnostics),
        "first": posterior.diagnostics.first_answer_in_words,
        "pictures": [results.picture(name) for name in _traces(posterior)],
    }
    return Section(
        "convergence", "Convergence of the chains", "Convergence", "convergence.html.j2", context, appendix=True, of_draws=False
    )


@dataclass(frozen=True)
class Criterion:
    """One requirement of a run: what was found, what was asked, whether that is met; `advice` if the run is usable without."""

    name: str
    found: str
    asked: str
    met: bool
    advice: bool = False


def criteria(posterior: Posterior) -> list[Criterion]:
    """List all requirements of a run: its own gate, the spot check if it was made, and what is advice."""
    return [*_gate(posterior), *_spot_check(posterior), *_reweighting(posterior), _left_out(posterior)]


def _gate(posterior: Posterior) -> list[Criterion]:
    """What the chains had to reach in this run."""
    d, gate, summaries = posterior.diagnostics, posterior.diagnostics.gate, posterior.diagnostics.parameters
    worst_r = max(summaries, key=lambda n: np.nan_to_num(summaries[n].r_hat, nan=np.inf))
    worst_ess = min(summaries, key=lambda n: np.nan_to_num(min(summaries[n].ess_bulk, summaries[n].ess_tail), nan=-np.inf))
    r_hat = summaries[worst_r].r_hat
    ess = min(summaries[worst_ess].ess_bulk, summaries[worst_ess].ess_tail)
    slowest = max(d.tau, key=lambda n: np.nan_to_num(d.tau[n], nan=np.inf))
    lengths = d.steps / d.tau[slowest]
    return [
        Criterion(
            "R-hat, largest",
            f"{number_or_unknown(r_hat, '.3f')} ({label_of(worst_r)})",
            f"below {gate.r_hat:g}",
            r_hat < gate.r_hat,
        ),
        Criterion(
            "effective draws, fewest",
            f"{number_or_unknown(ess, '.0f')} ({label_of(worst_ess)})",
            f"above {gate.ess:g}",
            ess > gate.ess,
        ),
        Criterion(
            "length of the chains",
            f"{d.steps} steps, {number_or_unknown(lengths, '.0f')} autocorrelation times ({label_of(slowest)})",
            f"at least {gate.length:g} autocorrelation times",
            lengths >= gate.length,
        ),
    ]


def _spot_check(posterior: Posterior) -> list[Criterion]:
    """The forward model against the finite elements at draws of the posterior, if that was looked at."""
    found = posterior.diagnostics.spot_check
    if found is None:
        return []
    sizes = f"force within {100 * found.force_error:.2f} %, capacitance change within {100 * found.change_error:.2f} %"
    name = f"{found.forward_name} against finite elements"
    if not found.stated:
        return [Criterion(name, sizes, "states no error of its own", False, True)]
    scores = f"{found.force_score:.1f} and {found.change_score:.1f} times its own error"
    return [
        Criterion(
            f"{name} at {found.n_curve} loading curves of the posterior",
            f"{sizes}; {scores}",
            f"at most {SPOT_CHECK_LIMIT:g} times its own error (rms)",
            found.passed,
        )
    ]


def _reweighting(posterior: Posterior) -> list[Criterion]:
    """What the finite elements' likelihood makes of the draws, if that was looked at."""
    found = posterior.diagnostics.reweighting
    if found is None:
        return []
    asked = f"k-hat at most {found.k_limit:.2f}, no shift beyond {SHIFT_LIMIT:g} and twice its Monte Carlo error (advice)"
    name = f"{posterior.forward_name} posterior against finite elements"
    return [Criterion(name, found.in_words(), asked, found.passed, True)]


def _left_out(posterior: Posterior) -> Criterion:
    """Whether single blocks of data pull the posterior by themselves."""
    k = np.array(posterior.diagnostics.block_k_hat)
    if not k.size:
        with np.errstate(over="ignore"):  # ArviZ lets exponentials of hopeless draws overflow on purpose
            k = leave_out(posterior).k_hat
    worst = int(np.nanargmax(k))
    block = f"{number_or_unknown(float(k[worst]), '.2f')} ({posterior.blocks[worst]})"
    return Criterion(
        "influence of single blocks of data, largest PSIS-LOO k-hat",
        f"{block}; {int(np.sum(k > K_HAT))} of {k.size} blocks above",
        f"at most {K_HAT:g} (advice)",
        bool(k[worst] <= K_HAT),
        True,
    )


def _traced(posterior: Posterior) -> list[str]:
    """Parameters worth a trace: those of the sensor that are shared, then those with the largest R-hat, six in all."""
    shared = [p.name for p in posterior.parameters if p.parameter in SENSOR_PARAMETERS and not p.specimen]
    summaries = posterior.diagnostics.parameters
    worst = sorted(
        (p.name for p in posterior.parameters if p.name not in shared), key=lambda n: -np.nan_to_num(summaries[n].r_hat)
    )
    return (shared + worst)[:6]

"""Two posteriors of different data in, every unknown side by side and by how much they differ out.

Of an unknown that is the same in both, theta, both runs begin with the same prior. That is one piece of information and not
two: where posteriors are nearly normal in the coordinates z of the priors, in which those are standard normal, the errors of
their means m_i, with covariances V_i of all unknowns, have the covariance

    Cov(theta - m_1, theta - m_2) = V_1[:, S] V_2[S, :]                                                                     (1)

S being what both runs have in common and believed the same of before. For since V_i = (1 + J_i)^-1 with the information J_i of
the data, theta - m_i = V_i (theta - n_i), n_i of the noise, and only the first term, of covariance 1, is in both. Hence the
difference of the means of unknown k has the variance

    V_1[k, k] + V_2[k, k] - 2 V_1[k, S] V_2[S, k],                                                                          (2)

less than their sum. An unknown that neither run has learned of has m_1 = m_2 = 0 and nothing to differ by.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from calib.catalogue import QUANTITIES, UnknownName, unknowns_of
from calib.lab import repeated_channels
from calib.problem import ParameterInfo
from calib.sampling import Posterior
from models.sensor import FloatArray

if TYPE_CHECKING:
    import pandas as pd

#: A difference of more than so many of its standard deviations counts as one.
DIFFERENCE_LIMIT = 2.0
# An unknown that lost less than this share of its prior's variance in both runs is compared in neither.
_LEARNED = 0.1
# Coordinates beyond this are those of a draw at a bound of its prior.
_FARTHEST = 9.0


@dataclass(frozen=True)
class Side:
    """What one run says of an unknown, SI; of one that it fixes, its value with a standard deviation of 0."""

    mean: float
    sd: float
    interval_90: tuple[float, float]


@dataclass(frozen=True)
class Pair:
    """One unknown in two runs.

    Attributes
    ----------
    name : as in results.
    unit : SI.
    first, second : what the runs say of it; None for one that does not have it.
    z : [1], difference of the means, first less second, in its standard deviations by (2); None where there is none.
    why : why there is none; else what of (2) does not hold, or "".
    """

    name: str
    unit: str
    first: Side | None
    second: Side | None
    z: float | None
    why: str


@dataclass(frozen=True)
class Changed:
    """One thing that is not the same in two runs, in words."""

    what: str
    first: str
    second: str


@dataclass(frozen=True, eq=False)
class Loading:
    """What one specimen does under force by one run, bands (5, n_force) of quantiles 5, 25, 50, 75, 95 %, SI.

    Attributes
    ----------
    run, specimen : names.
    force : (n_force,).
    depth, change : bands; nan where the model does not cover them, `change` also without capacitance.
    """

    run: str
    specimen: str
    force: FloatArray
    depth: FloatArray
    change: FloatArray


@dataclass(frozen=True, eq=False)
class Difference:
    """Two calibrations of different data side by side.

    Attributes
    ----------
    names : of the runs.
    pairs : every unknown of either.
    shared : in words, data that are in both runs, so that there is no z.
    same : unknowns that were taken for the same in both, of which the prior counts once: S of (2).
    changed : what of the experiments, data, models and programs is not the same.
    loadings : the curves of all specimens.
    colours : of the verdicts on the runs.
    """

    names: tuple[str, str]
    pairs: tuple[Pair, ...]
    shared: tuple[str, ...]
    same: tuple[str, ...]
    changed: tuple[Changed, ...] = ()
    loadings: tuple[Loading, ...] = ()
    colours: tuple[str, str] = ("green", "green")

    @property
    def differing(self) -> tuple[Pair, ...]:
        """Unknowns that differ by more than `DIFFERENCE_LIMIT`, the farthest first."""
        found = [pair for pair in self.pairs if pair.z is not None and abs(pair.z) > DIFFERENCE_LIMIT]
        return tuple(sorted(found, key=lambda pair: -abs(pair.z or 0.0)))

    @property
    def in_words(self) -> str:
        """What differs, in a few sentences."""
        if self.shared:
            return (
                f"No difference is weighed: both runs rest on {', '.join(self.shared)}, which makes them alike, and neither "
                "knows how much. Models of the same data are compared by `calib compare`."
            )
        compared = [pair for pair in self.pairs if pair.z is not None]
        if not compared:
            return "Nothing can be compared: no unknown is in both runs and learned by one of them."
        by_chance = 0.0455 * len(compared)
        if not self.differing:
            most = max(compared, key=lambda pair: abs(pair.z or 0.0))
            return f"Nothing differs: of {len(compared)} unknowns {most.name} is the farthest apart, with z = {most.z:+.1f}."
        said = ", ".join(f"{pair.name} (z = {pair.z:+.1f})" for pair in self.differing)
        return (
            f"Of {len(compared)} unknowns {len(self.differing)} differ by more than {DIFFERENCE_LIMIT:g} standard deviations, "
            f"{by_chance:.1f} would by chance: {said}."
        )

    def to_plain(self) -> dict[str, Any]:
        """The same for JSON, SI; without the curves."""

        def side(of: Side | None) -> dict[str, Any] | None:
            return None if of is None else {"mean": of.mean, "sd": of.sd, "interval_90": of.interval_90}

        pairs = {
            p.name: {"unit": p.unit, "first": side(p.first), "second": side(p.second), "z": p.z, "why": p.why}
            for p in self.pairs
        }
        changed = [{"what": c.what, "first": c.first, "second": c.second} for c in self.changed]
        runs = [{"name": name, "verdict": colour} for name, colour in zip(self.names, self.colours, strict=True)]
        said = {"said": self.in_words, "shared_data": self.shared, "one_and_the_same": self.same}
        return {"runs": runs, **said, "unknowns": pairs, "differs": changed}

    def to_dataframe(self) -> pd.DataFrame:
        """One row for each unknown: name, unit, mean and sd of both runs (nan where it is none of one), z and why not."""
        import pandas as pd

        def numbers(of: Side | None) -> tuple[float, float]:
            return (math.nan, math.nan) if of is None else (of.mean, of.sd)

        rows = [(p.name, p.unit, *numbers(p.first), *numbers(p.second), p.z, p.why) for p in self.pairs]
        return pd.DataFrame(rows, columns=["name", "unit", "mean_1", "sd_1", "mean_2", "sd_2", "z", "why"])


def differences_of(
    first: Posterior,
    second: Posterior,
    names: tuple[str, str] = ("first", "second"),
    *,
    same_specimens: bool = False,
    shared: Sequence[str] | None = None,
) -> Difference:
    """Hold two posteriors of different data against each other, unknown by unknown: equation (2).

    What is of material and rig and has the same prior in both is taken for one and the same thing. Whatever differs by nature
    from press to press (contact, load zero, clock) is shown and not compared.

    Parameters
    ----------
    first, second : the posteriors.
    names : of the runs.
    same_specimens : whether specimens of one name are the same pieces, measured again: what was known of them counts once.
    shared : which data both have, in words, where more is known than the posteriors tell; default `shared_data`.

    Returns
    -------
    The comparison, without what only runs know: what has changed, curves, verdicts.
    """
    infos = [{p.name: p for p in posterior.parameters} for posterior in (first, second)]
    shared = tuple(shared_data(first, second) if shared is None else shared)
    both = [name for name in infos[0] if name in infos[1]]
    alike = [name for name in both if infos[0][name].prior.to_json() == infos[1][name].prior.to_json()]
    lasting = [name for name in alike if infos[0][name].parameter not in unknowns_of("sweep")]
    same = [name for name in lasting if same_specimens or not infos[0][name].specimen]
    common = [np.array([_centred(p, of[name]) for name in same]) for p, of in zip((first, second), infos, strict=True)]
    pairs = []
    for name in dict.fromkeys([*infos[0], *infos[1], *first.fixed, *second.fixed]):
        sides = (_side(first, name), _side(second, name))
        z, why = None, _why_not(name, infos, sides)
        if shared:
            why = "data in both"
        elif not why:
            z, why = _weighed(name, (first, second), infos, common, name in alike)
        quantity = QUANTITIES[UnknownName.parse(name).parameter]
        pairs.append(Pair(name, quantity.unit, *sides, z, why))
    return Difference(names, tuple(pairs), shared, tuple(same))


def shared_data(first: Posterior, second: Posterior) -> list[str]:
    """Say in words which data two posteriors have in common: files of the same content, and the same readings in other files.

    Files that were cut, saved anew or renamed count, see `calib.lab.repeated_channels`.

    Parameters
    ----------
    first, second : the posteriors.
    """
    known = {sha: name for sweep in first.sweeps for name, sha in sweep.files}
    found = [f"the file {name}" for sweep in second.sweeps for name, sha in sweep.files if sha in known]
    found += [
        f"the same {channel} readings of {sweep.title}"
        for sweep in second.sweeps
        if not any(sha in known for _, sha in sweep.files)
        for other in first.sweeps
        for channel in repeated_channels(other, sweep)
    ]
    return list(dict.fromkeys(found))


def _side(posterior: Posterior, name: str) -> Side | None:
    if name in posterior.fixed:
        value = float(posterior.fixed[name])
        return Side(value, 0.0, (value, value))
    found = posterior.diagnostics.parameters.get(name)
    return None if found is None else Side(found.mean, found.sd, found.interval_90)


def _why_not(name: str, infos: Sequence[Mapping[str, ParameterInfo]], sides: tuple[Side | None, Side | None]) -> str:
    """Why an unknown of two runs is not compared, in a few words; "" if it is."""
    if None in sides:
        return "in one run only"
    own = [of[name] for of in infos if name in of]
    if not own:
        return "fixed in both"
    return "differs from press to press" if own[0].parameter in unknowns_of("sweep") else ""


def _weighed(
    name: str,
    posteriors: tuple[Posterior, Posterior],
    infos: Sequence[Mapping[str, ParameterInfo]],
    common: Sequence[FloatArray],
    alike: bool,
) -> tuple[float | None, str]:
    """Difference of an unknown by (2), with draws of what is the same in both (n_same, n_draw), and what is to be said."""
    means, variances, across, errors = [], [], [], []
    for posterior, own, others in zip(posteriors, infos, common, strict=True):
        if name not in own:  # it is fixed
            means.append(float(posterior.fixed[name]))
            continue
        column = _column(posterior, own[name], in_prior=alike)
        means.append(float(np.mean(column)))
        variances.append(float(np.var(column)))
        across.append(others @ (column - means[-1]) / column.size if others.size else np.empty(0))
        ess = posterior.diagnostics.parameters[name].ess_bulk
        errors.append(variances[-1] / (ess if math.isfinite(ess) and ess > 1 else column.size))
    learned = [p.diagnostics.parameters[name].prior_contraction for p in posteriors if name in p.diagnostics.parameters]
    if alike and max(learned) < _LEARNED:
        return None, "learned by neither"
    variance = sum(variances) - (2 * float(across[0] @ across[1]) if len(across) > 1 else 0.0)  # (2)
    if variance <= sum(errors):
        return None, "too few draws to tell"
    said = "" if alike else "fixed in one" if len(learned) < 2 else "priors differ"
    return (means[0] - means[1]) / math.sqrt(variance + sum(errors)), said


def _centred(posterior: Posterior, info: ParameterInfo) -> FloatArray:
    """Draws of an unknown in coordinates of its prior, less their mean, (n,)."""
    column = _column(posterior, info, in_prior=True)
    return np.asarray(column - np.mean(column), dtype=float)


def _column(posterior: Posterior, info: ParameterInfo, *, in_prior: bool) -> FloatArray:
    """Draws of an unknown (n,), as coordinates of its prior or in SI."""
    k = [p.name for p in posterior.parameters].index(info.name)
    draws = posterior.draws[..., k].ravel()
    return np.clip(info.prior.to_normal(draws), -_FARTHEST, _FARTHEST) if in_prior else draws

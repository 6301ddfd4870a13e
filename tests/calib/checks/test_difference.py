"""Two calibrations side by side, where it is known how much they differ and what they have in common."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from calib.checks import Difference, differences_of
from calib.lab import Points
from calib.priors.distributions import LogNormal
from calib.sampling.posterior import Posterior
from models.sensor import FloatArray

MakePosterior = Callable[..., Posterior]


def _of_other_data(posterior: Posterior) -> Posterior:
    """The same draws, as if of other lab files."""
    rng = np.random.default_rng(7)
    sweeps = []
    for sweep in posterior.sweeps:
        channels = {
            name: replace(points, value=points.value + rng.normal(0.0, sweep.noise[name], points.value.size))
            for name, points in sweep.channels.items()
        }
        track = None if sweep.track is None else replace(sweep.track, force=1.001 * sweep.track.force)
        files = tuple((f"other {name}", sha[::-1] + "0") for name, sha in sweep.files)
        sweeps.append(replace(sweep, channels=channels, track=track, files=files))
    return replace(posterior, sweeps=tuple(sweeps))


def _drawn(posterior: Posterior, mean: FloatArray, covariance: FloatArray, rng: np.random.Generator) -> Posterior:
    """A posterior that is normal in the coordinates of the priors of its first unknowns, exactly as told."""
    n = mean.size
    raw = rng.standard_normal((960, n))
    raw -= np.mean(raw, axis=0)
    raw = raw @ np.linalg.inv(np.linalg.cholesky(raw.T @ raw / 960)).T
    z = mean + raw @ np.linalg.cholesky(covariance).T
    draws = posterior.draws.copy()
    summaries = dict(posterior.diagnostics.parameters)
    for k, info in enumerate(posterior.parameters[:n]):
        draws[..., k] = info.prior.ppf_normal(z[:, k]).reshape(draws.shape[:2])
        old = summaries[info.name]
        summaries[info.name] = replace(old, ess_bulk=1e9, prior_contraction=1 - covariance[k, k])
    return replace(posterior, draws=draws, diagnostics=replace(posterior.diagnostics, parameters=summaries))


def _from_third(points: Points, noise: float) -> Points:
    there = {
        name: v[2:] for name in ("n_effective", "displacement", "force", "time") if (v := getattr(points, name)) is not None
    }
    return replace(points, value=points.value[2:] * (1 + 1e-9) + 1e-4 * noise, **there)


def _z(found: Difference, name: str = "young_modulus") -> float | None:
    return next(pair.z for pair in found.pairs if pair.name == name)


def test_differences_of_the_same_truth_scatter_as_a_standard_normal(make_posterior: MakePosterior) -> None:
    # Two labs, each with a prior in common and information of its own; two unknowns that their data tell only together.
    first = make_posterior()
    second = _of_other_data(first)
    rng = np.random.default_rng(4)
    information = [np.array([[2.0, 1.5], [1.5, 2.0]]), np.array([[1.0, 0.5], [0.5, 1.5]])]
    covariances = [np.linalg.inv(np.eye(2) + j) for j in information]
    # All the other unknowns of the posteriors made by hand are the same in all of them, and independent.
    zs = []
    for _ in range(250):
        truth = rng.standard_normal(2)
        made: list[Posterior] = []
        for posterior, j, v in zip((first, second), information, covariances, strict=True):
            mean = v @ (j @ truth + np.linalg.cholesky(j) @ rng.standard_normal(2))
            made.append(_drawn(posterior, mean, v, rng))
        found = differences_of(made[0], made[1])
        zs.append([_z(found), _z(found, "relative_permittivity")])
    sd = np.std(np.array(zs, dtype=float), axis=0)
    np.testing.assert_allclose(sd, 1.0, atol=0.12)


def test_the_prior_counts_once(make_posterior: MakePosterior) -> None:
    first = make_posterior()
    second = _of_other_data(first)
    rng = np.random.default_rng(5)
    v, w = 0.5, 0.2
    one, other = (_drawn(p, np.array([m]), np.array([[c]]), rng) for p, m, c in ((first, 0.8, v), (second, -0.1, w)))
    # Cov of the errors v w in coordinates of the prior: less than the plain sum of variances.
    assert _z(differences_of(one, other)) == pytest.approx(0.9 / np.sqrt(v + w - 2 * v * w), rel=0.02)


def test_priors_that_differ_count_each_for_themselves(make_posterior: MakePosterior) -> None:
    first = make_posterior()
    second = _of_other_data(first)
    infos = tuple(replace(p, prior=LogNormal(0.9e6, 2.0)) if p.name == "young_modulus" else p for p in second.parameters)
    pair = next(p for p in differences_of(first, replace(second, parameters=infos)).pairs if p.name == "young_modulus")
    assert pair.why == "priors differ"
    assert pair.z == pytest.approx(0.0, abs=1e-6)


def test_what_neither_run_has_learned_has_no_z(make_posterior: MakePosterior) -> None:
    first = make_posterior()
    found = differences_of(first, _of_other_data(first))
    why = {pair.name: pair.why for pair in found.pairs}
    assert why["relative_permittivity"] == "learned by neither"
    assert why["contact_offset[sensor 1]"] == "differs from press to press"
    assert _z(found) == pytest.approx(0.0, abs=1e-9)
    assert found.in_words.startswith("Nothing differs: of ")


def test_a_difference_is_told_with_how_many_chance_would_have(make_posterior: MakePosterior) -> None:
    first = make_posterior()
    second = _of_other_data(first)
    k = [p.name for p in second.parameters].index("young_modulus")
    draws = second.draws.copy()
    draws[..., k] *= 1.1
    found = differences_of(first, replace(second, draws=draws))
    assert [pair.name for pair in found.differing] == ["young_modulus"]
    assert (_z(found) or 0) < -5
    assert "1 differ by more than 2 standard deviations" in found.in_words


def test_data_in_both_leave_no_z_and_say_which(make_posterior: MakePosterior) -> None:
    first = make_posterior()
    found = differences_of(first, first)
    assert all(pair.z is None and pair.why == "data in both" for pair in found.pairs)
    assert found.in_words.startswith("No difference is weighed: both runs rest on the file sensor 1_force.csv")
    assert "`calib compare`" in found.in_words
    # The same readings in files that were saved anew.
    resaved = tuple(replace(s, files=tuple((name, "0" * 64) for name, _ in s.files)) for s in first.sweeps)
    found = differences_of(first, replace(first, sweeps=resaved))
    assert "the same force readings of sensor 1" in found.shared
    # Cut, too: readings less before contact take points away, and move the others by far less than what is not known of them.
    cut = tuple(replace(s, channels={n: _from_third(c, s.noise[n]) for n, c in s.channels.items()}) for s in resaved)
    found = differences_of(first, replace(first, sweeps=cut))
    assert "the same force readings of sensor 1" in found.shared
    assert all(pair.z is None for pair in found.pairs)


def test_runs_of_other_unknowns_show_what_each_has(make_posterior: MakePosterior, make_lot: MakePosterior) -> None:
    first, second = make_posterior(), _of_other_data(make_lot())
    found = differences_of(first, second)
    why = {pair.name: pair.why for pair in found.pairs}
    assert why["young_modulus_spread"] == why["young_modulus[sensor 1]"] == "in one run only"
    names = {pair.name for pair in found.pairs}
    assert names >= {p.name for p in first.parameters} | {p.name for p in second.parameters}
    rows = found.to_dataframe().set_index("name")
    assert rows["mean_1"].isna()["young_modulus_spread"]
    json.dumps(found.to_plain(), allow_nan=False)


def test_a_value_that_one_run_fixes_is_compared_as_known(make_posterior: MakePosterior) -> None:
    first = make_posterior()
    second = _of_other_data(first)
    k = [p.name for p in second.parameters].index("young_modulus")
    own = second.diagnostics.parameters["young_modulus"]
    summaries = {n: s for n, s in second.diagnostics.parameters.items() if n != "young_modulus"}
    fixed = replace(
        second,
        parameters=tuple(p for p in second.parameters if p.name != "young_modulus"),
        draws=np.delete(second.draws, k, axis=-1),
        fixed={"young_modulus": own.mean - 3 * own.sd},
        diagnostics=replace(second.diagnostics, parameters=summaries),
    )
    pair = next(p for p in differences_of(first, fixed).pairs if p.name == "young_modulus")
    assert pair.why == "fixed in one"
    assert pair.z == pytest.approx(3.0, abs=0.2)


def test_specimens_are_the_same_pieces_only_if_it_is_said(make_posterior: MakePosterior) -> None:
    first = make_posterior()
    second = _of_other_data(first)
    apart, alike = (differences_of(first, second, same_specimens=same) for same in (False, True))
    assert not any("[" in name for name in apart.same)
    assert "sensor_thickness[sensor 1]" in alike.same
    assert not any(name.startswith(("contact_offset", "load_zero")) for name in alike.same)

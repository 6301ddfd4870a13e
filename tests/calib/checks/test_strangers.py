"""Specimens that do not belong to their lot are named, and those that do are not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from calib.checks.reasons import judge_posterior, passed_gates
from calib.checks.strangers import held_against_others, strangers_of
from calib.priors.distributions import HalfNormal, LogNormal
from calib.problem.lots import Lot, LotPrior
from calib.problem.problem import Problem, build_problem
from calib.report.section import Results
from calib.report.sections.others import section as others_section
from calib.sampling.findings import FirstEstimate, Stranger
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm
from models.sensor import FloatArray

MakePosterior = Callable[..., Posterior]


def _lot(n: int) -> Lot:
    return Lot("young_modulus", LotPrior(LogNormal(0.7e6, 1.6), HalfNormal(0.05), (None,) * n), np.arange(n))


def _z(away: FloatArray, error: float = 0.01) -> list[float]:
    names = [f"sensor {k}" for k in range(away.size)]
    return [s.z for s in held_against_others(_lot(away.size), names, away, error**2 * np.eye(away.size))]


@pytest.mark.parametrize("n", [2, 5])
def test_specimens_of_one_lot_lie_off_the_others_as_standard_normal_numbers(n: int) -> None:
    rng = np.random.default_rng(n + 10)
    z, _, _ = _lot(n).prior.draw(rng, 300)
    away = _lot(n).prior.away(z) + 0.01 * rng.standard_normal(z.shape)
    found = [z for row in away for z in _z(row)]
    assert np.mean(found) == pytest.approx(0, abs=0.12)
    assert np.std(found) == pytest.approx(1, abs=0.1)
    assert np.mean(np.abs(found) > 2) == pytest.approx(0.045, abs=0.03)


def test_a_specimen_of_another_lot_stands_out_though_it_widens_the_spread() -> None:
    # By its own place within the spread of all five it would be (n - 1) / sqrt(n) = 1.8 at most.
    z = _z(np.array([0.0, 0.01, -0.01, 0.005, 0.4]))
    assert z[4] > 4
    assert max(map(abs, z[:4])) < 2


def test_of_two_specimens_either_may_be_the_one() -> None:
    one, other = _z(np.array([0.0, 0.4]))
    assert one < -3
    assert other > 3


#: With errors that keep its posterior from being too narrow for a first answer.
ROUGH = ClosedForm(force_error=0.002, capacitance_error=0.005)
_NEAR = {"young_modulus[sensor 1]": 0.62e6, "young_modulus[sensor 2]": 0.62e6}


def _as_meant(posterior: Posterior) -> Problem:
    """A lot of two specimens of which 1.1 and 1.3 mm of padding were wanted."""
    wanted = zip(posterior.experiment.specimens, (1.1e-3, 1.3e-3), strict=True)
    specimens = tuple(replace(s, nominal={"padding_thickness": value}) for s, value in wanted)
    return build_problem(replace(posterior.experiment, specimens=specimens), posterior.sweeps, ROUGH)


def test_paddings_that_were_not_meant_to_be_alike_are_strangers_until_that_is_said(make_lot: MakePosterior) -> None:
    lot = make_lot()
    unsaid = build_problem(lot.experiment, lot.sweeps, ROUGH)
    for problem, stranger in ((unsaid, True), (_as_meant(lot), False)):
        found = strangers_of(problem, _NEAR, "padding_thickness")
        assert (max(abs(s.z) for s in found) > 1.5) == stranger
        of_second = found[1].ratio
        assert of_second.mean == pytest.approx(1.3 / 1.1 if stranger else 1.0, abs=0.05)


def test_specimens_of_one_modulus_are_no_strangers(make_lot: MakePosterior) -> None:
    problem = _as_meant(make_lot())
    for quantity in ("young_modulus", "relative_permittivity"):
        found = strangers_of(problem, _NEAR, quantity)
        assert [(s.specimen, s.quantity) for s in found] == [("sensor 1", quantity), ("sensor 2", quantity)]
        assert max(abs(s.z) for s in found) < 2.0
    alone = make_lot(n_specimen=1)
    assert strangers_of(build_problem(alone.experiment, alone.sweeps, ClosedForm()), {}, "young_modulus") == ()


def _with(
    posterior: Posterior, z: float, of: str = "sensor 2", others: tuple[str, ...] = ("sensor 1", "sensor 3")
) -> Posterior:
    found = [Stranger(name, FirstEstimate(1.0, 0.04), 0.2) for name in others]
    found.append(Stranger(of, FirstEstimate(1.31, 0.06), z))
    return replace(posterior, diagnostics=replace(posterior.diagnostics, strangers=tuple(found)))


@pytest.mark.parametrize(("z", "level"), [(1.0, None), (4.2, "amber"), (7.0, "red")])
def test_a_specimen_that_does_not_belong_is_named(make_lot: MakePosterior, z: float, level: str | None) -> None:
    verdict = judge_posterior(_with(make_lot(), z))
    own = [reason for reason in verdict.reasons if reason.gate == "specimens"]
    assert [reason.level for reason in own] == ([] if level is None else [level])
    if own:
        assert "sensor 2 is 31.0 ± 6.0 % stiffer than the others let one expect" in own[0].finding
        assert "calibrate it by itself" in own[0].action


def test_of_two_the_data_do_not_tell_which_one(make_lot: MakePosterior) -> None:
    (reason,) = [r for r in judge_posterior(_with(make_lot(), 4.2, others=("sensor 1",))).reasons if r.gate == "specimens"]
    assert "of two specimens the data do not tell which one does not belong" in reason.finding


def test_a_lot_that_was_looked_at_and_found_right_says_so(make_lot: MakePosterior) -> None:
    for posterior, looked in ((_with(make_lot(), 1.0), True), (make_lot(), False)):
        assert ("specimens" in passed_gates(posterior, judge_posterior(posterior))) == looked


def test_the_report_shows_how_specimens_lie_off_the_others(make_lot: MakePosterior) -> None:
    found = others_section(Results(_with(make_lot(), 4.2), ()))
    assert found is not None
    rows = found.context["of_lot"]
    assert isinstance(rows, list)
    assert rows[0] == ("sensor 2", "Young's modulus of the sensor", "1.310 ± 0.060", "4.2")

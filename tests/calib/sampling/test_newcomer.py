"""A newcomer given its lot: what weighted draws say of it is what the whole calibration with it in it says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from calib.checks.belonging import Belonging, belongs
from calib.decision.as_built import as_built, signal_as_built
from calib.decision.inspection import _could_pass_for_the_lot, _strays
from calib.errors import InputError
from calib.experiment import Limit, Specification
from calib.lab import Sweep
from calib.priors.distributions import Normal
from calib.problem import Newcomer, ParameterInfo, build_problem, newcomer_experiment, newcomer_of, template_of, values_at
from calib.problem.prior import values_of_lot
from calib.problem.problem import Problem
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.problem.unknowns import of_lot
from calib.problem.values import columns_at
from calib.sampling import newcomer as newcomer_module
from calib.sampling.coordinates import Coordinates
from calib.sampling.estimate import highest_mode, look_at
from calib.sampling.findings import FirstEstimate, Stranger
from calib.sampling.newcomer import GivenLot, given_lot, joined_problem, lot_of, posterior_of, quantiles
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm
from models.sensor import FloatArray, design_from

MakePosterior = Callable[..., Posterior]

RIG = Rig(machine_compliance=2e-6, parasitic_capacitance=0.4e-12, force_noise=0.01, capacitance_noise=5e-15, n_effective=4.0)


@cache
def _lot(make_posterior: MakePosterior) -> Posterior:
    """A lot of two specimens that were meant to be alike, in draws of its first answer."""
    shared = make_posterior()
    specimens = tuple(
        replace(
            specimen,
            priors={
                **specimen.priors,
                "sensor_thickness": Normal(0.76e-3, 0.02e-3),
                "padding_thickness": Normal(1.2e-3, 0.05e-3),
            },
        )
        for specimen in shared.experiment.specimens
    )
    experiment = replace(shared.experiment, pooling="partial", specimens=specimens, discrepancy="off")
    rng = np.random.default_rng(5)
    sweeps = [
        _press(name, 0.62e6 * (1 + off), 0.76e-3 * (1 - off), 1.2e-3, rng)
        for name, off in (("sensor 1", 0.02), ("sensor 2", -0.02))
    ]
    problem = build_problem(experiment, sweeps, ClosedForm())
    look = look_at(problem)
    rows = rng.choice(len(look.theta), 1600, p=look.weight / np.sum(look.weight))
    z = look.theta[rows]
    columns = np.column_stack([columns_at(problem, z), *values_of_lot(problem, z, rng).values()])
    return replace(
        shared,
        experiment=experiment,
        sweeps=tuple(sweeps),
        parameters=(*problem.parameters, *of_lot(problem)),
        fixed=problem.fixed,
        draws=columns[None],
    )


def _press(name: str, modulus: float, sensor: float, padding: float, rng: np.random.Generator) -> Sweep:
    values = {"young_modulus": modulus, "sensor_thickness": sensor, "padding_thickness": padding}
    design = design_from({**values, "relative_permittivity": 2.8, "indenter_radius": 5e-3, "sensor_radius": 10e-3})
    return synthetic_sweep(ClosedForm(), design, 0.5e-3, RIG, rng, specimen=name, n_points=25, tie="force")


def _newcomer(posterior: Posterior, modulus: float, seed: int = 1, name: str = "new") -> Newcomer:
    lot = lot_of(posterior)
    sweep = _press(name, modulus, 0.75e-3, 1.22e-3, np.random.default_rng(seed))
    return newcomer_of(lot, newcomer_experiment(lot, template_of(lot), name), [sweep], ClosedForm(), "sensor 1")


@cache
def _given(make_posterior: MakePosterior) -> GivenLot:
    return given_lot(_newcomer(_lot(make_posterior), 0.64e6), 1)


def test_a_newcomer_is_what_the_calibration_of_its_lot_with_it_says(make_posterior: MakePosterior) -> None:
    posterior, found = _lot(make_posterior), _given(make_posterior)
    assert found.trusted
    problem: Problem = joined_problem(lot_of(posterior), posterior.sweeps, found.newcomer)
    look = look_at(problem)
    assert look.effective_draws > 150
    whole = values_at(problem, look.theta)
    for own in found.newcomer.own:
        values = found.values[own.info.name]
        mean, sd = _moments(values, found.weight)
        wanted, width = _moments(whole[own.info.name], look.weight)
        assert mean == pytest.approx(wanted, abs=0.25 * width), own.info.name
        assert sd == pytest.approx(width, rel=0.2), own.info.name


def test_a_climb_that_is_lost_is_tried_given_another_draw_of_the_lot(
    make_posterior: MakePosterior, monkeypatch: pytest.MonkeyPatch
) -> None:
    climbs: list[FloatArray] = []

    def lost_at_first(space: Coordinates, random: np.random.RandomState) -> tuple[FloatArray, bool]:
        mode, confirmed = highest_mode(space, random)
        climbs.append(mode)
        return (mode + 1.5, False) if len(climbs) == 1 else (mode, confirmed)

    monkeypatch.setattr(newcomer_module, "highest_mode", lost_at_first)
    found = given_lot(_newcomer(_lot(make_posterior), 0.64e6), 1)
    assert len(climbs) == 2
    assert found.trusted
    wanted = _given(make_posterior)
    for own in found.newcomer.own:
        mean, width = _moments(wanted.values[own.info.name], wanted.weight)
        assert _moments(found.values[own.info.name], found.weight)[0] == pytest.approx(mean, abs=0.25 * width), own.info.name


def test_one_that_is_of_another_lot_is_told_by_what_it_differs_in(make_posterior: MakePosterior) -> None:
    posterior = _lot(make_posterior)
    strange = _newcomer(posterior, 1.3e6)
    found = given_lot(strange, 1)
    strangers = {s.quantity: s for s in belongs(strange, found.weight @ found.own).strangers}
    assert strangers["young_modulus"].z > 3.0
    assert strangers["young_modulus"].ratio.mean > 1.5
    sound = {s.quantity: s for s in belongs(_given(make_posterior).newcomer, _middle(_given(make_posterior))).strangers}
    assert max(abs(s.z) for s in sound.values()) < 2.5


@pytest.mark.parametrize("off", [1.25, 0.75])
def test_one_that_is_a_quarter_off_lies_off_as_far_as_is_foretold_of_it(make_posterior: MakePosterior, off: float) -> None:
    lot = lot_of(_lot(make_posterior))
    modulus = off * float(np.median(lot.values["young_modulus"]))
    z, foretold = [], []
    for seed in range(4):
        press = _press("new", modulus, 0.76e-3, 1.2e-3, np.random.default_rng(seed))
        one = newcomer_of(lot, newcomer_experiment(lot, template_of(lot), "new"), [press], ClosedForm(), "sensor 1")
        held = belongs(one, _middle(given_lot(one, 1)))
        z.append(max(abs(s.z) for s in held.strangers))
        foretold.append(held.of_another_kind["young_modulus"])
    assert np.mean(z) == pytest.approx(np.mean(foretold), abs=0.4)


def test_a_lot_hardly_tells_where_one_that_is_a_quarter_off_is_not_named() -> None:
    # The standard deviation is small for 25 %, but the tails are wide: what counts is what would be named.
    shift = Stranger("new", FirstEstimate(1.254, 0.06), 2.82, "young_modulus")
    strangers = (
        shift,
        *[replace(shift, quantity=f"{layer}_thickness", z=0.1) for layer in ("sensor", "padding", "dielectric")],
    )
    told = {"young_modulus": 3.4, "relative_permittivity": 3.2}
    assert not list(_could_pass_for_the_lot(Belonging(strangers, of_another_kind=told)))
    (reason,) = _could_pass_for_the_lot(Belonging(strangers, of_another_kind=told | {"young_modulus": 2.8}))
    assert (reason.gate, reason.level) == ("spread", "amber")
    assert "would lie 2.8 standard deviations off" in reason.finding
    (reason,) = _could_pass_for_the_lot(Belonging())
    assert (reason.gate, reason.level) == ("range", "amber")


def test_a_thickness_beyond_belief_is_no_finding_where_a_factor_is_the_matter(make_posterior: MakePosterior) -> None:
    lot = lot_of(_lot(make_posterior))
    press = _press("new", 0.62e6, 0.76e-3, 1.2e-3, np.random.default_rng(3))
    capacitance = press.channels["capacitance"]
    press = replace(press, channels={**press.channels, "capacitance": replace(capacitance, value=1.1 * capacitance.value)})
    one = newcomer_of(lot, newcomer_experiment(lot, template_of(lot), "new"), [press], ClosedForm(), "sensor 1")
    held = belongs(one, _middle(given_lot(one, 1)))
    assert held.off["capacitance"] == pytest.approx(0.1, abs=0.03)
    thicker = Stranger("new", FirstEstimate(2.55, 0.13), 8.2, "sensor_thickness")
    (reason,) = _strays(replace(held, strangers=(thicker, *held.strangers)))
    assert "nothing that is believed of the lot describes it" in reason.finding
    assert f"capacitance is up to {100 * held.off['capacitance']:.2g} % off what is foretold" in reason.finding
    assert "thickness" not in reason.finding
    (reason,) = _strays(Belonging((replace(thicker, ratio=FirstEstimate(1.2, 0.02)),)))
    assert "sensor thickness of new is 20.0 ± 2.0 % larger than the lot lets one expect" in reason.finding


def test_specimens_of_a_lot_lie_off_it_as_standard_normal_numbers(make_posterior: MakePosterior) -> None:
    posterior = _lot(make_posterior)
    plain = _newcomer(posterior, 0.62e6)
    rng = np.random.default_rng(8)
    z = []
    for _ in range(24):
        # A specimen of a lot as one draw of the posterior has it, with its own rig.
        row = int(rng.integers(plain.lot.size))
        own = plain.means[row] + plain.spreads[row] * rng.standard_normal(len(plain.own))
        own = np.where(["offset" in one.info.parameter or "zero" in one.info.parameter for one in plain.own], 0.0, own)
        values = {name: float(v[0]) for name, v in plain.values(own[None], np.array([row])).items()}
        rig = replace(RIG, **{k: values[k] for k in ("machine_compliance", "parasitic_capacitance")})
        of_design = {q: values.get(f"{q}[new]", values.get(q, 0.0)) for q in ("young_modulus", "relative_permittivity")}
        layers = {q: values[f"{q}[new]"] for q in ("sensor_thickness", "padding_thickness")}
        design = design_from({**of_design, **layers, "indenter_radius": 5e-3, "sensor_radius": 10e-3})
        sweep = synthetic_sweep(ClosedForm(), design, 0.5e-3, rig, rng, specimen="new", n_points=25, tie="force")
        one = newcomer_of(plain.lot, plain.experiment, [sweep], ClosedForm(), "sensor 1")
        # The model is as wrong as it says, too, and the instruments are as noisy as the draw has them.
        (model,) = one.respond(own[None], np.array([row]))
        read = {}
        for name, channel in model.channels.items():
            wrong = channel.modes[0] @ rng.standard_normal(channel.modes.shape[-1])
            noise = np.sqrt(channel.variance[0]) * rng.standard_normal(channel.observed.size)
            read[name] = replace(sweep.channels[name], value=channel.mean[0] + wrong + noise)
        one = newcomer_of(plain.lot, plain.experiment, [replace(sweep, channels=read)], ClosedForm(), "sensor 1")
        z += [s.z for s in belongs(one, own).strangers if s.quantity == "young_modulus"]
    assert 0.6 < float(np.sqrt(np.mean(np.square(z)))) < 1.45


def test_a_specimen_passes_as_far_as_its_draws_conform(make_posterior: MakePosterior) -> None:
    found = _given(make_posterior)
    posterior = posterior_of(found, found.newcomer.lot, 1)
    _, stroke = signal_as_built(posterior, ClosedForm(), 2.0, seed=1)

    def judged(limit: float) -> tuple[float, bool, float, float]:
        s = Specification((Limit("stroke", "at_most", float(limit)),), (2.0,))
        made = as_built(posterior, ClosedForm(), s, n_effective=500.0, seed=1)
        return made.probability, made.accepted, made.consumers_risk, made.producers_risk

    assert judged(2 * np.max(stroke))[:3] == (1.0, True, 0.0)
    probability, accepted, _, producers = judged(np.median(stroke))
    assert probability == pytest.approx(0.5, abs=0.06)
    assert not accepted
    assert producers == probability
    assert judged(0.5 * np.min(stroke))[0] == 0.0


def test_newcomers_of_specimens_that_differ_need_to_know_which_they_are_like(make_posterior: MakePosterior) -> None:
    lot = lot_of(make_posterior())  # under complete pooling, with readings of their own
    with pytest.raises(InputError, match=r"are not believed to be alike before the data in sensor_thickness.*--like"):
        template_of(lot)
    assert template_of(lot, "sensor 2").name == "sensor 2"
    with pytest.raises(InputError, match='no specimen "sensor 3"'):
        template_of(lot, "sensor 3")


def test_what_was_read_of_the_specimen_it_is_like_is_not_known_of_a_newcomer(make_posterior: MakePosterior) -> None:
    one = _given(make_posterior).newcomer
    infos: dict[str, ParameterInfo] = {own.info.parameter: own.info for own in one.own}
    low, high = infos["padding_thickness"].prior.ppf_normal(np.array([-1.0, 1.0]))
    assert (high - low) / 2 > 0.05e-3 / 2  # not the 0.05 mm that sensor 1 was read with, combined with the lot
    assert {own.info.parameter for own in one.own if own.of_lot} == {
        "young_modulus",
        "relative_permittivity",
        "sensor_thickness",
        "padding_thickness",
    }


def test_quantiles_of_weighted_draws_are_those_of_draws_repeated_by_weight() -> None:
    values = np.array([3.0, 1.0, 2.0])
    found = quantiles(np.repeat(values, 100), np.repeat([0.2, 0.5, 0.3], 100) / 100, {"low": 0.25, "high": 0.9})
    assert found["low"] == 1.0
    assert found["high"] == 3.0


def _moments(values: FloatArray, weight: FloatArray) -> tuple[float, float]:
    mean = float(weight @ values)
    return mean, float(np.sqrt(weight @ (values - mean) ** 2))


def _middle(found: GivenLot) -> FloatArray:
    return np.asarray(found.weight @ found.own)

"""Predictive bands and checks, against the closed form they are drawn from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest

from calib.checks.predictive import band, predict
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm
from models.response import OutOfRangeError
from models.sensor import Design, FloatArray

MakePosterior = Callable[..., Posterior]
EXACT = ClosedForm(force_error=0.0, capacitance_error=0.0)


def test_bands_are_quantiles_in_ascending_order() -> None:
    x = np.random.default_rng(1).standard_normal((4000, 3))
    b = band(x)
    assert b.shape == (5, 3)
    assert np.all(np.diff(b, axis=0) > 0)
    assert b[:, 0] == pytest.approx([-1.645, -0.674, 0.0, 0.674, 1.645], abs=0.08)


def test_band_is_left_out_where_more_than_a_twentieth_of_the_draws_is_missing() -> None:
    x = np.ones((100, 2))
    x[:5, 0] = np.nan
    x[:6, 1] = np.nan
    b = band(x)
    assert np.all(b[:, 0] == 1)
    assert np.all(np.isnan(b[:, 1]))


def test_band_of_the_model_follows_the_data_it_was_drawn_from(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    for p in predict(posterior, EXACT, np.random.default_rng(1)):
        assert "force" in p.channels
        assert "capacitance" in p.channels
        for channel in p.channels.values():
            middle = np.interp(channel.check.x, channel.bands.x, channel.bands.model[2])
            assert np.max(np.abs(middle - channel.check.y)) < 0.03 * np.ptp(channel.check.y)


def test_band_of_a_new_reading_holds_the_band_of_the_model(make_posterior: MakePosterior) -> None:
    for p in predict(make_posterior(), EXACT, np.random.default_rng(1)):
        assert "force" in p.channels
        width = np.ptp(p.channels["force"].bands.reading[[0, 4]], axis=0)
        assert np.all(width > np.ptp(p.channels["force"].bands.model[[0, 4]], axis=0))
        # Before contact a reading scatters by its noise of 10 mN and the load zero: 90 % are 3.29 sd wide.
        assert width[0] == pytest.approx(3.29 * np.hypot(0.01, 0.002), rel=0.1)


def test_residuals_of_a_right_model_pass_the_check(make_posterior: MakePosterior) -> None:
    posterior = make_posterior(widen=0.02)
    for p in predict(posterior, EXACT, np.random.default_rng(1)):
        assert "force" in p.channels
        assert "capacitance" in p.channels
        for check in (p.channels["force"].check, p.channels["capacitance"].check):
            assert 0.01 < check.p_value < 0.99
            assert check.inside_90 > 0.8
            assert np.max(np.abs(check.residual)) < 4


def test_check_raises_alarm_when_the_data_are_shifted(make_posterior: MakePosterior) -> None:
    posterior = make_posterior(widen=0.02)
    force = posterior.sweeps[0].channels["force"]
    bumped = replace(force, value=force.value + 0.1 * np.sin(np.arange(40)))
    wrong = replace(
        posterior,
        sweeps=(
            replace(posterior.sweeps[0], channels={**posterior.sweeps[0].channels, "force": bumped}),
            *posterior.sweeps[1:],
        ),
    )
    check = predict(wrong, EXACT, np.random.default_rng(1))[0].channels["force"]
    assert check.check.p_value < 1e-6
    assert "does not describe" in check.check.in_words


def test_forward_error_widens_the_prediction(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    sure = predict(posterior, EXACT, np.random.default_rng(1))[0].channels["force"]
    rough = predict(posterior, ClosedForm(), np.random.default_rng(1))[0].channels["force"]
    assert rough.check.sd[-1] > 3 * sure.check.sd[-1]


def test_change_starts_at_zero_and_is_freed_of_zero_and_parasitics(make_posterior: MakePosterior) -> None:
    p = predict(make_posterior(widen=0.02), EXACT, np.random.default_rng(1))[0]
    assert p.change is not None
    assert p.change.model[2, 0] == pytest.approx(0, abs=1e-12)
    assert p.change_y == pytest.approx(np.interp(p.change_x, p.change.x, p.change.model[2]), abs=5e-4)


def test_sweep_with_one_channel_gives_that_channel_only(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    first, second = posterior.sweeps
    halves = [replace(s, channels={name: s.channels[name]}) for s, name in ((first, "force"), (second, "capacitance"))]
    one_each = replace(posterior, sweeps=tuple(halves))
    only_force, only_capacitance = predict(one_each, EXACT, np.random.default_rng(1))
    assert set(only_force.channels) == {"force"}
    assert only_force.change is None
    assert set(only_capacitance.channels) == {"capacitance"}


def test_prediction_refuses_a_model_that_does_not_cover_the_posterior(make_posterior: MakePosterior) -> None:
    @dataclass(frozen=True)
    class Shallow(ClosedForm):
        def max_depth(self, design: Design) -> FloatArray:
            return 0.1 * ClosedForm.max_depth(self, design)

    with pytest.raises(OutOfRangeError, match=r"covers only 0 % .* sensor 1"):
        predict(make_posterior(), Shallow(), np.random.default_rng(1))

"""What an advice goes beyond is judged by the presses together: none of them alone must make up for another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from calib.decision.extrapolation import Aim, Measured, exceeded, largest_force, largest_in_words
from calib.sampling import Posterior

HARD_ON_THIN = Measured(force=10.0, depth=0.6e-3, padding=1.1e-3, total=1.84e-3, ball=5e-3)
GENTLE_ON_THICK = Measured(force=1.8, depth=0.7e-3, padding=5.5e-3, total=6.24e-3, ball=5e-3)


@pytest.mark.parametrize(
    ("force", "padding", "beyond"),
    [
        (10.0, 1.1e-3, {}),
        (1.8, 5.5e-3, {}),
        (10.0, 5.5e-3, {"force": "5.6 times the largest measured force (1.8 N) on padding as thick"}),
        (10.0, 3.0e-3, {"force": "5.6 times the largest measured force (1.8 N) on padding as thick"}),
        (12.0, 1.1e-3, {"force": "1.2 times the largest measured force (10 N)"}),
        (
            12.0,
            8e-3,
            {
                "force": "1.2 times the largest measured force (10 N)",
                "padding": "1.5 times the thickest measured padding (5.50 mm)",
            },
        ),
    ],
)
def test_a_hard_press_on_thin_padding_does_not_stand_for_one_on_thick(
    force: float, padding: float, beyond: dict[str, str]
) -> None:
    aim = Aim(force, padding, depth=0.3e-3, balls=(5e-3,))
    assert exceeded([HARD_ON_THIN, GENTLE_ON_THICK], aim) == beyond


def test_a_signal_that_was_not_measured_is_beyond_the_data_and_a_stroke_is_not() -> None:
    without = replace(HARD_ON_THIN, electrical=False)
    aim = Aim(5.0, 1.1e-3, depth=0.3e-3, balls=(5e-3,))
    assert exceeded([without], aim) == {"capacitance": "a change of capacitance (none was measured)"}
    assert exceeded([without, HARD_ON_THIN], aim) == {}
    assert exceeded([without], replace(aim, signal=False)) == {}


def test_depth_is_a_share_of_the_sensor_that_is_meant_and_not_of_those_measured() -> None:
    aim = Aim(5.0, 1.1e-3, depth=0.9e-3, balls=(5e-3,))
    assert "depth" in exceeded([HARD_ON_THIN], aim)
    assert "depth" not in exceeded([HARD_ON_THIN], replace(aim, sensor=7.4e-3))
    assert "a depth of 75 % of the thickness" in exceeded([HARD_ON_THIN], replace(aim, sensor=0.1e-3))["depth"]


def test_what_was_measured_is_told_by_padding_where_thick_padding_was_pressed_less() -> None:
    assert largest_in_words([HARD_ON_THIN]) == "forces up to 10 N, the largest measured"
    as_hard = replace(GENTLE_ON_THICK, force=10.02)
    assert largest_in_words([HARD_ON_THIN, as_hard]) == "forces up to 10 N, the largest measured"
    told = "forces up to 10 N on padding of 1.1 mm, 1.8 N on padding of 5.5 mm, the largest measured on padding as thick"
    assert largest_in_words([GENTLE_ON_THICK, HARD_ON_THIN]) == told


def test_a_newcomer_on_thick_padding_is_not_foretold_at_what_thin_padding_was_pressed_to(
    make_posterior: Callable[..., Posterior],
) -> None:
    posterior = make_posterior()
    thin, thick = posterior.sweeps
    force = thick.channels["force"]
    gentle = replace(thick, track=None, channels={"force": replace(force, value=force.value / 5)})
    lot = replace(posterior, sweeps=(thin, gentle))
    assert largest_force(lot) == largest_force(lot, thin.specimen)
    assert largest_force(lot, thick.specimen) == pytest.approx(largest_force(lot) / 4, rel=0.4)

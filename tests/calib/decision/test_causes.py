"""Shares of a doubt's variance: of draws that a chain repeats, and of a choice among a few."""

from __future__ import annotations

import numpy as np
import pytest

from calib.decision.causes import causes, first_order
from models.sensor import FloatArray

RNG = np.random.default_rng(4)


def _repeated(n: int) -> tuple[FloatArray, FloatArray]:
    """Two independent columns of a chain that stays for two or three draws where it is."""
    stays = np.repeat(np.arange(n), RNG.integers(1, 4, n))
    return RNG.standard_normal(n)[stays], RNG.standard_normal(n)[stays]


def test_draws_that_repeat_each_other_do_not_make_a_cause_of_what_tells_nothing() -> None:
    told, idle = _repeated(3000)
    found = {cause.name: cause for cause in causes({"told": told, "idle": idle}, told)}
    assert found["told"].share == pytest.approx(1.0, abs=0.01)
    assert found["idle"].share < 0.05
    assert not found["idle"].counts


def test_shares_of_two_that_add_up_are_theirs_with_and_without_repeated_draws() -> None:
    for a, b in ((RNG.standard_normal(6000), RNG.standard_normal(6000)), _repeated(6000)):
        y = 2 * a + b
        assert first_order(a, y).share == pytest.approx(0.8, abs=0.05)
        assert first_order(b, y).share == pytest.approx(0.2, abs=0.06)


def test_a_choice_among_a_few_has_the_share_between_its_classes() -> None:
    choice = RNG.integers(0, 3, 4000).astype(float)
    y = np.array([0.0, 1.0, 4.0])[choice.astype(int)] + RNG.standard_normal(4000)
    between = np.var(np.array([0.0, 1.0, 4.0]))
    assert first_order(choice, y).share == pytest.approx(between / (between + 1), abs=0.03)
    assert not first_order(choice, RNG.standard_normal(4000)).counts

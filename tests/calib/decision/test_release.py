"""Deciding after a measurement, against what normal knowledge of one margin makes of it exactly."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from calib.decision.release import Decided, Options, after_reading, known_exactly
from models.sensor import FloatArray

ASKED = 0.9


def _decided(p: float, regret: float) -> Decided:
    """What is decided where sensors conform with this probability."""
    fails, holds = (1 - p, 0.0) if p >= ASKED else (0.0, p)
    return Decided(fails, holds, regret, ASKED * fails + (1 - ASKED) * holds)


def _options(limit: float, n_draw: int = 6000, scatter: float = 0.0, paddings: int = 1) -> Options:
    """Sensors whose margin is normal about limits, which fall by the padding, less what scatters."""
    rng = np.random.default_rng(3)
    t = rng.standard_normal(n_draw)
    worst = t[:, None] - limit - 0.5 * np.arange(paddings) + scatter * rng.standard_normal(n_draw)[:, None]
    conforms, short = (worst >= 0).astype(float), np.maximum(-worst, 0.0)
    p = float(np.mean(conforms[:, 0]))
    regret = float(np.mean(short[:, 0]) - np.mean(np.min(short, axis=1)))
    anywhere = np.max(conforms, axis=1)
    return Options(conforms, anywhere, short, ASKED, np.arange(n_draw) % 2 == 0, t[:, None], _decided(p, regret), 0)


def _exact_loss(limit: float, left: float) -> float:
    """Loss expected after a measurement that leaves this variance of 1: integrated over what may be read."""
    middle = np.linspace(-6, 6, 4001) * np.sqrt(1 - left)
    density = np.exp(-0.5 * middle**2 / (1 - left))
    p = ndtr((middle - limit) / np.sqrt(left))
    loss = np.where(p >= ASKED, ASKED * (1 - p), (1 - ASKED) * p)
    return float(np.sum(loss * density) / np.sum(density))


@pytest.mark.parametrize("limit", [-2.0, -1.0, 0.0, 1.0])
@pytest.mark.parametrize("left", [0.8, 0.5, 0.2])
def test_loss_after_a_measurement_is_that_of_normal_knowledge(limit: float, left: float) -> None:
    found = after_reading(_options(limit), np.array([[left]]))
    assert found.share == 1.0
    # Beside chance, decisions made with half of the draws are a little worse than the best.
    assert found.loss == pytest.approx(_exact_loss(limit, left), abs=4 * found.error + 0.003)


def test_a_measurement_that_tells_nothing_changes_nothing_and_one_that_tells_more_is_worth_no_less() -> None:
    options = _options(-1.0)
    nothing = after_reading(options, np.array([[1.0]]))
    assert nothing == options.now
    losses = [after_reading(options, np.array([[left]])).loss for left in (0.95, 0.7, 0.4, 0.1)]
    assert all(later <= earlier + 1e-3 for earlier, later in zip([options.now.loss, *losses], losses, strict=False))


def test_what_scatters_is_left_when_all_is_known() -> None:
    sure, scattered = (known_exactly(_options(-1.0, scatter=scatter)) for scatter in (0.0, 1.0))
    assert sure.loss < 0.006
    assert scattered.loss > 0.03


def test_what_few_draws_do_not_carry_is_weakened_and_said() -> None:
    few, many = (after_reading(_options(-1.0, n_draw=n), np.array([[0.01]])) for n in (300, 6000))
    assert few.share < 1
    assert few.share < many.share
    assert few.loss >= _exact_loss(-1.0, 0.01)


def test_directions_that_no_margin_hangs_on_tell_nothing() -> None:
    options = _options(-1.0)
    rng = np.random.default_rng(9)
    both: FloatArray = np.column_stack([options.hinges, rng.standard_normal(len(options.hinges))])
    wide = Options(options.conforms, options.anywhere, options.short, ASKED, options.first, both, options.now, 0)
    found = after_reading(wide, np.diag([1.0, 0.3]))
    assert found.loss == pytest.approx(options.now.loss, abs=3 * found.error + 1e-3)


def test_padding_is_chosen_better_by_who_knows_more() -> None:
    # Two kinds of padding, one for each sign of what is not known.
    options = _options(0.0)
    t = options.hinges[:, 0]
    worst = np.column_stack([t, -t]) - 0.1
    conforms, short = (worst >= 0).astype(float), np.maximum(-worst, 0.0)
    regret = float(np.min(np.mean(short, axis=0)) - np.mean(np.min(short, axis=1)))
    p = float(np.max(np.mean(conforms, axis=0)))
    best = int(np.argmax(np.mean(conforms, axis=0)))
    two = Options(conforms, np.max(conforms, axis=1), short, ASKED, options.first, options.hinges, _decided(p, regret), best)
    found = after_reading(two, np.array([[0.05]]))
    assert found.regret < 0.2 * regret
    assert found.overturned > 0.5

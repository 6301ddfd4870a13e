"""What one looks about in agrees with the advice, and limits and tolerances do to it what they should."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from calib.decision import PLACE, Landscape, Requirement, landscape, recommend
from calib.digits import span_text
from calib.errors import InputError
from calib.experiment import Limit
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm


@pytest.fixture(scope="module")
def land(make_posterior: Callable[..., Posterior]) -> Landscape:
    """A landscape up to 6 N of a posterior made by hand."""
    return landscape(make_posterior(), ClosedForm(), force=6.0, lower=0.0, upper=4e-3, n_thickness=17)


@pytest.mark.parametrize("force", [0.3, 2.0, 4.7, 6.0])
def test_bands_are_those_of_the_advice(land: Landscape, make_posterior: Callable[..., Posterior], force: float) -> None:
    wanted = Requirement(force=force, lower=0.0, upper=4e-3, n_thickness=17, n_draw=300)
    advice = recommend(make_posterior(), ClosedForm(), wanted, seed=1)
    view = land.view(force)
    here = np.isin(view.thickness, advice.thickness) & view.covered
    both = np.isin(advice.thickness, view.thickness[here]) & advice.covered
    assert np.array_equal(view.thickness[here], advice.thickness[both])
    assert np.sum(both) >= 15
    np.testing.assert_allclose(view.depth[:, here], advice.depth[:, both], rtol=1e-3)
    np.testing.assert_allclose(view.resolution[:, here], advice.resolution[:, both], rtol=0.02)
    width = (advice.change[4] - advice.change[0])[both]
    assert np.all(np.abs(view.change[2, here] - advice.change[2, both]) < 0.1 * width)
    assert np.all(np.abs((view.change[4] - view.change[0])[here] / width - 1) < 0.2)


def test_what_is_tighter_is_kept_less_often(land: Landscape) -> None:
    loose, tight, both = (
        land.view(4.0, limits)
        for limits in (
            [Limit("stroke", "at_most", 0.8e-3)],
            [Limit("stroke", "at_most", 0.5e-3)],
            [Limit("stroke", "at_most", 0.8e-3), Limit("signal", "at_least", 0.02), Limit("height", "at_most", 3e-3)],
        )
    )
    there = loose.covered
    assert np.all(tight.conforming[there] <= loose.conforming[there])
    assert np.all(both.conforming[there] <= loose.conforming[there])
    assert both.fails.shape == (3, 17)
    np.testing.assert_allclose(1 - tight.fails[0][there], tight.conforming[there])
    assert np.all(both.conforming[there] <= 1 - np.max(both.fails[:, there], axis=0) + 1e-12)


def test_a_tolerance_smears_the_probability_over_the_pads(land: Landscape) -> None:
    limit = [Limit("height", "at_most", 2.5e-3)]
    exact, spread = land.view(2.0, limit), land.view(2.0, limit, tolerance=0.5e-3)
    step = int(np.flatnonzero(np.diff(exact.conforming) < -0.5)[0])
    assert exact.conforming[step] > spread.conforming[step] > spread.conforming[step + 1] > exact.conforming[step + 1]


def test_what_goes_beyond_the_data_is_amber_there_and_not_elsewhere(land: Landscape) -> None:
    colours = [verdict.colour for verdict in land.view(2.0).verdict]
    near = int(np.argmin(np.abs(land.thickness - 1.2e-3)))
    assert colours[near] == "green"
    assert colours[-1] == "amber"


#: A load [N] that thick padding carries inside the range of the closed form, and thin padding does not.
_LOAD = 30.0


def test_no_press_is_advised_that_the_model_does_not_cover(make_posterior: Callable[..., Posterior]) -> None:
    land = landscape(make_posterior(), ClosedForm(), force=60.0, lower=0.0, upper=4e-3, n_thickness=17)
    view = land.view(_LOAD)
    assert np.any(view.covered)
    assert not np.all(view.covered)
    for thickness, covered, reach, verdict in zip(land.thickness, view.covered, land.reach, view.verdict, strict=True):
        (action,) = [reason.action for reason in verdict.reasons if reason.gate == "extrapolation"]
        if covered:
            pad = re.match(rf"Press one pad of about ([\d.]+) mm to {_LOAD:g} N and calibrate", action)
            assert pad is not None
            assert float(pad[1]) == pytest.approx(thickness * 1e3, rel=0.05)
        else:
            assert "Press" not in action
            told = re.search(r"covers such padding up to ([\d.]+) N only: .* or no more than \1 N here", action)
            assert told is not None
            assert 0.98 * reach < float(told[1]) <= reach
            assert (
                f"padding that it covers at {_LOAD:g} N ({span_text(land.thickness[view.covered][0] * 1e3, 4.0)} mm)" in action
            )
    # What is advised instead is covered, and can be confirmed.
    thin = int(np.flatnonzero(~view.covered)[-1])
    less = land.view(float(np.floor(10 * land.reach[thin]) / 10))
    assert less.covered[thin]
    assert [reason.action.split()[0] for reason in less.verdict[thin].reasons] == ["Press"]


@pytest.mark.parametrize("load", [26.0, 30.0, 41.0, 52.0])
def test_what_is_covered_begins_and_ends_where_the_advice_has_it(make_posterior: Callable[..., Posterior], load: float) -> None:
    land = landscape(make_posterior(), ClosedForm(), force=60.0, lower=0.0, upper=9e-3)
    view = land.view(load)
    n_place = round(9e-3 / PLACE) + 1
    advice = recommend(make_posterior(), ClosedForm(), Requirement(load, 0.0, 9e-3, n_thickness=n_place, n_draw=300), seed=1)
    ends, asked = (at.thickness[at.covered][[0, -1]] for at in (view, advice))
    assert not np.all(advice.covered)
    np.testing.assert_allclose(ends, asked, atol=1.01 * PLACE)
    # The curves go there, with the bands of the advice.
    for end in (0, -1):
        here = int(np.flatnonzero(view.covered)[end])
        there = int(np.argmin(np.abs(advice.thickness - view.thickness[here])))
        np.testing.assert_allclose(view.depth[:, here], advice.depth[:, there], rtol=2e-3)


def test_a_draw_that_does_not_carry_the_next_load_of_the_table_carries_those_below(
    make_posterior: Callable[..., Posterior],
) -> None:
    few, many = (
        landscape(make_posterior(), ClosedForm(), force=60.0, lower=0.0, upper=9e-3, n_load=n).view(_LOAD) for n in (9, 129)
    )
    assert np.array_equal(few.thickness, many.thickness)
    assert np.array_equal(few.covered, many.covered)
    np.testing.assert_allclose(few.change[2][few.covered], many.change[2][many.covered], rtol=0.02)
    assert np.array_equal(np.isfinite(few.change[0]), few.covered)


def test_what_is_said_of_a_padding_between_those_that_are_tabulated_names_that_padding(
    make_posterior: Callable[..., Posterior],
) -> None:
    land = landscape(make_posterior(), ClosedForm(), force=8.0, lower=0.0, upper=9e-3, n_thickness=37)
    thickness = np.arange(1.3e-3, 9e-3, 0.05e-3)
    asked = [
        (at, reason.action)
        for at, verdict in zip(thickness, land.verdicts(land.view(8.0), thickness), strict=True)
        for reason in verdict.reasons
        if reason.action.startswith("Press one pad")
    ]
    assert len(asked) > 50
    for at, action in asked:
        assert f"pad of about {at * 1e3:.2f} mm to 8 N" in action


def test_a_load_that_is_not_tabulated_and_limits_that_are_not_told_are_refused_together(land: Landscape) -> None:
    with pytest.raises(InputError) as refusal:
        land.view(60.0, [Limit("dielectric_strain", "at_most", 0.4)], tolerance=-1e-4)
    assert len(refusal.value.faults) == 3


@pytest.mark.parametrize("asked", [{"force": 0.0}, {"lower": 5e-3}, {"lower": -1e-3}, {"n_thickness": 2}])
def test_a_landscape_of_nothing_is_refused(make_posterior: Callable[..., Posterior], asked: dict[str, Any]) -> None:
    usual: dict[str, Any] = {"force": 6.0, "lower": 0.0, "upper": 4e-3, "n_thickness": 17}
    with pytest.raises(InputError, match="a landscape needs"):
        landscape(make_posterior(), ClosedForm(), **{**usual, **asked})

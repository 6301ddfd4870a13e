"""Pictures of a page: drawn by workers they are the same, and an earlier page of the same posterior gives them back."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from calib.checks.predictive import Prediction, predict
from calib.decision import Requirement, recommend
from calib.report import begin_drawing, kept_drawings, report_page
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm


@pytest.fixture(scope="module")
def posterior(make_posterior: Callable[..., Posterior]) -> Posterior:
    return make_posterior(n_specimen=1)


@pytest.fixture(scope="module")
def predictions(posterior: Posterior) -> tuple[Prediction, ...]:
    return predict(posterior, ClosedForm(), np.random.default_rng(1), n_draw=50)


@pytest.fixture
def counted(undrawn: None, monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Pictures that are a number each instead of drawn; gives what was asked for."""
    asked: list[object] = []

    def numbered(figure: object, **_: object) -> str:
        asked.append(figure)
        return f"data:,{len(asked)}"

    monkeypatch.setattr("calib.report.pictures.figure_address", numbered)
    return asked


def test_workers_draw_every_picture_once(
    posterior: Posterior, predictions: tuple[Prediction, ...], counted: list[object]
) -> None:
    with ThreadPoolExecutor(1) as executor:
        drawn = begin_drawing(posterior, predictions, None, executor)
        page = report_page(posterior, predictions, drawings=drawn)
    assert len(counted) == len(drawn) == page.count("<img ") == 8
    assert page == report_page(posterior, predictions, drawings=drawn)


def test_an_earlier_page_gives_its_pictures_back_but_not_that_of_its_recommendation(
    posterior: Posterior, predictions: tuple[Prediction, ...], counted: list[object]
) -> None:
    advice = recommend(posterior, ClosedForm(), Requirement(8.0, 0.0, 4e-3, n_thickness=5, n_draw=50), seed=1)
    page = report_page(posterior, predictions, advice)
    n = len(counted)
    kept = kept_drawings(posterior, predictions, page)
    assert len(kept) == n - 2
    assert not {"padding", "beside"} & kept.keys()
    again = report_page(posterior, predictions, advice, drawings=kept)
    assert len(counted) == n + 2
    for k, name in enumerate(("padding", "beside"), n + 1):
        again = again.replace(f'"data:,{k}"', f'"{name}"')
        page = page.replace(f'"data:,{_number_of(name, page)}"', f'"{name}"')
    assert again == page


def test_a_page_of_another_making_gives_no_pictures(posterior: Posterior, predictions: tuple[Prediction, ...]) -> None:
    assert kept_drawings(posterior, predictions, '<img src="data:,1" alt="x" data-name="another">') == {}
    assert kept_drawings(posterior, predictions, "") == {}


def _number_of(name: str, page: str) -> str:
    return page.partition(f'data-name="{name}"')[0].rpartition('src="data:,')[2].partition('"')[0]

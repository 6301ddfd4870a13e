"""Every hostile file is read right or refused with a way out, whichever a lab is better served with."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from hostile_b_case import Case
from hostile_b_cases import hostile_cases
from hostile_b_judge import BY_LUCK, GOOD, RIGHT, SILENT, TOLD_WRONGLY, UNNAMED, Outcome, judge, judge_reading

CASES = hostile_cases()
READABLE = tuple(c for c in CASES if c.expected != "refuse")


def perfect(case: Case) -> Outcome:
    """What a reader without fault makes of a case."""
    n_row = len(case.lines)
    used = np.zeros(n_row, bool) if case.must_use is None else case.must_use
    return Outcome(
        lines=list(case.lines),
        columns=case.truth,
        observed={q: turn * case.truth[q] for q, turn in case.turned.items() if q in case.truth},
        used=used,
        reasons=("",) * n_row,
        told=("the truth", *(f'"{c}"' for c in case.left)),
    )


def test_no_two_cases_have_the_same_name() -> None:
    assert len({c.name for c in CASES}) == len(CASES)


@pytest.mark.parametrize("case", READABLE, ids=lambda c: c.name)
def test_the_truth_of_a_case_is_judged_right(case: Case) -> None:
    assert judge_reading(replace(case, choice=""), perfect(case)).verdict == RIGHT
    if case.must_use is not None and case.must_not_use is not None:
        assert not (case.must_use & case.must_not_use).any()
        assert case.must_use.sum() >= 4, "nothing is demanded"


@pytest.mark.parametrize("case", READABLE, ids=lambda c: c.name)
def test_a_false_number_a_false_sign_and_an_unnamed_column_are_not_judged_right(case: Case) -> None:
    truth = perfect(case)
    bad = (SILENT, TOLD_WRONGLY)
    for q in case.truth:
        if not np.isfinite(case.truth[q]).any() or q in ("cycle", "status"):
            continue
        free = np.zeros(len(case.lines), bool) if case.free is None else case.free
        row = int(np.argmax(np.isfinite(case.truth[q]) & ~free & (np.arange(len(free)) > 5)))
        wrong = case.truth[q].copy()
        wrong[row] = wrong[row] * 10 + 1e-3 * (q != "capacitance")
        assert judge_reading(case, replace(truth, columns={**case.truth, q: wrong})).verdict in bad
    for q in truth.observed:
        turned = {**truth.observed, q: -truth.observed[q]}
        assert judge_reading(case, replace(truth, observed=turned)).verdict in bad
    if case.left:
        assert judge_reading(replace(case, choice=""), replace(truth, told=("nothing",))).verdict == UNNAMED
    if case.choice:
        assert judge_reading(case, replace(truth, told=("nothing",))).verdict == BY_LUCK


@pytest.mark.parametrize("case", CASES, ids=lambda c: c.name)
def test_hostile_file_is_read_right_or_refused_with_a_way_out(case: Case, tmp_path: Path) -> None:
    result = judge(case, tmp_path)
    assert result.verdict in GOOD, f"{result.verdict}: {result.detail}"

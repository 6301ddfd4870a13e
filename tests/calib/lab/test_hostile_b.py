"""Every hostile file is read right or refused with a way out, whichever a lab is better served with."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from hostile_b_case import Case
from hostile_b_cases import hostile_cases
from hostile_b_judge import GOOD, judge

CASES = hostile_cases()


def test_no_two_cases_have_the_same_name() -> None:
    assert len({c.name for c in CASES}) == len(CASES)


@pytest.mark.parametrize("case", CASES, ids=lambda c: c.name)
def test_hostile_file_is_read_right_or_refused_with_a_way_out(case: Case, tmp_path: Path) -> None:
    result = judge(case, tmp_path)
    assert result.verdict in GOOD, f"{result.verdict}: {result.detail}"

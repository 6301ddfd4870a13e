"""Hostile files with known truth: each is read to it, or refused with the place and a way out; look-alikes of labs are read."""

from __future__ import annotations

from pathlib import Path

import pytest
from hostile_cases import Case, collected, judge

CASES = [pytest.param(case, id=f"{module.removeprefix('hostile_')}-{case.name}") for module, case in collected()]


@pytest.mark.parametrize("case", CASES)
def test_hostile_file_is_read_to_the_truth_or_refused_with_a_way_out(case: Case, tmp_path: Path) -> None:
    judged = judge(case, tmp_path)
    assert judged.word in ("right", "refused well"), f"{judged.word}: {judged.detail} ({case.why})"


def test_names_of_hostile_files_are_unique() -> None:
    names = [case.name for _, case in collected()]
    assert len(names) == len(set(names))

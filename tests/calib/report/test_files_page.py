"""What `docs/files.md` says of the files of a run is what they hold."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path

import pytest

from calib.checks import Verdict
from calib.decision import Recommendation, Requirement
from calib.report import summary_json
from calib.runs.listing import Listing
from calib.sampling import ParameterSummary, Posterior

PAGE = Path(__file__).parents[3] / "docs" / "files.md"


def _section(heading: str) -> str:
    return PAGE.read_text(encoding="utf-8").split(f"\n## {heading}\n")[1].split("\n## ")[0]


def test_every_key_of_the_summary_is_told_and_no_other(make_posterior: Callable[..., Posterior]) -> None:
    keys = [key for key in json.loads(summary_json(make_posterior(), Verdict())) if key not in ("kind", "format", "checksum")]
    told = re.findall(r"^\| `(\w+)` \|", _section("summary.json"), flags=re.MULTILINE)
    assert told == keys


@pytest.mark.parametrize("of", [ParameterSummary, Recommendation, Requirement, Listing])
def test_every_attribute_that_becomes_a_row_of_a_table_is_described(of: type) -> None:
    said = (of.__doc__ or "").split("Attributes\n")[1]
    named = {name for line in re.findall(r"^    (\w[\w, ]*) : ", said, flags=re.MULTILINE) for name in line.split(", ")}
    assert {field.name for field in fields(of)} <= named

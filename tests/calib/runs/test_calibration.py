"""A calibration keeps what only the look before it finds."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from small_run import QUICK, make_lab, quick

from calib.checks import UNSEEN, unseen_from_text
from calib.runs import check, load_run
from calib.runs.before import plausibility_of


def test_what_no_check_sees_is_kept_with_the_run_as_the_check_says_it(tmp_path: Path) -> None:
    lab = make_lab(tmp_path)
    told = check(lab / "experiment.toml").outlook
    assert told is not None
    assert {one.cause for one in told.unseen} >= {"force_gain", "indenter_radius"}
    quick(lab, seed=4, stages=replace(QUICK, check=plausibility_of))
    assert unseen_from_text(load_run(lab / "run").posterior.attrs[UNSEEN]) == told.unseen

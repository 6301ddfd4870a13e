"""Makes what the tests of run folders share importable, and a folder with lab files."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture
def lab(tmp_path: Path) -> Path:
    """A folder with the experiment and its lab file."""
    from small_run import make_lab

    return make_lab(tmp_path)

"""Lets modules of this folder import their neighbours by name, also where pytest collects them for doctests."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

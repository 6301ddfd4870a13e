"""Lets modules of this folder import their neighbours by name, also where they are collected by themselves for their doctests."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

"""Nothing in, the folder of the lab data that come with the package out: two specimens with their experiment, to try it on."""

from __future__ import annotations

from pathlib import Path


def shipped() -> Path:
    """Find the folder of the shipped lab data: in an installed package, or in `datasets` beside one that is used in place."""
    package = Path(__file__).parents[1]
    installed = package / "example"
    return installed if installed.is_dir() else package.parent / "datasets" / "padded_sensor"

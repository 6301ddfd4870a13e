"""What the packages write for people is written in one manner."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]


def close_percents(source: str) -> Iterator[int]:
    """Lines with a formatted number that a per cent sign follows without a space."""
    for text in ast.walk(ast.parse(source)):
        if not isinstance(text, ast.JoinedStr):
            continue
        for part, following in zip(text.values, [*text.values[1:], None], strict=True):
            if not isinstance(part, ast.FormattedValue):
                continue
            form = part.format_spec.values[-1:] if isinstance(part.format_spec, ast.JoinedStr) else []
            ends = [str(one.value).endswith("%") for one in form if isinstance(one, ast.Constant)]
            if any(ends) or (isinstance(following, ast.Constant) and str(following.value).startswith("%")):
                yield part.lineno


def test_per_cent_has_a_space_before_its_sign() -> None:
    assert [*close_percents('f"{x:.0%}"\nf"{x:.0f}%"\nf"{x:.0f} %"\nf"{x:{n}.1%}"')] == [1, 2, 4]
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for package in ("calib", "models")
        for path in sorted((ROOT / package).rglob("*.py"))
        for line in close_percents(path.read_text(encoding="utf-8"))
    ]
    assert found == []

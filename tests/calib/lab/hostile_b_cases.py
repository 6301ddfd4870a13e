"""Every case of the corpus with its verdict, printed: python tests/calib/lab/hostile_b_cases.py [part of a name]."""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from hostile_b_benign import benign_cases
from hostile_b_case import Case
from hostile_b_columns import column_cases
from hostile_b_judge import VERDICTS, judge
from hostile_b_signs import sign_cases
from hostile_b_use import use_cases


def hostile_cases() -> tuple[Case, ...]:
    """All cases, each name once."""
    return (*sign_cases(), *column_cases(), *benign_cases(), *use_cases())


def main(part: str = "") -> None:
    """Print case, verdict, detail, and how many there are of each verdict and kind."""
    count: Counter[tuple[str, str]] = Counter()
    with tempfile.TemporaryDirectory() as folder:
        for case in hostile_cases():
            if part.lower() not in case.name.lower():
                continue
            result = judge(case, Path(folder))
            count[case.kind, result.verdict] += 1
            detail = result.detail.replace("\n", " / ")
            print(f"{case.name} -> {result.verdict} -> {detail if part else detail[:300]}")
    kinds = sorted({k for k, _ in count})
    print()
    for verdict in VERDICTS:
        row = [count[k, verdict] for k in kinds]
        print(f"{verdict:24}" + "".join(f"{k} {n:3}   " for k, n in zip(kinds, row, strict=True)) + f"all {sum(row):3}")


if __name__ == "__main__":
    main(" ".join(sys.argv[1:]))

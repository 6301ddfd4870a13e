"""One BLAS thread for all tests: the matrices are small, and two workers with two threads each get into each other's way.

What is one long test comes first, so that no worker is left with it at the end. With --every 3 tests that go through many
files or cases take each third of them, the first number --from.
"""

import os
from collections import Counter

import pytest

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

#: Files of few and long tests.
LONG = ("README.md", "test_notebooks.py", "test_benchmarks.py", "test_interruptions.py", "test_posterior.py")


#: Tests of more cases than this go through a corpus.
MANY = 12


def pytest_addoption(parser: pytest.Parser) -> None:
    """Say which part of the cases of tests that go through many is meant."""
    parser.addoption("--every", type=int, default=1, help=f"of tests of more than {MANY} cases take each so many-th")
    parser.addoption("--from", type=int, default=0, help="number of the first that is taken, from 0")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Put the long tests first, and leave out the cases that are not meant."""
    every, first = config.getoption("--every"), config.getoption("--from")
    tests = [item.nodeid.partition("[")[0] for item in items]
    cases, seen = Counter(tests), Counter[str]()
    kept: list[pytest.Item] = []
    left: list[pytest.Item] = []
    for item, test in zip(items, tests, strict=True):
        meant = cases[test] <= MANY or seen[test] % every == first % every
        (kept if meant else left).append(item)
        seen[test] += 1
    if left:
        config.hook.pytest_deselected(items=left)
    items[:] = sorted(kept, key=lambda item: LONG.index(item.path.name) if item.path.name in LONG else len(LONG))

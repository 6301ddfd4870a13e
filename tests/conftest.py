"""One BLAS thread for all tests: the matrices are small, and two workers with two threads each get into each other's way.

What is one long test comes first, so that no worker is left with it at the end.
"""

import os

import pytest

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

#: Files of few and long tests.
LONG = ("README.md", "test_notebooks.py", "test_benchmarks.py", "test_interruptions.py", "test_posterior.py")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put the long tests first."""
    items.sort(key=lambda item: LONG.index(item.path.name) if item.path.name in LONG else len(LONG))

"""A block of code in, its linear algebra on one thread out."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from importlib import import_module

from threadpoolctl import ThreadpoolController


@cache
def _blas() -> ThreadpoolController:
    # NumPy and SciPy each bring a BLAS, and only those that are loaded are found.
    import_module("scipy.linalg")
    return ThreadpoolController()


def one_thread() -> AbstractContextManager[object]:
    """Keep linear algebra to one thread inside a `with` block.

    The matrices here are small: threads that wait for each other cost many times the work.
    """
    limit: AbstractContextManager[object] = _blas().limit(limits=1, user_api="blas")
    return limit

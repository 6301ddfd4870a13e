"""A mask of rows in, where it is true in succession out."""

from __future__ import annotations

import numpy as np

from models.sensor import BoolArray


def stretches(mask: BoolArray) -> list[tuple[int, int]]:
    """List where a mask is true without a break: the first row of each stretch, and the one behind it.

    Parameters
    ----------
    mask : (n_row,).

    >>> stretches(np.array([True, False, True, True]))
    [(0, 1), (2, 4)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(first, behind) for first, behind in edges.reshape(-1, 2).tolist()]

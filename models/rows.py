"""Rows of numbers in, as many more out that products with a matrix round each row the same, whatever rows are beside it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

# Libraries of linear algebra take rows in groups of up to so many, and round those of an incomplete group otherwise.
_GROUP = 8


def whole_groups(rows: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Add rows of zeros to (n, k), up to whole groups: a result for one draw is then the same, to the bit, as among others.

    >>> whole_groups(np.ones((3, 2))).shape
    (8, 2)
    """
    missing = -len(rows) % _GROUP
    return np.concatenate([rows, np.zeros((missing, rows.shape[1]), rows.dtype)]) if missing else rows

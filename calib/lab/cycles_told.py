"""From a column of a file that counts cycles, and the cycles of its readings, to what is said where the two differ."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calib.errors import in_shell
from calib.lab.instruments import IntArray, LabTable

# A count is that of a cycle where so many of its rows of loading have it; a number of the file is one of so many rows at least.
_MOSTLY, _FEWEST = 0.8, 3


def cycles_told(table: LabTable, branch: Sequence[str], cycles: IntArray) -> list[str]:
    """Say which numbers of the file the cycles of the readings have, where these are others, or more or fewer.

    Parameters
    ----------
    table : the file, whose column of cycles is held against the readings.
    branch, cycles : of each row, as the readings show them, (n_row,).
    """
    counted = table.columns.get("cycle")
    n_cycle = int(np.max(cycles, initial=0))
    there = cycles > 0 if counted is None else (cycles > 0) & np.isfinite(counted)
    if counted is None or not np.any(there):
        return []
    numbers, rows = np.unique(np.floor(counted[there]), return_counts=True)
    numbers = numbers[rows >= _FEWEST]
    loading = there & np.array([b == "loading" for b in branch])
    own = [np.floor(counted[loading & (cycles == k)]) for k in range(1, n_cycle + 1)]
    middle = [float(np.median(values)) if values.size else np.nan for values in own]
    clear = all(np.mean(values == m) >= _MOSTLY for values, m in zip(own, middle, strict=True) if values.size)
    paired = clear and numbers.size == n_cycle and bool(np.all(np.diff(middle) > 0))
    name = table.sources.get("cycle", "cycle")
    if not numbers.size or (paired and middle == list(range(1, n_cycle + 1))) or numbers.size == n_cycle == 1:
        return []
    if paired:
        first = f"{middle[0]:.0f}"
        return [f'"{name}" counts from {first}: --cycles counts the presses from 1, so that --cycles 1 is its {first}']
    counts = (
        f"{numbers.size} numbers ({numbers[0]:.0f} to {numbers[-1]:.0f})" if numbers.size > 1 else f"{numbers[0]:.0f} alone"
    )
    shown = f"{n_cycle} presses" if n_cycle > 1 else "one press"
    where = (
        f"; the rows of one number alone are read by --where {in_shell(f'{name}={numbers[0]:.0f}')}" if numbers.size > 1 else ""
    )
    return [f'"{name}" has {counts} where the readings show {shown}: --cycles counts these, from 1{where}']

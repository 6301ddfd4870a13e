"""From the columns that are not read to what they say of the cycles that are used and of the others, where that differs."""

from __future__ import annotations

from collections.abc import Collection

from calib.errors import in_shell
from calib.lab.instruments.labtable import IntArray, LabTable


def stages_told(table: LabTable, cycles: IntArray, taken: Collection[int]) -> list[str]:
    """Say what columns such as "Phase" hold in the cycles that are used, where they hold something else in others.

    Parameters
    ----------
    table : the file, with the cells of such columns.
    cycles : of each row, (n_row,); 0 before the first.
    taken : cycles that are used.
    """
    notes = []
    for name, cells in table.stages.items():
        held = [cell.strip() for cell in cells]
        own: dict[str, None] = {}
        others: dict[str, int] = {}
        for value, cycle in dict.fromkeys(zip(held, cycles.tolist(), strict=True)):
            if cycle in taken:
                own[value] = None
            elif cycle > 0:
                others.setdefault(value, cycle)
        said = [f'"{value[:60]}" from cycle {cycle} on' for value, cycle in others.items() if value and value not in own]
        if not own or not said:
            continue
        used = ", ".join(f'"{value[:60]}"' for value in own)
        which = f"cycle{'s' if len(taken) > 1 else ''} {', '.join(map(str, taken))}"
        value, cycle = next((v, k) for v, k in others.items() if v and v not in own)
        notes.append(
            f'"{name}" says {used} in {which}, used here, and {", ".join(said)}: if those are to be used, --cycles {cycle}, '
            f"or --where {in_shell(f'{name}={value}')}"
        )
    return notes

"""From a channel in g or mg, which may be a load or an acceleration, to the fault of one that no press shows to be a load."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.meanings import is_channel
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.unit_choice import written_unit
from calib.lab.instruments.vocabulary import Heading
from models.sensor import FloatArray

_ACCELERATIONS = ("g", "mg")
# A load goes with the displacement of its press by so much at least, as a coefficient of correlation; noise and drift do not.
_GOES_WITH = 0.7


def load_or_acceleration(
    sheet: Sheet, index: int, heading: Heading, values: Mapping[str, FloatArray], reading: Reading
) -> list[Fault]:
    """List the fault of a force by nothing but a unit that is one of acceleration, too, where it does not go as a load does.

    Parameters
    ----------
    sheet : the record.
    index, heading : the column of its force.
    values : quantity -> readings in SI, nan where there is none, (n_row,).
    reading : what the user says of the file: a column or unit that is said is not doubted.
    """
    unit = written_unit(sheet, index, heading)
    said = index in sheet.assigned or "force" in reading.units
    if said or unit.lower() not in _ACCELERATIONS or not is_channel(heading.name):
        return []
    place, load = values.get("displacement", np.zeros(0)), values["force"]
    both = np.isfinite(place) & np.isfinite(load) if place.size else np.zeros(0, dtype=bool)
    if np.count_nonzero(both) > 2 and np.ptp(place[both]) > 0 and np.ptp(load[both]) > 0:
        goes_with = float(np.corrcoef(place[both], load[both])[0, 1])
        if abs(goes_with) >= _GOES_WITH:
            return []
    this = Choice("columns", (sheet.name_for_asking(index),), "force")
    none = Choice("columns", ("none",), "force")
    message = (
        f'column "{sheet.names[index]}" may be a load or an acceleration: it does not go with a displacement as a load does'
    )
    advice = f"If it is the load: {this}; if not, say which column is, or leave it out: {none}"
    return [Fault(message, sheet.text.path, sheet.named_at, index + 1, advice=advice, choice=this)]

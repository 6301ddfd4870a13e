"""Logs of any LCR meter, as tables or as replies that name their values: `0,CP 1.23456E-06,D 0.12345,0`."""

from __future__ import annotations

import re

from calib.lab.instruments.family import InstrumentFamily, capacitance_log, needs_of_log
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.replies import NUMBER, TIME, reply_table, time_cell
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.text import LabText

# Status, named values, comparator; a time may stand before it.
_VALUE = rf"[A-Z]{{1,5}}[ \t]+{NUMBER}"
_NAMED = re.compile(
    rf"^\s*{TIME}(?P<status>\d+)\s*,\s*(?P<values>{_VALUE}(?:\s*,\s*{_VALUE}){{0,8}})\s*(?:,\s*[+-]?\d+)?\s*$", re.ASCII
)


def cut(text: LabText, _: Reading) -> Sheet | None:
    """Cut a log of replies into a sheet by the names in each line, in SI, as meters reply; None if the text is no such log."""
    return reply_table(text, _NAMED, _cells)


def _cells(match: re.Match[str]) -> dict[str, str]:
    values = dict(part.split() for part in match["values"].split(","))
    in_farad = {"CP": "CP (F)", "CS": "CS (F)"}
    return {**time_cell(match), "Status": match["status"], **{in_farad.get(n, n): v for n, v in values.items()}}


FAMILY = InstrumentFamily("LCR log", 40, capacitance_log, needs_of_log, verified=True, cut=cut)

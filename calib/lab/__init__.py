"""Lab files in, a `Sweep` for every press out, with what was judged of it; knows no prior and no model."""

from calib.lab.clocks import draw_once_turned
from calib.lab.evidence import SIGNED
from calib.lab.instruments import (
    AS_FOUND,
    QUANTITIES,
    LabTable,
    Reading,
    SeveralSpecimens,
    Unread,
    is_unit_of,
    no_such_quantity,
    read_lab_file,
)
from calib.lab.observations import Observations, observe, why_left_out
from calib.lab.onset import hertz_onset, level_before_contact
from calib.lab.pressing import make_sweep, read_press, readings_of
from calib.lab.quality import Grade, check_name, grade_rows, judge, number_text, quality_in_words
from calib.lab.repeated import SAME, as_one_piece, repeated_channels, rows_of, share_in_both, thinned_rows_of
from calib.lab.signs import SIGNS, SignDecision
from calib.lab.sweep import Points, Sweep, Track, sweeps_from_json, sweeps_to_json
from calib.lab.unloading import SHARES, Unloading, measure_unloading
from calib.lab.unused import nothing_used
from calib.lab.use import FIRST_LOADING, USE_KEYS, Use, same_part, use_in_words, use_value

__all__ = [
    "AS_FOUND",
    "FIRST_LOADING",
    "QUANTITIES",
    "SAME",
    "SHARES",
    "SIGNED",
    "SIGNS",
    "USE_KEYS",
    "Grade",
    "LabTable",
    "Observations",
    "Points",
    "Reading",
    "SeveralSpecimens",
    "SignDecision",
    "Sweep",
    "Track",
    "Unloading",
    "Unread",
    "Use",
    "as_one_piece",
    "check_name",
    "draw_once_turned",
    "grade_rows",
    "hertz_onset",
    "is_unit_of",
    "judge",
    "level_before_contact",
    "make_sweep",
    "measure_unloading",
    "no_such_quantity",
    "nothing_used",
    "number_text",
    "observe",
    "quality_in_words",
    "read_lab_file",
    "read_press",
    "readings_of",
    "repeated_channels",
    "rows_of",
    "same_part",
    "share_in_both",
    "sweeps_from_json",
    "sweeps_to_json",
    "thinned_rows_of",
    "use_in_words",
    "use_value",
    "why_left_out",
]

"""Results in, pages, figures, tables and summaries for people and programs out; computes no result."""

from calib.report.curve import check_in_words, curve_csv
from calib.report.page import AGAINST_PRIOR_WORDS, PRIOR_DRIVEN_WORDS, parameter_rows, verdict, write_report
from calib.report.picture import file_figure
from calib.report.section import revolved_picture, section_figure, write_figure, write_vtk
from calib.report.style import BLUE, GREEN, INK, LIGHT, ORANGE, SKY, VERMILION, styled_figure
from calib.report.summary import summary_csv, summary_json

__all__ = [
    "AGAINST_PRIOR_WORDS",
    "BLUE",
    "GREEN",
    "INK",
    "LIGHT",
    "ORANGE",
    "PRIOR_DRIVEN_WORDS",
    "SKY",
    "VERMILION",
    "check_in_words",
    "curve_csv",
    "file_figure",
    "parameter_rows",
    "revolved_picture",
    "section_figure",
    "styled_figure",
    "summary_csv",
    "summary_json",
    "verdict",
    "write_figure",
    "write_report",
    "write_vtk",
]

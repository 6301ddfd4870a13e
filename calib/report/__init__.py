"""Results in, pages, figures, tables and summaries for people and programs out; computes no result and knows no command.

The names below are loaded when they are asked for: a page does not wait for the finite elements, nor a figure for the page.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from calib.lazy import on_demand

if TYPE_CHECKING:
    from calib.report.batch import batch_page, batch_status, lot_status, risks_of_which
    from calib.report.browser import BROWSERS, PrintError, find_browser, print_page
    from calib.report.certificate import (
        CERTIFICATE_FORMAT,
        CERTIFICATE_KINDS,
        DAY_GATE,
        Certificate,
        Origin,
        certificate_json,
        certificate_number,
        certified_content,
        certified_models,
        certify,
        follows_from_itself,
        lines_to_add,
        missed_in,
        results_of,
    )
    from calib.report.crate import CrateFile, crate_json, files_of_commands
    from calib.report.curve import check_in_words, curve_csv
    from calib.report.dcc import dcc_gaps, dcc_xml, laboratory_gaps
    from calib.report.deformed.cross_section import cross_section_figure
    from calib.report.deformed.paraview import write_vtk
    from calib.report.deformed.revolved import revolved_figure, revolved_picture
    from calib.report.environment import template_text
    from calib.report.figures.batch import batch_figure
    from calib.report.figures.difference import difference_figure
    from calib.report.figures.lab_file import file_figure
    from calib.report.figures.padding import padding_figure
    from calib.report.figures.posterior import corner_figure, prior_figure, trace_figure
    from calib.report.figures.predictive import change_figure, channel_figure
    from calib.report.figures.proof import proof_figure
    from calib.report.figures.specification import conformity_figure, front_figure
    from calib.report.gripper import force_tables_from_json, gripper_files, range_in_words, reading_in_words
    from calib.report.moves import moves_in_words
    from calib.report.page import begin_drawing, kept_drawings, plots_of_report, report_page
    from calib.report.pictures import any_letters, write_figure
    from calib.report.rows import FirstRow, ParameterRow, first_rows, outlook_rows, pair_rows, parameter_rows
    from calib.report.sections.average import averaged_models, modulus_share, weighting_in_words
    from calib.report.sheet import certificate_page
    from calib.report.status import check_status_in_words, duration_in_words, status_in_words
    from calib.report.summary import summary_csv, summary_json
    from calib.report.unseen import taken_as_exact

__all__ = [
    "BROWSERS",
    "CERTIFICATE_FORMAT",
    "CERTIFICATE_KINDS",
    "DAY_GATE",
    "Certificate",
    "CrateFile",
    "FirstRow",
    "Origin",
    "ParameterRow",
    "PrintError",
    "any_letters",
    "averaged_models",
    "batch_figure",
    "batch_page",
    "batch_status",
    "begin_drawing",
    "certificate_json",
    "certificate_number",
    "certificate_page",
    "certified_content",
    "certified_models",
    "certify",
    "change_figure",
    "channel_figure",
    "check_in_words",
    "check_status_in_words",
    "conformity_figure",
    "corner_figure",
    "crate_json",
    "cross_section_figure",
    "curve_csv",
    "dcc_gaps",
    "dcc_xml",
    "difference_figure",
    "duration_in_words",
    "file_figure",
    "files_of_commands",
    "find_browser",
    "first_rows",
    "follows_from_itself",
    "force_tables_from_json",
    "front_figure",
    "gripper_files",
    "kept_drawings",
    "laboratory_gaps",
    "lines_to_add",
    "lot_status",
    "missed_in",
    "modulus_share",
    "moves_in_words",
    "outlook_rows",
    "padding_figure",
    "pair_rows",
    "parameter_rows",
    "plots_of_report",
    "print_page",
    "prior_figure",
    "proof_figure",
    "range_in_words",
    "reading_in_words",
    "report_page",
    "results_of",
    "revolved_figure",
    "revolved_picture",
    "risks_of_which",
    "status_in_words",
    "summary_csv",
    "summary_json",
    "taken_as_exact",
    "template_text",
    "trace_figure",
    "weighting_in_words",
    "write_figure",
    "write_vtk",
]

__getattr__ = on_demand(
    __name__,
    {
        ".batch": ("batch_page", "batch_status", "lot_status", "risks_of_which"),
        ".browser": ("BROWSERS", "PrintError", "find_browser", "print_page"),
        ".certificate": (
            "CERTIFICATE_FORMAT",
            "CERTIFICATE_KINDS",
            "DAY_GATE",
            "Certificate",
            "Origin",
            "certified_content",
            "certificate_json",
            "certificate_number",
            "certified_models",
            "certify",
            "follows_from_itself",
            "lines_to_add",
            "missed_in",
            "results_of",
        ),
        ".crate": ("CrateFile", "crate_json", "files_of_commands"),
        ".curve": ("check_in_words", "curve_csv"),
        ".dcc": ("dcc_gaps", "dcc_xml", "laboratory_gaps"),
        ".deformed.cross_section": ("cross_section_figure",),
        ".deformed.paraview": ("write_vtk",),
        ".deformed.revolved": ("revolved_figure", "revolved_picture"),
        ".environment": ("template_text",),
        ".figures.batch": ("batch_figure",),
        ".figures.difference": ("difference_figure",),
        ".figures.lab_file": ("file_figure",),
        ".figures.padding": ("padding_figure",),
        ".figures.posterior": ("corner_figure", "prior_figure", "trace_figure"),
        ".figures.predictive": ("change_figure", "channel_figure"),
        ".figures.proof": ("proof_figure",),
        ".figures.specification": ("conformity_figure", "front_figure"),
        ".gripper": ("force_tables_from_json", "gripper_files", "range_in_words", "reading_in_words"),
        ".moves": ("moves_in_words",),
        ".page": ("begin_drawing", "kept_drawings", "plots_of_report", "report_page"),
        ".pictures": ("any_letters", "write_figure"),
        ".rows": ("FirstRow", "ParameterRow", "first_rows", "outlook_rows", "pair_rows", "parameter_rows"),
        ".sections.average": ("averaged_models", "modulus_share", "weighting_in_words"),
        ".sheet": ("certificate_page",),
        ".status": ("check_status_in_words", "duration_in_words", "status_in_words"),
        ".summary": ("summary_csv", "summary_json"),
        ".unseen": ("taken_as_exact",),
    },
)


def __dir__() -> list[str]:
    return __all__

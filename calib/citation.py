"""A version of this program in, what to cite for results of it out: the program, and the paper of the sensor model."""

from __future__ import annotations

#: As `CITATION.cff` has them.
TITLE = "dielectric-elastomer-calibration: Bayesian calibration of dielectric-elastomer tactile sensors"
AUTHORS = "The dielectric-elastomer-calibration authors"
YEAR = 2026

#: The paper that the sensor model follows.
PAPER = (
    "Zhu, Tairych, Rosset, Anderson: An approach to validate the design and fabrication of dielectric elastomer tactile "
    "sensor. Electroactive Polymer Actuators and Devices (EAPAD) XXI, SPIE, 2019"
)


def citation(version: str) -> str:
    """The program as a line of a list of references.

    >>> citation("0.1.0").endswith("sensors. Version 0.1.0, 2026")
    True
    """
    return f"{AUTHORS}: {TITLE}. Version {version}, {YEAR}"


def bibtex(version: str) -> str:
    """The program and the paper as two entries of BibTeX.

    Parameters
    ----------
    version : of the program that the results are of.
    """
    return f"""@software{{dielectric_elastomer_calibration,
  author  = {{{{{AUTHORS}}}}},
  title   = {{{TITLE}}},
  version = {{{version}}},
  year    = {{{YEAR}}},
}}

@inproceedings{{zhu_2019_validate,
  author    = {{Zhu and Tairych and Rosset and Anderson}},
  title     = {{An approach to validate the design and fabrication of dielectric elastomer tactile sensor}},
  booktitle = {{Electroactive Polymer Actuators and Devices (EAPAD) XXI}},
  publisher = {{SPIE}},
  year      = {{2019}},
}}
"""

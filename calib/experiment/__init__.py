"""A TOML file (or Python) in, a checked `Experiment` out, its sweeps and the forward model it names; knows no likelihood."""

from calib.experiment.bench import PRESSES, READINGS, Bench, read_bench
from calib.experiment.counted_twice import Held, held_twice, readings_in, readings_of_sweeps
from calib.experiment.design import read_design
from calib.experiment.draft import experiment_text, quoted_text, specimen_text
from calib.experiment.edits import MARK, MEASURED, STANDS, Unedited, guess_at, unedited_in_words, unedited_lines
from calib.experiment.example_data import shipped
from calib.experiment.experiment_file import experiment_from, read_experiment
from calib.experiment.folder import listed, walk, written_by_calib
from calib.experiment.forward import forward_of_design, forward_of_experiment, require_use_of, surrogate_from
from calib.experiment.lab_files import Found, Looked, look_through
from calib.experiment.laboratory import Instrument, Laboratory, instrument_of, keys_of
from calib.experiment.lots import lot_prior, nominal_ratios, own_priors, spread_prior
from calib.experiment.of_others import files_of_others
from calib.experiment.pairing import pair
from calib.experiment.plan import Experiment, MaterialLaw, Specimen, SweepFiles
from calib.experiment.presses import Press, Pressed
from calib.experiment.record import experiment_from_json, experiment_to_json
from calib.experiment.said import Said, read_said, said_toml
from calib.experiment.schema import design_schema, experiment_schema, specification_schema
from calib.experiment.signposts import SWEEP_KEYS
from calib.experiment.specification import (
    LIMITED,
    CandidateMaterial,
    Limit,
    Limited,
    Side,
    Specification,
    Tolerance,
    limited_in_words,
    specification_from_plain,
)
from calib.experiment.specification_file import read_specification, specification_from
from calib.experiment.sweeps import compliance_said, read_sweeps
from calib.experiment.toml_file import LARGEST as LARGEST_TOML
from calib.experiment.toml_places import KeyPath, comments_in, locate_keys
from calib.experiment.variant_lines import line_of_variant
from calib.experiment.variants import (
    AS_GIVEN,
    Variant,
    beyond_simplest,
    candidates_of,
    kinds_of,
    model_in_words,
    possible_candidates,
    variants_of,
    without_discrepancy,
)
from calib.experiment.written import experiment_toml, prior_toml

__all__ = [
    "AS_GIVEN",
    "LARGEST_TOML",
    "LIMITED",
    "MARK",
    "MEASURED",
    "PRESSES",
    "READINGS",
    "STANDS",
    "SWEEP_KEYS",
    "Bench",
    "CandidateMaterial",
    "Experiment",
    "Found",
    "Held",
    "Instrument",
    "KeyPath",
    "Laboratory",
    "Limit",
    "Limited",
    "Looked",
    "MaterialLaw",
    "Press",
    "Pressed",
    "Said",
    "Side",
    "Specification",
    "Specimen",
    "SweepFiles",
    "Tolerance",
    "Unedited",
    "Variant",
    "beyond_simplest",
    "candidates_of",
    "comments_in",
    "compliance_said",
    "design_schema",
    "experiment_from",
    "experiment_from_json",
    "experiment_schema",
    "experiment_text",
    "experiment_to_json",
    "experiment_toml",
    "files_of_others",
    "forward_of_design",
    "forward_of_experiment",
    "guess_at",
    "held_twice",
    "instrument_of",
    "keys_of",
    "kinds_of",
    "limited_in_words",
    "line_of_variant",
    "listed",
    "locate_keys",
    "look_through",
    "lot_prior",
    "model_in_words",
    "nominal_ratios",
    "own_priors",
    "pair",
    "possible_candidates",
    "prior_toml",
    "quoted_text",
    "read_bench",
    "read_design",
    "read_experiment",
    "read_said",
    "read_specification",
    "read_sweeps",
    "readings_in",
    "readings_of_sweeps",
    "require_use_of",
    "said_toml",
    "shipped",
    "specification_from",
    "specification_from_plain",
    "specification_schema",
    "specimen_text",
    "spread_prior",
    "surrogate_from",
    "unedited_in_words",
    "unedited_lines",
    "variants_of",
    "walk",
    "without_discrepancy",
    "written_by_calib",
]

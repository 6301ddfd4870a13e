"""From a key that stands in the wrong table of an experiment file to advice on where it belongs."""

from __future__ import annotations

from collections.abc import Mapping

from calib.catalogue import UNKNOWNS, unknowns_of
from calib.experiment.toml_values import Signposts

#: Keys of a sweep, or of a specimen with one sweep (the short form).
SWEEP_KEYS = ("force", "capacitance", "indenter_radius", "use")

# Where a key belongs that stands in the wrong table.
_PLACES: Mapping[str, str] = {
    **dict.fromkeys(("model", "discrepancy", "candidates"), "at the top of the file, before the first [table]"),
    **dict.fromkeys(unknowns_of("material", "rig"), "in [priors], shared by all specimens"),
    **dict.fromkeys(unknowns_of("specimen", "sweep"), "in [specimens.priors], below its [[specimens]]"),
    **dict.fromkeys(("force", "capacitance", "sweeps"), "in [[specimens]]"),
    **dict.fromkeys(("cycle", "cycles"), "beside the files of the sweep, as use = { cycles = [2] }"),
    "max_force": 'beside the files of the sweep, as use = { max_force = "5 N" }',
    "max_depth": 'beside the files of the sweep, as use = { max_depth = "0.8 mm" }',
    "branch": 'beside the files of the sweep, as use = { branch = "unloading" }',
    "use": "in [[specimens]] or [[specimens.sweeps]], beside the files of the sweep",
    **dict.fromkeys(("operator", "email", "city", "country", "customer", "measured"), "in [laboratory]"),
    **dict.fromkeys(("kind", "maker", "serial", "calibrated"), "in [[instruments]], one for each instrument"),
    "material": "in [padding]",
    "law": 'in [sensor], as law = "gent"',
    "friction_coefficient": 'in [indenter], as friction_coefficient = "stick", or among the priors',
    "base": 'at the top of the file, as base = "slippery"',
    "sensor_radius": 'in [sensor], as radius = "10 mm"',
    "indenter_radius": 'in [indenter], as radius = "5 mm"',
    "radius": "in [indenter] (of the ball) or [sensor] (of the disc)",
}

_GIVE = "Give {} = {} in [specimens.priors] of each specimen"

# Keys that are right elsewhere or under another name, by table.
_HINTS: Mapping[tuple[str, str], str] = {
    ("[indenter]", "diameter"): "Give the radius",
    ("[sensor]", "diameter"): "Give the radius",
    ("[sensor]", "thickness"): _GIVE.format("sensor_thickness", UNKNOWNS["sensor_thickness"].example),
    ("[padding]", "thickness"): _GIVE.format("padding_thickness", UNKNOWNS["padding_thickness"].example),
    ("[padding]", "young_modulus"): 'Write material = "own" and give padding_young_modulus in [priors]',
    ("[[specimens.sweeps]]", "priors"): "Give them in [specimens.priors], where they hold for every sweep of the specimen",
}
#: Of an experiment file.
SIGNPOSTS = Signposts(_PLACES, _HINTS)

"""What is to be calibrated: an experiment, its specimens, and the lab files of their sweeps, as frozen values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from calib.experiment.edits import Unedited
from calib.experiment.laboratory import Instrument, Laboratory
from calib.files import real_path
from calib.lab import AS_FOUND, FIRST_LOADING, Reading, Use, same_part
from calib.priors import Prior
from models.sensor import Base
from models.surrogate import Family, family_of

Model = Literal["surrogate", "fem", "closed form"]
Discrepancy = Literal["off", "on"]
PaddingMaterial = Literal["sensor", "own", "foam"]
MaterialLaw = Literal["neo-hookean", "gent"]
Pooling = Literal["complete", "partial"]


@dataclass(frozen=True)
class SweepFiles:
    """The lab files of one press of a ball into a specimen; one of the two may be missing.

    Attributes
    ----------
    name : "" for the only sweep of a specimen in the short form.
    force, capacitance : absolute paths; both may be the same file.
    indenter_radius : [m].
    force_reading, capacitance_reading : what the user says of each file: units, columns, which specimen in it.
    use : which part of the press is used, in both files.
    """

    name: str
    force: Path | None
    capacitance: Path | None
    indenter_radius: float
    force_reading: Reading = AS_FOUND
    capacitance_reading: Reading = AS_FOUND
    use: Use = FIRST_LOADING

    def shares_press_with(self, other: SweepFiles) -> bool:
        """Whether both sweeps hold the same readings: one press would be counted twice."""
        return self.shares_record_with(other) and same_part(self.use, other.use)

    def shares_record_with(self, other: SweepFiles) -> bool:
        """Whether both sweeps are of one record, if of other presses in it."""
        mine = self._counted
        return mine is not None and mine == other._counted

    @property
    def _counted(self) -> tuple[Path, int | None, str, frozenset[tuple[str, str]], frozenset[tuple[str, str]]] | None:
        """The record that is counted: the file, and what chooses one of several records in it."""
        path, how = (self.force, self.force_reading) if self.force is not None else (self.capacitance, self.capacitance_reading)
        if path is None:
            return None
        return real_path(path), how.specimen, how.sheet, frozenset(how.where.items()), frozenset(how.columns.items())


@dataclass(frozen=True)
class Specimen:
    """One sensor on its padding: its sweeps, and the priors that hold for it alone, by the name of the unknown.

    `nominal` has the thicknesses [m] that were wanted of it, by name, where specimens of a lot were not meant to be alike.
    """

    name: str
    sweeps: tuple[SweepFiles, ...]
    priors: Mapping[str, Prior]
    nominal: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Experiment:
    """What is to be calibrated: the specimens with their lab files, the rig, the priors and the model, as checked from a file.

    What the experiment does not name is not in it; defaults come from `calib.catalogue` when the problem is built.
    `read_experiment` makes one from a TOML file, `experiment_from` from the same tables in Python::

        experiment_from(
            {
                "indenter": {"radius": "5 mm"},
                "sensor": {"radius": "10 mm"},
                "specimens": [{"name": "sensor 1", "force": "sensor1_instron.csv", "priors": {...}}],
            }
        )

    Attributes
    ----------
    name : for headings.
    path : absolute path of the file, None for one built in Python.
    sha256 : hash of its content.
    indenter_radius, sensor_radius : [m], of the ball and of the sensor's disc.
    padding_material : "sensor" for the sensor's silicone (one modulus), "own" for a modulus of its own, "foam" for a modulus
        and a Poisson's ratio of its own.
    priors : shared by all specimens, by the name of the unknown; under partial pooling also of the lot's thicknesses.
    specimens : the sensors measured, each with its sweeps and the priors that hold for it alone.
    model : the forward model to calibrate with.
    discrepancy : whether the residuals of a sweep are modelled as correlated.
    law : of sensor and padding; Gent's has an unknown of its own, `stiffening`.
    stick : whether the sensor sticks to the ball, or slides on it: without friction, or with one that is an unknown.
    base : what the padding rests on, glued or free to slide.
    candidates : names of the models that `calib compare` calibrates beside this one; empty for all that there are.
    pooling : "complete" if all specimens are of one material; "partial" if they are of one lot, each with a modulus, a
        permittivity and thicknesses of its own that lie about the lot's.
    unedited : lines of the file that still hold a guess of its draft, see `calib.experiment.edits`.
    laboratory : who measured, for a certificate.
    instruments : what was measured with, likewise.
    """

    name: str
    path: Path | None
    sha256: str
    indenter_radius: float
    sensor_radius: float
    padding_material: PaddingMaterial
    priors: Mapping[str, Prior]
    specimens: tuple[Specimen, ...]
    model: Model = "surrogate"
    discrepancy: Discrepancy = "on"
    law: MaterialLaw = "neo-hookean"
    stick: bool = False
    base: Base = "bonded"
    candidates: tuple[str, ...] = ()
    pooling: Pooling = "complete"
    unedited: tuple[Unedited, ...] = ()
    laboratory: Laboratory = field(default_factory=Laboratory)
    instruments: tuple[Instrument, ...] = ()

    @property
    def file_name(self) -> str:
        """Name of the file that the experiment was read from, for lists of inputs."""
        return "experiment built in Python" if self.path is None else self.path.name

    @property
    def family(self) -> Family | None:
        """The family of surrogates that has this base, law, friction and padding; None if there is none."""
        has = {
            "stiffening": self.law == "gent",
            "friction_coefficient": self.rubs or self.stick,
            "padding_poisson_ratio": self.padding_material == "foam",
            "base_friction_coefficient": self.base_rubs,
        }
        return family_of({name for name, there in has.items() if there}, base=self.base)

    @property
    def rubs(self) -> bool:
        """Whether the ball slides on the sensor with a friction that is given, or an unknown."""
        return "friction_coefficient" in self.priors

    @property
    def base_rubs(self) -> bool:
        """Whether the padding slides on its base with a friction that is given, or an unknown."""
        return "base_friction_coefficient" in self.priors

    @property
    def friction_coefficient(self) -> float:
        """Friction [1] between ball and sensor where it is no unknown: infinite where they stick, else 0."""
        return math.inf if self.stick else 0.0

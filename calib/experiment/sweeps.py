"""From an experiment to its sweeps: its lab files read and prepared for the likelihood, all their faults at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypedDict

import numpy as np

from calib.catalogue import CHANNELS
from calib.errors import Fault, InputError
from calib.experiment.plan import Experiment, SweepFiles
from calib.lab import Sweep, make_sweep
from calib.priors import Prior, default_prior

# Share of a prior that is looked at when a file is judged before there is a posterior.
_CERTAIN = 0.99


class ComplianceSaid(TypedDict, total=False):
    """How far a machine may give [m/N]: at most, as a prior says it; or as is believed where none is given."""

    machine_compliance: float
    believed_compliance: float


def read_sweeps(experiment: Experiment) -> tuple[Sweep, ...]:
    """Read every lab file that an experiment names and prepare each press for the likelihood.

    Two priors matter already when the files are judged: that of the clock offset says how far apart the clocks may be, that of
    the machine's compliance how far the machine may give (`compliance_said`).

    Returns
    -------
    The sweeps, specimen by specimen in the order of the experiment.

    Raises
    ------
    InputError
        With the faults of all files.
    """
    sweeps: list[Sweep] = []
    faults: list[Fault] = []
    compliance = compliance_said(experiment.priors)
    for specimen in experiment.specimens:
        clock = specimen.priors.get("clock_offset")
        for files in specimen.sweeps:
            try:
                sweep = make_sweep(
                    specimen.name,
                    files.name,
                    files.indenter_radius,
                    files.force,
                    files.capacitance,
                    force_reading=files.force_reading,
                    capacitance_reading=files.capacitance_reading,
                    use=files.use,
                    clock_range=None if clock is None else clock.interval(_CERTAIN),
                    **compliance,
                )
            except InputError as error:
                faults += error.faults
                continue
            sweeps.append(sweep)
            faults += _dead_channels(sweep, files)
    if faults:
        raise InputError(faults)
    return tuple(sweeps)


def _dead_channels(sweep: Sweep, files: SweepFiles) -> list[Fault]:
    """A fault for each channel that reads the same throughout: nothing was measured, and noise of zero would be believed."""
    faults = []
    for name, points in sweep.channels.items():
        if points.value.size and np.ptp(points.value) == 0:
            path = files.capacitance if name == "capacitance" and files.capacitance is not None else files.force
            reading = f"{points.value[0]:g} {CHANNELS[name].unit}"
            advice = "Look whether it was connected and logged, and leave the file out if it was not"
            faults.append(Fault(f"{name} reads {reading} in every row that is used", path, advice=advice))
    return faults


def compliance_said(priors: Mapping[str, Prior]) -> ComplianceSaid:
    """What lab files are judged by of the machine's compliance, for `calib.lab.judge` and `calib.lab.make_sweep`.

    Parameters
    ----------
    priors : of material and rig that are given.
    """
    given = priors.get("machine_compliance")
    if given is not None:
        return {"machine_compliance": given.interval(_CERTAIN)[1]}
    return {"believed_compliance": default_prior("machine_compliance").interval(_CERTAIN)[1]}

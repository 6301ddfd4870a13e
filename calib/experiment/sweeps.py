"""From an experiment to its sweeps: its lab files read and prepared for the likelihood, all their faults at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypedDict

from calib.errors import Fault, InputError
from calib.experiment.plan import Experiment
from calib.lab import Reading, Sweep, Use, make_sweep, read_press
from calib.priors import Prior, default_prior

# Share of a prior that is looked at when a file is judged before there is a posterior.
_CERTAIN = 0.99


class _Said(TypedDict):
    """What the user says of the files of a press."""

    force_reading: Reading
    capacitance_reading: Reading
    use: Use


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
        With the faults of all files; once one is found, with those of the others that reading them tells.
    """
    sweeps: list[Sweep] = []
    faults: list[Fault] = []
    compliance = compliance_said(experiment.priors)
    for specimen in experiment.specimens:
        clock = specimen.priors.get("clock_offset")
        for files in specimen.sweeps:
            said: _Said = {
                "force_reading": files.force_reading,
                "capacitance_reading": files.capacitance_reading,
                "use": files.use,
            }
            try:
                if faults:  # refused anyway: the others are read, and not worked on
                    read_press(files.force, files.capacitance, **said)
                    continue
                sweep = make_sweep(
                    specimen.name,
                    files.name,
                    files.indenter_radius,
                    files.force,
                    files.capacitance,
                    clock_range=None if clock is None else clock.interval(_CERTAIN),
                    **said,
                    **compliance,
                )
            except InputError as error:
                faults += error.faults
                continue
            sweeps.append(sweep)
    if faults:
        raise InputError(faults)
    return tuple(sweeps)


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

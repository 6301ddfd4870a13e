"""From an experiment to its sweeps: its lab files read and prepared for the likelihood, all their faults at once."""

from __future__ import annotations

from calib.errors import Fault, InputError
from calib.experiment.plan import Experiment
from calib.lab import Sweep, make_sweep
from calib.priors import default_prior

# Share of a prior that is looked at when a file is judged before there is a posterior.
_CERTAIN = 0.99


def read_sweeps(experiment: Experiment) -> tuple[Sweep, ...]:
    """Read every lab file that an experiment names and prepare each press for the likelihood.

    Two priors matter already when the files are judged: that of the clock offset says how far apart the clocks may be, that of
    the machine's compliance how far the machine may give.

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
    compliance = experiment.priors.get("machine_compliance", default_prior("machine_compliance"))
    for specimen in experiment.specimens:
        clock = specimen.priors.get("clock_offset")
        for files in specimen.sweeps:
            try:
                sweeps.append(
                    make_sweep(
                        specimen.name,
                        files.name,
                        files.indenter_radius,
                        files.force,
                        files.capacitance,
                        force_reading=files.force_reading,
                        capacitance_reading=files.capacitance_reading,
                        use=files.use,
                        clock_range=None if clock is None else clock.interval(_CERTAIN),
                        machine_compliance=compliance.interval(_CERTAIN)[1],
                    )
                )
            except InputError as error:
                faults += error.faults
    if faults:
        raise InputError(faults)
    return tuple(sweeps)

"""A posterior in, what the lab files of its sweeps say of unloading, out: read again, if they are what they were."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from calib.decision import Retreats
from calib.errors import InputError
from calib.experiment import SweepFiles
from calib.files import sha256_of
from calib.lab import Sweep, Unloading, measure_unloading
from calib.problem import lookup
from calib.sampling import Posterior
from models.sensor import FloatArray


def retreats_of(posterior: Posterior) -> Retreats:
    """Compare the branches of every press of a calibration, by its lab files.

    Parameters
    ----------
    posterior : of the calibration, whose clock offsets tie the files.

    Returns
    -------
    Of each specimen with capacitance, for each of its sweeps, the comparison or why there is none.
    """
    summary = posterior.diagnostics.parameters
    middle = {name: np.array([row.median, row.sd]) for name, row in summary.items()}
    middle |= {name: np.array([value, 0.0]) for name, value in posterior.fixed.items()}
    files = {(s.name, f.name): f for s in posterior.experiment.specimens for f in s.sweeps}
    found: dict[str, list[Unloading | str]] = {}
    for sweep in posterior.sweeps:
        if "capacitance" in sweep.channels:
            one = _of_sweep(sweep, files.get((sweep.specimen, sweep.name)), middle)
            found.setdefault(sweep.specimen, []).append(one)
    return found


def _of_sweep(sweep: Sweep, files: SweepFiles | None, middle: Mapping[str, FloatArray]) -> Unloading | str:
    if files is None or not sweep.files:
        return "its lab files are not named"
    known = dict(sweep.files)
    for path in dict.fromkeys(path for path in (files.force, files.capacitance) if path is not None):
        try:
            changed = sha256_of(path) != known.get(path.name)
        except FileNotFoundError:
            return f"{path.name} is no longer where it was at the calibration"
        except OSError as error:
            return f"{path.name} cannot be read ({error.strerror})"
        if changed:
            return f"{path.name} is no longer what it was at the calibration"
    offset = lookup(middle, "clock_offset", sweep.specimen, sweep.name)
    tied = sweep.tied_by("capacitance") == "clock"
    clock = (sweep.clock_offset, sweep.clock_offset_sd) if offset is None else (float(offset[0]), float(offset[1]))
    try:
        return measure_unloading(
            files.force,
            files.capacitance,
            force_reading=files.force_reading,
            capacitance_reading=files.capacitance_reading,
            use=files.use,
            clock_offset=clock if tied else None,
        )
    except InputError as error:
        return f"its lab files cannot be read ({error.faults[0].message})"

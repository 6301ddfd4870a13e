"""The experiment of a folder in, what `calib check` says of it out; computed once for what the files hold, one at a time."""

from __future__ import annotations

import hashlib
import threading

from calib.errors import InputError
from calib.experiment import Experiment, read_experiment
from calib.runs import Check
from calib.runs import check as run_check
from calib.serve.looking import Kept
from calib.serve.workspace import Workspace

_ONE = threading.Lock()
_CHECKED = Kept(8)


def check_of(space: Workspace) -> Check:
    """Check the experiment of a folder, or remember what was found if nothing has changed since.

    Parameters
    ----------
    space : the folder.

    Raises
    ------
    InputError
        With everything that is wrong with the input.
    """

    def made() -> Check | tuple[InputError]:
        try:
            return run_check(space.experiment)
        except InputError as error:
            return (error,)

    with _ONE:  # read in here, so that who has waited gets what the file holds now, and not what it held then
        found = _CHECKED.get(_state(read_experiment(space.experiment)), made)
    if isinstance(found, tuple):
        raise found[0]
    return found


def _state(plan: Experiment) -> str:
    """A mark of all that a check depends on."""
    files = [
        path for specimen in plan.specimens for sweep in specimen.sweeps for path in (sweep.force, sweep.capacitance) if path
    ]
    stats = [(str(path), path.stat().st_mtime_ns, path.stat().st_size) for path in files]
    return hashlib.sha256(repr((plan.path, plan.sha256, stats)).encode()).hexdigest()

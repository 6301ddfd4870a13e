"""Run folders of the same data in, a run folder with the average over their models out."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from calib.checks import USUAL, AverageMember, ComparedModel, Weighting, average_models, compare_runs
from calib.decision import Recommendation
from calib.errors import Fault, InputError
from calib.files import real_path, require_folder
from calib.runs.folder import Run, changed_inputs, load_run
from calib.runs.listing import EXPERIMENT, LISTING, MEMBERS, POSTERIOR, RESULTS, Input, Listing, read_listing, seen_from
from calib.runs.members import forward_of, member_file
from calib.runs.ownership import is_bare, owned
from calib.runs.page import PageError, page_of
from calib.runs.written import write_run
from calib.sampling import FINGERPRINT

#: Name of the folder of the average in that of a comparison.
AVERAGE = "average"

_WHAT = "calib average"


def average_runs(
    runs: Sequence[Run],
    folder: Path | str,
    *,
    by: Weighting = USUAL,
    candidates: Sequence[ComparedModel] | None = None,
    anew: bool = False,
    command: str = "",
    page: Callable[[Run, Recommendation | None], str] = page_of,
) -> tuple[Run, PageError | None]:
    """Average runs of the same data under different models, and write the average into a run folder like any other.

    The folder keeps the posterior of each model, so that it needs the runs no more.

    Parameters
    ----------
    runs : the experiment's own model first.
    folder : of the average; must be empty or not exist yet.
    by : what the models are weighted by, see docs/averaging.md.
    candidates : the same runs compared, by the names of their folders, if that was done.
    anew : whether an average that is there already makes room, unless it is the same.
    command : the command line, kept with the average.
    page : lays out the report.

    Returns
    -------
    The average, and why it has no page, if that could not be made.

    Raises
    ------
    InputError
        If the runs are not of the same data, are averages themselves, or the folder is not free.
    """
    folder = Path(folder)
    names = _names(runs)
    for run in runs:
        if run.members:
            raise InputError(Fault("this run is an average itself", run.folder, advice="Give the runs that it is of"))
    _check_folder(folder, anew)
    runs = [_beside(run, runs) for run in runs]
    models = [
        AverageMember(name, run.posterior, run.forward, run.verdict, run.posterior_sha256)
        for name, run in zip(names, runs, strict=True)
    ]
    if candidates is None:
        candidates = compare_runs([(m.name, m.posterior, m.forward) for m in models])
    posterior, members = average_models(models, candidates, by)
    identity = {f"posterior of {m.name}": m.sha256 for m in models} | {"weighted by": posterior.attrs["averaged by"]}
    fingerprint = hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()
    posterior = replace(posterior, attrs={**posterior.attrs, "command": command, FINGERPRINT: fingerprint})
    inputs = [entry for name, run in zip(names, runs, strict=True) for entry in _inputs(folder, name, run)]
    listing = Listing(
        posterior.seed, {"command": command}, identity, fingerprint, tuple(dict.fromkeys(inputs)), {}, command or _WHAT
    )
    if anew and _is_there(folder, fingerprint):
        return load_run(folder), None
    copies = {member_file(name): run.folder / POSTERIOR for name, run in zip(names, runs, strict=True)}
    with owned(folder, command or _WHAT):
        if anew:
            _make_room(folder)
        forward = forward_of(posterior)
        return write_run(folder, posterior, forward, listing, command or _WHAT, page, members=members, copies=copies)


def _names(runs: Sequence[Run]) -> list[str]:
    """A name for each run: of its folder, and with that of the folder above where two are alike."""
    if len({real_path(run.folder) for run in runs}) < max(len(runs), 2):
        raise InputError(Fault("give at least two runs to average, each once"))
    seen: dict[str, Run] = {}
    for run in runs:
        if (other := seen.setdefault(run.posterior_sha256, run)) is not run:
            message = f"this run is a copy of {other.folder}, which would count twice"
            raise InputError(Fault(message, run.folder, advice="Give each model once"))
    paths = [real_path(run.folder) for run in runs]
    plain = [path.name for path in paths]
    return [f"{p.parent.name}-{p.name}" if plain.count(p.name) > 1 else p.name for p in paths]


def _beside(run: Run, runs: Sequence[Run]) -> Run:
    """A run with what has changed since, but for an experiment file that was edited for another one of the average."""
    listing = read_listing(run.folder) if run.changed_inputs else None
    if listing is None:
        return run
    return replace(run, changed_inputs=changed_inputs(run.folder, listing, {r.posterior.experiment.sha256 for r in runs}))


def _inputs(folder: Path, name: str, run: Run) -> list[Input]:
    """What an average is made from: a run, and the files that this was made from."""
    path = (run.folder / POSTERIOR).absolute()
    listing = read_listing(run.folder)
    of_run = () if listing is None else listing.inputs
    kept = run.folder / EXPERIMENT
    below = []
    for entry in of_run:
        if entry.what == "experiment" and kept.is_file():
            below.append(replace(entry, file=str(kept.absolute()), from_run=seen_from(folder, kept)))
        else:
            below.append(replace(entry, from_run=seen_from(folder, run.folder / entry.from_run)))
    return [Input(f"posterior of {name}", str(path), seen_from(folder, path), run.posterior_sha256), *below]


def _check_folder(folder: Path, anew: bool) -> None:
    if not folder.exists():
        require_folder(folder, "Create it first")
    elif not folder.is_dir():
        raise InputError(Fault("a file of this name exists and is not overwritten", folder, advice="Choose another -o"))
    elif not is_bare(folder) and not (anew and (folder / MEMBERS).is_dir()):
        message = "this folder is not empty: the output folder exists and is not overwritten"
        raise InputError(Fault(message, folder, advice="Choose another -o"))


def _is_there(folder: Path, fingerprint: str) -> bool:
    """Whether a folder holds an average of this fingerprint, whole."""
    try:
        listing = read_listing(folder)
        return listing is not None and listing.fingerprint == fingerprint and bool(load_run(folder).members)
    except InputError:
        return False


def _make_room(folder: Path) -> None:
    """Remove an earlier average; what says that it is one goes last."""
    for name in RESULTS:
        (folder / name).unlink(missing_ok=True)
    shutil.rmtree(folder / MEMBERS, ignore_errors=True)
    (folder / LISTING).unlink(missing_ok=True)

"""An experiment file in, a folder with the proof of its calibrations out, made one by one: stopped, it can be gone on with."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

from calib.checks import Proof, Replicate, ReplicateSetting, attempt, presses_of, replicate_from_plain, replicate_to_plain
from calib.errors import Fault, InputError
from calib.experiment import read_experiment
from calib.files import require_folder, write_text
from calib.problem import Problem
from calib.records import record_to_text
from calib.runs.arrivals import keep_as_they_come
from calib.runs.before import seconds_of_evaluation
from calib.runs.folder import load_run
from calib.runs.ownership import owned
from calib.runs.preview import problem_of
from calib.sampling import FINGERPRINT, differences, identity_of
from models.sensor import FloatArray

#: Names of the files of a proof: its replicates as they come, what they say, and its picture.
REPLICATES, PROOF, PICTURE = "replicates.jsonl", "proof.json", "proof.png"

#: Raise it with every change that makes replicates others: the simulated lab, or what a calibration has to reach.
PROOF_VERSION = 9

# What a replicate takes [s of a processor]: finite elements of a sweep, the rest, and so many evaluations of the posterior.
_PRESS, _REST = 1.5, 4.0
_EVALUATIONS = 10_000
# Draws of a posterior that are sent to the workers, about.
_DRAWS = 2000


def prove(
    experiment: Path,
    folder: Path,
    executor: Executor,
    *,
    replicates: int,
    seed: int,
    surrogate: Path | None = None,
    chains: bool = False,
    around: Path | None = None,
    planned: Callable[[int, float], None] = lambda *_: None,
    progress: Callable[[int, int], None] = lambda *_: None,
    replicate: Callable[[ReplicateSetting, int], Replicate] = attempt,
) -> Proof:
    """Find out by simulation whether calibrations of an experiment hold the truth as often as they say.

    Each replicate draws a truth from the priors, simulates by finite elements the files that the lab would have written, reads
    and calibrates them, and ranks the truth (simulation-based calibration: Talts et al., arXiv 1804.06788).

    Parameters
    ----------
    experiment : file, see `calib.experiment.read_experiment`.
    folder : for the proof; one of the same experiment and seed in it is gone on with.
    executor : any of `concurrent.futures`: processes, or a Dask cluster's `Client.get_executor()`.
    replicates : how many there are to be, with those that are kept.
    seed : of all of them.
    surrogate : file of a surrogate to use instead of the shipped one; its path must hold for the workers, too.
    chains : whether to sample every calibration by chains, which takes ten times as long.
    around : folder of a run of the same experiment, whose posterior truths are drawn from; None for the prior.
    planned : told how many replicates are to be made, and the seconds of a processor that each may take, before any is.
    progress : called with the replicates done and their number.
    replicate : what is done for a replicate; the executor must be able to send it.

    Returns
    -------
    The proof, also written into the folder with its picture.

    Raises
    ------
    InputError
        If an input cannot be used, or the folder holds a proof of something else.
    """
    plan = read_experiment(experiment)
    if plan.model == "fem":
        advice = 'Leave the line model = "fem" out: what is proved is the calibration with the surrogate'
        raise InputError(Fault("a proof with the finite elements would take weeks", plan.path, advice=advice))
    problem = problem_of(plan, surrogate)
    file = None if surrogate is None else surrogate.absolute()
    draws = None if around is None else _draws_of(around, problem)
    setting = ReplicateSetting(plan, problem.sweeps, presses_of(plan, problem.sweeps), file, seed, chains, draws)
    drawn = "the prior" if draws is None else f"a posterior, {hashlib.sha256(draws.tobytes()).hexdigest()}"
    own = {"version of the proof": str(PROOF_VERSION), "chains": str(chains), "truths are drawn from": drawn}
    parts = {**own, **identity_of(problem, seed).parts}
    require_folder(folder, "Create it first")
    if folder.exists() and not folder.is_dir():
        raise InputError(Fault("a file of this name exists and is not overwritten", folder, advice="Choose another -o"))
    with owned(folder, "calib prove"):
        made = _begun(folder, parts)
        missing = [number for number in range(replicates) if number not in made]
        planned(len(missing), _expected(problem, made))
        progress(replicates - len(missing), replicates)
        if missing:
            futures = {executor.submit(replicate, setting, number): number for number in missing}
            keep_as_they_come(futures, folder / REPLICATES, _line, made, lambda n: progress(n, replicates))
        proof = Proof(tuple(made[number] for number in range(replicates)))
        _write(folder, proof, setting, parts)
    return proof


def _draws_of(folder: Path, problem: Problem) -> FloatArray:
    """Draws of the posterior of a run of the same problem, (n_draw, n_unknown), SI.

    Raises
    ------
    InputError
        If the run is of another problem.
    """
    posterior = load_run(folder).posterior
    if posterior.attrs.get(FINGERPRINT) != identity_of(problem, posterior.seed).fingerprint:
        advice = "Calibrate this experiment anew, or prove it from the prior, without --around"
        raise InputError(Fault("this run is of another experiment, or of another version of it", folder, advice=advice))
    draws = posterior.draws.reshape(-1, len(posterior.parameters))
    return draws[:: max(1, len(draws) // _DRAWS)]


def _line(_: int, one: Replicate) -> str:
    return json.dumps(replicate_to_plain(one)) + "\n"


def _begun(folder: Path, parts: Mapping[str, str]) -> dict[int, Replicate]:
    """The replicates that a folder holds; a new folder is begun. A line that was not finished is left out, and made again."""
    path = folder / REPLICATES
    if not path.exists():
        if others := [p.name for p in folder.iterdir() if not p.name.startswith(".")]:
            message = f"this folder holds other files ({', '.join(sorted(others)[:3])}), and a proof wants one of its own"
            raise InputError(Fault(message, folder, advice="Choose another -o"))
        write_text(path, json.dumps({"identity": dict(parts)}) + "\n")
        return {}
    head, *rows = path.read_text(encoding="utf-8").splitlines(keepends=True) or [""]
    try:
        known: dict[str, str] = json.loads(head)["identity"]
        whole = [json.loads(row) for row in rows if row.endswith("\n")]
        made = [replicate_from_plain(row) for row in whole]
    except (ValueError, KeyError, TypeError) as error:
        advice = "Remove the folder, or choose another -o"
        raise InputError(Fault(f"the replicates in it cannot be read ({error})", path, advice=advice)) from None
    if known != dict(parts):
        said = differences(known, parts) or "it was made by another version"
        advice = "Put the inputs back to go on with that proof, or choose another -o"
        raise InputError(Fault(f"the proof in this folder is another: {said}", folder, advice=advice))
    if rows and not rows[-1].endswith("\n"):
        write_text(path, "".join([head, *rows[:-1]]))
    return {one.number: one for one in made}


def _expected(problem: Problem, made: Mapping[int, Replicate]) -> float:
    """What a replicate may take of a processor [s]: as those that are there did, else by the time of an evaluation."""
    if made:
        return float(np.mean([one.seconds for one in made.values()]))
    return _EVALUATIONS * seconds_of_evaluation(problem) + _PRESS * len(problem.sweeps) + _REST


def _write(folder: Path, proof: Proof, setting: ReplicateSetting, parts: Mapping[str, str]) -> None:
    from calib.report import proof_figure, write_figure

    content: dict[str, Any] = {"experiment": setting.experiment.name, "seed": setting.seed, **proof.to_plain()}
    content["identity"] = dict(parts)
    write_text(folder / PROOF, record_to_text("proof", 1, content))
    if proof.counted:
        write_figure(proof_figure(proof), folder / PICTURE)

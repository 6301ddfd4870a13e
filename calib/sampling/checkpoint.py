"""Checkpoints of a sampling run: starts and blocks of each ensemble to files written atomically, and back.

A folder holds `manifest.json` (what the run is of), and for each ensemble `ensemble-0-start.npz` and one
`ensemble-0-00000.npz` per block. A file is there whole or not at all (`calib.files.whole_file`).
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import numpy as np

from calib.errors import Fault, InputError
from calib.files import remove_leftovers, whole_file, write_text
from calib.lab import sweeps_to_json
from calib.problem import LIKELIHOOD_VERSION, Problem
from calib.records import record_from_text, record_to_text
from calib.sampling.ensemble import MOVES, STORE_EVERY, Block, EnsembleState
from models.sensor import FloatArray

_KIND = "checkpoint"
_FORMAT = 2

# What the padding lies on. Only one kind of base is modelled so far; another must not continue a chain of this one.
_BASE = "bonded"


def fingerprint(problem: Problem, seed: int, n_ensemble: int, n_walker: int) -> str:
    """Hash all that the draws of a chain depend on, so that a chain is never continued as that of another posterior.

    That is the data, the unknowns with their priors, what is known of the specimens and the rig, the forward model by its
    content, the likelihood's version, seed, ensembles and moves, and the version of emcee, whose code the moves are. Not where
    files lie, and not the version of this package, in whose place the versions of likelihood, moves and format stand.

    Parameters
    ----------
    problem : what is sampled.
    seed : of the whole run.
    n_ensemble, n_walker : how many ensembles, and how many walkers in each.

    Returns
    -------
    64 hexadecimal digits.
    """
    e = problem.experiment
    content = {
        "format": _FORMAT,
        "parameters": [[p.name, p.prior.to_json()] for p in problem.parameters],
        "fixed": dict(problem.fixed),
        "radius": e.sensor_radius,
        "padding": e.padding_material,
        "law": e.law,
        "contact": "stick" if e.stick else "frictionless",
        "base": _BASE,
        "discrepancy": e.discrepancy,
        "sweeps": sweeps_to_json(problem.sweeps),
        "forward": [problem.forward.name, problem.forward.identity],
        "likelihood": LIKELIHOOD_VERSION,
        "emcee": version("emcee"),
        "run": [seed, n_ensemble, n_walker, MOVES, STORE_EVERY],
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def open_checkpoint(folder: Path, mark: str, *, resume: bool) -> None:
    """Make a folder ready for the checkpoints of a run: check that it is the same run to resume, or empty the folder.

    Parameters
    ----------
    folder : made if need be.
    mark : the run's `fingerprint`.
    resume : whether to go on from the checkpoints that are there.

    Raises
    ------
    InputError
        If a run is to be resumed whose fingerprint is another.
    """
    folder.mkdir(parents=True, exist_ok=True)
    manifest = folder / "manifest.json"
    if resume and manifest.exists():
        try:
            found = record_from_text(_KIND, _FORMAT, manifest.read_text(encoding="utf-8")).get("fingerprint")
        except ValueError:
            found = None
        if found != mark:
            raise InputError(
                Fault(
                    "the checkpoint is of another run: experiment, data, forward model or seed have changed since",
                    manifest,
                    advice="Start anew without resuming, or put the inputs back",
                )
            )
        remove_leftovers(folder)
        return
    for old in [*folder.glob("ensemble-*.npz"), *folder.glob("manifest.json")]:
        old.unlink()
    remove_leftovers(folder)
    write_text(manifest, record_to_text(_KIND, _FORMAT, {"fingerprint": mark}))


def save_start(folder: Path, ensemble: int, state: EnsembleState) -> None:
    """Write the start of an ensemble into the folder of a run.

    Parameters
    ----------
    folder : of the run's checkpoints.
    ensemble : its number, from 0.
    state : its walkers before the first step.
    """
    _save(folder / f"ensemble-{ensemble}-start.npz", _state_arrays(state))


def save_block(folder: Path, ensemble: int, index: int, block: Block) -> None:
    """Write a block of steps of an ensemble into the folder of a run.

    Parameters
    ----------
    folder : of the run's checkpoints.
    ensemble, index : numbers of the ensemble and of the block, from 0.
    block : the steps.
    """
    arrays = {"chain": block.chain, "step_log_prob": block.log_prob, "accepted": block.accepted, **_state_arrays(block.end)}
    _save(_block_path(folder, ensemble, index), arrays)


def load_state(folder: Path, ensemble: int) -> tuple[EnsembleState | None, int]:
    """Find where an ensemble left off: its state after the last of its complete consecutive blocks.

    A file that cannot be read ends the series: what follows it is computed anew, to the same numbers.

    Parameters
    ----------
    folder : of the run's checkpoints.
    ensemble : its number, from 0.

    Returns
    -------
    The state, and how many blocks lie before it; (None, 0) without a start.
    """
    state = _load_state(folder / f"ensemble-{ensemble}-start.npz")
    index = 0
    while state is not None:
        later = _load_state(_block_path(folder, ensemble, index))
        if later is None:
            break
        state, index = later, index + 1
    return state, index


def load_chain(folder: Path, ensemble: int, n_block: int, first: int, thin: int) -> tuple[FloatArray, FloatArray]:
    """Load stored steps of an ensemble: `first`, `first + thin`, ..., counted from 0.

    Parameters
    ----------
    folder : of the run's checkpoints.
    ensemble : its number, from 0.
    n_block : how many blocks are looked at.
    first : the first stored step to load; those before it are the burn-in.
    thin : every how many-th stored step is loaded.

    Returns
    -------
    chain (n_step, n_walker, n_parameter) and log_prob (n_step, n_walker).
    """
    chains, log_probs, done = [], [], 0
    for index in range(n_block):
        with np.load(_block_path(folder, ensemble, index)) as file:
            n_step = int(file["step_log_prob"].shape[0])
            offset = first - done if done < first else (first - done) % thin
            if offset < n_step:
                chains.append(file["chain"][offset::thin])
                log_probs.append(file["step_log_prob"][offset::thin])
            done += n_step
    return np.concatenate(chains), np.concatenate(log_probs)


def load_accepted(folder: Path, ensemble: int, n_block: int, first_block: int) -> FloatArray:
    """Count the accepted steps of each walker of an ensemble, to judge its moves.

    Parameters
    ----------
    folder : of the run's checkpoints.
    ensemble : its number, from 0.
    n_block : the block to stop before.
    first_block : the block to begin with, from 0.

    Returns
    -------
    (n_walker,).
    """
    total = 0.0
    for index in range(first_block, n_block):
        with np.load(_block_path(folder, ensemble, index)) as file:
            total = total + file["accepted"].astype(float)
    return np.asarray(total, dtype=float)


def _block_path(folder: Path, ensemble: int, index: int) -> Path:
    return folder / f"ensemble-{ensemble}-{index:05d}.npz"


def _state_arrays(state: EnsembleState) -> dict[str, np.ndarray[tuple[int, ...], np.dtype[np.generic]]]:
    return {
        "coords": state.coords,
        "log_prob": state.log_prob,
        "random_keys": state.random_keys,
        "random_rest": np.array([state.random_position, state.random_has_gauss], dtype=np.int64),
        "random_gauss": np.array([state.random_gauss]),
    }


def _save(path: Path, arrays: Mapping[str, np.ndarray[tuple[int, ...], np.dtype[np.generic]]]) -> None:
    # To an open file, as NumPy appends an ending to a name.
    with whole_file(path) as whole, whole.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def _load_state(path: Path) -> EnsembleState | None:
    """State that a file holds, or None if it is not there or cannot be read."""
    try:
        # Opened here, as NumPy leaves a damaged file open.
        with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            rest = file["random_rest"]
            if path.stem[-5:].isdigit():
                _ = file["chain"], file["step_log_prob"], file["accepted"]  # reads and checks them
            return EnsembleState(
                file["coords"],
                file["log_prob"],
                file["random_keys"],
                int(rest[0]),
                int(rest[1]),
                float(file["random_gauss"][0]),
            )
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None

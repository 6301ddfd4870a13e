"""Checkpoints of a sampling run: starts and blocks of each ensemble to files written atomically, and back.

A folder holds `manifest.json` (what the run is of), and for each ensemble `ensemble-0-start.npz` and one
`ensemble-0-00000.npz` per block. A file is there whole or not at all: it is written beside its place, synced and renamed.
"""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from calib.errors import Fault, InputError
from calib.lab import sweeps_to_json
from calib.problem import Problem
from calib.sampling.ensemble import MOVES, STORE_EVERY, Block, EnsembleState
from models.sensor import FloatArray

_FORMAT = 1


def fingerprint(problem: Problem, seed: int, n_ensemble: int, n_walker: int) -> str:
    """Hash of all that a chain depends on: unknowns and priors, data, forward model, seed, ensembles, moves. Not of paths."""
    content = {
        "format": _FORMAT,
        "parameters": [[p.name, p.prior.to_json()] for p in problem.parameters],
        "fixed": dict(problem.fixed),
        "radius": problem.experiment.sensor_radius,
        "padding": problem.experiment.padding_material,
        "discrepancy": problem.experiment.discrepancy,
        "sweeps": sweeps_to_json(problem.sweeps),
        "forward": problem.forward.name,
        "run": [seed, n_ensemble, n_walker, MOVES, STORE_EVERY],
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def open_checkpoint(folder: Path, mark: str, *, resume: bool) -> None:
    """Make `folder` ready for a run with this `fingerprint`: check that it is the same run to resume, or empty it.

    Raises
    ------
    InputError
        If a run is to be resumed whose fingerprint is another.
    """
    folder.mkdir(parents=True, exist_ok=True)
    manifest = folder / "manifest.json"
    if resume and manifest.exists():
        try:
            found = json.loads(manifest.read_text(encoding="utf-8"))["fingerprint"]
        except (ValueError, KeyError, TypeError):
            found = ""
        if found != mark:
            raise InputError(
                Fault(
                    "the checkpoint is of another run: experiment, data, forward model or seed have changed since",
                    manifest,
                    advice="Start anew without resuming, or put the inputs back",
                )
            )
        for leftover in folder.glob(".*.part"):
            leftover.unlink()
        return
    for old in [*folder.glob("ensemble-*.npz"), *folder.glob(".*.part"), *folder.glob("manifest.json")]:
        old.unlink()
    write_atomically(manifest, json.dumps({"fingerprint": mark, "format": _FORMAT}, indent=1).encode())


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file so that at any moment, power cuts included, it is there whole or not at all."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    with part.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    publish(part, path)


def publish(part: Path, path: Path) -> None:
    """Give a synced file its final name and sync the folder, where the system can."""
    os.replace(part, path)
    if hasattr(os, "O_DIRECTORY"):
        folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)


def save_start(folder: Path, ensemble: int, state: EnsembleState) -> None:
    """Write the start of an ensemble."""
    _save(folder / f"ensemble-{ensemble}-start.npz", _state_arrays(state))


def save_block(folder: Path, ensemble: int, index: int, block: Block) -> None:
    """Write block number `index` of an ensemble."""
    arrays = {"chain": block.chain, "step_log_prob": block.log_prob, "accepted": block.accepted, **_state_arrays(block.end)}
    _save(_block_path(folder, ensemble, index), arrays)


def load_state(folder: Path, ensemble: int) -> tuple[EnsembleState | None, int]:
    """Last state of an ensemble after its complete consecutive blocks, and their number; (None, 0) without a start.

    A file that cannot be read ends the series: what follows it is computed anew, to the same numbers.
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
    """Stored steps `first`, `first + thin`, ... of the first `n_block` blocks of an ensemble, counted from 0.

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
    """Accepted steps of each walker (n_walker,) in blocks `first_block` to `n_block`."""
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
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    with part.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)
        file.flush()
        os.fsync(file.fileno())
    publish(part, path)


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

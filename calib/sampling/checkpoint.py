"""Checkpoints of a sampling run: starts and blocks of each ensemble to files that say whose they are, and back.

A folder holds `manifest.json` (what the run is of), and for each ensemble `ensemble-0-modes.npz` (where it climbed to),
`ensemble-0-start.npz` (walkers and proposal) and one `ensemble-0-00000.npz` per block. A file is there whole or not at all
(`calib.files.whole_file`), and ends with its checksum. What is damaged, belongs to another run, ensemble or place in the
series, or does not go on from the block before it, is as good as not there: it is computed again, to the same numbers.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from calib.errors import Fault, InputError
from calib.files import remove_leftovers, whole_file, write_text
from calib.records import exact_record_from_text, record_from_text, record_to_text
from calib.sampling.ensemble import Block, EnsembleState
from calib.sampling.funnel import Funnel
from calib.sampling.identity import Identity, differences
from calib.sampling.proposal import Proposal
from calib.sampling.start import Start
from calib.sampling.target import Mode
from models.seal import sealed, unsealed
from models.sensor import FloatArray

_KIND = "checkpoint"
_FORMAT = 4

_MANIFEST = "manifest.json"

# Name of the array that says whose a file is: fingerprint, ensemble, and block or "start".
_WHOSE = "whose"

# Name of the array with the hash of the state that a block goes on from; on another machine the same steps may end elsewhere.
_AFTER = "after"


@dataclass(frozen=True)
class CheckpointFolder:
    """A folder of checkpoints, and the fingerprint of the run that they are of."""

    path: Path
    fingerprint: str


def open_checkpoint(path: Path, run: Identity, *, resume: bool) -> CheckpointFolder:
    """Make a folder ready for the checkpoints of a run: check that it is the same run to resume, or empty the folder.

    Parameters
    ----------
    path : of the folder, made if need be.
    run : what the draws depend on.
    resume : whether to go on from the checkpoints that are there.

    Raises
    ------
    InputError
        If a run is to be resumed that is another, or was written by another version of the program.
    """
    path.mkdir(parents=True, exist_ok=True)
    folder = CheckpointFolder(path, run.fingerprint)
    if resume:
        _require_same(folder, run)
    else:
        for old in [path / _MANIFEST, *path.glob("ensemble-*.npz")]:
            old.unlink(missing_ok=True)
    remove_leftovers(path)
    text = record_to_text(_KIND, _FORMAT, {"fingerprint": run.fingerprint, "identity": run.parts})
    manifest = path / _MANIFEST
    if not manifest.is_file() or manifest.read_bytes() != text.encode():
        write_text(manifest, text)
    return folder


def kept_identity(path: Path) -> Mapping[str, str] | None:
    """Parts of the identity of the run whose checkpoints a folder holds; None if its manifest is not there or damaged."""
    try:
        parts = exact_record_from_text(_KIND, _FORMAT, (path / _MANIFEST).read_text(encoding="utf-8"))["identity"]
    except (OSError, ValueError, KeyError):
        return None
    return {str(name): str(value) for name, value in parts.items()}


def whose_checkpoint(path: Path) -> str:
    """Fingerprint of the run that a file of a start or a block is of; empty if it is damaged, or not in its place."""
    words = path.stem.split("-")
    arrays = _content(path)
    whose = _whose(arrays) if arrays is not None else ()
    return whose[0] if len(words) == 3 and len(whose) == 3 and whose[1:] == (words[1], words[2]) else ""


def is_begun(path: Path) -> bool:
    """Whether a folder holds anything that was sampled."""
    return any(path.glob("ensemble-*.npz"))


def kept_blocks(path: Path) -> int:
    """How many blocks every ensemble has in a folder of checkpoints, by the names of files alone; 0 without any."""
    counts: dict[str, int] = {}
    for block in path.glob("ensemble-*-*.npz"):
        ensemble, place = block.stem.removeprefix("ensemble-").split("-", 1)
        counts[ensemble] = counts.get(ensemble, 0) + place.isdecimal()
    return min(counts.values(), default=0)


def _require_same(folder: CheckpointFolder, run: Identity) -> None:
    manifest = folder.path / _MANIFEST
    _require_this_format(manifest)
    found = kept_identity(folder.path)
    if found is None:
        # Then the starts tell; without them nothing was sampled.
        others = {whose_checkpoint(start) for start in folder.path.glob("ensemble-*-start.npz")} - {"", run.fingerprint}
        said = "which one, its damaged manifest.json cannot tell" if others else ""
    else:
        said = differences(found, run.parts)
    if said:
        advice = "Put the inputs back to go on with that run, or start anew with another output folder"
        raise InputError(Fault(f"the checkpoint is of another run: {said}", manifest, advice=advice))


def _require_this_format(manifest: Path) -> None:
    """Refuse what another version wrote; what is merely damaged is none of that."""
    try:
        text = manifest.read_text(encoding="utf-8")
        record = json.loads(text)
        found = record["format"]
        if found == _FORMAT or record["kind"] != _KIND:
            return
        if "checksum" in record:
            record_from_text(_KIND, found, text)
    except (OSError, ValueError, KeyError, TypeError):
        return
    message = f"another version of calib wrote this checkpoint (format {found}, this version reads format {_FORMAT})"
    raise InputError(Fault(message, manifest, advice="Start anew with another output folder, or use the version that wrote it"))


def save_modes(folder: CheckpointFolder, ensemble: int, modes: Sequence[Mode]) -> None:
    """Write the modes that an ensemble found into the folder of a run.

    Parameters
    ----------
    folder : of the run's checkpoints.
    ensemble : its number, from 0.
    modes : one at least.
    """
    arrays = {
        "x": np.stack([m.x for m in modes]),
        "log_density": np.array([m.log_density for m in modes]),
        "factor": np.stack([m.factor for m in modes]),
    }
    _save(folder, ensemble, _MODES, arrays)


def load_modes(folder: CheckpointFolder, ensemble: int) -> tuple[Mode, ...] | None:
    """Load the modes that an ensemble found; None if that is not known.

    Parameters
    ----------
    folder : of the run's checkpoints.
    ensemble : its number, from 0.
    """
    found = _load(folder, ensemble, _MODES)
    if found is None:
        return None
    return tuple(Mode(x, float(top), f) for x, top, f in zip(found["x"], found["log_density"], found["factor"], strict=True))


def save_start(folder: CheckpointFolder, ensemble: int, start: Start) -> None:
    """Write the start of an ensemble into the folder of a run.

    Parameters
    ----------
    folder : of the run's checkpoints.
    ensemble : its number, from 0.
    start : its walkers before the first step, and the proposal that they move by.
    """
    _save(folder, ensemble, _START, {**_state_arrays(start.state), **_proposal_arrays(start.proposal)})


def load_proposal(folder: CheckpointFolder, ensemble: int) -> Proposal | None:
    """Load the proposal that the walkers of an ensemble move by; None if they move without.

    Parameters
    ----------
    folder : of the run's checkpoints, which hold the start of the ensemble.
    ensemble : its number, from 0.

    Raises
    ------
    InputError
        If the start is not there.
    """
    return _proposal(_require(folder, ensemble, _START))


def save_block(folder: CheckpointFolder, ensemble: int, index: int, block: Block) -> None:
    """Write a block of steps of an ensemble into the folder of a run.

    Parameters
    ----------
    folder : of the run's checkpoints.
    ensemble, index : numbers of the ensemble and of the block, from 0.
    block : the steps.
    """
    before = _require(folder, ensemble, _place(index - 1) if index else _START)
    arrays = {
        _AFTER: np.array(_hash_of_state(before)),
        "chain": block.chain,
        "step_log_prob": block.log_prob,
        "tried": block.tried,
        "accepted": block.accepted,
        **_state_arrays(block.end),
    }
    _save(folder, ensemble, _place(index), arrays)


def load_state(folder: CheckpointFolder, ensemble: int, n_known: int = 0) -> tuple[EnsembleState | None, int]:
    """Find where an ensemble left off: its state after the last of its complete consecutive blocks.

    A file that cannot be used ends the series: what follows it is computed anew, to the same numbers.

    Parameters
    ----------
    folder : of the run's checkpoints.
    ensemble : its number, from 0.
    n_known : blocks that need not be read again, as this process has done so or has written them.

    Returns
    -------
    The state, and how many blocks lie before it; (None, 0) without a start.
    """
    found = _load(folder, ensemble, _place(n_known - 1) if n_known else _START)
    if found is None:
        return load_state(folder, ensemble) if n_known else (None, 0)
    index = n_known
    while (later := _load(folder, ensemble, _place(index))) is not None and str(later[_AFTER]) == _hash_of_state(found):
        found, index = later, index + 1
    return _state(found), index


def load_chain(folder: CheckpointFolder, ensemble: int, n_block: int, first: int, thin: int) -> tuple[FloatArray, FloatArray]:
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
    block = _require(folder, ensemble, _place(0))
    n_step = int(block["step_log_prob"].shape[0])  # as in all of them
    begin = min(first // n_step, n_block - 1)  # the burn-in takes as long to read as the rest
    chains, log_probs, done = [], [], begin * n_step
    for index in range(begin, n_block):
        block = _require(folder, ensemble, _place(index)) if index else block
        offset = first - done if done < first else (first - done) % thin
        if offset < n_step:
            chains.append(block["chain"][offset::thin])
            log_probs.append(block["step_log_prob"][offset::thin])
        done += n_step
    return np.concatenate(chains), np.concatenate(log_probs)


def load_accepted(
    folder: CheckpointFolder, ensemble: int, n_block: int, first_block: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Count the steps of single walkers of an ensemble by kind of move, to judge its moves.

    Parameters
    ----------
    folder : of the run's checkpoints.
    ensemble : its number, from 0.
    n_block : the block to stop before.
    first_block : the block to begin with, from 0.

    Returns
    -------
    Those that were tried and those that were accepted, each (n_kind,) in the order of `calib.sampling.ensemble.KINDS`.
    """
    blocks = [_require(folder, ensemble, _place(index)) for index in range(first_block, n_block)]
    tried, accepted = (np.sum([block[name] for block in blocks], axis=0) for name in ("tried", "accepted"))
    return np.asarray(tried), np.asarray(accepted)


_STATE = ("coords", "log_prob", "random_keys", "random_rest", "random_gauss")
_Arrays = Mapping[str, np.ndarray[tuple[int, ...], np.dtype[Any]]]


# Words for places in the series of an ensemble's files that have no number.
_MODES, _START = "modes", "start"


def _path(folder: CheckpointFolder, ensemble: int, place: str) -> Path:
    return folder.path / f"ensemble-{ensemble}-{place}.npz"


def _place(index: int) -> str:
    """The word for a block in the name of its file."""
    return f"{index:05d}"


def _state_arrays(state: EnsembleState) -> _Arrays:
    return {
        "coords": state.coords,
        "log_prob": state.log_prob,
        "random_keys": state.random_keys,
        "random_rest": np.array([state.random_position, state.random_has_gauss], dtype=np.int64),
        "random_gauss": np.array([state.random_gauss]),
    }


def _state(arrays: _Arrays) -> EnsembleState:
    position, has_gauss = arrays["random_rest"]
    gauss = float(arrays["random_gauss"][0])
    return EnsembleState(arrays["coords"], arrays["log_prob"], arrays["random_keys"], int(position), int(has_gauss), gauss)


def _proposal_arrays(proposal: Proposal | None) -> _Arrays:
    if proposal is None:
        return {}
    parts = {
        f"part_{k}_{name}": np.asarray(getattr(part, name))
        for k, part in enumerate(proposal.parts)
        for name in Funnel.__dataclass_fields__
    }
    return {"shares": proposal.shares, **parts}


def _proposal(arrays: _Arrays) -> Proposal | None:
    if "shares" not in arrays:
        return None
    parts = []
    for k in range(arrays["shares"].size):
        own: dict[str, Any] = {name: arrays[f"part_{k}_{name}"] for name in Funnel.__dataclass_fields__}
        parts.append(Funnel(**{**own, "n_scale": int(own["n_scale"])}))
    return Proposal(tuple(parts), arrays["shares"])


def _hash_of_state(arrays: _Arrays) -> str:
    digest = hashlib.sha256()
    for name in _STATE:
        digest.update(np.ascontiguousarray(arrays[name]).tobytes())
    return digest.hexdigest()


def _save(folder: CheckpointFolder, ensemble: int, place: str, arrays: _Arrays) -> None:
    """Write arrays as NumPy's npz with a checksum behind it; the same arrays give the same bytes, without a date."""
    memory = io.BytesIO()
    whose = np.array([folder.fingerprint, str(ensemble), place])
    with zipfile.ZipFile(memory, "w") as archive:
        for name, values in {_WHOSE: whose, **arrays}.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, np.asanyarray(values), allow_pickle=False)
            archive.writestr(zipfile.ZipInfo(f"{name}.npy"), member.getvalue())
    with whole_file(_path(folder, ensemble, place)) as whole:
        whole.write_bytes(sealed(memory.getvalue()))


def _load(folder: CheckpointFolder, ensemble: int, place: str) -> _Arrays | None:
    """Arrays of one file; None if the file is not there, is damaged, or is not that of this place in this run."""
    arrays = _content(_path(folder, ensemble, place))
    own = (folder.fingerprint, str(ensemble), place)
    return arrays if arrays is not None and _whose(arrays) == own else None


def _require(folder: CheckpointFolder, ensemble: int, place: str) -> _Arrays:
    """A file that this process has written or read before."""
    block = _load(folder, ensemble, place)
    if block is None:
        raise _gone(folder, ensemble, place)
    return block


def _gone(folder: CheckpointFolder, ensemble: int, place: str) -> InputError:
    advice = "Run the same command with --resume: what is missing is computed again"
    message = "this part of the checkpoint was changed or removed while the run went on"
    return InputError(Fault(message, _path(folder, ensemble, place), advice=advice))


def _content(path: Path) -> _Arrays | None:
    """All arrays of a file as they were written; None if it is not there, or not what was written to the last byte."""
    try:
        with np.load(io.BytesIO(unsealed(path.read_bytes())), allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except (OSError, ValueError, zipfile.BadZipFile):
        return None


def _whose(arrays: _Arrays) -> tuple[str, ...]:
    return tuple(str(word) for word in arrays[_WHOSE]) if _WHOSE in arrays else ()

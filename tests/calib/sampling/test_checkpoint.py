"""The fingerprint of a run: the same inputs have the same one, and each input alone changes it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import calib.sampling.identity as identity_module
from calib.errors import InputError
from calib.priors.distributions import Normal, prior_from_json
from calib.problem.problem import Problem, build_problem
from calib.records import record_to_text
from calib.sampling.checkpoint import (
    CheckpointFolder,
    kept_identity,
    load_accepted,
    load_chain,
    load_modes,
    load_proposal,
    load_state,
    open_checkpoint,
    save_block,
    save_modes,
    save_start,
    whose_checkpoint,
)
from calib.sampling.ends import ENDLESS
from calib.sampling.ensemble import KINDS, Block, EnsembleState
from calib.sampling.funnel_fit import fit_funnel
from calib.sampling.identity import Identity, differences, identity_of
from calib.sampling.posterior import Posterior
from calib.sampling.proposal import Proposal
from calib.sampling.start import Start
from calib.sampling.target import Mode
from models.analytic import ClosedForm
from models.fem import FiniteElements
from models.surrogate.surrogate import load_surrogate

MakePosterior = Callable[..., Posterior]


@pytest.fixture
def problem(make_posterior: MakePosterior) -> Problem:
    p = make_posterior()
    return build_problem(p.experiment, p.sweeps, ClosedForm())


def _mark(problem: Problem) -> str:
    return identity_of(problem, 1, 4, 64).fingerprint


def test_the_same_inputs_have_the_same_fingerprint_wherever_their_files_lie(
    problem: Problem, make_posterior: MakePosterior
) -> None:
    p = make_posterior()
    moved = replace(p.experiment, path=Path("/elsewhere/e.toml"), name="renamed")
    assert _mark(build_problem(moved, p.sweeps, ClosedForm())) == _mark(problem)
    surrogates = [load_surrogate(), replace(load_surrogate(), provenance={"date": "another"})]
    assert len({_mark(replace(problem, forward=s)) for s in surrogates}) == 1


EXPERIMENT: dict[str, Any] = {
    "law": "gent",
    "stick": True,
    "padding_material": "own",
    "sensor_radius": 11e-3,
    "discrepancy": "off",
}


@pytest.mark.parametrize("name", EXPERIMENT)
def test_what_the_experiment_says_changes_the_fingerprint(problem: Problem, name: str) -> None:
    changed = replace(problem.experiment, **{name: EXPERIMENT[name]})
    assert _mark(replace(problem, experiment=changed)) != _mark(problem)


def test_the_forward_models_content_changes_the_fingerprint(problem: Problem) -> None:
    surrogate = load_surrogate()
    forwards = (
        ClosedForm(),
        ClosedForm(force_error=0.05),
        FiniteElements(),
        FiniteElements(5e-4),
        surrogate,
        replace(surrogate, force_modes=1.001 * surrogate.force_modes),
    )
    assert len({_mark(replace(problem, forward=f)) for f in forwards}) == len(forwards)


def test_data_priors_and_fixed_values_change_the_fingerprint(problem: Problem) -> None:
    first, *rest = problem.sweeps
    force = np.array(first.channels["force"].value)
    force[3] = np.nextafter(force[3], 1.0)
    moved = {**first.channels, "force": replace(first.channels["force"], value=force)}
    sweeps = (replace(first, channels=moved), *rest)
    prior = replace(problem.parameters[1], prior=Normal(2.8, 0.21))
    changed = (
        replace(problem, sweeps=sweeps),
        replace(problem, parameters=(problem.parameters[0], prior, *problem.parameters[2:])),
        replace(problem, fixed={**problem.fixed, "electrode_radius": 9e-3}),
    )
    assert len({_mark(p) for p in (problem, *changed)}) == 4


def test_seed_ensembles_and_walkers_change_the_fingerprint(problem: Problem) -> None:
    marks = {identity_of(problem, *run).fingerprint for run in ((1, 4, 64), (2, 4, 64), (1, 5, 64), (1, 4, 66))}
    assert len(marks) == 4


@pytest.mark.parametrize(
    ("name", "value"),
    [("LIKELIHOOD_VERSION", 99), ("SHAPELY", ()), ("STORE_EVERY", 7), ("START_VERSION", 99)],
)
def test_what_the_program_does_changes_the_fingerprint(
    problem: Problem, monkeypatch: pytest.MonkeyPatch, name: str, value: object
) -> None:
    before = _mark(problem)
    monkeypatch.setattr(identity_module, name, value)
    assert _mark(problem) != before


def test_another_version_of_the_sampler_changes_the_fingerprint(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    before = _mark(problem)
    monkeypatch.setattr(identity_module, "version", lambda package: version(package) + ".post1")
    assert _mark(problem) != before


def test_what_is_another_is_named_in_words(problem: Problem) -> None:
    mine = identity_of(problem, 1).parts
    assert differences(mine, mine) == ""
    assert differences(identity_of(problem, 2).parts, mine) == "seed was 2 and is 1 now"
    surrogate = identity_of(replace(problem, forward=load_surrogate()), 1).parts
    said = differences(surrogate, mine)
    assert said.startswith("forward model was ")
    assert load_surrogate().name in said
    assert len(said) < 160  # a hash is not written out
    fixed = identity_of(replace(problem, fixed={**problem.fixed, "clock_offset[sensor 9]": 1.0}), 1).parts
    assert differences(mine, fixed) == 'prior of clock_offset[sensor 9] was none and is "fixed at 1 s" now'
    name, offset = next((name, value) for name, value in mine.items() if name.startswith("prior of contact_offset"))
    other = {**mine, name: json.dumps(Normal(0.0, 1e-4).to_json())}
    described = prior_from_json(json.loads(offset)).describe("contact_offset")
    assert differences(mine, other) == f'{name} was "{described}" and is "normal, mean 0 mm, sd 0.1 mm" now'
    nearly = {**mine, name: json.dumps(Normal(0.0, 1.0000001e-4).to_json())}
    assert "0.00010000001" in differences(other, nearly)  # what the shown digits do not tell
    data = next(name for name in mine if name.startswith("data of sweep"))
    assert differences({**mine, data: "0" * 64}, mine) == f"{data} have changed: its files, its ball or the part that is used"
    assert differences({**mine, "moves of the sampler": "[]"}, mine) == "moves of the sampler are those of another version"
    assert "4 more differences" in differences({**mine, **{f"x{k}": "" for k in range(8)}}, mine)


# --- the folder ---------------------------------------------------------------------------------------------------------

RUN, OTHER = Identity({"seed": "1", "law": "gent"}), Identity({"seed": "2", "law": "gent"})


def _state(rng: np.random.Generator) -> EnsembleState:
    keys = rng.integers(0, 2**32, 624, dtype=np.uint32)
    return EnsembleState(rng.normal(size=(6, 2)), rng.normal(size=6), keys, 17, 1, float(rng.normal()))


def _block(rng: np.random.Generator) -> Block:
    counts = rng.integers(0, 9, (2, len(KINDS)))
    return Block(rng.normal(size=(10, 6, 2)), rng.normal(size=(10, 6)), counts[0], counts[1], _state(rng))


def _modes(rng: np.random.Generator) -> tuple[Mode, ...]:
    return tuple(Mode(rng.normal(size=2), float(rng.normal()), rng.normal(size=(2, 2))) for _ in range(2))


def _start(rng: np.random.Generator) -> Start:
    draws = [rng.normal(size=(200, 2)) + far for far in (0.0, 9.0)]
    ends = np.array([(0.0, np.inf), ENDLESS])  # near which one of the two modes lies
    proposal = Proposal(tuple(fit_funnel(x, [1], ends=ends) for x in draws), np.array([0.3, 0.7]))
    return Start(_state(rng), proposal if rng.random() < 0.5 else None)


def _filled(path: Path, run: Identity = RUN, seed: int = 5) -> CheckpointFolder:
    """A folder with two ensembles of three blocks each."""
    folder, rng = open_checkpoint(path, run, resume=False), np.random.default_rng(seed)
    for ensemble in range(2):
        save_modes(folder, ensemble, _modes(rng))
        save_start(folder, ensemble, _start(rng))
        for index in range(3):
            save_block(folder, ensemble, index, _block(rng))
    return folder


def _bytes(path: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in path.iterdir()}


def test_what_is_saved_is_loaded_and_the_same_arrays_give_the_same_bytes(tmp_path: Path) -> None:
    folder = _filled(tmp_path / "a")
    again = _filled(tmp_path / "b")
    assert _bytes(folder.path) == _bytes(again.path)
    rng = np.random.default_rng(5)
    modes, start = _modes(rng), _start(rng)
    blocks = [_block(rng) for _ in range(3)]
    state, n_block = load_state(folder, 0)
    assert state is not None
    assert n_block == 3
    np.testing.assert_array_equal(state.coords, blocks[-1].end.coords)
    assert (state.random_position, state.random_has_gauss, state.random_gauss) == (17, 1, blocks[-1].end.random_gauss)
    chain, log_prob = load_chain(folder, 0, 3, 15, 2)
    np.testing.assert_array_equal(chain, np.concatenate([b.chain for b in blocks])[15::2])
    np.testing.assert_array_equal(log_prob, np.concatenate([b.log_prob for b in blocks])[15::2])
    tried, accepted = load_accepted(folder, 0, 3, 1)
    np.testing.assert_array_equal(tried, blocks[1].tried + blocks[2].tried)
    np.testing.assert_array_equal(accepted, blocks[1].accepted + blocks[2].accepted)
    loaded = load_modes(folder, 0)
    assert loaded is not None
    for found, kept in zip(loaded, modes, strict=True):
        np.testing.assert_array_equal(found.x, kept.x)
        np.testing.assert_array_equal(found.factor, kept.factor)
        assert found.log_density == kept.log_density
    x = rng.normal(size=(5, 2))
    proposals = [load_proposal(folder, ensemble) for ensemble in range(2)]
    assert start.proposal is not None
    assert proposals[0] is not None
    np.testing.assert_array_equal(proposals[0].log_density(x), start.proposal.log_density(x))
    with np.load(folder.path / "ensemble-0-00000.npz") as plain:  # other programs read it, too
        np.testing.assert_array_equal(plain["chain"], blocks[0].chain)


@pytest.mark.parametrize("file", ["ensemble-0-start.npz", "ensemble-0-00001.npz"])
def test_any_changed_byte_and_any_lost_end_of_a_file_make_it_as_good_as_not_there(tmp_path: Path, file: str) -> None:
    folder = _filled(tmp_path)
    path, rng = tmp_path / file, np.random.default_rng(11)
    whole = path.read_bytes()
    expected = 1 if "00001" in file else 0
    for place in rng.integers(0, len(whole), 150):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        assert load_state(folder, 0)[1] == expected
    for length in (0, 1, 200, len(whole) - 1):
        path.write_bytes(whole[:length])
        assert load_state(folder, 0)[1] == expected
    assert whose_checkpoint(path) == ""
    assert load_state(folder, 1)[1] == 3
    path.write_bytes(whole)
    assert load_state(folder, 0)[1] == 3


def test_blocks_of_another_run_ensemble_or_place_are_not_taken(tmp_path: Path) -> None:
    folder, other = _filled(tmp_path / "a"), _filled(tmp_path / "b", OTHER)
    kept = folder.path / "ensemble-0-00001.npz"
    for foreign in (
        other.path / "ensemble-0-00001.npz",
        folder.path / "ensemble-1-00001.npz",
        folder.path / "ensemble-0-00002.npz",
        folder.path / "ensemble-0-start.npz",
    ):
        kept.write_bytes(foreign.read_bytes())
        assert load_state(folder, 0)[1] == 1
        with pytest.raises(InputError, match="was changed or removed while the run went on"):
            load_chain(folder, 0, 3, 0, 1)
        assert whose_checkpoint(kept) != RUN.fingerprint
    assert whose_checkpoint(folder.path / "ensemble-0-00002.npz") == RUN.fingerprint
    assert whose_checkpoint(other.path / "ensemble-0-start.npz") == OTHER.fingerprint


def test_a_block_that_does_not_go_on_from_the_one_before_it_is_not_taken(tmp_path: Path) -> None:
    folder, twin = _filled(tmp_path / "a"), _filled(tmp_path / "b", seed=6)  # as on a machine that rounds in another way
    (folder.path / "ensemble-0-00001.npz").write_bytes((twin.path / "ensemble-0-00001.npz").read_bytes())
    assert load_state(folder, 0)[1] == 1


def test_a_checkpoint_of_another_run_is_refused_by_what_is_another(tmp_path: Path) -> None:
    _filled(tmp_path)
    before = _bytes(tmp_path)
    open_checkpoint(tmp_path, RUN, resume=True)
    assert _bytes(tmp_path) == before
    with pytest.raises(InputError, match="the checkpoint is of another run: seed was 1 and is 2 now"):
        open_checkpoint(tmp_path, OTHER, resume=True)
    assert _bytes(tmp_path) == before
    assert kept_identity(tmp_path) == RUN.parts


@pytest.mark.parametrize("manifest", [None, b"", b"[]", b"{", b"\xff\xfe", b'{"kind": "run", "format": 3}'])
def test_a_damaged_manifest_is_written_anew_where_the_blocks_are_of_this_run(tmp_path: Path, manifest: bytes | None) -> None:
    _filled(tmp_path)
    path = tmp_path / "manifest.json"
    before = _bytes(tmp_path)
    path.unlink()
    if manifest is not None:
        path.write_bytes(manifest)
    assert kept_identity(tmp_path) is None
    with pytest.raises(InputError, match="of another run"):
        open_checkpoint(tmp_path, OTHER, resume=True)
    open_checkpoint(tmp_path, RUN, resume=True)
    assert _bytes(tmp_path) == before


def test_any_changed_byte_of_the_manifest_is_mended(tmp_path: Path) -> None:
    _filled(tmp_path)
    path, rng = tmp_path / "manifest.json", np.random.default_rng(3)
    whole = path.read_bytes()
    for place in rng.integers(0, len(whole), 100):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        assert kept_identity(tmp_path) is None
        open_checkpoint(tmp_path, RUN, resume=True)
        assert path.read_bytes() == whole


def test_a_checkpoint_of_another_version_is_refused_as_such(tmp_path: Path) -> None:
    (tmp_path / "ensemble-0-00000.npz").write_bytes(b"hours of work")
    for text in (
        '{"kind": "checkpoint", "format": 2, "fingerprint": "ab"}',
        record_to_text("checkpoint", 99, {"fingerprint": "ab"}),
    ):
        (tmp_path / "manifest.json").write_text(text)
        with pytest.raises(InputError, match=r"another version of calib wrote this checkpoint \(format (2|99), this version"):
            open_checkpoint(tmp_path, RUN, resume=True)
    assert (tmp_path / "ensemble-0-00000.npz").read_bytes() == b"hours of work"
    open_checkpoint(tmp_path, RUN, resume=False)
    assert [p.name for p in tmp_path.iterdir()] == ["manifest.json"]

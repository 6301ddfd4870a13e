"""Load damaged files until something goes wrong: `python benchmarks/damage_files.py -n 2000`.

Calibrates a sensor shortly, recommends a padding, fills a training store, and then damages what was written, one file at a
time: bits flipped, runs of bytes overwritten, zeroed, doubled or left out, the end or the beginning cut off, a file of another
kind or a text in its place; in JSON, besides, values of other kinds, huge integers and deep nesting. Half of the places are in
the first and last bytes, where formats keep what they rest on. Files are loaded in a process beside this one, as a damaged one
may end it.

A damage is refused by an `InputError` that names the file, or is harmless: what was loaded is what was written, to the last
bit. Everything else is a failure and is printed with its number: `--again NUMBER` does that one alone.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import random
import shutil
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from calib.decision import Requirement
from calib.errors import Fault, InputError
from calib.experiment import surrogate_from
from calib.problem import Problem
from calib.records import record_from_text
from calib.runs import Stages, calibrate, load_recommendation, load_run, recommend_in
from calib.sampling import Posterior, sample
from models.surrogate import load_surrogate
from models.surrogate.store import StoreError, open_store

DATA = Path(__file__).parents[1] / "datasets" / "padded_sensor"
SETTINGS = {"accuracy": 1e-3, "family": "neo-hookean"}
EXPERIMENT = f"""
name = "to be damaged"
model = "closed form"
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
[[specimens]]
name = "sensor 1"
force = "{DATA}/sensor1_instron.csv"
[specimens.priors]
sensor_thickness = {{ normal = ["0.74 mm", "0.02 mm"] }}
padding_thickness = {{ normal = ["1.10 mm", "0.03 mm"] }}
"""

OUTCOMES = ("refused", "harmless", "wrong", "traceback", "crash")


# --- what is damaged, and how it is loaded ------------------------------------------------------------------------------


def make_files(folder: Path) -> None:
    """Write one file of each kind into a folder."""
    experiment = folder / "experiment.toml"
    experiment.write_text(EXPERIMENT, encoding="utf-8")
    stages = Stages(_shortly, lambda posterior, _: posterior, page=lambda *_: "a page")
    run = calibrate(experiment, folder / "run", processes=0, stages=stages).run
    recommend_in(run, Requirement(force=5.0, lower=0.0, upper=2e-3, n_thickness=5, n_draw=50), seed=1)
    load_surrogate().save(folder / "surrogate.npz")
    rng = np.random.default_rng(1)
    with open_store(folder / "runs.sqlite", SETTINGS) as store:
        for k in range(24):
            arrays = {"force": rng.random(20), "capacitance": rng.random((20, 6, 7))}
            store.add(rng.random(5), arrays, "no equilibrium" if k % 5 == 0 else "")


def _shortly(problem: Problem, **options: Any) -> Posterior:
    return sample(problem, **{**options, "max_steps": 50})


def _posterior(path: Path) -> object:
    p = load_run(path.parent).posterior
    words = (p.parameters, p.fixed, p.forward_name, p.blocks, p.n_walkers, p.seed, p.diagnostics, p.attrs, p.experiment)
    return [a.tobytes() for a in (p.draws, p.log_prob, p.log_likelihood)], repr(words), repr(p.sweeps)


def _recommendation(path: Path) -> object:
    return repr(load_recommendation(path.parent))


def _record(path: Path) -> object:
    """A record that no command reads back, as another program does that checks it."""
    kind = {"summary.json": "summary", "run.json": "run"}[path.name]
    for version in range(1, 10):
        try:
            return record_from_text(kind, version, path.read_text(encoding="utf-8"))
        except ValueError as error:
            said = str(error)
            if not said.startswith("format "):
                raise InputError(Fault(said, path)) from None
    raise InputError(Fault(said, path))


def _surrogate(path: Path) -> object:
    found = surrogate_from(path)
    return found.identity, found.info()


def _store(path: Path) -> object:
    try:
        with open_store(path, SETTINGS) as store:
            runs = [(point.tobytes(), {k: a.tobytes() for k, a in arrays.items()}, why) for point, arrays, why in store.runs()]
            return sorted(runs, key=lambda run: run[0])
    except StoreError as error:  # as the commands do
        raise InputError(Fault(str(error), path)) from None


#: File -> how it is loaded to what must not change.
KINDS: dict[str, Callable[[Path], object]] = {
    "run/posterior.nc": _posterior,
    "run/recommendation.json": _recommendation,
    "run/run.json": _record,
    "run/summary.json": _record,
    "surrogate.npz": _surrogate,
    "runs.sqlite": _store,
}


# --- damages ------------------------------------------------------------------------------------------------------------


def _place(data: bytes, rng: random.Random) -> int:
    """Anywhere, or, every second time, near an end."""
    near = min(len(data), 1024)
    return rng.choice(
        (rng.randrange(len(data)), rng.randrange(len(data)), rng.randrange(near), len(data) - 1 - rng.randrange(near))
    )


def _size(rng: random.Random) -> int:
    return rng.choice((1, 2, 8, 64, 512, 4096))


def _bit(data: bytes, rng: random.Random) -> bytes:
    at = _place(data, rng)
    return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]


def _overwritten(data: bytes, rng: random.Random) -> bytes:
    at, size = _place(data, rng), _size(rng)
    return data[:at] + rng.randbytes(min(size, len(data) - at)) + data[at + size :]


def _zeroed(data: bytes, rng: random.Random) -> bytes:
    at, size = _place(data, rng), _size(rng)
    return data[:at] + bytes(min(size, len(data) - at)) + data[at + size :]


def _doubled(data: bytes, rng: random.Random) -> bytes:
    at, size = _place(data, rng), _size(rng)
    return data[: at + size] + data[at:]


def _left_out(data: bytes, rng: random.Random) -> bytes:
    at = _place(data, rng)
    return data[:at] + data[at + _size(rng) :]


def _end_cut(data: bytes, rng: random.Random) -> bytes:
    return data[: _place(data, rng)]


def _end_zero(data: bytes, rng: random.Random) -> bytes:
    at = _place(data, rng)
    return data[:at] + bytes(len(data) - at)


def _beginning_cut(data: bytes, rng: random.Random) -> bytes:
    return data[_place(data, rng) + 1 :]


def _extended(data: bytes, rng: random.Random) -> bytes:
    return data + rng.choice((b"\n", bytes(4096), rng.randbytes(64), data))


def _text(_: bytes, rng: random.Random) -> bytes:
    return rng.choice(
        (b"time,force\n0,1\n", b" ", b"\xff\xfe\x00", b"{}", b"[1]", b"null", b"PK\x03\x04", b"\x89HDF\r\n\x1a\n")
    )


def _value(data: bytes, rng: random.Random) -> bytes:
    """JSON with another value, no value, or one key more at a random place; other files get a bit flipped."""
    try:
        record = json.loads(data)
    except ValueError:
        return _bit(data, rng)
    others: tuple[Any, ...] = (None, True, -1, 0, 1.5, "", "nan", [], {}, [None], {"a": 1}, float("nan"), float("inf"), 10**400)
    at = record
    while True:
        key = rng.choice(list(at) if isinstance(at, dict) else range(len(at)))
        if not isinstance(at[key], dict | list) or not at[key] or rng.random() < 0.3:
            break
        at = at[key]
    if rng.random() < 0.2 and isinstance(at, dict):
        at[f"{key} "] = at.pop(key)
    elif rng.random() < 0.2:
        del at[key]
    else:
        at[key] = rng.choice(others)
    return json.dumps(record, indent=1, ensure_ascii=False).encode()


def _monstrous(data: bytes, rng: random.Random) -> bytes:
    """JSON nested deeply, or with a number of five thousand digits; other files get a number of bytes of one kind."""
    if not data.startswith(b"{"):
        return rng.choice((b"[", b"\xff", b"9")) * 100_000
    return rng.choice((b"[" * 100_000, b'{"a":' * 100_000, data.rstrip()[:-1] + b', "more": ' + b"9" * 5000 + b"}\n"))


_DAMAGES = (
    *(_bit, _bit, _bit, _overwritten, _overwritten, _zeroed, _doubled, _left_out, _end_cut, _end_zero, _beginning_cut),
    *(_extended, _text, _value, _value, _monstrous),
)


def damaged(number: int, folder: Path) -> tuple[str, str, bytes]:
    """The damage of a number.

    Parameters
    ----------
    number : of the damage.
    folder : where `make_files` wrote the whole files.

    Returns
    -------
    Which file, what was done to it, and its bytes.
    """
    rng = random.Random(number)
    name = list(KINDS)[number % len(KINDS)]
    if rng.random() < 0.03:
        other = rng.choice([kind for kind in KINDS if kind != name])
        return name, f"is {other}", (folder / other).read_bytes()
    if rng.random() < 0.01 and name != "runs.sqlite":  # an empty store is one that was not begun
        return name, "empty", b""
    how = rng.choice(_DAMAGES)
    return name, how.__name__.strip("_"), how((folder / name).read_bytes(), rng)


# --- what comes of it ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Outcome:
    """What came of a damage: one of `OUTCOMES`, and what failed."""

    kind: str
    how: str
    outcome: str
    what: str = ""


def _loaded(path: Path, kind: str) -> str:
    """Hash of what is loaded from a file."""
    return sha256(repr(KINDS[kind](path)).encode()).hexdigest()


def try_one(number: int, whole: Path, copy: Path) -> Outcome:
    """Load the file with the damage of a number.

    Parameters
    ----------
    number : of the damage.
    whole : folder of the whole files.
    copy : a copy of it, in which the file is damaged and put back.
    """
    kind, how, data = damaged(number, whole)
    path = copy / kind
    if data == (whole / kind).read_bytes():
        return Outcome(kind, how, "harmless")
    path.unlink()  # a file that is written over waits for the disk
    path.write_bytes(data)
    try:
        same = _loaded(path, kind) == _loaded(whole / kind, kind)
        return Outcome(kind, how, "harmless" if same else "wrong", "" if same else "other content was loaded")
    except InputError as error:
        named = all(f.path is not None and f.path.name in {path.name, path.parent.name} and f.message for f in error.faults)
        return Outcome(kind, how, "refused" if named else "traceback", "" if named else f"no file is named: {error}")
    except Exception:
        return Outcome(kind, how, "traceback", traceback.format_exc(limit=-3))
    finally:
        for left in copy.glob("runs.sqlite-*"):
            left.unlink()
        path.unlink(missing_ok=True)
        shutil.copyfile(whole / kind, path)


def try_all(numbers: range, whole: Path, copy: Path) -> list[Outcome]:
    """Load the files with the damages of all numbers, in a process that may end; then another goes on.

    Parameters
    ----------
    numbers : of the damages.
    whole, copy : see `try_one`.
    """
    found: list[Outcome] = []
    spawn = multiprocessing.get_context("spawn")
    while len(found) < len(numbers):
        with ProcessPoolExecutor(1, mp_context=spawn) as pool:
            try:
                for number in numbers[len(found) :]:
                    found.append(pool.submit(try_one, number, whole, copy).result())
            except BrokenProcessPool:
                kind, how, _ = damaged(numbers[len(found)], whole)
                found.append(Outcome(kind, how, "crash", "the interpreter ended"))
                shutil.copyfile(whole / kind, copy / kind)
    return found


def main() -> None:
    """Run and print; exit code 1 if anything failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=2000, help="number of damages")
    parser.add_argument("--seed", type=int, default=0, help="number of the first damage")
    parser.add_argument("--again", type=int, help="do the damage of this number alone")
    asked = parser.parse_args()
    numbers = range(asked.seed, asked.seed + asked.n) if asked.again is None else range(asked.again, asked.again + 1)
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as temporary:
        whole, copy = Path(temporary) / "whole", Path(temporary) / "copy"
        whole.mkdir()
        make_files(whole)
        shutil.copytree(whole, copy)
        found = try_all(numbers, whole, copy)
    bad = [(n, o) for n, o in zip(numbers, found, strict=True) if o.outcome not in ("refused", "harmless")]
    for number, o in bad[:50]:
        print(f"number {number}, {o.kind}, {o.how}: {o.outcome}: {o.what}", file=sys.stderr)
    print(f"| file | damages | {' | '.join(OUTCOMES)} |")
    print("|---" * (len(OUTCOMES) + 2) + "|")
    for kind in (*KINDS, ""):
        counts = Counter(o.outcome for o in found if kind in ("", o.kind))
        print(f"| {kind or 'all'} | {sum(counts.values())} | {' | '.join(str(counts[o]) for o in OUTCOMES)} |")
    print(f"{len(found)} damages in {time.perf_counter() - start:.0f} s: {len(bad)} failed")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()

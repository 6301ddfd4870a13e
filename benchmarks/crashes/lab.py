"""A folder in, a small experiment with the results of its undisturbed runs out; and what a run folder says, to compare."""

from __future__ import annotations

import hashlib
import json
import shutil
import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from crashes.command import Ended, rehearse, run

DATA = Path(__file__).resolve().parents[2] / "datasets" / "padded_sensor" / "sensor1_instron.csv"
RECOMMEND = ("--force", "0.5 N", "--padding", "1 mm:2 mm", "--steps", "3", "--draws", "50")
_ACCURACY, _POINTS = 2e-2, 80
#: The words that train a surrogate on a store of runs, for a moment.
TRAIN = ("surrogate", "train", "--points", str(_POINTS), "--accuracy", str(_ACCURACY), "--steps", "1", "--store", "runs.sqlite")
#: Keys whose values are of the hour, the place or the way to the result, and not of the result.
_OF_THE_WAY = frozenset({"command", "started", "ended", "created", "written", "seconds", "duration", "path", "folder", "time"})

_EXPERIMENT = """name = "{name}"
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
[padding]
material = "sensor"
[priors]
young_modulus = {{ lognormal = ["0.62 MPa", 1.05] }}
machine_compliance = {{ fixed = "2.8 um/N" }}
force_noise = {{ fixed = "4.4 mN" }}
force_discrepancy = {{ fixed = 0.0014 }}
[[specimens]]
name = "a"
force = "{force}"
[specimens.priors]
sensor_thickness = {{ fixed = "0.74 mm" }}
padding_thickness = {{ fixed = "1.10 mm" }}
contact_offset = {{ normal = ["0.2107 mm", "0.001 mm"] }}
load_zero = {{ fixed = "0.343 N" }}
"""


@dataclass(frozen=True)
class Lab:
    """A folder to work in, and whether commands are started as they are installed, at full size."""

    folder: Path
    cold: bool = False

    @cached_property
    def log(self) -> Path:
        """Folder of what the commands print."""
        return self.folder / "log"

    @cached_property
    def surrogate(self) -> Path:
        """A copy of the shipped surrogate."""
        from models.surrogate import load_surrogate

        path = self.folder / "surrogate.npz"
        if not path.exists():
            shipped = next((Path(load_surrogate.__code__.co_filename).parent / "data").glob("neo*.npz"))
            shutil.copyfile(shipped, path)
        return path

    @cached_property
    def store(self) -> Path:
        """A training store: the path of one design told of all its designs, which is enough to be read and fitted."""
        from models.surrogate.points import design_points
        from models.surrogate.store import open_store
        from models.surrogate.training import run_point, store_settings

        path = self.folder / "store.sqlite"
        if not path.exists():
            ran = run_point(np.array([0.15, 0.2, 2.0, 1.0]), _ACCURACY)
            with open_store(path, store_settings(_ACCURACY)) as store:
                for point in design_points(_POINTS, seed=1):
                    store.add(point, ran.arrays)
        return path

    @cached_property
    def trained(self) -> Path:
        """The surrogate that is trained on the store."""
        place = self.folder / "trained"
        if not (place / "mine.npz").exists():
            shutil.rmtree(place, ignore_errors=True)
            place.mkdir(parents=True)
            shutil.copyfile(self.store, place / "runs.sqlite")
            if (ended := self.calib(place, *TRAIN, "-o", "mine.npz")).code != 0:
                raise RuntimeError(f"the undisturbed training ends with {ended.code}: {ended.text}")
        return place / "mine.npz"

    def fresh(self, name: str) -> Path:
        """An empty folder of this name with the experiment and its lab file in it."""
        place = self.folder / "cases" / name
        shutil.rmtree(place, ignore_errors=True)
        write_experiment(place)
        return place

    def calib(self, place: Path, *words: str) -> Ended:
        """Run a command in a folder to its end."""
        return run(words, place, self.log, cold=self.cold)

    def calibrate(self, *, seed: int = 5, processes: int = 0, output: str = "RUN") -> tuple[str, ...]:
        """The words that calibrate the small experiment."""
        return "calibrate", "experiment.toml", "-o", output, "--seed", str(seed), "--processes", str(processes)

    def reference(self, seed: int = 5, *, recommended: bool = False) -> Path:
        """The folder RUN of an undisturbed calibration, made once."""
        place = self.folder / f"reference-{seed}{'-recommended' * recommended}{'-cold' * self.cold}"
        if not (place / "done").exists():
            shutil.rmtree(place, ignore_errors=True)
            write_experiment(place)
            begun = time.monotonic()
            ended = self.calib(place, *self.calibrate(seed=seed))
            seconds = time.monotonic() - begun
            if ended.code not in (0, 3):
                raise RuntimeError(f"the undisturbed calibration ends with {ended.code}: {ended.text}")
            if recommended and (ended := self.calib(place, "recommend", "RUN", *RECOMMEND)).code not in (0, 3):
                raise RuntimeError(f"the undisturbed recommendation ends with {ended.code}: {ended.text}")
            (place / "done").write_text(json.dumps({"seconds": seconds}))
        return place / "RUN"

    def length(self, seed: int = 5) -> float:
        """Duration of the undisturbed calibration [s]."""
        return float(json.loads((self.reference(seed).parent / "done").read_text())["seconds"])

    def rehearse(self) -> None:
        """Run the commands once in this process, which will be forked for all others; not if they are started anew."""
        if not self.cold:
            place = self.fresh("rehearsal")
            on_run = (("recommend", "RUN", *RECOMMEND), *((command, "RUN") for command in ("report", "verify")))
            rehearse((self.calibrate(), *on_run, ("compare", "RUN", "RUN")), place)

    @cached_property
    def verifies(self) -> bool:
        """Whether there is a command `calib verify`."""
        return run(("verify", "--help"), self.folder, self.log).code == 0


def write_experiment(place: Path, *, name: str = "crash", force: str = "press.csv", rows: slice | None = None) -> None:
    """Write the small experiment: one press up to half a newton of a shipped file, one reading in ten, two unknowns.

    Parameters
    ----------
    place : folder, made if need be.
    name : of the experiment.
    force : name of its lab file.
    rows : which of its readings are kept; None for all.
    """
    place.mkdir(parents=True, exist_ok=True)
    (place / "experiment.toml").write_text(_EXPERIMENT.format(name=name, force=force), encoding="utf-8")
    lines = DATA.read_text(encoding="utf-8").splitlines()
    head, readings = lines[:6], lines[6::10]
    pressed = next(i for i, line in enumerate(readings) if float(line.split(",")[2]) < -0.83)
    kept = readings[: pressed + 1][rows or slice(None)]
    (place / force).write_text("\n".join([*head, *kept]) + "\n", encoding="utf-8")


def finished_copy(run_folder: Path, place: Path) -> None:
    """Copy a run, with the experiment beside it, into a folder that may be there."""
    shutil.copytree(run_folder.parent, place, dirs_exist_ok=True, ignore=shutil.ignore_patterns("done"))


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def draws(run_folder: Path) -> dict[str, str]:
    """Every array of posterior.nc, as name and hash: equal if and only if the arrays are, bit by bit."""
    found: dict[str, str] = {}

    def note(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            values = np.asarray(item[()])
            content = values.tobytes() if values.dtype != object else repr(values.tolist()).encode()
            found[name] = hashlib.sha256(f"{values.dtype}{values.shape}".encode() + content).hexdigest()

    with h5py.File(run_folder / "posterior.nc") as file:
        file.visititems(note)
    return found


def summary(path: Path) -> Any:
    """What a JSON file of a run says, without what is of the hour, the place or the way."""
    return _without(json.loads(path.read_text(encoding="utf-8")))


def _without(item: Any) -> Any:
    if isinstance(item, dict):
        return {k: _without(v) for k, v in item.items() if k not in _OF_THE_WAY}
    return [_without(v) for v in item] if isinstance(item, list) else item


def difference(run_folder: Path, reference: Path) -> str:
    """What a finished run says otherwise than the undisturbed one; nothing if it says the same.

    Parameters
    ----------
    run_folder : of the run that was disturbed.
    reference : of the one that was not.

    Returns
    -------
    A few words, empty if draws, summary and (if both have one) recommendation are the same.
    """
    missing = [n for n in ("posterior.nc", "summary.json", "summary.csv", "report.html") if not (run_folder / n).exists()]
    if missing:
        return f"{', '.join(missing)} not there"
    try:
        mine, theirs = draws(run_folder), draws(reference)
    except OSError as error:
        return f"posterior.nc cannot be read: {error}"
    other = sorted(n for n in mine.keys() | theirs.keys() if mine.get(n) != theirs.get(n))
    if other:
        return f"other draws in {len(other)} of {len(theirs)} arrays of posterior.nc, such as {other[0]}"
    for name in ("summary.json", "recommendation.json"):
        both = [folder / name for folder in (run_folder, reference)]
        if all(p.is_file() for p in both) and summary(both[0]) != summary(both[1]):
            return f"{name} says otherwise"
    return (
        "" if (run_folder / "summary.csv").read_bytes() == (reference / "summary.csv").read_bytes() else "summary.csv differs"
    )


def blocks(run_folder: Path) -> dict[str, tuple[int, str]]:
    """Blocks of the checkpoint that are whole: name to time of writing [ns] and content."""
    folder = run_folder / "checkpoint"
    return {p.name: (p.stat().st_mtime_ns, digest(p)) for p in folder.glob("ensemble-*.npz") if ".part" not in p.name}

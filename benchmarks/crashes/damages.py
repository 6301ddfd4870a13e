"""A number in, what each command makes of a run folder or an input that was damaged accordingly out."""

from __future__ import annotations

import random
import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from crashes.case import Case, failed, with_verdict
from crashes.command import Ended, run
from crashes.lab import RECOMMEND, TRAIN, Lab, difference, digest, summary, write_experiment

INPUTS = ("experiment.toml", "press.csv", "surrogate.npz")
STORE = "runs.sqlite"
COMMANDS = ("resume", "report", "recommend", "compare")
#: Commands that read a file, where it is not for all of them.
_READ_BY = {"surrogate.npz": ("resume", "info", "recommend", "report"), STORE: ("train",)}


def _flip(data: bytes, rng: random.Random) -> bytes:
    place = rng.randrange(len(data))
    return data[:place] + bytes([data[place] ^ (1 << rng.randrange(8))]) + data[place + 1 :]


def _digit(data: bytes, rng: random.Random) -> bytes:
    digits = [i for i, byte in enumerate(data) if 48 <= byte <= 57]
    place = rng.choice(digits)
    other = rng.choice([d for d in range(48, 58) if d != data[place]])
    return data[:place] + bytes([other]) + data[place + 1 :]


def _byte(data: bytes, rng: random.Random) -> bytes:
    place = rng.randrange(len(data))
    return data[:place] + bytes([(data[place] + rng.randrange(1, 256)) % 256]) + data[place + 1 :]


def _cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data))]


def _zeros(data: bytes, rng: random.Random) -> bytes:
    length = min(len(data), rng.choice((8, 64, 512, 4096)))
    place = rng.randrange(len(data) - length + 1)
    return data[:place] + bytes(length) + data[place + length :]


def _noise(data: bytes, rng: random.Random) -> bytes:
    length = min(len(data), rng.choice((4, 16, 64, 512)))
    place = rng.randrange(len(data) - length + 1)
    return data[:place] + rng.randbytes(length) + data[place + length :]


def _without_piece(data: bytes, rng: random.Random) -> bytes:
    place = rng.randrange(len(data))
    return data[:place] + data[place + rng.choice((1, 16, 512)) :]


#: What may be done to the bytes of a file. Twice in the list: twice as often.
DAMAGES: dict[str, Callable[[bytes, random.Random], bytes]] = {
    "bit flipped": _flip,
    "byte changed": _byte,
    "digit changed": _digit,
    "cut": _cut,
    "zeros": _zeros,
    "noise": _noise,
    "a piece taken out": _without_piece,
    "longer": lambda data, rng: data + rng.randbytes(rng.choice((1, 100))),
    "emptied": lambda data, _: b"",
}
_OTHERS = ("deleted", "from a run of another seed", "from a run of other data", "a folder")


@dataclass(frozen=True)
class Stage:
    """The one folder in which all damages are done, as a run knows where its inputs lie; copies of it and of other runs."""

    place: Path
    whole: Path
    other_seed: Path
    other_data: Path

    def restore(self) -> None:
        """Make it whole again."""
        shutil.rmtree(self.place, ignore_errors=True)
        shutil.copytree(self.whole, self.place)


def size(lab: Lab, asked: int) -> int:
    """As many as asked for."""
    return asked


def words_of(command: str, lab: Lab) -> tuple[str, ...]:
    """The words of a command on the run of the stage."""
    return {
        "resume": (*lab.calibrate(), "--surrogate", "surrogate.npz", "--resume"),
        "report": ("report", "RUN"),
        "recommend": ("recommend", "RUN", *RECOMMEND),
        "compare": ("compare", "RUN", "RUN"),
        "verify": ("verify", "RUN"),
        "train": (*TRAIN, "-o", "mine.npz"),
        "info": ("surrogate", "info", "--surrogate", "surrogate.npz"),
    }[command]


def make_stage(lab: Lab) -> Stage:
    """The stage, and a recommended run with a surrogate of its own that was made on it; made once."""
    root = lab.folder / "damages"
    stage = Stage(root / "stage", root / "whole", root / "other_seed", root / "other_data")
    if not stage.whole.exists():
        _make(lab, stage, stage.whole, seed=5)
    return stage


def _make(lab: Lab, stage: Stage, target: Path, *, seed: int, rows: slice | None = None) -> None:
    shutil.rmtree(stage.place, ignore_errors=True)
    write_experiment(stage.place, rows=rows)
    shutil.copyfile(lab.surrogate, stage.place / "surrogate.npz")
    for words in ((*lab.calibrate(seed=seed), "--surrogate", "surrogate.npz"), words_of("recommend", lab)):
        if (ended := lab.calib(stage.place, *words)).code not in (0, 3):
            raise RuntimeError(f"undisturbed {words[0]} ends with {ended.code}: {ended.text}")
    stage.place.rename(target)


def _other(lab: Lab, stage: Stage, damage: str) -> Path:
    """A run of another seed or of other data, made once on the same stage."""
    target = stage.other_seed if "seed" in damage else stage.other_data
    if not target.exists():
        _make(lab, stage, target, seed=6 if "seed" in damage else 5, rows=None if "seed" in damage else slice(1, None))
        stage.restore()
    return target


def said(lab: Lab, stage: Stage, command: str) -> str:
    """What a command says on the undamaged stage."""
    path = stage.whole.parent / f"{command}.said"
    if not path.exists():
        stage.restore()
        path.write_text(lab.calib(stage.place, *words_of(command, lab)).text, encoding="utf-8")
    return path.read_text(encoding="utf-8")


def files(stage: Stage) -> list[str]:
    """One name of every kind of file, inputs and those of the run folder; of blocks of the checkpoint and their starts, all."""
    found = [str(p.relative_to(stage.whole)) for p in sorted((stage.whole / "RUN").rglob("*")) if p.is_file()]
    return [*INPUTS, STORE, *found]


def case(lab: Lab, number: int) -> Case:
    """Damage one file, and run `verify` and one command more on it.

    Parameters
    ----------
    lab : where.
    number : decides the file, the damage and the command.

    Returns
    -------
    What came of it.
    """
    rng = random.Random(number)
    stage = make_stage(lab)
    names = files(stage)
    kinds = _kinds(names)
    name = rng.choice(kinds[rng.choice(sorted(kinds))])
    damage = rng.choice((*DAMAGES, *_OTHERS))
    command = rng.choice(_READ_BY.get(name, COMMANDS))
    usual = "" if command == "train" else said(lab, stage, command)
    stage.restore()
    path = stage.place / name
    if name == STORE:
        shutil.copyfile(lab.store, path)
    before = path.read_bytes()
    if damage in _OTHERS[1:3]:
        other = lab.trained if name == "surrogate.npz" else _other(lab, stage, damage) / name
        path.write_bytes(other.read_bytes() if other.exists() else before)
    else:
        _damage(path, damage, before, rng)
    done = Case("damages", number, f"{name} {damage}, {command}")
    if path.is_file() and path.read_bytes() == before:
        return with_verdict(done, "right", "the damage changes nothing")
    covered = "lock" not in name and name != STORE  # a lock holds nothing, and no run rests on a store
    if lab.verifies:
        verified = run(words_of("verify", lab), stage.place, lab.log)
        if bad := failed(done, verified, (Path(name).name,) if covered else ()):
            return bad
        if verified.code == 0 and covered:
            return with_verdict(done, "wrong", f"verify says that all is well: {verified.last}")
        done = replace(done, note=f"verify {verified.code}")
    ended = lab.calib(stage.place, *words_of(command, lab))
    if bad := failed(done, ended, (Path(name).name, Path(name).parent.name or "experiment", "RUN")):
        return bad
    done = with_verdict(done, "right", f"[{ended.code}]")
    wrong = "" if ended.code in (1, 2) else _silent(command, name, stage, lab, ended, usual)
    return with_verdict(done, "wrong", wrong) if wrong else done


def _kinds(names: list[str]) -> dict[str, list[str]]:
    """Names that differ in their numbers alone, together."""
    found: dict[str, list[str]] = {}
    for name in names:
        found.setdefault(re.sub(r"\d+", "#", name), []).append(name)
    return found


def _damage(path: Path, damage: str, before: bytes, rng: random.Random) -> None:
    if damage in _OTHERS:
        path.unlink()
        if damage == "a folder":
            path.mkdir()
    elif before and not (damage == "digit changed" and not re.search(rb"\d", before)):
        path.write_bytes(DAMAGES[damage](before, rng))


def _silent(command: str, name: str, stage: Stage, lab: Lab, ended: Ended, usual: str) -> str:
    """What a command that ended well shows otherwise, or does not say, though it should; nothing if all is well."""
    run_folder, whole = stage.place / "RUN", stage.whole / "RUN"
    named = Path(name).name in re.sub(r"[\s│]+", "", ended.text)
    if command == "resume":
        if (stage.place / name).exists() and name in INPUTS and digest(stage.place / name) != digest(stage.whole / name):
            return "" if named else f"goes on although {name} has changed, without a word: {ended.last}"
        return difference(run_folder, whole)
    if command == "train":
        same = (stage.place / "mine.npz").read_bytes() == lab.trained.read_bytes()
        return "" if named or same else f"another surrogate without a word on {name}: {ended.last}"
    if command in ("compare", "info"):
        return "" if named or ended.text == usual else f"says otherwise without a word on {name}: {ended.last}"
    if command == "recommend":
        same = summary(run_folder / "recommendation.json") == summary(whole / "recommendation.json")
        return "" if named or same else f"recommends otherwise without a word on {name}: {ended.last}"
    changed = name in INPUTS[:2] and (stage.place / name).is_file()
    page = _page(run_folder / "report.html")
    if page == _page(whole / "report.html"):
        return f"{name} has changed and neither page nor command says so" if changed and not named else ""
    return "" if named or Path(name).name in page else f"another page without a word on {name}: {ended.last}"


def _page(path: Path) -> str:
    return re.sub(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d)?", "", path.read_text(encoding="utf-8"))


def single_bytes(lab: Lab, number: int) -> Case:
    """Change one byte of a file of the run or of an input, and ask `verify` alone.

    Parameters
    ----------
    lab : where.
    number : decides the file and the byte.

    Returns
    -------
    What came of it.
    """
    rng = random.Random(10**6 + number)
    stage = make_stage(lab)
    stage.restore()
    names = [n for n in files(stage) if "lock" not in n and n != STORE and (stage.place / n).stat().st_size]
    kinds = _kinds(names)
    name = rng.choice(kinds[sorted(kinds)[number % len(kinds)]])
    path = stage.place / name
    damage = rng.choice((_flip, _byte, _digit if name.endswith((".json", ".csv", ".toml")) else _byte))
    path.write_bytes(damage(path.read_bytes(), rng))
    done = Case("bytes", number, f"one byte of {name}")
    verified = run(words_of("verify", lab), stage.place, lab.log)
    if bad := failed(done, verified, (path.name,)):
        return bad
    if verified.code == 0:
        return with_verdict(done, "wrong", "verify says that all is well")
    named = path.name in re.sub(r"[\s│]+", "", verified.text)
    return with_verdict(done, "right" if named else "bad refusal", f"[{verified.code}] {verified.last[-120:]}")

"""Read mutated lab files until something breaks: `python benchmarks/fuzz_readers.py -n 100000 --processes 2`.

Each file is one of the test corpus, or of the folder --seeds, after one to four mutations; for one in three, what is said of
it (units, columns, sheet, ...) is drawn, too. Zip archives, as workbooks are, are mutated as they are or within one of their
members. A reader must read the file or refuse it by `InputError`, within 2 s; anything else is printed with its seed, and
its bytes are kept. `--again SEED` reads the one file of a seed, and says what came.
"""

from __future__ import annotations

import argparse
import io
import random
import signal
import sys
import tempfile
import time
import traceback
import warnings
import zipfile
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import FrameType

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "calib" / "lab"))

from lab_corpus import corpus

from calib.errors import InputError
from calib.lab import AS_FOUND, Reading, read_lab_file

#: A file that takes longer is a failure [s of the processor]; the watchdog ends it at twice that.
LIMIT = 2.0

_INTERESTING = (
    b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\r", b"\n", b"\t", b";", b",", b".", b'"', b"'", b"(", b")", b"[", b"]", b"|",
    b"-", b"1e400", b"1e-400", b"9.9E37", b"999999", b"nan", b"inf", b"-inf", b"OVER", b"0x1F", b"1_000", b"1,000",
    b"1.000.000,5", b"(kN)", b"(m^2)", b"(**)", b"(1/0)", b"(a" + b"*a" * 40 + b")", b"(10**10**10)", b"(degC)", b"()", b"[[[[",
    b"%s%n", b"{0}", "\u00b5m".encode(), "\u0660\u0661".encode(), "\u00b2".encode(), "\uff11\uff12".encode(),
    "\u2028".encode(), "\u0085".encode(), b"Time", b"Load (N)", b"Time (s),Extension (mm),Load (N)\n", b"Specimen 2\n",
    b"MTS793|MPT|DEU|1|2|,|.|:|1|0|0|A\n", b"sep=;\n", b"Results Table 1\n", b"Units : Load,kN\n", b"\x1a", b"\x0c", b"\x0b",
    b"\xa0", b"\xe2\x88\x92",
)  # fmt: skip
_HUGE = (b"9", b"a", b"1,", b" ", b"1 ", b".", b"e", b'"', b"(", b"1.", b"\xc2\xa0")


@dataclass(frozen=True)
class Outcome:
    """Counts of a run: files read, files refused, what failed (one text each), and the slowest file [s] with its seed."""

    read: int
    refused: int
    failures: tuple[str, ...]
    slowest: float
    slowest_seed: int


@dataclass(frozen=True)
class Seed:
    """A file to be mutated: its bytes, and the ending of its name, by which a reader may go."""

    data: bytes
    suffix: str


@dataclass(frozen=True)
class Mutated:
    """A mutated file, and what is said of it."""

    data: bytes
    suffix: str
    reading: Reading


@cache
def _files(folder: Path | None) -> tuple[Seed, ...]:
    if folder is None:
        return tuple(Seed(v.data, ".csv") for v in (*corpus(12), *corpus(60)[::7]))
    return tuple(Seed(v.read_bytes(), v.suffix) for v in sorted(folder.rglob("*")) if v.is_file())


def _flip(data: bytearray, rng: random.Random) -> bytearray:
    for _ in range(rng.choice((1, 1, 3, 20))):
        if data:
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return data


def _insert(data: bytearray, rng: random.Random) -> bytearray:
    at = rng.randrange(len(data) + 1)
    data[at:at] = rng.choice(_INTERESTING)
    return data


def _delete(data: bytearray, rng: random.Random) -> bytearray:
    at = rng.randrange(len(data) + 1)
    del data[at : at + rng.choice((1, 2, 7, 40, 400))]
    return data


def _duplicate(data: bytearray, rng: random.Random) -> bytearray:
    at = rng.randrange(len(data) + 1)
    part = data[at : at + rng.choice((1, 5, 40, 400))]
    data[at:at] = part * rng.choice((1, 1, 2, 30))
    return data


def _splice(data: bytearray, rng: random.Random) -> bytearray:
    other = rng.choice(_files(None)).data
    return data[: rng.randrange(len(data) + 1)] + other[rng.randrange(len(other) + 1) :]


def _recode(data: bytearray, rng: random.Random) -> bytearray:
    codecs = ("utf-8", "latin-1", "utf-16", "utf-16-le", "utf-16-be", "gbk", "shift_jis", "utf-32", "cp1252")
    text = bytes(data).decode(rng.choice(codecs), errors="replace")
    return bytearray(text.encode(rng.choice(codecs), errors="replace"))


def _digits(data: bytearray, rng: random.Random) -> bytearray:
    places = [i for i, c in enumerate(data) if 48 <= c <= 57]
    for i in rng.sample(places, min(len(places), rng.choice((1, 4, 30)))):
        data[i] = rng.choice(b"0123456789.,eE-+ ")
    return data


def _shuffle(data: bytearray, rng: random.Random) -> bytearray:
    lines = bytes(data).splitlines(keepends=True)
    start = rng.randrange(len(lines) + 1)
    part = lines[start : start + rng.choice((2, 5, 400))]
    rng.shuffle(part)
    return bytearray(b"".join(lines[:start] + part + lines[start + len(part) :]))


def _huge_cell(data: bytearray, rng: random.Random) -> bytearray:
    at = rng.randrange(len(data) + 1)
    data[at:at] = rng.choice(_HUGE) * rng.choice((100, 5000, 100_000))
    return data


def _delimiters(data: bytearray, rng: random.Random) -> bytearray:
    old, new = rng.sample((b",", b";", b"\t", b" ", b"|", b"\n", b".", b'"'), 2)
    return bytearray(bytes(data).replace(old, new * rng.choice((1, 1, 2, 50)), rng.choice((1, 5, -1))))


def _repeat(data: bytearray, rng: random.Random) -> bytearray:
    return bytearray(bytes(data) * rng.choice((2, 3, 20)))


def _repeat_line(data: bytearray, rng: random.Random) -> bytearray:
    lines = bytes(data).splitlines(keepends=True) or [b"\n"]
    at = rng.randrange(len(lines))
    lines[at:at] = [lines[at]] * rng.choice((1, 3, 500, 3000))
    return bytearray(b"".join(lines))


_MUTATIONS: tuple[Callable[[bytearray, random.Random], bytearray], ...] = (
    _flip, _insert, _insert, _delete, _duplicate, _splice, _recode, _digits, _shuffle, _huge_cell, _delimiters, _repeat,
    _repeat_line,
)  # fmt: skip


_QUANTITIES = ("time", "displacement", "force", "capacitance", "dissipation", "frequency", "cycle", "mass")
_UNITS = ("s", "ms", "mm", "N", "kN", "gf", "pF", "F", "%", "", "degC", "m^2", "\u00b5m")
_NAMES = ("1", "2", "3", "99", "-1", "", "Load", "Time (s)", "Frequency (Hz)", "Cp", "no such column", "Specimen", "\x00")
_VALUES = ("1", "1000", "1e3", "", "A", "nan", "100 kHz")
_SIGNS = ("compression positive", "compression negative", "positive")


def _reading(rng: random.Random) -> Reading:
    """Something said of a file, mostly one thing."""

    def some(keys: Sequence[str], values: Sequence[str]) -> dict[str, str]:
        return {rng.choice(keys): rng.choice(values) for _ in range(rng.choice((0, 0, 0, 0, 1, 1, 2)))}

    def one(values: Sequence[str]) -> str:
        return rng.choice(values) if rng.random() < 0.2 else ""

    return Reading(
        units=some(_QUANTITIES, _UNITS),
        columns=some(_QUANTITIES, _NAMES),
        specimen=rng.choice((None, None, None, None, 0, 1, 2, 9)),
        where=some(_NAMES, _VALUES),
        sheet=one(("Sheet1", "Data", "2", "no such sheet")),
        sign=some(("force", "displacement"), _SIGNS),
        scale=one(("micro", "nano")),
        decimal=one((".", ",", ";")),
    )


def _within(data: bytes, rng: random.Random) -> bytes:
    """A zip archive with one of its members mutated, and the sums of it right."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as archive, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as new:
        names = archive.namelist()
        chosen = rng.choice(names)
        for name in names:
            member = archive.read(name)
            new.writestr(name, bytes(_changed(bytearray(member), rng)) if name == chosen else member)
    return out.getvalue()


def _changed(data: bytearray, rng: random.Random) -> bytearray:
    for _ in range(rng.choice((1, 1, 2, 4))):
        data = rng.choice(_MUTATIONS)(data, rng)[:1_000_000]
    return data


def mutated(seed: int, folder: Path | None = None) -> Mutated:
    """The file of a seed.

    Parameters
    ----------
    seed : its number.
    folder : where the files are that are mutated; None for the test corpus.

    Returns
    -------
    The file, and what is said of it.
    """
    rng = random.Random(seed)
    chosen = rng.choice(_files(folder))
    if zipfile.is_zipfile(io.BytesIO(chosen.data)) and rng.random() < 0.7:
        data = _within(chosen.data, rng)
    else:
        data = bytes(_changed(bytearray(chosen.data), rng))
    return Mutated(data, chosen.suffix, _reading(rng) if rng.random() < 1 / 3 else AS_FOUND)


class TooSlowError(BaseException):
    """Raised by the watchdog; no reader can catch it as an `Exception`."""


def _bark(_signal: int, _frame: FrameType | None) -> None:
    raise TooSlowError


def read_once(data: bytes, path: Path, reading: Reading = AS_FOUND) -> tuple[str, float, str]:
    """Read one file.

    Parameters
    ----------
    data : its bytes.
    path : where they are written.
    reading : what is said of it.

    Returns
    -------
    "read", "refused" or "failed", the seconds of the processor it took, and what failed.
    """
    path.unlink(missing_ok=True)  # a file that is written over waits for the disk
    path.write_bytes(data)
    before = signal.signal(signal.SIGPROF, _bark)
    signal.setitimer(signal.ITIMER_PROF, 2 * LIMIT)
    start = time.process_time()
    outcome, what = "read", ""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            table = read_lab_file(path, reading)
        lengths = {len(v) for v in table.columns.values()} | {len(table.lines), len(table.reasons)}
        if len(lengths) != 1:
            outcome, what = "failed", f"columns, lines and reasons have the lengths {sorted(lengths)}"
    except InputError as error:
        outcome = "refused"
        if not error.faults or not all(f.message for f in error.faults):
            outcome, what = "failed", "a refusal without a reason"
    except TooSlowError:
        outcome, what = "failed", f"not done after {2 * LIMIT:g} s of the processor"
    except Exception:
        outcome, what = "failed", traceback.format_exc(limit=-3)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
    seconds = time.process_time() - start
    if outcome != "failed" and seconds > LIMIT:
        outcome, what = "failed", f"took {seconds:.2f} s"
    return outcome, seconds, what


def _run(seeds: Sequence[int], saved: Path, files: Path | None) -> Outcome:
    read = refused = slowest_seed = 0
    slowest = 0.0
    failures: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        for seed in seeds:
            one = mutated(seed, files)
            outcome, seconds, what = read_once(one.data, Path(folder) / f"lab{one.suffix}", one.reading)
            read += outcome == "read"
            refused += outcome == "refused"
            if seconds > slowest:
                slowest, slowest_seed = seconds, seed
            if outcome == "failed":
                kept = saved / f"fuzz_{seed}{one.suffix}"
                kept.write_bytes(one.data)
                failures.append(f"seed {seed}, {len(one.data)} bytes in {kept}, {one.reading}: {what}")
    return Outcome(read, refused, tuple(failures), slowest, slowest_seed)


def fuzz(n: int, seed: int, saved: Path, processes: int = 1, files: Path | None = None) -> Outcome:
    """Read mutated files of the seeds seed, seed + 1, ...

    Parameters
    ----------
    n : how many.
    seed : the first seed.
    saved : where files that fail are written.
    processes : how many run side by side.
    files : folder of the files that are mutated; None for the test corpus.

    Returns
    -------
    What came of them.
    """
    saved.mkdir(parents=True, exist_ok=True)
    seeds = range(seed, seed + n)
    parts: Iterable[Outcome]
    if processes == 1:
        parts = [_run(seeds, saved, files)]
    else:
        chunks = [seeds[i : i + 500] for i in range(0, n, 500)]
        with ProcessPoolExecutor(processes) as pool:
            parts = list(pool.map(_run, chunks, [saved] * len(chunks), [files] * len(chunks)))
    done = list(parts)
    slow = max(done, key=lambda o: o.slowest)
    return Outcome(
        sum(o.read for o in done),
        sum(o.refused for o in done),
        tuple(f for o in done for f in o.failures),
        slow.slowest,
        slow.slowest_seed,
    )


def main() -> None:
    """Run and print; exit code 1 if anything failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=100_000, help="number of files")
    parser.add_argument("--seed", type=int, default=1, help="seed of the first file, the next is one more")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--saved", type=Path, default=Path("fuzz_failures"), help="folder for the files that fail")
    parser.add_argument("--seeds", type=Path, help="folder of the files that are mutated, instead of the test corpus")
    parser.add_argument("--again", type=int, help="read the file of this seed only")
    options = parser.parse_args()
    if options.again is not None:
        options.saved.mkdir(parents=True, exist_ok=True)
        print(_run([options.again], options.saved, options.seeds))
        return
    start = time.perf_counter()
    if options.seeds is not None and not _files(options.seeds):
        parser.error(f"no files in {options.seeds}")
    outcome = fuzz(options.n, options.seed, options.saved, options.processes, options.seeds)
    for failure in outcome.failures[:50]:
        print(failure, file=sys.stderr)
    print(
        f"{options.n} files in {time.perf_counter() - start:.0f} s: {outcome.read} read, {outcome.refused} refused, "
        f"{len(outcome.failures)} failed; the slowest took {outcome.slowest:.2f} s (seed {outcome.slowest_seed})"
    )
    sys.exit(1 if outcome.failures else 0)


if __name__ == "__main__":
    main()

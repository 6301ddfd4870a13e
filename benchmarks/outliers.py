"""What single wrong readings do to a modulus: outliers and bursts planted in the shipped lab files.

    OMP_NUM_THREADS=1 python benchmarks/outliers.py --seeds 12

Readings of force and capacitance get errors of a number of standard deviations of their noise, at random or several in a row,
on top of the noise they have. The files are read and reduced as always and answered by `calib.first_answer`. Printed for each
kind: labs that were refused; by how much the modulus of the others moves from that of the files as they are, in its standard
deviations there, on average, root mean square, and what the wider standard deviations say that it should be; the force noise.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib.errors import InputError
from calib.experiment import forward_of_experiment, read_experiment, read_sweeps
from calib.problem import build_problem
from calib.sampling import FirstAnswer, first_answer
from models.threads import one_thread

DATASET = Path(__file__).parents[1] / "datasets" / "padded_sensor"
#: Lines above the readings of each file, and the column, format and noise [units of the file] of what is measured.
FILES: Mapping[str, tuple[int, int, str, float]] = {
    "sensor1_instron.csv": (6, 2, ".3f", 5e-3),
    "sensor2_instron.csv": (6, 2, ".3f", 5e-3),
    "sensor1_lcr.csv": (2, 1, ".3f", 10e-3),
    "sensor2_lcr.csv": (2, 1, ".3f", 10e-3),
}


@dataclass(frozen=True)
class Kind:
    """Share of readings that are wrong, by how many standard deviations, in rows of how many, and whether all to one side."""

    share: float
    size: float
    run: int = 1
    one_side: bool = False


#: What is planted, by name.
KINDS: Mapping[str, Kind] = {
    "1 % at 10 sd": Kind(0.01, 10.0),
    "1 % at 10 sd, to one side": Kind(0.01, 10.0, one_side=True),
    "1 % at 50 sd": Kind(0.01, 50.0),
    "5 % at 10 sd": Kind(0.05, 10.0),
    "a burst of ten at 10 sd": Kind(0.0, 10.0, 10),
    "a burst of ten at 50 sd": Kind(0.0, 50.0, 10),
}


def planted(source: Path, target: Path, kind: Kind, rng: np.random.Generator) -> None:
    """Copy a file with some of its readings wrong."""
    head, column, form, noise = FILES[source.name]
    lines = source.read_text(encoding="utf-8").splitlines()
    n = len(lines) - head
    wrong = rng.random(n) < kind.share
    if kind.run > 1:  # on the way down, which is what is used
        first = int(rng.integers(n // 10, n * 2 // 5))
        wrong[first : first + kind.run] = True
    sides = np.ones(n) if kind.one_side or kind.run > 1 else rng.choice([-1.0, 1.0], n)
    if kind.run > 1:
        sides *= rng.choice([-1.0, 1.0])
    for k in np.flatnonzero(wrong):
        cells = lines[head + k].split(",")
        cells[column] = f"{float(cells[column]) + sides[k] * kind.size * noise:{form}}"
        lines[head + k] = ",".join(cells)
    target.write_text("\n".join(lines) + "\n", encoding="utf-8")


def answered(folder: Path) -> FirstAnswer:
    """The first answer to the files of a folder."""
    experiment = read_experiment(folder / "experiment.toml")
    return first_answer(build_problem(experiment, read_sweeps(experiment), forward_of_experiment(experiment)))


def table(kinds: Sequence[str], seeds: int) -> Iterator[str]:
    """Lines of a table in Markdown, one for each kind."""
    clean = answered(DATASET).parameters
    own, noise = clean["young_modulus"], clean["force_noise"].mean
    yield "| planted | labs | refused | modulus off, mean sd | rms | expected | its sd, times | force noise, times |"
    yield "|---|---|---|---|---|---|---|---|"
    for name in kinds:
        off, wider, noisier = [], [], []
        for seed in range(seeds):
            rng = np.random.default_rng([seed, 20190304])
            with tempfile.TemporaryDirectory() as made:
                folder = Path(made)
                shutil.copy(DATASET / "experiment.toml", folder)
                for file in FILES:
                    planted(DATASET / file, folder / file, KINDS[name], rng)
                try:
                    found = answered(folder).parameters
                except InputError:
                    continue
            off.append((found["young_modulus"].mean - own.mean) / own.sd)
            wider.append(found["young_modulus"].sd / own.sd)
            noisier.append(found["force_noise"].mean / noise)
        if not off:
            yield f"| {name} | {seeds} | {seeds} | | | | | |"
            continue
        # What is added to the errors of the files as they are adds as much to their variance.
        expected = np.sqrt(max(float(np.mean(np.square(wider))) - 1, 0.0))
        size = f"{np.mean(off):+.2f} | {np.sqrt(np.mean(np.square(off))):.2f} | {expected:.2f}"
        refused = seeds - len(off)
        yield f"| {name} | {seeds} | {refused} | {size} | {np.mean(wider):.2f} | {np.mean(noisier):.1f} |"


def main(words: Sequence[str] | None = None) -> None:
    """Plant what is asked for and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"all, or some of: {'; '.join(KINDS)}".replace("%", "%%"))
    parser.add_argument("--seeds", type=int, default=12, help="of each kind")
    given = parser.parse_args(words)
    if unknown := [name for name in given.kinds if name not in KINDS]:
        parser.error(f"there is no kind {unknown[0]!r}; choose from: {'; '.join(KINDS)}")
    with one_thread():
        for line in table(given.kinds or list(KINDS), given.seeds):
            print(line, flush=True)


if __name__ == "__main__":
    main()

"""Change lab files, knowing what may be read of them, and hold the reader to it: `nice python benchmarks/mutate_lab_files.py`.

Each mutant is a real file after one change or two (a header, a unit, a decimal mark, a cell, a row, a sign, lines, encoding),
and carries along what each of its numbers means. A reader must give exactly that, leave out changed rows with a reason, name
what it does not use, or refuse the file with advice; anything else is SILENT. Files are those of --folder that are read as they
are, and those of datasets/padded_sensor. With -o the verdicts are kept, and a run that was stopped goes on. `--again SEED`
writes the mutant of a seed and says what came of it.
"""

from __future__ import annotations

import argparse
import csv
import random
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from mutants import of_columns, of_files, of_names, of_numbers, of_rows, of_scale, of_signs, of_time
from mutants.document import Document, written
from mutants.kind import Kind
from mutants.take_apart import take_apart, thinned
from mutants.verdict import FAILURES, VERDICTS, judge

from calib.errors import InputError

ROOT = Path(__file__).resolve().parents[1]
KINDS: tuple[Kind, ...] = tuple(
    k for m in (of_names, of_columns, of_numbers, of_rows, of_scale, of_signs, of_time, of_files) for k in m.KINDS
)
FIELDS = ("seed", "file", "rows", "kinds", "readable", "verdict", "counts_for", "seconds", "what")
_SIZES = ({"step": 1, "most": 120}, {"step": 12, "most": 300}, {"step": 25, "most": 150}, {"step": 7, "most": 400})


@dataclass(frozen=True)
class Mutant:
    """A mutant, what it was after its first change, the document that it was made of, and the kinds of its changes."""

    doc: Document
    first: Document
    plain: Document
    kinds: tuple[Kind, ...]


@cache
def documents(folder: Path) -> tuple[Document, ...]:
    """Files that can be mutated: all that are read as they are, in several lengths."""
    paths = [*sorted(folder.rglob("*.csv")), *sorted((ROOT / "datasets" / "padded_sensor").glob("*.csv"))]
    found = []
    for path in paths:
        try:
            doc = take_apart(path)
        except InputError:
            continue
        if isinstance(doc, str):
            print(f"left out: {doc}", file=sys.stderr)
            continue
        found.append(doc)
    return tuple(found)


def mutant(seed: int, folder: Path, only: Sequence[str] = ()) -> Mutant:
    """The mutant of a seed.

    Parameters
    ----------
    seed : its number.
    folder : where the files are.
    only : kinds of which the first change is one; none for all.

    Returns
    -------
    The mutant, what it was made of and its kinds.
    """
    rng = random.Random(seed)
    while True:
        plain = rng.choice(documents(folder))
        if rng.random() < 0.97:
            size = rng.choice(_SIZES)
            plain = thinned(plain, size if len(plain.body) > 30 * size["step"] else _SIZES[0])
        doc = plain
        steps: list[Document] = []
        kinds: list[Kind] = []
        for n in range(rng.choice((1, 2))):
            kind = rng.choice([k for k in KINDS if k not in kinds and (n or not only or k.name in only)])
            changed = kind.change(doc, rng)
            if changed is not None:
                doc, steps, kinds = changed, [*steps, changed], [*kinds, kind]
            if kinds and kinds[-1].last:
                break
        if kinds and (not only or kinds[0].name in only):
            return Mutant(doc, steps[0], plain, tuple(kinds))


def verdict_row(seed: int, folder: Path, only: Sequence[str], work: Path) -> dict[str, str]:
    """What came of the mutant of a seed, as a row of the table of results.

    Parameters
    ----------
    seed, folder, only : as of `mutant`.
    work : where the file is written.

    Returns
    -------
    A text for each of `FIELDS`.
    """
    made = mutant(seed, folder, only)
    start = time.process_time()
    verdict = judge(made.doc, made.plain, work)
    counts_for = made.kinds
    if len(made.kinds) > 1 and verdict.verdict in FAILURES:
        by_first = judge(made.first, made.plain, work).verdict in FAILURES
        counts_for = made.kinds[:1] if by_first else made.kinds[1:]
    return {
        "seed": str(seed),
        "file": made.doc.path.name,
        "rows": str(len(made.doc.rows())),
        "kinds": " + ".join(k.name for k in made.kinds),
        "readable": "yes" if all(k.readable for k in made.kinds) else "",
        "verdict": verdict.verdict,
        "counts_for": " + ".join(k.name for k in counts_for),
        "seconds": f"{time.process_time() - start:.3f}",
        "what": verdict.what,
    }


def _part(seeds: Sequence[int], folder: Path, only: Sequence[str]) -> list[dict[str, str]]:
    with tempfile.TemporaryDirectory() as work:
        return [verdict_row(seed, folder, only, Path(work)) for seed in seeds]


def _run(seeds: Sequence[int], folder: Path, only: Sequence[str], processes: int) -> Iterator[dict[str, str]]:
    parts = [seeds[i : i + 50] for i in range(0, len(seeds), 50)]
    if processes == 1:
        for part in parts:
            yield from _part(part, folder, only)
        return
    with ProcessPoolExecutor(processes) as pool:
        for done in pool.map(_part, parts, [folder] * len(parts), [only] * len(parts)):
            yield from done


def _kept(path: Path | None) -> list[dict[str, str]]:
    """Rows of an earlier run, written anew without the one within which it was stopped."""
    if path is None:
        return []
    rows = []
    if path.exists():
        with path.open(encoding="utf-8", newline="") as file:
            rows = [row for row in csv.DictReader(file) if row["what"] is not None]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, FIELDS)
        writer.writeheader()
        writer.writerows(rows)
    return rows


def table(rows: Sequence[dict[str, str]]) -> str:
    """Verdicts by kind; a mutant of two changes counts for both kinds, one that failed for the change after which it did."""
    counts = Counter((kind, row["verdict"]) for row in rows for kind in row["counts_for"].split(" + "))
    needless = Counter(
        kind for row in rows for kind in row["kinds"].split(" + ") if row["readable"] and row["verdict"] == "refused"
    )
    heads = ("kind", "mutants", *VERDICTS, "readable, but refused")
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for kind in [k.name for k in KINDS]:
        numbers = [counts[kind, v] for v in VERDICTS]
        if sum(numbers):
            shown = [str(v) if v else "" for v in (sum(numbers), *numbers, needless[kind])]
            lines.append("| " + " | ".join((kind, *shown)) + " |")
    totals = Counter(row["verdict"] for row in rows)
    whole = [len(rows), *(totals[v] for v in VERDICTS), sum(bool(r["readable"]) and r["verdict"] == "refused" for r in rows)]
    lines.append("| all | " + " | ".join(str(v) for v in whole) + " |")
    return "\n".join(lines)


def _again(seed: int, folder: Path, only: Sequence[str], saved: Path) -> None:
    made = mutant(seed, folder, only)
    saved.mkdir(parents=True, exist_ok=True)
    path = saved / f"mutant_{seed}_{made.doc.path.name}"
    path.write_bytes(written(made.doc).data)
    row = verdict_row(seed, folder, only, saved)
    (saved / made.doc.path.name).unlink()
    for kind in made.kinds:
        print(f"{kind.name}: {kind.why}")
    print(f"{path}, read with {made.doc.reading}\n{row['verdict']}: {row['what']}")


def main() -> None:
    """Run and print; exit code 1 if anything was silent, crashed or was refused without advice."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=10_000, help="number of mutants")
    parser.add_argument("--seed", type=int, default=1, help="seed of the first, the next is one more")
    parser.add_argument("--folder", type=Path, default=ROOT.parent / "shared" / "labdata", help="folder of real lab files")
    parser.add_argument("--kinds", nargs="+", default=[], help="only these kinds of first changes", metavar="KIND")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        help="CSV file of the verdicts; its seeds are not run again, so take another for other options",
    )
    parser.add_argument("--again", type=int, metavar="SEED", help="this mutant only, written into --saved")
    parser.add_argument("--saved", type=Path, default=Path("mutants_saved"), help="folder for --again")
    options = parser.parse_args()
    if unknown := set(options.kinds) - {k.name for k in KINDS}:
        parser.error(f"no kind {', '.join(sorted(unknown))}; there are {', '.join(k.name for k in KINDS)}")
    if options.again is not None:
        _again(options.again, options.folder, options.kinds, options.saved)
        return
    wanted = range(options.seed, options.seed + options.n)
    rows = [row for row in _kept(options.output) if int(row["seed"]) in wanted]
    missing = sorted(set(wanted) - {int(row["seed"]) for row in rows})
    start = time.perf_counter()
    for row in _run(missing, options.folder, options.kinds, options.processes):
        rows.append(row)
        if options.output is not None:
            with options.output.open("a", encoding="utf-8", newline="") as file:
                csv.DictWriter(file, FIELDS).writerow(row)
    print(table(rows))
    failed = [row for row in rows if row["verdict"] in FAILURES]
    for row in failed[:50]:
        print(f"seed {row['seed']}, {row['file']}, {row['kinds']}: {row['verdict']}: {row['what']}", file=sys.stderr)
    n_file, seconds = len(documents(options.folder)), time.perf_counter() - start
    print(f"{len(missing)} mutants of {n_file} files in {seconds:.0f} s; {len(failed)} of {len(rows)} failed")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()

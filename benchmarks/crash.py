"""Break calibrations on purpose, see what their users are left with: `nice python benchmarks/crash.py -o crash.jsonl`.

A small experiment is calibrated, undisturbed once and then disturbed in many ways; each case must end right: the same draws
bit by bit after going on, or a refusal that names the file and leaves a way out. Parts: `kills` (SIGKILL at random moments),
`operations` (death or an error at each file operation, full disks), `doubles` (several commands on one run folder), `damages`
(changed files), `bytes` (one byte changed, for `calib verify`), `signals` (SIGINT and SIGTERM), `abuse` (odd names, folders,
environments). With -o the cases are kept, and a run that was stopped goes on. `--again PART NUMBER` repeats one. Commands are
forks of a process that has the modules loaded, and sample with few walkers and steps; with --cold they are the installed
command at its full size. Ends with 1 if a case is not right.
"""

from __future__ import annotations

import argparse
import json
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from crashes import abuse, damages, doubles, kills, operations, signals, single_bytes
from crashes.case import OUTCOMES, Case, Part
from crashes.command import load_all, make_small
from crashes.lab import Lab

PARTS: dict[str, Part] = {
    "kills": kills,
    "operations": operations,
    "doubles": doubles,
    "damages": damages,
    "bytes": single_bytes,
    "signals": signals,
    "abuse": abuse,
}
#: Cases of each part; 0 for all there are.
FULL = {"kills": 100, "operations": 0, "doubles": 100, "damages": 2000, "bytes": 400, "signals": 100, "abuse": 0}

# For so many cases of a part it takes longer to rehearse commands than it saves.
_FEW = 3


def main(words: Sequence[str] | None = None) -> int:
    """Run the parts that are asked for; 1 if anything is not right."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS), metavar="PART", help=", ".join(PARTS))
    parser.add_argument("-n", type=int, help="cases of each part at most [default: of each what docs/reliability.md has]")
    parser.add_argument("--from", type=int, default=0, dest="first", help="number of the first case [0]")
    parser.add_argument("--folder", type=Path, help="to work in, kept [default: a temporary one]")
    parser.add_argument(
        "-o", "--output", type=Path, help="file for the cases, a line of JSON each; those in it are not repeated"
    )
    parser.add_argument("--cold", action="store_true", help="start the installed command, at its full size")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="begin no case after this long")
    parser.add_argument("--again", nargs=2, metavar=("PART", "NUMBER"), help="repeat one case, and say all that is known of it")
    options = parser.parse_args(words)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have started this with it ignored
    if not options.cold:
        load_all()
        make_small()
    # No TemporaryDirectory, which every fork would remove when it ends.
    lab = Lab((options.folder or Path(tempfile.mkdtemp(prefix="calib-crash-"))).resolve(), options.cold)
    lab.folder.mkdir(parents=True, exist_ok=True)
    if not options.again and (options.n is None or options.n > _FEW):
        lab.rehearse()
    try:
        if options.again:
            case = PARTS[options.again[0]].case(lab, int(options.again[1]))
            print(case.line())
            return int(case.outcome != "right")
        return report(list(cases(lab, options)))
    finally:
        if options.folder is None:
            shutil.rmtree(lab.folder, ignore_errors=True)


def cases(lab: Lab, options: argparse.Namespace) -> Iterator[Case]:
    """All cases that are asked for, those that are known already first, each written down as it ends."""
    begun = time.monotonic()
    known = {(c.part, c.number): c for c in read(options.output)} if options.output else {}
    for name in options.parts:
        part = PARTS[name]
        asked = FULL[name] if options.n is None else options.n
        for number in range(options.first, part.size(lab, asked and options.first + asked)):
            if (name, number) in known:
                yield known[name, number]
            elif time.monotonic() - begun < options.seconds:
                yield write(one(part, lab, number), options.output)


def one(part: Part, lab: Lab, number: int) -> Case:
    """A case, with how long it took if it does not say."""
    begun = time.monotonic()
    case = part.case(lab, number)
    return case if case.seconds else replace(case, seconds=round(time.monotonic() - begun, 2))


def read(path: Path) -> list[Case]:
    """Cases of a file; none if it is not there. A last line that was cut is left out."""
    found = []
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        try:
            found.append(Case(**json.loads(line)))
        except ValueError:
            continue
    return found


def write(case: Case, path: Path | None) -> Case:
    """Show a case that is not right, and append it to the file, if there is one."""
    if case.outcome != "right":
        print(f"{case.part} {case.number}: {case.outcome}: {case.what}: {case.note}", flush=True)
    if path is not None:
        with path.open("a", encoding="utf-8") as file:
            file.write(case.line() + "\n")
    return case


def report(found: list[Case]) -> int:
    """Print the table of parts and verdicts; 1 if anything is not right."""
    print(f"\n{'':12}{'cases':>7}" + "".join(f"{name:>13}" for name in OUTCOMES))
    for part in PARTS:
        counts = Counter(c.outcome for c in found if c.part == part)
        if counts:
            print(f"{part:12}{counts.total():7d}" + "".join(f"{counts[name]:13d}" for name in OUTCOMES))
    bad = sum(c.outcome != "right" for c in found)
    print(f"{bad} of {len(found)} not right")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())

"""Read files of a million rows: `python benchmarks/read_large_file.py`, prints seconds and peak memory of each.

Six files are written and each is read in a fresh process: a testing machine's (time, displacement, force); the same with a row
cut, one too long, one without its time, a blank line and a file end within the last row; one with a capacitance in every tenth
row only; one with times of day; an LCR log with decimal commas and thousands points; and one with everything quoted and
thousands commas. Targets: 5 s and 1 GB.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from itertools import chain, islice
from pathlib import Path

#: Targets: seconds and bytes.
SECONDS, MEMORY = 5.0, 1e9

_CHILD = """
import json, resource, sys, time
from pathlib import Path
from calib.lab.instruments import read_lab_file
base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
start, used = time.perf_counter(), time.process_time()
table = read_lab_file(Path(sys.argv[1]))
seconds, used = time.perf_counter() - start, time.process_time() - used
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
first = {q: [float(v[1]), float(v[-1])] for q, v in table.columns.items()}
print(json.dumps([seconds, used, peak * 1024, base * 1024, len(table.lines), first]))
"""


def machine(n_row: int) -> Iterator[str]:
    """Lines of a Bluehill file at 1 kHz: time [s], extension [mm], load [N]."""
    head = ('Text Inputs : Specimen label,"s 1"\r\n', "\r\n", "Time,Extension,Load\r\n", "(s),(mm),(N)\r\n")
    rows = (f"{i * 0.001:.5f},{-0.6 * (i % 1000) / 1000:.5f},{-8.4 * (i % 1000) / 1000:.5f}\r\n" for i in range(n_row))
    return chain(head, rows)


def ragged(n_row: int) -> Iterator[str]:
    """Those of `machine` with rows that differ from all others."""
    odd: dict[int, Callable[[str], str]] = {
        n_row // 2: lambda row: row[: row.rindex(",")] + "\r\n",
        n_row // 2 + 9: lambda row: row.replace("\r\n", ",,\r\n"),
        n_row // 2 + 99: lambda row: row[row.index(",") :],
        n_row // 2 + 999: lambda row: f"\r\n{row}",
        n_row - 1: lambda row: row[:-5],
    }
    lines = machine(n_row)
    head = list(islice(lines, 4))
    return chain(head, (odd[i](row) if i in odd else row for i, row in enumerate(lines)))


def two_rates(n_row: int) -> Iterator[str]:
    """Lines of time [s], extension [mm], load [N], and in every tenth row a capacitance [pF]."""
    rows = (
        f"{i * 0.001:.3f},{-0.6 * (i % 1000) / 1000:.5f},{-8.4 * (i % 1000) / 1000:.5f}"
        f"{'' if i % 10 else f',{97.3 + (i % 1000) / 50:.4f}'}\n"
        for i in range(n_row)
    )
    return chain(("Time (s),Extension (mm),Load (N),Cp (pF)\n",), rows)


def clocked(n_row: int) -> Iterator[str]:
    """Lines of a log with a date and the time of day at 100 Hz, extension [mm], load [N]."""
    rows = (
        f"2024-05-02 {8 + i // 360_000:02d}:{i // 6_000 % 60:02d}:{i % 6_000 / 100:05.2f},{-0.6 * (i % 1000) / 1000:.5f},"
        f"{-8.4 * (i % 1000) / 1000:.5f}\r\n"
        for i in range(n_row)
    )
    return chain(("Time,Extension (mm),Load (N)\r\n",), rows)


def meter(n_row: int) -> Iterator[str]:
    """Lines of an LCR log in German notation: time [ms], capacitance [pF], D; thousands points from the first second on."""

    def number(value: float, digits: int) -> str:
        return f"{value:,.{digits}f}".translate(str.maketrans(".,", ",."))

    rows = (f"{number(i * 20, 1)};{number(97.3 + abs(i % 1000 - 500) / 25, 4)};0,0123\n" for i in range(n_row))
    return chain(("Zeit [ms];Cp [pF];D\n",), rows)


def quoted(n_row: int) -> Iterator[str]:
    """Lines of a Bluehill Universal export: everything quoted, a blank first column, thousands commas from 1,000 s on."""
    rows = (
        f'"","{i * 0.02:,.4f}","{0.6 * (i % 1000) / 1000:.4f}","{0.0084 * (i % 1000) / 1000:.6f}"\r\n' for i in range(n_row)
    )
    return chain(("1,Time,Displacement,Force\r\n", ",(s),(mm),(kN)\r\n"), rows)


FILES: dict[str, Callable[[int], Iterator[str]]] = {
    "machine": machine,
    "ragged": ragged,
    "two rates": two_rates,
    "time of day": clocked,
    "lcr": meter,
    "quoted": quoted,
}


def main() -> None:
    """Write, read, print; exit code 1 if a target is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-n", type=int, default=1_000_000, help="number of rows")
    parser.add_argument("--files", nargs="+", choices=list(FILES), default=list(FILES))
    options = parser.parse_args()
    missed = False
    with tempfile.TemporaryDirectory() as folder:
        for name in options.files:
            path = Path(folder) / f"{name.replace(' ', '_')}.csv"
            with path.open("w", encoding="utf-8", newline="") as file:
                file.writelines(FILES[name](options.n))
            done = subprocess.run([sys.executable, "-c", _CHILD, str(path)], capture_output=True, text=True, check=False)
            if done.returncode:
                print(f"{name}: failed\n{done.stderr[-2000:]}")
                missed = True
                continue
            seconds, used, peak, before, n_row, ends = json.loads(done.stdout)
            missed |= seconds > SECONDS or peak > MEMORY or n_row != options.n
            print(
                f"{name}: {path.stat().st_size / 1e6:.0f} MB, {n_row} rows in {seconds:.2f} s "
                f"({used:.2f} s of the processor), peak {peak / 1e6:.0f} MB ({before / 1e6:.0f} MB before); "
                f"second and last row {ends}"
            )
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()

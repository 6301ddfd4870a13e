"""Kinds of labs and seeds in, what came of each out, as rows: over processes, kept in a file, and not done twice."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Any


def kept_rows(output: Path | None) -> list[dict[str, Any]]:
    """What a file holds already, a line of JSON each; nothing if there is none. A line that was not finished is taken out."""
    if output is None or not output.exists():
        return []
    text = output.read_text(encoding="utf-8")
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        output.write_text(whole, encoding="utf-8")
    return [json.loads(line) for line in whole.splitlines()]


def keep_row(output: Path | None, row: dict[str, Any]) -> None:
    """Add a row to a file, if there is to be one."""
    if output is not None:
        with output.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")


def rows_of(
    calibrate: Callable[..., dict[str, Any]], kinds: Iterable[str], labs: int, steps: int, processes: int, output: Path | None
) -> list[dict[str, Any]]:
    """Calibrate labs and give a row for each, with those that a file holds already, by kind and seed.

    Parameters
    ----------
    calibrate : function of kind, seed and steps that gives a row with "kind" and "seed".
    kinds : of the labs.
    labs : of each kind.
    steps : of each walker, at most.
    processes : 0 for none beside this one.
    output : file for the rows, a line of JSON each; None for none.
    """
    rows = kept_rows(output)
    known = {(row["kind"], row["seed"]) for row in rows}
    wanted = [(kind, seed) for seed, kind in product(range(labs), kinds) if (kind, seed) not in known]
    with ProcessPoolExecutor(max(processes, 1), mp_context=get_context("spawn")) as workers:
        pending = [workers.submit(calibrate, *lab, steps) for lab in wanted] if processes else []
        found = (done.result() for done in as_completed(pending)) if pending else (calibrate(*lab, steps) for lab in wanted)
        for row in found:
            rows.append(row)
            keep_row(output, row)
    return sorted(rows, key=lambda row: (row["kind"], row["seed"]))


def lab_parser(doc: str | None, kinds: Iterable[str], labs: int) -> argparse.ArgumentParser:
    """The options that all benchmarks of labs have: kinds, how many of each, processes and the file for the rows.

    Parameters
    ----------
    doc : of the benchmark.
    kinds : that there are.
    labs : how many of each if nothing is said.
    """
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"all, or some of: {'; '.join(kinds)}".replace("%", "%%"))
    parser.add_argument("--labs", type=int, default=labs, help="of each kind")
    parser.add_argument("--processes", type=int, default=2, help="0 for none beside this one")
    parser.add_argument("-o", "--output", type=Path, help="file for the labs, a line of JSON each")
    return parser


def parsed(parser: argparse.ArgumentParser, words: Sequence[str] | None, kinds: Iterable[str]) -> argparse.Namespace:
    """What was asked for, all kinds if none is named; a kind that there is not ends the benchmark.

    Parameters
    ----------
    parser : from `lab_parser`.
    words : of the command line; None for those of this process.
    kinds : that there are.
    """
    known = list(kinds)
    given = parser.parse_args(words)
    if unknown := [name for name in given.kinds if name not in known]:
        parser.error(f"there is no kind {unknown[0]!r}; choose from: {'; '.join(known)}")
    given.kinds = given.kinds or known
    return given


def print_labs(
    words: Sequence[str] | None,
    doc: str | None,
    kinds: Sequence[str] | Mapping[str, object],
    calibrate: Callable[..., dict[str, Any]],
    table: Callable[[Sequence[Mapping[str, Any]]], Iterator[str]],
    *,
    labs: int,
    limit: tuple[str, int, str],
) -> None:
    """Calibrate the labs that are asked for and print the table of all, by kinds in their order.

    Parameters
    ----------
    words : of the command line; None for those of this process.
    doc : of the benchmark.
    kinds : that there are.
    calibrate : as in `rows_of`.
    table : lines of all rows.
    labs : of each kind if nothing is said.
    limit : name of the option whose number `calibrate` takes beside kind and seed, its default, and its help.
    """
    option, default, meaning = limit
    order = list(kinds)
    parser = lab_parser(doc, order, labs)
    parser.add_argument(option, dest="limit", metavar="N", type=int, default=default, help=meaning)
    given = parsed(parser, words, order)
    rows = rows_of(calibrate, given.kinds, given.labs, given.limit, given.processes, given.output)
    print("\n".join(table(sorted(rows, key=lambda row: order.index(row["kind"])))))
